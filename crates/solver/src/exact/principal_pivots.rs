//! Small complementarity problems by block principal pivoting (Judice and Pires 1994): guess which impulses are
//! positive, solve for them, and let every impulse and velocity of the wrong sign change sides; once that no longer
//! lowers their number, only the last of them (Murty 1974), which ends for every P-matrix. Who changes sides is exchanged
//! in a tableau, one after another: principal minors of a P-matrix are positive, so no pivot is zero.

use super::operator::Matrix;
use crate::friction_problem::larger;
use crate::registers::in_fours;
use pulp::{Simd, WithSimd};

/// Larger problems are left to the other stages.
pub const LARGEST: usize = 48;
/// Rounds that may pass before only one impulse changes sides.
const PATIENCE: usize = 3;

/// Pivots below this share of the largest entry are rounding.
const SINGULAR: f64 = 1e-13;

/// Registers of the longest row.
const ROW: usize = (LARGEST + FOUR) / FOUR;

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

/// A register of numbers, where memory has it in one piece.
#[derive(Clone, Copy, Default)]
#[repr(C, align(32))]
struct Four([f64; FOUR]);
/// z >= 0, w = M z + q >= 0, z.w = 0 for z (at most `LARGEST`), starting from the signs of `z`, and the rounds spent;
/// `None`, z as it was, when a pivot is as good as zero or the rounds are spent.
pub fn pivoted(m: &Matrix, q: &[f64], z: &mut [f64]) -> Option<usize> {
    in_fours(Pivoted(m, q, z))
}

struct Pivoted<'a>(&'a Matrix, &'a [f64], &'a mut [f64]);

impl WithSimd for Pivoted<'_> {
    type Output = Option<usize>;
    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> Option<usize> {
        let Pivoted(m, q, z) = self;
        let n = q.len();
        let mut tableau = Tableau::of(m, q);
        let mut change = Set::of(n, |i| z[i] > 0.0 || q[i] < 0.0);
        let (mut fewest, mut patience) = (n + 1, PATIENCE);
        for round in 1..=4 * n + 10 {
            tableau.exchange_all(simd, change)?;
            let wrong = Set::of(n, |i| tableau.value(i) < 0.0);
            let Some(last) = wrong.last() else {
                tableau.impulses(simd, (m, q), z);
                return Some(round);
            };
            if wrong.len() < fewest {
                (fewest, patience) = (wrong.len(), PATIENCE);
            } else {
                patience = patience.saturating_sub(1);
            }
            change = if patience > 0 { wrong } else { Set(1 << last) };
        }
        None
    }
}

/// Row i says what z_i is, of positive impulses, or w_i, of others, by the other one of all pairs and by 1.
struct Tableau {
    positive: Set,
    /// Rows, and of a row numbers in fours; the last number is that of 1.
    n: usize,
    fours: usize,
    values: Vec<Four>,
    /// The largest entry of M.
    largest: f64,
}

impl Tableau {
    /// w = M z + q.
    #[inline(always)]
    fn of(m: &Matrix, q: &[f64]) -> Self {
        let n = q.len();
        let fours = (n + 1).div_ceil(FOUR);
        let mut values = vec![Four::default(); n * fours];
        let mut largest = [0.0_f64; FOUR];
        for (i, row) in values.chunks_exact_mut(fours).enumerate() {
            let (others, given) = m.row(i);
            let (whole, rest) = given.as_chunks::<FOUR>();
            if given.len() == n {
                row.iter_mut().zip(whole).for_each(|(four, given)| four.0 = *given);
                rest.iter().enumerate().for_each(|(k, x)| row[whole.len()].0[k] = *x);
            } else {
                others.iter().zip(given).for_each(|(&j, x)| row[j as usize / FOUR].0[j as usize % FOUR] = *x);
            }
            for four in &*row {
                (0..FOUR).for_each(|k| largest[k] = larger(largest[k], four.0[k].abs()));
            }
            row[fours - 1].0[FOUR - 1] = q[i];
        }
        let largest = largest.into_iter().fold(0.0, larger);
        Tableau { positive: Set(0), n, fours, values, largest }
    }
    #[inline(always)]
    fn row(&self, i: usize) -> &[Four] {
        &self.values[i * self.fours..][..self.fours]
    }
    #[inline(always)]
    fn value(&self, i: usize) -> f64 {
        self.row(i)[self.fours - 1].0[FOUR - 1]
    }

    /// These change sides; `None` where a pivot is as good as zero.
    #[inline(always)]
    fn exchange_all<S: Simd>(&mut self, simd: S, mut change: Set) -> Option<()> {
        self.positive.0 ^= change.0;
        while change.0 != 0 {
            self.exchange(simd, change.0.trailing_zeros() as usize)?;
            change.0 &= change.0 - 1;
        }
        Some(())
    }

    /// z_p and w_p change places.
    #[inline(always)]
    fn exchange<S: Simd>(&mut self, simd: S, p: usize) -> Option<()> {
        let (fours, at, lane) = (self.fours, p / FOUR, p % FOUR);
        let mut own = [Four::default(); ROW];
        let own = &mut own[..fours];
        own.copy_from_slice(self.row(p));
        let pivot = own[at].0[lane];
        // an impulse that leaves has one over what is left of its diagonal
        let left = if self.positive.has(p) { pivot.abs() } else { 1.0 / pivot.abs() };
        if !(left > SINGULAR * self.largest) {
            return None;
        }
        let inverse = 1.0 / pivot;
        own.iter_mut().for_each(|four| four.0.iter_mut().for_each(|x| *x *= -inverse));
        for row in self.values.chunks_exact_mut(fours) {
            let factor = row[at].0[lane];
            add(simd, factor, own, row);
            // after the others of its register, which would wait for it
            row[at].0[lane] = factor * inverse;
        }
        own[at].0[lane] = inverse;
        self.values[p * fours..][..fours].copy_from_slice(own);
        Some(())
    }

