//! Torque-free rotation by splitting (theory chapter 2). With I_m the middle principal moment,
//! T = |L|^2/(2 I_m) + 1/2 (1/I_s - 1/I_m) L_s^2 + 1/2 (1/I_l - 1/I_m) L_l^2: the first part turns the body
//! steadily about the fixed L and commutes with the others, each of which turns it about one principal axis.
//! Strang's symmetric product of the two is of order 2, keeps |L| and L exactly, and is exact for symmetric
//! tops. Rejected: splitting over all three axes, which is of the same order and not exact for tops.

use crate::bodies::Bodies;
use crate::integrate::set_spin_momentum;
use carom_geometry::Geometry;
use carom_math::{Column, Rotation};

/// Rotates body `i` freely for the time `h`, angular momentum in world axes kept.
pub fn split_rotation<S: Geometry>(bodies: &mut Bodies<S>, i: usize, h: f64) {
    let momentum = bodies.spin_momentum(i);
    let d = &bodies.data[i];
    let (small, middle, large) = ordered(d.principal.as_slice());
    let reference = 1.0 / d.principal[middle];
    // axes of the principal frame in the world
    let mut frame = d.axes.then(&bodies.motion.rotation[i]);
    let mut turn = |axis: usize, time: f64| {
        let excess = 1.0 / d.principal[axis] - reference;
        if excess == 0.0 {
            return;
        }
        let along = frame.unrotate_spin(momentum)[axis];
        let unit = S::Spin::from_fn(|k| if k == axis { 1.0 } else { 0.0 });
        let step = S::Rotation::about(frame.rotate_spin(unit) * (time * excess * along));
        frame = frame.then(&step);
    };
    turn(small, 0.5 * h);
    turn(large, h);
    turn(small, 0.5 * h);
    let steady = S::Rotation::about(momentum * (h * reference));
    let frame = frame.then(&steady);
    bodies.motion.rotation[i] = d.axes.inverse().then(&frame);
    set_spin_momentum(bodies, i, momentum);
}

/// Indices of the smallest, middle and largest principal moment; all the same in the plane.
fn ordered(principal: &[f64]) -> (usize, usize, usize) {
    let mut order = [0, 1, 2].map(|k: usize| k.min(principal.len() - 1));
    order.sort_by(|&i, &j| principal[i].total_cmp(&principal[j]));
    (order[0], order[1], order[2])
}
