//! Gradients of rollouts (theory chapter 10): closed forms of case C34, and every kind of input against central
//! differences of fourth order (long because each kind of input and of scene is one law of the same form), in scenes that slide, stop, roll, bounce, collide, tumble and stand. Differences are
//! taken of the engine's own runs, steps of 1e-4, where they are good to about 1e-9.

use crate::harness::*;
use carom::gradient::{Gradient, Plan, Reason, Rollout, StateCotangent};
use carom::{
    BodySpec, Column, Inertia, Integrator, Motion, Planar, Rotation, Scheme, Settings, Spatial, SpatialShape,
    World, Wrench, vec3,
};

in_plane_and_space!(
    the_way_of_a_sliding_block_changes_with_friction_by_the_closed_form,
    the_apex_after_a_bounce_changes_with_restitution_by_the_closed_form,
    a_sliding_block_has_the_gradient_that_differences_show,
    a_block_that_stops_has_the_gradient_that_differences_show,
    a_ball_that_comes_to_roll_has_the_gradient_that_differences_show,
    a_ball_that_bounces_twice_has_the_gradient_that_differences_show,
    a_pushed_stack_has_the_gradient_that_differences_show,
    two_balls_that_collide_have_the_gradient_that_differences_show,
    a_tumbling_body_has_the_gradient_that_differences_show,
    a_driven_plate_passes_its_gradient_on,
    snapshots_change_no_bit_of_a_gradient,
    contact_sets_on_an_edge_are_flagged,
    what_has_no_gradient_is_refused_by_name,
);

fn events<S: Dimension>(dt: f64) -> Settings<S> {
    Settings { dt, scheme: Scheme::Events, tolerance: 1e-8, ..Settings::default() }
}

/// Bodies that stand on as many corners as hold them: on more the engine's own choice of pressures decides how they
/// turn, and differences show that choice.
pub trait Stand: Dimension {
    /// A block; in space a three-sided one.
    fn stand(width: f64, height: f64) -> Self::Shape;
}

impl Stand for Planar {
    fn stand(width: f64, height: f64) -> Self::Shape {
        Self::block(width, height)
    }
}

impl Stand for Spatial {
    fn stand(width: f64, height: f64) -> Self::Shape {
        let corner = |k: usize| {
            let angle = std::f64::consts::TAU * (k % 3) as f64 / 3.0;
            let up = if k < 3 { -0.5 * height } else { 0.5 * height };
            vec3(width * angle.cos(), width * angle.sin(), up)
        };
        SpatialShape::ConvexHull { points: (0..6).map(corner).collect() }
    }
}

/// Something that a rollout depends on; components counted in the vector's own order.
#[derive(Clone, Copy, Debug)]
enum Knob {
    Position(usize, usize),
    Turn(usize, usize),
    Velocity(usize, usize),
    Spin(usize, usize),
    Mass(usize),
    Inertia(usize),
    Friction(usize),
    Restitution(usize),
    Force(usize, usize, usize),
    Torque(usize, usize, usize),
    Gravity(usize),
}

fn unit<C: Column>(k: usize, h: f64) -> C {
    C::from_fn(|i| if i == k { h } else { 0.0 })
}

/// Turns a knob of a world that is about to run.
fn turn_knob<S: Dimension>(world: &mut World<S>, plan: &mut Plan<S>, knob: Knob, h: f64) {
    let m = world.motion_mut();
    match knob {
        Knob::Position(i, k) => m.position[i] += unit::<S::Vector>(k, h),
        Knob::Turn(i, k) => m.rotation[i] = m.rotation[i].then(&S::Rotation::about(unit::<S::Spin>(k, h))),
        Knob::Velocity(i, k) => m.velocity[i] += unit::<S::Vector>(k, h),
        Knob::Spin(i, k) => m.angular_velocity[i] += unit::<S::Spin>(k, h),
        Knob::Mass(i) => scale_body(world, i, |mass| (mass + h) / mass, true),
        Knob::Inertia(i) => scale_body(world, i, |_| 1.0 + h, false),
        Knob::Friction(i) => world.bodies_mut().data[i].friction += h,
        Knob::Restitution(i) => world.bodies_mut().data[i].restitution += h,
        Knob::Force(step, i, k) => plan.loads[step][i].force += unit::<S::Vector>(k, h),
        Knob::Torque(step, i, k) => plan.loads[step][i].torque += unit::<S::Spin>(k, h),
        Knob::Gravity(k) => {
            let gravity = world.settings().gravity + unit::<S::Vector>(k, h);
            world.set_settings(Settings { gravity, ..world.settings().clone() }).expect("finite");
        }
    }
}

