//! Contacts between the same two bodies condensed: their rows of W~ span at most six directions (three in the plane)
//! and so do their columns, W_gh = Q_g V_gh R_h^T with orthonormal Q and R (the same when W~ is symmetric). With
//! H = R^T D^-1 Q and g = R^T D^-1 rhs the system becomes (1 + V H) s = -V g and dx = D^-1 (rhs + Q s). H^-1 is never
//! formed: where some contacts of a group stick and others are open it would hold 1e12 next to 1. Found from W~
//! alone: such contacts are coupled to the same others.

use super::analyses::Analyses;
use super::group_rows::{MOST, add_lines, add_rows};
use super::operator::Matrix;
use super::system::{Block, Spare, Stiffness, stiffened_inverse};
use crate::linear::{Analysis, Factor, Graph};
use crate::registers::in_widest;
use pulp::{Simd, WithSimd};
use std::sync::Arc;

/// Fewer contacts are not worth the condensing.
const FEW: usize = 96;
/// Directions left out are smaller than this share of the group's largest.
const RANK: f64 = 1e-9;
/// Columns that a group's rows are gathered into before their directions are found.
const SKETCH: usize = 12;
/// What condensing may change of a block, as a share of the largest diagonal entry.
const FAITHFUL: f64 = 1e-11;

/// A group of contacts with its directions.
#[derive(Clone, Debug, Default)]
struct Group {
    contacts: Vec<u32>,
    /// Number of directions; for a contact on its own its dimension.
    rank: usize,
    /// Q, D rows per contact, `rank` columns, row by row; empty when the contact stands for itself.
    basis: Vec<f64>,
    /// R, in the same order.
    seen: Vec<f64>,
    /// H, rank x rank.
    compliance: Vec<f64>,
}

/// The system with groups as nodes.
#[derive(Clone, Debug, Default)]
pub struct GroupSpace<const D: usize> {
    groups: Vec<Group>,
    graph: Graph,
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

/// `reduce` in the machine's own instructions.
struct Reduce<'a, const D: usize>(&'a Matrix, &'a [Group], &'a [u32], &'a Graph);

impl<const D: usize> WithSimd for Reduce<'_, D> {
    type Output = Option<Vec<f64>>;
    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> Option<Vec<f64>> {
        reduce::<D>(self.0, self.1, self.2, self.3)
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

/// `basis` in the machine's own instructions.
struct Directions<'a, const D: usize>(&'a [u32], &'a [Sketch<D>]);

impl<const D: usize> WithSimd for Directions<'_, D> {
    type Output = Option<Vec<f64>>;
    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> Option<Vec<f64>> {
        basis(self.0, self.1)
    }
}

/// `sketches` in the machine's own instructions.
struct Sketches<'a, const D: usize>(&'a Matrix);

impl<const D: usize> WithSimd for Sketches<'_, D> {
    type Output = (Vec<Sketch<D>>, Vec<Sketch<D>>);
    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> Self::Output {
        sketches(self.0)
    }
}

