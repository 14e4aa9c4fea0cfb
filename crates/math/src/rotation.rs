//! Rotations: q = [c, s] in the plane, a unit quaternion [w, x, y, z] in space (theory chapter 1).
//! Sine, cosine and arc tangent come from `libm`, so that every machine turns by the same bits.

use crate::space::{Planar, Spatial};
use crate::tuple::{Tuple, Vec1, Vec2, Vec3, vec1, vec3};
use crate::wide::Wide;
use serde::{Deserialize, Serialize};
use std::fmt::Debug;

/// What generic code may do with a rotation from body axes to world axes.
pub trait Rotation<Vector, Spin>:
    Copy + Debug + Default + PartialEq + Send + Sync + 'static + Serialize + for<'de> Deserialize<'de>
{
    /// Numbers stored: 2 | 4.
    const LEN: usize;
    /// No rotation.
    const IDENTITY: Self;
    /// R r: body axes to world axes.
    fn rotate(&self, r: Vector) -> Vector;
    /// R^T r: world axes to body axes.
    fn unrotate(&self, r: Vector) -> Vector;
    /// R r - r: how far the rotation takes a point. Of a small rotation it has all its digits.
    fn swing(&self, r: Vector) -> Vector;
    /// Spin from body axes to world axes (the same number in the plane).
    fn rotate_spin(&self, s: Spin) -> Spin;
    /// Spin from world axes to body axes.
    fn unrotate_spin(&self, s: Spin) -> Spin;
    /// This rotation followed by `next` (the product next * self).
    fn then(&self, next: &Self) -> Self;
    /// The inverse rotation.
    fn inverse(&self) -> Self;
    /// The rotation by angle |s| about the axis s (the exponential map), exact to rounding.
    fn about(s: Spin) -> Self;
    /// The rotation by 2 atan(|s|/2) about s: Cayley's rational form of the exponential map.
    fn cayley(s: Spin) -> Self;
    /// The rotation vector in (-pi, pi] that `about` turns into this rotation.
    fn vector(&self) -> Spin;
    /// The notes' Euler step q + h q-dot with unit length restored, q-dot = w x q | w q / 2
    /// (theory eqs. 2.3 to 2.5): turns by atan(h w) | 2 atan(h w / 2).
    fn euler_step(&self, spin: Spin, h: f64) -> Self;
    /// q-dot for a spin: w x q | w q / 2, as unnormalised numbers.
    fn rate(&self, spin: Spin) -> Self;
    /// q + h r without restoring unit length: a stage of a Runge-Kutta method.
    fn plus_scaled(&self, rate: &Self, h: f64) -> Self;
    /// The same rotation with unit length restored; `None` when the length is zero or not finite.
    fn renormalized(&self) -> Option<Self>;
    /// Numbers as stored.
    fn as_slice(&self) -> &[f64];
    /// From stored numbers, unit length restored; `None` for a wrong count, zero or non-finite length.
    fn from_slice(values: &[f64]) -> Option<Self>;
    /// True when no stored number is infinite or NaN.
    fn is_finite(&self) -> bool {
        self.as_slice().iter().all(|x| x.is_finite())
    }
}

/// How far the square of a length may be from 1 for the root's first term to be exact to rounding \[1\].
const NEARLY_UNIT: f64 = 1e-8;

/// What brings numbers to unit length whose squares sum to nearly 1, without root and quotient: 1/sqrt(1 + e) = 1 - e/2
/// + O(e^2). `None` where they do not.
#[inline]
fn to_unit(squared: f64) -> Option<f64> {
    // false for NaN
    ((squared - 1.0).abs() < NEARLY_UNIT).then_some(1.5 - 0.5 * squared)
}

/// Rotation of the plane, [cosine, sine] of the angle.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[repr(transparent)]
pub struct Turn(pub [f64; 2]);

