//! The rest of a step with too many events, taken at once: a plastic impulse that lets no gap close by more than it
//! is, then one flow in which every pair within reach holds n.ubar >= -gap / tau. It takes energy and never gives;
//! the ledger has a line for it.

use super::together::{Halt, Together, Tools};
use crate::assembly;
use crate::bodies::Bodies;
use crate::narrow_phase::Touch;
use crate::observe::accounts::Cause;
use crate::observe::event_log::{Acted, EventKind, PieceKind};
use carom_geometry::Geometry;
use carom_math::Column;
use carom_solver::{ContactProblem, Impulses, Twist};

impl<S: Geometry> Together<'_, S> {
    /// Moves the set by a time \[s\] without looking for events.
    pub fn fall_back(&mut self, time: f64, tools: &mut Tools<S>) -> Result<(), Halt> {
        let touches = self.within_reach();
        let before = self.twists();
        let closing = |t: &Touch<S>| -t.gap.max(0.0) / time;
        self.impulse(&touches, &before, before.clone(), 0.0, &closing, tools)?;
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
        let twice = |t: &Touch<S>| -2.0 * t.gap.max(0.0) / time;
        self.impulse(&touches, &sums, free, time, &twice, tools)?;
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
        self.pressed = Some(Vec::new());
        self.events.fallbacks += 1;
        Ok(())
    }

    fn within_reach(&mut self) -> Vec<Touch<S>> {
        let mut touches = Vec::new();
        for k in 0..self.pairs.len() {
            let (a, b) = self.pairs[k];
            let near_by = self.limits.touching(&self.bodies.data[a], &self.bodies.data[b]);
            self.find((a, b), self.reaches[a] + self.reaches[b] + near_by, &mut touches);
        }
        touches
    }

    /// Solves for impulses on given velocities, applies them to `free`, and books all their work as fallback.
    fn impulse(
        &mut self,
        touches: &[Touch<S>],
        velocities: &[Twist<S>],
        free: Vec<Twist<S>>,
        time: f64,
        target: &dyn Fn(&Touch<S>) -> f64,
        tools: &mut Tools<S>,
    ) -> Result<(), Halt> {
        let before = self.twists();
        let mut problem = ContactProblem::new(Vec::new(), Vec::new());
        assembly::begin(&mut problem, &self.bodies, self.settings.friction_law);
        problem.velocities = velocities.to_vec();
        for t in touches {
            problem.contacts.push(assembly::contact(&self.bodies, t, target(t)));
            assembly::resist(&mut problem, t);
        }
        // sums of velocities, or the velocities after the plastic impulse: joints ask for none; the next projection
        // takes away by what the way then misses them
        self.bodies.push_joints(&self.bodies.joint_frames(), &[], &mut problem);
        let mut impulses = Impulses::zero(&problem);
        if !touches.is_empty() || !problem.rows.is_empty() {
            self.solve(&problem, &mut impulses, tools)?;
        }
        let (kind, piece) = if time > 0.0 {
            (EventKind::FallbackFlow, PieceKind::Fallback)
        } else {
            (EventKind::FallbackImpact, PieceKind::Impact)
        };
        let acted =
            Acted { time: self.moment, length: time, touches, problem: &problem, impulses: &impulses };
        self.log.add(&acted, |_| kind);
        self.log.end_act(piece, self.moment, time, movers(&self.bodies));
        self.log.add_rows(&problem, &impulses);
        let mut after = free;
        problem.apply(&impulses, &mut after);
        let mut work = 0.0;
        let book = |_: usize, n: f64, t: f64| work += n + t;
        let mut driven = crate::observe::ledger::Ledger::default();
        assembly::contact_work(&self.bodies, &problem, &impulses, &before, &after, book, &mut driven);
        self.accounts.kick(&self.bodies, &problem, &impulses, (&before, &after), |_| Cause::Fallback);
        self.ledger.constraint +=
            assembly::row_work(&self.bodies, &problem, &impulses, &before, &after, &mut driven);
        self.keep_joints(&problem, &impulses);
        self.ledger.fallback += work;
        self.ledger.driven += driven.driven;
        self.book_loads(&before, &after, time);
        assembly::write_back(&mut self.bodies, &after);
        Ok(())
    }
}

/// Those that impulses move.
pub fn movers<S: Geometry>(bodies: &Bodies<S>) -> impl Iterator<Item = usize> + '_ {
    (0..bodies.len()).filter(|&i| bodies.is_dynamic(i))
}
