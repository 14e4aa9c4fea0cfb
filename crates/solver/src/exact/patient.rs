//! Stage F: many sweeps, for what no factorisation brings nearer. Where the path folds again and again, as in heaps and in walls
//! that are sheared, sweeps still go down, slowly: along conjugate directions, and where these lead nowhere by mixing the
//! last changes, in turns (`onward.rs`); with Newton from where they are near. Where a bout of them is cheap next to
//! factorisations they come first (theory chapter 7).

use super::blocks::Blocks;
use super::memory::Pool;
use super::newton::finish;
use super::onward::{Conjugate, Mixture, Point};
use super::operator::Operator;
use super::order::{Order, price};
use super::stage::{Solve, StageEnd};
use super::sweeps::velocities;

/// Sweeps of a bout.
const BOUT: usize = 1024;
/// Sweeps after which the errors are measured, and how many of them are plain: conjugate directions leave errors of
/// single contacts that a few plain sweeps take away, mixtures smaller ones.
const ROUND: usize = 128;
const PLAIN: usize = 32;
const PLAIN_AFTER_MIXTURES: usize = 16;
/// Sweeps that one mixture follows.
const MIXED: usize = 16;
/// A bout leads on when it brings the errors below this share.
const FALL: f64 = 0.8;
/// Bouts in a row that may lead nowhere: as many as take so long as a patience in factorisations, but no fewer and no more than these.
const FRUITLESS: [usize; 2] = [3, 8];
/// Errors from which Newton is tried, and again once they have fallen to this share.
const NEAR: f64 = 1e-5;
const NEARER: f64 = 0.1;
/// Most Newton steps of a try.
const STEPS: usize = 8;

/// Sweeps in progress.
struct Bouts<const D: usize> {
    order: Order<D>,
    /// The diagonal of W, as the order has it.
    weights: Vec<f64>,
    at: Point,
    /// Where a map of sweeps began.
    from: Point,
    conjugate: Conjugate,
    mixture: Mixture,
    /// Impulses and velocities, for judging.
    r: Vec<[f64; D]>,
    u: Vec<[f64; D]>,
    /// The best iterate here, in units of the cone, and its error.
    best: Vec<[f64; D]>,
    best_error: f64,
}

/// Factorisations that take as long as a bout.
fn bout_price<const D: usize>(solve: &Solve<'_, D>) -> f64 {
    BOUT as f64 * price(solve.blocks) / solve.system.price()
}

/// True where a bout takes no longer than so many factorisations on bodies, or on a matrix.
pub fn is_cheap<const D: usize>(solve: &Solve<'_, D>, [on_bodies, on_matrix]: [f64; 2]) -> bool {
    let most = match &solve.blocks.operator {
        Operator::Bodies(_) => on_bodies,
        Operator::Matrix(_) => on_matrix,
    };
    bout_price(solve) <= most
}

/// Sweeps from x, and leaves their best iterate there: no longer than `worth` factorisations take, at most so many, and until
/// they have led nowhere for about `patience` factorisations. They depend on the order of the contacts. How they ended, and how many they were.
pub fn patient<const D: usize>(
    solve: &mut Solve<'_, D>,
    (worth, most, patience): (usize, usize, f64),
    x: &mut [[f64; D]],
) -> (StageEnd, usize) {
    let left = worth.min(solve.budget.saturating_sub(solve.system.factorisations));
    let bouts = (left as f64 / bout_price(solve)) as usize;
    let [fewest, longest] = FRUITLESS;
    let patience = ((patience / bout_price(solve)) as usize).clamp(fewest, longest);
    let mut sweeping = Bouts::begin(solve, x);
    let end = sweeping.run(solve, bouts.min(most / BOUT), patience);
    x.copy_from_slice(&sweeping.best);
    sweeping.leave(&mut solve.pool);
    end
}

