//! One collision after another, the fastest approach first, each with restitution of its own approach, until
//! nothing approaches (theory eq. 4.19, items 20-25). Passes a blow on; not symmetric where approaches tie: the
//! first contact goes first. Its residual is the approach that is left.

use crate::impact::{Role, Thresholds, judged_by_approach};
use carom_math::Space;
use carom_solver::methods::sequential::collide;
use carom_solver::prepared::Prepared;
use carom_solver::{ContactProblem, Impulses, Outcome, SolveSettings};

/// Collisions per contact that may bounce; after them every collision is plastic, which ends.
const BOUNCING: usize = 200;

/// Resolves collisions one by one; `bounced` says afterwards which contacts bounced at least once. Returns also
/// whether bounces did not end by themselves.
pub fn solve<S: Space>(
    problem: &ContactProblem<S>,
    limits: &Thresholds,
    settings: &SolveSettings,
    bounced: &mut [bool],
    impulses: &mut Impulses<S>,
) -> (Outcome, bool) {
    let mut prepared = Prepared::of(problem);
    let mut velocities = problem.velocities.clone();
    let contacts = problem.contacts.len();
    let (most_bounces, most) = (BOUNCING * contacts, BOUNCING.max(settings.iterations) * contacts);
    bounced.fill(false);
    let mut collisions = 0;
    let mut left = 0.0;
    while collisions < most {
        let may_bounce = collisions < most_bounces;
        // the fastest approach, and what it is to end with
        let mut next = (0.0, 0, 0.0);
        for (k, c) in prepared.contacts.iter().enumerate() {
            let u = c.normal.velocity(&velocities);
            let given = &problem.contacts[k];
            let target = match limits.role(given.gap, u, given.restitution) {
                Role::Bounces if may_bounce => -given.restitution * u,
                Role::Pending => continue,
                _ => limits.closing(given.gap),
            };
            let approach = target.min(0.0) - u;
            if approach > next.0 {
                next = (approach, k, target);
            }
        }
        let (approach, k, target) = next;
        left = approach;
        if approach <= limits.still_speed {
            break;
        }
        let c = &mut prepared.contacts[k];
        c.target = target;
        bounced[k] |= target > 0.0;
        collide(c, &mut impulses.contacts[k], problem.friction_law, &mut velocities);
        collisions += 1;
    }
    let outcome = judged_by_approach(collisions, left, settings.tolerance.max(limits.still_speed));
    (outcome, collisions > most_bounces)
}
