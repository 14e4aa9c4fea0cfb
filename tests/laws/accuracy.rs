//! The contract: an accuracy that is asked for is reached, or the step says that it was not, why, and where; or it
//! is not taken at all. Islands are solved apart, by the cheapest solver that is good enough.

use crate::harness::*;
use carom::{
    BodySpec, Certificate, Column, OnInaccurate, Phase, Settings, SolverKind, StepError, Stop, Topic, World,
};

in_plane_and_space!(
    islands_are_solved_apart_and_reported,
    an_island_goes_no_further_than_its_residual_asks,
    an_inaccurate_step_that_must_raise_leaves_the_world_as_it_was,
    escalation_reaches_what_sweeps_cannot,
    asking_for_warnings_changes_no_bit,
    a_tolerance_of_zero_asks_for_nothing,
    the_order_of_bodies_changes_no_wrench,
    the_order_of_bodies_changes_no_wrench_with_friction_either,
    an_explanation_names_the_bodies_and_their_mass_ratio,
    an_explanation_tells_overlap_and_redundant_contacts,
    an_explanation_tells_that_walls_leave_no_room,
    an_accurate_step_says_so,
    a_certificate_tells_what_the_report_tells,
    a_certificate_holds_the_energy_identity_for_any_impulses,
    a_certificate_of_an_island_is_that_of_its_contacts,
    a_sliding_block_is_braked_against_its_slip,
    an_interrupted_step_leaves_the_world_as_it_was,
);

/// Settings of this page: asked for 1e-9 m/s.
fn asked<S: Dimension>(solver: SolverKind, on_inaccurate: OnInaccurate) -> Settings<S> {
    Settings { dt: 1.0 / 60.0, solver: Some(solver), on_inaccurate, tolerance: 1e-9, ..Settings::default() }
}

/// Frictionless boxes in columns, the top one of each this many times as heavy as the rest, and a ball in the air.
fn columns<S: Dimension>(settings: Settings<S>, tops: &[f64], order: &[usize]) -> World<S> {
    let mut w = world::<S>(settings);
    add_floor(&mut w, 0.0, 0.0);
    let mut specs = Vec::new();
    for (c, &top) in tops.iter().enumerate() {
        for (k, mass) in [1.0, 1.0, top].into_iter().enumerate() {
            let place = S::at(3.0 * c as f64, 0.5 + k as f64);
            let block = BodySpec::heavy(S::block(1.0, 1.0), mass).at(place).friction(0.0);
            specs.push((format!("box{c}{k}"), block));
        }
    }
    specs.push(("ball".into(), BodySpec::heavy(S::ball(0.1), 1.0).at(S::at(0.0, 20.0)).friction(0.0)));
    for k in 0..specs.len() {
        let (name, spec) = specs[order.get(k).copied().unwrap_or(k)].clone();
        add(&mut w, &name, spec);
    }
    w
}

/// One report per island where something presses: obstacles join nothing, a body in the air is none.
pub fn islands_are_solved_apart_and_reported<S: Dimension>() {
    let mut w = columns::<S>(asked(SolverKind::Auto, OnInaccurate::Warn), &[1.0, 1.0, 1.0], &[]);
    let report = step(&mut w);
    let islands: Vec<_> = report.islands().collect();
    assert_eq!(islands.len(), 3);
    let contacts = w.last_problem().0.contacts.len();
    for (k, island) in islands.iter().enumerate() {
        assert_eq!((island.bodies, island.rows), (3, 0));
        assert_eq!(island.contacts, contacts / 3);
        assert_eq!(island.first_body, 1 + 3 * k);
        assert!(island.residual <= report.tolerance && !island.stages.is_empty());
    }
    assert!(report.is_accurate());
}

