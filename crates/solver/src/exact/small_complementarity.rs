//! Complementarity problems of a few unknowns on the stack: Gauss-Seidel sweeps, which are enough where few impulses
//! press on each other, then Lemke's path in a condensed tableau. What is degenerate is left to more careful ways.

use super::operator::Matrix;

/// Most unknowns.
pub const LARGEST: usize = 8;
/// Sweeps before pivots: one costs less than one of them.
const SWEEPS: usize = 2;
/// Pivots below this share of their column, and ratios closer than this, are left to others.
const DOUBTFUL: f64 = 1e-10;

/// M by columns, q and the scale of q.
struct Small {
    n: usize,
    columns: [[f64; LARGEST]; LARGEST],
    q: [f64; LARGEST],
    size: f64,
}

/// z >= 0, w = M z + q >= 0, z.w = 0 to the tolerance, in terms of |q|; the name of what found z and its rounds.
/// `None`, z as it was, where neither does.
pub fn solved(m: &Matrix, q: &[f64], tolerance: f64, z: &mut [f64]) -> Option<(&'static str, usize)> {
    if q.iter().all(|q| *q >= 0.0) {
        z.fill(0.0);
        return Some(("sweeps", 0));
    }
    let small = Small::of(m, q);
    let mut found = [0.0; LARGEST];
    let ended = match small.swept(tolerance, &mut found) {
        Some(rounds) => ("sweeps", rounds),
        None => ("pivots", small.along_path(&mut found)?),
    };
    z.copy_from_slice(&found[..small.n]);
    Some(ended)
}

impl Small {
    fn of(matrix: &Matrix, velocity: &[f64]) -> Self {
        let n = velocity.len();
        let (mut columns, mut q) = ([[0.0; LARGEST]; LARGEST], [0.0; LARGEST]);
        q[..n].copy_from_slice(velocity);
        let graph = &matrix.graph;
        for i in 0..n {
            let stored = graph.row(i);
            for (&j, &value) in graph.neighbours[stored.clone()].iter().zip(&matrix.values[stored]) {
                columns[j as usize][i] = value;
            }
        }
        let size = q.iter().map(|q| q * q).sum::<f64>().sqrt();
        Small { n, columns, q, size }
    }
    /// Sweeps from zero; how many were enough.
    fn swept(&self, tolerance: f64, z: &mut [f64; LARGEST]) -> Option<usize> {
        let n = self.n;
        if !(0..n).all(|i| self.columns[i][i] > 0.0) {
            return None;
        }
        let mut w = self.q;
        for sweep in 1..=SWEEPS {
            for k in 0..n {
                // back and forth, so that the order of the unknowns does not matter
                let i = if sweep % 2 == 0 { k } else { n - 1 - k };
                let column = &self.columns[i];
                let next = (z[i] - w[i] / column[i]).max(0.0);
                let moved = next - z[i];
                z[i] = next;
                w.iter_mut().zip(column).for_each(|(w, m)| *w += m * moved);
            }
            let off = |i: usize| w[i].min(z[i] * self.columns[i][i]);
            let squared: f64 = (0..n).map(|i| off(i) * off(i)).sum();
            if squared <= (0.1 * tolerance * self.size).powi(2) {
                return Some(sweep);
            }
        }
        None
    }
    /// Lemke's path: basic = right + rows . (other variables), of which all are zero but the one that enters.
    /// Variables: w_i = i, z_i = n + i, the covering one 2 n; its column is the last.
    fn along_path(&self, z: &mut [f64; LARGEST]) -> Option<usize> {
        let n = self.n;
        let (mut rows, mut right) = ([[0.0; LARGEST + 1]; LARGEST], self.q);
        let (mut basic, mut other) = ([0; LARGEST], [0; LARGEST + 1]);
        for i in 0..n {
            (0..n).for_each(|j| rows[i][j] = self.columns[j][i]);
            rows[i][n] = COVER[i];
            (basic[i], other[i]) = (i, n + i);
        }
        other[n] = 2 * n;
        let need = |i: usize| self.q[i] / COVER[i];
        let mut leaving = (0..n).min_by(|&a, &b| need(a).total_cmp(&need(b)))?;
        let mut column = n;
        for pivots in 1..=4 * n + 4 {
            exchange(&mut rows[..n], &mut right, (leaving, column));
            std::mem::swap(&mut basic[leaving], &mut other[column]);
            let left = other[column];
            if left == 2 * n {
                z.fill(0.0);
                (0..n).filter(|&i| basic[i] >= n).for_each(|i| z[basic[i] - n] = right[i]);
                return right[..n].iter().all(|x| *x >= 0.0).then_some(pivots);
            }
            let entering = if left < n { left + n } else { left - n };
            column = other[..=n].iter().position(|&v| v == entering)?;
            leaving = row_to_leave(&rows[..n], &right, &basic, column)?;
        }
        None
    }
}

