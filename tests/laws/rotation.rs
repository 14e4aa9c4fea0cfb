//! Free rotation against closed forms and against itself: cases C1 to C3, and what each integrator keeps
//! (theory chapter 2). No contacts.

use crate::harness::*;
use carom::{
    BodySpec, Column, Inertia, Integrator, MassProperties, Planar, Quaternion, Rotation, Spatial, Sym3, Vec3,
    World, vec1, vec3,
};

/// A body without shape that floats and turns.
fn top(moments: [f64; 3], spin: Vec3) -> BodySpec<Spatial> {
    let inertia = Sym3::diag(moments[0], moments[1], moments[2]);
    BodySpec::given(None, MassProperties { mass: 1.0, center: vec3(0.0, 0.0, 0.0), inertia, error: 0.0 })
        .spinning(spin)
}

fn floating(spec: BodySpec<Spatial>, integrator: Integrator, dt: f64) -> World<Spatial> {
    let mut settings = weightless(dt);
    settings.integrator = integrator;
    let mut w = world(settings);
    add(&mut w, "top", spec);
    w
}

/// Attitude after a time, for a body that starts unturned.
fn attitude(moments: [f64; 3], spin: Vec3, integrator: Integrator, dt: f64, time: f64) -> Quaternion {
    let mut w = floating(top(moments, spin), integrator, dt);
    settle(&mut w, time);
    w.bodies().motion.rotation[0]
}

/// C2's body: tumbling about its middle axis.
const TUMBLING: ([f64; 3], Vec3) = ([1.0, 2.0, 3.0], vec3(0.1, 1.0, 0.1));

/// Attitude errors of a body with I = (1, 2, 3) at a time, for steps .02, .01, .005, against rk4 with h = .00125 (its
/// own error is near 1e-12: it differs by 2e-12 from that with twice the step).
fn attitude_errors(integrator: Integrator, spin: Vec3, time: f64) -> [f64; 3] {
    let reference = attitude(TUMBLING.0, spin, Integrator::Rk4, 1.25e-3, time);
    [0.02, 0.01, 0.005]
        .map(|h| angle_between::<Spatial>(&attitude(TUMBLING.0, spin, integrator, h, time), &reference))
}

/// Attitude of the free symmetric top I = (a, a, c): R = exp(t L/a) R0 exp(t (1/c - 1/a) L3 e3) with R0 = 1
/// (theory eq. 2.24).
fn symmetric_top(a: f64, c: f64, spin: Vec3, t: f64) -> Quaternion {
    let momentum = vec3(a * spin[0], a * spin[1], c * spin[2]);
    let about_its_axis = Quaternion::about(vec3(0.0, 0.0, t * (1.0 / c - 1.0 / a) * momentum[2]));
    about_its_axis.then(&Quaternion::about(momentum * (t / a)))
}

/// Case C1.
#[test]
fn a_symmetric_top_precesses_as_the_closed_form_says() {
    let (a, c, spin) = (0.5, 0.8, vec3(0.3, 0.0, 5.0));
    let momentum = vec3(a * spin[0], a * spin[1], c * spin[2]);
    close(momentum.norm() / a, 8.005_623_023_850, 1e-12, "C1 rate of precession [rad/s]");
    close((c - a) / a * spin[2], 3.0, 1e-14, "C1 rate about its own axis [rad/s]");
    let mut w = floating(top([a, a, c], spin), Integrator::Trapezoid, 0.02);
    let (mut worst, mut cone_error): (f64, f64) = (0.0, 0.0);
    run(&mut w, 100.0, |w, report| {
        let attitude = w.bodies().motion.rotation[0];
        worst = worst.max(angle_between::<Spatial>(&attitude, &symmetric_top(a, c, spin, report.time)));
        let tilt = attitude.rotate(vec3(0.0, 0.0, 1.0)).cross(momentum).norm() / momentum.norm();
        cone_error = cone_error.max((tilt.asin().to_degrees() - 2.147_585).abs());
    });
    // the splitting is exact for symmetric tops: what is left is rounding over 5,000 steps
    at_most(worst, 1e-10, "C1 attitude over 100 s [rad], splitting");
    at_most(cone_error, 1e-6, "C1 cone angle over 100 s [deg]: the reference has seven digits");
}

