//! Rolling and spinning (torsional) friction of a contact (theory eqs. 3.24 to 3.28): beside the forces the bodies
//! exchange a moment, |m_roll| <= rolling gamma_n in the tangent plane and |m_spin| <= spinning gamma_n about the
//! normal, each opposite to its part of the relative angular velocity w_a - w_b. In the plane the one moment is
//! rolling friction's. Knows no solver.

use crate::prepared::PreparedContact;
use crate::problem::{Contact, ContactProblem, Twist};
use carom_math::{Column, Inertia, Space};
use serde::{Deserialize, Serialize};

/// Rolling and spinning friction of one contact.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Resistance {
    /// Index of the contact; ascending in a problem, so that a contact has at most one.
    pub contact: usize,
    /// Largest rolling moment per normal force \[m\].
    pub rolling: f64,
    /// Largest moment about the normal per normal force \[m\]; without effect in the plane.
    pub spinning: f64,
}

/// The axis of component `k` of a moment: the normal, then the tangents; in the plane the one axis there is.
#[inline]
pub fn axis<S: Space>(normal: S::Vector, k: usize) -> S::Spin {
    if S::SPIN == 1 {
        return S::Spin::from_fn(|_| 1.0);
    }
    let direction = if k == 0 { normal } else { S::tangent(normal, k - 1) };
    S::Spin::from_fn(|i| direction[i])
}

impl<S: Space> Contact<S> {
    /// A moment in the contact's frame (normal, tangents; in the plane one number) in world axes.
    pub fn moment_to_world(&self, moment: S::Spin) -> S::Spin {
        (0..S::SPIN).fold(S::Spin::ZERO, |sum, k| sum + axis::<S>(self.normal, k) * moment[k])
    }
    /// A world moment's components in the contact's frame.
    pub fn moment_to_frame(&self, world: S::Spin) -> S::Spin {
        S::Spin::from_fn(|k| axis::<S>(self.normal, k).dot(world))
    }
    /// Angular velocity of a relative to b, in the contact's frame \[rad/s\].
    pub fn relative_spin(&self, velocities: &[Twist<S>]) -> S::Spin {
        self.moment_to_frame(velocities[self.a].angular - velocities[self.b].angular)
    }
}

/// One part of a moment: its components, the limit per normal impulse, and J M^-1 J^T.
#[derive(Clone, Copy, Debug)]
pub struct Part {
    /// First component in the contact's frame.
    pub first: usize,
    /// One past the last component.
    pub end: usize,
    /// Largest moment per normal impulse \[m\].
    pub limit: f64,
    /// Largest eigenvalue of (I_a^-1 + I_b^-1) on these axes \[1/(kg m^2)\]; 0 when no moment turns either body.
    pub inverse_inertia: f64,
    /// Makes an angular velocity a velocity \[m\]: sqrt(W_nn / inverse inertia), the length at which a turning with
    /// the energy of this inertia moves as fast as the contact's mass with the same energy (theory eq. 3.28).
    pub length: f64,
}

impl Part {
    /// Length of this part of a moment or of an angular velocity.
    #[inline]
    pub fn size<S: Space>(&self, of: S::Spin) -> f64 {
        of.as_slice()[self.first..self.end].iter().map(|x| x * x).sum::<f64>().sqrt()
    }
}

/// The moment inside the limits of a normal impulse that is nearest part by part; what is not finite is none.
#[inline]
pub fn project_moment<S: Space>(moment: S::Spin, given: &Resistance, normal: f64) -> S::Spin {
    if !moment.is_finite() {
        return S::Spin::ZERO;
    }
    let normal = normal.max(0.0);
    let shrink = |size: f64, limit: f64| if size > limit { limit / size } else { 1.0 };
    if S::SPIN == 1 {
        return moment * shrink(moment[0].abs(), given.rolling * normal);
    }
    let roll = shrink((moment[1] * moment[1] + moment[2] * moment[2]).sqrt(), given.rolling * normal);
    let spin = shrink(moment[0].abs(), given.spinning * normal);
    S::Spin::from_fn(|k| moment[k] * if k == 0 { spin } else { roll })
}

/// A resistance made ready for sweeping.
#[derive(Clone, Copy, Debug)]
pub struct PreparedResistance<S: Space> {
    /// Index of the contact.
    pub contact: usize,
    /// The coefficients.
    pub given: Resistance,
    a: usize,
    b: usize,
    axes: [S::Spin; 3],
    turn_a: [S::Spin; 3],
    turn_b: [S::Spin; 3],
    parts: [Part; 2],
}

