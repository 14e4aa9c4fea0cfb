//! Plastic arrivals within the step (theory section 8.5): heaps without a moment for each of their contacts. First
//! order in time, and as strict as the scheme at their moments with overlap, energy and books.

use crate::harness::*;
use carom::{
    BodySpec, Column, EventSettings, PlasticArrivals, Scheme, Settings, Spatial, SpatialShape, World, vec3,
};
use carom_scenes::judge::Judge;
use carom_scenes::pouring;

in_plane_and_space!(
    a_plastic_ball_lands_and_lies_where_the_floor_is,
    a_stack_stands_though_its_arrivals_have_no_moments,
    a_sliding_block_stops_within_the_order_of_the_step,
    a_heap_of_plastic_balls_neither_overlaps_nor_gains,
    a_row_longer_than_the_rounds_of_looking_moves_on,
    contacts_that_do_not_press_are_certified_with_those_that_do,
    an_elastic_ball_still_bounces_at_its_moment,
    balls_that_would_be_through_each_other_by_the_end_of_the_step_bounce,
);

fn within_the_step<S: Dimension>(dt: f64) -> Settings<S> {
    let plastic_arrivals = PlasticArrivals::WithinTheStep;
    let events = EventSettings { plastic_arrivals, ..EventSettings::default() };
    Settings { dt, scheme: Scheme::Events, tolerance: 1e-8, events, ..Settings::default() }
}

/// What every step of a heap must hold; gives the joules that the best step gained.
fn watch<S: Dimension>(w: &mut World<S>, time: f64, size: f64) -> f64 {
    let mut before = w.energy().total();
    let mut gain = 0.0_f64;
    run(w, time, |w, r| {
        gain = gain.max(r.energy.total() - before);
        before = r.energy.total();
        assert_eq!(r.events.capped, 0, "capped at {}", w.time());
        let deepest = r.deepest.map_or(0.0, |d| -d.0);
        assert!(deepest <= 1.01e-9 * size, "overlap {deepest} at {}", w.time());
    });
    gain
}

/// A fall of a metre; it is slowed at most a step too early, and loses what it fell.
pub fn a_plastic_ball_lands_and_lies_where_the_floor_is<S: Dimension>() {
    for dt in [1e-3, 1e-2, 0.1] {
        let mut w = world::<S>(within_the_step(dt));
        add_floor(&mut w, 0.5, 0.0);
        let ball = BodySpec::dense(S::ball(0.1), 1000.0).at(S::at(0.0, 1.1));
        add(&mut w, "ball", ball.restitution(0.0));
        let start = w.energy().total();
        let gain = watch(&mut w, 1.0, 0.2);
        at_most(gain / start, 1e-14, "gain in a step [1]");
        close(height(&w, 1), 0.1, 1e-12, "on the floor [m]");
        at_most(w.energy().kinetic(), 1e-20 * start, "at rest [J]");
        at_most(w.ledger().closure.abs() / start, 1e-12, "closure [1]");
    }
}

/// Nothing moves, nothing is paid.
pub fn a_stack_stands_though_its_arrivals_have_no_moments<S: Dimension>() {
    let mut w = world::<S>(within_the_step(0.01));
    add_floor(&mut w, 0.5, 0.0);
    for k in 0..6 {
        let block = BodySpec::heavy(S::block(0.4, 0.2), 1.0).at(S::at(0.0, 0.1 + 0.2 * f64::from(k)));
        add(&mut w, &format!("block {k}"), block.friction(0.5).restitution(0.0));
    }
    watch(&mut w, 2.0, 0.2);
    for k in 0..6 {
        close(height(&w, k + 1), 0.1 + 0.2 * k as f64, 1e-10, "height [m]");
    }
    let l = w.ledger();
    at_most(l.impact_normal.abs() + l.friction.abs() + l.projection.abs(), 1e-10, "joules [J]");
}

/// Case C14 to first order: half the step, half the error or less.
pub fn a_sliding_block_stops_within_the_order_of_the_step<S: Dimension>() {
    let error = |dt: f64| {
        let mut w = world::<S>(within_the_step(dt));
        add_floor(&mut w, 0.5, 0.0);
        let block = BodySpec::dense(S::block(0.4, 0.2), 1000.0).at(S::at(0.0, 0.1)).moving(S::at(5.0, 0.0));
        add(&mut w, "block", block.friction(0.5).restitution(0.0));
        watch(&mut w, 1.5, 0.2);
        at_most(w.energy().kinetic(), 1e-9, "at rest [J]");
        (S::along(w.bodies().motion.position[1]) - 25.0 / G).abs()
    };
    // the last flow's way is at most that of its slip, mu g h, over half of it
    for dt in [0.1, 0.03, 0.01] {
        at_most(error(dt), 0.5 * 0.5 * G * dt * dt + 1e-9, "C14 length [m]");
    }
}

