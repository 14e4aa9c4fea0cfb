//! What must not matter: the order of contacts and bodies, the handedness and orientation of the axes, the units of
//! mass, length and time. Every method that is accurate to rounding, on structures and random problems whose wrenches
//! are unique (a pile of balls has a continuum of answers: discs that stick in a ring may turn together or not).

use crate::common::*;
use crate::contact::scenes::*;
use crate::contact::solvers::{exact_methods, solve_best};
use carom_math::{Column, Inertia, Rotation, Space};
use carom_solver::{Contact, ContactProblem, FrictionLaw, Twist};

/// Problems of all kinds, hyperstatic ones, sliding ones and mass ratios included.
fn problems<S: Space>() -> Vec<(String, ContactProblem<S>)> {
    let mut random = Random::new(12);
    let mut legs: Vec<(f64, f64)> = vec![(1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)];
    legs.extend([(0.5, 0.1), (-0.3, 0.8)]);
    let mut sliding = table::<S>(&legs, (0.2, 0.1), 0.3);
    sliding.velocities[1] = Twist::new(at::<S>(2.0, 1.0, -FALL), random.column(0.4));
    let mut all = vec![
        ("a stack".to_owned(), stack::<S>(&[1.0, 3.0, 0.2, 100.0], 0.5)),
        ("a wall".to_owned(), wall::<S>(3, 3, 0.6)),
        ("an arch".to_owned(), arch::<S>(5, 0.8)),
        ("a table".to_owned(), table::<S>(&legs, (0.2, 0.1), 0.4)),
        ("a table that slides".to_owned(), sliding),
        ("an overhang".to_owned(), overhang::<S>(4, 0.9, 0.5)),
    ];
    for k in 0..6 {
        let recipe = Recipe { bodies: 5, contacts: 7, rows: 0, friction: 0.3, law: FrictionLaw::Disc };
        all.push((format!("random {k}"), random_problem::<S>(&mut random, recipe)));
    }
    all
}

/// Fails unless a changed problem has the changed wrenches: `back` takes the changed wrenches to what the first
/// problem's are.
#[track_caller]
fn assert_same<S: Space>(
    what: &str,
    problem: &ContactProblem<S>,
    changed: &ContactProblem<S>,
    back: impl Fn(&[Twist<S>]) -> Vec<Twist<S>>,
) {
    changed.check().unwrap_or_else(|e| panic!("{what}: {e}"));
    for method in exact_methods() {
        let solve = |p: &ContactProblem<S>| {
            let impulses =
                solve_best(method, p).unwrap_or_else(|why| panic!("{} on {what}: {why}", method.name()));
            wrenches(p, &impulses)
        };
        let off = apart(&solve(problem), &back(&solve(changed)));
        assert!(off <= 1e-10, "{}: {what}, off by {off:e}", method.name());
    }
}

/// A random order of 0, 1, ..., n - 1.
pub fn shuffled(random: &mut Random, n: usize) -> Vec<usize> {
    let mut order: Vec<usize> = (0..n).collect();
    (1..n).rev().for_each(|i| order.swap(i, random.below(i + 1)));
    order
}

/// Contacts in another order.
fn the_order_of_contacts_changes_no_wrench<S: Space>() {
    let mut random = Random::new(31);
    for (what, problem) in problems::<S>() {
        for _ in 0..3 {
            let order = shuffled(&mut random, problem.contacts.len());
            let contacts = order.iter().map(|&k| problem.contacts[k]).collect();
            let changed = ContactProblem { contacts, ..problem.clone() };
            assert_same(&format!("{what}, contacts {order:?}"), &problem, &changed, |w| w.to_vec());
        }
    }
}

/// Bodies in another order, and in each contact the other body first.
fn the_order_of_bodies_changes_no_wrench<S: Space>() {
    let mut random = Random::new(32);
    for (what, problem) in problems::<S>() {
        let order = shuffled(&mut random, problem.velocities.len());
        let mut changed = problem.clone();
        for (old, &new) in order.iter().enumerate() {
            changed.inverse_masses[new] = problem.inverse_masses[old];
            changed.velocities[new] = problem.velocities[old];
        }
        for c in &mut changed.contacts {
            (c.a, c.b) = (order[c.a], order[c.b]);
            if random.chance(0.5) {
                *c = Contact { a: c.b, b: c.a, arm_a: c.arm_b, arm_b: c.arm_a, normal: -c.normal, ..*c };
            }
        }
        let back = |w: &[Twist<S>]| order.iter().map(|&new| w[new]).collect();
        assert_same(&format!("{what}, bodies {order:?}"), &problem, &changed, back);
    }
}

