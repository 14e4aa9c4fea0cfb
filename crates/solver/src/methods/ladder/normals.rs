//! Contacts without friction, of all islands at once: a matrix of islands beside each other falls apart by itself, so
//! that they need neither be taken out one by one nor be measured twice.

use super::climber::Climbed;
use super::{Ladder, is_idle};
use crate::impulse_solver::{ImpulseChoice, SolveSettings};
use crate::outcome::{Outcome, StageReport, Stages, Stop};
use crate::problem::{ContactProblem, Impulse, Impulses};
use crate::residual::{LargestOfNormals, Residual, each_of_normals};
use crate::watch::Watch;
use carom_math::Space;

/// How an island is done with.
#[derive(Clone, Copy)]
enum Way {
    /// Nothing presses.
    Idle,
    /// It is one contact, which is solved by itself.
    Alone,
    /// With the others.
    Together,
}

impl<S: Space> Ladder<S> {
    /// Solves a problem of nothing but contacts without friction where the first solver does so at once and the residual is
    /// within the tolerance; where not, the impulses are anything.
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
        let ways = self.ways(problem);
        let mut spent = (0, 0);
        if self.asked.contains(&true) {
            let limits = (settings.tolerance, settings.factorisations);
            let asked = (problem, self.asked.as_slice());
            spent = self.own.first_mut().all_on_normals(asked, limits, impulses, watch)?;
        }
        let mut climbed = Vec::with_capacity(ways.len());
        for (island, way) in ways.iter().enumerate() {
            climbed.push(match way {
                Way::Alone => Some(self.alone(problem, settings, island, impulses)?),
                Way::Idle => {
                    let contacts = self.islands.contacts(island);
                    contacts.iter().for_each(|&k| impulses.contacts[k] = Impulse::default());
                    None
                }
                Way::Together => None,
            });
        }
        let residual = self.measure(problem, impulses);
        // false for NaN
        let is_within = residual.absolute <= settings.tolerance;
        is_within.then(|| self.outcome(&ways, climbed, (spent, residual)))
    }

    /// How islands are done with; marks the contacts of those that are solved together.
    fn ways(&mut self, problem: &ContactProblem<S>) -> Vec<Way> {
        let Ladder { islands, asked, .. } = self;
        asked.clear();
        asked.resize(problem.contacts.len(), false);
        let way = |island: usize| match islands.contacts(island) {
            _ if is_idle(problem, islands, island) => Way::Idle,
            [_] => Way::Alone,
            contacts => {
                contacts.iter().for_each(|&k| asked[k] = true);
                Way::Together
            }
        };
        (0..islands.count()).map(way).collect()
    }

    /// The outcome, with a report of each island where anything presses.
    fn outcome(
        &self,
        ways: &[Way],
        climbed: Vec<Option<Climbed>>,
        ((iterations, factorisations), residual): ((usize, usize), Residual),
    ) -> Outcome {
        let mut outcome = Outcome::new(iterations, residual, Stop::Converged);
        outcome.factorisations = factorisations;
        outcome.islands.reserve(ways.len());
        for (island, (way, alone)) in ways.iter().zip(climbed).enumerate() {
            let climbed = match (way, alone) {
                (Way::Together, _) => self.with_others(island, (iterations, factorisations)),
                (_, Some(alone)) => {
                    outcome.iterations += alone.stages.iter().map(|s| s.iterations).sum::<usize>();
                    alone
                }
                _ => continue,
            };
            outcome.islands.push(self.report(island, climbed));
        }
        outcome
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
            solver: self.own.kind(),
            iterations,
            factorisations,
            residual: residual.absolute,
            stop: Stop::Converged,
        }]);
        Climbed { stages, residual, stop: Stop::Converged, strict_feasibility: None }
    }
}
