//! Stage A: Gauss-Seidel sweeps with the exact local solution, as long as they promise to be cheaper than the
//! interior point. Knows the problem in its own units.

use super::blocks::{Blocks, row_times};
use super::judge::{Errors, errors};
use super::local::solve_contact;
use super::operator::Operator;
use crate::watch::{Progress, Watch};

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

/// One sweep over all contacts; `bodies` holds B^T r where W is given by rows on bodies. Returns the largest change
/// of an impulse as a velocity \[m/s\], NaN included.
pub fn sweep<const D: usize>(blocks: &Blocks<D>, r: &mut [[f64; D]], bodies: &mut [f64]) -> f64 {
    let mut largest = 0.0;
    for i in 0..blocks.count() {
        let mut b = match &blocks.operator {
            Operator::Matrix(m) => row_times(&m.graph, &m.values, i, r, true),
            Operator::Bodies(rows) => {
                let mut seen = rows.relative(i, bodies);
                for (seen, row) in seen.iter_mut().zip(&blocks.diagonal[i]) {
                    *seen -= row.iter().zip(&r[i]).map(|(w, r)| w * r).sum::<f64>();
                }
                seen
            }
        };
        for k in 0..D {
            b[k] += blocks.velocity[i][k];
        }
        let found = solve_contact(blocks.diagonal[i].as_flattened(), &b, blocks.friction[i], &r[i]);
        let change: [f64; D] = std::array::from_fn(|k| found[k] - r[i][k]);
        if let Operator::Bodies(rows) = &blocks.operator {
            rows.push(i, &change, bodies);
        }
        r[i] = found;
        let moved = change.iter().map(|c| c * c).sum::<f64>().sqrt() * blocks.norms[i];
        largest = if moved > largest || moved.is_nan() { moved } else { largest };
    }
    largest
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

/// Sweeps until solved or until more sweeps cost more than an interior point solve, and leaves the best impulses in r,
/// the start among them. Costs in nanoseconds on one core of 2026, from the sizes alone, so that the choice is the same
/// everywhere.
pub fn sweeps<const D: usize>(
    blocks: &Blocks<D>,
    (tolerance, most): (f64, usize),
    (r, u): (&mut [[f64; D]], &mut [[f64; D]]),
    watch: &mut Watch,
) -> (usize, Errors, Ended) {
    let (contacts, couplings) = (blocks.count() as f64, blocks.operator.couplings() as f64);
    let per_sweep = 3.0 * couplings + 50.0 * contacts;
    let interior_point = 14.0 * (250.0 * contacts + 30.0 * couplings) + 2000.0;
    let mut history: Vec<f64> = Vec::new();
    let mut bodies = Vec::new();
    velocities(blocks, r, u, &mut bodies);
    let mut found = errors(blocks, r, u);
    let mut best = (found, r.to_vec());
    let mut end = (0, Ended::LeftOff);
    if found.solves(tolerance) {
        return (0, found, Ended::Solved);
    }
    for k in 1..=most {
        end.0 = k;
        sweep(blocks, r, &mut bodies);
        if k > 8 && k % 4 != 0 && k < most {
            continue;
        }
        velocities(blocks, r, u, &mut bodies);
        found = errors(blocks, r, u);
        if found.solves(tolerance) {
            return (k, found, Ended::Solved);
        }
        if found.worst() < best.0.worst() {
            best.0 = found;
            best.1.copy_from_slice(r);
        }
        if !watch(&Progress { stage: "sweeps", iterations: k, residual: found.worst() }) {
            end.1 = Ended::Interrupted;
            break;
        }
        history.push(found.worst());
        if k >= 6 && history.len() >= 3 {
            let old = history[history.len() - 3];
            let rate = (found.worst() / old).powf(1.0 / if k <= 8 { 2.0 } else { 8.0 });
            let left = if rate < 1.0 { (tolerance / found.worst()).ln() / rate.ln() } else { f64::INFINITY };
            let (need, spent) = (left * per_sweep, k as f64 * per_sweep);
            let dear = need > 0.7 * interior_point && spent > 0.15 * interior_point;
            let slow = spent > 0.6 * interior_point && need > 0.3 * interior_point;
            if dear || slow || !found.worst().is_finite() {
                break;
            }
        }
    }
    r.copy_from_slice(&best.1);
    (end.0, best.0, end.1)
}
