//! The order of events in a step. Movable bodies that persisting contacts join form an island; each island has a flow
//! of its own, begun at its last event and laid out to its next own end (the step's, or the stop of a slip). Arrivals
//! between bodies are found on the islands' ways and wait in a queue; when one is due, only the islands that meet are
//! taken back, brought to the moment, struck, and laid out anew. What an event costs is the matter of its islands.

use super::alone::Alone;
use super::arrival::{PAUSE, Search, State, Way};
use super::candidates::Candidates;
use super::contacts::Active;
use super::flow::Stick;
use super::limits::Limits;
use super::memory::Memory;
use super::tape::{Cause, Gap};
use super::together::{Halt, LastFlow, Saved, Together, Tools};
use crate::bodies::{Bodies, Motion};
use crate::force::Wrench;
use crate::joint::{JointImpulse, add_all};
use crate::narrow_phase::{Touch, restitution_of};
use crate::observe::accounts::Accounts;
use crate::observe::event_log::EventLog;
use crate::observe::ledger::Ledger;
use crate::observe::report::{Events, ImpactReport, SolveReport};
use crate::settings::{PlasticArrivals, Settings};
use crate::stepping::worse;
use crate::warm_start::WarmStart;
use carom_geometry::Geometry;
use carom_math::{Column, Rotation};
use carom_solver::Partition;
use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// Rotation in one flow \[rad\]: ways are found from quadratic rotations.
const TURN: f64 = 1.0;
/// Turn of the line between two balls in one flow \[rad\]: between its ends their ways are no arcs.
const SWING: f64 = 0.08;
/// Times that a flow is halved in which places do not come out.
const HALVINGS: usize = 8;
/// Left of the step when it is over \[1\].
pub(super) const OVER: f64 = 1e-14;

/// What all of a step has in common.
pub struct Common<'a, S: Geometry> {
    /// The choices of the run.
    pub settings: &'a Settings<S>,
    /// Bounds of the step.
    pub limits: Limits,
    /// Time of the step's start \[s\].
    pub time: f64,
    /// Loads on each body through the step.
    pub wrenches: &'a [Wrench<S>],
    /// Motion at the step's start.
    pub origin: &'a Motion<S>,
    /// How far surfaces may come \[m\], as the candidates were found for.
    pub reaches: &'a [f64],
    /// Forces of the step before, and what it tells of its contacts.
    pub warm: &'a WarmStart<S>,
    /// Pairs that may meet.
    pub candidates: &'a Candidates<S>,
    /// Whether accounts are kept body by body.
    pub keeps_accounts: bool,
    /// Names of the world's joints.
    pub joint_names: Vec<String>,
}

/// Bodies that persisting contacts join, on a flow of their own.
pub struct Island<S: Geometry> {
    /// Indices in the world, ascending, obstacles included.
    pub members: Vec<usize>,
    pub(super) begin: f64,
    pub(super) until: f64,
    pub(super) start: Motion<S>,
    /// Motion at `until`.
    pub end: Motion<S>,
    pub(super) active: Active<S>,
    pub(super) stick: Stick,
    pub(super) before: Option<Memory>,
    /// Lines of the flow.
    pub(super) ledger: Ledger,
    pub(super) accounts: Accounts<S>,
    /// What joints gave in it.
    pub(super) joints: Vec<JointImpulse<S>>,
    pub(super) worst: Option<SolveReport>,
    /// Forces of the flow.
    pub forces: Option<WarmStart<S>>,
    /// What it tells of its contacts.
    pub memory: Option<Memory>,
    /// Its problem and impulses.
    pub last: LastFlow<S>,
    /// Events of its bodies so far, and stops of slips among them.
    pub(super) events: usize,
    pub(super) stops: usize,
    pub(super) stopping: bool,
    /// Islands that share this flow: 1 but for the quiet ones of a step's start.
    pub islands: usize,
    /// True when all plastic contacts that come in on the way are in its flow: they need no moments.
    pub(super) complete: bool,
}

/// When and how an island flows.
pub(super) struct Course {
    pub begin: f64,
    /// Length \[s\].
    pub time: f64,
    pub until: f64,
    pub stick: Stick,
    /// What the flow before told of its contacts.
    pub before: Option<Memory>,
    pub events: usize,
    pub stops: usize,
    pub stopping: bool,
    /// Islands that share it.
    pub islands: usize,
    /// True when all plastic contacts that come in on the way are in it.
    pub complete: bool,
}

