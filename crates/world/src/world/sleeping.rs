//! Who sleeps. Islands fall asleep at the end of a step, and wake before one, where somebody wrote to them or to what
//! they rest on, or within one, where something that moves comes near; the contacts of a step are looked for again then.
//! Who sleeps is part of the warm start, so that snapshots have it and a step that fails gives it back.

use super::World;
use super::standing::Written;
use crate::ahead::Ahead;
use crate::force::Wrench;
use crate::observe::accounts::{Mark, Motive};
use crate::observe::ledger::Ledger;
use crate::settings::Scheme;
use crate::sleep::{Asleep, Still};
use crate::stepping::soft_step::PatchList;
use carom_geometry::Geometry;
use carom_math::Several;
use carom_solver::Twist;
use std::sync::Arc;

/// No island.
const NONE: u32 = u32::MAX;

/// Memory of a search for islands.
#[derive(Default)]
pub(super) struct Islands {
    /// Parent of each body in the trees that are joined; entries of bodies that do not move mean nothing.
    parent: Vec<u32>,
    /// Whether a body has not rested for long enough; and whether an island of those that have, named by its root, stays awake.
    restless: Vec<bool>,
    awake: Vec<bool>,
    /// Whether an obstacle at rest bears it.
    borne: Vec<bool>,
    /// Number of an island among those that fall asleep.
    number: Vec<u32>,
}

impl Islands {
    /// Every mover by itself.
    fn begin(&mut self, bodies: usize, movers: &[u32]) {
        self.parent.resize(bodies, NONE);
        self.restless.resize(bodies, true);
        self.awake.resize(bodies, false);
        self.borne.resize(bodies, false);
        self.number.resize(bodies, NONE);
        for i in movers.iter().map(|i| *i as usize) {
            (self.parent[i], self.restless[i]) = (i as u32, true);
            (self.awake[i], self.borne[i], self.number[i]) = (false, false, NONE);
        }
    }
    fn root(&mut self, i: usize) -> usize {
        let mut i = i;
        while self.parent[i] as usize != i {
            let above = self.parent[self.parent[i] as usize];
            self.parent[i] = above;
            i = above as usize;
        }
        i
    }
    fn join(&mut self, i: usize, j: usize) {
        let (i, j) = (self.root(i), self.root(j));
        self.parent[i.max(j)] = i.min(j) as u32;
    }
}

impl<S: Geometry> World<S> {
    /// Wakes the island of a body; true when it slept. Forces, impulses and whatever is written to a body wake it too.
    pub fn wake(&mut self, body: usize) -> bool {
        let serial = [self.bodies.data[body].serial];
        self.wake_where(&|island| island.has_one_of(&serial))
    }

    /// Wakes all islands.
    pub(super) fn wake_all(&mut self) {
        self.wake_where(&|_| true);
    }

    /// Says to the bodies which of them sleep.
    pub(super) fn find_sleepers(&mut self) {
        if self.warm.asleep.is_empty() && self.bodies.asleep().is_empty() {
            return;
        }
        let bodies = &self.bodies;
        let serials = self.warm.asleep.iter().flat_map(|island| &island.serials);
        let found = serials.filter_map(|s| bodies.with_serial(*s)).filter(|i| bodies.is_dynamic(*i));
        let mut asleep: Vec<u32> = found.map(|i| i as u32).collect();
        asleep.sort_unstable();
        asleep.dedup();
        self.bodies.set_asleep(asleep);
    }

    /// Wakes what was stirred since the last step, so that a snapshot, which knows no writes, has it awake.
    pub(crate) fn wake_stirred(&mut self) {
        self.stand_as_before();
        self.stir();
    }

    /// Wakes what was stirred since the last step.
    pub(super) fn stir(&mut self) {
        let written = self.written > Written::Nothing;
        if written {
            self.find_sleepers();
        }
        if self.bodies.asleep().is_empty() {
            return;
        }
        if !self.may_sleep() || (written && self.an_obstacle_was_moved()) {
            return self.wake_all();
        }
        let (bodies, known) = (&self.bodies, &self.checkpoint.0);
        let is_written = |i: usize| {
            bodies.motion.twist(i) != Twist::default()
                || i >= known.position.len()
                || !bodies.motion.is_as_in(known, i)
        };
        let is_stirred = |i: usize| {
            (written && is_written(i)) || (self.is_applied && self.applied[i] != Wrench::default())
        };
        let stirred = bodies.asleep().iter().map(|i| *i as usize).filter(|i| is_stirred(*i));
        let serials: Vec<u64> = stirred.map(|i| bodies.data[i].serial).collect();
        if !serials.is_empty() {
            self.wake_where(&|island| island.has_one_of(&serials));
        }
    }

