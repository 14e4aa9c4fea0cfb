//! Small complementarity problems by block principal pivoting (Judice and Pires 1994): guess which impulses are
//! positive, solve for them, and let every impulse and velocity of the wrong sign change sides; once that no longer
//! lowers their number, only the last of them (Murty 1974), which ends for every P-matrix.

use crate::delassus::Csr;

/// Larger problems are left to the other stages.
pub const LARGEST: usize = 48;
/// Rounds that may pass before only one impulse changes sides.
const PATIENCE: usize = 3;

/// Pivots below this share of the largest entry are rounding.
const SINGULAR: f64 = 1e-13;

/// z >= 0, w = M z + q >= 0, z.w = 0 for z, starting from the signs of `z`, and the rounds spent; `None` when a system
/// is singular or the rounds are spent.
pub fn pivoted(m: &Csr, q: &[f64], z: &[f64]) -> Option<(Vec<f64>, usize)> {
    let n = q.len();
    let mut positive: Vec<bool> = (0..n).map(|i| z[i] > 0.0 || q[i] < 0.0).collect();
    let (mut z, mut system) = (vec![0.0; n], Vec::with_capacity(n * (n + 1)));
    let (mut fewest, mut patience) = (n + 1, PATIENCE);
    for round in 1..=4 * n + 10 {
        solved(m, q, &positive, &mut z, &mut system)?;
        let wrong = |i: usize| {
            if positive[i] {
                return z[i] < 0.0;
            }
            let w: f64 = m.row(i).map(|(j, a)| a * z[j]).sum();
            w + q[i] < 0.0
        };
        let wrong: Vec<usize> = (0..n).filter(|&i| wrong(i)).collect();
        let Some(&last) = wrong.last() else { return Some((z, round)) };
        if wrong.len() < fewest {
            (fewest, patience) = (wrong.len(), PATIENCE);
        } else {
            patience = patience.saturating_sub(1);
        }
        if patience > 0 {
            wrong.iter().for_each(|&i| positive[i] = !positive[i]);
        } else {
            positive[last] = !positive[last];
        }
    }
    None
}

/// M_pp z_p = -q_p by elimination with the largest pivots, the other z zero.
fn solved(m: &Csr, q: &[f64], positive: &[bool], z: &mut [f64], system: &mut Vec<f64>) -> Option<()> {
    let mut place = [usize::MAX; LARGEST];
    let mut size = 0;
    for i in (0..q.len()).filter(|&i| positive[i]) {
        place[i] = size;
        size += 1;
    }
    let width = size + 1;
    system.clear();
    system.resize(size * width, 0.0);
    for i in (0..q.len()).filter(|&i| positive[i]) {
        let row = &mut system[place[i] * width..][..width];
        m.row(i).filter(|(j, _)| positive[*j]).for_each(|(j, a)| row[place[j]] += a);
        row[size] = -q[i];
    }
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
        for other in below.chunks_exact_mut(width) {
            let factor = other[k] / row[k];
            if factor != 0.0 {
                other[k..].iter_mut().zip(&row[k..]).for_each(|(x, y)| *x -= factor * y);
            }
        }
    }
    z.fill(0.0);
    for i in (0..q.len()).rev().filter(|&i| positive[i]) {
        let k = place[i];
        let row = &system[k * width..][..width];
        let known: f64 = (i + 1..q.len()).filter(|&j| positive[j]).map(|j| row[place[j]] * z[j]).sum();
        z[i] = (row[size] - known) / row[k];
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
        let (z, _) = pivoted(&m, &q, &[0.0; 3]).expect("a P-matrix");
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
        let (z, _) = pivoted(&m, &q, &[1.0, 0.0, 0.0]).expect("a P-matrix");
        z.iter().for_each(|z| assert!((z - 1.0 / 3.0).abs() < 1e-15, "{z}"));
    }

    #[test]
    fn redundant_rows_are_left_to_others() {
        let m = compressed(&[&[1.0, 1.0], &[1.0, 1.0]]);
        assert!(pivoted(&m, &[-1.0, -1.0], &[0.0; 2]).is_none());
    }
}
