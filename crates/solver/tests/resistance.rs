//! Rolling and spinning friction: closed forms of one step, energy, agreement of the solvers that know it, files, and
//! refusals by those that do not (theory eqs. 3.24 to 3.28).

use crate::common::*;
use carom_math::{Column, Space, Spatial, vec3};
use carom_solver::delassus::{delassus, right_hand_side};
use carom_solver::file::{from_json, to_json};
use carom_solver::prepared::Prepared;
use carom_solver::{
    Contact, ContactProblem, FrictionLaw, Impulses, Resistance, SolveSettings, SolverKind, Stop, Twist,
    residual,
};

const KNOWING: [SolverKind; 4] = [SolverKind::Pgs, SolverKind::Nncg, SolverKind::Apgd, SolverKind::Exact];
const RADIUS: f64 = 0.3;
/// The speed that a step of gravity gives [m/s].
const FALL: f64 = 0.04;

/// The spin of a ball that rolls along the first axis on a floor below it without slipping.
fn rolling<S: Space>(speed: f64) -> S::Spin {
    S::Spin::from_fn(|k| if S::SPIN == 1 { -speed / RADIUS } else { [0.0, speed / RADIUS, 0.0][k] })
}

/// A ball on the floor with a velocity after a step of gravity.
fn on_the_floor<S: Space>(velocity: Twist<S>, coefficient: Resistance) -> ContactProblem<S> {
    let up = S::DIM - 1;
    let mut twist = velocity;
    twist.linear += along(up, -FALL);
    let mut problem = ContactProblem::new(vec![ball(2.0, RADIUS), obstacle()], vec![twist, Twist::default()]);
    let c = contact((0, along(up, -RADIUS)), (1, S::Vector::ZERO), along(up, 1.0));
    problem.contacts.push(Contact { friction: 0.8, ..c });
    problem.resistances.push(coefficient);
    problem.check().expect("a sound problem");
    problem
}

/// A rolling ball loses c g h / (R (1 + k)) per step, I = k m R^2: two fifths for a ball, one half for a disc.
fn a_rolling_ball_is_braked_by_the_closed_form<S: Space>() {
    let c = 0.01;
    let velocity = Twist::new(along(0, 1.5), rolling::<S>(1.5));
    let problem = on_the_floor::<S>(velocity, Resistance { contact: 0, rolling: c, spinning: 0.0 });
    let k = if S::SPIN == 1 { 0.5 } else { 0.4 };
    let wanted = 1.5 - c * FALL / (RADIUS * (1.0 + k));
    for kind in KNOWING {
        let after = problem.velocities_after(&solved(&problem, kind, 1e-14))[0];
        assert_column_close(after.linear, along(0, wanted), 1e-12, kind.name());
        assert_column_close(after.angular, rolling::<S>(wanted), 1e-11, kind.name());
    }
}

/// Slower than one step's loss it stops, whole, and a ball on which a small push acts does not start.
fn a_slow_ball_stops_and_stays<S: Space>() {
    for speed in [1e-5, 0.0] {
        let mut velocity = Twist::new(along(0, speed), rolling::<S>(speed));
        velocity.linear += along(0, 5e-4);
        let problem = on_the_floor::<S>(velocity, Resistance { contact: 0, rolling: 0.01, spinning: 0.0 });
        for kind in KNOWING {
            let after = problem.velocities_after(&solved(&problem, kind, 1e-14))[0];
            assert!(
                after.linear.norm() < 1e-13 && after.angular.norm() < 1e-12,
                "{}: {after:?}",
                kind.name()
            );
        }
    }
}

/// A ball that spins about the normal loses spinning N / I, never more than it has, and does not roll away.
#[test]
fn a_spinning_ball_is_slowed_about_its_normal() {
    let inertia = 0.4 * 2.0 * RADIUS * RADIUS;
    let s = 0.005;
    for (spin, wanted) in [(20.0, 20.0 - s * 2.0 * FALL / inertia), (1e-3, 0.0)] {
        let velocity = Twist::new(vec3(0.0, 0.0, 0.0), vec3(0.0, 0.0, spin));
        let problem = on_the_floor::<Spatial>(velocity, Resistance { contact: 0, rolling: 0.0, spinning: s });
        for kind in KNOWING {
            let after = problem.velocities_after(&solved(&problem, kind, 1e-14))[0];
            assert_column_close(after.angular, vec3(0.0, 0.0, wanted), 1e-11, kind.name());
            assert_column_close(after.linear, vec3(0.0, 0.0, 0.0), 1e-13, kind.name());
        }
    }
}

