//! `soft_step` with a solver: rigid contacts, swept in lanes of f32 as often as is asked for (theory 11.10). What soft steps keep
//! they keep too, and stand where springs sag.

use crate::harness::*;
use crate::laws::soft_step::{stack, two_balls_keep_their_momentum};
use carom::{BodySpec, Column, OnInaccurate, Scheme, Settings, SoftSettings, SolverKind, World};

in_plane_and_space!(
    a_stack_of_rigid_contacts_stands_where_springs_sag,
    rigid_contacts_bear_the_weight_of_what_stands_on_them,
    a_block_on_rigid_contacts_slides_as_far_as_coulomb_says,
    balls_that_meet_rigidly_keep_their_momentum,
    a_ball_on_rigid_contacts_is_stopped_by_its_rolling_friction,
    an_overlap_goes_without_throwing_anything_apart,
    conjugate_directions_come_nearer_in_as_many_sweeps,
    rigid_sweeps_have_the_same_bits_on_any_number_of_threads,
    a_snapshot_continues_rigid_sweeps_bit_for_bit,
    sweeps_that_cannot_be_planned_are_refused_by_name,
);

const SWEPT: [SolverKind; 2] = [SolverKind::Pgs, SolverKind::Nncg];

/// One substep of so many sweeps before the bodies move, and as many after.
fn rigid<S: Dimension>(solver: SolverKind, iterations: usize, dt: f64) -> Settings<S> {
    Settings {
        dt,
        scheme: Scheme::SoftStep,
        solver: Some(solver),
        iterations,
        soft: SoftSettings { substeps: 1, ..SoftSettings::default() },
        on_inaccurate: OnInaccurate::Ignore,
        ..Settings::default()
    }
}

/// A wall of blocks.
fn pyramid<S: Dimension>(settings: Settings<S>, base: usize) -> World<S> {
    let mut w = world::<S>(settings);
    add_floor(&mut w, 0.6, 0.0);
    for row in 0..base {
        for k in 0..base - row {
            let at = S::at(k as f64 + 0.5 * row as f64, 0.5 + row as f64);
            let block = BodySpec::heavy(S::block(1.0, 1.0), 1.0).at(at).friction(0.6);
            add(&mut w, &format!("block {row} {k}"), block);
        }
    }
    w
}

/// Ten blocks for 6 s: the sweeps leave each contact no deeper than the overlap that is left alone, of g dt^2 / 4, and a quarter
/// more; springs sink to more than that. What sweeps have not evened out creeps: along conjugate directions a third of them do. Books close to f32's rounding of what goes through them.
pub fn a_stack_of_rigid_contacts_stands_where_springs_sag<S: Dimension>() {
    let dt = 1.0 / 60.0;
    let slop = 0.25 * G * dt * dt;
    for (solver, sweeps) in [(SolverKind::Pgs, 60), (SolverKind::Nncg, 20)] {
        let mut w = stack::<S>(rigid(solver, sweeps, dt), &[2.0; 10]);
        let weight = 20.0 * G;
        run(&mut w, 6.0, |_, r| at_most(r.ledger.closure.abs(), 1e-6 * weight, "closure of a step [J]"));
        for k in 0..10 {
            let sunk = 0.5 + k as f64 - height(&w, k + 1);
            at_most(sunk, 1.25 * slop * (k + 1) as f64, &format!("{solver:?}: block {k} sank by [m]"));
            at_most(w.bodies().motion.velocity[k + 1].norm(), 2e-3, "speed [m/s]");
        }
        at_most(w.ledger().closure.abs(), 1e-6 * weight, "closure of the run [J]");
    }
    let springs = Settings { solver: None, soft: SoftSettings::default(), ..rigid(SolverKind::Pgs, 20, dt) };
    let mut w = stack::<S>(springs, &[2.0; 10]);
    settle(&mut w, 6.0);
    assert!(9.5 - height(&w, 10) > 1.25 * slop * 10.0, "{}", 9.5 - height(&w, 10));
}

/// Contact forces as users read them.
pub fn rigid_contacts_bear_the_weight_of_what_stands_on_them<S: Dimension>() {
    for solver in SWEPT {
        let mut w = stack::<S>(rigid(solver, 10, 1.0 / 60.0), &[2.0, 3.0]);
        settle(&mut w, 3.0);
        close(normal_force(&w, 0, 1), 5.0 * G, 1e-4 * 5.0 * G, "force of the floor [N]");
        close(normal_force(&w, 1, 2), 3.0 * G, 1e-4 * 3.0 * G, "force between the blocks [N]");
    }
}

/// v^2 / (2 mu g), to the steps' first order.
pub fn a_block_on_rigid_contacts_slides_as_far_as_coulomb_says<S: Dimension>() {
    let (mu, v0) = (0.5, 3.0);
    for solver in SWEPT {
        let mut w = world::<S>(rigid(solver, 8, 1.0 / 240.0));
        add_floor(&mut w, mu, 0.0);
        let block = BodySpec::heavy(S::block(1.0, 0.2), 2.0).at(S::at(0.0, 0.1)).moving(S::at(v0, 0.0));
        let block = add(&mut w, "block", block.friction(mu));
        settle(&mut w, 1.0);
        let way = v0 * v0 / (2.0 * mu * G);
        close(S::along(w.bodies().motion.position[block]), way, 0.01 * way, "way [m]");
        at_most(speed(&w, block).abs(), 1e-5, "speed at rest [m/s]");
        close(w.ledger().friction, -0.5 * 2.0 * v0 * v0, 0.01 * v0 * v0, "work of friction [J]");
    }
}

