//! Long laws: minutes, so they are ignored by `cargo test` and run by `make laws`, which also shows how far each is.
//! Each has a twin that is not ignored: the test that its comment names.

use crate::cases::curved::bowl;
use crate::cases::events;
use crate::cases::free::off_unit_length;
use crate::cases::statics::{by_events, farthest};
use crate::cases::systems::momenta_stay;
use crate::harness::scenes::tower_of_planks;
use crate::harness::*;
use carom::{BodySpec, Column, Planar, Settings, Spatial, World, World3, vec3};
use carom_scenes::{simbenchmark, stacking};

/// Tells on the console when a run has passed another tenth of its time.
struct Progress {
    what: String,
    whole: f64,
    told: f64,
    began: std::time::Instant,
}

impl Progress {
    fn new(what: &str, whole: f64) -> Self {
        eprintln!("{what}: {whole} s to simulate");
        Progress { what: what.into(), whole, told: 0.0, began: std::time::Instant::now() }
    }
    fn at(&mut self, time: f64, found: impl Fn() -> String) {
        if time < self.told {
            self.told = 0.0;
        }
        if time >= self.told + 0.1 * self.whole * (1.0 - 1e-12) {
            self.told = time;
            let took = self.began.elapsed().as_secs_f64();
            eprintln!("{}: {time:.1} of {} s in {took:.1} s; {}", self.what, self.whole, found());
        }
    }
}

/// Case C30 as a long law: how far any body of a tower gets from where it began, at every moment of 600 s.
fn stands<S: Dimension>(what: &str, mut w: World<S>, bound: f64) {
    let time = 600.0;
    let mut progress = Progress::new(what, time);
    let worst = farthest(&mut w, time, |w, worst| {
        progress.at(w.time(), || format!("farthest {worst:.2e} m of {bound:.0e} m"));
    });
    at_most(worst, bound, &format!("C30 largest displacement, {what} [m]"));
}

/// Case C30. Twin: `a_low_kapla_tower_stands`.
#[test]
#[ignore = "long: 600 s of a Kapla tower of 102 planks"]
fn a_kapla_tower_of_102_planks_stands() {
    let w = by_events(stacking::kapla_tower(34, 3).expect("builds"), 1.0 / 60.0);
    stands("kapla tower of 102 planks", w, 1e-9);
}

/// Case C30. Twin: `a_house_of_cards_stands`.
#[test]
#[ignore = "long: 600 s of a house of cards"]
fn a_house_of_cards_stands() {
    let w = by_events(stacking::card_house(3, 0.5).expect("builds"), 1.0 / 60.0);
    stands("house of cards", w, 1e-9);
}

/// Case C30. Twin: `a_tower_of_planks_stands`.
#[test]
#[ignore = "long: 600 s of a tower of planks, in the plane"]
fn a_tower_of_planks_stands_in_the_plane() {
    stands("tower of planks, plane", tower_of_planks::<Planar>(events(1.0 / 60.0)), 1e-9);
}

/// Case C30. Twin: `a_tower_of_planks_stands`.
#[test]
#[ignore = "long: 600 s of a tower of planks, in space"]
fn a_tower_of_planks_stands_in_space() {
    stands("tower of planks, space", tower_of_planks::<Spatial>(events(1.0 / 60.0)), 1e-9);
}

/// Case C3, all of its million steps. Twin: `rotations_stay_of_unit_length`.
#[test]
#[ignore = "long: a million steps"]
fn a_million_steps_leave_rotations_of_unit_length() {
    let _told = Progress::new("a million steps of two bodies", 1e4);
    at_most(off_unit_length(1_000_000), 1e-14, "C3 length of a rotation off 1 after 1e6 steps [1]");
}

/// Case C7 at every step length: a thousand elastic bounces. Twin: `a_thousand_elastic_bounces_keep_energy_and_height`.
#[test]
#[ignore = "long: 1000 elastic bounces at h = 1e-4"]
fn a_thousand_elastic_bounces_at_every_step_length() {
    let period = 2.0 * (2.0 / G).sqrt();
    for dt in [1e-2, 1e-3, 1e-4] {
        let mut w = world::<Spatial>(events(dt));
        add_floor(&mut w, 0.0, 0.0);
        let ball = BodySpec::dense(Spatial::ball(0.1), 1000.0).at(vec3(0.0, 0.0, 1.1)).friction(0.0);
        add(&mut w, "ball", ball.restitution(1.0));
        let whole = w.energy().total();
        let mut progress = Progress::new(&format!("1000 bounces, h = {dt}"), 1000.0 * period);
        let (mut arrivals, mut worst) = (0, 0.0_f64);
        while arrivals < 1000 {
            let r = step(&mut w);
            arrivals += r.events.arrivals;
            // whole steps times their length: the clock sums 9e6 of them and rounds each time
            let phase = (r.step as f64 * dt + 0.5 * period) % period - 0.5 * period;
            worst = worst.max((height(&w, 1) - 0.1 - (1.0 - 0.5 * G * phase * phase)).abs());
            progress.at(r.time, || format!("{arrivals} bounces, farthest off {worst:.1e} m"));
        }
        at_most((w.energy().total() / whole - 1.0).abs(), 1e-11, &format!("C7 energy, h = {dt} [1]"));
        at_most(worst, 1e-9, &format!("C7 height, h = {dt} [m]"));
    }
}

