//! Joints in a flow (theory 9.2): rows at the mean poses, and targets for which g vanishes at the flow's end. The target
//! of a round is that of the round before less 2 g / tau, twice what the mean velocity lacks; the rows there are nearly
//! those of the end, so that each round leaves a share of the angle turned.

use super::together::{Halt, Refusal, Together};
use crate::error::StepError;
use crate::joint::Frame;
use crate::stepping::events::flow::Stick;
use carom_geometry::Geometry;
use carom_math::Column;
use carom_solver::{ContactProblem, Twist};

/// Most rounds of a flow with joints.
pub const ROUNDS: usize = 60;
/// Change of a joint's point below which the round is the last, over the joint's size \[1\].
const SAME_POINT: f64 = 1e-13;
/// Share of the error of two rounds before that is no progress \[1\].
const STALLED: f64 = 0.3;
/// Error over a joint's size that a flow may leave where rounding lets it come no further \[1\].
const CLOSED: f64 = 1e-10;

/// The joints of a set through the rounds of a flow.
pub struct Held<S: Geometry> {
    frames: Vec<Frame<S>>,
    targets: Vec<f64>,
    /// Largest error over what it may be, of the last three rounds; infinite before.
    errors: [f64; 3],
    /// Largest error over the joint's size \[1\], and that joint.
    worst: (f64, usize),
}

impl<S: Geometry> Held<S> {
    /// Nothing is known yet.
    pub fn new(joints: &crate::joint::Joints<S>) -> Self {
        let targets = vec![0.0; joints.rows()];
        Held { frames: Vec::new(), targets, errors: [f64::INFINITY; 3], worst: (0.0, 0) }
    }
    /// True when the last round's impulses close all joints, as nearly as can be, at the present frames.
    fn settled(&self, now: &[Frame<S>], joints: &crate::joint::Joints<S>) -> bool {
        // frames follow a round behind, so that errors fall in every other round
        let stalled = self.worst.0 <= CLOSED && self.errors[0] > STALLED * self.errors[2];
        let same = |((new, old), j): ((&Frame<S>, &Frame<S>), &crate::joint::Joint<S>)| {
            let moved = (new.on_a - old.on_a).norm().max((new.on_b - old.on_b).norm());
            moved <= SAME_POINT * j.size && (new.along - old.along).norm() <= SAME_POINT
        };
        stalled || (self.errors[0] <= 1.0 && now.iter().zip(&self.frames).zip(&joints.all).all(same))
    }
}

impl<S: Geometry> Together<'_, S> {
    /// Takes the joints' frames at the present poses; true when the last round was good enough.
    pub fn joints_settled(&self, held: &mut Held<S>) -> bool {
        let now = self.bodies.joint_frames();
        let done = held.settled(&now, &self.bodies.joints);
        held.frames = now;
        done
    }

    /// Appends the joints' rows to a flow's problem.
    pub fn hold(&self, held: &Held<S>, before: &[Twist<S>], stick: Stick, problem: &mut ContactProblem<S>) {
        self.bodies.push_joints(&held.frames, &held.targets, problem);
        if stick == Stick::End {
            // velocities of the problem are those of the end, not sums
            for r in &mut problem.rows {
                r.target -= r.on_a.dot(&before[r.a]) + r.on_b.dot(&before[r.b]);
            }
        }
    }

    /// Sets the targets of the next round from where this one leads.
    pub fn aim(
        &mut self,
        held: &mut Held<S>,
        origin: &[S::Vector],
        (before, after): (&[Twist<S>], &[Twist<S>]),
        time: f64,
    ) {
        let motion = self.bodies.motion.clone();
        self.bring_to_end(origin, before, after, time);
        let (mut over, mut first) = (0.0_f64, 0);
        held.worst = (0.0, 0);
        let mut errors = Vec::new();
        for (k, j) in self.bodies.joints.all.iter().enumerate() {
            errors.clear();
            j.errors(&self.bodies.motion, &mut errors);
            let allowed = j.rounding(&self.bodies.motion);
            for (target, error) in held.targets[first..].iter_mut().zip(&errors) {
                *target -= 2.0 * error / time;
                over = over.max(error.abs() / allowed);
                if error.abs() > held.worst.0 * j.size {
                    held.worst = (error.abs() / j.size, k);
                }
            }
            first += errors.len();
        }
        held.errors = [over, held.errors[0], held.errors[1]];
        self.bodies.motion.copy_from(&motion);
    }

    /// Refuses a flow whose joints did not close.
    pub fn check_held(&self, held: &Held<S>, names: &[String]) -> Result<(), Halt> {
        let (error, joint) = held.worst;
        if error <= CLOSED {
            return Ok(());
        }
        let error = StepError::Joint {
            joint: names.get(self.bodies.joints.numbers[joint]).cloned().unwrap_or_default(),
            problem: format!("no impulse closes it: its error stays {error:.1e} of its size"),
            remedy: "take a smaller dt, or remove joints that contradict each other".into(),
            time: self.time,
        };
        Err(Halt::Refused(Box::new(Refusal { error, solve: None })))
    }
}