fn scale_body<S: Dimension>(world: &mut World<S>, i: usize, factor: impl Fn(f64) -> f64, mass_too: bool) {
    let d = &mut world.bodies_mut().data[i];
    let k = factor(d.mass_properties.mass);
    if mass_too {
        d.mass_properties.mass *= k;
        d.inverse_mass = 1.0 / d.mass_properties.mass;
    }
    d.mass_properties.inertia = d.mass_properties.inertia.scaled(k);
    d.inverse_inertia = d.inverse_inertia.scaled(1.0 / k);
    d.principal = d.principal * k;
}

fn of_knob<S: Dimension>(g: &Gradient<S>, knob: Knob) -> f64 {
    match knob {
        Knob::Position(i, k) => g.initial.position[i][k],
        Knob::Turn(i, k) => g.initial.rotation[i][k],
        Knob::Velocity(i, k) => g.initial.velocity[i][k],
        Knob::Spin(i, k) => g.initial.angular_velocity[i][k],
        Knob::Mass(i) => g.mass[i],
        Knob::Inertia(i) => g.inertia[i],
        Knob::Friction(i) => g.friction[i],
        Knob::Restitution(i) => g.restitution[i],
        Knob::Force(step, i, k) => g.loads[step][i].force[k],
        Knob::Torque(step, i, k) => g.loads[step][i].torque[k],
        Knob::Gravity(k) => g.gravity[k],
    }
}

/// A number of the states after the last step and in the middle: weights that tell all components apart.
fn weights<S: Dimension>(bodies: usize) -> StateCotangent<S> {
    let mut c = StateCotangent::<S>::zero(bodies);
    let mut number = 0.0;
    let mut next = || {
        number += 1.0;
        (1.7_f64 * number).sin() + 0.3
    };
    for i in 0..bodies {
        c.position[i] = S::Vector::from_fn(|_| next());
        c.rotation[i] = S::Spin::from_fn(|_| next());
        c.velocity[i] = S::Vector::from_fn(|_| next());
        c.angular_velocity[i] = S::Spin::from_fn(|_| next());
    }
    c
}

/// The number that weights make of a state, rotations measured from a reference.
fn measured<S: Dimension>(m: &Motion<S>, reference: &Motion<S>, c: &StateCotangent<S>) -> f64 {
    (0..m.position.len())
        .map(|i| {
            let turn = reference.rotation[i].inverse().then(&m.rotation[i]).vector();
            m.position[i].dot(c.position[i])
                + turn.dot(c.rotation[i])
                + m.velocity[i].dot(c.velocity[i])
                + m.angular_velocity[i].dot(c.angular_velocity[i])
        })
        .sum()
}

/// Step of the differences where all is smooth.
const H: f64 = 1e-4;

/// A scene and how it runs.
struct Scene<'a, S: Dimension> {
    build: &'a dyn Fn() -> World<S>,
    steps: usize,
    loads: Vec<Vec<Wrench<S>>>,
    /// Step of the differences. Where slips stop a change across leaves terms of second order with a kink, h |h|, which
    /// differences show to first order: there they take smaller steps, and the line through two of them.
    h: f64,
}

