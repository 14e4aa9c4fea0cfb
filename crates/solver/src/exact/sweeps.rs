//! Stage A: Gauss-Seidel sweeps with the exact local solution, as long as they promise to be cheaper than the
//! interior point. Knows the problem in its own units.

use super::blocks::Blocks;
use super::judge::{Errors, errors};
use super::local::Local;
use super::operator::Operator;
use super::row::{in_fours, row_times};
use crate::watch::{Progress, Watch};
use pulp::{Simd, WithSimd};

/// How the sweeps ended.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Ended {
    /// The errors are small enough.
    Solved,
    /// A factorising method is expected to be cheaper, or the sweeps are spent.
    LeftOff,
    /// Whoever watched asked to stop.
    Interrupted,
}

/// How far a sweep moved the impulses, as velocities; NaN included.
#[derive(Clone, Copy, Debug, Default)]
pub struct Change {
    /// Of the contact that moved most \[m/s\].
    pub largest: f64,
    /// Squares of all contacts added up \[m^2/s^2\].
    pub squared: f64,
}

/// What the solutions of single contacts need.
pub fn locals<const D: usize>(blocks: &Blocks<D>) -> Vec<Local<D>> {
    blocks.diagonal.iter().zip(&blocks.friction).map(|(w, &mu)| Local::new(w, mu)).collect()
}

struct Sweep<'a, const D: usize> {
    blocks: &'a Blocks<D>,
    locals: &'a mut [Local<D>],
    r: &'a mut [[f64; D]],
    bodies: &'a mut [f64],
}

impl<const D: usize> WithSimd for Sweep<'_, D> {
    type Output = Change;
    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> Change {
        let Sweep { blocks, locals, r, bodies } = self;
        let mut change = Change::default();
        for (i, local) in locals.iter_mut().enumerate() {
            let mut b = match &blocks.operator {
                Operator::Matrix(m) => row_times(simd, m, i, r),
                Operator::Bodies(rows) => rows.relative(i, bodies),
            };
            let (old, block) = (r[i], &blocks.diagonal[i]);
            for k in 0..D {
                let own: f64 = (0..D).map(|c| block[k][c] * old[c]).sum();
                b[k] += blocks.velocity[i][k] - own;
            }
            let found = local.solve(&b, &old);
            let mut moved = [0.0; D];
            let mut squared = 0.0;
            for k in 0..D {
                moved[k] = found[k] - old[k];
                squared += moved[k] * moved[k];
            }
            if let Operator::Bodies(rows) = &blocks.operator {
                rows.push(i, &moved, bodies);
            }
            r[i] = found;
            squared *= blocks.norms[i] * blocks.norms[i];
            change.squared += squared;
            change.largest =
                if squared > change.largest || squared.is_nan() { squared } else { change.largest };
        }
        Change { largest: change.largest.sqrt(), ..change }
    }
}

/// One sweep over all contacts; `bodies` holds B^T r where W is given by rows on bodies.
pub fn sweep<const D: usize>(
    blocks: &Blocks<D>,
    locals: &mut [Local<D>],
    r: &mut [[f64; D]],
    bodies: &mut [f64],
) -> Change {
    in_fours(Sweep { blocks, locals, r, bodies })
}

/// u = W r + q; leaves B^T r in `bodies`.
pub fn velocities<const D: usize>(
    blocks: &Blocks<D>,
    r: &[[f64; D]],
    u: &mut [[f64; D]],
    bodies: &mut Vec<f64>,
) {
    blocks.operator.product(r, u, bodies);
    for (u, q) in u.iter_mut().zip(&blocks.velocity[..blocks.count()]) {
        for k in 0..D {
            u[k] += q[k];
        }
    }
}

/// Nanoseconds of a sweep per coupled pair, and per contact of 1, 2 and 3 directions.
const PER_COUPLING: f64 = 1.5;
const PER_CONTACT: [f64; 3] = [15.0, 15.0, 40.0];

/// How fast the changes of the sweeps fall, and what error goes with a change.
#[derive(Clone, Debug, Default)]
struct Decay {
    changes: Vec<f64>,
    /// Error over change when it was last measured.
    error_over_change: f64,
}

