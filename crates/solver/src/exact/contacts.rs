//! The exact solver on problems of bodies and contacts: rows on bodies of unit mass, B = J M^-1/2, so that
//! W = B B^T is never formed where many contacts share few bodies. Judged by the largest contact's error in m/s.

use super::analyses::Analyses;
use super::blocks::Blocks;
use super::bodies::Rows;
use super::mass_roots::MassRoots;
use super::mixed::{is_mixed, solve_mixed};
use super::operator::Operator;
use super::{Goal, feasibility_of, solve_blocks};
use crate::cone::project;
use crate::friction_problem::project_on_cone;
use crate::impulse_solver::{ImpulseChoice, ImpulseSolver, SolveSettings};
use crate::methods::judged;
use crate::outcome::{Outcome, Stop};
use crate::prepared::Prepared;
use crate::problem::{ContactProblem, Impulse, Impulses};
use crate::residual::residual_of;
use crate::watch::Watch;
use carom_math::{Column, Space};

/// The exact solver; holds memory between solves.
#[derive(Clone, Debug, Default)]
pub struct ExactContacts<S: Space> {
    prepared: Prepared<S>,
    given: Impulses<S>,
    analyses: Analyses,
    roots: MassRoots,
}

/// How far below the asked tolerance the solver's own measure goes first: it is not the residual, but within a
/// small factor of it. Each further attempt asks for a tenth.
const SHARE: f64 = 0.3;
/// Attempts to bring the residual below the tolerance.
const ATTEMPTS: i32 = 3;

impl<S: Space> ImpulseSolver<S> for ExactContacts<S> {
    fn name(&self) -> &'static str {
        "exact"
    }
    fn finds(&self, _choice: ImpulseChoice) -> bool {
        true
    }
    fn work(
        &mut self,
        problem: &ContactProblem<S>,
        settings: &SolveSettings,
        impulses: &mut Impulses<S>,
        watch: &mut Watch,
    ) -> Outcome {
        self.prepared.update(problem);
        self.given.copy_from(impulses);
        if is_mixed(problem) {
            let mut outcome = solve_mixed(problem, &self.prepared, settings, impulses, watch);
            self.keep_better(problem, &mut outcome, impulses);
            return outcome;
        }
        let smooth = problem.contacts.iter().all(|c| c.friction == 0.0);
        match (smooth, S::SLIP) {
            (true, _) => self.in_dimension::<1>(problem, settings, impulses, watch),
            (false, 1) => self.in_dimension::<2>(problem, settings, impulses, watch),
            (false, _) => self.in_dimension::<3>(problem, settings, impulses, watch),
        }
    }
}

impl<S: Space> ExactContacts<S> {
    fn in_dimension<const D: usize>(
        &mut self,
        problem: &ContactProblem<S>,
        settings: &SolveSettings,
        impulses: &mut Impulses<S>,
        watch: &mut Watch,
    ) -> Outcome {
        let blocks = self.blocks::<D>(problem);
        let mut r = start(&blocks, impulses);
        let (mut iterations, mut factorisations, mut worth_asking) = (0, 0, false);
        let mut outcome = Outcome::nothing_to_do();
        for attempt in 0..ATTEMPTS {
            let goal = Goal {
                tolerance: settings.tolerance * SHARE * 0.1_f64.powi(attempt) / blocks.largest_velocity(),
                sweeps: settings.iterations.min(300),
                factorisations: settings.factorisations - factorisations,
                impulses: settings.impulses,
                early: false,
            };
            let answer = solve_blocks(&blocks, &goal, &mut r, &mut self.analyses, watch);
            worth_asking = answer.is_worth_asking();
            iterations += answer.iterations();
            factorisations = (factorisations + answer.factorisations).min(settings.factorisations);
            read(&blocks, &mut r, impulses);
            let spent = (iterations, settings.tolerance);
            outcome = judged(problem, &self.prepared, spent, &self.given, impulses);
            outcome.factorisations = factorisations;
            let is_short = outcome.stop == Stop::OutOfIterations;
            outcome.stop = match outcome.stop {
                _ if answer.interrupted() => Stop::Interrupted,
                Stop::OutOfIterations if answer.out_of_budget() => Stop::OutOfFactorisations,
                Stop::Converged if answer.not_least => Stop::OutOfIterations,
                stop => stop,
            };
            if !is_short || !answer.solved() {
                break;
            }
        }
        self.keep_better(problem, &mut outcome, impulses);
        // a tolerance of 0 asks for nothing, so nothing is missed
        if worth_asking && settings.tolerance > 0.0 && !(outcome.residual.absolute <= settings.tolerance) {
            outcome.strict_feasibility = feasibility_of(&blocks, &mut self.analyses);
        }
        outcome
    }

