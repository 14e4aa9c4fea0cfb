//! Numbers that workers share while they work on packs of one colour. Which of them a worker may touch no compiler can know: this
//! file holds the crate's only unsafe code, one line ([ADR 6](../../../../docs/adr/0006-where-unsafe-lives.md)).

use std::cell::Cell;
use std::ops::Range;

/// A list whose items workers read and write at once, each its own.
pub struct Shared<'a, T>(&'a [Cell<T>]);

// SAFETY. A `Cell` is not `Sync` because two threads may write one item at once, or one read what another writes. Here none
// does: in a stage of the solver an item is written in one chunk at most, and read in no other chunk then. For packs that is
// the invariant of colours (two patches of a colour share no body that moves, and `Table::scatter` writes no others);
// `SoftSolver::sort` checks it in debug builds for every step. Stages over records cut the list itself. Groups of islands share
// the record of the obstacle at rest alone, which `Groups` gives to none of several, so that nobody writes it. Between stages
// `Workers::stages` orders what was written before what is read.
#[allow(unsafe_code)]
unsafe impl<T: Copy + Send> Sync for Shared<'_, T> {}

impl<'a, T: Copy> Shared<'a, T> {
    /// Shares a list.
    pub fn new(items: &'a mut [T]) -> Self {
        Shared(Cell::from_mut(items).as_slice_of_cells())
    }
    /// An item.
    #[inline(always)]
    pub fn get(&self, i: usize) -> T {
        self.0[i].get()
    }
    /// Replaces an item.
    #[inline(always)]
    pub fn set(&self, i: usize, item: T) {
        self.0[i].set(item);
    }
    /// Some items in a row.
    #[inline(always)]
    pub fn row(&self, items: Range<usize>) -> &'a [Cell<T>] {
        &self.0[items]
    }
    /// The items behind the first ones, for who writes to several of them: one look at a place tells whether it is there.
    #[inline(always)]
    pub fn behind(&self, first: usize) -> Behind<'a, T> {
        Behind { items: self.0.get(first..).unwrap_or_default(), first }
    }
}

/// The items of a list behind the first ones.
pub struct Behind<'a, T> {
    items: &'a [Cell<T>],
    first: usize,
}

impl<'a, T: Copy> Behind<'a, T> {
    /// An item by its place in the whole list; none of the first ones.
    #[inline(always)]
    pub fn get(&self, i: usize) -> Option<&'a Cell<T>> {
        self.items.get(i.wrapping_sub(self.first))
    }
}
