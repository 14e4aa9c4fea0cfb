//! Stage F: many sweeps, for what no factorisation brings nearer. Where the path folds again and again, as in walls that
//! are sheared, sweeps still go down, slowly: accelerated by conjugate gradients (theory eq. 5.35) or plain, whichever
//! leads on, with Newton from where they are near.

use super::blocks::Blocks;
use super::local::Local;
use super::memory::Pool;
use super::newton::finish;
use super::stage::{Solve, StageEnd};
use super::sweeps::{locals, sweep, sweep_price, velocities};

/// Sweeps of a bout, at whose end the errors are measured.
const BOUT: usize = 1024;
/// A bout leads on when it brings the errors below this share.
const FALL: f64 = 0.8;
/// Bouts in a row that may lead nowhere.
const FRUITLESS: usize = 8;
/// A conjugate direction is forgotten when the squared change of a sweep grows by more than this.
const RESTART: f64 = 2.0;
/// Errors from which Newton is tried, and again once they have fallen to this share.
const NEAR: f64 = 1e-5;
const NEARER: f64 = 0.1;
/// Most Newton steps of a try.
const STEPS: usize = 8;
/// A bout is cheap where it takes no longer than so many factorisations.
const CHEAP: f64 = 30.0;

/// Impulses with B^T r beside them; where W is a matrix the latter is empty.
#[derive(Clone)]
struct Point<const D: usize> {
    r: Vec<[f64; D]>,
    bodies: Vec<f64>,
}

impl<const D: usize> Point<D> {
    fn copy_from(&mut self, other: &Self) {
        self.r.copy_from_slice(&other.r);
        self.bodies.copy_from_slice(&other.bodies);
    }
    /// self <- own self + f (x - y), entry by entry.
    fn blend(&mut self, own: f64, f: f64, (x, y): (&Self, &Self)) {
        let blend = |own_values: &mut [f64], x: &[f64], y: &[f64]| {
            let pairs = own_values.iter_mut().zip(x.iter().zip(y));
            pairs.for_each(|(value, (x, y))| *value = own * *value + f * (x - y));
        };
        blend(self.r.as_flattened_mut(), x.r.as_flattened(), y.r.as_flattened());
        blend(&mut self.bodies, &x.bodies, &y.bodies);
    }
    /// Goes along a direction.
    fn advance(&mut self, direction: &Self) {
        let add = |values: &mut [f64], by: &[f64]| values.iter_mut().zip(by).for_each(|(v, by)| *v += by);
        add(self.r.as_flattened_mut(), direction.r.as_flattened());
        add(&mut self.bodies, &direction.bodies);
    }
    /// The squared distance of impulses, each as the energy that it makes alone \[J\].
    fn squared_distance(&self, other: &Self, blocks: &Blocks<D>) -> f64 {
        let mut sum = 0.0;
        for (block, (r, s)) in blocks.diagonal.iter().zip(self.r.iter().zip(&other.r)) {
            for k in 0..D {
                sum += block[k][k] * (r[k] - s[k]) * (r[k] - s[k]);
            }
        }
        sum
    }
}

/// Sweeps in progress.
struct Bouts<const D: usize> {
    locals: Vec<Local<D>>,
    at: Point<D>,
    before: Point<D>,
    direction: Point<D>,
    /// Velocities, for judging.
    u: Vec<[f64; D]>,
}

/// True where factorisations are so dear that sweeps come before most of them.
pub fn is_cheap<const D: usize>(solve: &Solve<'_, D>) -> bool {
    BOUT as f64 * sweep_price(solve.blocks) <= CHEAP * solve.system.price()
}

/// Sweeps from the best iterate of all stages, at most so many and for as long as so many factorisations take. They depend on the
/// order of the contacts. How many they were.
pub fn patient<const D: usize>(solve: &mut Solve<'_, D>, (worth, most): (usize, usize)) -> (StageEnd, usize) {
    let left = worth.min(solve.budget.saturating_sub(solve.system.factorisations));
    let sweeps = left as f64 * solve.system.price() / sweep_price(solve.blocks);
    let mut bouts = Bouts::begin(solve);
    let end = bouts.run(solve, (sweeps as usize).min(most) / BOUT);
    bouts.leave(&mut solve.pool);
    end
}

impl<const D: usize> Bouts<D> {
    fn begin(solve: &mut Solve<'_, D>) -> Self {
        let [mut r, mut u, before, direction] = solve.vectors();
        solve.scaled.to_impulses(&solve.best, &mut r);
        let mut bodies = Vec::new();
        velocities(solve.blocks, &r, &mut u, &mut bodies);
        Bouts {
            locals: locals(solve.blocks),
            before: Point { r: before, bodies: bodies.clone() },
            direction: Point { r: direction, bodies: bodies.clone() },
            at: Point { r, bodies },
            u,
        }
    }

    /// Gives the memory back.
    fn leave(self, pool: &mut Pool<D>) {
        pool.give([self.at.r, self.before.r, self.direction.r, self.u]);
    }

    fn run(&mut self, solve: &mut Solve<'_, D>, most: usize) -> (StageEnd, usize) {
        let (mut accelerated, mut fruitless) = (true, 0);
        let mut last_try = f64::INFINITY;
        let mut x = solve.vector();
        let (mut end, mut spent) = (StageEnd::Stuck, 0);
        for bout in 1..=most {
            spent = bout * BOUT;
            let before = solve.best_errors.worst();
            let errors = self.bout(solve, accelerated, &mut x);
            if solve.best_errors.solves(solve.tolerance) {
                end = StageEnd::Solved;
                break;
            }
            if !solve.tell("many sweeps", spent) {
                end = StageEnd::Interrupted;
                break;
            }
            if errors < NEAR && errors < NEARER * last_try {
                last_try = errors;
                end = finish(solve, &x, STEPS);
                if end != StageEnd::Stuck {
                    break;
                }
            }
            if solve.best_errors.worst() < FALL * before {
                fruitless = 0;
                continue;
            }
            fruitless += 1;
            accelerated = !accelerated;
            if fruitless >= FRUITLESS || !errors.is_finite() {
                break;
            }
        }
        solve.pool.give([x]);
        (end, spent)
    }

    /// A bout, and the errors at its end, where x is in units of the cone.
    fn bout(&mut self, solve: &mut Solve<'_, D>, accelerated: bool, x: &mut [[f64; D]]) -> f64 {
        let blocks = solve.blocks;
        let Bouts { locals, at, before, direction, u } = self;
        let mut length_before = 0.0;
        direction.blend(0.0, 0.0, (at, at));
        for k in 1..=BOUT {
            if accelerated {
                before.copy_from(at);
            }
            sweep(blocks, locals, &mut at.r, &mut at.bodies);
            if accelerated && k < BOUT {
                let length = at.squared_distance(before, blocks);
                let beta = length / length_before;
                length_before = length;
                if beta <= RESTART {
                    direction.blend(beta, 1.0, (at, before));
                    at.copy_from(before);
                    at.advance(direction);
                } else {
                    direction.blend(0.0, 0.0, (at, before));
                }
            }
        }
        // what was added up is formed anew
        velocities(blocks, &at.r, u, &mut at.bodies);
        solve.scaled.in_cone_units(&at.r, x);
        solve.scaled.velocities(x, u);
        solve.judge(x, u).worst()
    }
}
