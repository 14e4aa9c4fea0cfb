//! Projected Gauss-Seidel: that it converges and how (items 27, 35, 37), and that the form on bodies and the form on
//! the matrix are one method (item 45) (theory chapter 5, sections 5.4 and 5.6).

use crate::common::*;
use carom_math::{Column, Space};
use carom_solver::delassus::{delassus, right_hand_side};
use carom_solver::{ContactProblem, FrictionLaw, Impulses, SolveSettings, SolverKind, Stop, residual};

const PLAIN: Recipe = Recipe { bodies: 8, contacts: 14, rows: 0, friction: 0.0, law: FrictionLaw::Disc };

/// f = 1/2 x^T A x - b^T x (theory eq. 5.10).
fn energy<S: Space>(problem: &ContactProblem<S>, x: &[f64]) -> f64 {
    let (ax, b) = (delassus(problem).times(x), right_hand_side(problem));
    x.iter().zip(&ax).zip(&b).map(|((x, ax), b)| x * (0.5 * ax - b)).sum()
}

/// Items 27, 35, 37: with fixed bounds every row's step takes at least 1/2 a_ii step^2 off the energy (theory
/// eq. 5.16), so sweeps lower it; rows of all kinds take part.
fn every_sweep_lowers_the_quadratic_energy_by_at_least_its_steps<S: Space>() {
    let mut random = Random::new(37);
    for _ in 0..30 {
        let problem = random_problem::<S>(&mut random, Recipe { rows: 4, ..PLAIN });
        let a = delassus(&problem).dense();
        let mut solver = SolverKind::Pgs.make::<S>();
        let mut impulses = Impulses::zero(&problem);
        // the start that a solver makes of zero: inside all bounds
        carom_solver::cone::project(&problem, &mut impulses);
        let mut before = energy(&problem, &impulses.flat());
        for _ in 0..30 {
            let old = impulses.flat();
            solver.solve(
                &problem,
                &SolveSettings { iterations: 1, tolerance: 0.0, ..SolveSettings::default() },
                &mut impulses,
            );
            let new = impulses.flat();
            let after = energy(&problem, &new);
            let steps: f64 = (0..new.len()).map(|i| 0.5 * a[i][i] * (new[i] - old[i]).powi(2)).sum();
            assert!(after <= before - steps + 1e-13 * (1.0 + before.abs()), "{after} > {before} - {steps}");
            before = after;
        }
    }
}

/// Items 27, 37: linear convergence of energy and velocities to the unique solution, the velocities bounded by the
/// energy, 1/2 |v - v+|_M^2 <= f - f* (theory eq. 5.17), also when A is singular.
fn sweeps_converge_linearly_to_the_unique_velocities<S: Space>() {
    let mut random = Random::new(27);
    for contacts in [6, 14, 40] {
        let problem = random_problem::<S>(&mut random, Recipe { contacts, ..PLAIN });
        let exact = solved(&problem, SolverKind::Lemke, 1e-10);
        let (best, v) = (energy(&problem, &exact.flat()), problem.velocities_after(&exact));
        let mut excess = Vec::new();
        for sweeps in [0, 50, 100, 200, 400, 800, 1600] {
            let (impulses, _) = solve(&problem, SolverKind::Pgs, sweeps, 0.0);
            let difference: Vec<_> = problem
                .velocities_after(&impulses)
                .iter()
                .zip(&v)
                .map(|(p, q)| carom_solver::Twist::new(p.linear - q.linear, p.angular - q.angular))
                .collect();
            let distance = kinetic_energy(&problem, &difference);
            excess.push(energy(&problem, &impulses.flat()) - best);
            assert!(distance <= excess[excess.len() - 1] + 1e-12, "{distance:e} > {excess:?}");
        }
        assert!(excess.windows(2).all(|w| w[1] <= w[0] + 1e-13), "{excess:?}");
        assert!(excess[6] < 1e-3 * excess[0] + 1e-12, "{contacts} contacts: {excess:?}");
    }
}

/// Item 27: the number of sweeps for every further digit stays the same (a linear rate), and it is bad for a heavy
/// body on light ones: the figures of a column of five with the uppermost ten times as heavy.
fn a_heavy_body_on_light_ones_slows_the_sweeps_down<S: Space>() {
    let sweeps = |top: f64, tolerance: f64| {
        let problem = column::<S>(&[1.0, 1.0, 1.0, 1.0, top], 0.0);
        let (_, outcome) = solve(&problem, SolverKind::Pgs, 1_000_000, tolerance);
        assert_eq!(outcome.stop, Stop::Converged);
        outcome.iterations as f64
    };
    let digits: Vec<f64> = [1e-4, 1e-6, 1e-8, 1e-10].map(|tolerance| sweeps(1.0, tolerance)).to_vec();
    let steps: Vec<f64> = digits.windows(2).map(|w| w[1] - w[0]).collect();
    for step in &steps {
        assert!((step / steps[2] - 1.0).abs() < 0.05, "{digits:?}");
    }
    assert!(sweeps(10.0, 1e-8) > 3.0 * sweeps(1.0, 1e-8));
}

