//! Impacts: what simultaneous collisions do to the velocities in no time, before gravity and loads act
//! (theory chapter 4). The law is a choice of its own, apart from solver and friction law. Restitution acts on
//! approaches faster than the rest speed k |g| h; slower ones end without bounce (the ledger's rest cut).
//! A bounce sends its bodies on to others; rounds follow it within the step. Knows no loads and no clock.

mod guard;
mod newton;
mod sequential;

use crate::assembly;
use crate::bodies::Bodies;
use crate::narrow_phase::{Touch, normal_velocity};
use crate::observe::ledger::Ledger;
use crate::observe::report::SolveReport;
use crate::settings::{ImpactLaw, Settings};
use carom_geometry::Geometry;
use carom_math::Column;
use carom_solver::{
    ContactProblem, Impulse, ImpulseSolver, Impulses, Outcome, Partition, Stop, Twist, Watch,
};

/// Rounds of impacts within a step; a blow that runs through more bodies goes on in the next step.
const ROUNDS: usize = 16;

/// Speeds and lengths that tell kinds of contact apart, for one step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Thresholds {
    /// Impacts slower than this do not bounce \[m/s\].
    pub rest_speed: f64,
    /// Approaches slower than this are the solver's noise \[m/s\].
    pub still_speed: f64,
    /// Plastic approaches slower than this do not make an impact phase necessary \[m/s\].
    pub call_speed: f64,
    /// Gaps up to this count as touching \[m\].
    pub touching: f64,
    /// Length of the step \[s\].
    pub dt: f64,
}

/// What a contact is to this step.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Role {
    /// Arrives within the step, or touches already, and fast enough to bounce.
    Bounces,
    /// Ends its approach within the step without a bounce, or rests.
    Holds,
    /// Approaches fast enough to bounce, but arrives in a later step: left alone until then.
    Pending,
}

impl Thresholds {
    /// The role of a contact from its gap and normal velocity.
    pub fn role(&self, gap: f64, normal_velocity: f64, restitution: f64) -> Role {
        let fast = restitution > 0.0 && -normal_velocity > self.rest_speed.max(self.still_speed);
        match (fast, gap <= self.touching || gap + self.dt * normal_velocity < 0.0) {
            (true, true) => Role::Bounces,
            (true, false) => Role::Pending,
            _ => Role::Holds,
        }
    }
    /// Normal velocity that closes a gap within the step and no more \[m/s\].
    pub fn closing(&self, gap: f64) -> f64 {
        -gap.max(0.0) / self.dt
    }
}

