//! Newton's law at all contacts at once: u_n+ >= target with target = -e u_n-, gamma >= 0, complementary, found
//! by the chosen solver (theory chapter 4); u_t+ = -e_t u_t- inside the friction limit (eq. 3.19). Symmetric; a blow is shared among all touching bodies.

use carom_math::Space;
use carom_solver::{ContactProblem, ImpulseSolver, Impulses, Outcome, SolveSettings, Watch};

/// Solves the impact problem as it stands.
pub fn solve<S: Space>(
    problem: &ContactProblem<S>,
    settings: &SolveSettings,
    solver: &mut dyn ImpulseSolver<S>,
    impulses: &mut Impulses<S>,
    watch: &mut Watch,
) -> Outcome {
    solver.solve_watched(problem, settings, impulses, watch)
}
