//! Systems of collisions: particles and their closed forms, one collision at a time, the iteration, and impacts with
//! known answers (theory chapter 4; items 20 to 25, 47; cases C9, C10, C11).

use crate::common::*;
use carom_math::{Column, Inertia, Space};
use carom_solver::delassus::delassus;
use carom_solver::{Contact, ContactProblem, SolverKind, Stop, Twist};

/// The solvers of the simultaneous law.
const SIMULTANEOUS: [SolverKind; 4] =
    [SolverKind::Pgs, SolverKind::PgsMatrix, SolverKind::Direct, SolverKind::Lemke];

/// One collision at a time, to the end.
fn one_at_a_time<S: Space>(problem: &ContactProblem<S>) -> Vec<Twist<S>> {
    let (impulses, outcome) = solve(problem, SolverKind::Sequential, 1000, 1e-12);
    assert_eq!(outcome.stop, Stop::Converged);
    problem.velocities_after(&impulses)
}

/// Particles in a row of random masses that push on each other, contact i between i and i + 1.
fn particles<S: Space>(random: &mut Random, count: usize) -> ContactProblem<S> {
    let masses = (0..count).map(|_| particle::<S>(random.between(0.3, 3.0))).collect();
    let velocities = (0..count).map(|_| moving(random.column(1.0))).collect();
    let mut problem = ContactProblem::new(masses, velocities);
    for i in 0..count - 1 {
        problem.contacts.push(contact((i, S::Vector::ZERO), (i + 1, S::Vector::ZERO), random.unit()));
    }
    problem
}

/// Item 21: gamma = -(1+c_r) m_eff v-, v+ = -c_r v-, and a separating pair is left alone (theory eq. 4.1), for
/// every solver.
fn two_particles_respond_by_the_closed_form<S: Space>() {
    let mut random = Random::new(21);
    for case in 0..50 {
        let mut problem = particles::<S>(&mut random, 2);
        bounce(&mut problem, 0.6);
        let speed = problem.contacts[0].relative_velocity(&problem.velocities).0;
        let inverse = problem.inverse_masses[0].linear + problem.inverse_masses[1].linear;
        let wanted = if speed < 0.0 { -1.6 * speed / inverse } else { 0.0 };
        for kind in SolverKind::ALL {
            if speed >= 0.0 && kind == SolverKind::Direct {
                continue; // it would have to pull, and refuses: tested with the direct solver
            }
            if speed >= 0.0 {
                problem.contacts[0].target = 0.0;
            }
            let (impulses, outcome) = solve(&problem, kind, 100, 5e-15);
            assert_eq!(outcome.stop, Stop::Converged, "case {case}, {}", kind.name());
            assert_close(impulses.contacts[0].normal, wanted, 1e-14, kind.name());
        }
    }
}

/// Item 22: a body at rest on a fixed one, pulled by a step's worth of gravity, is held without motion; one that
/// rests already gets nothing. For every solver.
fn a_resting_contact_holds_and_gives_no_more_than_needed<S: Space>() {
    for pull in [0.0, 0.04] {
        let up = S::DIM - 1;
        let velocities = vec![moving(along(up, -pull)), Twist::default()];
        let mut problem = ContactProblem::<S>::new(vec![ball(2.0, 0.5), obstacle()], velocities);
        let mut c = contact((0, along(up, -0.5)), (1, S::Vector::ZERO), along(up, 1.0));
        c.friction = 0.5;
        problem.contacts.push(c);
        for kind in SolverKind::ALL {
            if kind == SolverKind::Lemke && S::SLIP > 1 {
                problem.contacts[0].friction = 0.0;
            }
            let (impulses, outcome) = solve(&problem, kind, 10, 1e-15);
            assert_eq!(outcome.stop, Stop::Converged, "{}", kind.name());
            assert_close(impulses.contacts[0].normal, 2.0 * pull, 1e-16, kind.name());
            // not asked to the last bit: solvers that take roots of masses round once more
            let left = problem.velocities_after(&impulses)[0];
            assert!(left.dot(&left).sqrt() <= f64::EPSILON * pull, "{}: {left:?}", kind.name());
        }
    }
}

