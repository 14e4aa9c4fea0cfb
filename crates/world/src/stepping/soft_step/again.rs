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
use crate::ahead::{Ahead, Mover};
use carom_geometry::Geometry;
use carom_math::lanes::{Four, Lanes};
use carom_math::several::Plain;
use carom_math::wide::{inner, minus, plus, times};
use carom_math::{Column, Precise, Rotation, Several, Wide};

/// Share of the smaller body's size by which both may have moved against each other, turning included, since \[1\]. Points are
/// looked for at least as far.
pub const AGAIN: f64 = 0.01;

/// A patch that was seen.
pub(super) struct Sight<'a, S: Geometry> {
    pub seen: &'a Seen<S>,
    pub a_is_small: bool,
}

/// Where two bodies are now: places and attitudes of bodies a and b.
pub(super) struct Now<'a, S: Geometry>(pub [(&'a S::Vector, &'a S::Rotation); 2]);

/// Patches that were seen side by side: their outlines, and where their bodies were.
#[derive(Clone, Copy)]
pub(super) struct Then<S: Geometry, R: Plain> {
    pub outline: Outline<S, R>,
    /// Places of bodies a and b.
    places: [S::Vectors<R>; 2],
    attitudes: [S::Turns<R>; 2],
    /// 1 where the smaller one is body a, towards which the normal points, and else -1.
    sign: R,
}

impl<S: Geometry, R: Precise> Then<S, R> {
    /// Of patches that were seen.
    #[inline(always)]
    pub fn of<'a>(sights: impl Abreast<Sight<'a, S>, Number = R>) -> Self
    where
        S: 'a,
    {
        Then {
            outline: Outline::of(sights),
            places: [sights.several(|s, k| s.seen.places[0][k]), sights.several(|s, k| s.seen.places[1][k])],
            attitudes: [
                sights.several(|s, k| s.seen.attitudes[0][k]),
                sights.several(|s, k| s.seen.attitudes[1][k]),
            ],
            sign: sights.read(|s| if s.a_is_small { 1.0 } else { -1.0 }),
        }
    }
}

/// What becomes of a number.
pub(super) trait Change<R, T>: Copy {
    fn of(self, number: R) -> T;
}

/// To memory.
#[derive(Clone, Copy)]
pub(super) struct Store;

impl<F: Four> Change<F, [f64; 4]> for Store {
    #[inline(always)]
    fn of(self, number: F) -> [f64; 4] {
        number.store()
    }
}

/// From memory.
#[derive(Clone, Copy)]
pub(super) struct Load<L: Lanes>(pub L);

impl<L: Lanes> Change<[f64; 4], L::Four> for Load<L> {
    #[inline(always)]
    fn of(self, numbers: [f64; 4]) -> L::Four {
        self.0.four(&numbers)
    }
}

/// The same of several numbers.
#[inline(always)]
fn several<R, T, A: Several<R>, B: Several<T>>(numbers: &A, how: impl Change<R, T>) -> B
where
    R: Plain,
    T: Plain,
{
    let mut out = B::all(how.of(numbers[0]));
    for k in 1..A::LEN {
        out[k] = how.of(numbers[k]);
    }
    out
}

impl<S: Geometry, R: Plain> Then<S, R> {
    /// The same in other numbers.
    #[inline(always)]
    pub fn each<T: Plain, H: Change<R, T>>(&self, how: H) -> Then<S, T> {
        let Outline { count, normal, points, gaps } = &self.outline;
        let mut to = S::Points::all(several(&points[0], how));
        for i in 1..S::Points::<f64>::LEN {
            to[i] = several(&points[i], how);
        }
        Then {
            outline: Outline {
                count: how.of(*count),
                normal: several(normal, how),
                points: to,
                gaps: several(gaps, how),
            },
            places: [several(&self.places[0], how), several(&self.places[1], how)],
            attitudes: [several(&self.attitudes[0], how), several(&self.attitudes[1], how)],
            sign: how.of(self.sign),
        }
    }

    /// The same number everywhere.
    pub fn all(number: R) -> Self {
        let vectors = S::Vectors::all(number);
        let outline = Outline {
            count: number,
            normal: vectors,
            points: S::Points::all(vectors),
            gaps: S::Points::all(number),
        };
        let turns = S::Turns::all(number);
        Then { outline, places: [vectors; 2], attitudes: [turns; 2], sign: number }
    }
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
    pub fn between<'a>(then: &Then<S, R>, now: impl Abreast<Now<'a, S>, Number = R>) -> Self
    where
        S: 'a,
    {
        let (sign, [then_a, then_b]) = (then.sign, &then.places);
        let (now_a, turn_a) = moved(then, now, 0);
        let (now_b, turn_b) = moved(then, now, 1);
        let larger = [of_two(sign, then_b, then_a), of_two(sign, &now_b, &now_a)];
        let (smaller, now) = (of_two(sign, then_a, then_b), of_two(sign, &now_a, &now_b));
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
    /// How far points of the smaller bodies moved against the larger ones at most; of each pair its smaller body is asked for.
    #[inline(always)]
    pub fn strayed<'a, P: Abreast<[&'a Mover<S>; 2], Number = F>>(&self, pairs: P) -> F {
        inner(&self.by, &self.by).sqrt() + self.angle() * pairs.read(|pair| pair[0].arm)
    }

    /// The set of those, bit by bit, whose points all stand; of each its smaller body and its larger one are asked for, and how
    /// fast they can come towards each other.
    #[inline(always)]
    pub fn stand<'a, P: Abreast<[&'a Mover<S>; 2], Number = F>>(
        &self,
        ahead: &Ahead<S>,
        pairs: P,
        closing: F,
    ) -> u32 {
        let (arm, extent) = (pairs.read(|pair| pair[0].arm), pairs.read(|pair| pair[0].extent));
        let farthest = extent * extent.like(AGAIN);
        let left = farthest - self.angle() * arm;
        let (by, reach) = (inner(&self.by, &self.by), left * left);
        // what was pushed since may come to other parts of the other body in this step; how far it falls was known
        let (dt, pull) = (left.like(ahead.dt), pairs.read(|pair| pair[0].pull + pair[1].pull));
        let coming = (closing + pull * dt) * dt;
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

/// Places, and turns.
type Motion<S, R> = (<S as Wide>::Vectors<R>, <S as Wide>::Turns<R>);

/// Places of bodies a, or of bodies b, now, and how they turned. A function, here and where else numbers of several are
/// read: a closure is not inlined, and then has no registers.
#[inline(always)]
fn moved<'a, S: Geometry + 'a, P: Abreast<Now<'a, S>>>(
    then: &Then<S, P::Number>,
    now: P,
    i: usize,
) -> Motion<S, P::Number> {
    let attitude: S::Turns<P::Number> = now.several(|now, k| now.0[i].1.as_slice()[k]);
    (now.several(|now, k| now.0[i].0[k]), since::<S, P::Number>(&attitude, &then.attitudes[i]))
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
