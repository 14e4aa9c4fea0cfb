//! The law written down a second time, dense and slow, to judge what solvers claim: no line of it is shared with
//! the library. Knows no solver.

use crate::common::Random;
use crate::contact::random::{Family, known};
use carom_solver::{FrictionProblem, measure};

/// How far impulses are from solving a problem, by the definitions of `Measure`.
#[derive(Clone, Copy, Debug, Default)]
pub struct Errors {
    /// |r - P_K(r - u_hat)| / |q|.
    pub natural: f64,
    /// |(r - P_K(r - u_hat / l)) l| / |q|, l the spectral norm of each diagonal block of W.
    pub scaled: f64,
    /// Largest |r_T| - mu r_N or -r_N over the largest |r|.
    pub cone: f64,
}

impl Errors {
    /// Solved at a tolerance, as collections of contact problems define it.
    pub fn solve(&self, tolerance: f64) -> bool {
        self.natural <= tolerance && self.scaled <= 10.0 * tolerance && self.cone <= 1e-12
    }
    /// The one number of both errors: at or below the tolerance exactly where both are good enough.
    pub fn worst(&self) -> f64 {
        if self.cone <= 1e-12 { self.natural.max(0.1 * self.scaled) } else { f64::INFINITY }
    }
}

fn length(x: &[f64]) -> f64 {
    x.iter().map(|a| a * a).sum::<f64>().sqrt()
}

/// The nearest point of |x_T| <= mu x_N: the nearest of the point itself, the apex, and the foot on the ray of the
/// cone that lies under it, as far as they are in the cone.
fn nearest_in_cone(x: &[f64], mu: f64) -> Vec<f64> {
    let tangent = length(&x[1..]);
    if x[0] >= 0.0 && tangent <= mu * x[0] {
        return x.to_vec();
    }
    let mut ray = vec![1.0];
    ray.extend(x[1..].iter().map(|t| if tangent > 0.0 { mu * t / tangent } else { 0.0 }));
    let along = (x[0] + mu * tangent) / (1.0 + mu * mu);
    ray.iter().map(|e| e * along.max(0.0)).collect()
}

/// Largest singular value of a small block: the limit of tr((B^T B)^p)^(1/2p), p doubling.
fn spectral_norm(block: &[Vec<f64>]) -> f64 {
    let n = block.len();
    let product = |a: &[Vec<f64>], b: &[Vec<f64>], transposed: bool| -> Vec<Vec<f64>> {
        let entry = |i: usize, j: usize| {
            (0..n).map(|k| if transposed { a[k][i] } else { a[i][k] } * b[k][j]).sum::<f64>()
        };
        (0..n).map(|i| (0..n).map(|j| entry(i, j)).collect()).collect()
    };
    let mut power = product(block, block, true);
    let (mut logarithm, mut share) = (0.0, 1.0);
    for _ in 0..60 {
        let trace: f64 = (0..n).map(|i| power[i][i]).sum();
        if trace <= 0.0 {
            return 0.0;
        }
        logarithm += share * trace.ln();
        share *= 0.5;
        power.iter_mut().flatten().for_each(|x| *x /= trace);
        power = product(&power, &power, false);
    }
    (0.5 * logarithm).exp()
}

/// Judges impulses.
pub fn errors(problem: &FrictionProblem, impulses: &[f64]) -> Errors {
    let (d, w) = (problem.dimension, problem.matrix.dense());
    let times = |row: &Vec<f64>| row.iter().zip(impulses).map(|(a, r)| a * r).sum::<f64>();
    let u: Vec<f64> = w.iter().zip(&problem.velocity).map(|(row, q)| times(row) + q).collect();
    let size = if length(&problem.velocity) > 0.0 { length(&problem.velocity) } else { 1.0 };
    let strongest = impulses.chunks(d).map(length).fold(1e-300, f64::max);
    let mut e = Errors::default();
    for (i, &mu) in problem.friction.iter().enumerate() {
        let rows = d * i..d * (i + 1);
        let r = &impulses[rows.clone()];
        let mut u_hat = u[rows.clone()].to_vec();
        u_hat[0] += mu * length(&u_hat[1..]);
        let block: Vec<Vec<f64>> = rows.clone().map(|k| w[k][rows.clone()].to_vec()).collect();
        let l = if spectral_norm(&block) > 0.0 { spectral_norm(&block) } else { 1.0 };
        for (own, sum) in [(1.0, &mut e.natural), (l, &mut e.scaled)] {
            let x: Vec<f64> = r.iter().zip(&u_hat).map(|(r, u)| r - u / own).collect();
            let off: Vec<f64> = nearest_in_cone(&x, mu).iter().zip(r).map(|(p, r)| (r - p) * own).collect();
            *sum = sum.hypot(length(&off));
        }
        e.cone = e.cone.max((length(&r[1..]) - mu * r[0]) / strongest).max(-r[0] / strongest);
    }
    e.natural /= size;
    e.scaled /= size;
    e
}

