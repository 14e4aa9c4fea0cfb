//! Complementarity problems of a few unknowns on the stack: Gauss-Seidel sweeps, which are enough where few impulses
//! press on each other, then Lemke's path in a condensed tableau. What is degenerate is left to more careful ways.

use super::local::plus;
use super::operator::Matrix;
use crate::registers::in_fours;
use pulp::{Simd, WithSimd};

/// Most unknowns.
pub const LARGEST: usize = 8;
/// Sweeps before pivots: one costs less than one of them.
const SWEEPS: usize = 2;
/// Pivots below this share of their column, and ratios closer than this, are left to others.
const DOUBTFUL: f64 = 1e-10;

/// M by columns, q and the scale of q, for at most N unknowns.
struct Small<const N: usize> {
    n: usize,
    columns: [[f64; N]; N],
    q: [f64; N],
    size: f64,
}

/// z >= 0, w = M z + q >= 0, z.w = 0 to the tolerance, in terms of |q|; the name of what found z, which begins as zeros and
/// has room for the most unknowns, and its rounds. `None`, with anything in z, where neither does.
pub fn solved(m: &Matrix, q: &[f64], tolerance: f64, z: &mut [f64]) -> Option<(&'static str, usize)> {
    if q.iter().all(|q| *q >= 0.0) {
        return Some(("sweeps", 0));
    }
    if q.len() <= 4 {
        in_fours(Solved::<4, 8>(m, q, tolerance, z.first_chunk_mut()?))
    } else {
        in_fours(Solved::<8, 12>(m, q, tolerance, z.first_chunk_mut()?))
    }
}

/// The same for at most N unknowns; rows of the tableau have W >= N + 2 numbers.
struct Solved<'a, const N: usize, const W: usize>(&'a Matrix, &'a [f64], f64, &'a mut [f64; N]);

impl<const N: usize, const W: usize> WithSimd for Solved<'_, N, W> {
    type Output = Option<(&'static str, usize)>;
    #[inline(always)]
    fn with_simd<S: Simd>(self, _simd: S) -> Self::Output {
        let Solved(m, q, tolerance, z) = self;
        let small = Small::<N>::of(m, q);
        let fused = S::F64_LANES == 4;
        let swept =
            if fused { small.swept::<true>(tolerance, z) } else { small.swept::<false>(tolerance, z) };
        match swept {
            Some(rounds) => Some(("sweeps", rounds)),
            None => Some(("pivots", small.along_path::<W>(z)?)),
        }
    }
}

impl<const N: usize> Small<N> {
    #[inline(always)]
    fn of(matrix: &Matrix, velocity: &[f64]) -> Self {
        let n = velocity.len().min(N);
        let (mut columns, mut q) = ([[0.0; N]; N], [0.0; N]);
        q[..n].copy_from_slice(&velocity[..n]);
        let graph = &matrix.graph;
        let is_full = graph.neighbours.len() == n * n;
        for i in 0..n {
            if is_full {
                let row = &matrix.values[i * n..][..n];
                (0..n).for_each(|j| columns[j][i] = row[j]);
                continue;
            }
            let stored = graph.row(i);
            for (&j, &value) in graph.neighbours[stored.clone()].iter().zip(&matrix.values[stored]) {
                columns[j as usize][i] = value;
            }
        }
        let size = q.iter().map(|q| q * q).sum::<f64>().sqrt();
        Small { n, columns, q, size }
    }
    /// Sweeps from zero; how many were enough.
    #[inline(always)]
    fn swept<const FUSED: bool>(&self, tolerance: f64, z: &mut [f64; N]) -> Option<usize> {
        let n = self.n;
        if !(0..n).all(|i| self.columns[i][i] > 0.0) {
            return None;
        }
        let mut inverse = [0.0; N];
        (0..n).for_each(|i| inverse[i] = 1.0 / self.columns[i][i]);
        let mut w = self.q;
        for sweep in 1..=SWEEPS {
            for k in 0..n {
                // back and forth, so that the order of the unknowns does not matter
                let i = if sweep % 2 == 0 { k } else { n - 1 - k };
                let next = larger(0.0, plus::<FUSED>(-w[i], inverse[i], z[i]));
                let moved = next - z[i];
                z[i] = next;
                w.iter_mut().zip(&self.columns[i]).for_each(|(w, m)| *w = plus::<FUSED>(*m, moved, *w));
            }
            let mut squared = 0.0;
            for i in 0..n {
                let weight = z[i] * self.columns[i][i];
                let off = if w[i] < weight { w[i] } else { weight };
                squared += off * off;
            }
            let bound = 0.1 * tolerance * self.size;
            if squared <= bound * bound {
                return Some(sweep);
            }
        }
        None
    }
    /// Lemke's path: basic = rows . (other variables, 1), of which all are zero but the one that enters.
    /// Variables: w_i = i, z_i = N + i, the covering one 2 N; its column is N, that of 1 is N + 1.
    #[inline(always)]
    fn along_path<const W: usize>(&self, z: &mut [f64; N]) -> Option<usize> {
        let n = self.n;
        let mut rows = [[0.0; W]; N];
        // place of a variable that is not basic, by its number
        let mut place = [0_u8; 2 * LARGEST + 1];
        let (mut basic, mut other) = ([0_u8; N], [0_u8; W]);
        for i in 0..n {
            (0..N).for_each(|j| rows[i][j] = self.columns[j][i]);
            (rows[i][N], rows[i][N + 1]) = (COVER[i], self.q[i]);
            (basic[i], other[i], place[N + i]) = (i as u8, (N + i) as u8, i as u8);
        }
        (other[N], place[2 * N]) = (2 * N as u8, N as u8);
        let (mut leaving, mut least) = (0, f64::INFINITY);
        for i in 0..n {
            let need = self.q[i] * INVERSE_COVER[i];
            (leaving, least) = if need < least { (i, need) } else { (leaving, least) };
        }
        let (mut column, mut inverse) = (N, INVERSE_COVER[leaving]);
        for pivots in 1..=4 * n + 4 {
            exchange(&mut rows, n, (leaving, column), inverse);
            std::mem::swap(&mut basic[leaving], &mut other[column]);
            let left = other[column] as usize;
            place[left] = column as u8;
            if left == 2 * N {
                z.fill(0.0);
                for i in (0..n).filter(|&i| basic[i] as usize >= N) {
                    z[basic[i] as usize - N] = rows[i][N + 1];
                }
                return (0..n).all(|i| rows[i][N + 1] >= 0.0).then_some(pivots);
            }
            column = place[if left < N { left + N } else { left - N }] as usize;
            (leaving, inverse) = row_to_leave(&rows, n, &basic, column)?;
        }
        None
    }
}

