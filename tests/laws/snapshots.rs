//! Snapshots restore the trajectory, warm starts included, bit for bit.

use crate::harness::*;
use crate::laws::determinism::heap;
use carom::{BodySpec, BuildError, Column, Planar, Scheme, Settings, Spatial, World, Wrench};

in_plane_and_space!(
    a_run_continued_from_a_snapshot_equals_the_uninterrupted_run,
    a_snapshot_of_a_restored_world_is_the_same_text,
    a_snapshot_keeps_forces_that_wait_for_the_next_step,
    a_snapshot_names_the_force_fields_that_it_cannot_hold,
    a_damaged_snapshot_is_refused,
    preparing_a_world_changes_nothing_but_the_first_steps_time,
    what_is_written_to_bodies_that_stand_is_seen,
);

fn restored<S: Dimension>(text: &str) -> World<S> {
    World::from_snapshot(text).unwrap_or_else(|e: BuildError| panic!("{e}")).0
}

/// Stop in the middle of the collisions, restore, go on.
pub fn a_run_continued_from_a_snapshot_equals_the_uninterrupted_run<S: Dimension>() {
    let mut w = heap::<S>(Settings { iterations: 7, ..Settings::default() });
    settle(&mut w, 0.6);
    let mut copy = restored::<S>(&w.snapshot());
    assert_eq!(bits(&w), bits(&copy));
    settle(&mut w, 0.6);
    settle(&mut copy, 0.6);
    assert_eq!(bits(&w), bits(&copy), "the warm starts are part of the snapshot");
    assert_eq!(w.time().to_bits(), copy.time().to_bits());
    assert_eq!(w.ledger(), copy.ledger());
    // seven iterations leave the solves inexact, so a lost warm start would show
    let mut cold = restored::<S>(&copy.snapshot());
    let mut settings = cold.settings().clone();
    settings.warm_start = false;
    cold.set_settings(settings).expect("possible");
    settle(&mut cold, 0.1);
    settle(&mut copy, 0.1);
    assert_ne!(bits(&cold), bits(&copy));
}

/// Nothing is lost on the way through the text.
pub fn a_snapshot_of_a_restored_world_is_the_same_text<S: Dimension>() {
    let mut w = heap::<S>(Settings::default());
    settle(&mut w, 0.4);
    w.remove("body3").expect("it is there");
    settle(&mut w, 0.1);
    let text = w.snapshot();
    assert_eq!(text, restored::<S>(&text).snapshot());
}

/// A force applied before the snapshot acts after it.
pub fn a_snapshot_keeps_forces_that_wait_for_the_next_step<S: Dimension>() {
    let mut w = heap::<S>(Settings::default());
    w.apply_wrench(3, Wrench { force: S::at(50.0, 80.0), torque: S::turn(2.0) });
    let mut copy = restored::<S>(&w.snapshot());
    step(&mut w);
    step(&mut copy);
    assert_eq!(bits(&w), bits(&copy));
    assert!(w.ledger().applied != 0.0);
}

/// Force fields are code: their names come back, to be set again.
pub fn a_snapshot_names_the_force_fields_that_it_cannot_hold<S: Dimension>() {
    let mut w = heap::<S>(Settings::default());
    w.set_force_field(
        "wind",
        Box::new(|_: f64, _: &carom::Motion<S>, out: &mut [Wrench<S>]| out[2].force += S::at(1.0, 0.0)),
    );
    let (_, missing) = World::<S>::from_snapshot(&w.snapshot()).expect("a snapshot");
    assert_eq!(missing, ["wind"]);
}

/// Texts that are no snapshots, of the other space, or with impossible numbers are refused, naming the trouble.
pub fn a_damaged_snapshot_is_refused<S: Dimension>() {
    let text = heap::<S>(Settings::default()).snapshot();
    for (damaged, named) in [
        (text[..text.len() / 2].to_string(), "snapshot"),
        (text.replace("\"version\":1", "\"version\":99"), "version 99"),
        (text.replacen("\"friction\":0.4", "\"friction\":-0.4", 1), "friction"),
        (text.replacen("\"dt\":0.0", "\"dt\":-0.0", 1), "dt"),
    ] {
        let error = World::<S>::from_snapshot(&damaged).err().expect("refused").to_string();
        assert!(error.contains(named), "{error} should name {named}");
    }
}

/// A snapshot of the plane is not one of space.
#[test]
fn a_snapshot_of_the_other_space_is_refused() {
    let text = heap::<Planar>(Settings::default()).snapshot();
    assert!(World::<Spatial>::from_snapshot(&text).is_err());
}

/// A world that was prepared goes the way of one that was not, bit for bit, whenever that was done, and what is written to bodies
/// that stand afterwards is seen.
pub fn preparing_a_world_changes_nothing_but_the_first_steps_time<S: Dimension>() {
    for scheme in [Scheme::FixedStep, Scheme::Events, Scheme::SoftStep] {
        let make = || heap::<S>(Settings { scheme, ..Settings::default() });
        let (mut w, mut prepared) = (make(), make());
        for k in 0..4 {
            prepared.prepare(1e-3).expect("nothing to refuse");
            for w in [&mut w, &mut prepared] {
                settle(w, 0.05);
                let shelf = BodySpec::fixed(S::block(0.8, 0.2)).friction(0.1);
                let shelf = add(w, &format!("shelf {k}"), shelf.at(S::at(0.4, -1.25)));
                w.motion_mut().position[shelf] = S::at(0.1 * f64::from(k), 0.25);
            }
            assert_eq!(bits(&w), bits(&prepared), "{scheme:?}, round {k}");
        }
        prepared.motion_mut().position[0] = S::at(f64::NAN, 0.0);
        assert!(prepared.prepare(1e-3).is_err(), "what a step refuses is refused here");
    }
}

/// Steps keep what they know of bodies that stand while nobody writes to them. A world that was written to goes on like its
/// copy, which knows nothing: after a fixed body was moved, changed, put in another's place, or wrongly set in motion.
pub fn what_is_written_to_bodies_that_stand_is_seen<S: Dimension>() {
    for scheme in [Scheme::FixedStep, Scheme::Events, Scheme::SoftStep] {
        let mut w = heap::<S>(Settings { scheme, ..Settings::default() });
        let shelf = || BodySpec::fixed(S::block(0.8, 0.2)).friction(0.1);
        let first = add(&mut w, "shelf", shelf().at(S::at(0.4, 0.25)));
        settle(&mut w, 0.3);
        let goes_on = |w: &mut World<S>, what: &str| {
            let mut copy = restored::<S>(&w.snapshot());
            settle(w, 0.1);
            settle(&mut copy, 0.1);
            assert_eq!(bits(w), bits(&copy), "{scheme:?}: {what}");
        };
        w.motion_mut().position[first] += S::at(-0.02, -0.05);
        goes_on(&mut w, "moved");
        w.bodies_mut().data[first].friction = 0.9;
        goes_on(&mut w, "rougher");
        w.motion_mut().velocity[first] = S::at(1.0, 0.0);
        assert!(w.step(1e-3).is_err(), "fixed bodies do not move");
        w.motion_mut().velocity[first] = S::Vector::ZERO;
        w.motion_mut().position[first] += S::at(0.01, -0.02);
        goes_on(&mut w, "moved after a step was refused");
        w.remove("shelf").expect("is there");
        add(&mut w, "other shelf", shelf().at(S::at(-0.3, 0.1)));
        goes_on(&mut w, "another in its place");
    }
}