    /// Contacts of a soft step, and the patches that it starts from: where something that moves comes near islands that
    /// sleep, they wake, and the contacts are looked for anew.
    pub(super) fn find_soft_faces(&mut self, dt: f64) {
        self.woken.clear();
        loop {
            let (scheme, bodies, settings) = (&mut self.schemes.soft_step, &self.bodies, &self.settings);
            let before = if self.woken.is_empty() { &self.checkpoint.1.patches } else { &self.woken };
            let ahead = Ahead::new(bodies, settings, dt, &self.pushes.pulls);
            scheme.find((&mut self.narrow_phase, &mut self.standing_faces), ahead, before);
            if self.bodies.asleep().is_empty() {
                return;
            }
            let touched = self.touched();
            if touched.is_empty() {
                break;
            }
            let more = self.take_awake(&|island| island.has_one_of(&touched));
            if self.woken.is_empty() {
                self.woken.clone_from(&self.checkpoint.1.patches);
            }
            self.woken.merge(&more);
        }
        // obstacles at rest do not stir what sleeps on them
        self.schemes.soft_step.leave_sleepers(&self.bodies);
    }

    /// Puts islands to sleep that have rested, and books what that takes.
    pub(super) fn settle(&mut self, dt: f64, ledger: &mut Ledger) {
        if !self.may_sleep() {
            return;
        }
        let choice = self.settings.soft;
        let mut before = self.checkpoint.1.still.iter().peekable();
        let mut someone = false;
        for i in self.bodies.awake() {
            let serial = self.bodies.data[i].serial;
            while before.next_if(|s| s.serial < serial).is_some() {}
            let known = before.next_if(|s| s.serial == serial);
            let still = Still::after(known, &self.bodies, i, dt, &choice);
            someone |= still.since >= choice.sleep_time;
            self.warm.still.push(still);
        }
        if someone {
            let mut islands = std::mem::take(&mut self.islands);
            if self.find_islands(&mut islands) {
                self.find_bearers(&mut islands);
                self.fall_asleep(&mut islands, ledger);
            }
            self.islands = islands;
        }
    }

    /// Islands of what touches among those that have rested, and which of them stay awake: those that touch somebody who has not, or
    /// an obstacle that moves. Tells whether others are left.
    fn find_islands(&self, islands: &mut Islands) -> bool {
        let bodies = &self.bodies;
        islands.begin(bodies.len(), bodies.movers());
        for (i, still) in bodies.awake().zip(&self.warm.still) {
            islands.restless[i] = still.since < self.settings.soft.sleep_time;
        }
        let rests = |islands: &Islands, i: usize| bodies.is_dynamic(i) && !islands.restless[i];
        let pairs = || self.schemes.soft_step.pairs();
        for (a, b) in pairs() {
            if rests(islands, a) && rests(islands, b) {
                islands.join(a, b);
            }
        }
        let moves = |islands: &Islands, i: usize| match bodies.is_dynamic(i) {
            true => islands.restless[i],
            false => bodies.motion.twist(i) != Twist::default(),
        };
        for (a, b) in pairs() {
            for (i, other) in [(a, b), (b, a)] {
                if rests(islands, i) && moves(islands, other) {
                    let root = islands.root(i);
                    islands.awake[root] = true;
                }
            }
        }
        let mut some_sleep = false;
        for i in bodies.awake() {
            let root = islands.root(i);
            islands.awake[root] |= islands.restless[i];
            some_sleep |= !islands.awake[root];
        }
        some_sleep
    }

    /// Which islands obstacles at rest bear.
    fn find_bearers(&self, islands: &mut Islands) {
        let bodies = &self.bodies;
        let bears = |normal: &S::Points<f64>| normal.slice().iter().any(|force| *force > 0.0);
        for (seen, _) in self.warm.patches.iter().filter(|(_, force)| bears(&force.normal)) {
            let (Some(a), Some(b)) = (bodies.with_serial(seen.pair.0), bodies.with_serial(seen.pair.1))
            else {
                continue;
            };
            if bodies.is_dynamic(a) != bodies.is_dynamic(b) {
                let root = islands.root(if bodies.is_dynamic(a) { a } else { b });
                islands.borne[root] = true;
            }
        }
    }

