//! Meshes of scenes, whose triangles the page hands over beside the text.

use carom_playground::page::Page;
use serde_json::{Value, json};

/// A cube of two units along each edge, triangle by triangle as STL has it, and turned inside out where asked.
fn cube(inside_out: bool) -> Value {
    let quads = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    let corner = |n: usize| [n & 1, n >> 1 & 1, n >> 2].map(|bit| 2.0 * bit as f64);
    let mut corners: Vec<[f64; 3]> =
        quads.iter().flat_map(|[a, b, c, d]| [a, b, c, a, c, d]).map(|n| corner(*n)).collect();
    if inside_out {
        corners.chunks_exact_mut(3).for_each(|t| t.reverse());
    }
    json!({ "vertices": corners.concat(), "triangles": (0..corners.len()).collect::<Vec<_>>() })
}

fn load(mesh: Value, meshes: Value) -> Result<Value, String> {
    let body = json!({ "name": "part", "mesh": mesh, "density": 3.0 });
    let text = json!({ "schema_version": 1, "space": "spatial", "body": [body] }).to_string();
    Page::default().answer(&json!({ "op": "load", "text": text, "meshes": meshes }).to_string())
}

#[test]
fn a_cube_of_a_file_has_the_mass_of_a_cube_whichever_way_its_triangles_face() {
    for inside_out in [false, true] {
        for kind in ["hull", "decomposition"] {
            let mesh = json!({ "file": "parts/cube.stl", "as": kind, "scale": 0.5 });
            let about = load(mesh, json!({ "cube.stl": cube(inside_out) })).unwrap();
            let mass = 1.0 / about["inverse_mass"][0].as_f64().unwrap();
            assert!((mass - 3.0).abs() < 1e-12, "{kind}: {mass} kg");
            assert_eq!(about["center"], json!([0.5, 0.5, 0.5]));
            if kind == "hull" {
                assert_eq!(about["shapes"][0]["points"].as_array().unwrap().len(), 8);
            }
        }
    }
}

#[test]
fn files_that_were_not_given_are_named_all_at_once() {
    let mesh =
        |file: &str| json!({ "name": file, "kind": "static", "mesh": { "file": file, "as": "static" } });
    let bodies = json!([mesh("meshes/a.obj"), mesh("b.ply"), mesh("meshes/cube.stl")]);
    let text = json!({ "schema_version": 1, "space": "spatial", "body": bodies }).to_string();
    let request = json!({ "op": "load", "text": text, "meshes": { "cube.stl": cube(false) } });
    let error = Page::default().answer(&request.to_string()).unwrap_err();
    assert!(error.contains("'b.ply', 'meshes/a.obj' in"), "{error}");
    assert!(!error.contains("cube.stl"), "{error}");
}

#[test]
fn what_is_wrong_with_a_mesh_is_told_with_body_and_file() {
    let mut open = cube(false);
    open["triangles"].as_array_mut().unwrap().truncate(30);
    let mut wild = cube(false);
    wild["triangles"][0] = json!(99);
    let point = json!({ "vertices": [0, 0, 0, 0, 0, 0, 0, 0, 0], "triangles": [0, 1, 2] });
    let cases = [
        (json!({ "as": "decomposition" }), open.clone(), "body 'part': mesh 'cube.stl': is not closed at"),
        (json!({ "as": "hull" }), wild, "vertex 99 of 36"),
        (json!({ "as": "hull" }), point, "in one point"),
        (json!({ "as": "static" }), cube(false), "cannot belong to a dynamic body"),
        (json!({ "as": "egg" }), cube(false), "as: must be hull"),
        (json!({ "as": "hull", "scale": -1 }), cube(false), "scale: must be > 0"),
        (json!({ "as": "hull", "max_parts": 3 }), cube(false), "max_parts"),
        (json!({ "as": "hull", "scal": 1 }), cube(false), "unknown field 'scal'"),
    ];
    for (mut mesh, file, told) in cases {
        mesh["file"] = json!("cube.stl");
        let error = load(mesh, json!({ "cube.stl": file })).unwrap_err();
        assert!(error.contains(told), "{error}");
    }
    // the hull of an open mesh is closed, and has a mass
    let about = load(json!({ "file": "cube.stl", "as": "hull" }), json!({ "cube.stl": open })).unwrap();
    assert!((1.0 / about["inverse_mass"][0].as_f64().unwrap() - 24.0).abs() < 1e-12);
}
