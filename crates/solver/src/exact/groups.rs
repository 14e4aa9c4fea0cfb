//! Contacts between the same two bodies condensed: their rows of W~ span at most six directions (three in the plane)
//! and so do their columns, W_gh = X_g V_gh Y_h^T with V some of the numbers of W~ (`skeleton`; Y = X when W~ is
//! symmetric). With H = Y^T D^-1 X and g = Y^T D^-1 rhs the system becomes (1 + V H) s = -V g and
//! dx = D^-1 (rhs + X s). H^-1 is never formed: where some contacts of a group stick and others are open it would hold
//! 1e12 next to 1. Found from W~ alone: such contacts are coupled to the same others.

use super::analyses::Analyses;
use super::group_rows::{add_lines, add_rows};
use super::lane::padded;
use super::operator::Matrix;
use super::row;
use super::skeleton::{MOST, Row, Skeleton, Sketch, are_alike, skeleton, sketches};
use super::system::{Block, Spare, Stiffness, stiffened_inverse};
use crate::linear::{Analysis, Factor, Graph};
use crate::registers::in_widest;
use pulp::{Simd, WithSimd};
use std::sync::Arc;

/// Fewer contacts are not worth the condensing.
const FEW: usize = 96;
/// Directions, over rows of W~, that are few enough: each costs more than a row does.
const WORTH: f64 = 0.65;
/// What condensing may change of a velocity, as a share of the largest diagonal entry, where all impulses are 1 or -1.
const FAITHFUL: f64 = 1e-11;

/// A group of contacts with its directions.
#[derive(Clone, Debug, Default)]
struct Group {
    contacts: Vec<u32>,
    /// Number of directions; for a contact on its own its dimension.
    rank: usize,
    /// X, D rows per contact, `rank` columns, row by row; empty when the contact stands for itself.
    basis: Vec<f64>,
    /// Y, in the same order.
    seen: Vec<f64>,
    /// The rows and the columns of W~ that stand for all, by their place among the group's.
    kept: [Vec<u32>; 2],
    /// H, rank x rank.
    compliance: Vec<f64>,
}

impl Group {
    /// A contact that stands for itself.
    fn of_one(contact: u32, dimension: usize) -> Self {
        Group { contacts: vec![contact], rank: dimension, ..Group::default() }
    }
    /// The rows of W~ that stand for the group's.
    fn kept_rows<const D: usize>(&self) -> impl Iterator<Item = u32> {
        kept::<D>(&self.kept[0])
    }
    /// The columns that do.
    fn kept_columns<const D: usize>(&self) -> impl Iterator<Item = u32> {
        kept::<D>(&self.kept[1])
    }
}

/// Those that are named; all of a contact that stands for itself.
fn kept<const D: usize>(named: &[u32]) -> impl Iterator<Item = u32> {
    let all = if named.is_empty() { D as u32 } else { 0 };
    named.iter().copied().chain(0..all)
}

/// The system with groups as nodes.
#[derive(Clone, Debug, Default)]
pub struct GroupSpace<const D: usize> {
    groups: Vec<Group>,
    graph: Arc<Graph>,
    analysis: Arc<Analysis>,
    factor: Factor,
    /// V.
    reduced: Vec<f64>,
    /// 1 + V H; for a contact on its own D + V.
    values: Vec<f64>,
    /// Where the diagonal blocks start.
    diagonal: Vec<u32>,
    /// g.
    pulled: Vec<f64>,
    /// D^-1 per contact.
    compliance: Vec<Block<D>>,
    /// s; dx for a contact on its own.
    solution: Vec<f64>,
}

/// `spread` in the machine's own instructions.
struct Spread<'a, const D: usize>(&'a mut GroupSpace<D>, &'a [Block<D>]);

impl<const D: usize> WithSimd for Spread<'_, D> {
    type Output = ();
    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        self.0.spread(self.1);
    }
}

/// `pull` in the machine's own instructions.
struct Pull<'a, const D: usize>(&'a mut GroupSpace<D>, &'a [[f64; D]]);

impl<const D: usize> WithSimd for Pull<'_, D> {
    type Output = ();
    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        self.0.pull(self.1);
    }
}

/// `push` in the machine's own instructions.
struct Push<'a, const D: usize>(&'a GroupSpace<D>, &'a mut [[f64; D]]);

impl<const D: usize> WithSimd for Push<'_, D> {
    type Output = ();
    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        self.0.push(self.1);
    }
}

/// `soften` in the machine's own instructions.
struct Soften<'a, const D: usize>(&'a mut GroupSpace<D>, Stiffness<'a, D>);

