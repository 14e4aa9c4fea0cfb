//! W as it is multiplied by impulses: its blocks row by row, the diagonal apart, laid out so that a row times the impulses
//! runs in registers of four without a sum across one. In space a block lies by columns of four, the fourth number zero,
//! and each number of an impulse is spread over a register; in the plane a block by rows fills one register.

use super::operator::Matrix;
use crate::registers::in_fours;
use pulp::{Simd, WithSimd};
use std::ops::Range;

/// Numbers that a block of three rows takes: three columns of four.
const SPATIAL: usize = 12;

/// The blocks of W.
#[derive(Clone, Debug, Default)]
pub struct Couplings {
    /// Start of each contact's neighbours; one entry more than contacts.
    starts: Vec<u32>,
    neighbours: Vec<u32>,
    values: Vec<f64>,
    /// Each contact's own block; sweeps, which do not read it, would have to read past it.
    own: Vec<f64>,
    /// Every contact presses on every other one, and they have their own order.
    all: bool,
}

/// Numbers that sweeps keep of an impulse of so many directions.
pub const fn places(dimension: usize) -> usize {
    if dimension == 3 { 4 } else { dimension }
}

impl Couplings {
    /// Those of a matrix.
    pub fn of(matrix: &Matrix) -> Self {
        let all: Vec<u32> = (0..matrix.graph.nodes() as u32).collect();
        let is_full = matrix.graph.neighbours.len() == all.len() * all.len();
        Couplings { all: is_full, ..Couplings::in_order(matrix, &all, &all) }
    }
    /// Those of a matrix with its contacts in this order; neighbours by the name that each contact gets.
    pub fn in_order(matrix: &Matrix, order: &[u32], name: &[u32]) -> Self {
        let (graph, d) = (&matrix.graph, matrix.dimension());
        let nodes = graph.nodes();
        let others = graph.neighbours.len() - nodes;
        let mut couplings = Couplings {
            starts: Vec::with_capacity(nodes + 1),
            neighbours: Vec::with_capacity(others),
            values: Vec::with_capacity(others * d * places(d)),
            own: Vec::with_capacity(nodes * d * places(d)),
            all: false,
        };
        let push = |k: usize, out: &mut Vec<f64>| {
            let block = &matrix.values[graph.offsets[k] as usize..][..d * d];
            if d == 3 {
                (0..3).for_each(|c| out.extend([block[c], block[3 + c], block[6 + c], 0.0]));
            } else {
                out.extend_from_slice(block);
            }
        };
        couplings.starts.push(0);
        for i in order.iter().map(|&i| i as usize) {
            // what a sweep has just moved comes last: a sum waits for it, not after it
            let row = graph.row(i);
            let at = graph.position(i, i).expect("every row holds its diagonal");
            for k in (at + 1..row.end).chain(row.start..at) {
                couplings.neighbours.push(name[graph.neighbours[k] as usize]);
                push(k, &mut couplings.values);
            }
            push(at, &mut couplings.own);
            couplings.starts.push(couplings.neighbours.len() as u32);
        }
        couplings
    }
    /// Those of some contacts that lie one after another and that no other ones press on, `d` directions each.
    pub fn part(&self, contacts: Range<usize>, d: usize) -> Self {
        let size = d * places(d);
        let blocks = self.starts[contacts.start] as usize..self.starts[contacts.end] as usize;
        let starts = self.starts[contacts.start..=contacts.end].iter();
        Couplings {
            starts: starts.map(|s| s - self.starts[contacts.start]).collect(),
            neighbours: self.neighbours[blocks.clone()].to_vec(),
            values: self.values[blocks.start * size..blocks.end * size].to_vec(),
            own: self.own[contacts.start * size..contacts.end * size].to_vec(),
            all: false,
        }
    }
    /// Blocks off the diagonal of contacts that lie one after another.
    pub fn count(&self, contacts: Range<usize>) -> usize {
        (self.starts[contacts.end] - self.starts[contacts.start]) as usize
    }
    /// What presses on each contact from `first` on, one after another.
    #[inline(always)]
    pub fn rows<const D: usize>(&self, first: usize) -> Rows<'_, D> {
        let start = self.starts[first] as usize;
        let size = D * places(D);
        Rows {
            starts: &self.starts[first..],
            neighbours: &self.neighbours[start..],
            values: &self.values[start * size..],
            own: &self.own[first * size..],
            all: self.all,
        }
    }
}

/// The rows that are left.
pub struct Rows<'a, const D: usize> {
    starts: &'a [u32],
    neighbours: &'a [u32],
    values: &'a [f64],
    own: &'a [f64],
    all: bool,
}

