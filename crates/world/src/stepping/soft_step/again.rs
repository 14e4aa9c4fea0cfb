//! Contacts used again. While the bodies of a pair have hardly moved against each other since the narrow phase looked at it,
//! the points and the normal that it found stand, and go along with the larger body, however it moves; gaps follow from the smaller
//! one's motion against it, exactly. With Q and x the turn and the place of a body since then, x' its place then, l the larger and
//! s the smaller one: a point p of s moved in the frame of l by d + (Q_l^T Q_s - 1)(p - x_s'), d = Q_l^T (x_s - x_l) -
//! (x_s' - x_l'). It saves the search, and it steadies: points that are found anew at every step jump between corners that
//! lie on each other, and lose their forces when they do. Only faces on faces, and corners and edges of bodies that have nothing
//! else: what rolls needs its points anew, and so does what will move by more than that in the step, which a push may take to
//! parts of the other body that were far. A corner on a face of the larger body is where it would be found; of other
//! corners and edges the normal is off by no more than the bodies turned, a hundredth of a radian.

use super::face::{Laid, Spots, mean_of, tangents_of};
use super::memory::Seen;
use crate::ahead::{Ahead, Mover};
use crate::narrow_phase::Near;
use carom_geometry::Geometry;
use carom_math::{Column, Rotation, Several};

/// Share of the smaller body's size by which both may have moved against each other, turning included, since \[1\]. Points are
/// looked for at least as far.
pub const AGAIN: f64 = 0.01;

/// How two bodies moved since they were looked at.
pub(super) struct Together<S: Geometry> {
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
    /// Of a pair that had these patches in the step before; none unless all their points stand.
    #[inline(always)]
    pub fn of(ahead: &Ahead<S>, near: &Near<'_, S>, known: &[Seen<S>]) -> Option<Self> {
        let couple = &near.couple;
        if known.iter().any(|patch| patch.count < S::DIM) && !couple.are_angular() {
            return None;
        }
        // all of a pair were looked at together
        let first = known.first()?;
        let place = |mover: &Mover<S>| (mover.position, mover.rotation);
        let together = Together::between(first, [place(couple.a), place(couple.b)], couple.a_is_small());
        let small = couple.small();
        let swing = together.against.map_or(0.0, |turn| angle::<S>(&turn) * small.arm);
        let farthest = AGAIN * small.extent;
        // not a number where an attitude was none
        let left = farthest - swing;
        let stands = left >= 0.0 && together.by.norm_squared() <= left * left;
        // what was pushed since may come to other parts of the other body in this step; how far it falls was known
        if !stands {
            return None;
        }
        let closing = near.closing.unwrap_or_else(|| couple.closing());
        (couple.coming(ahead.dt, closing) <= farthest).then_some(together)
    }

    /// Of two bodies where they were seen, and where they are.
    #[inline(always)]
    pub fn between(seen: &Seen<S>, now: [(S::Vector, S::Rotation); 2], a_is_small: bool) -> Self {
        let (s, l) = if a_is_small { (0, 1) } else { (1, 0) };
        let larger = [seen.places[l], now[l].0];
        let turn = turned::<S>(&now[l].1, &seen.attitudes[l]);
        let own = turned::<S>(&now[s].1, &seen.attitudes[s]);
        let apart = now[s].0 - larger[1];
        let apart = turn.map_or(apart, |turn| turn.unrotate(apart));
        let by = apart - (seen.places[s] - larger[0]);
        let against = match (own, turn) {
            (Some(own), Some(turn)) => Some(own.within(&turn)),
            (own, turn) => own.or_else(|| turn.map(|turn| turn.inverse())),
        };
        let sign = if a_is_small { 1.0 } else { -1.0 };
        Together { larger, turn, smaller: seen.places[s], by, against, sign }
    }

    /// A patch's face as it lies now. All of it is linear in the points, so what they share is found once: with n and t the normal
    /// then and a tangent now, m = (Q_l^T Q_s - 1)^T n and u = (1 + (Q_l^T Q_s - 1)/2)^T Q_l^T t gaps change by +-(n.d + m.(p - x_s'))
    /// and places from the mean are u.(p - p_mean).
    #[inline(always)]
    pub fn laid(&self, seen: &Seen<S>, count: usize) -> Laid<S> {
        let (then, back) = (seen.normal, self.against.map(|turn| turn.inverse()));
        let normal = self.turn.map_or(then, |turn| turn.rotate(then));
        let tangents = tangents_of::<S>(normal);
        let along = |tangent: S::Vector| {
            let tangent = self.turn.map_or(tangent, |turn| turn.unrotate(tangent));
            back.map_or(tangent, |back| tangent + back.swing(tangent) * 0.5)
        };
        let along = [along(tangents[0]), along(tangents[1])];
        let mean = mean_of::<S>(&seen.points, count);
        let centre = self.along(mean + self.against(mean) * 0.5);
        Laid::new((count, &seen.points), (normal, tangents), (mean, centre), along, self.gaps(seen))
    }

    /// Its gaps now \[m\].
    #[inline(always)]
    fn gaps<'a>(&self, seen: &'a Seen<S>) -> impl Fn(usize) -> f64 + use<'a, S> {
        let lean = self.against.map_or(S::Vector::ZERO, |turn| turn.inverse().swing(seen.normal));
        let (shared, smaller, sign) = (seen.normal.dot(self.by), self.smaller, self.sign);
        move |i| seen.gaps[i] + sign * (shared + lean.dot(seen.points[i] - smaller))
    }

    /// The points of a patch where they are now.
    pub fn spots(&self, patch: &Seen<S>) -> Spots<S> {
        let normal = patch.normal;
        let mut spots = Spots::<S>::new(self.turn.map_or(normal, |turn| turn.rotate(normal)));
        spots.count = patch.names().len();
        // what a report says is the smallest gap is that of a touch, bit for bit
        let gaps = self.gaps(patch);
        for i in 0..spots.count {
            let point = patch.points[i];
            let by = self.against(point);
            spots.gaps[i] = gaps(i);
            spots.points[i] = self.along(point + by * 0.5);
        }
        spots
    }

    /// How a point of the smaller body moved against the larger one, in the frame of then \[m\].
    #[inline(always)]
    fn against(&self, point: S::Vector) -> S::Vector {
        let arm = point - self.smaller;
        self.by + self.against.map_or(S::Vector::ZERO, |turn| turn.swing(arm))
    }

    /// Where the larger body took a point of the frame of then \[m\].
    #[inline(always)]
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
