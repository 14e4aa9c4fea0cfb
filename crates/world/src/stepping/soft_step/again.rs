//! Contacts used again. While the bodies of a pair have hardly moved against each other since the narrow phase looked at it,
//! the points and the normal that it found stand, and go along with the larger body, however it moves; gaps follow from the smaller
//! one's motion against it, exactly. With Q and x the turn and the place of a body since then, x' its place then, l the larger and
//! s the smaller one: a point p of s moved in the frame of l by d + (Q_l^T Q_s - 1)(p - x_s'), d = Q_l^T (x_s - x_l) -
//! (x_s' - x_l'). It saves the search, and it steadies: points that are found anew at every step jump between corners that
//! lie on each other, and lose their forces when they do. Only faces on faces, and corners and edges of bodies that have nothing
//! else: what rolls needs its points anew, and so does what will move by more than that in the step, which a push may take to
//! parts of the other body that were far. A corner on a face of the larger body is where it would be found; of other
//! corners and edges the normal is off by no more than the bodies turned, a hundredth of a radian.

use super::face::Face;
use super::memory::PatchForce;
use crate::ahead::Ahead;
use crate::material::Coefficients;
use carom_geometry::Geometry;
use carom_math::{Column, Rotation, Several};

/// Share of the smaller body's size by which both may have moved against each other, turning included, since \[1\]. Points are
/// looked for at least as far.
pub const AGAIN: f64 = 0.01;

/// Appends the faces of a pair that had these patches in the step before, one of each, and true, if their points stand.
pub(super) fn again<S: Geometry>(
    ahead: &Ahead<S>,
    (pair, closing): ((usize, usize), Option<f64>),
    known: &[PatchForce<S>],
    faces: &mut Vec<Face<S>>,
) -> bool {
    let data = &ahead.bodies.data;
    let are_angular = || data[pair.0].is_angular && data[pair.1].is_angular;
    if known.iter().any(|patch| patch.count < S::DIM) && !are_angular() {
        return false;
    }
    // all of a pair were looked at together
    let Some(first) = known.first() else { return false };
    let Some(together) = Together::<S>::of(ahead, (pair, closing), first) else { return false };
    let coefficients = Coefficients::of(ahead.bodies, ahead.settings, pair);
    for patch in known {
        let normal = together.turn.map_or(patch.seen.normal, |turn| turn.rotate(patch.seen.normal));
        faces.push(Face::new(pair, normal, coefficients));
        if let Some(face) = faces.last_mut() {
            together.fill(face, patch);
        }
    }
    true
}

/// How two bodies moved since they were looked at.
struct Together<S: Geometry> {
    /// Place of the larger body then, and now.
    larger: [S::Vector; 2],
    /// How it turned; none where it did not.
    turn: Option<S::Rotation>,
    /// Place of the smaller body then.
    smaller: S::Vector,
    /// How its centre moved in the larger one's frame, and how it turned in it.
    by: S::Vector,
    against: Option<S::Rotation>,
    /// 1 where the smaller one is body a, towards which the normal points, and else -1.
    sign: f64,
}

impl<S: Geometry> Together<S> {
    /// None where they moved too far against each other, or will in this step.
    #[inline]
    fn of(
        ahead: &Ahead<S>,
        ((a, b), closing): ((usize, usize), Option<f64>),
        patch: &PatchForce<S>,
    ) -> Option<Self> {
        let (data, motion) = (&ahead.bodies.data, &ahead.bodies.motion);
        let a_is_small = data[a].extent <= data[b].extent;
        let ((small, large), (s, l)) = if a_is_small { ((a, b), (0, 1)) } else { ((b, a), (1, 0)) };
        let seen = &patch.seen;
        let larger = [seen.places[l], motion.position[large]];
        let turn = turned::<S>(&motion.rotation[large], &seen.attitudes[l]);
        let own = turned::<S>(&motion.rotation[small], &seen.attitudes[s]);
        let apart = motion.position[small] - larger[1];
        let apart = turn.map_or(apart, |turn| turn.unrotate(apart));
        let by = apart - (seen.places[s] - larger[0]);
        let against = match (own, turn) {
            (Some(own), Some(turn)) => Some(own.within(&turn)),
            (own, turn) => own.or_else(|| turn.map(|turn| turn.inverse())),
        };
        let swing = against.map_or(0.0, |turn| angle::<S>(&turn) * data[small].reach_of_turning());
        let farthest = AGAIN * data[small].extent;
        // not a number where an attitude was none
        let stands = by.norm() + swing <= farthest;
        // what was pushed since may come to other parts of the other body in this step; how far it falls was known
        if !stands {
            return None;
        }
        let closing = closing.unwrap_or_else(|| ahead.closing((a, b)));
        if ahead.coming((a, b), closing) > farthest {
            return None;
        }
        let sign = if a_is_small { 1.0 } else { -1.0 };
        Some(Together { larger, turn, smaller: seen.places[s], by, against, sign })
    }

    /// The points of a patch where they are now.
    #[inline]
    fn fill(&self, face: &mut Face<S>, patch: &PatchForce<S>) {
        let normal = patch.seen.normal;
        for (i, id) in patch.names().iter().enumerate() {
            let point = patch.seen.points[i];
            let by = self.against(point);
            let gap = patch.seen.gaps[i] + self.sign * normal.dot(by);
            face.add(*id, self.along(point + by * 0.5), gap);
        }
    }

    /// How a point of the smaller body moved against the larger one, in the frame of then \[m\].
    #[inline]
    fn against(&self, point: S::Vector) -> S::Vector {
        let arm = point - self.smaller;
        self.by + self.against.map_or(S::Vector::ZERO, |turn| turn.rotate(arm) - arm)
    }

    /// Where the larger body took a point of the frame of then \[m\].
    #[inline]
    fn along(&self, point: S::Vector) -> S::Vector {
        let arm = point - self.larger[0];
        self.larger[1] + self.turn.map_or(arm, |turn| turn.rotate(arm))
    }
}

/// How a body turned since it had this attitude; none where it did not.
#[inline]
fn turned<S: Geometry>(now: &S::Rotation, before: &S::Turns<f64>) -> Option<S::Rotation> {
    let before = before.slice();
    if now.as_slice() == before { None } else { now.since(before) }
}

/// The angle of a small turn \[rad\]: as long as its numbers are apart from those of none, of a quaternion twice as long.
#[inline]
fn angle<S: Geometry>(turn: &S::Rotation) -> f64 {
    let none = S::Rotation::IDENTITY;
    let apart = turn.as_slice().iter().zip(none.as_slice()).map(|(a, b)| (a - b) * (a - b));
    apart.sum::<f64>().sqrt() * if S::SPIN == 1 { 1.0 } else { 2.0 }
}
