//! What laws and stories share: one way to state a scene for the plane and for space, and to run it.
//! In both, `along` is the first horizontal axis and `up` the last axis; a scene in these words is planar, and in
//! space it is the same scene seen as a slice (y = 0). Knows no law.

#![allow(dead_code)] // each test binary uses its own part

pub mod scenes;

use carom::geometry::MassProperties;
use carom::{
    BodySpec, Column, Geometry, Inertia, Integrator, Ledger, Moment, Planar, PlanarPart, PlanarShape, Pose,
    Rotation, Settings, Space, Spatial, SpatialPart, SpatialShape, StepReport, Sym3, World, vec1, vec2, vec3,
};

/// Standard acceleration of gravity in the scenes \[m/s^2\].
pub const G: f64 = 9.81;

/// The plane and space, with words for scenes that mean the same in both.
pub trait Dimension: Geometry {
    /// The point at a distance along and up \[m\].
    fn at(along: f64, up: f64) -> Self::Vector;
    /// Distance along \[m\].
    fn along(v: Self::Vector) -> f64;
    /// Height \[m\].
    fn up(v: Self::Vector) -> f64;
    /// The spin that turns `along` towards `up` at a rate \[rad/s\].
    fn turn(rate: f64) -> Self::Spin;
    /// The rate at which a spin turns `along` towards `up`.
    fn rate(spin: Self::Spin) -> f64;
    /// A disc or a ball.
    fn ball(radius: f64) -> Self::Shape;
    /// A box of full width (all horizontal sides) and height.
    fn block(width: f64, height: f64) -> Self::Shape;
    /// Shapes at places, as one.
    fn joined(parts: Vec<(Self::Shape, Self::Vector)>) -> Self::Shape;
    /// A card: a plate of thickness and height whose edges are rounded by a radius more \[m\].
    fn card(thickness: f64, height: f64, radius: f64) -> Self::Shape;
    /// The half-plane or half-space below the origin.
    fn floor() -> Self::Shape;
    /// The half-plane or half-space behind an outward normal.
    fn wall(normal: Self::Vector) -> Self::Shape;
    /// The inside of a ball or a drum: everything farther from the origin.
    fn cavity(radius: f64) -> Self::Shape;
    /// Inertia with this moment about the scene's axis, possible in space as well.
    fn moment_of(moment: f64) -> Self::Inertia;
    /// Moment of inertia over m r^2 of the disc or ball.
    const ROUNDNESS: f64;
}

impl Dimension for Planar {
    fn at(along: f64, up: f64) -> Self::Vector {
        vec2(along, up)
    }
    fn along(v: Self::Vector) -> f64 {
        v[0]
    }
    fn up(v: Self::Vector) -> f64 {
        v[1]
    }
    fn turn(rate: f64) -> Self::Spin {
        vec1(rate)
    }
    fn rate(spin: Self::Spin) -> f64 {
        spin[0]
    }
    fn ball(radius: f64) -> Self::Shape {
        PlanarShape::Circle { radius }
    }
    fn block(width: f64, height: f64) -> Self::Shape {
        PlanarShape::Box { size: [width, height] }
    }
    fn joined(parts: Vec<(Self::Shape, Self::Vector)>) -> Self::Shape {
        let part = |(shape, at)| PlanarPart { pose: Pose::new(at, Rotation::IDENTITY), shape };
        PlanarShape::Compound { parts: parts.into_iter().map(part).collect() }
    }
    fn card(thickness: f64, height: f64, radius: f64) -> Self::Shape {
        PlanarShape::RoundBox { size: [thickness, height], radius }
    }
    fn floor() -> Self::Shape {
        Self::wall(vec2(0.0, 1.0))
    }
    fn wall(normal: Self::Vector) -> Self::Shape {
        PlanarShape::HalfPlane { normal }
    }
    fn cavity(radius: f64) -> Self::Shape {
        PlanarShape::Cavity { radius }
    }
    fn moment_of(moment: f64) -> Self::Inertia {
        Moment(moment)
    }
    const ROUNDNESS: f64 = 0.5;
}

