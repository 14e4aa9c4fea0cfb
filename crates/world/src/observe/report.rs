//! What a step tells of itself.

use crate::joint::Reaction;
use crate::observe::energy::{Energy, Momenta};
use crate::observe::groups::GroupReport;
use crate::observe::ledger::Ledger;
use carom_math::Space;
use carom_solver::{IslandReport, Outcome, SolverKind, Stop};
use serde::{Deserialize, Serialize};

/// One solve of a step, with its worst contact named by bodies.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SolveReport {
    /// Contacts in the problem.
    pub contacts: usize,
    /// Iterations spent.
    pub iterations: usize,
    /// Natural-map residual \[m/s\].
    pub residual: f64,
    /// The residual divided by that of no impulses at all \[1\]: 1 is as wrong as doing nothing.
    pub relative_residual: f64,
    /// Bodies of the worst contact, by index.
    pub worst: Option<(usize, usize)>,
    /// Why the solver stopped.
    pub stop: Stop,
    /// The islands where anything pressed, by solvers that go island by island; of impacts, those of the worst round.
    pub islands: Vec<IslandReport>,
}

impl SolveReport {
    /// A report from a solver's outcome and the bodies of its worst entry.
    pub fn new(outcome: Outcome, contacts: usize, worst: Option<(usize, usize)>) -> Self {
        SolveReport {
            contacts,
            iterations: outcome.iterations,
            residual: outcome.residual.absolute,
            relative_residual: outcome.residual.relative,
            worst,
            stop: outcome.stop,
            islands: outcome.islands,
        }
    }
    /// What it says of some bodies, ascending, that no others were joined with; all of it where the solver does not go
    /// island by island, `None` where nothing pressed.
    pub(crate) fn of_bodies(&self, bodies: &[usize]) -> Option<SolveReport> {
        if self.islands.is_empty() {
            return Some(SolveReport { iterations: 0, ..self.clone() });
        }
        let has = |i: usize| bodies.binary_search(&i).is_ok();
        let islands: Vec<IslandReport> =
            self.islands.iter().filter(|island| has(island.first_body)).cloned().collect();
        let worst = islands.iter().max_by(|a, b| a.residual.total_cmp(&b.residual))?;
        Some(SolveReport {
            contacts: islands.iter().map(|island| island.contacts).sum(),
            iterations: islands.iter().map(IslandReport::iterations).sum(),
            residual: worst.residual,
            relative_residual: worst.relative_residual,
            worst: self.worst.filter(|(a, b)| has(*a) && has(*b)),
            stop: self.stop.clone(),
            islands,
        })
    }
    /// True when the residual is within what was asked for; a tolerance of 0 asks for nothing.
    pub fn is_within(&self, tolerance: f64) -> bool {
        tolerance == 0.0 || self.residual <= tolerance
    }
}

/// What happened within a step of a scheme with events; zeros for steps without them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Events {
    /// Arrivals of contacts found within the step.
    pub arrivals: usize,
    /// Impact phases.
    pub impacts: usize,
    /// Stops of slipping contacts found within the step.
    pub slip_stops: usize,
    /// Sets of bodies that reached their cap of events and took the rest of the step at once.
    pub capped: usize,
    /// Times that the rest of a step was taken at once.
    pub fallbacks: usize,
    /// Times that overlaps were projected away.
    pub projections: usize,
    /// Deepest overlap that was \[m\].
    pub deepest: f64,
    /// Sets of bodies that moved apart from others at the step's end.
    pub islands: usize,
}

impl Events {
    /// Adds another group's events.
    pub fn add(&mut self, o: &Events) {
        self.arrivals += o.arrivals;
        self.impacts += o.impacts;
        self.slip_stops += o.slip_stops;
        self.capped += o.capped;
        self.fallbacks += o.fallbacks;
        self.projections += o.projections;
        self.deepest = self.deepest.max(o.deepest);
        self.islands += o.islands;
    }
}

