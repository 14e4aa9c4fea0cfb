//! Contacts with rolling or spinning friction, with box friction, or beside bounded rows: accelerated sweeps, and from
//! where they end semismooth Newton on the natural map of the one residual (Alart and Curnier 1991). With
//! z = x - m u and P the projection on the law, x of row i solves x - P(z) = 0; the rows of its derivative
//! I - P' (I - m A) - dP/dlimit are factorised with pivots, for they are neither symmetric nor definite. Where plain
//! Newton stalls, proximal points (stage D of `exact`): u + w (x - c) / m around a centre c.

use super::minimum_norm::KNOWN;
use super::minimum_norm_mixed::{largest_velocity, least};
use crate::cone::project;
use crate::delassus::{Csr, delassus_of};
use crate::impulse_solver::{Content, ImpulseChoice, ImpulseSolver, SolveSettings};
use crate::methods::nncg::Nncg;
use crate::methods::on_bodies::OnBodies;
use crate::outcome::{Outcome, Stop};
use crate::prepared::Prepared;
use crate::problem::{ContactProblem, FrictionLaw, Impulses};
use crate::residual::{Residual, residual_of};
use crate::watch::{Progress, Watch};
use carom_math::Space;
use faer::linalg::solvers::Solve;
use faer::sparse::{SparseColMat, Triplet};

/// Sweeps before the first Newton; each further round takes twice as many.
const SWEEPS: usize = 256;
/// Rounds of sweeps and Newton.
const ROUNDS: usize = 12;
/// Every so many rounds proximal points follow: other sweeps are cheaper than they are.
const EVERY: usize = 2;
/// Newton steps of a round, and of a proximal point.
const STEPS: usize = 30;
const INNER: usize = 15;
/// Newton steps without a better answer that end a round.
const PATIENCE: usize = 6;
/// Proximal points of a round.
const OUTER: usize = 40;
/// Weight of the first of them.
const WEIGHT: f64 = 0.1;
/// Shorter steps are not tried: 1/32.
const HALVINGS: usize = 5;
/// How far below `KNOWN` the velocities are solved, where that can be had, before the least impulses are looked for.
const SHARP: f64 = 1e-2;
/// Least shift of the diagonal, in shares of the row's own: what keeps redundant rows regular.
const SHIFT: f64 = 1e-10;

/// How impulses of a part are limited.
#[derive(Clone, Copy, Debug)]
enum Law {
    /// Not negative.
    Pushing,
    /// Between two numbers.
    Bounded(f64, f64),
    /// Together no longer than a coefficient times the impulse of a row.
    Limited(f64, usize),
}

/// Consecutive scalar rows under one law.
#[derive(Clone, Copy, Debug)]
struct Part {
    first: usize,
    count: usize,
    law: Law,
    /// The largest eigenvalue of A on these rows \[1/kg\].
    inverse_mass: f64,
    /// Makes their velocity one in m/s.
    length: f64,
}

/// Newton on one problem.
struct Newton<'a, S: Space> {
    problem: &'a ContactProblem<S>,
    prepared: &'a Prepared<S>,
    matrix: Csr,
    parts: Vec<Part>,
    /// The proximal term: its weight, 0 for none, and its centre.
    weight: f64,
    centre: Vec<f64>,
    settings: SolveSettings,
    factorisations: usize,
    best: Option<(Residual, Impulses<S>)>,
}

/// An iterate with its velocities, the proximal term included, and the length of its natural map.
struct Iterate<S: Space> {
    impulses: Impulses<S>,
    x: Vec<f64>,
    velocity: Vec<f64>,
    size: f64,
}

/// Why a stage ended before its time.
enum End {
    /// It gets no further.
    Stuck,
    /// The solve is over.
    Over(Stop),
}

/// True for problems that are more than contacts with Coulomb's disc.
pub fn is_mixed<S: Space>(problem: &ContactProblem<S>) -> bool {
    let boxed = S::SLIP > 1 && problem.friction_law == FrictionLaw::Box;
    !problem.rows.is_empty() || !problem.resistances.is_empty() || boxed
}

