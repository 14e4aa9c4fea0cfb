//! Where everything of a front lies. A front is one dense matrix [P U; L C] by columns: P pivots by pivots, L rows
//! by pivots, U pivots by rows, C the remainder. P, L and U form its panel, which a factorisation keeps; C waits on
//! a stack for the parent. Knows no numbers.

use super::analysis::{Analysis, Block, Group, Groups, Lists, NONE};
use super::graph::Graph;
use super::kernel::padded;

/// A part of one of the flat lists.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Span {
    start: u32,
    end: u32,
}

impl Span {
    /// What it spans.
    pub fn of<T>(self, list: &[T]) -> &[T] {
        &list[self.range()]
    }
    /// The same places.
    pub fn range(self) -> std::ops::Range<usize> {
        self.start as usize..self.end as usize
    }
    /// The end of a list from `start` on.
    pub fn since<T>(start: usize, list: &[T]) -> Self {
        Span { start: start as u32, end: list.len() as u32 }
    }
}

/// Pivots that are eliminated together, and the later scalars that they touch.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Front {
    /// Scalars among the pivots.
    pub pivots: usize,
    /// Scalars among the rows.
    pub rows: usize,
    /// Scalar position, in order of elimination, of the first pivot.
    pub first: usize,
    /// Start of the panel: P with columns `pivots` apart, L with columns `padded(rows)` apart, then U like P.
    pub panel: usize,
    /// Which of the two stacks its remainder waits on: the other one holds its children's.
    pub stack: usize,
    pub children: Span,
    /// Runs of its rows that lie among the parent's pivots, and among the parent's rows.
    pub runs: [Span; 2],
    pub blocks: Span,
    pub positions: Span,
    pub chunks: Span,
}

impl Front {
    /// Distance of the columns of L and of C.
    pub fn stride(&self) -> usize {
        padded(self.rows)
    }
    /// Length of the remainder.
    pub fn remainder(&self) -> usize {
        self.rows * self.stride()
    }
    /// Length of the panel.
    pub fn panel_length(&self) -> usize {
        self.pivots * (self.pivots + self.stride() + self.rows)
    }
    /// Where entry (row, column) of the front lies in the panel, and how far columns are apart there; one of the two
    /// is a pivot.
    fn place(&self, row: usize, column: usize) -> (usize, usize) {
        let (p, ld) = (self.pivots, self.stride());
        if column >= p {
            (p * (p + ld) + (column - p) * p + row, p)
        } else if row >= p {
            (p * p + column * ld + row - p, ld)
        } else {
            (column * p + row, p)
        }
    }
}

/// Most scalars eliminated at a time: two bodies, four contacts.
const CHUNK: u32 = 12;

/// What is known of every node while fronts are laid out.
struct Places {
    /// Scalar position of the node in order of elimination.
    position: Vec<u32>,
    /// The front that eliminates it.
    owner: Vec<u32>,
    /// Its first scalar in the front at hand.
    local: Vec<u32>,
}

/// Turns groups into fronts with positions, runs and blocks.
pub(super) fn lay_out(graph: &Graph, groups: Groups) -> Analysis {
    let n = graph.nodes();
    let Groups { all, pivots, mut rows, children } = groups;
    let mut analysis = Analysis { order: Vec::with_capacity(graph.scalars()), ..Analysis::default() };
    let mut places = Places { position: vec![0; n], owner: vec![NONE; n], local: vec![0; n] };
    for (f, group) in all.iter().enumerate() {
        for &node in group.pivots.of(&pivots) {
            let node = node as usize;
            places.position[node] = analysis.order.len() as u32;
            places.owner[node] = f as u32;
            analysis.order.extend(graph.first[node]..graph.first[node + 1]);
        }
    }
    analysis.fronts.reserve_exact(all.len());
    analysis.lists.blocks.reserve_exact(graph.neighbours.len());
    analysis.lists.chunks.reserve(all.len());
    analysis.lists.positions.reserve_exact(all.iter().map(|g| g.row_scalars as usize).sum());
    let stacks = stacks(&all, &children);
    for (f, group) in all.iter().enumerate() {
        let (pivots, own) = (group.pivots.of(&pivots), group.rows.range());
        // the rows follow the order of elimination of the merged fronts
        rows[own.clone()].sort_unstable_by_key(|&i| places.position[i as usize]);
        let mut front = Front {
            pivots: group.pivot_scalars as usize,
            rows: group.row_scalars as usize,
            first: places.position[pivots[0] as usize] as usize,
            panel: analysis.sizes.panels,
            stack: stacks[f],
            children: group.children,
            ..Front::default()
        };
        let mut local = 0;
        for &i in pivots.iter().chain(&rows[own.clone()]) {
            places.local[i as usize] = local;
            local += graph.sizes[i as usize];
        }
        let lists = &mut analysis.lists;
        front.chunks = push_chunks(graph, pivots, lists);
        front.blocks = push_blocks(graph, &front, (pivots, f as u32), &places, lists);
        front.positions = push_positions(graph, &rows[own], &places, lists);
        for &c in group.children.of(&children) {
            let of_child = all[c as usize].rows.of(&rows);
            analysis.fronts[c as usize].runs =
                push_runs(graph, of_child, front.pivots as u32, &places, lists);
        }
        measure(&front, &mut analysis);
        analysis.fronts.push(front);
    }
    analysis.lists.children = children;
    stack_sizes(&mut analysis);
    analysis
}

