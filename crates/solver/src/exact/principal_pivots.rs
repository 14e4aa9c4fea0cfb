//! Small complementarity problems by block principal pivoting (Judice and Pires 1994): guess which impulses are
//! positive, solve for them, and let every impulse and velocity of the wrong sign change sides; once that no longer
//! lowers their number, only the last of them (Murty 1974), which ends for every P-matrix. Who changes sides is exchanged
//! in a tableau, one after another and by twos: principal minors of a P-matrix are positive, so no pivot is zero.

use super::couplings;
use super::local;
use super::operator::Matrix;
use crate::friction_problem::larger;
use crate::registers::in_fours;
use pulp::{Simd, WithSimd};
use std::ops::Range;

/// Larger problems are left to the other stages.
pub const LARGEST: usize = 48;
/// Rounds that may pass before only one impulse changes sides.
const PATIENCE: usize = 3;

/// Pivots below this share of the largest entry are rounding.
const SINGULAR: f64 = 1e-13;

/// Exchanges that go over the tableau together, where there are as many: three need more registers than there are.
const TOGETHER: usize = 2;

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
    /// Takes the first one out.
    fn pop(&mut self) -> usize {
        let first = self.0.trailing_zeros() as usize;
        self.0 &= self.0 - 1;
        first
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
    // the loops over rows of a length that is known beforehand are unrolled
    match q.len() {
        ..=15 => in_fours(Pivoted::<4>(m, q, z)),
        16..=27 => in_fours(Pivoted::<7>(m, q, z)),
        _ => in_fours(Pivoted::<{ (LARGEST + FOUR) / FOUR }>(m, q, z)),
    }
}

/// The same with rows of so many registers, of which the last number is that of 1.
struct Pivoted<'a, const ROW: usize>(&'a Matrix, &'a [f64], &'a mut [f64]);

