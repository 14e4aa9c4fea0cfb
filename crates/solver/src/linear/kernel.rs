//! Products of small dense matrices, by columns, in lanes. Large ones go to faer, whose tiles are tuned for them.

use super::chunk::of_usual_sizes;
use faer::linalg::matmul::matmul;
use faer::{Accum, MatMut, MatRef, Par};
use pulp::Simd;

/// Numbers that lanes may read or write past the end of what they are asked for.
pub const SLACK: usize = 16;

/// Rounds up to whole registers of eight.
pub fn padded(n: usize) -> usize {
    n.div_ceil(8) * 8
}

/// From this many multiply-adds on, with no side shorter than `THIN`, faer's product is faster.
const LARGE: usize = 1 << 14;
const THIN: usize = 12;

/// C -= A B: C is m x n, the inner size k. Each matrix comes with the distance of its columns.
#[inline(always)]
pub fn subtract_product<S: Simd>(
    simd: S,
    (c, ldc): (&mut [f64], usize),
    (a, lda): (&[f64], usize),
    (b, ldb): (&[f64], usize),
    (m, n, k): (usize, usize, usize),
) {
    if m * n * k >= LARGE && m.min(n).min(k) >= THIN {
        let target = MatMut::from_column_major_slice_with_stride_mut(c, m, n, ldc);
        let left = MatRef::from_column_major_slice_with_stride(a, m, k, lda);
        let right = MatRef::from_column_major_slice_with_stride(b, k, n, ldb);
        subtract_large(target, left, right);
        return;
    }
    let mut j = 0;
    while j + 6 <= n {
        columns::<S, 6>(simd, (&mut c[j * ldc..], ldc), (a, lda), (&b[j * ldb..], ldb), (m, k));
        j += 6;
    }
    while j + 3 <= n {
        columns::<S, 3>(simd, (&mut c[j * ldc..], ldc), (a, lda), (&b[j * ldb..], ldb), (m, k));
        j += 3;
    }
    while j < n {
        columns::<S, 1>(simd, (&mut c[j * ldc..], ldc), (a, lda), (&b[j * ldb..], ldb), (m, k));
        j += 1;
    }
}

/// C -= A B for matrices that fill many registers.
pub fn subtract_large(c: MatMut<'_, f64>, a: MatRef<'_, f64>, b: MatRef<'_, f64>) {
    matmul(c, Accum::Add, a, b, -1.0, Par::Seq);
}

/// N columns of C -= A B.
#[inline(always)]
fn columns<S: Simd, const N: usize>(
    simd: S,
    (c, ldc): (&mut [f64], usize),
    (a, lda): (&[f64], usize),
    (b, ldb): (&[f64], usize),
    (m, k): (usize, usize),
) {
    let lanes = S::F64_LANES;
    let mut i = 0;
    while i + 2 * lanes <= m {
        tile::<S, N, 2>(simd, (&mut c[i..], ldc), (&a[i..], lda), (b, ldb), k);
        i += 2 * lanes;
    }
    while i + lanes <= m {
        tile::<S, N, 1>(simd, (&mut c[i..], ldc), (&a[i..], lda), (b, ldb), k);
        i += lanes;
    }
    if i < m {
        let width = m - i;
        let mut sums = [simd.splat_f64s(0.0); N];
        for l in 0..k {
            let column = simd.partial_load_f64s(&a[l * lda + i..l * lda + i + width]);
            for n in 0..N {
                sums[n] = simd.mul_add_f64s(simd.splat_f64s(b[n * ldb + l]), column, sums[n]);
            }
        }
        for n in 0..N {
            let out = &mut c[n * ldc + i..n * ldc + i + width];
            let value = simd.sub_f64s(simd.partial_load_f64s(out), sums[n]);
            simd.partial_store_f64s(out, value);
        }
    }
}

