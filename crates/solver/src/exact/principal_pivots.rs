//! Small complementarity problems by block principal pivoting (Judice and Pires 1994): guess which impulses are
//! positive, solve for them, and let every impulse and velocity of the wrong sign change sides; once that no longer
//! lowers their number, only the last of them (Murty 1974), which ends for every P-matrix.

use crate::delassus::Csr;
use crate::registers::in_fours;
use pulp::{Simd, WithSimd};

/// Larger problems are left to the other stages.
pub const LARGEST: usize = 48;
/// Rounds that may pass before only one impulse changes sides.
const PATIENCE: usize = 3;

/// Pivots below this share of the largest entry are rounding.
const SINGULAR: f64 = 1e-13;

/// A set of unknowns.
#[derive(Clone, Copy, PartialEq)]
struct Set(u64);

impl Set {
    fn of(n: usize, has: impl Fn(usize) -> bool) -> Self {
        Set((0..n).filter(|&i| has(i)).fold(0, |set, i| set | 1 << i))
    }
    fn has(self, i: usize) -> bool {
        self.0 >> i & 1 == 1
    }
    fn len(self) -> usize {
        self.0.count_ones() as usize
    }
    fn last(self) -> Option<usize> {
        (self.0 != 0).then(|| self.0.ilog2() as usize)
    }
}

/// Rows of matrices are padded to so many numbers: a register of them.
const FOUR: usize = 4;

/// z >= 0, w = M z + q >= 0, z.w = 0 for z (at most `LARGEST`), starting from the signs of `z`, and the rounds spent;
/// `None`, z as it was, when a system is singular or the rounds are spent.
pub fn pivoted(m: &Csr, q: &[f64], z: &mut [f64]) -> Option<usize> {
    in_fours(Pivoted(m, q, z))
}

struct Pivoted<'a>(&'a Csr, &'a [f64], &'a mut [f64]);

impl WithSimd for Pivoted<'_> {
    type Output = Option<usize>;
    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> Option<usize> {
        let Pivoted(m, q, z) = self;
        let n = q.len();
        let dense = Dense::of(m);
        // one memory for all rounds
        let mut system = vec![[0.0; FOUR]; n * (n + 1).div_ceil(FOUR)];
        let mut found = [0.0; LARGEST];
        let mut positive = Set::of(n, |i| z[i] > 0.0 || q[i] < 0.0);
        let (mut fewest, mut patience) = (n + 1, PATIENCE);
        for round in 1..=4 * n + 10 {
            solved(simd, (&dense, q), positive, &mut found, &mut system)?;
            let wrong = Set::of(n, |i| {
                if positive.has(i) { found[i] < 0.0 } else { dense.times(i, &found) + q[i] < 0.0 }
            });
            let Some(last) = wrong.last() else {
                z.copy_from_slice(&found[..n]);
                return Some(round);
            };
            if wrong.len() < fewest {
                (fewest, patience) = (wrong.len(), PATIENCE);
            } else {
                patience = patience.saturating_sub(1);
            }
            positive.0 ^= if patience > 0 { wrong.0 } else { 1 << last };
        }
        None
    }
}

/// M with all its zeros.
struct Dense {
    fours: usize,
    values: Vec<[f64; FOUR]>,
}

impl Dense {
    #[inline(always)]
    fn of(m: &Csr) -> Self {
        let n = m.shape.0;
        let fours = n.div_ceil(FOUR);
        let mut values = vec![[0.0; FOUR]; n * fours];
        for i in 0..n {
            let row = values[i * fours..][..fours].as_flattened_mut();
            m.row(i).for_each(|(j, a)| row[j] += a);
        }
        Dense { fours, values }
    }
    #[inline(always)]
    fn row(&self, i: usize) -> &[[f64; FOUR]] {
        &self.values[i * self.fours..][..self.fours]
    }
    /// Row i times z.
    #[inline(always)]
    fn times(&self, i: usize, z: &[f64; LARGEST]) -> f64 {
        let (z, _) = z.as_chunks::<FOUR>();
        let mut sum = [0.0; FOUR];
        for (a, z) in self.row(i).iter().zip(z) {
            for k in 0..FOUR {
                sum[k] += a[k] * z[k];
            }
        }
        (sum[0] + sum[1]) + (sum[2] + sum[3])
    }
}

