//! Laws that hold for every pair of convex shapes, whatever found the contact.

use crate::common::*;
use carom_geometry::{Closest, Geometry};
use carom_math::{Column, Planar, Pose, Rotation, Space, Spatial};

/// Every ordered pair of shapes at many random poses, from far apart to deep inside each other.
fn each_pair<S: Geometry>(
    shapes: &[S::Shape],
    poses: usize,
    mut pose: impl FnMut(&mut Random) -> Pose<S>,
    mut law: impl FnMut(&S::Shape, &Pose<S>, &S::Shape, &Pose<S>, &mut Random),
) {
    let mut random = Random::new(17);
    for a in shapes {
        for b in shapes {
            for _ in 0..poses {
                let pose_a = pose(&mut random);
                let pose_b = pose(&mut random);
                law(a, &pose_a, b, &pose_b, &mut random);
            }
        }
    }
}

/// Signed separation along a unit normal from b to a, by the bounding box of both in a frame that has the
/// normal as its first axis: knows nothing of the contact code.
fn separation<S: Geometry>(
    a: &S::Collider,
    pose_a: &Pose<S>,
    b: &S::Collider,
    pose_b: &Pose<S>,
    turned: &Pose<S>,
) -> f64 {
    let low = S::bounds(a, &turned.compose(pose_a), 0.0).min[0];
    let high = S::bounds(b, &turned.compose(pose_b), 0.0).max[0];
    low - high
}

/// Overlaps deeper than `deepest` \[m\] are left out, witnesses must agree with normal and gap to `tolerance`.
fn closest_is_the_largest_separation<S: Geometry>(
    shapes: &[S::Shape],
    pose: impl FnMut(&mut Random) -> Pose<S>,
    mut frame: impl FnMut(&mut Random, S::Vector, f64) -> Pose<S>,
    tolerance: f64,
    deepest: f64,
) {
    each_pair::<S>(shapes, 20, pose, |a, pose_a, b, pose_b, random| {
        let (ca, cb) = (collider::<S>(a), collider::<S>(b));
        let found: Closest<S> = S::closest(&ca, pose_a, &cb, pose_b, f64::INFINITY).unwrap();
        if found.gap < -deepest {
            return;
        }
        let own = separation::<S>(&ca, pose_a, &cb, pose_b, &frame(random, found.normal, 0.0));
        assert!(
            (own - found.gap).abs() < 1e-12,
            "{a:?} {pose_a:?}\n{b:?} {pose_b:?}: {} along its normal {own}",
            found.gap
        );
        for k in 0..200 {
            // half of the trials look near the normal that was found
            let spread = if k % 2 == 0 { 4.0 } else { 0.1 / (1 + k) as f64 };
            let other = separation::<S>(&ca, pose_a, &cb, pose_b, &frame(random, found.normal, spread));
            assert!(
                other <= found.gap + tolerance,
                "{a:?} {pose_a:?}\n{b:?} {pose_b:?}\n{found:?}: another direction separates by {other}"
            );
        }
        let apart = found.point_a - found.point_b;
        assert!(
            (apart - found.normal * found.gap).norm() < 10.0 * tolerance,
            "witnesses {apart:?} for {found:?}\n{a:?} {pose_a:?}\n{b:?} {pose_b:?}"
        );
    });
}

/// A frame that sees a direction (moved by up to `spread`) along its first axis.
fn frame2(random: &mut Random, normal: carom_math::Vec2, spread: f64) -> Pose<Planar> {
    let n = (normal + random.vec2() * spread).normalized().unwrap_or(normal);
    Pose::new(Column::ZERO, carom_math::Turn([n[0], -n[1]]))
}

fn frame3(random: &mut Random, normal: carom_math::Vec3, spread: f64) -> Pose<Spatial> {
    let n = (normal + random.vec3() * spread).normalized().unwrap_or(normal);
    let (t, u) = (Spatial::tangent(n, 0), Spatial::tangent(n, 1));
    Pose::new(Column::ZERO, carom_math::Quaternion::from_matrix(&[n.0, t.0, u.0]))
}

#[test]
fn no_direction_separates_convex_shapes_of_the_plane_more_than_the_one_found() {
    closest_is_the_largest_separation::<Planar>(
        &convex_planar(),
        |r| r.pose2(0.6),
        frame2,
        1e-12,
        f64::INFINITY,
    );
}

#[test]
fn no_direction_separates_flat_shapes_of_space_more_than_the_one_found() {
    closest_is_the_largest_separation::<Spatial>(
        &flat_spatial(),
        |r| r.pose3(0.6),
        frame3,
        1e-12,
        f64::INFINITY,
    );
}

#[test]
fn no_direction_separates_curved_shapes_of_space_more_than_the_one_found() {
    closest_is_the_largest_separation::<Spatial>(&convex_spatial(), |r| r.pose3(0.6), frame3, 1e-7, 0.15);
}

