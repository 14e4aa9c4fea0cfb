//! Moments of a region of the plane or of space about a stated origin (theory chapter 1):
//!   measure V = int dx,   first F = int x dx,   second S = int x x^T dx.
//! Centre = F / V; inertia about it: tr(C) in the plane, tr(C) 1 - C in space, C = S - F F^T / V.
//! Two facts build every closed form of this crate. A simplex of k + 1 corners v and measure m has
//!   F = m s / (k + 1),   S = m (sum v v^T + s s^T) / ((k + 1)(k + 2)),   s = sum v,
//! and the points a + b of two regions that lie at right angles have the moments of the product measure
//!   V = V_a V_b,   F = F_a V_b + V_a F_b,   S = S_a V_b + F_a F_b^T + F_b F_a^T + V_a S_b.
//! Knows no shapes.

use crate::geometry::ShapeError;
use crate::mass::MassProperties;
use carom_math::{Column, Moment, Planar, Spatial, Sym3, Tuple};

/// Measure, first and second moment of a region of N-space, or of mass spread over it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Moments<const N: usize> {
    /// Point about which the moments are taken \[m\].
    pub origin: Tuple<N>,
    /// Measure of the region: length, area or volume \[m^k\]; mass \[kg\] after a density.
    pub measure: f64,
    /// First moment about the origin \[measure m\].
    pub first: Tuple<N>,
    /// Second moment about the origin, row by row \[measure m^2\].
    pub second: [[f64; N]; N],
}

/// a b^T.
pub(crate) fn outer<const N: usize>(a: Tuple<N>, b: Tuple<N>) -> [[f64; N]; N] {
    std::array::from_fn(|i| std::array::from_fn(|j| a[i] * b[j]))
}

/// Sum of k_i M_i over square matrices.
pub(crate) fn combined<const N: usize>(terms: &[(f64, [[f64; N]; N])]) -> [[f64; N]; N] {
    std::array::from_fn(|i| std::array::from_fn(|j| terms.iter().map(|(k, m)| k * m[i][j]).sum()))
}

impl<const N: usize> Moments<N> {
    /// The empty region.
    pub fn zero(origin: Tuple<N>) -> Self {
        Moments { origin, measure: 0.0, first: Tuple::ZERO, second: [[0.0; N]; N] }
    }
    /// A simplex of any dimension (point, segment, triangle, tetrahedron) with this measure, which may be
    /// negative.
    pub fn simplex(origin: Tuple<N>, measure: f64, corners: &[Tuple<N>]) -> Self {
        let count = corners.len() as f64;
        let mut sum = Tuple::ZERO;
        let mut second = [[0.0; N]; N];
        for &corner in corners {
            let v = corner - origin;
            sum += v;
            second = combined(&[(1.0, second), (1.0, outer(v, v))]);
        }
        let k = measure / (count * (count + 1.0));
        let second = combined(&[(k, second), (k, outer(sum, sum))]);
        Moments { origin, measure, first: sum * (measure / count), second }
    }
    /// The points a + b, a in this region and b in `offset` (about zero), where the two lie at right angles or
    /// one of them is a point.
    pub fn swept(&self, offset: &Self) -> Self {
        debug_assert!(offset.origin == Tuple::ZERO, "offsets are measured from zero");
        Moments {
            origin: self.origin,
            measure: self.measure * offset.measure,
            first: self.first * offset.measure + offset.first * self.measure,
            second: combined(&[
                (offset.measure, self.second),
                (1.0, outer(self.first, offset.first)),
                (1.0, outer(offset.first, self.first)),
                (self.measure, offset.second),
            ]),
        }
    }
    /// Two regions together; the other is first brought to this origin.
    pub fn plus(&self, other: &Self) -> Self {
        let other = other.about(self.origin);
        Moments {
            origin: self.origin,
            measure: self.measure + other.measure,
            first: self.first + other.first,
            second: combined(&[(1.0, self.second), (1.0, other.second)]),
        }
    }
    /// Every moment times a factor: a density, or -1 for a hole.
    pub fn scaled(&self, k: f64) -> Self {
        Moments {
            origin: self.origin,
            measure: self.measure * k,
            first: self.first * k,
            second: combined(&[(k, self.second)]),
        }
    }
    /// Adds a point mass.
    #[inline]
    pub(crate) fn add_point(&mut self, mass: f64, point: Tuple<N>) {
        let arm = point - self.origin;
        self.measure += mass;
        for i in 0..N {
            let first = mass * arm[i];
            self.first[i] += first;
            for j in 0..N {
                self.second[i][j] += first * arm[j];
            }
        }
    }
    /// Adds a multiple of moments about the same origin.
    #[inline]
    pub(crate) fn add_scaled(&mut self, k: f64, other: &Self) {
        self.measure += k * other.measure;
        for i in 0..N {
            self.first[i] += k * other.first[i];
            for j in 0..N {
                self.second[i][j] += k * other.second[i][j];
            }
        }
    }
    /// Sizes of the three moments: \[|V|, |F|, |S|\] (Euclidean and Frobenius norms).
    pub(crate) fn sizes(&self) -> [f64; 3] {
        let second: f64 = self.second.iter().flatten().map(|x| x * x).sum();
        [self.measure.abs(), self.first.norm(), second.sqrt()]
    }
    /// The same region's moments about another point.
    pub fn about(&self, origin: Tuple<N>) -> Self {
        if origin == self.origin {
            return *self;
        }
        let d = self.origin - origin;
        Moments {
            origin,
            measure: self.measure,
            first: self.first + d * self.measure,
            second: combined(&[
                (1.0, self.second),
                (1.0, outer(self.first, d)),
                (1.0, outer(d, self.first)),
                (self.measure, outer(d, d)),
            ]),
        }
    }
    /// Centroid \[m\]; not finite when the measure is zero.
    pub fn center(&self) -> Tuple<N> {
        self.origin + self.first * (1.0 / self.measure)
    }
    /// Second moment about the centroid, row by row.
    pub fn central_second(&self) -> [[f64; N]; N] {
        combined(&[(1.0, self.second), (-1.0 / self.measure, outer(self.first, self.first))])
    }
    /// Refuses a region that is empty or turned inside out.
    fn check_positive(&self) -> Result<(), ShapeError> {
        if self.measure > 0.0 && self.measure.is_finite() {
            return Ok(());
        }
        Err(ShapeError::new(
            "measure",
            format!("the mass or enclosed measure must be finite and > 0, got {}", self.measure),
            "check the sizes and the orientation of the boundary",
        ))
    }
}

