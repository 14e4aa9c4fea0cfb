//! Small complementarity problems by block principal pivoting (Judice and Pires 1994): guess which impulses are
//! positive, solve for them, and let every impulse and velocity of the wrong sign change sides; once that no longer
//! lowers their number, only the last of them (Murty 1974), which ends for every P-matrix.

use crate::delassus::Csr;
use pulp::{Arch, Simd, WithSimd};

/// Larger problems are left to the other stages.
pub const LARGEST: usize = 48;
/// Rounds that may pass before only one impulse changes sides.
const PATIENCE: usize = 3;

/// Pivots below this share of the largest entry are rounding.
const SINGULAR: f64 = 1e-13;

/// The linear systems of problems with at most so many unknowns lie on the stack.
const SMALL: usize = 8;

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

/// z >= 0, w = M z + q >= 0, z.w = 0 for z (at most `LARGEST`), starting from the signs of `z`, and the rounds spent;
/// `None`, z as it was, when a system is singular or the rounds are spent.
pub fn pivoted(m: &Csr, q: &[f64], z: &mut [f64]) -> Option<usize> {
    let n = q.len();
    let (mut small, mut large) = ([0.0; SMALL * (SMALL + 1)], Vec::new());
    let system = if n <= SMALL {
        &mut small[..]
    } else {
        large.resize(n * (n + 1), 0.0);
        &mut large[..]
    };
    let mut found = [0.0; LARGEST];
    let found = &mut found[..n];
    let mut positive = Set::of(n, |i| z[i] > 0.0 || q[i] < 0.0);
    let (mut fewest, mut patience) = (n + 1, PATIENCE);
    for round in 1..=4 * n + 10 {
        solved(m, q, positive, found, system)?;
        let wrong = Set::of(n, |i| {
            if positive.has(i) {
                return found[i] < 0.0;
            }
            let w: f64 = m.row(i).map(|(j, a)| a * found[j]).sum();
            w + q[i] < 0.0
        });
        let Some(last) = wrong.last() else {
            z.copy_from_slice(found);
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

/// M_pp z_p = -q_p by elimination with the largest pivots, the other z zero.
fn solved(m: &Csr, q: &[f64], positive: Set, z: &mut [f64], system: &mut [f64]) -> Option<()> {
    let (mut place, mut members) = ([0; LARGEST], [0; LARGEST]);
    let mut size = 0;
    for i in (0..q.len()).filter(|&i| positive.has(i)) {
        (place[i], members[size]) = (size, i);
        size += 1;
    }
    let (members, width) = (&members[..size], size + 1);
    let system = &mut system[..size * width];
    system.fill(0.0);
    for (row, i) in system.chunks_exact_mut(width).zip(members.iter().copied()) {
        m.row(i).filter(|(j, _)| positive.has(*j)).for_each(|(j, a)| row[place[j]] += a);
        row[size] = -q[i];
    }
    if size <= SMALL {
        eliminated(system, size)?
    } else {
        Arch::new().dispatch(Eliminate(system, size))?
    }
    z.fill(0.0);
    for (k, &i) in members.iter().enumerate().rev() {
        let row = &system[k * width..][..width];
        let known: f64 = members.iter().zip(row).skip(k + 1).map(|(&j, a)| a * z[j]).sum();
        z[i] = (row[size] - known) / row[k];
    }
    Some(())
}

/// `eliminated` in the machine's own instructions.
struct Eliminate<'a>(&'a mut [f64], usize);

impl WithSimd for Eliminate<'_> {
    type Output = Option<()>;
    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> Option<()> {
        eliminated(self.0, self.1)
    }
}

/// Brings the rows of a system with its right-hand side to a triangle; `None` when it is singular.
#[inline(always)]
fn eliminated(system: &mut [f64], size: usize) -> Option<()> {
    let width = size + 1;
    let largest = system.iter().fold(0.0_f64, |m, a| m.max(a.abs()));
    for k in 0..size {
        let at = |r: &usize| system[r * width + k].abs();
        let pivot = (k..size).max_by(|r, s| at(r).total_cmp(&at(s)))?;
        if !(at(&pivot) > SINGULAR * largest) {
            return None;
        }
        if pivot != k {
            (k..width).for_each(|c| system.swap(k * width + c, pivot * width + c));
        }
        let (above, below) = system.split_at_mut((k + 1) * width);
        let row = &above[k * width..];
        let inverse = 1.0 / row[k];
        for other in below.chunks_exact_mut(width) {
            let factor = other[k] * inverse;
            if factor != 0.0 {
                other[k..].iter_mut().zip(&row[k..]).for_each(|(x, y)| *x -= factor * y);
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
