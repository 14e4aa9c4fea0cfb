//! A flow: the motion between two events, contacts acting all the while (theory section 8.2). With bars for means,
//!   0 <= p _|_ n.ubar >= 0, friction against ubar_t, ubar = (u- + u+)/2, at xbar = (x0 + x1)/2,
//! so that persistent normal contact does no work and friction takes exactly mu p |ubar_t|. The problem handed to the
//! solver has the velocities v- + v+ without impulses, twice the mean: its end velocities are u- + u+. Places and
//! velocities depend on each other over xbar; rounds of both settle at once on flat ground.

use super::contacts::Active;
use super::joints::{self, Held};
use super::limits::Limits;
use super::together::{Halt, LastFlow, Together, Tools};
use crate::assembly;
use crate::integrate::turn_freely;
use crate::narrow_phase::{Touch, normal_velocity};
use crate::observe::accounts::{Cause, Mark, Motive};
use carom_geometry::Geometry;
use carom_math::{Column, Inertia};
use carom_solver::{ContactProblem, Impulses, Twist};

/// Most rounds between places and velocities.
const ROUNDS: usize = 12;
/// Change of a unit normal below which the round is the last \[1\].
const SAME_NORMAL: f64 = 3e-15;
/// Change of a contact's arms below which the round is the last, over the body's size \[1\].
const SAME_ARM: f64 = 1e-13;
/// Cosine below which a contact of the same name counts as another one \[1\].
const ONE_SIDE: f64 = 0.7;

/// Part of a contact's normal velocity that its way may make where it flips \[1\].
const FLIP: f64 = 0.1;

