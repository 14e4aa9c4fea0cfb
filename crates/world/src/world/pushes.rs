//! What loads do within the step ahead, for how far contacts are looked for. Applied loads are known before it. A force
//! field is asked once in a step, with the motion that the scheme has then: by a soft step before it looks for contacts,
//! by a fixed step after its impacts, when they are found. A fixed step in which a field pushes a body so far that
//! contacts were overlooked is taken once more, with reaches for what the fields gave.

use super::{World, loads_of};
use crate::ahead::{Ahead, pull};
use crate::error::StepError;
use crate::integrate::Step;
use crate::narrow_phase::Touch;
use crate::observe::ledger::Ledger;
use crate::settings::Scheme;
use carom_geometry::Geometry;

/// How far a field may push a body into what was not looked for, over the body's size \[1\]: corrected as any overlap is.
const OVERLOOKED: f64 = 0.05;

/// Memory: nothing in it outlives a step.
#[derive(Default)]
pub(super) struct Pushes {
    /// What the known loads do to the surface of each body \[m/s^2\]; empty without any.
    pub pulls: Vec<f64>,
    /// How much further fields may push each body than is known \[m\]; empty where none are, or where it is of no matter.
    room: Vec<f64>,
}

impl<S: Geometry> World<S> {
    /// What is known before a step: the applied loads, and how much further a field may push.
    pub(super) fn expect_applied(&mut self, dt: f64) {
        let Pushes { pulls, room } = &mut self.pushes;
        pulls.clear();
        room.clear();
        let (bodies, settings) = (&self.bodies, &self.settings);
        if self.is_applied {
            pulls.extend(self.applied.iter().enumerate().map(|(i, load)| pull(bodies, i, load)));
        }
        let is_wide = settings.contact_margin.is_some();
        if settings.scheme != Scheme::FixedStep || self.fields.is_empty() || is_wide {
            return;
        }
        let ahead = Ahead::new(bodies, settings, dt, pulls);
        room.extend((0..bodies.len()).map(|i| {
            let mover = ahead.mover(i);
            let speed = mover.speed(dt);
            mover.margin(&ahead, speed) - speed * dt + OVERLOOKED * bodies.data[i].extent
        }));
    }

    /// A field pushed a body further in the step just taken than there was room for; what it gave is known then.
    pub(super) fn was_pushed_further(&mut self, dt: f64) -> bool {
        let Pushes { pulls, room } = &mut self.pushes;
        let (bodies, loads) = (&self.bodies, &self.schemes.fixed_step.loads);
        if room.is_empty() || loads.len() != bodies.len() {
            return false;
        }
        let known = |i: usize| pulls.get(i).copied().unwrap_or(0.0);
        let is_far = |i: usize| (pull(bodies, i, &loads[i]) - known(i)) * dt * dt > room[i];
        if !(0..bodies.len()).any(is_far) {
            return false;
        }
        pulls.clear();
        pulls.extend(loads.iter().enumerate().map(|(i, load)| pull(bodies, i, load)));
        true
    }

    /// Where the step began there were contacts within reach of what is known by now that were not looked for.
    pub(super) fn overlooked_some(&mut self, dt: f64) -> bool {
        let mut within = Vec::new();
        std::mem::swap(&mut self.bodies.motion, &mut self.checkpoint.0);
        let ahead = Ahead::new(&self.bodies, &self.settings, dt, &self.pushes.pulls);
        self.narrow_phase.update(&ahead, &mut within);
        std::mem::swap(&mut self.bodies.motion, &mut self.checkpoint.0);
        let ids = |touches: &[Touch<S>]| touches.iter().map(|t| (t.a, t.b, t.id)).collect::<Vec<_>>();
        ids(&within) != ids(&self.touches)
    }

    /// Damping and loads of a soft step; what loads do is known then.
    pub(super) fn begin_soft_step(&mut self, step: &Step<S>, ledger: &mut Ledger) -> Result<(), StepError> {
        let quiet = self.is_quiet();
        let mut loads = loads_of(&mut self.fields, &self.applied);
        let scheme = &mut self.schemes.soft_step;
        scheme.begin(&mut self.bodies, step, quiet, &mut loads, ledger)?;
        self.pushes.pulls.clear();
        if !quiet {
            let of_all = scheme.loads.iter().enumerate().map(|(i, load)| pull(&self.bodies, i, load));
            self.pushes.pulls.extend(of_all);
        }
        Ok(())
    }
}