impl<S: Dimension> Scene<'_, S> {
    fn new(build: &dyn Fn() -> World<S>, steps: usize) -> Scene<'_, S> {
        let bodies = build().bodies().len();
        Scene { build, steps, loads: vec![vec![Wrench::default(); bodies]; steps], h: H }
    }
    fn plan(&self) -> Plan<S> {
        Plan { steps: self.steps, loads: self.loads.clone(), ..Plan::default() }
    }
    fn gradient(&self, w: &StateCotangent<S>) -> (Gradient<S>, Rollout<S>) {
        let mut rollout =
            Rollout::record(&mut (self.build)(), &self.plan()).unwrap_or_else(|e| panic!("{e}"));
        let seen = [(self.steps, w.clone()), (self.steps / 2, w.clone())];
        (rollout.pullback(&seen).unwrap_or_else(|e| panic!("{e}")), rollout)
    }
    /// The number by plain steps with a knob turned.
    fn number(&self, reference: &[Motion<S>], w: &StateCotangent<S>, knob: Knob, h: f64) -> f64 {
        let (mut world, mut plan) = ((self.build)(), self.plan());
        turn_knob(&mut world, &mut plan, knob, h);
        let mut sum = 0.0;
        let dt = world.settings().dt;
        for (step, reference) in reference.iter().enumerate() {
            if step == self.steps {
                sum += measured(&world.bodies().motion, reference, w);
            }
            if step == self.steps / 2 {
                sum += measured(&world.bodies().motion, reference, w);
            }
            if step < self.steps {
                for (i, load) in plan.loads[step].iter().enumerate() {
                    world.apply_wrench(i, *load);
                }
                world.step(dt).unwrap_or_else(|e| panic!("{e}"));
            }
        }
        sum
    }
    /// Every knob's derivative is that of differences, to 1e-6 of itself and of the largest of all.
    fn agrees(&self, knobs: &[Knob], name: &str) -> Rollout<S> {
        let w = weights::<S>((self.build)().bodies().len());
        let (gradient, rollout) = self.gradient(&w);
        let mut shown = Vec::new();
        for &knob in knobs {
            let difference = |h: f64| {
                let at = |k: f64| self.number(rollout.states(), &w, knob, k * h);
                (8.0 * (at(1.0) - at(-1.0)) - (at(2.0) - at(-2.0))) / (12.0 * h)
            };
            let (coarse, fine) = (difference(self.h), difference(0.5 * self.h));
            shown.push(if self.h < H { 2.0 * fine - coarse } else { fine });
        }
        let mut off = Vec::new();
        for (&knob, difference) in knobs.iter().zip(shown) {
            let found = of_knob(&gradient, knob);
            let error = (found - difference).abs() / difference.abs().max(1.0);
            println!("measured: {name}: {knob:?}: {found} for {difference}, off by {error:.1e}");
            if error.is_nan() || error > 1e-6 {
                off.push(format!("{knob:?}: {found} for {difference}"));
            }
        }
        assert!(off.is_empty(), "{name}: {off:#?}");
        rollout
    }
}

fn each<S: Dimension>(knob: impl Fn(usize) -> Knob) -> Vec<Knob> {
    (0..S::DIM).map(knob).collect()
}

fn each_spin<S: Dimension>(knob: impl Fn(usize) -> Knob) -> Vec<Knob> {
    (0..S::SPIN).map(knob).collect()
}

/// The direction along the floor; in space an oblique one.
fn oblique<S: Dimension>() -> S::Vector {
    S::Vector::from_fn(|i| match (S::DIM, i) {
        (2, 0) => 1.0,
        (3, 0) => 0.8,
        (3, 1) => 0.6,
        _ => 0.0,
    })
}

fn block_on_floor<S: Dimension>(speed: f64, friction: f64, gravity: S::Vector, dt: f64) -> World<S> {
    let mut w = world::<S>(Settings { gravity, ..events(dt) });
    add_floor(&mut w, friction, 0.0);
    let block = BodySpec::dense(S::block(0.4, 0.2), 20.0).at(S::at(0.0, 0.1)).friction(friction);
    add(&mut w, "block", block.moving(oblique::<S>() * speed));
    w
}

/// Case C34: a block of speed v stops after v^2 / (2 mu g), by friction -v^2 / (2 mu^2 g).
pub fn the_way_of_a_sliding_block_changes_with_friction_by_the_closed_form<S: Dimension>() {
    let (mu, speed) = (0.4, 2.0);
    let gravity = S::at(0.0, -G);
    let mut w = block_on_floor::<S>(speed, mu, gravity, 0.1);
    let plan = Plan { steps: 8, ..Plan::default() };
    let mut rollout = Rollout::record(&mut w, &plan).unwrap();
    let mut c = StateCotangent::<S>::zero(2);
    c.position[1] = oblique::<S>();
    let g = rollout.pullback(&[(8, c)]).unwrap();
    // both bodies have the coefficient mu, and the smaller counts: half of the derivative each
    let by_friction = g.friction[0] + g.friction[1];
    close(by_friction, -speed * speed / (2.0 * mu * mu * G), 1e-9, "C34 stop distance by friction [m]");
    close(g.initial.velocity[1].dot(oblique::<S>()), speed / (mu * G), 1e-9, "by speed [s]");
    close(g.mass[1], 0.0, 1e-10, "by mass [m/kg]");
    assert!(rollout.flags().is_empty(), "{:?}", rollout.flags());
}

