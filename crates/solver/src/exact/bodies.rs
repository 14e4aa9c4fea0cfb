//! Body space: with W~ = B B^T, B the contacts' rows on bodies of unit mass, (1 + B^T D^-1 B) dv = B^T D^-1 rhs and
//! dx = D^-1 (rhs - B dv). One node per body: where many contacts share few bodies the factors are far smaller.

use super::operator::Operator;
use super::system::{Block, inverse};
use crate::linear::{Analysis, Factor, Graph};

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

/// Most freedoms of a body.
const MOST: usize = 6;

/// The system with bodies as nodes.
#[derive(Clone, Debug, Default)]
pub struct BodySpace<const D: usize> {
    rows: Rows<D>,
    graph: Graph,
    analysis: Analysis,
    factor: Factor,
    values: Vec<f64>,
    /// Where each contact's blocks (a a), (a b), (b a), (b b) start in the values.
    places: Vec<[u32; 4]>,
    compliance: Vec<Block<D>>,
    /// dv.
    change: Vec<f64>,
}

const NOWHERE: u32 = u32::MAX;

impl<const D: usize> BodySpace<D> {
    /// The system in body space where that is cheaper than contact space.
    pub fn of(operator: &Operator<D>) -> Option<Self> {
        let Operator::Bodies(rows) = operator else { return None };
        let (bodies, contacts) = (rows.bodies * rows.freedoms, rows.pairs.len() * D);
        let graph = body_graph(rows);
        let analysis = Analysis::new(&graph);
        // with so few contacts per body that contact space may be cheaper, the analyses decide
        if 2 * bodies > contacts {
            let matrix = operator.matrix(60 * rows.pairs.len() + 1000);
            if matrix.is_some_and(|m| Analysis::new(&m.graph).flops < analysis.flops) {
                return None;
            }
        }
        Some(BodySpace::with(rows.clone(), graph, analysis))
    }

    /// The system in body space, whatever it costs.
    pub fn new(rows: Rows<D>) -> Self {
        let graph = body_graph(&rows);
        let analysis = Analysis::new(&graph);
        BodySpace::with(rows, graph, analysis)
    }

