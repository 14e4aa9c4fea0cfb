//! A failed step names the body and leaves every bit of the world as it was; wrong input is refused where it
//! enters, with body, field, value and remedy.

use crate::harness::*;
use crate::laws::determinism::heap;
use carom::{
    BodySpec, Column, MassProperties, MassSource, Motion, Settings, SolverKind, StepError, World, Wrench,
};

in_plane_and_space!(
    a_step_that_fails_leaves_the_world_as_it_was,
    a_step_after_a_failed_one_goes_on_as_if_nothing_had_happened,
    a_force_field_that_fails_is_named,
    an_impossible_step_length_is_refused,
    a_body_that_cannot_be_is_refused_with_its_field,
    a_setting_out_of_range_is_refused_with_its_name,
    a_name_that_nobody_has_is_answered_with_the_nearest,
);

/// A heap in the middle of its collisions.
fn busy<S: Dimension>() -> World<S> {
    let mut w = heap::<S>(Settings::default());
    settle(&mut w, 0.5);
    w
}

/// Makes the next step of a world fail.
type Spoil<S> = fn(&mut World<S>);

/// Whatever goes wrong, the world stays: state, time, warm starts, ledger, contacts, forces that wait.
pub fn a_step_that_fails_leaves_the_world_as_it_was<S: Dimension>() {
    let spoil: [(&str, Spoil<S>); 6] = [
        ("body4", |w| w.motion_mut().velocity[6] = S::Vector::from_fn(|_| f64::NAN)),
        ("body0", |w| w.motion_mut().position[2] = S::Vector::from_fn(|_| f64::INFINITY)),
        ("body1", |w| w.motion_mut().angular_velocity[3] = S::Spin::from_fn(|_| f64::NAN)),
        ("body2", |w| w.apply_wrench(4, Wrench { force: S::at(f64::NAN, 0.0), torque: S::Spin::ZERO })),
        ("body3", |w| w.motion_mut().velocity[5] = S::at(1e300, 1e300)),
        ("direct", |w| {
            let settings = Settings { solver: Some(SolverKind::Direct), ..w.settings().clone() };
            w.set_settings(settings).expect("possible");
            // two bricks in one place: redundant contacts, of which turning closes some
            let m = w.motion_mut();
            (m.position[3], m.rotation[3]) = (m.position[4], m.rotation[4]);
            (m.velocity[3], m.velocity[4]) = (S::Vector::ZERO, S::Vector::ZERO);
            (m.angular_velocity[3], m.angular_velocity[4]) = (S::turn(1.0), S::Spin::ZERO);
        }),
    ];
    for (named, spoil) in spoil {
        let mut w = busy::<S>();
        spoil(&mut w);
        let (before, contacts, moved) = (w.snapshot(), w.touches().to_vec(), bits(&w));
        let error = w.step(1.0 / 240.0).expect_err("the step cannot be taken");
        assert!(error.to_string().contains(named), "{error} should name {named}");
        assert_eq!(bits(&w), moved, "after: {error}");
        assert_eq!(w.snapshot(), before, "after: {error}");
        assert_eq!(w.touches(), contacts, "after: {error}");
    }
}

/// A refused step costs nothing: the run goes on to the same bits.
pub fn a_step_after_a_failed_one_goes_on_as_if_nothing_had_happened<S: Dimension>() {
    let mut w = busy::<S>();
    let mut twin = busy::<S>();
    let good = w.bodies().motion.velocity[4];
    w.motion_mut().velocity[4] = S::Vector::from_fn(|_| f64::NAN);
    assert!(w.step(1.0 / 240.0).is_err());
    w.motion_mut().velocity[4] = good;
    settle(&mut w, 0.3);
    settle(&mut twin, 0.3);
    assert_eq!(bits(&w), bits(&twin));
}

/// A field that returns NaN is named with the body; the world stays.
pub fn a_force_field_that_fails_is_named<S: Dimension>() {
    let mut w = busy::<S>();
    let moved = bits(&w);
    let broken = |_: f64, _: &Motion<S>, out: &mut [Wrench<S>]| out[5].force = S::at(f64::NAN, 0.0);
    w.set_force_field("wind", Box::new(broken));
    let error = w.step(1.0 / 240.0).expect_err("NaN");
    assert!(matches!(&error, StepError::ForceField { field, .. } if field == "wind"), "{error}");
    assert!(error.to_string().contains("body3"), "{error}");
    assert_eq!(bits(&w), moved);
    assert!(w.remove_force_field("wind"));
    step(&mut w);
}

