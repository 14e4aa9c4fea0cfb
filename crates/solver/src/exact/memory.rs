//! Memory that outlives a solve, so that solves of one size after another ask the machine for none: buffers go back to
//! the pool, and what depends on the contact graph alone stands while the graph does. No number of one solve is read
//! by the next.

use super::blocks::Blocks;
use super::scaled::Scaled;
use super::step::Pair;
use super::sweeps::SweepMemory;
use super::system::System;
use crate::friction_solver::{Stage, StageList};

/// Vectors over contacts, and pairs of the interior point, that nobody uses at the moment.
#[derive(Clone, Debug, Default)]
pub struct Pool<const D: usize> {
    vectors: Vec<Vec<[f64; D]>>,
    pairs: Vec<Pair<D>>,
    numbers: Vec<Vec<f64>>,
}

impl<const D: usize> Pool<D> {
    /// A vector of n zeros.
    pub fn zeros(&mut self, n: usize) -> Vec<[f64; D]> {
        let mut vector = self.vectors.pop().unwrap_or_default();
        vector.clear();
        vector.resize(n, [0.0; D]);
        vector
    }
    /// A copy.
    pub fn copy(&mut self, of: &[[f64; D]]) -> Vec<[f64; D]> {
        let mut vector = self.vectors.pop().unwrap_or_default();
        vector.clear();
        vector.extend_from_slice(of);
        vector
    }
    /// Takes vectors back.
    pub fn give(&mut self, vectors: impl IntoIterator<Item = Vec<[f64; D]>>) {
        self.vectors.extend(vectors);
    }
    /// n zeros, one per contact.
    pub fn numbers(&mut self, n: usize) -> Vec<f64> {
        let mut numbers = self.numbers.pop().unwrap_or_default();
        numbers.clear();
        numbers.resize(n, 0.0);
        numbers
    }
    /// Takes numbers back.
    pub fn give_numbers(&mut self, numbers: Vec<f64>) {
        self.numbers.push(numbers);
    }
    /// A pair with any numbers in it.
    pub fn pair(&mut self) -> Pair<D> {
        self.pairs.pop().unwrap_or_default()
    }
    /// Takes a pair back.
    pub fn give_pair(&mut self, pair: Pair<D>) {
        self.pairs.push(pair);
    }
}

/// All memory of solves with D rows per contact.
#[derive(Clone, Debug, Default)]
pub struct Memory<const D: usize> {
    /// The problem.
    pub blocks: Blocks<D>,
    /// The scaled problem.
    pub scaled: Scaled<D>,
    /// The linear systems.
    pub system: System<D>,
    /// What sweeps need.
    pub sweeps: SweepMemory<D>,
    /// Everything else over contacts.
    pub pool: Pool<D>,
    /// The list of stages.
    pub stages: StageList,
}

impl<const D: usize> Memory<D> {
    /// The list of stages with so many sweeps in it.
    pub fn stages_after(&mut self, sweeps: usize) -> StageList {
        let mut stages = std::mem::take(&mut self.stages);
        stages.clear();
        stages.push(Stage { name: "sweeps", iterations: sweeps });
        stages
    }
}
