//! What the factorising stages share: the problem, its system, the best iterate so far and the budget.

use super::analyses::Analyses;
use super::blocks::Blocks;
use super::cone::{dot, natural_map, newton_block, project};
use super::judge::Errors;
use super::lane::{Lane, Lanes, Sum, lanes, live, load, store};
use super::memory::{Memory, Pool};
use super::scaled::Scaled;
use super::system::System;
use crate::impulse_solver::Content;
use crate::registers::in_widest;
use crate::watch::{Progress, Watch};
use pulp::{Simd, WithSimd};

/// Why a stage ended.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum StageEnd {
    /// The errors of the best iterate are small enough.
    Solved,
    /// The stage gets no further.
    Stuck,
    /// The factorisations are spent.
    OutOfBudget,
    /// Whoever watched asked to stop.
    Interrupted,
}

/// A solve in progress.
pub struct Solve<'a, const D: usize> {
    pub blocks: &'a Blocks<D>,
    pub scaled: Scaled<D>,
    pub system: System<D>,
    pub tolerance: f64,
    /// Most factorisations.
    pub budget: usize,
    /// What will do after how many factorisations; its tolerance is in the measure of `tolerance`.
    pub content: Option<Content>,
    /// Solutions are taken well below the tolerance.
    pub polish: bool,
    /// The best iterate of all stages, in the units of the cone, and its errors.
    pub best: Vec<[f64; D]>,
    pub best_errors: Errors,
    /// Vectors for all stages.
    pub pool: Pool<D>,
    pub watch: &'a mut Watch<'a>,
}

impl<'a, const D: usize> Solve<'a, D> {
    /// A solve that has no iterate yet.
    pub fn of(
        blocks: &'a Blocks<D>,
        (tolerance, budget): (f64, usize),
        (analyses, memory): (&mut Analyses, &mut Memory<D>),
        watch: &'a mut Watch<'a>,
    ) -> Self {
        let Memory { scaled, system, pool, .. } = memory;
        let (mut scaled, mut system) = (std::mem::take(scaled), std::mem::take(system));
        let mut pool = std::mem::take(pool);
        scaled.update(blocks);
        system.update(&scaled, analyses);
        let best = pool.zeros(scaled.velocity.len());
        let best_errors = Errors::default();
        let (content, polish) = (None, false);
        Solve { blocks, scaled, system, tolerance, budget, content, polish, best, best_errors, pool, watch }
    }
    /// Gives the memory back.
    pub fn leave(self, memory: &mut Memory<D>) {
        memory.scaled = self.scaled;
        memory.scaled.forget_couplings();
        memory.system = self.system;
        memory.system.let_go(&memory.scaled.operator);
        memory.pool = self.pool;
        memory.pool.give([self.best]);
    }
}

impl<const D: usize> Solve<'_, D> {
    /// A vector of zeros over contacts, padded to whole packs.
    pub fn vector(&mut self) -> Vec<[f64; D]> {
        self.pool.zeros(self.scaled.velocity.len())
    }
    /// Several of them.
    pub fn vectors<const N: usize>(&mut self) -> [Vec<[f64; D]>; N] {
        std::array::from_fn(|_| self.vector())
    }
    /// Judges an iterate with u = W~ x + q~ and keeps it when it is the best.
    pub fn judge(&mut self, x: &[[f64; D]], u: &[[f64; D]]) -> Errors {
        let errors = self.scaled.errors(self.blocks, x, u);
        if errors.worst() < self.best_errors.worst() {
            self.best_errors = errors;
            self.best.clear();
            self.best.extend_from_slice(x);
        }
        errors
    }
    /// True when no factorisation is left, or so many are spent that what there is will do.
    pub fn spent(&self) -> bool {
        let spent = self.system.factorisations;
        let will_do = |c: Content| spent >= c.after && self.best_errors.solves(c.tolerance);
        spent >= self.budget || self.content.is_some_and(will_do)
    }
    /// Tells the progress; false when asked to stop.
    pub fn tell(&mut self, stage: &'static str, iterations: usize) -> bool {
        let residual = self.best_errors.worst();
        (self.watch)(&Progress { stage, iterations, residual })
    }
}

