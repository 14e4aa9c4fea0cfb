//! Stage E: one curve followed through its folds, from a point that is known to a solution. With tau from 1 to 0,
//! y = W~ x + q~ + (1 - tau) |y_T| e_1 + tau c, x o y = tau m e_1, where c makes the start (x, y) = (a e_1, e_1) exact
//! and m = a. At tau = 1 the problem is convex with the start as its one solution, and where the problem is strictly
//! feasible the curve stays bounded: it can only end at tau = 0 (theory chapter 7). Where tau turns back the sign
//! of the determinant tells so, and steps go along the tangent.

use super::memory::Pool;
use super::newton::finish_far;
use super::scaled::Scaled;
use super::stage::{Solve, StageEnd};
use super::step::{Pair, centrality, direction, prepare, reach, take};
use super::system::System;
use super::way::Way;

/// Most points of the curve.
const POINTS: usize = 1000;
/// Least sqrt(det x_i det y_i) over their mean that a step along the tangent may leave.
const CENTRAL: f64 = 0.03;
/// Steps are predictor and corrector of an interior point where the way ahead is straight for so far.
const STRAIGHT: f64 = 0.6;
/// Distance from the curve, in the metric of the scaling over the root of m: above the first no step ahead is
/// taken, above the second a long step is taken back.
const NEAR: f64 = 1.0;
const FAR: f64 = 3.0;
/// Points without long steps after one was taken back.
const PATIENCE: usize = 3;
/// Impulses in units of the cone that end the search.
const HUGE: f64 = 1e13;
/// Errors from which the finisher is tried.
const CLOSE: f64 = 1e-2;

/// Where the curve starts and what it has come to.
struct Curve<const D: usize> {
    pair: Pair<D>,
    /// y - u at the start, as c above.
    offset: Vec<[f64; D]>,
    /// m at the start.
    start: f64,
    /// |y_T| -> sqrt(|y_T|^2 + (smoothing tau)^2) - smoothing tau.
    smoothing: f64,
    /// tau.
    share: f64,
    /// y - u - |y_T| e_1, and |y_T| smoothed, at the present point.
    residual: Vec<[f64; D]>,
    slip: Vec<f64>,
    /// The point before a long step that is not yet trusted.
    before: Option<Pair<D>>,
    /// Memory for one.
    spare: Pair<D>,
    /// The tangent, and a way back to the curve.
    ahead: Way<D>,
    back: Way<D>,
    /// Points to come without long steps.
    careful: usize,
}

/// Follows the curve with at most `most` factorisations. The iterate that it leaves in `x` is its own best.
pub fn follow<const D: usize>(
    solve: &mut Solve<'_, D>,
    (smoothing, most): (f64, usize),
    x: &mut [[f64; D]],
) -> StageEnd {
    let budget = solve.system.factorisations + most;
    solve.system.careful = true;
    let end = match Curve::begin(solve, smoothing) {
        Some(mut curve) => {
            let end = curve.run(solve, budget, x);
            curve.leave(&mut solve.pool);
            end
        }
        None => StageEnd::Stuck,
    };
    solve.system.careful = false;
    end
}

/// Share of the identity that stands for D in the estimate of the impulses.
const RIDGE: f64 = 1e-8;

/// The size of impulses that stop all motion: root mean square of -(W~ + ridge)^-1 q~. A start far below the
/// impulses of the solution makes the curve long.
fn impulse_size<const D: usize>(solve: &mut Solve<'_, D>) -> Option<f64> {
    let count = solve.scaled.count();
    let ridge = std::array::from_fn(|i| std::array::from_fn(|j| if i == j { RIDGE } else { 0.0 }));
    solve.system.blocks.fill(ridge);
    let mut x = solve.vector();
    for (x, q) in x.iter_mut().zip(&solve.scaled.velocity) {
        *x = q.map(|q| -q);
    }
    let solved = solve.system.factorize() && solve.system.solve(&solve.scaled, &mut x);
    let sum: f64 = x[..count].as_flattened().iter().map(|x| x * x).sum();
    solve.pool.give([x]);
    solved.then(|| (sum / count as f64).sqrt().max(1.0))
}

