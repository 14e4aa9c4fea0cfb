//! Broad phase: every pair of boxes that overlap and may touch, sorted. Most boxes that move are of about one size: they
//! are swept in rows. Larger ones go into a tree that is built anew, those that nothing moves into one that is kept while
//! they are as they were; who says which boxes stand pays nothing for them. Movable boxes that sleep have such a tree too.
//! Boxes without bounds are held against all others. What is kept saves work and decides nothing: the pairs depend on the boxes alone. Knows no shapes.

use crate::geometry::Aabb;
use crate::rows::{Rows, fits};
use crate::size_class::SizeClass;
use crate::tree::Tree;
use carom_math::workers::Memory;
use carom_math::{Space, Workers};

/// Which boxes may have changed since the update before; it decides nothing but the work, save that boxes that stand or
/// sleep make no pairs with each other.
#[derive(Clone, Copy, Debug)]
pub struct Changed<'a> {
    /// Boxes that may have changed, ascending.
    pub others: &'a [u32],
    /// Movable boxes that sleep, ascending; they have bounds and are not among the others.
    pub asleep: &'a [u32],
    /// Those among neither stand, not movable, as they did in the update before, which was told the same indices.
    pub stands_as_before: bool,
    /// Those that sleep are the same boxes as in the update before.
    pub sleeps_as_before: bool,
}

/// Keeps those of some pairs that may pair, in their order; workers ask at once.
pub type Sift<'a> = &'a (dyn Fn(&mut Vec<(u32, u32)>) + Sync);

/// Boxes that a worker looks at together at a time; nothing depends on it but the time.
pub(crate) const BOXES: usize = 128;

