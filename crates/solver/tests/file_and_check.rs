//! A problem as a value: written to a file and read back bit for bit, and refused by name when it cannot be one.

use crate::common::*;
use carom_math::{Column, Inertia, Planar, Space, Spatial};
use carom_solver::file::{from_json, to_json};
use carom_solver::{
    Contact, ContactProblem, FrictionLaw, Impulse, ImpulseSolver, Impulses, Outcome, SolveSettings,
    SolverKind,
};

const RECIPE: Recipe = Recipe { bodies: 5, contacts: 6, rows: 8, friction: 0.5, law: FrictionLaw::Box };

/// All numbers of a problem as bits, so that -0.0 differs from 0.0.
fn bits<S: Space>(p: &ContactProblem<S>) -> Vec<u64> {
    let mut all: Vec<f64> = Vec::new();
    for m in &p.inverse_masses {
        all.push(m.linear);
        all.extend(m.angular.entries());
    }
    for v in &p.velocities {
        all.extend([v.linear.as_slice(), v.angular.as_slice()].concat());
    }
    for c in &p.contacts {
        all.extend([c.normal.as_slice(), c.arm_a.as_slice(), c.arm_b.as_slice()].concat());
        all.extend([
            c.gap,
            c.target,
            c.restitution,
            c.friction,
            f64::from_bits(c.id),
            c.a as f64,
            c.b as f64,
        ]);
    }
    for r in &p.rows {
        for t in [&r.on_a, &r.on_b] {
            all.extend([t.linear.as_slice(), t.angular.as_slice()].concat());
        }
        all.extend([r.target, r.lo, r.hi, f64::from_bits(r.id), r.a as f64, r.b as f64]);
    }
    all.into_iter().map(f64::to_bits).collect()
}

/// Every bit survives: random numbers, infinite bounds, negative zeros, the smallest and largest numbers, large ids.
fn a_problem_comes_back_from_its_file_bit_for_bit<S: Space>() {
    let mut random = Random::new(1);
    for _ in 0..50 {
        let mut problem = random_problem::<S>(&mut random, RECIPE);
        problem.contacts[0].target = -0.0;
        problem.contacts[1].target = f64::from_bits(1);
        problem.contacts[2].gap = -f64::MAX;
        problem.contacts[3].id = u64::MAX;
        problem.velocities[1].linear[0] = 0.1 + 0.2;
        (problem.rows[0].lo, problem.rows[0].hi) = (f64::NEG_INFINITY, f64::INFINITY);
        let text = to_json(&problem);
        let back = from_json::<S>(&text).expect("readable");
        assert_eq!(bits(&back), bits(&problem));
        assert_eq!((&back.space, back.friction_law), (&problem.space, problem.friction_law));
        assert_eq!(to_json(&back), text);
    }
}

/// What a solver finds for the problem read back is what it finds for the one written, to the last bit.
fn a_problem_read_back_has_the_same_answer<S: Space>() {
    let problem = random_problem::<S>(&mut Random::new(2), RECIPE);
    let back = from_json::<S>(&to_json(&problem)).expect("readable");
    for kind in SolverKind::ALL {
        assert_eq!(solve(&problem, kind, 30, 0.0), solve(&back, kind, 30, 0.0));
    }
}

/// An outcome can be written and read, the refusal's reason included.
#[test]
fn an_outcome_comes_back_from_its_text() {
    let problem = random_problem::<Spatial>(&mut Random::new(3), RECIPE);
    for kind in SolverKind::ALL {
        let (impulses, outcome) = solve(&problem, kind, 30, 0.0);
        let text = serde_json::to_string(&(&outcome, &impulses)).expect("plain data");
        let back: (Outcome, Impulses<Spatial>) = serde_json::from_str(&text).expect("readable");
        assert_eq!(back, (outcome, impulses));
    }
}

/// Files of the other space, of no problem at all, with missing or wrong entries: refused with what to do.
#[test]
fn texts_that_are_no_problem_of_this_space_are_refused() {
    let planar = to_json(&random_problem::<Planar>(&mut Random::new(4), RECIPE));
    let spatial = to_json(&random_problem::<Spatial>(&mut Random::new(4), RECIPE));
    assert!(from_json::<Planar>(&planar).is_ok() && from_json::<Spatial>(&spatial).is_ok());
    for text in ["", "{", "[]", "null", "{\"space\": \"planar\"}", &spatial, &planar[..planar.len() / 2]] {
        let error = from_json::<Planar>(text).expect_err("no planar problem");
        assert_eq!(error.place, "file");
        assert!(!error.problem.is_empty() && error.remedy.contains("ContactProblem.save"), "{error}");
    }
    assert!(from_json::<Spatial>(&planar).is_err());
    let empty = to_json(&ContactProblem::<Planar>::new(Vec::new(), Vec::new()));
    let error = from_json::<Spatial>(&empty).expect_err("an empty problem still has a space");
    assert_eq!(error.place, "space");
    let bound = planar.replacen("\"inf\"", "\"infinity\"", 1);
    assert!(from_json::<Planar>(&bound).expect_err("no bound").problem.contains("infinity"));
}

