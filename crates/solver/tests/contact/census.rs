//! How many well-posed problems each solver solves: the random families, and structures of bodies. A problem is
//! well posed where velocities exist that part every contact faster than friction asks (strict feasibility), which
//! is enough for a solution to exist.

use crate::certified::settings;
use crate::judge::errors;
use crate::oracle::strict_feasibility;
use crate::random::{Family, known};
use crate::scenes::{KINDS, structure};
use crate::solvers::{assembled, candidates, solve_matrix};
use carom_math::{Planar, Spatial};
use carom_solver::{FrictionProblem, Measure};

/// A problem and its name.
type Named = (String, FrictionProblem);

/// Random problems of a family.
fn family(family: Family, count: u64, largest: usize) -> Vec<Named> {
    (0..count)
        .map(|seed| known(family, 1 + seed as usize % 3, 1 + (seed as usize * 7) % largest, seed))
        .map(|k| (format!("{:?}", k.name), k.problem))
        .collect()
}

/// Structures of a kind, in the plane and in space.
fn structures(kind: usize, count: u64) -> Vec<Named> {
    let planar = (0..count).map(|seed| structure::<Planar>(kind, seed)).map(|(n, p)| (n, assembled(&p)));
    let spatial = (0..count).map(|seed| structure::<Spatial>(kind, seed)).map(|(n, p)| (n, assembled(&p)));
    planar.chain(spatial).collect()
}

/// Solves a list with one candidate; returns how many it solved and a line for each other one that has a solution.
fn census(index: usize, list: &[Named]) -> (usize, Vec<String>) {
    let (mut solved, mut missed) = (0, Vec::new());
    for (name, problem) in list {
        let mut candidate = candidates().swap_remove(index);
        let settings = settings(candidate.reach);
        let (r, outcome) = solve_matrix(candidate.solver.as_mut(), problem, &settings);
        if outcome.solved {
            solved += 1;
            continue;
        }
        let feasible = strict_feasibility(problem);
        let e = errors(problem, &r);
        let Measure { take_off, stick, slip, .. } = outcome.measure;
        let line = format!(
            "{name}: strict feasibility {feasible:.1e}, natural {:.1e}, scaled {:.1e}, at the best iterate \
             {take_off} off {stick} stick {slip} slip, {} factorisations; {}",
            e.natural, e.scaled, outcome.factorisations, outcome.reason
        );
        println!("    {line}");
        if feasible > 1e-6 {
            missed.push(line);
        }
    }
    (solved, missed)
}

/// Fails unless every candidate solves its share of what is well posed in a list.
#[track_caller]
fn assert_shares(what: &str, list: &[Named]) {
    for (index, candidate) in candidates().into_iter().enumerate() {
        if candidate.share < 0.99 {
            continue; // methods for some problems are held to their share where problems are small
        }
        let (solved, missed) = census(index, list);
        let name = candidate.solver.name();
        println!("{what}: {name} solves {solved} of {}, misses {} well-posed", list.len(), missed.len());
        let most = (1.0 - candidate.share) * list.len() as f64;
        assert!(missed.len() as f64 <= most, "{what}: {name} misses {}: {missed:#?}", missed.len());
    }
}

/// Every family, to each solver's reach.
#[test]
#[ignore = "minutes: thousands of problems"]
fn well_posed_random_problems_are_solved() {
    for f in Family::ALL {
        assert_shares(&format!("{f:?}"), &family(f, 400, 25));
    }
}

/// Every kind of structure, to each solver's reach.
#[test]
#[ignore = "minutes: hundreds of structures"]
fn well_posed_structures_are_solved() {
    for kind in 0..KINDS {
        assert_shares(&format!("structures of kind {kind}"), &structures(kind, 40));
    }
}
