//! Stage B of `exact` for contacts beside bounded rows, moments and box friction: primal-dual interior point on the
//! nonassociated law of (7.11), with several cones on one normal impulse. Every part that a normal impulse limits is a
//! cone (c x_n, x_T) of its own, every bound a half-line, and together they hold
//!   sum over the cones of a normal row: c (y_0 - |y_T|) = u_n,   y_T = u_T,   x o y = m e,
//! which says u_n >= 0, x_n u_n = 0 and friction against the slip in each of them (theory eq. 7.15). Knows no sweeps.

use super::cone::{Cone, narrow, wide};
use super::parts::{Law, Part};
use crate::delassus::Csr;
use crate::exact::cone::shifted;
use crate::exact::interior_point::Start;
use faer::Col;
use faer::linalg::solvers::Solve;
use faer::sparse::linalg::solvers::{Lu, SymbolicLu};
use faer::sparse::{SparseColMat, Triplet};

/// What multiplies an equality row's own entry, so that repeated rows stay regular.
const SHIFT: f64 = 1e-10;

/// Factors of a square matrix.
pub trait Factor {
    /// The solution for a right-hand side.
    fn solved(&self, right: Col<f64>) -> Col<f64>;
}

impl<T: Solve<f64>> Factor for T {
    fn solved(&self, right: Col<f64>) -> Col<f64> {
        self.solve(&right)
    }
}

/// What a row is, beside the cones.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Kind {
    /// The head of cones, or an equality where there are none.
    Head,
    /// A tangent of a cone.
    Tangent,
    /// Held where it is.
    Fixed,
}

/// The interior point of one problem.
pub struct Interior {
    /// A in units of the whole.
    matrix: Csr,
    /// u without impulses.
    velocity: Vec<f64>,
    /// What makes impulses unknowns.
    units: Vec<f64>,
    kinds: Vec<Kind>,
    /// The cones by their heads.
    pub cones: Vec<Cone>,
    heads: Vec<std::ops::Range<usize>>,
    /// Unknowns, and their step.
    pub x: Vec<f64>,
    pub step: Vec<f64>,
    symbolic: Option<SymbolicLu<usize>>,
    start: Start,
}

impl Interior {
    /// A cold start; `velocity` is u without impulses. `None` where nothing is asked for.
    pub fn cold(matrix: &Csr, velocity: &[f64], parts: &[Part], start: Start) -> Option<Self> {
        let mut interior = Interior::of(matrix, velocity, parts, start)?;
        interior.place(parts);
        Some(interior)
    }

    /// The same without cones yet.
    fn of(matrix: &Csr, velocity: &[f64], parts: &[Part], start: Start) -> Option<Self> {
        let n = velocity.len();
        let mut lengths = vec![1.0; n];
        parts.iter().for_each(|p| lengths[p.first..p.first + p.count].fill(p.length));
        let masses = parts.iter().map(|p| p.inverse_mass * p.length * p.length);
        let mass = masses.sum::<f64>() / parts.len().max(1) as f64;
        let speed = velocity.iter().zip(&lengths).fold(0.0, |m: f64, (u, l)| m.max((u * l).abs()));
        if !(speed > 0.0 && mass > 0.0) {
            return None;
        }
        let mut scaled = matrix.clone();
        for i in 0..n {
            for at in scaled.starts[i]..scaled.starts[i + 1] {
                scaled.values[at] *= lengths[i] * lengths[scaled.indices[at]] / mass;
            }
        }
        let units: Vec<f64> = lengths.iter().map(|l| mass / (speed * l)).collect();
        let velocity = velocity.iter().zip(&lengths).map(|(u, l)| u * l / speed).collect();
        Some(Interior {
            matrix: scaled,
            velocity,
            kinds: vec![Kind::Head; n],
            cones: Vec::new(),
            heads: Vec::with_capacity(n),
            x: vec![0.0; n],
            step: vec![0.0; n],
            symbolic: None,
            units,
            start,
        })
    }

    /// A cold start whose impulses are of the size of those that would stop all motion: the root mean square of
    /// -(A + `ridge`)^-1 u, at least 1; with that size.
    pub fn sized(matrix: &Csr, velocity: &[f64], parts: &[Part], ridge: f64) -> Option<(Self, f64)> {
        let cold = Start { size: 1.0, smoothing: 0.0, centrality: 0.0 };
        let mut interior = Interior::of(matrix, velocity, parts, cold)?;
        let n = velocity.len();
        let rows = (0..n).flat_map(|i| interior.matrix.row(i).map(move |(j, a)| Triplet::new(i, j, a)));
        let entries: Vec<_> = rows.chain((0..n).map(|i| Triplet::new(i, i, ridge))).collect();
        let system = SparseColMat::<usize, f64>::try_new_from_triplets(n, n, &entries).ok()?;
        let stopping = system.sp_lu().ok()?.solved(Col::from_fn(n, |i| -interior.velocity[i]));
        let square = stopping.iter().map(|x| x * x).sum::<f64>() / n as f64;
        interior.start.size = Some(square.sqrt().max(1.0)).filter(|s| s.is_finite())?;
        interior.place(parts);
        let size = interior.start.size;
        Some((interior, size))
    }