/// dt must be finite and positive.
pub fn an_impossible_step_length_is_refused<S: Dimension>() {
    let mut w = busy::<S>();
    let moved = bits(&w);
    for dt in [0.0, -0.01, f64::NAN, f64::INFINITY] {
        let error = w.step(dt).expect_err("impossible").to_string();
        assert!(error.contains("dt") && error.contains("must be > 0"), "{error}");
        assert_eq!(bits(&w), moved);
    }
}

/// Ten ways to describe a body that cannot be.
pub fn a_body_that_cannot_be_is_refused_with_its_field<S: Dimension>() {
    let ball = || BodySpec::<S>::dense(S::ball(0.1), 1000.0);
    let given =
        |inertia: S::Inertia| MassProperties { mass: 1.0, center: S::Vector::ZERO, inertia, error: 0.0 };
    let cases: Vec<(&str, &str, BodySpec<S>)> = vec![
        ("mass", "nan", BodySpec::heavy(S::ball(0.1), f64::NAN)),
        ("mass", "-2", BodySpec::heavy(S::ball(0.1), -2.0)),
        ("density", "0", BodySpec::dense(S::ball(0.1), 0.0)),
        ("radius", "-0.1", BodySpec::dense(S::ball(-0.1), 1000.0)),
        ("position", "nan", ball().at(S::at(f64::NAN, 0.0))),
        ("friction", "-0.5", ball().friction(-0.5)),
        ("restitution", "1.5", ball().restitution(1.5)),
        ("linear_damping", "-1", ball().damped(-1.0, 0.0)),
        ("velocity", "fixed", BodySpec::fixed(S::floor()).moving(S::at(1.0, 0.0))),
        ("inertia", "> 0", BodySpec::given(Some(S::ball(0.1)), given(S::moment_of(-1.0)))),
        ("density", "shape", BodySpec { shape: None, mass: MassSource::Density(1.0), ..ball() }),
    ];
    for (field, value, spec) in cases {
        let mut w = world::<S>(Settings::default());
        add(&mut w, "floor", BodySpec::fixed(S::floor()));
        let error = w.add("crate3", spec).expect_err(field).to_string().to_lowercase();
        assert!(error.contains("body 'crate3'"), "{error}");
        assert!(error.contains(field) && error.contains(value), "{error} should name {field} and {value}");
        assert_eq!(w.bodies().len(), 1, "nothing is added: {error}");
    }
    let mut w = world::<S>(Settings::default());
    add(&mut w, "a", ball());
    assert!(w.add("a", ball()).unwrap_err().to_string().contains("taken"));
    assert!(w.add("", ball()).unwrap_err().to_string().contains("empty"));
}

/// Settings are checked when they are set; the old ones stay.
pub fn a_setting_out_of_range_is_refused_with_its_name<S: Dimension>() {
    let bad: [(&str, Settings<S>); 7] = [
        ("gravity", Settings { gravity: S::at(f64::NAN, 0.0), ..Settings::default() }),
        ("dt", Settings { dt: 0.0, ..Settings::default() }),
        ("iterations", Settings { iterations: 0, ..Settings::default() }),
        ("tolerance", Settings { tolerance: -1.0, ..Settings::default() }),
        ("rest_speed_factor", Settings { rest_speed_factor: f64::NAN, ..Settings::default() }),
        ("correction_fraction", Settings { correction_fraction: 1.5, ..Settings::default() }),
        ("contact_margin", Settings { contact_margin: Some(f64::INFINITY), ..Settings::default() }),
    ];
    for (name, settings) in bad {
        let error = World::new(settings.clone()).err().expect(name).to_string();
        assert!(error.contains(name), "{error}");
        let mut w = world::<S>(Settings::default());
        assert!(w.set_settings(settings).is_err());
        assert_eq!(*w.settings(), Settings::default());
    }
}

/// A misspelt name gets a suggestion.
pub fn a_name_that_nobody_has_is_answered_with_the_nearest<S: Dimension>() {
    let w = heap::<S>(Settings::default());
    let error = w.index("bodi7").expect_err("nobody").to_string();
    assert!(error.contains("did you mean 'body7'"), "{error}");
}
