//! The problem in the units of the cone L: x = (mu r_N, r_T) s_W / s_q, W~ = P W P / s_W, q~ = P q / s_q with
//! P = diag(1 / mu, 1, 1), s_q the largest entry of q and s_W the mean norm of the diagonal blocks (theory
//! chapter 7). A contact without friction keeps its normal row; its tangents are uncoupled and stay zero.

use super::blocks::{Blocks, row_times};
use super::bodies::Rows;
use super::judge::{Errors, errors};
use crate::linear::Graph;

/// Below this a coefficient of friction is none \[1\]: P W P would hold 1e18 next to 1.
const NO_FRICTION: f64 = 1e-9;

/// W~, q~ and the way back.
#[derive(Clone, Debug, Default)]
pub struct Scaled<const D: usize> {
    /// Which contacts are coupled.
    pub graph: Graph,
    /// W~, block by block, row by row.
    pub values: Vec<f64>,
    /// Where the diagonal blocks start in the values.
    pub diagonal: Vec<u32>,
    /// q~, padded.
    pub velocity: Vec<[f64; D]>,
    /// P, padded with 1.
    pub stretch: Vec<[f64; D]>,
    /// Step length of the natural map, 1 / |W~_ii|, padded with 1.
    pub step: Vec<f64>,
    /// The contacts' rows on bodies, where the problem knows them: W~ = B B^T.
    pub rows: Option<Rows>,
    /// s_q / s_W.
    pub impulse_unit: f64,
    /// s_q.
    pub velocity_unit: f64,
    /// Impulses and velocities in the problem's own units, for judging.
    r: Vec<[f64; D]>,
    u: Vec<[f64; D]>,
}

impl<const D: usize> Scaled<D> {
    /// The scaled form of a problem.
    pub fn of(blocks: &Blocks<D>) -> Self {
        let (count, padded) = (blocks.count(), blocks.velocity.len());
        let largest = blocks.velocity.as_flattened().iter().fold(0.0_f64, |m, q| m.max(q.abs()));
        let velocity_unit = if largest > 0.0 { largest } else { 1.0 };
        let mean = blocks.norms[..count].iter().sum::<f64>() / count.max(1) as f64;
        let stretch: Vec<[f64; D]> = (0..padded)
            .map(|i| {
                let mu = blocks.friction[i];
                std::array::from_fn(|k| if k == 0 && mu > NO_FRICTION && D > 1 { 1.0 / mu } else { 1.0 })
            })
            .collect();
        let mut scaled = Scaled {
            graph: blocks.graph.clone(),
            values: blocks.values.clone(),
            diagonal: blocks.diagonal.iter().map(|&k| blocks.graph.offsets[k as usize]).collect(),
            velocity: blocks.velocity.clone(),
            stretch,
            step: vec![1.0; padded],
            rows: None,
            impulse_unit: velocity_unit / mean,
            velocity_unit,
            r: vec![[0.0; D]; padded],
            u: vec![[0.0; D]; padded],
        };
        let slides = |i: usize, k: usize| k == 0 || blocks.friction[i] > NO_FRICTION;
        for i in 0..count {
            for k in scaled.graph.row(i) {
                let j = scaled.graph.neighbours[k] as usize;
                let at = scaled.graph.offsets[k] as usize;
                for (e, value) in scaled.values[at..at + D * D].iter_mut().enumerate() {
                    let (row, column) = (e / D, e % D);
                    let coupled = slides(i, row) && slides(j, column);
                    let factor = scaled.stretch[i][row] * scaled.stretch[j][column] / mean;
                    *value = if coupled { *value * factor } else { 0.0 };
                    if i == j && row == column && !coupled {
                        *value = 1.0;
                    }
                }
            }
            for k in 0..D {
                let q = if slides(i, k) { scaled.velocity[i][k] } else { 0.0 };
                scaled.velocity[i][k] = q * scaled.stretch[i][k] / velocity_unit;
            }
            let at = scaled.diagonal[i] as usize;
            let size = scaled.values[at..at + D * D].iter().map(|w| w * w).sum::<f64>().sqrt();
            scaled.step[i] = if size > 0.0 { 1.0 / size } else { 1.0 };
        }
        scaled
    }
    /// Number of contacts.
    pub fn count(&self) -> usize {
        self.graph.nodes()
    }
    /// W~ x.
    pub fn product(&self, x: &[[f64; D]], out: &mut [[f64; D]]) {
        for (i, out) in out.iter_mut().enumerate().take(self.count()) {
            *out = row_times(&self.graph, &self.values, i, x, false);
        }
    }
    /// u = W~ x + q~.
    pub fn velocities(&self, x: &[[f64; D]], u: &mut [[f64; D]]) {
        self.product(x, u);
        for (u, q) in u.iter_mut().zip(&self.velocity[..self.count()]) {
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
    pub fn from_impulses(&self, r: &[[f64; D]], x: &mut [[f64; D]]) {
        for i in 0..self.count() {
            for k in 0..D {
                x[i][k] = r[i][k] / (self.stretch[i][k] * self.impulse_unit);
            }
        }
    }
}
