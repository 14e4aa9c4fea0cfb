//! Every solver of contact problems on random structures: what it calls converged is within its tolerance by the
//! law as printed, formed dense from A and b; what it does not solve it refuses in words, with finite impulses inside
//! the cones.

use crate::contact::judge::{dense_law, noise};
use crate::contact::scenes::{KINDS, structure};
use crate::contact::solvers::assembled;
use carom_math::{Column, Space};
use carom_solver::{ContactProblem, Impulses, Outcome, SolveSettings, SolverKind, Stop};

/// Fails unless an answer keeps the contract; returns whether it is a solution.
#[track_caller]
fn certify<S: Space>(
    what: &str,
    problem: &ContactProblem<S>,
    settings: &SolveSettings,
    impulses: &Impulses<S>,
    outcome: &Outcome,
) -> bool {
    assert!(impulses.is_finite(), "{what}: {outcome:?}");
    for (c, g) in problem.contacts.iter().zip(&impulses.contacts) {
        let limit = c.friction * g.normal;
        assert!(g.normal >= 0.0, "{what}: a contact pulls with {:e}", g.normal);
        assert!(g.tangent.norm() <= limit * (1.0 + 1e-12) + f64::MIN_POSITIVE, "{what}: outside the cone");
    }
    match &outcome.stop {
        Stop::Refused(why) => assert!(!why.trim().is_empty(), "{what}: refused without a reason"),
        Stop::Converged => {
            let matrix = assembled(problem);
            let flat = impulses.flat();
            let size = matrix.velocity.iter().map(|q| q * q).sum::<f64>().sqrt();
            let off = dense_law(&matrix, &flat);
            let allowed = settings.tolerance * (1.0 + 1e-6) + 100.0 * noise(&matrix, &flat) * size;
            assert!(off <= allowed, "{what}: converged, off by {off:e} m/s of {:e}", settings.tolerance);
            return true;
        }
        _ => {}
    }
    false
}

/// All solvers by name, on all kinds of structures, at an ordinary and a sharp tolerance.
fn every_answer_on_structures_is_certified_or_refused<S: Space>() {
    let mut solved = vec![0; SolverKind::ALL.len()];
    for kind in 0..KINDS {
        for seed in 0..4 {
            let (what, problem) = structure::<S>(kind, seed);
            for (k, solver) in SolverKind::ALL.into_iter().enumerate() {
                for settings in [
                    SolveSettings::default(),
                    SolveSettings {
                        iterations: 300,
                        tolerance: 1e-9,
                        factorisations: 200,
                        ..SolveSettings::default()
                    },
                ] {
                    let mut impulses = Impulses::zero(&problem);
                    let outcome = solver.make().solve(&problem, &settings, &mut impulses);
                    let what = format!("{} at {:e} on {what}", solver.name(), settings.tolerance);
                    // one collision after another: its own law, which is not the simultaneous one
                    if solver != SolverKind::Sequential {
                        let good = certify(&what, &problem, &settings, &impulses, &outcome);
                        solved[k] += usize::from(good);
                    }
                }
            }
        }
    }
    for (solver, solved) in SolverKind::ALL.into_iter().zip(&solved) {
        println!("{}: {} solves {solved} of {}", S::NAME, solver.name(), 8 * KINDS);
        use SolverKind::{Direct, Enumeration, Lemke, Sequential};
        // the others are for any contacts; these for regular, polyhedral or few ones
        let special = matches!(solver, Sequential | Direct | Lemke | Enumeration);
        assert!(special || *solved > KINDS, "{} solves only {solved}", solver.name());
    }
}

in_both_spaces! {
    every_answer_on_structures_is_certified_or_refused;
}
