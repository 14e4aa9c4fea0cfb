//! Every answer is certified or refused: what a solver calls solved is, by a measure that is not its own; what it
//! does not solve it returns with a reason, and with numbers inside the cones. On thousands of random problems,
//! on problems without a solution, and on problems with nothing in them.

use crate::contact::judge::{errors, noise};
use crate::contact::random::{Family, Known, beside, hopeless, known, nothing_to_do};
use crate::contact::solvers::{candidates, solve_matrix};
use carom_solver::{FrictionOutcome, FrictionProblem, FrictionSettings, Progress};

/// Budgets that no problem here needs and that end every loop.
pub fn settings(tolerance: f64) -> FrictionSettings {
    FrictionSettings { tolerance, iterations: 5_000, factorisations: 400, ..FrictionSettings::default() }
}

/// Fails unless an answer keeps the contract; returns whether it is a solution.
#[track_caller]
fn certify(
    what: &str,
    problem: &FrictionProblem,
    settings: &FrictionSettings,
    (r, outcome): &(Vec<f64>, FrictionOutcome),
) -> bool {
    assert_eq!(r.len(), problem.velocity.len(), "{what}");
    assert!(r.iter().all(|x| x.is_finite()), "{what}: {r:?}");
    let e = errors(problem, r);
    assert!(e.cone <= 1e-12, "{what}: outside the cones by {:e}", e.cone);
    assert!(outcome.factorisations <= settings.factorisations, "{what}: {outcome:?}");
    assert!(!outcome.seconds.is_nan() && outcome.seconds >= 0.0, "{what}: {outcome:?}");
    if outcome.solved {
        assert!(e.natural <= settings.tolerance * (1.0 + 1e-6) + 1e-15, "{what}: called solved, {e:?}");
        assert!(e.scaled <= 10.0 * settings.tolerance * (1.0 + 1e-6) + 1e-15, "{what}: called solved, {e:?}");
        let noise = noise(problem, r);
        assert!(noise <= settings.tolerance.max(1e-12), "{what}: called solved within a noise of {noise:e}");
        assert!(outcome.reason.is_empty(), "{what}: solved, yet {:?}", outcome.reason);
    } else {
        assert!(!outcome.reason.trim().is_empty(), "{what}: not solved, and no reason");
    }
    // where impulses outgrow the problem the two measures round differently
    let allowance = 1e-10 + 10.0 * noise(problem, r);
    for (name, told, true_value) in
        [("natural", outcome.measure.natural, e.natural), ("scaled", outcome.measure.scaled, e.scaled)]
    {
        assert!(
            (told - true_value).abs() <= 1e-6 * true_value + allowance,
            "{what}: tells {name} {told:e}, it is {true_value:e}"
        );
    }
    outcome.solved
}

/// The share of problems solved by each candidate, over a list.
fn shares(list: &[Known], tolerance: Option<f64>) -> Vec<(String, usize, Vec<String>)> {
    let mut all = Vec::new();
    for mut candidate in candidates() {
        let (mut solved, mut failing) = (0, Vec::new());
        for k in list {
            let settings = settings(tolerance.unwrap_or(candidate.reach));
            let answer = solve_matrix(candidate.solver.as_mut(), &k.problem, &settings);
            let what = format!("{} on {:?}", candidate.solver.name(), k.name);
            if certify(&what, &k.problem, &settings, &answer) {
                solved += 1;
            } else {
                let e = errors(&k.problem, &answer.0);
                failing.push(format!("{:?}: {e:?}; {}", k.name, answer.1.reason));
            }
        }
        all.push((candidate.solver.name().to_owned(), solved, failing));
    }
    all
}

/// Random problems of one family in dimensions 1 to 3 with 1 to `largest` contacts.
fn list(family: Family, count: u64, largest: usize) -> Vec<Known> {
    (0..count)
        .map(|seed| known(family, 1 + seed as usize % 3, 1 + (seed as usize * 7) % largest, seed))
        .collect()
}

/// Each family in turn; where W reaches all velocities a solution exists however it was found, and each solver finds
/// its share.
#[test]
fn every_answer_on_random_problems_is_certified_or_refused() {
    for family in Family::ALL {
        let problems = list(family, 60, 12);
        for ((name, solved, failing), candidate) in shares(&problems, None).into_iter().zip(candidates()) {
            println!("{family:?}: {name} solves {solved} of {} to {:e}", problems.len(), candidate.reach);
            failing.iter().for_each(|f| println!("    {f}"));
            if family.has_full_rank() && !matches!(family, Family::Columns | Family::Degenerate) {
                let least = candidate.share * problems.len() as f64;
                assert!(solved as f64 >= least, "{family:?}: {name} solves only {solved}");
            }
        }
    }
}

/// Problems without a solution, alone and beside one that has some: refused with a reason, never called solved.
#[test]
fn a_problem_without_a_solution_is_never_called_solved() {
    for dimension in 1..4 {
        for (what, problem) in hopeless(dimension) {
            let other = known(Family::FullRank, dimension, 5, 3).problem;
            for problem in [&problem, &beside(&problem, &other), &beside(&other, &problem)] {
                for mut candidate in candidates() {
                    let what = format!("{} on {what}, dimension {dimension}", candidate.solver.name());
                    let settings = settings(1e-6);
                    let answer = solve_matrix(candidate.solver.as_mut(), problem, &settings);
                    assert!(!certify(&what, problem, &settings, &answer), "{what}: called solved");
                }
            }
        }
    }
}

