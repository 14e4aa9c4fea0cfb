//! What the last step left to look at.

use super::World;
use crate::force::Wrench;
use crate::narrow_phase::Touch;
use crate::observe::event_log::{ContactSum, EventLog};
use carom_geometry::Geometry;
use carom_solver::{ContactProblem, Impulse, Impulses, Twist};

impl<S: Geometry> World<S> {
    /// Contacts found at the start of the last step.
    pub fn touches(&self) -> &[Touch<S>] {
        self.schemes.touches(&self.touches)
    }
    /// The contact problem of the last step, its impulses, and for each of its contacts the index into `touches`.
    pub fn last_problem(&self) -> (&ContactProblem<S>, &Impulses<S>, &[usize]) {
        self.schemes.contact(&self.bodies)
    }
    /// The impact problem of the last step's first round, its impulses, and for each of its contacts the index into
    /// `touches`; no indices when nothing struck.
    pub fn last_impacts(&self) -> (&ContactProblem<S>, &Impulses<S>, &[usize]) {
        let impacts = self.schemes.impacts();
        (&impacts.problem, &impacts.impulses, &impacts.struck)
    }
    /// Impulses that the last step's impacts gave to each of its touches, in contact frames.
    pub fn last_strikes(&self) -> &[Impulse<S>] {
        &self.schemes.impacts().totals
    }
    /// Moments of rolling and spinning friction that the last step's impacts gave to each of its touches, on body a,
    /// in world axes.
    pub fn last_strike_moments(&self) -> &[S::Spin] {
        &self.schemes.impacts().moments
    }
    /// What happened in the last step, act by act; `None` unless the scheme with events took it.
    pub fn last_events(&self) -> Option<&EventLog<S>> {
        self.schemes.log()
    }
    /// What each of `touches` did in the whole last step, over its flows and impacts; `None` unless the scheme with
    /// events took it. Its last problem and impulses are those of each island's last flow.
    pub fn last_sums(&self) -> Option<&[ContactSum<S>]> {
        self.schemes.sums()
    }
    /// Applied loads of the last step on each body, their mean over the step; entries of bodies that forces do not
    /// move mean nothing.
    pub fn last_loads(&self) -> &[Wrench<S>] {
        self.schemes.loads()
    }
    /// How far the last step's position correction moved \[m\] and turned \[rad\] each body; empty when it moved none,
    /// and for the scheme with events, which projects within its step.
    pub fn last_correction(&self) -> &[Twist<S>] {
        self.schemes.correction()
    }
}
