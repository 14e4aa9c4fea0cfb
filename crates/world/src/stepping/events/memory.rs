//! What a flow tells the next of its contacts: who pressed, who stuck, and what turned. Contacts hold on the mean, at the
//! mean place (theory section 8.2); at the flow's ends their bodies move against each other by what turns half-way to
//! there. That is neither an approach to be struck nor a slip to be stopped: friction would take m slip^2/2 of the energy
//! for it, step by step. It is told from a push by its size, for which the turning is a bound.

use super::flow::Stick;
use super::limits::Limits;
use super::rounds::Rounds;
use super::slipping::{NO_SLIP, STOPPED, slip_of};
use super::together::Together;
use crate::warm_start::hand_over;
use carom_geometry::Geometry;
use carom_math::Column;
use carom_solver::Twist;
use serde::{Deserialize, Serialize};

/// Velocity that a contact which holds may have at a flow's end, over what turns half-way to there \[1\].
pub(super) const TURNED: f64 = 2.0;
/// What is left of that a step later \[1\], for where a rolling body turns back it stands still for a moment and nothing
/// turns. Bodies that have come to rest are soon held to none.
const FADES: f64 = 0.8;

/// What the flow before tells of its contacts.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Memory {
    /// Those that pressed, by name, ascending.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub pressed: Vec<u64>,
    /// Those that stuck, by name, ascending.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub stuck: Vec<u64>,
    /// Velocity \[m/s\] that turning has lately left of those that act, by name, ascending.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub turned: Vec<(u64, f64)>,
}

/// What is left of what turning left once a flow of so long is over \[1\].
pub(super) fn faded(time: f64, limits: &Limits) -> f64 {
    libm::pow(FADES, time / limits.dt)
}

impl Memory {
    /// Adds what others remember.
    pub fn take_over(&mut self, others: Memory) {
        hand_over(&mut self.pressed, others.pressed);
        hand_over(&mut self.stuck, others.stuck);
        hand_over(&mut self.turned, others.turned);
    }
    /// True for a contact that pressed.
    pub(super) fn has_pressed(&self, id: u64) -> bool {
        self.pressed_as(id).is_some()
    }
    /// The place of a contact among those that pressed.
    pub(super) fn pressed_as(&self, id: u64) -> Option<usize> {
        self.pressed.binary_search(&id).ok()
    }
    /// Velocity of a contact that turning has left \[m/s\].
    pub(super) fn turned(&self, id: u64) -> f64 {
        self.turned.binary_search_by_key(&id, |t| t.0).map_or(0.0, |k| self.turned[k].1)
    }
    /// Slip of a contact that is none \[m/s\]: noise, or what a flow leaves in which it stuck.
    pub fn no_slip(&self, id: u64) -> f64 {
        if self.stuck.binary_search(&id).is_ok() { NO_SLIP + self.turned(id) } else { NO_SLIP }
    }
    /// Puts the lists in order.
    pub fn sort(&mut self) {
        for names in [&mut self.pressed, &mut self.stuck] {
            // lists in order, one after another
            names.sort();
            names.dedup();
        }
        self.turned.sort_by_key(|t| t.0);
        self.turned.dedup_by_key(|t| t.0);
    }
}

impl<S: Geometry> Together<'_, S> {
    fn known(&self) -> &Memory {
        self.memory.as_ref().unwrap_or(&self.warm.contacts)
    }

    /// True for a contact that pressed in the last flow.
    pub fn has_pressed(&self, id: u64) -> bool {
        self.known().has_pressed(id)
    }

    /// Velocity of a contact that turning has left \[m/s\]: it asks for no stop.
    pub fn turned(&self, id: u64) -> f64 {
        self.known().turned(id)
    }

    /// What a flow tells of its contacts, but for those that pressed; bodies are at its middle.
    pub fn recall(&self, rounds: &Rounds<S>) -> Memory {
        let Rounds { last, active, start, after, .. } = rounds;
        let mut memory = Memory::default();
        let faded = faded(last.time, self.limits);
        let contacts = last.problem.contacts.iter().zip(&last.impulses.contacts).enumerate();
        for (k, (c, _)) in contacts.filter(|(_, (_, impulse))| impulse.normal > 0.0) {
            let first = &active.touches[k];
            let turning = |i: usize, arm: S::Vector, twist: &Twist<S>| {
                (arm - (first.point - start.position[i])).norm() * twist.angular.norm()
            };
            let (normal, slip) = c.relative_velocity(after);
            let leaned = (c.normal - first.normal).norm() * (normal.abs() + slip.norm());
            let turns = turning(c.a, c.arm_a, &after[c.a]) + turning(c.b, c.arm_b, &after[c.b]) + leaned;
            let turned = (TURNED * turns).max(faded * self.turned(c.id));
            if turned > 0.0 {
                memory.turned.push((c.id, turned));
            }
            if c.friction > 0.0 && self.sticks(rounds, k) {
                memory.stuck.push(c.id);
            }
        }
        memory.sort();
        memory
    }

    /// True for a contact that sticks through a flow, or comes to its stop where it ends.
    fn sticks(&self, rounds: &Rounds<S>, contact: usize) -> bool {
        let Rounds { last, active, start, before, after, .. } = rounds;
        let c = &last.problem.contacts[contact];
        let end = c.relative_velocity(after).1;
        let held = match last.stick {
            Stick::Mean => (end + c.relative_velocity(before).1).norm(),
            Stick::End => end.norm(),
        };
        let begun = || slip_of(start, &active.touches[contact]).norm();
        held <= self.limits.still_speed || end.norm() <= 2.0 * STOPPED * begun()
    }
}
