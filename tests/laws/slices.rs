//! The plane is a slice of space: a scene that moves in one plane moves as its planar twin (item 46). Bodies get the
//! same mass and moment in both; the solves differ in order and number of contacts, so runs agree to what the
//! solver's tolerance leaves, amplified by the motion.

use crate::harness::*;
use carom::{BodySpec, ImpactLaw, Integrator, Planar, Settings, Spatial, World};

/// Place, height, turning rate of every body.
fn picture<S: Dimension>(w: &World<S>) -> Vec<[f64; 3]> {
    let m = &w.bodies().motion;
    let one = |i: usize| [S::along(m.position[i]), S::up(m.position[i]), S::rate(m.angular_velocity[i])];
    (0..w.bodies().len()).map(one).collect()
}

/// The same scene in the plane and in space.
type Twins = (fn() -> World<Planar>, fn() -> World<Spatial>);

/// Largest difference of the two pictures while a scene runs in both spaces.
fn difference(build: Twins, time: f64) -> f64 {
    let (mut plane, mut space) = (build.0(), build.1());
    let steps = (time / plane.settings().dt).round() as usize;
    let mut worst: f64 = 0.0;
    for _ in 0..steps {
        step(&mut plane);
        step(&mut space);
        for (a, b) in picture(&plane).iter().zip(picture(&space)) {
            worst = a.iter().zip(b).fold(worst, |m, (x, y)| m.max((x - y).abs()));
        }
        // nothing leaves the plane
        for v in &space.bodies().motion.velocity {
            worst = worst.max(v[1].abs());
        }
    }
    worst
}

/// A ball that slides, spins and bounces on the floor.
fn bouncing_ball<S: Dimension>(integrator: Integrator) -> World<S> {
    let mut w = world::<S>(Settings { integrator, ..exact(1.0 / 240.0) });
    add_floor(&mut w, 0.3, 0.0);
    let ball = body_of::<S>(Some(S::ball(0.1)), 1.0, 0.004).at(S::at(0.0, 0.5)).moving(S::at(2.0, 0.0));
    add(&mut w, "ball", ball.spinning(S::turn(30.0)).friction(0.3).restitution(0.7));
    w
}

/// A block that lands on its corner and comes to rest.
fn tumbling_block<S: Dimension>() -> World<S> {
    let mut w = world::<S>(exact(1.0 / 240.0));
    add_floor(&mut w, 0.5, 0.0);
    let shape = S::block(0.4, 0.2);
    let block = body_of::<S>(Some(shape), 1.0, 0.2 / 12.0).at(S::at(0.0, 0.6)).turned(leaning::<S>(0.4));
    add(&mut w, "block", block.moving(S::at(1.0, 0.0)).spinning(S::turn(-2.0)));
    w
}

/// Balls that fall on each other between walls.
fn falling_balls<S: Dimension>() -> World<S> {
    let mut w = world::<S>(Settings { impact: Some(ImpactLaw::Sequential), ..exact(1.0 / 240.0) });
    add_floor(&mut w, 0.4, 0.0);
    for side in [1.0, -1.0] {
        let wall = BodySpec::fixed(S::wall(S::at(side, 0.0))).at(S::at(-0.4 * side, 0.0));
        add(&mut w, &format!("wall {side}"), wall.friction(0.4));
    }
    for k in 0..5 {
        let place = S::at(0.03 * f64::from(k % 3) - 0.03, 0.15 + 0.25 * f64::from(k));
        let ball =
            body_of::<S>(Some(S::ball(0.1)), 1.0 + f64::from(k), 0.005 * (1.0 + f64::from(k))).at(place);
        add(&mut w, &format!("ball {k}"), ball.friction(0.4).restitution(0.3));
    }
    w
}

#[test]
fn a_ball_moves_in_space_as_a_disc_moves_in_the_plane() {
    let worst =
        difference((|| bouncing_ball(Integrator::Trapezoid), || bouncing_ball(Integrator::Trapezoid)), 3.0);
    at_most(worst, 1e-9, "ball against disc over 3 s, trapezoid");
    let worst = difference((|| bouncing_ball(Integrator::Rk4), || bouncing_ball(Integrator::Rk4)), 3.0);
    at_most(worst, 1e-9, "ball against disc over 3 s, rk4");
}

#[test]
fn a_brick_tumbles_in_space_as_a_rectangle_tumbles_in_the_plane() {
    let worst = difference((tumbling_block, tumbling_block), 2.0);
    // four corners against two: the same wrench to 1e-12 m/s, amplified by a few landings
    at_most(worst, 1e-6, "brick against rectangle over 2 s");
}

#[test]
fn balls_that_fall_on_each_other_do_so_alike_in_both() {
    let worst = difference((falling_balls, falling_balls), 0.6);
    // each impact amplifies a difference by about the ratio of the way between impacts to the radius
    at_most(worst, 1e-6, "falling balls over .6 s");
}
