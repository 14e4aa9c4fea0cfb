//! Impacts: what simultaneous collisions do to the velocities in no time, before gravity and loads act
//! (theory chapter 4). The law is a choice of its own, apart from solver, friction law and scheme. Restitution acts on
//! approaches faster than the rest speed; slower ones end without bounce (the ledger's rest cut). A bounce sends its
//! bodies on to others, so rounds follow: as many as the step leaves time for, or until nothing approaches
//! (`Thresholds::thorough`). Knows no loads and no clock.

mod guard;
mod moreau;
mod newton;
mod part;
mod poisson;
mod reflections;
mod sequential;
mod thresholds;

pub use thresholds::{Role, Thresholds};

use crate::assembly;
use crate::bodies::Bodies;
use crate::error::StepError;
use crate::impact::part::{Islands, Part};
use crate::joint::{JointImpulse, mover, still, wrenches};
use crate::material::MaterialPair;
use crate::narrow_phase::Touch;
use crate::observe::accounts::{Accounts, Cause};
use crate::observe::event_log::{Acted, EventKind, EventLog, PieceKind};
use crate::observe::ledger::Ledger;
use crate::observe::report::{ImpactReport, SolveReport};
use crate::settings::{EnergyGuard, ImpactLaw, Settings};
use carom_geometry::Geometry;
use carom_math::Column;
use carom_solver::{ContactProblem, Impulse, ImpulseSolver, Impulses, Outcome, Stop, Twist, Watch};

/// Rounds of impacts within a fixed step; a blow that runs through more bodies goes on in the next step.
const ROUNDS: usize = 16;

/// A round of impacts, kept for whoever differentiates it.
#[derive(Clone)]
pub struct Blow<S: Geometry> {
    /// Its problem: velocities are those before it.
    pub problem: ContactProblem<S>,
    /// Its impulses.
    pub impulses: Impulses<S>,
    /// Which contacts bounce.
    pub bounces: Vec<bool>,
    /// The law that it went by.
    pub law: ImpactLaw,
    /// True where its own law would gain energy somewhere, whatever became of that.
    pub gains: bool,
}

/// Memory of the impact phase.
pub struct Impacts<S: Geometry> {
    /// The impact problem of the last step that had one: of its first round.
    pub problem: ContactProblem<S>,
    /// Its impulses.
    pub impulses: Impulses<S>,
    /// Index into the step's touches of each contact of the problem; empty when nothing approached.
    pub struck: Vec<usize>,
    /// Impulse of each of the step's touches over all rounds, in its contact frame.
    pub totals: Vec<Impulse<S>>,
    /// Rounds that the last call of `resolve` took.
    pub rounds: usize,
    /// Islands whose own law gains energy; what became of them is `energy_guard`'s matter.
    pub guarded: usize,
    /// Times that its rounds did not end by themselves and what still approached was ended plastically.
    pub ended_plastic: usize,
    /// Moment of rolling and spinning friction of each of the step's touches over all rounds, in world axes.
    pub moments: Vec<S::Spin>,
    /// The rounds of the last call of `resolve`, where they are asked for (`Thresholds::thorough`); times are 0.
    pub log: EventLog<S>,
    /// What each body is given by the impacts, added up over calls of `resolve`; whose scheme asks for it makes it.
    pub accounts: Accounts<S>,
    /// What the last call of `resolve` made the joints give.
    pub(crate) joints: Vec<JointImpulse<S>>,
    /// Numbers of the joints whose rows the problem has.
    held: Vec<usize>,
    /// Energy that the guarded islands' own law gains \[J\].
    gain: f64,
    /// Bodies of the contact that gains most.
    gaining: Option<(usize, usize)>,
    /// Problem, impulses and indices of the later rounds.
    later: (ContactProblem<S>, Impulses<S>, Vec<usize>),
    after: Vec<Twist<S>>,
    bounces: Vec<bool>,
    /// Tangential restitution of each contact of the problem \[1\].
    turned: Vec<f64>,
    /// The touches that take part in this round.
    parts: Vec<Option<Part>>,
    /// True for touches whose approach an earlier round of the step has resolved.
    resolved: Vec<bool>,
    /// True for touches that a plastic round has held, and no bounce was since.
    settled: Vec<bool>,
    /// Where the rounds are kept, if they are.
    pub blows: Option<Vec<Blow<S>>>,
}

