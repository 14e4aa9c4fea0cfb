//! The exact solver on problems of bodies and contacts: rows on bodies of unit mass, B = J M^-1/2, so that
//! W = B B^T is never formed where many contacts share few bodies. Judged by the largest contact's error in m/s.

use super::analyses::Analyses;
use super::blocks::Blocks;
use super::equalities::{is_linear, solve_linear};
use super::frictionless::{Ended, Frictionless};
use super::mass_roots::MassRoots;
use super::memory::Memory;
use super::mixed::{is_boxed, is_mixed, solve_mixed};
use super::operator::Operator;
use super::single::{on_normal, single};
use super::{Goal, feasibility_of, solve_blocks};
use crate::cone::project;
use crate::friction_problem::project_on_cone;
use crate::impulse_solver::{Content, ImpulseChoice, ImpulseSolver, SolveSettings};
use crate::methods::judged_in;
use crate::outcome::{Outcome, Stop};
use crate::prepared::{Prepared, PreparedContact};
use crate::problem::{ContactProblem, FrictionLaw, Impulse, Impulses, Twist};
use crate::residual::residual_of;
use crate::watch::Watch;
use carom_math::{Column, Space};

/// The exact solver; holds memory between solves.
#[derive(Clone, Debug, Default)]
pub struct ExactContacts<S: Space> {
    prepared: Prepared<S>,
    given: Impulses<S>,
    frictionless: Frictionless<S>,
    analyses: Analyses,
    roots: MassRoots,
    /// Velocities after the impulses, for judging.
    after: Vec<Twist<S>>,
    lines: Memory<1>,
    plane: Memory<2>,
    space: Memory<3>,
}

/// How far below the asked tolerance the solver's own measure goes first: it is not the residual, but within a
/// small factor of it. Each further attempt asks for a tenth.
const SHARE: f64 = 0.3;
/// What is left of the tolerance by impulses that are taken as they are given, at most: far within what the stages' own measure
/// takes too, which is another by a small factor, so that nobody's way depends on who judged them.
const AS_GIVEN: f64 = 0.01;
/// Attempts to bring the residual below the tolerance.
const ATTEMPTS: i32 = 3;

impl<S: Space> ImpulseSolver<S> for ExactContacts<S> {
    fn name(&self) -> &'static str {
        "exact"
    }
    fn finds(&self, _choice: ImpulseChoice) -> bool {
        true
    }
    fn alone(
        &self,
        contact: &PreparedContact<S>,
        law: FrictionLaw,
        velocities: &[Twist<S>],
        old: &Impulse<S>,
    ) -> Option<Impulse<S>> {
        if is_boxed::<S>(law) { None } else { single(contact, velocities, old) }
    }
    fn alone_on_normal(&self, approach: f64, normal_mass: f64) -> Option<f64> {
        on_normal(approach, normal_mass)
    }
    fn all_on_normals(
        &mut self,
        asked: (&ContactProblem<S>, &[bool]),
        limits: (f64, usize),
        impulses: &mut Impulses<S>,
        watch: &mut Watch,
    ) -> Option<(usize, usize)> {
        self.frictionless.find(asked, limits, impulses, watch)
    }
    fn work(
        &mut self,
        problem: &ContactProblem<S>,
        settings: &SolveSettings,
        impulses: &mut Impulses<S>,
        watch: &mut Watch,
    ) -> Outcome {
        if let Some(outcome) = self.pivoted(problem, settings, impulses, watch) {
            return outcome;
        }
        self.prepared.update(problem);
        self.given.copy_from(impulses);
        if is_linear(problem) {
            let rounds = solve_linear(problem, &self.prepared, settings.tolerance, impulses);
            let spent = (rounds, settings.tolerance);
            return judged_in(problem, &self.prepared, spent, (&self.given, impulses), &mut self.after);
        }
        if is_mixed(problem) {
            let mut outcome = solve_mixed(problem, &self.prepared, settings, impulses, watch);
            self.keep_better(problem, &mut outcome, impulses);
            return outcome;
        }
        if settings.impulses == ImpulseChoice::Any {
            let as_given = self.as_given(problem, settings, impulses);
            if let Some(outcome) = as_given.or_else(|| self.at_once(problem, settings, impulses)) {
                return outcome;
            }
        }
        let smooth = problem.contacts.iter().all(|c| c.friction == 0.0);
        let asked = (problem, settings);
        match (smooth, S::SLIP) {
            (true, _) => {
                let mut memory = std::mem::take(&mut self.lines);
                let outcome = self.in_dimension::<1>(asked, impulses, &mut memory, watch);
                self.lines = memory;
                outcome
            }
            (false, 1) => {
                let mut memory = std::mem::take(&mut self.plane);
                let outcome = self.in_dimension::<2>(asked, impulses, &mut memory, watch);
                self.plane = memory;
                outcome
            }
            (false, _) => {
                let mut memory = std::mem::take(&mut self.space);
                let outcome = self.in_dimension::<3>(asked, impulses, &mut memory, watch);
                self.space = memory;
                outcome
            }
        }
    }
}

