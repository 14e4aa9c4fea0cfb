//! Symbolic analysis: elimination tree, supernodes, and where every block goes (Liu 1990; Davis 2006, chapter 4).
//! Depends on the pattern alone, so it is kept while the contact graph stands.

use super::front::padded;
use super::graph::Graph;
use super::ordering::minimum_degree;

/// One dense front: pivots that are eliminated together, and the later nodes that they touch.
#[derive(Clone, Debug, Default)]
pub(super) struct Front {
    /// Pivot nodes.
    pub pivots: Vec<u32>,
    /// Later nodes, in order of elimination.
    pub rows: Vec<u32>,
    /// Scalars among the pivots.
    pub pivot_scalars: usize,
    /// Scalars among the rows.
    pub row_scalars: usize,
    /// Fronts whose remainder is added to this one.
    pub children: Vec<u32>,
    /// For each run of this front's rows that is a run in the parent too: (own, parent's, length).
    pub runs: Vec<(u32, u32, u32)>,
    /// Blocks of the matrix that start here: (offset of its values, row, column, rows, columns).
    pub blocks: Vec<Block>,
    /// Scalar position, in order of elimination, of the first pivot.
    pub first: usize,
    /// Scalar positions of the rows.
    pub positions: Vec<u32>,
    /// Chunks of pivots that are eliminated at a time: their sizes.
    pub chunks: Vec<u32>,
}

/// A block of the matrix in its front.
#[derive(Clone, Copy, Debug)]
pub(super) struct Block {
    pub offset: u32,
    pub row: u32,
    pub column: u32,
    pub rows: u32,
    pub columns: u32,
}

/// What the pattern of a matrix says about its factors.
#[derive(Clone, Debug, Default)]
pub struct Analysis {
    pub(super) fronts: Vec<Front>,
    /// Scalar position in order of elimination -> scalar row of the matrix.
    pub(super) order: Vec<u32>,
    pub(super) largest_front: usize,
    /// Length of the panels that a factorisation keeps.
    pub(super) panels: usize,
    /// Multiply-adds of a factorisation.
    pub flops: f64,
}

/// Most scalars eliminated at a time in a large front: two bodies, four contacts.
const CHUNK: u32 = 12;
/// In fronts of fewer scalars every node is a chunk of its own: small inverses cost less than passes over the front.
const LARGE: usize = 64;

impl Analysis {
    /// Analyses a pattern under the minimum degree order.
    pub fn new(graph: &Graph) -> Self {
        let order = minimum_degree(graph);
        let order = postordered(graph, &order);
        let tree = Tree::of(graph, &order);
        let fronts = tree.merged(graph);
        lay_out(graph, &tree, fronts)
    }
}

fn inverse(order: &[u32]) -> Vec<u32> {
    let mut position = vec![0; order.len()];
    order.iter().enumerate().for_each(|(k, &i)| position[i as usize] = k as u32);
    position
}

