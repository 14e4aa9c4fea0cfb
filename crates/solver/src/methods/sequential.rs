//! One collision at a time (theory eqs. 3.8, 3.16, 3.17 and 4.20; items 20-25): each approaching contact gets the
//! impulse of an isolated collision, gamma = -(1+c_r) m_eff u_n, then the friction that this impulse presses for;
//! its neighbours feel both before their turn, and rounds in the contacts' order go on until nothing approaches.
//! Impulses are never taken back, so the answer depends on the order and is not that of the simultaneous law; its
//! residual says by how much. No collision gains energy, friction included, unless a slip is asked for: each ends with
//! `slip_target` inside its friction limit. Knows no bounded rows.

use crate::friction::friction_impulse;
use crate::impulse_solver::{ImpulseSolver, SolveSettings};
use crate::methods::{overflow, resisted};
use crate::outcome::{Outcome, Stop};
use crate::prepared::{Prepared, PreparedContact};
use crate::problem::{ContactProblem, FrictionLaw, Impulse, Impulses, Twist};
use crate::residual::residual;
use crate::watch::Watch;
use carom_math::Space;

/// The sequential solver; holds memory between solves, nothing else.
#[derive(Clone, Debug, Default)]
pub struct Sequential<S: Space> {
    prepared: Prepared<S>,
    velocities: Vec<Twist<S>>,
}

impl<S: Space> ImpulseSolver<S> for Sequential<S> {
    fn name(&self) -> &'static str {
        "sequential"
    }
    fn refusal(&self, problem: &ContactProblem<S>) -> Option<String> {
        let rows =
            "the sequential solver resolves collisions only; bounded rows need pgs, pgs_matrix or lemke";
        resisted(problem, "sequential").or_else(|| (!problem.rows.is_empty()).then(|| rows.into()))
    }
    fn work(
        &mut self,
        problem: &ContactProblem<S>,
        settings: &SolveSettings,
        impulses: &mut Impulses<S>,
        _watch: &mut Watch,
    ) -> Outcome {
        self.prepared.update(problem);
        self.velocities.clear();
        self.velocities.extend_from_slice(&problem.velocities);
        // a collision that has happened cannot be warm-started: every solve begins with no impulse
        let given = std::mem::take(impulses);
        impulses.reset(problem);
        let bounces = |c: &PreparedContact<S>| c.target > 0.0 && c.restitution > 0.0;
        if self.prepared.contacts.iter().any(bounces) {
            // in an impact a contact that nothing has reached yet, with its target still zero, bounces when a blow
            // arrives; where nothing bounces at first, contacts at rest go on resting
            let idle = |c: &&mut PreparedContact<S>| c.target == 0.0 && c.restitution > 0.0;
            self.prepared.contacts.iter_mut().filter(idle).for_each(|c| c.target = f64::MIN_POSITIVE);
        }
        let mut rounds = 0;
        let mut approach = f64::INFINITY;
        while rounds < settings.iterations && approach > settings.tolerance {
            approach = 0.0;
            for (c, g) in self.prepared.contacts.iter().zip(&mut impulses.contacts) {
                approach = approach.max(collide(c, g, problem.friction_law, &mut self.velocities));
            }
            rounds += 1;
        }
        if let Some(refusal) = overflow(problem, rounds, &given, impulses) {
            return refusal;
        }
        let residual = residual(problem, impulses);
        let stop = if approach <= settings.tolerance { Stop::Converged } else { Stop::OutOfIterations };
        Outcome::new(rounds, residual, stop)
    }
}

/// Resolves one collision when the contact approaches; returns the speed of approach it found \[m/s\].
/// A contact with restitution and a target > 0 bounces from its own approach. Any other contact ends with its
/// target, which it approaches when it is slower: a gap that may close (target < 0), rest, or a speed asked for.
pub fn collide<S: Space>(
    c: &PreparedContact<S>,
    total: &mut Impulse<S>,
    law: FrictionLaw,
    v: &mut [Twist<S>],
) -> f64 {
    let (mut a, mut b) = c.pair(v);
    let before = c.normal.velocity_between(&a, &b);
    let bounces = c.target > 0.0 && c.restitution > 0.0;
    let (floor, after) = if bounces { (0.0, -c.restitution * before) } else { (c.target, c.target) };
    let approach = floor - before;
    if approach.is_nan() || approach <= 0.0 {
        return 0.0;
    }
    let normal = c.normal_mass * (after - before);
    c.push_normal(normal, &mut a, &mut b);
    total.normal += normal;
    if c.friction > 0.0 {
        let tangent = friction_impulse(c, c.slip_between(&a, &b), c.friction * normal, law);
        c.push(&Impulse { normal: 0.0, tangent }, &mut a, &mut b);
        total.tangent += tangent;
    }
    c.store((a, b), v);
    approach
}
