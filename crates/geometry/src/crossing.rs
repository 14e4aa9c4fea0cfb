//! Two edges of flat-faced cores of space: the direction across both, n ~ u x v, is one of the difference set's faces
//! where the arcs of normals at the two edges cross (Gregorius 2013). Knows no radii and no other edges.

use crate::kernel::{Label, Separation};
use crate::polytope::View;
use crate::separate::Pair;
use carom_math::{Column, Spatial, Vec3};

/// Products of sines below this are rounding \[1\].
const TOUCHING: f64 = 1e-14;

/// An edge in a's frame.
#[derive(Clone, Copy, Default)]
pub struct Edge {
    /// Its corners by number, the smaller first.
    pub name: [u32; 2],
    /// Its corners \[m\].
    pub ends: [Vec3; 2],
    /// From the first to the second \[m\], and the square of its length \[m^2\].
    along: (Vec3, f64),
    /// Normals of its two faces, turned round for an edge of b; `None` where it has no two faces that bound a volume.
    pub arc: Option<[Vec3; 2]>,
}

/// Two edges that may hold the overlap.
pub struct Crossing<'a> {
    /// Unit normal from b to a, across both edges.
    pub normal: Vec3,
    /// Distance of the two lines along the normal \[m\]: no less than s(n).
    pub distance: f64,
    /// Features that meet.
    pub label: Label,
    of_a: &'a Edge,
    of_b: &'a Edge,
}

impl Edge {
    /// An edge of a.
    #[inline]
    pub fn of(a: &View, k: usize) -> Self {
        let name = a.edges[k];
        Edge::new(name, name.map(|i| a.points[i as usize]), a.arcs.get(k).copied())
    }
    #[inline]
    fn new(name: [u32; 2], ends: [Vec3; 2], arc: Option<[Vec3; 2]>) -> Self {
        let along = ends[1] - ends[0];
        Edge { name, ends, along: (along, along.norm_squared()), arc }
    }
}

impl Pair<'_> {
    /// The corners of an edge of b in a's frame.
    #[inline]
    pub fn ends_of_b(&self, b: &View, k: usize) -> [Vec3; 2] {
        b.edges[k].map(|i| self.point_in_a(b.points[i as usize]))
    }
    /// An edge of b with its corners in a's frame.
    #[inline]
    pub fn edge_of_b(&self, b: &View, k: usize, ends: [Vec3; 2]) -> Edge {
        let arc = b.arcs.get(k).map(|arc| arc.map(|m| -self.to_frame_a(m)));
        Edge::new(b.edges[k], ends, arc)
    }

    /// The direction across an edge of each core, where they may support it; `centers` are points inside the cores.
    #[inline(always)]
    pub fn crossing<'c>(&self, of_a: &'c Edge, of_b: &'c Edge, centers: [Vec3; 2]) -> Option<Crossing<'c>> {
        if arcs_straddle(of_a, of_b) { self.crossing_of_arcs(of_a, of_b, centers) } else { None }
    }
    /// The same where their arcs may cross: one pair in ten.
    #[inline(never)]
    pub fn crossing_of_arcs<'c>(
        &self,
        of_a: &'c Edge,
        of_b: &'c Edge,
        centers: [Vec3; 2],
    ) -> Option<Crossing<'c>> {
        let ((u, uu), (v, vv)) = (of_a.along, of_b.along);
        let product = u.cross(v);
        if product.norm_squared() <= 1e-18 * uu * vv {
            return None;
        }
        let unit = product.normalized()?;
        // a lies above its edge and b below its own, else the edges do not support this direction
        let slack = 1e-12 * self.scale;
        let (above, below) = (unit.dot(centers[0] - of_a.ends[0]), unit.dot(centers[1] - of_b.ends[0]));
        let sign = if above > slack || below < -slack { 1.0 } else { -1.0 };
        if sign * above < -slack || sign * below > slack {
            return None;
        }
        let (normal, label) = (unit * sign, Label { a: of_a.name, b: of_b.name });
        Some(Crossing { normal, distance: normal.dot(of_a.ends[0] - of_b.ends[0]), label, of_a, of_b })
    }

    /// What a crossing says of two cores that are apart, where it is the last word: the edges support the direction and
    /// pass each other inside both, so that their points there are the nearest ones.
    pub fn apart_at(&self, crossing: &Crossing, rounding: f64) -> Option<Separation<Spatial>> {
        let ([on_a, on_b], inside) = crossing.passing();
        let gap = self.along(crossing.normal).gap;
        let nearest = inside && crossing.distance <= gap + rounding;
        nearest.then_some(Separation { normal: crossing.normal, gap, on_a, on_b, label: crossing.label })
    }
}

/// The cheap part of `arcs_cross`: a face normal's side of the other arc's plane is the sign of its product with
/// the other edge.
#[inline(always)]
fn arcs_straddle(of_a: &Edge, of_b: &Edge) -> bool {
    let (Some([a, b]), Some([c, d])) = (&of_a.arc, &of_b.arc) else { return true };
    let ((u, uu), (v, vv)) = (of_a.along, of_b.along);
    c.dot(u) * d.dot(u) <= TOUCHING * uu && a.dot(v) * b.dot(v) <= TOUCHING * vv
}

impl Crossing<'_> {
    /// True when the arcs of normals between the faces of the two edges (b's turned round) cross on the sphere:
    /// then and only then the edges span a face of the difference set. Arcs that only touch count as crossing, and
    /// so do edges without arcs.
    pub fn arcs_cross(&self) -> bool {
        let (Some([a, b]), Some([c, d])) = (self.of_a.arc, self.of_b.arc) else { return true };
        let (ba, dc) = (b.cross(a), d.cross(c));
        let (cba, dba, adc, bdc) = (c.dot(ba), d.dot(ba), a.dot(dc), b.dot(dc));
        // each arc has its ends on both sides of the other's plane, and both lie on the same side of the sphere
        cba * dba <= TOUCHING && adc * bdc <= TOUCHING && cba * bdc >= -TOUCHING
    }

    /// Points where the edges pass each other, kept on the edges, and whether they are inside both without that.
    pub fn passing(&self) -> ([Vec3; 2], bool) {
        let (p, r) = (self.of_a.ends[0], self.of_b.ends[0]);
        let ((u, uu), (v, vv), w) = (self.of_a.along, self.of_b.along, r - p);
        let uv = u.dot(v);
        let determinant = uu * vv - uv * uv;
        let x = (w.dot(u) * vv - w.dot(v) * uv) / determinant;
        let y = (w.dot(u) * uv - w.dot(v) * uu) / determinant;
        let inside = (0.0..=1.0).contains(&x) && (0.0..=1.0).contains(&y);
        ([p + u * x.clamp(0.0, 1.0), r + v * y.clamp(0.0, 1.0)], inside)
    }
}
