//! One collision after another, in the contacts' order, each with restitution of its own approach, until
//! nothing approaches (theory chapter 4, items 20-25). Passes a blow on; not symmetric. Its residual is the
//! approach that is left.

use crate::impact::{Thresholds, judged_by_approach};
use carom_math::Space;
use carom_solver::methods::sequential::collide;
use carom_solver::prepared::Prepared;
use carom_solver::{ContactProblem, Impulses, Outcome, SolveSettings};

/// Rounds in which collisions may bounce; after them every collision is plastic, which ends.
const BOUNCING_ROUNDS: usize = 200;

/// Resolves collisions one by one.
pub fn solve<S: Space>(
    problem: &ContactProblem<S>,
    thresholds: &Thresholds,
    settings: &SolveSettings,
    impulses: &mut Impulses<S>,
) -> Outcome {
    let mut prepared = Prepared::of(problem);
    let mut velocities = problem.velocities.clone();
    let mut rounds = 0;
    let mut approach = f64::INFINITY;
    while approach > thresholds.still_speed && rounds < BOUNCING_ROUNDS.max(settings.iterations) {
        approach = 0.0;
        for (k, c) in prepared.contacts.iter_mut().enumerate() {
            let speed = -c.normal.velocity(&velocities);
            let held = problem.contacts[k].target.min(0.0);
            let bounces = rounds < BOUNCING_ROUNDS && problem.contacts[k].gap <= thresholds.touching;
            let restitution = problem.contacts[k].restitution;
            c.target = if bounces && speed > thresholds.rest_speed { restitution * speed } else { held };
            approach = f64::max(approach, collide(c, &mut impulses.contacts[k], problem.friction_law, &mut velocities));
        }
        rounds += 1;
    }
    let left = prepared.contacts.iter().zip(&problem.contacts).map(|(c, given)| {
        given.target.min(0.0) - c.normal.velocity(&velocities)
    });
    judged_by_approach(rounds, left.fold(0.0, f64::max), settings.tolerance.max(thresholds.still_speed))
}