/// Three layers fall on each other and spread.
pub fn a_heap_of_plastic_balls_neither_overlaps_nor_gains<S: Dimension>() {
    let mut w = world::<S>(within_the_step(0.01));
    add_floor(&mut w, 0.3, 0.0);
    for k in 0..12 {
        let (layer, place) = (f64::from(k / 4), f64::from(k % 4));
        let at = S::at(0.21 * place + 0.04 * (layer + 0.3 * place), 0.11 + 0.23 * layer);
        let ball = BodySpec::dense(S::ball(0.1), 1000.0).at(at);
        add(&mut w, &format!("ball {k}"), ball.friction(0.3).restitution(0.0));
    }
    let start = w.energy().total();
    let gain = watch(&mut w, 2.0, 0.2);
    at_most(gain / start, 1e-9, "gain in a step [1]");
    at_most(w.ledger().closure.abs() / start, 1e-12, "closure [1]");
    assert!(w.energy().total() < 0.7 * start, "the heap has spread");
}

/// A fast ball at the end of a row whose gaps close one after the other: who comes in shows only once the one before is
/// slowed, farther along than there are rounds of looking. Every one of them must have moved by the step's end.
pub fn a_row_longer_than_the_rounds_of_looking_moves_on<S: Dimension>() {
    for count in [12, 60, 160] {
        let mut settings = within_the_step::<S>(0.01);
        settings.gravity = S::at(0.0, 0.0);
        let mut w = world::<S>(settings);
        let speed = f64::from(count);
        for k in 0..count {
            let ball = BodySpec::heavy(S::ball(0.1), 1.0).at(S::at(0.2001 * f64::from(k), 0.0));
            let ball = ball.moving(S::at(if k == 0 { speed } else { 0.0 }, 0.0));
            add(&mut w, &format!("ball {k}"), ball.friction(0.0).restitution(0.0));
        }
        let center = |w: &World<S>| {
            w.bodies().motion.position.iter().map(|p| S::along(*p)).sum::<f64>() / f64::from(count)
        };
        for _ in 0..3 {
            let before = center(&w);
            w.step(0.01).expect("possible");
            close(center(&w) - before, 0.01, 1e-12, "way of the center of mass [m]");
        }
        at_most(w.energy().kinetic(), 0.5 * speed * speed, "no gain [J]");
    }
}

/// Rounds of a flow leave out contacts that do not press; the problem that they end with has all of them, where they are
/// then, and its certificate is that of all.
pub fn contacts_that_do_not_press_are_certified_with_those_that_do<S: Dimension>() {
    let mut w = world::<S>(within_the_step(0.01));
    add_floor(&mut w, 0.0, 0.0);
    for k in 0..24 {
        let (row, place) = (f64::from(k / 4), f64::from(k % 4));
        let mut at = S::at(0.21 * place + 0.013 * row, 0.1 + 0.2 * row);
        if S::DIM == 3 {
            at[1] += 0.017 * row - 0.03 * place;
        }
        let ball = BodySpec::dense(S::ball(0.1), 1000.0).at(at);
        add(&mut w, &format!("ball {k}"), ball.friction(0.0).restitution(0.0));
    }
    let (mut idle, mut worst) = (0, 0.0_f64);
    run(&mut w, 1.5, |w, _| {
        let certificate = w.certificate(carom::Phase::Contact, None).expect("they touch");
        worst = worst.max(certificate.residual);
        idle += w.last_problem().1.contacts.iter().filter(|g| g.normal == 0.0).count();
    });
    at_most(worst, 1e-12, "certificate [m/s]");
    assert!(idle > 100, "{idle} contacts that did not press");
}

/// What bounces is no plastic arrival: case C6's heights hold as ever.
pub fn an_elastic_ball_still_bounces_at_its_moment<S: Dimension>() {
    let mut w = world::<S>(within_the_step(0.01));
    add_floor(&mut w, 0.0, 0.0);
    let ball = BodySpec::dense(S::ball(0.1), 1000.0).at(S::at(0.0, 1.1)).restitution(1.0).friction(0.0);
    add(&mut w, "ball", ball);
    let mut worst = 0.0_f64;
    run(&mut w, 3.0, |w, r| {
        let period = 2.0 * (2.0 / G).sqrt();
        let phase = (r.time + 0.5 * period) % period - 0.5 * period;
        worst = worst.max((height(w, 1) - 0.1 - (1.0 - 0.5 * G * phase * phase)).abs());
    });
    at_most(worst, 1e-12, "heights [m]");
}