impl Turn {
    /// Rotation by an angle \[rad\].
    pub fn from_angle(angle: f64) -> Self {
        Turn([libm::cos(angle), libm::sin(angle)])
    }
    /// The angle in (-pi, pi] \[rad\].
    pub fn angle(&self) -> f64 {
        libm::atan2(self.0[1], self.0[0])
    }
}
impl Default for Turn {
    fn default() -> Self {
        Self::IDENTITY
    }
}
impl Rotation<Vec2, Vec1> for Turn {
    const LEN: usize = 2;
    const IDENTITY: Self = Turn([1.0, 0.0]);
    #[inline]
    fn rotate(&self, r: Vec2) -> Vec2 {
        Tuple(Planar::rotated(&self.0, &r.0))
    }
    #[inline]
    fn unrotate(&self, r: Vec2) -> Vec2 {
        self.inverse().rotate(r)
    }
    #[inline]
    fn swing(&self, r: Vec2) -> Vec2 {
        Tuple(Planar::swung(&self.0, &r.0))
    }
    fn rotate_spin(&self, s: Vec1) -> Vec1 {
        s
    }
    fn unrotate_spin(&self, s: Vec1) -> Vec1 {
        s
    }
    fn then(&self, next: &Self) -> Self {
        let [a, b] = Planar::product(&next.0, &self.0);
        match to_unit(a * a + b * b) {
            Some(k) => Turn([a * k, b * k]),
            None => Turn([a, b]).renormalized().unwrap_or(Turn([a, b])),
        }
    }
    #[inline]
    fn inverse(&self) -> Self {
        Turn(Planar::back(&self.0))
    }
    fn about(s: Vec1) -> Self {
        Turn::from_angle(s.0[0])
    }
    fn cayley(s: Vec1) -> Self {
        let t = 0.5 * s.0[0];
        let k = 1.0 / (1.0 + t * t);
        Turn([(1.0 - t * t) * k, 2.0 * t * k])
    }
    fn vector(&self) -> Vec1 {
        vec1(self.angle())
    }
    fn euler_step(&self, spin: Vec1, h: f64) -> Self {
        let next = self.plus_scaled(&self.rate(spin), h);
        next.renormalized().unwrap_or(next)
    }
    fn rate(&self, spin: Vec1) -> Self {
        let ([c, s], w) = (self.0, spin.0[0]);
        Turn([-w * s, w * c])
    }
    fn plus_scaled(&self, r: &Self, h: f64) -> Self {
        Turn([self.0[0] + h * r.0[0], self.0[1] + h * r.0[1]])
    }
    fn renormalized(&self) -> Option<Self> {
        let [c, s] = self.0;
        let n = (c * c + s * s).sqrt();
        (n > 0.0 && n.is_finite()).then(|| Turn([c / n, s / n]))
    }
    fn as_slice(&self) -> &[f64] {
        &self.0
    }
    fn from_slice(v: &[f64]) -> Option<Self> {
        if v.len() != 2 {
            return None;
        }
        Turn([v[0], v[1]]).renormalized()
    }
}

/// Square of an angle below which cosine and sine of half of it are 1 and that half, to rounding \[rad^2\].
const SLIGHT: f64 = 1e-17;

/// Rotation of space, unit quaternion [w, x, y, z].
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[repr(transparent)]
pub struct Quaternion(pub [f64; 4]);

impl Quaternion {
    /// Rotation by `angle` \[rad\] about a unit axis.
    pub fn from_axis_angle(axis: Vec3, angle: f64) -> Self {
        let (s, c) = libm::sincos(0.5 * angle);
        Quaternion([c, s * axis.0[0], s * axis.0[1], s * axis.0[2]])
    }
    /// Rotation matrix, row by row.
    pub fn matrix(&self) -> [[f64; 3]; 3] {
        let [w, x, y, z] = self.0;
        [
            [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)],
            [2.0 * (x * y + w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x)],
            [2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)],
        ]
    }
    /// From a rotation matrix given row by row (Shepperd's choice of the largest component).
    pub fn from_matrix(m: &[[f64; 3]; 3]) -> Self {
        let trace = m[0][0] + m[1][1] + m[2][2];
        let q = if trace > m[0][0].max(m[1][1]).max(m[2][2]) {
            [1.0 + trace, m[2][1] - m[1][2], m[0][2] - m[2][0], m[1][0] - m[0][1]]
        } else if m[0][0] >= m[1][1] && m[0][0] >= m[2][2] {
            [m[2][1] - m[1][2], 1.0 + m[0][0] - m[1][1] - m[2][2], m[0][1] + m[1][0], m[0][2] + m[2][0]]
        } else if m[1][1] >= m[2][2] {
            [m[0][2] - m[2][0], m[0][1] + m[1][0], 1.0 + m[1][1] - m[0][0] - m[2][2], m[1][2] + m[2][1]]
        } else {
            [m[1][0] - m[0][1], m[0][2] + m[2][0], m[1][2] + m[2][1], 1.0 + m[2][2] - m[0][0] - m[1][1]]
        };
        Quaternion(q).renormalized().unwrap_or(Self::IDENTITY)
    }
    /// Hamilton product self * other, without renormalisation.
    #[inline]
    pub fn product(&self, o: &Self) -> Self {
        Quaternion(Spatial::product(&self.0, &o.0))
    }
}
/// The rotation by an angle that is not slight, of this square \[rad^2\].
fn about_far(s: Vec3, square: f64) -> Quaternion {
    let angle = square.sqrt();
    let (sine, cosine) = libm::sincos(0.5 * angle);
    // sin(a/2)/a near zero by its series, which is exact to rounding below 1e-4
    let k = if angle < 1e-4 { 0.5 - angle * angle / 48.0 } else { sine / angle };
    let [x, y, z] = s.0;
    Quaternion([cosine, k * x, k * y, k * z])
}

