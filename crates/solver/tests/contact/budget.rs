//! A budget of factorisations ends the solve where it ends, with the best that was seen and a stop that says so.

use crate::contact::scenes::*;
use carom_math::Space;
use carom_solver::{
    ContactProblem, Content, ImpulseChoice, Impulses, SolveSettings, SolverKind, Stop, Twist, residual,
};

/// The residual is within this factor of the measure that the solver keeps its best by.
const FACTOR: f64 = 3.0;

/// More factorisations give no worse an answer: the best of all stages is kept, the start among them.
fn a_spent_budget_gives_the_best_so_far_and_says_so<S: Space>() {
    for impulses in [ImpulseChoice::Any, ImpulseChoice::MinimumNorm] {
        let problem = wall::<S>(5, 6, 0.5);
        let given = residual(&problem, &Impulses::zero(&problem)).absolute;
        let (mut last, mut spent) = (given, 0);
        for factorisations in 0..60 {
            let settings =
                SolveSettings { tolerance: 1e-10, factorisations, impulses, ..SolveSettings::default() };
            for kind in [SolverKind::Exact, SolverKind::Auto] {
                let mut found = Impulses::zero(&problem);
                let outcome = kind.make().solve(&problem, &settings, &mut found);
                let what = format!("{} with {factorisations}, {outcome:?}", kind.name());
                assert!(outcome.factorisations <= factorisations, "{what}");
                assert_eq!(outcome.residual.absolute, residual(&problem, &found).absolute, "{what}");
                assert!(outcome.residual.absolute <= given, "worse than nothing: {what}");
                if kind == SolverKind::Exact && impulses == ImpulseChoice::Any {
                    assert!(outcome.residual.absolute <= FACTOR * last, "worse than with less: {what}");
                    last = last.min(outcome.residual.absolute);
                }
                match outcome.stop {
                    Stop::OutOfFactorisations => {
                        assert!(outcome.residual.absolute > settings.tolerance, "{what}");
                        spent += 1;
                    }
                    Stop::Converged => assert!(outcome.residual.absolute <= settings.tolerance, "{what}"),
                    // solved, and nothing left to look for the least impulses with
                    Stop::OutOfIterations => assert_eq!(impulses, ImpulseChoice::MinimumNorm, "{what}"),
                    _ => panic!("{what}"),
                }
            }
        }
        assert!(spent > 10, "only {spent} budgets were too small to test anything");
    }
}

/// A solve that takes long ends with what will do as soon as it has that, and what does not will do is looked for from
/// where the solve is: it never takes more factorisations than without.
fn a_long_solve_ends_with_what_will_do_and_never_starts_over<S: Space>() {
    let problem = wall::<S>(5, 6, 0.5);
    let solve = |content: Option<Content>| {
        let settings = SolveSettings { tolerance: 1e-10, content, ..SolveSettings::default() };
        let mut found = Impulses::zero(&problem);
        (SolverKind::Exact.make().solve(&problem, &settings, &mut found), found)
    };
    let (plain, impulses) = solve(None);
    assert_eq!(plain.stop, Stop::Converged);
    let mut short = 0;
    for after in 0..plain.factorisations + 2 {
        for tolerance in [1e-2, 1e-4, 1e-6] {
            let (outcome, _) = solve(Some(Content { after, tolerance }));
            let what = format!("{tolerance:e} after {after}: {outcome:?}, otherwise {plain:?}");
            assert!(outcome.factorisations <= plain.factorisations, "{what}");
            if outcome.stop == Stop::OutOfFactorisations {
                assert!(outcome.residual.absolute <= tolerance && outcome.factorisations >= after, "{what}");
                short += 1;
            } else {
                assert_eq!(outcome.stop, Stop::Converged, "{what}");
            }
        }
        let (outcome, found) = solve(Some(Content { after, tolerance: 1e-300 }));
        assert_eq!(
            (outcome.factorisations, found),
            (plain.factorisations, impulses.clone()),
            "after {after}"
        );
    }
    assert!(short > 3, "only {short} solves had enough before they were done");
}

/// Impulses that begin the next solve are taken well below the tolerance, for one more factorisation at most.
fn polished_impulses_are_well_below_the_tolerance<S: Space>() {
    let problem = wall::<S>(5, 6, 0.5);
    let solve = |polish: bool, mut found: Impulses<S>, problem: &ContactProblem<S>| {
        let settings = SolveSettings { tolerance: 1e-6 * FALL, polish, ..SolveSettings::default() };
        let outcome = SolverKind::Exact.make().solve(problem, &settings, &mut found);
        assert_eq!(outcome.stop, Stop::Converged, "{outcome:?}");
        (outcome, found)
    };
    let (plain, _) = solve(false, Impulses::zero(&problem), &problem);
    let (cold, start) = solve(true, Impulses::zero(&problem), &problem);
    assert!(plain.factorisations > 0 && cold.factorisations <= plain.factorisations + 1, "{cold:?}");
    assert!(cold.residual.absolute <= 1e-9 * FALL, "{cold:?}");
    // loads a little off, as a step later
    let mut next = problem.clone();
    for (k, v) in next.velocities.iter_mut().enumerate().filter(|(_, v)| **v != Twist::default()) {
        v.linear[0] += 1e-3 * FALL * (1.7 * k as f64).sin();
    }
    let (plain, _) = solve(false, start.clone(), &next);
    let (warm, _) = solve(true, start, &next);
    assert_eq!(warm.factorisations, plain.factorisations, "{warm:?}");
    assert!(plain.factorisations > 0 && warm.residual.absolute <= 1e-9 * FALL, "{plain:?}, {warm:?}");
}

/// A good start is not lost to a budget that ends in a worse place.
fn a_start_better_than_what_a_budget_reaches_is_kept<S: Space>() {
    let problem = wall::<S>(5, 6, 0.5);
    let mut start = Impulses::zero(&problem);
    let good = SolveSettings { tolerance: 1e-6 * FALL, ..SolveSettings::default() };
    SolverKind::Exact.make().solve(&problem, &good, &mut start);
    let before = residual(&problem, &start).absolute;
    for factorisations in 0..3 {
        let settings = SolveSettings { tolerance: 1e-18, factorisations, ..SolveSettings::default() };
        let mut found = start.clone();
        let outcome = SolverKind::Exact.make().solve(&problem, &settings, &mut found);
        assert_eq!(outcome.stop, Stop::OutOfFactorisations, "{outcome:?}");
        assert!(residual(&problem, &found).absolute <= before, "{outcome:?}");
    }
}

in_both_spaces! {
    a_long_solve_ends_with_what_will_do_and_never_starts_over;
    polished_impulses_are_well_below_the_tolerance;
    a_spent_budget_gives_the_best_so_far_and_says_so;
    a_start_better_than_what_a_budget_reaches_is_kept;
}