/// The light column is done by sweeps, the heavy one goes on; the report says why.
pub fn an_island_goes_no_further_than_its_residual_asks<S: Dimension>() {
    let settings = Settings { iterations: 400, ..asked(SolverKind::Auto, OnInaccurate::Warn) };
    let mut w = columns::<S>(settings, &[1.0, 1e4], &[]);
    let report = step(&mut w);
    let islands: Vec<_> = report.islands().collect();
    assert_eq!(islands[0].stages.len(), 1, "{:?}", islands[0]);
    assert_eq!(islands[0].stages[0].solver, SolverKind::Pgs);
    assert_eq!(islands[0].why_further(1e-9), "");
    assert!(islands[1].stages.len() > 1, "{:?}", islands[1]);
    let why = islands[1].why_further(1e-9);
    assert!(why.contains("pgs left") && why.contains("400 iterations"), "{why}");
    let last = islands[1].stages.last().expect("stages");
    assert_eq!(last.stop, Stop::Converged);
    at_most(report.residual(), 1e-9, "residual of auto on a column with a top of 1e4 [m/s]");
}

/// Refused: bits, time, contacts and warm starts stay, the error and the world say why with names.
pub fn an_inaccurate_step_that_must_raise_leaves_the_world_as_it_was<S: Dimension>() {
    let mut w = columns::<S>(asked(SolverKind::Pgs, OnInaccurate::Ignore), &[1.0, 1e4], &[]);
    step(&mut w);
    let mut settings = w.settings().clone();
    settings.on_inaccurate = OnInaccurate::Raise;
    w.set_settings(settings).expect("possible");
    let (before, contacts, moved) = (w.snapshot(), w.touches().to_vec(), bits(&w));
    let error = w.step(1.0 / 60.0).expect_err("100 sweeps do not reach 1e-9");
    let StepError::Inaccurate { residual, tolerance, explanation, .. } = &error else { panic!("{error}") };
    assert!(residual > tolerance && *tolerance == 1e-9);
    assert!(explanation.contains("'box12'") && explanation.contains("'box11'"), "{explanation}");
    let told = w.failure().expect("a solve failed the step");
    assert!(!told.accurate && told.findings.iter().any(|f| f.topic == Topic::MassRatio), "{told:?}");
    assert_eq!((w.snapshot(), bits(&w)), (before, moved));
    assert_eq!(w.touches(), contacts);
}

/// The stronger solvers take over where the sweep stays above the tolerance.
pub fn escalation_reaches_what_sweeps_cannot<S: Dimension>() {
    let mut sweeps = columns::<S>(asked(SolverKind::Pgs, OnInaccurate::Ignore), &[1.0, 1e4], &[]);
    let mut strong = columns::<S>(asked(SolverKind::Pgs, OnInaccurate::Escalate), &[1.0, 1e4], &[]);
    for _ in 0..3 {
        let weak = step(&mut sweeps);
        assert!(!weak.is_accurate() && weak.residual() > 1e-6, "{}", weak.residual());
        let report = step(&mut strong);
        at_most(report.residual(), 1e-9, "residual after escalation [m/s]");
    }
}

/// Warning is telling: the trajectory is the same to the last bit.
pub fn asking_for_warnings_changes_no_bit<S: Dimension>() {
    let run = |policy| {
        let mut w = columns::<S>(asked(SolverKind::Pgs, policy), &[1.0, 1e4], &[]);
        settle(&mut w, 0.2);
        bits(&w)
    };
    assert_eq!(run(OnInaccurate::Ignore), run(OnInaccurate::Warn));
}

/// With tolerance 0 all iterations are spent, and no residual is too large.
pub fn a_tolerance_of_zero_asks_for_nothing<S: Dimension>() {
    let settings = Settings { tolerance: 0.0, ..asked(SolverKind::Pgs, OnInaccurate::Raise) };
    let mut w = columns::<S>(settings, &[1e4], &[]);
    let report = step(&mut w);
    assert!(report.is_accurate() && report.residual() > 0.0);
}

