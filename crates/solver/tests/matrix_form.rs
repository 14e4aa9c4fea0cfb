//! Problems in matrix form: the solvers of W r + q against each other, against enumeration and pivoting, and against
//! the measure that knows none of them (theory chapter 5, section 5.10).

use crate::common::*;
use carom_math::{Planar, Space};
use carom_solver::delassus::{delassus, right_hand_side};
use carom_solver::{
    Csr, FrictionLaw, FrictionOutcome, FrictionProblem, FrictionSettings, FrictionSolverKind, SolverKind,
    Stop, measure, unwatched,
};

const ITERATIVE: [FrictionSolverKind; 3] =
    [FrictionSolverKind::Pgs, FrictionSolverKind::Nncg, FrictionSolverKind::Apgd];

fn solve_matrix(
    problem: &FrictionProblem,
    kind: FrictionSolverKind,
    tolerance: f64,
) -> (Vec<f64>, FrictionOutcome) {
    let mut impulses = vec![0.0; problem.velocity.len()];
    let settings = FrictionSettings { tolerance, ..FrictionSettings::default() };
    let outcome = kind.make().solve(problem, &settings, &mut impulses, &mut unwatched);
    assert_eq!(outcome.measure, measure(problem, &impulses), "{}", kind.name());
    assert_eq!(outcome.solved, outcome.measure.solves(tolerance), "{}", kind.name());
    assert_eq!(outcome.solved, outcome.reason.is_empty(), "{}: {:?}", kind.name(), outcome.reason);
    (impulses, outcome)
}

/// The matrix form of a random problem on bodies.
fn random_matrix<S: Space>(random: &mut Random, contacts: usize, friction: f64) -> FrictionProblem {
    let recipe = Recipe { bodies: 7, contacts, rows: 0, friction, law: FrictionLaw::Disc };
    let problem = random_problem::<S>(random, recipe);
    FrictionProblem {
        dimension: 1 + S::SLIP,
        matrix: delassus(&problem).into(),
        velocity: right_hand_side(&problem).iter().map(|b| -b).collect(),
        friction: problem.contacts.iter().map(|c| c.friction).collect(),
    }
}

/// Velocities W r + q.
fn velocities(problem: &FrictionProblem, impulses: &[f64]) -> Vec<f64> {
    problem.matrix.times(impulses).iter().zip(&problem.velocity).map(|(u, q)| u + q).collect()
}

/// Every first-order method ends with impulses that the independent measure accepts at 1e-8.
fn every_method_is_measured_to_solve_random_problems<S: Space>() {
    let mut random = Random::new(81);
    for case in 0..30 {
        let problem = random_matrix::<S>(&mut random, 3 + case % 10, 0.6);
        problem.check().expect("a sound problem");
        for kind in ITERATIVE {
            let (_, outcome) = solve_matrix(&problem, kind, 1e-8);
            assert!(outcome.solved, "case {case}, {}: {outcome:?}", kind.name());
        }
    }
}

/// On bodies and on the matrix the methods find the same velocities.
fn both_forms_of_a_method_agree<S: Space>() {
    let mut random = Random::new(82);
    let recipe = Recipe { bodies: 9, contacts: 8, rows: 0, friction: 0.5, law: FrictionLaw::Disc };
    for _ in 0..10 {
        let bodies = random_problem::<S>(&mut random, recipe);
        let problem = FrictionProblem {
            dimension: 1 + S::SLIP,
            matrix: delassus(&bodies).into(),
            velocity: right_hand_side(&bodies).iter().map(|b| -b).collect(),
            friction: bodies.contacts.iter().map(|c| c.friction).collect(),
        };
        for (kind, twin) in [(SolverKind::Nncg, ITERATIVE[1]), (SolverKind::Apgd, ITERATIVE[2])] {
            let on_bodies = velocities(&problem, &solved(&bodies, kind, 1e-11).flat());
            let (impulses, _) = solve_matrix(&problem, twin, 1e-11);
            // contacts without friction slip as they like in both: all velocities agree
            for (u, v) in on_bodies.iter().zip(velocities(&problem, &impulses)) {
                assert_close(*u, v, 1e-8, kind.name());
            }
        }
    }
}

