//! What stands, and what it presses with: cases C24 to C29. Forces are impulses over the step's length; their
//! tolerance is the solver's 1e-12 m/s times mass over step, amplified by the structure's conditioning.

use crate::harness::scenes::overhanging_bricks;
use crate::harness::*;
use carom::{
    BodySpec, Column, ImpulseChoice, MassProperties, Planar, PlanarShape, Settings, SolverKind, Space,
    Spatial, SpatialShape, Stop, Sym3, World, vec2, vec3,
};
use std::f64::consts::FRAC_PI_4;

in_plane_and_space!(
    each_interface_of_a_stack_carries_the_weight_above_it,
    a_column_of_balls_carries_its_weight_at_any_mass_ratio,
    each_interface_carries_the_weight_above_it_with_exact,
    a_ball_in_a_right_angled_groove_presses_with_its_weight_over_root_two,
    a_box_on_a_slope_tips_when_the_slope_exceeds_its_width_over_its_height,
    four_bricks_overhang_to_just_under_their_limit,
);

/// Each case with the default solver and with `exact`.
fn solvers<T: Copy>(cases: [T; 2]) -> impl Iterator<Item = (T, SolverKind)> {
    cases.into_iter().flat_map(|case| [(case, SolverKind::Pgs), (case, SolverKind::Exact)])
}

/// Ten unit blocks on the floor; the top one has `ratio` times the mass of the others.
fn stack<S: Dimension>(settings: Settings<S>, ratio: f64, friction: f64) -> World<S> {
    let mut w = world::<S>(settings);
    add_floor(&mut w, friction, 0.0);
    for k in 0..10 {
        let mass = if k == 9 { ratio } else { 1.0 };
        let block =
            BodySpec::heavy(S::block(1.0, 1.0), mass).at(S::at(0.0, 0.5 + f64::from(k))).friction(friction);
        add(&mut w, &format!("block{k}"), block);
    }
    w
}

/// Largest relative error of the forces between neighbours of a stack of ten with this mass on top.
fn worst_interface<S: Dimension>(w: &World<S>, ratio: f64) -> f64 {
    (0..10).fold(0.0, |worst: f64, k| {
        let weight = G * (f64::from(9 - k) + ratio);
        worst.max((normal_force(w, k as usize, k as usize + 1) - weight).abs() / weight)
    })
}

/// Case C24 with the default solver, friction on: interface k carries (n - k) m g.
pub fn each_interface_of_a_stack_carries_the_weight_above_it<S: Dimension>() {
    let mut w = stack::<S>(Settings { iterations: 200_000, ..exact(1.0 / 60.0) }, 1.0, 0.5);
    for _ in 0..3 {
        step(&mut w);
    }
    // 1e-12 m/s of the solve, through ten levels
    at_most(worst_interface(&w, 1.0), 1e-10, "C24 worst interface of pgs [1]");
}

/// Case C24 with mass ratios 1:1e3 and 1:1e6 in the plane: pivoting and factorisation do not mind. From rest the forces
/// are those of statics; two steps later they also hold what rounding has moved, amplified by the mass ratio.
#[test]
fn each_interface_of_a_stack_with_a_heavy_top_carries_the_weight_above_it() {
    for solver in [SolverKind::Lemke, SolverKind::Direct] {
        for ratio in [1.0, 1e3, 1e6] {
            let mut w = stack::<Planar>(
                Settings { solver: Some(solver), tolerance: 1e-9, ..exact(1.0 / 60.0) },
                ratio,
                0.0,
            );
            let what =
                |when: &str| format!("C24 worst interface of {}, 1:{ratio:e}, {when} [1]", solver.name());
            step(&mut w);
            at_most(worst_interface(&w, ratio), 1e-10, &what("from rest"));
            step(&mut w);
            step(&mut w);
            at_most(worst_interface(&w, ratio), 1e-10_f64.max(1e-15 * ratio), &what("third step"));
        }
    }
}

