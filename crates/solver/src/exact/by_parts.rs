//! The pipeline where a matrix falls into parts. Errors of parts add up to those of the whole, each a share of its own |q|.

use super::analyses::Analyses;
use super::blocks::{Blocks, Section};
use super::judge::{Errors, HAND};
use super::memory::Memory;
use super::operator::Matrix;
use super::parts::Parts;
use super::stage::StageEnd;
use super::sweeps::{self, Ended};
use super::{Answer, Goal, factorised, is_given};
use crate::watch::Watch;
use std::sync::Arc;

/// Impulses in r, and where the sweeps end it their velocities in u: all parts are swept before one is factorised. Half of
/// what squared errors may be together goes to parts by their squared velocities, half by their contacts: nothing is spent
/// on errors that are small beside those of all, and no part that moves is asked for much more than the whole is. What a
/// part leaves of its share goes to the next.
pub fn solve_parts<const D: usize>(
    (matrix, parts): (&Matrix, &Parts),
    blocks: &Blocks<D>,
    goal: &Goal,
    (r, u): (&mut [[f64; D]], &mut [[f64; D]]),
    (analyses, memory): (&mut Analyses, &mut Memory<D>),
    watch: &mut Watch,
) -> Answer {
    let given = is_given(r).then(|| memory.pool.copy(r));
    memory.sweeps.begin(blocks, r);
    let mut all = Answer { stages: memory.stages_after(0), ..Answer::nothing() };
    let (mut squares, whole) = (Squares::default(), blocks.all().squared_velocity());
    let mut allowance = Allowance { each: whole / blocks.count() as f64, left: 0.0 };
    let mut left = Vec::new();
    for part in parts.ranges() {
        let section = blocks.section(part.clone());
        let share = allowance.of(&section);
        let limits = (goal.tolerance * share, goal.most_sweeps(is_given(&r[part.clone()])));
        let own = (&mut r[part.start..], &mut u[part.start..]);
        let (count, errors, ended) = sweeps::sweeps(section, limits, own, &mut memory.sweeps, watch);
        all.stages[0].iterations = count.max(all.stages[0].iterations);
        match ended {
            Ended::Solved => {
                squares.add(&errors, section.size());
                allowance.take(&section, share, errors.worst() / goal.tolerance);
            }
            Ended::LeftOff => left.push((part, errors)),
            Ended::Interrupted => {
                squares.add(&errors, section.size());
                all.end = StageEnd::Interrupted;
                break;
            }
        }
    }
    all.has_velocities = left.is_empty() && all.solved();
    let mut as_they_are = squares;
    left.iter().for_each(|(part, errors)| as_they_are.add(errors, blocks.section(part.clone()).size()));
    let enough = as_they_are.errors(whole).solves(goal.tolerance);
    for (part, errors) in left {
        let section = blocks.section(part.clone());
        if enough || all.interrupted() {
            squares.add(&errors, section.size());
            continue;
        }
        let allowed = goal.factorisations - all.factorisations.min(goal.factorisations);
        let share = allowance.of(&section);
        let own_goal = Goal { tolerance: goal.tolerance * share, factorisations: allowed, ..*goal };
        let own = blocks.part_alone(part.clone(), Arc::new(parts.matrix_of(matrix, part.clone())));
        let mut x = memory.pool.copy(&r[part.clone()]);
        x.resize(own.velocity.len(), [0.0; D]);
        let given = given.as_deref().map(|given| &given[part.clone()]).filter(|given| is_given(given));
        let mut answer = Answer { errors, ..Answer::nothing() };
        factorised(&own, &own_goal, (&mut x, given), &mut answer, (analyses, memory), watch);
        r[part.clone()].copy_from_slice(&x[..part.len()]);
        memory.pool.give([x]);
        squares.add(&answer.errors, section.size());
        if answer.solved() {
            allowance.take(&section, share, answer.errors.worst() / goal.tolerance);
        }
        all.also(answer);
    }
    memory.pool.give(given);
    all.errors = squares.errors(whole);
    all
}

/// What squared errors may still be, over the squared tolerance \[m^2/s^2\].
struct Allowance {
    /// |q|^2 per contact.
    each: f64,
    /// What the parts so far have left.
    left: f64,
}

impl Allowance {
    /// What the error of a part may be in terms of its own |q|, over the tolerance.
    fn of<const D: usize>(&self, section: &Section<'_, D>) -> f64 {
        let own = 0.5 * (section.squared_velocity() + section.count as f64 * self.each);
        ((own + self.left) / section.size().powi(2)).sqrt()
    }
    /// A part takes of that share what its error is, with what `Errors::solves` keeps in hand.
    fn take<const D: usize>(&mut self, section: &Section<'_, D>, share: f64, error: f64) {
        let (size, used) = (section.size(), error / HAND);
        self.left = ((share * share - used * used) * size * size).max(0.0);
    }
}

/// Squared errors of parts together, natural and scaled \[m^2/s^2\].
#[derive(Clone, Copy, Default)]
struct Squares([f64; 2]);

impl Squares {
    /// Adds the errors of one more part, shares of its own |q|.
    fn add(&mut self, errors: &Errors, size: f64) {
        for (square, error) in self.0.iter_mut().zip([errors.natural, errors.scaled]) {
            *square += error * error * size * size;
        }
    }
    /// The errors of all of them as shares of |q|, whose square this is.
    fn errors(&self, squared: f64) -> Errors {
        let size = if squared > 0.0 { squared.sqrt() } else { 1.0 };
        let [natural, scaled] = self.0.map(|square| square.sqrt() / size);
        Errors { natural, scaled }
    }
}

impl Answer {
    /// Takes on the stages of a part that was factorised, and how they ended where that is worse.
    fn also(&mut self, part: Answer) {
        self.factorisations += part.factorisations;
        for stage in part.stages {
            match self.stages.iter_mut().find(|s| s.name == stage.name) {
                Some(same) => same.iterations += stage.iterations,
                None => self.stages.push(stage),
            }
        }
        let rank = |end: StageEnd| match end {
            StageEnd::Solved => 0,
            StageEnd::Stuck => 1,
            StageEnd::OutOfBudget => 2,
            StageEnd::Interrupted => 3,
        };
        if rank(part.end) > rank(self.end) {
            self.end = part.end;
        }
    }
}
