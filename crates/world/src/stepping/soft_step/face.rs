//! Faces of contact: the points that two bodies share with one normal, as a step begins with them. What a step needs of a face is in its
//! patch, in f32, and what the next one needs is what is remembered of it; the face itself is made again when somebody asks.

use super::again::Together;
use super::memory::Seen;
use crate::material::Coefficients;
use crate::narrow_phase::Touch;
use carom_geometry::Geometry;
use carom_math::{Column, Several};

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
    #[inline(always)]
    pub fn centre(&self) -> S::Vector {
        mean_of::<S>(&self.points, self.count)
    }
}

/// The mean of the first of some points \[m\].
#[inline(always)]
pub(super) fn mean_of<S: Geometry>(points: &S::Points<S::Vector>, count: usize) -> S::Vector {
    let mut mean = points[0];
    // all that there is room for, here and below: a number of rounds that is known leaves all in registers
    for k in 1..S::Points::<f64>::LEN {
        if k < count {
            mean += points[k];
        }
    }
    mean * (1.0 / count as f64)
}

/// A face as a patch takes it: its points about their mean, along its tangents.
#[derive(Clone, Copy)]
pub(crate) struct Laid<S: Geometry> {
    /// Points that it has.
    pub count: usize,
    /// Unit normal from b to a, and unit tangents.
    pub normal: S::Vector,
    pub tangents: [S::Vector; 2],
    /// The mean of the points \[m\].
    pub centre: S::Vector,
    /// Places of the points from there along the tangents \[m\].
    pub places: S::Points<S::Slips<f32>>,
    /// Distances of the surfaces \[m\].
    pub gaps: S::Points<f64>,
}

impl<S: Geometry> Laid<S> {
    /// Of points, about a mean, whose places along the tangents are their products with `along`.
    #[inline(always)]
    pub fn new(
        (count, points): (usize, &S::Points<S::Vector>),
        (normal, tangents): (S::Vector, [S::Vector; 2]),
        (mean, centre): (S::Vector, S::Vector),
        along: [S::Vector; 2],
        gap: impl Fn(usize) -> f64,
    ) -> Self {
        let mut places = S::Points::all(S::Slips::all(0.0));
        let mut gaps = S::Points::all(f64::INFINITY);
        for i in 0..S::Points::<f64>::LEN {
            let arm = points[i] - mean;
            for k in 0..S::SLIP {
                places[i][k] = arm.dot(along[k]) as f32;
            }
            gaps[i] = gap(i);
        }
        Laid { count, normal, tangents, centre, places, gaps }
    }

    /// Of points that were just found.
    pub fn of(spots: &Spots<S>) -> Self {
        let (centre, tangents) = (spots.centre(), tangents_of::<S>(spots.normal));
        let points = (spots.count, &spots.points);
        Laid::new(points, (spots.normal, tangents), (centre, centre), tangents, |i| spots.gaps[i])
    }

    /// The smallest gap \[m\].
    #[inline(always)]
    pub fn deepest(&self) -> f64 {
        let mut deepest = f64::INFINITY;
        for k in 0..S::Points::<f64>::LEN {
            deepest = if k < self.count { deepest.min(self.gaps[k]) } else { deepest };
        }
        deepest
    }
}

/// Unit tangents of a normal; those that a space lacks are the normal.
#[inline(always)]
pub(super) fn tangents_of<S: Geometry>(normal: S::Vector) -> [S::Vector; 2] {
    let tangent = |k: usize| if k < S::SLIP { S::tangent(normal, k) } else { normal };
    // an array's `map` is a call where it is not small
    [tangent(0), tangent(1)]
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
            Together::between(seen, [places(pair.0), places(pair.1)], met.a_is_small).spots(seen)
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
