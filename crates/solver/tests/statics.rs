//! Statics with known forces: columns, a table on four legs, a ball in a groove, and what the direct solver refuses
//! (items 22, 31; cases C24, C25, C26).

use crate::common::*;
use carom_math::{Column, Planar, Space, Spatial, vec1, vec2, vec3};
use carom_solver::{Contact, ContactProblem, FrictionLaw, Impulses, SolverKind, Stop, Twist};

/// The speed that a step of gravity gives in `crate::common::column` [m/s].
const FALL: f64 = 0.04;

/// Fails unless contact k carries the weight of everything from body k on.
fn assert_carries_the_weight_above<S: Space>(
    problem: &ContactProblem<S>,
    masses: &[f64],
    kind: SolverKind,
    share: f64,
) {
    let impulses = solved(problem, kind, 1e-9);
    for (k, g) in impulses.contacts.iter().enumerate() {
        let above: f64 = masses[k..].iter().sum();
        assert_close(
            g.normal,
            FALL * above,
            share * FALL * above,
            &format!("{}, interface {k}", kind.name()),
        );
        assert!(g.tangent.norm() <= share * FALL * above, "no friction is needed");
    }
}

/// C24: in a column of n balls interface k carries (n - k) m g to 1e-10, with and without friction.
fn every_interface_of_a_column_carries_what_stands_on_it<S: Space>() {
    for n in [1, 2, 10, 30] {
        let masses = vec![0.7; n];
        for friction in [0.0, 0.5] {
            let mut problem = column::<S>(&masses, friction);
            problem.friction_law = FrictionLaw::Box;
            for kind in [SolverKind::Direct, SolverKind::Lemke] {
                assert_carries_the_weight_above(&problem, &masses, kind, 1e-10);
            }
        }
    }
}

/// C24 with sweeps: what the residual promises holds (here 1e-10 m/s per interface).
fn sweeps_carry_a_short_column_to_their_tolerance<S: Space>() {
    let masses = [0.7; 5];
    let problem = column::<S>(&masses, 0.5);
    for kind in [SolverKind::Pgs, SolverKind::PgsMatrix] {
        let impulses = solved(&problem, kind, 1e-12);
        for (k, g) in impulses.contacts.iter().enumerate() {
            let above: f64 = masses[k..].iter().sum();
            assert_close(g.normal, FALL * above, 1e-9, kind.name());
        }
    }
}

/// C24 with mass ratios up to 1 : 1e6, the heavy ball on top, at the bottom, and everywhere between light ones.
fn columns_with_mass_ratios_carry_their_weight<S: Space>() {
    for ratio in [1e-6, 1e-3, 1e3, 1e6] {
        let shapes: [Vec<f64>; 3] = [
            (0..10).map(|k| if k == 9 { ratio } else { 1.0 }).collect(),
            (0..10).map(|k| if k == 0 { ratio } else { 1.0 }).collect(),
            (0..10).map(|k| if k % 2 == 0 { ratio } else { 1.0 }).collect(),
        ];
        for masses in shapes {
            let problem = column::<S>(&masses, 0.0);
            for kind in [SolverKind::Direct, SolverKind::Lemke] {
                assert_carries_the_weight_above(&problem, &masses, kind, 1e-10);
            }
        }
    }
}

/// C24 in space with friction: a column of 100 balls sticks, by factorisation, with a disc.
#[test]
fn a_column_of_a_hundred_balls_with_friction_stands_in_space() {
    let masses = vec![1.0; 100];
    let problem = column::<Spatial>(&masses, 0.5);
    assert_carries_the_weight_above(&problem, &masses, SolverKind::Direct, 1e-10);
}

/// C25: a table on legs at (+-1, +-1) with its weight acting at (0.3, 0.1), in a given order of the legs.
fn table(order: [usize; 4]) -> ContactProblem<Spatial> {
    let velocities = vec![moving(vec3(0.0, 0.0, -FALL)), Twist::default()];
    let mut problem =
        ContactProblem::new(vec![brick::<Spatial>(1.0, [2.0, 2.0, 0.2]), obstacle()], velocities);
    let legs = [(1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)];
    for leg in order {
        let (x, y) = legs[leg];
        // the centre of mass is above (0.3, 0.1)
        let arm = vec3(x - 0.3, y - 0.1, -0.5);
        let c = contact((0, arm), (1, vec3(x, y, 0.0)), vec3(0.0, 0.0, 1.0));
        problem.contacts.push(Contact { id: leg as u64, friction: 0.4, ..c });
    }
    problem
}

