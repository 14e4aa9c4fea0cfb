//! Hollow walls: bodies in bowls and drums. Their gap shrinks on straight ways too, which arrivals must know.

use crate::harness::*;
use carom::{
    BodySpec, Column, EventSettings, PlasticArrivals, Rotation, Scheme, Settings, Spatial, World, vec3,
};
use carom_scenes::judge::Judge;

in_plane_and_space!(
    a_ball_shot_across_a_round_room_goes_round_its_polygon,
    a_ball_that_swings_in_a_bowl_keeps_its_energy,
    a_push_on_a_ball_that_rolls_in_a_bowl_costs_the_energy_of_its_slip,
    a_swing_in_a_bowl_goes_on_from_a_snapshot_bit_for_bit,
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

/// A ball of radius .1 and 1 kg in a bowl of radius 1, let go at an angle from its lowest point.
fn ball_in_bowl<S: Dimension>(amplitude: f64, friction: f64, dt: f64) -> World<S> {
    let mut w = world::<S>(by_events(dt));
    add(&mut w, "bowl", BodySpec::fixed(S::cavity(1.0)).friction(friction));
    let place = S::at(0.9 * amplitude.sin(), -0.9 * amplitude.cos());
    add(&mut w, "ball", BodySpec::heavy(S::ball(0.1), 1.0).at(place).friction(friction));
    w
}

/// Runs and gives the largest change of the energy \[J\]; the ball stays on the bowl, nothing strikes and no slip stops.
fn undisturbed<S: Dimension>(w: &mut World<S>, time: f64) -> f64 {
    let start = w.energy().total();
    let (mut change, mut gap) = (0.0_f64, 0.0_f64);
    run(w, time, |w, r| {
        change = change.max((r.energy.total() - start).abs());
        gap = gap.max((w.bodies().motion.position[1].norm() - 0.9).abs());
        assert_eq!((r.events.impacts, r.events.slip_stops), (0, 0), "at {}", r.time);
    });
    at_most(gap, 1e-10, "gap [m]");
    at_most(w.ledger().friction.abs(), 1e-14, "friction's work [J]");
    change
}

/// Rolling without slipping, and sliding without friction: the energy of the swing stays, at any step. Where the ball is
/// by then says case C23. Rolling at 1.2 rad asks for friction tan(1.2) k/(1 + k), .86 in the plane.
pub fn a_ball_that_swings_in_a_bowl_keeps_its_energy<S: Dimension>() {
    for friction in [0.0, 1.5] {
        for (amplitude, dt, time) in
            [(0.1, 0.01, 60.0), (0.5, 0.01, 60.0), (0.5, 0.05, 6.0), (0.5, 0.003, 6.0), (1.2, 0.02, 6.0)]
        {
            let change = undisturbed(&mut ball_in_bowl::<S>(amplitude, friction, dt), time);
            let swing = 0.9 * G * (1.0 - amplitude.cos());
            at_most(change / swing, 1e-11, &format!("from {amplitude} rad, h = {dt}: energy [1]"));
        }
    }
}

/// The same going round at a height, and spinning about the normal on the way: in space alone.
#[test]
fn a_ball_that_rolls_round_in_a_bowl_keeps_its_energy() {
    for dt in [0.02, 0.01, 0.005] {
        let mut w = ball_in_bowl::<Spatial>(0.5, 1.5, dt);
        let (normal, velocity) = (vec3(-0.5_f64.sin(), 0.0, 0.5_f64.cos()), vec3(0.0, 1.0, 0.0));
        w.motion_mut().velocity[1] = velocity;
        w.motion_mut().angular_velocity[1] = normal.cross(velocity) * 10.0 + normal * 3.0;
        at_most(undisturbed(&mut w, 6.0), 1e-11, &format!("h = {dt}: energy [J]"));
    }
}

/// What is given to a ball that has long rolled is a slip to be stopped, though the contact stuck in the step before:
/// friction takes m k/(1 + k) s^2/2, as in a blow but for the weight's pull on the way, which is the other way round for
/// the other slip. On the flat it takes it exactly (`a_rolling_ball_that_is_pushed_slides_and_rolls_again`).
pub fn a_push_on_a_ball_that_rolls_in_a_bowl_costs_the_energy_of_its_slip<S: Dimension>() {
    let lost = |slip: f64| {
        let mut w = ball_in_bowl::<S>(0.5, 1.5, 0.005);
        run(&mut w, 1.0, |_, _| ());
        let spin = w.bodies().motion.angular_velocity[1];
        w.motion_mut().angular_velocity[1] = spin + S::turn(10.0 * slip);
        let before = w.energy().total();
        run(&mut w, 0.1, |_, _| ());
        before - w.energy().total()
    };
    let slip = 0.05;
    let wanted = 0.5 * S::ROUNDNESS / (1.0 + S::ROUNDNESS) * slip * slip;
    close(0.5 * (lost(slip) + lost(-slip)) / wanted, 1.0, 0.05, "what the slips took, over their energy [1]");
}

/// Who stuck is part of a snapshot.
pub fn a_swing_in_a_bowl_goes_on_from_a_snapshot_bit_for_bit<S: Dimension>() {
    let mut w = ball_in_bowl::<S>(0.5, 1.5, 0.01);
    for _ in 0..10 {
        run(&mut w, 0.07, |_, _| ());
        let (mut again, _) = World::<S>::from_snapshot(&w.snapshot()).expect("a snapshot of this world");
        run(&mut w, 0.2, |_, _| ());
        run(&mut again, 0.2, |_, _| ());
        assert_eq!(bits(&w), bits(&again));
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
