//! In which order many sweeps take the contacts, and how these lie: in packs where W is given by rows on bodies, as they
//! come where it is a matrix.

use super::blocks::Blocks;
use super::local::Local;
use super::operator::Operator;
use super::packs::Packs;
use super::sweeps::{locals, sweep, sweep_price};

/// The order, and what the solutions of single contacts need in it.
pub enum Order<const D: usize> {
    /// Eight at a time.
    Packed(Packs<D>),
    /// One after another.
    Given(Vec<Local<D>>),
}

impl<const D: usize> Order<D> {
    /// That of a problem.
    pub fn of(blocks: &Blocks<D>) -> Self {
        match &blocks.operator {
            Operator::Bodies(rows) => Order::Packed(Packs::of(blocks, rows)),
            Operator::Matrix(_) => Order::Given(locals(blocks)),
        }
    }
    /// A vector over contacts as it lies here.
    pub fn spread(&self, r: &[[f64; D]]) -> Vec<f64> {
        match self {
            Order::Packed(packs) => packs.spread(r),
            Order::Given(_) => r.as_flattened().to_vec(),
        }
    }
    /// Puts one back.
    pub fn collect(&self, own: &[f64], r: &mut [[f64; D]]) {
        match self {
            Order::Packed(packs) => packs.collect(own, r),
            Order::Given(_) => r.as_flattened_mut().copy_from_slice(own),
        }
    }
    /// Makes room in B^T r for what sweeps need beside it.
    pub fn seat(&self, bodies: &mut Vec<f64>) {
        if let Order::Packed(packs) = self {
            packs.seat(bodies);
        }
    }
    /// One sweep over impulses as they lie here, with B^T r beside them.
    pub fn sweep(&mut self, blocks: &Blocks<D>, r: &mut [f64], bodies: &mut [f64]) {
        match self {
            Order::Packed(packs) => packs.sweep(blocks, r, bodies),
            Order::Given(locals) => {
                sweep(blocks, locals, r.as_chunks_mut().0, bodies);
            }
        }
    }
}

/// Nanoseconds of a sweep in packs per contact of 1, 2 and 3 directions.
const PACKED: [f64; 3] = [10.0, 12.0, 22.0];

/// What a sweep takes in its order, from sizes alone \[ns\]; packs that are not full take as long.
pub fn price<const D: usize>(blocks: &Blocks<D>) -> f64 {
    match &blocks.operator {
        Operator::Bodies(_) => PACKED[D - 1] * blocks.velocity.len() as f64,
        Operator::Matrix(_) => sweep_price(blocks),
    }
}