    /// Writes the impulses, with one correction for what exchanges have rounded.
    #[inline(always)]
    fn impulses<S: Simd>(&self, simd: S, (m, q): (&Matrix, &[f64]), z: &mut [f64]) {
        let mut off = [Four::default(); ROW];
        let off = &mut off[..self.fours];
        (0..self.n).for_each(|i| z[i] = if self.positive.has(i) { self.value(i) } else { 0.0 });
        for i in (0..self.n).filter(|&i| self.positive.has(i)) {
            let (others, given) = m.row(i);
            let pressed: f64 = others.iter().zip(given).map(|(&j, m)| m * z[j as usize]).sum();
            off[i / FOUR].0[i % FOUR] = pressed + q[i];
        }
        for i in (0..self.n).filter(|&i| self.positive.has(i)) {
            // w_i shall be lower by what it is too large: the tableau says how the impulses follow
            z[i] = (z[i] - dot(simd, self.row(i), off)).max(0.0);
        }
    }
}

/// x += factor y.
#[inline(always)]
fn add<S: Simd>(simd: S, factor: f64, y: &[Four], x: &mut [Four]) {
    let by = simd.splat_f64s(factor);
    for (x, y) in x.iter_mut().zip(y) {
        if S::F64_LANES == FOUR {
            let x = &mut S::as_mut_simd_f64s(&mut x.0).0[0];
            *x = simd.mul_add_f64s(by, S::as_simd_f64s(&y.0).0[0], *x);
        } else {
            (0..FOUR).for_each(|l| x.0[l] += factor * y.0[l]);
        }
    }
}

/// The sum of products.
#[inline(always)]
fn dot<S: Simd>(simd: S, a: &[Four], b: &[Four]) -> f64 {
    let mut sum = [0.0; FOUR];
    for (a, b) in a.iter().zip(b) {
        if S::F64_LANES == FOUR {
            let sum = &mut S::as_mut_simd_f64s(&mut sum).0[0];
            *sum = simd.mul_add_f64s(S::as_simd_f64s(&a.0).0[0], S::as_simd_f64s(&b.0).0[0], *sum);
        } else {
            (0..FOUR).for_each(|k| sum[k] += a.0[k] * b.0[k]);
        }
    }
    (sum[0] + sum[1]) + (sum[2] + sum[3])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::delassus::Csr;
    use crate::delassus_blocks::Delassus;

    fn solved(dense: &[&[f64]], q: &[f64], z: &mut [f64], rounding: f64) -> Option<usize> {
        let rows = dense.iter().map(|r| r.iter().copied().enumerate().collect());
        let m: Delassus = Csr::from_rows(dense.len(), rows.collect::<Vec<_>>().into_iter()).into();
        let rounds = pivoted(&m.made(1).matrix, q, z)?;
        for (i, row) in dense.iter().enumerate() {
            let w = row.iter().zip(&*z).map(|(m, z)| m * z).sum::<f64>() + q[i];
            assert!(z[i] >= 0.0 && w >= -rounding && (z[i] * w).abs() < rounding, "{z:?}");
        }
        Some(rounds)
    }

    #[test]
    fn every_sign_changes_sides_until_none_is_wrong() {
        let m: &[&[f64]] = &[&[2.0, 1.0, 0.0], &[1.0, 2.0, 1.0], &[0.0, 1.0, 2.0]];
        solved(m, &[-4.0, 1.0, -3.0], &mut [0.0; 3], 1e-15).expect("a P-matrix");
    }

    #[test]
    fn a_cycle_of_blocks_ends_with_single_pivots() {
        // Murty's cyclic P-matrix: changing all sides at once goes round for ever
        let m: &[&[f64]] = &[&[1.0, 2.0, 0.0], &[0.0, 1.0, 2.0], &[2.0, 0.0, 1.0]];
        let mut z = [1.0, 0.0, 0.0];
        solved(m, &[-1.0, -1.0, -1.0], &mut z, 1e-14).expect("a P-matrix");
        z.iter().for_each(|z| assert!((z - 1.0 / 3.0).abs() < 1e-15, "{z}"));
    }

    #[test]
    fn who_joins_and_who_leaves_between_others_is_solved_for() {
        // dominant diagonals, of any sign beside them, and pushes in waves: some join late, some leave
        let at =
            |i: usize, j: usize| if i == j { 14.0 } else { (1.3 * i as f64 + 2.9 * (j * j) as f64).sin() };
        for n in [2, 5, 11, 26, 47] {
            let rows: Vec<Vec<f64>> = (0..n).map(|i| (0..n).map(|j| at(i, j)).collect()).collect();
            let rows: Vec<&[f64]> = rows.iter().map(|r| r.as_slice()).collect();
            for push in 0..20 {
                let q: Vec<f64> =
                    (0..n).map(|i| ((0.7 + 0.1 * push as f64) * i as f64).cos() + 0.2).collect();
                let mut z: Vec<f64> = (0..n).map(|i| f64::from(i as u8 % 3 == push % 3)).collect();
                solved(&rows, &q, &mut z, 1e-14).expect("diagonals dominate");
            }
        }
    }

    #[test]
    fn redundant_rows_are_left_to_others() {
        assert!(solved(&[&[1.0, 1.0], &[1.0, 1.0]], &[-1.0, -1.0], &mut [0.0; 2], 1e-14).is_none());
    }
}
