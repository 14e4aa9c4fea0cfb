//! What happened within a step of the scheme with events, in the order in which it did for each body: flows, rounds of
//! impacts and projections as pieces of the bodies' ways, and beside them what each contact did in each. Only what was
//! taken for good stands here; a flow that an arrival cut counts up to its cut (theory section 8.4).

use crate::bodies::{Bodies, Motion};
use crate::narrow_phase::Touch;
use carom_geometry::Geometry;
use carom_math::{Column, Rotation, Space};
use carom_solver::{Contact, ContactProblem, Impulses};
use std::collections::BTreeMap;

/// What a contact did.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum EventKind {
    /// Persisted through a flow, friction against the mean slip.
    Flow,
    /// The same with friction against the slip at the flow's end: more slips stopped in the step than are looked for.
    FlowToEnd,
    /// Took part in a round of impacts: bounced, or ended without bounce because it has no restitution.
    Impact,
    /// Took part in a round of impacts: approached too slowly to bounce, though it has restitution.
    RestCut,
    /// The impulse that begins a rest of the step which is taken at once.
    FallbackImpact,
    /// That rest itself.
    FallbackFlow,
    /// Slowed to arrive at the flow's end, or touched what was.
    Slowed,
    /// Closed its gap through a flow, no further than to its end.
    Closing,
}

impl EventKind {
    /// Names of the kinds, in the order of their codes.
    pub const NAMES: [&'static str; 8] = [
        "flow",
        "flow_to_end",
        "impact",
        "rest_cut",
        "fallback_impact",
        "fallback_flow",
        "slowed",
        "closing",
    ];
    /// The kind's code: its place in `NAMES`.
    pub fn code(self) -> u8 {
        self as u8
    }
    /// True for what happens in no time.
    pub fn is_impact(self) -> bool {
        matches!(self, EventKind::Impact | EventKind::RestCut | EventKind::FallbackImpact | EventKind::Slowed)
    }
}

/// What one contact did in a flow or in a round of impacts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EventRecord<S: Space> {
    /// Number of the act that it is part of; acts of one body increase with time.
    pub act: usize,
    /// What it did.
    pub kind: EventKind,
    /// When it began \[s\].
    pub time: f64,
    /// How long it lasted \[s\]; 0 for impacts.
    pub length: f64,
    /// Index of body a.
    pub a: usize,
    /// Index of body b.
    pub b: usize,
    /// Names the contact from step to step.
    pub id: u64,
    /// The point where it acted, half-way through a flow \[m\].
    pub point: S::Vector,
    /// Unit normal from b to a there.
    pub normal: S::Vector,
    /// From a's centre of mass to where the impulse acted on it \[m\].
    pub arm_a: S::Vector,
    /// From b's centre of mass to where the impulse acted on it \[m\]; the same point to rounding, unless the flow's
    /// rounds between places and velocities did not settle.
    pub arm_b: S::Vector,
    /// Gap when it began \[m\]; of impacts that of the arrival, 0.
    pub gap: f64,
    /// Impulse on a, world axes \[N s\].
    pub impulse: S::Vector,
    /// Moment of rolling and spinning friction on a, world axes \[N m s\].
    pub moment: S::Spin,
    /// Coefficient of friction \[1\].
    pub friction: f64,
    /// Coefficient of restitution \[1\].
    pub restitution: f64,
    /// Coefficient of tangential restitution \[1\].
    pub tangential_restitution: f64,
}

/// How a body went through a piece of its way.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PieceKind {
    /// A flow.
    Flow,
    /// A round of impacts.
    Impact,
    /// The rest of a step, taken at once.
    Fallback,
    /// A projection of overlaps.
    Projection,
}

impl PieceKind {
    /// Names of the kinds, in the order of their codes.
    pub const NAMES: [&'static str; 4] = ["flow", "impact", "fallback", "projection"];
    /// The kind's code: its place in `NAMES`.
    pub fn code(self) -> u8 {
        self as u8
    }
}

/// A piece of one body's way through a step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Piece<S: Space> {
    /// Number of the act.
    pub act: usize,
    /// How the body went.
    pub kind: PieceKind,
    /// Index of the body.
    pub body: usize,
    /// When it began \[s\].
    pub time: f64,
    /// How long it lasted \[s\]; 0 for impacts and projections.
    pub length: f64,
    /// How far a projection moved the body \[m\]; 0 for others.
    pub shift: S::Vector,
    /// By how much a projection turned it \[rad\], world axes; 0 for others.
    pub turn: S::Spin,
    /// Impulse that general rows (joints) gave it \[N s\].
    pub impulse: S::Vector,
    /// Their moment about its centre of mass \[N m s\].
    pub moment: S::Spin,
}

