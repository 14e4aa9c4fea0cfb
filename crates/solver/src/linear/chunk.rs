//! Factors of chunks of pivots, and inverses of their nodes. A matrix lies line by line, lines `padded(k)` apart and
//! filled with zeros; for an inverse lines may be rows or columns, as that of the transpose is the transpose.

use super::kernel::padded;
use pulp::Simd;

/// Nodes of N scalars, K of them together, as chunks usually have them: what works on a chunk is compiled for each of these, and once for
/// any sizes.
macro_rules! of_usual_sizes {
    (@ $own:literal $all:literal (<$n:ident, $k:ident> $usual:expr)) => {{
        const $n: usize = $own;
        const $k: usize = $all;
        $usual
    }};
    ($sizes:expr, $work:tt, $($pattern:pat => $other:expr),+ $(,)?) => {
        match $sizes {
            (2, 2) => of_usual_sizes!(@ 2 2 $work),
            (2, 4) => of_usual_sizes!(@ 2 4 $work),
            (2, 6) => of_usual_sizes!(@ 2 6 $work),
            (2, 8) => of_usual_sizes!(@ 2 8 $work),
            (3, 3) => of_usual_sizes!(@ 3 3 $work),
            (3, 6) => of_usual_sizes!(@ 3 6 $work),
            (3, 9) => of_usual_sizes!(@ 3 9 $work),
            (3, 12) => of_usual_sizes!(@ 3 12 $work),
            (6, 6) => of_usual_sizes!(@ 6 6 $work),
            (6, 12) => of_usual_sizes!(@ 6 12 $work),
            $($pattern => $other),+
        }
    };
}
pub(super) use of_usual_sizes;

/// Factorises a chunk, by columns, in place: block LU over its nodes, with the inverses of the nodes on the diagonal.
/// The inverse of the whole would lose the digits that contacts of one pair need, twelve rows that span six
/// directions. False when a node is singular.
#[inline(always)]
pub fn factorize_chunk<S: Simd>(simd: S, a: &mut [f64], (k, node): (usize, usize)) -> bool {
    match node {
        1 if k > 1 => factorize_by::<S, 1>(simd, a, k),
        2 if k > 2 => factorize_by::<S, 2>(simd, a, k),
        3 if k > 3 => factorize_by::<S, 3>(simd, a, k),
        4 if k > 4 => factorize_by::<S, 4>(simd, a, k),
        5 if k > 5 => factorize_by::<S, 5>(simd, a, k),
        6 if k > 6 => factorize_by::<S, 6>(simd, a, k),
        _ => invert(simd, a, k),
    }
}

/// The same for nodes of N scalars and k up to 16.
#[inline(always)]
fn factorize_by<S: Simd, const N: usize>(simd: S, a: &mut [f64], k: usize) -> bool {
    if padded(k) == 8 {
        factorize_lines::<S, N, 8>(simd, a, k)
    } else {
        factorize_lines::<S, N, 16>(simd, a, k)
    }
}

/// Place by place in a column.
const PLACES: [f64; 16] =
    [0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0, 10.0, 11.0, 12.0, 13.0, 14.0, 15.0];

