//! The bodies of a world: motion in flat arrays, what does not change in a step beside it. State is
//! (x, q, v, w) with x the centre of mass; the equivalent (p, L) is computed (theory chapter 1, item 8).

mod roles;
mod some;
mod stretch;

use crate::body::{BodyKind, BodySpec, MassSource};
use crate::error::BuildError;
use crate::joint::Joints;
use crate::material::Materials;
use carom_geometry::{ContactPoint, Geometry, MassProperties};
use carom_math::{Column, Inertia, Pose, Rotation, Space};
use carom_solver::{InverseMass, Twist};
use roles::Roles;
use std::collections::BTreeMap;
pub(crate) use stretch::MotionStretch;

/// The moving state of all bodies, one entry per body in each array.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Motion<S: Space> {
    /// Centres of mass \[m\].
    pub position: Vec<S::Vector>,
    /// Orientations.
    pub rotation: Vec<S::Rotation>,
    /// Velocities of the centres of mass \[m/s\].
    pub velocity: Vec<S::Vector>,
    /// Angular velocities \[rad/s\], world axes.
    pub angular_velocity: Vec<S::Spin>,
}

impl<S: Space> Motion<S> {
    /// Copies the numbers of some bodies of another motion of the same bodies.
    pub(crate) fn copy_some(&mut self, other: &Motion<S>, some: &[u32]) {
        for i in some.iter().map(|i| *i as usize) {
            self.position[i] = other.position[i];
            self.rotation[i] = other.rotation[i];
            self.velocity[i] = other.velocity[i];
            self.angular_velocity[i] = other.angular_velocity[i];
        }
    }
    /// True where a body has the same numbers in another motion.
    pub(crate) fn is_as_in(&self, other: &Motion<S>, i: usize) -> bool {
        self.position[i] == other.position[i]
            && self.rotation[i] == other.rotation[i]
            && self.velocity[i] == other.velocity[i]
            && self.angular_velocity[i] == other.angular_velocity[i]
    }
    /// Copies the numbers of another motion of the same bodies without moving this one's memory.
    pub fn copy_from(&mut self, other: &Motion<S>) {
        self.position.clone_from(&other.position);
        self.rotation.clone_from(&other.rotation);
        self.velocity.clone_from(&other.velocity);
        self.angular_velocity.clone_from(&other.angular_velocity);
    }
    /// Velocity and angular velocity of a body.
    #[inline]
    pub fn twist(&self, i: usize) -> Twist<S> {
        Twist::new(self.velocity[i], self.angular_velocity[i])
    }
    /// Sets velocity and angular velocity of a body.
    #[inline]
    pub fn set_twist(&mut self, i: usize, twist: &Twist<S>) {
        self.velocity[i] = twist.linear;
        self.angular_velocity[i] = twist.angular;
    }
    /// Position and orientation of a body.
    #[inline]
    pub fn pose(&self, i: usize) -> Pose<S> {
        Pose::new(self.position[i], self.rotation[i])
    }
}

/// What a step reads of a body and does not change. What all passes over bodies read comes first, in a cache line of its own;
/// what only some read comes last.
#[derive(Clone)]
#[repr(C, align(64))]
pub struct BodyData<S: Geometry> {
    /// Inverse mass \[1/kg\]; 0 for obstacles.
    pub inverse_mass: f64,
    /// Largest extent of the shape \[m\]; 0 without one, infinite for half-planes.
    pub extent: f64,
    /// Farthest that turning can carry a point of the surface, per radian \[m\]: 0 for discs and balls about their
    /// centre of mass, infinite for half-planes.
    pub turning_arm: f64,
    /// Radius of a disc or ball about its centre of mass \[m\]: its place says all of it.
    pub ball_radius: Option<f64>,
    /// Never used twice in a world; names the body's contacts.
    pub serial: u64,
    /// Groups the body belongs to.
    pub groups: u32,
    /// Groups the body collides with.
    pub collides_with: u32,
    /// How it takes part in the motion.
    pub kind: BodyKind,
    /// The shape has faces, edges and corners alone.
    pub is_angular: bool,
    /// Mass, centre of mass and inertia in shape axes; zeros for obstacles.
    pub mass_properties: MassProperties<S>,
    /// Inverse inertia in shape axes; zero for obstacles and particles.
    pub inverse_inertia: S::Inertia,
    /// Coefficient of friction \[1\].
    pub friction: f64,
    /// Coefficient of rolling friction \[m\].
    pub rolling_friction: f64,
    /// Coefficient of spinning friction \[m\].
    pub spinning_friction: f64,
    /// Coefficient of restitution \[1\].
    pub restitution: f64,
    /// Coefficient of tangential restitution \[1\].
    pub tangential_restitution: f64,
    /// Number of its material in the bodies' `materials`.
    pub material: Option<usize>,
    /// Shape made ready for queries.
    pub collider: Option<S::Collider>,
    /// Linear damping rate \[1/s\].
    pub linear_damping: f64,
    /// Angular damping rate \[1/s\].
    pub angular_damping: f64,
    /// Principal moments \[kg m^2\].
    pub principal: S::Spin,
    /// Rotation from principal axes to shape axes.
    pub axes: S::Rotation,
    /// Shape as given.
    pub shape: Option<S::Shape>,
}

