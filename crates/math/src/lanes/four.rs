//! Four numbers in f64 that are written like one.

use std::ops::{Add, Div, Mul, Neg, Sub};

/// Four numbers in registers. `max` and `min` return their second argument when either is NaN.
pub trait Four:
    Copy
    + Send
    + Sync
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
{
    /// To memory.
    fn store(self) -> [f64; 4];
    /// self > other ? self : other.
    fn max(self, other: Self) -> Self;
    /// self < other ? self : other.
    fn min(self, other: Self) -> Self;
    /// Absolute value.
    fn abs(self) -> Self;
    /// Square root.
    fn sqrt(self) -> Self;
    /// self < other ? yes : no.
    fn if_less(self, other: Self, yes: Self, no: Self) -> Self;
    /// The set of places, bit by bit, where self < other.
    fn less(self, other: Self) -> u32;
    /// The same number four times, in registers like these.
    fn like(self, x: f64) -> Self;
    /// In f32, rounded to the nearest.
    fn to_f32(self) -> [f32; 4];
    /// The same as f64.
    fn as_f32(self) -> Self;
    /// Four records of four numbers turned into four quantities of four records, or back.
    fn turned(records: [Self; 4]) -> [Self; 4];
}

/// Four numbers as a plain array.
#[derive(Clone, Copy, Debug)]
pub struct Plain(pub [f64; 4]);

#[inline(always)]
fn each(a: Plain, b: Plain, f: impl Fn(f64, f64) -> f64) -> Plain {
    Plain(std::array::from_fn(|k| f(a.0[k], b.0[k])))
}

macro_rules! plain {
    ($trait:ident, $name:ident, $do:expr) => {
        impl $trait for Plain {
            type Output = Self;
            #[inline(always)]
            fn $name(self, other: Self) -> Self {
                each(self, other, $do)
            }
        }
    };
}
plain!(Add, add, |a, b| a + b);
plain!(Sub, sub, |a, b| a - b);
plain!(Mul, mul, |a, b| a * b);
plain!(Div, div, |a, b| a / b);

impl Neg for Plain {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        each(self, self, |a, _| -a)
    }
}

impl Four for Plain {
    #[inline(always)]
    fn turned([a, b, c, d]: [Self; 4]) -> [Self; 4] {
        std::array::from_fn(|k| Plain([a.0[k], b.0[k], c.0[k], d.0[k]]))
    }
    #[inline(always)]
    fn store(self) -> [f64; 4] {
        self.0
    }
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        each(self, other, |a, b| if a > b { a } else { b })
    }
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        each(self, other, |a, b| if a < b { a } else { b })
    }
    #[inline(always)]
    fn abs(self) -> Self {
        each(self, self, |a, _| a.abs())
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        each(self, self, |a, _| a.sqrt())
    }
    #[inline(always)]
    fn if_less(self, other: Self, yes: Self, no: Self) -> Self {
        Plain(std::array::from_fn(|k| if self.0[k] < other.0[k] { yes.0[k] } else { no.0[k] }))
    }
    #[inline(always)]
    fn less(self, other: Self) -> u32 {
        (0..4).fold(0, |set, k| set | u32::from(self.0[k] < other.0[k]) << k)
    }
    #[inline(always)]
    fn like(self, x: f64) -> Self {
        Plain([x; 4])
    }
    #[inline(always)]
    fn to_f32(self) -> [f32; 4] {
        std::array::from_fn(|k| self.0[k] as f32)
    }
    #[inline(always)]
    fn as_f32(self) -> Self {
        each(self, self, |a, _| f64::from(a as f32))
    }
}
