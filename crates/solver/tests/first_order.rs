//! Conjugate gradients and accelerated projected gradients: that they reach Coulomb's law itself, how fast beside
//! plain sweeps (theory chapter 5, section 5.10), and that they keep the best they found.

use crate::common::*;
use carom_math::{Column, Space, Spatial, vec3};
use carom_solver::{
    Contact, ContactProblem, FrictionLaw, Impulses, Progress, SolveSettings, SolverKind, Stop, Twist,
    residual,
};

const ACCELERATED: [SolverKind; 2] = [SolverKind::Nncg, SolverKind::Apgd];
/// The speed that a step of gravity gives [m/s].
const FALL: f64 = 9.81 / 60.0;

/// Cubes of edge 1 on top of each other, four contacts each in space and two in the plane, after a step of gravity.
fn cubes<S: Space>(masses: &[f64], friction: f64) -> ContactProblem<S> {
    let up = S::DIM - 1;
    let mut problem = ContactProblem::new(vec![obstacle()], vec![Twist::default()]);
    for (k, &mass) in masses.iter().enumerate() {
        problem.inverse_masses.push(brick::<S>(mass, [1.0; 3]));
        problem.velocities.push(moving(along(up, -FALL)));
        for corner in 0..1 << up {
            let side = |axis: usize| if corner >> axis & 1 == 1 { 0.5 } else { -0.5 };
            let at = |height: f64| S::Vector::from_fn(|axis| if axis == up { height } else { side(axis) });
            let c = contact((k + 1, at(-0.5)), (k, at(0.5)), along(up, 1.0));
            problem.contacts.push(Contact { id: problem.contacts.len() as u64, friction, ..c });
        }
    }
    problem
}

/// Velocities are unique where friction does not make them many: the accelerated methods end with those of the
/// sweeps, with friction of both laws and bounded rows.
fn accelerated_methods_agree_with_the_sweeps<S: Space>() {
    let mut random = Random::new(71);
    for case in 0..24 {
        let law = if case % 2 == 0 { FrictionLaw::Disc } else { FrictionLaw::Box };
        let recipe = Recipe { bodies: 9, contacts: 10, rows: 3, friction: 0.5, law };
        let problem = random_problem::<S>(&mut random, recipe);
        let sweeps = problem.velocities_after(&solved(&problem, SolverKind::Pgs, 1e-12));
        for kind in ACCELERATED {
            let after = problem.velocities_after(&solved(&problem, kind, 1e-12));
            for (v, w) in after.iter().zip(&sweeps) {
                assert_column_close(v.linear, w.linear, 1e-9, kind.name());
                assert_column_close(v.angular, w.angular, 1e-8, kind.name());
            }
        }
    }
}

/// Without friction the answer is that of Lemke's pivoting, for redundant contacts too.
fn accelerated_methods_agree_with_pivoting<S: Space>() {
    let mut random = Random::new(72);
    for contacts in [5, 15, 40] {
        let recipe = Recipe { bodies: 8, contacts, rows: 3, friction: 0.0, law: FrictionLaw::Disc };
        let problem = random_problem::<S>(&mut random, recipe);
        let exact = problem.velocities_after(&solved(&problem, SolverKind::Lemke, 1e-10));
        for kind in ACCELERATED {
            let after = problem.velocities_after(&solved(&problem, kind, 1e-11));
            for (v, w) in after.iter().zip(&exact) {
                assert_column_close(v.linear, w.linear, 1e-8, kind.name());
                assert_column_close(v.angular, w.angular, 1e-7, kind.name());
            }
        }
    }
}

/// Iterations to a residual of share x g h; `None` when 20,000 do not reach it.
fn iterations<S: Space>(problem: &ContactProblem<S>, kind: SolverKind, share: f64) -> Option<usize> {
    let (_, outcome) = solve(problem, kind, 20_000, share * FALL);
    (outcome.stop == Stop::Converged).then_some(outcome.iterations)
}

/// A stack of ten cubes, equal or with the uppermost a thousand times as heavy, and a cube on one a thousand times
/// lighter: sweeps do not reach 1e-8 g h in 20,000; projected gradients do, conjugate gradients all but the second.
#[test]
fn stacks_that_sweeps_never_solve_are_solved() {
    let mut heavy_top = vec![1.0; 10];
    heavy_top[9] = 1000.0;
    let cases = [
        ("ten equal", vec![1.0; 10], [Some(2500), Some(400)]),
        ("ten, the top one 1000 times as heavy", heavy_top, [None, Some(4000)]),
        ("1000 on 1", vec![1.0, 1000.0], [Some(10_000), Some(2000)]),
    ];
    for (name, masses, [conjugate, projected]) in cases {
        let problem = cubes::<Spatial>(&masses, 0.5);
        for (kind, most) in
            [(SolverKind::Pgs, None), (SolverKind::Nncg, conjugate), (SolverKind::Apgd, projected)]
        {
            let spent = [1e-2, 1e-4, 1e-8].map(|share| iterations(&problem, kind, share));
            println!("{name}, {} contacts, {}: {spent:?}", problem.contacts.len(), kind.name());
            match most {
                Some(most) => assert!(spent[2].is_some_and(|n| n <= most), "{}: {spent:?}", kind.name()),
                None => assert_eq!(spent[2], None, "{name}, {}", kind.name()),
            }
        }
    }
}

