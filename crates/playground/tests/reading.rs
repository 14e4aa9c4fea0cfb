//! The reader of scene files and the page's requests, natively.

use carom::{Column, Rotation, Turn};
use carom_playground::page::Page;
use carom_playground::scene::{self, AnyWorld};
use serde_json::{Map, Value, json};

const FIRST: &str = include_str!("../../../python/carom/scenes/first_steps_planar.toml");

fn load(page: &mut Page, text: &str) -> Result<Value, String> {
    page.answer(&json!({ "op": "load", "text": text }).to_string())
}

fn planar(body: Value) -> String {
    json!({ "schema_version": 1, "space": "planar", "body": [body] }).to_string()
}

#[test]
fn a_pyramid_has_a_copy_less_in_each_layer() {
    let mut page = Page::default();
    let about = load(&mut page, FIRST).unwrap();
    let names = about["names"].as_array().unwrap();
    assert_eq!(names.len(), 1 + 10 + 1);
    assert!(names.iter().any(|name| name == "box 0 in layer 3"));
}

#[test]
fn what_cannot_be_read_is_named_and_what_ran_goes_on() {
    let mut page = Page::default();
    load(&mut page, FIRST).unwrap();
    let bodies = [
        (json!({ "name": "odd", "mass": 1, "frction": 1 }), "body 'odd': unknown field 'frction'"),
        (json!({ "name": "odd", "mass": 1, "friction": "much" }), "body 'odd': friction"),
        (json!({ "name": "odd", "mass": -1 }), "body 'odd': mass must be"),
        (json!({ "name": "odd" }), "body 'odd': mass: is missing"),
        (
            json!({ "name": "odd", "mass": 1, "scatter": { "position": [1, -1] } }),
            "body 'odd': scatter: position: needs 2",
        ),
        (json!({ "name": "odd", "mass": 1, "scatter": { "sed": 1 } }), "body 'odd': scatter: unknown field"),
        (json!({ "name": "odd", "mass": 1, "shape": { "type": "egg" } }), "body 'odd': shape"),
        (json!({ "mass": 1 }), "body 1: name: is missing"),
    ];
    for (body, told) in bodies {
        let error = load(&mut page, &planar(body)).unwrap_err();
        assert!(error.contains(told), "{error}");
        page.steps(1, &mut Vec::new()).unwrap();
    }
    assert!(load(&mut page, "schema_version = 1\nspace = ").unwrap_err().contains("line 2"));
}

