//! Who may be halted in the soft step ahead, and when. Bodies that fly one behind another do not approach each other until the first
//! of them is halted; then all meet within the same step. Contacts of what flies behind are looked for where, and as far as, that
//! takes it (theory 11.8).

use crate::abreast::One;
use crate::ahead::{SWIFT, closing};
use crate::meeting::{Meeting, time_to};
use carom_geometry::{ContactPoint, Geometry};
use carom_math::{Column, Space};

/// Bodies of which one is larger by this factor meet where their boxes do not, as balls and drums do.
const ALIKE: f64 = 4.0;
/// How often times are handed on through all pairs: halts run along rows of bodies, mostly in the order of the pairs.
const ROUNDS: usize = 8;

/// Two bodies that fly together.
struct Together {
    places: [usize; 2],
    /// How long each takes to where the other is \[s\]; infinite where it does not come there.
    takes: [f64; 2],
}

/// When bodies are halted; holds memory, nothing that changes an answer.
#[derive(Default)]
pub(crate) struct Halting<S: Space> {
    /// By places in the columns \[s\].
    times: Vec<f64>,
    together: Vec<Together>,
    points: Vec<ContactPoint<S>>,
}

impl<S: Geometry> Halting<S> {
    /// Finds it out from all pairs that may touch; `look` appends the contact points of the pair at a place up to a gap \[m\]. The times
    /// by places in the columns \[s\], infinite of what nothing halts in the step, and whether anything is; none where nothing is swift.
    pub fn find(
        &mut self,
        meeting: &Meeting<'_, S>,
        pairs: &[(u32, u32)],
        look: impl Fn(usize, f64, &mut Vec<ContactPoint<S>>),
    ) -> Option<(bool, &[f64])> {
        if !meeting.columns.somebody_halts {
            return None;
        }
        self.times.clear();
        self.times.resize(meeting.columns.halts.len(), f64::INFINITY);
        self.together.clear();
        for (place, pair) in pairs.iter().enumerate() {
            self.ask(meeting, *pair, |gap, points| look(place, gap, points));
        }
        let somebody_halts = self.times.iter().any(|t| *t < meeting.dt);
        if somebody_halts {
            self.hand_on(meeting.dt);
        }
        Some((somebody_halts, &self.times))
    }

    /// Asks a pair whether they hit each other, or fly together.
    #[inline]
    fn ask(
        &mut self,
        meeting: &Meeting<'_, S>,
        (i, j): (u32, u32),
        look: impl Fn(f64, &mut Vec<ContactPoint<S>>),
    ) {
        let places = [i as usize, j as usize];
        let swift = places.map(|k| meeting.columns.halts[k] == 0.0);
        if swift == [false; 2] {
            return;
        }
        let Some(margin) = meeting.may((i, j)) else { return };
        let hit = hit(meeting, (i, j), margin, (&mut self.points, look));
        for (place, swift) in places.into_iter().zip(swift) {
            if swift && hit < self.times[place] {
                self.times[place] = hit;
            }
        }
        if swift == [true; 2] {
            let [a, b] = places.map(|k| &meeting.columns.bounds[k]);
            let [one, other] = places.map(|k| meeting.columns.movers[k].twist.linear);
            let takes = [time_to(a, b, one, margin), time_to(b, a, other, margin)];
            if takes[0].min(takes[1]) < meeting.dt {
                self.together.push(Together { places, takes });
            }
        }
    }

    /// What is halted halts what comes to it in the rest of the step.
    fn hand_on(&mut self, dt: f64) {
        for round in 0..ROUNDS {
            let mut changed = false;
            let times = &mut self.times;
            let mut hand = |pair: &Together| {
                let [i, j] = pair.places;
                if times[i].min(times[j]) >= dt {
                    return;
                }
                let later = [times[j] + pair.takes[0], times[i] + pair.takes[1]];
                for (k, later) in pair.places.into_iter().zip(later) {
                    if later < dt && later < times[k] {
                        times[k] = later;
                        changed = true;
                    }
                }
            };
            if round % 2 == 0 {
                self.together.iter().for_each(&mut hand)
            } else {
                self.together.iter().rev().for_each(&mut hand)
            }
            if !changed {
                return;
            }
        }
    }
}

/// When a pair hits each other \[s\]; infinite where it does not in the step, or so slowly that it does not matter.
#[inline]
fn hit<S: Geometry>(
    meeting: &Meeting<'_, S>,
    (i, j): (u32, u32),
    margin: f64,
    (points, look): (&mut Vec<ContactPoint<S>>, impl Fn(f64, &mut Vec<ContactPoint<S>>)),
) -> f64 {
    let (i, j, dt) = (i as usize, j as usize, meeting.dt);
    let [a, b] = [i, j].map(|k| &meeting.columns.bounds[k]);
    let couple = meeting.couple(i, j);
    let [small, large] = couple.by_size();
    let (passing, are_alike) =
        (couple.a.twist.linear - couple.b.twist.linear, large.extent <= ALIKE * small.extent);
    let far = SWIFT[S::DIM - 2] * small.extent;
    if are_alike && passing.norm_squared() * (dt * dt) < far * far {
        return f64::INFINITY;
    }
    // as `approach` has it, so that who hits is looked at
    let speed = closing(One(&[small, large]));
    if speed * dt < far || a.apart(b) + margin > speed * dt {
        return f64::INFINITY;
    }
    if are_alike {
        return time_to(a, b, passing, margin);
    }
    points.clear();
    look(speed * dt, points);
    points.iter().fold(f64::INFINITY, |first, p| first.min(p.gap.max(0.0) / speed))
}
