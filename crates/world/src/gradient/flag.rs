//! Where a step's contact set is on an edge: its derivative there is that of one side, or of a choice. Each flag names
//! the step, the bodies and the reason (theory section 10.4).

use super::flowing::velocities;
use super::holding::{Edge, Solved, still_speed};
use crate::bodies::Bodies;
use crate::impact::Blow;
use crate::integrate::turn_freely;
use crate::settings::{ImpactLaw, Settings};
use crate::stepping::events::tape::{Cause, Deed, Flow, Gap, Tape};
use carom_geometry::Geometry;
use carom_math::Column;
use serde::Serialize;

/// Share of the step within which two moments are one \[1\].
const SAME_MOMENT: f64 = 1e-9;

/// Why a contact set is on an edge.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Reason {
    /// A contact touches without force and without normal velocity, and no other holds it.
    Weightless,
    /// A contact's friction is at its limit while it does not slip.
    OnCone,
    /// More contacts slip and turn than there are conditions: how pressure is shared makes the motion.
    Indeterminate,
    /// Contacts arrive at the same moment: which is first decides.
    Simultaneous,
    /// An arrival that struck nothing: bodies graze.
    Grazing,
    /// An impact too slow to bounce ended without one.
    RestCut,
    /// Overlap was projected away; the derivative passes as if it had not been.
    Projected,
    /// The rest of the step was taken at once; it has no derivative here.
    CutShort,
    /// Impacts by a law that has no derivative here: the energy guard's, or another than Newton's rounds.
    Law,
}

impl Reason {
    /// The name as users read it.
    pub fn name(self) -> &'static str {
        match self {
            Reason::Weightless => "weightless",
            Reason::OnCone => "on_cone",
            Reason::Indeterminate => "indeterminate",
            Reason::Simultaneous => "simultaneous",
            Reason::Grazing => "grazing",
            Reason::RestCut => "rest_cut",
            Reason::Projected => "projected",
            Reason::CutShort => "cut_short",
            Reason::Law => "law",
        }
    }
    /// What it means, in a sentence.
    pub fn text(self) -> &'static str {
        match self {
            Reason::Weightless => "they touch without force; pressing and parting have different derivatives",
            Reason::OnCone => {
                "friction is at its limit without slip; sticking and slipping have different derivatives"
            }
            Reason::Indeterminate => {
                "more contacts slip and turn than are needed to hold; how they share the pressure makes the motion"
            }
            Reason::Simultaneous => "contacts arrive at once; which is first decides the derivative",
            Reason::Grazing => "they graze; a little nearer they would strike",
            Reason::RestCut => {
                "an impact slower than the rest speed ended without bounce; a faster one would bounce"
            }
            Reason::Projected => {
                "overlap was projected away; the derivative is passed on as if it had not been"
            }
            Reason::CutShort => "the step had more events than its cap; its rest has no derivative",
            Reason::Law => "the impact went by a law that has no derivative here",
        }
    }
}

/// A step whose contact set is on an edge.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Flag {
    /// The step, counted from 0.
    pub step: usize,
    /// Names of the bodies of the contact, or of those concerned, ascending by index.
    pub bodies: Vec<String>,
    /// Why.
    pub reason: Reason,
}

/// Flags of a step.
pub fn flags<S: Geometry>(
    bodies: &Bodies<S>,
    settings: &Settings<S>,
    tape: &Tape<S>,
    (step, dt): (usize, f64),
) -> Vec<Flag> {
    let mut look = Look { bodies, settings, step, flags: Vec::new() };
    for gap in &tape.gaps {
        match gap {
            Gap::Projected(movers) => look.say(movers, Reason::Projected),
            Gap::CutShort(movers) => look.say(movers, Reason::CutShort),
            Gap::Missed(movers) => look.say(movers, Reason::Grazing),
        }
    }
    let mut arrivals: Vec<(f64, Vec<usize>)> = Vec::new();
    for deed in &tape.deeds {
        match deed {
            Deed::Meet { moment, flows } => {
                flows.iter().for_each(|f| look.flow(f));
                let told = &tape.moments[*moment];
                if let Cause::Arrival((a, b), _) = told.cause {
                    arrivals.push((told.value, vec![a, b]));
                }
            }
            Deed::Impact { members, rounds, .. } => look.impact(members, rounds),
        }
    }
    for (k, (later, pair)) in arrivals.iter().enumerate() {
        for (earlier, other) in &arrivals[..k] {
            let shared = pair.iter().any(|i| bodies.is_dynamic(*i) && other.contains(i));
            if shared && pair != other && later - earlier <= SAME_MOMENT * dt {
                look.say(&[pair.as_slice(), other].concat(), Reason::Simultaneous);
            }
        }
    }
    look.flags
}

