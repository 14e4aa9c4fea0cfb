//! Sleep in soft steps: what rests falls asleep with closed books, only that, and costs nothing; whatever stirs it wakes it,
//! with the forces that it had; who sleeps is part of the state.

use crate::harness::*;
use carom::{
    BodyKind, BodySpec, Column, LedgerGroup, MaterialPair, OnInaccurate, Scheme, Settings, SoftSettings,
    World, Wrench,
};

in_plane_and_space!(
    a_stack_falls_asleep_where_it_is_and_its_books_close,
    what_sleeps_is_held_and_is_in_no_contact,
    a_stack_falls_asleep_beside_one_that_has_not_rested,
    whatever_stirs_a_stack_wakes_it_and_no_other,
    whatever_may_move_everything_wakes_everything,
    a_stack_that_wakes_stands_as_if_it_had_not_slept,
    a_ball_that_falls_on_a_stack_wakes_it_in_time,
    what_goes_on_moving_however_slowly_stays_awake,
    what_floats_stays_awake,
    what_a_moving_obstacle_bears_stays_awake,
    an_obstacle_that_begins_to_move_wakes_what_it_bears,
    an_obstacle_that_is_taken_away_lets_fall_what_slept_on_it,
    nothing_sleeps_where_a_force_field_acts,
    groups_share_what_sleep_takes,
    a_snapshot_of_sleepers_continues_the_trajectory_bit_for_bit,
    a_step_that_is_refused_wakes_nobody,
    a_snapshot_knows_what_was_written_to_sleepers_and_what_bears_them,
    an_obstacle_that_is_stopped_and_put_into_a_sleeper_wakes_it,
    a_look_ahead_wakes_nobody,
    sleep_is_not_asked_for_by_default,
    a_row_that_touches_sleeps_together,
);

/// The copy hung asleep in mid-air: it took the written place for the one that the step had left.
pub fn a_snapshot_knows_what_was_written_to_sleepers_and_what_bears_them<S: Dimension>() {
    for moved in ["block", "floor"] {
        let mut w = world::<S>(drowsy());
        add(&mut w, "floor", BodySpec::fixed(S::block(10.0, 1.0)).at(S::at(0.0, -0.5)).friction(0.6));
        add(&mut w, "block", BodySpec::heavy(S::block(1.0, 1.0), 2.0).at(S::at(0.0, 0.5)).friction(0.6));
        settle(&mut w, 3.0);
        assert_eq!(w.bodies().asleep(), [1]);
        let i = usize::from(moved == "block");
        w.motion_mut().position[i] = S::at(0.0, if i == 1 { 3.5 } else { -50.0 });
        let (mut copy, _) = World::<S>::from_snapshot(&w.snapshot()).expect("a snapshot");
        settle(&mut w, 0.5);
        settle(&mut copy, 0.5);
        assert!(w.bodies().asleep().is_empty(), "{moved}: it fell");
        assert!(
            copy.bodies().motion.position[1] == w.bodies().motion.position[1],
            "{moved}: so did the copy"
        );
    }
}

/// A gate that drove to its end and was put into its place.
pub fn an_obstacle_that_is_stopped_and_put_into_a_sleeper_wakes_it<S: Dimension>() {
    let mut w = world::<S>(drowsy());
    add_floor(&mut w, 0.6, 0.0);
    let block =
        add(&mut w, "block", BodySpec::heavy(S::block(1.0, 1.0), 2.0).at(S::at(0.0, 0.5)).friction(0.6));
    let gate = BodySpec { kind: BodyKind::Kinematic, ..BodySpec::fixed(S::block(1.0, 1.0)) };
    let gate = add(&mut w, "gate", gate.at(S::at(-20.0, 0.5)).moving(S::at(1.0, 0.0)).friction(0.6));
    settle(&mut w, 2.0);
    assert_eq!(w.bodies().asleep().len(), 1);
    w.motion_mut().velocity[gate] = S::Vector::ZERO;
    w.motion_mut().position[gate] = S::at(-0.7, 0.5);
    settle(&mut w, 1.0);
    assert!(S::along(w.bodies().motion.position[block]) > 0.25, "it was pushed out");
}

