//! Torque-free rotation by the implicit midpoint rule in body axes with Cayley's map (theory chapter 2):
//! p1 = p0 + h pm x I^-1 pm, pm = (p0 + p1)/2, R1 = R0 cay(h I^-1 pm). It keeps the energy of rotation and the
//! angular momentum exactly, at order 2.

use crate::bodies::Bodies;
use crate::error::StepError;
use crate::force::Wrench;
use crate::integrate::{Loads, Step, set_spin_momentum};
use carom_geometry::Geometry;
use carom_math::{Column, Inertia, Rotation};

/// Fixed-point rounds before a step is halved: each round gains a factor h |w| when that is below one.
const ROUNDS: usize = 60;

/// Rotates body `i` freely for the time `h`.
pub fn midpoint_rotation<S: Geometry>(bodies: &mut Bodies<S>, i: usize, h: f64) {
    rotate(bodies, i, h, 12);
}

/// One midpoint step, or two of half the length where the fixed point does not settle.
fn rotate<S: Geometry>(bodies: &mut Bodies<S>, i: usize, h: f64, halvings: usize) {
    let rotation = bodies.motion.rotation[i];
    let inverse = bodies.data[i].inverse_inertia;
    let momentum = bodies.spin_momentum(i);
    let start = rotation.unrotate_spin(momentum);
    let mut middle = start;
    let mut settled = false;
    for _ in 0..ROUNDS {
        let next = start + S::spin_cross(middle, inverse.apply(middle)) * (0.5 * h);
        let change = (next - middle).norm();
        middle = next;
        if change <= 1e-16 * start.norm() {
            settled = true;
            break;
        }
        settled = change <= 4e-16 * start.norm();
    }
    if !settled && halvings > 0 {
        rotate(bodies, i, 0.5 * h, halvings - 1);
        rotate(bodies, i, 0.5 * h, halvings - 1);
        return;
    }
    let turn = S::Rotation::cayley(inverse.apply(middle) * h);
    // body-axes rotation: applied before the old one
    let next = turn.then(&rotation);
    bodies.motion.rotation[i] = next;
    set_spin_momentum(bodies, i, momentum);
}

/// Loads at the mean velocity: v_m = v0 + h/2 f(v_m)/m by fixed-point rounds, so that loads that depend on the
/// velocity are of order 2 as well. The bodies' velocities are restored.
pub fn mean_loads<S: Geometry>(
    bodies: &mut Bodies<S>,
    step: &Step<S>,
    loads: &mut Loads<S>,
    wrenches: &mut Vec<Wrench<S>>,
) -> Result<(), StepError> {
    let time = step.time + 0.5 * step.dt;
    let velocity = bodies.motion.velocity.clone();
    let spin = bodies.motion.angular_velocity.clone();
    loads(time, bodies, wrenches)?;
    for _ in 0..20 {
        let mut change: f64 = 0.0;
        for (i, w) in wrenches.iter().enumerate() {
            if !bodies.is_dynamic(i) {
                continue;
            }
            let inverse = bodies.inverse_mass(i);
            let mean = velocity[i] + (step.gravity + w.force * inverse.linear) * (0.5 * step.dt);
            let mean_spin = spin[i] + inverse.angular.apply(w.torque) * (0.5 * step.dt);
            change = change.max((mean - bodies.motion.velocity[i]).max_abs());
            change = change.max((mean_spin - bodies.motion.angular_velocity[i]).max_abs());
            bodies.motion.velocity[i] = mean;
            bodies.motion.angular_velocity[i] = mean_spin;
        }
        if change <= 1e-15 {
            break;
        }
        if let Err(e) = loads(time, bodies, wrenches) {
            bodies.motion.velocity.clone_from(&velocity);
            bodies.motion.angular_velocity.clone_from(&spin);
            return Err(e);
        }
    }
    bodies.motion.velocity.clone_from(&velocity);
    bodies.motion.angular_velocity.clone_from(&spin);
    Ok(())
}
