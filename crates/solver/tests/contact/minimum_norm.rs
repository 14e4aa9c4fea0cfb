//! Minimum-norm impulses: least of all that solve, the same in every order and from every start, and asked for in vain
//! where a solver does not look for them.

use crate::common::*;
use crate::contact::scenes::*;
use crate::contact::solvers::{assembled, solve_matrix};
use crate::contact::symmetry::shuffled;
use carom_math::{Column, Space, Spatial};
use carom_solver::exact::Exact;
use carom_solver::{
    Contact, ContactProblem, FrictionLaw, FrictionSettings, FrictionSolverKind, Impulse, ImpulseChoice,
    Impulses, Outcome, SolveSettings, SolverKind, Stop, Twist,
};

fn settings(tolerance: f64, impulses: ImpulseChoice) -> SolveSettings {
    SolveSettings { tolerance, impulses, ..SolveSettings::default() }
}

fn least_from<S: Space>(
    problem: &ContactProblem<S>,
    kind: SolverKind,
    mut impulses: Impulses<S>,
) -> (Impulses<S>, Outcome) {
    let outcome = kind.make().solve(problem, &settings(1e-6, ImpulseChoice::MinimumNorm), &mut impulses);
    (impulses, outcome)
}

/// The minimum-norm impulses, or a failure.
#[track_caller]
fn least<S: Space>(what: &str, problem: &ContactProblem<S>) -> Impulses<S> {
    let (impulses, outcome) = least_from(problem, SolverKind::Exact, Impulses::zero(problem));
    assert_eq!(outcome.stop, Stop::Converged, "{what}: {outcome:?}");
    impulses
}

fn dot<S: Space>(a: &Impulses<S>, b: &Impulses<S>) -> f64 {
    a.flat().iter().zip(b.flat()).map(|(a, b)| a * b).sum()
}

/// C25: four legs of a square table loaded at (.3, .1) carry .35, .2, .15 and .3 of its weight, with and without
/// friction, by every door.
#[test]
fn a_table_on_four_legs_carries_the_least_forces() {
    let legs = [(1.0, 1.0), (-1.0, 1.0), (-1.0, -1.0), (1.0, -1.0)];
    for friction in [0.0, 0.4] {
        let problem = table::<Spatial>(&legs, (0.3, 0.1), friction);
        for kind in [SolverKind::Exact, SolverKind::Auto] {
            let (impulses, outcome) = least_from(&problem, kind, Impulses::zero(&problem));
            assert_eq!(outcome.stop, Stop::Converged, "{outcome:?}");
            for (g, share) in impulses.contacts.iter().zip([0.35, 0.2, 0.15, 0.3]) {
                assert_close(g.normal / FALL, share, 1e-12, "share of a leg");
                assert_close(g.tangent.norm() / FALL, 0.0, 1e-12, "no leg pushes sideways");
            }
        }
    }
}

