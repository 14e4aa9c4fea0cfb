//! A contact without friction between a body and an obstacle at rest, and nothing else: most contacts of a heap that has
//! slid apart. As the ladder solves it in a problem of its own, without the problem.

use super::Ladder;
use crate::impulse_solver::{ImpulseChoice, SolveSettings};
use crate::outcome::AtOnce;
use crate::problem::{InverseMass, Twist};
use crate::residual::left_on_normal;
use carom_math::{Column, Inertia, Space};

/// A body's contact without friction with an obstacle at rest.
#[derive(Clone, Copy, Debug)]
pub struct Resting<S: Space> {
    /// Unit normal out of the obstacle.
    pub normal: S::Vector,
    /// Contact point relative to the body's centre of mass \[m\].
    pub arm: S::Vector,
    /// Normal velocity that it ends with if it presses \[m/s\].
    pub target: f64,
    /// The body's inverse mass.
    pub mass: InverseMass<S>,
    /// The body's velocity without the contact.
    pub velocity: Twist<S>,
}

impl<S: Space> Ladder<S> {
    /// The impulse \[N s\], and how it was found where it presses. `None` where the first solver does not do it at once, or not
    /// well enough.
    pub(super) fn resting(&self, c: &Resting<S>, settings: &SolveSettings) -> Option<(f64, Option<AtOnce>)> {
        if settings.impulses != ImpulseChoice::Any {
            return None;
        }
        if c.velocity.at(c.arm).dot(c.normal) >= c.target {
            return Some((0.0, None));
        }
        let moment = S::moment(c.arm, c.normal);
        let turn = c.mass.angular.apply(moment);
        let along = |v: &Twist<S>| c.normal.dot(v.linear) + moment.dot(v.angular);
        let inverse_effective_mass = c.mass.linear * c.normal.norm_squared() + moment.dot(turn);
        let (before, normal_mass) = (along(&c.velocity), 1.0 / inverse_effective_mass);
        let impulse = self.own.first().alone_on_normal(before - c.target, normal_mass)?;
        let linear = c.velocity.linear + c.normal * impulse * c.mass.linear;
        let after = Twist::new(linear, c.velocity.angular + turn * impulse);
        let residual = left_on_normal(impulse / normal_mass, (before, along(&after)), c.target);
        Some((impulse, Some(self.found_at_once(residual, settings.tolerance)?)))
    }
}
