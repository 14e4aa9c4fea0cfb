//! Rolling and spinning friction with known answers (theory eqs. 3.24 to 3.28): where a rolling ball stops, how a top
//! slows down, on which slope a ball stays, and that friction of moments takes energy only.

use crate::harness::*;
use carom::{BodySpec, Column, Settings, SolverKind, Spatial, World, vec3};

in_plane_and_space!(
    a_rolling_ball_stops_after_v_squared_over_two_a,
    a_ball_stays_on_a_slope_below_the_rolling_angle_and_rolls_above_it,
    a_ball_without_resistance_rolls_on_and_one_with_it_is_the_other_bodys_matter_too,
    rolling_friction_is_a_line_of_friction_in_the_ledger,
    a_snapshot_keeps_coefficients_and_moments,
);

const RADIUS: f64 = 0.3;
const C: f64 = 0.01;

/// A ball that rolls on the floor; the ball has the coefficients.
fn rolling_ball<S: Dimension>(settings: Settings<S>, speed: f64, rolling: f64) -> (World<S>, usize) {
    let mut w = world::<S>(settings);
    add_floor(&mut w, 0.8, 0.0);
    let ball = BodySpec::heavy(S::ball(RADIUS), 2.0).at(S::at(0.0, RADIUS)).friction(0.8);
    let ball = ball.moving(S::at(speed, 0.0)).spinning(S::turn(-speed / RADIUS)).resisting(rolling, 0.0);
    let ball = add(&mut w, "ball", ball);
    (w, ball)
}

/// a = c g / (R (1 + k)) with I = k m R^2: the ball stops after v0^2/(2 a) and at v0/a, and stays; by every solver
/// that knows the law.
pub fn a_rolling_ball_stops_after_v_squared_over_two_a<S: Dimension>() {
    let (dt, speed0) = (1.0 / 240.0, 0.5);
    let a = C * G / (RADIUS * (1.0 + S::ROUNDNESS));
    for solver in [SolverKind::Pgs, SolverKind::Nncg, SolverKind::Apgd, SolverKind::Exact] {
        let (mut w, ball) = rolling_ball::<S>(Settings { solver: Some(solver), ..exact(dt) }, speed0, C);
        let mut stopped = f64::INFINITY;
        run(&mut w, 1.3 * speed0 / a, |w, r| {
            if speed(w, ball).abs() < 1e-10 {
                stopped = stopped.min(r.time);
            }
            let slip = speed(w, ball) + RADIUS * S::rate(w.bodies().motion.angular_velocity[ball]);
            assert!(slip.abs() < 1e-9, "slip {slip}");
        });
        let distance = speed0 * speed0 / (2.0 * a);
        // it stops inside a step
        let way = S::along(w.bodies().motion.position[ball]);
        close(way, distance, a * dt * dt / 8.0 + 1e-9, &format!("stopping distance, {} [m]", solver.name()));
        close(stopped, speed0 / a + 0.5 * dt, 0.5 * dt + 1e-9, "stopping time [s]");
    }
}

/// The weight's moment about the contact, m g R sin, against c m g cos: the ball stays while tan <= c/R.
pub fn a_ball_stays_on_a_slope_below_the_rolling_angle_and_rolls_above_it<S: Dimension>() {
    let c = 0.05;
    for share in [0.98, 1.02] {
        let angle = (share * c / RADIUS).atan();
        let mut w = world::<S>(exact(1.0 / 240.0));
        let normal = S::at(angle.sin(), angle.cos());
        // the slope has the coefficient: the larger of both counts
        add(&mut w, "slope", BodySpec::fixed(S::wall(normal)).friction(0.9).resisting(c, 0.0));
        let ball = BodySpec::heavy(S::ball(RADIUS), 1.0).at(normal * RADIUS).friction(0.9);
        let ball = add(&mut w, "ball", ball);
        settle(&mut w, 2.0);
        let v = w.bodies().motion.velocity[ball].norm();
        let drive = G * (angle.sin() - c / RADIUS * angle.cos()) / (1.0 + S::ROUNDNESS);
        close(v, f64::max(0.0, 2.0 * drive), 1e-8, &format!("speed after 2 s at {share} of the angle [m/s]"));
    }
}

/// Without the coefficient nothing changes: the ball rolls on for ever at its speed.
pub fn a_ball_without_resistance_rolls_on_and_one_with_it_is_the_other_bodys_matter_too<S: Dimension>() {
    let (mut w, ball) = rolling_ball::<S>(exact(1.0 / 240.0), 0.5, 0.0);
    settle(&mut w, 1.0);
    close(speed(&w, ball), 0.5, 1e-12, "speed without rolling friction [m/s]");
    assert!(w.last_problem().0.resistances.is_empty(), "the common path carries no resistance");
    let (mut w, _) = rolling_ball::<S>(exact(1.0 / 240.0), 0.5, C);
    settle(&mut w, 0.1);
    assert_eq!(w.last_problem().0.resistances.len(), 1);
}

/// The kinetic energy that goes is friction's line, to the last digits, and the ledger closes.
pub fn rolling_friction_is_a_line_of_friction_in_the_ledger<S: Dimension>() {
    let (mut w, _) = rolling_ball::<S>(exact(1.0 / 240.0), 0.5, C);
    let before = w.energy().kinetic();
    run(&mut w, 1.0, |_, r| at_most(r.ledger.friction.max(0.0), 1e-15, "friction's gain in a step [J]"));
    let lost = before - w.energy().kinetic();
    assert!(lost > 0.1 * before, "rolling friction took {lost} of {before} J");
    close(w.ledger().friction, -lost, 1e-10 * before, "friction's line [J]");
}

/// A world read back goes on with the same bits, the warm start of its moments included.
pub fn a_snapshot_keeps_coefficients_and_moments<S: Dimension>() {
    let settings = Settings { iterations: 3, ..exact(1.0 / 240.0) };
    let (mut w, _) = rolling_ball::<S>(settings, 0.5, C);
    settle(&mut w, 0.1);
    let (mut twin, _) = World::<S>::from_snapshot(&w.snapshot()).expect("its own snapshot");
    settle(&mut w, 0.2);
    settle(&mut twin, 0.2);
    assert_eq!(bits(&w), bits(&twin));
}

/// A ball that spins about its normal loses spinning m g / I per second and stops; it does not wander.
#[test]
fn a_top_slows_down_with_the_moment_spinning_times_the_weight() {
    let (dt, s, spin0, mass) = (1.0 / 240.0, 0.01, 10.0, 2.0);
    let mut w = world::<Spatial>(exact(dt));
    add_floor(&mut w, 0.5, 0.0);
    let ball = BodySpec::heavy(carom::SpatialShape::Sphere { radius: RADIUS }, mass);
    let ball = ball.at(vec3(0.0, 0.0, RADIUS)).spinning(vec3(0.0, 0.0, spin0)).resisting(0.0, s);
    let ball = add(&mut w, "ball", ball);
    let slowing = s * mass * G / (0.4 * mass * RADIUS * RADIUS);
    run(&mut w, 1.3 * spin0 / slowing, |w, r| {
        let wanted = f64::max(0.0, spin0 - slowing * r.time);
        let spin = w.bodies().motion.angular_velocity[ball];
        assert!((spin[2] - wanted).abs() < 1e-9, "spin {} of {wanted} at t = {}", spin[2], r.time);
        assert!(spin[0].abs() + spin[1].abs() < 1e-12);
    });
    at_most((w.bodies().motion.position[ball] - vec3(0.0, 0.0, RADIUS)).norm(), 1e-9, "way of the top [m]");
}
