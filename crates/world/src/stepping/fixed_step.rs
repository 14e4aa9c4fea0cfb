//! Steps of a fixed length (theory chapter 6). At the step's start approaching contacts get their impact, on
//! the velocities before gravity; then drift - kick - drift with the persistent contacts in the kick:
//! gap + h ((1-s) u_n- + s u_n+) >= 0 on the displacement that the integrator makes of them (s its end share,
//! 1/2: the mean velocity), friction against the slip at the end. Overlap is corrected last, and booked.
//! What it does not do: find the time of an impact. A bouncing body overlaps by up to h |u_n| first.

use crate::assembly;
use crate::bodies::Bodies;
use crate::correction::{Correction, Overlap};
use crate::error::StepError;
use crate::force::Wrench;
use crate::impact::{Impacts, Role, Thresholds, Watched};
use crate::integrate::{DriftWork, Integrator, Loads, Step};
use crate::joint::{JointImpulse, add_all, wrenches};
use crate::mid_step::MidStep;
use crate::narrow_phase::{Touch, normal_velocity, smallest_extent};
use crate::observe::accounts::{Accounts, Cause, Motive};
use crate::observe::energy::Energy;
use crate::observe::ledger::Ledger;
use crate::observe::report::SolveReport;
use crate::settings::{OnInaccurate, Settings};
use crate::stepping::held::{self, Held};
use crate::stepping::{Chosen, Outside, SchemeReport, choose_solver, damp};
use crate::warm_start::{ByName, WarmStart};
use carom_geometry::Geometry;
use carom_math::{Column, Inertia};
use carom_solver::{ContactProblem, Impulses, SolveSettings, SolverKind, Stop, Twist, Watch};

/// Memory of the scheme: nothing in it changes an answer but the warm start, which the world keeps.
pub struct FixedStep<S: Geometry> {
    solver: Chosen<S>,
    /// The solve that a step was refused for.
    pub failed: Option<SolveReport>,
    /// The impacts of the last step.
    pub impacts: Impacts<S>,
    mid_step: MidStep<S>,
    /// The position correction of the last step.
    pub correction: Correction<S>,
    /// The contact problem of the last step.
    pub problem: ContactProblem<S>,
    /// Its impulses.
    pub impulses: Impulses<S>,
    /// Index into the step's touches of each contact of the problem.
    pub pressed: Vec<usize>,
    /// The order of its contacts' names.
    names: ByName,
    approaches: Vec<f64>,
    start: Vec<Twist<S>>,
    free: Vec<Twist<S>>,
    after: Vec<Twist<S>>,
    origin: Vec<S::Vector>,
    wrenches: Vec<Wrench<S>>,
    /// The applied loads of the last step, their mean over it; entries of bodies that forces do not move mean nothing.
    pub loads: Vec<Wrench<S>>,
    overlaps: Vec<Overlap<S>>,
    /// What each body was given in the last step, where that is asked for.
    pub accounts: Accounts<S>,
    /// What the joints gave in the last step.
    pub(crate) joints: Vec<JointImpulse<S>>,
}

impl<S: Geometry> Default for FixedStep<S> {
    fn default() -> Self {
        let problem = ContactProblem::new(Vec::new(), Vec::new());
        FixedStep {
            solver: None,
            failed: None,
            impacts: Impacts::default(),
            mid_step: MidStep::default(),
            correction: Correction::default(),
            impulses: Impulses::zero(&problem),
            problem,
            pressed: Vec::new(),
            names: ByName::default(),
            approaches: Vec::new(),
            start: Vec::new(),
            free: Vec::new(),
            after: Vec::new(),
            origin: Vec::new(),
            wrenches: Vec::new(),
            loads: Vec::new(),
            overlaps: Vec::new(),
            accounts: Accounts::default(),
            joints: Vec::new(),
        }
    }
}

/// Share of |g| h below which a plastic approach is left to the kick \[1\]: it stops there, after a way of at most
/// half of h u, which is within the correction's slop. Below it lies what inexact solves leave in piles; an impact
/// phase of their own, solved from nothing and inexactly, would take away in each step what the warm start of the
/// kick is about to hold, and towers would shake themselves down.
const CALL: f64 = 0.5;

