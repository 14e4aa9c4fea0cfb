//! Mass properties of density functions: closed forms of smooth, layered and enclosed densities, the honesty of
//! the stated error, and what is refused (theory chapter 1).

use crate::mass_common::*;
use carom_geometry::quadrature::{ACCEPTABLE_ERROR, EVALUATION_BUDGET};
use carom_geometry::{MassProperties, PlanarPart, PlanarShape, ShapeError, SpatialPart, SpatialShape};
use carom_geometry::{mass_planar, mass_spatial};
use carom_math::{
    Column, Inertia, Planar, Pose, Quaternion, Rotation, Space, Spatial, Sym3, Turn, Vec2, Vec3, vec2, vec3,
};
use std::f64::consts::PI;

/// The error a body states bounds how far it is from the truth, and is within the tolerance.
fn assert_honest<S: Space>(found: &MassProperties<S>, truth: &MassProperties<S>, tolerance: f64, what: &str) {
    let d = difference(found, truth);
    assert!(found.error <= tolerance, "{what}: error {:.1e} > {tolerance:.0e}", found.error);
    assert!(d <= found.error, "{what}: off by {d:.1e}, stated {:.1e}", found.error);
}

/// The part of a convex body below a plane: its corners there, and where its edges cross.
fn below(points: &[Vec3], normal: Vec3, level: f64) -> SpatialShape {
    let height = |p: Vec3| normal.dot(p) - level;
    let (vertices, triangles) = carom_geometry::hull::convex_hull_spatial(points).unwrap();
    let mut kept: Vec<Vec3> = vertices.iter().copied().filter(|p| height(*p) <= 0.0).collect();
    for t in &triangles {
        for k in 0..3 {
            let (a, b) = (vertices[t[k] as usize], vertices[t[(k + 1) % 3] as usize]);
            // every edge once, from below to above
            if height(a) < 0.0 && height(b) > 0.0 {
                kept.push(a + (b - a) * (height(a) / (height(a) - height(b))));
            }
        }
    }
    SpatialShape::ConvexHull { points: kept }
}

/// Two bodies of one material each, joined.
fn of_two(a: &SpatialShape, density_a: f64, b: &SpatialShape, density_b: f64) -> MassProperties<Spatial> {
    let own = mass_spatial::mass_properties(a, density_a).unwrap();
    own.joined(&mass_spatial::mass_properties(b, density_b).unwrap())
}

fn ball_at(center: Vec3, radius: f64, density: f64) -> MassProperties<Spatial> {
    let ball = mass_spatial::mass_properties(&SpatialShape::Sphere { radius }, density).unwrap();
    ball.placed(&Pose::new(center, Quaternion::IDENTITY))
}

#[test]
fn a_constant_density_gives_the_closed_form_of_every_shape() {
    for shape in planar_shapes() {
        let found = planar_of(&shape, |_| 1.0, 1e-10);
        assert_honest(&found, &planar(&shape), 1e-10, &format!("{shape:?}"));
        assert_same(&found, &planar(&shape), 1e-13, &format!("{shape:?}"));
    }
    for shape in spatial_shapes() {
        let found = spatial_of(&shape, |_| 1.0, 1e-9);
        assert_honest(&found, &spatial(&shape), 1e-9, &format!("{shape:?}"));
        assert_same(&found, &spatial(&shape), 1e-12, &format!("{shape:?}"));
    }
}

