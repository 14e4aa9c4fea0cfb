//! The residual judges every solver alike: zero exactly at solutions, a velocity, blind to the unit of mass (theory
//! eqs. 5.31 to 5.34).

use crate::common::*;
use carom_math::{Column, Inertia, Space};
use carom_solver::cone::project_tangent;
use carom_solver::delassus::delassus;
use carom_solver::{ContactProblem, Entry, FrictionLaw, Impulses, Residual, SolverKind, Twist, residual};

const RECIPE: Recipe = Recipe { bodies: 7, contacts: 9, rows: 4, friction: 0.5, law: FrictionLaw::Disc };

/// The printed formulas, from dense matrices and without the rearrangements that the code makes.
fn by_the_book<S: Space>(problem: &ContactProblem<S>, impulses: &Impulses<S>) -> f64 {
    let a = delassus(problem).dense();
    let after = problem.velocities_after(impulses);
    let width = 1 + S::SLIP;
    let mut worst: f64 = 0.0;
    for (i, (c, g)) in problem.contacts.iter().zip(&impulses.contacts).enumerate() {
        let (normal, slip) = c.relative_velocity(&after);
        let m_n = 1.0 / a[i * width][i * width];
        let rho_n = (g.normal - f64::max(0.0, g.normal - m_n * (normal - c.target))).abs() / m_n;
        let (p, q) = (i * width + 1, i * width + S::SLIP);
        let (mean, half) = (0.5 * (a[p][p] + a[q][q]), 0.5 * (a[p][p] - a[q][q]));
        let coupling = if S::SLIP > 1 { a[p][q] } else { 0.0 };
        let m_t = 1.0 / (mean + (half * half + coupling * coupling).sqrt());
        let limit = c.friction * g.normal.max(0.0);
        let rho_t = (g.tangent - project_tangent::<S>(g.tangent - slip * m_t, limit, problem.friction_law))
            .norm()
            / m_t;
        worst = worst.max((rho_n * rho_n + rho_t * rho_t).sqrt());
    }
    for (k, (r, l)) in problem.rows.iter().zip(&impulses.rows).enumerate() {
        let m = 1.0 / a[problem.contacts.len() * width + k][problem.contacts.len() * width + k];
        let w = r.on_a.dot(&after[r.a]) + r.on_b.dot(&after[r.b]) - r.target;
        worst = worst.max((l - (l - m * w).clamp(r.lo, r.hi)).abs() / m);
    }
    worst
}

fn random_impulses<S: Space>(random: &mut Random, problem: &ContactProblem<S>) -> Impulses<S> {
    let flat: Vec<f64> = (0..problem.scalar_rows()).map(|_| random.between(-0.3, 0.5)).collect();
    Impulses::from_flat(problem, &flat).expect("fits")
}

/// The rearranged code computes the printed natural map, inside and outside of the cones, for both laws.
fn the_residual_is_the_natural_map_as_printed<S: Space>() {
    let mut random = Random::new(1);
    for law in [FrictionLaw::Disc, FrictionLaw::Box] {
        for _ in 0..200 {
            let problem = random_problem::<S>(&mut random, Recipe { law, ..RECIPE });
            let impulses = random_impulses(&mut random, &problem);
            let wanted = by_the_book(&problem, &impulses);
            assert_close(residual(&problem, &impulses).absolute, wanted, 1e-12 * (1.0 + wanted), "residual");
        }
    }
}

/// At exact solutions it is zero to the last digit; a change of any single impulse shows, at that entry or one that
/// shares a body with it.
fn the_residual_is_zero_at_a_solution_and_positive_beside_it<S: Space>() {
    // a particle on a floor, exactly held; a row exactly met; a contact exactly open
    let up = S::DIM - 1;
    let mut problem = ContactProblem::<S>::new(
        vec![particle(2.0), obstacle(), particle(4.0)],
        vec![moving(along(up, -0.5)), Twist::default(), moving(along(up, 0.5))],
    );
    for body in [0, 2] {
        let mut c = contact((body, S::Vector::ZERO), (1, S::Vector::ZERO), along(up, 1.0));
        c.friction = 0.5;
        problem.contacts.push(c);
    }
    problem.rows.push(carom_solver::BoundedRow {
        id: 0,
        a: 2,
        b: 1,
        on_a: moving(along(0, 1.0)),
        on_b: Twist::default(),
        target: 0.25,
        lo: -3.0,
        hi: 3.0,
    });
    let mut exact = Impulses::zero(&problem);
    (exact.contacts[0].normal, exact.rows[0]) = (1.0, 1.0);
    assert_eq!(residual(&problem, &exact), Residual { absolute: 0.0, relative: 0.0, worst: None });
    let flat = exact.flat();
    for k in 0..flat.len() {
        for change in [-0.1, -1e-9, 1e-9, 0.1] {
            let mut other = flat.clone();
            other[k] += change;
            let got = residual(&problem, &Impulses::from_flat(&problem, &other).expect("fits"));
            assert!(got.absolute > 0.2 * change.abs(), "unknown {k} changed by {change}: {got:?}");
            assert!(got.worst.is_some() && got.relative > 0.0);
        }
    }
}

