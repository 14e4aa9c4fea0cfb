//! Generalised reflections (Smith, Kaufman, Vouga, Tamstorf and Grinspun 2012; theory eq. 4.24). A round is Newton's
//! law on the contacts that approach, and on no others; rounds follow until nothing approaches. Where every approach of
//! an island is too slow to bounce the round is plastic and holds all that touch, or slow rounds would not end.
//! Symmetric as Newton's law, and passes a blow on as collisions one by one do. Without friction a round loses energy
//! contact by contact, even with different e: gamma (u+ + u-) = gamma (1 - e) u- <= 0; with friction the guard watches.

use crate::bodies::Bodies;
use crate::impact::part::{Islands, Part};
use crate::narrow_phase::Touch;
use carom_geometry::Geometry;

/// Rounds of a resolve; after them what still approaches ends plastically, which ends.
pub const ROUNDS: usize = 200;

/// Where something bounces only the contacts that approach stay; where nothing does, all.
pub fn keep_approaches<S: Geometry>(bodies: &Bodies<S>, touches: &[Touch<S>], parts: &mut [Option<Part>]) {
    let mut islands = Islands::of(bodies, touches, parts);
    let bouncing = islands.where_any(bodies, touches, parts, |p| p.bounces);
    for (t, part) in touches.iter().zip(parts) {
        *part = part.filter(|p| p.approaches || p.bounces || !bouncing[islands.root(bodies, t)]);
    }
}
