//! Steps with the events inside them (theory chapter 8): a step is flows between impacts and stops of slipping
//! contacts, each found at its moment. Contact conditions hold on the mean velocity at the mean position, so that
//! persistent contact neither makes nor takes energy; impacts follow the impact law in no time. Bodies that may meet
//! within the step are advanced together, others apart. What it does not do: find the moment at which a contact that
//! holds begins to slip, for nothing jumps there.

mod arrival;
mod contacts;
mod fallback;
mod flow;
mod group;
mod groups;
mod limits;
mod overlap;
mod slipping;

use crate::bodies::{Bodies, Motion};
use crate::error::StepError;
use crate::force::Wrench;
use crate::impact::Impacts;
use crate::integrate::Step;
use crate::narrow_phase::{Touch, smallest_extent};
use crate::observe::ledger::Ledger;
use crate::observe::report::{Events, SolveReport};
use crate::settings::{OnInaccurate, Settings};
use crate::stepping::{Outside, SchemeReport, damp, make_solver};
use crate::warm_start::WarmStart;
use arrival::{Arrivals, Search, Ways};
use carom_geometry::Geometry;
use carom_math::Column;
use carom_solver::{ContactProblem, Impulse, ImpulseSolver, Impulses, SolverKind, Watch};
use flow::Stick;
use group::{GroupStep, Halt, LastFlow, Saved};
use groups::{Group, Groups, reaches};
use limits::Limits;

/// Times that a step may begin again with larger reaches before all bodies are one group.
const AGAIN: usize = 30;
/// Corrections of an arrival's moment where bodies in contact do not follow their first ways.
const CORRECTIONS: usize = 8;
/// Rotation in one flow \[rad\]: ways are found from quadratic rotations.
const TURN: f64 = 1.0;

/// Memory of the scheme: nothing in it changes an answer.
pub struct EventsScheme<S: Geometry> {
    solver: Option<(SolverKind, bool, Box<dyn ImpulseSolver<S>>)>,
    groups: Groups<S>,
    arrivals: Arrivals<S>,
    /// The solve that a step was refused for.
    pub failed: Option<SolveReport>,
    /// The impact phase.
    pub impacts: Impacts<S>,
    /// Contacts of the groups' last flows.
    pub touches: Vec<Touch<S>>,
    /// Their problem, in the world's indices; velocities are sums of start and end, twice the mean.
    pub problem: ContactProblem<S>,
    /// Its impulses, of the last flow of each group.
    pub impulses: Impulses<S>,
    /// Index into `touches` of each contact of the problem.
    pub pressed: Vec<usize>,
}

impl<S: Geometry> Default for EventsScheme<S> {
    fn default() -> Self {
        let problem = ContactProblem::new(Vec::new(), Vec::new());
        EventsScheme {
            solver: None,
            groups: Groups::default(),
            arrivals: Arrivals::default(),
            failed: None,
            impacts: Impacts::default(),
            touches: Vec::new(),
            impulses: Impulses::zero(&problem),
            problem,
            pressed: Vec::new(),
        }
    }
}

/// What all groups of a step have in common.
struct Common<'a, S: Geometry> {
    settings: &'a Settings<S>,
    step: &'a Step<S>,
    wrenches: Vec<Wrench<S>>,
    origin: Motion<S>,
    warm: WarmStart<S>,
}

