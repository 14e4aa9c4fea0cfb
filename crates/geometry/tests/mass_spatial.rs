//! Closed forms of space's mass properties against textbook formulas and against each other
//! (theory chapter 1).

use crate::mass_common::*;
use carom_geometry::mass_polyhedron::polyhedron_moments;
use carom_geometry::{MassProperties, SpatialPart, SpatialShape, mass_spatial};
use carom_math::{Column, Inertia, Pose, Quaternion, Rotation, Spatial, Sym3, Vec3, vec3};
use std::f64::consts::PI;

fn known(mass: f64, center: Vec3, inertia: Sym3) -> MassProperties<Spatial> {
    MassProperties { mass, center, inertia, error: 0.0 }
}

fn hull(points: &[Vec3]) -> MassProperties<Spatial> {
    spatial(&SpatialShape::ConvexHull { points: points.to_vec() })
}

/// Case C4.
#[test]
fn ball_box_and_cylinder_have_the_textbook_inertia() {
    let (r, h) = (0.37, 1.4);
    let m = 4.0 / 3.0 * PI * r * r * r;
    let i = 0.4 * m * r * r;
    assert_same(
        &spatial(&SpatialShape::Sphere { radius: r }),
        &known(m, Vec3::ZERO, Sym3::diag(i, i, i)),
        1e-15,
        "ball",
    );
    let [a, b, c] = [1.7, 0.3, 0.9];
    let m = a * b * c;
    let exact = Sym3::diag(b * b + c * c, a * a + c * c, a * a + b * b).scaled(m / 12.0);
    let cuboid = spatial(&SpatialShape::Box { size: [a, b, c] });
    assert_same(&cuboid, &known(m, Vec3::ZERO, exact), 1e-15, "box");
    assert_eq!(
        (cuboid.center, cuboid.inertia.off),
        (Vec3::ZERO, [0.0; 3]),
        "a box is symmetric to the last bit"
    );
    let m = PI * r * r * h;
    let across = m * (3.0 * r * r + h * h) / 12.0;
    let exact = known(m, Vec3::ZERO, Sym3::diag(across, across, 0.5 * m * r * r));
    assert_same(&spatial(&SpatialShape::Cylinder { height: h, radius: r }), &exact, 1e-15, "cylinder");
}

#[test]
fn cone_has_the_textbook_inertia_about_a_centre_a_quarter_up() {
    let (r, h) = (0.5, 1.4);
    let m = PI * r * r * h / 3.0;
    let across = m * (3.0 / 20.0 * r * r + 3.0 / 80.0 * h * h);
    let exact = known(m, vec3(0.0, 0.0, -0.25 * h), Sym3::diag(across, across, 0.3 * m * r * r));
    assert_same(&spatial(&SpatialShape::Cone { height: h, radius: r }), &exact, 1e-14, "cone");
}

/// Case C4.
#[test]
fn capsule_is_a_cylinder_between_two_half_balls() {
    let (l, r) = (1.3, 0.4);
    let (tube, ball) = (PI * r * r * l, 4.0 / 3.0 * PI * r * r * r);
    // a half ball has its centroid 3 r / 8 from the great circle
    let apart = 0.5 * l + 0.375 * r;
    let own = ball * r * r * (0.4 - 9.0 / 64.0);
    let across = tube * (3.0 * r * r + l * l) / 12.0 + own + ball * apart * apart;
    let along = 0.5 * tube * r * r + 0.4 * ball * r * r;
    let exact = known(tube + ball, Vec3::ZERO, Sym3::diag(across, across, along));
    assert_same(&spatial(&SpatialShape::Capsule { length: l, radius: r }), &exact, 1e-14, "capsule");
}

