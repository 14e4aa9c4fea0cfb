//! Every malformed shape is refused by name: field, value, remedy.

use crate::common::*;
use carom_geometry::{Geometry, PlanarPart, PlanarShape, SpatialPart, SpatialShape};
use carom_math::{Planar, Pose, Quaternion, Spatial, Turn, Vec2, Vec3, vec2, vec3};

#[track_caller]
fn refused<S: Geometry>(shape: S::Shape, field: &str, value: &str) {
    let Err(error) = S::collider(&shape) else { panic!("{shape:?} was accepted") };
    assert_eq!(error.field, field, "{shape:?}: {error}");
    assert!(error.problem.contains(value), "{shape:?}: {error}");
    assert!(!error.remedy.is_empty(), "{shape:?}: {error}");
}

#[test]
fn sizes_that_are_not_finite_and_positive_are_refused() {
    for bad in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        let v = format!("{bad}");
        refused::<Planar>(PlanarShape::Circle { radius: bad }, "radius", &v);
        refused::<Planar>(PlanarShape::Capsule { length: bad, radius: 1.0 }, "length", &v);
        refused::<Planar>(PlanarShape::Capsule { length: 1.0, radius: bad }, "radius", &v);
        refused::<Planar>(PlanarShape::Box { size: [1.0, bad] }, "size[1]", &v);
        refused::<Planar>(PlanarShape::RoundBox { size: [bad, 1.0], radius: 1.0 }, "size[0]", &v);
        refused::<Planar>(PlanarShape::RoundBox { size: [1.0, 1.0], radius: bad }, "radius", &v);
        refused::<Planar>(PlanarShape::HeightField { heights: vec![0.0, 0.0], width: bad }, "width", &v);
        refused::<Spatial>(SpatialShape::Sphere { radius: bad }, "radius", &v);
        refused::<Spatial>(SpatialShape::Capsule { length: bad, radius: 1.0 }, "length", &v);
        refused::<Spatial>(SpatialShape::Box { size: [1.0, 1.0, bad] }, "size[2]", &v);
        refused::<Spatial>(SpatialShape::Cylinder { height: bad, radius: 1.0 }, "height", &v);
        refused::<Spatial>(SpatialShape::Cylinder { height: 1.0, radius: bad }, "radius", &v);
        refused::<Spatial>(SpatialShape::Cone { height: bad, radius: 1.0 }, "height", &v);
        refused::<Spatial>(
            SpatialShape::RoundCylinder { height: 1.0, radius: 1.0, rounding: bad },
            "rounding",
            &v,
        );
        refused::<Spatial>(
            SpatialShape::RoundCone { height: 1.0, radius: 1.0, rounding: bad },
            "rounding",
            &v,
        );
        let flat = vec![vec![0.0; 2]; 2];
        refused::<Spatial>(SpatialShape::HeightField { heights: flat, size: [1.0, bad] }, "size[1]", &v);
    }
}

#[test]
fn absurd_sizes_are_refused() {
    refused::<Spatial>(SpatialShape::Sphere { radius: 1e-12 }, "radius", "1e-12");
    refused::<Spatial>(SpatialShape::Box { size: [1e12, 1.0, 1.0] }, "size[0]", "1e12");
    refused::<Planar>(PlanarShape::Segment { a: vec2(0.0, 0.0), b: vec2(1e10, 0.0) }, "b", "10000000000");
}

