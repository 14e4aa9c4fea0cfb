//! A scene as plain data in f64, written once for all engines: bodies with shapes, poses, densities and velocities. Knows no
//! engine and takes no step.

use carom::{Column, Geometry, Pose, Rotation, Space};
use carom_scenes::stage::Stage;

/// Length of a step \[s\].
pub const DT: f64 = 1.0 / 60.0;
/// Gravity along the last axis, downwards \[m/s^2\].
pub const GRAVITY: f64 = 10.0;
/// Friction of every body \[1\].
pub const FRICTION: f64 = 0.6;

/// How a body takes part.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// Moved by forces.
    Dynamic,
    /// Never moves.
    Fixed,
    /// Keeps the velocity it is given.
    Kinematic,
}

/// One body.
#[derive(Clone, Debug)]
pub struct Body<S: Geometry> {
    /// How it takes part.
    pub kind: Kind,
    /// Its shape; a compound for several in one.
    pub shape: S::Shape,
    /// Pose of the shape's frame at the start.
    pub pose: Pose<S>,
    /// Velocity at the start \[m/s\].
    pub velocity: S::Vector,
    /// Angular velocity at the start \[rad/s\].
    pub spin: S::Spin,
    /// Density \[kg/m^DIM\].
    pub density: f64,
}

impl<S: Geometry> Body<S> {
    /// A body of density 1000 at rest.
    pub fn new(kind: Kind, shape: S::Shape, position: S::Vector) -> Self {
        let pose = Pose::new(position, S::Rotation::IDENTITY);
        Body { kind, shape, pose, velocity: S::Vector::ZERO, spin: S::Spin::ZERO, density: 1000.0 }
    }
    /// The same body, turned.
    pub fn turned(mut self, rotation: S::Rotation) -> Self {
        self.pose.rotation = rotation;
        self
    }
    /// The same body, moving at a velocity \[m/s\].
    pub fn moving(mut self, velocity: S::Vector) -> Self {
        self.velocity = velocity;
        self
    }
    /// The same body, turning at an angular velocity \[rad/s\].
    pub fn spinning(mut self, spin: S::Spin) -> Self {
        self.spin = spin;
        self
    }
    /// The same body with another density \[kg/m^DIM\].
    pub fn dense(mut self, density: f64) -> Self {
        self.density = density;
        self
    }
}

/// What the judge may ask of a scene; columns that a scene does not answer are NaN.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Asks {
    /// Bodies should stay where they are: drift and speed at the end mean something.
    pub rests: bool,
    /// Nothing feeds energy in: gains mean something.
    pub closed: bool,
    /// Bodies should slide straight on: the direction means something.
    pub slides: bool,
}

/// A scene.
#[derive(Clone, Debug)]
pub struct Scene<S: Geometry> {
    /// Its name with its size, as `pyramid:100`.
    pub name: String,
    /// Steps of a run.
    pub steps: usize,
    /// The bodies.
    pub bodies: Vec<Body<S>>,
    /// What it may be judged by.
    pub asks: Asks,
}

impl<S: Geometry> Scene<S> {
    /// Bodies that forces move.
    pub fn moving(&self) -> usize {
        self.bodies.iter().filter(|b| b.kind == Kind::Dynamic).count()
    }
    /// The gravity vector \[m/s^2\].
    pub fn gravity() -> S::Vector {
        S::Vector::from_fn(|k| if k + 1 == S::DIM { -GRAVITY } else { 0.0 })
    }
}

/// What scenes of the race ask of a space beyond a stage: depth, and compounds.
pub trait Arena: Stage {
    /// A point \[m\]; the plane has no depth.
    fn spot(along: f64, up: f64, deep: f64) -> Self::Vector;
    /// Several shapes in one body, each at its pose.
    fn joined(parts: Vec<(Pose<Self>, Self::Shape)>) -> Self::Shape;
    /// The shapes that make up one, each at its pose: the parts of a compound, or the shape itself.
    fn parts(shape: &Self::Shape) -> Vec<(Pose<Self>, &Self::Shape)>;
    /// Layers that a scene of so many has in depth: one in the plane.
    fn layers(count: usize) -> usize {
        if Self::DIM == 2 { 1 } else { count }
    }
}

impl Arena for carom::Planar {
    fn spot(along: f64, up: f64, _: f64) -> Self::Vector {
        carom::vec2(along, up)
    }
    fn joined(parts: Vec<(Pose<Self>, Self::Shape)>) -> Self::Shape {
        let parts = parts.into_iter().map(|(pose, shape)| carom::geometry::PlanarPart { pose, shape });
        carom::PlanarShape::Compound { parts: parts.collect() }
    }
    fn parts(shape: &Self::Shape) -> Vec<(Pose<Self>, &Self::Shape)> {
        match shape {
            carom::PlanarShape::Compound { parts } => parts.iter().map(|p| (p.pose, &p.shape)).collect(),
            one => vec![(Pose::default(), one)],
        }
    }
}

impl Arena for carom::Spatial {
    fn spot(along: f64, up: f64, deep: f64) -> Self::Vector {
        carom::vec3(along, deep, up)
    }
    fn joined(parts: Vec<(Pose<Self>, Self::Shape)>) -> Self::Shape {
        let parts = parts.into_iter().map(|(pose, shape)| carom::geometry::SpatialPart { pose, shape });
        carom::SpatialShape::Compound { parts: parts.collect() }
    }
    fn parts(shape: &Self::Shape) -> Vec<(Pose<Self>, &Self::Shape)> {
        match shape {
            carom::SpatialShape::Compound { parts } => parts.iter().map(|p| (p.pose, &p.shape)).collect(),
            one => vec![(Pose::default(), one)],
        }
    }
}

/// Whether every number of a space's pose is finite.
pub fn finite<S: Space>(pose: &Pose<S>) -> bool {
    pose.position.is_finite() && pose.rotation.is_finite()
}
