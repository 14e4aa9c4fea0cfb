//! Balls have closed forms of their own; the general way is asked through compounds of one ball.

use crate::common::*;
use carom_geometry::{Geometry, PlanarPart, PlanarShape, SpatialPart, SpatialShape};
use carom_math::{Column, Planar, Pose, Spatial, vec2};

/// Contacts of two shapes and of two others that are the same, from far apart to deep inside each other.
fn same<S: Geometry>(
    (one, other): (&S::Shape, &S::Shape),
    general: (&S::Shape, &S::Shape),
    mut pose: impl FnMut(&mut Random) -> Pose<S>,
) {
    let mut random = Random::new(5);
    let mut met = 0;
    for _ in 0..500 {
        let (a, b) = (pose(&mut random), pose(&mut random));
        let found = contacts::<S>(one, &a, other, &b, 0.3);
        let known = contacts::<S>(general.0, &a, general.1, &b, 0.3);
        assert_eq!(found.len(), known.len(), "{a:?} {b:?}");
        for (f, k) in found.iter().zip(&known) {
            met += 1;
            assert_close(f.gap, k.gap, 1e-14, "gap");
            // between centres that are near each other the direction is as good as their distance
            assert!((f.normal - k.normal).norm() < 1e-12, "{f:?} {k:?}");
            assert!((f.point - k.point).norm() < 1e-14, "{f:?} {k:?}");
        }
    }
    assert!(met > 100, "only {met} contacts");
}

#[test]
fn balls_touch_balls_and_walls_as_the_general_way_says() {
    let ball = |radius| SpatialShape::Sphere { radius };
    let alone = |shape| SpatialShape::Compound { parts: vec![SpatialPart { pose: Pose::default(), shape }] };
    let wall = SpatialShape::HalfSpace { normal: Z };
    let pose = |random: &mut Random| random.pose3(0.6);
    same::<Spatial>((&ball(0.3), &ball(0.5)), (&alone(ball(0.3)), &alone(ball(0.5))), pose);
    same::<Spatial>((&ball(0.3), &wall), (&alone(ball(0.3)), &wall), pose);
    same::<Spatial>((&wall, &ball(0.3)), (&wall, &alone(ball(0.3))), pose);
    let ball = |radius| PlanarShape::Circle { radius };
    let alone = |shape| PlanarShape::Compound { parts: vec![PlanarPart { pose: Pose::default(), shape }] };
    let wall = PlanarShape::HalfPlane { normal: vec2(0.6, 0.8) };
    let pose = |random: &mut Random| random.pose2(0.6);
    same::<Planar>((&ball(0.3), &ball(0.5)), (&alone(ball(0.3)), &alone(ball(0.5))), pose);
    same::<Planar>((&ball(0.3), &wall), (&alone(ball(0.3)), &wall), pose);
    same::<Planar>((&wall, &ball(0.3)), (&wall, &alone(ball(0.3))), pose);
}

/// Balls whose places say all, and other shapes, of which they do not.
fn by_places<S: Geometry>(
    (ball, larger): (&S::Shape, &S::Shape),
    others: &[S::Shape],
    mut pose: impl FnMut(&mut Random) -> Pose<S>,
) {
    let (a, b) = (collider::<S>(ball), collider::<S>(larger));
    let radii = (S::ball_radius(&a).expect("a ball"), S::ball_radius(&b).expect("a ball"));
    let mut random = Random::new(6);
    let mut met = 0;
    for _ in 0..500 {
        let (at_a, at_b) = (pose(&mut random), pose(&mut random));
        let mut known = Vec::new();
        let found = S::contact_of_balls((at_a.position, radii.0), (at_b.position, radii.1), 0.3);
        S::contacts(&a, &at_a, &b, &at_b, 0.3, &mut known);
        assert_eq!(found.expect("two places").as_slice(), known);
        met += known.len();
    }
    assert!(met > 100, "only {met} contacts");
    for other in others.iter().map(collider::<S>) {
        assert!(S::ball_radius(&other).is_none());
    }
    let here = S::Vector::ZERO;
    let found = S::contact_of_balls((here, radii.0), (here, radii.1), 0.3);
    assert!(found.is_none(), "centres that are one have no direction");
}