/// Case C24 for single contacts in both spaces: a column of balls by factorisation.
pub fn a_column_of_balls_carries_its_weight_at_any_mass_ratio<S: Dimension>() {
    for ratio in [1.0, 1e3, 1e6] {
        let mut w =
            world::<S>(Settings { solver: Some(SolverKind::Direct), tolerance: 1e-9, ..exact(1.0 / 60.0) });
        add_floor(&mut w, 0.0, 0.0);
        for k in 0..10 {
            let mass = if k == 9 { ratio } else { 1.0 };
            let ball = BodySpec::heavy(S::ball(0.5), mass).at(S::at(0.0, 0.5 + f64::from(k))).friction(0.0);
            add(&mut w, &format!("ball{k}"), ball);
        }
        step(&mut w);
        at_most(worst_interface(&w, ratio), 1e-10, &format!("C24 worst interface of balls, 1:{ratio:e} [1]"));
    }
}

/// Case C24 with `exact`, with and without friction, at mass ratios 1:1e3 and 1:1e6.
pub fn each_interface_carries_the_weight_above_it_with_exact<S: Dimension>() {
    for friction in [0.0, 0.5] {
        for ratio in [1.0, 1e3, 1e6] {
            let solver = SolverKind::Exact;
            let settings = Settings { solver: Some(solver), tolerance: 1e-13, ..exact(1.0 / 60.0) };
            let mut w = stack::<S>(settings, ratio, friction);
            step(&mut w);
            // a block's speed is known to 2 EPSILON of what a block `ratio` as heavy presses it with, in each of ten levels
            let bound = 1e-10_f64.max(20.0 * f64::EPSILON * ratio);
            at_most(
                worst_interface(&w, ratio),
                bound,
                &format!("C24 of exact, 1:{ratio:e}, mu {friction} [1]"),
            );
        }
    }
}

/// Contacts of one face that rest have gaps and velocities that solves cannot tell from none. As long as each was to be closed,
/// and thrown back, by itself, every step asked a little more for what no rigid body can do, until the forces of the step
/// before were no start any more and steps factorised: the pyramid of 14 in the plane four times a step.
fn pyramids_stand_on_the_forces_of_the_step_before<S: carom_scenes::stage::Stage>() {
    for (tolerance, base) in [(1e-6, 14), (1e-8, 8), (1e-8, 14), (1e-10, 8)] {
        let mut w = carom_scenes::stacking::pyramid::<S>(base).expect("builds");
        let solver = Some(SolverKind::Exact);
        w.set_settings(Settings { solver, tolerance, ..w.settings().clone() }).expect("valid");
        let (mut spent, mut worst) = (0, 0.0_f64);
        for k in 0..240 {
            let report = w.step(1.0 / 60.0).expect("steps").contact_solve.expect("contacts");
            worst = worst.max(report.residual);
            let stages = report.islands.iter().flat_map(|i| i.stages.iter());
            spent += if k > 0 { stages.map(|s| s.factorisations).sum::<usize>() } else { 0 };
        }
        at_most(worst, tolerance, &format!("residual, base {base} [m/s]"));
        println!("measured: base {base}, {tolerance:e} m/s: {spent} factorisations in 239 steps");
        assert!(spent <= 24, "base {base}, {tolerance:e} m/s: {spent} factorisations in 239 steps");
    }
}

#[test]
fn pyramids_stand_on_the_forces_of_the_step_before_in_the_plane() {
    pyramids_stand_on_the_forces_of_the_step_before::<Planar>();
}

#[test]
fn pyramids_stand_on_the_forces_of_the_step_before_in_space() {
    pyramids_stand_on_the_forces_of_the_step_before::<Spatial>();
}

