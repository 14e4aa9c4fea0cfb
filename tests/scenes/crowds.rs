//! Scenes of many bodies behave: what should stand stands, what should fall falls, nothing sinks or escapes.

use carom::{Column, Geometry, Planar, Settings, SolverKind, Spatial, World};
use carom_scenes::stage::Stage;
use carom_scenes::{dominoes, pouring, seven, stacking, striking};

/// Runs and returns the deepest overlap that any step began with \[m\].
fn run<S: Geometry>(world: &mut World<S>, duration: f64) -> f64 {
    let dt = world.settings().dt;
    let mut deepest = 0.0;
    for _ in 0..(duration / dt).round() as usize {
        let report = world.step(dt).expect("a healthy scene");
        deepest = f64::max(deepest, -report.deepest.map_or(0.0, |d| d.0));
    }
    deepest
}

fn top_speed<S: Geometry>(world: &World<S>) -> f64 {
    world.bodies().motion.velocity.iter().map(|v| v.norm()).fold(0.0, f64::max)
}

/// Largest distance between two sets of positions \[m\].
fn drift<V: Column>(from: &[V], to: &[V]) -> f64 {
    from.iter().zip(to).map(|(p, q)| (*q - *p).norm()).fold(0.0, f64::max)
}

/// How fast a stack of `count` boxes still moves after two seconds of fixed steps, and the residual of the solve that follows \[m/s\].
fn stacked<S: Stage>(count: usize, solver: Option<SolverKind>, iterations: usize) -> (f64, f64) {
    let mut world = stacking::stack::<S>(count, 1.0).expect("builds");
    let settings = world.settings().clone();
    let dt = settings.dt;
    world.set_settings(Settings { solver, iterations, ..settings }).expect("settings");
    let start = world.bodies().motion.position.clone();
    run(&mut world, 2.0);
    assert!(drift(&start, &world.bodies().motion.position) < 1e-2, "{count} boxes do not stand");
    // a contact that opens and is pressed again must not pay for the way it opened
    assert!(world.ledger().contact_normal <= 0.0, "contacts gave {} J", world.ledger().contact_normal);
    let speed = top_speed(&world);
    (speed, world.step(dt).expect("a healthy scene").contact_solve.expect("contacts").residual)
}

fn stack_comes_to_rest<S: Stage>(count: usize, solver: Option<SolverKind>, iterations: usize) {
    let (speed, _) = stacked::<S>(count, solver, iterations);
    assert!(speed < 1e-3, "{count} boxes of {solver:?}: {speed} m/s");
}

/// By the defaults of `Settings` above all: `pgs` leaves it to rounding whether boxes of space rest, from eight on.
#[test]
fn a_tall_stack_comes_to_rest_and_its_contacts_give_no_energy() {
    let (pgs, nncg) = (Some(SolverKind::Pgs), Some(SolverKind::Nncg));
    let iterations = Settings::<Spatial>::default().iterations;
    for count in 4..=10 {
        stack_comes_to_rest::<Planar>(count, None, iterations);
        stack_comes_to_rest::<Spatial>(count, None, iterations);
    }
    stack_comes_to_rest::<Planar>(10, pgs, 100);
    for count in 4..=7 {
        stack_comes_to_rest::<Spatial>(count, pgs, 100);
    }
    stack_comes_to_rest::<Spatial>(10, nncg, 200);
    stack_comes_to_rest::<Spatial>(10, Some(SolverKind::Exact), 100);
}

#[test]
fn a_stack_too_tall_for_its_sweeps_stands_and_is_told_of_while_it_sways() {
    for count in [8, 10, 12] {
        let (speed, residual) = stacked::<Spatial>(count, Some(SolverKind::Pgs), 100);
        let tolerance = Settings::<Spatial>::default().tolerance;
        assert!(speed < 1e-3 || residual > 10.0 * tolerance, "{count}: {speed} m/s, {residual} m/s");
    }
}

fn pyramid_stands<S: Stage>() {
    let mut world = stacking::pyramid::<S>(10).expect("builds");
    let start = world.bodies().motion.position.clone();
    let deepest = run(&mut world, 2.0);
    assert!(deepest < 1e-4, "overlap {deepest} m");
    assert!(drift(&start, &world.bodies().motion.position) < 1e-3);
    assert!(top_speed(&world) < 1e-3);
}

#[test]
fn a_pyramid_stands() {
    pyramid_stands::<Planar>();
    pyramid_stands::<Spatial>();
}

#[test]
fn a_house_of_cards_stands_with_friction_and_falls_with_too_little() {
    let mut stands = stacking::card_house(3, 0.6).expect("builds");
    let start = stands.bodies().motion.position.clone();
    run(&mut stands, 2.0);
    assert!(drift(&start, &stands.bodies().motion.position) < 1e-5);
    // a lean of 25 degrees asks for .233 at the foot
    let mut falls = stacking::card_house(3, 0.2).expect("builds");
    run(&mut falls, 1.0);
    let top = falls.index("deck2").expect("is there");
    assert!(falls.bodies().motion.position[top][1] < 0.5 * start[top][1]);
}

#[test]
fn dominoes_fall_to_the_last_one() {
    let count = 12;
    let mut world = dominoes::dominoes(count).expect("builds");
    run(&mut world, 1.2);
    for k in 0..count {
        let i = world.index(&format!("domino{k}")).expect("is there");
        let up = carom::Rotation::rotate(&world.bodies().motion.rotation[i], carom::vec3(0.0, 0.0, 1.0));
        assert!(up[2] < 0.7, "domino {k} still stands");
    }
}

