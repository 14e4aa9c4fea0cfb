//! What needs no iteration over contacts: a single contact, and few contacts without friction.

use super::local::Local;
use super::principal_pivots::{LARGEST, pivoted};
use super::small_complementarity as small;
use crate::friction_measure::{Measure, measure};
use crate::friction_problem::{FrictionProblem, is_on_cone, project_on_cone};
use crate::friction_solver::{FrictionOutcome, FrictionSettings, Stage};
use smallvec::smallvec;

/// What was found at once: less to hand on than an outcome, which is written where it goes.
pub struct Found {
    measure: Measure,
    stage: Stage,
}

impl Found {
    /// The outcome.
    #[inline(always)]
    pub fn outcome(self) -> FrictionOutcome {
        FrictionOutcome {
            solved: true,
            measure: self.measure,
            stages: smallvec![self.stage],
            factorisations: 0,
            // two readings of a clock would take as long as the solve
            seconds: 0.0,
            reason: String::new(),
            strict_feasibility: None,
        }
    }
}

/// Solves such a problem; `None` when it is none or is not solved, and the impulses are then as they were.
#[inline(always)]
pub fn at_once(
    problem: &FrictionProblem,
    settings: &FrictionSettings,
    impulses: &mut [f64],
) -> Option<Found> {
    if impulses.len() <= small::LARGEST {
        with_room::<{ small::LARGEST }>(problem, settings, impulses)
    } else {
        with_room::<LARGEST>(problem, settings, impulses)
    }
}

/// The same for at most N numbers.
#[inline(always)]
fn with_room<const N: usize>(
    problem: &FrictionProblem,
    settings: &FrictionSettings,
    impulses: &mut [f64],
) -> Option<Found> {
    let mut room = [0.0; N];
    if impulses.len() > N {
        return None;
    }
    let (name, iterations) = match (problem.contacts(), problem.dimension) {
        (1, 2) => ("one contact", alone::<2>(problem, &mut room[..2])),
        (1, 3) => ("one contact", alone::<3>(problem, &mut room[..3])),
        (_, 1) => complementary(problem, settings, impulses, &mut room)?,
        _ => return None,
    };
    let found = &room[..impulses.len()];
    let measure = measure(problem, found);
    if !measure.solves(settings.tolerance) {
        return None;
    }
    impulses.copy_from_slice(found);
    Some(Found { measure, stage: Stage { name, iterations } })
}

/// The impulses of few contacts without friction, how they were found, and the rounds it took. There is room for more.
fn complementary(
    problem: &FrictionProblem,
    settings: &FrictionSettings,
    start: &[f64],
    room: &mut [f64],
) -> Option<(&'static str, usize)> {
    let q = &problem.velocity;
    let matrix = &problem.matrix.made(1).matrix;
    if q.len() <= small::LARGEST
        && let Some(ended) = small::solved(matrix, q, settings.tolerance, room)
    {
        return Some(ended);
    }
    let found = &mut room[..start.len()];
    found.copy_from_slice(start);
    Some(("pivots", pivoted(matrix, q, found)?))
}

/// The impulse of the only contact; the rounds it took.
fn alone<const D: usize>(problem: &FrictionProblem, impulses: &mut [f64]) -> usize {
    let block = problem.matrix.made(D).matrix.diagonal_block(0);
    let velocity = std::array::from_fn(|k| problem.velocity[k]);
    let mu = problem.friction[0];
    let (mut found, rounds) = Local::<D>::new(&block, mu).solve_only(&velocity);
    // a slip is on the cone to rounding, and to put it there again would take a tenth of the time
    if !is_on_cone(&found, mu) {
        project_on_cone(&mut found, mu);
    }
    impulses.copy_from_slice(&found);
    rounds
}