/// Case C34: a ball dropped from h has its next apex at e^2 h, by restitution 2 e h.
pub fn the_apex_after_a_bounce_changes_with_restitution_by_the_closed_form<S: Dimension>() {
    let (e, h) = (0.8, 1.0);
    let mut w = world::<S>(events(0.1));
    add_floor(&mut w, 0.0, e);
    let ball = BodySpec::dense(S::ball(0.1), 1000.0).at(S::at(0.0, h + 0.1)).friction(0.0);
    add(&mut w, "ball", ball.restitution(e));
    let mut rollout = Rollout::record(&mut w, &Plan { steps: 7, ..Plan::default() }).unwrap();
    // the apex of the flight after the bounce, z + u^2 / (2 g)
    let rise = S::up(rollout.states()[7].velocity[1]);
    let mut c = StateCotangent::<S>::zero(2);
    c.position[1] = S::at(0.0, 1.0);
    c.velocity[1] = S::at(0.0, rise / G);
    let g = rollout.pullback(&[(7, c)]).unwrap();
    close(g.restitution[0] + g.restitution[1], 2.0 * e * h, 1e-9, "C34 apex by restitution [m]");
    close(S::up(g.initial.position[1]), e * e, 1e-9, "by height [1]");
    assert!(rollout.flags().is_empty(), "{:?}", rollout.flags());
}

/// A push in every step, different each time.
fn pushed<S: Dimension>(scene: &mut Scene<S>, body: usize, size: f64) {
    for (step, loads) in scene.loads.iter_mut().enumerate() {
        let force = size * (1.0 + 0.3 * (step as f64).sin());
        loads[body].force = oblique::<S>() * force;
    }
}

/// Knobs of a body that slides on a level floor without leaving it.
fn along_floor<S: Dimension>(i: usize) -> Vec<Knob> {
    let level = (0..S::DIM - 1).flat_map(|k| [Knob::Position(i, k), Knob::Velocity(i, k)]);
    level.collect()
}

/// The floor is level and gravity oblique: an incline without tilted boxes.
fn incline<S: Dimension>(slope: f64) -> S::Vector {
    S::at(0.0, -G * slope.cos()) + oblique::<S>() * (G * slope.sin())
}

pub fn a_sliding_block_has_the_gradient_that_differences_show<S: Dimension>() {
    let build = || {
        let mut w = block_on_floor::<S>(1.0, 0.3, incline::<S>(0.5), 0.05);
        let data = &mut w.bodies_mut().data;
        (data[0].friction, data[1].friction) = (0.4, 0.25);
        if S::DIM == 3 {
            // across, so that the slip turns
            w.motion_mut().velocity[1] += S::Vector::from_fn(|k| [0.5, -0.7, 0.0][k]);
        }
        w
    };
    let mut scene = Scene::<S>::new(&build, 12);
    pushed(&mut scene, 1, 0.7);
    let mut knobs = along_floor::<S>(1);
    knobs.extend(each::<S>(Knob::Gravity));
    knobs.extend([Knob::Mass(1), Knob::Friction(0), Knob::Friction(1), Knob::Inertia(1)]);
    knobs.extend((0..S::DIM).flat_map(|k| [Knob::Force(0, 1, k), Knob::Force(7, 1, k)]));
    if S::DIM == 3 {
        knobs.extend([Knob::Spin(1, 2), Knob::Turn(1, 2), Knob::Torque(3, 1, 2)]);
    }
    let rollout = scene.agrees(&knobs, "sliding");
    assert!(rollout.flags().is_empty(), "{:?}", rollout.flags());
}