/// Structures that are hyperstatic, that slide, that fall, that hardly touch.
fn problems<S: Space>() -> Vec<(String, ContactProblem<S>)> {
    let legs = |count: usize| -> Vec<(f64, f64)> {
        (0..count).map(|k| (std::f64::consts::TAU * k as f64 / count as f64).sin_cos()).collect()
    };
    let mut sliding = table::<S>(&legs(6), (0.2, 0.1), 0.3);
    sliding.velocities[1] = Twist::new(at::<S>(2.0, 1.0, -FALL), S::Spin::ZERO);
    let mut spinning = sliding.clone();
    spinning.velocities[1].angular = Random::new(5).column(0.4);
    let mut all = vec![
        ("a stack".to_owned(), stack::<S>(&[1.0, 3.0, 0.2, 100.0], 0.5)),
        ("a stack without friction".to_owned(), stack::<S>(&[1.0, 3.0, 0.2, 100.0], 0.0)),
        ("a wall".to_owned(), wall::<S>(3, 3, 0.6)),
        ("a larger wall".to_owned(), wall::<S>(5, 6, 0.5)),
        ("an arch".to_owned(), arch::<S>(7, 0.8)),
        ("an arch that falls".to_owned(), arch::<S>(7, 0.05)),
        ("cards".to_owned(), a_frame::<S>(0.4, 0.4)),
        ("a table".to_owned(), table::<S>(&legs(5), (0.2, 0.1), 0.4)),
        ("a table with a loaded edge".to_owned(), table::<S>(&legs(8), (0.9, 0.0), 0.4)),
        ("a table that slides".to_owned(), sliding),
        ("a table that slides and turns".to_owned(), spinning),
        ("an overhang".to_owned(), overhang::<S>(4, 0.9, 0.5)),
        ("a box on a slope".to_owned(), box_on_slope::<S>(0.4, 1.0, 0.3, 0.9)),
        ("a box that slides down".to_owned(), box_on_slope::<S>(0.4, 1.0, 0.3, 0.1)),
    ];
    let mut random = Random::new(12);
    for k in 0..6 {
        let recipe = Recipe { bodies: 5, contacts: 9, rows: 0, friction: 0.3, law: FrictionLaw::Disc };
        all.push((format!("random {k}"), random_problem::<S>(&mut random, recipe)));
    }
    all
}

/// What each contact does to the world, in a fixed order, for bodies named by `order`.
fn forces<S: Space>(problem: &ContactProblem<S>, impulses: &Impulses<S>) -> Vec<(u64, S::Vector)> {
    let contacts = problem.contacts.iter().zip(&impulses.contacts);
    let mut all: Vec<(u64, S::Vector)> = contacts.map(|(c, g)| (c.id, c.to_world(g))).collect();
    all.sort_by_key(|f| f.0);
    all
}

/// Contacts and bodies in other orders, the other body first, starts of any kind: the impulses stay.
fn order_and_start_change_no_impulse<S: Space>() {
    let mut random = Random::new(71);
    for (what, problem) in problems::<S>() {
        let wanted = forces(&problem, &least(&what, &problem));
        let size = wanted.iter().map(|f| f.1.norm()).fold(f64::MIN_POSITIVE, f64::max);
        for round in 0..4 {
            let contacts = shuffled(&mut random, problem.contacts.len());
            let bodies = shuffled(&mut random, problem.velocities.len());
            let mut changed = problem.clone();
            for (old, &new) in bodies.iter().enumerate() {
                changed.inverse_masses[new] = problem.inverse_masses[old];
                changed.velocities[new] = problem.velocities[old];
            }
            let moved = |c: &Contact<S>| Contact { a: bodies[c.a], b: bodies[c.b], ..*c };
            changed.contacts = contacts.iter().map(|&k| moved(&problem.contacts[k])).collect();
            let mut turned = vec![false; problem.contacts.len()];
            for c in changed.contacts.iter_mut().filter(|_| random.chance(0.5)) {
                turned[problem.contacts.iter().position(|o| o.id == c.id).expect("the same contacts")] = true;
                *c = Contact { a: c.b, b: c.a, arm_a: c.arm_b, arm_b: c.arm_a, normal: -c.normal, ..*c };
            }
            let mut start = Impulses::zero(&changed);
            for g in start.contacts.iter_mut().filter(|_| round > 0) {
                *g = Impulse { normal: random.between(0.0, 0.1), tangent: random.column(0.1) };
            }
            let (found, outcome) = least_from(&changed, SolverKind::Exact, start);
            assert_eq!(outcome.stop, Stop::Converged, "{what}: {outcome:?}");
            let mut got = forces(&changed, &found);
            got.iter_mut().zip(&turned).filter(|(_, turned)| **turned).for_each(|(f, _)| f.1 = -f.1);
            for ((_, wanted), (id, got)) in wanted.iter().zip(&got) {
                let off = (*wanted - *got).norm() / size;
                assert!(off <= 1e-10, "{what}, order {round}, contact {id}: off by {off:e}");
            }
        }
    }
}

