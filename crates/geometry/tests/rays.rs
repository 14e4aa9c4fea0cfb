//! Rays against closed forms and against the distance they end at.

use crate::common::*;
use carom_geometry::{Geometry, PlanarShape, RayHit, SpatialPart, SpatialShape};
use carom_math::{Column, Planar, Pose, Rotation, Spatial, Vec3, vec2, vec3};

fn cast(
    shape: &SpatialShape,
    pose: &Pose<Spatial>,
    origin: Vec3,
    direction: Vec3,
    reach: f64,
) -> Option<RayHit<Spatial>> {
    Spatial::raycast(&collider::<Spatial>(shape), pose, origin, direction, reach)
}

#[test]
fn a_ray_meets_a_ball_where_the_quadratic_formula_says() {
    let mut random = Random::new(21);
    let ball = SpatialShape::Sphere { radius: 0.5 };
    let mut hits = 0;
    for _ in 0..2000 {
        let center = random.vec3();
        let origin = random.vec3() * 3.0;
        let direction = (center + random.vec3() - origin).normalized().unwrap();
        let w = origin - center;
        let (b, c) = (w.dot(direction), w.norm_squared() - 0.25);
        let found = cast(&ball, &Pose::new(center, random.rotation()), origin, direction, 100.0);
        if c <= 0.0 {
            assert_eq!(found.unwrap().distance, 0.0);
        } else if b * b - c < -1e-9 || b > 0.0 {
            assert!(found.is_none(), "{found:?}");
        } else if b * b - c > 1e-9 {
            let t = -b - (b * b - c).sqrt();
            let found = found.unwrap();
            hits += 1;
            // near the rim of the ball t hangs on the square root of a small difference
            assert!(
                (found.distance - t).abs() < 1e-14 / (b * b - c).sqrt().min(1.0) + 1e-13,
                "{found:?} {t}"
            );
            assert!((found.normal - (w + direction * t) * 2.0).norm() < 1e-6);
        }
    }
    assert!(hits > 300, "{hits}");
}

#[test]
fn a_ray_meets_a_box_where_the_slabs_say() {
    let mut random = Random::new(22);
    let half = [0.5, 0.3, 0.7];
    let shape = SpatialShape::Box { size: half.map(|h| 2.0 * h) };
    let mut hits = 0;
    for _ in 0..2000 {
        let pose = random.pose3(1.0);
        let origin = random.vec3() * 3.0;
        let direction = (pose.position + random.vec3() - origin).normalized().unwrap();
        let (o, d) = (pose.to_body(origin), pose.rotation.unrotate(direction));
        let (mut enter, mut leave, mut axis) = (f64::NEG_INFINITY, f64::INFINITY, 0);
        for k in 0..3 {
            let (s, t) = ((-half[k] - o[k]) / d[k], (half[k] - o[k]) / d[k]);
            if s.min(t) > enter {
                (enter, axis) = (s.min(t), k);
            }
            leave = leave.min(s.max(t));
        }
        let found = cast(&shape, &pose, origin, direction, 100.0);
        if leave < 0.0 || enter > leave + 1e-9 {
            assert!(found.is_none(), "{found:?}");
        } else if enter < 0.0 {
            assert_eq!(found.unwrap().distance, 0.0);
        } else if enter < leave - 1e-9 {
            hits += 1;
            let found = found.unwrap();
            assert_close(found.distance, enter, 1e-12, "distance");
            let normal = Vec3::from_fn(|k| if k == axis { -d[k].signum() } else { 0.0 });
            assert!((pose.rotation.unrotate(found.normal) - normal).norm() < 1e-12, "{found:?} {normal:?}");
        }
    }
    assert!(hits > 300, "{hits}");
}

#[test]
fn every_hit_lies_on_the_surface_and_nothing_lies_before_it() {
    let mut random = Random::new(23);
    for shape in convex_spatial() {
        let (c, point) =
            (collider::<Spatial>(&shape), collider::<Spatial>(&SpatialShape::Sphere { radius: 1e-9 }));
        let gap = |pose: &Pose<Spatial>, x: Vec3| {
            let at = Pose::new(x, carom_math::Quaternion::IDENTITY);
            Spatial::closest(&point, &at, &c, pose, f64::INFINITY).unwrap().gap + 1e-9
        };
        let mut hits = 0;
        for _ in 0..400 {
            let pose = random.pose3(0.3);
            let origin = random.direction3() * 2.0;
            let direction = (random.vec3() * 0.6 - origin).normalized().unwrap();
            match Spatial::raycast(&c, &pose, origin, direction, 10.0) {
                None => {
                    // sampled densely, the ray stays outside
                    for k in 0..200 {
                        let t = 0.02 * f64::from(k);
                        let inside = gap(&pose, origin + direction * t);
                        assert!(
                            inside > -1e-12,
                            "{shape:?} {pose:?} {origin:?} {direction:?}: {inside} at {t}"
                        );
                    }
                }
                Some(hit) => {
                    hits += 1;
                    let on_surface = origin + direction * hit.distance;
                    assert!(gap(&pose, on_surface).abs() < 1e-12, "{shape:?} {}", gap(&pose, on_surface));
                    assert!(hit.normal.dot(direction) < 1e-9 && (hit.normal.norm() - 1.0).abs() < 1e-12);
                    assert!(
                        (0..20)
                            .all(|k| gap(&pose, origin + direction * (hit.distance * f64::from(k) / 20.0))
                                > 0.0)
                    );
                    assert!(Spatial::raycast(&c, &pose, origin, direction, hit.distance - 1e-9).is_none());
                }
            }
        }
        assert!(hits > 50, "{shape:?}: {hits}");
    }
}

