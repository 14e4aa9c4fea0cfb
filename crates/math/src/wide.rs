//! What a solver in lanes must know of the plane and of space: short arrays of any number, and the frame of a patch of
//! contact. A patch lies at a centre c with unit normal n (from b to a) and tangents t. Its local twist, of a relative
//! to b, comes in two groups: what normal impulses at the patch's points see, (V.n, W.t1, W.t2) in space and (V.n, W)
//! in the plane, and what friction sees, (V.t1, V.t2, W.n) and (V.t). Both groups of impulses are the conjugates.
//! Knows no bodies and no law.

use crate::lanes::{Eight, Four, Lanes, Quad, Real};
use crate::record::Record;
use crate::several::{Plain, Several};
use crate::space::{Planar, Spatial};
use std::ops::{Add, Div, Mul, Neg, Sub};

/// A number: f32, f64, or several of them side by side.
pub trait Number:
    Plain + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> + Div<Output = Self> + Neg<Output = Self>
{
    /// A constant of this kind.
    fn constant(self, x: f32) -> Self;
    /// Where self < other: `yes`, elsewhere `no`.
    fn choose(self, other: Self, yes: Self, no: Self) -> Self;
}

macro_rules! single {
    ($number:ty) => {
        impl Number for $number {
            #[inline(always)]
            fn constant(self, x: f32) -> Self {
                x.into()
            }
            #[inline(always)]
            fn choose(self, other: Self, yes: Self, no: Self) -> Self {
                if self < other { yes } else { no }
            }
        }
    };
}
single!(f32);
single!(f64);

impl<L: Lanes> Number for Real<L> {
    #[inline(always)]
    fn constant(self, x: f32) -> Self {
        self.like(x)
    }
    #[inline(always)]
    fn choose(self, other: Self, yes: Self, no: Self) -> Self {
        self.if_less(other, yes, no)
    }
}

impl<F: Four> Number for F {
    #[inline(always)]
    fn constant(self, x: f32) -> Self {
        self.like(f64::from(x))
    }
    #[inline(always)]
    fn choose(self, other: Self, yes: Self, no: Self) -> Self {
        self.if_less(other, yes, no)
    }
}

/// A number of f64, or four of them.
pub trait Precise: Number {
    /// What it is in f32.
    type Narrow: Plain;
    /// In f32, rounded to the nearest.
    fn narrow(self) -> Self::Narrow;
    /// The same as f64. A sum, product, quotient or root of such numbers that is rounded so has the bits of f32's own.
    fn rounded(self) -> Self;
    /// Square root.
    fn root(self) -> Self;
}

impl Precise for f64 {
    type Narrow = f32;
    #[inline(always)]
    fn narrow(self) -> f32 {
        self as f32
    }
    #[inline(always)]
    fn rounded(self) -> f64 {
        f64::from(self as f32)
    }
    #[inline(always)]
    fn root(self) -> f64 {
        self.sqrt()
    }
}

impl<F: Four> Precise for F {
    type Narrow = [f32; 4];
    #[inline(always)]
    fn narrow(self) -> [f32; 4] {
        self.to_f32()
    }
    #[inline(always)]
    fn rounded(self) -> Self {
        self.as_f32()
    }
    #[inline(always)]
    fn root(self) -> Self {
        self.sqrt()
    }
}

