//! The matrix form: J, M, A = J M^-1 J^T and b, and what virtual work says of them (theory chapter 5, sections 5.1
//! to 5.3; items 28 to 32, 38 to 43).

use crate::common::*;
use carom_math::{Column, Inertia, Space};
use carom_solver::delassus::*;
use carom_solver::{ContactProblem, FrictionLaw, Impulses, SolverKind, Twist};

const RECIPE: Recipe = Recipe { bodies: 6, contacts: 9, rows: 3, friction: 0.6, law: FrictionLaw::Disc };

/// All velocities in one column, as the columns of J count them.
fn stacked<S: Space>(velocities: &[Twist<S>]) -> Vec<f64> {
    let numbers = |v: &Twist<S>| [v.linear.as_slice(), v.angular.as_slice()].concat();
    velocities.iter().flat_map(numbers).collect()
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(x, y)| x * y).sum()
}

fn transposed_times(j: &Csr, x: &[f64]) -> Vec<f64> {
    let mut out = vec![0.0; j.shape.1];
    for (i, x) in x.iter().enumerate() {
        j.row(i).for_each(|(k, value)| out[k] += value * x);
    }
    out
}

#[track_caller]
fn assert_all_close(got: &[f64], wanted: &[f64], tolerance: f64, what: &str) {
    assert_eq!(got.len(), wanted.len());
    got.iter().zip(wanted).for_each(|(g, w)| assert_close(*g, *w, tolerance, what));
}

/// Item 28: J has one row per unknown and DOF columns per body, [n, r x n] on a and its opposite on b.
fn the_jacobian_has_the_printed_rows_for_any_number_of_bodies_and_contacts<S: Space>() {
    let mut random = Random::new(28);
    for bodies in 2..8 {
        let problem = random_problem::<S>(&mut random, Recipe { bodies, contacts: 2 * bodies, ..RECIPE });
        let j = jacobian(&problem);
        assert_eq!(j.shape, (problem.scalar_rows(), bodies * S::DOF));
        let dense = j.dense();
        for (i, c) in problem.contacts.iter().enumerate() {
            let mut wanted = vec![0.0; bodies * S::DOF];
            let mut put = |body: usize, linear: S::Vector, angular: S::Spin| {
                let base = body * S::DOF;
                wanted[base..base + S::DIM].copy_from_slice(linear.as_slice());
                wanted[base + S::DIM..base + S::DOF].copy_from_slice(angular.as_slice());
            };
            put(c.a, c.normal, S::moment(c.arm_a, c.normal));
            put(c.b, -c.normal, -S::moment(c.arm_b, c.normal));
            assert_eq!(dense[i * (1 + S::SLIP)], wanted);
        }
    }
}

/// Items 28, 40: J v is the velocity of every row: normal and slip of the contacts, J u of the bounded rows.
fn the_jacobian_times_the_velocities_is_the_relative_velocity_of_every_row<S: Space>() {
    let problem = random_problem::<S>(&mut Random::new(40), RECIPE);
    let mut wanted = Vec::new();
    for c in &problem.contacts {
        let (normal, slip) = c.relative_velocity(&problem.velocities);
        wanted.push(normal);
        wanted.extend_from_slice(slip.as_slice());
    }
    for r in &problem.rows {
        wanted.push(r.on_a.dot(&problem.velocities[r.a]) + r.on_b.dot(&problem.velocities[r.b]));
    }
    assert_all_close(&jacobian(&problem).times(&stacked(&problem.velocities)), &wanted, 1e-14, "J v");
}

/// Item 29: v+ = v- + M^-1 J^T gamma, by matrices, body by body, and from prepared rows.
fn impulses_change_the_velocities_by_the_inverse_mass_times_the_transposed_jacobian<S: Space>() {
    let mut random = Random::new(29);
    for _ in 0..20 {
        let problem = random_problem::<S>(&mut random, RECIPE);
        let gamma: Vec<f64> = (0..problem.scalar_rows()).map(|_| random.between(-1.0, 1.0)).collect();
        let impulses = Impulses::from_flat(&problem, &gamma).expect("fits");
        let change = inverse_mass_matrix(&problem).times(&transposed_times(&jacobian(&problem), &gamma));
        let mut wanted = stacked(&problem.velocities);
        wanted.iter_mut().zip(change).for_each(|(v, dv)| *v += dv);
        assert_all_close(&stacked(&problem.velocities_after(&impulses)), &wanted, 1e-12, "v+");
        let mut prepared = problem.velocities.clone();
        carom_solver::prepared::Prepared::of(&problem).apply(&impulses, &mut prepared);
        assert_all_close(&stacked(&prepared), &wanted, 1e-12, "v+ from prepared rows");
    }
}