#[test]
fn hulls_without_area_or_volume_are_refused() {
    let line: Vec<Vec2> = (0..5).map(|k| vec2(f64::from(k), 2.0 * f64::from(k))).collect();
    refused::<Planar>(PlanarShape::ConvexPolygon { points: line[..2].to_vec() }, "points", "got 2");
    refused::<Planar>(PlanarShape::ConvexPolygon { points: line.clone() }, "points", "one line");
    refused::<Planar>(PlanarShape::RoundPolygon { points: line, radius: 0.1 }, "points", "one line");
    refused::<Planar>(PlanarShape::ConvexPolygon { points: vec![vec2(1.0, 1.0); 5] }, "points", "got 1");
    let turned = Quaternion::from_axis_angle(vec3(0.6, 0.0, 0.8), 1.0);
    use carom_math::Rotation;
    let plane: Vec<Vec3> = (0..9)
        .map(|k| turned.rotate(vec3(f64::from(k % 3), f64::from(k / 3), 0.0)) + vec3(5.0, 5.0, 5.0))
        .collect();
    refused::<Spatial>(SpatialShape::ConvexHull { points: plane.clone() }, "points", "one plane");
    refused::<Spatial>(
        SpatialShape::RoundConvexHull { points: plane.clone(), radius: 0.1 },
        "points",
        "one plane",
    );
    refused::<Spatial>(SpatialShape::ConvexHull { points: plane[..3].to_vec() }, "points", "got 3");
    refused::<Spatial>(SpatialShape::ConvexHull { points: vec![vec3(1.0, 2.0, 3.0); 6] }, "points", "got 1");
    let mut broken = hull_points(8, 1.0, 1);
    broken[5] = vec3(0.0, f64::NAN, 0.0);
    refused::<Spatial>(SpatialShape::ConvexHull { points: broken }, "points[5]", "NaN");
}

#[test]
fn walls_without_length_and_normals_without_direction_are_refused() {
    let a = vec2(1.0, 2.0);
    refused::<Planar>(PlanarShape::Segment { a, b: a }, "b", "[1.0, 2.0]");
    refused::<Planar>(PlanarShape::Segment { a: vec2(f64::NAN, 0.0), b: a }, "a", "NaN");
    refused::<Planar>(PlanarShape::Polyline { points: vec![a], closed: false }, "points", "got 1");
    refused::<Planar>(
        PlanarShape::Polyline { points: vec![a, vec2(0.0, 0.0)], closed: true },
        "points",
        "got 2",
    );
    let chain = vec![a, vec2(0.0, 0.0), vec2(0.0, 0.0), vec2(3.0, 0.0)];
    refused::<Planar>(PlanarShape::Polyline { points: chain, closed: false }, "points[2]", "[0.0, 0.0]");
    let ring = vec![a, vec2(0.0, 0.0), vec2(3.0, 0.0), a];
    refused::<Planar>(PlanarShape::Polyline { points: ring, closed: true }, "points[0]", "[1.0, 2.0]");
    refused::<Planar>(PlanarShape::HalfPlane { normal: vec2(0.0, 0.0) }, "normal", "[0.0, 0.0]");
    refused::<Spatial>(SpatialShape::HalfSpace { normal: vec3(0.0, 0.0, 0.0) }, "normal", "[0.0, 0.0, 0.0]");
    refused::<Spatial>(SpatialShape::HalfSpace { normal: vec3(0.0, f64::INFINITY, 0.0) }, "normal", "inf");
}

#[test]
fn normals_are_brought_to_unit_length_however_long_they_were() {
    for length in [1e-300, 1e-3, 1.0, 1e200] {
        let wall = SpatialShape::HalfSpace { normal: vec3(0.0, 0.6 * length, 0.8 * length) };
        let ball = SpatialShape::Sphere { radius: 0.5 };
        let found = contacts::<Spatial>(&ball, &at3(0.0, 0.3, 0.4), &wall, &at3(0.0, 0.0, 0.0), 0.1);
        assert!(
            (found[0].normal[1] - 0.6).abs() < 1e-15 && found[0].gap.abs() < 1e-15,
            "{length:e} {found:?}"
        );
    }
}

