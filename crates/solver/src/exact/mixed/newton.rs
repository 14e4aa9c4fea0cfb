//! Semismooth Newton on the natural map of the one residual (Alart and Curnier 1991). With z = x - m u and P the
//! projection on the law, x of row i solves x - P(z) = 0; the rows of its derivative I - P' (I - m A) - dP/dlimit are
//! factorised with pivots, for they are neither symmetric nor definite. Where plain Newton stalls, proximal points (stage D
//! of `exact`): u + w (x - c) / m around a centre c.

use super::parts::{Law, Part};
use super::{End, Mixed};
use crate::cone::project;
use crate::problem::Impulses;
use crate::watch::Watch;
use carom_math::Space;
use faer::linalg::solvers::Solve;
use faer::sparse::{SparseColMat, Triplet};

/// Newton steps of a round, and of a proximal point.
pub const STEPS: usize = 30;
const INNER: usize = 15;
/// Newton steps without a better answer that end a round.
const PATIENCE: usize = 6;
/// Proximal points of a round.
const OUTER: usize = 40;
/// Weight of the first of them.
const WEIGHT: f64 = 0.1;
/// Shorter steps are not tried: 1/32.
const HALVINGS: usize = 5;
/// Least shift of the diagonal, in shares of the row's own: what keeps redundant rows regular.
const SHIFT: f64 = 1e-10;

/// An iterate with its velocities, the proximal term included, and the length of its natural map.
struct Iterate<S: Space> {
    impulses: Impulses<S>,
    x: Vec<f64>,
    velocity: Vec<f64>,
    size: f64,
}

