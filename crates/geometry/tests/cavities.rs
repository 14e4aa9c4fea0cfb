//! Cavities against closed forms: gaps, normals, closest points and rays of what is inside one, in both spaces.

use crate::common::*;
use carom_geometry::{ContactPoint, Geometry, PlanarShape, SpatialShape};
use carom_math::{Column, Planar, Pose, Spatial, Turn, Vec3, vec2, vec3};
use std::f64::consts::PI;

/// Contacts with the cavity as the second of the pair; as the first they must be the same with normals turned round.
fn inside<S: Geometry>(
    (shape, pose): (&S::Shape, &Pose<S>),
    (cavity, center): (&S::Shape, &Pose<S>),
    margin: f64,
) -> Vec<ContactPoint<S>> {
    let found = contacts::<S>(shape, pose, cavity, center, margin);
    let turned = contacts::<S>(cavity, center, shape, pose, margin);
    assert_eq!(found.len(), turned.len());
    for (f, t) in found.iter().zip(&turned) {
        assert_eq!((f.gap, f.point, f.feature), (t.gap, t.point, t.feature));
        assert_eq!(f.normal, -t.normal);
    }
    found
}

#[test]
fn a_ball_in_a_bowl_has_the_gap_of_their_centres() {
    let mut random = Random::new(31);
    let (bowl, ball) = (SpatialShape::Cavity { radius: 1.0 }, SpatialShape::Sphere { radius: 0.1 });
    for far in [0.0, 1e3] {
        for _ in 0..200 {
            let center = random.pose3(far);
            let offset = random.vec3().normalized().unwrap() * 0.95;
            let pose = Pose::new(center.position + offset, random.rotation());
            // the offset as it is once both places are rounded
            let offset = pose.position - center.position;
            let found = inside::<Spatial>((&ball, &pose), (&bowl, &center), 0.01);
            let [c] = found.as_slice() else { panic!("{found:?}") };
            assert!((c.gap - (0.9 - offset.norm())).abs() < 1e-15, "{c:?}");
            let normal = offset * (-1.0 / offset.norm());
            assert!((c.normal - normal).norm() < 1e-15);
            assert!((c.curvature * offset.norm() - 1.0).abs() < 1e-15);
            let point = pose.position - normal * (0.1 + 0.5 * c.gap);
            assert!((c.point - point).norm() < 1e-15 + 3e-16 * far);
        }
    }
    let middle = inside::<Spatial>((&ball, &Pose::default()), (&bowl, &Pose::default()), 2.0);
    assert!(middle[0].gap == 0.9 && middle[0].normal.norm() == 1.0, "no direction, and still a number");
}

#[test]
fn a_disc_and_a_box_in_a_round_drum() {
    let (drum, center) =
        (PlanarShape::Cavity { radius: 2.0 }, Pose::new(vec2(0.3, -0.4), Turn::from_angle(0.7)));
    let disc = PlanarShape::Circle { radius: 0.5 };
    let at = Pose::new(center.position + vec2(0.9, -1.2), Turn::from_angle(2.0));
    let found = inside::<Planar>((&disc, &at), (&drum, &center), 1e-6);
    assert!(found.len() == 1 && found[0].gap.abs() < 1e-15, "{found:?}");
    assert!((found[0].normal - vec2(-0.6, 0.8)).norm() < 1e-15);
    // a box of 1.2 by .8 whose lower corners are on the drum
    let flat = PlanarShape::Box { size: [1.2, 0.8] };
    let low = -(4.0_f64 - 0.36).sqrt();
    let at = Pose::new(center.position + vec2(0.0, low + 0.4), Turn::from_angle(0.0));
    let found = inside::<Planar>((&flat, &at), (&drum, &center), 1e-6);
    assert_eq!(found.len(), 2);
    for c in &found {
        assert!(c.gap.abs() < 1e-15, "{c:?}");
        assert!((c.normal - (center.position - c.point) * 0.5).norm() < 1e-14);
    }
}

#[test]
fn boxes_capsules_and_cylinders_meet_a_bowl_with_their_corners_and_rims() {
    let bowl = SpatialShape::Cavity { radius: 1.0 };
    let center = Pose::new(vec3(0.2, 0.1, -0.3), about(X, 0.4));
    let set = |height: f64| Pose::new(center.position + vec3(0.0, 0.0, height), about(Z, 0.3));
    let low = |across: f64| -(1.0 - across * across).sqrt();
    let cube = SpatialShape::Box { size: [0.6, 0.8, 0.4] };
    let found = inside::<Spatial>((&cube, &set(low(0.5) + 0.2)), (&bowl, &center), 1e-9);
    assert_eq!(found.len(), 4);
    assert!(found.iter().all(|c| c.gap.abs() < 1e-15), "{found:?}");
    let capsule = SpatialShape::Capsule { length: 0.6, radius: 0.2 };
    let lying = Pose::new(center.position + vec3(0.0, 0.0, -(0.64_f64 - 0.09).sqrt()), about(Y, 0.5 * PI));
    let found = inside::<Spatial>((&capsule, &lying), (&bowl, &center), 1e-9);
    assert!(found.len() == 2 && found.iter().all(|c| c.gap.abs() < 1e-15), "{found:?}");
    // a cylinder upright in the middle stands on its whole rim; moved aside, on the point that is farthest
    let cylinder = SpatialShape::Cylinder { height: 0.4, radius: 0.5 };
    let found = inside::<Spatial>((&cylinder, &set(low(0.5) + 0.2)), (&bowl, &center), 1e-9);
    assert!(found.len() >= 12 && found.iter().all(|c| c.gap.abs() < 1e-14), "{found:?}");
    let aside = Pose::new(center.position + vec3(0.1, 0.2, low(0.7) + 0.2), about(Z, 1.1));
    let found = inside::<Spatial>((&cylinder, &aside), (&bowl, &center), 0.05);
    let deepest = found.iter().map(|c| c.gap).fold(f64::INFINITY, f64::min);
    let away = vec3(0.1, 0.2, 0.0).normalized().unwrap() * 0.5;
    let farthest = (aside.position + away - vec3(0.0, 0.0, 0.2) - center.position).norm();
    assert!((deepest - (1.0 - farthest)).abs() < 1e-15, "{deepest} {}", 1.0 - farthest);
}

