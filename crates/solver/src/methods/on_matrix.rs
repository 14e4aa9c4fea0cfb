//! First-order methods on u = W r + q: sweeps over the compressed rows of W, gradient steps by products with it. Every
//! pass costs as much as W has entries. Knows no method and no bodies.

use crate::cone::nearest_normal;
use crate::cone_matrix::spectral_norm;
use crate::friction_problem::{FrictionProblem, measure, natural_map_squared, project_on_cone};
use crate::friction_solver::{FrictionOutcome, FrictionSettings, FrictionSolver, Stage};
use crate::methods::first_order::{Budget, FirstOrder, Memory, Method, Point};
use crate::watch::Watch;
use std::marker::PhantomData;
use std::time::Instant;

/// A first-order method on matrices; holds memory between solves, nothing else.
#[derive(Clone, Debug, Default)]
pub struct OnMatrix<M> {
    blocks: Vec<Block>,
    at: RowPoint,
    memory: Memory<RowPoint>,
    method: PhantomData<M>,
}

impl<M: Method> FrictionSolver for OnMatrix<M> {
    fn name(&self) -> &'static str {
        M::NAME
    }
    fn solve(
        &mut self,
        problem: &FrictionProblem,
        settings: &FrictionSettings,
        impulses: &mut [f64],
        watch: &mut Watch,
    ) -> FrictionOutcome {
        let start = Instant::now();
        self.blocks.clear();
        self.blocks.extend((0..problem.contacts()).map(|i| Block::of(problem, i)));
        let length = problem.velocity.iter().map(|u| u * u).sum::<f64>().sqrt();
        let form = Rows { problem, blocks: &self.blocks, scale: if length > 0.0 { length } else { 1.0 } };
        let given = &mut self.at.impulses;
        given.clear();
        given.extend(impulses.iter().map(|r| if r.is_finite() { *r } else { 0.0 }));
        for (r, &mu) in given.chunks_exact_mut(problem.dimension).zip(&problem.friction) {
            project_on_cone(r, mu);
        }
        impulses.copy_from_slice(given);
        form.refresh(&mut self.at);
        // the measure is a length over all contacts: no entry of it is larger
        let small_change = 10.0 * settings.tolerance * form.scale;
        let budget = Budget { iterations: settings.iterations, tolerance: settings.tolerance, small_change };
        let end = M::run(&form, &budget, &mut self.at, &mut self.memory, watch);
        let finite = self.at.impulses.iter().all(|r| r.is_finite());
        if finite {
            impulses.copy_from_slice(&self.at.impulses);
        }
        let seconds = start.elapsed().as_secs_f64();
        let measure = measure(problem, impulses);
        let solved = measure.solves(settings.tolerance);
        let reason = match (solved, finite, end.interrupted) {
            (true, ..) => String::new(),
            (_, false, _) => format!(
                "the impulses outgrow all numbers after {} iterations: has the problem a solution?",
                end.iterations
            ),
            (_, _, true) => "interrupted".into(),
            _ => format!("{} iterations are spent", end.iterations),
        };
        let stages = vec![Stage { name: M::STAGE, iterations: end.iterations }];
        FrictionOutcome {
            solved,
            measure,
            stages,
            factorisations: 0,
            seconds,
            reason,
            strict_feasibility: None,
        }
    }
}

/// Impulses, and the velocities W r + q after them.
#[derive(Clone, Debug, Default)]
pub struct RowPoint {
    impulses: Vec<f64>,
    velocities: Vec<f64>,
}

impl Point for RowPoint {
    fn copy_from(&mut self, other: &Self) {
        self.impulses.clone_from(&other.impulses);
        self.velocities.clone_from(&other.velocities);
    }
    fn blend(&mut self, own: f64, (f, x): (f64, &Self), (g, y): (f64, &Self)) {
        let mix = |mine: &mut [f64], xs: &[f64], ys: &[f64]| {
            for ((m, x), y) in mine.iter_mut().zip(xs).zip(ys) {
                *m = own * *m + f * x + g * y;
            }
        };
        mix(&mut self.impulses, &x.impulses, &y.impulses);
        mix(&mut self.velocities, &x.velocities, &y.velocities);
    }
}

/// What a method needs of the diagonal block of a contact.
#[derive(Clone, Copy, Debug)]
struct Block {
    /// W_nn.
    normal: f64,
    /// The norm of W_tt: the scalar friction step 1/|W_tt| has Coulomb's law as its fixed point.
    tangential: f64,
    /// W_tn: what a unit normal impulse adds to the slip.
    coupling: [f64; 2],
    /// The norm of the block, in which `Measure::scaled` measures.
    norm: f64,
}

impl Block {
    fn of(problem: &FrictionProblem, contact: usize) -> Self {
        let d = problem.dimension;
        let range = d * contact..d * contact + d;
        let mut rows = vec![vec![0.0; d]; d];
        for (row, i) in rows.iter_mut().zip(range.clone()) {
            let inside = problem.matrix.row(i).filter(|(j, _)| range.contains(j));
            inside.for_each(|(j, x)| row[j - range.start] += x);
        }
        let or_one = |x: f64| if x > 0.0 { x } else { 1.0 };
        let tangents: Vec<Vec<f64>> = rows[1..].iter().map(|row| row[1..].to_vec()).collect();
        let mut coupling = [0.0; 2];
        coupling.iter_mut().zip(&rows[1..]).for_each(|(c, row)| *c = row[0]);
        let norm = or_one(norm_of(&rows));
        let normal = if rows[0][0] > 0.0 { rows[0][0] } else { norm };
        let tangential = norm_of(&tangents);
        let tangential = if tangential > 0.0 { tangential } else { normal };
        Block { normal, tangential, coupling, norm }
    }
}