/// An oblique collision with friction.
pub fn balls_that_meet_rigidly_keep_their_momentum<S: Dimension>() {
    for solver in SWEPT {
        two_balls_keep_their_momentum::<S>(rigid(solver, 8, 1.0 / 240.0));
    }
}

/// a = c g / (R (1 + k)): its moments are led on with the other impulses.
pub fn a_ball_on_rigid_contacts_is_stopped_by_its_rolling_friction<S: Dimension>() {
    let (radius, c, v0) = (0.3, 0.01, 0.5);
    for solver in SWEPT {
        let mut w = world::<S>(rigid(solver, 8, 1.0 / 240.0));
        add_floor(&mut w, 0.8, 0.0);
        let ball = BodySpec::heavy(S::ball(radius), 2.0).at(S::at(0.0, radius)).friction(0.8);
        let ball = ball.moving(S::at(v0, 0.0)).spinning(S::turn(-v0 / radius)).resisting(c, 0.0);
        let ball = add(&mut w, "ball", ball);
        let a = c * G / (radius * (1.0 + S::ROUNDNESS));
        run(&mut w, 1.5 * v0 / a, |_, _| {});
        let way = S::along(w.bodies().motion.position[ball]);
        close(way, v0 * v0 / (2.0 * a), 0.02 * way, "way [m]");
        at_most(speed(&w, ball).abs(), 1e-4, "speed at rest [m/s]");
    }
}

/// A block a tenth deep in the floor rises by a share of that in each step, and what lifts it is taken back: it never flies.
pub fn an_overlap_goes_without_throwing_anything_apart<S: Dimension>() {
    for solver in SWEPT {
        let mut w = world::<S>(rigid(solver, 10, 1.0 / 60.0));
        add_floor(&mut w, 0.6, 0.0);
        let block = add(&mut w, "block", BodySpec::heavy(S::block(1.0, 1.0), 2.0).at(S::at(0.0, 0.4)));
        run(&mut w, 3.0, |w, _| {
            at_most(S::up(w.bodies().motion.velocity[block]), 1e-3, "speed upwards [m/s]")
        });
        close(height(&w, block), 0.5, 1e-3, "height [m]");
    }
}

/// From no forces, in one step of a wall.
pub fn conjugate_directions_come_nearer_in_as_many_sweeps<S: Dimension>() {
    let changed = |solver| {
        let mut w = pyramid::<S>(rigid(solver, 30, 1.0 / 60.0), 10);
        w.step(1.0 / 60.0).expect("a step").contact_solve.expect("contacts").residual
    };
    let [swept, led] = SWEPT.map(changed);
    assert!(led < 0.5 * swept, "{led} m/s with directions, {swept} m/s without");
}

/// Directions lead by one number, which hangs on all packs.
pub fn rigid_sweeps_have_the_same_bits_on_any_number_of_threads<S: Dimension>() {
    for solver in SWEPT {
        let run = |threads: usize| {
            let mut w = pyramid::<S>(rigid(solver, 6, 1.0 / 60.0), 40);
            w.set_threads(threads).expect("threads");
            for _ in 0..8 {
                step(&mut w);
            }
            bits(&w)
        };
        let alone = run(1);
        assert!(alone == run(2) && alone == run(5));
    }
}

/// In the middle of a collapse.
pub fn a_snapshot_continues_rigid_sweeps_bit_for_bit<S: Dimension>() {
    for solver in SWEPT {
        let mut w = stack::<S>(rigid(solver, 6, 1.0 / 60.0), &[1.0, 2.0, 1.0, 3.0]);
        w.motion_mut().velocity[3] = S::at(2.0, 0.5);
        for _ in 0..30 {
            step(&mut w);
        }
        let (mut other, _) = World::<S>::from_snapshot(&w.snapshot()).expect("a snapshot");
        for _ in 0..60 {
            step(&mut w);
            step(&mut other);
            assert!(bits(&w) == bits(&other));
        }
    }
}

/// All sweeps are planned beforehand, so their number is bounded; a report tells it.
pub fn sweeps_that_cannot_be_planned_are_refused_by_name<S: Dimension>() {
    let refused = rigid::<S>(SolverKind::Pgs, 1001, 0.01).check().expect_err("sweeps").to_string();
    assert!(refused.contains("iterations") && refused.contains("soft_step"), "{refused}");
    let refused = rigid::<S>(SolverKind::Apgd, 10, 0.01).check().expect_err("a solver").to_string();
    assert!(refused.contains("apgd") && refused.contains("nncg"), "{refused}");
    let mut w = stack::<S>(rigid(SolverKind::Nncg, 7, 1.0 / 60.0), &[1.0]);
    let report = w.step(1.0 / 60.0).expect("a step");
    assert_eq!(report.contact_solve.expect("contacts").iterations, 14);
}