/// C25: the forces of the four legs are not unique, their wrench is: the weight through (0.3, 0.1), to 1e-12,
/// whatever the order of the legs, by pgs and pgs_matrix with friction and by all but direct without; direct refuses
/// the singular system.
#[test]
fn a_table_on_four_legs_is_carried_by_one_wrench_in_every_order() {
    let orders = [[0, 1, 2, 3], [3, 2, 1, 0], [2, 0, 3, 1], [1, 3, 0, 2]];
    for (kind, friction) in [
        (SolverKind::Pgs, 0.4),
        (SolverKind::PgsMatrix, 0.4),
        (SolverKind::Pgs, 0.0),
        (SolverKind::PgsMatrix, 0.0),
        (SolverKind::Lemke, 0.0),
    ] {
        for order in orders {
            let mut problem = table(order);
            problem.contacts.iter_mut().for_each(|c| c.friction = friction);
            let impulses = solved(&problem, kind, 1e-14);
            let (mut force, mut moment) = (vec3(0.0, 0.0, 0.0), vec3(0.0, 0.0, 0.0));
            for (c, g) in problem.contacts.iter().zip(&impulses.contacts) {
                let push = c.to_world(g);
                force += push;
                moment += c.arm_b.cross(push); // about the table's foot, where legs and load have their coordinates
            }
            assert_column_close(force, vec3(0.0, 0.0, FALL), 1e-12, kind.name());
            assert_column_close(moment, vec3(0.1 * FALL, -0.3 * FALL, 0.0), 1e-12, kind.name());
        }
    }
}

/// Item 31: a singular A is refused in words that name the contacts which can press against each other.
#[test]
fn the_direct_solver_refuses_the_table_and_names_its_legs() {
    for friction in [0.0, 0.4] {
        let mut problem = table([0, 1, 2, 3]);
        problem.contacts.iter_mut().for_each(|c| c.friction = friction);
        let (impulses, outcome) = solve(&problem, SolverKind::Direct, 1, 1e-9);
        assert_eq!(impulses, Impulses::zero(&problem));
        let Stop::Refused(why) = outcome.stop else { panic!("not refused") };
        for word in ["singular", "contact 0", "contact 1", "contact 2", "contact 3", "no unique answer"] {
            assert!(why.contains(word), "{word:?} is not in {why:?}");
        }
    }
}

/// Item 31: redundant rows are told from regular ones over many random problems: a repeated contact is always
/// refused as singular, and its problem without the copy never.
fn a_repeated_contact_is_always_found_singular<S: Space>() {
    let mut random = Random::new(31);
    for _ in 0..300 {
        let recipe = Recipe { bodies: 12, contacts: 8, rows: 0, friction: 0.0, law: FrictionLaw::Disc };
        let mut problem = random_problem::<S>(&mut random, recipe);
        let (_, outcome) = solve(&problem, SolverKind::Direct, 1, 1e-9);
        assert!(!matches!(&outcome.stop, Stop::Refused(why) if why.contains("singular")), "{outcome:?}");
        let copy = random.below(8);
        problem.contacts.push(problem.contacts[copy]);
        let (_, outcome) = solve(&problem, SolverKind::Direct, 1, 1e-9);
        let Stop::Refused(why) = outcome.stop else { panic!("a repeated contact went unnoticed") };
        assert!(
            why.contains("singular") && why.contains(&format!("contact {copy}")) && why.contains("contact 8"),
            "{why}"
        );
    }
}

/// Items 31, 44: a regular system whose solution would have to pull is refused; the impulses stay as given.
fn the_direct_solver_refuses_a_contact_that_would_pull<S: Space>() {
    let velocities = vec![moving(along(0, 1.0)), Twist::default()];
    let mut problem = ContactProblem::<S>::new(vec![ball(1.0, 0.5), obstacle()], velocities);
    problem.contacts.push(contact((0, along(0, -0.5)), (1, S::Vector::ZERO), along(0, 1.0)));
    let (impulses, outcome) = solve(&problem, SolverKind::Direct, 1, 1e-9);
    assert_eq!(impulses, Impulses::zero(&problem));
    assert!(
        matches!(&outcome.stop, Stop::Refused(why) if why.contains("contact 0 would pull")),
        "{outcome:?}"
    );
}

