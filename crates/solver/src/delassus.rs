//! The problem as matrices: J, M^-1, A = J M^-1 J^T and b = target - J v (theory chapter 5, items 28-32),
//! sparse, in compressed rows. For users' eyes, for the matrix solvers, for pictures of A's pattern.

use crate::prepared::Prepared;
use crate::problem::{ContactProblem, Impulses, Twist};
use carom_math::{Column, Inertia, Space};

/// A sparse matrix in compressed rows, columns ascending within a row.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Csr {
    /// Rows and columns.
    pub shape: (usize, usize),
    /// Start of each row in `indices` and `values`; one entry more than rows.
    pub starts: Vec<usize>,
    /// Column of each stored value.
    pub indices: Vec<usize>,
    /// The stored values.
    pub values: Vec<f64>,
}

impl Csr {
    /// A matrix from rows of (column, value) pairs; columns are sorted, repeated ones added up.
    pub fn from_rows(columns: usize, rows: impl Iterator<Item = Vec<(usize, f64)>>) -> Self {
        let mut m = Csr { shape: (0, columns), starts: vec![0], indices: Vec::new(), values: Vec::new() };
        for mut row in rows {
            row.sort_by_key(|e| e.0);
            for (j, x) in row {
                if m.indices.len() > m.starts[m.shape.0] && m.indices.last() == Some(&j) {
                    *m.values.last_mut().expect("an index has a value") += x;
                } else {
                    m.indices.push(j);
                    m.values.push(x);
                }
            }
            m.shape.0 += 1;
            m.starts.push(m.indices.len());
        }
        m
    }
    /// The stored entries of row `i`.
    pub fn row(&self, i: usize) -> impl Iterator<Item = (usize, f64)> + '_ {
        let range = self.starts[i]..self.starts[i + 1];
        self.indices[range.clone()].iter().copied().zip(self.values[range].iter().copied())
    }
    /// The product with a column vector.
    pub fn times(&self, x: &[f64]) -> Vec<f64> {
        (0..self.shape.0).map(|i| self.row(i).map(|(j, a)| a * x[j]).sum()).collect()
    }
    /// All entries, zeros included, row by row: for small problems and tests.
    pub fn dense(&self) -> Vec<Vec<f64>> {
        let mut rows = vec![vec![0.0; self.shape.1]; self.shape.0];
        for (i, dense) in rows.iter_mut().enumerate() {
            for (j, a) in self.row(i) {
                dense[j] += a;
            }
        }
        rows
    }
    /// Which entries are stored, as rows of text: '#' where there is one, '.' where not.
    pub fn pattern(&self) -> String {
        let mut text = String::new();
        for i in 0..self.shape.0 {
            let mut line = vec!['.'; self.shape.1];
            self.row(i).for_each(|(j, _)| line[j] = '#');
            text.extend(line);
            text.push('\n');
        }
        text
    }
}

fn push_twist<S: Space>(row: &mut Vec<(usize, f64)>, body: usize, t: &Twist<S>) {
    let base = body * S::DOF;
    row.extend(t.linear.as_slice().iter().enumerate().map(|(k, &x)| (base + k, x)));
    row.extend(t.angular.as_slice().iter().enumerate().map(|(k, &x)| (base + S::DIM + k, x)));
}

/// J: one row per scalar unknown, DOF columns per body (linear, then angular).
pub fn jacobian<S: Space>(problem: &ContactProblem<S>) -> Csr {
    let prepared = Prepared::of(problem);
    let rows = prepared.scalar_rows(&problem.inverse_masses).into_iter().map(|r| {
        let mut row = Vec::with_capacity(2 * S::DOF);
        push_twist(&mut row, r.a, &r.on_a);
        push_twist(&mut row, r.b, &r.on_b);
        row
    });
    Csr::from_rows(problem.inverse_masses.len() * S::DOF, rows.collect::<Vec<_>>().into_iter())
}

/// M^-1: block diagonal, DOF x DOF per body.
pub fn inverse_mass_matrix<S: Space>(problem: &ContactProblem<S>) -> Csr {
    let mut rows = Vec::with_capacity(problem.inverse_masses.len() * S::DOF);
    for (body, m) in problem.inverse_masses.iter().enumerate() {
        let base = body * S::DOF;
        for k in 0..S::DIM {
            rows.push(vec![(base + k, m.linear)]);
        }
        for k in 0..S::SPIN {
            let unit = S::Spin::from_fn(|i| if i == k { 1.0 } else { 0.0 });
            let column = m.angular.apply(unit); // symmetric: a column is a row
            rows.push((0..S::SPIN).map(|i| (base + S::DIM + i, column[i])).collect());
        }
    }
    Csr::from_rows(problem.inverse_masses.len() * S::DOF, rows.into_iter())
}

/// A = J M^-1 J^T: an entry for every two scalar rows that share a body that can move.
pub fn delassus<S: Space>(problem: &ContactProblem<S>) -> Csr {
    delassus_of(problem, &Prepared::of(problem))
}

/// The same with the rows already prepared.
pub fn delassus_of<S: Space>(problem: &ContactProblem<S>, prepared: &Prepared<S>) -> Csr {
    let rows = prepared.scalar_rows(&problem.inverse_masses);
    let mut touching: Vec<Vec<usize>> = vec![Vec::new(); problem.inverse_masses.len()];
    for (i, r) in rows.iter().enumerate() {
        for body in [r.a, r.b] {
            if !problem.inverse_masses[body].is_fixed() && touching[body].last() != Some(&i) {
                touching[body].push(i);
            }
        }
    }
    let entries = rows.iter().enumerate().map(|(i, r)| {
        let mut near: Vec<usize> = Vec::new();
        for body in [r.a, r.b] {
            near.extend_from_slice(&touching[body]);
        }
        near.sort_unstable();
        near.dedup();
        // formed in one order for both, so that A is symmetric to the last digit
        let coupling = |j: usize| rows[i.min(j)].coupling(&rows[i.max(j)]);
        near.into_iter().map(|j| (j, coupling(j))).collect()
    });
    Csr::from_rows(rows.len(), entries.collect::<Vec<_>>().into_iter())
}

/// b = target - J v over the scalar rows: A gamma - b = u - target.
pub fn right_hand_side<S: Space>(problem: &ContactProblem<S>) -> Vec<f64> {
    right_hand_side_of(problem, &Prepared::of(problem))
}

/// The same with the rows already prepared.
pub fn right_hand_side_of<S: Space>(problem: &ContactProblem<S>, prepared: &Prepared<S>) -> Vec<f64> {
    let mut b = prepared.velocity_errors(problem, &Impulses::zero(problem));
    b.iter_mut().for_each(|x| *x = -*x);
    b
}

/// Targets of all scalar rows.
pub fn targets<S: Space>(problem: &ContactProblem<S>) -> Vec<f64> {
    let mut all = Vec::with_capacity(problem.scalar_rows());
    for c in &problem.contacts {
        all.push(c.target);
        all.extend_from_slice(c.slip_target.as_slice());
    }
    all.extend(problem.rows.iter().map(|r| r.target));
    all.resize(problem.scalar_rows(), 0.0);
    all
}