impl<S: Space> Piece<S> {
    /// A piece in which nothing but contacts acts.
    fn new(act: usize, kind: PieceKind, body: usize, time: f64, length: f64) -> Self {
        let (shift, turn, impulse, moment) = (S::Vector::ZERO, S::Spin::ZERO, S::Vector::ZERO, S::Spin::ZERO);
        Piece { act, kind, body, time, length, shift, turn, impulse, moment }
    }
    /// True for a flow in which nothing but contacts acted.
    fn is_plain_flow(&self) -> bool {
        let free = self.impulse == S::Vector::ZERO && self.moment == S::Spin::ZERO;
        self.kind == PieceKind::Flow && free
    }
}

/// What a contact did in the whole step, by sums over its records.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ContactSum<S: Space> {
    /// Impulse on a, world axes \[N s\].
    pub impulse: S::Vector,
    /// What of it is that of impacts \[N s\].
    pub impact: S::Vector,
    /// Moment of rolling and spinning friction on a, world axes \[N m s\].
    pub moment: S::Spin,
}

/// The log of a step.
#[derive(Clone, Debug, PartialEq)]
pub struct EventLog<S: Space> {
    /// What each contact did, act by act.
    pub contacts: Vec<EventRecord<S>>,
    /// The bodies' ways, act by act; a body that goes through the whole step in one flow is not listed.
    pub pieces: Vec<Piece<S>>,
    acts: usize,
}

impl<S: Space> Default for EventLog<S> {
    fn default() -> Self {
        EventLog { contacts: Vec::new(), pieces: Vec::new(), acts: 0 }
    }
}

/// What a log is told of a set of contacts that were solved for together.
pub struct Acted<'a, S: Geometry> {
    /// When it began \[s\].
    pub time: f64,
    /// How long it lasted \[s\].
    pub length: f64,
    /// The contacts that took part, as found where they acted.
    pub touches: &'a [Touch<S>],
    /// The problem, one contact for each of them.
    pub problem: &'a ContactProblem<S>,
    /// Its impulses.
    pub impulses: &'a Impulses<S>,
}

impl<S: Geometry> EventLog<S> {
    /// True when nothing is in it.
    pub fn is_empty(&self) -> bool {
        self.contacts.is_empty() && self.pieces.is_empty()
    }

    /// An empty log that takes as many records as another, and a quarter more, without growing.
    pub fn like(other: &Self) -> Self {
        let room = |used: usize| used + used / 4;
        let (contacts, pieces) = (room(other.contacts.len()), room(other.pieces.len()));
        EventLog { contacts: Vec::with_capacity(contacts), pieces: Vec::with_capacity(pieces), acts: 0 }
    }

    /// Forgets everything.
    pub fn clear(&mut self) {
        self.contacts.clear();
        self.pieces.clear();
        self.acts = 0;
    }

    /// Adds contacts that acted together; `kind_of` tells what each did, by its place, and `index` gives the indices of
    /// the problem's bodies.
    pub fn add(
        &mut self,
        acted: &Acted<S>,
        mut kind_of: impl FnMut(usize) -> EventKind,
        index: impl Fn(usize) -> usize,
    ) {
        let first = self.contacts.len();
        self.contacts.reserve(acted.touches.len());
        for (k, (c, g)) in acted.problem.contacts.iter().zip(&acted.impulses.contacts).enumerate() {
            let t = &acted.touches[k];
            self.contacts.push(EventRecord {
                act: self.acts,
                kind: kind_of(k),
                time: acted.time,
                length: acted.length,
                a: index(c.a),
                b: index(c.b),
                id: c.id,
                point: t.point,
                normal: c.normal,
                arm_a: c.arm_a,
                arm_b: c.arm_b,
                gap: t.gap,
                impulse: Contact::to_world(c, g),
                moment: S::Spin::ZERO,
                friction: c.friction,
                restitution: c.restitution,
                tangential_restitution: t.tangential_restitution,
            });
        }
        for (r, m) in acted.problem.resistances.iter().zip(&acted.impulses.moments) {
            self.contacts[first + r.contact].moment += acted.problem.contacts[r.contact].moment_to_world(*m);
        }
    }

    /// Ends an act that these bodies took part in, movable ones of a set.
    pub fn end_act(&mut self, kind: PieceKind, time: f64, length: f64, bodies: impl Iterator<Item = usize>) {
        let act = self.acts;
        self.pieces.extend(bodies.map(|body| Piece::new(act, kind, body, time, length)));
        self.acts += 1;
    }