#[test]
fn height_fields_that_are_no_grid_are_refused() {
    refused::<Planar>(PlanarShape::HeightField { heights: vec![1.0], width: 1.0 }, "heights", "got 1");
    let spike = vec![0.0, f64::NAN, 0.0];
    refused::<Planar>(PlanarShape::HeightField { heights: spike, width: 1.0 }, "heights[1]", "NaN");
    let field = |heights: Vec<Vec<f64>>| SpatialShape::HeightField { heights, size: [1.0, 1.0] };
    refused::<Spatial>(field(vec![]), "heights", "0 x 0");
    refused::<Spatial>(field(vec![vec![0.0; 4]]), "heights", "1 x 4");
    refused::<Spatial>(field(vec![vec![0.0; 1]; 4]), "heights", "4 x 1");
    refused::<Spatial>(field(vec![vec![0.0; 3], vec![0.0; 2]]), "heights[1]", "2 columns");
    refused::<Spatial>(field(vec![vec![0.0; 2], vec![0.0, f64::INFINITY]]), "heights[1][1]", "inf");
}

#[test]
fn meshes_with_bad_indices_or_triangles_are_refused() {
    let vertices = vec![vec3(0.0, 0.0, 0.0), vec3(1.0, 0.0, 0.0), vec3(0.0, 1.0, 0.0), vec3(2.0, 0.0, 0.0)];
    let mesh = |triangles: Vec<[u32; 3]>| SpatialShape::TriMesh { vertices: vertices.clone(), triangles };
    refused::<Spatial>(mesh(vec![]), "triangles", "got 0");
    refused::<Spatial>(mesh(vec![[0, 1, 2], [0, 4, 2]]), "triangles[1][1]", "index 4");
    refused::<Spatial>(mesh(vec![[0, 1, 3]]), "triangles[0]", "[0, 1, 3]");
    refused::<Spatial>(mesh(vec![[0, 1, 2], [1, 1, 2]]), "triangles[1]", "[1, 1, 2]");
    let few = SpatialShape::TriMesh { vertices: vertices[..2].to_vec(), triangles: vec![[0, 1, 0]] };
    refused::<Spatial>(few, "vertices", "got 2");
    let mut broken = vertices.clone();
    broken[1] = vec3(f64::INFINITY, 0.0, 0.0);
    refused::<Spatial>(
        SpatialShape::TriMesh { vertices: broken, triangles: vec![[0, 1, 2]] },
        "vertices[1]",
        "inf",
    );
}

#[test]
fn empty_nested_and_misplaced_compounds_are_refused() {
    refused::<Planar>(PlanarShape::Compound { parts: vec![] }, "parts", "got 0");
    refused::<Spatial>(SpatialShape::Compound { parts: vec![] }, "parts", "got 0");
    let good = SpatialPart { pose: Pose::default(), shape: SpatialShape::Sphere { radius: 1.0 } };
    let nested =
        SpatialPart { pose: Pose::default(), shape: SpatialShape::Compound { parts: vec![good.clone()] } };
    refused::<Spatial>(
        SpatialShape::Compound { parts: vec![good.clone(), nested] },
        "parts[1].shape",
        "compound",
    );
    let bad = SpatialPart { pose: Pose::default(), shape: SpatialShape::Box { size: [1.0, -2.0, 1.0] } };
    refused::<Spatial>(
        SpatialShape::Compound { parts: vec![good.clone(), bad] },
        "parts[1].shape.size[1]",
        "-2",
    );
    let lost = SpatialPart { pose: at3(f64::NAN, 0.0, 0.0), ..good.clone() };
    refused::<Spatial>(SpatialShape::Compound { parts: vec![lost] }, "parts[0].pose.position", "NaN");
    let bent = SpatialPart { pose: Pose::new(vec3(0.0, 0.0, 0.0), Quaternion([2.0, 0.0, 0.0, 0.0])), ..good };
    refused::<Spatial>(SpatialShape::Compound { parts: vec![bent] }, "parts[0].pose.rotation", "2.0");
    let flat = PlanarPart {
        pose: Pose::new(vec2(0.0, 0.0), Turn([f64::NAN, 0.0])),
        shape: PlanarShape::Circle { radius: 1.0 },
    };
    refused::<Planar>(PlanarShape::Compound { parts: vec![flat] }, "parts[0].pose.rotation", "NaN");
}