struct NaturalSize<'a, const D: usize>(&'a Scaled<D>, &'a [[f64; D]], &'a [[f64; D]]);

impl<const D: usize> WithSimd for NaturalSize<'_, D> {
    type Output = f64;
    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> f64 {
        let NaturalSize(scaled, x, u) = self;
        let count = scaled.count();
        let mut sum = Sum::default();
        for first in (0..count).step_by(S::F64_LANES) {
            let rho = Lane::load(simd, &scaled.step[first..]);
            let map = natural_map(load(simd, x, first), load(simd, u, first), rho);
            sum.add(first, live(simd, first, count) * dot(map, map) / (rho * rho));
        }
        sum.total().sqrt()
    }
}

/// Size of the natural map in velocity units, contacts taken together.
pub fn natural_size<const D: usize>(scaled: &Scaled<D>, x: &[[f64; D]], u: &[[f64; D]]) -> f64 {
    in_widest(NaturalSize(scaled, x, u))
}

struct NewtonRows<'a, const D: usize> {
    scaled: &'a Scaled<D>,
    x: &'a [[f64; D]],
    u: &'a [[f64; D]],
    /// Shift of D: a number of its own, and a share of 1 / rho.
    shift: (f64, f64),
    blocks: &'a mut [[[f64; D]; D]],
    rhs: &'a mut [[f64; D]],
}

impl<const D: usize> WithSimd for NewtonRows<'_, D> {
    type Output = ();
    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        for first in (0..self.scaled.count()).step_by(S::F64_LANES) {
            let rho = Lane::load(simd, &self.scaled.step[first..]);
            let shift = rho.like(self.shift.0) + rho.like(self.shift.1) / rho;
            let (x, u) = (load(simd, self.x, first), load(simd, self.u, first));
            let (block, rhs) = newton_block(x, u, (rho, shift, self.scaled.least));
            store_block(block, self.blocks, first);
            store(rhs, self.rhs, first);
        }
    }
}

/// Writes D and the right-hand side of the Newton step on the natural map at x.
pub fn newton_rows<const D: usize>(
    scaled: &Scaled<D>,
    (x, u): (&[[f64; D]], &[[f64; D]]),
    shift: (f64, f64),
    (blocks, rhs): (&mut [[[f64; D]; D]], &mut [[f64; D]]),
) {
    in_widest(NewtonRows { scaled, x, u, shift, blocks, rhs });
}

/// Stores blocks of consecutive contacts.
#[inline(always)]
pub fn store_block<S: Simd, const D: usize>(
    block: [[Lane<S>; D]; D],
    blocks: &mut [[[f64; D]; D]],
    first: usize,
) {
    let blocks = &mut blocks[first..first + S::F64_LANES];
    for i in 0..D {
        for j in 0..D {
            let mut row = [0.0; super::lane::PACK];
            block[i][j].store(&mut row);
            for (value, block) in row.iter().zip(blocks.iter_mut()) {
                block[i][j] = *value;
            }
        }
    }
}

struct Advance<'a, const D: usize>(&'a [[f64; D]], &'a [[f64; D]], f64, &'a mut [[f64; D]]);

impl<const D: usize> WithSimd for Advance<'_, D> {
    type Output = ();
    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Advance(x, dx, step, out) = self;
        let step = Lane::all(simd, step);
        for first in (0..x.len()).step_by(S::F64_LANES) {
            let (a, d): (Lanes<S, D>, Lanes<S, D>) = (load(simd, x, first), load(simd, dx, first));
            let moved = lanes!(step; k => step.mul_add(d[k], a[k]));
            store(project(moved, step.like(1.0)), out, first);
        }
    }
}

/// out = P_L(x + step dx).
pub fn advance<const D: usize>(x: &[[f64; D]], dx: &[[f64; D]], step: f64, out: &mut [[f64; D]]) {
    in_widest(Advance(x, dx, step, out));
}