/// Item 40: the generalised impulse J^T gamma is the change of the generalised momentum M v.
fn the_transposed_jacobian_times_the_impulses_is_the_change_of_momentum<S: Space>() {
    let mut random = Random::new(41);
    let problem = random_problem::<S>(&mut random, RECIPE);
    let gamma: Vec<f64> = (0..problem.scalar_rows()).map(|_| random.between(-1.0, 1.0)).collect();
    let after = problem.velocities_after(&Impulses::from_flat(&problem, &gamma).expect("fits"));
    let generalised = transposed_times(&jacobian(&problem), &gamma);
    for (k, m) in problem.inverse_masses.iter().enumerate().skip(1) {
        let inertia = m.angular.inverse().expect("regular");
        let (before, after) = (&problem.velocities[k], &after[k]);
        let momentum = (after.linear - before.linear) * (1.0 / m.linear);
        let spin = inertia.apply(after.angular - before.angular);
        let wanted = [momentum.as_slice(), spin.as_slice()].concat();
        assert_all_close(&generalised[k * S::DOF..(k + 1) * S::DOF], &wanted, 1e-12, "M dv");
    }
}

/// Item 30: A assembled row by row is the dense product J M^-1 J^T, symmetric, and b = target - J v.
fn a_and_b_are_those_of_the_dense_product<S: Space>() {
    let mut random = Random::new(30);
    for _ in 0..20 {
        let problem = random_problem::<S>(&mut random, RECIPE);
        let (a, j, inverse) =
            (delassus(&problem).dense(), jacobian(&problem).dense(), inverse_mass_matrix(&problem));
        for (i, row) in j.iter().enumerate() {
            let moved = inverse.times(row);
            for (k, other) in j.iter().enumerate() {
                assert_close(a[i][k], dot(other, &moved), 1e-13, "A");
                assert_eq!(a[i][k], a[k][i], "A is symmetric");
            }
        }
        let free = jacobian(&problem).times(&stacked(&problem.velocities));
        let wanted: Vec<f64> = targets(&problem).iter().zip(&free).map(|(t, u)| t - u).collect();
        assert_all_close(&right_hand_side(&problem), &wanted, 1e-14, "b");
    }
}

/// Items 30, 42: with Newton's targets b = -(1 + c_r) J v- on the normal rows, and a regular system's solution
/// turns every normal velocity round: J M^-1 J^T lambda = -(1 + c_r) J v-.
fn the_newton_system_has_minus_one_plus_restitution_times_the_velocity_on_its_right<S: Space>() {
    let mut problem = cradle::<S>(&[1.0, 0.0, -0.4, -0.9]);
    bounce(&mut problem, 0.6);
    let (a, b, width) = (delassus(&problem), right_hand_side(&problem), 1 + S::SLIP);
    let impulses = solved(&problem, SolverKind::Direct, 1e-14);
    let product = a.times(&impulses.flat());
    let after = problem.velocities_after(&impulses);
    for (i, c) in problem.contacts.iter().enumerate() {
        let before = c.relative_velocity(&problem.velocities).0;
        assert_close(b[i * width], -1.6 * before, 1e-15, "b");
        assert_close(product[i * width], b[i * width], 1e-14, "A lambda = b");
        assert_close(c.relative_velocity(&after).0, -0.6 * before, 1e-14, "u+ = -c_r u-");
    }
}

/// Seven balls, floor (body 0) and wall (body 8): the example of theory section 5.1. All contacts frictionless.
fn seven_balls<S: Space>() -> ContactProblem<S> {
    let mut random = Random::new(32);
    let masses: Vec<_> =
        (0..9).map(|k| if k == 0 || k == 8 { obstacle::<S>() } else { random.inverse_mass() }).collect();
    let velocities =
        (0..9).map(|k| if k == 0 || k == 8 { Twist::default() } else { random.twist(1.0) }).collect();
    let mut problem = ContactProblem::new(masses, velocities);
    for (a, b) in [(1, 0), (1, 2), (2, 0), (2, 3), (3, 8), (4, 0), (4, 5), (5, 6), (6, 0), (7, 0)] {
        let c = contact((a, random.column(0.5)), (b, random.column(0.5)), random.unit());
        problem.contacts.push(c);
    }
    problem
}