    /// Adds what the general rows of a problem did to the pieces of the act that ended last.
    pub fn add_rows(
        &mut self,
        problem: &ContactProblem<S>,
        impulses: &Impulses<S>,
        index: impl Fn(usize) -> usize,
    ) {
        let act = self.acts.wrapping_sub(1);
        let first = self.pieces.iter().rposition(|p| p.act != act).map_or(0, |k| k + 1);
        for (row, &impulse) in problem.rows.iter().zip(&impulses.rows) {
            for (body, on) in [(index(row.a), &row.on_a), (index(row.b), &row.on_b)] {
                if let Some(piece) = self.pieces[first..].iter_mut().find(|p| p.body == body) {
                    piece.impulse += on.linear * impulse;
                    piece.moment += on.angular * impulse;
                }
            }
        }
    }

    /// A projection that moved bodies from where they were.
    pub fn projection(&mut self, time: f64, before: &Motion<S>, bodies: &Bodies<S>) {
        let (act, kind) = (self.acts, PieceKind::Projection);
        let now = &bodies.motion;
        for body in (0..bodies.len()).filter(|&i| bodies.is_dynamic(i)) {
            let shift = now.position[body] - before.position[body];
            let turned = now.rotation[body] != before.rotation[body];
            let turn = if turned {
                before.rotation[body].inverse().then(&now.rotation[body]).vector()
            } else {
                S::Spin::ZERO
            };
            if turned || shift != S::Vector::ZERO {
                self.pieces.push(Piece { shift, turn, ..Piece::new(act, kind, body, time, 0.0) });
            }
        }
        self.acts += 1;
    }

    /// Takes over the log of a set, whose bodies `index` gives the indices of, and whose times begin at `start` \[s\].
    pub fn append(&mut self, other: &EventLog<S>, start: f64, index: impl Fn(usize) -> usize) {
        let before = self.acts;
        self.contacts.extend(other.contacts.iter().map(|r| EventRecord {
            act: before + r.act,
            time: start + r.time,
            a: index(r.a),
            b: index(r.b),
            ..*r
        }));
        let mine =
            |p: &Piece<S>| Piece { act: before + p.act, time: start + p.time, body: index(p.body), ..*p };
        self.pieces.extend(other.pieces.iter().map(mine));
        self.acts += other.acts;
    }

    /// Moves all times by the time of the step's start \[s\].
    pub fn begin_at(&mut self, start: f64) {
        self.contacts.iter_mut().for_each(|r| r.time += start);
        self.pieces.iter_mut().for_each(|p| p.time += start);
    }

    /// Leaves out the ways of bodies that went through the whole step in one flow.
    pub fn leave_out_whole_flows(&mut self, bodies: usize) {
        let mut pieces = vec![0; bodies];
        self.pieces.iter().for_each(|p| pieces[p.body] += 1);
        self.pieces.retain(|p| pieces[p.body] > 1 || !p.is_plain_flow());
    }

    /// Sums over the step, contact by contact: for each of `touches`, and for those that are appended to it because
    /// they acted earlier in the step only, as their last records have them.
    pub fn sums(&self, touches: &mut Vec<Touch<S>>) -> Vec<ContactSum<S>> {
        // the records of a flow come in the order of its contacts: as long as they do, no other order is looked up
        let mut places: Option<BTreeMap<(usize, usize, u64), usize>> = None;
        let mut next = 0;
        let mut sums = vec![ContactSum::default(); touches.len()];
        for r in &self.contacts {
            let name = |t: &Touch<S>| (t.a, t.b, t.id);
            let k = if touches.get(next).is_some_and(|t| name(t) == (r.a, r.b, r.id)) {
                next
            } else {
                let places = places
                    .get_or_insert_with(|| touches.iter().enumerate().map(|(k, t)| (name(t), k)).collect());
                *places.entry((r.a, r.b, r.id)).or_insert_with(|| {
                    touches.push(touch_of(r));
                    sums.push(ContactSum::default());
                    sums.len() - 1
                })
            };
            next = k + 1;
            sums[k].impulse += r.impulse;
            sums[k].moment += r.moment;
            if r.kind.is_impact() {
                sums[k].impact += r.impulse;
            }
        }
        sums
    }
}

/// A contact as its record has it; rolling and spinning friction are not told.
fn touch_of<S: Geometry>(r: &EventRecord<S>) -> Touch<S> {
    Touch {
        id: r.id,
        a: r.a,
        b: r.b,
        point: r.point,
        normal: r.normal,
        gap: r.gap,
        friction: r.friction,
        rolling: 0.0,
        spinning: 0.0,
        restitution: r.restitution,
        tangential_restitution: r.tangential_restitution,
    }
}
