//! Equality rows and nothing else, the joints of bodies that touch nothing: a linear system,
//!   J M^-1 J^T lambda = target - J v,
//! symmetric and never negative, singular where rows repeat each other, as those of closed loops do. A Cholesky
//! factor inside the rows' envelope solves it, refined on the bodies; where a pivot vanishes the eigenvectors do, and of
//! all impulses that solve, the least are taken. Knows no contacts.

use crate::prepared::{Prepared, Row};
use crate::problem::{ContactProblem, Impulses};
use carom_math::Space;
use faer::{Mat, Side};

/// Pivots and eigenvalues below this, of a matrix with ones on its diagonal, are those of repeated rows \[1\].
const REPEATED: f64 = 1e-12;
/// Rounds of refinement; each takes away all but the share of rounding times the condition.
const ROUNDS: usize = 5;

/// True for problems that are equality rows and nothing else.
pub fn is_linear<S: Space>(problem: &ContactProblem<S>) -> bool {
    let free = |r: &crate::problem::BoundedRow<S>| r.lo == f64::NEG_INFINITY && r.hi == f64::INFINITY;
    problem.contacts.is_empty() && !problem.rows.is_empty() && problem.rows.iter().all(free)
}

/// Solves such a problem from nothing; returns the rounds taken.
pub fn solve_linear<S: Space>(
    problem: &ContactProblem<S>,
    prepared: &Prepared<S>,
    tolerance: f64,
    impulses: &mut Impulses<S>,
) -> usize {
    impulses.reset(problem);
    let rows = &prepared.rows;
    let scales: Vec<f64> = rows.iter().map(scale).collect();
    let system = match Envelope::factorised(problem, rows, &scales) {
        Some(factor) => System::Regular(factor),
        None => System::Singular(Eigen::of(rows, &scales)),
    };
    let mut error = f64::INFINITY;
    let mut best = impulses.clone();
    for round in 0..ROUNDS {
        let mut right = prepared.velocity_errors(problem, impulses);
        let largest = right.iter().fold(0.0, |m: f64, e| m.max(e.abs()));
        if !(largest < error) {
            impulses.copy_from(&best);
            return round;
        }
        best.copy_from(impulses);
        let slow = largest > 0.5 * error;
        error = largest;
        if largest <= 0.1 * tolerance || slow {
            return round;
        }
        right.iter_mut().zip(&scales).for_each(|(r, s)| *r *= -s);
        match &system {
            System::Regular(factor) => factor.solve(&mut right),
            System::Singular(eigen) => eigen.solve(&mut right),
        }
        impulses.rows.iter_mut().zip(&right).zip(&scales).for_each(|((l, x), s)| *l += x * s);
        if let System::Singular(eigen) = &system {
            eigen.lessen(&mut impulses.rows);
        }
    }
    ROUNDS
}

/// What makes a row's own entry of the matrix 1; rows that nothing moves keep theirs.
fn scale<S: Space>(row: &Row<S>) -> f64 {
    let own = row.inverse_effective_mass;
    if own > 0.0 { 1.0 / own.sqrt() } else { 1.0 }
}

enum System {
    Regular(Envelope),
    Singular(Eigen),
}

/// A lower triangular factor, each row stored from its first entry on.
struct Envelope {
    first: Vec<usize>,
    rows: Vec<Vec<f64>>,
}

impl Envelope {
    /// The factor of the scaled matrix; `None` where a pivot vanishes.
    fn factorised<S: Space>(problem: &ContactProblem<S>, rows: &[Row<S>], scales: &[f64]) -> Option<Self> {
        let mut factor =
            Envelope { first: first_entries(problem, rows), rows: Vec::with_capacity(rows.len()) };
        for i in 0..rows.len() {
            let first = factor.first[i];
            let entry = |j: usize| rows[i].coupling(&rows[j]) * scales[i] * scales[j];
            let mut line: Vec<f64> = (first..=i).map(entry).collect();
            for j in first..i {
                let from = first.max(factor.first[j]);
                let other = &factor.rows[j];
                let of = factor.first[j];
                let sum: f64 = (from..j).map(|k| line[k - first] * other[k - of]).sum();
                line[j - first] = (line[j - first] - sum) / other[j - of];
            }
            let sum: f64 = line[..i - first].iter().map(|x| x * x).sum();
            let pivot = line[i - first] - sum;
            if !(pivot > REPEATED) {
                return None;
            }
            line[i - first] = pivot.sqrt();
            factor.rows.push(line);
        }
        Some(factor)
    }