/// Settings of the scheme with sleep.
fn drowsy<S: Dimension>() -> Settings<S> {
    Settings {
        dt: 1.0 / 60.0,
        scheme: Scheme::SoftStep,
        on_inaccurate: OnInaccurate::Ignore,
        tolerance: 1e-300,
        soft: SoftSettings { sleeping: true, ..SoftSettings::default() },
        ..Settings::default()
    }
}

/// Three blocks of 1 m on each other, `at` so far along the floor.
fn add_stack<S: Dimension>(w: &mut World<S>, name: &str, at: f64) -> Vec<usize> {
    let block =
        |k: usize| BodySpec::heavy(S::block(1.0, 1.0), 2.0).at(S::at(at, 0.5 + k as f64)).friction(0.6);
    (0..3).map(|k| add(w, &format!("{name} {k}"), block(k))).collect()
}

/// A floor and two stacks on it.
fn two_stacks<S: Dimension>() -> (World<S>, Vec<usize>, Vec<usize>) {
    let mut w = world::<S>(drowsy());
    add_floor(&mut w, 0.6, 0.0);
    let (one, other) = (add_stack(&mut w, "one", 0.0), add_stack(&mut w, "other", 3.0));
    (w, one, other)
}

/// The same, asleep.
fn asleep<S: Dimension>() -> (World<S>, Vec<usize>, Vec<usize>) {
    let (mut w, one, other) = two_stacks::<S>();
    settle(&mut w, 3.0);
    assert_eq!(w.bodies().asleep().len(), 6, "after 3 s all blocks sleep");
    (w, one, other)
}

fn sleep<S: Dimension>(w: &World<S>, bodies: &[usize]) -> usize {
    bodies.iter().filter(|i| w.bodies().is_asleep(**i)).count()
}

/// Kinetic energy that is taken is booked, and is what f32 leaves of rest.
pub fn a_stack_falls_asleep_where_it_is_and_its_books_close<S: Dimension>() {
    let (mut w, ..) = two_stacks::<S>();
    let weight = 12.0 * G;
    let mut fell = 0;
    run(&mut w, 3.0, |w, r| {
        at_most(r.ledger.closure.abs(), 1e-6 * weight, "closure of a step [J]");
        fell += usize::from(r.ledger.sleep != 0.0);
        assert_eq!(r.asleep, w.bodies().asleep().len());
        for i in w.bodies().asleep() {
            assert_eq!(w.bodies().motion.velocity[*i as usize], S::Vector::ZERO);
        }
    });
    assert!((1..=2).contains(&fell), "each stack falls asleep once, and stays");
    assert!(w.ledger().sleep < 0.0, "sleep takes what is left of motion");
    at_most(-w.ledger().sleep, 1e-6 * weight, "energy that sleep took [J]");
    at_most(w.ledger().closure.abs(), 1e-6 * weight, "closure of the run [J]");
    assert_eq!(w.energy().kinetic(), 0.0);
}

pub fn what_sleeps_is_held_and_is_in_no_contact<S: Dimension>() {
    let (mut w, ..) = asleep::<S>();
    let (before, energy) = (bits(&w), w.energy().total());
    run(&mut w, 2.0, |_, r| {
        assert_eq!((r.contacts, r.asleep), (0, 6));
        assert_eq!(r.residual(), 0.0);
        // a sum in another order is another rounding
        close(r.energy.total(), energy, 1e-13 * energy, "energy [J]");
        assert_eq!(r.ledger.closure, 0.0);
    });
    assert_eq!(bits(&w), before);
}

/// Each island has its own time: the one that was pushed stays awake as long as any of its blocks has not rested.
pub fn a_stack_falls_asleep_beside_one_that_has_not_rested<S: Dimension>() {
    let (mut w, one, other) = two_stacks::<S>();
    settle(&mut w, 0.3);
    other.iter().for_each(|i| w.motion_mut().velocity[*i] = S::at(0.5, 0.0));
    let mut alone = 0;
    run(&mut w, 3.0, |w, _| {
        let (one, other) = (sleep(w, &one), sleep(w, &other));
        assert!([(0, 0), (3, 0), (3, 3)].contains(&(one, other)), "asleep: {one} and {other}");
        alone += usize::from((one, other) == (3, 0));
    });
    assert!(alone >= 10, "{alone} steps");
    assert_eq!(sleep(&w, &other), 3, "it rests in its turn");
}