#[test]
fn a_linear_density_has_a_closed_form_centre() {
    // rho = 1 + g.(x - c): m = V, centre = c + C g / V with the central second moment C = tr(I)/2 1 - I
    for shape in planar_shapes() {
        let uniform = planar(&shape);
        let g = vec2(0.2, -0.1);
        let found = planar_of(&shape, |p| 1.0 + g.dot(p - uniform.center), 1e-9);
        assert!((found.mass / uniform.mass - 1.0).abs() < 1e-12, "{shape:?}");
        // in the plane the inertia is tr(C): check the centre along g only where C is isotropic
        if let PlanarShape::Circle { .. } = shape {
            let exact = uniform.center + g * (0.5 * uniform.inertia.0 / uniform.mass);
            assert!((found.center - exact).norm() < 1e-12, "{:?} {exact:?}", found.center);
        }
    }
    for shape in spatial_shapes() {
        let uniform = spatial(&shape);
        let g = vec3(0.2, -0.1, 0.15);
        let found = spatial_of(&shape, |p| 1.0 + g.dot(p - uniform.center), 1e-9);
        let half_trace = 0.5 * uniform.inertia.diagonal.iter().sum::<f64>();
        let second = g * half_trace - uniform.inertia.apply(g);
        let exact = uniform.center + second * (1.0 / uniform.mass);
        assert!((found.mass / uniform.mass - 1.0).abs() < 1e-11, "{shape:?}");
        assert!((found.center - exact).norm() < 1e-11, "{shape:?}: {:?} {exact:?}", found.center);
    }
}

/// Case C4.
#[test]
fn smooth_densities_meet_their_closed_forms() {
    let r = 0.7f64;
    // rho = |x|^2 in a ball: m = 4/5 pi r^5, I = 2/3 int |x|^4 = 8/21 pi r^7
    let found = spatial_of(&SpatialShape::Sphere { radius: r }, |p| p.norm_squared(), 1e-10);
    let i = 8.0 / 21.0 * PI * r.powi(7);
    let exact = MassProperties {
        mass: 0.8 * PI * r.powi(5),
        center: Vec3::ZERO,
        inertia: Sym3::diag(i, i, i),
        error: 0.0,
    };
    assert_honest(&found, &exact, 1e-10, "ball of |x|^2");
    // rho = e^x over [-1, 1]^2: m = 4 sinh 1, int x rho = 4 / e, int x^2 rho = 2 (e - 5/e), int y^2 rho = m / 3
    let e = 1f64.exp();
    let (mass, first) = (2.0 * (e - 1.0 / e), 4.0 / e);
    let second = 2.0 * (e - 5.0 / e) + mass / 3.0;
    let center = vec2(first / mass, 0.0);
    let inertia = carom_math::Moment(second - first * first / mass);
    let found = planar_of(&PlanarShape::Box { size: [2.0, 2.0] }, |p| p[0].exp(), 1e-10);
    assert_honest(&found, &MassProperties { mass, center, inertia, error: 0.0 }, 1e-10, "box of e^x");
}

#[test]
fn layers_through_the_middle_are_exact_and_cheap() {
    let layered = |z: f64| if z < 0.0 { 4900.0 } else { 900.0 };
    let size = [1.2, 0.5, 0.8];
    let half = |z: f64| SpatialPart {
        pose: Pose::new(vec3(0.0, 0.0, z), Quaternion::IDENTITY),
        shape: SpatialShape::Box { size: [1.2, 0.5, 0.4] },
    };
    let alone = |part| SpatialShape::Compound { parts: vec![part] };
    let exact = of_two(&alone(half(-0.2)), 4900.0, &alone(half(0.2)), 900.0);
    let mut count = 0;
    let mut density = |points: &[Vec3]| {
        count += points.len();
        points.iter().map(|p| layered(p[2])).collect()
    };
    let found = mass_spatial::mass_properties_of(&SpatialShape::Box { size }, &mut density, 1e-10).unwrap();
    assert_honest(&found, &exact, 1e-10, "box");
    assert!(count < 50_000, "{count} evaluations");
    // half balls: V = 2/3 pi r^3, centroid 3/8 r, I = V r^2 (2/5, 2/5, 2/5) about the ball's centre
    let r = 0.7f64;
    let v = 2.0 / 3.0 * PI * r.powi(3);
    let mass = 5800.0 * v;
    let z = -4000.0 * v * 0.375 * r / mass;
    let i = 0.4 * mass * r * r;
    let inertia = Sym3::diag(i, i, i).plus(&Spatial::steiner(-mass, vec3(0.0, 0.0, z)));
    let exact = MassProperties { mass, center: vec3(0.0, 0.0, z), inertia, error: 0.0 };
    let found = spatial_of(&SpatialShape::Sphere { radius: r }, |p| layered(p[2]), 1e-8);
    assert_honest(&found, &exact, 1e-8, "ball");
}