    fn solve(&self, x: &mut [f64]) {
        for i in 0..x.len() {
            let (first, line) = (self.first[i], &self.rows[i]);
            let sum: f64 = (first..i).map(|k| line[k - first] * x[k]).sum();
            x[i] = (x[i] - sum) / line[i - first];
        }
        for i in (0..x.len()).rev() {
            let (first, line) = (self.first[i], &self.rows[i]);
            x[i] /= line[i - first];
            for k in first..i {
                x[k] -= line[k - first] * x[i];
            }
        }
    }
}

/// For each row the first one that shares a body with it which impulses move.
fn first_entries<S: Space>(problem: &ContactProblem<S>, rows: &[Row<S>]) -> Vec<usize> {
    let mut first_of = vec![usize::MAX; problem.inverse_masses.len()];
    let of = |(i, row): (usize, &Row<S>)| {
        let mut first = i;
        for body in [row.a, row.b] {
            if !problem.inverse_masses[body].is_fixed() {
                first_of[body] = first_of[body].min(i);
                first = first.min(first_of[body]);
            }
        }
        first
    };
    rows.iter().enumerate().map(of).collect()
}

/// Eigenvectors of the scaled matrix: those that count with their values, and orthonormal directions of impulses that
/// move nothing.
struct Eigen {
    vectors: Vec<(f64, Vec<f64>)>,
    idle: Vec<Vec<f64>>,
}

impl Eigen {
    fn of<S: Space>(rows: &[Row<S>], scales: &[f64]) -> Self {
        let n = rows.len();
        let matrix = Mat::from_fn(n, n, |i, j| rows[i].coupling(&rows[j]) * scales[i] * scales[j]);
        let mut found = Eigen { vectors: Vec::new(), idle: Vec::new() };
        // a matrix with entries that are not finite has none: the impulses stay nothing, and the residual tells
        let Ok(eigen) = matrix.self_adjoint_eigen(Side::Lower) else { return found };
        let values = eigen.S().column_vector();
        let largest = (0..n).map(|k| values[k]).fold(0.0, f64::max);
        for k in 0..n {
            let vector: Vec<f64> = (0..n).map(|i| eigen.U()[(i, k)]).collect();
            if values[k] > REPEATED * largest {
                found.vectors.push((values[k], vector));
            } else {
                found.add_idle(vector.iter().zip(scales).map(|(x, s)| x * s).collect());
            }
        }
        found
    }

    fn add_idle(&mut self, mut direction: Vec<f64>) {
        for other in &self.idle {
            subtract_part(&mut direction, other);
        }
        let length = dot(&direction, &direction).sqrt();
        if length > 0.0 {
            direction.iter_mut().for_each(|x| *x /= length);
            self.idle.push(direction);
        }
    }

    fn solve(&self, x: &mut [f64]) {
        let mut sum = vec![0.0; x.len()];
        for (value, vector) in &self.vectors {
            let share = dot(vector, x) / value;
            sum.iter_mut().zip(vector).for_each(|(s, v)| *s += share * v);
        }
        x.copy_from_slice(&sum);
    }

    /// Takes the part of impulses away that moves nothing.
    fn lessen(&self, impulses: &mut [f64]) {
        self.idle.iter().for_each(|direction| subtract_part(impulses, direction));
    }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

fn subtract_part(x: &mut [f64], direction: &[f64]) {
    let part = dot(x, direction);
    x.iter_mut().zip(direction).for_each(|(x, d)| *x -= part * d);
}
