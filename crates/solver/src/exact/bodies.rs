//! Body space: with W~ = B B^T, B the contacts' rows on bodies of unit mass, (1 + B^T D^-1 B) dv = B^T D^-1 rhs and
//! dx = D^-1 (rhs - B dv). One node per body: where many contacts share few bodies the factors are far smaller.

use super::analyses::Analyses;
use super::operator::{Matrix, Operator};
use super::system::{Block, Stiffness, stiffened_inverse};
use crate::linear::{Analysis, Factor, Graph};
use crate::registers::in_widest;
use pulp::{Simd, WithSimd};
use std::sync::Arc;

/// One contact's rows on its two bodies, in the units of the scaled problem.
#[derive(Clone, Debug, Default)]
pub struct Rows<const D: usize> {
    /// Scalars per body: 3 in the plane, 6 in space.
    pub freedoms: usize,
    /// Number of bodies that can move.
    pub bodies: usize,
    /// The two bodies of each contact; `NO_BODY` for one that cannot move.
    pub pairs: Vec<[u32; 2]>,
    /// D x freedoms for the first body, then for the second, contact after contact; M^-1/2 included.
    pub values: Vec<f64>,
}

/// In the place of a body that no impulse moves.
pub const NO_BODY: u32 = u32::MAX;

/// The system with bodies as nodes.
#[derive(Clone, Debug, Default)]
pub struct BodySpace<const D: usize> {
    rows: Rows<D>,
    analysis: Arc<Analysis>,
    factor: Factor,
    values: Vec<f64>,
    /// Where each body's own block starts in the values.
    diagonal: Vec<u32>,
    /// Where each contact's blocks (a a), (a b), (b a), (b b) start in the values.
    places: Vec<[u32; 4]>,
    compliance: Vec<Block<D>>,
    /// dv.
    change: Vec<f64>,
}

const NOWHERE: u32 = u32::MAX;

/// What one multiply-add here is worth in contact space, whose solutions need no refinement.
const ROUGH: f64 = 2.0;

impl<const D: usize> BodySpace<D> {
    /// The system in body space where that is cheaper than contact space, else the matrix of contact space.
    pub fn of(rows: &Rows<D>, operator: &Operator<D>, analyses: &mut Analyses) -> Result<Self, Arc<Matrix>> {
        let (bodies, contacts) = (rows.bodies * rows.freedoms, rows.pairs.len() * D);
        // with so few contacts per body that contact space may be as cheap, the analyses decide
        let matrix = if 2 * bodies > contacts { operator.matrix(60 * rows.pairs.len() + 1000) } else { None };
        let mut other = matrix.map(|m| (analyses.of(&m.graph).flops, m));
        // without friction contact space nearly always wins: a bound saves the other graph and its analysis
        let least = rows.least_flops();
        if let Some((_, matrix)) = other.take_if(|(flops, _)| *flops < ROUGH * least) {
            return Err(matrix);
        }
        let graph = Arc::new(body_graph(rows));
        let analysis = analyses.of(&graph);
        if let Some((_, matrix)) = other.take_if(|(flops, _)| *flops < ROUGH * analysis.flops) {
            return Err(matrix);
        }
        Ok(BodySpace::with(rows.clone(), &graph, analysis))
    }

    /// The system in body space, whatever it costs.
    pub fn new(rows: Rows<D>) -> Self {
        let graph = body_graph(&rows);
        let analysis = Arc::new(Analysis::new(&graph));
        BodySpace::with(rows, &graph, analysis)
    }

    fn with(rows: Rows<D>, graph: &Graph, analysis: Arc<Analysis>) -> Self {
        let offset = |a: u32, b: u32| {
            if a == NO_BODY || b == NO_BODY {
                return NOWHERE;
            }
            graph.offsets[graph.position(a as usize, b as usize).expect("the pattern holds every pair")]
        };
        let places = rows
            .pairs
            .iter()
            .map(|&[a, b]| [offset(a, a), offset(a, b), offset(b, a), offset(b, b)])
            .collect();
        BodySpace {
            analysis,
            factor: Factor::default(),
            values: vec![0.0; graph.values()],
            diagonal: (0..rows.bodies as u32).map(|b| offset(b, b)).collect(),
            places,
            compliance: vec![[[0.0; D]; D]; rows.pairs.len()],
            change: vec![0.0; graph.scalars()],
            rows,
        }
    }

    /// Takes other rows of the same graph; false, and nothing done, where the graph is another.
    pub fn refill(&mut self, rows: &Rows<D>) -> bool {
        let stands = self.rows.has_graph_of(rows);
        if stands {
            self.rows.values.clone_from(&rows.values);
        }
        stands
    }