impl<const D: usize> Curve<D> {
    fn begin(solve: &mut Solve<'_, D>, smoothing: f64) -> Option<Self> {
        let size = impulse_size(solve)?;
        let mut pair = Pair::cold(&solve.scaled, size, &mut solve.pool);
        solve.scaled.velocities(&pair.x, &mut pair.u);
        let mut offset = solve.vector();
        for (offset, (y, u)) in offset.iter_mut().zip(pair.y.iter().zip(&pair.u)) {
            *offset = std::array::from_fn(|k| y[k] - u[k]);
        }
        let pool = &mut solve.pool;
        Some(Curve {
            residual: pool.copy(&offset),
            slip: pool.numbers(offset.len()),
            spare: pool.pair(),
            ahead: Way::new(pool),
            back: Way::new(pool),
            offset,
            start: size,
            smoothing,
            share: 1.0,
            pair,
            before: None,
            careful: 0,
        })
    }

    /// Gives the memory back.
    fn leave(self, pool: &mut Pool<D>) {
        pool.give([self.offset, self.residual]);
        pool.give_numbers(self.slip);
        self.ahead.leave(pool);
        self.back.leave(pool);
        [self.pair, self.spare].into_iter().chain(self.before).for_each(|pair| pool.give_pair(pair));
    }

    fn run(&mut self, solve: &mut Solve<'_, D>, budget: usize, best: &mut [[f64; D]]) -> StageEnd {
        let mut last = (f64::INFINITY, f64::INFINITY);
        let mut best_error = f64::INFINITY;
        for point in 0..POINTS {
            solve.scaled.velocities(&self.pair.x, &mut self.pair.u);
            // impulses so large hide velocities in rounding; only those of problems without a solution grow so
            if !self.pair.x.as_flattened().iter().all(|x| x.abs() < HUGE) {
                return StageEnd::Stuck;
            }
            let errors = solve.judge(&self.pair.x, &self.pair.u).worst();
            if errors < best_error {
                best_error = errors;
                best.copy_from_slice(&self.pair.x);
            }
            if errors <= 0.9 * solve.tolerance {
                return StageEnd::Solved;
            }
            if !solve.tell("path", point) {
                return StageEnd::Interrupted;
            }
            let m = self.pair.complementarity(solve.scaled.count());
            if errors < CLOSE && (errors < 0.2 * last.0 || m < 0.03 * last.1) {
                last = (errors, m);
                match finish_far(solve, &self.pair.x, 8) {
                    StageEnd::Stuck => {}
                    end => return end,
                }
            }
            if solve.spent() {
                return StageEnd::OutOfBudget;
            }
            if solve.system.factorisations >= budget || self.advance(solve, m).is_none() {
                return StageEnd::Stuck;
            }
        }
        StageEnd::Stuck
    }

    /// From one point to the next; nothing when the numbers end.
    fn advance(&mut self, solve: &mut Solve<'_, D>, m: f64) -> Option<()> {
        let (scaled, system) = (&solve.scaled, &mut solve.system);
        let count = scaled.count();
        self.look(scaled, system, m)?;
        let affine = self.toward(scaled, system, (0.0, false))?.min(1.0);
        self.ahead.take(&self.pair, count);
        let after = self.pair.complementarity_after(affine) / count as f64;
        let onward = system.determinant_sign();
        if onward < 0.0 && self.undo() {
            return Some(());
        }
        if self.careful > 0 {
            self.careful -= 1;
        } else if onward > 0.0 && affine > STRAIGHT {
            let sigma = (after.max(0.0) / m).powi(3).clamp(1e-8, 1.0);
            if let Some(length) = self.long_step(scaled, system, sigma) {
                self.remember();
                take(scaled, &mut self.pair, length);
                return self.pair.is_finite().then_some(());
            }
        }
        let length = self.tangent_step(scaled, system, onward)?;
        if length > 0.0 {
            take(scaled, &mut self.pair, length);
        }
        self.pair.is_finite().then_some(())
    }

