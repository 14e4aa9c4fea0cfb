//! Energies and momenta of all bodies that can move (theory chapter 1, items 9-10). Obstacles do not count.

use crate::bodies::Bodies;
use carom_geometry::Geometry;
use carom_math::workers::Memory;
use carom_math::{Column, Space, Workers};
use serde::{Deserialize, Serialize};

/// Bodies whose terms a worker finds at a time.
const CHUNK: usize = 128;

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
        let Some(moment) = bodies.asleep_moment() else {
            return Energy::sum(bodies, bodies.dynamic(), gravity);
        };
        // bodies that sleep have potential energy alone, and it stays
        let mut awake = Energy::sum(bodies, bodies.awake(), gravity);
        awake.potential -= gravity.dot(moment);
        awake
    }
    /// Sum over some of them, given by their indices.
    pub fn of_some<S: Geometry>(bodies: &Bodies<S>, some: &[usize], gravity: S::Vector) -> Self {
        Energy::sum(bodies, some.iter().copied(), gravity)
    }
    /// The sum over all, its terms found by several workers and added in the same order.
    pub(crate) fn shared<S: Geometry>(
        bodies: &Bodies<S>,
        gravity: S::Vector,
        workers: &Workers,
        (all, terms): &mut (Vec<usize>, Memory<Vec<Energy>>),
    ) -> Self {
        if workers.is_alone() {
            return Energy::of(bodies, gravity);
        }
        let moment = bodies.asleep_moment();
        all.clear();
        match moment {
            None => all.extend(bodies.dynamic()),
            Some(_) => all.extend(bodies.awake()),
        }
        let mut e = Energy::default();
        let find = |_, some: &[usize], out: &mut Vec<Energy>| {
            out.extend(some.iter().map(|i| Energy::of_body(bodies, *i, gravity)));
        };
        workers.chunks(all, CHUNK, terms, find, |found| found.drain(..).for_each(|term| e.add(term)));
        if let Some(moment) = moment {
            e.potential -= gravity.dot(moment);
        }
        e
    }
    fn sum<S: Geometry>(bodies: &Bodies<S>, some: impl Iterator<Item = usize>, gravity: S::Vector) -> Self {
        let mut e = Energy::default();
        some.for_each(|i| e.add(Energy::of_body(bodies, i, gravity)));
        e
    }
    fn of_body<S: Geometry>(bodies: &Bodies<S>, i: usize, gravity: S::Vector) -> Self {
        Energy {
            translational: bodies.translational_energy(i),
            rotational: bodies.rotational_energy(i),
            potential: -(bodies.data[i].mass_properties.mass * gravity.dot(bodies.motion.position[i])),
        }
    }
    fn add(&mut self, other: Energy) {
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
        let mut m = Momenta { linear: S::Vector::ZERO, angular: S::Spin::ZERO };
        for i in some {
            m.linear += bodies.momentum(i);
            m.angular += bodies.angular_momentum(i);
        }
        m
    }
}
