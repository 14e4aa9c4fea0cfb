//! A face of contact: the points that two bodies share with one normal, as a step begins with them. What a step needs of
//! them is in its patch, in f32; a face keeps what it is told by afterwards, and what is remembered of it.

use crate::material::Coefficients;
use crate::narrow_phase::Touch;
use carom_geometry::Geometry;
use carom_math::{Column, Several};

/// Not in any list.
pub(crate) const NONE: u32 = u32::MAX;

/// Points that two bodies share with one normal, in the order of their ids.
#[derive(Clone, Copy)]
pub(crate) struct Face<S: Geometry> {
    /// Index of body a.
    pub a: u32,
    /// Index of body b.
    pub b: u32,
    /// Points that it has.
    pub count: u32,
    /// Place of the remembered patch whose points are used again; `NONE` of a face that was found anew.
    pub again: u32,
    /// Names of the points from step to step.
    pub ids: S::Points<u64>,
    /// Unit normal from b to a.
    pub normal: S::Vector,
    /// The points that both bodies use \[m\].
    pub points: S::Points<S::Vector>,
    /// Distances of the surfaces \[m\].
    pub gaps: S::Points<f64>,
    /// What the surfaces do to each other.
    pub coefficients: Coefficients,
}

impl<S: Geometry> Face<S> {
    /// A face without points.
    #[inline]
    pub fn new((a, b): (usize, usize), normal: S::Vector, coefficients: Coefficients) -> Self {
        Face {
            a: a as u32,
            b: b as u32,
            count: 0,
            again: NONE,
            ids: S::Points::all(0),
            normal,
            points: S::Points::all(S::Vector::ZERO),
            gaps: S::Points::all(f64::INFINITY),
            coefficients,
        }
    }

    /// Adds a point; false where there is no room.
    #[inline]
    pub fn add(&mut self, id: u64, point: S::Vector, gap: f64) -> bool {
        let k = self.len();
        if k == S::Points::<f64>::LEN {
            return false;
        }
        (self.ids[k], self.points[k], self.gaps[k]) = (id, point, gap);
        self.count += 1;
        true
    }

    /// How many points it has.
    #[inline]
    pub fn len(&self) -> usize {
        self.count as usize
    }

    /// Its bodies.
    #[inline]
    pub fn pair(&self) -> (usize, usize) {
        (self.a as usize, self.b as usize)
    }

    /// The mean of its points \[m\].
    #[inline]
    pub fn centre(&self) -> S::Vector {
        let mut centre = self.points[0];
        for k in 1..self.len() {
            centre += self.points[k];
        }
        centre * (1.0 / f64::from(self.count))
    }

    /// Its smallest gap \[m\].
    pub fn deepest(&self) -> f64 {
        self.gaps.slice()[..self.len()].iter().copied().fold(f64::INFINITY, f64::min)
    }

    /// One of its points as a touch.
    pub fn touch(&self, k: usize) -> Touch<S> {
        let (a, b) = self.pair();
        let Coefficients { friction, rolling, spinning, restitution, tangential_restitution } =
            self.coefficients;
        Touch {
            id: self.ids[k],
            a,
            b,
            point: self.points[k],
            normal: self.normal,
            gap: self.gaps[k],
            friction,
            rolling,
            spinning,
            restitution,
            tangential_restitution,
        }
    }
}
