//! Numeric factorisation and solution, front by front from the leaves to the roots (Duff and Reid 1983).

use super::analysis::{Analysis, Front};
use super::front::{
    determinant_sign, invert, padded, solve_panel, subtract_columns, subtract_product, subtract_products,
};
use pulp::{Arch, Simd, WithSimd};

/// Factors of a matrix, with the memory to make and use them.
#[derive(Clone, Debug, Default)]
pub struct Factor {
    /// Per chunk, one after another: inverse of the pivot block, then the columns below, then U.
    panels: Vec<f64>,
    /// The front being eliminated.
    front: Vec<f64>,
    /// Remainders of fronts that wait for their parents, last in, first out.
    waiting: Vec<f64>,
    /// Pivot rows of a chunk, turned.
    turned: Vec<f64>,
    /// Right-hand side in the order of elimination.
    solution: Vec<f64>,
    /// The part of it that a front touches.
    touched: Vec<f64>,
}

struct Factorize<'a>(&'a mut Factor, &'a Analysis, &'a [f64]);

impl WithSimd for Factorize<'_> {
    type Output = bool;
    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> bool {
        self.0.factorize_in(simd, self.1, self.2)
    }
}

struct Solve<'a>(&'a mut Factor, &'a Analysis, &'a mut [f64]);

impl WithSimd for Solve<'_> {
    type Output = ();
    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        self.0.solve_in(simd, self.1, self.2);
    }
}

impl Factor {
    /// Factorises the matrix of the analysed pattern with these values; false when a pivot block is singular.
    pub fn factorize(&mut self, analysis: &Analysis, values: &[f64]) -> bool {
        Arch::new().dispatch(Factorize(self, analysis, values))
    }

    /// Replaces a right-hand side by the solution.
    pub fn solve(&mut self, analysis: &Analysis, x: &mut [f64]) {
        Arch::new().dispatch(Solve(self, analysis, x));
    }

    /// 1 or -1: the sign of the determinant of the factorised matrix.
    pub fn determinant_sign(&self, analysis: &Analysis) -> f64 {
        let (mut sign, mut panel) = (1.0, 0);
        for front in &analysis.fronts {
            let mut left = front.pivot_scalars + front.row_scalars;
            for &chunk in &front.chunks {
                let k = chunk as usize;
                left -= k;
                sign *= determinant_sign(&self.panels[panel..panel + k * padded(k)], k);
                panel += k * padded(k) + 2 * k * padded(left);
            }
        }
        sign
    }

    #[inline(always)]
    fn factorize_in<S: Simd>(&mut self, simd: S, analysis: &Analysis, values: &[f64]) -> bool {
        self.panels.resize(analysis.panels, 0.0);
        let mut panel = 0;
        self.waiting.clear();
        let largest = padded(analysis.largest_front);
        self.front.resize(largest * largest, 0.0);
        self.turned.resize(largest * 64, 0.0);
        for front in &analysis.fronts {
            let size = front.pivot_scalars + front.row_scalars;
            let stride = padded(size);
            self.front[..stride * size].fill(0.0);
            self.gather(analysis, front, values, stride);
            let mut at = 0;
            for &chunk in &front.chunks {
                if !self.eliminate(simd, (at, chunk as usize), (size, stride), &mut panel) {
                    return false;
                }
                at += chunk as usize;
            }
            for column in self.front[..stride * size].chunks(stride).skip(front.pivot_scalars) {
                self.waiting.extend_from_slice(&column[front.pivot_scalars..size]);
            }
        }
        true
    }

    /// Fills the front with the matrix's blocks and the children's remainders.
    #[inline(always)]
    fn gather(&mut self, analysis: &Analysis, front: &Front, values: &[f64], stride: usize) {
        for block in &front.blocks {
            let source = &values[block.offset as usize..(block.offset + block.rows * block.columns) as usize];
            for (r, row) in source.chunks_exact(block.columns as usize).enumerate() {
                for (c, &x) in row.iter().enumerate() {
                    self.front[(block.column as usize + c) * stride + block.row as usize + r] += x;
                }
            }
        }
        for &c in front.children.iter().rev() {
            let child = &analysis.fronts[c as usize];
            let b = child.row_scalars;
            let start = self.waiting.len() - b * b;
            for &(from, to, length) in &child.runs {
                for k in 0..length as usize {
                    let column = (to as usize + k) * stride;
                    let own = &self.waiting[start + (from as usize + k) * b..][..b];
                    for &(f, t, n) in &child.runs {
                        let target = &mut self.front[column + t as usize..column + (t + n) as usize];
                        let source = &own[f as usize..(f + n) as usize];
                        target.iter_mut().zip(source).for_each(|(t, s)| *t += s);
                    }
                }
            }
            self.waiting.truncate(start);
        }
    }

