//! An answer from elsewhere: Coulomb's law as a fixed point of convex cone programs (Acary, Cadoux, Lemarechal and
//! Malick 2011), each given to the interior-point solver clarabel. With the shift s_i = mu_i |u_T,i| held, r is
//! the minimum of r^T W r / 2 + (q + s n)^T r over the friction cones; the loop repeats it with the s of its
//! velocities. Where the loop does not settle it says so: the answer is certified or refused like any other.

use crate::contact::judge;
use crate::contact::random::{Family, known};
use carom_solver::{
    FrictionOutcome, FrictionProblem, FrictionSettings, FrictionSolver, Progress, Stage, Watch, measure,
};
use clarabel::algebra::CscMatrix;
use clarabel::solver::{
    DefaultSettings, DefaultSolver, IPSolver, NonnegativeConeT, SecondOrderConeT, SolverStatus,
    SupportedConeT,
};

/// Cone programs that a loop takes at most.
const ROUNDS: usize = 200;

/// The fixed-point loop over cone programs.
#[derive(Clone, Copy, Debug, Default)]
pub struct Oracle;

/// A problem with every contact in its own unit of impulse and velocity, so that each diagonal block of W has norm 1
/// and q has norm 1: dense, for clarabel.
struct Scaled {
    dimension: usize,
    friction: Vec<f64>,
    w: Vec<Vec<f64>>,
    q: Vec<f64>,
    /// r = unit of contact x what the scaled problem calls r.
    unit: Vec<f64>,
}

impl Scaled {
    fn of(problem: &FrictionProblem) -> Self {
        let (d, mut w) = (problem.dimension, problem.matrix.dense());
        let own = |i: usize| (d * i..d * (i + 1)).map(|k| w[k][k].abs()).fold(0.0, f64::max);
        let scale: Vec<f64> =
            (0..problem.contacts()).map(|i| if own(i) > 0.0 { 1.0 / own(i).sqrt() } else { 1.0 }).collect();
        let mut q = problem.velocity.clone();
        for (k, row) in w.iter_mut().enumerate() {
            q[k] *= scale[k / d];
            row.iter_mut().enumerate().for_each(|(l, x)| *x *= scale[k / d] * scale[l / d]);
        }
        let size = q.iter().map(|x| x * x).sum::<f64>().sqrt();
        let size = if size > 0.0 { size } else { 1.0 };
        q.iter_mut().for_each(|x| *x /= size);
        let unit = scale.iter().map(|s| s * size).collect();
        Scaled { dimension: d, friction: problem.friction.clone(), w, q, unit }
    }

    /// W r + q.
    fn velocity(&self, r: &[f64]) -> Vec<f64> {
        let times = |row: &Vec<f64>| row.iter().zip(r).map(|(a, b)| a * b).sum::<f64>();
        self.w.iter().zip(&self.q).map(|(row, q)| times(row) + q).collect()
    }

    /// The minimum of r^T W_s r / 2 + linear.r over the cones, W_s the symmetric half of W.
    fn cone_program(&self, linear: &[f64]) -> Result<Vec<f64>, String> {
        let (d, n) = (self.dimension, self.q.len());
        let symmetric = |i: usize, j: usize| if i <= j { 0.5 * (self.w[i][j] + self.w[j][i]) } else { 0.0 };
        let (mut cones, mut keep) = (Vec::new(), Vec::new());
        for (i, &mu) in self.friction.iter().enumerate() {
            keep.push((d * i, if mu > 0.0 && d > 1 { mu } else { 1.0 }));
            if mu > 0.0 && d > 1 {
                keep.extend((1..d).map(|k| (d * i + k, 1.0)));
                cones.push(SecondOrderConeT(d));
            } else {
                cones.push(NonnegativeConeT(1));
            }
        }
        // tangents without friction are no unknowns: their columns are left out
        let m = keep.len();
        let upper: Vec<Vec<f64>> =
            keep.iter().map(|a| keep.iter().map(|b| symmetric(a.0, b.0)).collect()).collect();
        let factors: Vec<Vec<f64>> =
            (0..m).map(|i| (0..m).map(|j| if i == j { -keep[i].1 } else { 0.0 }).collect()).collect();
        let cost: Vec<f64> = keep.iter().map(|a| linear[a.0]).collect();
        let x = minimum(&columns(&upper, m), &cost, &columns(&factors, m), &vec![0.0; m], &cones)?;
        let mut r = vec![0.0; n];
        keep.iter().zip(&x).for_each(|(a, x)| r[a.0] = *x);
        Ok(r)
    }
}

/// Rows as a matrix in compressed columns.
pub fn columns(rows: &[Vec<f64>], width: usize) -> CscMatrix<f64> {
    let (mut starts, mut indices, mut values) = (vec![0], Vec::new(), Vec::new());
    for j in 0..width {
        for (i, row) in rows.iter().enumerate() {
            if row[j] != 0.0 {
                indices.push(i);
                values.push(row[j]);
            }
        }
        starts.push(indices.len());
    }
    CscMatrix::new(rows.len(), width, starts, indices, values)
}

