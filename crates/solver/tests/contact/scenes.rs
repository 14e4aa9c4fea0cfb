//! Structures as contact problems, in the plane and in space, after a step of gravity that gives every free body the
//! velocity -FALL: stacks, walls, arches, tables, card houses, piles of balls, towers of planks. Axis 0 runs along,
//! the last axis up, and in space axis 1 runs across. Knows no solver.

use crate::common::*;
use carom_math::{Column, Rotation, Space, Spatial};
use carom_solver::{Contact, ContactProblem, Impulses, InverseMass, Twist};

/// The speed that a step of gravity gives \[m/s\].
pub const FALL: f64 = 0.04;

/// A problem under construction, with the places of its bodies; body 0 is the ground.
#[derive(Clone)]
pub struct Scene<S: Space> {
    pub problem: ContactProblem<S>,
    pub centres: Vec<S::Vector>,
}

/// The point at a distance along, across (in space) and up \[m\].
pub fn at<S: Space>(along: f64, across: f64, up: f64) -> S::Vector {
    S::Vector::from_fn(|i| {
        if i == 0 {
            along
        } else if i == S::DIM - 1 {
            up
        } else {
            across
        }
    })
}

/// The spin that turns the axis along towards the axis up.
pub fn turn<S: Space>(angle: f64) -> S::Spin {
    S::Spin::from_fn(|i| {
        if S::SPIN == 1 {
            angle
        } else if i == 1 {
            -angle
        } else {
            0.0
        }
    })
}

/// A brick whose edges (along, across, up) have been turned by an angle from along towards up.
pub fn leaning_brick<S: Space>(mass: f64, [along, across, up]: [f64; 3], angle: f64) -> InverseMass<S> {
    let edges = if S::SPIN == 1 { [along, up, across] } else { [along, across, up] };
    let upright = brick::<S>(mass, edges);
    let rotation = S::Rotation::about(turn::<S>(angle));
    InverseMass { linear: upright.linear, angular: S::turned(&upright.angular, &rotation) }
}

impl<S: Space> Scene<S> {
    /// The ground alone.
    pub fn new() -> Self {
        let problem = ContactProblem::new(vec![obstacle()], vec![Twist::default()]);
        Scene { problem, centres: vec![S::Vector::ZERO] }
    }
    /// Adds a falling body and returns its index.
    pub fn body(&mut self, mass: InverseMass<S>, centre: S::Vector) -> usize {
        self.problem.inverse_masses.push(mass);
        self.problem.velocities.push(moving(at::<S>(0.0, 0.0, -FALL)));
        self.centres.push(centre);
        self.centres.len() - 1
    }
    /// Adds a contact at a point, its normal from b to a.
    pub fn touch(&mut self, a: usize, b: usize, point: S::Vector, normal: S::Vector, friction: f64) {
        let (arm_a, arm_b) = (point - self.centres[a], point - self.centres[b]);
        let id = self.problem.contacts.len() as u64;
        self.problem.contacts.push(Contact { id, friction, ..contact((a, arm_a), (b, arm_b), normal) });
    }
    /// Adds the contacts of a stretch between two points, at both ends, and in space on both sides of the middle plane.
    pub fn lie(
        &mut self,
        (a, b): (usize, usize),
        ends: [S::Vector; 2],
        depth: f64,
        normal: S::Vector,
        mu: f64,
    ) {
        for end in ends {
            for side in if S::DIM == 2 { vec![0.0] } else { vec![-0.5, 0.5] } {
                self.touch(a, b, end + at::<S>(0.0, side * depth, 0.0), normal, mu);
            }
        }
    }
}

/// Bricks 1 x 1 x 0.5 on top of each other; in all, contact patch k carries the bricks from k on.
pub fn stack<S: Space>(masses: &[f64], friction: f64) -> ContactProblem<S> {
    let mut s = Scene::<S>::new();
    for (k, &mass) in masses.iter().enumerate() {
        let foot = 0.5 * k as f64;
        let body = s.body(leaning_brick(mass, [1.0, 1.0, 0.5], 0.0), at::<S>(0.0, 0.0, foot + 0.25));
        let ends = [at::<S>(-0.5, 0.0, foot), at::<S>(0.5, 0.0, foot)];
        s.lie((body, body - 1), ends, 1.0, at::<S>(0.0, 0.0, 1.0), friction);
    }
    s.problem
}