/// Spectral norm of a square block of at most three rows.
fn norm_of(rows: &[Vec<f64>]) -> f64 {
    let block = rows.concat();
    match rows.len() {
        0 => 0.0,
        1 => spectral_norm::<1>(&block),
        2 => spectral_norm::<2>(&block),
        _ => spectral_norm::<3>(&block),
    }
}

/// A problem with its diagonal blocks.
struct Rows<'a> {
    problem: &'a FrictionProblem,
    blocks: &'a [Block],
    /// |q|, or 1.
    scale: f64,
}

impl Rows<'_> {
    /// (W r + q)_i.
    fn velocity(&self, r: &[f64], i: usize) -> f64 {
        self.problem.matrix.row(i).map(|(j, x)| x * r[j]).sum::<f64>() + self.problem.velocity[i]
    }
}

impl FirstOrder for Rows<'_> {
    type Point = RowPoint;
    const SWEEPS_KEEP_VELOCITIES: bool = false;

    fn sweep(&self, at: &mut RowPoint) -> f64 {
        let (d, r) = (self.problem.dimension, &mut at.impulses);
        let mut change: f64 = 0.0;
        for (i, (block, &mu)) in self.blocks.iter().zip(&self.problem.friction).enumerate() {
            let first = d * i;
            let normal = (r[first] - self.velocity(r, first) / block.normal).max(0.0);
            let delta = normal - r[first];
            change = change.max((delta * block.normal).abs());
            if mu > 0.0 && d > 1 {
                let (mut trial, mut size) = ([0.0; 2], 0.0);
                for k in 0..d - 1 {
                    let slip = self.velocity(r, first + 1 + k) + block.coupling[k] * delta;
                    trial[k] = r[first + 1 + k] - slip / block.tangential;
                    size += trial[k] * trial[k];
                }
                let size = size.sqrt();
                let shrink = if size > mu * normal { mu * normal / size } else { 1.0 };
                for k in 0..d - 1 {
                    let tangent = shrink * trial[k];
                    change = change.max(((tangent - r[first + 1 + k]) * block.tangential).abs());
                    r[first + 1 + k] = tangent;
                }
            }
            r[first] = normal;
        }
        change
    }

    fn descend(&self, from: &RowPoint, step: f64, to: &mut RowPoint) {
        let d = self.problem.dimension;
        for (i, (block, &mu)) in self.blocks.iter().zip(&self.problem.friction).enumerate() {
            let range = d * i..d * i + d;
            let (r, u) = (&from.impulses[range.clone()], &from.velocities[range.clone()]);
            let new = &mut to.impulses[range];
            let length = |x: &[f64]| x.iter().map(|a| a * a).sum::<f64>().sqrt();
            let stretch = (block.tangential / block.normal).sqrt();
            let lowered = r[0] - step / block.normal * (u[0] + mu * length(&u[1..]));
            for k in 1..d {
                new[k] = r[k] - step / block.tangential * u[k];
            }
            let size = length(&new[1..]);
            new[0] = nearest_normal(lowered, &[stretch * size], stretch * mu);
            let limit = mu * new[0];
            let shrink = if size > limit { limit / size } else { 1.0 };
            new[1..].iter_mut().for_each(|t| *t *= shrink);
        }
        self.refresh(to);
    }

    fn refresh(&self, at: &mut RowPoint) {
        at.velocities.clear();
        at.velocities.extend((0..at.impulses.len()).map(|i| self.velocity(&at.impulses, i)));
    }

    fn product(&self, [x, y]: [&RowPoint; 2], [z, w]: [&RowPoint; 2]) -> f64 {
        let d = self.problem.dimension;
        let mut sum = 0.0;
        for (i, block) in self.blocks.iter().enumerate() {
            let part = |k: usize| (x.impulses[k] - y.impulses[k]) * (z.impulses[k] - w.impulses[k]);
            let tangential: f64 = (d * i + 1..d * i + d).map(part).sum();
            sum += part(d * i) * block.normal + tangential * block.tangential;
        }
        sum
    }

    fn curvature(&self, x: &RowPoint, y: &RowPoint) -> f64 {
        let impulses = x.impulses.iter().zip(&y.impulses);
        let velocities = x.velocities.iter().zip(&y.velocities);
        impulses.zip(velocities).map(|((x, y), (u, v))| (x - y) * (u - v)).sum()
    }

    /// The larger of `Measure::natural` and a tenth of `Measure::scaled`, which `Measure::solves` bounds.
    fn residual(&self, at: &RowPoint) -> f64 {
        let d = self.problem.dimension;
        let (mut natural, mut scaled) = (0.0, 0.0);
        for (i, (block, &mu)) in self.blocks.iter().zip(&self.problem.friction).enumerate() {
            let range = d * i..d * i + d;
            let (r, u) = (&at.impulses[range.clone()], &at.velocities[range]);
            let mut u_hat = [0.0; 3];
            let u_hat = &mut u_hat[..d];
            u_hat.copy_from_slice(u);
            u_hat[0] += mu * u[1..].iter().map(|u| u * u).sum::<f64>().sqrt();
            natural += natural_map_squared(r, u_hat, 1.0, mu);
            scaled += natural_map_squared(r, u_hat, 1.0 / block.norm, mu);
        }
        let worst = f64::max(natural.sqrt(), 0.1 * scaled.sqrt()) / self.scale;
        if natural.is_nan() || scaled.is_nan() { f64::INFINITY } else { worst }
    }
}
