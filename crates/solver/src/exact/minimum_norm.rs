//! The least impulses of all that solve a problem with the same velocities. With u known the solutions are convex: r in
//! the faces F that u allows, with W r the same as that of the solution r* found. The least of them is r = P_F(v) with
//! v = B l, W = B B^T, where the convex g(l) = |P_F(B l)|^2 / 2 - r*.(B l) is least: a Newton method with line search on
//! g, (delta + B^T P' B) dl = -B^T (P_F(v) - r*), in body space where bodies are known and with a root of W where only W is
//! (theory chapter 7). Steps of v itself, (delta + W P') dv = -W (P_F(v) - r*), lose the range of W to rounding. The velocities come from a cold start and are
//! solved to rounding first, so neither the order of contacts nor a start enters.

use super::blocks::Blocks;
use super::bodies::{BodySpace, Rows};
use super::face::{Face, Nearest};
use super::newton::finish;
use super::operator::{Matrix, Operator};
use super::root::Root;
use super::stage::{Solve, StageEnd};
use super::system::Block;

/// Newton steps on the natural map that solve the velocities to rounding.
const SHARPEN: usize = 8;
/// Speeds below this share of the largest velocity count as rest: half-way, in digits, between rounding and what is
/// asked for.
pub const REST: f64 = 1e-9;
/// The velocities must be known this well, as a share of the largest, for `REST` to tell rest from motion.
pub const KNOWN: f64 = 0.1 * REST;
/// delta, as a share of the mean norm of the diagonal blocks of W: a step leaves about delta over W's least eigenvalue of
/// what is off, and rounding over delta.
const DELTA: f64 = 1e-10;
/// Most steps on g.
const STEPS: usize = 60;
/// The velocities of the answer are those found to this share of the largest.
const SAME: f64 = 1e-12;
/// Largest entry that W and its transpose may differ by, as a share of the largest diagonal norm.
const SYMMETRIC: f64 = 1e-12;

/// The least impulses with the velocities of the best iterate, in the problem's own units; `None` where the velocities
/// are not known well enough, or no step leads on.
pub fn least<const D: usize>(solve: &mut Solve<'_, D>) -> Option<Vec<[f64; D]>> {
    let mut space = Space::of(solve.blocks)?;
    let asked = std::mem::replace(&mut solve.tolerance, f64::EPSILON);
    let start = solve.best.clone();
    let end = finish(solve, &start, SHARPEN);
    solve.tolerance = asked;
    if solve.best_errors.worst() > KNOWN && end != StageEnd::Solved {
        return None;
    }
    let blocks = solve.blocks;
    let mut found = vec![[0.0; D]; blocks.velocity.len()];
    solve.scaled.to_impulses(&solve.best, &mut found);
    let faces = faces(blocks, &found);
    let zero = vec![[0.0; D]; found.len()];
    let size = blocks.largest_velocity();
    let sought = Sought { operator: &blocks.operator, size, faces: &faces, found: &found, centre: &zero };
    sought.find(&mut space, &mut || {
        let left = !solve.spent();
        solve.system.factorisations += usize::from(left);
        left
    })
}

/// The faces that the velocities of impulses allow.
fn faces<const D: usize>(blocks: &Blocks<D>, r: &[[f64; D]]) -> Vec<Face<D>> {
    let mut u = vec![[0.0; D]; r.len()];
    blocks.operator.product(r, &mut u, &mut Vec::new());
    let rest = REST * blocks.largest_velocity();
    (0..blocks.count())
        .map(|i| {
            let u = std::array::from_fn(|k| u[i][k] + blocks.velocity[i][k]);
            Face::of(&u, &r[i], blocks.friction[i], rest)
        })
        .collect()
}

/// What is looked for: the point of the faces nearest to a centre whose W r is that of what was found.
pub struct Sought<'a, F, const D: usize> {
    /// W.
    pub operator: &'a Operator<D>,
    /// Largest velocity \[m/s\].
    pub size: f64,
    /// Where impulses may lie, per contact.
    pub faces: &'a [F],
    /// r*.
    pub found: &'a [[f64; D]],
    /// The centre: zero for the least impulses.
    pub centre: &'a [[f64; D]],
}

impl<F: Nearest<D>, const D: usize> Sought<'_, F, D> {
    /// The point, `None` where no step leads to it; `ask` counts a factorisation, and forbids it by false.
    pub fn find(&self, space: &mut Space<D>, ask: &mut dyn FnMut() -> bool) -> Option<Vec<[f64; D]>> {
        let mut search = Search::new(self);
        let mut best = (f64::INFINITY, self.found.to_vec());
        let mut stalled = 0;
        for _ in 0..STEPS {
            let off = search.off();
            stalled = if off < 0.5 * best.0 { 0 } else { stalled + 1 };
            if off < best.0 {
                best = (off, search.impulses.clone());
            }
            let done = best.0 <= f64::EPSILON || (best.0 <= SAME && stalled > 1);
            if done || !ask() || !search.step(space) {
                break;
            }
        }
        (best.0 <= SAME).then_some(best.1)
    }
}

/// An iterate of the method.
struct Search<'a, F, const D: usize> {
    sought: &'a Sought<'a, F, D>,
    /// v.
    point: Vec<[f64; D]>,
    /// P_F(v) and P'.
    impulses: Vec<[f64; D]>,
    derivative: Vec<Block<D>>,
    /// P_F(v) - r*.
    apart: Vec<[f64; D]>,
    /// g.
    value: f64,
}