    /// Scaling, residual and factors at the present point.
    fn look(&mut self, scaled: &Scaled<D>, system: &mut System<D>, m: f64) -> Option<()> {
        self.share = m / self.start;
        let smoothing = self.smoothing * self.share;
        let friction = (1.0 - self.share).max(0.0);
        prepare(scaled, &mut self.pair, (smoothing, friction), &mut system.blocks);
        self.residual.copy_from_slice(&self.pair.residual);
        for (slip, y) in self.slip.iter_mut().zip(&self.pair.y) {
            let tangent: f64 = y[1..].iter().map(|t| t * t).sum();
            *slip = (smoothing * smoothing + tangent).sqrt() - smoothing;
        }
        system.factorize().then_some(())
    }

    /// The direction to the point of the curve with this share of the present tau, and how far it goes.
    fn toward(
        &mut self,
        scaled: &Scaled<D>,
        system: &mut System<D>,
        (part, corrected): (f64, bool),
    ) -> Option<f64> {
        let kept = part * self.share;
        for i in 0..scaled.count() {
            for k in 0..D {
                let slip = if k == 0 { self.slip[i] } else { 0.0 };
                self.pair.residual[i][k] = self.residual[i][k] + kept * (slip - self.offset[i][k]);
            }
        }
        direction(scaled, &mut self.pair, kept * self.start, corrected);
        if !system.solve(scaled, &mut self.pair.dx) {
            return None;
        }
        let longest = reach(scaled, &mut self.pair);
        longest.is_finite().then_some(longest)
    }

    /// Keeps the present point until the step from it is trusted.
    fn remember(&mut self) {
        let mut kept = std::mem::take(&mut self.spare);
        kept.copy_from(&self.pair);
        self.trust();
        self.before = Some(kept);
    }

    /// Forgets the point before the last long step.
    fn trust(&mut self) {
        if let Some(before) = self.before.take() {
            self.spare = before;
        }
    }

    /// Goes back to the point before the last long step, if that is still in doubt.
    fn undo(&mut self) -> bool {
        let Some(before) = self.before.take() else { return false };
        self.spare = std::mem::replace(&mut self.pair, before);
        self.careful = PATIENCE;
        true
    }

    /// Length of a step of the interior point, where it goes far and brings what it promises; the present direction
    /// is the affine one.
    fn long_step(&mut self, scaled: &Scaled<D>, system: &mut System<D>, sigma: f64) -> Option<f64> {
        let count = scaled.count() as f64;
        let m = self.share * self.start;
        self.pair.keep_affine();
        let longest = self.toward(scaled, system, (sigma, true))?;
        let mut length = (0.9 * longest).min(1.0);
        while length > STRAIGHT && centrality(scaled, &self.pair, length) < 0.1 {
            length *= 0.8;
        }
        let left = self.pair.complementarity_after(length) / count / m;
        (length > STRAIGHT && left < 1.0 - 0.5 * length * (1.0 - sigma)).then_some(length)
    }

    /// Makes a step back to the curve, across the tangent, and ahead along it where the curve is near, the present
    /// direction; its length, 0 when a long step was taken back instead.
    fn tangent_step(&mut self, scaled: &Scaled<D>, system: &mut System<D>, onward: f64) -> Option<f64> {
        let count = scaled.count();
        self.toward(scaled, system, (1.0, false))?;
        self.back.take(&self.pair, count);
        let along = -self.back.dot(&self.ahead) / self.ahead.dot(&self.ahead);
        self.back.combine(1.0, &self.ahead, along, &mut self.pair);
        let across = reach(scaled, &mut self.pair);
        self.back.take(&self.pair, count);
        let off = self.back.largest() / (self.share * self.start).sqrt();
        if off > FAR && self.undo() {
            return Some(0.0);
        }
        if !(off < NEAR) {
            return Some((0.9 * across).min(1.0));
        }
        self.trust();
        self.ahead.combine(onward, &self.ahead, 0.0, &mut self.pair);
        let mut far = (0.7 * reach(scaled, &mut self.pair)).min(0.9);
        let mut length = 0.0;
        for _ in 0..10 {
            self.back.combine(1.0, &self.ahead, onward * far, &mut self.pair);
            length = (0.9 * reach(scaled, &mut self.pair)).min(1.0);
            if length >= 0.99 && centrality(scaled, &self.pair, length) >= CENTRAL {
                break;
            }
            far *= 0.6;
        }
        Some(length)
    }
}