pub fn whatever_stirs_a_stack_wakes_it_and_no_other<S: Dimension>() {
    type Stir<S> = fn(&mut World<S>, usize);
    let stirs: [(&str, Stir<S>); 5] = [
        ("a velocity", |w, i| w.motion_mut().velocity[i] = S::at(0.01, 0.0)),
        ("a place", |w, i| w.motion_mut().position[i] += S::at(0.001, 0.0)),
        ("an impulse", |w, i| w.apply_impulse(i, S::at(0.1, 0.0), w.bodies().motion.position[i])),
        ("a force", |w, i| w.apply_wrench(i, Wrench { force: S::at(1.0, 0.0), torque: S::Spin::ZERO })),
        ("a call", |w, i| assert!(w.wake(i))),
    ];
    for (what, stir) in stirs {
        let (mut w, one, other) = asleep::<S>();
        stir(&mut w, one[1]);
        let report = step(&mut w);
        assert_eq!((sleep(&w, &one), sleep(&w, &other)), (0, 3), "{what}");
        assert!(report.contacts >= 3 * S::DIM, "{what}: its contacts are looked for");
        at_most(report.ledger.closure.abs(), 1e-4, "closure of the step [J]");
        settle(&mut w, 4.0);
        assert_eq!(w.bodies().asleep().len(), 6, "{what}: and it falls asleep again");
    }
}

pub fn whatever_may_move_everything_wakes_everything<S: Dimension>() {
    type Stir<S> = fn(&mut World<S>);
    let stirs: [(&str, Stir<S>); 6] = [
        ("an obstacle that is put among them", |w| {
            let wall = BodySpec::fixed(S::block(1.0, 1.0)).at(S::at(1.2, 0.5));
            add(w, "wall", wall);
        }),
        ("gravity", |w| {
            let settings = Settings { gravity: S::at(1.0, -9.0), ..w.settings().clone() };
            w.set_settings(settings).expect("in range");
        }),
        ("a pair's friction", |w| {
            let pair = MaterialPair { friction: Some(0.1), ..MaterialPair::default() };
            w.set_pair("wood", "wood", pair).expect("a block's material");
        }),
        ("coefficients", |w| w.bodies_mut().data[1].friction = 0.1),
        ("a body that is taken out", |w| w.remove("one 2").expect("is there")),
        ("another scheme", |w| {
            let settings = Settings { scheme: Scheme::FixedStep, ..w.settings().clone() };
            w.set_settings(settings).expect("in range");
        }),
    ];
    for (what, stir) in stirs {
        let mut w = world::<S>(drowsy());
        add_floor(&mut w, 0.6, 0.0);
        add_stack(&mut w, "one", 0.0);
        let block = BodySpec::heavy(S::block(1.0, 1.0), 2.0).at(S::at(3.0, 0.5)).friction(0.6);
        add(&mut w, "block", block.material("wood"));
        settle(&mut w, 3.0);
        assert_eq!(w.bodies().asleep().len(), 4);
        stir(&mut w);
        step(&mut w);
        assert_eq!(w.bodies().asleep().len(), 0, "{what}");
    }
}

