//! The tasks of SimBenchmark (ETH Zurich, 2018), with the parameters of its published description: rolling, bouncing,
//! and cubes of balls, dropped softly or elastic. What their errors are measured against is here too; measuring is
//! not.

use crate::chance::Chance;
use carom::{BodySpec, BuildError, Motion, Settings, Spatial, SpatialShape, Vec3, World3, Wrench, vec3};

/// Gravity in the benchmark \[m/s^2\].
pub const GRAVITY: f64 = 9.81;

/// Rolling: mass of the box \[kg\].
pub const BOX_MASS: f64 = 10.0;
/// Rolling: balls on the box \[1\], each of 1 kg.
pub const BALLS: usize = 25;
/// Rolling: horizontal force on the box \[N\].
pub const FORCE: f64 = 150.0;
/// Rolling: overlap that the scene is given with: once between ground and box, twice between box and balls \[m\].
pub const OVERLAP: f64 = 2e-5;
/// Rolling: friction of ground and box, box and balls, ground and balls \[1\].
pub const FRICTION: [f64; 3] = [0.4, 0.8, 0.5];

/// Bouncing: balls side by side \[1\].
pub const BOUNCING: usize = 49;
/// Bouncing and cubes: radius of a ball \[m\].
pub const RADIUS: f64 = 0.1;
/// Bouncing and cubes: mass of a ball \[kg\].
pub const MASS: f64 = 10.0;
/// Bouncing: height of the centres at the start \[m\].
pub const HEIGHT: f64 = 5.0;

/// Cubes: distance of the balls' centres before they are perturbed \[m\].
pub const PITCH: f64 = 0.21;
/// Cubes: largest perturbation of each coordinate \[m\].
pub const PERTURBATION: f64 = 1e-3;

/// Accelerations of box and balls in rolling \[m/s^2\]: the box slides on the ground, the balls roll on it without
/// slip, so that each follows with 2/7 of the box's acceleration.
pub fn accelerations() -> [f64; 2] {
    let balls = BALLS as f64;
    let push = FORCE - FRICTION[0] * (BOX_MASS + balls) * GRAVITY;
    let of_box = push / (BOX_MASS + 2.0 / 7.0 * balls);
    [of_box, 2.0 / 7.0 * of_box]
}

/// Energy that removing the given overlap of rolling costs \[J\]: the box rises by it, the balls by thrice.
pub fn given_overlap_energy() -> f64 {
    GRAVITY * OVERLAP * (BOX_MASS + 3.0 * BALLS as f64)
}

/// Height of a bouncing ball's centre at a time \[s\] since it was let go \[m\], without loss.
pub fn bouncing_height(time: f64) -> f64 {
    let fall = HEIGHT - RADIUS;
    let down = (2.0 * fall / GRAVITY).sqrt();
    // time since the last apex, negative on the way up to it
    let since = (time + down).rem_euclid(2.0 * down) - down;
    HEIGHT - 0.5 * GRAVITY * since * since
}

fn ground() -> BodySpec<Spatial> {
    BodySpec::fixed(SpatialShape::HalfSpace { normal: vec3(0.0, 0.0, 1.0) }).restitution(0.0)
}

/// A box that is pulled along a horizontal unit direction and slides on the ground, and 25 balls that roll on it.
/// Bodies: "ground", "box", "ball0" to "ball24". Friction must be mixed geometrically, the default: bodies have the
/// coefficients (.25, .64, 1) whose means of pairs are the benchmark's.
///
/// # Errors
/// [`BuildError`] for settings out of range.
pub fn rolling(direction: Vec3, settings: Settings<Spatial>) -> Result<World3, BuildError> {
    let [ground_box, box_ball, ground_ball] = FRICTION.map(|f| f * f);
    let of_ground = (ground_box * ground_ball / box_ball).sqrt();
    let mut world = World3::new(settings)?;
    world.add("ground", ground().friction(of_ground))?;
    let slab = BodySpec::heavy(SpatialShape::Box { size: [20.0, 20.0, 1.0] }, BOX_MASS);
    let slab = slab.at(vec3(0.0, 0.0, 0.5 - OVERLAP)).friction(ground_box / of_ground);
    let pulled = world.add("box", slab.restitution(0.0))?;
    for k in 0..BALLS {
        let place = |n: usize| 2.0 * n as f64 - 4.0;
        let ball = BodySpec::heavy(SpatialShape::Sphere { radius: 0.5 }, 1.0)
            .at(vec3(place(k / 5), place(k % 5), 1.5 - 3.0 * OVERLAP))
            .friction(ground_ball / of_ground)
            .restitution(0.0);
        world.add(&format!("ball{k}"), ball)?;
    }
    let pull = move |_: f64, _: &Motion<Spatial>, out: &mut [Wrench<Spatial>]| {
        out[pulled].force += direction * FORCE;
    };
    world.set_force_field("pull", Box::new(pull));
    Ok(world)
}

fn ball(place: Vec3, restitution: f64) -> BodySpec<Spatial> {
    let ball = BodySpec::heavy(SpatialShape::Sphere { radius: RADIUS }, MASS);
    ball.at(place).friction(0.0).restitution(restitution)
}

/// Elastic balls without friction, 7 by 7 a metre apart, let go at 5 m. Bodies: "ground", "ball0" to "ball48".
///
/// # Errors
/// [`BuildError`] for settings out of range.
pub fn bouncing(settings: Settings<Spatial>) -> Result<World3, BuildError> {
    let mut world = World3::new(settings)?;
    world.add("ground", ground().friction(0.0))?;
    for k in 0..BOUNCING {
        let place = vec3((k % 7) as f64, (k / 7) as f64, HEIGHT);
        world.add(&format!("ball{k}"), ball(place, 1.0))?;
    }
    Ok(world)
}

/// A cube of `side`^3 perturbed balls without friction above the ground; the lowest centres are at `lowest` \[m\] and
/// up to a millimetre above. The benchmark has side 6, with .101 m and restitution 0, or 1.101 m and 1. Bodies:
/// "ground", "ball0" and so on.
///
/// # Errors
/// [`BuildError`] for settings out of range, or a restitution outside \[0, 1\].
pub fn cube(
    side: usize,
    lowest: f64,
    restitution: f64,
    settings: Settings<Spatial>,
) -> Result<World3, BuildError> {
    let mut chance = Chance::new(666);
    let mut world = World3::new(settings)?;
    world.add("ground", ground().friction(0.0))?;
    for k in 0..side.pow(3) {
        let place = [k % side, k / side % side, k / side / side];
        let [x, y, z] = place.map(|n| PITCH * n as f64 + chance.between(0.0, PERTURBATION));
        world.add(&format!("ball{k}"), ball(vec3(x, y, z + lowest), restitution))?;
    }
    Ok(world)
}

/// Overlap of balls of one radius \[m\] among themselves and with the ground: the sum of squares \[m^2\], from the
/// places alone.
pub fn squared_overlap(centres: &[Vec3], radius: f64) -> f64 {
    let squared = |gap: f64| gap.min(0.0).powi(2);
    let mut sum = 0.0;
    for (k, a) in centres.iter().enumerate() {
        sum += squared(a[2] - radius);
        for b in &centres[k + 1..] {
            let between = *a - *b;
            let distance = between[0] * between[0] + between[1] * between[1] + between[2] * between[2];
            if distance < 4.0 * radius * radius {
                sum += squared(distance.sqrt() - 2.0 * radius);
            }
        }
    }
    sum
}
