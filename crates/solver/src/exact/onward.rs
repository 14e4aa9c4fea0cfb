//! What leads sweeps on faster than they go: conjugate directions over them (theory eq. 5.35), and Anderson's mixture of
//! the last changes (Anderson 1965; Walker and Ni 2011), which does not ask the map of a sweep to be symmetric, as those do.

use super::lane::PACK;
use crate::linear::Envelope;

/// Impulses, as the order has them, with B^T r beside them; where W is a matrix the latter is empty.
#[derive(Clone, Debug, Default)]
pub struct Point {
    pub r: Vec<f64>,
    pub bodies: Vec<f64>,
}

impl Point {
    /// Becomes another.
    pub fn copy_from(&mut self, other: &Self) {
        self.r.clone_from(&other.r);
        self.bodies.clone_from(&other.bodies);
    }
    /// Applies to all numbers, with those of another point beside them.
    fn with(&mut self, other: &Self, mut apply: impl FnMut(&mut f64, f64)) {
        self.r.iter_mut().zip(&other.r).for_each(|(a, b)| apply(a, *b));
        self.bodies.iter_mut().zip(&other.bodies).for_each(|(a, b)| apply(a, *b));
    }
    /// A sum over impulses, each with its weight.
    fn weighed(&self, other: &Self, weights: &[f64], f: impl Fn(f64, f64) -> f64) -> f64 {
        let ((own, rest), (others, other_rest)) = (self.r.as_chunks::<PACK>(), other.r.as_chunks::<PACK>());
        let (packs, weights_rest) = weights.as_chunks::<PACK>();
        let mut sums = [0.0; PACK];
        for ((a, b), w) in own.iter().zip(others).zip(packs) {
            for k in 0..PACK {
                sums[k] += w[k] * f(a[k], b[k]);
            }
        }
        let rest = rest.iter().zip(other_rest).zip(weights_rest);
        sums.iter().sum::<f64>() + rest.map(|((a, b), w)| w * f(*a, *b)).sum::<f64>()
    }
    /// The squared distance of impulses, each as the energy that it makes alone \[J\].
    fn squared_distance(&self, other: &Self, weights: &[f64]) -> f64 {
        self.weighed(other, weights, |a, b| (a - b) * (a - b))
    }
    fn dot(&self, other: &Self, weights: &[f64]) -> f64 {
        self.weighed(other, weights, |a, b| a * b)
    }
}

/// A conjugate direction is forgotten when the squared change of a sweep grows by more than this.
const RESTART: f64 = 2.0;

/// Conjugate directions over sweeps.
#[derive(Debug, Default)]
pub struct Conjugate {
    /// Where the last sweep began.
    before: Point,
    direction: Point,
    /// Squared change of the sweep before; 0 for none.
    length: f64,
}

impl Conjugate {
    /// Begins anew at a point.
    pub fn begin(&mut self, at: &Point) {
        self.before.copy_from(at);
        self.direction.copy_from(at);
        self.length = 0.0;
    }
    /// Goes on from where a sweep has led.
    pub fn go_on(&mut self, at: &mut Point, weights: &[f64]) {
        let length = at.squared_distance(&self.before, weights);
        let beta = length / self.length;
        self.length = length;
        // false for the first, infinite or NaN
        let beta = if beta <= RESTART { beta } else { 0.0 };
        let step = |at: &mut [f64], direction: &mut [f64], before: &mut [f64]| {
            for ((at, direction), before) in at.iter_mut().zip(direction).zip(before) {
                let further = beta * *direction;
                *direction = *at - *before + further;
                *at += further;
                *before = *at;
            }
        };
        step(&mut at.r, &mut self.direction.r, &mut self.before.r);
        step(&mut at.bodies, &mut self.direction.bodies, &mut self.before.bodies);
    }
}

/// Most changes that are mixed.
const DEPTH: usize = 24;
/// The changes before are forgotten when what a map moves grows by more than this.
const GROWTH: f64 = 2.0;
/// Share of its squared length that is added to each change's own.
const RIDGE: f64 = 1e-12;

/// Anderson's mixture: with f = g(x) - x at x and the changes F of f and G of g since earlier points, the next point is
/// g(x) - G c where |f - F c| is least.
#[derive(Debug, Default)]
pub struct Mixture {
    /// Changes of f and of g, the oldest first.
    changes: Vec<[Point; 2]>,
    /// f and g at the last point of a run without a break.
    last: Option<[Point; 2]>,
    size: f64,
    gram: Envelope,
    weights: Vec<f64>,
}

