//! Thousands of problems that nobody would write down: redundant, torn over 24 powers of ten in mass, without
//! friction or with far too much, with repeated and contradicting contacts. Every answer is finite and judged, or the
//! solver says why it has none and hands back what it was given; none hangs.

use crate::common::*;
use carom_math::{Column, Inertia, Space};
use carom_solver::delassus::{delassus, right_hand_side};
use carom_solver::{ContactProblem, FrictionLaw, Impulses, SolveSettings, SolverKind, Stop, residual};

/// A random problem made worse in one of several ways.
fn cruel<S: Space>(random: &mut Random) -> ContactProblem<S> {
    let law = if random.chance(0.5) { FrictionLaw::Disc } else { FrictionLaw::Box };
    let friction = [0.0, 0.5, 10.0][random.below(3)];
    let bodies = 2 + random.below(5);
    let recipe = Recipe { bodies, contacts: 1 + random.below(10), rows: random.below(4), friction, law };
    let mut p = random_problem::<S>(random, recipe);
    if random.chance(0.3) {
        for m in &mut p.inverse_masses {
            let factor = 10f64.powi(random.below(25) as i32 - 12);
            (m.linear, m.angular) = (m.linear * factor, m.angular.scaled(factor));
        }
    }
    if random.chance(0.3) {
        let copies: Vec<_> =
            (0..1 + random.below(4)).map(|_| p.contacts[random.below(p.contacts.len())]).collect();
        p.contacts.extend(copies);
    }
    if random.chance(0.2) {
        // a contact and its opposite: the bodies are welded, or asked to part both ways
        let mut c = p.contacts[0];
        (c.normal, c.target) = (-c.normal, if random.chance(0.5) { 0.0 } else { 1.0 });
        p.contacts.push(c);
    }
    if random.chance(0.2) {
        p.inverse_masses.iter_mut().for_each(|m| m.angular = S::Inertia::ZERO);
        p.velocities.iter_mut().for_each(|v| v.angular = S::Spin::ZERO);
        p.rows.iter_mut().for_each(|r| r.on_a.linear += along(0, 3.0));
    }
    if random.chance(0.2) {
        p.velocities.fill(Default::default());
    }
    if random.chance(0.2) {
        p.contacts.iter_mut().for_each(|c| c.target = [0.0, 1.0, -1.0][random.below(3)]);
    }
    p
}

/// The residual as a share of the velocities that the impulses produce one by one and that must cancel in it:
/// sum_j |a_ij gamma_j| + |b_i| at the worst row. Where a body of a gram bears tons this share is all that numbers
/// of 16 digits can promise.
fn backward_error<S: Space>(problem: &ContactProblem<S>, impulses: &Impulses<S>) -> f64 {
    let (a, b, gamma) = (delassus(problem), right_hand_side(problem), impulses.flat());
    let terms = |i: usize| a.row(i).map(|(j, x)| (x * gamma[j]).abs()).sum::<f64>() + b[i].abs();
    residual(problem, impulses).absolute / (0..gamma.len()).map(terms).fold(f64::MIN_POSITIVE, f64::max)
}

const SOLVERS: usize = SolverKind::ALL.len();

/// Factorisations that a stage of `exact` may end with beyond the budget.
const STAGES: usize = 16;

