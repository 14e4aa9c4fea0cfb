//! Laws that hold for every solver: momentum, angular momentum, and the energy identities (theory eqs. 3.11, 3.12,
//! 3.21, 4.20 and 4.22).

use crate::common::*;
use carom_math::{Column, Space};
use carom_solver::delassus::delassus;
use carom_solver::{Contact, ContactProblem, FrictionLaw, Impulses, SolverKind, Stop};

/// A free cluster: bodies with common contact points, nothing fixed; and where the bodies are.
fn free_cluster<S: Space>(
    random: &mut Random,
    bodies: usize,
    contacts: usize,
    friction: f64,
) -> (ContactProblem<S>, Vec<S::Vector>) {
    let positions: Vec<S::Vector> = (0..bodies).map(|_| random.column(1.0)).collect();
    let masses = (0..bodies).map(|_| random.inverse_mass()).collect();
    let velocities = (0..bodies).map(|_| random.twist(1.0)).collect();
    let mut problem = ContactProblem::new(masses, velocities);
    for i in 0..contacts {
        let a = random.below(bodies);
        let b = (a + 1 + random.below(bodies - 1)) % bodies;
        let point = (positions[a] + positions[b]) * 0.5 + random.column(0.3);
        let mut c = contact::<S>((a, point - positions[a]), (b, point - positions[b]), random.unit());
        if i % 2 == 0 && c.relative_velocity(&problem.velocities).0 > 0.0 {
            c.normal = -c.normal;
        }
        c.friction = if i % 3 == 0 { 0.0 } else { friction };
        problem.contacts.push(c);
    }
    (problem, positions)
}

/// Momentum and angular momentum of a free cluster stay to rounding, converged or not, whatever the solver, the
/// friction law and the number of iterations.
fn every_solver_keeps_momentum_and_angular_momentum<S: Space>() {
    let mut random = Random::new(1);
    for kind in SolverKind::ALL {
        let (mut acted, mut cases) = (0, 0);
        while cases < 200 && acted < 20 {
            cases += 1;
            // factorisation accepts only when every contact presses and sticks: few contacts, much friction;
            // enumeration knows no disc and takes few contacts
            let (contacts, friction) = match kind {
                SolverKind::Direct => (2, 5.0),
                SolverKind::Enumeration => (8, 0.0),
                _ => (12, 0.6),
            };
            let (mut problem, positions) = free_cluster::<S>(&mut random, 6, contacts, friction);
            problem.friction_law =
                if kind == SolverKind::Lemke { FrictionLaw::Box } else { FrictionLaw::Disc };
            bounce(&mut problem, 0.4);
            for iterations in [1, 50] {
                let (impulses, outcome) = solve(&problem, kind, iterations, 1e-10);
                if matches!(outcome.stop, Stop::Refused(_)) {
                    continue;
                }
                acted += impulses.flat().iter().any(|g| *g != 0.0) as usize;
                let after = problem.velocities_after(&impulses);
                let (p0, l0, _) = totals(&problem, &positions, &problem.velocities);
                let (p1, l1, _) = totals(&problem, &positions, &after);
                let size = impulses.flat().iter().fold(1.0, |m: f64, g| m.max(g.abs()));
                assert_column_close(p1, p0, 1e-14 * size, kind.name());
                assert_column_close(l1, l0, 1e-14 * size, kind.name());
            }
        }
        assert!(acted >= 20, "{} acted only {acted} times", kind.name());
    }
}

/// Frictionless with one common c_r: Delta T = -(1/2) (1 - c)/(1 + c) gamma^T A gamma (theory eq. 4.22).
fn frictionless_impacts_lose_exactly_the_energy_of_the_identity<S: Space>() {
    let mut random = Random::new(2);
    for restitution in [0.0, 0.3, 0.8, 1.0] {
        for _ in 0..10 {
            let (mut problem, _) = free_cluster::<S>(&mut random, 8, 9, 0.0);
            bounce(&mut problem, restitution);
            for kind in [SolverKind::Pgs, SolverKind::PgsMatrix, SolverKind::Lemke] {
                let impulses = solved(&problem, kind, 1e-11);
                let gamma = impulses.flat();
                let product: f64 =
                    delassus(&problem).times(&gamma).iter().zip(&gamma).map(|(a, g)| a * g).sum();
                let wanted = -0.5 * (1.0 - restitution) / (1.0 + restitution) * product;
                let got = kinetic_energy(&problem, &problem.velocities_after(&impulses))
                    - kinetic_energy(&problem, &problem.velocities);
                assert_close(got, wanted, 1e-9 * (1.0 + product), kind.name());
                assert!(restitution < 1.0 || got.abs() < 1e-9 * (1.0 + product));
            }
        }
    }
}

/// Any impulses at all, from no law: Delta T = 1/2 gamma . (u+ + u-) (theory eq. 3.12), bounded rows included.
fn the_work_of_any_impulses_is_their_product_with_the_mean_velocity<S: Space>() {
    let mut random = Random::new(3);
    for _ in 0..50 {
        let recipe = Recipe { bodies: 7, contacts: 9, rows: 4, friction: 0.5, law: FrictionLaw::Disc };
        let problem = random_problem::<S>(&mut random, recipe);
        let gamma: Vec<f64> = (0..problem.scalar_rows()).map(|_| random.between(-1.0, 1.0)).collect();
        let impulses = Impulses::from_flat(&problem, &gamma).expect("fits");
        let after = problem.velocities_after(&impulses);
        let u = |v: &[carom_solver::Twist<S>]| -> Vec<f64> {
            let contacts = problem.contacts.iter().flat_map(|c| {
                let (normal, slip) = c.relative_velocity(v);
                [&[normal], slip.as_slice()].concat()
            });
            let rows = problem.rows.iter().map(|r| r.on_a.dot(&v[r.a]) + r.on_b.dot(&v[r.b]));
            contacts.chain(rows).collect()
        };
        let work: f64 = gamma
            .iter()
            .zip(u(&problem.velocities))
            .zip(u(&after))
            .map(|((g, before), after)| 0.5 * g * (before + after))
            .sum();
        let gained = kinetic_energy(&problem, &after) - kinetic_energy(&problem, &problem.velocities);
        assert_close(gained, work, 1e-11 * (1.0 + gained.abs()), "work");
    }
}