    /// Factorises 1 + B^T D^-1 B.
    pub fn factorize(&mut self, (blocks, least): Stiffness<'_, D>) -> bool {
        for (compliance, (block, least)) in self.compliance.iter_mut().zip(blocks.iter().zip(least)) {
            *compliance = stiffened_inverse(block, *least);
        }
        self.assembled()
    }

    /// Factorises 1 + B^T C B with C per contact, which may be singular.
    pub fn factorize_with(&mut self, compliance: impl Fn(usize) -> Block<D>) -> bool {
        self.compliance.iter_mut().enumerate().for_each(|(i, c)| *c = compliance(i));
        self.assembled()
    }

    fn assembled(&mut self) -> bool {
        in_widest(Assemble(self, ()));
        self.factor.factorize(&self.analysis, &self.values)
    }

    /// out = B (1 + B^T C B)^-1 B^T x.
    pub fn carry(&mut self, x: &[[f64; D]], out: &mut [[f64; D]]) {
        self.change.fill(0.0);
        for i in 0..self.rows.pairs.len() {
            self.rows.push(i, &x[i], &mut self.change);
        }
        self.factor.solve(&self.analysis, &mut self.change);
        for (i, out) in out.iter_mut().enumerate().take(self.rows.pairs.len()) {
            *out = self.rows.relative(i, &self.change);
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
        self.factor.solve(&self.analysis, &mut self.change);
        in_widest(PutBack(self, x));
    }

    #[inline(always)]
    fn assemble<const F: usize>(&mut self, _: ()) {
        self.values.fill(0.0);
        for &at in &self.diagonal {
            (0..F).for_each(|k| self.values[at as usize + k * F + k] = 1.0);
        }
        let contacts = self.places.iter().zip(self.rows.of_contacts::<F>());
        for (compliance, (places, both)) in self.compliance.iter().zip(contacts) {
            for side in 0..2 {
                if places[3 * side] == NOWHERE {
                    continue;
                }
                let product = multiplied(compliance, &both[side * D..][..D]);
                for other in 0..2 {
                    let at = places[2 * other + side];
                    if at != NOWHERE {
                        let target = &mut self.values[at as usize..][..F * F];
                        add_product(target, &both[other * D..][..D], &product);
                    }
                }
            }
        }
    }

    #[inline(always)]
    fn pull<const F: usize>(&mut self, x: &[[f64; D]]) {
        self.change.fill(0.0);
        let bodies = self.change.as_chunks_mut::<F>().0;
        let contacts = self.rows.pairs.iter().zip(self.rows.of_contacts::<F>());
        for ((pair, both), (compliance, x)) in contacts.zip(self.compliance.iter().zip(x)) {
            spread(both, *pair, &apply(compliance, x), bodies);
        }
    }

    #[inline(always)]
    fn put_back<const F: usize>(&self, x: &mut [[f64; D]]) {
        let bodies = self.change.as_chunks::<F>().0;
        let contacts = self.rows.pairs.iter().zip(self.rows.of_contacts::<F>());
        for ((pair, both), (compliance, x)) in contacts.zip(self.compliance.iter().zip(x)) {
            let seen: [f64; D] = relative(both, *pair, bodies);
            for k in 0..D {
                x[k] -= seen[k];
            }
            *x = apply(compliance, x);
        }
    }
}

/// The passes over contacts, compiled for the registers of the machine and for three or six freedoms.
macro_rules! pass {
    ($name:ident, $space:ty, $x:ty, $call:ident) => {
        struct $name<'a, const D: usize>($space, $x);

        impl<const D: usize> WithSimd for $name<'_, D> {
            type Output = ();
            #[inline(always)]
            fn with_simd<S: Simd>(self, _: S) {
                match self.0.rows.freedoms {
                    3 => self.0.$call::<3>(self.1),
                    _ => self.0.$call::<6>(self.1),
                }
            }
        }
    };
}

pass!(Assemble, &'a mut BodySpace<D>, (), assemble);
pass!(Pull, &'a mut BodySpace<D>, &'a [[f64; D]], pull);
pass!(PutBack, &'a BodySpace<D>, &'a mut [[f64; D]], put_back);

struct Product<'a, const D: usize>(&'a Rows<D>, &'a [[f64; D]], &'a mut [f64], &'a mut [[f64; D]]);

impl<const D: usize> WithSimd for Product<'_, D> {
    type Output = ();
    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        match self.0.freedoms {
            3 => self.0.product_in::<3>(self.1, self.2, self.3),
            _ => self.0.product_in::<6>(self.1, self.2, self.3),
        }
    }
}