/// What rounding leaves unknown of the velocities, and of the natural map, as shares of |q|: impulses so large that
/// they swallow what they should answer prove nothing.
pub fn noise(problem: &FrictionProblem, impulses: &[f64]) -> f64 {
    let size = if length(&problem.velocity) > 0.0 { length(&problem.velocity) } else { 1.0 };
    let terms = |i: usize| problem.matrix.row(i).map(|(j, w)| (w * impulses[j]).abs()).sum::<f64>();
    let largest = impulses.iter().fold(0.0_f64, |m, r| m.max(r.abs()));
    f64::EPSILON * (0..impulses.len()).map(terms).fold(largest, f64::max) / size
}

/// The largest fault of a contact by the law of contact problems, in m/s: the normal map |r_N - max(0, r_N - m_N u_N)| / m_N
/// and the tangential map |r_T - P(r_T - m_T u_T)| / m_T with P the projection on |r_T| <= mu r_N, together; m_N is
/// 1/W_NN and m_T one over the largest eigenvalue of W_TT (theory eqs. 5.31 and 5.32).
pub fn dense_law(problem: &FrictionProblem, impulses: &[f64]) -> f64 {
    let (d, w) = (problem.dimension, problem.matrix.dense());
    let times = |row: &Vec<f64>| row.iter().zip(impulses).map(|(a, r)| a * r).sum::<f64>();
    let u: Vec<f64> = w.iter().zip(&problem.velocity).map(|(row, q)| times(row) + q).collect();
    let mut worst: f64 = 0.0;
    for (i, mu) in problem.friction.iter().enumerate() {
        let (n, t) = (d * i, d * i + 1..d * (i + 1));
        let normal = (impulses[n] * w[n][n]).min(u[n]);
        let block: Vec<Vec<f64>> = t.clone().map(|k| w[k][t.clone()].to_vec()).collect();
        let largest = spectral_norm(&block);
        let own = if largest > 0.0 { largest } else { w[n][n] };
        let trial: Vec<f64> = t.clone().map(|k| impulses[k] - u[k] / own).collect();
        let (size, limit) = (length(&trial), mu * impulses[n].max(0.0));
        let share = if size > limit { limit / size } else { 1.0 };
        let inside = size <= limit;
        let off =
            t.clone().zip(&trial).map(|(k, x)| if inside { u[k] } else { (impulses[k] - share * x) * own });
        worst = worst.max(normal.hypot(length(&off.collect::<Vec<f64>>())));
    }
    worst
}

/// The library's measure and this one agree, at solutions and beside them, in all families and dimensions.
#[test]
fn the_measure_is_what_its_definition_says() {
    let mut random = Random::new(77);
    for family in Family::ALL {
        for seed in 0..30 {
            let k = known(family, 1 + seed as usize % 3, 1 + seed as usize % 7, seed);
            let mut r = k.solution.clone();
            if seed % 2 == 0 {
                r.iter_mut().for_each(|x| *x *= random.between(0.5, 1.5));
            }
            let (m, e) = (measure(&k.problem, &r), errors(&k.problem, &r));
            for (what, got, wanted) in
                [("natural", m.natural, e.natural), ("scaled", m.scaled, e.scaled), ("cone", m.cone, e.cone)]
            {
                assert!(
                    (got - wanted).abs() <= 1e-9 * wanted + 1e-10,
                    "{what} of {:?}: {got:e}, by its definition {wanted:e}",
                    k.name
                );
            }
        }
    }
}

/// The problems are what they are said to be: the solution solves, and one a percent off does not.
#[test]
fn the_known_solutions_solve() {
    for family in Family::ALL {
        for seed in 0..60 {
            let k = known(family, 1 + seed as usize % 3, 1 + seed as usize % 9, seed);
            k.problem.check().unwrap_or_else(|e| panic!("{:?}: {e}", k.name));
            let at = errors(&k.problem, &k.solution);
            assert!(at.solve(1e-9), "{:?}: {at:?}", k.name);
            if k.solution.iter().any(|r| *r != 0.0) && family != Family::Masses {
                let off: Vec<f64> = k.solution.iter().map(|r| r * 1.01).collect();
                let beside = errors(&k.problem, &off);
                assert!(beside.scaled > 1e-6, "{:?}: {beside:?}", k.name);
            }
        }
    }
}
