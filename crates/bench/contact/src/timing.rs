//! Times a solver on a problem from zero impulses: the best of some repeats within a budget, the CPU time of the
//! thread in the whole call of `FrictionSolver::solve`.

use crate::clock::thread_seconds;
use carom::solver::{FrictionOutcome, FrictionProblem, FrictionSettings, FrictionSolver};

/// How often and how long.
#[derive(Clone, Copy, Debug)]
pub struct Rules {
    /// Most calls.
    pub repeats: usize,
    /// No further call is begun that would end beyond this \[s\].
    pub budget: f64,
    /// A call is asked to stop when it has taken this long \[s\].
    pub limit: f64,
}

impl Default for Rules {
    fn default() -> Self {
        Rules { repeats: 100, budget: 0.5, limit: 10.0 }
    }
}

/// The best of the calls.
pub struct Timed {
    /// CPU time of the call \[s\].
    pub seconds: f64,
    /// What the solver says of the solve alone: wall-clock time without the final measure \[s\].
    pub inside: f64,
    /// What the first call came to.
    pub outcome: FrictionOutcome,
    /// The impulses of the first call.
    pub impulses: Vec<f64>,
}

/// Times a solver.
pub fn time(
    solver: &mut dyn FrictionSolver,
    problem: &FrictionProblem,
    settings: &FrictionSettings,
    rules: &Rules,
) -> Timed {
    let mut call = || {
        let mut impulses = vec![0.0; problem.velocity.len()];
        let start = thread_seconds();
        let mut watch = |_: &carom::solver::Progress| thread_seconds() - start < rules.limit;
        let outcome = solver.solve(problem, settings, &mut impulses, &mut watch);
        let seconds = thread_seconds() - start;
        Timed { seconds, inside: outcome.seconds, outcome, impulses }
    };
    let mut best = call();
    let mut spent = best.seconds;
    for _ in 1..rules.repeats {
        if spent + best.seconds > rules.budget {
            break;
        }
        let again = call();
        spent += again.seconds;
        best.seconds = best.seconds.min(again.seconds);
        best.inside = best.inside.min(again.inside);
    }
    best
}

/// Iterations of all stages together.
pub fn iterations(outcome: &FrictionOutcome) -> usize {
    outcome.stages.iter().map(|s| s.iterations).sum()
}
