//! Stage C: semismooth Newton on the natural map, from an iterate of the interior point that is nearly there, and
//! before it from the iterate that the sweeps left. Non-monotone: the last halving is accepted anyway, for some
//! solutions are only reached over a rise.

use super::stage::{Solve, StageEnd, advance, natural_size, newton_rows};

/// Share of 1 / rho added to D: what keeps redundant contacts regular.
const SHIFT: f64 = 1e-7;
/// Shorter steps are not tried: 1/32.
const HALVINGS: usize = 5;

/// Error, over the tolerance, that good impulses have, and most steps for it with a factor that there is.
const WELL: f64 = 1e-4;
const POLISHES: usize = 3;
/// Share of its error that such a step may leave for another one to be worth its cost.
const NEARER: f64 = 0.1;

/// The natural map, over that of the start, after one step and after two from an iterate of an interior point or of a path: from
/// beyond hardly any iteration comes back, and the factorisations that it would take bring those on.
const ASTRAY: [f64; 2] = [1e5, 10.0];

/// A Newton iteration in progress.
struct Iteration<const D: usize> {
    x: Vec<[f64; D]>,
    u: Vec<[f64; D]>,
    /// The natural map at x.
    size: f64,
    dx: Vec<[f64; D]>,
    next: Vec<[f64; D]>,
    next_u: Vec<[f64; D]>,
    next_size: f64,
}

impl<const D: usize> Iteration<D> {
    fn new(solve: &mut Solve<'_, D>, start: &[[f64; D]]) -> Self {
        let (x, mut u) = (solve.pool.copy(start), solve.vector());
        solve.scaled.velocities(&x, &mut u);
        let size = natural_size(&solve.scaled, &x, &u);
        let [dx, next, next_u] = solve.vectors();
        Iteration { x, u, size, dx, next, next_u, next_size: size }
    }
    /// Gives the memory back.
    fn leave(self, solve: &mut Solve<'_, D>) {
        solve.pool.give([self.x, self.u, self.dx, self.next, self.next_u]);
    }
    /// Tries a step with `shift` times 1 / rho added to D, halved until the natural map falls or the halvings are
    /// spent; whether it fell, or nothing when the system is singular.
    fn step(&mut self, solve: &mut Solve<'_, D>, shift: f64) -> Option<bool> {
        let system = &mut solve.system;
        newton_rows(&solve.scaled, (&self.x, &self.u), (0.0, shift), (&mut system.blocks, &mut self.dx));
        if !system.factorize() || !system.solve(&solve.scaled, &mut self.dx) {
            return None;
        }
        let mut length = 1.0;
        for halving in 0..=HALVINGS {
            self.look(solve, length);
            if self.next_size < (1.0 - 1e-4 * length) * self.size || halving == HALVINGS {
                break;
            }
            length *= 0.5;
        }
        Some(self.next_size < self.size)
    }
    /// The same with the factor of the step before, whole or not at all: whether there was a step.
    fn step_again(&mut self, solve: &mut Solve<'_, D>) -> bool {
        let system = &mut solve.system;
        newton_rows(&solve.scaled, (&self.x, &self.u), (0.0, SHIFT), (&mut system.blocks, &mut self.dx));
        if !system.solve(&solve.scaled, &mut self.dx) {
            return false;
        }
        self.look(solve, 1.0);
        true
    }
    /// Looks where so much of the step leads.
    fn look(&mut self, solve: &mut Solve<'_, D>, length: f64) {
        advance(&self.x, &self.dx, length, &mut self.next);
        solve.scaled.velocities(&self.next, &mut self.next_u);
        self.next_size = natural_size(&solve.scaled, &self.next, &self.next_u);
    }
    /// Goes where the step led.
    fn accept(&mut self) {
        std::mem::swap(&mut self.x, &mut self.next);
        std::mem::swap(&mut self.u, &mut self.next_u);
        self.size = self.next_size;
    }
}

/// The same where impulses are far larger than their unit: the natural map then needs steps as much longer to tell
/// a contact that carries little from one that opens.
pub fn finish_far<const D: usize>(solve: &mut Solve<'_, D>, start: &[[f64; D]], most: usize) -> StageEnd {
    let largest = start[..solve.scaled.count()].as_flattened().iter().fold(1.0_f64, |m, x| m.max(x.abs()));
    solve.scaled.lengthen(largest);
    let end = try_to_finish(solve, start, most);
    solve.scaled.lengthen(1.0 / largest);
    end
}

/// At most `most` Newton steps from `start`.
pub fn finish<const D: usize>(solve: &mut Solve<'_, D>, start: &[[f64; D]], most: usize) -> StageEnd {
    let mut at = Iteration::new(solve, start);
    let end = steps_to(solve, &mut at, (most, &[]));
    at.leave(solve);
    end
}

/// The same, given up where the first steps lead far away: whoever asks has another way to go on.
pub fn try_to_finish<const D: usize>(solve: &mut Solve<'_, D>, start: &[[f64; D]], most: usize) -> StageEnd {
    let mut at = Iteration::new(solve, start);
    let end = steps_to(solve, &mut at, (most, &ASTRAY));
    at.leave(solve);
    end
}

