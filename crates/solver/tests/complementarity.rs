//! Complementarity of what solvers return: contacts that push where they hold and let go where they part, bounded
//! rows at and between their bounds, equality rows (theory eqs. 5.9 and 5.11; items 31, 33, 34, 41, 44).

use crate::common::*;
use carom_math::{Column, Space};
use carom_solver::{BoundedRow, ContactProblem, FrictionLaw, SolverKind, Stop, Twist};

/// The solvers that take every kind of row.
const GENERAL: [SolverKind; 3] = [SolverKind::Pgs, SolverKind::PgsMatrix, SolverKind::Lemke];

/// Items 33, 44: 0 <= gamma _|_ u - target >= 0 at every contact, both sides taken by some of them.
fn contacts_push_where_they_hold_and_let_go_where_they_part<S: Space>() {
    let mut random = Random::new(33);
    let (mut held, mut parted) = (0, 0);
    for _ in 0..20 {
        let recipe = Recipe { bodies: 9, contacts: 12, rows: 0, friction: 0.0, law: FrictionLaw::Disc };
        let problem = random_problem::<S>(&mut random, recipe);
        for kind in GENERAL {
            let impulses = solved(&problem, kind, 1e-10);
            let after = problem.velocities_after(&impulses);
            for (c, g) in problem.contacts.iter().zip(&impulses.contacts) {
                let w = c.relative_velocity(&after).0 - c.target;
                assert!(g.normal >= 0.0 && w >= -1e-10, "{}: gamma {}, w {w}", kind.name(), g.normal);
                assert!(
                    g.normal < 1e-9 || w < 1e-9,
                    "{}: gamma {} pushes what parts with {w}",
                    kind.name(),
                    g.normal
                );
                held += (g.normal > 1e-6) as usize;
                parted += (w > 1e-6) as usize;
            }
        }
    }
    assert!(held > 100 && parted > 100, "{held} held, {parted} parted");
}

/// Item 34: lambda = lo => w >= 0, lambda = hi => w <= 0, between w = 0; all three happen.
fn bounded_rows_are_at_a_bound_or_meet_their_target<S: Space>() {
    let mut random = Random::new(34);
    let (mut at_lo, mut at_hi, mut between) = (0, 0, 0);
    for _ in 0..20 {
        let recipe = Recipe { bodies: 9, contacts: 4, rows: 10, friction: 0.0, law: FrictionLaw::Disc };
        let problem = random_problem::<S>(&mut random, recipe);
        for kind in GENERAL {
            let impulses = solved(&problem, kind, 1e-10);
            let after = problem.velocities_after(&impulses);
            for (r, &l) in problem.rows.iter().zip(&impulses.rows) {
                let w = r.on_a.dot(&after[r.a]) + r.on_b.dot(&after[r.b]) - r.target;
                assert!(l >= r.lo && l <= r.hi, "{}: {l} outside [{}, {}]", kind.name(), r.lo, r.hi);
                if l == r.lo {
                    at_lo += 1;
                    assert!(w >= -1e-10, "{}: at lo, w = {w}", kind.name());
                } else if l == r.hi {
                    at_hi += 1;
                    assert!(w <= 1e-10, "{}: at hi, w = {w}", kind.name());
                } else {
                    between += 1;
                    assert!(w.abs() <= 1e-9, "{}: between, w = {w}", kind.name());
                }
            }
        }
    }
    assert!(at_lo > 30 && at_hi > 30 && between > 30, "{at_lo} at lo, {at_hi} at hi, {between} between");
}

/// A motor with a torque limit: it reaches the speed asked for when the limit allows, else it gives all it has.
/// Every solver that takes rows; the direct one only while the limit is not reached.
fn a_motor_gives_at_most_its_limit<S: Space>() {
    let spin = |rate: f64| Twist::<S>::new(S::Vector::ZERO, along(S::SPIN - 1, rate));
    for (limit, reached) in [(1.0, true), (0.05, false)] {
        let mut problem =
            ContactProblem::new(vec![ball::<S>(2.0, 0.5), obstacle()], vec![Twist::default(); 2]);
        let row = BoundedRow {
            id: 1,
            a: 0,
            b: 1,
            on_a: spin(1.0),
            on_b: spin(-1.0),
            target: 3.0,
            lo: -limit,
            hi: limit,
        };
        problem.rows.push(row);
        let inertia = 2.0 * 0.25 * if S::SPIN == 1 { 0.5 } else { 0.4 };
        for kind in [SolverKind::Pgs, SolverKind::PgsMatrix, SolverKind::Lemke, SolverKind::Direct] {
            let (impulses, outcome) = solve(&problem, kind, 10, 1e-14);
            if kind == SolverKind::Direct && !reached {
                assert!(matches!(&outcome.stop, Stop::Refused(why) if why.contains("row 0")), "{outcome:?}");
                continue;
            }
            assert_eq!(outcome.stop, Stop::Converged, "{}", kind.name());
            let wanted = if reached { 3.0 * inertia } else { limit };
            assert_close(impulses.rows[0], wanted, 1e-15, kind.name());
            let rate = problem.velocities_after(&impulses)[0].angular[S::SPIN - 1];
            assert_close(rate, wanted / inertia, 1e-14, kind.name());
        }
    }
}

