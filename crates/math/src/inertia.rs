//! Inertia about the centre of mass: a number in the plane, a symmetric 3x3 matrix in space
//! (theory chapter 1). Knows no shapes.

use crate::tuple::{Column, Vec1, Vec3, vec1, vec3};
use serde::{Deserialize, Serialize};
use std::fmt::Debug;

/// What generic code may ask of an inertia (or of its inverse).
pub trait Inertia<Spin>:
    Copy + Debug + Default + PartialEq + Send + Sync + 'static + Serialize + for<'de> Deserialize<'de>
{
    /// Number of independent entries: 1 | 6.
    const LEN: usize;
    /// No inertia; also the inverse inertia of a body that nothing can turn.
    const ZERO: Self;
    /// I w: angular momentum of a spin, or I^-1 L.
    fn apply(&self, spin: Spin) -> Spin;
    /// Inverse, or `None` when singular or not finite.
    fn inverse(&self) -> Option<Self>;
    /// Sum of two inertias about the same point.
    fn plus(&self, other: &Self) -> Self;
    /// Every entry times a factor.
    fn scaled(&self, factor: f64) -> Self;
    /// Independent entries: `[I]` | `[xx, yy, zz, xy, xz, yz]`.
    fn entries(&self) -> Vec<f64>;
    /// From independent entries in the order of `entries`; `None` when the count differs.
    fn from_entries(values: &[f64]) -> Option<Self>;
    /// True when every entry is finite.
    fn is_finite(&self) -> bool {
        self.entries().iter().all(|x| x.is_finite())
    }
    /// Why no distribution of positive mass can have this inertia, or `None` when one can
    /// (theory chapter 1: positive, and no principal moment above the sum of the other two).
    fn impossible_because(&self) -> Option<String>;
}

/// Inertia in the plane \[kg m^2\].
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[repr(transparent)]
pub struct Moment(pub f64);

impl Inertia<Vec1> for Moment {
    const LEN: usize = 1;
    const ZERO: Self = Moment(0.0);
    #[inline]
    fn apply(&self, spin: Vec1) -> Vec1 {
        vec1(self.0 * spin.0[0])
    }
    fn inverse(&self) -> Option<Self> {
        let inverse = 1.0 / self.0;
        (self.0 != 0.0 && inverse.is_finite()).then_some(Moment(inverse))
    }
    fn plus(&self, other: &Self) -> Self {
        Moment(self.0 + other.0)
    }
    fn scaled(&self, factor: f64) -> Self {
        Moment(self.0 * factor)
    }
    fn entries(&self) -> Vec<f64> {
        vec![self.0]
    }
    fn from_entries(values: &[f64]) -> Option<Self> {
        (values.len() == 1).then(|| Moment(values[0]))
    }
    fn impossible_because(&self) -> Option<String> {
        if self.0.is_nan() || self.0 <= 0.0 || self.0.is_infinite() {
            return Some(format!("a moment of inertia must be finite and > 0, got {}", self.0));
        }
        None
    }
}

/// Symmetric 3x3 matrix: inertia in space \[kg m^2\], or its inverse.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Sym3 {
    /// Diagonal entries xx, yy, zz.
    pub diagonal: [f64; 3],
    /// Entries xy, xz, yz.
    pub off: [f64; 3],
}

impl Sym3 {
    /// Diagonal matrix.
    pub const fn diag(x: f64, y: f64, z: f64) -> Self {
        Sym3 { diagonal: [x, y, z], off: [0.0; 3] }
    }
    /// Full matrix, row by row.
    pub fn rows(&self) -> [[f64; 3]; 3] {
        let ([a, b, c], [d, e, f]) = (self.diagonal, self.off);
        [[a, d, e], [d, b, f], [e, f, c]]
    }
    /// Symmetric part of a full matrix given row by row.
    pub fn from_rows(m: [[f64; 3]; 3]) -> Self {
        Sym3 {
            diagonal: [m[0][0], m[1][1], m[2][2]],
            off: [0.5 * (m[0][1] + m[1][0]), 0.5 * (m[0][2] + m[2][0]), 0.5 * (m[1][2] + m[2][1])],
        }
    }
    /// True for a multiple of the identity, which turning leaves exactly as it is.
    #[inline]
    pub fn is_isotropic(&self) -> bool {
        let ([a, b, c], off) = (self.diagonal, self.off);
        off == [0.0; 3] && a == b && b == c
    }
    /// R S R^T for a rotation matrix R given row by row.
    pub fn conjugated(&self, r: &[[f64; 3]; 3]) -> Self {
        if self.is_isotropic() {
            return *self;
        }
        let s = self.rows();
        let mut rs = [[0.0; 3]; 3];
        for i in 0..3 {
            for j in 0..3 {
                rs[i][j] = r[i][0] * s[0][j] + r[i][1] * s[1][j] + r[i][2] * s[2][j];
            }
        }
        let entry = |i: usize, j: usize| rs[i][0] * r[j][0] + rs[i][1] * r[j][1] + rs[i][2] * r[j][2];
        Sym3 {
            diagonal: [entry(0, 0), entry(1, 1), entry(2, 2)],
            off: [entry(0, 1), entry(0, 2), entry(1, 2)],
        }
    }
    /// Eigenvalues in ascending order with unit eigenvectors as the columns of a right-handed
    /// rotation matrix (cyclic Jacobi rotations, to rounding).
    pub fn eigen(&self) -> ([f64; 3], [[f64; 3]; 3]) {
        let mut a = self.rows();
        let mut v = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        for _ in 0..60 {
            let off = a[0][1].abs() + a[0][2].abs() + a[1][2].abs();
            if off == 0.0 {
                break;
            }
            for (p, q) in [(0, 1), (0, 2), (1, 2)] {
                jacobi_rotation(&mut a, &mut v, p, q);
            }
        }
        let mut order = [0, 1, 2];
        order.sort_by(|&i, &j| a[i][i].total_cmp(&a[j][j]));
        let values = order.map(|i| a[i][i]);
        let mut columns = order.map(|i| vec3(v[0][i], v[1][i], v[2][i]));
        if columns[0].cross(columns[1]).dot(columns[2]) < 0.0 {
            columns[2] = -columns[2];
        }
        let rotation = std::array::from_fn(|i| std::array::from_fn(|j| columns[j][i]));
        (values, rotation)
    }
}

