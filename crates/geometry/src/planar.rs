//! The plane's geometry: shapes checked and made into colliders, and the trait's answers.
//! Knows no bodies and no contact arithmetic.

use crate::check;
use crate::collider::Collider;
use crate::core_planar::PlanarCore;
use crate::geometry::{
    ABREAST, Aabb, Closest, ContactPoint, Geometry, Guess, Look, RayHit, ShapeError, Told,
};
use crate::hull::convex_hull_planar;
use crate::kernel::Kernel;
use crate::mass::MassProperties;
use crate::shape::{PlanarPart, PlanarShape};
use crate::surface::Surface;
use crate::{balls, mass_planar, narrow, query};
use carom_math::{Column, Planar, Pose, Rotation, Space, Vec2, vec2};

impl Geometry for Planar {
    type Shape = PlanarShape;
    type Collider = Collider<Planar>;

    fn collider(shape: &PlanarShape) -> Result<Self::Collider, ShapeError> {
        match shape {
            PlanarShape::Compound { parts } => compound(parts),
            PlanarShape::HalfPlane { normal } => Ok(Collider::half_space(check::normal("normal", *normal)?)),
            PlanarShape::Cavity { radius } => {
                check::length("radius", *radius)?;
                Ok(Collider::cavity(*radius))
            }
            PlanarShape::Polyline { points, closed } => polyline("points", points, *closed),
            PlanarShape::HeightField { heights, width } => height_field(heights, *width),
            _ => convex(shape),
        }
    }
    fn bounds(collider: &Self::Collider, pose: &Pose<Self>, margin: f64) -> Aabb<Self> {
        collider.bounds(pose, margin)
    }
    fn extent(shape: &PlanarShape) -> f64 {
        Self::collider(shape).map_or(f64::NAN, |c| longest_side(&c.bounds(&Pose::default(), 0.0)))
    }
    fn is_ball(shape: &PlanarShape) -> bool {
        matches!(shape, PlanarShape::Circle { .. })
    }
    fn mass_properties(shape: &PlanarShape, density: f64) -> Result<MassProperties<Self>, ShapeError> {
        mass_planar::mass_properties(shape, density)
    }
    fn mass_properties_of(
        shape: &PlanarShape,
        density: &mut dyn FnMut(&[Vec2]) -> Vec<f64>,
        relative_tolerance: f64,
    ) -> Result<MassProperties<Self>, ShapeError> {
        mass_planar::mass_properties_of(shape, density, relative_tolerance)
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
        origin: Vec2,
        direction: Vec2,
        reach: f64,
    ) -> Option<RayHit<Self>> {
        query::raycast(collider, pose, origin, direction, reach)
    }
}

/// Longest side of a box \[m\].
pub(crate) fn longest_side<S: Space>(bounds: &Aabb<S>) -> f64 {
    (0..S::DIM).fold(0.0, |m: f64, i| m.max(bounds.max[i] - bounds.min[i]))
}

/// The pose of a compound's part, checked, its rotation brought to unit length.
pub(crate) fn part_pose<S: Kernel>(field: &str, pose: &Pose<S>) -> Result<Pose<S>, ShapeError> {
    check::point(&format!("{field}.position"), pose.position)?;
    let numbers = pose.rotation.as_slice();
    let length = numbers.iter().map(|x| x * x).sum::<f64>().sqrt();
    match pose.rotation.renormalized() {
        Some(rotation) if (length - 1.0).abs() <= 1e-6 => Ok(Pose::new(pose.position, rotation)),
        _ => Err(ShapeError::new(
            format!("{field}.rotation"),
            format!("must have length 1, got {numbers:?}"),
            "build rotations from an angle or an axis and an angle",
        )),
    }
}

/// Refusal of an empty or nested compound.
pub(crate) fn check_parts(count: usize, nested: Option<usize>) -> Result<(), ShapeError> {
    if count == 0 {
        return Err(ShapeError::new("parts", "a compound needs at least one part, got 0", "add a part"));
    }
    nested.map_or(Ok(()), |i| {
        Err(ShapeError::new(
            format!("parts[{i}].shape"),
            "a compound cannot contain a compound",
            "list the inner parts in the outer compound",
        ))
    })
}

