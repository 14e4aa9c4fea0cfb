//! Contacts used again. While the bodies of a pair have hardly moved against each other since the narrow phase looked at it,
//! the points and the normal that it found stand, and go along with the larger body, however it moves; gaps follow from the smaller
//! one's motion against it, exactly. With Q and x the turn and the place of a body since then, x' its place then, l the larger and
//! s the smaller one: a point p of s moved in the frame of l by d + (Q_l^T Q_s - 1)(p - x_s'), d = Q_l^T (x_s - x_l) -
//! (x_s' - x_l'). It saves the search, and it steadies: points that are found anew at every step jump between corners that
//! lie on each other, and lose their forces when they do. Only faces on faces, and corners and edges of bodies that have nothing
//! else: what rolls needs its points anew, and so does what will move by more than that in the step, which a push may take to
//! parts of the other body that were far. A corner on a face of the larger body is where it would be found; of other
//! corners and edges the normal is off by no more than the bodies turned, a hundredth of a radian.

use super::face::{Laid, Outline, Spots};
use super::memory::Seen;
use crate::abreast::Abreast;
use crate::ahead::{Ahead, Mover, closing};
use carom_geometry::Geometry;
use carom_math::lanes::Four;
use carom_math::wide::{inner, minus, plus, times};
use carom_math::{Column, Precise, Rotation, Several, Wide};

/// Share of the smaller body's size by which both may have moved against each other, turning included, since \[1\]. Points are
/// looked for at least as far.
pub const AGAIN: f64 = 0.01;

/// A patch that was seen, and where its bodies are now.
pub(super) struct Sight<'a, S: Geometry> {
    pub seen: &'a Seen<S>,
    /// Places and attitudes of bodies a and b.
    pub now: [(&'a S::Vector, &'a S::Rotation); 2],
    pub a_is_small: bool,
}

/// How two bodies moved since they were looked at.
pub(super) struct Together<S: Geometry, R: Precise> {
    /// Place of the larger body then, and now.
    larger: [S::Vectors<R>; 2],
    /// How it turned.
    turn: S::Turns<R>,
    /// Place of the smaller body then.
    smaller: S::Vectors<R>,
    /// How its centre moved in the larger one's frame, and how it turned in it.
    by: S::Vectors<R>,
    against: S::Turns<R>,
    /// 1 where the smaller one is body a, towards which the normal points, and else -1.
    sign: R,
}

impl<S: Geometry, R: Precise> Together<S, R> {
    /// Of bodies where they were seen, and where they are.
    #[inline(always)]
    pub fn between<'a>(sights: impl Abreast<Sight<'a, S>, Number = R>) -> Self
    where
        S: 'a,
    {
        let sign = sights.read(|sight| if sight.a_is_small { 1.0 } else { -1.0 });
        let ([then_a, now_a], turn_a) = moved(sights, 0);
        let ([then_b, now_b], turn_b) = moved(sights, 1);
        let larger = [of_two(sign, &then_b, &then_a), of_two(sign, &now_b, &now_a)];
        let (smaller, now) = (of_two(sign, &then_a, &then_b), of_two(sign, &now_a, &now_b));
        let (own, turn): (S::Turns<R>, S::Turns<R>) =
            (of_two(sign, &turn_a, &turn_b), of_two(sign, &turn_b, &turn_a));
        let back = S::back(&turn);
        let apart = S::rotated(&back, &minus(&now, &larger[1]));
        let by = minus(&apart, &minus(&smaller, &larger[0]));
        Together { larger, turn, smaller, by, against: S::product(&back, &own), sign }
    }

    /// Angles of how the smaller bodies turned against the larger ones \[rad\]: as long as the numbers of a small turn are apart from those
    /// of none, of a quaternion twice as long.
    #[inline(always)]
    fn angle(&self) -> R {
        let apart = minus(&self.against, &none::<S, R>(self.sign));
        let half = inner(&apart, &apart).root();
        if S::SPIN == 1 { half } else { half + half }
    }

    /// A patch's face as it lies now. All of it is linear in the points, so what they share is found once: with n and t the normal
    /// then and a tangent now, m = (Q_l^T Q_s - 1)^T n and u = (1 + (Q_l^T Q_s - 1)/2)^T Q_l^T t gaps change by +-(n.d + m.(p - x_s'))
    /// and places from the mean are u.(p - p_mean).
    #[inline(always)]
    pub fn laid(&self, then: &Outline<S, R>) -> Laid<S, R> {
        let (half, back) = (self.sign.constant(0.5), S::back(&self.against));
        let normal = S::rotated(&self.turn, &then.normal);
        let tangents = S::tangents(&normal);
        let turned_back = S::back(&self.turn);
        let mut along = tangents;
        for k in 0..S::SLIP {
            let tangent = S::rotated(&turned_back, &tangents[k]);
            along[k] = plus(&tangent, &times(&S::swung(&back, &tangent), half));
        }
        let mean = then.mean();
        let centre = self.along(&plus(&mean, &times(&self.against(&mean), half)));
        Laid::new(then, (normal, tangents), (mean, centre), along, self.gaps(then))
    }

    /// Gaps of a patch now \[m\].
    #[inline(always)]
    fn gaps(&self, then: &Outline<S, R>) -> S::Points<R> {
        let lean = S::swung(&S::back(&self.against), &then.normal);
        let shared = inner(&then.normal, &self.by);
        let mut gaps = then.gaps;
        for i in 0..S::Points::<R>::LEN {
            let more = shared + inner(&lean, &minus(&then.points[i], &self.smaller));
            gaps[i] = then.gaps[i] + self.sign * more;
        }
        gaps
    }

    /// How a point of the smaller body moved against the larger one, in the frame of then \[m\].
    #[inline(always)]
    fn against(&self, point: &S::Vectors<R>) -> S::Vectors<R> {
        plus(&self.by, &S::swung(&self.against, &minus(point, &self.smaller)))
    }

    /// Where the larger body took a point of the frame of then \[m\].
    #[inline(always)]
    fn along(&self, point: &S::Vectors<R>) -> S::Vectors<R> {
        plus(&self.larger[1], &S::rotated(&self.turn, &minus(point, &self.larger[0])))
    }
}