/// The speeds and lengths of a step.
pub fn thresholds<S: Geometry>(settings: &Settings<S>, bodies: &Bodies<S>, dt: f64) -> Thresholds {
    let speed = settings.gravity.norm() * dt;
    Thresholds {
        rest_speed: settings.rest_speed_factor * speed,
        elastic_rest_speed: settings.rest_speed_factor * speed,
        still_speed: settings.tolerance.max(1e-12 * speed),
        call_speed: settings.tolerance.max(CALL * speed),
        touching: 1e-9 * smallest_extent(bodies).unwrap_or(0.0),
        dt,
        thorough: false,
    }
}

impl<S: Geometry> FixedStep<S> {
    /// Advances all bodies by one step.
    ///
    /// # Errors
    /// A refused solve or a failed load; the caller restores the bodies then.
    pub fn advance(
        &mut self,
        bodies: &mut Bodies<S>,
        touches: &[Touch<S>],
        settings: &Settings<S>,
        step: &Step<S>,
        Outside { loads, watch, workers, .. }: Outside<S>,
        warm: &mut WarmStart<S>,
    ) -> Result<SchemeReport<S>, StepError> {
        let mut report = SchemeReport::default();
        let limits = thresholds(settings, bodies, step.dt);
        choose_solver(&mut self.solver, settings, workers);

        self.impacts.accounts = Accounts::new(bodies.len(), self.accounts.are_kept());
        report.impact_solve = self.impact(bodies, touches, settings, &limits, &mut report.ledger, watch);
        self.impacts.check(bodies, settings, step.time)?;
        self.judge(&report.impact_solve, settings, "impact", step.time)?;
        report.impacts = self.impacts.report();
        self.accounts.add(&self.impacts.accounts, |i| i);
        self.approaches.clear();
        self.approaches.extend(touches.iter().map(|t| normal_velocity(bodies, t)));
        damp(bodies, 0.5 * step.dt, &mut report.ledger, &mut self.accounts);
        self.drift_to_kick(bodies, settings.integrator, step, loads, &mut report.ledger)?;
        self.load(bodies, settings.integrator, step, loads, &mut report.ledger)?;
        self.assemble(bodies, touches, settings, &limits);
        report.contact_solve = self.solve_held(bodies, settings, step, warm, watch);
        self.judge(&report.contact_solve, settings, "contact", step.time)?;
        self.kick(bodies, settings.integrator, step, &mut report.ledger);
        self.drift_from_kick(bodies, settings.integrator, step, &mut report.ledger);
        damp(bodies, 0.5 * step.dt, &mut report.ledger, &mut self.accounts);
        self.correct(bodies, touches, settings, &limits, step, &mut report.ledger);
        self.keep_joints(bodies);
        warm.store_by(&self.names, &self.problem, &self.impulses, step.dt);
        Ok(report)
    }

    /// Ends the step when a solve was refused or interrupted, or is less accurate than the settings demand.
    fn judge(
        &mut self,
        report: &Option<SolveReport>,
        settings: &Settings<S>,
        phase: &'static str,
        time: f64,
    ) -> Result<(), StepError> {
        let Some(solve) = report else { return Ok(()) };
        let (contacts, solver) = (solve.contacts, settings.solver_kind().name());
        let error = match &solve.stop {
            Stop::Interrupted => StepError::Interrupted { phase, contacts, time },
            Stop::Refused(reason) => {
                StepError::SolverRefused { solver, phase, contacts, reason: reason.clone(), time }
            }
            _ if settings.on_inaccurate == OnInaccurate::Raise && !solve.is_within(settings.tolerance) => {
                let (residual, tolerance) = (solve.residual, settings.tolerance);
                // the explanation needs the bodies' names, which the world adds
                let explanation = String::new();
                StepError::Inaccurate { solver, phase, contacts, residual, tolerance, explanation, time }
            }
            _ => return Ok(()),
        };
        self.failed = Some(solve.clone());
        Err(error)
    }

    fn impact(
        &mut self,
        bodies: &mut Bodies<S>,
        touches: &[Touch<S>],
        settings: &Settings<S>,
        limits: &Thresholds,
        ledger: &mut Ledger,
        watch: &mut Watch,
    ) -> Option<SolveReport> {
        let (_, _, solver) = self.solver.as_mut()?;
        let mut watched = Watched { solver: solver.as_mut(), watch };
        self.impacts.resolve(bodies, touches, settings, limits, &mut watched, ledger)
    }

