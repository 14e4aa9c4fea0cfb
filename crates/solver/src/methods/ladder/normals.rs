//! Contacts without friction, of all islands at once: a matrix of islands beside each other falls apart by itself, so
//! that they need neither be taken out one by one nor be measured twice.

use super::{Climbed, Ladder, is_idle};
use crate::impulse_solver::{ImpulseChoice, SolveSettings};
use crate::outcome::{Outcome, StageReport, Stages, Stop};
use crate::problem::{ContactProblem, Impulse, Impulses};
use crate::residual::{LargestOfNormals, Residual, each_of_normals};
use crate::watch::Watch;
use carom_math::Space;

/// How an island was done with.
enum Done {
    /// Nothing presses.
    Idle,
    /// It is one contact, which was solved by itself.
    Alone(Climbed),
    /// With the others.
    Together,
}

impl<S: Space> Ladder<S> {
    /// Solves a problem of nothing but contacts without friction where the first solver does so at once and the residual is
    /// within the tolerance.
    pub(super) fn on_normals(
        &mut self,
        problem: &ContactProblem<S>,
        settings: &SolveSettings,
        impulses: &mut Impulses<S>,
        watch: &mut Watch,
    ) -> Option<Outcome> {
        if settings.impulses != ImpulseChoice::Any {
            return None;
        }
        let done = self.set_apart(problem, settings, impulses)?;
        let mut spent = (0, 0);
        if self.asked.contains(&true) {
            let limits = (settings.tolerance, settings.factorisations);
            let asked = (problem, self.asked.as_slice());
            spent = self.rungs[0].1.all_on_normals(asked, limits, impulses, watch)?;
        }
        let residual = self.measure(problem, impulses);
        // false for NaN
        let is_within = residual.absolute <= settings.tolerance;
        if !is_within {
            return None;
        }
        let mut outcome =
            Outcome { factorisations: spent.1, ..Outcome::new(spent.0, residual, Stop::Converged) };
        outcome.islands.reserve(done.len());
        for (island, done) in done.into_iter().enumerate() {
            let climbed = match done {
                Done::Idle => continue,
                Done::Alone(climbed) => {
                    outcome.iterations += climbed.stages.iter().map(|s| s.iterations).sum::<usize>();
                    climbed
                }
                Done::Together => self.with_others(island, spent),
            };
            outcome.islands.push(self.report(island, climbed));
        }
        Some(outcome)
    }

    /// Does with the islands that are idle or one contact, and marks the contacts of the others; `None` where one contact is
    /// not solved by itself.
    fn set_apart(
        &mut self,
        problem: &ContactProblem<S>,
        settings: &SolveSettings,
        impulses: &mut Impulses<S>,
    ) -> Option<Vec<Done>> {
        self.asked.clear();
        self.asked.resize(problem.contacts.len(), false);
        let mut all = Vec::with_capacity(self.islands.count());
        for island in 0..self.islands.count() {
            let contacts = self.islands.contacts(island);
            all.push(if is_idle(problem, &self.islands, island) {
                contacts.iter().for_each(|&k| impulses.contacts[k] = Impulse::default());
                Done::Idle
            } else if contacts.len() == 1 {
                Done::Alone(self.alone(problem, settings, island, impulses)?)
            } else {
                contacts.iter().for_each(|&k| self.asked[k] = true);
                Done::Together
            });
        }
        Some(all)
    }

    /// The residual of the whole, and what each contact leaves.
    fn measure(&mut self, problem: &ContactProblem<S>, impulses: &Impulses<S>) -> Residual {
        let Ladder { pressed, after, left, .. } = self;
        left.clear();
        let mut all = LargestOfNormals::default();
        each_of_normals(problem, impulses, (pressed, after), |k, of_contact| {
            all.add(k, of_contact);
            left.push(of_contact);
        });
        all.residual()
    }

    /// How an island came out that was solved with others, all of which took so many iterations and factorisations.
    fn with_others(&self, island: usize, (iterations, factorisations): (usize, usize)) -> Climbed {
        let mut own = LargestOfNormals::default();
        // counted within the island
        self.islands.contacts(island).iter().enumerate().for_each(|(i, &k)| own.add(i, self.left[k]));
        let residual = own.residual();
        let stages = Stages::One([StageReport {
            solver: self.rungs[0].0,
            iterations,
            factorisations,
            residual: residual.absolute,
            stop: Stop::Converged,
        }]);
        Climbed { stages, residual, stop: Stop::Converged, strict_feasibility: None }
    }
}
