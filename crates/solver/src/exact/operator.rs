//! W as an operator: blocks of a matrix, or contacts' rows on bodies, W = B B^T. The second knows no W at all: its
//! cost is linear in the contacts however many of them meet at one body.

use super::bodies::{NO_BODY, Rows};
use super::row;
use crate::linear::Graph;
use std::sync::Arc;

/// W in one of its two forms.
#[derive(Clone, Debug)]
pub enum Operator<const D: usize> {
    /// D x D blocks on a symmetric pattern.
    Matrix(Arc<Matrix>),
    /// Rows on bodies.
    Bodies(Rows<D>),
}

/// Blocks, row by row, in the graph's order.
#[derive(Clone, Debug, Default)]
pub struct Matrix {
    /// Which contacts are coupled.
    pub graph: Arc<Graph>,
    /// The blocks, and a zero after them, so that registers can read on.
    pub values: Vec<f64>,
    /// Where the diagonal blocks start in the values.
    pub diagonal: Arc<[u32]>,
}

impl Matrix {
    /// Rows per contact.
    pub fn dimension(&self) -> usize {
        self.graph.sizes.first().map_or(0, |&d| d as usize)
    }
    /// A matrix from its parts.
    pub fn new(graph: Graph, mut values: Vec<f64>) -> Self {
        values.push(0.0);
        let diagonal = (0..graph.nodes())
            .map(|i| graph.offsets[graph.position(i, i).expect("every row holds its diagonal")])
            .collect();
        Matrix { graph: Arc::new(graph), values, diagonal }
    }
    /// W_ii.
    pub fn diagonal_block<const D: usize>(&self, i: usize) -> [[f64; D]; D] {
        let block = &self.values[self.diagonal[i] as usize..][..D * D];
        std::array::from_fn(|r| std::array::from_fn(|c| block[r * D + c]))
    }
    /// Row i of blocks of one number: columns and values.
    #[inline(always)]
    pub fn row(&self, i: usize) -> (&[u32], &[f64]) {
        let stored = self.graph.row(i);
        (&self.graph.neighbours[stored.clone()], &self.values[stored])
    }
}

impl<const D: usize> Default for Operator<D> {
    fn default() -> Self {
        Operator::Bodies(Rows::default())
    }
}

impl<const D: usize> Operator<D> {
    /// Number of contacts.
    pub fn count(&self) -> usize {
        match self {
            Operator::Matrix(m) => m.graph.nodes(),
            Operator::Bodies(rows) => rows.pairs.len(),
        }
    }
    /// Coupled pairs of contacts, or what costs as much.
    pub fn couplings(&self) -> usize {
        match self {
            Operator::Matrix(m) => m.graph.neighbours.len(),
            Operator::Bodies(rows) => 8 * rows.pairs.len(),
        }
    }
    /// W_ii.
    pub fn diagonal_block(&self, i: usize) -> [[f64; D]; D] {
        match self {
            Operator::Matrix(m) => m.diagonal_block(i),
            Operator::Bodies(rows) => rows.own_block(i),
        }
    }
    /// out = W x; `bodies` is memory for B^T x.
    pub fn product(&self, x: &[[f64; D]], out: &mut [[f64; D]], bodies: &mut Vec<f64>) {
        match self {
            Operator::Matrix(m) => row::product(m, x, out),
            Operator::Bodies(rows) => rows.product(x, bodies, out),
        }
    }
    /// Becomes S W S with S diagonal; a zero in S uncouples its row.
    pub fn become_scaled(&mut self, of: &Self, stretch: &[[f64; D]]) {
        match of {
            Operator::Matrix(m) => self.become_scaled_matrix(m, stretch),
            Operator::Bodies(rows) => {
                if !matches!(self, Operator::Bodies(_)) {
                    *self = Operator::default();
                }
                let Operator::Bodies(own) = self else { return };
                own.copy_from(rows);
                let width = rows.freedoms;
                for (i, both) in own.values.chunks_exact_mut(2 * D * width).enumerate() {
                    for (k, row) in both.chunks_exact_mut(width).enumerate() {
                        row.iter_mut().for_each(|b| *b *= stretch[i][k % D]);
                    }
                }
            }
        }
    }
    /// The same of a matrix; its memory is used again where nobody else holds it.
    fn become_scaled_matrix(&mut self, of: &Matrix, stretch: &[[f64; D]]) {
        let kept = match self {
            Operator::Matrix(own) => Arc::get_mut(own).map(std::mem::take),
            Operator::Bodies(_) => None,
        };
        let mut values = kept.unwrap_or_default().values;
        values.clear();
        values.reserve_exact(of.values.len());
        for (i, own) in stretch.iter().enumerate() {
            for k in of.graph.row(i) {
                let other = &stretch[of.graph.neighbours[k] as usize];
                let (at, mut scaled) = (of.graph.offsets[k] as usize, [[0.0; D]; D]);
                for r in 0..D {
                    for c in 0..D {
                        scaled[r][c] = of.values[at + r * D + c] * (own[r] * other[c]);
                    }
                }
                values.extend_from_slice(scaled.as_flattened());
            }
        }
        values.push(0.0);
        let (graph, diagonal) = (of.graph.clone(), of.diagonal.clone());
        *self = Operator::Matrix(Arc::new(Matrix { graph, values, diagonal }));
    }
    /// The blocks of W; `None` when there would be more than `most` of them.
    pub fn matrix(&self, most: usize) -> Option<Arc<Matrix>> {
        match self {
            Operator::Matrix(m) => Some(m.clone()),
            Operator::Bodies(rows) => assembled(rows, most).map(Arc::new),
        }
    }
}