/// Without friction (one row per contact) all five solvers agree.
#[test]
fn all_solvers_agree_on_linear_complementarity() {
    let mut random = Random::new(83);
    for case in 0..40 {
        let n = 1 + case % 8;
        let rank = 1 + random.below(n + 2);
        let factor: Vec<Vec<f64>> =
            (0..n).map(|_| (0..rank).map(|_| random.between(-1.0, 1.0)).collect()).collect();
        let product = |i: usize, j: usize| -> f64 { (0..rank).map(|k| factor[i][k] * factor[j][k]).sum() };
        let rows = (0..n).map(|i| (0..n).map(|j| (j, product(i, j))).collect());
        // some z >= 0 and w >= 0, complementary: the problem has a solution
        let z: Vec<f64> = (0..n).map(|i| if i % 2 == 0 { random.between(0.1, 1.0) } else { 0.0 }).collect();
        let matrix = Csr::from_rows(n, rows);
        let q = matrix.times(&z).iter().zip(&z).map(|(w, z)| if *z > 0.0 { -w } else { 0.3 - w }).collect();
        let problem =
            FrictionProblem { dimension: 1, matrix: matrix.into(), velocity: q, friction: vec![0.0; n] };
        let wanted = velocities(&problem, &z);
        for kind in FrictionSolverKind::ALL {
            let (impulses, outcome) = solve_matrix(&problem, kind, 1e-9);
            assert!(outcome.solved, "case {case}, {}: {outcome:?}", kind.name());
            for (u, v) in velocities(&problem, &impulses).iter().zip(&wanted) {
                assert_close(*u, *v, 1e-6, kind.name());
            }
        }
    }
}

/// In the plane enumeration finds a solution wherever an iterative method does, and to rounding.
#[test]
fn enumeration_solves_every_small_planar_problem() {
    let mut random = Random::new(84);
    for case in 0..60 {
        let problem = random_matrix::<Planar>(&mut random, 1 + case % 6, 0.9);
        let (_, outcome) = solve_matrix(&problem, FrictionSolverKind::Enumeration, 1e-12);
        assert!(outcome.solved, "case {case}: {outcome:?}");
    }
}

/// Lemke in matrix form knows no friction, enumeration no disc and no crowd: both say so and leave the start.
#[test]
fn oracles_refuse_what_they_cannot_do_in_words() {
    let mut random = Random::new(85);
    let plane = random_matrix::<Planar>(&mut random, 9, 0.5);
    let space = random_matrix::<carom_math::Spatial>(&mut random, 2, 0.5);
    for (problem, kind, word) in [
        (&plane, FrictionSolverKind::Lemke, "without friction"),
        (&space, FrictionSolverKind::Enumeration, "disc"),
        (&plane, FrictionSolverKind::Enumeration, "combinations"),
    ] {
        let (impulses, outcome) = solve_matrix(problem, kind, 1e-8);
        assert!(!outcome.solved && outcome.reason.contains(word), "{outcome:?}");
        assert!(impulses.iter().all(|r| *r == 0.0));
    }
}

/// A body pressed by two facing walls that both ask it to come closer: no impulses do that. Enumeration proves it; the
/// others come to an end without solving it, with numbers that are finite.
#[test]
fn a_contradiction_is_reported_by_every_solver() {
    let matrix = Csr::from_rows(2, [vec![(0, 1.0), (1, -1.0)], vec![(0, -1.0), (1, 1.0)]].into_iter());
    let problem = FrictionProblem {
        dimension: 1,
        matrix: matrix.into(),
        velocity: vec![-1.0, -0.5],
        friction: vec![0.0; 2],
    };
    for kind in FrictionSolverKind::ALL {
        let mut impulses = vec![0.0; 2];
        let settings = FrictionSettings { iterations: 2000, ..FrictionSettings::default() };
        let outcome = kind.make().solve(&problem, &settings, &mut impulses, &mut unwatched);
        assert!(!outcome.solved && !outcome.reason.is_empty(), "{}", kind.name());
        assert!(impulses.iter().all(|r| r.is_finite() && *r >= 0.0), "{}: {impulses:?}", kind.name());
    }
    let (_, outcome) = solve_matrix(&problem, FrictionSolverKind::Enumeration, 1e-8);
    assert!(outcome.reason.contains("none of 4 combinations"), "{}", outcome.reason);
}

/// The same on bodies: a ball between two walls that close in.
fn enumeration_on_bodies_proves_a_contradiction<S: Space>() {
    let mut problem = cradle::<S>(&[0.0, 0.0, 0.0]);
    problem.inverse_masses[0] = obstacle();
    problem.inverse_masses[2] = obstacle();
    (problem.velocities[0], problem.velocities[2]) = (moving(along(0, 1.0)), moving(along(0, -1.0)));
    let (impulses, outcome) = solve(&problem, SolverKind::Enumeration, 1, 1e-9);
    assert!(impulses.flat().iter().all(|g| *g == 0.0));
    assert!(matches!(&outcome.stop, Stop::Refused(why) if why.contains("none of 4")), "{outcome:?}");
}

/// The solvers by their names, and an unknown name with the known ones.
#[test]
fn matrix_solvers_are_found_by_their_names() {
    for kind in FrictionSolverKind::ALL {
        assert_eq!(kind.name().parse::<FrictionSolverKind>(), Ok(kind));
        assert_eq!(kind.make().name(), kind.name());
    }
    let error = "direct".parse::<FrictionSolverKind>().expect_err("unknown");
    assert!(error.contains("\"direct\"") && error.contains("apgd"), "{error}");
}

in_both_spaces! {
    every_method_is_measured_to_solve_random_problems;
    both_forms_of_a_method_agree;
    enumeration_on_bodies_proves_a_contradiction;
}
