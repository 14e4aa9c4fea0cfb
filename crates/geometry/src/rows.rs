//! Boxes of about one size in rows: cells of one cell's side across the first axis, each a row along it, sorted by where
//! the boxes begin. A box overlaps others of its own row and of the rows beside it alone, because none is larger than a
//! cell; along the rows it is a sweep. Rows are counted modulo 2^16: rows far apart may fall together, which costs a look
//! and changes nothing, for every pair is judged by its bounds. Knows no shapes; one text for both spaces.

use crate::geometry::Aabb;
use carom_math::Space;

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
    sorted: Vec<Aabb<S>>,
    /// Where each row begins, by its number, ascending; a last one behind all.
    starts: Vec<(u32, u32)>,
    /// Items that overlap one.
    hits: Vec<u32>,
}

impl<S: Space> Default for Rows<S> {
    fn default() -> Self {
        Rows { keys: Vec::new(), sorted: Vec::new(), starts: Vec::new(), hits: Vec::new() }
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
    /// Visits every pair of items whose boxes overlap or touch, once, in some order; all of the boxes fit `size`. False
    /// when they lie too close for rows: pairs may be missing then.
    pub fn overlaps(
        &mut self,
        items: &[u32],
        bounds: &[Aabb<S>],
        size: f64,
        mut visit: impl FnMut(u32, u32),
    ) -> bool {
        let cell = size * ROOM;
        self.sort(items, bounds, cell);
        let (mut looks, mut hits) = (LOOKS * items.len(), std::mem::take(&mut self.hits));
        for r in 0..self.starts.len().saturating_sub(1) {
            let (row, first) = self.starts[r];
            let end = self.starts[r + 1].1;
            if !self.sweep((first, end), None, cell, &mut looks, &mut hits, &mut visit) {
                return false;
            }
            for beside in beside::<S>(row).into_iter().flatten() {
                if let Ok(other) = self.starts[..self.starts.len() - 1].binary_search_by_key(&beside, |s| s.0)
                {
                    let there = (self.starts[other].1, self.starts[other + 1].1);
                    if !self.sweep((first, end), Some(there), cell, &mut looks, &mut hits, &mut visit) {
                        return false;
                    }
                }
            }
        }
        self.hits = hits;
        true
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
        self.sorted.clear();
        self.sorted.extend(self.keys.iter().map(|k| bounds[k.1 as usize]));
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

    /// Visits the pairs within a stretch of keys, or between two. False when there were too many looks.
    #[inline]
    fn sweep(
        &self,
        here: (u32, u32),
        there: Option<(u32, u32)>,
        cell: f64,
        looks: &mut usize,
        hits: &mut Vec<u32>,
        visit: &mut impl FnMut(u32, u32),
    ) -> bool {
        let (mut from, end) = there.unwrap_or(here);
        for i in here.0..here.1 {
            let own = &self.sorted[i as usize];
            let last = order(own.max[0]);
            match there {
                None => from = i + 1,
                Some(_) => {
                    // of boxes that begin at one place but for rounding the first is asked for all
                    let first = order(f64::from((own.min[0] as f32).next_down()) - cell);
                    while from < end && (self.keys[from as usize].0 as u32) < first {
                        from += 1;
                    }
                }
            }
            let ahead = &self.keys[from as usize..end as usize];
            let looked = ahead.iter().position(|k| k.0 as u32 > last).unwrap_or(ahead.len());
            if looked > *looks {
                return false;
            }
            *looks -= looked;
            // whether two boxes overlap is a coin's toss: the hits are gathered without asking
            hits.resize(hits.len().max(looked), 0);
            let mut count = 0;
            for (key, other) in ahead[..looked].iter().zip(&self.sorted[from as usize..]) {
                hits[count] = key.1;
                let apart = |k: usize| (own.min[k] > other.max[k]) | (other.min[k] > own.max[k]);
                count += usize::from(!(0..S::DIM).fold(false, |any, k| any | apart(k)));
            }
            let item = self.keys[i as usize].1;
            hits[..count].iter().for_each(|&other| visit(item, other));
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
