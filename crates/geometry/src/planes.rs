//! The face of a polytope that separates it most from another core, found best first: any point w of the other core bounds
//! face i by s(n_i) <= n_i.w - d_i, so faces are asked in the order of what is still possible, until none can win. Bounds
//! are kept four at a time. Knows no pairs and no edges.

use crate::few::Few;
use carom_math::lanes::{Four, Job, Lanes};
use carom_math::{Column, Vec3, vec3};

/// Planes of a row.
const ROW: usize = 4;
/// Rows up to which bounds live in place.
const NEAR: usize = 32;

/// Planes normal.x = offset of the faces of a polytope, by component; what fills the last row up repeats the first.
#[derive(Clone, Debug, Default)]
pub struct Planes {
    rows: Vec<[[f64; ROW]; 4]>,
}

/// What is known of the best face so far.
#[derive(Clone, Copy)]
pub struct Best {
    /// Its number.
    pub face: usize,
    /// Its s(n) \[m\].
    pub gap: f64,
}

/// A search for the best face.
pub struct Search<'a, F> {
    /// Planes of the faces.
    pub planes: &'a Planes,
    /// A point of the other core, in the frame of the planes.
    pub point: Vec3,
    /// s(n) that a face must exceed \[m\].
    pub floor: f64,
    /// Gaps that differ by less are equal \[m\]: of equal faces the first is the best.
    pub bias: f64,
    /// The first face beyond this ends the search \[m\].
    pub reach: f64,
    /// The point of the other core that is farthest along a direction, in the frame of the planes.
    pub support: F,
}

impl Planes {
    /// From normals and offsets, in their order.
    pub fn of(planes: impl ExactSizeIterator<Item = (Vec3, f64)>) -> Self {
        let count = planes.len();
        let mut rows = vec![[[0.0; ROW]; 4]; count.div_ceil(ROW)];
        for (i, (normal, offset)) in planes.enumerate() {
            let filled = if i == 0 { 0..rows.len() * ROW } else { i..i + 1 };
            for at in filled {
                let row = &mut rows[at / ROW];
                (0..3).for_each(|k| row[k][at % ROW] = normal[k]);
                row[3][at % ROW] = offset;
            }
        }
        Planes { rows }
    }
}

/// A support that can be asked with this machine's instructions.
pub trait Support {
    /// The farthest point along a direction.
    fn farthest<L: Lanes>(&self, lanes: L, direction: Vec3) -> Vec3;
}

impl<F: Support> Job for Search<'_, F> {
    type Output = Option<Best>;
    #[inline(always)]
    fn work<L: Lanes>(self, lanes: L) -> Option<Best> {
        let Search { planes: Planes { rows }, point, floor, bias, reach, support } = self;
        let mut bounds = Few::<[f64; ROW], NEAR>::default();
        for row in rows {
            bounds.push(heights(lanes, row, point).store());
        }
        let bounds: &mut [[f64; ROW]] = &mut bounds;
        let mut best: Option<Best> = None;
        // each face is asked once
        for _ in 0..ROW * rows.len() {
            let (face, bound) = highest(lanes, bounds);
            if bound <= best.map_or(floor, |b| b.gap - bias) {
                break;
            }
            let [x, y, z, offset] = &rows[face / ROW];
            let normal = vec3(x[face % ROW], y[face % ROW], z[face % ROW]);
            let met = support.farthest(lanes, -normal);
            let gap = normal.dot(met) - offset[face % ROW];
            for (row, bound) in rows.iter().zip(bounds.iter_mut()) {
                *bound = heights(lanes, row, met).min(lanes.four(bound)).store();
            }
            bounds[face / ROW][face % ROW] = f64::NEG_INFINITY;
            let better = match best {
                None => gap > floor,
                Some(b) => gap > b.gap + bias || (face < b.face && gap >= b.gap - bias),
            };
            if better {
                best = Some(Best { face, gap });
            }
            if gap > reach {
                return Some(Best { face, gap });
            }
        }
        best
    }
}

/// Heights of a point over four planes \[m\].
#[inline(always)]
fn heights<L: Lanes>(lanes: L, [x, y, z, offset]: &[[f64; ROW]; 4], p: Vec3) -> L::Four {
    lanes.four(x) * lanes.four_of(p[0])
        + lanes.four(y) * lanes.four_of(p[1])
        + lanes.four(z) * lanes.four_of(p[2])
        - lanes.four(offset)
}

/// The first of the largest numbers, and that number; (0, -infinity) for none.
#[inline(always)]
fn highest<L: Lanes>(lanes: L, all: &[[f64; ROW]]) -> (usize, f64) {
    let mut most = lanes.four_of(f64::NEG_INFINITY);
    for four in all {
        most = most.max(lanes.four(four));
    }
    let [a, b, c, d] = most.store();
    let largest = a.max(b).max(c.max(d));
    let top = lanes.four_of(largest);
    for (k, four) in all.iter().enumerate() {
        let below = lanes.four(four).less(top);
        if below != 15 {
            return (ROW * k + (!below).trailing_zeros() as usize % ROW, largest);
        }
    }
    (0, f64::NEG_INFINITY)
}

#[cfg(test)]
mod tests {
    use super::*;
    use carom_math::lanes::dispatch;

    struct Points(Vec<Vec3>);

    impl Support for Points {
        fn farthest<L: Lanes>(&self, _: L, direction: Vec3) -> Vec3 {
            let farther = |p: Vec3, q: &Vec3| if direction.dot(*q) > direction.dot(p) { *q } else { p };
            self.0.iter().fold(self.0[0], farther)
        }
    }

    #[test]
    fn the_best_face_is_the_best_of_all() {
        let mut state = 3u64;
        let mut number = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 11) as f64 / (1u64 << 52) as f64 - 1.0
        };
        for count in 4..40 {
            let mut vector = || vec3(number(), number(), number());
            let normals: Vec<Vec3> =
                (0..count).map(|_| vector().normalized().expect("a direction")).collect();
            let others = Points((0..9).map(|_| vector() + vec3(0.3, 0.2, 0.9)).collect());
            let gap = |n: &Vec3| n.dot(others.farthest(carom_math::lanes::Portable, -*n)) - 1.0;
            let all: Vec<f64> = normals.iter().map(gap).collect();
            let most = all.iter().copied().fold(f64::NEG_INFINITY, f64::max);
            let planes = Planes::of(normals.iter().map(|n| (*n, 1.0)));
            let search = |floor, support| Search {
                planes: &planes,
                point: others.0[0],
                floor,
                bias: 1e-12,
                reach: f64::INFINITY,
                support,
            };
            let found = dispatch(search(f64::NEG_INFINITY, Points(others.0.clone()))).expect("a face");
            assert_eq!((found.gap, all[found.face]), (most, most));
            let portable = carom_math::lanes::Portable
                .run(search(f64::NEG_INFINITY, Points(others.0.clone())))
                .expect("a face");
            assert_eq!((portable.face, portable.gap), (found.face, found.gap));
            assert!(dispatch(search(most, Points(others.0.clone()))).is_none());
        }
    }
}
