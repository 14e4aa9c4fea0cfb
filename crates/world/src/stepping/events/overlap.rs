//! Projection: bodies that overlap by more than rounding are moved apart, the least in the metric of their masses
//! (Gauss-Newton on the gaps). Impacts are never made by it; spin momenta stay. What it does to the energy is the
//! ledger's line.

use super::together::{Halt, Together, Tools};
use crate::assembly;
use crate::bodies::Motion;
use crate::integrate::set_spin_momentum;
use crate::observe::accounts::Motive;
use crate::observe::energy::Energy;
use crate::observe::report::SolveReport;
use carom_geometry::Geometry;
use carom_math::{Column, Rotation};
use carom_solver::{ContactProblem, Impulses, SolveSettings, Twist};

/// Gauss-Newton rounds; each squares what is left.
const ROUNDS: usize = 8;

impl<S: Geometry> Together<'_, S> {
    /// Removes overlaps beyond the limit; true when there were any.
    pub fn project(&mut self, tools: &mut Tools<S>) -> Result<bool, Halt> {
        let before = Energy::of(&self.bodies, self.settings.gravity).total();
        let marks = self.accounts.marks(&self.bodies, self.settings.gravity);
        let mut start: Option<Motion<S>> = None;
        for _ in 0..ROUNDS {
            let deepest = self.deepest();
            if deepest == 0.0 {
                break;
            }
            start.get_or_insert_with(|| self.bodies.motion.clone());
            self.events.deepest = self.events.deepest.max(deepest);
            self.apart(deepest, tools)?;
        }
        if let Some(start) = &start {
            self.accounts.moved(&marks, &self.bodies, self.settings.gravity, Motive::Projection);
            self.log.projection(self.moment, start, &self.bodies);
            self.ledger.projection += Energy::of(&self.bodies, self.settings.gravity).total() - before;
            self.events.projections += 1;
        }
        Ok(start.is_some())
    }

    /// Deepest overlap beyond the limits; 0 when there is none.
    pub fn deepest(&mut self) -> f64 {
        let mut touches = Vec::new();
        for k in 0..self.pairs.len() {
            self.find(self.pairs[k], 0.0, &mut touches);
        }
        let beyond = touches
            .iter()
            .filter(|t| -t.gap > self.limits.overlap(&self.bodies.data[t.a], &self.bodies.data[t.b]));
        beyond.fold(0.0, |d: f64, t| d.max(-t.gap))
    }

    /// One round: displacements as velocities of a problem without friction, over a second.
    fn apart(&mut self, deepest: f64, tools: &mut Tools<S>) -> Result<(), Halt> {
        let mut touches = Vec::new();
        for k in 0..self.pairs.len() {
            self.find(self.pairs[k], 2.0 * deepest, &mut touches);
        }
        let mut problem = ContactProblem::new(Vec::new(), Vec::new());
        assembly::begin(&mut problem, &self.bodies, self.settings.friction_law);
        problem.velocities.fill(Twist::default());
        for t in &touches {
            let mut contact = assembly::contact(&self.bodies, t, -t.gap);
            contact.friction = 0.0;
            problem.contacts.push(contact);
        }
        let mut impulses = Impulses::zero(&problem);
        let solve = SolveSettings { tolerance: 1e-6 * deepest, ..self.settings.solve() };
        let outcome = tools.solver.solve_watched(&problem, &solve, &mut impulses, tools.watch);
        self.unless_refused(SolveReport::new(outcome, touches.len(), None), "contact")?;
        for (i, v) in problem.velocities_after(&impulses).iter().enumerate() {
            self.bodies.motion.position[i] += v.linear;
            if v.angular != S::Spin::ZERO {
                let momentum = self.bodies.spin_momentum(i);
                let turned = self.bodies.motion.rotation[i].then(&S::Rotation::about(v.angular));
                self.bodies.motion.rotation[i] = turned;
                set_spin_momentum(&mut self.bodies, i, momentum);
            }
        }
        Ok(())
    }
}
