//! How hard a solve tries. The scheme aims at a residual far below the run's tolerance; nearly all problems reach it in
//! a few factorisations. The rest would go the long ways round through thousands, to no one's good: they end at the
//! run's tolerance, and only what misses that as well is solved with all that the settings allow.

use carom_geometry::Geometry;
use carom_solver::{ContactProblem, ImpulseSolver, Impulses, Outcome, SolveSettings, Stop, Watch};

/// Factorisations after which a solve is content with the run's tolerance.
const AIM: usize = 60;

/// A solver that tries no harder than it must.
pub struct Aiming<'a, S: Geometry> {
    /// The solver.
    pub solver: &'a mut dyn ImpulseSolver<S>,
    /// Residual that is good enough where the one that is asked for takes long \[m/s\]; infinite where any is.
    pub enough: f64,
}

impl<S: Geometry> ImpulseSolver<S> for Aiming<'_, S> {
    fn name(&self) -> &'static str {
        self.solver.name()
    }
    fn finds(&self, choice: carom_solver::ImpulseChoice) -> bool {
        self.solver.finds(choice)
    }
    fn refusal(&self, problem: &ContactProblem<S>) -> Option<String> {
        self.solver.refusal(problem)
    }
    fn work(
        &mut self,
        problem: &ContactProblem<S>,
        settings: &SolveSettings,
        impulses: &mut Impulses<S>,
        watch: &mut Watch,
    ) -> Outcome {
        let few = SolveSettings { factorisations: settings.factorisations.min(AIM), ..*settings };
        let outcome = self.solver.solve_watched(problem, &few, impulses, watch);
        let is_short = outcome.stop == Stop::OutOfFactorisations && settings.factorisations > AIM;
        let enough = self.enough.max(settings.tolerance);
        if !is_short || outcome.residual.absolute <= enough {
            return outcome;
        }
        let spent = (outcome.iterations, outcome.factorisations);
        let all = SolveSettings { tolerance: enough, ..*settings };
        let mut outcome = self.solver.solve_watched(problem, &all, impulses, watch);
        outcome.iterations += spent.0;
        outcome.factorisations += spent.1;
        outcome
    }
}
