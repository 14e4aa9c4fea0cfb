//! Mass properties: mass, centre of mass, inertia about it (theory chapter 1).

use carom_math::{Column, Inertia, Pose, Space};
use serde::{Deserialize, Serialize};

/// What a body's motion needs to know of its mass.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(bound = "")]
pub struct MassProperties<S: Space> {
    /// Mass \[kg\].
    pub mass: f64,
    /// Centre of mass in shape axes \[m\].
    pub center: S::Vector,
    /// Inertia about the centre of mass, in shape axes \[kg m^2\].
    pub inertia: S::Inertia,
    /// Estimated relative error of the quadrature \[1\]; 0 for closed forms.
    pub error: f64,
}

impl<S: Space> MassProperties<S> {
    /// The same shape with another total mass.
    pub fn with_mass(&self, mass: f64) -> Self {
        MassProperties { mass, inertia: self.inertia.scaled(mass / self.mass), ..*self }
    }
    /// The same body seen from another frame: `pose` places the shape in that frame.
    pub fn placed(&self, pose: &Pose<S>) -> Self {
        MassProperties {
            center: pose.to_world(self.center),
            inertia: S::turned(&self.inertia, &pose.rotation),
            ..*self
        }
    }
    /// Inertia about an axis through `point` (shape axes): w^T I w / |w|^2 by Steiner (item 13).
    pub fn about_axis(&self, axis: S::Spin, point: S::Vector) -> f64 {
        let inertia = self.inertia.plus(&S::steiner(self.mass, point - self.center));
        axis.dot(inertia.apply(axis)) / axis.norm_squared()
    }
    /// Two bodies joined, both in the same axes (Steiner's rule).
    pub fn joined(&self, other: &Self) -> Self {
        let mass = self.mass + other.mass;
        let center = (self.center * self.mass + other.center * other.mass) * (1.0 / mass);
        let own = self.inertia.plus(&S::steiner(self.mass, self.center - center));
        let others = other.inertia.plus(&S::steiner(other.mass, other.center - center));
        MassProperties { mass, center, inertia: own.plus(&others), error: self.error.max(other.error) }
    }
    /// Bodies joined, all in the same axes (Steiner's rule about the common centre); `None` for no bodies. Where
    /// they overlap, mass counts as often as they cover it.
    pub fn joined_all(bodies: &[Self]) -> Option<Self> {
        let anchor = bodies.first()?.center;
        let mass: f64 = bodies.iter().map(|b| b.mass).sum();
        // offsets from one of the centres, so that far from zero nothing large cancels
        let shift = bodies.iter().fold(S::Vector::ZERO, |sum, b| sum + (b.center - anchor) * b.mass);
        let center = anchor + shift * (1.0 / mass);
        let inertia = bodies.iter().fold(S::Inertia::ZERO, |sum, b| {
            sum.plus(&b.inertia).plus(&S::steiner(b.mass, b.center - center))
        });
        let error = bodies.iter().fold(0.0, |worst: f64, b| worst.max(b.error));
        Some(MassProperties { mass, center, inertia, error })
    }
    /// The rotation of the body's axes does not change what it is: unit check used by tests.
    pub fn turned(&self, rotation: &S::Rotation) -> Self {
        self.placed(&Pose::new(S::Vector::ZERO, *rotation))
    }
}
