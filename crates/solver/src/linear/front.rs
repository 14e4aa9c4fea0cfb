//! Elimination of the pivots of a front [P U; L C], a chunk at a time: with a chunk D,
//! [D R; B C] = [1 0; B D^-1 1] [D R; 0 C - B D^-1 R]. D is factorised over its nodes, whose diagonal blocks are
//! inverted with pivoting; there is no pivoting between nodes (docs/adr/0009). Afterwards P holds the factors of its
//! chunks, what is below them times the inverse, and what is right of them as it was.

use super::chunk::factorize_chunk;
use super::kernel::{divide_right, padded, subtract_large, subtract_product};
use faer::{MatMut, MatRef};
use pulp::Simd;

/// A front: P, L, U with their sizes; columns of P and U lie `pivots` apart, those of L `stride`.
pub struct Panel<'a> {
    pub p: &'a mut [f64],
    pub l: &'a mut [f64],
    pub u: &'a mut [f64],
    pub pivots: usize,
    pub rows: usize,
    pub stride: usize,
}

/// Memory of an elimination.
#[derive(Clone, Debug, Default)]
pub struct Scratch {
    /// A chunk, then its factors.
    chunk: Vec<f64>,
    /// The part of P below a chunk.
    below: Vec<f64>,
    /// Rows of a chunk right of it.
    right: Vec<f64>,
}

impl Scratch {
    /// Memory for chunks, pivots and rows up to these numbers.
    pub fn fit(&mut self, chunk: usize, pivots: usize, rows: usize) {
        self.chunk.resize(chunk * padded(chunk), 0.0);
        self.below.resize(chunk * padded(pivots), 0.0);
        self.right.resize(chunk * pivots.max(rows), 0.0);
    }
}

/// Pivots after which everything right of them is updated at once.
const BLOCK: usize = 48;

/// Where a chunk lies: first pivot, size, size of its nodes, and the end of its block.
#[derive(Clone, Copy)]
struct Chunk {
    at: usize,
    size: usize,
    node: usize,
    stop: usize,
}

impl Chunk {
    fn end(self) -> usize {
        self.at + self.size
    }
}

/// Eliminates the pivots and subtracts L U from the remainder; false when a chunk is singular.
#[inline(always)]
pub fn eliminate<S: Simd>(
    simd: S,
    panel: &mut Panel<'_>,
    remainder: &mut [f64],
    chunks: &[(u32, u32)],
    scratch: &mut Scratch,
) -> bool {
    let (p, m) = (panel.pivots, panel.rows);
    let (mut start, mut next) = (0, 0);
    while start < p {
        let first = next;
        let mut stop = start;
        while next < chunks.len() && stop - start < BLOCK {
            stop += chunks[next].0 as usize;
            next += 1;
        }
        let mut at = start;
        for &(size, node) in &chunks[first..next] {
            let chunk = Chunk { at, size: size as usize, node: node as usize, stop };
            if !take_chunk(simd, panel, chunk, scratch) {
                return false;
            }
            if chunk.end() < stop {
                update_block(simd, panel, chunk, scratch);
            }
            if chunk.end() < p {
                update_rows(simd, panel, chunk, scratch);
            }
            at = chunk.end();
        }
        if stop < p {
            update_rest(simd, panel, (start, stop));
        }
        start = stop;
    }
    if m > 0 {
        let ld = panel.stride;
        subtract_product(simd, (remainder, ld), (panel.l, ld), (panel.u, p), (ld, m, p));
    }
    true
}

/// Factorises D and multiplies what is below it by D^-1; the part in P also stays in `scratch.below`.
#[inline(always)]
fn take_chunk<S: Simd>(simd: S, panel: &mut Panel<'_>, chunk: Chunk, scratch: &mut Scratch) -> bool {
    let (p, ld, k) = (panel.pivots, panel.stride, chunk.size);
    let line = padded(k);
    let factors = &mut scratch.chunk[..k * line];
    factors.chunks_exact_mut(line).for_each(|column| column[line - 8..].fill(0.0));
    copy_columns((&panel.p[chunk.at * p + chunk.at..], p), (factors, line), k);
    if !factorize_chunk(simd, factors, (k, chunk.node)) {
        return false;
    }
    copy_columns((factors, line), (&mut panel.p[chunk.at * p + chunk.at..], p), k);
    let sizes = (k, chunk.node);
    if panel.rows > 0 {
        divide_right(simd, (&mut panel.l[chunk.at * ld..], ld), (factors, line), ld, sizes);
    }
    let left = p - chunk.end();
    if left > 0 {
        let stride = padded(left);
        for (c, out) in scratch.below[..k * stride].chunks_exact_mut(stride).enumerate() {
            out[..left].copy_from_slice(&panel.p[(chunk.at + c) * p + chunk.end()..][..left]);
            out[left..].fill(0.0);
        }
        divide_right(simd, (&mut scratch.below, stride), (factors, line), stride, sizes);
        for (c, own) in scratch.below[..k * stride].chunks_exact(stride).enumerate() {
            panel.p[(chunk.at + c) * p + chunk.end()..][..left].copy_from_slice(&own[..left]);
        }
    }
    true
}

