//! Space's geometry: shapes checked and made into colliders, and the trait's answers.
//! Knows no bodies and no contact arithmetic.

use crate::check;
use crate::collider::Collider;
use crate::core_spatial::SpatialCore;
use crate::geometry::{
    ABREAST, Aabb, Closest, ContactPoint, Geometry, Guess, Look, RayHit, ShapeError, Told,
};
use crate::hull::convex_hull_spatial;
use crate::mass::MassProperties;
use crate::mesh;
use crate::planar::{check_parts, longest_side, part_pose};
use crate::polytope::Polytope;
use crate::shape::{SpatialPart, SpatialShape};
use crate::{balls, mass_spatial, narrow, query};
use carom_math::{Column, Pose, Spatial, Vec3, vec3};
use std::sync::Arc;

impl Geometry for Spatial {
    type Shape = SpatialShape;
    type Collider = Collider<Spatial>;

    fn collider(shape: &SpatialShape) -> Result<Self::Collider, ShapeError> {
        match shape {
            SpatialShape::Compound { parts } => compound(parts),
            SpatialShape::HalfSpace { normal } => Ok(Collider::half_space(check::normal("normal", *normal)?)),
            SpatialShape::Cavity { radius } => {
                check::length("radius", *radius)?;
                Ok(Collider::cavity(*radius))
            }
            SpatialShape::TriMesh { vertices, triangles } => {
                Ok(Collider::surface(mesh::triangles(vertices, triangles)?))
            }
            SpatialShape::HeightField { heights, size } => {
                Ok(Collider::surface(mesh::height_field(heights, *size)?))
            }
            _ => convex(shape),
        }
    }
    fn bounds(collider: &Self::Collider, pose: &Pose<Self>, margin: f64) -> Aabb<Self> {
        collider.bounds(pose, margin)
    }
    fn extent(shape: &SpatialShape) -> f64 {
        Self::collider(shape).map_or(f64::NAN, |c| longest_side(&c.bounds(&Pose::default(), 0.0)))
    }
    fn is_ball(shape: &SpatialShape) -> bool {
        matches!(shape, SpatialShape::Sphere { .. })
    }
    fn mass_properties(shape: &SpatialShape, density: f64) -> Result<MassProperties<Self>, ShapeError> {
        mass_spatial::mass_properties(shape, density)
    }
    fn mass_properties_of(
        shape: &SpatialShape,
        density: &mut dyn FnMut(&[Vec3]) -> Vec<f64>,
        relative_tolerance: f64,
    ) -> Result<MassProperties<Self>, ShapeError> {
        mass_spatial::mass_properties_of(shape, density, relative_tolerance)
    }
    fn contacts_near(
        (a, pose_a): (&Self::Collider, &Pose<Self>),
        (b, pose_b): (&Self::Collider, &Pose<Self>),
        margin: f64,
        guess: &mut Guess<Self>,
        out: &mut Vec<ContactPoint<Self>>,
    ) {
        narrow::contacts(a, pose_a, b, pose_b, margin, guess, out);
    }
    #[inline]
    fn go_abreast(a: &Self::Collider, b: &Self::Collider) -> bool {
        narrow::go_abreast(a, b)
    }
    fn contacts_abreast(looks: &[Look<'_, Self>], out: &mut Vec<ContactPoint<Self>>) -> [Told; ABREAST] {
        narrow::contacts_abreast(looks, out)
    }
    fn ball_radius(collider: &Self::Collider) -> Option<f64> {
        narrow::ball_radius(collider)
    }
    #[inline]
    fn contact_of_balls(
        a: (Self::Vector, f64),
        b: (Self::Vector, f64),
        margin: f64,
    ) -> Option<Option<ContactPoint<Self>>> {
        balls::two_plain_balls(a, b, margin)
    }
    #[inline]
    fn contact_with_wall(
        ball: (Self::Vector, f64),
        wall: (&Self::Collider, &Pose<Self>),
        wall_is_a: bool,
        margin: f64,
    ) -> Option<Option<ContactPoint<Self>>> {
        balls::plain_ball_on_wall(ball, wall, wall_is_a, margin)
    }
    fn is_angular(collider: &Self::Collider) -> bool {
        collider.is_angular()
    }
    fn touch_once(a: &Self::Collider, b: &Self::Collider) -> bool {
        narrow::touch_once(a, b)
    }
    fn closest(
        a: &Self::Collider,
        pose_a: &Pose<Self>,
        b: &Self::Collider,
        pose_b: &Pose<Self>,
        reach: f64,
    ) -> Option<Closest<Self>> {
        query::closest(a, pose_a, b, pose_b, reach)
    }
    fn raycast(
        collider: &Self::Collider,
        pose: &Pose<Self>,
        origin: Vec3,
        direction: Vec3,
        reach: f64,
    ) -> Option<RayHit<Self>> {
        query::raycast(collider, pose, origin, direction, reach)
    }
}

fn compound(parts: &[SpatialPart]) -> Result<Collider<Spatial>, ShapeError> {
    check_parts(parts.len(), parts.iter().position(|p| matches!(p.shape, SpatialShape::Compound { .. })))?;
    let part = |(i, part): (usize, &SpatialPart)| {
        let pose = part_pose(&format!("parts[{i}].pose"), &part.pose)?;
        let collider =
            Spatial::collider(&part.shape).map_err(|e| check::within(&format!("parts[{i}].shape"), e))?;
        Ok((pose, collider))
    };
    Ok(Collider::compound(parts.iter().enumerate().map(part).collect::<Result<_, _>>()?))
}

fn convex(shape: &SpatialShape) -> Result<Collider<Spatial>, ShapeError> {
    let (core, radius) = match shape {
        SpatialShape::Sphere { radius } => (SpatialCore::Point([Vec3::ZERO]), Some(("radius", *radius))),
        SpatialShape::Capsule { length, radius } => {
            check::length("length", *length)?;
            let half = 0.5 * length;
            (SpatialCore::Segment([vec3(0.0, 0.0, -half), vec3(0.0, 0.0, half)]), Some(("radius", *radius)))
        }
        SpatialShape::Box { size } => (cuboid(size)?, None),
        SpatialShape::RoundBox { size, radius } => (cuboid(size)?, Some(("radius", *radius))),
        SpatialShape::Cylinder { height, radius } => (round(*height, *radius, false)?, None),
        SpatialShape::RoundCylinder { height, radius, rounding } => {
            (round(*height, *radius, false)?, Some(("rounding", *rounding)))
        }
        SpatialShape::Cone { height, radius } => (round(*height, *radius, true)?, None),
        SpatialShape::RoundCone { height, radius, rounding } => {
            (round(*height, *radius, true)?, Some(("rounding", *rounding)))
        }
        SpatialShape::ConvexHull { points } => (hull(points)?, None),
        SpatialShape::RoundConvexHull { points, radius } => (hull(points)?, Some(("radius", *radius))),
        _ => return Err(ShapeError::new("type", "not a convex shape", "use a convex shape")),
    };
    if let Some((field, radius)) = radius {
        check::length(field, radius)?;
    }
    Ok(Collider::convex(core, radius.map_or(0.0, |r| r.1)))
}

fn cuboid(size: &[f64; 3]) -> Result<SpatialCore, ShapeError> {
    check::lengths("size", size)?;
    Ok(SpatialCore::Polytope(Arc::new(Polytope::cuboid(size.map(|s| 0.5 * s)))))
}

fn round(height: f64, radius: f64, apex: bool) -> Result<SpatialCore, ShapeError> {
    check::length("height", height)?;
    check::length("radius", radius)?;
    Ok(SpatialCore::round(height, radius, apex))
}

fn hull(points: &[Vec3]) -> Result<SpatialCore, ShapeError> {
    check::points("points", points, 4)?;
    let (corners, triangles) = convex_hull_spatial(points)?;
    Ok(SpatialCore::Polytope(Arc::new(Polytope::from_hull(corners, &triangles))))
}
