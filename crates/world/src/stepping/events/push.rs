//! Impulses that end approaches before bodies touch: no gap closes by more than it is. What takes the rest of a step at
//! once is made of two of them, what slows plastic arrivals of one; joints take part.

use super::together::{Halt, Together, Tools};
use crate::assembly;
use crate::narrow_phase::Touch;
use crate::observe::accounts::Cause;
use crate::observe::event_log::{Acted, EventKind, PieceKind};
use crate::observe::ledger::Ledger;
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

impl<S: Geometry> Together<'_, S> {
    /// The velocities after an impulse, found only as well as is needed to see who comes in. `forces` are those of a
    /// push with fewer contacts, and then its own.
    pub fn try_push(
        &mut self,
        push: &Push<S>,
        forces: &mut WarmStart<S>,
        tools: &mut Tools<S>,
    ) -> Result<Vec<Twist<S>>, Halt> {
        let problem = self.problem_of(push);
        let mut impulses = Impulses::zero(&problem);
        forces.load(&problem, 1.0, &mut impulses);
        let worst = self.worst[0].clone();
        let tolerance = TRIED * self.settings.gravity.norm() * self.limits.dt;
        self.solve_to(tolerance.max(self.limits.tolerance), &problem, &mut impulses, tools)?;
        self.worst[0] = worst;
        forces.store(&problem, &impulses, 1.0);
        let mut after = push.velocities.to_vec();
        problem.apply(&impulses, &mut after);
        Ok(after)
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

    /// Solves for the impulse, from the forces of one much like it, applies it to `free`, and books and logs what it
    /// does.
    pub fn push(
        &mut self,
        push: &Push<S>,
        free: Vec<Twist<S>>,
        forces: &WarmStart<S>,
        tools: &mut Tools<S>,
    ) -> Result<(), Halt> {
        let Push { touches, time, cause, .. } = *push;
        let before = self.twists();
        let problem = self.problem_of(push);
        let mut impulses = Impulses::zero(&problem);
        forces.load(&problem, 1.0, &mut impulses);
        if !touches.is_empty() || !problem.rows.is_empty() {
            self.solve(&problem, &mut impulses, tools)?;
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
