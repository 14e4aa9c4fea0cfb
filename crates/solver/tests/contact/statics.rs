//! Structures with known loads, cases C24 to C29 as contact problems: every accurate method, in the plane and in
//! space. A method is asked for the most digits that it certifies and held to what that means for loads.

use crate::common::*;
use crate::contact::scenes::*;
use crate::contact::solvers::{Method, accurate_methods, rest, solve_best};
use carom_math::{Column, Space, Spatial};
use carom_solver::{ContactProblem, Impulses};

/// Solves as exactly as the method can, or fails.
#[track_caller]
fn best<S: Space>(method: Method, what: &str, problem: &ContactProblem<S>) -> Impulses<S> {
    solve_best(method, problem).unwrap_or_else(|why| panic!("{} on {what}: {why}", method.name()))
}

/// Load of each interface of a stack, bottom first.
fn loads<S: Space>(problem: &ContactProblem<S>, impulses: &Impulses<S>, bricks: usize) -> Vec<f64> {
    let mut all = vec![0.0; bricks];
    problem.contacts.iter().zip(&impulses.contacts).for_each(|(c, g)| all[c.a - 1] += g.normal);
    all
}

/// C24: interface k carries the weight above it, whatever the masses, with and without friction.
fn interfaces_of_a_stack_carry_what_stands_on_them<S: Space>() {
    for method in accurate_methods() {
        for ratio in [1.0, 1e3, 1e6] {
            for (n, heavy) in [(2, 1), (10, 9), (10, 4), (10, 0)] {
                for friction in [0.0, 0.5] {
                    let masses: Vec<f64> = (0..n).map(|k| if k == heavy { ratio } else { 1.0 }).collect();
                    let problem = stack::<S>(&masses, friction);
                    let what = format!("a stack of {n}, brick {heavy} of mass {ratio:e}, mu {friction}");
                    if rest(method) > 0.0 && ratio > 1e3 {
                        continue; // a load of a gram under a ton is beyond a rest of 1e-6
                    }
                    let impulses = best(method, &what, &problem);
                    for (k, load) in loads(&problem, &impulses, n).into_iter().enumerate() {
                        let above = FALL * masses[k..].iter().sum::<f64>();
                        let off = (load - above).abs() / above;
                        // a brick's speed is known to 2 EPSILON of what a brick `ratio` as heavy presses it with, and
                        // the heavy one's speed, hence its load, is the sum of those below it
                        let rounding = 2.0 * f64::EPSILON * ratio * n as f64;
                        // on bodies the digits asked for are speeds: of the last 1e-8 each brick below may have one
                        let asked =
                            if matches!(method, Method::Bodies(_)) && ratio > 1e3 { 1e-8 } else { 0.0 };
                        let bound = 1e-10_f64.max(rounding).max(asked * n as f64).max(rest(method) * ratio);
                        assert!(off <= bound, "{} on {what}, interface {k}: off by {off:e}", method.name());
                    }
                }
            }
        }
    }
}

/// C25: however many legs, the ground's wrench on a table is its weight through the load's place, in every order of
/// the legs; three legs have the forces of statics.
fn a_table_is_carried_by_one_wrench_on_any_number_of_legs<S: Space>() {
    let load = (0.3, 0.1);
    for method in accurate_methods() {
        let bound = 1e-12_f64.max(rest(method));
        for count in (if S::DIM == 2 { 2 } else { 3 })..=16 {
            let mut legs: Vec<(f64, f64)> = (0..count)
                .map(|k| (std::f64::consts::TAU * (k as f64 + 0.2) / count as f64).sin_cos())
                .map(|(s, c)| (1.2 * c, 1.2 * s))
                .collect();
            if S::DIM == 2 {
                legs = (0..count).map(|k| (2.0 * k as f64 / (count as f64 - 1.0) - 1.0, 0.0)).collect();
            }
            for friction in [0.0, 0.4] {
                for order in 0..3 {
                    legs.rotate_left(order);
                    if order == 2 {
                        legs.reverse();
                    }
                    let problem = table::<S>(&legs, load, friction);
                    let what = format!("a table on {count} legs, order {order}, mu {friction}");
                    let w = wrenches(&problem, &best(method, &what, &problem))[1];
                    let wanted = at::<S>(0.0, 0.0, FALL);
                    let (force, moment) = ((w.linear - wanted).max_abs(), w.angular.max_abs());
                    assert!(
                        force <= bound && moment <= bound,
                        "{} on {what}: {force:e} {moment:e}",
                        method.name()
                    );
                }
            }
        }
    }
}

/// C26: both sides of a groove of 90 degrees carry m g / sqrt 2.
fn a_ball_in_a_groove_presses_with_its_weight_over_root_two<S: Space>() {
    let half = 0.5f64.sqrt();
    for method in accurate_methods() {
        for friction in [0.0, 0.3] {
            let mut s = Scene::<S>::new();
            let body = s.body(ball(2.0, 0.5), at::<S>(0.0, 0.0, 0.5 / half));
            for side in [half, -half] {
                let normal = at::<S>(side, 0.0, half);
                s.touch(body, 0, s.centres[body] - normal * 0.5, normal, friction);
            }
            let impulses = best(method, "a ball in a groove", &s.problem);
            let wrench = wrenches(&s.problem, &impulses)[body];
            assert_column_close(
                wrench.linear,
                at::<S>(0.0, 0.0, 2.0 * FALL),
                1e-12_f64.max(rest(method)),
                "C26",
            );
            if friction == 0.0 {
                for g in &impulses.contacts {
                    assert_close(g.normal, 2.0 * FALL * half, 1e-12_f64.max(rest(method)), &method.name());
                }
            }
        }
    }
}

