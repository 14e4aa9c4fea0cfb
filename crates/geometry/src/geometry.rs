//! The trait behind which all shape work happens: what the world may ask of the plane's and of space's
//! geometry. Nothing outside this crate names the library that answers.

use crate::mass::MassProperties;
use carom_math::{Pose, Space};
use serde::{Serialize, de::DeserializeOwned};
use std::fmt::Debug;

/// Why a shape was refused: which field, what it was, what helps.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{field}: {problem}; {remedy}")]
pub struct ShapeError {
    /// Field of the shape, e.g. `radius` or `parts[2].size`.
    pub field: String,
    /// What is wrong, with the value.
    pub problem: String,
    /// What to do about it.
    pub remedy: String,
}

impl ShapeError {
    /// An error from its three parts.
    pub fn new(field: impl Into<String>, problem: impl Into<String>, remedy: impl Into<String>) -> Self {
        ShapeError { field: field.into(), problem: problem.into(), remedy: remedy.into() }
    }
}

/// One point of contact between two shapes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ContactPoint<S: Space> {
    /// Names the point within its pair, the same from step to step while the features touch.
    pub feature: u64,
    /// The one point both bodies use, midway between the two surfaces \[m\], world axes.
    pub point: S::Vector,
    /// Unit normal from b to a, world axes.
    pub normal: S::Vector,
    /// Distance between the surfaces along the normal \[m\]; negative when they overlap.
    pub gap: f64,
    /// Curvature with which the surfaces bend toward each other \[1/m\]: s along a straight way the gap is at least what
    /// the normal says of it less half of this times s^2. 0 between convex shapes, which bend away.
    pub curvature: f64,
}

/// Axis-aligned box in the world.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Aabb<S: Space> {
    /// Smallest coordinates \[m\].
    pub min: S::Vector,
    /// Largest coordinates \[m\].
    pub max: S::Vector,
}

/// What a ray hit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RayHit<S: Space> {
    /// Distance along the unit direction \[m\].
    pub distance: f64,
    /// Outward surface normal at the hit, world axes.
    pub normal: S::Vector,
}

/// Closest points of two shapes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Closest<S: Space> {
    /// Point on a's surface \[m\], world axes.
    pub point_a: S::Vector,
    /// Point on b's surface \[m\], world axes.
    pub point_b: S::Vector,
    /// Unit normal from b to a.
    pub normal: S::Vector,
    /// Distance \[m\]; negative (penetration depth) when they overlap.
    pub gap: f64,
}

/// What is remembered of a pair from one look to the next.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Guess<S: Space> {
    /// Unit vector from b to a in a's frame, along which they were farthest apart or overlapped least.
    pub direction: Option<S::Vector>,
    /// They were at least so far apart \[m\]; minus infinity where nothing is known.
    pub apart: f64,
}

impl<S: Space> Default for Guess<S> {
    fn default() -> Self {
        Guess { direction: None, apart: f64::NEG_INFINITY }
    }
}

/// Pairs that are looked at side by side.
pub const ABREAST: usize = 4;

/// Two posed shapes that are looked at beside others.
pub struct Look<'a, S: Geometry> {
    /// Both shapes.
    pub colliders: [&'a S::Collider; 2],
    /// Their poses.
    pub poses: [&'a Pose<S>; 2],
    /// Contacts are looked for up to this gap \[m\].
    pub margin: f64,
}

impl<S: Geometry> Clone for Look<'_, S> {
    fn clone(&self) -> Self {
        *self
    }
}
impl<S: Geometry> Copy for Look<'_, S> {}

/// What is told of one of several pairs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Told {
    /// Where its contact points end; they begin where those of the pair before end.
    pub end: usize,
    /// Its shapes are at least so far apart \[m\]; minus infinity where that is not known.
    pub apart: f64,
}

impl Told {
    /// Nothing, after these points.
    pub fn nothing(end: usize) -> Self {
        Told { end, apart: f64::NEG_INFINITY }
    }
}

/// Shapes, their mass and their contacts, in the plane or in space.
pub trait Geometry: Space {
    /// A shape as users state it.
    type Shape: Clone + Debug + PartialEq + Send + Sync + Serialize + DeserializeOwned;
    /// The same shape made ready for queries.
    type Collider: Clone + Send + Sync;

