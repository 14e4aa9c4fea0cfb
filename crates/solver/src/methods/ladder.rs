//! Island by island, and up a ladder of solvers: each island goes to the first solver, and on to the next while
//! the residual is above the tolerance; the best impulses of all stages are kept. An island where nothing presses
//! is done without any solver. With one rung this is "solve per island". Knows no method.

mod climber;
mod normals;
mod resting;
mod shared;

use crate::impulse_solver::{ImpulseChoice, ImpulseSolver, SolveSettings, SolverKind};
use crate::islands::Islands;
use crate::outcome::{AtOnce, IslandReport, Outcome, Stop};
use crate::prepared::{ContactRow, Prepared, PreparedContact};
use crate::problem::{Contact, ContactProblem, FrictionLaw, Impulse, Impulses, InverseMass, Twist};
use crate::residual::{
    Entry, Left, Residual, residual_alone, residual_in, residual_of_normals, residual_on_normal,
    velocity_scale_of,
};
use crate::watch::Watch;
use carom_math::{Column, Space, Workers};
use climber::{Climbed, Climber};
pub use resting::Resting;
use shared::Shared;

/// The ladder; holds memory between solves and the solvers' own.
pub struct Ladder<S: Space> {
    name: &'static str,
    own: Climber<S>,
    /// Who shares the climbs, and memory for it.
    workers: Workers,
    shared: Shared<S>,
    islands: Islands,
    given: Impulses<S>,
    /// The whole problem's rows, for contacts that are alone and for the residual.
    prepared: Prepared<S>,
    /// What impulses make of contacts without friction, and velocities after all impulses.
    pressed: Vec<f64>,
    after: Vec<Twist<S>>,
    /// Which contacts are solved all at once, and what each leaves.
    asked: Vec<bool>,
    left: Vec<Left>,
}

impl<S: Space> Ladder<S> {
    /// A ladder under a name, weakest solver first; at least one.
    pub fn new(name: &'static str, kinds: &[SolverKind]) -> Self {
        Ladder {
            name,
            own: Climber::new(kinds),
            workers: Workers::default(),
            shared: Shared::default(),
            islands: Islands::default(),
            given: Impulses::default(),
            prepared: Prepared::default(),
            pressed: Vec::new(),
            after: Vec::new(),
            asked: Vec::new(),
            left: Vec::new(),
        }
    }

    /// Solves an island of one contact at once, where the first solver has it in closed form and the residual is within the
    /// tolerance: most islands of a world that has come to rest are no more than that.
    fn alone(
        &self,
        problem: &ContactProblem<S>,
        settings: &SolveSettings,
        island: usize,
        impulses: &mut Impulses<S>,
    ) -> Option<Climbed> {
        let [contact] = *self.islands.contacts(island) else { return None };
        let plain = self.islands.rows(island).is_empty() && problem.resistances.is_empty();
        if !plain || settings.impulses != ImpulseChoice::Any {
            return None;
        }
        let (bodies, tolerance) = ((problem.friction_law, problem.velocities.as_slice()), settings.tolerance);
        let old = impulses.contacts[contact];
        let given = &problem.contacts[contact];
        let (found, at_once) = if given.friction == 0.0 {
            self.at_once_on_normal(given, &problem.inverse_masses, bodies.1, tolerance)?
        } else {
            self.at_once(&PreparedContact::new(given, &problem.inverse_masses), bodies, &old, tolerance)?
        };
        impulses.contacts[contact] = found;
        let (stages, residual, stop) = (at_once.stages(), at_once.residual, Stop::Converged);
        Some(Climbed { stages, residual, stop, strict_feasibility: None })
    }

    /// The impulse of a contact that is alone, and what finding it came to.
    fn at_once(
        &self,
        contact: &PreparedContact<S>,
        (law, velocities): (FrictionLaw, &[Twist<S>]),
        old: &Impulse<S>,
        tolerance: f64,
    ) -> Option<(Impulse<S>, AtOnce)> {
        let found = self.own.first().alone(contact, law, velocities, old)?;
        let residual = residual_alone(contact, law, velocities, &found);
        Some((found, self.found_at_once(residual, tolerance)?))
    }