/// Item 23: the middle one of three particles feels both impulses; each is the one the other leaves to it (4.3),
/// and both together are the closed solution (4.4).
fn two_coupled_collisions_have_the_closed_solution<S: Space>() {
    let mut random = Random::new(23);
    let mut tested = 0;
    while tested < 50 {
        let mut problem = particles::<S>(&mut random, 3);
        bounce(&mut problem, 0.7);
        let inverse: Vec<f64> = problem.inverse_masses.iter().map(|m| m.linear).collect();
        let u: Vec<f64> =
            problem.contacts.iter().map(|c| c.relative_velocity(&problem.velocities).0).collect();
        let (k1, k2) = (inverse[0] + inverse[1], inverse[1] + inverse[2]);
        let kappa = problem.contacts[0].normal.dot(problem.contacts[1].normal) * inverse[1];
        let determinant = k1 * k2 - kappa * kappa;
        let wanted = [
            -1.7 * (k2 * u[0] + kappa * u[1]) / determinant,
            -1.7 * (k1 * u[1] + kappa * u[0]) / determinant,
        ];
        if wanted.iter().any(|g| *g < 0.0) {
            continue;
        }
        tested += 1;
        assert_close(wanted[0], (-1.7 * u[0] + kappa * wanted[1]) / k1, 1e-12, "gamma_1 given gamma_2");
        for kind in SIMULTANEOUS {
            let impulses = solved(&problem, kind, 1e-13);
            for (g, wanted) in impulses.contacts.iter().zip(wanted) {
                assert_close(g.normal, wanted, 1e-11, kind.name());
            }
        }
    }
}

/// s_jx: +1, -1, 0 when body x is the first, the second, no body of contact j.
fn sign<S: Space>(c: &Contact<S>, x: usize) -> f64 {
    if c.a == x {
        1.0
    } else if c.b == x {
        -1.0
    } else {
        0.0
    }
}

/// Items 24, 47: for particles anywhere in a graph the general gamma_i with the signs s_jx (theory eqs. 4.5, 4.6)
/// gives back every impulse of a solution, and its coefficients (4.7) are the entries of A.
fn the_general_formula_for_particles_holds_at_every_contact<S: Space>() {
    let mut random = Random::new(24);
    for _ in 0..30 {
        let mut problem = random_problem::<S>(
            &mut random,
            Recipe { bodies: 6, contacts: 8, rows: 0, friction: 0.0, law: Default::default() },
        );
        problem.inverse_masses.iter_mut().for_each(|m| m.angular = S::Inertia::ZERO);
        problem.velocities.iter_mut().for_each(|v| v.angular = S::Spin::ZERO);
        problem.contacts.iter_mut().for_each(|c| c.target = 0.0);
        let inverse: Vec<f64> = problem.inverse_masses.iter().map(|m| m.linear).collect();
        let a = delassus(&problem).dense();
        let impulses = solved(&problem, SolverKind::Lemke, 1e-12);
        let gamma: Vec<f64> = impulses.contacts.iter().map(|g| g.normal).collect();
        let width = 1 + S::SLIP;
        for (i, c) in problem.contacts.iter().enumerate() {
            for (j, d) in problem.contacts.iter().enumerate() {
                let shared = |x: usize| sign(c, x) * sign(d, x) * inverse[x] * c.normal.dot(d.normal);
                assert_close(a[i * width][j * width], (0..6).map(shared).sum(), 1e-14, "a_ij");
            }
            let others = |x: usize| {
                let mut sum = S::Vector::ZERO;
                for (j, d) in problem.contacts.iter().enumerate().filter(|(j, _)| *j != i) {
                    sum += d.normal * (sign(d, x) * gamma[j]);
                }
                sum
            };
            let speed = c.relative_velocity(&problem.velocities).0;
            let left =
                -speed - inverse[c.a] * c.normal.dot(others(c.a)) + inverse[c.b] * c.normal.dot(others(c.b));
            let wanted = (left / (inverse[c.a] + inverse[c.b])).max(0.0);
            assert_close(gamma[i], wanted, 1e-12, "gamma_i");
        }
    }
}

