//! Speeds and lengths that the scheme tells things apart by, for one group of bodies and one step.

use crate::bodies::Bodies;
use crate::narrow_phase::smallest_extent;
use crate::settings::Settings;
use carom_geometry::Geometry;
use carom_math::Column;

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
    /// Gap up to which bodies touch \[m\].
    pub touching: f64,
    /// Gap up to which an approaching contact has arrived \[m\].
    pub arrived: f64,
    /// Overlap that is projected away \[m\].
    pub overlap: f64,
    /// Events after which the rest of the step is taken at once.
    pub cap: usize,
    /// Stops of slipping contacts that end a flow.
    pub slip_stops: usize,
}

impl Limits {
    /// The bounds for a group of bodies.
    pub fn of<S: Geometry>(settings: &Settings<S>, bodies: &Bodies<S>, dt: f64) -> Self {
        let events = &settings.events;
        let fall = settings.gravity.norm() * dt;
        let size = smallest_extent(bodies).unwrap_or(0.0);
        let movers = (0..bodies.len()).filter(|&i| bodies.is_dynamic(i));
        let (mut fastest, mut farthest) = (fall, 0.0_f64);
        for i in movers.clone() {
            let m = &bodies.motion;
            let extent = bodies.data[i].extent;
            let arm = if extent.is_finite() { extent } else { 0.0 };
            fastest = fastest.max(m.velocity[i].norm() + arm * m.angular_velocity[i].norm());
            farthest = farthest.max(m.position[i].max_abs());
        }
        let tolerance = (events.tolerance * fall).max(ROUNDING * fastest);
        let rest_speed = events.rest_speed_factor * fall;
        Limits {
            dt,
            rest_speed,
            still_speed: (20.0 * tolerance).max(1e-9 * rest_speed).max(STILL),
            tolerance,
            touching: events.touching * size,
            arrived: (1e-12 * size).max(8.0 * f64::EPSILON * farthest),
            overlap: (events.overlap * size).max(64.0 * f64::EPSILON * farthest),
            cap: events.cap.unwrap_or_else(|| (2 * movers.count()).max(64)),
            slip_stops: events.slip_stops,
        }
    }
    /// The rest speed of a contact \[m/s\]: an elastic one bounces however slow it is.
    pub fn rest_speed_of(&self, restitution: f64) -> f64 {
        if restitution >= 1.0 { 0.0 } else { self.rest_speed }
    }
}

/// What solves can reach relative to the speeds in them \[1\].
const ROUNDING: f64 = 1e-14;
/// Noise of velocities in scenes without gravity \[m/s\].
const STILL: f64 = 1e-11;
