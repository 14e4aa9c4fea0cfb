//! The exact solver: Coulomb friction to the asked tolerance, one setting for every problem (theory chapter 7):
//! A sweeps with the exact local solution; B interior point on the nonassociated law; C a Newton finisher inside B;
//! D proximal Newton; E a ladder of other starts. The best iterate of all stages is returned with its errors.

// components are read by their index as in the equations; a negated comparison lets NaN through, as it should
#![allow(clippy::needless_range_loop, clippy::neg_cmp_op_on_partial_ord)]

pub(crate) mod blocks;
mod bodies;
mod cone;
mod contacts;
mod groups;
mod interior_point;
pub(crate) mod judge;
mod krylov;
pub(crate) mod lane;
mod local;
mod newton;
mod operator;
mod proximal;
mod scaled;
mod stage;
mod step;
pub(crate) mod sweeps;
mod system;

use crate::friction_problem::{FrictionProblem, Measure, measure, project_on_cone};
use crate::friction_solver::{FrictionOutcome, FrictionSettings, FrictionSolver, Stage};
use crate::methods::lemke::Lemke;
use crate::watch::Watch;
use blocks::Blocks;
pub use contacts::ExactContacts;
use interior_point::{Start, interior_point};
use judge::Errors;
use proximal::proximal;
use scaled::Scaled;
use stage::{Solve, StageEnd};
use std::time::Instant;
use sweeps::Ended;
use system::System;

/// The exact solver for problems in matrix form.
#[derive(Clone, Debug, Default)]
pub struct Exact;

/// Weight of the first proximal step.
const WEIGHT: f64 = 0.1;
/// Most factorisations of one proximal stage.
const PROXIMAL: usize = 400;
/// The cold start, then the other starts of the ladder.
const STARTS: [Start; 5] = [
    Start { size: 1.0, smoothing: 0.0, centrality: 0.1 },
    Start { size: 1.0, smoothing: 10.0, centrality: 0.1 },
    Start { size: 0.1, smoothing: 1.0, centrality: 0.1 },
    Start { size: 10.0, smoothing: 0.0, centrality: 1e-3 },
    Start { size: 0.1, smoothing: 10.0, centrality: 1e-3 },
];

/// When to be content, and how long to try.
struct Goal {
    tolerance: f64,
    sweeps: usize,
    factorisations: usize,
}

/// What the stages came to.
struct Answer {
    errors: Errors,
    end: StageEnd,
    stages: Vec<Stage>,
    factorisations: usize,
}

impl Answer {
    fn iterations(&self) -> usize {
        self.stages.iter().map(|s| s.iterations).sum()
    }
    fn solved(&self) -> bool {
        self.end == StageEnd::Solved
    }
    fn interrupted(&self) -> bool {
        self.end == StageEnd::Interrupted
    }
}

impl FrictionSolver for Exact {
    fn name(&self) -> &'static str {
        "exact"
    }
    fn solve(
        &mut self,
        problem: &FrictionProblem,
        settings: &FrictionSettings,
        impulses: &mut [f64],
        watch: &mut Watch,
    ) -> FrictionOutcome {
        match problem.dimension {
            1 => {
                let found = in_dimension::<1>(problem, settings, impulses, watch);
                if found.solved { found } else { pivoted(problem, settings, impulses, watch, found) }
            }
            2 => in_dimension::<2>(problem, settings, impulses, watch),
            _ => in_dimension::<3>(problem, settings, impulses, watch),
        }
    }
}

/// Complementarity problems that are not monotone are beyond every stage, but not beyond pivoting.
const PIVOTED: usize = 400;

fn pivoted(
    problem: &FrictionProblem,
    settings: &FrictionSettings,
    impulses: &mut [f64],
    watch: &mut Watch,
    mut found: FrictionOutcome,
) -> FrictionOutcome {
    if problem.contacts() > PIVOTED {
        return found;
    }
    let mut other = vec![0.0; impulses.len()];
    let mut pivots = Lemke.solve(problem, settings, &mut other, watch);
    found.stages.append(&mut pivots.stages);
    found.seconds += pivots.seconds;
    let better =
        pivots.measure.natural.max(pivots.measure.scaled) < found.measure.natural.max(found.measure.scaled);
    if pivots.solved || better {
        impulses.copy_from_slice(&other);
        found.measure = pivots.measure;
        found.solved = pivots.solved;
        found.reason = pivots.reason;
    }
    found
}