    /// Takes the islands that may sleep out of the motion.
    fn fall_asleep(&mut self, islands: &mut Islands, ledger: &mut Ledger) {
        let mut fallen: Vec<Asleep<S>> = Vec::new();
        let mut indices = Vec::new();
        for i in self.bodies.awake() {
            let root = islands.root(i);
            if islands.awake[root] || !islands.borne[root] {
                continue;
            }
            if islands.number[root] == NONE {
                islands.number[root] = fallen.len() as u32;
                fallen.push(Asleep { serials: Vec::new(), patches: PatchList::default() });
            }
            fallen[islands.number[root] as usize].serials.push(self.bodies.data[i].serial);
            indices.push(i as u32);
        }
        if fallen.is_empty() {
            return;
        }
        let bodies = &self.bodies;
        let number = |pair: (u64, u64)| {
            let ends = [bodies.with_serial(pair.0), bodies.with_serial(pair.1)];
            let i = ends.into_iter().flatten().find(|i| bodies.is_dynamic(*i))?;
            let root = islands.root(i);
            Some(islands.number[root]).filter(|number| *number != NONE)
        };
        let numbers: Vec<Option<u32>> =
            self.warm.patches.seen.iter().map(|seen| seen.pair).map(number).collect();
        for ((seen, force), number) in self.warm.patches.iter().zip(&numbers) {
            if let Some(number) = number {
                fallen[*number as usize].patches.push(*seen, *force);
            }
        }
        self.warm.patches.retain(|k| numbers[k].is_none());
        self.stop(&indices, ledger);
        let serials: Vec<u64> = indices.iter().map(|i| self.bodies.data[*i as usize].serial).collect();
        self.warm.still.retain(|s| serials.binary_search(&s.serial).is_err());
        Arc::make_mut(&mut self.warm.asleep).extend(fallen.into_iter().map(Arc::new));
        self.find_sleepers();
        // steps keep the motion of what moves alone
        self.checkpoint.0.copy_some(&self.bodies.motion, &indices);
    }

    /// Takes the velocities of bodies that fall asleep.
    fn stop(&mut self, indices: &[u32], ledger: &mut Ledger) {
        let gravity = self.settings.gravity;
        let accounts = &mut self.schemes.soft_step.accounts;
        for i in indices.iter().map(|i| *i as usize) {
            let bodies = &mut self.bodies;
            ledger.sleep -= bodies.translational_energy(i) + bodies.rotational_energy(i);
            let before = accounts.are_kept().then(|| Mark::of(bodies, i, gravity));
            bodies.motion.set_twist(i, &Twist::default());
            if let Some(before) = before {
                accounts.change(i, &before, &Mark::of(bodies, i, gravity), Motive::Sleep);
            }
        }
    }

    /// Only soft steps know sleep, and only where no force field acts: what it will do to a body that sleeps is unknown.
    fn may_sleep(&self) -> bool {
        self.settings.scheme == Scheme::SoftStep && self.settings.soft.sleeping && self.fields.is_empty()
    }

    /// True when an obstacle that rested was moved since the last step, or set into motion, or one that moved was
    /// stopped, wherever it was put then.
    fn an_obstacle_was_moved(&self) -> bool {
        let (bodies, known) = (&self.bodies, &self.checkpoint.0);
        let rests = |twist: Twist<S>| twist == Twist::default();
        let rested = |i: usize| rests(known.twist(i)) || rests(bodies.motion.twist(i));
        let moved = |i: usize| !bodies.is_dynamic(i) && rested(i) && !bodies.motion.is_as_in(known, i);
        (0..bodies.len().min(known.position.len())).any(moved)
    }

    /// Serials of sleeping bodies that something that moves is near to, ascending.
    fn touched(&self) -> Vec<u64> {
        let bodies = &self.bodies;
        let stirs = |i: usize| {
            !bodies.is_asleep(i) && (bodies.is_dynamic(i) || bodies.motion.twist(i) != Twist::default())
        };
        let pairs = self.schemes.soft_step.pairs();
        let ends = pairs.flat_map(|(a, b)| [(a, b), (b, a)]);
        let touched = ends.filter(|(i, by)| bodies.is_asleep(*i) && stirs(*by));
        let mut serials: Vec<u64> = touched.map(|(i, _)| bodies.data[i].serial).collect();
        serials.sort_unstable();
        serials.dedup();
        serials
    }

    fn wake_where(&mut self, stirs: &dyn Fn(&Asleep<S>) -> bool) -> bool {
        let count = self.warm.asleep.len();
        let patches = self.take_awake(stirs);
        self.warm.patches.merge(&patches);
        self.warm.asleep.len() < count
    }

    /// Wakes islands and returns the forces that they had.
    fn take_awake(&mut self, stirs: &dyn Fn(&Asleep<S>) -> bool) -> PatchList<S> {
        let mut patches = PatchList::default();
        if !self.warm.asleep.iter().any(|island| stirs(island)) {
            return patches;
        }
        Arc::make_mut(&mut self.warm.asleep).retain(|island| {
            let stirred = stirs(island);
            if stirred {
                patches.merge(&island.patches);
            }
            !stirred
        });
        self.find_sleepers();
        patches
    }
}
