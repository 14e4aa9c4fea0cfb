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
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};

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

/// Nobody waits for a lock here: climbers and islands are one worker's. After a panic they are as good as before.
fn lock<T>(shared: &Mutex<T>) -> MutexGuard<'_, T> {
    shared.lock().unwrap_or_else(PoisonError::into_inner)
}

impl<S: Space> Shared<S> {
    /// Puts back an island's impulses, and tells what it came to; `None` where nobody climbed with it.
    pub fn take(&mut self, islands: &Islands, island: usize, impulses: &mut Impulses<S>) -> Option<Climbed> {
        let slot = self.slots[(*self.place.get(island)?)?].get_mut().unwrap_or_else(PoisonError::into_inner);
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