impl<S: Geometry> BodyData<S> {
    /// True for a body that impulses move.
    #[inline]
    pub fn is_dynamic(&self) -> bool {
        self.kind == BodyKind::Dynamic
    }
    /// Inverse mass and inverse inertia in world axes at an orientation.
    #[inline]
    pub fn inverse_mass_at(&self, rotation: &S::Rotation) -> InverseMass<S> {
        InverseMass { linear: self.inverse_mass, angular: S::turned(&self.inverse_inertia, rotation) }
    }
    /// Inertia in world axes about the centre of mass at an orientation \[kg m^2\].
    #[inline]
    pub fn inertia_at(&self, rotation: &S::Rotation) -> S::Inertia {
        S::turned(&self.mass_properties.inertia, rotation)
    }
    /// Linear momentum m v \[kg m/s\], if it moved so.
    #[inline]
    pub fn momentum(&self, twist: &Twist<S>) -> S::Vector {
        twist.linear * self.mass_properties.mass
    }
    /// Angular momentum about the world's origin x x p + I w \[kg m^2/s\], if it moved so.
    #[inline]
    pub fn angular_momentum(&self, (pose, twist): (&Pose<S>, &Twist<S>)) -> S::Spin {
        let own = self.inertia_at(&pose.rotation).apply(twist.angular);
        S::moment(pose.position, self.momentum(twist)) + own
    }
    /// How far a point of the surface moves per radian of turning \[m\], with what a ball's surface moves in itself: what
    /// spin can become by friction.
    pub fn reach_of_turning(&self) -> f64 {
        self.turning_arm.max(0.5 * self.extent)
    }
    fn is_damped(&self) -> bool {
        self.linear_damping != 0.0 || self.angular_damping != 0.0
    }
}

/// So many shapes are compared with that of a new body.
const SHAPES: usize = 32;

/// All bodies of a world.
#[derive(Clone, Default)]
pub struct Bodies<S: Geometry> {
    /// The moving state.
    pub motion: Motion<S>,
    /// Everything else a step reads.
    pub data: Vec<BodyData<S>>,
    /// Names in order of index.
    pub names: Vec<String>,
    /// Their materials, and what was said of pairs of them.
    pub materials: Materials,
    /// What joins them.
    pub joints: Joints<S>,
    index: BTreeMap<String, usize>,
    serials: u64,
    roles: Roles,
    /// The last bodies whose shape no other had, the latest first.
    shapes: Vec<usize>,
    /// Mass times place of all bodies that sleep, summed \[kg m\].
    asleep_moment: S::Vector,
}

