//! Who is dealt with together at a moment: bodies as a set of their own, islands brought to the moment, and those that
//! touch them there.

use super::arrival::Way;
use super::memory::Memory;
use super::timeline::{NONE, Timeline, state};
use super::together::{Halt, LastFlow, Together};
use crate::observe::accounts::Accounts;
use crate::observe::event_log::EventLog;
use crate::observe::ledger::Ledger;
use crate::observe::report::{Events, ImpactReport};
use crate::warm_start::WarmStart;
use carom_geometry::Geometry;
use carom_math::Rotation;

/// Bodies for each in a set below which all pairs are gone through for those of the set, and not each body's own.
const MANY: usize = 8;

/// What islands that meet bring along.
pub(super) struct Met<S: Geometry> {
    pub movers: Vec<usize>,
    /// What their last flows tell of their contacts, and the forces then; `None` where none has had one.
    pub memory: Option<(Memory, WarmStart<S>)>,
    pub events: usize,
    pub stops: usize,
}

impl<'a, S: Geometry> Timeline<'a, '_, S> {
    /// True when two bodies touch at a moment of their ways.
    fn touch_at(
        &self,
        a: usize,
        b: usize,
        moment: f64,
        points: &mut Vec<carom_geometry::ContactPoint<S>>,
    ) -> bool {
        let (da, db) = (&self.bodies.data[a], &self.bodies.data[b]);
        let (Some(ca), Some(cb)) = (&da.collider, &db.collider) else { return false };
        points.clear();
        let place = |i: usize| {
            let s = self.ways[i].at(moment);
            let center = s.rotation.rotate(self.bodies.data[i].mass_properties.center);
            carom_math::Pose::new(s.position - center, s.rotation)
        };
        S::contacts(ca, &place(a), cb, &place(b), self.common.limits.touching(da, db), points);
        !points.is_empty()
    }

    /// Movable bodies that are at a moment, and the obstacles near them, as a set of their own.
    pub(super) fn gather(&mut self, movers: &[usize], moment: f64) -> Together<'a, S> {
        let candidates = self.common.candidates;
        let mut members = movers.to_vec();
        for &i in movers {
            for &p in candidates.of_body(i) {
                let (a, b) = candidates.pairs[p];
                members.extend([a, b].into_iter().filter(|&k| !self.bodies.is_dynamic(k)));
            }
            for &number in self.bodies.joints.of_body(i) {
                let j = &self.bodies.joints.all[number];
                members
                    .extend([Some(j.a), j.b].into_iter().flatten().filter(|&k| !self.bodies.is_dynamic(k)));
            }
        }
        members.sort_unstable();
        members.dedup();
        for (slot, &i) in members.iter().enumerate() {
            self.slots[i] = slot;
        }
        let is_here = |&p: &usize| {
            let (a, b) = candidates.pairs[p];
            self.slots[a] != NONE && self.slots[b] != NONE
        };
        let pairs: Vec<usize> = if MANY * movers.len() > self.bodies.len() {
            let mut pairs = Vec::with_capacity(candidates.pairs.len());
            pairs.extend((0..candidates.pairs.len()).filter(is_here));
            pairs
        } else {
            let all = movers.iter().flat_map(|&i| candidates.of_body(i)).copied();
            let mut pairs: Vec<usize> = all.filter(is_here).collect();
            pairs.sort_unstable();
            pairs.dedup();
            pairs
        };
        let local = |p: &usize| {
            let (a, b) = candidates.pairs[*p];
            (self.slots[a], self.slots[b])
        };
        let pairs: Vec<(usize, usize)> = pairs.iter().map(local).collect();
        for &i in &members {
            self.slots[i] = NONE;
        }
        let mut own = self.bodies.some(&members);
        for (k, &i) in members.iter().enumerate() {
            if !self.bodies.is_dynamic(i) {
                let s = self.ways[i].at(moment);
                (own.motion.position[k], own.motion.rotation[k]) = (s.position, s.rotation);
            }
        }
        let common = self.common;
        let accounts = Accounts::new(members.len(), common.keeps_accounts);
        Together {
            settings: common.settings,
            bodies: own,
            pairs,
            wrenches: members.iter().map(|&i| common.wrenches[i]).collect(),
            reaches: members.iter().map(|&i| self.reaches[i]).collect(),
            members,
            limits: &common.limits,
            time: common.time,
            moment,
            moved: 0.0,
            ledger: Ledger::default(),
            accounts,
            joints: Vec::new(),
            events: Events::default(),
            log: EventLog::default(),
            struck: ImpactReport::default(),
            memory: None,
            due: None,
            warm: common.warm,
            forces: None,
            last: LastFlow::default(),
            worst: [None, None],
            points: Vec::new(),
            joint_names: &common.joint_names,
        }
    }

    /// An island brought to a moment of its flow.
    pub(super) fn at_moment(&mut self, k: usize, moment: f64) -> Result<Together<'a, S>, Halt> {
        let island = self.islands[k].take().expect("an island in use");
        let movers: Vec<usize> =
            island.members.iter().copied().filter(|&i| self.bodies.is_dynamic(i)).collect();
        let mut at = self.gather(&movers, island.begin);
        at.bodies.motion.copy_from(&island.start);
        at.memory.clone_from(&island.before);
        let done = if moment >= island.until {
            at.bodies.motion.copy_from(&island.end);
            at.ledger = island.ledger;
            at.accounts.clone_from(&island.accounts);
            at.joints.clone_from(&island.joints);
            at.worst[0].clone_from(&island.worst);
            at.memory.clone_from(&island.memory);
            at.forces.clone_from(&island.forces);
            at.last = island.last.clone();
            Ok(())
        } else if moment > island.begin {
            at.forces.clone_from(&island.forces);
            let active = &island.active;
            at.flow(moment - island.begin, active, island.stick, &mut self.tools).map(|_| ())
        } else {
            Ok(())
        };
        self.islands[k] = Some(island);
        done.map(|()| at)
    }

    /// Takes islands, and those that touch them at a moment, out of the timeline; their bodies are at the moment then.
    pub(super) fn bring(
        &mut self,
        moment: f64,
        islands: &[usize],
        mut ready: Vec<(usize, Together<'a, S>)>,
    ) -> Result<Met<S>, Halt> {
        let mut met = Met { movers: Vec::new(), memory: None, events: 0, stops: 0 };
        let mut waiting: Vec<usize> = islands.to_vec();
        if let Some(tape) = &mut self.tools.tape {
            tape.meet(moment);
        }
        while let Some(k) = waiting.pop() {
            if self.islands[k].is_none() {
                continue;
            }
            let mut at = match ready.iter().position(|r| r.0 == k) {
                Some(r) => ready.swap_remove(r).1,
                None => self.at_moment(k, moment)?,
            };
            self.tell_flow(k, &at, moment);
            self.keep(&mut at);
            self.check_reach(&at.members, &at.bodies.motion, moment)?;
            let island = self.islands[k].take().expect("an island in use");
            let stopped = usize::from(island.stopping && moment >= island.until);
            self.events.slip_stops += stopped;
            met.events = met.events.max(island.events + 1);
            met.stops = met.stops.max(island.stops + stopped);
            if let Some(mine) = at.memory {
                let (memory, forces) = met.memory.get_or_insert_with(Default::default);
                memory.take_over(mine);
                forces.take_over(at.forces.unwrap_or_default(), Memory::default());
            }
            let movers: Vec<usize> = at.members.into_iter().filter(|&i| self.bodies.is_dynamic(i)).collect();
            for &i in &movers {
                // from here on it is where it is: its neighbours must see it there
                let s = state(&self.bodies.motion, i);
                self.ways[i] = Way::between(moment, moment, &s, &s, 0.0);
            }
            self.touching_islands(&movers, moment, &mut waiting)?;
            met.movers.extend(movers);
        }
        met.movers.sort_unstable();
        if let Some(tape) = &mut self.tools.tape {
            tape.met(&met.movers);
        }
        if let Some((memory, forces)) = &mut met.memory {
            memory.sort();
            forces.sort();
        }
        Ok(met)
    }

    /// Appends the islands of bodies that touch some of these at a moment.
    fn touching_islands(
        &mut self,
        movers: &[usize],
        moment: f64,
        waiting: &mut Vec<usize>,
    ) -> Result<(), Halt> {
        let candidates = self.common.candidates;
        let mut points = Vec::new();
        for &i in movers {
            for &p in candidates.of_body(i) {
                let (a, b) = candidates.pairs[p];
                let other = if a == i { b } else { a };
                if self.bodies.is_dynamic(other)
                    && self.islands[self.island_of[other]].is_some()
                    && self.touch_at(a, b, moment, &mut points)
                {
                    self.set_apart(other)?;
                    waiting.push(self.island_of[other]);
                }
            }
        }
        Ok(())
    }
}