/// What waits in the queue: when, and whose. Moments are not negative, so their bits are in order.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Entry {
    moment: u64,
    kind: Kind,
    version: u64,
}

#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Kind {
    /// An island reaches the end of its flow before the step's.
    Ends(usize),
    /// A contact of a pair arrives.
    Meets(usize, u64),
}

/// A step in the making.
pub struct Timeline<'a, 'w, S: Geometry> {
    pub(super) common: &'a Common<'a, S>,
    pub(super) tools: Tools<'a, 'w, S>,
    /// Each body as it was when its flow began.
    pub(super) bodies: &'a mut Bodies<S>,
    pub(super) ways: Vec<Way<S>>,
    /// The islands; `None` where one has ended.
    pub islands: Vec<Option<Island<S>>>,
    pub(super) island_of: Vec<usize>,
    queue: BinaryHeap<Reverse<Entry>>,
    pub(super) versions: Vec<u64>,
    /// How far surfaces may come \[m\], by what has been seen of the step so far.
    pub(super) reaches: Vec<f64>,
    pub(super) slots: Vec<usize>,
    /// Bodies that go through the step by themselves.
    pub alone: Alone<S>,
    /// Lines of all flows and impacts.
    pub ledger: Ledger,
    /// The same body by body, where that is asked for.
    pub accounts: Accounts<S>,
    /// What the joints gave in them, joint by joint of the world.
    pub(crate) joints: Vec<JointImpulse<S>>,
    /// What happened.
    pub events: Events,
    /// The same, act by act; times from the step's start.
    pub log: EventLog<S>,
    /// What the impacts came to.
    pub struck: ImpactReport,
    /// Worst solves: persistent contacts, impacts.
    pub worst: [Option<SolveReport>; 2],
}

/// No island, or no slot.
pub(super) const NONE: usize = usize::MAX;

impl<'a, 'w, S: Geometry> Timeline<'a, 'w, S> {
    /// A step that begins with the bodies as they are.
    pub fn new(common: &'a Common<'a, S>, bodies: &'a mut Bodies<S>, tools: Tools<'a, 'w, S>) -> Self {
        Timeline {
            ways: Vec::new(),
            islands: Vec::new(),
            island_of: vec![NONE; bodies.len()],
            queue: BinaryHeap::new(),
            versions: vec![0; common.candidates.pairs.len()],
            reaches: common.reaches.to_vec(),
            slots: vec![NONE; bodies.len()],
            alone: Alone::nobody(bodies.len()),
            ledger: Ledger::default(),
            accounts: Accounts::new(bodies.len(), common.keeps_accounts),
            joints: Vec::new(),
            events: Events::default(),
            log: EventLog::default(),
            struck: ImpactReport::default(),
            worst: [None, None],
            common,
            tools,
            bodies,
        }
    }

    /// The ways that bodies would go by themselves, where anybody looks at ways.
    pub(super) fn begin_ways(&mut self) {
        let (dt, bodies) = (self.common.limits.dt, &*self.bodies);
        self.ways.extend((0..bodies.len()).map(|i| {
            let start = state(&bodies.motion, i);
            let mut end = start;
            if start.spin != S::Spin::ZERO {
                end.rotation = start.rotation.then(&S::Rotation::about(start.spin * dt));
            }
            Way::between(0.0, dt, &start, &end, bodies.data[i].turning_arm)
        }));
    }

    /// Takes the whole step; the islands hold its end.
    pub fn run(&mut self) -> Result<(), Halt> {
        self.begin()?;
        while let Some(Reverse(entry)) = self.queue.pop() {
            let moment = f64::from_bits(entry.moment);
            match entry.kind {
                Kind::Ends(island) => {
                    if self.islands[island].is_some() {
                        let stops = self.island(island).stopping;
                        self.because(if stops { Cause::Stop } else { Cause::Turned });
                        self.meet(moment, &[island], Vec::new(), None)?;
                    }
                }
                Kind::Meets(pair, id) if self.versions[pair] == entry.version => {
                    let (a, b) = self.common.candidates.pairs[pair];
                    self.set_apart(a)?;
                    self.set_apart(b)?;
                    // an entry of islands that shared a flow is made anew by each of them
                    if self.versions[pair] == entry.version {
                        self.arrive(moment, pair, id)?;
                    }
                }
                Kind::Meets(..) => {}
            }
        }
        self.finish()
    }

