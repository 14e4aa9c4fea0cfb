//! Dense work on a front, in lanes: with a chunk of pivots D, [D R; L C] = [1 0; L D^-1 1] [D 0; 0 C - L U] [1 U; 0 1]
//! and U = D^-1 R. D is inverted as a whole (Gauss-Jordan with pivoting inside the chunk); no pivoting between
//! chunks (docs/adr/0009).

use pulp::Simd;

/// Rounds up to whole registers of eight.
pub fn padded(n: usize) -> usize {
    n.div_ceil(8) * 8
}

/// Inverts the k x k matrix `a` (row by row, rows of length `padded(k)`) in place; false when it is singular.
#[inline(always)]
pub fn invert<S: Simd>(simd: S, a: &mut [f64], k: usize) -> bool {
    let row = padded(k);
    if k <= 3 {
        return invert_small(a, k);
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

/// The same for at most three rows, by cofactors: one division deep, where elimination is k deep.
#[inline(always)]
fn invert_small(a: &mut [f64], k: usize) -> bool {
    let row = padded(k);
    let at = |i: usize, j: usize| a[i * row + j];
    if k == 1 {
        let pivot = at(0, 0);
        a[0] = 1.0 / pivot;
        return pivot.is_normal();
    }
    if k == 2 {
        let (p, q, r, s) = (at(0, 0), at(0, 1), at(1, 0), at(1, 1));
        let determinant = p * s - q * r;
        let scale = 1.0 / determinant;
        (a[0], a[1]) = (s * scale, -q * scale);
        (a[row], a[row + 1]) = (-r * scale, p * scale);
        return determinant.is_normal();
    }
    let minor = |i: usize, j: usize| {
        let (r, s) = ((i + 1) % 3, (i + 2) % 3);
        let (c, d) = ((j + 1) % 3, (j + 2) % 3);
        at(r, c) * at(s, d) - at(r, d) * at(s, c)
    };
    let cofactors = [
        [minor(0, 0), minor(0, 1), minor(0, 2)],
        [minor(1, 0), minor(1, 1), minor(1, 2)],
        [minor(2, 0), minor(2, 1), minor(2, 2)],
    ];
    let determinant = at(0, 0) * cofactors[0][0] + at(0, 1) * cofactors[0][1] + at(0, 2) * cofactors[0][2];
    let scale = 1.0 / determinant;
    for i in 0..3 {
        for j in 0..3 {
            a[i * row + j] = cofactors[j][i] * scale;
        }
    }
    determinant.is_normal()
}

/// The sign of the determinant of a k x k matrix, stored as for `invert`; the inverse has the same.
pub fn determinant_sign(a: &[f64], k: usize) -> f64 {
    let mut rows: Vec<Vec<f64>> = a.chunks_exact(padded(k)).take(k).map(|row| row[..k].to_vec()).collect();
    let mut sign = 1.0;
    for c in 0..k {
        let best = (c..k).fold(c, |b, r| if rows[r][c].abs() > rows[b][c].abs() { r } else { b });
        if best != c {
            rows.swap(best, c);
            sign = -sign;
        }
        let (above, below) = rows.split_at_mut(c + 1);
        let own = &above[c];
        if own[c] < 0.0 {
            sign = -sign;
        }
        for row in below {
            let factor = row[c] / own[c];
            row[c..].iter_mut().zip(&own[c..]).for_each(|(x, o)| *x -= factor * o);
        }
    }
    sign
}

/// u = r D^-T over columns of length `m` (a multiple of eight): column c of u is sum over l of inverse[c, l] times
/// column l of r.
#[inline(always)]
pub fn solve_panel<S: Simd>(simd: S, inverse: &[f64], r: &[f64], u: &mut [f64], m: usize, k: usize) {
    let row = padded(k);
    for c in 0..k {
        let out = S::as_mut_simd_f64s(&mut u[c * m..(c + 1) * m]).0;
        let first = simd.splat_f64s(inverse[c * row]);
        for (o, x) in out.iter_mut().zip(S::as_simd_f64s(&r[..m]).0) {
            *o = simd.mul_f64s(first, *x);
        }
        for l in 1..k {
            let factor = simd.splat_f64s(inverse[c * row + l]);
            for (o, x) in out.iter_mut().zip(S::as_simd_f64s(&r[l * m..(l + 1) * m]).0) {
                *o = simd.mul_add_f64s(factor, *x, *o);
            }
        }
    }
}

/// Columns of C updated together.
const TILE: usize = 4;

/// C -= L U^T: C has `m` rows from `row` on in columns of stride `stride`; L and U are m x k in columns of length
/// `padded(m)`.
#[inline(always)]
pub fn subtract_product<S: Simd>(
    simd: S,
    (c, stride, row): (&mut [f64], usize, usize),
    (l, u): (&[f64], &[f64]),
    (m, k): (usize, usize),
) {
    let ld = padded(m);
    let mut columns = c.chunks_mut(stride).map(|column| &mut column[row..row + m]);
    let mut j = 0;
    while j + TILE <= m {
        let (Some(c0), Some(c1), Some(c2), Some(c3)) =
            (columns.next(), columns.next(), columns.next(), columns.next())
        else {
            return;
        };
        tile(simd, [c0, c1, c2, c3], (l, &u[j..]), (m, k, ld));
        j += TILE;
    }
    for column in columns.take(m - j) {
        tile(simd, [column], (l, &u[j..]), (m, k, ld));
        j += 1;
    }
}

/// N columns of C -= L U^T; `u` starts at the first of the columns.
#[inline(always)]
fn tile<S: Simd, const N: usize>(
    simd: S,
    columns: [&mut [f64]; N],
    (l, u): (&[f64], &[f64]),
    (m, k, ld): (usize, usize, usize),
) {
    let lanes = S::F64_LANES;
    let mut i = 0;
    while i + 2 * lanes <= m {
        let zero = simd.splat_f64s(0.0);
        let mut sums = [[zero; 2]; N];
        for p in 0..k {
            let a = S::as_simd_f64s(&l[p * ld + i..p * ld + i + 2 * lanes]).0;
            let b = &u[p * ld..p * ld + N];
            for n in 0..N {
                let factor = simd.splat_f64s(b[n]);
                sums[n][0] = simd.mul_add_f64s(factor, a[0], sums[n][0]);
                sums[n][1] = simd.mul_add_f64s(factor, a[1], sums[n][1]);
            }
        }
        for n in 0..N {
            let out = S::as_mut_simd_f64s(&mut columns[n][i..i + 2 * lanes]).0;
            out[0] = simd.sub_f64s(out[0], sums[n][0]);
            out[1] = simd.sub_f64s(out[1], sums[n][1]);
        }
        i += 2 * lanes;
    }
    while i < m {
        let width = lanes.min(m - i);
        let mut sums = [simd.splat_f64s(0.0); N];
        for p in 0..k {
            let a = simd.partial_load_f64s(&l[p * ld + i..p * ld + i + lanes]);
            let b = &u[p * ld..p * ld + N];
            for n in 0..N {
                sums[n] = simd.mul_add_f64s(simd.splat_f64s(b[n]), a, sums[n]);
            }
        }
        for n in 0..N {
            let out = &mut columns[n][i..i + width];
            let value = simd.sub_f64s(simd.partial_load_f64s(out), sums[n]);
            simd.partial_store_f64s(out, value);
        }
        i += width;
    }
}

/// y -= L z over columns of length `m` (a multiple of eight).
#[inline(always)]
pub fn subtract_columns<S: Simd>(simd: S, y: &mut [f64], l: &[f64], z: &[f64], m: usize) {
    for (p, &factor) in z.iter().enumerate() {
        let factor = simd.splat_f64s(factor);
        let column = S::as_simd_f64s(&l[p * m..(p + 1) * m]).0;
        for (o, a) in S::as_mut_simd_f64s(&mut y[..m]).0.iter_mut().zip(column) {
            *o = simd.negate_mul_add_f64s(factor, *a, *o);
        }
    }
}

/// z -= U^T y over columns of length `m` (a multiple of eight).
#[inline(always)]
pub fn subtract_products<S: Simd>(simd: S, z: &mut [f64], u: &[f64], y: &[f64], m: usize) {
    for (p, out) in z.iter_mut().enumerate() {
        let mut sum = simd.splat_f64s(0.0);
        let column = S::as_simd_f64s(&u[p * m..(p + 1) * m]).0;
        for (x, a) in S::as_simd_f64s(&y[..m]).0.iter().zip(column) {
            sum = simd.mul_add_f64s(*a, *x, sum);
        }
        *out -= simd.reduce_sum_f64s(sum);
    }
}
