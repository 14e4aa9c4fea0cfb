//! The problem in the units of the cone L: x = P^-1 r s_W / s_q, W~ = P W P / s_W, q~ = P q / s_q with
//! P = d_i diag(1 / mu, 1, 1), d_i = (s_W / |W_ii|)^1/4 the contact's own unit, s_q the largest entry of d q and s_W
//! the mean norm of the diagonal blocks (theory chapter 7). A contact without friction keeps its normal row; its tangential rows are zeroed, so they stay zero.

use super::blocks::Blocks;
use super::cone::LEAST;
use super::couplings::{Couplings, scaled_velocities};
use super::judge::{Errors, errors};
use super::operator::Operator;
use std::cell::RefCell;
use std::sync::Arc;

/// Below this a coefficient of friction is none \[1\]: P W P would hold 1e18 next to 1.
const NO_FRICTION: f64 = 1e-9;

/// W~, q~ and the way back.
#[derive(Clone, Debug, Default)]
pub struct Scaled<const D: usize> {
    /// W~.
    pub operator: Operator<D>,
    /// q~, padded.
    pub velocity: Vec<[f64; D]>,
    /// P, padded with 1.
    pub stretch: Vec<[f64; D]>,
    /// Step length of the natural map, 1 / |W~_ii|, padded with 1.
    pub step: Vec<f64>,
    /// Smallest eigenvalue of the projection's derivative that a Newton step uses.
    pub least: f64,
    /// s_q / s_W.
    pub impulse_unit: f64,
    /// s_q.
    pub velocity_unit: f64,
    /// Impulses and velocities in the problem's own units, for judging.
    r: Vec<[f64; D]>,
    u: Vec<[f64; D]>,
    /// d_i, padded, and P over the root of s_W with zeros where no tangent acts.
    own: Vec<f64>,
    shares: Vec<[f64; D]>,
    /// W as it is multiplied, unscaled; none where it is given by rows on bodies.
    couplings: Option<Arc<Couplings>>,
    /// Memory for products: through bodies, or impulses apart.
    room: RefCell<Vec<f64>>,
}

impl<const D: usize> Scaled<D> {
    /// Becomes the scaled form of a problem.
    pub fn update(&mut self, blocks: &Blocks<D>) {
        let (count, padded) = (blocks.count(), blocks.velocity.len());
        let mean = blocks.norms[..count].iter().sum::<f64>() / count.max(1) as f64;
        // Without own units light bodies set the scale for heavy ones: of 34 piles, chains and random problems with masses
        // over 1e6 none is solved with 400 factorisations, with the fourth root two thirds are. The square root, which
        // makes all blocks alike, hides from the start which contacts carry the load: a pile of spheres then takes 373
        // factorisations instead of 28.
        self.own.clear();
        self.own.extend((0..padded).map(|i| {
            if i < count && blocks.norms[i] > 0.0 { (mean / blocks.norms[i]).sqrt().sqrt() } else { 1.0 }
        }));
        let own = &self.own;
        let largest =
            blocks.velocity.iter().zip(own).flat_map(|(q, own)| q.iter().map(move |q| (q * own).abs()));
        let largest = largest.fold(0.0, f64::max);
        self.velocity_unit = if largest > 0.0 { largest } else { 1.0 };
        self.impulse_unit = self.velocity_unit / mean;
        self.least = LEAST;
        self.stretch.clear();
        self.stretch.extend((0..padded).map(|i| -> [f64; D] {
            let mu = blocks.friction[i];
            std::array::from_fn(|k| if k == 0 && mu > NO_FRICTION && D > 1 { own[i] / mu } else { own[i] })
        }));
        let slides = |i: usize, k: usize| k == 0 || blocks.friction[i] > NO_FRICTION;
        let stretch = &self.stretch;
        self.shares.clear();
        self.shares.extend((0..count).map(|i| -> [f64; D] {
            std::array::from_fn(|k| if slides(i, k) { stretch[i][k] / mean.sqrt() } else { 0.0 })
        }));
        self.operator.become_scaled(&blocks.operator, &self.shares);
        self.couplings.clone_from(&blocks.couplings);
        self.velocity.clone_from(&blocks.velocity);
        self.step.clear();
        self.step.resize(padded, 1.0);
        for i in 0..count {
            for k in 0..D {
                self.velocity[i][k] *= self.shares[i][k] * mean.sqrt() / self.velocity_unit;
            }
            let (block, shares) = (&blocks.diagonal[i], &self.shares[i]);
            let mut squares = 0.0;
            for (row, share) in block.iter().zip(shares) {
                row.iter().zip(shares).for_each(|(w, other)| squares += (w * (share * other)).powi(2));
            }
            let size = squares.sqrt();
            self.step[i] = if size > 0.0 { 1.0 / size } else { 1.0 };
        }
        for vector in [&mut self.r, &mut self.u] {
            vector.clear();
            vector.resize(padded, [0.0; D]);
        }
    }
    /// Multiplies the step lengths of the natural map.
    pub fn lengthen(&mut self, factor: f64) {
        self.step.iter_mut().for_each(|s| *s *= factor);
        self.least /= factor;
    }
    /// Number of contacts.
    pub fn count(&self) -> usize {
        self.operator.count()
    }
    /// Lets go of what is the problem's.
    pub fn forget_couplings(&mut self) {
        self.couplings = None;
    }
    /// W~ x.
    pub fn product(&self, x: &[[f64; D]], out: &mut [[f64; D]]) {
        let room = &mut self.room.borrow_mut();
        match &self.couplings {
            Some(couplings) => scaled_velocities(couplings, (&self.shares, None), (x, room), out),
            None => self.operator.product(x, out, room),
        }
    }
    /// u = W~ x + q~.
    pub fn velocities(&self, x: &[[f64; D]], u: &mut [[f64; D]]) {
        if let Some(couplings) = &self.couplings {
            let room = &mut self.room.borrow_mut();
            scaled_velocities(couplings, (&self.shares, Some(&self.velocity)), (x, room), u);
            return;
        }
        self.product(x, u);
        let count = self.count();
        for (u, q) in u.iter_mut().zip(&self.velocity[..count]) {
            for k in 0..D {
                u[k] += q[k];
            }
        }
    }
    /// Errors, in the problem's own units, of x with u = W~ x + q~.
    pub fn errors(&mut self, blocks: &Blocks<D>, x: &[[f64; D]], u: &[[f64; D]]) -> Errors {
        for i in 0..self.count() {
            for k in 0..D {
                self.r[i][k] = x[i][k] * self.stretch[i][k] * self.impulse_unit;
                self.u[i][k] = u[i][k] / self.stretch[i][k] * self.velocity_unit;
            }
        }
        errors(blocks, &self.r, &self.u)
    }
    /// Impulses in the problem's own units.
    pub fn to_impulses(&self, x: &[[f64; D]], r: &mut [[f64; D]]) {
        for i in 0..self.count() {
            for k in 0..D {
                r[i][k] = x[i][k] * self.stretch[i][k] * self.impulse_unit;
            }
        }
    }
    /// Impulses in the units of the cone.
    pub fn in_cone_units(&self, r: &[[f64; D]], x: &mut [[f64; D]]) {
        for i in 0..self.count() {
            for k in 0..D {
                x[i][k] = r[i][k] / (self.stretch[i][k] * self.impulse_unit);
            }
        }
    }
}