    /// A short budget may end where the first stages have led away from a good start.
    fn keep_better(&self, problem: &ContactProblem<S>, outcome: &mut Outcome, impulses: &mut Impulses<S>) {
        let is_short = matches!(outcome.stop, Stop::OutOfIterations | Stop::OutOfFactorisations);
        if !is_short || !self.given.is_finite() {
            return;
        }
        let mut given = self.given.clone();
        project(problem, &mut given);
        let residual = residual_of(problem, &self.prepared, &given);
        if residual.absolute < outcome.residual.absolute {
            outcome.residual = residual;
            *impulses = given;
        }
    }

    /// The problem as rows on bodies of unit mass.
    fn blocks<const D: usize>(&mut self, problem: &ContactProblem<S>) -> Blocks<D> {
        self.roots.update(problem);
        let (freedoms, bodies) = (S::DOF, self.roots.count());
        let mut rows = Rows::<D> { freedoms, bodies, pairs: Vec::new(), values: Vec::new() };
        let mut velocity = Vec::with_capacity(problem.contacts.len());
        for c in &self.prepared.contacts {
            let pair = [c.normal.a as usize, c.normal.b as usize];
            rows.pairs.push(pair.map(|body| self.roots.place(body)));
            for (body, sign) in pair.into_iter().zip([1.0, -1.0]) {
                for k in 0..D {
                    let row = if k == 0 { &c.normal } else { &c.tangents[k - 1] };
                    let moment = if sign > 0.0 { &row.moment_a } else { &row.moment_b };
                    self.roots.push::<S>(body, (&row.direction, moment), sign, &mut rows.values);
                }
            }
            let (normal, slip) = c.relative_velocity(&problem.velocities);
            velocity.push(std::array::from_fn(|k| if k == 0 { normal - c.target } else { slip[k - 1] }));
        }
        let friction = problem.contacts.iter().map(|c| c.friction).collect();
        let mut blocks = Blocks::assembled(Operator::Bodies(rows), velocity, friction);
        blocks.by_contact = true;
        blocks
    }
}

/// The start as arrays on the cones, padded; zero where it is not finite.
fn start<S: Space, const D: usize>(blocks: &Blocks<D>, impulses: &Impulses<S>) -> Vec<[f64; D]> {
    let mut r: Vec<[f64; D]> = impulses.contacts.iter().map(to_array).collect();
    for (r, mu) in r.iter_mut().zip(&blocks.friction) {
        if !r.iter().all(|x| x.is_finite()) {
            *r = [0.0; D];
        }
        project_on_cone(r, *mu);
    }
    r.resize(blocks.velocity.len(), [0.0; D]);
    r
}

/// Puts r on the cones and into impulses.
fn read<S: Space, const D: usize>(blocks: &Blocks<D>, r: &mut [[f64; D]], impulses: &mut Impulses<S>) {
    for ((impulse, r), mu) in impulses.contacts.iter_mut().zip(r).zip(&blocks.friction) {
        project_on_cone(r, *mu);
        let tangent = S::Slip::from_fn(|k| if D > 1 { r[1 + k] } else { 0.0 });
        *impulse = Impulse { normal: r[0], tangent };
    }
}

fn to_array<S: Space, const D: usize>(impulse: &Impulse<S>) -> [f64; D] {
    std::array::from_fn(|k| if k == 0 { impulse.normal } else { impulse.tangent[k - 1] })
}