    /// Cones and starting values of all parts.
    fn place(&mut self, parts: &[Part]) {
        let mut of_head: Vec<Vec<Cone>> = vec![Vec::new(); self.x.len()];
        // the widest cone decides where a normal impulse starts
        let mut widest = vec![0.0_f64; self.x.len()];
        for p in parts {
            if let Law::Limited(c, by) = p.law {
                widest[by] = widest[by].max(c / p.length);
            }
        }
        for p in parts {
            let k = p.first;
            match p.law {
                Law::Limited(c, by) if c > 0.0 => {
                    let size = self.start.size;
                    self.x[by] = size / widest[by];
                    self.kinds[k..k + p.count].fill(Kind::Tangent);
                    let share = c / p.length;
                    of_head[by].push(Cone::new((by, share), (k, p.count), share * self.x[by], size));
                }
                Law::Limited(..) => self.kinds[k..k + p.count].fill(Kind::Fixed),
                Law::Pushing if widest[k] > 0.0 => {}
                Law::Pushing => self.bound(k, (0.0, f64::INFINITY), &mut of_head[k]),
                Law::Bounded(low, high) => self.bound(k, (low, high), &mut of_head[k]),
            }
        }
        for cones in of_head {
            let first = self.cones.len();
            self.cones.extend(cones);
            self.heads.push(first..self.cones.len());
        }
    }

    /// Half-lines and starting value of a row between two numbers.
    fn bound(&mut self, row: usize, (low, high): (f64, f64), cones: &mut Vec<Cone>) {
        let (low, high) = (low * self.units[row], high * self.units[row]);
        let size = self.start.size;
        self.x[row] = match (low.is_finite(), high.is_finite()) {
            (true, true) => 0.5 * low + 0.5 * high,
            (true, false) => low + size,
            (false, true) => high - size,
            (false, false) => 0.0,
        };
        if low >= high {
            self.kinds[row] = Kind::Fixed;
            return;
        }
        for (bound, side) in [(low, 1.0), (high, -1.0)].into_iter().filter(|b| b.0.is_finite()) {
            let x = side * (self.x[row] - bound);
            cones.push(Cone::new((row, side), (row, 0), x, size));
        }
    }

