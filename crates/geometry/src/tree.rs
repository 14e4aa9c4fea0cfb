//! A static tree of axis-aligned boxes: median split along the longest axis of the centres, in depth-first
//! order in one array, so that skipping a subtree is one addition. Knows no shapes; one text for both spaces.

use crate::geometry::Aabb;
use carom_math::{Column, Space};

/// Items per leaf: below this a linear pass is cheaper than another level.
const LEAF: usize = 4;

#[derive(Clone, Debug)]
struct Node<S: Space> {
    bounds: Aabb<S>,
    /// Nodes in this subtree, itself included.
    skip: u32,
    /// Items of a leaf; empty for an inner node.
    first: u32,
    count: u32,
}

/// Boxes arranged for quick overlap, ray and nearest queries.
#[derive(Clone, Debug)]
pub struct Tree<S: Space> {
    nodes: Vec<Node<S>>,
    items: Vec<u32>,
    bounds: Vec<Aabb<S>>,
}

impl<S: Space> Default for Tree<S> {
    fn default() -> Self {
        Tree { nodes: Vec::new(), items: Vec::new(), bounds: Vec::new() }
    }
}

/// Twice the centre: enough to order by, and no overflow for finite boxes of reasonable size.
fn center<S: Space>(bounds: &Aabb<S>, axis: usize) -> f64 {
    bounds.min[axis] + bounds.max[axis]
}

impl<S: Space> Tree<S> {
    /// A tree over boxes without infinite or NaN coordinates; item i is box i.
    pub fn new(bounds: Vec<Aabb<S>>) -> Self {
        let mut tree = Tree { nodes: Vec::new(), items: Vec::new(), bounds };
        tree.rebuild();
        tree
    }
    /// Arranges the same tree over other boxes, keeping its memory.
    pub fn reset(&mut self, bounds: impl Iterator<Item = Aabb<S>>) {
        self.bounds.clear();
        self.bounds.extend(bounds);
        self.rebuild();
    }
    /// True when the tree is over these boxes, in this order.
    pub fn is_over(&self, mut bounds: impl ExactSizeIterator<Item = Aabb<S>>) -> bool {
        bounds.len() == self.bounds.len() && self.bounds.iter().all(|own| bounds.next() == Some(*own))
    }
    fn rebuild(&mut self) {
        self.nodes.clear();
        self.items.clear();
        self.items.extend(0..self.bounds.len() as u32);
        if !self.items.is_empty() {
            self.split(0, self.bounds.len());
        }
    }
    fn split(&mut self, first: usize, end: usize) {
        let node = self.nodes.len();
        let part = &mut self.items[first..end];
        let whole =
            part[1..].iter().fold(self.bounds[part[0] as usize], |b, &i| b.union(&self.bounds[i as usize]));
        self.nodes.push(Node { bounds: whole, skip: 1, first: first as u32, count: (end - first) as u32 });
        if end - first > LEAF {
            let (bounds, mut axis, mut spread) = (&self.bounds, 0, -1.0);
            for k in 0..S::DIM {
                let at = |i: &u32| center(&bounds[*i as usize], k);
                let low = part.iter().map(at).fold(f64::INFINITY, f64::min);
                let high = part.iter().map(at).fold(f64::NEG_INFINITY, f64::max);
                if high - low > spread {
                    (axis, spread) = (k, high - low);
                }
            }
            let key = |i: &u32| center(&bounds[*i as usize], axis);
            let middle = part.len() / 2;
            part.select_nth_unstable_by(middle, |i, j| key(i).total_cmp(&key(j)).then(i.cmp(j)));
            self.nodes[node].count = 0;
            self.split(first, first + middle);
            self.split(first + middle, end);
            self.nodes[node].skip = (self.nodes.len() - node) as u32;
        }
    }
    /// Box around everything; `None` for an empty tree.
    pub fn whole(&self) -> Option<&Aabb<S>> {
        self.nodes.first().map(|n| &n.bounds)
    }
    /// The box of an item.
    pub fn bounds(&self, item: usize) -> &Aabb<S> {
        &self.bounds[item]
    }
    /// Visits every item whose box `hits`, subtrees by the same test, in an order that depends on the boxes alone.
    fn walk(&self, mut hits: impl FnMut(&Aabb<S>) -> bool, mut visit: impl FnMut(usize)) {
        let mut k = 0;
        while let Some(node) = self.nodes.get(k) {
            if !hits(&node.bounds) {
                k += node.skip as usize;
                continue;
            }
            for &item in &self.items[node.first as usize..(node.first + node.count) as usize] {
                if hits(&self.bounds[item as usize]) {
                    visit(item as usize);
                }
            }
            k += 1;
        }
    }
    /// Visits every item whose box overlaps or touches `query`.
    pub fn overlapping(&self, query: &Aabb<S>, visit: impl FnMut(usize)) {
        self.walk(|b| b.overlaps(query), visit);
    }
    /// Visits items whose boxes lie within `reach` \[m\] of `query`; `visit` returns the reach from then on.
    pub fn near(&self, query: &Aabb<S>, reach: f64, mut visit: impl FnMut(usize) -> f64) {
        let limit = std::cell::Cell::new(reach);
        self.walk(|b| b.distance(query) <= limit.get(), |i| limit.set(visit(i)));
    }
    /// How far the nearest box is from `query`, or `most` if that is less \[m\].
    pub fn clearance(&self, query: &Aabb<S>, most: f64) -> f64 {
        let nearest = std::cell::Cell::new(most);
        let nearer = |b: &Aabb<S>| b.distance(query) < nearest.get();
        self.walk(nearer, |i| nearest.set(self.bounds[i].distance(query)));
        nearest.get()
    }
    /// Visits items whose boxes a ray may enter within `reach` \[m\]; `visit` returns the reach from then on.
    pub fn along(
        &self,
        origin: S::Vector,
        direction: S::Vector,
        reach: f64,
        mut visit: impl FnMut(usize) -> f64,
    ) {
        let limit = std::cell::Cell::new(reach);
        self.walk(|b| b.meets_ray(origin, direction, limit.get()), |i| limit.set(visit(i)));
    }
}

