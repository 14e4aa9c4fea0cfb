//! Islands of one contact: the ladder has them solved at once, with the answer and the report of the general way.

use crate::common::*;
use carom_math::Space;
use carom_solver::methods::ladder::Ladder;
use carom_solver::{ContactProblem, FrictionLaw, ImpulseSolver, Impulses, SolveSettings, SolverKind, Stop};

/// Pairs of bodies side by side, a contact between each.
const PAIRS: usize = 60;
const SETTINGS: SolveSettings = SolveSettings {
    iterations: 100,
    tolerance: 1e-12,
    factorisations: 2000,
    impulses: carom_solver::ImpulseChoice::Any,
    content: None,
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

/// Who knows that a contact is alone need not make a problem of it.
fn a_contact_alone_is_solved_without_a_problem_as_with_one<S: Space>() {
    let mut pressing = 0;
    for (seed, law) in [(33, FrictionLaw::Disc), (34, FrictionLaw::Box)] {
        for p in pairs::<S>(&mut Random::new(seed), law) {
            let mut found = Impulses::zero(&p);
            let mut ladder = Ladder::new("exact", &[SolverKind::Exact]);
            let outcome = ladder.solve(&p, &SETTINGS, &mut found);
            let bodies = ([p.inverse_masses[0], p.inverse_masses[1]], [p.velocities[0], p.velocities[1]]);
            let Some((impulse, report)) =
                ladder.solve_alone(&p.contacts[0], (&bodies.0, &bodies.1), law, &SETTINGS)
            else {
                assert_eq!(law, FrictionLaw::Box, "Coulomb's disc has a closed form");
                continue;
            };
            assert_eq!(impulse, found.contacts[0], "{p:?}");
            let moves = |k: usize| !p.inverse_masses[k].is_fixed();
            let bodies = usize::from(moves(0)) + usize::from(moves(1));
            let island = report.map(|r| r.island(bodies, usize::from(!moves(0)), r.residual.worst));
            assert_eq!(island.as_ref(), outcome.islands.first());
            pressing += usize::from(report.is_some());
        }
    }
    assert!(pressing > PAIRS / 4, "{pressing} press");
    let least = SolveSettings { impulses: carom_solver::ImpulseChoice::MinimumNorm, ..SETTINGS };
    let p = &pairs::<S>(&mut Random::new(35), FrictionLaw::Disc)[0];
    let bodies = ([p.inverse_masses[0], p.inverse_masses[1]], [p.velocities[0], p.velocities[1]]);
    let ladder = Ladder::new("exact", &[SolverKind::Exact]);
    let least = ladder.solve_alone(&p.contacts[0], (&bodies.0, &bodies.1), FrictionLaw::Disc, &least);
    assert!(least.is_none(), "the least impulses are told by the solver alone");
}

in_both_spaces! {
    contacts_alone_are_solved_as_the_general_way_solves_them;
    a_contact_alone_is_solved_without_a_problem_as_with_one;
}
