//! Minimum-norm impulses beside bounded rows, rolling and spinning friction and box friction: moments first, then
//! forces; the same in every order and from every start.

use crate::common::*;
use crate::contact::scenes::*;
use crate::contact::symmetry::shuffled;
use carom_math::{Column, Space, Spatial};
use carom_solver::{
    BoundedRow, Contact, ContactProblem, FrictionLaw, Impulse, ImpulseChoice, Impulses, Outcome, Resistance,
    SolveSettings, SolverKind, Stop, Twist, residual,
};

const LEGS: [(f64, f64); 4] = [(1.0, 1.0), (-1.0, 1.0), (-1.0, -1.0), (1.0, -1.0)];
const SHARES: [f64; 4] = [0.35, 0.2, 0.15, 0.3];

fn least_from<S: Space>(problem: &ContactProblem<S>, mut impulses: Impulses<S>) -> (Impulses<S>, Outcome) {
    let settings =
        SolveSettings { tolerance: 1e-9, impulses: ImpulseChoice::MinimumNorm, ..SolveSettings::default() };
    let outcome = SolverKind::Exact.make().solve(problem, &settings, &mut impulses);
    (impulses, outcome)
}

/// The minimum-norm impulses, or a failure.
#[track_caller]
fn least<S: Space>(what: &str, problem: &ContactProblem<S>) -> Impulses<S> {
    let (impulses, outcome) = least_from(problem, Impulses::zero(problem));
    assert_eq!(outcome.stop, Stop::Converged, "{what}: {outcome:?}");
    assert_eq!(outcome.residual, residual(problem, &impulses), "{what}");
    impulses
}

fn resist<S: Space>(problem: &mut ContactProblem<S>, rolling: f64, spinning: f64) {
    let coefficient = |contact| Resistance { contact, rolling, spinning };
    problem.resistances = (0..problem.contacts.len()).map(coefficient).collect();
}

/// C25 with legs that resist rolling and spinning: nothing rolls, no leg holds a moment, the shares stay. With box
/// friction likewise.
#[test]
fn a_table_whose_legs_resist_rolling_carries_what_it_carries_without() {
    for friction in [0.0, 0.4] {
        for (rolling, law) in [(0.05, FrictionLaw::Disc), (0.05, FrictionLaw::Box), (0.0, FrictionLaw::Box)] {
            let mut problem = table::<Spatial>(&LEGS, (0.3, 0.1), friction);
            problem.friction_law = law;
            if rolling > 0.0 {
                resist(&mut problem, rolling, 0.02);
            }
            let impulses = least("a table", &problem);
            for (g, share) in impulses.contacts.iter().zip(SHARES) {
                assert_close(g.normal / FALL, share, 1e-12, "share of a leg");
                assert_close(g.tangent.norm() / FALL, 0.0, 1e-12, "no leg pushes sideways");
            }
            impulses.moments.iter().for_each(|m| assert_close(m.norm() / FALL, 0.0, 1e-12, "no moment"));
        }
    }
}

/// A ball on a slope that rolling friction holds has only one contact: the moment is what it must be, no less.
fn a_moment_that_is_needed_stays<S: Space>() {
    let (slope, radius) = (0.1_f64, 0.5);
    let mut scene = Scene::<S>::new();
    let ball = scene.body(ball(1.0, radius), at::<S>(0.0, 0.0, 1.0));
    let normal = at::<S>(-slope.sin(), 0.0, slope.cos());
    scene.touch(ball, 0, scene.centres[ball] - normal * radius, normal, 0.5);
    let mut problem = scene.problem;
    resist(&mut problem, 0.1, 0.0);
    let impulses = least("a ball that rests", &problem);
    assert_close(impulses.contacts[0].normal / FALL, slope.cos(), 1e-10, "normal");
    assert_close(impulses.contacts[0].tangent.norm() / FALL, slope.sin(), 1e-10, "friction");
    assert_close(impulses.moments[0].norm() / FALL, radius * slope.sin(), 1e-10, "moment");
}

