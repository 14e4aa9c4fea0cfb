//! Islands of one contact: the ladder has them solved at once, with the answer and the report of the general way.

use crate::common::*;
use carom_math::Space;
use carom_solver::methods::ladder::{Ladder, Resting};
use carom_solver::{
    ContactProblem, FrictionLaw, ImpulseSolver, Impulses, SolveSettings, SolverKind, Stop, Twist,
};

/// Pairs of bodies side by side, a contact between each.
const PAIRS: usize = 60;
const SETTINGS: SolveSettings = SolveSettings {
    iterations: 100,
    tolerance: 1e-12,
    factorisations: 2000,
    impulses: carom_solver::ImpulseChoice::Any,
    content: None,
    polish: false,
};

fn pairs<S: Space>(random: &mut Random, law: FrictionLaw) -> Vec<ContactProblem<S>> {
    let recipe = Recipe { bodies: 2, contacts: 1, rows: 0, friction: 1.0, law };
    (0..PAIRS).map(|_| random_problem(random, recipe)).collect()
}

fn contacts_alone_are_solved_as_the_general_way_solves_them<S: Space>() {
    for (seed, law) in [(31, FrictionLaw::Disc), (32, FrictionLaw::Box)] {
        let problems = pairs::<S>(&mut Random::new(seed), law);
        let whole = beside(&problems);
        let mut found = Impulses::zero(&whole);
        let mut ladder = Ladder::new("exact", &[SolverKind::Exact]);
        let outcome = ladder.solve(&whole, &SETTINGS, &mut found);
        let mut reports = outcome.islands.iter();
        for (k, p) in problems.iter().enumerate() {
            let mut alone = Impulses::zero(p);
            let general = SolverKind::Exact.make().solve(p, &SETTINGS, &mut alone);
            assert_eq!(found.contacts[k], alone.contacts[0], "{p:?}");
            if alone.contacts[0].normal == 0.0 {
                continue; // where nothing presses nothing is solved
            }
            let report = reports.next().expect("a report of each that presses");
            assert_eq!((report.contacts, report.residual), (1, general.residual.absolute));
            assert_eq!(report.relative_residual, general.residual.relative);
            assert_eq!((report.stages.len(), &report.stages[0].stop), (1, &Stop::Converged));
        }
        assert!(outcome.islands.len() > PAIRS / 4, "{} of {PAIRS} press", outcome.islands.len());
    }
}

/// The contact of a problem of a body beside an obstacle, made one without friction at rest.
fn resting<S: Space>(p: &mut ContactProblem<S>) -> Resting<S> {
    assert!(p.inverse_masses[0].is_fixed() && p.velocities[0] == Twist::default());
    let c = &mut p.contacts[0];
    c.friction = 0.0;
    let (arm, normal) = if c.a == 1 { (c.arm_a, c.normal) } else { (c.arm_b, -c.normal) };
    Resting { normal, arm, target: c.target, mass: p.inverse_masses[1], velocity: p.velocities[1] }
}

/// Who knows that a body has one contact with an obstacle at rest need not make a problem of it.
fn a_resting_contact_is_solved_without_a_problem_as_with_one<S: Space>() {
    let mut pressing = 0;
    for mut p in pairs::<S>(&mut Random::new(33), FrictionLaw::Disc) {
        let contact = resting(&mut p);
        let mut found = Impulses::zero(&p);
        let mut ladder = Ladder::new("exact", &[SolverKind::Exact]);
        let outcome = ladder.solve(&p, &SETTINGS, &mut found);
        let (impulse, report) = ladder.solve_resting(&contact, &SETTINGS).expect("a closed form");
        assert_eq!(impulse, found.contacts[0].normal, "{p:?}");
        let island = report.map(|r| r.island(1, 1, r.residual.worst));
        assert_eq!(island.as_ref(), outcome.islands.first());
        pressing += usize::from(report.is_some());
        let least = SolveSettings { impulses: carom_solver::ImpulseChoice::MinimumNorm, ..SETTINGS };
        assert!(
            ladder.solve_resting(&contact, &least).is_none(),
            "the least impulses are told by the solver alone"
        );
    }
    assert!(pressing > PAIRS / 4, "{pressing} press");
}

in_both_spaces! {
    contacts_alone_are_solved_as_the_general_way_solves_them;
    a_resting_contact_is_solved_without_a_problem_as_with_one;
}
