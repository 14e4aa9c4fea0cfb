//! The errors that decide, as `measure` has them, cheaply: every stage is judged by these at every iterate.

use super::blocks::{Blocks, Section};
use super::cone::{dot, project, tangent};
use super::lane::{Lane, Sum, lanes, live, load};
use crate::registers::in_widest;
use pulp::{Simd, WithSimd};

/// The two natural-map errors of `Measure` \[1\].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Errors {
    /// With step 1.
    pub natural: f64,
    /// In velocity units.
    pub scaled: f64,
}

/// Share of a tolerance that errors may have.
pub const HAND: f64 = 0.9;

impl Default for Errors {
    fn default() -> Self {
        Errors { natural: f64::INFINITY, scaled: f64::INFINITY }
    }
}

impl Errors {
    /// One number: at or below the tolerance when both are good enough.
    pub fn worst(&self) -> f64 {
        let worst = self.natural.max(0.1 * self.scaled);
        if self.natural.is_nan() || self.scaled.is_nan() { f64::INFINITY } else { worst }
    }
    /// Solved at a tolerance, with a tenth in hand for what rounding and the last projection move.
    pub fn solves(&self, tolerance: f64) -> bool {
        self.worst() <= HAND * tolerance
    }
}

struct Judge<'a, const D: usize>(Section<'a, D>, &'a [[f64; D]], &'a [[f64; D]]);

impl<const D: usize> WithSimd for Judge<'_, D> {
    type Output = Errors;
    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> Errors {
        let Judge(section, r, u) = self;
        let (count, velocity, friction, norms) =
            (section.count, section.velocity(), section.friction(), section.norms());
        let zero = Lane::all(simd, 0.0);
        let (mut natural, mut scaled, mut size) = (Sum::default(), Sum::default(), Sum::default());
        let mut largest = zero;
        for first in (0..count).step_by(S::F64_LANES) {
            let mu = Lane::load(simd, &friction[first..]);
            let norm = Lane::load(simd, &norms[first..]);
            let (r, mut u) = (load(simd, r, first), load(simd, u, first));
            let q = load(simd, velocity, first);
            u[0] = mu.mul_add(tangent(u), u[0]);
            let live = live(simd, first, count);
            let one = live.like(1.0);
            let mut squares = [zero; 2];
            for (square, step) in squares.iter_mut().zip([one, one / norm]) {
                let nearest = project(lanes!(zero; k => r[k] - step * u[k]), mu);
                let off = lanes!(zero; k => r[k] - nearest[k]);
                *square = dot(off, off);
            }
            natural.add(first, live * squares[0]);
            let in_velocity = live * norm * norm * squares[1];
            // a NaN must survive: max would hide it, the sum does not
            largest = largest.max(in_velocity);
            scaled.add(first, in_velocity);
            size.add(first, live * dot(q, q));
        }
        if section.blocks.by_contact {
            let worst = largest.greatest().sqrt() / section.largest_velocity();
            let worst = if scaled.total().is_finite() { worst } else { f64::INFINITY };
            return Errors { natural: worst, scaled: worst };
        }
        let size = size.total().sqrt();
        let size = if size > 0.0 { size } else { 1.0 };
        Errors { natural: natural.total().sqrt() / size, scaled: scaled.total().sqrt() / size }
    }
}

/// Errors of impulses r with velocities u = W r + q.
pub fn errors<const D: usize>(blocks: &Blocks<D>, r: &[[f64; D]], u: &[[f64; D]]) -> Errors {
    errors_of(blocks.all(), r, u)
}

/// The same of some contacts, r and u from the first of them on; registers read on behind the last.
pub fn errors_of<const D: usize>(section: Section<'_, D>, r: &[[f64; D]], u: &[[f64; D]]) -> Errors {
    in_widest(Judge(section, r, u))
}
