//! Closed forms of the plane's mass properties against textbook formulas and against each other
//! (theory chapter 1).

use crate::mass_common::*;
use carom_geometry::mass_moments::Moments;
use carom_geometry::mass_polygon::polygon_moments;
use carom_geometry::{MassProperties, PlanarPart, PlanarShape, mass_planar};
use carom_math::{Column, Moment, Planar, Pose, Rotation, Turn, Vec2, vec1, vec2};
use std::f64::consts::PI;

fn known(mass: f64, center: Vec2, inertia: f64) -> MassProperties<Planar> {
    MassProperties { mass, center, inertia: Moment(inertia), error: 0.0 }
}

/// Case C4.
#[test]
fn disc_and_box_have_the_textbook_inertia() {
    let r = 0.37;
    let m = 2.5 * PI * r * r;
    let disc = mass_planar::mass_properties(&PlanarShape::Circle { radius: r }, 2.5).unwrap();
    assert_same(&disc, &known(m, Vec2::ZERO, 0.5 * m * r * r), 1e-15, "disc");
    let (a, b) = (1.7, 0.3);
    let m = 2.5 * a * b;
    let plate = mass_planar::mass_properties(&PlanarShape::Box { size: [a, b] }, 2.5).unwrap();
    assert_same(&plate, &known(m, Vec2::ZERO, m / 12.0 * (a * a + b * b)), 1e-15, "box");
    assert_eq!(plate.center, Vec2::ZERO, "a box is centred to the last bit");
}

/// Case C4.
#[test]
fn capsule_is_a_box_between_two_half_discs() {
    let (l, r) = (1.3, 0.4);
    let (band, discs) = (2.0 * r * l, PI * r * r);
    // a half disc has its centroid 4 r / (3 pi) from the diameter
    let half = 4.0 * r / (3.0 * PI);
    let own = discs * (0.5 * r * r - half * half);
    let inertia = band / 12.0 * (l * l + 4.0 * r * r) + own + discs * (0.5 * l + half).powi(2);
    let capsule = planar(&PlanarShape::Capsule { length: l, radius: r });
    assert_same(&capsule, &known(band + discs, Vec2::ZERO, inertia), 1e-14, "capsule");
}

/// Case C4.
#[test]
fn regular_polygons_have_their_closed_form() {
    let side = 0.8;
    for count in 3..=12 {
        let cot = 1.0 / (PI / count as f64).tan();
        let mass = 0.25 * count as f64 * side * side * cot;
        let exact = known(mass, Vec2::ZERO, mass * side * side / 24.0 * (1.0 + 3.0 * cot * cot));
        let polygon = planar(&PlanarShape::ConvexPolygon { points: regular_polygon(count, side) });
        assert_same(&polygon, &exact, 1e-14, &format!("{count}-gon"));
    }
}

#[test]
fn triangle_has_its_closed_form() {
    let (a, b, c) = (vec2(0.1, -0.3), vec2(1.2, 0.4), vec2(-0.2, 0.9));
    let area = 0.5 * (b - a).cross(c - a);
    let sides = (b - a).norm_squared() + (c - b).norm_squared() + (a - c).norm_squared();
    let triangle = planar(&PlanarShape::ConvexPolygon { points: vec![a, b, c] });
    assert_same(&triangle, &known(area, (a + b + c) * (1.0 / 3.0), area * sides / 36.0), 1e-14, "triangle");
}

#[test]
fn round_polygon_of_box_corners_is_the_round_box() {
    let (x, y, radius) = (1.2, 0.5, 0.3);
    let points = vec![
        vec2(-0.5 * x, -0.5 * y),
        vec2(0.5 * x, -0.5 * y),
        vec2(0.5 * x, 0.5 * y),
        vec2(-0.5 * x, 0.5 * y),
    ];
    let swept = planar(&PlanarShape::RoundPolygon { points, radius });
    assert_same(&swept, &planar(&PlanarShape::RoundBox { size: [x, y], radius }), 1e-14, "round box");
}

#[test]
fn rounded_shapes_without_rounding_are_their_cores() {
    let tiny = 1e-9;
    let points = planar_cloud(9, 11);
    let sharp = planar(&PlanarShape::ConvexPolygon { points: points.clone() });
    assert_same(&planar(&PlanarShape::RoundPolygon { points, radius: tiny }), &sharp, 1e-7, "polygon");
    let size = [1.2, 0.5];
    let sharp = planar(&PlanarShape::Box { size });
    assert_same(&planar(&PlanarShape::RoundBox { size, radius: tiny }), &sharp, 1e-7, "box");
}

