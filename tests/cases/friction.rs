//! Friction with known answers: cases C14, C16, C17, C19, C20 and C22. Slips that stop inside a step do so at their
//! moment, so that nothing here depends on the step. Cases C15 and C18 stand in `tests/laws/events.rs`.

use crate::cases::events;
use crate::harness::scenes::{Wedge, block_on_wedge};
use crate::harness::*;
use carom::{BodySpec, Column, Mixing, Rotation, Settings, Spatial, SpatialShape, World, vec3};
use std::f64::consts::PI;

in_plane_and_space!(
    a_sliding_ball_ends_rolling_whatever_its_roundness,
    a_ball_on_a_slope_rolls_above_the_slip_threshold_and_slips_below_it,
    a_braking_box_presses_harder_in_front,
    a_braking_box_tips_when_friction_exceeds_half_its_width_over_the_height_of_its_centre,
    mixing_rules_decide_the_deceleration,
    a_block_on_a_moving_wedge_presses_and_slides_by_the_closed_form,
);

/// Case C14: the same length, straight, in sixteen directions, for a long brick askew to its axes.
#[test]
fn a_long_brick_slides_the_same_way_in_every_direction() {
    for k in 0..16 {
        let angle = PI * f64::from(k) / 8.0;
        let (heading, across) = (vec3(angle.cos(), angle.sin(), 0.0), vec3(-angle.sin(), angle.cos(), 0.0));
        let mut w = world::<Spatial>(events(0.1));
        add_floor(&mut w, 0.5, 0.0);
        let brick =
            BodySpec::heavy(SpatialShape::Box { size: [1.2, 0.2, 0.1] }, 2.0).at(vec3(0.0, 0.0, 0.05));
        add(&mut w, "brick", brick.moving(heading * 5.0).friction(0.5));
        settle(&mut w, 1.2);
        let end = w.bodies().motion.position[1];
        close(end.dot(heading), 25.0 / G, 1e-9, &format!("C14 distance at {angle:.2} rad [m]"));
        at_most(end.dot(across).abs(), 1e-9, &format!("C14 lateral drift at {angle:.2} rad [m]"));
    }
}

/// A ball of radius 0.1 and mass 1 whose moment of inertia is `roundness` m r^2.
fn ball_of<S: Dimension>(roundness: f64) -> BodySpec<S> {
    body_of::<S>(Some(S::ball(0.1)), 1.0, roundness * 0.01)
}

/// Case C16: sphere (0.4), disc (0.5) and hoop (1.0), v0 = 5, mu = 0.2: 3.571429, 3.333333 and 2.5 m/s.
pub fn a_sliding_ball_ends_rolling_whatever_its_roundness<S: Dimension>() {
    let (mu, v0) = (0.2, 5.0);
    for (k, moment, place) in
        [(0.4, 0.728_120, 3.120_514), (0.5, 0.849_473, 3.539_472), (1.0, 1.274_210, 4.778_287)]
    {
        for dt in [0.1, 0.01] {
            let mut w = world::<S>(events(dt));
            add_floor(&mut w, mu, 0.0);
            add(&mut w, "ball", ball_of(k).at(S::at(0.0, 0.1)).moving(S::at(v0, 0.0)).friction(mu));
            let floor_line =
                |w: &World<S>| speed(w, 1) * 0.1 - S::rate(w.bodies().motion.angular_velocity[1]) * k * 0.01;
            let start = floor_line(&w);
            let (mut leak, mut stops) = (0.0_f64, 0);
            run(&mut w, 2.0, |w, r| {
                leak = leak.max((floor_line(w) - start).abs() / start);
                stops += r.events.slip_stops;
            });
            let (rolling, slip_ends) = (v0 / (1.0 + k), v0 * k / ((1.0 + k) * mu * G));
            let way = v0 * slip_ends - 0.5 * mu * G * slip_ends * slip_ends;
            close(slip_ends, moment, 1e-6, "C16 closed form of the moment [s]");
            close(way, place, 1e-6, "C16 closed form of the place [m]");
            close(speed(&w, 1), rolling, 1e-10, &format!("C16 rolling speed, I = {k} m r^2 [m/s]"));
            let wanted = way + rolling * (2.0 - slip_ends);
            close(S::along(w.bodies().motion.position[1]), wanted, 1e-9, "C16 place at 2 s [m]");
            at_most(leak, 1e-12, "C16 change of angular momentum about the floor line [1]");
            assert_eq!(stops, 1, "slip ends once");
        }
    }
}

/// Case C17: on 30 degrees sphere, disc and hoop roll with g sin/(1 + k) above mu = tan k/(1 + k), and slip below.
pub fn a_ball_on_a_slope_rolls_above_the_slip_threshold_and_slips_below_it<S: Dimension>() {
    let angle = PI / 6.0;
    for (k, limit, pull) in [(0.4, 0.164_957, 3.503_571), (0.5, 0.192_450, 3.27), (1.0, 0.288_675, 2.4525)] {
        let threshold = angle.tan() * k / (1.0 + k);
        close(threshold, limit, 1e-6, "C17 closed form of the threshold [1]");
        close(G * angle.sin() / (1.0 + k), pull, 1e-6, "C17 closed form of the acceleration [m/s^2]");
        for mu in [1.01 * threshold, 0.99 * threshold] {
            let mut w = world::<S>(events(0.05));
            let normal = S::at(angle.sin(), angle.cos());
            add(&mut w, "slope", BodySpec::fixed(S::wall(normal)).friction(mu));
            add(&mut w, "ball", ball_of(k).at(normal * 0.1).friction(mu));
            settle(&mut w, 1.0);
            let v = w.bodies().motion.velocity[1].norm();
            let slip = v + 0.1 * S::rate(w.bodies().motion.angular_velocity[1]);
            if mu > threshold {
                close(v, G * angle.sin() / (1.0 + k), 1e-9, &format!("C17 rolling, I = {k} m r^2 [m/s^2]"));
                at_most(slip.abs(), 1e-9, "C17 slip above the threshold [m/s]");
            } else {
                let wanted = G * (angle.sin() - mu * angle.cos());
                close(v, wanted, 1e-9, &format!("C17 slipping, I = {k} m r^2 [m/s^2]"));
                assert!(slip > 1e-3, "C17: a ball below the threshold slips, slip is {slip} m/s");
            }
        }
    }
}