/// A covering vector that ties no two rows of one kind: one plus fractional parts of multiples of the golden ratio.
const COVER: [f64; LARGEST] = [1.618, 1.236, 1.854, 1.472, 1.090, 1.708, 1.326, 1.944];

/// The basic variable of a row and the variable of a column change places; columns that are not used hold zeros.
#[inline(always)]
fn exchange(rows: &mut [[f64; LARGEST + 1]], right: &mut [f64; LARGEST], (r, c): (usize, usize)) {
    let inverse = 1.0 / rows[r][c];
    let mut own = rows[r].map(|x| -x * inverse);
    own[c] = inverse;
    let value = -right[r] * inverse;
    for (row, right) in rows.iter_mut().zip(right.iter_mut()) {
        let factor = std::mem::take(&mut row[c]);
        for k in 0..=LARGEST {
            row[k] += factor * own[k];
        }
        *right += factor * value;
    }
    (rows[r], right[r]) = (own, value);
}

/// The row whose variable first falls to zero as the column's grows; `None` for a ray, and where two do at once, but
/// for the covering variable: it may always leave, and then the problem is solved.
#[inline(always)]
fn row_to_leave(
    rows: &[[f64; LARGEST + 1]],
    right: &[f64; LARGEST],
    basic: &[usize; LARGEST],
    column: usize,
) -> Option<usize> {
    let mut largest = 0.0_f64;
    for row in rows {
        largest = largest.max(row[column].abs());
    }
    let (mut first, mut least, mut second) = (None, f64::INFINITY, f64::INFINITY);
    let mut covering = f64::INFINITY;
    for (i, row) in rows.iter().enumerate() {
        if row[column] < -DOUBTFUL * largest {
            let ratio = -right[i] / row[column];
            if basic[i] == 2 * rows.len() {
                covering = ratio;
            }
            if ratio < least {
                (first, least, second) = (Some(i), ratio, least);
            } else if ratio < second {
                second = ratio;
            }
        }
    }
    let close = DOUBTFUL * (least.abs() + 1.0 / largest);
    if covering - least <= close {
        return (0..rows.len()).find(|&i| basic[i] == 2 * rows.len());
    }
    if second - least <= close { None } else { first }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::linear::Graph;

    fn matrix(dense: &[&[f64]]) -> Matrix {
        let n = dense.len() as u32;
        let starts = (0..=n).map(|i| i * n).collect();
        let neighbours = (0..n * n).map(|k| k % n).collect();
        let graph = Graph::new(vec![1; n as usize], starts, neighbours);
        Matrix::new(graph, dense.concat())
    }

    fn check(dense: &[&[f64]], q: &[f64], how: &str) {
        let mut z = vec![0.0; q.len()];
        let (name, _) = solved(&matrix(dense), q, 1e-12, &mut z).expect("it is solved");
        assert_eq!(name, how);
        for (i, row) in dense.iter().enumerate() {
            let w = row.iter().zip(&z).map(|(m, z)| m * z).sum::<f64>() + q[i];
            assert!(z[i] >= 0.0 && w >= -1e-12 && (z[i] * w).abs() < 1e-12, "{z:?}");
        }
    }

    #[test]
    fn what_presses_on_later_ones_alone_is_swept() {
        check(&[&[1.0, 0.0, 0.0], &[2.0, 1.0, 0.0], &[2.0, 2.0, 1.0]], &[-1.0, -3.0, -7.0], "sweeps");
    }

    #[test]
    fn what_presses_around_is_pivoted() {
        // Murty's cyclic P-matrix
        check(&[&[1.0, 2.0, 0.0], &[0.0, 1.0, 2.0], &[2.0, 0.0, 1.0]], &[-1.0, -1.0, -1.0], "pivots");
        // nothing is asked for
        check(&[&[0.0, 3.0], &[1.0, 0.0]], &[1.0, 0.0], "sweeps");
        // semidefinite with a zero on its diagonal (Cottle, Pang and Stone 2009)
        let m: &[&[f64]] = &[
            &[11.0, 0.0, 10.0, -1.0],
            &[0.0, 11.0, 10.0, -1.0],
            &[10.0, 10.0, 21.0, -1.0],
            &[1.0, 1.0, 1.0, 0.0],
        ];
        check(m, &[50.0, 50.0, 10.0, -6.0], "pivots");
    }

    #[test]
    fn rays_and_ties_are_left_to_others() {
        let mut z = [7.0; 3];
        assert!(solved(&matrix(&[&[0.0, -1.0], &[-1.0, 0.0]]), &[-1.0, -2.0], 1e-12, &mut z[..2]).is_none());
        let tied: &[&[f64]] = &[&[0.0, 1.0, 1.0], &[1.0, 0.0, 1.0], &[-1.0, -1.0, 0.0]];
        assert!(solved(&matrix(tied), &[0.0, 0.0, -1.0], 1e-12, &mut z).is_none());
        assert_eq!(z, [7.0; 3]);
    }
}