impl<const D: usize> Bouts<D> {
    fn begin(solve: &mut Solve<'_, D>, x: &[[f64; D]]) -> Self {
        let [mut r, mut u, mut diagonal] = solve.vectors();
        solve.scaled.to_impulses(x, &mut r);
        for (own, block) in diagonal.iter_mut().zip(&solve.blocks.diagonal) {
            *own = std::array::from_fn(|k| block[k][k]);
        }
        let order = Order::of(solve.blocks);
        let mut bodies = Vec::new();
        velocities(solve.blocks, &r, &mut u, &mut bodies);
        order.seat(&mut bodies);
        let (at, weights) = (Point { r: order.spread(&r), bodies }, order.spread(&diagonal));
        solve.pool.give([diagonal]);
        let best = solve.pool.copy(x);
        Bouts {
            order,
            weights,
            from: at.clone(),
            at,
            conjugate: Conjugate::default(),
            mixture: Mixture::default(),
            r,
            u,
            best,
            best_error: f64::INFINITY,
        }
    }

    /// Gives the memory back.
    fn leave(self, pool: &mut Pool<D>) {
        pool.give([self.r, self.u, self.best]);
    }

    fn run(&mut self, solve: &mut Solve<'_, D>, most: usize, patience: usize) -> (StageEnd, usize) {
        let (mut conjugate, mut fruitless, mut spent) = (true, 0, 0);
        let mut last_try = f64::INFINITY;
        let mut x = solve.vector();
        let mut end = StageEnd::Stuck;
        for _ in 0..most {
            let before = self.best_error;
            let (over, errors) = self.bout(solve, conjugate, (&mut x, &mut spent));
            end = over;
            if end == StageEnd::Stuck && errors < NEAR && errors < NEARER * last_try {
                last_try = errors;
                end = finish(solve, &x, STEPS);
            }
            if end != StageEnd::Stuck {
                break;
            }
            if self.best_error < FALL * before {
                fruitless = 0;
                continue;
            }
            fruitless += 1;
            conjugate = !conjugate;
            if fruitless >= patience || !errors.is_finite() {
                break;
            }
        }
        solve.pool.give([x]);
        (end, spent)
    }

    /// A bout, how it ended, and the errors at its end, where x is in units of the cone.
    fn bout(
        &mut self,
        solve: &mut Solve<'_, D>,
        conjugate: bool,
        (x, spent): (&mut [[f64; D]], &mut usize),
    ) -> (StageEnd, f64) {
        let mut errors = f64::INFINITY;
        self.mixture.forget();
        for _ in 0..BOUT / ROUND {
            if conjugate {
                self.along_conjugate_directions(solve.blocks);
            } else {
                self.by_mixtures(solve.blocks);
            }
            *spent += ROUND;
            errors = self.judge(solve, x);
            if solve.best_errors.solves(solve.tolerance) {
                return (StageEnd::Solved, errors);
            }
            if !solve.tell("many sweeps", *spent) {
                return (StageEnd::Interrupted, errors);
            }
        }
        (StageEnd::Stuck, errors)
    }

    fn sweep(&mut self, blocks: &Blocks<D>, times: usize) {
        for _ in 0..times {
            self.order.sweep(blocks, &mut self.at.r, &mut self.at.bodies);
        }
    }

    fn along_conjugate_directions(&mut self, blocks: &Blocks<D>) {
        self.conjugate.begin(&self.at);
        for _ in 0..ROUND - PLAIN {
            self.sweep(blocks, 1);
            self.conjugate.go_on(&mut self.at, &self.weights);
        }
        self.sweep(blocks, PLAIN);
    }

    fn by_mixtures(&mut self, blocks: &Blocks<D>) {
        for _ in 0..(ROUND - PLAIN_AFTER_MIXTURES) / MIXED {
            self.from.copy_from(&self.at);
            self.sweep(blocks, MIXED);
            self.mixture.go_on(&self.from, &mut self.at, &self.weights);
        }
        self.sweep(blocks, PLAIN_AFTER_MIXTURES);
        self.mixture.pause();
    }

    /// The errors where the sweeps are; what was added up on the way there is formed anew.
    fn judge(&mut self, solve: &mut Solve<'_, D>, x: &mut [[f64; D]]) -> f64 {
        let Bouts { order, at, r, u, best, best_error, .. } = self;
        order.collect(&at.r, r);
        velocities(solve.blocks, r, u, &mut at.bodies);
        order.seat(&mut at.bodies);
        solve.scaled.in_cone_units(r, x);
        solve.scaled.velocities(x, u);
        let errors = solve.judge(x, u).worst();
        if errors < *best_error {
            *best_error = errors;
            best.copy_from_slice(x);
        }
        errors
    }
}