/// Case C1 for the others: off by what their order allows.
#[test]
fn the_other_integrators_approach_the_symmetric_top_at_their_order() {
    let (a, c, spin) = (0.5, 0.8, vec3(0.3, 0.0, 5.0));
    for (integrator, order) in [
        (Integrator::ExplicitEuler, 1.0),
        (Integrator::SemiImplicitEuler, 1.0),
        (Integrator::ImplicitMidpoint, 2.0),
        (Integrator::Rk4, 4.0),
    ] {
        let error = |h| {
            angle_between::<Spatial>(
                &attitude([a, a, c], spin, integrator, h, 2.0),
                &symmetric_top(a, c, spin, 2.0),
            )
        };
        let measured = (error(4e-3) / error(2e-3)).log2();
        close(measured, order, 0.1, &format!("C1 order of {integrator:?}"));
    }
}

/// Case C2. Explicit Euler has the case's errors; midpoint and splitting are below the case's, for they drift twice
/// by half a step (and the splitting is another one).
#[test]
fn attitude_errors_about_the_middle_axis_are_those_of_the_case() {
    for (integrator, order, stated) in [
        (Integrator::ExplicitEuler, 1.0, [0.176, 0.088, 0.044]),
        (Integrator::Trapezoid, 2.0, [1.14e-4, 2.9e-5, 7.2e-6]),
        (Integrator::ImplicitMidpoint, 2.0, [9.0e-4, 2.25e-4, 5.6e-5]),
    ] {
        let errors = attitude_errors(integrator, TUMBLING.1, 20.0);
        for (error, stated) in errors.iter().zip(stated) {
            // the case states three digits
            at_most(*error, stated * 1.005, &format!("C2 attitude error of {integrator:?} [rad]"));
        }
        for pair in errors.windows(2) {
            close((pair[0] / pair[1]).log2(), order, 0.1, &format!("C2 order of {integrator:?}"));
        }
    }
}

/// The table of theory section 2.8: w = (.4, .3, 1.2), t = 5 s. Semi-implicit Euler keeps L exactly; rk4 is the best.
#[test]
fn each_integrator_converges_at_its_order() {
    for (integrator, order, stated) in [
        (Integrator::ExplicitEuler, 1.0, 2.3e-2),
        (Integrator::SemiImplicitEuler, 1.0, 3.2e-2),
        (Integrator::Trapezoid, 2.0, 6.1e-6),
        (Integrator::ImplicitMidpoint, 2.0, 1.1e-4),
        (Integrator::Rk4, 4.0, 4.4e-8),
    ] {
        let errors = attitude_errors(integrator, vec3(0.4, 0.3, 1.2), 5.0);
        at_most(errors[0], stated, &format!("C2 attitude error of {integrator:?} at h = .02 [rad]"));
        for pair in errors.windows(2) {
            // .1: the next power of h is a few per cent of the error at these steps
            close((pair[0] / pair[1]).log2(), order, 0.1, &format!("C2 order of {integrator:?}"));
        }
    }
}

/// Largest |E/E0 - 1| and ||L - L0||/|L0| over 500 s of tumbling at h = .02.
fn drift(integrator: Integrator) -> (f64, f64) {
    let mut w = floating(top(TUMBLING.0, TUMBLING.1), integrator, 0.02);
    let (energy, momentum) = (w.energy().total(), w.momenta().angular);
    let (mut of_energy, mut of_momentum): (f64, f64) = (0.0, 0.0);
    run(&mut w, 500.0, |_, report| {
        of_energy = of_energy.max((report.energy.total() / energy - 1.0).abs());
        of_momentum = of_momentum.max((report.momenta.angular - momentum).norm() / momentum.norm());
    });
    (of_energy, of_momentum)
}