#[test]
fn rounded_shapes_without_a_core_are_discs() {
    let (tiny, radius) = (1e-8, 0.6);
    let disc = planar(&PlanarShape::Circle { radius });
    let points = planar_cloud(9, 12).iter().map(|p| *p * tiny).collect();
    assert_same(&planar(&PlanarShape::RoundPolygon { points, radius }), &disc, 1e-7, "polygon");
    assert_same(&planar(&PlanarShape::RoundBox { size: [tiny, tiny], radius }), &disc, 1e-7, "box");
    assert_same(&planar(&PlanarShape::Capsule { length: tiny, radius }), &disc, 1e-7, "capsule");
}

#[test]
fn round_polygon_is_the_limit_of_sampled_hulls() {
    let (points, radius) = (planar_cloud(7, 13), 0.3);
    let exact = planar(&PlanarShape::RoundPolygon { points: points.clone(), radius });
    for count in [64, 128, 256, 512, 1024] {
        let step = std::f64::consts::TAU / count as f64;
        let rim = |k: usize| Turn::from_angle(k as f64 * step).rotate(vec2(radius, 0.0));
        let sampled = points.iter().flat_map(|p| (0..count).map(move |k| *p + rim(k))).collect();
        let error = difference(&planar(&PlanarShape::ConvexPolygon { points: sampled }), &exact);
        // chords of a circle miss it by step^2 / 8 of its radius
        assert!((0.02..0.2).contains(&(error / (step * step))), "{count} samples: {error:.2e}");
    }
}

/// Case C4.
#[test]
fn a_compound_that_tiles_a_shape_has_its_mass_properties() {
    let whole = planar(&PlanarShape::Box { size: [2.0, 1.0] });
    let tile = |x: f64, width: f64| PlanarPart {
        pose: Pose::new(vec2(x, 0.0), Turn::IDENTITY),
        shape: PlanarShape::Box { size: [width, 1.0] },
    };
    let tiles = PlanarShape::Compound { parts: vec![tile(-0.75, 0.5), tile(-0.25, 0.5), tile(0.5, 1.0)] };
    assert_same(&planar(&tiles), &whole, 1e-15, "tiles");
    let (points, apex) =
        (planar_cloud(15, 14), planar(&PlanarShape::ConvexPolygon { points: planar_cloud(15, 14) }).center);
    let hull = carom_geometry::hull::convex_hull_planar(&points).unwrap();
    let parts = (0..hull.len())
        .map(|i| PlanarPart {
            pose: Pose::default(),
            shape: PlanarShape::ConvexPolygon { points: vec![apex, hull[i], hull[(i + 1) % hull.len()]] },
        })
        .collect();
    let whole = planar(&PlanarShape::ConvexPolygon { points });
    assert_same(&planar(&PlanarShape::Compound { parts }), &whole, 1e-14, "triangles");
}

#[test]
fn overlapping_parts_count_twice() {
    let part = || PlanarPart { pose: Pose::default(), shape: PlanarShape::Circle { radius: 0.5 } };
    let once = planar(&PlanarShape::Circle { radius: 0.5 });
    let twice = planar(&PlanarShape::Compound { parts: vec![part(), part()] });
    assert_same(&twice, &once.with_mass(2.0 * once.mass), 1e-15, "two discs in one place");
}

/// Case C4.
#[test]
fn polygons_do_not_change_when_moved_or_turned() {
    let points = planar_cloud(20, 15);
    let own = planar(&PlanarShape::ConvexPolygon { points: points.clone() });
    let rounded = planar(&PlanarShape::RoundPolygon { points: points.clone(), radius: 0.2 });
    let mut numbers = Numbers(16);
    for _ in 0..50 {
        let pose: Pose<Planar> =
            Pose::new(numbers.planar(1.0), Turn::about(vec1(numbers.between(-3.0, 3.0))));
        let moved: Vec<Vec2> = points.iter().map(|p| pose.to_world(*p)).collect();
        let there = planar(&PlanarShape::ConvexPolygon { points: moved.clone() });
        assert_same(&there, &own.placed(&pose), 1e-14, "polygon");
        let there = planar(&PlanarShape::RoundPolygon { points: moved, radius: 0.2 });
        assert_same(&there, &rounded.placed(&pose), 1e-14, "round polygon");
    }
}

#[test]
fn a_polygon_far_from_zero_loses_only_what_its_coordinates_lose() {
    let points = regular_polygon(5, 1.0);
    let far = vec2(1e6, -2e6);
    let there: Vec<Vec2> = points.iter().map(|p| *p + far).collect();
    // coordinates of 2e6 are rounded to 2e-10
    let own = planar(&PlanarShape::ConvexPolygon { points });
    let moved = MassProperties { center: own.center + far, ..own };
    assert_same(&planar(&PlanarShape::ConvexPolygon { points: there }), &moved, 2e-9, "far pentagon");
}