/// Solves such a problem.
pub fn solve_mixed<S: Space>(
    problem: &ContactProblem<S>,
    prepared: &Prepared<S>,
    settings: &SolveSettings,
    impulses: &mut Impulses<S>,
    watch: &mut Watch,
) -> Outcome {
    let is_least = settings.impulses == ImpulseChoice::MinimumNorm;
    let asked = settings.tolerance;
    let mut settings = *settings;
    if is_least {
        impulses.reset(problem);
        // errors of the velocities come back in the impulses, larger by what redundant contacts weigh
        settings.tolerance = asked.min(SHARP * KNOWN * largest_velocity(problem, prepared));
    }
    let mut sweeps = OnBodies::<S, Nncg>::default();
    let mut newton = Newton::of(problem, prepared, &settings);
    let (mut swept, mut stop) = (0, Stop::OutOfIterations);
    for round in 0..ROUNDS {
        // sweeps depend on the order of contacts; the least impulses must not where that can be helped
        let most = if is_least && round == 0 { 0 } else { SWEEPS << round.min(8) };
        let iterations = settings.iterations.min(most);
        let outcome = sweeps.work(problem, &SolveSettings { iterations, ..settings }, impulses, watch);
        swept += outcome.iterations;
        newton.keep(outcome.residual, impulses);
        match outcome.stop {
            Stop::OutOfIterations => {}
            // sweeps that diverge from a Newton iterate take nothing from what was found before
            Stop::Refused(_) if round > 0 => break,
            end => {
                stop = end;
                break;
            }
        }
        let mut end = newton.plain(impulses, watch);
        if matches!(end, End::Stuck) && (round + 1).is_multiple_of(EVERY) {
            end = newton.proximal(watch);
        }
        if let End::Over(end) = end {
            stop = end;
            break;
        }
        if let Some((_, found)) = &newton.best {
            impulses.copy_from(found);
        }
    }
    if is_least && matches!(stop, Stop::Converged | Stop::OutOfIterations) {
        stop = newton.least(asked, watch);
    }
    let residual = match newton.best {
        Some((residual, found)) => {
            impulses.copy_from(&found);
            residual
        }
        None => residual_of(problem, prepared, impulses),
    };
    let mut outcome = Outcome::new(swept + newton.factorisations, residual, stop);
    outcome.factorisations = newton.factorisations;
    outcome
}

impl<'a, S: Space> Newton<'a, S> {
    fn of(problem: &'a ContactProblem<S>, prepared: &'a Prepared<S>, settings: &SolveSettings) -> Self {
        Newton {
            problem,
            prepared,
            matrix: Csr::default(),
            parts: Vec::new(),
            weight: 0.0,
            centre: Vec::new(),
            settings: *settings,
            factorisations: 0,
            best: None,
        }
    }

    /// Puts the least impulses with the velocities of the best answer in its place, where they are found.
    fn least(&mut self, tolerance: f64, watch: &mut Watch) -> Stop {
        let Some((_, start)) = self.best.clone() else { return Stop::OutOfIterations };
        // to rounding: what rests must be told from what moves
        self.settings.tolerance = f64::EPSILON * largest_velocity(self.problem, self.prepared);
        if let End::Over(Stop::Interrupted) = self.plain(&start, watch) {
            return Stop::Interrupted;
        }
        let known = KNOWN * largest_velocity(self.problem, self.prepared);
        let Some((_, start)) = self.best.clone().filter(|b| b.0.absolute <= known) else {
            return Stop::OutOfIterations;
        };
        let most = self.settings.factorisations;
        let mut ask = || {
            let left = self.factorisations < most;
            self.factorisations += usize::from(left);
            left
        };
        let found = if S::SLIP == 1 {
            least::<S, 3>(self.problem, self.prepared, &start, &mut ask)
        } else {
            least::<S, 6>(self.problem, self.prepared, &start, &mut ask)
        };
        let Some(mut found) = found else { return Stop::OutOfIterations };
        project(self.problem, &mut found);
        let residual = residual_of(self.problem, self.prepared, &found);
        if residual.absolute > tolerance {
            return Stop::OutOfIterations;
        }
        self.best = Some((residual, found));
        Stop::Converged
    }