/// The table of theory section 2.8: what each integrator keeps over 25,000 steps of tumbling.
#[test]
fn each_integrator_keeps_what_the_theory_says_it_keeps() {
    // the state is w, so L is rounded anew twice a step: 50,000 times 1e-16 if all went one way, 5e-12
    let rounding = 1e-12;
    for (integrator, energy, momentum) in [
        (Integrator::SemiImplicitEuler, 2.0, rounding),
        (Integrator::Trapezoid, 1e-6, rounding),
        (Integrator::ImplicitMidpoint, rounding, rounding),
        (Integrator::Rk4, 2e-9, rounding),
    ] {
        let (of_energy, of_momentum) = drift(integrator);
        at_most(of_energy, energy, &format!("energy drift of {integrator:?} over 500 s"));
        at_most(of_momentum, momentum, &format!("drift of L of {integrator:?} over 500 s"));
    }
    let (of_energy, _) = drift(Integrator::ExplicitEuler);
    assert!(
        of_energy > 0.05,
        "the notes' Euler step is not conservative, and yet it kept energy to {of_energy}"
    );
}

/// Case C3, items 1 and 2: the stored numbers stay a rotation, in the plane and in space.
#[test]
fn a_million_steps_leave_rotations_of_unit_length() {
    let mut space = floating(top(TUMBLING.0, TUMBLING.1), Integrator::Trapezoid, 0.02);
    let mut plane = world::<Planar>(weightless(0.02));
    add(&mut plane, "wheel", body_of(None, 1.0, 1.0).spinning(vec1(1.3)));
    let (mut in_space, mut in_plane): (f64, f64) = (0.0, 0.0);
    let length = |q: &[f64]| q.iter().map(|x| x * x).sum::<f64>().sqrt();
    for _ in 0..1_000_000 {
        step(&mut space);
        step(&mut plane);
        in_space = in_space.max((length(&space.bodies().motion.rotation[0].0) - 1.0).abs());
        in_plane = in_plane.max((length(&plane.bodies().motion.rotation[0].0) - 1.0).abs());
    }
    at_most(in_space, 1e-14, "C3 | |q| - 1 | over 1e6 steps in space");
    at_most(in_plane, 1e-14, "C3 | |q| - 1 | over 1e6 steps in the plane");
    let angle = plane.bodies().motion.rotation[0].angle();
    let wanted = (1.3 * 0.02 * 1e6_f64).rem_euclid(std::f64::consts::TAU);
    let off = (angle - wanted).rem_euclid(std::f64::consts::TAU);
    // 2e6 products of unit numbers, each rounded to 1e-16
    at_most(off.min(std::f64::consts::TAU - off), 1e-9, "C3 angle of the wheel after 1e6 steps [rad]");
}

/// Items 6 and 7: the notes' Euler step with renormalisation turns by atan(h w) in the plane and 2 atan(h w/2) in space.
#[test]
fn the_renormalised_euler_step_turns_by_an_arc_tangent() {
    let (h, rate) = (0.1, 2.0_f64);
    let settings = |integrator| {
        let mut s = weightless::<Planar>(h);
        s.integrator = integrator;
        s
    };
    let mut plane = world(settings(Integrator::ExplicitEuler));
    add(&mut plane, "wheel", body_of(None, 1.0, 1.0).spinning(vec1(rate)));
    step(&mut plane);
    close(plane.bodies().motion.rotation[0].angle(), (h * rate).atan(), 1e-15, "item 6 angle");
    let spec = top([1.0, 1.0, 1.0], vec3(0.0, rate, 0.0));
    let mut space = floating(spec, Integrator::ExplicitEuler, h);
    step(&mut space);
    let turned = space.bodies().motion.rotation[0].vector();
    close(turned[1], 2.0 * (0.5 * h * rate).atan(), 1e-15, "item 7 angle");
}

