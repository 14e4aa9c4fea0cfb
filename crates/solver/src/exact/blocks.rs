//! A friction problem contact by contact: W, q and the coefficients of friction. Knows no method.

use super::couplings::Couplings;
use super::lane::padded;
use super::operator::Operator;
use crate::cone_matrix::norm_or_one;
use crate::friction_problem::FrictionProblem;
use std::sync::Arc;

/// u = W r + q in blocks.
#[derive(Clone, Debug, Default)]
pub struct Blocks<const D: usize> {
    /// W.
    pub operator: Operator<D>,
    /// Its blocks off the diagonal as sweeps read them; none where W is given by rows on bodies.
    pub couplings: Option<Arc<Couplings>>,
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

/// The products of all numbers with their partners added up in eight sums, for one would wait for itself.
pub fn product_of(a: &[f64], b: &[f64]) -> f64 {
    let ((a, a_rest), (b, b_rest)) = (a.as_chunks::<8>(), b.as_chunks::<8>());
    let mut sums = [0.0; 8];
    for (a, b) in a.iter().zip(b) {
        for k in 0..8 {
            sums[k] += a[k] * b[k];
        }
    }
    let rest: f64 = a_rest.iter().zip(b_rest).map(|(a, b)| a * b).sum();
    sums.iter().sum::<f64>() + rest
}

/// The squares of all numbers added up so.
pub fn squared_length(numbers: &[f64]) -> f64 {
    product_of(numbers, numbers)
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
    /// What errors are shares of: |q|, or its largest entry when judged by contact; 1 for none \[m/s\].
    pub fn size(&self) -> f64 {
        if self.by_contact {
            return self.largest_velocity();
        }
        let numbers = self.velocity.as_flattened();
        let squared: f64 = if self.couplings.is_some() {
            squared_length(numbers)
        } else {
            numbers.iter().map(|q| q * q).sum()
        };
        if squared > 0.0 { squared.sqrt() } else { 1.0 }
    }
    /// Blocks of a problem in matrix form.
    pub fn of(problem: &FrictionProblem) -> Self {
        let mut blocks = Blocks::default();
        blocks.read(problem);
        blocks
    }
    /// Becomes the blocks of a problem in matrix form.
    pub fn read(&mut self, problem: &FrictionProblem) {
        let made = problem.matrix.made(D);
        self.operator = Operator::Matrix(made.matrix.clone());
        self.couplings = Some(made.couplings.clone());
        let places = padded(problem.contacts());
        self.velocity.clear();
        self.velocity.reserve_exact(places);
        self.velocity.extend_from_slice(problem.velocity.as_chunks::<D>().0);
        self.friction.clear();
        self.friction.reserve_exact(places);
        self.friction.extend_from_slice(&problem.friction);
        self.norms.clear();
        self.norms.reserve_exact(places);
        self.norms.extend_from_slice(&made.norms);
        self.read_diagonal();
        self.pad();
    }
    /// Lets go of the matrix, which is the problem's.
    pub fn forget_matrix(&mut self) {
        self.operator = Operator::default();
        self.couplings = None;
    }
    /// What follows from operator, diagonal, velocity and friction.
    pub fn complete(&mut self) {
        self.norms.clear();
        self.norms.extend(self.diagonal.iter().map(|block| norm_or_one::<D>(block.as_flattened())));
        self.pad();
    }
    /// Reads the diagonal of the operator.
    pub fn read_diagonal(&mut self) {
        self.diagonal.clear();
        self.diagonal.extend((0..self.operator.count()).map(|i| self.operator.diagonal_block(i)));
    }
    /// What lanes read past the last contact.
    fn pad(&mut self) {
        let count = self.operator.count();
        self.velocity.resize(padded(count), [0.0; D]);
        self.friction.resize(padded(count), 0.0);
        self.norms.resize(padded(count), 1.0);
    }
}
