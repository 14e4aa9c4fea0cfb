//! Short arrays whose length is the space's matter. Knows nothing of what is in them.

use std::ops::{Index, IndexMut};

/// What may be copied and handed to another thread.
pub trait Plain: Copy + Send + Sync {}
impl<T: Copy + Send + Sync> Plain for T {}

/// A short array whose length is the space's matter.
pub trait Several<T>: Plain + Index<usize, Output = T> + IndexMut<usize> {
    /// Its length.
    const LEN: usize;
    /// The same value everywhere.
    fn all(value: T) -> Self;
    /// As a slice.
    fn slice(&self) -> &[T];
    /// As a slice to write to.
    fn slice_mut(&mut self) -> &mut [T];
}

impl<T: Plain, const N: usize> Several<T> for [T; N] {
    const LEN: usize = N;
    #[inline(always)]
    fn all(value: T) -> Self {
        [value; N]
    }
    #[inline(always)]
    fn slice(&self) -> &[T] {
        self
    }
    #[inline(always)]
    fn slice_mut(&mut self) -> &mut [T] {
        self
    }
}