    /// Keeps the better of two answers; whether it is much better.
    fn keep(&mut self, residual: Residual, found: &Impulses<S>) -> bool {
        let before = self.best.as_ref().map_or(f64::INFINITY, |b| b.0.absolute);
        if residual.absolute < before && found.is_finite() {
            self.best = Some((residual, found.clone()));
        }
        residual.absolute < 0.5 * before
    }

    /// Judges an iterate by the one residual: whether it is much better than all before, or the end.
    fn judge(&mut self, impulses: &Impulses<S>) -> Result<bool, End> {
        let residual = residual_of(self.problem, self.prepared, impulses);
        let better = self.keep(residual, impulses);
        if residual.absolute <= self.settings.tolerance {
            Err(End::Over(Stop::Converged))
        } else {
            Ok(better)
        }
    }

    /// Asks whether another factorisation may be made.
    fn ask(&mut self, stage: &'static str, watch: &mut Watch) -> Result<(), End> {
        if self.factorisations >= self.settings.factorisations {
            return Err(End::Over(Stop::OutOfFactorisations));
        }
        let residual = self.best.as_ref().map_or(f64::INFINITY, |b| b.0.absolute);
        let will_do = |c: Content| self.factorisations >= c.after && residual <= c.tolerance;
        if self.settings.content.is_some_and(will_do) {
            return Err(End::Over(Stop::OutOfFactorisations));
        }
        if !watch(&Progress { stage, iterations: self.factorisations, residual }) {
            return Err(End::Over(Stop::Interrupted));
        }
        Ok(())
    }

    /// Newton from `impulses`.
    fn plain(&mut self, impulses: &Impulses<S>, watch: &mut Watch) -> End {
        if self.parts.is_empty() {
            self.matrix = delassus_of(self.problem, self.prepared);
            self.parts = parts(self.problem, self.prepared);
        }
        self.weight = 0.0;
        let mut at = self.iterate(impulses.clone());
        let first = at.size;
        let (mut fruitless, mut shift) = (0, SHIFT);
        for _ in 0..STEPS {
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
    fn proximal(&mut self, watch: &mut Watch) -> End {
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

/// Every scalar row under its law, in the order of `Impulses::flat`.
fn parts<S: Space>(problem: &ContactProblem<S>, prepared: &Prepared<S>) -> Vec<Part> {
    let mut parts = Vec::new();
    let mut push = |first: usize, count: usize, law: Law, inverse_mass: f64, length: f64| {
        // where no impulse moves anything, any step has the same fixed point
        let inverse_mass = if inverse_mass > 0.0 { inverse_mass } else { 1.0 };
        parts.push(Part { first, count, law, inverse_mass, length });
    };
    let boxed = S::SLIP > 1 && problem.friction_law == FrictionLaw::Box;
    let width = 1 + S::SLIP;
    for (i, c) in prepared.contacts.iter().enumerate() {
        let normal = i * width;
        push(normal, 1, Law::Pushing, c.normal.inverse_effective_mass, 1.0);
        let law = Law::Limited(c.friction, normal);
        if boxed {
            (0..S::SLIP).for_each(|k| push(normal + 1 + k, 1, law, c.inverse_tangent_mass, 1.0));
        } else {
            push(normal + 1, S::SLIP, law, c.inverse_tangent_mass, 1.0);
        }
    }
    let rows = prepared.contacts.len() * width;
    for (k, (given, row)) in problem.rows.iter().zip(&prepared.rows).enumerate() {
        push(rows + k, 1, Law::Bounded(given.lo, given.hi), row.inverse_effective_mass, 1.0);
    }
    let moments = rows + problem.rows.len();
    for (k, r) in prepared.resistances.iter().enumerate() {
        let first = moments + k * S::SPIN;
        let turned = r.all_parts().iter().filter(|p| p.end > p.first);
        turned.for_each(|p| {
            let law = Law::Limited(p.limit, r.contact * width);
            push(first + p.first, p.end - p.first, law, p.inverse_inertia, p.length);
        });
    }
    parts
}
