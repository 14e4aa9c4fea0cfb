//! Symbolic analysis: elimination tree, supernodes, and where every block goes (Liu 1990; Davis 2006, chapter 4).
//! Depends on the pattern alone, so it is kept while the contact graph stands.

use super::dissection::dissected;
use super::graph::Graph;
use super::layout::{Front, Span, lay_out};
use super::ordering::{inverse, minimum_degree};
use std::sync::Arc;

/// What the pattern of a matrix says about its factors.
#[derive(Clone, Debug, Default)]
pub struct Analysis {
    pub(super) fronts: Vec<Front>,
    /// Scalar position in order of elimination -> scalar row of the matrix.
    pub(super) order: Vec<u32>,
    /// Flat lists that the fronts share.
    pub(super) lists: Lists,
    pub(super) sizes: Sizes,
    /// Multiply-adds of a factorisation.
    pub flops: f64,
    pub(super) pattern: Arc<Graph>,
}

/// What fronts list, one after another; a front knows its spans.
#[derive(Clone, Debug, Default)]
pub(super) struct Lists {
    /// Fronts whose remainder is added to a front.
    pub children: Vec<u32>,
    /// For each run of a front's rows that is a run in the parent too: (own, parent's, length).
    pub runs: Vec<(u32, u32, u32)>,
    /// Blocks of the matrix, each in the front of its first node.
    pub blocks: Vec<Block>,
    /// Scalar positions of the rows.
    pub positions: Vec<u32>,
    /// Chunks of pivots that are eliminated at a time: scalars, and scalars of each node.
    pub chunks: Vec<(u32, u32)>,
}

/// A block of the matrix in the panel of its front.
#[derive(Clone, Copy, Debug)]
pub(super) struct Block {
    /// Where its values start, row by row.
    pub values: u32,
    /// Where it goes, from the start of the panel, column by column.
    pub place: u32,
    /// Distance of its columns there.
    pub stride: u32,
    pub rows: u32,
    pub columns: u32,
}

/// Lengths of the memory that a factorisation works in.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Sizes {
    /// All panels.
    pub panels: usize,
    /// The two stacks of remainders.
    pub waiting: [usize; 2],
    /// Most pivots of a front.
    pub pivots: usize,
    /// Most rows of a front.
    pub rows: usize,
    /// Largest chunk of pivots.
    pub chunk: usize,
}

/// From this many multiply-adds on it pays to look for a second order.
const LARGE: f64 = 1e8;

impl Analysis {
    /// Analyses a pattern under the order that keeps its factors sparse.
    pub fn new(graph: &Graph) -> Self {
        Self::of(&Arc::new(graph.clone()))
    }
    /// The same of a pattern that is shared.
    pub fn of(graph: &Arc<Graph>) -> Self {
        let mut groups = Groups::of(graph, &minimum_degree(graph));
        if groups.flops() > LARGE {
            let other = Groups::of(graph, &dissected(graph, minimum_degree));
            if other.flops() < groups.flops() {
                groups = other;
            }
        }
        let flops = groups.flops();
        let mut analysis = lay_out(graph, groups);
        analysis.flops = flops;
        analysis.pattern = graph.clone();
        analysis
    }
    /// True when this is the analysis of that pattern.
    pub fn fits(&self, graph: &Graph) -> bool {
        *self.pattern == *graph
    }
    /// The pattern that was analysed.
    pub fn pattern(&self) -> &Graph {
        &self.pattern
    }
}

pub(super) const NONE: u32 = u32::MAX;

/// Parents in the elimination tree, by position (Liu's algorithm with path compression).
fn parents(graph: &Graph, order: &[u32], position: &[u32]) -> Vec<u32> {
    let n = order.len();
    let (mut parent, mut ancestor) = (vec![NONE; n], vec![NONE; n]);
    for k in 0..n as u32 {
        for &j in &graph.neighbours[graph.row(order[k as usize] as usize)] {
            let mut i = position[j as usize];
            while i < k {
                let next = ancestor[i as usize];
                ancestor[i as usize] = k;
                if next == NONE {
                    parent[i as usize] = k;
                    break;
                }
                i = next;
            }
        }
    }
    parent
}

