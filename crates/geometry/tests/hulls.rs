//! Hulls and convex decomposition.

use crate::common::*;
use carom_geometry::hull::{convex_hull_planar, convex_hull_spatial};
use carom_geometry::{Decomposition, decompose};
use carom_math::{Column, Vec2, Vec3, vec2, vec3};

fn volume(corners: &[Vec3], triangles: &[[u32; 3]]) -> f64 {
    let at = |i: u32| corners[i as usize] - corners[0];
    triangles.iter().map(|t| at(t[0]).dot(at(t[1]).cross(at(t[2]))) / 6.0).sum()
}

/// Closed, outward, and every point inside.
fn check(points: &[Vec3]) -> (Vec<Vec3>, Vec<[u32; 3]>) {
    let (corners, triangles) =
        convex_hull_spatial(points).unwrap_or_else(|e| panic!("{} points: {e}", points.len()));
    assert_eq!(triangles.len(), 2 * corners.len() - 4, "Euler's formula for a closed triangulated sphere");
    let size = points.iter().fold(0.0, |m: f64, p| m.max(p.max_abs()));
    for t in &triangles {
        let [a, b, c] = t.map(|i| corners[i as usize]);
        let normal = (b - a).cross(c - a);
        let slack = 1e-9 * size * normal.norm() + 1e-13 * size * size * size;
        assert!(points.iter().all(|p| normal.dot(*p - a) <= slack));
    }
    assert!(volume(&corners, &triangles) > 0.0);
    (corners, triangles)
}

#[test]
fn a_cube_with_points_inside_on_faces_and_twice_keeps_its_eight_corners() {
    let mut random = Random::new(41);
    let mut points: Vec<Vec3> =
        (0..27).map(|k| vec3(f64::from(k % 3), f64::from(k / 3 % 3), f64::from(k / 9))).collect();
    points.extend((0..50).map(|_| random.vec3() * 0.9 + vec3(1.0, 1.0, 1.0)));
    points.extend(points.clone());
    let (corners, triangles) = check(&points);
    assert_close(volume(&corners, &triangles), 8.0, 1e-12, "volume");
    assert!((0..8).all(|k| corners.contains(&vec3(
        f64::from(k & 2),
        f64::from((k & 1) * 2),
        f64::from((k & 4) / 2)
    ))));
}

#[test]
fn points_that_lie_in_the_faces_but_for_rounding_do_not_confuse_the_hull() {
    let mut random = Random::new(45);
    for _ in 0..40 {
        let pose = random.pose3(10.0);
        let mut points: Vec<Vec3> = Vec::new();
        for k in 0..200 {
            let (axis, side) = (k % 3, if k % 2 == 0 { 1.0 } else { -1.0 });
            let inside = random.vec3();
            points.push(pose.to_world(Vec3::from_fn(|i| if i == axis { side } else { inside[i] })));
        }
        points.extend(
            (0..8).map(|k| pose.to_world(Vec3::from_fn(|i| if k >> i & 1 == 1 { 1.0 } else { -1.0 }))),
        );
        let (corners, triangles) = check(&points);
        assert_close(volume(&corners, &triangles), 8.0, 1e-11, "volume");
    }
}

#[test]
fn hulls_of_many_kinds_of_points_are_closed_convex_and_complete() {
    let mut random = Random::new(42);
    for n in [4, 5, 8, 20, 100, 400] {
        for _ in 0..10 {
            check(&(0..n).map(|_| random.direction3()).collect::<Vec<_>>());
            check(&(0..n).map(|_| random.vec3()).collect::<Vec<_>>());
            let turned = random.pose3(100.0);
            // a plate and a needle a thousand times longer than thick
            check(
                &(0..n)
                    .map(|_| turned.to_world(vec3(random.signed(), random.signed(), 1e-3 * random.signed())))
                    .collect::<Vec<_>>(),
            );
            check(
                &(0..n)
                    .map(|_| {
                        turned.to_world(vec3(random.signed(), 1e-3 * random.signed(), 1e-3 * random.signed()))
                    })
                    .collect::<Vec<_>>(),
            );
        }
    }
    for n in [3, 6, 16, 64] {
        // prisms and cones with many corners in one plane
        let ring = |z: f64, r: f64| {
            (0..n).map(move |k| {
                let angle = std::f64::consts::TAU * f64::from(k) / f64::from(n);
                vec3(r * angle.cos(), r * angle.sin(), z)
            })
        };
        check(&ring(0.0, 1.0).chain(ring(2.0, 1.0)).collect::<Vec<_>>());
        check(&ring(0.0, 1.0).chain([vec3(0.0, 0.0, 3.0)]).collect::<Vec<_>>());
        check(&ring(0.0, 1.0).chain(ring(0.5, 0.7)).chain(ring(1.0, 0.2)).collect::<Vec<_>>());
    }
}

