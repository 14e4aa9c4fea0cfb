//! Gaps, normals and counts of simple pairs against what a pencil gives.

use crate::common::*;
use carom_geometry::{ContactPoint, Geometry, PlanarShape, SpatialShape};
use carom_math::{Column, Planar, Pose, Rotation, Spatial, Turn, Vec3, vec2, vec3};

const GAPS: [f64; 11] = [1e-2, 1e-4, 1e-6, 1e-9, 1e-12, 0.0, -1e-12, -1e-9, -1e-6, -1e-4, -1e-2];

/// A shape, the rotation in which it stands on its lowest point, the height of its origin over that point, and
/// how many contacts it has on a wide flat floor.
fn resting() -> Vec<(SpatialShape, carom_math::Quaternion, f64, usize)> {
    let quarter = about(X, std::f64::consts::FRAC_PI_2);
    let (height, radius) = (1.0, 0.6);
    let slant = f64::hypot(height, radius);
    // lying on a side line: the side's normal points down, the axis passes h/2 above the middle of the line
    let tilt = std::f64::consts::FRAC_PI_2 + (radius / height).atan();
    let prism: Vec<Vec3> = (0..12)
        .map(|k| {
            let [c, s] = Turn::from_angle(f64::from(k % 6) * std::f64::consts::FRAC_PI_3).0;
            vec3(0.5 * c, 0.5 * s, if k < 6 { -0.4 } else { 0.3 })
        })
        .collect();
    let id = about(Z, 0.7);
    vec![
        (SpatialShape::Sphere { radius: 0.3 }, about(vec3(1.0, 2.0, 3.0), 1.0), 0.3, 1),
        (SpatialShape::Capsule { length: 1.0, radius: 0.2 }, quarter, 0.2, 2),
        (SpatialShape::Capsule { length: 1.0, radius: 0.2 }, id, 0.7, 1),
        (SpatialShape::Box { size: [0.4, 0.6, 0.8] }, id, 0.4, 4),
        (SpatialShape::RoundBox { size: [0.4, 0.6, 0.8], radius: 0.1 }, id, 0.5, 4),
        (SpatialShape::ConvexHull { points: prism.clone() }, id, 0.4, 4),
        (SpatialShape::RoundConvexHull { points: prism, radius: 0.05 }, id, 0.45, 4),
        (SpatialShape::Cylinder { height: 1.0, radius: 0.3 }, id, 0.5, 4),
        (SpatialShape::Cylinder { height: 1.0, radius: 0.3 }, quarter, 0.3, 2),
        (SpatialShape::RoundCylinder { height: 1.0, radius: 0.3, rounding: 0.1 }, quarter, 0.4, 2),
        (SpatialShape::Cone { height, radius }, id, 0.5, 4),
        (SpatialShape::Cone { height, radius }, about(Y, tilt), 0.5 * height * radius / slant, 2),
        (SpatialShape::RoundCone { height, radius, rounding: 0.1 }, id, 0.6, 4),
    ]
}

fn floors() -> Vec<(SpatialShape, f64)> {
    vec![
        (SpatialShape::HalfSpace { normal: vec3(0.0, 0.0, 2.0) }, 0.0),
        (SpatialShape::Box { size: [20.0, 20.0, 2.0] }, 1.0),
        (
            SpatialShape::ConvexHull {
                points: vec![
                    vec3(-3.0, -3.0, 0.5),
                    vec3(3.0, -3.0, 0.5),
                    vec3(3.0, 3.0, 0.5),
                    vec3(-3.0, 3.0, 0.5),
                    vec3(0.0, 0.0, -1.0),
                    vec3(1.0, 0.0, -0.9),
                ],
            },
            0.5,
        ),
        (SpatialShape::Cylinder { height: 1.0, radius: 3.0 }, 0.5),
        (SpatialShape::HeightField { heights: vec![vec![0.25; 9]; 9], size: [8.0, 8.0] }, 0.25),
        (flat_mesh(7, 8.0), 0.0),
    ]
}

