//! Who takes part: which of the contacts that touch strike, and which persist through the next flow. A contact
//! persists by its velocity, or because it pressed before: the sign of rounding decides nothing.

use super::aim::Aiming;
use super::limits::Limits;
use super::together::{Halt, Together, Tools};
use crate::impact::{Thresholds, Watched};
use crate::joint::add_all;
use crate::narrow_phase::{Touch, normal_velocity};
use crate::observe::accounts::Accounts;
use crate::settings::EnergyGuard;
use carom_geometry::Geometry;
use carom_solver::Partition;

/// Normal velocity over the rest speed above which a contact that did not press before is new \[1\].
const FRESH: f64 = 1e-3;

/// The contacts of a flow.
#[derive(Clone)]
pub struct Active<S: Geometry> {
    /// Their places at its start.
    pub touches: Vec<Touch<S>>,
    /// How fast the gap of each may close \[m/s\]: 0 for those that have arrived.
    pub closing: Vec<f64>,
    /// Their names, ascending.
    pub names: Vec<u64>,
    /// Names of those that do not count as pressed after it, so that the next impact may stop them.
    pub fresh: Vec<u64>,
}

impl<S: Geometry> Active<S> {
    /// No contacts.
    pub fn none() -> Self {
        Active { touches: Vec::new(), closing: Vec::new(), names: Vec::new(), fresh: Vec::new() }
    }
    /// Adds others, none of which is here.
    pub fn add(&mut self, others: Active<S>) {
        if self.touches.is_empty() {
            return *self = others;
        }
        self.touches.extend(others.touches);
        self.closing.extend(others.closing);
        self.fresh.extend(others.fresh);
        self.names.extend(others.names);
        self.names.sort_unstable();
    }
    /// The contacts between a part of a set's bodies, in the part's indices; both sets are given by their members.
    pub fn of(&self, members: &[usize], part: &[usize]) -> Active<S> {
        let slot = |i: usize| part.binary_search(&members[i]).ok();
        let mut mine = Active::none();
        for (t, closing) in self.touches.iter().zip(&self.closing) {
            if let (Some(a), Some(b)) = (slot(t.a), slot(t.b)) {
                mine.touches.push(Touch { a, b, ..*t });
                mine.closing.push(*closing);
                mine.names.push(t.id);
                mine.fresh.extend(self.fresh.iter().filter(|id| **id == t.id));
            }
        }
        mine.names.sort_unstable();
        mine
    }
}

/// True for a contact with this normal velocity \[m/s\] that does not count as pressed after the flow that it begins.
pub(super) fn is_fresh(u: f64, pressed: bool, rest_speed: f64, limits: &Limits) -> bool {
    !pressed && u.abs() > (FRESH * rest_speed).max(limits.still_speed)
}

impl<S: Geometry> Together<'_, S> {
    /// Stops or throws back what has arrived and approaches, and what touches it. True when there was an impact.
    pub fn strike(&mut self, touches: &[Touch<S>], tools: &mut Tools<S>) -> Result<bool, Halt> {
        let called: Vec<bool> = touches.iter().map(|t| self.strikes(t)).collect();
        if !called.contains(&true) {
            return Ok(false);
        }
        let mut islands = Partition::default();
        islands.reset(self.bodies.len());
        for t in touches {
            if self.bodies.is_dynamic(t.a) && self.bodies.is_dynamic(t.b) {
                islands.join(t.a, t.b);
            }
        }
        self.bodies.jointed().for_each(|(a, b)| islands.join(a, b));
        let mut hit = vec![false; self.bodies.len()];
        for (t, _) in touches.iter().zip(&called).filter(|(_, called)| **called) {
            hit[islands.root(self.mover(t))] = true;
        }
        let mut struck: Vec<Touch<S>> = Vec::new();
        for t in touches {
            if hit[islands.root(self.mover(t))] {
                struck.push(Touch { gap: 0.0, ..*t });
            }
        }
        self.resolve(&struck, tools)?;
        self.events.impacts += 1;
        Ok(true)
    }

    fn mover(&self, t: &Touch<S>) -> usize {
        if self.bodies.is_dynamic(t.a) { t.a } else { t.b }
    }

    /// True for a contact that has arrived and must not go on as it does.
    pub fn strikes(&self, t: &Touch<S>) -> bool {
        let u = normal_velocity(&self.bodies, t);
        let pressed = self.has_pressed(t.id);
        let due = self.due == Some((self.members[t.a], self.members[t.b]));
        (pressed || due || t.gap <= self.limits.arrived) && u < -self.limits.slowest(pressed)
    }

    fn resolve(&mut self, struck: &[Touch<S>], tools: &mut Tools<S>) -> Result<(), Halt> {
        let limits = &self.limits;
        let thresholds = Thresholds {
            rest_speed: limits.rest_speed,
            elastic_rest_speed: 0.0,
            still_speed: limits.still_speed,
            call_speed: limits.still_speed,
            touching: f64::MAX,
            dt: limits.dt,
            thorough: true,
        };
        tools.impacts.accounts = Accounts::new(self.bodies.len(), self.accounts.are_kept());
        let mut settings = self.settings.clone();
        settings.tolerance = limits.tolerance;
        let (enough, after) = (self.settings.tolerance, limits.aim);
        let mut aiming = Aiming { solver: &mut *tools.solver, enough, after };
        let mut watched = Watched { solver: &mut aiming, watch: &mut *tools.watch };
        let report = tools.impacts.resolve(
            &mut self.bodies,
            struck,
            &settings,
            &thresholds,
            &mut watched,
            &mut self.ledger,
        );
        self.accounts.add(&tools.impacts.accounts, |i| i);
        self.log.append(&tools.impacts.log, self.moment, |i| i);
        let mut came_to = tools.impacts.report();
        add_all(&mut self.joints, &tools.impacts.joints);
        came_to.gaining = came_to.gaining.map(|(a, b)| (self.members[a], self.members[b]));
        self.struck.add(&came_to);
        if let Some(gaining) = came_to.gaining.filter(|_| settings.energy_guard == EnergyGuard::Raise) {
            return Err(Halt::Gains(gaining, came_to.gain));
        }
        match report {
            Some(mut report) => {
                report.worst = report.worst.map(|(a, b)| (self.members[a], self.members[b]));
                self.keep(1, report, "impact")
            }
            None => Ok(()),
        }
    }

    /// The contacts that persist from here.
    pub fn persisting(&self, touches: &[Touch<S>]) -> Active<S> {
        let mut active = Active::none();
        active.names.reserve(touches.len());
        active.touches.reserve(touches.len());
        active.closing.reserve(touches.len());
        let still = self.limits.still_speed;
        for t in touches {
            let u = normal_velocity(&self.bodies, t);
            let rest = self.limits.rest_speed_of(t.restitution);
            let pressed = self.has_pressed(t.id);
            if u > rest.max(still) || u < -self.limits.slowest(pressed) {
                continue; // separates, or comes and has not arrived
            }
            if is_fresh(u, pressed, rest, self.limits) {
                active.fresh.push(t.id);
            }
            active.names.push(t.id);
            active.touches.push(*t);
            active.closing.push(0.0);
        }
        active.names.sort_unstable();
        active
    }
}