/// Case C4.
#[test]
fn platonic_solids_have_their_closed_forms() {
    let isotropic = |m: f64, i: f64| known(m, Vec3::ZERO, Sym3::diag(i, i, i));
    let a = 1.3;
    let cube = box_corners([a, a, a]);
    assert_same(&hull(&cube), &isotropic(a.powi(3), a.powi(5) / 6.0), 1e-14, "cube");
    let k = a / 8f64.sqrt();
    let tetrahedron = [[1.0, 1.0, 1.0], [1.0, -1.0, -1.0], [-1.0, 1.0, -1.0], [-1.0, -1.0, 1.0]];
    let m = a.powi(3) / (6.0 * 2f64.sqrt());
    let points: Vec<Vec3> = tetrahedron.iter().map(|[x, y, z]| vec3(*x, *y, *z) * k).collect();
    assert_same(&hull(&points), &isotropic(m, m * a * a / 20.0), 1e-14, "tetrahedron");
    let k = a / 2f64.sqrt();
    let points: Vec<Vec3> = (0..6)
        .map(|i| Vec3::from_fn(|j| if i / 2 == j { k * (1.0 - 2.0 * (i % 2) as f64) } else { 0.0 }))
        .collect();
    let m = 2f64.sqrt() / 3.0 * a.powi(3);
    assert_same(&hull(&points), &isotropic(m, m * a * a / 10.0), 1e-14, "octahedron");
    let golden = 0.5 * (1.0 + 5f64.sqrt());
    let mut points = Vec::new();
    for (s, t) in [(1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)] {
        let (p, q) = (0.5 * a * s, 0.5 * a * golden * t);
        points.extend([vec3(0.0, p, q), vec3(p, q, 0.0), vec3(q, 0.0, p)]);
    }
    let m = 5.0 * (3.0 + 5f64.sqrt()) / 12.0 * a.powi(3);
    assert_same(&hull(&points), &isotropic(m, m * golden * golden * a * a / 10.0), 1e-14, "icosahedron");
}

#[test]
fn points_inside_a_hull_change_nothing() {
    let mut points = box_corners([1.2, 0.5, 0.8]);
    let exact = hull(&points);
    for x in -2..=2 {
        for y in -2..=2 {
            for z in -2..=2 {
                points.push(vec3(0.3 * f64::from(x), 0.125 * f64::from(y), 0.2 * f64::from(z)));
            }
        }
    }
    assert_same(&hull(&points), &exact, 1e-14, "grid of points");
    let rounded = spatial(&SpatialShape::RoundConvexHull { points, radius: 0.3 });
    let exact = spatial(&SpatialShape::RoundBox { size: [1.2, 0.5, 0.8], radius: 0.3 });
    assert_same(&rounded, &exact, 1e-13, "rounded grid of points");
}

#[test]
fn a_mesh_is_its_hull_when_it_is_convex_and_its_parts_when_it_is_not() {
    let (vertices, triangles) = cube_mesh();
    let exact = hull(&vertices);
    assert_same(&spatial(&SpatialShape::TriMesh { vertices, triangles }), &exact, 1e-14, "cube");
    let (arm, width, height) = (1.5, 0.4, 0.7);
    let (vertices, triangles) = angle_mesh(arm, width, height);
    let cuboid = |x: f64, y: f64, size: [f64; 2]| SpatialPart {
        pose: Pose::new(vec3(x, y, 0.5 * height), Quaternion::IDENTITY),
        shape: SpatialShape::Box { size: [size[0], size[1], height] },
    };
    let parts = vec![
        cuboid(0.5 * arm, 0.5 * width, [arm, width]),
        cuboid(0.5 * width, 0.5 * (arm + width), [width, arm - width]),
    ];
    let exact = spatial(&SpatialShape::Compound { parts });
    assert_same(&spatial(&SpatialShape::TriMesh { vertices, triangles }), &exact, 1e-14, "angle");
}

#[test]
fn round_hull_of_box_corners_is_the_round_box() {
    let (size, radius) = ([1.2, 0.5, 0.8], 0.3);
    let swept = spatial(&SpatialShape::RoundConvexHull { points: box_corners(size), radius });
    assert_same(&swept, &spatial(&SpatialShape::RoundBox { size, radius }), 1e-14, "round box");
}

