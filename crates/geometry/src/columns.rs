//! Vectors of space by component, four to a row, so that the farthest of them along a direction is found four at a
//! time where the machine has registers for that. Knows no polytopes.

use carom_math::Vec3;
use carom_math::lanes::{Four, Job, Lanes, dispatch};
#[cfg(target_arch = "x86_64")]
use pulp::{Simd, WithSimd};

/// Vectors of a row.
const ROW: usize = 4;
/// Some vectors by component.
type Row = [[f64; ROW]; 3];

/// Some vectors; what fills the last row up repeats the first.
#[derive(Clone, Debug, Default)]
pub struct Columns {
    rows: Vec<Row>,
}

impl Columns {
    /// From vectors, in their order.
    pub fn of(vectors: impl ExactSizeIterator<Item = Vec3>) -> Self {
        let count = vectors.len();
        let mut rows = vec![[[0.0; ROW]; 3]; count.div_ceil(ROW)];
        for (i, v) in vectors.enumerate() {
            let filled = if i == 0 { 0..rows.len() * ROW } else { i..i + 1 };
            filled.for_each(|at| (0..3).for_each(|k| rows[at / ROW][k][at % ROW] = v[k]));
        }
        Columns { rows }
    }
    /// The first of those that lie farthest along a direction, and how far; (0, -infinity) for none. The bits are the
    /// same on every machine: products and sums are rounded one by one.
    #[inline]
    pub fn farthest(&self, direction: Vec3) -> (usize, f64) {
        #[cfg(target_arch = "x86_64")]
        if let Some(simd) = pulp::x86::V3::try_new() {
            return Simd::vectorize(simd, Farthest(&self.rows, direction.0));
        }
        one_by_one(&self.rows, direction.0)
    }
}

impl Columns {
    /// The first of those that lie farthest along a direction, for who works in lanes already; 0 for none.
    #[inline(always)]
    pub fn farthest_in<L: Lanes>(&self, lanes: L, d: Vec3) -> usize {
        let (x, y, z) = (lanes.four_of(d[0]), lanes.four_of(d[1]), lanes.four_of(d[2]));
        let mut best = lanes.four_of(f64::NEG_INFINITY);
        // numbers of vectors are small, so they are exact
        let (row_of, mut number) = (lanes.four_of(ROW as f64), lanes.four(&[0.0, 1.0, 2.0, 3.0]));
        let mut found = number;
        for row in &self.rows {
            let along = x * lanes.four(&row[0]) + y * lanes.four(&row[1]) + z * lanes.four(&row[2]);
            found = best.if_less(along, number, found);
            best = along.max(best);
            number = number + row_of;
        }
        let (best, found) = (best.store(), found.store());
        let mut winner = 0;
        for k in 1..ROW {
            if best[k] > best[winner] || (best[k] == best[winner] && found[k] < found[winner]) {
                winner = k;
            }
        }
        found[winner] as u32 as usize
    }
    /// The set, bit by bit, of those that are no farther along a direction than a level; of up to 64.
    #[inline]
    pub fn no_farther(&self, direction: Vec3, level: f64) -> u64 {
        dispatch(NoFarther(&self.rows, direction, level))
    }
}

impl Columns {
    /// Least and most along each of three directions; of none of them infinite the wrong way round.
    #[inline]
    pub fn spans(&self, directions: &[[f64; 3]; 3]) -> [[f64; 2]; 3] {
        dispatch(Spans(&self.rows, directions))
    }
}

struct Spans<'a>(&'a [Row], &'a [[f64; 3]; 3]);

impl Job for Spans<'_> {
    type Output = [[f64; 2]; 3];
    #[inline(always)]
    fn work<L: Lanes>(self, lanes: L) -> [[f64; 2]; 3] {
        let Spans(rows, directions) = self;
        let mut out = [[0.0; 2]; 3];
        for (span, d) in out.iter_mut().zip(directions) {
            let (x, y, z) = (lanes.four_of(d[0]), lanes.four_of(d[1]), lanes.four_of(d[2]));
            let (mut least, mut most) = (lanes.four_of(f64::INFINITY), lanes.four_of(f64::NEG_INFINITY));
            for row in rows {
                let along = x * lanes.four(&row[0]) + y * lanes.four(&row[1]) + z * lanes.four(&row[2]);
                (least, most) = (along.min(least), along.max(most));
            }
            let ([a, b, c, d], [p, q, r, s]) = (least.store(), most.store());
            *span = [a.min(b).min(c.min(d)), p.max(q).max(r.max(s))];
        }
        out
    }
}

struct NoFarther<'a>(&'a [Row], Vec3, f64);

