//! Plastic arrivals within the step (theory section 8.5), for heaps: a contact that will arrive before the flow's end,
//! and stays where it arrives, needs no moment of its own. A plastic impulse slows it where the flow begins,
//!   u_n+ >= -gap / tau,
//! and in the flow it holds ubar_n >= -gap / tau: the gap closes at the flow's end, and never more. Both take energy
//! and never give. What is given up is the moment: a body is slowed up to a flow's length too early.

use super::arrival::{Arrivals, Search, Way};
use super::contacts::Active;
use super::flow::Stick;
use super::push::Push;
use super::rounds::Rounds;
use super::timeline::{OVER, state};
use super::together::{Halt, Together, Tools};
use crate::bodies::Motion;
use crate::narrow_phase::{Touch, normal_velocity, restitution_of};
use crate::observe::accounts::Cause;
use crate::settings::PlasticArrivals;
use carom_geometry::Geometry;
use carom_math::Column;
use carom_solver::Twist;
use std::collections::BTreeSet;

/// Rounds of looking for contacts that come in once others are slowed.
const ROUNDS: usize = 8;
/// Times that one looks for contacts which come in unseen before a flow is taken as it comes.
const FLOW_ROUNDS: usize = 100;
/// Rounds of a flow after which one looks for contacts that come in: places are known to a thousandth of the way then.
const LOOK: usize = 2;
/// How near bodies with corners may be at a flow's end that come in with those that overlap there, over |g| tau^2 \[1\].
const NEAR: f64 = 1.0;
/// Overlap of bodies with corners at a flow's end, over |g| tau^2 \[1\], up to which a contact that did not act is left to
/// the next step, and the overlap to projection: features come and go, and each that came in would ask for all rounds anew.
const LEFT: f64 = 0.01;
/// How much nearer than freely bodies may come over |g| tau^2, where contacts hold one and not the other \[1\].
pub(super) const HELD: f64 = 1.0;

/// Plastic contacts that will arrive, and their names.
struct Ahead<S: Geometry> {
    touches: Vec<Touch<S>>,
    names: BTreeSet<u64>,
}

impl<S: Geometry> Default for Ahead<S> {
    fn default() -> Self {
        Ahead { touches: Vec::new(), names: BTreeSet::new() }
    }
}

/// The impulse that slows contacts to these normal velocities \[m/s\].
fn slowing<'a, S: Geometry>(
    touches: &'a [Touch<S>],
    targets: &'a [f64],
    velocities: &'a [Twist<S>],
) -> Push<'a, S> {
    Push { touches, targets, velocities, time: 0.0, cause: Cause::Impact }
}

/// How near bodies may be at the end of a flow in which they could fall so far \[m\] to come in with others, and how deep they
/// may overlap there without coming in, of those with corners and of balls; what has arrived overlaps by less than `arrived`.
fn bounds_at_end(has_corners: bool, fallen: f64, arrived: f64) -> (f64, f64) {
    if has_corners { (NEAR * fallen, (LEFT * fallen).max(arrived)) } else { (0.0, arrived) }
}

/// Normal velocity of a contact for given velocities of all bodies.
fn velocity_at<S: Geometry>(t: &Touch<S>, positions: &[S::Vector], twists: &[Twist<S>]) -> f64 {
    let at = |i: usize| twists[i].at(t.point - positions[i]);
    t.normal.dot(at(t.a) - at(t.b))
}

