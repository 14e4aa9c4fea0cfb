//! Moments of convex cores swept by a ball of radius r, piece by piece and exact to rounding (theory
//! chapter 1). A polyhedron becomes itself + a prism on every face + a wedge on every edge + a ball sector at
//! every vertex. The sector over the spherical polygon of the face normals n at a vertex has
//!   solid angle  W = 2 pi - (sum of the face angles at the vertex),
//!   int n        = -1/2 sum over edges of theta e,
//!   int n n^T    = (W 1 - sum over edges of e N^T) / 3,   N = int n along the arc = tan(theta/2) (n_l + n_r),
//! with e the unit edge away from the vertex and theta the angle between its two faces' normals: the divergence
//! theorem on the sphere for constant fields a, and for (a - (a.n) n)(n.b). A box splits into orthants.
//! Knows no density.

use crate::geometry::ShapeError;
use crate::mass_moments::{Moments, combined, outer};
use crate::mass_polygon::{fan, mean};
use crate::mass_polyhedron::{SharedEdge, area_vector, shared_edges, signed_tetrahedra};
use carom_math::{Column, Tuple, Vec3};
use std::f64::consts::PI;

/// Box of these half sides, about the origin, swept by a disc or ball; sides or radius may be zero. Every
/// coordinate either stays in the core or lies in the k-dimensional ball beyond it: 2^N kinds of region.
pub(crate) fn rounded_box_moments<const N: usize>(half: [f64; N], r: f64) -> Moments<N> {
    // orthant of the k-ball: int 1, int x, int x^2
    let (r2, r3, r4, r5) = (r * r, r * r * r, r * r * r * r, r * r * r * r * r);
    let ball = [
        [1.0, 0.0, 0.0],
        [r, r2 / 2.0, r3 / 3.0],
        [PI * r2 / 4.0, r3 / 3.0, PI * r4 / 16.0],
        [PI * r3 / 6.0, PI * r4 / 16.0, PI * r5 / 30.0],
    ];
    let mut total = Moments::zero(Tuple::ZERO);
    let orthants = f64::from(1u32 << N);
    for beyond in 0..1usize << N {
        let [volume, first, second] = ball[beyond.count_ones() as usize];
        let core: f64 = (0..N).filter(|i| beyond >> i & 1 == 0).map(|i| half[i]).product();
        total.measure += orthants * core * volume;
        for (i, &a) in half.iter().enumerate() {
            let square = if beyond >> i & 1 == 0 {
                a * a / 3.0 * volume
            } else {
                a * a * volume + 2.0 * a * first + second
            };
            total.second[i][i] += orthants * core * square;
        }
    }
    total
}

/// Faces, edges and corner sectors of a convex polyhedron: what a sweep by a ball needs to know.
pub(crate) struct ConvexSurface {
    /// Corners \[m\].
    pub vertices: Vec<Vec3>,
    /// Triangles, counter-clockwise seen from outside.
    pub triangles: Vec<[u32; 3]>,
    /// Outward unit normal of every triangle.
    pub normals: Vec<Vec3>,
    /// Every edge once.
    pub edges: Vec<SharedEdge>,
    /// Of every vertex: the moments of the unit sphere's polygon of normals: W, int n, int n n^T.
    pub corners: Vec<Moments<3>>,
}

/// The angle between the two faces of an edge, as seen along it.
pub(crate) struct Hinge {
    /// Unit vector from a to b.
    pub along: Vec3,
    /// Length \[m\].
    pub length: f64,
    /// Sine and cosine of the angle from the left normal to the right one, positive when convex.
    pub sine: f64,
    pub cosine: f64,
}

impl ConvexSurface {
    /// From a hull's corners and outward triangles.
    ///
    /// # Errors
    /// [`ShapeError`] when the surface is not closed or a triangle has no area.
    pub(crate) fn new(vertices: Vec<Vec3>, triangles: Vec<[u32; 3]>) -> Result<Self, ShapeError> {
        let edges = shared_edges(&vertices, &triangles)?;
        let normals = triangles
            .iter()
            .map(|t| area_vector(&vertices, t).normalized().ok_or_else(|| flat_face(&vertices, t)))
            .collect::<Result<Vec<_>, _>>()?;
        let mut surface = ConvexSurface { vertices, triangles, normals, edges, corners: Vec::new() };
        surface.corners = surface.corner_sectors();
        Ok(surface)
    }

