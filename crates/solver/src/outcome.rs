//! What a solve came to: a value, never a panic.

use crate::impulse_solver::SolverKind;
use crate::residual::{Entry, Residual};
use serde::{Deserialize, Serialize};

/// Why a solver stopped.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Stop {
    /// The residual is at or below the tolerance.
    Converged,
    /// The method is at its end (iterations spent, or a direct answer that rounding spoils) with a residual above
    /// the tolerance: the residual is what it is. Where minimum-norm impulses were asked for, also with a residual
    /// within the tolerance: the impulses returned solve the problem, and are not known to be the least.
    OutOfIterations,
    /// The factorisations are spent with a residual above the tolerance; the impulses are the best of all stages.
    OutOfFactorisations,
    /// The method cannot solve this problem; the reason says why. The impulses are left as they were given.
    Refused(String),
    /// Whoever watched the solve asked to stop: the impulses are the best so far.
    Interrupted,
}

impl Stop {
    /// The name as users read it.
    pub fn name(&self) -> &'static str {
        match self {
            Stop::Converged => "converged",
            Stop::OutOfIterations => "out_of_iterations",
            Stop::OutOfFactorisations => "out_of_factorisations",
            Stop::Refused(_) => "refused",
            Stop::Interrupted => "interrupted",
        }
    }
    /// Why a solver refused.
    pub fn reason(&self) -> Option<&str> {
        match self {
            Stop::Refused(reason) => Some(reason),
            _ => None,
        }
    }
}

/// One solver's work on one island.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct StageReport {
    /// The solver.
    pub solver: SolverKind,
    /// Iterations it spent, factorisations included.
    pub iterations: usize,
    /// Factorisations among them; counted by solvers with a budget of them.
    #[serde(default)]
    pub factorisations: usize,
    /// Residual of what it found \[m/s\]; of what it was given where it refused.
    pub residual: f64,
    /// Why it stopped: any stop but `Converged` is why the island went further, where it did.
    pub stop: Stop,
}

/// The solvers that worked on an island, in order. Nearly always it is one, which asks for no memory: a world at rest has an
/// island for each of its bodies.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(from = "Vec<StageReport>", into = "Vec<StageReport>")]
pub enum Stages {
    /// One alone.
    One([StageReport; 1]),
    /// Any number.
    Several(Vec<StageReport>),
}

impl From<Vec<StageReport>> for Stages {
    fn from(all: Vec<StageReport>) -> Self {
        <[StageReport; 1]>::try_from(all).map_or_else(Stages::Several, Stages::One)
    }
}

impl From<Stages> for Vec<StageReport> {
    fn from(stages: Stages) -> Self {
        match stages {
            Stages::One([stage]) => vec![stage],
            Stages::Several(all) => all,
        }
    }
}

impl std::ops::Deref for Stages {
    type Target = [StageReport];
    fn deref(&self) -> &[StageReport] {
        match self {
            Stages::One(one) => one,
            Stages::Several(all) => all,
        }
    }
}

/// How one island was solved: a set of movable bodies that contacts and rows join.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct IslandReport {
    /// Contacts of the island.
    pub contacts: usize,
    /// Bounded rows of the island.
    pub rows: usize,
    /// Movable bodies of the island.
    pub bodies: usize,
    /// The smallest index among them, which names the island.
    pub first_body: usize,
    /// Residual of the impulses returned \[m/s\].
    pub residual: f64,
    /// The residual divided by that of no impulses at all \[1\].
    pub relative_residual: f64,
    /// Entry of the whole problem where it is largest.
    pub worst: Option<Entry>,
    /// What `Outcome::strict_feasibility` is, of this island.
    #[serde(default)]
    pub strict_feasibility: Option<f64>,
    /// The solvers that worked on it, in order.
    pub stages: Stages,
}

/// How an island of one contact was solved at once.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AtOnce {
    /// The solver that had the impulse in closed form.
    pub solver: SolverKind,
    /// What the impulse leaves; entries are counted within the island.
    pub residual: Residual,
}

impl AtOnce {
    /// The only stage.
    pub fn stages(&self) -> Stages {
        let (solver, residual, stop) = (self.solver, self.residual.absolute, Stop::Converged);
        Stages::One([StageReport {
            solver,
            iterations: AtOnce::ITERATIONS,
            factorisations: 0,
            residual,
            stop,
        }])
    }
    /// Iterations that it counts as.
    pub const ITERATIONS: usize = 1;
    /// The report of the island, which has so many movable bodies, the first of this index.
    pub fn island(&self, bodies: usize, first_body: usize, worst: Option<Entry>) -> IslandReport {
        IslandReport {
            contacts: 1,
            rows: 0,
            bodies,
            first_body,
            residual: self.residual.absolute,
            relative_residual: self.residual.relative,
            worst,
            strict_feasibility: None,
            stages: self.stages(),
        }
    }
}

impl IslandReport {
    /// Iterations of all stages.
    pub fn iterations(&self) -> usize {
        self.stages.iter().map(|s| s.iterations).sum()
    }
    /// Why the island went past its first solver, in words; empty when it did not.
    pub fn why_further(&self, tolerance: f64) -> String {
        let passed = &self.stages[..self.stages.len().saturating_sub(1)];
        let words = passed.iter().map(|s| match &s.stop {
            Stop::Refused(reason) => format!("{} refused: {reason}", s.solver.name()),
            _ => format!(
                "{} left {:.1e} m/s of {tolerance:.1e} m/s after {} iterations",
                s.solver.name(),
                s.residual,
                s.iterations
            ),
        });
        words.collect::<Vec<_>>().join("; ")
    }
}

/// Result of one solve.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Outcome {
    /// Iterations (sweeps, pivots, rounds, factorisations) spent.
    pub iterations: usize,
    /// Factorisations among them; counted by solvers with a budget of them.
    #[serde(default)]
    pub factorisations: usize,
    /// Residual of the impulses returned.
    pub residual: Residual,
    /// Why the solver stopped.
    pub stop: Stop,
    /// The islands where anything pressed, in order of their first entry, from solvers that go island by island;
    /// empty from all others.
    #[serde(default)]
    pub islands: Vec<IslandReport>,
    /// When not solved and known: the largest t, at most the largest entry of q, with some r such that
    /// u_N >= mu |u_T| + t at every contact, u = W r + q with targets in q \[m/s\]; at or below 0 no solution need
    /// exist. Told of contacts with Coulomb's disc alone, by `exact` where all of its stages fail or a hundred
    /// factorisations do not do; over several islands the least of those told. Its factorisations are not among
    /// those above.
    #[serde(default)]
    pub strict_feasibility: Option<f64>,
}

impl Outcome {
    /// An outcome without islands.
    pub fn new(iterations: usize, residual: Residual, stop: Stop) -> Self {
        Outcome {
            iterations,
            factorisations: 0,
            residual,
            stop,
            islands: Vec::new(),
            strict_feasibility: None,
        }
    }
    /// The outcome of a problem without rows.
    pub fn nothing_to_do() -> Self {
        Outcome::new(0, Residual::default(), Stop::Converged)
    }
    /// Judges impulses by their residual.
    pub fn judged(iterations: usize, residual: Residual, tolerance: f64) -> Self {
        let stop = if residual.absolute <= tolerance { Stop::Converged } else { Stop::OutOfIterations };
        Outcome::new(iterations, residual, stop)
    }
}
