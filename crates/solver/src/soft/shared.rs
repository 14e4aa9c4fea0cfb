//! Numbers that workers share while they work on packs of one colour. Which of them a worker may touch no compiler can know: this
//! file holds the crate's only unsafe code, two lines of it ([ADR 6](../../../../docs/adr/0006-where-unsafe-lives.md)).

use carom_math::lanes::WIDTH;
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
    /// The list.
    #[inline(always)]
    pub fn list(&self) -> &'a [Cell<T>] {
        self.0
    }
}

/// Records are found in units of so many bytes, the largest that addresses count in by themselves.
const UNIT: usize = 8;

/// Whom packs join: records of eight bodies a and of eight bodies b each. Knows the last record of all, so that one look at a list
/// tells that it has them.
#[derive(Default)]
pub struct Joined {
    /// Eight times the records: places in a list as addresses count.
    pairs: Vec<[[u32; WIDTH]; 2]>,
    last: u32,
}

impl Joined {
    /// Forgets all.
    pub fn clear(&mut self) {
        self.pairs.clear();
        self.last = 0;
    }
    /// One pack more.
    ///
    /// # Panics
    /// When a record is too large to be counted so.
    pub fn push(&mut self, mut pair: [[u32; WIDTH]; 2]) {
        for place in pair.as_flattened_mut() {
            self.last = self.last.max(*place);
            *place = place.checked_mul(UNIT as u32).expect("more bodies than a step can number");
        }
        self.pairs.push(pair);
    }
    /// Records of the bodies in a lane of a pack.
    pub fn lane(&self, pack: usize, lane: usize) -> (u32, u32) {
        let [a, b] = &self.pairs[pack];
        (a[lane] / UNIT as u32, b[lane] / UNIT as u32)
    }
    /// Of the packs from one on.
    #[inline(always)]
    pub fn behind(&self, first: usize) -> impl Iterator<Item = [Places<'_>; 2]> {
        let last = self.last;
        self.pairs[first..].iter().map(move |[a, b]| [Places { places: a, last }, Places { places: b, last }])
    }
}

/// Eight places of any list that has them all.
#[derive(Clone, Copy)]
pub struct Places<'a> {
    places: &'a [u32; WIDTH],
    last: u32,
}

impl<'a> Places<'a> {
    /// The items of a list there.
    ///
    /// # Panics
    /// When the list ends before one of the places of [`Joined`].
    #[inline(always)]
    pub fn of<T>(&self, list: &'a [T]) -> Items<'a, T> {
        const { assert!(size_of::<T>().is_multiple_of(UNIT)) }
        assert!((self.last as usize) < list.len(), "a record is not in the list");
        Items { places: self.places, list }
    }
}

/// Eight items of a list.
pub struct Items<'a, T> {
    places: &'a [u32; WIDTH],
    list: &'a [T],
}

impl<'a, T> Items<'a, T> {
    /// The item in a lane.
    #[inline(always)]
    #[allow(unsafe_code)]
    pub fn item(&self, lane: usize) -> &'a T {
        let bytes = self.places[lane] as usize * (size_of::<T>() / UNIT);
        // SAFETY. `Joined` alone makes places: UNIT times records, of which it knows the last; `Places::of`, which alone makes these,
        // saw that the list has that one, and that items are so many units long. Neither list changes while it is borrowed.
        unsafe { &*self.list.as_ptr().byte_add(bytes) }
    }
    /// Whether it lies before a place of the list.
    #[inline(always)]
    pub fn is_before(&self, lane: usize, place: u32) -> bool {
        self.places[lane] < UNIT as u32 * place
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn joined() -> Joined {
        let mut joined = Joined::default();
        joined.push([[0, 1, 2, 3, 4, 5, 6, 7], [8, 0, 8, 0, 8, 0, 8, 0]]);
        joined.push([[3; WIDTH], [1; WIDTH]]);
        joined
    }

    #[test]
    fn places_find_what_lies_at_their_records() {
        let joined = joined();
        let (small, large): (Vec<[u32; 2]>, Vec<[u64; 8]>) =
            (0..9).map(|k| ([k, 7 * k], [u64::from(k); 8])).unzip();
        let pairs: Vec<_> = joined.behind(0).collect();
        let records = [[[0, 1, 2, 3, 4, 5, 6, 7], [8, 0, 8, 0, 8, 0, 8, 0]], [[3; WIDTH], [1; WIDTH]]];
        for (pack, (pair, records)) in pairs.iter().zip(records).enumerate() {
            for (places, records) in pair.iter().zip(records) {
                for (lane, record) in records.into_iter().enumerate() {
                    assert_eq!(places.of(&small).item(lane), &[record, 7 * record]);
                    assert_eq!(places.of(&large).item(lane), &[u64::from(record); 8]);
                    assert_eq!(places.of(&small).is_before(lane, 3), record < 3);
                }
            }
            assert_eq!(joined.lane(pack, 2), (records[0][2], records[1][2]));
        }
        assert_eq!(joined.behind(1).count(), 1);
    }

    #[test]
    #[should_panic(expected = "a record is not in the list")]
    fn a_list_that_ends_before_the_last_record_of_any_pack_is_refused() {
        // of the second pack no record is behind the third
        joined().behind(1).next().map(|[a, _]| *a.of(&[[0u32; 2]; 8]).item(0));
    }

    #[test]
    #[should_panic(expected = "more bodies than a step can number")]
    fn records_that_no_address_counts_are_refused() {
        joined().push([[u32::MAX / 4; WIDTH], [0; WIDTH]]);
    }
}