    /// Strikes a set at a moment, splits it into islands, and lays out their flows.
    pub(super) fn lay_out(
        &mut self,
        mut at: Together<'a, S>,
        moment: f64,
        events: usize,
        stops: usize,
    ) -> Result<(), Halt> {
        let touches = at.touches();
        self.tools.impacts.blows = self.tools.tape.is_some().then(Vec::new);
        at.strike(&touches, &mut self.tools)?;
        if let Some((tape, rounds)) = self.tools.tape.as_mut().zip(self.tools.impacts.blows.take()) {
            tape.impact(&at.members, &at.bodies.motion, rounds);
        }
        let rest = self.common.limits.dt - moment;
        let ahead = at.brake(&touches, rest, &mut self.tools)?;
        self.keep(&mut at);
        let mut active = at.persisting(&touches);
        active.expect(ahead, rest);
        let islands = split(&at, &active);
        if let [_] = islands.as_slice() {
            return self.flow(at, active, moment, events, stops);
        }
        self.lay_out_each(&at, &active, moment, events, stops)
    }

    /// Takes over what has been done with a set: its motion, its lines, its reports, of which solves go to the worst.
    pub(super) fn keep(&mut self, at: &mut Together<S>) {
        self.keep_motion(&at.members, &at.bodies.motion);
        self.ledger.add(&at.ledger);
        self.accounts.add(&at.accounts, |i| at.members[i]);
        self.keep_joints(&at.bodies.joints.numbers, &at.joints);
        self.events.add(&at.events);
        at.last.tell(at.moment, &at.members, |i| self.bodies.is_dynamic(i), &mut self.log);
        self.log.append(&at.log, 0.0, |i| at.members[i]);
        self.struck.add(&at.struck);
        for (mine, theirs) in self.worst.iter_mut().zip(&mut at.worst) {
            *mine = worse(mine.take(), theirs.take());
        }
    }

    /// The same of an island without joints whose flow ends with the step: it is where it is laid out to be.
    pub(super) fn keep_end(&mut self, mut island: Island<S>) -> Island<S> {
        self.keep_motion(&island.members, &island.end);
        self.ledger.add(&island.ledger);
        self.accounts.add(&island.accounts, |i| island.members[i]);
        island.last.tell(island.begin, &island.members, |i| self.bodies.is_dynamic(i), &mut self.log);
        self.worst[0] = worse(self.worst[0].take(), island.worst.take());
        island
    }

    fn keep_motion(&mut self, members: &[usize], motion: &Motion<S>) {
        for (k, &i) in members.iter().enumerate() {
            if self.bodies.is_dynamic(i) {
                self.bodies.motion.position[i] = motion.position[k];
                self.bodies.motion.rotation[i] = motion.rotation[k];
                self.bodies.motion.set_twist(i, &motion.twist(k));
            }
        }
    }

    /// Takes over what joints gave, by their numbers in the world.
    fn keep_joints(&mut self, numbers: &[usize], given: &[JointImpulse<S>]) {
        if given.is_empty() {
            return;
        }
        let mut all = vec![JointImpulse::default(); self.bodies.joints.len()];
        numbers.iter().zip(given).for_each(|(&k, g)| all[k] = *g);
        add_all(&mut self.joints, &all);
    }

    /// Lays out the flow of an island from a moment on.
    pub(super) fn flow(
        &mut self,
        mut at: Together<'a, S>,
        active: Active<S>,
        moment: f64,
        events: usize,
        stops: usize,
    ) -> Result<(), Halt> {
        let limits = &self.common.limits;
        at.forget();
        let rest = limits.dt - moment;
        let mut time = rest.min(longest_flow(&at, &active));
        let at_once = self.common.settings.events.plastic_arrivals == PlasticArrivals::WithinTheStep;
        let stick = if stops < limits.slip_stops && !at_once { Stick::Mean } else { Stick::End };
        let before = at.memory.clone();
        let start = at.save();
        let is_over = rest <= OVER * limits.dt;
        if !is_over {
            let mut halvings = 0;
            while !at.flow(time, &active, stick, &mut self.tools)? && halvings < HALVINGS {
                at.restore(&start);
                (time, halvings) = (0.5 * time, halvings + 1);
            }
        }
        let mut stopping = false;
        let stop = match stick {
            _ if is_over => None,
            Stick::Mean => at.first_stop(&start, &active, time, &mut self.tools)?,
            Stick::End => None,
        };
        if let Some(stop) = stop {
            at.restore(&start);
            at.flow(stop, &active, stick, &mut self.tools)?;
            (time, stopping) = (stop, true);
        }
        let until = if rest - time <= OVER * limits.dt { limits.dt } else { moment + time };
        let course = Course {
            begin: moment,
            time,
            until,
            stick,
            before,
            events,
            stops,
            stopping,
            islands: 1,
            complete: false,
        };
        self.enter(at, start, active, course);
        Ok(())
    }