/// What one touch is to one round.
#[derive(Clone, Copy, Debug)]
struct Part {
    bounces: bool,
    target: f64,
    /// True when it makes the round necessary.
    calls: bool,
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
    /// Moment of rolling and spinning friction of each of the step's touches over all rounds, in world axes.
    pub moments: Vec<S::Spin>,
    /// Problem, impulses and indices of the later rounds.
    later: (ContactProblem<S>, Impulses<S>, Vec<usize>),
    after: Vec<Twist<S>>,
    bounces: Vec<bool>,
    /// The touches that take part in this round.
    parts: Vec<Option<Part>>,
    /// True for touches whose approach an earlier round of the step has resolved.
    resolved: Vec<bool>,
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
            moments: Vec::new(),
            after: Vec::new(),
            bounces: Vec::new(),
            parts: Vec::new(),
            resolved: Vec::new(),
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
        self.resolved.clear();
        self.resolved.resize(touches.len(), false);
        self.struck.clear();
        self.totals.clear();
        self.totals.resize(touches.len(), Impulse::default());
        self.moments.clear();
        self.moments.resize(touches.len(), S::Spin::ZERO);
        let mut report: Option<SolveReport> = None;
        let mut round = 0;
        while round < ROUNDS && self.is_called(bodies, touches, settings.impact, thresholds) {
            if round == 1 {
                self.exchange();
            }
            self.assemble(bodies, touches, settings);
            let solved = self.strike(bodies, settings, thresholds, watched, ledger);
            let refused = matches!(solved.stop, Stop::Refused(_) | Stop::Interrupted);
            report = Some(match report {
                Some(before) => joined(before, solved),
                None => solved,
            });
            round += 1;
            if refused || settings.impact == ImpactLaw::Sequential {
                break; // the sequential law has gone through all rounds by itself
            }
        }
        if round > 1 {
            self.exchange();
        }
        report
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
        settings: &Settings<S>,
        thresholds: &Thresholds,
        watched: &mut Watched<S>,
        ledger: &mut Ledger,
    ) -> SolveReport {
        let outcome = self.solve(settings, thresholds, watched);
        for (&k, g) in self.struck.iter().zip(&self.impulses.contacts) {
            self.totals[k].normal += g.normal;
            self.totals[k].tangent += g.tangent;
        }
        for (r, m) in self.problem.resistances.iter().zip(&self.impulses.moments) {
            self.moments[self.struck[r.contact]] += self.problem.contacts[r.contact].moment_to_world(*m);
        }
        self.after.clear();
        self.after.extend_from_slice(&self.problem.velocities);
        self.problem.apply(&self.impulses, &mut self.after);
        self.book(bodies, ledger);
        assembly::write_back(bodies, &self.after);
        let worst = assembly::bodies_of(&self.problem, outcome.residual.worst);
        SolveReport::new(outcome, self.problem.contacts.len(), worst)
    }

    fn solve(
        &mut self,
        settings: &Settings<S>,
        thresholds: &Thresholds,
        Watched { solver, watch }: &mut Watched<S>,
    ) -> Outcome {
        self.impulses.reset(&self.problem);
        let solve = settings.solve();
        match settings.impact {
            ImpactLaw::Newton => {
                let outcome = newton::solve(&self.problem, &solve, *solver, &mut self.impulses, watch);
                guard::apply(&self.problem, &self.bounces, &solve, *solver, &mut self.impulses);
                outcome
            }
            ImpactLaw::Sequential => {
                sequential::solve(&self.problem, thresholds, &solve, &mut self.bounces, &mut self.impulses)
            }
        }
    }

    /// The impact problem of the present velocities, on the islands where something calls for one.
    fn assemble(&mut self, bodies: &Bodies<S>, touches: &[Touch<S>], settings: &Settings<S>) {
        let pairs = touches.iter().zip(&self.parts).filter(|(_, p)| p.is_some()).map(|(t, _)| (t.a, t.b));
        let mut islands = Partition::default();
        islands.reset(bodies.len());
        let joins = |&(a, b): &(usize, usize)| bodies.is_dynamic(a) && bodies.is_dynamic(b);
        pairs.filter(joins).for_each(|(a, b)| islands.join(a, b));
        // an obstacle belongs to no island: a contact is where its body that moves is
        let mover = |t: &Touch<S>| if bodies.is_dynamic(t.a) { t.a } else { t.b };
        let mut called = vec![false; bodies.len()];
        for (t, p) in touches.iter().zip(&self.parts) {
            if p.is_some_and(|p| p.calls) {
                called[islands.root(mover(t))] = true;
            }
        }
        assembly::begin(&mut self.problem, bodies, settings.friction_law);
        self.bounces.clear();
        self.struck.clear();
        for (k, t) in touches.iter().enumerate() {
            let Some(part) = self.parts[k].filter(|_| called[islands.root(mover(t))]) else { continue };
            self.problem.contacts.push(assembly::contact(bodies, t, part.target));
            // one collision after another exchanges no moments: the law of the notes
            if settings.impact == ImpactLaw::Newton {
                assembly::resist(&mut self.problem, t);
            }
            self.bounces.push(part.bounces);
            self.struck.push(k);
            self.resolved[k] = true;
        }
    }

    /// Sets who takes part: contacts that approach, and those that touch and would feel it. Contacts that separate
    /// stay out where something bounces, for asking them to stop separating would make energy (theory eq. 4.23).
    /// True when anything calls for a round.
    fn is_called(
        &mut self,
        bodies: &Bodies<S>,
        touches: &[Touch<S>],
        law: ImpactLaw,
        limits: &Thresholds,
    ) -> bool {
        self.parts.clear();
        let mut bouncing = false;
        for (t, resolved) in touches.iter().zip(&self.resolved) {
            let u = normal_velocity(bodies, t);
            let role = limits.role(t.gap, u, t.restitution);
            let bounces = role == Role::Bounces;
            let target = if bounces { -t.restitution * u } else { limits.closing(t.gap) };
            let approaches = u < target.min(0.0) - limits.still_speed;
            // slower ones leave an overlap of h u/2 at most, which the kick stops and the correction closes
            let calls =
                bounces || (role == Role::Holds && u < target.min(0.0) - limits.call_speed && !resolved);
            // an elastic contact that is open waits for its own approach; all others feel their neighbours at once
            let feels = t.restitution == 0.0 || t.gap <= limits.touching || law == ImpactLaw::Sequential;
            let takes_part =
                bounces || law == ImpactLaw::Sequential || (role == Role::Holds && (approaches || feels));
            bouncing |= bounces;
            self.parts.push(takes_part.then_some(Part { bounces, target, calls }));
        }
        if bouncing && law == ImpactLaw::Newton {
            for (t, part) in touches.iter().zip(&mut self.parts) {
                let separates = normal_velocity(bodies, t) > limits.still_speed;
                *part = part.filter(|_| !separates);
            }
        }
        self.parts.iter().flatten().any(|p| p.calls)
    }

    fn book(&self, bodies: &Bodies<S>, ledger: &mut Ledger) {
        let mut lines = Ledger::default();
        let (mut normal, mut rest_cut, mut friction) = (0.0, 0.0, 0.0);
        let book = |k: usize, n: f64, t: f64| {
            let cut = self.problem.contacts[k].restitution > 0.0 && !self.bounces[k];
            if cut {
                rest_cut += n
            } else {
                normal += n
            }
            friction += t;
        };
        let p = &self.problem;
        assembly::contact_work(bodies, p, &self.impulses, &p.velocities, &self.after, book, &mut lines);
        lines.impact_normal = normal;
        lines.rest_cut = rest_cut;
        lines.impact_friction = friction;
        ledger.add(&lines);
    }
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