/// The elimination tree, every subtree contiguous.
struct Tree {
    order: Vec<u32>,
    /// The first child of every position, and the next child of its parent, ascending.
    child: Vec<u32>,
    next: Vec<u32>,
}

impl Tree {
    /// That of an elimination in this order, made contiguous.
    fn of(graph: &Graph, order: &[u32]) -> Self {
        let parent = parents(graph, order, &inverse(order));
        let n = order.len();
        let (mut child, mut next) = siblings(&parent);
        let mut out = Vec::with_capacity(n);
        let mut stack = Vec::with_capacity(n);
        for root in (0..n).filter(|&k| parent[k] == NONE) {
            stack.push(root as u32);
            while let Some(&k) = stack.last() {
                let first = child[k as usize];
                if first == NONE {
                    out.push(k);
                    stack.pop();
                } else {
                    child[k as usize] = next[first as usize];
                    stack.push(first);
                }
            }
        }
        let place = inverse(&out);
        let moved =
            |k: u32| if parent[k as usize] == NONE { NONE } else { place[parent[k as usize] as usize] };
        let parent: Vec<u32> = out.iter().map(|&k| moved(k)).collect();
        (child, next) = siblings(&parent);
        out.iter_mut().for_each(|k| *k = order[*k as usize]);
        Tree { order: out, child, next }
    }
}

/// The first child of every position and the next child of its parent, ascending.
fn siblings(parent: &[u32]) -> (Vec<u32>, Vec<u32>) {
    let (mut child, mut next) = (vec![NONE; parent.len()], vec![NONE; parent.len()]);
    for k in (0..parent.len()).rev().filter(|&k| parent[k] != NONE) {
        let parent = parent[k] as usize;
        next[k] = child[parent];
        child[parent] = k as u32;
    }
    (child, next)
}

/// Fronts under construction, children before parents, with what they list one after another.
#[derive(Default)]
pub(super) struct Groups {
    pub all: Vec<Group>,
    /// Nodes.
    pub pivots: Vec<u32>,
    /// Nodes; those of some groups are those of nobody any more.
    pub rows: Vec<u32>,
    /// Groups.
    pub children: Vec<u32>,
}

/// A front under construction.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Group {
    pub pivots: Span,
    pub rows: Span,
    pub children: Span,
    pub pivot_scalars: u32,
    pub row_scalars: u32,
}

/// A group while columns are merged, by the position of its last pivot.
#[derive(Clone, Copy, Debug)]
struct Merging {
    group: Group,
    /// Zeros stored because of merging.
    zeros: f64,
    /// Its first and last pivot, and its first child: chains by position.
    first: u32,
    last: u32,
    child: u32,
    absorbed: bool,
}

