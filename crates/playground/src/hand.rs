//! The hand that drags a body: a critically damped spring from a point of the body to a place, limited by the body's
//! mass. f = m_e (w^2 (target - p) - 2 w v_p), |f| <= m STRENGTH, with 1/m_e = 1/m + |r|^2 tr(I^-1), so that the
//! explicit force is stable wherever the body is held. It acts as an applied force; the ledger books its work.

use carom::{Column, Geometry, Inertia, Pose, World, Wrench};

/// Angular frequency of the spring \[rad/s\], unless steps are long.
const FREQUENCY: f64 = 20.0;
/// Largest share of the frequency's period that a step may be \[rad\]: longer ones soften the spring.
const MOST_PER_STEP: f64 = 0.4;
/// Largest force per mass \[m/s^2\]: thirty times the weight.
const STRENGTH: f64 = 300.0;

/// A body that is held, where, and where to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hand<S: Geometry> {
    /// Row of the body.
    pub body: usize,
    /// Point of the body in its axes from the centre of mass \[m\].
    pub point: S::Vector,
    /// Where it is pulled to \[m\].
    pub target: S::Vector,
}

impl<S: Geometry> Hand<S> {
    /// Takes hold of a body that forces move, at a place of the world; `None` for others.
    pub fn on(world: &World<S>, body: usize, place: S::Vector) -> Option<Self> {
        let bodies = world.bodies();
        if body >= bodies.len() || !bodies.is_dynamic(body) {
            return None;
        }
        let pose: Pose<S> = bodies.motion.pose(body);
        Some(Hand { body, point: pose.to_body(place), target: place })
    }
    /// Pulls for one step of length `dt` \[s\].
    pub fn pull(&self, world: &mut World<S>, dt: f64) {
        let bodies = world.bodies();
        let inverse = bodies.inverse_mass(self.body);
        let place = bodies.motion.pose(self.body).to_world(self.point);
        let arm = place - bodies.motion.position[self.body];
        let velocity = bodies.motion.twist(self.body).at(arm);
        let trace: f64 = inverse.angular.entries().iter().take(S::SPIN).sum();
        let mass = 1.0 / (inverse.linear + arm.norm_squared() * trace);
        let w = FREQUENCY.min(MOST_PER_STEP / dt);
        let wanted = ((self.target - place) * (w * w) - velocity * (2.0 * w)) * mass;
        let most = STRENGTH / inverse.linear;
        let size = wanted.norm();
        let force = if size > most { wanted * (most / size) } else { wanted };
        if force.is_finite() {
            world.apply_wrench(self.body, Wrench::at(force, arm));
        }
    }
}
