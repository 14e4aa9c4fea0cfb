//! Between bodies in f64 and their records in lanes. Free rotation is the world's integrator's: it is taken for the whole
//! step, its mean turns in the lanes, and what it adds to the spin comes at the end; lanes only carry what contacts
//! change. A velocity keeps the digits that f32 has not: it takes the lanes' change, not their value.

use super::SoftStep;
use super::face::NONE;
use crate::bodies::{Bodies, BodyData, MotionStretch};
use crate::force::Wrench;
use crate::integrate::{Step, is_unit, slow_rotation, turn_freely, turns_steadily};
use crate::observe::accounts::Motive;
use crate::observe::energy::{Energy, Momenta};
use crate::observe::ledger::Ledger;
use crate::settings::Settings;
use crate::stepping::CameTo;
use carom_geometry::Geometry;
use carom_math::{Column, Inertia, Pose, Rotation, Several, Workers};
use carom_solver::soft::{SoftBody, SoftChoice};
use carom_solver::{InverseMass, Twist};

/// Bodies that a worker takes at a time.
pub(super) const BODIES: usize = 128;

/// What is booked of a body that moved: first what all impulses of the step did, then how it ends the step.
#[derive(Clone, Copy, Default)]
pub(super) struct Booked<S: Geometry> {
    is_dynamic: bool,
    /// Nothing touched it: loads alone gave its velocities.
    flew: bool,
    /// Its numbers are those of a motion.
    is_sound: bool,
    /// Its energy, after the impulses and at the end.
    energy: Energy,
    /// Its momenta at the end.
    momenta: Momenta<S>,
    /// Work of gravity \[J\].
    gravity: f64,
    /// Work of applied forces, and of applied torques \[J\].
    applied: [f64; 2],
}

/// A column in f32.
pub(super) fn narrow<C: Column, A: Several<f32>>(column: C) -> A {
    let mut out = A::all(0.0);
    for k in 0..C::LEN {
        out[k] = column[k] as f32;
    }
    out
}

/// An array in f64.
pub(super) fn widen<C: Column, A: Several<f32>>(array: &A) -> C {
    C::from_fn(|k| f64::from(array[k]))
}

impl<S: Geometry> SoftStep<S> {
    /// Gives tumbling bodies the mean spin of their free motion over the step.
    pub(super) fn turn_freely(
        &mut self,
        bodies: &mut Bodies<S>,
        settings: &Settings<S>,
        step: &Step<S>,
        ledger: &mut Ledger,
    ) {
        if S::SPIN > 1 {
            self.turn_tumbling(bodies, settings, step, ledger);
        }
        for i in bodies.movers().iter().map(|i| *i as usize) {
            self.start[i] = bodies.motion.twist(i);
        }
    }

    /// The same where bodies can tumble, which those of the plane do not.
    fn turn_tumbling(
        &mut self,
        bodies: &mut Bodies<S>,
        settings: &Settings<S>,
        step: &Step<S>,
        ledger: &mut Ledger,
    ) {
        let tumbles = |bodies: &Bodies<S>, i: usize| {
            bodies.motion.angular_velocity[i] != S::Spin::ZERO && !turns_steadily(bodies, i)
        };
        for i in bodies.movers().iter().map(|i| *i as usize) {
            self.after[i] = S::Spin::ZERO;
        }
        if !bodies.movers().iter().any(|i| tumbles(bodies, *i as usize)) {
            return;
        }
        let marks = self.accounts.marks(bodies, step.gravity);
        for k in 0..bodies.movers().len() {
            let i = bodies.movers()[k] as usize;
            if tumbles(bodies, i) {
                let before = bodies.rotational_energy(i);
                self.after[i] = mean_spin(bodies, settings, i, step.dt);
                ledger.integrator += bodies.rotational_energy(i) - before;
            }
        }
        self.accounts.moved(&marks, bodies, step.gravity, Motive::Integrator);
    }

