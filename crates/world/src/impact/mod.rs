//! Impacts: what simultaneous collisions do to the velocities in no time, before gravity and loads act
//! (theory chapter 4). The law is a choice of its own, apart from solver and friction law. Restitution acts on
//! approaches faster than the rest speed k |g| h; slower ones end without bounce (the ledger's rest cut).

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
use carom_solver::{ContactProblem, ImpulseSolver, Impulses, Outcome, SolveSettings, Twist};

/// Speeds and lengths that tell kinds of contact apart, for one step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Thresholds {
    /// Impacts slower than this do not bounce \[m/s\].
    pub rest_speed: f64,
    /// Approaches slower than this are the solver's noise \[m/s\].
    pub still_speed: f64,
    /// Gaps up to this count as touching \[m\].
    pub touching: f64,
    /// Length of the step \[s\].
    pub dt: f64,
}

/// What a contact is to this step.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Role {
    /// Touching and fast enough to bounce.
    Bounces,
    /// Ends its approach within the step without a bounce, or rests.
    Holds,
    /// Will overlap within this step and bounce in the next: left alone until then.
    Pending,
}

impl Thresholds {
    /// The role of a contact from its gap and normal velocity.
    pub fn role(&self, gap: f64, normal_velocity: f64, restitution: f64) -> Role {
        let fast = restitution > 0.0 && -normal_velocity > self.rest_speed;
        match (fast, gap <= self.touching) {
            (true, true) => Role::Bounces,
            (true, false) => Role::Pending,
            _ => Role::Holds,
        }
    }
}

/// Memory of the impact phase.
pub struct Impacts<S: Geometry> {
    /// The impact problem of the last step that had one.
    pub problem: ContactProblem<S>,
    /// Its impulses.
    pub impulses: Impulses<S>,
    /// Index into the step's touches of each contact of the problem; empty when nothing approached.
    pub struck: Vec<usize>,
    after: Vec<Twist<S>>,
    bounces: Vec<bool>,
}

impl<S: Geometry> Default for Impacts<S> {
    fn default() -> Self {
        let problem = ContactProblem::new(Vec::new(), Vec::new());
        let impulses = Impulses::zero(&problem);
        Impacts { impulses, problem, struck: Vec::new(), after: Vec::new(), bounces: Vec::new() }
    }
}

impl<S: Geometry> Impacts<S> {
    /// Applies the impact law where anything approaches; `None` when nothing does.
    pub fn resolve(
        &mut self,
        bodies: &mut Bodies<S>,
        touches: &[Touch<S>],
        settings: &Settings<S>,
        thresholds: &Thresholds,
        solver: &mut dyn ImpulseSolver<S>,
        ledger: &mut Ledger,
    ) -> Option<SolveReport> {
        if !self.assemble(bodies, touches, settings, thresholds) {
            return None;
        }
        self.impulses.reset(&self.problem);
        let solve = SolveSettings { iterations: settings.iterations, tolerance: settings.tolerance };
        let outcome = match settings.impact {
            ImpactLaw::Newton => newton::solve(&self.problem, &solve, solver, &mut self.impulses),
            ImpactLaw::Sequential => {
                sequential::solve(&self.problem, thresholds, &solve, &mut self.impulses)
            }
        };
        self.after.clear();
        self.after.extend_from_slice(&self.problem.velocities);
        self.problem.apply(&self.impulses, &mut self.after);
        self.book(bodies, ledger);
        assembly::write_back(bodies, &self.after);
        let worst = assembly::bodies_of(&self.problem, outcome.residual.worst);
        Some(SolveReport::new(outcome, self.problem.contacts.len(), worst))
    }

    /// The impact problem of the present velocities; false when nothing approaches.
    fn assemble(
        &mut self,
        bodies: &Bodies<S>,
        touches: &[Touch<S>],
        settings: &Settings<S>,
        thresholds: &Thresholds,
    ) -> bool {
        self.struck.clear();
        let wanted = |t: &Touch<S>| {
            let u = normal_velocity(bodies, t);
            let role = thresholds.role(t.gap, u, t.restitution);
            let target = match role {
                Role::Bounces => -t.restitution * u,
                Role::Holds => -t.gap.max(0.0) / thresholds.dt,
                Role::Pending => return None,
            };
            Some((role, u, target))
        };
        let approaching = touches
            .iter()
            .any(|t| wanted(t).is_some_and(|(_, u, target)| u < target.min(0.0) - thresholds.still_speed));
        if !approaching {
            return false;
        }
        assembly::begin(&mut self.problem, bodies, settings.friction_law);
        self.bounces.clear();
        for (k, t) in touches.iter().enumerate() {
            if let Some((role, _, target)) = wanted(t) {
                self.struck.push(k);
                self.problem.contacts.push(assembly::contact(bodies, t, target, &|_| S::Vector::ZERO));
                self.bounces.push(role == Role::Bounces);
            }
        }
        true
    }

    fn book(&self, bodies: &Bodies<S>, ledger: &mut Ledger) {
        let mut lines = Ledger::default();
        let (mut normal, mut rest_cut, mut friction) = (0.0, 0.0, 0.0);
        let book = |k: usize, n: f64, t: f64| {
            let cut = self.problem.contacts[k].restitution > 0.0 && !self.bounces[k];
            if cut { rest_cut += n } else { normal += n }
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

/// The outcome of a law that has no residual of its own: the approach that is left.
fn judged_by_approach(iterations: usize, approach: f64, tolerance: f64) -> Outcome {
    let residual = carom_solver::Residual { absolute: approach, relative: 0.0, worst: None };
    Outcome::judged(iterations, residual, tolerance)
}
