//! Single impacts in a world: cases C6 to C9, items 17 and 18, and the energy of impacts (theory chapter 3 and
//! section 6.1). What the fixed step allows: a bounce happens at the start of the step in which the bodies would
//! meet, up to h early and up to h |u| too high; its velocities are exact.

use crate::harness::*;
use carom::{BodySpec, Column, ImpactLaw, Integrator, MassProperties, PositionCorrection, Settings, World};

in_plane_and_space!(
    a_dropped_ball_bounces_at_the_times_of_the_closed_form,
    its_apexes_fall_by_the_square_of_restitution,
    a_bounce_reverses_the_normal_velocity_by_restitution_exactly,
    a_thousand_elastic_bounces_keep_the_energy,
    a_frictionless_superball_keeps_its_spin,
    a_stacked_drop_throws_the_light_ball_up,
    the_simultaneous_law_keeps_touching_balls_together,
    two_free_bodies_exchange_momentum_and_nothing_else,
    a_fixed_obstacle_takes_what_momentum_it_must,
    a_slow_impact_does_not_bounce,
    an_oblique_impact_with_friction_cannot_make_energy,
    restitution_acts_on_the_velocity_before_gravity,
    a_moving_wall_bounces_in_its_own_frame,
);

/// A world with a floor and a ball of radius .1 whose lowest point is at a height.
fn drop<S: Dimension>(restitution: f64, height: f64, dt: f64, integrator: Integrator) -> World<S> {
    let mut w = world::<S>(Settings { integrator, ..exact(dt) });
    add_floor(&mut w, 0.0, 0.0);
    let ball = BodySpec::dense(S::ball(0.1), 1000.0).at(S::at(0.0, height + 0.1)).friction(0.0);
    add(&mut w, "ball", ball.restitution(restitution));
    w
}

/// Vertical velocity of body 1.
fn climb<S: Dimension>(w: &World<S>) -> f64 {
    S::up(w.bodies().motion.velocity[1])
}

/// Case C6, times. A bounce is up to h early, and the flight after it starts up to h |u| too high.
pub fn a_dropped_ball_bounces_at_the_times_of_the_closed_form<S: Dimension>() {
    let dt = 1e-3;
    for (restitution, last) in [(0.5_f64, 1.354_571), (0.8, 4.063_713), (0.9, 8.578_949)] {
        let mut w = drop::<S>(restitution, 1.0, dt, Integrator::Trapezoid);
        let (mut hits, mut before, mut rest_at) = (Vec::new(), 0.0, 0.0);
        run(&mut w, last + 1.0, |w, r| {
            if before < 0.0 && climb(w) > 0.0 {
                hits.push(r.time - dt);
            }
            if climb(w).abs() > 1e-9 {
                rest_at = r.time;
            }
            before = climb(w);
        });
        close(hits[0], 0.451_523_6, dt, &format!("C6 first hit, e = {restitution} [s]"));
        // each of the bounces is off by at most h in time and by 2 h in the flight that its height adds; the rest
        // cut at 2 g h leaves out the last 4 h/(1 - e)
        let bound = dt * (3.0 * hits.len() as f64 + 4.0 / (1.0 - restitution));
        close(rest_at, last, bound, &format!("C6 at rest, e = {restitution} [s]"));
    }
}

/// Case C6, apexes: e^2n, raised at each bounce by (1 - e^2) of the height at which it happened, at most h |u|.
pub fn its_apexes_fall_by_the_square_of_restitution<S: Dimension>() {
    for dt in [4e-3, 1e-3] {
        for restitution in [0.5_f64, 0.8, 0.9] {
            let mut w = drop::<S>(restitution, 1.0, dt, Integrator::Trapezoid);
            let (mut apexes, mut before) = (Vec::new(), -1.0);
            run(&mut w, 2.5, |w, _| {
                let v = climb(w);
                if before > 0.0 && v <= 0.0 {
                    // exact apex of the parabola through the present point
                    apexes.push(height(w, 1) - 0.1 + v * v / (2.0 * G));
                }
                before = v;
            });
            let (mut bound, mut apex) = (0.0, 1.0);
            for (n, got) in apexes.iter().enumerate().take_while(|(_, a)| **a > 0.01) {
                let speed = (2.0 * G * (apex + bound)).sqrt();
                apex *= restitution * restitution;
                bound = restitution * restitution * bound + (1.0 - restitution * restitution) * dt * speed;
                close(
                    *got,
                    apex,
                    bound + 1e-12,
                    &format!("C6 apex {}, e = {restitution}, h = {dt} [m]", n + 1),
                );
                assert!(*got >= apex - 1e-12, "an early bounce is never too low");
            }
        }
    }
}