impl Dimension for Spatial {
    fn at(along: f64, up: f64) -> Self::Vector {
        vec3(along, 0.0, up)
    }
    fn along(v: Self::Vector) -> f64 {
        v[0]
    }
    fn up(v: Self::Vector) -> f64 {
        v[2]
    }
    fn turn(rate: f64) -> Self::Spin {
        vec3(0.0, -rate, 0.0)
    }
    fn rate(spin: Self::Spin) -> f64 {
        -spin[1]
    }
    fn ball(radius: f64) -> Self::Shape {
        SpatialShape::Sphere { radius }
    }
    fn block(width: f64, height: f64) -> Self::Shape {
        SpatialShape::Box { size: [width, width, height] }
    }
    fn joined(parts: Vec<(Self::Shape, Self::Vector)>) -> Self::Shape {
        let part = |(shape, at)| SpatialPart { pose: Pose::new(at, Rotation::IDENTITY), shape };
        SpatialShape::Compound { parts: parts.into_iter().map(part).collect() }
    }
    fn card(thickness: f64, height: f64, radius: f64) -> Self::Shape {
        SpatialShape::RoundBox { size: [thickness, 0.6 * height, height], radius }
    }
    fn floor() -> Self::Shape {
        Self::wall(vec3(0.0, 0.0, 1.0))
    }
    fn wall(normal: Self::Vector) -> Self::Shape {
        SpatialShape::HalfSpace { normal }
    }
    fn cavity(radius: f64) -> Self::Shape {
        SpatialShape::Cavity { radius }
    }
    fn moment_of(moment: f64) -> Self::Inertia {
        Sym3::diag(moment, moment, moment)
    }
    const ROUNDNESS: f64 = 0.4;
}

/// The rotation that leans a body from `along` towards `up` by an angle \[rad\].
pub fn leaning<S: Dimension>(angle: f64) -> S::Rotation {
    S::Rotation::about(S::turn(angle))
}

/// Exact settings: contact solves to 1e-12 m/s, many iterations, the given step.
pub fn exact<S: Dimension>(dt: f64) -> Settings<S> {
    Settings { dt, tolerance: 1e-12, iterations: 20_000, ..Settings::default() }
}

/// The same without gravity.
pub fn weightless<S: Dimension>(dt: f64) -> Settings<S> {
    Settings { gravity: S::Vector::ZERO, ..exact(dt) }
}

/// A world with settings.
pub fn world<S: Dimension>(settings: Settings<S>) -> World<S> {
    World::new(settings).expect("the settings are possible")
}

/// Adds a body that is possible.
pub fn add<S: Dimension>(world: &mut World<S>, name: &str, spec: BodySpec<S>) -> usize {
    world.add(name, spec).unwrap_or_else(|e| panic!("{e}"))
}

/// Adds the floor.
pub fn add_floor<S: Dimension>(world: &mut World<S>, friction: f64, restitution: f64) -> usize {
    add(world, "floor", BodySpec::fixed(S::floor()).friction(friction).restitution(restitution))
}

/// One step of the settings' length that must succeed.
pub fn step<S: Dimension>(world: &mut World<S>) -> StepReport<S> {
    let dt = world.settings().dt;
    world.step(dt).unwrap_or_else(|e| panic!("{e}"))
}

/// Runs for a time \[s\], rounded to whole steps; `watch` sees the world after every step.
pub fn run<S: Dimension>(world: &mut World<S>, time: f64, mut watch: impl FnMut(&World<S>, &StepReport<S>)) {
    let steps = (time / world.settings().dt).round() as usize;
    for _ in 0..steps {
        let report = step(world);
        watch(world, &report);
    }
}

/// Runs for a time without watching.
pub fn settle<S: Dimension>(world: &mut World<S>, time: f64) {
    run(world, time, |_, _| ());
}

