//! Times a solver on a problem from zero impulses: the best of some repeats within a budget, the time that the
//! thread spends in the whole call of `FrictionSolver::solve`. Short calls are timed several at a time.

use crate::clock::thread_seconds;
use carom::solver::{FrictionOutcome, FrictionProblem, FrictionSettings, FrictionSolver};
use std::time::Instant;

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
    /// Time of the call \[s\]: by the clock on the wall where it is `BRIEF`, CPU time where it is not.
    pub seconds: f64,
    /// What the solver says of the solve alone: wall-clock time without the final measure \[s\].
    pub inside: f64,
    /// What the first call came to.
    pub outcome: FrictionOutcome,
    /// The impulses of the first call.
    pub impulses: Vec<f64>,
}

/// Reading the clock takes a good part of a microsecond: calls shorter than this \[s\] are timed so many at a time that
/// they fill it together, at most `MANY`. The timed programs of the references do the same.
const SHORT: f64 = 20e-6;
const MANY: f64 = 64.0;

/// What is timed in less \[s\] is timed by the clock on the wall: it can be repeated until nobody disturbs it, and the CPU clock of
/// a machine that others share loses time now and then, so that its best of many is too good. The timed programs of the
/// references do the same.
const BRIEF: f64 = 10e-3;

/// Times a solver.
pub fn time(
    solver: &mut dyn FrictionSolver,
    problem: &FrictionProblem,
    settings: &FrictionSettings,
    rules: &Rules,
) -> Timed {
    let mut best = calls(solver, problem, settings, (rules, 1));
    let mut spent = best.seconds;
    for _ in 1..rules.repeats {
        if spent + best.seconds > rules.budget {
            break;
        }
        let count = if best.seconds < SHORT { (SHORT / best.seconds).ceil().min(MANY) as usize } else { 1 };
        let again = calls(solver, problem, settings, (rules, count));
        spent += count as f64 * again.seconds;
        best.seconds = best.seconds.min(again.seconds);
        best.inside = best.inside.min(again.inside);
    }
    best
}

/// So many calls one after another; the seconds of one of them.
fn calls(
    solver: &mut dyn FrictionSolver,
    problem: &FrictionProblem,
    settings: &FrictionSettings,
    (rules, count): (&Rules, usize),
) -> Timed {
    let mut impulses = vec![vec![0.0; problem.velocity.len()]; count];
    let (mut first, mut inside) = (None, f64::INFINITY);
    let start = thread_seconds();
    let wall = Instant::now();
    // the clock on the wall is cheap to read and never behind
    let in_time = || wall.elapsed().as_secs_f64() < rules.limit || thread_seconds() - start < rules.limit;
    for impulses in &mut impulses {
        let mut watch = |_: &carom::solver::Progress| in_time();
        let outcome = solver.solve(problem, settings, impulses, &mut watch);
        inside = outcome.seconds.min(inside);
        first.get_or_insert(outcome);
    }
    let on_the_wall = wall.elapsed().as_secs_f64();
    let spent = if on_the_wall < BRIEF { on_the_wall } else { thread_seconds() - start };
    let outcome = first.expect("at least one call is made");
    Timed { seconds: spent / count as f64, inside, outcome, impulses: impulses.swap_remove(0) }
}

/// Iterations of all stages together.
pub fn iterations(outcome: &FrictionOutcome) -> usize {
    outcome.stages.iter().map(|s| s.iterations).sum()
}