/// Finds overlapping pairs; keeps its memory between updates, and the tree of what stands.
#[derive(Debug)]
pub struct BroadPhase<S: Space> {
    sizes: SizeClass,
    rows: Rows<S>,
    /// Movable boxes in rows.
    alike: Vec<u32>,
    /// Movable boxes in a tree.
    others: Group<S>,
    /// Boxes that stand.
    standing: Group<S>,
    /// Movable boxes that sleep.
    asleep: Group<S>,
    /// Boxes that nothing moves, but that are not said to stand.
    driven: Group<S>,
    /// Movable boxes with bounds.
    bounded: Vec<u32>,
    /// Boxes without bounds that stand, and the others.
    unbounded: [Vec<u32>; 2],
    /// Every box, for who does not say which stand.
    every: Vec<u32>,
    found: Found,
    /// What workers find of some boxes each, and what boxes without bounds meet.
    offers: Memory<Offers>,
    of_unbounded: Offers,
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
            standing: group(),
            asleep: group(),
            driven: group(),
            bounded: Vec::new(),
            unbounded: Default::default(),
            every: Vec::new(),
            found: Found::default(),
            offers: Memory::default(),
            of_unbounded: Offers::default(),
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
        may_pair: &(dyn Fn(usize, usize) -> bool + Sync),
    ) -> &[(u32, u32)] {
        let sift = |pairs: &mut Vec<(u32, u32)>| pairs.retain(|(i, j)| may_pair(*i as usize, *j as usize));
        let mut every = std::mem::take(&mut self.every);
        every.clear();
        every.extend(0..bounds.len() as u32);
        let changed =
            Changed { others: &every, asleep: &[], stands_as_before: false, sleeps_as_before: false };
        self.search((bounds, movable), changed, &sift, &Workers::default());
        self.every = every;
        &self.found.pairs
    }

    /// The same where only some boxes may have changed since the update before, for work that goes with their number; workers
    /// share it.
    pub fn update_some(
        &mut self,
        boxes: (&[Aabb<S>], &[bool]),
        changed: Changed<'_>,
        sift: Sift<'_>,
        workers: &Workers,
    ) -> &[(u32, u32)] {
        self.search(boxes, changed, sift, workers);
        &self.found.pairs
    }

    /// The pairs of the last update.
    pub fn pairs(&self) -> &[(u32, u32)] {
        &self.found.pairs
    }

    fn search(
        &mut self,
        (bounds, movable): (&[Aabb<S>], &[bool]),
        changed: Changed<'_>,
        sift: Sift<'_>,
        workers: &Workers,
    ) {
        debug_assert_eq!(bounds.len(), movable.len());
        self.found.pairs.clear();
        if !changed.stands_as_before {
            self.stand(bounds, &changed);
        }
        if !changed.sleeps_as_before {
            self.asleep.members.clear();
            self.asleep.members.extend_from_slice(changed.asleep);
            self.asleep.arrange(bounds);
        }
        self.part(bounds, movable, changed.others);
        let size = self.sizes.choose(self.bounded.iter().map(|&i| bounds[i as usize]));
        self.alike.clear();
        self.others.members.clear();
        for &i in &self.bounded {
            let alike = fits(&bounds[i as usize], size);
            if alike { self.alike.push(i) } else { self.others.members.push(i) }
        }
        let (offers, pairs) = (&mut self.offers, &mut self.found.pairs);
        if !self.rows.overlaps((&self.alike, bounds, size), sift, (workers, offers), pairs) {
            // too close for rows
            self.found.pairs.clear();
            self.alike.clear();
            self.others.members.clone_from(&self.bounded);
        }
        self.by_trees(bounds, sift, workers);
        self.by_all(bounds, movable, sift);
        self.found.sort(bounds.len());
    }

    /// Arranges the boxes that stand: all but the others and those that sleep.
    fn stand(&mut self, bounds: &[Aabb<S>], changed: &Changed<'_>) {
        self.standing.members.clear();
        self.unbounded[0].clear();
        let mut others = changed.others.iter().peekable();
        let mut asleep = changed.asleep.iter().peekable();
        for (i, b) in bounds.iter().enumerate() {
            let is_next = |k: &&u32| **k == i as u32;
            if others.next_if(is_next).is_some() || asleep.next_if(is_next).is_some() {
                continue;
            }
            let list = if b.is_finite() { &mut self.standing.members } else { &mut self.unbounded[0] };
            list.push(i as u32);
        }
        self.standing.arrange(bounds);
    }

    /// Sorts boxes that do not stand by whether they move and whether they have bounds.
    fn part(&mut self, bounds: &[Aabb<S>], movable: &[bool], others: &[u32]) {
        for list in [&mut self.bounded, &mut self.unbounded[1], &mut self.driven.members] {
            list.clear();
        }
        for &i in others {
            let list = match (bounds[i as usize].is_finite(), movable[i as usize]) {
                (false, _) => &mut self.unbounded[1],
                (true, true) => &mut self.bounded,
                (true, false) => &mut self.driven.members,
            };
            list.push(i);
        }
    }

    /// What moves against what stands or sleeps, and everything that moves against what is in the tree of others.
    fn by_trees(&mut self, bounds: &[Aabb<S>], sift: Sift<'_>, workers: &Workers) {
        self.others.arrange(bounds);
        self.driven.arrange(bounds);
        let BroadPhase { standing, driven, asleep, others, bounded, alike, offers, found, .. } = self;
        let (standing, driven, asleep, others) = (&*standing, &*driven, &*asleep, &*others);
        let mut look = |some: &[u32], trees: &[&Group<S>], once: bool| {
            if trees.iter().all(|tree| tree.members.is_empty()) {
                return;
            }
            let find = |_, some: &[u32], offers: &mut Offers| {
                offers.begin();
                for &i in some {
                    let query = &bounds[i as usize];
                    for tree in trees {
                        // two of one tree find each other twice
                        tree.overlapping(query, |j| {
                            if !once || j > i {
                                offers.offer(i, j)
                            }
                        });
                    }
                }
                offers.sift(sift);
            };
            workers.chunks(some, BOXES, offers, find, |offers| offers.append_to(&mut found.pairs));
        };
        look(bounded, &[standing, driven, asleep], false);
        look(&driven.members, &[asleep], false);
        look(alike, &[others], false);
        look(&others.members, &[others], true);
    }

    /// Boxes without bounds against all others that may move against them.
    fn by_all(&mut self, bounds: &[Aabb<S>], movable: &[bool], sift: Sift<'_>) {
        let [stand, others] = &self.unbounded;
        let offers = &mut self.of_unbounded;
        offers.begin();
        let mut look = |i: u32, list: &[u32]| {
            for &j in list {
                if bounds[i as usize].overlaps(&bounds[j as usize]) {
                    offers.offer(i, j);
                }
            }
        };
        for &i in stand {
            look(i, &self.bounded);
        }
        for &i in others {
            look(i, &self.bounded);
            look(i, &self.asleep.members);
            if movable[i as usize] {
                look(i, &self.driven.members);
                look(i, &self.standing.members);
            }
        }
        for (k, &i) in others.iter().enumerate() {
            for &j in others[k + 1..].iter().chain(stand) {
                if movable[i as usize] || movable[j as usize] {
                    look(i, &[j]);
                }
            }
        }
        offers.sift(sift);
        offers.append_to(&mut self.found.pairs);
    }
}