impl<S: Geometry> Bodies<S> {
    /// Number of bodies.
    pub fn len(&self) -> usize {
        self.data.len()
    }
    /// True when there are none.
    pub fn is_empty(&self) -> bool {
        self.data.is_empty()
    }
    /// Index of a named body.
    pub fn find(&self, name: &str) -> Option<usize> {
        self.index.get(name).copied()
    }
    /// Inverse mass and inverse inertia in world axes at the present orientation.
    #[inline]
    pub fn inverse_mass(&self, i: usize) -> InverseMass<S> {
        self.data[i].inverse_mass_at(&self.motion.rotation[i])
    }
    /// Inertia in world axes about the centre of mass \[kg m^2\]; zero for obstacles and particles.
    #[inline]
    pub fn inertia(&self, i: usize) -> S::Inertia {
        self.data[i].inertia_at(&self.motion.rotation[i])
    }
    /// Name of a body's material.
    pub fn material(&self, i: usize) -> Option<&str> {
        self.data[i].material.map(|number| self.materials.name(number))
    }
    /// Linear momentum p = m v \[kg m/s\]; zero for obstacles.
    #[inline]
    pub fn momentum(&self, i: usize) -> S::Vector {
        self.data[i].momentum(&self.motion.twist(i))
    }
    /// Angular momentum about the centre of mass L = I w \[kg m^2/s\].
    #[inline]
    pub fn spin_momentum(&self, i: usize) -> S::Spin {
        self.inertia(i).apply(self.motion.angular_velocity[i])
    }
    /// Angular momentum about the world's origin, x x p + I w.
    #[inline]
    pub fn angular_momentum(&self, i: usize) -> S::Spin {
        self.data[i].angular_momentum((&self.motion.pose(i), &self.motion.twist(i)))
    }
    /// Kinetic energy of translation, 1/2 m v^2 \[J\].
    pub fn translational_energy(&self, i: usize) -> f64 {
        0.5 * self.momentum(i).dot(self.motion.velocity[i])
    }
    /// Kinetic energy of rotation, 1/2 w^T I w \[J\].
    pub fn rotational_energy(&self, i: usize) -> f64 {
        0.5 * self.spin_momentum(i).dot(self.motion.angular_velocity[i])
    }
    /// Pose of the shape's own frame: the centre of mass is at its local `center`.
    #[inline]
    pub fn shape_pose(&self, i: usize) -> Pose<S> {
        let pose = self.motion.pose(i);
        if self.data[i].mass_properties.center == S::Vector::ZERO {
            return pose;
        }
        Pose::new(pose.position - pose.rotation.rotate(self.data[i].mass_properties.center), pose.rotation)
    }
    /// Appends the contact points of two bodies with gaps up to a margin \[m\].
    pub(crate) fn contact_points(&self, (a, b): (usize, usize), margin: f64, out: &mut Vec<ContactPoint<S>>) {
        let (one, other) = (&self.data[a], &self.data[b]);
        let (Some(ca), Some(cb)) = (&one.collider, &other.collider) else { return };
        let place = |i: usize| self.motion.position[i];
        let known = match (one.ball_radius, other.ball_radius) {
            (Some(r), Some(s)) => S::contact_of_balls((place(a), r), (place(b), s), margin),
            (Some(r), None) => S::contact_with_wall((place(a), r), (cb, &self.shape_pose(b)), false, margin),
            (None, Some(s)) => S::contact_with_wall((place(b), s), (ca, &self.shape_pose(a)), true, margin),
            (None, None) => None,
        };
        if let Some(found) = known {
            return out.extend(found);
        }
        S::contacts(ca, &self.shape_pose(a), cb, &self.shape_pose(b), margin, out);
    }
    /// Sets velocities from momenta (p, L): v = p/m, w = I^-1 L. Obstacles are left alone.
    pub fn set_momenta(&mut self, i: usize, momentum: S::Vector, spin_momentum: S::Spin) {
        if self.is_dynamic(i) {
            let inverse = self.inverse_mass(i);
            self.motion.velocity[i] = momentum * inverse.linear;
            self.motion.angular_velocity[i] = inverse.angular.apply(spin_momentum);
        }
    }

