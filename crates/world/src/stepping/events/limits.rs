//! Speeds and lengths that the scheme tells things apart by, for one step.

use super::aim::{AIM, AIM_IN_HEAPS};
use crate::bodies::{Bodies, BodyData};
use crate::settings::{PlasticArrivals, Settings};
use carom_geometry::Geometry;
use carom_math::Column;

/// What solves can reach relative to the speeds in them \[1\].
const ROUNDING: f64 = 1e-14;
/// Noise of velocities in scenes without gravity \[m/s\].
const STILL: f64 = 1e-11;
/// Rest speed over the fastest body's speed, at least \[1\]: without gravity inelastic bodies would otherwise collide
/// without end; what it takes of the energy is below rounding.
const COLLAPSE: f64 = 1e-8;
/// Gap over a pair's size at which bodies have met \[1\].
const ARRIVED: f64 = 1e-12;
/// Error of a gap that is left where it closes, over the overlap that is projected away \[1\].
const KEPT: f64 = 0.25;
/// Events of a body after which its group takes the rest of the step at once, at least.
const CAP: usize = 2048;

/// The bounds of a step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Limits {
    /// Length of the step \[s\].
    pub dt: f64,
    /// Impacts slower than this do not bounce, and slow separations up to it stay in contact \[m/s\].
    pub rest_speed: f64,
    /// Approaches up to this are the solver's noise \[m/s\].
    pub still_speed: f64,
    /// Residual that solves aim at \[m/s\].
    pub tolerance: f64,
    /// The fastest point of a body, or |g| dt if that is more \[m/s\].
    pub fastest: f64,
    /// Gap up to which an approaching contact has arrived \[m\].
    pub arrived: f64,
    /// Rounding of places \[m\].
    rounding: f64,
    touching: f64,
    overlap: f64,
    cap: Option<usize>,
    /// Factorisations after which a solve is content with the run's tolerance.
    pub aim: usize,
    /// Stops of slipping contacts that end a flow.
    pub slip_stops: usize,
}

impl Limits {
    /// The bounds for all bodies.
    pub fn of<S: Geometry>(settings: &Settings<S>, bodies: &Bodies<S>, dt: f64) -> Self {
        let events = &settings.events;
        let fall = settings.gravity.norm() * dt;
        let (mut fastest, mut farthest, mut size) = (fall, 0.0_f64, f64::INFINITY);
        for (i, d) in bodies.data.iter().enumerate().filter(|(i, _)| bodies.is_dynamic(*i)) {
            let m = &bodies.motion;
            let arm = if d.extent.is_finite() { d.extent } else { 0.0 };
            fastest = fastest.max(m.velocity[i].norm() + arm * m.angular_velocity[i].norm());
            farthest = farthest.max(m.position[i].max_abs());
            if d.extent > 0.0 {
                size = size.min(d.extent);
            }
        }
        let size = if size.is_finite() { size } else { 0.0 };
        let tolerance = (events.tolerance * fall).max(ROUNDING * fastest);
        let rest_speed = (events.rest_speed_factor * fall).max(COLLAPSE * fastest);
        let rounding = 8.0 * f64::EPSILON * (farthest + size);
        Limits {
            dt,
            rest_speed,
            still_speed: (20.0 * tolerance).max(1e-9 * rest_speed).max(STILL),
            tolerance,
            fastest,
            arrived: (ARRIVED * size).max(rounding),
            rounding,
            touching: events.touching,
            overlap: events.overlap,
            cap: events.cap,
            aim: if events.plastic_arrivals == PlasticArrivals::WithinTheStep { AIM_IN_HEAPS } else { AIM },
            slip_stops: events.slip_stops,
        }
    }
    /// The rest speed of a contact \[m/s\]: an elastic one bounces however slow it is.
    pub fn rest_speed_of(&self, restitution: f64) -> f64 {
        if restitution >= 1.0 { 0.0 } else { self.rest_speed }
    }
    /// Approaches up to this are no impact \[m/s\]: noise, or of a contact that pressed what the mean-velocity law leaves on
    /// curved ways.
    pub fn slowest(&self, pressed: bool) -> f64 {
        if pressed { self.still_speed.max(0.5 * self.rest_speed) } else { self.still_speed }
    }
    /// Gap up to which two bodies touch \[m\].
    pub fn touching<S: Geometry>(&self, a: &BodyData<S>, b: &BodyData<S>) -> f64 {
        (self.touching * a.extent.min(b.extent)).max(self.arrived)
    }
    /// Overlap of two bodies that is projected away \[m\].
    pub fn overlap<S: Geometry>(&self, a: &BodyData<S>, b: &BodyData<S>) -> f64 {
        (self.overlap * a.extent.min(b.extent)).max(8.0 * self.rounding)
    }
    /// Error of a gap of corners and edges at the end of a flow in which it closes that is left \[m\], for bodies of a size
    /// \[m\]: well within what is projected away.
    pub fn kept_of(&self, size: f64) -> f64 {
        (KEPT * self.overlap * size).max(self.arrived)
    }
    /// Error of a joint over its size that is projected away \[1\].
    pub fn torn(&self) -> f64 {
        self.overlap.max(1e-12)
    }
    /// Events after which a set of so many movable bodies takes the rest of the step at once.
    pub fn cap(&self, bodies: usize) -> usize {
        self.cap.unwrap_or_else(|| (2 * bodies).max(CAP))
    }
}
