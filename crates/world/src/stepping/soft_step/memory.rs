//! Patches carried from step to step, in the order of their pairs. A pair is named by its bodies' serials, a
//! point by its contact's id; friction is kept in world axes, so that a turned frame starts from the same force.

use serde::{Deserialize, Serialize};

/// Forces of a patch at the end of a step.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct PatchForce {
    /// Serials of bodies a and b.
    pub pair: (u64, u64),
    /// Points of the patch.
    pub count: usize,
    /// Contact ids of its points.
    pub ids: [u64; 4],
    /// Normal forces of its points \[N\].
    pub normal: [f64; 4],
    /// Friction on body a in world axes \[N\].
    pub friction: [f64; 3],
    /// Friction's torque about the normal \[N m\].
    pub twist: f64,
    /// Rolling friction on body a in world axes \[N m\]; in the plane one number.
    pub rolling: [f64; 3],
    /// Where its points were found.
    pub seen: Seen,
}

impl PatchForce {
    /// Contact ids of its points; a count from a file may be any.
    pub fn names(&self) -> &[u64] {
        &self.ids[..self.count.min(4)]
    }
}

/// A patch as it was when the narrow phase looked at its pair.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Seen {
    /// Normal.
    pub normal: [f64; 3],
    /// Points \[m\].
    pub points: [[f64; 3]; 4],
    /// Gaps \[m\].
    pub gaps: [f64; 4],
    /// Places of bodies a and b \[m\].
    pub places: [[f64; 3]; 2],
    /// Attitudes of bodies a and b.
    pub attitudes: [[f64; 4]; 2],
}

/// Walks along remembered patches beside pairs that come in the same order.
pub struct Walk<'a> {
    forces: &'a [PatchForce],
    next: usize,
}

impl<'a> Walk<'a> {
    /// From a place, or from where a pair may first be.
    pub fn from(forces: &'a [PatchForce], place: Option<usize>, pair: (u64, u64)) -> Self {
        let next = place.unwrap_or_else(|| forces.partition_point(|f| f.pair < pair));
        Walk { forces, next }
    }
    /// Where it stands.
    pub fn place(&self) -> usize {
        self.next
    }
    /// Places of the patches that a pair had.
    pub fn of(&mut self, pair: (u64, u64)) -> std::ops::Range<usize> {
        while self.forces.get(self.next).is_some_and(|f| f.pair < pair) {
            self.next += 1;
        }
        let first = self.next;
        while self.forces.get(self.next).is_some_and(|f| f.pair == pair) {
            self.next += 1;
        }
        first..self.next
    }
}