/// Case C15 for 60 s in short steps. Twin: `a_block_on_a_steep_floor_stays_where_it_is`.
#[test]
#[ignore = "long: 60 s of a block on a slope at h = 1e-3"]
fn a_block_on_a_slope_does_not_creep() {
    fn creep<S: Dimension>() -> f64 {
        let angle = std::f64::consts::FRAC_PI_6;
        let gravity = S::at(G * angle.sin(), -G * angle.cos());
        let mut w = world::<S>(Settings { gravity, ..events(1e-3) });
        add_floor(&mut w, 0.58, 0.0);
        add(&mut w, "block", BodySpec::dense(S::block(0.4, 0.2), 1000.0).at(S::at(0.0, 0.1)).friction(0.58));
        let mut progress = Progress::new(&format!("block on a slope in {} dimensions", S::DIM), 60.0);
        farthest(&mut w, 60.0, |w, worst| progress.at(w.time(), || format!("crept {worst:.1e} m")))
    }
    at_most(creep::<Planar>(), 1e-10, "C15 creep in 60 s, plane [m]");
    at_most(creep::<Spatial>(), 1e-10, "C15 creep in 60 s, space [m]");
}

/// Case C24 for 60 s in shorter steps, the top a thousand times as heavy and not. Twin:
/// `a_stack_of_ten_stands_and_carries_exactly`.
#[test]
#[ignore = "long: 60 s of stacks of ten at h = .01"]
fn a_stack_of_ten_stands_and_carries_exactly() {
    fn stack<S: Dimension>(top: f64) -> (f64, f64) {
        let mut w = world::<S>(events(0.01));
        add_floor(&mut w, 0.5, 0.0);
        for k in 0..10 {
            let block = BodySpec::heavy(S::block(0.4, 0.2), if k == 9 { top } else { 1.0 });
            add(&mut w, &format!("block {k}"), block.at(S::at(0.0, 0.1 + 0.2 * f64::from(k))).friction(0.5));
        }
        let mut progress = Progress::new(&format!("stack of ten, top {top}, {} dimensions", S::DIM), 60.0);
        let drift =
            farthest(&mut w, 60.0, |w, worst| progress.at(w.time(), || format!("drift {worst:.1e} m")));
        let force = (0..10).fold(0.0, |worst: f64, k| {
            worst.max((normal_force(&w, k, k + 1) / ((top + 9.0 - k as f64) * G) - 1.0).abs())
        });
        (drift, force)
    }
    for (top, drift, force) in [(1.0, 1e-10, 1e-9), (1000.0, 1e-9, 1e-7)] {
        for found in [stack::<Planar>(top), stack::<Spatial>(top)] {
            at_most(found.0, drift, &format!("C24 drift in 60 s, top {top} [m]"));
            at_most(found.1, force, &format!("C24 interfaces, top {top} [1]"));
        }
    }
}

/// Case C23 for 60 s at h = .01. Twin: `a_ball_rolls_to_and_fro_with_the_period_of_the_bowl`.
#[test]
#[ignore = "long: 60 s of rolling to and fro"]
fn a_ball_rolls_to_and_fro_for_a_minute() {
    for swung in [bowl::<Planar>(0.1, 0.01, 60.0), bowl::<Spatial>(0.1, 0.01, 60.0)] {
        at_most(swung.gap, 1e-8, "C23 gap in 60 s [m]");
        at_most(swung.energy, 1e-11, "C23 energy in 60 s over that of the swing [1]");
        // four times what the twin holds h = .005 to
        at_most(swung.late.abs(), 8e-4, "C23 mean period of 60 s [s]");
    }
}

/// Case C31, all of its 10,000 steps. Twin: `bodies_that_collide_with_friction_keep_their_momenta`.
#[test]
#[ignore = "long: 10,000 steps of 100 bodies"]
fn ten_thousand_steps_of_collisions_leave_the_momenta() {
    let mut progress = Progress::new("100 bodies that collide, plane", 2.0);
    momenta_stay::<Planar>(2.0, |time| progress.at(time, String::new));
    let mut progress = Progress::new("100 bodies that collide, space", 2.0);
    momenta_stay::<Spatial>(2.0, |time| progress.at(time, String::new));
}

/// What a task of SimBenchmark comes to, sampled before each step.
#[derive(Default)]
struct Sampled {
    /// Mean squared error of the energy \[J^2\].
    energy: f64,
    /// Mean of what the task measures of places.
    places: f64,
    /// Largest gain of energy in a step, over the energy at the start \[1\].
    gain: f64,
    /// The ledger's line of projection over the energy at the start \[1\].
    projection: f64,
    /// Mean sum of squared overlaps of its balls \[m^2\].
    overlap: f64,
}