#[test]
fn every_solid_rests_on_every_floor_with_exact_gap_exact_normal_and_the_right_number_of_points() {
    let mut random = Random::new(5);
    for (floor, top) in floors() {
        for (shape, rotation, height, count) in resting() {
            for gap in GAPS {
                for _ in 0..10 {
                    let frame = random.pose3(1.0);
                    let turned = rotation.then(&about(Z, random.signed()));
                    let place = vec3(0.4 * random.signed(), 0.4 * random.signed(), top + height + gap);
                    let pose = frame.compose(&Pose::new(place, turned));
                    let found = contacts::<Spatial>(&shape, &pose, &floor, &frame, 0.02);
                    let context = || format!("{shape:?} on {floor:?} at gap {gap:e}: {found:#?}");
                    assert_eq!(found.len(), count, "{}", context());
                    let up = frame.rotation.rotate(Z);
                    assert!((deepest::<Spatial>(&found) - gap).abs() < 1e-13, "{}", context());
                    for p in &found {
                        assert!((p.gap - gap).abs() < 1e-12, "{}", context());
                        assert!((p.normal - up).norm() < 2e-11, "{}", context());
                        let local = frame.to_body(p.point);
                        assert!((local[2] - top - 0.5 * gap).abs() < 1e-12, "{}", context());
                    }
                }
            }
        }
    }
}

#[test]
fn every_figure_rests_on_every_ground_with_exact_gap_exact_normal_and_the_right_number_of_points() {
    let hexagon =
        (0..6).map(|k| Turn::from_angle(f64::from(k) * std::f64::consts::FRAC_PI_3).rotate(vec2(0.0, 0.5)));
    let turned = Turn::from_angle(std::f64::consts::FRAC_PI_6);
    let apothem = 0.5 * 0.75f64.sqrt();
    let figures = [
        (PlanarShape::Circle { radius: 0.3 }, Turn::from_angle(1.0), 0.3, 1),
        (PlanarShape::Capsule { length: 1.0, radius: 0.2 }, Turn::IDENTITY, 0.2, 2),
        (PlanarShape::Capsule { length: 1.0, radius: 0.2 }, Turn([0.0, 1.0]), 0.7, 1),
        (PlanarShape::Box { size: [0.6, 0.8] }, Turn::IDENTITY, 0.4, 2),
        (PlanarShape::RoundBox { size: [0.6, 0.8], radius: 0.1 }, Turn::IDENTITY, 0.5, 2),
        (PlanarShape::ConvexPolygon { points: hexagon.clone().collect() }, turned, apothem, 2),
        (PlanarShape::RoundPolygon { points: hexagon.collect(), radius: 0.1 }, turned, apothem + 0.1, 2),
    ];
    let grounds = [
        (PlanarShape::HalfPlane { normal: vec2(0.0, 3.0) }, 0.0),
        (PlanarShape::Box { size: [20.0, 2.0] }, 1.0),
        (PlanarShape::Segment { a: vec2(-5.0, 0.2), b: vec2(5.0, 0.2) }, 0.2),
        (
            PlanarShape::Polyline {
                points: (0..9).map(|k| vec2(f64::from(k) - 4.0, 0.0)).collect(),
                closed: false,
            },
            0.0,
        ),
        (PlanarShape::HeightField { heights: vec![0.7; 13], width: 9.0 }, 0.7),
    ];
    let mut random = Random::new(6);
    for (ground, top) in &grounds {
        for (figure, rotation, height, count) in &figures {
            for gap in GAPS {
                for _ in 0..10 {
                    let frame = random.pose2(1.0);
                    let place = vec2(0.4 * random.signed(), top + height + gap);
                    let pose = frame.compose(&Pose::new(place, *rotation));
                    let found = contacts::<Planar>(figure, &pose, ground, &frame, 0.02);
                    let context = || format!("{figure:?} on {ground:?} at gap {gap:e}: {found:#?}");
                    assert_eq!(found.len(), *count, "{}", context());
                    for p in &found {
                        assert!((p.gap - gap).abs() < 1e-13, "{}", context());
                        assert!(
                            (p.normal - frame.rotation.rotate(vec2(0.0, 1.0))).norm() < 1e-13,
                            "{}",
                            context()
                        );
                        assert!((frame.to_body(p.point)[1] - top - 0.5 * gap).abs() < 1e-13, "{}", context());
                    }
                }
            }
        }
    }
}