    fn with(rows: Rows<D>, graph: Graph, analysis: Analysis) -> Self {
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
            places,
            compliance: vec![[[0.0; D]; D]; rows.pairs.len()],
            change: vec![0.0; graph.scalars()],
            rows,
            graph,
        }
    }

    /// Factorises 1 + B^T D^-1 B.
    pub fn factorize(&mut self, blocks: &[Block<D>]) -> bool {
        self.factorize_with(|i| inverse(&blocks[i]))
    }

    /// Factorises 1 + B^T C B with C per contact, which may be singular.
    pub fn factorize_with(&mut self, compliance: impl Fn(usize) -> Block<D>) -> bool {
        let f = self.rows.freedoms;
        self.values.fill(0.0);
        for i in 0..self.graph.nodes() {
            let at = self.graph.offsets[self.graph.position(i, i).expect("a diagonal")] as usize;
            (0..f).for_each(|k| self.values[at + k * f + k] = 1.0);
        }
        for (i, places) in self.places.iter().enumerate() {
            let compliance = compliance(i);
            self.compliance[i] = compliance;
            let both = &self.rows.values[i * 2 * D * f..(i + 1) * 2 * D * f];
            for (side, right) in both.chunks_exact(D * f).enumerate() {
                if self.rows.pairs[i][side] == NO_BODY {
                    continue;
                }
                let product = multiplied(&compliance, right, f);
                for (other, left) in both.chunks_exact(D * f).enumerate() {
                    let at = places[2 * other + side];
                    if at != NOWHERE {
                        add_product(&mut self.values[at as usize..][..f * f], left, &product, f);
                    }
                }
            }
        }
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

    /// The sign of the determinant of the factorised matrix.
    pub fn determinant_sign(&self) -> f64 {
        self.factor.determinant_sign(&self.analysis)
    }

    /// Replaces rhs by dx.
    pub fn solve(&mut self, x: &mut [[f64; D]]) {
        let f = self.rows.freedoms;
        self.change.fill(0.0);
        for (i, pair) in self.rows.pairs.iter().enumerate() {
            let pull = apply(&self.compliance[i], &x[i]);
            spread(&self.rows.values[i * 2 * D * f..], *pair, f, &pull, &mut self.change);
        }
        self.factor.solve(&self.analysis, &mut self.change);
        for (i, pair) in self.rows.pairs.iter().enumerate() {
            let seen: [f64; D] = relative(&self.rows.values[i * 2 * D * f..], *pair, f, &self.change);
            let left = std::array::from_fn(|k| x[i][k] - seen[k]);
            x[i] = apply(&self.compliance[i], &left);
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
    /// v += B_i^T x.
    #[inline(always)]
    pub fn push(&self, i: usize, x: &[f64; D], v: &mut [f64]) {
        spread(&self.values[i * 2 * D * self.freedoms..], self.pairs[i], self.freedoms, x, v);
    }
    /// B_i v.
    #[inline(always)]
    pub fn relative(&self, i: usize, v: &[f64]) -> [f64; D] {
        relative(&self.values[i * 2 * D * self.freedoms..], self.pairs[i], self.freedoms, v)
    }
    /// W~ x through the bodies: B (B^T x); `change` holds B^T x afterwards.
    pub fn product(&self, x: &[[f64; D]], change: &mut Vec<f64>, out: &mut [[f64; D]]) {
        change.clear();
        change.resize(self.bodies * self.freedoms, 0.0);
        for (i, pair) in self.pairs.iter().enumerate() {
            spread(&self.values[i * 2 * D * self.freedoms..], *pair, self.freedoms, &x[i], change);
        }
        for (i, pair) in self.pairs.iter().enumerate() {
            out[i] = relative(&self.values[i * 2 * D * self.freedoms..], *pair, self.freedoms, change);
        }
    }
}

/// v += B_i^T x.
#[inline(always)]
fn spread<const D: usize>(rows: &[f64], pair: [u32; 2], f: usize, x: &[f64; D], v: &mut [f64]) {
    for (side, &body) in pair.iter().enumerate() {
        if body == NO_BODY {
            continue;
        }
        let v = &mut v[body as usize * f..][..f];
        for (row, x) in rows[side * D * f..][..D * f].chunks_exact(f).zip(x) {
            row.iter().zip(v.iter_mut()).for_each(|(b, v)| *v += b * x);
        }
    }
}

/// B_i v.
#[inline(always)]
fn relative<const D: usize>(rows: &[f64], pair: [u32; 2], f: usize, v: &[f64]) -> [f64; D] {
    let mut out = [0.0; D];
    for (side, &body) in pair.iter().enumerate() {
        if body == NO_BODY {
            continue;
        }
        let v = &v[body as usize * f..][..f];
        for (row, out) in rows[side * D * f..][..D * f].chunks_exact(f).zip(&mut out) {
            *out += row.iter().zip(v).map(|(b, v)| b * v).sum::<f64>();
        }
    }
    out
}

#[inline(always)]
fn apply<const D: usize>(m: &Block<D>, v: &[f64; D]) -> [f64; D] {
    std::array::from_fn(|r| (0..D).map(|c| m[r][c] * v[c]).sum())
}

/// C B for one side: D x f.
#[inline(always)]
fn multiplied<const D: usize>(c: &Block<D>, b: &[f64], f: usize) -> [[f64; MOST]; D] {
    let mut out = [[0.0; MOST]; D];
    for r in 0..D {
        for k in 0..D {
            for j in 0..f {
                out[r][j] += c[r][k] * b[k * f + j];
            }
        }
    }
    out
}

/// target += B^T (C B).
#[inline(always)]
fn add_product<const D: usize>(target: &mut [f64], left: &[f64], product: &[[f64; MOST]; D], f: usize) {
    for (r, product) in product.iter().enumerate() {
        for i in 0..f {
            let factor = left[r * f + i];
            for j in 0..f {
                target[i * f + j] += factor * product[j];
            }
        }
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
