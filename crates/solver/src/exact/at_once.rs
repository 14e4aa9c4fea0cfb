//! What needs no iteration over contacts: a single contact, and few contacts without friction.

use super::local::Local;
use super::principal_pivots::{LARGEST, pivoted};
use crate::friction_problem::{FrictionProblem, measure, project_on_cone};
use crate::friction_solver::{FrictionOutcome, FrictionSettings, Stage};
use std::time::Instant;

/// Solves such a problem; `None` when it is none or is not solved, and the impulses are then as they were.
pub fn at_once(
    problem: &FrictionProblem,
    settings: &FrictionSettings,
    impulses: &mut [f64],
) -> Option<FrictionOutcome> {
    let started = Instant::now();
    let (name, found, iterations) = match (problem.contacts(), problem.dimension) {
        (1, 2) => ("one contact", alone::<2>(problem).to_vec(), 1),
        (1, 3) => ("one contact", alone::<3>(problem).to_vec(), 1),
        (n, 1) if n <= LARGEST => {
            let (found, rounds) = pivoted(&problem.matrix, &problem.velocity, impulses)?;
            ("pivots", found, rounds)
        }
        _ => return None,
    };
    let seconds = started.elapsed().as_secs_f64();
    let measure = measure(problem, &found);
    measure.solves(settings.tolerance).then(|| {
        impulses.copy_from_slice(&found);
        FrictionOutcome {
            solved: true,
            measure,
            stages: vec![Stage { name, iterations }],
            factorisations: 0,
            seconds,
            reason: String::new(),
            strict_feasibility: None,
        }
    })
}

/// The impulse of the only contact.
fn alone<const D: usize>(problem: &FrictionProblem) -> [f64; D] {
    let w = problem.matrix.blocks(D);
    let block = std::array::from_fn(|r| std::array::from_fn(|c| w.values[D * r + c]));
    let velocity = std::array::from_fn(|k| problem.velocity[k]);
    let mut local = Local::<D>::new(&block, problem.friction[0]);
    let mut found = [0.0; D];
    // the first round finds the slip to the square of its last correction, the others what rounding leaves
    for _ in 0..8 {
        let before = found;
        found = local.solve(&velocity, &before);
        if found == before {
            break;
        }
    }
    project_on_cone(&mut found, problem.friction[0]);
    found
}
