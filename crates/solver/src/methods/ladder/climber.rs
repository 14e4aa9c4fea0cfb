//! Who climbs a ladder: takes an island out of a problem and brings it up from rung to rung, until one has solved it. Holds the
//! solvers' memory between solves, which changes no answer: any climber comes to the same impulses.

use crate::impulse_solver::{ImpulseSolver, SolveSettings, SolverKind};
use crate::islands::{Islands, Part};
use crate::outcome::{StageReport, Stages, Stop};
use crate::problem::{ContactProblem, Impulses};
use crate::residual::{Residual, residual};
use crate::watch::Watch;
use carom_math::Space;

/// Solvers, weakest first, and the island that they are at.
pub(super) struct Climber<S: Space> {
    rungs: Vec<(SolverKind, Box<dyn ImpulseSolver<S>>)>,
    /// The island that was taken out, and its impulses.
    pub part: Part<S>,
    best: Impulses<S>,
}

/// What a climb came to; the best impulses are in the part afterwards.
pub(super) struct Climbed {
    pub stages: Stages,
    pub residual: Residual,
    pub stop: Stop,
    /// Told by the last stage that told any; nothing where the island is solved.
    pub strict_feasibility: Option<f64>,
}

/// True where a problem is one island and few bodies are outside of it: it is solved where it stands.
fn is_whole<S: Space>(problem: &ContactProblem<S>, islands: &Islands) -> bool {
    islands.count() == 1
        && islands.contacts(0).len() == problem.contacts.len()
        && islands.rows(0).len() == problem.rows.len()
        && problem.inverse_masses.len() <= 2 * islands.bodies(0).0
}

impl<S: Space> Climber<S> {
    /// A climber with these solvers; at least one.
    pub fn new(kinds: &[SolverKind]) -> Self {
        let rungs = kinds.iter().map(|k| (*k, k.make())).collect();
        Climber { rungs, part: Part::default(), best: Impulses::default() }
    }
    /// Another with solvers of these kinds.
    pub fn like(&self) -> Self {
        let kinds: Vec<SolverKind> = self.rungs.iter().map(|(kind, _)| *kind).collect();
        Climber::new(&kinds)
    }
    /// The kind of the first solver.
    pub fn kind(&self) -> SolverKind {
        self.rungs[0].0
    }
    /// The first solver.
    pub fn first(&self) -> &dyn ImpulseSolver<S> {
        self.rungs[0].1.as_ref()
    }
    /// The same, to solve.
    pub fn first_mut(&mut self) -> &mut dyn ImpulseSolver<S> {
        self.rungs[0].1.as_mut()
    }

    /// Solves an island of a problem, and puts its impulses back.
    pub fn climb(
        &mut self,
        (problem, islands, island): (&ContactProblem<S>, &Islands, usize),
        settings: &SolveSettings,
        impulses: &mut Impulses<S>,
        watch: &mut Watch,
    ) -> Climbed {
        if is_whole(problem, islands) {
            return self.climb_with((problem, impulses), settings, watch);
        }
        let climbed = self.climb_out((problem, islands, island), settings, impulses, watch);
        self.part.give(impulses, islands, island);
        climbed
    }

    /// The same, and leaves its impulses in the part.
    pub fn climb_out(
        &mut self,
        (problem, islands, island): (&ContactProblem<S>, &Islands, usize),
        settings: &SolveSettings,
        impulses: &Impulses<S>,
        watch: &mut Watch,
    ) -> Climbed {
        let mut part = std::mem::take(&mut self.part);
        part.take(problem, impulses, islands, island);
        let climbed = self.climb_with((&part.problem, &mut part.impulses), settings, watch);
        self.part = part;
        climbed
    }

    /// Solves a problem that is one island.
    fn climb_with(
        &mut self,
        (problem, impulses): (&ContactProblem<S>, &mut Impulses<S>),
        settings: &SolveSettings,
        watch: &mut Watch,
    ) -> Climbed {
        let mut stages: Vec<StageReport> = Vec::new();
        let mut found: Option<(Residual, Stop)> = None;
        let mut strict_feasibility = None;
        for (kind, solver) in &mut self.rungs {
            let outcome = solver.solve_watched(problem, settings, impulses, watch);
            let (residual, stop) = (outcome.residual, outcome.stop);
            strict_feasibility = outcome.strict_feasibility.or(strict_feasibility);
            stages.push(StageReport {
                solver: *kind,
                iterations: outcome.iterations,
                factorisations: outcome.factorisations,
                residual: residual.absolute,
                stop: stop.clone(),
            });
            let is_refused = matches!(stop, Stop::Refused(_));
            let is_better = !is_refused
                && found.as_ref().is_none_or(|(before, _)| {
                    before.absolute.is_nan() || residual.absolute <= before.absolute
                });
            if is_better {
                self.best.copy_from(impulses);
                found = Some((residual, stop.clone()));
            } else if found.is_some() {
                // what a refusal or a worse answer leaves is not the start of the next stage
                impulses.copy_from(&self.best);
            }
            if stop == Stop::Interrupted {
                let residual = found.map_or(residual, |(residual, _)| residual);
                let stages = stages.into();
                return Climbed { stages, residual, stop: Stop::Interrupted, strict_feasibility };
            }
            if !is_refused && residual.absolute <= settings.tolerance {
                strict_feasibility = None;
                break;
            }
        }
        let (residual, stop) = found.unwrap_or_else(|| {
            let last = stages.last().map(|s| s.stop.clone()).unwrap_or(Stop::Converged);
            (residual(problem, impulses), last)
        });
        Climbed { stages: stages.into(), residual, stop, strict_feasibility }
    }
}
