//! A friction problem as blocks: W in D x D blocks on a symmetric pattern. Knows no method.

use super::lane::padded;
use crate::cone_matrix::spectral_norm;
use crate::friction_problem::FrictionProblem;
use crate::linear::Graph;

/// u = W r + q in blocks.
#[derive(Clone, Debug, Default)]
pub struct Blocks<const D: usize> {
    /// Which contacts are coupled; every node has D scalars.
    pub graph: Graph,
    /// W's blocks, row by row, in the graph's order.
    pub values: Vec<f64>,
    /// Position of each diagonal block in the graph.
    pub diagonal: Vec<u32>,
    /// q per contact, padded to whole packs \[m/s\].
    pub velocity: Vec<[f64; D]>,
    /// Coefficients of friction, padded \[1\].
    pub friction: Vec<f64>,
    /// Spectral norms of the diagonal blocks, padded with 1 \[1/kg\].
    pub norms: Vec<f64>,
}

impl<const D: usize> Blocks<D> {
    /// Number of contacts.
    pub fn count(&self) -> usize {
        self.graph.nodes()
    }
    /// Blocks of a problem in matrix form.
    pub fn of(problem: &FrictionProblem) -> Self {
        let count = problem.contacts();
        let (starts, columns) = pattern(problem);
        let graph = Graph::new(vec![D as u32; count], starts, columns);
        let mut values = vec![0.0; graph.values()];
        for i in 0..count {
            for r in 0..D {
                // stored zeros couple nothing
                for (column, x) in problem.matrix.row(D * i + r).filter(|e| e.1 != 0.0) {
                    let at = graph.position(i, column / D).expect("the pattern holds every entry");
                    values[graph.offsets[at] as usize + r * D + column % D] += x;
                }
            }
        }
        let velocity = problem.velocity.chunks_exact(D).map(|q| std::array::from_fn(|k| q[k])).collect();
        Blocks::assembled(graph, values, velocity, problem.friction.clone())
    }
    /// Blocks from their parts.
    pub fn assembled(graph: Graph, values: Vec<f64>, velocity: Vec<[f64; D]>, friction: Vec<f64>) -> Self {
        let count = graph.nodes();
        let diagonal: Vec<u32> =
            (0..count).map(|i| graph.position(i, i).expect("every row holds its diagonal") as u32).collect();
        let mut blocks = Blocks { graph, values, diagonal, velocity, friction, norms: Vec::new() };
        blocks.norms = (0..count)
            .map(|i| {
                let norm = spectral_norm::<D>(blocks.diagonal_block(i));
                if norm > 0.0 { norm } else { 1.0 }
            })
            .collect();
        blocks.velocity.resize(padded(count), [0.0; D]);
        blocks.friction.resize(padded(count), 0.0);
        blocks.norms.resize(padded(count), 1.0);
        blocks
    }
    /// W_ii, row by row.
    pub fn diagonal_block(&self, i: usize) -> &[f64] {
        let at = self.graph.offsets[self.diagonal[i] as usize] as usize;
        &self.values[at..at + D * D]
    }
    /// The same numbers as an array.
    pub fn diagonal_matrix(&self, i: usize) -> [[f64; D]; D] {
        let block = self.diagonal_block(i);
        std::array::from_fn(|r| std::array::from_fn(|c| block[r * D + c]))
    }
    /// Row i of W r, the diagonal block left out where asked.
    #[inline(always)]
    pub fn row_times(&self, i: usize, r: &[[f64; D]], without_diagonal: bool) -> [f64; D] {
        row_times(&self.graph, &self.values, i, r, without_diagonal)
    }
}

/// Row i of a block matrix times x.
#[inline(always)]
pub fn row_times<const D: usize>(
    graph: &Graph,
    values: &[f64],
    i: usize,
    x: &[[f64; D]],
    without_diagonal: bool,
) -> [f64; D] {
    let mut sum = [0.0; D];
    let row = graph.row(i);
    let start = graph.offsets[row.start] as usize;
    let blocks = values[start..start + row.len() * D * D].chunks_exact(D * D);
    for (block, &j) in blocks.zip(&graph.neighbours[row]) {
        if without_diagonal && j as usize == i {
            continue;
        }
        let x = &x[j as usize];
        for (r, out) in sum.iter_mut().enumerate() {
            for k in 0..D {
                *out += block[r * D + k] * x[k];
            }
        }
    }
    sum
}

/// Block pattern of W, made symmetric, diagonal included.
fn pattern(problem: &FrictionProblem) -> (Vec<u32>, Vec<u32>) {
    let (d, count) = (problem.dimension, problem.contacts());
    let w = &problem.matrix;
    let mut rows: Vec<Vec<u32>> = (0..count as u32).map(|i| vec![i]).collect();
    let mut last = vec![u32::MAX; count];
    for i in 0..count {
        for row in d * i..d * i + d {
            for (column, x) in w.row(row) {
                let j = column / d;
                if x != 0.0 && j != i && last[j] != i as u32 {
                    last[j] = i as u32;
                    rows[i].push(j as u32);
                    rows[j].push(i as u32);
                }
            }
        }
    }
    let (mut starts, mut columns) = (vec![0], Vec::new());
    for row in &mut rows {
        row.sort_unstable();
        row.dedup();
        columns.extend_from_slice(row);
        starts.push(columns.len() as u32);
    }
    (starts, columns)
}
