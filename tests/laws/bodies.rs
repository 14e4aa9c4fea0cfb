//! One body's state and what changes it, through a world: items 1 to 5, 8 to 10, 13 to 16, and case C5
//! (theory chapters 1 and 2). No contacts.

use crate::harness::*;
use carom::math::skew::{cross_planar, skew_planar, skew_spatial};
use carom::{
    BodySpec, Column, Inertia, Integrator, MassProperties, Planar, Pose, Rotation, Settings, Space, Spatial,
    Sym3, Turn, Twist, World, Wrench, vec1, vec2, vec3,
};

in_plane_and_space!(
    a_projectile_flies_the_exact_parabola,
    the_euler_forms_miss_the_parabola_by_half_g_h_t,
    state_in_momenta_and_in_velocities_are_the_same_state,
    energy_is_the_sum_of_its_translational_and_rotational_parts,
    an_impulse_at_a_point_changes_both_velocities,
    a_force_accelerates_and_its_moment_turns,
    an_applied_wrench_acts_for_one_step,
    a_particle_does_not_turn,
    damping_decays_exponentially,
);

/// A brick without shape: mass 2, and in space three different moments.
fn brick<S: Dimension>() -> BodySpec<S> {
    let entries = [0.7, 1.1, 1.5, 0.1, -0.05, 0.02];
    let inertia = S::Inertia::from_entries(&entries[..S::Inertia::LEN]).expect("one or six entries");
    BodySpec::given(None, MassProperties { mass: 2.0, center: S::Vector::ZERO, inertia, error: 0.0 })
}

/// A vector and a spin without symmetry.
fn odd<S: Space>(seed: u64) -> (S::Vector, S::Spin) {
    let mut dice = Dice(seed);
    (S::Vector::from_fn(|_| dice.between(-1.0, 1.0)), S::Spin::from_fn(|_| dice.between(-1.0, 1.0)))
}

/// Case C5.
pub fn a_projectile_flies_the_exact_parabola<S: Dimension>() {
    for integrator in Integrator::ALL.into_iter().filter(|i| flies_exactly(*i)) {
        let mut w = world::<S>(Settings { integrator, ..exact(0.01) });
        let (velocity, spin) = odd::<S>(5);
        add(&mut w, "shot", brick().moving(velocity * 10.0).spinning(spin));
        let gravity = w.settings().gravity;
        let mut worst: f64 = 0.0;
        run(&mut w, 2.0, |w, r| {
            let wanted = velocity * (10.0 * r.time) + gravity * (0.5 * r.time * r.time);
            worst = worst.max((w.bodies().motion.position[0] - wanted).norm());
        });
        // rounding: 200 sums of numbers up to 20 m
        at_most(worst, 1e-12, &format!("C5 distance from the parabola [m], {integrator:?}"));
    }
}

/// Case C5 for the Euler forms: x = parabola +- g h t/2 along gravity (theory eq. 2.12).
pub fn the_euler_forms_miss_the_parabola_by_half_g_h_t<S: Dimension>() {
    for (integrator, sign) in [(Integrator::ExplicitEuler, -1.0), (Integrator::SemiImplicitEuler, 1.0)] {
        let dt = 0.01;
        let mut w = world::<S>(Settings { integrator, ..exact(dt) });
        add(&mut w, "shot", brick().moving(S::at(3.0, 4.0)));
        settle(&mut w, 2.0);
        let wanted = 4.0 * 2.0 - 0.5 * G * 4.0 - sign * 0.5 * G * dt * 2.0;
        close(height(&w, 0), wanted, 1e-12, &format!("C5 height by {integrator:?} [m]"));
    }
}