impl Mixture {
    /// Forgets all changes.
    pub fn forget(&mut self) {
        self.changes.clear();
        self.last = None;
    }
    /// What comes next does not follow what came before.
    pub fn pause(&mut self) {
        self.last = None;
    }
    /// From x and `at` = g(x) to the next point, in `at`.
    pub fn go_on(&mut self, x: &Point, at: &mut Point, weights: &[f64]) {
        let mut moved = at.clone();
        moved.with(x, |a, b| *a -= b);
        let size = moved.dot(&moved, weights).sqrt();
        if self.last.is_some() && !(size <= GROWTH * self.size) {
            self.forget();
        }
        self.size = size;
        if let Some([mut before, mut before_map]) = self.last.take() {
            before.with(&moved, |a, b| *a = b - *a);
            before_map.with(at, |a, b| *a = b - *a);
            if self.changes.len() == DEPTH {
                self.changes.remove(0);
            }
            self.changes.push([before, before_map]);
        }
        let map = at.clone();
        if self.mix(&moved, weights) {
            for ([_, change], c) in self.changes.iter().zip(&self.weights) {
                at.with(change, |a, b| *a -= c * b);
            }
        } else {
            self.changes.clear();
        }
        self.last = Some([moved, map]);
    }
    /// The weights of the changes; false where they are not told apart.
    fn mix(&mut self, moved: &Point, weights: &[f64]) -> bool {
        self.gram.clear();
        self.weights.clear();
        for (i, [change, _]) in self.changes.iter().enumerate() {
            let row = self.gram.push(0);
            for (entry, [other, _]) in row.iter_mut().zip(&self.changes) {
                *entry = change.dot(other, weights);
            }
            row[i] *= 1.0 + RIDGE;
            self.weights.push(change.dot(moved, weights));
        }
        if !self.gram.factorize() {
            return false;
        }
        self.gram.solve(&mut self.weights);
        self.weights.iter().all(|c| c.is_finite())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// g(x) = A x + b of six unknowns, not symmetric, that contracts by .97 at best.
    fn map(x: &Point) -> Point {
        let mut g = Point { r: vec![0.0; 6], bodies: Vec::new() };
        for i in 0..6 {
            let twist = if i + 1 < 6 { 0.3 * x.r[i + 1] } else { 0.0 };
            g.r[i] = (0.97 - 0.1 * i as f64) * x.r[i] + twist + 1.0;
        }
        g
    }

    fn distance_after(steps: usize, mixed: bool) -> f64 {
        let (weights, mut mixture) = ([1.0; 6], Mixture::default());
        let mut at = Point { r: vec![0.0; 6], bodies: Vec::new() };
        for _ in 0..steps {
            let x = at.clone();
            at = map(&x);
            if mixed {
                mixture.go_on(&x, &mut at, &weights);
            }
        }
        at.squared_distance(&map(&at), &weights).sqrt()
    }

    #[test]
    fn a_linear_map_of_six_unknowns_is_mixed_to_its_fixed_point_in_eight_steps() {
        assert!(distance_after(8, true) < 1e-7, "{}", distance_after(8, true));
        assert!(distance_after(8, false) > 0.1);
    }

    #[test]
    fn conjugate_directions_find_the_least_of_a_quadratic_form_in_as_many_steps_as_unknowns() {
        // x moves against the gradient of 1/2 x.Ax - x.b, A diagonal: x = b / A
        let pull = |x: &mut Point| {
            let slopes = [1.0, 0.7, 0.4, 0.1];
            x.r.iter_mut().zip(slopes).for_each(|(x, a)| *x -= a * *x - 1.0);
        };
        let weights = [1.0; 4];
        let mut at = Point { r: vec![0.0; 4], bodies: Vec::new() };
        let mut conjugate = Conjugate::default();
        conjugate.begin(&at);
        for _ in 0..24 {
            pull(&mut at);
            conjugate.go_on(&mut at, &weights);
        }
        pull(&mut at);
        assert!((at.r[3] - 10.0).abs() < 0.05 * 10.0, "{:?}", at.r);
        let plain = 10.0 * (1.0 - 0.9_f64.powi(25));
        assert!((at.r[3] - 10.0).abs() < 0.5 * (plain - 10.0).abs());
    }
}