/// One Jacobi rotation that annihilates a\[p\]\[q\] and accumulates into v.
fn jacobi_rotation(a: &mut [[f64; 3]; 3], v: &mut [[f64; 3]; 3], p: usize, q: usize) {
    if a[p][q] == 0.0 {
        return;
    }
    let theta = (a[q][q] - a[p][p]) / (2.0 * a[p][q]);
    let t = if theta.abs() > 1e150 {
        0.5 / theta
    } else {
        theta.signum() / (theta.abs() + (theta * theta + 1.0).sqrt())
    };
    let c = 1.0 / (t * t + 1.0).sqrt();
    let s = t * c;
    for row in a.iter_mut() {
        let (x, y) = (row[p], row[q]);
        row[p] = c * x - s * y;
        row[q] = s * x + c * y;
    }
    let (x, y) = (a[p], a[q]);
    a[p] = std::array::from_fn(|k| c * x[k] - s * y[k]);
    a[q] = std::array::from_fn(|k| s * x[k] + c * y[k]);
    a[p][q] = 0.0;
    a[q][p] = 0.0;
    for row in v.iter_mut() {
        let (x, y) = (row[p], row[q]);
        row[p] = c * x - s * y;
        row[q] = s * x + c * y;
    }
}

impl Inertia<Vec3> for Sym3 {
    const LEN: usize = 6;
    const ZERO: Self = Sym3 { diagonal: [0.0; 3], off: [0.0; 3] };
    #[inline]
    fn apply(&self, s: Vec3) -> Vec3 {
        let ([a, b, c], [d, e, f]) = (self.diagonal, self.off);
        let [x, y, z] = s.0;
        vec3(a * x + d * y + e * z, d * x + b * y + f * z, e * x + f * y + c * z)
    }
    fn inverse(&self) -> Option<Self> {
        let ([a, b, c], [d, e, f]) = (self.diagonal, self.off);
        if self.off == [0.0; 3] {
            let inverse = Sym3::diag(1.0 / a, 1.0 / b, 1.0 / c);
            return inverse.diagonal.iter().all(|x| x.is_finite()).then_some(inverse);
        }
        let (caa, cab, cac) = (b * c - f * f, e * f - d * c, d * f - e * b);
        let determinant = a * caa + d * cab + e * cac;
        let k = 1.0 / determinant;
        let inverse = Sym3 {
            diagonal: [caa * k, (a * c - e * e) * k, (a * b - d * d) * k],
            off: [cab * k, cac * k, (d * e - a * f) * k],
        };
        (determinant != 0.0 && inverse.is_finite()).then_some(inverse)
    }
    fn plus(&self, o: &Self) -> Self {
        Sym3 {
            diagonal: std::array::from_fn(|i| self.diagonal[i] + o.diagonal[i]),
            off: std::array::from_fn(|i| self.off[i] + o.off[i]),
        }
    }
    fn scaled(&self, k: f64) -> Self {
        Sym3 { diagonal: self.diagonal.map(|x| x * k), off: self.off.map(|x| x * k) }
    }
    fn entries(&self) -> Vec<f64> {
        self.diagonal.iter().chain(&self.off).copied().collect()
    }
    fn from_entries(v: &[f64]) -> Option<Self> {
        (v.len() == 6).then(|| Sym3 { diagonal: [v[0], v[1], v[2]], off: [v[3], v[4], v[5]] })
    }
    fn impossible_because(&self) -> Option<String> {
        if !self.is_finite() {
            return Some("the inertia tensor has entries that are not finite".into());
        }
        let ([small, middle, large], _) = self.eigen();
        if small <= 0.0 {
            return Some(format!(
                "principal moments must be > 0, got {small:.6e}, {middle:.6e}, {large:.6e}"
            ));
        }
        if large > (small + middle) * (1.0 + 1e-9) {
            return Some(format!(
                "no body has principal moments {small:.6e}, {middle:.6e}, {large:.6e}: the largest exceeds the sum of \
                 the other two"
            ));
        }
        None
    }
}
