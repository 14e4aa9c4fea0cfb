//! Who is alone in a step: a body with nothing near it that it could come to, or a ball that lies on one obstacle at rest
//! without friction and has nothing else near. What the general way makes of such a body depends on nobody else, so it
//! is found body by body, by the same equations in the same order, without sets, problems and rounds. Where a body does
//! not fit, or its flow does not come out at once, it goes the general way, and so does everybody who may meet it. Once a
//! heap has slid apart most of its bodies are alone.

use super::ahead::HELD;
use super::alone::{Alone, Held, Passage, Rules};
use super::arrival::Way;
use super::flow::Stick;
use super::lying::Beside;
use super::memory::faded;
use super::timeline::{Timeline, state};
use crate::bodies::Bodies;
use crate::integrate::turns_steadily;
use crate::observe::ledger::Ledger;
use crate::settings::PlasticArrivals;
use carom_geometry::{ContactPoint, Geometry};
use carom_math::{Column, Rotation};
use carom_solver::{ImpulseChoice, SolveSettings, Twist};

/// What is found on the way, and memory for it.
pub(super) struct Found<S: Geometry> {
    /// Contacts with obstacles, of all bodies that have any.
    pub held: Vec<Held<S>>,
    /// Points of the pair looked at.
    pub points: Vec<ContactPoint<S>>,
}

impl<S: Geometry> Default for Found<S> {
    fn default() -> Self {
        Found { held: Vec::new(), points: Vec::new() }
    }
}

/// The passages of all bodies, of those that are alone for good.
struct Passages<S: Geometry> {
    all: Vec<Passage<S>>,
    is_alone: Vec<bool>,
}

impl<S: Geometry> Passages<S> {
    /// Of bodies that stay as they are.
    fn of(bodies: &Bodies<S>) -> Self {
        let m = &bodies.motion;
        let all = (0..bodies.len()).map(|i| {
            let (before, half_turned) = (m.twist(i), m.rotation[i]);
            Passage { before, free: before, after: before, end: m.position[i], half_turned, held: None }
        });
        Passages { all: all.collect(), is_alone: vec![false; bodies.len()] }
    }
    /// The passage of a body that is alone.
    fn of_body(&self, i: usize) -> Option<&Passage<S>> {
        self.is_alone[i].then(|| &self.all[i])
    }
    /// Takes a body's passage away; true where it had one.
    fn take(&mut self, i: usize) -> bool {
        std::mem::replace(&mut self.is_alone[i], false)
    }
}

impl<S: Geometry> Timeline<'_, '_, S> {
    /// Takes the movable bodies that are alone through the step; gives all others.
    pub(super) fn leave_alone(&mut self) -> Vec<usize> {
        let common = self.common;
        let (settings, limits) = (common.settings, &common.limits);
        let movers: Vec<usize> = self.bodies.dynamic().collect();
        let asks = self.tools.tape.is_some() || !self.bodies.joints.is_empty();
        if asks || settings.impulses != ImpulseChoice::Any {
            self.begin_ways();
            return movers;
        }
        let at_once = settings.events.plastic_arrivals == PlasticArrivals::WithinTheStep;
        let rules = Rules {
            dt: limits.dt,
            stick: if at_once { Stick::End } else { Stick::Mean },
            solve: SolveSettings { tolerance: limits.tolerance, ..settings.solve() },
            faded: faded(limits.dt, limits),
        };
        let mut found = Found::default();
        found.held.reserve(movers.len());
        let mut passages = Passages::of(self.bodies);
        for &i in &movers {
            passages.is_alone[i] = self.pass(i, &rules, &mut passages.all[i], &mut found).is_some();
        }
        self.keep_from_meeting(&mut passages, &mut found);
        let mut others = Vec::with_capacity(movers.len());
        others.extend(movers.iter().copied().filter(|&i| !passages.is_alone[i]));
        if !others.is_empty() {
            self.begin_ways();
        }
        let mut alone = std::mem::replace(&mut self.alone, Alone::nobody(0));
        alone.reserve(movers.len() - others.len(), others.len());
        let mut pressing = Vec::with_capacity(alone.members.capacity());
        let (mut ledger, mut paid, mut fallen) = (Ledger::default(), 0.0, 0.0);
        for &i in &movers {
            let Some(passage) = passages.of_body(i) else { continue };
            let held = passage.held.map(|k| &found.held[k]);
            if common.keeps_accounts {
                self.account_alone(i, passage, held);
            }
            let weighed = self.go_alone(i, (passage, held), !others.is_empty(), &mut ledger);
            (paid, fallen) = (paid + weighed[0], fallen + weighed[1]);
            alone.add(i, passage, &rules);
            if let Some(held) = held {
                alone.hold(held);
                pressing.extend((held.impulse.normal > 0.0).then_some(held));
            }
        }
        alone.remember(&pressing, &rules, &common.warm.contacts);
        ledger.integrator = paid - fallen;
        self.ledger.add(&ledger);
        self.events.islands += alone.members.len();
        alone.tell(&rules, &mut self.log);
        self.alone = alone;
        others
    }

