//! Moments of polyhedra: signed tetrahedra between a nearby point and the triangles of a closed surface
//! (theory chapter 1). Exact to rounding, convex or not. Knows no density; does not notice a surface that
//! crosses itself.

use crate::geometry::ShapeError;
use crate::mass_moments::Moments;
use crate::mass_polygon::mean;
use carom_math::{Column, Vec3};

/// An edge shared by two triangles: `left` runs from `a` to `b`, `right` from `b` to `a`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct SharedEdge {
    pub a: u32,
    pub b: u32,
    pub left: usize,
    pub right: usize,
}

/// Volume moments of the region inside a closed surface, about its centroid \[m^3, m^4, m^5\]. Triangles run
/// counter-clockwise seen from outside.
///
/// # Errors
/// [`ShapeError`] on `vertices` that are not finite, on `triangles` that point past the vertices, leave an edge
/// open (named), disagree in orientation (edge named), are turned inside out or enclose no volume.
pub fn polyhedron_moments(vertices: &[Vec3], triangles: &[[u32; 3]]) -> Result<Moments<3>, ShapeError> {
    check_indices(vertices, triangles)?;
    shared_edges(vertices, triangles)?;
    let rough = signed_tetrahedra(vertices, triangles, mean(vertices));
    let extent = vertices.iter().map(|p| (*p - rough.origin).norm()).fold(0.0, f64::max);
    let area: f64 = triangles.iter().map(|t| area_vector(vertices, t).norm()).sum();
    let least = 1e-14 * area * extent;
    if rough.measure < -least {
        return Err(ShapeError::new(
            "triangles",
            format!("the surface is inside out (signed volume {:.6e} m^3)", rough.measure),
            "swap two indices of every triangle, so that they run counter-clockwise seen from outside",
        ));
    }
    if rough.measure <= least {
        return Err(ShapeError::new(
            "triangles",
            format!("the surface encloses no volume ({:.6e} m^3)", rough.measure),
            "give the body's mass explicitly, or a surface with an inside",
        ));
    }
    Ok(signed_tetrahedra(vertices, triangles, rough.center()))
}

/// Normal of a triangle times its area \[m^2\].
pub(crate) fn area_vector(vertices: &[Vec3], triangle: &[u32; 3]) -> Vec3 {
    let [a, b, c] = triangle.map(|i| vertices[i as usize]);
    (b - a).cross(c - a) * 0.5
}

/// Sum over triangles of the signed tetrahedra that they span with the origin.
pub(crate) fn signed_tetrahedra(vertices: &[Vec3], triangles: &[[u32; 3]], origin: Vec3) -> Moments<3> {
    let mut total = Moments::zero(origin);
    for triangle in triangles {
        let [a, b, c] = triangle.map(|i| vertices[i as usize]);
        let volume = (a - origin).dot((b - origin).cross(c - origin)) / 6.0;
        total.add_scaled(1.0, &Moments::simplex(origin, volume, &[origin, a, b, c]));
    }
    total
}

/// True when `point` is inside the closed surface: the solid angles of its triangles, seen from the point, add
/// up to more than a half turn of the sphere (van Oosterom and Strackee 1983).
pub(crate) fn is_inside(vertices: &[Vec3], triangles: &[[u32; 3]], point: Vec3) -> bool {
    let half: f64 = triangles
        .iter()
        .map(|t| {
            let [a, b, c] = t.map(|i| vertices[i as usize] - point);
            let (la, lb, lc) = (a.norm(), b.norm(), c.norm());
            let below = la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb;
            libm::atan2(a.dot(b.cross(c)), below)
        })
        .sum();
    half > std::f64::consts::PI
}

/// Refuses vertices that are not finite and triangles that name a vertex twice or one that is not there.
fn check_indices(vertices: &[Vec3], triangles: &[[u32; 3]]) -> Result<(), ShapeError> {
    if let Some(i) = vertices.iter().position(|p| !p.is_finite()) {
        let problem = format!("vertex {i} is not finite: {:?}", vertices[i].0);
        return Err(ShapeError::new("vertices", problem, "give finite coordinates"));
    }
    if triangles.is_empty() {
        return Err(ShapeError::new("triangles", "a mesh of no triangles encloses nothing", "add triangles"));
    }
    for (k, &[a, b, c]) in triangles.iter().enumerate() {
        let field = || format!("triangles[{k}]");
        if let Some(i) = [a, b, c].into_iter().find(|&i| i as usize >= vertices.len()) {
            let problem = format!("names vertex {i} of {}", vertices.len());
            return Err(ShapeError::new(
                field(),
                problem,
                "use indices from 0 to the number of vertices - 1",
            ));
        }
        if a == b || b == c || c == a {
            let problem = format!("names a vertex twice: {:?}", [a, b, c]);
            return Err(ShapeError::new(field(), problem, "remove the triangle"));
        }
    }
    Ok(())
}

/// Pairs the half-edges of a surface.
///
/// # Errors
/// [`ShapeError`] naming an edge that is not used exactly once in either direction.
pub(crate) fn shared_edges(vertices: &[Vec3], triangles: &[[u32; 3]]) -> Result<Vec<SharedEdge>, ShapeError> {
    // (smaller end, larger end, runs backwards, triangle), sorted: the users of an edge stand together
    let mut halves: Vec<(u32, u32, bool, usize)> = Vec::with_capacity(3 * triangles.len());
    for (k, &[a, b, c]) in triangles.iter().enumerate() {
        halves.extend([(a, b), (b, c), (c, a)].map(|(p, q)| (p.min(q), p.max(q), p > q, k)));
    }
    halves.sort_unstable();
    halves
        .chunk_by(|p, q| (p.0, p.1) == (q.0, q.1))
        .map(|users| match *users {
            [(a, b, false, left), (_, _, true, right)] => Ok(SharedEdge { a, b, left, right }),
            _ => Err(broken_edge(vertices, users)),
        })
        .collect()
}

/// Why these users do not make an edge of a closed, oriented surface.
fn broken_edge(vertices: &[Vec3], users: &[(u32, u32, bool, usize)]) -> ShapeError {
    let (a, b, _, triangle) = users[0];
    let edge = format!("the edge {a}-{b} from {:?} to {:?}", vertices[a as usize].0, vertices[b as usize].0);
    let (problem, remedy) = match users {
        [_] => (
            format!("the surface is open: {edge} belongs to triangle {triangle} alone"),
            "close the mesh or merge duplicate vertices, or give the body's mass explicitly",
        ),
        [_, (_, _, _, other)] => (
            format!("{edge} is run in the same direction by triangles {triangle} and {other}"),
            "orient every triangle counter-clockwise seen from outside",
        ),
        _ => (
            format!("{edge} belongs to {} triangles", users.len()),
            "give every solid its own vertices, or split the mesh into the parts of a compound",
        ),
    };
    ShapeError::new("triangles", problem, remedy)
}
