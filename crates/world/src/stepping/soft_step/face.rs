//! Faces of contact: the points that two bodies share with one normal, as a step begins with them. What a step needs of a face is in its
//! patch, in f32, and what the next one needs is what is remembered of it; the face itself is made again when somebody asks.

use super::again::{Now, Sight, Then, Together};
use super::memory::Seen;
use crate::abreast::{Abreast, One};
use crate::material::Coefficients;
use crate::narrow_phase::Touch;
use carom_geometry::Geometry;
use carom_math::several::Plain;
use carom_math::wide::{inner, minus, times};
use carom_math::{Column, Precise, Several};

/// Not in any list.
pub(crate) const NONE: u32 = u32::MAX;

/// A face as a step keeps it.
#[derive(Clone, Copy)]
pub(crate) struct Met<S: Geometry> {
    /// Index of body a.
    pub a: u32,
    /// Index of body b.
    pub b: u32,
    /// Place of the patch that was seen: among those of the step before where its points are used again, else among the new ones.
    pub seen: u32,
    /// Place among the coefficients.
    pub kind: u32,
    /// Points that it has.
    pub count: u8,
    /// The points were known, and used again.
    pub again: bool,
    /// Both bodies have faces, edges and corners alone.
    pub is_angular: bool,
    /// Body a is the smaller one.
    pub a_is_small: bool,
    /// Unit normal from b to a.
    pub normal: S::Vector,
    /// Smallest gap \[m\].
    pub deepest: f64,
}

impl<S: Geometry> Met<S> {
    /// Its bodies.
    #[inline]
    pub fn pair(&self) -> (usize, usize) {
        (self.a as usize, self.b as usize)
    }
}

/// Where the points of a face are.
#[derive(Clone, Copy)]
pub(crate) struct Spots<S: Geometry> {
    /// How many there are.
    pub count: usize,
    /// Unit normal from b to a.
    pub normal: S::Vector,
    /// The points that both bodies use \[m\].
    pub points: S::Points<S::Vector>,
    /// Distances of the surfaces \[m\].
    pub gaps: S::Points<f64>,
}

impl<S: Geometry> Spots<S> {
    /// No points yet.
    #[inline]
    pub fn new(normal: S::Vector) -> Self {
        Spots {
            count: 0,
            normal,
            points: S::Points::all(S::Vector::ZERO),
            gaps: S::Points::all(f64::INFINITY),
        }
    }

    /// Those of a face that was looked at in this step.
    pub fn of(seen: &Seen<S>) -> Self {
        Spots { count: seen.names().len(), normal: seen.normal, points: seen.points, gaps: seen.gaps }
    }

    /// Adds a point, where there is room.
    #[inline]
    pub fn add(&mut self, point: S::Vector, gap: f64) {
        if self.count < S::Points::<f64>::LEN {
            (self.points[self.count], self.gaps[self.count]) = (point, gap);
            self.count += 1;
        }
    }

    /// The mean of the points \[m\].
    pub fn centre(&self) -> S::Vector {
        let mean = Outline::of_one(self).mean();
        S::Vector::from_fn(|k| mean[k])
    }
}

/// Points of patches and their normals, side by side.
#[derive(Clone, Copy)]
pub(crate) struct Outline<S: Geometry, R: Plain> {
    /// How many points there are.
    pub count: R,
    /// Unit normals from bodies b to bodies a.
    pub normal: S::Vectors<R>,
    /// The points \[m\].
    pub points: S::Points<S::Vectors<R>>,
    /// Distances of the surfaces \[m\].
    pub gaps: S::Points<R>,
}

impl<S: Geometry> Outline<S, f64> {
    /// Of one patch.
    pub fn of_one(spots: &Spots<S>) -> Self {
        let numbers = |v: &S::Vector| -> S::Vectors<f64> { One(v).several(|v, k| v[k]) };
        let mut points = S::Points::all(numbers(&spots.points[0]));
        for i in 1..S::Points::<f64>::LEN {
            points[i] = numbers(&spots.points[i]);
        }
        Outline { count: spots.count as f64, normal: numbers(&spots.normal), points, gaps: spots.gaps }
    }
}

