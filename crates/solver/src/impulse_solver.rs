//! The one door to all solvers. Finds impulses; knows rows, cones and bounds; no shape, no world, no clock.

use crate::exact::ExactContacts;
use crate::methods::ladder::Resting;
use crate::methods::{
    apgd::Apgd, auto, direct::Direct, enumeration::Enumeration, lemke::Lemke, nncg::Nncg,
    on_bodies::OnBodies, pgs::Pgs, pgs_matrix::PgsMatrix, sequential::Sequential,
};
use crate::outcome::{AtOnce, Outcome, Stop};
use crate::prepared::PreparedContact;
use crate::problem::{ContactProblem, FrictionLaw, Impulse, Impulses, Twist};
use crate::residual::residual;
use crate::watch::{Watch, unwatched};
use carom_math::{Space, Workers};
use serde::{Deserialize, Serialize};
use std::str::FromStr;

/// Which of several impulses that solve a problem to return. More contacts than a body has freedoms, a table on four
/// legs, leave single impulses open though their resultants are not.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ImpulseChoice {
    /// Whichever the method arrives at: they depend on the start and on the order of contacts.
    #[default]
    Any,
    /// Those with the least sum of squares \[N^2 s^2\]: they depend on nothing but the problem. Beside rolling and
    /// spinning friction the moments that rest are the least first \[N^2 m^2 s^2\]; bounded rows count in their own units.
    MinimumNorm,
}

impl ImpulseChoice {
    /// The name as users write it.
    pub fn name(self) -> &'static str {
        match self {
            ImpulseChoice::Any => "any",
            ImpulseChoice::MinimumNorm => "minimum_norm",
        }
    }
    /// What a solver says that does not look for these impulses.
    pub(crate) fn refusal(self, solver: &str) -> String {
        let (asked, exact) = (self.name(), SolverKind::Exact.name());
        format!("{solver} does not look for {asked} impulses; use {exact}, or auto, or take any")
    }
}

impl FromStr for ImpulseChoice {
    type Err = String;
    fn from_str(name: &str) -> Result<Self, String> {
        [ImpulseChoice::Any, ImpulseChoice::MinimumNorm]
            .into_iter()
            .find(|c| c.name() == name)
            .ok_or_else(|| format!("unknown choice of impulses {name:?}; known: any, minimum_norm"))
    }
}

/// How long and how exactly to solve.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct SolveSettings {
    /// Most iterations to spend \[1\]. `exact` takes no more sweeps, but where a thousand of them take no longer than 30
    /// factorisations: there these count.
    pub iterations: usize,
    /// Stop when the residual is at or below this \[m/s\]; 0 spends all iterations.
    pub tolerance: f64,
    /// Most factorisations to spend \[1\]; read by solvers that factorise.
    #[serde(default = "most_factorisations")]
    pub factorisations: usize,
    /// Which of several solutions to return.
    #[serde(default)]
    pub impulses: ImpulseChoice,
    /// What will do where the tolerance takes long; read by solvers that factorise.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub content: Option<Content>,
    /// True where the impulses begin the solve of a problem much like this one, as in bodies at rest: those that are factorised
    /// for are taken well below the tolerance, at most one more factorisation beyond it. Read by `exact`.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub polish: bool,
}

/// What a solve is content with in the end.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Content {
    /// Factorisations from which on it is \[1\].
    pub after: usize,
    /// Residual \[m/s\].
    pub tolerance: f64,
}

/// More than any well-posed problem of the public collections takes.
pub fn most_factorisations() -> usize {
    2000
}

impl Default for SolveSettings {
    /// 100 iterations, 1e-6 m/s: a micrometre per second is below what a recorded run can show.
    fn default() -> Self {
        SolveSettings {
            iterations: 100,
            tolerance: 1e-6,
            factorisations: most_factorisations(),
            impulses: ImpulseChoice::Any,
            content: None,
            polish: false,
        }
    }
}

