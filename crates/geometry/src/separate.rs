//! The direction of the largest s(n) for two convex cores of space (see `kernel`). Flat cores: the face normals
//! and crossed edges of both (Gottschalk 1996; an edge pair matters only where both edges reach into the overlap)
//! when they touch or overlap, the distance search otherwise, its direction snapped to the face or edge pair it
//! means. Curved cores: axes and face normals as candidates, refined by the distance search after moving the
//! cores apart along the best direction, which leaves the best direction what it is.
//! Knows no radii; where the curved answer is a local best, a deeper overlap may have a better one elsewhere.

use crate::core_spatial::{Round, SpatialCore};
use crate::gjk::{Corner, Outcome, nearest};
use crate::kernel::{Kernel, Label, NONE, Separation};
use crate::polytope::View;
use carom_math::{Column, Pose, Space, Spatial, Vec3, vec3};

/// Two gaps closer than this fraction of the scale are the same to rounding \[1\].
const ROUNDING: f64 = 4e-15;
/// Flat cores nearer than this fraction of the scale are treated as touching \[1\].
const NEAR: f64 = 1e-9;
/// Distance at which curved cores are compared: below this fraction of the scale they are moved apart \[1\].
const CLEAR: f64 = 1e-5;
/// A found direction may mean a face whose normal leans this much along it \[1\].
const FACES: f64 = 0.99;
/// Overlaps of curved cores beyond this fraction of the scale are looked at from several sides \[1\].
const DEEP: f64 = 1e-3;
/// Most refinements of a direction between curved cores; shallow overlaps need two or three.
const REFINEMENTS: usize = 24;
/// A refinement that gains less than this fraction of the scale ends the search \[1\].
const SETTLED: f64 = 1e-13;
/// Crossed edges must beat a face by this fraction of the scale \[1\]: a resting face stays a face.
const EDGE_BIAS: f64 = 1e-10;

/// Two placed cores: everything in a's frame.
pub struct Pair<'a> {
    /// First core.
    pub a: &'a SpatialCore,
    /// Second core.
    pub b: &'a SpatialCore,
    /// Pose of b in a's frame.
    pub place: &'a Pose<Spatial>,
    /// Rotation matrix of the pose, row by row.
    matrix: [[f64; 3]; 3],
    /// Length against which rounding is measured \[m\].
    pub scale: f64,
}

/// Whose face a direction is the normal of.
#[derive(Clone, Copy, Debug)]
enum Face {
    OfA,
    OfB,
    None,
}

/// A row-by-row matrix times a vector.
#[inline]
fn turned(m: &[[f64; 3]; 3], v: Vec3) -> Vec3 {
    Vec3::from_fn(|i| m[i][0] * v[0] + m[i][1] * v[1] + m[i][2] * v[2])
}

impl<'a> Pair<'a> {
    /// A pair from its cores and their relative pose.
    pub fn new(a: &'a SpatialCore, b: &'a SpatialCore, place: &'a Pose<Spatial>) -> Self {
        let matrix = place.rotation.matrix();
        Pair { a, b, place, matrix, scale: a.size() + b.size() + place.position.norm() }
    }
    /// A direction of b's frame in a's.
    #[inline]
    pub fn out_of_b(&self, v: Vec3) -> Vec3 {
        turned(&self.matrix, v)
    }
    /// A direction of a's frame in b's.
    #[inline]
    pub fn into_b(&self, v: Vec3) -> Vec3 {
        let m = &self.matrix;
        Vec3::from_fn(|i| m[0][i] * v[0] + m[1][i] * v[1] + m[2][i] * v[2])
    }
    /// A point of b's frame in a's.
    #[inline]
    pub fn point_of_b(&self, p: Vec3) -> Vec3 {
        self.place.position + self.out_of_b(p)
    }
    /// s(n) with its witnesses.
    pub fn along(&self, normal: Vec3) -> Separation<Spatial> {
        let (on_a, i) = self.a.support(-normal);
        let (local, j) = self.b.support(self.into_b(normal));
        let on_b = self.point_of_b(local);
        Separation { normal, gap: normal.dot(on_a - on_b), on_a, on_b, label: Label::vertices(i, j) }
    }
    fn corner(&self, direction: Vec3, shift: Vec3) -> Corner {
        let (a, i) = self.a.support(-direction);
        let (local, j) = self.b.support(self.into_b(direction));
        let b = self.point_of_b(local);
        Corner { c: a - b + shift, a, b, names: [i, j] }
    }
    /// From b's centre to a's; never zero.
    fn between_centers(&self) -> Vec3 {
        let d = self.a.center() - self.point_of_b(self.b.center());
        if d.norm() > 0.0 { d } else { vec3(0.0, 0.0, 1.0) }
    }
    /// The direction of the largest s(n), or `None` when that exceeds `reach`.
    pub fn separation(&self, reach: f64) -> Option<Separation<Spatial>> {
        match (self.a, self.b) {
            (SpatialCore::Point(p), SpatialCore::Round(_)) => self.point_and_round(p[0], true),
            (SpatialCore::Round(_), SpatialCore::Point(p)) => self.point_and_round(p[0], false),
            _ => match (self.a.view(), self.b.view()) {
                (Some(a), Some(b)) => self.flat(&a, &b, reach),
                _ => self.curved(reach),
            },
        }
        .filter(|s| s.gap <= reach)
    }

