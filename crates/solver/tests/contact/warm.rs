//! Starts that solved a problem much like this one: a step later a structure takes a few factorisations where a cold
//! start takes many, and the answer is as certified as any.

use crate::common::*;
use crate::contact::judge::errors;
use crate::contact::scenes::*;
use crate::contact::solvers::{assembled, solve_matrix};
use carom_math::{Column, Space};
use carom_solver::delassus::right_hand_side;
use carom_solver::exact::Exact;
use carom_solver::{
    ContactProblem, FrictionSettings, FrictionSolver, Impulse, Impulses, SolveSettings, SolverKind, Stop,
    Twist, residual, unwatched,
};

fn structures<S: Space>() -> Vec<(String, ContactProblem<S>)> {
    let mut all = vec![("a stack".to_owned(), stack::<S>(&[1.0; 10], 0.5))];
    for (columns, rows) in [(3, 3), (5, 6), (8, 8)] {
        all.push((format!("a wall of {columns} x {rows}"), wall::<S>(columns, rows, 0.5)));
    }
    all
}

/// Velocities of the bodies changed so that those of the contacts change by at most a share of the largest.
fn stirred<S: Space>(problem: &ContactProblem<S>, share: f64, random: &mut Random) -> ContactProblem<S> {
    let largest = |b: &[f64]| b.iter().fold(0.0_f64, |m, b| m.max(b.abs()));
    let q = right_hand_side(problem);
    let twists: Vec<Twist<S>> = problem.velocities.iter().map(|_| random.twist(1.0)).collect();
    let by = |size: f64| {
        let mut stirred = problem.clone();
        for ((m, v), twist) in problem.inverse_masses.iter().zip(&mut stirred.velocities).zip(&twists) {
            if !m.is_fixed() {
                v.add_scaled(twist, size);
            }
        }
        stirred
    };
    let change: Vec<f64> = right_hand_side(&by(1.0)).iter().zip(&q).map(|(a, b)| a - b).collect();
    by(share * largest(&q) / largest(&change))
}

/// On bodies.
fn a_structure_a_step_later_takes_at_most_four_factorisations<S: Space>() {
    let mut random = Random::new(91);
    for (what, problem) in structures::<S>() {
        let settings = SolveSettings { tolerance: 1e-8 * FALL, ..SolveSettings::default() };
        let mut solver = SolverKind::Exact.make();
        let mut start = Impulses::zero(&problem);
        let cold = solver.solve(&problem, &settings, &mut start);
        assert_eq!(cold.stop, Stop::Converged, "{what}");
        for round in 0..4 {
            let later = stirred(&problem, 1e-3, &mut random);
            let mut impulses = start.clone();
            let outcome = solver.solve(&later, &settings, &mut impulses);
            println!("{what}: {} cold, {} warm", cold.factorisations, outcome.factorisations);
            assert_eq!(outcome.stop, Stop::Converged, "{what}, round {round}");
            assert!(outcome.factorisations <= 4, "{what}, round {round}: {}", outcome.factorisations);
        }
    }
}

/// What rests on the forces of the step before keeps them, bit for bit.
fn a_start_that_solves_is_the_answer<S: Space>() {
    for (what, problem) in structures::<S>() {
        let solve = |tolerance: f64, impulses: &mut Impulses<S>| {
            let settings = SolveSettings { tolerance, ..SolveSettings::default() };
            SolverKind::Exact.make().solve(&problem, &settings, impulses)
        };
        let mut start = Impulses::zero(&problem);
        assert_eq!(solve(1e-12 * FALL, &mut start).stop, Stop::Converged, "{what}");
        let mut again = start.clone();
        let outcome = solve(1e-8 * FALL, &mut again);
        assert_eq!((outcome.stop, outcome.iterations), (Stop::Converged, 0), "{what}");
        assert!(again == start, "{what}");
        assert!(outcome.residual.absolute == residual(&problem, &start).absolute, "{what}");
        // not where more is asked for than it has
        let mut rough = Impulses::zero(&problem);
        assert_eq!(solve(1e-5 * FALL, &mut rough).stop, Stop::Converged, "{what}");
        let before = residual(&problem, &rough).absolute;
        let outcome = solve(0.01 * before, &mut rough);
        assert!(outcome.stop == Stop::Converged && outcome.iterations > 0, "{what}");
    }
}