#[test]
fn a_polygon_that_is_not_convex_is_integrated_by_its_outline() {
    // an L of three unit squares
    let outline =
        [[0.0, 0.0], [2.0, 0.0], [2.0, 1.0], [1.0, 1.0], [1.0, 2.0], [0.0, 2.0]].map(|[x, y]| vec2(x, y));
    let squares = [[0.5, 0.5], [1.5, 0.5], [0.5, 1.5]].map(|[x, y]| PlanarPart {
        pose: Pose::new(vec2(x, y), Turn::IDENTITY),
        shape: PlanarShape::Box { size: [1.0, 1.0] },
    });
    let exact = planar(&PlanarShape::Compound { parts: squares.to_vec() });
    let moments = polygon_moments(&outline).unwrap();
    assert_same(&moments.mass_properties(1.0).unwrap(), &exact, 1e-15, "L");
    // second moments about zero: int x^2 = 8/3 + 1/3, int x y = 1 + 3/4
    let about_zero = moments.about(Vec2::ZERO);
    assert!((about_zero.second[0][0] - 3.0).abs() < 1e-14, "{about_zero:?}");
    assert!((about_zero.second[0][1] - 1.75).abs() < 1e-14, "{about_zero:?}");
}

#[test]
fn a_hole_is_taken_away() {
    let square =
        |half: f64| [[-half, -half], [half, -half], [half, half], [-half, half]].map(|[x, y]| vec2(x, y));
    let frame =
        polygon_moments(&square(1.0)).unwrap().plus(&polygon_moments(&square(0.5)).unwrap().scaled(-1.0));
    let exact = known(3.0, Vec2::ZERO, 4.0 * 8.0 / 12.0 - 1.0 * 2.0 / 12.0);
    assert_same(&frame.mass_properties(1.0).unwrap(), &exact, 1e-15, "frame");
}

#[test]
fn outlines_that_enclose_nothing_are_refused() {
    let square = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]].map(|[x, y]| vec2(x, y));
    let mut reversed = square;
    reversed.reverse();
    assert!(polygon_moments(&reversed).unwrap_err().problem.contains("clockwise"));
    assert!(polygon_moments(&square[..2]).unwrap_err().problem.contains("at least 3"));
    assert!(polygon_moments(&[square[0], square[1], square[0]]).unwrap_err().problem.contains("no area"));
    assert!(
        polygon_moments(&[square[0], square[1], vec2(f64::NAN, 0.0)])
            .unwrap_err()
            .problem
            .contains("point 2")
    );
    assert!(Moments::zero(Vec2::ZERO).mass_properties(1.0).is_err(), "the empty region has no centre");
}

#[test]
fn massless_shapes_and_bad_densities_are_refused_with_a_remedy() {
    let (a, b) = (vec2(0.0, 0.0), vec2(1.0, 0.0));
    let massless = [
        PlanarShape::Segment { a, b },
        PlanarShape::Polyline { points: vec![a, b], closed: false },
        PlanarShape::HalfPlane { normal: vec2(0.0, 1.0) },
        PlanarShape::HeightField { heights: vec![0.0, 1.0], width: 1.0 },
    ];
    for shape in &massless {
        let error = mass_planar::mass_properties(shape, 1.0).unwrap_err();
        assert!(error.remedy.contains("explicitly") && error.remedy.contains("fixed"), "{shape:?}: {error}");
        assert!(
            mass_planar::mass_properties_of(shape, &mut |p| vec![1.0; p.len()], 1e-6).is_err(),
            "{shape:?}"
        );
    }
    for density in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        let error = mass_planar::mass_properties(&PlanarShape::Circle { radius: 1.0 }, density).unwrap_err();
        assert_eq!(error.field, "density", "{density}");
    }
    let wall = PlanarPart { pose: Pose::default(), shape: massless[0].clone() };
    let error = mass_planar::mass_properties(&PlanarShape::Compound { parts: vec![wall] }, 1.0).unwrap_err();
    assert!(error.field.starts_with("parts[0]"), "{error}");
    assert!(mass_planar::mass_properties(&PlanarShape::Compound { parts: vec![] }, 1.0).is_err());
    let error = mass_planar::mass_properties(&PlanarShape::Box { size: [1.0, -2.0] }, 1.0).unwrap_err();
    assert_eq!(error.field, "size[1]");
}
