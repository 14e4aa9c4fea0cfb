//! Bodies that nothing touches: cases C1, C2, C3 and C5. The scheme turns a body in two halves of a flow.

use crate::cases::{events, without_weight};
use crate::harness::*;
use carom::{
    BodySpec, Column, Integrator, MassProperties, Planar, Quaternion, Rotation, Settings, Spatial, Sym3,
    Vec3, World, vec1, vec3,
};

in_plane_and_space!(a_projectile_flies_the_exact_parabola);

/// A body without shape that floats and turns.
fn top(moments: [f64; 3], spin: Vec3, integrator: Integrator, dt: f64) -> World<Spatial> {
    let inertia = Sym3::diag(moments[0], moments[1], moments[2]);
    let properties = MassProperties { mass: 1.0, center: Vec3::ZERO, inertia, error: 0.0 };
    let mut w = world(Settings { integrator, ..without_weight(dt) });
    add(&mut w, "top", BodySpec::given(None, properties).spinning(spin));
    w
}

/// Case C1: precession 8.005623023850 rad/s, 3 rad/s about its own axis.
#[test]
fn a_symmetric_top_precesses_as_the_closed_form_says() {
    let (a, c, spin) = (0.5, 0.8, vec3(0.3, 0.0, 5.0));
    let momentum = vec3(a * spin[0], a * spin[1], c * spin[2]);
    close(momentum.norm() / a, 8.005_623_023_850, 1e-12, "C1 rate of precession [rad/s]");
    let mut w = top([a, a, c], spin, Integrator::Trapezoid, 0.02);
    let (mut worst, mut cone) = (0.0_f64, 0.0_f64);
    run(&mut w, 100.0, |w, r| {
        let attitude = w.bodies().motion.rotation[0];
        let own = Quaternion::about(vec3(0.0, 0.0, r.time * (1.0 / c - 1.0 / a) * momentum[2]));
        let wanted = own.then(&Quaternion::about(momentum * (r.time / a)));
        worst = worst.max(angle_between::<Spatial>(&attitude, &wanted));
        let tilt = attitude.rotate(vec3(0.0, 0.0, 1.0)).cross(momentum).norm() / momentum.norm();
        cone = cone.max((tilt.asin().to_degrees() - 2.147_585).abs());
    });
    at_most(worst, 1e-10, "C1 attitude over 100 s [rad]");
    at_most(cone, 1e-6, "C1 cone angle over 100 s [deg]: the reference has seven digits");
}

/// Case C2: errors of the attitude at 20 s no larger than the case's, and of order 2.
#[test]
fn attitude_errors_about_the_middle_axis_are_within_those_of_the_case() {
    let attitude = |integrator, dt| {
        let mut w = top([1.0, 2.0, 3.0], vec3(0.1, 1.0, 0.1), integrator, dt);
        settle(&mut w, 20.0);
        w.bodies().motion.rotation[0]
    };
    // its own error: a sixteenth of that of twice the step, 2e-12
    let mut fine = world::<Spatial>(Settings { integrator: Integrator::Rk4, ..weightless(1.25e-3) });
    let inertia = Sym3::diag(1.0, 2.0, 3.0);
    let properties = MassProperties { mass: 1.0, center: Vec3::ZERO, inertia, error: 0.0 };
    add(&mut fine, "top", BodySpec::given(None, properties).spinning(vec3(0.1, 1.0, 0.1)));
    settle(&mut fine, 20.0);
    let reference = fine.bodies().motion.rotation[0];
    for (integrator, bounds) in [
        (Integrator::ImplicitMidpoint, [9.0e-4, 2.25e-4, 5.6e-5]),
        (Integrator::Trapezoid, [1.14e-4, 2.9e-5, 7.2e-6]),
    ] {
        let errors =
            [0.02, 0.01, 0.005].map(|dt| angle_between::<Spatial>(&attitude(integrator, dt), &reference));
        for (error, bound) in errors.iter().zip(bounds) {
            at_most(*error, bound, &format!("C2 attitude at 20 s, {integrator:?} [rad]"));
        }
        close((errors[0] / errors[2]).log2() / 2.0, 2.0, 0.1, &format!("C2 order, {integrator:?} [1]"));
    }
}

/// How far the stored numbers of a turning disc and a tumbling body are from unit length after some steps.
pub fn off_unit_length(steps: usize) -> f64 {
    let mut plane = world::<Planar>(without_weight(0.01));
    let properties =
        MassProperties { mass: 1.0, center: Column::ZERO, inertia: Planar::moment_of(1.0), error: 0.0 };
    add(&mut plane, "disc", BodySpec::given(None, properties).spinning(vec1(3.0)));
    let mut space = top([1.0, 2.0, 3.0], vec3(0.1, 5.0, 0.1), Integrator::Trapezoid, 0.01);
    for _ in 0..steps {
        step(&mut plane);
        step(&mut space);
    }
    let length = |v: &[f64]| v.iter().map(|x| x * x).sum::<f64>().sqrt();
    let lengths = [
        length(plane.bodies().motion.rotation[0].as_slice()),
        length(space.bodies().motion.rotation[0].as_slice()),
    ];
    lengths.iter().fold(0.0, |worst, l| f64::max(worst, (l - 1.0).abs()))
}

/// Case C3, for a twentieth of its steps; all of them in `make laws`.
#[test]
fn rotations_stay_of_unit_length() {
    at_most(off_unit_length(50_000), 1e-14, "C3 length of a rotation off 1 after 5e4 steps [1]");
}

/// Case C5.
pub fn a_projectile_flies_the_exact_parabola<S: Dimension>() {
    for dt in [0.1, 0.01] {
        let mut w = world::<S>(events(dt));
        let (velocity, spin) = (S::at(3.0, 9.0), S::turn(2.0));
        add(&mut w, "shot", BodySpec::dense(S::block(0.4, 0.2), 700.0).moving(velocity).spinning(spin));
        let gravity = w.settings().gravity;
        let mut worst: f64 = 0.0;
        run(&mut w, 2.0, |w, r| {
            let wanted = velocity * r.time + gravity * (0.5 * r.time * r.time);
            worst = worst.max((w.bodies().motion.position[0] - wanted).norm());
        });
        // rounding: 200 sums of numbers up to 6 m
        at_most(worst, 1e-12, &format!("C5 distance from the parabola, h = {dt} [m]"));
    }
}