impl<S: Space> Aabb<S> {
    /// Smallest box around two boxes.
    #[inline]
    pub fn union(&self, other: &Self) -> Self {
        Aabb {
            min: S::Vector::from_fn(|i| self.min[i].min(other.min[i])),
            max: S::Vector::from_fn(|i| self.max[i].max(other.max[i])),
        }
    }
    /// How far two boxes are apart along the axis on which they are so most \[m\]; negative where they overlap.
    #[inline]
    pub fn apart(&self, other: &Self) -> f64 {
        let along = |i: usize| (self.min[i] - other.max[i]).max(other.min[i] - self.max[i]);
        (0..S::DIM).map(along).fold(f64::NEG_INFINITY, f64::max)
    }
    /// The box that holds one point \[m\].
    pub fn of_point(point: S::Vector) -> Self {
        Aabb { min: point, max: point }
    }
    /// The box grown by `margin` \[m\] on every side.
    #[inline]
    pub fn grown(&self, margin: f64) -> Self {
        let by = S::Vector::from_fn(|_| margin);
        Aabb { min: self.min - by, max: self.max + by }
    }
    /// True when the boxes share a point.
    #[inline]
    pub fn overlaps(&self, other: &Self) -> bool {
        (0..S::DIM).all(|i| self.min[i] <= other.max[i] && other.min[i] <= self.max[i])
    }
    /// True when another box lies within this one; a box that is no number lies in none.
    #[inline]
    pub fn contains(&self, other: &Self) -> bool {
        (0..S::DIM).all(|i| self.min[i] <= other.min[i] && other.max[i] <= self.max[i])
    }
    /// Distance between two boxes \[m\]; zero when they overlap.
    pub fn distance(&self, other: &Self) -> f64 {
        S::Vector::from_fn(|i| (self.min[i] - other.max[i]).max(other.min[i] - self.max[i]).max(0.0)).norm()
    }
    /// True when no coordinate is infinite or NaN.
    pub fn is_finite(&self) -> bool {
        self.min.is_finite() && self.max.is_finite()
    }
    /// True when the ray may enter the box within `reach` (slab test, widened by rounding).
    fn meets_ray(&self, origin: S::Vector, direction: S::Vector, reach: f64) -> bool {
        let (mut enter, mut leave) = (0.0f64, reach);
        for i in 0..S::DIM {
            if direction[i] == 0.0 {
                if origin[i] < self.min[i] || origin[i] > self.max[i] {
                    return false;
                }
                continue;
            }
            let t = [(self.min[i] - origin[i]) / direction[i], (self.max[i] - origin[i]) / direction[i]];
            enter = enter.max(t[0].min(t[1]));
            leave = leave.min(t[0].max(t[1]));
        }
        enter <= leave + 1e-12 * (1.0 + enter.abs())
    }
}