    /// First drift; what it does to the energy besides work is the integrator's line.
    fn drift_to_kick(
        &mut self,
        bodies: &mut Bodies<S>,
        integrator: Integrator,
        step: &Step<S>,
        loads: &mut Loads<S>,
        ledger: &mut Ledger,
    ) -> Result<(), StepError> {
        self.start.clear();
        self.start.extend((0..bodies.len()).map(|i| bodies.motion.twist(i)));
        self.origin.clone_from(&bodies.motion.position);
        let before = Energy::of(bodies, step.gravity);
        let marks = self.accounts.marks(bodies, step.gravity);
        let work = integrator.before_kick(bodies, step, loads, &mut self.loads)?;
        let DriftWork { gravity, applied, .. } = work;
        self.accounts.moved(&marks, bodies, step.gravity, Motive::Integrator);
        self.accounts.loads_in_drift(bodies, &self.origin, &work.of_bodies, step, &self.loads);
        if integrator.kicks_with_gravity() {
            // a tumbling body's spin at the kick is another one than at the start
            self.start.clear();
            self.start.extend((0..bodies.len()).map(|i| bodies.motion.twist(i)));
        }
        let after = Energy::of(bodies, step.gravity);
        ledger.gravity += gravity;
        ledger.applied += applied;
        ledger.integrator += after.total() - before.total() - applied;
        Ok(())
    }

    /// Velocities after gravity, loads and Euler's gyroscopic term, before contact impulses: `free`.
    fn load(
        &mut self,
        bodies: &mut Bodies<S>,
        integrator: Integrator,
        step: &Step<S>,
        loads: &mut Loads<S>,
        ledger: &mut Ledger,
    ) -> Result<(), StepError> {
        integrator.load_impulses(bodies, step, loads, &mut self.wrenches)?;
        let gravity = if integrator.kicks_with_gravity() {
            self.loads.clone_from(&self.wrenches);
            step.gravity
        } else {
            S::Vector::ZERO
        };
        self.free.clear();
        for i in 0..bodies.len() {
            let mut v = bodies.motion.twist(i);
            if bodies.is_dynamic(i) {
                let gyro = integrator.gyroscopic_change(bodies, i, step.dt);
                if gyro != S::Spin::ZERO {
                    let before = bodies.rotational_energy(i);
                    v.angular += gyro;
                    bodies.motion.angular_velocity[i] = v.angular;
                    ledger.integrator += bodies.rotational_energy(i) - before;
                    if self.accounts.are_kept() {
                        let account = &mut self.accounts.of_bodies[i];
                        account.energy.integrator += bodies.rotational_energy(i) - before;
                        account.angular_momentum.integrator += bodies.inertia(i).apply(gyro);
                    }
                }
                let inverse = bodies.inverse_mass(i);
                let w = &self.wrenches[i];
                v.linear += (gravity + w.force * inverse.linear) * step.dt;
                v.angular += inverse.angular.apply(w.torque) * step.dt;
            }
            self.free.push(v);
        }
        Ok(())
    }

    /// The contact problem of the kick.
    fn assemble(
        &mut self,
        bodies: &Bodies<S>,
        touches: &[Touch<S>],
        settings: &Settings<S>,
        limits: &Thresholds,
    ) {
        assembly::begin(&mut self.problem, bodies, settings.friction_law);
        self.problem.velocities.clone_from(&self.free);
        self.pressed.clear();
        let (end_share, noise) = (settings.integrator.end_share(), noise_of(settings));
        let turning = settings.integrator.kicks_half_way();
        let touches = self.mid_step.update(bodies, touches, &self.origin, limits.dt, turning);
        for (k, t) in touches.iter().enumerate() {
            let mut contact = assembly::contact(bodies, t, 0.0);
            let before = contact.normal_velocity(&self.start);
            match limits.role(t.gap, before, t.restitution) {
                Role::Holds => {}
                // touches, and the impact phase could not turn it round: it ends here
                Role::Bounces if t.gap <= limits.touching && self.impacts.resolved(k) => {}
                _ => continue,
            }
            let (closing, start) = without_noise(noise, limits.closing(t.gap), self.approaches[k]);
            contact.target = held_velocity(closing, start, before - self.approaches[k], end_share);
            self.problem.contacts.push(contact);
            assembly::resist(&mut self.problem, t);
            self.pressed.push(k);
        }
        self.names.update(&self.problem);
    }

