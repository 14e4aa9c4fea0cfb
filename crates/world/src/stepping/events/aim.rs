//! How hard a solve tries. The scheme aims at a residual far below the run's tolerance; nearly all problems reach it in
//! a few factorisations. The rest would go the long ways round through thousands, to no one's good: they end at the
//! run's tolerance, and only what misses that as well is solved with all that the settings allow.

use carom_geometry::Geometry;
use carom_solver::{
    ContactProblem, ImpulseChoice, ImpulseSolver, Impulses, Outcome, SolveSettings, Stop, Watch,
};

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
    fn finds(&self, choice: ImpulseChoice) -> bool {
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
        if settings.impulses != ImpulseChoice::Any {
            // the least impulses are told by nothing but the solver's own word that it has found them
            return self.solver.solve_watched(problem, settings, impulses, watch);
        }
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

#[cfg(test)]
mod tests {
    use super::*;
    use carom_math::{Column, Spatial, Vec3, vec3};
    use carom_solver::{BoundedRow, InverseMass, Residual, Twist, unwatched};

    /// Reaches a residual only with more factorisations than the aim has; keeps what it was asked.
    struct Slow(Vec<SolveSettings>);

    impl ImpulseSolver<Spatial> for Slow {
        fn name(&self) -> &'static str {
            "slow"
        }
        fn finds(&self, _choice: ImpulseChoice) -> bool {
            true
        }
        fn work(
            &mut self,
            _problem: &ContactProblem<Spatial>,
            settings: &SolveSettings,
            _impulses: &mut Impulses<Spatial>,
            _watch: &mut Watch,
        ) -> Outcome {
            self.0.push(*settings);
            let (absolute, stop) = if settings.factorisations > AIM {
                (0.0, Stop::Converged)
            } else {
                (1e-5, Stop::OutOfFactorisations)
            };
            Outcome::new(1, Residual { absolute, relative: 0.0, worst: None }, stop)
        }
    }

    /// What a slow solver is asked for where a residual is enough.
    fn asked(impulses: ImpulseChoice, enough: f64) -> Vec<SolveSettings> {
        let mass = |linear| InverseMass { linear, ..InverseMass::default() };
        let mut problem = ContactProblem::new(vec![mass(1.0), mass(0.0)], vec![Twist::default(); 2]);
        let (on_a, on_b) = (Twist::new(vec3(1.0, 0.0, 0.0), Vec3::ZERO), Twist::default());
        let (lo, hi) = (f64::NEG_INFINITY, f64::INFINITY);
        problem.rows.push(BoundedRow { id: 0, a: 0, b: 1, on_a, on_b, target: 0.0, lo, hi });
        let mut slow = Slow(Vec::new());
        let settings = SolveSettings { impulses, tolerance: 1e-12, iterations: 100, factorisations: 2000 };
        let mut given = Impulses::zero(&problem);
        Aiming { solver: &mut slow, enough }.solve_watched(&problem, &settings, &mut given, &mut unwatched);
        slow.0
    }

    #[test]
    fn what_is_good_enough_after_a_few_factorisations_is_not_solved_further() {
        assert_eq!(asked(ImpulseChoice::Any, 1e-4).len(), 1);
    }

    #[test]
    fn what_misses_the_runs_tolerance_is_solved_to_it_with_all_there_is() {
        let asked = asked(ImpulseChoice::Any, 1e-6);
        assert_eq!(asked.iter().map(|s| s.factorisations).collect::<Vec<_>>(), [AIM, 2000]);
        assert_eq!(asked[1].tolerance, 1e-6);
    }

    #[test]
    fn the_least_impulses_are_looked_for_with_all_there_is() {
        let asked = asked(ImpulseChoice::MinimumNorm, 1e-4);
        assert_eq!((asked.len(), asked[0].factorisations, asked[0].tolerance), (1, 2000, 1e-12));
    }
}