    /// Adds a body.
    ///
    /// # Errors
    /// [`BuildError`] naming body, field, value and remedy; nothing is added then.
    pub fn add(&mut self, name: &str, spec: BodySpec<S>) -> Result<usize, BuildError> {
        self.check_name(name)?;
        check_spec(name, &spec)?;
        let known = spec.shape.as_ref().and_then(|shape| self.collider_of(shape));
        let collider = match &spec.shape {
            Some(shape) => Some(match &known {
                Some(known) => known.clone(),
                None => S::collider(shape).map_err(|e| BuildError::shape(name, e))?,
            }),
            None => None,
        };
        let mass_properties = mass_of(name, &spec)?;
        let (kind, dynamic) = (spec.kind, spec.kind == BodyKind::Dynamic);
        let turns = dynamic && spec.can_rotate && mass_properties.inertia != S::Inertia::ZERO;
        let inverse_inertia = if turns { mass_properties.inertia.inverse() } else { Some(S::Inertia::ZERO) };
        let inverse_inertia = inverse_inertia.ok_or_else(|| {
            BuildError::body(
                name,
                "inertia",
                "is singular in f64",
                "give a body with extent in every direction",
            )
        })?;
        let (principal, axes) = S::principal(&mass_properties.inertia);
        let rotation = spec.rotation.renormalized().expect("checked");
        let center =
            if spec.position_is_origin { rotation.rotate(mass_properties.center) } else { S::Vector::ZERO };
        if known.is_none() && collider.is_some() {
            self.shapes.insert(0, self.data.len());
            self.shapes.truncate(SHAPES);
        }
        self.serials += 1;
        self.data.push(BodyData {
            kind: spec.kind,
            serial: self.serials,
            inverse_mass: if dynamic { 1.0 / mass_properties.mass } else { 0.0 },
            inverse_inertia,
            principal,
            axes,
            extent: spec.shape.as_ref().map_or(0.0, S::extent),
            ball_radius: ball_radius::<S>(collider.as_ref(), mass_properties.center),
            turning_arm: turning_arm::<S>(spec.shape.as_ref(), collider.as_ref(), mass_properties.center),
            is_angular: collider.as_ref().is_some_and(S::is_angular),
            mass_properties,
            shape: spec.shape,
            collider,
            friction: spec.friction,
            rolling_friction: spec.rolling_friction,
            spinning_friction: spec.spinning_friction,
            restitution: spec.restitution,
            tangential_restitution: spec.tangential_restitution,
            material: spec.material.map(|name| self.materials.learn(&name)),
            linear_damping: spec.linear_damping,
            angular_damping: spec.angular_damping,
            groups: spec.groups,
            collides_with: spec.collides_with,
        });
        self.motion.position.push(spec.position + center);
        self.motion.rotation.push(rotation);
        self.motion.velocity.push(spec.velocity);
        self.motion.angular_velocity.push(spec.angular_velocity);
        let is_damped = self.data.last().is_some_and(BodyData::is_damped);
        self.roles.add(self.names.len() as u32, kind, is_damped);
        self.index.insert(name.into(), self.names.len());
        self.names.push(name.into());
        Ok(self.names.len() - 1)
    }

    /// What another body of the same shape, among the last ones, has ready for queries: many have one shape, and few are near
    /// in memory.
    fn collider_of(&self, shape: &S::Shape) -> Option<S::Collider> {
        let known = self.shapes.iter().map(|i| &self.data[*i]);
        known.filter(|d| d.shape.as_ref() == Some(shape)).find_map(|d| d.collider.clone())
    }

    /// Shares nothing with the bodies there are: their shapes may be written by somebody.
    pub(crate) fn forget_shapes(&mut self) {
        self.shapes.clear();
    }

    /// Removes a body; those after it move up by one.
    ///
    /// # Errors
    /// [`BuildError`] when no body has this name, or a joint holds it.
    pub fn remove(&mut self, name: &str) -> Result<(), BuildError> {
        let i = self.find(name).ok_or_else(|| self.unknown(name))?;
        if let Some(&number) = self.joints.of_body(i).first() {
            let joint = &self.joints.names[number];
            let problem = format!("is held by joint '{joint}'");
            return Err(BuildError::body(name, "name", problem, "remove the joint first"));
        }
        self.joints.forget_body(i);
        self.data.remove(i);
        self.shapes.clear();
        self.names.remove(i);
        self.motion.position.remove(i);
        self.motion.rotation.remove(i);
        self.motion.velocity.remove(i);
        self.motion.angular_velocity.remove(i);
        self.find_roles();
        self.index = self.names.iter().cloned().enumerate().map(|(k, n)| (n, k)).collect();
        Ok(())
    }

