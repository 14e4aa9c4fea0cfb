//! Starting from impulses that solved a problem much like this one, a step ago: Newton on the natural map from them, and
//! where the contacts' states have changed, interior point from a point as far inside the cones as they are wrong.

use super::interior_point::{CENTRED, interior_point_from};
use super::newton::finish_well;
use super::stage::{Solve, StageEnd};
use super::step::Pair;
use crate::friction_problem::project_on_cone;
use crate::friction_solver::{Stage, StageList};

/// Most Newton steps from the start.
const STEPS: usize = 4;
/// How far inside the cones the interior point begins, in shares of the error of the start.
const INSIDE: f64 = 0.3;
/// Sweeps that are worth their cost before a factorisation, where a start is given.
pub const SWEEPS: usize = 4;

/// Newton, then interior point, from impulses in the problem's own units.
pub fn restart<const D: usize>(
    solve: &mut Solve<'_, D>,
    given: &[[f64; D]],
    stages: &mut StageList,
) -> StageEnd {
    let mut x = solve.vector();
    solve.scaled.in_cone_units(given, &mut x);
    x.iter_mut().for_each(|x| project_on_cone(x, 1.0));
    let pair = inside(solve, &x);
    let end = from_there(solve, pair, &mut x, stages);
    solve.pool.give([x]);
    end
}

fn from_there<const D: usize>(
    solve: &mut Solve<'_, D>,
    pair: Pair<D>,
    x: &mut Vec<[f64; D]>,
    stages: &mut StageList,
) -> StageEnd {
    let before = solve.system.factorisations;
    let end = finish_well(solve, x, STEPS);
    let spent = solve.system.factorisations;
    stages.push(Stage { name: "newton", iterations: spent - before });
    if end != StageEnd::Stuck {
        solve.pool.give_pair(pair);
        return end;
    }
    let end = interior_point_from(solve, CENTRED, pair, x);
    stages.push(Stage { name: "interior point", iterations: solve.system.factorisations - spent });
    end
}

/// x and y = u + |u_T| e_1 in the cones, both moved inside by a share of how far they are from a solution.
fn inside<const D: usize>(solve: &mut Solve<'_, D>, x: &[[f64; D]]) -> Pair<D> {
    let mut pair = Pair::cold(&solve.scaled, 1.0, &mut solve.pool);
    let mut u = solve.vector();
    let scaled = &solve.scaled;
    scaled.velocities(x, &mut u);
    let mut error = 0.0_f64;
    for i in 0..scaled.count() {
        let mut y = u[i];
        y[0] += y[1..].iter().map(|t| t * t).sum::<f64>().sqrt();
        let mut nearest: [f64; D] = std::array::from_fn(|k| x[i][k] - scaled.step[i] * y[k]);
        project_on_cone(&mut nearest, 1.0);
        let off = (0..D).map(|k| (x[i][k] - nearest[k]).powi(2)).sum::<f64>().sqrt() / scaled.step[i];
        error = error.max(off);
        project_on_cone(&mut y, 1.0);
        (pair.x[i], pair.y[i]) = (x[i], y);
    }
    let shift = INSIDE * error;
    for i in 0..scaled.count() {
        pair.x[i][0] += shift;
        pair.y[i][0] += shift;
    }
    solve.pool.give([u]);
    pair
}