/// N columns by R registers of C -= A B.
#[inline(always)]
fn tile<S: Simd, const N: usize, const R: usize>(
    simd: S,
    (c, ldc): (&mut [f64], usize),
    (a, lda): (&[f64], usize),
    (b, ldb): (&[f64], usize),
    k: usize,
) {
    let width = R * S::F64_LANES;
    let zero = simd.splat_f64s(0.0);
    let mut sums = [[zero; R]; N];
    let b: [&[f64]; N] = std::array::from_fn(|n| &b[n * ldb..n * ldb + k]);
    for l in 0..k {
        let column = S::as_simd_f64s(&a[l * lda..l * lda + width]).0;
        for n in 0..N {
            let factor = simd.splat_f64s(b[n][l]);
            for r in 0..R {
                sums[n][r] = simd.mul_add_f64s(factor, column[r], sums[n][r]);
            }
        }
    }
    for (n, sums) in sums.iter().enumerate() {
        let out = S::as_mut_simd_f64s(&mut c[n * ldc..n * ldc + width]).0;
        for r in 0..R {
            out[r] = simd.sub_f64s(out[r], sums[r]);
        }
    }
}

/// y += A x over the first `rows` rows; whole registers are read and written, `SLACK` numbers at most too many.
#[inline(always)]
pub fn add_product<S: Simd>(simd: S, y: &mut [f64], (a, lda): (&[f64], usize), x: &[f64], rows: usize) {
    let lanes = S::F64_LANES;
    // few columns at a time, so that long ones are read along their length
    for (part, x) in x.chunks(32).enumerate() {
        let a = &a[part * 32 * lda..];
        let mut i = 0;
        while i + 3 * lanes < rows {
            add_rows::<S, 4>(simd, &mut y[i..], (&a[i..], lda), x);
            i += 4 * lanes;
        }
        while i + lanes < rows {
            add_rows::<S, 2>(simd, &mut y[i..], (&a[i..], lda), x);
            i += 2 * lanes;
        }
        if i < rows {
            add_rows::<S, 1>(simd, &mut y[i..], (&a[i..], lda), x);
        }
    }
}

/// R registers of y += A x.
#[inline(always)]
fn add_rows<S: Simd, const R: usize>(simd: S, y: &mut [f64], (a, lda): (&[f64], usize), x: &[f64]) {
    let width = R * S::F64_LANES;
    let zero = simd.splat_f64s(0.0);
    let y = S::as_mut_simd_f64s(&mut y[..width]).0;
    let mut sums = [[zero; R]; 2];
    sums[0][..R].copy_from_slice(&y[..R]);
    // two sums, for one would wait for itself
    let mut pairs = x.chunks_exact(2);
    let mut at = 0;
    for pair in &mut pairs {
        for (half, &x) in pair.iter().enumerate() {
            let column = S::as_simd_f64s(&a[at..at + width]).0;
            let factor = simd.splat_f64s(x);
            for r in 0..R {
                sums[half][r] = simd.mul_add_f64s(factor, column[r], sums[half][r]);
            }
            at += lda;
        }
    }
    for &x in pairs.remainder() {
        let column = S::as_simd_f64s(&a[at..at + width]).0;
        for r in 0..R {
            sums[0][r] = simd.mul_add_f64s(simd.splat_f64s(x), column[r], sums[0][r]);
        }
    }
    for r in 0..R {
        y[r] = simd.add_f64s(sums[0][r], sums[1][r]);
    }
}

/// A := A M^-1 over `rows` rows (whole registers), with M a factorised chunk of k columns `ldm` apart and nodes of
/// `node` scalars.
#[inline(always)]
pub fn divide_right<S: Simd>(
    simd: S,
    (a, lda): (&mut [f64], usize),
    (m, ldm): (&[f64], usize),
    rows: usize,
    (k, node): (usize, usize),
) {
    of_usual_sizes!(
        (node, k),
        (<N, K> divide_by::<S, N, K>(simd, (a, lda), (m, ldm), rows)),
        _ => divide_by_any(simd, (a, lda), (m, ldm), rows, (k, node)),
    )
}