    /// Enters a flow that has been laid out: its bodies' ways, and its end if that is not the step's.
    pub(super) fn enter(&mut self, at: Together<'a, S>, start: Saved<S>, active: Active<S>, course: Course) {
        let number = self.islands.len();
        let Course { begin, time, until, stick, before, events, stops, stopping, islands, complete } = course;
        let over = OVER * self.common.limits.dt;
        debug_assert!((at.moved - time).abs() <= over, "moved by {} s for a flow of {time} s", at.moved);
        for (k, &i) in at.members.iter().enumerate() {
            if self.bodies.is_dynamic(i) {
                let (s, e) = (state(start.motion(), k), state(&at.bodies.motion, k));
                self.ways[i] = Way::between(begin, begin + time, &s, &e, self.bodies.data[i].turning_arm);
                self.island_of[i] = number;
            }
        }
        if until < self.common.limits.dt {
            let moment = until.to_bits();
            self.queue.push(Reverse(Entry { moment, kind: Kind::Ends(number), version: 0 }));
        }
        let [worst, _] = at.worst;
        self.islands.push(Some(Island {
            begin,
            until,
            start: start.into_motion(),
            end: at.bodies.motion,
            members: at.members,
            active,
            stick,
            before,
            ledger: at.ledger,
            accounts: at.accounts,
            joints: at.joints,
            worst,
            forces: at.forces,
            memory: at.memory,
            last: at.last,
            events,
            stops,
            stopping,
            islands,
            complete,
        }));
    }

    /// Looks for the next arrival of a pair from a moment on.
    pub(super) fn foresee(&mut self, pair: usize, moment: f64) {
        self.versions[pair] += 1;
        let (a, b) = self.common.candidates.pairs[pair];
        let island = |i: usize| self.islands.get(self.island_of[i]).and_then(Option::as_ref);
        let (one, other) = (island(a), island(b));
        let until = |island: Option<&Island<S>>| island.map_or(self.common.limits.dt, |i| i.until);
        let mover = one.or(other);
        let is_complete = |island: Option<&Island<S>>| island.is_none_or(|i| i.complete);
        if is_complete(one)
            && is_complete(other)
            && restitution_of(self.bodies, self.common.settings, (a, b)) == 0.0
        {
            return;
        }
        let search = Search {
            pair: (a, b),
            from: moment,
            until: until(one).min(until(other)),
            bodies: self.bodies,
            ways: &self.ways,
            limits: &self.common.limits,
            ignored: mover.map_or(&[], |i| i.active.names.as_slice()),
        };
        if let Some((moment, id)) = self.tools.arrivals.first(&search) {
            let (moment, version) = (moment.to_bits(), self.versions[pair]);
            self.queue.push(Reverse(Entry { moment, kind: Kind::Meets(pair, id), version }));
        }
    }

    pub(super) fn island(&self, k: usize) -> &Island<S> {
        self.islands[k].as_ref().expect("an island in use")
    }