    /// The same of a contact without friction.
    fn at_once_on_normal(
        &self,
        contact: &Contact<S>,
        masses: &[InverseMass<S>],
        velocities: &[Twist<S>],
        tolerance: f64,
    ) -> Option<(Impulse<S>, AtOnce)> {
        let row = ContactRow::new(contact, contact.normal, masses);
        let (before, normal_mass) = (row.velocity(velocities), 1.0 / row.inverse_effective_mass);
        let normal = self.own.first().alone_on_normal(before - contact.target, normal_mass)?;
        let inverse = (masses[contact.a].linear, masses[contact.b].linear);
        let residual =
            residual_on_normal((&row, normal_mass), inverse, (velocities, before), (normal, contact.target));
        let found = Impulse { normal, tangent: S::Slip::ZERO };
        Some((found, self.found_at_once(residual, tolerance)?))
    }

    /// What it came to where the first solver had the impulse at once; `None` where that is not good enough.
    fn found_at_once(&self, mut residual: Residual, tolerance: f64) -> Option<AtOnce> {
        if residual.absolute.is_nan() || residual.absolute > tolerance {
            return None;
        }
        // counted within the island
        residual.worst = (residual.absolute > 0.0).then_some(Entry::Contact(0));
        Some(AtOnce { solver: self.own.kind(), residual })
    }

    /// The report of the island that was taken out, in the numbers of the whole problem.
    fn report(&self, island: usize, climbed: Climbed) -> IslandReport {
        let Climbed { stages, residual, strict_feasibility, .. } = climbed;
        let (contacts, rows) = (self.islands.contacts(island), self.islands.rows(island));
        let (bodies, first_body) = self.islands.bodies(island);
        IslandReport {
            contacts: contacts.len(),
            rows: rows.len(),
            bodies,
            first_body,
            residual: residual.absolute,
            relative_residual: residual.relative,
            worst: residual.worst.map(|entry| match entry {
                Entry::Contact(k) => Entry::Contact(contacts[k]),
                Entry::Row(k) => Entry::Row(rows[k]),
            }),
            strict_feasibility,
            stages,
        }
    }

    /// The residual of the whole, measured anew: what islands said of themselves does not add up to it.
    fn residual_of_all(&mut self, problem: &ContactProblem<S>, impulses: &Impulses<S>) -> Residual {
        if problem.is_of_normals() {
            return residual_of_normals(problem, impulses, (&mut self.pressed, &mut self.after));
        }
        self.prepared.update(problem);
        residual_in(problem, &self.prepared, impulses, &mut self.after)
    }

    /// A refusal of one island as one of the whole problem.
    fn located(&self, island: usize, reason: &str) -> String {
        if self.islands.count() == 1 {
            return reason.into();
        }
        let contacts = self.islands.contacts(island);
        let first =
            contacts.first().map_or(String::new(), |k| format!(", the first of which is contact {k}"));
        format!("{reason} (contacts are counted within an island of {}{first})", contacts.len())
    }
}

/// True where no impulse is called for: every contact leaves at least as fast as its target asks.
fn is_idle<S: Space>(problem: &ContactProblem<S>, islands: &Islands, island: usize) -> bool {
    islands.rows(island).is_empty()
        && islands.contacts(island).iter().all(|&k| leaves(&problem.contacts[k], &problem.velocities))
}

/// True for a contact that leaves at least as fast as its target asks.
#[inline]
fn leaves<S: Space>(c: &Contact<S>, velocities: &[Twist<S>]) -> bool {
    let u = velocities[c.a].at(c.arm_a) - velocities[c.b].at(c.arm_b);
    u.dot(c.normal) >= c.target
}

