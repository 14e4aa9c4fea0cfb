//! Pairs that last. Pairs are looked for in boxes somewhat larger than those that bodies need, and stand while every body stays
//! in its own; who asks holds each pair's present boxes against each other. It decides nothing but the work: the pairs
//! whose boxes overlap are the same, in the same order. Where pairs do not last, nothing is made larger for a while.

use crate::remembered::{Remembered, hand_on};
use carom_geometry::Aabb;
use carom_geometry::broad_phase::{BroadPhase, Changed, Sift};
use carom_math::{Space, Workers};

/// What boxes are made larger by on each side, over the mean of the longest sides of those that move \[1\].
const ROOM: f64 = 0.05;
/// Pairs that stood for fewer steps than this did not last.
const SOME: u32 = 4;
/// Searches without room after pairs that did not last.
const PAUSE: u32 = 16;

/// Boxes that a worker looks at at a time.
const BOXES: usize = 512;

/// Pairs, and the boxes that they were looked for in.
#[derive(Default)]
pub(crate) struct Lasting<S: Space> {
    boxes: Vec<Aabb<S>>,
    pairs: Vec<(u32, u32)>,
    /// What the narrow phase remembers of each pair, and room for what it will.
    remembered: Vec<Remembered>,
    room: Vec<Remembered>,
    /// Steps that the pairs stood for.
    lasted: u32,
    /// Searches to come that give no room.
    pause: u32,
    /// Counts the lists of pairs, and whether the last step left the list as it was.
    number: u64,
    stood: bool,
}

impl<S: Space> Lasting<S> {
    /// Whether the pairs of the last search stand for a step more; else they are to be searched for.
    pub fn stand(&mut self, bounds: &[Aabb<S>], changed: &Changed<'_>, workers: &Workers) -> bool {
        let stand = self.are_within(bounds, changed, workers);
        if stand {
            (self.lasted, self.stood) = (self.lasted + 1, true);
        }
        stand
    }

    /// All pairs of boxes that overlap or touch, one of them movable, and perhaps some that do not, in lexicographic order. Who may
    /// pair is asked by the caller at every step, for it may change while boxes stand; pairs that are not to last are only those
    /// that `sift` keeps.
    pub fn search(
        &mut self,
        broad: &mut BroadPhase<S>,
        (bounds, movable): (&[Aabb<S>], &[bool]),
        changed: Changed<'_>,
        sift: Sift<'_>,
        workers: &Workers,
    ) {
        if !self.boxes.is_empty() && self.lasted < SOME && self.pause == 0 {
            self.pause = PAUSE;
        }
        self.pause = self.pause.saturating_sub(1);
        self.lasted = 0;
        let room = if self.pause == 0 { ROOM * mean_side(bounds, movable, changed.others) } else { 0.0 };
        if !changed.stands_as_before || self.boxes.len() != bounds.len() {
            self.boxes.clear();
            self.boxes.extend_from_slice(bounds);
        }
        for k in changed.asleep.iter().map(|k| *k as usize) {
            self.boxes[k] = bounds[k];
        }
        for k in changed.others.iter().map(|k| *k as usize) {
            self.boxes[k] = if bounds[k].is_finite() { bounds[k].grown(room) } else { bounds[k] };
        }
        // of pairs for this step alone most need not be put in order and kept
        let sift = if self.pause == 0 { &|_: &mut Vec<(u32, u32)>| () } else { sift };
        let pairs = broad.update_some((&self.boxes, movable), changed, sift, workers);
        self.stood = self.pairs == pairs && self.remembered.len() == pairs.len();
        if self.stood {
            return;
        }
        hand_on((&self.pairs, &mut self.remembered), pairs, &mut self.room, workers);
        self.pairs.clear();
        self.pairs.extend_from_slice(pairs);
        self.number += 1;
    }

    /// The pairs, and what is remembered of each.
    pub fn pairs(&self) -> (&[(u32, u32)], &[Remembered]) {
        (&self.pairs, &self.remembered)
    }

    /// The number of the list: one number, one list.
    pub fn number(&self) -> u64 {
        self.number
    }

