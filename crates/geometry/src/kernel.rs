//! What contact work asks of convex cores. Every bounded shape is a convex core (point, segment, polygon,
//! polytope, cylinder, cone) swept by a ball of `radius`, or a set of such pieces. For a unit vector n
//!   s(n) = min over a of n.x - max over b of n.x
//! never exceeds the signed distance of the cores a and b, and the largest s(n) *is* the signed distance: so a
//! direction found by whatever means is judged by s alone, which supports give to rounding.
//! Knows no bodies; the two spaces differ in how directions are found and faces are clipped.

use crate::collider::reach_box;
use crate::few::Few;
use crate::geometry::{ABREAST, Aabb, ContactPoint, Guess, Told};
use carom_math::{Column, Pose, Rotation, Space};
use std::fmt::Debug;

/// No vertex.
pub const NONE: u32 = u32::MAX;

/// Which features of the two cores meet in a point: a vertex `[v, NONE]`, an edge `[u, v]` or a face
/// `[NONE, NONE]` of each.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Label {
    /// Feature of a.
    pub a: [u32; 2],
    /// Feature of b.
    pub b: [u32; 2],
}

impl Label {
    /// A vertex of each.
    pub fn vertices(a: u32, b: u32) -> Self {
        Label { a: [a, NONE], b: [b, NONE] }
    }
    /// One number for the label.
    #[inline]
    pub fn code(&self) -> u64 {
        code_of(self.a, self.b)
    }
}

/// The number of a label by its features.
#[inline]
pub const fn code_of(a: [u32; 2], b: [u32; 2]) -> u64 {
    const fn pair([p, q]: [u32; 2]) -> u64 {
        if p < q { (p as u64) << 32 | q as u64 } else { (q as u64) << 32 | p as u64 }
    }
    mix(pair(a), pair(b))
}

/// Scrambles two numbers into one (the finalizer of SplitMix64, Steele et al. 2014).
#[inline]
pub const fn mix(a: u64, b: u64) -> u64 {
    let mut z = a.rotate_left(32) ^ b.wrapping_add(0x9e37_79b9_7f4a_7c15).wrapping_mul(0xd6e8_feb8_6659_fd93);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

/// The direction along which two cores are farthest apart (or overlap least), in a's frame.
#[derive(Clone, Copy, Debug)]
pub struct Separation<S: Space> {
    /// Unit normal from b to a.
    pub normal: S::Vector,
    /// Signed distance of the cores \[m\].
    pub gap: f64,
    /// Witness on a's core \[m\].
    pub on_a: S::Vector,
    /// Witness on b's core \[m\].
    pub on_b: S::Vector,
    /// Features that carry the witnesses.
    pub label: Label,
}

/// One place where two cores may touch, in a's frame.
#[derive(Clone, Copy, Debug)]
pub struct Touch<S: Space> {
    /// Unit normal from b to a.
    pub normal: S::Vector,
    /// Gap of the cores along the normal \[m\].
    pub gap: f64,
    /// Point of a's core \[m\].
    pub on_a: S::Vector,
    /// Point of b's core \[m\].
    pub on_b: S::Vector,
    /// Features that meet.
    pub label: Label,
}

impl<S: Space> Default for Touch<S> {
    fn default() -> Self {
        let origin = S::Vector::ZERO;
        Touch { normal: origin, gap: 0.0, on_a: origin, on_b: origin, label: Label::default() }
    }
}

/// A posed core swept by a ball.
pub struct Swept<'a, S: Kernel> {
    /// The core.
    pub core: &'a S::Core,
    /// Radius of the ball \[m\].
    pub radius: f64,
    /// Frame of the core in the world.
    pub pose: &'a Pose<S>,
}

impl<S: Kernel> Clone for Swept<'_, S> {
    fn clone(&self) -> Self {
        *self
    }
}
impl<S: Kernel> Copy for Swept<'_, S> {}

/// Two swept cores that are looked at beside others.
pub struct Beside<'a, S: Kernel> {
    /// They.
    pub swept: [Swept<'a, S>; 2],
    /// Contacts are looked for up to this gap \[m\].
    pub margin: f64,
}

impl<S: Kernel> Clone for Beside<'_, S> {
    fn clone(&self) -> Self {
        *self
    }
}
impl<S: Kernel> Copy for Beside<'_, S> {}

/// Corners of a feature with their names.
pub type Ring<S> = Few<(<S as Space>::Vector, u32), 8>;
/// Where two cores may touch.
pub type Touches<S> = Few<Touch<S>, 8>;

