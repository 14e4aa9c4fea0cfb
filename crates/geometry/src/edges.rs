//! Which edges of two flat-faced cores of space may cross: those that reach into the overlap, and of these the pairs whose
//! arcs of normals cross on the sphere (Gregorius 2013), tried four at a time. Pairs come in the order of a's edges and
//! then of b's; what `crossing` says of each decides. Knows no radii.

use crate::few::Few;
use crate::polytope::{EdgeSet, View};
use carom_math::lanes::{Four, Job, Lanes, dispatch};
use carom_math::{Column, Vec3};

/// Products of sines below this are rounding \[1\] (see `crossing`).
const TOUCHING: f64 = 1e-14;
/// Arcs on two sides of the sphere are told apart where the product of their sines is beyond this \[1\].
const SAME_SIDE: f64 = 1e-6;
/// Pairs of edges by number.
pub type Pairs = Few<[u16; 2], 32>;

/// Four edges: spans, and the normals at them or, of a triangle, the direction out across each.
#[derive(Clone, Copy, Default)]
struct Row {
    span: [[f64; 4]; 3],
    one: [[f64; 4]; 3],
    other: [[f64; 4]; 3],
}

/// One edge: its span, and the normals at it or, of a triangle, the direction out across it twice.
#[derive(Clone, Copy)]
struct Arc {
    span: Vec3,
    ends: [Vec3; 2],
}

/// Edges of a core, those that reach alone.
pub struct Reaching<'a, 'b> {
    /// The core.
    view: &'a View<'b>,
    /// Its edges that reach.
    edges: EdgeSet,
}

impl<'a, 'b> Reaching<'a, 'b> {
    /// The edges of a core that have an end no higher than `level` \[m\] along a direction; `None` for a core of many
    /// corners, or whose edges have no arcs.
    pub fn of(view: &'a View<'b>, direction: Vec3, level: f64) -> Option<Self> {
        if view.spokes.is_empty() {
            return None;
        }
        let mut low = match view.columns {
            Some([points, _]) => points.no_farther(direction, level),
            None => {
                let is_low = |p: &Vec3| u64::from(direction.dot(*p) <= level);
                view.points.iter().zip(0..).fold(0, |set, (p, k)| set | is_low(p) << k)
            }
        };
        let mut edges = EdgeSet::default();
        if view.spokes.len() < 64 {
            low &= (1 << view.spokes.len()) - 1;
        }
        while low != 0 {
            let spokes = &view.spokes[low.trailing_zeros() as usize];
            (0..3).for_each(|k| edges[k] |= spokes[k]);
            low &= low - 1;
        }
        Some(Reaching { view, edges })
    }

    #[inline(always)]
    fn is_triangle(&self) -> bool {
        self.view.arcs.is_empty()
    }

    /// The edges in their order.
    #[inline(always)]
    fn numbers(&self) -> impl Iterator<Item = usize> {
        let mut left = self.edges;
        std::iter::from_fn(move || {
            let k = left.iter().position(|word| *word != 0)?;
            let at = left[k].trailing_zeros() as usize;
            left[k] &= left[k] - 1;
            Some(64 * k + at)
        })
    }

    #[inline(always)]
    fn arc(&self, number: usize) -> Arc {
        if let (Some(span), Some(ends)) = (self.view.spans.get(number), self.view.arcs.get(number)) {
            return Arc { span: *span, ends: *ends };
        }
        let [p, q] = self.view.edges[number].map(|i| self.view.points[i as usize]);
        Arc { span: q - p, ends: [self.view.out_across(number).unwrap_or(Vec3::ZERO); 2] }
    }
}

/// The pairs of edges of a and b whose arcs may cross; `matrix` turns b's frame into a's, row by row.
pub fn pairs(a: &Reaching, b: &Reaching, matrix: &[[f64; 3]; 3]) -> Pairs {
    let mut found = Pairs::default();
    if !(a.is_triangle() && b.is_triangle()) {
        dispatch(Search { a, b, matrix, found: &mut found });
        return found;
    }
    for e in a.numbers() {
        found.extend(b.numbers().map(|f| [e as u16, f as u16]));
    }
    found
}