impl<const D: usize> WithSimd for Soften<'_, D> {
    type Output = ();
    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        self.0.soften(self.1);
    }
}

/// `condense` in the machine's own instructions.
struct Condense<'a, const D: usize>(&'a Matrix, Vec<Group>);

impl<const D: usize> WithSimd for Condense<'_, D> {
    type Output = Vec<Group>;
    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> Vec<Group> {
        condense::<D>(self.0, self.1)
    }
}

impl<const D: usize> GroupSpace<D> {
    /// The condensed system, if that leaves few enough directions.
    pub fn of(matrix: &Matrix, analyses: &mut Analyses) -> Option<Self> {
        let groups = gather(&matrix.graph, D)?;
        let mut groups = in_widest(Condense::<D>(matrix, groups));
        is_worth_it(&groups, D).then_some(())?;
        let mut owner = vec![0u32; matrix.graph.nodes()];
        for (g, group) in groups.iter().enumerate() {
            group.contacts.iter().for_each(|&i| owner[i as usize] = g as u32);
        }
        let graph = Arc::new(group_graph(matrix, &groups, &owner));
        let reduced = reduced::<D>(matrix, &groups, &owner, &graph);
        in_widest(Probe::<D>(matrix, &groups, &graph, &reduced)).then_some(())?;
        let diagonal = (0..groups.len())
            .map(|g| graph.offsets[graph.position(g, g).expect("every row holds its diagonal")])
            .collect();
        for group in &mut groups {
            group.compliance = vec![0.0; group.rank * group.rank];
        }
        Some(GroupSpace {
            analysis: analyses.of(&graph),
            factor: Factor::default(),
            values: Vec::new(),
            reduced,
            diagonal,
            compliance: vec![[[0.0; D]; D]; matrix.graph.nodes()],
            pulled: vec![0.0; graph.scalars()],
            solution: vec![0.0; graph.scalars()],
            groups,
            graph,
        })
    }

    /// The same with memory of another form.
    pub fn with_memory(self, Spare { factor, mut values }: Spare) -> Self {
        values.clone_from(&self.reduced);
        GroupSpace { factor, values, ..self }
    }
    /// What memory another form can use.
    pub fn memory(self) -> Spare {
        Spare { factor: self.factor, values: self.values }
    }

    /// Factorises with D from `blocks`.
    pub fn factorize(&mut self, (blocks, least): Stiffness<'_, D>) -> bool {
        in_widest(Soften(self, (blocks, least)));
        in_widest(Spread(self, blocks));
        self.factor.factorize(&self.analysis, &self.values)
    }

    /// Writes D^-1 and H.
    #[inline(always)]
    fn soften(&mut self, (blocks, least): Stiffness<'_, D>) {
        for (compliance, (block, least)) in self.compliance.iter_mut().zip(blocks.iter().zip(least)) {
            *compliance = stiffened_inverse(block, *least);
        }
        for group in self.groups.iter_mut().filter(|g| !g.basis.is_empty()) {
            let n = group.rank;
            group.compliance.fill(0.0);
            let bases = group.seen.chunks_exact(D * n).zip(group.basis.chunks_exact(D * n));
            for (&i, (seen, rows)) in group.contacts.iter().zip(bases) {
                accumulate(&mut group.compliance, (seen, rows), &self.compliance[i as usize], n);
            }
        }
    }

    /// Writes 1 + V H, and D + V for contacts on their own.
    #[inline(always)]
    fn spread(&mut self, blocks: &[Block<D>]) {
        for (g, group) in self.groups.iter().enumerate() {
            for k in self.graph.row(g) {
                let other = &self.groups[self.graph.neighbours[k] as usize];
                let range = self.graph.offsets[k] as usize..self.graph.offsets[k + 1] as usize;
                let (value, reduced) = (&mut self.values[range.clone()], &self.reduced[range]);
                if other.basis.is_empty() {
                    value.copy_from_slice(reduced);
                } else {
                    product(reduced, &other.compliance, value, other.rank);
                }
            }
            let (at, n) = (self.diagonal[g] as usize, group.rank);
            if group.basis.is_empty() {
                let own = blocks[group.contacts[0] as usize].as_flattened();
                own.iter().enumerate().for_each(|(k, d)| self.values[at + k] += d);
            } else {
                (0..n).for_each(|k| self.values[at + k * n + k] += 1.0);
            }
        }
    }
    /// Multiply-adds of a factorisation.
    pub fn flops(&self) -> f64 {
        self.analysis.flops
    }

    /// The sign of the determinant of the factorised matrix.
    pub fn determinant_sign(&self) -> f64 {
        self.factor.determinant_sign(&self.analysis)
    }

