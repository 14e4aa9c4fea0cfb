//! Made contact problems have the bodies and contacts they promise, pass the check that files must pass, stay the
//! same from run to run, and survive the way through a flat file.

use carom::solver::{FrictionProblem, Impulses, SolveSettings, SolverKind, Stop, measure};
use carom::{ContactProblem, Planar, Space, Spatial};
use carom_scenes::contact_problems::*;
use carom_scenes::stage::Stage;

fn sizes<S: Space>(problem: &ContactProblem<S>) -> (usize, usize) {
    problem.check().expect("a made problem is well formed");
    (problem.inverse_masses.len() - 1, problem.contacts.len())
}

#[test]
fn walls_and_lattices_have_the_published_sizes() {
    let v = Variation::perturbed(7);
    assert_eq!(sizes(&brick_wall::<Spatial>(8, 8, &v).unwrap()), (64, 452));
    assert_eq!(sizes(&brick_wall::<Spatial>(25, 25, &v).unwrap()), (625, 4804));
    assert_eq!(sizes(&brick_wall::<Planar>(8, 8, &v).unwrap()), (64, 226));
    assert_eq!(sizes(&sphere_lattice::<Spatial>(8, &v).unwrap()), (512, 1408));
    assert_eq!(sizes(&sphere_lattice::<Spatial>(12, &v).unwrap()), (1728, 4896));
    assert_eq!(sizes(&sphere_lattice::<Planar>(5, &v).unwrap()), (25, 45));
}

#[test]
fn frames_have_the_contacts_they_state() {
    for (_, v) in Variation::all(3) {
        assert_eq!(sizes(&kapla_tower(5, 3, &v).unwrap()), (15, 3 * 4 + 4 * 9 * 4));
        assert_eq!(sizes(&stack::<Spatial>(10, 1e6, true, &v).unwrap()), (10, 40));
        assert_eq!(sizes(&stack::<Planar>(10, 1e3, false, &v).unwrap()), (10, 20));
        assert_eq!(sizes(&arch::<Spatial>(9, &v).unwrap()), (9, 40));
        assert_eq!(sizes(&arch::<Planar>(9, &v).unwrap()), (9, 20));
        // per pair: apex, two feet, two rests
        assert_eq!(sizes(&card_house::<Planar>(3, &v).unwrap()), (6 * 2 + 3, 6 * 5));
        assert_eq!(sizes(&card_house::<Spatial>(3, &v).unwrap()), (6 * 2 + 3, 6 * 10));
        assert_eq!(sizes(&table::<Spatial>(16, &v).unwrap()), (17, 128));
        assert_eq!(sizes(&table::<Planar>(4, &v).unwrap()), (5, 16));
    }
}

#[test]
fn equal_seeds_give_equal_bits_and_other_seeds_do_not() {
    let make = |seed| brick_wall::<Spatial>(4, 4, &Variation::jittered(seed)).unwrap();
    assert_eq!(make(1), make(1));
    assert_ne!(make(1), make(2));
}

/// Sum of the contacts' vertical impulses that carry every body against gravity, from equilibrium of one column.
#[test]
fn a_stack_at_rest_is_carried_by_its_weight() {
    let ratio = 1e3;
    let v = Variation::at_rest(1);
    let problem = stack::<Planar>(3, ratio, true, &v).unwrap();
    let matrix = matrix_form(&problem);
    // box of side .1 m and 1000 kg/m^2: 10 kg; equal halves at the two corners of each joint
    let weight = |boxes: f64| 10.0 * boxes * v.gravity * v.time_step;
    let carried = [weight(2.0 + ratio), weight(1.0 + ratio), weight(ratio)];
    let r: Vec<f64> = carried.iter().flat_map(|w| [0.5 * w, 0.0, 0.5 * w, 0.0]).collect();
    let m = measure(&matrix, &r);
    assert!(m.solves(1e-12), "{m:?}");
    // and nothing lighter does
    let less: Vec<f64> = r.iter().map(|x| 0.999 * x).collect();
    assert!(!measure(&matrix, &less).solves(1e-6));
}

#[test]
fn flat_files_give_back_what_was_written_and_refuse_nonsense() {
    let problem = matrix_form(&arch::<Spatial>(5, &Variation::sheared(2)).unwrap());
    let mut bytes = Vec::new();
    write_flat(&problem, &mut bytes).unwrap();
    let counts = 4 * (3 + problem.matrix.starts.len() + problem.matrix.indices.len());
    let numbers = 8 * (problem.matrix.values.len() + problem.velocity.len() + problem.contacts());
    assert_eq!(bytes.len(), counts + numbers);
    assert_eq!(read_flat(&mut bytes.as_slice()).unwrap(), problem);
    assert!(read_flat(&mut &bytes[..bytes.len() - 1]).is_err());
    let mut negative = bytes.clone();
    negative[4..8].copy_from_slice(&(-1_i32).to_le_bytes());
    assert!(read_flat(&mut negative.as_slice()).is_err());
}

