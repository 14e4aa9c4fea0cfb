//! Sliding bodies go straight: friction on every loaded contact is antiparallel to its slip, and a brick without spin
//! slides to rest along the line on which it was launched, whatever its shape, its heading and where it touches. Under
//! 1e-6 degrees by the accurate methods, under 0.1 degrees by the sweeps at their ordinary setting.

use crate::common::*;
use crate::contact::scenes::{FALL, Scene, at, leaning_brick};
use crate::contact::solvers::{exact_methods, solve_best};
use carom_math::{Column, Spatial, Vec3, vec3};
use carom_solver::{ContactProblem, Impulses, SolveSettings, SolverKind, Twist};

const FRICTION: f64 = 0.5;

/// Where a brick of these edges touches the floor.
fn layouts(edges: [f64; 3]) -> Vec<(&'static str, Vec<(f64, f64)>)> {
    let (x, y) = (0.5 * edges[0], 0.5 * edges[1]);
    let mut random = Random::new(5);
    let mut scattered: Vec<(f64, f64)> = vec![(x, y), (-x, y), (0.1 * x, -y)];
    scattered.extend((0..6).map(|_| (random.between(-x, x), random.between(-y, y))));
    vec![
        ("corners", vec![(x, y), (x, -y), (-x, y), (-x, -y)]),
        ("three feet", vec![(x, 0.9 * y), (-0.8 * x, y), (-0.2 * x, -y)]),
        ("edges and middles", vec![(x, y), (x, -y), (-x, y), (-x, -y), (0.0, y), (0.0, -y)]),
        ("scattered feet", scattered),
    ]
}

/// A brick turned by `turned` about the vertical that slides with `velocity` on these feet (in its own axes).
fn sliding(
    edges: [f64; 3],
    feet: &[(f64, f64)],
    turned: f64,
    velocity: Vec3,
    spin: f64,
) -> ContactProblem<Spatial> {
    let mut s = Scene::<Spatial>::new();
    let mut mass = leaning_brick::<Spatial>(2.0, edges, 0.0);
    let rotation = carom_math::Quaternion::from_axis_angle(vec3(0.0, 0.0, 1.0), turned);
    mass.angular = mass.angular.conjugated(&rotation.matrix());
    let body = s.body(mass, at::<Spatial>(0.0, 0.0, 0.5 * edges[2]));
    let (sin, cos) = turned.sin_cos();
    for &(x, y) in feet {
        let foot = vec3(cos * x - sin * y, sin * x + cos * y, 0.0);
        s.touch(body, 0, foot, vec3(0.0, 0.0, 1.0), FRICTION);
    }
    s.problem.velocities[body] = Twist::new(velocity - vec3(0.0, 0.0, FALL), vec3(0.0, 0.0, spin));
    s.problem
}

const SHAPES: [[f64; 3]; 3] = [[4.0, 1.0, 0.3], [1.0, 0.9, 0.2], [6.0, 0.4, 0.2]];

/// The angle between two horizontal vectors \[degrees\].
fn degrees(a: Vec3, b: Vec3) -> f64 {
    (a[0] * b[1] - a[1] * b[0]).atan2(a[0] * b[0] + a[1] * b[1]).abs().to_degrees()
}

/// Largest angle between friction and the direction against the slip after, over loaded sliding contacts \[degrees\].
fn misalignment(problem: &ContactProblem<Spatial>, impulses: &Impulses<Spatial>) -> f64 {
    let after = problem.velocities_after(impulses);
    let (mut worst, mut sliding): (f64, usize) = (0.0, 0);
    for (c, g) in problem.contacts.iter().zip(&impulses.contacts) {
        let slip = c.relative_velocity(&after).1;
        if g.normal > 1e-6 && slip.norm() > 1e-3 {
            let (across, along) = (slip[0] * g.tangent[1] - slip[1] * g.tangent[0], -slip.dot(g.tangent));
            sliding += 1;
            worst = worst.max(across.atan2(along).abs().to_degrees());
        }
    }
    assert!(sliding >= 3, "only {sliding} contacts carry the brick");
    worst
}

/// Impulses of the sweeps at their ordinary setting.
fn swept(problem: &ContactProblem<Spatial>, impulses: &mut Impulses<Spatial>) {
    SolverKind::Pgs.make().solve(problem, &SolveSettings::default(), impulses);
}

/// Bricks that slide and spin: every contact's friction is antiparallel to its own slip.
#[test]
fn friction_is_antiparallel_to_the_slip_at_every_contact() {
    let mut random = Random::new(9);
    for edges in SHAPES {
        for (layout, feet) in layouts(edges) {
            for _ in 0..8 {
                let heading = random.between(0.0, std::f64::consts::TAU);
                let velocity = vec3(3.0 * heading.cos(), 3.0 * heading.sin(), 0.0);
                let turned = random.between(0.0, 3.0);
                let problem = sliding(edges, &feet, turned, velocity, random.between(-2.0, 2.0));
                let what = format!("{edges:?} on {layout} heading {heading}");
                for method in exact_methods() {
                    let impulses = solve_best(method, &problem)
                        .unwrap_or_else(|why| panic!("{} on {what}: {why}", method.name()));
                    let off = misalignment(&problem, &impulses);
                    assert!(off < 1e-6, "{}: {what}, off by {off:e} degrees", method.name());
                }
                let mut impulses = Impulses::zero(&problem);
                swept(&problem, &mut impulses);
                let off = misalignment(&problem, &impulses);
                assert!(off < 0.1, "pgs: {what}, off by {off:e} degrees");
            }
        }
    }
}

/// Slides a brick to rest step by step and returns by how much its path left the line of its launch \[degrees\].
fn path(
    edges: [f64; 3],
    feet: &[(f64, f64)],
    heading: f64,
    mut solve: impl FnMut(&ContactProblem<Spatial>, &mut Impulses<Spatial>),
) -> f64 {
    let launch = vec3(heading.cos(), heading.sin(), 0.0);
    let mut problem = sliding(edges, feet, 0.0, launch, 0.0);
    let mut impulses = Impulses::zero(&problem);
    let (mut moved, mut steps) = (vec3(0.0, 0.0, 0.0), 0);
    loop {
        solve(&problem, &mut impulses);
        problem.velocities = problem.velocities_after(&impulses);
        let v = problem.velocities[1].linear;
        moved += v;
        steps += 1;
        // the last step, in which it stops, takes what is left
        if v.norm() < 1.01 * FRICTION * FALL || steps > 100 {
            break;
        }
        problem.velocities[1].linear[2] -= FALL;
    }
    assert!((48..=51).contains(&steps), "1 m/s at {} per step takes 49 steps, not {steps}", FRICTION * FALL);
    degrees(moved, launch)
}

/// Launched without spin a brick slides to rest on a straight line, askew to its axes or not.
#[test]
fn a_brick_launched_askew_slides_to_rest_on_a_straight_line() {
    for edges in SHAPES {
        for (layout, feet) in layouts(edges) {
            for heading in [0.0, 0.3, 0.7, 1.2, 2.0, 4.0] {
                let what = format!("{edges:?} on {layout} heading {heading}");
                for method in exact_methods() {
                    let off = path(edges, &feet, heading, |p, g| {
                        *g = solve_best(method, p)
                            .unwrap_or_else(|why| panic!("{} on {what}: {why}", method.name()));
                    });
                    assert!(off < 1e-6, "{}: {what}, off by {off:e} degrees", method.name());
                }
                let off = path(edges, &feet, heading, swept);
                assert!(off < 0.1, "pgs: {what}, off by {off:e} degrees");
            }
        }
    }
}
