//! Every scene of the catalogue builds, moves without error, stays finite, and is the same run bit for bit.

use carom::{Column, Geometry, Rotation, World};
use carom_scenes::{catalogue, planar, spatial};
use std::collections::BTreeSet;

/// Steps that each scene takes here.
const STEPS: usize = 30;

/// FNV-1a over the bits of all poses and velocities.
fn fingerprint<S: Geometry>(world: &World<S>) -> u64 {
    let m = &world.bodies().motion;
    let mut hash = 0xcbf2_9ce4_8422_2325_u64;
    let mut take = |numbers: &[f64]| {
        for byte in numbers.iter().flat_map(|x| x.to_bits().to_le_bytes()) {
            hash = (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3);
        }
    };
    for i in 0..world.bodies().len() {
        take(m.position[i].as_slice());
        take(m.rotation[i].as_slice());
        take(m.velocity[i].as_slice());
        take(m.angular_velocity[i].as_slice());
    }
    hash
}

/// Runs a fresh world and returns its fingerprint.
fn run<S: Geometry>(name: &str, mut world: World<S>) -> u64 {
    let dt = world.settings().dt;
    let start = world.energy().total();
    for _ in 0..STEPS {
        let report = world.step(dt).unwrap_or_else(|e| panic!("{name}: {e}"));
        let scale = start.abs().max(report.energy.kinetic()).max(report.energy.potential.abs());
        assert!(
            report.ledger.closure.abs() <= 1e-12 * scale,
            "{name}: books off by {}",
            report.ledger.closure
        );
    }
    let m = &world.bodies().motion;
    assert!(
        (0..world.bodies().len()).all(|i| m.position[i].is_finite() && m.rotation[i].is_finite()),
        "{name}"
    );
    assert_eq!(world.steps(), STEPS as u64);
    fingerprint(&world)
}

#[test]
fn every_scene_builds_and_runs_the_same_bits_twice() {
    for info in catalogue() {
        let once = || match info.space {
            "planar" => run(info.name, planar(info.name).expect("named").expect(info.name)),
            _ => run(info.name, spatial(info.name).expect("named").expect(info.name)),
        };
        assert_eq!(once(), once(), "{}", info.name);
    }
}

#[test]
fn names_are_unique_sorted_and_say_their_space() {
    let key = |s: &carom_scenes::SceneInfo| (s.space, s.name);
    assert!(catalogue().windows(2).all(|w| key(&w[0]) < key(&w[1])));
    let names: BTreeSet<&str> = catalogue().iter().map(|s| s.name).collect();
    assert_eq!(names.len(), catalogue().len());
    for info in catalogue() {
        assert!(info.duration > 0.0 && !info.description.is_empty());
        let (end, other) =
            if info.space == "planar" { ("_planar", "_spatial") } else { ("_spatial", "_planar") };
        let stem = info.name.trim_end_matches("_planar").trim_end_matches("_spatial");
        let both = names.contains(format!("{stem}{other}").as_str());
        assert!(!info.name.ends_with(other), "{}", info.name);
        assert!(!both || info.name.ends_with(end), "{}", info.name);
    }
}

#[test]
fn a_scene_exists_in_its_own_space_alone() {
    for info in catalogue() {
        assert_eq!(planar(info.name).is_some(), info.space == "planar", "{}", info.name);
        assert_eq!(spatial(info.name).is_some(), info.space == "spatial", "{}", info.name);
    }
    assert!(planar("no such scene").is_none() && spatial("no such scene").is_none());
}

#[test]
fn the_large_scenes_have_the_sizes_that_their_descriptions_state() {
    let dynamic = |names: &[String], fixed: usize| names.len() - fixed;
    let pyramid = planar("pyramid_planar").expect("named").expect("builds");
    assert_eq!(dynamic(&pyramid.bodies().names, 1), 1275);
    let pile = spatial("pile").expect("named").expect("builds");
    assert_eq!(dynamic(&pile.bodies().names, 5), 1000);
}