impl<const ROW: usize> WithSimd for Pivoted<'_, ROW> {
    type Output = Option<usize>;
    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> Option<usize> {
        let Pivoted(m, q, z) = self;
        let n = q.len();
        let mut tableau = Tableau::<ROW>::of(m, q);
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
struct Tableau<const ROW: usize> {
    positive: Set,
    rows: Vec<[Four; ROW]>,
    /// The largest entry of M.
    largest: f64,
}

impl<const ROW: usize> Tableau<ROW> {
    /// w = M z + q.
    #[inline(always)]
    fn of(m: &Matrix, q: &[f64]) -> Self {
        let n = q.len();
        let mut largest = [0.0_f64; FOUR];
        let mut rows = Vec::with_capacity(n);
        for (i, q) in q.iter().enumerate() {
            let mut row = [Four::default(); ROW];
            let (others, given) = m.row(i);
            let (whole, rest) = given.as_chunks::<FOUR>();
            if given.len() == n {
                row.iter_mut().zip(whole).for_each(|(four, given)| four.0 = *given);
                rest.iter().enumerate().for_each(|(k, x)| row[whole.len()].0[k] = *x);
            } else {
                others.iter().zip(given).for_each(|(&j, x)| *entry(&mut row, j as usize) = *x);
            }
            for four in &row {
                (0..FOUR).for_each(|k| largest[k] = larger(largest[k], four.0[k].abs()));
            }
            row[ROW - 1].0[FOUR - 1] = *q;
            rows.push(row);
        }
        Tableau { positive: Set(0), rows, largest: largest.into_iter().fold(0.0, larger) }
    }
    #[inline(always)]
    fn value(&self, i: usize) -> f64 {
        self.rows[i][ROW - 1].0[FOUR - 1]
    }

    /// These change sides; `None` where a pivot is as good as zero.
    #[inline(always)]
    fn exchange_all<S: Simd>(&mut self, simd: S, mut change: Set) -> Option<()> {
        self.positive.0 ^= change.0;
        while change.len() >= TOGETHER {
            let together: [usize; TOGETHER] = std::array::from_fn(|_| change.pop());
            self.exchange(simd, together)?;
        }
        while change.0 != 0 {
            self.exchange(simd, [change.pop()])?;
        }
        Some(())
    }

    /// z_p and w_p change places, for one p after another, and every row is read and written once for all of them.
    #[inline(always)]
    fn exchange<S: Simd, const K: usize>(&mut self, simd: S, pivots: [usize; K]) -> Option<()> {
        let mut made = Exchanges { place: pivots, own: [[Four::default(); ROW]; K], inverse: [0.0; K] };
        for (k, &p) in pivots.iter().enumerate() {
            let mut own = self.rows[p];
            made.follow(simd, 0..k, &mut own);
            let pivot = *entry(&mut own, p);
            // an impulse that leaves has one over what is left of its diagonal
            let left = if self.positive.has(p) { pivot.abs() } else { 1.0 / pivot.abs() };
            if !(left > SINGULAR * self.largest) {
                return None;
            }
            let inverse = 1.0 / pivot;
            own.iter_mut().for_each(|four| four.0.iter_mut().for_each(|x| *x *= -inverse));
            *entry(&mut own, p) = inverse;
            (made.own[k], made.inverse[k]) = (own, inverse);
        }
        self.rows.iter_mut().for_each(|row| made.follow(simd, 0..K, row));
        for (k, &p) in pivots.iter().enumerate() {
            self.rows[p] = made.own[k];
            made.follow(simd, k + 1..K, &mut self.rows[p]);
        }
        Some(())
    }

    /// Writes the impulses, with one correction for what exchanges have rounded.
    #[inline(always)]
    fn impulses<S: Simd>(&self, simd: S, (m, q): (&Matrix, &[f64]), z: &mut [f64]) {
        let mut off = [Four::default(); ROW];
        let n = z.len();
        (0..n).for_each(|i| z[i] = if self.positive.has(i) { self.value(i) } else { 0.0 });
        for i in (0..n).filter(|&i| self.positive.has(i)) {
            let (others, given) = m.row(i);
            let pressed = if given.len() == n {
                couplings::dot(given, z)
            } else {
                others.iter().zip(given).map(|(&j, m)| m * z[j as usize]).sum()
            };
            off[i / FOUR].0[i % FOUR] = pressed + q[i];
        }
        for i in (0..n).filter(|&i| self.positive.has(i)) {
            // w_i shall be lower by what it is too large: the tableau says how the impulses follow
            z[i] = (z[i] - dot(simd, &self.rows[i], &off)).max(0.0);
        }
    }
}

/// Exchanges of some z_p and w_p, each after those before it.
struct Exchanges<const K: usize, const ROW: usize> {
    place: [usize; K],
    /// The row of each new one by the columns of the old.
    own: [[Four; ROW]; K],
    /// One over each pivot, which its row has too.
    inverse: [f64; K],
}

impl<const K: usize, const ROW: usize> Exchanges<K, ROW> {
    /// What some of the exchanges, in their order, make of another row.
    #[inline(always)]
    fn follow<S: Simd>(&self, simd: S, which: Range<usize>, row: &mut [Four; ROW]) {
        let mut factors = [0.0; K];
        for k in which.clone() {
            factors[k] = *entry(row, self.place[k]);
            for j in which.start..k {
                factors[k] = plus::<S>(factors[j], self.at(j, k), factors[k]);
            }
        }
        for (c, four) in row.iter_mut().enumerate() {
            for k in which.clone() {
                add(simd, factors[k], &self.own[k][c], four);
            }
        }
        // after the others of their registers, which would wait for them
        for k in which.clone() {
            let mut column = factors[k] * self.inverse[k];
            for j in k + 1..which.end {
                column = plus::<S>(factors[j], self.at(j, k), column);
            }
            *entry(row, self.place[k]) = column;
        }
    }
    /// The number of row j in the column of another of the exchanges.
    #[inline(always)]
    fn at(&self, j: usize, k: usize) -> f64 {
        self.own[j][self.place[k] / FOUR].0[self.place[k] % FOUR]
    }
}

#[inline(always)]
fn entry(row: &mut [Four], place: usize) -> &mut f64 {
    &mut row[place / FOUR].0[place % FOUR]
}

/// a b + c, rounded as `add` rounds.
#[inline(always)]
fn plus<S: Simd>(a: f64, b: f64, c: f64) -> f64 {
    if S::F64_LANES == FOUR { local::plus::<true>(a, b, c) } else { local::plus::<false>(a, b, c) }
}

/// x += factor y.
#[inline(always)]
fn add<S: Simd>(simd: S, factor: f64, y: &Four, x: &mut Four) {
    if S::F64_LANES == FOUR {
        let x = &mut S::as_mut_simd_f64s(&mut x.0).0[0];
        *x = simd.mul_add_f64s(simd.splat_f64s(factor), S::as_simd_f64s(&y.0).0[0], *x);
    } else {
        (0..FOUR).for_each(|l| x.0[l] += factor * y.0[l]);
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