impl<const D: usize> Rows<D> {
    /// B_i B_j^T: a block of W.
    pub fn coupling(&self, i: usize, j: usize) -> [[f64; D]; D] {
        let mut block = [[0.0; D]; D];
        let width = D * self.freedoms;
        for (own, &a) in self.pairs[i].iter().enumerate().filter(|e| *e.1 != NO_BODY) {
            for (other, _) in self.pairs[j].iter().enumerate().filter(|e| *e.1 == a) {
                let left = &self.values[(2 * i + own) * width..][..width];
                let right = &self.values[(2 * j + other) * width..][..width];
                for (block, row) in block.iter_mut().zip(left.chunks_exact(self.freedoms)) {
                    for (value, column) in block.iter_mut().zip(right.chunks_exact(self.freedoms)) {
                        *value += row.iter().zip(column).map(|(a, b)| a * b).sum::<f64>();
                    }
                }
            }
        }
        block
    }
    /// The same of a contact with itself, between two bodies: a diagonal block of W.
    pub fn own_block(&self, i: usize) -> [[f64; D]; D] {
        if self.freedoms == 3 { self.own_block_of::<3>(i) } else { self.own_block_of::<6>(i) }
    }
    fn own_block_of<const F: usize>(&self, i: usize) -> [[f64; D]; D] {
        let mut block = [[0.0; D]; D];
        let both = self.values[2 * i * D * F..][..2 * D * F].as_chunks::<F>().0;
        for (rows, _) in both.chunks_exact(D).zip(self.pairs[i]).filter(|(_, body)| *body != NO_BODY) {
            for r in 0..D {
                for c in 0..=r {
                    block[r][c] += rows[r].iter().zip(&rows[c]).map(|(a, b)| a * b).sum::<f64>();
                }
            }
        }
        for r in 0..D {
            for c in r + 1..D {
                block[r][c] = block[c][r];
            }
        }
        block
    }
    /// True when the contacts join the same bodies.
    pub fn has_graph_of(&self, other: &Self) -> bool {
        (self.freedoms, self.bodies) == (other.freedoms, other.bodies) && self.pairs == other.pairs
    }
    /// Multiply-adds that factorising in body space takes at least: F bodies' freedoms eliminated at once are 2/3 F^3, and
    /// another 2 F^3 + F^3 where F or more rows are left to them. All but one body of those that hang together leave a
    /// neighbour to others, so at least half of the bodies that have one do.
    fn least_flops(&self) -> f64 {
        let mut joined = vec![false; self.bodies];
        for &[a, b] in self.pairs.iter().filter(|pair| !pair.contains(&NO_BODY)) {
            (joined[a as usize], joined[b as usize]) = (true, true);
        }
        let leaving = 0.5 * joined.iter().filter(|j| **j).count() as f64;
        let cube = (self.freedoms as f64).powi(3);
        (2.0 / 3.0 * self.bodies as f64 + 3.0 * leaving) * cube
    }
    /// Makes these equal to others without giving memory back.
    pub fn copy_from(&mut self, other: &Self) {
        (self.freedoms, self.bodies) = (other.freedoms, other.bodies);
        self.pairs.clone_from(&other.pairs);
        self.values.clone_from(&other.values);
    }
    /// The rows on both bodies, contact after contact.
    #[inline(always)]
    fn of_contacts<const F: usize>(&self) -> impl Iterator<Item = &[[f64; F]]> {
        self.values.as_chunks::<F>().0.chunks_exact(2 * D)
    }
    /// The rows of one contact.
    #[inline(always)]
    fn of<const F: usize>(&self, i: usize) -> &[[f64; F]] {
        self.values[i * 2 * D * F..(i + 1) * 2 * D * F].as_chunks::<F>().0
    }
    /// v += B_i^T x.
    #[inline(always)]
    pub fn push(&self, i: usize, x: &[f64; D], v: &mut [f64]) {
        match self.freedoms {
            3 => spread(self.of::<3>(i), self.pairs[i], x, v.as_chunks_mut().0),
            _ => spread(self.of::<6>(i), self.pairs[i], x, v.as_chunks_mut().0),
        }
    }
    /// B_i v.
    #[inline(always)]
    pub fn relative(&self, i: usize, v: &[f64]) -> [f64; D] {
        match self.freedoms {
            3 => relative(self.of::<3>(i), self.pairs[i], v.as_chunks().0),
            _ => relative(self.of::<6>(i), self.pairs[i], v.as_chunks().0),
        }
    }
    /// W~ x through the bodies: B (B^T x); `change` holds B^T x afterwards.
    pub fn product(&self, x: &[[f64; D]], change: &mut Vec<f64>, out: &mut [[f64; D]]) {
        change.resize(self.bodies * self.freedoms, 0.0);
        in_widest(Product(self, x, change, out));
    }

