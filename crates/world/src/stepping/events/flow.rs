//! A flow: the motion between two events, contacts acting all the while (theory section 8.2). With bars for means,
//!   0 <= p _|_ n.ubar >= 0, friction against ubar_t, ubar = (u- + u+)/2, at xbar = (x0 + x1)/2,
//! so that persistent normal contact does no work and friction takes exactly mu p |ubar_t|. The problem handed to the
//! solver has the velocities v- + v+ without impulses, twice the mean: its end velocities are u- + u+. Places and
//! velocities depend on each other over xbar; rounds of both settle at once on flat ground.

use super::contacts::Active;
use super::limits::Limits;
use super::memory::Memory;
use super::rounds::Rounds;
use super::timeline::Island;
use super::together::{Halt, LastFlow, Together, Tools};
use crate::assembly;
use crate::integrate::turn_freely;
use crate::observe::accounts::{Cause, Drift, Mark, Motive};
use crate::observe::report::SolveReport;
use carom_geometry::Geometry;
use carom_math::{Column, Inertia};
use carom_solver::{ContactProblem, Impulses, Twist};

/// Part of a contact's normal velocity that its way may make where it flips \[1\].
const FLIP: f64 = 0.1;

/// True for a contact that comes in with a normal velocity which the mean-velocity law throws back, as it would for
/// ever: it holds no state of rest or rolling, and the next impact is to stop it. Given are the normal velocity where
/// the flow begins and half-way; on curved ways nearly all of the second is made by the way, and the contact stays.
pub(super) fn flips(at_start: f64, at_mean: f64, limits: &Limits) -> bool {
    at_start.abs() > limits.still_speed && (at_mean - at_start).abs() <= FLIP * at_start.abs()
}

/// How friction holds in a flow.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stick {
    /// Against the mean slip: exact for contacts that slip or roll all the way.
    Mean,
    /// Against the slip at the end: ends slipping within the flow without finding the moment.
    End,
}

