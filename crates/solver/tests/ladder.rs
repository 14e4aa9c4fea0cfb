//! The order of `auto`: each island begins with sweeps and goes on only while its residual asks for it, whatever stands
//! beside it.

use crate::common::*;
use carom_math::Space;
use carom_solver::{ContactProblem, Impulse, Impulses, IslandReport, Outcome, SolverKind, Stop};

const TOLERANCE: f64 = 1e-6;
/// Sweeps and conjugate gradients that an island may spend.
const ITERATIONS: usize = 100;

/// Columns of balls, each with the solvers it takes: a low one for sweeps, a higher one whose balls are as heavy as each
/// other for conjugate gradients, and one with a heavy ball on light ones that is neither's.
fn columns<S: Space>() -> [(ContactProblem<S>, &'static [SolverKind]); 3] {
    let pressed: Vec<f64> =
        (0..40).map(|k| if k == 39 { 1e5 } else { 1.0 + 0.5 * (k as f64).sin() }).collect();
    [
        (column(&[1.0; 3], 0.5), &[SolverKind::Pgs]),
        (column(&[1.0; 15], 0.5), &[SolverKind::Pgs, SolverKind::Nncg]),
        (column(&pressed, 0.5), &[SolverKind::Pgs, SolverKind::Nncg, SolverKind::Exact]),
    ]
}

/// Fails unless an island went up to the last of these solvers, which is the first whose residual is good enough.
fn assert_climbed(report: &IslandReport, wanted: &[SolverKind]) {
    let solvers: Vec<SolverKind> = report.stages.iter().map(|stage| stage.solver).collect();
    assert_eq!(solvers, wanted, "{:?}", report.stages);
    let (last, before) = report.stages.split_last().expect("a solver worked on it");
    assert!(before.iter().all(|stage| stage.residual > TOLERANCE), "{:?}", report.stages);
    assert!(last.residual <= TOLERANCE && last.stop == Stop::Converged, "{:?}", report.stages);
    assert!(before.iter().all(|stage| stage.stop == Stop::OutOfIterations), "{:?}", report.stages);
}

/// What tells how an island was solved: its contacts, its stages and the bits of its impulses.
fn told<S: Space>(report: &IslandReport, impulses: &[Impulse<S>]) -> String {
    format!("{} {:?} {impulses:?}", report.contacts, report.stages)
}

fn solved_beside<S: Space>(problems: &[ContactProblem<S>]) -> (Impulses<S>, Outcome) {
    let found = solve(&beside(problems), SolverKind::Auto, ITERATIONS, TOLERANCE);
    assert_eq!(found.1.stop, Stop::Converged);
    assert_eq!(found.1.islands.len(), problems.len());
    found
}

/// In every order of the islands, with the impulses and the stages that each has alone.
fn each_island_climbs_as_far_as_its_residual_asks<S: Space>() {
    let columns = columns::<S>();
    let alone = columns.each_ref().map(|(problem, wanted)| {
        let (impulses, outcome) = solved_beside(std::slice::from_ref(problem));
        assert_climbed(&outcome.islands[0], wanted);
        told(&outcome.islands[0], &impulses.contacts)
    });
    for order in [[0, 1, 2], [0, 2, 1], [1, 0, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]] {
        let (impulses, outcome) = solved_beside(&order.map(|k| columns[k].0.clone()));
        let mut left = &impulses.contacts[..];
        for (&k, report) in order.iter().zip(&outcome.islands) {
            let (own, rest) = left.split_at(columns[k].0.contacts.len());
            left = rest;
            assert_climbed(report, columns[k].1);
            assert_eq!(told(report, own), alone[k], "island {k} in the order {order:?}");
        }
        let spent = outcome.islands.iter().flat_map(|island| &island.stages[..]);
        assert_eq!(outcome.iterations, spent.map(|stage| stage.iterations).sum::<usize>());
    }
}

in_both_spaces! {
    each_island_climbs_as_far_as_its_residual_asks;
}