/// Items 17 and 22: u_n+ = -e u_n-, to rounding, whatever the step.
pub fn a_bounce_reverses_the_normal_velocity_by_restitution_exactly<S: Dimension>() {
    for dt in [0.02, 0.005] {
        for restitution in [0.0, 0.3, 0.7, 1.0] {
            let mut w = world::<S>(weightless(dt));
            add_floor(&mut w, 0.0, 0.0);
            let ball = BodySpec::dense(S::ball(0.1), 1000.0).at(S::at(0.0, 0.25)).moving(S::at(1.0, -3.0));
            add(&mut w, "ball", ball.friction(0.0).restitution(restitution));
            settle(&mut w, 0.2);
            close(climb(&w), 3.0 * restitution, 1e-12, &format!("item 17 rebound, e = {restitution} [m/s]"));
            close(speed(&w, 1), 1.0, 1e-15, "item 17 tangential velocity without friction [m/s]");
        }
    }
}

/// Case C7.
pub fn a_thousand_elastic_bounces_keep_the_energy<S: Dimension>() {
    for integrator in Integrator::ALL.into_iter().filter(|i| flies_exactly(*i)) {
        let mut w = drop::<S>(1.0, 1.0, 0.01, integrator);
        let energy = w.energy().total() - w.bodies().data[1].mass_properties.mass * G * 0.1;
        let start = w.energy().total();
        let (mut bounces, mut worst, mut before, mut highest, mut deepest) =
            (0, 0.0_f64, 0.0, 0.0_f64, 0.0_f64);
        while bounces < 1000 {
            let r = step(&mut w);
            bounces += usize::from(before < 0.0 && climb(&w) > 0.0);
            before = climb(&w);
            worst = worst.max((r.energy.total() - start).abs() / energy);
            highest = highest.max(height(&w, 1) - 0.1);
            deepest = deepest.min(r.deepest.map_or(0.0, |d| d.0));
        }
        at_most(worst, 1e-12, &format!("C7 energy over 1000 bounces, {integrator:?}"));
        // a test of energy needs one of position: never above the start, never in the floor
        at_most(highest - 1.0, 1e-11, "C7 height above the start [m]");
        at_most(-deepest, 1e-11, "C7 overlap [m]");
    }
}

/// Case C8 without friction, which alone turns slips round, whatever is said of them.
pub fn a_frictionless_superball_keeps_its_spin<S: Dimension>() {
    let mut w = drop::<S>(1.0, 0.05, 0.001, Integrator::Trapezoid);
    w.bodies_mut().data[1].tangential_restitution = 1.0;
    w.motion_mut().velocity[1] = S::at(2.0, -1.0);
    w.motion_mut().angular_velocity[1] = S::turn(7.0);
    settle(&mut w, 0.1);
    close(speed(&w, 1), 2.0, 1e-15, "C8 speed along [m/s]");
    close(S::rate(w.bodies().motion.angular_velocity[1]), 7.0, 1e-14, "C8 spin [rad/s]");
    assert!(climb(&w) > 0.0, "it bounced");
}

/// Two balls m1 = 3 below m2 = 1, elastic, falling with a gap between them.
pub fn stacked<S: Dimension>(gap: f64, height: f64, law: ImpactLaw, dt: f64) -> World<S> {
    let mut w = world::<S>(Settings { impact: Some(law), ..exact(dt) });
    add_floor(&mut w, 0.0, 1.0);
    for (name, mass, up) in [("lower", 3.0, height + 0.1), ("upper", 1.0, height + 0.3 + gap)] {
        add(
            &mut w,
            name,
            BodySpec::heavy(S::ball(0.1), mass).at(S::at(0.0, up)).friction(0.0).restitution(1.0),
        );
    }
    w
}

