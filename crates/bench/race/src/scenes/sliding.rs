//! What slides: long bricks launched along many directions. Friction of a body that does not turn is opposite to its
//! velocity at every point, and the pressure moves ahead along the velocity, so no moment turns it: each goes straight on.

use super::slab;
use crate::scene::{Body, Kind};
use carom::{Quaternion, Spatial, SpatialShape, vec3};
use std::f64::consts::TAU;

/// Speed at the start \[m/s\].
const SPEED: f64 = 5.0;

/// `count` bricks of 1.2 x .3 x .1 m, each launched along its x axis turned by another angle between 0 and 90 degrees.
pub fn slide(count: usize) -> Vec<Body<Spatial>> {
    let extent = 6.0 * count as f64 + 20.0;
    let mut bodies = vec![slab(0.0, 0.0, extent, extent)];
    for k in 0..count {
        let angle = 0.25 * TAU * (k as f64 + 0.5) / count as f64;
        let shape = SpatialShape::Box { size: [1.2, 0.3, 0.1] };
        let spot = vec3(6.0 * (k as f64 - 0.5 * (count - 1) as f64), 0.0, 0.05);
        // the bricks stand across the world's axes too, lest an axis of the engine be an axis of theirs
        let turn = Quaternion::from_axis_angle(vec3(0.0, 0.0, 1.0), 0.3);
        let way = vec3((angle + 0.3).cos(), (angle + 0.3).sin(), 0.0);
        bodies.push(Body::new(Kind::Dynamic, shape, spot).turned(turn).moving(way * SPEED));
    }
    bodies
}
