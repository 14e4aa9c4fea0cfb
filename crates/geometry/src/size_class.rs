//! The size up to which boxes go into rows (see `rows`): the one that makes the expected cost of all of them least. For N
//! boxes up to a size m, of volume V together and packed without gaps, a box has as many others to look at as boxes are
//! in the cells around it, 3^(d-1) N m^d / V; a box that is larger goes into a tree. Depends on the boxes alone.

use crate::geometry::Aabb;
use carom_math::{Column, Space};

/// Time of sorting a box into rows, of a look at another box, and of a box in a tree \[ns\].
const COST: [f64; 3] = [60.0, 2.0, 700.0];

/// Sizes in one bin differ by less than a quarter \[1\]: a bin is a number's exponent and the first two bits after it.
const SHIFT: u32 = 50;

/// What boxes of about one size are together.
#[derive(Clone, Copy, Debug, Default)]
struct Bin {
    count: f64,
    /// \[m^DIM\]
    volume: f64,
    /// Largest \[m\].
    size: f64,
}

/// Sizes of boxes by bins; keeps its memory between updates.
#[derive(Clone, Debug, Default)]
pub struct SizeClass {
    bins: Vec<Bin>,
}

impl SizeClass {
    /// Largest size \[m\] of the boxes that should go into rows; 0 when none should.
    pub fn choose<S: Space>(&mut self, boxes: impl Iterator<Item = Aabb<S>>) -> f64 {
        // all are empty between updates
        self.bins.resize(1 << (63 - SHIFT), Bin::default());
        let (mut low, mut high, mut all) = (self.bins.len(), 0, 0.0);
        for b in boxes {
            let sides = b.max - b.min;
            let size = sides.max_abs();
            let volume = sides.as_slice().iter().product::<f64>();
            if !(size > 0.0 && size.is_finite() && volume > 0.0) {
                continue;
            }
            let k = (size.to_bits() >> SHIFT) as usize;
            let bin = &mut self.bins[k];
            *bin = Bin { count: bin.count + 1.0, volume: bin.volume + volume, size: bin.size.max(size) };
            (low, high, all) = (low.min(k), high.max(k + 1), all + 1.0);
        }
        let (mut count, mut volume) = (0.0, 0.0);
        let mut best = (all * COST[2], 0.0);
        for bin in self.bins[low.min(high)..high].iter().filter(|b| b.count > 0.0) {
            (count, volume) = (count + bin.count, volume + bin.volume);
            let around = 3f64.powi(S::DIM as i32 - 1) * count * bin.size.powi(S::DIM as i32) / volume;
            let cost = count * (COST[0] + COST[1] * around) + (all - count) * COST[2];
            if cost < best.0 {
                best = (cost, bin.size);
            }
        }
        self.bins[low.min(high)..high].fill(Bin::default());
        best.1
    }
}