/// A sweep that starts at a solution stays there, from any solution of a redundant problem.
fn a_solution_given_as_warm_start_is_kept<S: Space>() {
    let mut random = Random::new(28);
    for kind in [SolverKind::Pgs, SolverKind::PgsMatrix] {
        for _ in 0..10 {
            let problem = random_problem::<S>(&mut random, Recipe { contacts: 30, ..PLAIN });
            let exact = solved(&problem, SolverKind::Lemke, 1e-10);
            let mut impulses = exact.clone();
            let settings = SolveSettings { iterations: 100, tolerance: 1e-10, ..SolveSettings::default() };
            let outcome = kind.make().solve(&problem, &settings, &mut impulses);
            assert_eq!((outcome.stop, outcome.iterations), (Stop::Converged, 1));
            for (got, wanted) in impulses.flat().iter().zip(exact.flat()) {
                assert_close(*got, wanted, 1e-9, kind.name());
            }
        }
    }
}

/// Item 45: on bodies and on the matrix the same numbers come out, sweep by sweep, to 1e-12 of the largest impulse:
/// rigid bodies and particles, friction of both laws, bounded rows, warm starts.
fn the_matrix_form_and_the_iterative_form_are_one_method<S: Space>() {
    let mut random = Random::new(45);
    for case in 0..40 {
        let law = if case % 2 == 0 { FrictionLaw::Disc } else { FrictionLaw::Box };
        let recipe = Recipe { bodies: 7, contacts: 16, rows: 5, friction: 1.0, law };
        let mut problem = random_problem::<S>(&mut random, recipe);
        if case % 3 == 0 {
            problem.inverse_masses[2] = particle(0.7);
        }
        problem.check().expect("a sound problem");
        let start: Vec<f64> = (0..problem.scalar_rows()).map(|_| random.between(-0.2, 0.4)).collect();
        for sweeps in [0, 1, 2, 3, 10, 100] {
            let [bodies, matrix] = [SolverKind::Pgs, SolverKind::PgsMatrix].map(|kind| {
                let mut impulses = Impulses::from_flat(&problem, &start).expect("fits");
                let settings =
                    SolveSettings { iterations: sweeps, tolerance: 0.0, ..SolveSettings::default() };
                let outcome = kind.make().solve(&problem, &settings, &mut impulses);
                assert_eq!(outcome.iterations, sweeps);
                impulses.flat()
            });
            let largest = bodies.iter().fold(1.0, |m: f64, x| m.max(x.abs()));
            for (x, y) in bodies.iter().zip(&matrix) {
                assert_close(*x, *y, 1e-12 * largest, "iterative and matrix form");
            }
        }
    }
}

/// Item 45, to the end: both stop after the same sweep with the same residual.
fn both_forms_stop_at_the_same_sweep<S: Space>() {
    let mut random = Random::new(46);
    for _ in 0..10 {
        let problem =
            random_problem::<S>(&mut random, Recipe { friction: 0.5, rows: 2, contacts: 8, ..PLAIN });
        let (_, bodies) = solve(&problem, SolverKind::Pgs, 100_000, 1e-8);
        let (_, matrix) = solve(&problem, SolverKind::PgsMatrix, 100_000, 1e-8);
        assert_eq!((&bodies.stop, bodies.iterations), (&matrix.stop, matrix.iterations));
        assert_eq!(bodies.stop, Stop::Converged);
        assert_close(bodies.residual.absolute, matrix.residual.absolute, 1e-13, "residual");
    }
}

/// What is reported is the residual of what is returned, for any number of sweeps.
fn the_outcome_tells_the_residual_of_the_impulses_returned<S: Space>() {
    let mut random = Random::new(47);
    let problem = random_problem::<S>(&mut random, Recipe { friction: 0.5, rows: 2, ..PLAIN });
    for kind in SolverKind::ALL {
        for iterations in [0, 1, 7, 200] {
            let (impulses, outcome) = solve(&problem, kind, iterations, 1e-3);
            assert_eq!(outcome.residual, residual(&problem, &impulses), "{}", kind.name());
            if outcome.stop == Stop::Converged {
                assert!(outcome.residual.absolute <= 1e-3 && outcome.residual.relative < 1.0);
            }
        }
    }
}