    /// The error for a name that no body has, with the nearest one that exists.
    pub fn unknown(&self, name: &str) -> BuildError {
        let near = nearest(self.names.iter(), name);
        let remedy = near.map_or("the world has no bodies yet".into(), |n| format!("did you mean '{n}'?"));
        BuildError::body(name, "name", "is not in this world", remedy)
    }

    /// Serial numbers given out so far; for snapshots.
    pub(crate) fn serials(&self) -> u64 {
        self.serials
    }
    /// Sets how many serial numbers are given out; for snapshots.
    pub(crate) fn set_serials(&mut self, serials: u64) {
        self.serials = serials;
    }
    /// Sets a body's serial number; for snapshots.
    pub(crate) fn set_serial(&mut self, i: usize, serial: u64) {
        self.data[i].serial = serial;
    }

    fn check_name(&self, name: &str) -> Result<(), BuildError> {
        if name.is_empty() {
            return Err(BuildError::body(name, "name", "is empty", "give each body a name"));
        }
        if self.index.contains_key(name) {
            return Err(BuildError::body(name, "name", "is taken", "give each body a name of its own"));
        }
        Ok(())
    }
}

/// Farthest point of a shape from its centre of mass, by the corner of a box; 0 where turning moves no surface.
fn turning_arm<S: Geometry>(
    shape: Option<&S::Shape>,
    collider: Option<&S::Collider>,
    center: S::Vector,
) -> f64 {
    let (Some(shape), Some(collider)) = (shape, collider) else { return 0.0 };
    if S::is_ball(shape) && center == S::Vector::ZERO {
        return 0.0;
    }
    let bounds = S::bounds(collider, &Pose::default(), 0.0);
    let corner =
        S::Vector::from_fn(|k| (bounds.max[k] - center[k]).abs().max((bounds.min[k] - center[k]).abs()));
    corner.norm()
}

/// Radius of a ball about its centre of mass.
fn ball_radius<S: Geometry>(collider: Option<&S::Collider>, center: S::Vector) -> Option<f64> {
    S::ball_radius(collider?).filter(|_| center == S::Vector::ZERO)
}

/// The name that differs least from a word.
pub(crate) fn nearest<'a>(names: impl Iterator<Item = &'a String>, word: &str) -> Option<&'a String> {
    names.min_by_key(|name| edit_distance(name, word))
}

fn edit_distance(a: &str, b: &str) -> usize {
    let b: Vec<char> = b.chars().collect();
    let mut row: Vec<usize> = (0..=b.len()).collect();
    for (i, x) in a.chars().enumerate() {
        let mut diagonal = row[0];
        row[0] = i + 1;
        for (j, y) in b.iter().enumerate() {
            let replaced = diagonal + usize::from(x != *y);
            diagonal = row[j + 1];
            row[j + 1] = replaced.min(row[j] + 1).min(diagonal + 1);
        }
    }
    row[b.len()]
}

/// Mass properties of a new body, checked.
fn mass_of<S: Geometry>(name: &str, spec: &BodySpec<S>) -> Result<MassProperties<S>, BuildError> {
    let nothing =
        MassProperties { mass: 0.0, center: S::Vector::ZERO, inertia: S::Inertia::ZERO, error: 0.0 };
    if spec.kind != BodyKind::Dynamic {
        return Ok(nothing);
    }
    let refuse = |field: &str, value: f64, unit: &str| {
        BuildError::body(name, field, format!("must be > 0, got {value}"), format!("give {field} in {unit}"))
    };
    let positive = |x: f64| x > 0.0 && x.is_finite();
    match (&spec.mass, &spec.shape) {
        (MassSource::Density(density), Some(shape)) => {
            if !positive(*density) {
                return Err(refuse("density", *density, "kg/m^3 (kg/m^2 in the plane)"));
            }
            S::mass_properties(shape, *density).map_err(|e| BuildError::shape(name, e))
        }
        (MassSource::Density(_), None) => Err(BuildError::body(
            name,
            "density",
            "given without a shape",
            "give a mass for a particle, or a shape",
        )),
        (MassSource::Mass(mass), _) if !positive(*mass) => Err(refuse("mass", *mass, "kg")),
        (MassSource::Mass(mass), Some(shape)) if spec.can_rotate => {
            Ok(S::mass_properties(shape, 1.0).map_err(|e| BuildError::shape(name, e))?.with_mass(*mass))
        }
        (MassSource::Mass(mass), _) => Ok(MassProperties { mass: *mass, ..nothing }),
        (MassSource::Given(given), _) => {
            if !positive(given.mass) {
                return Err(refuse("mass", given.mass, "kg"));
            }
            if !given.center.is_finite() {
                return Err(BuildError::body(
                    name,
                    "center_of_mass",
                    "is not finite",
                    "give finite numbers in m",
                ));
            }
            if let Some(reason) =
                given.inertia.impossible_because().filter(|_| given.inertia != S::Inertia::ZERO)
            {
                return Err(BuildError::body(
                    name,
                    "inertia",
                    reason,
                    "check its entries, axes and units (kg m^2)",
                ));
            }
            Ok(*given)
        }
    }
}

