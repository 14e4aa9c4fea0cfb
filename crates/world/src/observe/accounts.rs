//! What each body was given in a step, by cause: energy, momentum, and angular momentum about the world's origin.
//! The kick identity holds body by body: with the configuration fixed an impulse p at a point gives
//!   dT = p.(v- + v+)/2,  dP = p,  dL = x x p
//! to a, with v of its own point, and the same with -p to b, so that accounts of all bodies add up to the world's ledger
//! (theory section 6.3). Lines of drift and of projection are differences of the bodies' states, never remainders of
//! other lines. Kept on demand: without it nothing here costs anything.

use crate::bodies::Bodies;
use crate::force::Wrench;
use crate::integrate::Step;
use crate::observe::ledger::Ledger;
use carom_geometry::Geometry;
use carom_math::{Column, Inertia, Space};
use carom_solver::{Contact, ContactProblem, Impulses, Twist};
use serde::{Deserialize, Serialize};

/// Lines of a ledger of momentum \[kg m/s\], or of angular momentum about the world's origin \[kg m^2/s\].
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(bound = "")]
pub struct MomentumLedger<V: Column> {
    /// Gravity.
    pub gravity: V,
    /// Applied forces, torques and force fields.
    pub applied: V,
    /// Damping.
    pub damping: V,
    /// Persistent contacts: what bodies outside, obstacles among them, gave; pairs of bodies inside cancel.
    pub contact: V,
    /// Impacts, rest cuts included.
    pub impact: V,
    /// Contacts of steps with too many events, taken at once.
    pub fallback: V,
    /// Reactions of joints.
    pub constraint: V,
    /// Position correction: it moves bodies with the momenta that they have.
    pub projection: V,
    /// The integrator: what free motion gained or lost.
    pub integrator: V,
    /// Bodies that fell asleep: the obstacles under them have what they had.
    #[serde(default)]
    pub sleep: V,
    /// After - before - sum of the lines.
    pub closure: V,
}

impl<V: Column> MomentumLedger<V> {
    /// Names of the lines, in order, as users have them.
    pub const NAMES: [&'static str; 11] = [
        "gravity",
        "applied",
        "damping",
        "contact",
        "impact",
        "fallback",
        "constraint",
        "projection",
        "integrator",
        "sleep",
        "closure",
    ];
    /// The lines in the order of `NAMES`.
    pub fn lines(&self) -> [V; 11] {
        [
            self.gravity,
            self.applied,
            self.damping,
            self.contact,
            self.impact,
            self.fallback,
            self.constraint,
            self.projection,
            self.integrator,
            self.sleep,
            self.closure,
        ]
    }
    /// Sum of the lines but the closure.
    pub fn sum(&self) -> V {
        self.lines()[..10].iter().fold(V::ZERO, |sum, line| sum + *line)
    }
    /// Adds another step's, or another body's, lines.
    pub fn add(&mut self, o: &Self) {
        self.gravity += o.gravity;
        self.applied += o.applied;
        self.damping += o.damping;
        self.contact += o.contact;
        self.impact += o.impact;
        self.fallback += o.fallback;
        self.constraint += o.constraint;
        self.projection += o.projection;
        self.integrator += o.integrator;
        self.sleep += o.sleep;
        self.closure += o.closure;
    }
}

/// What one body was given.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(bound = "")]
pub struct Account<S: Space> {
    /// Energy \[J\].
    pub energy: Ledger,
    /// Momentum \[kg m/s\].
    pub momentum: MomentumLedger<S::Vector>,
    /// Angular momentum about the world's origin \[kg m^2/s\].
    pub angular_momentum: MomentumLedger<S::Spin>,
}

impl<S: Space> Account<S> {
    /// Adds what was given later, or to another body.
    pub fn add(&mut self, o: &Self) {
        self.energy.add(&o.energy);
        self.momentum.add(&o.momentum);
        self.angular_momentum.add(&o.angular_momentum);
    }
}

/// On which lines a contact's impulses go.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Cause {
    /// A persistent contact.
    Contact,
    /// An impact.
    Impact,
    /// An approach too slow to bounce.
    RestCut,
    /// A contact of a rest of a step that is taken at once.
    Fallback,
}

/// What moved the bodies apart from kicks.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Motive {
    /// Free motion.
    Integrator,
    /// Position correction.
    Projection,
    /// Damping.
    Damping,
    /// Falling asleep.
    Sleep,
}

/// A body's state, as far as its account needs it.
#[derive(Clone, Copy, Debug)]
pub struct Mark<S: Space> {
    energy: f64,
    position: S::Vector,
    momentum: S::Vector,
    spin_momentum: S::Spin,
}