struct Search<'s, 'a, 'b> {
    a: &'s Reaching<'a, 'b>,
    b: &'s Reaching<'a, 'b>,
    matrix: &'s [[f64; 3]; 3],
    found: &'s mut Pairs,
}

impl Job for Search<'_, '_, '_> {
    type Output = ();
    #[inline(always)]
    fn work<L: Lanes>(self, lanes: L) {
        let Search { a, b, matrix, found } = self;
        let (triangle_a, triangle_b) = (a.is_triangle(), b.is_triangle());
        let mut others = b.numbers();
        let mut rows = 0;
        loop {
            let (mut row, mut names, mut count) = (Row::default(), [0; 4], 0);
            for (at, name) in names.iter_mut().enumerate() {
                let Some(number) = others.next() else { break };
                let Arc { span, ends } = b.arc(number);
                for k in 0..3 {
                    (row.span[k][at], row.one[k][at], row.other[k][at]) = (span[k], ends[0][k], ends[1][k]);
                }
                (*name, count) = (number as u16, at + 1);
            }
            if count == 0 {
                break;
            }
            rows += 1;
            row.span = turned(lanes, matrix, &row.span);
            row.one = turned(lanes, matrix, &row.one);
            row.other = turned(lanes, matrix, &row.other);
            for k in a.numbers() {
                let arc = a.arc(k);
                let mut hits = if triangle_a {
                    half_of_a(lanes, &arc, &row)
                } else if triangle_b {
                    half_of_b(lanes, &arc, &row)
                } else {
                    straddling(lanes, &arc, &row)
                };
                hits &= (1 << count) - 1;
                while hits != 0 {
                    found.push([k as u16, names[hits.trailing_zeros() as usize % 4]]);
                    hits &= hits - 1;
                }
            }
        }
        if rows > 1 {
            found.sort_unstable();
        }
    }
}

/// Four vectors turned by a matrix.
#[inline(always)]
fn turned<L: Lanes>(lanes: L, m: &[[f64; 3]; 3], v: &[[f64; 4]; 3]) -> [[f64; 4]; 3] {
    let (x, y, z) = (lanes.four(&v[0]), lanes.four(&v[1]), lanes.four(&v[2]));
    let mut out = [[0.0; 4]; 3];
    for i in 0..3 {
        let (p, q, r) = (lanes.four_of(m[i][0]), lanes.four_of(m[i][1]), lanes.four_of(m[i][2]));
        out[i] = (p * x + q * y + r * z).store();
    }
    out
}

#[inline(always)]
fn dots<L: Lanes>(lanes: L, row: &[[f64; 4]; 3], v: Vec3) -> L::Four {
    lanes.four(&row[0]) * lanes.four_of(v[0])
        + lanes.four(&row[1]) * lanes.four_of(v[1])
        + lanes.four(&row[2]) * lanes.four_of(v[2])
}

#[inline(always)]
fn squares<L: Lanes>(lanes: L, row: &[[f64; 4]; 3]) -> L::Four {
    let (x, y, z) = (lanes.four(&row[0]), lanes.four(&row[1]), lanes.four(&row[2]));
    x * x + y * y + z * z
}

/// The edges of a row whose arcs, turned round, cross that of an edge, both of solids.
#[inline(always)]
fn straddling<L: Lanes>(lanes: L, arc: &Arc, row: &Row) -> u32 {
    let Arc { span, ends: [a, b] } = *arc;
    let (uu, vv) = (lanes.four_of(span.norm_squared()), squares(lanes, &row.span));
    let (cu, du) = (dots(lanes, &row.one, span), dots(lanes, &row.other, span));
    let (av, bv) = (dots(lanes, &row.span, a), dots(lanes, &row.span, b));
    let touching = lanes.four_of(TOUCHING);
    // each arc has its ends on both sides of the other's plane, and both lie on one side of the sphere
    let apart = (touching * uu).less(cu * du)
        | (touching * vv).less(av * bv)
        | (lanes.four_of(SAME_SIDE) * (uu + vv)).less(cu * bv);
    apart ^ 15
}