/// A wall of bricks 1 x 0.5 x 0.3 in running bond.
pub fn wall<S: Space>(columns: usize, rows: usize, friction: f64) -> ContactProblem<S> {
    let mut s = Scene::<S>::new();
    let up = at::<S>(0.0, 0.0, 1.0);
    let mut below: Vec<(usize, f64)> = Vec::new();
    for row in 0..rows {
        let foot = 0.3 * row as f64;
        let mut own = Vec::new();
        for column in 0..columns {
            let left = column as f64 + 0.5 * (row % 2) as f64;
            let body =
                s.body(leaning_brick(1.0, [1.0, 0.5, 0.3], 0.0), at::<S>(left + 0.5, 0.0, foot + 0.15));
            let ground = [(0, left)];
            for &(under, start) in if row == 0 { &ground[..] } else { &below[..] } {
                let (from, to) = (left.max(start), (left + 1.0).min(start + 1.0));
                if to - from > 0.1 {
                    s.lie(
                        (body, under),
                        [at::<S>(from, 0.0, foot), at::<S>(to, 0.0, foot)],
                        0.5,
                        up,
                        friction,
                    );
                }
            }
            own.push((body, left));
        }
        below = own;
    }
    s.problem
}

/// A half-circle of `stones` between the radii 0.9 and 1.1: thicker than the 10.7 % at which an arch falls.
pub fn arch<S: Space>(stones: usize, friction: f64) -> ContactProblem<S> {
    let mut s = Scene::<S>::new();
    let step = std::f64::consts::PI / stones as f64;
    let point = |radius: f64, angle: f64| at::<S>(radius * angle.cos(), 0.0, radius * angle.sin());
    for k in 0..=stones {
        let joint = k as f64 * step;
        if k < stones {
            let stone = leaning_brick(0.2 * step, [0.2, 0.4, step], joint + 0.5 * step);
            s.body(stone, point(1.0, joint + 0.5 * step));
        }
        // the stone after the joint lies on the one before it; the last joint is on the ground
        let (a, b) = if k < stones { (k + 1, k) } else { (0, k) };
        let normal = at::<S>(-joint.sin(), 0.0, joint.cos());
        s.lie((a, b), [point(0.9, joint), point(1.1, joint)], 0.4, normal, friction);
    }
    s.problem
}

/// A table of mass 1 on legs at these places (along, across), its weight acting at `load`.
pub fn table<S: Space>(legs: &[(f64, f64)], load: (f64, f64), friction: f64) -> ContactProblem<S> {
    let mut s = Scene::<S>::new();
    let across = |y: f64| if S::DIM == 2 { 0.0 } else { y };
    let body = s.body(leaning_brick(1.0, [2.0, 2.0, 0.2], 0.0), at::<S>(load.0, across(load.1), 0.5));
    for &(x, y) in legs {
        s.touch(body, 0, at::<S>(x, across(y), 0.0), at::<S>(0.0, 0.0, 1.0), friction);
    }
    s.problem
}

/// Two cards of length 1 that lean on each other, each at an angle from the vertical: stands iff the friction of
/// the feet is at least tan(angle)/2.
pub fn a_frame<S: Space>(angle: f64, friction: f64) -> ContactProblem<S> {
    let mut s = Scene::<S>::new();
    let (sin, cos) = (angle.sin(), angle.cos());
    for side in [-1.0, 1.0] {
        let card = leaning_brick(0.01, [0.01, 0.6, 1.0], side * angle);
        let body = s.body(card, at::<S>(side * 0.5 * sin, 0.0, 0.5 * cos));
        let foot = at::<S>(side * sin, 0.0, 0.0);
        for y in if S::DIM == 2 { vec![0.0] } else { vec![-0.3, 0.3] } {
            s.touch(body, 0, foot + at::<S>(0.0, y, 0.0), at::<S>(0.0, 0.0, 1.0), friction);
        }
    }
    for y in if S::DIM == 2 { vec![0.0] } else { vec![-0.3, 0.3] } {
        s.touch(2, 1, at::<S>(0.0, y, cos), at::<S>(1.0, 0.0, 0.0), friction);
    }
    s.problem
}

/// Bricks of length 1 on the edge of a table at 0, each reaching out by `share` of what the limit allows: from the
/// top by 1/2, 1/4, 1/6, ... (in all 25/24 for four).
pub fn overhang<S: Space>(bricks: usize, share: f64, friction: f64) -> ContactProblem<S> {
    let mut s = Scene::<S>::new();
    let (mut under, mut right) = (0, 0.0);
    for k in 0..bricks {
        let foot = 0.25 * k as f64;
        let left = right - 1.0 + share * 0.5 / (bricks - k) as f64;
        let body = s.body(leaning_brick(1.0, [1.0, 0.5, 0.25], 0.0), at::<S>(left + 0.5, 0.0, foot + 0.125));
        let ends = [at::<S>(left, 0.0, foot), at::<S>(right, 0.0, foot)];
        s.lie((body, under), ends, 0.5, at::<S>(0.0, 0.0, 1.0), friction);
        (under, right) = (body, left + 1.0);
    }
    s.problem
}