/// What a worker finds of some boxes.
#[derive(Debug, Default)]
pub(crate) struct Offers {
    pairs: Vec<(u32, u32)>,
    /// How many boxes were looked at for it.
    pub looks: usize,
}

impl Offers {
    /// Nothing found yet.
    pub fn begin(&mut self) {
        self.pairs.clear();
        self.looks = 0;
    }
    /// Adds two boxes.
    #[inline]
    pub fn offer(&mut self, i: u32, j: u32) {
        self.pairs.push((i.min(j), i.max(j)));
    }
    /// Keeps the pairs that may pair.
    pub fn sift(&mut self, sift: Sift<'_>) {
        sift(&mut self.pairs);
    }
    /// Moves the pairs behind others.
    pub fn append_to(&mut self, pairs: &mut Vec<(u32, u32)>) {
        if pairs.is_empty() { std::mem::swap(pairs, &mut self.pairs) } else { pairs.append(&mut self.pairs) }
    }
}

/// Pairs as they are found, and then in order.
#[derive(Clone, Debug, Default)]
struct Found {
    pairs: Vec<(u32, u32)>,
    /// Where the pairs of each box begin.
    starts: Vec<u32>,
    /// Pairs in between.
    others: Vec<(u32, u32)>,
}

impl Found {
    /// Puts the pairs in lexicographic order: counted by their second box, then by their first. A few among many boxes
    /// are sorted as they are.
    fn sort(&mut self, boxes: usize) {
        if 8 * self.pairs.len() < boxes {
            self.pairs.sort_unstable();
            return;
        }
        let count = self.pairs.len();
        if self.others.len() < count {
            self.others.resize(count, (0, 0));
        }
        let others = &mut self.others[..count];
        count_sort(&self.pairs, others, &mut self.starts, boxes, |p| p.1);
        count_sort(others, &mut self.pairs, &mut self.starts, boxes, |p| p.0);
    }
}

/// Puts pairs in the order of a box of each, equals as they were.
fn count_sort(
    from: &[(u32, u32)],
    to: &mut [(u32, u32)],
    starts: &mut Vec<u32>,
    boxes: usize,
    key: impl Fn(&(u32, u32)) -> u32,
) {
    starts.clear();
    starts.resize(boxes + 1, 0);
    for pair in from {
        starts[key(pair) as usize + 1] += 1;
    }
    for i in 0..boxes {
        starts[i + 1] += starts[i];
    }
    for pair in from {
        let place = &mut starts[key(pair) as usize];
        to[*place as usize] = *pair;
        *place += 1;
    }
}