    fn flat(&self, a: &View, b: &View, reach: f64) -> Option<Separation<Spatial>> {
        let support = |d| self.corner(d, Vec3::ZERO);
        match nearest(&support, self.between_centers(), reach, self.scale) {
            Outcome::Beyond => None,
            Outcome::Apart(point, simplex) if point.norm() > NEAR * self.scale => {
                let (on_a, on_b) = simplex.witnesses();
                let label = label_of(simplex.corners());
                let found = apart(point, on_a, on_b, label);
                Some(self.snapped(a, b, found, simplex.corners()))
            }
            outcome => {
                let best = self.touching(a, b);
                match outcome {
                    // corners of two cores hardly apart: no axis sees the gap
                    Outcome::Apart(point, simplex) if best.is_none_or(|s| s.gap < point.norm() * 0.5) => {
                        let (on_a, on_b) = simplex.witnesses();
                        Some(apart(point, on_a, on_b, label_of(simplex.corners())))
                    }
                    _ => best.or_else(|| Some(self.along(vec3(0.0, 0.0, 1.0)))),
                }
            }
        }
    }

    /// The face normal or edge pair that a found direction means, when that explains the distance to rounding.
    fn snapped(&self, a: &View, b: &View, found: Separation<Spatial>, corners: &[Corner]) -> Separation<Spatial> {
        let n: Vec3 = found.normal;
        let mut meant: [Option<Vec3>; 3] = [None; 3];
        if let Some((f, lean)) = a.face_toward(-n) {
            meant[0] = (lean > FACES).then_some(-a.faces[f].normal);
        }
        if let Some((f, lean)) = b.face_toward(self.into_b(n)) {
            meant[1] = (lean > FACES).then(|| self.out_of_b(b.faces[f].normal));
        }
        let known = corners.iter().all(|c| !c.names.contains(&NONE));
        if let (true, [i, j], [k, l]) = (known, &distinct(corners, 0)[..], &distinct(corners, 1)[..]) {
            let crossed = edge(a, [*i, *j]).cross(self.out_of_b(edge(b, [*k, *l]))).normalized();
            meant[2] = crossed.map(|c| if c.dot(n) < 0.0 { -c } else { c });
        }
        for normal in meant.into_iter().flatten() {
            let gap = self.along(normal).gap;
            if gap >= found.gap - ROUNDING * self.scale {
                return Separation { normal, gap, ..found };
            }
        }
        found
    }