/// Case C9 with a tiny gap: the lower ball stops, the upper one flies to four times the height, with both laws.
pub fn a_stacked_drop_throws_the_light_ball_up<S: Dimension>() {
    for law in ImpactLaw::ALL {
        let (dt, fall) = (1e-3, 1.0);
        let mut w = stacked::<S>(1e-4, fall, law, dt);
        let speed = (2.0 * G * fall).sqrt();
        while S::up(w.bodies().motion.velocity[2]) <= 0.0 {
            step(&mut w);
        }
        let upper = S::up(w.bodies().motion.velocity[2]);
        // bounced up to h early, and the kick of the same step took off g h
        close(upper, 2.0 * speed, 3.0 * G * dt, &format!("C9 upper ball, {law:?} [m/s]"));
        close(
            S::up(w.bodies().motion.velocity[1]),
            0.0,
            3.0 * G * dt,
            &format!("C9 lower ball, {law:?} [m/s]"),
        );
        let mut apex: f64 = 0.0;
        run(&mut w, 1.0, |w, _| apex = apex.max(S::up(w.bodies().motion.position[2]) - 0.3));
        // 2 v within 3 g h changes the apex by 4 v/g times that
        close(
            apex,
            4.0 * fall,
            4.0 * speed / G * 3.0 * G * dt,
            &format!("C9 apex of the upper ball, {law:?} [m]"),
        );
        at_most((w.ledger().impact_normal / w.energy().total()).abs(), 1e-13, "C9 energy lost by impacts");
    }
}

/// Case C9, touching: the simultaneous law sends both up at one speed.
pub fn the_simultaneous_law_keeps_touching_balls_together<S: Dimension>() {
    for law in ImpactLaw::ALL {
        let passes_on = matches!(law, ImpactLaw::GeneralizedReflections | ImpactLaw::Sequential);
        let (lower, upper) = if passes_on { (0.0, 2.0) } else { (1.0, 1.0) };
        let mut w = stacked::<S>(0.0, 0.0, law, 1e-3);
        w.set_settings(Settings { gravity: S::Vector::ZERO, ..w.settings().clone() }).expect("possible");
        w.motion_mut().velocity[1] = S::at(0.0, -1.0);
        w.motion_mut().velocity[2] = S::at(0.0, -1.0);
        step(&mut w);
        // solver tolerance 1e-12
        close(
            S::up(w.bodies().motion.velocity[1]),
            lower,
            1e-11,
            &format!("C9 touching, lower ball, {law:?} [m/s]"),
        );
        close(
            S::up(w.bodies().motion.velocity[2]),
            upper,
            1e-11,
            &format!("C9 touching, upper ball, {law:?} [m/s]"),
        );
    }
}

/// Item 18: body against body, off centre and with friction; and the loss is that of the closed form without it.
pub fn two_free_bodies_exchange_momentum_and_nothing_else<S: Dimension>() {
    for (friction, restitution) in [(0.0, 0.6), (0.4, 0.6), (0.4, 0.0)] {
        let mut w =
            world::<S>(Settings { position_correction: PositionCorrection::None, ..weightless(0.01) });
        let one = BodySpec::heavy(S::block(0.4, 0.2), 2.0).moving(S::at(1.0, 0.2)).spinning(S::turn(0.5));
        let other = BodySpec::heavy(S::ball(0.15), 1.0).at(S::at(0.37, 0.05)).moving(S::at(-2.0, 0.1));
        add(&mut w, "one", one.friction(friction).restitution(restitution));
        add(&mut w, "other", other.friction(friction).restitution(restitution));
        let (before, energy) = (w.momenta(), w.energy().total());
        settle(&mut w, 0.1);
        let after = w.momenta();
        assert!(speed(&w, 1) > -2.0, "they met");
        at_most((after.linear - before.linear).norm(), 1e-14, "item 18 momentum [kg m/s]");
        at_most((after.angular - before.angular).norm(), 1e-14, "item 18 angular momentum [kg m^2/s]");
        assert!(w.energy().total() < energy, "an inelastic impact loses energy");
    }
}

/// Item 17: what the obstacle gives is the impulse, and nothing turns a ball hit without friction.
pub fn a_fixed_obstacle_takes_what_momentum_it_must<S: Dimension>() {
    let mut w = world::<S>(weightless(0.01));
    add(&mut w, "post", BodySpec::fixed(S::block(0.2, 1.0)).friction(0.0));
    let ball = BodySpec::heavy(S::ball(0.1), 2.0).at(S::at(-0.25, 0.1)).moving(S::at(3.0, 1.0)).friction(0.0);
    add(&mut w, "ball", ball.restitution(0.5));
    settle(&mut w, 0.1);
    close(speed(&w, 1), -1.5, 1e-12, "item 17 rebound from the post [m/s]");
    close(climb(&w), 1.0, 1e-12, "item 17 along the post [m/s]");
    assert_eq!(w.bodies().motion.position[0], S::Vector::ZERO);
}