/// Runs a task for its time; `places` measures what it asks for of places. The books must close.
fn sampled(
    what: &str,
    mut w: World3,
    time: f64,
    balls_from: usize,
    places: impl Fn(&World3) -> f64,
) -> Sampled {
    let (dt, whole) = (w.settings().dt, w.energy().total());
    let steps = (time / dt).round();
    let mut progress = Progress::new(&format!("{what}, h = {dt}"), time);
    let (mut found, mut last) = (Sampled::default(), whole);
    for _ in 0..steps as usize {
        found.energy += (w.energy().total() - whole).powi(2) / steps;
        found.places += places(&w) / steps;
        let balls = &w.bodies().motion.position[balls_from..];
        found.overlap += simbenchmark::squared_overlap(balls, simbenchmark::RADIUS) / steps;
        let r = step(&mut w);
        assert_eq!(r.events.capped, 0, "{what}, h = {dt}: a capped step");
        found.gain = found.gain.max((r.energy.total() - last) / whole.abs());
        last = r.energy.total();
        progress.at(r.time, || format!("mean squared error of the energy so far {:.1e} J^2", found.energy));
    }
    found.projection = w.ledger().projection.abs() / whole.abs();
    at_most(w.ledger().closure.abs() / whole.abs(), 1e-12, &format!("{what}, h = {dt}: closure [1]"));
    found
}

/// SimBenchmark's rolling, both directions, at every step length. Twin:
/// `balls_roll_on_a_sliding_box_with_the_exact_acceleration_in_both_directions`.
#[test]
#[ignore = "long: SimBenchmark's rolling"]
fn simbenchmark_rolls_exactly_at_every_step_length() {
    for (direction, dt) in [vec3(0.5, 0.75_f64.sqrt(), 0.0), vec3(0.0, 1.0, 0.0)]
        .into_iter()
        .flat_map(|d| [1e-3, 1e-2, 0.1].map(|dt| (d, dt)))
    {
        let w = simbenchmark::rolling(direction, events(dt)).expect("the scene");
        let found = sampled("rolling", w, 4.0, 27, |w| {
            let off = |(body, acceleration): (usize, f64)| {
                (w.bodies().motion.velocity[body] - direction * (acceleration * w.time())).norm_squared()
            };
            [1, 2].into_iter().zip(simbenchmark::accelerations()).map(off).sum()
        });
        at_most(found.places, 1e-20, &format!("rolling, h = {dt}: mean squared error [m^2/s^2]"));
    }
}

/// SimBenchmark's bouncing at every step length. Twins: `elastic_balls_keep_energy_and_place_at_a_hundred_steps_a_second`,
/// `elastic_balls_keep_energy_and_place_at_ten_steps_a_second`.
#[test]
#[ignore = "long: SimBenchmark's bouncing"]
fn simbenchmark_bounces_exactly_at_every_step_length() {
    for dt in [1e-4, 1e-3, 1e-2, 0.1] {
        let w = simbenchmark::bouncing(events(dt)).expect("the scene");
        let found = sampled("bouncing", w, 20.0, 1, |w| {
            let height = simbenchmark::bouncing_height(w.time());
            let off = w.bodies().motion.position[1..].iter().map(|x| (x[2] - height).abs());
            let off = off.fold(0.0, f64::max);
            assert!(off <= 1e-9, "bouncing, h = {dt}: {off:e} m off at {} s", w.time());
            off
        });
        at_most(found.energy, 1e-15, &format!("bouncing, h = {dt}: mean squared error [J^2]"));
        at_most(found.overlap, 1e-20, &format!("bouncing, h = {dt}: overlap [m^2]"));
    }
}

/// SimBenchmark's elastic cube of 216 balls at every step length. Twin:
/// `a_cube_of_elastic_balls_keeps_its_energy_and_never_overlaps`.
#[test]
#[ignore = "long: SimBenchmark's elastic 666"]
fn simbenchmark_keeps_the_energy_of_216_elastic_balls() {
    for dt in [1e-3, 1e-2, 0.1] {
        let w = simbenchmark::cube(6, 1.101, 1.0, events(dt)).expect("the scene");
        let found = sampled("elastic 666", w, 10.0, 1, |_| 0.0);
        at_most(found.energy, 1e-15, &format!("elastic 666, h = {dt}: mean squared error [J^2]"));
        at_most(found.overlap, 1e-20, &format!("elastic 666, h = {dt}: overlap [m^2]"));
    }
}

/// SimBenchmark's soft cube of 216 balls at every step length. Twin:
/// `a_cube_of_elastic_balls_keeps_its_energy_and_never_overlaps`.
#[test]
#[ignore = "long: SimBenchmark's 666"]
fn simbenchmark_lets_216_balls_come_to_rest_without_overlap() {
    for dt in [1e-3, 1e-2, 0.1] {
        let w = simbenchmark::cube(6, 0.101, 0.0, events(dt)).expect("the scene");
        let found = sampled("666", w, 10.0, 1, |_| 0.0);
        at_most(found.overlap, 1e-20, &format!("666, h = {dt}: overlap [m^2]"));
        at_most(found.projection, 1e-6, &format!("666, h = {dt}: projection [1]"));
        at_most(found.gain, 1e-8, &format!("666, h = {dt}: gain in a step [1]"));
    }
}
