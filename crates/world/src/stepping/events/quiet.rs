//! How a step begins. Bodies that are alone are done with at once. Sets of bodies that touch and are struck at once get flows of their own; all others share one
//! flow, island beside island in one problem, for as long as nothing happens to them. Where something does, the shared
//! flow is broken up, and each island has the same flow for itself.

use super::contacts::Active;
use super::flow::Stick;
use super::tape::Gap;
use super::timeline::{Course, Island, Timeline, count_islands, longest_flow, longest_turn, split};
use super::together::{Halt, Together};
use crate::joint::mover;
use crate::narrow_phase::Touch;
use crate::settings::PlasticArrivals;
use carom_geometry::Geometry;
use carom_solver::Partition;

impl<'a, S: Geometry> Timeline<'a, '_, S> {
    /// Lays out the first flows.
    pub(super) fn begin(&mut self) -> Result<(), Halt> {
        let all = self.leave_alone();
        if all.is_empty() {
            return Ok(());
        }
        let mut at = self.gather(&all, 0.0);
        let touches = at.touches();
        let mut sets = self.touching_sets(&at, &touches);
        let mut loud = vec![false; self.bodies.len()];
        for t in &touches {
            if at.is_deep(t) || at.strikes(t) {
                let mover = if at.bodies.is_dynamic(t.a) { t.a } else { t.b };
                loud[sets.root(at.members[mover])] = true;
            }
        }
        // flows of jointed bodies take rounds of their own
        for joint in &self.bodies.joints.all {
            loud[sets.root(mover(self.bodies, joint))] = true;
        }
        let (mut struck, quiet): (Vec<usize>, Vec<usize>) = all.iter().partition(|&&i| loud[sets.root(i)]);
        struck.sort_by_key(|&i| (sets.root(i), i));
        let at_once = self.common.settings.events.plastic_arrivals == PlasticArrivals::WithinTheStep;
        let mut stands = true;
        for set in struck.chunk_by(|&i, &j| sets.root(i) == sets.root(j)) {
            let mut part = self.gather(set, 0.0);
            let known = between(&touches, &at.members, &part.members);
            let moved = part.project(Some(&known), &mut self.tools)?;
            self.tell_gap(moved, Gap::Projected, set);
            if at_once {
                let known = if moved { part.touches() } else { known };
                stands &= !moved;
                part.strike(&known, &mut self.tools)?;
                self.keep(&mut part);
            } else {
                self.lay_out(part, 0.0, 0, 0)?;
            }
        }
        if struck.is_empty() || at_once {
            if !struck.is_empty() {
                at.take_motion(&self.bodies.motion);
            }
            // blows change velocities alone
            let touches = if stands { touches } else { at.touches() };
            self.share(at, touches)?;
        } else if !quiet.is_empty() {
            let rest = self.gather(&quiet, 0.0);
            let touches = between(&touches, &at.members, &rest.members);
            self.share(rest, touches)?;
        }
        for (pair, &(a, b)) in self.common.candidates.pairs.iter().enumerate() {
            if !self.alone.has(a) && !self.alone.has(b) {
                self.foresee(pair, 0.0);
            }
        }
        Ok(())
    }

    /// Sets of bodies that touch; of all that may, where arrivals are to be dealt with together.
    fn touching_sets(&self, at: &Together<'a, S>, touches: &[Touch<S>]) -> Partition {
        let mut sets = Partition::default();
        sets.reset(self.bodies.len());
        let mut join = |a: usize, b: usize| {
            if self.bodies.is_dynamic(a) && self.bodies.is_dynamic(b) {
                sets.join(a, b);
            }
        };
        touches.iter().for_each(|t| join(at.members[t.a], at.members[t.b]));
        self.bodies.jointed().for_each(|(a, b)| join(a, b));
        if self.common.settings.events.plastic_arrivals == PlasticArrivals::WithinTheStep {
            self.common.candidates.pairs.iter().for_each(|&(a, b)| join(a, b));
        }
        sets
    }

    /// Lays out one flow for a set in which nothing strikes.
    fn share(&mut self, mut at: Together<'a, S>, touches: Vec<Touch<S>>) -> Result<(), Halt> {
        let dt = self.common.limits.dt;
        let at_once = self.common.settings.events.plastic_arrivals == PlasticArrivals::WithinTheStep;
        let coming = at.brake(&touches, dt, &mut self.tools)?;
        self.keep(&mut at);
        let mut active = at.persisting(&touches);
        active.expect(coming, dt);
        at.forget();
        let (before, start) = (at.memory.clone(), at.save());
        // who arrives to stay is in the flow, and asks for no ways between its ends
        let follows_ways = !at_once || at.may_bounce();
        let longest = if follows_ways { longest_flow(&at, &active) } else { longest_turn(&at) };
        if longest < dt {
            return self.lay_out_each(&at, &active, 0.0, 0, 0);
        }
        let mut complete = at_once;
        let mut stick = if at_once { Stick::End } else { Stick::Mean };
        if at_once {
            let begun = active.clone();
            let mut all = at.flow_with_all(dt, active, stick, &mut self.tools)?;
            if let Some(acted) = all.take_if(|_| at.ledger.friction > 0.0) {
                // where corners roll, the slip at the end is not what friction acts against; the mean slip is
                at.restore(&start);
                stick = Stick::Mean;
                all = at.flow_with_all(dt, acted, stick, &mut self.tools)?;
            }
            let Some(acted) = all else {
                at.restore(&start);
                return self.lay_out_each(&at, &begun, 0.0, 0, 0);
            };
            active = acted;
            let capped = std::mem::take(&mut at.events.capped);
            complete = capped == 0;
            self.events.capped += capped;
        } else {
            let comes_out = at.flow(dt, &active, stick, &mut self.tools)?;
            if !comes_out || at.turns_slips(&start, &active) {
                at.restore(&start);
                return self.lay_out_each(&at, &active, 0.0, 0, 0);
            }
        }
        let islands = count_islands(&at, &active);
        let (begin, time, until) = (0.0, dt, dt);
        let course = Course {
            begin,
            time,
            until,
            stick,
            before,
            events: 0,
            stops: 0,
            stopping: false,
            islands,
            complete,
        };
        self.enter(at, start, active, course);
        Ok(())
    }

    /// Lays out a flow for each island of a set at a moment.
    pub(super) fn lay_out_each(
        &mut self,
        at: &Together<'a, S>,
        active: &Active<S>,
        moment: f64,
        events: usize,
        stops: usize,
    ) -> Result<(), Halt> {
        for movers in &split(at, active) {
            let world: Vec<usize> = movers.iter().map(|&k| at.members[k]).collect();
            let mut part = self.gather(&world, moment);
            part.memory.clone_from(&at.memory);
            part.forces.clone_from(&at.forces);
            let mine = active.of(&at.members, &part.members);
            self.flow(part, mine, moment, events, stops)?;
        }
        Ok(())
    }

    /// Something happens to a body: if it shares its flow with other islands, each gets its own.
    pub(super) fn set_apart(&mut self, body: usize) -> Result<(), Halt> {
        let k = self.island_of[body];
        let shared = self.islands.get(k).and_then(Option::as_ref).is_some_and(|island| island.islands > 1);
        if !shared {
            return Ok(());
        }
        let island = self.islands[k].take().expect("an island in use");
        let movers: Vec<usize> =
            island.members.iter().copied().filter(|&i| self.bodies.is_dynamic(i)).collect();
        let at = self.gather(&movers, island.begin);
        if island.stick == Stick::Mean && !island.complete {
            self.part(&at, &island);
        } else {
            let mut at = at;
            at.memory.clone_from(&island.before);
            self.lay_out_each(&at, &island.active, island.begin, island.events, island.stops)?;
        }
        self.foresee_all(&movers, island.begin, None);
        Ok(())
    }

    /// Gives each island that shares a flow the same flow for itself: nothing in it depends on the others, so nothing is
    /// solved anew.
    fn part(&mut self, at: &Together<'a, S>, whole: &Island<S>) {
        for movers in &split(at, &whole.active) {
            let world: Vec<usize> = movers.iter().map(|&k| at.members[k]).collect();
            let mut part = self.gather(&world, whole.begin);
            part.memory.clone_from(&whole.before);
            part.worst[0] = whole.worst.as_ref().and_then(|report| report.of_bodies(&part.members));
            let start = part.save();
            let time = whole.until - whole.begin;
            let active = part.repeat(time, whole);
            let course = Course {
                begin: whole.begin,
                time,
                until: whole.until,
                stick: whole.stick,
                before: whole.before.clone(),
                events: whole.events,
                stops: whole.stops,
                stopping: false,
                islands: 1,
                complete: false,
            };
            self.enter(part, start, active, course);
        }
    }
}

/// Those of a set's contacts that are between a part of its bodies, in the part's indices; both are given by their members.
fn between<S: Geometry>(touches: &[Touch<S>], members: &[usize], part: &[usize]) -> Vec<Touch<S>> {
    let slots: Vec<Option<usize>> = members.iter().map(|i| part.binary_search(i).ok()).collect();
    let local = |t: &Touch<S>| Some(Touch { a: slots[t.a]?, b: slots[t.b]?, ..*t });
    let mut found = Vec::with_capacity(touches.len());
    found.extend(touches.iter().filter_map(local));
    found
}
