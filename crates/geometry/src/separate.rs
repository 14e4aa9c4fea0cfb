//! The direction of the largest s(n) for two convex cores of space (see `kernel`): the distance search where flat
//! cores are apart, its direction snapped to the face or edge pair it means; `overlap` where they touch or overlap;
//! `curved` for cylinders and cones, but for points, which have a closed form. Knows no radii.

use crate::core_spatial::SpatialCore;
use crate::few::Few;
use crate::geometry::Guess;
use crate::gjk::{Corner, Outcome, nearest};
use crate::kernel::{Kernel, Label, NONE, Separation};
use crate::polytope::View;
use carom_math::{Column, Planar, Pose, Spatial, Vec2, Vec3, vec2, vec3};

/// Two gaps closer than this fraction of the scale are the same to rounding \[1\].
pub const ROUNDING: f64 = 4e-15;
/// Flat cores nearer than this fraction of the scale are treated as touching \[1\].
pub const NEAR: f64 = 1e-9;
/// Two cores with faces, at most so many, are tried by their axes first \[1\]; beyond, the distance search wins.
const FEW_FACES: usize = 256;
/// A found direction may mean a face whose normal leans this much along it \[1\].
const FACES: f64 = 0.99;

/// Two placed cores: everything in a's frame.
pub struct Pair<'a> {
    /// First core.
    pub a: &'a SpatialCore,
    /// Second core.
    pub b: &'a SpatialCore,
    /// Pose of b in a's frame.
    pub place: &'a Pose<Spatial>,
    /// Rotation matrix of the pose, row by row.
    pub(crate) matrix: [[f64; 3]; 3],
    /// Length against which rounding is measured \[m\].
    pub scale: f64,
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
    pub fn to_frame_a(&self, v: Vec3) -> Vec3 {
        turned(&self.matrix, v)
    }
    /// A direction of a's frame in b's.
    #[inline]
    pub fn to_frame_b(&self, v: Vec3) -> Vec3 {
        let m = &self.matrix;
        Vec3::from_fn(|i| m[0][i] * v[0] + m[1][i] * v[1] + m[2][i] * v[2])
    }
    /// A point of b's frame in a's.
    #[inline]
    pub fn point_in_a(&self, p: Vec3) -> Vec3 {
        self.place.position + self.to_frame_a(p)
    }
    /// s(n) with its witnesses.
    pub fn along(&self, normal: Vec3) -> Separation<Spatial> {
        let (on_a, i) = self.a.support(-normal);
        let (local, j) = self.b.support(self.to_frame_b(normal));
        let on_b = self.point_in_a(local);
        Separation { normal, gap: normal.dot(on_a - on_b), on_a, on_b, label: Label::vertices(i, j) }
    }
    /// Corner of the difference set, moved by `shift`, with the smallest d.c.
    pub fn corner(&self, direction: Vec3, shift: Vec3) -> Corner {
        let (a, i) = self.a.support(-direction);
        let (local, j) = self.b.support(self.to_frame_b(direction));
        let b = self.point_in_a(local);
        Corner { c: a - b + shift, a, b, names: [i, j] }
    }
    /// From b's centre to a's; never zero.
    pub fn between_centers(&self) -> Vec3 {
        let d = self.a.center() - self.point_in_a(self.b.center());
        if d.norm() > 0.0 { d } else { vec3(0.0, 0.0, 1.0) }
    }
    /// The direction of the largest s(n), or `None` when that exceeds `reach`, from a guess at it (see `Kernel::separation`): where it shows the cores apart nothing is
    /// searched, by more than rounding, so that a search would have found the same.
    pub fn separation_near(&self, reach: f64, guess: &mut Guess<Spatial>) -> Option<Separation<Spatial>> {
        if let Some(direction) = guess.direction {
            let apart = self.along(direction).gap;
            if apart > reach + NEAR * self.scale {
                guess.apart = apart;
                return None;
            }
        }
        let found = match (self.a, self.b) {
            (SpatialCore::Point(p), SpatialCore::Round(_)) => self.point_and_round(p[0], true),
            (SpatialCore::Round(_), SpatialCore::Point(p)) => self.point_and_round(p[0], false),
            _ => match (self.a.view(), self.b.view()) {
                (Some(a), Some(b)) => self.flat(&a, &b, reach, guess),
                _ => self.curved(reach, guess),
            },
        };
        if let Some(found) = &found {
            *guess = Guess { direction: Some(found.normal), apart: found.gap };
        }
        found.filter(|s| s.gap <= reach)
    }

    fn flat(
        &self,
        a: &View,
        b: &View,
        reach: f64,
        guess: &mut Guess<Spatial>,
    ) -> Option<Separation<Spatial>> {
        let faced = !a.faces.is_empty() && !b.faces.is_empty();
        let mut start = self.between_centers();
        let few = a.faces.len() + b.faces.len() <= FEW_FACES;
        if let Some(known) = if faced && few { self.by_axes(a, b, reach, guess, &mut start) } else { None } {
            return known;
        }
        let support = |d| self.corner(d, Vec3::ZERO);
        match nearest(&support, start, reach, self.scale) {
            Outcome::Beyond(direction, apart) => {
                *guess = Guess { direction: direction.normalized(), apart };
                None
            }
            Outcome::Apart(point, simplex) if point.norm() > NEAR * self.scale => {
                let (on_a, on_b) = simplex.witnesses();
                let label = label_of(simplex.corners());
                let found = apart(point, on_a, on_b, label);
                Some(self.snapped(a, b, found, simplex.corners()))
            }
            outcome => {
                let best = self.overlap(a, b);
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

    /// What the axes of two cores with faces settle without a distance search: beyond reach, a corner standing over a face,
    /// an overlap. `None` leaves it open, and `start` is then the best face's direction where that is known.
    fn by_axes(
        &self,
        a: &View,
        b: &View,
        reach: f64,
        guess: &mut Guess<Spatial>,
        start: &mut Vec3,
    ) -> Option<Option<Separation<Spatial>>> {
        if let (Some(half_a), Some(half_b)) = (a.half, b.half) {
            return self.by_axes_of_boxes(a, b, [half_a, half_b], reach);
        }
        let face = self.best_face(a, b, reach, guess.direction.unwrap_or_else(|| self.between_centers()))?;
        if face.gap > reach {
            *guess = Guess { direction: Some(face.normal), apart: face.gap };
            return Some(None);
        }
        *start = face.normal;
        if face.gap > NEAR * self.scale {
            return self.stands_over_face(a, b, &face).then_some(Some(face));
        }
        let best = self.best_of_crossings(a, b, Some(face))?;
        (best.gap <= NEAR * self.scale).then_some(Some(best))
    }

    /// The same of two boxes, whose axes are known in closed form.
    fn by_axes_of_boxes(
        &self,
        a: &View,
        b: &View,
        halves: [Vec3; 2],
        reach: f64,
    ) -> Option<Option<Separation<Spatial>>> {
        let face = self.best_face_of_boxes(a, b, halves);
        if face.gap > reach {
            return Some(None);
        }
        if face.gap > NEAR * self.scale {
            if self.stands_over_face(a, b, &face) {
                return Some(Some(face));
            }
            return self.apart_of_boxes([a, b], halves, &face, reach);
        }
        let best = self.best_of_boxes([a, b], halves, face);
        (best.gap <= NEAR * self.scale).then_some(Some(best))
    }

    /// The face normal or edge pair that a found direction means, when that explains the distance to rounding.
    fn snapped(
        &self,
        a: &View,
        b: &View,
        found: Separation<Spatial>,
        corners: &[Corner],
    ) -> Separation<Spatial> {
        let n: Vec3 = found.normal;
        let mut meant: [Option<Vec3>; 3] = [None; 3];
        if let Some((f, lean)) = a.face_toward(-n) {
            meant[0] = (lean > FACES).then_some(-a.faces[f].normal);
        }
        if let Some((f, lean)) = b.face_toward(self.to_frame_b(n)) {
            meant[1] = (lean > FACES).then(|| self.to_frame_a(b.faces[f].normal));
        }
        let known = corners.iter().all(|c| !c.names.contains(&NONE));
        if let (true, [i, j], [k, l]) = (known, &distinct(corners, 0)[..], &distinct(corners, 1)[..]) {
            let crossed = edge(a, [*i, *j]).cross(self.to_frame_a(edge(b, [*k, *l]))).normalized();
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

    /// A point and a solid of revolution, in the half-plane that holds both: exact.
    fn point_and_round(&self, point: Vec3, point_is_a: bool) -> Option<Separation<Spatial>> {
        let (SpatialCore::Round(round), local) = (if point_is_a {
            (self.b, self.to_frame_b(point - self.place.position))
        } else {
            (self.a, self.point_in_a(point))
        }) else {
            return None;
        };
        let across = (local[0] * local[0] + local[1] * local[1]).sqrt();
        let radial =
            if across > 0.0 { vec3(local[0] / across, local[1] / across, 0.0) } else { vec3(1.0, 0.0, 0.0) };
        let lift = |v: Vec2| radial * v[0] + vec3(0.0, 0.0, v[1]);
        let dot = Planar::dot(vec2(across, local[2]));
        let flat =
            Planar::separation(&dot, &round.section, &Pose::default(), f64::INFINITY, &mut Guess::default())?;
        let (normal, on_round) = (lift(flat.normal), lift(flat.on_b));
        let name = |feature: [u32; 2]| if feature == [NONE, NONE] { [0, NONE] } else { feature };
        let (of_point, of_round) = (name(flat.label.a), name(flat.label.b));
        Some(if point_is_a {
            let label = Label { a: of_point, b: of_round };
            let on_b = self.point_in_a(on_round);
            Separation { normal: self.to_frame_a(normal), gap: flat.gap, on_a: point, on_b, label }
        } else {
            let label = Label { a: of_round, b: of_point };
            Separation { normal: -normal, gap: flat.gap, on_a: on_round, on_b: local, label }
        })
    }
}

/// A separation of cores that are apart, from the difference set's nearest point.
pub fn apart(point: Vec3, on_a: Vec3, on_b: Vec3, label: Label) -> Separation<Spatial> {
    let gap = point.norm();
    Separation { normal: point * (1.0 / gap), gap, on_a, on_b, label }
}

/// Distinct names on one side of a simplex, ascending.
fn distinct(corners: &[Corner], side: usize) -> Few<u32, 4> {
    let mut names = Few::<u32, 4>::default();
    for name in corners.iter().map(|c| c.names[side]) {
        if !names.contains(&name) {
            names.push(name);
        }
    }
    names.sort_unstable();
    names
}

/// The features that hold a simplex's nearest point.
pub fn label_of(corners: &[Corner]) -> Label {
    let side = |k| match distinct(corners, k)[..] {
        [v] => [v, NONE],
        [u, v] => [u, v],
        _ => [NONE, NONE],
    };
    Label { a: side(0), b: side(1) }
}

/// An edge as a vector.
pub fn edge(view: &View, ends: [u32; 2]) -> Vec3 {
    view.points[ends[1] as usize] - view.points[ends[0] as usize]
}
