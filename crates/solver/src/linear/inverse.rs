//! Inverses of small matrices, the chunks of pivots. The matrix lies line by line, lines `padded(k)` apart and
//! filled with zeros; lines may be rows or columns, for the inverse of the transpose is the transpose of the inverse.

use super::kernel::padded;
use pulp::Simd;

/// Inverts the k x k matrix `a` in place, `step` lines at a time (`step` divides k); false when one of the blocks met
/// on the diagonal is singular.
#[inline(always)]
pub fn invert<S: Simd>(simd: S, a: &mut [f64], k: usize, step: usize) -> bool {
    if k == step {
        return invert_whole(simd, a, k);
    }
    match step {
        1 => invert_by::<S, 1>(simd, a, k),
        2 => invert_by::<S, 2>(simd, a, k),
        3 => invert_by::<S, 3>(simd, a, k),
        4 => invert_by::<S, 4>(simd, a, k),
        5 => invert_by::<S, 5>(simd, a, k),
        6 => invert_by::<S, 6>(simd, a, k),
        _ => invert_whole(simd, a, k),
    }
}

/// Gauss-Jordan elimination by blocks of N lines, for k up to 16.
#[inline(always)]
fn invert_by<S: Simd, const N: usize>(simd: S, a: &mut [f64], k: usize) -> bool {
    let row = padded(k);
    for c in (0..k).step_by(N) {
        let mut block = [0.0; 48];
        for i in 0..N {
            block[i * 8..i * 8 + N].copy_from_slice(&a[(c + i) * row + c..][..N]);
        }
        if !invert_whole(simd, &mut block, N) {
            return false;
        }
        let (mut lines, mut factors) = ([[0.0; 16]; N], [[0.0; N]; 16]);
        for (line, own) in lines.iter_mut().zip(a[c * row..].chunks_exact(row)) {
            line[..row].copy_from_slice(own);
        }
        for (r, (factors, own)) in factors.iter_mut().zip(a.chunks_exact_mut(row)).take(k).enumerate() {
            factors.copy_from_slice(&own[c..c + N]);
            own[c..c + N].fill(0.0);
            if (c..c + N).contains(&r) {
                lines[r - c][c..c + N].fill(0.0);
                lines[r - c][r] = 1.0;
            }
        }
        for v in (0..row).step_by(S::F64_LANES) {
            let mut scaled = [simd.splat_f64s(0.0); N];
            for (i, (scaled, block)) in scaled.iter_mut().zip(block.chunks_exact(8)).enumerate() {
                for (factor, line) in block[..N].iter().zip(&lines) {
                    let line = register::<S>(line, v);
                    *scaled = simd.mul_add_f64s(simd.splat_f64s(*factor), line, *scaled);
                }
                put::<S>(a, (c + i) * row + v, *scaled);
            }
            for r in (0..c).chain(c + N..k) {
                let mut sum = register::<S>(a, r * row + v);
                for (factor, scaled) in factors[r].iter().zip(&scaled) {
                    sum = simd.negate_mul_add_f64s(simd.splat_f64s(*factor), *scaled, sum);
                }
                put::<S>(a, r * row + v, sum);
            }
        }
    }
    true
}

/// The register that starts at `at`.
#[inline(always)]
fn register<S: Simd>(x: &[f64], at: usize) -> S::f64s {
    S::as_simd_f64s(&x[at..at + S::F64_LANES]).0[0]
}

#[inline(always)]
fn put<S: Simd>(x: &mut [f64], at: usize, value: S::f64s) {
    S::as_mut_simd_f64s(&mut x[at..at + S::F64_LANES]).0[0] = value;
}