/// Item 36: a contact that slides is not the linear system's business; refused, with need and limit.
fn the_direct_solver_refuses_a_contact_that_slides<S: Space>() {
    let up = S::DIM - 1;
    for (slip, slides) in [(0.005, false), (0.5, true)] {
        let velocity = along::<S::Vector>(up, -FALL) + along(0, slip);
        let mut problem = ContactProblem::<S>::new(
            vec![particle(1.0), obstacle()],
            vec![moving(velocity), Twist::default()],
        );
        let mut c = contact((0, S::Vector::ZERO), (1, S::Vector::ZERO), along(up, 1.0));
        c.friction = 0.5;
        problem.contacts.push(c);
        let (impulses, outcome) = solve(&problem, SolverKind::Direct, 1, 1e-12);
        if slides {
            assert!(matches!(&outcome.stop, Stop::Refused(why) if why.contains("it slides")), "{outcome:?}");
        } else {
            assert_eq!(outcome.stop, Stop::Converged);
            assert_close(impulses.contacts[0].tangent.norm(), slip, 1e-16, "friction that stops the slip");
        }
    }
}

/// A contact that touches without load (both its impulse and its velocity are zero) is no reason to refuse.
fn the_direct_solver_accepts_contacts_that_touch_without_load<S: Space>() {
    let mut random = Random::new(55);
    for _ in 0..50 {
        let mut problem = cradle::<S>(&[0.0; 6]);
        // an impulse of the whole row against a wall, seen from a turned frame: rounding, but no load elsewhere
        let direction: S::Vector = random.unit();
        problem.velocities.iter_mut().for_each(|v| v.linear = direction * 0.3);
        problem.contacts.iter_mut().for_each(|c| {
            (c.normal, c.arm_a, c.arm_b) = (direction, direction * -0.5, direction * 0.5);
        });
        let (impulses, outcome) = solve(&problem, SolverKind::Direct, 1, 1e-12);
        assert_eq!(outcome.stop, Stop::Converged);
        assert!(impulses.contacts.iter().all(|g| g.normal < 1e-15));
    }
}

/// C26: a ball in a groove of 90 degrees: each side carries m g / sqrt(2). Every solver.
fn a_ball_in_a_groove_presses_both_sides_alike<S: Space>() {
    let up = S::DIM - 1;
    let half = 0.5f64.sqrt();
    let mut problem = ContactProblem::<S>::new(
        vec![ball(2.0, 0.5), obstacle()],
        vec![moving(along(up, -FALL)), Twist::default()],
    );
    for side in [half, -half] {
        let normal = along::<S::Vector>(0, side) + along(up, half);
        problem.contacts.push(contact((0, normal * -0.5), (1, S::Vector::ZERO), normal));
    }
    for kind in SolverKind::ALL {
        let impulses = solved(&problem, kind, 1e-13);
        for g in &impulses.contacts {
            assert_close(g.normal, 2.0 * FALL * half, 1e-13, kind.name());
        }
    }
}

/// C19, as impulses: a box of width w and height 2 h_c that brakes with mu presses its edges with m g (1/2 +- mu
/// h_c / w); it is sliding, so factorisation refuses and the others agree.
#[test]
fn a_braking_box_presses_its_front_edge_more() {
    let (width, height, friction) = (1.0, 0.6, 0.4);
    let box_ = brick::<Planar>(2.0, [width, height, 1.0]);
    let velocities = vec![Twist::new(vec2(5.0, -FALL), vec1(0.0)), Twist::default()];
    let mut problem = ContactProblem::<Planar>::new(vec![box_, obstacle()], velocities);
    for x in [-0.5 * width, 0.5 * width] {
        let c = contact((0, vec2(x, -0.5 * height)), (1, vec2(x, 0.0)), vec2(0.0, 1.0));
        problem.contacts.push(Contact { friction, ..c });
    }
    for kind in [SolverKind::Pgs, SolverKind::PgsMatrix, SolverKind::Lemke] {
        let impulses = solved(&problem, kind, 1e-13);
        for (g, side) in impulses.contacts.iter().zip([-1.0, 1.0]) {
            let wanted = 2.0 * FALL * (0.5 + side * friction * 0.5 * height / width);
            assert_close(g.normal, wanted, 1e-12, kind.name());
            assert_close(g.tangent[0].abs(), friction * wanted, 1e-12, kind.name());
        }
    }
    let (_, outcome) = solve(&problem, SolverKind::Direct, 1, 1e-9);
    assert!(matches!(outcome.stop, Stop::Refused(_)));
}

in_both_spaces! {
    every_interface_of_a_column_carries_what_stands_on_it;
    sweeps_carry_a_short_column_to_their_tolerance;
    columns_with_mass_ratios_carry_their_weight;
    a_repeated_contact_is_always_found_singular;
    the_direct_solver_refuses_a_contact_that_would_pull;
    the_direct_solver_refuses_a_contact_that_slides;
    the_direct_solver_accepts_contacts_that_touch_without_load;
    a_ball_in_a_groove_presses_both_sides_alike;
}
