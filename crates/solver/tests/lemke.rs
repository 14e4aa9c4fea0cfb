//! Lemke's method against an independent search: every combination of states (open, stick, slide this way, slide
//! that way; at a bound or between) is one linear system, and those whose solution keeps its own promises are
//! all the solutions that exist.

use crate::common::*;
use carom_math::{Column, Planar, Space, Spatial};
use carom_solver::delassus::{delassus, right_hand_side};
use carom_solver::lcp::{LcpEnd, solve_lcp};
use carom_solver::{ContactProblem, FrictionLaw, Impulses, SolverKind, Stop, residual};

/// What a scalar row does in one of the combinations.
#[derive(Clone, Copy, Debug, PartialEq)]
enum State {
    /// The impulse has a fixed value.
    Fixed(f64),
    /// The velocity error is zero.
    Free,
    /// The impulse is a multiple of that of another row.
    Tied(f64, usize),
}

/// All solutions of a small problem with polyhedral friction, found by trying everything.
fn all_solutions<S: Space>(problem: &ContactProblem<S>) -> Vec<Impulses<S>> {
    let width = 1 + S::SLIP;
    let mut choices: Vec<Vec<State>> = Vec::new();
    for (i, c) in problem.contacts.iter().enumerate() {
        choices.push(vec![State::Fixed(0.0), State::Free]);
        for _ in 0..S::SLIP {
            let tied = [State::Tied(c.friction, i * width), State::Tied(-c.friction, i * width), State::Free];
            choices.push(if c.friction > 0.0 { tied.to_vec() } else { vec![State::Fixed(0.0)] });
        }
    }
    for r in &problem.rows {
        let bounds = [r.lo, r.hi].into_iter().filter(|b| b.is_finite()).map(State::Fixed);
        choices.push(bounds.chain([State::Free]).collect());
    }
    let (a, b) = (delassus(problem).dense(), right_hand_side(problem));
    let combinations: usize = choices.iter().map(Vec::len).product();
    let mut found = Vec::new();
    for mut number in 0..combinations {
        let states: Vec<State> = choices
            .iter()
            .map(|c| {
                let state = c[number % c.len()];
                number /= c.len();
                state
            })
            .collect();
        // an open contact has no friction either: skip its other combinations
        let open = |k: usize| states[k] == State::Fixed(0.0);
        let doubled = (0..problem.contacts.len())
            .any(|i| open(i * width) && (1..width).any(|k| matches!(states[i * width + k], State::Free)));
        if doubled {
            continue;
        }
        if let Some(flat) = solve_states(&a, &b, &states) {
            let impulses = Impulses::from_flat(problem, &flat).expect("as many numbers as rows");
            if residual(problem, &impulses).absolute < 1e-9 {
                found.push(impulses);
            }
        }
    }
    found
}

fn solve_states(a: &[Vec<f64>], b: &[f64], states: &[State]) -> Option<Vec<f64>> {
    let n = b.len();
    let (mut m, mut right) = (vec![vec![0.0; n]; n], vec![0.0; n]);
    for (i, state) in states.iter().enumerate() {
        match *state {
            State::Fixed(value) => (m[i][i], right[i]) = (1.0, value),
            State::Free => {
                m[i].clone_from(&a[i]);
                right[i] = b[i];
            }
            State::Tied(factor, to) => (m[i][i], m[i][to]) = (1.0, -factor),
        }
    }
    solve_dense(m, right)
}

/// Compares on many small problems; returns how many Lemke solved.
fn compare<S: Space>(start: u64, recipe: Recipe, count: usize) -> usize {
    let mut random = Random::new(start);
    let mut solved = 0;
    for case in 0..count {
        let problem = random_problem::<S>(&mut random, recipe);
        let all = all_solutions(&problem);
        let (impulses, outcome) = solve(&problem, SolverKind::Lemke, 1, 1e-10);
        match outcome.stop {
            Stop::Refused(reason) => {
                assert!(reason.contains("ray"), "{reason}");
                assert!(
                    recipe.friction > 0.0 || all.is_empty(),
                    "case {case}: refused, but there is a solution"
                );
            }
            _ => {
                solved += 1;
                assert!(
                    outcome.residual.absolute < 1e-11,
                    "case {case}: residual {:e}",
                    outcome.residual.absolute
                );
                let after = problem.velocities_after(&impulses);
                let same = |other: &Impulses<S>| {
                    let v = problem.velocities_after(other);
                    after.iter().zip(&v).all(|(p, q)| {
                        (p.linear - q.linear).max_abs() < 1e-8 && (p.angular - q.angular).max_abs() < 1e-8
                    })
                };
                assert!(
                    all.iter().any(same),
                    "case {case}: {} solutions, none with these velocities",
                    all.len()
                );
                if recipe.friction == 0.0 {
                    assert!(all.iter().all(same), "case {case}: without friction the velocities are unique");
                }
            }
        }
    }
    solved
}