    /// The hinge of an edge.
    pub(crate) fn hinge(&self, edge: &SharedEdge) -> Hinge {
        let span = self.vertices[edge.b as usize] - self.vertices[edge.a as usize];
        let length = span.norm();
        let along = span * (1.0 / length);
        let (left, right) = (self.normals[edge.left], self.normals[edge.right]);
        Hinge { along, length, sine: left.cross(right).dot(along), cosine: left.dot(right) }
    }

    /// Solid angles and moments of the normals at every vertex, by the formulas above.
    fn corner_sectors(&self) -> Vec<Moments<3>> {
        let full = Moments { measure: 2.0 * PI, ..Moments::zero(Vec3::ZERO) };
        let mut corners = vec![full; self.vertices.len()];
        for triangle in &self.triangles {
            for k in 0..3 {
                let [apex, p, q] = [k, k + 1, k + 2].map(|i| triangle[i % 3] as usize);
                let (p, q) = (self.vertices[p] - self.vertices[apex], self.vertices[q] - self.vertices[apex]);
                corners[apex].measure -= libm::atan2(p.cross(q).norm(), p.dot(q));
            }
        }
        for edge in &self.edges {
            let hinge = self.hinge(edge);
            let angle = libm::atan2(hinge.sine, hinge.cosine);
            let half_tangent = hinge.sine / (1.0 + hinge.cosine);
            let arc = (self.normals[edge.left] + self.normals[edge.right]) * half_tangent;
            for (vertex, away) in [(edge.a, hinge.along), (edge.b, -hinge.along)] {
                let corner = &mut corners[vertex as usize];
                corner.first -= away * (0.5 * angle);
                let (one, other) = (outer(away, arc), outer(arc, away));
                corner.second = combined(&[(1.0, corner.second), (-1.0 / 6.0, one), (-1.0 / 6.0, other)]);
            }
        }
        for corner in &mut corners {
            for i in 0..3 {
                corner.second[i][i] += corner.measure / 3.0;
            }
        }
        corners
    }

    /// Moments of the polyhedron swept by a ball, about a point near its centroid.
    pub(crate) fn swept_moments(&self, radius: f64) -> Moments<3> {
        let rough = self.swept_about(radius, mean(&self.vertices));
        self.swept_about(radius, rough.center())
    }

    fn swept_about(&self, radius: f64, origin: Vec3) -> Moments<3> {
        let mut total = signed_tetrahedra(&self.vertices, &self.triangles, origin);
        for (triangle, &normal) in self.triangles.iter().zip(&self.normals) {
            let corners = triangle.map(|i| self.vertices[i as usize]);
            let face = Moments::simplex(origin, area_vector(&self.vertices, triangle).norm(), &corners);
            let band = Moments::simplex(Vec3::ZERO, radius, &[Vec3::ZERO, normal * radius]);
            total.add_scaled(1.0, &face.swept(&band));
        }
        for edge in &self.edges {
            let hinge = self.hinge(edge);
            let normal = self.normals[edge.left];
            let wedge = fan(normal, hinge.along.cross(normal), hinge.sine, hinge.cosine, radius);
            let ends = [edge.a, edge.b].map(|i| self.vertices[i as usize]);
            total.add_scaled(1.0, &Moments::simplex(origin, hinge.length, &ends).swept(&wedge));
        }
        for (&vertex, corner) in self.vertices.iter().zip(&self.corners) {
            let (cubed, squared) = (radius * radius * radius, radius * radius);
            let sector = Moments {
                origin: Vec3::ZERO,
                measure: corner.measure * cubed / 3.0,
                first: corner.first * (cubed * radius / 4.0),
                second: combined(&[(cubed * squared / 5.0, corner.second)]),
            };
            total.add_scaled(1.0, &Moments::simplex(origin, 1.0, &[vertex]).swept(&sector));
        }
        total
    }
}

/// The error of a face whose normal cannot be known.
fn flat_face(vertices: &[Vec3], triangle: &[u32; 3]) -> ShapeError {
    let corners = triangle.map(|i| vertices[i as usize].0);
    ShapeError::new(
        "points",
        format!("the hull has a face without area, {corners:?}"),
        "merge points that nearly coincide or lie on one line",
    )
}