impl<S: Space> ExactContacts<S> {
    /// The impulses that were given, where they solve the problem far better than is asked: what rests stands on the forces of the
    /// step before, and rows on bodies of unit mass need not be written to find that.
    fn as_given(
        &mut self,
        problem: &ContactProblem<S>,
        settings: &SolveSettings,
        impulses: &mut Impulses<S>,
    ) -> Option<Outcome> {
        // a tolerance of 0 asks for all that stages can give
        let is_one = |g: &Impulse<S>| *g != Impulse::default();
        if settings.tolerance <= 0.0 || !impulses.contacts.iter().any(is_one) {
            return None;
        }
        let spent = (0, AS_GIVEN * settings.tolerance);
        let outcome = judged_in(problem, &self.prepared, spent, (&self.given, impulses), &mut self.after);
        (outcome.stop == Stop::Converged).then_some(outcome)
    }

    /// A single contact's solution, where it is good enough.
    fn at_once(
        &mut self,
        problem: &ContactProblem<S>,
        settings: &SolveSettings,
        impulses: &mut Impulses<S>,
    ) -> Option<Outcome> {
        let [contact] = self.prepared.contacts.as_slice() else { return None };
        impulses.contacts[0] = single(contact, &problem.velocities, &self.given.contacts[0])?;
        let (spent, given) = ((1, settings.tolerance), &self.given);
        let outcome = judged_in(problem, &self.prepared, spent, (given, impulses), &mut self.after);
        if outcome.stop == Stop::Converged {
            return Some(outcome);
        }
        impulses.copy_from(&self.given);
        None
    }

    /// Contacts without friction by pivots, where these come to the end.
    fn pivoted(
        &mut self,
        problem: &ContactProblem<S>,
        settings: &SolveSettings,
        impulses: &mut Impulses<S>,
        watch: &mut Watch,
    ) -> Option<Outcome> {
        let several = problem.contacts.len() > 1;
        if !several || !problem.is_of_normals() || settings.impulses != ImpulseChoice::Any {
            return None;
        }
        let limits = (settings.tolerance, settings.factorisations);
        let ended = self.frictionless.solve(problem, limits, impulses, watch)?;
        let Ended { residual, iterations, factorisations } = ended;
        Some(Outcome { factorisations, ..Outcome::new(iterations, residual, Stop::Converged) })
    }

