//! The exact solver's door for problems in matrix form: which way a problem goes, and what is handed back.

use super::analyses::Analyses;
use super::at_once::at_once;
use super::blocks::Blocks;
use super::by_parts::solve_parts;
use super::memory::Memory;
use super::parts::Parts;
use super::stage::StageEnd;
use super::{Answer, Goal, feasibility_in, solve_blocks};
use crate::friction_measure::{Measure, judged, measure, measured_in};
use crate::friction_problem::{FrictionProblem, is_on_cone, project_on_cone};
use crate::friction_solver::{FrictionOutcome, FrictionSettings, FrictionSolver};
use crate::impulse_solver::ImpulseChoice;
use crate::methods::lemke::Lemke;
use crate::stopwatch::Stopwatch;
use crate::watch::Watch;

/// The exact solver for problems in matrix form; holds memory between solves. What it finds out about a graph of contacts
/// it finds out anew in each: a matrix does not say that its graph still stands.
#[derive(Clone, Debug, Default)]
pub struct Exact {
    lines: Memory<1>,
    plane: Memory<2>,
    space: Memory<3>,
}

impl FrictionSolver for Exact {
    fn name(&self) -> &'static str {
        "exact"
    }
    fn finds(&self, _choice: ImpulseChoice) -> bool {
        true
    }
    fn work(
        &mut self,
        problem: &FrictionProblem,
        settings: &FrictionSettings,
        impulses: &mut [f64],
        watch: &mut Watch,
    ) -> FrictionOutcome {
        let any = settings.impulses != ImpulseChoice::MinimumNorm;
        if any && let Some(found) = at_once(problem, settings, impulses) {
            return found.outcome();
        }
        match problem.dimension {
            1 if any && problem.contacts() <= FEW => {
                let mut found = impulses.to_vec();
                let outcome = Lemke.solve(problem, settings, &mut found, watch);
                if outcome.solved {
                    impulses.copy_from_slice(&found);
                    return outcome;
                }
                in_dimension(problem, settings, impulses, &mut self.lines, watch)
            }
            1 => {
                let found = in_dimension(problem, settings, impulses, &mut self.lines, watch);
                if found.solved || settings.impulses == ImpulseChoice::MinimumNorm {
                    found
                } else {
                    pivoted(problem, settings, impulses, watch, found)
                }
            }
            2 => in_dimension(problem, settings, impulses, &mut self.plane, watch),
            _ => in_dimension(problem, settings, impulses, &mut self.space, watch),
        }
    }
}

/// Complementarity problems that are not monotone are beyond every stage, but not beyond pivoting.
const PIVOTED: usize = 400;
/// So few contacts that pivoting comes before all stages.
const FEW: usize = 16;

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
    memory: &mut Memory<D>,
    watch: &mut Watch,
) -> FrictionOutcome {
    let made = problem.matrix.made(D);
    // the least impulses are looked for all at once
    let parts = made.parts.as_deref().filter(|_| settings.impulses != ImpulseChoice::MinimumNorm);
    let (mut blocks, mut r) = read(problem, parts, impulses, memory);
    let started = Stopwatch::start();
    let mut u = memory.pool.zeros(r.len());
    let goal = Goal {
        tolerance: settings.tolerance,
        sweeps: settings.iterations.min(300),
        patience: settings.iterations,
        factorisations: settings.factorisations,
        impulses: settings.impulses,
        content: None,
        polish: false,
        early: true,
    };
    let mut analyses = Analyses::default();
    let with = (&mut analyses, &mut *memory);
    let mut answer = match parts {
        Some(parts) => solve_parts((&made.matrix, parts), &blocks, &goal, (&mut r, &mut u), with, watch),
        None => solve_blocks(&blocks, &goal, (&mut r, &mut u), with, watch),
    };
    let asked = !answer.solved() && answer.is_worth_asking();
    let strict_feasibility = asked.then(|| feasibility_in::<D>(problem)).flatten();
    for (r, &mu) in r.iter_mut().zip(&blocks.friction).take(problem.contacts()) {
        if !is_on_cone(r, mu) {
            project_on_cone(r, mu);
            answer.has_velocities = false;
        }
    }
    if let Some(parts) = parts {
        for vector in [&mut r, &mut u] {
            let here = memory.pool.copy(vector);
            parts.scatter(&here, vector);
            memory.pool.give([here]);
        }
    }
    let seconds = started.seconds();
    let reached = return_best(problem, (&r, &u), (&answer, goal.is_least()), settings.tolerance, impulses);
    let solved = reached.solves(settings.tolerance) && !answer.not_least;
    let reason = if solved { String::new() } else { reason(&answer) };
    blocks.forget_matrix();
    memory.blocks = blocks;
    memory.pool.give([r, u]);
    FrictionOutcome {
        solved,
        measure: reached,
        stages: answer.stages,
        factorisations: answer.factorisations,
        seconds,
        reason,
        strict_feasibility: if solved { None } else { strict_feasibility },
    }
}