impl<S: Geometry> Default for Impacts<S> {
    fn default() -> Self {
        let problem = ContactProblem::new(Vec::new(), Vec::new());
        let impulses = Impulses::zero(&problem);
        Impacts {
            later: (problem.clone(), impulses.clone(), Vec::new()),
            impulses,
            problem,
            struck: Vec::new(),
            totals: Vec::new(),
            rounds: 0,
            guarded: 0,
            ended_plastic: 0,
            moments: Vec::new(),
            log: EventLog::default(),
            accounts: Accounts::default(),
            joints: Vec::new(),
            held: Vec::new(),
            gain: 0.0,
            gaining: None,
            after: Vec::new(),
            bounces: Vec::new(),
            turned: Vec::new(),
            parts: Vec::new(),
            resolved: Vec::new(),
            settled: Vec::new(),
            blows: None,
        }
    }
}

/// A solver, and who watches it.
pub struct Watched<'a, 'w, S: Geometry> {
    /// The solver.
    pub solver: &'a mut dyn ImpulseSolver<S>,
    /// Told of long solves.
    pub watch: &'a mut Watch<'w>,
}

impl<S: Geometry> Impacts<S> {
    /// Applies the impact law where anything approaches; `None` when nothing does.
    pub fn resolve(
        &mut self,
        bodies: &mut Bodies<S>,
        touches: &[Touch<S>],
        settings: &Settings<S>,
        thresholds: &Thresholds,
        watched: &mut Watched<S>,
        ledger: &mut Ledger,
    ) -> Option<SolveReport> {
        let law = settings.impact_law();
        let thorough = thresholds.thorough || law == ImpactLaw::GeneralizedReflections;
        let most = match law {
            ImpactLaw::Sequential => 1, // goes through all collisions by itself
            _ if thorough => reflections::ROUNDS,
            _ => ROUNDS,
        };
        let never = f64::INFINITY;
        let no_bounce = Thresholds { rest_speed: never, elastic_rest_speed: never, ..*thresholds };
        self.begin(touches.len());
        self.begin_joints(bodies, touches, (law, thresholds), ledger);
        let mut report: Option<SolveReport> = None;
        loop {
            let last = self.rounds == most;
            if last && !thorough {
                break;
            }
            let (law, limits) =
                if last { (ImpactLaw::GeneralizedReflections, &no_bounce) } else { (law, thresholds) };
            let done = if thorough { &self.settled } else { &self.resolved };
            if !part::choose(bodies, touches, law, limits, done, &mut self.parts) {
                break;
            }
            if self.rounds == 1 {
                self.exchange();
            }
            self.assemble(bodies, touches, law, settings);
            let solved = self.strike(bodies, law, settings, limits, watched, ledger);
            if thresholds.thorough {
                self.log_round(bodies, touches);
            }
            let refused = matches!(solved.stop, Stop::Refused(_) | Stop::Interrupted);
            report = Some(match report {
                Some(before) => joined(before, solved),
                None => solved,
            });
            self.rounds += 1;
            self.ended_plastic += usize::from(last);
            let raised = self.guarded > 0 && settings.energy_guard == EnergyGuard::Raise;
            if refused || raised || last {
                break;
            }
        }
        if self.rounds > 1 {
            self.exchange();
        }
        report
    }

    fn begin(&mut self, touches: usize) {
        for marks in [&mut self.resolved, &mut self.settled] {
            marks.clear();
            marks.resize(touches, false);
        }
        self.struck.clear();
        self.totals.clear();
        self.totals.resize(touches, Impulse::default());
        self.moments.clear();
        self.moments.resize(touches, S::Spin::ZERO);
        self.log.clear();
        (self.rounds, self.guarded, self.ended_plastic) = (0, 0, 0);
        (self.gain, self.gaining) = (0.0, None);
    }