/// Checks the numbers of a new body.
fn check_spec<S: Geometry>(name: &str, spec: &BodySpec<S>) -> Result<(), BuildError> {
    let finite = |field: &str, values: &[f64]| {
        if values.iter().all(|x| x.is_finite()) {
            return Ok(());
        }
        Err(BuildError::body(name, field, format!("must be finite, got {values:?}"), "give finite numbers"))
    };
    finite("position", spec.position.as_slice())?;
    finite("rotation", spec.rotation.as_slice())?;
    finite("velocity", spec.velocity.as_slice())?;
    finite("angular_velocity", spec.angular_velocity.as_slice())?;
    if spec.rotation.renormalized().is_none() {
        return Err(BuildError::body(
            name,
            "rotation",
            "has length 0",
            "give an angle or a quaternion of length 1",
        ));
    }
    for (field, value, most) in [
        ("friction", spec.friction, f64::MAX),
        ("rolling_friction", spec.rolling_friction, f64::MAX),
        ("spinning_friction", spec.spinning_friction, f64::MAX),
        ("restitution", spec.restitution, 1.0),
        ("tangential_restitution", spec.tangential_restitution, 1.0),
        ("linear_damping", spec.linear_damping, f64::MAX),
        ("angular_damping", spec.angular_damping, f64::MAX),
    ] {
        if !(value >= 0.0 && value <= most) {
            let range = if most == 1.0 { "in [0, 1]" } else { "finite and >= 0" };
            let remedy = format!("give a {field} {range}");
            return Err(BuildError::body(name, field, format!("must be {range}, got {value}"), remedy));
        }
    }
    if spec.material.as_deref() == Some("") {
        return Err(BuildError::body(name, "material", "is empty", "give it a name, or leave it out"));
    }
    let moves = spec.velocity != S::Vector::ZERO || spec.angular_velocity != S::Spin::ZERO;
    if spec.kind == BodyKind::Fixed && moves {
        let remedy = "make it kinematic, or leave the velocity out";
        return Err(BuildError::body(name, "velocity", "given for a fixed body", remedy));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use carom_geometry::PlanarShape;
    use carom_math::Planar;

    #[test]
    fn bodies_of_one_shape_share_what_is_made_ready_of_it() {
        let mut bodies = Bodies::<Planar>::default();
        let block = |side: f64| BodySpec::dense(PlanarShape::Box { size: [side, side] }, 1.0);
        for (k, side) in [1.0, 1.0, 2.0, 1.0].into_iter().enumerate() {
            bodies.add(&format!("block {k}"), block(side)).unwrap();
        }
        assert_eq!(bodies.shapes, [2, 0]);
        bodies.remove("block 0").unwrap();
        assert!(bodies.shapes.is_empty());
        bodies.add("another", block(2.0)).unwrap();
        let masses: Vec<f64> = bodies.data.iter().map(|d| d.mass_properties.mass).collect();
        assert_eq!(masses, [1.0, 4.0, 1.0, 4.0]);
        assert!(bodies.data.iter().all(|d| d.collider.is_some()));
    }
}