/// Item 47: a particle has no inverse inertia; its arms do not matter and it never turns. For every solver.
fn particles_do_not_turn_whatever_their_arms<S: Space>() {
    let mut random = Random::new(47);
    let mut bare = particles::<S>(&mut random, 4);
    bare.contacts.iter_mut().for_each(|c| c.target = -0.05);
    let mut with_arms = bare.clone();
    for c in &mut with_arms.contacts {
        (c.arm_a, c.arm_b) = (random.column(1.0), random.column(1.0));
    }
    for kind in SolverKind::ALL {
        let (plain, _) = solve(&bare, kind, 50, 0.0);
        let (armed, _) = solve(&with_arms, kind, 50, 0.0);
        assert_eq!(plain, armed, "{}", kind.name());
        let after = with_arms.velocities_after(&armed);
        assert!(after.iter().all(|v| v.angular == S::Spin::ZERO), "{}", kind.name());
    }
}

/// Items 46, 47: particles and rigid bodies meet in one problem; the particle gets what it gives.
fn a_particle_and_a_rigid_body_collide_and_keep_their_momenta<S: Space>() {
    let mut random = Random::new(48);
    for kind in SolverKind::ALL {
        let mut problem = ContactProblem::<S>::new(
            vec![particle(0.5), random.inverse_mass()],
            vec![moving(random.column(1.0)), random.twist(1.0)],
        );
        let arm: S::Vector = random.column(0.5);
        let mut c = contact((0, S::Vector::ZERO), (1, arm), random.unit());
        if c.relative_velocity(&problem.velocities).0 > 0.0 {
            c.normal = -c.normal;
        }
        problem.contacts.push(c);
        bounce(&mut problem, 0.9);
        let (impulses, outcome) = solve(&problem, kind, 100, 1e-14);
        assert_eq!(outcome.stop, Stop::Converged, "{}", kind.name());
        let after = problem.velocities_after(&impulses);
        let positions = [arm, S::Vector::ZERO];
        let (p0, l0, t0) = totals(&problem, &positions, &problem.velocities);
        let (p1, l1, t1) = totals(&problem, &positions, &after);
        assert_column_close(p1, p0, 1e-15, kind.name());
        assert_column_close(l1, l0, 1e-15, kind.name());
        assert!(t1 < t0 && impulses.contacts[0].normal > 0.0, "{}", kind.name());
        assert_close(
            problem.contacts[0].relative_velocity(&after).0,
            problem.contacts[0].target,
            1e-14,
            kind.name(),
        );
    }
}

/// Item 25: the iteration of the notes, written out on positions in phase space (prospective velocities, gamma = 0,
/// sweep, clamp the accumulated impulse, apply), gives the numbers of the solver `pgs`, sweep by sweep.
fn the_iteration_of_the_notes_is_projected_gauss_seidel_sweep_by_sweep<S: Space>() {
    let mut random = Random::new(25);
    for _ in 0..10 {
        let recipe = Recipe { bodies: 6, contacts: 10, rows: 0, friction: 0.0, law: Default::default() };
        let problem = random_problem::<S>(&mut random, recipe);
        let mut v = problem.velocities.clone();
        let mut gamma = vec![0.0; problem.contacts.len()];
        for sweeps in 1..=20 {
            for (c, gamma) in problem.contacts.iter().zip(&mut gamma) {
                let (m_a, m_b) = (&problem.inverse_masses[c.a], &problem.inverse_masses[c.b]);
                let mass = carom_solver::collision::effective_mass(c.normal, (m_a, c.arm_a), (m_b, c.arm_b));
                let new = f64::max(0.0, *gamma - mass * (c.relative_velocity(&v).0 - c.target));
                let push = c.normal * (new - *gamma);
                v[c.a] = carom_solver::collision::apply_impulse(&v[c.a], m_a, c.arm_a, push);
                v[c.b] = carom_solver::collision::apply_impulse(&v[c.b], m_b, c.arm_b, -push);
                *gamma = new;
            }
            let (impulses, _) = solve(&problem, SolverKind::Pgs, sweeps, 0.0);
            for (g, wanted) in impulses.contacts.iter().zip(&gamma) {
                assert_close(g.normal, *wanted, 1e-13, "impulse after a sweep");
            }
        }
    }
}