impl<S: Geometry> Together<'_, S> {
    /// Moves the set by a time \[s\] with these contacts acting; false where that is too long for places to come out.
    pub fn flow(
        &mut self,
        time: f64,
        active: &Active<S>,
        stick: Stick,
        tools: &mut Tools<S>,
    ) -> Result<bool, Halt> {
        let mut rounds = self.begin_rounds(time, active.clone(), stick);
        self.take_rounds(&mut rounds, tools)?;
        let is_loose = rounds.is_loose;
        self.end_rounds(rounds).map(|_| !is_loose)
    }

    /// Moves the set as the flow of a larger one, without joints, has moved it: by the same impulses at the same places,
    /// booked for these bodies; gives back its contacts.
    pub fn repeat(&mut self, time: f64, whole: &Island<S>) -> Active<S> {
        let active = whole.active.of(&whole.members, &self.members);
        let mut rounds = self.begin_rounds(time, active, whole.stick);
        self.take_over(&mut rounds, &whole.members, &whole.last);
        self.close_rounds(rounds)
    }

    /// Brings the set to the flow's end, books and remembers it; gives back its contacts.
    pub fn end_rounds(&mut self, mut rounds: Rounds<S>) -> Result<Active<S>, Halt> {
        if let Some(report) = rounds.clusters.report(rounds.touches.len()) {
            let worst = report.worst.map(|(a, b)| (self.members[a], self.members[b]));
            self.keep(0, SolveReport { worst, ..report }, "contact")?;
        }
        if rounds.jointed {
            self.check_held(&rounds.held, self.joint_names)?;
            self.keep_joints(&rounds.last.problem, &rounds.last.impulses);
        }
        Ok(self.close_rounds(rounds))
    }

    /// The same once all is looked at that may end the step.
    fn close_rounds(&mut self, rounds: Rounds<S>) -> Active<S> {
        let memory = self.recall(&rounds);
        let Rounds { time, active, start, approaches, before, after, touches, mut last, .. } = rounds;
        last.touches = touches;
        self.book(&last.problem, &last.impulses, &before, &after, time);
        self.finish(&start.position, &before, &after, time);
        self.moved += time;
        let mut new = active.fresh.clone();
        for (c, u) in last.problem.contacts.iter().zip(approaches) {
            // where a body turns back on a curved way nothing turns, for a moment
            if flips(u, c.normal_velocity(&before), self.limits) && u.abs() > self.turned(c.id) {
                new.push(c.id);
            }
        }
        self.remember(last, &new, memory);
        active
    }

    /// Free rotation of all bodies; what it does to the energy is the integrator's line.
    pub fn turn(&mut self, time: f64) {
        for i in 0..self.bodies.len() {
            if self.bodies.motion.angular_velocity[i] == S::Spin::ZERO {
                continue;
            }
            let energy = self.bodies.rotational_energy(i);
            let kept = self.accounts.are_kept() && self.bodies.is_dynamic(i);
            let mark = kept.then(|| Mark::of(&self.bodies, i, self.settings.gravity));
            turn_freely(self.settings.integrator, &mut self.bodies, i, time);
            if self.bodies.is_dynamic(i) {
                self.ledger.integrator += self.bodies.rotational_energy(i) - energy;
            }
            if let Some(mark) = mark {
                let now = Mark::of(&self.bodies, i, self.settings.gravity);
                self.accounts.change(i, &mark, &now, Motive::Integrator);
            }
        }
    }

    /// Velocities after gravity and loads of a time, without contacts.
    pub fn loaded(&self, before: &[Twist<S>], time: f64) -> Vec<Twist<S>> {
        let mut free = before.to_vec();
        for i in (0..free.len()).filter(|&i| self.bodies.is_dynamic(i)) {
            let inverse = self.bodies.inverse_mass(i);
            let w = &self.wrenches[i];
            free[i].linear += (self.settings.gravity + w.force * inverse.linear) * time;
            if w.torque != S::Spin::ZERO {
                free[i].angular += inverse.angular.apply(w.torque) * time;
            }
        }
        free
    }

    /// Works of gravity, loads and contacts by the kick identity.
    fn book(
        &mut self,
        problem: &ContactProblem<S>,
        impulses: &Impulses<S>,
        before: &[Twist<S>],
        after: &[Twist<S>],
        time: f64,
    ) {
        self.book_loads(before, after, time);
        let (mut normal, mut friction) = (0.0, 0.0);
        let both = |_: usize, n: f64, t: f64| {
            normal += n;
            friction += t;
        };
        assembly::contact_work(&self.bodies, problem, impulses, before, after, both, &mut self.ledger);
        let mut driven = crate::observe::ledger::Ledger::default();
        let held = assembly::row_work(&self.bodies, problem, impulses, before, after, &mut driven);
        self.ledger.constraint += held;
        self.ledger.driven += driven.driven;
        self.ledger.contact_normal += normal;
        self.ledger.friction += friction;
        self.accounts.kick(&self.bodies, problem, impulses, (before, after), |_| Cause::Contact);
    }

    /// Works of gravity and loads over a time, by the mean of two sets of velocities.
    pub fn book_loads(&mut self, before: &[Twist<S>], after: &[Twist<S>], time: f64) {
        let (gravity, wrenches) = (self.settings.gravity, &self.wrenches);
        self.accounts.loads(&self.bodies, (before, after), time, gravity, wrenches);
        let ledger = &mut self.ledger;
        for i in (0..self.bodies.len()).filter(|&i| self.bodies.is_dynamic(i)) {
            let d = &self.bodies.data[i];
            let way = (before[i].linear + after[i].linear) * (0.5 * time);
            ledger.gravity += d.mass_properties.mass * self.settings.gravity.dot(way);
            ledger.applied += self.wrenches[i].force.dot(way);
            if d.inverse_inertia != S::Inertia::ZERO {
                let turn = (before[i].angular + after[i].angular) * (0.5 * time);
                ledger.applied += self.wrenches[i].torque.dot(turn);
            }
        }
    }

    /// Places and velocities at the end.
    fn finish(&mut self, origin: &[S::Vector], before: &[Twist<S>], after: &[Twist<S>], time: f64) {
        let potential = |s: &Self| -> f64 {
            let heights = (0..s.bodies.len()).filter(|&i| s.bodies.is_dynamic(i));
            heights
                .map(|i| {
                    let way = s.bodies.motion.position[i] - origin[i];
                    s.bodies.data[i].mass_properties.mass * s.settings.gravity.dot(way)
                })
                .sum()
        };
        let mut paid = 0.0;
        for i in 0..self.bodies.len() {
            let mean = (before[i].linear + after[i].linear) * 0.5;
            self.drift(i, origin[i], mean * time, (&before[i], &after[i]));
            if self.bodies.is_dynamic(i) {
                self.bodies.motion.set_twist(i, &after[i]);
                paid += self.bodies.data[i].mass_properties.mass * self.settings.gravity.dot(mean * time);
            }
        }
        self.ledger.integrator += paid - potential(self);
        self.turn(0.5 * time);
    }

    /// Puts a body to where a way \[m\] leads from its place at the start; it was where its kick acted. What the way
    /// does to the potential energy and to the moment of momentum beyond the work and the moment of the kick, which
    /// acted half-way to rounding, is the integrator's.
    pub fn drift(
        &mut self,
        i: usize,
        origin: S::Vector,
        way: S::Vector,
        (before, after): (&Twist<S>, &Twist<S>),
    ) {
        let kicked = std::mem::replace(&mut self.bodies.motion.position[i], origin + way);
        if !self.accounts.are_kept() || !self.bodies.is_dynamic(i) {
            return;
        }
        let place = self.bodies.motion.position[i];
        let drift = Drift { origin, way, kicked, place, before, after };
        let (data, gravity) = (&self.bodies.data[i], self.settings.gravity);
        self.accounts.drift(i, data.mass_properties.mass, gravity, &drift);
    }

    /// Keeps the flow's forces, and what it tells of its contacts.
    fn remember(&mut self, last: LastFlow<S>, fresh: &[u64], memory: Memory) {
        let mut forces = self.forces.take().unwrap_or_default();
        forces.store(&last.problem, &last.impulses, last.time);
        let pressed = forces.forces.iter().map(|f| f.0).filter(|id| !fresh.contains(id)).collect();
        self.memory = Some(Memory { pressed, ..memory });
        self.forces = Some(forces);
        self.last = last;
    }
}
