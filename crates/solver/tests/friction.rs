//! Friction: the exact impulse of one contact, the direction of friction in systems, and what the box law does
//! instead (theory sections 3.5 and 5.6; items 35, 36).

use crate::common::*;
use carom_math::{Column, Planar, Space, Spatial, vec1, vec2, vec3};
use carom_solver::cone::project_tangent;
use carom_solver::friction::friction_impulse;
use carom_solver::prepared::{Prepared, PreparedContact};
use carom_solver::{Contact, ContactProblem, FrictionLaw, Impulses, SolverKind, Twist};

/// A prepared contact of random bodies whose tangential block of W is as given.
fn with_block([a, b, d]: [f64; 3]) -> PreparedContact<Spatial> {
    let recipe = Recipe { bodies: 3, contacts: 1, rows: 0, friction: 0.5, law: FrictionLaw::Disc };
    let mut c = Prepared::of(&random_problem::<Spatial>(&mut Random::new(1), recipe)).contacts[0];
    c.tangents[0].inverse_effective_mass = a;
    c.tangents[1].inverse_effective_mass = d;
    c.tangent_coupling = b;
    c
}

/// The example after theory eq. 5.24: K = diag(1, 4), w = (3, 3), limit 1/2. Friction is antiparallel to the slip
/// that remains; the box clamps each component on its own.
#[test]
fn the_example_with_an_elongated_block_has_the_numbers_of_the_page() {
    let c = with_block([1.0, 0.0, 4.0]);
    let s = friction_impulse(&c, vec2(3.0, 3.0), 0.5, FrictionLaw::Disc);
    assert_column_close(s, vec2(-0.4076, -0.2896), 5e-5, "friction");
    let slip = vec2(3.0 + s[0], 3.0 + 4.0 * s[1]);
    assert_column_close(slip, vec2(2.592, 1.842), 5e-4, "slip");
    assert_close(s[0] * slip[1] - s[1] * slip[0], 0.0, 1e-15, "antiparallel");
    let s = friction_impulse(&c, vec2(3.0, 3.0), 0.5, FrictionLaw::Box);
    assert_column_close(s, vec2(-0.5, -0.5), 0.0, "box");
}

/// The exact impulse against its optimality conditions and against a search over the disc or box, for blocks of all
/// conditions, limits of all sizes.
#[test]
fn the_friction_impulse_is_the_best_one_inside_the_limit() {
    let mut random = Random::new(2);
    for _ in 0..2000 {
        let (p, q) = (random.between(-8.0, 2.0).exp(), random.between(-2.0, 2.0).exp());
        let (cos, sin): (f64, f64) = {
            let u: carom_math::Vec2 = random.unit();
            (u[0], u[1])
        };
        let block = [p * cos * cos + q * sin * sin, (p - q) * cos * sin, p * sin * sin + q * cos * cos];
        let w: carom_math::Vec2 = random.column(3.0);
        let limit = random.between(-7.0, 3.0).exp();
        let c = with_block(block);
        let response =
            |s: carom_math::Vec2| vec2(block[0] * s[0] + block[1] * s[1], block[1] * s[0] + block[2] * s[1]);
        let cost = |s: carom_math::Vec2| 0.5 * s.dot(response(s)) + w.dot(s);
        let disc = friction_impulse(&c, w, limit, FrictionLaw::Disc);
        let slip = w + response(disc);
        if disc.norm() < limit * (1.0 - 1e-12) {
            assert!(slip.norm() < 1e-11 * w.norm().max(1.0), "it sticks, but slips with {slip:?}");
        } else {
            assert_close(disc.norm(), limit, 1e-15 + 1e-14 * limit, "on the rim");
            let along = -disc.dot(slip) / (disc.norm() * slip.norm());
            assert!(slip.norm() < 1e-12 || along > 1.0 - 1e-12, "slip {slip:?} against friction {disc:?}");
        }
        for law in [FrictionLaw::Disc, FrictionLaw::Box] {
            let best = cost(friction_impulse(&c, w, limit, law));
            for _ in 0..20 {
                let other = project_tangent::<Spatial>(random.column(2.0 * limit), limit, law);
                assert!(
                    cost(other) >= best - 1e-12 * (1.0 + best.abs()),
                    "{law:?}: {} < {best}",
                    cost(other)
                );
            }
        }
    }
}

