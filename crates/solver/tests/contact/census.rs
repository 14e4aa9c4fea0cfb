//! How many well-posed problems each solver solves: the random families, and structures of bodies. A problem is
//! well posed where velocities exist that part every contact faster than friction asks (strict feasibility), which
//! is enough for a solution to exist.

use crate::contact::certified::settings;
use crate::contact::judge::errors;
use crate::contact::oracle::strict_feasibility;
use crate::contact::random::{Family, known};
use crate::contact::scenes::{KINDS, structure};
use crate::contact::solvers::{assembled, candidates, solve_matrix};
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

/// Fails unless every candidate that is for all problems solves at least this share of the lists' well-posed ones.
#[track_caller]
fn assert_solves(least: f64, lists: &[(String, Vec<Named>)]) {
    for (index, candidate) in candidates().into_iter().enumerate() {
        if candidate.share < 0.99 {
            continue; // methods for some problems are held to their share where problems are small
        }
        let name = candidate.solver.name();
        let (mut all, mut missing) = (0, Vec::new());
        for (what, list) in lists {
            let (solved, missed) = census(index, list);
            println!("{what}: {name} solves {solved} of {}, misses {} well-posed", list.len(), missed.len());
            all += list.len();
            missing.extend(missed);
        }
        let most = (1.0 - least) * all as f64;
        assert!(missing.len() as f64 <= most, "{name} misses {} of {all}: {missing:#?}", missing.len());
    }
}

/// Every family.
#[test]
#[ignore = "thousands of problems"]
fn well_posed_random_problems_are_solved() {
    let lists: Vec<_> = Family::ALL.into_iter().map(|f| (format!("{f:?}"), family(f, 400, 25))).collect();
    assert_solves(0.999, &lists);
}

/// Every kind of structure, a fourth of them with mass ratios of 1e6.
#[test]
#[ignore = "hundreds of structures"]
fn well_posed_structures_are_solved() {
    let lists: Vec<_> = (0..KINDS).map(|k| (format!("structures of kind {k}"), structures(k, 40))).collect();
    assert_solves(0.998, &lists);
}

/// The first few of each, in seconds.
#[test]
fn well_posed_problems_are_solved() {
    let families = Family::ALL.into_iter().map(|f| (format!("{f:?}"), family(f, 60, 25)));
    let structures = (0..KINDS).map(|k| (format!("structures of kind {k}"), structures(k, 5)));
    assert_solves(0.995, &families.chain(structures).collect::<Vec<_>>());
}
