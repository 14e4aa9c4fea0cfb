//! Two boxes of space, half sides g and h, axes a_i and b_j, the centre of b at t from that of a: along a unit vector n
//!   s(n) = |n.t| - sum_i g_i |n.a_i| - sum_j h_j |n.b_j|
//! (Gottschalk 1996), in closed form on the 6 + 6 face normals and the 9 directions a_i x b_j. It says which crossings
//! of edges may win before an edge is looked at; labels, witnesses and ties are those of `overlap`. Knows no radii.

use crate::crossing::{Crossing, Edge};
use crate::geometry::Aabb;
use crate::kernel::Separation;
use crate::overlap::BIAS;
use crate::polytope::View;
use crate::separate::{self, Pair};
use carom_math::{Column, Pose, Spatial, Vec3};

/// Squared sine of the angle between two edges below which they have no direction across \[1\]; `overlap` leaves out all
/// up to 1e-18.
pub const PARALLEL: f64 = 0.9e-18;
/// Rounding of an s(n) times the length of its n, as a fraction of the scale \[1\].
pub const ROUNDING: f64 = 1e-14;

/// Directions whose sine is below this are left to the distance search where boxes are apart \[1\].
pub const SKEW: f64 = 0.1;

/// Edges of a box by the bits of their lower corner other than that of their axis, axis by axis, in the order of its
/// sorted edges.
const EDGES: [[u8; 4]; 3] = [[0, 5, 8, 11], [1, 3, 9, 10], [2, 4, 6, 7]];

/// Pairs of edges: for each edge of a, those of b by bits.
#[derive(Default)]
struct Pairs([u16; 12]);

/// s(n) on the nine directions across two edges, each times the sine of the angle between them.
struct Crossings {
    /// The product \[m\].
    scaled: [f64; 9],
    /// The sine \[1\]; 0 where the edges have no direction across.
    sine: [f64; 9],
    /// Rounding of a product \[m\].
    rounding: f64,
}

impl Crossings {
    /// True when some s(n) is certainly beyond `gap` \[m\].
    fn exceed(&self, gap: f64) -> bool {
        (0..9).any(|k| self.sine[k] > 0.0 && self.scaled[k] - self.rounding > gap * self.sine[k])
    }
    /// True when s(n) of a direction may be beyond `gap` \[m\].
    #[inline]
    fn may_exceed(&self, k: usize, gap: f64) -> bool {
        self.sine[k] > 0.0 && self.scaled[k] + self.rounding > gap * self.sine[k]
    }
}

/// Bounds of a box about its frame's origin: along a world axis it reaches sum_i h_i |axis.a_i|.
pub fn bounds_of_box(half: Vec3, pose: &Pose<Spatial>) -> Aabb<Spatial> {
    let m = pose.rotation.matrix();
    let reach =
        Vec3::from_fn(|k| m[k][0].abs() * half[0] + m[k][1].abs() * half[1] + m[k][2].abs() * half[2]);
    Aabb { min: pose.position - reach, max: pose.position + reach }
}