/// Where the step leaves two elastic balls overlapped on the far sides of each other, they part there: that is no
/// contact that stays, and their moment was on the way.
pub fn balls_that_would_be_through_each_other_by_the_end_of_the_step_bounce<S: Dimension>() {
    let mut settings = within_the_step::<S>(0.1);
    settings.gravity = S::at(0.0, 0.0);
    let mut w = world::<S>(settings);
    for (name, side) in [("left", -1.0), ("right", 1.0)] {
        let ball =
            BodySpec::heavy(S::ball(0.1), 1.0).at(S::at(0.5 * side, 0.0)).moving(S::at(-5.5 * side, 0.0));
        add(&mut w, name, ball.restitution(1.0).friction(0.0));
    }
    w.step(0.1).expect("possible");
    // .8 m between the surfaces at 11 m/s, and back for the rest of the step
    let (place, speed) = (S::along(w.bodies().motion.position[1]), S::along(w.bodies().motion.velocity[1]));
    close(speed, 5.5, 1e-12, "speed after the bounce [m/s]");
    close(place, 0.1 + 5.5 * 0.1 - 0.4, 1e-12, "place after the bounce [m]");
}

/// Leaning boxes without restitution dropped on each other: corners and edges on faces.
#[test]
fn a_heap_of_plastic_boxes_neither_overlaps_nor_gains() {
    let mut w = world::<Spatial>(within_the_step(0.01));
    add_floor(&mut w, 0.5, 0.0);
    for k in 0..4 {
        let lean = 0.2 + 0.3 * f64::from(k);
        let block = BodySpec::dense(SpatialShape::Box { size: [0.4, 0.3, 0.2] }, 1000.0);
        let block = block.at(vec3(0.1 * lean, -0.05 * lean, 0.4 + 0.45 * f64::from(k)));
        let block = block.turned(leaning::<Spatial>(lean)).friction(0.5).restitution(0.0);
        add(&mut w, &format!("box {k}"), block);
    }
    let start = w.energy().total();
    let gain = watch(&mut w, 2.5, 0.4);
    at_most(gain / start, 1e-8, "gain in a step [1]");
    at_most(w.ledger().closure.abs() / start, 1e-12, "closure [1]");
    at_most(w.energy().kinetic(), 1e-6 * start, "nearly at rest [J]");
}

/// The short twin of `make heaps HEAPS=bin`, with its demands: boxes and hulls dropped into a bin come to rest. Overlap
/// is measured at each step's end, from places and shapes alone.
#[test]
fn boxes_and_hulls_dropped_into_a_bin_come_to_rest() {
    let mut w = pouring::bin(2, 3, 9).expect("builds");
    let mut settings = within_the_step::<Spatial>(1.0 / 240.0);
    settings.events.tolerance = 1e-8;
    w.set_settings(settings).expect("possible");
    let start = w.energy().total();
    let (mut judge, mut before, mut gain, mut overlap) = (Judge::of(&w), start, 0.0_f64, 0.0_f64);
    let mut slow_since = None;
    run(&mut w, 2.5, |w, r| {
        assert_eq!((r.events.capped, r.events.arrivals), (0, 0), "moments at {}", w.time());
        gain = gain.max(r.energy.total() - before);
        before = r.energy.total();
        overlap = overlap.max(judge.worst_of(w).over_size);
        let (bodies, motion) = (w.bodies(), &w.bodies().motion);
        let slow = (0..bodies.len()).filter(|&i| bodies.is_dynamic(i)).all(|i| {
            let turning = bodies.data[i].turning_arm * motion.angular_velocity[i].norm();
            motion.velocity[i].norm() + turning <= 1e-4
        });
        slow_since = if slow { slow_since.or(Some(w.time())) } else { None };
    });
    at_most(gain / start, 1e-8, "gain in a step [1]");
    at_most(overlap, 1e-6, "overlap over the size [1]");
    at_most(w.ledger().closure.abs() / start, 1e-12, "closure [1]");
    at_most(slow_since.unwrap_or(f64::INFINITY), 2.0, "at rest since, of 2.5 s [s]");
}
