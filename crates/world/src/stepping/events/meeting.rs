//! The very moment of an arrival. Ways of bodies in contact are only near to the flows that are then taken: the moment
//! is corrected until the gap closes on the flows themselves, and stepped back where another pair of the same islands
//! met before.

use super::arrival::State;
use super::tape::Cause;
use super::timeline::{NONE, Timeline, state};
use super::together::{Halt, Together};
use crate::contact_id::contact_id;
use carom_geometry::{ContactPoint, Geometry};
use carom_math::{Column, Pose, Rotation};

/// Corrections of an arrival's moment.
const CORRECTIONS: usize = 12;

/// A contact that approaches at a moment.
#[derive(Clone, Copy)]
struct Approach {
    pair: (usize, usize),
    id: u64,
    gap: f64,
    speed: f64,
}

impl<'a, S: Geometry> Timeline<'a, '_, S> {
    /// A contact is due: finds the very moment at which its gap closes on the islands' own flows, and lets them meet.
    pub fn arrive(&mut self, due: f64, pair: usize, id: u64) -> Result<(), Halt> {
        self.events.arrivals += 1;
        let mut pair = self.common.candidates.pairs[pair];
        let mut id = id;
        let mut islands = self.islands_of(pair, Vec::new())?;
        let (mut moment, mut ready) = (due, Vec::new());
        let mut late = due; // the earliest moment seen at which the pair had met
        for round in 0..CORRECTIONS {
            ready.clear();
            if islands.iter().all(|&k| self.flies(k)) {
                break; // the way was exact
            }
            for &k in &islands {
                ready.push((k, self.at_moment(k, moment)?));
            }
            let states = self.states(&ready);
            let found = self.of_pair(pair, id, moment, &states);
            let next = match found {
                Some(c) if c.gap.abs() > self.common.limits.arrived => {
                    late = if c.gap < 0.0 { moment } else { late };
                    moment - c.gap / c.speed
                }
                // a straight line led back to where it is still far
                None if moment < late => 0.5 * (moment + late),
                // a contact that slowly turned round comes back later than a straight line says
                None if round == 0 || moment != due => due,
                _ => match self.earliest_overlap(&ready, moment, &states) {
                    Some(c) => {
                        (pair, id) = (c.pair, c.id);
                        islands = self.islands_of(pair, islands)?;
                        late = moment;
                        moment - c.gap / c.speed
                    }
                    None => moment,
                },
            };
            let latest = islands.iter().map(|&k| self.island(k).until).fold(f64::INFINITY, f64::min);
            let begun = islands.iter().map(|&k| self.island(k).begin).fold(0.0, f64::max);
            let next = next.clamp(begun, latest);
            if next == moment {
                break;
            }
            ready.clear();
            moment = next;
        }
        self.because(Cause::Arrival(pair, id));
        self.meet(moment, &islands, ready, Some(pair))
    }

    /// The islands of a pair's movable bodies, added to others.
    fn islands_of(&mut self, (a, b): (usize, usize), mut islands: Vec<usize>) -> Result<Vec<usize>, Halt> {
        for i in [a, b] {
            self.set_apart(i)?;
            islands.extend(Some(self.island_of[i]).filter(|&k| k != NONE));
        }
        islands.sort_unstable();
        islands.dedup();
        Ok(islands)
    }

    /// True for islands whose ways are exact: without contacts, and nothing that tumbles.
    fn flies(&self, k: usize) -> bool {
        let island = self.island(k);
        let steady = |&i: &usize| !self.bodies.is_dynamic(i) || self.bodies.data[i].turning_arm == 0.0;
        let jointed = |&i: &usize| !self.bodies.joints.of_body(i).is_empty();
        island.active.touches.is_empty()
            && !island.members.iter().any(jointed)
            && island.members.iter().all(steady)
    }

    /// Where the movable bodies of islands are that have been brought to a moment, by index.
    fn states(&self, ready: &[(usize, Together<'a, S>)]) -> Vec<(usize, State<S>)> {
        let mut states: Vec<(usize, State<S>)> = Vec::new();
        for (_, at) in ready {
            let movers = at.members.iter().enumerate().filter(|(_, i)| self.bodies.is_dynamic(**i));
            states.extend(movers.map(|(k, &i)| (i, state(&at.bodies.motion, k))));
        }
        states.sort_unstable_by_key(|s| s.0);
        states
    }

    /// Contacts of a pair at a moment that approach faster than noise, and their names.
    fn approaching(
        &self,
        (a, b): (usize, usize),
        moment: f64,
        states: &[(usize, State<S>)],
        margin: f64,
        visit: &mut dyn FnMut(Approach),
    ) {
        let of = |i: usize| match states.binary_search_by_key(&i, |s| s.0) {
            Ok(k) => states[k].1,
            Err(_) => self.ways[i].at(moment),
        };
        let (sa, sb) = (of(a), of(b));
        let data = &self.bodies.data;
        let (Some(ca), Some(cb)) = (&data[a].collider, &data[b].collider) else { return };
        let place = |i: usize, s: &State<S>| {
            let center = s.rotation.rotate(data[i].mass_properties.center);
            Pose::new(s.position - center, s.rotation)
        };
        let mut points: Vec<ContactPoint<S>> = Vec::new();
        S::contacts(ca, &place(a, &sa), cb, &place(b, &sb), margin, &mut points);
        for p in &points {
            let velocity = |s: &State<S>| s.velocity + S::swing(s.spin, p.point - s.position);
            let speed = p.normal.dot(velocity(&sa) - velocity(&sb));
            if speed < -self.common.limits.still_speed {
                let id = contact_id(data[a].serial, data[b].serial, p.feature);
                visit(Approach { pair: (a, b), id, gap: p.gap, speed });
            }
        }
    }

    /// The approaching contact of a pair that is meant, or else the one of least gap; `None` when none approaches.
    fn of_pair(
        &self,
        pair: (usize, usize),
        id: u64,
        moment: f64,
        states: &[(usize, State<S>)],
    ) -> Option<Approach> {
        let data = &self.bodies.data;
        let margin = self.common.limits.touching(&data[pair.0], &data[pair.1]);
        let mut best: Option<Approach> = None;
        self.approaching(pair, moment, states, margin, &mut |c| {
            let better = |b: &Approach| (c.id == id, -c.gap) > (b.id == id, -b.gap);
            if best.as_ref().is_none_or(better) {
                best = Some(c);
            }
        });
        best
    }

    /// Of the islands' contacts that are not active and overlap at a moment, the one that has for longest.
    fn earliest_overlap(
        &self,
        ready: &[(usize, Together<'a, S>)],
        moment: f64,
        states: &[(usize, State<S>)],
    ) -> Option<Approach> {
        let candidates = self.common.candidates;
        let mut first: Option<Approach> = None;
        for (k, at) in ready {
            let active = &self.island(*k).active.names;
            for &i in at.members.iter().filter(|&&i| self.bodies.is_dynamic(i)) {
                for &p in candidates.of_body(i) {
                    self.approaching(candidates.pairs[p], moment, states, 0.0, &mut |c| {
                        let late = c.gap < -4.0 * self.common.limits.arrived;
                        let longer = first.as_ref().is_none_or(|f| c.gap / c.speed > f.gap / f.speed);
                        if late && longer && active.binary_search(&c.id).is_err() {
                            first = Some(c);
                        }
                    });
                }
            }
        }
        first
    }
}