impl Default for Quaternion {
    fn default() -> Self {
        Self::IDENTITY
    }
}
impl Rotation<Vec3, Vec3> for Quaternion {
    const LEN: usize = 4;
    const IDENTITY: Self = Quaternion([1.0, 0.0, 0.0, 0.0]);
    #[inline]
    fn rotate(&self, r: Vec3) -> Vec3 {
        Tuple(Spatial::rotated(&self.0, &r.0))
    }
    #[inline]
    fn unrotate(&self, r: Vec3) -> Vec3 {
        self.inverse().rotate(r)
    }
    #[inline]
    fn swing(&self, r: Vec3) -> Vec3 {
        Tuple(Spatial::swung(&self.0, &r.0))
    }
    #[inline]
    fn rotate_spin(&self, s: Vec3) -> Vec3 {
        self.rotate(s)
    }
    #[inline]
    fn unrotate_spin(&self, s: Vec3) -> Vec3 {
        self.unrotate(s)
    }
    #[inline]
    fn then(&self, next: &Self) -> Self {
        let q = next.product(self);
        let [w, x, y, z] = q.0;
        match to_unit((w * w + x * x) + (y * y + z * z)) {
            Some(k) => Quaternion(q.0.map(|x| x * k)),
            None => q.renormalized().unwrap_or(q),
        }
    }
    #[inline]
    fn inverse(&self) -> Self {
        Quaternion(Spatial::back(&self.0))
    }
    #[inline]
    fn about(s: Vec3) -> Self {
        let [x, y, z] = s.0;
        let square = x * x + y * y + z * z;
        if square < SLIGHT { Quaternion([1.0, 0.5 * x, 0.5 * y, 0.5 * z]) } else { about_far(s, square) }
    }
    fn cayley(s: Vec3) -> Self {
        let [x, y, z] = s.0;
        let q = Quaternion([1.0, 0.5 * x, 0.5 * y, 0.5 * z]);
        q.renormalized().unwrap_or(q)
    }
    fn vector(&self) -> Vec3 {
        let sign = if self.0[0] < 0.0 { -1.0 } else { 1.0 };
        let [w, x, y, z] = self.0.map(|c| c * sign);
        let sine = (x * x + y * y + z * z).sqrt();
        let k = if sine < 1e-9 { 2.0 / w } else { 2.0 * libm::atan2(sine, w) / sine };
        vec3(k * x, k * y, k * z)
    }
    fn euler_step(&self, spin: Vec3, h: f64) -> Self {
        let next = self.plus_scaled(&self.rate(spin), h);
        next.renormalized().unwrap_or(next)
    }
    fn rate(&self, spin: Vec3) -> Self {
        let [x, y, z] = spin.0;
        Quaternion([0.0, 0.5 * x, 0.5 * y, 0.5 * z]).product(self)
    }
    fn plus_scaled(&self, r: &Self, h: f64) -> Self {
        Quaternion(std::array::from_fn(|i| self.0[i] + h * r.0[i]))
    }
    fn renormalized(&self) -> Option<Self> {
        let n = self.0.iter().map(|x| x * x).sum::<f64>().sqrt();
        (n > 0.0 && n.is_finite()).then(|| Quaternion(self.0.map(|x| x / n)))
    }
    fn as_slice(&self) -> &[f64] {
        &self.0
    }
    fn from_slice(v: &[f64]) -> Option<Self> {
        if v.len() != 4 {
            return None;
        }
        Quaternion([v[0], v[1], v[2], v[3]]).renormalized()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn turns_one_after_another_stay_rotations() {
        let (mut turn, mut quaternion) = (Turn::from_angle(0.3), Quaternion::about(vec3(0.3, -0.2, 0.1)));
        let (by, about) = (Turn::from_angle(0.7), Quaternion::about(vec3(-0.4, 0.5, 0.6)));
        for _ in 0..100_000 {
            (turn, quaternion) = (turn.then(&by), quaternion.then(&about));
            let off = |numbers: &[f64]| numbers.iter().map(|x| x * x).sum::<f64>() - 1.0;
            assert!(off(turn.as_slice()).abs() < 1e-15 && off(quaternion.as_slice()).abs() < 1e-15);
        }
        let angle = libm::remainder(0.3 + 0.7 * 1e5, 2.0 * std::f64::consts::PI);
        assert!((turn.angle() - angle).abs() < 1e-9);
    }

    #[test]
    fn numbers_that_are_no_rotation_are_brought_to_one_by_their_length() {
        let long = Quaternion([1.0, 1.0, 0.0, 0.0]);
        let then = long.then(&Quaternion::IDENTITY);
        assert!((then.0[0] - std::f64::consts::FRAC_1_SQRT_2).abs() < 1e-15);
        assert!((Turn([3.0, 4.0]).then(&Turn::IDENTITY).0[0] - 0.6).abs() < 1e-15);
        assert!(Turn([f64::NAN, 0.0]).then(&Turn::IDENTITY).0[0].is_nan());
    }
}