impl<S: Geometry> Mark<S> {
    /// The state of a body, its energy with the potential one under a gravity \[m/s^2\].
    pub fn of(bodies: &Bodies<S>, i: usize, gravity: S::Vector) -> Self {
        let position = bodies.motion.position[i];
        let potential = bodies.data[i].mass_properties.mass * gravity.dot(position);
        Mark {
            energy: bodies.translational_energy(i) + bodies.rotational_energy(i) - potential,
            position,
            momentum: bodies.momentum(i),
            spin_momentum: bodies.spin_momentum(i),
        }
    }
}

/// How a body drifts through a flow.
#[derive(Clone, Copy, Debug)]
pub struct Drift<'a, S: Space> {
    /// Where it began \[m\].
    pub origin: S::Vector,
    /// Where its velocities lead from there \[m\].
    pub way: S::Vector,
    /// Where its kick acted \[m\].
    pub kicked: S::Vector,
    /// Where it came \[m\].
    pub place: S::Vector,
    /// Velocities before the kick.
    pub before: &'a Twist<S>,
    /// Velocities after it.
    pub after: &'a Twist<S>,
}

/// The accounts of a set of bodies; none where they are not kept.
#[derive(Clone, Debug, PartialEq)]
pub struct Accounts<S: Space> {
    /// One for each body, in their order; empty where they are not kept.
    pub of_bodies: Vec<Account<S>>,
}

impl<S: Space> Default for Accounts<S> {
    fn default() -> Self {
        Accounts { of_bodies: Vec::new() }
    }
}

impl<S: Geometry> Accounts<S> {
    /// Accounts of so many bodies with nothing on them, where they are kept.
    pub fn new(bodies: usize, kept: bool) -> Self {
        Accounts { of_bodies: vec![Account::default(); if kept { bodies } else { 0 }] }
    }
    /// Forgets what is on them.
    pub fn clear(&mut self) {
        self.of_bodies.fill(Account::default());
    }
    /// True where they are kept.
    pub fn are_kept(&self) -> bool {
        !self.of_bodies.is_empty()
    }
    /// Adds those of a set, whose bodies `index` gives the indices of.
    pub fn add(&mut self, other: &Accounts<S>, index: impl Fn(usize) -> usize) {
        if self.are_kept() {
            for (k, account) in other.of_bodies.iter().enumerate() {
                self.of_bodies[index(k)].add(account);
            }
        }
    }

    /// States of all bodies, to be compared by `moved`; none where accounts are not kept.
    pub fn marks(&self, bodies: &Bodies<S>, gravity: S::Vector) -> Vec<Mark<S>> {
        (0..self.of_bodies.len()).map(|i| Mark::of(bodies, i, gravity)).collect()
    }

    /// Books what all movable bodies gained since they were marked.
    pub fn moved(&mut self, marks: &[Mark<S>], bodies: &Bodies<S>, gravity: S::Vector, motive: Motive) {
        for (i, mark) in marks.iter().enumerate() {
            if bodies.is_dynamic(i) {
                self.change(i, mark, &Mark::of(bodies, i, gravity), motive);
            }
        }
    }

    /// Books what one body gained between two states: x1 x p1 - x0 x p0 = dx x pbar + xbar x dp.
    pub fn change(&mut self, i: usize, before: &Mark<S>, after: &Mark<S>, motive: Motive) {
        let dp = after.momentum - before.momentum;
        let pbar = (after.momentum + before.momentum) * 0.5;
        let middle = (after.position + before.position) * 0.5;
        let turned = S::moment(after.position - before.position, pbar) + S::moment(middle, dp);
        let account = &mut self.of_bodies[i];
        let energy = after.energy - before.energy;
        let spin = turned + (after.spin_momentum - before.spin_momentum);
        let (e, p, l) = (&mut account.energy, &mut account.momentum, &mut account.angular_momentum);
        let (e, p, l) = match motive {
            Motive::Integrator => (&mut e.integrator, &mut p.integrator, &mut l.integrator),
            Motive::Projection => (&mut e.projection, &mut p.projection, &mut l.projection),
            Motive::Damping => (&mut e.damping, &mut p.damping, &mut l.damping),
            Motive::Sleep => (&mut e.sleep, &mut p.sleep, &mut l.sleep),
        };
        *e += energy;
        *p += dp;
        *l += spin;
    }