/// Items 35, 36: the unknowns stay inside cone and bounds at every sweep, whatever the warm start.
fn impulses_stay_inside_their_cones_and_bounds_at_every_sweep<S: Space>() {
    let mut random = Random::new(48);
    for law in [FrictionLaw::Disc, FrictionLaw::Box] {
        let problem = random_problem::<S>(&mut random, Recipe { friction: 0.7, rows: 6, law, ..PLAIN });
        for sweeps in 0..20 {
            let start: Vec<f64> = (0..problem.scalar_rows()).map(|_| random.between(-1.0, 1.0)).collect();
            let mut impulses = Impulses::from_flat(&problem, &start).expect("fits");
            let settings = SolveSettings { iterations: sweeps, tolerance: 0.0, ..SolveSettings::default() };
            SolverKind::Pgs.make().solve(&problem, &settings, &mut impulses);
            for (c, g) in problem.contacts.iter().zip(&impulses.contacts) {
                let limit = c.friction * g.normal * (1.0 + 1e-15);
                let size = if law == FrictionLaw::Box { g.tangent.max_abs() } else { g.tangent.norm() };
                assert!(g.normal >= 0.0 && size <= limit, "{g:?}, limit {limit}");
            }
            for (r, l) in problem.rows.iter().zip(&impulses.rows) {
                assert!(*l >= r.lo && *l <= r.hi);
            }
        }
    }
}

/// A warm start counted for another problem, or one with numbers that are none, starts from zero.
fn a_warm_start_that_does_not_fit_is_no_warm_start<S: Space>() {
    let problem = random_problem::<S>(&mut Random::new(49), Recipe { friction: 0.5, rows: 2, ..PLAIN });
    for kind in SolverKind::ALL {
        let (wanted, wanted_outcome) = solve(&problem, kind, 20, 0.0);
        let mut short = Impulses::zero(&problem);
        short.contacts.truncate(3);
        let mut not_numbers = Impulses::zero(&problem);
        not_numbers.contacts[0].normal = f64::NAN;
        not_numbers.contacts[1].tangent = S::Slip::from_fn(|_| f64::INFINITY);
        not_numbers.rows[0] = f64::NAN;
        for mut start in [short, not_numbers] {
            let settings = SolveSettings { iterations: 20, tolerance: 0.0, ..SolveSettings::default() };
            let outcome = kind.make().solve(&problem, &settings, &mut start);
            if !matches!(outcome.stop, Stop::Refused(_)) {
                assert_eq!((start, outcome), (wanted.clone(), wanted_outcome.clone()), "{}", kind.name());
            }
        }
    }
}

/// Numbers that fit while their products do not: every solver hands back what it was given instead of infinities.
fn impulses_that_outgrow_all_numbers_are_taken_back<S: Space>() {
    let velocities = vec![moving(along(0, -1e300)), Default::default()];
    let mut problem = ContactProblem::<S>::new(vec![particle(1e10), obstacle()], velocities);
    problem.contacts.push(contact((0, S::Vector::ZERO), (1, S::Vector::ZERO), along(0, 1.0)));
    problem.check().expect("every number is finite");
    for kind in SolverKind::ALL {
        let mut impulses = Impulses::zero(&problem);
        impulses.contacts[0].normal = 0.5;
        let given = impulses.clone();
        let outcome = kind.make().solve(&problem, &SolveSettings::default(), &mut impulses);
        assert_eq!(impulses, given, "{}", kind.name());
        assert_eq!(outcome.residual, residual(&problem, &given), "{}", kind.name());
        assert!(matches!(&outcome.stop, Stop::Refused(_)), "{outcome:?}");
    }
}

in_both_spaces! {
    every_sweep_lowers_the_quadratic_energy_by_at_least_its_steps;
    sweeps_converge_linearly_to_the_unique_velocities;
    a_heavy_body_on_light_ones_slows_the_sweeps_down;
    a_solution_given_as_warm_start_is_kept;
    the_matrix_form_and_the_iterative_form_are_one_method;
    both_forms_stop_at_the_same_sweep;
    the_outcome_tells_the_residual_of_the_impulses_returned;
    impulses_stay_inside_their_cones_and_bounds_at_every_sweep;
    impulses_that_outgrow_all_numbers_are_taken_back;
    a_warm_start_that_does_not_fit_is_no_warm_start;
}
