//! Free motion, by name. Every integrator is drift - kick - drift: it moves the poses before and after the
//! kick in which loads and contacts change the velocities (theory chapter 2), so that contacts work with each
//! of them. `end_share` is the share of the end velocity in the step's displacement:
//! x1 = x0 + h ((1 - end_share) v0 + end_share v1). Knows no contacts.

mod midpoint;
mod rk4;
mod slow;
mod splitting;

use crate::bodies::Bodies;
use crate::error::StepError;
use crate::force::Wrench;
use carom_geometry::Geometry;
use carom_math::{Column, Inertia, Rotation, Space};
use carom_solver::Twist;
use serde::{Deserialize, Serialize};
pub(crate) use slow::slow_rotation;

pub use midpoint::midpoint_rotation;
pub use splitting::split_rotation;

/// How far from 1 the squared length of a rotation's numbers may be and is left alone \[1\].
const UNIT: f64 = 4e-16;

/// Whether a rotation's numbers have the length of one, but for rounding.
#[inline]
pub(crate) fn is_unit<S: Space>(rotation: &S::Rotation) -> bool {
    let length: f64 = rotation.as_slice().iter().map(|x| x * x).sum();
    (length - 1.0).abs() <= UNIT
}

/// The integrators.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Integrator {
    /// The notes' form: poses with the old velocities, rotation renormalised. Order 1; gains energy.
    ExplicitEuler,
    /// Velocities first, poses with the new ones. Order 1.
    SemiImplicitEuler,
    /// Poses with the mean velocity, rotation by splitting: order 2, no energy error under uniform gravity,
    /// bounded energy error of rotation, angular momentum exact.
    #[default]
    Trapezoid,
    /// Poses with the mean velocity, rotation by the implicit midpoint rule in body axes: energy of rotation exact.
    ImplicitMidpoint,
    /// Runge and Kutta's method of order 4; not conservative.
    Rk4,
}

/// Gives the applied wrenches on all bodies for their present motion at a time.
pub type Loads<'a, S> = dyn FnMut(f64, &Bodies<S>, &mut Vec<Wrench<S>>) -> Result<(), StepError> + 'a;

/// What an integrator's drift before the kick did to the energy besides moving freely.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct DriftWork {
    /// Work of gravity \[J\].
    pub gravity: f64,
    /// Work of applied loads \[J\].
    pub applied: f64,
    /// Both, body by body, where the drift has loads inside it.
    pub of_bodies: Vec<(f64, f64)>,
}

/// What acts on the bodies during a step.
#[derive(Clone, Copy, Debug)]
pub struct Step<S: Geometry> {
    /// Time at the step's start \[s\].
    pub time: f64,
    /// Length of the step \[s\].
    pub dt: f64,
    /// Acceleration of gravity \[m/s^2\].
    pub gravity: S::Vector,
}

impl Integrator {
    /// All integrators.
    pub const ALL: [Integrator; 5] = [
        Integrator::ExplicitEuler,
        Integrator::SemiImplicitEuler,
        Integrator::Trapezoid,
        Integrator::ImplicitMidpoint,
        Integrator::Rk4,
    ];
    /// Share of the end velocity in the step's displacement \[1\].
    pub fn end_share(self) -> f64 {
        match self {
            Integrator::ExplicitEuler => 0.0,
            Integrator::SemiImplicitEuler => 1.0,
            _ => 0.5,
        }
    }
    /// True when the kick acts on the poses half-way through the step.
    pub fn kicks_half_way(self) -> bool {
        matches!(self, Integrator::Trapezoid | Integrator::ImplicitMidpoint)
    }
    /// Moves the poses to where the kick acts. Where the drift has the loads already, `mean` gets their mean.
    ///
    /// # Errors
    /// What the loads return.
    pub fn before_kick<S: Geometry>(
        self,
        bodies: &mut Bodies<S>,
        step: &Step<S>,
        loads: &mut Loads<S>,
        mean: &mut Vec<Wrench<S>>,
    ) -> Result<DriftWork, StepError> {
        match self {
            Integrator::ExplicitEuler | Integrator::SemiImplicitEuler => {}
            Integrator::Trapezoid => drift(bodies, 0.5 * step.dt, split_rotation),
            Integrator::ImplicitMidpoint => drift(bodies, 0.5 * step.dt, midpoint_rotation),
            Integrator::Rk4 => return rk4::advance(bodies, step, loads, mean),
        }
        Ok(DriftWork::default())
    }
    /// Velocity changes by gravity and loads over the step, written to `impulses` as momenta (h f, h tau).
    ///
    /// # Errors
    /// What the loads return.
    pub fn load_impulses<S: Geometry>(
        self,
        bodies: &mut Bodies<S>,
        step: &Step<S>,
        loads: &mut Loads<S>,
        wrenches: &mut Vec<Wrench<S>>,
    ) -> Result<(), StepError> {
        match self {
            Integrator::Rk4 => {
                wrenches.clear();
                wrenches.resize(bodies.len(), Wrench::default());
                Ok(())
            }
            Integrator::ImplicitMidpoint => midpoint::mean_loads(bodies, step, loads, wrenches),
            _ => loads(step.time + step.dt * self.end_share().min(0.5), bodies, wrenches),
        }
    }
    /// True when gravity acts in the kick; false when the drift has it already.
    pub fn kicks_with_gravity(self) -> bool {
        self != Integrator::Rk4
    }
    /// What free motion does to the angular velocity within an explicit Euler step: Euler's equation in body
    /// axes, carried on by the step's own turn (theory eq. 2.6). Zero for the others, which keep the angular
    /// momentum instead. Rejected: the same equation in world axes, which is also of order 1 but ten times
    /// further off, for the inertia turns away under the derivative.
    pub fn gyroscopic_change<S: Geometry>(self, bodies: &Bodies<S>, i: usize, h: f64) -> S::Spin {
        if self != Integrator::ExplicitEuler || turns_steadily(bodies, i) {
            return S::Spin::ZERO;
        }
        let w = bodies.motion.angular_velocity[i];
        let rotation = bodies.motion.rotation[i];
        let rate = bodies.inverse_mass(i).angular.apply(S::spin_cross(bodies.spin_momentum(i), w));
        let in_body = rotation.unrotate_spin(w + rate * h);
        rotation.euler_step(w, h).rotate_spin(in_body) - w
    }
    /// Moves the poses to the end of the step. `start` holds the velocities before the step's kick,
    /// `free` those after loads and before contact impulses.
    pub fn after_kick<S: Geometry>(
        self,
        bodies: &mut Bodies<S>,
        start: &[Twist<S>],
        free: &[Twist<S>],
        h: f64,
    ) {
        match self {
            Integrator::ExplicitEuler => euler_drift(bodies, start, h),
            Integrator::SemiImplicitEuler => drift(bodies, h, turn_with_present_spin),
            Integrator::Trapezoid => drift(bodies, 0.5 * h, split_rotation),
            Integrator::ImplicitMidpoint => drift(bodies, 0.5 * h, midpoint_rotation),
            Integrator::Rk4 => rk4::displace(bodies, free, h),
        }
    }
}

