//! Symbolic analysis: elimination tree, supernodes, and where every block goes (Liu 1990; Davis 2006, chapter 4).
//! Depends on the pattern alone, so it is kept while the contact graph stands.

use super::dissection::dissected;
use super::graph::Graph;
use super::layout::{Front, lay_out};
use super::ordering::{inverse, minimum_degree};

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
    pub(super) pattern: Graph,
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
        let (mut tree, mut groups) = eliminated(graph, &minimum_degree(graph));
        if flops(&groups) > LARGE {
            let other = eliminated(graph, &dissected(graph, minimum_degree));
            if flops(&other.1) < flops(&groups) {
                (tree, groups) = other;
            }
        }
        let flops = flops(&groups);
        let mut analysis = lay_out(graph, &tree.order, groups);
        analysis.flops = flops;
        analysis.pattern = graph.clone();
        analysis
    }
    /// True when this is the analysis of that pattern.
    pub fn fits(&self, graph: &Graph) -> bool {
        self.pattern == *graph
    }
    /// The pattern that was analysed.
    pub fn pattern(&self) -> &Graph {
        &self.pattern
    }
}

pub(super) const NONE: u32 = u32::MAX;

/// The elimination in that order, made contiguous: its tree and its fronts.
fn eliminated(graph: &Graph, order: &[u32]) -> (Tree, Vec<Group>) {
    let tree = Tree::of(graph, &postordered(graph, order));
    let groups = tree.merged(graph);
    (tree, groups)
}

/// Multiply-adds of a factorisation.
fn flops(groups: &[Group]) -> f64 {
    let one = |g: &Group| {
        let (p, b) = (f64::from(g.pivot_scalars), f64::from(g.row_scalars));
        p * p * p / 3.0 * 2.0 + 2.0 * p * p * b + p * b * b
    };
    groups.iter().map(one).sum()
}

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

/// The same elimination with every subtree contiguous.
fn postordered(graph: &Graph, order: &[u32]) -> Vec<u32> {
    let parent = parents(graph, order, &inverse(order));
    let n = order.len();
    let (mut head, mut next) = (vec![NONE; n], vec![NONE; n]);
    for k in (0..n).rev() {
        if parent[k] != NONE {
            next[k] = head[parent[k] as usize];
            head[parent[k] as usize] = k as u32;
        }
    }
    let mut out = Vec::with_capacity(n);
    let mut stack = Vec::new();
    for root in (0..n).filter(|&k| parent[k] == NONE) {
        stack.push(root as u32);
        while let Some(&k) = stack.last() {
            let child = head[k as usize];
            if child == NONE {
                out.push(order[k as usize]);
                stack.pop();
            } else {
                head[k as usize] = next[child as usize];
                stack.push(child);
            }
        }
    }
    out
}

/// The elimination tree with the structure of every column, by position.
struct Tree {
    order: Vec<u32>,
    position: Vec<u32>,
    parent: Vec<u32>,
}

/// A front under construction, by position.
#[derive(Default)]
pub(super) struct Group {
    pub pivots: Vec<u32>,
    pub rows: Vec<u32>,
    pub children: Vec<u32>,
    pub pivot_scalars: u32,
    pub row_scalars: u32,
    /// Zeros stored because of merging.
    zeros: f64,
}

impl Tree {
    fn of(graph: &Graph, order: &[u32]) -> Self {
        let position = inverse(order);
        let parent = parents(graph, order, &position);
        Tree { order: order.to_vec(), position, parent }
    }

    /// Fronts: columns merged with their parents where that stores few zeros. Children come before parents.
    fn merged(&self, graph: &Graph) -> Vec<Group> {
        let n = self.order.len();
        let size = |k: u32| graph.sizes[self.order[k as usize] as usize];
        let mut groups: Vec<Option<Group>> = Vec::with_capacity(n);
        let mut waiting: Vec<Vec<u32>> = vec![Vec::new(); n];
        let mut mark = vec![NONE; n];
        for k in 0..n as u32 {
            mark[k as usize] = k;
            let mut rows = Vec::new();
            let mut add = |i: u32| {
                if i > k && mark[i as usize] != k {
                    mark[i as usize] = k;
                    rows.push(i);
                }
            };
            let own = graph.row(self.order[k as usize] as usize);
            graph.neighbours[own].iter().for_each(|&j| add(self.position[j as usize]));
            let children = std::mem::take(&mut waiting[k as usize]);
            for &c in &children {
                let child = groups[c as usize].as_ref().expect("a waiting child is a group");
                child.rows.iter().for_each(|&i| add(i));
            }
            rows.sort_unstable();
            let row_scalars = rows.iter().map(|&i| size(i)).sum();
            let pivots = vec![k];
            let mut group = Group { pivots, rows, pivot_scalars: size(k), row_scalars, ..Group::default() };
            for c in children {
                let child = groups[c as usize].take().expect("a waiting child is a group");
                if let Some(child) = absorb(&mut group, child) {
                    groups[c as usize] = Some(child);
                    group.children.push(c);
                }
            }
            if self.parent[k as usize] != NONE {
                // the parent of a group is that of its last pivot
                waiting[self.parent[k as usize] as usize].push(k);
            }
            groups.push(Some(group));
        }
        compact(groups)
    }
}

/// Merges a child into its parent when that stores few zeros; gives it back otherwise.
fn absorb(group: &mut Group, child: Group) -> Option<Group> {
    let pivots = child.pivot_scalars + group.pivot_scalars;
    let missing = (group.pivot_scalars + group.row_scalars - child.row_scalars) as f64;
    let zeros = child.zeros + group.zeros + missing * child.pivot_scalars as f64;
    let stored = pivots as f64 * (0.5 * pivots as f64 + group.row_scalars as f64);
    let allowed = match pivots {
        0..=6 => 0.5,
        7..=12 => 0.2,
        13..=32 => 0.1,
        _ => 0.05,
    };
    if zeros > allowed * stored {
        return Some(child);
    }
    let mut merged = child.pivots;
    merged.append(&mut group.pivots);
    group.pivots = merged;
    let mut children = child.children;
    children.append(&mut group.children);
    group.children = children;
    group.pivot_scalars = pivots;
    group.zeros = zeros;
    None
}

/// Removes the holes that merging left.
fn compact(groups: Vec<Option<Group>>) -> Vec<Group> {
    let mut name = vec![NONE; groups.len()];
    let mut out: Vec<Group> = Vec::new();
    for (k, group) in groups.into_iter().enumerate() {
        if let Some(mut group) = group {
            name[k] = out.len() as u32;
            group.children.iter_mut().for_each(|c| *c = name[*c as usize]);
            group.children.sort_unstable(); // remainders wait in this order
            out.push(group);
        }
    }
    out
}