    /// Replaces rhs by dx.
    pub fn solve(&mut self, x: &mut [[f64; D]]) {
        in_widest(Pull(self, x));
        self.factor.solve(&self.analysis, &mut self.solution);
        in_widest(Push(self, x));
    }

    /// Writes -V g, and the right-hand sides of contacts on their own.
    #[inline(always)]
    fn pull(&mut self, x: &[[f64; D]]) {
        self.pulled.fill(0.0);
        for (g, group) in self.groups.iter().enumerate().filter(|(_, g)| !g.basis.is_empty()) {
            let n = group.rank;
            let pulled = &mut self.pulled[self.graph.first[g] as usize..][..n];
            for (&i, rows) in group.contacts.iter().zip(group.seen.chunks_exact(D * n)) {
                let soft = apply(&self.compliance[i as usize], &x[i as usize]);
                add_lines(rows, &soft, pulled);
            }
        }
        for (g, group) in self.groups.iter().enumerate() {
            let own = &mut self.solution[self.graph.first[g] as usize..][..group.rank];
            own.fill(0.0);
            if group.basis.is_empty() {
                own.copy_from_slice(&x[group.contacts[0] as usize]);
            }
            for k in self.graph.row(g) {
                let h = self.graph.neighbours[k] as usize;
                if self.groups[h].basis.is_empty() {
                    continue;
                }
                let pulled = &self.pulled[self.graph.first[h] as usize..self.graph.first[h + 1] as usize];
                let block = &self.reduced[self.graph.offsets[k] as usize..self.graph.offsets[k + 1] as usize];
                add_rows(block, (pulled, -1.0), own);
            }
        }
    }

    /// dx from s.
    #[inline(always)]
    fn push(&self, x: &mut [[f64; D]]) {
        for (g, group) in self.groups.iter().enumerate() {
            let n = group.rank;
            let push = &self.solution[self.graph.first[g] as usize..][..n];
            if group.basis.is_empty() {
                x[group.contacts[0] as usize].copy_from_slice(push);
                continue;
            }
            for (&i, rows) in group.contacts.iter().zip(group.basis.chunks_exact(D * n)) {
                let i = i as usize;
                add_rows(rows, (push, 1.0), &mut x[i]);
                x[i] = apply(&self.compliance[i], &x[i]);
            }
        }
    }
}

/// out = A B with B n x n, row by row.
#[inline(always)]
fn product(a: &[f64], b: &[f64], out: &mut [f64], n: usize) {
    if n == MOST {
        // a size known beforehand keeps the sums in registers
        let (lines, _) = b.as_chunks::<MOST>();
        let ((a, _), (out, _)) = (a.as_chunks::<MOST>(), out.as_chunks_mut::<MOST>());
        for (row, out) in a.iter().zip(out) {
            *out = combined(row, lines);
        }
        return;
    }
    for (row, out) in a.chunks_exact(n).zip(out.chunks_exact_mut(n)) {
        out.fill(0.0);
        for (x, line) in row.iter().zip(b.chunks_exact(n)) {
            line.iter().zip(out.iter_mut()).for_each(|(b, o)| *o += x * b);
        }
    }
}

/// The sum of lines, each times its factor.
#[inline(always)]
fn combined(factors: &[f64], lines: &[[f64; MOST]]) -> [f64; MOST] {
    let mut sum = [0.0; MOST];
    for (factor, line) in factors.iter().zip(lines) {
        for m in 0..MOST {
            sum[m] += factor * line[m];
        }
    }
    sum
}

/// `block`, D x D, times `other`, D x n; numbers past n are zero.
#[inline(always)]
fn times<const D: usize>(block: &[f64], other: &[f64], n: usize) -> [[f64; MOST]; D] {
    let mut lines = [[0.0; MOST]; D];
    for (line, other) in lines.iter_mut().zip(other.chunks_exact(n)) {
        line[..n].copy_from_slice(other);
    }
    std::array::from_fn(|r| combined(&block[r * D..(r + 1) * D], &lines))
}

/// M v.
#[inline(always)]
fn apply<const D: usize>(m: &Block<D>, v: &[f64; D]) -> [f64; D] {
    let mut out = [0.0; D];
    for r in 0..D {
        for c in 0..D {
            out[r] += m[r][c] * v[c];
        }
    }
    out
}

