//! Convex cores of space: points, segments, triangles and polytopes (all of them flat-faced, seen through one
//! `View`), solid cylinders and cones (curved). Axes as stated for shapes: along z, cones with the apex at
//! +height/2. Knows supports and features; no pairs.

use crate::core_planar::PlanarCore;
use crate::kernel::Ring;
use crate::polytope::{
    Face, Polytope, SEGMENT_EDGE, TRIANGLE_EDGES, TRIANGLE_RINGS, TRIANGLE_SPOKES, View, triangle_faces,
};
use carom_math::{Column, Spatial, Turn, Vec3, vec2, vec3};
use std::sync::Arc;

/// Corners of the polygon that stands for a round rim where faces are clipped.
pub const RIM: usize = 16;
/// A face counts as facing a direction when its normal leans this much along it \[1\].
const FACING: f64 = 0.3;
/// An edge counts as facing a direction when it leans at most this much along it \[1\].
const LEVEL: f64 = 0.5;
/// A side line counts as facing a direction when the side's normal leans this much along it \[1\].
const SIDE: f64 = 0.7;

/// A convex core of space.
#[derive(Clone, Debug)]
pub enum SpatialCore {
    /// The core of a sphere.
    Point([Vec3; 1]),
    /// The core of a capsule.
    Segment([Vec3; 2]),
    /// A piece of a mesh.
    Triangle([Vec3; 3], [Face; 2]),
    /// A box or a hull.
    Polytope(Arc<Polytope>),
    /// Cylinder or cone.
    Round(Arc<Round>),
}

/// A solid of revolution about z: cylinder, or cone when `apex`.
#[derive(Clone, Debug)]
pub struct Round {
    /// Half the height \[m\].
    pub half: f64,
    /// Radius of the base \[m\].
    pub radius: f64,
    /// True for a cone.
    pub apex: bool,
    /// Section through the axis, in (distance from the axis, z) with its mirror image.
    pub section: PlanarCore,
    /// Unit vectors to the rim's corners.
    pub rim: [Vec3; RIM],
}

impl SpatialCore {
    /// A solid cylinder | cone about z.
    pub fn round(height: f64, radius: f64, apex: bool) -> Self {
        let (half, r) = (0.5 * height, radius);
        let section = if apex {
            PlanarCore::polygon(vec![vec2(-r, -half), vec2(r, -half), vec2(0.0, half)])
        } else {
            PlanarCore::rectangle([r, half])
        };
        let rim = std::array::from_fn(|k| {
            let [c, s] = Turn::from_angle(std::f64::consts::TAU * k as f64 / RIM as f64).0;
            vec3(c, s, 0.0)
        });
        SpatialCore::Round(Arc::new(Round { half, radius, apex, section, rim }))
    }
    /// A mesh triangle.
    pub fn triangle(corners: [Vec3; 3]) -> Self {
        SpatialCore::Triangle(corners, triangle_faces(&corners))
    }
    /// The flat-faced core, or `None` for a curved one.
    pub fn view(&self) -> Option<View<'_>> {
        let bare = |points, center| View {
            points,
            faces: &[],
            rings: &[],
            edges: &[],
            arcs: &[],
            center,
            half: None,
            columns: None,
            planes: None,
            spans: &[],
            spokes: &[],
        };
        match self {
            SpatialCore::Point(p) => Some(bare(p, p[0])),
            SpatialCore::Segment(p) => Some(View { edges: &SEGMENT_EDGE, ..bare(p, (p[0] + p[1]) * 0.5) }),
            SpatialCore::Triangle(p, faces) => {
                let center = (p[0] + p[1] + p[2]) * (1.0 / 3.0);
                let spokes = &TRIANGLE_SPOKES;
                Some(View {
                    faces,
                    rings: &TRIANGLE_RINGS,
                    edges: &TRIANGLE_EDGES,
                    spokes,
                    ..bare(p, center)
                })
            }
            SpatialCore::Polytope(p) => Some(p.view()),
            SpatialCore::Round(_) => None,
        }
    }
    /// Farthest point along a direction of any length, and its name.
    #[inline]
    pub fn support(&self, direction: Vec3) -> (Vec3, u32) {
        match self {
            SpatialCore::Polytope(p) => p.support(direction),
            SpatialCore::Round(round) => round.support(direction),
            SpatialCore::Triangle(p, _) => {
                let [first, second, third] = p.map(|p| direction.dot(p));
                let (best, along) = if second > first { (1, second) } else { (0, first) };
                let best = if third > along { 2 } else { best };
                (p[best], best as u32)
            }
            flat => flat.view().map_or((Vec3::ZERO, 0), |v| v.support(direction)),
        }
    }
    /// Largest distance from the frame's origin \[m\].
    pub fn size(&self) -> f64 {
        match self {
            SpatialCore::Round(r) => (r.half * r.half + r.radius * r.radius).sqrt(),
            SpatialCore::Polytope(p) => p.size,
            flat => flat.view().map_or(0.0, |v| v.points.iter().fold(0.0, |m: f64, p| m.max(p.norm()))),
        }
    }
    /// A point inside.
    #[inline]
    pub fn center(&self) -> Vec3 {
        match self {
            SpatialCore::Polytope(p) => p.center,
            SpatialCore::Round(_) => Vec3::ZERO,
            flat => flat.view().map_or(Vec3::ZERO, |v| v.center),
        }
    }
    /// The face, edge or corner that faces a unit direction, as a ring of named points, counter-clockwise seen
    /// from outside, and the outward normal of its plane (for faces).
    pub fn feature(&self, direction: Vec3, out: &mut Ring<Spatial>) -> Option<Vec3> {
        match self {
            SpatialCore::Round(round) => round.feature(direction, out),
            flat => flat.view().and_then(|v| flat_feature(&v, direction, out)),
        }
    }
    /// All corners, and of rims the point farthest from `from` with corners of the rim that stand off from it.
    pub fn corners(&self, from: Vec3, out: &mut Ring<Spatial>) {
        match self {
            SpatialCore::Round(round) => round.corners(from, out),
            flat => {
                let points = flat.view().map_or(&[][..], |v| v.points);
                out.extend(points.iter().zip(0..).map(|(p, k)| (*p, k)));
            }
        }
    }
}