impl<const D: usize> GroupSpace<D> {
    /// The condensed system, if at least half of the contacts condense to fewer directions than they have rows.
    pub fn of(matrix: &Matrix, analyses: &mut Analyses) -> Option<Self> {
        let mut groups = gather(&matrix.graph, D)?;
        let (rows, columns) = in_widest(Sketches::<D>(matrix));
        for group in groups.iter_mut().filter(|g| g.contacts.len() > 1) {
            let n = group.contacts.len() * D;
            group.basis = in_widest(Directions(&group.contacts, &rows))?;
            let is_symmetric = group.contacts.iter().all(|&i| rows[i as usize] == columns[i as usize]);
            group.seen = if is_symmetric {
                group.basis.clone()
            } else {
                in_widest(Directions(&group.contacts, &columns))?
            };
            group.rank = group.basis.len() / n;
            if group.seen.len() != group.basis.len() {
                return None;
            }
        }
        let mut owner = vec![0u32; matrix.graph.nodes()];
        for (g, group) in groups.iter().enumerate() {
            group.contacts.iter().for_each(|&i| owner[i as usize] = g as u32);
        }
        let graph = group_graph(matrix, &groups, &owner);
        let reduced = in_widest(Reduce::<D>(matrix, &groups, &owner, &graph))?;
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
    let row = |i: u32| &graph.neighbours[graph.row(i as usize)];
    let mut order: Vec<u32> = (0..n as u32).collect();
    order.sort_by(|&i, &j| row(i).len().cmp(&row(j).len()).then_with(|| row(i).cmp(row(j))).then(i.cmp(&j)));
    let directions = if d == 3 { 6 } else { 3 };
    let mut groups: Vec<Group> = Vec::new();
    let mut condensed = 0;
    for run in order.chunk_by(|&i, &j| row(i) == row(j)) {
        if d > 1 && run.len() * d > directions && run.len() <= 64 {
            condensed += run.len();
            groups.push(Group { contacts: run.to_vec(), ..Group::default() });
        } else {
            groups.extend(run.iter().map(|&i| Group { contacts: vec![i], rank: d, ..Group::default() }));
        }
    }
    groups.sort_by_key(|g| g.contacts[0]);
    (2 * condensed >= n && n >= FEW).then_some(groups)
}

/// A contact's rows (or columns) of W~ added up, with signs, into few columns: their directions stay the same.
type Sketch<const D: usize> = [[f64; SKETCH]; D];

/// The rows and the columns of W~ of every contact, gathered. Signs and places are scattered, so that no direction
/// cancels except by accident, which `faithful` would tell.
#[inline(always)]
fn sketches<const D: usize>(matrix: &Matrix) -> (Vec<Sketch<D>>, Vec<Sketch<D>>) {
    let n = matrix.graph.nodes();
    let (mut rows, mut columns) = (vec![[[0.0; SKETCH]; D]; n], vec![[[0.0; SKETCH]; D]; n]);
    let scatter = |i: usize| {
        let mixed = (i as u32).wrapping_mul(0x9E37_79B1) >> 16;
        let sign = if mixed & 1 == 0 { 1.0 } else { -1.0 };
        (sign, (mixed >> 1) as usize % (SKETCH / D) * D)
    };
    for i in 0..n {
        let (own_sign, own_place) = scatter(i);
        for k in matrix.graph.row(i) {
            let j = matrix.graph.neighbours[k] as usize;
            let (sign, place) = scatter(j);
            let block = &matrix.values[matrix.graph.offsets[k] as usize..][..D * D];
            for r in 0..D {
                for c in 0..D {
                    rows[i][r][place + c] += sign * block[r * D + c];
                    columns[j][c][own_place + r] += own_sign * block[r * D + c];
                }
            }
        }
    }
    (rows, columns)
}

/// Orthonormal directions that span the gathered rows of some contacts, D x rank per contact, row by row: columns in
/// the order of what is left of them. `None` when there are more than `MOST`.
#[inline(always)]
fn basis<const D: usize>(contacts: &[u32], sketches: &[Sketch<D>]) -> Option<Vec<f64>> {
    // row by row, so that all columns are worked on side by side
    let mut left: Vec<[f64; SKETCH]> = contacts.iter().flat_map(|&i| sketches[i as usize]).collect();
    let n = left.len();
    let mut directions: Vec<Vec<f64>> = Vec::with_capacity(MOST);
    let mut first = None;
    loop {
        let mut sizes = [0.0; SKETCH];
        for row in &left {
            (0..SKETCH).for_each(|c| sizes[c] += row[c] * row[c]);
        }
        let best = (0..SKETCH).fold(0, |b, c| if sizes[c] > sizes[b] { c } else { b });
        let scale = *first.get_or_insert(sizes[best]);
        if !(sizes[best] > RANK * RANK * scale) {
            break;
        }
        if directions.len() == MOST {
            return None;
        }
        let mut direction: Vec<f64> = left.iter_mut().map(|row| std::mem::take(&mut row[best])).collect();
        for known in &directions {
            let dot: f64 = known.iter().zip(&direction).map(|(a, b)| a * b).sum();
            direction.iter_mut().zip(known).for_each(|(x, q)| *x -= dot * q);
        }
        let length = direction.iter().map(|x| x * x).sum::<f64>().sqrt();
        direction.iter_mut().for_each(|x| *x /= length);
        let mut along = [0.0; SKETCH];
        for (q, row) in direction.iter().zip(&left) {
            (0..SKETCH).for_each(|c| along[c] += q * row[c]);
        }
        for (q, row) in direction.iter().zip(&mut left) {
            (0..SKETCH).for_each(|c| row[c] -= along[c] * q);
        }
        directions.push(direction);
    }
    let mut out = Vec::with_capacity(n * directions.len());
    (0..n).for_each(|i| out.extend(directions.iter().map(|q| q[i])));
    Some(out)
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

/// V; `None` when condensing would change W~.
#[inline(always)]
fn reduce<const D: usize>(
    matrix: &Matrix,
    groups: &[Group],
    owner: &[u32],
    graph: &Graph,
) -> Option<Vec<f64>> {
    let mut reduced = vec![0.0; graph.values()];
    let largest = (0..matrix.graph.nodes())
        .map(|i| (0..D).fold(0.0_f64, |m, k| m.max(matrix.values[matrix.diagonal[i] as usize + k * D + k])))
        .fold(0.0, f64::max);
    let mut place = vec![0usize; matrix.graph.nodes()];
    for group in groups {
        group.contacts.iter().enumerate().for_each(|(k, &i)| place[i as usize] = k);
    }
    let unit: Vec<f64> = (0..D * D).map(|k| if k / D == k % D { 1.0 } else { 0.0 }).collect();
    let part = |i: usize, whole: fn(&Group) -> &[f64]| -> &[f64] {
        let group = &groups[owner[i] as usize];
        let whole = whole(group);
        if whole.is_empty() { &unit } else { &whole[place[i] * D * group.rank..][..D * group.rank] }
    };
    let rows_of = |i: usize| part(i, |g| &g.basis);
    let seen_of = |i: usize| part(i, |g| &g.seen);
    for i in 0..matrix.graph.nodes() {
        let (g, own) = (owner[i] as usize, rows_of(i));
        let rank = groups[g].rank;
        // contacts of one group mostly follow one another
        let mut run = matrix.graph.row(i).peekable();
        while let Some(&k) = run.peek() {
            let h = owner[matrix.graph.neighbours[k] as usize] as usize;
            let columns = groups[h].rank;
            let mut right = [[0.0; MOST]; D];
            while let Some(k) = run.next_if(|&k| owner[matrix.graph.neighbours[k] as usize] as usize == h) {
                let block = &matrix.values[matrix.graph.offsets[k] as usize..][..D * D];
                let more = times::<D>(block, seen_of(matrix.graph.neighbours[k] as usize), columns);
                for (right, more) in right.iter_mut().zip(&more) {
                    right.iter_mut().zip(more).for_each(|(r, m)| *r += m);
                }
            }
            let at = graph.offsets[graph.position(g, h)?] as usize;
            let target = &mut reduced[at..at + rank * columns];
            for (p, target) in target.chunks_exact_mut(columns).enumerate() {
                let factors: [f64; D] = std::array::from_fn(|r| own[r * rank + p]);
                let sum = combined(&factors, &right);
                target.iter_mut().zip(&sum).for_each(|(t, s)| *t += s);
            }
        }
    }
    faithful::<D>(matrix, graph, &reduced, owner, (&rows_of, &seen_of), largest).then_some(reduced)
}

/// True when every block of W~ is Q_g V_gh R_h^T to rounding.
#[inline(always)]
fn faithful<'a, const D: usize>(
    matrix: &Matrix,
    graph: &Graph,
    reduced: &[f64],
    owner: &[u32],
    (rows_of, seen_of): (&impl Fn(usize) -> &'a [f64], &impl Fn(usize) -> &'a [f64]),
    largest: f64,
) -> bool {
    let mut worst: f64 = 0.0;
    for i in 0..matrix.graph.nodes() {
        let (g, own) = (owner[i] as usize, rows_of(i));
        let rank = own.len() / D;
        let (mut last, mut left) = (usize::MAX, [[0.0; MOST]; D]);
        for k in matrix.graph.row(i) {
            let j = matrix.graph.neighbours[k] as usize;
            let (h, other) = (owner[j] as usize, seen_of(j));
            let columns = other.len() / D;
            if h != last {
                let Some(at) = graph.position(g, h) else { return false };
                let v = &reduced[graph.offsets[at] as usize..][..rank * columns];
                let mut lines = [[0.0; MOST]; MOST];
                for (line, v) in lines.iter_mut().zip(v.chunks_exact(columns)) {
                    line[..columns].copy_from_slice(v);
                }
                for (left, own) in left.iter_mut().zip(own.chunks_exact(rank)) {
                    *left = combined(own, &lines);
                }
                last = h;
            }
            let block = &matrix.values[matrix.graph.offsets[k] as usize..][..D * D];
            for (left, block) in left.iter().zip(block.chunks_exact(D)) {
                for (other, wanted) in other.chunks_exact(columns).zip(block) {
                    let value: f64 = left.iter().zip(other).map(|(l, o)| l * o).sum();
                    worst = worst.max((value - wanted).abs());
                }
            }
        }
    }
    worst <= FAITHFUL * largest
}