    #[inline(always)]
    fn product_in<const F: usize>(&self, x: &[[f64; D]], change: &mut [f64], out: &mut [[f64; D]]) {
        change.fill(0.0);
        let bodies = change.as_chunks_mut::<F>().0;
        for ((pair, both), x) in self.pairs.iter().zip(self.of_contacts::<F>()).zip(x) {
            spread(both, *pair, x, bodies);
        }
        for ((pair, both), out) in self.pairs.iter().zip(self.of_contacts::<F>()).zip(out) {
            *out = relative(both, *pair, bodies);
        }
    }
}

/// v += B_i^T x.
#[inline(always)]
fn spread<const D: usize, const F: usize>(
    both: &[[f64; F]],
    pair: [u32; 2],
    x: &[f64; D],
    bodies: &mut [[f64; F]],
) {
    for side in 0..2 {
        if pair[side] == NO_BODY {
            continue;
        }
        let rows = &both[side * D..][..D];
        let body = &mut bodies[pair[side] as usize];
        let mut sum = *body;
        for k in 0..D {
            for j in 0..F {
                sum[j] += rows[k][j] * x[k];
            }
        }
        *body = sum;
    }
}

/// B_i v.
#[inline(always)]
fn relative<const D: usize, const F: usize>(
    both: &[[f64; F]],
    pair: [u32; 2],
    bodies: &[[f64; F]],
) -> [f64; D] {
    let mut out = [0.0; D];
    for side in 0..2 {
        if pair[side] == NO_BODY {
            continue;
        }
        let rows = &both[side * D..][..D];
        let body = &bodies[pair[side] as usize];
        for k in 0..D {
            for j in 0..F {
                out[k] += rows[k][j] * body[j];
            }
        }
    }
    out
}

/// C x.
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

/// C B for one side: D x F.
#[inline(always)]
fn multiplied<const D: usize, const F: usize>(c: &Block<D>, b: &[[f64; F]]) -> [[f64; F]; D] {
    let mut out = [[0.0; F]; D];
    for r in 0..D {
        for k in 0..D {
            for j in 0..F {
                out[r][j] += c[r][k] * b[k][j];
            }
        }
    }
    out
}

/// target += B^T (C B).
#[inline(always)]
fn add_product<const D: usize, const F: usize>(
    target: &mut [f64],
    left: &[[f64; F]],
    product: &[[f64; F]; D],
) {
    for (i, target) in target.as_chunks_mut::<F>().0.iter_mut().enumerate() {
        let mut sum = *target;
        for r in 0..D {
            for j in 0..F {
                sum[j] += left[r][i] * product[r][j];
            }
        }
        *target = sum;
    }
}

/// Which bodies share a contact.
fn body_graph<const D: usize>(rows: &Rows<D>) -> Graph {
    let mut near: Vec<Vec<u32>> = (0..rows.bodies as u32).map(|b| vec![b]).collect();
    for &[a, b] in &rows.pairs {
        if a != NO_BODY && b != NO_BODY {
            near[a as usize].push(b);
            near[b as usize].push(a);
        }
    }
    let (mut starts, mut neighbours) = (vec![0u32], Vec::new());
    for row in &mut near {
        row.sort_unstable();
        row.dedup();
        neighbours.extend_from_slice(row);
        starts.push(neighbours.len() as u32);
    }
    Graph::new(vec![rows.freedoms as u32; rows.bodies], starts, neighbours)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rows of contacts between bodies of six freedoms, of which only who touches whom counts.
    fn rows(bodies: usize, pairs: Vec<[u32; 2]>) -> Rows<1> {
        let values = vec![0.0; 12 * pairs.len()];
        Rows { freedoms: 6, bodies, pairs, values }
    }

    #[test]
    fn no_factorisation_in_body_space_takes_less_than_the_least() {
        let chain = |n: u32| (1..n).map(|b| [b - 1, b]).collect::<Vec<_>>();
        let star = |n: u32| (1..n).map(|b| [0, b]).collect::<Vec<_>>();
        let couples = |n: u32| (0..n / 2).map(|b| [2 * b, 2 * b + 1]).collect::<Vec<_>>();
        let all = |n: u32| (0..n).flat_map(|a| (0..a).map(move |b| [a, b])).collect::<Vec<_>>();
        let alone = |n: u32| (0..n).map(|b| [b, NO_BODY]).collect::<Vec<_>>();
        // next to each other and far apart, by a fixed rule
        let mixed =
            |n: u32| (0..3 * n).map(|k| [k % n, (k * k + 7 * k + 1) % n]).filter(|[a, b]| a != b).collect();
        for n in [2, 3, 8, 30, 90] {
            for pairs in [chain(n), star(n), couples(n), all(n), alone(n), mixed(n)] {
                let rows = rows(n as usize, pairs);
                let flops = Analysis::new(&body_graph(&rows)).flops;
                assert!(rows.least_flops() <= flops, "{n}: {} > {flops}", rows.least_flops());
            }
        }
    }
}
