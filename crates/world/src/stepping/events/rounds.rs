//! The rounds of a flow: where contacts hold depends on the velocities, and these on where contacts hold. A round takes
//! the contacts at the mean places that the last one led to, solves there, and finds the velocities of the next. Rounds
//! before the last are solved only as well as their places are known. Each cluster of bodies takes the rounds that it
//! needs, and no more when contacts are added elsewhere.

use super::clusters::{Cluster, Clusters, LeftOut, Part};
use super::contacts::Active;
use super::flow::Stick;
use super::joints::{self, Held};
use super::together::{Halt, LastFlow, Together, Tools};
use crate::bodies::Motion;
use crate::contact_id::contact_id;
use crate::narrow_phase::Touch;
use crate::settings::PlasticArrivals;
use carom_geometry::{ContactPoint, Geometry};
use carom_math::Column;
use carom_solver::{Contact, ContactProblem, Impulse, Twist};

/// Most rounds between places and velocities of balls: where they squeeze past each other, each leaves half the error of
/// the one before, or more.
const MOST: usize = 100;
/// The same where corners and edges take part: features that come and go may never agree.
const MOST_ON_CORNERS: usize = 12;
/// Rounds after which a change as small as solves leave it will do; corners and edges in heaps need none.
const LONG: usize = 12;
/// In heaps, the error of places over the least so far above which a round of corners and edges has come no nearer \[1\].
const NEARER: f64 = 0.3;
/// Rounds there without coming nearer after which the next is the last.
const STALLED: usize = 2;
/// Rounds of balls in heaps after which it shows who presses.
const SHOWN: usize = 2;
/// Change of a normal that the rounds of balls may leave when there were enough; a flow that leaves more is too long \[1\].
const LOOSE: f64 = 1e-9;
/// Change of a unit normal below which the round is the last \[1\].
pub(super) const SAME_NORMAL: f64 = 3e-15;
/// Change of a contact's arms below which the round is the last, over the body's size \[1\].
pub(super) const SAME_ARM: f64 = 1e-13;
/// Residual of a round that is not the last, over what the change of the contacts' normals makes of the velocities.
const SHARE: f64 = 1e-2;
/// Cosine below which a contact of the same name counts as another one \[1\].
pub(super) const ONE_SIDE: f64 = 0.7;

/// Where a contact is, and which way it faces.
#[derive(Clone, Copy)]
pub(super) struct Place<S: Geometry> {
    /// The contact point.
    pub point: S::Vector,
    /// Its unit normal.
    pub normal: S::Vector,
}

impl<S: Geometry> Place<S> {
    fn of(t: &Touch<S>) -> Self {
        Place { point: t.point, normal: t.normal }
    }
    fn give(&self, t: &mut Touch<S>) {
        (t.point, t.normal) = (self.point, self.normal);
    }
}

/// A flow in the making.
pub struct Rounds<S: Geometry> {
    /// Its length \[s\].
    pub time: f64,
    /// Its contacts.
    pub active: Active<S>,
    stick: Stick,
    /// Where the bodies were.
    pub start: Motion<S>,
    /// Normal velocities of the contacts at the start \[m/s\].
    pub approaches: Vec<f64>,
    /// Velocities half turned, without and with the loads, and those that the last round ends with.
    pub before: Vec<Twist<S>>,
    free: Vec<Twist<S>>,
    /// The last.
    pub after: Vec<Twist<S>>,
    /// The contacts at the middle.
    pub touches: Vec<Touch<S>>,
    /// Memory for where the last round leads them.
    places: Vec<Place<S>>,
    targets: Vec<f64>,
    /// Problem and impulses of the last round.
    pub last: LastFlow<S>,
    /// What of the problem is solved by itself, once that is not all of it.
    part: Option<Part<S>>,
    /// The joints through the rounds.
    pub held: Held<S>,
    /// True where there are joints.
    pub jointed: bool,
    /// What the contacts join, and how far that is.
    pub clusters: Clusters,
    /// True before the first round.
    first: bool,
    /// True where balls squeeze past each other in so long a flow that their places did not come out.
    pub is_loose: bool,
}

impl Cluster {
    /// Most rounds that it may take.
    fn most(&self, jointed: bool) -> usize {
        match (jointed, self.angular) {
            (true, _) => joints::ROUNDS,
            (false, true) => MOST_ON_CORNERS,
            (false, false) => MOST,
        }
    }