/// A load held by the legs and by a pair of equal rows: the pair shares alike, whatever the start.
#[test]
fn redundant_rows_share_alike() {
    let mut problem = table::<Spatial>(&LEGS, (0.3, 0.1), 0.4);
    let on_a = Twist::new(at::<Spatial>(1.0, 0.0, 0.0), <Spatial as Space>::Spin::ZERO);
    problem.velocities[1].linear[0] = 0.3;
    for id in 0..2 {
        let (lo, hi) = (f64::NEG_INFINITY, f64::INFINITY);
        problem.rows.push(BoundedRow { id, a: 1, b: 0, on_a, on_b: Twist::default(), target: 0.0, lo, hi });
    }
    let wanted = least("a table held by two rows", &problem);
    assert_close(wanted.rows[0] - wanted.rows[1], 0.0, 1e-12, "shares of two equal rows");
    let tangents: f64 = wanted.contacts.iter().map(|g| g.tangent.norm()).sum();
    assert!(tangents > 1e-3 && wanted.rows[0].abs() > 1e-3, "rows and legs share: {wanted:?}");
    let mut start = Impulses::zero(&problem);
    start.rows = vec![5.0, -5.3];
    let (found, outcome) = least_from(&problem, start);
    assert_eq!(outcome.stop, Stop::Converged, "{outcome:?}");
    for (a, b) in found.flat().iter().zip(wanted.flat()) {
        assert_close(*a, b, 1e-10, "from another start");
    }
    // a bound that presses: the other row takes the rest
    problem.rows[0].lo = 0.5 * wanted.rows[0];
    let bound = least("one row at its bound", &problem);
    assert_close(bound.rows[0], problem.rows[0].lo, 1e-12, "at its bound");
    assert!(bound.rows[1] < wanted.rows[1], "{bound:?}");
}

/// Hyperstatic structures that resist, at rest, pushed and sliding, boxed, and tied by rows.
fn problems<S: Space>() -> Vec<(String, ContactProblem<S>)> {
    let mut random = Random::new(401);
    let legs: Vec<(f64, f64)> = (0..5).map(|k| (1.256 * k as f64).sin_cos()).collect();
    let mut sliding = table::<S>(&legs, (0.2, 0.1), 0.3);
    sliding.velocities[1] = Twist::new(at::<S>(2.0, 1.0, -FALL), S::Spin::ZERO);
    let mut spinning = sliding.clone();
    spinning.velocities[1].angular = Random::new(5).column(0.4);
    let structures = [
        ("a stack", stack::<S>(&[1.0, 3.0, 0.2], 0.5)),
        ("a wall", wall::<S>(3, 3, 0.6)),
        ("an arch", arch::<S>(5, 0.8)),
        ("a table", table::<S>(&legs, (0.2, 0.1), 0.4)),
        ("a table that slides", sliding),
        ("a table that slides and turns", spinning),
        ("cards", a_frame::<S>(0.4, 0.4)),
    ];
    let mut all = Vec::new();
    for (what, structure) in structures {
        let mut resisting = structure.clone();
        resist(&mut resisting, 0.02, 0.01);
        all.push((format!("{what} that resists"), resisting.clone()));
        let mut boxed = structure.clone();
        boxed.friction_law = FrictionLaw::Box;
        all.push((format!("{what} with boxes"), boxed));
        let bodies = structure.inverse_masses.len();
        let rows = Recipe { bodies, contacts: 0, rows: 2, friction: 0.0, law: FrictionLaw::Disc };
        resisting.rows = random_problem::<S>(&mut random, rows).rows;
        resisting.rows.iter_mut().for_each(|r| (r.lo, r.hi) = (f64::NEG_INFINITY, f64::INFINITY));
        resisting.rows.retain(|r| r.a != 0 && r.b != 0);
        let twins: Vec<_> = resisting.rows.iter().map(|r| BoundedRow { id: r.id + 10, ..*r }).collect();
        resisting.rows.extend(twins);
        all.push((format!("{what} tied by pairs of rows"), resisting));
    }
    all
}