/// A table of mass 1 whose load acts at (.3, .1), on four legs at the corners of a square of side 2, and the floor.
fn table(solver: SolverKind, impulses: ImpulseChoice) -> World<Spatial> {
    let mut w =
        world::<Spatial>(Settings { solver: Some(solver), impulses, tolerance: 1e-13, ..exact(1.0 / 60.0) });
    add_floor(&mut w, 0.3, 0.0);
    let inertia = Sym3::diag(0.5, 0.5, 0.8);
    let load = MassProperties { mass: 1.0, center: vec3(0.3, 0.1, 0.0), inertia, error: 0.0 };
    let table = BodySpec::given(Some(SpatialShape::Box { size: [2.0, 2.0, 0.2] }), load);
    add(&mut w, "table", table.with_origin_at(vec3(0.0, 0.0, 0.1)).friction(0.3));
    w
}

/// The vertical forces on the table's corners (+ +), (- +), (- -), (+ -) in shares of its weight.
fn shares(w: &World<Spatial>) -> [f64; 4] {
    let (problem, impulses, _) = w.last_problem();
    let mut shares = [0.0; 4];
    for (c, g) in problem.contacts.iter().zip(&impulses.contacts) {
        let arm = if c.a == 1 { c.arm_a } else { c.arm_b };
        let corner = match (arm[0] + 0.3 > 0.0, arm[1] + 0.1 > 0.0) {
            (true, true) => 0,
            (false, true) => 1,
            (false, false) => 2,
            (true, false) => 3,
        };
        shares[corner] += g.normal / w.settings().dt / G;
    }
    shares
}

/// Case C25: the least forces on four legs are .35, .2, .15 and .3 of the weight, in the first step as in later ones,
/// whatever the steps before left as a warm start.
#[test]
fn the_least_forces_on_the_legs_of_a_table_need_no_history() {
    for solver in [SolverKind::Exact, SolverKind::Auto] {
        let mut w = table(solver, ImpulseChoice::MinimumNorm);
        for k in 0..3 {
            step(&mut w);
            for (got, wanted) in shares(&w).into_iter().zip([0.35, 0.2, 0.15, 0.3]) {
                close(got, wanted, 1e-12, &format!("C25 share of {} in step {k} [1]", solver.name()));
            }
        }
        // a history of other forces: another solver's
        let mut w = table(SolverKind::Pgs, ImpulseChoice::Any);
        step(&mut w);
        let settings = w.settings().clone();
        w.set_settings(Settings { solver: Some(solver), impulses: ImpulseChoice::MinimumNorm, ..settings })
            .expect("possible");
        step(&mut w);
        for (got, wanted) in shares(&w).into_iter().zip([0.35, 0.2, 0.15, 0.3]) {
            close(got, wanted, 1e-12, &format!("C25 share of {} after pgs [1]", solver.name()));
        }
    }
}

/// Asking a solver for what it does not look for ends the step with words, and the world stays.
#[test]
fn a_solver_asked_for_the_least_forces_that_it_does_not_find_refuses_the_step() {
    let mut w = table(SolverKind::Pgs, ImpulseChoice::MinimumNorm);
    let before = bits(&w);
    let error = w.step(1.0 / 60.0).expect_err("pgs finds any impulses").to_string();
    assert!(error.contains("minimum_norm") && error.contains("exact"), "{error}");
    assert_eq!(before, bits(&w));
}

/// A budget of factorisations that is spent ends the step with what was found, and the report says so.
#[test]
fn a_spent_budget_of_factorisations_is_told() {
    let settings = Settings {
        solver: Some(SolverKind::Exact),
        factorisations: 2,
        warm_start: false,
        ..exact(1.0 / 60.0)
    };
    let mut w = stack::<Spatial>(settings.clone(), 1e3, 0.5);
    let report = step(&mut w);
    let solve = report.contact_solve.as_ref().expect("it rests");
    assert_eq!(solve.stop, Stop::OutOfFactorisations);
    let told = w.explain(&report).text();
    assert!(told.contains("factorisations"), "{told}");
    let mut w = stack::<Spatial>(Settings { factorisations: 200, ..settings }, 1e3, 0.5);
    assert!(step(&mut w).converged());
}