const PLAIN: Recipe = Recipe { bodies: 4, contacts: 4, rows: 0, friction: 0.0, law: FrictionLaw::Box };

/// Items 33, 44: the frictionless LCP. These problems always have a solution.
#[test]
fn lemke_finds_the_solution_that_trying_everything_finds_without_friction() {
    assert_eq!(compare::<Planar>(1, PLAIN, 200), 200);
    assert_eq!(compare::<Spatial>(2, PLAIN, 200), 200);
}

/// Item 34: bounded rows of every kind among the contacts.
#[test]
fn lemke_finds_the_solution_that_trying_everything_finds_with_bounded_rows() {
    let recipe = Recipe { rows: 3, contacts: 3, ..PLAIN };
    assert_eq!(compare::<Planar>(3, recipe, 200), 200);
    assert_eq!(compare::<Spatial>(4, recipe, 200), 200);
}

/// Item 36: planar Coulomb friction. With targets > 0 some jammed problems have no answer on Lemke's path.
#[test]
fn lemke_finds_a_solution_that_trying_everything_finds_with_planar_friction() {
    let recipe = Recipe { contacts: 3, friction: 0.8, law: FrictionLaw::Disc, ..PLAIN };
    assert!(compare::<Planar>(5, recipe, 300) >= 297);
    assert!(compare::<Planar>(6, Recipe { friction: 10.0, ..recipe }, 300) >= 270);
}

/// Item 36: box friction in space.
#[test]
fn lemke_finds_a_solution_that_trying_everything_finds_with_box_friction() {
    let recipe = Recipe { contacts: 2, friction: 0.8, ..PLAIN };
    assert!(compare::<Spatial>(7, recipe, 100) >= 98);
    assert!(compare::<Spatial>(8, Recipe { rows: 2, friction: 10.0, ..recipe }, 100) >= 95);
}

/// With targets <= 0 a solution exists whatever the friction, and Lemke's path ends in one (theory section 5.8).
fn lemke_always_solves_contacts_whose_targets_ask_for_no_bounce<S: Space>() {
    let mut random = Random::new(9);
    let recipe = Recipe { bodies: 5, contacts: 8, rows: 0, friction: 10.0, law: FrictionLaw::Box };
    for case in 0..300 {
        let mut problem = random_problem::<S>(&mut random, recipe);
        problem.contacts.iter_mut().for_each(|c| c.target = c.target.min(0.0));
        let (_, outcome) = solve(&problem, SolverKind::Lemke, 1, 1e-10);
        assert_eq!(outcome.stop, Stop::Converged, "case {case}");
    }
}

/// Item 33: a spatial disc is no linear complementarity problem, and Lemke says so and changes nothing.
#[test]
fn lemke_refuses_the_friction_disc_of_space_and_leaves_the_impulses_as_they_were() {
    let mut random = Random::new(10);
    let recipe = Recipe { friction: 0.5, law: FrictionLaw::Disc, ..PLAIN };
    let problem = random_problem::<Spatial>(&mut random, recipe);
    let mut impulses = Impulses::zero(&problem);
    impulses.contacts[1].normal = 0.25;
    let given = impulses.clone();
    let outcome = SolverKind::Lemke.make().solve(&problem, &Default::default(), &mut impulses);
    assert_eq!(impulses, given);
    assert_eq!(outcome.residual, residual(&problem, &given));
    match outcome.stop {
        Stop::Refused(reason) => assert!(reason.contains("disc") && reason.contains("\"box\""), "{reason}"),
        other => panic!("not refused: {other:?}"),
    }
}