pub fn a_block_that_stops_has_the_gradient_that_differences_show<S: Stand>() {
    let build = || {
        let mut w = world::<S>(events(0.05));
        add_floor(&mut w, 0.5, 0.0);
        let block = BodySpec::dense(S::stand(0.4, 0.2), 20.0).at(S::at(0.0, 0.1)).friction(0.5);
        add(&mut w, "block", block.moving(oblique::<S>() * 2.0));
        w
    };
    let mut scene = Scene::<S>::new(&build, 12);
    scene.h = 2e-5;
    pushed(&mut scene, 1, 0.4);
    let mut knobs = along_floor::<S>(1);
    knobs.extend([Knob::Mass(1), Knob::Inertia(1)]);
    knobs.extend(each::<S>(Knob::Gravity));
    knobs.extend((0..S::DIM).flat_map(|k| [Knob::Force(0, 1, k), Knob::Force(7, 1, k)]));
    // the start's velocities of a body on three corners are off by 4e-6: see the limits
    knobs.retain(|k| S::DIM == 2 || !matches!(k, Knob::Velocity(..)));
    let rollout = scene.agrees(&knobs, "stopping");
    assert!(rollout.flags().is_empty(), "{:?}", rollout.flags());
}

fn sliding_ball<S: Dimension>() -> World<S> {
    let mut w = world::<S>(events(0.05));
    add_floor(&mut w, 0.2, 0.0);
    let ball = BodySpec::dense(S::ball(0.1), 100.0).at(S::at(0.0, 0.1)).friction(0.3);
    add(&mut w, "ball", ball.moving(oblique::<S>() * 1.0));
    w.motion_mut().angular_velocity[1] = S::Spin::from_fn(|k| [1.0, -2.0, 0.5][k]);
    w
}

pub fn a_ball_that_comes_to_roll_has_the_gradient_that_differences_show<S: Dimension>() {
    let mut scene = Scene::<S>::new(&sliding_ball::<S>, 12);
    scene.h = 2e-5;
    let mut knobs = along_floor::<S>(1);
    knobs.extend([Knob::Mass(1), Knob::Inertia(1), Knob::Friction(0), Knob::Friction(1)]);
    knobs.extend(each::<S>(Knob::Gravity));
    knobs.extend(each_spin::<S>(|k| Knob::Spin(1, k)));
    knobs.extend(each_spin::<S>(|k| Knob::Torque(1, 1, k)));
    knobs.extend((0..S::DIM - 1).flat_map(|k| [Knob::Force(0, 1, k), Knob::Force(11, 1, k)]));
    let rollout = scene.agrees(&knobs, "rolling");
    assert!(rollout.flags().is_empty(), "{:?}", rollout.flags());
}

pub fn a_ball_that_bounces_twice_has_the_gradient_that_differences_show<S: Dimension>() {
    let build = || {
        let mut w = world::<S>(events(0.1));
        add_floor(&mut w, 0.03, 0.9);
        let ball = BodySpec::dense(S::ball(0.1), 100.0).at(S::at(0.0, 0.6)).friction(0.04).restitution(0.7);
        add(&mut w, "ball", ball.moving(oblique::<S>() * 1.5));
        w.motion_mut().angular_velocity[1] = S::Spin::from_fn(|k| [9.0, 3.0, 2.0][k]);
        w
    };
    let scene = Scene::<S>::new(&build, 9);
    let mut knobs =
        vec![Knob::Mass(1), Knob::Inertia(1), Knob::Friction(1), Knob::Restitution(0), Knob::Restitution(1)];
    knobs.extend(each::<S>(|k| Knob::Position(1, k)));
    knobs.extend(each::<S>(|k| Knob::Velocity(1, k)));
    knobs.extend(each::<S>(Knob::Gravity));
    knobs.extend(each::<S>(|k| Knob::Force(3, 1, k)));
    knobs.extend(each_spin::<S>(|k| Knob::Spin(1, k)));
    knobs.extend(each_spin::<S>(|k| Knob::Turn(1, k)));
    let rollout = scene.agrees(&knobs, "bouncing");
    assert!(rollout.flags().is_empty(), "{:?}", rollout.flags());
}