/// Spoils a sound problem in one way.
type Spoil<S> = fn(&mut ContactProblem<S>);

/// Every kind of bad entry is refused by its place, and the message says what to do.
fn every_bad_entry_is_refused_by_its_name<S: Space>() {
    let cases: Vec<(&str, Spoil<S>)> = vec![
        ("space", |p| p.space = "flat".into()),
        ("velocities", |p| p.velocities.truncate(2)),
        ("inverse_masses[2].linear", |p| p.inverse_masses[2].linear = -1.0),
        ("inverse_masses[2].linear", |p| p.inverse_masses[2].linear = f64::NAN),
        ("inverse_masses[2].linear", |p| p.inverse_masses[2].linear = f64::INFINITY),
        ("inverse_masses[3].angular", |p| {
            p.inverse_masses[3].angular = p.inverse_masses[3].angular.scaled(f64::NAN)
        }),
        ("inverse_masses[3].angular", |p| {
            p.inverse_masses[3].angular = p.inverse_masses[3].angular.scaled(-1.0)
        }),
        ("velocities[1]", |p| p.velocities[1].linear[1] = f64::INFINITY),
        ("velocities[4]", |p| p.velocities[4].angular[0] = f64::NAN),
        ("contacts[1].a, b", |p| p.contacts[1].a = 5),
        ("contacts[1].a, b", |p| p.contacts[1].b = usize::MAX),
        ("contacts[1].a, b", |p| p.contacts[1].b = p.contacts[1].a),
        ("contacts[1].a, b", |p| {
            // two obstacles
            p.inverse_masses[1] = obstacle();
            (p.contacts[0].a, p.contacts[0].b) = (2, 3);
            (p.contacts[1].a, p.contacts[1].b) = (0, 1);
        }),
        ("contacts[1].a, b", |p| {
            // an axle met in its centre: no impulse along the normal moves it
            p.inverse_masses[4].linear = 0.0;
            (p.contacts[1].a, p.contacts[1].b) = (4, 0);
            p.contacts[1].arm_a = S::Vector::ZERO;
        }),
        ("contacts[2].normal", |p| p.contacts[2].normal = p.contacts[2].normal * 1.001),
        ("contacts[2].normal", |p| p.contacts[2].normal = S::Vector::ZERO),
        ("contacts[2].normal", |p| p.contacts[2].normal[0] = f64::NAN),
        ("contacts[3].arm_a, arm_b", |p| p.contacts[3].arm_a[0] = f64::NAN),
        ("contacts[3].arm_a, arm_b", |p| p.contacts[3].arm_b[1] = f64::INFINITY),
        ("contacts[4].gap", |p| p.contacts[4].gap = f64::NAN),
        ("contacts[4].target", |p| p.contacts[4].target = f64::INFINITY),
        ("contacts[4].restitution", |p| p.contacts[4].restitution = 1.01),
        ("contacts[4].restitution", |p| p.contacts[4].restitution = -0.01),
        ("contacts[4].friction", |p| p.contacts[4].friction = -0.5),
        ("contacts[4].friction", |p| p.contacts[4].friction = f64::INFINITY),
        ("rows[5].a, b", |p| p.rows[5].a = 7),
        ("rows[5].a, b", |p| p.rows[5].b = 7),
        ("rows[5].on_a, on_b", |p| p.rows[5].on_a.linear[0] = f64::NAN),
        ("rows[5].on_a, on_b", |p| p.rows[5].on_b.angular[0] = f64::INFINITY),
        ("rows[5].on_a, on_b", |p| (p.rows[5].on_a, p.rows[5].on_b) = Default::default()),
        ("rows[5].on_a, on_b", |p| p.rows[5].on_a.linear[0] = 1e200),
        ("rows[6].target", |p| p.rows[6].target = f64::NAN),
        ("rows[6].lo, hi", |p| (p.rows[6].lo, p.rows[6].hi) = (1.0, -1.0)),
        ("rows[6].lo, hi", |p| p.rows[6].lo = f64::NAN),
        ("rows[6].lo, hi", |p| (p.rows[6].lo, p.rows[6].hi) = (f64::INFINITY, f64::INFINITY)),
        ("rows[6].lo, hi", |p| (p.rows[6].lo, p.rows[6].hi) = (f64::NEG_INFINITY, f64::NEG_INFINITY)),
    ];
    for (k, (place, spoil)) in cases.into_iter().enumerate() {
        let mut problem = random_problem::<S>(&mut Random::new(5), RECIPE);
        for r in &mut problem.rows {
            (r.a, r.b) = (1, 2); // two bodies that can move
        }
        problem.check().expect("sound before it is spoiled");
        spoil(&mut problem);
        let error = problem.check().expect_err("spoiled");
        assert_eq!(error.place, place, "case {k}: {error}");
        assert!(!error.problem.is_empty() && !error.remedy.is_empty());
        assert_eq!(
            error.to_string(),
            format!("contact problem: {}: {}; {}", error.place, error.problem, error.remedy)
        );
    }
}

