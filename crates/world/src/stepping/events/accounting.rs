//! What bodies that are alone are given, where somebody asks for the books of bodies: the general way's, for each of them
//! with its obstacle as a set of its own.

use super::alone::{Held, Passage};
use super::leaving::turned_by;
use super::timeline::Timeline;
use crate::bodies::Bodies;
use crate::observe::accounts::{Accounts, Cause, Drift, Mark, Motive};
use carom_geometry::Geometry;
use carom_solver::{Contact, ContactProblem, Impulses, Twist};

impl<S: Geometry> Timeline<'_, '_, S> {
    /// Books what a body is given on its passage; it is where that begins.
    pub(super) fn account_alone(&mut self, i: usize, passage: &Passage<S>, held: Option<&Held<S>>) {
        let Passage { before, after, end, half_turned, .. } = passage;
        let common = self.common;
        let (gravity, dt) = (common.settings.gravity, common.limits.dt);
        let members = held.map_or(vec![i], |held| vec![held.contact.a, held.contact.b]);
        let slot = usize::from(members[0] != i);
        let mut own = self.bodies.some(&members);
        let mut accounts = Accounts::new(members.len(), true);
        let turn = |own: &mut Bodies<S>, accounts: &mut Accounts<S>, rotation: S::Rotation| {
            let mark = Mark::of(own, slot, gravity);
            own.motion.rotation[slot] = rotation;
            accounts.change(slot, &mark, &Mark::of(own, slot, gravity), Motive::Integrator);
        };
        turn(&mut own, &mut accounts, *half_turned);
        let mean = (before.linear + after.linear) * 0.5;
        let origin = own.motion.position[slot];
        let kicked = origin + mean * (0.5 * dt);
        own.motion.position[slot] = kicked;
        let twists = |moving: &Twist<S>| {
            let mut all = vec![Twist::default(); members.len()];
            all[slot] = *moving;
            all
        };
        let (begun, ended) = (twists(before), twists(after));
        let wrenches: Vec<_> = members.iter().map(|&k| common.wrenches[k]).collect();
        accounts.loads(&own, (&begun, &ended), dt, gravity, &wrenches);
        if let Some(held) = held {
            let mut problem = ContactProblem::new(Vec::new(), Vec::new());
            problem.contacts.push(Contact { a: 0, b: 1, ..held.contact });
            let mut impulses = Impulses::zero(&problem);
            impulses.contacts[0] = held.impulse;
            accounts.kick(&own, &problem, &impulses, (&begun, &ended), |_| Cause::Contact);
        }
        let drift = Drift { origin, way: mean * dt, kicked, place: *end, before, after };
        accounts.drift(slot, own.data[slot].mass_properties.mass, gravity, &drift);
        own.motion.position[slot] = *end;
        own.motion.set_twist(slot, after);
        turn(&mut own, &mut accounts, turned_by::<S>(half_turned, after.angular, 0.5 * dt));
        self.accounts.add(&accounts, |k| members[k]);
    }
}
