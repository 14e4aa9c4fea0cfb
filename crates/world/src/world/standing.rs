//! Bodies that stand: a step looks at them only where somebody may have written to them, so that its work goes with the
//! bodies that can move. What a step keeps of them is named by a number that changes whenever one of them does.

use super::World;
use crate::ahead::Ahead;
use crate::bodies::Bodies;
use crate::error::StepError;
use carom_geometry::Geometry;
use carom_math::Rotation;

/// How far from 1 the squared length of a rotation's numbers may be and is left alone \[1\].
pub(super) const UNIT: f64 = 4e-16;

/// What may have happened to the bodies since the last step.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Written {
    /// Nothing but the step's own doing.
    Nothing,
    /// Their motion may be another.
    Motion,
    /// Everything may be another.
    #[default]
    All,
}

impl<S: Geometry> World<S> {
    /// Notes what somebody may write.
    pub(super) fn may_write(&mut self, what: Written) {
        self.written = self.written.max(what);
        self.known_energy = None;
        self.bodies.distrust();
    }

    /// The bodies, about to be written by somebody.
    pub(super) fn written_bodies(&mut self, what: Written) -> &mut Bodies<S> {
        self.may_write(what);
        &mut self.bodies
    }

    /// True where the fixed bodies are as the last step that began found them.
    pub(super) fn stand_as_before(&mut self) -> bool {
        match self.written {
            Written::Nothing => true,
            Written::Motion => self.bodies.stand_as_in(&self.checkpoint.0),
            Written::All => {
                self.bodies.find_roles();
                false
            }
        }
    }

    /// Keeps the motion as it is before a step; of fixed bodies only where they are others than before.
    pub(super) fn keep_motion(&mut self, as_before: bool) {
        let motion = &self.bodies.motion;
        if as_before {
            self.checkpoint.0.copy_some(motion, self.bodies.movers());
        } else {
            self.checkpoint.0.copy_from(motion);
        }
        self.bodies.trust(as_before);
        self.written = Written::Nothing;
    }

    /// Makes what the first step would make beside its own work: columns over all bodies, and the tree over those that stand.
    /// Where there are a million of them, the first step of length `dt` \[s\] is then like all others. No bit of a trajectory
    /// hangs on it, and it may be called at any time.
    ///
    /// # Errors
    /// [`StepError`] for what a step would refuse before it begins; nothing has changed then.
    pub fn prepare(&mut self, dt: f64) -> Result<(), StepError> {
        let as_before = self.stand_as_before();
        self.check_before(dt, as_before)?;
        let is_unit = |q: &S::Rotation| {
            let length: f64 = q.as_slice().iter().map(|x| x * x).sum();
            (length - 1.0).abs() <= UNIT
        };
        // a step gives rotations that are not their length back, those of bodies that stand too
        if as_before || !self.bodies.motion.rotation.iter().all(is_unit) {
            return Ok(());
        }
        self.stir();
        self.keep_motion(false);
        self.schemes.soft_step.prepare(&self.bodies);
        self.spare.1.soft_step.prepare(&self.bodies);
        let ahead = Ahead { bodies: &self.bodies, settings: &self.settings, dt, pulls: &self.pushes.pulls };
        self.narrow_phase.arrange(&ahead);
        Ok(())
    }
}
