//! Impulses that end approaches before bodies touch: no gap closes by more than it is. What takes the rest of a step at
//! once is made of two of them, what slows plastic arrivals of one; joints take part.

use super::together::{Halt, Together, Tools};
use crate::assembly;
use crate::narrow_phase::Touch;
use crate::observe::accounts::Cause;
use crate::observe::event_log::{Acted, EventKind, PieceKind};
use crate::observe::ledger::Ledger;
use crate::observe::report::SolveReport;
use crate::warm_start::WarmStart;
use carom_geometry::Geometry;
use carom_math::Column;
use carom_solver::{ContactProblem, Impulses, Twist};

/// Residual of an impulse that is only tried, over |g| dt \[1\].
const TRIED: f64 = 1e-3;

/// What is asked of an impulse.
pub struct Push<'a, S: Geometry> {
    /// The contacts.
    pub touches: &'a [Touch<S>],
    /// Normal velocity that each ends with at least \[m/s\].
    pub targets: &'a [f64],
    /// Velocities without it, or sums of two.
    pub velocities: &'a [Twist<S>],
    /// How long it acts with the loads \[s\]; 0 for no time.
    pub time: f64,
    /// Which line has its work: `Fallback`, or `Impact`.
    pub cause: Cause,
}

/// An impulse that was found only as well as is needed to see who comes in.
pub struct Tried<S: Geometry> {
    problem: ContactProblem<S>,
    impulses: Impulses<S>,
    report: SolveReport,
}

impl<S: Geometry> Tried<S> {
    /// The velocities after it, from those without it.
    pub fn after(&self, velocities: &[Twist<S>]) -> Vec<Twist<S>> {
        let mut after = velocities.to_vec();
        self.problem.apply(&self.impulses, &mut after);
        after
    }
}

impl<S: Geometry> Together<'_, S> {
    /// Tries an impulse, from one that was tried for fewer contacts.
    pub fn try_push(
        &mut self,
        push: &Push<S>,
        before: Option<&Tried<S>>,
        tools: &mut Tools<S>,
    ) -> Result<Tried<S>, Halt> {
        let problem = self.problem_of(push);
        let mut impulses = Impulses::zero(&problem);
        if let Some(Tried { problem: fewer, impulses: known, .. }) = before {
            let mut forces = WarmStart::default();
            forces.store(fewer, known, 1.0);
            forces.load(&problem, 1.0, &mut impulses);
        }
        let tolerance = TRIED * self.settings.gravity.norm() * self.limits.dt;
        let report = self.work_to(tolerance.max(self.limits.tolerance), &problem, &mut impulses, tools);
        let report = self.unless_refused(report, "contact")?;
        Ok(Tried { problem, impulses, report })
    }

    fn problem_of(&self, push: &Push<S>) -> ContactProblem<S> {
        let mut problem = ContactProblem::new(Vec::new(), Vec::new());
        assembly::begin(&mut problem, &self.bodies, self.settings.friction_law);
        problem.velocities = push.velocities.to_vec();
        problem.contacts.reserve(push.touches.len());
        for (t, target) in push.touches.iter().zip(push.targets) {
            problem.contacts.push(assembly::contact(&self.bodies, t, *target));
            assembly::resist(&mut problem, t);
        }
        // sums of velocities, or the velocities after the plastic impulse: joints ask for none; the next projection
        // takes away by what the way then misses them
        self.bodies.push_joints(&self.bodies.joint_frames(), &[], &mut problem);
        problem
    }

    /// Solves for the impulse, unless it was tried and came out as well as is asked, applies it to `free`, and books and
    /// logs what it does.
    pub fn push(
        &mut self,
        push: &Push<S>,
        free: Vec<Twist<S>>,
        tried: Option<Tried<S>>,
        tools: &mut Tools<S>,
    ) -> Result<(), Halt> {
        let Push { touches, time, cause, .. } = *push;
        let before = self.twists();
        let (problem, mut impulses, found) = match tried {
            Some(Tried { problem, impulses, report }) => (problem, impulses, Some(report)),
            None => {
                let problem = self.problem_of(push);
                let impulses = Impulses::zero(&problem);
                (problem, impulses, None)
            }
        };
        match found.filter(|report| report.residual <= self.limits.tolerance) {
            Some(report) => self.keep(0, report, "contact")?,
            None if touches.is_empty() && problem.rows.is_empty() => {}
            None => self.solve(&problem, &mut impulses, tools)?,
        }
        let (kind, piece) = match cause {
            Cause::Fallback if time > 0.0 => (EventKind::FallbackFlow, PieceKind::Fallback),
            Cause::Fallback => (EventKind::FallbackImpact, PieceKind::Impact),
            _ => (EventKind::Slowed, PieceKind::Impact),
        };
        let acted =
            Acted { time: self.moment, length: time, touches, problem: &problem, impulses: &impulses };
        self.log.add(&acted, |_| kind, |i| i);
        let movers: Vec<usize> = self.movers().collect();
        self.log.end_act(piece, self.moment, time, movers.into_iter());
        self.log.add_rows(&problem, &impulses, |i| i);
        let mut after = free;
        problem.apply(&impulses, &mut after);
        self.book_push((&problem, &impulses), (&before, &after), cause);
        self.keep_joints(&problem, &impulses);
        self.book_loads(&before, &after, time);
        assembly::write_back(&mut self.bodies, &after);
        Ok(())
    }

    fn book_push(
        &mut self,
        (problem, impulses): (&ContactProblem<S>, &Impulses<S>),
        (before, after): (&[Twist<S>], &[Twist<S>]),
        cause: Cause,
    ) {
        let (mut normal, mut friction) = (0.0, 0.0);
        let both = |_: usize, n: f64, t: f64| {
            normal += n;
            friction += t;
        };
        let mut driven = Ledger::default();
        assembly::contact_work(&self.bodies, problem, impulses, before, after, both, &mut driven);
        self.accounts.kick(&self.bodies, problem, impulses, (before, after), |_| cause);
        let held = assembly::row_work(&self.bodies, problem, impulses, before, after, &mut driven);
        self.ledger.constraint += held;
        self.ledger.driven += driven.driven;
        if cause == Cause::Fallback {
            self.ledger.fallback += normal + friction;
        } else {
            self.ledger.impact_normal += normal;
            self.ledger.impact_friction += friction;
        }
    }
}
