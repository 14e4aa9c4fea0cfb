//! The solvers, one per file, and how the iterative ones end.

use crate::outcome::{Outcome, Stop};
use crate::prepared::Prepared;
use crate::problem::{ContactProblem, Impulses, Twist};
use crate::residual::{residual, residual_in};
use carom_math::Space;

pub mod apgd;
pub mod auto;
pub mod direct;
pub mod enumeration;
pub mod first_order;
pub mod ladder;
pub mod lemke;
pub mod nncg;
pub mod on_bodies;
pub mod on_matrix;
pub mod pgs;
pub mod pgs_matrix;
pub mod sequential;

/// Judges impulses that an iteration ended with, unless they outgrew the numbers.
pub(crate) fn judged<S: Space>(
    problem: &ContactProblem<S>,
    prepared: &Prepared<S>,
    (iterations, tolerance): (usize, f64),
    given: &Impulses<S>,
    impulses: &mut Impulses<S>,
) -> Outcome {
    judged_in(problem, prepared, (iterations, tolerance), (given, impulses), &mut Vec::new())
}

/// The same with memory for the velocities after the impulses.
pub(crate) fn judged_in<S: Space>(
    problem: &ContactProblem<S>,
    prepared: &Prepared<S>,
    (iterations, tolerance): (usize, f64),
    (given, impulses): (&Impulses<S>, &mut Impulses<S>),
    after: &mut Vec<Twist<S>>,
) -> Outcome {
    overflow(problem, iterations, given, impulses).unwrap_or_else(|| {
        let residual = residual_in(problem, prepared, impulses, after);
        Outcome::judged(iterations, residual, tolerance)
    })
}

/// A refusal of a problem with rolling or spinning friction by a solver that knows none.
pub(crate) fn resisted<S: Space>(problem: &ContactProblem<S>, solver: &str) -> Option<String> {
    let reason = || format!("{solver} knows no rolling or spinning friction; pgs, nncg, apgd and exact do");
    (!problem.resistances.is_empty()).then(reason)
}

/// A refusal when impulses are no longer finite: friction can jam bodies so that no impulses solve the problem and a
/// sweep's grow without end. The impulses are then put back to those `given`.
fn overflow<S: Space>(
    problem: &ContactProblem<S>,
    iterations: usize,
    given: &Impulses<S>,
    impulses: &mut Impulses<S>,
) -> Option<Outcome> {
    if impulses.is_finite() {
        return None;
    }
    impulses.copy_from(given);
    let reason = format!(
        "the impulses outgrow all numbers after {iterations} iterations: has the problem a solution?"
    );
    Some(Outcome::new(iterations, residual(problem, impulses), Stop::Refused(reason)))
}
