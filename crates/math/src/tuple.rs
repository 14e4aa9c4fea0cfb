//! Short columns of f64 numbers with a length known to the compiler: the one vector type of carom.
//! `Tuple<N>` serves as vector, spin and slip; `Column` is what generic code may ask of it.

use serde::{Deserialize, Serialize};
use std::fmt::Debug;
use std::ops::{Add, AddAssign, Index, IndexMut, Mul, Neg, Sub, SubAssign};

/// What generic code may do with a short column of numbers.
pub trait Column:
    Copy
    + Debug
    + Default
    + PartialEq
    + Send
    + Sync
    + 'static
    + Add<Output = Self>
    + Sub<Output = Self>
    + Neg<Output = Self>
    + Mul<f64, Output = Self>
    + AddAssign
    + SubAssign
    + Index<usize, Output = f64>
    + IndexMut<usize>
    + Serialize
    + for<'de> Deserialize<'de>
{
    /// Number of components.
    const LEN: usize;
    /// The column of zeros.
    const ZERO: Self;
    /// Builds a column from a function of the component's index.
    fn from_fn(f: impl FnMut(usize) -> f64) -> Self;
    /// The components as a slice of length `LEN`.
    fn as_slice(&self) -> &[f64];
    /// The components as a mutable slice of length `LEN`.
    fn as_mut_slice(&mut self) -> &mut [f64];
    /// Scalar product.
    fn dot(self, other: Self) -> f64;
    /// Squared Euclidean length.
    fn norm_squared(self) -> f64 {
        self.dot(self)
    }
    /// Euclidean length.
    fn norm(self) -> f64 {
        self.norm_squared().sqrt()
    }
    /// True when no component is infinite or NaN.
    fn is_finite(self) -> bool;
    /// Reads a column from the first `LEN` numbers of a slice; `None` when the length differs.
    fn from_slice(values: &[f64]) -> Option<Self> {
        (values.len() == Self::LEN).then(|| Self::from_fn(|i| values[i]))
    }
    /// The unit vector along this one, or `None` when its length is zero or not finite.
    fn normalized(self) -> Option<Self> {
        let n = self.norm();
        (n > 0.0 && n.is_finite()).then(|| self * (1.0 / n))
    }
    /// Largest absolute component.
    fn max_abs(self) -> f64 {
        self.as_slice().iter().fold(0.0, |m: f64, x| m.max(x.abs()))
    }
}

/// A column of `N` numbers, laid out as a plain array so that slices of it are slices of f64.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(transparent)]
pub struct Tuple<const N: usize>(pub [f64; N]);

/// One number: the spin and the slip of the plane.
pub type Vec1 = Tuple<1>;
/// Two numbers.
pub type Vec2 = Tuple<2>;
/// Three numbers.
pub type Vec3 = Tuple<3>;

/// Builds a one-number column.
#[inline]
pub const fn vec1(x: f64) -> Vec1 {
    Tuple([x])
}
/// Builds a two-number column.
#[inline]
pub const fn vec2(x: f64, y: f64) -> Vec2 {
    Tuple([x, y])
}
/// Builds a three-number column.
#[inline]
pub const fn vec3(x: f64, y: f64, z: f64) -> Vec3 {
    Tuple([x, y, z])
}

impl Vec3 {
    /// Vector product.
    #[inline]
    pub fn cross(self, o: Vec3) -> Vec3 {
        let ([a, b, c], [x, y, z]) = (self.0, o.0);
        vec3(b * z - c * y, c * x - a * z, a * y - b * x)
    }
}
impl Vec2 {
    /// Scalar vector product a_x b_y - a_y b_x.
    #[inline]
    pub fn cross(self, o: Vec2) -> f64 {
        self.0[0] * o.0[1] - self.0[1] * o.0[0]
    }
    /// The vector turned by a quarter turn to the left, (-y, x).
    #[inline]
    pub fn perp(self) -> Vec2 {
        vec2(-self.0[1], self.0[0])
    }
}

impl<const N: usize> Default for Tuple<N> {
    fn default() -> Self {
        Tuple([0.0; N])
    }
}
impl<const N: usize> Add for Tuple<N> {
    type Output = Self;
    #[inline]
    fn add(self, o: Self) -> Self {
        Tuple(std::array::from_fn(|i| self.0[i] + o.0[i]))
    }
}
impl<const N: usize> Sub for Tuple<N> {
    type Output = Self;
    #[inline]
    fn sub(self, o: Self) -> Self {
        Tuple(std::array::from_fn(|i| self.0[i] - o.0[i]))
    }
}
impl<const N: usize> Neg for Tuple<N> {
    type Output = Self;
    #[inline]
    fn neg(self) -> Self {
        Tuple(std::array::from_fn(|i| -self.0[i]))
    }
}
impl<const N: usize> Mul<f64> for Tuple<N> {
    type Output = Self;
    #[inline]
    fn mul(self, s: f64) -> Self {
        Tuple(std::array::from_fn(|i| self.0[i] * s))
    }
}
impl<const N: usize> AddAssign for Tuple<N> {
    #[inline]
    fn add_assign(&mut self, o: Self) {
        *self = *self + o;
    }
}
impl<const N: usize> SubAssign for Tuple<N> {
    #[inline]
    fn sub_assign(&mut self, o: Self) {
        *self = *self - o;
    }
}
impl<const N: usize> Index<usize> for Tuple<N> {
    type Output = f64;
    #[inline]
    fn index(&self, i: usize) -> &f64 {
        &self.0[i]
    }
}
impl<const N: usize> IndexMut<usize> for Tuple<N> {
    #[inline]
    fn index_mut(&mut self, i: usize) -> &mut f64 {
        &mut self.0[i]
    }
}
impl<const N: usize> Serialize for Tuple<N> {
    fn serialize<T: serde::Serializer>(&self, s: T) -> Result<T::Ok, T::Error> {
        s.collect_seq(self.0)
    }
}
impl<'de, const N: usize> Deserialize<'de> for Tuple<N> {
    fn deserialize<D: serde::Deserializer<'de>>(d: D) -> Result<Self, D::Error> {
        let values = Vec::<f64>::deserialize(d)?;
        let len = values.len();
        let array: Result<[f64; N], _> = values.try_into();
        array.map(Tuple).map_err(|_| serde::de::Error::custom(format!("expected {N} numbers, got {len}")))
    }
}
impl<const N: usize> Column for Tuple<N> {
    const LEN: usize = N;
    const ZERO: Self = Tuple([0.0; N]);
    #[inline]
    fn from_fn(f: impl FnMut(usize) -> f64) -> Self {
        Tuple(std::array::from_fn(f))
    }
    #[inline]
    fn as_slice(&self) -> &[f64] {
        &self.0
    }
    #[inline]
    fn as_mut_slice(&mut self) -> &mut [f64] {
        &mut self.0
    }
    #[inline]
    fn dot(self, o: Self) -> f64 {
        let mut s = 0.0;
        for i in 0..N {
            s += self.0[i] * o.0[i];
        }
        s
    }
    #[inline]
    fn is_finite(self) -> bool {
        self.0.iter().all(|x| x.is_finite())
    }
}
