//! One collision after another, the fastest approach first, each with restitution of its own approach and slip, until
//! nothing approaches (theory eqs. 3.19 and 4.19, items 20-25). Passes a blow on; not symmetric where approaches tie: the
//! first contact goes first. Its residual is the approach that is left. A collision gains no energy unless its slip is
//! turned round; one that would is guarded: its slip is stopped.

use crate::impact::{Role, Thresholds, guard, judged_by_approach};
use carom_math::{Column, Space};
use carom_solver::methods::sequential::collide;
use carom_solver::prepared::{Prepared, PreparedContact};
use carom_solver::{ContactProblem, FrictionLaw, Impulse, Impulses, Outcome, SolveSettings, Twist};

/// Collisions per contact that may bounce; after them every collision is plastic, which ends.
const BOUNCING: usize = 200;

/// What the law is to do beside the problem.
pub struct Asked<'a> {
    /// Speeds that tell kinds of contact apart.
    pub limits: &'a Thresholds,
    /// Tangential restitution of each contact \[1\].
    pub turned: &'a [f64],
    /// True where collisions that would gain energy are guarded.
    pub clamp: bool,
}

/// What the law came to.
pub struct Ended {
    /// Collisions, and the approach that is left.
    pub outcome: Outcome,
    /// True when bounces did not end by themselves.
    pub plastic: bool,
    /// Collisions that were guarded.
    pub guarded: usize,
}

/// Resolves collisions one by one; `bounced` says afterwards which contacts bounced at least once.
pub fn solve<S: Space>(
    problem: &ContactProblem<S>,
    asked: &Asked,
    settings: &SolveSettings,
    bounced: &mut [bool],
    impulses: &mut Impulses<S>,
) -> Ended {
    let limits = asked.limits;
    let mut prepared = Prepared::of(problem);
    let mut velocities = problem.velocities.clone();
    let contacts = problem.contacts.len();
    let (most_bounces, most) = (BOUNCING * contacts, BOUNCING.max(settings.iterations) * contacts);
    bounced.fill(false);
    let (mut collisions, mut guarded) = (0, 0);
    let mut left = 0.0;
    while collisions < most {
        let (approach, k, target) =
            fastest(problem, &prepared, &velocities, limits, collisions < most_bounces);
        left = approach;
        if approach <= limits.still_speed {
            break;
        }
        let c = &mut prepared.contacts[k];
        c.target = target;
        c.slip_target = S::Slip::ZERO;
        bounced[k] |= target > 0.0;
        let share = if target > 0.0 { asked.turned[k] } else { 0.0 };
        let total = &mut impulses.contacts[k];
        if share > 0.0 {
            guarded +=
                usize::from(!turn(c, share, asked.clamp, total, problem.friction_law, &mut velocities));
        } else {
            collide(c, total, problem.friction_law, &mut velocities);
        }
        collisions += 1;
    }
    let outcome = judged_by_approach(collisions, left, settings.tolerance.max(limits.still_speed));
    Ended { outcome, plastic: collisions > most_bounces, guarded }
}

/// The fastest approach \[m/s\], its contact, and the normal velocity that it is to end with.
fn fastest<S: Space>(
    problem: &ContactProblem<S>,
    prepared: &Prepared<S>,
    velocities: &[Twist<S>],
    limits: &Thresholds,
    may_bounce: bool,
) -> (f64, usize, f64) {
    let mut next = (0.0, 0, 0.0);
    for (k, c) in prepared.contacts.iter().enumerate() {
        let u = c.normal.velocity(velocities);
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
    next
}

/// A collision that turns a share of the slip round; false where that would gain energy and the slip was stopped instead.
fn turn<S: Space>(
    c: &mut PreparedContact<S>,
    share: f64,
    clamp: bool,
    total: &mut Impulse<S>,
    law: FrictionLaw,
    velocities: &mut [Twist<S>],
) -> bool {
    let (given, pair) = (*total, c.pair(velocities));
    let (normal, slip) = c.relative_velocity(velocities);
    c.slip_target = slip * -share;
    collide(c, total, law, velocities);
    let own = Impulse { normal: total.normal - given.normal, tangent: total.tangent - given.tangent };
    let (then, left) = c.relative_velocity(velocities);
    let after = (then, left + c.slip_target);
    if !(clamp && guard::gains::<S>(&own, (normal, slip), after)) {
        return true;
    }
    *total = given;
    c.store(pair, velocities);
    c.slip_target = S::Slip::ZERO;
    collide(c, total, law, velocities);
    false
}
