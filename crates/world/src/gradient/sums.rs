//! What is gathered on the way back through a rollout: cotangents of states and of everything that was given.

use std::collections::BTreeMap;

/// Cotangent of a body's state: place, turn (small rotation vector, world axes), velocity, spin; columns of three.
pub type StateBar = [f64; 12];

/// Sums over a rollout, per body of the world; columns of three.
#[derive(Clone, Debug, Default)]
pub struct Sums {
    /// Masses, inertias apart.
    pub mass: Vec<f64>,
    /// Factors on the inertias.
    pub inertia: Vec<f64>,
    /// Force and torque of each step on each body.
    pub loads: Vec<Vec<[f64; 6]>>,
    /// Gravity.
    pub gravity: [f64; 3],
    /// Friction and restitution of each pair of bodies, a < b.
    pub pairs: BTreeMap<(usize, usize), [f64; 2]>,
}

impl Sums {
    /// Zeros for a number of bodies and steps.
    pub fn new(bodies: usize, steps: usize) -> Self {
        Sums {
            mass: vec![0.0; bodies],
            inertia: vec![0.0; bodies],
            loads: vec![vec![[0.0; 6]; bodies]; steps],
            ..Sums::default()
        }
    }
    /// Adds to a pair's friction and restitution.
    pub fn pair(&mut self, a: usize, b: usize, friction: f64, restitution: f64) {
        let sum = self.pairs.entry((a.min(b), a.max(b))).or_default();
        sum[0] += friction;
        sum[1] += restitution;
    }
}

/// Adds one column to another.
pub fn add(to: &mut [f64], from: &[f64], factor: f64) {
    to.iter_mut().zip(from).for_each(|(t, f)| *t += factor * f);
}
