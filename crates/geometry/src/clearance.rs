//! How far shapes of many parts surely are from others: what lies in a hollow body, or over a ground, is asked again and again for
//! contacts that it seldom has. Decides nothing but when to ask again.

use crate::collider::Collider;
use crate::kernel::Kernel;
use carom_math::{Column, Pose};

/// So many sizes of a shape it is asked how far the parts of another one are \[1\].
const CLEAR: f64 = 4.0;

/// A distance that two shapes surely have \[m\], one of which has parts, where no parts are within the margin \[m\].
pub(crate) fn clearance<S: Kernel>(
    (a, pose_a): (&Collider<S>, &Pose<S>),
    (b, pose_b): (&Collider<S>, &Pose<S>),
    margin: f64,
) -> f64 {
    let seen = |frame: &Pose<S>, other: &Collider<S>, pose: &Pose<S>| {
        let bounds = other.bounds(&frame.inverse().compose(pose), 0.0);
        (bounds, margin + CLEAR * (bounds.max - bounds.min).norm())
    };
    a.clearance(|| seen(pose_a, b, pose_b)).max(b.clearance(|| seen(pose_b, a, pose_a)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::{Geometry, Guess};
    use crate::narrow::tests::numbers;
    use crate::shape::{PlanarPart, PlanarShape, SpatialShape};
    use carom_math::{Planar, Quaternion, Rotation, Spatial, Turn, Vec3, vec2, vec3};

    fn parts_are_as_far_as_is_told<S: Geometry>(
        hollow: &S::Collider,
        others: &[S::Collider],
        mut pose: impl FnMut(f64) -> Pose<S>,
    ) {
        let mut told = 0;
        for k in 0..400 {
            let (a, b) = (&others[k % others.len()], hollow);
            let (pose_a, pose_b) = (pose(2.5), pose(0.3));
            let (mut guess, mut out) = (Guess::default(), Vec::new());
            if k % 2 == 0 {
                S::contacts_near((a, &pose_a), (b, &pose_b), 0.05, &mut guess, &mut out);
            } else {
                S::contacts_near((b, &pose_b), (a, &pose_a), 0.05, &mut guess, &mut out);
            }
            let gap = S::closest(a, &pose_a, b, &pose_b, 99.0).expect("it is no farther").gap;
            assert!(guess.apart <= gap + 1e-12, "{guess:?} of {gap}");
            assert!(out.is_empty() || guess.apart == f64::NEG_INFINITY);
            told += usize::from(guess.apart > 0.05);
        }
        assert!(told > 50, "of {told} it is known that they are farther than was asked");
    }

    #[test]
    fn parts_are_at_least_as_far_as_is_told_of_them() {
        let mut number = numbers();
        let wall = |x: f64, y: f64, size: [f64; 2]| PlanarPart {
            pose: Pose::new(vec2(x, y), Turn::from_angle(0.1)),
            shape: PlanarShape::Box { size },
        };
        let parts = vec![
            wall(-3.0, 0.0, [0.5, 6.0]),
            wall(3.0, 0.0, [0.5, 6.0]),
            wall(0.0, -3.0, [6.0, 0.5]),
            wall(0.0, 3.0, [6.0, 0.5]),
            wall(1.0, 1.0, [0.3, 0.3]),
        ];
        let hollow = Planar::collider(&PlanarShape::Compound { parts }).expect("a frame");
        let others = [
            PlanarShape::Box { size: [0.4, 0.3] },
            PlanarShape::Circle { radius: 0.2 },
            PlanarShape::Capsule { length: 0.4, radius: 0.1 },
        ];
        let others = others.map(|shape| Planar::collider(&shape).expect("a shape"));
        parts_are_as_far_as_is_told::<Planar>(&hollow, &others, |most| {
            Pose::new(vec2(number() * most, number() * most), Turn::from_angle(3.0 * number()))
        });
        let points: Vec<Vec3> = (0..49)
            .map(|k| vec3(f64::from(k % 7) - 3.0, f64::from(k / 7) - 3.0, 0.3 * f64::from(k * k % 5)))
            .collect();
        let triangles = (0..6_u32)
            .flat_map(|i| (0..6_u32).map(move |j| 7 * i + j))
            .flat_map(|k| [[k, k + 1, k + 8], [k, k + 8, k + 7]])
            .collect();
        let hollow =
            Spatial::collider(&SpatialShape::TriMesh { vertices: points, triangles }).expect("a ground");
        let others = [SpatialShape::Box { size: [0.4, 0.3, 0.2] }, SpatialShape::Sphere { radius: 0.2 }];
        let others = others.map(|shape| Spatial::collider(&shape).expect("a shape"));
        parts_are_as_far_as_is_told::<Spatial>(&hollow, &others, |most| {
            let place = vec3(number(), number(), number()) * most;
            Pose::new(place, Quaternion::about(vec3(number(), number(), number())))
        });
    }
}
