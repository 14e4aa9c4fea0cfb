//! Contacts with rolling or spinning friction, with box friction, or beside bounded rows, as `exact` solves them:
//! accelerated sweeps, from where they end semismooth Newton, then the interior point from cold and the curve through its
//! folds, with Newton from where they are near, then proximal points and longer sweeps (theory 7.9).

mod cone;
mod interior;
mod newton;
mod parts;
mod path;

use super::STARTS;
use super::interior_point::{STEPS as INTERIOR, Start, Trend};
use super::minimum_norm::KNOWN;
use super::minimum_norm_mixed::{largest_velocity, least};
use crate::cone::project;
use crate::delassus::{Csr, delassus_of};
use crate::impulse_solver::{Content, ImpulseChoice, ImpulseSolver, SolveSettings};
use crate::methods::nncg::NncgStage;
use crate::methods::on_bodies::OnBodies;
use crate::outcome::{Outcome, Stop};
use crate::prepared::Prepared;
use crate::problem::{ContactProblem, FrictionLaw, Impulses};
use crate::residual::{Residual, residual_of};
use crate::watch::{Progress, Watch};
use carom_math::Space;
use interior::Interior;
use newton::STEPS;
use parts::{Part, parts};
use path::Curve;

/// Sweeps before the first Newton; each further round takes twice as many.
const SWEEPS: usize = 256;
/// Rounds of sweeps and Newton.
const ROUNDS: usize = 12;
/// Every so many rounds proximal points follow: other sweeps are cheaper than they are.
const EVERY: usize = 2;
/// Newton steps from an interior point that is near.
const NEAR: usize = 8;
/// Smoothing of the curves of the first rounds, the points of each, and the share of the largest velocity from which Newton
/// is tried on them.
const CURVES: [f64; 2] = [0.01, 1.0];
const POINTS: usize = 400;
const CLOSE: f64 = 1e-2;
/// How far below `KNOWN` the velocities are solved, where that can be had, before the least impulses are looked for.
const SHARP: f64 = 1e-2;

/// The solve of one problem.
struct Mixed<'a, S: Space> {
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

/// Why a stage ended before its time.
enum End {
    /// It gets no further.
    Stuck,
    /// The solve is over.
    Over(Stop),
}

/// True for problems that are more than contacts with Coulomb's disc.
pub fn is_mixed<S: Space>(problem: &ContactProblem<S>) -> bool {
    !problem.rows.is_empty() || !problem.resistances.is_empty() || is_boxed::<S>(problem.friction_law)
}

/// True where friction is bounded by a box that is no cone.
pub fn is_boxed<S: Space>(law: FrictionLaw) -> bool {
    S::SLIP > 1 && law == FrictionLaw::Box
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
    let mut sweeps = OnBodies::<S, NncgStage>::default();
    let mut mixed = Mixed::of(problem, prepared, &settings);
    let (mut swept, mut stop) = (0, Stop::OutOfIterations);
    for round in 0..ROUNDS {
        // sweeps depend on the order of contacts; the least impulses must not where that can be helped
        let most = if is_least && round == 0 { 0 } else { SWEEPS << round.min(8) };
        let iterations = settings.iterations.min(most);
        let outcome = sweeps.work(problem, &SolveSettings { iterations, ..settings }, impulses, watch);
        swept += outcome.iterations;
        mixed.keep(outcome.residual, impulses);
        match outcome.stop {
            Stop::OutOfIterations => {}
            // sweeps that diverge from a Newton iterate take nothing from what was found before
            Stop::Refused(_) if round > 0 => break,
            end => {
                stop = end;
                break;
            }
        }
        let end = mixed.second_order(round, impulses, watch);
        if let End::Over(end) = end {
            stop = end;
            break;
        }
        if let Some((_, found)) = &mixed.best {
            impulses.copy_from(found);
        }
    }
    if is_least && matches!(stop, Stop::Converged | Stop::OutOfIterations) {
        stop = mixed.least(asked, watch);
    }
    let residual = match mixed.best {
        Some((residual, found)) => {
            impulses.copy_from(&found);
            residual
        }
        None => residual_of(problem, prepared, impulses),
    };
    let mut outcome = Outcome::new(swept + mixed.factorisations, residual, stop);
    outcome.factorisations = mixed.factorisations;
    outcome
}