/// Item 20: one collision at a time, written out with the pieces of one collision, is the solver `sequential`; the
/// order of the contacts is part of the law.
fn one_collision_after_another_is_the_sequential_solver<S: Space>() {
    let mut random = Random::new(20);
    let recipe = Recipe { bodies: 5, contacts: 6, rows: 0, friction: 0.0, law: Default::default() };
    let mut orders_matter = 0;
    for _ in 0..20 {
        let mut problem = random_problem::<S>(&mut random, recipe);
        problem.contacts.iter_mut().for_each(|c| (c.restitution, c.target) = (0.5, 1.0));
        let mut v = problem.velocities.clone();
        for rounds in 1..=5 {
            for c in &problem.contacts {
                let body = |k: usize, arm| (v[k], problem.inverse_masses[k], arm);
                let ((a, m_a, arm_a), (b, m_b, arm_b)) = (body(c.a, c.arm_a), body(c.b, c.arm_b));
                let (a, b, _) =
                    carom_solver::collision::collide((&a, &m_a, arm_a), (&b, &m_b, arm_b), c.normal, 0.5);
                (v[c.a], v[c.b]) = (a, b);
            }
            let (impulses, _) = solve(&problem, SolverKind::Sequential, rounds, 0.0);
            let got = problem.velocities_after(&impulses);
            for (got, wanted) in got.iter().zip(&v) {
                assert_column_close(got.linear, wanted.linear, 1e-12, "velocity");
                assert_column_close(got.angular, wanted.angular, 1e-11, "spin");
            }
        }
        problem.contacts.reverse();
        let (impulses, _) = solve(&problem, SolverKind::Sequential, 5, 0.0);
        let other = problem.velocities_after(&impulses);
        orders_matter += other.iter().zip(&v).any(|(p, q)| (p.linear - q.linear).max_abs() > 1e-3) as usize;
    }
    assert!(orders_matter > 5);
}

/// Item 20: sequential contacts that only hold (no bounce) end with no approach, and a speed asked for is reached.
fn sequential_contacts_reach_the_targets_that_they_hold<S: Space>() {
    let velocities = vec![moving(along(0, -1.0)), Twist::default()];
    let mut problem = ContactProblem::<S>::new(vec![ball(1.0, 0.5), obstacle()], velocities);
    problem.contacts.push(contact((0, along(0, -0.5)), (1, S::Vector::ZERO), along(0, 1.0)));
    for (target, restitution, wanted) in [
        (0.0, 0.0, 0.0),
        (-0.25, 0.0, -0.25),
        (-0.25, 0.9, -0.25),
        (0.3, 0.0, 0.3),
        (0.9, 0.9, 0.9),
        (-2.0, 0.5, -1.0),
    ] {
        (problem.contacts[0].target, problem.contacts[0].restitution) = (target, restitution);
        assert_close(one_at_a_time(&problem)[0].linear[0], wanted, 1e-15, "end speed");
    }
}

/// C10: three equal balls, restitution 1, a cue ball at 1 m/s against two touching ones at +-30 degrees.
fn bernoulli<S: Space>() -> ContactProblem<S> {
    let masses = vec![ball::<S>(1.0, 0.5); 3];
    let velocities = vec![moving(along(0, 1.0)), Twist::default(), Twist::default()];
    let mut problem = ContactProblem::new(masses, velocities);
    for (target, side) in [(1, 1.0), (2, -1.0)] {
        let direction: S::Vector = flat(0.75f64.sqrt(), 0.5 * side);
        problem.contacts.push(contact((0, direction * 0.5), (target, direction * -0.5), -direction));
    }
    bounce(&mut problem, 1.0);
    problem
}

