//! Stage C: semismooth Newton on the natural map, from an iterate that is nearly there. Non-monotone: the last
//! halving is accepted anyway, for some solutions are only reached over a rise.

use super::stage::{Solve, StageEnd, advance, natural_size, newton_rows};

/// Share of 1 / rho added to D: what keeps redundant contacts regular.
const SHIFT: f64 = 1e-7;

/// The same where impulses are far larger than their unit: the natural map then needs steps as much longer to tell
/// a contact that carries little from one that opens.
pub fn finish_far<const D: usize>(solve: &mut Solve<'_, D>, start: &[[f64; D]], most: usize) -> StageEnd {
    let largest = start[..solve.scaled.count()].as_flattened().iter().fold(1.0_f64, |m, x| m.max(x.abs()));
    solve.scaled.lengthen(largest);
    let end = finish(solve, start, most);
    solve.scaled.lengthen(1.0 / largest);
    end
}

/// At most `most` Newton steps from `start`.
pub fn finish<const D: usize>(solve: &mut Solve<'_, D>, start: &[[f64; D]], most: usize) -> StageEnd {
    let mut x = start.to_vec();
    let (mut u, mut dx, mut next) = (solve.vector(), solve.vector(), solve.vector());
    solve.scaled.velocities(&x, &mut u);
    let mut size = natural_size(&solve.scaled, &x, &u);
    let (mut best, mut bad) = (f64::INFINITY, 0);
    for iteration in 0..most {
        if solve.spent() {
            return StageEnd::OutOfBudget;
        }
        let system = &mut solve.system;
        newton_rows(&solve.scaled, (&x, &u), (0.0, SHIFT), (&mut system.blocks, &mut dx));
        if !system.factorize() || !system.solve(&solve.scaled, &mut dx) {
            return StageEnd::Stuck;
        }
        let mut step = 1.0;
        let mut better = false;
        for halving in 0..6 {
            advance(&x, &dx, step, &mut next);
            solve.scaled.velocities(&next, &mut u);
            let found = natural_size(&solve.scaled, &next, &u);
            if found < (1.0 - 1e-4 * step) * size || halving == 5 {
                better = found < size;
                size = found;
                break;
            }
            step *= 0.5;
        }
        std::mem::swap(&mut x, &mut next);
        let errors = solve.judge(&x, &u);
        if errors.solves(solve.tolerance) {
            return StageEnd::Solved;
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
