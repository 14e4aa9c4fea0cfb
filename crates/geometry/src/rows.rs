//! Boxes of about one size in rows: cells of one cell's side across the first axis, each a row along it, sorted by where
//! the boxes begin. A box overlaps others of its own row and of the rows beside it alone, because none is larger than a
//! cell; along the rows it is a sweep. Rows are counted modulo 2^16: rows far apart may fall together, which costs a look
//! and changes nothing, for every pair is judged by its bounds. Knows no shapes; one text for both spaces.

use crate::broad_phase::{BOXES, Offers, Sift};
use crate::geometry::Aabb;
use carom_math::lanes::{Four, Job, Lanes, dispatch};
use carom_math::workers::Memory;
use carom_math::{Space, Workers};
use std::marker::PhantomData;
use std::ops::Range;

/// A cell over the largest box \[1\]: more than what rounding makes of a place over the cell.
const ROOM: f64 = 1.0 + 1e-6;
/// Places over the cell are below this \[1\].
const FAR: f64 = 1e9;
/// Looks per box beyond which boxes lie too close for rows \[1\].
const LOOKS: usize = 512;

/// Boxes sorted by rows; keeps its memory between updates.
#[derive(Clone, Debug)]
pub struct Rows<S: Space> {
    /// Row and place along it, and item.
    keys: Vec<(u64, u32)>,
    /// Items' bounds in the order of keys.
    blocks: Vec<Block>,
    /// Where each row begins, by its number, ascending; a last one behind all.
    starts: Vec<(u32, u32)>,
    space: PhantomData<S>,
}

/// Boxes that are looked at together.
const AT_ONCE: usize = 4;
/// Their smallest coordinates and their largest ones, by component.
type Block = [[[f64; AT_ONCE]; 2]; 3];

impl<S: Space> Default for Rows<S> {
    fn default() -> Self {
        Rows { keys: Vec::new(), blocks: Vec::new(), starts: Vec::new(), space: PhantomData }
    }
}

/// A number that orders as places do, equal for places equal to f32's rounding.
#[inline]
fn order(place: f64) -> u32 {
    // the sum makes -0 the same as 0
    let bits = (place as f32 + 0.0).to_bits();
    if bits >> 31 == 1 { !bits } else { bits | 1 << 31 }
}

/// True for boxes that rows with cells for boxes up to `size` \[m\] can hold.
#[inline]
pub fn fits<S: Space>(bounds: &Aabb<S>, size: f64) -> bool {
    (0..S::DIM).all(|k| bounds.max[k] - bounds.min[k] <= size && bounds.min[k].abs() < FAR * size)
}

impl<S: Space> Rows<S> {
    /// Adds every pair of items whose boxes overlap or touch that are kept, once, in some order; all of the boxes fit `size`.
    /// False when they lie too close for rows: pairs may be missing then.
    pub fn overlaps(
        &mut self,
        (items, bounds, size): (&[u32], &[Aabb<S>], f64),
        sift: Sift<'_>,
        (workers, memory): (&Workers, &mut Memory<Offers>),
        pairs: &mut Vec<(u32, u32)>,
    ) -> bool {
        let cell = size * ROOM;
        self.sort(items, bounds, cell);
        let (rows, most, mut looks) = (&*self, LOOKS * items.len(), 0);
        let starts = &rows.starts[..rows.starts.len() - 1];
        let at_a_time = (starts.len() * BOXES).div_ceil(items.len().max(1)).max(1);
        let find = |first: usize, some: &[(u32, u32)], offers: &mut Offers| {
            offers.begin();
            dispatch(Sweep { rows, cell, most, some: first..first + some.len(), offers: &mut *offers });
            offers.sift(sift);
        };
        workers.chunks(starts, at_a_time, memory, find, |offers| {
            looks += offers.looks;
            offers.append_to(pairs);
        });
        looks <= most
    }

    fn sort(&mut self, items: &[u32], bounds: &[Aabb<S>], cell: f64) {
        let per_cell = 1.0 / cell;
        self.keys.clear();
        self.keys.extend(items.iter().map(|&i| {
            let min = bounds[i as usize].min;
            let row = (1..S::DIM).fold(0, |row, k| {
                let place = (min[k] * per_cell).floor() as i64;
                row << 16 | u64::from(place as u16)
            });
            (row << 32 | u64::from(order(min[0])), i)
        }));
        self.keys.sort_unstable();
        self.blocks.clear();
        self.blocks.resize(self.keys.len().div_ceil(AT_ONCE), [[[0.0; AT_ONCE]; 2]; 3]);
        for (i, key) in self.keys.iter().enumerate() {
            let (own, block) = (&bounds[key.1 as usize], &mut self.blocks[i / AT_ONCE]);
            for (k, [low, high]) in block.iter_mut().enumerate().take(S::DIM) {
                (low[i % AT_ONCE], high[i % AT_ONCE]) = (own.min[k], own.max[k]);
            }
        }
        self.starts.clear();
        let mut last = None;
        for (k, key) in self.keys.iter().enumerate() {
            let row = (key.0 >> 32) as u32;
            if last.replace(row) != Some(row) {
                self.starts.push((row, k as u32));
            }
        }
        self.starts.push((u32::MAX, self.keys.len() as u32));
    }
}

