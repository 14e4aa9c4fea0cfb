//! Slips that are asked for (theory eq. 3.19): Coulomb's law for u_t - slip_target. Velocities that are all changed by
//! J d, and targets with them, are the same problem: what solves one solves the other, whatever the solver.

use crate::common::*;
use carom_math::{Column, Space};
use carom_solver::delassus::{right_hand_side, targets};
use carom_solver::{
    Certificate, ContactProblem, FrictionLaw, ImpulseChoice, Impulses, SolveSettings, SolverKind, Stop,
    Twist, file, residual,
};

/// The same problem, seen from bodies that all have further velocities: targets move along.
fn moved<S: Space>(problem: &ContactProblem<S>, random: &mut Random) -> ContactProblem<S> {
    let further: Vec<Twist<S>> = problem.velocities.iter().map(|_| random.twist(0.7)).collect();
    let mut moved = problem.clone();
    for (v, d) in moved.velocities.iter_mut().zip(&further) {
        v.add_scaled(d, 1.0);
    }
    for c in &mut moved.contacts {
        let (normal, slip) = c.relative_velocity(&further);
        c.target += normal;
        c.slip_target = slip;
    }
    for r in &mut moved.rows {
        r.target += r.on_a.dot(&further[r.a]) + r.on_b.dot(&further[r.b]);
    }
    moved
}

/// A problem that a solver takes.
fn fitting<S: Space>(random: &mut Random, kind: SolverKind, law: FrictionLaw) -> ContactProblem<S> {
    let (contacts, rows, friction) = match kind {
        SolverKind::Direct => (1, 0, 5.0),
        SolverKind::Enumeration => (4, 0, if S::SLIP > 1 { 0.0 } else { 0.5 }),
        SolverKind::Sequential => (4, 0, 0.5),
        _ => (6, 2, 0.5),
    };
    random_problem::<S>(random, Recipe { bodies: 5, contacts, rows, friction, law })
}

fn every_solver_takes_slips_that_are_asked_for<S: Space>() {
    let mut random = Random::new(8);
    for kind in SolverKind::ALL {
        for law in [FrictionLaw::Disc, FrictionLaw::Box] {
            let mut solved = 0;
            for _ in 0..60 {
                let problem = fitting::<S>(&mut random, kind, law);
                let moved = moved(&problem, &mut random);
                let (impulses, outcome) = solve(&moved, kind, 50_000, 1e-10);
                if outcome.stop != Stop::Converged || kind == SolverKind::Sequential {
                    continue;
                }
                solved += usize::from(impulses.contacts.iter().any(|g| g.tangent != S::Slip::ZERO));
                let other = residual(&problem, &impulses).absolute;
                assert!(other <= 1e-9, "{}, {law:?}: {other:e} without the shift", kind.name());
            }
            let refuses = match (kind, law) {
                (SolverKind::Sequential, _) => true, // judged below
                (SolverKind::Lemke, FrictionLaw::Disc) => S::SLIP > 1,
                (SolverKind::Enumeration, _) => S::SLIP > 1,
                _ => false,
            };
            assert!(refuses || solved >= 5, "{}, {law:?}: {solved} solved", kind.name());
        }
    }
}

/// The least impulses are found on faces that know the slips: they solve the other problem too.
fn the_least_impulses_solve_the_other_problem_too<S: Space>() {
    let mut random = Random::new(11);
    let choice = SolveSettings {
        iterations: 50_000,
        tolerance: 1e-10,
        impulses: ImpulseChoice::MinimumNorm,
        ..SolveSettings::default()
    };
    let mut solved = 0;
    for _ in 0..30 {
        let problem = fitting::<S>(&mut random, SolverKind::Exact, FrictionLaw::Disc);
        let moved = moved(&problem, &mut random);
        let mut impulses = Impulses::zero(&moved);
        let outcome = SolverKind::Exact.make().solve(&moved, &choice, &mut impulses);
        solved += usize::from(outcome.stop == Stop::Converged);
        if outcome.stop == Stop::Converged {
            let other = residual(&problem, &impulses).absolute;
            assert!(other <= 1e-9, "minimum norm: {other:e} without the shift");
        }
    }
    assert!(solved >= 20, "{solved} of 30 solved");
}