/// The forces come back with the stack: it goes on sinking to where one that never slept has come to rest by now.
pub fn a_stack_that_wakes_stands_as_if_it_had_not_slept<S: Dimension>() {
    let (mut w, one, _) = asleep::<S>();
    let mut twin = world::<S>(Settings { soft: SoftSettings::default(), ..drowsy() });
    add_floor(&mut twin, 0.6, 0.0);
    add_stack(&mut twin, "one", 0.0);
    settle(&mut twin, 3.0);
    let slept: Vec<f64> = one.iter().map(|i| height(&w, *i)).collect();
    w.wake(one[0]);
    for k in 0..60 {
        step(&mut w);
        for (i, slept) in one.iter().zip(&slept) {
            // a step without forces would give g dt, and a fall of g dt^2 = 2.7e-3 m
            let speed = w.bodies().motion.velocity[*i].norm();
            at_most(speed, 0.01 * G / 60.0, &format!("speed in step {k} [m/s]"));
            at_most(height(&twin, *i) - height(&w, *i), 1e-6, "below the one that never slept [m]");
            at_most(height(&w, *i) - slept, 1e-6, "above where it slept [m]");
        }
    }
    let top = one[2];
    at_most(height(&w, top) - height(&twin, top), 0.5 * (slept[2] - height(&twin, top)), "left to sink [m]");
}

/// The ball does not sink into what slept.
pub fn a_ball_that_falls_on_a_stack_wakes_it_in_time<S: Dimension>() {
    let (mut w, one, other) = asleep::<S>();
    let ball = BodySpec::heavy(S::ball(0.3), 1.0).at(S::at(0.1, 5.0)).friction(0.6);
    add(&mut w, "ball", ball);
    step(&mut w);
    assert_eq!(w.bodies().asleep().len(), 6, "a body that is added far away wakes nobody");
    let mut woke = false;
    let mut deepest: f64 = 0.0;
    run(&mut w, 4.0, |w, r| {
        woke |= sleep(w, &one) == 0;
        deepest = deepest.min(r.deepest.map_or(0.0, |d| d.0));
    });
    assert!(woke);
    assert_eq!(sleep(&w, &other), 3);
    at_most(-deepest, 0.01, "overlap [m]");
}

/// At less than the sleeping speed in no step, but on and on: sliding without friction, turning, creeping up.
pub fn what_goes_on_moving_however_slowly_stays_awake<S: Dimension>() {
    let mut w = world::<S>(drowsy());
    add_floor(&mut w, 0.0, 0.0);
    let speed = 2.0 * w.settings().soft.sleep_speed;
    let block = BodySpec::heavy(S::block(1.0, 1.0), 2.0).at(S::at(0.0, 0.5)).friction(0.0);
    let slides = add(&mut w, "slides", block.moving(S::at(speed, 0.0)));
    let ball = BodySpec::heavy(S::ball(0.5), 2.0).at(S::at(9.0, 0.5)).friction(0.0);
    let ball = BodySpec { angular_velocity: S::turn(4.0 * speed), ..ball };
    let turns = add(&mut w, "turns", ball);
    settle(&mut w, 5.0);
    assert_eq!(w.bodies().asleep().len(), 0);
    close(S::along(w.bodies().motion.position[slides]), 5.0 * speed, 1e-5, "way [m]");
    close(S::rate(w.bodies().motion.angular_velocity[turns]), 4.0 * speed, 1e-5, "rate [rad/s]");
}

pub fn what_floats_stays_awake<S: Dimension>() {
    let mut w = world::<S>(Settings { gravity: S::Vector::ZERO, ..drowsy() });
    let block = |at: f64| BodySpec::heavy(S::block(1.0, 1.0), 2.0).at(S::at(at, 0.5));
    let drift = S::at(1e-4, 0.0);
    let one = add(&mut w, "one", block(0.0).moving(drift));
    add(&mut w, "other", block(1.0).moving(drift));
    settle(&mut w, 3.0);
    assert_eq!(w.bodies().asleep().len(), 0);
    close(S::along(w.bodies().motion.velocity[one]), 1e-4, 1e-10, "speed [m/s]");
}

/// A floor that moves along, and a block on it.
fn on_a_belt<S: Dimension>(speed: f64) -> (World<S>, usize, usize) {
    let mut w = world::<S>(drowsy());
    let belt = BodySpec { kind: BodyKind::Kinematic, ..BodySpec::fixed(S::block(40.0, 1.0)) };
    let belt = add(&mut w, "belt", belt.at(S::at(0.0, -0.5)).moving(S::at(speed, 0.0)).friction(0.6));
    let block = BodySpec::heavy(S::block(1.0, 1.0), 2.0).at(S::at(0.0, 0.5)).friction(0.6);
    let block = add(&mut w, "block", block.moving(S::at(speed, 0.0)));
    settle(&mut w, 3.0);
    (w, belt, block)
}