#[test]
fn closest_points_of_what_is_inside_are_those_of_its_deepest_contact() {
    let mut random = Random::new(32);
    let bowl = SpatialShape::Cavity { radius: 1.0 };
    let shapes = [
        SpatialShape::Sphere { radius: 0.1 },
        SpatialShape::Capsule { length: 0.3, radius: 0.1 },
        SpatialShape::Box { size: [0.2, 0.3, 0.4] },
        SpatialShape::Cylinder { height: 0.3, radius: 0.2 },
        SpatialShape::RoundCone { height: 0.3, radius: 0.2, rounding: 0.05 },
    ];
    for shape in &shapes {
        for _ in 0..100 {
            let (center, pose) = (random.pose3(0.2), random.pose3(0.3));
            let found = inside::<Spatial>((shape, &pose), (&bowl, &center), 3.0);
            let deepest = found.iter().reduce(|a, b| if b.gap < a.gap { b } else { a }).unwrap();
            let (c, b) = (collider::<Spatial>(shape), collider::<Spatial>(&bowl));
            let closest = Spatial::closest(&c, &pose, &b, &center, 3.0).unwrap();
            assert!((closest.gap - deepest.gap).abs() < 1e-14, "{shape:?}");
            assert!((closest.point_b - center.position).norm() - 1.0 < 1e-14);
            assert!((closest.point_a - closest.point_b - closest.normal * closest.gap).norm() < 1e-14);
        }
    }
}

/// Along straight ways the gap is nowhere less than what gap, normal and curvature promise of it.
#[test]
fn a_straight_way_keeps_the_gap_that_the_curvature_promises() {
    let mut random = Random::new(33);
    let (bowl, ball) = (SpatialShape::Cavity { radius: 1.0 }, SpatialShape::Sphere { radius: 0.1 });
    let gap = |at: Vec3| {
        let pose = Pose::new(at, about(Z, 0.0));
        inside::<Spatial>((&ball, &pose), (&bowl, &Pose::default()), 10.0)[0]
    };
    for _ in 0..500 {
        let (start, direction) = (random.vec3() * 0.5, random.vec3().normalized().unwrap());
        let here = gap(start);
        for s in [1e-3, 0.1, 0.4, 1.0] {
            let least = here.gap + here.normal.dot(direction) * s - 0.5 * here.curvature * s * s;
            assert!(gap(start + direction * s).gap >= least - 1e-12);
        }
    }
}

#[test]
fn a_ray_leaves_a_bowl_where_the_quadratic_formula_says() {
    let mut random = Random::new(34);
    let bowl = collider::<Spatial>(&SpatialShape::Cavity { radius: 0.5 });
    for _ in 0..500 {
        let center = random.pose3(1.0);
        let (offset, direction) = (random.vec3() * 0.25, random.vec3().normalized().unwrap());
        let hit =
            Spatial::raycast(&bowl, &center, center.position + offset, direction, 10.0).expect("a wall");
        let at = offset + direction * hit.distance;
        assert!((at.norm() - 0.5).abs() < 1e-15 && (hit.normal + at * 2.0).norm() < 1e-14);
    }
    let outside = Spatial::raycast(&bowl, &Pose::default(), X * 3.0, X, 1.0).expect("within the wall");
    assert_eq!((outside.distance, outside.normal), (0.0, -X));
}

#[test]
fn a_cavity_has_no_mass_no_bounds_and_a_radius() {
    let bowl = SpatialShape::Cavity { radius: 1.0 };
    let refused = Spatial::mass_properties(&bowl, 1.0).expect_err("no mass").to_string();
    assert!(refused.contains("cavity"), "{refused}");
    assert!(Planar::mass_properties(&PlanarShape::Cavity { radius: 1.0 }, 1.0).is_err());
    assert_eq!(Spatial::extent(&bowl), f64::INFINITY);
    for radius in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        let refused =
            Spatial::collider(&SpatialShape::Cavity { radius }).expect_err("impossible").to_string();
        assert!(refused.contains("radius"), "{refused}");
    }
}