/// Item 8.
pub fn state_in_momenta_and_in_velocities_are_the_same_state<S: Dimension>() {
    let mut w = world::<S>(weightless(0.01));
    let (velocity, spin) = odd::<S>(8);
    let turn = S::Rotation::about(odd::<S>(9).1);
    add(&mut w, "brick", brick().moving(velocity).spinning(spin).turned(turn));
    let (p, l) = (w.bodies().momentum(0), w.bodies().spin_momentum(0));
    w.bodies_mut().set_momenta(0, p, l);
    let m = &w.bodies().motion;
    at_most((m.velocity[0] - velocity).norm(), 1e-15, "item 8 velocity from momentum");
    at_most((m.angular_velocity[0] - spin).norm(), 1e-15, "item 8 spin from angular momentum");
    w.bodies_mut().set_momenta(0, p * 3.0, l * 3.0);
    at_most((w.bodies().momentum(0) - p * 3.0).norm(), 1e-15, "item 8 momentum set");
    at_most((w.bodies().spin_momentum(0) - l * 3.0).norm(), 1e-15, "item 8 angular momentum set");
}

/// Items 9 and 10: energies and momenta of the world are the sums over mass points that move as the body does.
pub fn energy_is_the_sum_of_its_translational_and_rotational_parts<S: Dimension>() {
    // four equal mass points at the corners of a rhomboid make a body whose inertia is known as a sum
    let arms: Vec<S::Vector> = (0..4).map(|k| odd::<S>(20 + k).0).collect();
    let center = arms.iter().fold(S::Vector::ZERO, |sum, r| sum + *r * 0.25);
    let arms: Vec<S::Vector> = arms.iter().map(|r| *r - center).collect();
    let inertia = arms.iter().fold(S::Inertia::ZERO, |sum, r| sum.plus(&S::steiner(0.5, *r)));
    let properties = MassProperties { mass: 2.0, center: S::Vector::ZERO, inertia, error: 0.0 };
    let (velocity, spin) = odd::<S>(30);
    let turn = S::Rotation::about(odd::<S>(31).1);
    let place = odd::<S>(32).0;
    let mut w = world::<S>(weightless(0.01));
    let spec = BodySpec::given(None, properties).at(place).moving(velocity).spinning(spin).turned(turn);
    add(&mut w, "four", spec);
    let (mut energy, mut p, mut l) = (0.0, S::Vector::ZERO, S::Spin::ZERO);
    for r in &arms {
        let arm = turn.rotate(*r);
        let v = Twist::<S>::new(velocity, spin).at(arm); // item 4: v + w x r
        energy += 0.5 * 0.5 * v.norm_squared();
        p += v * 0.5;
        l += S::moment(place + arm, v * 0.5);
    }
    let e = w.energy();
    close(e.translational, 0.5 * 2.0 * velocity.norm_squared(), 1e-15, "item 9 translational energy [J]");
    close(e.kinetic(), energy, 1e-14, "item 9 kinetic energy against the mass points [J]");
    close(e.total(), e.translational + e.rotational + e.potential, 1e-15, "item 9 total energy [J]");
    at_most((w.momenta().linear - p).norm(), 1e-14, "item 10 momentum against the mass points");
    at_most((w.momenta().angular - l).norm(), 1e-14, "item 10 angular momentum against the mass points");
}

/// Item 16.
pub fn an_impulse_at_a_point_changes_both_velocities<S: Dimension>() {
    let mut w = world::<S>(weightless(0.01));
    let (velocity, spin) = odd::<S>(40);
    let place = odd::<S>(41).0;
    add(&mut w, "brick", brick().at(place).moving(velocity).spinning(spin));
    let (p, l) = (w.momenta().linear, w.momenta().angular);
    let (impulse, point) = (odd::<S>(42).0, odd::<S>(43).0);
    w.apply_impulse(0, impulse, point);
    at_most((w.momenta().linear - p - impulse).norm(), 1e-14, "item 16 momentum gained is the impulse");
    // about the world's origin: the impulse's moment there
    let moment = S::moment(point, impulse);
    at_most((w.momenta().angular - l - moment).norm(), 1e-14, "item 16 angular momentum gained is r x j");
}

