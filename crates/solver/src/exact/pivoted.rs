//! Contact space factorised whole with partial pivoting: what is left where pivots inside chunks lose the digits
//! (impulses of a million beside impulses of one). Dense, so for small problems alone.

use super::operator::Matrix;
use super::system::Block;
use faer::linalg::solvers::{PartialPivLu, Solve};
use faer::{Col, Mat};

/// Most rows: a factorisation of so many takes less than a tenth of a second.
const MOST: usize = 1000;

/// W~ + D, dense.
#[derive(Clone, Debug)]
pub struct Pivoted<const D: usize> {
    matrix: Mat<f64>,
    factor: Option<PartialPivLu<f64>>,
}

impl<const D: usize> Pivoted<D> {
    /// W~ as a dense matrix; `None` when it is too large.
    pub fn of(matrix: &Matrix) -> Option<Self> {
        let n = matrix.graph.nodes() * D;
        if n > MOST {
            return None;
        }
        let mut dense = Mat::zeros(n, n);
        for i in 0..matrix.graph.nodes() {
            for k in matrix.graph.row(i) {
                let j = matrix.graph.neighbours[k] as usize;
                let block = &matrix.values[matrix.graph.offsets[k] as usize..][..D * D];
                for (e, value) in block.iter().enumerate() {
                    dense[(i * D + e / D, j * D + e % D)] += value;
                }
            }
        }
        Some(Pivoted { matrix: dense, factor: None })
    }
    /// Factorises W~ + D; false when it is singular.
    pub fn factorize(&mut self, blocks: &[Block<D>]) -> bool {
        let mut sum = self.matrix.clone();
        for (i, block) in blocks.iter().enumerate().take(sum.nrows() / D) {
            for (e, value) in block.as_flattened().iter().enumerate() {
                sum[(i * D + e / D, i * D + e % D)] += value;
            }
        }
        let factor = PartialPivLu::new(sum.as_ref());
        let upper = factor.U();
        let regular = (0..upper.nrows()).all(|k| upper[(k, k)].is_normal());
        self.factor = Some(factor);
        regular
    }
    /// Replaces rhs by dx.
    pub fn solve(&self, x: &mut [[f64; D]]) {
        let Some(factor) = &self.factor else { return };
        let n = self.matrix.nrows();
        let flat = x.as_flattened_mut();
        let solution = factor.solve(&Col::from_fn(n, |k| flat[k]));
        flat[..n].iter_mut().enumerate().for_each(|(k, x)| *x = solution[k]);
    }
    /// The sign of the determinant of W~ + D.
    pub fn determinant_sign(&self) -> f64 {
        let Some(factor) = &self.factor else { return 0.0 };
        let upper = factor.U();
        let mut sign: f64 = (0..upper.nrows()).map(|k| upper[(k, k)].signum()).product();
        let order = factor.P().arrays().0;
        let mut seen = vec![false; order.len()];
        for first in 0..order.len() {
            let (mut at, mut length) = (first, 0);
            while !seen[at] {
                seen[at] = true;
                at = order[at];
                length += 1;
            }
            if length > 0 && length % 2 == 0 {
                sign = -sign;
            }
        }
        sign
    }
}