/// A box of a width and height on a slope that its friction holds: tips iff tan(slope) > width / height.
pub fn box_on_slope<S: Space>(width: f64, height: f64, slope: f64, friction: f64) -> ContactProblem<S> {
    let mut s = Scene::<S>::new();
    let (along, up) = (at::<S>(slope.cos(), 0.0, -slope.sin()), at::<S>(slope.sin(), 0.0, slope.cos()));
    let body = s.body(leaning_brick(3.0, [width, width, height], -slope), up * (0.5 * height));
    s.lie((body, 0), [along * (-0.5 * width), along * (0.5 * width)], width, up, friction);
    s.problem
}

/// Balls of diameter 1 piled up: a triangle of discs in the plane, a square pyramid in space, `side` balls long.
/// Masses from light to heavy over `ratio`, at random.
pub fn pile<S: Space>(side: usize, friction: f64, ratio: f64, random: &mut Random) -> ContactProblem<S> {
    let mut s = Scene::<S>::new();
    let rise = if S::DIM == 2 { 0.75f64.sqrt() } else { 0.5f64.sqrt() };
    for layer in 0..side {
        let across = if S::DIM == 2 { 1 } else { side - layer };
        for (i, j) in (0..side - layer).flat_map(|i| (0..across).map(move |j| (i, j))) {
            let half = 0.5 * layer as f64;
            let y = if S::DIM == 2 { 0.0 } else { j as f64 + half };
            let mass = ratio.powf(random.between(0.0, 1.0));
            s.body(ball(mass, 0.5), at::<S>(i as f64 + half, y, 0.5 + rise * layer as f64));
            let new = s.centres.len() - 1;
            if layer == 0 {
                let foot = s.centres[new] - at::<S>(0.0, 0.0, 0.5);
                s.touch(new, 0, foot, at::<S>(0.0, 0.0, 1.0), friction);
            }
            for other in 1..new {
                let apart = s.centres[new] - s.centres[other];
                if apart.norm() < 1.0 + 1e-9 {
                    let middle = (s.centres[new] + s.centres[other]) * 0.5;
                    s.touch(new, other, middle, apart * (1.0 / apart.norm()), friction);
                }
            }
        }
    }
    s.problem
}

/// A tower of planks, `planks` per layer, each layer across the one below: four contacts per crossing.
pub fn tower(layers: usize, planks: usize, friction: f64) -> ContactProblem<Spatial> {
    let mut s = Scene::<Spatial>::new();
    let (length, width, thick) = (1.0, 0.2, 0.07);
    let places: Vec<f64> =
        (0..planks).map(|k| (length - width) * (k as f64 / (planks as f64 - 1.0).max(1.0) - 0.5)).collect();
    let up = at::<Spatial>(0.0, 0.0, 1.0);
    let mut below: Vec<(usize, f64)> = Vec::new();
    for layer in 0..layers {
        let foot = thick * layer as f64;
        let mut own = Vec::new();
        for &place in &places {
            let lengthwise = layer % 2 == 0;
            let (edges, centre) = if lengthwise {
                ([length, width, thick], at::<Spatial>(0.0, place, foot + 0.5 * thick))
            } else {
                ([width, length, thick], at::<Spatial>(place, 0.0, foot + 0.5 * thick))
            };
            let body = s.body(leaning_brick(1.0, edges, 0.0), centre);
            let ground = [(0, 0.0)];
            for &(under, there) in if layer == 0 { &ground[..] } else { &below[..] } {
                let (half, middle) = match (layer, lengthwise) {
                    (0, _) => ([0.5 * length, 0.5 * width], [0.0, place]),
                    (_, true) => ([0.5 * width; 2], [there, place]),
                    _ => ([0.5 * width; 2], [place, there]),
                };
                let x = [middle[0] - half[0], middle[0] + half[0]];
                let ends = x.map(|x| at::<Spatial>(x, middle[1], foot));
                s.lie((body, under), ends, 2.0 * half[1], up, friction);
            }
            own.push((body, place));
        }
        below = own;
    }
    s.problem
}

/// Kinds of random structures that `structure` builds.
pub const KINDS: usize = 9;