/// What presses on one contact, and its own block.
pub struct Row<'a, const D: usize> {
    neighbours: &'a [u32],
    values: &'a [f64],
    own: &'a [f64],
    all: bool,
}

impl<'a, const D: usize> Iterator for Rows<'a, D> {
    type Item = Row<'a, D>;
    #[inline(always)]
    fn next(&mut self) -> Option<Row<'a, D>> {
        let [start, end, ..] = *self.starts else { return None };
        self.starts = &self.starts[1..];
        let (count, size) = ((end - start) as usize, D * places(D));
        let (neighbours, others) = self.neighbours.split_at(count);
        let (values, rest) = self.values.split_at(count * size);
        let (own, after) = self.own.split_at(size);
        (self.neighbours, self.values, self.own) = (others, rest, after);
        Some(Row { neighbours, values, own, all: self.all })
    }
}

impl<const D: usize> Row<'_, D> {
    /// A velocity and what the impulses of the other contacts, `places` numbers each, add to it.
    #[inline(always)]
    pub fn pull<S: Simd>(&self, simd: S, velocity: &[f64; D], r: &[f64]) -> [f64; D] {
        self.pull_with(simd, velocity, r, None)
    }
    /// The same with what the impulse of the contact itself, the i-th, adds.
    #[inline(always)]
    fn pull_all<S: Simd>(&self, simd: S, velocity: &[f64; D], r: &[f64], i: usize) -> [f64; D] {
        self.pull_with(simd, velocity, r, Some((self.own, i)))
    }
    #[inline(always)]
    fn pull_with<S: Simd>(
        &self,
        simd: S,
        velocity: &[f64; D],
        r: &[f64],
        own: Option<(&[f64], usize)>,
    ) -> [f64; D] {
        let mut out = *velocity;
        let given = (self.values, self.neighbours);
        match D {
            3 => pull_in_space(simd, given, r, own, &mut out),
            2 => pull_in_the_plane(simd, given, r, own, &mut out),
            _ => {
                let own = own.map_or(0.0, |(block, i)| block[0] * r[i]);
                out[0] += own + pull_along_a_line(self.values, self.neighbours, self.all, r);
            }
        }
        out
    }
}

struct Velocities<'a, const D: usize> {
    rows: Rows<'a, D>,
    /// S, the unit matrix where it is not given, and q, zero where it is not.
    shares: Option<&'a [[f64; D]]>,
    given: Option<&'a [[f64; D]]>,
    r: &'a [f64],
    out: &'a mut [[f64; D]],
}

impl<const D: usize> WithSimd for Velocities<'_, D> {
    type Output = ();
    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Velocities { rows, shares, given, r, out } = self;
        for (i, (out, row)) in out.iter_mut().zip(rows).enumerate() {
            let pulled = row.pull_all(simd, &[0.0; D], r, i);
            let share = shares.map_or([1.0; D], |shares| shares[i]);
            let given = given.map_or([0.0; D], |given| given[i]);
            // q comes last: impulses so huge that they swallow it, and hold each other up, hide it otherwise
            for k in 0..D {
                out[k] = pulled[k] * share[k] + given[k];
            }
        }
    }
}

/// out = W r + q, impulses `places` numbers apart, for as many contacts as `out` has room for, at most those that the
/// rows are of.
pub fn velocities<const D: usize>(rows: Rows<'_, D>, q: &[[f64; D]], r: &[f64], out: &mut [[f64; D]]) {
    in_fours(Velocities { rows, shares: None, given: Some(q), r, out });
}

/// out = S W S x + q with S diagonal, q = 0 where none is given; `spaced` is memory.
pub fn scaled_velocities<const D: usize>(
    couplings: &Couplings,
    (shares, q): (&[[f64; D]], Option<&[[f64; D]]>),
    (x, spaced): (&[[f64; D]], &mut Vec<f64>),
    out: &mut [[f64; D]],
) {
    spaced.resize(shares.len() * places(D), 0.0);
    for ((spaced, x), shares) in spaced.chunks_exact_mut(places(D)).zip(x).zip(shares) {
        for k in 0..D {
            spaced[k] = x[k] * shares[k];
        }
    }
    in_fours(Velocities { rows: couplings.rows(0), shares: Some(shares), given: q, r: spaced, out });
}

/// Writes impulses `places` numbers apart.
pub fn spread<const D: usize>(r: &[[f64; D]], out: &mut [f64]) {
    out.chunks_exact_mut(places(D)).zip(r).for_each(|(out, r)| out[..D].copy_from_slice(r));
}