/// W = B B^T, block by block.
fn assembled<const D: usize>(rows: &Rows<D>, most: usize) -> Option<Matrix> {
    let touching = Touching::of(rows);
    let blocks = touching.blocks();
    if blocks > most {
        return None;
    }
    let mut starts = Vec::with_capacity(rows.pairs.len() + 1);
    let mut neighbours = Vec::with_capacity(blocks);
    starts.push(0u32);
    for (i, pair) in rows.pairs.iter().enumerate() {
        let [one, other] = pair.map(|b| touching.of_body(b));
        match (one, other) {
            ([], []) => neighbours.push(i as u32),
            (one, other) => merge(one, other, &mut neighbours),
        }
        starts.push(neighbours.len() as u32);
    }
    let graph = Graph::new(vec![D as u32; rows.pairs.len()], starts, neighbours);
    let values = vec![0.0; graph.values()];
    let mut matrix = Matrix::new(graph, values);
    assemble(rows, &mut matrix);
    Some(matrix)
}

/// The contacts of each body, ascending, one body after another.
struct Touching {
    starts: Vec<u32>,
    contacts: Vec<u32>,
}

impl Touching {
    fn of<const D: usize>(rows: &Rows<D>) -> Self {
        let bodies = |pair: &[u32; 2]| pair.map(|b| if b == NO_BODY { None } else { Some(b as usize) });
        let mut starts = vec![0u32; rows.bodies + 2];
        rows.pairs.iter().flat_map(bodies).flatten().for_each(|b| starts[b + 2] += 1);
        for b in 2..starts.len() {
            starts[b] += starts[b - 1];
        }
        // filling moves each start, one place further on, to where the next body's is
        let mut contacts = vec![0u32; starts[rows.bodies + 1] as usize];
        for (i, pair) in rows.pairs.iter().enumerate() {
            for b in bodies(pair).into_iter().flatten() {
                contacts[starts[b + 1] as usize] = i as u32;
                starts[b + 1] += 1;
            }
        }
        Touching { starts, contacts }
    }
    /// Coupled pairs, those of two bodies twice.
    fn blocks(&self) -> usize {
        self.starts.windows(2).map(|s| ((s[1] - s[0]) as usize).pow(2)).sum()
    }
    fn of_body(&self, body: u32) -> &[u32] {
        let start = |b: u32| self.starts[b as usize] as usize;
        if body == NO_BODY { &[] } else { &self.contacts[start(body)..start(body + 1)] }
    }
}

/// Appends the union of two ascending lists, ascending.
fn merge(one: &[u32], other: &[u32], out: &mut Vec<u32>) {
    let (mut i, mut j) = (0, 0);
    while let (Some(&a), Some(&b)) = (one.get(i), other.get(j)) {
        out.push(a.min(b));
        i += usize::from(a <= b);
        j += usize::from(b <= a);
    }
    out.extend_from_slice(&one[i..]);
    out.extend_from_slice(&other[j..]);
}

/// Writes the blocks of W = B B^T into a matrix of their pattern.
pub fn assemble<const D: usize>(rows: &Rows<D>, matrix: &mut Matrix) {
    let graph = &matrix.graph;
    for i in 0..graph.nodes() {
        for k in graph.row(i) {
            let block = rows.coupling(i, graph.neighbours[k] as usize);
            matrix.values[graph.offsets[k] as usize..][..D * D].copy_from_slice(block.as_flattened());
        }
    }
}

#[cfg(test)]
mod tests {
    use super::merge;

    #[test]
    fn the_union_of_lists_is_ascending_and_names_nobody_twice() {
        let union = |one: &[u32], other: &[u32]| {
            let mut out = vec![9];
            merge(one, other, &mut out);
            out[1..].to_vec()
        };
        assert_eq!(union(&[1, 3, 5], &[0, 3, 4, 7]), [0, 1, 3, 4, 5, 7]);
        assert_eq!(union(&[2], &[]), [2]);
        assert_eq!(union(&[], &[2, 6]), [2, 6]);
    }
}