/// What a group leaves behind.
struct Done<S: Geometry> {
    motion: Motion<S>,
    ledger: Ledger,
    events: Events,
    pressed: Option<Vec<u64>>,
    forces: Option<WarmStart<S>>,
    last: LastFlow<S>,
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
        Outside { loads, watch }: Outside<S>,
        warm: &mut WarmStart<S>,
    ) -> Result<SchemeReport, StepError> {
        self.choose_solver(settings);
        let mut report = SchemeReport::default();
        damp(bodies, 0.5 * step.dt, &mut report.ledger);
        let wrenches = half_way_loads(bodies, step, loads)?;
        let origin = bodies.motion.clone();
        let common = Common { settings, step, wrenches, origin, warm: std::mem::take(warm) };
        let (groups, all) = match self.all_groups(bodies, &common, watch) {
            Ok(done) => done,
            Err((error, failed)) => {
                self.failed = failed;
                return Err(error);
            }
        };
        self.collect(bodies, &common, &groups, all, &mut report, warm);
        move_obstacles(bodies, &common);
        damp(bodies, 0.5 * step.dt, &mut report.ledger);
        self.judge(&report, settings, step.time)?;
        Ok(report)
    }

    fn choose_solver(&mut self, settings: &Settings<S>) {
        let (kind, escalates) = (settings.solver_kind(), settings.on_inaccurate == OnInaccurate::Escalate);
        if self.solver.as_ref().is_none_or(|(k, e, _)| (*k, *e) != (kind, escalates)) {
            self.solver = Some((kind, escalates, make_solver(kind, escalates)));
        }
    }

    /// Advances every group; begins again with larger reaches where a body outgrew its own.
    #[allow(clippy::type_complexity)]
    fn all_groups(
        &mut self,
        bodies: &mut Bodies<S>,
        common: &Common<S>,
        watch: &mut Watch,
    ) -> Result<(Vec<Group>, Vec<Done<S>>), (StepError, Option<SolveReport>)> {
        let touching = common.settings.events.touching * smallest_extent(bodies).unwrap_or(0.0);
        let mut reaches = reaches(bodies, common.settings, &common.wrenches, common.step.dt);
        let mut begun = 0;
        'again: loop {
            let groups = self.groups.find(bodies, &reaches, touching);
            let mut all = Vec::with_capacity(groups.len());
            for group in &groups {
                match self.one_group(bodies, group, &reaches, common, watch) {
                    Ok(done) => all.push(done),
                    Err(Halt::Refused(error, failed)) => return Err((error, failed)),
                    Err(Halt::Outgrown(i)) => {
                        begun += 1;
                        let grown = if begun < AGAIN { 2.0 * reaches[i] + touching } else { f64::MAX };
                        for &k in &group.bodies {
                            // what made one fast may make its neighbours so
                            if bodies.is_dynamic(k) {
                                reaches[k] = reaches[k].max(grown.min(f64::MAX));
                            }
                        }
                        continue 'again;
                    }
                }
            }
            return Ok((groups, all));
        }
    }

    fn one_group(
        &mut self,
        bodies: &Bodies<S>,
        group: &Group,
        reaches: &[f64],
        common: &Common<S>,
        watch: &mut Watch,
    ) -> Result<Done<S>, Halt> {
        let own = bodies.some(&group.bodies);
        let limits = Limits::of(common.settings, &own, common.step.dt);
        let (_, _, solver) = self.solver.as_mut().expect("chosen at the step's start");
        let mut at = GroupStep {
            settings: common.settings,
            origin: own.motion.clone(),
            bodies: own,
            pairs: group.pairs.clone(),
            wrenches: group.bodies.iter().map(|&i| common.wrenches[i]).collect(),
            reaches: group.bodies.iter().map(|&i| reaches[i]).collect(),
            limits,
            time: common.step.time,
            ledger: Ledger::default(),
            events: Events::default(),
            pressed: None,
            warm: &common.warm,
            forces: None,
            last: LastFlow::default(),
            worst: [None, None],
            solver: solver.as_mut(),
            impacts: &mut self.impacts,
            points: Vec::new(),
        };
        at.run(&mut self.arrivals, watch).map_err(|halt| named(halt, group))?;
        let GroupStep { bodies, ledger, events, pressed, forces, last, worst, .. } = at;
        Ok(Done { motion: bodies.motion, ledger, events, pressed, forces, last, worst })
    }

    /// Puts the groups' results together, in the world's indices.
    fn collect(
        &mut self,
        bodies: &mut Bodies<S>,
        common: &Common<S>,
        groups: &[Group],
        all: Vec<Done<S>>,
        report: &mut SchemeReport,
        warm: &mut WarmStart<S>,
    ) {
        *warm = WarmStart::default();
        self.touches.clear();
        self.pressed.clear();
        crate::assembly::begin(&mut self.problem, bodies, common.settings.friction_law);
        let mut impulses = Impulses::zero(&self.problem);
        for (group, done) in groups.iter().zip(all) {
            let world = |i: usize| group.bodies[i];
            for (k, &i) in group.bodies.iter().enumerate() {
                if bodies.is_dynamic(i) {
                    bodies.motion.position[i] = done.motion.position[k];
                    bodies.motion.rotation[i] = done.motion.rotation[k];
                    bodies.motion.set_twist(i, &done.motion.twist(k));
                }
            }
            report.ledger.add(&done.ledger);
            report.events.add(&done.events);
            warm.take_over(done.forces.unwrap_or_default(), done.pressed.unwrap_or_default());
            let [contact, impact] = done.worst;
            report.contact_solve = SchemeReport::worse(report.contact_solve.take(), contact, world);
            report.impact_solve = SchemeReport::worse(report.impact_solve.take(), impact, world);
            merge(&mut self.problem, &mut impulses, &mut self.touches, &done.last, &world);
        }
        report.events.groups = groups.len();
        warm.sort();
        self.pressed.extend(0..self.touches.len());
        self.impulses = impulses;
        self.impacts.struck.clear();
        self.impacts.totals.clear();
        self.impacts.totals.resize(self.touches.len(), Impulse::default());
    }

    fn judge(&mut self, report: &SchemeReport, settings: &Settings<S>, time: f64) -> Result<(), StepError> {
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

/// A halt in the world's indices.
fn named(halt: Halt, group: &Group) -> Halt {
    match halt {
        Halt::Outgrown(i) => Halt::Outgrown(group.bodies[i]),
        Halt::Refused(error, report) => Halt::Refused(
            error,
            report.map(|mut r| {
                r.worst = r.worst.map(|(a, b)| (group.bodies[a], group.bodies[b]));
                r
            }),
        ),
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
fn move_obstacles<S: Geometry>(bodies: &mut Bodies<S>, common: &Common<S>) {
    for i in 0..bodies.len() {
        if bodies.is_dynamic(i) {
            continue;
        }
        bodies.motion.position[i] = common.origin.position[i] + common.origin.velocity[i] * common.step.dt;
        crate::integrate::turn_freely(common.settings.integrator, bodies, i, common.step.dt);
    }
}

/// Appends a group's last flow to the world's problem.
fn merge<S: Geometry>(
    problem: &mut ContactProblem<S>,
    impulses: &mut Impulses<S>,
    touches: &mut Vec<Touch<S>>,
    last: &LastFlow<S>,
    world: &dyn Fn(usize) -> usize,
) {
    let first = problem.contacts.len();
    for (k, v) in last.problem.velocities.iter().enumerate() {
        problem.velocities[world(k)] = *v;
        problem.inverse_masses[world(k)] = last.problem.inverse_masses[k];
    }
    for (c, t) in last.problem.contacts.iter().zip(&last.touches) {
        let mut c = *c;
        (c.a, c.b) = (world(c.a), world(c.b));
        problem.contacts.push(c);
        touches.push(Touch { a: c.a, b: c.b, ..*t });
    }
    for r in &last.problem.resistances {
        let mut r = *r;
        r.contact += first;
        problem.resistances.push(r);
    }
    impulses.contacts.extend_from_slice(&last.impulses.contacts);
    impulses.moments.extend_from_slice(&last.impulses.moments);
}

impl<S: Geometry> GroupStep<'_, S> {
    /// The whole step of the group.
    fn run(&mut self, arrivals: &mut Arrivals<S>, watch: &mut Watch) -> Result<(), Halt> {
        let mut left = self.limits.dt;
        self.project(watch)?;
        while left > 0.0 {
            let touches = self.touches(self.limits.touching);
            self.strike(&touches, watch)?;
            if self.events.arrivals + self.events.slip_stops >= self.limits.cap + self.limits.slip_stops {
                self.fall_back(left, watch)?;
                self.events.capped = 1;
                break;
            }
            let time = left.min(self.longest_flow());
            let taken = self.part(&touches, time, arrivals, watch)?;
            self.check_reach()?;
            left -= taken;
            if left <= 1e-14 * self.limits.dt {
                left = 0.0;
            }
        }
        let touches = self.touches(self.limits.touching);
        self.strike(&touches, watch)?;
        self.project(watch)?;
        self.check_reach()
    }

    /// How long a flow may be for its ways to be found \[s\].
    fn longest_flow(&self) -> f64 {
        if self.pairs.is_empty() {
            return f64::INFINITY;
        }
        let m = &self.bodies.motion;
        let turning = (0..self.bodies.len()).filter(|&i| self.bodies.data[i].turning_arm > 0.0);
        let fastest = turning.map(|i| m.angular_velocity[i].norm()).fold(0.0, f64::max);
        if fastest > 0.0 { TURN / fastest } else { f64::INFINITY }
    }

    /// One flow of at most this time, ended by the first event within it; the time it took.
    fn part(
        &mut self,
        touches: &[Touch<S>],
        time: f64,
        arrivals: &mut Arrivals<S>,
        watch: &mut Watch,
    ) -> Result<f64, Halt> {
        let active = self.persisting(touches);
        let stick =
            if self.events.slip_stops < self.limits.slip_stops { Stick::Mean } else { Stick::End };
        let start = self.save();
        self.flow(time, &active.touches, &active.fresh, stick, watch)?;
        let stop = match stick {
            Stick::Mean => self.first_stop(&start, &active, time, watch)?,
            Stick::End => None,
        };
        let met = self.first_arrival(&start, &active.names, time, stop.unwrap_or(time), arrivals);
        match (met, stop) {
            (Some((moment, id, pair)), _) => {
                self.events.arrivals += 1;
                self.arrive(&start, &active, (moment, id, pair), time, stick, watch)
            }
            (None, Some(moment)) => {
                self.events.slip_stops += 1;
                self.restore(&start);
                self.flow(moment, &active.touches, &active.fresh, stick, watch)?;
                Ok(moment)
            }
            (None, None) => Ok(time),
        }
    }

    /// First arrival of a contact that is not active: moment, name, pair.
    fn first_arrival(
        &self,
        start: &Saved<S>,
        active: &[u64],
        time: f64,
        until: f64,
        arrivals: &mut Arrivals<S>,
    ) -> Option<(f64, u64, (usize, usize))> {
        let ways = Ways { bodies: &self.bodies, start: start.motion(), end: &self.bodies.motion, time };
        let mut best = None;
        let mut search =
            Search { until, arrived: self.limits.arrived, still_speed: self.limits.still_speed };
        let ignored = |id: u64| active.binary_search(&id).is_ok();
        for &pair in &self.pairs {
            if let Some((moment, id)) = arrivals.first(&ways, pair, &search, &ignored) {
                search.until = moment;
                best = Some((moment, id, pair));
            }
        }
        best
    }

    /// Takes the flow up to an arrival; where bodies in contact left their first ways, to the moment the gap closes.
    fn arrive(
        &mut self,
        start: &Saved<S>,
        active: &contacts::Active<S>,
        (mut moment, id, pair): (f64, u64, (usize, usize)),
        time: f64,
        stick: Stick,
        watch: &mut Watch,
    ) -> Result<f64, Halt> {
        let mut near = Vec::new();
        for _ in 0..CORRECTIONS {
            self.restore(start);
            self.flow(moment, &active.touches, &active.fresh, stick, watch)?;
            near.clear();
            self.find(pair, self.limits.touching, &mut near);
            let Some(t) = near.iter().find(|t| t.id == id) else { break };
            let u = crate::narrow_phase::normal_velocity(&self.bodies, t);
            if t.gap.abs() <= self.limits.arrived || u >= -self.limits.still_speed {
                break;
            }
            let next = (moment - t.gap / u).clamp(0.0, time);
            if next == moment {
                break;
            }
            moment = next;
        }
        Ok(moment)
    }
}
