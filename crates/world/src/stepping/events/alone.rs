//! What bodies did that went through a step alone (`leaving.rs` says who they are): their contacts, forces and reports in
//! one list each, ready for the world's.

use super::flow::Stick;
use super::memory::Memory;
use super::together::LastFlow;
use crate::narrow_phase::Touch;
use crate::observe::event_log::{Acted, EventKind, EventLog, PieceKind};
use crate::observe::report::SolveReport;
use crate::warm_start::{WarmStart, hand_over};
use carom_geometry::Geometry;
use carom_solver::{AtOnce, Contact, ContactProblem, Impulse, Impulses, SolveSettings, Stop, Twist};

/// Contacts that a body of a heap has for its own, about: room for them.
const CONTACTS: usize = 4;

/// What the bodies that are alone did in a step.
pub struct Alone<S: Geometry> {
    /// Their indices in the world, ascending.
    pub members: Vec<usize>,
    /// Whether a body is among them, by its index.
    is_member: Vec<bool>,
    /// Velocities that each would have without impulses, as a flow's problem has them.
    velocities: Vec<Twist<S>>,
    /// Their contacts, as a flow leaves them; bodies by their indices in the world.
    last: LastFlow<S>,
    /// Forces of the contacts, and what they tell the next step.
    told: (WarmStart<S>, Memory),
    /// How the contacts were solved; nothing where there are none.
    pub report: Option<SolveReport>,
    /// Room for reports of islands.
    reports: usize,
}

/// What does not change from body to body.
pub(super) struct Rules {
    /// Length of the flow: the step's \[s\].
    pub dt: f64,
    /// How friction would hold.
    pub stick: Stick,
    /// How contacts are solved.
    pub solve: SolveSettings,
    /// What is left of what turning left when the flow is over \[1\].
    pub faded: f64,
}

/// A body's flow.
#[derive(Clone, Copy)]
pub(super) struct Passage<S: Geometry> {
    /// Velocities at its start.
    pub before: Twist<S>,
    /// Those at its end if nothing is in the way.
    pub free: Twist<S>,
    /// Those at its end.
    pub after: Twist<S>,
    /// Place at its end.
    pub end: S::Vector,
    /// Orientation half-way.
    pub half_turned: S::Rotation,
    /// The number of its contact with what it lies on.
    pub held: Option<usize>,
}

/// The contact of a ball with its obstacle through a flow.
pub(super) struct Held<S: Geometry> {
    /// The ball.
    pub body: usize,
    /// Half-way, with the gap at the start.
    pub touch: Touch<S>,
    /// As the problem had it.
    pub contact: Contact<S>,
    /// Its impulse.
    pub impulse: Impulse<S>,
    /// How it was solved, where it presses.
    pub report: Option<AtOnce>,
    /// Its place among those that pressed in the step before.
    pub pressed_as: Option<usize>,
    /// It does not count as pressed afterwards.
    pub is_new: bool,
    /// Sum of the normal velocities at the flow's start and end \[m/s\].
    pub closing: f64,
    /// Velocity that turning half-way to the end leaves \[m/s\].
    pub turned: f64,
}

impl Rules {
    /// Velocities that a flow's problem has without impulses: with friction against the mean slip sums of start and end.
    pub fn summed<S: Geometry>(&self, passage: &Passage<S>) -> Twist<S> {
        let mut sum = passage.free;
        if self.stick == Stick::Mean {
            sum.add_scaled(&passage.before, 1.0);
        }
        sum
    }
}

impl<S: Geometry> Alone<S> {
    /// Nobody of so many bodies.
    pub fn nobody(bodies: usize) -> Self {
        Alone {
            members: Vec::new(),
            is_member: vec![false; bodies],
            velocities: Vec::new(),
            last: LastFlow::default(),
            told: Default::default(),
            report: None,
            reports: 0,
        }
    }
    /// Makes room for so many members, and for the contacts and reports of others behind theirs.
    pub(super) fn reserve(&mut self, members: usize, others: usize) {
        let contacts = members + CONTACTS * others;
        self.members.reserve(members);
        self.reports = members + others;
        self.velocities.reserve(members);
        self.last.touches.reserve(contacts);
        self.last.problem.contacts.reserve(contacts);
        self.last.impulses.contacts.reserve(contacts);
        let (forces, memory) = &mut self.told;
        forces.forces.reserve(contacts);
        memory.turned.reserve(contacts);
        memory.pressed.reserve(contacts);
    }

    /// True for a body that is alone.
    pub fn has(&self, body: usize) -> bool {
        self.is_member[body]
    }

