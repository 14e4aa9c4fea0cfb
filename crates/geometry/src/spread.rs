//! Which few of many contact points carry a flat patch: the deepest, then those farthest out, each judged by
//! distance minus how much higher it lies; points between others on one line are left out. Depends on the points and their order alone.

use carom_math::{Column, Space};

/// A point must beat the best so far by this fraction of the patch's width \[1\]: equals keep their order, so
/// rounding does not reshuffle a resting patch.
const CLEARLY: f64 = 1e-6;

/// Depths that differ by less than this fraction of the patch's width are equal \[1\].
const ROUNDING: f64 = 1e-13;

/// Indices, ascending, of at most `limit` (2 | 4) of the points (place, gap) of one patch with this normal.
pub fn spread<S: Space>(points: &[(S::Vector, f64)], normal: S::Vector, limit: usize) -> Vec<usize> {
    if points.len() <= 2 {
        return (0..points.len()).collect();
    }
    let flat = |v: S::Vector| v - normal * normal.dot(v);
    let width = points.iter().fold(0.0, |m: f64, p| m.max(flat(p.0 - points[0].0).norm()));
    let best = |score: &dyn Fn(usize) -> f64| {
        let mut winner = (0, f64::NEG_INFINITY);
        for i in 0..points.len() {
            let value = score(i);
            if value > winner.1 + CLEARLY * width {
                winner = (i, value);
            }
        }
        winner
    };
    let deepest = best(&|i| -points[i].1).0;
    let (origin, floor) = points[deepest];
    let height = |i: usize| points[i].1 - floor;
    let out = |i: usize| flat(points[i].0 - origin);
    let far = best(&|i| out(i).norm() - height(i)).0;
    let mut kept = vec![deepest, far];
    if limit > 2 {
        let along = out(far).normalized().unwrap_or(S::tangent(normal, 0));
        // the in-plane direction across the first line, the same for every point
        let off_line = |i: usize| out(i) - along * along.dot(out(i));
        let (side, clear) = best(&|i| off_line(i).norm() - height(i));
        if clear <= CLEARLY * width {
            return with_deepest(points, kept, width); // all on one line
        }
        let across = off_line(side).normalized().unwrap_or(S::tangent(normal, S::SLIP - 1));
        let corners = [S::Vector::ZERO, out(far), out(side)];
        let beyond = |i: usize| outside(&corners, out(i), along, across);
        kept.push(side);
        let last = best(&|i| beyond(i) - height(i));
        if last.1 > CLEARLY * width {
            kept.push(last.0);
        }
    }
    with_deepest(points, kept, width)
}

/// The choice in ascending order, its nearest point replaced by the very deepest one where that was passed over.
fn with_deepest<V: Column>(points: &[(V, f64)], mut kept: Vec<usize>, width: f64) -> Vec<usize> {
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
    kept.dedup();
    kept
}

/// How far a point lies outside the triangle of three corners, in the plane of `along` and `across`
/// (largest distance beyond a side).
fn outside<V: Column>(corners: &[V; 3], point: V, along: V, across: V) -> f64 {
    let flat = |v: V| (along.dot(v), across.dot(v));
    let mut most = f64::NEG_INFINITY;
    for k in 0..3 {
        let (a, b, c) = (corners[k], corners[(k + 1) % 3], corners[(k + 2) % 3]);
        let (ex, ey) = flat(b - a);
        let length = (ex * ex + ey * ey).sqrt();
        if length == 0.0 {
            continue;
        }
        let height = |v: V| {
            let (x, y) = flat(v - a);
            (ex * y - ey * x) / length
        };
        let inward = if height(c) >= 0.0 { 1.0 } else { -1.0 };
        most = most.max(-inward * height(point));
    }
    most
}