/// Case C33: bodies added in another order: the same velocities and forces between the same bodies.
pub fn the_order_of_bodies_changes_no_wrench<S: Dimension>() {
    let orders = [vec![], vec![6, 5, 4, 3, 2, 1, 0], vec![3, 0, 6, 4, 1, 5, 2]];
    let forces: Vec<Vec<f64>> = orders
        .iter()
        .map(|order| {
            let settings = Settings { tolerance: 1e-13, ..asked(SolverKind::Auto, OnInaccurate::Warn) };
            let mut w = columns::<S>(settings, &[1.0, 1e3], order);
            step(&mut w);
            step(&mut w);
            let index = |name: &str| w.index(name).expect("added");
            let pairs = [("floor", "box00"), ("box00", "box01"), ("floor", "box10"), ("box11", "box12")];
            let forces = pairs.map(|(a, b)| normal_force(&w, index(a), index(b)));
            forces.to_vec()
        })
        .collect();
    for (k, force) in forces.iter().enumerate().skip(1) {
        for (one, other) in force.iter().zip(&forces[0]) {
            at_most(
                (one - other).abs() / other,
                1e-10,
                &format!("relative change of a wrench, order {k} [1]"),
            );
        }
    }
}

/// The same with friction, where impulses are not unique, by `exact` alone: what two bodies exert on each other is.
pub fn the_order_of_bodies_changes_no_wrench_with_friction_either<S: Dimension>() {
    let orders = [[0, 1, 2], [2, 1, 0], [1, 2, 0]];
    let forces = orders.map(|order| {
        let mut w =
            world::<S>(Settings { tolerance: 1e-12, ..asked(SolverKind::Exact, OnInaccurate::Raise) });
        add_floor(&mut w, 0.5, 0.0);
        for k in order {
            let mass = [1.0, 1.0, 1e3][k];
            let block =
                BodySpec::heavy(S::block(1.0, 1.0), mass).at(S::at(0.0, 0.5 + k as f64)).friction(0.5);
            add(&mut w, &format!("box{k}"), block);
        }
        step(&mut w);
        step(&mut w);
        let index = |name: &str| w.index(name).expect("added");
        [("floor", "box0"), ("box0", "box1"), ("box1", "box2")]
            .map(|(a, b)| normal_force(&w, index(a), index(b)))
    });
    for force in &forces[1..] {
        for (one, other) in force.iter().zip(&forces[0]) {
            at_most((one - other).abs() / other, 1e-10, "relative change of a wrench with friction [1]");
        }
    }
}

/// Who is heavy, who is light, by how much, and what to set.
pub fn an_explanation_names_the_bodies_and_their_mass_ratio<S: Dimension>() {
    let mut w = columns::<S>(asked(SolverKind::Pgs, OnInaccurate::Warn), &[1.0, 1e4], &[]);
    let report = step(&mut w);
    let told = w.explain(&report);
    assert!(!told.accurate);
    assert_eq!(told.findings[0].topic, Topic::Residual);
    assert!(told.findings[0].bodies.iter().all(|b| b.starts_with("box1") || b == "floor"), "{told:?}");
    let ratio = told.findings.iter().find(|f| f.topic == Topic::MassRatio).expect("a ratio of 1e4");
    assert_eq!(ratio.bodies, ["box12", "box11"]);
    close(ratio.value, 1e4, 1e-8, "mass ratio told [1]");
    assert!(ratio.remedy.contains("solver"), "{}", ratio.remedy);
    let spent = told.findings.iter().find(|f| f.topic == Topic::Iterations).expect("all were spent");
    assert_eq!(spent.value, 100.0);
    let condition = told.findings.iter().find(|f| f.topic == Topic::Conditioning).expect("ill-conditioned");
    // two masses m and r m on the floor alone have the scaled condition 4 r; a column has at least that
    assert!(condition.value > 1e4, "{}", condition.value);
    assert!(told.text().contains("escalate"), "{}", told.text());
}

