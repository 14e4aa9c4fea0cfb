//! Islands that several workers climb with. An island's impulses depend on nobody else's, so who climbs with it, and when,
//! changes nothing: answers are kept island by island, and taken in the order of the islands. The caller has the watch, and
//! looks at it while others work.

use super::climber::{Climbed, Climber};
use super::{Ladder, is_idle};
use crate::impulse_solver::SolveSettings;
use crate::islands::{Answer, Islands};
use crate::problem::{ContactProblem, Impulses};
use crate::watch::{Progress, Watch};
use carom_math::Space;
use carom_math::workers::lock;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};

/// Contacts and rows beside the largest island from which on others are called: to wake them takes as long as some dozens.
const LEAST: usize = 64;

/// What an island came to.
struct Slot<S: Space> {
    climbed: Option<Climbed>,
    answer: Answer<S>,
}

/// Who climbs beside the caller, and what islands came to.
pub(super) struct Shared<S: Space> {
    others: Vec<Mutex<Climber<S>>>,
    /// Islands, largest first, and what each came to.
    islands: Vec<usize>,
    slots: Vec<Mutex<Slot<S>>>,
    /// Where an island is among them.
    place: Vec<Option<usize>>,
}

impl<S: Space> Default for Shared<S> {
    fn default() -> Self {
        Shared { others: Vec::new(), islands: Vec::new(), slots: Vec::new(), place: Vec::new() }
    }
}

impl<S: Space> Shared<S> {
    /// Puts back an island's impulses, and tells what it came to; `None` where nobody climbed with it.
    pub fn take(&self, islands: &Islands, island: usize, impulses: &mut Impulses<S>) -> Option<Climbed> {
        let mut slot = lock(&self.slots[(*self.place.get(island)?)?]);
        let climbed = slot.climbed.take()?;
        slot.answer.give(impulses, islands, island);
        Some(climbed)
    }

    /// Finds the islands of a problem that are worth to be shared; false where they are few and small.
    fn find(&mut self, problem: &ContactProblem<S>, islands: &Islands) -> bool {
        let Shared { islands: found, slots, place, .. } = self;
        let size = |island: usize| islands.contacts(island).len() + islands.rows(island).len();
        found.clear();
        found.extend((0..islands.count()).filter(|&k| size(k) > 1 && !is_idle(problem, islands, k)));
        found.sort_by_key(|&k| std::cmp::Reverse(size(k)));
        place.clear();
        if found.iter().skip(1).map(|&k| size(k)).sum::<usize>() < LEAST {
            return false;
        }
        place.resize(islands.count(), None);
        found.iter().enumerate().for_each(|(at, &k)| place[k] = Some(at));
        while slots.len() < found.len() {
            slots.push(Mutex::new(Slot { climbed: None, answer: Answer::default() }));
        }
        // a solve that was refused or stopped leaves answers that nobody took
        slots.iter().for_each(|slot| lock(slot).climbed = None);
        true
    }
}

/// What workers tell each other.
#[derive(Default)]
struct Told {
    /// All are to stop.
    stops: AtomicBool,
    /// How far one has come.
    progress: Mutex<Option<Progress>>,
}

impl<S: Space> Ladder<S> {
    /// Climbs with all islands that are not done at once, where others are there to share that; true where the watch has
    /// asked to stop, and some may have been left out.
    pub(super) fn climb_shared(
        &mut self,
        problem: &ContactProblem<S>,
        settings: &SolveSettings,
        impulses: &Impulses<S>,
        watch: &mut Watch,
    ) -> bool {
        let Ladder { own, workers, shared, islands, .. } = self;
        shared.place.clear();
        if workers.is_alone() || !shared.find(problem, islands) {
            return false;
        }
        while shared.others.len() + 1 < workers.count() {
            shared.others.push(Mutex::new(own.like()));
        }
        let Shared { others, islands: found, slots, .. } = shared;
        let climb = |climber: &mut Climber<S>, k: usize, watch: &mut Watch| {
            let mut slot = lock(&slots[k]);
            slot.climbed = Some(climber.climb_out((problem, islands, found[k]), settings, impulses, watch));
            slot.answer.copy_from(&climber.part);
        };
        let told = Told::default();
        let stops = || told.stops.load(Ordering::Relaxed);
        workers.stages_beside(
            &[found.len() as u32],
            |turns| {
                let mut climber = lock(&others[turns.seat() - 1]);
                for (_, k) in turns {
                    let mut tell = |progress: &Progress| {
                        *lock(&told.progress) = Some(*progress);
                        !stops()
                    };
                    if !stops() {
                        climb(&mut climber, k, &mut tell);
                    }
                }
            },
            |mut turns| {
                let mut ask = |progress: &Progress| {
                    let goes_on = watch(progress);
                    told.stops.fetch_or(!goes_on, Ordering::Relaxed);
                    goes_on
                };
                while let Some((_, k)) = turns.next_while(|| {
                    if let Some(progress) = lock(&told.progress).take() {
                        ask(&progress);
                    }
                }) {
                    if !stops() {
                        climb(own, k, &mut ask);
                    }
                }
            },
        );
        stops()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::impulse_solver::SolverKind;
    use crate::problem::{Contact, InverseMass, Twist};
    use crate::watch::unwatched;
    use carom_math::{Column, Spatial, Sym3, Vec3, Workers, vec3};

    /// Balls of 1 kg and radius 1, each in a groove of its own.
    fn grooves(balls: usize, push: f64) -> ContactProblem<Spatial> {
        let ground = InverseMass { linear: 0.0, angular: Sym3 { diagonal: [0.0; 3], off: [0.0; 3] } };
        let ball = InverseMass { linear: 1.0, angular: Sym3 { diagonal: [2.5; 3], off: [0.0; 3] } };
        let falls = Twist::new(vec3(0.0, push, -1.0), Vec3::ZERO);
        let mut problem = ContactProblem::new(vec![ball; balls], vec![falls; balls]);
        problem.inverse_masses.push(ground);
        problem.velocities.push(Twist::default());
        for k in 0..2 * balls {
            let side = if k % 2 == 0 { 0.6 } else { -0.6 };
            let normal = vec3(side, 0.0, 0.8);
            problem.contacts.push(Contact {
                id: k as u64,
                a: k / 2,
                b: balls,
                normal,
                arm_a: -normal,
                arm_b: Vec3::ZERO,
                gap: 0.0,
                target: 0.0,
                slip_target: Column::ZERO,
                restitution: 0.0,
                friction: 0.3,
            });
        }
        problem
    }

    #[test]
    fn answers_that_nobody_took_are_forgotten() {
        let mut ladder = Ladder::<Spatial>::new("exact", &[SolverKind::Exact]);
        ladder.workers = Workers::new(2).unwrap();
        let (first, next) = (grooves(60, 0.1), grooves(60, 0.7));
        // a solve that was stopped or refused before its answers were taken
        ladder.islands.update(&first);
        let mut found = Impulses::zero(&first);
        let stopped = ladder.climb_shared(&first, &SolveSettings::default(), &found, &mut unwatched);
        assert!(!stopped && ladder.shared.take(&ladder.islands, 0, &mut found).is_some());
        ladder.islands.update(&next);
        assert!(ladder.shared.find(&next, &ladder.islands));
        for island in 0..ladder.islands.count() {
            let taken = ladder.shared.take(&ladder.islands, island, &mut found);
            assert!(taken.is_none(), "island {island} has the answer of another problem");
        }
    }
}
