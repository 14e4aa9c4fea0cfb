//! Motion along what holds a body: cases C21 and C23, and towers that stand, C30. On straight contact the fixed
//! step is exact, where the contact's arm or normal turns it has an order, which is measured (theory 6.5 and 6.6).

use crate::harness::scenes::tower_of_planks;
use crate::harness::*;
use carom::{
    BodySpec, Column, MassProperties, Planar, PlanarShape, Rotation, Settings, SolverKind, Spatial,
    SpatialShape, World, vec2, vec3,
};
use std::f64::consts::{FRAC_PI_2, PI};

in_plane_and_space!(
    a_rod_falls_on_a_frictionless_floor_in_the_time_of_the_integral,
    a_pivoted_rod_arrives_with_the_speed_of_its_energy,
    a_ball_rolls_in_a_bowl_with_the_period_of_its_roundness,
    a_tower_of_planks_stands,
    a_tower_of_planks_stands_with_exact,
);

/// A rod of length and mass 1 whose lower end, a small ball at the world's origin, touches the floor; leaning by an
/// angle from the vertical. The rest of it has no shape, so it falls through.
fn rod<S: Dimension>(lean: f64, friction: f64, dt: f64) -> World<S> {
    let tip = 1e-3;
    let mut w = world::<S>(exact(dt));
    add_floor(&mut w, friction, 0.0);
    let properties =
        MassProperties { mass: 1.0, center: S::at(0.0, 0.5), inertia: S::moment_of(1.0 / 12.0), error: 0.0 };
    let rod = BodySpec::given(Some(S::ball(tip)), properties).with_origin_at(S::at(0.0, tip));
    add(&mut w, "rod", rod.turned(leaning::<S>(-lean)).friction(friction));
    w
}

/// Time at which the rod lies level, and its turning rate then, between the steps by the parabola of its angle.
fn fall<S: Dimension>(mut w: World<S>) -> (f64, f64) {
    let lean = |w: &World<S>| -S::rate(w.bodies().motion.rotation[1].vector());
    let rate = |w: &World<S>| -S::rate(w.bodies().motion.angular_velocity[1]);
    loop {
        let (before, slow) = (lean(&w), rate(&w));
        let r = step(&mut w);
        assert!(r.time < 2.0, "the rod falls");
        if lean(&w) >= FRAC_PI_2 {
            let mean = 0.5 * (slow + rate(&w));
            let share = (FRAC_PI_2 - before) / mean / r.dt;
            return (r.time - r.dt * (1.0 - share), slow + (rate(&w) - slow) * share);
        }
    }
}

/// Case C21 without friction: .603221 s from 5 degrees, .516572 s from 10, w = sqrt(3 g/L).
pub fn a_rod_falls_on_a_frictionless_floor_in_the_time_of_the_integral<S: Dimension>() {
    for (degrees, time) in [(5.0_f64, 0.603_221), (10.0, 0.516_572)] {
        let error = |dt: f64| {
            let (at, rate) = fall(rod::<S>(degrees.to_radians(), 0.0, dt));
            // the energy at the start is that of the lean: w^2 = 3 g cos(lean)/L
            ((at - time).abs(), (rate - (3.0 * G * degrees.to_radians().cos()).sqrt()).abs())
        };
        let (coarse, fine) = (error(2e-3), error(1e-3));
        println!("C21 {coarse:?} {fine:?}");
        at_most(fine.0, 5e-6, &format!("C21 time of the fall from {degrees} degrees [s]"));
        at_most(fine.1, 5e-4, "C21 rate at the end [rad/s]");
    }
}

/// Case C21 with a pivot: friction that never lets go stands for it, with its point at the floor instead of in the
/// ball's centre. .948317 s from 5 degrees, .767978 s from 10.
pub fn a_pivoted_rod_arrives_with_the_speed_of_its_energy<S: Dimension>() {
    for (degrees, time) in [(5.0_f64, 0.948_317), (10.0, 0.767_978)] {
        let (at, rate) = fall(rod::<S>(degrees.to_radians(), 1e6, 1e-3));
        println!("C21 pivot {at} {rate}");
        close(at, time, 4e-3, &format!("C21 time of the pivoted fall from {degrees} degrees [s]"));
        close(rate, (3.0 * G * degrees.to_radians().cos()).sqrt(), 2e-2, "C21 rate at the end [rad/s]");
    }
}