impl Pair<'_> {
    /// The best face normal of either box; a's faces win ties (see `best_face`).
    pub fn best_face_of_boxes(&self, a: &View, b: &View, [g, h]: [Vec3; 2]) -> Separation<Spatial> {
        let (m, t, bias) = (&self.matrix, self.place.position, BIAS * self.scale);
        let mut best = (f64::NEG_INFINITY, 0);
        let mut offer = |gap: f64, face: usize| {
            if gap > best.0 + bias {
                best = (gap, face);
            }
        };
        for k in 0..3 {
            let reach = m[k][0].abs() * h[0] + m[k][1].abs() * h[1] + m[k][2].abs() * h[2];
            offer((t[k] - reach) - g[k], 2 * k);
            offer(-(t[k] + reach) - g[k], 2 * k + 1);
        }
        for k in 0..3 {
            let reach = m[0][k].abs() * g[0] + m[1][k].abs() * g[1] + m[2][k].abs() * g[2];
            let along = m[0][k] * t[0] + m[1][k] * t[1] + m[2][k] * t[2];
            offer(-reach - (h[k] + along), 6 + 2 * k);
            offer(-reach - (h[k] - along), 7 + 2 * k);
        }
        if best.1 < 6 {
            return self.along_face_of_a(&a.faces[best.1]);
        }
        let face = &b.faces[best.1 - 6];
        let normal = self.to_frame_a(face.normal);
        self.along_face_of_b(normal, face.offset + normal.dot(t))
    }

    /// The better of a face's direction and the best pair of crossed edges of two boxes that touch or overlap.
    pub fn best_of_boxes(
        &self,
        views: [&View; 2],
        halves: [Vec3; 2],
        face: Separation<Spatial>,
    ) -> Separation<Spatial> {
        let mut best = face;
        let crossings = self.crossings_of_boxes(halves);
        // edges win clearly or not at all
        let pairs = self.pairs_of_edges(&crossings, halves, face.gap + BIAS * self.scale);
        self.each_pair(views, &pairs, &mut |crossing| {
            best = self.if_better(Some(best), crossing).unwrap_or(best);
        });
        best
    }

    /// What the edges of two boxes settle that are apart, but not over a face: `None` leaves it open.
    pub fn apart_of_boxes(
        &self,
        views: [&View; 2],
        halves: [Vec3; 2],
        face: &Separation<Spatial>,
        reach: f64,
    ) -> Option<Option<Separation<Spatial>>> {
        let mut crossings = self.crossings_of_boxes(halves);
        if crossings.exceed(reach) {
            return Some(None);
        }
        crossings.sine.iter_mut().filter(|sine| **sine < SKEW).for_each(|sine| *sine = 0.0);
        // a face that explains as much is what the distance search would name
        let (clear, rounding) = (face.gap + BIAS * self.scale, separate::ROUNDING * self.scale);
        let mut found = None;
        self.each_pair(views, &self.pairs_of_edges(&crossings, halves, clear), &mut |crossing| {
            if found.is_none() && crossing.distance > clear {
                found = self.apart_at(crossing, rounding);
            }
        });
        found.map(Some)
    }

    /// Calls `visit` with the crossings of pairs of edges, in the order of a's edges and then of b's.
    fn each_pair(&self, [a, b]: [&View; 2], pairs: &Pairs, visit: &mut dyn FnMut(&Crossing)) {
        let centers = [a.center, self.point_in_a(b.center)];
        for (k, &row) in pairs.0.iter().enumerate().filter(|(_, row)| **row != 0) {
            let e = Edge::of(a, k);
            for l in (0..12).filter(|l| row >> l & 1 == 1) {
                let f = self.edge_of_b(b, l, self.ends_of_b(b, l));
                if let Some(crossing) = self.crossing(&e, &f, centers) {
                    visit(&crossing);
                }
            }
        }
    }

    /// The edges that support the directions whose s(n) may be beyond `gap` \[m\], both of a pair that does so equally.
    fn pairs_of_edges(&self, crossings: &Crossings, [g, h]: [Vec3; 2], gap: f64) -> Pairs {
        let (m, t, mut pairs) = (&self.matrix, self.place.position, Pairs::default());
        for direction in (0..9).filter(|&k| crossings.may_exceed(k, gap)) {
            let (i, j, sine) = (direction / 3, direction % 3, crossings.sine[direction]);
            let (u, v) = ((i + 1) % 3, (i + 2) % 3);
            let (k, l) = ((j + 1) % 3, (j + 2) % 3);
            let (x, y) = (-m[v][j], m[u][j]);
            let (p, q) = (m[i][l], -m[i][k]);
            let apart = x * t[u] + y * t[v];
            let same = 2.0 * BIAS * self.scale * sine;
            let reach = crossings.scaled[direction] - apart.abs();
            for sign in [1.0, -1.0] {
                // n points from b to a; the other way round the boxes overlap by more, which may still be the least
                if sign * apart > 0.0 && reach - apart.abs() + crossings.rounding <= gap * sine {
                    continue;
                }
                let of_a = supporting(i, [(u, -sign * x, g[u]), (v, -sign * y, g[v])], same);
                let of_b = supporting(j, [(k, sign * p, h[k]), (l, sign * q, h[l])], same);
                (0..12).filter(|e| of_a >> e & 1 == 1).for_each(|e| pairs.0[e] |= of_b);
            }
        }
        pairs
    }

    /// s(n) on the directions a_i x b_j.
    fn crossings_of_boxes(&self, [g, h]: [Vec3; 2]) -> Crossings {
        let (m, t) = (&self.matrix, self.place.position);
        let (mut scaled, mut sine) = ([0.0; 9], [0.0; 9]);
        for i in 0..3 {
            let (u, v) = ((i + 1) % 3, (i + 2) % 3);
            for j in 0..3 {
                // n = a_i x b_j = (-m_vj, m_uj) on the axes u and v, and |n.b_k| = |a_i.(b_j x b_k)|
                let (k, l) = ((j + 1) % 3, (j + 2) % 3);
                let (x, y) = (-m[v][j], m[u][j]);
                let reach_a = x.abs() * g[u] + y.abs() * g[v];
                let reach_b = m[i][l].abs() * h[k] + m[i][k].abs() * h[l];
                let squared = x * x + y * y;
                scaled[3 * i + j] = (x * t[u] + y * t[v]).abs() - reach_a - reach_b;
                sine[3 * i + j] = if squared > PARALLEL { squared.sqrt() } else { 0.0 };
            }
        }
        Crossings { scaled, sine, rounding: ROUNDING * self.scale }
    }
}

/// The edges of a box along an axis that are farthest out: of the two other axes the number, the direction's component
/// and the half side \[m\]; sides within `same` \[m\] of each other both count.
fn supporting(axis: usize, others: [(usize, f64, f64); 2], same: f64) -> u16 {
    let [low, high] = if others[0].0 < others[1].0 { others } else { [others[1], others[0]] };
    let sides = |(_, along, half): (usize, f64, f64)| {
        let tie = 2.0 * half * along.abs() <= same;
        [along < 0.0 || tie, along >= 0.0 || tie]
    };
    let (first, second) = (sides(low), sides(high));
    let edge = |k: usize| u16::from(first[k & 1] && second[k >> 1]) << EDGES[axis][k];
    (0..4).fold(0, |set, k| set | edge(k))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::polytope::Polytope;

    #[test]
    fn the_numbers_of_a_boxs_edges_are_those_of_its_sorted_list() {
        let cuboid = Polytope::cuboid([1.0, 2.0, 3.0]);
        for (axis, numbers) in EDGES.iter().enumerate() {
            for (k, number) in numbers.iter().enumerate() {
                let (first, second) = if axis == 0 { (1, 2) } else { (0, if axis == 1 { 2 } else { 1 }) };
                let corner = ((k & 1) << first | (k >> 1) << second) as u32;
                assert_eq!(cuboid.edges[usize::from(*number)], [corner, corner | 1 << axis]);
            }
        }
    }
}
