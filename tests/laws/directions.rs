//! What must not matter to a world: the direction that a body slides in, how it lies, how its mass lies in it, and the
//! order in which bodies were added. Sliding on a plane, the centre of pressure lies ahead of the centre of mass along
//! the motion, so friction has no moment about the vertical whatever the shape: bodies go straight.

use crate::harness::*;
use carom::{
    BodySpec, Column, MassProperties, Quaternion, Settings, SolverKind, Spatial, SpatialShape, Sym3, Twist,
    World, vec3,
};
use std::f64::consts::PI;

in_plane_and_space!(the_order_in_which_bodies_were_added_changes_no_wrench,);

/// Bodies on the floor, as shape, height of the origin and inertia: bricks, a plate, and a brick whose mass lies askew.
fn sliders() -> Vec<(&'static str, SpatialShape, f64, Option<Sym3>)> {
    let brick = |size: [f64; 3]| SpatialShape::Box { size };
    let askew = Sym3 { diagonal: [0.4, 0.3, 0.5], off: [0.1, 0.05, -0.08] };
    vec![
        ("cube", brick([0.4, 0.4, 0.4]), 0.2, None),
        ("long brick", brick([1.2, 0.2, 0.1]), 0.05, None),
        ("plate", brick([0.8, 0.5, 0.02]), 0.01, None),
        ("loaded brick", brick([1.2, 0.5, 0.1]), 0.05, Some(askew)),
    ]
}

/// Largest angle between velocity and launch until the body is slow \[degrees\].
fn largest_bend(settings: &Settings<Spatial>, slider: usize, yaw: f64, heading: f64) -> f64 {
    let (_, shape, height, inertia) = sliders().swap_remove(slider);
    let mut w = world::<Spatial>(settings.clone());
    add_floor(&mut w, 0.5, 0.0);
    let body = match inertia {
        None => BodySpec::heavy(shape, 2.0),
        Some(inertia) => {
            let center = vec3(0.0, 0.0, 0.0);
            BodySpec::given(Some(shape), MassProperties { mass: 2.0, center, inertia, error: 0.0 })
        }
    };
    let (across, along) = heading.sin_cos();
    let turned = Quaternion::from_axis_angle(vec3(0.0, 0.0, 1.0), yaw);
    let spec = body.at(vec3(0.0, 0.0, height)).turned(turned).moving(vec3(3.0 * along, 3.0 * across, 0.0));
    let body = add(&mut w, "slider", spec.friction(0.5));
    let mut worst: f64 = 0.0;
    run(&mut w, 0.55, |w, _| {
        let v = w.bodies().motion.velocity[body];
        let off = (v[1] * along - v[0] * across).atan2(v[0] * along + v[1] * across);
        worst = worst.max(off.abs().to_degrees());
    });
    worst
}

/// Sixteen headings, four shapes, turned anyhow: straight to 1e-6 degrees with `exact`, to a tenth of a degree with the
/// default solver.
#[test]
fn sliding_bodies_of_any_shape_go_straight() {
    let exactly = Settings { solver: Some(SolverKind::Exact), tolerance: 1e-12, ..Settings::default() };
    for (settings, bound) in [(exactly, 1e-6), (Settings::default(), 0.1)] {
        for (k, (name, ..)) in sliders().iter().enumerate() {
            let bend = |step: i32| {
                let (yaw, heading) = (0.3 + 0.7 * f64::from(step), PI * f64::from(step) / 8.0);
                largest_bend(&settings, k, yaw, heading)
            };
            let worst = (0..16).map(bend).fold(0.0, f64::max);
            at_most(
                worst,
                bound,
                &format!("bend of a sliding {name}, {} [degrees]", settings.solver_kind().name()),
            );
        }
    }
}

/// A pyramid of blocks, added in this order.
fn pyramid<S: Dimension>(settings: &Settings<S>, order: &[usize]) -> World<S> {
    let mut w = world::<S>(settings.clone());
    let mut places = Vec::new();
    for row in 0..4 {
        for k in 0..4 - row {
            places.push(S::at(1.05 * (f64::from(k) + 0.5 * f64::from(row)), 0.25 + 0.5 * f64::from(row)));
        }
    }
    for &k in order {
        if k == places.len() {
            add_floor(&mut w, 0.6, 0.0);
        } else {
            let block = BodySpec::heavy(S::block(1.0, 0.5), 1.0 + k as f64).at(places[k]);
            add(&mut w, &format!("block{k}"), block.friction(0.6));
        }
    }
    w
}

/// What the contacts do to a body of this name, as impulse and moment.
fn wrench<S: Dimension>(w: &World<S>, name: &str) -> Twist<S> {
    let body = w.bodies().names.iter().position(|n| n == name).expect("it was added");
    let (problem, impulses, _) = w.last_problem();
    let mut sum = Twist::default();
    for (c, g) in problem.contacts.iter().zip(&impulses.contacts) {
        let force = c.to_world(g);
        for (own, arm, sign) in [(c.a, c.arm_a, 1.0), (c.b, c.arm_b, -1.0)] {
            if own == body {
                sum.add_scaled(&Twist::new(force, S::moment(arm, force)), sign);
            }
        }
    }
    sum
}

/// Blocks and floor in any order of addition, hence bodies and contacts in any order: the same wrenches to 1e-10 of the
/// largest, any impulses or the least.
pub fn the_order_in_which_bodies_were_added_changes_no_wrench<S: Dimension>() {
    for impulses in [carom::ImpulseChoice::Any, carom::ImpulseChoice::MinimumNorm] {
        let solver = SolverKind::Exact;
        let settings = Settings { solver: Some(solver), impulses, tolerance: 1e-13, ..exact(1.0 / 60.0) };
        let mut dice = Dice(5);
        let mut order: Vec<usize> = (0..11).collect();
        let mut wanted: Vec<Twist<S>> = Vec::new();
        for round in 0..6 {
            let mut w = pyramid::<S>(&settings, &order);
            step(&mut w);
            let found: Vec<Twist<S>> = (0..10).map(|k| wrench(&w, &format!("block{k}"))).collect();
            if round == 0 {
                wanted = found;
            } else {
                let size = wanted.iter().map(|t| t.linear.max_abs()).fold(0.0, f64::max);
                let apart = |(a, b): (&Twist<S>, &Twist<S>)| {
                    (a.linear - b.linear).max_abs().max((a.angular - b.angular).max_abs()) / size
                };
                let off = wanted.iter().zip(&found).map(apart).fold(0.0, f64::max);
                at_most(off, 1e-10, &format!("wrenches of another order, {} [1]", impulses.name()));
            }
            for k in (1..order.len()).rev() {
                order.swap(k, (dice.roll() * (k + 1) as f64) as usize);
            }
        }
    }
}