#[test]
fn two_balls_meet_on_the_line_of_their_centres() {
    let mut random = Random::new(7);
    for _ in 0..200 {
        let (pose_a, pose_b) = (random.pose3(0.5), random.pose3(0.5));
        let (a, b) = (SpatialShape::Sphere { radius: 0.4 }, SpatialShape::Sphere { radius: 0.3 });
        let apart = pose_a.position - pose_b.position;
        let found = contacts::<Spatial>(&a, &pose_a, &b, &pose_b, 10.0);
        assert_eq!(found.len(), 1);
        assert_close(found[0].gap, apart.norm() - 0.7, 1e-15, "gap");
        assert!((found[0].normal - apart * (1.0 / apart.norm())).norm() < 1e-14);
        let middle = pose_b.position + found[0].normal * (0.3 + 0.5 * found[0].gap);
        assert!((found[0].point - middle).norm() < 4e-15);
    }
}

#[test]
fn balls_and_discs_with_one_centre_get_a_fixed_unit_normal() {
    let (sphere, disc) = (SpatialShape::Sphere { radius: 0.5 }, PlanarShape::Circle { radius: 0.5 });
    let pose = Random::new(8).pose3(1.0);
    let found = contacts::<Spatial>(&sphere, &pose, &sphere, &pose, 0.0);
    assert_eq!(found.len(), 1);
    assert_close(found[0].gap, -1.0, 0.0, "gap");
    assert_close(found[0].normal.norm(), 1.0, 1e-14, "length");
    let found = contacts::<Planar>(&disc, &at2(1.0, 2.0), &disc, &at2(1.0, 2.0), 0.0);
    assert_eq!((found.len(), found[0].normal, found[0].gap), (1, vec2(0.0, 1.0), -1.0));
}

#[test]
fn coincident_cores_of_every_kind_give_finite_unit_normals() {
    for a in convex_spatial() {
        for b in convex_spatial() {
            let found = contacts::<Spatial>(&a, &at3(0.0, 0.0, 0.0), &b, &at3(0.0, 0.0, 0.0), 0.01);
            assert!(!found.is_empty(), "{a:?} {b:?}");
            for p in &found {
                assert!(
                    (p.normal.norm() - 1.0).abs() < 1e-13 && p.gap < -0.1 && p.point.is_finite(),
                    "{a:?} {b:?} {p:?}"
                );
            }
        }
    }
    for a in convex_planar() {
        for b in convex_planar() {
            for p in contacts::<Planar>(&a, &at2(0.0, 0.0), &b, &at2(0.0, 0.0), 0.01) {
                assert!((p.normal.norm() - 1.0).abs() < 1e-13 && p.gap < 1e-13, "{a:?} {b:?} {p:?}");
            }
        }
    }
}

#[test]
fn crossed_capsules_touch_once_and_parallel_ones_at_both_ends_of_their_overlap() {
    let capsule = SpatialShape::Capsule { length: 2.0, radius: 0.25 };
    let lying = Pose::new(vec3(0.3, 0.1, 0.51), about(X, std::f64::consts::FRAC_PI_2));
    let across = Pose::new(vec3(0.0, 0.0, 0.0), about(Y, std::f64::consts::FRAC_PI_2));
    let found = contacts::<Spatial>(&capsule, &lying, &capsule, &across, 0.02);
    assert_eq!(found.len(), 1);
    assert_close(found[0].gap, 0.01, 1e-15, "gap");
    assert!((found[0].point - vec3(0.3, 0.0, 0.255)).norm() < 1e-15);
    let shifted = Pose::new(vec3(0.8, 0.0, 0.5), across.rotation);
    let found = contacts::<Spatial>(&capsule, &shifted, &capsule, &across, 0.02);
    let mut ends: Vec<f64> = found.iter().map(|p| p.point[0]).collect();
    ends.sort_by(f64::total_cmp);
    assert_eq!(found.len(), 2);
    assert_close(ends[0], -0.2, 1e-14, "left end");
    assert_close(ends[1], 1.0, 1e-14, "right end");
    assert!(found.iter().all(|p| p.gap.abs() < 1e-15 && (p.normal - Z).norm() < 1e-15));
}