    /// Numbers the records of all bodies that touch something, in the patches too.
    pub(super) fn gather(&mut self, bodies: &Bodies<S>, choice: &SoftChoice, workers: &Workers) {
        self.number(bodies);
        let record_of = &self.record_of;
        let record = |i: u32| record_of[i as usize];
        workers.each(&mut self.patches.pairs, BODIES, |_, pairs| {
            for (a, b) in pairs {
                (*a, *b) = (record(*a), record(*b));
            }
        });
        self.put_in_groups(choice);
    }

    /// Fills the records.
    pub(super) fn fill(
        &mut self,
        bodies: &Bodies<S>,
        step: &Step<S>,
        choice: &SoftChoice,
        workers: &Workers,
    ) {
        let h = step.dt / choice.substeps as f64;
        let (body_of, start, loads) = (&self.body_of, &self.start, &self.loads);
        let body = |record: usize| {
            let i = body_of[record] as usize;
            body_of_lanes(bodies, (i, &start[i], &loads[i]), step, h)
        };
        self.solver.fill(body_of.len() - 1, body, workers);
    }

    /// Numbers the records of all bodies that touch something.
    fn number(&mut self, bodies: &Bodies<S>) {
        for i in bodies.movers() {
            self.record_of[*i as usize] = NONE;
        }
        self.body_of.clear();
        self.body_of.push(NONE);
        self.obstacles = 1;
        // one record serves all obstacles at rest; its name in reports is the last one's
        let mut resting = None;
        for (a, b) in &self.patches.pairs {
            for i in [*a as usize, *b as usize] {
                self.record_of[i] = 0;
                if !bodies.is_dynamic(i) && self.start[i] == Twist::default() {
                    resting = resting.max(Some(i as u32));
                }
            }
        }
        self.body_of[0] = resting.unwrap_or(NONE);
        let movers = |dynamic: bool| {
            let movers = bodies.movers().iter().map(|i| *i as usize);
            movers.filter(move |i| bodies.is_dynamic(*i) == dynamic)
        };
        // obstacles first: their records are not written
        for i in movers(false).chain(movers(true)) {
            let dynamic = bodies.is_dynamic(i);
            if self.record_of[i] == NONE || (!dynamic && self.start[i] == Twist::default()) {
                continue;
            }
            self.record_of[i] = self.body_of.len() as u32;
            self.body_of.push(i as u32);
            if !dynamic {
                self.obstacles = self.body_of.len() as u32;
            }
        }
    }

    /// Bodies of a group of islands have their records side by side.
    fn put_in_groups(&mut self, choice: &SoftChoice) {
        let asked = (self.body_of.len(), self.obstacles);
        let places = self.solver.begin(&mut self.patches.pairs, asked, choice);
        if places.is_empty() {
            return;
        }
        self.given_order.clone_from(&self.body_of);
        // obstacles keep their records
        let obstacles = self.obstacles as usize;
        for (place, i) in places.iter().zip(&self.given_order).skip(obstacles) {
            self.body_of[*place as usize] = *i;
            self.record_of[*i as usize] = *place;
        }
    }

    /// Velocities of all bodies after all impulses of the step; books the work of loads, and tells the energy.
    pub(super) fn kick_all(
        &mut self,
        bodies: &mut Bodies<S>,
        step: &Step<S>,
        (ledger, substeps): (&mut Ledger, usize),
        workers: &Workers,
    ) -> Energy {
        let mut booked = std::mem::take(&mut self.booked);
        booked.resize(bodies.movers().len(), Booked::default());
        let (motion, data, movers) = bodies.in_motion();
        let this = &*self;
        workers.along((motion.stretch(), movers, &mut booked), BODIES, |motion, i, to| {
            *to = this.kick_one(motion, (i as usize, &data[i as usize]), step, substeps);
        });
        let mut energy = Energy::default();
        for one in booked.iter().filter(|one| one.is_dynamic) {
            ledger.gravity += one.gravity;
            one.applied.iter().for_each(|work| ledger.applied += work);
            energy.add(one.energy);
        }
        energy.add_asleep(bodies, step.gravity);
        self.booked = booked;
        energy
    }

