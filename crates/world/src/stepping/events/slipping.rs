//! When a slipping contact comes to its stop within a flow. The mean-velocity law would carry the slip through zero
//! to the other side; the flow ends at the stop instead. A short trial flow, before any contact stops, gives each
//! slip's deceleration, and the stop is where it has used the slip up.

use super::contacts::Active;
use super::flow::Stick;
use super::together::{Halt, Saved, Together, Tools};
use crate::bodies::Motion;
use crate::narrow_phase::Touch;
use carom_geometry::Geometry;
use carom_math::Column;

/// Slips below this are none \[m/s\].
pub(super) const NO_SLIP: f64 = 1e-9;
/// Share of a slip that counts as its stop \[1\].
pub(super) const STOPPED: f64 = 1e-9;
/// First trial flow over the flow's length \[1\], and the factor from each to the next.
const TRIAL: f64 = 0.1;
/// Trial flows, each a tenth of the one before, until no contact stops within one.
const TRIALS: usize = 10;
/// Corrections of the moment where decelerations change on the way.
const CORRECTIONS: usize = 12;

/// A contact's slip at the start of a flow: index, speed, direction.
struct Slip<S: Geometry> {
    contact: usize,
    speed: f64,
    direction: S::Vector,
}

/// Velocity of a's point over b's, along the surface, world axes.
pub(super) fn slip_of<S: Geometry>(m: &Motion<S>, t: &Touch<S>) -> S::Vector {
    let at = |i: usize| m.twist(i).at(t.point - m.position[i]);
    let relative = at(t.a) - at(t.b);
    relative - t.normal * t.normal.dot(relative)
}

impl<S: Geometry> Together<'_, S> {
    /// The moment of the first stop within a flow that has just been taken from `start`; the group is at the flow's
    /// end, before and after.
    pub fn first_stop(
        &mut self,
        start: &Saved<S>,
        active: &Active<S>,
        time: f64,
        tools: &mut Tools<S>,
    ) -> Result<Option<f64>, Halt> {
        if !self.turns_slips(start, active) {
            return Ok(None);
        }
        let (end, last) = (self.save(), self.last.clone());
        self.restore(start);
        let slips = self.slips(start, active);
        let found = self.seek(start, active, &slips, time, tools)?;
        self.restore(&end);
        self.last = last;
        Ok(found)
    }

    /// True when a slip comes to its stop, or turns, within a flow that has just been taken from `start`.
    pub fn turns_slips(&self, start: &Saved<S>, active: &Active<S>) -> bool {
        self.slips(start, active).iter().any(|s| self.along(s) <= STOPPED * s.speed)
    }

    /// The contacts that slip where a flow begins.
    fn slips(&self, start: &Saved<S>, active: &Active<S>) -> Vec<Slip<S>> {
        let memory = start.memory().unwrap_or(&self.warm.contacts);
        let all = active.touches.iter().enumerate().filter(|(_, t)| t.friction > 0.0);
        all.filter_map(|(contact, t)| {
            let slip = slip_of(start.motion(), t);
            let speed = slip.norm();
            (speed > memory.no_slip(t.id)).then(|| Slip { contact, speed, direction: slip * (1.0 / speed) })
        })
        .collect()
    }

    /// A slip's component along its first direction at the end of the flow taken last.
    fn along(&self, slip: &Slip<S>) -> f64 {
        let c = &self.last.problem.contacts[slip.contact];
        let m = &self.bodies.motion;
        let relative = m.twist(c.a).at(c.arm_a) - m.twist(c.b).at(c.arm_b);
        (relative - c.normal * c.normal.dot(relative)).dot(slip.direction)
    }

    fn seek(
        &mut self,
        start: &Saved<S>,
        active: &Active<S>,
        slips: &[Slip<S>],
        time: f64,
        tools: &mut Tools<S>,
    ) -> Result<Option<f64>, Halt> {
        let mut trial = TRIAL * time;
        let mut stop = f64::INFINITY;
        for _ in 0..TRIALS {
            self.restore(start);
            self.flow(trial, active, Stick::Mean, tools)?;
            let left: Vec<f64> = slips.iter().map(|s| self.along(s)).collect();
            if slips.iter().zip(&left).all(|(s, l)| *l > STOPPED * s.speed) {
                let moments = slips.iter().zip(&left).filter(|(s, l)| s.speed > **l);
                stop = moments.map(|(s, l)| trial * s.speed / (s.speed - l)).fold(f64::INFINITY, f64::min);
                break;
            }
            trial *= TRIAL;
        }
        if stop >= time * (1.0 - 1e-9) {
            return Ok(None);
        }
        for _ in 0..CORRECTIONS {
            self.restore(start);
            self.flow(stop, active, Stick::Mean, tools)?;
            // the slip that is nearest to its stop there, and what a line through its start says of the rest
            let mut next = f64::INFINITY;
            let mut rest = f64::INFINITY;
            for s in slips {
                let left = self.along(s);
                if left < s.speed {
                    next = next.min(stop * s.speed / (s.speed - left));
                    rest = rest.min(left.abs() / s.speed);
                }
            }
            if rest <= STOPPED || !next.is_finite() {
                break;
            }
            stop = next;
        }
        Ok((stop < time * (1.0 - 1e-9)).then_some(stop))
    }
}
