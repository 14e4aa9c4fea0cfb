//! What a solve came to: a value, never a panic.

use crate::residual::Residual;
use serde::{Deserialize, Serialize};

/// Why a solver stopped.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Stop {
    /// The residual is at or below the tolerance.
    Converged,
    /// The method is at its end (iterations spent, or a direct answer that rounding spoils) with a residual above
    /// the tolerance: the residual is what it is.
    OutOfIterations,
    /// The method cannot solve this problem; the reason says why. The impulses are left as they were given.
    Refused(String),
    /// Whoever watched the solve asked to stop: the impulses are the best so far.
    Interrupted,
}

/// Result of one solve.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Outcome {
    /// Iterations (sweeps, pivots, rounds) spent.
    pub iterations: usize,
    /// Residual of the impulses returned.
    pub residual: Residual,
    /// Why the solver stopped.
    pub stop: Stop,
}

impl Outcome {
    /// The outcome of a problem without rows.
    pub fn nothing_to_do() -> Self {
        Outcome { iterations: 0, residual: Residual::default(), stop: Stop::Converged }
    }
    /// Judges impulses by their residual.
    pub fn judged(iterations: usize, residual: Residual, tolerance: f64) -> Self {
        let stop = if residual.absolute <= tolerance { Stop::Converged } else { Stop::OutOfIterations };
        Outcome { iterations, residual, stop }
    }
}
