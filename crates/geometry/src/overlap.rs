//! Overlap of two flat-faced cores of space: the largest s(n) lies on a face normal of either or on the normal of
//! two crossed edges (Gottschalk 1996). Faces are tried only where a known corner of the other core does not
//! rule them out; edges only where both reach into the overlap and their arcs of normals cross (Gregorius 2013).
//! Knows no radii.

use crate::crossing::{Crossing, Edge};
use crate::edges::{Reaching, pairs};
use crate::few::Few;
use crate::kernel::{Label, NONE, Separation};
use crate::planes::{Search, Support};
use crate::polytope::{Face, View};
use crate::separate::{Pair, edge};
use carom_math::lanes::{Lanes, dispatch};
use carom_math::{Column, Space, Spatial, Vec3};

/// A direction must beat the best so far by this fraction of the scale \[1\]: a resting face stays a face.
pub const BIAS: f64 = 1e-10;

/// Corners of one core of a pair, asked for and told in the other's frame.
struct Opposite<'s, 'p> {
    pair: &'s Pair<'p>,
    view: &'s View<'p>,
    /// They are a's.
    of_a: bool,
}

impl Support for Opposite<'_, '_> {
    #[inline(always)]
    fn farthest<L: Lanes>(&self, lanes: L, direction: Vec3) -> Vec3 {
        let Opposite { pair, view, of_a } = self;
        let own = if *of_a { pair.to_frame_a(direction) } else { pair.to_frame_b(direction) };
        let point = view.farthest(lanes, own);
        if *of_a { pair.to_frame_b(point - pair.place.position) } else { pair.point_in_a(point) }
    }
}

