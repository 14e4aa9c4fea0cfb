//! Impulses carried from step to step by contact id: the one hidden state of a trajectory, kept where a
//! snapshot can see it. Stored as forces in world axes, so that a turned frame or another step length
//! starts from the same force.

use crate::sleep::{Asleep, Still};
use crate::stepping::events::memory::Memory;
use crate::stepping::soft_step::PatchList;
use carom_math::{Column, Space};
use carom_solver::{Contact, ContactProblem, Impulse, Impulses};
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// Contact forces of the last step, sorted by id.
#[derive(Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(bound = "")]
pub struct WarmStart<S: Space> {
    /// Contact id, normal force \[N\], tangential force \[N\] in world axes.
    pub forces: Vec<(u64, f64, S::Vector)>,
    /// Contact id and moment of rolling and spinning friction \[N m\] in world axes.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub moments: Vec<(u64, S::Spin)>,
    /// Row id and its force \[N\], sorted by id.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub rows: Vec<(u64, f64)>,
    /// What the last step left of each joint.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub joints: crate::joint::Memory,
    /// What the last flows of a scheme with events tell of their contacts.
    #[serde(flatten)]
    pub contacts: Memory,
    /// Patches of contact after a soft step, with their forces.
    #[serde(default, skip_serializing_if = "PatchList::is_empty")]
    pub patches: PatchList<S>,
    /// For how long the awake bodies of a soft step have rested, ascending by serial.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub still: Vec<Still<S>>,
    /// Islands that sleep; shared, for a copy is kept at every step.
    #[serde(default, skip_serializing_if = "is_empty")]
    pub asleep: Arc<Vec<Arc<Asleep<S>>>>,
}

fn is_empty<S: Space>(asleep: &Arc<Vec<Arc<Asleep<S>>>>) -> bool {
    asleep.is_empty()
}

impl<S: Space> Clone for WarmStart<S> {
    fn clone(&self) -> Self {
        let mut other = WarmStart::default();
        other.clone_from(self);
        other
    }
    /// Keeps this one's memory: a step keeps a copy of it every time.
    fn clone_from(&mut self, other: &Self) {
        let WarmStart { forces, moments, rows, joints, contacts, patches, still, asleep } = other;
        self.forces.clone_from(forces);
        self.moments.clone_from(moments);
        self.rows.clone_from(rows);
        self.joints.clone_from(joints);
        self.contacts.clone_from(contacts);
        self.patches.clone_from(patches);
        self.still.clone_from(still);
        self.asleep.clone_from(asleep);
    }
}