/// A crate on four legs that is pushed into another one.
pub fn an_explanation_tells_overlap_and_redundant_contacts<S: Dimension>() {
    let settings = Settings { iterations: 2, ..asked(SolverKind::Pgs, OnInaccurate::Warn) };
    let mut w = world::<S>(settings);
    add_floor(&mut w, 0.5, 0.0);
    for (k, height) in [0.5, 1.45].into_iter().enumerate() {
        let block = BodySpec::heavy(S::block(1.0, 1.0), 1.0).at(S::at(0.1 * k as f64, height)).friction(0.5);
        add(&mut w, &format!("crate{k}"), block);
    }
    let report = step(&mut w);
    let told = w.explain(&report);
    let overlap = told.findings.iter().find(|f| f.topic == Topic::Penetration).expect("they overlap");
    close(overlap.value, 0.05, 1e-12, "overlap told [m]");
    assert_eq!(
        {
            let mut b = overlap.bodies.clone();
            b.sort();
            b
        },
        ["crate0", "crate1"]
    );
    let redundant = told.findings.iter().find(|f| f.topic == Topic::RedundantContacts).expect("two patches");
    // 2 (4) contacts per patch with 2 (3) rows each against 3 (6) degrees of freedom per body
    let pressed = w.last_problem().1.contacts.iter().filter(|g| g.normal > 0.0).count();
    let surplus = pressed * (1 + S::SLIP) - 2 * S::DOF;
    assert_eq!(redundant.value, surplus as f64);
}

/// A ball that prescribed walls close on at 1 m/s each: no velocity of it parts both contacts, and the report, the
/// explanation and its remedy say so.
pub fn an_explanation_tells_that_walls_leave_no_room<S: Dimension>() {
    let mut w =
        world::<S>(Settings { gravity: S::Vector::ZERO, ..asked(SolverKind::Exact, OnInaccurate::Warn) });
    for (name, side) in [("left", -1.0), ("right", 1.0)] {
        let wall = BodySpec::kinematic(S::block(1.0, 1.0)).at(S::at(side, 0.5));
        add(&mut w, name, wall.moving(S::at(-side, 0.0)).friction(0.3));
    }
    add(&mut w, "ball", BodySpec::heavy(S::ball(0.5), 1.0).at(S::at(0.0, 0.5)).friction(0.3));
    let report = step(&mut w);
    let told: Vec<f64> = report.islands().filter_map(|i| i.strict_feasibility).collect();
    assert!(!told.is_empty() && told.iter().all(|t| (t + 1.0).abs() < 1e-3), "{told:?}");
    let explained = w.explain(&report);
    let found = explained.findings.iter().find(|f| f.topic == Topic::StrictFeasibility).expect("a finding");
    assert_eq!(found.bodies, ["ball"]);
    assert!(found.text.contains("is not strictly feasible") && found.remedy.contains("wall"), "{found:?}");
}

/// Good news has figures as well.
pub fn an_accurate_step_says_so<S: Dimension>() {
    let mut w = columns::<S>(asked(SolverKind::Auto, OnInaccurate::Warn), &[1.0], &[]);
    let report = step(&mut w);
    let told = w.explain(&report);
    assert!(told.accurate);
    assert!(told.text().starts_with("accurate") && told.text().contains("1.0e-9 m/s"), "{}", told.text());
    assert!(told.findings.iter().all(|f| f.remedy.is_empty()));
    let mut empty = world::<S>(asked(SolverKind::Auto, OnInaccurate::Warn));
    let report = step(&mut empty);
    assert!(empty.explain(&report).accurate);
}

/// The same residual at the same contact, measured from problem and impulses alone; JSON and back.
pub fn a_certificate_tells_what_the_report_tells<S: Dimension>() {
    let mut w = columns::<S>(asked(SolverKind::Pgs, OnInaccurate::Warn), &[1.0, 1e4], &[]);
    let report = step(&mut w);
    let certificate = w.certificate(Phase::Contact, None).expect("the whole problem");
    assert_eq!(certificate.residual, report.residual());
    assert_eq!(certificate.relative_residual, report.relative_residual());
    assert_eq!(certificate.worst_bodies, report.worst());
    let (a, b) = report.worst().expect("inaccurate");
    let names = &w.bodies().names;
    assert_eq!(certificate.worst_names, Some((names[a].clone(), names[b].clone())));
    assert_eq!(certificate.cone_violation, 0.0);
    // nothing struck: no impacts to certify
    assert_eq!(w.certificate(Phase::Impact, None).expect("a problem without contacts").contacts, 0);
    let (problem, impulses, _) = w.last_problem();
    let alone = Certificate::of(problem, impulses);
    assert_eq!(Certificate { worst_names: None, ..certificate }, alone);
}

