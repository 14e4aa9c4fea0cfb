//! Threads share a step's work and change no bit of it (docs/adr/0005): not in what moves, nor in what is told of it. Heaps here
//! are large enough that every stage that is shared has chunks for several workers.

use crate::harness::*;
use carom::{
    BodySpec, ForceField, Geometry, Motion, OnInaccurate, Rotation, Scheme, Settings, SoftSettings,
    SolverKind, StepTimes, World, Wrench,
};

in_plane_and_space!(
    any_number_of_threads_gives_the_same_bits,
    islands_are_solved_on_any_number_of_threads_with_the_same_bits,
    what_sleeps_sleeps_on_any_number_of_threads,
    a_report_tells_the_energy_and_the_momenta_of_the_world,
    threads_may_change_in_the_middle_of_a_run,
    a_step_that_fails_leaves_the_world_as_it_was_on_any_number_of_threads,
    threads_are_no_part_of_snapshots,
    numbers_of_threads_that_cannot_be_are_refused_by_name,
    the_times_of_a_step_are_parts_of_it,
);

/// A heap of blocks and balls that falls in on itself, beside a wall of blocks that stands; a wall that is driven.
fn heap<S: Dimension>(scheme: Scheme, bodies: u32) -> World<S> {
    let dt = 1.0 / 120.0;
    let settings =
        Settings { dt, scheme, on_inaccurate: OnInaccurate::Ignore, iterations: 12, ..Settings::default() };
    let mut w = world::<S>(settings);
    add_floor(&mut w, 0.5, 0.2);
    let driven = BodySpec::kinematic(S::block(0.5, 3.0)).at(S::at(-1.2, 1.5)).moving(S::at(0.4, 0.0));
    add(&mut w, "driven", driven.friction(0.3));
    let mut dice = Dice(5);
    for k in 0..bodies {
        let (row, column) = (k / 20, k % 20);
        let place = S::at(0.52 * f64::from(column), 0.26 + 0.505 * f64::from(row));
        let mut spec = BodySpec::dense(S::block(0.5, 0.5), 800.0);
        if column <= 13 && k % 5 == 0 {
            spec = BodySpec::dense(S::ball(0.25), 900.0).restitution(0.4);
            spec.rolling_friction = 0.001;
        }
        let speed = if column > 13 { 0.0 } else { dice.between(-1.0, 1.0) };
        add(&mut w, &format!("body {k}"), spec.at(place).moving(S::at(speed, 0.0)).friction(0.4));
    }
    w
}

const SCHEMES: [(Scheme, u32, usize); 2] = [(Scheme::SoftStep, 700, 12), (Scheme::FixedStep, 300, 5)];

/// All that a run tells, step by step.
fn told<S: Dimension>(mut w: World<S>, steps: usize) -> (Vec<u64>, Vec<String>, String) {
    let reports = (0..steps).map(|_| format!("{:?}", step(&mut w))).collect();
    let ledger = w.ledger().lines().map(f64::to_bits);
    let mut numbers = bits(&w);
    numbers.extend(ledger);
    (numbers, reports, w.snapshot())
}

/// The same heap on 1, 2, 3, 8 and 32 threads: motion, ledger, reports and snapshot.
pub fn any_number_of_threads_gives_the_same_bits<S: Dimension>() {
    for (scheme, bodies, steps) in SCHEMES {
        let alone = told(heap::<S>(scheme, bodies), steps);
        for threads in [2, 3, 8, 32] {
            let mut w = heap::<S>(scheme, bodies);
            w.set_threads(threads).unwrap();
            assert_eq!(w.threads(), threads);
            let shared = told(w, steps);
            assert!(shared.0 == alone.0, "{scheme:?} on {threads} threads: bits of motion or ledger");
            assert!(shared.1 == alone.1, "{scheme:?} on {threads} threads: reports");
            assert!(shared.2 == alone.2, "{scheme:?} on {threads} threads: snapshots");
        }
    }
}

/// Stacks of blocks beside each other, pushed to and fro at up to a speed \[m/s\].
fn stacks<S: Dimension>(scheme: Scheme, solver: SolverKind, push: f64) -> World<S> {
    let settings = Settings { dt: 1.0 / 200.0, scheme, ..Settings::default() };
    let mut w = world::<S>(Settings { solver: Some(solver), tolerance: 1e-9, ..settings });
    add_floor(&mut w, 0.0, 0.5);
    let mut dice = Dice(7);
    for k in 0..24 {
        for row in 0..3 {
            let place = S::at(1.5 * f64::from(k) + 0.02 * f64::from(row), 0.25 + 0.5 * f64::from(row));
            let spec = BodySpec::dense(S::block(0.5, 0.5), 800.0).at(place).friction(0.5);
            add(
                &mut w,
                &format!("block {row} of {k}"),
                spec.moving(S::at(push * dice.between(-1.0, 1.0), 0.0)),
            );
        }
    }
    w
}

