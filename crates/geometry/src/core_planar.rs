//! Convex cores of the plane: a point, a segment or a polygon, all seen as a ring of corners whose edge i runs
//! from corner i to the next with the outward normal i. A segment is a ring of two corners, a point has no edge.

use carom_math::{Column, Vec2, vec2};
use std::sync::Arc;

/// A convex core of the plane.
#[derive(Clone, Debug)]
pub enum PlanarCore {
    /// The core of a circle.
    Point([Vec2; 1]),
    /// The core of a capsule, a wall, one piece of a polyline: corners and the normals of its two sides.
    Segment([Vec2; 2], [Vec2; 2]),
    /// Corners, counter-clockwise, and outward unit normals of the edges.
    Polygon(Arc<(Vec<Vec2>, Vec<Vec2>)>),
}

/// Outward unit normal of the edge a -> b of a counter-clockwise ring.
pub fn edge_normal(a: Vec2, b: Vec2) -> Vec2 {
    let edge = b - a;
    let right = vec2(edge[1], -edge[0]);
    right.normalized().unwrap_or(vec2(1.0, 0.0))
}

impl PlanarCore {
    /// A wall between two points.
    pub fn segment(a: Vec2, b: Vec2) -> Self {
        let normal = edge_normal(a, b);
        PlanarCore::Segment([a, b], [normal, -normal])
    }
    /// A polygon with the given corners, counter-clockwise and convex.
    pub fn polygon(corners: Vec<Vec2>) -> Self {
        let n = corners.len();
        let normals = (0..n).map(|i| edge_normal(corners[i], corners[(i + 1) % n])).collect();
        PlanarCore::Polygon(Arc::new((corners, normals)))
    }
    /// A rectangle about the origin.
    pub fn rectangle(half: [f64; 2]) -> Self {
        let [x, y] = half;
        Self::polygon(vec![vec2(-x, -y), vec2(x, -y), vec2(x, y), vec2(-x, y)])
    }
    /// The ring of corners.
    pub fn corners(&self) -> &[Vec2] {
        match self {
            PlanarCore::Point(p) => p,
            PlanarCore::Segment(p, _) => p,
            PlanarCore::Polygon(ring) => &ring.0,
        }
    }
    /// Normals of the edges; none for a point.
    pub fn normals(&self) -> &[Vec2] {
        match self {
            PlanarCore::Point(_) => &[],
            PlanarCore::Segment(_, m) => m,
            PlanarCore::Polygon(ring) => &ring.1,
        }
    }
    /// Edge whose outward normal leans most along a direction, as the indices of its corners.
    pub fn edge_toward(&self, direction: Vec2) -> Option<(usize, usize)> {
        let normals = self.normals();
        let edge = (0..normals.len()).reduce(|best, i| {
            if normals[i].dot(direction) > normals[best].dot(direction) { i } else { best }
        })?;
        Some((edge, (edge + 1) % normals.len()))
    }
}
