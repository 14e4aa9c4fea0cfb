//! What strikes: a heavy ball at 50 m/s into a wall of boxes.

use super::slab;
use crate::scene::{Arena, Body, Kind};

/// A wall of boxes of half a metre, `height` high and half as thick (in space four deep), and a ball of radius 1 m and eight
/// times their density that flies into it.
pub fn smash<S: Arena>(height: usize) -> Vec<Body<S>> {
    let side = 0.5;
    let mut bodies = vec![slab(100.0, 0.0, 400.0, 40.0)];
    let (thick, layers) = (height.div_ceil(2), S::layers(4));
    for k in 0..thick * height * layers {
        let (x, up, y) = (k % thick, k / thick % height, k / (thick * height));
        let deep = (y as f64 - 0.5 * (layers - 1) as f64) * side;
        let spot = S::spot(side * x as f64, side * (up as f64 + 0.5), deep);
        bodies.push(Body::new(Kind::Dynamic, S::block(side, side, side), spot));
    }
    let aim = S::spot(-5.0, (0.25 * height as f64 * side).max(1.1), 0.0);
    let ball = Body::new(Kind::Dynamic, S::ball(1.0), aim).dense(8000.0);
    bodies.push(ball.moving(S::place(50.0, 0.0)));
    bodies
}