/// Case C4.
#[test]
fn rounded_bodies_obey_steiners_formula() {
    // volume = V + A r + M r^2 + 4/3 pi r^3, M = 1/2 sum of edge lengths times exterior angles
    let (r, a) = (0.3, 1.1);
    let k = a / 8f64.sqrt();
    let corners = [[1.0, 1.0, 1.0], [1.0, -1.0, -1.0], [-1.0, 1.0, -1.0], [-1.0, -1.0, 1.0]];
    let points = corners.iter().map(|[x, y, z]| vec3(*x, *y, *z) * k).collect();
    let swept = spatial(&SpatialShape::RoundConvexHull { points, radius: r });
    let exterior = PI - (1.0f64 / 3.0).acos();
    let exact = a.powi(3) / (6.0 * 2f64.sqrt())
        + 3f64.sqrt() * a * a * r
        + 0.5 * 6.0 * a * exterior * r * r
        + 4.0 / 3.0 * PI * r.powi(3);
    assert!((swept.mass / exact - 1.0).abs() < 1e-14, "{} {exact}", swept.mass);
    // the same for the cylinder, M = pi h + pi^2 R, and the cone, whose M is known by its slope angle
    let (h, big) = (1.4, 0.5);
    let cylinder = spatial(&SpatialShape::RoundCylinder { height: h, radius: big, rounding: r });
    let exact = PI * big * big * h
        + 2.0 * PI * big * (big + h) * r
        + (PI * h + PI * PI * big) * r * r
        + 4.0 / 3.0 * PI * r.powi(3);
    assert!((cylinder.mass / exact - 1.0).abs() < 1e-14, "{} {exact}", cylinder.mass);
    let cone = spatial(&SpatialShape::RoundCone { height: h, radius: big, rounding: r });
    let slant = big.hypot(h);
    let slope = (big / h).atan();
    let exact = PI * big * big * h / 3.0
        + PI * big * (big + slant) * r
        + (PI * h + PI * big * (0.5 * PI + slope)) * r * r
        + 4.0 / 3.0 * PI * r.powi(3);
    assert!((cone.mass / exact - 1.0).abs() < 1e-14, "{} {exact}", cone.mass);
}

#[test]
fn rounded_shapes_without_rounding_are_their_cores() {
    let tiny = 1e-9;
    let (size, height, radius) = ([1.2, 0.5, 0.8], 1.4, 0.5);
    let points = spatial_cloud(15, 21);
    let pairs = [
        (SpatialShape::RoundBox { size, radius: tiny }, SpatialShape::Box { size }),
        (
            SpatialShape::RoundCylinder { height, radius, rounding: tiny },
            SpatialShape::Cylinder { height, radius },
        ),
        (SpatialShape::RoundCone { height, radius, rounding: tiny }, SpatialShape::Cone { height, radius }),
        (
            SpatialShape::RoundConvexHull { points: points.clone(), radius: tiny },
            SpatialShape::ConvexHull { points },
        ),
    ];
    for (rounded, core) in &pairs {
        assert_same(&spatial(rounded), &spatial(core), 1e-7, &format!("{core:?}"));
    }
}

#[test]
fn rounded_shapes_without_a_core_are_balls() {
    let (tiny, radius) = (1e-8, 0.6);
    let ball = spatial(&SpatialShape::Sphere { radius });
    let points = spatial_cloud(15, 22).iter().map(|p| *p * tiny).collect();
    let rounded = [
        SpatialShape::RoundBox { size: [tiny; 3], radius },
        SpatialShape::RoundCylinder { height: tiny, radius: tiny, rounding: radius },
        SpatialShape::RoundCone { height: tiny, radius: tiny, rounding: radius },
        SpatialShape::RoundConvexHull { points, radius },
        SpatialShape::Capsule { length: tiny, radius },
    ];
    for shape in &rounded {
        assert_same(&spatial(shape), &ball, 1e-7, &format!("{shape:?}"));
    }
    let capsule = spatial(&SpatialShape::Capsule { length: 1.3, radius });
    let needle = SpatialShape::RoundCylinder { height: 1.3, radius: tiny, rounding: radius };
    assert_same(&spatial(&needle), &capsule, 1e-7, "a needle's cylinder is a capsule");
}

