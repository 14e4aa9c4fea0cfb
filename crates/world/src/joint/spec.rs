//! What a user says of a joint, before it becomes one.

use super::frame::JointKind;
use carom_math::Space;
use serde::{Deserialize, Serialize};

/// A point of a body that a joint holds.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case", bound = "")]
pub enum Anchor<S: Space> {
    /// The centre of mass.
    Center,
    /// A point in the axes of the body's shape, from the shape's origin \[m\].
    Body(S::Vector),
    /// The point of the body that is at this place of the world now \[m\].
    World(S::Vector),
}

/// A joint to be added to a world.
///
/// ```
/// use carom::{BodySpec, JointSpec, PlanarShape, Settings, World2, vec2};
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// let mut world = World2::new(Settings::default())?;
/// world.add("rod", BodySpec::heavy(PlanarShape::Box { size: [1.0, 0.1] }, 2.0))?;
/// world.add_joint("hinge", JointSpec::point("rod").at(vec2(-0.5, 0.0)))?;
/// world.step(1e-3)?;
/// let weight = world.reaction("hinge")?.force[1];
/// assert!((weight / (2.0 * 9.81) - 0.252).abs() < 1e-3); // let go level, a rod's hinge carries a quarter of it
/// # Ok(())
/// # }
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct JointSpec<S: Space> {
    /// What it holds.
    pub kind: JointKind,
    /// Name of body a.
    pub a: String,
    /// Name of body b; `None`: the world itself.
    pub b: Option<String>,
    /// Where it holds a.
    pub anchor_a: Option<Anchor<S>>,
    /// Where it holds b; with the world a place of the world.
    pub anchor_b: Option<Anchor<S>>,
    /// Length of a distance joint \[m\]; `None`: the present distance of the anchors.
    pub length: Option<f64>,
    /// True when the two bodies collide with each other. Default false.
    pub collide: bool,
}

impl<S: Space> JointSpec<S> {
    fn of(kind: JointKind, a: &str) -> Self {
        JointSpec { kind, a: a.into(), b: None, anchor_a: None, anchor_b: None, length: None, collide: false }
    }
    /// A point of the body stays at a point of the other, or of the world: a hinge in the plane, a ball joint in space.
    pub fn point(a: &str) -> Self {
        Self::of(JointKind::Point, a)
    }
    /// Two points keep their distance: a rod without mass.
    pub fn distance(a: &str) -> Self {
        Self::of(JointKind::Distance, a)
    }
    /// The bodies keep their relative pose: a weld.
    pub fn fixed(a: &str) -> Self {
        Self::of(JointKind::Fixed, a)
    }
    /// To this body instead of the world.
    pub fn to(mut self, b: &str) -> Self {
        self.b = Some(b.into());
        self
    }
    /// At one place of the world \[m\], for both bodies.
    pub fn at(mut self, place: S::Vector) -> Self {
        (self.anchor_a, self.anchor_b) = (Some(Anchor::World(place)), Some(Anchor::World(place)));
        self
    }
    /// At these anchors.
    pub fn between(mut self, a: Anchor<S>, b: Anchor<S>) -> Self {
        (self.anchor_a, self.anchor_b) = (Some(a), Some(b));
        self
    }
    /// With this length \[m\], of a distance joint.
    pub fn long(mut self, length: f64) -> Self {
        self.length = Some(length);
        self
    }
    /// The two bodies collide with each other all the same.
    pub fn colliding(mut self) -> Self {
        self.collide = true;
        self
    }
}