#[test]
fn the_seven_objects_come_to_rest_between_their_walls() {
    let mut world = seven::seven_objects().expect("builds");
    let deepest = run(&mut world, 4.0);
    assert!(deepest < 2e-3, "overlap {deepest} m");
    assert!(top_speed(&world) < 1e-6, "still moves at {} m/s", top_speed(&world));
    assert!(world.bodies().motion.position[3..].iter().all(|x| x[0].abs() < 1.6 && x[1] > 0.0 && x[1] < 2.5));
}

fn break_spends_energy_and_keeps_the_balls(world: &mut World<impl Stage>, field: [f64; 2]) {
    let before = world.energy().kinetic();
    run(world, 1.0);
    let after = world.energy().kinetic();
    assert!(after < before && after > 0.0);
    let moving = world.bodies().motion.velocity.iter().filter(|v| v.norm() > 1e-3).count();
    assert!(moving >= 10, "{moving} of 16 balls move after the break");
    let inside = |x: &[f64]| (0..2).all(|k| x[k].abs() < 0.5 * field[k]);
    let bodies = world.bodies();
    assert!(
        (0..bodies.len())
            .filter(|&i| bodies.is_dynamic(i))
            .all(|i| inside(bodies.motion.position[i].as_slice()))
    );
}

#[test]
fn a_billiard_break_scatters_the_rack_and_leaves_it_on_the_table() {
    break_spends_energy_and_keeps_the_balls(
        &mut striking::billiard_break_planar().expect("builds"),
        [2.54, 1.27],
    );
    break_spends_energy_and_keeps_the_balls(
        &mut striking::billiard_break_spatial().expect("builds"),
        [2.54, 1.27],
    );
}

#[test]
fn a_mirrored_break_stays_mirrored_until_the_cushions() {
    let mut world = striking::billiard_break_planar().expect("builds");
    // .01 s after the cue ball has reached the rack
    run(&mut world, 0.22);
    let velocity = |name: &str| world.bodies().motion.velocity[world.index(name).expect(name)];
    for (one, other) in [("ball2", "ball3"), ("ball4", "ball6"), ("ball7", "ball10"), ("ball11", "ball15")] {
        let (p, q) = (velocity(one), velocity(other));
        assert!((p[0] - q[0]).abs() < 1e-4 && (p[1] + q[1]).abs() < 1e-4, "{one} {p:?}, {other} {q:?}");
    }
}

#[test]
fn a_poured_pile_stays_in_its_box_and_comes_to_rest() {
    let count = 60;
    let mut world = pouring::pile(count).expect("builds");
    let deepest = run(&mut world, 4.0);
    assert!(deepest < 0.03, "overlap {deepest} m of bodies .2 m wide");
    // balls, capsules and cylinders may roll for ever
    for k in (0..count).filter(|k| [0, 4, 5].contains(&(k % 6))) {
        let speed = world.bodies().motion.velocity[5 + k].norm();
        assert!(speed < 0.02, "body{k} still moves at {speed} m/s");
    }
    let half = 0.5 * 0.46 * 4.0;
    let at = &world.bodies().motion.position[5..];
    assert!(at.iter().all(|x| x[0].abs() < half && x[1].abs() < half && x[2] > 0.0 && x[2] < 2.0));
}

#[test]
fn every_contact_of_a_falling_pile_lies_where_both_bodies_are() {
    let mut world = pouring::pile(120).expect("builds");
    let dt = world.settings().dt;
    let mut seen = 0;
    while world.time() < 0.8 {
        let before = world.bodies().clone();
        world.step(dt).expect("a healthy scene");
        for touch in world.touches() {
            for i in [touch.a, touch.b] {
                let collider = before.data[i].collider.as_ref().expect("has a shape");
                // the point lies midway between the two surfaces
                let bounds = Spatial::bounds(collider, &before.shape_pose(i), 1e-6 + 0.5 * touch.gap.abs());
                let inside =
                    (0..3).all(|k| bounds.min[k] <= touch.point[k] && touch.point[k] <= bounds.max[k]);
                assert!(inside, "{} at {:?}, gap {}", before.names[i], touch.point, touch.gap);
                seen += 1;
            }
        }
    }
    assert!(seen > 1000);
}

#[test]
fn rocks_rest_on_a_mesh_as_on_the_heights_that_it_was_made_from() {
    let run_on = |terrain| {
        let mut world = pouring::rocks_on_terrain(12, terrain).expect("builds");
        let deepest = run(&mut world, 2.5);
        assert!(deepest < 0.05, "overlap {deepest} m of rocks .5 m wide");
        world
    };
    let (mesh, field) = (run_on(pouring::Terrain::Mesh), run_on(pouring::Terrain::HeightField));
    for world in [&mesh, &field] {
        assert!(world.bodies().motion.position[1..].iter().all(|x| x[2] > 0.0 && x[2] < 3.0));
        assert!(world.energy().kinetic() < 1e-2 * -world.ledger().impact_normal);
    }
    let height =
        |w: &World<Spatial>| w.bodies().motion.position[1..].iter().map(|x| x[2]).sum::<f64>() / 12.0;
    assert!((height(&mesh) - height(&field)).abs() < 0.1);
}
