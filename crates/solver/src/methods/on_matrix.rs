//! First-order methods on u = W r + q in blocks: sweeps with the exact solution of one contact (theory chapter 7),
//! gradient steps by products with W. Every pass costs as much as W has entries. Knows no method and no bodies.

use crate::cone::nearest_normal;
use crate::cone_matrix::spectral_norm;
use crate::exact::blocks::Blocks;
use crate::exact::judge::errors;
use crate::exact::lane::padded;
use crate::exact::local::Local;
use crate::exact::sweeps::{locals, sweep, velocities};
use crate::friction_measure::measure;
use crate::friction_problem::{FrictionProblem, project_on_cone};
use crate::friction_solver::{FrictionOutcome, FrictionSettings, FrictionSolver, Stage};
use crate::methods::first_order::{Budget, End, FirstOrder, Memory, Method, Point};
use crate::stopwatch::Stopwatch;
use crate::watch::Watch;
use smallvec::smallvec;
use std::cell::RefCell;
use std::marker::PhantomData;

/// A first-order method on matrices.
#[derive(Clone, Debug, Default)]
pub struct OnMatrix<M> {
    method: PhantomData<M>,
}

impl<M: Method> FrictionSolver for OnMatrix<M> {
    fn name(&self) -> &'static str {
        M::NAME
    }
    fn work(
        &mut self,
        problem: &FrictionProblem,
        settings: &FrictionSettings,
        impulses: &mut [f64],
        watch: &mut Watch,
    ) -> FrictionOutcome {
        let start = Stopwatch::start();
        impulses.iter_mut().filter(|r| !r.is_finite()).for_each(|r| *r = 0.0);
        for (r, &mu) in impulses.chunks_exact_mut(problem.dimension).zip(&problem.friction) {
            project_on_cone(r, mu);
        }
        let given = impulses.to_vec();
        let (end, mut finite) = match problem.dimension {
            1 => run::<M, 1>(problem, settings, impulses, watch),
            2 => run::<M, 2>(problem, settings, impulses, watch),
            _ => run::<M, 3>(problem, settings, impulses, watch),
        };
        let seconds = start.seconds();
        let mut measured = measure(problem, impulses);
        if !measured.solves(settings.tolerance) {
            // sweeps on a W that is not symmetric can diverge, and velocities outgrow all numbers before impulses do
            let before = measure(problem, &given);
            if !(measured.natural <= before.natural || measured.scaled <= before.scaled) {
                finite &= measured.scaled.is_finite();
                impulses.copy_from_slice(&given);
                measured = before;
            }
        }
        let measure = measured;
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
        let stages = smallvec![Stage { name: M::STAGE, iterations: end.iterations }];
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

/// Runs a method from `impulses`, which take the answer unless it outgrew all numbers; then false.
fn run<M: Method, const D: usize>(
    problem: &FrictionProblem,
    settings: &FrictionSettings,
    impulses: &mut [f64],
    watch: &mut Watch,
) -> (End, bool) {
    let blocks = Blocks::<D>::of(problem);
    let steps = (0..blocks.count()).map(|i| Step::of(&blocks, i)).collect();
    let form = Rows { blocks: &blocks, steps, locals: RefCell::new(locals(&blocks)) };
    let mut at = RowPoint::<D>::default();
    at.impulses.extend(impulses.chunks_exact(D).map(|r| -> [f64; D] { std::array::from_fn(|k| r[k]) }));
    at.impulses.resize(padded(blocks.count()), [0.0; D]);
    form.refresh(&mut at);
    let length = problem.velocity.iter().map(|u| u * u).sum::<f64>().sqrt();
    // a tenth in hand for what rounding moves; the measure is a length over all contacts: no entry of it is larger
    let tolerance = 0.9 * settings.tolerance;
    let small_change = 10.0 * tolerance * if length > 0.0 { length } else { 1.0 };
    let budget = Budget { iterations: settings.iterations, tolerance, small_change };
    let end = M::run(&form, &budget, &mut at, &mut Memory::default(), watch);
    let finite = at.impulses.iter().flatten().all(|r| r.is_finite());
    if finite {
        for ((r, found), &mu) in impulses.chunks_exact_mut(D).zip(&at.impulses).zip(&problem.friction) {
            r.copy_from_slice(found);
            // sweeps leave the cones by the square of their last change
            project_on_cone(r, mu);
        }
    }
    (end, finite)
}

/// Impulses per contact, padded to whole packs, and the velocities W r + q after them.
#[derive(Clone, Debug, Default)]
struct RowPoint<const D: usize> {
    impulses: Vec<[f64; D]>,
    velocities: Vec<[f64; D]>,
}

impl<const D: usize> Point for RowPoint<D> {
    fn copy_from(&mut self, other: &Self) {
        self.impulses.clone_from(&other.impulses);
        self.velocities.clone_from(&other.velocities);
    }
    fn blend(&mut self, own: f64, (f, x): (f64, &Self), (g, y): (f64, &Self)) {
        let mix = |mine: &mut [[f64; D]], xs: &[[f64; D]], ys: &[[f64; D]]| {
            for ((m, x), y) in mine.iter_mut().zip(xs).zip(ys) {
                for k in 0..D {
                    m[k] = own * m[k] + f * x[k] + g * y[k];
                }
            }
        };
        mix(&mut self.impulses, &x.impulses, &y.impulses);
        mix(&mut self.velocities, &x.velocities, &y.velocities);
    }
}

/// The scalar steps of a contact's diagonal block: W_nn and the norm of W_tt \[1/kg\].
#[derive(Clone, Copy, Debug)]
struct Step {
    normal: f64,
    tangential: f64,
}

impl Step {
    fn of<const D: usize>(blocks: &Blocks<D>, contact: usize) -> Self {
        let w = blocks.diagonal[contact];
        let normal = if w[0][0] > 0.0 { w[0][0] } else { blocks.norms[contact] };
        let tangential = match D {
            1 => normal,
            2 => w[1][1].abs(),
            _ => spectral_norm::<2>(&[w[1][1], w[1][2], w[2][1], w[2][2]]),
        };
        Step { normal, tangential: if tangential > 0.0 { tangential } else { normal } }
    }
}

/// A problem in blocks.
struct Rows<'a, const D: usize> {
    blocks: &'a Blocks<D>,
    steps: Vec<Step>,
    locals: RefCell<Vec<Local<D>>>,
}

