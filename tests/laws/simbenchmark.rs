//! Laws of the scheme `events` on the tasks of SimBenchmark, short versions: energies, places and overlaps are held
//! to what a closed form says, and each beside the others, for energy alone proves nothing.

use carom::{Column, Scheme, Settings, Spatial, World3, vec3};
use carom_scenes::simbenchmark as scenes;

fn events(dt: f64) -> Settings<Spatial> {
    Settings { dt, scheme: Scheme::Events, ..Settings::default() }
}

/// Takes steps up to a time \[s\]; before each, tells the time and the world.
fn run(world: &mut World3, duration: f64, mut sample: impl FnMut(f64, &World3)) {
    let dt = world.settings().dt;
    for k in 0..(duration / dt).round() as usize {
        sample(k as f64 * dt, world);
        world.step(dt).expect("a step of a benchmark");
    }
    let closure = world.ledger().closure.abs();
    let scale = world.energy().total();
    assert!(closure <= 1e-12 * scale, "the books are open by {closure:e} J of {scale} J");
}

fn elastic_balls_come_back_to_their_height(dt: f64) {
    let mut world = scenes::bouncing(events(dt)).expect("the scene");
    let first = world.energy().total();
    assert!((first - 24034.5).abs() < 1e-9, "the published energy at the start, not {first} J");
    run(&mut world, 8.0, |time, world| {
        let off = world.energy().total() - first;
        // rounding of 49 balls with 490 J each
        assert!(off * off <= 1e-15, "at {time} s the energy is off by {off:e} J");
        let height = scenes::bouncing_height(time);
        for x in &world.bodies().motion.position[1..] {
            assert!((x[2] - height).abs() <= 1e-9, "at {time} s a ball is at {}, not {height}", x[2]);
        }
    });
}

#[test]
fn elastic_balls_keep_energy_and_place_at_a_hundred_steps_a_second() {
    elastic_balls_come_back_to_their_height(1e-2);
}

#[test]
fn elastic_balls_keep_energy_and_place_at_ten_steps_a_second() {
    elastic_balls_come_back_to_their_height(1e-1);
}

#[test]
fn balls_roll_on_a_sliding_box_with_the_exact_acceleration_in_both_directions() {
    for direction in [vec3(0.5, 0.75_f64.sqrt(), 0.0), vec3(0.0, 1.0, 0.0)] {
        let mut world = scenes::rolling(direction, events(1e-2)).expect("the scene");
        let (mut error, mut samples) = (0.0, 0.0);
        run(&mut world, 0.2, |time, world| {
            for (body, acceleration) in [1, 2].into_iter().zip(scenes::accelerations()) {
                let off = world.bodies().motion.velocity[body] - direction * (acceleration * time);
                error += off.norm_squared();
            }
            samples += 1.0;
        });
        assert!(error / samples <= 1e-20, "mean squared error {:e} along {direction:?}", error / samples);
        // projection removes the given overlap, and nothing else
        let projected = world.ledger().projection - scenes::given_overlap_energy();
        assert!(projected.abs() <= 1e-6, "projection made {projected:e} J beyond the given overlap");
    }
}

#[test]
fn rolling_mixes_friction_to_the_benchmarks_pairs() {
    let world = scenes::rolling(vec3(1.0, 0.0, 0.0), events(1e-2)).expect("the scene");
    let mix = world.settings().friction_mixing;
    let of = |a: usize, b: usize| mix.mix(world.bodies().data[a].friction, world.bodies().data[b].friction);
    for (got, wanted) in [of(0, 1), of(1, 2), of(0, 2)].into_iter().zip(scenes::FRICTION) {
        assert!((got - wanted).abs() <= 1e-15, "{got} instead of {wanted}");
    }
}

#[test]
fn a_cube_of_elastic_balls_keeps_its_energy_and_never_overlaps() {
    let mut settings = events(1e-2);
    settings.events.tolerance = 1e-8;
    let mut world = scenes::cube(3, 1.101, 1.0, settings).expect("the scene");
    let first = world.energy().total();
    let (mut error, mut overlap, mut samples) = (0.0, 0.0, 0.0);
    run(&mut world, 4.0, |_, world| {
        error += (world.energy().total() - first).powi(2);
        overlap += scenes::squared_overlap(&world.bodies().motion.position[1..], scenes::RADIUS);
        samples += 1.0;
    });
    assert!(error / samples <= 1e-15, "mean squared error of the energy {:e} J^2", error / samples);
    assert!(overlap / samples <= 1e-20, "mean sum of squared overlaps {:e} m^2", overlap / samples);
}
