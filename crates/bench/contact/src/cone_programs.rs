//! Clarabel alone on a friction problem: the fixed point of Acary, Cadoux, Lemarechal and Malick (2011). With the shift
//! s_i = mu_i |u_T,i| held, r is the minimum of r^T W r / 2 + (q + s n)^T r over the friction cones, a convex cone
//! program for the interior-point solver clarabel; the loop repeats it with the s of its velocities. Sparse; reads
//! the upper half of W as symmetric. For comparison only.

use carom::solver::friction_problem::project_on_cone;
use carom::solver::{
    FrictionOutcome, FrictionProblem, FrictionSettings, FrictionSolver, Measure, Progress, Stage, Watch,
    measure,
};
use clarabel::algebra::CscMatrix;
use clarabel::solver::{
    DefaultSettings, DefaultSolver, IPSolver, NonnegativeConeT, SecondOrderConeT, SupportedConeT,
};
use std::time::Instant;

/// Cone programs that a loop takes at most.
const ROUNDS: usize = 200;

/// The fixed-point loop over cone programs.
#[derive(Clone, Copy, Debug, Default)]
pub struct ConePrograms;

/// The cone program of a problem with impulses in units in which every diagonal block of W has trace 1 and q has
/// norm 1: a cone of r is (mu r_N, r_T) in the second-order cone.
struct Program {
    quadratic: CscMatrix<f64>,
    linear: Vec<f64>,
    constraints: CscMatrix<f64>,
    cones: Vec<SupportedConeT<f64>>,
    /// r = unit x what the program calls r, per row.
    unit: Vec<f64>,
    /// u = what the program calls u / gain, per row.
    gain: Vec<f64>,
}

impl Program {
    fn of(problem: &FrictionProblem) -> Self {
        let (d, n, w) = (problem.dimension, problem.velocity.len(), &problem.matrix);
        let size = problem.velocity.iter().map(|x| x * x).sum::<f64>().sqrt();
        let size = if size > 0.0 { size } else { 1.0 };
        let scale: Vec<f64> = (0..n).map(|row| 1.0 / own_size(problem, row / d).sqrt()).collect();
        let gain: Vec<f64> = scale.iter().map(|s| s / size).collect();
        // the upper half by columns is the lower half by rows
        let (mut starts, mut rows, mut values) = (vec![0], Vec::new(), Vec::new());
        for column in 0..n {
            for (row, x) in w.row(column).filter(|e| e.0 <= column) {
                rows.push(row);
                values.push(scale[row] * scale[column] * x);
            }
            starts.push(rows.len());
        }
        let quadratic = CscMatrix::new(n, n, starts, rows, values);
        let linear = problem.velocity.iter().zip(&gain).map(|(q, g)| q * g).collect();
        let factor =
            |row: usize| if d > 1 && row.is_multiple_of(d) { problem.friction[row / d] } else { 1.0 };
        let diagonal = (0..n).map(|row| -factor(row)).collect();
        let constraints = CscMatrix::new(n, n, (0..=n).collect(), (0..n).collect(), diagonal);
        let cone = |_| if d > 1 { SecondOrderConeT(d) } else { NonnegativeConeT(1) };
        let cones = (0..problem.contacts()).map(cone).collect();
        let unit = scale.iter().map(|s| s * size).collect();
        Program { quadratic, linear, constraints, cones, unit, gain }
    }

    /// Impulses in the problem's units for a shift of the normal velocities \[m/s\].
    fn minimum(&self, shift: &[f64]) -> Result<Vec<f64>, String> {
        let cost: Vec<f64> =
            (0..shift.len()).map(|row| self.linear[row] + self.gain[row] * shift[row]).collect();
        let settings = DefaultSettings {
            verbose: false,
            tol_gap_abs: 1e-12,
            tol_gap_rel: 1e-12,
            tol_feas: 1e-12,
            ..DefaultSettings::default()
        };
        let zero = vec![0.0; shift.len()];
        let made =
            DefaultSolver::new(&self.quadratic, &cost, &self.constraints, &zero, &self.cones, settings);
        let mut solver = made.map_err(|e| e.to_string())?;
        solver.solve();
        let x = &solver.solution.x;
        if x.iter().all(|x| x.is_finite()) {
            Ok(x.iter().zip(&self.unit).map(|(x, unit)| x * unit).collect())
        } else {
            Err(format!("the cone program is {:?}", solver.solution.status))
        }
    }
}

/// Trace of a contact's own block of W, 1 where it is 0: between once and three times its norm.
fn own_size(problem: &FrictionProblem, contact: usize) -> f64 {
    let rows = problem.dimension * contact..problem.dimension * (contact + 1);
    let trace: f64 = rows.map(|k| problem.matrix.row(k).filter(|e| e.0 == k).map(|e| e.1).sum::<f64>()).sum();
    if trace > 0.0 { trace } else { 1.0 }
}

/// mu |u_T| on the normal rows, 0 elsewhere \[m/s\].
fn shifts(problem: &FrictionProblem, impulses: &[f64]) -> Vec<f64> {
    let d = problem.dimension;
    let mut u = problem.matrix.times(impulses);
    u.iter_mut().zip(&problem.velocity).for_each(|(u, q)| *u += q);
    for (u, mu) in u.chunks_exact_mut(d).zip(&problem.friction) {
        let slip = u[1..].iter().map(|t| t * t).sum::<f64>().sqrt();
        u.fill(0.0);
        u[0] = mu * slip;
    }
    u
}

fn worst(m: &Measure) -> f64 {
    m.natural.max(0.1 * m.scaled)
}

impl FrictionSolver for ConePrograms {
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
        let start = Instant::now();
        let program = Program::of(problem);
        let mut best = measure(problem, impulses);
        let mut shift = vec![0.0; impulses.len()];
        let (mut rounds, mut reason) = (0, String::new());
        while !best.solves(settings.tolerance) {
            let progress = Progress { stage: "cone programs", iterations: rounds, residual: worst(&best) };
            if rounds == ROUNDS.min(settings.iterations) || !watch(&progress) {
                reason = format!("the loop over cone programs has not settled after {rounds}");
                break;
            }
            rounds += 1;
            let mut found = match program.minimum(&shift) {
                Ok(found) => found,
                Err(why) => {
                    reason = why;
                    break;
                }
            };
            let cones = found.chunks_exact_mut(problem.dimension).zip(&problem.friction);
            cones.for_each(|(r, mu)| project_on_cone(r, *mu));
            let reached = measure(problem, &found);
            shift = shifts(problem, &found);
            if worst(&reached) < worst(&best) {
                best = reached;
                impulses.copy_from_slice(&found);
            }
        }
        FrictionOutcome {
            solved: best.solves(settings.tolerance),
            measure: best,
            stages: [Stage { name: "cone programs", iterations: rounds }].into_iter().collect(),
            factorisations: 0,
            seconds: start.elapsed().as_secs_f64(),
            reason,
            strict_feasibility: None,
        }
    }
}