/// A body of given mass and moment, with or without a shape.
pub fn body_of<S: Dimension>(shape: Option<S::Shape>, mass: f64, moment: f64) -> BodySpec<S> {
    let inertia = S::moment_of(moment);
    BodySpec::given(shape, MassProperties { mass, center: S::Vector::ZERO, inertia, error: 0.0 })
}

/// Velocity of a body along.
pub fn speed<S: Dimension>(world: &World<S>, body: usize) -> f64 {
    S::along(world.bodies().motion.velocity[body])
}

/// Height of a body \[m\].
pub fn height<S: Dimension>(world: &World<S>, body: usize) -> f64 {
    S::up(world.bodies().motion.position[body])
}

/// Normal impulse over the last step's length between two bodies, in either order \[N\].
pub fn normal_force<S: Dimension>(world: &World<S>, one: usize, other: usize) -> f64 {
    let (problem, impulses, _) = world.last_problem();
    let pair = |a: usize, b: usize| (a == one && b == other) || (a == other && b == one);
    let all = problem.contacts.iter().zip(&impulses.contacts);
    all.filter(|(c, _)| pair(c.a, c.b)).map(|(_, g)| g.normal).sum::<f64>() / world.settings().dt
}

/// Bits of a motion: equal only when every number is the same to the last bit.
pub fn bits<S: Dimension>(world: &World<S>) -> Vec<u64> {
    let m = &world.bodies().motion;
    let columns = m.position.iter().chain(&m.velocity).flat_map(|v| v.as_slice().to_vec());
    let spins = m.angular_velocity.iter().flat_map(|w| w.as_slice().to_vec());
    let turns = m.rotation.iter().flat_map(|q| q.as_slice().to_vec());
    columns.chain(spins).chain(turns).map(f64::to_bits).collect()
}

/// Largest absolute line of a ledger, against which its closure is measured \[J\].
pub fn largest_line(ledger: &Ledger) -> f64 {
    ledger.lines()[..14].iter().fold(0.0, |m: f64, x| m.max(x.abs()))
}

/// Angle between two rotations \[rad\].
pub fn angle_between<S: Space>(a: &S::Rotation, b: &S::Rotation) -> f64 {
    a.inverse().then(b).vector().norm()
}

/// A value within an absolute tolerance of what is wanted; says what it measured, also when it is within.
#[track_caller]
pub fn close(got: f64, wanted: f64, tolerance: f64, what: &str) {
    let off = got - wanted;
    println!("measured: {what}: {got:.12} for {wanted:.12}, off by {off:.1e} of {tolerance:.1e}");
    assert!(
        off.abs() <= tolerance,
        "{what}: got {got:.12}, wanted {wanted:.12} within {tolerance:.1e}, off by {off:.1e}"
    );
}

/// A non-negative measure that must not exceed a bound.
#[track_caller]
pub fn at_most(got: f64, bound: f64, what: &str) {
    println!("measured: {what}: {got:.2e} of at most {bound:.1e}");
    assert!(got <= bound, "{what}: got {got:.3e}, wanted at most {bound:.1e}");
}

/// Deterministic numbers in [0, 1): SplitMix64, for scenes that need disorder.
pub struct Dice(pub u64);

impl Dice {
    /// The next number in [0, 1).
    pub fn roll(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64
    }
    /// The next number in [low, high).
    pub fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.roll()
    }
}

/// True when this integrator keeps the free flight under gravity exact.
pub fn flies_exactly(integrator: Integrator) -> bool {
    !matches!(integrator, Integrator::ExplicitEuler | Integrator::SemiImplicitEuler)
}

/// True when an inertia is that of nothing that turns.
pub fn is_zero<S: Space>(inertia: &S::Inertia) -> bool {
    *inertia == S::Inertia::ZERO
}

/// Makes each generic law a test in the plane and one in space.
#[macro_export]
macro_rules! in_plane_and_space {
    ($($name:ident),* $(,)?) => {
        mod in_the_plane { $( #[test] fn $name() { super::$name::<carom::Planar>() } )* }
        mod in_space { $( #[test] fn $name() { super::$name::<carom::Spatial>() } )* }
    };
}