/// Turns a body freely for a time by an integrator's rotation method, position apart.
pub fn turn_freely<S: Geometry>(integrator: Integrator, bodies: &mut Bodies<S>, i: usize, h: f64) {
    let w = bodies.motion.angular_velocity[i];
    if w == S::Spin::ZERO {
        return;
    }
    match integrator {
        _ if turns_steadily(bodies, i) => {
            bodies.motion.rotation[i] = bodies.motion.rotation[i].then(&S::Rotation::about(w * h));
        }
        Integrator::ImplicitMidpoint => midpoint_rotation(bodies, i, h),
        _ => split_rotation(bodies, i, h),
    }
}

/// x + h v and a rotation method for torque-free motion, for every body that can move.
fn drift<S: Geometry>(bodies: &mut Bodies<S>, h: f64, rotate: fn(&mut Bodies<S>, usize, f64)) {
    for i in 0..bodies.len() {
        let v = bodies.motion.velocity[i];
        bodies.motion.position[i] += v * h;
        if bodies.motion.angular_velocity[i] != S::Spin::ZERO {
            if turns_steadily(bodies, i) {
                let w = bodies.motion.angular_velocity[i];
                let turn = S::Rotation::about(w * h);
                bodies.motion.rotation[i] = bodies.motion.rotation[i].then(&turn);
            } else {
                rotate(bodies, i, h);
            }
        }
    }
}

/// w = I^-1 L at the present attitude, with one round of refinement: the rounding of I and of its inverse would
/// otherwise move L by 1e-16 at each step, always the same way.
pub fn set_spin_momentum<S: Geometry>(bodies: &mut Bodies<S>, i: usize, momentum: S::Spin) {
    let inverse = bodies.inverse_mass(i).angular;
    let spin = inverse.apply(momentum);
    let rest = momentum - bodies.inertia(i).apply(spin);
    bodies.motion.angular_velocity[i] = spin + inverse.apply(rest);
}

/// True when torque-free motion keeps the angular velocity: obstacles, particles, equal principal moments.
pub fn turns_steadily<S: Geometry>(bodies: &Bodies<S>, i: usize) -> bool {
    let d = &bodies.data[i];
    let p = d.principal.as_slice();
    !bodies.is_dynamic(i) || d.inverse_inertia == S::Inertia::ZERO || p.iter().all(|x| *x == p[0])
}

/// exp(h w) with the present w, after which w is that of the new attitude: the momentum stays (theory eq. 2.8).
fn turn_with_present_spin<S: Geometry>(bodies: &mut Bodies<S>, i: usize, h: f64) {
    let momentum = bodies.spin_momentum(i);
    let turn = S::Rotation::about(bodies.motion.angular_velocity[i] * h);
    bodies.motion.rotation[i] = bodies.motion.rotation[i].then(&turn);
    set_spin_momentum(bodies, i, momentum);
}

/// The notes' step: poses with the velocities before the kick, rotation renormalised (theory eqs. 2.2 to 2.4).
fn euler_drift<S: Geometry>(bodies: &mut Bodies<S>, start: &[Twist<S>], h: f64) {
    for (i, t) in start.iter().enumerate() {
        bodies.motion.position[i] += t.linear * h;
        if t.angular != S::Spin::ZERO {
            bodies.motion.rotation[i] = bodies.motion.rotation[i].euler_step(t.angular, h);
        }
    }
}