/// A block on the floor at 5 m/s.
fn braking<S: Dimension>(width: f64, tall: f64, friction: f64, dt: f64) -> World<S> {
    let mut w = world::<S>(events(dt));
    add_floor(&mut w, friction, 0.0);
    let block = BodySpec::heavy(S::block(width, tall), 2.0).at(S::at(0.0, 0.5 * tall)).friction(friction);
    add(&mut w, "block", block.moving(S::at(5.0, 0.0)));
    w
}

/// Case C19: N = m g (1/2 +- mu h_c/w) in front and behind, at any step.
pub fn a_braking_box_presses_harder_in_front<S: Dimension>() {
    let mu = 0.4;
    for dt in [0.1, 0.01] {
        let mut w = braking::<S>(0.4, 0.2, mu, dt);
        settle(&mut w, 0.5);
        let (problem, impulses, _) = w.last_problem();
        let (mut front, mut behind) = (0.0, 0.0);
        for (c, g) in problem.contacts.iter().zip(&impulses.contacts) {
            let arm = if c.a == 1 { c.arm_a } else { c.arm_b };
            if S::along(arm) > 0.0 { front += g.normal } else { behind += g.normal }
        }
        let weight = 2.0 * G;
        close(front / dt, weight * (0.5 + mu * 0.1 / 0.4), 1e-8, "C19 force in front [N]");
        close(behind / dt, weight * (0.5 - mu * 0.1 / 0.4), 1e-8, "C19 force behind [N]");
        close(speed(&w, 1), 5.0 - mu * G * 0.5, 1e-10, "C19 speed [m/s]");
    }
}

/// Case C19: a box tips over its front edge if mu > w/(2 h_c).
pub fn a_braking_box_tips_when_friction_exceeds_half_its_width_over_the_height_of_its_centre<S: Dimension>() {
    // w = 0.4, h_c = 0.5: the limit is 0.4
    for (mu, tips) in [(0.399, false), (0.401, true)] {
        let mut w = braking::<S>(0.4, 1.0, mu, 0.01);
        settle(&mut w, 1.0);
        let lean = -S::rate(w.bodies().motion.rotation[1].vector());
        if tips {
            assert!(lean > 1e-3, "C19: friction {mu} tips the box, it leans by {lean} rad");
        } else {
            at_most(lean.abs(), 1e-9, "C19 lean of a box that must not tip [rad]");
            close(speed(&w, 1), 5.0 - mu * G, 1e-10, "C19 speed of a box that must not tip [m/s]");
        }
    }
}

/// Case C20: the pair's coefficient by each rule decides the deceleration.
pub fn mixing_rules_decide_the_deceleration<S: Dimension>() {
    let (own, floor) = (0.2_f64, 0.8);
    for (rule, mu) in [
        (Mixing::Min, 0.2),
        (Mixing::Max, 0.8),
        (Mixing::Mean, 0.5),
        (Mixing::Product, own * floor),
        (Mixing::Geometric, (own * floor).sqrt()),
        (Mixing::Harmonic, 2.0 * own * floor / (own + floor)),
    ] {
        let mut w = world::<S>(Settings { friction_mixing: rule, ..events(0.05) });
        add_floor(&mut w, floor, 0.0);
        let block = BodySpec::heavy(S::block(0.8, 0.2), 2.0).at(S::at(0.0, 0.1)).friction(own);
        add(&mut w, "block", block.moving(S::at(5.0, 0.0)));
        settle(&mut w, 0.5);
        close(speed(&w, 1), 5.0 - mu * G * 0.5, 1e-10, &format!("C20 speed under {rule:?} [m/s]"));
    }
}

/// Case C22: M = 3, m = 1, 30 degrees, no friction: A = 1.307032, N = 7.842193, a_rel = 6.036923.
pub fn a_block_on_a_moving_wedge_presses_and_slides_by_the_closed_form<S: Wedge>() {
    let angle = PI / 6.0;
    let (mass, block) = (3.0, 1.0);
    let (s, c) = angle.sin_cos();
    let pull = block * G * s * c / (mass + block * s * s);
    let (press, relative) = (mass * pull / s, G * s + pull * c);
    for (got, wanted) in [(pull, 1.307_032), (press, 7.842_193), (relative, 6.036_923)] {
        close(got, wanted, 1e-6, "C22 closed form");
    }
    let mut w = block_on_wedge::<S>(events(0.025));
    let time = 0.25;
    settle(&mut w, time);
    let v = &w.bodies().motion.velocity;
    close(-S::along(v[1]) / time, pull, 1e-9, "C22 acceleration of the wedge [m/s^2]");
    close((v[2] - v[1]).norm() / time, relative, 1e-9, "C22 relative acceleration [m/s^2]");
    close(normal_force(&w, 1, 2), press, 1e-8, "C22 normal force [N]");
}