/// Fails unless a structure stands, or moves, as it should: standing is a motion below `bound`, falling one above
/// a thousandth of a step's fall.
#[track_caller]
fn assert_stands<S: Space>(what: &str, problem: &ContactProblem<S>, stands: bool) {
    for method in accurate_methods() {
        let motion = motion_after(problem, &best(method, what, problem));
        if stands {
            let bound = 1e-9_f64.max(10.0 * rest(method));
            assert!(motion <= bound, "{}: {what} must stand, moves with {motion:e}", method.name());
        } else {
            assert!(motion > 1e-3 * FALL, "{}: {what} must fall, moves with {motion:e}", method.name());
        }
    }
}

/// C27: two cards stand iff mu >= tan(angle)/2.
fn a_frame_of_cards_stands_iff_friction_exceeds_half_the_tangent<S: Space>() {
    for angle in [0.1f64, 0.4, 0.8, 1.1] {
        let limit = 0.5 * angle.tan();
        for (share, stands) in [(1.001, true), (1.5, true), (0.98, false)] {
            let problem = a_frame::<S>(angle, share * limit);
            assert_stands(&format!("cards at {angle}, {share} of the limit"), &problem, stands);
        }
    }
}

/// C28: bricks at 0.99 of the largest overhang stand, at 1.01 they fall.
fn bricks_overhang_to_just_under_their_limit<S: Space>() {
    for bricks in [1, 2, 4, 6] {
        for (share, stands) in [(0.99, true), (1.01, false)] {
            let problem = overhang::<S>(bricks, share, 0.8);
            assert_stands(&format!("{bricks} bricks at {share} of the overhang"), &problem, stands);
        }
    }
}

/// C29: with friction enough to hold it a box tips iff the slope's tangent exceeds its width over its height.
fn a_box_on_a_slope_tips_iff_its_weight_passes_its_edge<S: Space>() {
    for (share, stands) in [(0.98, true), (1.02, false)] {
        let slope = (share * 0.4f64).atan();
        let problem = box_on_slope::<S>(0.4, 1.0, slope, 2.0);
        assert_stands(&format!("a box on a slope of {share} of the limit"), &problem, stands);
    }
}

/// Arches and walls with friction stand, and an arch on slippery joints falls.
fn arches_and_walls_stand_on_friction<S: Space>() {
    for stones in [3, 7, 11] {
        assert_stands(&format!("an arch of {stones}"), &arch::<S>(stones, 0.8), true);
        assert_stands(&format!("a slippery arch of {stones}"), &arch::<S>(stones, 0.05), false);
    }
    for (columns, rows) in [(2, 3), (4, 4)] {
        assert_stands(&format!("a wall of {rows} rows"), &wall::<S>(columns, rows, 0.5), true);
    }
}

/// C30 as a problem: a tower of crossed planks stands, and carries its weight.
#[test]
fn a_tower_of_planks_stands() {
    for (layers, planks) in [(2, 2), (6, 2), (4, 3)] {
        let problem = tower(layers, planks, 0.5);
        let what = format!("a tower of {layers} layers of {planks} planks");
        assert_stands(&what, &problem, true);
        for method in accurate_methods() {
            let ground = wrenches::<Spatial>(&problem, &best(method, &what, &problem))[0];
            let weight = -FALL * (layers * planks) as f64;
            let bound = (1e-10_f64.max(rest(method)) * weight.abs()).max(1e-12);
            assert_column_close(ground.linear, at::<Spatial>(0.0, 0.0, weight), 10.0 * bound, &what);
        }
    }
}

/// All accurate methods agree on the wrenches of random structures where they all find a solution and nothing slides
/// (where something slides the law itself may allow several answers).
fn methods_agree_on_the_wrenches_of_standing_structures<S: Space>() {
    let list: Vec<(String, ContactProblem<S>)> = vec![
        ("a wall".into(), wall::<S>(3, 4, 0.6)),
        ("an arch".into(), arch::<S>(7, 0.8)),
        ("a stack".into(), stack::<S>(&[1.0, 2.0, 0.5, 3.0], 0.5)),
        ("cards".into(), a_frame::<S>(0.4, 0.4)),
        ("an overhang".into(), overhang::<S>(4, 0.9, 0.5)),
    ];
    for (what, problem) in list {
        let answers: Vec<(String, f64, Vec<_>)> = accurate_methods()
            .into_iter()
            .map(|m| (m.name(), rest(m), wrenches(&problem, &best(m, &what, &problem))))
            .collect();
        for (name, rest, w) in &answers[1..] {
            let off = apart(&answers[0].2, w);
            let bound = 1e-9_f64.max(100.0 * rest.max(answers[0].1));
            assert!(off <= bound, "{what}: {} and {name} are {off:e} apart", answers[0].0);
        }
    }
}

in_both_spaces! {
    interfaces_of_a_stack_carry_what_stands_on_them;
    a_table_is_carried_by_one_wrench_on_any_number_of_legs;
    a_ball_in_a_groove_presses_with_its_weight_over_root_two;
    a_frame_of_cards_stands_iff_friction_exceeds_half_the_tangent;
    bricks_overhang_to_just_under_their_limit;
    a_box_on_a_slope_tips_iff_its_weight_passes_its_edge;
    arches_and_walls_stand_on_friction;
    methods_agree_on_the_wrenches_of_standing_structures;
}