impl<S: Space> PreparedResistance<S> {
    /// The axes and responses of a resistance of a problem.
    pub fn new(given: &Resistance, problem: &ContactProblem<S>, contact: &PreparedContact<S>) -> Self {
        let c = &problem.contacts[given.contact];
        let axes: [S::Spin; 3] = std::array::from_fn(|k| axis::<S>(c.normal, k));
        let turn = |body: usize| axes.map(|axis| problem.inverse_masses[body].angular.apply(axis));
        let (turn_a, turn_b) = (turn(c.a), turn(c.b));
        let entry = |i: usize, j: usize| axes[i].dot(turn_a[j] + turn_b[j]);
        let part = |first: usize, end: usize, limit: f64, inverse_inertia: f64| {
            let length = (contact.normal.inverse_effective_mass / inverse_inertia).sqrt();
            Part { first, end, limit, inverse_inertia, length: if length.is_finite() { length } else { 0.0 } }
        };
        let parts = if S::SPIN == 1 {
            [part(0, 1, given.rolling, entry(0, 0)), part(1, 1, 0.0, 0.0)]
        } else {
            let (a, d, off) = (entry(1, 1), entry(2, 2), entry(1, 2));
            let largest = 0.5 * (a + d) + (0.25 * (a - d) * (a - d) + off * off).sqrt();
            [part(1, 3, given.rolling, largest), part(0, 1, given.spinning, entry(0, 0))]
        };
        PreparedResistance {
            contact: given.contact,
            given: *given,
            a: c.a,
            b: c.b,
            axes,
            turn_a,
            turn_b,
            parts,
        }
    }
    /// The parts that a moment can have: rolling, and in space spinning.
    pub fn parts(&self) -> impl Iterator<Item = &Part> {
        self.parts.iter().filter(|p| p.inverse_inertia > 0.0)
    }
    /// The same, with those that no moment turns.
    pub fn all_parts(&self) -> &[Part; 2] {
        &self.parts
    }
    /// Angular velocity of a relative to b in the contact's frame \[rad/s\].
    #[inline]
    pub fn spin(&self, v: &[Twist<S>]) -> S::Spin {
        let between = v[self.a].angular - v[self.b].angular;
        S::Spin::from_fn(|k| self.axes[k].dot(between))
    }
    /// Adds the response to a moment.
    #[inline]
    pub fn apply(&self, moment: S::Spin, v: &mut [Twist<S>]) {
        for k in 0..S::SPIN {
            v[self.a].angular += self.turn_a[k] * moment[k];
            v[self.b].angular -= self.turn_b[k] * moment[k];
        }
    }
    /// A moment after a step against the relative spin, not yet inside its limits; what turns nothing is zero.
    #[inline]
    pub fn trial(&self, moment: S::Spin, spin: S::Spin, step: f64) -> S::Spin {
        let mut trial = S::Spin::ZERO;
        for p in self.parts() {
            for k in p.first..p.end {
                trial[k] = moment[k] - spin[k] * (step / p.inverse_inertia);
            }
        }
        trial
    }
    /// One Gauss-Seidel update at a normal impulse; returns the square of the larger change as a velocity.
    #[inline]
    pub fn relax(&self, normal: f64, moment: &mut S::Spin, v: &mut [Twist<S>]) -> f64 {
        let next = project_moment::<S>(self.trial(*moment, self.spin(v), 1.0), &self.given, normal);
        let delta = next - *moment;
        *moment = next;
        self.apply(delta, v);
        let moved = |p: &Part| p.size::<S>(delta) * p.inverse_inertia * p.length;
        self.parts().map(|p| moved(p).powi(2)).fold(0.0, f64::max)
    }
    /// The natural map of both parts, made a velocity by their lengths \[m/s\] (theory eq. 3.28).
    pub fn residual(&self, normal: f64, moment: S::Spin, spin: S::Spin) -> f64 {
        let trial = self.trial(moment, spin, 1.0);
        let nearest = project_moment::<S>(trial, &self.given, normal);
        let mut sum = 0.0;
        for p in self.parts() {
            // nearly equal moments are not subtracted where the limit is out of reach
            let inside = (p.first..p.end).all(|k| nearest[k] == trial[k]);
            let wrong =
                if inside { p.size::<S>(spin) } else { p.size::<S>(moment - nearest) * p.inverse_inertia };
            sum += (wrong * p.length).powi(2);
        }
        sum.sqrt()
    }
    /// m . w with every part in its own energy: sum of m_k w_k J M^-1 J^T.
    #[inline]
    pub fn product(&self, m: S::Spin, w: S::Spin) -> f64 {
        let along = |p: &Part| (p.first..p.end).map(|k| m[k] * w[k]).sum::<f64>() * p.inverse_inertia;
        self.parts().map(along).sum()
    }
    /// The rows of J: bodies a and b and the axis of each component.
    pub fn rows(&self) -> impl Iterator<Item = (usize, usize, S::Spin)> + '_ {
        self.axes.iter().take(S::SPIN).map(|axis| (self.a, self.b, *axis))
    }
}
