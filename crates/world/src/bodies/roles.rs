//! Who moves, who sleeps and who stands, so that a step looks at no others. Known of bodies as they were when a step last began; where somebody
//! may have written to them since, what hangs on more than that is read from the bodies.

use super::{Bodies, BodyData, Motion};
use crate::body::BodyKind;
use carom_geometry::Geometry;
use carom_math::Column;

/// Who moves, so that a step looks at no others.
#[derive(Clone, Default)]
pub(super) struct Roles {
    /// Bodies that impulses move, ascending.
    dynamic: Vec<u32>,
    /// Whether impulses move a body.
    is_dynamic: Vec<bool>,
    /// Some are damped.
    are_damped: bool,
    /// All bodies but fixed ones, ascending.
    not_fixed: Vec<u32>,
    /// Those of them that do not sleep.
    movers: Vec<u32>,
    /// Those of them that sleep.
    asleep: Vec<u32>,
    /// Whether a body sleeps; empty before the first one does.
    sleeps: Vec<bool>,
    /// Counts the sets of bodies that sleep.
    sleep_number: u64,
    /// Counts what the fixed bodies were like; one number, one state of them.
    number: u64,
    /// The fixed bodies are as they were when they got their number.
    is_sure: bool,
}

impl Roles {
    pub fn of<S: Geometry>(data: &[BodyData<S>], number: u64) -> Self {
        let with = |fits: &dyn Fn(BodyKind) -> bool| -> Vec<u32> {
            (0..data.len()).filter(|i| fits(data[*i].kind)).map(|i| i as u32).collect()
        };
        let (dynamic, not_fixed) =
            (with(&|kind| kind == BodyKind::Dynamic), with(&|kind| kind != BodyKind::Fixed));
        let movers = not_fixed.clone();
        let is_dynamic = data.iter().map(|d| d.kind == BodyKind::Dynamic).collect();
        let are_damped = data.iter().any(BodyData::is_damped);
        Roles { dynamic, is_dynamic, are_damped, not_fixed, movers, number, ..Roles::default() }
    }
    /// Takes in a body after all others.
    pub fn add(&mut self, i: u32, kind: BodyKind, is_damped: bool) {
        self.is_sure = false;
        self.are_damped |= is_damped;
        self.is_dynamic.push(kind == BodyKind::Dynamic);
        if kind == BodyKind::Dynamic {
            self.dynamic.push(i);
        }
        if kind != BodyKind::Fixed {
            self.not_fixed.push(i);
            self.movers.push(i);
        }
        if !self.sleeps.is_empty() {
            self.sleeps.push(false);
        }
    }
}

impl<S: Geometry> Bodies<S> {
    /// True for bodies that impulses move.
    #[inline]
    pub fn is_dynamic(&self, i: usize) -> bool {
        if self.roles.is_sure { self.roles.is_dynamic[i] } else { self.data[i].is_dynamic() }
    }
    /// True where no body is known to be damped.
    pub(crate) fn may_be_damped(&self) -> bool {
        !self.roles.is_sure || self.roles.are_damped
    }
    /// Indices of the bodies that impulses move, ascending.
    pub fn dynamic(&self) -> impl Iterator<Item = usize> + '_ {
        self.roles.dynamic.iter().map(|i| *i as usize)
    }
    /// Indices of the bodies that impulses move and that do not sleep, ascending.
    pub fn awake(&self) -> impl Iterator<Item = usize> + '_ {
        self.roles.movers.iter().map(|i| *i as usize).filter(|i| self.is_dynamic(*i))
    }
    /// Indices of all bodies but fixed ones and those that sleep, ascending.
    pub fn movers(&self) -> &[u32] {
        &self.roles.movers
    }
    /// The motion of all bodies, what does not change in a step, and who moves, to be written and read at once.
    pub(crate) fn in_motion(&mut self) -> (&mut Motion<S>, &[BodyData<S>], &[u32]) {
        (&mut self.motion, &self.data, &self.roles.movers)
    }
    /// Indices of the bodies that sleep, ascending.
    pub fn asleep(&self) -> &[u32] {
        &self.roles.asleep
    }
    /// True for bodies that sleep.
    pub fn is_asleep(&self, i: usize) -> bool {
        self.roles.sleeps.get(i) == Some(&true)
    }
    /// A number that changes with the set of bodies that sleep.
    pub(crate) fn sleep_number(&self) -> u64 {
        self.roles.sleep_number
    }
    /// Says who sleeps, ascending; they must rest.
    pub(crate) fn set_asleep(&mut self, asleep: Vec<u32>) {
        let roles = &mut self.roles;
        if asleep == roles.asleep {
            return;
        }
        roles.sleep_number += 1;
        roles.sleeps.resize(self.data.len(), false);
        roles.asleep.iter().for_each(|i| roles.sleeps[*i as usize] = false);
        asleep.iter().for_each(|i| roles.sleeps[*i as usize] = true);
        roles.asleep = asleep;
        let Roles { not_fixed, movers, sleeps, asleep, .. } = roles;
        movers.clear();
        movers.extend(not_fixed.iter().filter(|i| !sleeps[**i as usize]));
        self.asleep_moment = asleep.iter().fold(S::Vector::ZERO, |sum, i| {
            sum + self.motion.position[*i as usize] * self.data[*i as usize].mass_properties.mass
        });
    }
    /// Mass times place of all bodies that sleep, summed \[kg m\]; `None` where none does, or somebody may have written to
    /// them.
    pub(crate) fn asleep_moment(&self) -> Option<S::Vector> {
        (self.roles.is_sure && !self.roles.asleep.is_empty()).then_some(self.asleep_moment)
    }
    /// Index of the body with a serial.
    pub(crate) fn with_serial(&self, serial: u64) -> Option<usize> {
        self.data.binary_search_by_key(&serial, |d| d.serial).ok()
    }
    /// The number of what the fixed bodies are like: where it is the same, they are. `None` where somebody may have
    /// written to them.
    pub(crate) fn standing(&self) -> Option<u64> {
        self.roles.is_sure.then_some(self.roles.number)
    }
    /// Says that the fixed bodies are as they were, or gives them another number.
    pub(crate) fn trust(&mut self, as_before: bool) {
        self.roles.is_sure = true;
        self.roles.number += u64::from(!as_before);
    }
    /// Somebody may have written to the fixed bodies.
    pub(crate) fn distrust(&mut self) {
        self.roles.is_sure = false;
    }
    /// Finds anew who moves.
    pub(crate) fn find_roles(&mut self) {
        let sleep_number = self.roles.sleep_number + u64::from(!self.roles.asleep.is_empty());
        self.roles = Roles { sleep_number, ..Roles::of(&self.data, self.roles.number) };
    }
    /// True where the fixed bodies have the same numbers in another motion.
    pub(crate) fn stand_as_in(&self, other: &Motion<S>) -> bool {
        other.position.len() == self.len()
            && (0..self.len()).all(|i| self.data[i].kind != BodyKind::Fixed || self.motion.is_as_in(other, i))
    }
}
