//! When a slipping contact comes to its stop within a flow, or one that rolls or spins against a moment of friction.
//! The mean-velocity law would carry the slip through zero to the other side; the flow ends at the stop instead. A short trial flow, before any contact stops, gives each
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

/// A contact's slip at the start of a flow: index, speed, and which way.
struct Slip<S: Geometry> {
    contact: usize,
    /// \[m/s\]
    speed: f64,
    way: Way<S>,
}

/// How a contact's bodies move against each other.
enum Way<S: Geometry> {
    /// Along the surface, in this direction.
    Slides(S::Vector),
    /// They turn against each other about this axis, and surfaces are this far from it \[m\].
    Turns(S::Spin, f64),
}

/// Velocity of a's point over b's, along the surface, world axes.
pub(super) fn slip_of<S: Geometry>(m: &Motion<S>, t: &Touch<S>) -> S::Vector {
    let at = |i: usize| m.twist(i).at(t.point - m.position[i]);
    let relative = at(t.a) - at(t.b);
    relative - t.normal * t.normal.dot(relative)
}

/// The parts of a relative angular velocity that rolling and spinning friction are against \[rad/s\].
fn turning_of<S: Geometry>(relative: S::Spin, t: &Touch<S>) -> [(S::Spin, f64); 2] {
    if S::SPIN == 1 {
        return [(relative, t.rolling), (S::Spin::ZERO, 0.0)];
    }
    let normal = S::Spin::from_fn(|i| t.normal[i]);
    let about = normal * normal.dot(relative);
    [(relative - about, t.rolling), (about, t.spinning)]
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

    /// The contacts that slip where a flow begins, and those that turn against a moment.
    fn slips(&self, start: &Saved<S>, active: &Active<S>) -> Vec<Slip<S>> {
        let memory = start.memory().unwrap_or(&self.warm.contacts);
        let mut found = Vec::new();
        for (contact, t) in active.touches.iter().enumerate() {
            if t.friction > 0.0 {
                let slip = slip_of(start.motion(), t);
                let speed = slip.norm();
                if speed > memory.no_slip(t.id) {
                    found.push(Slip { contact, speed, way: Way::Slides(slip * (1.0 / speed)) });
                }
            }
            if t.rolling > 0.0 || t.spinning > 0.0 {
                found.extend(self.turns(start.motion(), contact, t));
            }
        }
        found
    }

    /// How the bodies of a contact turn against each other where friction has moments against it.
    fn turns(&self, m: &Motion<S>, contact: usize, t: &Touch<S>) -> impl Iterator<Item = Slip<S>> {
        let movers = [t.a, t.b].into_iter().filter(|&i| self.bodies.is_dynamic(i));
        let length = movers.map(|i| (t.point - m.position[i]).norm()).fold(f64::INFINITY, f64::min);
        let parts = turning_of::<S>(m.twist(t.a).angular - m.twist(t.b).angular, t);
        parts.into_iter().filter(|(_, coefficient)| *coefficient > 0.0).filter_map(move |(turning, _)| {
            let (rate, speed) = (turning.norm(), turning.norm() * length);
            let way = || Way::Turns(turning * (1.0 / rate), length);
            (speed > NO_SLIP && speed.is_finite()).then(|| Slip { contact, speed, way: way() })
        })
    }

    /// A slip's component along its first direction at the end of the flow taken last.
    fn along(&self, slip: &Slip<S>) -> f64 {
        let c = &self.last.problem.contacts[slip.contact];
        let m = &self.bodies.motion;
        let (a, b) = (m.twist(c.a), m.twist(c.b));
        match slip.way {
            Way::Slides(direction) => {
                let relative = a.at(c.arm_a) - b.at(c.arm_b);
                (relative - c.normal * c.normal.dot(relative)).dot(direction)
            }
            Way::Turns(axis, length) => (a.angular - b.angular).dot(axis) * length,
        }
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