/// The edges of a row of a solid whose arcs, turned round, cross the half circle across an edge of a triangle.
#[inline(always)]
fn half_of_a<L: Lanes>(lanes: L, arc: &Arc, row: &Row) -> u32 {
    let (v, out) = (arc.span, arc.ends[0]);
    let (av, bv) = (dots(lanes, &row.one, v), dots(lanes, &row.other, v));
    let (ao, bo) = (dots(lanes, &row.one, out), dots(lanes, &row.other, out));
    let sizes = [lanes.four_of(v.norm_squared()), lanes.four_of(out.norm_squared())];
    half(lanes, [av, bv], [ao, bo], sizes)
}

/// The edges of a row of a triangle across which half circles, turned round, cross the arc at an edge of a solid.
#[inline(always)]
fn half_of_b<L: Lanes>(lanes: L, arc: &Arc, row: &Row) -> u32 {
    let [a, b] = arc.ends;
    let (av, bv) = (dots(lanes, &row.span, a), dots(lanes, &row.span, b));
    let (ao, bo) = (dots(lanes, &row.one, a), dots(lanes, &row.one, b));
    half(lanes, [av, bv], [ao, bo], [squares(lanes, &row.span), squares(lanes, &row.one)])
}

/// Where an arc from a to b may cross the half circle across an edge v, turned round, through the direction `out`: given
/// the products of both with v and with `out`, and the squares of v and `out`.
#[inline(always)]
fn half<L: Lanes>(lanes: L, [av, bv]: [L::Four; 2], [ao, bo]: [L::Four; 2], [vv, oo]: [L::Four; 2]) -> u32 {
    // where the arc meets the circle's plane; of an arc in that plane nothing is said
    let there = ao * bv.abs() + bo * av.abs();
    let slack = lanes.four_of(1e-9) * (av.abs() + bv.abs() + lanes.four_of(1e-3) * vv.sqrt()) * oo.sqrt();
    let apart = (lanes.four_of(TOUCHING) * vv).less(av * bv) | slack.less(there);
    apart ^ 15
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::polytope::Polytope;
    use carom_math::lanes::Portable;
    use carom_math::{Quaternion, Rotation, vec3};

    #[test]
    fn pairs_are_all_whose_arcs_cross_in_order_and_the_same_on_every_processor() {
        let cuboid = Polytope::cuboid([1.0, 1.5, 2.0]);
        let view = cuboid.view();
        for k in 0..50 {
            let x = f64::from(k);
            let turn = Quaternion::about(vec3(0.3 + 0.1 * x, 0.2 * x, 1.0 - 0.05 * x));
            let matrix = turn.matrix();
            let all = || Reaching::of(&view, vec3(0.0, 0.0, 1.0), 9.0).expect("a box has arcs");
            let (a, b) = (all(), all());
            let found = pairs(&a, &b, &matrix);
            assert!(found.windows(2).all(|w| w[0] < w[1]), "in order");
            let mut portable = Pairs::default();
            Portable.run(Search { a: &a, b: &b, matrix: &matrix, found: &mut portable });
            assert_eq!(found[..], portable[..]);
            // a direction is held by a corner of each, but where the arcs of two edges cross
            let crossed = |e: &[Vec3; 2], f: [Vec3; 2]| {
                let (one, other) = (e[1].cross(e[0]), f[1].cross(f[0]));
                let (c, d) = (f[0].dot(one), f[1].dot(one));
                let (p, q) = (e[0].dot(other), e[1].dot(other));
                c * d < -1e-9 && p * q < -1e-9 && c * q > 1e-9
            };
            for (i, e) in view.arcs.iter().enumerate() {
                for (j, f) in view.arcs.iter().enumerate() {
                    let there = f.map(|m| -turn.rotate(m));
                    let pair = [i as u16, j as u16];
                    assert!(
                        !crossed(e, there) || found.contains(&pair),
                        "edges {pair:?}, turned by {turn:?}"
                    );
                }
            }
        }
    }
}
