//! Overlap of two flat-faced cores of space: the largest s(n) lies on a face normal of either or on the normal of
//! two crossed edges (Gottschalk 1996). Faces are tried only where a known corner of the other core does not
//! rule them out; edges only where both reach into the overlap and their arcs of normals cross (Gregorius 2013).
//! Knows no radii.

use crate::kernel::{Label, NONE, Separation};
use crate::polytope::View;
use crate::separate::{Pair, edge};
use carom_math::{Column, Space, Spatial, Vec3};

/// A direction must beat the best so far by this fraction of the scale \[1\]: a resting face stays a face.
const BIAS: f64 = 1e-10;

/// Products of sines below this are rounding \[1\].
const TOUCHING: f64 = 1e-14;

/// An edge of b that reaches into the overlap, in a's frame.
struct Reaching {
    name: [u32; 2],
    ends: [Vec3; 2],
    /// Normals of its two faces, turned round; `None` where it has no two faces that bound a volume.
    arc: Option<[Vec3; 2]>,
}

/// Two edges that may hold the overlap.
struct Crossing<'a> {
    /// Unit normal from b to a, across both edges.
    normal: Vec3,
    /// Distance of the two lines along the normal \[m\]: no less than s(n).
    distance: f64,
    label: Label,
    of_a: [Vec3; 2],
    arc_a: Option<&'a [Vec3; 2]>,
    of_b: &'a Reaching,
}

impl Pair<'_> {
    /// The best face normal or pair of crossed edges of two flat cores that touch or overlap.
    pub fn overlap(&self, a: &View, b: &View) -> Option<Separation<Spatial>> {
        let face = self.best_face(a, b).or_else(|| self.best_side(a, b));
        self.best_of_crossings(a, b, face)
    }

    /// The better of a face's direction and the best pair of crossed edges.
    pub fn best_of_crossings(
        &self,
        a: &View,
        b: &View,
        face: Option<Separation<Spatial>>,
    ) -> Option<Separation<Spatial>> {
        let (bias, mut best) = (BIAS * self.scale, face);
        self.each_crossing(a, b, face.as_ref(), &mut |crossing| {
            // s(n) is at most the distance of these edges, and equal to it when they are the ones that meet:
            // parallel edges elsewhere have the same direction and points that are not there
            let beats = |gap: f64| best.is_none_or(|t| gap > t.gap + bias);
            if beats(crossing.distance) && crossing.arcs_cross() {
                let gap = self.along(crossing.normal).gap;
                if beats(gap) && crossing.distance <= gap + bias {
                    let (on_a, on_b) = crossing.passing();
                    best =
                        Some(Separation { normal: crossing.normal, gap, on_a, on_b, label: crossing.label });
                }
            }
        });
        best
    }

    /// True when the witness of a face's direction (see `best_face`) has its foot on that face: the face is then
    /// the nearest feature, for whatever lies beyond a plane is no nearer than its corner nearest to it.
    pub fn stands_over_face(&self, a: &View, b: &View, found: &Separation<Spatial>) -> bool {
        let of_a = found.label.a == [NONE, NONE];
        let (view, outward, foot) = if of_a {
            (a, -found.normal, found.on_a)
        } else {
            (b, self.to_frame_b(found.normal), self.to_frame_b(found.on_b - self.place.position))
        };
        let Some((face, _)) = view.face_toward(outward) else { return false };
        let ring = view.ring(face);
        (0..ring.len()).all(|k| {
            let (p, q) = (view.points[ring[k] as usize], view.points[ring[(k + 1) % ring.len()] as usize]);
            (q - p).cross(outward).dot(foot - p) <= 0.0
        })
    }

    /// The best face normal of either core; a's faces win ties. The witnesses are the corner that meets the face
    /// and its foot there.
    pub fn best_face(&self, a: &View, b: &View) -> Option<Separation<Spatial>> {
        let bias = BIAS * self.scale;
        let mut best: Option<Separation<Spatial>> = None;
        let beats = |gap: f64, best: &Option<Separation<Spatial>>| best.is_none_or(|t| gap > t.gap + bias);
        let toward = self.between_centers();
        let mut corner = self.point_in_a(self.b.support(self.to_frame_b(toward)).0);
        for f in a.faces {
            if !beats(f.normal.dot(corner) - f.offset, &best) {
                continue;
            }
            let (local, j) = self.b.support(self.to_frame_b(-f.normal));
            corner = self.point_in_a(local);
            let gap = f.normal.dot(corner) - f.offset;
            if beats(gap, &best) {
                let label = Label { a: [NONE, NONE], b: [j, NONE] };
                best = Some(Separation {
                    normal: -f.normal,
                    gap,
                    on_a: corner - f.normal * gap,
                    on_b: corner,
                    label,
                });
            }
        }
        let mut corner = self.a.support(-toward).0;
        for f in b.faces {
            let normal = self.to_frame_a(f.normal);
            let offset = f.offset + normal.dot(self.place.position);
            if !beats(normal.dot(corner) - offset, &best) {
                continue;
            }
            let (point, i) = self.a.support(-normal);
            corner = point;
            let gap = normal.dot(corner) - offset;
            if beats(gap, &best) {
                let label = Label { a: [i, NONE], b: [NONE, NONE] };
                best = Some(Separation { normal, gap, on_a: corner, on_b: corner - normal * gap, label });
            }
        }
        best
    }

    /// For two segments, or points on them: any direction across stands in for a face.
    fn best_side(&self, a: &View, b: &View) -> Option<Separation<Spatial>> {
        let bias = BIAS * self.scale;
        let of_a = a.edges.iter().map(|e| edge(a, *e));
        let of_b = b.edges.iter().map(|e| self.to_frame_a(edge(b, *e)));
        let mut best: Option<Separation<Spatial>> = None;
        for unit in of_a.chain(of_b).filter_map(Column::normalized) {
            let s = self.along(Spatial::tangent(unit, 0));
            if best.is_none_or(|t| s.gap > t.gap + bias) {
                best = Some(s);
            }
        }
        best
    }

    /// Calls `visit` with every pair of edges that reach into the overlap and look at each other.
    fn each_crossing(
        &self,
        a: &View,
        b: &View,
        face: Option<&Separation<Spatial>>,
        visit: &mut dyn FnMut(&Crossing),
    ) {
        // an edge that supports a better direction passes within |s| of the other core, so it reaches at most
        // 2 |s| beyond the other core's plane along the best face normal
        let depth = face.map_or(f64::INFINITY, |s| 2.0 * s.gap.abs() + 1e-9 * self.scale);
        let n = face.map_or(Vec3::ZERO, |s| s.normal);
        let (low, high) = face.map_or((0.0, 0.0), |s| (n.dot(s.on_a), n.dot(s.on_b)));
        let (center_a, center_b) = (a.center, self.point_in_a(b.center));
        let slack = 1e-12 * self.scale;
        let reaching = self.reaching(b, n, high - depth);
        for (k, e) in a.edges.iter().enumerate() {
            let (p, q) = (a.points[e[0] as usize], a.points[e[1] as usize]);
            if n.dot(p).min(n.dot(q)) > low + depth {
                continue;
            }
            for f in &reaching {
                let ([r, s], u) = (f.ends, q - p);
                if !arcs_straddle(a.arcs.get(k), f.arc.as_ref(), u, s - r) {
                    continue;
                }
                let product = u.cross(s - r);
                if product.norm_squared() <= 1e-18 * u.norm_squared() * (s - r).norm_squared() {
                    continue;
                }
                let Some(unit) = product.normalized() else { continue };
                // a lies above its edge and b below its own, else the edges do not support this direction
                let (above, below) = (unit.dot(center_a - p), unit.dot(center_b - r));
                let sign = if above > slack || below < -slack { 1.0 } else { -1.0 };
                if sign * above < -slack || sign * below > slack {
                    continue;
                }
                let (normal, label) = (unit * sign, Label { a: *e, b: f.name });
                let distance = normal.dot(p - r);
                visit(&Crossing { normal, distance, label, of_a: [p, q], arc_a: a.arcs.get(k), of_b: f });
            }
        }
    }

    /// The edges of b with an end at least `height` along n, in a's frame.
    fn reaching(&self, b: &View, n: Vec3, height: f64) -> Vec<Reaching> {
        let mut found = Vec::new();
        for (k, e) in b.edges.iter().enumerate() {
            let ends = e.map(|i| self.point_in_a(b.points[i as usize]));
            if n.dot(ends[0]).max(n.dot(ends[1])) >= height {
                let arc = b.arcs.get(k).map(|arc| arc.map(|m| -self.to_frame_a(m)));
                found.push(Reaching { name: *e, ends, arc });
            }
        }
        found
    }
}

