//! What stands: pyramids, many pyramids, stacks under a heavy top, a pyramid of bricks, a field of fixed boxes with a few on it.

use super::slab;
use crate::scene::{Arena, Body, Kind};
use carom_scenes::chance::Chance;

/// A pyramid of unit boxes, one deep, `base` boxes wide: each on two others and beside its neighbours without a gap.
fn one_pyramid<S: Arena>(base: usize, along: f64, ground: f64, deep: f64, into: &mut Vec<Body<S>>) {
    for row in 0..base {
        let width = base - row;
        for k in 0..width {
            let x = along + k as f64 - 0.5 * (width - 1) as f64;
            let spot = S::spot(x, ground + 0.5 + row as f64, deep);
            into.push(Body::new(Kind::Dynamic, S::block(1.0, 1.0, 1.0), spot));
        }
    }
}

/// One pyramid: base (base + 1)/2 boxes.
pub fn pyramid<S: Arena>(base: usize) -> Vec<Body<S>> {
    let mut bodies = vec![slab(0.0, 0.0, 2.0 * base as f64 + 40.0, 40.0)];
    one_pyramid(base, 0.0, 0.0, 0.0, &mut bodies);
    bodies
}

/// `count` by `count` pyramids of base 10: in the plane in storeys, each on a floor of its own; in space on one ground.
pub fn pyramids<S: Arena>(count: usize) -> Vec<Body<S>> {
    let base = 10;
    let spread = |k: usize, spacing: f64| (k as f64 - 0.5 * (count - 1) as f64) * spacing;
    let width = count as f64 * 12.0 + 20.0;
    let mut bodies = Vec::new();
    if S::DIM == 3 {
        bodies.push(slab(0.0, 0.0, width, count as f64 * 4.0 + 20.0));
    }
    for row in 0..count {
        let storey = if S::DIM == 2 { row as f64 * 15.0 } else { 0.0 };
        if S::DIM == 2 {
            bodies.push(slab(0.0, storey, width, 1.0));
        }
        for k in 0..count {
            one_pyramid(base, spread(k, 12.0), storey, spread(row, 4.0), &mut bodies);
        }
    }
    bodies
}

/// `count` by `count` stacks of ten unit boxes, the topmost 1000 times as heavy as the others.
pub fn stacks<S: Arena>(count: usize) -> Vec<Body<S>> {
    let spread = |k: usize| (k as f64 - 0.5 * (count - 1) as f64) * 3.0;
    let extent = 3.0 * count as f64 + 40.0;
    let mut bodies = vec![slab(0.0, 0.0, extent, extent)];
    for stack in 0..count * S::layers(count) {
        for k in 0..10 {
            let spot = S::spot(spread(stack % count), 0.5 + k as f64, spread(stack / count));
            let density = if k == 9 { 1e6 } else { 1e3 };
            bodies.push(Body::new(Kind::Dynamic, S::block(1.0, 1.0, 1.0), spot).dense(density));
        }
    }
    bodies
}

/// Bricks of 1 x .6 x .4 m in square layers of `base`, `base` - 1, ... 1 bricks a side: each on four others, 2 cm from its
/// neighbours; base (base + 1) (2 base + 1)/6 bricks.
pub fn bricks<S: Arena>(base: usize) -> Vec<Body<S>> {
    let extent = 1.1 * base as f64 + 20.0;
    let mut bodies = vec![slab(0.0, 0.0, extent, extent)];
    for layer in 0..base {
        let side = base - layer;
        let at = |k: usize, spacing: f64| (k as f64 - 0.5 * (side - 1) as f64) * spacing;
        for k in 0..side * S::layers(side) {
            let spot = S::spot(at(k % side, 1.02), 0.4 * (layer as f64 + 0.5), at(k / side, 0.62));
            bodies.push(Body::new(Kind::Dynamic, S::block(1.0, 0.4, 0.6), spot));
        }
    }
    bodies
}

/// `side` by `side` fixed unit boxes half a metre apart, and a hundred boxes of .6 m dropped onto some of them from .2 m.
pub fn statics<S: Arena>(side: usize) -> Vec<Body<S>> {
    let at = |k: usize| (k as f64 - 0.5 * (side - 1) as f64) * 1.5;
    let count = side * S::layers(side);
    let spot = |k: usize, up: f64| S::spot(at(k % side), up, at(k / side));
    let mut bodies: Vec<Body<S>> =
        (0..count).map(|k| Body::new(Kind::Fixed, S::block(1.0, 1.0, 1.0), spot(k, -0.5))).collect();
    let mut chance = Chance::new(5);
    // one in each of a hundred shares of the field, so that no two meet
    let share = (count / 100).max(1);
    for k in 0..count.min(100) {
        let chosen = k * share + chance.between(0.0, share as f64) as usize;
        bodies.push(Body::new(Kind::Dynamic, S::block(0.6, 0.6, 0.6), spot(chosen.min(count - 1), 0.5)));
    }
    bodies
}
