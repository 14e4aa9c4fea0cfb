//! What stands, and what it presses with: cases C24 to C30. What stands does so to rounding: nothing creeps.

use crate::cases::events;
use crate::harness::scenes::{overhanging_bricks, tower_of_planks};
use crate::harness::*;
use carom::{
    BodySpec, Column, ImpulseChoice, MassProperties, Settings, SolverKind, Spatial, SpatialShape, Sym3,
    World, vec3,
};
use carom_scenes::stacking;
use std::f64::consts::FRAC_PI_4;

in_plane_and_space!(
    each_interface_of_a_stack_carries_what_is_above_it_at_any_mass_ratio,
    a_ball_in_a_right_angled_groove_presses_with_its_weight_over_root_two,
    an_a_frame_of_cards_stands_iff_friction_exceeds_half_the_tangent,
    four_bricks_overhang_to_just_under_their_limit,
    a_box_on_a_slope_tips_when_the_slope_exceeds_its_width_over_its_height,
    a_tower_of_planks_stands,
);

/// Case C24: ten blocks, the top one 1, 1e3 and 1e6 times as heavy; with and without friction.
pub fn each_interface_of_a_stack_carries_what_is_above_it_at_any_mass_ratio<S: Dimension>() {
    for (friction, ratio) in [0.0, 0.5].into_iter().flat_map(|f| [1.0, 1e3, 1e6].map(|r| (f, r))) {
        let mut w = world::<S>(events(0.01));
        add_floor(&mut w, friction, 0.0);
        for k in 0..10 {
            let mass = if k == 9 { ratio } else { 1.0 };
            let block = BodySpec::heavy(S::block(1.0, 1.0), mass).at(S::at(0.0, 0.5 + f64::from(k)));
            add(&mut w, &format!("block {k}"), block.friction(friction));
        }
        step(&mut w);
        let worst = (0..10_usize).fold(0.0, |worst: f64, k| {
            let weight = G * (9.0 - k as f64 + ratio);
            worst.max((normal_force(&w, k, k + 1) - weight).abs() / weight)
        });
        // a block's speed is known to 2 EPSILON of what a block `ratio` as heavy presses it with, in each of ten levels
        let bound = 1e-10_f64.max(20.0 * f64::EPSILON * ratio);
        at_most(worst, bound, &format!("C24 worst interface, 1:{ratio:e}, mu {friction} [1]"));
    }
}

/// Case C25: the least forces on four legs are .35, .2, .15 and .3 of the weight, in every step and whichever order the
/// table and its floor come in; force and moment balance to 1e-12.
#[test]
fn the_legs_of_a_table_carry_the_least_forces_in_every_step() {
    for floor_first in [true, false] {
        let settings = Settings {
            solver: Some(SolverKind::Exact),
            impulses: ImpulseChoice::MinimumNorm,
            ..events::<Spatial>(0.01)
        };
        let mut w = world::<Spatial>(settings);
        let inertia = Sym3::diag(0.5, 0.5, 0.8);
        let load = MassProperties { mass: 1.0, center: vec3(0.3, 0.1, 0.0), inertia, error: 0.0 };
        let table = BodySpec::given(Some(SpatialShape::Box { size: [2.0, 2.0, 0.2] }), load);
        let table = table.with_origin_at(vec3(0.0, 0.0, 0.1)).friction(0.3);
        if floor_first {
            add_floor(&mut w, 0.3, 0.0);
            add(&mut w, "table", table);
        } else {
            add(&mut w, "table", table);
            add_floor(&mut w, 0.3, 0.0);
        }
        let body = w.index("table").expect("added");
        for k in 0..20 {
            step(&mut w);
            let (problem, impulses, _) = w.last_problem();
            let (mut shares, mut force, mut moment) = ([0.0; 4], carom::Vec3::ZERO, carom::Vec3::ZERO);
            for (c, g) in problem.contacts.iter().zip(&impulses.contacts) {
                let (arm, sign) = if c.a == body { (c.arm_a, 1.0) } else { (c.arm_b, -1.0) };
                let corner = match (arm[0] > -0.3, arm[1] > -0.1) {
                    (true, true) => 0,
                    (false, true) => 1,
                    (false, false) => 2,
                    (true, false) => 3,
                };
                let f = c.to_world(g) * (sign / 0.01 / G);
                shares[corner] += f[2];
                force += f;
                moment += arm.cross(f);
            }
            for (got, wanted) in shares.into_iter().zip([0.35, 0.2, 0.15, 0.3]) {
                close(got, wanted, 1e-12, &format!("C25 share in step {k} [1]"));
            }
            at_most((force - vec3(0.0, 0.0, 1.0)).norm(), 1e-12, "C25 force over the weight [1]");
            at_most(moment.norm(), 1e-12, "C25 moment over the weight [m]");
        }
    }
}