/// The plane or space, for numbers of any kind.
pub trait Wide: Copy + Send + Sync + 'static {
    /// Positions, velocities, and the normal group of a patch: 2 | 3.
    type Vectors<T: Plain>: Several<T>;
    /// Angular velocities, and the friction group of a patch: 1 | 3.
    type Spins<T: Plain>: Several<T>;
    /// Tangents of a patch, and places in it: 1 | 2.
    type Slips<T: Plain>: Several<T>;
    /// Points of a patch: 2 | 4.
    type Points<T: Plain>: Several<T>;
    /// Inverse inertia: 1 | 6 (xx, yy, zz, xy, xz, yz).
    type Inertias<T: Plain>: Several<T>;
    /// What a patch keeps of its bodies' inverse inertias, where they are few numbers: 1 | 0.
    type Kept<T: Plain>: Several<T>;
    /// A change of attitude: cosine and sine | quaternion, the real part first.
    type Turns<T: Plain>: Several<T>;
    /// Numbers that only precondition a patch, in pairs: 3 | 11.
    type Pairs<T: Plain>: Several<T>;
    /// The numbers of a patch in rows of eight: 2 | 4.
    type Rows<T: Plain>: Several<T>;
    /// Numbers of a body side by side, enough for its velocities and one more, or for what it moved: 4 | 8.
    type Record: Record;

    /// Unit tangents of a unit normal; in space those of Duff et al. 2017, "Building an orthonormal basis, revisited".
    fn tangents<R: Number>(normal: &Self::Vectors<R>) -> Self::Slips<Self::Vectors<R>>;
    /// R r for a rotation R.
    fn rotated<R: Number>(turn: &Self::Turns<R>, r: &Self::Vectors<R>) -> Self::Vectors<R>;
    /// R r - r: how far the rotation takes a point. Of a small rotation it has all its digits.
    fn swung<R: Number>(turn: &Self::Turns<R>, r: &Self::Vectors<R>) -> Self::Vectors<R>;
    /// The inverse rotation, R^T.
    fn back<R: Number>(turn: &Self::Turns<R>) -> Self::Turns<R>;
    /// One rotation after another, R_2 R_1. Unit length is not restored.
    fn product<R: Number>(second: &Self::Turns<R>, first: &Self::Turns<R>) -> Self::Turns<R>;
    /// r x f.
    fn wide_moment<R: Number>(arm: &Self::Vectors<R>, force: &Self::Vectors<R>) -> Self::Spins<R>;
    /// w x r.
    fn wide_swing<R: Number>(spin: &Self::Spins<R>, arm: &Self::Vectors<R>) -> Self::Vectors<R>;
    /// I^-1 tau.
    fn wide_turn<R: Number>(inverse: &Self::Inertias<R>, moment: &Self::Spins<R>) -> Self::Spins<R>;
    /// Both groups of the local twist from relative velocities at the centre.
    fn to_patch<R: Number>(
        normal: &Self::Vectors<R>,
        tangents: &Self::Slips<Self::Vectors<R>>,
        velocity: &Self::Vectors<R>,
        spin: &Self::Spins<R>,
    ) -> (Self::Vectors<R>, Self::Spins<R>);
    /// Impulse and moment about the centre from both groups of impulses.
    fn from_patch<R: Number>(
        normal: &Self::Vectors<R>,
        tangents: &Self::Slips<Self::Vectors<R>>,
        pressing: &Self::Vectors<R>,
        rubbing: &Self::Spins<R>,
    ) -> (Self::Vectors<R>, Self::Spins<R>);
    /// How a unit normal impulse at a place of the patch acts on the normal group: (1, y, -x) | (1, -x).
    fn wide_lever<R: Number>(one: R, place: &Self::Slips<R>) -> Self::Vectors<R>;
    /// R^T n - n for a change of attitude R.
    fn wide_lean<R: Number>(turn: &Self::Turns<R>, normal: &Self::Vectors<R>) -> Self::Vectors<R>;
    /// Largest eigenvalue of a patch's inverse mass against slip, from the friction group's block.
    fn stiffest_slip<L: Lanes>(block: &Self::Spins<Self::Spins<Real<L>>>) -> Real<L>;
    /// No change of attitude.
    fn no_turn() -> Self::Turns<f32>;
    /// The change of attitude after an angle vector w h more; `turn` is renormalised.
    fn turned_by<L: Lanes>(turn: &Self::Turns<Real<L>>, angle: &Self::Spins<Real<L>>)
    -> Self::Turns<Real<L>>;
}

/// Scalar product.
#[inline(always)]
pub fn dot<R: Number, const N: usize>(a: &[R; N], b: &[R; N]) -> R {
    let mut sum = a[0] * b[0];
    for k in 1..N {
        sum = sum + a[k] * b[k];
    }
    sum
}