/// Finds the impulses of a contact problem: `solve` and `solve_watched` are the door, `work` is the method behind it.
pub trait ImpulseSolver<S: Space>: Send {
    /// The solver's name as users write it.
    fn name(&self) -> &'static str;
    /// Why it does not take a problem, with the remedy; nothing where it does.
    fn refusal(&self, _problem: &ContactProblem<S>) -> Option<String> {
        None
    }
    /// True when it can return these impulses.
    fn finds(&self, choice: ImpulseChoice) -> bool {
        choice == ImpulseChoice::Any
    }
    /// Solves a problem with rows that is not refused; `impulses` fit it. Solvers that are never long ignore the watch.
    fn work(
        &mut self,
        problem: &ContactProblem<S>,
        settings: &SolveSettings,
        impulses: &mut Impulses<S>,
        watch: &mut Watch,
    ) -> Outcome;
    /// Shares the work of the coming solves among these workers, where the solver goes island by island: no bit of an answer
    /// depends on their number. Others ignore it.
    fn share(&mut self, _workers: &Workers) {}
    /// The impulse of a contact that is alone between its bodies, which have these velocities without it, from an old one:
    /// what `solve` would come to, without its preparations. `None` where the solver has no closed form of it.
    fn alone(
        &self,
        _contact: &PreparedContact<S>,
        _law: FrictionLaw,
        _velocities: &[Twist<S>],
        _old: &Impulse<S>,
    ) -> Option<Impulse<S>> {
        None
    }
    /// The same of a contact without friction, from its approach \[m/s\] and the mass behind its normal \[kg\].
    fn alone_on_normal(&self, _approach: f64, _normal_mass: f64) -> Option<f64> {
        None
    }
    /// Finds the impulses of those contacts of a problem of nothing but contacts without friction that are `asked` for, whole
    /// islands all at once, to a tolerance \[m/s\] and with at most so many factorisations, and leaves it to the caller to
    /// measure them; iterations, and factorisations among them. `None`, and the impulses are as they were, where the solver has
    /// no such way or does not come to its end.
    fn all_on_normals(
        &mut self,
        _asked: (&ContactProblem<S>, &[bool]),
        _limits: (f64, usize),
        _impulses: &mut Impulses<S>,
        _watch: &mut Watch,
    ) -> Option<(usize, usize)> {
        None
    }
    /// What `solve` would come to on a problem of this contact alone, from nothing: the normal impulse \[N s\], and the report
    /// where it presses. `None` where the solver would not do it at once.
    fn solve_resting(
        &self,
        _contact: &Resting<S>,
        _settings: &SolveSettings,
    ) -> Option<(f64, Option<AtOnce>)> {
        None
    }
    /// Solves in place: `impulses` is the warm start on entry and the answer on return.
    fn solve(
        &mut self,
        problem: &ContactProblem<S>,
        settings: &SolveSettings,
        impulses: &mut Impulses<S>,
    ) -> Outcome {
        self.solve_watched(problem, settings, impulses, &mut unwatched)
    }
    /// The same under observation: long solves tell their progress and stop when asked, with the best impulses so
    /// far and `Stop::Interrupted`.
    fn solve_watched(
        &mut self,
        problem: &ContactProblem<S>,
        settings: &SolveSettings,
        impulses: &mut Impulses<S>,
        watch: &mut Watch,
    ) -> Outcome {
        impulses.fit(problem);
        if problem.scalar_rows() == 0 {
            return Outcome::nothing_to_do();
        }
        let unfit = (!self.finds(settings.impulses)).then(|| settings.impulses.refusal(self.name()));
        if let Some(reason) = unfit.or_else(|| self.refusal(problem)) {
            return Outcome::new(0, residual(problem, impulses), Stop::Refused(reason));
        }
        self.work(problem, settings, impulses, watch)
    }
}