/// A problem seen in turned axes.
fn a_turned_problem_has_the_turned_answer<S: Space>() {
    let mut random = Random::new(33);
    for (what, problem) in problems::<S>() {
        let rotation = S::Rotation::about(random.column(2.0));
        let mut changed = problem.clone();
        for m in &mut changed.inverse_masses {
            m.angular = S::turned(&m.angular, &rotation);
        }
        for v in &mut changed.velocities {
            *v = Twist::new(rotation.rotate(v.linear), rotation.rotate_spin(v.angular));
        }
        for c in &mut changed.contacts {
            (c.arm_a, c.arm_b) = (rotation.rotate(c.arm_a), rotation.rotate(c.arm_b));
            c.normal = rotation.rotate(c.normal);
        }
        let back = |w: &[Twist<S>]| {
            let turn_back =
                |t: &Twist<S>| Twist::new(rotation.unrotate(t.linear), rotation.unrotate_spin(t.angular));
            w.iter().map(turn_back).collect()
        };
        assert_same(&format!("{what}, turned"), &problem, &changed, back);
    }
}

/// A problem seen in a mirror at the plane x = 0.
fn a_mirrored_problem_has_the_mirrored_answer<S: Space>() {
    let flip = |v: S::Vector| S::Vector::from_fn(|i| if i == 0 { -v[0] } else { v[i] });
    let flip_spin = |w: S::Spin| S::Spin::from_fn(|i| if S::SPIN > 1 && i == 0 { w[0] } else { -w[i] });
    for (what, problem) in problems::<S>() {
        let mut changed = problem.clone();
        for m in &mut changed.inverse_masses {
            let mut entries = m.angular.entries();
            // the products of inertia with x change sign: entries are xx, yy, zz, xy, xz, yz
            if entries.len() == 6 {
                (entries[3], entries[4]) = (-entries[3], -entries[4]);
            }
            m.angular = S::Inertia::from_entries(&entries).expect("as many entries");
        }
        for v in &mut changed.velocities {
            *v = Twist::new(flip(v.linear), flip_spin(v.angular));
        }
        for c in &mut changed.contacts {
            (c.arm_a, c.arm_b, c.normal) = (flip(c.arm_a), flip(c.arm_b), flip(c.normal));
        }
        let back =
            |w: &[Twist<S>]| w.iter().map(|t| Twist::new(flip(t.linear), flip_spin(t.angular))).collect();
        assert_same(&format!("{what}, mirrored"), &problem, &changed, back);
    }
}

/// Other units of mass, length and time.
fn units_change_nothing<S: Space>() {
    for (mass, length, time) in [(1e3, 1.0, 1.0), (1e-3, 1e-3, 1.0), (7.0, 0.3, 60.0), (1e6, 1e3, 1e-3)] {
        for (what, problem) in problems::<S>() {
            let mut changed = problem.clone();
            for m in &mut changed.inverse_masses {
                m.linear /= mass;
                m.angular = m.angular.scaled(1.0 / (mass * length * length));
            }
            for v in &mut changed.velocities {
                *v = Twist::new(v.linear * (length / time), v.angular * (1.0 / time));
            }
            for c in &mut changed.contacts {
                (c.arm_a, c.arm_b) = (c.arm_a * length, c.arm_b * length);
                c.target *= length / time;
            }
            let impulse = mass * length / time;
            let back = |w: &[Twist<S>]| {
                let scale = |t: &Twist<S>| {
                    Twist::new(t.linear * (1.0 / impulse), t.angular * (1.0 / (impulse * length)))
                };
                w.iter().map(scale).collect()
            };
            let units = format!("{what} in units of {mass} kg, {length} m, {time} s");
            assert_same(&units, &problem, &changed, back);
        }
    }
}

in_both_spaces! {
    the_order_of_contacts_changes_no_wrench;
    the_order_of_bodies_changes_no_wrench;
    a_turned_problem_has_the_turned_answer;
    a_mirrored_problem_has_the_mirrored_answer;
    units_change_nothing;
}
