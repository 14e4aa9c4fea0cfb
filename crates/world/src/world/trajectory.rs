//! Points of a world's trajectory: what the coming steps depend on and steps change, kept and restored.

use super::World;
use super::standing::Written;
use crate::bodies::Motion;
use crate::force::Wrench;
use crate::observe::ledger::Ledger;
use crate::warm_start::WarmStart;
use carom_geometry::Geometry;

/// A point of a world's trajectory.
pub(crate) struct Trajectory<S: Geometry> {
    motion: Motion<S>,
    warm: WarmStart<S>,
    ledger: Ledger,
    time: f64,
    steps: u64,
}

impl<S: Geometry> World<S> {
    /// What the coming steps depend on and steps change, to be restored by `set_to`.
    pub(crate) fn trajectory(&self) -> Trajectory<S> {
        Trajectory {
            motion: self.bodies.motion.clone(),
            warm: self.warm.clone(),
            ledger: self.ledger,
            time: self.time,
            steps: self.steps,
        }
    }
    /// Goes back to a point of this world's own trajectory; forces waiting for the next step are dropped.
    pub(crate) fn set_to(&mut self, point: &Trajectory<S>) {
        self.motion_mut().copy_from(&point.motion);
        self.set_trajectory(point.time, point.steps, point.warm.clone(), point.ledger);
    }

    /// Restores what a snapshot holds of the trajectory; for `snapshot`.
    pub(crate) fn set_trajectory(&mut self, time: f64, steps: u64, warm: WarmStart<S>, ledger: Ledger) {
        self.time = time;
        self.steps = steps;
        self.warm = warm;
        self.ledger = ledger;
        self.forget_step();
        self.may_write(Written::All);
        // what sleeps there rests as it is there
        self.checkpoint.0.copy_from(&self.bodies.motion);
        self.find_sleepers();
        self.applied = vec![Wrench::default(); self.bodies.len()];
    }

    /// Wrenches waiting for the next step; for `snapshot`.
    pub(crate) fn waiting(&mut self) -> &mut Vec<Wrench<S>> {
        self.is_applied = true;
        &mut self.applied
    }
}
