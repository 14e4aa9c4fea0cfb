//! What a step did, kept in order for whoever differentiates it (theory chapter 10): flows with the contacts that
//! acted, impacts round by round, and what made each moment. Nothing here changes a step, and a step without a tape
//! pays one look at an `Option`. Knows no derivatives.

use super::contacts::Active;
use super::flow::Stick;
use super::together::LastFlow;
use crate::bodies::Motion;
use crate::force::Wrench;
use crate::impact::Blow;
use crate::narrow_phase::Touch;
use carom_geometry::Geometry;

/// The moment at which every step begins.
pub const START: usize = 0;

/// What made a moment of a step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Cause {
    /// The step's start or end: given.
    Given,
    /// A contact's gap closed: the bodies in the world, the contact's name.
    Arrival((usize, usize), u64),
    /// A slip of the first flow that ends there came to its stop.
    Stop,
    /// The first flow that ends there had turned as far as a flow may.
    Turned,
}

/// A moment of a step.
#[derive(Clone, Copy, Debug)]
pub struct Moment {
    /// When, from the step's start \[s\].
    pub value: f64,
    /// Why then.
    pub cause: Cause,
}

/// A flow of an island that counts: up to where it was cut.
pub struct Flow<S: Geometry> {
    /// Its bodies in the world, ascending, obstacles included.
    pub members: Vec<usize>,
    /// The moment of its start.
    pub begin: usize,
    /// Motion of the members at its start.
    pub start: Motion<S>,
    /// Motion of the members at its end.
    pub end: Motion<S>,
    /// The contacts where it started, in the members' indices.
    pub touches: Vec<Touch<S>>,
    /// Its contacts half-way, its problem and its impulses.
    pub last: LastFlow<S>,
    /// How friction held.
    pub stick: Stick,
}

/// One thing that a step did.
pub enum Deed<S: Geometry> {
    /// Flows that end at a moment.
    Meet {
        /// The moment of their end.
        moment: usize,
        /// The flows.
        flows: Vec<Flow<S>>,
    },
    /// An impact at a moment.
    Impact {
        /// Its moment.
        moment: usize,
        /// Its bodies in the world, ascending.
        members: Vec<usize>,
        /// Their motion after it; poses are those before.
        motion: Motion<S>,
        /// Its rounds.
        rounds: Vec<Blow<S>>,
    },
}

/// What has no derivative here and passes one on as if it were not.
#[derive(Clone, Debug, PartialEq)]
pub enum Gap {
    /// Overlaps of these bodies were projected away.
    Projected(Vec<usize>),
    /// The rest of the step was taken at once for these bodies.
    CutShort(Vec<usize>),
    /// Islands met and nothing struck: their bodies.
    Missed(Vec<usize>),
}

/// A step in the order in which it was done.
pub struct Tape<S: Geometry> {
    /// Motion of all bodies where the first flows begin.
    pub origin: Motion<S>,
    /// Loads on each body through the step.
    pub wrenches: Vec<Wrench<S>>,
    /// Its moments; the first is its start.
    pub moments: Vec<Moment>,
    /// What it did.
    pub deeds: Vec<Deed<S>>,
    /// What it did that has no derivative here.
    pub gaps: Vec<Gap>,
    /// The moment from which each body flows.
    moment_of: Vec<usize>,
    cause: Cause,
}

impl<S: Geometry> Default for Tape<S> {
    fn default() -> Self {
        Tape {
            origin: Motion::default(),
            wrenches: Vec::new(),
            moments: Vec::new(),
            deeds: Vec::new(),
            gaps: Vec::new(),
            moment_of: Vec::new(),
            cause: Cause::Given,
        }
    }
}

impl<S: Geometry> Tape<S> {
    /// Starts over: an attempt at the step begins from here.
    pub fn begin(&mut self, origin: &Motion<S>, wrenches: &[Wrench<S>]) {
        *self = Tape { origin: origin.clone(), wrenches: wrenches.to_vec(), ..Tape::default() };
        self.moments.push(Moment { value: 0.0, cause: Cause::Given });
        self.moment_of = vec![START; origin.position.len()];
    }
    /// Says what makes the next moment.
    pub fn because(&mut self, cause: Cause) {
        self.cause = cause;
    }
    /// A moment at which islands are brought together, for the reason said last.
    pub fn meet(&mut self, value: f64) {
        self.moments.push(Moment { value, cause: std::mem::replace(&mut self.cause, Cause::Given) });
        self.deeds.push(Deed::Meet { moment: self.moments.len() - 1, flows: Vec::new() });
    }
    /// A flow that ends at the moment told last.
    pub fn flow(
        &mut self,
        members: &[usize],
        ends: (&Motion<S>, &Motion<S>),
        active: &Active<S>,
        stick: Stick,
        last: &LastFlow<S>,
    ) {
        let begin = members.iter().map(|&i| self.moment_of[i]).max().unwrap_or(START);
        let flow = Flow {
            members: members.to_vec(),
            begin,
            start: ends.0.clone(),
            end: ends.1.clone(),
            touches: active.touches.clone(),
            last: last.clone(),
            stick,
        };
        match self.deeds.last_mut() {
            Some(Deed::Meet { flows, .. }) => flows.push(flow),
            _ => unreachable!("a flow ends at a moment"),
        }
    }
    /// Bodies that flow from the moment told last.
    pub fn met(&mut self, movers: &[usize]) {
        let now = self.moments.len() - 1;
        movers.iter().for_each(|&i| self.moment_of[i] = now);
    }
    /// An impact of bodies at the moment that they have come to.
    pub fn impact(&mut self, members: &[usize], motion: &Motion<S>, rounds: Vec<Blow<S>>) {
        let moment = members.iter().map(|&i| self.moment_of[i]).max().unwrap_or(START);
        if !rounds.is_empty() {
            self.deeds.push(Deed::Impact {
                moment,
                members: members.to_vec(),
                motion: motion.clone(),
                rounds,
            });
        }
    }
    /// Something that has no derivative here.
    pub fn gap(&mut self, gap: Gap) {
        self.gaps.push(gap);
    }
}