/// The same beside the solutions that solvers find for random problems.
fn the_residual_grows_beside_every_solution_found<S: Space>() {
    let mut random = Random::new(2);
    for _ in 0..20 {
        let problem = random_problem::<S>(&mut random, Recipe { bodies: 14, contacts: 8, ..RECIPE });
        let exact = solved(&problem, SolverKind::Pgs, 1e-12);
        assert!(residual(&problem, &exact).absolute <= 1e-12);
        let flat = exact.flat();
        for k in 0..flat.len() {
            let mut other = flat.clone();
            other[k] += if random.chance(0.5) { 1e-3 } else { -1e-3 };
            let got = residual(&problem, &Impulses::from_flat(&problem, &other).expect("fits")).absolute;
            assert!(got > 1e-5, "unknown {k}: {got:e}");
        }
    }
}

/// Its parts read as plain faults: no impulse gives the speed of penetration, a pulling impulse its pull, friction
/// outside the disc its excess, a slip without friction the slip that its limit should have met.
fn the_parts_of_the_residual_read_as_plain_faults<S: Space>() {
    let up = S::DIM - 1;
    let velocity = along::<S::Vector>(up, -0.5) + along(0, 0.25);
    let velocities = vec![moving(velocity), Twist::default()];
    let mut problem = ContactProblem::<S>::new(vec![particle(2.0), obstacle()], velocities);
    let mut c = contact((0, S::Vector::ZERO), (1, S::Vector::ZERO), along(up, 1.0));
    c.friction = 0.125;
    problem.contacts.push(c);
    let judge = |normal: f64, push: S::Vector| {
        let mut impulses = Impulses::zero(&problem);
        impulses.contacts[0].normal = normal;
        impulses.contacts[0].tangent = problem.contacts[0].to_slip(push);
        residual(&problem, &impulses).absolute
    };
    assert_eq!(judge(0.0, S::Vector::ZERO), 0.5, "speed of penetration");
    assert_eq!(judge(1.0, along(0, -0.125)), 0.0, "held, sliding with the whole friction");
    assert_eq!(judge(1.0, S::Vector::ZERO), 0.0625, "friction missing, as a velocity");
    assert_eq!(judge(1.0, along(0, -0.25)), 0.0625, "friction outside its limit, as a velocity");
    assert_eq!(judge(2.0, along(0, -0.25)), 0.5, "thrown off with 0.5 m/s");
}

/// Masses times k and impulses times k: the same velocities, so the same residual; for powers of two bit for bit.
fn the_residual_does_not_depend_on_the_unit_of_mass<S: Space>() {
    let mut random = Random::new(3);
    for factor in [0.125, 1024.0, 7.3, 1e-9] {
        for _ in 0..20 {
            let problem = random_problem::<S>(&mut random, RECIPE);
            let impulses = random_impulses(&mut random, &problem);
            let mut scaled = problem.clone();
            for m in &mut scaled.inverse_masses {
                (m.linear, m.angular) = (m.linear / factor, m.angular.scaled(1.0 / factor));
            }
            for r in &mut scaled.rows {
                (r.lo, r.hi) = (r.lo * factor, r.hi * factor);
            }
            let flat: Vec<f64> = impulses.flat().iter().map(|g| g * factor).collect();
            let before = residual(&problem, &impulses);
            let after = residual(&scaled, &Impulses::from_flat(&scaled, &flat).expect("fits"));
            if factor == 0.125 || factor == 1024.0 {
                assert_eq!(before, after);
            } else {
                assert_close(after.absolute, before.absolute, 1e-12 * before.absolute, "absolute");
                assert_close(after.relative, before.relative, 1e-11 * before.relative, "relative");
            }
        }
    }
}