#[test]
fn the_hull_does_not_depend_on_size_and_place() {
    let points = hull_points(30, 1.0, 43);
    let (corners, triangles) = check(&points);
    for (scale, shift) in [(1e-6, 0.0), (1e6, 0.0), (1.0, 1e3)] {
        let moved: Vec<Vec3> = points.iter().map(|p| *p * scale + vec3(shift, shift, -shift)).collect();
        let (c, t) = check(&moved);
        assert_eq!(c.len(), corners.len());
        assert_close(
            volume(&c, &t) / (scale * scale * scale) / volume(&corners, &triangles),
            1.0,
            1e-9,
            "volume",
        );
    }
}

#[test]
fn planar_hulls_are_counter_clockwise_without_points_on_edges() {
    let mut random = Random::new(44);
    let mut square: Vec<Vec2> = (0..9).map(|k| vec2(f64::from(k % 3), f64::from(k / 3))).collect();
    square.extend((0..20).map(|_| vec2(2.0 * random.unit(), 2.0 * random.unit())));
    assert_eq!(
        convex_hull_planar(&square).unwrap(),
        [vec2(0.0, 0.0), vec2(2.0, 0.0), vec2(2.0, 2.0), vec2(0.0, 2.0)]
    );
    for n in [3, 5, 30, 300] {
        let points: Vec<Vec2> = (0..n).map(|_| random.vec2()).collect();
        let hull = convex_hull_planar(&points).unwrap();
        for k in 0..hull.len() {
            let (a, b) = (hull[k], hull[(k + 1) % hull.len()]);
            assert!(points.iter().all(|p| (b - a).cross(*p - a) >= -1e-14));
        }
    }
}

/// The surface of a polygon in x, y (counter-clockwise, given with its triangulation) from z = 0 to z = 1.
fn extruded(outline: &[[f64; 2]], cap: &[[u32; 3]]) -> (Vec<Vec3>, Vec<[u32; 3]>) {
    let n = outline.len() as u32;
    let mut vertices: Vec<Vec3> = outline.iter().map(|p| vec3(p[0], p[1], 0.0)).collect();
    vertices.extend(outline.iter().map(|p| vec3(p[0], p[1], 1.0)));
    let mut triangles: Vec<[u32; 3]> = cap.iter().map(|t| [t[0], t[2], t[1]]).collect();
    triangles.extend(cap.iter().map(|t| t.map(|i| i + n)));
    for k in 0..n {
        let next = (k + 1) % n;
        triangles.extend([[k, next, next + n], [k, next + n, k + n]]);
    }
    (vertices, triangles)
}

#[test]
fn an_l_and_a_u_fall_into_convex_parts_of_the_right_volume_that_leave_the_notch_free() {
    let l = extruded(
        &[[0.0, 0.0], [2.0, 0.0], [2.0, 1.0], [1.0, 1.0], [1.0, 2.0], [0.0, 2.0]],
        &[[0, 1, 2], [0, 2, 3], [0, 3, 4], [0, 4, 5]],
    );
    let u = extruded(
        &[[0.0, 0.0], [3.0, 0.0], [3.0, 2.0], [2.0, 2.0], [2.0, 1.0], [1.0, 1.0], [1.0, 2.0], [0.0, 2.0]],
        &[[0, 1, 4], [0, 4, 5], [1, 2, 4], [2, 3, 4], [0, 5, 6], [0, 6, 7]],
    );
    for ((vertices, triangles), solid, notch) in
        [(l, 3.0, vec3(1.6, 1.6, 0.5)), (u, 5.0, vec3(1.5, 1.6, 0.5))]
    {
        assert_close(volume(&vertices, &triangles), solid, 1e-12, "the test's own mesh");
        let parts = decompose(&vertices, &triangles, &Decomposition::default()).unwrap();
        assert!((2..=6).contains(&parts.len()), "{} parts", parts.len());
        let mut sum = 0.0;
        for part in &parts {
            let (corners, faces) = check(part);
            sum += volume(&corners, &faces);
            let outside = faces.iter().any(|t| {
                let [a, b, c] = t.map(|i| corners[i as usize]);
                (b - a).cross(c - a).dot(notch - a) > 0.0
            });
            assert!(outside, "a part fills the notch: {part:?}");
        }
        assert!((sum / solid - 1.0).abs() < 0.05, "volume {sum} for {solid}");
        assert_eq!(parts, decompose(&vertices, &triangles, &Decomposition::default()).unwrap());
    }
}

#[test]
fn decomposition_refuses_what_it_cannot_do() {
    let tetrahedron = [vec3(0.0, 0.0, 0.0), vec3(1.0, 0.0, 0.0), vec3(0.0, 1.0, 0.0), vec3(0.0, 0.0, 1.0)];
    let faces = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]];
    let refuse = |o: Decomposition| decompose(&tetrahedron, &faces, &o).unwrap_err().field;
    assert_eq!(refuse(Decomposition { max_parts: 0, ..Default::default() }), "max_parts");
    assert_eq!(refuse(Decomposition { resolution: 100_000, ..Default::default() }), "resolution");
    assert_eq!(refuse(Decomposition { concavity: f64::NAN, ..Default::default() }), "concavity");
    assert_eq!(
        decompose(&tetrahedron, &[[0, 1, 9]], &Decomposition::default()).unwrap_err().field,
        "triangles[0][2]"
    );
}