/// A space that has more than one principal moment refuses an inverse inertia with one below zero.
#[test]
fn an_inverse_inertia_with_one_negative_principal_value_is_refused() {
    let mut problem = random_problem::<Spatial>(&mut Random::new(6), RECIPE);
    problem.inverse_masses[1].angular =
        Random::new(7).turned::<Spatial>(&carom_math::Sym3::diag(1.0, 2.0, -0.1));
    assert_eq!(problem.check().expect_err("negative").place, "inverse_masses[1].angular");
    // a rod's inertia about its axis is infinite for a contact: a zero principal value is sound
    problem.inverse_masses[1].angular =
        Random::new(7).turned::<Spatial>(&carom_math::Sym3::diag(1.0, 2.0, 0.0));
    problem.check().expect("zero is allowed");
}

/// Impulses flatten and come back; a wrong count is refused.
fn impulses_flatten_and_come_back<S: Space>() {
    let mut random = Random::new(8);
    let problem = random_problem::<S>(&mut random, RECIPE);
    let flat: Vec<f64> = (0..problem.scalar_rows()).map(|_| random.between(-1.0, 1.0)).collect();
    let impulses = Impulses::from_flat(&problem, &flat).expect("fits");
    assert_eq!(impulses.flat(), flat);
    assert_eq!((impulses.contacts.len(), impulses.rows.len()), (6, 8));
    assert!(Impulses::from_flat(&problem, &flat[1..]).is_none());
    assert!(impulses.is_finite());
}

/// A contact's frame is right-handed and orthonormal, and impulses go to the world and back.
fn contact_frames_turn_impulses_to_the_world_and_back<S: Space>() {
    let mut random = Random::new(9);
    for _ in 0..200 {
        let c: Contact<S> = contact((0, S::Vector::ZERO), (1, S::Vector::ZERO), random.unit());
        let impulse = Impulse { normal: random.between(0.0, 1.0), tangent: random.column(1.0) };
        let world = c.to_world(&impulse);
        assert_close(world.dot(c.normal), impulse.normal, 1e-15, "normal part");
        assert_column_close(c.to_slip(world), impulse.tangent, 1e-15, "tangential part");
        assert_close(
            world.norm_squared(),
            impulse.normal.powi(2) + impulse.tangent.norm_squared(),
            1e-14,
            "length",
        );
    }
}

/// The solvers by their names, and an unknown name with the known ones.
#[test]
fn solvers_are_found_by_their_names() {
    for kind in SolverKind::ALL {
        assert_eq!(kind.name().parse::<SolverKind>(), Ok(kind));
        let solver: Box<dyn ImpulseSolver<Planar>> = kind.make();
        assert_eq!(solver.name(), kind.name());
        assert_eq!(serde_json::to_string(&kind).expect("plain data"), format!("{:?}", kind.name()));
    }
    let error = "newton".parse::<SolverKind>().expect_err("unknown");
    assert!(error.contains("\"newton\"") && error.contains("pgs_matrix"), "{error}");
}

/// A problem without contacts and rows has nothing to solve, whatever the solver.
fn an_empty_problem_is_solved_by_doing_nothing<S: Space>() {
    let mut problem = ContactProblem::<S>::new(Vec::new(), Vec::new());
    problem.check().expect("nothing to refuse");
    for kind in SolverKind::ALL {
        let mut impulses = Impulses::zero(&random_problem::<S>(&mut Random::new(10), RECIPE));
        let outcome = kind.make().solve(&problem, &SolveSettings::default(), &mut impulses);
        assert_eq!(
            (outcome, impulses),
            (Outcome::nothing_to_do(), Impulses::zero(&problem)),
            "{}",
            kind.name()
        );
    }
    problem.inverse_masses.push(obstacle());
    problem.velocities.push(Default::default());
    problem.check().expect("bodies without contacts");
}

in_both_spaces! {
    a_problem_comes_back_from_its_file_bit_for_bit;
    a_problem_read_back_has_the_same_answer;
    every_bad_entry_is_refused_by_its_name;
    impulses_flatten_and_come_back;
    contact_frames_turn_impulses_to_the_world_and_back;
    an_empty_problem_is_solved_by_doing_nothing;
}
