//! Why impulses are hard to find: mass ratios across contacts, more scalar rows pressed than the bodies have degrees
//! of freedom, and the condition of the scaled Delassus matrix D^-1/2 W D^-1/2 on the pressed rows, estimated from
//! below by Lanczos' process (Golub and Van Loan, Matrix Computations, section 10.1). Knows no names and no remedy.

use crate::prepared::Prepared;
use crate::problem::{ContactProblem, Impulse, Impulses};
use carom_math::{Column, Space};
use serde::{Deserialize, Serialize};

/// Products with W that the estimate of the condition may cost: about as many half sweeps.
const LANCZOS_STEPS: usize = 24;
/// Ritz values below this share of the largest are the null space's, which rounding lets in \[1\].
const NULL: f64 = 1e-13;

/// What makes a problem hard.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Diagnosis {
    /// Contacts of the problem.
    pub contacts: usize,
    /// Movable bodies that take part.
    pub bodies: usize,
    /// Scalar rows of contacts that press: one each without friction, all directions with it.
    pub rows: usize,
    /// Degrees of freedom of the bodies that take part.
    pub freedom: usize,
    /// Largest ratio of two touching bodies' masses \[1\], with the heavier and the lighter body.
    pub mass_ratio: Option<(f64, usize, usize)>,
    /// At least this is the condition of the scaled W on pressed rows, its null space left out \[1\]; 1 where nothing
    /// presses or nobody asked.
    pub condition: f64,
}

impl Diagnosis {
    /// Scalar rows that are redundant for sure: the bodies cannot feel them apart \[1\].
    pub fn redundant(&self) -> usize {
        self.rows.saturating_sub(self.freedom)
    }
}

/// Examines a problem as it stands with these impulses; `thorough` estimates the condition.
pub fn diagnose<S: Space>(problem: &ContactProblem<S>, impulses: &Impulses<S>, thorough: bool) -> Diagnosis {
    let masses = &problem.inverse_masses;
    let mut found = Diagnosis { contacts: problem.contacts.len(), ..Diagnosis::default() };
    let mut touched = vec![false; masses.len()];
    for (c, g) in problem.contacts.iter().zip(&impulses.contacts) {
        (touched[c.a], touched[c.b]) = (true, true);
        if g.normal > 0.0 {
            found.rows += if c.friction > 0.0 { 1 + S::SLIP } else { 1 };
        }
        let (a, b) = (masses[c.a].linear, masses[c.b].linear);
        let ratio = a.max(b) / a.min(b);
        if ratio.is_finite() && found.mass_ratio.is_none_or(|(largest, _, _)| ratio > largest) {
            found.mass_ratio = Some(if a < b { (ratio, c.a, c.b) } else { (ratio, c.b, c.a) });
        }
    }
    for r in &problem.rows {
        (touched[r.a], touched[r.b]) = (true, true);
        found.rows += 1;
    }
    for (m, _) in masses.iter().zip(&touched).filter(|(m, touched)| **touched && !m.is_fixed()) {
        found.bodies += 1;
        found.freedom += if m.linear > 0.0 { S::DIM } else { 0 };
        let (principal, _) = S::principal(&m.angular);
        found.freedom += principal.as_slice().iter().filter(|x| **x > 0.0).count();
    }
    found.condition = if thorough { condition(problem, impulses) } else { 1.0 };
    found
}

/// The scaled W on pressed rows, as an operator.
struct Operator<'a, S: Space> {
    problem: &'a ContactProblem<S>,
    prepared: Prepared<S>,
    pressed: Vec<bool>,
    work: Impulses<S>,
}

impl<S: Space> Operator<'_, S> {
    /// y = D^-1/2 W D^-1/2 x; rows that do not press stay zero.
    fn times(&mut self, x: &[f64]) -> Vec<f64> {
        let width = 1 + S::SLIP;
        for (k, (c, g)) in self.prepared.contacts.iter().zip(&mut self.work.contacts).enumerate() {
            let x = &x[k * width..(k + 1) * width];
            g.normal = x[0] * c.normal_mass.sqrt();
            g.tangent = S::Slip::from_fn(|i| x[1 + i] * c.tangent_mass.sqrt());
        }
        let rows = &x[self.work.contacts.len() * width..];
        for ((r, l), x) in self.prepared.rows.iter().zip(&mut self.work.rows).zip(rows) {
            *l = x / r.inverse_effective_mass.sqrt();
        }
        let mut velocities = vec![crate::problem::Twist::default(); self.problem.velocities.len()];
        self.prepared.apply(&self.work, &mut velocities);
        let mut y = Vec::with_capacity(x.len());
        for (c, pressed) in self.prepared.contacts.iter().zip(&self.pressed) {
            let (normal, slip) = c.relative_velocity(&velocities);
            y.push(if *pressed { normal * c.normal_mass.sqrt() } else { 0.0 });
            let feels = *pressed && c.friction > 0.0;
            y.extend(slip.as_slice().iter().map(|s| if feels { s * c.tangent_mass.sqrt() } else { 0.0 }));
        }
        y.extend(
            self.prepared.rows.iter().map(|r| r.velocity(&velocities) / r.inverse_effective_mass.sqrt()),
        );
        y
    }
}