    /// An impact is between bodies whose joints are consistent: what a step leaves of G v (theory 9.3) ends first.
    fn begin_joints(
        &mut self,
        bodies: &mut Bodies<S>,
        touches: &[Touch<S>],
        (law, thresholds): (ImpactLaw, &Thresholds),
        ledger: &mut Ledger,
    ) {
        self.joints.clear();
        if bodies.joints.is_empty() {
            return;
        }
        self.joints.resize(bodies.joints.len(), JointImpulse::default());
        if !part::choose(bodies, touches, law, thresholds, &self.resolved, &mut self.parts) {
            return;
        }
        let mut islands = Islands::of(bodies, touches, &self.parts);
        let called = islands.where_any(bodies, touches, &self.parts, |p| p.calls);
        let joints = &bodies.joints.all;
        let chosen: Vec<bool> = joints.iter().map(|j| called[islands.root_of(mover(bodies, j))]).collect();
        still(bodies, &chosen, ledger, &mut self.joints);
    }

    /// True when a round of the step had this touch in its problem.
    pub fn resolved(&self, touch: usize) -> bool {
        self.resolved[touch]
    }

    /// Sets the first round's problem aside, or brings it back.
    fn exchange(&mut self) {
        std::mem::swap(&mut self.problem, &mut self.later.0);
        std::mem::swap(&mut self.impulses, &mut self.later.1);
        std::mem::swap(&mut self.struck, &mut self.later.2);
    }

    /// Solves the assembled problem, changes the velocities, and books the work.
    fn strike(
        &mut self,
        bodies: &mut Bodies<S>,
        law: ImpactLaw,
        settings: &Settings<S>,
        thresholds: &Thresholds,
        watched: &mut Watched<S>,
        ledger: &mut Ledger,
    ) -> SolveReport {
        let guarded = self.guarded;
        let outcome = self.solve(law, settings, thresholds, watched);
        let gains = self.guarded > guarded;
        if let Some(blows) = &mut self.blows {
            let (problem, impulses) = (self.problem.clone(), self.impulses.clone());
            blows.push(Blow { problem, impulses, bounces: self.bounces.clone(), law, gains });
        }
        for (&k, g) in self.struck.iter().zip(&self.impulses.contacts) {
            self.totals[k].normal += g.normal;
            self.totals[k].tangent += g.tangent;
        }
        for (r, m) in self.problem.resistances.iter().zip(&self.impulses.moments) {
            self.moments[self.struck[r.contact]] += self.problem.contacts[r.contact].moment_to_world(*m);
        }
        let held: Vec<_> = self.held.iter().map(|&k| bodies.joints.all[k]).collect();
        for (k, wrench) in self.held.iter().zip(wrenches(&held, &self.problem, &self.impulses)) {
            self.joints[*k].impacts.add_scaled(&wrench, 1.0);
        }
        self.after.clear();
        self.after.extend_from_slice(&self.problem.velocities);
        self.problem.apply(&self.impulses, &mut self.after);
        self.book(bodies, ledger);
        self.account(bodies);
        assembly::write_back(bodies, &self.after);
        let worst = assembly::bodies_of(&self.problem, outcome.residual.worst);
        SolveReport::new(outcome, self.problem.contacts.len(), worst)
    }

    fn solve(
        &mut self,
        law: ImpactLaw,
        settings: &Settings<S>,
        thresholds: &Thresholds,
        Watched { solver, watch }: &mut Watched<S>,
    ) -> Outcome {
        self.impulses.reset(&self.problem);
        let solve = settings.solve();
        let (problem, impulses) = (&self.problem, &mut self.impulses);
        let outcome = match law {
            ImpactLaw::Newton | ImpactLaw::GeneralizedReflections => {
                newton::solve(problem, &solve, *solver, impulses, watch)
            }
            ImpactLaw::Poisson => poisson::solve(problem, &self.bounces, &solve, *solver, impulses, watch),
            ImpactLaw::Moreau => {
                return moreau::solve(problem, &self.bounces, &solve, *solver, impulses, watch);
            }
            ImpactLaw::Sequential => {
                let clamp = settings.energy_guard == EnergyGuard::Clamp;
                let asked = sequential::Asked { limits: thresholds, turned: &self.turned, clamp };
                let ended = sequential::solve(problem, &asked, &solve, &mut self.bounces, impulses);
                self.ended_plastic += usize::from(ended.plastic);
                self.guarded += ended.guarded;
                if clamp || self.turned.iter().all(|share| *share == 0.0) {
                    return ended.outcome; // collisions one by one gain nothing, or were guarded by themselves
                }
                ended.outcome
            }
        };
        let policy = settings.energy_guard;
        let gain = guard::apply(&self.problem, &self.bounces, policy, &solve, *solver, &mut self.impulses);
        self.guarded += gain.islands;
        if gain.energy > self.gain {
            self.gaining = gain.most.map(|(pair, _)| pair);
        }
        self.gain += gain.energy;
        outcome
    }