/// Delta T = 1/2 x^T (u+ + u-) whatever the impulses are, moving obstacles included; and the cone and the residual
/// tell that they are none of the law's.
pub fn a_certificate_holds_the_energy_identity_for_any_impulses<S: Dimension>() {
    let mut w = crate::laws::determinism::heap::<S>(Settings::default());
    settle(&mut w, 1.5);
    let (problem, impulses, _) = w.last_problem();
    assert!(problem.contacts.len() > 5);
    let mut dice = Dice(7);
    let mut wild = impulses.clone();
    for g in &mut wild.contacts {
        g.normal = dice.between(-1.0, 3.0);
        g.tangent = Column::from_fn(|_| dice.between(-2.0, 2.0));
    }
    for (impulses, what) in [(impulses, "solved"), (&wild, "wild")] {
        let c = Certificate::of(problem, impulses);
        // some hundred terms, each formed to rounding
        at_most(
            c.energy_identity.abs() / c.energy_turned_over,
            1e-13,
            &format!("energy identity over the energy turned over, {what} impulses [1]"),
        );
    }
    let c = Certificate::of(problem, &wild);
    assert!(c.cone_violation > 0.5 && c.residual > 0.1 && c.complementarity > 0.1, "{c:?}");
}

/// Narrowed to the island of a body: its contacts, its residual; nothing for a body in the air.
pub fn a_certificate_of_an_island_is_that_of_its_contacts<S: Dimension>() {
    let mut w = columns::<S>(asked(SolverKind::Auto, OnInaccurate::Warn), &[1.0, 1e4], &[]);
    let report = step(&mut w);
    for (island, body) in report.islands().zip(["box01", "box12"]) {
        let body = w.index(body).expect("added");
        let c = w.certificate(Phase::Contact, Some(body)).expect("it touches");
        assert_eq!(c.contacts, island.contacts);
        at_most((c.residual - island.residual).abs(), 1e-15, "residual of an island told twice [m/s]");
        assert_eq!(c.worst_contact.map(carom::solver::Entry::Contact), island.worst);
    }
    assert_eq!(w.certificate(Phase::Contact, Some(w.index("ball").expect("added"))), None);
}

/// The direction of friction, measured: a block that slides askew.
pub fn a_sliding_block_is_braked_against_its_slip<S: Dimension>() {
    let settings = Settings { iterations: 5000, ..asked(SolverKind::Pgs, OnInaccurate::Warn) };
    let mut w = world::<S>(Settings { tolerance: 1e-12, ..settings });
    add_floor(&mut w, 0.5, 0.0);
    let direction = S::Vector::from_fn(|k| if k + 1 == S::DIM { 0.0 } else { 2.0 - 0.7 * k as f64 });
    add(&mut w, "block", BodySpec::heavy(S::block(1.0, 0.1), 1.0).at(S::at(0.0, 0.05)).moving(direction));
    step(&mut w);
    let c = w.certificate(Phase::Contact, None).expect("the whole problem");
    assert!(c.sliding > 0, "{c:?}");
    at_most(c.slip_angle_error, 1e-8, "angle between friction and the opposite of the slip [rad]");
}

/// A watch that says stop ends the step in the middle of a solve; the world is as before and goes on.
pub fn an_interrupted_step_leaves_the_world_as_it_was<S: Dimension>() {
    let settings = Settings { iterations: 100_000, ..asked(SolverKind::Pgs, OnInaccurate::Warn) };
    let mut w = columns::<S>(settings.clone(), &[1e6], &[]);
    let mut twin = columns::<S>(settings, &[1e6], &[]);
    let (before, moved) = (w.snapshot(), bits(&w));
    let mut looks = 0;
    let error = w.step_watched(1.0 / 60.0, &mut |progress| {
        assert!(progress.iterations > 0 && progress.residual > 0.0);
        looks += 1;
        looks < 3
    });
    assert!(matches!(error, Err(StepError::Interrupted { contacts, .. }) if contacts > 0), "{error:?}");
    assert_eq!((looks, w.snapshot(), bits(&w)), (3, before, moved));
    step(&mut w);
    step(&mut twin);
    assert_eq!(bits(&w), bits(&twin));
}
