//! Numeric factorisation and solution, front by front from the leaves to the roots (Duff and Reid 1983).

use super::analysis::Analysis;
use super::chunk::{determinant_sign, of_usual_sizes};
use super::front::{Panel, Scratch, eliminate};
use super::kernel::{SLACK, add_product, padded};
use super::layout::Front;
use crate::registers::in_widest;
use pulp::{Simd, WithSimd};

/// Factors of a matrix, with the memory to make and use them; no call but the first of an analysis allocates.
#[derive(Clone, Debug, Default)]
pub struct Factor {
    /// P, L and U of every front, one after another.
    panels: Vec<f64>,
    /// Remainders of fronts that wait for their parents, last in, first out; those of parents and of children in turn.
    waiting: [Vec<f64>; 2],
    scratch: Scratch,
    /// Right-hand side in the order of elimination.
    solution: Vec<f64>,
    /// The parts of it that a front works on.
    pivots: Vec<f64>,
    rows: Vec<f64>,
    chunk: Vec<f64>,
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
        self.fit(analysis);
        in_widest(Factorize(self, analysis, values))
    }

    /// Replaces a right-hand side by the solution.
    pub fn solve(&mut self, analysis: &Analysis, x: &mut [f64]) {
        in_widest(Solve(self, analysis, x));
    }

    /// 1 or -1: the sign of the determinant of the factorised matrix.
    pub fn determinant_sign(&self, analysis: &Analysis) -> f64 {
        let mut sign = 1.0;
        for front in &analysis.fronts {
            let mut at = 0;
            for &(k, node) in front.chunks.of(&analysis.lists.chunks) {
                // inverses of nodes stand on the diagonal of a chunk of several, that of the whole otherwise
                let step = if (1..k).contains(&node) && node <= 6 { node } else { k };
                for _ in (0..k).step_by(step as usize) {
                    let inverse = &self.panels[front.panel + at * front.pivots + at..];
                    sign *= determinant_sign(inverse, step as usize, front.pivots);
                    at += step as usize;
                }
            }
        }
        sign
    }

    fn fit(&mut self, analysis: &Analysis) {
        let sizes = &analysis.sizes;
        self.panels.resize(sizes.panels + SLACK, 0.0);
        for (stack, &length) in self.waiting.iter_mut().zip(&sizes.waiting) {
            stack.resize(length, 0.0);
        }
        self.scratch.fit(sizes.chunk, sizes.pivots, sizes.rows);
        self.solution.resize(analysis.order.len(), 0.0);
        self.pivots.resize(padded(sizes.pivots) + SLACK, 0.0);
        self.rows.resize(padded(sizes.rows) + SLACK, 0.0);
        self.chunk.resize(padded(sizes.chunk) + SLACK, 0.0);
    }

    #[inline(always)]
    fn factorize_in<S: Simd>(&mut self, simd: S, analysis: &Analysis, values: &[f64]) -> bool {
        let mut held = [0; 2];
        for front in &analysis.fronts {
            let panel = &mut self.panels[front.panel..front.panel + front.panel_length()];
            panel.fill(0.0);
            for block in front.blocks.of(&analysis.lists.blocks) {
                let (rows, columns) = (block.rows as usize, block.columns as usize);
                let source = &values[block.values as usize..][..rows * columns];
                let target = &mut panel[block.place as usize..];
                place(source, (target, block.stride as usize), (rows, columns));
            }
            let mut panel = split(panel, front);
            let (even, odd) = self.waiting.split_at_mut(1);
            let (own, other) =
                if front.stack == 0 { (&mut even[0], &odd[0]) } else { (&mut odd[0], &even[0]) };
            let start = held[front.stack];
            let remainder = &mut own[start..start + front.remainder()];
            remainder.fill(0.0);
            for &c in front.children.of(&analysis.lists.children).iter().rev() {
                let child = &analysis.fronts[c as usize];
                let end = held[child.stack];
                held[child.stack] -= child.remainder();
                add_remainder(analysis, child, &other[held[child.stack]..end], &mut panel, remainder);
            }
            let chunks = front.chunks.of(&analysis.lists.chunks);
            if !eliminate(simd, &mut panel, remainder, chunks, &mut self.scratch) {
                return false;
            }
            held[front.stack] += front.remainder();
        }
        true
    }

    #[inline(always)]
    fn solve_in<S: Simd>(&mut self, simd: S, analysis: &Analysis, x: &mut [f64]) {
        for (out, &i) in self.solution.iter_mut().zip(&analysis.order) {
            *out = x[i as usize];
        }
        for front in &analysis.fronts {
            self.forward(simd, front, analysis);
        }
        for front in analysis.fronts.iter().rev() {
            self.backward(simd, front, analysis);
        }
        for (&value, &i) in self.solution.iter().zip(&analysis.order) {
            x[i as usize] = value;
        }
    }

    /// Takes a front's pivots out of the later ones.
    #[inline(always)]
    fn forward<S: Simd>(&mut self, simd: S, front: &Front, analysis: &Analysis) {
        let (p, m, ld) = (front.pivots, front.rows, front.stride());
        let own = &mut self.solution[front.first..front.first + p];
        let chunks = front.chunks.of(&analysis.lists.chunks);
        if chunks.len() > 1 {
            let z = &mut self.pivots;
            z[..p].copy_from_slice(own);
            let mut at = 0;
            for &(k, _) in chunks {
                let k = k as usize;
                let (done, later) = z.split_at_mut(at + k);
                let minus = negated(&done[at..]);
                let below = &self.panels[front.panel + at * p + at + k..];
                add_product(simd, later, (below, p), &minus[..k], p - at - k);
                at += k;
            }
            own.copy_from_slice(&z[..p]);
        }
        if m > 0 {
            let l = &self.panels[front.panel + p * p..];
            self.rows[..ld].fill(0.0);
            add_product(simd, &mut self.rows, (l, ld), own, ld);
            for (&i, change) in front.positions.of(&analysis.lists.positions).iter().zip(&self.rows) {
                self.solution[i as usize] -= change;
            }
        }
    }

    /// Finds a front's pivots from the later ones.
    #[inline(always)]
    fn backward<S: Simd>(&mut self, simd: S, front: &Front, analysis: &Analysis) {
        let (p, m, ld) = (front.pivots, front.rows, front.stride());
        let panel = &self.panels[front.panel..];
        let z = &mut self.pivots;
        z[..p].copy_from_slice(&self.solution[front.first..front.first + p]);
        if m > 0 {
            for (x, &i) in self.rows.iter_mut().zip(front.positions.of(&analysis.lists.positions)) {
                *x = -self.solution[i as usize];
            }
            add_product(simd, z, (&panel[p * (p + ld)..], p), &self.rows[..m], p);
        }
        let mut at = p;
        for &(k, node) in front.chunks.of(&analysis.lists.chunks).iter().rev() {
            let k = k as usize;
            at -= k;
            for (part, later) in (at + k..p).step_by(64).enumerate() {
                let minus = negated(&z[later..p.min(later + 64)]);
                let right = &panel[(at + k + 64 * part) * p + at..];
                self.chunk[..k].copy_from_slice(&z[at..at + k]);
                add_product(simd, &mut self.chunk, (right, p), &minus[..64.min(p - later)], k);
                z[at..at + k].copy_from_slice(&self.chunk[..k]);
            }
            solve_chunk((&panel[at * p + at..], p), &mut z[at..at + k], node as usize);
        }
        self.solution[front.first..front.first + p].copy_from_slice(&z[..p]);
    }
}