/// Each stack is an island, and a solve has dozens of them: motion, ledger, reports and snapshot.
pub fn islands_are_solved_on_any_number_of_threads_with_the_same_bits<S: Dimension>() {
    let choices = [
        (Scheme::FixedStep, SolverKind::Exact, 0.5, 8),
        (Scheme::FixedStep, SolverKind::Auto, 0.5, 8),
        // those that nothing happens to share a flow
        (Scheme::Events, SolverKind::Exact, 0.0, 8),
    ];
    for (scheme, solver, push, steps) in choices {
        let alone = told(stacks::<S>(scheme, solver, push), steps);
        let islands = |report: &String| report.matches("IslandReport").count();
        assert!(alone.1.iter().map(islands).max() >= Some(20), "{scheme:?} {solver:?}");
        for threads in [2, 8] {
            let mut w = stacks::<S>(scheme, solver, push);
            w.set_threads(threads).unwrap();
            assert!(told(w, steps) == alone, "{scheme:?} {solver:?} on {threads} threads");
        }
    }
}

/// A heap, and blocks that rest beside it and fall asleep; balls wake every third of them.
fn drowsy<S: Dimension>(threads: usize) -> World<S> {
    let mut w = heap::<S>(Scheme::SoftStep, 700);
    let soft = SoftSettings { sleeping: true, sleep_time: 0.04, ..SoftSettings::default() };
    w.set_settings(Settings { soft, ..w.settings().clone() }).expect("in range");
    for k in 0..600 {
        let at = 30.0 + 2.0 * f64::from(k);
        let block = BodySpec::dense(S::block(0.5, 0.5), 800.0).at(S::at(at, 0.25)).friction(0.4);
        add(&mut w, &format!("rests {k}"), block);
        if k % 3 == 0 {
            let ball = BodySpec::dense(S::ball(0.25), 900.0).at(S::at(at, 0.8)).friction(0.4);
            add(&mut w, &format!("falls {k}"), ball);
        }
    }
    w.set_threads(threads).unwrap();
    w
}

/// Blocks fall asleep and wake on any number of threads at the same steps.
pub fn what_sleeps_sleeps_on_any_number_of_threads<S: Dimension>() {
    let mut w = drowsy::<S>(1);
    let counts: Vec<usize> = (0..20).map(|_| step(&mut w).asleep).collect();
    assert!(counts.contains(&600) && counts.contains(&400), "{counts:?}");
    let alone = told(drowsy::<S>(1), 20);
    for threads in [2, 8] {
        assert!(told(drowsy::<S>(threads), 20) == alone, "on {threads} threads");
    }
}

/// What workers book of bodies while they move is, bit by bit, what the world says of itself after the step, whoever sleeps, is
/// driven, is damped or was turned by hand; and rotations have unit length.
pub fn a_report_tells_the_energy_and_the_momenta_of_the_world<S: Dimension>() {
    let mut damped = heap::<S>(Scheme::SoftStep, 300);
    let block = BodySpec::dense(S::block(0.5, 0.5), 800.0).at(S::at(-6.0, 9.0)).spinning(S::turn(3.0));
    add(&mut damped, "damped", BodySpec { linear_damping: 0.3, angular_damping: 0.2, ..block });
    for mut w in
        [drowsy::<S>(1), drowsy::<S>(3), heap(Scheme::SoftStep, 700), damped, heap(Scheme::FixedStep, 300)]
    {
        for k in 0..12 {
            if k == 5 {
                let turned =
                    w.motion_mut().rotation[3].as_slice().iter().map(|x| 1.5 * x).collect::<Vec<_>>();
                w.motion_mut().rotation[3] = S::Rotation::from_slice(&turned).expect("a turn");
            }
            let report = step(&mut w);
            assert_eq!(report.energy, w.energy(), "step {k}");
            assert_eq!(report.momenta, w.momenta(), "step {k}");
            for (i, turn) in w.bodies().motion.rotation.iter().enumerate() {
                let square: f64 = turn.as_slice().iter().map(|x| x * x).sum();
                at_most((square - 1.0).abs(), 4e-16, &format!("step {k}, body {i}: squared length off 1"));
            }
        }
    }
}