#[test]
fn a_snapshot_goes_on_bit_for_bit() {
    let mut page = Page::default();
    load(&mut page, FIRST).unwrap();
    page.steps(20, &mut Vec::new()).unwrap();
    let snapshot = page.answer(r#"{"op": "snapshot"}"#).unwrap();
    page.steps(20, &mut Vec::new()).unwrap();
    let mut other = Page::default();
    other.answer(&json!({ "op": "load", "snapshot": snapshot }).to_string()).unwrap();
    other.steps(20, &mut Vec::new()).unwrap();
    let ask = r#"{"op": "fingerprint"}"#;
    assert_eq!(page.answer(ask).unwrap(), other.answer(ask).unwrap());
}

#[test]
fn a_snapshot_under_common_coefficients_goes_back_to_the_scenes_own() {
    let mut page = Page::default();
    let about = load(&mut page, FIRST).unwrap();
    page.answer(r#"{"op": "coefficients", "friction": 0.9, "restitution": null}"#).unwrap();
    page.steps(20, &mut Vec::new()).unwrap();
    let snapshot = page.answer(r#"{"op": "snapshot"}"#).unwrap();
    let mut other = Page::default();
    let told = json!({ "op": "load", "snapshot": snapshot, "own": about["own"] });
    assert_eq!(other.answer(&told.to_string()).unwrap()["own"], about["own"]);
    for each in [&mut page, &mut other] {
        each.answer(r#"{"op": "coefficients", "friction": null, "restitution": null}"#).unwrap();
        each.steps(20, &mut Vec::new()).unwrap();
    }
    let ask = r#"{"op": "fingerprint"}"#;
    assert_eq!(page.answer(ask).unwrap(), other.answer(ask).unwrap());
    for (own, said) in [
        (json!([[0.5, 0.5]]), "1 coefficients for 12 bodies"),
        (json!(vec![[-1.0, 0.0]; 12]), "friction must"),
    ] {
        let wrong = json!({ "op": "load", "snapshot": snapshot, "own": own }).to_string();
        assert!(other.answer(&wrong).unwrap_err().contains(said));
    }
}

#[test]
fn the_hand_lifts_a_body_and_lets_it_go() {
    let mut page = Page::default();
    let body = json!({ "name": "disc", "density": 100.0, "shape": { "type": "circle", "radius": 0.2 } });
    load(&mut page, &planar(body)).unwrap();
    let hold = json!({ "op": "hold", "body": 0, "place": [0.1, 0.0, 0.0] }).to_string();
    assert_eq!(page.answer(&hold).unwrap(), json!(true));
    page.answer(r#"{"op": "pull", "place": [0.1, 1.0, 0.0]}"#).unwrap();
    let mut frame = Vec::new();
    page.steps(240, &mut frame).unwrap();
    let height = frame[carom_playground::frame::FIGURES + 1];
    assert!((0.8..1.05).contains(&height), "{height}");
    page.answer(r#"{"op": "release"}"#).unwrap();
    page.steps(240, &mut frame).unwrap();
    assert!(frame[carom_playground::frame::FIGURES + 1] < -3.0);
}

#[test]
fn scattered_copies_lie_where_python_puts_them() {
    let text = r#"
schema_version = 1
space = "spatial"

[[body]]
name = "brick"
density = 1.0
shape = { type = "box", size = [0.4, 0.2, 0.1] }
origin = [0.5, 0.0, 1.0]
rotation = { axis = [0, 0, 1], degrees = 30 }
repeat = { count = [2], step = [[1.0, 0.0, 0.0]] }
scatter = { position = [0.1, 0.2, 0.0], rotation = 0.3, seed = 5 }
"#;
    let (world, _) = scene::read(text, &Map::new(), &scene::mesh::Files::new()).unwrap();
    let AnyWorld::Spatial(world) = world else { panic!("a world of space") };
    // carom.scene.load_scene(..).build() of the same text
    let positions =
        [[0.5129577271225018, 0.09735463210515088, 1.0], [1.4008473612499825, -0.10737829033663755, 1.0]];
    let rotations = [
        [0.9660157163390664, -0.0001242209594336849, -0.0003477166435529582, 0.25848307381376],
        [0.9696351957042871, 0.010777397524971281, -0.0015468351692659366, 0.24431340989609365],
    ];
    let motion = &world.bodies().motion;
    for k in 0..2 {
        assert_eq!(motion.position[k].as_slice(), positions[k]);
        let apart = motion.rotation[k].as_slice().iter().zip(rotations[k]).map(|(a, b)| (a - b).abs());
        assert!(apart.fold(0.0, f64::max) < 3e-16, "{:?}", motion.rotation[k]);
    }
}

/// What numpy.random.default_rng([seed, zlib.crc32(name.encode())]) draws: uniform(-1, 1, 3); in the plane uniform(-1, 1, 2) and
/// uniform(-.3, .3).
#[test]
fn the_numbers_of_scatter_are_those_of_numpy() {
    let told: [(u64, &str, [f64; 3], f64); 3] = [
        (0, "ball", [-0.6626682573505525, 0.013307099730727634, 0.6431565908249077], 0.19294697724747228),
        (7, "cube-{n}", [-0.8955957172692028, 0.8323452650531362, 0.27059202437381824], 0.08117760731214546),
        (
            (1 << 33) + 5,
            "stone",
            [-0.7131118015714508, -0.7452858818908772, 0.29461419776165565],
            0.0883842593284967,
        ),
    ];
    for (seed, name, numbers, angle) in told {
        let text = |space: &str, scatter: Value| {
            let ball = json!({ "type": if space == "planar" { "circle" } else { "sphere" }, "radius": 1.0 });
            let body = json!({ "name": name, "shape": ball, "density": 1.0, "scatter": scatter });
            json!({ "schema_version": 1, "space": space, "body": [body] }).to_string()
        };
        let read = |text: &str| scene::read(text, &Map::new(), &scene::mesh::Files::new()).unwrap().0;
        let world = read(&text("spatial", json!({ "position": [1, 1, 1], "seed": seed })));
        let AnyWorld::Spatial(world) = world else { panic!("a world of space") };
        assert_eq!(world.bodies().motion.position[0].as_slice(), numbers, "{name}");
        let world = read(&text("planar", json!({ "position": [1, 1], "rotation": 0.3, "seed": seed })));
        let AnyWorld::Planar(world) = world else { panic!("a world of the plane") };
        let motion = &world.bodies().motion;
        assert_eq!(motion.position[0].as_slice(), &numbers[..2], "{name}");
        let turned = Turn::from_angle(angle);
        assert_eq!(motion.rotation[0].as_slice(), turned.as_slice(), "{name}");
    }
}