    /// Eliminates one chunk of pivots from the front.
    #[inline(always)]
    fn eliminate<S: Simd>(
        &mut self,
        simd: S,
        (at, k): (usize, usize),
        (size, stride): (usize, usize),
        panel: &mut usize,
    ) -> bool {
        let m = size - at - k;
        let ld = padded(m);
        let row = padded(k);
        let (inverse, rest) = self.panels[*panel..].split_at_mut(k * row);
        let (l, u) = rest.split_at_mut(k * ld);
        let u = &mut u[..k * ld];
        *panel += k * row + 2 * k * ld;
        let turned = &mut self.turned[..k * ld];
        for c in 0..k {
            let column = &self.front[(at + c) * stride..(at + c) * stride + size];
            for r in 0..k {
                inverse[r * row + c] = column[at + r];
            }
            l[c * ld..c * ld + m].copy_from_slice(&column[at + k..]);
            l[c * ld + m..(c + 1) * ld].fill(0.0);
            turned[c * ld + m..(c + 1) * ld].fill(0.0);
        }
        if !invert(simd, inverse, k) {
            return false;
        }
        if m == 0 {
            return true;
        }
        let rest = &mut self.front[(at + k) * stride..];
        for (j, column) in rest.chunks(stride).take(m).enumerate() {
            for r in 0..k {
                turned[r * ld + j] = column[at + r];
            }
        }
        solve_panel(simd, inverse, turned, u, ld, k);
        subtract_product(simd, (rest, stride, at + k), (l, u), (m, k));
        true
    }

    #[inline(always)]
    fn solve_in<S: Simd>(&mut self, simd: S, analysis: &Analysis, x: &mut [f64]) {
        self.solution.clear();
        self.solution.extend(analysis.order.iter().map(|&i| x[i as usize]));
        self.touched.resize(padded(analysis.largest_front) + 8, 0.0);
        let mut z = [0.0; 64];
        let mut panel = 0;
        for front in &analysis.fronts {
            let size = front.pivot_scalars + front.row_scalars;
            let touched = &mut self.touched[..padded(size) + 8];
            touched[..front.pivot_scalars]
                .copy_from_slice(&self.solution[front.first..][..front.pivot_scalars]);
            touched[front.pivot_scalars..].fill(0.0);
            let mut at = 0;
            for &k in &front.chunks {
                let k = k as usize;
                let ld = padded(size - at - k);
                let (inverse, rest) = self.panels[panel..].split_at(k * padded(k));
                multiply(simd, inverse, &touched[at..at + k], &mut z);
                touched[at..at + k].copy_from_slice(&z[..k]);
                subtract_columns(simd, &mut touched[at + k..], &rest[..k * ld], &z[..k], ld);
                panel += k * padded(k) + 2 * k * ld;
                at += k;
            }
            self.solution[front.first..][..front.pivot_scalars]
                .copy_from_slice(&touched[..front.pivot_scalars]);
            for (&i, t) in front.positions.iter().zip(&touched[front.pivot_scalars..]) {
                self.solution[i as usize] += t;
            }
        }
        for front in analysis.fronts.iter().rev() {
            let size = front.pivot_scalars + front.row_scalars;
            let touched = &mut self.touched[..padded(size) + 8];
            touched[..front.pivot_scalars]
                .copy_from_slice(&self.solution[front.first..][..front.pivot_scalars]);
            for (&i, t) in front.positions.iter().zip(&mut touched[front.pivot_scalars..]) {
                *t = self.solution[i as usize];
            }
            touched[size..].fill(0.0);
            let mut at = front.pivot_scalars;
            for &k in front.chunks.iter().rev() {
                let k = k as usize;
                let ld = padded(size - at);
                let inverse = k * padded(k);
                panel -= inverse + 2 * k * ld;
                at -= k;
                let u = &self.panels[panel + inverse + k * ld..panel + inverse + 2 * k * ld];
                let (own, later) = touched.split_at_mut(at + k);
                subtract_products(simd, &mut own[at..], u, later, ld);
            }
            self.solution[front.first..][..front.pivot_scalars]
                .copy_from_slice(&touched[..front.pivot_scalars]);
        }
        analysis.order.iter().zip(&self.solution).for_each(|(&i, &value)| x[i as usize] = value);
    }
}

/// y = A x for a small matrix stored row by row, rows of length `padded(k)` with k the length of x.
#[inline(always)]
fn multiply<S: Simd>(simd: S, a: &[f64], x: &[f64], y: &mut [f64; 64]) {
    let row = padded(x.len());
    let mut full = [0.0; 64];
    full[..x.len()].copy_from_slice(x);
    for (line, out) in a.chunks_exact(row).zip(y) {
        let mut sum = simd.splat_f64s(0.0);
        for (a, b) in S::as_simd_f64s(line).0.iter().zip(S::as_simd_f64s(&full[..row]).0) {
            sum = simd.mul_add_f64s(*a, *b, sum);
        }
        *out = simd.reduce_sum_f64s(sum);
    }
}