    /// Adds the contacts to the world's problem, and what they tell to the next step's start.
    pub fn give(
        self,
        problem: &mut ContactProblem<S>,
        impulses: &mut Impulses<S>,
        touches: &mut Vec<Touch<S>>,
        warm: &mut WarmStart<S>,
    ) {
        for (&i, v) in self.members.iter().zip(&self.velocities) {
            problem.velocities[i] = *v;
        }
        let LastFlow { problem: mine, impulses: given, touches: found, .. } = self.last;
        hand_over(&mut problem.contacts, mine.contacts);
        hand_over(&mut impulses.contacts, given.contacts);
        hand_over(touches, found);
        let (forces, memory) = self.told;
        warm.take_over(forces, memory);
    }

    /// Tells a log of the flow: bodies that go through the whole step in one are not listed.
    pub(super) fn tell(&self, rules: &Rules, log: &mut EventLog<S>) {
        if self.members.is_empty() {
            return;
        }
        let LastFlow { touches, problem, impulses, .. } = &self.last;
        let acted = Acted { time: 0.0, length: rules.dt, touches, problem, impulses };
        let kind = if rules.stick == Stick::Mean { EventKind::Flow } else { EventKind::FlowToEnd };
        log.add(&acted, |_| kind, |i| i);
        log.end_act(PieceKind::Flow, 0.0, rules.dt, std::iter::empty());
    }

    /// Takes in a body.
    pub(super) fn add(&mut self, i: usize, passage: &Passage<S>, rules: &Rules) {
        self.members.push(i);
        self.is_member[i] = true;
        self.velocities.push(rules.summed(passage));
    }

    /// Takes in what contacts tell the next step, which asks for them by their names: in that order. `known` is what the step
    /// before told.
    pub(super) fn remember(&mut self, all: &[&Held<S>], rules: &Rules, known: &Memory) {
        let names = in_order(all, known.pressed.len());
        let (forces, memory) = &mut self.told;
        let mut turned_before = known.turned.iter().copied().peekable();
        for (id, k) in names {
            let held = all[k];
            forces.add(&held.contact, &held.impulse, rules.dt);
            while turned_before.next_if(|t| t.0 < id).is_some() {}
            let left = turned_before.peek().filter(|t| t.0 == id).map_or(0.0, |t| t.1);
            let turned = held.turned.max(rules.faded * left);
            if turned > 0.0 {
                memory.turned.push((id, turned));
            }
            if !held.is_new {
                memory.pressed.push(id);
            }
        }
    }

    /// Takes in its contact.
    pub(super) fn hold(&mut self, held: &Held<S>) {
        self.count(held);
        self.last.touches.push(held.touch);
        self.last.problem.contacts.push(held.contact);
        self.last.impulses.contacts.push(held.impulse);
    }

    /// Takes in how a contact was solved, as the report of all has it.
    fn count(&mut self, held: &Held<S>) {
        let report = self.report.get_or_insert_with(|| SolveReport {
            contacts: 0,
            iterations: 0,
            residual: 0.0,
            relative_residual: 0.0,
            worst: None,
            stop: Stop::Converged,
            islands: Vec::with_capacity(self.reports),
        });
        report.contacts += 1;
        let first = report.contacts == 1;
        let Some(found) = held.report else { return };
        report.iterations += AtOnce::ITERATIONS;
        let left = found.residual;
        if first || left.absolute > report.residual {
            (report.residual, report.relative_residual) = (left.absolute, left.relative);
            let pair = (held.contact.a, held.contact.b);
            report.worst = (left.absolute > 0.0).then_some(pair);
        }
        report.islands.push(found.island(1, held.body, None));
    }
}

/// The names of contacts, ascending, each with its place among them. So many pressed in the step before, in order: most do
/// again.
fn in_order<S: Geometry>(all: &[&Held<S>], pressed: usize) -> Vec<(u64, usize)> {
    const NOBODY: usize = usize::MAX;
    let mut again = vec![NOBODY; pressed];
    let mut new = Vec::new();
    for (k, held) in all.iter().enumerate() {
        match held.pressed_as {
            Some(place) => again[place] = k,
            None => new.push((held.contact.id, k)),
        }
    }
    let mut names = Vec::with_capacity(all.len());
    names.extend(again.into_iter().filter(|&k| k != NOBODY).map(|k| (all[k].contact.id, k)));
    if !new.is_empty() {
        names.append(&mut new);
        names.sort_unstable();
    }
    names
}

/// The report of a flow that bodies which are alone share with others.
pub fn beside(alone: Option<SolveReport>, others: Option<SolveReport>) -> Option<SolveReport> {
    let (mut alone, mut others) = match (alone, others) {
        (Some(alone), Some(others)) => (alone, others),
        (alone, others) => return alone.or(others),
    };
    let contacts = alone.contacts + others.contacts;
    let iterations = alone.iterations + others.iterations;
    let stop = others.stop.clone();
    let mut islands = std::mem::take(&mut alone.islands);
    islands.append(&mut others.islands);
    let worse = if others.residual > alone.residual { others } else { alone };
    Some(SolveReport { contacts, iterations, stop, islands, ..worse })
}