    /// Gives a body its velocities after all impulses of the step; obstacles keep theirs.
    fn kick_one(
        &self,
        motion: &mut MotionStretch<'_, S>,
        (i, data): (usize, &BodyData<S>),
        step: &Step<S>,
        substeps: usize,
    ) -> Booked<S> {
        if !data.is_dynamic() {
            return Booked { flew: true, ..Booked::default() };
        }
        let (record, pose) = (self.record_of[i], motion.pose(i));
        let flew = record == NONE || self.solver.flew(record, substeps);
        let after = if flew {
            self.flight(i, &data.inverse_mass_at(&pose.rotation), step)
        } else {
            self.swept(i, record)
        };
        motion.set_twist(i, &after);
        let before = &self.start[i];
        let mean = (before.linear + after.linear) * (0.5 * step.dt);
        let turn = (before.angular + after.angular) * (0.5 * step.dt);
        let turns = data.inverse_inertia != S::Inertia::ZERO;
        let turning = if turns { self.loads[i].torque.dot(turn) } else { 0.0 };
        Booked {
            is_dynamic: true,
            flew,
            energy: Energy::of_motion(data, (&pose, &after), step.gravity),
            gravity: data.mass_properties.mass * step.gravity.dot(mean),
            applied: [self.loads[i].force.dot(mean), turning],
            ..Booked::default()
        }
    }

    /// Velocity of a body after a step's loads alone.
    fn flight(&self, i: usize, inverse: &InverseMass<S>, step: &Step<S>) -> Twist<S> {
        let (start, wrench) = (&self.start[i], &self.loads[i]);
        let linear = start.linear + (step.gravity + wrench.force * inverse.linear) * step.dt;
        Twist { linear, angular: start.angular + inverse.angular.apply(wrench.torque) * step.dt }
    }

    /// Velocity of a body after what the lanes gave it.
    fn swept(&self, i: usize, record: u32) -> Twist<S> {
        let (start, (velocity, spin)) = (&self.start[i], self.solver.motion(record));
        let linear = S::Vector::from_fn(|k| {
            start.linear[k] + (f64::from(velocity[k]) - f64::from(start.linear[k] as f32))
        });
        let angular = S::Spin::from_fn(|k| {
            start.angular[k] + (f64::from(spin[k]) - f64::from(start.angular[k] as f32))
        });
        Twist { linear, angular }
    }

    /// Moves all poses to the step's end, and tells the energy there, and what bodies came to where that is sound.
    pub(super) fn displace(
        &mut self,
        bodies: &mut Bodies<S>,
        step: &Step<S>,
        workers: &Workers,
    ) -> (Energy, Option<CameTo<S>>) {
        let mut booked = std::mem::take(&mut self.booked);
        let (motion, data, movers) = bodies.in_motion();
        let this = &*self;
        workers.along((motion.stretch(), movers, &mut booked), BODIES, |motion, i, to| {
            this.end(motion, (i as usize, &data[i as usize]), step, to);
        });
        let (mut energy, mut momenta) = (Energy::default(), Momenta::default());
        for one in booked.iter().filter(|one| one.is_dynamic) {
            energy.add(one.energy);
            momenta.add(&one.momenta);
        }
        energy.add_asleep(bodies, step.gravity);
        let are_sound = booked.iter().all(|one| one.is_sound);
        self.booked = booked;
        (energy, are_sound.then_some(CameTo { energy, momenta }))
    }

    /// Moves a body to where it is at the step's end, with a rotation of unit length.
    fn end(
        &self,
        motion: &mut MotionStretch<'_, S>,
        (i, data): (usize, &BodyData<S>),
        step: &Step<S>,
        booked: &mut Booked<S>,
    ) {
        let Twist { linear, angular } = motion.twist(i);
        let mut pose = self.moved(&motion.pose(i), (i, &Twist { linear, angular }), step, booked.flew);
        if !is_unit::<S>(&pose.rotation) {
            pose.rotation = pose.rotation.renormalized().unwrap_or(pose.rotation);
        }
        let twist = Twist { linear, angular: angular + self.after[i] };
        motion.set_pose(i, &pose);
        motion.set_twist(i, &twist);
        let at = (&pose, &twist);
        booked.is_sound = data.is_far_from_infinite(at) && is_unit::<S>(&pose.rotation);
        if booked.is_dynamic {
            booked.energy = Energy::of_motion(data, at, step.gravity);
            booked.momenta = Momenta::of_motion(data, at);
        }
    }