/// The solvers by name.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum SolverKind {
    /// One collision at a time; impulses are never taken back.
    Sequential,
    /// Projected Gauss-Seidel without a matrix.
    #[default]
    Pgs,
    /// Projected Gauss-Seidel on the assembled sparse A.
    PgsMatrix,
    /// Sparse factorisation, when A is regular and every impulse comes out admissible.
    Direct,
    /// Lemke's pivoting: exact for linear complementarity.
    Lemke,
    /// Conjugate gradients over the sweeps of `Pgs`.
    Nncg,
    /// Accelerated projected gradients: products with A only.
    Apgd,
    /// Every combination of contact modes: an oracle for a handful of contacts.
    Enumeration,
    /// Interior point and Newton on the nonassociated law: true Coulomb friction to any tolerance.
    Exact,
    /// Island by island, the cheap sweep first, stronger methods only where the residual asks for them.
    Auto,
}

/// Solvers that an island goes on to when the residual asks for more than its own can give, weakest first.
const STRONGER: [SolverKind; 3] = [SolverKind::Nncg, SolverKind::Exact, SolverKind::Lemke];

impl SolverKind {
    /// All solvers.
    pub const ALL: [SolverKind; 10] = [
        SolverKind::Sequential,
        SolverKind::Pgs,
        SolverKind::PgsMatrix,
        SolverKind::Direct,
        SolverKind::Lemke,
        SolverKind::Nncg,
        SolverKind::Apgd,
        SolverKind::Enumeration,
        SolverKind::Exact,
        SolverKind::Auto,
    ];
    /// The name as users write it.
    pub fn name(self) -> &'static str {
        match self {
            SolverKind::Sequential => "sequential",
            SolverKind::Pgs => "pgs",
            SolverKind::PgsMatrix => "pgs_matrix",
            SolverKind::Direct => "direct",
            SolverKind::Lemke => "lemke",
            SolverKind::Nncg => "nncg",
            SolverKind::Apgd => "apgd",
            SolverKind::Enumeration => "enumeration",
            SolverKind::Exact => "exact",
            SolverKind::Auto => "auto",
        }
    }
    /// True for solvers whose cost or answer gains by solving each island by itself. Sweeps visit the same rows in the
    /// same order either way: over everything they are up to twice as fast where one sweep suffices (taking islands
    /// out costs as much as a sweep), four times slower where one island of a hundred is hard.
    pub fn goes_by_island(self) -> bool {
        !matches!(self, SolverKind::Sequential | SolverKind::Pgs | SolverKind::PgsMatrix)
    }
    /// The solvers stronger than this one, weakest first; none above the strongest.
    pub fn stronger(self) -> &'static [SolverKind] {
        match STRONGER.iter().position(|k| *k == self) {
            Some(rung) => &STRONGER[rung + 1..],
            None if self == SolverKind::Auto => &[],
            None => &STRONGER,
        }
    }
    /// A fresh solver of this kind.
    pub fn make<S: Space>(self) -> Box<dyn ImpulseSolver<S>> {
        match self {
            SolverKind::Sequential => Box::new(Sequential::<S>::default()),
            SolverKind::Pgs => Box::new(Pgs::<S>::default()),
            SolverKind::PgsMatrix => Box::new(PgsMatrix),
            SolverKind::Direct => Box::new(Direct),
            SolverKind::Lemke => Box::new(Lemke),
            SolverKind::Nncg => Box::new(OnBodies::<S, Nncg>::default()),
            SolverKind::Apgd => Box::new(OnBodies::<S, Apgd>::default()),
            SolverKind::Enumeration => Box::new(Enumeration),
            SolverKind::Exact => Box::new(ExactContacts::<S>::default()),
            SolverKind::Auto => Box::new(auto::ladder::<S>()),
        }
    }
}

impl FromStr for SolverKind {
    type Err = String;
    fn from_str(name: &str) -> Result<Self, String> {
        SolverKind::ALL.into_iter().find(|k| k.name() == name).ok_or_else(|| {
            let known = SolverKind::ALL.map(SolverKind::name).join(", ");
            format!("unknown solver {name:?}; known: {known}")
        })
    }
}