/// Item 12's law: turning a tumbling body's whole scene turns its motion.
#[test]
fn a_turned_top_tumbles_as_the_turned_motion() {
    let turn = Quaternion::about(vec3(0.3, -1.1, 0.7));
    for integrator in Integrator::ALL {
        let (moments, spin) = TUMBLING;
        let plain = attitude(moments, spin, integrator, 0.01, 2.0);
        let spec = top(moments, turn.rotate(spin)).turned(turn);
        let mut w = floating(spec, integrator, 0.01);
        settle(&mut w, 2.0);
        let off = angle_between::<Spatial>(&w.bodies().motion.rotation[0], &plain.then(&turn));
        at_most(off, 1e-12, &format!("turned scene, {integrator:?}"));
    }
}

/// A body whose principal axes are not its shape's axes tumbles as the one whose are.
#[test]
fn the_choice_of_body_axes_does_not_matter() {
    let tilt = Quaternion::about(vec3(0.4, 0.2, -0.9));
    let (moments, spin) = TUMBLING;
    for integrator in Integrator::ALL {
        let plain = attitude(moments, spin, integrator, 0.01, 2.0);
        let straight = Sym3::diag(moments[0], moments[1], moments[2]);
        let inertia = straight.conjugated(&tilt.matrix());
        let properties = MassProperties { mass: 1.0, center: vec3(0.0, 0.0, 0.0), inertia, error: 0.0 };
        let spec = BodySpec::given(None, properties).spinning(spin).turned(tilt.inverse());
        let mut w = floating(spec, integrator, 0.01);
        settle(&mut w, 2.0);
        let attitude = tilt.then(&w.bodies().motion.rotation[0]);
        let off = angle_between::<Spatial>(&attitude, &plain);
        at_most(off, 1e-12, &format!("other body axes, {integrator:?}"));
    }
    assert!(Sym3::diag(1.0, 2.0, 3.0).impossible_because().is_none());
}

/// Reversing the spin half-way brings a body back where it began: the symmetric integrators are their own inverse.
#[test]
fn a_reversed_spin_runs_the_motion_backwards() {
    for integrator in [Integrator::Trapezoid, Integrator::ImplicitMidpoint] {
        let mut w = floating(top(TUMBLING.0, TUMBLING.1), integrator, 0.02);
        settle(&mut w, 10.0);
        let spin = w.bodies().motion.angular_velocity[0];
        w.motion_mut().angular_velocity[0] = -spin;
        settle(&mut w, 10.0);
        let off = angle_between::<Spatial>(&w.bodies().motion.rotation[0], &Quaternion::IDENTITY);
        // rounding, amplified by the unstable axis
        at_most(off, 1e-11, &format!("there and back, {integrator:?} [rad]"));
    }
}

/// How far a rotation takes a point: of a small one it has the digits that a difference of places loses.
#[test]
fn a_swing_is_the_difference_that_a_rotation_makes() {
    let r = vec3(0.3, -1.2, 0.7);
    for angle in [3.0, 0.5, 1e-3] {
        let turn = Quaternion::about(vec3(0.48, -0.6, 0.64) * angle);
        at_most((turn.swing(r) - (turn.rotate(r) - r)).norm(), 1e-15, "swing in space [m]");
        let (turn, r) = (carom::Turn::from_angle(angle), carom::vec2(0.3, -1.2));
        at_most((turn.swing(r) - (turn.rotate(r) - r)).norm(), 1e-15, "swing in the plane [m]");
    }
    let angle = 1e-9;
    let swing = Quaternion::about(vec3(0.0, 0.0, angle)).swing(r);
    let exact = vec3(0.0, 0.0, angle).cross(r);
    at_most((swing - exact).norm() / exact.norm(), 1e-9, "swing of a small turn [1]");
}