impl<S: Space> Mixed<'_, S> {
    /// At most so many Newton steps from `impulses`.
    pub fn plain(&mut self, impulses: &Impulses<S>, most: usize, watch: &mut Watch) -> End {
        self.assemble();
        self.weight = 0.0;
        let mut at = self.iterate(impulses.clone());
        let first = at.size;
        let (mut fruitless, mut shift) = (0, SHIFT);
        for _ in 0..most {
            let judged =
                self.ask("newton", watch).and_then(|()| self.step(&mut at, shift)).and_then(|fell| {
                    // over a rise the steps are shortened by the error itself (Levenberg and Marquardt)
                    shift = if fell { SHIFT } else { (at.size / first).clamp(SHIFT, 1e-3) };
                    self.judge(&at.impulses)
                });
            match judged {
                Err(end) => return end,
                Ok(better) => fruitless = if better { 0 } else { fruitless + 1 },
            }
            if fruitless > PATIENCE {
                break;
            }
        }
        End::Stuck
    }

    /// Proximal points from the best answer.
    pub fn proximal(&mut self, watch: &mut Watch) -> End {
        let Some((_, best)) = self.best.clone() else { return End::Stuck };
        let (mut weight, mut start) = (WEIGHT, best);
        for _ in 0..OUTER {
            self.centre = start.flat();
            self.weight = weight;
            match self.point(start.clone(), watch) {
                Err(end) => return end,
                Ok((found, steps, true)) => {
                    start = found;
                    weight *= if steps <= 4 { 0.5 } else { 1.0 };
                }
                Ok((_, _, false)) => weight *= 3.0,
            }
            weight = weight.clamp(1e-10, 100.0);
        }
        End::Stuck
    }

    /// Newton on the problem of the present centre: what it found, in how many steps, and whether that is of use.
    fn point(&mut self, start: Impulses<S>, watch: &mut Watch) -> Result<(Impulses<S>, usize, bool), End> {
        let mut at = self.iterate(start);
        let first = at.size;
        for step in 0..INNER {
            if step > 0 && at.size <= 0.1 * self.weight * self.distance(&at.x) {
                return Ok((at.impulses, step, true));
            }
            self.ask("proximal newton", watch)?;
            let fell = self.step(&mut at, 0.0)?;
            self.judge(&at.impulses)?;
            // one rise at the beginning may lead on
            if !fell && step > 0 {
                break;
            }
        }
        let of_use = at.size < 0.3 * first;
        Ok((at.impulses, INNER, of_use))
    }

    /// How far x is from the centre \[m/s\].
    fn distance(&self, x: &[f64]) -> f64 {
        let rows = self.parts.iter().flat_map(|p| (p.first..p.first + p.count).map(move |k| (p, k)));
        let moved = rows.map(|(p, k)| ((x[k] - self.centre[k]) * p.inverse_mass * p.length).powi(2));
        moved.sum::<f64>().sqrt()
    }

    /// Puts impulses into their limits, with what belongs to them.
    fn iterate(&self, mut impulses: Impulses<S>) -> Iterate<S> {
        project(self.problem, &mut impulses);
        let x = impulses.flat();
        let mut velocity = self.prepared.velocity_errors(self.problem, &impulses);
        if self.weight > 0.0 {
            for part in &self.parts {
                for k in part.first..part.first + part.count {
                    velocity[k] += self.weight * part.inverse_mass * (x[k] - self.centre[k]);
                }
            }
        }
        let size = self.size(&x, &velocity);
        Iterate { impulses, x, velocity, size }
    }

    /// A Newton step, halved until the natural map falls or the halvings are spent; whether it fell.
    fn step(&mut self, at: &mut Iterate<S>, shift: f64) -> Result<bool, End> {
        self.factorisations += 1;
        let change = self.change(&at.x, &at.velocity, shift).ok_or(End::Stuck)?;
        let (start, before, mut length) = (at.x.clone(), at.size, 1.0);
        for _ in 0..=HALVINGS {
            let next: Vec<f64> = start.iter().zip(&change).map(|(x, d)| x + length * d).collect();
            let next = Impulses::from_flat(self.problem, &next).ok_or(End::Stuck)?;
            *at = self.iterate(next);
            if at.size < (1.0 - 1e-4 * length) * before {
                return Ok(true);
            }
            length *= 0.5;
        }
        Ok(false)
    }

    /// x - m u of a part; the second entry is 0 where there is none.
    fn trial(part: &Part, x: &[f64], velocity: &[f64]) -> [f64; 2] {
        std::array::from_fn(|k| {
            let at = part.first + k;
            if k < part.count { x[at] - velocity[at] / part.inverse_mass } else { 0.0 }
        })
    }

    /// Length of the natural map \[m/s\].
    fn size(&self, x: &[f64], velocity: &[f64]) -> f64 {
        let mut sum = 0.0;
        for part in &self.parts {
            let z = Self::trial(part, x, velocity);
            let nearest = match part.law {
                Law::Pushing => [z[0].max(0.0), 0.0],
                Law::Bounded(low, high) => [z[0].max(low).min(high), 0.0],
                Law::Limited(coefficient, by) => within(z, coefficient * x[by].max(0.0)),
            };
            for k in 0..part.count {
                let off = (x[part.first + k] - nearest[k]) * part.inverse_mass * part.length;
                sum += off * off;
            }
        }
        sum.sqrt()
    }

    /// The Newton step; `None` where the system is singular.
    fn change(&self, x: &[f64], velocity: &[f64], shift: f64) -> Option<Vec<f64>> {
        let n = x.len();
        let (mut entries, mut right) = (Vec::with_capacity(self.matrix.values.len() + n), vec![0.0; n]);
        for part in &self.parts {
            self.rows_of(part, (x, velocity), shift, &mut entries, &mut right);
        }
        let system = SparseColMat::<usize, f64>::try_new_from_triplets(n, n, &entries).ok()?;
        let factor = system.sp_lu().ok()?;
        let solution = factor.solve(&faer::Col::from_fn(n, |i| right[i]));
        let change: Vec<f64> = solution.iter().copied().collect();
        change.iter().all(|d| d.is_finite()).then_some(change)
    }

    /// The rows of a part: x - P(z) and its derivative.
    fn rows_of(
        &self,
        part: &Part,
        (x, velocity): (&[f64], &[f64]),
        shift: f64,
        entries: &mut Vec<Triplet<usize, usize, f64>>,
        right: &mut [f64],
    ) {
        let z = Self::trial(part, x, velocity);
        // P', and what the limit adds along its direction
        let mut slope = [[1.0, 0.0], [0.0, 1.0]];
        let (mut nearest, mut pull) = (z, None);
        match part.law {
            Law::Pushing if z[0] > 0.0 => {}
            Law::Bounded(low, high) if z[0] > low && z[0] < high => {}
            Law::Pushing => (nearest[0], slope[0][0]) = (0.0, 0.0),
            Law::Bounded(low, high) => (nearest[0], slope[0][0]) = (z[0].max(low).min(high), 0.0),
            // no friction holds nothing, not even what is at rest
            Law::Limited(0.0, _) => (nearest, slope) = ([0.0; 2], [[0.0; 2]; 2]),
            Law::Limited(coefficient, by) => {
                let limit = coefficient * x[by].max(0.0);
                nearest = within(z, limit);
                let length = libm::hypot(z[0], z[1]);
                if length > limit {
                    let (along, share) = ([z[0] / length, z[1] / length], limit / length);
                    for r in 0..2 {
                        for c in 0..2 {
                            slope[r][c] = share * (if r == c { 1.0 } else { 0.0 } - along[r] * along[c]);
                        }
                    }
                    pull = (x[by] > 0.0).then_some((by, along.map(|a| coefficient * a)));
                }
            }
        }
        for r in 0..part.count {
            let row = part.first + r;
            right[row] = nearest[r] - x[row];
            for c in 0..part.count {
                let own = if r == c { 1.0 + shift } else { 0.0 };
                let held = own - slope[r][c] + self.weight * slope[r][c];
                entries.push(Triplet::new(row, part.first + c, held));
                if slope[r][c] != 0.0 {
                    let factor = slope[r][c] / part.inverse_mass;
                    let coupled = self.matrix.row(part.first + c);
                    entries.extend(coupled.map(|(j, a)| Triplet::new(row, j, factor * a)));
                }
            }
            if let Some((by, pull)) = pull {
                entries.push(Triplet::new(row, by, -pull[r]));
            }
        }
    }
}

/// The nearest point no longer than the limit.
fn within(z: [f64; 2], limit: f64) -> [f64; 2] {
    let length = libm::hypot(z[0], z[1]);
    if length > limit { z.map(|z| z * (limit / length)) } else { z }
}
