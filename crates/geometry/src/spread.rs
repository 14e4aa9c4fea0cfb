//! Which few of many contact points carry a flat patch: the deepest, then those farthest out, each judged by
//! distance minus how much higher it lies; points between others on one line are left out. Depends on the points and their order alone.

use crate::few::Few;
use carom_math::{Column, Space};

/// A point must beat the best so far by this fraction of the patch's width \[1\]: equals keep their order, so
/// rounding does not reshuffle a resting patch.
const CLEARLY: f64 = 1e-6;

/// Depths that differ by less than this fraction of the patch's width are equal \[1\].
const ROUNDING: f64 = 1e-13;

/// Points of a patch with their gaps.
pub type Places<V> = Few<(V, f64), 8>;
/// Indices of those that are kept.
pub type Kept = Few<usize, 4>;

/// Indices, ascending, of at most `limit` (2 | 4) of the points (place, gap) of one patch with this normal.
pub fn spread<S: Space>(points: &[(S::Vector, f64)], normal: S::Vector, limit: usize) -> Kept {
    let mut kept = Kept::default();
    if points.len() <= 2 {
        kept.extend(0..points.len());
        return kept;
    }
    let flat = |v: S::Vector| v - normal * normal.dot(v);
    let width = points.iter().fold(0.0, |m: f64, p| m.max(flat(p.0 - points[0].0).norm()));
    let clearly = CLEARLY * width;
    let deepest = best(points.len(), clearly, |i| -points[i].1).0;
    let (origin, floor) = points[deepest];
    // from the deepest point, in the plane, and how much higher
    let mut seen = Places::<S::Vector>::default();
    seen.extend(points.iter().map(|p| (flat(p.0 - origin), p.1 - floor)));
    let far = best(seen.len(), clearly, |i| seen[i].0.norm() - seen[i].1).0;
    kept.extend([deepest, far]);
    if limit > 2 {
        let along = seen[far].0.normalized().unwrap_or(S::tangent(normal, 0));
        // the in-plane direction across the first line, the same for every point
        let off_line = |i: usize| seen[i].0 - along * along.dot(seen[i].0);
        let (side, clear) = best(seen.len(), clearly, |i| off_line(i).norm() - seen[i].1);
        if clear <= clearly {
            with_deepest(points, &mut kept, width); // all on one line
            return kept;
        }
        let across = off_line(side).normalized().unwrap_or(S::tangent(normal, S::SLIP - 1));
        let triangle = Triangle::new([S::Vector::ZERO, seen[far].0, seen[side].0], along, across);
        kept.push(side);
        let last = best(seen.len(), clearly, |i| triangle.outside(seen[i].0) - seen[i].1);
        if last.1 > clearly {
            kept.push(last.0);
        }
    }
    with_deepest(points, &mut kept, width);
    kept
}

/// The first index with the largest score, and that score: a later one must beat it by `clearly`.
#[inline]
fn best(count: usize, clearly: f64, score: impl Fn(usize) -> f64) -> (usize, f64) {
    let mut winner = (0, f64::NEG_INFINITY);
    for i in 0..count {
        let value = score(i);
        if value > winner.1 + clearly {
            winner = (i, value);
        }
    }
    winner
}

/// Puts the choice in ascending order, its nearest point replaced by the very deepest one where that was passed over.
fn with_deepest<V: Column>(points: &[(V, f64)], kept: &mut Kept, width: f64) {
    let lowest = |indices: &mut dyn Iterator<Item = usize>| {
        indices.reduce(|a, b| if points[b].1 < points[a].1 { b } else { a }).unwrap_or(0)
    };
    let deepest = lowest(&mut (0..points.len()));
    if points[deepest].1 < points[lowest(&mut kept.iter().copied())].1 - ROUNDING * width {
        let distance = |i: usize| (points[i].0 - points[deepest].0).norm_squared();
        if let Some(nearest) = kept.iter_mut().reduce(|a, b| if distance(*b) < distance(*a) { b } else { a })
        {
            *nearest = deepest;
        }
    }
    kept.sort_unstable();
    let mut before = None;
    kept.retain(|&i| before.replace(i) != Some(i));
}

/// A triangle in the plane of `along` and `across`, about its first corner.
struct Triangle<V> {
    along: V,
    across: V,
    /// Of each side with a length: its start, its edge over its length in the plane, and the sign that points inward.
    sides: Few<(V, [f64; 3]), 3>,
}

impl<V: Column> Triangle<V> {
    fn new(corners: [V; 3], along: V, across: V) -> Self {
        let mut triangle = Triangle { along, across, sides: Few::default() };
        for k in 0..3 {
            let (a, b, c) = (corners[k], corners[(k + 1) % 3], corners[(k + 2) % 3]);
            let (ex, ey) = triangle.flat(b - a);
            let length = (ex * ex + ey * ey).sqrt();
            if length > 0.0 {
                let edge = [ex, ey, length];
                let inward = if triangle.height(a, edge, c) >= 0.0 { 1.0 } else { -1.0 };
                triangle.sides.push((a, [inward * ex, inward * ey, length]));
            }
        }
        triangle
    }
    #[inline]
    fn flat(&self, v: V) -> (f64, f64) {
        (self.along.dot(v), self.across.dot(v))
    }
    #[inline]
    fn height(&self, start: V, [ex, ey, length]: [f64; 3], point: V) -> f64 {
        let (x, y) = self.flat(point - start);
        (ex * y - ey * x) / length
    }
    /// How far a point lies outside: the largest distance beyond a side \[m\].
    #[inline]
    fn outside(&self, point: V) -> f64 {
        self.sides.iter().fold(f64::NEG_INFINITY, |most, s| most.max(-self.height(s.0, s.1, point)))
    }
}
