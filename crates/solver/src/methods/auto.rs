//! The solver that asks for no more than the residual needs: every island gets the cheap sweep first, and goes on
//! to stronger methods only while its residual is above the tolerance. The outcome's islands say how far each went.
//! Knows no method: the ladder does the climbing.

use crate::impulse_solver::{ImpulseSolver, SolveSettings, SolverKind};
use crate::methods::ladder::Ladder;
use crate::outcome::Outcome;
use crate::problem::{ContactProblem, Impulses};
use crate::watch::Watch;
use carom_math::Space;

/// The stages in order. Conjugate gradients take the sweeps on at the same cost each; `exact` solves every contact
/// law to any tolerance by factorising; `lemke` takes what `exact` refuses, bounded rows in small problems.
const STAGES: [SolverKind; 4] = [SolverKind::Pgs, SolverKind::Nncg, SolverKind::Exact, SolverKind::Lemke];

/// See the module.
pub struct Auto<S: Space> {
    ladder: Ladder<S>,
}

impl<S: Space> Default for Auto<S> {
    fn default() -> Self {
        Auto { ladder: Ladder::new("auto", &STAGES) }
    }
}

impl<S: Space> ImpulseSolver<S> for Auto<S> {
    fn name(&self) -> &'static str {
        "auto"
    }
    fn solve(
        &mut self,
        problem: &ContactProblem<S>,
        settings: &SolveSettings,
        impulses: &mut Impulses<S>,
    ) -> Outcome {
        self.ladder.solve(problem, settings, impulses)
    }
    fn solve_watched(
        &mut self,
        problem: &ContactProblem<S>,
        settings: &SolveSettings,
        impulses: &mut Impulses<S>,
        watch: &mut Watch,
    ) -> Outcome {
        self.ladder.solve_watched(problem, settings, impulses, watch)
    }
}