#[test]
fn layers_at_any_height_converge_fast() {
    let (size, level) = ([1.2, 0.5, 0.8], 0.1234);
    for axis in 0..3 {
        let normal = Vec3::from_fn(|i| if i == axis { 1.0 } else { 0.0 });
        let corners = box_corners(size);
        let exact = of_two(&below(&corners, normal, level), 4900.0, &below(&corners, -normal, -level), 900.0);
        let density = |p: Vec3| if p[axis] < level { 4900.0 } else { 900.0 };
        let found = spatial_of(&SpatialShape::Box { size }, density, 1e-9);
        assert_honest(&found, &exact, 1e-9, &format!("layer across axis {axis}"));
    }
}

#[test]
fn jumps_in_the_plane_reach_ten_digits() {
    let cut = |p: Vec2| 0.37 * p[0] + p[1] - 0.1;
    let outline = carom_geometry::hull::convex_hull_planar(&planar_cloud(12, 31)).unwrap();
    let shape = PlanarShape::ConvexPolygon { points: outline.clone() };
    let side = |sign: f64, density: f64| {
        let mut points: Vec<Vec2> = outline.iter().copied().filter(|p| sign * cut(*p) <= 0.0).collect();
        for i in 0..outline.len() {
            let (a, b) = (outline[i], outline[(i + 1) % outline.len()]);
            if cut(a) * cut(b) < 0.0 {
                points.push(a + (b - a) * (cut(a) / (cut(a) - cut(b))));
            }
        }
        mass_planar::mass_properties(&PlanarShape::ConvexPolygon { points }, density).unwrap()
    };
    let exact = side(1.0, 4900.0).joined(&side(-1.0, 900.0));
    let density = |p: Vec2| if cut(p) < 0.0 { 4900.0 } else { 900.0 };
    for tolerance in [1e-4, 1e-6, 1e-8, 1e-10] {
        assert_honest(&planar_of(&shape, density, tolerance), &exact, tolerance, "cut polygon");
    }
    // a disc of another density inside a box, two pieces of which it touches
    let (center, radius) = (vec2(0.1, 0.05), 0.2);
    let shape = PlanarShape::RoundBox { size: [1.2, 0.5], radius: 0.3 };
    let disc = mass_planar::mass_properties(&PlanarShape::Circle { radius }, 4000.0).unwrap();
    let base = mass_planar::mass_properties(&shape, 900.0).unwrap();
    let exact = base.joined(&disc.placed(&Pose::new(center, Turn::IDENTITY)));
    let density = |p: Vec2| if (p - center).norm() < radius { 4900.0 } else { 900.0 };
    for tolerance in [1e-4, 1e-6, 1e-8, 1e-10] {
        assert_honest(&planar_of(&shape, density, tolerance), &exact, tolerance, "disc in a box");
    }
}

/// Case C4.
#[test]
fn the_stated_error_bounds_the_true_error_of_oblique_layers_in_space() {
    let mut numbers = Numbers(32);
    let cloud = spatial_cloud(20, 33);
    let (vertices, _) = carom_geometry::hull::convex_hull_spatial(&cloud).unwrap();
    let bodies = [
        (SpatialShape::Box { size: [1.2, 0.5, 0.8] }, box_corners([1.2, 0.5, 0.8])),
        (SpatialShape::ConvexHull { points: cloud }, vertices),
    ];
    for (shape, corners) in &bodies {
        for _ in 0..3 {
            let normal = numbers.spatial(1.0).normalized().unwrap();
            let level = normal.dot(spatial(shape).center) + numbers.between(-0.1, 0.1);
            let exact =
                of_two(&below(corners, normal, level), 4900.0, &below(corners, -normal, -level), 900.0);
            let density = |p: Vec3| if normal.dot(p) < level { 4900.0 } else { 900.0 };
            for tolerance in [1e-2, 1e-3, 1e-4] {
                assert_honest(&spatial_of(shape, density, tolerance), &exact, tolerance, "oblique layers");
            }
        }
    }
}

