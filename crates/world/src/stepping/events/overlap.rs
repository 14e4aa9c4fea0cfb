//! Projection: bodies that overlap by more than rounding are moved apart, the least in the metric of their masses
//! (Gauss-Newton on the gaps). Impacts are never made by it; spin momenta stay. What it does to the energy is the
//! ledger's line.

use super::together::{Halt, Together, Tools};
use crate::assembly;
use crate::bodies::Motion;
use crate::narrow_phase::Touch;
use crate::observe::accounts::Motive;
use crate::observe::energy::Energy;
use crate::observe::report::SolveReport;
use carom_geometry::Geometry;
use carom_solver::{ContactProblem, Impulses, SolveSettings, Twist};

/// Gauss-Newton rounds, each of which squares what is left near the end.
const ROUNDS: usize = 8;
/// Where features of turning bodies change from round to round each only leaves a share: rounds go on while they come nearer.
const MOST: usize = 40;
/// Share of what was left two rounds before that is nearer \[1\]: of rounds in which features change one may gain nothing.
const NEARER: f64 = 0.9;
/// Error of joints over their size that projection leaves \[1\].
const CLOSED: f64 = 1e-13;

/// True where one more round may help, after so many of which the last two left so much of what they began with \[m\].
fn goes_on(rounds: usize, off: f64, before: f64) -> bool {
    // false for NaN
    let comes_nearer = off <= NEARER * before;
    rounds < ROUNDS || comes_nearer
}

impl<S: Geometry> Together<'_, S> {
    /// Removes overlaps beyond the limit; true when there were any. `known` are the contacts that touch where that is known.
    pub fn project(&mut self, known: Option<&[Touch<S>]>, tools: &mut Tools<S>) -> Result<bool, Halt> {
        let before = Energy::of(&self.bodies, self.settings.gravity).total();
        let marks = self.accounts.marks(&self.bodies, self.settings.gravity);
        let mut start: Option<Motion<S>> = None;
        let mut left = [f64::INFINITY; 2];
        for round in 0..MOST {
            let deepest = match known.filter(|_| start.is_none()) {
                Some(touches) => self.deepest_of(touches),
                None => self.deepest(),
            };
            let torn = self.bodies.torn();
            // joints are closed to rounding once anything is moved, and left alone otherwise
            let closed = torn <= if start.is_some() { CLOSED } else { self.limits.torn() };
            if deepest == 0.0 && closed {
                break;
            }
            let off = deepest.max(torn * self.joint_size());
            if !goes_on(round, off, left[0]) {
                break;
            }
            left = [left[1], off];
            start.get_or_insert_with(|| self.bodies.motion.clone());
            self.events.deepest = self.events.deepest.max(deepest);
            self.apart(deepest, off, tools)?;
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
        self.deepest_of(&touches)
    }

    /// The same of these contacts.
    fn deepest_of(&self, touches: &[Touch<S>]) -> f64 {
        touches.iter().filter(|t| self.is_deep(t)).fold(0.0, |d: f64, t| d.max(-t.gap))
    }

    /// True for a contact that overlaps by more than the limit.
    pub fn is_deep(&self, t: &Touch<S>) -> bool {
        -t.gap > self.limits.overlap(&self.bodies.data[t.a], &self.bodies.data[t.b])
    }

    /// Size of the largest joint \[m\].
    fn joint_size(&self) -> f64 {
        self.bodies.joints.all.iter().map(|j| j.size).fold(0.0, f64::max)
    }

    /// One round: displacements as velocities of a problem without friction, over a second.
    fn apart(&mut self, deepest: f64, largest: f64, tools: &mut Tools<S>) -> Result<(), Halt> {
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
        let errors: Vec<f64> = self.bodies.joint_errors().iter().map(|e| -e).collect();
        self.bodies.push_joints(&self.bodies.joint_frames(), &errors, &mut problem);
        let mut impulses = Impulses::zero(&problem);
        let solve = SolveSettings { tolerance: 1e-6 * largest, ..self.settings.solve() };
        let outcome = tools.solver.solve_watched(&problem, &solve, &mut impulses, tools.watch);
        self.unless_refused(SolveReport::new(outcome, touches.len(), None), "contact")?;
        assembly::displace(&mut self.bodies, &problem.velocities_after(&impulses));
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What overlapped in a heap of a thousand bodies at the ends of two steps, round by round \[m\]: there were eight rounds, and
    /// what they left was more than a millionth of a body's size.
    #[test]
    fn projection_stopped_while_it_came_nearer_round_by_round() {
        let left = [1.2e-4, 8.3e-5, 4.9e-5, 3.8e-5, 2.4e-5, 1.9e-5, 9.5e-6, 2.4e-6, 1.9e-7];
        assert!((2..left.len()).all(|k| goes_on(k, left[k], left[k - 2])));
        // every other round gained little
        let left =
            [1.5e-4, 7.0e-5, 5.6e-5, 3.2e-5, 3.1e-5, 1.8e-5, 1.7e-5, 9.9e-6, 9.6e-6, 5.6e-6, 5.9e-6, 3.0e-6];
        assert!((2..left.len()).all(|k| goes_on(k, left[k], left[k - 2])));
        // what is squeezed between others comes no nearer, and is left after some
        assert!((1..ROUNDS).all(|k| goes_on(k, 1e-3, 1e-3)));
        assert!(!goes_on(ROUNDS, 1e-3, 1e-3) && !goes_on(ROUNDS, f64::NAN, 1e-3));
        assert!(!goes_on(ROUNDS, 0.95e-3, 1e-3));
    }
}