/// Case C25: a table on four legs with its load off the centre. Single forces are not unique; the wrench is.
#[test]
fn the_legs_of_a_table_carry_its_weight_and_its_moments() {
    for solver in [SolverKind::Pgs, SolverKind::PgsMatrix, SolverKind::Lemke, SolverKind::Exact] {
        let mut w =
            world::<Spatial>(Settings { solver: Some(solver), tolerance: 1e-13, ..exact(1.0 / 60.0) });
        add_floor(&mut w, 0.0, 0.0);
        let load = MassProperties {
            mass: 1.0,
            center: vec3(0.3, 0.1, 0.0),
            inertia: Sym3::diag(0.5, 0.5, 0.8),
            error: 0.0,
        };
        let table = BodySpec::given(Some(SpatialShape::Box { size: [2.0, 2.0, 0.2] }), load);
        add(&mut w, "table", table.with_origin_at(vec3(0.0, 0.0, 0.1)).friction(0.0));
        step(&mut w);
        let (problem, impulses, _) = w.last_problem();
        let (mut force, mut moment) = (vec3(0.0, 0.0, 0.0), vec3(0.0, 0.0, 0.0));
        for (c, g) in problem.contacts.iter().zip(&impulses.contacts) {
            let (arm, sign) = if c.a == 1 { (c.arm_a, 1.0) } else { (c.arm_b, -1.0) };
            let f = c.to_world(g) * (sign / w.settings().dt);
            force += f;
            moment += arm.cross(f);
        }
        assert_eq!(problem.contacts.len(), 4, "a box on a plane has four contacts");
        at_most(
            (force - vec3(0.0, 0.0, G)).norm() / G,
            1e-11,
            &format!("C25 force of {} [1]", solver.name()),
        );
        at_most(moment.norm() / G, 1e-11, &format!("C25 moment of {} over the weight [m]", solver.name()));
    }
}

/// Case C26: N = m g/sqrt 2 on both sides of a 90 degree groove.
pub fn a_ball_in_a_right_angled_groove_presses_with_its_weight_over_root_two<S: Dimension>() {
    for (friction, solver) in solvers([0.0, 0.3]) {
        let mut w = world::<S>(Settings { solver: Some(solver), ..exact(1.0 / 60.0) });
        for (name, side) in [("left", 1.0), ("right", -1.0)] {
            let normal = S::at(side * FRAC_PI_4.sin(), FRAC_PI_4.cos());
            add(&mut w, name, BodySpec::fixed(S::wall(normal)).friction(friction));
        }
        let ball = BodySpec::heavy(S::ball(0.1), 2.0).at(S::at(0.0, 0.1 * 2.0_f64.sqrt())).friction(0.0);
        let ball = add(&mut w, "ball", ball);
        settle(&mut w, 0.5);
        for wall in [0, 1] {
            close(normal_force(&w, wall, ball), 2.0 * G * 0.5_f64.sqrt(), 1e-9, "C26 force on a side [N]");
        }
    }
}