#[test]
fn fine_meshes_are_integrated_with_coarser_grids() {
    let points: Vec<Vec3> = on_sphere(vec3(0.1, 0.0, -0.05), 0.5, 1000).collect();
    let (vertices, triangles) = carom_geometry::hull::convex_hull_spatial(&points).unwrap();
    let shape = SpatialShape::TriMesh { vertices, triangles };
    let uniform = spatial(&shape);
    assert_honest(&spatial_of(&shape, |_| 1.0, 1e-7), &uniform, 1e-7, "constant");
    let (normal, level) = (vec3(0.2, 0.0, 1.0), 0.1);
    let exact = of_two(&below(&points, normal, level), 4.0, &below(&points, -normal, -level), 1.0);
    let density = |p: Vec3| if normal.dot(p) < level { 4.0 } else { 1.0 };
    for tolerance in [1e-2, 1e-3, 1e-4] {
        assert_honest(&spatial_of(&shape, density, tolerance), &exact, tolerance, "layers");
    }
}

#[test]
fn the_stated_error_bounds_the_true_error_of_a_ball_inside() {
    let (center, radius) = (vec3(0.12, 0.03, -0.08), 0.15);
    let density = |p: Vec3| if (p - center).norm() < radius { 4900.0 } else { 900.0 };
    for shape in spatial_shapes() {
        // the ball fits into these alone
        let holds_it = matches!(
            shape,
            SpatialShape::Sphere { .. }
                | SpatialShape::Capsule { .. }
                | SpatialShape::Box { .. }
                | SpatialShape::Cylinder { .. }
                | SpatialShape::RoundBox { .. }
                | SpatialShape::RoundCylinder { .. }
                | SpatialShape::RoundCone { .. }
                | SpatialShape::RoundConvexHull { .. }
        );
        if !holds_it {
            continue;
        }
        let base = mass_spatial::mass_properties(&shape, 900.0).unwrap();
        let exact = base.joined(&ball_at(center, radius, 4000.0));
        for tolerance in [1e-2, 1e-3, 2e-4] {
            let found = spatial_of(&shape, density, tolerance);
            assert_honest(&found, &exact, tolerance, &format!("{shape:?}"));
        }
    }
}

#[test]
fn kinks_and_steep_slopes_are_stated_honestly() {
    // |x - a| over [-1, 1]^2: m = 2 (1 + a^2), int x = 2 (a^3/3 - a), int x^2 = 1 + a^4/3, int y^2 = m/3
    let shape = PlanarShape::Box { size: [2.0, 2.0] };
    for a in [0f64, 0.013, 0.1, 0.37, 0.499, 0.77, 0.991] {
        let (mass, first) = (2.0 * (1.0 + a * a), 2.0 * (a * a * a / 3.0 - a));
        let second = 1.0 + a.powi(4) / 3.0 + mass / 3.0;
        let inertia = carom_math::Moment(second - first * first / mass);
        let exact = MassProperties { mass, center: vec2(first / mass, 0.0), inertia, error: 0.0 };
        for tolerance in [1e-4, 1e-7, 1e-10] {
            let found = planar_of(&shape, |p| (p[0] - a).abs(), tolerance);
            assert_honest(&found, &exact, tolerance, &format!("kink at {a}"));
        }
    }
    // 1 + tanh(k x): odd part of a symmetric box, so m = 4 and int x^2 + y^2 = 8/3, whatever the steepness
    for k in [10.0, 100.0, 1e4, 1e6] {
        let found = planar_of(&shape, |p| 1.0 + (k * (p[0] + 0.2 * p[1])).tanh(), 1e-8);
        assert!((found.mass / 4.0 - 1.0).abs() <= found.error, "{k}: {found:?}");
        let about_zero = found.inertia.0 + found.mass * found.center.norm_squared();
        assert!((about_zero * 3.0 / 8.0 - 1.0).abs() < 1e-7, "{k}: {about_zero}");
    }
}