/// A round trough.
pub trait Trough: Dimension {
    /// The lowest part of a circle of radius 1 about the origin, +-.1 rad, in facets.
    fn trough(facets: usize) -> Self::Shape;
}
fn arc(facets: usize) -> Vec<(f64, f64)> {
    (0..=facets).map(|k| 0.2 * k as f64 / facets as f64 - 0.1).map(|a| (a.sin(), -a.cos())).collect()
}
impl Trough for Planar {
    fn trough(facets: usize) -> PlanarShape {
        let points = arc(facets).into_iter().map(|(x, y)| vec2(x, y)).collect();
        PlanarShape::Polyline { points, closed: false }
    }
}
impl Trough for Spatial {
    fn trough(facets: usize) -> SpatialShape {
        let sides = arc(facets);
        let vertices = sides.iter().flat_map(|(x, z)| [vec3(*x, -0.3, *z), vec3(*x, 0.3, *z)]).collect();
        let quad = |k: u32| [[2 * k, 2 * k + 2, 2 * k + 1], [2 * k + 1, 2 * k + 2, 2 * k + 3]];
        SpatialShape::TriMesh { vertices, triangles: (0..facets as u32).flat_map(quad).collect() }
    }
}

/// Case C23: T = 2 pi sqrt((1 + k)(R - r)/g), 2.251804 s for the ball and 2.330839 s for the disc.
pub fn a_ball_rolls_in_a_bowl_with_the_period_of_its_roundness<S: Trough>() {
    let (facets, amplitude) = (400, 0.05);
    let mut w = world::<S>(exact(1e-3));
    add(&mut w, "bowl", BodySpec::fixed(S::trough(facets)).friction(0.8));
    let ball =
        BodySpec::heavy(S::ball(0.1), 1.0).at(S::at(0.9 * f64::sin(amplitude), -0.9 * f64::cos(amplitude)));
    add(&mut w, "ball", ball.friction(0.8));
    let mut crossings = Vec::new();
    let mut before = 1.0;
    run(&mut w, 3.0, |w, r| {
        let x = S::along(w.bodies().motion.position[1]);
        if before * x < 0.0 {
            crossings.push(r.time - r.dt * x / (x - before));
        }
        before = x;
    });
    let period = 2.0 * (crossings[1] - crossings[0]);
    let wanted = 2.0 * PI * ((1.0 + S::ROUNDNESS) * 0.9 / G).sqrt();
    // amplitude^2/16 = 1.6e-4, and facets of 5e-4 rad, a hundredth of the amplitude
    close(period / wanted, 1.0, 1e-3, &format!("C23 period over {wanted:.6} s [1]"));
}

/// Case C30: three storeys, each of two uprights and a lintel; 600 s in the plane, 60 s in space.
pub fn a_tower_of_planks_stands<S: Dimension>() {
    tower_stands::<S>(SolverKind::Pgs);
}

/// Case C30 with `exact`.
pub fn a_tower_of_planks_stands_with_exact<S: Dimension>() {
    tower_stands::<S>(SolverKind::Exact);
}

fn tower_stands<S: Dimension>(solver: SolverKind) {
    let (dt, iterations) = (1.0 / 60.0, 1000);
    let mut w =
        tower_of_planks::<S>(Settings { dt, iterations, solver: Some(solver), ..Settings::default() });
    let start = w.bodies().motion.clone();
    let mut worst: f64 = 0.0;
    let time = if S::DIM == 2 { 600.0 } else { 60.0 };
    let slop = 1e-5 * 0.6 + 0.25 * G / 3600.0;
    run(&mut w, time, |w, _| {
        for (x, y) in w.bodies().motion.position.iter().zip(&start.position) {
            worst = worst.max((*x - *y).norm());
        }
    });
    // what correction leaves alone (1e-5 of the smallest plank) at six interfaces
    // the sag of six interfaces within the correction's slop, half of it, for the first solves only lack it
    at_most(worst, 3.0 * slop, &format!("C30 largest displacement in {time} s [m]"));
}