/// What the impacts of a step came to.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ImpactReport {
    /// Rounds of impacts.
    pub rounds: usize,
    /// Islands of impacts that would gain energy by their own law: what became of them is `energy_guard`'s matter.
    pub guarded: usize,
    /// Times that rounds did not end by themselves and what still approached was ended plastically.
    pub ended_plastic: usize,
    /// Energy that the guarded islands' own law gains \[J\]: in the books where the guard only warns, else not.
    pub gain: f64,
    /// Bodies of the contact that gains most, by index.
    pub gaining: Option<(usize, usize)>,
}

impl ImpactReport {
    /// Adds what later impacts of the same step came to.
    pub fn add(&mut self, o: &ImpactReport) {
        if o.gain > self.gain {
            self.gaining = o.gaining;
        }
        self.rounds += o.rounds;
        self.guarded += o.guarded;
        self.ended_plastic += o.ended_plastic;
        self.gain += o.gain;
    }
}

/// Report of one step.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(bound = "")]
pub struct StepReport<S: Space> {
    /// Number of the step, from 1.
    pub step: u64,
    /// Time after the step \[s\].
    pub time: f64,
    /// Length of the step \[s\].
    pub dt: f64,
    /// The solver asked for.
    pub solver: SolverKind,
    /// The residual asked for \[m/s\].
    pub tolerance: f64,
    /// The most iterations allowed per solve.
    pub budget: usize,
    /// Contacts found at the step's start, speculative ones included.
    pub contacts: usize,
    /// Bodies that sleep after the step.
    #[serde(default)]
    pub asleep: usize,
    /// The solve of the persistent contacts; `None` when there were none.
    pub contact_solve: Option<SolveReport>,
    /// The solve of the impacts; `None` when nothing approached.
    pub impact_solve: Option<SolveReport>,
    /// Rounds of the impacts, and what the energy guard did.
    #[serde(default)]
    pub impacts: ImpactReport,
    /// Smallest gap at the step's start \[m\], negative for overlap, and its bodies by index.
    pub deepest: Option<(f64, usize, usize)>,
    /// What happened within the step, by schemes that find events.
    #[serde(default)]
    pub events: Events,
    /// Energy after the step.
    pub energy: Energy,
    /// Momenta after the step.
    pub momenta: Momenta<S>,
    /// Where the step's energy went.
    pub ledger: Ledger,
    /// The books of the groups that were asked for ([`crate::World::set_ledger_groups`]).
    #[serde(default)]
    pub groups: Vec<GroupReport<S>>,
    /// What the joints gave their bodies, joint by joint.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub joints: Vec<Reaction<S>>,
}

impl<S: Space> StepReport<S> {
    fn solves(&self) -> impl Iterator<Item = &SolveReport> {
        self.contact_solve.iter().chain(&self.impact_solve)
    }
    /// Worse residual of the step's solves \[m/s\].
    pub fn residual(&self) -> f64 {
        self.solves().map(|s| s.residual).fold(0.0, f64::max)
    }
    /// Worse relative residual of the step's solves \[1\].
    pub fn relative_residual(&self) -> f64 {
        self.solves().map(|s| s.relative_residual).fold(0.0, f64::max)
    }
    /// Bodies of the worst contact over the step's solves, by index.
    pub fn worst(&self) -> Option<(usize, usize)> {
        self.solves().max_by(|a, b| a.residual.total_cmp(&b.residual)).and_then(|s| s.worst)
    }
    /// Iterations of all solves of the step.
    pub fn iterations(&self) -> usize {
        self.solves().map(|s| s.iterations).sum()
    }
    /// True when every solve is within the tolerance by the natural residual; a tolerance of 0 asks for nothing.
    pub fn is_accurate(&self) -> bool {
        self.solves().all(|s| s.is_within(self.tolerance))
    }
    /// The islands of the step's solves: of impacts, then of persistent contacts.
    pub fn islands(&self) -> impl Iterator<Item = &IslandReport> {
        self.impact_solve.iter().chain(&self.contact_solve).flat_map(|s| &s.islands)
    }
    /// True when every solve reached its tolerance.
    pub fn converged(&self) -> bool {
        self.solves().all(|s| s.stop == Stop::Converged)
    }
}
