//! Convex cores of the plane: a point, a segment or a polygon, all seen as a ring of corners whose edge i runs
//! from corner i to the next with the outward normal i. A segment is a ring of two corners, a point has no edge.

use carom_math::{Column, Vec2, vec2};

/// Corners of a row.
const ROW: usize = 4;
/// Corners up to which a ring has rows.
const MOST: usize = 2 * ROW;

/// A convex core of the plane.
#[derive(Clone, Debug)]
#[allow(
    clippy::large_enum_variant,
    reason = "what stands behind a pointer is another line of memory to wait for"
)]
pub enum PlanarCore {
    /// The core of a circle.
    Point([Vec2; 1]),
    /// The core of a capsule, a wall, one piece of a polyline: corners and the normals of its two sides.
    Segment([Vec2; 2], [Vec2; 2]),
    /// Corners, counter-clockwise, and outward unit normals of the edges.
    Polygon(Polygon),
}

/// A convex polygon.
#[derive(Clone, Debug)]
pub struct Polygon {
    /// Corners, counter-clockwise \[m\].
    corners: Vec<Vec2>,
    /// Outward unit normals of the edges.
    normals: Vec<Vec2>,
    /// The same by component, where they are few.
    rows: Option<Rows>,
    /// Half sides \[m\], of a rectangle about the frame's origin along its axes.
    pub half: Option<[f64; 2]>,
}

/// A ring of few corners by component, for work on four at a time; what fills the last row up repeats the first.
#[derive(Clone, Copy, Debug)]
pub struct Rows {
    /// Rows in use.
    pub rows: [Row; MOST / ROW],
    /// Corners.
    pub corners: usize,
    /// Edges; none of a point.
    pub edges: usize,
    /// Largest distance of a corner from the frame's origin \[m\].
    pub size: f64,
}

/// Four corners and the edges that begin there.
#[derive(Clone, Copy, Debug, Default)]
pub struct Row {
    /// Corners \[m\].
    pub corner: [[f64; ROW]; 2],
    /// Outward unit normals.
    pub normal: [[f64; ROW]; 2],
}

impl Rows {
    /// From corners and the normals of the edges that begin there; `None` where they are too many.
    #[inline(always)]
    pub fn of(corners: &[Vec2], normals: &[Vec2]) -> Option<Self> {
        let count = corners.len();
        if count > MOST {
            return None;
        }
        let mut rows = [Row::default(); MOST / ROW];
        for i in 0..MOST {
            let (at, from) = (i % ROW, if i < count { i } else { 0 });
            let row = &mut rows[i / ROW];
            for k in 0..2 {
                row.corner[k][at] = corners[from][k];
                row.normal[k][at] = normals.get(from).map_or(0.0, |m| m[k]);
            }
        }
        let size = corners.iter().fold(0.0, |m: f64, p| m.max(p.norm_squared())).sqrt();
        Some(Rows { rows, corners: count, edges: normals.len(), size })
    }
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
        Self::ring(corners, None)
    }
    fn ring(corners: Vec<Vec2>, half: Option<[f64; 2]>) -> Self {
        let n = corners.len();
        let normals: Vec<Vec2> = (0..n).map(|i| edge_normal(corners[i], corners[(i + 1) % n])).collect();
        let rows = Rows::of(&corners, &normals);
        PlanarCore::Polygon(Polygon { corners, normals, rows, half })
    }
    /// A rectangle about the origin.
    pub fn rectangle(half: [f64; 2]) -> Self {
        let [x, y] = half;
        Self::ring(vec![vec2(-x, -y), vec2(x, -y), vec2(x, y), vec2(-x, y)], Some(half))
    }
    /// The ring of corners.
    pub fn corners(&self) -> &[Vec2] {
        match self {
            PlanarCore::Point(p) => p,
            PlanarCore::Segment(p, _) => p,
            PlanarCore::Polygon(ring) => &ring.corners,
        }
    }
    /// Normals of the edges; none for a point.
    pub fn normals(&self) -> &[Vec2] {
        match self {
            PlanarCore::Point(_) => &[],
            PlanarCore::Segment(_, m) => m,
            PlanarCore::Polygon(ring) => &ring.normals,
        }
    }
    /// The ring by component, of a polygon of few corners.
    #[inline]
    pub fn rows(&self) -> Option<&Rows> {
        if let PlanarCore::Polygon(ring) = self { ring.rows.as_ref() } else { None }
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