/// Replaces the right-hand side of a factorised chunk by the solution.
#[inline(always)]
fn solve_chunk(m: (&[f64], usize), x: &mut [f64], node: usize) {
    of_usual_sizes!(
        (node, x.len()),
        (<N, K> solve_nodes::<N, K>(m, x)),
        (1..=6, _) => solve_any_nodes(m, x, node),
        _ => {
            let right = negated(x);
            x.fill(0.0);
            for (column, r) in m.0.chunks(m.1).zip(&right[..node]) {
                x.iter_mut().zip(column).for_each(|(x, inverse)| *x -= inverse * r);
            }
        }
    )
}

/// The same for nodes of N scalars, K together.
#[inline(always)]
fn solve_nodes<const N: usize, const K: usize>((m, ldm): (&[f64], usize), x: &mut [f64]) {
    let mut own = [0.0; K];
    own.copy_from_slice(&x[..K]);
    let columns: [&[f64]; K] = std::array::from_fn(|c| &m[c * ldm..c * ldm + K]);
    for first in (0..K / N - 1).map(|node| node * N) {
        let mut given = [0.0; N];
        given.copy_from_slice(&own[first..first + N]);
        for i in first + N..K {
            let mut sum = 0.0;
            for l in 0..N {
                sum += columns[first + l][i] * given[l];
            }
            own[i] -= sum;
        }
    }
    for first in (0..K / N).rev().map(|node| node * N) {
        let mut found = [0.0; N];
        for l in 0..N {
            for i in 0..N {
                found[i] += columns[first + l][first + i] * own[first + l];
            }
        }
        own[first..first + N].copy_from_slice(&found);
        for i in 0..first {
            let mut sum = 0.0;
            for l in 0..N {
                sum += columns[first + l][i] * found[l];
            }
            own[i] -= sum;
        }
    }
    x.copy_from_slice(&own);
}