/// h += R_i^T C Q_i with R_i and Q_i D x n, row by row.
#[inline(always)]
fn accumulate<const D: usize>(h: &mut [f64], (seen, rows): (&[f64], &[f64]), c: &Block<D>, n: usize) {
    let product = times::<D>(c.as_flattened(), rows, n);
    for (i, h) in h.chunks_exact_mut(n).enumerate() {
        let factors: [f64; D] = std::array::from_fn(|r| seen[r * n + i]);
        let sum = combined(&factors, &product);
        h.iter_mut().zip(&sum).for_each(|(h, s)| *h += s);
    }
}

/// Contacts with the same neighbours; `None` when too few of them would condense to be worth it.
fn gather(graph: &Graph, d: usize) -> Option<Vec<Group>> {
    let n = graph.nodes();
    if n < FEW {
        return None;
    }
    let row = |i: u32| &graph.neighbours[graph.row(i as usize)];
    let mut order: Vec<u32> = (0..n as u32).collect();
    order.sort_by(|&i, &j| row(i).len().cmp(&row(j).len()).then_with(|| row(i).cmp(row(j))).then(i.cmp(&j)));
    let directions = if d == 3 { 6 } else { 3 };
    let mut groups: Vec<Group> = Vec::new();
    let mut left = 0;
    for run in order.chunk_by(|&i, &j| row(i) == row(j)) {
        if d > 1 && run.len() * d > directions && run.len() <= 64 {
            left += directions;
            groups.push(Group { contacts: run.to_vec(), ..Group::default() });
        } else {
            left += run.len() * d;
            groups.extend(run.iter().map(|&i| Group::of_one(i, d)));
        }
    }
    (left as f64 <= WORTH * (d * n) as f64).then_some(groups)
}

/// True where the groups' directions are few beside the contacts'.
fn is_worth_it(groups: &[Group], d: usize) -> bool {
    let contacts: usize = groups.iter().map(|g| g.contacts.len()).sum();
    let directions: usize = groups.iter().map(|g| g.rank).sum();
    directions as f64 <= WORTH * (d * contacts) as f64
}

/// Finds what each group's rows and columns are sums of, in the order of first contacts; groups with too many directions
/// fall apart.
#[inline(always)]
fn condense<const D: usize>(matrix: &Matrix, groups: Vec<Group>) -> Vec<Group> {
    let (rows, columns) = sketches::<D>(matrix);
    let mut out = Vec::with_capacity(groups.len());
    let mut room = Vec::new();
    for group in groups {
        if group.contacts.len() == 1 {
            out.push(group);
        } else if let Some([own, seen]) = directions(&group.contacts, (&rows, &columns), &mut room) {
            let kept = [own.kept, seen.kept];
            out.push(Group { rank: kept[0].len(), basis: own.shares, seen: seen.shares, kept, ..group });
        } else {
            out.extend(group.contacts.iter().map(|&i| Group::of_one(i, D)));
        }
    }
    out.sort_unstable_by_key(|g| g.contacts[0]);
    out
}

/// The skeletons of a group's rows and of its columns; `None` where they have too many directions, or not as many.
#[inline(always)]
fn directions<const D: usize>(
    contacts: &[u32],
    (rows, columns): (&[Sketch<D>], &[Sketch<D>]),
    room: &mut Vec<Row>,
) -> Option<[Skeleton; 2]> {
    let own = skeleton(contacts, rows, room)?;
    let is_symmetric = contacts.iter().all(|&i| are_alike(&rows[i as usize], &columns[i as usize]));
    let seen = if is_symmetric { own.clone() } else { skeleton(contacts, columns, room)? };
    (own.kept.len() == seen.kept.len()).then_some([own, seen])
}

/// Which groups are coupled.
fn group_graph(matrix: &Matrix, groups: &[Group], owner: &[u32]) -> Graph {
    let (mut starts, mut neighbours) = (vec![0u32], Vec::new());
    for group in groups {
        let first = neighbours.len();
        let row = matrix.graph.row(group.contacts[0] as usize);
        neighbours.extend(matrix.graph.neighbours[row].iter().map(|&j| owner[j as usize]));
        neighbours[first..].sort_unstable();
        let mut end = first;
        for k in first..neighbours.len() {
            if end == first || neighbours[end - 1] != neighbours[k] {
                neighbours[end] = neighbours[k];
                end += 1;
            }
        }
        neighbours.truncate(end);
        starts.push(end as u32);
    }
    Graph::new(groups.iter().map(|g| g.rank as u32).collect(), starts, neighbours)
}

