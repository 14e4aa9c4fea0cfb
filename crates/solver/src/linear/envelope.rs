//! Symmetric positive definite systems of a few hundred unknowns, factorised within their envelope (George and Liu 1981):
//! A = L L^T row by row, each row from its first entry on. Where the order keeps entries near the diagonal, its dense inner
//! products cost less than keeping account of a sparse factor. Knows no contacts.

use crate::registers::in_fours;
use pulp::{Simd, WithSimd};

/// Pivots below this share of their diagonal entry are rounding.
const SINGULAR: f64 = 1e-12;

/// Unknowns that are found together: a sum that reads what was written just before waits for it.
const TOGETHER: usize = 4;

/// A matrix by the lower rows of its envelope, and then its factor.
#[derive(Clone, Debug, Default)]
pub struct Envelope {
    /// Column of each row's first entry.
    first: Vec<u32>,
    /// Where each row starts in `values`; a row ends with its diagonal entry.
    starts: Vec<u32>,
    values: Vec<f64>,
    /// One over the factor's diagonal.
    inverse: Vec<f64>,
}

impl Envelope {
    /// Begins a matrix without rows.
    pub fn clear(&mut self) {
        self.first.clear();
        self.starts.clear();
        self.starts.push(0);
        self.values.clear();
    }
    /// Appends a row of zeros from this column to the diagonal, which come back to be written.
    pub fn push(&mut self, first: usize) -> &mut [f64] {
        let (row, start) = (self.first.len(), self.values.len());
        self.first.push(first as u32);
        self.values.resize(start + row + 1 - first, 0.0);
        self.starts.push(self.values.len() as u32);
        &mut self.values[start..]
    }
    /// Factorises; false where the matrix is singular, or not positive.
    pub fn factorize(&mut self) -> bool {
        in_fours(Factorize(self))
    }
    /// Replaces the right-hand side by the solution.
    pub fn solve(&self, x: &mut [f64]) {
        in_fours(Solve(self, x));
    }
    /// A row of the factor: its first column, and its entries before the diagonal.
    #[inline(always)]
    fn row(&self, r: usize) -> (usize, &[f64]) {
        let (start, end) = (self.starts[r] as usize, self.starts[r + 1] as usize);
        (self.first[r] as usize, &self.values[start..end - 1])
    }
}

struct Factorize<'a>(&'a mut Envelope);

impl WithSimd for Factorize<'_> {
    type Output = bool;
    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> bool {
        let Envelope { first, starts, values, inverse } = self.0;
        inverse.clear();
        for r in 0..first.len() {
            let (known, rest) = values.split_at_mut(starts[r] as usize);
            let (own, begin) = (&mut rest[..starts[r + 1] as usize - starts[r] as usize], first[r] as usize);
            let above = Rows { first, starts, values: known };
            let mut c = begin;
            while c + TOGETHER <= r {
                let (done, left) = own.split_at_mut(c - begin);
                let left = left.first_chunk_mut::<TOGETHER>().expect("columns before the diagonal");
                above.divide(simd, c, (begin, done), left, inverse);
                c += TOGETHER;
            }
            for c in c..r {
                let (done, left) = own.split_at_mut(c - begin);
                left[0] = (left[0] - above.dot(simd, c, c, (begin, done))) * inverse[c];
            }
            let (entries, pivot) = own.split_at(r - begin);
            let left = pivot[0] - dot(simd, entries, entries);
            // false for NaN
            let is_regular = left > SINGULAR * pivot[0];
            if !is_regular {
                return false;
            }
            inverse.push(1.0 / left.sqrt());
        }
        true
    }
}

/// Rows of a factor that are known.
struct Rows<'a> {
    first: &'a [u32],
    starts: &'a [u32],
    values: &'a [f64],
}

impl Rows<'_> {
    /// The inner product of a row with numbers that begin at a column, before another column.
    #[inline(always)]
    fn dot<S: Simd>(&self, simd: S, r: usize, end: usize, (begin, numbers): (usize, &[f64])) -> f64 {
        let first = self.first[r] as usize;
        let from = begin.max(first);
        if from >= end {
            return 0.0;
        }
        let own = &self.values[self.starts[r] as usize + from - first..][..end - from];
        dot(simd, own, &numbers[from - begin..end - begin])
    }

    /// An entry of a row, which may lie before its first.
    #[inline(always)]
    fn entry(&self, r: usize, c: usize) -> f64 {
        let first = self.first[r] as usize;
        if c < first { 0.0 } else { self.values[self.starts[r] as usize + c - first] }
    }

    /// Solves for some neighbouring unknowns of L x = b, from column c on: first what those before them give, which they
    /// do not wait for, and then what they give each other. `known` are those before, with the column where they begin.
    #[inline(always)]
    fn divide<S: Simd>(
        &self,
        simd: S,
        c: usize,
        known: (usize, &[f64]),
        x: &mut [f64; TOGETHER],
        inverse: &[f64],
    ) {
        let mut left = *x;
        // no closure: it would not be compiled for the registers at hand
        for (j, left) in left.iter_mut().enumerate() {
            *left -= self.dot(simd, c + j, c, known);
        }
        for j in 0..TOGETHER {
            for i in 0..j {
                left[j] -= left[i] * self.entry(c + j, c + i);
            }
            left[j] *= inverse[c + j];
        }
        *x = left;
    }
}

