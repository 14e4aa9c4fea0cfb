//! Meshes, height fields and polylines: nothing stumbles over seams, folds count from the right side.

use crate::common::*;
use carom_geometry::{Geometry, PlanarShape, SpatialShape};
use carom_math::{Column, Planar, Pose, Rotation, Spatial, Turn, Vec2, vec2, vec3};

#[test]
fn nothing_that_rolls_or_slides_over_a_flat_mesh_meets_a_tilted_normal() {
    let mut random = Random::new(11);
    for floor in
        [flat_mesh(6, 6.0), SpatialShape::HeightField { heights: vec![vec![0.0; 7]; 7], size: [6.0, 6.0] }]
    {
        let floor = collider::<Spatial>(&floor);
        for shape in convex_spatial() {
            let c = collider::<Spatial>(&shape);
            for _ in 0..300 {
                let rotation = random.rotation();
                let low = Spatial::bounds(&c, &Pose::new(Column::ZERO, rotation), 0.0).min[2];
                let gap = [1e-3, 0.0, -1e-6, -1e-3][random.below(4)];
                // a good part of the places lies exactly over seams and corners
                let mut place = |_| {
                    if random.unit() < 0.3 { (3.0 * random.signed()).round() } else { 2.4 * random.signed() }
                };
                let position = vec3(place(0).clamp(-2.0, 2.0), place(1).clamp(-2.0, 2.0), gap - low);
                let mut found = Vec::new();
                Spatial::contacts(
                    &c,
                    &Pose::new(position, rotation),
                    &floor,
                    &at3(0.0, 0.0, 0.0),
                    0.01,
                    &mut found,
                );
                let context = || format!("{shape:?} {position:?} {rotation:?} gap {gap:e}\n{found:#?}");
                assert!((1..=4).contains(&found.len()), "{}", context());
                assert!((deepest::<Spatial>(&found) - gap).abs() < 1e-12, "{}", context());
                assert!(found.iter().all(|p| (p.normal - Z).norm() < 1e-12), "{}", context());
            }
        }
    }
}

#[test]
fn nothing_that_slides_over_a_flat_polyline_meets_a_tilted_normal() {
    let mut random = Random::new(12);
    let floor = PlanarShape::Polyline {
        points: (0..9).map(|k| vec2(f64::from(k) - 4.0, 0.0)).collect(),
        closed: false,
    };
    let floor = collider::<Planar>(&floor);
    for figure in convex_planar().into_iter().filter(|f| !matches!(f, PlanarShape::Segment { .. })) {
        let c = collider::<Planar>(&figure);
        for _ in 0..500 {
            let rotation = random.turn();
            let low = Planar::bounds(&c, &Pose::new(Column::ZERO, rotation), 0.0).min[1];
            let gap = [1e-3, 0.0, -1e-6, -1e-3][random.below(4)];
            let x = if random.unit() < 0.3 { (3.0 * random.signed()).round() } else { 3.0 * random.signed() };
            let mut found = Vec::new();
            let pose = Pose::new(vec2(x, gap - low), rotation);
            Planar::contacts(&c, &pose, &floor, &at2(0.0, 0.0), 0.01, &mut found);
            let context = || format!("{figure:?} {pose:?} gap {gap:e}\n{found:#?}");
            assert!((1..=2).contains(&found.len()), "{}", context());
            assert!((deepest::<Planar>(&found) - gap).abs() < 1e-12, "{}", context());
            assert!(found.iter().all(|p| (p.normal - vec2(0.0, 1.0)).norm() < 1e-12), "{}", context());
        }
    }
}

#[test]
fn a_mesh_box_feels_like_a_box() {
    let mut random = Random::new(13);
    let solid = SpatialShape::Box { size: [2.0, 2.0, 2.0] };
    let mesh = box_mesh([1.0, 1.0, 1.0], true);
    for shape in flat_spatial() {
        for _ in 0..200 {
            let pose = Pose::new(random.direction3() * (1.0 + 0.7 * random.unit()), random.rotation());
            let there = contacts::<Spatial>(&shape, &pose, &solid, &at3(0.0, 0.0, 0.0), 0.02);
            let here = contacts::<Spatial>(&shape, &pose, &mesh, &at3(0.0, 0.0, 0.0), 0.02);
            if deepest::<Spatial>(&there) < -0.1 {
                continue; // so deep that a surface and a solid may differ
            }
            let context = || format!("{shape:?} {pose:?}\nsolid {there:#?}\nmesh {here:#?}");
            assert_eq!(there.is_empty(), here.is_empty(), "{}", context());
            if !there.is_empty() && deepest::<Spatial>(&there) > 0.0 {
                assert!(
                    (deepest::<Spatial>(&there) - deepest::<Spatial>(&here)).abs() < 1e-9,
                    "{}",
                    context()
                );
            }
            for p in &here {
                assert!(p.gap > -0.2, "{}", context());
            }
        }
    }
}