/// Case C26: N = m g/sqrt 2 on both sides of a 90 degree groove; for all of five seconds.
pub fn a_ball_in_a_right_angled_groove_presses_with_its_weight_over_root_two<S: Dimension>() {
    for friction in [0.0, 0.3] {
        let mut w = world::<S>(events(0.05));
        for (name, side) in [("left", 1.0), ("right", -1.0)] {
            let normal = S::at(side * FRAC_PI_4.sin(), FRAC_PI_4.cos());
            add(&mut w, name, BodySpec::fixed(S::wall(normal)).friction(friction));
        }
        let place = S::at(0.0, 0.1 * 2.0_f64.sqrt());
        add(&mut w, "ball", BodySpec::heavy(S::ball(0.1), 2.0).at(place).friction(friction));
        run(&mut w, 5.0, |w, _| {
            for wall in [0, 1] {
                let force = normal_force(w, wall, 2);
                // with friction forces at the sides may be shared in more than one way; the step's own impulses balance
                if friction == 0.0 {
                    assert!(
                        (force - 2.0 * G * 0.5_f64.sqrt()).abs() < 1e-9,
                        "C26 force on side {wall}: {force} N"
                    );
                }
            }
        });
        at_most((w.bodies().motion.position[2] - place).norm(), 1e-12, "C26 drift in 5 s [m]");
    }
}

/// Case C27: two cards lean on each other at an angle th from the vertical. With edges rounded by r, and t between the
/// edges of a card, the balance of moments about a foot gives mu >= (L sin th - t cos th)/(2 (r + L cos th)), which is
/// tan(th)/2 for thin cards with sharp edges.
pub fn an_a_frame_of_cards_stands_iff_friction_exceeds_half_the_tangent<S: Dimension>() {
    let (length, thick, radius, lean) = (1.0, 1e-4, 1e-3, 0.4_f64);
    let across = length * lean.sin() - thick * lean.cos();
    let limit = 0.5 * across / (radius + length * lean.cos());
    close(limit, 0.5 * lean.tan(), 1e-3, "C27 limit of round cards against tan(th)/2");
    for (mu, stands) in [(1.001 * limit, true), (0.999 * limit, false)] {
        let mut w = world::<S>(events(0.01));
        add_floor(&mut w, mu, 0.0);
        for (name, side) in [("left", -1.0), ("right", 1.0)] {
            // the foot's edge and the top's are those of one face, the lower one
            let middle = S::at(
                side * (radius + 0.5 * across + thick * lean.cos()),
                radius + 0.5 * (length * lean.cos() + thick * lean.sin()),
            );
            let card = BodySpec::heavy(S::card(thick, length, radius), 0.01).at(middle).friction(mu);
            add(&mut w, name, card.turned(leaning::<S>(side * lean)));
        }
        let start = height(&w, 1);
        settle(&mut w, 5.0);
        let sunk = start - height(&w, 1);
        if stands {
            at_most(sunk.abs(), 1e-10, "C27 sinking of a frame that stands, 5 s [m]");
        } else {
            assert!(sunk > 0.01, "C27: friction {mu} is too little, yet the frame sank only {sunk} m");
        }
    }
}