/// Copies k columns of k numbers; each side with the distance of its columns.
#[inline(always)]
fn copy_columns(from: (&[f64], usize), to: (&mut [f64], usize), k: usize) {
    match k {
        2 => copy_known::<2>(from, to),
        3 => copy_known::<3>(from, to),
        4 => copy_known::<4>(from, to),
        6 => copy_known::<6>(from, to),
        8 => copy_known::<8>(from, to),
        9 => copy_known::<9>(from, to),
        12 => copy_known::<12>(from, to),
        _ => {
            for (to, from) in to.0.chunks_mut(to.1).zip(from.0.chunks(from.1)).take(k) {
                to[..k].copy_from_slice(&from[..k]);
            }
        }
    }
}

/// The same for a number known beforehand, which needs no call.
#[inline(always)]
fn copy_known<const K: usize>((from, stride): (&[f64], usize), (to, line): (&mut [f64], usize)) {
    for c in 0..K {
        to[c * line..c * line + K].copy_from_slice(&from[c * stride..c * stride + K]);
    }
}

/// The later columns of the block, below the chunk.
#[inline(always)]
fn update_block<S: Simd>(simd: S, panel: &mut Panel<'_>, chunk: Chunk, scratch: &mut Scratch) {
    let (p, ld, k) = (panel.pivots, panel.stride, chunk.size);
    let (end, left) = (chunk.end(), p - chunk.end());
    let n = chunk.stop - end;
    gather(&panel.p[end * p..], (p, chunk.at, k), &mut scratch.right[..n * k]);
    let right = (&scratch.right[..], k);
    let target = (&mut panel.p[end * p + end..], p);
    subtract_product(simd, target, (&scratch.below, padded(left)), right, (left, n, k));
    if panel.rows > 0 {
        let (own, later) = panel.l.split_at_mut(end * ld);
        subtract_product(simd, (later, ld), (&own[chunk.at * ld..], ld), right, (ld, n, k));
    }
}

/// The later rows of the block, right of the block and in U.
#[inline(always)]
fn update_rows<S: Simd>(simd: S, panel: &mut Panel<'_>, chunk: Chunk, scratch: &mut Scratch) {
    let (p, k) = (panel.pivots, chunk.size);
    let (end, stop) = (chunk.end(), chunk.stop);
    let below = (&scratch.below[..], padded(p - end));
    let sides = [(&mut panel.p[stop * p..], p - stop), (&mut *panel.u, panel.rows)];
    for (columns, n) in sides {
        if n > 0 && end < stop {
            gather(columns, (p, chunk.at, k), &mut scratch.right[..n * k]);
            let target = (&mut columns[end..], p);
            subtract_product(simd, target, below, (&scratch.right, k), (stop - end, n, k));
        }
    }
}

/// Rows `at..at + k` of columns `stride` apart, gathered.
#[inline(always)]
fn gather(columns: &[f64], (stride, at, k): (usize, usize, usize), out: &mut [f64]) {
    for (own, column) in out.chunks_exact_mut(k).zip(columns.chunks(stride)) {
        own.copy_from_slice(&column[at..at + k]);
    }
}

/// Everything right of and below a block.
#[inline(always)]
fn update_rest<S: Simd>(simd: S, panel: &mut Panel<'_>, (start, stop): (usize, usize)) {
    let (p, m, ld, k) = (panel.pivots, panel.rows, panel.stride, stop - start);
    let left = p - stop;
    if m > 0 {
        let (own, later) = panel.l.split_at_mut(stop * ld);
        let right = (&panel.p[stop * p + start..], p);
        subtract_product(simd, (later, ld), (&own[start * ld..], ld), right, (ld, left, k));
    }
    let (own, later) = panel.p.split_at_mut(stop * p);
    let below = MatRef::from_column_major_slice_with_stride(&own[start * p + stop..], left, k, p);
    for (columns, n) in [(later, left), (&mut *panel.u, m)] {
        if n > 0 {
            let whole = MatMut::from_column_major_slice_with_stride_mut(columns, p, n, p);
            let (above, target) = whole.split_at_row_mut(stop);
            subtract_large(target, below, above.as_ref().subrows(start, k));
        }
    }
}
