//! The solvers under test and what each is held to: the one place where a new solver enters. A problem made of
//! bodies goes to both kinds: to solvers of contact problems as it is, to solvers in matrix form assembled.

use crate::contact::judge::errors;
use crate::contact::oracle::Oracle;
use carom_math::Space;
use carom_solver::delassus::{delassus, right_hand_side};
use carom_solver::{
    ContactProblem, FrictionOutcome, FrictionProblem, FrictionSettings, FrictionSolver, FrictionSolverKind,
    Impulses, SolveSettings, SolverKind, Stop, unwatched,
};

/// A solver in matrix form and what it is held to.
pub struct Candidate {
    pub solver: Box<dyn FrictionSolver>,
    /// The tolerance that it is documented to reach on well-posed problems \[1\].
    pub reach: f64,
    /// What it leaves in loads and motions when asked for its best, where the case itself asks for more \[1\].
    pub rest: f64,
    /// The share of well-posed problems that it must solve to its reach \[1\].
    pub share: f64,
}

impl Candidate {
    /// What a solver of this name is held to.
    fn of(solver: Box<dyn FrictionSolver>) -> Self {
        let (reach, rest, share) = match solver.name() {
            "exact" => (1e-8, 0.0, 1.0),
            "clarabel" => (1e-6, 1e-6, 0.4),
            // first-order methods: cheap digits; how many depends on the problem's condition
            "pgs" | "nncg" | "apgd" => (1e-4, 1e-2, 0.5),
            // oracles for special problems: the others they refuse
            _ => (1e-8, 1.0, 0.0),
        };
        Candidate { solver, reach, rest, share }
    }
}

/// All solvers in matrix form; clarabel as one of them, so that the tests themselves are tested.
pub fn candidates() -> Vec<Candidate> {
    let mut all: Vec<Box<dyn FrictionSolver>> = vec![Box::new(Oracle)];
    all.extend(FrictionSolverKind::ALL.into_iter().map(FrictionSolverKind::make));
    all.into_iter().map(Candidate::of).collect()
}

/// A way to solve a problem made of bodies.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Method {
    /// A solver of contact problems.
    Bodies(SolverKind),
    /// The candidate of this index, on the assembled W and q.
    Matrix(usize),
}

impl Method {
    /// The solver's name.
    pub fn name(self) -> String {
        match self {
            Method::Bodies(kind) => kind.name().into(),
            Method::Matrix(k) => format!("{} (matrix)", candidates()[k].solver.name()),
        }
    }
}

/// Methods that reach a solution to rounding or nearly so, frictional, redundant and sliding contacts included:
/// those with an error bound small enough to compare wrenches by.
pub fn accurate_methods() -> Vec<Method> {
    let mut all = vec![Method::Bodies(SolverKind::Exact)];
    all.extend((0..candidates().len()).filter(|&k| candidates()[k].rest <= 1e-6).map(Method::Matrix));
    all
}

/// The accurate methods that leave nothing but rounding.
pub fn exact_methods() -> Vec<Method> {
    accurate_methods().into_iter().filter(|m| rest(*m) == 0.0).collect()
}

/// What a method leaves in loads and motions where a case asks for more \[1\].
pub fn rest(method: Method) -> f64 {
    match method {
        Method::Bodies(_) => 0.0,
        Method::Matrix(k) => candidates()[k].rest,
    }
}

/// Solves as exactly as a method can: asks for more digits than there may be, and takes the best that comes back as
/// long as it is within the method's reach. How many digits there are depends on the problem.
pub fn solve_best<S: Space>(method: Method, problem: &ContactProblem<S>) -> Result<Impulses<S>, String> {
    let Method::Matrix(k) = method else {
        // tolerances here are speeds, and speeds have the problem's unit
        let speed = right_hand_side(problem).iter().fold(0.0_f64, |m, b| m.max(b.abs()));
        let mut last = Err(String::new());
        for digits in [1e-13, 1e-12, 1e-11, 1e-10, 1e-9, 1e-8] {
            last = solve_bodies(method, problem, digits * speed);
            if last.is_ok() {
                break;
            }
        }
        return last;
    };
    let Candidate { mut solver, reach, .. } = candidates().swap_remove(k);
    let settings = FrictionSettings { tolerance: 1e-13, ..FrictionSettings::default() };
    let matrix = assembled(problem);
    let (r, outcome) = solve_matrix(solver.as_mut(), &matrix, &settings);
    if errors(&matrix, &r).solve(reach) {
        return Ok(Impulses::from_flat(problem, &r).expect("as many numbers as rows"));
    }
    Err(format!("{}; {:?}", outcome.reason, outcome.measure))
}

/// The contacts of a problem without bounded rows in matrix form: u - target = W r + q.
pub fn assembled<S: Space>(problem: &ContactProblem<S>) -> FrictionProblem {
    assert!(problem.rows.is_empty(), "bounded rows have no place in a friction problem");
    FrictionProblem {
        dimension: 1 + S::SLIP,
        matrix: delassus(problem).into(),
        velocity: right_hand_side(problem).iter().map(|b| -b).collect(),
        friction: problem.contacts.iter().map(|c| c.friction).collect(),
    }
}

/// Solves in matrix form from zero.
pub fn solve_matrix(
    solver: &mut dyn FrictionSolver,
    problem: &FrictionProblem,
    settings: &FrictionSettings,
) -> (Vec<f64>, FrictionOutcome) {
    let mut impulses = vec![0.0; problem.velocity.len()];
    let outcome = solver.solve(problem, settings, &mut impulses, &mut unwatched);
    (impulses, outcome)
}

/// Solves a problem made of bodies from zero; `Err` with the reason where the method does not claim a solution.
/// Tolerance: of the residual \[m/s\] for solvers of contact problems, of the measure \[1\] for the others.
pub fn solve_bodies<S: Space>(
    method: Method,
    problem: &ContactProblem<S>,
    tolerance: f64,
) -> Result<Impulses<S>, String> {
    match method {
        Method::Bodies(kind) => {
            let mut impulses = Impulses::zero(problem);
            let settings = SolveSettings { iterations: 1_000_000, tolerance, ..SolveSettings::default() };
            let outcome = kind.make().solve(problem, &settings, &mut impulses);
            match outcome.stop {
                Stop::Converged => Ok(impulses),
                stop => Err(format!("{stop:?} with a residual of {:e}", outcome.residual.absolute)),
            }
        }
        Method::Matrix(k) => {
            let settings = FrictionSettings { tolerance, ..FrictionSettings::default() };
            let solver = &mut candidates()[k].solver;
            let (r, outcome) = solve_matrix(solver.as_mut(), &assembled(problem), &settings);
            if !outcome.solved {
                return Err(format!("{}; {:?}", outcome.reason, outcome.measure));
            }
            Ok(Impulses::from_flat(problem, &r).expect("as many numbers as rows"))
        }
    }
}