/// Items 14 and 15: a constant force at an arm.
pub fn a_force_accelerates_and_its_moment_turns<S: Dimension>() {
    let mut w = world::<S>(weightless(0.01));
    let solid = body_of::<S>(None, 2.0, 0.5);
    add(&mut w, "ball", solid);
    let (force, arm) = (S::at(0.3, -0.2), S::at(0.5, 0.25));
    let wrench = Wrench::<S>::at(force, arm);
    w.set_force_field(
        "pull",
        Box::new(move |_: f64, _: &carom::Motion<S>, out: &mut [Wrench<S>]| out[0].add(&wrench)),
    );
    settle(&mut w, 1.0);
    let m = &w.bodies().motion;
    at_most((m.velocity[0] - force * 0.5).norm(), 1e-14, "item 14 v = f t/m [m/s]");
    at_most((m.position[0] - force * 0.25).norm(), 1e-14, "item 14 x = f t^2/(2 m) [m]");
    let torque = 0.5 * -0.2 - 0.25 * 0.3;
    close(S::rate(m.angular_velocity[0]), torque / 0.5, 1e-14, "item 15 w = (r x f) t/I [rad/s]");
}

/// Item 14: a wrench applied by hand acts for one step and is then forgotten.
pub fn an_applied_wrench_acts_for_one_step<S: Dimension>() {
    for integrator in Integrator::ALL {
        let mut w = world::<S>(Settings { integrator, ..weightless(0.5) });
        add(&mut w, "ball", body_of::<S>(None, 2.0, 0.5));
        w.apply_wrench(0, Wrench { force: S::at(4.0, 0.0), torque: S::turn(3.0) });
        for _ in 0..3 {
            step(&mut w);
        }
        close(speed(&w, 0), 1.0, 1e-15, &format!("one push, {integrator:?} [m/s]"));
        close(
            S::rate(w.bodies().motion.angular_velocity[0]),
            3.0,
            1e-14,
            &format!("one turn, {integrator:?} [rad/s]"),
        );
    }
}

/// Item 47: a particle has mass and no extent; nothing turns it, and its energy is that of translation.
pub fn a_particle_does_not_turn<S: Dimension>() {
    for integrator in Integrator::ALL {
        let mut w = world::<S>(Settings { integrator, ..exact(0.01) });
        add(&mut w, "particle", BodySpec::particle(None, 3.0).moving(S::at(1.0, 2.0)));
        w.apply_impulse(0, S::at(0.0, 3.0), S::at(5.0, 0.0));
        w.apply_wrench(0, Wrench { force: S::Vector::ZERO, torque: S::turn(7.0) });
        let before = w.ledger().applied;
        settle(&mut w, 0.1);
        assert_eq!(w.bodies().motion.angular_velocity[0], S::Spin::ZERO);
        assert_eq!(w.energy().rotational, 0.0);
        assert_eq!(w.ledger().applied, before, "a torque on a particle does no work");
        close(speed(&w, 0), 1.0, 0.0, "speed along [m/s]");
    }
}

/// Exact flow of linear damping (theory eq. 1.38), whatever the step.
pub fn damping_decays_exponentially<S: Dimension>() {
    let mut w = world::<S>(weightless(0.1));
    add(
        &mut w,
        "ball",
        body_of::<S>(None, 2.0, 0.5).moving(S::at(3.0, 0.0)).spinning(S::turn(4.0)).damped(0.7, 1.3),
    );
    settle(&mut w, 2.0);
    close(speed(&w, 0), 3.0 * (-1.4_f64).exp(), 1e-14, "damped speed [m/s]");
    close(
        S::rate(w.bodies().motion.angular_velocity[0]),
        4.0 * (-2.6_f64).exp(),
        1e-14,
        "damped spin [rad/s]",
    );
    let ledger = w.ledger();
    close(
        ledger.damping,
        w.energy().total() - (0.5 * 2.0 * 9.0 + 0.5 * 0.5 * 16.0),
        1e-13,
        "damping's line [J]",
    );
}

/// Damping acts on the angular momentum, so that a tumbling body keeps the direction of it (theory eq. 1.38).
#[test]
fn damping_keeps_the_axis_of_the_angular_momentum() {
    let mut w = world::<Spatial>(weightless(0.02));
    let inertia = Sym3::diag(1.0, 2.0, 3.0);
    let properties = MassProperties { mass: 1.0, center: vec3(0.0, 0.0, 0.0), inertia, error: 0.0 };
    add(&mut w, "top", BodySpec::given(None, properties).spinning(vec3(0.1, 1.0, 0.1)).damped(0.0, 0.2));
    let before = w.momenta().angular;
    settle(&mut w, 5.0);
    let off = w.momenta().angular - before * (-1.0_f64).exp();
    at_most(off.norm(), 1e-13, "L(5 s) - L(0)/e");
}

