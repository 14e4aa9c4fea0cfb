//! Directions of the path follower: dx with the d that gives dy, and both in the metric of the scaling,
//! (G dx, G^-1 dy) with G^-1 dy = d - G dx (theory chapter 7).

use super::memory::Pool;
use super::step::Pair;

/// A direction in x and y.
#[derive(Clone, Debug, Default)]
pub struct Way<const D: usize> {
    dx: Vec<[f64; D]>,
    pull: Vec<[f64; D]>,
    /// G dx.
    scaled_x: Vec<[f64; D]>,
    /// G^-1 dy.
    scaled_y: Vec<[f64; D]>,
}

impl<const D: usize> Way<D> {
    /// A direction of no length yet.
    pub fn new(pool: &mut Pool<D>) -> Self {
        let [dx, pull, scaled_x, scaled_y] = std::array::from_fn(|_| pool.zeros(0));
        Way { dx, pull, scaled_x, scaled_y }
    }
    /// Gives the memory back.
    pub fn leave(self, pool: &mut Pool<D>) {
        pool.give([self.dx, self.pull, self.scaled_x, self.scaled_y]);
    }
    /// Becomes the pair's present direction.
    pub fn take(&mut self, pair: &Pair<D>, count: usize) {
        self.dx.clone_from(&pair.dx);
        self.pull.clone_from(&pair.pull);
        self.scaled_x.clear();
        self.scaled_x.extend((0..count).map(|i| scaled(pair, i, &pair.dx[i])));
        let scaled_x = &self.scaled_x;
        let left = |i: usize| std::array::from_fn(|k| pair.pull[i][k] - scaled_x[i][k]);
        self.scaled_y.clear();
        self.scaled_y.extend((0..count).map(left));
    }
    /// Scalar product in the metric of the scaling.
    pub fn dot(&self, other: &Self) -> f64 {
        sum(&self.scaled_x, &other.scaled_x) + sum(&self.scaled_y, &other.scaled_y)
    }
    /// The largest part of one contact.
    pub fn largest(&self) -> f64 {
        let own = |k: usize| {
            sum(&self.scaled_x[k..=k], &self.scaled_x[k..=k])
                + sum(&self.scaled_y[k..=k], &self.scaled_y[k..=k])
        };
        (0..self.scaled_x.len()).map(own).fold(0.0, f64::max).sqrt()
    }
    /// Makes `a` self + `b` other the pair's present direction.
    pub fn combine(&self, a: f64, other: &Self, b: f64, pair: &mut Pair<D>) {
        for i in 0..self.dx.len() {
            for k in 0..D {
                pair.dx[i][k] = a * self.dx[i][k] + b * other.dx[i][k];
                pair.pull[i][k] = a * self.pull[i][k] + b * other.pull[i][k];
            }
        }
    }
}

fn sum<const D: usize>(a: &[[f64; D]], b: &[[f64; D]]) -> f64 {
    a.as_flattened().iter().zip(b.as_flattened()).map(|(a, b)| a * b).sum()
}

/// G v of contact i.
fn scaled<const D: usize>(pair: &Pair<D>, i: usize, v: &[f64; D]) -> [f64; D] {
    let (w, eta) = (&pair.w[i], pair.eta[i]);
    let along: f64 = (1..D).map(|k| w[k] * v[k]).sum();
    let carry = v[0] + along / (1.0 + w[0]);
    std::array::from_fn(|k| eta * if k == 0 { w[0] * v[0] + along } else { v[k] + w[k] * carry })
}