/// What each contact, row and moment does, by its name.
fn told<S: Space>(problem: &ContactProblem<S>, impulses: &Impulses<S>) -> Vec<(u64, Vec<f64>)> {
    let mut all: Vec<(u64, Vec<f64>)> = Vec::new();
    for (c, g) in problem.contacts.iter().zip(&impulses.contacts) {
        all.push((c.id, c.to_world(g).as_slice().to_vec()));
    }
    for (r, l) in problem.rows.iter().zip(&impulses.rows) {
        all.push((1000 + r.id, vec![*l]));
    }
    for (r, m) in problem.resistances.iter().zip(&impulses.moments) {
        let c = &problem.contacts[r.contact];
        all.push((2000 + c.id, c.moment_to_world(*m).as_slice().to_vec()));
    }
    all.sort_by_key(|f| f.0);
    all
}

/// Contacts and rows in other orders, starts of any kind: the impulses stay.
fn order_and_start_change_no_impulse<S: Space>() {
    let mut random = Random::new(402);
    for (what, problem) in problems::<S>() {
        let wanted = told(&problem, &least(&what, &problem));
        let size = wanted.iter().flat_map(|f| &f.1).fold(f64::MIN_POSITIVE, |m, x| m.max(x.abs()));
        for round in 0..3 {
            let contacts = shuffled(&mut random, problem.contacts.len());
            let rows = shuffled(&mut random, problem.rows.len());
            let mut changed = problem.clone();
            changed.contacts = contacts.iter().map(|&k| problem.contacts[k]).collect::<Vec<Contact<S>>>();
            changed.rows = rows.iter().map(|&k| problem.rows[k]).collect();
            let mut start = Impulses::zero(&changed);
            for g in start.contacts.iter_mut().filter(|_| round > 0) {
                *g = Impulse { normal: random.between(0.0, 0.1), tangent: random.column(0.1) };
            }
            let (found, outcome) = least_from(&changed, start);
            assert_eq!(outcome.stop, Stop::Converged, "{what}: {outcome:?}");
            for ((id, wanted), (_, got)) in wanted.iter().zip(&told(&changed, &found)) {
                let off = wanted.iter().zip(got).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max) / size;
                assert!(off <= 1e-10, "{what}, order {round}, {id}: off by {off:e}");
            }
        }
    }
}

/// With the moments given x is the least of a convex set iff x . (y - x) >= 0 for all y in it; answers found from other
/// starts are in it where their moments and wrenches are the same, and never hold less moment.
fn no_other_solution_is_smaller<S: Space>() {
    let mut random = Random::new(403);
    let square = |v: &[f64]| v.iter().map(|v| v * v).sum::<f64>();
    let dot = |x: &[f64], y: &[f64]| x.iter().zip(y).map(|(a, b)| a * b).sum::<f64>();
    for (what, problem) in problems::<S>() {
        let x = least(&what, &problem);
        let plain = x.flat().len() - x.moments.len() * S::SPIN;
        let after = problem.velocities_after(&x);
        for _ in 0..6 {
            let mut y = Impulses::zero(&problem);
            for g in &mut y.contacts {
                *g = Impulse { normal: random.between(0.0, 0.1), tangent: random.column(0.1) };
            }
            let settings = SolveSettings { tolerance: 1e-11, ..SolveSettings::default() };
            let outcome = SolverKind::Exact.make().solve(&problem, &settings, &mut y);
            let moved = problem.velocities_after(&y).iter().zip(&after).fold(0.0_f64, |m, (a, b)| {
                m.max((a.linear - b.linear).max_abs()).max((a.angular - b.angular).max_abs())
            });
            if outcome.stop != Stop::Converged || moved > 1e-9 {
                continue;
            }
            let (x, y) = (x.flat(), y.flat());
            let size = square(&x[..plain]).max(f64::MIN_POSITIVE);
            if problem.resistances.is_empty() {
                let slope = (dot(&x, &y) - square(&x)) / size;
                assert!(slope >= -1e-7, "{what}: a smaller one, slope {slope:e}");
            } else if what.contains("slides") {
                // moments of contacts that turn follow their normal impulses and are not counted
            } else {
                let (own, other) = (&x[plain..], &y[plain..]);
                let slope = dot(own, other) - square(own);
                assert!(slope >= -1e-9 * size, "{what}: less moment, slope {slope:e} of {size:e}");
            }
        }
    }
}

in_both_spaces! {
    a_moment_that_is_needed_stays;
    order_and_start_change_no_impulse;
    no_other_solution_is_smaller;
}