/// Scalar product of arrays whose length is the space's matter.
#[inline(always)]
pub fn inner<R: Number, V: Several<R>>(a: &V, b: &V) -> R {
    let mut sum = a[0] * b[0];
    for k in 1..V::LEN {
        sum = sum + a[k] * b[k];
    }
    sum
}

/// a + b.
#[inline(always)]
pub fn plus<R: Number, V: Several<R>>(a: &V, b: &V) -> V {
    let mut out = *a;
    for k in 0..V::LEN {
        out[k] = a[k] + b[k];
    }
    out
}

/// a - b.
#[inline(always)]
pub fn minus<R: Number, V: Several<R>>(a: &V, b: &V) -> V {
    let mut out = *a;
    for k in 0..V::LEN {
        out[k] = a[k] - b[k];
    }
    out
}

/// a s.
#[inline(always)]
pub fn times<R: Number, V: Several<R>>(a: &V, by: R) -> V {
    let mut out = *a;
    for k in 0..V::LEN {
        out[k] = a[k] * by;
    }
    out
}

/// cos(x / 2) and sin(x / 2) / x by their series, from x^2: to rounding below x = 1, to 1e-5 below 3.
#[inline(always)]
fn half_angle<L: Lanes>(square: Real<L>) -> (Real<L>, Real<L>) {
    let number = |x: f32| square.like(x);
    let q = number(0.25) * square;
    let tail = |first: f32, second: f32, third: f32| {
        let tail = number(1.0 / second) - q * number(1.0 / third);
        number(1.0 / first) - q * tail
    };
    let one = number(1.0);
    let cosine = one - q * (number(0.5) - q * tail(24.0, 720.0, 40_320.0));
    let sine = number(0.5) * (one - q * (number(1.0 / 6.0) - q * tail(120.0, 5_040.0, 362_880.0)));
    (cosine, sine)
}

impl Wide for Planar {
    type Vectors<T: Plain> = [T; 2];
    type Spins<T: Plain> = [T; 1];
    type Slips<T: Plain> = [T; 1];
    type Points<T: Plain> = [T; 2];
    type Inertias<T: Plain> = [T; 1];
    type Kept<T: Plain> = [T; 1];
    type Turns<T: Plain> = [T; 2];
    type Pairs<T: Plain> = [T; 3];
    type Rows<T: Plain> = [T; 2];
    type Record = Quad;

