//! Steps with the events inside them (theory chapter 8): a step is flows between impacts and stops of slipping
//! contacts, each found at its moment. Contact conditions hold on the mean velocity at the mean position, so that
//! persistent contact neither makes nor takes energy; impacts follow the impact law in no time. Bodies that persisting
//! contacts join move together, others apart. What it does not do: find the moment at which a contact that holds
//! begins to slip, for nothing jumps there.

mod accounting;
mod ahead;
mod aim;
mod alone;
mod arrival;
mod candidates;
mod clusters;
mod contacts;
mod ending;
mod fallback;
pub(crate) mod flow;
mod gaps;
mod gathering;
mod joints;
mod leaving;
mod limits;
mod lying;
mod meeting;
pub(crate) mod memory;
mod overlap;
mod push;
mod quiet;
mod rounds;
mod slipping;
pub(crate) mod tape;
mod timeline;
pub(crate) mod together;

use crate::bodies::Bodies;
use crate::error::StepError;
use crate::force::Wrench;
use crate::impact::Impacts;
use crate::integrate::Step;
use crate::joint::JointImpulse;
use crate::narrow_phase::Touch;
use crate::observe::accounts::Accounts;
use crate::observe::event_log::{ContactSum, EventLog};
use crate::observe::ledger::Ledger;
use crate::observe::report::{Events, ImpactReport, SolveReport};
use crate::settings::{OnInaccurate, Settings};
use crate::stepping::{Chosen, Outside, SchemeReport, choose_solver, damp, worse};
use crate::warm_start::WarmStart;
use alone::{Alone, beside};
use arrival::Arrivals;
use candidates::{Candidates, reaches};
use carom_geometry::Geometry;
use carom_math::Column;
use carom_solver::{ContactProblem, Impulse, Impulses, Watch};
use limits::Limits;
use tape::Tape;
use timeline::{Common, Island, Timeline};
use together::{Halt, LastFlow, Refusal, Tools};

/// Times that a step may begin again with larger reaches before all bodies may meet all.
const AGAIN: usize = 40;

/// Memory of the scheme: nothing in it changes an answer.
pub struct EventsScheme<S: Geometry> {
    solver: Chosen<S>,
    candidates: Candidates<S>,
    arrivals: Arrivals<S>,
    /// The solve that a step was refused for.
    pub failed: Option<SolveReport>,
    /// The impact phase.
    pub impacts: Impacts<S>,
    /// Applied loads of the last step on each body.
    pub loads: Vec<Wrench<S>>,
    /// Contacts of the islands' last flows, and after them those that only acted earlier in the step.
    pub touches: Vec<Touch<S>>,
    /// Their problem, in the world's indices; velocities are sums of start and end, twice the mean.
    pub problem: ContactProblem<S>,
    /// Its impulses, of the last flow of each island.
    pub impulses: Impulses<S>,
    /// Index into `touches` of each contact of the problem.
    pub pressed: Vec<usize>,
    /// What each body was given in the last step, where that is asked for.
    pub accounts: Accounts<S>,
    /// What happened in the last step.
    pub log: EventLog<S>,
    /// What each of `touches` did in the whole step.
    pub sums: Vec<ContactSum<S>>,
    /// What the joints gave in the last step.
    pub(crate) joints: Vec<JointImpulse<S>>,
}

impl<S: Geometry> Default for EventsScheme<S> {
    fn default() -> Self {
        let problem = ContactProblem::new(Vec::new(), Vec::new());
        EventsScheme {
            solver: None,
            candidates: Candidates::default(),
            arrivals: Arrivals::default(),
            failed: None,
            impacts: Impacts::default(),
            loads: Vec::new(),
            touches: Vec::new(),
            impulses: Impulses::zero(&problem),
            problem,
            pressed: Vec::new(),
            accounts: Accounts::default(),
            log: EventLog::default(),
            sums: Vec::new(),
            joints: Vec::new(),
        }
    }
}

/// What a step leaves behind.
struct Done<S: Geometry> {
    islands: Vec<Option<Island<S>>>,
    alone: Alone<S>,
    ledger: Ledger,
    accounts: Accounts<S>,
    joints: Vec<JointImpulse<S>>,
    events: Events,
    log: EventLog<S>,
    struck: ImpactReport,
    worst: [Option<SolveReport>; 2],
}