/// Item 33: contradictory targets (a body squeezed by two walls that both want it faster) have no solution.
fn lemke_says_so_when_no_velocities_meet_the_targets<S: Space>() {
    let mut problem = ContactProblem::<S>::new(
        vec![ball(1.0, 0.5), obstacle()],
        vec![Default::default(), Default::default()],
    );
    for side in [1.0, -1.0] {
        let mut c = contact((0, along(0, -0.5 * side)), (1, along(0, 0.0)), along(0, side));
        c.target = 1.0;
        problem.contacts.push(c);
    }
    let (impulses, outcome) = solve(&problem, SolverKind::Lemke, 1, 1e-10);
    assert_eq!(impulses, Impulses::zero(&problem));
    match outcome.stop {
        Stop::Refused(reason) => assert!(reason.contains("no velocities meet all targets"), "{reason}"),
        other => panic!("not refused: {other:?}"),
    }
}

/// A hundred contacts among forty bodies: the refined basic solution leaves rounding only.
fn lemke_is_exact_to_rounding_on_a_hundred_contacts<S: Space>() {
    let mut random = Random::new(11);
    for friction in [0.0, 0.5] {
        let recipe = Recipe { bodies: 41, contacts: 100, rows: 0, friction, law: FrictionLaw::Box };
        for case in 0..5 {
            let problem = random_problem::<S>(&mut random, recipe);
            let (_, outcome) = solve(&problem, SolverKind::Lemke, 1, 1e-9);
            assert_eq!(outcome.stop, Stop::Converged, "case {case}");
            assert!(outcome.residual.relative < 1e-12, "case {case}: {:e}", outcome.residual.relative);
        }
    }
}

/// The problem after theory eq. 5.8: cutting the linear solution to zero is not the answer.
#[test]
fn the_two_contact_example_has_the_answer_of_the_page() {
    let m = vec![vec![2.0, -1.0], vec![-1.0, 2.0]];
    let (end, z, _) = solve_lcp(&m, &[-1.0, 3.0], 100);
    assert_eq!((end, z), (LcpEnd::Solved, vec![0.5, 0.0]));
}

/// Murty's example makes Lemke's path long (2^n pivots for some forms) but never wrong.
#[test]
fn murtys_triangular_problems_are_solved() {
    for n in 1..=12 {
        let m: Vec<Vec<f64>> = (0..n)
            .map(|i| (0..n).map(|j| [0.0, 1.0, 2.0][1 + (j < i) as usize - (j > i) as usize]).collect())
            .collect();
        let (end, z, _) = solve_lcp(&m, &vec![-1.0; n], 100_000);
        assert_eq!(end, LcpEnd::Solved);
        let wanted: Vec<f64> = (0..n).map(|i| if i == 0 { 1.0 } else { 0.0 }).collect();
        for (z, wanted) in z.iter().zip(wanted) {
            assert_close(*z, wanted, 1e-14, "z");
        }
    }
}

/// Entries over 24 powers of ten: the scaling makes the answer that of the unscaled problem, digit for digit.
#[test]
fn an_lcp_scaled_by_powers_of_two_has_the_same_solution() {
    let mut random = Random::new(12);
    for _ in 0..200 {
        let problem = random_problem::<Planar>(&mut random, Recipe { contacts: 6, ..PLAIN });
        let rows: Vec<usize> = (0..6).map(|i| 2 * i).collect();
        let (a, b) = (delassus(&problem).dense(), right_hand_side(&problem));
        let m: Vec<Vec<f64>> = rows.iter().map(|&i| rows.iter().map(|&j| a[i][j]).collect()).collect();
        let q: Vec<f64> = rows.iter().map(|&i| -b[i]).collect();
        let d: Vec<f64> = rows.iter().map(|_| (random.below(80) as f64 - 40.0).exp2()).collect();
        let scaled_m: Vec<Vec<f64>> =
            (0..6).map(|i| (0..6).map(|j| m[i][j] * d[i] * d[j]).collect()).collect();
        let scaled_q: Vec<f64> = q.iter().zip(&d).map(|(q, d)| q * d).collect();
        let (end, z, _) = solve_lcp(&m, &q, 1000);
        let (scaled_end, scaled_z, _) = solve_lcp(&scaled_m, &scaled_q, 1000);
        assert_eq!((end, scaled_end), (LcpEnd::Solved, LcpEnd::Solved));
        for ((z, s), d) in z.iter().zip(&scaled_z).zip(&d) {
            assert_close(s * d, *z, 1e-11 * z.abs().max(1e-3), "scaled back");
        }
    }
}

in_both_spaces! {
    lemke_always_solves_contacts_whose_targets_ask_for_no_bounce;
    lemke_says_so_when_no_velocities_meet_the_targets;
    lemke_is_exact_to_rounding_on_a_hundred_contacts;
}