/// V: the numbers of W~ in the rows and columns that are kept.
fn reduced<const D: usize>(matrix: &Matrix, groups: &[Group], owner: &[u32], graph: &Graph) -> Vec<f64> {
    let mut reduced = vec![0.0; graph.values()];
    // where the columns of each contact go in its group's
    let mut places = vec![[None; D]; matrix.graph.nodes()];
    for group in groups {
        for (place, kept) in group.kept_columns::<D>().enumerate() {
            let contact = group.contacts[kept as usize / D] as usize;
            places[contact][kept as usize % D] = Some(place as u32);
        }
    }
    let mut starts = vec![0u32; groups.len()];
    for (g, group) in groups.iter().enumerate() {
        for k in graph.row(g) {
            starts[graph.neighbours[k] as usize] = graph.offsets[k];
        }
        for (p, kept) in group.kept_rows::<D>().enumerate() {
            let row = matrix.graph.row(group.contacts[kept as usize / D] as usize);
            let blocks = matrix.values[row.start * D * D..row.end * D * D].chunks_exact(D * D);
            for (&j, block) in matrix.graph.neighbours[row].iter().zip(blocks) {
                let h = owner[j as usize] as usize;
                let start = starts[h] as usize + p * groups[h].rank;
                let line = &block[kept as usize % D * D..][..D];
                for (value, place) in line.iter().zip(places[j as usize]) {
                    if let Some(place) = place {
                        reduced[start + place as usize] = *value;
                    }
                }
            }
        }
    }
    reduced
}

/// Vectors of signs that W~ and its condensed form are compared on.
const PROBES: usize = 2;

/// `is_faithful` in the machine's own instructions.
struct Probe<'a, const D: usize>(&'a Matrix, &'a [Group], &'a Graph, &'a [f64]);

impl<const D: usize> WithSimd for Probe<'_, D> {
    type Output = bool;
    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> bool {
        (0..PROBES).all(|which| is_faithful::<D>(self.0, (self.1, self.2), self.3, which))
    }
}

/// True when W~ times a vector of signs that look random is X V Y^T times it, to rounding: what differs in a block shows
/// in a row's sum but by accident.
#[inline(always)]
fn is_faithful<const D: usize>(
    matrix: &Matrix,
    (groups, graph): (&[Group], &Graph),
    reduced: &[f64],
    which: usize,
) -> bool {
    let n = matrix.graph.nodes();
    let mut largest: f64 = 0.0;
    for &at in matrix.diagonal.iter() {
        (0..D).for_each(|k| largest = largest.max(matrix.values[at as usize + k * D + k]));
    }
    let mut signs = vec![[0.0; D]; padded(n)];
    for (i, signs) in signs.iter_mut().enumerate().take(n) {
        let mixed = ((PROBES * i + which) as u32).wrapping_mul(0x85EB_CA6B);
        (0..D).for_each(|k| signs[k] = if mixed >> (20 + k) & 1 == 0 { 1.0 } else { -1.0 });
    }
    let mut wanted = vec![[0.0; D]; n];
    row::product(matrix, &signs, &mut wanted);
    let mut seen = vec![0.0; graph.scalars()];
    for (g, group) in groups.iter().enumerate() {
        let own = &mut seen[graph.first[g] as usize..][..group.rank];
        if group.basis.is_empty() {
            own.copy_from_slice(&signs[group.contacts[0] as usize]);
        }
        for (&i, rows) in group.contacts.iter().zip(group.seen.chunks_exact(D * group.rank)) {
            add_lines(rows, &signs[i as usize], own);
        }
    }
    let mut worst: f64 = 0.0;
    for (g, group) in groups.iter().enumerate() {
        let mut pulled = [0.0; MOST];
        let pulled = &mut pulled[..group.rank];
        for k in graph.row(g) {
            let h = graph.neighbours[k] as usize;
            let block = &reduced[graph.offsets[k] as usize..graph.offsets[k + 1] as usize];
            add_rows(block, (&seen[graph.first[h] as usize..graph.first[h + 1] as usize], 1.0), pulled);
        }
        if group.basis.is_empty() {
            worst = worst.max(difference(&wanted[group.contacts[0] as usize], pulled));
        }
        for (&i, rows) in group.contacts.iter().zip(group.basis.chunks_exact(D * group.rank)) {
            let mut own = [0.0; D];
            add_rows(rows, (pulled, 1.0), &mut own);
            worst = worst.max(difference(&wanted[i as usize], &own));
        }
    }
    worst <= FAITHFUL * largest
}

/// The largest difference; infinite where one is NaN.
#[inline(always)]
fn difference(a: &[f64], b: &[f64]) -> f64 {
    let apart = |(a, b): (&f64, &f64)| (a - b).abs();
    a.iter().zip(b).map(apart).fold(0.0, |m, x| {
        if x <= m {
            m
        } else if x > m {
            x
        } else {
            f64::INFINITY
        }
    })
}
