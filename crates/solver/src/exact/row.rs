//! Rows of a block matrix times a vector over contacts, in registers of four: whole rows of a block are read at once,
//! what stands in the fourth place belongs to the next row and is dropped at the end. `Matrix` and padded vectors hold a
//! number more for it.

use super::operator::Matrix;
use crate::registers::in_fours;
use pulp::{Simd, WithSimd};

/// Four numbers from `at` on.
#[inline(always)]
fn four<S: Simd>(values: &[f64], at: usize) -> S::f64s {
    S::as_simd_f64s(&values[at..at + 4]).0[0]
}

#[inline(always)]
fn stored<S: Simd>(sum: S::f64s) -> [f64; 4] {
    let mut out = [0.0; 4];
    S::as_mut_simd_f64s(&mut out).0[0] = sum;
    out
}

/// Row i of W times x, a padded vector.
#[inline(always)]
pub fn row_times<S: Simd, const D: usize>(simd: S, matrix: &Matrix, i: usize, x: &[[f64; D]]) -> [f64; D] {
    let row = matrix.graph.row(i);
    let start = matrix.graph.offsets[row.start] as usize;
    let (values, neighbours) = (&matrix.values[start..], &matrix.graph.neighbours[row]);
    let flat = x.as_flattened();
    let mut out = [0.0; D];
    if S::F64_LANES != 4 || D == 1 {
        plainly(values, neighbours, flat, &mut out);
        return out;
    }
    let zero = simd.splat_f64s(0.0);
    if D == 2 {
        let mut sum = zero;
        for (k, &j) in neighbours.iter().enumerate() {
            let [a, b] = [flat[2 * j as usize], flat[2 * j as usize + 1]];
            let x = four::<S>(&[a, b, a, b], 0);
            sum = simd.mul_add_f64s(four::<S>(values, 4 * k), x, sum);
        }
        let sum = stored::<S>(sum);
        (out[0], out[1]) = (sum[0] + sum[1], sum[2] + sum[3]);
        return out;
    }
    // three names, and no call in the loop: sums would live in memory otherwise
    let (mut first, mut second, mut third) = (zero, zero, zero);
    for (k, &j) in neighbours.iter().enumerate() {
        let x = four::<S>(flat, 3 * j as usize);
        let row = |r: usize| four::<S>(values, 9 * k + 3 * r);
        first = simd.mul_add_f64s(row(0), x, first);
        second = simd.mul_add_f64s(row(1), x, second);
        third = simd.mul_add_f64s(row(2), x, third);
    }
    for (out, sum) in out.iter_mut().zip([first, second, third]) {
        let sum = stored::<S>(sum);
        *out = sum[0] + sum[1] + sum[2];
    }
    out
}

#[inline(always)]
fn plainly<const D: usize>(values: &[f64], neighbours: &[u32], x: &[f64], out: &mut [f64; D]) {
    for (block, &j) in values.chunks_exact(D * D).zip(neighbours) {
        let x = &x[D * j as usize..][..D];
        for (out, row) in out.iter_mut().zip(block.chunks_exact(D)) {
            row.iter().zip(x).for_each(|(w, x)| *out += w * x);
        }
    }
}

struct Product<'a, const D: usize>(&'a Matrix, &'a [[f64; D]], &'a mut [[f64; D]]);

impl<const D: usize> WithSimd for Product<'_, D> {
    type Output = ();
    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Product(matrix, x, out) = self;
        for (i, out) in out.iter_mut().enumerate().take(matrix.graph.nodes()) {
            *out = row_times(simd, matrix, i, x);
        }
    }
}

/// out = W x, x a padded vector.
pub fn product<const D: usize>(matrix: &Matrix, x: &[[f64; D]], out: &mut [[f64; D]]) {
    in_fours(Product(matrix, x, out));
}
