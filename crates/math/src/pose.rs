//! Pose: where a body is, r_w = x + R r_b (theory chapter 1).

use crate::rotation::Rotation;
use crate::space::Space;
use serde::{Deserialize, Serialize};

/// Position and orientation of a frame in the world.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(bound = "")]
pub struct Pose<S: Space> {
    /// Position of the frame's origin \[m\].
    pub position: S::Vector,
    /// Rotation from the frame's axes to world axes.
    pub rotation: S::Rotation,
}

impl<S: Space> Pose<S> {
    /// A pose from its parts.
    pub fn new(position: S::Vector, rotation: S::Rotation) -> Self {
        Pose { position, rotation }
    }
    /// Body coordinates to world coordinates: x + R r.
    #[inline]
    pub fn to_world(&self, r: S::Vector) -> S::Vector {
        self.position + self.rotation.rotate(r)
    }
    /// World coordinates to body coordinates: R^T (r - x).
    pub fn to_body(&self, r: S::Vector) -> S::Vector {
        self.rotation.unrotate(r - self.position)
    }
    /// The pose of `inner`, given in this frame, in world coordinates.
    pub fn compose(&self, inner: &Pose<S>) -> Pose<S> {
        Pose { position: self.to_world(inner.position), rotation: inner.rotation.then(&self.rotation) }
    }
    /// The inverse map as a pose.
    pub fn inverse(&self) -> Pose<S> {
        let rotation = self.rotation.inverse();
        Pose { position: -rotation.rotate(self.position), rotation }
    }
}