/// The surface of a box with outward (or inward) normals.
fn box_mesh(half: [f64; 3], outward: bool) -> SpatialShape {
    let sign = |k: usize, b: usize| if k >> b & 1 == 1 { half[b] } else { -half[b] };
    let vertices = (0..8).map(|k| vec3(sign(k, 0), sign(k, 1), sign(k, 2))).collect();
    let quads = [[1, 3, 7, 5], [0, 4, 6, 2], [2, 6, 7, 3], [0, 1, 5, 4], [4, 5, 7, 6], [0, 2, 3, 1]];
    let triangles = quads
        .iter()
        .flat_map(|q| [[q[0], q[1], q[2]], [q[0], q[2], q[3]]])
        .map(|t| if outward { t } else { [t[0], t[2], t[1]] })
        .collect();
    SpatialShape::TriMesh { vertices, triangles }
}

#[test]
fn a_closed_thin_plate_pushes_only_upwards_from_its_top() {
    let plate = box_mesh([3.0, 3.0, 0.005], true);
    for shape in [SpatialShape::Sphere { radius: 0.5 }, SpatialShape::Box { size: [1.0, 1.0, 1.0] }] {
        for gap in [1e-3, 0.0, -1e-3] {
            let found =
                contacts::<Spatial>(&shape, &at3(0.1, 0.3, 0.505 + gap), &plate, &at3(0.0, 0.0, 0.0), 0.02);
            assert!(!found.is_empty());
            for p in &found {
                assert!((p.normal - Z).norm() < 1e-12 && (p.gap - gap).abs() < 1e-12, "{p:?}");
            }
        }
    }
}

#[test]
fn an_open_mesh_pushes_to_the_side_on_which_a_body_is() {
    let floor = flat_mesh(4, 4.0);
    let ball = SpatialShape::Sphere { radius: 0.5 };
    for (z, up) in [(0.49, 1.0), (-0.49, -1.0)] {
        let found = contacts::<Spatial>(&ball, &at3(0.3, 0.2, z), &floor, &at3(0.0, 0.0, 0.0), 0.02);
        assert_eq!(found.len(), 1);
        assert!((found[0].normal - Z * up).norm() < 1e-13, "{found:?}");
        assert_close(found[0].gap, -0.01, 1e-14, "gap");
    }
}

#[test]
fn a_ball_over_a_ridge_feels_its_edge_and_in_a_valley_both_slopes() {
    let roof = |sign: f64| PlanarShape::Polyline {
        points: vec![vec2(-2.0, -2.0 * sign), vec2(0.0, 0.0), vec2(2.0, -2.0 * sign)],
        closed: false,
    };
    let roof3 = |sign: f64| SpatialShape::HeightField {
        heights: (0..3).map(|_| vec![-2.0 * sign, 0.0, -2.0 * sign]).collect(),
        size: [4.0, 4.0],
    };
    let (disc, ball) = (PlanarShape::Circle { radius: 0.5 }, SpatialShape::Sphere { radius: 0.5 });
    for lean in [-0.3, 0.0, 0.2] {
        let direction = Turn::from_angle(lean).rotate(vec2(0.0, 1.0));
        let place = direction * 0.501;
        let found = contacts::<Planar>(&disc, &at2(place[0], place[1]), &roof(1.0), &at2(0.0, 0.0), 0.01);
        assert_eq!(found.len(), 1, "{found:?}");
        assert!((found[0].normal - direction).norm() < 1e-12 && (found[0].gap - 0.001).abs() < 1e-14);
        let at = at3(place[0], 0.7, place[1]);
        let found = contacts::<Spatial>(&ball, &at, &roof3(1.0), &at3(0.0, 0.0, 0.0), 0.01);
        assert_eq!(found.len(), 1, "{found:?}");
        assert!((found[0].normal - vec3(direction[0], 0.0, direction[1])).norm() < 1e-12, "{found:?}");
        assert_close(found[0].gap, 0.001, 1e-14, "gap");
    }
    let height = 0.5 * 2.0f64.sqrt();
    let found = contacts::<Planar>(&disc, &at2(0.0, height), &roof(-1.0), &at2(0.0, 0.0), 0.01);
    assert_eq!(found.len(), 2);
    assert!(
        found.iter().all(|p| p.gap.abs() < 1e-15 && (p.normal[1] - 0.5f64.sqrt()).abs() < 1e-15),
        "{found:?}"
    );
    let found = contacts::<Spatial>(&ball, &at3(0.0, 0.7, height), &roof3(-1.0), &at3(0.0, 0.0, 0.0), 0.01);
    assert_eq!(found.len(), 2, "{found:?}");
    assert!(
        found.iter().all(|p| p.gap.abs() < 1e-15 && (p.normal[2] - 0.5f64.sqrt()).abs() < 1e-15),
        "{found:?}"
    );
}