fn swapping_flips_normals_and_keeps_gaps<S: Geometry>(
    shapes: &[S::Shape],
    pose: impl FnMut(&mut Random) -> Pose<S>,
    tolerance: f64,
) {
    each_pair::<S>(shapes, 20, pose, |a, pose_a, b, pose_b, _| {
        let there = contacts::<S>(a, pose_a, b, pose_b, 0.05);
        let back = contacts::<S>(b, pose_b, a, pose_a, 0.05);
        let context = || format!("{a:?} {pose_a:?}\n{b:?} {pose_b:?}\n{there:#?}\n{back:#?}");
        assert_eq!(there.len(), back.len(), "{}", context());
        for p in &there {
            let twin = back.iter().find(|q| {
                (q.point - p.point).norm() < tolerance
                    && (q.normal + p.normal).norm() < tolerance
                    && (q.gap - p.gap).abs() < tolerance
            });
            assert!(twin.is_some(), "{p:?}\n{}", context());
        }
    });
}

#[test]
fn swapping_the_shapes_flips_normals_and_keeps_gaps_in_the_plane() {
    swapping_flips_normals_and_keeps_gaps::<Planar>(&convex_planar(), |r| r.pose2(0.6), 1e-10);
}

#[test]
fn swapping_the_shapes_flips_normals_and_keeps_gaps_in_space() {
    swapping_flips_normals_and_keeps_gaps::<Spatial>(&flat_spatial(), |r| r.pose3(0.6), 1e-10);
}

fn a_common_motion_moves_the_contacts_along<S: Geometry>(
    shapes: &[S::Shape],
    mut pose: impl FnMut(&mut Random) -> Pose<S>,
    mut motion: impl FnMut(&mut Random) -> Pose<S>,
    tolerance: f64,
) {
    each_pair::<S>(shapes, 20, &mut pose, |a, pose_a, b, pose_b, random| {
        let motion = motion(random);
        let here = contacts::<S>(a, pose_a, b, pose_b, 0.05);
        let there = contacts::<S>(a, &motion.compose(pose_a), b, &motion.compose(pose_b), 0.05);
        assert_eq!(here.len(), there.len(), "{a:?} {pose_a:?}\n{b:?} {pose_b:?}");
        for (p, q) in here.iter().zip(&there) {
            assert!((motion.to_world(p.point) - q.point).norm() < tolerance, "{p:?} {q:?}");
            assert!((motion.rotation.rotate(p.normal) - q.normal).norm() < tolerance, "{p:?} {q:?}");
            assert!((p.gap - q.gap).abs() < tolerance, "{p:?} {q:?}");
            assert_eq!(p.feature, q.feature);
        }
    });
}

#[test]
fn a_common_rigid_motion_moves_the_contacts_along_in_the_plane() {
    a_common_motion_moves_the_contacts_along::<Planar>(
        &convex_planar(),
        |r| r.pose2(0.6),
        |r| r.pose2(10.0),
        1e-11,
    );
}

#[test]
fn a_common_rigid_motion_moves_the_contacts_along_in_space() {
    a_common_motion_moves_the_contacts_along::<Spatial>(
        &flat_spatial(),
        |r| r.pose3(0.6),
        |r| r.pose3(10.0),
        1e-11,
    );
}

fn contacts_are_well_formed<S: Geometry>(
    shapes: &[S::Shape],
    pose: impl FnMut(&mut Random) -> Pose<S>,
    most: usize,
) {
    each_pair::<S>(shapes, 30, pose, |a, pose_a, b, pose_b, _| {
        let margin = 0.05;
        let found = contacts::<S>(a, pose_a, b, pose_b, margin);
        let nearest = closest::<S>(a, pose_a, b, pose_b, f64::INFINITY).unwrap();
        let context = || format!("{a:?} {pose_a:?}\n{b:?} {pose_b:?}\n{found:#?}\n{nearest:?}");
        assert!(found.len() <= most, "{}", context());
        assert_eq!(found.is_empty(), nearest.gap > margin, "{}", context());
        if !found.is_empty() {
            assert!((deepest::<S>(&found) - nearest.gap).abs() < 1e-9, "{}", context());
        }
        for (i, p) in found.iter().enumerate() {
            assert!((p.normal.norm() - 1.0).abs() < 1e-13, "{}", context());
            assert!(p.gap <= margin && p.gap.is_finite() && p.point.is_finite(), "{}", context());
            assert!(found[..i].iter().all(|q| q.feature != p.feature), "{}", context());
        }
    });
}

#[test]
fn contacts_appear_exactly_within_the_margin_with_unit_normals_and_distinct_features() {
    contacts_are_well_formed::<Planar>(&convex_planar(), |r| r.pose2(0.6), 2);
    contacts_are_well_formed::<Spatial>(&convex_spatial(), |r| r.pose3(0.6), 4);
}

#[test]
fn the_same_arguments_give_the_same_bits() {
    each_pair::<Spatial>(
        &convex_spatial(),
        3,
        |r| r.pose3(0.5),
        |a, pose_a, b, pose_b, random| {
            let first = contacts::<Spatial>(a, pose_a, b, pose_b, 0.05);
            // other work in between must not leave a trace
            contacts::<Spatial>(b, &random.pose3(0.3), a, pose_a, 0.05);
            assert_eq!(first, contacts::<Spatial>(a, pose_a, b, pose_b, 0.05));
        },
    );
}