/// The same for a matrix taken as a whole, with pivoting.
#[inline(always)]
fn invert_whole<S: Simd>(simd: S, a: &mut [f64], k: usize) -> bool {
    let row = padded(k);
    if k <= 3 && invert_small(a, k) {
        return true;
    }
    let mut swaps = [0usize; 64];
    for c in 0..k {
        let mut best = c;
        for r in c + 1..k {
            // the diagonal is kept unless it is clearly worse: swaps cost and rarely help here
            if a[r * row + c].abs() > 10.0 * a[best * row + c].abs() {
                best = r;
            }
        }
        swaps[c] = best;
        if best != c {
            let (low, high) = a.split_at_mut(best * row);
            low[c * row..][..row].swap_with_slice(&mut high[..row]);
        }
        let pivot = a[c * row + c];
        if !pivot.is_normal() {
            return false;
        }
        a[c * row + c] = 1.0;
        let inverse = simd.splat_f64s(1.0 / pivot);
        for x in S::as_mut_simd_f64s(&mut a[c * row..][..row]).0 {
            *x = simd.mul_f64s(inverse, *x);
        }
        let (above, rest) = a.split_at_mut(c * row);
        let (own, below) = rest.split_at_mut(row);
        for target in above.chunks_exact_mut(row).chain(below.chunks_exact_mut(row).take(k - c - 1)) {
            let factor = simd.splat_f64s(target[c]);
            target[c] = 0.0;
            let own = S::as_simd_f64s(own).0;
            for (t, s) in S::as_mut_simd_f64s(target).0.iter_mut().zip(own) {
                *t = simd.negate_mul_add_f64s(factor, *s, *t);
            }
        }
    }
    for c in (0..k).rev().filter(|&c| swaps[c] != c) {
        for r in 0..k {
            a.swap(r * row + c, r * row + swaps[c]);
        }
    }
    true
}

/// Determinants below this share of the product of the rows' sizes have lost half of their digits.
const LOST: f64 = 1e-8;

/// The same for at most three rows, by cofactors: one division deep, where elimination is k deep. False, with `a` as
/// it was, where the determinant has lost too many digits, as in 1 + 1e10 b b^T: elimination keeps them.
#[inline(always)]
fn invert_small(a: &mut [f64], k: usize) -> bool {
    let row = padded(k);
    let size = |i: usize| a[i * row..][..k].iter().map(|x| x.abs()).sum::<f64>();
    if k == 1 {
        let pivot = a[0];
        if pivot.is_normal() {
            a[0] = 1.0 / pivot;
        }
        return pivot.is_normal();
    }
    if k == 2 {
        let (p, q, r, s) = (a[0], a[1], a[row], a[row + 1]);
        let determinant = p * s - q * r;
        let kept = determinant.abs() > LOST * size(0) * size(1);
        if !kept || !determinant.is_normal() {
            return false;
        }
        let scale = 1.0 / determinant;
        (a[0], a[1]) = (s * scale, -q * scale);
        (a[row], a[row + 1]) = (-r * scale, p * scale);
        return true;
    }
    let mut m = [[0.0; 3]; 3];
    for (line, own) in m.iter_mut().zip(a.chunks_exact(row)) {
        line.copy_from_slice(&own[..3]);
    }
    let mut cofactors = [[0.0; 3]; 3];
    for i in 0..3 {
        let (r, s) = ((i + 1) % 3, (i + 2) % 3);
        for j in 0..3 {
            let (c, d) = ((j + 1) % 3, (j + 2) % 3);
            cofactors[i][j] = m[r][c] * m[s][d] - m[r][d] * m[s][c];
        }
    }
    let determinant = m[0][0] * cofactors[0][0] + m[0][1] * cofactors[0][1] + m[0][2] * cofactors[0][2];
    let kept = determinant.abs() > LOST * size(0) * size(1) * size(2);
    if !kept || !determinant.is_normal() {
        return false;
    }
    let scale = 1.0 / determinant;
    for (i, own) in a.chunks_exact_mut(row).take(3).enumerate() {
        for j in 0..3 {
            own[j] = cofactors[j][i] * scale;
        }
    }
    true
}

/// The sign of the determinant of a k x k matrix whose lines lie `stride` apart; the inverse has the same.
pub fn determinant_sign(a: &[f64], k: usize, stride: usize) -> f64 {
    let mut lines: Vec<Vec<f64>> = a.chunks(stride).take(k).map(|line| line[..k].to_vec()).collect();
    let mut sign = 1.0;
    for c in 0..k {
        let best = (c..k).fold(c, |b, r| if lines[r][c].abs() > lines[b][c].abs() { r } else { b });
        if best != c {
            lines.swap(best, c);
            sign = -sign;
        }
        let (above, below) = lines.split_at_mut(c + 1);
        let own = &above[c];
        if own[c] < 0.0 {
            sign = -sign;
        }
        for line in below {
            let factor = line[c] / own[c];
            line[c..].iter_mut().zip(&own[c..]).for_each(|(x, o)| *x -= factor * o);
        }
    }
    sign
}