    /// The flow of a body that meets nobody but an obstacle that it lies on, by the passage where nothing is in its way;
    /// `None` where it may do more.
    fn pass(&self, i: usize, rules: &Rules, passage: &mut Passage<S>, found: &mut Found<S>) -> Option<()> {
        let common = self.common;
        let (bodies, limits, wrench) = (&*self.bodies, &common.limits, &common.wrenches[i]);
        let (data, m) = (&bodies.data[i], &bodies.motion);
        let before = passage.before;
        let turns = before.angular != S::Spin::ZERO;
        if wrench.torque != S::Spin::ZERO || (turns && (data.turning_arm > 0.0 || !turns_steadily(bodies, i)))
        {
            return None;
        }
        passage.free.linear += (common.settings.gravity + wrench.force * data.inverse_mass) * rules.dt;
        passage.after = passage.free;
        passage.half_turned = turned_by::<S>(&m.rotation[i], before.angular, 0.5 * rules.dt);
        let origin = m.position[i];
        for &pair in common.candidates.of_body(i) {
            let pair = common.candidates.pairs[pair];
            let other = if pair.0 == i { pair.1 } else { pair.0 };
            if bodies.is_dynamic(other) {
                continue; // looked at when all have their passages
            }
            if m.twist(other) != Twist::default() {
                return None;
            }
            let touching = limits.touching(data, &bodies.data[other]);
            let Some(beside) = Beside::of(bodies, i, pair) else { continue };
            match self.touch_of(&beside, touching, &mut found.points) {
                Some(_) if passage.held.is_some() => return None,
                Some(touch) => self.lie(&beside, touch, passage, (rules, found))?,
                None if self.may_come(pair, (passage, None), found) => return None,
                None => {}
            }
        }
        let mean = (before.linear + passage.after.linear) * 0.5;
        passage.end = origin + mean * rules.dt;
        let is_within = (passage.end - origin).norm() <= self.reaches[i] + limits.touching(data, data);
        (is_within || data.collider.is_none()).then_some(())
    }

    /// Takes the passages of bodies that may meet others away, and of all that may meet these.
    fn keep_from_meeting(&self, passages: &mut Passages<S>, found: &mut Found<S>) {
        let candidates = self.common.candidates;
        let mut met: Vec<usize> = Vec::new();
        for &(a, b) in &candidates.pairs {
            if !self.bodies.is_dynamic(a) || !self.bodies.is_dynamic(b) {
                continue;
            }
            let apart = match (passages.of_body(a), passages.of_body(b)) {
                (Some(one), Some(other)) => !self.may_come((a, b), (one, Some(other)), found),
                _ => false,
            };
            if !apart {
                met.extend([a, b].into_iter().filter(|&i| passages.take(i)));
            }
        }
        while let Some(i) = met.pop() {
            for &pair in candidates.of_body(i) {
                let (a, b) = candidates.pairs[pair];
                let other = if a == i { b } else { a };
                if passages.take(other) {
                    met.push(other);
                }
            }
        }
    }

    /// True where two bodies, the second of which may be an obstacle at rest, may come so near on their passages that the
    /// general way would have a contact of theirs.
    fn may_come(
        &self,
        pair: (usize, usize),
        (one, other): (&Passage<S>, Option<&Passage<S>>),
        found: &mut Found<S>,
    ) -> bool {
        let (limits, data) = (&self.common.limits, &self.bodies.data);
        let apart = |of: fn(&Passage<S>) -> &Twist<S>| {
            let still = other.map_or(S::Vector::ZERO, |other| of(other).linear);
            (of(one).linear - still).norm()
        };
        let fastest = apart(|p| &p.before).max(apart(|p| &p.free)).max(apart(|p| &p.after));
        let held = HELD * self.common.settings.gravity.norm() * limits.dt * limits.dt;
        let margin = fastest * limits.dt + held + limits.touching(&data[pair.0], &data[pair.1]);
        found.points.clear();
        self.bodies.contact_points(pair, margin, &mut found.points);
        !found.points.is_empty()
    }

    /// Takes over a body's passage and books it; gives the work of gravity on the way that the velocities lead, and on
    /// that which the body came.
    fn go_alone(
        &mut self,
        i: usize,
        (passage, held): (&Passage<S>, Option<&Held<S>>),
        is_seen: bool,
        ledger: &mut Ledger,
    ) -> [f64; 2] {
        let Passage { before, after, end, half_turned, .. } = passage;
        let (gravity, dt) = (self.common.settings.gravity, self.common.limits.dt);
        let mass = self.bodies.data[i].mass_properties.mass;
        let went = (before.linear + after.linear) * (0.5 * dt);
        ledger.gravity += mass * gravity.dot(went);
        ledger.applied += self.common.wrenches[i].force.dot(went);
        if let Some(held) = held.filter(|held| held.impulse.normal != 0.0) {
            ledger.contact_normal += 0.5 * held.impulse.normal * held.closing;
        }
        let begun = state(&self.bodies.motion, i);
        self.bodies.motion.position[i] = *end;
        self.bodies.motion.rotation[i] = turned_by::<S>(half_turned, after.angular, 0.5 * dt);
        self.bodies.motion.set_twist(i, after);
        if is_seen {
            let ended = state(&self.bodies.motion, i);
            let arm = self.bodies.data[i].turning_arm;
            self.ways[i] = Way::between(0.0, dt, &begun, &ended, arm);
        }
        let mean = (before.linear + after.linear) * 0.5;
        [mass * gravity.dot(mean * dt), mass * gravity.dot(*end - begun.position)]
    }
}

/// An orientation after a time \[s\] at a steady angular velocity.
pub(super) fn turned_by<S: Geometry>(rotation: &S::Rotation, spin: S::Spin, time: f64) -> S::Rotation {
    if spin == S::Spin::ZERO { *rotation } else { rotation.then(&S::Rotation::about(spin * time)) }
}