/// Impulses along a line that press on one; where all others do, in their order, those after it come first.
#[inline(always)]
fn pull_along_a_line(values: &[f64], neighbours: &[u32], all: bool, r: &[f64]) -> f64 {
    if all && let Some(&first) = neighbours.first() {
        let first = first as usize;
        let (after, before) = values.split_at(values.len().min(values.len() + 1 - first));
        return dot(after, &r[first..]) + dot(before, r);
    }
    values.iter().zip(neighbours).map(|(w, &j)| w * r[j as usize]).sum()
}

/// The sum of products of as many as there are of both: four sums, so that none waits for itself.
#[inline(always)]
pub fn dot(a: &[f64], b: &[f64]) -> f64 {
    let count = a.len().min(b.len());
    let ((a, last_a), (b, last_b)) = (a[..count].as_chunks::<4>(), b[..count].as_chunks::<4>());
    let mut sums = [0.0; 4];
    for (a, b) in a.iter().zip(b) {
        (0..4).for_each(|k| sums[k] += a[k] * b[k]);
    }
    let last: f64 = last_a.iter().zip(last_b).map(|(a, b)| a * b).sum();
    (sums[0] + sums[2]) + (sums[1] + sums[3]) + last
}

#[inline(always)]
fn pull_in_space<S: Simd>(
    simd: S,
    (values, neighbours): (&[f64], &[u32]),
    r: &[f64],
    own: Option<(&[f64], usize)>,
    out: &mut [f64],
) {
    let (blocks, _) = values.as_chunks::<SPATIAL>();
    let (r, _) = r.as_chunks::<4>();
    let own = own.map(|(block, i)| (&block.as_chunks::<SPATIAL>().0[0], &r[i]));
    if S::F64_LANES != 4 {
        let all = blocks.iter().zip(neighbours.iter().map(|&j| &r[j as usize]));
        for (block, x) in own.into_iter().chain(all) {
            for k in 0..3 {
                out[k] += block[k] * x[0] + block[4 + k] * x[1] + block[8 + k] * x[2];
            }
        }
        return;
    }
    let zero = simd.splat_f64s(0.0);
    let given = [out[0], out[1], out[2], 0.0];
    // three sums, so that none waits for itself
    let (mut first, mut second, mut third) = (S::as_simd_f64s(&given).0[0], zero, zero);
    if let Some((block, x)) = own {
        let columns = S::as_simd_f64s(block).0;
        first = simd.mul_add_f64s(columns[0], simd.splat_f64s(x[0]), first);
        second = simd.mul_f64s(columns[1], simd.splat_f64s(x[1]));
        third = simd.mul_f64s(columns[2], simd.splat_f64s(x[2]));
    }
    for (block, &j) in blocks.iter().zip(neighbours) {
        let x = &r[j as usize];
        let columns = S::as_simd_f64s(block).0;
        first = simd.mul_add_f64s(columns[0], simd.splat_f64s(x[0]), first);
        second = simd.mul_add_f64s(columns[1], simd.splat_f64s(x[1]), second);
        third = simd.mul_add_f64s(columns[2], simd.splat_f64s(x[2]), third);
    }
    let mut sum = [0.0; 4];
    S::as_mut_simd_f64s(&mut sum).0[0] = simd.add_f64s(simd.add_f64s(first, second), third);
    out.copy_from_slice(&sum[..3]);
}

