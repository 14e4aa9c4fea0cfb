//! What sweeps read of W: the blocks off the diagonal, row by row, laid out so that a row times the impulses runs in
//! registers of four without a sum across one. In space a block lies by columns of four, the fourth number zero, and
//! each number of an impulse is spread over a register; in the plane a block by rows fills one register.

use super::operator::Matrix;
use crate::registers::in_fours;
use pulp::{Simd, WithSimd};

/// Numbers that a block of three rows takes: three columns of four.
const SPATIAL: usize = 12;

/// The blocks of W off its diagonal.
#[derive(Clone, Debug, Default)]
pub struct Couplings {
    /// Start of each contact's neighbours; one entry more than contacts.
    starts: Vec<u32>,
    neighbours: Vec<u32>,
    values: Vec<f64>,
}

/// Numbers that sweeps keep of an impulse of so many directions.
pub const fn places(dimension: usize) -> usize {
    if dimension == 3 { 4 } else { dimension }
}

impl Couplings {
    /// Those of a matrix.
    pub fn of(matrix: &Matrix) -> Self {
        let (graph, d) = (&matrix.graph, matrix.dimension());
        let nodes = graph.nodes();
        let mut own = Couplings {
            starts: Vec::with_capacity(nodes + 1),
            neighbours: Vec::with_capacity(graph.neighbours.len() - nodes),
            values: Vec::with_capacity((graph.neighbours.len() - nodes) * d * places(d)),
        };
        own.starts.push(0);
        for i in 0..nodes {
            // what a sweep has just moved comes last: a sum waits for it, not after it
            let (row, own_place) = (graph.row(i), graph.position(i, i));
            let after = own_place.map_or(row.end, |at| at + 1)..row.end;
            let before = row.start..own_place.unwrap_or(row.end);
            for k in after.chain(before) {
                own.neighbours.push(graph.neighbours[k]);
                let block = &matrix.values[graph.offsets[k] as usize..][..d * d];
                if d == 3 {
                    (0..3).for_each(|c| own.values.extend([block[c], block[3 + c], block[6 + c], 0.0]));
                } else {
                    own.values.extend_from_slice(block);
                }
            }
            own.starts.push(own.neighbours.len() as u32);
        }
        own
    }
    /// What presses on each contact, one after another.
    #[inline(always)]
    pub fn rows<const D: usize>(&self) -> Rows<'_, D> {
        Rows { starts: &self.starts, neighbours: &self.neighbours, values: &self.values }
    }
}

/// The rows that are left.
pub struct Rows<'a, const D: usize> {
    starts: &'a [u32],
    neighbours: &'a [u32],
    values: &'a [f64],
}

/// What presses on one contact.
pub struct Row<'a, const D: usize> {
    neighbours: &'a [u32],
    values: &'a [f64],
}

impl<'a, const D: usize> Iterator for Rows<'a, D> {
    type Item = Row<'a, D>;
    #[inline(always)]
    fn next(&mut self) -> Option<Row<'a, D>> {
        let [start, end, ..] = *self.starts else { return None };
        self.starts = &self.starts[1..];
        let count = (end - start) as usize;
        let (neighbours, others) = self.neighbours.split_at(count);
        let (values, rest) = self.values.split_at(count * D * places(D));
        (self.neighbours, self.values) = (others, rest);
        Some(Row { neighbours, values })
    }
}

impl<const D: usize> Row<'_, D> {
    /// A velocity and what the impulses of the other contacts, `places` numbers each, add to it.
    #[inline(always)]
    pub fn pull<S: Simd>(&self, simd: S, velocity: &[f64; D], r: &[f64]) -> [f64; D] {
        let mut out = *velocity;
        let given = (self.values, self.neighbours);
        match D {
            3 => pull_in_space(simd, given, r, &mut out),
            2 => pull_in_the_plane(simd, given, r, &mut out),
            _ => {
                let mut sum = out[0];
                for (w, &j) in self.values.iter().zip(self.neighbours) {
                    sum += w * r[j as usize];
                }
                out[0] = sum;
            }
        }
        out
    }
}

struct Product<'a, const D: usize> {
    couplings: &'a Couplings,
    matrix: &'a Matrix,
    r: &'a [f64],
    out: &'a mut [[f64; D]],
}

impl<const D: usize> WithSimd for Product<'_, D> {
    type Output = ();
    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Product { couplings, matrix, r, out } = self;
        let own = matrix.diagonal.iter().zip(r.chunks_exact(places(D)));
        for (out, ((&at, own), row)) in out.iter_mut().zip(own.zip(couplings.rows::<D>())) {
            let block = &matrix.values[at as usize..][..D * D];
            *out = row.pull(simd, &[0.0; D], r);
            for k in 0..D {
                for c in 0..D {
                    out[k] += block[k * D + c] * own[c];
                }
            }
        }
    }
}

/// out = W r with the couplings of W; impulses lie `places` numbers apart.
pub fn product<const D: usize>(couplings: &Couplings, matrix: &Matrix, r: &[f64], out: &mut [[f64; D]]) {
    in_fours(Product { couplings, matrix, r, out });
}

/// Writes impulses `places` numbers apart.
pub fn spread<const D: usize>(r: &[[f64; D]], out: &mut [f64]) {
    out.chunks_exact_mut(places(D)).zip(r).for_each(|(out, r)| out[..D].copy_from_slice(r));
}

#[inline(always)]
fn pull_in_space<S: Simd>(simd: S, (values, neighbours): (&[f64], &[u32]), r: &[f64], out: &mut [f64]) {
    let (blocks, _) = values.as_chunks::<SPATIAL>();
    let (r, _) = r.as_chunks::<4>();
    if S::F64_LANES != 4 {
        for (block, &j) in blocks.iter().zip(neighbours) {
            let x = &r[j as usize];
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
fn pull_in_the_plane<S: Simd>(simd: S, (values, neighbours): (&[f64], &[u32]), r: &[f64], out: &mut [f64]) {
    let (blocks, _) = values.as_chunks::<4>();
    let (r, _) = r.as_chunks::<2>();
    if S::F64_LANES != 4 {
        for (block, &j) in blocks.iter().zip(neighbours) {
            let x = &r[j as usize];
            out[0] += block[0] * x[0] + block[1] * x[1];
            out[1] += block[2] * x[0] + block[3] * x[1];
        }
        return;
    }
    let mut sum = simd.splat_f64s(0.0);
    for (block, &j) in blocks.iter().zip(neighbours) {
        let [a, b] = r[j as usize];
        let twice = [a, b, a, b];
        sum = simd.mul_add_f64s(S::as_simd_f64s(block).0[0], S::as_simd_f64s(&twice).0[0], sum);
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
            self.0.rows().nth(self.1).expect("a contact").pull(simd, &[0.0; D], self.2)
        }
    }

    /// A chain of four contacts with whole numbers, which leave no rounding.
    fn others_press_as_the_matrix_says<const D: usize>() {
        let (mut starts, mut neighbours) = (vec![0], Vec::new());
        for i in 0..4u32 {
            neighbours.extend(i.saturating_sub(1)..(i + 2).min(4));
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
    }

    #[test]
    fn the_impulses_of_others_press_as_the_matrix_says() {
        others_press_as_the_matrix_says::<1>();
        others_press_as_the_matrix_says::<2>();
        others_press_as_the_matrix_says::<3>();
    }
}