/// In the plane the limit is an interval, and both laws are the same.
#[test]
fn in_the_plane_disc_and_box_are_one_law() {
    let mut random = Random::new(3);
    let recipe = Recipe { bodies: 6, contacts: 10, rows: 0, friction: 1.0, law: FrictionLaw::Disc };
    for _ in 0..20 {
        let mut problem = random_problem::<Planar>(&mut random, recipe);
        let (disc, _) = solve(&problem, SolverKind::Pgs, 100, 0.0);
        problem.friction_law = FrictionLaw::Box;
        let (boxed, _) = solve(&problem, SolverKind::Pgs, 100, 0.0);
        assert_eq!(disc, boxed);
    }
}

/// A brick four times as long as wide that slides on its four corners along a direction, after a step of gravity.
fn sliding_brick(angle: f64, law: FrictionLaw) -> ContactProblem<Spatial> {
    let (edges, friction) = ([4.0, 1.0, 0.3], 0.5);
    let velocity = vec3(3.0 * angle.cos(), 3.0 * angle.sin(), -0.04);
    let velocities = vec![Twist::new(velocity, vec3(0.0, 0.0, 0.4)), Twist::default()];
    let mut problem = ContactProblem::new(vec![brick::<Spatial>(2.0, edges), obstacle()], velocities);
    problem.friction_law = law;
    for (x, y) in [(2.0, 0.5), (2.0, -0.5), (-2.0, 0.5), (-2.0, -0.5)] {
        let c = contact((0, vec3(x, y, -0.15)), (1, vec3(x, y, 0.0)), vec3(0.0, 0.0, 1.0));
        problem.contacts.push(Contact { friction, ..c });
    }
    problem
}

/// Largest angle between friction and the direction against the slip after, over loaded contacts [degrees], and the
/// largest share of the limit that friction takes.
fn direction_error(problem: &ContactProblem<Spatial>, impulses: &Impulses<Spatial>) -> (f64, f64) {
    let after = problem.velocities_after(impulses);
    let (mut angle, mut share): (f64, f64) = (0.0, 0.0);
    for (c, g) in problem.contacts.iter().zip(&impulses.contacts) {
        if g.normal > 1e-9 {
            let slip = c.relative_velocity(&after).1;
            let (across, along) = (slip[0] * g.tangent[1] - slip[1] * g.tangent[0], -slip.dot(g.tangent));
            angle = angle.max(across.atan2(along).abs().to_degrees());
            share = share.max(g.tangent.norm() / (c.friction * g.normal));
        }
    }
    (angle, share)
}

/// Item 36 done right: friction of the disc is antiparallel to the slip at every corner, in every direction, also
/// where the block W_tt is far from round. The step W_tt^-1 with a radial clamp would end tens of degrees off.
#[test]
fn friction_on_an_elongated_brick_is_antiparallel_to_its_slip() {
    let mut temptation: f64 = 0.0;
    for step in 0..16 {
        let angle = std::f64::consts::TAU * (step as f64 + 0.3) / 16.0;
        let problem = sliding_brick(angle, FrictionLaw::Disc);
        for kind in [SolverKind::Pgs, SolverKind::PgsMatrix] {
            let (error, share) = direction_error(&problem, &solved(&problem, kind, 1e-9));
            assert!(error < 1e-5, "{}: {error} degrees at {angle}", kind.name());
            assert_close(share, 1.0, 1e-9, "sliding takes the whole limit");
        }
        for c in &Prepared::of(&problem).contacts {
            let [a, b, d] = [
                c.tangents[0].inverse_effective_mass,
                c.tangent_coupling,
                c.tangents[1].inverse_effective_mass,
            ];
            let u = c.slip(&problem.velocities);
            let (x, y) = (d * u[0] - b * u[1], a * u[1] - b * u[0]);
            temptation = temptation.max((u[0] * y - u[1] * x).atan2(u[0] * x + u[1] * y).abs().to_degrees());
        }
    }
    assert!(temptation > 20.0, "the block is too round to show anything: {temptation} degrees");
}

