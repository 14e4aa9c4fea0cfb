//! L with W = L L^T where only W is known: Cholesky's method, largest pivot first, ended where the pivots are rounding.
//! Dense, so for problems of some hundred contacts.

use super::operator::Matrix;
use super::system::Block;

/// A pivot below this share of the largest is rounding.
const ROUNDING: f64 = 1e-13;
/// Largest number of entries of L.
const LARGEST: usize = 10_000_000;

/// L, one row per row of W.
#[derive(Clone, Debug, Default)]
pub struct Root<const D: usize> {
    columns: usize,
    values: Vec<f64>,
}

impl<const D: usize> Root<D> {
    /// `None` where W is too large, or has no root.
    pub fn of(matrix: &Matrix) -> Option<Self> {
        let n = D * matrix.graph.nodes();
        let mut left = dense::<D>(matrix)?;
        let largest = (0..n).map(|i| left[i * n + i]).fold(0.0, f64::max);
        let mut columns: Vec<Vec<f64>> = Vec::new();
        while columns.len() < n {
            let pivot = (0..n).max_by(|&a, &b| left[a * n + a].total_cmp(&left[b * n + b]))?;
            let size = left[pivot * n + pivot];
            if !(size > ROUNDING * largest) {
                break;
            }
            let column: Vec<f64> = (0..n).map(|i| left[i * n + pivot] / size.sqrt()).collect();
            for (row, c) in left.chunks_exact_mut(n).zip(&column).filter(|(_, c)| **c != 0.0) {
                row.iter_mut().zip(&column).for_each(|(w, d)| *w -= c * d);
            }
            columns.push(column);
        }
        let values = (0..n).flat_map(|i| columns.iter().map(move |c| c[i])).collect();
        let is_root = left.iter().all(|w| w.abs() <= 1e2 * ROUNDING * largest);
        is_root.then_some(Root { columns: columns.len(), values })
    }

    /// out = L (delta + L^T C L)^-1 L^T x with C per contact; false where the numbers end.
    pub fn carry(&self, c: &[Block<D>], delta: f64, x: &[[f64; D]], out: &mut [[f64; D]]) -> bool {
        let k = self.columns;
        let mut system = vec![0.0; k * k];
        (0..k).for_each(|i| system[i * k + i] = delta);
        let mut change = vec![0.0; k];
        for (i, rows) in self.values.chunks_exact(D * k).enumerate() {
            let line = |r: usize| &rows[r * k..(r + 1) * k];
            for r in 0..D {
                change.iter_mut().zip(line(r)).for_each(|(v, l)| *v += l * x[i][r]);
                let mixed: Vec<f64> =
                    (0..k).map(|j| (0..D).map(|s| c[i][r][s] * rows[s * k + j]).sum()).collect();
                for (row, l) in system.chunks_exact_mut(k).zip(line(r)).filter(|(_, l)| **l != 0.0) {
                    row.iter_mut().zip(&mixed).for_each(|(a, m)| *a += l * m);
                }
            }
        }
        let solved = solve_definite(&mut system, &mut change);
        for (rows, out) in self.values.chunks_exact(D * k).zip(out) {
            *out = std::array::from_fn(|r| {
                rows[r * k..(r + 1) * k].iter().zip(&change).map(|(l, v)| l * v).sum()
            });
        }
        solved
    }
}

/// W row by row; `None` where it is too large.
fn dense<const D: usize>(matrix: &Matrix) -> Option<Vec<f64>> {
    let graph = &matrix.graph;
    let n = D * graph.nodes();
    let mut whole = vec![0.0; n.checked_mul(n).filter(|size| *size <= LARGEST)?];
    for i in 0..graph.nodes() {
        for at in graph.row(i) {
            let (j, at) = (graph.neighbours[at] as usize, graph.offsets[at] as usize);
            for r in 0..D {
                let row = (D * i + r) * n + D * j;
                whole[row..row + D].copy_from_slice(&matrix.values[at + r * D..][..D]);
            }
        }
    }
    Some(whole)
}

/// Replaces b by A^-1 b, A symmetric and positive definite, by Cholesky's method; false where it is not definite.
fn solve_definite(a: &mut [f64], b: &mut [f64]) -> bool {
    let k = b.len();
    let dot = |x: &[f64], y: &[f64]| x.iter().zip(y).map(|(x, y)| x * y).sum::<f64>();
    for i in 0..k {
        let (above, own) = a.split_at_mut(i * k);
        for j in 0..i {
            let row = &above[j * k..(j + 1) * k];
            own[j] = (own[j] - dot(&own[..j], &row[..j])) / row[j];
        }
        let pivot = own[i] - dot(&own[..i], &own[..i]);
        if !(pivot > 0.0) {
            return false;
        }
        own[i] = pivot.sqrt();
        b[i] = (b[i] - dot(&own[..i], &b[..i])) / own[i];
    }
    for i in (0..k).rev() {
        let below: f64 = (i + 1..k).map(|j| a[j * k + i] * b[j]).sum();
        b[i] = (b[i] - below) / a[i * k + i];
    }
    true
}