    /// Refuses what the last `resolve` did where it gains energy and the settings ask for that: the impacts after it
    /// were left out.
    ///
    /// # Errors
    /// [`StepError::EnergyGain`].
    pub fn check(&self, bodies: &Bodies<S>, settings: &Settings<S>, time: f64) -> Result<(), StepError> {
        match self.gaining.filter(|_| settings.energy_guard == EnergyGuard::Raise) {
            None => Ok(()),
            Some((a, b)) => Err(StepError::EnergyGain {
                bodies: (bodies.names[a].clone(), bodies.names[b].clone()),
                law: settings.impact_law().name(),
                energy: self.gain,
                time,
            }),
        }
    }

    /// What the last `resolve` came to.
    pub fn report(&self) -> ImpactReport {
        let Impacts { rounds, guarded, ended_plastic, gain, gaining, .. } = *self;
        ImpactReport { rounds, guarded, ended_plastic, gain, gaining }
    }

    /// The impact problem of the present velocities, on the islands where something calls for one.
    fn assemble(&mut self, bodies: &Bodies<S>, touches: &[Touch<S>], law: ImpactLaw, settings: &Settings<S>) {
        let mut islands = Islands::of(bodies, touches, &self.parts);
        let called = islands.where_any(bodies, touches, &self.parts, |p| p.calls);
        let bouncing = islands.where_any(bodies, touches, &self.parts, |p| p.bounces);
        // these laws let a contact bounce that a blow presses, whether it approached or not
        let bounce_together = matches!(law, ImpactLaw::Moreau | ImpactLaw::Poisson);
        assembly::begin(&mut self.problem, bodies, settings.friction_law);
        self.bounces.clear();
        self.turned.clear();
        self.struck.clear();
        if bouncing.contains(&true) {
            self.settled.fill(false);
        }
        for (k, t) in touches.iter().enumerate() {
            let root = islands.root(bodies, t);
            let Some(part) = self.parts[k].filter(|_| called[root]) else { continue };
            let mut contact = assembly::contact(bodies, t, part.target);
            if part.bounces && t.tangential_restitution > 0.0 {
                let (_, slip) = contact.relative_velocity(&self.problem.velocities);
                contact.slip_target = slip * -t.tangential_restitution;
            }
            self.problem.contacts.push(contact);
            self.turned.push(t.tangential_restitution);
            // one collision after another exchanges no moments: the law of the notes
            if law != ImpactLaw::Sequential {
                assembly::resist(&mut self.problem, t);
            }
            let together = bounce_together && bouncing[root] && t.restitution > 0.0;
            self.bounces.push(part.bounces || together);
            self.struck.push(k);
            self.resolved[k] = true;
            self.settled[k] = !bouncing[root];
        }
        self.held.clear();
        for (k, j) in bodies.joints.all.iter().enumerate() {
            if called[islands.root_of(mover(bodies, j))] {
                j.push_rows(&bodies.motion, &j.frame(bodies), &mut self.problem.rows);
                self.held.push(k);
            }
        }
    }

    fn account(&mut self, bodies: &Bodies<S>) {
        let mut accounts = std::mem::take(&mut self.accounts);
        let velocities = (self.problem.velocities.as_slice(), self.after.as_slice());
        let cause = |k| if self.is_cut(k) { Cause::RestCut } else { Cause::Impact };
        accounts.kick(bodies, &self.problem, &self.impulses, velocities, cause);
        self.accounts = accounts;
    }

