//! How far surfaces can come within the step ahead: what contacts are looked for. Speeds are those that bodies have, with
//! what gravity and applied loads add in the step; impacts may double them.

use crate::bodies::Bodies;
use crate::force::Wrench;
use crate::settings::{Scheme, Settings};
use crate::stepping::soft_step::AGAIN;
use carom_geometry::Geometry;
use carom_math::{Column, Inertia};

/// The step ahead.
pub struct Ahead<'a, S: Geometry> {
    /// The bodies at its start.
    pub bodies: &'a Bodies<S>,
    /// The settings.
    pub settings: &'a Settings<S>,
    /// Its length \[s\].
    pub dt: f64,
    /// What applied loads do to the surface of each body \[m/s^2\]; empty without loads.
    pub pulls: &'a [f64],
}

impl<S: Geometry> Clone for Ahead<'_, S> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<S: Geometry> Copy for Ahead<'_, S> {}

/// What a load does to the surface of a body \[m/s^2\]: |f|/m + |I^-1 t| arm.
pub fn pull<S: Geometry>(bodies: &Bodies<S>, i: usize, load: &Wrench<S>) -> f64 {
    if !bodies.is_dynamic(i) || *load == Wrench::default() {
        return 0.0;
    }
    let inverse = bodies.inverse_mass(i);
    let turning = inverse.angular.apply(load.torque).norm();
    let arm = if turning > 0.0 { bodies.data[i].reach_of_turning() } else { 0.0 };
    load.force.norm() * inverse.linear + turning * arm
}

impl<S: Geometry> Ahead<'_, S> {
    /// What loads add to the speed of a body's surface in the step \[m/s\].
    fn pulled(&self, i: usize) -> f64 {
        self.pulls.get(i).map_or(0.0, |pull| pull * self.dt)
    }

    /// What gravity and loads add to it \[m/s\].
    fn fall(&self, i: usize) -> f64 {
        let fall = if self.bodies.is_dynamic(i) { self.settings.gravity.norm() * self.dt } else { 0.0 };
        fall + self.pulled(i)
    }

    /// Largest speed of a body's surface in a step before impacts \[m/s\].
    pub fn speed(&self, i: usize) -> f64 {
        let (d, motion) = (&self.bodies.data[i], &self.bodies.motion);
        let linear = motion.velocity[i].norm();
        if !d.extent.is_finite() {
            return linear; // a wall, maybe a driven one; that it does not turn much is the user's matter
        }
        linear + d.reach_of_turning() * motion.angular_velocity[i].norm() + self.fall(i)
    }

    /// How far a body's surface can come in a step \[m\], at twice its speed for what impacts may make of it: its share
    /// of a pair's margin. At least 5e-4 of its size and at most half of it, so that a contact is never felt from further
    /// away than that; where contacts are used again while bodies hardly move, at least as far as they may move then.
    pub fn reach(&self, i: usize, speed: f64) -> f64 {
        if let Some(margin) = self.settings.contact_margin {
            return 0.5 * margin;
        }
        let extent = self.bodies.data[i].extent;
        if !self.bodies.is_dynamic(i) {
            return (speed * self.dt).min(extent); // no impact changes its speed
        }
        (2.0 * speed * self.dt).clamp(self.least_reach(i), extent)
    }

    /// The least that a body's surface is thought to come in a step \[m\]; 0 for what impulses do not move.
    pub fn least_reach(&self, i: usize) -> f64 {
        if !self.bodies.is_dynamic(i) {
            return 0.0;
        }
        let least = if self.settings.scheme == Scheme::SoftStep { AGAIN } else { 5e-4 };
        least * self.bodies.data[i].extent
    }

    /// The margin of a pair in a soft step \[m\]: how far two surfaces can come towards each other in it, at twice their speed
    /// of approach. What flies side by side hardly meets, however fast it is; in a drum that turns, what lies on its wall.
    /// Seen from the larger body every point of the smaller one moves at |v + w x r| + |dw| arm, with the velocities v and spins w
    /// of the larger one and dw of both against each other. What a hit of this step does to others is seen by the next one.
    pub fn approach(&self, (a, b): (usize, usize), closing: f64) -> f64 {
        let fall = self.fall(a) + self.fall(b);
        let least = self.least_reach(a) + self.least_reach(b);
        (2.0 * self.dt * (closing + fall)).max(least)
    }

    /// How fast surfaces of two bodies can come towards each other, as they move now \[m/s\]: |v + w x r| + |dw| arm of
    /// `approach`.
    #[inline]
    pub fn closing(&self, (a, b): (usize, usize)) -> f64 {
        let (data, motion) = (&self.bodies.data, &self.bodies.motion);
        let (small, large) = if data[a].extent <= data[b].extent { (a, b) } else { (b, a) };
        let (own, other) = (motion.twist(small), motion.twist(large));
        let passing = (own.linear - other.at(motion.position[small] - motion.position[large])).norm();
        passing + (own.angular - other.angular).norm() * data[small].reach_of_turning()
    }

    /// How far two surfaces may come towards each other in the step by what was not known in the one before: their motion,
    /// and loads \[m\].
    #[inline]
    pub fn coming(&self, (a, b): (usize, usize), closing: f64) -> f64 {
        self.dt * (closing + self.pulled(a) + self.pulled(b))
    }
}