fn flat_feature(view: &View, direction: Vec3, out: &mut Ring<Spatial>) -> Option<Vec3> {
    if let Some((face, _)) = view.face_toward(direction).filter(|f| f.1 >= FACING) {
        out.extend(view.ring(face).iter().map(|&i| (view.points[i as usize], i)));
        return Some(view.faces[face].normal);
    }
    let (point, vertex) = view.support(direction);
    let lean = |e: &[u32; 2]| {
        let along = view.points[e[1] as usize] - view.points[e[0] as usize];
        along.dot(direction).abs() / along.norm()
    };
    let level = view
        .edges
        .iter()
        .filter(|e| e.contains(&vertex))
        .map(|e| (lean(e), e))
        .filter(|(lean, _)| *lean <= LEVEL)
        .reduce(|best, e| if e.0 < best.0 { e } else { best });
    match level {
        Some((_, e)) => out.extend(e.iter().map(|&i| (view.points[i as usize], i))),
        None => out.push((point, vertex)),
    }
    None
}

impl Round {
    /// Unit vector away from the axis along a direction; x for directions along the axis.
    pub fn radial(direction: Vec3) -> Vec3 {
        let [x, y, _] = direction.0;
        let length = (x * x + y * y).sqrt();
        if length > 0.0 { vec3(x / length, y / length, 0.0) } else { vec3(1.0, 0.0, 0.0) }
    }
    fn rim_point(&self, radial: Vec3, z: f64) -> Vec3 {
        vec3(self.radius * radial[0], self.radius * radial[1], z)
    }
    fn support(&self, direction: Vec3) -> (Vec3, u32) {
        let [x, y, z] = direction.0;
        let across = (x * x + y * y).sqrt();
        let low = self.rim_point(Self::radial(direction), -self.half);
        if self.apex {
            let top = self.half * z > self.radius * across - self.half * z;
            return if top { (vec3(0.0, 0.0, self.half), 1) } else { (low, 0) };
        }
        if z > 0.0 { (vec3(low[0], low[1], self.half), 1) } else { (low, 0) }
    }
    /// Outward unit normal of the side above a radial direction.
    pub fn side_normal(&self, radial: Vec3) -> Vec3 {
        if !self.apex {
            return radial;
        }
        let (h, r) = (2.0 * self.half, self.radius);
        let length = (h * h + r * r).sqrt();
        radial * (h / length) + vec3(0.0, 0.0, r / length)
    }
    /// The apex, and of each rim the farthest point from a place and the corners of its polygon that are not next to it.
    fn corners(&self, from: Vec3, out: &mut Ring<Spatial>) {
        let away = Self::radial(-from);
        for up in [false, true] {
            if up && self.apex {
                out.push((vec3(0.0, 0.0, self.half), 1));
                continue;
            }
            let z = if up { self.half } else { -self.half };
            out.push((self.rim_point(away, z), u32::from(up)));
            let apart = libm::cos(std::f64::consts::TAU / RIM as f64);
            let others = (0..RIM).filter(|&k| self.rim[k].dot(away) < apart);
            let name = |k: usize| 2 + k as u32 + RIM as u32 * u32::from(up);
            out.extend(others.map(|k| (self.rim_point(self.rim[k], z), name(k))));
        }
    }
    /// The rim (as a polygon with corners fixed in the body), a line of the side, or the apex.
    fn feature(&self, direction: Vec3, out: &mut Ring<Spatial>) -> Option<Vec3> {
        let radial = Self::radial(direction);
        let side = self.side_normal(radial).dot(direction);
        let up = direction[2] > 0.0 && !self.apex;
        let cap = if self.apex { -direction[2] } else { direction[2].abs() };
        if cap >= side && cap >= LEVEL {
            let z = if up { self.half } else { -self.half };
            let name = |k: usize| 2 + k as u32 + RIM as u32 * u32::from(up);
            // counter-clockwise seen from outside: backwards on the lower cap
            let corner = |k: usize| if up { k } else { RIM - 1 - k };
            out.extend((0..RIM).map(corner).map(|k| (self.rim_point(self.rim[k], z), name(k))));
            return Some(vec3(0.0, 0.0, if up { 1.0 } else { -1.0 }));
        }
        let low = (self.rim_point(radial, -self.half), 0);
        let high =
            if self.apex { (vec3(0.0, 0.0, self.half), 1) } else { (self.rim_point(radial, self.half), 1) };
        if side >= SIDE {
            out.extend([low, high]);
        } else {
            out.push(self.support(direction));
        }
        None
    }
}
