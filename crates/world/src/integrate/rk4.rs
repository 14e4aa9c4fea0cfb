//! Runge and Kutta's method of order 4 on (x, q, v, L) with all loads inside the stages (theory chapter 2).
//! The rotation enters a stage with unit length restored. Contact impulses come after it, as a kick whose
//! displacement is the mean-velocity one.

use crate::bodies::Bodies;
use crate::error::StepError;
use crate::force::Wrench;
use crate::integrate::{DriftWork, Loads, Step, set_spin_momentum};
use carom_geometry::Geometry;
use carom_math::{Column, Inertia, Rotation};
use carom_solver::Twist;

/// State of one body: position, raw rotation numbers, velocity, angular momentum.
#[derive(Clone, Copy)]
struct State<S: Geometry> {
    x: S::Vector,
    q: S::Rotation,
    v: S::Vector,
    l: S::Spin,
}

/// Time derivative of a state, with the power of the applied loads.
#[derive(Clone, Copy)]
struct Rate<S: Geometry> {
    x: S::Vector,
    q: S::Rotation,
    v: S::Vector,
    l: S::Spin,
    power: f64,
}

/// Weights of the four stages and where each is taken.
const STAGES: [(f64, f64); 4] = [(1.0 / 6.0, 0.0), (1.0 / 3.0, 0.5), (1.0 / 3.0, 0.5), (1.0 / 6.0, 1.0)];

/// Moves all bodies freely over the step, and half of the last velocity's way back: there contacts act. `mean` gets
/// the loads' mean over the stages.
pub fn advance<S: Geometry>(
    bodies: &mut Bodies<S>,
    step: &Step<S>,
    loads: &mut Loads<S>,
    mean: &mut Vec<Wrench<S>>,
) -> Result<DriftWork, StepError> {
    let n = bodies.len();
    let start: Vec<State<S>> = (0..n).map(|i| state(bodies, i)).collect();
    let mut end = start.clone();
    let mut wrenches = Vec::new();
    let mut rates: Vec<Rate<S>> = Vec::new();
    let mut work = DriftWork { of_bodies: vec![(0.0, 0.0); n], ..DriftWork::default() };
    mean.clear();
    mean.resize(n, Wrench::default());
    for (weight, at) in STAGES {
        for i in 0..n {
            let y = if rates.is_empty() { start[i] } else { advanced(&start[i], &rates[i], at * step.dt) };
            put(bodies, i, &y);
        }
        loads(step.time + at * step.dt, bodies, &mut wrenches)?;
        rates = (0..n).map(|i| rate(bodies, i, step.gravity, &wrenches[i])).collect();
        for i in 0..n {
            end[i] = advanced(&end[i], &rates[i], weight * step.dt);
            mean[i].add(&Wrench { force: wrenches[i].force * weight, torque: wrenches[i].torque * weight });
            work.applied += weight * step.dt * rates[i].power;
            work.of_bodies[i].1 += weight * step.dt * rates[i].power;
        }
    }
    for i in 0..n {
        put(bodies, i, &end[i]);
        if !keeps_spin(bodies, i) {
            set_spin_momentum(bodies, i, end[i].l);
        }
        if bodies.is_dynamic(i) {
            let paid = bodies.data[i].mass_properties.mass * step.gravity.dot(end[i].x - start[i].x);
            work.gravity += paid;
            work.of_bodies[i].0 = paid;
        }
        bodies.motion.position[i] += end[i].v * (-0.5 * step.dt);
    }
    Ok(work)
}

/// The second half of the drift that `advance` took back, now with the velocities after the contact impulses: a
/// drift along a body's own velocity leaves its angular momentum alone, about whatever point.
pub fn displace<S: Geometry>(bodies: &mut Bodies<S>, free: &[Twist<S>], h: f64) {
    for (i, free) in free.iter().enumerate() {
        let v = bodies.motion.velocity[i];
        bodies.motion.position[i] += v * (0.5 * h);
        let turn = bodies.motion.angular_velocity[i] - free.angular;
        if turn != S::Spin::ZERO {
            let momentum = bodies.spin_momentum(i);
            let turn = S::Rotation::about(turn * (0.5 * h));
            bodies.motion.rotation[i] = bodies.motion.rotation[i].then(&turn);
            if !keeps_spin(bodies, i) {
                set_spin_momentum(bodies, i, momentum);
            }
        }
    }
}

fn state<S: Geometry>(bodies: &Bodies<S>, i: usize) -> State<S> {
    let m = &bodies.motion;
    // a body without inertia carries its angular velocity in place of a momentum
    let l = if keeps_spin(bodies, i) { m.angular_velocity[i] } else { bodies.spin_momentum(i) };
    State { x: m.position[i], q: m.rotation[i], v: m.velocity[i], l }
}

fn keeps_spin<S: Geometry>(bodies: &Bodies<S>, i: usize) -> bool {
    bodies.data[i].inverse_inertia == S::Inertia::ZERO
}

fn put<S: Geometry>(bodies: &mut Bodies<S>, i: usize, y: &State<S>) {
    bodies.motion.position[i] = y.x;
    bodies.motion.rotation[i] = y.q.renormalized().unwrap_or(y.q);
    bodies.motion.velocity[i] = y.v;
    bodies.motion.angular_velocity[i] =
        if keeps_spin(bodies, i) { y.l } else { bodies.inverse_mass(i).angular.apply(y.l) };
}

fn advanced<S: Geometry>(y: &State<S>, r: &Rate<S>, h: f64) -> State<S> {
    State { x: y.x + r.x * h, q: y.q.plus_scaled(&r.q, h), v: y.v + r.v * h, l: y.l + r.l * h }
}

fn rate<S: Geometry>(bodies: &Bodies<S>, i: usize, gravity: S::Vector, w: &Wrench<S>) -> Rate<S> {
    let m = &bodies.motion;
    let q = m.rotation[i].rate(m.angular_velocity[i]);
    if !bodies.is_dynamic(i) {
        return Rate { x: m.velocity[i], q, v: S::Vector::ZERO, l: S::Spin::ZERO, power: 0.0 };
    }
    let torque = if keeps_spin(bodies, i) { S::Spin::ZERO } else { w.torque };
    Rate {
        x: m.velocity[i],
        q,
        v: gravity + w.force * bodies.data[i].inverse_mass,
        l: torque,
        power: w.force.dot(m.velocity[i]) + torque.dot(m.angular_velocity[i]),
    }
}
