//! Bodies that stand: a step looks at them only where somebody may have written to them, so that its work goes with the
//! bodies that can move. What a step keeps of them is named by a number that changes whenever one of them does.

use super::World;
use crate::bodies::Bodies;
use carom_geometry::Geometry;

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
}