impl Decay {
    /// The error expected now.
    fn error(&self) -> f64 {
        self.error_over_change * self.changes.last().copied().unwrap_or(f64::INFINITY)
    }
    /// Sweeps left until the error is at the tolerance; infinite when the changes do not fall.
    fn left(&self, tolerance: f64) -> f64 {
        let (n, span) = (self.changes.len(), 4.min(self.changes.len() - 1));
        let fall = self.changes[n - 1] / self.changes[n - 1 - span];
        let rate = libm::pow(fall, 1.0 / span.max(1) as f64);
        if rate < 1.0 {
            (libm::log(tolerance / self.error()) / libm::log(rate)).max(0.0)
        } else {
            f64::INFINITY
        }
    }
}

/// What sweeps need beside the problem, kept from solve to solve.
#[derive(Clone, Debug, Default)]
pub struct SweepMemory<const D: usize> {
    locals: Vec<Local<D>>,
    decay: Decay,
    /// B^T r.
    bodies: Vec<f64>,
    best: Vec<[f64; D]>,
}

/// Sweeps before their decay says anything.
const LEARNING: usize = 6;

/// Sweeps until solved or until more sweeps cost more than an interior point solve, and leaves the best impulses in r,
/// the start among them. Costs in nanoseconds on one core of 2026, from the sizes alone, so that the choice is the same
/// everywhere. The error is measured when the changes promise that it is small enough, and now and then.
pub fn sweeps<const D: usize>(
    blocks: &Blocks<D>,
    (tolerance, most): (f64, usize),
    (r, u): (&mut [[f64; D]], &mut [[f64; D]]),
    memory: &mut SweepMemory<D>,
    watch: &mut Watch,
) -> (usize, Errors, Ended) {
    let (contacts, couplings) = (blocks.count() as f64, blocks.operator.couplings() as f64);
    let per_sweep = PER_COUPLING * couplings + PER_CONTACT[D - 1] * contacts;
    let interior_point = 14.0 * (250.0 * contacts + 30.0 * couplings) + 2000.0;
    let size = blocks.size();
    let SweepMemory { locals, decay, bodies, best: best_impulses } = memory;
    decay.changes.clear();
    decay.error_over_change = 1.0;
    locals.clear();
    locals.extend(blocks.diagonal.iter().zip(&blocks.friction).map(|(w, &mu)| Local::new(w, mu)));
    velocities(blocks, r, u, bodies);
    let mut found = errors(blocks, r, u);
    if found.solves(tolerance) {
        return (0, found, Ended::Solved);
    }
    let mut best = found;
    best_impulses.clear();
    best_impulses.extend_from_slice(r);
    let mut end = (0, Ended::LeftOff);
    let mut measured = 0;
    for k in 1..=most {
        end.0 = k;
        let change = sweep(blocks, locals, r, bodies);
        let change = if blocks.by_contact { change.largest } else { change.squared.sqrt() } / size;
        decay.changes.push(change);
        let mut leave = k == most || !change.is_finite();
        if k >= LEARNING {
            let (need, spent) = (decay.left(tolerance) * per_sweep, k as f64 * per_sweep);
            let dear = need > 0.7 * interior_point && spent > 0.15 * interior_point;
            leave |= dear || (spent > 0.6 * interior_point && need > 0.3 * interior_point);
        }
        if !leave && decay.error() > tolerance && k < measured + k / 2 + LEARNING {
            continue;
        }
        measured = k;
        velocities(blocks, r, u, bodies);
        found = errors(blocks, r, u);
        if found.solves(tolerance) {
            return (k, found, Ended::Solved);
        }
        if found.worst() < best.worst() {
            best = found;
            best_impulses.copy_from_slice(r);
        }
        if !watch(&Progress { stage: "sweeps", iterations: k, residual: found.worst() }) {
            end.1 = Ended::Interrupted;
            break;
        }
        if leave {
            break;
        }
        if change > 0.0 {
            decay.error_over_change = found.worst() / change;
        }
    }
    r.copy_from_slice(best_impulses);
    (end.0, best, end.1)
}
