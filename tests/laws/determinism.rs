//! The same scene gives the same bits (docs/adr/0005). Another process is tried by the Python tests.

use crate::harness::*;
use carom::{BodySpec, Column, ImpactLaw, Integrator, PositionCorrection, Settings, SolverKind, World};

in_plane_and_space!(
    the_same_scene_gives_the_same_bits_twice,
    an_integrator_or_law_of_another_name_gives_other_bits,
    a_scene_moved_far_away_moves_alike,
    a_mirrored_scene_gives_the_mirrored_motion,
    groups_decide_who_collides,
    a_removed_body_no_longer_acts,
);

/// A heap with everything in it: boxes and balls, restitution, friction, spin, a wall that moves.
pub fn heap<S: Dimension>(settings: Settings<S>) -> World<S> {
    let mut w = world::<S>(settings);
    add_floor(&mut w, 0.5, 0.3);
    let wall = BodySpec::kinematic(S::wall(S::at(1.0, 0.0))).at(S::at(-1.5, 0.0)).moving(S::at(0.3, 0.0));
    add(&mut w, "pusher", wall.friction(0.2));
    let mut dice = Dice(11);
    for k in 0..12 {
        let place = S::at(dice.between(-1.0, 1.0), 0.4 + 0.35 * f64::from(k));
        let spec = if k % 3 == 0 {
            BodySpec::dense(S::ball(0.15), 800.0).restitution(0.4)
        } else {
            BodySpec::dense(S::block(0.3, 0.2), 900.0).turned(leaning::<S>(dice.between(-1.0, 1.0)))
        };
        let spec = spec
            .at(place)
            .moving(S::at(dice.between(-1.0, 1.0), 0.0))
            .spinning(S::turn(dice.between(-3.0, 3.0)));
        add(&mut w, &format!("body{k}"), spec.friction(0.4).damped(0.05, 0.1));
    }
    w
}

/// Case C33: the same run twice, for every integrator, impact law and position correction.
pub fn the_same_scene_gives_the_same_bits_twice<S: Dimension>() {
    for integrator in Integrator::ALL {
        for impact in [ImpactLaw::Newton, ImpactLaw::Sequential] {
            for position_correction in [PositionCorrection::Nudge, PositionCorrection::SplitImpulse] {
                let settings =
                    Settings { integrator, impact: Some(impact), position_correction, ..Settings::default() };
                let once = || {
                    let mut w = heap::<S>(settings.clone());
                    settle(&mut w, 0.5);
                    bits(&w)
                };
                assert_eq!(once(), once(), "{integrator:?}, {impact:?}, {position_correction:?}");
            }
        }
    }
}

/// The settings are not decoration: another choice gives another run.
pub fn an_integrator_or_law_of_another_name_gives_other_bits<S: Dimension>() {
    let run_with = |settings: Settings<S>| {
        let mut w = heap::<S>(settings);
        settle(&mut w, 1.0);
        bits(&w)
    };
    let reference = run_with(Settings::default());
    for other in [
        Settings { integrator: Integrator::SemiImplicitEuler, ..Settings::default() },
        Settings { impact: Some(ImpactLaw::Sequential), ..Settings::default() },
        // the heap's overlaps stay within the usual slop
        Settings { correction_slop: Some(0.0), ..Settings::default() },
        Settings {
            correction_slop: Some(0.0),
            position_correction: PositionCorrection::Nudge,
            ..Settings::default()
        },
        Settings { solver: Some(SolverKind::Sequential), ..Settings::default() },
        Settings { iterations: 3, ..Settings::default() },
    ] {
        assert_ne!(reference, run_with(other.clone()), "{other:?}");
    }
}

/// Where the origin lies is a matter of rounding only.
pub fn a_scene_moved_far_away_moves_alike<S: Dimension>() {
    let fall = |offset: f64| {
        let mut w = world::<S>(exact(1.0 / 240.0));
        let floor = BodySpec::fixed(S::block(6.0, 0.5)).at(S::at(offset, -0.25));
        add(&mut w, "floor", floor);
        let block = BodySpec::heavy(S::block(0.4, 0.2), 1.0).at(S::at(offset, 0.5)).turned(leaning::<S>(0.3));
        let block = add(&mut w, "block", block.moving(S::at(1.0, 0.0)).spinning(S::turn(1.0)));
        settle(&mut w, 0.25);
        w.bodies().motion.position[block] - S::at(offset, 0.0)
    };
    // positions near 2^10 m are rounded to 1e-13 m; the first contacts amplify that
    at_most((fall(1024.0) - fall(0.0)).norm(), 1e-8, "difference of a run 1 km away [m]");
}

/// The mirror image of a scene moves as the mirror image.
pub fn a_mirrored_scene_gives_the_mirrored_motion<S: Dimension>() {
    let thrown = |side: f64| {
        let mut w = world::<S>(exact(1.0 / 240.0));
        add_floor(&mut w, 0.5, 0.3);
        let block =
            BodySpec::heavy(S::block(0.4, 0.2), 1.0).at(S::at(0.0, 0.5)).turned(leaning::<S>(side * 0.3));
        let block = block.moving(S::at(side, 0.0)).spinning(S::turn(side * 2.0)).restitution(0.3);
        let block = add(&mut w, "block", block);
        settle(&mut w, 0.4);
        let m = &w.bodies().motion;
        (S::along(m.position[block]), S::up(m.position[block]), S::rate(m.angular_velocity[block]))
    };
    let ((x, y, spin), (mx, my, mirrored_spin)) = (thrown(1.0), thrown(-1.0));
    // contacts come in another order, so the solves agree to their tolerance, not to the bit
    at_most(
        (x + mx).abs().max((y - my).abs()).max((spin + mirrored_spin).abs()),
        1e-7,
        "asymmetry of a mirrored throw",
    );
}

/// Bodies of groups that do not collide pass through each other; others do not.
pub fn groups_decide_who_collides<S: Dimension>() {
    for (mask, passes) in [(0b01, true), (0b11, false)] {
        let mut w = world::<S>(exact(1.0 / 240.0));
        add(&mut w, "floor", BodySpec::fixed(S::floor()).grouped(0b10, u32::MAX));
        let ball = BodySpec::dense(S::ball(0.1), 1000.0).at(S::at(0.0, 0.2)).grouped(0b01, mask);
        let ball = add(&mut w, "ball", ball);
        settle(&mut w, 0.5);
        assert_eq!(height(&w, ball) < -0.5, passes, "mask {mask:#b}: height {}", height(&w, ball));
    }
}

/// A removed body leaves the others free, and its name may be used again.
pub fn a_removed_body_no_longer_acts<S: Dimension>() {
    let mut w = world::<S>(exact(1.0 / 240.0));
    add_floor(&mut w, 0.5, 0.0);
    let ball = BodySpec::dense(S::ball(0.1), 1000.0).at(S::at(0.0, 0.1));
    add(&mut w, "ball", ball.clone());
    settle(&mut w, 0.1);
    let held = height(&w, 1);
    w.remove("floor").expect("it is there");
    assert_eq!(w.index("ball").expect("it is there"), 0, "indices fall by one");
    settle(&mut w, 0.5);
    close(held - height(&w, 0), 0.5 * G * 0.25, 1e-10, "fall after the floor is gone [m]");
    w.add("floor", BodySpec::fixed(S::floor())).expect("the name is free again");
    assert!(w.remove("flor").unwrap_err().to_string().contains("did you mean 'floor'"));
}
