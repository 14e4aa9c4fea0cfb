//! Sparse factorisation of A gamma = b (theory eq. 5.8, item 31): exact in one go when A is regular and every
//! impulse comes out admissible (contacts press and stick inside their friction limit, rows within bounds).
//! Otherwise it says so and changes nothing: the system was then not the right one to solve. The last digits may
//! differ between processors, for the factorisation uses the widest registers that it finds.

use crate::cone::project;
use crate::delassus::{delassus_of, right_hand_side_of};
use crate::impulse_solver::{ImpulseSolver, SolveSettings};
use crate::methods::resisted;
use crate::outcome::{Outcome, Stop};
use crate::prepared::Prepared;
use crate::problem::{ContactProblem, FrictionLaw, Impulses};
use crate::residual::residual_of;
use crate::watch::Watch;
use carom_math::{Column, Space};
use faer::linalg::solvers::Solve;
use faer::sparse::linalg::solvers::Llt;
use faer::sparse::{SparseColMat, Triplet};
use faer::{Col, Side};

/// Reciprocal condition of the scaled A below which it counts as singular: beyond it the impulses' leading digits
/// are noise. Rounding leaves a redundant A at about 1e-16.
const SINGULAR: f64 = 1e-13;

/// Share of the largest impulse (as a velocity) that may be missing to a bound by rounding.
const ROUNDING: f64 = 1e-11;

/// The direct solver.
#[derive(Clone, Debug, Default)]
pub struct Direct;

impl<S: Space> ImpulseSolver<S> for Direct {
    fn name(&self) -> &'static str {
        "direct"
    }
    fn refusal(&self, problem: &ContactProblem<S>) -> Option<String> {
        resisted(problem, "direct")
    }
    fn work(
        &mut self,
        problem: &ContactProblem<S>,
        settings: &SolveSettings,
        impulses: &mut Impulses<S>,
        _watch: &mut Watch,
    ) -> Outcome {
        let prepared = Prepared::of(problem);
        let solved = System::of(problem, &prepared)
            .and_then(|system| system.solve(problem, &prepared))
            .and_then(|found| admissible(problem, &prepared, found));
        match solved {
            Ok(found) => {
                *impulses = found;
                Outcome::judged(1, residual_of(problem, &prepared, impulses), settings.tolerance)
            }
            Err(reason) => {
                let residual = residual_of(problem, &prepared, impulses);
                Outcome::new(1, residual, Stop::Refused(reason))
            }
        }
    }
}

/// Scalar rows that take part: every normal row, tangents of contacts with friction, bounded rows.
fn active_rows<S: Space>(problem: &ContactProblem<S>) -> Vec<usize> {
    let width = 1 + S::SLIP;
    let mut active = Vec::with_capacity(problem.scalar_rows());
    for (i, c) in problem.contacts.iter().enumerate() {
        let rows = if c.friction > 0.0 { width } else { 1 };
        active.extend(i * width..i * width + rows);
    }
    active.extend(problem.contacts.len() * width..problem.scalar_rows());
    active
}

/// D A D on the active rows, D = diag(A)^(-1/2): its condition tells dependence of the rows, not the spread of
/// the masses.
struct System {
    active: Vec<usize>,
    scale: Vec<f64>,
    entries: Vec<Triplet<usize, usize, f64>>,
    right: Vec<f64>,
}

impl System {
    fn of<S: Space>(problem: &ContactProblem<S>, prepared: &Prepared<S>) -> Result<Self, String> {
        let a = delassus_of(problem, prepared);
        let b = right_hand_side_of(problem, prepared);
        let active = active_rows(problem);
        let mut place = vec![usize::MAX; a.shape.0];
        active.iter().enumerate().for_each(|(k, &i)| place[i] = k);
        let diagonal = |&i: &usize| a.row(i).find(|e| e.0 == i).map_or(0.0, |e| e.1);
        let scale: Vec<f64> = active.iter().map(|i| 1.0 / diagonal(i).sqrt()).collect();
        if let Some(k) = scale.iter().position(|d| !d.is_finite()) {
            return Err(format!(
                "A is singular: no impulse changes the velocity of {}",
                row_name(problem, active[k])
            ));
        }
        let mut entries = Vec::with_capacity(a.values.len());
        for (k, &i) in active.iter().enumerate() {
            let near = a.row(i).map(|(j, x)| (place[j], x)).filter(|e| e.0 != usize::MAX);
            entries.extend(near.map(|(j, x)| Triplet::new(k, j, x * scale[k] * scale[j])));
        }
        let right = active.iter().map(|&i| b[i]).collect();
        Ok(System { active, scale, entries, right })
    }

    fn factor(&self) -> Option<Llt<usize, f64>> {
        let n = self.active.len();
        SparseColMat::<usize, f64>::try_new_from_triplets(n, n, &self.entries)
            .ok()?
            .sp_cholesky(Side::Lower)
            .ok()
    }