/// The blocks of a problem and its start, part after part where there are parts.
fn read<const D: usize>(
    problem: &FrictionProblem,
    parts: Option<&Parts>,
    start: &[f64],
    memory: &mut Memory<D>,
) -> (Blocks<D>, Vec<[f64; D]>) {
    let mut blocks = std::mem::take(&mut memory.blocks);
    let mut r = memory.pool.copy(start.as_chunks::<D>().0);
    match parts {
        Some(parts) => {
            blocks.read_parts(problem, parts);
            parts.gather(start.as_chunks::<D>().0, &mut r);
            // a start that is no number says nothing, and would be read beside those of other parts
            r.iter_mut().filter(|r| !r.iter().all(|x| x.is_finite())).for_each(|r| *r = [0.0; D]);
        }
        None => blocks.read(problem),
    }
    r.resize(blocks.velocity.len(), [0.0; D]);
    (blocks, r)
}

/// Leaves what was found in the impulses, or their start on the cones where that is better: a short budget may end where the
/// first sweeps have led away from a good one. Measures what it leaves.
fn return_best<const D: usize>(
    problem: &FrictionProblem,
    (r, u): (&[[f64; D]], &[[f64; D]]),
    (answer, is_least): (&Answer, bool),
    tolerance: f64,
    impulses: &mut [f64],
) -> Measure {
    let (r, u) = (&r[..problem.contacts()], &u[..problem.contacts()]);
    let found = r.as_flattened();
    let reached =
        if answer.has_velocities { judged(problem, r, u) } else { measured_in::<D>(problem, found) };
    let is_solved = reached.solves(tolerance) && !answer.not_least;
    if !is_solved && !is_least && impulses.iter().all(|r| r.is_finite()) {
        impulses.chunks_exact_mut(D).zip(&problem.friction).for_each(|(r, mu)| project_on_cone(r, *mu));
        let start = measure(problem, impulses);
        let worst = |m: &Measure| m.natural.max(0.1 * m.scaled);
        if worst(&start) < worst(&reached) {
            return start;
        }
    }
    impulses.copy_from_slice(found);
    reached
}

fn reason(answer: &Answer) -> String {
    let errors = &answer.errors;
    let best = format!("best iterate: natural {:.1e}, scaled {:.1e}", errors.natural, errors.scaled);
    match answer.end {
        StageEnd::Solved if answer.not_least => {
            format!(
                "solved, but not by the least impulses: W is not symmetric, or too large, or no step leads to them; {best}"
            )
        }
        StageEnd::Interrupted => format!("stopped on request; {best}"),
        StageEnd::OutOfBudget => format!("the factorisations are spent; {best}"),
        StageEnd::Solved | StageEnd::Stuck => format!("no stage reached the tolerance; {best}"),
    }
}
