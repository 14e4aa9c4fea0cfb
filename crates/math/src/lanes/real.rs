//! Lanes that are written like numbers.

use super::{Eight, Lanes, Quad, WIDTH};
use std::ops::{Add, AddAssign, Div, Mul, Neg, Sub, SubAssign};

/// Eight numbers in registers.
#[derive(Clone, Copy)]
pub struct Real<L: Lanes> {
    lanes: L,
    value: L::Reals,
}

impl<L: Lanes> Real<L> {
    /// The same number eight times.
    #[inline(always)]
    pub fn all(lanes: L, x: f32) -> Self {
        Real { lanes, value: lanes.all(x) }
    }
    /// From memory.
    #[inline(always)]
    pub fn load(lanes: L, x: &Eight) -> Self {
        Real { lanes, value: lanes.load(x) }
    }
    /// To memory.
    #[inline(always)]
    pub fn store(self) -> Eight {
        self.lanes.store(self.value)
    }
    /// The same number eight times, in registers like this one.
    #[inline(always)]
    pub fn like(self, x: f32) -> Self {
        Real::all(self.lanes, x)
    }
    /// Eight registers turned: records into quantities, or back.
    #[inline(always)]
    pub fn turn(rows: [Self; 8]) -> [Self; 8] {
        let lanes = rows[0].lanes;
        let mut values = [rows[0].value; 8];
        for k in 0..8 {
            values[k] = rows[k].value;
        }
        let values = lanes.turn(values);
        let mut out = rows;
        for k in 0..8 {
            out[k].value = values[k];
        }
        out
    }
    /// Eight records of four numbers turned into four quantities.
    #[inline(always)]
    pub fn columns(lanes: L, rows: [Quad; WIDTH]) -> [Self; 4] {
        let mut out = [Real::all(lanes, 0.0); 4];
        for (out, value) in out.iter_mut().zip(lanes.columns(rows)) {
            out.value = value;
        }
        out
    }
    /// Four quantities turned into eight records.
    #[inline(always)]
    pub fn rows([a, b, c, d]: [Self; 4]) -> [Quad; WIDTH] {
        a.lanes.rows([a.value, b.value, c.value, d.value])
    }
    #[inline(always)]
    fn with(self, value: L::Reals) -> Self {
        Real { lanes: self.lanes, value }
    }
    /// The larger of both; `other` where either is NaN.
    #[inline(always)]
    pub fn max(self, other: Self) -> Self {
        self.with(self.lanes.max(self.value, other.value))
    }
    /// The smaller of both; `other` where either is NaN.
    #[inline(always)]
    pub fn min(self, other: Self) -> Self {
        self.with(self.lanes.min(self.value, other.value))
    }
    /// Absolute value.
    #[inline(always)]
    pub fn abs(self) -> Self {
        self.max(-self)
    }
    /// Square root.
    #[inline(always)]
    pub fn sqrt(self) -> Self {
        self.with(self.lanes.sqrt(self.value))
    }
    /// Whether self < other in some lane.
    #[inline(always)]
    pub fn somewhere_less(self, other: Self) -> bool {
        self.lanes.somewhere_less(self.value, other.value)
    }
    /// Where self < other: `yes`, elsewhere `no`.
    #[inline(always)]
    pub fn if_less(self, other: Self, yes: Self, no: Self) -> Self {
        self.with(self.lanes.if_less(self.value, other.value, yes.value, no.value))
    }
    /// Two numbers in the bits of one, each rounded to eight bits of mantissa.
    #[inline(always)]
    pub fn pair(self, other: Self) -> Self {
        self.with(self.lanes.pair(self.value, other.value))
    }
    /// The two numbers of a pair.
    #[inline(always)]
    pub fn parts(self) -> (Self, Self) {
        let (one, other) = self.lanes.parts(self.value);
        (self.with(one), self.with(other))
    }
}

impl<L: Lanes> Add for Real<L> {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        self.with(self.lanes.add(self.value, other.value))
    }
}
impl<L: Lanes> Sub for Real<L> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        self.with(self.lanes.sub(self.value, other.value))
    }
}
impl<L: Lanes> Mul for Real<L> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        self.with(self.lanes.mul(self.value, other.value))
    }
}
impl<L: Lanes> Div for Real<L> {
    type Output = Self;
    #[inline(always)]
    fn div(self, other: Self) -> Self {
        self.with(self.lanes.div(self.value, other.value))
    }
}
impl<L: Lanes> Neg for Real<L> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        self.like(-0.0) - self
    }
}
impl<L: Lanes> AddAssign for Real<L> {
    #[inline(always)]
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}
impl<L: Lanes> SubAssign for Real<L> {
    #[inline(always)]
    fn sub_assign(&mut self, other: Self) {
        *self = *self - other;
    }
}
