//! How a step ends: all islands are taken over and overlaps projected away; or, where events do not end, the rest of
//! the step is taken at once for all that may meet. A body that has left its reach ends the attempt.

use super::arrival::Way;
use super::contacts::Active;
use super::flow::Stick;
use super::tape::Gap;
use super::timeline::{Island, Timeline, state};
use super::together::{Halt, Together};
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
                let at = self.at_moment(k, moment)?;
                self.keep(&at);
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
        self.check_reach(&at)?;
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
            if self.islands[k].is_some() {
                let end = self.common.limits.dt;
                let at = self.at_moment(k, end)?;
                self.check_reach(&at)?;
                if let Some(tape) = &mut self.tools.tape {
                    tape.meet(end);
                }
                self.tell_flow(k, &at, end);
                self.keep(&at);
            }
        }
        let movers: Vec<usize> = (0..self.bodies.len()).filter(|&i| self.bodies.is_dynamic(i)).collect();
        let mut deep = vec![false; self.bodies.len()];
        self.overlapping(&mut deep);
        if deep.contains(&true) || self.bodies.torn() > self.common.limits.torn() {
            let mut at = self.gather(&movers, self.common.limits.dt);
            let moved = at.project(&mut self.tools)?;
            self.tell_gap(moved, Gap::Projected, &movers);
            self.keep(&at);
        }
        Ok(())
    }

    /// Marks the bodies that overlap beyond the limits at the step's end.
    fn overlapping(&self, deep: &mut [bool]) {
        let mut points = Vec::new();
        let end = self.common.limits.dt;
        for &(a, b) in &self.common.candidates.pairs {
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

    /// Refuses to go on when bodies have left their reaches.
    pub fn check_reach(&self, at: &Together<S>) -> Result<(), Halt> {
        let (m, origin) = (&at.bodies.motion, &self.common.origin);
        let mut outgrown = Vec::new();
        for (k, &i) in at.members.iter().enumerate() {
            let d = &self.bodies.data[i];
            if d.collider.is_none() || !self.bodies.is_dynamic(i) {
                continue;
            }
            let mut way = (m.position[k] - origin.position[i]).norm();
            if d.turning_arm > 0.0 && m.rotation[k] != origin.rotation[i] {
                let turn = origin.rotation[i].inverse().then(&m.rotation[k]).vector().norm();
                way += d.turning_arm * turn;
            }
            if way > self.common.reaches[i] + self.common.limits.touching(d, d) {
                outgrown.push((i, way));
            }
        }
        if outgrown.is_empty() { Ok(()) } else { Err(Halt::Outgrown(outgrown)) }
    }
}
