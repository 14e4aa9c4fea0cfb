//! A quick look at every engine, and at what the scenes are made of.

use crate::catalogue::{Catalogue, scene};
use crate::engine::{Choice, Engine};
use crate::engines::{Field, entrants};
use crate::judge::Judge;
use carom::{Column, Planar, Pose, Spatial};
use std::path::Path;

const ALONE: Choice = Choice { threads: 1, sleeping: false };

fn built<S: Catalogue>(word: &str) -> crate::scene::Scene<S> {
    scene::<S>(word).expect("a size").expect("a scene of this space")
}

fn every_engine_keeps_a_small_pyramid_in_place<S: Field + Catalogue>() {
    let scene = built::<S>("pyramid:4");
    let python = std::env::var("RACE_PYTHON").unwrap_or("python3".into());
    let field = entrants::<S>(&[], Path::new(&python), &|text| eprintln!("{text}")).expect("no words");
    let choices = [ALONE, Choice { threads: 2, sleeping: true }];
    for (entrant, choice) in field.iter().flat_map(|e| choices.map(|c| (e, c))) {
        if !entrant.takes(choice, scene.bodies.len()) {
            continue;
        }
        let mut engine: Box<dyn Engine<S>> = (entrant.build)(&scene, choice).expect("boxes alone");
        let start: Vec<Pose<S>> = engine.poses().expect("poses");
        for (told, body) in start.iter().zip(&scene.bodies) {
            let off = (told.position - body.pose.position).norm();
            assert!(off < 1e-5, "{} begins {off} m from where it should", entrant.engine);
        }
        let mut cpu = 0.0;
        for _ in 0..60 {
            cpu += engine.step().expect("a step").cpu;
        }
        for (told, body) in engine.poses().expect("poses").iter().zip(&scene.bodies) {
            let off = (told.position - body.pose.position).norm();
            assert!(off < 0.05, "{} {choice:?} leaves a box {off} m from its place", entrant.engine);
        }
        assert!(cpu > 0.0);
        // 4 boxes on the ground and 12 places of a box on a box, two or four points each; boxes side by side on top
        let least = 16 * if S::DIM == 2 { 2 } else { 4 };
        assert!(engine.contacts().is_none_or(|count| count >= least), "{}", entrant.engine);
    }
}

#[test]
fn every_engine_of_the_plane_keeps_a_small_pyramid_in_place() {
    every_engine_keeps_a_small_pyramid_in_place::<Planar>();
}

#[test]
fn every_engine_of_space_keeps_a_small_pyramid_in_place() {
    every_engine_keeps_a_small_pyramid_in_place::<Spatial>();
}

/// Every engine gives every scene back as it was told, at small sizes, whatever its shapes and axes.
fn engines_begin_where_the_scene_does<S: Field + Catalogue>(words: &[&str]) {
    for word in words {
        let scene = built::<S>(word);
        for entrant in entrants::<S>(
            &["box2d", "box3d", "rapier", "jolt", "carom"].map(String::from),
            Path::new("python3"),
            &|_| (),
        )
        .expect("names")
        {
            let Ok(mut engine) = (entrant.build)(&scene, ALONE) else {
                // Jolt's C interface has no meshes
                assert!(entrant.engine == "jolt" && *word == "rocks:1", "{} on {word}", entrant.engine);
                continue;
            };
            for (k, (told, body)) in engine.poses().expect("poses").iter().zip(&scene.bodies).enumerate() {
                let corner = S::Vector::from_fn(|k| 1.0 + k as f64);
                let off = (told.to_world(corner) - body.pose.to_world(corner)).norm();
                assert!(off < 1e-4, "{} on {word}: body {k} is off by {off}", entrant.engine);
            }
        }
    }
}

#[test]
fn engines_begin_where_the_scene_does_in_both_spaces() {
    engines_begin_where_the_scene_does::<Planar>(&["tumbler:4", "rain:1", "smash:4", "washer:4"]);
    engines_begin_where_the_scene_does::<Spatial>(&["hulls:1", "rocks:1", "washer:3", "slide:3", "bricks:3"]);
}

fn nothing_overlaps_at_the_start<S: Catalogue>(words: &[&str]) {
    for word in words {
        let scene = built::<S>(word);
        let poses: Vec<Pose<S>> = scene.bodies.iter().map(|b| b.pose).collect();
        let found = Judge::of(&scene).expect("shapes").look(&poses);
        assert!(found.deepest <= 1e-9, "{word} of {}: {found:?}", S::NAME);
    }
}

#[test]
fn no_scene_begins_with_overlap() {
    nothing_overlaps_at_the_start::<Planar>(&[
        "pyramid:30",
        "pyramids:3",
        "tumbler:45",
        "rain:20",
        "smash:20",
        "washer:40",
        "stacks:5",
        "bricks:5",
    ]);
    nothing_overlaps_at_the_start::<Spatial>(&[
        "pyramid:20",
        "pyramids:2",
        "hulls:3",
        "bricks:6",
        "rocks:2",
        "washer:8",
        "stacks:3",
        "statics:20",
        "slide",
        "smash:8",
        "tumbler:6",
    ]);
}

#[test]
fn scenes_have_as_many_bodies_as_their_names_promise() {
    let plane = |word: &str| built::<Planar>(word).moving();
    let space = |word: &str| built::<Spatial>(word).moving();
    assert_eq!([plane("pyramid"), plane("pyramids"), plane("tumbler")], [5_050, 22_000, 2_025]);
    assert_eq!([space("pyramid"), space("pyramids"), space("hulls")], [5_050, 10_780, 3_072]);
    assert_eq!([space("bricks"), space("stacks"), space("statics")], [1_240, 1_000, 100]);
    assert_eq!(built::<Spatial>("statics").bodies.len(), 1_000_100);
    assert_eq!([plane("washer"), space("washer"), plane("rain")], [8_100, 8_000, 2_000]);
}