/// Item 36: the box law of the notes is too strong by up to sqrt(2) along the diagonal of its tangents and points up
/// to 45 degrees away from the slip; along an axis of its tangents it is right.
#[test]
fn the_box_law_shows_its_known_errors() {
    let turn = std::f64::consts::FRAC_PI_4;
    let mut worst: (f64, f64) = (0.0, 0.0);
    for (angle, wanted_share) in [(turn, 2f64.sqrt()), (0.2 * turn, 2f64.sqrt())] {
        let mut problem = sliding_brick(angle, FrictionLaw::Box);
        problem.velocities[0].angular = vec3(0.0, 0.0, 0.0);
        for kind in [SolverKind::Pgs, SolverKind::Lemke] {
            let (error, share) = direction_error(&problem, &solved(&problem, kind, 1e-9));
            assert_close(share, wanted_share, 1e-9, kind.name());
            worst = (worst.0.max(error), worst.1.max(share));
        }
    }
    assert!(worst.0 > 25.0, "{} degrees", worst.0);
    let mut problem = sliding_brick(0.0, FrictionLaw::Box);
    // one foot only: several could press against each other across
    problem.inverse_masses[0] = particle(2.0);
    problem.velocities[0].angular = vec3(0.0, 0.0, 0.0);
    problem.contacts.truncate(1);
    let (error, share) = direction_error(&problem, &solved(&problem, SolverKind::Pgs, 1e-12));
    assert!(error < 1e-9 && (share - 1.0).abs() < 1e-12, "{error} degrees, share {share}");
}

/// Items 33, 36: with little friction the planar solution is unique, and sweeps and pivoting find the same.
#[test]
fn sweeps_and_pivoting_find_the_same_planar_friction() {
    let mut random = Random::new(5);
    let recipe = Recipe { bodies: 9, contacts: 6, rows: 0, friction: 0.3, law: FrictionLaw::Disc };
    for _ in 0..30 {
        let problem = random_problem::<Planar>(&mut random, recipe);
        let sweeps = solved(&problem, SolverKind::Pgs, 1e-12).flat();
        let pivots = solved(&problem, SolverKind::Lemke, 1e-10).flat();
        for (x, y) in sweeps.iter().zip(&pivots) {
            assert_close(*x, *y, 1e-9 * (1.0 + x.abs()), "impulse");
        }
    }
}

/// A ball that slides on the floor with spin (theory eq. 3.18): sliding takes mu gamma_n, sticking what stops the
/// contact point; both by every solver that takes friction.
fn a_ball_on_the_floor_has_the_decoupled_closed_form<S: Space>() {
    let up = S::DIM - 1;
    let (mass, radius, fall) = (2.0, 0.5, 0.04);
    let tangent_mass = mass * if S::SPIN == 1 { 1.0 / 3.0 } else { 2.0 / 7.0 };
    for (speed, friction) in [(1.0, 0.3), (0.01, 0.3)] {
        let velocity = along::<S::Vector>(up, -fall) + along(0, speed);
        let velocities = vec![moving(velocity), Twist::default()];
        let mut problem = ContactProblem::<S>::new(vec![ball(mass, radius), obstacle()], velocities);
        let c = contact((0, along(up, -radius)), (1, S::Vector::ZERO), along(up, 1.0));
        problem.contacts.push(Contact { friction, ..c });
        let wanted = f64::min(friction * mass * fall, tangent_mass * speed);
        for kind in SolverKind::ALL {
            problem.friction_law =
                if kind == SolverKind::Lemke { FrictionLaw::Box } else { FrictionLaw::Disc };
            let slides = wanted < tangent_mass * speed;
            if kind == SolverKind::Direct && slides || kind == SolverKind::Enumeration && S::SLIP > 1 {
                continue; // refused: tested with those solvers
            }
            let impulses = solved_by_its_own_measure(&problem, kind);
            assert_close(impulses.contacts[0].normal, mass * fall, 1e-14, kind.name());
            let force = problem.contacts[0].to_world(&impulses.contacts[0]);
            assert_column_close(
                force,
                along::<S::Vector>(up, mass * fall) - along(0, wanted),
                1e-14,
                kind.name(),
            );
        }
    }
}