/// The same for columns of so many numbers.
#[inline(always)]
fn factorize_lines<S: Simd, const N: usize, const ROW: usize>(simd: S, a: &mut [f64], k: usize) -> bool {
    let (columns, _) = a.as_chunks_mut::<ROW>();
    let columns = &mut columns[..k];
    let zero = simd.splat_f64s(0.0);
    for c in (0..k).step_by(N) {
        let (own, later) = columns[c..].split_at_mut(N);
        let mut node = [[0.0; N]; N];
        for i in 0..N {
            for j in 0..N {
                node[i][j] = own[i][c + j];
            }
        }
        if !invert_node(simd, &mut node) {
            return false;
        }
        // the columns below the node times its inverse; registers above it stay as they are
        let start = (c + N) / S::F64_LANES * S::F64_LANES;
        let mut below = [[0.0; ROW]; N];
        let first = simd.splat_f64s((c + N) as f64);
        for v in (start..ROW).step_by(S::F64_LANES) {
            let is_below = simd.less_than_or_equal_f64s(first, register::<S>(&PLACES, v));
            let mut given = [zero; N];
            for l in 0..N {
                given[l] = register::<S>(&own[l], v);
            }
            for i in 0..N {
                let mut sum = zero;
                for l in 0..N {
                    sum = simd.mul_add_f64s(simd.splat_f64s(node[i][l]), given[l], sum);
                }
                put::<S>(&mut below[i], v, simd.select_f64s(is_below, sum, zero));
                put::<S>(&mut own[i], v, simd.select_f64s(is_below, sum, given[i]));
            }
        }
        for i in 0..N {
            for j in 0..N {
                own[i][c + j] = node[i][j];
            }
        }
        for column in later {
            // number by number: what was stored as a register is not read across two
            let mut factors = [zero; N];
            for i in 0..N {
                factors[i] = simd.splat_f64s(column[c + i]);
            }
            for v in (start..ROW).step_by(S::F64_LANES) {
                let mut sum = register::<S>(column, v);
                for i in 0..N {
                    sum = simd.negate_mul_add_f64s(factors[i], register::<S>(&below[i], v), sum);
                }
                put::<S>(column, v, sum);
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

/// Inverts a node in place, with pivoting; false when it is singular.
#[inline(always)]
fn invert_node<S: Simd, const N: usize>(simd: S, node: &mut [[f64; N]; N]) -> bool {
    if N <= 3 && invert_small(node) {
        return true;
    }
    let mut lines = [[0.0; 8]; N];
    for i in 0..N {
        lines[i][..N].copy_from_slice(&node[i]);
    }
    if !invert_lines(simd, &mut lines) {
        return false;
    }
    for i in 0..N {
        node[i].copy_from_slice(&lines[i][..N]);
    }
    true
}

/// The same of k lines `padded(k)` apart.
#[inline(always)]
fn invert<S: Simd>(simd: S, a: &mut [f64], k: usize) -> bool {
    match k {
        1 => invert_known::<S, 1>(simd, a),
        2 => invert_known::<S, 2>(simd, a),
        3 => invert_known::<S, 3>(simd, a),
        4 => invert_known::<S, 4>(simd, a),
        5 => invert_known::<S, 5>(simd, a),
        6 => invert_known::<S, 6>(simd, a),
        _ => invert_any(simd, a, k),
    }
}

/// The same of N lines, at most 8.
#[inline(always)]
fn invert_known<S: Simd, const N: usize>(simd: S, a: &mut [f64]) -> bool {
    let (lines, _) = a.as_chunks_mut::<8>();
    if N > 3 {
        let Some(lines) = lines.first_chunk_mut::<N>() else { return false };
        return invert_lines(simd, lines);
    }
    let mut node = [[0.0; N]; N];
    for i in 0..N {
        node[i].copy_from_slice(&lines[i][..N]);
    }
    let found = invert_node(simd, &mut node);
    for i in 0..N {
        lines[i][..N].copy_from_slice(&node[i]);
    }
    found
}

/// The diagonal is kept as pivot unless another entry is this many times larger: swaps cost and rarely help here.
const WORSE: f64 = 10.0;

/// The same for N lines, at most 8, that fill eight numbers each.
#[inline(always)]
fn invert_lines<S: Simd, const N: usize>(simd: S, lines: &mut [[f64; 8]; N]) -> bool {
    let mut swaps = [0usize; N];
    for c in 0..N {
        let mut best = c;
        for r in c + 1..N {
            if lines[r][c].abs() > WORSE * lines[best][c].abs() {
                best = r;
            }
        }
        swaps[c] = best;
        if best != c {
            lines.swap(c, best);
        }
        let pivot = lines[c][c];
        if !pivot.is_normal() {
            return false;
        }
        let mut own = lines[c];
        own[c] = 1.0;
        let inverse = simd.splat_f64s(1.0 / pivot);
        for x in S::as_mut_simd_f64s(&mut own).0 {
            *x = simd.mul_f64s(inverse, *x);
        }
        for (r, target) in lines.iter_mut().enumerate() {
            if r == c {
                *target = own;
                continue;
            }
            let factor = simd.splat_f64s(target[c]);
            target[c] = 0.0;
            let own = S::as_simd_f64s(&own).0;
            for (t, s) in S::as_mut_simd_f64s(target).0.iter_mut().zip(own) {
                *t = simd.negate_mul_add_f64s(factor, *s, *t);
            }
        }
    }
    for c in (0..N).rev().filter(|&c| swaps[c] != c) {
        lines.iter_mut().for_each(|line| line.swap(c, swaps[c]));
    }
    true
}

/// The same for any k up to 64.
#[inline(always)]
fn invert_any<S: Simd>(simd: S, a: &mut [f64], k: usize) -> bool {
    let row = padded(k);
    let mut swaps = [0usize; 64];
    for c in 0..k {
        let mut best = c;
        for r in c + 1..k {
            if a[r * row + c].abs() > WORSE * a[best * row + c].abs() {
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

/// The same for at most three rows, by cofactors: one division deep, where elimination is k deep. False, with `m` as
/// it was, where the determinant has lost too many digits, as in 1 + 1e10 b b^T: elimination keeps them.
#[inline(always)]
fn invert_small<const N: usize>(m: &mut [[f64; N]; N]) -> bool {
    let mut sizes = 1.0;
    for line in m.iter() {
        let mut size = 0.0;
        for x in line {
            size += x.abs();
        }
        sizes *= size;
    }
    let mut cofactors = *m;
    let determinant = match N {
        1 => m[0][0],
        2 => {
            (cofactors[0][0], cofactors[0][1]) = (m[1][1], -m[1][0]);
            (cofactors[1][0], cofactors[1][1]) = (-m[0][1], m[0][0]);
            m[0][0] * m[1][1] - m[0][1] * m[1][0]
        }
        _ => {
            for i in 0..3 {
                let (r, s) = ((i + 1) % 3, (i + 2) % 3);
                for j in 0..3 {
                    let (c, d) = ((j + 1) % 3, (j + 2) % 3);
                    cofactors[i][j] = m[r][c] * m[s][d] - m[r][d] * m[s][c];
                }
            }
            m[0][0] * cofactors[0][0] + m[0][1] * cofactors[0][1] + m[0][2] * cofactors[0][2]
        }
    };
    let kept = N == 1 || determinant.abs() > LOST * sizes;
    if !kept || !determinant.is_normal() {
        return false;
    }
    let scale = 1.0 / determinant;
    if N == 1 {
        m[0][0] = scale;
        return true;
    }
    for i in 0..N {
        for j in 0..N {
            m[i][j] = cofactors[j][i] * scale;
        }
    }
    true
}

/// The sign of the determinant of a k x k matrix whose lines lie `stride` apart; the inverse has the same.
pub fn determinant_sign(a: &[f64], k: usize, stride: usize) -> f64 {
    // the nodes that there are need no memory of the machine's
    let (mut small, mut large) = ([0.0; 36], Vec::new());
    let m = if k * k <= small.len() {
        &mut small[..k * k]
    } else {
        large.resize(k * k, 0.0);
        &mut large[..]
    };
    for (own, line) in m.chunks_exact_mut(k).zip(a.chunks(stride)) {
        own.copy_from_slice(&line[..k]);
    }
    let mut sign = 1.0;
    for c in 0..k {
        let best = (c..k).fold(c, |b, r| if m[r * k + c].abs() > m[b * k + c].abs() { r } else { b });
        if best != c {
            (0..k).for_each(|j| m.swap(best * k + j, c * k + j));
            sign = -sign;
        }
        let (above, below) = m.split_at_mut((c + 1) * k);
        let own = &above[c * k..];
        if own[c] < 0.0 {
            sign = -sign;
        }
        for line in below.chunks_exact_mut(k) {
            let factor = line[c] / own[c];
            line[c..].iter_mut().zip(&own[c..]).for_each(|(x, o)| *x -= factor * o);
        }
    }
    sign
}
