//! Hollow walls: bodies in bowls and drums. Their gap shrinks on straight ways too, which arrivals must know.

use crate::harness::*;
use carom::{BodySpec, Column, EventSettings, PlasticArrivals, Rotation, Scheme, Settings, World};
use carom_scenes::judge::Judge;

in_plane_and_space!(
    a_ball_shot_across_a_round_room_goes_round_its_polygon,
    a_block_dropped_into_a_bowl_comes_to_rest_on_its_corners,
    balls_poured_into_a_bowl_come_to_rest,
    a_block_rests_in_a_bowl_with_fixed_steps,
);

fn by_events<S: Dimension>(dt: f64) -> Settings<S> {
    Settings { dt, scheme: Scheme::Events, tolerance: 1e-8, ..Settings::default() }
}

/// Billiards in a circle: chords of one length, each turned against the one before by the same angle, at any step.
pub fn a_ball_shot_across_a_round_room_goes_round_its_polygon<S: Dimension>() {
    // the ball's centre stays within .9 of the middle; half a chord is .9 sin of half the turn
    let (half_turn, speed) = (1.1_f64, 3.0);
    let (half_chord, off) = (0.9 * half_turn.sin(), 0.9 * half_turn.cos());
    for dt in [0.004, 0.05, 0.3] {
        let mut w = world::<S>(Settings { gravity: S::at(0.0, 0.0), ..by_events(dt) });
        add(&mut w, "room", BodySpec::fixed(S::cavity(1.0)).restitution(1.0).friction(0.0));
        let ball = BodySpec::heavy(S::ball(0.1), 1.0).at(S::at(0.0, -off)).moving(S::at(speed, 0.0));
        add(&mut w, "ball", ball.restitution(1.0).friction(0.0));
        let (mut worst, mut chords) = (0.0_f64, 0.0_f64);
        run(&mut w, 60.0, |w, r| {
            chords = ((speed * r.time + half_chord) / (2.0 * half_chord)).floor();
            let along = speed * r.time - 2.0 * half_chord * chords;
            let wanted = leaning::<S>(2.0 * half_turn * chords).rotate(S::at(along, -off));
            worst = worst.max((w.bodies().motion.position[1] - wanted).norm());
        });
        assert!(chords > 100.0, "{chords}");
        at_most(worst, 1e-10, "place on the polygon [m]");
        close(w.energy().total(), 0.5 * speed * speed, 1e-12, "energy [J]");
    }
}

/// Runs to an end and holds every step to gain, overlap and books; gives the kinetic energy left over the first.
fn settle<S: Dimension>(w: &mut World<S>, time: f64) -> f64 {
    let start = w.energy().total();
    // what may be lost: the bottom of the bowl is 1 m below its middle
    let whole = start
        + w.bodies().data.iter().map(|d| d.mass_properties.mass).filter(|m| m.is_finite()).sum::<f64>() * G;
    let (mut judge, mut before, mut gain, mut overlap) = (Judge::of(w), start, 0.0_f64, 0.0_f64);
    run(w, time, |w, r| {
        assert_eq!(r.events.capped, 0, "capped at {}", w.time());
        gain = gain.max(r.energy.total() - before);
        before = r.energy.total();
        overlap = overlap.max(judge.worst_of(w).over_size);
    });
    at_most(gain / whole, 1e-8, "gain in a step [1]");
    at_most(overlap, 1e-6, "overlap over the size [1]");
    at_most(w.ledger().closure.abs() / whole, 1e-12, "closure [1]");
    w.energy().kinetic() / whole
}

/// How many of a block's corners lie on a bowl of radius 1, and how far off the last of them is \[m\].
fn corners_on_bowl<S: Dimension>(w: &World<S>, half: [f64; 2]) -> Vec<f64> {
    let m = &w.bodies().motion;
    let corner =
        |x: f64, y: f64| (m.position[1] + m.rotation[1].rotate(S::at(x * half[0], y * half[1]))).norm();
    let mut gaps: Vec<f64> =
        [(1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)].map(|(x, y)| 1.0 - corner(x, y)).into();
    gaps.sort_by(f64::total_cmp);
    gaps
}

fn block_in_bowl<S: Dimension>(settings: Settings<S>) -> World<S> {
    let mut w = world::<S>(settings);
    add(&mut w, "bowl", BodySpec::fixed(S::cavity(1.0)).friction(0.6));
    let block = BodySpec::dense(S::block(0.5, 0.2), 1000.0).at(S::at(0.35, -0.5));
    add(&mut w, "block", block.turned(leaning::<S>(0.3)).friction(0.6).restitution(0.0));
    w
}

pub fn a_block_dropped_into_a_bowl_comes_to_rest_on_its_corners<S: Dimension>() {
    let mut w = block_in_bowl::<S>(by_events(0.005));
    at_most(settle(&mut w, 4.0), 1e-10, "kinetic energy left [1]");
    if S::DIM == 2 {
        let gaps = corners_on_bowl(&w, [0.25, 0.1]);
        at_most(gaps[0].abs().max(gaps[1].abs()), 1e-8, "two corners on the bowl [m]");
        assert!(gaps[2] > 0.05, "{gaps:?}");
    }
}

pub fn balls_poured_into_a_bowl_come_to_rest<S: Dimension>() {
    let events =
        EventSettings { plastic_arrivals: PlasticArrivals::WithinTheStep, ..EventSettings::default() };
    let mut w = world::<S>(Settings { events, ..by_events(0.01) });
    add(&mut w, "bowl", BodySpec::fixed(S::cavity(1.0)).friction(0.3));
    for k in 0..8 {
        let (layer, place) = (f64::from(k / 4), f64::from(k % 4));
        let at = S::at(0.21 * (place - 1.5) + 0.04 * layer, -0.5 + 0.23 * layer);
        let ball = BodySpec::dense(S::ball(0.1), 1000.0).at(at);
        add(&mut w, &format!("ball {k}"), ball.friction(0.3).restitution(0.0));
    }
    // balls roll to and fro without end where nothing resists; they may keep what rolling keeps
    let left = settle(&mut w, 2.0);
    assert!(left < 0.2, "{left}");
}

/// A block across the bowl's bottom, leaning by nothing: its lower corners carry half its weight each.
pub fn a_block_rests_in_a_bowl_with_fixed_steps<S: Dimension>() {
    let mut w = world::<S>(Settings { dt: 0.005, tolerance: 1e-10, iterations: 500, ..Settings::default() });
    add(&mut w, "bowl", BodySpec::fixed(S::cavity(1.0)).friction(0.6));
    // half the width of the lower face, and half its diagonal in space
    let half = 0.25 * (S::DIM as f64 - 1.0).sqrt();
    let low = -(1.0 - half * half).sqrt();
    let block = BodySpec::dense(S::block(0.5, 0.2), 1000.0).at(S::at(0.0, low + 0.1));
    add(&mut w, "block", block.friction(0.6).restitution(0.0));
    run(&mut w, 2.0, |_, _| ());
    close(height(&w, 1), low + 0.1, 1e-4, "height [m]");
    at_most(w.energy().kinetic(), 1e-8, "at rest [J]");
    assert_eq!(w.touches().len(), if S::DIM == 2 { 2 } else { 4 });
}
