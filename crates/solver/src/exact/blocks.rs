//! A friction problem contact by contact: W, q and the coefficients of friction. Knows no method.

use super::couplings::Couplings;
use super::lane::{PACK, padded};
use super::operator::{Matrix, Operator};
use super::parts::Parts;
use crate::cone_matrix::norm_or_one;
use crate::friction_problem::FrictionProblem;
use std::ops::Range;
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
    /// All contacts.
    pub fn all(&self) -> Section<'_, D> {
        self.section(0..self.count())
    }
    /// Contacts that lie one after another.
    pub fn section(&self, contacts: Range<usize>) -> Section<'_, D> {
        Section { blocks: self, first: contacts.start, count: contacts.len() }
    }
    /// Largest entry of q, or 1 \[m/s\].
    pub fn largest_velocity(&self) -> f64 {
        self.all().largest_velocity()
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
        self.pad(0);
    }
    /// The same with its contacts part after part, and without the matrix, which has another order.
    pub fn read_parts(&mut self, problem: &FrictionProblem, parts: &Parts) {
        let made = problem.matrix.made(D);
        self.operator = Operator::default();
        self.couplings = Some(parts.couplings.clone());
        parts.gather(problem.velocity.as_chunks::<D>().0, &mut self.velocity);
        parts.gather(&problem.friction, &mut self.friction);
        parts.gather(&made.norms, &mut self.norms);
        self.diagonal.clear();
        self.diagonal.extend(parts.order.iter().map(|&i| made.matrix.diagonal_block(i as usize)));
        // registers read on behind the last contact of the last part
        self.pad(PACK);
    }
    /// One of these parts as a problem of its own, W given.
    pub fn part_alone(&self, contacts: Range<usize>, matrix: Arc<Matrix>) -> Self {
        let couplings = self.couplings.as_ref().map(|all| Arc::new(all.part(contacts.clone(), D)));
        let mut own = Blocks {
            operator: Operator::Matrix(matrix),
            couplings,
            velocity: self.velocity[contacts.clone()].to_vec(),
            friction: self.friction[contacts.clone()].to_vec(),
            norms: self.norms[contacts.clone()].to_vec(),
            diagonal: self.diagonal[contacts].to_vec(),
            by_contact: self.by_contact,
        };
        own.pad(0);
        own
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
        self.pad(0);
    }
    /// Reads the diagonal of the operator.
    pub fn read_diagonal(&mut self) {
        self.diagonal.clear();
        self.diagonal.extend((0..self.operator.count()).map(|i| self.operator.diagonal_block(i)));
    }
    /// What lanes read past the last contact, and so many contacts more.
    fn pad(&mut self, more: usize) {
        let places = padded(self.count() + more);
        self.velocity.resize(places, [0.0; D]);
        self.friction.resize(places, 0.0);
        self.norms.resize(places, 1.0);
    }
}

/// Contacts of a problem that lie one after another and that the others do not press on: all of them, mostly.
#[derive(Clone, Copy, Debug)]
pub struct Section<'a, const D: usize> {
    pub blocks: &'a Blocks<D>,
    pub first: usize,
    pub count: usize,
}

impl<'a, const D: usize> Section<'a, D> {
    /// Where its contacts lie.
    pub fn range(&self) -> Range<usize> {
        self.first..self.first + self.count
    }
    /// q from its first contact on: lanes read on behind the last \[m/s\].
    pub fn velocity(&self) -> &'a [[f64; D]] {
        &self.blocks.velocity[self.first..]
    }
    /// Coefficients of friction in the same way \[1\].
    pub fn friction(&self) -> &'a [f64] {
        &self.blocks.friction[self.first..]
    }
    /// Norms of the diagonal blocks in the same way \[1/kg\].
    pub fn norms(&self) -> &'a [f64] {
        &self.blocks.norms[self.first..]
    }
    /// Coupled pairs of its contacts, themselves among them, or what costs as much.
    pub fn pairs(&self) -> usize {
        match &self.blocks.couplings {
            Some(couplings) => couplings.count(self.range()) + self.count,
            None => self.blocks.operator.couplings(),
        }
    }
    /// Largest entry of q, or 1 \[m/s\].
    pub fn largest_velocity(&self) -> f64 {
        let largest =
            self.velocity()[..self.count].as_flattened().iter().fold(0.0_f64, |m, q| m.max(q.abs()));
        if largest > 0.0 { largest } else { 1.0 }
    }
    /// |q|^2 \[m^2/s^2\].
    pub fn squared_velocity(&self) -> f64 {
        let numbers = self.velocity()[..self.count].as_flattened();
        if self.blocks.couplings.is_some() {
            squared_length(numbers)
        } else {
            numbers.iter().map(|q| q * q).sum()
        }
    }
    /// What errors are shares of: |q|, or its largest entry when judged by contact; 1 for none \[m/s\].
    pub fn size(&self) -> f64 {
        if self.blocks.by_contact {
            return self.largest_velocity();
        }
        let squared = self.squared_velocity();
        if squared > 0.0 { squared.sqrt() } else { 1.0 }
    }
}