    /// The best face normal or pair of crossed edges of two flat cores that touch or overlap.
    fn touching(&self, a: &View, b: &View) -> Option<Separation<Spatial>> {
        let mut best: Option<Separation<Spatial>> = None;
        let mut try_normal = |normal: Vec3, face: Face| {
            let mut s = self.along(normal);
            // the corner that meets the face and its foot there: the face's own farthest corner may be far away
            match face {
                Face::OfA => s.on_a = s.on_b + normal * s.gap,
                Face::OfB => s.on_b = s.on_a - normal * s.gap,
                Face::None => {}
            }
            if best.is_none_or(|t| s.gap > t.gap + EDGE_BIAS * self.scale) {
                best = Some(s);
            }
        };
        a.faces.iter().for_each(|f| try_normal(-f.normal, Face::OfA));
        b.faces.iter().for_each(|f| try_normal(self.out_of_b(f.normal), Face::OfB));
        if a.faces.is_empty() && b.faces.is_empty() {
            // two segments, or points on them: any direction across stands in for a face
            for e in a.edges.iter().map(|e| edge(a, *e)).chain(b.edges.iter().map(|e| self.out_of_b(edge(b, *e)))) {
                if let Some(unit) = e.normalized() {
                    try_normal(Spatial::tangent(unit, 0), Face::None);
                }
            }
        }
        let face = best;
        let mut crossed = best;
        self.each_crossing(a, b, face.as_ref(), &mut |normal, label, on_a, on_b| {
            // s(n) is at most the distance of these edges, and equal to it when they are the ones that meet:
            // parallel edges elsewhere have the same direction and points that are not there
            let distance = normal.dot(on_a - on_b);
            let beats = |gap: f64| crossed.is_none_or(|t| gap > t.gap + EDGE_BIAS * self.scale);
            if beats(distance) {
                let gap = self.along(normal).gap;
                if beats(gap) && distance <= gap + EDGE_BIAS * self.scale {
                    crossed = Some(Separation { normal, gap, on_a, on_b, label });
                }
            }
        });
        crossed
    }

    /// Calls `visit` with the normal of every pair of edges that can support the overlap, the pair's label and
    /// the points where the edges pass each other.
    fn each_crossing(
        &self,
        a: &View,
        b: &View,
        face: Option<&Separation<Spatial>>,
        visit: &mut dyn FnMut(Vec3, Label, Vec3, Vec3),
    ) {
        // an edge that supports a better direction passes within |s| of the other core, so it reaches at most
        // 2 |s| beyond the other core's plane along the best face normal
        let depth = face.map_or(f64::INFINITY, |s| 2.0 * s.gap.abs() + 1e-9 * self.scale);
        let n = face.map_or(Vec3::ZERO, |s| s.normal);
        let (low, high) = face.map_or((0.0, 0.0), |s| (n.dot(s.on_a), n.dot(s.on_b)));
        let (center_a, center_b) = (a.center, self.point_of_b(b.center));
        let ends_b: Vec<([u32; 2], Vec3, Vec3)> = b
            .edges
            .iter()
            .map(|e| (*e, self.point_of_b(b.points[e[0] as usize]), self.point_of_b(b.points[e[1] as usize])))
            .filter(|(_, p, q)| n.dot(*p).max(n.dot(*q)) >= high - depth)
            .collect();
        for e in a.edges {
            let (p, q) = (a.points[e[0] as usize], a.points[e[1] as usize]);
            if n.dot(p).min(n.dot(q)) > low + depth {
                continue;
            }
            for (f, r, s) in &ends_b {
                let (u, v) = (q - p, *s - *r);
                let product = u.cross(v);
                if product.norm() <= 1e-9 * u.norm() * v.norm() {
                    continue;
                }
                let Some(unit) = product.normalized() else { continue };
                // a lies above its edge and b below its own, else the edges do not support this direction
                let (above, below) = (unit.dot(center_a - p), unit.dot(center_b - *r));
                let slack = 1e-12 * self.scale;
                let sign = if above > slack || below < -slack { 1.0 } else { -1.0 };
                if sign * above < -slack || sign * below > slack {
                    continue;
                }
                let (on_a, on_b) = passing(p, u, *r, v);
                visit(unit * sign, Label { a: *e, b: *f }, on_a, on_b);
            }
        }
    }

