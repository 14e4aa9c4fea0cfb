//! The time-stepping schemes. A scheme owns its loop; what they share stands here.

pub mod events;
pub mod fixed_step;
mod held;
pub mod schemes;
pub mod soft_step;

use crate::bodies::Bodies;
use crate::integrate::Loads;
use crate::observe::accounts::{Accounts, Motive};
use crate::observe::energy::{Energy, Momenta};
use crate::observe::ledger::Ledger;
use crate::observe::report::{Events, ImpactReport, SolveReport};
use crate::settings::{OnInaccurate, Settings};
use crate::stepping::events::tape::Tape;
use carom_geometry::Geometry;
use carom_math::{Column, Space, Workers};
use carom_solver::methods::ladder::Ladder;
use carom_solver::{ImpulseSolver, SolverKind, Watch};

/// What a scheme tells of a step.
#[derive(Clone, Debug)]
pub struct SchemeReport<S: Space> {
    /// The persistent contacts' solve; the worst of several.
    pub contact_solve: Option<SolveReport>,
    /// The impacts' solve; the worst of several.
    pub impact_solve: Option<SolveReport>,
    /// What the impacts came to.
    pub impacts: ImpactReport,
    /// The step's lines.
    pub ledger: Ledger,
    /// What happened within the step.
    pub events: Events,
    /// What all bodies came to, where the scheme knows it.
    pub came_to: Option<CameTo<S>>,
}

/// What all bodies came to in a step, told where all numbers are finite and all rotations of unit length.
#[derive(Clone, Copy, Debug)]
pub struct CameTo<S: Space> {
    /// Their energy.
    pub energy: Energy,
    /// Their momenta.
    pub momenta: Momenta<S>,
}

impl<S: Space> Default for SchemeReport<S> {
    fn default() -> Self {
        let (contact_solve, impact_solve, impacts, ledger, events) = Default::default();
        SchemeReport { contact_solve, impact_solve, impacts, ledger, events, came_to: None }
    }
}

/// The worse of two solves, with the iterations of both.
pub(crate) fn worse(one: Option<SolveReport>, other: Option<SolveReport>) -> Option<SolveReport> {
    match (one, other) {
        (Some(one), Some(other)) => {
            let iterations = one.iterations + other.iterations;
            let worse = if other.residual > one.residual { other } else { one };
            Some(SolveReport { iterations, ..worse })
        }
        (one, other) => one.or(other),
    }
}

/// What a step asks for, and tells, outside.
pub struct Outside<'a, 'l, 'w, S: Geometry> {
    /// Nothing but gravity acts: `loads` would give zeros.
    pub quiet: bool,
    /// Gives the applied wrenches.
    pub loads: &'a mut Loads<'l, S>,
    /// Told of long solves.
    pub watch: &'a mut Watch<'w>,
    /// Told of what is done, by a scheme that can.
    pub tape: Option<&'a mut Tape<S>>,
    /// Who shares the work.
    pub workers: &'a Workers,
}

/// Exact decay of the velocities of damped bodies over a time, booked.
pub(crate) fn damp<S: Geometry>(
    bodies: &mut Bodies<S>,
    time: f64,
    ledger: &mut Ledger,
    accounts: &mut Accounts<S>,
) {
    if !bodies.may_be_damped() {
        return;
    }
    // the potential energy does not change here
    let marks = accounts.marks(bodies, S::Vector::ZERO);
    for k in 0..bodies.movers().len() {
        let i = bodies.movers()[k] as usize;
        let d = &bodies.data[i];
        let (linear, angular) = (d.linear_damping, d.angular_damping);
        if !bodies.is_dynamic(i) || (linear == 0.0 && angular == 0.0) {
            continue;
        }
        let before = bodies.translational_energy(i) + bodies.rotational_energy(i);
        bodies.motion.velocity[i] = bodies.motion.velocity[i] * carom_math::exp(-linear * time);
        bodies.motion.angular_velocity[i] =
            bodies.motion.angular_velocity[i] * carom_math::exp(-angular * time);
        ledger.damping += bodies.translational_energy(i) + bodies.rotational_energy(i) - before;
    }
    accounts.moved(&marks, bodies, S::Vector::ZERO, Motive::Damping);
}

/// A scheme's solver, what it was made for beside it.
pub(crate) type Chosen<S> = Option<(SolverKind, bool, Box<dyn ImpulseSolver<S>>)>;

/// Makes the solver that the settings ask for, unless it is there, and tells it who shares its work.
pub(crate) fn choose_solver<S: Geometry>(chosen: &mut Chosen<S>, settings: &Settings<S>, workers: &Workers) {
    let (kind, escalates) = (settings.solver_kind(), settings.on_inaccurate == OnInaccurate::Escalate);
    if chosen.as_ref().is_none_or(|(k, e, _)| (*k, *e) != (kind, escalates)) {
        *chosen = Some((kind, escalates, make_solver(kind, escalates)));
    }
    if let Some((_, _, solver)) = chosen {
        solver.share(workers);
    }
}

/// The solver of both of a step's problems: alone, island by island, or with the stronger ones above it.
fn make_solver<S: Geometry>(kind: SolverKind, escalates: bool) -> Box<dyn ImpulseSolver<S>> {
    if escalates && !kind.stronger().is_empty() {
        let kinds: Vec<SolverKind> = std::iter::once(kind).chain(kind.stronger().iter().copied()).collect();
        Box::new(Ladder::new(kind.name(), &kinds))
    } else if kind.goes_by_island() && kind != SolverKind::Auto {
        Box::new(Ladder::new(kind.name(), &[kind]))
    } else {
        kind.make()
    }
}