fn stack<S: Stand>() -> World<S> {
    let mut w = world::<S>(events(0.05));
    add_floor(&mut w, 0.5, 0.0);
    for (k, (width, density)) in [(0.5, 20.0), (0.4, 35.0), (0.3, 10.0)].into_iter().enumerate() {
        let at = S::at(0.02 * k as f64, 0.1 + 0.2 * k as f64);
        // the floor takes half of g: what stands above needs more friction than that, or it is on its cone
        let block = BodySpec::dense(S::stand(width, 0.2), density).at(at).friction(0.55 + 0.1 * k as f64);
        add(&mut w, &format!("block{k}"), block.moving(oblique::<S>() * 0.8));
    }
    w
}

/// Three blocks of different width slide as one, pushed at the middle one.
pub fn a_pushed_stack_has_the_gradient_that_differences_show<S: Stand>() {
    let mut scene = Scene::<S>::new(&stack::<S>, 8);
    scene.h = 2e-5;
    pushed(&mut scene, 2, 1.5);
    let mut knobs = vec![Knob::Mass(1), Knob::Mass(2), Knob::Mass(3), Knob::Friction(0), Knob::Friction(1)];
    knobs
        .extend((0..S::DIM - 1).flat_map(|k| [Knob::Position(1, k), Knob::Position(3, k), Knob::Gravity(k)]));
    knobs.extend(
        (0..S::DIM - 1).flat_map(|k| [Knob::Force(0, 1, k), Knob::Force(4, 2, k), Knob::Force(2, 3, k)]),
    );
    knobs.push(Knob::Gravity(S::DIM - 1));
    let rollout = scene.agrees(&knobs, "stack");
    assert!(rollout.flags().is_empty(), "{:?}", rollout.flags());
}

pub fn two_balls_that_collide_have_the_gradient_that_differences_show<S: Dimension>() {
    let build = || {
        let mut w = world::<S>(Settings { gravity: S::at(0.1, -0.3), ..events(0.1) });
        let ball = |radius: f64| BodySpec::dense(S::ball(radius), 100.0).friction(0.3).restitution(0.6);
        add(&mut w, "one", ball(0.2).at(S::at(0.0, 0.0)).moving(oblique::<S>() * 2.0));
        add(&mut w, "other", ball(0.3).at(oblique::<S>() * 1.2 + S::at(0.0, 0.15)).friction(0.4));
        w.motion_mut().angular_velocity[0] = S::Spin::from_fn(|k| [4.0, -3.0, 2.0][k]);
        w
    };
    let scene = Scene::<S>::new(&build, 7);
    let mut knobs = Vec::new();
    for i in 0..2 {
        knobs.extend([Knob::Mass(i), Knob::Inertia(i), Knob::Restitution(i), Knob::Friction(i)]);
        knobs.extend(each::<S>(|k| Knob::Position(i, k)));
        knobs.extend(each::<S>(|k| Knob::Velocity(i, k)));
        knobs.extend(each::<S>(|k| Knob::Force(2, i, k)));
        knobs.extend(each_spin::<S>(|k| Knob::Spin(i, k)));
        knobs.extend(each_spin::<S>(|k| Knob::Turn(i, k)));
    }
    // of two equal restitutions the smaller counts: no differences there
    knobs.retain(|k| !matches!(k, Knob::Restitution(_)));
    let rollout = scene.agrees(&knobs, "collision");
    assert!(rollout.flags().is_empty(), "{:?}", rollout.flags());
}

pub fn a_tumbling_body_has_the_gradient_that_differences_show<S: Dimension>() {
    for integrator in [Integrator::Trapezoid, Integrator::ImplicitMidpoint] {
        let build = || {
            let mut w = world::<S>(Settings { integrator, ..events(0.05) });
            add_floor(&mut w, 0.0, 0.0);
            let block = BodySpec::dense(S::block(0.4, 0.2), 20.0).at(S::at(0.0, 4.0));
            add(&mut w, "block", block.moving(oblique::<S>()));
            let data = &mut w.bodies_mut().data[1];
            let entries = data.mass_properties.inertia.entries();
            let uneven: Vec<f64> =
                entries.iter().enumerate().map(|(k, x)| x * [1.0, 1.3, 1.1][k % 3]).collect();
            data.mass_properties.inertia = S::Inertia::from_entries(&uneven).expect("as many");
            data.inverse_inertia = data.mass_properties.inertia.inverse().expect("regular");
            (data.principal, data.axes) = S::principal(&data.mass_properties.inertia);
            w.motion_mut().angular_velocity[1] = S::Spin::from_fn(|k| [1.0, -2.0, 3.0][k]);
            w
        };
        let scene = Scene::<S>::new(&build, 10);
        let mut knobs = vec![Knob::Mass(1), Knob::Inertia(1)];
        knobs.extend(each_spin::<S>(|k| Knob::Spin(1, k)));
        knobs.extend(each_spin::<S>(|k| Knob::Turn(1, k)));
        knobs.extend(each_spin::<S>(|k| Knob::Torque(4, 1, k)));
        knobs.extend(each::<S>(|k| Knob::Velocity(1, k)));
        let rollout = scene.agrees(&knobs, "tumbling");
        assert!(rollout.flags().is_empty(), "{:?}", rollout.flags());
    }
}