impl<'a, F: Nearest<D>, const D: usize> Search<'a, F, D> {
    /// The centre, seen from inside the faces: where no bound presses, the first step is the last.
    fn new(sought: &'a Sought<'a, F, D>) -> Self {
        let zero = vec![[0.0; D]; sought.found.len()];
        let mut search = Search {
            sought,
            point: sought.centre.to_vec(),
            impulses: zero.clone(),
            derivative: vec![[[0.0; D]; D]; sought.faces.len()],
            apart: zero,
            value: 0.0,
        };
        search.look();
        search.derivative = sought.faces.iter().map(F::inside).collect();
        search
    }
    /// Largest change of a velocity against the solution found, as a share of the largest.
    fn off(&self) -> f64 {
        let mut change = vec![[0.0; D]; self.apart.len()];
        self.sought.operator.product(&self.apart, &mut change, &mut Vec::new());
        let largest = change.as_flattened().iter().fold(0.0_f64, |m, u| m.max(u.abs()));
        largest / self.sought.size
    }
    /// One step; false where none leads down.
    fn step(&mut self, space: &mut Space<D>) -> bool {
        let Some(direction) = space.direction(&self.derivative, &self.apart) else { return false };
        let slope = dot(&self.apart, &direction);
        let start = self.point.clone();
        let before = self.value;
        let rounding = 1e-14 * (before.abs() + dot(&self.impulses, &self.impulses));
        let mut length = 1.0;
        for _ in 0..40 {
            for ((point, start), d) in self.point.iter_mut().zip(&start).zip(&direction) {
                *point = std::array::from_fn(|k| start[k] + length * d[k]);
            }
            self.look();
            if self.value <= before + 1e-4 * length * slope + rounding {
                return true;
            }
            length *= 0.5;
        }
        false
    }
    /// Everything that follows from v.
    fn look(&mut self) {
        let found = self.sought.found;
        for (i, face) in self.sought.faces.iter().enumerate() {
            (self.impulses[i], self.derivative[i]) = face.project(&self.point[i]);
        }
        for (apart, (own, found)) in self.apart.iter_mut().zip(self.impulses.iter().zip(found)) {
            *apart = std::array::from_fn(|k| own[k] - found[k]);
        }
        // P.v - |P|^2 / 2 is |P|^2 / 2 where the faces are cones
        self.value = dot(&self.impulses, &self.point)
            - 0.5 * dot(&self.impulses, &self.impulses)
            - dot(found, &self.point);
    }
}

fn dot<const D: usize>(a: &[[f64; D]], b: &[[f64; D]]) -> f64 {
    a.as_flattened().iter().zip(b.as_flattened()).map(|(a, b)| a * b).sum()
}

/// The linear systems of the steps.
pub struct Space<const D: usize> {
    form: Form<D>,
    delta: f64,
}

enum Form<const D: usize> {
    Bodies(Box<BodySpace<D>>),
    Root(Root<D>),
}

impl<const D: usize> Space<D> {
    /// `None` where W is not symmetric, which has no B, or too large for its root.
    fn of(blocks: &Blocks<D>) -> Option<Self> {
        let count = blocks.count();
        let largest = blocks.norms[..count].iter().fold(0.0_f64, |m, n| m.max(*n));
        let mean = blocks.norms[..count].iter().sum::<f64>() / count.max(1) as f64;
        let delta = DELTA * mean;
        let form = match &blocks.operator {
            Operator::Bodies(rows) => Form::Bodies(Box::new(BodySpace::new(rows.clone()))),
            Operator::Matrix(matrix) => {
                if asymmetry::<D>(matrix) > SYMMETRIC * largest {
                    return None;
                }
                Form::Root(Root::of(matrix)?)
            }
        };
        Some(Space { form, delta })
    }
    /// The systems on bodies, with the mean norm of W's diagonal blocks.
    pub fn on_bodies(rows: Rows<D>, mean: f64) -> Self {
        Space { form: Form::Bodies(Box::new(BodySpace::new(rows))), delta: DELTA * mean }
    }
    /// dv for P' and P_F(v) - r*; `None` where the numbers end.
    fn direction(&mut self, derivative: &[Block<D>], apart: &[[f64; D]]) -> Option<Vec<[f64; D]>> {
        let delta = self.delta;
        let mut out = vec![[0.0; D]; apart.len()];
        let solved = match &mut self.form {
            Form::Bodies(space) => {
                // 1 + B^T (P' / delta) B is the matrix above over delta
                let solved = space.factorize_with(|i| derivative[i].map(|row| row.map(|p| p / delta)));
                space.carry(apart, &mut out);
                out.as_flattened_mut().iter_mut().for_each(|v| *v /= delta);
                solved
            }
            Form::Root(root) => root.carry(derivative, delta, apart, &mut out),
        };
        out.as_flattened_mut().iter_mut().for_each(|v| *v = -*v);
        (solved && out.as_flattened().iter().all(|v| v.is_finite())).then_some(out)
    }
}

/// Largest entry of W - W^T.
fn asymmetry<const D: usize>(matrix: &Matrix) -> f64 {
    let graph = &matrix.graph;
    let mut largest = 0.0_f64;
    for i in 0..graph.nodes() {
        for at in graph.row(i) {
            let j = graph.neighbours[at] as usize;
            let back = graph.position(j, i).expect("the pattern is symmetric");
            let (own, other) = (graph.offsets[at] as usize, graph.offsets[back] as usize);
            for (r, c) in (0..D).flat_map(|r| (0..D).map(move |c| (r, c))) {
                let difference = matrix.values[own + r * D + c] - matrix.values[other + c * D + r];
                largest = largest.max(difference.abs());
            }
        }
    }
    largest
}
