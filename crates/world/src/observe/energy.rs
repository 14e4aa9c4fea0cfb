//! Energies and momenta of all bodies that can move (theory chapter 1, items 9-10). Obstacles do not count.

use crate::bodies::{Bodies, BodyData};
use carom_geometry::Geometry;
use carom_math::{Column, Inertia, Pose, Rotation, Space};
use carom_solver::Twist;
use serde::{Deserialize, Serialize};

/// Energy in its parts \[J\].
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Energy {
    /// 1/2 m v^2.
    pub translational: f64,
    /// 1/2 w^T I w.
    pub rotational: f64,
    /// -m g.x, zero at the world's origin.
    pub potential: f64,
}

impl Energy {
    /// Sum over all bodies that can move, in order of index.
    pub fn of<S: Geometry>(bodies: &Bodies<S>, gravity: S::Vector) -> Self {
        if bodies.asleep_moment().is_none() {
            return Energy::sum(bodies, bodies.dynamic(), gravity);
        }
        let mut all = Energy::sum(bodies, bodies.awake(), gravity);
        all.add_asleep(bodies, gravity);
        all
    }
    /// Sum over some of them, given by their indices.
    pub fn of_some<S: Geometry>(bodies: &Bodies<S>, some: &[usize], gravity: S::Vector) -> Self {
        Energy::sum(bodies, some.iter().copied(), gravity)
    }
    fn sum<S: Geometry>(bodies: &Bodies<S>, some: impl Iterator<Item = usize>, gravity: S::Vector) -> Self {
        let mut e = Energy::default();
        some.for_each(|i| e.add(Energy::of_body(bodies, i, gravity)));
        e
    }
    #[inline]
    fn of_body<S: Geometry>(bodies: &Bodies<S>, i: usize, gravity: S::Vector) -> Self {
        Energy::of_motion(&bodies.data[i], (&bodies.motion.pose(i), &bodies.motion.twist(i)), gravity)
    }
    /// That of a body, if it moved so.
    #[inline]
    pub(crate) fn of_motion<S: Geometry>(
        data: &BodyData<S>,
        (pose, twist): (&Pose<S>, &Twist<S>),
        gravity: S::Vector,
    ) -> Self {
        let body = &data.mass_properties;
        let spin = pose.rotation.unrotate_spin(twist.angular);
        Energy {
            translational: 0.5 * (twist.linear * body.mass).dot(twist.linear),
            rotational: 0.5 * body.inertia.apply(spin).dot(spin),
            potential: -(body.mass * gravity.dot(pose.position)),
        }
    }
    /// What bodies that sleep add to the sum over the others: they have potential energy alone, and it stays.
    pub(crate) fn add_asleep<S: Geometry>(&mut self, bodies: &Bodies<S>, gravity: S::Vector) {
        if let Some(moment) = bodies.asleep_moment() {
            self.potential -= gravity.dot(moment);
        }
    }
    pub(crate) fn add(&mut self, other: Energy) {
        self.translational += other.translational;
        self.rotational += other.rotational;
        self.potential += other.potential;
    }
    /// Kinetic energy \[J\].
    pub fn kinetic(&self) -> f64 {
        self.translational + self.rotational
    }
    /// Kinetic and potential energy \[J\].
    pub fn total(&self) -> f64 {
        self.kinetic() + self.potential
    }
}

/// Momentum and angular momentum about the world's origin.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(bound = "")]
pub struct Momenta<S: Space> {
    /// Sum of m v \[kg m/s\].
    pub linear: S::Vector,
    /// Sum of x x p + I w \[kg m^2/s\].
    pub angular: S::Spin,
}

impl<S: Geometry> Momenta<S> {
    /// Sum over all bodies that can move.
    pub fn of(bodies: &Bodies<S>) -> Self {
        match bodies.asleep_moment() {
            None => Momenta::sum(bodies, bodies.dynamic()),
            Some(_) => Momenta::sum(bodies, bodies.awake()),
        }
    }
    /// Sum over some of them, given by their indices.
    pub fn of_some(bodies: &Bodies<S>, some: &[usize]) -> Self {
        Momenta::sum(bodies, some.iter().copied())
    }
    fn sum(bodies: &Bodies<S>, some: impl Iterator<Item = usize>) -> Self {
        let mut m = Momenta::default();
        for i in some {
            m.add(&Momenta::of_motion(&bodies.data[i], (&bodies.motion.pose(i), &bodies.motion.twist(i))));
        }
        m
    }
    /// Those of a body, if it moved so.
    #[inline]
    pub(crate) fn of_motion(data: &BodyData<S>, motion: (&Pose<S>, &Twist<S>)) -> Self {
        Momenta { linear: data.momentum(motion.1), angular: data.angular_momentum(motion) }
    }
    pub(crate) fn add(&mut self, other: &Self) {
        self.linear += other.linear;
        self.angular += other.angular;
    }
}
