//! One collision at a time (theory chapter 4, items 20-25): each approaching contact gets the impulse of an
//! isolated collision, gamma = -(1+c_r) m_eff u_n, whose effect its neighbours feel before their turn;
//! rounds go on until nothing approaches. Impulses are never taken back, so the answer depends on the order
//! and is not that of the simultaneous law; its residual says by how much.

use crate::cone::project_tangent;
use crate::impulse_solver::{ImpulseSolver, SolveSettings};
use crate::outcome::{Outcome, Stop};
use crate::prepared::{Prepared, PreparedContact};
use crate::problem::{ContactProblem, FrictionLaw, Impulse, Impulses, Twist};
use crate::residual::residual_of;
use carom_math::{Column, Space};

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
    fn solve(&mut self, problem: &ContactProblem<S>, settings: &SolveSettings, impulses: &mut Impulses<S>) -> Outcome {
        if !problem.rows.is_empty() {
            let reason = "the sequential solver resolves collisions only; bounded rows need pgs, pgs_matrix or lemke";
            return Outcome {
                iterations: 0,
                residual: crate::residual::residual(problem, impulses),
                stop: Stop::Refused(reason.into()),
            };
        }
        self.prepared.update(problem);
        self.velocities.clear();
        self.velocities.extend_from_slice(&problem.velocities);
        // a collision that has happened cannot be warm-started: every solve begins with no impulse
        impulses.reset(problem);
        let mut rounds = 0;
        let mut approach = f64::INFINITY;
        while rounds < settings.iterations && approach > settings.tolerance {
            approach = 0.0;
            for (c, g) in self.prepared.contacts.iter().zip(&mut impulses.contacts) {
                approach = approach.max(collide(c, g, problem.friction_law, &mut self.velocities));
            }
            rounds += 1;
            if approach == 0.0 {
                break;
            }
        }
        let residual = residual_of(problem, &self.prepared, impulses);
        let stop = if approach <= settings.tolerance { Stop::Converged } else { Stop::OutOfIterations };
        Outcome { iterations: rounds, residual, stop }
    }
}

/// Resolves one collision when the contact approaches; returns the speed of approach it found \[m/s\].
/// A first impact ends with the contact's target velocity, a later one with restitution of its own approach.
pub fn collide<S: Space>(c: &PreparedContact<S>, total: &mut Impulse<S>, law: FrictionLaw, v: &mut [Twist<S>]) -> f64 {
    let normal_velocity = c.normal.velocity(v);
    let floor = c.target.min(0.0);
    let approach = floor - normal_velocity;
    if approach <= 0.0 {
        return 0.0;
    }
    let after = if c.target > 0.0 { c.restitution * -normal_velocity } else { c.target };
    let normal = c.normal_mass * (after - normal_velocity);
    c.normal.apply(normal, v);
    total.normal += normal;
    if c.friction > 0.0 {
        let trial = c.slip(v) * -c.tangent_mass;
        let tangent = project_tangent::<S>(trial, c.friction * normal, law);
        c.apply_tangent(tangent, v);
        total.tangent += tangent;
    }
    debug_assert!(total.normal >= 0.0 && total.tangent.is_finite());
    approach
}
