//! How a step ends: all islands are taken over and overlaps projected away; or, where events do not end, the rest of
//! the step is taken at once for all that may meet. A body that has left its reach ends the attempt where
//! it may have met one that nobody looked at.

use super::arrival::{Search, Way};
use super::candidates::MARGIN;
use super::contacts::Active;
use super::flow::Stick;
use super::tape::Gap;
use super::timeline::{Island, OVER, Timeline, state};
use super::together::Halt;
use crate::bodies::Motion;
use carom_geometry::Geometry;
use carom_math::{Column, Pose, Rotation};

impl<S: Geometry> Timeline<'_, '_, S> {
    /// Brings all bodies that some may meet, directly or through others, to a moment; gives all of them.
    fn bring_reachable(&mut self, moment: f64, movers: &[usize]) -> Result<Vec<usize>, Halt> {
        let candidates = self.common.candidates;
        let mut all = movers.to_vec();
        let mut inside = vec![false; self.bodies.len()];
        movers.iter().for_each(|&i| inside[i] = true);
        let mut next = 0;
        while next < all.len() {
            let i = all[next];
            next += 1;
            let mut near: Vec<usize> = Vec::new();
            self.set_apart(i)?;
            let k = self.island_of[i];
            if self.islands[k].is_some() {
                let mut at = self.at_moment(k, moment)?;
                self.keep(&mut at);
                self.islands[k] = None;
                near.extend(at.members);
            }
            for &p in candidates.of_body(i) {
                let (a, b) = candidates.pairs[p];
                near.extend([a, b]);
            }
            for m in near {
                if self.bodies.is_dynamic(m) && !std::mem::replace(&mut inside[m], true) {
                    all.push(m);
                }
            }
        }
        all.sort_unstable();
        Ok(all)
    }

    /// Takes the rest of the step at once for all bodies that some may meet.
    pub fn cut_short(&mut self, moment: f64, movers: &[usize]) -> Result<(), Halt> {
        let candidates = self.common.candidates;
        let all = self.bring_reachable(moment, movers)?;
        self.tell_gap(true, Gap::CutShort, &all);
        let mut at = self.gather(&all, moment);
        let start = at.bodies.motion.clone();
        at.fall_back(self.common.limits.dt - moment, &mut self.tools)?;
        self.hold_reach(&at.members, &at.bodies.motion)?;
        let dt = self.common.limits.dt;
        let number = self.islands.len();
        for (k, &i) in at.members.iter().enumerate() {
            if self.bodies.is_dynamic(i) {
                let (s, e) = (state(&start, k), state(&at.bodies.motion, k));
                self.ways[i] = Way::between(moment, dt, &s, &e, 0.0);
                self.island_of[i] = number;
                for &p in candidates.of_body(i) {
                    self.versions[p] += 1;
                }
            }
        }
        self.events.add(&at.events);
        self.log.append(&at.log, 0.0, |i| at.members[i]);
        self.events.capped += 1;
        let [worst, _] = at.worst;
        self.islands.push(Some(Island {
            begin: moment,
            until: dt,
            start,
            end: at.bodies.motion,
            members: at.members,
            active: Active::none(),
            stick: Stick::Mean,
            before: None,
            ledger: at.ledger,
            accounts: at.accounts,
            joints: at.joints,
            worst,
            forces: None,
            memory: at.memory,
            last: at.last,
            events: 0,
            stops: 0,
            stopping: false,
            islands: 1,
            complete: false,
        }));
        Ok(())
    }

    /// All islands are at the step's end: overlaps are removed, and everything is taken over.
    pub fn finish(&mut self) -> Result<(), Halt> {
        for k in 0..self.islands.len() {
            let end = self.common.limits.dt;
            let Some(island) = self.islands[k].take() else { continue };
            // nothing but the books is left to be done for it; joints and the tape ask for the whole set
            if island.until <= end && self.bodies.joints.is_empty() && self.tools.tape.is_none() {
                self.check_reach(&island.members, &island.end, end)?;
                self.islands[k] = Some(self.keep_end(island));
                continue;
            }
            self.islands[k] = Some(island);
            let mut at = self.at_moment(k, end)?;
            self.check_reach(&at.members, &at.bodies.motion, end)?;
            if let Some(tape) = &mut self.tools.tape {
                tape.meet(end);
            }
            self.tell_flow(k, &at, end);
            self.keep(&mut at);
        }
        let movers: Vec<usize> = self.bodies.dynamic().collect();
        let mut deep = vec![false; self.bodies.len()];
        self.overlapping(&mut deep);
        if deep.contains(&true) || self.bodies.torn() > self.common.limits.torn() {
            let mut at = self.gather(&movers, self.common.limits.dt);
            let moved = at.project(None, &mut self.tools)?;
            self.tell_gap(moved, Gap::Projected, &movers);
            self.keep(&mut at);
        }
        Ok(())
    }