/// The same for any sizes.
fn solve_any_nodes((m, ldm): (&[f64], usize), x: &mut [f64], node: usize) {
    let k = x.len();
    for c in (node..k).step_by(node) {
        let (done, later) = x.split_at_mut(c);
        for (l, own) in done[c - node..].iter().enumerate() {
            let column = &m[(c - node + l) * ldm + c..][..later.len()];
            later.iter_mut().zip(column).for_each(|(x, m)| *x -= m * own);
        }
    }
    for c in (0..k).step_by(node).rev() {
        let mut found = [0.0; 6];
        for l in 0..node {
            let column = &m[(c + l) * ldm + c..][..node];
            found.iter_mut().zip(column).for_each(|(found, m)| *found += m * x[c + l]);
        }
        x[c..c + node].copy_from_slice(&found[..node]);
        for l in 0..node {
            let column = &m[(c + l) * ldm..][..c];
            x[..c].iter_mut().zip(column).for_each(|(x, m)| *x -= m * found[l]);
        }
    }
}

/// -x; at most 64 numbers.
#[inline(always)]
fn negated(x: &[f64]) -> [f64; 64] {
    let mut out = [0.0; 64];
    out.iter_mut().zip(x).for_each(|(o, x)| *o = -x);
    out
}

/// P, L and U of a panel.
#[inline(always)]
fn split<'a>(panel: &'a mut [f64], front: &Front) -> Panel<'a> {
    let (pivots, rows, stride) = (front.pivots, front.rows, front.stride());
    let (p, rest) = panel.split_at_mut(pivots * pivots);
    let (l, u) = rest.split_at_mut(pivots * stride);
    Panel { p, l, u, pivots, rows, stride }
}

/// Writes a block that lies row by row into columns.
#[inline(always)]
fn place(source: &[f64], (target, stride): (&mut [f64], usize), (rows, columns): (usize, usize)) {
    match (rows, columns) {
        (2, 2) => place_square::<2>(source, target, stride),
        (3, 3) => place_square::<3>(source, target, stride),
        (6, 6) => place_square::<6>(source, target, stride),
        _ => {
            for (r, row) in source.chunks_exact(columns).enumerate() {
                row.iter().enumerate().for_each(|(c, &x)| target[c * stride + r] = x);
            }
        }
    }
}

#[inline(always)]
fn place_square<const N: usize>(source: &[f64], target: &mut [f64], stride: usize) {
    let source = &source[..N * N];
    for c in 0..N {
        let column = &mut target[c * stride..c * stride + N];
        for r in 0..N {
            column[r] = source[r * N + c];
        }
    }
}

/// Adds what a child left to its parent.
#[inline(always)]
fn add_remainder(
    analysis: &Analysis,
    child: &Front,
    source: &[f64],
    panel: &mut Panel<'_>,
    remainder: &mut [f64],
) {
    let (p, ld) = (panel.pivots, panel.stride);
    let [among_pivots, among_rows] = child.runs.map(|span| span.of(&analysis.lists.runs));
    let stride = child.stride();
    let mut columns = source.chunks_exact(stride);
    for (runs, is_pivot) in [(among_pivots, true), (among_rows, false)] {
        for &(_, to, length) in runs {
            for (j, own) in (to as usize..(to + length) as usize).zip(&mut columns) {
                let (above, below) = if is_pivot {
                    (&mut panel.p[j * p..(j + 1) * p], &mut panel.l[j * ld..(j + 1) * ld])
                } else {
                    let j = j - p;
                    (&mut panel.u[j * p..(j + 1) * p], &mut remainder[j * ld..(j + 1) * ld])
                };
                add_runs(own, among_pivots, above, 0);
                add_runs(own, among_rows, below, p);
            }
        }
    }
}

/// Adds runs of a column to a column of the parent that starts at its scalar `first`.
#[inline(always)]
fn add_runs(own: &[f64], runs: &[(u32, u32, u32)], target: &mut [f64], first: usize) {
    for &(from, to, length) in runs {
        let (own, target) = (&own[from as usize..], &mut target[to as usize - first..]);
        match length {
            2 => add_known::<2>(own, target),
            3 => add_known::<3>(own, target),
            4 => add_known::<4>(own, target),
            6 => add_known::<6>(own, target),
            9 => add_known::<9>(own, target),
            12 => add_known::<12>(own, target),
            _ => {
                let length = length as usize;
                target[..length].iter_mut().zip(&own[..length]).for_each(|(t, s)| *t += s);
            }
        }
    }
}

/// Adds so many numbers: runs are short, and most are of a few lengths.
#[inline(always)]
fn add_known<const N: usize>(own: &[f64], target: &mut [f64]) {
    let (own, target) = (&own[..N], &mut target[..N]);
    for k in 0..N {
        target[k] += own[k];
    }
}
