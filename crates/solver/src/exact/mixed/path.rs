//! Stage E of `exact` for mixed problems: the curve of (7.7) followed through its folds. With tau from 1 to 0,
//!   sum over the cones of a normal row: c (y_0 - (1 - tau) |y_T|) = u_n + tau o_n,   y_T = u_T + tau o_T,   x o y = tau m e,
//! where o makes the start exact at tau = 1. Steps and rules are those of `path.rs`; the factors are dense, for the sign of
//! their determinant tells where tau turns back.

use super::cone::{Cone, Vector};
use super::interior::Interior;
use super::parts::Part;
use crate::delassus::Csr;
use faer::Mat;
use faer::linalg::solvers::PartialPivLu;

/// Most scalar rows: dense factors of more cost too much.
const LARGEST: usize = 1000;
/// As in `path.rs`.
const RIDGE: f64 = 1e-8;
const CENTRAL: f64 = 0.03;
const STRAIGHT: f64 = 0.6;
const NEAR: f64 = 1.0;
const FAR: f64 = 3.0;
const PATIENCE: usize = 3;
const HUGE: f64 = 1e13;

/// A direction: of all rows, and dx, pull, G dx and G^-1 dy of every cone.
#[derive(Default)]
struct Way {
    step: Vec<f64>,
    cones: Vec<[Vector; 4]>,
}

impl Way {
    /// The present direction.
    fn of(interior: &Interior) -> Self {
        let own = interior.cones.iter().map(|c| [c.dx, c.pull, c.scaled_dx(), c.left_scaled()]);
        Way { step: interior.step.clone(), cones: own.collect() }
    }
    /// Scalar product of cone k in the metric of the scaling.
    fn own(&self, other: &Self, k: usize) -> f64 {
        let (a, b) = (&self.cones[k][2..], &other.cones[k][2..]);
        a.as_flattened().iter().zip(b.as_flattened()).map(|(a, b)| a * b).sum()
    }
    fn dot(&self, other: &Self) -> f64 {
        (0..self.cones.len()).map(|k| self.own(other, k)).sum()
    }
    /// The largest part of one cone.
    fn largest(&self) -> f64 {
        (0..self.cones.len()).map(|k| self.own(self, k)).fold(0.0, f64::max).sqrt()
    }
    /// Makes `a` self + `b` other the present direction.
    fn combine(&self, a: f64, other: &Self, b: f64, interior: &mut Interior) {
        let rows = self.step.iter().zip(&other.step);
        interior.step.iter_mut().zip(rows).for_each(|(s, (x, y))| *s = a * x + b * y);
        for (c, (x, y)) in interior.cones.iter_mut().zip(self.cones.iter().zip(&other.cones)) {
            c.dx = std::array::from_fn(|k| a * x[0][k] + b * y[0][k]);
            c.pull = std::array::from_fn(|k| a * x[1][k] + b * y[1][k]);
            c.complete();
        }
    }
}

/// Where the curve starts and what it has come to.
pub struct Curve {
    interior: Interior,
    /// o of all rows.
    offset: Vec<f64>,
    /// x.y of a cone at the start.
    start: f64,
    /// |y_T| -> sqrt(|y_T|^2 + (smoothing tau)^2) - smoothing tau.
    smoothing: f64,
    /// tau, and what all rows lack there.
    share: f64,
    residual: Vec<f64>,
    /// The share of that which goes away with tau.
    fading: Vec<f64>,
    /// The point before a long step that is not yet trusted.
    before: Option<(Vec<f64>, Vec<Cone>)>,
    /// Points to come without long steps.
    careful: usize,
}

impl Curve {
    /// The start of the curve; `None` for problems that are too large.
    pub fn begin(matrix: &Csr, velocity: &[f64], parts: &[Part], smoothing: f64) -> Option<Self> {
        if velocity.len() > LARGEST {
            return None;
        }
        let (interior, start) = Interior::sized(matrix, velocity, parts, RIDGE)?;
        let offset = interior.residual(0.0, 0.0);
        let nothing = vec![0.0; offset.len()];
        Some(Curve {
            interior,
            residual: nothing.clone(),
            fading: nothing,
            offset,
            start,
            smoothing,
            share: 1.0,
            before: None,
            careful: 0,
        })
    }

    /// The impulses of the present point, unless they have outgrown all velocities.
    pub fn impulses(&self) -> Option<Vec<f64>> {
        let huge = self.interior.cones.iter().any(|c| !c.x.iter().all(|x| x.abs() < HUGE));
        (!huge).then(|| self.interior.impulses().collect())
    }

    /// x.y of a cone, on the mean.
    pub fn mean(&self) -> f64 {
        self.interior.mean(0.0)
    }

