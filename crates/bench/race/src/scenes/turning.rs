//! What turns: boxes in a slowly rotating square box, and in a washer's drum with paddles.

use crate::scene::{Arena, Body, Kind};
use carom::{Pose, Rotation};
use std::f64::consts::TAU;

/// Rate of the tumbler and of the drum \[rad/s\]: 25 degrees per second.
const RATE: f64 = 25.0 * TAU / 360.0;

/// `count` by `count` boxes of .25 m (in space as many layers deep) in a square box that turns about its middle.
pub fn tumbler<S: Arena>(count: usize) -> Vec<Body<S>> {
    let (side, spacing) = (0.25, 0.4);
    let half = 0.5 * spacing * count as f64 + 1.0;
    let layers = S::layers(count);
    let depth = spacing * layers as f64;
    let mut parts: Vec<_> = (0..4)
        .map(|k| {
            let turn = S::lean(0.25 * TAU * f64::from(k));
            let wall = S::block(2.0 * half + 2.0, 1.0, depth);
            (Pose::new(turn.rotate(S::spot(0.0, half + 0.5, 0.0)), turn), wall)
        })
        .collect();
    parts.extend(caps::<S>(2.0 * half + 2.0, depth));
    let mut bodies =
        vec![Body::new(Kind::Kinematic, S::joined(parts), S::spot(0.0, 0.0, 0.0)).spinning(S::spin(RATE))];
    grid(count, layers, side, spacing, &mut bodies);
    bodies
}

/// `count` by `count` boxes of .2 m (in space as many layers deep) in a drum of forty walls with eight paddles.
pub fn washer<S: Arena>(count: usize) -> Vec<Body<S>> {
    let (side, spacing, walls) = (0.2, 0.22, 40);
    // the grid's corners stay clear of the paddles
    let radius = 1.25 * 0.5 * spacing * count as f64 * 2f64.sqrt() + 0.5;
    let layers = S::layers(count);
    let depth = spacing * layers as f64;
    let mut parts = Vec::new();
    for k in 0..walls {
        let turn = S::lean(TAU * f64::from(k) / f64::from(walls));
        let length = 2.0 * (radius + 1.0) * (0.5 * TAU / f64::from(walls)).tan();
        let wall = S::block(length, 1.0, depth);
        parts.push((Pose::new(turn.rotate(S::spot(0.0, radius + 0.5, 0.0)), turn), wall));
        if k % 5 == 0 {
            let paddle = S::block(0.3, 0.15 * radius, depth);
            parts.push((Pose::new(turn.rotate(S::spot(0.0, 0.925 * radius, 0.0)), turn), paddle));
        }
    }
    parts.extend(caps::<S>(2.0 * radius + 2.0, depth));
    let mut bodies =
        vec![Body::new(Kind::Kinematic, S::joined(parts), S::spot(0.0, 0.0, 0.0)).spinning(S::spin(RATE))];
    grid(count, layers, side, spacing, &mut bodies);
    bodies
}

/// The ends of a drum in space, nothing in the plane.
fn caps<S: Arena>(width: f64, depth: f64) -> Vec<(Pose<S>, S::Shape)> {
    let sides: &[f64] = if S::DIM == 3 { &[-1.0, 1.0] } else { &[] };
    let cap = |side: &f64| {
        let spot = S::spot(0.0, 0.0, side * (0.5 * depth + 0.5));
        (Pose::new(spot, S::Rotation::IDENTITY), S::block(width, width, 1.0))
    };
    sides.iter().map(cap).collect()
}

/// Boxes in a grid about the origin.
fn grid<S: Arena>(count: usize, layers: usize, side: f64, spacing: f64, into: &mut Vec<Body<S>>) {
    let at = |k: usize, of: usize| (k as f64 - 0.5 * (of - 1) as f64) * spacing;
    for k in 0..count * count * layers {
        let (x, z, y) = (k % count, k / count % count, k / (count * count));
        let spot = S::spot(at(x, count), at(z, count), at(y, layers));
        into.push(Body::new(Kind::Dynamic, S::block(side, side, side), spot));
    }
}