impl Job for NoFarther<'_> {
    type Output = u64;
    #[inline(always)]
    fn work<L: Lanes>(self, lanes: L) -> u64 {
        let NoFarther(rows, d, level) = self;
        let (x, y, z) = (lanes.four_of(d[0]), lanes.four_of(d[1]), lanes.four_of(d[2]));
        let (level, mut farther) = (lanes.four_of(level), 0);
        for (k, row) in rows.iter().enumerate() {
            let along = x * lanes.four(&row[0]) + y * lanes.four(&row[1]) + z * lanes.four(&row[2]);
            farther |= u64::from(level.less(along)) << ((ROW * k) & 63);
        }
        !farther
    }
}

/// The search in registers of four.
#[cfg(target_arch = "x86_64")]
struct Farthest<'a>(&'a [Row], [f64; 3]);

#[cfg(target_arch = "x86_64")]
impl WithSimd for Farthest<'_> {
    type Output = (usize, f64);
    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> (usize, f64) {
        let Farthest(rows, direction) = self;
        if S::F64_LANES != ROW {
            return one_by_one(rows, direction);
        }
        let four = |values: &[f64; ROW]| S::as_simd_f64s(values).0[0];
        let [x, y, z] = direction.map(|d| simd.splat_f64s(d));
        // numbers of vectors are small, so they are exact
        let (row_of, mut number) = (simd.splat_f64s(ROW as f64), four(&[0.0, 1.0, 2.0, 3.0]));
        // the best of each place
        let (mut best, mut found) = (simd.splat_f64s(f64::NEG_INFINITY), number);
        for row in rows {
            let level = simd.add_f64s(simd.mul_f64s(x, four(&row[0])), simd.mul_f64s(y, four(&row[1])));
            let along = simd.add_f64s(level, simd.mul_f64s(z, four(&row[2])));
            let farther = simd.greater_than_f64s(along, best);
            best = simd.select_f64s(farther, along, best);
            found = simd.select_f64s(farther, number, found);
            number = simd.add_f64s(number, row_of);
        }
        let stored = |values: S::f64s| {
            let mut out = [0.0; ROW];
            S::as_mut_simd_f64s(&mut out).0[0] = values;
            out
        };
        first_of_best(stored(best), stored(found))
    }
}

/// The best of four vectors, numbered; of equal ones the first.
#[cfg(target_arch = "x86_64")]
#[inline(always)]
fn first_of_best(best: [f64; ROW], numbers: [f64; ROW]) -> (usize, f64) {
    let better = |one: [f64; 2], other: [f64; 2]| {
        let other_is = (other[1] > one[1]) | ((other[1] == one[1]) & (other[0] < one[0]));
        if other_is { other } else { one }
    };
    let at = |k: usize| [numbers[k], best[k]];
    let [number, along] = better(better(at(0), at(1)), better(at(2), at(3)));
    (number as u32 as usize, along)
}

/// The same where there are no such registers.
fn one_by_one(rows: &[Row], [x, y, z]: [f64; 3]) -> (usize, f64) {
    let along = |row: &Row, k: usize| x * row[0][k] + y * row[1][k] + z * row[2][k];
    let all = rows.iter().flat_map(|row| (0..ROW).map(move |k| along(row, k)));
    all.enumerate().fold((0, f64::NEG_INFINITY), |best, one| if one.1 > best.1 { one } else { best })
}

#[cfg(test)]
mod tests {
    use super::*;
    use carom_math::{Column, vec3};

    /// Numbers of few values, so that ties are common.
    fn vectors(count: usize, seed: usize) -> Vec<Vec3> {
        let number = |i: usize| ((i * 7919 + seed * 104_729) % 5) as f64 - 2.0;
        (0..count).map(|i| vec3(number(3 * i), number(3 * i + 1), number(3 * i + 2))).collect()
    }

    #[test]
    fn the_first_of_the_farthest_is_found() {
        for seed in 0..200 {
            let all = vectors(1 + seed % 23, seed);
            let columns = Columns::of(all.iter().copied());
            for direction in vectors(9, seed + 1) {
                let along: Vec<f64> = all.iter().map(|v| direction.dot(*v)).collect();
                let largest = along.iter().fold(f64::NEG_INFINITY, |m, a| m.max(*a));
                let first = along.iter().position(|a| *a == largest).expect("one is the largest");
                assert_eq!(columns.farthest(direction), (first, largest), "{all:?} along {direction:?}");
                assert_eq!(one_by_one(&columns.rows, direction.0), (first, largest));
                let least = along.iter().fold(f64::INFINITY, |m, a| m.min(*a));
                assert_eq!(columns.spans(&[[0.0; 3], direction.0, [0.0; 3]])[1], [least, largest]);
            }
        }
    }
}