    /// Books what a drift does to a body of a mass \[kg\] beyond the work and the moment of its kick, which acted half-way
    /// to rounding.
    pub fn drift(&mut self, i: usize, mass: f64, gravity: S::Vector, drift: &Drift<S>) {
        let Drift { origin, way, kicked, place, before, after } = *drift;
        let went = place - origin;
        let account = &mut self.of_bodies[i];
        account.energy.integrator += mass * gravity.dot(way - went);
        let (mean, change) = ((before.linear + after.linear) * 0.5, after.linear - before.linear);
        let off = origin + went * 0.5 - kicked;
        account.angular_momentum.integrator += S::moment(went, mean * mass) + S::moment(off, change * mass);
    }

    /// Books gravity and loads over a time \[s\], acting where the bodies are, by two sets of velocities; what sleeps is
    /// held.
    pub fn loads(
        &mut self,
        bodies: &Bodies<S>,
        (before, after): (&[Twist<S>], &[Twist<S>]),
        time: f64,
        gravity: S::Vector,
        wrenches: &[Wrench<S>],
    ) {
        let is_awake = |i: usize| bodies.is_dynamic(i) && !bodies.is_asleep(i);
        for (i, account) in self.of_bodies.iter_mut().enumerate().filter(|(i, _)| is_awake(*i)) {
            let (d, w, x) = (&bodies.data[i], &wrenches[i], bodies.motion.position[i]);
            let way = (before[i].linear + after[i].linear) * (0.5 * time);
            let weight = gravity * (d.mass_properties.mass * time);
            let force = w.force * time;
            account.energy.gravity += d.mass_properties.mass * gravity.dot(way);
            account.energy.applied += w.force.dot(way);
            account.momentum.gravity += weight;
            account.momentum.applied += force;
            account.angular_momentum.gravity += S::moment(x, weight);
            account.angular_momentum.applied += S::moment(x, force);
            if d.inverse_inertia != S::Inertia::ZERO {
                let turn = (before[i].angular + after[i].angular) * (0.5 * time);
                account.energy.applied += w.torque.dot(turn);
                account.angular_momentum.applied += w.torque * time;
            }
        }
    }

    /// Moves the loads of a drift that has them inside it from the integrator's lines to their own: works by body of
    /// gravity and loads \[J\], none where it has no loads; they count as acting half-way from `origin`.
    pub fn loads_in_drift(
        &mut self,
        bodies: &Bodies<S>,
        origin: &[S::Vector],
        works: &[(f64, f64)],
        step: &Step<S>,
        wrenches: &[Wrench<S>],
    ) {
        for (i, account) in self.of_bodies.iter_mut().enumerate().filter(|(i, _)| bodies.is_dynamic(*i)) {
            let Some((gravity, applied)) = works.get(i) else { return };
            let x = (origin[i] + bodies.motion.position[i]) * 0.5;
            let weight = step.gravity * (bodies.data[i].mass_properties.mass * step.dt);
            let force = wrenches[i].force * step.dt;
            let turns = bodies.data[i].inverse_inertia != S::Inertia::ZERO;
            let torque = if turns { wrenches[i].torque * step.dt } else { S::Spin::ZERO };
            let (e, p, l) = (&mut account.energy, &mut account.momentum, &mut account.angular_momentum);
            let (by_weight, by_force) = (S::moment(x, weight), S::moment(x, force) + torque);
            e.gravity += gravity;
            e.applied += applied;
            e.integrator -= applied;
            p.gravity += weight;
            p.applied += force;
            p.integrator -= weight + force;
            l.gravity += by_weight;
            l.applied += by_force;
            l.integrator -= by_weight + by_force;
        }
    }

    /// Books the impulses of a problem, acting where the bodies are, by the velocities before and after them;
    /// `cause` tells why each contact acted.
    pub fn kick(
        &mut self,
        bodies: &Bodies<S>,
        problem: &ContactProblem<S>,
        impulses: &Impulses<S>,
        velocities: (&[Twist<S>], &[Twist<S>]),
        cause: impl Fn(usize) -> Cause,
    ) {
        if !self.are_kept() {
            return;
        }
        let mut kick = Kick { accounts: self, bodies, velocities };
        for (k, (c, g)) in problem.contacts.iter().zip(&impulses.contacts).enumerate() {
            let normal = c.normal * g.normal;
            kick.contact(c, normal, c.to_world(g) - normal, cause(k));
        }
        for (r, m) in problem.resistances.iter().zip(&impulses.moments) {
            let c = &problem.contacts[r.contact];
            kick.moment(c, c.moment_to_world(*m), cause(r.contact));
        }
        for (row, &impulse) in problem.rows.iter().zip(&impulses.rows) {
            kick.row((row.a, &row.on_a), (row.b, &row.on_b), impulse);
            kick.row((row.b, &row.on_b), (row.a, &row.on_a), impulse);
        }
    }
}