/// Convex cores of a space and what can be asked of them.
pub trait Kernel: Space {
    /// A convex core in its own frame.
    type Core: Clone + Debug + Send + Sync;
    /// Most contact points that one flat patch keeps: 2 | 4.
    const PATCH: usize;
    /// The core of a mesh facet with these corners: a segment | a triangle.
    fn facet(corners: &[Self::Vector]) -> Self::Core;
    /// The core of a single point.
    fn dot(point: Self::Vector) -> Self::Core;
    /// The point that the whole core is, if it is one.
    fn only_point(core: &Self::Core) -> Option<Self::Vector>;
    /// Unit normal of a facet (right of the segment | counter-clockwise side of the triangle).
    fn facet_normal(corners: &[Self::Vector]) -> Self::Vector;
    /// Unit vector in a facet's plane that points out across its k-th seam (corner k | edge k, k+1).
    fn facet_outward(corners: &[Self::Vector], k: usize) -> Self::Vector;
    /// Farthest point along a direction of any length, and its name.
    fn support(core: &Self::Core, direction: Self::Vector) -> (Self::Vector, u32);
    /// Box of a core at a pose.
    fn bounds_of(core: &Self::Core, pose: &Pose<Self>) -> Aabb<Self> {
        reach_box(pose, |d| Self::support(core, d).0)
    }
    /// True for a core with a curved surface of its own.
    fn is_curved(_core: &Self::Core) -> bool {
        false
    }
    /// Largest distance of the core from its frame's origin \[m\].
    fn size(core: &Self::Core) -> f64;
    /// The points that a wall with this inward direction would meet first, with their names; the farthest
    /// point is among them.
    fn feature(core: &Self::Core, direction: Self::Vector, out: &mut Ring<Self>);
    /// The points that the inside of a ball about `from` would meet first: all corners, and the farthest points of rims,
    /// with their names.
    fn corners(core: &Self::Core, from: Self::Vector, out: &mut Ring<Self>);
    /// The largest s(n), or `None` when it exceeds `reach` \[m\]. A `guess` at its direction n takes work off the
    /// search and no bit of its answer is another; it is left as a guess for the next time, for the cores alone.
    fn separation(
        a: &Self::Core,
        b: &Self::Core,
        b_in_a: &Pose<Self>,
        reach: f64,
        guess: &mut Guess<Self>,
    ) -> Option<Separation<Self>>;
    /// Where the faces of the two cores overlap as seen along `found.normal`, gaps up to `reach`, in place of what
    /// `out` held.
    /// The witnesses of `found` are added only when they are those of its normal (`witnessed`).
    fn manifold(
        a: &Self::Core,
        b: &Self::Core,
        b_in_a: &Pose<Self>,
        found: &Separation<Self>,
        witnessed: bool,
        reach: f64,
        out: &mut Touches<Self>,
    );
    /// Appends the contact points of two swept cores with gaps up to `margin` \[m\] in one go, where there is a way for
    /// these cores, their names distinct; false where there is none. Where they are farther apart `apart` may become a gap that
    /// they have at least \[m\]. It says what `separation` and `manifold` say, but for rounding.
    fn together(
        _a: Swept<Self>,
        _b: Swept<Self>,
        _margin: f64,
        _apart: &mut f64,
        _out: &mut Vec<ContactPoint<Self>>,
    ) -> bool {
        false
    }
    /// True where several pairs of such cores are looked at together in less time than one after another.
    fn go_abreast(_a: &Self::Core, _b: &Self::Core) -> bool {
        false
    }
    /// What `together` appends of at most [`ABREAST`] pairs, each with its margin \[m\], one after another, bit by bit.
    fn abreast(pairs: &[Beside<'_, Self>], out: &mut Vec<ContactPoint<Self>>) -> [Told; ABREAST] {
        let mut all = [Told::nothing(out.len()); ABREAST];
        for (told, pair) in all.iter_mut().zip(pairs) {
            let [a, b] = pair.swept;
            Self::together(a, b, pair.margin, &mut told.apart, out);
            told.end = out.len();
        }
        all
    }
    /// s(n) with the farthest points of both cores.
    fn along(a: &Self::Core, b: &Self::Core, b_in_a: &Pose<Self>, normal: Self::Vector) -> Separation<Self> {
        let (on_a, vertex_a) = Self::support(a, -normal);
        let (local_b, vertex_b) = Self::support(b, b_in_a.rotation.unrotate(normal));
        let on_b = b_in_a.to_world(local_b);
        let gap = normal.dot(on_a - on_b);
        Separation { normal, gap, on_a, on_b, label: Label::vertices(vertex_a, vertex_b) }
    }
}

/// Length against which rounding is measured \[m\]: sizes of both cores and the distance of their frames.
pub fn scale<S: Kernel>(a: &S::Core, b: &S::Core, b_in_a: &Pose<S>) -> f64 {
    S::size(a) + S::size(b) + b_in_a.position.norm()
}