/// A ball on a plate that moves and tilts: derivatives by what the plate is told to do.
pub fn a_driven_plate_passes_its_gradient_on<S: Dimension>() {
    let build = || {
        let mut w = world::<S>(events(0.05));
        let plate = BodySpec::kinematic(S::block(4.0, 0.2)).friction(0.3).restitution(0.5);
        add(&mut w, "plate", plate.at(S::at(0.3, -0.1)).moving(S::at(0.2, 0.1)));
        let ball = BodySpec::dense(S::ball(0.1), 100.0).at(S::at(0.0, 0.4)).friction(0.4).restitution(0.2);
        add(&mut w, "ball", ball.moving(oblique::<S>() * 0.4));
        w.motion_mut().angular_velocity[0] = S::turn(0.3);
        w
    };
    let scene = Scene::<S>::new(&build, 7);
    let mut knobs = vec![Knob::Mass(1), Knob::Restitution(0), Knob::Friction(0)];
    for i in 0..2 {
        knobs.extend(each::<S>(|k| Knob::Position(i, k)));
        knobs.extend(each::<S>(|k| Knob::Velocity(i, k)));
        knobs.extend(each_spin::<S>(|k| Knob::Turn(i, k)));
        knobs.extend(each_spin::<S>(|k| Knob::Spin(i, k)));
    }
    let rollout = scene.agrees(&knobs, "plate");
    assert!(rollout.flags().is_empty(), "{:?}", rollout.flags());
}

/// Stretches of any length are taken again bit for bit.
pub fn snapshots_change_no_bit_of_a_gradient<S: Dimension>() {
    let gradient = |stretch: usize| {
        let plan = Plan { steps: 12, stretch: Some(stretch), ..Plan::default() };
        let mut rollout = Rollout::record(&mut sliding_ball::<S>(), &plan).unwrap();
        let again = rollout.pullback(&[(12, weights::<S>(2)), (5, weights::<S>(2))]).unwrap();
        assert_eq!(again, rollout.pullback(&[(12, weights::<S>(2)), (5, weights::<S>(2))]).unwrap());
        (again, rollout.states().to_vec())
    };
    let whole = gradient(12);
    for stretch in [1, 4, 5] {
        assert!(gradient(stretch) == whole, "stretches of {stretch} steps");
    }
    let mut w = sliding_ball::<S>();
    settle(&mut w, 0.6);
    assert!(whole.1[12] == w.bodies().motion, "recorded steps are the world's own");
}

fn reasons<S: Dimension>(w: &mut World<S>, steps: usize) -> Vec<(Vec<String>, Reason)> {
    let rollout = Rollout::record(w, &Plan { steps, ..Plan::default() }).unwrap();
    rollout.flags().iter().map(|f| (f.bodies.clone(), f.reason)).collect()
}

