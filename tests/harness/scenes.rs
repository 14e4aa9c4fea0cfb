//! Scenes that laws and cases look at with other schemes, solvers and bounds.

use super::{Dice, Dimension, add, add_floor, close, leaning, world};
use carom::{BodySpec, Column, Planar, PlanarShape, Settings, Spatial, SpatialShape, World, vec2, vec3};
use std::f64::consts::PI;

/// Four bricks of unit length (bodies 1 to 4) on a table whose edge is at the origin, each out by this share of what
/// it can be: L/(2 (4 - k)) from the bottom, together 25/24 L.
pub fn overhanging_bricks<S: Dimension>(settings: Settings<S>, share: f64) -> World<S> {
    let mut w = world::<S>(settings);
    add(&mut w, "table", BodySpec::fixed(S::block(4.0, 1.0)).at(S::at(-2.0, -0.5)).friction(0.8));
    let mut place = -0.5;
    for k in 0..4 {
        place += share * 0.5 / f64::from(4 - k);
        let brick = BodySpec::heavy(S::block(1.0, 0.25), 1.0).at(S::at(place, 0.125 + 0.25 * f64::from(k)));
        add(&mut w, &format!("brick {k}"), brick.friction(0.8));
    }
    close(place + 0.5, share * 25.0 / 24.0, 1e-12, "C28 overhang [L]");
    w
}

/// Three storeys, each of two uprights and a lintel.
pub fn tower_of_planks<S: Dimension>(settings: Settings<S>) -> World<S> {
    let mut w = world::<S>(settings);
    add_floor(&mut w, 0.5, 0.0);
    let mut top = 0.0;
    for storey in 0..3 {
        for (side, name) in [(-0.3, "left"), (0.3, "right")] {
            let upright = BodySpec::dense(S::block(0.1, 0.6), 600.0).at(S::at(side, top + 0.3));
            add(&mut w, &format!("{name} {storey}"), upright);
        }
        top += 0.6;
        let lintel = BodySpec::dense(S::block(0.8, 0.1), 600.0).at(S::at(0.0, top + 0.05));
        add(&mut w, &format!("lintel {storey}"), lintel);
        top += 0.1;
    }
    w
}

/// A wedge that falls towards `along`, its corner below the top at the origin.
pub trait Wedge: Dimension {
    /// The wedge of a length and a height \[m\].
    fn wedge(length: f64, height: f64) -> Self::Shape;
}
impl Wedge for Planar {
    fn wedge(length: f64, height: f64) -> PlanarShape {
        PlanarShape::ConvexPolygon { points: vec![vec2(0.0, 0.0), vec2(length, 0.0), vec2(0.0, height)] }
    }
}
impl Wedge for Spatial {
    fn wedge(length: f64, height: f64) -> SpatialShape {
        let side = |y: f64| [vec3(0.0, y, 0.0), vec3(length, y, 0.0), vec3(0.0, y, height)];
        SpatialShape::ConvexHull { points: side(-0.5).into_iter().chain(side(0.5)).collect() }
    }
}

/// A block of 1 kg (body 2) on a wedge of 3 kg and 30 degrees (body 1), without friction.
pub fn block_on_wedge<S: Wedge>(settings: Settings<S>) -> World<S> {
    let angle = PI / 6.0;
    let mut w = world::<S>(settings);
    add_floor(&mut w, 0.0, 0.0);
    let wedge = BodySpec::heavy(S::wedge(2.0, 2.0 * angle.tan()), 3.0).with_origin_at(S::Vector::ZERO);
    add(&mut w, "wedge", wedge.friction(0.0));
    let place = S::at(0.6, 1.4 * angle.tan()) + S::at(angle.sin(), angle.cos()) * 0.05;
    let block = BodySpec::heavy(S::block(0.2, 0.1), 1.0).at(place).turned(leaning::<S>(-angle));
    add(&mut w, "block", block.friction(0.0));
    w
}

/// Elastic balls, six a side, between walls two metres apart.
pub fn elastic_gas<S: Dimension>(settings: Settings<S>) -> World<S> {
    let mut w = world::<S>(settings);
    for (axis, side) in (0..S::DIM).flat_map(|axis| [(axis, 1.0), (axis, -1.0)]) {
        let normal = S::Vector::from_fn(|i| if i == axis { side } else { 0.0 });
        let wall = BodySpec::fixed(S::wall(normal)).at(normal * -1.0).friction(0.0).restitution(1.0);
        add(&mut w, &format!("wall {axis} {side}"), wall);
    }
    let mut dice = Dice(32);
    for k in 0..6_usize.pow(S::DIM as u32) {
        let place = S::Vector::from_fn(|i| -0.75 + 0.3 * ((k / 6_usize.pow(i as u32)) % 6) as f64);
        let velocity = S::Vector::from_fn(|_| dice.between(-2.0, 2.0));
        let ball = BodySpec::heavy(S::ball(0.1), 1.0).at(place).moving(velocity);
        add(&mut w, &format!("ball {k}"), ball.friction(0.0).restitution(1.0));
    }
    w
}
