//! The plane's shapes cut into cells, each the image of the unit square under a smooth map with a known
//! Jacobian: what quadrature runs over. Knows no density and no error.

use crate::check;
use crate::geometry::ShapeError;
use crate::hull::convex_hull_planar;
use crate::mass_moments::no_mass;
use crate::mass_polygon::{edges, mean, outward};
use crate::quadrature::Cell;
use crate::shape::PlanarShape;
use carom_math::{Column, Vec2, vec2};
use std::f64::consts::FRAC_PI_2;

/// p + u a + v b.
pub(crate) fn parallelogram(p: Vec2, a: Vec2, b: Vec2) -> Cell<2> {
    let jacobian = a.cross(b).abs();
    Box::new(move |[u, v]| (p + a * u + b * v, jacobian))
}

/// Triangle p, q, r with the square's edge u = 0 drawn together in p.
pub(crate) fn triangle(p: Vec2, q: Vec2, r: Vec2) -> Cell<2> {
    let (a, b) = (q - p, r - q);
    let jacobian = a.cross(b).abs();
    Box::new(move |[u, v]| (p + (a + b * v) * u, u * jacobian))
}

/// Sector of a disc about `center` between two angles \[rad\].
pub(crate) fn sector(center: Vec2, radius: f64, from: f64, to: f64) -> Cell<2> {
    let jacobian = radius * radius * (to - from).abs();
    Box::new(move |[u, v]| {
        let (s, c) = libm::sincos(from + (to - from) * v);
        (center + vec2(c, s) * (radius * u), u * jacobian)
    })
}

/// The cells of a shape in its own axes.
pub(crate) fn planar_cells(shape: &PlanarShape) -> Result<Vec<Cell<2>>, ShapeError> {
    let corners = |size: &[f64; 2]| {
        let [x, y] = size.map(|s| 0.5 * s);
        vec![vec2(-x, -y), vec2(x, -y), vec2(x, y), vec2(-x, y)]
    };
    match shape {
        PlanarShape::Circle { radius } => {
            Ok((0..4).map(|k| quarter(Vec2::ZERO, *radius, f64::from(k) * FRAC_PI_2)).collect())
        }
        PlanarShape::Capsule { length, radius } => Ok(capsule(*length, *radius)),
        PlanarShape::Box { size: [x, y] } => {
            Ok(vec![parallelogram(vec2(-0.5 * x, -0.5 * y), vec2(*x, 0.0), vec2(0.0, *y))])
        }
        PlanarShape::RoundBox { size, radius } => {
            let [x, y] = *size;
            let core = parallelogram(vec2(-0.5 * x, -0.5 * y), vec2(x, 0.0), vec2(0.0, y));
            Ok([vec![core], rim(&corners(size), *radius)].into_iter().flatten().collect())
        }
        PlanarShape::ConvexPolygon { points } => Ok(fan_of_triangles(&convex_hull_planar(points)?)),
        PlanarShape::RoundPolygon { points, radius } => {
            let corners = convex_hull_planar(points)?;
            let mut cells = fan_of_triangles(&corners);
            cells.extend(rim(&corners, *radius));
            Ok(cells)
        }
        PlanarShape::Compound { parts } => {
            let mut cells: Vec<Cell<2>> = Vec::new();
            for (i, part) in parts.iter().enumerate() {
                let pose = part.pose;
                for cell in
                    planar_cells(&part.shape).map_err(|e| check::within(&format!("parts[{i}].shape"), e))?
                {
                    cells.push(Box::new(move |u| {
                        let (point, jacobian) = cell(u);
                        (pose.to_world(point), jacobian)
                    }));
                }
            }
            Ok(cells)
        }
        PlanarShape::Segment { .. }
        | PlanarShape::Polyline { .. }
        | PlanarShape::HalfPlane { .. }
        | PlanarShape::Cavity { .. }
        | PlanarShape::HeightField { .. } => Err(no_mass("wall", "area")),
    }
}

fn quarter(center: Vec2, radius: f64, from: f64) -> Cell<2> {
    sector(center, radius, from, from + FRAC_PI_2)
}

/// Band between two half discs, cut along both axes.
fn capsule(length: f64, radius: f64) -> Vec<Cell<2>> {
    let end = 0.5 * length;
    let mut cells = vec![parallelogram(vec2(-end, -radius), vec2(length, 0.0), vec2(0.0, 2.0 * radius))];
    for (x, first) in [(end, -1.0), (end, 0.0), (-end, 1.0), (-end, 2.0)] {
        cells.push(quarter(vec2(x, 0.0), radius, first * FRAC_PI_2));
    }
    cells
}

/// Triangles between the mean of the corners and the edges.
fn fan_of_triangles(corners: &[Vec2]) -> Vec<Cell<2>> {
    let apex = mean(corners);
    edges(corners).map(|(a, b)| triangle(apex, a, b)).collect()
}

/// What a disc's sweep adds to a convex polygon: rectangles on edges, sectors at corners.
fn rim(corners: &[Vec2], radius: f64) -> Vec<Cell<2>> {
    let normals: Vec<Vec2> = edges(corners).map(|(a, b)| outward(a, b)).collect();
    let mut cells = Vec::new();
    for (i, (a, b)) in edges(corners).enumerate() {
        let (n, next) = (normals[i], normals[(i + 1) % normals.len()]);
        cells.push(parallelogram(a, n * radius, b - a));
        let from = libm::atan2(n[1], n[0]);
        cells.push(sector(b, radius, from, from + libm::atan2(n.cross(next), n.dot(next))));
    }
    cells
}