struct Look<'a, S: Geometry> {
    bodies: &'a Bodies<S>,
    settings: &'a Settings<S>,
    step: usize,
    flags: Vec<Flag>,
}

impl<S: Geometry> Look<'_, S> {
    fn say(&mut self, bodies: &[usize], reason: Reason) {
        let mut bodies = bodies.to_vec();
        bodies.sort_unstable();
        bodies.dedup();
        let names = bodies.iter().map(|&i| self.bodies.names[i].clone()).collect();
        let flag = Flag { step: self.step, bodies: names, reason };
        if !self.flags.contains(&flag) {
            self.flags.push(flag);
        }
    }

    fn say_edges(&mut self, members: &[usize], solved: &Solved<S>, resting: impl Fn(usize) -> bool) {
        let holds = solved.holds();
        for (k, edge) in solved.edges(&holds, resting) {
            let c = &solved.problem.contacts[k];
            let reason = match edge {
                Edge::Weightless => Reason::Weightless,
                Edge::OnCone => Reason::OnCone,
                Edge::Indeterminate => Reason::Indeterminate,
            };
            self.say(&[members[c.a], members[c.b]], reason);
        }
    }

    fn flow(&mut self, flow: &Flow<S>) {
        let problem = &flow.last.problem;
        if problem.contacts.is_empty() {
            return;
        }
        let mut own = self.bodies.some(&flow.members);
        own.motion.copy_from(&flow.start);
        for k in 0..flow.members.len() {
            turn_freely(self.settings.integrator, &mut own, k, 0.5 * flow.last.time);
        }
        let before = (0..flow.members.len()).map(|k| own.motion.twist(k)).collect();
        let against = velocities(flow, before).against;
        let fall = self.settings.gravity.norm() * flow.last.time;
        let still = still_speed(problem, &against, fall);
        let solved = Solved { problem, impulses: &flow.last.impulses, against: &against, still };
        self.say_edges(&flow.members, &solved, |_| true);
    }

    fn impact(&mut self, members: &[usize], rounds: &[Blow<S>]) {
        for (number, round) in rounds.iter().enumerate() {
            let problem = &round.problem;
            let after = problem.velocities_after(&round.impulses);
            let still = still_speed(problem, &problem.velocities, 0.0);
            let solved = Solved { problem, impulses: &round.impulses, against: &after, still };
            self.say_edges(members, &solved, |_| false);
            let mut called: Vec<(usize, usize)> = Vec::new();
            for (k, c) in problem.contacts.iter().enumerate() {
                let approach = -c.relative_velocity(&problem.velocities).0;
                let pair = (members[c.a], members[c.b]);
                if approach > still && (number == 0 || round.bounces[k]) {
                    called.push(pair);
                }
                if approach > still && c.restitution > 0.0 && !round.bounces[k] {
                    self.say(&[pair.0, pair.1], Reason::RestCut);
                }
            }
            self.joined(&called);
            let newtonian = matches!(round.law, ImpactLaw::Newton | ImpactLaw::GeneralizedReflections);
            if round.gains || !newtonian {
                let all: Vec<usize> =
                    problem.contacts.iter().flat_map(|c| [members[c.a], members[c.b]]).collect();
                self.say(&all, Reason::Law);
            }
        }
    }

    /// Contacts of one round that share a movable body.
    fn joined(&mut self, called: &[(usize, usize)]) {
        for (k, one) in called.iter().enumerate() {
            for other in &called[..k] {
                let shared = |i: usize| self.bodies.is_dynamic(i) && (i == other.0 || i == other.1);
                if shared(one.0) || shared(one.1) {
                    self.say(&[one.0, one.1, other.0, other.1], Reason::Simultaneous);
                }
            }
        }
    }
}