impl Moments<2> {
    /// Mass properties of the region filled with a constant `density` \[kg/m^2\].
    ///
    /// # Errors
    /// [`ShapeError`] for a density that is not finite and positive, or a region without positive area.
    pub fn mass_properties(&self, density: f64) -> Result<MassProperties<Planar>, ShapeError> {
        check_density(density)?;
        self.check_positive()?;
        let c = self.central_second();
        let inertia = Moment(density * (c[0][0] + c[1][1]));
        Ok(MassProperties { mass: density * self.measure, center: self.center(), inertia, error: 0.0 })
    }
}

impl Moments<3> {
    /// Mass properties of the region filled with a constant `density` \[kg/m^3\].
    ///
    /// # Errors
    /// [`ShapeError`] for a density that is not finite and positive, or a region without positive volume.
    pub fn mass_properties(&self, density: f64) -> Result<MassProperties<Spatial>, ShapeError> {
        check_density(density)?;
        self.check_positive()?;
        let c = self.central_second().map(|row| row.map(|x| density * x));
        let off = |i: usize, j: usize| -0.5 * (c[i][j] + c[j][i]);
        let inertia = Sym3 {
            diagonal: [c[1][1] + c[2][2], c[0][0] + c[2][2], c[0][0] + c[1][1]],
            off: [off(0, 1), off(0, 2), off(1, 2)],
        };
        Ok(MassProperties { mass: density * self.measure, center: self.center(), inertia, error: 0.0 })
    }
}

/// Refuses a density that is not finite and positive.
pub(crate) fn check_density(density: f64) -> Result<(), ShapeError> {
    if density > 0.0 && density.is_finite() {
        return Ok(());
    }
    Err(ShapeError::new(
        "density",
        format!("must be finite and > 0, got {density}"),
        "give the density in kg/m^3 (in the plane kg/m^2), or the body's mass",
    ))
}

/// The error of a shape that encloses nothing.
pub(crate) fn no_mass(name: &str, measure: &str) -> ShapeError {
    ShapeError::new(
        "shape",
        format!("a {name} has no {measure}, so no density gives it a mass"),
        "give the body's mass, centre and inertia explicitly, or make the body fixed",
    )
}

/// The error of a compound of nothing.
pub(crate) fn no_parts() -> ShapeError {
    ShapeError::new("parts", "a compound of no parts has no mass", "give at least one part")
}