/// Item 31: equality rows (both bounds infinite) are met exactly by the direct solver and by Lemke: a chain of
/// bodies pinned together, hung up at one end.
fn equality_rows_are_met_by_factorisation_and_by_pivoting<S: Space>() {
    let mut random = Random::new(31);
    let count = 6;
    let mut problem = ContactProblem::<S>::new(vec![obstacle()], vec![Twist::default()]);
    for body in 1..=count {
        problem.inverse_masses.push(random.inverse_mass());
        problem.velocities.push(random.twist(1.0));
        let (arm_a, arm_b): (S::Vector, S::Vector) = (random.column(0.5), random.column(0.5));
        for k in 0..S::DIM {
            let axis: S::Vector = along(k, 1.0);
            let on_a = Twist::new(axis, S::moment(arm_a, axis));
            let on_b = Twist::new(-axis, -S::moment(arm_b, axis));
            let (lo, hi) = (f64::NEG_INFINITY, f64::INFINITY);
            problem.rows.push(BoundedRow { id: 0, a: body, b: body - 1, on_a, on_b, target: 0.0, lo, hi });
        }
    }
    problem.check().expect("sound");
    let mut answers = Vec::new();
    for kind in [SolverKind::Direct, SolverKind::Lemke] {
        let (impulses, outcome) = solve(&problem, kind, 1, 1e-12);
        assert_eq!(outcome.stop, Stop::Converged, "{}: {:e}", kind.name(), outcome.residual.absolute);
        assert!(outcome.residual.relative < 1e-13, "{}", kind.name());
        assert!(impulses.rows.iter().any(|l| *l < -0.01) && impulses.rows.iter().any(|l| *l > 0.01));
        answers.push(impulses.rows);
    }
    answers[0].iter().zip(&answers[1]).for_each(|(d, l)| assert_close(*d, *l, 1e-12, "direct and lemke"));
}

/// A row may name one body twice (a body against itself has no relative motion): its coefficients add up.
fn a_row_with_one_body_twice_has_the_sum_of_its_coefficients<S: Space>() {
    let row = |b: usize, on_a: f64, on_b: f64| BoundedRow::<S> {
        id: 0,
        a: 0,
        b,
        on_a: moving(along(0, on_a)),
        on_b: moving(along(0, on_b)),
        target: 1.0,
        lo: f64::NEG_INFINITY,
        hi: f64::INFINITY,
    };
    let mut problem = ContactProblem::<S>::new(vec![ball(2.0, 0.5), obstacle()], vec![Twist::default(); 2]);
    for (b, on_a, on_b) in [(0, 0.25, 0.75), (0, 1.0, 0.0), (1, 1.0, 0.5)] {
        problem.rows = vec![row(b, on_a, on_b)];
        problem.check().expect("moves the body");
        for kind in [SolverKind::Pgs, SolverKind::PgsMatrix, SolverKind::Lemke, SolverKind::Direct] {
            let impulses = solved(&problem, kind, 1e-14);
            assert_close(impulses.rows[0], 2.0, 1e-14, kind.name());
            assert_close(problem.velocities_after(&impulses)[0].linear[0], 1.0, 1e-14, kind.name());
        }
    }
    problem.rows = vec![row(0, 1.0, -1.0)];
    assert!(problem.check().is_err(), "opposite coefficients on one body move nothing");
}

/// Items 33, 44: where the solution is unique (A regular), sweeps and pivoting find the same impulses.
fn sweeps_and_pivoting_agree_where_the_solution_is_unique<S: Space>() {
    let mut random = Random::new(35);
    for _ in 0..20 {
        let recipe = Recipe { bodies: 9, contacts: 5, rows: 3, friction: 0.0, law: FrictionLaw::Disc };
        let problem = random_problem::<S>(&mut random, recipe);
        let answers = GENERAL.map(|kind| solved(&problem, kind, 1e-12).flat());
        for other in &answers[1..] {
            for (x, y) in answers[0].iter().zip(other) {
                assert_close(*x, *y, 1e-9 * (1.0 + x.abs()), "impulse");
            }
        }
    }
}

/// Where A is singular the impulses of solvers may differ, the velocities not (theory eq. 5.14).
fn velocities_are_unique_where_impulses_are_not<S: Space>() {
    let mut random = Random::new(36);
    for _ in 0..10 {
        let recipe = Recipe { bodies: 4, contacts: 30, rows: 0, friction: 0.0, law: FrictionLaw::Disc };
        let problem = random_problem::<S>(&mut random, recipe);
        let answers = GENERAL.map(|kind| problem.velocities_after(&solved(&problem, kind, 1e-11)));
        for other in &answers[1..] {
            for (v, w) in answers[0].iter().zip(other) {
                assert_column_close(v.linear, w.linear, 1e-8, "velocity");
                assert_column_close(v.angular, w.angular, 1e-7, "spin");
            }
        }
    }
}

in_both_spaces! {
    contacts_push_where_they_hold_and_let_go_where_they_part;
    bounded_rows_are_at_a_bound_or_meet_their_target;
    a_motor_gives_at_most_its_limit;
    equality_rows_are_met_by_factorisation_and_by_pivoting;
    a_row_with_one_body_twice_has_the_sum_of_its_coefficients;
    sweeps_and_pivoting_agree_where_the_solution_is_unique;
    velocities_are_unique_where_impulses_are_not;
}