    /// A point and a solid of revolution, in the half-plane that holds both: exact.
    fn point_and_round(&self, point: Vec3, point_is_a: bool) -> Option<Separation<Spatial>> {
        let (SpatialCore::Round(round), local) = (if point_is_a {
            (self.b, self.into_b(point - self.place.position))
        } else {
            (self.a, self.point_of_b(point))
        }) else {
            return None;
        };
        let across = (local[0] * local[0] + local[1] * local[1]).sqrt();
        let radial = if across > 0.0 { vec3(local[0] / across, local[1] / across, 0.0) } else { vec3(1.0, 0.0, 0.0) };
        let lift = |v: carom_math::Vec2| radial * v[0] + vec3(0.0, 0.0, v[1]);
        let dot = carom_math::Planar::dot(carom_math::vec2(across, local[2]));
        let flat = carom_math::Planar::separation(&dot, &round.section, &Pose::default(), f64::INFINITY)?;
        let (normal, on_round) = (lift(flat.normal), lift(flat.on_b));
        let name = |feature: [u32; 2]| if feature == [NONE, NONE] { [0, NONE] } else { feature };
        let (of_point, of_round) = (name(flat.label.a), name(flat.label.b));
        Some(if point_is_a {
            let label = Label { a: of_point, b: of_round };
            let on_b = self.point_of_b(on_round);
            Separation { normal: self.out_of_b(normal), gap: flat.gap, on_a: point, on_b, label }
        } else {
            let label = Label { a: of_round, b: of_point };
            Separation { normal: -normal, gap: flat.gap, on_a: on_round, on_b: local, label }
        })
    }

    fn curved(&self, reach: f64) -> Option<Separation<Spatial>> {
        let support = |d| self.corner(d, Vec3::ZERO);
        let outcome = nearest(&support, self.between_centers(), reach, self.scale);
        if matches!(outcome, Outcome::Beyond) {
            return None;
        }
        let best = self.best_candidate();
        if let Outcome::Apart(point, simplex) = outcome {
            let distance = point.norm();
            if distance > CLEAR * self.scale {
                let (on_a, on_b) = simplex.witnesses();
                // curved cores stop the search a little short: s(n) is what its direction is worth
                let gap = self.along(point * (1.0 / distance)).gap;
                if gap <= best.gap + 4.0 * ROUNDING * self.scale {
                    return Some(Separation { on_a, on_b, ..best });
                }
                return Some(Separation { gap, ..apart(point, on_a, on_b, label_of(simplex.corners())) });
            }
        }
        let mut found = self.refined(best);
        if found.gap < -DEEP * self.scale {
            // deep curved overlaps have several local bests: look from the centres and from the sides too
            let (n, t, u) = (best.normal, Spatial::tangent(best.normal, 0), Spatial::tangent(best.normal, 1));
            for start in [self.between_centers(), n + t, n - t, n + u, n - u] {
                let other = start.normalized().map_or(found, |unit| self.refined(self.along(unit)));
                if other.gap > found.gap + SETTLED * self.scale {
                    found = other;
                }
            }
        }
        Some(found)
    }

    /// The local best of s(n) near a direction.
    fn refined(&self, start: Separation<Spatial>) -> Separation<Spatial> {
        let mut best = start;
        for _ in 0..REFINEMENTS {
            let refined = self.moved_apart(&best);
            if refined.gap <= best.gap + SETTLED * self.scale {
                (best.on_a, best.on_b) = (refined.on_a, refined.on_b);
                break;
            }
            best = self.further(&best, refined);
        }
        best
    }

    /// Goes on from a better direction the way it came, in doubling steps, while s(n) grows: deep inside, moving
    /// apart gains only a part of the way each time.
    fn further(&self, from: &Separation<Spatial>, to: Separation<Spatial>) -> Separation<Spatial> {
        let way = to.normal - from.normal;
        let (mut best, mut stride) = (to, 1.0);
        while let Some(unit) = (to.normal + way * stride).normalized() {
            let s = self.along(unit);
            if s.gap <= best.gap {
                break;
            }
            best = Separation { normal: unit, gap: s.gap, ..to };
            stride *= 2.0;
        }
        best
    }

    /// The distance direction of the cores after moving them apart along a direction, judged where they are.
    fn moved_apart(&self, from: &Separation<Spatial>) -> Separation<Spatial> {
        let clear = from.gap.abs().max(CLEAR * self.scale);
        let shift = from.normal * (clear - from.gap);
        let support = |d| self.corner(d, shift);
        match nearest(&support, from.normal, f64::INFINITY, self.scale) {
            Outcome::Apart(point, simplex) => {
                let (on_a, on_b) = simplex.witnesses();
                let unit = point * (1.0 / point.norm());
                let s = self.along(unit);
                Separation { on_a, on_b, ..s }
            }
            _ => *from,
        }
    }