    /// True for a contact of the present round that could bounce and does not.
    fn is_cut(&self, k: usize) -> bool {
        self.problem.contacts[k].restitution > 0.0 && !self.bounces[k]
    }

    /// Writes down what the contacts of the present round did.
    fn log_round(&mut self, bodies: &Bodies<S>, touches: &[Touch<S>]) {
        let struck: Vec<Touch<S>> = self.struck.iter().map(|&k| touches[k]).collect();
        let mut log = std::mem::take(&mut self.log);
        let (time, length) = (0.0, 0.0);
        let acted =
            Acted { time, length, touches: &struck, problem: &self.problem, impulses: &self.impulses };
        log.add(&acted, |k| if self.is_cut(k) { EventKind::RestCut } else { EventKind::Impact }, |i| i);
        let mut movers: Vec<usize> = struck.iter().flat_map(|t| [t.a, t.b]).collect();
        movers.retain(|&i| bodies.is_dynamic(i));
        movers.sort_unstable();
        movers.dedup();
        log.end_act(PieceKind::Impact, time, length, movers.into_iter());
        log.add_rows(&self.problem, &self.impulses, |i| i);
        self.log = log;
    }

    fn book(&self, bodies: &Bodies<S>, ledger: &mut Ledger) {
        let mut lines = Ledger::default();
        let (mut normal, mut rest_cut, mut friction) = (0.0, 0.0, 0.0);
        let book = |k: usize, n: f64, t: f64| {
            if self.is_cut(k) {
                rest_cut += n
            } else {
                normal += n
            }
            friction += t;
        };
        let p = &self.problem;
        assembly::contact_work(bodies, p, &self.impulses, &p.velocities, &self.after, book, &mut lines);
        lines.constraint =
            assembly::row_work(bodies, p, &self.impulses, &p.velocities, &self.after, &mut lines);
        lines.impact_normal = normal;
        lines.rest_cut = rest_cut;
        lines.impact_friction = friction;
        ledger.add(&lines);
    }
}

/// Refuses tangential restitution where the law has none of its own: Moreau's reverses slips by its e, Poisson's
/// second phase gives friction back by the slip alone.
///
/// # Errors
/// [`StepError::Argument`] naming the body, or the pair of materials.
pub(crate) fn check<S: Geometry>(bodies: &Bodies<S>, settings: &Settings<S>) -> Result<(), StepError> {
    let law = settings.impact_law();
    if !matches!(law, ImpactLaw::Moreau | ImpactLaw::Poisson) {
        return Ok(());
    }
    let body = bodies.data.iter().position(|d| d.tangential_restitution > 0.0);
    let body = body
        .map(|i| format!("body '{}' asks for {}", bodies.names[i], bodies.data[i].tangential_restitution));
    let asks = |(a, b, pair): (&str, &str, MaterialPair)| {
        let share = pair.tangential_restitution.filter(|share| *share > 0.0)?;
        Some(format!("the pair of '{a}' and '{b}' asks for {share}"))
    };
    let Some(asking) = body.or_else(|| bodies.materials.pairs().find_map(asks)) else { return Ok(()) };
    let problem = format!("has no tangential restitution: '{}'; {asking}", law.name());
    let remedy = "choose impact = \"newton\", \"generalized_reflections\" or \"sequential\"".into();
    Err(StepError::Argument { field: "impact", problem, remedy })
}

/// One report of two rounds: iterations of both, the residual of the worse.
fn joined(one: SolveReport, other: SolveReport) -> SolveReport {
    let iterations = one.iterations + other.iterations;
    let contacts = one.contacts.max(other.contacts);
    let (worse, better) = if other.residual > one.residual { (other, one) } else { (one, other) };
    let stop = if better.stop == Stop::Converged { worse.stop } else { better.stop };
    SolveReport { iterations, contacts, stop, ..worse }
}

/// The outcome of a law that has no residual of its own: the approach that is left.
fn judged_by_approach(iterations: usize, approach: f64, tolerance: f64) -> Outcome {
    let residual = carom_solver::Residual { absolute: approach, relative: 0.0, worst: None };
    Outcome::judged(iterations, residual, tolerance)
}