/// M_pp z_p = -q_p by elimination with the largest pivots, the other z zero.
#[inline(always)]
fn solved<S: Simd>(
    simd: S,
    (m, q): (&Dense, &[f64]),
    positive: Set,
    z: &mut [f64; LARGEST],
    system: &mut [[f64; FOUR]],
) -> Option<()> {
    let mut members = [0; LARGEST];
    let mut size = 0;
    for i in (0..q.len()).filter(|&i| positive.has(i)) {
        members[size] = i;
        size += 1;
    }
    let (members, fours) = (&members[..size], (size + 1).div_ceil(FOUR));
    let system = &mut system[..size * fours];
    for (row, &i) in system.chunks_exact_mut(fours).zip(members) {
        let (row, from) = (row.as_flattened_mut(), m.row(i).as_flattened());
        row[size..].fill(0.0);
        row.iter_mut().zip(members).for_each(|(x, &j)| *x = from[j]);
        row[size] = -q[i];
    }
    eliminated(simd, system, size, fours)?;
    let mut found = [0.0; LARGEST];
    z.fill(0.0);
    for (k, &i) in members.iter().enumerate().rev() {
        let row = system[k * fours..][..fours].as_flattened();
        let known: f64 = row[k + 1..size].iter().zip(&found[k + 1..size]).map(|(a, z)| a * z).sum();
        found[k] = (row[size] - known) / row[k];
        z[i] = found[k];
    }
    Some(())
}

/// Brings the rows of a system with its right-hand side to a triangle, what lies left of it being anything; `None` when
/// it is singular.
#[inline(always)]
fn eliminated<S: Simd>(simd: S, system: &mut [[f64; FOUR]], size: usize, fours: usize) -> Option<()> {
    let largest = system.as_flattened().iter().fold(0.0_f64, |m, a| m.max(a.abs()));
    for k in 0..size {
        let (mut pivot, mut top) = (k, -1.0);
        for r in k..size {
            let entry = system[r * fours + k / FOUR][k % FOUR].abs();
            (pivot, top) = if entry > top { (r, entry) } else { (pivot, top) };
        }
        if !(top > SINGULAR * largest) {
            return None;
        }
        let first = k / FOUR;
        if pivot != k {
            (first..fours).for_each(|c| system.swap(k * fours + c, pivot * fours + c));
        }
        let (above, below) = system.split_at_mut((k + 1) * fours);
        let row = &above[k * fours + first..];
        let inverse = 1.0 / row[0][k % FOUR];
        for other in below.chunks_exact_mut(fours) {
            let factor = other[first][k % FOUR] * inverse;
            if factor == 0.0 {
                continue;
            }
            let by = simd.splat_f64s(-factor);
            for (x, y) in other[first..].iter_mut().zip(row) {
                if S::F64_LANES == FOUR {
                    let x = &mut S::as_mut_simd_f64s(x).0[0];
                    *x = simd.mul_add_f64s(by, S::as_simd_f64s(y).0[0], *x);
                } else {
                    (0..FOUR).for_each(|l| x[l] -= factor * y[l]);
                }
            }
        }
    }
    Some(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn compressed(dense: &[&[f64]]) -> Csr {
        let rows = dense.iter().map(|r| r.iter().copied().enumerate().collect());
        Csr::from_rows(dense.len(), rows.collect::<Vec<_>>().into_iter())
    }

    #[test]
    fn every_sign_changes_sides_until_none_is_wrong() {
        let m = compressed(&[&[2.0, 1.0, 0.0], &[1.0, 2.0, 1.0], &[0.0, 1.0, 2.0]]);
        let q = [-4.0, 1.0, -3.0];
        let mut z = [0.0; 3];
        pivoted(&m, &q, &mut z).expect("a P-matrix");
        for i in 0..3 {
            let w = m.times(&z)[i] + q[i];
            assert!(z[i] >= 0.0 && w >= -1e-15 && (z[i] * w).abs() < 1e-15, "{z:?}");
        }
    }

    #[test]
    fn a_cycle_of_blocks_ends_with_single_pivots() {
        // Murty's cyclic P-matrix: changing all sides at once goes round for ever
        let m = compressed(&[&[1.0, 2.0, 0.0], &[0.0, 1.0, 2.0], &[2.0, 0.0, 1.0]]);
        let q = [-1.0, -1.0, -1.0];
        let mut z = [1.0, 0.0, 0.0];
        pivoted(&m, &q, &mut z).expect("a P-matrix");
        z.iter().for_each(|z| assert!((z - 1.0 / 3.0).abs() < 1e-15, "{z}"));
    }

    #[test]
    fn redundant_rows_are_left_to_others() {
        let m = compressed(&[&[1.0, 1.0], &[1.0, 1.0]]);
        assert!(pivoted(&m, &[-1.0, -1.0], &mut [0.0; 2]).is_none());
    }
}