pub fn what_a_moving_obstacle_bears_stays_awake<S: Dimension>() {
    let (w, _, block) = on_a_belt::<S>(1e-3);
    assert!(!w.bodies().is_asleep(block));
    close(speed(&w, block), 1e-3, 1e-6, "speed [m/s]");
}

pub fn an_obstacle_that_begins_to_move_wakes_what_it_bears<S: Dimension>() {
    let (mut w, belt, block) = on_a_belt::<S>(0.0);
    assert!(w.bodies().is_asleep(block), "what rests on a belt that rests sleeps");
    w.motion_mut().velocity[belt] = S::at(0.5, 0.0);
    settle(&mut w, 1.0);
    assert!(!w.bodies().is_asleep(block));
    close(speed(&w, block), 0.5, 1e-3, "speed [m/s]");
}

pub fn an_obstacle_that_is_taken_away_lets_fall_what_slept_on_it<S: Dimension>() {
    for removed in [true, false] {
        let (mut w, belt, block) = on_a_belt::<S>(0.0);
        if removed {
            w.remove("belt").expect("is there");
        } else {
            w.motion_mut().position[belt] = S::at(0.0, -50.0);
        }
        settle(&mut w, 0.5);
        let block = if removed { block - 1 } else { block };
        at_most(height(&w, block), 0.5 - 0.4 * G * 0.25, "height after half a second [m]");
    }
}

pub fn nothing_sleeps_where_a_force_field_acts<S: Dimension>() {
    let (mut w, ..) = asleep::<S>();
    w.set_force_field("nothing yet", Box::new(Nothing));
    settle(&mut w, 2.0);
    assert_eq!(w.bodies().asleep().len(), 0);
    w.remove_force_field("nothing yet");
    settle(&mut w, 1.0);
    assert_eq!(w.bodies().asleep().len(), 6);
}

struct Nothing;

impl<S: Dimension> carom::ForceField<S> for Nothing {
    fn add(&mut self, _: f64, _: &carom::Motion<S>, _: &mut [Wrench<S>]) -> Result<(), String> {
        Ok(())
    }
}

/// Momentum too: what sleepers had left goes on a line of its own.
pub fn groups_share_what_sleep_takes<S: Dimension>() {
    let (mut w, ..) = two_stacks::<S>();
    let names = |name: &str| Some((0..3).map(|k| format!("{name} {k}")).collect());
    let group = |name: &str| LedgerGroup { name: name.into(), bodies: names(name) };
    w.set_ledger_groups(vec![group("one"), group("other")]).expect("the groups are there");
    let weight = 6.0 * G;
    run(&mut w, 4.0, |_, r| {
        for group in &r.groups {
            at_most(group.ledger.closure.abs(), 1e-5 * weight, "closure of a group's energy [J]");
            at_most(group.momentum.closure.norm(), 1e-5 * weight, "closure of its momentum [kg m/s]");
        }
        let sleep: f64 = r.groups.iter().map(|g| g.ledger.sleep).sum();
        close(sleep, r.ledger.sleep, 1e-12, "what sleep took [J]");
    });
    assert_eq!(w.bodies().asleep().len(), 6);
    for group in w.group_ledgers() {
        assert!(group.ledger.sleep < 0.0);
        at_most(group.momentum.closure.norm(), 1e-4 * weight, "closure of the run's momentum [kg m/s]");
    }
}

/// Before, while and after it sleeps.
pub fn a_snapshot_of_sleepers_continues_the_trajectory_bit_for_bit<S: Dimension>() {
    let (mut w, one, _) = two_stacks::<S>();
    for round in 0..6 {
        let text = w.snapshot();
        let (mut again, _) = World::<S>::from_snapshot(&text).expect("its own snapshot");
        assert_eq!(again.snapshot(), text);
        assert_eq!(again.bodies().asleep(), w.bodies().asleep());
        for world in [&mut w, &mut again] {
            if round == 4 {
                assert_eq!(world.bodies().asleep().len(), 6);
                world.apply_impulse(one[0], S::at(1.0, 0.0), S::at(0.0, 0.5));
            }
            settle(world, 0.5);
        }
        assert_eq!(again.snapshot(), w.snapshot());
    }
    assert!(w.ledger().sleep < 0.0);
}