/// Velocities, targets and impulses times k: a residual k times as large, and the same relative one.
fn the_residual_is_a_velocity_and_its_relative_form_has_no_unit<S: Space>() {
    let mut random = Random::new(4);
    for _ in 0..20 {
        let problem = random_problem::<S>(&mut random, RECIPE);
        let impulses = random_impulses(&mut random, &problem);
        let mut scaled = problem.clone();
        for v in &mut scaled.velocities {
            (v.linear, v.angular) = (v.linear * 16.0, v.angular * 16.0);
        }
        scaled.contacts.iter_mut().for_each(|c| c.target *= 16.0);
        for r in &mut scaled.rows {
            (r.target, r.lo, r.hi) = (16.0 * r.target, 16.0 * r.lo, 16.0 * r.hi);
        }
        let flat: Vec<f64> = impulses.flat().iter().map(|g| g * 16.0).collect();
        let before = residual(&problem, &impulses);
        let after = residual(&scaled, &Impulses::from_flat(&scaled, &flat).expect("fits"));
        assert_eq!((after.absolute, after.relative), (16.0 * before.absolute, before.relative));
    }
}

/// The relative residual of doing nothing is 1 where there is something to do, and 0 where there is not.
fn doing_nothing_has_relative_residual_one<S: Space>() {
    let mut random = Random::new(5);
    for _ in 0..50 {
        let mut problem = random_problem::<S>(&mut random, RECIPE);
        problem.rows.iter_mut().for_each(|r| (r.lo, r.hi) = (r.lo.min(0.0), r.hi.max(0.0)));
        let nothing = residual(&problem, &Impulses::zero(&problem));
        let wanted = if nothing.absolute > 0.0 { 1.0 } else { 0.0 };
        assert_close(nothing.relative, wanted, 1e-15, "doing nothing");
    }
    let resting = column::<S>(&[1.0, 1.0], 0.5);
    assert_eq!(residual(&resting, &Impulses::zero(&resting)).relative, 1.0);
    let mut floating = resting;
    floating.velocities.fill(Twist::default());
    assert_eq!(residual(&floating, &Impulses::zero(&floating)), Residual::default());
}

/// The worst entry is named: spoil one contact or row of a solved problem of separate pairs.
fn the_worst_entry_is_the_one_that_was_spoiled<S: Space>() {
    let mut problem = ContactProblem::<S>::new(vec![obstacle()], vec![Twist::default()]);
    for i in 0..6 {
        problem.inverse_masses.push(ball(1.0, 0.5));
        problem.velocities.push(moving(along(0, -1.0)));
        if i % 2 == 0 {
            problem.contacts.push(contact((i + 1, along(0, -0.5)), (0, S::Vector::ZERO), along(0, 1.0)));
        } else {
            let (on_a, on_b) = (moving(along(0, 1.0)), Twist::default());
            let (lo, hi) = (f64::NEG_INFINITY, f64::INFINITY);
            problem.rows.push(carom_solver::BoundedRow {
                id: 0,
                a: i + 1,
                b: 0,
                on_a,
                on_b,
                target: 0.0,
                lo,
                hi,
            });
        }
    }
    let exact = solved(&problem, SolverKind::Pgs, 1e-14);
    for k in 0..3 {
        let mut spoiled = exact.clone();
        spoiled.contacts[k].normal += 0.1;
        assert_eq!(residual(&problem, &spoiled).worst, Some(Entry::Contact(k)));
        let mut spoiled = exact.clone();
        spoiled.rows[k] -= 0.1;
        assert_eq!(residual(&problem, &spoiled).worst, Some(Entry::Row(k)));
    }
}

/// Impulses or velocities that are no numbers are infinitely wrong, never overlooked.
fn what_is_not_a_number_is_infinitely_wrong<S: Space>() {
    let problem = random_problem::<S>(&mut Random::new(6), RECIPE);
    let flat = solved(&problem, SolverKind::Pgs, 1e-9).flat();
    for k in 0..flat.len() {
        for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            let mut spoiled = flat.clone();
            spoiled[k] = bad;
            let got = residual(&problem, &Impulses::from_flat(&problem, &spoiled).expect("fits"));
            assert_eq!(got.absolute, f64::INFINITY, "unknown {k}: {bad}");
            assert!(got.relative > 0.0 && got.worst.is_some());
        }
    }
    let mut lost = problem.clone();
    lost.velocities[1].linear = S::Vector::from_fn(|_| f64::NAN);
    assert_eq!(residual(&lost, &Impulses::zero(&lost)).absolute, f64::INFINITY);
}

in_both_spaces! {
    the_residual_is_the_natural_map_as_printed;
    the_residual_is_zero_at_a_solution_and_positive_beside_it;
    the_residual_grows_beside_every_solution_found;
    the_parts_of_the_residual_read_as_plain_faults;
    the_residual_does_not_depend_on_the_unit_of_mass;
    the_residual_is_a_velocity_and_its_relative_form_has_no_unit;
    doing_nothing_has_relative_residual_one;
    the_worst_entry_is_the_one_that_was_spoiled;
    what_is_not_a_number_is_infinitely_wrong;
}