/// With M = L U over nodes of N scalars: y_c = (a_c - sum of y_b U_bc over b < c) D_c^-1, then
/// x_c = y_c - sum of x_b L_bc over b > c. What is found of a node is taken out of all that wait for it at once: side by
/// side these sums do not wait for each other.
#[inline(always)]
fn divide_by<S: Simd, const N: usize, const K: usize>(
    simd: S,
    (a, lda): (&mut [f64], usize),
    (m, ldm): (&[f64], usize),
    rows: usize,
) {
    let lanes = S::F64_LANES;
    let columns: [&[f64]; K] = std::array::from_fn(|c| &m[c * ldm..c * ldm + K]);
    for i in (0..rows).step_by(lanes) {
        let mut own = [simd.splat_f64s(0.0); K];
        for l in 0..K {
            own[l] = S::as_simd_f64s(&a[l * lda + i..l * lda + i + lanes]).0[0];
        }
        for c in 0..K / N {
            let mut found = [simd.splat_f64s(0.0); N];
            for n in 0..N {
                found[n] = simd.mul_f64s(simd.splat_f64s(columns[c * N + n][c * N]), own[c * N]);
                for l in 1..N {
                    let factor = simd.splat_f64s(columns[c * N + n][c * N + l]);
                    found[n] = simd.mul_add_f64s(factor, own[c * N + l], found[n]);
                }
            }
            for n in (c + 1) * N..K {
                for l in 0..N {
                    let factor = simd.splat_f64s(columns[n][c * N + l]);
                    own[n] = simd.negate_mul_add_f64s(factor, found[l], own[n]);
                }
            }
            for n in 0..N {
                own[c * N + n] = found[n];
            }
        }
        for c in (1..K / N).rev() {
            for n in 0..c * N {
                for l in 0..N {
                    let factor = simd.splat_f64s(columns[n][c * N + l]);
                    own[n] = simd.negate_mul_add_f64s(factor, own[c * N + l], own[n]);
                }
            }
        }
        for l in 0..K {
            S::as_mut_simd_f64s(&mut a[l * lda + i..l * lda + i + lanes]).0[0] = own[l];
        }
    }
}

/// The same for any sizes up to 64.
#[inline(always)]
fn divide_by_any<S: Simd>(
    simd: S,
    (a, lda): (&mut [f64], usize),
    (m, ldm): (&[f64], usize),
    rows: usize,
    (k, node): (usize, usize),
) {
    let lanes = S::F64_LANES;
    let zero = simd.splat_f64s(0.0);
    let (mut own, mut left) = ([zero; 64], [zero; 64]);
    for i in (0..rows).step_by(lanes) {
        for l in 0..k {
            own[l] = S::as_simd_f64s(&a[l * lda + i..l * lda + i + lanes]).0[0];
        }
        for c in (0..k).step_by(node) {
            for n in c..c + node {
                left[n] = own[n];
                for b in 0..c {
                    left[n] = simd.negate_mul_add_f64s(simd.splat_f64s(m[n * ldm + b]), own[b], left[n]);
                }
            }
            for n in c..c + node {
                own[n] = zero;
                for l in c..c + node {
                    own[n] = simd.mul_add_f64s(simd.splat_f64s(m[n * ldm + l]), left[l], own[n]);
                }
            }
        }
        for c in (0..k).step_by(node).rev() {
            for n in c..c + node {
                for b in c + node..k {
                    own[n] = simd.negate_mul_add_f64s(simd.splat_f64s(m[n * ldm + b]), own[b], own[n]);
                }
            }
        }
        for l in 0..k {
            S::as_mut_simd_f64s(&mut a[l * lda + i..l * lda + i + lanes]).0[0] = own[l];
        }
    }
}