    #[inline(always)]
    fn tangents<R: Number>(n: &[R; 2]) -> [[R; 2]; 1] {
        [[-n[1], n[0]]]
    }
    #[inline(always)]
    fn rotated<R: Number>(turn: &[R; 2], r: &[R; 2]) -> [R; 2] {
        let ([c, s], [x, y]) = (*turn, *r);
        [c * x - s * y, s * x + c * y]
    }
    #[inline(always)]
    fn swung<R: Number>(turn: &[R; 2], r: &[R; 2]) -> [R; 2] {
        let ([c, s], [x, y]) = (*turn, *r);
        let less = c - c.constant(1.0);
        [less * x - s * y, s * x + less * y]
    }
    #[inline(always)]
    fn back<R: Number>(turn: &[R; 2]) -> [R; 2] {
        [turn[0], -turn[1]]
    }
    #[inline(always)]
    fn product<R: Number>(second: &[R; 2], first: &[R; 2]) -> [R; 2] {
        let ([a, b], [c, s]) = (*second, *first);
        [a * c - b * s, b * c + a * s]
    }
    #[inline(always)]
    fn wide_moment<R: Number>(arm: &[R; 2], force: &[R; 2]) -> [R; 1] {
        [arm[0] * force[1] - arm[1] * force[0]]
    }
    #[inline(always)]
    fn wide_swing<R: Number>(spin: &[R; 1], arm: &[R; 2]) -> [R; 2] {
        [-(spin[0] * arm[1]), spin[0] * arm[0]]
    }
    #[inline(always)]
    fn wide_turn<R: Number>(inverse: &[R; 1], moment: &[R; 1]) -> [R; 1] {
        [inverse[0] * moment[0]]
    }
    #[inline(always)]
    fn to_patch<R: Number>(n: &[R; 2], t: &[[R; 2]; 1], v: &[R; 2], w: &[R; 1]) -> ([R; 2], [R; 1]) {
        ([dot(v, n), w[0]], [dot(v, &t[0])])
    }
    #[inline(always)]
    fn from_patch<R: Number>(n: &[R; 2], t: &[[R; 2]; 1], f: &[R; 2], g: &[R; 1]) -> ([R; 2], [R; 1]) {
        let [t] = t;
        ([n[0] * f[0] + t[0] * g[0], n[1] * f[0] + t[1] * g[0]], [f[1]])
    }
    #[inline(always)]
    fn wide_lever<R: Number>(one: R, place: &[R; 1]) -> [R; 2] {
        [one, -place[0]]
    }
    #[inline(always)]
    fn wide_lean<R: Number>(turn: &[R; 2], n: &[R; 2]) -> [R; 2] {
        // n turned back: (c n_x + s n_y, c n_y - s n_x)
        let [c, s] = *turn;
        [c * n[0] + s * n[1] - n[0], c * n[1] - s * n[0] - n[1]]
    }
    #[inline(always)]
    fn stiffest_slip<L: Lanes>(block: &[[Real<L>; 1]; 1]) -> Real<L> {
        block[0][0]
    }
    fn no_turn() -> [f32; 2] {
        [1.0, 0.0]
    }
    #[inline(always)]
    fn turned_by<L: Lanes>(turn: &[Real<L>; 2], angle: &[Real<L>; 1]) -> [Real<L>; 2] {
        let [x] = *angle;
        let (half_cosine, half_sine) = half_angle(x * x);
        let half_sine = half_sine * x;
        // double angles
        let (one, two) = (x.like(1.0), x.like(2.0));
        let (c1, s1) = (one - two * half_sine * half_sine, two * half_sine * half_cosine);
        let [c, s] = *turn;
        let (c, s) = (c * c1 - s * s1, s * c1 + c * s1);
        let scale = one / (c * c + s * s).sqrt();
        [c * scale, s * scale]
    }
}