    /// Marks the bodies that overlap beyond the limits at the step's end.
    fn overlapping(&self, deep: &mut [bool]) {
        let mut points = Vec::new();
        let end = self.common.limits.dt;
        for &(a, b) in &self.common.candidates.pairs {
            if self.alone.has(a) || self.alone.has(b) {
                continue; // seen to
            }
            let (da, db) = (&self.bodies.data[a], &self.bodies.data[b]);
            let (Some(ca), Some(cb)) = (&da.collider, &db.collider) else { continue };
            points.clear();
            let place = |i: usize| {
                if self.bodies.is_dynamic(i) {
                    return self.bodies.shape_pose(i);
                }
                let s = self.ways[i].at(end);
                Pose::new(s.position, s.rotation)
            };
            S::contacts(ca, &place(a), cb, &place(b), 0.0, &mut points);
            if points.iter().any(|p| -p.gap > self.common.limits.overlap(da, db)) {
                (deep[a], deep[b]) = (true, true);
            }
        }
    }

    /// Looks at bodies that have left their reaches: they get larger ones, unless these bring a body that they may have
    /// met by this moment, or may yet meet. Then the step cannot go on.
    pub fn check_reach(&mut self, members: &[usize], motion: &Motion<S>, moment: f64) -> Result<(), Halt> {
        let mut met = Vec::new();
        for (i, way) in self.outgrown(members, motion) {
            self.reaches[i] = MARGIN * way;
            let (reaches, first) = (&self.reaches, self.common.reaches);
            let newcomers = self.common.candidates.newcomers(self.bodies, i, |j| reaches[j] - first[j]);
            if newcomers.into_iter().any(|j| self.may_meet(i, j, moment)) {
                met.push((i, way));
            }
        }
        if met.is_empty() { Ok(()) } else { Err(Halt::Outgrown(met)) }
    }

    /// Refuses to go on when bodies have left their reaches, where nothing but their reaches told what they may meet.
    fn hold_reach(&self, members: &[usize], motion: &Motion<S>) -> Result<(), Halt> {
        let outgrown = self.outgrown(members, motion);
        if outgrown.is_empty() { Ok(()) } else { Err(Halt::Outgrown(outgrown)) }
    }

    /// Bodies that have left their reaches (by index in the world), and how far they came \[m\].
    fn outgrown(&self, members: &[usize], m: &Motion<S>) -> Vec<(usize, f64)> {
        let origin = self.common.origin;
        let mut outgrown = Vec::new();
        for (k, &i) in members.iter().enumerate() {
            let d = &self.bodies.data[i];
            if d.collider.is_none() || !self.bodies.is_dynamic(i) {
                continue;
            }
            let mut way = (m.position[k] - origin.position[i]).norm();
            if d.turning_arm > 0.0 && m.rotation[k] != origin.rotation[i] {
                let turn = origin.rotation[i].inverse().then(&m.rotation[k]).vector().norm();
                way += d.turning_arm * turn;
            }
            if way > self.reaches[i] + self.common.limits.touching(d, d) {
                outgrown.push((i, way));
            }
        }
        outgrown
    }

    /// True for two bodies, no candidates, that have met by a moment or may meet after it: not where the step is over and
    /// their ways, one flow from its start, kept them apart.
    fn may_meet(&mut self, a: usize, b: usize, moment: f64) -> bool {
        let dt = self.common.limits.dt;
        let is_whole = |i: usize| self.ways[i].begin == 0.0 && self.ways[i].until >= dt * (1.0 - OVER);
        if moment < dt || !is_whole(a) || !is_whole(b) {
            return true;
        }
        let pair = (a.min(b), a.max(b));
        let (bodies, ways, limits) = (&*self.bodies, self.ways.as_slice(), &self.common.limits);
        let search = Search { pair, from: 0.0, until: dt, bodies, ways, limits, ignored: &[] };
        self.tools.arrivals.first(&search).is_some()
    }
}
