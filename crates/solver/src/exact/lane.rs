//! Numbers side by side: one register holds the same quantity of several contacts. Contacts lie one after another
//! in memory and are turned on the way in and out.

use crate::registers::{ABREAST, whole};
use pulp::{Scalar, Simd};
use std::ops::{Add, Div, Mul, Neg, Sub};

/// Contacts per pack; vectors over contacts are padded to whole packs.
pub const PACK: usize = ABREAST;

/// A vector of lanes from an expression per component. An ordinary loop, because closures and `array::from_fn` are
/// compiled without the registers that lanes need unless the compiler happens to inline them.
macro_rules! lanes {
    ($seed:expr; $k:ident => $value:expr) => {{
        let mut out = [$seed; D];
        for $k in 0..D {
            out[$k] = $value;
        }
        out
    }};
}
pub(crate) use lanes;

/// Rounds a number of contacts up to whole packs with at least one place to spare.
pub fn padded(contacts: usize) -> usize {
    (contacts + 1).div_ceil(PACK) * PACK
}

/// One quantity of as many contacts as a register holds.
#[derive(Clone, Copy)]
pub struct Lane<S: Simd> {
    simd: S,
    value: S::f64s,
}

/// One vector per contact.
pub type Lanes<S, const D: usize> = [Lane<S>; D];

impl<S: Simd> Lane<S> {
    /// The same number everywhere.
    #[inline(always)]
    pub fn all(simd: S, value: f64) -> Self {
        Lane { simd, value: simd.splat_f64s(value) }
    }
    /// The same number everywhere, in registers like this one.
    #[inline(always)]
    pub fn like(self, value: f64) -> Self {
        Lane::all(self.simd, value)
    }
    /// Numbers of consecutive contacts.
    #[inline(always)]
    pub fn load(simd: S, values: &[f64]) -> Self {
        Lane { simd, value: S::as_simd_f64s(&values[..S::F64_LANES]).0[0] }
    }
    /// Stores the numbers of consecutive contacts.
    #[inline(always)]
    pub fn store(self, values: &mut [f64]) {
        S::as_mut_simd_f64s(&mut values[..S::F64_LANES]).0[0] = self.value;
    }
    /// The registers it lives in.
    #[inline(always)]
    pub fn simd(self) -> S {
        self.simd
    }
    #[inline(always)]
    fn with(self, value: S::f64s) -> Self {
        Lane { simd: self.simd, value }
    }
    /// self * b + c.
    #[inline(always)]
    pub fn mul_add(self, b: Self, c: Self) -> Self {
        self.with(self.simd.mul_add_f64s(self.value, b.value, c.value))
    }
    #[inline(always)]
    pub fn sqrt(self) -> Self {
        self.with(self.simd.sqrt_f64s(self.value))
    }
    #[inline(always)]
    pub fn abs(self) -> Self {
        self.with(self.simd.abs_f64s(self.value))
    }
    #[inline(always)]
    pub fn max(self, other: Self) -> Self {
        self.with(self.simd.max_f64s(self.value, other.value))
    }
    #[inline(always)]
    pub fn min(self, other: Self) -> Self {
        self.with(self.simd.min_f64s(self.value, other.value))
    }
    /// Where self < other: `yes`, elsewhere `no`.
    #[inline(always)]
    pub fn if_less(self, other: Self, yes: Self, no: Self) -> Self {
        let mask = self.simd.less_than_f64s(self.value, other.value);
        self.with(self.simd.select_f64s(mask, yes.value, no.value))
    }
    /// Where self <= other: `yes`, elsewhere `no`.
    #[inline(always)]
    pub fn if_at_most(self, other: Self, yes: Self, no: Self) -> Self {
        let mask = self.simd.less_than_or_equal_f64s(self.value, other.value);
        self.with(self.simd.select_f64s(mask, yes.value, no.value))
    }
    /// Largest number in the register.
    #[inline(always)]
    pub fn greatest(self) -> f64 {
        self.simd.reduce_max_f64s(self.value)
    }
    /// The numbers in the register added up, in an order of its own.
    #[inline(always)]
    pub fn sum(self) -> f64 {
        self.simd.reduce_sum_f64s(self.value)
    }
    /// Smallest number in the register.
    #[inline(always)]
    pub fn least(self) -> f64 {
        self.simd.reduce_min_f64s(self.value)
    }
}

impl Lane<Scalar> {
    /// The only number of a register of one.
    pub fn number(self) -> f64 {
        self.value
    }
}

impl<S: Simd> Add for Lane<S> {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        self.with(self.simd.add_f64s(self.value, other.value))
    }
}

impl<S: Simd> Sub for Lane<S> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        self.with(self.simd.sub_f64s(self.value, other.value))
    }
}

impl<S: Simd> Mul for Lane<S> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        self.with(self.simd.mul_f64s(self.value, other.value))
    }
}

impl<S: Simd> Div for Lane<S> {
    type Output = Self;
    #[inline(always)]
    fn div(self, other: Self) -> Self {
        self.with(self.simd.div_f64s(self.value, other.value))
    }
}

impl<S: Simd> Neg for Lane<S> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        self.with(self.simd.neg_f64s(self.value))
    }
}

/// A sum over contacts, one for each place in a pack until the end: its bits are those of any register width.
#[derive(Clone, Copy, Default)]
pub struct Sum([f64; PACK]);

impl Sum {
    /// Adds a number of the contacts from `first` on.
    #[inline(always)]
    pub fn add<S: Simd>(&mut self, first: usize, value: Lane<S>) {
        let places = &mut self.0[first % PACK..];
        (Lane::load(value.simd, places) + value).store(places);
    }
    /// The sum.
    #[inline(always)]
    pub fn total(self) -> f64 {
        whole(self.0)
    }
}

/// The vectors of the contacts from `first` on, turned into lanes.
#[inline(always)]
pub fn load<S: Simd, const D: usize>(simd: S, vectors: &[[f64; D]], first: usize) -> Lanes<S, D> {
    let vectors = &vectors[first..first + S::F64_LANES];
    lanes!(Lane::all(simd, 0.0); k => {
        let mut row = [0.0; PACK];
        for (value, vector) in row.iter_mut().zip(vectors) {
            *value = vector[k];
        }
        Lane::load(simd, &row)
    })
}

/// Stores lanes as the vectors of the contacts from `first` on.
#[inline(always)]
pub fn store<S: Simd, const D: usize>(lanes: Lanes<S, D>, vectors: &mut [[f64; D]], first: usize) {
    let vectors = &mut vectors[first..first + S::F64_LANES];
    for k in 0..D {
        let mut row = [0.0; PACK];
        lanes[k].store(&mut row);
        for (value, vector) in row.iter().zip(vectors.iter_mut()) {
            vector[k] = *value;
        }
    }
}

/// One where a contact exists, zero in the padding after `count`.
#[inline(always)]
pub fn live<S: Simd>(simd: S, first: usize, count: usize) -> Lane<S> {
    if first + S::F64_LANES <= count {
        return Lane::all(simd, 1.0);
    }
    let mut row = [0.0; PACK];
    for (k, value) in row.iter_mut().enumerate().take(S::F64_LANES) {
        *value = if first + k < count { 1.0 } else { 0.0 };
    }
    Lane::load(simd, &row)
}