impl<S: Geometry> EventsScheme<S> {
    /// Advances all bodies by one step.
    ///
    /// # Errors
    /// A refused solve or a failed load; the caller restores the bodies then.
    pub fn advance(
        &mut self,
        bodies: &mut Bodies<S>,
        settings: &Settings<S>,
        step: &Step<S>,
        Outside { quiet, loads, watch, tape, workers }: Outside<S>,
        warm: &mut WarmStart<S>,
    ) -> Result<SchemeReport<S>, StepError> {
        choose_solver(&mut self.solver, settings, workers);
        let mut report = SchemeReport::default();
        damp(bodies, 0.5 * step.dt, &mut report.ledger, &mut self.accounts);
        let wrenches =
            if quiet { vec![Wrench::default(); bodies.len()] } else { half_way_loads(bodies, step, loads)? };
        let done = match self.attempts(bodies, settings, step, &wrenches, (watch, tape), warm) {
            Ok(done) => done,
            Err(refusal) => {
                self.failed = refusal.solve;
                return Err(refusal.error);
            }
        };
        self.loads = wrenches;
        self.collect(bodies, settings, done, &mut report, warm);
        move_obstacles(bodies, settings, step.dt);
        damp(bodies, 0.5 * step.dt, &mut report.ledger, &mut self.accounts);
        self.judge(&report, settings, step.time)?;
        Ok(report)
    }

    /// Takes the step; again with larger reaches where a body outgrew its own.
    fn attempts(
        &mut self,
        bodies: &mut Bodies<S>,
        settings: &Settings<S>,
        step: &Step<S>,
        wrenches: &[Wrench<S>],
        (watch, mut tape): (&mut Watch, Option<&mut Tape<S>>),
        warm: &WarmStart<S>,
    ) -> Result<Done<S>, Box<Refusal>> {
        let limits = Limits::of(settings, bodies, step.dt);
        let origin = bodies.motion.clone();
        let mut reaches = reaches(bodies, settings, wrenches, step.dt);
        for attempt in 0.. {
            if attempt == 0 {
                self.candidates.begin(bodies, &mut reaches, &limits);
            } else {
                self.candidates.update(bodies, &reaches, &limits);
            }
            if let Some(tape) = &mut tape {
                tape.begin(&origin, wrenches);
            }
            let (_, _, solver) = self.solver.as_mut().expect("chosen at the step's start");
            let common = Common {
                settings,
                limits,
                time: step.time,
                wrenches,
                origin: &origin,
                reaches: &reaches,
                warm,
                candidates: &self.candidates,
                keeps_accounts: self.accounts.are_kept(),
                joint_names: bodies.joints.names.clone(),
            };
            let tools = Tools {
                solver: solver.as_mut(),
                impacts: &mut self.impacts,
                arrivals: &mut self.arrivals,
                watch: &mut *watch,
                tape: tape.as_deref_mut(),
            };
            let mut timeline = Timeline::new(&common, bodies, tools);
            // about as much happens as in the step before
            timeline.log = EventLog::like(&self.log);
            let outgrown = match timeline.run() {
                Ok(()) => {
                    let Timeline {
                        islands,
                        alone,
                        ledger,
                        accounts,
                        joints,
                        events,
                        mut log,
                        struck,
                        worst,
                        ..
                    } = timeline;
                    log.begin_at(step.time);
                    return Ok(Done { islands, alone, ledger, accounts, joints, events, log, struck, worst });
                }
                Err(Halt::Refused(refusal)) => return Err(refusal),
                Err(Halt::Gains((a, b), energy)) => {
                    let bodies = (bodies.names[a].clone(), bodies.names[b].clone());
                    let law = settings.impact_law().name();
                    let error = StepError::EnergyGain { bodies, law, energy, time: step.time };
                    return Err(Box::new(Refusal { error, solve: None }));
                }
                Err(Halt::Outgrown(outgrown)) => outgrown,
            };
            bodies.motion.copy_from(&origin);
            self.candidates.grow(bodies, &mut reaches, &outgrown, attempt >= AGAIN);
        }
        unreachable!("a reach without bound is not outgrown")
    }