impl<S: Geometry, R: Precise> Outline<S, R> {
    /// Of patches that were seen.
    #[inline(always)]
    pub fn of<'a>(sights: impl Abreast<Sight<'a, S>, Number = R>) -> Self
    where
        S: 'a,
    {
        let mut points = S::Points::all(sights.several(|s, k| s.seen.points[0][k]));
        for i in 1..S::Points::<f64>::LEN {
            points[i] = sights.several(|s, k| s.seen.points[i][k]);
        }
        Outline {
            count: sights.read(|s| s.seen.names().len() as f64),
            normal: sights.several(|s, k| s.seen.normal[k]),
            points,
            gaps: sights.several(|s, i| s.seen.gaps[i]),
        }
    }

    /// Where patches have a k-th point `yes`, elsewhere `no`.
    #[inline(always)]
    pub fn where_has(&self, k: usize, yes: R, no: R) -> R {
        self.count.constant(k as f32).choose(self.count, yes, no)
    }

    /// The means of the points \[m\].
    #[inline(always)]
    pub fn mean(&self) -> S::Vectors<R> {
        let (zero, one) = (self.count.constant(0.0), self.count.constant(1.0));
        let mut mean = self.points[0];
        for i in 1..S::Points::<f64>::LEN {
            for k in 0..S::DIM {
                mean[k] = mean[k] + self.where_has(i, self.points[i][k], zero);
            }
        }
        times(&mean, one / self.count)
    }
}

/// Faces as patches take them: their points about their means, along their tangents.
pub(crate) struct Laid<S: Geometry, R: Precise> {
    /// Unit normals from bodies b to bodies a, and unit tangents.
    pub normal: S::Vectors<R>,
    pub tangents: S::Slips<S::Vectors<R>>,
    /// The means of the points \[m\].
    pub centre: S::Vectors<R>,
    /// Places of the points from there along the tangents \[m\].
    pub places: S::Points<S::Slips<R>>,
    /// Distances of the surfaces \[m\].
    pub gaps: S::Points<R>,
}

impl<S: Geometry, R: Precise> Laid<S, R> {
    /// Of points, about a mean, whose places along the tangents are their products with `along`.
    #[inline(always)]
    pub fn new(
        of: &Outline<S, R>,
        (normal, tangents): (S::Vectors<R>, S::Slips<S::Vectors<R>>),
        (mean, centre): (S::Vectors<R>, S::Vectors<R>),
        along: S::Slips<S::Vectors<R>>,
        gaps: S::Points<R>,
    ) -> Self {
        let mut places = S::Points::all(S::Slips::all(of.count));
        for i in 0..S::Points::<f64>::LEN {
            let arm = minus(&of.points[i], &mean);
            for k in 0..S::SLIP {
                places[i][k] = inner(&arm, &along[k]);
            }
        }
        Laid { normal, tangents, centre, places, gaps }
    }

    /// Of points that were just found.
    #[inline(always)]
    pub fn of(found: &Outline<S, R>) -> Self {
        let (centre, tangents) = (found.mean(), S::tangents(&found.normal));
        Laid::new(found, (found.normal, tangents), (centre, centre), tangents, found.gaps)
    }

    /// The smallest gaps \[m\].
    #[inline(always)]
    pub fn deepest(&self, of: &Outline<S, R>) -> R {
        let mut deepest = of.count.constant(f32::INFINITY);
        for k in 0..S::Points::<f64>::LEN {
            let gap = of.where_has(k, self.gaps[k], deepest);
            deepest = gap.choose(deepest, gap, deepest);
        }
        deepest
    }
}

/// A face as it is told of, its points in the order of their ids.
#[derive(Clone, Copy)]
pub(crate) struct Face<S: Geometry> {
    /// Indices of bodies a and b.
    pub pair: (usize, usize),
    /// Names of the points from step to step.
    ids: S::Points<u64>,
    /// The points.
    pub spots: Spots<S>,
    /// What the surfaces do to each other.
    coefficients: Coefficients,
}

impl<S: Geometry> Face<S> {
    /// From what a step kept of it, and what was seen; `places` tells where a body began the step.
    pub fn of(
        met: &Met<S>,
        seen: &Seen<S>,
        coefficients: Coefficients,
        places: impl Fn(usize) -> (S::Vector, S::Rotation),
    ) -> Self {
        let pair = met.pair();
        let spots = if met.again {
            let (a, b) = (places(pair.0), places(pair.1));
            let then = Then::of(One(&Sight { seen, a_is_small: met.a_is_small }));
            let now = Now([(&a.0, &a.1), (&b.0, &b.1)]);
            Together::between(&then, One(&now)).spots(&then.outline, seen.names().len())
        } else {
            Spots::of(seen)
        };
        Face { pair, ids: seen.ids, spots, coefficients }
    }

    /// How many points it has.
    pub fn len(&self) -> usize {
        self.spots.count
    }

    /// One of its points as a touch.
    pub fn touch(&self, k: usize) -> Touch<S> {
        let (a, b) = self.pair;
        let Coefficients { friction, rolling, spinning, restitution, tangential_restitution } =
            self.coefficients;
        Touch {
            id: self.ids[k],
            a,
            b,
            point: self.spots.points[k],
            normal: self.spots.normal,
            gap: self.spots.gaps[k],
            friction,
            rolling,
            spinning,
            restitution,
            tangential_restitution,
        }
    }
}