/// A ball comes near in a step that then fails: the stack sleeps on, and the next step goes as if there had been none.
pub fn a_step_that_is_refused_wakes_nobody<S: Dimension>() {
    let (mut w, one, _) = asleep::<S>();
    let ball = BodySpec::heavy(S::ball(0.3), 1.0).at(S::at(0.0, 3.4)).moving(S::at(0.0, -3.0));
    add(&mut w, "ball", ball);
    let (mut twin, _) = World::<S>::from_snapshot(&w.snapshot()).expect("its own snapshot");
    // settings that are set wake what sleeps; those of a snapshot are as they were
    let text = w.snapshot().replace("\"on_inaccurate\":\"ignore\"", "\"on_inaccurate\":\"raise\"");
    let (mut w, _) = World::<S>::from_snapshot(&text).expect("its own snapshot");
    assert_eq!(w.settings().on_inaccurate, OnInaccurate::Raise);
    let before = w.snapshot();
    for _ in 0..3 {
        w.step(1.0 / 60.0).expect_err("the ball is within reach of the stack");
        assert_eq!(sleep(&w, &one), 3, "who slept before the step sleeps");
        assert_eq!(w.snapshot(), before);
    }
    step(&mut twin);
    assert_eq!(sleep(&twin, &one), 0);
    // nor does one that is refused before it begins, whatever waits for it
    let (mut w, one, _) = asleep::<S>();
    w.apply_wrench(one[0], Wrench { force: S::at(0.0, 5.0), torque: S::Spin::ZERO });
    w.step(-1.0).expect_err("no step length");
    assert_eq!(sleep(&w, &one), 3);
}

pub fn a_look_ahead_wakes_nobody<S: Dimension>() {
    let (mut w, one, _) = asleep::<S>();
    let ball = BodySpec::heavy(S::ball(0.3), 1.0).at(S::at(0.0, 3.4)).moving(S::at(0.0, -3.0));
    add(&mut w, "ball", ball);
    let before = w.snapshot();
    let problem = w.problem(1.0 / 60.0, carom::Phase::Contact).expect("a problem");
    assert!(!problem.contacts.is_empty());
    assert_eq!(sleep(&w, &one), 3);
    assert_eq!(w.snapshot(), before);
    step(&mut w);
    assert_eq!(sleep(&w, &one), 0);
}

pub fn sleep_is_not_asked_for_by_default<S: Dimension>() {
    let settings = Settings { soft: SoftSettings::default(), ..drowsy() };
    let mut w = world::<S>(settings);
    add_floor(&mut w, 0.6, 0.0);
    add_stack(&mut w, "one", 0.0);
    settle(&mut w, 3.0);
    assert_eq!(w.bodies().asleep().len(), 0);
    assert_eq!(w.ledger().sleep, 0.0);
}

/// One island, however long: it sleeps when its last body rests, and a push at one end wakes the other.
pub fn a_row_that_touches_sleeps_together<S: Dimension>() {
    let mut w = world::<S>(drowsy());
    add_floor(&mut w, 0.6, 0.0);
    let block = |k: usize| BodySpec::heavy(S::block(1.0, 1.0), 2.0).at(S::at(k as f64, 0.5)).friction(0.6);
    let row: Vec<usize> = (0..10).map(|k| add(&mut w, &format!("block {k}"), block(k))).collect();
    let mut counts = Vec::new();
    run(&mut w, 3.0, |w, _| counts.push(w.bodies().asleep().len()));
    counts.dedup();
    assert_eq!(counts, [0, 10]);
    w.apply_impulse(row[0], S::at(0.2, 0.0), S::at(0.0, 0.5));
    step(&mut w);
    assert_eq!(w.bodies().asleep().len(), 0);
}
