//! Problems that end the central path before a solution: light bodies under heavy ones, tables and towers pushed
//! sideways, under random impulses and with other friction. A small twin of the benchmark's stress families.

use crate::common::{Random, moving};
use crate::contact::random::compressed;
use crate::contact::scenes::{at, stack, structure, table, tower};
use crate::contact::solvers::{assembled, solve_matrix};
use carom_math::{Planar, Spatial};
use carom_solver::exact::Exact;
use carom_solver::{ContactProblem, FrictionProblem, FrictionSettings};

/// q + a |q| W y / |W y| with y at random: velocities that impulses could have made; friction times a factor.
fn stressed(problem: &FrictionProblem, amplitude: f64, factor: f64, random: &mut Random) -> FrictionProblem {
    let y: Vec<f64> = problem.velocity.iter().map(|_| random.between(-1.0, 1.0)).collect();
    let added = problem.matrix.times(&y);
    let length = |x: &[f64]| x.iter().map(|a| a * a).sum::<f64>().sqrt();
    let scale = amplitude * length(&problem.velocity) / length(&added).max(1e-300);
    let mut out = problem.clone();
    out.velocity.iter_mut().zip(&added).for_each(|(q, w)| *q += scale * w);
    out.friction.iter_mut().for_each(|mu| *mu *= factor);
    out
}

/// Gives every free body a small random motion, and a shove along that grows from body to body.
fn sheared(mut problem: ContactProblem<Spatial>, shove: f64, random: &mut Random) -> ContactProblem<Spatial> {
    for (k, (m, v)) in problem.inverse_masses.iter().zip(&mut problem.velocities).enumerate() {
        if !m.is_fixed() {
            v.add_scaled(&random.twist(1.0), 0.01);
            v.add_scaled(&moving(at::<Spatial>(1.0, 0.0, 0.0)), shove * k as f64);
        }
    }
    problem
}

/// Fails unless all variants of a problem are solved within so many factorisations.
#[track_caller]
fn assert_solved(what: &str, problem: &ContactProblem<Spatial>, factorisations: usize) {
    let random = &mut Random::new(5);
    for shove in [0.0, 0.1] {
        let base = assembled(&sheared(problem.clone(), shove, random));
        for (amplitude, factor) in [(0.01, 1.0), (0.1, 1.7), (0.5, 0.5), (2.0, 1.0)] {
            let settings = FrictionSettings { factorisations, ..FrictionSettings::default() };
            let harder = stressed(&base, amplitude, factor, random);
            let (_, outcome) = solve_matrix(&mut Exact::default(), &harder, &settings);
            let m = outcome.measure;
            assert!(
                outcome.solved,
                "{what}, shove {shove}, amplitude {amplitude}, friction times {factor}: natural {:.1e}, {:?}",
                m.natural, outcome.stages
            );
        }
    }
}

/// Impulses of a million in units of q / W beside contacts that open.
#[test]
fn a_heavy_body_on_light_ones_is_carried() {
    let mut masses = vec![1.0; 7];
    masses.push(1e6);
    assert_solved("heavy on light", &stack::<Spatial>(&masses, 0.5), 600);
    masses.reverse();
    assert_solved("light on heavy", &stack::<Spatial>(&masses, 0.5), 600);
}

#[test]
fn tables_pushed_sideways_are_solved() {
    for legs in [4, 8] {
        let places: Vec<(f64, f64)> = (0..legs)
            .map(|k| 2.0 * std::f64::consts::PI * k as f64 / legs as f64)
            .map(f64::sin_cos)
            .collect();
        assert_solved("table", &table::<Spatial>(&places, (0.2, 0.1), 0.4), 2000);
    }
}

#[test]
fn towers_pushed_sideways_are_solved() {
    assert_solved("tower", &tower(5, 3, 0.3), 1000);
}

/// Where every Newton direction of the central path is blocked at once, the curve turns back and comes again.
#[test]
fn folds_of_the_central_path_are_passed() {
    let planar = [(6, 7), (6, 22), (6, 30)].map(|(kind, seed)| {
        let (name, problem) = structure::<Planar>(kind, seed);
        (name, assembled(&problem))
    });
    let spatial = [(0, 0), (6, 7), (7, 37), (7, 38)].map(|(kind, seed)| {
        let (name, problem) = structure::<Spatial>(kind, seed);
        (name, assembled(&problem))
    });
    let settings = FrictionSettings { factorisations: 400, ..FrictionSettings::default() };
    for (name, problem) in planar.iter().chain(&spatial) {
        let (_, outcome) = solve_matrix(&mut Exact::default(), problem, &settings);
        assert!(outcome.solved, "{name}: natural {:.1e}, {:?}", outcome.measure.natural, outcome.stages);
        assert!(
            outcome.stages.iter().any(|s| s.name == "path"),
            "{name} needs no path: {:?}",
            outcome.stages
        );
    }
}

/// A problem that jams is told as infeasible, one that was cut short is not.
#[test]
fn what_is_not_solved_is_told_with_its_strict_feasibility() {
    let rail = FrictionProblem {
        dimension: 2,
        matrix: compressed(&[vec![1.0, 2.0], vec![2.0, 4.0]]).into(),
        velocity: vec![-1.0, 0.0],
        friction: vec![0.6],
    };
    let (_, outcome) = solve_matrix(&mut Exact::default(), &rail, &FrictionSettings::default());
    assert!(!outcome.solved);
    let t = outcome.strict_feasibility.expect("a bound is found");
    // u = (s - 1, 2 s): s - 1 - 1.2 |s| is at most -1, at s = 0
    assert!((t + 1.0).abs() < 1e-3, "{t}");
    let settings = FrictionSettings { factorisations: 3, ..FrictionSettings::default() };
    let (_, outcome) = solve_matrix(&mut Exact::default(), &rail, &settings);
    assert_eq!(outcome.strict_feasibility, None, "three factorisations pay for no more");
}