    /// Solves and refines: the second pass removes the error that forming A has made, for it measures velocities
    /// on the bodies, where impulses that nearly cancel lose no digits.
    fn solve<S: Space>(
        mut self,
        problem: &ContactProblem<S>,
        prepared: &Prepared<S>,
    ) -> Result<Impulses<S>, String> {
        let n = self.active.len();
        let Some(factor) = self.factor() else {
            // lifted off singularity by a little, the factor still leads to the impulses that cancel
            self.entries.extend((0..n).map(|k| Triplet::new(k, k, 1e-9)));
            let null = self.factor().map(|factor| inverse_iteration(n, &factor).1);
            return Err(self.singular(problem, null));
        };
        let (inverse_norm, null) = inverse_iteration(n, &factor);
        let norm = self.norm();
        if !inverse_norm.is_finite() || 1.0 < SINGULAR * norm * inverse_norm {
            return Err(self.singular(problem, Some(null)));
        }
        let mut flat = vec![0.0; problem.scalar_rows()];
        let mut found = Impulses::zero(problem);
        for _ in 0..3 {
            let scaled: Vec<f64> = self.right.iter().zip(&self.scale).map(|(b, d)| b * d).collect();
            let x = solve_by(&factor, &scaled);
            for ((&i, x), d) in self.active.iter().zip(&x).zip(&self.scale) {
                flat[i] += x * d;
            }
            found = Impulses::from_flat(problem, &flat).ok_or("internal: row count")?;
            let errors = prepared.velocity_errors(problem, &found);
            self.right = self.active.iter().map(|&i| -errors[i]).collect();
        }
        Ok(found)
    }

    /// The largest row sum of the scaled matrix, which bounds its largest eigenvalue.
    fn norm(&self) -> f64 {
        let mut sums = vec![0.0; self.active.len()];
        self.entries.iter().for_each(|e| sums[e.row] += e.val.abs());
        sums.into_iter().fold(0.0, f64::max)
    }

    /// Says that A is singular, and which rows can press against each other without effect.
    fn singular<S: Space>(&self, problem: &ContactProblem<S>, null: Option<Vec<f64>>) -> String {
        let mut text =
            format!("A is singular ({} rows), so A gamma = b has no unique answer", self.active.len());
        if let Some(null) = null {
            let largest = null.iter().fold(0.0, |m: f64, x| m.max(x.abs()));
            let mut names: Vec<String> = Vec::new();
            for (&i, x) in self.active.iter().zip(&null) {
                let name = row_name(problem, i);
                if x.abs() > 0.05 * largest && names.last() != Some(&name) {
                    names.push(name);
                }
            }
            let more = if names.len() > 4 { format!(" and {} more", names.len() - 4) } else { String::new() };
            names.truncate(4);
            text += &format!(": {}{more} act against each other without moving a body", names.join(", "));
        }
        text + "; pgs or lemke find an answer"
    }
}

/// The contact or bounded row that a scalar row belongs to.
fn row_name<S: Space>(problem: &ContactProblem<S>, row: usize) -> String {
    let (width, contacts) = (1 + S::SLIP, problem.contacts.len());
    if row < contacts * width {
        format!("contact {}", row / width)
    } else {
        format!("row {}", row - contacts * width)
    }
}

fn solve_by(factor: &Llt<usize, f64>, right: &[f64]) -> Vec<f64> {
    let x = factor.solve(Col::<f64>::from_fn(right.len(), |i| right[i]).as_ref());
    (0..right.len()).map(|i| x[i]).collect()
}

/// |A^-1| estimated by inverse iteration from a fixed start, and the vector that A shrinks most.
fn inverse_iteration(n: usize, factor: &Llt<usize, f64>) -> (f64, Vec<f64>) {
    // a start without structure, so that no eigenvector is missed: the fractional parts of k * golden ratio
    let mut x: Vec<f64> = (1..=n).map(|k| (k as f64 * 0.618_033_988_749_895).fract() - 0.5).collect();
    let mut inverse_norm = 0.0;
    for _ in 0..6 {
        let length = x.iter().map(|v| v * v).sum::<f64>().sqrt();
        let unit: Vec<f64> = x.iter().map(|v| v / length).collect();
        x = solve_by(factor, &unit);
        inverse_norm = x.iter().map(|v| v * v).sum::<f64>().sqrt();
        if !inverse_norm.is_finite() {
            return (inverse_norm, unit);
        }
    }
    (inverse_norm, x)
}

/// Refuses impulses that the law does not allow, naming the first; what only rounding puts outside is put back.
fn admissible<S: Space>(
    problem: &ContactProblem<S>,
    prepared: &Prepared<S>,
    mut found: Impulses<S>,
) -> Result<Impulses<S>, String> {
    if !found.is_finite() {
        return Err("the impulses outgrow all numbers".into());
    }
    let speeds = prepared.contacts.iter().zip(&found.contacts).map(|(c, g)| g.normal.abs() / c.normal_mass);
    let allowance = ROUNDING * speeds.fold(0.0, f64::max);
    for (i, ((c, p), g)) in problem.contacts.iter().zip(&prepared.contacts).zip(&found.contacts).enumerate() {
        if g.normal < -allowance * p.normal_mass {
            return Err(format!(
                "contact {i} would pull with {:.3e} N s: not every contact presses",
                -g.normal
            ));
        }
        let size = match problem.friction_law {
            FrictionLaw::Disc => g.tangent.norm(),
            FrictionLaw::Box => g.tangent.max_abs(),
        };
        let limit = c.friction * g.normal.max(0.0);
        if size > limit + allowance * p.tangent_mass {
            return Err(format!(
                "contact {i} needs friction {size:.3e} N s to stick but has {limit:.3e}: it slides"
            ));
        }
    }
    for (i, (r, &l)) in problem.rows.iter().zip(&found.rows).enumerate() {
        let allowance = ROUNDING * l.abs();
        if l < r.lo - allowance || l > r.hi + allowance {
            return Err(format!("row {i} needs {l:.3e}, outside its bounds [{}, {}]", r.lo, r.hi));
        }
    }
    project(problem, &mut found);
    Ok(found)
}
