//! Gaps at a flow's end. The mean-velocity law keeps them exactly between balls; where corners and edges turn on
//! faces it leaves what is of second order in the turn. There the law's target is corrected, round by round, until the
//! gap itself is kept: a condition on places (theory section 8.5).

use super::together::Together;
use crate::integrate::turn_freely;
use crate::narrow_phase::Touch;
use carom_geometry::Geometry;
use carom_math::Column;
use carom_solver::{ContactProblem, Twist};

impl<S: Geometry> Together<'_, S> {
    /// For each contact whether a body that is no ball takes part and turns, or may.
    pub fn turning_corners(&self, active: &[Touch<S>]) -> Vec<bool> {
        let spin = &self.bodies.motion.angular_velocity;
        let turns = |i: usize| self.bodies.is_dynamic(i) || spin[i] != S::Spin::ZERO;
        let corners = |i: usize| self.bodies.data[i].turning_arm > 0.0 && turns(i);
        active.iter().map(|t| corners(t.a) || corners(t.b)).collect()
    }

    /// Places at a flow's end, from those half-way.
    pub fn bring_to_end(&mut self, origin: &[S::Vector], before: &[Twist<S>], after: &[Twist<S>], time: f64) {
        for i in 0..self.bodies.len() {
            let mean = (before[i].linear + after[i].linear) * 0.5;
            self.bodies.motion.position[i] = origin[i] + mean * time;
            self.bodies.motion.set_twist(i, &after[i]);
            turn_freely(self.settings.integrator, &mut self.bodies, i, 0.5 * time);
        }
    }

    /// The gaps of contacts where the bodies are now; `None` for one that is no more, or not asked for.
    pub fn gaps_of(&mut self, active: &[Touch<S>], asked: &impl Fn(usize) -> bool) -> Vec<Option<f64>> {
        let mut gaps = Vec::with_capacity(active.len());
        let mut found: Vec<Touch<S>> = Vec::new();
        for pair in active.chunk_by(|s, t| (s.a, s.b) == (t.a, t.b)) {
            let known = gaps.len();
            if !(known..known + pair.len()).any(asked) {
                gaps.resize(known + pair.len(), None);
                continue;
            }
            let (a, b) = (pair[0].a, pair[0].b);
            let near_by = self.limits.touching(&self.bodies.data[a], &self.bodies.data[b]);
            found.clear();
            self.find((a, b), 4.0 * near_by + self.reaches[a] + self.reaches[b], &mut found);
            gaps.extend(pair.iter().map(|t| found.iter().find(|n| n.id == t.id).map(|n| n.gap)));
        }
        gaps
    }

    /// Error of a gap at a flow's end that needs no correction \[m\].
    fn kept(&self, t: &Touch<S>) -> f64 {
        let data = &self.bodies.data;
        self.limits.kept_of(data[t.a].extent.min(data[t.b].extent))
    }

    /// Corrects the targets of a flow so that gaps at its end are what they shall be; the errors corrected \[m\].
    pub fn keep_gaps(
        &self,
        problem: &ContactProblem<S>,
        (before, after): (&[Twist<S>], &[Twist<S>]),
        (active, closing, gaps): (&[Touch<S>], &[f64], &[Option<f64>]),
        time: f64,
        targets: &mut [f64],
    ) -> Vec<f64> {
        let mut corrected = vec![0.0; active.len()];
        for (k, contact) in problem.contacts.iter().enumerate() {
            let Some(gap) = gaps[k].filter(|_| closing[k] > 0.0) else { continue };
            let wanted = (active[k].gap - closing[k] * time).max(-self.limits.arrived);
            let kept = self.kept(&active[k]);
            let sum = contact.normal_velocity(before) + contact.normal_velocity(after);
            let off = gap - wanted;
            let held = sum - targets[k] <= self.limits.still_speed;
            if off < -kept || (held && off > kept) {
                // never apart: a row that closes takes energy, and what it leaves is projected
                targets[k] = (sum - 2.0 * off / time).min(0.0);
                corrected[k] = off.abs();
            }
        }
        corrected
    }
}
