//! Islands that workers share: no bit of an answer or of its report depends on their number, and a solve that is stopped stops
//! for all.

use crate::common::*;
use carom_math::{Space, Workers};
use carom_solver::methods::ladder::Ladder;
use carom_solver::{
    ContactProblem, FrictionLaw, ImpulseChoice, ImpulseSolver, Impulses, Outcome, Progress, SolveSettings,
    SolverKind, Stop, residual, unwatched,
};

const SETTINGS: SolveSettings = SolveSettings {
    iterations: 200,
    tolerance: 1e-10,
    factorisations: 2000,
    impulses: ImpulseChoice::Any,
    content: None,
    polish: false,
};
/// Islands side by side.
const ISLANDS: usize = 30;

/// Islands of up to twelve contacts, with a row here and there.
fn islands<S: Space>(seed: u64, rows: usize) -> ContactProblem<S> {
    let mut random = Random::new(seed);
    let law = FrictionLaw::Disc;
    let recipe = |k: usize| Recipe { bodies: 3 + k % 4, contacts: 4 + k % 9, rows, friction: 0.7, law };
    let problems: Vec<_> = (0..ISLANDS).map(|k| random_problem(&mut random, recipe(k))).collect();
    beside(&problems)
}

fn solved<S: Space>(
    solver: &mut dyn ImpulseSolver<S>,
    problem: &ContactProblem<S>,
    settings: &SolveSettings,
    workers: usize,
) -> (Impulses<S>, Outcome) {
    solver.share(&Workers::new(workers).unwrap());
    let mut found = Impulses::zero(problem);
    let outcome = solver.solve(problem, settings, &mut found);
    (found, outcome)
}

fn any_number_of_workers_finds_the_same_impulses<S: Space>() {
    let ladders: [&[SolverKind]; 4] = [
        &[SolverKind::Exact],
        &[SolverKind::Pgs, SolverKind::Nncg, SolverKind::Exact],
        &[SolverKind::Nncg],
        &[SolverKind::Apgd],
    ];
    for (seed, rows) in [(51, 0), (52, 1)] {
        let problem = islands::<S>(seed, rows);
        for kinds in ladders {
            for impulses in [ImpulseChoice::Any, ImpulseChoice::MinimumNorm] {
                let settings = SolveSettings { impulses, ..SETTINGS };
                let one = solved(&mut Ladder::new("ladder", kinds), &problem, &settings, 1);
                for workers in [2, 3, 8] {
                    let mut ladder = Ladder::new("ladder", kinds);
                    // the second time with what climbers remember of the first, which may have had other islands
                    for _ in 0..2 {
                        let shared = solved(&mut ladder, &problem, &settings, workers);
                        assert!(shared == one, "{kinds:?} {impulses:?} on {workers} workers");
                    }
                }
                assert!(one.1.islands.len() > ISLANDS / 2 || impulses == ImpulseChoice::MinimumNorm);
            }
        }
    }
}

/// The caller's watch is asked on the caller's thread, whoever works; `false` ends the solve with impulses as good as there are.
fn a_stop_is_a_stop_for_all_workers<S: Space>() {
    let problem = islands::<S>(53, 0);
    let caller = std::thread::current().id();
    for workers in [1, 2, 8] {
        let mut ladder = Ladder::new("exact", &[SolverKind::Exact]);
        ladder.share(&Workers::new(workers).unwrap());
        let mut asked = 0;
        let mut watch = |_: &Progress| {
            assert_eq!(std::thread::current().id(), caller);
            asked += 1;
            false
        };
        let mut found = Impulses::zero(&problem);
        // what no solve reaches
        let settings = SolveSettings { tolerance: 0.0, ..SETTINGS };
        let outcome = ladder.solve_watched(&problem, &settings, &mut found, &mut watch);
        assert!(found.is_finite());
        assert!(asked > 0 && outcome.stop == Stop::Interrupted, "{asked} {:?}", outcome.stop);
        // and the next solve is as if there had been none
        let mut found = Impulses::zero(&problem);
        let outcome = ladder.solve_watched(&problem, &SETTINGS, &mut found, &mut unwatched);
        let one = solved(&mut Ladder::new("exact", &[SolverKind::Exact]), &problem, &SETTINGS, 1);
        assert!((found, outcome) == one, "on {workers} workers");
    }
}

/// The first island that is refused is told, and the impulses are those that were given.
fn a_refusal_is_the_same_for_any_number_of_workers<S: Space>() {
    let mut problem = islands::<S>(54, 0);
    let twice = problem.contacts[0];
    problem.contacts.push(twice);
    let one = solved(&mut Ladder::new("direct", &[SolverKind::Direct]), &problem, &SETTINGS, 1);
    assert!(matches!(one.1.stop, Stop::Refused(_)), "{:?}", one.1.stop);
    assert_eq!(one.0, Impulses::zero(&problem));
    for workers in [2, 8] {
        let shared = solved(&mut Ladder::new("direct", &[SolverKind::Direct]), &problem, &SETTINGS, workers);
        assert!(shared == one, "on {workers} workers");
    }
}

/// Whenever it is stopped, and whatever was solved before.
fn a_stopped_solve_leaves_no_more_than_no_impulses_would<S: Space>() {
    let problems = [islands::<S>(55, 0), islands::<S>(56, 0)];
    let settings = SolveSettings { tolerance: 0.0, ..SETTINGS };
    for workers in [2, 8] {
        let mut ladder = Ladder::new("exact", &[SolverKind::Exact]);
        ladder.share(&Workers::new(workers).unwrap());
        for k in 0..20 {
            let problem = &problems[k % 2];
            // now and then after some islands are done, so that others are left
            let mut asked = 0;
            let mut watch = |_: &Progress| {
                asked += 1;
                asked <= 3 * (k % 4)
            };
            let mut found = Impulses::zero(problem);
            let nothing = residual(problem, &found).absolute;
            let outcome = ladder.solve_watched(problem, &settings, &mut found, &mut watch);
            let left = outcome.residual.absolute;
            assert!(left <= nothing * (1.0 + 1e-12), "{workers} workers, solve {k}: {left} of {nothing}");
        }
    }
}

in_both_spaces! {
    a_stopped_solve_leaves_no_more_than_no_impulses_would;
    any_number_of_workers_finds_the_same_impulses;
    a_stop_is_a_stop_for_all_workers;
    a_refusal_is_the_same_for_any_number_of_workers;
}