/// In matrix form, from the answer on bodies, which the interior point has found.
fn a_matrix_a_step_later_takes_at_most_four_factorisations<S: Space>() {
    let mut random = Random::new(92);
    for (what, problem) in structures::<S>() {
        let settings = FrictionSettings::default();
        let tight = SolveSettings { tolerance: 1e-8 * FALL, ..SolveSettings::default() };
        let mut solved = Impulses::zero(&problem);
        let cold = SolverKind::Exact.make().solve(&problem, &tight, &mut solved);
        assert_eq!(cold.stop, Stop::Converged, "{what}");
        let entries = |i: &Impulse<S>| [&[i.normal], i.tangent.as_slice()].concat();
        let start: Vec<f64> = solved.contacts.iter().flat_map(entries).collect();
        for round in 0..4 {
            let later = assembled(&stirred(&problem, 1e-3, &mut random));
            let mut impulses = start.clone();
            let outcome = Exact::default().solve(&later, &settings, &mut impulses, &mut unwatched);
            println!("{what}: {} cold, {} warm", cold.factorisations, outcome.factorisations);
            assert!(outcome.solved && errors(&later, &impulses).solve(1e-8), "{what}: {outcome:?}");
            assert!(outcome.factorisations <= 4, "{what}, round {round}: {}", outcome.factorisations);
        }
    }
}

/// Memory is kept between solves in matrix form, numbers are not: of problems of other sizes and forms, and there and
/// back, one solver finds the bits that a fresh one finds.
fn memory_of_other_solves_changes_no_bit<S: Space>() {
    let settings = FrictionSettings::default();
    let problems: Vec<_> = structures::<S>().into_iter().map(|(what, p)| (what, assembled(&p))).collect();
    let mut kept = Exact::default();
    for (what, problem) in problems.iter().chain(problems.iter().rev()) {
        let (fresh, first) = solve_matrix(&mut Exact::default(), problem, &settings);
        let (again, second) = solve_matrix(&mut kept, problem, &settings);
        assert_eq!(first.factorisations, second.factorisations, "{what}");
        assert_eq!(fresh, again, "{what}");
    }
}

/// Answers of sweeps, and of Newton from them, lie on the edges of the cones where others are as good: worse starts
/// than those of the interior point. At most the four Newton steps and an interior point of a dozen are lost on them.
fn an_answer_on_the_edges_is_a_start_too<S: Space>() {
    let mut random = Random::new(94);
    for (what, problem) in structures::<S>() {
        let settings = FrictionSettings::default();
        let (start, first) = solve_matrix(&mut Exact::default(), &assembled(&problem), &settings);
        assert!(first.solved, "{what}");
        for _ in 0..4 {
            let later = assembled(&stirred(&problem, 1e-3, &mut random));
            let (_, cold) = solve_matrix(&mut Exact::default(), &later, &settings);
            let mut impulses = start.clone();
            let outcome = Exact::default().solve(&later, &settings, &mut impulses, &mut unwatched);
            println!("{what}: {} cold, {} warm", cold.factorisations, outcome.factorisations);
            assert!(outcome.solved && errors(&later, &impulses).solve(1e-8), "{what}: {outcome:?}");
            assert!(outcome.factorisations <= cold.factorisations + 16, "{what}: {outcome:?}");
        }
    }
}

/// A start that is far off costs a little more than none, and spoils nothing: contacts' states change with a tenth
/// of the velocities, and with everything.
fn a_far_start_leads_to_a_certified_answer<S: Space>() {
    let mut random = Random::new(93);
    for (what, problem) in structures::<S>() {
        let settings = SolveSettings { tolerance: 1e-8 * FALL, ..SolveSettings::default() };
        let mut start = Impulses::zero(&problem);
        SolverKind::Exact.make().solve(&problem, &settings, &mut start);
        for share in [0.01, 0.1, 1.0] {
            let later = stirred(&problem, share, &mut random);
            let cold = SolverKind::Exact.make().solve(&later, &settings, &mut Impulses::zero(&later));
            let mut impulses = start.clone();
            let outcome = SolverKind::Exact.make().solve(&later, &settings, &mut impulses);
            println!("{what}, {share}: {} cold, {} warm", cold.factorisations, outcome.factorisations);
            assert_eq!(outcome.stop, Stop::Converged, "{what}, {share}");
            assert!(residual(&later, &impulses).absolute <= settings.tolerance, "{what}, {share}");
            let most = cold.factorisations + 8;
            assert!(outcome.factorisations <= most, "{what}, {share}: {}", outcome.factorisations);
        }
    }
}

in_both_spaces! {
    a_start_that_solves_is_the_answer;
    memory_of_other_solves_changes_no_bit;
    a_structure_a_step_later_takes_at_most_four_factorisations;
    a_far_start_leads_to_a_certified_answer;
    a_matrix_a_step_later_takes_at_most_four_factorisations;
    an_answer_on_the_edges_is_a_start_too;
}
