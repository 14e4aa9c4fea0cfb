//! The solvers, one per file, and how the iterative ones end.

use crate::outcome::{Outcome, Stop};
use crate::prepared::Prepared;
use crate::problem::{ContactProblem, Impulses};
use crate::residual::residual_of;
use carom_math::Space;

pub mod direct;
pub mod lemke;
pub mod pgs;
pub mod pgs_matrix;
pub mod sequential;

/// Judges impulses that may have outgrown the numbers: friction can jam bodies so that no impulses solve the
/// problem, and a sweep's grow without end. The impulses are then put back to those `given`.
fn judged<S: Space>(
    problem: &ContactProblem<S>,
    prepared: &Prepared<S>,
    (iterations, tolerance): (usize, f64),
    given: &Impulses<S>,
    impulses: &mut Impulses<S>,
) -> Outcome {
    let residual = residual_of(problem, prepared, impulses);
    if residual.absolute.is_finite() && impulses.is_finite() {
        return Outcome::judged(iterations, residual, tolerance);
    }
    impulses.copy_from(given);
    let reason = format!(
        "the impulses outgrow all numbers after {iterations} iterations: has the problem a solution?"
    );
    Outcome { iterations, residual: residual_of(problem, prepared, impulses), stop: Stop::Refused(reason) }
}