#[test]
fn crossed_edges_of_two_boxes_touch_where_they_cross() {
    let cube = SpatialShape::Box { size: [1.0, 1.0, 1.0] };
    let eighth = std::f64::consts::FRAC_PI_4;
    let half_diagonal = 0.5f64.sqrt();
    for gap in [1e-3, 1e-6, 0.0, -1e-6, -1e-3] {
        let below = Pose::new(vec3(0.0, 0.0, 0.0), about(X, eighth));
        let above = Pose::new(vec3(0.2, 0.1, 2.0 * half_diagonal + gap), about(Y, eighth));
        let found = contacts::<Spatial>(&cube, &above, &cube, &below, 0.01);
        assert!(!found.is_empty());
        assert_close(deepest::<Spatial>(&found), gap, 1e-14, "gap");
        let lowest = found.iter().reduce(|a, b| if a.gap < b.gap { a } else { b }).unwrap();
        assert!((lowest.normal - Z).norm() < 1e-9, "{lowest:?}");
        assert!((lowest.point - vec3(0.2, 0.0, half_diagonal + 0.5 * gap)).norm() < 1e-9, "{lowest:?}");
    }
}

#[test]
fn a_small_box_on_a_large_one_keeps_its_own_corners_and_a_half_overhanging_one_the_edge() {
    let (small, large) =
        (SpatialShape::Box { size: [0.2, 0.2, 0.2] }, SpatialShape::Box { size: [1.0, 1.0, 1.0] });
    let places = |x: f64| {
        let found = contacts::<Spatial>(&small, &at3(x, 0.0, 0.6), &large, &at3(0.0, 0.0, 0.0), 0.01);
        let mut p: Vec<[i64; 2]> = found
            .iter()
            .map(|p| [(p.point[0] * 1e9).round() as i64, (p.point[1] * 1e9).round() as i64])
            .collect();
        p.sort_unstable();
        p
    };
    let tenth = 100_000_000;
    assert_eq!(places(0.0), [[-tenth, -tenth], [-tenth, tenth], [tenth, -tenth], [tenth, tenth]]);
    assert_eq!(
        places(0.5),
        [[4 * tenth, -tenth], [4 * tenth, tenth], [5 * tenth, -tenth], [5 * tenth, tenth]]
    );
}

#[test]
fn a_box_turned_on_another_keeps_four_far_corners_of_the_octagon_they_share() {
    let cube = SpatialShape::Box { size: [1.0, 1.0, 1.0] };
    let pose = Pose::new(vec3(0.0, 0.0, 1.0), about(Z, std::f64::consts::FRAC_PI_4));
    let found = contacts::<Spatial>(&cube, &pose, &cube, &at3(0.0, 0.0, 0.0), 0.01);
    assert_eq!(found.len(), 4);
    let area = |p: &[ContactPoint<Spatial>]| {
        let mut q: Vec<_> = p.iter().map(|p| (p.point[1].atan2(p.point[0]), p.point)).collect();
        q.sort_by(|a, b| a.0.total_cmp(&b.0));
        (0..4).map(|k| q[k].1.cross(q[(k + 1) % 4].1)[2]).sum::<f64>() * 0.5
    };
    // the octagon has area .828; its four best corners carry at least .55
    assert!(area(&found) > 0.55, "{} {found:?}", area(&found));
}

#[test]
fn far_from_the_origin_gaps_keep_their_digits() {
    let cube = SpatialShape::Box { size: [1.0, 1.0, 1.0] };
    let (a, b) = (at3(3e5, -2e5, 1e5 + 1.0 + 1.0 / 1024.0), at3(3e5, -2e5, 1e5));
    let found = contacts::<Spatial>(&cube, &a, &cube, &b, 0.01);
    assert_eq!(found.len(), 4);
    assert!(found.iter().all(|p| (p.gap - 1.0 / 1024.0).abs() < 1e-15), "{found:?}");
}