/// Problems with nothing in them are solved by no impulse at all.
#[test]
fn where_nothing_is_asked_no_impulse_is_the_answer() {
    for dimension in 1..4 {
        for (what, problem) in nothing_to_do(dimension) {
            for mut candidate in candidates() {
                let what = format!("{} on {what}, dimension {dimension}", candidate.solver.name());
                let settings = settings(1e-9);
                let answer = solve_matrix(candidate.solver.as_mut(), &problem, &settings);
                assert!(certify(&what, &problem, &settings, &answer), "{what}: {:?}", answer.1);
                assert!(answer.0.iter().all(|r| r.abs() <= 1e-9), "{what}: {:?}", answer.0);
            }
        }
    }
}

/// A budget of next to nothing ends early, with a reason and the best so far; a tolerance of zero ends as well.
#[test]
fn a_budget_is_kept_and_what_it_bought_is_certified() {
    for family in [Family::FullRank, Family::RankDeficient, Family::Duplicated, Family::Masses] {
        for k in list(family, 9, 9) {
            for mut candidate in candidates() {
                for settings in [
                    FrictionSettings {
                        tolerance: 1e-8,
                        iterations: 1,
                        factorisations: 0,
                        ..FrictionSettings::default()
                    },
                    FrictionSettings {
                        tolerance: 1e-8,
                        iterations: 2,
                        factorisations: 1,
                        ..FrictionSettings::default()
                    },
                    FrictionSettings {
                        tolerance: 0.0,
                        iterations: 200,
                        factorisations: 60,
                        ..FrictionSettings::default()
                    },
                ] {
                    let what = format!("{} on {:?} with {settings:?}", candidate.solver.name(), k.name);
                    let answer = solve_matrix(candidate.solver.as_mut(), &k.problem, &settings);
                    certify(&what, &k.problem, &settings, &answer);
                    // sweeps alone may lead away from the start at first; who promises the best of all stages may not
                    let nothing = errors(&k.problem, &vec![0.0; answer.0.len()]);
                    let got = errors(&k.problem, &answer.0);
                    let worst = nothing.worst() * (1.0 + 1e-9);
                    assert!(candidate.share < 0.99 || got.worst() <= worst, "{what}: {got:?}");
                }
            }
        }
    }
}

/// Whoever watches can stop a solve at its first call: the best so far comes back, with a reason.
#[test]
fn a_solve_that_is_stopped_from_outside_returns_what_it_has() {
    for k in list(Family::RankDeficient, 12, 12) {
        for mut candidate in candidates() {
            let settings = settings(1e-14);
            let mut r = vec![0.0; k.solution.len()];
            let mut calls = 0;
            let mut stop = |_: &Progress| {
                calls += 1;
                false
            };
            let outcome = candidate.solver.solve(&k.problem, &settings, &mut r, &mut stop);
            let what = format!("{} on {:?}, stopped", candidate.solver.name(), k.name);
            certify(&what, &k.problem, &settings, &(r, outcome));
            assert!(calls <= 1, "{what}: asked {calls} times after it was told to stop");
        }
    }
}

/// Starts of any kind, solutions, far-off numbers, numbers outside the cones or none at all, change nothing in the
/// contract.
#[test]
fn any_start_leads_to_a_certified_answer() {
    for k in list(Family::FullRank, 18, 8) {
        let far = |x: f64| vec![x; k.solution.len()];
        for start in [k.solution.clone(), far(1e9), far(-3.0), far(f64::NAN), far(f64::INFINITY)] {
            for mut candidate in candidates() {
                let settings = settings(candidate.reach);
                let mut r = start.clone();
                let outcome = candidate.solver.solve(&k.problem, &settings, &mut r, &mut |_| true);
                let what = format!("{} on {:?} from {:?}", candidate.solver.name(), k.name, &start[..1]);
                certify(&what, &k.problem, &settings, &(r, outcome));
            }
        }
    }
}

/// A solver used again, on problems of other sizes and shapes, answers as a fresh one does, to the last bit.
#[test]
fn a_solver_used_again_answers_as_a_fresh_one() {
    let mut used = candidates();
    for family in [Family::FullRank, Family::Duplicated, Family::Sparse, Family::Frictionless] {
        for k in list(family, 9, 10) {
            for (old, mut fresh) in used.iter_mut().zip(candidates()) {
                let settings = settings(fresh.reach);
                let again = solve_matrix(old.solver.as_mut(), &k.problem, &settings).0;
                let once = solve_matrix(fresh.solver.as_mut(), &k.problem, &settings).0;
                let bits = |r: &[f64]| r.iter().map(|x| x.to_bits()).collect::<Vec<u64>>();
                assert_eq!(bits(&again), bits(&once), "{} on {:?}", fresh.solver.name(), k.name);
            }
        }
    }
}