    /// Pose of a body after the motion of a step that ends with these velocities.
    fn moved(&self, from: &Pose<S>, (i, end): (usize, &Twist<S>), step: &Step<S>, flew: bool) -> Pose<S> {
        let (start, Pose { mut position, mut rotation }) = (self.start[i], *from);
        let record = self.record_of[i];
        if flew {
            // free flight, and obstacles, which nothing touches: the mean velocity is exact
            position += (start.linear + end.linear) * (0.5 * step.dt);
            let angle = (start.angular + end.angular) * (0.5 * step.dt);
            if angle != S::Spin::ZERO {
                rotation = rotation.then(&S::Rotation::about(angle));
            }
        } else {
            let (by, turn) = self.solver.moved(record);
            let rest = S::Vector::from_fn(|k| start.linear[k] - f64::from(start.linear[k] as f32));
            position += widen::<S::Vector, _>(&by) + rest * step.dt;
            let mut numbers = [0.0; 4];
            for (to, x) in numbers.iter_mut().zip(turn.slice()) {
                *to = f64::from(*x);
            }
            let turn = S::Rotation::from_slice(&numbers[..S::Rotation::LEN]);
            rotation = turn.map_or(rotation, |turn| rotation.then(&turn));
        }
        Pose { position, rotation }
    }
}

/// A body as the lanes see it, which begins the step so, with its loads over a substep of length `h`.
#[inline]
fn body_of_lanes<S: Geometry>(
    bodies: &Bodies<S>,
    (i, start, wrench): (usize, &Twist<S>, &Wrench<S>),
    step: &Step<S>,
    h: f64,
) -> SoftBody<S> {
    let inverse = bodies.inverse_mass(i);
    let (mut load, mut spin_load) = (S::Vector::ZERO, S::Spin::ZERO);
    if bodies.is_dynamic(i) {
        load = (step.gravity + wrench.force * inverse.linear) * h;
        spin_load = inverse.angular.apply(wrench.torque) * h;
    }
    SoftBody {
        velocity: narrow(start.linear),
        spin: narrow(start.angular),
        load: narrow(load),
        spin_load: narrow(spin_load),
        inverse_mass: inverse.linear as f32,
        inverse_inertia: entries::<S>(&inverse.angular),
    }
}

/// Sets a body's spin to the mean of its free motion over a step and returns what the free motion adds at the end.
fn mean_spin<S: Geometry>(bodies: &mut Bodies<S>, settings: &Settings<S>, i: usize, dt: f64) -> S::Spin {
    if let Some((mean, end)) = slow_rotation(bodies, i, dt) {
        bodies.motion.angular_velocity[i] = mean;
        return end - mean;
    }
    let (rotation, spin) = (bodies.motion.rotation[i], bodies.motion.angular_velocity[i]);
    turn_freely(settings.integrator, bodies, i, dt);
    let end = bodies.motion.angular_velocity[i];
    // more than half a turn has no unique mean
    let mean = if spin.norm() * dt < 1.0 {
        rotation.inverse().then(&bodies.motion.rotation[i]).vector() * (1.0 / dt)
    } else {
        spin
    };
    bodies.motion.rotation[i] = rotation;
    bodies.motion.angular_velocity[i] = mean;
    end - mean
}

/// Entries of an inverse inertia.
fn entries<S: Geometry>(inertia: &S::Inertia) -> S::Inertias<f32> {
    let unit = |j: usize| S::Spin::from_fn(|k| if k == j { 1.0 } else { 0.0 });
    let column = |j: usize| inertia.apply(unit(j));
    let mut out = S::Inertias::all(column(0)[0] as f32);
    if S::SPIN > 1 {
        let (x, y, z) = (column(0), column(1), column(2));
        for (k, value) in [x[0], y[1], z[2], x[1], x[2], y[2]].into_iter().enumerate() {
            out[k] = value as f32;
        }
    }
    out
}