impl<'a, S: Space> Mixed<'a, S> {
    fn of(problem: &'a ContactProblem<S>, prepared: &'a Prepared<S>, settings: &SolveSettings) -> Self {
        Mixed {
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

    /// The stages of a round that factorise, one after another until one ends the solve.
    fn second_order(&mut self, round: usize, impulses: &Impulses<S>, watch: &mut Watch) -> End {
        let mut end = self.plain(impulses, STEPS, watch);
        if let (End::Stuck, Some(&start)) = (&end, STARTS.get(round)) {
            end = self.interior(start, watch);
        }
        if let (End::Stuck, Some(&smoothing)) = (&end, CURVES.get(round)) {
            end = self.curve(smoothing, watch);
        }
        if matches!(end, End::Stuck) && (round + 1).is_multiple_of(EVERY) {
            end = self.proximal(watch);
        }
        end
    }

    /// Puts the least impulses with the velocities of the best answer in its place, where they are found.
    fn least(&mut self, tolerance: f64, watch: &mut Watch) -> Stop {
        let Some((_, start)) = self.best.clone() else { return Stop::OutOfIterations };
        // to rounding: what rests must be told from what moves
        self.settings.tolerance = f64::EPSILON * largest_velocity(self.problem, self.prepared);
        if let End::Over(Stop::Interrupted) = self.plain(&start, STEPS, watch) {
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

    /// The matrix, once it is asked for.
    fn assemble(&mut self) {
        if self.parts.is_empty() {
            self.matrix = delassus_of(self.problem, self.prepared);
            self.parts = parts(self.problem, self.prepared);
        }
    }

    /// Interior point from a cold start, with Newton from where it is near.
    fn interior(&mut self, start: Start, watch: &mut Watch) -> End {
        self.assemble();
        let without = self.prepared.velocity_errors(self.problem, &Impulses::zero(self.problem));
        let Some(mut interior) = Interior::cold(&self.matrix, &without, &self.parts, start) else {
            return End::Stuck;
        };
        let speed = largest_velocity(self.problem, self.prepared);
        let (mut trend, mut best) = (Trend::none(), f64::INFINITY);
        for _ in 0..INTERIOR {
            let flat: Vec<f64> = interior.impulses().collect();
            let Some(mut impulses) = Impulses::from_flat(self.problem, &flat) else { return End::Stuck };
            project(self.problem, &mut impulses);
            let residual = residual_of(self.problem, self.prepared, &impulses);
            if let Err(end) = self.judge(&impulses) {
                return end;
            }
            let error = residual.absolute / speed;
            best = error.min(best);
            if trend.stalls(best) {
                break;
            }
            if trend.is_near(error)
                && let End::Over(end) = self.plain(&impulses, NEAR, watch)
            {
                return End::Over(end);
            }
            if let Err(end) = self.ask("interior point", watch) {
                return end;
            }
            self.factorisations += 1;
            match interior.advance() {
                Some(length) if !trend.jams(length) => {}
                _ => break,
            }
        }
        End::Stuck
    }

    /// One curve followed through its folds, with Newton from where it is near.
    fn curve(&mut self, smoothing: f64, watch: &mut Watch) -> End {
        self.assemble();
        let without = self.prepared.velocity_errors(self.problem, &Impulses::zero(self.problem));
        let Some(mut curve) = Curve::begin(&self.matrix, &without, &self.parts, smoothing) else {
            return End::Stuck;
        };
        let speed = largest_velocity(self.problem, self.prepared);
        let mut last = (f64::INFINITY, f64::INFINITY);
        for _ in 0..POINTS {
            let Some(flat) = curve.impulses() else { break };
            let Some(mut impulses) = Impulses::from_flat(self.problem, &flat) else { break };
            project(self.problem, &mut impulses);
            let error = residual_of(self.problem, self.prepared, &impulses).absolute / speed;
            if let Err(end) = self.judge(&impulses) {
                return end;
            }
            let m = curve.mean();
            if error < CLOSE && (error < 0.2 * last.0 || m < 0.03 * last.1) {
                last = (error, m);
                if let End::Over(end) = self.plain(&impulses, NEAR, watch) {
                    return End::Over(end);
                }
            }
            if let Err(end) = self.ask("path", watch) {
                return end;
            }
            self.factorisations += 1;
            if curve.advance().is_none() {
                break;
            }
        }
        End::Stuck
    }
}