/// A covering vector that ties no two rows of one kind: one plus fractional parts of multiples of the golden ratio.
const COVER: [f64; LARGEST] = [1.618, 1.236, 1.854, 1.472, 1.090, 1.708, 1.326, 1.944];
/// One over it.
const INVERSE_COVER: [f64; LARGEST] = {
    let mut inverse = [0.0; LARGEST];
    let mut i = 0;
    while i < LARGEST {
        inverse[i] = 1.0 / COVER[i];
        i += 1;
    }
    inverse
};

/// The larger of two numbers; `a` where b is none.
#[inline(always)]
fn larger(a: f64, b: f64) -> f64 {
    if b > a { b } else { a }
}

/// The basic variable of a row and the variable of a column change places, `inverse` being one over their number; columns that are not used hold zeros.
#[inline(always)]
fn exchange<const N: usize, const W: usize>(
    rows: &mut [[f64; W]; N],
    n: usize,
    (r, c): (usize, usize),
    inverse: f64,
) {
    // selected, not written: a number written alone is waited for by the register that is read over it
    let mut own = [0.0; W];
    for k in 0..W {
        own[k] = if k == c { inverse } else { -rows[r][k] * inverse };
    }
    for row in rows.iter_mut().take(n) {
        let factor = row[c];
        for k in 0..W {
            row[k] = if k == c { 0.0 } else { row[k] } + factor * own[k];
        }
    }
    rows[r] = own;
}

/// The row whose variable first falls to zero as the column's grows, and one over its number there; `None` for a ray, and where two do at once, but
/// for the covering variable: it may always leave, and then the problem is solved.
#[inline(always)]
fn row_to_leave<const N: usize, const W: usize>(
    rows: &[[f64; W]; N],
    n: usize,
    basic: &[u8; N],
    column: usize,
) -> Option<(usize, f64)> {
    let mut largest = 0.0;
    for row in rows.iter().take(n) {
        largest = larger(largest, row[column].abs());
    }
    let (mut first, mut least, mut second) = (N, f64::INFINITY, f64::INFINITY);
    let (mut cover, mut covering, mut inverses) = (N, f64::INFINITY, [0.0; N]);
    for (i, row) in rows.iter().enumerate().take(n) {
        let falls = row[column] < -DOUBTFUL * largest;
        inverses[i] = 1.0 / row[column];
        let ratio = if falls { -row[N + 1] * inverses[i] } else { f64::INFINITY };
        let is_cover = basic[i] as usize == 2 * N;
        (cover, covering) = if is_cover { (i, ratio) } else { (cover, covering) };
        let is_less = ratio < least;
        let next = if is_less { least } else { ratio };
        second = if next < second { next } else { second };
        (first, least) = if is_less { (i, ratio) } else { (first, least) };
    }
    if first == N {
        return None;
    }
    let close = DOUBTFUL * (least.abs() + 1.0 / largest);
    if covering - least <= close {
        return Some((cover, inverses[cover]));
    }
    if second - least <= close { None } else { Some((first, inverses[first])) }
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
        let mut z = [0.0; LARGEST];
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
        let (mut z, m) = ([0.0; LARGEST], matrix(&[&[0.0, -1.0], &[-1.0, 0.0]]));
        assert!(solved(&m, &[-1.0, -2.0], 1e-12, &mut z).is_none());
        let tied: &[&[f64]] = &[&[0.0, 1.0, 1.0], &[1.0, 0.0, 1.0], &[-1.0, -1.0, 0.0]];
        assert!(solved(&matrix(tied), &[0.0, 0.0, -1.0], 1e-12, &mut [0.0; LARGEST]).is_none());
    }
}