/// Items 1, 2 and 3: pose, rotation by its stored numbers, world and body coordinates.
#[test]
fn a_pose_maps_body_points_to_the_world_and_back() {
    let plane = Pose::<Planar>::new(vec2(1.0, 2.0), Turn([0.6, 0.8]));
    let there = plane.to_world(vec2(2.0, 1.0));
    at_most((there - vec2(1.0 + 0.6 * 2.0 - 0.8, 2.0 + 0.8 * 2.0 + 0.6)).norm(), 1e-15, "item 1 x + R r");
    at_most((plane.to_body(there) - vec2(2.0, 1.0)).norm(), 1e-15, "item 3 back, plane");
    let half = 0.5_f64.sqrt();
    let quarter = carom::Quaternion([half, 0.0, 0.0, half]); // 90 degrees about z
    let space = Pose::<Spatial>::new(vec3(1.0, 0.0, 0.0), quarter);
    let there = space.to_world(vec3(1.0, 2.0, 3.0));
    at_most((there - vec3(-1.0, 1.0, 3.0)).norm(), 1e-15, "item 2 x + R(q) r");
    at_most((space.to_body(there) - vec3(1.0, 2.0, 3.0)).norm(), 2e-15, "item 3 back, space");
}

/// Items 4 and 5: the skew map is the vector product, and gives the velocity of a point.
#[test]
fn the_skew_map_gives_the_velocity_of_a_point() {
    let (w, r) = (vec3(0.3, -0.7, 1.1), vec3(0.5, 0.2, -0.4));
    let m = skew_spatial(w);
    let product = vec3(
        vec3(m[0][0], m[0][1], m[0][2]).dot(r),
        vec3(m[1][0], m[1][1], m[1][2]).dot(r),
        vec3(m[2][0], m[2][1], m[2][2]).dot(r),
    );
    at_most((product - w.cross(r)).norm(), 1e-16, "item 5 in space");
    let v = Twist::<Spatial>::new(vec3(1.0, 0.0, 0.0), w).at(r);
    at_most((v - vec3(1.0, 0.0, 0.0) - product).norm(), 2e-16, "item 4 in space");
    let (w, r) = (0.9, vec2(0.5, -0.25));
    let m = skew_planar(w);
    let product = vec2(m[0][0] * r[0] + m[0][1] * r[1], m[1][0] * r[0] + m[1][1] * r[1]);
    at_most((product - cross_planar(w, r)).norm(), 1e-16, "item 5 in the plane");
    let v = Twist::<Planar>::new(vec2(0.0, 1.0), vec1(w)).at(r);
    at_most((v - vec2(0.0, 1.0) - product).norm(), 2e-16, "item 4 in the plane");
}

/// Item 13: the energy of a body that spins about an axis is that of its moment about it, and Steiner's rule moves
/// the axis.
#[test]
fn the_moment_about_an_axis_is_what_spinning_about_it_costs() {
    let axis = vec3(1.0, 2.0, -2.0) * (1.0 / 3.0);
    let mut w: World<Spatial> = world(weightless(0.01));
    add(&mut w, "brick", brick::<Spatial>().spinning(axis * 4.0));
    let properties = w.bodies().data[0].mass_properties;
    let moment = properties.about_axis(axis, vec3(0.0, 0.0, 0.0));
    close(w.energy().rotational, 0.5 * moment * 16.0, 1e-14, "item 13 energy [J]");
    // an axis through another point: m times the squared distance between the axes
    let point = vec3(0.0, 1.0, 1.0); // the axis (1,2,-2)/3 is perpendicular to it
    close(
        properties.about_axis(axis, point),
        moment + 2.0 * 2.0,
        1e-14,
        "item 13 about a parallel axis [kg m^2]",
    );
}