struct Solve<'a>(&'a Envelope, &'a mut [f64]);

impl WithSimd for Solve<'_> {
    type Output = ();
    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Solve(factor, x) = self;
        let Envelope { first, starts, values, inverse } = factor;
        let rows = Rows { first, starts, values };
        let mut r = 0;
        while r + TOGETHER <= x.len() {
            let (done, left) = x.split_at_mut(r);
            let left = left.first_chunk_mut::<TOGETHER>().expect("rows of the matrix");
            rows.divide(simd, r, (0, done), left, inverse);
            r += TOGETHER;
        }
        for r in r..x.len() {
            x[r] = (x[r] - rows.dot(simd, r, r, (0, &x[..r]))) * inverse[r];
        }
        for r in (0..x.len()).rev() {
            let (first, row) = factor.row(r);
            let own = x[r] * factor.inverse[r];
            x[r] = own;
            x[first..r].iter_mut().zip(row).for_each(|(x, l)| *x -= own * l);
        }
    }
}

/// The inner product of two lists of one length, four sums side by side.
#[inline(always)]
fn dot<S: Simd>(simd: S, a: &[f64], b: &[f64]) -> f64 {
    if S::F64_LANES != 4 {
        return dot_by_numbers(a, b);
    }
    let ((a, a_rest), (b, b_rest)) = (S::as_simd_f64s(a), S::as_simd_f64s(b));
    let mut sum = simd.splat_f64s(0.0);
    for (a, b) in a.iter().zip(b) {
        sum = simd.mul_add_f64s(*a, *b, sum);
    }
    if !a_rest.is_empty() {
        sum = simd.mul_add_f64s(simd.partial_load_f64s(a_rest), simd.partial_load_f64s(b_rest), sum);
    }
    simd.reduce_sum_f64s(sum)
}

/// The same sums without registers of four.
#[inline(always)]
fn dot_by_numbers(a: &[f64], b: &[f64]) -> f64 {
    let mut sums = [0.0; 4];
    for (a, b) in a.chunks(4).zip(b.chunks(4)) {
        for ((sum, a), b) in sums.iter_mut().zip(a).zip(b) {
            *sum = a.mul_add(*b, *sum);
        }
    }
    (sums[0] + sums[2]) + (sums[1] + sums[3])
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A symmetric matrix with entries up to five places off the diagonal that look random.
    fn entry(i: usize, j: usize) -> f64 {
        let (a, b) = (i.max(j), i.min(j));
        let scattered = ((a * 7919 + b * 104_729) % 1009) as f64 / 1009.0 - 0.5;
        if a == b { 6.0 + scattered } else { scattered }
    }

    #[test]
    fn what_is_solved_for_comes_back() {
        let first = |r: usize| r.saturating_sub(r % 6);
        let n = 37;
        let mut matrix = Envelope::default();
        matrix.clear();
        for r in 0..n {
            matrix.push(first(r)).iter_mut().enumerate().for_each(|(k, x)| *x = entry(r, first(r) + k));
        }
        let expected: Vec<f64> = (0..n).map(|i| (i as f64 * 0.7).sin()).collect();
        let is_there = |i: usize, j: usize| first(i.max(j)) <= i.min(j);
        let row = |i: usize| (0..n).filter(|&j| is_there(i, j)).map(|j| entry(i, j) * expected[j]).sum();
        let mut x: Vec<f64> = (0..n).map(row).collect();
        assert!(matrix.factorize());
        matrix.solve(&mut x);
        x.iter().zip(&expected).for_each(|(x, e)| assert!((x - e).abs() < 1e-14, "{x} {e}"));
    }

    #[test]
    fn inner_products_have_the_same_bits_without_registers_of_four() {
        struct Dot<'a>(&'a [f64], &'a [f64]);
        impl WithSimd for Dot<'_> {
            type Output = f64;
            #[inline(always)]
            fn with_simd<S: Simd>(self, simd: S) -> f64 {
                dot(simd, self.0, self.1)
            }
        }
        let numbers = |scale: f64| (0..40).map(|i| (scale * i as f64).sin()).collect::<Vec<f64>>();
        let (a, b) = (numbers(0.7), numbers(1.3));
        for n in 0..40 {
            let narrow = Dot(&a[..n], &b[..n]).with_simd(pulp::Scalar::new());
            assert_eq!(in_fours(Dot(&a[..n], &b[..n])).to_bits(), narrow.to_bits(), "{n} numbers");
        }
    }

    #[test]
    fn rows_that_depend_on_others_are_told() {
        let mut matrix = Envelope::default();
        matrix.clear();
        for r in 0..3 {
            matrix.push(0).iter_mut().for_each(|x| *x = 1.0);
            assert_eq!(matrix.first.len(), r + 1);
        }
        assert!(!matrix.factorize());
    }
}
