//! What a user says of a body, before it becomes one.

use carom_geometry::{Geometry, MassProperties};
use carom_math::{Column, Rotation};

/// How a body takes part in the motion.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum BodyKind {
    /// Moves under forces and impulses.
    #[default]
    Dynamic,
    /// Never moves: an obstacle.
    Fixed,
    /// Moves with the velocity it is given, whatever it meets.
    Kinematic,
}

impl BodyKind {
    /// The name as users write it.
    pub fn name(self) -> &'static str {
        match self {
            BodyKind::Dynamic => "dynamic",
            BodyKind::Fixed => "fixed",
            BodyKind::Kinematic => "kinematic",
        }
    }
}

/// Where a body's mass properties come from.
#[derive(Clone, Debug, PartialEq)]
pub enum MassSource<S: Geometry> {
    /// A constant density \[kg/m^DIM\]; the shape's closed form.
    Density(f64),
    /// A total mass \[kg\], spread evenly over the shape; a particle when there is no shape.
    Mass(f64),
    /// Given values, in shape axes; also the result of a density function's quadrature.
    Given(MassProperties<S>),
}

/// A body to be added to a world.
#[derive(Clone, Debug)]
pub struct BodySpec<S: Geometry> {
    /// How it takes part in the motion.
    pub kind: BodyKind,
    /// Its shape; `None` for a particle that touches nothing.
    pub shape: Option<S::Shape>,
    /// Its mass; not read for fixed and kinematic bodies.
    pub mass: MassSource<S>,
    /// Where its centre of mass is \[m\]; for obstacles, where the shape's frame is.
    pub position: S::Vector,
    /// When true, `position` places the shape's own frame instead of the centre of mass.
    pub position_is_origin: bool,
    /// Orientation of the shape's frame.
    pub rotation: S::Rotation,
    /// Velocity of the centre of mass \[m/s\].
    pub velocity: S::Vector,
    /// Angular velocity \[rad/s\], world axes.
    pub angular_velocity: S::Spin,
    /// False for a particle or a body whose turning is switched off: its inverse inertia is zero.
    pub can_rotate: bool,
    /// Coefficient of friction \[1\]. Default 0.5.
    pub friction: f64,
    /// Coefficient of rolling friction \[m\]: moment against rolling per normal force. Default 0.
    pub rolling_friction: f64,
    /// Coefficient of spinning friction \[m\]: moment about the normal per normal force; without effect in the
    /// plane. Default 0.
    pub spinning_friction: f64,
    /// Coefficient of restitution \[1\]. Default 0.
    pub restitution: f64,
    /// Coefficient of tangential restitution \[1\]: share of the slip that a bounce turns round, as far as friction
    /// reaches (theory eq. 3.19). Default 0.
    pub tangential_restitution: f64,
    /// Name of its material, by which pairs of materials are told apart. Default none.
    pub material: Option<String>,
    /// Linear damping rate \[1/s\]: v decays as exp(-rate t). Default none.
    pub linear_damping: f64,
    /// Angular damping rate \[1/s\]. Default none.
    pub angular_damping: f64,
    /// Groups the body belongs to, as bits. Default group 0.
    pub groups: u32,
    /// Groups the body collides with, as bits. Default all.
    pub collides_with: u32,
}

impl<S: Geometry> BodySpec<S> {
    fn of(kind: BodyKind, shape: Option<S::Shape>, mass: MassSource<S>) -> Self {
        BodySpec {
            kind,
            shape,
            mass,
            position: S::Vector::ZERO,
            position_is_origin: false,
            rotation: S::Rotation::IDENTITY,
            velocity: S::Vector::ZERO,
            angular_velocity: S::Spin::ZERO,
            can_rotate: true,
            friction: 0.5,
            rolling_friction: 0.0,
            spinning_friction: 0.0,
            restitution: 0.0,
            tangential_restitution: 0.0,
            material: None,
            linear_damping: 0.0,
            angular_damping: 0.0,
            groups: 1,
            collides_with: u32::MAX,
        }
    }
    /// A body of constant density.
    pub fn dense(shape: S::Shape, density: f64) -> Self {
        Self::of(BodyKind::Dynamic, Some(shape), MassSource::Density(density))
    }
    /// A body of given total mass.
    pub fn heavy(shape: S::Shape, mass: f64) -> Self {
        Self::of(BodyKind::Dynamic, Some(shape), MassSource::Mass(mass))
    }
    /// A body of given mass properties, with or without a shape.
    pub fn given(shape: Option<S::Shape>, properties: MassProperties<S>) -> Self {
        Self::of(BodyKind::Dynamic, shape, MassSource::Given(properties))
    }
    /// A particle: mass without extent, so nothing turns it. A shape only makes it collide.
    pub fn particle(shape: Option<S::Shape>, mass: f64) -> Self {
        BodySpec { can_rotate: false, ..Self::of(BodyKind::Dynamic, shape, MassSource::Mass(mass)) }
    }
    /// A fixed obstacle.
    pub fn fixed(shape: S::Shape) -> Self {
        Self::of(BodyKind::Fixed, Some(shape), MassSource::Mass(1.0))
    }
    /// An obstacle that moves with a given velocity.
    pub fn kinematic(shape: S::Shape) -> Self {
        Self::of(BodyKind::Kinematic, Some(shape), MassSource::Mass(1.0))
    }
    /// Places the centre of mass.
    pub fn at(mut self, position: S::Vector) -> Self {
        self.position = position;
        self
    }
    /// Places the shape's own frame.
    pub fn with_origin_at(mut self, position: S::Vector) -> Self {
        self.position = position;
        self.position_is_origin = true;
        self
    }
    /// Sets the orientation.
    pub fn turned(mut self, rotation: S::Rotation) -> Self {
        self.rotation = rotation;
        self
    }
    /// Sets the velocity of the centre of mass.
    pub fn moving(mut self, velocity: S::Vector) -> Self {
        self.velocity = velocity;
        self
    }
    /// Sets the angular velocity.
    pub fn spinning(mut self, angular_velocity: S::Spin) -> Self {
        self.angular_velocity = angular_velocity;
        self
    }
    /// Sets the coefficient of friction.
    pub fn friction(mut self, friction: f64) -> Self {
        self.friction = friction;
        self
    }
    /// Sets the coefficients of rolling and spinning friction \[m\].
    pub fn resisting(mut self, rolling: f64, spinning: f64) -> Self {
        self.rolling_friction = rolling;
        self.spinning_friction = spinning;
        self
    }
    /// Sets the coefficient of restitution.
    pub fn restitution(mut self, restitution: f64) -> Self {
        self.restitution = restitution;
        self
    }
    /// Sets the coefficient of tangential restitution.
    pub fn tangential_restitution(mut self, share: f64) -> Self {
        self.tangential_restitution = share;
        self
    }
    /// Names the material.
    pub fn material(mut self, name: &str) -> Self {
        self.material = Some(name.into());
        self
    }
    /// Sets the damping rates \[1/s\].
    pub fn damped(mut self, linear: f64, angular: f64) -> Self {
        self.linear_damping = linear;
        self.angular_damping = angular;
        self
    }
    /// Sets the collision groups.
    pub fn grouped(mut self, groups: u32, collides_with: u32) -> Self {
        self.groups = groups;
        self.collides_with = collides_with;
        self
    }
}