/// C10: the simultaneous law is mirror-symmetric: cue -1/5, targets (3/5, +-sqrt(3)/5).
fn three_balls_at_once_mirror_each_other<S: Space>() {
    let problem = bernoulli::<S>();
    for kind in SIMULTANEOUS {
        let after = problem.velocities_after(&solved(&problem, kind, 1e-13));
        for (v, (x, y)) in after.iter().zip([(-0.2, 0.0), (0.6, 0.12f64.sqrt()), (0.6, -(0.12f64.sqrt()))]) {
            assert_column_close(v.linear, flat(x, y), 1e-12, kind.name());
        }
        assert_close(after[1].linear[1] + after[2].linear[1], 0.0, 1e-12, "mirror symmetry");
        assert_close(kinetic_energy(&problem, &after), 0.5, 1e-12, "energy");
    }
}

/// C10: one at a time, contact 1 first: (-1/8, -sqrt(3)/8), (3/4, sqrt(3)/4), (3/8, -sqrt(3)/8).
fn three_balls_one_after_the_other_depend_on_the_order<S: Space>() {
    let mut problem = bernoulli::<S>();
    let root = 3f64.sqrt();
    let wanted = [(-0.125, -root / 8.0), (0.75, root / 4.0), (0.375, -root / 8.0)];
    for (v, (x, y)) in one_at_a_time(&problem).iter().zip(wanted) {
        assert_column_close(v.linear, flat(x, y), 1e-14, "contact 1 first");
    }
    problem.contacts.reverse();
    let after = one_at_a_time(&problem);
    for (ball, (x, y)) in [(0, wanted[0]), (2, wanted[1]), (1, wanted[2])] {
        assert_column_close(after[ball].linear, flat(x, -y), 1e-14, "contact 2 first");
    }
}

/// C11: the cradle under the simultaneous law shares the blow.
fn a_cradle_hit_at_once_shares_the_blow<S: Space>() {
    let third = 1.0 / 3.0;
    let cases: [(&[f64], &[f64]); 4] = [
        (&[1.0, 0.0, 0.0], &[-third, 2.0 * third, 2.0 * third]),
        (&[1.0, 0.0, 0.0, 0.0], &[-0.5, 0.5, 0.5, 0.5]),
        (&[1.0, 0.0, 0.0, 0.0, 0.0], &[-0.6, 0.4, 0.4, 0.4, 0.4]),
        (&[1.0, 1.0, 0.0, 0.0, 0.0], &[-0.2, -0.2, 0.8, 0.8, 0.8]),
    ];
    for (before, wanted) in cases {
        let mut problem = cradle::<S>(before);
        bounce(&mut problem, 1.0);
        for kind in SIMULTANEOUS {
            let after = speeds(&problem.velocities_after(&solved(&problem, kind, 1e-13)));
            after
                .iter()
                .zip(wanted)
                .for_each(|(got, wanted)| assert_close(*got, *wanted, 1e-11, kind.name()));
        }
    }
}

/// C11: one collision at a time lets only the last ball (or the last two) go, exactly.
fn a_cradle_hit_one_after_the_other_passes_the_blow_on<S: Space>() {
    for (before, wanted) in [
        (vec![1.0, 0.0, 0.0], vec![0.0, 0.0, 1.0]),
        (vec![1.0, 0.0, 0.0, 0.0], vec![0.0, 0.0, 0.0, 1.0]),
        (vec![1.0, 0.0, 0.0, 0.0, 0.0], vec![0.0, 0.0, 0.0, 0.0, 1.0]),
        (vec![1.0, 1.0, 0.0, 0.0, 0.0], vec![0.0, 0.0, 0.0, 1.0, 1.0]),
    ] {
        let mut problem = cradle::<S>(&before);
        bounce(&mut problem, 1.0);
        assert_eq!(speeds(&one_at_a_time(&problem)), wanted);
        problem.contacts.reverse();
        assert_eq!(speeds(&one_at_a_time(&problem)), wanted, "the blow finds its way in the other order too");
    }
}