impl<S: Geometry, F: Four> Together<S, F> {
    /// The set of those, bit by bit, whose points all stand; of each its smaller body and its larger one are asked for.
    #[inline(always)]
    pub fn stand<'a, P: Abreast<[&'a Mover<S>; 2], Number = F>>(&self, ahead: &Ahead<S>, pairs: P) -> u32 {
        let (arm, extent) = (pairs.read(|pair| pair[0].arm), pairs.read(|pair| pair[0].extent));
        let farthest = extent * extent.like(AGAIN);
        let left = farthest - self.angle() * arm;
        let (by, reach) = (inner(&self.by, &self.by), left * left);
        // what was pushed since may come to other parts of the other body in this step; how far it falls was known
        let (dt, pull) = (left.like(ahead.dt), pairs.read(|pair| pair[0].pull + pair[1].pull));
        let coming = (closing(pairs) + pull * dt) * dt;
        let stray = left.less(left.like(0.0)) | reach.less(by) | farthest.less(coming);
        // not a number where an attitude was none
        !stray & (left + by + coming).less(left.like(f64::INFINITY))
    }
}

impl<S: Geometry> Together<S, f64> {
    /// The points of a patch where they are now.
    pub fn spots(&self, then: &Outline<S, f64>, count: usize) -> Spots<S> {
        let column = |numbers: &S::Vectors<f64>| S::Vector::from_fn(|k| numbers[k]);
        let mut spots = Spots::<S>::new(column(&S::rotated(&self.turn, &then.normal)));
        // what a report says is the smallest gap is that of a touch, bit for bit
        let gaps = self.gaps(then);
        for i in 0..count {
            let point = then.points[i];
            let now = self.along(&plus(&point, &times(&self.against(&point), 0.5)));
            spots.add(column(&now), gaps[i]);
        }
        spots
    }
}

/// One of two things: the first where the sign is not negative.
#[inline(always)]
fn of_two<R: Precise, V: Several<R>>(sign: R, one: &V, other: &V) -> V {
    let mut out = *one;
    for k in 0..V::LEN {
        out[k] = sign.choose(sign.constant(0.0), other[k], one[k]);
    }
    out
}

/// Places then and now, and turns.
type Motion<S, R> = ([<S as Wide>::Vectors<R>; 2], <S as Wide>::Turns<R>);

/// Places of bodies a, or of bodies b, then and now, and how they turned. A function, here and where else numbers of several are
/// read: a closure is not inlined, and then has no registers.
#[inline(always)]
fn moved<'a, S: Geometry + 'a, P: Abreast<Sight<'a, S>>>(sights: P, i: usize) -> Motion<S, P::Number> {
    let places = [sights.several(|s, k| s.seen.places[i][k]), sights.several(|s, k| s.now[i].0[k])];
    let then: S::Turns<P::Number> = sights.several(|s, k| s.seen.attitudes[i][k]);
    let now: S::Turns<P::Number> = sights.several(|s, k| s.now[i].1.as_slice()[k]);
    (places, since::<S, P::Number>(&now, &then))
}

/// No turn.
#[inline(always)]
fn none<S: Geometry, R: Precise>(number: R) -> S::Turns<R> {
    let mut none = S::Turns::all(number.constant(0.0));
    none[0] = number.constant(1.0);
    none
}

/// How bodies turned since they had these attitudes; exactly none where they did not.
#[inline(always)]
fn since<S: Geometry, R: Precise>(now: &S::Turns<R>, then: &S::Turns<R>) -> S::Turns<R> {
    let (apart, turn) = (minus(now, then), S::product(now, &S::back(then)));
    let apart = inner(&apart, &apart);
    let (zero, mut out) = (apart.constant(0.0), none::<S, R>(apart));
    for k in 0..S::Turns::<R>::LEN {
        // where it is not a number, nor is that
        out[k] = zero.choose(apart, turn[k], out[k] + apart);
    }
    out
}