/// x is the least of a convex set iff x . (y - x) >= 0 for all y in it: tried with the answers that other starts and
/// other solvers find, which have the same wrenches.
fn no_other_solution_is_smaller<S: Space>() {
    let mut random = Random::new(72);
    for (what, problem) in problems::<S>() {
        let x = least(&what, &problem);
        let size = dot(&x, &x).max(f64::MIN_POSITIVE);
        for kind in [SolverKind::Exact, SolverKind::Nncg, SolverKind::Apgd] {
            for _ in 0..6 {
                let mut y = Impulses::zero(&problem);
                for g in &mut y.contacts {
                    *g = Impulse { normal: random.between(0.0, 0.1), tangent: random.column(0.1) };
                }
                let settings = SolveSettings { iterations: 20_000, ..settings(1e-11, ImpulseChoice::Any) };
                let outcome = kind.make().solve(&problem, &settings, &mut y);
                if outcome.stop != Stop::Converged
                    || apart(&wrenches(&problem, &x), &wrenches(&problem, &y)) > 1e-9
                {
                    continue;
                }
                let slope = (dot(&x, &y) - dot(&x, &x)) / size;
                assert!(slope >= -1e-7, "{what}: {} finds a smaller one, slope {slope:e}", kind.name());
            }
        }
    }
}

/// The matrix form finds the impulses that the bodies have.
fn the_matrix_form_finds_the_same_impulses<S: Space>() {
    for (what, problem) in problems::<S>() {
        let wanted = least(&what, &problem).flat();
        let size = wanted.iter().fold(f64::MIN_POSITIVE, |m, x| m.max(x.abs()));
        let asked = FrictionSettings { impulses: ImpulseChoice::MinimumNorm, ..FrictionSettings::default() };
        let (found, outcome) = solve_matrix(&mut Exact::default(), &assembled(&problem), &asked);
        assert!(outcome.solved, "{what}: {outcome:?}");
        let off = wanted.iter().zip(&found).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max) / size;
        assert!(off <= 1e-9, "{what}: off by {off:e}");
    }
}

/// Every solver either looks for the least impulses or says that it does not, and who does.
#[test]
fn solvers_that_do_not_look_for_the_least_impulses_say_so() {
    let problem = table::<Spatial>(&[(1.0, 1.0), (-1.0, 1.0), (-1.0, -1.0), (1.0, -1.0)], (0.3, 0.1), 0.0);
    for kind in SolverKind::ALL {
        let (impulses, outcome) = least_from(&problem, kind, Impulses::zero(&problem));
        match &outcome.stop {
            Stop::Refused(why) => {
                assert!(why.contains("minimum_norm") && why.contains("exact"), "{}: {why}", kind.name());
                assert_eq!(impulses, Impulses::zero(&problem), "{} touches what it refuses", kind.name());
            }
            stop => {
                assert_eq!(*stop, Stop::Converged, "{}", kind.name());
                assert!(matches!(kind, SolverKind::Exact | SolverKind::Auto), "{}", kind.name());
            }
        }
    }
    let asked = FrictionSettings { impulses: ImpulseChoice::MinimumNorm, ..FrictionSettings::default() };
    for kind in FrictionSolverKind::ALL {
        let (_, outcome) = solve_matrix(kind.make().as_mut(), &assembled(&problem), &asked);
        assert_eq!(outcome.solved, kind == FrictionSolverKind::Exact, "{}: {outcome:?}", kind.name());
        assert!(outcome.solved || outcome.reason.contains("minimum_norm"), "{}", outcome.reason);
    }
}

in_both_spaces! {
    order_and_start_change_no_impulse;
    no_other_solution_is_smaller;
    the_matrix_form_finds_the_same_impulses;
}
