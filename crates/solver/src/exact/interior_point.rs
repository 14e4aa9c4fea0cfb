//! Stage B: primal-dual interior point directly on the nonassociated law, y = W~ x + q~ + |y_T| e_1, x o y = m e,
//! with the derivative of |y_T| in the Newton matrix: (W~ + E G^2) dx = E G d + res, dy = G (d - G dx),
//! d = lambda \ (-lambda o lambda + sigma m e - corrector) (theory chapter 7). Starts cold, or from a pair inside the cones
//! where a solution of a problem much like this one is known; from an iterate of another stage it takes more steps.

use super::newton::try_to_finish;
use super::scaled::Scaled;
use super::stage::{Solve, StageEnd};
use super::step::{Pair, centrality, direction, prepare, reach, take};

/// Where and how the interior point starts.
#[derive(Clone, Copy, Debug)]
pub struct Start {
    /// First value of x.
    pub size: f64,
    /// |y_T| -> sqrt(|y_T|^2 + (smoothing m)^2) - smoothing m.
    pub smoothing: f64,
    /// Least sqrt(det x_i det y_i) / m that a step may leave.
    pub centrality: f64,
}

/// The start that every problem gets first.
pub const CENTRED: Start = Start { size: 1.0, smoothing: 0.0, centrality: 0.1 };

/// Most interior point steps.
pub const STEPS: usize = 60;

/// Errors below which Newton is tried: of first tries that are farther away four in ten fail, and each failure costs more
/// factorisations than a success spares.
const NEAR: f64 = 3e-5;

/// What the iterations so far say about going on.
pub struct Trend {
    /// The best errors after each step so far.
    history: [f64; STEPS + 1],
    steps: usize,
    jammed: usize,
    last_try: f64,
}

impl Trend {
    /// Nothing so far.
    pub fn none() -> Self {
        Trend { history: [0.0; STEPS + 1], steps: 0, jammed: 0, last_try: f64::INFINITY }
    }
    /// True where Newton is worth a try: near, and much nearer than at the last.
    pub fn is_near(&mut self, error: f64) -> bool {
        let near = error < NEAR && error < 0.2 * self.last_try;
        self.last_try = if near { error } else { self.last_try };
        near
    }
    /// True when twelve steps brought less than a fifth.
    pub fn stalls(&mut self, best: f64) -> bool {
        self.history[self.steps] = best;
        self.steps += 1;
        let n = self.steps;
        n > 13 && self.history[n - 1] > 0.8 * self.history[n - 13]
    }
    /// True after three steps in a row that were blocked at once.
    pub fn jams(&mut self, step: f64) -> bool {
        self.jammed = if step < 0.05 { self.jammed + 1 } else { 0 };
        self.jammed >= 3 && self.steps > 6
    }
}

/// Interior point from a cold start, at most so many steps. The iterate that it leaves in `x` is its own best.
pub fn interior_point<const D: usize>(
    solve: &mut Solve<'_, D>,
    start: Start,
    most: usize,
    x: &mut Vec<[f64; D]>,
) -> StageEnd {
    let mut pair = Pair::cold(&solve.scaled, start.size, &mut solve.pool);
    let end = steps(solve, (start, most), &mut pair, x);
    solve.pool.give_pair(pair);
    end
}

/// The same from a pair of points inside the cones.
pub fn interior_point_from<const D: usize>(
    solve: &mut Solve<'_, D>,
    start: Start,
    mut pair: Pair<D>,
    x: &mut Vec<[f64; D]>,
) -> StageEnd {
    let end = steps(solve, (start, STEPS), &mut pair, x);
    solve.pool.give_pair(pair);
    end
}

fn steps<const D: usize>(
    solve: &mut Solve<'_, D>,
    (start, most): (Start, usize),
    pair: &mut Pair<D>,
    x: &mut Vec<[f64; D]>,
) -> StageEnd {
    let mut trend = Trend::none();
    let mut best = f64::INFINITY;
    for iteration in 0..=most {
        solve.scaled.velocities(&pair.x, &mut pair.u);
        let errors = solve.judge(&pair.x, &pair.u);
        if errors.worst() < best || iteration == 0 {
            best = errors.worst();
            x.clone_from(&pair.x);
        }
        if errors.solves(solve.tolerance) {
            return StageEnd::Solved;
        }
        if trend.stalls(best) || iteration == most {
            return StageEnd::Stuck;
        }
        if !solve.tell("interior point", iteration) {
            return StageEnd::Interrupted;
        }
        if trend.is_near(errors.worst()) {
            match try_to_finish(solve, &pair.x, 8) {
                StageEnd::Stuck => {}
                end => return end,
            }
        }
        if solve.spent() {
            return StageEnd::OutOfBudget;
        }
        match step(solve, pair, start) {
            Some(length) if !trend.jams(length) => {}
            _ => return StageEnd::Stuck,
        }
    }
    StageEnd::Stuck
}

/// One step; its length, or nothing when the numbers end.
fn step<const D: usize>(solve: &mut Solve<'_, D>, pair: &mut Pair<D>, start: Start) -> Option<f64> {
    let scaled: &Scaled<D> = &solve.scaled;
    let system = &mut solve.system;
    let m = pair.complementarity(scaled.count());
    prepare(scaled, pair, (start.smoothing * m, 1.0), &mut system.blocks);
    if !system.factorize() {
        return None;
    }
    // a start that is less central than asked must still be left
    let least = start.centrality.min(0.9 * centrality(scaled, pair, 0.0));
    let mut go = |pair: &mut Pair<D>, target: f64, corrected: bool| -> Option<f64> {
        direction(scaled, pair, target, corrected);
        // what is only looked at needs no more digits than the step before had
        let is_solved = if target == 0.0 {
            system.foresee(scaled, &mut pair.dx)
        } else {
            system.solve(scaled, &mut pair.dx)
        };
        if !is_solved {
            return None;
        }
        let longest = reach(scaled, pair);
        longest.is_finite().then_some(longest)
    };
    let affine = go(pair, 0.0, false)?.min(1.0);
    let ahead = pair.complementarity_after(affine) / scaled.count() as f64;
    let sigma = (ahead.max(0.0) / m).powi(3).clamp(1e-8, 1.0);
    pair.keep_affine();
    let longest = go(pair, sigma * m, true)?;
    let mut found = trial(scaled, pair, (longest, m, least));
    if found < 0.3 {
        pair.put_aside();
        for sigma in [0.3, 0.8] {
            let longest = go(pair, sigma * m, false)?;
            let length = trial(scaled, pair, (longest, m, least));
            if length > 1.5 * found {
                pair.put_aside();
                found = length;
            }
            if found > 0.3 {
                break;
            }
        }
        pair.take_back();
    }
    take(scaled, pair, found);
    pair.is_finite().then_some(found)
}

/// The longest step that keeps the pair central.
fn trial<const D: usize>(scaled: &Scaled<D>, pair: &Pair<D>, (longest, m, least): (f64, f64, f64)) -> f64 {
    let mut length = (longest * (1.0 - m).clamp(0.9, 0.9995)).min(1.0);
    for _ in 0..30 {
        if length <= 1e-12 || centrality(scaled, pair, length) >= least {
            break;
        }
        length *= 0.8;
    }
    length
}