/// min x^T P x / 2 + c^T x with b - A x in the cones, to 14 digits where there are as many, else to 12.
pub fn minimum(
    p: &CscMatrix<f64>,
    c: &[f64],
    a: &CscMatrix<f64>,
    b: &[f64],
    cones: &[SupportedConeT<f64>],
) -> Result<Vec<f64>, String> {
    use SolverStatus::{AlmostSolved, InsufficientProgress, MaxIterations, NumericalError, Solved};
    let mut found = Err("not tried".into());
    for tolerance in [1e-14, 1e-12] {
        let settings = DefaultSettings {
            verbose: false,
            max_iter: 100,
            tol_gap_abs: tolerance,
            tol_gap_rel: tolerance,
            tol_feas: tolerance,
            ..DefaultSettings::default()
        };
        let mut solver = DefaultSolver::new(p, c, a, b, cones, settings).map_err(|e| e.to_string())?;
        solver.solve();
        match solver.solution.status {
            Solved => return Ok(solver.solution.x.clone()),
            // asked for more digits than there are it ends away from what it had; the law judges what is left
            AlmostSolved | InsufficientProgress | MaxIterations | NumericalError => {
                found = Ok(solver.solution.x.clone());
            }
            status => return Err(format!("the convex cone program is {status:?}")),
        }
    }
    found
}

/// The largest t <= 1 with u_N >= mu |u_T| + t |q| at every contact for some r, u = W r + q: above 0 a solution
/// exists (Acary, Cadoux, Lemarechal and Malick 2011); at or below 0 none need exist.
pub fn strict_feasibility(problem: &FrictionProblem) -> f64 {
    let s = Scaled::of(problem);
    let (d, n) = (s.dimension, s.q.len());
    if n == 0 {
        return 1.0;
    }
    // unknowns r and t; rows: 1 - t >= 0, then (u_N - t, mu u_T) in the cone
    let mut a = vec![vec![0.0; n + 1]];
    a[0][n] = 1.0;
    let (mut b, mut cones) = (vec![1.0], vec![NonnegativeConeT(1)]);
    for (i, &mu) in s.friction.iter().enumerate() {
        for k in 0..d {
            let factor = if k == 0 { 1.0 } else { mu };
            let mut row: Vec<f64> = s.w[d * i + k].iter().map(|x| -factor * x).collect();
            row.push(if k == 0 { 1.0 } else { 0.0 });
            a.push(row);
            b.push(factor * s.q[d * i + k]);
        }
        cones.push(if d > 1 { SecondOrderConeT(d) } else { NonnegativeConeT(1) });
    }
    let mut cost = vec![0.0; n + 1];
    cost[n] = -1.0;
    let none = CscMatrix::new(n + 1, n + 1, vec![0; n + 2], Vec::new(), Vec::new());
    minimum(&none, &cost, &columns(&a, n + 1), &b, &cones).map_or(f64::NEG_INFINITY, |x| x[n])
}

impl FrictionSolver for Oracle {
    fn name(&self) -> &'static str {
        "clarabel"
    }
    fn work(
        &mut self,
        problem: &FrictionProblem,
        settings: &FrictionSettings,
        impulses: &mut [f64],
        watch: &mut Watch,
    ) -> FrictionOutcome {
        let s = Scaled::of(problem);
        let d = s.dimension;
        let given = |r: &[f64]| -> Vec<f64> {
            let mut r: Vec<f64> = r.iter().enumerate().map(|(k, x)| x * s.unit[k / d]).collect();
            // the interior point of an interior-point method may miss the cone by rounding
            r.chunks_mut(d).zip(&s.friction).for_each(|(x, mu)| into_cone(x, *mu));
            r
        };
        let mut best = (judge::errors(problem, &given(&vec![0.0; s.q.len()])), vec![0.0; s.q.len()]);
        let (mut rounds, mut share) = (0, 1.0);
        let (mut held, mut moved) = (vec![0.0; s.q.len()], f64::INFINITY);
        let mut reason = String::new();
        while !best.0.solve(settings.tolerance) {
            if rounds == ROUNDS.min(settings.iterations) {
                reason = format!("the loop over cone programs has not settled after {rounds}");
                break;
            }
            let progress = Progress { stage: "cone programs", iterations: rounds, residual: best.0.worst() };
            if !watch(&progress) {
                reason = "stopped from outside".into();
                break;
            }
            rounds += 1;
            let linear: Vec<f64> = s.q.iter().zip(&held).map(|(q, h)| q + h).collect();
            let r = match s.cone_program(&linear) {
                Ok(found) => found,
                Err(why) => {
                    reason = why;
                    break;
                }
            };
            let errors = judge::errors(problem, &given(&r));
            if errors.worst() < best.0.worst() {
                best = (errors, r.clone());
            }
            let wanted = lagged(&s, &r);
            let change = held.iter().zip(&wanted).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            if change <= 1e-14 {
                reason = format!("the loop settles with an error of {:.1e}", best.0.worst());
                break;
            }
            // a loop that goes to and fro settles when it takes part of the way
            share = if change > 0.7 * moved { f64::max(0.7 * share, 0.1) } else { share };
            moved = change;
            held.iter_mut().zip(&wanted).for_each(|(old, new)| *old += share * (new - *old));
        }
        impulses.copy_from_slice(&given(&best.1));
        let solved = best.0.solve(settings.tolerance);
        let reason = if solved { String::new() } else { reason };
        FrictionOutcome {
            solved,
            measure: measure(problem, impulses),
            stages: [Stage { name: "cone programs", iterations: rounds }].into_iter().collect(),
            factorisations: 0,
            seconds: 0.0,
            reason,
            strict_feasibility: None,
        }
    }
}