    /// The impulses of the present point, in their own units.
    pub fn impulses(&self) -> impl Iterator<Item = f64> + '_ {
        self.x.iter().zip(&self.units).map(|(x, unit)| x / unit)
    }

    /// x.y of a cone, on the mean.
    pub fn mean(&self, step: f64) -> f64 {
        self.cones.iter().map(|c| c.complementarity(step)).sum::<f64>() / self.cones.len().max(1) as f64
    }

    /// The least sqrt(det x det y) of a cone after a step; NaN outside.
    pub fn least(&self, step: f64) -> f64 {
        // NaN counts as outside
        self.cones
            .iter()
            .map(|c| c.centrality(step))
            .fold(f64::INFINITY, |m, c| if c < m || c.is_nan() { c } else { m })
    }

    /// |y_T| of the cones, summed at their heads.
    pub fn slips(&self, smoothing: f64) -> Vec<f64> {
        let mut slips = vec![0.0; self.x.len()];
        self.cones.iter().for_each(|c| slips[c.head] += c.share * c.slip_length(smoothing));
        slips
    }

    /// One step; its length, or nothing when the numbers end.
    pub fn advance(&mut self) -> Option<f64> {
        let m = self.mean(0.0);
        let smoothing = self.start.smoothing * m;
        self.cones.iter_mut().for_each(|c| c.prepare(smoothing, 1.0));
        let residual = self.residual(smoothing, 1.0);
        let factor = self.factorised()?;
        // a start that is less central than asked must still be left
        let least = (self.start.centrality * m).min(0.9 * self.least(0.0));
        let affine = self.go(&factor, &residual, 0.0, false)?.min(1.0);
        let sigma = (self.mean(affine).max(0.0) / m).powi(3).clamp(1e-8, 1.0);
        self.cones.iter_mut().for_each(|c| c.affine = [c.dx, c.dy]);
        let longest = self.go(&factor, &residual, sigma * m, true)?;
        let (mut found, mut sure) = (self.trial(longest, (m, least)), (sigma, true));
        if found < 0.3 {
            for sigma in [0.3, 0.8] {
                let longest = self.go(&factor, &residual, sigma * m, false)?;
                let length = self.trial(longest, (m, least));
                if length > 1.5 * found {
                    (found, sure) = (length, (sigma, false));
                }
                if found > 0.3 {
                    break;
                }
            }
            self.go(&factor, &residual, sure.0 * m, sure.1)?;
        }
        self.take(found).then_some(found)
    }

    /// What the equations of all rows lack, with a share of the slip's length.
    pub fn residual(&self, smoothing: f64, share: f64) -> Vec<f64> {
        let mut lacks = self.matrix.times(&self.x);
        lacks.iter_mut().zip(&self.velocity).for_each(|(l, u)| *l = -(*l + u));
        for c in &self.cones {
            lacks[c.head] += c.share * (c.y[0] - share * c.slip_length(smoothing));
            (0..c.count).for_each(|k| lacks[c.first + k] += c.y[1 + k]);
        }
        lacks
    }

    /// A + sum E G^2, the pattern always the same.
    pub fn entries(&self) -> Vec<Triplet<usize, usize, f64>> {
        let n = self.x.len();
        let mut entries = Vec::with_capacity(self.matrix.values.len() + 9 * self.cones.len() + n);
        for i in 0..n {
            if self.kinds[i] == Kind::Fixed {
                entries.push(Triplet::new(i, i, 1.0));
                continue;
            }
            entries.extend(self.matrix.row(i).map(|(j, a)| Triplet::new(i, j, a)));
            let is_equality = self.kinds[i] == Kind::Head && self.heads[i].is_empty();
            entries.push(Triplet::new(i, i, if is_equality { SHIFT } else { 0.0 }));
        }
        for c in &self.cones {
            let block = c.scaling().squared(wide(c.slip)).map(narrow);
            let row = |k: usize| if k == 0 { (c.head, c.share) } else { (c.first + k - 1, 1.0) };
            for i in 0..=c.count {
                for j in 0..=c.count {
                    let ((r, left), (s, right)) = (row(i), row(j));
                    entries.push(Triplet::new(r, s, left * block[i][j] * right));
                }
            }
        }
        entries
    }

    fn factorised(&mut self) -> Option<Lu<usize, f64>> {
        let n = self.x.len();
        let system = SparseColMat::<usize, f64>::try_new_from_triplets(n, n, &self.entries()).ok()?;
        if self.symbolic.is_none() {
            self.symbolic = SymbolicLu::try_new(system.symbolic()).ok();
        }
        Lu::try_new_with_symbolic(self.symbolic.clone()?, system.as_ref()).ok()
    }

    /// The direction towards x.y = `target`, by factors of the entries: the longest step along it.
    pub fn go(&mut self, factor: &dyn Factor, residual: &[f64], target: f64, corrected: bool) -> Option<f64> {
        let mut right = residual.to_vec();
        for c in &mut self.cones {
            let drive = c.aim(target, corrected);
            let drive = narrow(shifted(wide(c.slip), wide(drive)));
            right[c.head] += c.share * drive[0];
            (0..c.count).for_each(|k| right[c.first + k] += drive[1 + k]);
        }
        let held = self.kinds.iter().zip(&mut right).filter(|(k, _)| **k == Kind::Fixed);
        held.for_each(|(_, r)| *r = 0.0);
        let solution = factor.solved(Col::from_fn(right.len(), |i| right[i]));
        self.step.clear();
        self.step.extend(solution.iter());
        if !self.step.iter().all(|d| d.is_finite()) {
            return None;
        }
        self.cones.iter_mut().for_each(|c| c.follow(&self.step));
        Some(self.reach())
    }

    /// The longest step along the present direction; very large when nothing ends it.
    pub fn reach(&self) -> f64 {
        self.cones.iter().map(Cone::reach).fold(1e30, f64::min)
    }

    /// The longest step that keeps the point central.
    fn trial(&self, longest: f64, (m, least): (f64, f64)) -> f64 {
        let mut length = (longest * (1.0 - m).clamp(0.9, 0.9995)).min(1.0);
        for _ in 0..30 {
            if length <= 1e-12 || self.least(length) >= least {
                break;
            }
            length *= 0.8;
        }
        length
    }

    /// Goes along the present direction; false when the numbers end.
    pub fn take(&mut self, step: f64) -> bool {
        self.x.iter_mut().zip(&self.step).for_each(|(x, d)| *x += step * d);
        for c in &mut self.cones {
            (c.x, c.y) = (Cone::after(c.x, c.dx, step), Cone::after(c.y, c.dy, step));
        }
        self.x.iter().all(|x| x.is_finite())
    }
}