/// Item 32: the stored pattern of A is the contact graph's. Contacts 1 and 3 share only the floor, which no
/// impulse moves, so they do not couple.
fn the_pattern_of_a_shows_the_contact_graph_and_its_islands<S: Space>() {
    let page = [
        "##........",
        "####......",
        ".###......",
        ".####.....",
        "...##.....", // island {1, 2, 3}
        ".....##...",
        ".....###..",
        "......###.",
        ".......##.", // island {4, 5, 6}
        ".........#", // island {7}
    ];
    let problem = seven_balls::<S>();
    let width = 1 + S::SLIP;
    // every contact owns a block of `width` rows and columns
    let wanted: String = page
        .iter()
        .flat_map(|row| {
            let wide: String = row.chars().map(|mark| mark.to_string().repeat(width)).collect();
            (0..width).map(move |_| wide.clone() + "\n").collect::<Vec<_>>()
        })
        .collect();
    let a = delassus(&problem);
    assert_eq!(a.pattern(), wanted);
    // the pattern holds everything: an entry outside it is zero in the dense product
    let (j, inverse) = (jacobian(&problem).dense(), inverse_mass_matrix(&problem));
    for (i, line) in wanted.lines().enumerate() {
        let moved = inverse.times(&j[i]);
        for (k, mark) in line.chars().enumerate() {
            assert_eq!(mark == '#', dot(&j[k], &moved) != 0.0, "entry {i}, {k}");
        }
    }
    assert_eq!(a.values.len(), wanted.matches('#').count());
}

/// Item 32: an entry of A exists exactly where two contacts share a body that can move, on random graphs too.
fn random_contact_graphs_give_their_adjacency_as_pattern<S: Space>() {
    let mut random = Random::new(33);
    for _ in 0..30 {
        let problem = random_problem::<S>(&mut random, Recipe { bodies: 9, contacts: 12, rows: 0, ..RECIPE });
        let width = 1 + S::SLIP;
        let pattern: Vec<Vec<char>> =
            delassus(&problem).pattern().lines().map(|l| l.chars().collect()).collect();
        for (i, p) in problem.contacts.iter().enumerate() {
            for (k, q) in problem.contacts.iter().enumerate() {
                let shared = [p.a, p.b].iter().any(|x| *x != 0 && (*x == q.a || *x == q.b));
                assert_eq!(pattern[i * width][k * width] == '#', shared, "contacts {i} and {k}");
            }
        }
    }
}

/// The compressed rows know their own arithmetic: repeated columns add up, products equal those of the dense form.
#[test]
fn compressed_rows_multiply_like_the_dense_matrix_they_stand_for() {
    let m = Csr::from_rows(3, vec![vec![(2, 1.0), (0, 2.0), (2, 0.5)], vec![], vec![(1, -1.0)]].into_iter());
    assert_eq!(m.dense(), vec![vec![2.0, 0.0, 1.5], vec![0.0; 3], vec![0.0, -1.0, 0.0]]);
    assert_eq!((m.shape, m.pattern().as_str()), ((3, 3), "#.#\n...\n.#.\n"));
    assert_eq!(m.times(&[1.0, 2.0, 4.0]), vec![8.0, 0.0, -2.0]);
}

/// Items 38, 39: each contact's velocity change is its own impulse's plus the others', and with the "other" terms
/// the general formula gives back every impulse of a solution (theory eqs. 4.8 to 4.10).
fn every_impulse_of_a_solution_is_the_one_that_the_others_leave_to_it<S: Space>() {
    let mut random = Random::new(38);
    for _ in 0..20 {
        let mut problem = random_problem::<S>(
            &mut random,
            Recipe { bodies: 5, contacts: 7, rows: 0, friction: 0.0, ..RECIPE },
        );
        bounce(&mut problem, 0.5);
        problem.contacts.iter_mut().for_each(|c| c.target = c.target.max(0.0));
        let impulses = solved(&problem, SolverKind::Lemke, 1e-11);
        let after = problem.velocities_after(&impulses);
        for (i, c) in problem.contacts.iter().enumerate() {
            let mut alone = Impulses::zero(&problem);
            alone.contacts[i] = impulses.contacts[i];
            let mut others = impulses.clone();
            others.contacts[i] = Default::default();
            let (own, other) = (problem.velocities_after(&alone), problem.velocities_after(&others));
            for body in 0..after.len() {
                let sum = own[body].linear + other[body].linear - problem.velocities[body].linear;
                assert_column_close(sum, after[body].linear, 1e-12, "self + other");
                let sum = own[body].angular + other[body].angular - problem.velocities[body].angular;
                assert_column_close(sum, after[body].angular, 1e-12, "self + other, turning");
            }
            let before_own = c.relative_velocity(&other).0;
            let (m_a, m_b) = (&problem.inverse_masses[c.a], &problem.inverse_masses[c.b]);
            let mass = carom_solver::collision::effective_mass(c.normal, (m_a, c.arm_a), (m_b, c.arm_b));
            let wanted = (mass * (c.target - before_own)).max(0.0);
            assert_close(impulses.contacts[i].normal, wanted, 1e-10, "gamma_i");
        }
    }
}