    /// From one point to the next; nothing when the numbers end.
    pub fn advance(&mut self) -> Option<()> {
        let m = self.mean();
        let factor = self.look(m)?;
        let affine = self.toward(&factor, (0.0, false))?.min(1.0);
        let ahead = Way::of(&self.interior);
        let after = self.interior.mean(affine);
        let onward = determinant_sign(&factor);
        if onward < 0.0 && self.undo() {
            return Some(());
        }
        if self.careful > 0 {
            self.careful -= 1;
        } else if onward > 0.0 && affine > STRAIGHT {
            let sigma = (after.max(0.0) / m).powi(3).clamp(1e-8, 1.0);
            if let Some(length) = self.long_step(&factor, sigma) {
                self.before = Some((self.interior.x.clone(), self.interior.cones.clone()));
                return self.interior.take(length).then_some(());
            }
        }
        let length = self.tangent_step(&factor, &ahead, onward)?;
        (length == 0.0 || self.interior.take(length)).then_some(())
    }

    /// Scaling, residual and factors at the present point.
    fn look(&mut self, m: f64) -> Option<PartialPivLu<f64>> {
        self.share = m / self.start;
        let smoothing = self.smoothing * self.share;
        let friction = (1.0 - self.share).max(0.0);
        self.interior.cones.iter_mut().for_each(|c| c.prepare(smoothing, friction));
        self.residual = self.interior.residual(smoothing, 1.0);
        self.fading = self.interior.slips(smoothing);
        self.fading.iter_mut().zip(&self.offset).for_each(|(f, o)| *f -= o);
        let n = self.offset.len();
        let mut dense = Mat::<f64>::zeros(n, n);
        self.interior.entries().iter().for_each(|e| dense[(e.row, e.col)] += e.val);
        let is_finite = (0..n).all(|j| (0..n).all(|i| dense[(i, j)].is_finite()));
        is_finite.then(|| dense.partial_piv_lu())
    }

    /// The direction to the point of the curve with this share of the present tau, and how far it goes.
    fn toward(&mut self, factor: &PartialPivLu<f64>, (part, corrected): (f64, bool)) -> Option<f64> {
        let kept = part * self.share;
        let residual: Vec<f64> = self.residual.iter().zip(&self.fading).map(|(r, f)| r + kept * f).collect();
        self.interior.go(factor, &residual, kept * self.start, corrected)
    }

    /// Goes back to the point before the last long step, if that is still in doubt.
    fn undo(&mut self) -> bool {
        let Some(before) = self.before.take() else { return false };
        (self.interior.x, self.interior.cones) = before;
        self.careful = PATIENCE;
        true
    }

    /// Length of a step of the interior point, where it goes far and brings what it promises; the present direction
    /// is the affine one.
    fn long_step(&mut self, factor: &PartialPivLu<f64>, sigma: f64) -> Option<f64> {
        let m = self.share * self.start;
        self.interior.cones.iter_mut().for_each(|c| c.affine = [c.dx, c.dy]);
        let longest = self.toward(factor, (sigma, true))?;
        let mut length = (0.9 * longest).min(1.0);
        while length > STRAIGHT && !(self.centrality(length) >= 0.1) {
            length *= 0.8;
        }
        let left = self.interior.mean(length) / m;
        (length > STRAIGHT && left < 1.0 - 0.5 * length * (1.0 - sigma)).then_some(length)
    }

    /// The least sqrt(det x det y) over their mean after a step.
    fn centrality(&self, length: f64) -> f64 {
        self.interior.least(length) / self.interior.mean(length)
    }

    /// Makes a step back to the curve, across the tangent, and ahead along it where the curve is near, the present
    /// direction; its length, 0 when a long step was taken back instead.
    fn tangent_step(&mut self, factor: &PartialPivLu<f64>, ahead: &Way, onward: f64) -> Option<f64> {
        self.toward(factor, (1.0, false))?;
        let back = Way::of(&self.interior);
        let along = -back.dot(ahead) / ahead.dot(ahead);
        back.combine(1.0, ahead, along, &mut self.interior);
        let across = self.interior.reach();
        let back = Way::of(&self.interior);
        let off = back.largest() / (self.share * self.start).sqrt();
        if off > FAR && self.undo() {
            return Some(0.0);
        }
        if !(off < NEAR) {
            return Some((0.9 * across).min(1.0));
        }
        self.before = None;
        ahead.combine(onward, ahead, 0.0, &mut self.interior);
        let mut far = (0.7 * self.interior.reach()).min(0.9);
        let mut length = 0.0;
        for _ in 0..10 {
            back.combine(1.0, ahead, onward * far, &mut self.interior);
            length = (0.9 * self.interior.reach()).min(1.0);
            if length >= 0.99 && self.centrality(length) >= CENTRAL {
                break;
            }
            far *= 0.6;
        }
        Some(length)
    }
}

/// The sign of the determinant of a matrix in factors.
fn determinant_sign(factor: &PartialPivLu<f64>) -> f64 {
    let (upper, order) = (factor.U(), factor.P().arrays().0);
    let negative = (0..upper.nrows()).filter(|&k| upper[(k, k)] < 0.0).count();
    let mut seen = vec![false; order.len()];
    let mut swaps = 0;
    for first in 0..order.len() {
        let mut at = first;
        while !std::mem::replace(&mut seen[at], true) {
            at = order[at];
            swaps += usize::from(at != first);
        }
    }
    if (negative + swaps) % 2 == 0 { 1.0 } else { -1.0 }
}