    /// Brings islands to a moment, with those that touch them, strikes them as one, and lays them out anew.
    pub(super) fn meet(
        &mut self,
        moment: f64,
        islands: &[usize],
        ready: Vec<(usize, Together<'a, S>)>,
        due: Option<(usize, usize)>,
    ) -> Result<(), Halt> {
        let met = self.bring(moment, islands, ready)?;
        if met.events > self.common.limits.cap(met.movers.len()) {
            return self.cut_short(moment, &met.movers);
        }
        let mut at = self.gather(&met.movers, moment);
        at.due = due;
        if let Some((memory, forces)) = met.memory {
            (at.memory, at.forces) = (Some(memory), Some(forces));
        }
        let impacts = self.events.impacts;
        self.lay_out(at, moment, met.events, met.stops)?;
        // an arrival of the ways that the flows do not share: looked at again a little later
        let missed = due.filter(|_| self.events.impacts == impacts);
        self.tell_gap(missed.is_some(), Gap::Missed, &met.movers);
        self.foresee_all(&met.movers, moment, missed);
        Ok(())
    }

    /// Tells the tape what makes the next moment.
    pub(super) fn because(&mut self, cause: Cause) {
        if let Some(tape) = &mut self.tools.tape {
            tape.because(cause);
        }
    }

    /// Tells the tape of the flow by which an island has come to a moment, where it is a flow.
    pub(super) fn tell_flow(&mut self, k: usize, at: &Together<S>, moment: f64) {
        let (Some(tape), Some(island)) = (&mut self.tools.tape, &self.islands[k]) else { return };
        if moment > island.begin && at.last.time > 0.0 {
            let ends = (&island.start, &at.bodies.motion);
            tape.flow(&island.members, ends, &island.active, island.stick, &at.last);
        }
    }

    /// Tells the tape of something that has no derivative.
    pub(super) fn tell_gap(&mut self, happened: bool, gap: fn(Vec<usize>) -> Gap, movers: &[usize]) {
        if let Some(tape) = self.tools.tape.as_mut().filter(|_| happened) {
            tape.gap(gap(movers.to_vec()));
        }
    }

    /// Looks for the next arrivals of some bodies; of a pair that was missed, a little later.
    pub(super) fn foresee_all(&mut self, movers: &[usize], moment: f64, missed: Option<(usize, usize)>) {
        let candidates = self.common.candidates;
        let mut pairs: Vec<usize> = movers.iter().flat_map(|&i| candidates.of_body(i)).copied().collect();
        pairs.sort_unstable();
        pairs.dedup();
        for pair in pairs {
            let later = missed == Some(candidates.pairs[pair]);
            let pause = if later { PAUSE * self.common.limits.dt } else { 0.0 };
            self.foresee(pair, moment + pause);
        }
    }
}

/// A body's state in a motion.
pub(super) fn state<S: Geometry>(m: &Motion<S>, i: usize) -> State<S> {
    State {
        position: m.position[i],
        rotation: m.rotation[i],
        velocity: m.velocity[i],
        spin: m.angular_velocity[i],
    }
}

/// How long a flow may be for its ways to be found \[s\].
pub(super) fn longest_flow<S: Geometry>(at: &Together<S>, active: &Active<S>) -> f64 {
    let swinging = active.touches.iter().map(|t| swing_rate(at, t)).fold(0.0, f64::max);
    let longest = if at.pairs.is_empty() { f64::INFINITY } else { SWING / swinging };
    longest_turn(at).min(longest)
}

/// How long it may be for what turning does to its ways \[s\].
pub(super) fn longest_turn<S: Geometry>(at: &Together<S>) -> f64 {
    let jointed = !at.bodies.joints.is_empty();
    if at.pairs.is_empty() && !jointed {
        return f64::INFINITY;
    }
    let turning = (0..at.bodies.len()).filter(|&i| jointed || at.bodies.data[i].turning_arm > 0.0);
    let fastest = turning.map(|i| at.bodies.motion.angular_velocity[i].norm()).fold(0.0, f64::max);
    TURN / fastest
}

/// How fast the line between two balls that touch turns \[rad/s\]; 0 for other shapes.
fn swing_rate<S: Geometry>(at: &Together<S>, t: &Touch<S>) -> f64 {
    let is_ball = |i: usize| at.bodies.data[i].turning_arm == 0.0;
    if !is_ball(t.a) || !is_ball(t.b) {
        return 0.0;
    }
    let m = &at.bodies.motion;
    let across = m.velocity[t.a] - m.velocity[t.b];
    let across = across - t.normal * t.normal.dot(across);
    across.norm() / (m.position[t.a] - m.position[t.b]).norm()
}

/// The movable bodies of a set, island by island.
pub(super) fn split<S: Geometry>(at: &Together<S>, active: &Active<S>) -> Vec<Vec<usize>> {
    let mut sets = sets_of(at, active);
    let mut all: Vec<usize> = (0..at.bodies.len()).filter(|&i| at.bodies.is_dynamic(i)).collect();
    all.sort_by_key(|&i| (sets.root(i), i));
    all.chunk_by(|&i, &j| sets.root(i) == sets.root(j)).map(<[usize]>::to_vec).collect()
}

/// How many they are.
pub(super) fn count_islands<S: Geometry>(at: &Together<S>, active: &Active<S>) -> usize {
    let mut sets = sets_of(at, active);
    (0..at.bodies.len()).filter(|&i| at.bodies.is_dynamic(i) && sets.root(i) == i).count()
}

fn sets_of<S: Geometry>(at: &Together<S>, active: &Active<S>) -> Partition {
    let mut sets = Partition::default();
    sets.reset(at.bodies.len());
    for t in &active.touches {
        if at.bodies.is_dynamic(t.a) && at.bodies.is_dynamic(t.b) {
            sets.join(t.a, t.b);
        }
    }
    at.bodies.jointed().for_each(|(a, b)| sets.join(a, b));
    sets
}