/// Item 41: after a solution every J_i v >= target, here zero: nothing goes into anything.
fn no_contact_approaches_after_a_solution_with_zero_targets<S: Space>() {
    let mut random = Random::new(42);
    for _ in 0..20 {
        let mut problem = random_problem::<S>(
            &mut random,
            Recipe { bodies: 8, contacts: 16, rows: 0, friction: 0.0, ..RECIPE },
        );
        problem.contacts.iter_mut().for_each(|c| c.target = 0.0);
        let after = problem.velocities_after(&solved(&problem, SolverKind::Lemke, 1e-11));
        let u = jacobian(&problem).times(&stacked(&after));
        assert!(u.iter().step_by(1 + S::SLIP).all(|&u| u > -1e-11), "{u:?}");
    }
}

/// Item 43: the generalised force J^T lambda does no work along any displacement with J du = 0.
fn constraint_forces_do_no_virtual_work<S: Space>() {
    let mut random = Random::new(43);
    let problem = random_problem::<S>(&mut random, Recipe { bodies: 6, contacts: 3, rows: 2, ..RECIPE });
    let j = jacobian(&problem);
    let dense = j.dense();
    let columns = j.shape.1;
    for _ in 0..20 {
        // du = x - J^T (J J^T)^-1 J x: a random displacement without its part across the constraints
        let x: Vec<f64> = (0..columns).map(|_| random.between(-1.0, 1.0)).collect();
        let square = dense.iter().map(|p| dense.iter().map(|q| dot(p, q)).collect()).collect();
        let across = transposed_times(&j, &solve_dense(square, j.times(&x)).expect("independent rows"));
        let du: Vec<f64> = x.iter().zip(across).map(|(x, a)| x - a).collect();
        assert!(dot(&du, &du) > 0.1 && j.times(&du).iter().all(|u| u.abs() < 1e-12));
        let lambda: Vec<f64> = (0..j.shape.0).map(|_| random.between(-1.0, 1.0)).collect();
        assert_close(dot(&transposed_times(&j, &lambda), &du), 0.0, 1e-12, "virtual work");
    }
}

/// Item 43: lambda is the multiplier of least constraint. Among all velocities that meet J v >= target the
/// solution changes the motion least in the metric of the masses (theory eq. 5.13).
fn the_solution_changes_the_motion_least_among_admissible_velocities<S: Space>() {
    let mut random = Random::new(44);
    let problem =
        random_problem::<S>(&mut random, Recipe { bodies: 5, contacts: 6, rows: 0, friction: 0.0, ..RECIPE });
    let impulses = solved(&problem, SolverKind::Lemke, 1e-11);
    let after = problem.velocities_after(&impulses);
    let cost = |v: &[Twist<S>]| {
        let change: Vec<Twist<S>> = v
            .iter()
            .zip(&problem.velocities)
            .map(|(v, u)| Twist::new(v.linear - u.linear, v.angular - u.angular))
            .collect();
        kinetic_energy(&problem, &change)
    };
    let least = cost(&after);
    let mut admissible = 0;
    for _ in 0..20_000 {
        let size = random.between(0.0, 0.3);
        let mut v = after.clone();
        for v in v.iter_mut().skip(1) {
            v.add_scaled(&random.twist(1.0), size);
        }
        if problem.contacts.iter().all(|c| c.relative_velocity(&v).0 >= c.target) {
            admissible += 1;
            assert!(cost(&v) > least, "{} < {least}", cost(&v));
        }
    }
    assert!(admissible > 50, "only {admissible} of the trials say anything");
}

in_both_spaces! {
    the_jacobian_has_the_printed_rows_for_any_number_of_bodies_and_contacts;
    the_jacobian_times_the_velocities_is_the_relative_velocity_of_every_row;
    impulses_change_the_velocities_by_the_inverse_mass_times_the_transposed_jacobian;
    the_transposed_jacobian_times_the_impulses_is_the_change_of_momentum;
    a_and_b_are_those_of_the_dense_product;
    the_newton_system_has_minus_one_plus_restitution_times_the_velocity_on_its_right;
    the_pattern_of_a_shows_the_contact_graph_and_its_islands;
    random_contact_graphs_give_their_adjacency_as_pattern;
    every_impulse_of_a_solution_is_the_one_that_the_others_leave_to_it;
    no_contact_approaches_after_a_solution_with_zero_targets;
    constraint_forces_do_no_virtual_work;
    the_solution_changes_the_motion_least_among_admissible_velocities;
}