/// Item 22: below the rest speed k g h there is no bounce, and the energy taken is on the ledger's line for it.
pub fn a_slow_impact_does_not_bounce<S: Dimension>() {
    let dt = 0.01;
    let mut w = drop::<S>(0.9, 0.0, dt, Integrator::Trapezoid);
    w.motion_mut().velocity[1] = S::at(0.0, -1.5 * G * dt);
    let energy = w.energy().kinetic();
    step(&mut w);
    close(climb(&w), 0.0, 1e-12, "velocity after the rest cut [m/s]");
    close(w.ledger().rest_cut, -energy, 1e-12 * energy, "the rest cut's line [J]");
    settle(&mut w, 1.0);
    close(height(&w, 1), 0.1, 1e-12, "height of the ball at rest [m]");
}

/// A rod of length 1 and mass 1 at 45 degrees, its lower end on the floor: Newton's restitution with Coulomb's
/// friction would gain .1125 J (theory section 3.6); the guard's law gives gamma = (.8, 0) and no gain.
pub fn an_oblique_impact_with_friction_cannot_make_energy<S: Dimension>() {
    let tip = 1e-3; // the end is a small ball; arms are those of the bare rod
    let half = 0.5 * 0.5_f64.sqrt();
    let properties = MassProperties {
        mass: 1.0,
        center: S::at(half, half - tip),
        inertia: S::moment_of(1.0 / 12.0),
        error: 0.0,
    };
    let rod = BodySpec::given(Some(S::ball(tip)), properties).at(S::at(0.0, half)).moving(S::at(0.6, -1.0));
    let mut w = world::<S>(weightless(1e-6));
    add_floor(&mut w, 0.4, 1.0);
    add(&mut w, "rod", rod.friction(0.4).restitution(1.0));
    let energy = w.energy().total();
    close(energy, 0.68, 1e-15, "energy before [J]");
    step(&mut w);
    close(w.energy().total(), energy, 1e-12, "energy after the guarded impact [J]");
    let strike = w.last_strikes()[0];
    close(strike.normal, 0.8, 1e-9, "normal impulse of Moreau's law [N s]");
    at_most(strike.tangent.norm(), 1e-9, "tangential impulse of Moreau's law [N s]");
}

/// Item 22: a ball that rests, whatever its restitution, stays where it is.
pub fn restitution_acts_on_the_velocity_before_gravity<S: Dimension>() {
    for integrator in Integrator::ALL {
        let mut w = drop::<S>(1.0, 0.0, 0.01, integrator);
        settle(&mut w, 5.0);
        close(height(&w, 1), 0.1, 1e-12, &format!("height after 500 steps at rest, {integrator:?} [m]"));
        at_most(climb(&w).abs(), 1e-12, &format!("velocity at rest, {integrator:?} [m/s]"));
    }
}

/// A kinematic wall drives what it hits: v' = 2 V - v for e = 1, its work on the ledger's line.
pub fn a_moving_wall_bounces_in_its_own_frame<S: Dimension>() {
    let mut w = world::<S>(weightless(0.01));
    let wall = BodySpec::kinematic(S::wall(S::at(1.0, 0.0))).moving(S::at(0.5, 0.0));
    add(&mut w, "wall", wall.friction(0.0));
    let ball = BodySpec::heavy(S::ball(0.1), 2.0).at(S::at(0.3, 0.0)).moving(S::at(-1.0, 0.0));
    add(&mut w, "ball", ball.friction(0.0).restitution(1.0));
    let energy = w.energy().total();
    settle(&mut w, 0.5);
    close(speed(&w, 1), 2.0, 1e-12, "speed after the wall [m/s]");
    close(w.ledger().driven, w.energy().total() - energy, 1e-12, "work of the driven wall [J]");
    at_most(w.ledger().impact_normal.abs(), 1e-12, "work of the impact in the wall's frame [J]");
}
