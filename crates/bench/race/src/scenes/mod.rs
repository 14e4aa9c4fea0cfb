//! The scenes of the race by kind, one text for the plane and for space where both have them.

pub mod pouring;
pub mod sliding;
pub mod stacking;
pub mod striking;
pub mod turning;

use crate::scene::{Arena, Body, Kind};

/// A fixed slab whose top is at `top` \[m\], `width` along and `depth` deep \[m\], 2 m thick, centred at `along` \[m\].
pub fn slab<S: Arena>(along: f64, top: f64, width: f64, depth: f64) -> Body<S> {
    Body::new(Kind::Fixed, S::block(width, 2.0, depth), S::spot(along, top - 1.0, 0.0))
}

/// Fixed walls 1 m thick and `height` high \[m\] around a ground of `width` by `depth` \[m\]; two in the plane, four in space.
pub fn walls<S: Arena>(width: f64, depth: f64, height: f64) -> Vec<Body<S>> {
    let up = 0.5 * height;
    let mut walls = Vec::new();
    for side in [-1.0, 1.0] {
        let along = side * (0.5 * width + 0.5);
        walls.push(Body::new(Kind::Fixed, S::block(1.0, height, depth + 2.0), S::spot(along, up, 0.0)));
        if S::DIM == 3 {
            let deep = side * (0.5 * depth + 0.5);
            walls.push(Body::new(Kind::Fixed, S::block(width, height, 1.0), S::spot(0.0, up, deep)));
        }
    }
    walls
}