#[test]
fn a_tilted_cylinder_stands_on_the_lowest_point_of_its_rim() {
    let cylinder = SpatialShape::Cylinder { height: 1.0, radius: 0.5 };
    for (floor, top) in [
        (SpatialShape::HalfSpace { normal: Z }, 0.0),
        (SpatialShape::Box { size: [9.0, 9.0, 2.0] }, 1.0),
        (flat_mesh(6, 9.0), 0.0),
    ] {
        for angle in [1e-6, 1e-3, 0.1, 0.5, 1.0, 1.5] {
            let (s, c) = (f64::sin(angle), f64::cos(angle));
            let height = 0.5 * c + 0.5 * s;
            let spin = about(Z, 0.3);
            // turned about y by the angle, the rim's lowest point is at local x = +r on the lower cap
            let pose = Pose::new(vec3(0.2, 0.1, top + height), spin.then(&about(Y, angle)));
            let found = contacts::<Spatial>(&cylinder, &pose, &floor, &at3(0.0, 0.0, 0.0), 0.01);
            let lowest = found.iter().reduce(|a, b| if a.gap < b.gap { a } else { b }).unwrap();
            assert_close(lowest.gap, 0.0, 1e-14, "gap");
            assert!((lowest.normal - Z).norm() < 1e-12, "{floor:?} {lowest:?}");
            if angle < 1e-4 {
                continue; // flat to 1e-9: any corner of the rim may speak for the gap
            }
            let foot = vec3(0.2, 0.1, top + height) + about(Y, angle).rotate(vec3(0.5, 0.0, -0.5));
            assert!((lowest.point - foot).norm() < 1e-9, "{angle} {lowest:?} {foot:?}");
        }
    }
}

#[test]
fn bounds_are_tight_for_every_convex_shape() {
    let mut random = Random::new(9);
    for shape in convex_spatial() {
        let c = collider::<Spatial>(&shape);
        for _ in 0..50 {
            let pose = random.pose3(2.0);
            let bounds = Spatial::bounds(&c, &pose, 0.0);
            let grown = Spatial::bounds(&c, &pose, 0.125);
            for axis in 0..3 {
                for (sign, face) in [(1.0, bounds.max[axis]), (-1.0, bounds.min[axis])] {
                    // the wall that bounds the shape touches it
                    let normal = Vec3::from_fn(|k| if k == axis { -sign } else { 0.0 });
                    let wall = SpatialShape::HalfSpace { normal };
                    let at = Pose::new(Vec3::from_fn(|k| if k == axis { face } else { 0.0 }), pose.rotation);
                    let at = Pose { rotation: carom_math::Quaternion::IDENTITY, ..at };
                    let gap = closest::<Spatial>(&shape, &pose, &wall, &at, 1.0).unwrap().gap;
                    assert_close(gap, 0.0, 1e-14, "gap to the bounding wall");
                }
                assert_close(grown.max[axis] - bounds.max[axis], 0.125, 1e-15, "margin");
            }
        }
    }
}

#[test]
fn extents_are_the_longest_outer_sizes() {
    assert_eq!(Spatial::extent(&SpatialShape::Sphere { radius: 0.5 }), 1.0);
    assert_eq!(Spatial::extent(&SpatialShape::Capsule { length: 1.0, radius: 0.5 }), 2.0);
    assert_eq!(Spatial::extent(&SpatialShape::RoundBox { size: [1.0, 2.0, 3.0], radius: 0.5 }), 4.0);
    assert_eq!(Spatial::extent(&SpatialShape::Cone { height: 3.0, radius: 1.0 }), 3.0);
    assert_eq!(Spatial::extent(&SpatialShape::HalfSpace { normal: Z }), f64::INFINITY);
    assert_eq!(Planar::extent(&PlanarShape::HalfPlane { normal: vec2(0.6, 0.8) }), f64::INFINITY);
    assert_eq!(Planar::extent(&PlanarShape::Segment { a: vec2(0.0, 0.0), b: vec2(-3.0, 1.0) }), 3.0);
}