/// Plastic contacts with friction never gain energy: Delta T <= -1/2 gamma^T A gamma (theory eq. 3.21 with e = 0), by
/// every solver of the simultaneous law, both friction laws.
fn plastic_contacts_with_friction_lose_at_least_what_the_bound_says<S: Space>() {
    let mut random = Random::new(4);
    for law in [FrictionLaw::Disc, FrictionLaw::Box] {
        for kind in [SolverKind::Pgs, SolverKind::PgsMatrix, SolverKind::Lemke] {
            if kind == SolverKind::Lemke && law == FrictionLaw::Disc && S::SLIP > 1 {
                continue;
            }
            for _ in 0..20 {
                let (mut problem, _) = free_cluster::<S>(&mut random, 8, 9, 0.4);
                problem.friction_law = law;
                let (impulses, outcome) = solve(&problem, kind, 100_000, 1e-11);
                assert_eq!(outcome.stop, Stop::Converged, "{}", kind.name());
                let gamma = impulses.flat();
                let product: f64 =
                    delassus(&problem).times(&gamma).iter().zip(&gamma).map(|(a, g)| a * g).sum();
                let gained = kinetic_energy(&problem, &problem.velocities_after(&impulses))
                    - kinetic_energy(&problem, &problem.velocities);
                assert!(gained <= -0.5 * product + 1e-9, "{}: {gained} > -{product}/2", kind.name());
            }
        }
    }
}

/// One collision at a time never gains energy, with different restitutions and friction (theory eq. 4.20), and
/// without friction at c_r = 1 keeps it.
fn sequential_collisions_never_gain_energy<S: Space>() {
    let mut random = Random::new(5);
    for elastic in [false, true] {
        for _ in 0..50 {
            let (mut problem, _) = free_cluster::<S>(&mut random, 6, 10, if elastic { 0.0 } else { 0.8 });
            bounce(&mut problem, 1.0);
            for c in &mut problem.contacts {
                c.target = c.target.max(0.0);
                c.restitution = if elastic { 1.0 } else { random.between(0.1, 1.0) };
            }
            let mut before = kinetic_energy(&problem, &problem.velocities);
            for rounds in [1, 2, 5, 20] {
                let (impulses, _) = solve(&problem, SolverKind::Sequential, rounds, 0.0);
                let after = kinetic_energy(&problem, &problem.velocities_after(&impulses));
                assert!(after <= before * (1.0 + 1e-12), "{after} > {before}");
                assert!(!elastic || after >= before * (1.0 - 1e-11), "{after} < {before}");
                before = after;
            }
        }
    }
}

/// A mirrored problem has the mirrored answer: solvers do not know left from right. Mirror: x -> -x, which turns
/// spins about the other way.
fn a_mirrored_problem_has_the_mirrored_answer<S: Space>() {
    let mut random = Random::new(6);
    let mirror = |v: S::Vector| S::Vector::from_fn(|i| if i == 0 { -v[0] } else { v[i] });
    // a spin is an axial vector: its components along the mirror's plane change sign
    let mirror_spin = |w: S::Spin| S::Spin::from_fn(|i| if S::SPIN > 1 && i == 0 { w[0] } else { -w[i] });
    for kind in [SolverKind::Pgs, SolverKind::Sequential, SolverKind::Lemke] {
        for _ in 0..10 {
            let (mut problem, _) =
                free_cluster::<S>(&mut random, 6, 8, if kind == SolverKind::Lemke { 0.0 } else { 0.5 });
            // balls have the same inertia in the mirror
            problem.inverse_masses.iter_mut().for_each(|m| *m = ball(1.0 / m.linear, 0.4));
            let mut mirrored = problem.clone();
            for v in &mut mirrored.velocities {
                (v.linear, v.angular) = (mirror(v.linear), mirror_spin(v.angular));
            }
            for c in &mut mirrored.contacts {
                *c = Contact {
                    normal: mirror(c.normal),
                    arm_a: mirror(c.arm_a),
                    arm_b: mirror(c.arm_b),
                    ..*c
                };
            }
            let answer = |p: &ContactProblem<S>| p.velocities_after(&solve(p, kind, 20_000, 1e-12).0);
            for (v, w) in answer(&problem).iter().zip(&answer(&mirrored)) {
                assert_column_close(mirror(v.linear), w.linear, 1e-9, kind.name());
                assert_column_close(mirror_spin(v.angular), w.angular, 1e-8, kind.name());
            }
        }
    }
}

in_both_spaces! {
    every_solver_keeps_momentum_and_angular_momentum;
    frictionless_impacts_lose_exactly_the_energy_of_the_identity;
    the_work_of_any_impulses_is_their_product_with_the_mean_velocity;
    plastic_contacts_with_friction_lose_at_least_what_the_bound_says;
    sequential_collisions_never_gain_energy;
    a_mirrored_problem_has_the_mirrored_answer;
}
