//! The problem in the units of the cone L: x = P^-1 r s_W / s_q, W~ = P W P / s_W, q~ = P q / s_q with
//! P = d_i diag(1 / mu, 1, 1), d_i = (s_W / |W_ii|)^1/4 the contact's own unit, s_q the largest entry of d q and s_W
//! the mean norm of the diagonal blocks (theory chapter 7). A contact without friction keeps its normal row; its tangential rows are zeroed, so they stay zero.

use super::blocks::Blocks;
use super::cone::LEAST;
use super::judge::{Errors, errors};
use super::operator::Operator;
use std::cell::RefCell;

/// Below this a coefficient of friction is none \[1\]: P W P would hold 1e18 next to 1.
const NO_FRICTION: f64 = 1e-9;

/// W~, q~ and the way back.
#[derive(Clone, Debug)]
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
    /// Memory for products through bodies.
    bodies: RefCell<Vec<f64>>,
}

impl<const D: usize> Scaled<D> {
    /// The scaled form of a problem.
    pub fn of(blocks: &Blocks<D>) -> Self {
        let (count, padded) = (blocks.count(), blocks.velocity.len());
        let mean = blocks.norms[..count].iter().sum::<f64>() / count.max(1) as f64;
        // Without own units light bodies set the scale for heavy ones: of 34 piles, chains and random problems with masses
        // over 1e6 none is solved with 400 factorisations, with the fourth root two thirds are. The square root, which
        // makes all blocks alike, hides from the start which contacts carry the load: a pile of spheres then takes 373
        // factorisations instead of 28.
        let own: Vec<f64> = (0..padded)
            .map(|i| {
                if i < count && blocks.norms[i] > 0.0 { (mean / blocks.norms[i]).sqrt().sqrt() } else { 1.0 }
            })
            .collect();
        let largest =
            blocks.velocity.iter().zip(&own).flat_map(|(q, own)| q.iter().map(move |q| (q * own).abs()));
        let largest = largest.fold(0.0, f64::max);
        let velocity_unit = if largest > 0.0 { largest } else { 1.0 };
        let stretch: Vec<[f64; D]> = (0..padded)
            .map(|i| {
                let mu = blocks.friction[i];
                std::array::from_fn(
                    |k| if k == 0 && mu > NO_FRICTION && D > 1 { own[i] / mu } else { own[i] },
                )
            })
            .collect();
        let slides = |i: usize, k: usize| k == 0 || blocks.friction[i] > NO_FRICTION;
        let shares: Vec<[f64; D]> = (0..count)
            .map(|i| std::array::from_fn(|k| if slides(i, k) { stretch[i][k] / mean.sqrt() } else { 0.0 }))
            .collect();
        let operator = blocks.operator.scaled(&shares);
        let mut velocity = blocks.velocity.clone();
        let mut step = vec![1.0; padded];
        for i in 0..count {
            for k in 0..D {
                velocity[i][k] *= shares[i][k] * mean.sqrt() / velocity_unit;
            }
            let block = operator.diagonal_block(i);
            let size = block.as_flattened().iter().map(|w| w * w).sum::<f64>().sqrt();
            step[i] = if size > 0.0 { 1.0 / size } else { 1.0 };
        }
        Scaled {
            operator,
            velocity,
            stretch,
            step,
            least: LEAST,
            impulse_unit: velocity_unit / mean,
            velocity_unit,
            r: vec![[0.0; D]; padded],
            u: vec![[0.0; D]; padded],
            bodies: RefCell::default(),
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
    /// W~ x.
    pub fn product(&self, x: &[[f64; D]], out: &mut [[f64; D]]) {
        self.operator.product(x, out, &mut self.bodies.borrow_mut());
    }
    /// u = W~ x + q~.
    pub fn velocities(&self, x: &[[f64; D]], u: &mut [[f64; D]]) {
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