/// What the convex program cannot hold and takes from the last r: mu |u_T| on the normals, and the skew half of W.
fn lagged(s: &Scaled, r: &[f64]) -> Vec<f64> {
    let (d, u) = (s.dimension, s.velocity(r));
    let skew = |k: usize| (0..r.len()).map(|l| 0.5 * (s.w[k][l] - s.w[l][k]) * r[l]).sum::<f64>();
    let slip = |i: usize| u[d * i + 1..d * (i + 1)].iter().map(|t| t * t).sum::<f64>().sqrt();
    (0..r.len()).map(|k| skew(k) + if k % d == 0 { s.friction[k / d] * slip(k / d) } else { 0.0 }).collect()
}

/// Shortens what lies outside the cone |r_T| <= mu r_N.
fn into_cone(r: &mut [f64], mu: f64) {
    r[0] = r[0].max(0.0);
    let tangent = r[1..].iter().map(|t| t * t).sum::<f64>().sqrt();
    if tangent > mu * r[0] {
        let share = mu * r[0] / tangent;
        r[1..].iter_mut().for_each(|t| *t *= share);
    }
}

/// The oracle finds the solutions that the problems were made from, where the velocities are unique (W regular),
/// in every dimension.
#[test]
fn the_oracle_finds_the_known_solutions() {
    // an interior point has less than half of the digits where impulse and velocity vanish together
    for (family, tolerance) in [
        (Family::FullRank, 1e-7),
        (Family::Frictionless, 1e-8),
        (Family::Asymmetric, 1e-7),
        (Family::Degenerate, 1e-4),
    ] {
        let (mut solved, mut all) = (0, 0);
        for seed in 0..24 {
            let k = known(family, 1 + seed as usize % 3, 1 + seed as usize % 6, seed);
            let mut r = vec![0.0; k.solution.len()];
            let settings = FrictionSettings { tolerance, ..FrictionSettings::default() };
            let outcome = Oracle.solve(&k.problem, &settings, &mut r, &mut |_| true);
            all += 1;
            solved += usize::from(outcome.solved);
            if !outcome.solved {
                println!("{:?}: {}, {:?}", k.name, outcome.reason, judge::errors(&k.problem, &r));
            }
        }
        assert!(10 * solved >= 9 * all, "{family:?}: {solved} of {all}");
    }
}

/// Feasibility tells problems with a solution from those without.
#[test]
fn strict_feasibility_is_positive_where_w_is_regular_and_not_where_nothing_solves() {
    for seed in 0..12 {
        let k = known(Family::FullRank, 1 + seed as usize % 3, 4, seed);
        let t = strict_feasibility(&k.problem);
        assert!(t > 0.9, "{:?}: {t}", k.name);
    }
    for d in 1..4 {
        for (what, problem) in crate::contact::random::hopeless(d) {
            let t = strict_feasibility(&problem);
            assert!(t < -0.05, "{what}, dimension {d}: {t}");
        }
    }
}

/// The solver's own strict feasibility beside the oracle's: the same sign wherever it tells one, and it tells one
/// wherever W is symmetric and moderately scaled.
#[test]
fn strict_feasibility_agrees_with_the_oracle() {
    let mut told = [0, 0];
    let families = [Family::FullRank, Family::RankDeficient, Family::Sparse, Family::HighFriction];
    let known = families.into_iter().flat_map(|f| {
        (0..12).map(move |seed| known(f, 1 + seed as usize % 3, 2 + seed as usize, seed).problem)
    });
    let hopeless = (1..4).flat_map(|d| crate::contact::random::hopeless(d).into_iter().map(|p| p.1));
    for problem in known.chain(hopeless) {
        let theirs = strict_feasibility(&problem);
        let own = carom_solver::exact::strict_feasibility(&problem);
        if theirs.abs() > 1e-3 {
            let own = own.unwrap_or_else(|| panic!("nothing told, oracle {theirs:e}: {problem:?}"));
            assert!(own * theirs > 0.0, "{own:e}, oracle {theirs:e}: {problem:?}");
            told[usize::from(own > 0.0)] += 1;
        }
    }
    assert!(told.iter().all(|&n| n >= 6), "{told:?}");
    let (_, walls) = crate::contact::random::hopeless(3).swap_remove(0);
    let t = carom_solver::exact::strict_feasibility(&walls).expect("a bound");
    assert!((t + 1.0).abs() < 1e-6, "two walls that approach at 1 m/s each: {t}");
}
