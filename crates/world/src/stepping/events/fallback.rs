//! The rest of a step with too many events, taken at once: a plastic impulse that lets no gap close by more than it
//! is, then one flow in which every pair within reach holds n.ubar >= -gap / tau. It takes energy and never gives;
//! the ledger has a line for it.

use super::memory::Memory;
use super::push::Push;
use super::together::{Halt, Together, Tools};
use crate::narrow_phase::Touch;
use crate::observe::accounts::Cause;
use carom_geometry::Geometry;
use carom_math::Column;
use carom_solver::Twist;

impl<S: Geometry> Together<'_, S> {
    /// Moves the set by a time \[s\] without looking for events.
    pub fn fall_back(&mut self, time: f64, tools: &mut Tools<S>) -> Result<(), Halt> {
        let touches = self.within_reach(&[]);
        let before = self.twists();
        let closing: Vec<f64> = touches.iter().map(|t| -t.gap.max(0.0) / time).collect();
        let (touches, cause) = (touches.as_slice(), Cause::Fallback);
        let push = Push { touches, targets: &closing, velocities: &before, time: 0.0, cause };
        self.push(&push, before.clone(), None, tools)?;
        let start = self.bodies.motion.clone();
        let before = self.twists();
        let free = self.loaded(&before, time);
        for i in 0..self.bodies.len() {
            self.bodies.motion.position[i] += self.bodies.motion.velocity[i] * (0.5 * time);
        }
        // sums of start and end: twice the mean
        let sums: Vec<Twist<S>> = before
            .iter()
            .zip(&free)
            .map(|(b, f)| Twist::new(b.linear + f.linear, b.angular + f.angular))
            .collect();
        let twice: Vec<f64> = closing.iter().map(|c| 2.0 * c).collect();
        self.push(&Push { touches, targets: &twice, velocities: &sums, time, cause }, free, None, tools)?;
        let mut potential = 0.0;
        for (i, start_twist) in before.iter().enumerate() {
            let mean = (start_twist.linear + self.bodies.motion.velocity[i]) * 0.5;
            let after = self.bodies.motion.twist(i);
            self.drift(i, start.position[i], mean * time, (start_twist, &after));
            if self.bodies.is_dynamic(i) {
                let way = self.bodies.motion.position[i] - start.position[i];
                let mass = self.bodies.data[i].mass_properties.mass;
                potential += mass * self.settings.gravity.dot(mean * time - way);
            }
        }
        self.ledger.integrator += potential;
        self.turn(time);
        self.memory = Some(Memory::default());
        self.events.fallbacks += 1;
        Ok(())
    }

    /// All contacts that may come to touch within the step, but for those of pairs that have no other contact than one of
    /// these.
    pub fn within_reach(&mut self, known: &[Touch<S>]) -> Vec<Touch<S>> {
        let mut touches = Vec::with_capacity(self.pairs.len().min(2 * self.bodies.len()));
        let settled = self.settled_pairs(known);
        for k in (0..self.pairs.len()).filter(|&k| !settled[k]) {
            let (a, b) = self.pairs[k];
            let near_by = self.limits.touching(&self.bodies.data[a], &self.bodies.data[b]);
            self.find((a, b), self.reaches[a] + self.reaches[b] + near_by, &mut touches);
        }
        touches
    }
}
