//! How long a sweep takes, for the eyes of whoever changes it:
//! `cargo test --release -p carom-solver --test all speed -- --ignored --nocapture`.
//! A measurement, not a law: it asserts only that the sweep ran.

use crate::common::*;
use carom_math::Space;
use carom_solver::prepared::Prepared;
use carom_solver::{ContactProblem, Impulses, SolveSettings, SolverKind, Twist};
use std::hint::black_box;
use std::time::Instant;

/// A lattice of bodies, each touching its neighbours in every direction and the last ones a wall.
fn lattice<S: Space>(side: usize) -> ContactProblem<S> {
    let mut random = Random::new(1);
    let count = side.pow(S::DIM as u32);
    let mut masses: Vec<_> = (0..count).map(|_| random.inverse_mass::<S>()).collect();
    let mut velocities: Vec<Twist<S>> = (0..count).map(|_| random.twist(1.0)).collect();
    masses.push(obstacle());
    velocities.push(Twist::default());
    let mut problem = ContactProblem::new(masses, velocities);
    for i in 0..count {
        for k in 0..S::DIM {
            let stride = side.pow(k as u32);
            let b = if i / stride % side + 1 < side { i + stride } else { count };
            let mut c = contact::<S>((i, along(k, 0.5)), (b, along(k, -0.5)), along(k, -1.0));
            c.arm_a += random.column::<S::Vector>(0.1);
            c.arm_b += random.column::<S::Vector>(0.1);
            c.friction = 0.5;
            problem.contacts.push(c);
        }
    }
    problem
}

fn measure<S: Space>(side: usize) {
    let problem = lattice::<S>(side);
    let n = problem.contacts.len() as f64;
    let start = Instant::now();
    for _ in 0..20 {
        black_box(Prepared::of(black_box(&problem)));
    }
    let prepare = start.elapsed().as_secs_f64() * 1e9 / (20.0 * n);
    for kind in [SolverKind::Pgs, SolverKind::PgsMatrix] {
        let mut solver = kind.make::<S>();
        let mut best = f64::INFINITY;
        let sweeps = if kind == SolverKind::Pgs { 100 } else { 20 };
        for _ in 0..10 {
            let mut impulses = Impulses::zero(&problem);
            let start = Instant::now();
            let outcome = solver.solve(
                &problem,
                &SolveSettings { iterations: sweeps, tolerance: 0.0, ..SolveSettings::default() },
                &mut impulses,
            );
            best = best.min(start.elapsed().as_secs_f64() * 1e9 / (sweeps as f64 * n));
            assert!(outcome.iterations > 0);
        }
        println!(
            "{} {n} contacts: {} {best:.1} ns per contact and sweep; preparing {prepare:.1} ns",
            S::NAME,
            kind.name()
        );
    }
}

#[test]
#[ignore = "a measurement"]
fn a_sweep_takes_this_long() {
    measure::<carom_math::Planar>(50);
    measure::<carom_math::Spatial>(12);
}
