//! Sparse factorisation of A gamma = b (theory chapter 5, item 31): exact in one go when A is regular and
//! every impulse comes out admissible (contacts press and stick inside their friction limit, rows within
//! bounds). Otherwise it says so and changes nothing: the system was then not the right one to solve.

use crate::delassus::{Csr, delassus_of, right_hand_side};
use crate::impulse_solver::{ImpulseSolver, SolveSettings};
use crate::outcome::{Outcome, Stop};
use crate::prepared::Prepared;
use crate::problem::{ContactProblem, FrictionLaw, Impulses};
use crate::residual::residual_of;
use carom_math::{Column, Space};
use faer::linalg::solvers::Solve;
use faer::sparse::{SparseColMat, Triplet};
use faer::{Col, Side};

/// Reciprocal condition below which A counts as singular: beyond it the impulses' leading digits are noise.
const SINGULAR: f64 = 1e-12;

/// The direct solver.
#[derive(Clone, Debug, Default)]
pub struct Direct;

impl<S: Space> ImpulseSolver<S> for Direct {
    fn name(&self) -> &'static str {
        "direct"
    }
    fn solve(&mut self, problem: &ContactProblem<S>, settings: &SolveSettings, impulses: &mut Impulses<S>) -> Outcome {
        if problem.scalar_rows() == 0 {
            return Outcome::nothing_to_do();
        }
        let prepared = Prepared::of(problem);
        let solved = active_rows(problem)
            .and_then(|active| solve_rows(problem, &prepared, &active))
            .and_then(|found| admissible(problem, found));
        match solved {
            Ok(found) => {
                *impulses = found;
                Outcome::judged(1, residual_of(problem, &prepared, impulses), settings.tolerance)
            }
            Err(reason) => {
                let residual = residual_of(problem, &prepared, impulses);
                Outcome { iterations: 1, residual, stop: Stop::Refused(reason) }
            }
        }
    }
}

/// Rows that take part: every normal row, tangents of contacts with friction, bounded rows.
fn active_rows<S: Space>(problem: &ContactProblem<S>) -> Result<Vec<usize>, String> {
    let width = 1 + S::SLIP;
    let mut active = Vec::with_capacity(problem.scalar_rows());
    for (i, c) in problem.contacts.iter().enumerate() {
        let rows = if c.friction > 0.0 { width } else { 1 };
        active.extend(i * width..i * width + rows);
    }
    active.extend(problem.contacts.len() * width..problem.scalar_rows());
    Ok(active)
}

/// Solves A gamma = b on the active rows by a sparse Cholesky factorisation.
fn solve_rows<S: Space>(problem: &ContactProblem<S>, p: &Prepared<S>, active: &[usize]) -> Result<Impulses<S>, String> {
    let a = delassus_of(problem, p);
    let b = right_hand_side(problem);
    let mut place = vec![usize::MAX; a.shape.0];
    active.iter().enumerate().for_each(|(k, &i)| place[i] = k);
    let n = active.len();
    let mut entries = Vec::with_capacity(a.values.len());
    for (k, &i) in active.iter().enumerate() {
        entries.extend(a.row(i).filter(|e| place[e.0] != usize::MAX).map(|(j, x)| Triplet::new(k, place[j], x)));
    }
    let matrix = SparseColMat::<usize, f64>::try_new_from_triplets(n, n, &entries).map_err(|e| format!("{e:?}"))?;
    let singular = || format!("A is singular ({n} rows): the contacts are redundant, so A gamma = b has no unique answer");
    let factor = matrix.sp_cholesky(Side::Lower).map_err(|_| singular())?;
    let solve = |rhs: &[f64]| -> Vec<f64> {
        let x = factor.solve(Col::<f64>::from_fn(n, |i| rhs[i]).as_ref());
        (0..n).map(|i| x[i]).collect()
    };
    if reciprocal_condition(&a, active, &solve) < SINGULAR {
        return Err(singular());
    }
    let rhs: Vec<f64> = active.iter().map(|&i| b[i]).collect();
    let x = solve(&rhs);
    let mut flat = vec![0.0; a.shape.0];
    active.iter().zip(&x).for_each(|(&i, &value)| flat[i] = value);
    Impulses::from_flat(problem, &flat).ok_or_else(|| "internal: row count".to_string())
}

/// 1/(|A| |A^-1|) estimated by inverse iteration from a fixed start; both norms are largest eigenvalues
/// (A is symmetric), bounded above by the largest row sum for A.
fn reciprocal_condition(a: &Csr, active: &[usize], solve: &dyn Fn(&[f64]) -> Vec<f64>) -> f64 {
    let norm = active.iter().map(|&i| a.row(i).map(|e| e.1.abs()).sum::<f64>()).fold(0.0, f64::max);
    // a start without structure, so that no eigenvector is missed: the fractional parts of k * golden ratio
    let mut x: Vec<f64> = (0..active.len()).map(|k| ((k + 1) as f64 * 0.618_033_988_749_895).fract() - 0.5).collect();
    let mut inverse_norm = 0.0;
    for _ in 0..6 {
        let length = x.iter().map(|v| v * v).sum::<f64>().sqrt();
        let unit: Vec<f64> = x.iter().map(|v| v / length).collect();
        x = solve(&unit);
        inverse_norm = x.iter().map(|v| v * v).sum::<f64>().sqrt();
        if !inverse_norm.is_finite() {
            return 0.0;
        }
    }
    1.0 / (norm * inverse_norm)
}

/// Refuses impulses that the law does not allow, naming the first.
fn admissible<S: Space>(problem: &ContactProblem<S>, found: Impulses<S>) -> Result<Impulses<S>, String> {
    for (i, (c, g)) in problem.contacts.iter().zip(&found.contacts).enumerate() {
        if g.normal < 0.0 {
            return Err(format!("contact {i} would pull with {:.3e} N s: not every contact presses", -g.normal));
        }
        let size = match problem.friction_law {
            FrictionLaw::Disc => g.tangent.norm(),
            FrictionLaw::Box => g.tangent.max_abs(),
        };
        if size > c.friction * g.normal * (1.0 + 1e-12) {
            let limit = c.friction * g.normal;
            return Err(format!("contact {i} needs friction {size:.3e} N s to stick but has {limit:.3e}: it slips"));
        }
    }
    for (i, (r, &l)) in problem.rows.iter().zip(&found.rows).enumerate() {
        if l < r.lo || l > r.hi {
            return Err(format!("row {i} needs {l:.3e}, outside its bounds [{}, {}]", r.lo, r.hi));
        }
    }
    Ok(found)
}
