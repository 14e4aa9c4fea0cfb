//! Numbers of one thing, or of four side by side: what is written once over them runs for a pair whose face is told of, and in
//! lanes for the pairs of a step, with the same bits.

use carom_math::lanes::Lanes;
use carom_math::{Precise, Several};

/// Things whose numbers are read side by side.
pub trait Abreast<T>: Copy {
    /// What is read of them at a time.
    type Number: Precise;
    /// One number of each.
    fn read(self, of: impl Fn(&T) -> f64) -> Self::Number;
    /// Several numbers of each.
    #[inline(always)]
    fn several<A: Several<Self::Number>>(self, of: impl Fn(&T, usize) -> f64) -> A {
        let mut out = A::all(self.read(|thing| of(thing, 0)));
        for k in 1..A::LEN {
            out[k] = self.read(|thing| of(thing, k));
        }
        out
    }
}

/// One of them.
pub struct One<'a, T>(pub &'a T);

impl<T> Clone for One<'_, T> {
    fn clone(&self) -> Self {
        *self
    }
}
impl<T> Copy for One<'_, T> {}

impl<T> Abreast<T> for One<'_, T> {
    type Number = f64;
    #[inline(always)]
    fn read(self, of: impl Fn(&T) -> f64) -> f64 {
        of(self.0)
    }
}

/// Four of them.
pub struct Quartet<'a, T, L: Lanes>(pub L, pub &'a [T; 4]);

impl<T, L: Lanes> Clone for Quartet<'_, T, L> {
    fn clone(&self) -> Self {
        *self
    }
}
impl<T, L: Lanes> Copy for Quartet<'_, T, L> {}

impl<T, L: Lanes> Abreast<T> for Quartet<'_, T, L> {
    type Number = L::Four;
    #[inline(always)]
    fn read(self, of: impl Fn(&T) -> f64) -> L::Four {
        let [one, two, three, four] = self.1;
        self.0.four(&[of(one), of(two), of(three), of(four)])
    }
}
