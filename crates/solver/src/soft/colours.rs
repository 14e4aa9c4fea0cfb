//! Colours: no two patches of a colour share a body that moves, so all of a colour may be solved at once, in lanes or by
//! threads, and the sweep's order is that of the colours whatever the machine. Each patch takes the lowest colour free
//! at both bodies; patches with obstacles come first, which sweeps piles from the ground up. Groups have lists of their own.

use super::groups::Groups;
use std::ops::Range;

/// Which colours a body has seen; 64 colours serve all but hubs.
const COLOURS: usize = 64;

/// The lists of a group.
#[derive(Clone, Debug)]
pub struct Lists {
    /// All of them.
    pub all: Range<usize>,
    /// Lists up to this one are of patches with an obstacle.
    pub with_obstacles: usize,
    /// Lists from this one on hold one patch each: hubs with more neighbours than colours.
    pub alone: usize,
}

/// Patches by group and colour; each list is in the order the patches were given.
#[derive(Default)]
pub struct Colours {
    taken: Vec<[u64; 2]>,
    colour: Vec<u8>,
    /// Patches by group, and the end of each group's.
    by_group: (Vec<u32>, Vec<usize>),
    /// Where each list begins in `order`; the last entry is the end.
    pub starts: Vec<usize>,
    /// Indices of patches by group and colour.
    pub order: Vec<u32>,
    /// The lists of each group.
    pub groups: Vec<Lists>,
    /// What all that was found for: whom patches join, how many bodies are obstacles, and where groups begin.
    pairs: Vec<(u32, u32)>,
    obstacles: u32,
    bodies: Vec<Range<usize>>,
}

impl Colours {
    /// Paints patches between bodies (a, b), of which the first ones are obstacles. False where all stays as it was.
    pub fn paint(&mut self, groups: &Groups, pairs: &[(u32, u32)], obstacles: u32) -> bool {
        let stands = self.obstacles == obstacles && self.pairs == pairs;
        if stands && groups.records().eq(self.bodies.iter().cloned()) {
            return false;
        }
        self.obstacles = obstacles;
        self.pairs.clear();
        self.pairs.extend_from_slice(pairs);
        self.bodies.clear();
        self.bodies.extend(groups.records());
        self.colour.clear();
        self.colour.resize(pairs.len(), 0);
        self.taken.clear();
        self.taken.resize(self.bodies.last().map_or(0, |records| records.end), [0; 2]);
        self.order.clear();
        self.order.resize(pairs.len(), 0);
        self.starts.clear();
        self.starts.push(0);
        self.groups.clear();
        let (mut own, mut ends) = std::mem::take(&mut self.by_group);
        groups.sort(pairs, &mut own, &mut ends);
        let mut first = 0;
        for end in &ends {
            self.paint_group(&own[first..*end], pairs, |i| i < obstacles);
            first = *end;
        }
        self.by_group = (own, ends);
        true
    }

    /// Paints the patches of a group.
    fn paint_group(&mut self, own: &[u32], pairs: &[(u32, u32)], fixed: impl Fn(u32) -> bool) {
        let mut counts = [[0usize; COLOURS + 1]; 2];
        for &k in own {
            let (a, b) = pairs[k as usize];
            // patches with obstacles have colours of their own
            let (fixed_a, fixed_b) = (fixed(a), fixed(b));
            let kind = usize::from(!(fixed_a || fixed_b));
            let mask = |of: bool, i: u32| if of { 0 } else { self.taken[i as usize][kind] };
            let colour = (!(mask(fixed_a, a) | mask(fixed_b, b))).trailing_zeros() as usize;
            self.colour[k as usize] = colour as u8;
            counts[kind][colour] += 1;
            if colour < COLOURS {
                for (fixed, i) in [(fixed_a, a), (fixed_b, b)] {
                    if !fixed {
                        self.taken[i as usize][kind] |= 1 << colour;
                    }
                }
            }
        }
        self.list(own, pairs, fixed, &counts);
    }

    /// Whether patches of a list share obstacles at most.
    pub fn are_apart(&self) -> bool {
        let mut last = std::collections::HashMap::new();
        self.starts.windows(2).enumerate().all(|(list, ends)| {
            let patches = self.order[ends[0]..ends[1]].iter().map(|k| self.pairs[*k as usize]);
            let bodies = patches.flat_map(|(a, b)| [a, b]).filter(|i| *i >= self.obstacles);
            bodies.into_iter().all(|i| last.insert(i, list) != Some(list))
        })
    }

    /// Sorts patches of a group by kind and colour; of the hubs' every patch is a list.
    fn list(
        &mut self,
        own: &[u32],
        pairs: &[(u32, u32)],
        fixed: impl Fn(u32) -> bool,
        counts: &[[usize; COLOURS + 1]; 2],
    ) {
        let mut next = [[0usize; COLOURS + 1]; 2];
        let first = self.starts.len() - 1;
        let mut sum = self.starts[first];
        let mut with_obstacles = first;
        for kind in 0..2 {
            for colour in 0..COLOURS {
                next[kind][colour] = sum;
                if counts[kind][colour] > 0 {
                    sum += counts[kind][colour];
                    self.starts.push(sum);
                }
            }
            if kind == 0 {
                with_obstacles = self.starts.len() - 1;
            }
        }
        let alone = self.starts.len() - 1;
        for kind in 0..2 {
            next[kind][COLOURS] = sum;
            for _ in 0..counts[kind][COLOURS] {
                sum += 1;
                self.starts.push(sum);
            }
        }
        for &k in own {
            let (a, b) = pairs[k as usize];
            let kind = usize::from(!(fixed(a) || fixed(b)));
            let place = &mut next[kind][self.colour[k as usize] as usize];
            self.order[*place] = k;
            *place += 1;
        }
        self.groups.push(Lists { all: first..self.starts.len() - 1, with_obstacles, alone });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_two_patches_of_a_colour_share_a_body_that_moves() {
        // body 0 is the floor; 1 is a hub with more neighbours than colours
        let mut pairs: Vec<(u32, u32)> = (2..100).map(|i| (1, i)).collect();
        pairs.extend((1..100).map(|i| (0, i)));
        pairs.extend((2..99).map(|i| (i, i + 1)));
        let (mut colours, mut groups) = (Colours::default(), Groups::default());
        groups.make_one(100);
        assert!(colours.paint(&groups, &pairs, 1) && colours.are_apart());
        let mut seen = vec![false; pairs.len()];
        for window in colours.starts.windows(2) {
            let mut touched = [false; 100];
            for &k in &colours.order[window[0]..window[1]] {
                seen[k as usize] = true;
                let (a, b) = pairs[k as usize];
                for i in [a, b].into_iter().filter(|i| *i != 0) {
                    assert!(!std::mem::replace(&mut touched[i as usize], true));
                }
            }
        }
        assert!(seen.iter().all(|s| *s));
        let [lists] = colours.groups.as_slice() else { panic!("one group") };
        let of_obstacles = &colours.order[..colours.starts[lists.with_obstacles]];
        assert!(of_obstacles.iter().all(|k| pairs[*k as usize].0 == 0) && of_obstacles.len() == 99);
        assert!(lists.all == (0..colours.starts.len() - 1) && lists.all.end > lists.alone);
        assert!(!colours.paint(&groups, &pairs, 1), "the same patches stay as they are");
        assert!(colours.paint(&groups, &pairs[1..], 1));
    }
}