/// Case C27: two cards lean on each other at an angle th from the vertical. With round edges of radius r the
/// balance of moments about a foot gives mu >= (L/2) sin th / (r + L cos th), which is tan(th)/2 for r = 0.
#[test]
fn an_a_frame_of_cards_stands_iff_friction_exceeds_half_the_tangent() {
    let (length, radius, lean) = (1.0, 1e-3, 0.4_f64);
    let limit = 0.5 * length * lean.sin() / (radius + length * lean.cos());
    close(limit, 0.5 * lean.tan(), 1e-3, "C27 limit of round cards against tan(th)/2");
    for ((mu, stands), solver) in solvers([(1.02 * limit, true), (0.98 * limit, false)]) {
        let mut w = world::<Planar>(Settings { solver: Some(solver), ..exact(1.0 / 240.0) });
        add_floor(&mut w, mu, 0.0);
        for side in [-1.0, 1.0] {
            let top = vec2(side * radius, radius + length * lean.cos());
            let middle = top + vec2(side * 0.5 * length * lean.sin(), -0.5 * length * lean.cos());
            let card = BodySpec::heavy(PlanarShape::Capsule { length, radius }, 0.01).at(middle).friction(mu);
            let turn = leaning::<Planar>(-(side * (std::f64::consts::FRAC_PI_2 - lean)));
            add(&mut w, if side < 0.0 { "left" } else { "right" }, card.turned(turn));
        }
        let start = height(&w, 1);
        settle(&mut w, 2.0);
        let sunk = start - height(&w, 1);
        if stands {
            at_most(sunk.abs(), 1e-6, "C27 sinking of a frame that stands, 2 s [m]");
        } else {
            assert!(sunk > 0.05, "C27: friction {mu} is too little, yet the frame sank only {sunk} m");
        }
    }
}

/// Case C28: four bricks overhang 25/24 L: 0.99 of it stands, 1.01 falls.
pub fn four_bricks_overhang_to_just_under_their_limit<S: Dimension>() {
    for ((share, stands), solver) in solvers([(0.99, true), (1.01, false)]) {
        let settings = Settings { solver: Some(solver), ..exact(1.0 / 120.0) };
        let mut w = overhanging_bricks::<S>(settings, share);
        let start = height(&w, 4);
        settle(&mut w, 2.0);
        let sunk = start - height(&w, 4);
        if stands {
            at_most(sunk.abs(), 1e-6, "C28 sinking of the top brick, 2 s [m]");
        } else {
            assert!(
                sunk > 0.02,
                "C28: an overhang of 1.01 of the limit falls, yet the top brick sank only {sunk} m"
            );
        }
    }
}

/// Case C29: with friction enough to hold it, a box tips iff tan > w/h.
pub fn a_box_on_a_slope_tips_when_the_slope_exceeds_its_width_over_its_height<S: Dimension>() {
    let (width, tall) = (0.4_f64, 1.0_f64);
    for ((share, tips), solver) in solvers([(0.98, false), (1.02, true)]) {
        let angle = (share * width / tall).atan();
        let mut w = world::<S>(Settings { solver: Some(solver), ..exact(1.0 / 240.0) });
        let normal = S::at(angle.sin(), angle.cos());
        add(&mut w, "slope", BodySpec::fixed(S::wall(normal)).friction(2.0));
        let body = BodySpec::heavy(S::block(width, tall), 3.0)
            .at(normal * (0.5 * tall))
            .turned(leaning::<S>(-angle));
        let body = add(&mut w, "box", body.friction(2.0));
        let start = w.bodies().motion.rotation[body];
        settle(&mut w, 1.5);
        let turned = angle_between::<S>(&start, &w.bodies().motion.rotation[body]);
        if tips {
            assert!(turned > 0.1, "C29: the box tips, yet it turned only {turned} rad");
        } else {
            at_most(turned, 1e-8, "C29 turn of a box that must not tip, 1.5 s [rad]");
        }
    }
}

/// The plane is a slice of space: the same stack presses alike in both.
#[test]
fn a_stack_presses_alike_in_the_plane_and_in_space() {
    let mut plane = stack::<Planar>(Settings { iterations: 200_000, ..exact(1.0 / 60.0) }, 1.0, 0.5);
    let mut space = stack::<Spatial>(Settings { iterations: 200_000, ..exact(1.0 / 60.0) }, 1.0, 0.5);
    step(&mut plane);
    step(&mut space);
    for k in 0..10 {
        let (one, other) = (normal_force(&plane, k, k + 1), normal_force(&space, k, k + 1));
        close(one, other, 1e-8, &format!("force at interface {k}, plane against space [N]"));
    }
    assert_eq!((Planar::DIM, Spatial::DIM), (2, 3));
}