#[test]
fn a_part_may_weigh_nothing() {
    // only the right half of a box has mass
    let density = |p: Vec2| if p[0] > 0.0 { 2.0 } else { 0.0 };
    let found = planar_of(&PlanarShape::Box { size: [2.0, 1.0] }, density, 1e-10);
    let half = mass_planar::mass_properties(&PlanarShape::Box { size: [1.0, 1.0] }, 2.0).unwrap();
    assert_honest(&found, &half.placed(&Pose::new(vec2(0.5, 0.0), Turn::IDENTITY)), 1e-10, "half a box");
    // a small heavy ball far from the centre of an empty box
    let (center, radius) = (vec3(0.36, 0.3, -0.35), 0.12);
    let density = |p: Vec3| if (p - center).norm() < radius { 1000.0 } else { 0.0 };
    let found = spatial_of(&SpatialShape::Box { size: [1.0; 3] }, density, 2e-3);
    assert_honest(&found, &ball_at(center, radius, 1000.0), 2e-3, "a ball in nothing");
}

#[test]
fn a_compound_is_weighed_in_its_own_axes() {
    let part = |x: f64, angle: f64| PlanarPart {
        pose: Pose::new(vec2(x, 0.2), Turn::from_angle(angle)),
        shape: PlanarShape::Box { size: [0.4, 0.3] },
    };
    let shape = PlanarShape::Compound { parts: vec![part(-0.5, 0.4), part(0.5, 2.0)] };
    let found = planar_of(&shape, |p| if p[0] < 0.0 { 3.0 } else { 1.0 }, 1e-9);
    let own = mass_planar::mass_properties(&PlanarShape::Box { size: [0.4, 0.3] }, 1.0).unwrap();
    let at = |p: PlanarPart, density: f64| own.with_mass(density * own.mass).placed(&p.pose);
    let exact: MassProperties<Planar> = at(part(-0.5, 0.4), 3.0).joined(&at(part(0.5, 2.0), 1.0));
    assert_honest(&found, &exact, 1e-9, "two boxes of two materials");
}

#[test]
fn units_do_not_matter() {
    let density = |p: Vec3| 1.0 + p[0] * p[0] + if p[1] + 0.3 * p[2] < 0.1 { 1.0 } else { 0.0 };
    let cloud = spatial_cloud(12, 34);
    let own = spatial_of(&SpatialShape::ConvexHull { points: cloud.clone() }, density, 1e-4);
    for unit in [1e-3, 1e3] {
        let points = cloud.iter().map(|p| *p * unit).collect();
        let found =
            spatial_of(&SpatialShape::ConvexHull { points }, |p| 1e6 * density(p * (1.0 / unit)), 1e-4);
        let scaled = MassProperties {
            mass: own.mass * 1e6 * unit.powi(3),
            center: own.center * unit,
            inertia: own.inertia.scaled(1e6 * unit.powi(5)),
            error: own.error,
        };
        assert_same(&found, &scaled, 1e-5, &format!("unit {unit}"));
    }
}

#[test]
fn the_answer_depends_on_the_arguments_alone() {
    let shape = SpatialShape::RoundCone { height: 1.4, radius: 0.5, rounding: 0.2 };
    let density = |p: Vec3| if p[0] + 0.3 * p[1] < p[2] { 1.0 } else { 3.0 };
    let once = spatial_of(&shape, density, 1e-3);
    assert_eq!(once, spatial_of(&shape, density, 1e-3));
}

#[test]
fn the_density_is_asked_in_large_batches() {
    let (mut calls, mut count) = (0, 0);
    let mut density = |points: &[Vec3]| {
        calls += 1;
        count += points.len();
        points.iter().map(|p| if p[2] < 0.2 + 0.3 * p[0] { 1.0 } else { 2.0 }).collect()
    };
    let shape = SpatialShape::Cylinder { height: 1.1, radius: 0.6 };
    mass_spatial::mass_properties_of(&shape, &mut density, 1e-4).unwrap();
    assert!(count / calls > 500, "{count} points in {calls} calls");
}

