//! Scenes with closed-form answers reach them, to what the fixed step of each scene allows.

use carom::{Column, Planar, Rotation, Spatial, World, vec3};
use carom_scenes::stage::Stage;
use carom_scenes::{constrained, falling, sliding, spinning, stacking, striking};

const GRAVITY: f64 = 9.81;

fn run<S: Stage>(world: &mut World<S>, duration: f64) {
    let dt = world.settings().dt;
    for _ in 0..(duration / dt).round() as usize {
        world.step(dt).expect("a healthy scene");
    }
}

fn place<S: Stage>(world: &World<S>, name: &str) -> S::Vector {
    world.bodies().motion.position[world.index(name).expect(name)]
}

fn velocity<S: Stage>(world: &World<S>, name: &str) -> S::Vector {
    world.bodies().motion.velocity[world.index(name).expect(name)]
}

fn assert_near(found: f64, right: f64, tolerance: f64) {
    assert!((found - right).abs() <= tolerance, "found {found}, right is {right} +- {tolerance}");
}

fn block_stops_where_friction_says<S: Stage>() {
    let mut world = sliding::sliding_block::<S>(5.0, 0.5).expect("builds");
    run(&mut world, 2.0);
    // the step in which it stops costs up to mu g h^2/8
    assert_near(place(&world, "block")[0], 25.0 / GRAVITY, 1.1e-5);
    assert_near(velocity(&world, "block").norm(), 0.0, 1e-12);
}

#[test]
fn a_sliding_block_stops_where_friction_says() {
    block_stops_where_friction_says::<Planar>();
    block_stops_where_friction_says::<Spatial>();
}

fn ball_ends_rolling_at<S: Stage>(share: f64) {
    let mut world = sliding::rolling_ball::<S>(5.0, 0.2).expect("builds");
    run(&mut world, 3.0);
    let m = &world.bodies().motion;
    assert_near(velocity(&world, "ball")[0], share * 5.0, 1e-9);
    assert_near(m.angular_velocity[1].norm() * 0.25, share * 5.0, 1e-9);
}

#[test]
fn a_sliding_ball_ends_rolling_at_the_known_share_of_its_speed() {
    ball_ends_rolling_at::<Planar>(2.0 / 3.0);
    ball_ends_rolling_at::<Spatial>(5.0 / 7.0);
}

fn incline_holds_one_and_loses_one<S: Stage>() {
    let (angle, frictions) = (std::f64::consts::FRAC_PI_6, [0.58, 0.57]);
    let mut world = sliding::incline::<S>(angle, frictions).expect("builds");
    let (held, slid) = (place(&world, "holds"), place(&world, "slides"));
    run(&mut world, 3.0);
    assert_near((place(&world, "holds") - held).norm(), 0.0, 1e-6);
    let [c, s] = carom::Turn::from_angle(angle).0;
    let acceleration = GRAVITY * (s - frictions[1] * c);
    assert_near((place(&world, "slides") - slid).norm(), 0.5 * acceleration * 9.0, 5e-5);
}

#[test]
fn friction_above_the_tangent_of_the_slope_holds_and_below_it_slides() {
    incline_holds_one_and_loses_one::<Planar>();
    incline_holds_one_and_loses_one::<Spatial>();
}

fn belt_drags<S: Stage>() {
    let mut world = sliding::conveyor::<S>(2.0, 0.4).expect("builds");
    run(&mut world, 2.0);
    // it lags behind by v^2/(2 mu g)
    let lag = place(&world, "belt")[0] - place(&world, "block")[0];
    assert_near(lag, 4.0 / (2.0 * 0.4 * GRAVITY), 1e-5);
    assert_near(velocity(&world, "block")[0], 2.0, 1e-12);
}

#[test]
fn a_belt_drags_a_block_to_its_own_speed() {
    belt_drags::<Planar>();
    belt_drags::<Spatial>();
}

fn apexes_fall_by_restitution_squared<S: Stage>() {
    let mut world = falling::bouncing_ball::<S>(1.0, 0.8).expect("builds");
    let dt = world.settings().dt;
    let (mut heights, mut last, mut rising) = (Vec::new(), f64::INFINITY, false);
    while heights.len() < 3 {
        world.step(dt).expect("a healthy scene");
        let height = place(&world, "ball")[S::DIM - 1] - falling::RADIUS;
        if rising && height < last {
            heights.push(last);
        }
        rising = height > last;
        last = height;
    }
    for (n, height) in heights.iter().enumerate() {
        // each impact is seen up to h |u| too deep, and the apex between two steps
        assert_near(*height, 0.64_f64.powi(n as i32 + 1), 0.025);
    }
}

#[test]
fn apexes_of_a_bouncing_ball_fall_by_restitution_squared() {
    apexes_fall_by_restitution_squared::<Planar>();
    apexes_fall_by_restitution_squared::<Spatial>();
}

fn wedge_and_block_part<S: Stage>() {
    let mut world = constrained::wedge::<S>(std::f64::consts::FRAC_PI_6).expect("builds");
    run(&mut world, 0.5);
    assert_near(velocity(&world, "wedge")[0], 0.5 * 1.307_032_0, 1e-5);
    assert_near((velocity(&world, "block") - velocity(&world, "wedge")).norm(), 0.5 * 6.036_923, 1e-5);
}

#[test]
fn a_wedge_slides_away_under_a_block_as_fast_as_the_closed_form_says() {
    wedge_and_block_part::<Planar>();
    wedge_and_block_part::<Spatial>();
}