#[test]
fn balls_touch_by_their_places_as_by_their_poses() {
    let ball = |radius| SpatialShape::Sphere { radius };
    let aside = SpatialPart { pose: at3(1.0, 0.0, 0.0), shape: ball(0.3) };
    let capsule = SpatialShape::Capsule { radius: 0.3, length: 1.0 };
    let others =
        [SpatialShape::HalfSpace { normal: Z }, capsule, SpatialShape::Compound { parts: vec![aside] }];
    by_places::<Spatial>((&ball(0.3), &ball(0.5)), &others, |random| random.pose3(0.6));
    let disc = |radius| PlanarShape::Circle { radius };
    let others = [PlanarShape::HalfPlane { normal: vec2(0.6, 0.8) }];
    by_places::<Planar>((&disc(0.3), &disc(0.5)), &others, |random| random.pose2(0.6));
}

/// Balls on walls, of which the balls' places say all, and on a ball, which is no wall.
fn on_walls<S: Geometry>(ball: &S::Shape, walls: &[S::Shape], mut pose: impl FnMut(&mut Random) -> Pose<S>) {
    let a = collider::<S>(ball);
    let radius = S::ball_radius(&a).expect("a ball");
    let mut random = Random::new(7);
    for wall in walls.iter().map(collider::<S>) {
        let mut met = 0;
        for k in 0..500 {
            let (at, of_wall, wall_is_a) = (pose(&mut random), pose(&mut random), k % 2 == 0);
            let mut known = Vec::new();
            if wall_is_a {
                S::contacts(&wall, &of_wall, &a, &at, 0.3, &mut known);
            } else {
                S::contacts(&a, &at, &wall, &of_wall, 0.3, &mut known);
            }
            let found = S::contact_with_wall((at.position, radius), (&wall, &of_wall), wall_is_a, 0.3);
            assert_eq!(found.expect("a ball and a wall").as_slice(), known);
            met += known.len();
        }
        assert!(met > 100, "only {met} contacts");
        assert!(S::ball_radius(&wall).is_none());
    }
    assert!(S::contact_with_wall((S::Vector::ZERO, radius), (&a, &Pose::default()), false, 9.0).is_none());
}

#[test]
fn balls_touch_walls_by_their_places_as_by_their_poses() {
    let ball = |radius| SpatialShape::Sphere { radius };
    let walls = [SpatialShape::HalfSpace { normal: Z }, SpatialShape::Cavity { radius: 0.9 }];
    on_walls::<Spatial>(&ball(0.3), &walls, |random| random.pose3(0.6));
    let walls = [PlanarShape::HalfPlane { normal: vec2(0.6, 0.8) }, PlanarShape::Cavity { radius: 0.9 }];
    on_walls::<Planar>(&PlanarShape::Circle { radius: 0.3 }, &walls, |random| random.pose2(0.6));
}

#[test]
fn balls_with_one_centre_still_push_each_other() {
    let ball = SpatialShape::Sphere { radius: 0.5 };
    let found = contacts::<Spatial>(&ball, &Pose::default(), &ball, &Pose::default(), 0.0);
    assert_eq!(found.len(), 1);
    assert_close(found[0].gap, -1.0, 1e-15, "gap");
    assert_close(found[0].normal.norm(), 1.0, 1e-15, "length of the normal");
}

#[test]
fn balls_far_from_the_origin_keep_their_gap() {
    let ball = SpatialShape::Sphere { radius: 0.5 };
    let far = 2f64.powi(30);
    let found = contacts::<Spatial>(&ball, &at3(far + 1.0, 0.0, 0.0), &ball, &at3(far, 0.0, 0.0), 0.1);
    assert_eq!(found[0].gap, 0.0);
}

#[test]
fn balls_touch_balls_and_walls_once_and_nothing_else_is_sure_to() {
    let once = |a: &SpatialShape, b: &SpatialShape| {
        let (a, b) = (collider::<Spatial>(a), collider::<Spatial>(b));
        assert_eq!(Spatial::touch_once(&a, &b), Spatial::touch_once(&b, &a));
        Spatial::touch_once(&a, &b)
    };
    let ball = SpatialShape::Sphere { radius: 0.5 };
    let wall = SpatialShape::HalfSpace { normal: Z };
    let block = SpatialShape::Box { size: [1.0, 1.0, 1.0] };
    assert!(once(&ball, &ball) && once(&ball, &wall) && once(&ball, &SpatialShape::Cavity { radius: 2.0 }));
    assert!(!once(&ball, &block) && !once(&block, &wall) && !once(&block, &block));
    let disc = collider::<Planar>(&PlanarShape::Circle { radius: 0.5 });
    let line = collider::<Planar>(&PlanarShape::HalfPlane { normal: vec2(0.6, 0.8) });
    assert!(Planar::touch_once(&disc, &disc) && Planar::touch_once(&disc, &line));
}
