//! How hard a solve tries. The scheme aims at a residual far below the run's tolerance; nearly all problems reach it in
//! a few factorisations. The rest would go the long ways round through thousands, to no one's good: after so many they
//! are content with the run's tolerance, and go on from where they are only while they miss that as well.

use carom_geometry::Geometry;
use carom_solver::{
    ContactProblem, Content, ImpulseChoice, ImpulseSolver, Impulses, Outcome, SolveSettings, Stop, Watch,
};

/// Factorisations after which a solve is content with the run's tolerance.
pub const AIM: usize = 60;
/// The same in heaps, whose solves are many and large, and whose motion is known to a step's length anyway.
pub const AIM_IN_HEAPS: usize = 12;

/// A solver that tries no harder than it must.
pub struct Aiming<'a, S: Geometry> {
    /// The solver.
    pub solver: &'a mut dyn ImpulseSolver<S>,
    /// Residual that is good enough where the one that is asked for takes long \[m/s\]; infinite where any is.
    pub enough: f64,
    /// Factorisations after which that is what is asked for.
    pub after: usize,
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
        let enough = self.enough.max(settings.tolerance);
        let content = Content { after: self.after, tolerance: enough };
        let asked = SolveSettings { content: Some(content), ..*settings };
        let outcome = self.solver.solve_watched(problem, &asked, impulses, watch);
        let left = settings.factorisations.saturating_sub(outcome.factorisations);
        if outcome.stop != Stop::OutOfFactorisations || outcome.residual.absolute <= enough || left == 0 {
            return outcome;
        }
        // the solver's own measure is within a small factor of the residual, and was content too soon
        let spent = (outcome.iterations, outcome.factorisations);
        let all = SolveSettings { tolerance: enough, factorisations: left, ..*settings };
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

    /// Is content before the residual is; keeps what it was asked.
    struct Hasty(Vec<SolveSettings>);

    impl ImpulseSolver<Spatial> for Hasty {
        fn name(&self) -> &'static str {
            "hasty"
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
            let (absolute, stop) = match settings.content {
                Some(_) => (1e-5, Stop::OutOfFactorisations),
                None => (0.0, Stop::Converged),
            };
            let mut outcome = Outcome::new(1, Residual { absolute, relative: 0.0, worst: None }, stop);
            outcome.factorisations = AIM;
            outcome
        }
    }

    /// What a hasty solver is asked for where a residual is enough.
    fn asked(impulses: ImpulseChoice, enough: f64) -> Vec<SolveSettings> {
        let mass = |linear| InverseMass { linear, ..InverseMass::default() };
        let mut problem = ContactProblem::new(vec![mass(1.0), mass(0.0)], vec![Twist::default(); 2]);
        let (on_a, on_b) = (Twist::new(vec3(1.0, 0.0, 0.0), Vec3::ZERO), Twist::default());
        let (lo, hi) = (f64::NEG_INFINITY, f64::INFINITY);
        problem.rows.push(BoundedRow { id: 0, a: 0, b: 1, on_a, on_b, target: 0.0, lo, hi });
        let mut hasty = Hasty(Vec::new());
        let settings = SolveSettings {
            impulses,
            tolerance: 1e-12,
            iterations: 100,
            factorisations: 2000,
            content: None,
            polish: false,
        };
        let mut given = Impulses::zero(&problem);
        Aiming { solver: &mut hasty, enough, after: AIM }.solve_watched(
            &problem,
            &settings,
            &mut given,
            &mut unwatched,
        );
        hasty.0
    }

    #[test]
    fn a_solve_that_takes_long_is_told_what_will_do_and_not_asked_twice() {
        let asked = asked(ImpulseChoice::Any, 1e-4);
        assert_eq!(asked.len(), 1);
        assert_eq!(asked[0].content, Some(Content { after: AIM, tolerance: 1e-4 }));
        assert_eq!((asked[0].tolerance, asked[0].factorisations), (1e-12, 2000));
    }

    #[test]
    fn what_misses_the_runs_tolerance_is_solved_to_it_with_all_that_is_left() {
        let asked = asked(ImpulseChoice::Any, 1e-6);
        assert_eq!(asked.iter().map(|s| s.factorisations).collect::<Vec<_>>(), [2000, 2000 - AIM]);
        assert_eq!((asked[1].tolerance, asked[1].content), (1e-6, None));
    }

    #[test]
    fn the_least_impulses_are_looked_for_with_all_there_is() {
        let asked = asked(ImpulseChoice::MinimumNorm, 1e-4);
        assert_eq!((asked.len(), asked[0].factorisations, asked[0].tolerance), (1, 2000, 1e-12));
        assert_eq!(asked[0].content, None);
    }
}