/// C9, touching: a ball of mass 3 carrying one of mass 1 lands with speed 1. At once: v1 = v2 = 1, since the upper
/// contact does not approach; one after the other: v1 = 0, v2 = 2.
fn a_stacked_drop_has_one_answer_per_law<S: Space>() {
    let masses = vec![obstacle(), ball::<S>(3.0, 0.5), ball(1.0, 0.3)];
    let falling = moving(along(0, -1.0));
    let mut problem = ContactProblem::new(masses, vec![Twist::default(), falling, falling]);
    problem.contacts.push(contact((1, along(0, -0.5)), (0, S::Vector::ZERO), along(0, 1.0)));
    problem.contacts.push(contact((2, along(0, -0.3)), (1, along(0, 0.5)), along(0, 1.0)));
    bounce(&mut problem, 1.0);
    for kind in SIMULTANEOUS {
        let after = speeds(&problem.velocities_after(&solved(&problem, kind, 1e-13)));
        assert_close(after[1], 1.0, 1e-12, kind.name());
        assert_close(after[2], 1.0, 1e-12, kind.name());
    }
    assert_eq!(speeds(&one_at_a_time(&problem)), vec![0.0, 0.0, 2.0]);
}

/// The trap of theory section 4.5: contacts that separate already. Demanding -c_r u- of them pulls no one but lets a
/// neighbour in; cutting the target off creates energy, and the numbers of the page come out.
fn targets_of_separating_contacts_are_a_trap<S: Space>() {
    let mut problem = cradle::<S>(&[10.0, -1.0, 0.0]);
    bounce(&mut problem, 1.0);
    let after = speeds(&problem.velocities_after(&solved(&problem, SolverKind::Lemke, 1e-13)));
    after.iter().zip([-4.0, 7.0, 6.0]).for_each(|(got, wanted)| assert_close(*got, wanted, 1e-12, "let in"));
    problem.contacts[1].target = 0.0;
    let after = problem.velocities_after(&solved(&problem, SolverKind::Lemke, 1e-13));
    let wanted = [-13.0 / 3.0, 20.0 / 3.0, 20.0 / 3.0];
    speeds(&after).iter().zip(wanted).for_each(|(got, wanted)| assert_close(*got, wanted, 1e-12, "cut off"));
    let gain = kinetic_energy(&problem, &after) / kinetic_energy(&problem, &problem.velocities);
    assert_close(gain, 1.066, 5e-4, "energy");
    // one at a time is clean
    let after = speeds(&one_at_a_time(&problem));
    after
        .iter()
        .zip([-1.0, 0.0, 10.0])
        .for_each(|(got, wanted)| assert_close(*got, wanted, 1e-14, "sequential"));
}

/// Three particles collide without end when c_r < 7 - 4 sqrt(3) (theory eq. 4.27): the loop stops at its cap and
/// says so; just above the limit it ends by itself.
fn an_inelastic_collapse_ends_at_the_cap_and_is_reported<S: Space>() {
    let limit = 7.0 - 4.0 * 3f64.sqrt();
    for (restitution, stop) in [(0.9 * limit, Stop::OutOfIterations), (1.1 * limit, Stop::Converged)] {
        let mut problem = cradle::<S>(&[1.0, 0.0, -1.0]);
        bounce(&mut problem, restitution);
        let (impulses, outcome) = solve(&problem, SolverKind::Sequential, 100, 0.0);
        assert_eq!(outcome.stop, stop);
        assert!(impulses.is_finite());
    }
}

in_both_spaces! {
    two_particles_respond_by_the_closed_form;
    a_resting_contact_holds_and_gives_no_more_than_needed;
    two_coupled_collisions_have_the_closed_solution;
    the_general_formula_for_particles_holds_at_every_contact;
    particles_do_not_turn_whatever_their_arms;
    a_particle_and_a_rigid_body_collide_and_keep_their_momenta;
    the_iteration_of_the_notes_is_projected_gauss_seidel_sweep_by_sweep;
    one_collision_after_another_is_the_sequential_solver;
    sequential_contacts_reach_the_targets_that_they_hold;
    three_balls_at_once_mirror_each_other;
    three_balls_one_after_the_other_depend_on_the_order;
    a_cradle_hit_at_once_shares_the_blow;
    a_cradle_hit_one_after_the_other_passes_the_blow_on;
    a_stacked_drop_has_one_answer_per_law;
    targets_of_separating_contacts_are_a_trap;
    an_inelastic_collapse_ends_at_the_cap_and_is_reported;
}