/// Adds what a front needs.
fn measure(front: &Front, analysis: &mut Analysis) {
    let largest = front.chunks.of(&analysis.lists.chunks).iter().map(|c| c.0).max();
    let sizes = &mut analysis.sizes;
    sizes.panels += front.panel_length();
    sizes.pivots = sizes.pivots.max(front.pivots);
    sizes.rows = sizes.rows.max(front.rows);
    sizes.chunk = sizes.chunk.max(largest.map_or(0, |k| k as usize));
}

/// The stack of every front: that of its parent's siblings is the other one.
fn stacks(groups: &[Group], children: &[u32]) -> Vec<usize> {
    let mut stack = vec![0; groups.len()];
    for (f, group) in groups.iter().enumerate().rev() {
        group.children.of(children).iter().for_each(|&c| stack[c as usize] = 1 - stack[f]);
    }
    stack
}

/// The most that waits on each stack.
fn stack_sizes(analysis: &mut Analysis) {
    let mut held = [0usize; 2];
    for front in &analysis.fronts {
        for &c in front.children.of(&analysis.lists.children) {
            held[1 - front.stack] -= analysis.fronts[c as usize].remainder();
        }
        held[front.stack] += front.remainder();
        // while a front is made, its children's remainders still wait on the other stack
        analysis.sizes.waiting[front.stack] = analysis.sizes.waiting[front.stack].max(held[front.stack]);
    }
}

/// Pivot nodes of one size gathered into chunks of at most `CHUNK` scalars (a larger node is a chunk of its own).
fn push_chunks(graph: &Graph, pivots: &[u32], lists: &mut Lists) -> Span {
    let start = lists.chunks.len();
    for &i in pivots {
        let size = graph.sizes[i as usize];
        match lists.chunks[start..].last_mut() {
            Some((last, node)) if *node == size && *last + size <= CHUNK => *last += size,
            _ => lists.chunks.push((size, size)),
        }
    }
    Span::since(start, &lists.chunks)
}

fn push_positions(graph: &Graph, rows: &[u32], places: &Places, lists: &mut Lists) -> Span {
    let start = lists.positions.len();
    for &i in rows {
        let first = places.position[i as usize];
        lists.positions.extend(first..first + graph.sizes[i as usize]);
    }
    Span::since(start, &lists.positions)
}

/// The matrix's blocks whose earlier node is a pivot of this front.
fn push_blocks(
    graph: &Graph,
    front: &Front,
    (pivots, f): (&[u32], u32),
    places: &Places,
    lists: &mut Lists,
) -> Span {
    let start = lists.blocks.len();
    for &i in pivots {
        for k in graph.row(i as usize) {
            let j = graph.neighbours[k];
            let other = places.owner[j as usize];
            if other < f {
                continue;
            }
            let mut push = |at: usize, row: u32, column: u32| {
                let (row, column) = (row as usize, column as usize);
                let (place, stride) = front.place(places.local[row] as usize, places.local[column] as usize);
                lists.blocks.push(Block {
                    values: graph.offsets[at],
                    place: place as u32,
                    stride: stride as u32,
                    rows: graph.sizes[row],
                    columns: graph.sizes[column],
                });
            };
            push(k, i, j);
            if other > f {
                let back = graph.position(j as usize, i as usize).expect("the pattern is symmetric");
                push(back, j, i);
            }
        }
    }
    Span::since(start, &lists.blocks)
}

/// Where a child's rows lie in its parent: maximal runs that are contiguous in both, first those among the parent's
/// pivots.
fn push_runs(graph: &Graph, rows: &[u32], pivots: u32, places: &Places, lists: &mut Lists) -> [Span; 2] {
    let start = lists.runs.len();
    let mut middle = start;
    let mut own = 0;
    for &i in rows {
        let (there, size) = (places.local[i as usize], graph.sizes[i as usize]);
        match lists.runs[start..].last_mut() {
            Some((_, to, length)) if *to + *length == there && there != pivots => *length += size,
            _ => lists.runs.push((own, there, size)),
        }
        if there < pivots {
            middle = lists.runs.len();
        }
        own += size;
    }
    [
        Span { start: start as u32, end: middle as u32 },
        Span { start: middle as u32, end: lists.runs.len() as u32 },
    ]
}