/// One collision after another ends each with the slip asked for, or at its limit: the same impulses as unshifted.
fn one_collision_after_another_goes_the_same_way<S: Space>() {
    let mut random = Random::new(9);
    for law in [FrictionLaw::Disc, FrictionLaw::Box] {
        for _ in 0..40 {
            let problem = fitting::<S>(&mut random, SolverKind::Sequential, law);
            let moved = moved(&problem, &mut random);
            let flat = |p: &ContactProblem<S>| solve(p, SolverKind::Sequential, 20, 1e-9).0.flat();
            for (x, y) in flat(&problem).iter().zip(flat(&moved)) {
                assert_close(*x, y, 1e-9, "sequential");
            }
        }
    }
}

/// A ball on the floor whose whole slip is to turn round: Garwin's superball, by every solver.
fn every_solver_turns_the_slip_of_a_superball_round<S: Space>() {
    let (radius, mass) = (0.2, 0.7);
    let normal = along::<S::Vector>(S::DIM - 1, 1.0);
    let spin = Twist::new(flat::<S::Vector>(1.5, 0.0) - normal, S::Spin::from_fn(|k| 2.0 - k as f64));
    let mut problem =
        ContactProblem::<S>::new(vec![obstacle(), ball(mass, radius)], vec![Twist::default(), spin]);
    problem.contacts.push(contact((1, normal * -radius), (0, S::Vector::ZERO), normal));
    let c = &mut problem.contacts[0];
    let (speed, slip) = c.relative_velocity(&problem.velocities);
    (c.target, c.slip_target, c.friction) = (-speed, -slip, 5.0);
    for kind in SolverKind::ALL {
        let (impulses, outcome) = solve(&problem, kind, 1000, 1e-13);
        if matches!(outcome.stop, Stop::Refused(_)) {
            let disc = matches!(kind, SolverKind::Lemke | SolverKind::Enumeration) && S::SLIP > 1;
            assert!(disc, "{} refuses: {:?}", kind.name(), outcome.stop);
            continue;
        }
        let after = problem.velocities_after(&impulses);
        let (left, turned) = problem.contacts[0].relative_velocity(&after);
        assert_close(left, -speed, 1e-12, kind.name());
        assert_column_close(turned, -slip, 1e-12, kind.name());
        let energy = |v: &[Twist<S>]| kinetic_energy(&problem, v);
        assert_close(energy(&after), energy(&problem.velocities), 1e-12, kind.name());
    }
}

/// b, targets and the certificate's energy know the slips; files keep them, and leave zeros out.
fn slips_that_are_asked_for_are_part_of_the_problem<S: Space>() {
    let mut random = Random::new(10);
    for _ in 0..20 {
        let problem = fitting::<S>(&mut random, SolverKind::Pgs, FrictionLaw::Disc);
        let moved = moved(&problem, &mut random);
        for (x, y) in right_hand_side(&problem).iter().zip(right_hand_side(&moved)) {
            assert_close(*x, y, 1e-13, "b");
        }
        let width = 1 + S::SLIP;
        for (c, target) in moved.contacts.iter().zip(targets(&moved).chunks_exact(width)) {
            assert_eq!((target[0], &target[1..]), (c.target, c.slip_target.as_slice()));
        }
        let (impulses, _) = solve(&moved, SolverKind::Apgd, 1000, 1e-9);
        let certificate = Certificate::of(&moved, &impulses);
        assert_close(certificate.energy_identity, 0.0, 1e-13 * certificate.energy_turned_over, "energy");
        let text = file::to_json(&moved);
        assert_eq!(file::from_json::<S>(&text).expect("a problem"), moved);
        assert!(!file::to_json(&problem).contains("slip_target"));
    }
    let mut wrong = fitting::<S>(&mut random, SolverKind::Pgs, FrictionLaw::Disc);
    wrong.contacts[2].slip_target = S::Slip::from_fn(|_| f64::NAN);
    assert_eq!(wrong.check().expect_err("not finite").place, "contacts[2].slip_target");
}

in_both_spaces! {
    every_solver_takes_slips_that_are_asked_for;
    the_least_impulses_solve_the_other_problem_too;
    one_collision_after_another_goes_the_same_way;
    every_solver_turns_the_slip_of_a_superball_round;
    slips_that_are_asked_for_are_part_of_the_problem;
}