const NONE: u32 = u32::MAX;

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
struct Group {
    pivots: Vec<u32>,
    rows: Vec<u32>,
    children: Vec<u32>,
    pivot_scalars: u32,
    row_scalars: u32,
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
                groups[c as usize]
                    .as_ref()
                    .expect("a waiting child is a group")
                    .rows
                    .iter()
                    .for_each(|&i| add(i));
            }
            rows.sort_unstable();
            let row_scalars = rows.iter().map(|&i| size(i)).sum();
            let mut group = Group {
                pivots: vec![k],
                rows,
                children: Vec::new(),
                pivot_scalars: size(k),
                row_scalars,
                zeros: 0.0,
            };
            for c in children {
                let child = groups[c as usize].take().expect("a waiting child is a group");
                match absorb(&mut group, child) {
                    None => {}
                    Some(child) => {
                        groups[c as usize] = Some(child);
                        group.children.push(c);
                    }
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
        0..=12 => 0.6,
        13..=32 => 0.3,
        33..=64 => 0.12,
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

/// Turns groups into fronts with positions, runs and blocks.
fn lay_out(graph: &Graph, tree: &Tree, groups: Vec<Group>) -> Analysis {
    let mut analysis = Analysis { order: Vec::with_capacity(graph.scalars()), ..Analysis::default() };
    let n = graph.nodes();
    let mut first_position = vec![0u32; n];
    let mut owner = vec![NONE; n];
    for (f, group) in groups.iter().enumerate() {
        for &k in &group.pivots {
            let node = tree.order[k as usize] as usize;
            first_position[node] = analysis.order.len() as u32;
            owner[node] = f as u32;
            analysis.order.extend(graph.first[node]..graph.first[node + 1]);
        }
    }
    let mut place = vec![0u32; n];
    for (f, group) in groups.into_iter().enumerate() {
        let nodes = |list: &[u32]| list.iter().map(|&k| tree.order[k as usize]).collect::<Vec<_>>();
        let mut front = Front { pivots: nodes(&group.pivots), rows: nodes(&group.rows), ..Front::default() };
        // the rows follow the order of elimination of the merged fronts
        front.rows.sort_unstable_by_key(|&i| first_position[i as usize]);
        front.children = group.children;
        front.first = first_position[front.pivots[0] as usize] as usize;
        let mut local = 0;
        for &i in front.pivots.iter().chain(&front.rows) {
            place[i as usize] = local;
            local += graph.sizes[i as usize];
        }
        front.pivot_scalars = group.pivot_scalars as usize;
        front.row_scalars = local as usize - front.pivot_scalars;
        for &i in &front.rows {
            let start = first_position[i as usize];
            front.positions.extend(start..start + graph.sizes[i as usize]);
        }
        let most = if local as usize >= LARGE { CHUNK } else { 0 };
        front.chunks = chunks(graph, &front.pivots, most);
        front.blocks = blocks(graph, &front, &owner, &place, f as u32);
        for c in front.children.clone() {
            let child = &mut analysis.fronts[c as usize];
            child.runs = runs(graph, &child.rows, &place);
        }
        let (p, b) = (front.pivot_scalars as f64, front.row_scalars as f64);
        analysis.flops += p * p * p / 3.0 * 2.0 + 2.0 * p * p * b + p * b * b;
        let mut left = local as usize;
        for &k in &front.chunks {
            left -= k as usize;
            analysis.panels += k as usize * (padded(k as usize) + 2 * padded(left));
        }
        analysis.largest_front = analysis.largest_front.max(local as usize);
        analysis.fronts.push(front);
    }
    analysis
}

/// Pivot nodes gathered into chunks of at most `most` scalars (a larger node is a chunk of its own).
fn chunks(graph: &Graph, pivots: &[u32], most: u32) -> Vec<u32> {
    let mut out: Vec<u32> = Vec::new();
    for &i in pivots {
        let size = graph.sizes[i as usize];
        match out.last_mut() {
            Some(last) if *last + size <= most => *last += size,
            _ => out.push(size),
        }
    }
    out
}

/// The matrix's blocks whose earlier node is a pivot of this front.
fn blocks(graph: &Graph, front: &Front, owner: &[u32], place: &[u32], f: u32) -> Vec<Block> {
    let mut out = Vec::new();
    for &i in &front.pivots {
        for k in graph.row(i as usize) {
            let j = graph.neighbours[k];
            let other = owner[j as usize];
            if other < f {
                continue;
            }
            let mut push = |at: usize, row: u32, column: u32| {
                out.push(Block {
                    offset: graph.offsets[at],
                    row: place[row as usize],
                    column: place[column as usize],
                    rows: graph.sizes[row as usize],
                    columns: graph.sizes[column as usize],
                });
            };
            push(k, i, j);
            if other > f {
                let back = graph.position(j as usize, i as usize).expect("the pattern is symmetric");
                push(back, j, i);
            }
        }
    }
    out
}

/// Where a child's rows lie in its parent: maximal runs that are contiguous in both.
fn runs(graph: &Graph, rows: &[u32], place: &[u32]) -> Vec<(u32, u32, u32)> {
    let mut out: Vec<(u32, u32, u32)> = Vec::new();
    let mut own = 0;
    for &i in rows {
        let (there, size) = (place[i as usize], graph.sizes[i as usize]);
        match out.last_mut() {
            Some((_, start, length)) if *start + *length == there => *length += size,
            _ => out.push((own, there, size)),
        }
        own += size;
    }
    out
}