/// Case C28: four bricks overhang 25/24 L: 0.99 of it stands, 1.01 falls.
pub fn four_bricks_overhang_to_just_under_their_limit<S: Dimension>() {
    for (share, stands) in [(0.99, true), (1.01, false)] {
        let mut w = overhanging_bricks::<S>(events(0.01), share);
        let start = height(&w, 4);
        settle(&mut w, 1.5);
        let sunk = start - height(&w, 4);
        if stands {
            at_most(sunk.abs(), 1e-10, "C28 sinking of the top brick, 1.5 s [m]");
        } else {
            assert!(sunk > 0.02, "C28: 1.01 of the limit falls, yet the top brick sank only {sunk} m");
        }
    }
}

/// Case C29: with friction enough to hold it, a box tips iff tan > w/h.
pub fn a_box_on_a_slope_tips_when_the_slope_exceeds_its_width_over_its_height<S: Dimension>() {
    let (width, tall) = (0.4_f64, 1.0_f64);
    for (share, tips) in [(0.999, false), (1.001, true)] {
        let angle = (share * width / tall).atan();
        let mut w = world::<S>(events(0.01));
        let normal = S::at(angle.sin(), angle.cos());
        add(&mut w, "slope", BodySpec::fixed(S::wall(normal)).friction(2.0));
        let body = BodySpec::heavy(S::block(width, tall), 3.0).at(normal * (0.5 * tall));
        add(&mut w, "box", body.turned(leaning::<S>(-angle)).friction(2.0));
        let start = w.bodies().motion.rotation[1];
        settle(&mut w, 3.0);
        let turned = angle_between::<S>(&start, &w.bodies().motion.rotation[1]);
        if tips {
            assert!(turned > 0.1, "C29: the box tips, yet it turned only {turned} rad");
        } else {
            at_most(turned, 1e-9, "C29 turn of a box that must not tip, 3 s [rad]");
        }
    }
}

/// The farthest that any body gets from where it began while a world runs for a time \[m\]; `tell` sees every step.
pub fn farthest<S: Dimension>(w: &mut World<S>, time: f64, mut tell: impl FnMut(&World<S>, f64)) -> f64 {
    let start = w.bodies().motion.position.clone();
    let mut worst: f64 = 0.0;
    run(w, time, |w, _| {
        for (x, y) in w.bodies().motion.position.iter().zip(&start) {
            worst = worst.max((*x - *y).norm());
        }
        tell(w, worst);
    });
    worst
}

/// Case C30, for ten seconds; for 600 s in `make laws`.
pub fn a_tower_of_planks_stands<S: Dimension>() {
    let mut w = tower_of_planks::<S>(events(1.0 / 60.0));
    at_most(farthest(&mut w, 10.0, |_, _| ()), 1e-10, "C30 largest displacement in 10 s [m]");
}

/// Settings of a scene of the catalogue, by this scheme.
pub fn by_events<S: Dimension>(mut w: World<S>, dt: f64) -> World<S> {
    w.set_settings(events(dt)).expect("possible");
    w
}

/// Case C30: a house of cards with three levels, for ten seconds; for 600 s in `make laws`.
#[test]
fn a_house_of_cards_stands() {
    let mut w = by_events(stacking::card_house(3, 0.5).expect("builds"), 1.0 / 60.0);
    at_most(farthest(&mut w, 10.0, |_, _| ()), 1e-9, "C30 largest displacement of a card in 10 s [m]");
}

/// Case C30: a Kapla tower of three planks a storey, low and for a short time; of 102 planks in `make laws`.
#[test]
fn a_low_kapla_tower_stands() {
    let mut w = by_events(stacking::kapla_tower(5, 3).expect("builds"), 1.0 / 60.0);
    at_most(farthest(&mut w, 1.0, |_, _| ()), 1e-9, "C30 largest displacement of a plank in 1 s [m]");
}
