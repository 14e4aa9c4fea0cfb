//! A friction problem contact by contact: W, q and the coefficients of friction. Knows no method.

use super::lane::padded;
use super::operator::{Matrix, Operator};
use crate::cone_matrix::spectral_norm;
use crate::friction_problem::FrictionProblem;
use crate::linear::Graph;

/// u = W r + q in blocks.
#[derive(Clone, Debug)]
pub struct Blocks<const D: usize> {
    /// W.
    pub operator: Operator<D>,
    /// q per contact, padded to whole packs \[m/s\].
    pub velocity: Vec<[f64; D]>,
    /// Coefficients of friction, padded \[1\].
    pub friction: Vec<f64>,
    /// The diagonal blocks of W \[1/kg\].
    pub diagonal: Vec<[[f64; D]; D]>,
    /// Their spectral norms, padded with 1 \[1/kg\].
    pub norms: Vec<f64>,
    /// Judge by the largest error of a contact in m/s (over the largest velocity), not as `Measure` does.
    pub by_contact: bool,
}

impl<const D: usize> Blocks<D> {
    /// Number of contacts.
    pub fn count(&self) -> usize {
        self.diagonal.len()
    }
    /// Largest entry of q, or 1 \[m/s\].
    pub fn largest_velocity(&self) -> f64 {
        let largest = self.velocity.as_flattened().iter().fold(0.0_f64, |m, q| m.max(q.abs()));
        if largest > 0.0 { largest } else { 1.0 }
    }
    /// Row i of W r, the diagonal block left out where asked; W given by rows on bodies takes a whole product.
    pub fn row_times(&self, i: usize, r: &[[f64; D]], without_diagonal: bool) -> [f64; D] {
        match &self.operator {
            Operator::Matrix(m) => row_times(&m.graph, &m.values, i, r, without_diagonal),
            Operator::Bodies(rows) => {
                let (mut bodies, mut all) = (Vec::new(), vec![[0.0; D]; self.count()]);
                rows.product(r, &mut bodies, &mut all);
                let own = if without_diagonal { r[i] } else { [0.0; D] };
                for (value, row) in all[i].iter_mut().zip(&self.diagonal[i]) {
                    *value -= row.iter().zip(&own).map(|(w, r)| w * r).sum::<f64>();
                }
                all[i]
            }
        }
    }
    /// Blocks of a problem in matrix form.
    pub fn of(problem: &FrictionProblem) -> Self {
        let count = problem.contacts();
        let (starts, columns) = pattern(problem);
        let graph = Graph::new(vec![D as u32; count], starts, columns);
        let mut values = vec![0.0; graph.values()];
        for i in 0..count {
            let row = graph.row(i);
            for r in 0..D {
                let mut at = row.start;
                // stored zeros couple nothing
                for (column, x) in problem.matrix.row(D * i + r).filter(|e| e.1 != 0.0) {
                    if graph.neighbours[at] as usize != column / D {
                        at = graph.position(i, column / D).expect("the pattern holds every entry");
                    }
                    values[graph.offsets[at] as usize + r * D + column % D] += x;
                }
            }
        }
        let velocity = problem.velocity.chunks_exact(D).map(|q| std::array::from_fn(|k| q[k])).collect();
        Blocks::assembled(Operator::Matrix(Matrix::new(graph, values)), velocity, problem.friction.clone())
    }
    /// Blocks from their parts.
    pub fn assembled(operator: Operator<D>, mut velocity: Vec<[f64; D]>, mut friction: Vec<f64>) -> Self {
        let count = operator.count();
        let diagonal: Vec<[[f64; D]; D]> = (0..count).map(|i| operator.diagonal_block(i)).collect();
        let norm = |block: &[[f64; D]; D]| {
            let norm = spectral_norm::<D>(block.as_flattened());
            if norm > 0.0 { norm } else { 1.0 }
        };
        let mut norms: Vec<f64> = diagonal.iter().map(norm).collect();
        velocity.resize(padded(count), [0.0; D]);
        friction.resize(padded(count), 0.0);
        norms.resize(padded(count), 1.0);
        Blocks { operator, velocity, friction, diagonal, norms, by_contact: false }
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
