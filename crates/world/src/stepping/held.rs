//! Joints in a step of fixed length (theory 9.4): rows at the poses of the kick, and targets for which g vanishes where the
//! integrator's displacement ends. With s the end velocity's share of it, a target falls by g / (s h) from round to round;
//! explicit Euler's displacement is made before the kick, so that the next step's is aimed at. Knows no contacts.

use crate::assembly;
use crate::bodies::Bodies;
use crate::integrate::{Integrator, Step};
use crate::joint::Frame;
use carom_geometry::Geometry;
use carom_solver::{BoundedRow, Twist};

/// Most rounds of a kick with joints.
pub const ROUNDS: usize = 40;
/// Share of the error before that a round must leave to be followed by another \[1\].
const STALLED: f64 = 0.5;

/// The joints of a step through the rounds of its kick.
pub struct Held<S: Geometry> {
    frames: Vec<Frame<S>>,
    targets: Vec<f64>,
    error: f64,
}

impl<S: Geometry> Held<S> {
    /// The joints of bodies at the poses of the kick; the first targets are those of straight ways.
    pub fn new(bodies: &Bodies<S>, integrator: Integrator, start: &[Twist<S>]) -> Self {
        let frames = bodies.joint_frames();
        let mut rows: Vec<BoundedRow<S>> = Vec::new();
        for (j, frame) in bodies.joints.all.iter().zip(&frames) {
            j.push_rows(&bodies.motion, frame, &mut rows);
        }
        let share = integrator.end_share();
        let before = |r: &BoundedRow<S>| r.on_a.dot(&start[r.a]) + r.on_b.dot(&start[r.b]);
        let kept = if share > 0.0 { (1.0 - share) / share } else { 0.0 };
        let targets = rows.iter().map(|r| -kept * before(r)).collect();
        Held { frames, targets, error: f64::INFINITY }
    }
    /// Appends the rows.
    pub fn push(&self, bodies: &Bodies<S>, problem: &mut carom_solver::ContactProblem<S>) {
        bodies.push_joints(&self.frames, &self.targets, problem);
    }
    /// Sets the targets of the next round from where these end velocities lead; false when there need be none.
    pub fn aim(
        &mut self,
        bodies: &mut Bodies<S>,
        integrator: Integrator,
        step: &Step<S>,
        start: &[Twist<S>],
        free: &[Twist<S>],
        after: &[Twist<S>],
    ) -> bool {
        let motion = bodies.motion.clone();
        assembly::write_back(bodies, after);
        integrator.after_kick(bodies, start, free, step.dt);
        if integrator.end_share() == 0.0 {
            integrator.after_kick(bodies, after, free, step.dt);
        }
        let (mut over, mut first) = (0.0_f64, 0);
        let mut errors = Vec::new();
        let share = if integrator.end_share() == 0.0 { 1.0 } else { integrator.end_share() };
        let targets = self.targets.clone();
        for j in &bodies.joints.all {
            errors.clear();
            j.errors(&bodies.motion, &mut errors);
            let allowed = j.rounding(&bodies.motion);
            for (target, error) in self.targets[first..].iter_mut().zip(&errors) {
                *target -= error / (share * step.dt);
                over = over.max(error.abs() / allowed);
            }
            first += errors.len();
        }
        bodies.motion.copy_from(&motion);
        let goes_on = over > 1.0 && over < STALLED * self.error;
        if !goes_on {
            self.targets = targets;
        }
        self.error = over;
        goes_on
    }
}
