//! Every combination of contact modes in turn (take-off, stick, slip to either side; press or not without friction; a
//! row at a bound or between): each makes the law a linear system (theory eqs. 3.15 to 3.17 and 5.9), and the one
//! whose solution the law allows is the answer. Exponential: the oracle for a handful of contacts, and the proof that
//! there is no answer when none fits. Friction in the plane only: the disc of space has endless modes.

use crate::cone::project;
use crate::delassus::{delassus_of, right_hand_side_of};
use crate::friction_measure::measure;
use crate::friction_problem::{FrictionProblem, project_on_cone};
use crate::friction_solver::{FrictionOutcome, FrictionSettings, FrictionSolver, Stage};
use crate::impulse_solver::{ImpulseSolver, SolveSettings};
use crate::methods::resisted;
use crate::outcome::{Outcome, Stop};
use crate::prepared::Prepared;
use crate::problem::{ContactProblem, Impulses};
use crate::residual::residual_of;
use crate::stopwatch::Stopwatch;
use crate::watch::Watch;
use carom_math::Space;
use smallvec::smallvec;

/// Most combinations tried: seven planar contacts with friction, fourteen without.
pub const LARGEST: usize = 1 << 14;
/// An error below this share of the largest velocity asked for is rounding: the search ends there.
const ACCURATE: f64 = 1e-13;
/// The largest share that still counts as an answer when all combinations are tried.
const TOLERABLE: f64 = 1e-9;
/// Pivots below this share of the largest entry are rounding.
const NO_PIVOT: f64 = 1e-13;

/// The enumeration of modes.
#[derive(Clone, Copy, Debug, Default)]
pub struct Enumeration;

impl<S: Space> ImpulseSolver<S> for Enumeration {
    fn name(&self) -> &'static str {
        "enumeration"
    }
    fn refusal(&self, problem: &ContactProblem<S>) -> Option<String> {
        resisted(problem, "enumeration")
    }
    fn work(
        &mut self,
        problem: &ContactProblem<S>,
        settings: &SolveSettings,
        impulses: &mut Impulses<S>,
        _watch: &mut Watch,
    ) -> Outcome {
        let prepared = Prepared::of(problem);
        let width = 1 + S::SLIP;
        let frictions = problem.contacts.iter().map(|c| c.friction).enumerate();
        let mut parts: Vec<Part> = frictions.map(|(i, mu)| Part::contact(i * width, width, mu)).collect();
        parts.extend(problem.rows.iter().enumerate().map(|(k, r)| Part::Row {
            row: problem.contacts.len() * width + k,
            lo: r.lo,
            hi: r.hi,
        }));
        let a = delassus_of(problem, &prepared).dense();
        let b = right_hand_side_of(problem, &prepared);
        let read = |x: &[f64]| {
            let mut found = Impulses::from_flat(problem, x).expect("one number per scalar row");
            project(problem, &mut found);
            found
        };
        let error = |x: &[f64]| {
            let found = read(x);
            if found.is_finite() { residual_of(problem, &prepared, &found).absolute } else { f64::INFINITY }
        };
        let size = b.iter().fold(f64::MIN_POSITIVE, |m, x| m.max(x.abs()));
        let refused = |reason: String, tried: usize, given: &Impulses<S>| {
            Outcome::new(tried, residual_of(problem, &prepared, given), Stop::Refused(reason))
        };
        match search(&a, &b, &parts, &error, ACCURATE * size) {
            Err(reason) => refused(reason, 0, impulses),
            Ok(found) if found.error <= settings.tolerance.max(TOLERABLE * size) => {
                *impulses = read(&found.x);
                Outcome::judged(found.tried, residual_of(problem, &prepared, impulses), settings.tolerance)
            }
            Ok(found) => refused(found.nothing_fits(), found.tried, impulses),
        }
    }
}

