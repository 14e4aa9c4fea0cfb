//! Stage D: the proximal point method, inner problems by semismooth Newton: W + rp, q - rp c around a centre c. Drift
//! along a line of centres is extrapolated, unguarded: guarding it by the residual destroys what it is for.

use super::stage::{Solve, StageEnd, advance, natural_size, newton_rows};

/// Most outer steps.
const OUTER: usize = 100;
/// Most Newton steps of an inner problem.
const INNER: usize = 15;

/// One inner problem's result.
struct Inner {
    solved: bool,
    steps: usize,
    first: f64,
    last: f64,
}

/// Proximal Newton from `x` with the first weight `weight`, at most `most` factorisations.
pub fn proximal<const D: usize>(
    solve: &mut Solve<'_, D>,
    start: &[[f64; D]],
    weight: f64,
    most: usize,
) -> StageEnd {
    let budget = solve.system.factorisations + most;
    let x = solve.pool.copy(start);
    let [moved, before, centre, z] = solve.vectors();
    let mut drift = Drift { x, moved, before, centre, z, newton: solve.vectors() };
    let end = outer(solve, &mut drift, weight, budget);
    let Drift { x, moved, before, centre, z, newton } = drift;
    solve.pool.give([x, moved, before, centre, z].into_iter().chain(newton));
    end
}

/// The error of an iterate.
pub fn error_at<const D: usize>(solve: &mut Solve<'_, D>, x: &[[f64; D]]) -> f64 {
    let mut u = solve.vector();
    solve.scaled.velocities(x, &mut u);
    let error = solve.judge(x, &u).worst();
    solve.pool.give([u]);
    error
}

/// The iterate of the outer steps.
struct Drift<const D: usize> {
    x: Vec<[f64; D]>,
    /// The last step and the one before.
    moved: Vec<[f64; D]>,
    before: Vec<[f64; D]>,
    centre: Vec<[f64; D]>,
    /// The iterate of the inner problem, and the vectors of its Newton steps.
    z: Vec<[f64; D]>,
    newton: [Vec<[f64; D]>; 4],
}

fn outer<const D: usize>(
    solve: &mut Solve<'_, D>,
    drift: &mut Drift<D>,
    mut weight: f64,
    budget: usize,
) -> StageEnd {
    let Drift { x, moved, before, centre, z, newton: memory } = drift;
    let mut stretch = 1.0;
    for _ in 0..OUTER {
        centre.copy_from_slice(x);
        z.copy_from_slice(x);
        let inner = match newton(solve, centre, z, (weight, budget), memory) {
            Ok(inner) => inner,
            Err(end) => return end,
        };
        if inner.solved || inner.last < 0.3 * inner.first {
            for (moved, (a, b)) in moved.iter_mut().zip(z.iter().zip(centre.iter())) {
                *moved = std::array::from_fn(|k| a[k] - b[k]);
            }
            stretch =
                if inner.solved && parallel(moved, before) { f64::min(2.0 * stretch, 64.0) } else { 1.0 };
            std::mem::swap(x, z);
            if stretch > 1.0 {
                advance(centre, moved, stretch, x);
            }
            std::mem::swap(moved, before);
            if inner.solved && inner.steps <= 4 {
                weight *= 0.5;
            } else if !inner.solved && inner.steps > 8 {
                weight *= 1.5;
            }
        } else {
            weight *= 3.0;
        }
        weight = weight.clamp(1e-10, 100.0);
        if solve.system.factorisations > budget || solve.spent() {
            break;
        }
        if !solve.tell("proximal newton", solve.system.factorisations) {
            return StageEnd::Interrupted;
        }
    }
    if solve.spent() { StageEnd::OutOfBudget } else { StageEnd::Stuck }
}

/// Solves the inner problem around `centre` from `z`; `Err` ends the stage: solved, say, by the way.
fn newton<const D: usize>(
    solve: &mut Solve<'_, D>,
    centre: &[[f64; D]],
    z: &mut Vec<[f64; D]>,
    (weight, budget): (f64, usize),
    memory: &mut [Vec<[f64; D]>; 4],
) -> Result<Inner, StageEnd> {
    memory.iter_mut().for_each(|vector| vector.fill([0.0; D]));
    let [plain, u, next, dx] = memory;
    let velocities = |solve: &Solve<'_, D>, z: &[[f64; D]], plain: &mut [[f64; D]], u: &mut [[f64; D]]| {
        solve.scaled.velocities(z, plain);
        for i in 0..solve.scaled.count() {
            u[i] = std::array::from_fn(|k| plain[i][k] + weight * (z[i][k] - centre[i][k]));
        }
    };
    velocities(solve, z, plain, u);
    let mut size = natural_size(&solve.scaled, z, u);
    let mut inner = Inner { solved: false, steps: 0, first: size, last: size };
    while inner.steps < INNER && solve.system.factorisations <= budget && !solve.spent() {
        let moved = distance(z, centre, solve.scaled.count());
        if (inner.steps > 0 && size <= (0.1 * weight * moved).max(1e-14)) || size < 1e-14 {
            inner.solved = true;
            break;
        }
        let system = &mut solve.system;
        newton_rows(&solve.scaled, (z, u), (weight, 0.0), (&mut system.blocks, dx));
        if !system.factorize() || !system.solve(&solve.scaled, dx) {
            break;
        }
        let mut step = 1.0;
        let mut accepted = None;
        for halving in 0..8 {
            advance(z, dx, step, next);
            velocities(solve, next, plain, u);
            let found = natural_size(&solve.scaled, next, u);
            let rise = halving == 3 && inner.steps < 4 && found < 2.0 * size;
            if found <= (1.0 - 1e-3 * step) * size || rise {
                accepted = Some(found);
                break;
            }
            step *= 0.5;
        }
        let Some(found) = accepted else {
            inner.solved = size < 0.5 * inner.first;
            break;
        };
        std::mem::swap(z, next);
        size = found;
        inner.steps += 1;
        // the unregularised problem may be solved before the regularised one
        if solve.judge(z, plain).solves(solve.tolerance) {
            return Err(StageEnd::Solved);
        }
    }
    inner.last = size;
    Ok(inner)
}

fn distance<const D: usize>(a: &[[f64; D]], b: &[[f64; D]], count: usize) -> f64 {
    let pairs = a[..count].as_flattened().iter().zip(b[..count].as_flattened());
    pairs.map(|(a, b)| (a - b) * (a - b)).sum::<f64>().sqrt()
}

/// True when two moves point the same way (cosine above 0.9).
fn parallel<const D: usize>(a: &[[f64; D]], b: &[[f64; D]]) -> bool {
    let dot = |a: &[[f64; D]], b: &[[f64; D]]| {
        a.as_flattened().iter().zip(b.as_flattened()).map(|(a, b)| a * b).sum::<f64>()
    };
    let sizes = (dot(a, a) * dot(b, b)).sqrt();
    sizes > 0.0 && dot(a, b) > 0.9 * sizes
}