impl Pair<'_> {
    /// The best face normal or pair of crossed edges of two flat cores that touch or overlap.
    pub fn overlap(&self, a: &View, b: &View) -> Option<Separation<Spatial>> {
        let face =
            self.best_face(a, b, f64::INFINITY, self.between_centers()).or_else(|| self.best_side(a, b));
        self.best_of_crossings(a, b, face)
    }

    /// The better of a face's direction and the best pair of crossed edges.
    pub fn best_of_crossings(
        &self,
        a: &View,
        b: &View,
        face: Option<Separation<Spatial>>,
    ) -> Option<Separation<Spatial>> {
        let mut best = face;
        self.each_crossing(a, b, face.as_ref(), &mut |crossing| {
            best = self.if_better(best, crossing).or(best);
        });
        best
    }

    /// What a pair of edges gives, if that is better than the best so far.
    pub fn if_better(
        &self,
        best: Option<Separation<Spatial>>,
        crossing: &Crossing,
    ) -> Option<Separation<Spatial>> {
        // s(n) is at most the distance of these edges, and equal to it when they are the ones that meet:
        // parallel edges elsewhere have the same direction and points that are not there
        let bias = BIAS * self.scale;
        let beats = |gap: f64| best.is_none_or(|t| gap > t.gap + bias);
        if !beats(crossing.distance) || !crossing.arcs_cross() {
            return None;
        }
        let gap = self.along(crossing.normal).gap;
        let meets = beats(gap) && crossing.distance <= gap + bias;
        meets.then(|| {
            let ([on_a, on_b], _) = crossing.passing();
            Separation { normal: crossing.normal, gap, on_a, on_b, label: crossing.label }
        })
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
    /// and its foot there. The first face beyond `reach` \[m\] ends the search, which begins with the corners that meet
    /// along `toward`: the nearer that is to what will be found, the shorter the search.
    pub fn best_face(&self, a: &View, b: &View, reach: f64, toward: Vec3) -> Option<Separation<Spatial>> {
        let of_a = self.best_face_of_a(a, b, reach, toward);
        if of_a.is_some_and(|s| s.gap > reach) {
            return of_a;
        }
        let floor = of_a.map_or(f64::NEG_INFINITY, |s| s.gap + BIAS * self.scale);
        self.best_face_of_b(a, b, [floor, reach], toward).or(of_a)
    }

    fn best_face_of_a(&self, a: &View, b: &View, reach: f64, toward: Vec3) -> Option<Separation<Spatial>> {
        let bias = BIAS * self.scale;
        let point = self.point_in_a(self.b.support(self.to_frame_b(toward)).0);
        if let Some(planes) = a.planes {
            let support = Opposite { pair: self, view: b, of_a: false };
            let search = Search { planes, point, floor: f64::NEG_INFINITY, bias, reach, support };
            return dispatch(search).map(|best| self.along_face_of_a(&a.faces[best.face]));
        }
        let (mut corner, mut best) = (point, None);
        for f in a.faces {
            if best.is_some_and(|t: Separation<Spatial>| f.normal.dot(corner) - f.offset <= t.gap + bias) {
                continue;
            }
            let found = self.along_face_of_a(f);
            corner = found.on_b;
            if best.is_none_or(|t| found.gap > t.gap + bias) {
                best = Some(found);
            }
            if found.gap > reach {
                return Some(found);
            }
        }
        best
    }

    /// The best face of b, if its s(n) is beyond `floor` \[m\].
    fn best_face_of_b(
        &self,
        a: &View,
        b: &View,
        [floor, reach]: [f64; 2],
        toward: Vec3,
    ) -> Option<Separation<Spatial>> {
        let bias = BIAS * self.scale;
        let mut corner = self.a.support(-toward).0;
        let placed = |f: &Face| {
            let normal = self.to_frame_a(f.normal);
            (normal, f.offset + normal.dot(self.place.position))
        };
        if let Some(planes) = b.planes {
            let point = self.to_frame_b(corner - self.place.position);
            let support = Opposite { pair: self, view: a, of_a: true };
            let best = dispatch(Search { planes, point, floor, bias, reach, support })?;
            let (normal, offset) = placed(&b.faces[best.face]);
            return Some(self.along_face_of_b(normal, offset));
        }
        let (mut floor, mut best) = (floor, None);
        for f in b.faces {
            let (normal, offset) = placed(f);
            if normal.dot(corner) - offset <= floor {
                continue;
            }
            let found = self.along_face_of_b(normal, offset);
            corner = found.on_a;
            if found.gap > floor {
                (floor, best) = (found.gap + bias, Some(found));
            }
            if found.gap > reach {
                return Some(found);
            }
        }
        best
    }

    /// s(n) of a face of a, with the corner of b that meets it and its foot there.
    pub fn along_face_of_a(&self, face: &Face) -> Separation<Spatial> {
        let (local, j) = self.b.support(self.to_frame_b(-face.normal));
        let corner = self.point_in_a(local);
        let gap = face.normal.dot(corner) - face.offset;
        let label = Label { a: [NONE, NONE], b: [j, NONE] };
        Separation { normal: -face.normal, gap, on_a: corner - face.normal * gap, on_b: corner, label }
    }

    /// The same of a face of b, its plane normal.x = offset \[m\] in a's frame.
    pub fn along_face_of_b(&self, normal: Vec3, offset: f64) -> Separation<Spatial> {
        let (corner, i) = self.a.support(-normal);
        let gap = normal.dot(corner) - offset;
        let label = Label { a: [i, NONE], b: [NONE, NONE] };
        Separation { normal, gap, on_a: corner, on_b: corner - normal * gap, label }
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
        let centers = [a.center, self.point_in_a(b.center)];
        let of_a = Reaching::of(a, n, low + depth);
        let of_b = Reaching::of(b, -self.to_frame_b(n), depth - high + n.dot(self.place.position));
        if let (Some(of_a), Some(of_b)) = (&of_a, &of_b) {
            for [k, l] in pairs(of_a, of_b, &self.matrix).iter().map(|p| p.map(usize::from)) {
                let (e, f) = (Edge::of(a, k), self.edge_of_b(b, l, self.ends_of_b(b, l)));
                if let Some(crossing) = self.crossing_of_arcs(&e, &f, centers) {
                    visit(&crossing);
                }
            }
            return;
        }
        // corners once, not for each of their edges; an edge reaches where one of its ends does
        let mut corners = Few::<(Vec3, bool), 32>::default();
        let placed = b.points.iter().map(|p| self.point_in_a(*p));
        corners.extend(placed.map(|p| (p, n.dot(p) >= high - depth)));
        let corners = &corners[..];
        let mut reaching = Few::<Edge, 12>::default();
        for (k, ends) in b.edges.iter().enumerate() {
            let [(one, first), (other, second)] = ends.map(|i| corners[i as usize]);
            if first | second {
                reaching.push(self.edge_of_b(b, k, [one, other]));
            }
        }
        let mut reaches = Few::<bool, 32>::default();
        reaches.extend(a.points.iter().map(|p| n.dot(*p) <= low + depth));
        let (reaching, reaches) = (&reaching[..], &reaches[..]);
        for (k, ends) in a.edges.iter().enumerate() {
            if reaches[ends[0] as usize] | reaches[ends[1] as usize] {
                let e = Edge::of(a, k);
                for f in reaching {
                    if let Some(crossing) = self.crossing(&e, f, centers) {
                        visit(&crossing);
                    }
                }
            }
        }
    }
}
