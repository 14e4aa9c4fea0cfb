//! Rest and sleep. A body rests while it stays where its rest began; an island whose bodies have all rested for a while,
//! and that obstacles at rest bear, falls asleep: it is held, costs nothing, and wakes when something stirs it, with the
//! forces that it had. What floats never sleeps, for nothing could take its momentum.

use crate::bodies::Bodies;
use crate::settings::SoftSettings;
use crate::stepping::soft_step::{AGAIN, PatchList};
use carom_geometry::Geometry;
use carom_math::{Column, Rotation, Space};
use serde::{Deserialize, Serialize};

/// For how long a body has rested, and where its rest began.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(bound = "")]
pub struct Still<S: Space> {
    /// The body's serial.
    pub serial: u64,
    /// Time since the rest began \[s\].
    pub since: f64,
    /// Its place then \[m\].
    pub position: S::Vector,
    /// Its attitude then.
    pub rotation: S::Rotation,
}

/// An island that sleeps.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(bound = "")]
pub struct Asleep<S: Space> {
    /// Serials of its bodies, ascending.
    pub serials: Vec<u64>,
    /// Forces between them and on the obstacles under them, in the order of their pairs.
    pub patches: PatchList<S>,
}

impl<S: Geometry> Still<S> {
    /// What a body's rest is after a step of length `dt`, from what it was before.
    pub fn after(
        before: Option<&Still<S>>,
        bodies: &Bodies<S>,
        i: usize,
        dt: f64,
        choice: &SoftSettings,
    ) -> Self {
        let (d, pose) = (&bodies.data[i], bodies.motion.pose(i));
        let begun = Still { serial: d.serial, since: 0.0, position: pose.position, rotation: pose.rotation };
        let Some(rest) = before.filter(|_| d.extent.is_finite()) else { return begun };
        let farthest = (choice.sleep_speed * choice.sleep_time).min(AGAIN * d.extent);
        // written so that what is no number begins anew
        if (pose.position - rest.position).norm() <= farthest
            && (pose.position - rest.position).norm()
                + turned::<S>(rest, &pose.rotation, d.reach_of_turning())
                <= farthest
        {
            return Still { since: rest.since + dt, ..*rest };
        }
        begun
    }
}

/// How far the surface of a body was carried by turning since its rest began \[m\].
fn turned<S: Geometry>(rest: &Still<S>, rotation: &S::Rotation, arm: f64) -> f64 {
    arm * rest.rotation.inverse().then(rotation).vector().norm()
}

impl<S: Space> Asleep<S> {
    /// True when one of some bodies, named by their serials in ascending order, is in it.
    pub fn has_one_of(&self, serials: &[u64]) -> bool {
        self.serials.iter().any(|own| serials.binary_search(own).is_ok())
    }
}