/// Another number at every step.
pub fn threads_may_change_in_the_middle_of_a_run<S: Dimension>() {
    for (scheme, bodies, steps) in SCHEMES {
        let (mut one, mut other) = (heap::<S>(scheme, bodies), heap::<S>(scheme, bodies));
        for k in 0..steps {
            other.set_threads([1, 3, 2, 8][k % 4]).unwrap();
            assert_eq!(format!("{:?}", step(&mut one)), format!("{:?}", step(&mut other)));
        }
        assert!(one.snapshot() == other.snapshot(), "{scheme:?}");
    }
}

/// A field that fails, or gives what is no number, when it is asked to.
struct Failing(std::sync::Arc<std::sync::atomic::AtomicBool>);

impl<S: Geometry> ForceField<S> for Failing {
    fn add(&mut self, _: f64, _: &Motion<S>, _: &mut [Wrench<S>]) -> Result<(), String> {
        if self.0.load(std::sync::atomic::Ordering::Relaxed) { Err("asked to fail".into()) } else { Ok(()) }
    }
}

/// The step after a failed one is the one that would have been taken.
pub fn a_step_that_fails_leaves_the_world_as_it_was_on_any_number_of_threads<S: Dimension>() {
    for (scheme, bodies, steps) in SCHEMES {
        let mut told = Vec::new();
        for threads in [1, 2, 8] {
            let mut w = heap::<S>(scheme, bodies);
            w.set_threads(threads).unwrap();
            let fails = std::sync::Arc::default();
            w.set_force_field("failing", Box::new(Failing(std::sync::Arc::clone(&fails))));
            for k in 0..steps {
                step(&mut w);
                let before = w.snapshot();
                fails.store(true, std::sync::atomic::Ordering::Relaxed);
                assert!(w.step(w.settings().dt).is_err(), "{scheme:?}, step {k}");
                fails.store(false, std::sync::atomic::Ordering::Relaxed);
                assert!(w.snapshot() == before, "{scheme:?} on {threads} threads, step {k}");
            }
            told.push(w.snapshot());
        }
        assert!(told.iter().all(|t| *t == told[0]), "{scheme:?}");
    }
}

/// A restored world has one thread, and goes on as the one it is of.
pub fn threads_are_no_part_of_snapshots<S: Dimension>() {
    let mut w = heap::<S>(Scheme::SoftStep, 100);
    let alone = w.snapshot();
    w.set_threads(2).unwrap();
    assert!(w.snapshot() == alone);
    let (mut other, _) = World::<S>::from_snapshot(&alone).unwrap();
    assert_eq!(other.threads(), 1);
    other.share_threads(&w);
    assert_eq!(other.threads(), 2);
    assert_eq!(format!("{:?}", step(&mut w)), format!("{:?}", step(&mut other)));
}

/// Field, value and remedy; the threads that there were stay.
pub fn numbers_of_threads_that_cannot_be_are_refused_by_name<S: Dimension>() {
    let mut w = heap::<S>(Scheme::SoftStep, 1);
    w.set_threads(3).unwrap();
    for threads in [0, 257, usize::MAX] {
        let e = w.set_threads(threads).unwrap_err();
        assert_eq!(e.field, "threads");
        let text = e.to_string();
        assert!(
            text.contains(&format!("must be 1 to 256, got {threads}")) && text.contains("cores"),
            "{text}"
        );
        assert_eq!(w.threads(), 3);
    }
}

/// The parts of a step's time are no less than nothing and no more than the call took; a step that fails leaves those of the
/// step before.
pub fn the_times_of_a_step_are_parts_of_it<S: Dimension>() {
    for (scheme, bodies) in [(Scheme::SoftStep, 300), (Scheme::FixedStep, 100), (Scheme::Events, 30)] {
        let mut w = heap::<S>(scheme, bodies);
        assert_eq!(w.step_times(), StepTimes::default());
        for k in 0..4 {
            let begun = std::time::Instant::now();
            step(&mut w);
            let (all, told) = (begun.elapsed().as_secs_f64(), w.step_times());
            let StepTimes { pairs, contacts, solve, rest } = told;
            assert!(told.whole() <= all, "{scheme:?}, step {k}: {told:?} of {all} s");
            assert!(
                pairs >= 0.0 && contacts >= 0.0 && rest >= 0.0 && solve > 0.0,
                "{scheme:?}, step {k}: {told:?}"
            );
            assert!(
                scheme == Scheme::Events || (pairs > 0.0 && contacts > 0.0),
                "{scheme:?}, step {k}: {told:?}"
            );
        }
        let before = w.step_times();
        w.apply_wrench(1, Wrench { force: S::at(f64::NAN, 0.0), torque: Default::default() });
        assert!(w.step(w.settings().dt).is_err());
        assert_eq!(w.step_times(), before);
    }
}