    /// Puts the islands' results together.
    fn collect(
        &mut self,
        bodies: &Bodies<S>,
        settings: &Settings<S>,
        done: Done<S>,
        report: &mut SchemeReport<S>,
        warm: &mut WarmStart<S>,
    ) {
        *warm = WarmStart::default();
        self.touches.clear();
        self.pressed.clear();
        crate::assembly::begin(&mut self.problem, bodies, settings.friction_law);
        self.impulses.reset(&self.problem);
        report.ledger.add(&done.ledger);
        self.accounts.add(&done.accounts, |i| i);
        self.joints = done.joints;
        report.events = done.events;
        report.impacts = done.struck;
        let mut alone = done.alone;
        let [others, impact_solve] = done.worst;
        let is_one = done.islands.iter().flatten().count() == 1;
        let join = if is_one { beside } else { worse };
        report.contact_solve = join(alone.report.take(), others);
        report.impact_solve = impact_solve;
        alone.give(&mut self.problem, &mut self.impulses, &mut self.touches, warm);
        for island in done.islands.into_iter().flatten() {
            report.events.islands += island.islands;
            warm.take_over(island.forces.unwrap_or_default(), island.memory.unwrap_or_default());
            merge(&mut self.problem, &mut self.impulses, &mut self.touches, &island.last, &island.members);
        }
        warm.sort();
        self.pressed.extend(0..self.touches.len());
        self.log = done.log;
        self.log.leave_out_whole_flows(bodies.len());
        self.sums = self.log.sums(&mut self.touches);
        self.impacts.struck.clear();
        self.impacts.totals.clear();
        self.impacts.totals.resize(self.touches.len(), Impulse::default());
        self.impacts.moments.clear();
        self.impacts.moments.resize(self.touches.len(), S::Spin::ZERO);
    }

    fn judge(
        &mut self,
        report: &SchemeReport<S>,
        settings: &Settings<S>,
        time: f64,
    ) -> Result<(), StepError> {
        for (phase, solve) in [("impact", &report.impact_solve), ("contact", &report.contact_solve)] {
            let Some(solve) = solve else { continue };
            if settings.on_inaccurate == OnInaccurate::Raise && !solve.is_within(settings.tolerance) {
                self.failed = Some(solve.clone());
                return Err(StepError::Inaccurate {
                    solver: settings.solver_kind().name(),
                    phase,
                    contacts: solve.contacts,
                    residual: solve.residual,
                    tolerance: settings.tolerance,
                    explanation: String::new(),
                    time,
                });
            }
        }
        Ok(())
    }
}

/// Loads at the half-way moment, where bodies are by then without contacts; they act through the whole step.
fn half_way_loads<S: Geometry>(
    bodies: &mut Bodies<S>,
    step: &Step<S>,
    loads: &mut crate::integrate::Loads<S>,
) -> Result<Vec<Wrench<S>>, StepError> {
    let mut wrenches = Vec::new();
    let start = bodies.motion.clone();
    for i in 0..bodies.len() {
        let v = bodies.motion.velocity[i];
        bodies.motion.position[i] += v * (0.5 * step.dt);
        crate::integrate::turn_freely(crate::integrate::Integrator::Trapezoid, bodies, i, 0.5 * step.dt);
    }
    let found = loads(step.time + 0.5 * step.dt, bodies, &mut wrenches);
    bodies.motion.copy_from(&start);
    found?;
    for (i, w) in wrenches.iter_mut().enumerate() {
        if !bodies.is_dynamic(i) {
            *w = Wrench::default();
        }
    }
    Ok(wrenches)
}

/// Obstacles move as they are told, whoever is in their way.
fn move_obstacles<S: Geometry>(bodies: &mut Bodies<S>, settings: &Settings<S>, dt: f64) {
    for i in 0..bodies.len() {
        if bodies.is_dynamic(i) {
            continue;
        }
        let v = bodies.motion.velocity[i];
        bodies.motion.position[i] += v * dt;
        crate::integrate::turn_freely(settings.integrator, bodies, i, dt);
    }
}

/// Appends an island's last flow to the world's problem.
fn merge<S: Geometry>(
    problem: &mut ContactProblem<S>,
    impulses: &mut Impulses<S>,
    touches: &mut Vec<Touch<S>>,
    last: &LastFlow<S>,
    members: &[usize],
) {
    let first = problem.contacts.len();
    for (k, v) in last.problem.velocities.iter().enumerate() {
        problem.velocities[members[k]] = *v;
        problem.inverse_masses[members[k]] = last.problem.inverse_masses[k];
    }
    for (c, t) in last.problem.contacts.iter().zip(&last.touches) {
        let mut c = *c;
        (c.a, c.b) = (members[c.a], members[c.b]);
        problem.contacts.push(c);
        touches.push(Touch { a: c.a, b: c.b, ..*t });
    }
    for r in &last.problem.rows {
        let mut r = *r;
        (r.a, r.b) = (members[r.a], members[r.b]);
        problem.rows.push(r);
    }
    impulses.rows.extend_from_slice(&last.impulses.rows);
    for r in &last.problem.resistances {
        let mut r = *r;
        r.contact += first;
        problem.resistances.push(r);
    }
    impulses.contacts.extend_from_slice(&last.impulses.contacts);
    impulses.moments.extend_from_slice(&last.impulses.moments);
}
