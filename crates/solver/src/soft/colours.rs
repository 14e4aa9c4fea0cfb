//! Colours: no two patches of a colour share a body that moves, so all of a colour may be solved at once, in lanes or by
//! threads, and the sweep's order is that of the colours whatever the machine. Each patch takes the lowest colour free
//! at both bodies; patches with obstacles come first, which sweeps piles from the ground up.

/// Which colours a body has seen; 64 colours serve all but hubs.
const COLOURS: usize = 64;

/// Patches by colour; each list is in the order the patches were given.
#[derive(Default)]
pub struct Colours {
    taken: Vec<[u64; 2]>,
    colour: Vec<u8>,
    /// Where each list begins in `order`; the last entry is the end.
    pub starts: Vec<usize>,
    /// Indices of patches by colour.
    pub order: Vec<u32>,
    /// Lists up to this one are of patches with an obstacle.
    pub with_obstacles: usize,
    /// Lists from this one on hold one patch each: hubs with more neighbours than colours.
    pub alone: usize,
}

impl Colours {
    /// Paints patches between bodies (a, b); `fixed` tells obstacles.
    pub fn paint(&mut self, bodies: usize, pairs: &[(u32, u32)], fixed: impl Fn(u32) -> bool) {
        self.colour.clear();
        self.colour.resize(pairs.len(), 0);
        self.taken.clear();
        self.taken.resize(bodies, [0; 2]);
        let mut counts = [[0usize; COLOURS + 1]; 2];
        for (k, &(a, b)) in pairs.iter().enumerate() {
            // patches with obstacles have colours of their own
            let (fixed_a, fixed_b) = (fixed(a), fixed(b));
            let group = usize::from(!(fixed_a || fixed_b));
            let mask = |of: bool, i: u32| if of { 0 } else { self.taken[i as usize][group] };
            let colour = (!(mask(fixed_a, a) | mask(fixed_b, b))).trailing_zeros() as usize;
            self.colour[k] = colour as u8;
            counts[group][colour] += 1;
            if colour < COLOURS {
                for (fixed, i) in [(fixed_a, a), (fixed_b, b)] {
                    if !fixed {
                        self.taken[i as usize][group] |= 1 << colour;
                    }
                }
            }
        }
        self.list(pairs, &fixed, &counts);
    }

    /// Whether patches of a list share obstacles at most.
    pub fn are_apart(&self, pairs: &[(u32, u32)], fixed: impl Fn(u32) -> bool) -> bool {
        let mut last = std::collections::HashMap::new();
        self.starts.windows(2).enumerate().all(|(list, ends)| {
            let bodies =
                self.order[ends[0]..ends[1]].iter().map(|k| pairs[*k as usize]).flat_map(|(a, b)| [a, b]);
            bodies.filter(|i| !fixed(*i)).all(|i| last.insert(i, list) != Some(list))
        })
    }

    /// Sorts patches by group and colour; of the hubs' every patch is a list.
    fn list(
        &mut self,
        pairs: &[(u32, u32)],
        fixed: &impl Fn(u32) -> bool,
        counts: &[[usize; COLOURS + 1]; 2],
    ) {
        let mut next = [[0usize; COLOURS + 1]; 2];
        self.starts.clear();
        self.starts.push(0);
        let mut sum = 0;
        for group in 0..2 {
            for colour in 0..COLOURS {
                next[group][colour] = sum;
                if counts[group][colour] > 0 {
                    sum += counts[group][colour];
                    self.starts.push(sum);
                }
            }
            if group == 0 {
                self.with_obstacles = self.starts.len() - 1;
            }
        }
        self.alone = self.starts.len() - 1;
        for group in 0..2 {
            next[group][COLOURS] = sum;
            for _ in 0..counts[group][COLOURS] {
                sum += 1;
                self.starts.push(sum);
            }
        }
        self.order.clear();
        self.order.resize(pairs.len(), 0);
        for (k, &(a, b)) in pairs.iter().enumerate() {
            let group = usize::from(!(fixed(a) || fixed(b)));
            let place = &mut next[group][self.colour[k] as usize];
            self.order[*place] = k as u32;
            *place += 1;
        }
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
        let mut colours = Colours::default();
        colours.paint(100, &pairs, |i| i == 0);
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
        let of_obstacles = &colours.order[..colours.starts[colours.with_obstacles]];
        assert!(of_obstacles.iter().all(|k| pairs[*k as usize].0 == 0) && of_obstacles.len() == 99);
        assert!(colours.starts.len() - 1 > colours.alone);
    }
}