#[track_caller]
fn solved_by_its_own_measure<S: Space>(problem: &ContactProblem<S>, kind: SolverKind) -> Impulses<S> {
    let (impulses, outcome) = solve(problem, kind, 10_000, 1e-14);
    assert!(matches!(outcome.stop, carom_solver::Stop::Converged), "{}: {outcome:?}", kind.name());
    impulses
}

/// A sequential collision's friction is Coulomb's for its normal impulse, with the slip after it: an elongated body
/// comes to a stop at its contact point, which the scalar step alone would miss.
#[test]
fn a_sequential_collision_sticks_or_slides_by_coulombs_law() {
    let mut random = Random::new(7);
    for _ in 0..200 {
        let mut problem = ContactProblem::<Spatial>::new(
            vec![brick::<Spatial>(1.0, [3.0, 0.3, 0.2]), obstacle()],
            vec![random.twist(1.0), Twist::default()],
        );
        let mut c = contact((0, random.column(1.0)), (1, vec3(0.0, 0.0, 0.0)), random.unit());
        c.friction = random.between(0.0, 1.5);
        if c.relative_velocity(&problem.velocities).0 > 0.0 {
            c.normal = -c.normal;
        }
        problem.contacts.push(c);
        let (impulses, _) = solve(&problem, SolverKind::Sequential, 1, 0.0);
        let slip = problem.contacts[0].relative_velocity(&problem.velocities_after(&impulses)).1;
        let g = impulses.contacts[0];
        if g.tangent.norm() < c.friction * g.normal * (1.0 - 1e-9) {
            assert!(slip.norm() < 1e-12, "{slip:?}");
        } else {
            assert_close(g.tangent.norm(), c.friction * g.normal, 1e-13, "the whole limit");
            assert!(-g.tangent.dot(slip) > (1.0 - 1e-10) * g.tangent.norm() * slip.norm());
        }
    }
}

/// A contact whose slip no impulse changes (a body on an axle that friction cannot turn) still gets Coulomb's
/// friction: the whole limit against the slip, by the sweeps.
#[test]
fn a_slip_that_nothing_can_change_meets_the_whole_limit() {
    // a disc turning about a fixed axle, pushed by a particle that can only be met along the normal
    let axle = carom_solver::InverseMass { linear: 0.0, angular: carom_math::Moment(1.0) };
    let mut problem = ContactProblem::<Planar>::new(
        vec![axle, obstacle()],
        vec![Twist::new(vec2(0.0, 0.0), vec1(1.0)), Twist::new(vec2(-0.5, 0.0), vec1(0.0))],
    );
    // the arm is along the tangent: the normal turns the disc, the tangent does not
    let mut c = contact((0, vec2(0.0, 1.0)), (1, vec2(0.0, 0.0)), vec2(1.0, 0.0));
    c.friction = 0.5;
    problem.contacts.push(c);
    problem.velocities[1].linear = vec2(0.5, 2.0);
    problem.check().expect("the normal moves the disc");
    for kind in [SolverKind::Pgs, SolverKind::PgsMatrix] {
        let impulses = solved(&problem, kind, 1e-12);
        let g = impulses.contacts[0];
        let (normal, slip) = problem.contacts[0].relative_velocity(&problem.velocities_after(&impulses));
        assert_close(normal, 0.0, 1e-13, "held");
        assert!(g.normal > 0.1 && slip[0].abs() > 0.1);
        assert_close(g.tangent[0], -slip[0].signum() * 0.5 * g.normal, 1e-12, kind.name());
    }
}

in_both_spaces! {
    a_ball_on_the_floor_has_the_decoupled_closed_form;
}