fn norm(x: &[f64]) -> f64 {
    x.iter().map(|a| a * a).sum::<f64>().sqrt()
}

#[test]
fn stress_adds_what_it_says() {
    let problem = matrix_form(&stack::<Spatial>(4, 1.0, true, &Variation::at_rest(1)).unwrap());
    for amplitude in [0.01, 2.0, 0.0] {
        let harder: FrictionProblem = stressed(&problem, amplitude, 1.7, 9);
        let added: Vec<f64> = harder.velocity.iter().zip(&problem.velocity).map(|(a, b)| a - b).collect();
        assert!((norm(&added) - amplitude * norm(&problem.velocity)).abs() < 1e-12);
        assert!(harder.friction.iter().zip(&problem.friction).all(|(a, b)| *a == 1.7 * b));
    }
}

/// Both spaces build from the same lines: a shape that only one of them had would not compile.
#[test]
fn every_generator_but_towers_exists_in_both_spaces() {
    fn all<S: Stage>() -> usize {
        let v = Variation::default();
        [
            brick_wall::<S>(2, 2, &v),
            sphere_lattice::<S>(2, &v),
            stack::<S>(2, 1.0, true, &v),
            arch::<S>(3, &v),
            card_house::<S>(1, &v),
            table::<S>(3, &v),
        ]
        .into_iter()
        .map(|p| p.unwrap().contacts.len())
        .sum()
    }
    // every joint has twice the contacts in space; the lattice of 2 has 16 in space and 6 in the plane
    assert_eq!(all::<Spatial>() - 16, 2 * (all::<Planar>() - 6));
}

/// Bodies that stand still leave the stiffness of their contacts near zero; the systems lost all their digits there, and
/// the interior point gave up.
#[test]
fn a_wall_at_rest_is_solved_by_the_interior_point_alone() {
    let problem = brick_wall::<Spatial>(25, 25, &Variation::at_rest(1)).unwrap();
    let settings = SolveSettings { iterations: usize::MAX, tolerance: 1e-8, ..SolveSettings::default() };
    let mut stages = Vec::new();
    let outcome = SolverKind::Exact.make::<Spatial>().solve_watched(
        &problem,
        &settings,
        &mut Impulses::zero(&problem),
        &mut |progress| {
            stages.push(progress.stage);
            true
        },
    );
    assert_eq!(outcome.stop, Stop::Converged);
    stages.dedup();
    assert_eq!(stages, ["sweeps", "interior point"]);
}

/// Where the path folds again and again, factorisations went on to their last: this wall was left at 4e-7, a lattice took
/// three times as many.
#[test]
fn what_folds_again_and_again_is_brought_near_by_many_sweeps() {
    let wall = brick_wall::<Spatial>(12, 12, &Variation::sheared(2)).unwrap();
    let lattice = sphere_lattice::<Spatial>(8, &Variation::perturbed(4)).unwrap();
    for (problem, factorisations) in [(wall, 1500), (lattice, 60)] {
        let settings = SolveSettings {
            iterations: usize::MAX,
            tolerance: 1e-8,
            factorisations,
            ..SolveSettings::default()
        };
        let mut swept = false;
        let outcome = SolverKind::Exact.make::<Spatial>().solve_watched(
            &problem,
            &settings,
            &mut Impulses::zero(&problem),
            &mut |progress| {
                swept |= progress.stage == "many sweeps";
                true
            },
        );
        assert_eq!(outcome.stop, Stop::Converged, "after {}", outcome.factorisations);
        assert!(swept);
    }
}

/// Sweeps went on from where short interior points had ended, a long one came next and the path last of all: 70,000 of them where
/// 20,000 bring a heap as near from where the path has come.
#[test]
fn where_sweeps_are_cheap_the_path_comes_before_a_long_interior_point() {
    let lattice = sphere_lattice::<Spatial>(8, &Variation::perturbed(4)).unwrap();
    // no stage reaches it, so that all come
    let settings = SolveSettings { iterations: usize::MAX, tolerance: 0.0, ..SolveSettings::default() };
    let (mut stages, mut interior) = (Vec::new(), 0);
    let outcome = SolverKind::Exact.make::<Spatial>().solve_watched(
        &lattice,
        &settings,
        &mut Impulses::zero(&lattice),
        &mut |progress| {
            stages.push(progress.stage);
            if progress.stage == "interior point" {
                interior = interior.max(progress.iterations);
            }
            progress.stage != "path"
        },
    );
    assert_eq!(outcome.stop, Stop::Interrupted);
    assert!(stages.contains(&"many sweeps") && interior <= 8, "{interior} steps of the interior point");
}
