//! Loads on bodies: uniform gravity, forces applied for one step, and force fields given by the user
//! (theory chapter 1, items 14-15).

use crate::bodies::Motion;
use carom_math::{Column, Space};

/// Force and torque on a body, both in world axes, about the centre of mass.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Wrench<S: Space> {
    /// Force \[N\].
    pub force: S::Vector,
    /// Torque about the centre of mass \[N m\].
    pub torque: S::Spin,
}

impl<S: Space> Wrench<S> {
    /// A force at an arm from the centre of mass: torque r x f.
    pub fn at(force: S::Vector, arm: S::Vector) -> Self {
        Wrench { force, torque: S::moment(arm, force) }
    }
    /// Adds another wrench.
    pub fn add(&mut self, other: &Wrench<S>) {
        self.force += other.force;
        self.torque += other.torque;
    }
    /// True when every component is finite.
    pub fn is_finite(&self) -> bool {
        self.force.is_finite() && self.torque.is_finite()
    }
}

/// A force field: adds wrenches to bodies, given time and motion. What it adds to obstacles is ignored.
pub trait ForceField<S: Space>: Send {
    /// Adds its wrenches to `out`, one entry per body.
    ///
    /// # Errors
    /// A text that says what went wrong; the step is then not taken.
    fn add(&mut self, time: f64, motion: &Motion<S>, out: &mut [Wrench<S>]) -> Result<(), String>;
}

/// A closure is a force field.
impl<S: Space, F> ForceField<S> for F
where
    F: FnMut(f64, &Motion<S>, &mut [Wrench<S>]) + Send,
{
    fn add(&mut self, time: f64, motion: &Motion<S>, out: &mut [Wrench<S>]) -> Result<(), String> {
        self(time, motion, out);
        Ok(())
    }
}
