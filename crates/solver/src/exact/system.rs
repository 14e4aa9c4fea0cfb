//! The linear systems of all second-order steps: (W~ + D) dx = rhs with D block diagonal, not symmetric.

use super::scaled::Scaled;
use crate::linear::{Analysis, Factor};

/// Contact space: one node of the factorised graph per contact.
#[derive(Clone, Debug, Default)]
pub struct System<const D: usize> {
    analysis: Analysis,
    factor: Factor,
    /// W~ + D.
    values: Vec<f64>,
    /// D per contact, written by whoever asks for a factorisation; padded.
    pub blocks: Vec<[[f64; D]; D]>,
    /// Factorisations so far.
    pub factorisations: usize,
}

impl<const D: usize> System<D> {
    /// The system of a scaled problem.
    pub fn of(scaled: &Scaled<D>) -> Self {
        System {
            analysis: Analysis::new(&scaled.graph),
            factor: Factor::default(),
            values: scaled.values.clone(),
            blocks: vec![[[0.0; D]; D]; scaled.velocity.len()],
            factorisations: 0,
        }
    }
    /// Factorises W~ + D with the present `blocks`; false when it is singular.
    pub fn factorize(&mut self, scaled: &Scaled<D>) -> bool {
        self.factorisations += 1;
        for (block, &at) in self.blocks.iter().zip(&scaled.diagonal) {
            let at = at as usize;
            for (k, &d) in block.as_flattened().iter().enumerate() {
                self.values[at + k] = scaled.values[at + k] + d;
            }
        }
        self.factor.factorize(&self.analysis, &self.values)
    }
    /// Replaces rhs by dx; false when it is not finite.
    pub fn solve(&mut self, scaled: &Scaled<D>, x: &mut [[f64; D]]) -> bool {
        let used = &mut x[..scaled.count()];
        self.factor.solve(&self.analysis, used.as_flattened_mut());
        used.as_flattened().iter().all(|v| v.is_finite())
    }
}