    /// Whether the last step left the list as it was.
    pub fn stood(&self) -> bool {
        self.stood
    }

    /// Whether everybody is in the box that it was looked for in.
    fn are_within(&self, bounds: &[Aabb<S>], changed: &Changed<'_>, workers: &Workers) -> bool {
        let within = |k: &u32| self.boxes[*k as usize].contains(&bounds[*k as usize]);
        changed.stands_as_before
            && changed.sleeps_as_before
            && self.pause == 0
            && self.boxes.len() == bounds.len()
            && workers.all(changed.others, BOXES, within)
    }

    /// Forgets the pairs.
    pub fn forget(&mut self) {
        self.boxes.clear();
        self.forget_looks();
    }

    /// Forgets what is remembered of pairs.
    pub fn forget_looks(&mut self) {
        self.remembered.clear();
    }
}

/// Mean of the longest sides of the movable ones among some boxes \[m\].
fn mean_side<S: Space>(bounds: &[Aabb<S>], movable: &[bool], some: &[u32]) -> f64 {
    let longest = |b: &Aabb<S>| (0..S::DIM).map(|k| b.max[k] - b.min[k]).fold(0.0, f64::max);
    let sides = some.iter().filter(|k| movable[**k as usize]).map(|k| longest(&bounds[*k as usize]));
    let (sum, count) = sides.filter(|side| side.is_finite()).fold((0.0, 0), |(s, n), side| (s + side, n + 1));
    sum / f64::from(count.max(1))
}

#[cfg(test)]
mod tests {
    use super::*;
    use carom_math::{Planar, vec2};

    #[test]
    fn pairs_that_last_are_those_of_a_search_at_every_step() {
        let (mut lasting, mut broad, mut anew) =
            (Lasting::default(), BroadPhase::<Planar>::new(), BroadPhase::<Planar>::new());
        let place = |k: usize, t: f64| {
            let k = k as f64;
            // slow ones in a row, and one that runs along it
            if k == 0.0 { vec2(40.0 * t, 0.3) } else { vec2(0.9 * k + 0.3 * (k + t).sin(), 0.0) }
        };
        let count = 60;
        let movable = vec![true; count];
        let every: Vec<u32> = (0..count as u32).collect();
        let (mut kept, mut single) = (0, 0);
        for step in 0..400 {
            // it stands still for the first half
            let t = if step < 200 { 0.001 * step as f64 } else { 0.02 * step as f64 };
            let bounds: Vec<Aabb<Planar>> = (0..count)
                .map(|k| {
                    let at = place(k, if k == 0 && step < 200 { 0.0 } else { t });
                    Aabb { min: at - vec2(0.5, 0.5), max: at + vec2(0.5, 0.5) }
                })
                .collect();
            let changed = Changed {
                others: &every,
                asleep: &[],
                stands_as_before: step > 0,
                sleeps_as_before: step > 0,
            };
            let may = |i: usize, j: usize| !(i + j).is_multiple_of(3);
            let sift = |pairs: &mut Vec<(u32, u32)>| pairs.retain(|p| may(p.0 as usize, p.1 as usize));
            let (number, old) = (lasting.number(), lasting.pairs().0.to_vec());
            if !lasting.stand(&bounds, &changed, &Workers::default()) {
                lasting.search(&mut broad, (&bounds, &movable), changed, &sift, &Workers::default());
            }
            let found = lasting.pairs().0;
            assert_eq!(number == lasting.number(), old == found && !found.is_empty());
            let met = |i: u32, j: u32| bounds[i as usize].overlaps(&bounds[j as usize]);
            let meet = |p: &&(u32, u32)| met(p.0, p.1) && may(p.0 as usize, p.1 as usize);
            let (all, found) = (found.len(), found.iter().filter(meet).copied().collect::<Vec<_>>());
            assert_eq!(found, anew.update(&bounds, &movable, &may), "step {step}");
            // pairs for one step are no more than those
            single += usize::from(lasting.pause > 0 && all == found.len());
            kept += usize::from(lasting.lasted > 0);
        }
        assert!(
            kept > 100 && single > 100,
            "{kept} steps without a search, {single} with pairs of their own"
        );
    }
}