#[test]
fn rounded_shapes_are_limits_of_sampled_hulls() {
    let rounding = 0.3;
    let circle = |radius: f64, z: f64| {
        (0..24).map(move |k| {
            let angle = f64::from(k) * PI / 12.0;
            vec3(radius * angle.cos(), radius * angle.sin(), z)
        })
    };
    let cloud = spatial_cloud(8, 23);
    let shapes: [(SpatialShape, Vec<Vec3>); 4] = [
        (SpatialShape::RoundConvexHull { points: cloud.clone(), radius: rounding }, cloud),
        (SpatialShape::RoundBox { size: [1.2, 0.5, 0.8], radius: rounding }, box_corners([1.2, 0.5, 0.8])),
        (
            SpatialShape::RoundCylinder { height: 1.1, radius: 0.6, rounding },
            circle(0.6, 0.55).chain(circle(0.6, -0.55)).collect(),
        ),
        (
            SpatialShape::RoundCone { height: 1.4, radius: 0.5, rounding },
            circle(0.5, -0.7).chain([vec3(0.0, 0.0, 0.7)]).collect(),
        ),
    ];
    for (shape, core) in &shapes {
        let points = core.iter().flat_map(|c| on_sphere(*c, rounding, 600)).collect();
        let error = difference(&spatial(&SpatialShape::ConvexHull { points }), &spatial(shape));
        // an inscribed hull lacks a layer of the order of r times the squared spacing of its points
        assert!((1e-5..0.025).contains(&error), "{shape:?}: {error:.2e}");
    }
}

/// Case C4.
#[test]
fn a_compound_that_tiles_a_shape_has_its_mass_properties() {
    let whole = spatial(&SpatialShape::Box { size: [2.0, 1.0, 0.5] });
    let tile = |x: f64, width: f64| SpatialPart {
        pose: Pose::new(vec3(x, 0.0, 0.0), Quaternion::IDENTITY),
        shape: SpatialShape::Box { size: [width, 1.0, 0.5] },
    };
    let tiles = SpatialShape::Compound { parts: vec![tile(-0.75, 0.5), tile(-0.25, 0.5), tile(0.5, 1.0)] };
    assert_same(&spatial(&tiles), &whole, 1e-15, "tiles");
    let points = spatial_cloud(25, 24);
    let whole = hull(&points);
    let (vertices, triangles) = carom_geometry::hull::convex_hull_spatial(&points).unwrap();
    let parts = triangles
        .iter()
        .map(|t| {
            let mut points = vec![whole.center];
            points.extend(t.map(|i| vertices[i as usize]));
            SpatialPart { pose: Pose::default(), shape: SpatialShape::ConvexHull { points } }
        })
        .collect();
    assert_same(&spatial(&SpatialShape::Compound { parts }), &whole, 1e-14, "tetrahedra");
}

/// Case C4.
#[test]
fn no_principal_moment_exceeds_the_sum_of_the_others() {
    let mut shapes = spatial_shapes();
    // flat and thin bodies come closest
    shapes.push(SpatialShape::Box { size: [1.0, 1.0, 1e-6] });
    shapes.push(SpatialShape::Cylinder { height: 1e-6, radius: 1.0 });
    shapes.push(SpatialShape::Capsule { length: 1.0, radius: 1e-6 });
    for shape in &shapes {
        let ([small, middle, large], _) = spatial(shape).inertia.eigen();
        assert!(
            small > 0.0 && small + middle >= large * (1.0 - 1e-15),
            "{shape:?}: {small} {middle} {large}"
        );
        assert_eq!(spatial(shape).inertia.impossible_because(), None, "{shape:?}");
    }
}

/// Case C4.
#[test]
fn polyhedra_do_not_change_when_moved_or_turned() {
    let points = spatial_cloud(30, 25);
    let own = hull(&points);
    let rounded = spatial(&SpatialShape::RoundConvexHull { points: points.clone(), radius: 0.2 });
    let (vertices, triangles) = angle_mesh(1.5, 0.4, 0.7);
    let mesh = spatial(&SpatialShape::TriMesh { vertices: vertices.clone(), triangles: triangles.clone() });
    let mut numbers = Numbers(26);
    for _ in 0..50 {
        let pose: Pose<Spatial> = Pose::new(numbers.spatial(1.0), Quaternion::about(numbers.spatial(2.0)));
        let moved: Vec<Vec3> = points.iter().map(|p| pose.to_world(*p)).collect();
        assert_same(&hull(&moved), &own.placed(&pose), 1e-14, "hull");
        let there = spatial(&SpatialShape::RoundConvexHull { points: moved, radius: 0.2 });
        assert_same(&there, &rounded.placed(&pose), 1e-14, "round hull");
        let vertices = vertices.iter().map(|p| pose.to_world(*p)).collect();
        let there = spatial(&SpatialShape::TriMesh { vertices, triangles: triangles.clone() });
        assert_same(&there, &mesh.placed(&pose), 1e-14, "mesh");
    }
}