    /// Solves with joints closed at the step's end: again until they are, or the solver brings them no nearer.
    fn solve_held(
        &mut self,
        bodies: &mut Bodies<S>,
        settings: &Settings<S>,
        step: &Step<S>,
        warm: &WarmStart<S>,
        watch: &mut Watch,
    ) -> Option<SolveReport> {
        if bodies.joints.is_empty() {
            self.problem.rows.clear();
            return self.solve(settings, warm, step.dt, watch);
        }
        let mut held = Held::new(bodies, settings.integrator, &self.start);
        let mut report: Option<SolveReport> = None;
        let mut last = warm.clone();
        for _ in 0..held::ROUNDS {
            self.problem.rows.clear();
            held.push(bodies, &mut self.problem);
            let spent = report.map_or(0, |r| r.iterations);
            report = self.solve(settings, &last, step.dt, watch);
            if let Some(report) = &mut report {
                report.iterations += spent;
                if matches!(report.stop, Stop::Refused(_) | Stop::Interrupted) {
                    break;
                }
            }
            self.after.clone_from(&self.free);
            self.problem.apply(&self.impulses, &mut self.after);
            let (start, free, after) = (&self.start, &self.free, &self.after);
            if !held.aim(bodies, settings.integrator, step, start, free, after) {
                break;
            }
            last.store_by(&self.names, &self.problem, &self.impulses, step.dt);
        }
        report
    }

    /// What the joints gave in the step's impacts and in its kick.
    fn keep_joints(&mut self, bodies: &Bodies<S>) {
        self.joints.clear();
        add_all(&mut self.joints, &self.impacts.joints);
        let kicked = wrenches(&bodies.joints.all, &self.problem, &self.impulses);
        let given = |flows| JointImpulse { flows, impacts: Twist::default() };
        add_all(&mut self.joints, &kicked.into_iter().map(given).collect::<Vec<_>>());
    }

    fn solve(
        &mut self,
        settings: &Settings<S>,
        warm: &WarmStart<S>,
        dt: f64,
        watch: &mut Watch,
    ) -> Option<SolveReport> {
        self.impulses.reset(&self.problem);
        if self.problem.contacts.is_empty() && self.problem.rows.is_empty() {
            return None;
        }
        if settings.warm_start {
            warm.load_by(&self.names, &self.problem, dt, &mut self.impulses);
        }
        let (_, _, solver) = self.solver.as_mut()?;
        let solve = SolveSettings { polish: true, ..settings.solve() };
        let outcome = solver.solve_watched(&self.problem, &solve, &mut self.impulses, watch);
        let worst = assembly::bodies_of(&self.problem, outcome.residual.worst);
        Some(SolveReport::new(outcome, self.problem.contacts.len(), worst))
    }

    /// Applies loads and contact impulses to the bodies and books their work by the kick identity.
    fn kick(&mut self, bodies: &mut Bodies<S>, integrator: Integrator, step: &Step<S>, ledger: &mut Ledger) {
        self.after.clone_from(&self.free);
        self.problem.apply(&self.impulses, &mut self.after);
        let before: Vec<Twist<S>> = (0..bodies.len()).map(|i| bodies.motion.twist(i)).collect();
        for i in (0..bodies.len()).filter(|&i| bodies.is_dynamic(i)) {
            let mean = (before[i].linear + self.after[i].linear) * (0.5 * step.dt);
            let turn = (before[i].angular + self.after[i].angular) * (0.5 * step.dt);
            if integrator.kicks_with_gravity() {
                ledger.gravity += bodies.data[i].mass_properties.mass * step.gravity.dot(mean);
            }
            let w = &self.wrenches[i];
            ledger.applied += w.force.dot(mean);
            if bodies.data[i].inverse_inertia != S::Inertia::ZERO {
                ledger.applied += w.torque.dot(turn);
            }
        }
        let gravity = if integrator.kicks_with_gravity() { step.gravity } else { S::Vector::ZERO };
        self.accounts.loads(bodies, (&before, &self.after), step.dt, gravity, &self.wrenches);
        self.accounts.kick(bodies, &self.problem, &self.impulses, (&before, &self.after), |_| Cause::Contact);
        let (mut normal, mut friction) = (0.0, 0.0);
        let book = |_: usize, n: f64, t: f64| {
            normal += n;
            friction += t;
        };
        assembly::contact_work(bodies, &self.problem, &self.impulses, &before, &self.after, book, ledger);
        let held = assembly::row_work(bodies, &self.problem, &self.impulses, &before, &self.after, ledger);
        ledger.constraint += held;
        ledger.contact_normal += normal;
        ledger.friction += friction;
        assembly::write_back(bodies, &self.after);
    }