#[test]
fn rays_from_inside_a_solid_hit_at_once_and_surfaces_are_hit_from_both_sides() {
    for shape in convex_spatial() {
        let hit = cast(&shape, &at3(0.0, 0.0, 0.0), vec3(0.01, 0.02, 0.03), X, 5.0).unwrap();
        assert_eq!(hit.distance, 0.0, "{shape:?}");
    }
    let floor = flat_mesh(4, 4.0);
    for (z, down) in [(1.5, -1.0), (-1.5, 1.0)] {
        let hit = cast(&floor, &at3(0.0, 0.0, 0.25), vec3(0.3, 0.4, z), vec3(0.0, 0.0, down), 5.0).unwrap();
        assert_close(hit.distance, (z - 0.25).abs(), 1e-13, "distance");
        assert!((hit.normal + Z * down).norm() < 1e-12, "{hit:?}");
    }
    assert!(cast(&floor, &at3(0.0, 0.0, 0.0), vec3(2.5, 0.0, 1.0), -Z, 5.0).is_none());
    assert!(cast(&floor, &at3(0.0, 0.0, 0.0), vec3(0.5, 0.0, 1.0), -Z, 0.999).is_none());
}

#[test]
fn walls_stop_rays_on_their_plane() {
    let wall = SpatialShape::HalfSpace { normal: vec3(0.0, 0.0, 5.0) };
    let pose = at3(0.0, 0.0, 1.0);
    let down = vec3(0.6, 0.0, -0.8);
    let hit = cast(&wall, &pose, vec3(0.0, 0.0, 3.0), down, 10.0).unwrap();
    assert_close(hit.distance, 2.5, 1e-15, "distance");
    assert_eq!(hit.normal, Z);
    assert!(cast(&wall, &pose, vec3(0.0, 0.0, 3.0), down, 2.4).is_none());
    assert!(cast(&wall, &pose, vec3(0.0, 0.0, 3.0), X, 10.0).is_none());
    assert!(cast(&wall, &pose, vec3(0.0, 0.0, 3.0), -down, 10.0).is_none());
    assert_eq!(cast(&wall, &pose, vec3(0.0, 0.0, 0.5), Z, 10.0).unwrap().distance, 0.0);
    let ground = PlanarShape::HalfPlane { normal: vec2(0.0, 1.0) };
    let hit =
        Planar::raycast(&collider::<Planar>(&ground), &at2(0.0, 0.0), vec2(0.0, 2.0), vec2(0.0, -1.0), 9.0);
    assert_eq!(hit.unwrap().distance, 2.0);
}

#[test]
fn a_ray_through_a_compound_stops_at_the_first_part() {
    let part =
        |x: f64| SpatialPart { pose: at3(x, 0.0, 0.0), shape: SpatialShape::Box { size: [1.0, 1.0, 1.0] } };
    let row = SpatialShape::Compound { parts: (0..9).map(|k| part(2.0 * f64::from(k))).collect() };
    for (x, direction, distance) in [(-3.0, 1.0, 2.5), (30.0, -1.0, 13.5), (5.0, 1.0, 0.5), (5.0, -1.0, 0.5)]
    {
        let hit = cast(&row, &at3(0.0, 0.0, 0.0), vec3(x, 0.1, 0.2), X * direction, 50.0).unwrap();
        assert_close(hit.distance, distance, 1e-13, "distance");
        assert!((hit.normal + X * direction).norm() < 1e-13);
    }
}

#[test]
fn rays_of_the_plane_meet_discs_boxes_and_chains() {
    let cast = |shape: &PlanarShape, x: f64, y: f64, dx: f64, dy: f64| {
        let unit = vec2(dx, dy).normalized().unwrap();
        Planar::raycast(&collider::<Planar>(shape), &at2(0.0, 0.0), vec2(x, y), unit, 100.0)
    };
    let disc = PlanarShape::Circle { radius: 1.0 };
    assert_close(cast(&disc, -3.0, 0.6, 1.0, 0.0).unwrap().distance, 2.2, 1e-14, "disc");
    assert!(cast(&disc, -3.0, 1.1, 1.0, 0.0).is_none());
    let round = PlanarShape::RoundBox { size: [2.0, 2.0], radius: 0.5 };
    let corner = cast(&round, 5.0, 5.0, -1.0, -1.0).unwrap();
    assert_close(corner.distance, 4.0 * 2.0f64.sqrt() - 0.5, 1e-14, "round corner");
    let chain = PlanarShape::Polyline {
        points: vec![vec2(-2.0, 0.0), vec2(0.0, 1.0), vec2(2.0, 0.0)],
        closed: false,
    };
    let hit = cast(&chain, 1.0, 3.0, 0.0, -1.0).unwrap();
    assert_close(hit.distance, 2.5, 1e-14, "chain");
    assert!((hit.normal - vec2(1.0, 2.0) * (1.0 / 5.0f64.sqrt())).norm() < 1e-14);
    let hit = cast(&chain, 1.0, -3.0, 0.0, 1.0).unwrap();
    assert!((hit.normal + vec2(1.0, 2.0) * (1.0 / 5.0f64.sqrt())).norm() < 1e-14);
}