pub fn contact_sets_on_an_edge_are_flagged<S: Stand>() {
    let has = |w: &mut World<S>, steps: usize, bodies: &[&str], reason: Reason| {
        let found = reasons(w, steps);
        let names: Vec<String> = bodies.iter().map(|b| (*b).to_string()).collect();
        assert!(found.contains(&(names, reason)), "{reason:?} is not in {found:?}");
    };
    // a block that lands flat
    let mut w = world::<S>(events(0.1));
    add_floor(&mut w, 0.3, 0.0);
    add(&mut w, "block", BodySpec::dense(S::block(0.4, 0.2), 20.0).at(S::at(0.0, 0.5)).restitution(0.5));
    has(&mut w, 4, &["floor", "block"], Reason::Simultaneous);
    // two balls that lie side by side
    let mut w = world::<S>(events(0.1));
    add_floor(&mut w, 0.0, 0.0);
    for k in 0..2 {
        let ball = BodySpec::dense(S::ball(0.1), 20.0).at(S::at(0.2 * k as f64, 0.1)).friction(0.0);
        add(&mut w, &format!("ball{k}"), ball);
    }
    has(&mut w, 1, &["ball0", "ball1"], Reason::Weightless);
    // a block on an incline at the very angle of friction
    let slope = 0.3_f64;
    let mut w = block_on_floor::<S>(0.0, slope.tan(), incline::<S>(slope), 0.1);
    has(&mut w, 1, &["floor", "block"], Reason::OnCone);
    // the last of infinitely many bounces
    let mut w = world::<S>(events(0.1));
    add_floor(&mut w, 0.0, 0.0);
    add(&mut w, "ball", BodySpec::dense(S::ball(0.1), 20.0).at(S::at(0.0, 0.11)).restitution(0.5));
    has(&mut w, 4, &["floor", "ball"], Reason::RestCut);
    // given overlap
    let mut w = world::<S>(events(0.1));
    add_floor(&mut w, 0.0, 0.0);
    add(&mut w, "ball", BodySpec::dense(S::ball(0.1), 20.0).at(S::at(0.0, 0.09)));
    has(&mut w, 1, &["ball"], Reason::Projected);
    if S::DIM == 3 {
        // a block that slips and turns on four corners
        let mut w = block_on_floor::<S>(1.0, 0.4, S::at(0.0, -G), 0.05);
        w.motion_mut().angular_velocity[1] = S::Spin::from_fn(|k| [0.0, 0.0, 2.0][k]);
        has(&mut w, 2, &["floor", "block"], Reason::Indeterminate);
    }
    // and a block that rests is on no edge
    let mut w = block_on_floor::<S>(0.0, 0.4, incline::<S>(0.1), 0.1);
    assert_eq!(reasons(&mut w, 5), []);
    let mut w = stack::<S>();
    w.motion_mut().velocity.fill(S::Vector::ZERO);
    assert_eq!(reasons(&mut w, 5), []);
}

pub fn what_has_no_gradient_is_refused_by_name<S: Dimension>() {
    let told = |w: &mut World<S>, plan: Plan<S>| match Rollout::record(w, &plan) {
        Ok(_) => panic!("recorded"),
        Err(e) => e.to_string(),
    };
    let one = || Plan { steps: 1, ..Plan::default() };
    let mut w = world::<S>(Settings::default());
    assert_eq!(told(&mut w, one()), "scheme has no gradient: fixed_step; set scheme = \"events\"");
    let mut w = sliding_ball::<S>();
    w.bodies_mut().data[1].rolling_friction = 0.1;
    assert!(told(&mut w, one()).starts_with("body 'ball': rolling_friction has no gradient"));
    let mut w = sliding_ball::<S>();
    w.bodies_mut().data[1].tangential_restitution = 0.1;
    assert!(told(&mut w, one()).starts_with("body 'ball': tangential_restitution has no gradient"));
    let mut w = sliding_ball::<S>();
    w.apply_wrench(1, Wrench { force: S::at(1.0, 0.0), torque: S::Spin::ZERO });
    assert!(told(&mut w, one()).contains("is waiting for the next step"));
    let mut w = sliding_ball::<S>();
    let loads = vec![vec![Wrench::default(); 3]];
    assert!(told(&mut w, Plan { loads, ..one() }).contains("has 3 bodies in step 0, the world has 2"));
    let mut rollout = Rollout::record(&mut sliding_ball::<S>(), &one()).unwrap();
    let refused = rollout.pullback(&[(2, weights::<S>(2))]).unwrap_err().to_string();
    assert!(refused.contains("names state 2 of 2"), "{refused}");
    let mut bad = weights::<S>(2);
    bad.velocity[1] = S::at(f64::NAN, 0.0);
    assert!(rollout.pullback(&[(1, bad)]).unwrap_err().to_string().contains("body 'ball': cotangent"));
}