impl<S: Space> ImpulseSolver<S> for Ladder<S> {
    fn name(&self) -> &'static str {
        self.name
    }
    fn share(&mut self, workers: &Workers) {
        self.workers = workers.clone();
    }
    fn finds(&self, _choice: ImpulseChoice) -> bool {
        // a rung that does not refuses, and the next one has its turn
        true
    }
    fn solve_resting(&self, contact: &Resting<S>, settings: &SolveSettings) -> Option<(f64, Option<AtOnce>)> {
        self.resting(contact, settings)
    }
    fn work(
        &mut self,
        problem: &ContactProblem<S>,
        settings: &SolveSettings,
        impulses: &mut Impulses<S>,
        watch: &mut Watch,
    ) -> Outcome {
        self.given.copy_from(impulses);
        self.islands.update(problem);
        let normals_alone = problem.is_of_normals();
        if normals_alone {
            if let Some(outcome) = self.on_normals(problem, settings, impulses, watch) {
                return outcome;
            }
            impulses.copy_from(&self.given);
        }
        // what is left of islands is measured where they are solved; only rows and moments are measured anew for the whole
        let is_one = !normals_alone && self.islands.count() == 1 && problem.contacts.len() > 1;
        let plain = !normals_alone && problem.rows.is_empty() && problem.resistances.is_empty();
        let mut outcome = Outcome::nothing_to_do();
        let mut measured = (is_one || plain).then(Residual::default);
        outcome.islands.reserve(self.islands.count());
        let stopped = self.climb_shared(problem, settings, impulses, watch);
        let mut short = None;
        for island in 0..self.islands.count() {
            if is_idle(problem, &self.islands, island) {
                self.islands.contacts(island).iter().for_each(|&k| impulses.contacts[k] = Impulse::default());
                continue;
            }
            let climbed = match self.alone(problem, settings, island, impulses) {
                Some(climbed) => climbed,
                None => match self.shared.take(&self.islands, island, impulses) {
                    Some(climbed) => climbed,
                    None if stopped => {
                        outcome.stop = Stop::Interrupted;
                        break;
                    }
                    None => self.own.climb((problem, &self.islands, island), settings, impulses, watch),
                },
            };
            outcome.iterations += climbed.stages.iter().map(|s| s.iterations).sum::<usize>();
            outcome.factorisations += climbed.stages.iter().map(|s| s.factorisations).sum::<usize>();
            let told = outcome.strict_feasibility.into_iter().chain(climbed.strict_feasibility);
            outcome.strict_feasibility = told.reduce(f64::min);
            let stop = climbed.stop.clone();
            let left = climbed.residual;
            outcome.islands.push(self.report(island, climbed));
            let worst = outcome.islands.last().and_then(|report| report.worst);
            measured = match (measured, &stop) {
                (_, Stop::Refused(_) | Stop::Interrupted) => None,
                (Some(all), _) if all.absolute.is_nan() || left.absolute <= all.absolute => Some(all),
                (all, _) => all.map(|_| Residual { worst, ..left }),
            };
            match stop {
                Stop::Interrupted => outcome.stop = stop,
                Stop::Refused(reason) => {
                    // a problem is solved or refused as a whole
                    impulses.copy_from(&self.given);
                    outcome.stop = Stop::Refused(self.located(island, &reason));
                }
                Stop::Converged => continue,
                Stop::OutOfIterations | Stop::OutOfFactorisations => {
                    if short != Some(Stop::OutOfFactorisations) {
                        short = Some(stop);
                    }
                    continue;
                }
            }
            break;
        }
        let is_whole = outcome.stop != Stop::Interrupted;
        outcome.residual = match measured.filter(|_| is_whole) {
            Some(all) if is_one => all,
            Some(all) => all.relative_to(velocity_scale_of(problem)),
            None => self.residual_of_all(problem, impulses),
        };
        let asks_more = settings.impulses == ImpulseChoice::MinimumNorm && short.is_some();
        if outcome.stop == Stop::Converged && (asks_more || outcome.residual.absolute > settings.tolerance) {
            outcome.stop = short.unwrap_or(Stop::OutOfIterations);
        }
        outcome
    }
}
