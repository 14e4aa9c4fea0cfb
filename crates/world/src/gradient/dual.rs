//! Dual numbers a + b eps, eps^2 = 0: b is the derivative along one direction, exact to rounding. Columns of three and
//! quaternions of them; the plane is a slice of space here, so that one text serves both. Knows no bodies.

use std::ops::{Add, Div, Mul, Neg, Sub};

/// A number and its derivative along one direction.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Dual {
    /// The number.
    pub value: f64,
    /// Its derivative.
    pub slope: f64,
}

impl Dual {
    /// A number that does not change.
    pub const fn fixed(value: f64) -> Self {
        Dual { value, slope: 0.0 }
    }
    /// A number and its derivative.
    pub const fn new(value: f64, slope: f64) -> Self {
        Dual { value, slope }
    }
    /// Square root of a positive number.
    pub fn sqrt(self) -> Self {
        let root = self.value.sqrt();
        Dual { value: root, slope: 0.5 * self.slope / root }
    }
}

impl Add for Dual {
    type Output = Dual;
    fn add(self, o: Dual) -> Dual {
        Dual { value: self.value + o.value, slope: self.slope + o.slope }
    }
}
impl Sub for Dual {
    type Output = Dual;
    fn sub(self, o: Dual) -> Dual {
        Dual { value: self.value - o.value, slope: self.slope - o.slope }
    }
}
impl Neg for Dual {
    type Output = Dual;
    fn neg(self) -> Dual {
        Dual { value: -self.value, slope: -self.slope }
    }
}
impl Mul for Dual {
    type Output = Dual;
    fn mul(self, o: Dual) -> Dual {
        Dual { value: self.value * o.value, slope: self.slope * o.value + self.value * o.slope }
    }
}
impl Mul<f64> for Dual {
    type Output = Dual;
    fn mul(self, o: f64) -> Dual {
        Dual { value: self.value * o, slope: self.slope * o }
    }
}
impl Div for Dual {
    type Output = Dual;
    fn div(self, o: Dual) -> Dual {
        let value = self.value / o.value;
        Dual { value, slope: (self.slope - value * o.slope) / o.value }
    }
}

/// A column of space.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Column3(pub [Dual; 3]);

impl Column3 {
    /// A column that does not change.
    pub fn fixed(v: [f64; 3]) -> Self {
        Column3(v.map(Dual::fixed))
    }
    /// A column and its derivative.
    pub fn new(value: [f64; 3], slope: [f64; 3]) -> Self {
        Column3(std::array::from_fn(|k| Dual::new(value[k], slope[k])))
    }
    /// Scalar product.
    pub fn dot(self, o: Self) -> Dual {
        self.0[0] * o.0[0] + self.0[1] * o.0[1] + self.0[2] * o.0[2]
    }
    /// Vector product.
    pub fn cross(self, o: Self) -> Self {
        let ([a, b, c], [x, y, z]) = (self.0, o.0);
        Column3([b * z - c * y, c * x - a * z, a * y - b * x])
    }
    /// Times a number.
    pub fn times(self, k: Dual) -> Self {
        Column3(self.0.map(|x| x * k))
    }
    /// The derivatives.
    pub fn slope(self) -> [f64; 3] {
        self.0.map(|x| x.slope)
    }
    /// The numbers.
    pub fn value(self) -> [f64; 3] {
        self.0.map(|x| x.value)
    }
}

impl Add for Column3 {
    type Output = Self;
    fn add(self, o: Self) -> Self {
        Column3(std::array::from_fn(|k| self.0[k] + o.0[k]))
    }
}
impl Sub for Column3 {
    type Output = Self;
    fn sub(self, o: Self) -> Self {
        Column3(std::array::from_fn(|k| self.0[k] - o.0[k]))
    }
}

/// A unit quaternion \[w, x, y, z\].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Attitude(pub [Dual; 4]);