/// A random problem of few contacts, most of them resisting.
fn resisting<S: Space>(random: &mut Random, contacts: usize) -> ContactProblem<S> {
    let recipe = Recipe { bodies: 9, contacts, rows: 2, friction: 0.4, law: FrictionLaw::Disc };
    let mut problem = random_problem::<S>(random, recipe);
    for contact in (0..contacts).filter(|k| k % 4 != 3) {
        let (rolling, spinning) = (random.between(0.0, 0.2), random.between(0.0, 0.2));
        problem.resistances.push(Resistance { contact, rolling, spinning });
    }
    problem.check().expect("a sound problem");
    problem
}

/// The solvers find the same velocities, moments inside their limits, and opposite to what turns on.
fn solvers_agree_and_moments_oppose<S: Space>() {
    let mut random = Random::new(91);
    let mut opposed = 0;
    for _ in 0..25 {
        let problem = resisting::<S>(&mut random, 8);
        let wanted = problem.velocities_after(&solved(&problem, SolverKind::Pgs, 1e-12));
        for kind in KNOWING {
            let impulses = solved(&problem, kind, 1e-11);
            let after = problem.velocities_after(&impulses);
            for (v, w) in after.iter().zip(&wanted) {
                assert_column_close(v.linear, w.linear, 1e-8, kind.name());
                assert_column_close(v.angular, w.angular, 1e-7, kind.name());
            }
            for (r, &m) in problem.resistances.iter().zip(&impulses.moments) {
                let normal = impulses.contacts[r.contact].normal;
                let spin = problem.contacts[r.contact].relative_spin(&after);
                let parts = if S::SPIN == 1 {
                    vec![(vec![m[0]], vec![spin[0]], r.rolling)]
                } else {
                    vec![
                        (vec![m[1], m[2]], vec![spin[1], spin[2]], r.rolling),
                        (vec![m[0]], vec![spin[0]], r.spinning),
                    ]
                };
                for (m, w, coefficient) in parts {
                    let length = |x: &[f64]| x.iter().map(|x| x * x).sum::<f64>().sqrt();
                    assert!(length(&m) <= coefficient * normal * (1.0 + 1e-12) + 1e-300);
                    if normal > 1e-6 && length(&w) > 1e-6 {
                        opposed += 1;
                        let product: f64 = m.iter().zip(&w).map(|(m, w)| m * w).sum();
                        assert_close(product, -coefficient * normal * length(&w), 1e-8, kind.name());
                    }
                }
            }
        }
    }
    assert!(opposed > 100, "{opposed}");
}

/// Plastic contacts with moments lose at least 1/2 gamma^T A gamma, moments among the impulses.
fn moments_never_make_energy<S: Space>() {
    let mut random = Random::new(92);
    for _ in 0..20 {
        let mut problem = resisting::<S>(&mut random, 10);
        problem.rows.clear();
        problem.contacts.iter_mut().for_each(|c| c.target = 0.0);
        let impulses = solved(&problem, SolverKind::Pgs, 1e-11);
        let gamma = impulses.flat();
        assert!(problem.resistances.len() == impulses.moments.len() && gamma.len() == problem.scalar_rows());
        let product: f64 = delassus(&problem).times(&gamma).iter().zip(&gamma).map(|(a, g)| a * g).sum();
        let gained = kinetic_energy(&problem, &problem.velocities_after(&impulses))
            - kinetic_energy(&problem, &problem.velocities);
        assert!(gained <= -0.5 * product + 1e-9, "{gained} > -{product}/2");
    }
}

/// A gamma - b over all scalar rows, moments included, is what the bodies' velocities say; flat numbers come back.
fn matrices_hold_the_moments<S: Space>() {
    let mut random = Random::new(93);
    let problem = resisting::<S>(&mut random, 12);
    let flat: Vec<f64> = (0..problem.scalar_rows()).map(|_| random.between(-1.0, 1.0)).collect();
    let impulses = Impulses::from_flat(&problem, &flat).expect("fits");
    assert_eq!(impulses.flat(), flat);
    let errors = Prepared::of(&problem).velocity_errors(&problem, &impulses);
    let product = delassus(&problem).times(&flat);
    for ((a, b), error) in product.iter().zip(right_hand_side(&problem)).zip(&errors) {
        assert_close(a - b, *error, 1e-12 * (1.0 + a.abs()), "A gamma - b");
    }
    let prepared = {
        let mut v = problem.velocities.clone();
        Prepared::of(&problem).apply(&impulses, &mut v);
        v
    };
    for (v, w) in problem.velocities_after(&impulses).iter().zip(&prepared) {
        assert_column_close(v.angular, w.angular, 1e-12, "both ways of applying");
    }
}