    fn in_dimension<const D: usize>(
        &mut self,
        (problem, settings): (&ContactProblem<S>, &SolveSettings),
        impulses: &mut Impulses<S>,
        memory: &mut Memory<D>,
        watch: &mut Watch,
    ) -> Outcome {
        let mut blocks = std::mem::take(&mut memory.blocks);
        self.assemble(problem, &mut blocks);
        let mut r = memory.pool.zeros(blocks.velocity.len());
        let mut u = memory.pool.zeros(blocks.velocity.len());
        start(&blocks, impulses, &mut r);
        let (mut iterations, mut factorisations, mut worth_asking) = (0, 0, false);
        let mut outcome = Outcome::nothing_to_do();
        for attempt in 0..ATTEMPTS {
            let share = SHARE * 0.1_f64.powi(attempt) / blocks.largest_velocity();
            let goal = Goal {
                tolerance: settings.tolerance * share,
                sweeps: settings.iterations.min(300),
                patience: settings.iterations,
                factorisations: settings.factorisations - factorisations,
                impulses: settings.impulses,
                content: settings.content.map(|c| Content {
                    after: c.after.saturating_sub(factorisations),
                    tolerance: c.tolerance * SHARE / blocks.largest_velocity(),
                }),
                polish: settings.polish && settings.impulses == ImpulseChoice::Any,
                early: false,
            };
            let answer = solve_blocks(&blocks, &goal, (&mut r, &mut u), (&mut self.analyses, memory), watch);
            worth_asking = answer.is_worth_asking();
            iterations += answer.iterations();
            factorisations = (factorisations + answer.factorisations).min(settings.factorisations);
            read(&blocks, &mut r, impulses);
            let spent = (iterations, settings.tolerance);
            let (given, after) = (&self.given, &mut self.after);
            outcome = judged_in(problem, &self.prepared, spent, (given, impulses), after);
            outcome.factorisations = factorisations;
            let is_short = outcome.stop == Stop::OutOfIterations;
            outcome.stop = match outcome.stop {
                _ if answer.interrupted() => Stop::Interrupted,
                Stop::OutOfIterations if answer.out_of_budget() => Stop::OutOfFactorisations,
                Stop::Converged if answer.not_least => Stop::OutOfIterations,
                stop => stop,
            };
            let solved = answer.solved();
            memory.stages = answer.stages;
            if !is_short || !solved {
                break;
            }
        }
        self.keep_better(problem, &mut outcome, impulses);
        // a tolerance of 0 asks for nothing, so nothing is missed
        let enough = settings.content.map_or(0.0, |c| c.tolerance).max(settings.tolerance);
        if worth_asking && settings.tolerance > 0.0 && !(outcome.residual.absolute <= enough) {
            outcome.strict_feasibility = feasibility_of(&blocks, &mut self.analyses);
        }
        memory.blocks = blocks;
        memory.pool.give([r, u]);
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

    /// Writes the problem as rows on bodies of unit mass.
    fn assemble<const D: usize>(&mut self, problem: &ContactProblem<S>, blocks: &mut Blocks<D>) {
        self.roots.update(problem);
        if !matches!(blocks.operator, Operator::Bodies(_)) {
            blocks.operator = Operator::default();
        }
        let Operator::Bodies(rows) = &mut blocks.operator else { return };
        (rows.freedoms, rows.bodies) = (S::DOF, self.roots.count());
        rows.pairs.clear();
        rows.values.clear();
        let velocity = &mut blocks.velocity;
        velocity.clear();
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
        blocks.friction.clear();
        blocks.friction.extend(problem.contacts.iter().map(|c| c.friction));
        blocks.by_contact = true;
        blocks.diagonal.clear();
        blocks.diagonal.extend(self.prepared.contacts.iter().map(PreparedContact::block));
        blocks.complete();
    }
}

/// The start as arrays on the cones; zero where it is not finite.
fn start<S: Space, const D: usize>(blocks: &Blocks<D>, impulses: &Impulses<S>, r: &mut [[f64; D]]) {
    for ((r, impulse), mu) in r.iter_mut().zip(&impulses.contacts).zip(&blocks.friction) {
        *r = to_array(impulse);
        if !r.iter().all(|x| x.is_finite()) {
            *r = [0.0; D];
        }
        project_on_cone(r, *mu);
    }
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
