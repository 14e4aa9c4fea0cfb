//! A contact problem in matrix form: W = J M^-1 J^T and q = J v - target over the contacts (theory chapter 5).

use carom::solver::{FrictionProblem, delassus};
use carom::{ContactProblem, Space};

/// The matrix form of a problem without bounded rows: what solvers of `FrictionProblem` read.
///
/// # Panics
/// When the problem has bounded rows, which the matrix form has no place for.
pub fn matrix_form<S: Space>(problem: &ContactProblem<S>) -> FrictionProblem {
    assert!(problem.rows.is_empty(), "a friction problem has no bounded rows");
    FrictionProblem {
        dimension: 1 + S::SLIP,
        matrix: delassus::delassus(problem).into(),
        velocity: delassus::right_hand_side(problem).into_iter().map(|b| -b).collect(),
        friction: problem.contacts.iter().map(|c| c.friction).collect(),
    }
}