/// A block that slides askew to its axes is braked along its motion by the accelerated methods as by the sweeps.
#[test]
fn sliding_blocks_are_braked_along_their_motion() {
    for degrees in [0.0, 20.0, 45.0, 70.0] {
        let angle = f64::to_radians(degrees);
        let mut problem = ContactProblem::<Spatial>::new(
            vec![brick(1.0, [2.0, 0.2, 0.1]), obstacle()],
            vec![moving(vec3(5.0 * angle.cos(), 5.0 * angle.sin(), -FALL)), Twist::default()],
        );
        for (x, y) in [(1.0, 0.1), (1.0, -0.1), (-1.0, 0.1), (-1.0, -0.1)] {
            let c = contact((0, vec3(x, y, -0.05)), (1, vec3(x, y, 0.0)), vec3(0.0, 0.0, 1.0));
            problem.contacts.push(Contact { friction: 0.3, ..c });
        }
        for kind in ACCELERATED {
            let impulses = solved(&problem, kind, 1e-12);
            let push = problem.contacts.iter().zip(&impulses.contacts).map(|(c, g)| c.to_world(g));
            let total = push.fold(vec3(0.0, 0.0, 0.0), |sum, force| sum + force);
            let wanted = vec3(-0.3 * FALL * angle.cos(), -0.3 * FALL * angle.sin(), FALL);
            assert_column_close(total, wanted, 1e-10, kind.name());
        }
    }
}

/// The answer is never worse than the start, nor than a shorter solve's, however few the iterations.
fn the_best_point_is_kept<S: Space>() {
    let mut random = Random::new(73);
    let recipe = Recipe { bodies: 8, contacts: 20, rows: 2, friction: 0.8, law: FrictionLaw::Disc };
    for _ in 0..10 {
        let problem = random_problem::<S>(&mut random, recipe);
        let start = solved(&problem, SolverKind::Pgs, 1e-4);
        for kind in ACCELERATED {
            let mut before = residual(&problem, &start).absolute;
            for iterations in [0, 1, 2, 4, 8, 16, 32, 64] {
                let mut impulses = start.clone();
                let settings = SolveSettings { iterations, tolerance: 0.0, ..SolveSettings::default() };
                let outcome = kind.make().solve(&problem, &settings, &mut impulses);
                // the judge forms velocities anew: rounding apart they are those of the solve
                assert!(outcome.residual.absolute <= before + 1e-14, "{} {iterations}", kind.name());
                before = outcome.residual.absolute;
            }
        }
    }
}

/// A watch sees the residual of the best fall and the iterations grow, and can stop the solve, which says so.
fn a_watch_sees_progress_and_can_stop<S: Space>() {
    let problem = cubes::<S>(&[1.0, 1.0, 1.0, 1.0, 100.0], 0.5);
    for kind in [SolverKind::Pgs, SolverKind::Nncg, SolverKind::Apgd] {
        let mut seen: Vec<Progress> = Vec::new();
        let mut impulses = Impulses::zero(&problem);
        let settings = SolveSettings { iterations: 100_000, tolerance: 0.0, ..SolveSettings::default() };
        let mut watch = |progress: &Progress| {
            seen.push(*progress);
            progress.iterations < 500
        };
        let outcome = kind.make().solve_watched(&problem, &settings, &mut impulses, &mut watch);
        assert_eq!(outcome.stop, Stop::Interrupted, "{}", kind.name());
        assert_eq!(outcome.residual, residual(&problem, &impulses));
        assert!((500..600).contains(&outcome.iterations), "{}", outcome.iterations);
        assert!(seen.len() > 5 && seen.windows(2).all(|w| w[0].iterations < w[1].iterations));
        if kind != SolverKind::Pgs {
            assert!(seen.windows(2).all(|w| w[1].residual <= w[0].residual), "{}", kind.name());
        }
    }
}

/// Projected gradients work on all contacts at once: another order of contacts changes rounding only.
fn the_order_of_contacts_does_not_matter_to_projected_gradients<S: Space>() {
    let mut random = Random::new(74);
    let recipe = Recipe { bodies: 8, contacts: 14, rows: 0, friction: 0.5, law: FrictionLaw::Disc };
    for _ in 0..10 {
        let problem = random_problem::<S>(&mut random, recipe);
        let mut turned = problem.clone();
        turned.contacts.reverse();
        let (straight, _) = solve(&problem, SolverKind::Apgd, 100, 0.0);
        let (mut back, _) = solve(&turned, SolverKind::Apgd, 100, 0.0);
        back.contacts.reverse();
        for (x, y) in straight.flat().iter().zip(back.flat()) {
            assert_close(*x, y, 1e-10, "impulse");
        }
    }
}

in_both_spaces! {
    accelerated_methods_agree_with_the_sweeps;
    accelerated_methods_agree_with_pivoting;
    the_best_point_is_kept;
    a_watch_sees_progress_and_can_stop;
    the_order_of_contacts_does_not_matter_to_projected_gradients;
}