#[test]
fn open_meshes_are_refused_naming_the_edge() {
    let (vertices, mut triangles) = cube_mesh();
    let [a, b, c] = triangles.pop().unwrap();
    let error = polyhedron_moments(&vertices, &triangles).unwrap_err();
    let names = |p: u32, q: u32| error.problem.contains(&format!("the edge {}-{} ", p.min(q), p.max(q)));
    assert!(error.problem.contains("open") && (names(a, b) || names(b, c) || names(c, a)), "{error}");
    assert!(error.remedy.contains("close the mesh"), "{error}");
    let shape = SpatialShape::TriMesh { vertices, triangles };
    assert_eq!(mass_spatial::mass_properties(&shape, 1.0).unwrap_err(), error);
}

#[test]
fn inside_out_and_inconsistent_meshes_are_refused() {
    let (vertices, triangles) = cube_mesh();
    let flipped: Vec<[u32; 3]> = triangles.iter().map(|&[a, b, c]| [a, c, b]).collect();
    let error = polyhedron_moments(&vertices, &flipped).unwrap_err();
    assert!(error.problem.contains("inside out") && error.remedy.contains("swap two indices"), "{error}");
    let mut one_flipped = triangles.clone();
    one_flipped[3].swap(0, 1);
    let error = polyhedron_moments(&vertices, &one_flipped).unwrap_err();
    assert!(error.problem.contains("same direction"), "{error}");
    let mut doubled = triangles.clone();
    doubled.extend(&triangles);
    let error = polyhedron_moments(&vertices, &doubled).unwrap_err();
    assert!(error.problem.contains("belongs to 4 triangles"), "{error}");
}

#[test]
fn meshes_with_bad_indices_or_no_inside_are_refused() {
    let (mut vertices, mut triangles) = cube_mesh();
    triangles[5][1] = 8;
    assert_eq!(polyhedron_moments(&vertices, &triangles).unwrap_err().field, "triangles[5]");
    triangles[5] = [1, 1, 2];
    assert!(polyhedron_moments(&vertices, &triangles).unwrap_err().problem.contains("twice"));
    // two sides of one triangle: closed, but flat
    let error = polyhedron_moments(&vertices, &[[0, 1, 2], [0, 2, 1]]).unwrap_err();
    assert!(error.problem.contains("no volume"), "{error}");
    vertices[2] = vec3(f64::NAN, 0.0, 0.0);
    assert_eq!(polyhedron_moments(&vertices, &cube_mesh().1).unwrap_err().field, "vertices");
}

#[test]
fn massless_shapes_and_bad_densities_are_refused_with_a_remedy() {
    let massless = [
        SpatialShape::HalfSpace { normal: vec3(0.0, 0.0, 1.0) },
        SpatialShape::HeightField { heights: vec![vec![0.0, 1.0], vec![0.5, 0.2]], size: [1.0, 1.0] },
    ];
    for shape in &massless {
        let error = mass_spatial::mass_properties(shape, 1.0).unwrap_err();
        assert!(error.remedy.contains("explicitly") && error.remedy.contains("fixed"), "{shape:?}: {error}");
        assert!(
            mass_spatial::mass_properties_of(shape, &mut |p| vec![1.0; p.len()], 1e-6).is_err(),
            "{shape:?}"
        );
    }
    for density in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        let error =
            mass_spatial::mass_properties(&SpatialShape::Sphere { radius: 1.0 }, density).unwrap_err();
        assert_eq!(error.field, "density", "{density}");
    }
    let wall = SpatialPart { pose: Pose::default(), shape: massless[0].clone() };
    let error =
        mass_spatial::mass_properties(&SpatialShape::Compound { parts: vec![wall] }, 1.0).unwrap_err();
    assert!(error.field.starts_with("parts[0]"), "{error}");
    let error =
        mass_spatial::mass_properties(&SpatialShape::Cone { height: 1.0, radius: 0.0 }, 1.0).unwrap_err();
    assert_eq!(error.field, "radius");
}