#[test]
fn a_mesh_that_is_not_star_shaped_may_be_asked_outside() {
    let (arm, width, height) = (1.5, 0.4, 0.7);
    let (vertices, triangles) = angle_mesh(arm, width, height);
    let shape = SpatialShape::TriMesh { vertices, triangles };
    let in_it = |p: Vec3| p[0] <= width + 1e-9 || p[1] <= width + 1e-9;
    let cuboid = |x: f64, y: f64, size: [f64; 2]| SpatialPart {
        pose: Pose::new(vec3(x, y, 0.5 * height), Quaternion::IDENTITY),
        shape: SpatialShape::Box { size: [size[0], size[1], height] },
    };
    let parts = vec![
        cuboid(0.5 * arm, 0.5 * width, [arm, width]),
        cuboid(0.5 * width, 0.5 * (arm + width), [width, arm - width]),
    ];
    // negative beyond the corner of the L: allowed, since it is outside
    let smooth = |p: Vec3| 0.7 - p[0] * p[1];
    let exact = spatial_of(&SpatialShape::Compound { parts }, smooth, 1e-10);
    let found = spatial_of(&shape, smooth, 1e-10);
    assert_same(&found, &exact, 2e-10, "angle");
    let mut hole = |points: &[Vec3]| points.iter().map(|p| if in_it(*p) { 1.0 } else { f64::NAN }).collect();
    let error = mass_spatial::mass_properties_of(&shape, &mut hole, 1e-6).unwrap_err();
    assert!(error.problem.contains("outside the mesh") && error.remedy.contains("star-shaped"), "{error}");
}

fn refusal(density: impl Fn(Vec3) -> f64, tolerance: f64) -> ShapeError {
    let mut density = |points: &[Vec3]| points.iter().map(|p| density(*p)).collect();
    mass_spatial::mass_properties_of(&SpatialShape::Box { size: [1.0; 3] }, &mut density, tolerance)
        .unwrap_err()
}

#[test]
fn densities_that_are_none_are_refused_naming_the_point() {
    for bad in [-1.0, f64::NAN, f64::INFINITY] {
        let error = refusal(|p| if p[0] > 0.4 { bad } else { 1.0 }, 1e-6);
        assert!(error.field == "density" && error.problem.contains(&format!("{bad} at [0.4")), "{error}");
    }
    assert!(refusal(|_| 0.0, 1e-6).problem.contains("total mass"), "a body of nothing");
    let mut short = |points: &[Vec3]| vec![1.0; points.len() - 1];
    let shape = SpatialShape::Box { size: [1.0; 3] };
    let error = mass_spatial::mass_properties_of(&shape, &mut short, 1e-6).unwrap_err();
    assert!(error.problem.contains("numbers for"), "{error}");
    for tolerance in [0.0, 1e-14, 0.5, f64::NAN] {
        assert_eq!(refusal(|_| 1.0, tolerance).field, "relative_tolerance", "{tolerance}");
    }
}

#[test]
fn the_budget_ends_in_an_honest_error_or_a_refusal() {
    // an oblique jump in space cannot reach ten digits, but is returned with what it reached
    let normal = vec3(0.37, 1.0, -0.2);
    let size = [1.2, 0.5, 0.8];
    let mut count = 0;
    let mut density = |points: &[Vec3]| {
        count += points.len();
        points.iter().map(|p| if normal.dot(*p) < 0.1 { 4900.0 } else { 900.0 }).collect()
    };
    let found = mass_spatial::mass_properties_of(&SpatialShape::Box { size }, &mut density, 1e-10).unwrap();
    let corners = box_corners(size);
    let exact = of_two(&below(&corners, normal, 0.1), 4900.0, &below(&corners, -normal, -0.1), 900.0);
    assert!(found.error > 1e-10, "{found:?}");
    assert_honest(&found, &exact, ACCEPTABLE_ERROR, "oblique jump");
    assert!((EVALUATION_BUDGET..2 * EVALUATION_BUDGET).contains(&count), "{count}");
    // noise has no integral that a quadrature finds
    let noise = |p: Vec3| ((p[0] * 12.9898 + p[1] * 78.233 + p[2] * 37.719).sin() * 43758.5453).fract().abs();
    let error = refusal(noise, 1e-5);
    assert!(error.problem.contains("evaluations") && error.remedy.contains("larger tolerance"), "{error}");
}