/// A random structure: its kind, size, friction, mass ratio and a disturbance of its velocities follow from the
/// seed. Same kind and seed, same problem.
pub fn structure<S: Space>(kind: usize, seed: u64) -> (String, ContactProblem<S>) {
    let random = &mut Random::new(seed.wrapping_mul(KINDS as u64) + kind as u64 + 1000);
    let friction = [0.05, 0.3, 0.7, 2.0][random.below(4)];
    let ratio: f64 = [1.0, 10.0, 1e3, 1e6][random.below(4)];
    let size = random.below(4);
    let (what, mut problem) = match kind {
        0 => {
            let masses: Vec<f64> = (0..2 + 3 * size).map(|_| ratio.powf(random.between(0.0, 1.0))).collect();
            ("stack", stack::<S>(&masses, friction))
        }
        1 => ("wall", wall::<S>(2 + size, 2 + random.below(4), friction)),
        2 => ("arch", arch::<S>(3 + 4 * size, friction)),
        3 => {
            let legs: Vec<(f64, f64)> =
                (0..3 + 4 * size).map(|_| (random.between(-1.0, 1.0), random.between(-1.0, 1.0))).collect();
            ("table", table::<S>(&legs, (random.between(-0.3, 0.3), random.between(-0.3, 0.3)), friction))
        }
        4 => ("cards", a_frame::<S>(random.between(0.1, 1.0), friction)),
        5 => ("overhang", overhang::<S>(2 + size, random.between(0.5, 1.5), friction)),
        6 => {
            let largest = if S::DIM == 2 { 3 + 2 * size } else { 2 + size };
            ("pile", pile::<S>(largest, friction, ratio, random))
        }
        7 => {
            let count = 3 + 4 * size;
            ("chain", chain::<S>(count, friction, ratio, random))
        }
        _ => {
            let recipe = Recipe {
                bodies: 3 + 2 * size,
                contacts: 4 + 5 * size,
                rows: 0,
                friction,
                law: carom_solver::FrictionLaw::Disc,
            };
            ("random", random_problem::<S>(random, recipe))
        }
    };
    let stir = [0.0, 0.0, 0.01, 0.3][random.below(4)];
    for (m, v) in problem.inverse_masses.iter().zip(&mut problem.velocities) {
        if !m.is_fixed() {
            v.add_scaled(&random.twist(1.0), stir);
        }
    }
    let n = problem.contacts.len();
    let text = format!(
        "{what}<{}> kind {kind} seed {seed}: {n} contacts, mu {friction}, ratio {ratio:e}, stir {stir}",
        S::NAME
    );
    (text, problem)
}

/// Bodies in a row, each in contact with the next at a few random points, the first with the ground.
pub fn chain<S: Space>(count: usize, friction: f64, ratio: f64, random: &mut Random) -> ContactProblem<S> {
    let mut s = Scene::<S>::new();
    for k in 0..count {
        let mut mass = random.inverse_mass::<S>();
        let factor = ratio.powf(-random.between(0.0, 1.0));
        mass = InverseMass {
            linear: mass.linear * factor,
            angular: carom_math::Inertia::scaled(&mass.angular, factor),
        };
        let body = s.body(mass, at::<S>(0.2 * random.between(-1.0, 1.0), 0.0, 0.5 + k as f64));
        let tilt: S::Vector = random.column(0.3);
        let normal = (at::<S>(0.0, 0.0, 1.0) + tilt).normalized().expect("not zero");
        for _ in 0..1 + random.below(4) {
            let middle = at::<S>(0.0, 0.0, k as f64) + random.column::<S::Vector>(0.4);
            s.touch(body, body - 1, middle, normal, friction);
        }
    }
    s.problem
}

/// What the contacts do to each body: net impulse and its moment about the body's centre, as a twist.
pub fn wrenches<S: Space>(problem: &ContactProblem<S>, impulses: &Impulses<S>) -> Vec<Twist<S>> {
    let mut all = vec![Twist::default(); problem.velocities.len()];
    for (c, g) in problem.contacts.iter().zip(&impulses.contacts) {
        let force = c.to_world(g);
        all[c.a].add_scaled(&Twist::new(force, S::moment(c.arm_a, force)), 1.0);
        all[c.b].add_scaled(&Twist::new(force, S::moment(c.arm_b, force)), -1.0);
    }
    all
}

/// The largest difference of two lists of wrenches over the largest entry.
pub fn apart<S: Space>(one: &[Twist<S>], other: &[Twist<S>]) -> f64 {
    let size = |t: &Twist<S>| t.linear.max_abs().max(t.angular.max_abs());
    let largest = one.iter().map(size).fold(f64::MIN_POSITIVE, f64::max);
    let off = one.iter().zip(other).map(|(a, b)| {
        let mut d = *a;
        d.add_scaled(b, -1.0);
        size(&d)
    });
    off.fold(0.0, f64::max) / largest
}

/// The fastest motion left after the impulses \[m/s, rad/s\].
pub fn motion_after<S: Space>(problem: &ContactProblem<S>, impulses: &Impulses<S>) -> f64 {
    let size = |t: &Twist<S>| t.linear.max_abs().max(t.angular.max_abs());
    problem.velocities_after(impulses).iter().map(size).fold(0.0, f64::max)
}