    /// Second drift. Translation's part of the integrator's line is the potential energy that was paid over the
    /// whole displacement against the work that gravity did in the kick.
    fn drift_from_kick(
        &mut self,
        bodies: &mut Bodies<S>,
        integrator: Integrator,
        step: &Step<S>,
        ledger: &mut Ledger,
    ) {
        let before = Energy::of(bodies, step.gravity);
        let marks = self.accounts.marks(bodies, step.gravity);
        integrator.after_kick(bodies, &self.start, &self.free, step.dt);
        let after = Energy::of(bodies, step.gravity);
        let kicked = if integrator.kicks_with_gravity() { ledger.gravity } else { 0.0 };
        ledger.integrator += after.total() - before.total() + kicked;
        self.accounts.moved(&marks, bodies, step.gravity, Motive::Integrator);
        if integrator.kicks_with_gravity() {
            for account in &mut self.accounts.of_bodies {
                account.energy.integrator += account.energy.gravity;
            }
        }
    }

    fn correct(
        &mut self,
        bodies: &mut Bodies<S>,
        touches: &[Touch<S>],
        settings: &Settings<S>,
        limits: &Thresholds,
        step: &Step<S>,
        ledger: &mut Ledger,
    ) {
        let slop = slop(bodies, settings, step);
        let share = settings.integrator.end_share();
        self.overlaps.clear();
        for (c, &k) in self.problem.contacts.iter().zip(&self.pressed) {
            let (start, _) = c.relative_velocity(&self.start);
            let (end, _) = c.relative_velocity(&self.after);
            let gap = touches[k].gap + step.dt * ((1.0 - share) * start + share * end);
            let leaves = end > limits.rest_speed.max(limits.still_speed);
            self.overlaps.push(Overlap { touch: touches[k], gap, leaves });
        }
        let before = Energy::of(bodies, step.gravity);
        let marks = self.accounts.marks(bodies, step.gravity);
        if self.correction.apply(bodies, &self.overlaps, settings, slop, step.dt) {
            ledger.projection += Energy::of(bodies, step.gravity).total() - before.total();
            self.accounts.moved(&marks, bodies, step.gravity, Motive::Projection);
        }
    }
}

/// Overlap that is left alone \[m\]: that of the settings, or what the slowest contacts leave that have no impact of their own.
pub(super) fn slop<S: Geometry>(bodies: &Bodies<S>, settings: &Settings<S>, step: &Step<S>) -> f64 {
    let own = || {
        1e-5 * smallest_extent(bodies).unwrap_or(0.0) + 0.5 * CALL * step.gravity.norm() * step.dt * step.dt
    };
    settings.correction_slop.unwrap_or_else(own)
}

/// What solves leave of a contact's velocity \[m/s\], where they come to the run's tolerance; sweeps end by their number, and leave
/// what they leave.
fn noise_of<S: Geometry>(settings: &Settings<S>) -> f64 {
    let comes_to_it = matches!(settings.solver_kind(), SolverKind::Exact | SolverKind::Auto);
    if comes_to_it || settings.on_inaccurate == OnInaccurate::Escalate { settings.tolerance } else { 0.0 }
}

/// The velocity that closes a gap, and the normal velocity of its contact at the start, without what solves leave of either
/// \[m/s\] (theory eq. 6.8a). That differs from contact to contact of one face; to close a gap of it, or to hold its mean at 0,
/// would ask for what no rigid body can do, a little more in each step.
fn without_noise(noise: f64, closing: f64, start: f64) -> (f64, f64) {
    if noise == 0.0 {
        return (closing, start);
    }
    let closing = if closing < -noise { closing + noise } else { -0.0 };
    let beyond = start - closing;
    (closing, closing + (beyond - noise).max(0.0) + beyond.min(0.0))
}

/// End velocity with which the step closes a gap and no more, from the normal velocity before the kick, which is that at the
/// step's `start` and what the way to the kick `turned`, and the integrator's share s: (1-s) u- + s u+ = `closing`. What the
/// contact approaches too fast at the start, because its impact was solved inexactly, is stopped and not thrown back: the
/// mean alone would not damp it.
fn held_velocity(closing: f64, start: f64, turned: f64, end_share: f64) -> f64 {
    if end_share == 0.0 {
        // the displacement is already made: hold the next one
        return closing;
    }
    (closing - (1.0 - end_share) * (start.max(closing) + turned)) / end_share
}