impl<S: Space> WarmStart<S> {
    /// Keeps another as it is before a step, whose patches and rests are taken and not copied: a step reads the old ones
    /// here and leaves its own there.
    pub(crate) fn keep(&mut self, other: &mut Self) {
        let old = (std::mem::take(&mut other.patches), std::mem::take(&mut other.still));
        let mut spare = (std::mem::take(&mut self.patches), std::mem::take(&mut self.still));
        self.clone_from(other);
        spare.0.clear();
        spare.1.clear();
        (self.patches, self.still) = old;
        (other.patches, other.still) = spare;
    }
    /// Remembers the impulses of a step of length `dt`.
    pub fn store(&mut self, problem: &ContactProblem<S>, impulses: &Impulses<S>, dt: f64) {
        self.store_by(&ByName::of(problem), problem, impulses, dt);
    }
    /// The same where the order of the names is known.
    pub(crate) fn store_by(
        &mut self,
        names: &ByName,
        problem: &ContactProblem<S>,
        impulses: &Impulses<S>,
        dt: f64,
    ) {
        self.forces.clear();
        for k in names.order() {
            let (c, g) = (&problem.contacts[k], &impulses.contacts[k]);
            if g.normal > 0.0 {
                self.add(c, g, dt);
            }
        }
        self.moments.clear();
        for (r, &m) in problem.resistances.iter().zip(&impulses.moments) {
            let c = &problem.contacts[r.contact];
            if m != S::Spin::ZERO {
                self.moments.push((c.id, c.moment_to_world(m) * (1.0 / dt)));
            }
        }
        self.moments.sort_by_key(|m| m.0);
        self.rows.clear();
        self.rows.extend(problem.rows.iter().zip(&impulses.rows).map(|(r, l)| (r.id, l / dt)));
        self.rows.sort_by_key(|r| r.0);
        self.patches.clear();
    }
    /// Adds what a contact's impulse in a step of length `dt` tells; `sort` when all are in.
    pub(crate) fn add(&mut self, c: &Contact<S>, g: &Impulse<S>, dt: f64) {
        let tangent = c.to_world(&Impulse { normal: 0.0, tangent: g.tangent });
        self.forces.push((c.id, g.normal / dt, tangent * (1.0 / dt)));
    }
    /// Forgets all forces; what is remembered of joints stays.
    pub(crate) fn clear(&mut self) {
        self.forces.clear();
        self.moments.clear();
        self.rows.clear();
        self.contacts = Memory::default();
        self.patches.clear();
    }
    /// Adds another group's forces, and what it tells of its contacts; `sort` them when all are in.
    pub(crate) fn take_over(&mut self, other: WarmStart<S>, memory: Memory) {
        hand_over(&mut self.forces, other.forces);
        hand_over(&mut self.moments, other.moments);
        hand_over(&mut self.rows, other.rows);
        self.contacts.take_over(memory);
    }
    /// Puts all lists in order.
    pub(crate) fn sort(&mut self) {
        self.forces.sort_by_key(|f| f.0);
        self.forces.dedup_by_key(|f| f.0);
        self.moments.sort_by_key(|m| m.0);
        self.moments.dedup_by_key(|m| m.0);
        self.rows.sort_by_key(|r| r.0);
        self.rows.dedup_by_key(|r| r.0);
        self.contacts.sort();
    }
    /// Fills in the impulses of contacts and rows that were there in the last step.
    pub fn load(&self, problem: &ContactProblem<S>, dt: f64, impulses: &mut Impulses<S>) {
        for (c, g) in problem.contacts.iter().zip(&mut impulses.contacts) {
            if let Ok(k) = self.forces.binary_search_by_key(&c.id, |f| f.0) {
                *g = self.impulse(k, c, dt);
            }
        }
        self.load_others(problem, dt, impulses);
    }
    /// The same where the order of the names is known.
    pub(crate) fn load_by(
        &self,
        names: &ByName,
        problem: &ContactProblem<S>,
        dt: f64,
        impulses: &mut Impulses<S>,
    ) {
        let mut next = 0;
        for k in names.order() {
            let c = &problem.contacts[k];
            next += self.forces[next..].iter().take_while(|f| f.0 < c.id).count();
            if self.forces.get(next).is_some_and(|f| f.0 == c.id) {
                impulses.contacts[k] = self.impulse(next, c, dt);
            }
        }
        self.load_others(problem, dt, impulses);
    }
    /// The impulse that one of the forces gives a contact.
    fn impulse(&self, k: usize, c: &Contact<S>, dt: f64) -> Impulse<S> {
        let (_, normal, tangent) = self.forces[k];
        Impulse { normal: normal * dt, tangent: c.to_slip(tangent * dt) }
    }
    /// Rows and resistances of it.
    fn load_others(&self, problem: &ContactProblem<S>, dt: f64, impulses: &mut Impulses<S>) {
        for (r, l) in problem.rows.iter().zip(&mut impulses.rows) {
            if let Ok(k) = self.rows.binary_search_by_key(&r.id, |row| row.0) {
                *l = self.rows[k].1 * dt;
            }
        }
        for (r, m) in problem.resistances.iter().zip(&mut impulses.moments) {
            let c = &problem.contacts[r.contact];
            if let Ok(k) = self.moments.binary_search_by_key(&c.id, |m| m.0) {
                *m = c.moment_to_frame(self.moments[k].1 * dt);
            }
        }
    }
}

/// The contacts of a problem in the order of their names. It changes no answer: while the same contacts come in the same
/// order, nothing is sorted.
#[derive(Debug, Default)]
pub(crate) struct ByName(Vec<u32>);

impl ByName {
    /// Those of a problem.
    pub fn of<S: Space>(problem: &ContactProblem<S>) -> Self {
        let mut names = ByName::default();
        names.update(problem);
        names
    }
    /// Becomes those of a problem.
    pub fn update<S: Space>(&mut self, problem: &ContactProblem<S>) {
        let contacts = &problem.contacts;
        let name = |k: u32| contacts[k as usize].id;
        let stands = self.0.len() == contacts.len() && self.0.is_sorted_by(|&j, &k| name(j) < name(k));
        if !stands {
            self.0.clear();
            self.0.extend(0..contacts.len() as u32);
            self.0.sort_by_key(|&k| name(k));
        }
    }
    fn order(&self) -> impl Iterator<Item = usize> {
        self.0.iter().map(|&k| k as usize)
    }
}

/// Appends a list to another; where there is nothing yet, it takes its place.
pub(crate) fn hand_over<T>(list: &mut Vec<T>, more: Vec<T>) {
    if list.is_empty() {
        *list = more;
    } else {
        list.extend(more);
    }
}