#[inline(always)]
fn pull_in_the_plane<S: Simd>(
    simd: S,
    (values, neighbours): (&[f64], &[u32]),
    r: &[f64],
    own: Option<(&[f64], usize)>,
    out: &mut [f64],
) {
    let (blocks, _) = values.as_chunks::<4>();
    let (r, _) = r.as_chunks::<2>();
    let own = own.map(|(block, i)| (&block.as_chunks::<4>().0[0], &r[i]));
    if S::F64_LANES != 4 {
        let all = blocks.iter().zip(neighbours.iter().map(|&j| &r[j as usize]));
        for (block, x) in own.into_iter().chain(all) {
            out[0] += block[0] * x[0] + block[1] * x[1];
            out[1] += block[2] * x[0] + block[3] * x[1];
        }
        return;
    }
    let twice = |[a, b]: [f64; 2]| [a, b, a, b];
    let mut sum = simd.splat_f64s(0.0);
    if let Some((block, x)) = own {
        sum = simd.mul_f64s(S::as_simd_f64s(block).0[0], S::as_simd_f64s(&twice(*x)).0[0]);
    }
    for (block, &j) in blocks.iter().zip(neighbours) {
        let x = twice(r[j as usize]);
        sum = simd.mul_add_f64s(S::as_simd_f64s(block).0[0], S::as_simd_f64s(&x).0[0], sum);
    }
    let mut stored = [0.0; 4];
    S::as_mut_simd_f64s(&mut stored).0[0] = sum;
    out[0] += stored[0] + stored[1];
    out[1] += stored[2] + stored[3];
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::linear::Graph;

    struct Pull<'a, const D: usize>(&'a Couplings, usize, &'a [f64]);

    impl<const D: usize> WithSimd for Pull<'_, D> {
        type Output = [f64; D];
        #[inline(always)]
        fn with_simd<S: Simd>(self, simd: S) -> [f64; D] {
            self.0.rows(0).nth(self.1).expect("a contact").pull(simd, &[0.0; D], self.2)
        }
    }

    /// Four contacts in a chain, or each beside all others, with whole numbers, which leave no rounding.
    fn others_press_as_the_matrix_says<const D: usize>(reach: u32) {
        let (mut starts, mut neighbours) = (vec![0], Vec::new());
        for i in 0..4u32 {
            neighbours.extend(i.saturating_sub(reach)..(i + reach + 1).min(4));
            starts.push(neighbours.len() as u32);
        }
        let graph = Graph::new(vec![D as u32; 4], starts, neighbours);
        let values = (0..graph.values()).map(|k| (k * k % 17) as f64).collect();
        let matrix = Matrix::new(graph, values);
        let couplings = Couplings::of(&matrix);
        let impulse = |i: usize, k: usize| (3 * i + k) as f64;
        let mut r = vec![0.0; 4 * places(D)];
        (0..4).for_each(|i| (0..D).for_each(|k| r[i * places(D) + k] = impulse(i, k)));
        for i in 0..4 {
            let mut expected = [0.0; D];
            for k in matrix.graph.row(i) {
                let (j, at) = (matrix.graph.neighbours[k] as usize, matrix.graph.offsets[k] as usize);
                for e in (0..D * D).filter(|_| j != i) {
                    expected[e / D] += matrix.values[at + e] * impulse(j, e % D);
                }
            }
            assert_eq!(in_fours(Pull::<D>(&couplings, i, &r)), expected);
        }
        the_whole_row_presses_where_all_is_asked_for::<D>(&matrix, &couplings, &r);
    }

    /// W r + q, and the same between two diagonal matrices, of whole numbers again.
    fn the_whole_row_presses_where_all_is_asked_for<const D: usize>(
        matrix: &Matrix,
        couplings: &Couplings,
        r: &[f64],
    ) {
        let dense = r.chunks_exact(places(D)).map(|r| std::array::from_fn(|k| r[k]));
        let x: Vec<[f64; D]> = dense.chain([[0.0; D]]).collect();
        let numbers = |a: f64| -> Vec<[f64; D]> {
            (0..4).map(|i| std::array::from_fn(|k| a + (2 * i + k) as f64)).collect()
        };
        let (q, shares) = (numbers(1.0), numbers(3.0));
        let mut expected = vec![[0.0; D]; 4];
        crate::exact::row::product(matrix, &x, &mut expected);
        expected.iter_mut().zip(&q).for_each(|(e, q)| (0..D).for_each(|k| e[k] += q[k]));
        let mut out = vec![[0.0; D]; 4];
        velocities(couplings.rows(0), &q, r, &mut out);
        assert_eq!(out, expected);
        let times = |a: &[[f64; D]]| -> Vec<[f64; D]> {
            a.iter().zip(&shares).map(|(a, s)| std::array::from_fn(|k| a[k] * s[k])).collect()
        };
        let mut stretched = times(&x);
        stretched.push([0.0; D]);
        crate::exact::row::product(matrix, &stretched, &mut expected);
        let mut expected = times(&expected);
        let mut spaced = Vec::new();
        scaled_velocities(couplings, (&shares, None), (&x, &mut spaced), &mut out);
        assert_eq!(out, expected);
        expected.iter_mut().zip(&q).for_each(|(e, q)| (0..D).for_each(|k| e[k] += q[k]));
        scaled_velocities(couplings, (&shares, Some(&q)), (&x, &mut spaced), &mut out);
        assert_eq!(out, expected);
    }

    #[test]
    fn the_impulses_of_others_press_as_the_matrix_says() {
        for reach in [1, 3] {
            others_press_as_the_matrix_says::<1>(reach);
            others_press_as_the_matrix_says::<2>(reach);
            others_press_as_the_matrix_says::<3>(reach);
        }
    }
}