    /// Checks a shape and makes it ready for queries.
    ///
    /// # Errors
    /// [`ShapeError`] naming the field for sizes that are not finite and positive, fewer points than the
    /// shape needs, degenerate hulls, indices out of range, nested compounds.
    fn collider(shape: &Self::Shape) -> Result<Self::Collider, ShapeError>;
    /// Bounding box of a posed shape, grown by `margin` \[m\] on every side.
    fn bounds(collider: &Self::Collider, pose: &Pose<Self>, margin: f64) -> Aabb<Self>;
    /// Largest extent of the shape \[m\]; infinite for half-planes and half-spaces. Sets length scales.
    fn extent(shape: &Self::Shape) -> f64;
    /// True for a disc or a ball about its frame's origin, which turning does not change.
    fn is_ball(shape: &Self::Shape) -> bool;
    /// Closed-form mass properties at a constant density \[kg/m^DIM\].
    ///
    /// # Errors
    /// [`ShapeError`] for shapes without volume and for a density that is not finite and positive.
    fn mass_properties(shape: &Self::Shape, density: f64) -> Result<MassProperties<Self>, ShapeError>;
    /// Mass properties of a density *function* of the point in shape axes, by adaptive quadrature to
    /// `relative_tolerance`; the error estimate is part of the answer. The function takes many points at once.
    ///
    /// # Errors
    /// [`ShapeError`] for shapes without volume, a density that is negative or not finite at a point (named),
    /// or a tolerance that the budget of evaluations cannot reach.
    fn mass_properties_of(
        shape: &Self::Shape,
        density: &mut dyn FnMut(&[Self::Vector]) -> Vec<f64>,
        relative_tolerance: f64,
    ) -> Result<MassProperties<Self>, ShapeError>;
    /// Appends the contact points of two posed shapes whose gap is at most `margin` \[m\], in a fixed order,
    /// with normals from b to a. Stateless: the answer depends on the arguments alone.
    fn contacts(
        a: &Self::Collider,
        pose_a: &Pose<Self>,
        b: &Self::Collider,
        pose_b: &Pose<Self>,
        margin: f64,
        out: &mut Vec<ContactPoint<Self>>,
    ) {
        Self::contacts_near((a, pose_a), (b, pose_b), margin, &mut Guess::default(), out);
    }
    /// The same, bit by bit, for who looks at a pair again and again: `guess` is what the time before left. It
    /// takes work off the search while the pair has hardly moved.
    fn contacts_near(
        a: (&Self::Collider, &Pose<Self>),
        b: (&Self::Collider, &Pose<Self>),
        margin: f64,
        guess: &mut Guess<Self>,
        out: &mut Vec<ContactPoint<Self>>,
    );
    /// True for two shapes that are quicker to look at beside others of their kind than alone.
    fn go_abreast(a: &Self::Collider, b: &Self::Collider) -> bool;
    /// Appends the contact points of at most [`ABREAST`] pairs that go abreast, one pair after another; what each has is what
    /// `contacts` finds, bit by bit.
    fn contacts_abreast(looks: &[Look<'_, Self>], out: &mut Vec<ContactPoint<Self>>) -> [Told; ABREAST];
    /// The radius of a ball about the origin of its frame \[m\]; `None` of other shapes.
    fn ball_radius(collider: &Self::Collider) -> Option<f64>;
    /// The contact point of two balls about the origins of their frames, from their places and radii \[m\], if there is one
    /// with a gap up to `margin` \[m\]: what `contacts` finds, bit by bit. `None` where the places are one.
    fn contact_of_balls(
        a: (Self::Vector, f64),
        b: (Self::Vector, f64),
        margin: f64,
    ) -> Option<Option<ContactPoint<Self>>>;
    /// The contact point of a ball about the origin of its frame, of which place and radius are given \[m\], and a posed
    /// half-space or cavity, if there is one with a gap up to `margin` \[m\]: what `contacts` finds, bit by bit; `wall_is_a`
    /// says which of the two comes first. `None` where the other shape is no wall.
    fn contact_with_wall(
        ball: (Self::Vector, f64),
        wall: (&Self::Collider, &Pose<Self>),
        wall_is_a: bool,
        margin: f64,
    ) -> Option<Option<ContactPoint<Self>>>;
    /// True for a shape of faces, edges and corners alone, none of them rounded: while it turns by little, the points in which
    /// it touches stay on the same corners and edges.
    fn is_angular(collider: &Self::Collider) -> bool;
    /// True where two shapes touch in one point at most, wherever they are: balls with balls and with walls. Whoever knows
    /// that contact need not look for another.
    fn touch_once(a: &Self::Collider, b: &Self::Collider) -> bool;
    /// Closest points when the gap is at most `reach` \[m\], else `None`.
    fn closest(
        a: &Self::Collider,
        pose_a: &Pose<Self>,
        b: &Self::Collider,
        pose_b: &Pose<Self>,
        reach: f64,
    ) -> Option<Closest<Self>>;
    /// First hit of the ray origin + t direction (unit), 0 <= t <= `reach`. From inside a solid the distance is 0
    /// and the normal points to the nearest way out; surfaces (walls, meshes, height fields) are hit from both
    /// sides, with the normal on the ray's side.
    fn raycast(
        collider: &Self::Collider,
        pose: &Pose<Self>,
        origin: Self::Vector,
        direction: Self::Vector,
        reach: f64,
    ) -> Option<RayHit<Self>>;
}