fn condition<S: Space>(problem: &ContactProblem<S>, impulses: &Impulses<S>) -> f64 {
    let pressed: Vec<bool> = impulses.contacts.iter().map(|g: &Impulse<S>| g.normal > 0.0).collect();
    let work = Impulses::zero(problem);
    let mut prepared = Prepared::of(problem);
    // the operator is linear: it knows no targets
    prepared.contacts.iter_mut().for_each(|c| c.slip_target = S::Slip::ZERO);
    let mut operator = Operator { problem, prepared, pressed, work };
    // a start without structure (fractional parts of multiples of the golden ratio), moved into the range of W
    // moments are left out: they press nothing
    let n = problem.contacts.len() * (1 + S::SLIP) + problem.rows.len();
    let start: Vec<f64> = (1..=n).map(|k| (k as f64 * 0.618_033_988_749_894_9).fract() - 0.5).collect();
    let start = operator.times(&start);
    let (diagonal, off) = tridiagonal(&mut operator, start);
    let largest = ritz_value(&diagonal, &off, diagonal.len());
    let values = (1..=diagonal.len()).map(|k| ritz_value(&diagonal, &off, k));
    let smallest = values.filter(|x| *x > NULL * largest).fold(largest, f64::min);
    if smallest > 0.0 { largest / smallest } else { 1.0 }
}

/// Lanczos' process with full reorthogonalisation: diagonal and off-diagonal of T.
fn tridiagonal<S: Space>(operator: &mut Operator<S>, start: Vec<f64>) -> (Vec<f64>, Vec<f64>) {
    let dot = |x: &[f64], y: &[f64]| x.iter().zip(y).map(|(a, b)| a * b).sum::<f64>();
    let unit = |mut x: Vec<f64>| {
        let length = dot(&x, &x).sqrt();
        x.iter_mut().for_each(|a| *a /= length);
        (x, length)
    };
    let (mut diagonal, mut off) = (Vec::new(), Vec::new());
    let (first, length) = unit(start);
    if !(length > 0.0 && length.is_finite()) {
        return (diagonal, off);
    }
    let mut basis = vec![first];
    while diagonal.len() < LANCZOS_STEPS {
        let last = basis.len() - 1;
        let mut next = operator.times(&basis[last]);
        diagonal.push(dot(&next, &basis[last]));
        for _ in 0..2 {
            for q in &basis {
                let along = dot(&next, q);
                next.iter_mut().zip(q).for_each(|(a, b)| *a -= along * b);
            }
        }
        let (next, length) = unit(next);
        // an exhausted space, or the basis is as long as the vectors
        if length.is_nan() || length <= 1e-12 * diagonal[0].abs() || diagonal.len() == LANCZOS_STEPS {
            break;
        }
        off.push(length);
        basis.push(next);
    }
    off.truncate(diagonal.len().saturating_sub(1));
    (diagonal, off)
}

/// The k-th smallest eigenvalue of a symmetric tridiagonal matrix, by bisection on Sturm's count.
fn ritz_value(diagonal: &[f64], off: &[f64], k: usize) -> f64 {
    if diagonal.is_empty() {
        return 0.0;
    }
    let radius = |i: usize| {
        let left = if i > 0 { off[i - 1] } else { 0.0 };
        left + off.get(i).copied().unwrap_or(0.0)
    };
    let mut low = (0..diagonal.len()).map(|i| diagonal[i] - radius(i)).fold(f64::INFINITY, f64::min);
    let mut high = (0..diagonal.len()).map(|i| diagonal[i] + radius(i)).fold(f64::NEG_INFINITY, f64::max);
    let below = |x: f64| {
        let mut count = 0;
        let mut pivot = 1.0;
        for i in 0..diagonal.len() {
            let coupling = if i > 0 { off[i - 1] * off[i - 1] / pivot } else { 0.0 };
            pivot = diagonal[i] - x - coupling;
            if pivot == 0.0 {
                pivot = f64::MIN_POSITIVE;
            }
            count += usize::from(pivot < 0.0);
        }
        count
    };
    // 100 halvings reach the rounding of any of the values, the small ones included
    for _ in 0..100 {
        let middle = 0.5 * (low + high);
        if below(middle) >= k { high = middle } else { low = middle }
    }
    0.5 * (low + high)
}