fn every_answer_is_finite_and_judged_or_refused<S: Space>() {
    let mut random = Random::new(2026);
    let (mut judged, mut refused, mut exact, mut worst) =
        ([0; SOLVERS], [0; SOLVERS], [0; SOLVERS], [0.0; SOLVERS]);
    for case in 0..3000 {
        let problem = cruel::<S>(&mut random);
        if problem.check().is_err() {
            continue; // a row between bodies of which neither moves, say
        }
        let mut start = Impulses::zero(&problem);
        if random.chance(0.5) {
            let flat: Vec<f64> = (0..problem.scalar_rows()).map(|_| random.between(-1.0, 1.0)).collect();
            start = Impulses::from_flat(&problem, &flat).expect("fits");
        }
        for (k, kind) in SolverKind::ALL.into_iter().enumerate() {
            if kind == SolverKind::Enumeration && case % 10 != 0 {
                continue; // thousands of combinations each
            }
            let mut impulses = start.clone();
            let settings = SolveSettings { iterations: 200, tolerance: 1e-9, ..SolveSettings::default() };
            let outcome = kind.make().solve(&problem, &settings, &mut impulses);
            assert!(impulses.is_finite(), "case {case}, {}", kind.name());
            assert_eq!(outcome.residual, residual(&problem, &impulses), "case {case}, {}", kind.name());
            let limit = match kind {
                SolverKind::Lemke => 4 * 50 * (6 * problem.scalar_rows() + 10),
                SolverKind::Enumeration => carom_solver::methods::enumeration::LARGEST,
                // sweeps before each of twelve rounds, and all factorisations
                SolverKind::Exact => 12 * settings.iterations + settings.factorisations + STAGES,
                // stages of each island, of which there are no more than entries
                SolverKind::Auto => {
                    (1000 + settings.factorisations + STAGES) * problem.scalar_rows()
                        + 4 * 50 * (6 * problem.scalar_rows() + 10)
                }
                _ => 200,
            };
            assert!(
                outcome.iterations <= limit,
                "case {case}, {}: {} iterations",
                kind.name(),
                outcome.iterations
            );
            match &outcome.stop {
                Stop::Refused(why) => {
                    refused[k] += 1;
                    assert!(!why.is_empty());
                    assert_eq!(impulses, start, "case {case}, {}: refused, and changed", kind.name());
                }
                stop => {
                    judged[k] += 1;
                    exact[k] += (outcome.residual.absolute <= 1e-9) as usize;
                    if kind != SolverKind::Sequential {
                        let small = outcome.residual.absolute <= settings.tolerance;
                        assert_eq!(
                            small,
                            *stop == Stop::Converged,
                            "case {case}, {}: {outcome:?}",
                            kind.name()
                        );
                    }
                    if [SolverKind::Direct, SolverKind::Lemke, SolverKind::Enumeration].contains(&kind) {
                        let error = backward_error(&problem, &impulses);
                        worst[k] = f64::max(worst[k], error);
                        assert!(error < 1e-8, "case {case}, {}: accepted, but off by {error:e}", kind.name());
                    }
                }
            }
        }
    }
    println!(
        "{}: judged {judged:?}, exact {exact:?}, refused {refused:?}, worst {worst:?} of {:?}",
        S::NAME,
        SolverKind::ALL
    );
    assert!(judged.iter().all(|n| *n > 30) && refused[3] > 50 && refused[4] > 50 && refused[7] > 50);
}

/// Frictionless problems that have a solution are all solved by Lemke, however redundant, over a millionfold of masses;
/// theory eq. 5.14 says that there is one.
fn lemke_solves_every_solvable_frictionless_problem<S: Space>() {
    let mut random = Random::new(2027);
    for case in 0..1000 {
        let recipe = Recipe {
            bodies: 2 + random.below(5),
            contacts: 1 + random.below(14),
            rows: random.below(4),
            friction: 0.0,
            law: FrictionLaw::Disc,
        };
        let mut problem = random_problem::<S>(&mut random, recipe);
        let spread = random.below(4);
        for m in &mut problem.inverse_masses {
            let factor = 10f64.powi(random.below(2 * spread + 1) as i32 - spread as i32);
            (m.linear, m.angular) = (m.linear * factor, m.angular.scaled(factor));
        }
        let copies: Vec<_> =
            (0..random.below(4)).map(|_| problem.contacts[random.below(problem.contacts.len())]).collect();
        problem.contacts.extend(copies);
        let (impulses, outcome) = solve(&problem, SolverKind::Lemke, 1, 1e-8);
        assert!(!matches!(outcome.stop, Stop::Refused(_)), "case {case}: {outcome:?}");
        let error = backward_error(&problem, &impulses);
        assert!(error < 1e-10, "case {case}: {error:e}");
    }
}

in_both_spaces! {
    every_answer_is_finite_and_judged_or_refused;
    lemke_solves_every_solvable_frictionless_problem;
}