impl Groups {
    /// Those of an elimination: columns merged with their parents where that stores few zeros.
    fn of(graph: &Graph, order: &[u32]) -> Self {
        let tree = Tree::of(graph, order);
        let n = tree.order.len();
        let position = inverse(&tree.order);
        let size = |k: u32| graph.sizes[tree.order[k as usize] as usize];
        let mut groups = Groups { rows: Vec::with_capacity(2 * graph.neighbours.len()), ..Groups::default() };
        let mut merging: Vec<Merging> = Vec::with_capacity(n);
        // the next pivot of the same group, and the next child of the same parent
        let (mut pivot, mut sibling) = (vec![NONE; n], vec![NONE; n]);
        let mut mark = vec![NONE; n];
        for k in 0..n as u32 {
            mark[k as usize] = k;
            let start = groups.rows.len();
            let rows = &mut groups.rows;
            let mut add = |i: u32, rows: &mut Vec<u32>| {
                if i > k && mark[i as usize] != k {
                    mark[i as usize] = k;
                    rows.push(i);
                }
            };
            let own = graph.row(tree.order[k as usize] as usize);
            graph.neighbours[own].iter().for_each(|&j| add(position[j as usize], rows));
            let mut c = tree.child[k as usize];
            while c != NONE {
                for at in merging[c as usize].group.rows.range() {
                    let row = rows[at];
                    add(row, rows);
                }
                c = tree.next[c as usize];
            }
            rows[start..].sort_unstable();
            let row_scalars = rows[start..].iter().map(|&i| size(i)).sum();
            let span = Span::since(start, rows);
            let group = Group { rows: span, pivot_scalars: size(k), row_scalars, ..Group::default() };
            let mut own = Merging { group, zeros: 0.0, first: k, last: k, child: NONE, absorbed: false };
            let mut c = tree.child[k as usize];
            while c != NONE {
                if own.absorb(&mut merging[c as usize], (&mut pivot, &mut sibling)) {
                    merging[c as usize].absorbed = true;
                } else {
                    sibling[c as usize] = own.child;
                    own.child = c;
                }
                c = tree.next[c as usize];
            }
            merging.push(own);
        }
        groups.gather(&merging, (&pivot, &sibling), &tree.order);
        groups
    }
    /// Takes what was not absorbed, by nodes and by groups.
    fn gather(&mut self, merging: &[Merging], (pivot, sibling): (&[u32], &[u32]), order: &[u32]) {
        let mut name = vec![NONE; merging.len()];
        self.pivots.reserve_exact(merging.len());
        for (k, own) in merging.iter().enumerate().filter(|m| !m.1.absorbed) {
            name[k] = self.all.len() as u32;
            let (pivots, children) = (self.pivots.len(), self.children.len());
            let mut at = own.first;
            while at != NONE {
                self.pivots.push(order[at as usize]);
                at = pivot[at as usize];
            }
            let mut c = own.child;
            while c != NONE {
                self.children.push(name[c as usize]);
                c = sibling[c as usize];
            }
            self.children[children..].sort_unstable(); // remainders wait in this order
            let (pivots, children) =
                (Span::since(pivots, &self.pivots), Span::since(children, &self.children));
            self.all.push(Group { pivots, children, ..own.group });
        }
        self.rows.iter_mut().for_each(|i| *i = order[*i as usize]);
    }
    /// Multiply-adds of a factorisation.
    fn flops(&self) -> f64 {
        let one = |g: &Group| {
            let (p, b) = (f64::from(g.pivot_scalars), f64::from(g.row_scalars));
            p * p * p / 3.0 * 2.0 + 2.0 * p * p * b + p * b * b
        };
        self.all.iter().map(one).sum()
    }
}

impl Merging {
    /// Merges a child into its parent when that stores few zeros; whether it did.
    fn absorb(&mut self, child: &mut Merging, (pivot, sibling): (&mut [u32], &mut [u32])) -> bool {
        let (own, other) = (&mut self.group, &child.group);
        let pivots = other.pivot_scalars + own.pivot_scalars;
        let missing = (own.pivot_scalars + own.row_scalars - other.row_scalars) as f64;
        let zeros = child.zeros + self.zeros + missing * other.pivot_scalars as f64;
        let stored = pivots as f64 * (0.5 * pivots as f64 + own.row_scalars as f64);
        let allowed = match pivots {
            0..=6 => 0.5,
            7..=12 => 0.2,
            13..=32 => 0.1,
            _ => 0.05,
        };
        if zeros > allowed * stored {
            return false;
        }
        (own.pivot_scalars, self.zeros) = (pivots, zeros);
        pivot[child.last as usize] = self.first;
        self.first = child.first;
        while child.child != NONE {
            let c = child.child;
            child.child = sibling[c as usize];
            sibling[c as usize] = self.child;
            self.child = c;
        }
        true
    }
}