impl FrictionSolver for Enumeration {
    fn name(&self) -> &'static str {
        "enumeration"
    }
    fn work(
        &mut self,
        problem: &FrictionProblem,
        settings: &FrictionSettings,
        impulses: &mut [f64],
        _watch: &mut Watch,
    ) -> FrictionOutcome {
        let start = Stopwatch::start();
        let d = problem.dimension;
        let project = |x: &[f64]| {
            let mut x: Vec<f64> = x.iter().map(|r| if r.is_finite() { *r } else { 0.0 }).collect();
            x.chunks_exact_mut(d).zip(&problem.friction).for_each(|(r, &mu)| project_on_cone(r, mu));
            x
        };
        let error = |x: &[f64]| {
            let m = measure(problem, &project(x));
            let worst = m.natural.max(0.1 * m.scaled);
            if worst.is_nan() { f64::INFINITY } else { worst }
        };
        let frictions = problem.friction.iter().enumerate();
        let parts: Vec<Part> = frictions.map(|(i, &mu)| Part::contact(i * d, d, mu)).collect();
        let b: Vec<f64> = problem.velocity.iter().map(|q| -q).collect();
        let found = search(&problem.matrix.dense(), &b, &parts, &error, ACCURATE);
        let (tried, mut reason) = match found {
            Ok(found) => {
                impulses.copy_from_slice(&project(&found.x));
                (found.tried, found.nothing_fits())
            }
            Err(reason) => {
                impulses.copy_from_slice(&project(impulses));
                (0, reason)
            }
        };
        let seconds = start.seconds();
        let measure = measure(problem, impulses);
        let solved = measure.solves(settings.tolerance);
        if solved {
            reason.clear();
        }
        let stages = smallvec![Stage { name: "modes", iterations: tried }];
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

/// What has modes of its own.
#[derive(Clone, Copy, Debug)]
enum Part {
    /// A contact without friction: its normal row.
    Smooth { row: usize },
    /// A planar contact with friction: its normal row, the tangential one after it.
    Rough { row: usize, friction: f64 },
    /// A contact with more tangential rows than have finitely many modes.
    Disc,
    /// A bounded row.
    Row { row: usize, lo: f64, hi: f64 },
}

impl Part {
    fn contact(row: usize, width: usize, friction: f64) -> Self {
        match width {
            _ if friction == 0.0 || width == 1 => Part::Smooth { row },
            2 => Part::Rough { row, friction },
            _ => Part::Disc,
        }
    }
    fn modes(&self) -> usize {
        match self {
            Part::Smooth { .. } => 2,
            Part::Rough { .. } => 4,
            Part::Disc => 0,
            Part::Row { .. } => 3,
        }
    }
    /// Writes the part's law in one mode: impulses that are known, and columns (rows with shares of one unknown)
    /// paired with the row whose velocity error vanishes. False for a mode that does not exist.
    fn enter(&self, mode: usize, known: &mut [f64], columns: &mut Vec<Column>) -> bool {
        let mut unknown = |row: usize, tangent: f64| columns.push(Column { row, tangent });
        match (*self, mode) {
            (Part::Smooth { row }, 0) => unknown(row, 0.0),
            (Part::Rough { row, .. }, 0) => {
                unknown(row, 0.0);
                unknown(row + 1, 0.0);
            }
            (Part::Rough { row, friction }, 1) => unknown(row, friction),
            (Part::Rough { row, friction }, 2) => unknown(row, -friction),
            (Part::Row { row, .. }, 0) => unknown(row, 0.0),
            (Part::Row { row, lo, .. }, 1) if lo.is_finite() => known[row] = lo,
            (Part::Row { row, hi, .. }, 2) if hi.is_finite() => known[row] = hi,
            (Part::Row { .. }, _) => return false,
            _ => {} // no impulse
        }
        true
    }
}

/// One unknown: the impulse of `row`, which brings `tangent` times itself on the row after it; the equation is that
/// the velocity error of `row` vanishes.
#[derive(Clone, Copy, Debug)]
struct Column {
    row: usize,
    tangent: f64,
}

/// The best of the combinations tried.
struct Found {
    x: Vec<f64>,
    error: f64,
    tried: usize,
}

impl Found {
    fn nothing_fits(&self) -> String {
        format!(
            "none of {} combinations of contact modes solves the problem; the best leaves {:.1e}",
            self.tried, self.error
        )
    }
}

/// Tries the combinations of modes of A x - b until the error is `enough` or all are tried.
fn search(
    a: &[Vec<f64>],
    b: &[f64],
    parts: &[Part],
    error: &dyn Fn(&[f64]) -> f64,
    enough: f64,
) -> Result<Found, String> {
    if parts.iter().any(|p| matches!(p, Part::Disc)) {
        return Err("the friction disc of space has endlessly many modes; choose another solver".into());
    }
    let count = parts.iter().try_fold(1usize, |n, p| n.checked_mul(p.modes()));
    let Some(count) = count.filter(|n| *n <= LARGEST) else {
        return Err(format!(
            "{} contacts and rows have more than {LARGEST} combinations of modes",
            parts.len()
        ));
    };
    let mut best = Found { x: vec![0.0; b.len()], error: f64::INFINITY, tried: 0 };
    let mut columns = Vec::new();
    for combination in 0..count {
        let mut x = vec![0.0; b.len()];
        columns.clear();
        let mut rest = combination;
        let possible = parts.iter().all(|part| {
            let mode = rest % part.modes();
            rest /= part.modes();
            part.enter(mode, &mut x, &mut columns)
        });
        if !possible {
            continue;
        }
        best.tried += 1;
        complete(a, b, &columns, &mut x);
        let error = error(&x);
        if error < best.error {
            (best.x, best.error) = (x, error);
        }
        if best.error <= enough {
            break;
        }
    }
    Ok(best)
}

/// Adds the unknowns' impulses to the known ones `x`.
fn complete(a: &[Vec<f64>], b: &[f64], columns: &[Column], x: &mut [f64]) {
    let entry = |i: usize, c: &Column| {
        let tangent = if c.tangent == 0.0 { 0.0 } else { c.tangent * a[i][c.row + 1] };
        a[i][c.row] + tangent
    };
    let right = columns.iter().map(|c| {
        let known: f64 = a[c.row].iter().zip(x.iter()).map(|(a, x)| a * x).sum();
        b[c.row] - known
    });
    let mut system: Vec<Vec<f64>> = columns
        .iter()
        .zip(right)
        .map(|(equation, right)| {
            columns.iter().map(|c| entry(equation.row, c)).chain(std::iter::once(right)).collect()
        })
        .collect();
    for (c, z) in columns.iter().zip(eliminate(&mut system)) {
        x[c.row] += z;
        if c.tangent != 0.0 {
            x[c.row + 1] += c.tangent * z;
        }
    }
}

/// Solves a square system (right-hand side last) by elimination with full pivoting; where it is singular the unknowns
/// that are free are zero.
fn eliminate(m: &mut [Vec<f64>]) -> Vec<f64> {
    let n = m.len();
    let size = m.iter().flat_map(|row| &row[..n]).fold(0.0, |s: f64, x| s.max(x.abs()));
    let mut order: Vec<usize> = (0..n).collect();
    let mut rank = 0;
    while rank < n {
        let cells = (rank..n).flat_map(|i| (rank..n).map(move |j| (i, j)));
        let largest = cells.max_by(|p, q| m[p.0][p.1].abs().total_cmp(&m[q.0][q.1].abs()));
        let (i, j) = largest.expect("rank < n");
        if m[i][j].is_nan() || m[i][j].abs() <= NO_PIVOT * size {
            break;
        }
        m.swap(rank, i);
        m.iter_mut().for_each(|row| row.swap(rank, j));
        order.swap(rank, j);
        let (top, below) = m.split_at_mut(rank + 1);
        for row in below {
            let factor = row[rank] / top[rank][rank];
            row.iter_mut().zip(&top[rank]).skip(rank).for_each(|(x, y)| *x -= factor * y);
        }
        rank += 1;
    }
    let mut z = vec![0.0; n];
    for k in (0..rank).rev() {
        let known: f64 = (k + 1..rank).map(|j| m[k][j] * z[order[j]]).sum();
        z[order[k]] = (m[k][n] - known) / m[k][k];
    }
    z
}
