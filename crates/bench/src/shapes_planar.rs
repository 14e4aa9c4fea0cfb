//! Numbers and shapes of the plane in the words of rapier2d.

use carom::{MassProperties, Planar, PlanarShape, Turn, Vec1, Vec2, vec2};
use rapier2d::math::{Pose as TheirPose, Rotation as TheirRotation, Vector};
use rapier2d::prelude::{MassProperties as TheirMass, SharedShape};

/// A vector.
pub fn vector(v: Vec2) -> Vector {
    Vector::new(v[0] as f32, v[1] as f32)
}
/// A vector of theirs.
pub fn vector_back(v: Vector) -> Vec2 {
    vec2(f64::from(v.x), f64::from(v.y))
}
/// An angular velocity.
pub fn spin(w: Vec1) -> f32 {
    w[0] as f32
}
/// A pose.
pub fn pose(p: &carom::Pose<Planar>) -> TheirPose {
    TheirPose::from_parts(vector(p.position), TheirRotation::new(p.rotation.angle() as f32))
}
/// A pose of theirs, with the rotation's rounding to f32 taken as it is.
pub fn pose_back(p: &TheirPose) -> carom::Pose<Planar> {
    let angle = f64::from(p.rotation.angle());
    carom::Pose::new(vector_back(p.translation), Turn::from_angle(angle))
}
/// Mass properties about the shape's frame.
pub fn mass(m: &MassProperties<Planar>) -> TheirMass {
    TheirMass::new(vector(m.center), m.mass as f32, m.inertia.0 as f32)
}
/// The shapes that make up one, each at its place.
///
/// # Errors
/// The shape's name when Rapier has none like it.
pub fn parts(shape: &PlanarShape) -> Result<Vec<(TheirPose, SharedShape)>, String> {
    let f = |x: f64| x as f32;
    let all = |points: &[Vec2]| -> Vec<Vector> { points.iter().map(|p| vector(*p)).collect() };
    let flat = || "the polygon is flat in f32".to_string();
    let one = match shape {
        PlanarShape::Circle { radius } => SharedShape::ball(f(*radius)),
        PlanarShape::Capsule { length, radius } => SharedShape::capsule_x(f(0.5 * length), f(*radius)),
        PlanarShape::Box { size: [x, y] } => SharedShape::cuboid(f(0.5 * x), f(0.5 * y)),
        PlanarShape::RoundBox { size: [x, y], radius } => {
            SharedShape::round_cuboid(f(0.5 * x), f(0.5 * y), f(*radius))
        }
        PlanarShape::ConvexPolygon { points } => SharedShape::convex_hull(&all(points)).ok_or_else(flat)?,
        PlanarShape::RoundPolygon { points, radius } => {
            SharedShape::round_convex_hull(&all(points), f(*radius)).ok_or_else(flat)?
        }
        PlanarShape::Segment { a, b } => SharedShape::segment(vector(*a), vector(*b)),
        PlanarShape::Polyline { points, closed: false } => SharedShape::polyline(all(points), None),
        PlanarShape::HalfPlane { normal } => SharedShape::halfspace(vector(*normal).normalize()),
        PlanarShape::Compound { parts: inner } => {
            let mut found = Vec::new();
            for part in inner {
                let place = pose(&part.pose);
                found.extend(parts(&part.shape)?.into_iter().map(|(at, shape)| (place * at, shape)));
            }
            return Ok(found);
        }
        other => return Err(format!("not translated: {other:?}").chars().take(60).collect()),
    };
    Ok(vec![(TheirPose::IDENTITY, one)])
}