impl<const D: usize> FirstOrder for Rows<'_, D> {
    type Point = RowPoint<D>;
    const SWEEPS_KEEP_VELOCITIES: bool = false;

    fn sweep(&self, at: &mut RowPoint<D>) -> f64 {
        sweep(self.blocks, &mut self.locals.borrow_mut(), &mut at.impulses, &mut []).largest
    }

    fn descend(&self, from: &RowPoint<D>, step: f64, to: &mut RowPoint<D>) {
        for (i, m) in self.steps.iter().enumerate() {
            let (r, u, mu) = (&from.impulses[i], &from.velocities[i], self.blocks.friction[i]);
            let mut new = *r;
            let length = |x: &[f64]| x.iter().map(|a| a * a).sum::<f64>().sqrt();
            let stretch = (m.tangential / m.normal).sqrt();
            let lowered = r[0] - step / m.normal * (u[0] + mu * length(&u[1..]));
            for k in 1..D {
                new[k] -= step / m.tangential * u[k];
            }
            let size = length(&new[1..]);
            new[0] = nearest_normal(lowered, &[(stretch * size, stretch * mu)]);
            let limit = mu * new[0];
            let shrink = if size > limit { limit / size } else { 1.0 };
            new[1..].iter_mut().for_each(|t| *t *= shrink);
            to.impulses[i] = new;
        }
        self.refresh(to);
    }

    fn refresh(&self, at: &mut RowPoint<D>) {
        at.velocities.resize(at.impulses.len(), [0.0; D]);
        velocities(self.blocks, &at.impulses, &mut at.velocities, &mut Vec::new());
    }

    fn product(&self, [x, y]: [&RowPoint<D>; 2], [z, w]: [&RowPoint<D>; 2]) -> f64 {
        let mut sum = 0.0;
        for (i, m) in self.steps.iter().enumerate() {
            let part =
                |k: usize| (x.impulses[i][k] - y.impulses[i][k]) * (z.impulses[i][k] - w.impulses[i][k]);
            sum += part(0) * m.normal + (1..D).map(part).sum::<f64>() * m.tangential;
        }
        sum
    }

    fn curvature(&self, x: &RowPoint<D>, y: &RowPoint<D>) -> f64 {
        let mut sum = 0.0;
        for i in 0..self.blocks.count() {
            for k in 0..D {
                sum += (x.impulses[i][k] - y.impulses[i][k]) * (x.velocities[i][k] - y.velocities[i][k]);
            }
        }
        sum
    }

    /// The larger of `Measure::natural` and a tenth of `Measure::scaled`, which `Measure::solves` bounds.
    fn residual(&self, at: &RowPoint<D>) -> f64 {
        errors(self.blocks, &at.impulses, &at.velocities).worst()
    }
}
