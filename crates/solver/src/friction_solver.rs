//! The door to solvers of problems in matrix form: one trait, one judge (`measure`), whatever the method.

use crate::friction_measure::{Measure, measure};
use crate::friction_problem::{FrictionProblem, project_on_cone};
use crate::impulse_solver::{ImpulseChoice, most_factorisations};
use crate::watch::Watch;
use serde::Serialize;
use smallvec::SmallVec;

/// How exactly, and for how long, to solve.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FrictionSettings {
    /// Solved means `Measure::solves(tolerance)` \[1\].
    pub tolerance: f64,
    /// Most sweeps or first-order iterations to spend \[1\].
    pub iterations: usize,
    /// Most factorisations to spend \[1\]; read by solvers that factorise.
    pub factorisations: usize,
    /// Which of several solutions to return.
    pub impulses: ImpulseChoice,
}

impl Default for FrictionSettings {
    /// 1e-8; a hundred thousand sweeps and two thousand factorisations are more than any well-posed problem of
    /// the public collections takes.
    fn default() -> Self {
        FrictionSettings {
            tolerance: 1e-8,
            iterations: 100_000,
            factorisations: most_factorisations(),
            impulses: ImpulseChoice::Any,
        }
    }
}

/// Work done in one stage of a solve.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Stage {
    /// "sweeps", "interior point", "newton", "proximal newton", ...
    pub name: &'static str,
    /// Iterations spent in it; where a matrix falls into parts, the sweeps of the part that took most, all else together.
    pub iterations: usize,
}

/// Stages in order. One alone asks for no memory, which would take a good part of the time of a problem of a few unknowns.
pub type StageList = SmallVec<[Stage; 1]>;

/// What a solve came to.
#[derive(Clone, Debug, PartialEq)]
pub struct FrictionOutcome {
    /// True when the impulses returned are measured to solve the problem at the tolerance.
    pub solved: bool,
    /// Measures of the impulses returned.
    pub measure: Measure,
    /// The stages gone through, in order.
    pub stages: StageList,
    /// Factorisations spent in all stages.
    pub factorisations: usize,
    /// Wall-clock seconds of the solve alone, final measure excluded; 0 for what is solved at once, in less time than
    /// it takes to read a clock.
    pub seconds: f64,
    /// Why it is not solved, in words; empty when it is.
    pub reason: String,
    /// When not solved and known: the largest t, at most the largest entry of q, with some r such that
    /// u_N >= mu |u_T| + t everywhere \[m/s\]; at or below 0 no solution need exist. Its factorisations are not
    /// among those above.
    pub strict_feasibility: Option<f64>,
}

impl FrictionOutcome {
    /// A refusal; the impulses are left as they were given, on the cones.
    fn refused(problem: &FrictionProblem, reason: String, impulses: &mut [f64]) -> Self {
        impulses.iter_mut().filter(|r| !r.is_finite()).for_each(|r| *r = 0.0);
        let contacts = impulses.chunks_exact_mut(problem.dimension);
        contacts.zip(&problem.friction).for_each(|(r, &mu)| project_on_cone(r, mu));
        FrictionOutcome {
            solved: false,
            measure: measure(problem, impulses),
            stages: StageList::new(),
            factorisations: 0,
            seconds: 0.0,
            reason,
            strict_feasibility: None,
        }
    }
}

/// Finds the impulses of a friction problem in matrix form: `solve` is the door, `work` is the method behind it.
pub trait FrictionSolver {
    /// The solver's name as users write it.
    fn name(&self) -> &'static str;
    /// True when it can return these impulses.
    fn finds(&self, choice: ImpulseChoice) -> bool {
        choice == ImpulseChoice::Any
    }
    /// Solves in place, looking for impulses that `finds` allows.
    fn work(
        &mut self,
        problem: &FrictionProblem,
        settings: &FrictionSettings,
        impulses: &mut [f64],
        watch: &mut Watch,
    ) -> FrictionOutcome;
    /// Solves in place: `impulses` is the start on entry (zeros for none) and the best iterate on return, inside
    /// the cones.
    fn solve(
        &mut self,
        problem: &FrictionProblem,
        settings: &FrictionSettings,
        impulses: &mut [f64],
        watch: &mut Watch,
    ) -> FrictionOutcome {
        if self.finds(settings.impulses) {
            return self.work(problem, settings, impulses, watch);
        }
        FrictionOutcome::refused(problem, settings.impulses.refusal(self.name()), impulses)
    }
}