/// The sweep over some rows; it ends early where there were too many looks.
struct Sweep<'a, S: Space> {
    rows: &'a Rows<S>,
    cell: f64,
    most: usize,
    some: Range<usize>,
    offers: &'a mut Offers,
}

impl<S: Space> Job for Sweep<'_, S> {
    type Output = ();
    #[inline(always)]
    fn work<L: Lanes>(mut self, lanes: L) {
        let starts = &self.rows.starts;
        for r in self.some.clone() {
            let (row, first) = starts[r];
            let here = (first, starts[r + 1].1);
            let mut stretches = [None; 5];
            stretches[0] = Some(here);
            for (stretch, beside) in stretches[1..].iter_mut().zip(beside::<S>(row)) {
                let Some(beside) = beside else { continue };
                if let Ok(other) = starts[..starts.len() - 1].binary_search_by_key(&beside, |s| s.0) {
                    *stretch = Some((starts[other].1, starts[other + 1].1));
                }
            }
            for (k, there) in stretches.iter().enumerate() {
                if there.is_some_and(|there| !self.pairs(lanes, here, there, k == 0)) {
                    return;
                }
            }
        }
    }
}

impl<S: Space> Sweep<'_, S> {
    /// Visits the pairs between two stretches of keys, or within one. False when there were too many looks.
    #[inline(always)]
    fn pairs<L: Lanes>(&mut self, lanes: L, here: (u32, u32), there: (u32, u32), within: bool) -> bool {
        let (keys, blocks) = (self.rows.keys.as_slice(), self.rows.blocks.as_slice());
        let (mut from, end) = (there.0 as usize, there.1 as usize);
        for i in here.0 as usize..here.1 as usize {
            let own = &blocks[i / AT_ONCE];
            let side = |k: usize, end: usize| own[k][end][i % AT_ONCE];
            let mut sides = [[lanes.four_of(0.0); 2]; 3];
            for (k, [low, high]) in sides.iter_mut().enumerate().take(S::DIM) {
                (*low, *high) = (lanes.four_of(side(k, 0)), lanes.four_of(side(k, 1)));
            }
            let last = order(side(0, 1));
            if within {
                from = i + 1;
            } else {
                // of boxes that begin at one place but for rounding the first is asked for all
                let first = order(f64::from((side(0, 0) as f32).next_down()) - self.cell);
                while from < end && (keys[from].0 as u32) < first {
                    from += 1;
                }
            }
            let mut at = from;
            while at < end && keys[at].0 as u32 <= last {
                let (block, begin) = (&blocks[at / AT_ONCE], at & !(AT_ONCE - 1));
                // those of the four that begin later are apart along the row; those before or behind are not asked
                let mut apart = (1 << (at - begin)) - 1;
                if end - begin < AT_ONCE {
                    apart |= (15 << (end - begin)) & 15;
                }
                for k in 0..S::DIM {
                    let [low, high] = &block[k];
                    apart |= sides[k][1].less(lanes.four(low)) | lanes.four(high).less(sides[k][0]);
                }
                let mut hits = apart ^ 15;
                while hits != 0 {
                    let other = keys[begin + hits.trailing_zeros() as usize].1;
                    self.offers.offer(keys[i].1, other);
                    hits &= hits - 1;
                }
                at = begin + AT_ONCE;
            }
            self.offers.looks += at.saturating_sub(from);
            if self.offers.looks > self.most {
                return false;
            }
        }
        true
    }
}

/// The rows beside one that have not looked at it: one of each pair of opposite neighbours.
fn beside<S: Space>(row: u32) -> [Option<u32>; 4] {
    let (low, high) = (row as u16, (row >> 16) as u16);
    let neighbour =
        |dh: u16, dl: u16| Some(u32::from(high.wrapping_add(dh)) << 16 | u32::from(low.wrapping_add(dl)));
    if S::DIM == 2 {
        return [neighbour(0, 1), None, None, None];
    }
    [neighbour(0, 1), neighbour(1, 0), neighbour(1, 1), neighbour(1, u16::MAX)]
}