    /// True where the round to come ends its rounds: it has taken many, or features that come and go keep its places from
    /// coming nearer.
    fn is_last_to_take(&self, jointed: bool) -> bool {
        let stalls = !jointed && self.angular && self.stalled >= STALLED;
        stalls || self.taken + 1 >= self.most(jointed)
    }

    /// Takes in the error of its places that a round came to, over what may be.
    fn watch(&mut self, error: f64) {
        if let Some(least) = self.least {
            self.stalled = if error > NEARER * least { self.stalled + 1 } else { 0 };
        }
        self.least = Some(self.least.map_or(error, |least| least.min(error)));
    }
}

impl<S: Geometry> Together<'_, S> {
    /// Begins the rounds of a flow; bodies turn to its middle.
    pub fn begin_rounds(&mut self, time: f64, active: Active<S>, stick: Stick) -> Rounds<S> {
        let start = self.bodies.motion.clone();
        self.turn(0.5 * time);
        let before = self.twists();
        let free = self.loaded(&before, time);
        let mut last = LastFlow { time, stick, ..std::mem::take(&mut self.last) };
        // bodies are at the middle of their turn: inverse masses stand through the rounds
        self.begin_problem(&mut last.problem, stick, &before, &free);
        last.closing.clear();
        // the impulses of a flow much like this one
        let known = std::mem::take(&mut last.impulses);
        let after = self.first_guess(&active.touches, &before, &free);
        let jointed = !self.bodies.joints.is_empty();
        let mut rounds = Rounds {
            time,
            active: Active::none(),
            stick,
            start,
            approaches: Vec::new(),
            before,
            free,
            after,
            touches: Vec::new(),
            places: Vec::new(),
            targets: Vec::new(),
            last,
            part: None,
            held: Held::new(&self.bodies.joints),
            jointed,
            clusters: Clusters::new(self.bodies.len(), jointed),
            first: true,
            is_loose: false,
        };
        self.take_in(&mut rounds, active);
        if known.contacts.len() == rounds.active.touches.len() {
            rounds.last.impulses = known;
        }
        rounds
    }

    /// Adds contacts that come in unseen, as they were where the flow began: what they join begins its rounds anew, from
    /// where it is.
    pub fn add_coming(&mut self, rounds: &mut Rounds<S>, coming: Vec<Touch<S>>) {
        let mut more = Active::none();
        more.expect(coming, rounds.time);
        self.take_in(rounds, more);
    }

    fn take_in(&mut self, rounds: &mut Rounds<S>, new: Active<S>) {
        let known = rounds.active.touches.len();
        rounds.active.add(new);
        let (touches, closing) = (&rounds.active.touches[known..], &rounds.active.closing[known..]);
        rounds.approaches.reserve(touches.len());
        rounds.targets.reserve(touches.len());
        rounds.last.closing.reserve(touches.len());
        rounds.last.impulses.contacts.reserve(touches.len());
        rounds.touches.reserve(touches.len());
        for (t, closing) in touches.iter().zip(closing) {
            let velocity = |i: usize| rounds.start.twist(i).at(t.point - rounds.start.position[i]);
            rounds.approaches.push(t.normal.dot(velocity(t.a) - velocity(t.b)));
            rounds.targets.push(-2.0 * closing);
            rounds.last.closing.push(*closing);
            rounds.last.impulses.contacts.push(Impulse::default());
            rounds.touches.push(*t);
        }
        let moves = |i: usize| self.bodies.is_dynamic(i);
        rounds.clusters.join(&rounds.active.touches, moves);
        let (closing, corners) = (&rounds.active.closing, self.turning_corners(&rounds.active.touches));
        for (k, corner) in corners.into_iter().enumerate() {
            let cluster = rounds.clusters.of_contact_mut(k);
            cluster.angular |= corner;
            cluster.corners |= corner && closing[k] > 0.0;
        }
    }

    /// Where contacts hold, bodies keep the velocities they have; others take those of their loads.
    fn first_guess(&self, active: &[Touch<S>], before: &[Twist<S>], free: &[Twist<S>]) -> Vec<Twist<S>> {
        let mut after = free.to_vec();
        for t in active {
            (after[t.a], after[t.b]) = (before[t.a], before[t.b]);
        }
        for j in &self.bodies.joints.all {
            after[j.a] = before[j.a];
            j.b.inspect(|&b| after[b] = before[b]);
        }
        after
    }

    /// Takes places, problem and impulses from what a larger set, given by its members, solved last; bodies are at the
    /// flow's middle then.
    pub fn take_over(&mut self, rounds: &mut Rounds<S>, members: &[usize], whole: &LastFlow<S>) {
        let Rounds { last, touches, .. } = rounds;
        touches.clear();
        last.impulses.contacts.clear();
        self.begin_problem(&mut last.problem, rounds.stick, &rounds.before, &rounds.free);
        let mut resistances = whole.problem.resistances.iter().zip(&whole.impulses.moments).peekable();
        let slot = |i: usize| self.members.binary_search(&members[i]).ok();
        for (k, (c, t)) in whole.problem.contacts.iter().zip(&whole.touches).enumerate() {
            let moment = resistances.next_if(|(r, _)| r.contact == k).map(|(_, moment)| *moment);
            let (Some(a), Some(b)) = (slot(c.a), slot(c.b)) else { continue };
            touches.push(Touch { a, b, ..*t });
            last.problem.contacts.push(Contact { a, b, ..*c });
            last.impulses.contacts.push(whole.impulses.contacts[k]);
            if let Some(moment) = moment {
                crate::assembly::resist(&mut last.problem, t);
                last.impulses.moments.push(moment);
            }
        }
        rounds.first = false;
        rounds.after.clone_from(&rounds.free);
        last.problem.apply(&last.impulses, &mut rounds.after);
        self.bring_to_middle(rounds);
    }

    /// Takes rounds until places and velocities agree, or there were enough.
    pub fn take_rounds(&mut self, rounds: &mut Rounds<S>, tools: &mut Tools<S>) -> Result<(), Halt> {
        while !self.round(rounds, tools)? {}
        Ok(())
    }

    /// Takes a round; true when all is settled.
    pub fn round(&mut self, rounds: &mut Rounds<S>, tools: &mut Tools<S>) -> Result<bool, Halt> {
        let jointed = rounds.jointed;
        for cluster in rounds.clusters.all.iter_mut().filter(|c| !c.settled && c.is_last) {
            cluster.settled = true;
            rounds.is_loose |= !jointed && !cluster.angular && cluster.change * SAME_NORMAL > LOOSE;
        }
        let settled = rounds.clusters.are_settled();
        if settled && !rounds.first {
            return Ok(true);
        }
        self.bring_to_middle(rounds);
        if settled {
            // nothing acts
            rounds.first = false;
            self.assemble(rounds);
            return Ok(true);
        }
        self.look_at_mean(rounds);
        let joints_settled = !rounds.jointed || self.joints_settled(&mut rounds.held);
        self.settle(rounds, joints_settled);
        rounds.places.iter().zip(&mut rounds.touches).for_each(|(place, t)| place.give(t));
        self.look_at_left_out(rounds);
        if rounds.clusters.are_settled() {
            return Ok(true); // the same arms, at the places that came out
        }
        self.leave_out(rounds);
        for cluster in rounds.clusters.all.iter_mut().filter(|c| !c.settled) {
            cluster.is_last = cluster.is_last_to_take(jointed);
            let enough = cluster.is_last || jointed;
            cluster.tolerance = if enough { 0.0 } else { self.tolerance_of(cluster, rounds.time) };
            cluster.tolerance = cluster.tolerance.max(self.limits.tolerance);
            cluster.taken += 1;
        }
        self.solve_round(rounds, tools)?;
        rounds.after.clone_from(&rounds.free);
        rounds.last.problem.apply(&rounds.last.impulses, &mut rounds.after);
        if rounds.jointed {
            self.aim(&mut rounds.held, &rounds.start.position, (&rounds.before, &rounds.after), rounds.time);
        }
        if rounds.clusters.all.iter().any(|c| c.corners && !c.settled) {
            self.correct_gaps(rounds);
        }
        Ok(false)
    }

    /// Puts the bodies half-way between the start and where the last round leads.
    fn bring_to_middle(&mut self, rounds: &Rounds<S>) {
        for i in 0..self.bodies.len() {
            let mean = (rounds.before[i].linear + rounds.after[i].linear) * 0.5;
            self.bodies.motion.position[i] = rounds.start.position[i] + mean * (0.5 * rounds.time);
        }
    }

    /// Finds how much each cluster's contacts have changed, and which clusters need no more rounds.
    fn settle(&self, rounds: &mut Rounds<S>, joints_settled: bool) {
        let clusters = &mut rounds.clusters;
        clusters.all.iter_mut().filter(|c| !c.settled).for_each(|c| c.change = 0.0);
        for (k, new) in rounds.places.iter().enumerate() {
            let is_out = clusters.is_out(k);
            let cluster = clusters.of_contact_mut(k);
            if cluster.settled || is_out {
                continue;
            }
            let change = if cluster.taken == 0 {
                // how far the normals turn on the way says how far off guessed ones may be
                (rounds.active.touches[k].normal - new.normal).norm() / SAME_NORMAL
            } else {
                self.change(&rounds.touches[k], new, &rounds.last.problem.contacts[k])
            };
            cluster.change = cluster.change.max(change);
        }
        let smallest = self.movers().map(|i| self.bodies.data[i].extent).fold(f64::INFINITY, f64::min);
        let (noise, kept) = (self.noise(rounds.time, smallest), self.limits.kept_of(smallest));
        let is_heap = self.settings.events.plastic_arrivals == PlasticArrivals::WithinTheStep;
        for c in &mut rounds.clusters.all {
            let as_asked = c.taken > 0 && c.tolerance <= self.limits.tolerance;
            let in_heap = is_heap && c.angular;
            let enough = if in_heap || c.taken >= LONG { noise } else { 1.0 };
            c.settled |= as_asked && c.off == 0.0 && joints_settled && c.change <= enough;
            if in_heap && c.taken > 0 {
                c.watch((c.change / enough).max(c.off / kept));
            }
        }
    }

    /// What the residual that solves may leave makes of the change of normals over a flow, for the smallest body's size
    /// \[m\], over what may be \[1\]: no sequence comes to less but by chance.
    fn noise(&self, time: f64, smallest: f64) -> f64 {
        (self.limits.tolerance * time / (smallest * SAME_NORMAL)).max(1.0)
    }

    /// How well a cluster's round need be solved \[m/s\].
    fn tolerance_of(&self, cluster: &Cluster, time: f64) -> f64 {
        let turned = cluster.change.min(1.0 / SAME_NORMAL) * SAME_NORMAL * self.limits.fastest;
        SHARE * turned.max(cluster.off / time)
    }

    /// Assembles the contacts of clusters that are not settled, and solves there.
    fn solve_round(&mut self, rounds: &mut Rounds<S>, tools: &mut Tools<S>) -> Result<(), Halt> {
        self.assemble(rounds);
        if rounds.jointed {
            self.hold(&rounds.held, &rounds.before, rounds.stick, &mut rounds.last.problem);
        }
        let last = &mut rounds.last;
        last.impulses.rows.resize(last.problem.rows.len(), 0.0);
        last.impulses.moments.resize(last.problem.resistances.len(), S::Spin::ZERO);
        if std::mem::take(&mut rounds.first) && self.settings.events.warm_start {
            self.forces.as_ref().unwrap_or(self.warm).load(&last.problem, rounds.time, &mut last.impulses);
        }
        self.solve_clusters(&mut rounds.clusters, (last, &mut rounds.part), tools)
    }

    /// Looks where the gaps of closing contacts come to, and corrects their targets.
    fn correct_gaps(&mut self, rounds: &mut Rounds<S>) {
        let mean = self.bodies.motion.clone();
        let (before, after) = (rounds.before.as_slice(), rounds.after.as_slice());
        self.bring_to_end(&rounds.start.position, before, after, rounds.time);
        let Rounds { active, clusters, targets, last, .. } = rounds;
        let asked = |k: usize| {
            let cluster = clusters.of_contact(k);
            active.closing[k] > 0.0 && cluster.corners && !cluster.settled
        };
        let gaps = self.gaps_of(&active.touches, &asked);
        self.bodies.motion.copy_from(&mean);
        let asked = (active.touches.as_slice(), active.closing.as_slice(), gaps.as_slice());
        let off = self.keep_gaps(&last.problem, (before, after), asked, rounds.time, targets);
        clusters.set_off(&off);
    }

    /// Finds the places of the contacts of clusters that are not settled where the bodies are now, by name; those that are
    /// gone are carried along, and those that are left out stay where they were.
    fn look_at_mean(&mut self, rounds: &mut Rounds<S>) {
        let mut found = std::mem::take(&mut rounds.places);
        found.clear();
        found.extend(rounds.touches.iter().map(Place::of));
        let mut k = 0;
        for pair in rounds.active.touches.chunk_by(|s, t| (s.a, s.b) == (t.a, t.b)) {
            let first = k;
            k += pair.len();
            if rounds.clusters.of_contact(first).settled || (first..k).all(|k| rounds.clusters.is_out(k)) {
                continue;
            }
            self.find_again(pair, &rounds.start.position, &mut found[first..k]);
        }
        rounds.places = found;
    }

    /// The places of the contacts of a pair where its bodies are now.
    fn find_again(&mut self, pair: &[Touch<S>], origin: &[S::Vector], found: &mut [Place<S>]) {
        let (a, b) = (pair[0].a, pair[0].b);
        let near_by = self.limits.touching(&self.bodies.data[a], &self.bodies.data[b]);
        let margin = 4.0 * near_by + self.reaches[a] + self.reaches[b];
        self.find_points((a, b), margin);
        let serials = (self.bodies.data[a].serial, self.bodies.data[b].serial);
        let name = |p: &ContactPoint<S>| contact_id(serials.0, serials.1, p.feature);
        for (t, found) in pair.iter().zip(found) {
            let is_again = |p: &&ContactPoint<S>| p.normal.dot(t.normal) > ONE_SIDE && name(p) == t.id;
            *found = match self.points.iter().find(is_again) {
                Some(p) => Place { point: p.point, normal: p.normal },
                None => Place { point: t.point + self.carried(t, origin), normal: t.normal },
            };
        }
    }

    /// Leaves contacts that do not press out of the rounds of balls in heaps once it shows who presses. A cluster's last round is one of all its contacts.
    fn leave_out(&self, rounds: &mut Rounds<S>) {
        let is_heap = self.settings.events.plastic_arrivals == PlasticArrivals::WithinTheStep;
        let Rounds { clusters, last, jointed, .. } = rounds;
        for k in 0..clusters.all.len() {
            let c = &mut clusters.all[k];
            if c.settled || c.angular || *jointed || !is_heap {
                continue;
            }
            if c.is_last_to_take(*jointed) {
                c.left_out = LeftOut::NoMore;
                clusters.take_back();
            } else if c.left_out == LeftOut::NotYet && c.taken >= SHOWN {
                clusters.leave_out(k, &last.impulses.contacts);
            }
        }
    }

    /// Looks at the contacts that clusters have left out whose places are known: where one of them was to press, the rounds
    /// go on with all.
    fn look_at_left_out(&mut self, rounds: &mut Rounds<S>) {
        let is_known = |c: &Cluster| c.settled && c.left_out == LeftOut::Now;
        if !rounds.clusters.all.iter().any(is_known) {
            return;
        }
        let mut called = Vec::new();
        for k in 0..rounds.touches.len() {
            if !rounds.clusters.is_out(k) || !is_known(rounds.clusters.of_contact(k)) {
                continue;
            }
            let mut place = Place::of(&rounds.touches[k]);
            let pair = &rounds.active.touches[k..=k];
            self.find_again(pair, &rounds.start.position, std::slice::from_mut(&mut place));
            place.give(&mut rounds.touches[k]);
            let contact = self.contact_of(rounds, &rounds.touches[k], k);
            let mut velocity = contact.normal_velocity(&rounds.after);
            if rounds.stick == Stick::Mean {
                velocity += contact.normal_velocity(&rounds.before);
            }
            rounds.last.problem.contacts[k] = contact;
            let off = contact.target - velocity;
            rounds.clusters.leaves(k, off.max(0.0));
            // false for NaN
            let is_within = off <= self.limits.tolerance;
            if !is_within {
                called.push(k);
            }
        }
        for c in rounds.clusters.all.iter_mut().filter(|c| is_known(c)) {
            c.left_out = LeftOut::NoMore;
        }
        rounds.clusters.take_back();
        for k in called {
            rounds.clusters.of_contact_mut(k).settled = false;
        }
    }

    /// A contact of the problem, from where it is found.
    fn contact_of(&self, rounds: &Rounds<S>, t: &Touch<S>, k: usize) -> Contact<S> {
        let mut contact = crate::assembly::contact(&self.bodies, t, rounds.targets[k]);
        if rounds.stick == Stick::End {
            contact.target -= contact.normal_velocity(&rounds.before);
        }
        contact
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

    /// How much a contact's frame and arms differ from those that the problem was solved with, over what may be.
    fn change(&self, old: &Touch<S>, new: &Place<S>, solved: &Contact<S>) -> f64 {
        let size = self.bodies.data[old.a].extent.min(self.bodies.data[old.b].extent);
        let arm = |i: usize, was: S::Vector| {
            let moves = self.bodies.is_dynamic(i);
            if moves { (new.point - self.bodies.motion.position[i] - was).norm() } else { 0.0 }
        };
        let arms = arm(old.a, solved.arm_a).max(arm(old.b, solved.arm_b)) / (SAME_ARM * size);
        ((old.normal - new.normal).norm() / SAME_NORMAL).max(arms)
    }

    /// Empties a problem and fills in the velocities that it has without impulses.
    fn begin_problem(
        &self,
        problem: &mut ContactProblem<S>,
        stick: Stick,
        before: &[Twist<S>],
        free: &[Twist<S>],
    ) {
        crate::assembly::begin(problem, &self.bodies, self.settings.friction_law);
        problem.velocities.clear();
        problem.velocities.extend_from_slice(free);
        if stick == Stick::Mean {
            for (v, b) in problem.velocities.iter_mut().zip(before) {
                v.add_scaled(b, 1.0);
            }
        }
    }

    /// Writes the problem anew where clusters are not settled.
    fn assemble(&self, rounds: &mut Rounds<S>) {
        let mut contacts = std::mem::take(&mut rounds.last.problem.contacts);
        contacts.reserve(rounds.touches.len().saturating_sub(contacts.len()));
        for (k, t) in rounds.touches.iter().enumerate() {
            let is_known = k < contacts.len();
            if is_known && (rounds.clusters.of_contact(k).settled || rounds.clusters.is_out(k)) {
                continue;
            }
            let contact = self.contact_of(rounds, t, k);
            if is_known {
                contacts[k] = contact;
            } else {
                contacts.push(contact);
            }
        }
        let problem = &mut rounds.last.problem;
        problem.contacts = contacts;
        problem.rows.clear();
        problem.resistances.clear();
        for (k, t) in rounds.touches.iter().enumerate() {
            crate::assembly::resist_at(problem, k, t);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn taken(rounds: usize, angular: bool) -> Cluster {
        let mut cluster = Cluster::default();
        (cluster.taken, cluster.angular) = (rounds, angular);
        cluster
    }

    fn after(errors: &[f64], angular: bool) -> Cluster {
        let mut cluster = taken(0, angular);
        for error in errors {
            cluster.watch(*error);
            cluster.taken += 1;
        }
        cluster
    }

    #[test]
    fn corners_that_come_no_nearer_take_one_more_round_and_balls_all_they_may() {
        let (nearer, stalls) = ([1e6, 1e4, 1e2], [1e6, 4e5, 5e5]);
        assert!(!after(&nearer, true).is_last_to_take(false));
        assert!(after(&stalls, true).is_last_to_take(false));
        // one round that came no nearer is not enough, nor are two with one between that did
        assert!(!after(&stalls[..2], true).is_last_to_take(false));
        assert!(!after(&[1e6, 4e5, 1e4, 9e3], true).is_last_to_take(false));
        // rounds of balls leave a share each, those of joints fall in every other one
        assert!(!after(&stalls, false).is_last_to_take(false));
        assert!(!after(&stalls, true).is_last_to_take(true));
    }

    #[test]
    fn rounds_end_by_their_number_at_last() {
        assert!(!taken(MOST_ON_CORNERS - 2, true).is_last_to_take(false));
        assert!(taken(MOST_ON_CORNERS - 1, true).is_last_to_take(false));
        assert!(!taken(MOST - 2, false).is_last_to_take(false));
        assert!(taken(MOST - 1, false).is_last_to_take(false));
        assert!(!taken(joints::ROUNDS - 2, true).is_last_to_take(true));
        assert!(taken(joints::ROUNDS - 1, true).is_last_to_take(true));
    }
}
