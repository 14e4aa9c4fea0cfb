//! Matrices that fall into parts: each part is solved as though it were alone, and the whole is what was asked for.

use crate::contact::certified::settings;
use crate::contact::judge::errors;
use crate::contact::random::{Family, beside, from_dense, hopeless, known};
use crate::contact::solvers::solve_matrix;
use carom_solver::exact::Exact;
use carom_solver::{FrictionProblem, FrictionSettings, FrictionSolver};

/// Parts of 3 to 24 contacts whose velocities differ by eight orders of magnitude, contacts of all mixed.
fn several(dimension: usize, seed: u64) -> FrictionProblem {
    let sizes = [24, 3, 17, 5, 20, 4, 3];
    let mut all: Option<FrictionProblem> = None;
    for (k, contacts) in sizes.into_iter().enumerate() {
        let family = [Family::FullRank, Family::RankDeficient, Family::Sparse][k % 3];
        let mut own = known(family, dimension, contacts, seed + k as u64).problem;
        let unit = [1.0, 1e-4, 1e3, 1.0, 1e-5, 1.0, 1e2][k];
        own.velocity.iter_mut().for_each(|q| *q *= unit);
        all = Some(all.map_or(own.clone(), |all| beside(&all, &own)));
    }
    mixed(&all.expect("there are several"))
}

/// The same problem with its contacts in another order: those i places before the end come after those from the start.
fn mixed(problem: &FrictionProblem) -> FrictionProblem {
    let (d, n) = (problem.dimension, problem.contacts());
    let order: Vec<usize> = (0..n).map(|k| if k % 2 == 0 { k / 2 } else { n - 1 - k / 2 }).collect();
    let rows: Vec<usize> = order.iter().flat_map(|i| d * i..d * (i + 1)).collect();
    let dense = problem.matrix.dense();
    let w: Vec<Vec<f64>> = rows.iter().map(|&k| rows.iter().map(|&l| dense[k][l]).collect()).collect();
    let q: Vec<f64> = rows.iter().map(|&k| problem.velocity[k]).collect();
    let friction: Vec<f64> = order.iter().map(|&i| problem.friction[i]).collect();
    from_dense(d, &w, &q, &friction)
}

/// At coarse and at fine tolerances, from nothing, from the answer and from no numbers.
#[test]
fn a_problem_of_many_parts_is_solved_to_what_was_asked() {
    for (dimension, seed) in [(1, 3), (2, 5), (3, 7), (3, 8)] {
        let (problem, mut solver) = (several(dimension, seed), Exact::default());
        let mut start = vec![0.0; problem.velocity.len()];
        for tolerance in [1e-3, 1e-6, 1e-9] {
            for broken in [false, true] {
                if broken {
                    start[7] = f64::NAN;
                }
                let mut r = start.clone();
                let outcome = solver.solve(&problem, &settings(tolerance), &mut r, &mut |_| true);
                let found = errors(&problem, &r);
                let what = format!("{dimension} {tolerance:e} {broken}: {outcome:?}, {found:?}");
                assert!(outcome.solved && found.cone <= 1e-12, "{what}");
                assert!(found.natural <= 1.000_001 * tolerance, "{what}");
                assert!(found.scaled <= 10.000_01 * tolerance, "{what}");
                let told = outcome.measure;
                assert!((told.natural - found.natural).abs() <= 1e-6 * found.natural + 1e-12, "{what}");
                start = r;
            }
        }
    }
}

/// What nothing moves has no errors, and leaves nothing to be wrong in other parts: its share goes by its velocities, not by the
/// unit that its errors are told in.
#[test]
fn parts_at_rest_leave_the_others_no_more_than_their_share() {
    for dimension in [1, 2, 3] {
        let part = |seed: u64, unit: f64| {
            let mut own = known(Family::FullRank, dimension, 20, seed).problem;
            own.velocity.iter_mut().for_each(|q| *q *= unit);
            own
        };
        let mut all = part(1, 0.0);
        (2..6).for_each(|seed| all = beside(&all, &part(seed, 1e-4)));
        for tolerance in [1e-2, 1e-5] {
            let (r, outcome) = solve_matrix(&mut Exact::default(), &all, &settings(tolerance));
            let found = errors(&all, &r);
            assert!(outcome.solved && found.natural <= 1.000_001 * tolerance, "{outcome:?}, {found:?}");
            assert!(found.scaled <= 10.000_01 * tolerance, "{outcome:?}, {found:?}");
        }
    }
}

/// A part without a solution is told, and costs the others nothing: their errors are those that they have alone.
#[test]
fn a_part_that_has_no_solution_leaves_the_others_solved() {
    for dimension in [2, 3] {
        let solvable = known(Family::FullRank, dimension, 20, 11).problem;
        for (what, impossible) in hopeless(dimension) {
            // seventeen times, so that they make no part with others
            let mut apart = impossible.clone();
            (0..16).for_each(|_| apart = beside(&apart, &impossible));
            let whole = beside(&solvable, &apart);
            let (r, outcome) = solve_matrix(&mut Exact::default(), &whole, &settings(1e-8));
            assert!(!outcome.solved && !outcome.reason.is_empty(), "{what}: {outcome:?}");
            let own = errors(&solvable, &r[..solvable.velocity.len()]);
            assert!(own.natural <= 1e-7 && own.scaled <= 1e-6, "{what}: {own:?}");
        }
    }
}

/// Sweeps that are stopped and factorisations that are spent end all parts, with a reason and impulses on their cones.
#[test]
fn a_budget_and_a_stop_are_for_all_parts_together() {
    let problem = several(3, 21);
    for most in [0, 1, 5] {
        let settings = FrictionSettings { iterations: 3, factorisations: most, ..settings(1e-12) };
        let (r, outcome) = solve_matrix(&mut Exact::default(), &problem, &settings);
        assert!(!outcome.solved && outcome.factorisations <= most, "{most}: {outcome:?}");
        assert!(outcome.reason.contains("factorisations are spent"), "{most}: {outcome:?}");
        assert!(errors(&problem, &r).cone <= 1e-12);
    }
    let (mut r, mut calls) = (vec![0.0; problem.velocity.len()], 0);
    let mut stop = |_: &_| {
        calls += 1;
        calls < 3
    };
    let outcome = Exact::default().solve(&problem, &settings(1e-13), &mut r, &mut stop);
    assert!(!outcome.solved && outcome.reason.contains("stopped on request"), "{outcome:?}");
    assert!(calls == 3 && errors(&problem, &r).cone <= 1e-12, "asked {calls} times");
}