/// Impulses at work.
struct Kick<'a, S: Geometry> {
    accounts: &'a mut Accounts<S>,
    bodies: &'a Bodies<S>,
    velocities: (&'a [Twist<S>], &'a [Twist<S>]),
}

impl<S: Geometry> Kick<'_, S> {
    /// Mean velocity of a body's point.
    fn mean(&self, i: usize, arm: S::Vector) -> S::Vector {
        (self.velocities.0[i].at(arm) + self.velocities.1[i].at(arm)) * 0.5
    }
    /// Velocity after the kick of a point of an obstacle; of movable bodies zero: they pay for themselves.
    fn driven(&self, i: usize, arm: S::Vector) -> S::Vector {
        if self.bodies.is_dynamic(i) { S::Vector::ZERO } else { self.velocities.1[i].at(arm) }
    }

    fn contact(&mut self, c: &Contact<S>, normal: S::Vector, tangent: S::Vector, cause: Cause) {
        let sides = [((c.a, c.arm_a), (c.b, c.arm_b), 1.0), ((c.b, c.arm_b), (c.a, c.arm_a), -1.0)];
        for ((i, arm), (other, other_arm), sign) in sides {
            if !self.bodies.is_dynamic(i) {
                continue;
            }
            let (n, t) = (normal * sign, tangent * sign);
            let driven = self.driven(other, other_arm);
            let mean = self.mean(i, arm) - driven;
            let x = self.bodies.motion.position[i];
            let account = &mut self.accounts.of_bodies[i];
            book_work(&mut account.energy, cause, n.dot(mean), t.dot(mean));
            account.energy.driven += (n + t).dot(driven);
            *line(&mut account.momentum, cause) += n + t;
            *line(&mut account.angular_momentum, cause) += S::moment(x, n + t) + S::moment(arm, n + t);
        }
    }

    /// A moment on a, and its opposite on b.
    fn moment(&mut self, c: &Contact<S>, moment: S::Spin, cause: Cause) {
        for (i, other, sign) in [(c.a, c.b, 1.0), (c.b, c.a, -1.0)] {
            if !self.bodies.is_dynamic(i) {
                continue;
            }
            let m = moment * sign;
            let (before, after) = self.velocities;
            let driven = if self.bodies.is_dynamic(other) { S::Spin::ZERO } else { after[other].angular };
            let mean = (before[i].angular + after[i].angular) * 0.5 - driven;
            let account = &mut self.accounts.of_bodies[i];
            book_work(&mut account.energy, cause, 0.0, m.dot(mean));
            account.energy.driven += m.dot(driven);
            *line(&mut account.angular_momentum, cause) += m;
        }
    }

    /// A general row's impulse on one body; what a moving obstacle at its other end pays is driven.
    fn row(&mut self, (i, on): (usize, &Twist<S>), (other, on_other): (usize, &Twist<S>), impulse: f64) {
        if !self.bodies.is_dynamic(i) {
            return;
        }
        let (before, after) = self.velocities;
        let own = 0.5 * impulse * (on.dot(&before[i]) + on.dot(&after[i]));
        let paid = if self.bodies.is_dynamic(other) { 0.0 } else { -impulse * on_other.dot(&after[other]) };
        let x = self.bodies.motion.position[i];
        let account = &mut self.accounts.of_bodies[i];
        account.energy.constraint += own - paid;
        account.energy.driven += paid;
        account.momentum.constraint += on.linear * impulse;
        account.angular_momentum.constraint += S::moment(x, on.linear * impulse) + on.angular * impulse;
    }
}

fn line<V: Column>(ledger: &mut MomentumLedger<V>, cause: Cause) -> &mut V {
    match cause {
        Cause::Contact => &mut ledger.contact,
        Cause::Impact | Cause::RestCut => &mut ledger.impact,
        Cause::Fallback => &mut ledger.fallback,
    }
}

fn book_work(ledger: &mut Ledger, cause: Cause, normal: f64, tangential: f64) {
    let (n, t) = match cause {
        Cause::Contact => (&mut ledger.contact_normal, &mut ledger.friction),
        Cause::Impact => (&mut ledger.impact_normal, &mut ledger.impact_friction),
        Cause::RestCut => (&mut ledger.rest_cut, &mut ledger.impact_friction),
        Cause::Fallback => {
            ledger.fallback += normal + tangential;
            return;
        }
    };
    *n += normal;
    *t += tangential;
}