fn compound(parts: &[PlanarPart]) -> Result<Collider<Planar>, ShapeError> {
    check_parts(parts.len(), parts.iter().position(|p| matches!(p.shape, PlanarShape::Compound { .. })))?;
    let part = |(i, part): (usize, &PlanarPart)| {
        let pose = part_pose(&format!("parts[{i}].pose"), &part.pose)?;
        let collider =
            Planar::collider(&part.shape).map_err(|e| check::within(&format!("parts[{i}].shape"), e))?;
        Ok((pose, collider))
    };
    Ok(Collider::compound(parts.iter().enumerate().map(part).collect::<Result<_, _>>()?))
}

fn convex(shape: &PlanarShape) -> Result<Collider<Planar>, ShapeError> {
    let (core, radius) = match shape {
        PlanarShape::Circle { radius } => (PlanarCore::Point([Vec2::ZERO]), Some(*radius)),
        PlanarShape::Capsule { length, radius } => {
            check::length("length", *length)?;
            let half = 0.5 * length;
            (PlanarCore::segment(vec2(-half, 0.0), vec2(half, 0.0)), Some(*radius))
        }
        PlanarShape::Box { size } => (rectangle(size)?, None),
        PlanarShape::RoundBox { size, radius } => (rectangle(size)?, Some(*radius)),
        PlanarShape::ConvexPolygon { points } => (polygon(points)?, None),
        PlanarShape::RoundPolygon { points, radius } => (polygon(points)?, Some(*radius)),
        PlanarShape::Segment { a, b } => {
            check::point("a", *a)?;
            check::point("b", *b)?;
            check::distinct("b", *a, *b)?;
            (PlanarCore::segment(*a, *b), None)
        }
        _ => return Err(ShapeError::new("type", "not a convex shape", "use a convex shape")),
    };
    if let Some(radius) = radius {
        check::length("radius", radius)?;
    }
    Ok(Collider::convex(core, radius.unwrap_or(0.0)))
}

fn rectangle(size: &[f64; 2]) -> Result<PlanarCore, ShapeError> {
    check::lengths("size", size)?;
    Ok(PlanarCore::rectangle(size.map(|s| 0.5 * s)))
}

fn polygon(points: &[Vec2]) -> Result<PlanarCore, ShapeError> {
    check::points("points", points, 3)?;
    Ok(PlanarCore::polygon(convex_hull_planar(points)?))
}

fn polyline(field: &str, points: &[Vec2], closed: bool) -> Result<Collider<Planar>, ShapeError> {
    check::points(field, points, if closed { 3 } else { 2 })?;
    let n = points.len();
    for i in 1..n {
        check::distinct(&format!("{field}[{i}]"), points[i - 1], points[i])?;
    }
    if closed {
        check::distinct(&format!("{field}[0]"), points[n - 1], points[0])?;
    }
    let walls = if closed { n } else { n - 1 };
    let facets = (0..walls).flat_map(|i| [i as u32, ((i + 1) % n) as u32]).collect();
    Ok(Collider::surface(Surface::new(points.to_vec(), facets, false, points.to_vec())))
}

fn height_field(heights: &[f64], width: f64) -> Result<Collider<Planar>, ShapeError> {
    check::length("width", width)?;
    if heights.len() < 2 {
        return Err(ShapeError::new(
            "heights",
            format!("needs at least 2 samples, got {}", heights.len()),
            "give a height at each end of the width",
        ));
    }
    let step = width / (heights.len() - 1) as f64;
    check::length("width", step).map_err(|e| check::within("spacing of", e))?;
    for (i, h) in heights.iter().enumerate() {
        check::point(&format!("heights[{i}]"), carom_math::vec1(*h))?;
    }
    // from right to left, so that the walls' normals point up
    let n = heights.len();
    let place = |i: usize| vec2(-0.5 * width + width * (i as f64 / (n - 1) as f64), heights[i]);
    let points: Vec<Vec2> = (0..n).rev().map(place).collect();
    polyline("heights", &points, false)
}