/// The same, and where that is asked for impulses that come out come out well: what is left of the forces moves bodies at rest,
/// and would ask for another factorisation in a few steps.
pub fn finish_well<const D: usize>(solve: &mut Solve<'_, D>, start: &[[f64; D]], most: usize) -> StageEnd {
    let mut at = Iteration::new(solve, start);
    let end = steps_to(solve, &mut at, (most, &[]));
    if end == StageEnd::Solved && solve.polish {
        polish(solve, &mut at);
    }
    at.leave(solve);
    end
}

/// Brings the best impulses, which are good enough, to where they are good: one factorisation where there is one left.
pub fn better<const D: usize>(solve: &mut Solve<'_, D>) {
    if solve.spent() || solve.best_errors.worst() <= WELL * solve.tolerance {
        return;
    }
    let start = solve.pool.copy(&solve.best);
    let mut at = Iteration::new(solve, &start);
    if at.step(solve, SHIFT).is_some() {
        at.accept();
        let before = solve.best_errors.worst();
        if solve.judge(&at.x, &at.u).worst() <= NEARER * before {
            polish(solve, &mut at);
        }
    }
    at.leave(solve);
    solve.pool.give([start]);
}

/// Steps with the factor that there is, while each brings the errors down by much.
fn polish<const D: usize>(solve: &mut Solve<'_, D>, at: &mut Iteration<D>) {
    for _ in 0..POLISHES {
        let before = solve.best_errors.worst();
        if before <= WELL * solve.tolerance || !at.step_again(solve) {
            return;
        }
        at.accept();
        if !(solve.judge(&at.x, &at.u).worst() <= NEARER * before) {
            return;
        }
    }
}

/// At most `most` steps, each of the first ones to a natural map that is at most its bound times that of the start.
fn steps_to<const D: usize>(
    solve: &mut Solve<'_, D>,
    at: &mut Iteration<D>,
    (most, bounds): (usize, &[f64]),
) -> StageEnd {
    let (mut best, mut bad, first) = (f64::INFINITY, 0, at.size);
    for iteration in 0..most {
        if solve.spent() {
            return StageEnd::OutOfBudget;
        }
        let Some(better) = at.step(solve, SHIFT) else {
            return StageEnd::Stuck;
        };
        at.accept();
        let errors = solve.judge(&at.x, &at.u);
        if errors.solves(solve.tolerance) {
            return StageEnd::Solved;
        }
        if bounds.get(iteration).is_some_and(|bound| at.size > bound * first) {
            return StageEnd::Stuck;
        }
        if errors.worst() > 0.3 * best {
            bad += 1;
            if bad >= 2 || !(errors.worst() <= 10.0 * best) {
                return StageEnd::Stuck;
            }
        }
        best = best.min(errors.worst());
        if !better && iteration > 1 {
            return StageEnd::Stuck;
        }
    }
    StageEnd::Stuck
}

/// Most steps from where the sweeps left off.
const EARLY: usize = 14;
/// Errors above this are too far away for steps that do not fall.
const NEAR: f64 = 1e-4;
/// Errors times contacts above this are spread over so many contacts that Newton from the sweeps solves none of the
/// public problems: one to five factorisations are saved. Found on problems in matrix form, and used there.
const SCATTERED: f64 = 2.0;
/// Shifted steps that may pass without a better iterate.
const PATIENCE: usize = 5;
/// Shifted steps in a row that may bring the errors down by less than half; the first may raise them.
const SLOW: usize = 2;

/// Newton from the iterate that the sweeps left, before any interior point: a few factorisations where the sweeps
/// have found what slips and what sticks, one where they have not. As long as the natural map falls the steps are
/// plain; once it does not, they are shifted by the error (Levenberg and Marquardt), over rises too.
pub fn descend<const D: usize>(solve: &mut Solve<'_, D>, start: &[[f64; D]]) -> StageEnd {
    // a matrix that is nearly singular here says nothing of those of the interior point
    solve.system.falls_back = false;
    let mut at = Iteration::new(solve, start);
    let end = steps_down(solve, &mut at);
    at.leave(solve);
    solve.system.falls_back = true;
    end
}

fn steps_down<const D: usize>(solve: &mut Solve<'_, D>, at: &mut Iteration<D>) -> StageEnd {
    let first = solve.best_errors.worst();
    if solve.blocks.couplings.is_some() && first * solve.scaled.count() as f64 > SCATTERED {
        return StageEnd::Stuck;
    }
    let mut best = first;
    let (mut error, mut shifted, mut fruitless, mut slow) = (first, false, 0, 0);
    for iteration in 0..EARLY {
        if solve.spent() {
            return StageEnd::OutOfBudget;
        }
        if !solve.tell("newton", iteration) {
            return StageEnd::Interrupted;
        }
        let shift = if shifted { error.max(SHIFT) } else { SHIFT };
        match at.step(solve, shift) {
            Some(fell) if fell || shifted => at.accept(),
            Some(_) if error < NEAR => {
                shifted = true;
                continue;
            }
            _ => return StageEnd::Stuck,
        }
        let errors = solve.judge(&at.x, &at.u);
        if errors.solves(solve.tolerance) {
            return StageEnd::Solved;
        }
        let slower = shifted && errors.worst() > 0.5 * error;
        slow = if slower { slow + 1 } else { 0 };
        error = errors.worst();
        fruitless = if error < 0.5 * best { 0 } else { fruitless + 1 };
        best = best.min(error);
        if fruitless > PATIENCE || slow > SLOW || !(error <= 1e3 * first) {
            return StageEnd::Stuck;
        }
    }
    StageEnd::Stuck
}