    /// The best of the directions that flat and straight parts of the two cores suggest.
    fn best_candidate(&self) -> Separation<Spatial> {
        let centers = self.between_centers();
        let mut best = self.along(centers.normalized().unwrap_or(vec3(0.0, 0.0, 1.0)));
        // cores that are their own mirror images about their centres overlap least on the side they are on
        let symmetric = is_symmetric(self.a) && is_symmetric(self.b);
        let mut consider = |direction: Vec3| {
            let Some(unit) = direction.normalized() else { return };
            let unit = if unit.dot(centers) < 0.0 { -unit } else { unit };
            for normal in [unit, -unit].into_iter().take(if symmetric { 1 } else { 2 }) {
                let s = self.along(normal);
                if s.gap > best.gap + ROUNDING * self.scale {
                    best = s;
                }
            }
        };
        let up = vec3(0.0, 0.0, 1.0);
        let across = |d: Vec3, axis: Vec3| d - axis * d.dot(axis);
        match (self.a, self.b) {
            (SpatialCore::Round(_), SpatialCore::Round(_)) => {
                let axis_b = self.out_of_b(up);
                consider(up);
                consider(axis_b);
                consider(up.cross(axis_b));
                consider(across(centers, up));
                consider(across(centers, axis_b));
            }
            (SpatialCore::Round(round), flat) | (flat, SpatialCore::Round(round)) => {
                let round_is_a = matches!(self.a, SpatialCore::Round(_));
                let out = |d: Vec3| if round_is_a { d } else { self.out_of_b(d) };
                let into = |d: Vec3| if round_is_a { self.out_of_b(d) } else { self.into_b(d) };
                let place = |p: Vec3| {
                    if round_is_a { self.point_of_b(p) } else { self.into_b(p - self.place.position) }
                };
                consider(out(up));
                let Some(view) = flat.view() else { return best };
                // everything below is asked for in the round core's frame
                view.faces.iter().for_each(|f| consider(out(into(f.normal))));
                view.directions().for_each(|e| consider(out(into(e).cross(up))));
                view.points.iter().for_each(|p| consider(out(round.side_normal(Round::radial(place(*p))))));
            }
            _ => {}
        }
        best
    }
}

fn is_symmetric(core: &SpatialCore) -> bool {
    match core {
        SpatialCore::Round(round) => !round.apex,
        SpatialCore::Polytope(p) => p.half.is_some(),
        SpatialCore::Point(_) | SpatialCore::Segment(_) => true,
        SpatialCore::Triangle(..) => false,
    }
}

/// A separation of cores that are apart, from the difference set's nearest point.
fn apart(point: Vec3, on_a: Vec3, on_b: Vec3, label: Label) -> Separation<Spatial> {
    let gap = point.norm();
    Separation { normal: point * (1.0 / gap), gap, on_a, on_b, label }
}

/// Distinct names on one side of a simplex, ascending.
fn distinct(corners: &[Corner], side: usize) -> Vec<u32> {
    let mut names: Vec<u32> = corners.iter().map(|c| c.names[side]).collect();
    names.sort_unstable();
    names.dedup();
    names
}

fn label_of(corners: &[Corner]) -> Label {
    let side = |k| match distinct(corners, k)[..] {
        [v] => [v, NONE],
        [u, v] => [u, v],
        _ => [NONE, NONE],
    };
    Label { a: side(0), b: side(1) }
}

fn edge(view: &View, ends: [u32; 2]) -> Vec3 {
    view.points[ends[1] as usize] - view.points[ends[0] as usize]
}

/// Points where the lines p + x u and r + y v pass each other, kept on the segments.
fn passing(p: Vec3, u: Vec3, r: Vec3, v: Vec3) -> (Vec3, Vec3) {
    let (uu, vv, uv, w) = (u.norm_squared(), v.norm_squared(), u.dot(v), r - p);
    let determinant = uu * vv - uv * uv;
    let x = ((w.dot(u) * vv - w.dot(v) * uv) / determinant).clamp(0.0, 1.0);
    let y = ((w.dot(u) * uv - w.dot(v) * uu) / determinant).clamp(0.0, 1.0);
    (p + u * x, r + v * y)
}