fn in_dimension<const D: usize>(
    problem: &FrictionProblem,
    settings: &FrictionSettings,
    impulses: &mut [f64],
    watch: &mut Watch,
) -> FrictionOutcome {
    let blocks = Blocks::<D>::of(problem);
    let started = Instant::now();
    let mut r: Vec<[f64; D]> = impulses.chunks_exact(D).map(|r| std::array::from_fn(|k| r[k])).collect();
    r.resize(blocks.velocity.len(), [0.0; D]);
    let goal = Goal {
        tolerance: settings.tolerance,
        sweeps: settings.iterations.min(300),
        factorisations: settings.factorisations,
    };
    let answer = solve_blocks(&blocks, &goal, &mut r, watch);
    for (i, r) in r.iter_mut().enumerate().take(blocks.count()) {
        project_on_cone(r, blocks.friction[i]);
    }
    let seconds = started.elapsed().as_secs_f64();
    let found = r[..blocks.count()].as_flattened();
    let mut reached = measure(problem, found);
    let solved = reached.solves(settings.tolerance);
    let mut given = impulses.to_vec();
    impulses.copy_from_slice(found);
    if !solved && given.iter().all(|r| r.is_finite()) {
        // a short budget may end where the first sweeps have led away from a good start
        given.chunks_exact_mut(D).zip(&problem.friction).for_each(|(r, mu)| project_on_cone(r, *mu));
        let start = measure(problem, &given);
        let worst = |m: &Measure| m.natural.max(0.1 * m.scaled);
        if worst(&start) < worst(&reached) {
            reached = start;
            impulses.copy_from_slice(&given);
        }
    }
    FrictionOutcome {
        solved,
        measure: reached,
        stages: answer.stages,
        factorisations: answer.factorisations,
        seconds,
        reason: if solved { String::new() } else { reason(answer.end, &answer.errors) },
        strict_feasibility: None,
    }
}

fn reason(end: StageEnd, errors: &Errors) -> String {
    let best = format!("best iterate: natural {:.1e}, scaled {:.1e}", errors.natural, errors.scaled);
    match end {
        StageEnd::Interrupted => format!("stopped on request; {best}"),
        StageEnd::OutOfBudget => format!("the factorisations are spent; {best}"),
        StageEnd::Solved | StageEnd::Stuck => format!("no stage reached the tolerance; {best}"),
    }
}

/// The pipeline.
fn solve_blocks<const D: usize>(
    blocks: &Blocks<D>,
    goal: &Goal,
    r: &mut [[f64; D]],
    watch: &mut Watch,
) -> Answer {
    let mut u = vec![[0.0; D]; r.len()];
    let (count, errors, ended) = sweeps::sweeps(blocks, (goal.tolerance, goal.sweeps), (r, &mut u), watch);
    let mut answer = Answer {
        errors,
        end: if ended == Ended::Interrupted { StageEnd::Interrupted } else { StageEnd::Solved },
        stages: vec![Stage { name: "sweeps", iterations: count }],
        factorisations: 0,
    };
    if ended != Ended::LeftOff || goal.factorisations == 0 {
        return answer;
    }
    let scaled = Scaled::of(blocks);
    let system = System::of(&scaled);
    let mut best = vec![[0.0; D]; r.len()];
    scaled.in_cone_units(r, &mut best);
    let mut solve = Solve {
        blocks,
        scaled,
        system,
        tolerance: goal.tolerance,
        budget: goal.factorisations,
        best,
        best_errors: errors,
        watch: &mut |p| watch(p),
    };
    answer.end = climb(&mut solve, &mut answer.stages);
    answer.errors = solve.best_errors;
    answer.factorisations = solve.system.factorisations;
    solve.scaled.to_impulses(&solve.best, r);
    answer
}

/// Interior point and proximal Newton from one start after another.
fn climb<const D: usize>(solve: &mut Solve<'_, D>, stages: &mut Vec<Stage>) -> StageEnd {
    let mut x = solve.vector();
    for start in STARTS {
        let before = solve.system.factorisations;
        let end = interior_point(solve, start, &mut x);
        let spent = solve.system.factorisations;
        stages.push(Stage { name: "interior point", iterations: spent - before });
        if end != StageEnd::Stuck {
            return end;
        }
        let end = proximal(solve, &x, WEIGHT, PROXIMAL);
        stages.push(Stage { name: "proximal newton", iterations: solve.system.factorisations - spent });
        if end != StageEnd::Stuck {
            return end;
        }
    }
    let unit = vec![std::array::from_fn(|k| if k == 0 { 1.0 } else { 0.0 }); x.len()];
    let before = solve.system.factorisations;
    let end = proximal(solve, &unit, WEIGHT, PROXIMAL);
    stages.push(Stage { name: "proximal newton", iterations: solve.system.factorisations - before });
    end
}