impl<S: Geometry> Together<'_, S> {
    /// Slows the plastic contacts that will arrive within the rest of the step \[s\]; gives all that will.
    pub fn brake(
        &mut self,
        touches: &[Touch<S>],
        rest: f64,
        tools: &mut Tools<S>,
    ) -> Result<Vec<Touch<S>>, Halt> {
        let at_their_moment = self.settings.events.plastic_arrivals == PlasticArrivals::AtTheirMoment;
        if at_their_moment || rest <= OVER * self.limits.dt {
            return Ok(Vec::new());
        }
        let holding = self.persisting(touches);
        let mut near = self.within_reach(&holding.touches);
        near.retain(|t| holding.names.binary_search(&t.id).is_err());
        let mut ahead = Ahead::default();
        let before = self.twists();
        let mut after = before.clone();
        let mut tried = None;
        for _ in 0..ROUNDS {
            let known = ahead.touches.len();
            self.coming(&near, &after, rest, &mut ahead);
            let too_fast = |t: &Touch<S>| {
                let now = velocity_at(t, &self.bodies.motion.position, &before);
                now < -t.gap.max(0.0) / rest - self.limits.still_speed
            };
            if ahead.touches.len() == known || !ahead.touches.iter().any(too_fast) {
                break;
            }
            // who comes in once these are slowed; the push itself is one, of all of them
            let (slowed, targets) = self.to_slow(touches, &ahead, rest);
            let push = slowing(&slowed, &targets, &before);
            let found = self.try_push(&push, tried.as_ref(), tools)?;
            after = found.after(&before);
            tried = Some(found);
        }
        if tried.is_some() {
            // nobody has come in since
            let (slowed, targets) = self.to_slow(touches, &ahead, rest);
            let push = slowing(&slowed, &targets, &before);
            self.push(&push, before.clone(), tried, tools)?;
            self.events.impacts += 1;
        }
        Ok(ahead.touches)
    }

    /// Moves the set by a flow of a length \[s\] with these contacts and all that come in unseen; gives them all, unless
    /// that is too long for places to come out. Where they never end, the flow is taken as it comes, and that is counted.
    pub fn flow_with_all(
        &mut self,
        time: f64,
        active: Active<S>,
        stick: Stick,
        tools: &mut Tools<S>,
    ) -> Result<Option<Active<S>>, Halt> {
        let mut rounds = self.begin_rounds(time, active, stick);
        let (mut seen, mut passed): (Vec<Twist<S>>, Vec<Twist<S>>) = (Vec::new(), Vec::new());
        for _ in 0..FLOW_ROUNDS {
            let mut settled = false;
            for _ in 0..LOOK {
                settled = settled || self.round(&mut rounds, tools)?;
            }
            let known = self.settled_pairs(&rounds.active.touches);
            let mut coming = self.overtaken(&rounds, &known, &mut seen);
            if coming.is_empty() && !settled {
                self.take_rounds(&mut rounds, tools)?;
                coming = self.overtaken(&rounds, &known, &mut seen);
            }
            if coming.is_empty() {
                coming = self.passing(&rounds, &known, &mut passed, tools.arrivals);
            }
            if coming.is_empty() {
                let is_loose = rounds.is_loose;
                return self.end_rounds(rounds).map(|active| (!is_loose).then_some(active));
            }
            self.add_coming(&mut rounds, coming);
        }
        self.take_rounds(&mut rounds, tools)?;
        self.events.capped += 1;
        self.end_rounds(rounds).map(Some)
    }

    /// Plastic contacts that do not act in a flow and overlap at its end, as they were where it began: features of
    /// turning bodies come and go, so they need not have been there. Of bodies that fare as they did when one last
    /// looked there is nothing new; `seen` holds how they did. Nor is there of pairs that are `known`.
    fn overtaken(&mut self, rounds: &Rounds<S>, known: &[bool], seen: &mut Vec<Twist<S>>) -> Vec<Touch<S>> {
        let Rounds { start, before, after, time, active, .. } = rounds;
        let middle = self.bodies.motion.clone();
        self.bring_to_end(&start.position, before, after, *time);
        let fallen = self.settings.gravity.norm() * time * time;
        let arrived = self.limits.arrived;
        let has_corners = |i: usize| self.bodies.data[i].turning_arm > 0.0;
        let corners: Vec<bool> = (0..self.bodies.len()).map(has_corners).collect();
        let bounds = |(a, b): (usize, usize)| bounds_at_end(corners[a] || corners[b], fallen, arrived);
        let fares_anew = |i: usize| seen.get(i) != Some(&after[i]);
        let mut found = Vec::new();
        for k in (0..self.pairs.len()).filter(|&k| !known[k]) {
            let (a, b) = self.pairs[k];
            if fares_anew(a) || fares_anew(b) {
                self.find((a, b), bounds((a, b)).0, &mut found);
            }
        }
        seen.clone_from(after);
        let missed = found.iter().filter(|t| {
            // what bounces has a moment of its own on the way, though it may be through the other body by the end
            let slow = self.limits.rest_speed_of(t.restitution).max(self.limits.still_speed);
            let plastic = t.restitution == 0.0 || normal_velocity(&self.bodies, t).abs() <= slow;
            plastic && active.names.binary_search(&t.id).is_err()
        });
        let missed: Vec<&Touch<S>> = missed.collect();
        // where some come in, others will once these are slowed
        let any = missed.iter().any(|t| t.gap < -bounds((t.a, t.b)).1);
        let missed = missed.into_iter().filter(|_| any);
        let missed = missed.map(|t| self.back_at_start(t, start, *time)).collect();
        self.bodies.motion.copy_from(&middle);
        missed
    }

    /// Plastic contacts that do not act in a flow, come in on its way and are gone by its end, as they were where it began:
    /// corners that dip into another body, and what would pass through a thin one. `passed` is as `seen` above.
    fn passing(
        &mut self,
        rounds: &Rounds<S>,
        known: &[bool],
        passed: &mut Vec<Twist<S>>,
        arrivals: &mut Arrivals<S>,
    ) -> Vec<Touch<S>> {
        let Rounds { start, before, after, time, active, .. } = rounds;
        let middle = self.bodies.motion.clone();
        self.bring_to_end(&start.position, before, after, *time);
        let end = &self.bodies.motion;
        let arm = |i: usize| self.bodies.data[i].turning_arm;
        let way = |i: usize| Way::between(0.0, *time, &state(start, i), &state(end, i), arm(i));
        let ways: Vec<Way<S>> = (0..self.bodies.len()).map(way).collect();
        let fares_anew = |i: usize| passed.get(i) != Some(&after[i]);
        let mut missed = Vec::new();
        for k in (0..self.pairs.len()).filter(|&k| !known[k]) {
            let (a, b) = self.pairs[k];
            if !(fares_anew(a) || fares_anew(b)) || restitution_of(&self.bodies, self.settings, (a, b)) > 0.0
            {
                continue;
            }
            let (bodies, limits, ignored) = (&self.bodies, self.limits, active.names.as_slice());
            let search =
                Search { pair: (a, b), from: 0.0, until: *time, bodies, ways: &ways, limits, ignored };
            if let Some((moment, id)) = arrivals.first(&search) {
                missed.extend(self.arriving((a, b), id, moment, (start, &ways)));
            }
        }
        passed.clone_from(after);
        self.bodies.motion.copy_from(&middle);
        missed
    }

    /// A contact that arrives at a moment of the bodies' ways, as it was where they began.
    fn arriving(
        &mut self,
        (a, b): (usize, usize),
        id: u64,
        moment: f64,
        (start, ways): (&Motion<S>, &[Way<S>]),
    ) -> Option<Touch<S>> {
        for i in [a, b] {
            let s = ways[i].at(moment);
            (self.bodies.motion.position[i], self.bodies.motion.rotation[i]) = (s.position, s.rotation);
            self.bodies.motion.set_twist(i, &Twist::new(s.velocity, s.spin));
        }
        let mut found = Vec::new();
        let margin = self.limits.touching(&self.bodies.data[a], &self.bodies.data[b]);
        self.find((a, b), margin, &mut found);
        found.iter().find(|t| t.id == id).map(|t| self.back_at_start(t, start, moment))
    }

    /// A contact at a flow's end as it was where the flow began, by the mean of the velocities there and here.
    fn back_at_start(&self, t: &Touch<S>, start: &Motion<S>, time: f64) -> Touch<S> {
        let way = |i: usize| {
            let arm = t.point - self.bodies.motion.position[i];
            (start.twist(i).at(arm) + self.bodies.motion.twist(i).at(arm)) * (0.5 * time)
        };
        let (way_a, way_b) = (way(t.a), way(t.b));
        // a feature that was not there had no gap; what a straight way back makes of it is none below zero
        let gap = (t.gap - t.normal.dot(way_a - way_b)).max(0.0);
        let back = match (self.bodies.is_dynamic(t.a), self.bodies.is_dynamic(t.b)) {
            (true, true) => (way_a + way_b) * 0.5,
            (true, false) => way_a,
            (false, _) => way_b,
        };
        Touch { gap, point: t.point - back, ..*t }
    }

    /// Appends the plastic contacts that close within a time \[s\] if bodies go on from these velocities freely.
    fn coming(&self, near: &[Touch<S>], twists: &[Twist<S>], time: f64, ahead: &mut Ahead<S>) {
        let free = self.loaded(twists, time);
        let held = HELD * self.settings.gravity.norm() * time * time;
        let position = &self.bodies.motion.position;
        for t in near {
            let (now, then) = (velocity_at(t, position, twists), velocity_at(t, position, &free));
            let plastic = t.restitution == 0.0 || then > -self.limits.rest_speed_of(t.restitution);
            if plastic && t.gap + 0.5 * (now + then) * time < held && ahead.names.insert(t.id) {
                ahead.touches.push(*t);
            }
        }
    }

    /// What is slowed, and to which normal velocities \[m/s\]: what touches does not come nearer, what is ahead no faster
    /// than its gap allows.
    fn to_slow(&self, touches: &[Touch<S>], ahead: &Ahead<S>, rest: f64) -> (Vec<Touch<S>>, Vec<f64>) {
        let most = touches.len() + ahead.touches.len();
        let (mut slowed, mut targets) = (Vec::with_capacity(most), Vec::with_capacity(most));
        for t in touches.iter().filter(|t| !ahead.names.contains(&t.id)) {
            slowed.push(*t);
            targets.push(normal_velocity(&self.bodies, t).min(0.0));
        }
        slowed.extend_from_slice(&ahead.touches);
        targets.extend(ahead.touches.iter().map(|t| -t.gap.max(0.0) / rest));
        (slowed, targets)
    }
}