/// Mean time of a swing, from the moments when the ball passes the bottom.
fn swing_time<S: Stage>(mut world: World<S>) -> f64 {
    let dt = world.settings().dt;
    let (mut passes, mut last) = (Vec::new(), place(&world, "ball")[0]);
    while passes.len() < 5 {
        world.step(dt).expect("a healthy scene");
        let x = place(&world, "ball")[0];
        if x * last < 0.0 {
            passes.push(world.time() - dt * x / (x - last));
        }
        last = x;
    }
    0.5 * (passes[4] - passes[0])
}

#[test]
fn a_ball_swings_in_a_bowl_in_the_known_time() {
    // amplitude a lengthens a swing by about a^2/16, here .25 %
    assert_near(swing_time(constrained::bowl_planar(0.2).expect("builds")), 2.330_839, 0.01 * 2.330_839);
    assert_near(swing_time(constrained::bowl_spatial(0.2).expect("builds")), 2.251_804, 0.01 * 2.251_804);
}

#[test]
fn the_legs_of_a_table_carry_its_weight_and_its_moments() {
    let (load, x, y) = (8.0, 0.3, 0.1);
    let mut world = constrained::four_leg_table(load, x, y).expect("builds");
    run(&mut world, 0.5);
    let dt = world.settings().dt;
    let (problem, impulses, _) = world.last_problem();
    let (mut force, mut moment) = (0.0, [0.0; 2]);
    for (contact, impulse) in
        problem.contacts.iter().zip(&impulses.contacts).filter(|(c, _)| c.a == 0 || c.b == 0)
    {
        let table = world.index("table").expect("is there");
        let arm = if contact.a == table { contact.arm_a } else { contact.arm_b };
        let point = arm + place(&world, "table");
        let up = contact.to_world(impulse)[2].abs() / dt;
        force += up;
        moment = [moment[0] + up * point[0], moment[1] + up * point[1]];
    }
    assert_near(force, 12.0 * GRAVITY, 1e-6);
    assert_near(moment[0], load * GRAVITY * x, 1e-6);
    assert_near(moment[1], load * GRAVITY * y, 1e-6);
}

#[test]
fn a_top_precesses_at_the_known_rate() {
    let mut world = spinning::free_top().expect("builds");
    let spin = |w: &World<Spatial>| w.bodies().motion.angular_velocity[0];
    let momentum = vec3(0.5 * 0.3, 0.0, 0.8 * 5.0).normalized().expect("not zero");
    let across = spin(&world) - momentum * momentum.dot(spin(&world));
    let turn = 2.0 * std::f64::consts::PI / 8.005_623_023_850;
    world.set_settings(carom::Settings { dt: turn / 200.0, ..world.settings().clone() }).expect("in range");
    run(&mut world, turn);
    // after one turn of the axis the spin is back
    let again = spin(&world) - momentum * momentum.dot(spin(&world));
    assert_near((again - across).norm() / across.norm(), 0.0, 2e-4);
    run(&mut world, 0.5 * turn);
    let half = spin(&world) - momentum * momentum.dot(spin(&world));
    assert_near((half + across).norm() / across.norm(), 0.0, 4e-4);
}

#[test]
fn a_handle_spun_about_its_intermediate_axis_flips() {
    let mut world = spinning::dzhanibekov().expect("builds");
    let dt = world.settings().dt;
    let (mut flips, mut side) = (0, 1.0);
    let energy = world.energy().total();
    let momentum = world.momenta().angular;
    while world.time() < 20.0 {
        world.step(dt).expect("a healthy scene");
        let ahead = world.bodies().motion.rotation[0].rotate(vec3(1.0, 0.0, 0.0))[0];
        if ahead * side < -0.5 {
            flips += 1;
            side = -side;
        }
    }
    assert!(flips >= 3, "{flips} flips in 20 s");
    assert_near(world.energy().total() / energy, 1.0, 1e-6);
    assert_near((world.momenta().angular - momentum).norm() / momentum.norm(), 0.0, 1e-12);
}

fn last_ball_alone_leaves<S: Stage>() {
    let mut world = striking::cradle::<S>(5).expect("builds");
    run(&mut world, 0.4);
    for k in 0..5 {
        let right = if k == 4 { 1.0 } else { 0.0 };
        assert_near(velocity(&world, &format!("ball{k}"))[0], right, 1e-12);
    }
    // in, out, back from the wall at .75 s, and the first one is driven out
    run(&mut world, 0.5);
    assert_near(velocity(&world, "ball0")[0], -1.0, 1e-12);
}

#[test]
fn a_blow_passes_through_the_cradle_to_its_last_ball() {
    last_ball_alone_leaves::<Planar>();
    last_ball_alone_leaves::<Spatial>();
}

fn interfaces_carry_what_stands_on_them<S: Stage>() {
    let mut world = stacking::stack::<S>(5, 1.0).expect("builds");
    world
        .set_settings(carom::Settings { iterations: 4000, tolerance: 1e-9, ..world.settings().clone() })
        .expect("ok");
    run(&mut world, 0.2);
    let dt = world.settings().dt;
    let (problem, impulses, _) = world.last_problem();
    for k in 0..5 {
        // body 0 is the floor, body k + 1 the k-th box; each interface joins k and k + 1
        let pairs = problem.contacts.iter().zip(&impulses.contacts);
        let force: f64 = pairs
            .filter(|(c, _)| c.a.min(c.b) == k && c.a.max(c.b) == k + 1)
            .map(|(_, g)| g.normal / dt)
            .sum();
        let weight = (5 - k) as f64 * 1000.0 * GRAVITY;
        assert_near(force / weight, 1.0, 1e-6);
    }
}

#[test]
fn each_interface_of_a_stack_carries_the_weight_above_it() {
    interfaces_carry_what_stands_on_them::<Planar>();
    interfaces_carry_what_stands_on_them::<Spatial>();
}
