//! Numbers and shapes of space in the words of rapier3d. Its cylinders and cones stand along y, ours along z.

use carom::{MassProperties, Quaternion, Rotation, Spatial, SpatialShape, Vec3, vec3};
use rapier3d::math::{Matrix, Pose as TheirPose, Rotation as TheirRotation, Vector};
use rapier3d::prelude::{MassProperties as TheirMass, SharedShape};

/// A vector.
pub fn vector(v: Vec3) -> Vector {
    Vector::new(v[0] as f32, v[1] as f32, v[2] as f32)
}
/// A vector of theirs.
pub fn vector_back(v: Vector) -> Vec3 {
    vec3(f64::from(v.x), f64::from(v.y), f64::from(v.z))
}
/// An angular velocity.
pub fn spin(w: Vec3) -> Vector {
    vector(w)
}
/// A pose.
pub fn pose(p: &carom::Pose<Spatial>) -> TheirPose {
    let [w, x, y, z] = p.rotation.0.map(|c| c as f32);
    TheirPose::from_parts(vector(p.position), TheirRotation::from_xyzw(x, y, z, w).normalize())
}
/// A pose of theirs, brought back to unit length in f64.
pub fn pose_back(p: &TheirPose) -> carom::Pose<Spatial> {
    let q = p.rotation;
    let rotation = Quaternion([q.w, q.x, q.y, q.z].map(f64::from));
    carom::Pose::new(vector_back(p.translation), rotation.renormalized().unwrap_or(rotation))
}
/// Mass properties about the shape's frame.
pub fn mass(m: &MassProperties<Spatial>) -> TheirMass {
    let ([xx, yy, zz], [xy, xz, yz]) = (m.inertia.diagonal, m.inertia.off);
    let column = |x: f64, y: f64, z: f64| vector(vec3(x, y, z));
    let inertia = Matrix::from_cols(column(xx, xy, xz), column(xy, yy, yz), column(xz, yz, zz));
    TheirMass::with_inertia_matrix(vector(m.center), m.mass as f32, inertia)
}
/// The shapes that make up one, each at its place.
///
/// # Errors
/// The shape's name when Rapier has none like it.
pub fn parts(shape: &SpatialShape) -> Result<Vec<(TheirPose, SharedShape)>, String> {
    let f = |x: f64| x as f32;
    let all = |points: &[Vec3]| -> Vec<Vector> { points.iter().map(|p| vector(*p)).collect() };
    let flat = || "the hull is flat in f32".to_string();
    let mut place = TheirPose::IDENTITY;
    let upright = TheirRotation::from_rotation_x(std::f32::consts::FRAC_PI_2);
    let one = match shape {
        SpatialShape::Sphere { radius } => SharedShape::ball(f(*radius)),
        SpatialShape::Capsule { length, radius } => SharedShape::capsule_z(f(0.5 * length), f(*radius)),
        SpatialShape::Box { size: [x, y, z] } => SharedShape::cuboid(f(0.5 * x), f(0.5 * y), f(0.5 * z)),
        SpatialShape::RoundBox { size: [x, y, z], radius } => {
            SharedShape::round_cuboid(f(0.5 * x), f(0.5 * y), f(0.5 * z), f(*radius))
        }
        SpatialShape::Cylinder { height, radius } => {
            place.rotation = upright;
            SharedShape::cylinder(f(0.5 * height), f(*radius))
        }
        SpatialShape::Cone { height, radius } => {
            place.rotation = upright;
            SharedShape::cone(f(0.5 * height), f(*radius))
        }
        SpatialShape::ConvexHull { points } => SharedShape::convex_hull(&all(points)).ok_or_else(flat)?,
        SpatialShape::RoundConvexHull { points, radius } => {
            SharedShape::round_convex_hull(&all(points), f(*radius)).ok_or_else(flat)?
        }
        SpatialShape::TriMesh { vertices, triangles } => {
            SharedShape::trimesh(all(vertices), triangles.clone()).map_err(|e| e.to_string())?
        }
        SpatialShape::HalfSpace { normal } => SharedShape::halfspace(vector(*normal).normalize()),
        SpatialShape::Compound { parts: inner } => {
            let mut found = Vec::new();
            for part in inner {
                let outer = pose(&part.pose);
                found.extend(parts(&part.shape)?.into_iter().map(|(at, shape)| (outer * at, shape)));
            }
            return Ok(found);
        }
        other => return Err(format!("not translated: {other:?}").chars().take(60).collect()),
    };
    Ok(vec![(place, one)])
}
