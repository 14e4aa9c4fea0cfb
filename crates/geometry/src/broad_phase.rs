//! Broad phase: every pair of boxes that overlap and may touch, sorted. A median-split tree is rebuilt at every
//! update, because it neither cares how sizes mix nor remembers the past: the pairs depend on the arguments
//! alone. Boxes without bounds are held against all others. Knows no shapes.

use crate::geometry::Aabb;
use crate::tree::Tree;
use carom_math::Space;

/// Finds overlapping pairs; keeps its memory between updates, and nothing else.
#[derive(Clone, Debug)]
pub struct BroadPhase<S: Space> {
    tree: Tree<S>,
    /// Item of each box in the tree.
    bounded: Vec<u32>,
    unbounded: Vec<u32>,
    pairs: Vec<(u32, u32)>,
}

impl<S: Space> Default for BroadPhase<S> {
    fn default() -> Self {
        BroadPhase { tree: Tree::default(), bounded: Vec::new(), unbounded: Vec::new(), pairs: Vec::new() }
    }
}

impl<S: Space> BroadPhase<S> {
    /// A broad phase without pairs.
    pub fn new() -> Self {
        Self::default()
    }
    /// Every pair (i, j), i < j, of boxes that overlap or touch, at least one of them movable, for which
    /// `may_pair` agrees; in lexicographic order. Infinite coordinates are allowed, NaN overlaps nothing.
    pub fn update(
        &mut self,
        bounds: &[Aabb<S>],
        movable: &[bool],
        may_pair: &dyn Fn(usize, usize) -> bool,
    ) -> &[(u32, u32)] {
        debug_assert_eq!(bounds.len(), movable.len());
        self.pairs.clear();
        self.bounded.clear();
        self.unbounded.clear();
        for (i, b) in bounds.iter().enumerate() {
            if b.is_finite() { self.bounded.push(i as u32) } else { self.unbounded.push(i as u32) }
        }
        self.tree.reset(self.bounded.iter().map(|&i| bounds[i as usize]));
        let pairs = &mut self.pairs;
        let mut offer = |i: usize, j: usize| {
            let (i, j) = (i.min(j), i.max(j));
            if may_pair(i, j) {
                pairs.push((i as u32, j as u32));
            }
        };
        for &i in &self.bounded {
            let i = i as usize;
            if movable[i] {
                self.tree.overlapping(&bounds[i], |k| {
                    let j = self.bounded[k] as usize;
                    // two movable boxes find each other twice
                    if j > i || !movable[j] {
                        offer(i, j);
                    }
                });
            }
        }
        for (k, &i) in self.unbounded.iter().enumerate() {
            let i = i as usize;
            for &j in self.bounded.iter().chain(&self.unbounded[k + 1..]) {
                let j = j as usize;
                if (movable[i] || movable[j]) && bounds[i].overlaps(&bounds[j]) {
                    offer(i, j);
                }
            }
        }
        self.pairs.sort_unstable();
        &self.pairs
    }
}