/// The residual is zero at the solution alone: a moment reversed, cut or left out is told.
fn the_residual_tells_wrong_moments<S: Space>() {
    let velocity = Twist::new(along(0, 1.5), rolling::<S>(1.5));
    let problem = on_the_floor::<S>(velocity, Resistance { contact: 0, rolling: 0.01, spinning: 0.0 });
    let exact = solved(&problem, SolverKind::Pgs, 1e-14);
    for factor in [-1.0, 0.0, 0.5, 2.0] {
        let mut wrong = exact.clone();
        wrong.moments[0] = wrong.moments[0] * factor;
        assert!(residual(&problem, &wrong).absolute > 1e-4 * FALL, "{factor}");
    }
}

/// Islands keep their resistances: the ladder's answer is that of the whole.
fn islands_take_their_resistances_along<S: Space>() {
    let mut random = Random::new(94);
    let mut problem = resisting::<S>(&mut random, 4);
    let other = resisting::<S>(&mut random, 5);
    let bodies = problem.inverse_masses.len();
    let contacts = problem.contacts.len();
    problem.inverse_masses.extend(&other.inverse_masses);
    problem.velocities.extend(&other.velocities);
    let moved = other.contacts.iter().map(|c| Contact { a: c.a + bodies, b: c.b + bodies, ..*c });
    problem.contacts.extend(moved);
    let resisted = other.resistances.iter().map(|r| Resistance { contact: r.contact + contacts, ..*r });
    problem.resistances.extend(resisted);
    problem.rows.clear();
    problem.check().expect("sound");
    let whole = problem.velocities_after(&solved(&problem, SolverKind::Pgs, 1e-12));
    let parts = problem.velocities_after(&solved(&problem, SolverKind::Auto, 1e-12));
    for (v, w) in parts.iter().zip(&whole) {
        assert_column_close(v.angular, w.angular, 1e-8, "islands");
    }
}

/// Files hold resistances and moments; a file without them is read as a problem without.
fn files_hold_resistances_and_old_files_still_load<S: Space>() {
    let problem = resisting::<S>(&mut Random::new(95), 6);
    let text = to_json(&problem);
    assert_eq!(from_json::<S>(&text).expect("readable"), problem);
    let mut plain = problem.clone();
    plain.resistances.clear();
    let old = to_json(&plain);
    assert!(!old.contains("resistances"));
    assert_eq!(from_json::<S>(&old).expect("readable"), plain);
    for (contact, coefficient, word) in [(99, 0.1, "contact"), (0, -0.1, "rolling"), (0, f64::NAN, "rolling")]
    {
        let mut bad = plain.clone();
        bad.resistances.push(Resistance { contact, rolling: coefficient, spinning: 0.0 });
        assert!(bad.check().expect_err("refused").place.contains(word));
    }
    let mut twice = plain.clone();
    twice.resistances.extend([Resistance { contact: 1, rolling: 0.1, spinning: 0.0 }; 2]);
    assert_eq!(twice.check().expect_err("twice").place, "resistances[1].contact");
}

/// Solvers that know no moments say so and who does, and change nothing.
fn other_solvers_refuse_in_words<S: Space>() {
    let mut problem = resisting::<S>(&mut Random::new(96), 3);
    problem.rows.clear(); // which some refuse as well
    let knows = |kind: &SolverKind| KNOWING.contains(kind) || *kind == SolverKind::Auto;
    for kind in SolverKind::ALL.into_iter().filter(|k| !knows(k)) {
        let mut impulses = Impulses::zero(&problem);
        let outcome = kind.make().solve(&problem, &SolveSettings::default(), &mut impulses);
        assert_eq!(impulses, Impulses::zero(&problem));
        let Stop::Refused(why) = outcome.stop else { panic!("{} did not refuse", kind.name()) };
        assert!(why.contains("rolling") && why.contains("nncg"), "{why}");
    }
}

/// A particle has nothing that a moment could turn: no moment acts and nothing breaks.
fn what_cannot_turn_feels_no_moment<S: Space>() {
    let mut problem =
        on_the_floor::<S>(Twist::default(), Resistance { contact: 0, rolling: 0.1, spinning: 0.1 });
    problem.inverse_masses[0] = particle(2.0);
    for kind in KNOWING {
        let impulses = solved(&problem, kind, 1e-14);
        assert_eq!(impulses.moments[0], S::Spin::ZERO);
        assert_close(impulses.contacts[0].normal, 2.0 * FALL, 1e-14, kind.name());
    }
}

in_both_spaces! {
    a_rolling_ball_is_braked_by_the_closed_form;
    a_slow_ball_stops_and_stays;
    solvers_agree_and_moments_oppose;
    moments_never_make_energy;
    matrices_hold_the_moments;
    the_residual_tells_wrong_moments;
    islands_take_their_resistances_along;
    files_hold_resistances_and_old_files_still_load;
    other_solvers_refuse_in_words;
    what_cannot_turn_feels_no_moment;
}