/// The cheap part of `arcs_cross`: a face normal's side of the other arc's plane is the sign of its product with
/// the other edge.
fn arcs_straddle(arc_a: Option<&[Vec3; 2]>, arc_b: Option<&[Vec3; 2]>, u: Vec3, v: Vec3) -> bool {
    let (Some([a, b]), Some([c, d])) = (arc_a, arc_b) else { return true };
    c.dot(u) * d.dot(u) <= TOUCHING * u.norm_squared() && a.dot(v) * b.dot(v) <= TOUCHING * v.norm_squared()
}

impl Crossing<'_> {
    /// True when the arcs of normals between the faces of the two edges (b's turned round) cross on the sphere:
    /// then and only then the edges span a face of the difference set. Arcs that only touch count as crossing, and
    /// so do edges without arcs.
    fn arcs_cross(&self) -> bool {
        let (Some([a, b]), Some([c, d])) = (self.arc_a, &self.of_b.arc) else { return true };
        let (ba, dc) = (b.cross(*a), d.cross(*c));
        let (cba, dba, adc, bdc) = (c.dot(ba), d.dot(ba), a.dot(dc), b.dot(dc));
        // each arc has its ends on both sides of the other's plane, and both lie on the same side of the sphere
        cba * dba <= TOUCHING && adc * bdc <= TOUCHING && cba * bdc >= -TOUCHING
    }

    /// Points where the edges pass each other, kept on the edges.
    fn passing(&self) -> (Vec3, Vec3) {
        let ([p, q], [r, s]) = (self.of_a, self.of_b.ends);
        let (u, v, w) = (q - p, s - r, r - p);
        let (uu, vv, uv) = (u.norm_squared(), v.norm_squared(), u.dot(v));
        let determinant = uu * vv - uv * uv;
        let x = ((w.dot(u) * vv - w.dot(v) * uv) / determinant).clamp(0.0, 1.0);
        let y = ((w.dot(u) * uv - w.dot(v) * uu) / determinant).clamp(0.0, 1.0);
        (p + u * x, r + v * y)
    }
}
