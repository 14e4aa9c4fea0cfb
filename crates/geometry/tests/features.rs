//! Names of contact points: distinct within a pair, unchanged while the same features touch.

use crate::common::*;
use carom_geometry::{Geometry, PlanarPart, PlanarShape, SpatialPart, SpatialShape};
use carom_math::{Planar, Pose, Spatial, vec2, vec3};

fn names<S: Geometry>(a: &S::Shape, pose_a: &Pose<S>, b: &S::Shape, pose_b: &Pose<S>) -> Vec<u64> {
    let mut names: Vec<u64> = contacts::<S>(a, pose_a, b, pose_b, 0.02).iter().map(|p| p.feature).collect();
    names.sort_unstable();
    names
}

#[test]
fn names_stay_while_a_box_slides_and_rocks_on_a_larger_one() {
    let (cube, floor) =
        (SpatialShape::Box { size: [1.0, 1.0, 1.0] }, SpatialShape::Box { size: [20.0, 20.0, 1.0] });
    let first = names::<Spatial>(&cube, &at3(0.0, 0.0, 1.0), &floor, &at3(0.0, 0.0, 0.0));
    assert_eq!(first.len(), 4);
    let mut random = Random::new(1);
    for k in 0..500 {
        let place = vec3(0.01 * f64::from(k), 0.002 * f64::from(k), 1.0 + 1e-4 * random.signed());
        let rocking = about(random.direction3(), 1e-4 * random.signed());
        let pose = Pose::new(place, rocking);
        assert_eq!(names::<Spatial>(&cube, &pose, &floor, &at3(0.0, 0.0, 0.0)), first, "step {k}");
    }
}

#[test]
fn names_stay_while_equal_boxes_rest_on_each_other_but_for_rounding() {
    let cube = SpatialShape::Box { size: [1.0, 1.0, 1.0] };
    let square = PlanarShape::Box { size: [1.0, 1.0] };
    let first = names::<Spatial>(&cube, &at3(0.0, 0.0, 1.0), &cube, &at3(0.0, 0.0, 0.0));
    let flat = names::<Planar>(&square, &at2(0.0, 1.0), &square, &at2(0.0, 0.0));
    assert_eq!((first.len(), flat.len()), (4, 2));
    let mut random = Random::new(2);
    for _ in 0..200 {
        let mut near = |x: f64| x + 1e-9 * random.signed();
        let pose = Pose::new(vec3(near(0.0), near(0.0), near(1.0)), about(Z, near(0.0)));
        assert_eq!(names::<Spatial>(&cube, &pose, &cube, &at3(0.0, 0.0, 0.0)), first);
        let pose = Pose::new(vec2(near(0.0), near(1.0)), carom_math::Turn::from_angle(near(0.0)));
        assert_eq!(names::<Planar>(&square, &pose, &square, &at2(0.0, 0.0)), flat);
    }
}

#[test]
fn names_stay_while_hulls_and_cylinders_slide_on_a_wall() {
    let wall = SpatialShape::HalfSpace { normal: Z };
    let hull = SpatialShape::ConvexHull {
        points: vec![
            vec3(-0.5, -0.5, 0.0),
            vec3(0.5, -0.5, 0.0),
            vec3(0.5, 0.5, 0.0),
            vec3(-0.5, 0.5, 0.0),
            vec3(0.0, 0.0, 1.0),
        ],
    };
    for (shape, height) in [(hull, 0.0), (SpatialShape::Cylinder { height: 1.0, radius: 0.5 }, 0.5)] {
        let first = names::<Spatial>(&shape, &at3(0.0, 0.0, height), &wall, &at3(0.0, 0.0, 0.0));
        for k in 0..100 {
            let x = 0.037 * f64::from(k);
            assert_eq!(names::<Spatial>(&shape, &at3(x, -x, height), &wall, &at3(0.0, 0.0, 0.0)), first);
        }
    }
}

#[test]
fn parts_of_a_compound_touch_like_the_parts_alone_and_have_names_of_their_own() {
    let ball = |x: f64| SpatialPart { pose: at3(x, 0.0, 0.0), shape: SpatialShape::Sphere { radius: 0.25 } };
    let dumbbell = SpatialShape::Compound { parts: vec![ball(-1.0), ball(1.0)] };
    for (floor, top) in [
        (SpatialShape::HalfSpace { normal: Z }, 0.0),
        (SpatialShape::Box { size: [9.0, 9.0, 2.0] }, 1.0),
        (flat_mesh(5, 9.0), 0.0),
    ] {
        let pose = Pose::new(vec3(0.1, 0.2, top + 0.25), about(Z, 0.5));
        let found = contacts::<Spatial>(&dumbbell, &pose, &floor, &at3(0.0, 0.0, 0.0), 0.01);
        assert_eq!(found.len(), 2, "{floor:?} {found:#?}");
        assert_ne!(found[0].feature, found[1].feature);
        for (p, x) in found.iter().zip([-1.0, 1.0]) {
            assert!((p.point - pose.to_world(vec3(x, 0.0, -0.25))).max_abs() < 1e-13, "{p:?}");
            assert!((p.normal - Z).norm() < 1e-13 && p.gap.abs() < 1e-13, "{p:?}");
        }
    }
    use carom_math::Column;
    let leg = |x: f64| PlanarPart { pose: at2(x, 0.0), shape: PlanarShape::Box { size: [0.2, 1.0] } };
    let table = PlanarShape::Compound { parts: vec![leg(-1.0), leg(0.0), leg(1.0)] };
    let ground = PlanarShape::HalfPlane { normal: vec2(0.0, 1.0) };
    let found = contacts::<Planar>(&table, &at2(0.0, 0.5), &ground, &at2(0.0, 0.0), 0.01);
    let mut feet: Vec<f64> = found.iter().map(|p| p.point[0]).collect();
    feet.sort_by(f64::total_cmp);
    assert_eq!(feet, [-1.1, 1.1], "the outermost feet carry a rigid table: {found:#?}");
}

#[test]
fn compounds_meet_compounds() {
    let part = |x: f64, shape: SpatialShape| SpatialPart { pose: at3(x, 0.0, 0.0), shape };
    let cube = || SpatialShape::Box { size: [0.4, 0.4, 0.4] };
    let bar = SpatialShape::Compound { parts: vec![part(-1.0, cube()), part(1.0, cube())] };
    let found = contacts::<Spatial>(&bar, &at3(0.0, 0.0, 0.4), &bar, &at3(0.0, 0.0, 0.0), 0.01);
    // two patches with one normal: the four outermost corners remain
    assert_eq!(found.len(), 4, "{found:#?}");
    assert!(found.iter().all(|p| (p.point[0].abs() - 1.2).abs() < 1e-14), "{found:#?}");
    let found = contacts::<Spatial>(&bar, &at3(2.0, 0.0, 0.41), &bar, &at3(0.0, 0.0, 0.0), 0.02);
    assert_eq!(found.len(), 4);
    assert!(found.iter().all(|p| (p.gap - 0.01).abs() < 1e-14), "{found:#?}");
}