#[test]
fn a_box_in_a_corner_of_a_mesh_touches_floor_and_wall_and_nothing_else() {
    // floor z = 0 for x < 0, wall x = 0 for z > 0, as one mesh with a hollow seam
    let vertices = vec![
        vec3(-3.0, -3.0, 0.0),
        vec3(0.0, -3.0, 0.0),
        vec3(0.0, 3.0, 0.0),
        vec3(-3.0, 3.0, 0.0),
        vec3(0.0, -3.0, 3.0),
        vec3(0.0, 3.0, 3.0),
    ];
    let triangles = vec![[0, 1, 2], [0, 2, 3], [1, 4, 5], [1, 5, 2]];
    let mesh = SpatialShape::TriMesh { vertices, triangles };
    let cube = SpatialShape::Box { size: [1.0, 1.0, 1.0] };
    for (dx, dz) in [(0.0, 0.0), (1e-3, 1e-4), (-1e-4, -1e-3), (-1e-3, 5e-3), (1e-9, -1e-9)] {
        let found =
            contacts::<Spatial>(&cube, &at3(-0.5 - dx, 0.2, 0.5 + dz), &mesh, &at3(0.0, 0.0, 0.0), 0.01);
        let (floor, wall): (Vec<carom_geometry::ContactPoint<Spatial>>, Vec<_>) =
            found.iter().copied().partition(|p| (p.normal - Z).norm() < 1e-12);
        assert_eq!((floor.len(), wall.len()), (4, 4), "{found:#?}");
        assert!(floor.iter().all(|p| (p.gap - dz).abs() < 1e-12), "{floor:#?}");
        assert!(
            wall.iter().all(|p| (p.normal + X).norm() < 1e-12 && (p.gap - dx).abs() < 1e-12),
            "{wall:#?}"
        );
    }
}

#[test]
fn a_mesh_body_rests_on_walls_boxes_and_other_meshes() {
    let body = box_mesh([0.5, 0.4, 0.3], true);
    let floors = [
        (SpatialShape::HalfSpace { normal: Z }, 0.0),
        (SpatialShape::Box { size: [6.0, 6.0, 2.0] }, 1.0),
        (flat_mesh(5, 6.0), 0.0),
        (box_mesh([3.0, 3.0, 1.0], true), 1.0),
    ];
    for (floor, top) in floors {
        for gap in [1e-3, 0.0, -1e-3] {
            let pose = Pose::new(vec3(0.11, 0.07, top + 0.3 + gap), about(Z, 0.4));
            let found = contacts::<Spatial>(&body, &pose, &floor, &at3(0.0, 0.0, 0.0), 0.01);
            assert_eq!(found.len(), 4, "{floor:?} {found:#?}");
            for p in &found {
                assert!((p.normal - Z).norm() < 1e-12 && (p.gap - gap).abs() < 1e-12, "{floor:?} {p:?}");
            }
        }
    }
}

#[test]
fn a_disc_inside_a_closed_polyline_is_held_from_all_sides() {
    let ring: Vec<Vec2> = (0..40)
        .map(|k| Turn::from_angle(f64::from(k) * 0.15707963267948966).rotate(vec2(2.0, 0.0)))
        .collect();
    let bowl = PlanarShape::Polyline { points: ring, closed: true };
    let disc = PlanarShape::Circle { radius: 0.5 };
    let mut random = Random::new(14);
    for _ in 0..200 {
        let direction = random.direction2();
        let place = direction * 1.5;
        let found = contacts::<Planar>(&disc, &at2(place[0], place[1]), &bowl, &at2(0.0, 0.0), 0.02);
        assert!(!found.is_empty());
        for p in &found {
            assert!(p.normal.dot(direction) < -0.99, "{p:?}");
            assert!(p.gap.abs() < 0.0075, "{p:?}");
        }
    }
}
