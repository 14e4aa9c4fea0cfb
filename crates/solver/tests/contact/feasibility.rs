//! What the body door tells of problems that it does not solve: the same strict feasibility as the door of problems in
//! matrix form, of each island, and nothing of what is solved, cut short, or asked for nothing.

use crate::common::*;
use crate::contact::scenes::*;
use crate::contact::solvers::assembled;
use carom_math::{Column, Space};
use carom_solver::exact::strict_feasibility;
use carom_solver::{ContactProblem, Impulses, Outcome, SolveSettings, SolverKind, Stop};

fn solved_by<S: Space>(
    kind: SolverKind,
    problem: &ContactProblem<S>,
    settings: &SolveSettings,
) -> (Impulses<S>, Outcome) {
    let mut impulses = Impulses::zero(problem);
    let outcome = kind.make().solve(problem, settings, &mut impulses);
    (impulses, outcome)
}

/// A ball of 1 kg in a V of two walls, each leaning by `slope` from the horizontal and moving into the V at 1 m/s.
fn wedge<S: Space>(slope: f64, friction: f64) -> ContactProblem<S> {
    let mut scene = Scene::<S>::new();
    let ball = scene.body(ball(1.0, 0.5), at::<S>(0.0, 0.0, 1.0));
    scene.problem.velocities[ball] = moving(S::Vector::ZERO);
    for side in [-1.0, 1.0] {
        let normal = at::<S>(-side * slope.sin(), 0.0, slope.cos());
        let wall = scene.body(obstacle(), S::Vector::ZERO);
        scene.problem.velocities[wall] = moving(normal);
        scene.touch(ball, wall, scene.centres[ball] - normal * 0.5, normal, friction);
    }
    scene.problem
}

/// Walls that close squeeze a ball upwards unless friction holds it: u_N = s cos(slope) - 1 and |u_T| = s sin(slope) with
/// its upward speed s, so t = -1 m/s at s = 0 where mu tan(slope) > 1, and a solution exists where it is below.
fn a_wedge_that_closes_is_feasible_up_to_the_friction_that_holds_it<S: Space>() {
    let slope = 1.2_f64;
    let limit = 1.0 / slope.tan();
    for kind in [SolverKind::Exact, SolverKind::Auto] {
        let (_, outcome) = solved_by(kind, &wedge::<S>(slope, 0.8 * limit), &SolveSettings::default());
        assert_eq!((&outcome.stop, outcome.strict_feasibility), (&Stop::Converged, None));
        let problem = wedge::<S>(slope, 1.5 * limit);
        let (impulses, outcome) = solved_by(kind, &problem, &SolveSettings::default());
        assert!(outcome.stop != Stop::Converged && impulses.is_finite(), "{}: {outcome:?}", kind.name());
        let t = outcome.strict_feasibility.expect("a bound is found");
        assert!((t + 1.0).abs() < 1e-3, "{}: {t}", kind.name());
    }
}

/// With and without friction, by every way through the body door, as the matrix door tells it.
fn walls_that_approach_each_other_leave_no_room<S: Space>() {
    for friction in [0.0, 0.4] {
        let problem = wedge::<S>(std::f64::consts::FRAC_PI_2, friction);
        let known = strict_feasibility(&assembled(&problem)).expect("a bound");
        assert!((known + 1.0).abs() < 1e-6, "{known}");
        let (_, outcome) = solved_by(SolverKind::Exact, &problem, &SolveSettings::default());
        let t = outcome.strict_feasibility.expect("a bound is found");
        assert!((t - known).abs() < 1e-6, "{t}, in matrix form {known}");
    }
}

/// An island that is solved tells nothing; the whole tells the least of those that are not.
fn each_island_tells_its_own<S: Space>() {
    let mut problem = stack::<S>(&[1.0, 2.0], 0.5);
    let (first, contacts) = (problem.inverse_masses.len(), problem.contacts.len());
    for speed in [1.0, 3.0] {
        let mut jammed = wedge::<S>(std::f64::consts::FRAC_PI_2, 0.3);
        jammed.velocities.iter_mut().for_each(|v| v.linear = v.linear * speed);
        let offset = problem.inverse_masses.len();
        problem.inverse_masses.extend(jammed.inverse_masses);
        problem.velocities.extend(jammed.velocities);
        problem.contacts.extend(jammed.contacts.into_iter().map(|mut c| {
            (c.a, c.b) = (c.a + offset, c.b + offset);
            c
        }));
    }
    let (_, outcome) = solved_by(SolverKind::Auto, &problem, &SolveSettings::default());
    assert_eq!(outcome.islands.len(), 3);
    assert_eq!((outcome.islands[0].contacts, outcome.islands[0].strict_feasibility), (contacts, None));
    assert_eq!(outcome.islands[1].first_body, first + 1);
    for (island, speed) in outcome.islands[1..].iter().zip([1.0, 3.0]) {
        let t = island.strict_feasibility.expect("a bound is found");
        assert!((t + speed).abs() < 1e-3 * speed, "{t} at {speed} m/s");
    }
    assert_eq!(outcome.strict_feasibility, outcome.islands[2].strict_feasibility);
}

/// Structures of all kinds that are solved tell nothing; asked for less than rounding they are not solved, and
/// feasible by no more than the largest velocity. Short budgets and a tolerance of 0 pay for no answer.
fn only_what_is_not_solved_is_asked_for_its_feasibility<S: Space>() {
    for kind in 0..KINDS {
        let (what, problem) = structure::<S>(kind, 1);
        let settings = SolveSettings { tolerance: 1e-8, ..SolveSettings::default() };
        let (_, outcome) = solved_by(SolverKind::Exact, &problem, &settings);
        if outcome.stop == Stop::Converged {
            assert_eq!(outcome.strict_feasibility, None, "{what}");
        }
    }
    let problem = stack::<S>(&[1.0, 3.0, 2.0], 0.5);
    let asked = |tolerance, factorisations| {
        let settings = SolveSettings { tolerance, factorisations, ..SolveSettings::default() };
        solved_by(SolverKind::Exact, &problem, &settings).1.strict_feasibility
    };
    let t = asked(1e-30, 2000).expect("an r with t above 0 is found");
    assert!(t > 0.0 && t <= FALL * (1.0 + 1e-12), "{t} of {FALL}");
    assert_eq!(asked(1e-30, 3), None);
    assert_eq!(asked(0.0, 2000), None);
}

in_both_spaces! {
    a_wedge_that_closes_is_feasible_up_to_the_friction_that_holds_it;
    walls_that_approach_each_other_leave_no_room;
    each_island_tells_its_own;
    only_what_is_not_solved_is_asked_for_its_feasibility;
}