impl Attitude {
    /// The attitude q turned by the small rotation vector of the slope, world axes: dq = phi q / 2.
    pub fn turned(q: [f64; 4], phi: [f64; 3]) -> Self {
        let [x, y, z] = phi.map(|p| 0.5 * p);
        let rate = product([0.0, x, y, z].map(Dual::fixed), q.map(Dual::fixed));
        Attitude(std::array::from_fn(|k| Dual::new(q[k], rate[k].value)))
    }
    /// The rotation by angle |s| about s.
    pub fn about(s: Column3) -> Self {
        let (cosine, k) = half_angle(s.dot(s));
        let [x, y, z] = s.0;
        Attitude([cosine, x * k, y * k, z * k])
    }
    /// The rotation by 2 atan(|s|/2) about s.
    pub fn cayley(s: Column3) -> Self {
        let k = Dual::fixed(1.0) / (Dual::fixed(1.0) + s.dot(s) * 0.25).sqrt();
        let [x, y, z] = s.0.map(|x| x * k * 0.5);
        Attitude([k, x, y, z])
    }
    /// This rotation followed by another.
    pub fn then(self, next: Self) -> Self {
        Attitude(product(next.0, self.0))
    }
    /// The inverse rotation.
    pub fn inverse(self) -> Self {
        let [w, x, y, z] = self.0;
        Attitude([w, -x, -y, -z])
    }
    /// Body axes to world axes.
    pub fn rotate(self, r: Column3) -> Column3 {
        let [w, x, y, z] = self.0;
        let v = Column3([x, y, z]);
        let t = v.cross(r).times(Dual::fixed(2.0));
        r + t.times(w) + v.cross(t)
    }
    /// World axes to body axes.
    pub fn unrotate(self, r: Column3) -> Column3 {
        self.inverse().rotate(r)
    }
    /// The small rotation vector of the slope, world axes: phi = 2 dq q^-1.
    pub fn slope(self) -> [f64; 3] {
        let [w, x, y, z] = self.0.map(|c| c.value);
        let rate = product(self.0.map(|c| Dual::fixed(c.slope)), [w, -x, -y, -z].map(Dual::fixed));
        [2.0 * rate[1].value, 2.0 * rate[2].value, 2.0 * rate[3].value]
    }
}

/// Hamilton's product a b.
fn product(a: [Dual; 4], b: [Dual; 4]) -> [Dual; 4] {
    let ([w, x, y, z], [a, b, c, d]) = (a, b);
    [
        w * a - x * b - y * c - z * d,
        w * b + x * a + y * d - z * c,
        w * c - x * d + y * a + z * b,
        w * d + x * c - y * b + z * a,
    ]
}

/// cos(a/2) and sin(a/2)/a of an angle's square, smooth at 0.
fn half_angle(square: Dual) -> (Dual, Dual) {
    let s = square.value;
    let angle = s.sqrt();
    let (sine, cosine) = libm_sincos(0.5 * angle);
    let (k, rate) = if s < 1e-8 {
        (0.5 - s / 48.0, -1.0 / 48.0 + s / 1920.0)
    } else {
        let k = sine / angle;
        // the difference loses digits like 1/s; the series takes over well before
        let rate = if s < 1e-3 {
            -1.0 / 48.0 + s * (1.0 / 1920.0 - s * (1.0 / 215_040.0 - s / 46_448_640.0))
        } else {
            (0.5 * cosine - k) / (2.0 * s)
        };
        (k, rate)
    };
    (Dual::new(cosine, -0.25 * k * square.slope), Dual::new(k, rate * square.slope))
}

/// Sine and cosine as rotations have them.
fn libm_sincos(angle: f64) -> (f64, f64) {
    use carom_math::{Rotation, Turn, vec1};
    let turn = Turn::about(vec1(angle));
    let [cosine, sine] = turn.0;
    (sine, cosine)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn close(a: f64, b: f64, tolerance: f64) {
        assert!((a - b).abs() <= tolerance, "{a} and {b}");
    }

    #[test]
    fn rules_of_differentiation_hold() {
        let x = Dual::new(0.7, 1.0);
        close((x * x / (x + Dual::fixed(2.0))).slope, (2.0 * 0.7 * 2.7 - 0.49) / (2.7 * 2.7), 1e-15);
        close(x.sqrt().slope, 0.5 / 0.7_f64.sqrt(), 1e-15);
    }

    #[test]
    fn the_exponential_map_has_its_derivative_at_every_angle() {
        for size in [0.0, 1e-6, 1e-3, 0.02, 0.04, 0.3, 2.0] {
            let s = [0.6 * size, -0.8 * size, 0.1 * size];
            let along = [0.3, 0.5, -0.2];
            let slope = Attitude::about(Column3::new(s, along)).slope();
            let h = 1e-4;
            let at = |k: f64| Attitude::about(Column3::fixed(std::array::from_fn(|i| s[i] + k * along[i])));
            let difference = |k: f64| {
                let (one, other) = (at(k), at(-k));
                let q = other.inverse().then(one).0.map(|c| c.value);
                [2.0 * q[1], 2.0 * q[2], 2.0 * q[3]]
            };
            let (far, near) = (difference(2.0 * h), difference(h));
            for i in 0..3 {
                close(slope[i], (8.0 * near[i] - far[i]) / (12.0 * h), 1e-7);
            }
        }
    }
}
