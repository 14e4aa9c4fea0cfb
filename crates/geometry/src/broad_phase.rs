//! Broad phase: every pair of boxes that overlap and may touch, sorted. Most boxes that move are of about one size: they
//! are swept in rows. Larger ones go into a tree that is built anew, those that stand into one that is kept while they
//! stand as they do. Boxes without bounds are held against all others. What is kept saves work and decides nothing: the
//! pairs depend on the arguments alone. Knows no shapes.

use crate::geometry::Aabb;
use crate::rows::{Rows, fits};
use crate::size_class::SizeClass;
use crate::tree::Tree;
use carom_math::Space;

/// Finds overlapping pairs; keeps its memory between updates, and the tree of what stands.
#[derive(Clone, Debug)]
pub struct BroadPhase<S: Space> {
    sizes: SizeClass,
    rows: Rows<S>,
    /// Movable boxes in rows.
    alike: Vec<u32>,
    /// Movable boxes in a tree.
    others: Group<S>,
    /// Boxes that stand.
    fixed: Group<S>,
    bounded: Vec<u32>,
    unbounded: Vec<u32>,
    found: Found,
}

/// Boxes in a tree; item k of the tree is box `members[k]`.
#[derive(Clone, Debug)]
struct Group<S: Space> {
    members: Vec<u32>,
    tree: Tree<S>,
}

impl<S: Space> Default for BroadPhase<S> {
    fn default() -> Self {
        let group = || Group { members: Vec::new(), tree: Tree::default() };
        BroadPhase {
            sizes: SizeClass::default(),
            rows: Rows::default(),
            alike: Vec::new(),
            others: group(),
            fixed: group(),
            bounded: Vec::new(),
            unbounded: Vec::new(),
            found: Found::default(),
        }
    }
}

impl<S: Space> Group<S> {
    /// The tree over the members' boxes; one over the same boxes stays.
    fn arrange(&mut self, bounds: &[Aabb<S>]) {
        let boxes = || self.members.iter().map(|&i| bounds[i as usize]);
        if !self.tree.is_over(boxes()) {
            self.tree.reset(boxes());
        }
    }
    /// Visits the members whose boxes overlap one.
    fn overlapping(&self, query: &Aabb<S>, mut visit: impl FnMut(u32)) {
        self.tree.overlapping(query, |k| visit(self.members[k]));
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
        self.found.pairs.clear();
        self.part(bounds, movable);
        let size = self.sizes.choose(self.bounded.iter().map(|&i| bounds[i as usize]));
        self.alike.clear();
        self.others.members.clear();
        for &i in &self.bounded {
            let alike = fits(&bounds[i as usize], size);
            if alike { self.alike.push(i) } else { self.others.members.push(i) }
        }
        let found = &mut self.found;
        let mut offer = |i: u32, j: u32| found.offer(i, j, may_pair);
        if !self.rows.overlaps(&self.alike, bounds, size, &mut offer) {
            // too close for rows
            self.found.pairs.clear();
            self.alike.clear();
            self.others.members.clone_from(&self.bounded);
        }
        self.by_trees(bounds, may_pair);
        self.by_all(bounds, movable, may_pair);
        self.found.sorted(bounds.len())
    }

    /// Sorts boxes by whether they move and whether they have bounds.
    fn part(&mut self, bounds: &[Aabb<S>], movable: &[bool]) {
        for list in [&mut self.bounded, &mut self.unbounded, &mut self.fixed.members] {
            list.clear();
        }
        for (i, b) in bounds.iter().enumerate() {
            let list = match (b.is_finite(), movable[i]) {
                (false, _) => &mut self.unbounded,
                (true, true) => &mut self.bounded,
                (true, false) => &mut self.fixed.members,
            };
            list.push(i as u32);
        }
    }

    /// What moves against what stands, and everything that moves against what is in the tree of others.
    fn by_trees(&mut self, bounds: &[Aabb<S>], may_pair: &dyn Fn(usize, usize) -> bool) {
        self.others.arrange(bounds);
        self.fixed.arrange(bounds);
        let found = &mut self.found;
        for &i in &self.bounded {
            self.fixed.overlapping(&bounds[i as usize], |j| found.offer(i, j, may_pair));
        }
        if self.others.members.is_empty() {
            return;
        }
        for &i in &self.alike {
            self.others.overlapping(&bounds[i as usize], |j| found.offer(i, j, may_pair));
        }
        for &i in &self.others.members {
            self.others.overlapping(&bounds[i as usize], |j| {
                // two of them find each other twice
                if j > i {
                    found.offer(i, j, may_pair);
                }
            });
        }
    }

    /// Boxes without bounds against all others.
    fn by_all(&mut self, bounds: &[Aabb<S>], movable: &[bool], may_pair: &dyn Fn(usize, usize) -> bool) {
        for (k, &i) in self.unbounded.iter().enumerate() {
            for &j in self.bounded.iter().chain(&self.fixed.members).chain(&self.unbounded[k + 1..]) {
                let moves = movable[i as usize] || movable[j as usize];
                if moves && bounds[i as usize].overlaps(&bounds[j as usize]) {
                    self.found.offer(i, j, may_pair);
                }
            }
        }
    }
}

/// Pairs as they are found, and then in order.
#[derive(Clone, Debug, Default)]
struct Found {
    pairs: Vec<(u32, u32)>,
    /// Where the pairs of each first box begin.
    starts: Vec<u32>,
    /// Second boxes by first ones.
    seconds: Vec<u32>,
}

impl Found {
    #[inline]
    fn offer(&mut self, i: u32, j: u32, may_pair: &dyn Fn(usize, usize) -> bool) {
        let (i, j) = (i.min(j), i.max(j));
        if may_pair(i as usize, j as usize) {
            self.pairs.push((i, j));
        }
    }
    /// The pairs in lexicographic order: counted by their first box, the few of each sorted by their second.
    fn sorted(&mut self, boxes: usize) -> &[(u32, u32)] {
        self.starts.clear();
        self.starts.resize(boxes + 1, 0);
        for &(i, _) in &self.pairs {
            self.starts[i as usize + 1] += 1;
        }
        for i in 0..boxes {
            self.starts[i + 1] += self.starts[i];
        }
        self.seconds.clear();
        self.seconds.resize(self.pairs.len(), 0);
        for &(i, j) in &self.pairs {
            let place = &mut self.starts[i as usize];
            self.seconds[*place as usize] = j;
            *place += 1;
        }
        // each start has moved to its end
        let mut first = 0;
        for (i, &end) in self.starts[..boxes].iter().enumerate() {
            let (first_of_i, end) = (std::mem::replace(&mut first, end as usize), end as usize);
            self.seconds[first_of_i..end].sort_unstable();
            for k in first_of_i..end {
                self.pairs[k] = (i as u32, self.seconds[k]);
            }
        }
        &self.pairs
    }
}