impl<S: Geometry> Active<S> {
    /// Adds contacts that will arrive at the end of a flow of this length \[s\]; they have not pressed after it.
    pub fn expect(&mut self, ahead: Vec<Touch<S>>, time: f64) {
        if ahead.is_empty() {
            return;
        }
        for t in ahead {
            if self.names.binary_search(&t.id).is_err() {
                self.closing.push(t.gap.max(0.0) / time);
                self.fresh.push(t.id);
                self.touches.push(t);
            }
        }
        self.names.clear();
        self.names.extend(self.touches.iter().map(|t| t.id));
        self.names.sort_unstable();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn balls_come_in_as_soon_as_they_overlap_and_corners_by_a_share_of_the_fall() {
        let (fallen, arrived) = (9.81 * 0.01 * 0.01, 1e-12);
        assert_eq!(bounds_at_end(false, fallen, arrived), (0.0, arrived));
        let (near, left) = bounds_at_end(true, fallen, arrived);
        // who is nearer than a step's fall may come in with others, who overlaps by a hundredth of it comes in
        assert!((near - fallen).abs() < 1e-15 && (left - 0.01 * fallen).abs() < 1e-15);
        // steps so short that they fall by no more than what has arrived
        assert_eq!(bounds_at_end(true, arrived, arrived), (arrived, arrived));
    }
}