#[inline(always)]
fn cross<R: Number>(a: &[R; 3], b: &[R; 3]) -> [R; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

#[inline(always)]
fn twice<R: Number>(a: [R; 3]) -> [R; 3] {
    [a[0] + a[0], a[1] + a[1], a[2] + a[2]]
}

impl Wide for Spatial {
    type Vectors<T: Plain> = [T; 3];
    type Spins<T: Plain> = [T; 3];
    type Slips<T: Plain> = [T; 2];
    type Points<T: Plain> = [T; 4];
    type Inertias<T: Plain> = [T; 6];
    type Kept<T: Plain> = [T; 0];
    type Turns<T: Plain> = [T; 4];
    type Pairs<T: Plain> = [T; 11];
    type Rows<T: Plain> = [T; 4];
    type Record = Eight;

    #[inline(always)]
    fn rotated<R: Number>(turn: &[R; 4], r: &[R; 3]) -> [R; 3] {
        let [w, x, y, z] = *turn;
        let once = twice(cross(&[x, y, z], r));
        let more = cross(&[x, y, z], &once);
        [r[0] + once[0] * w + more[0], r[1] + once[1] * w + more[1], r[2] + once[2] * w + more[2]]
    }
    #[inline(always)]
    fn swung<R: Number>(turn: &[R; 4], r: &[R; 3]) -> [R; 3] {
        let [w, x, y, z] = *turn;
        let once = twice(cross(&[x, y, z], r));
        let more = cross(&[x, y, z], &once);
        [once[0] * w + more[0], once[1] * w + more[1], once[2] * w + more[2]]
    }
    #[inline(always)]
    fn back<R: Number>(turn: &[R; 4]) -> [R; 4] {
        [turn[0], -turn[1], -turn[2], -turn[3]]
    }
    #[inline(always)]
    fn product<R: Number>(second: &[R; 4], first: &[R; 4]) -> [R; 4] {
        let ([w, x, y, z], [a, b, c, d]) = (*second, *first);
        [
            w * a - x * b - y * c - z * d,
            w * b + x * a + y * d - z * c,
            w * c - x * d + y * a + z * b,
            w * d + x * c - y * b + z * a,
        ]
    }
    #[inline(always)]
    fn tangents<R: Number>(n: &[R; 3]) -> [[R; 3]; 2] {
        let [x, y, z] = *n;
        let (zero, one) = (x.constant(0.0), x.constant(1.0));
        let sign = z.choose(zero, -one, one);
        let a = -one / (sign + z);
        let b = x * y * a;
        [[one + sign * x * x * a, sign * b, -(sign * x)], [b, sign + y * y * a, -y]]
    }
    #[inline(always)]
    fn wide_moment<R: Number>(arm: &[R; 3], force: &[R; 3]) -> [R; 3] {
        cross(arm, force)
    }
    #[inline(always)]
    fn wide_swing<R: Number>(spin: &[R; 3], arm: &[R; 3]) -> [R; 3] {
        cross(spin, arm)
    }
    #[inline(always)]
    fn wide_turn<R: Number>(i: &[R; 6], m: &[R; 3]) -> [R; 3] {
        let [xx, yy, zz, xy, xz, yz] = *i;
        [dot(&[xx, xy, xz], m), dot(&[xy, yy, yz], m), dot(&[xz, yz, zz], m)]
    }
    #[inline(always)]
    fn to_patch<R: Number>(n: &[R; 3], t: &[[R; 3]; 2], v: &[R; 3], w: &[R; 3]) -> ([R; 3], [R; 3]) {
        ([dot(v, n), dot(w, &t[0]), dot(w, &t[1])], [dot(v, &t[0]), dot(v, &t[1]), dot(w, n)])
    }
    #[inline(always)]
    fn from_patch<R: Number>(n: &[R; 3], t: &[[R; 3]; 2], f: &[R; 3], g: &[R; 3]) -> ([R; 3], [R; 3]) {
        let mut force = *n;
        let mut moment = *n;
        for k in 0..3 {
            force[k] = n[k] * f[0] + t[0][k] * g[0] + t[1][k] * g[1];
            moment[k] = t[0][k] * f[1] + t[1][k] * f[2] + n[k] * g[2];
        }
        (force, moment)
    }
    #[inline(always)]
    fn wide_lever<R: Number>(one: R, place: &[R; 2]) -> [R; 3] {
        [one, place[1], -place[0]]
    }
    #[inline(always)]
    fn wide_lean<R: Number>(turn: &[R; 4], n: &[R; 3]) -> [R; 3] {
        // R^T n = n + 2 q x (q x n) - 2 w (q x n)
        let [w, x, y, z] = *turn;
        let q = [x, y, z];
        let once = cross(&q, n);
        let twice = cross(&q, &once);
        let mut out = once;
        for k in 0..3 {
            let half = twice[k] - w * once[k];
            out[k] = half + half;
        }
        out
    }
    #[inline(always)]
    fn stiffest_slip<L: Lanes>(block: &[[Real<L>; 3]; 3]) -> Real<L> {
        let half = block[0][0].like(0.5);
        let (mean, apart) = (half * (block[0][0] + block[1][1]), half * (block[0][0] - block[1][1]));
        // the two are equal but for rounding, and where the block is round nothing but their rounding is there
        let across = half * (block[0][1] + block[1][0]);
        mean + (apart * apart + across * across).sqrt()
    }
    fn no_turn() -> [f32; 4] {
        [1.0, 0.0, 0.0, 0.0]
    }
    #[inline(always)]
    fn turned_by<L: Lanes>(turn: &[Real<L>; 4], angle: &[Real<L>; 3]) -> [Real<L>; 4] {
        let (w1, sine) = half_angle(dot(angle, angle));
        let [x1, y1, z1] = [angle[0] * sine, angle[1] * sine, angle[2] * sine];
        let [w, x, y, z] = *turn;
        let out = [
            w1 * w - x1 * x - y1 * y - z1 * z,
            w1 * x + x1 * w + y1 * z - z1 * y,
            w1 * y - x1 * z + y1 * w + z1 * x,
            w1 * z + x1 * y - y1 * x + z1 * w,
        ];
        let scale = w.like(1.0) / dot(&out, &out).sqrt();
        [out[0] * scale, out[1] * scale, out[2] * scale, out[3] * scale]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Quaternion, Rotation, Space, vec3};

    #[test]
    fn small_turns_add_up_to_a_large_one() {
        use crate::lanes::Portable;
        let number = |x: f32| Real::all(Portable, x);
        let (axis, n) = (vec3(0.36, -0.48, 0.8), 200);
        let step = [0.36, -0.48, 0.8].map(|x: f32| number(0.01 * x));
        let begun = [1.0, 0.0, 0.0, 0.0].map(number);
        let turned = (0..n).fold(begun, |q, _| Spatial::turned_by(&q, &step)).map(|x| x.store().0[0]);
        let exact = Quaternion::about(axis * (0.01 * f64::from(n)));
        for (a, b) in turned.iter().zip(exact.as_slice()) {
            assert!((f64::from(*a) - b).abs() < 2e-6, "{turned:?} {exact:?}");
        }
        let planar = (0..n).fold([number(1.0), number(0.0)], |q, _| Planar::turned_by(&q, &[number(0.01)]));
        let planar = planar.map(|x| x.store().0[0]);
        assert!((planar[0] - 2.0_f32.cos()).abs() < 2e-6 && (planar[1] - 2.0_f32.sin()).abs() < 2e-6);
    }

    #[test]
    fn a_round_inverse_mass_is_stiff_whatever_its_rounding() {
        use crate::lanes::Portable;
        let number = |x: f32| Real::all(Portable, x);
        for (one, other) in [(3e-9, -2e-9), (-4e-9, 1e-9), (2e-9, 2e-9)] {
            let row = |x, y| [number(x), number(y), number(0.0)];
            let block = [row(0.7, one), row(other, 0.7), [number(0.0); 3]];
            let stiffest = Spatial::stiffest_slip(&block).store().0[0];
            assert!((stiffest - 0.7).abs() < 1e-6, "{stiffest}");
        }
    }

    #[test]
    fn a_lean_is_what_turning_back_makes_of_the_normal() {
        let q = Quaternion::about(vec3(0.3, -0.2, 0.5));
        let n = vec3(0.36, -0.48, 0.8);
        let expected = q.unrotate(n) - n;
        let s = q.as_slice();
        let lean = Spatial::wide_lean(
            &[s[0] as f32, s[1] as f32, s[2] as f32, s[3] as f32],
            &[n[0] as f32, n[1] as f32, n[2] as f32],
        );
        for k in 0..3 {
            assert!((f64::from(lean[k]) - expected[k]).abs() < 1e-6, "{lean:?} {expected:?}");
        }
    }

    #[test]
    fn impulses_do_the_same_work_in_the_patch_and_in_the_world() {
        let n = vec3(0.36, -0.48, 0.8);
        let t: [[f32; 3]; 2] = [0, 1].map(|k| {
            let t = Spatial::tangent(n, k);
            [t[0] as f32, t[1] as f32, t[2] as f32]
        });
        let n = [n[0] as f32, n[1] as f32, n[2] as f32];
        let (v, w) = ([0.3, 1.0, -0.2], [2.0, 0.1, -0.7]);
        let (f, g) = ([1.5, -0.3, 0.8], [0.4, -0.9, 0.6]);
        let (force, moment) = Spatial::from_patch(&n, &t, &f, &g);
        let (vn, vt) = Spatial::to_patch(&n, &t, &v, &w);
        let world = dot(&force, &v) + dot(&moment, &w);
        assert!((world - dot(&f, &vn) - dot(&g, &vt)).abs() < 1e-6);
        // a unit impulse at a place of the patch
        let place = [0.7, -0.4];
        let r = [0, 1, 2].map(|k| place[0] * t[0][k] + place[1] * t[1][k]);
        let at_place = dot(&n, &[0, 1, 2].map(|k| v[k] + cross(&w, &r)[k]));
        assert!((at_place - dot(&Spatial::wide_lever(1.0, &place), &vn)).abs() < 1e-6);
    }
}