/// True for a contact that comes in with a normal velocity which the mean-velocity law throws back, as it would for
/// ever: it holds no state of rest or rolling, and the next impact is to stop it. Given are the normal velocity where
/// the flow begins and half-way; on curved ways nearly all of the second is made by the way, and the contact stays.
fn flips(at_start: f64, at_mean: f64, limits: &Limits) -> bool {
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
    /// Moves the set by a time \[s\] with these contacts acting.
    pub fn flow(
        &mut self,
        time: f64,
        active: &Active<S>,
        stick: Stick,
        tools: &mut Tools<S>,
    ) -> Result<(), Halt> {
        let start = self.bodies.motion.clone();
        let Active { touches: active, closing, fresh, .. } = active;
        let approaches: Vec<f64> = active.iter().map(|t| normal_velocity(&self.bodies, t)).collect();
        self.turn(0.5 * time);
        let before = self.twists();
        let free = self.loaded(&before, time);
        let mut after = free.clone();
        for t in active {
            // a first guess of where contacts hold: bodies keep the velocities they have
            (after[t.a], after[t.b]) = (before[t.a], before[t.b]);
        }
        for j in &self.bodies.joints.all {
            after[j.a] = before[j.a];
            j.b.inspect(|&b| after[b] = before[b]);
        }
        let mut last = LastFlow { time, stick, ..std::mem::take(&mut self.last) };
        last.problem.contacts.clear();
        last.closing.clone_from(closing);
        let mut touches: Vec<Touch<S>> = Vec::new();
        let mut targets: Vec<f64> = closing.iter().map(|c| -2.0 * c).collect();
        let corners = closing.iter().any(|c| *c > 0.0) && self.turns_on_corners(active);
        let mut kept = true;
        let jointed = !self.bodies.joints.is_empty();
        let mut held = Held::new(&self.bodies.joints);
        let judged = self.worst[0].clone();
        for round in 0..if jointed { joints::ROUNDS } else { ROUNDS } {
            for i in 0..self.bodies.len() {
                let mean = (before[i].linear + after[i].linear) * 0.5;
                self.bodies.motion.position[i] = start.position[i] + mean * (0.5 * time);
            }
            let at_mean = self.at_mean(active, &start.position);
            let joints_settled = !jointed || self.joints_settled(&mut held);
            if round > 0 && kept && joints_settled && self.settled(&touches, &at_mean, &last.problem) {
                touches = at_mean; // the same arms, at the places that came out
                break;
            }
            touches = at_mean;
            self.assemble(&touches, &targets, &before, &free, stick, &mut last.problem);
            if jointed {
                self.hold(&held, &before, stick, &mut last.problem);
                // only the last round's solve is the flow's
                self.worst[0].clone_from(&judged);
            }
            last.impulses.fit(&last.problem);
            if round == 0 && self.settings.events.warm_start {
                last.impulses.reset(&last.problem);
                self.forces.as_ref().unwrap_or(self.warm).load(&last.problem, time, &mut last.impulses);
            }
            if !touches.is_empty() || jointed {
                let mut impulses = std::mem::take(&mut last.impulses);
                self.solve(&last.problem, &mut impulses, tools)?;
                last.impulses = impulses;
            }
            after.clone_from(&free);
            last.problem.apply(&last.impulses, &mut after);
            if jointed {
                self.aim(&mut held, &start.position, (&before, &after), time);
            } else if active.is_empty() {
                break;
            }
            if corners {
                let mean = self.bodies.motion.clone();
                self.bring_to_end(&start.position, &before, &after, time);
                let gaps = self.gaps_of(active);
                self.bodies.motion.copy_from(&mean);
                kept = self.keep_gaps(
                    &last.problem,
                    (&before, &after),
                    (active, closing, &gaps),
                    time,
                    &mut targets,
                );
            }
        }
        if jointed {
            self.check_held(&held, self.joint_names)?;
            self.keep_joints(&last.problem, &last.impulses);
        }
        last.touches = touches;
        self.book(&last.problem, &last.impulses, &before, &after, time);
        self.finish(&start.position, &before, &after, time);
        let mut new = fresh.clone();
        for (c, u) in last.problem.contacts.iter().zip(approaches) {
            if flips(u, c.relative_velocity(&before).0, self.limits) {
                new.push(c.id);
            }
        }
        self.remember(last, &new);
        Ok(())
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

    /// The active contacts where the bodies are now, found again by name; those that are gone are carried along.
    fn at_mean(&mut self, active: &[Touch<S>], origin: &[S::Vector]) -> Vec<Touch<S>> {
        let mut found = Vec::with_capacity(active.len());
        let mut near: Vec<Touch<S>> = Vec::new();
        let mut first = 0;
        while first < active.len() {
            let pair = (active[first].a, active[first].b);
            let count = active[first..].iter().take_while(|t| (t.a, t.b) == pair).count();
            near.clear();
            let near_by = self.limits.touching(&self.bodies.data[pair.0], &self.bodies.data[pair.1]);
            let margin = 4.0 * near_by + self.reaches[pair.0] + self.reaches[pair.1];
            self.find(pair, margin, &mut near);
            for t in &active[first..first + count] {
                let again = near.iter().find(|n| n.id == t.id && n.normal.dot(t.normal) > ONE_SIDE);
                found.push(match again {
                    Some(n) => Touch { gap: t.gap, ..*n },
                    None => Touch { point: t.point + self.carried(t, origin), ..*t },
                });
            }
            first += count;
        }
        found
    }

    /// How a contact point has moved with its bodies.
    fn carried(&self, t: &Touch<S>, origin: &[S::Vector]) -> S::Vector {
        let moved = |i: usize| self.bodies.motion.position[i] - origin[i];
        match (self.bodies.is_dynamic(t.a), self.bodies.is_dynamic(t.b)) {
            (true, true) => (moved(t.a) + moved(t.b)) * 0.5,
            (true, false) => moved(t.a),
            (false, _) => moved(t.b),
        }
    }

    /// True when the contacts' frames and arms are those that the problem was solved with.
    fn settled(&self, old: &[Touch<S>], new: &[Touch<S>], problem: &ContactProblem<S>) -> bool {
        old.iter().zip(new).zip(&problem.contacts).all(|((o, n), c)| {
            let size = self.bodies.data[n.a].extent.min(self.bodies.data[n.b].extent);
            let arm = |i: usize, was: S::Vector| {
                let fixed = !self.bodies.is_dynamic(i);
                fixed || (n.point - self.bodies.motion.position[i] - was).norm() <= SAME_ARM * size
            };
            (o.normal - n.normal).norm() <= SAME_NORMAL && arm(n.a, c.arm_a) && arm(n.b, c.arm_b)
        })
    }

    fn assemble(
        &self,
        touches: &[Touch<S>],
        targets: &[f64],
        before: &[Twist<S>],
        free: &[Twist<S>],
        stick: Stick,
        problem: &mut ContactProblem<S>,
    ) {
        assembly::begin(problem, &self.bodies, self.settings.friction_law);
        problem.velocities.clear();
        problem.velocities.extend_from_slice(free);
        if stick == Stick::Mean {
            for (v, b) in problem.velocities.iter_mut().zip(before) {
                v.add_scaled(b, 1.0);
            }
        }
        for (t, target) in touches.iter().zip(targets) {
            let mut contact = assembly::contact(&self.bodies, t, *target);
            if stick == Stick::End {
                contact.target -= contact.relative_velocity(before).0;
            }
            problem.contacts.push(contact);
            assembly::resist(problem, t);
        }
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
        let mass = self.bodies.data[i].mass_properties.mass;
        let went = self.bodies.motion.position[i] - origin;
        let account = &mut self.accounts.of_bodies[i];
        account.energy.integrator += mass * self.settings.gravity.dot(way - went);
        let (mean, change) = ((before.linear + after.linear) * 0.5, after.linear - before.linear);
        let off = origin + went * 0.5 - kicked;
        account.angular_momentum.integrator += S::moment(went, mean * mass) + S::moment(off, change * mass);
    }

    /// Keeps the flow's forces and who pressed.
    fn remember(&mut self, last: LastFlow<S>, fresh: &[u64]) {
        let mut forces = self.forces.take().unwrap_or_default();
        forces.store(&last.problem, &last.impulses, last.time);
        self.pressed = Some(forces.forces.iter().map(|f| f.0).filter(|id| !fresh.contains(id)).collect());
        self.forces = Some(forces);
        self.last = last;
    }
}
