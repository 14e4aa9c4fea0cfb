//! Space's shapes cut into cells, each the image of the unit cube under a smooth map with a known Jacobian:
//! what quadrature runs over. Bodies of revolution turn plane cells in (r, z) about z, a quarter turn each.
//! Knows no density and no error.

use crate::check;
use crate::geometry::ShapeError;
use crate::hull::convex_hull_spatial;
use crate::mass_cells_planar::{parallelogram, sector, triangle};
use crate::mass_moments::no_mass;
use crate::mass_polygon::mean;
use crate::mass_polyhedron::polyhedron_moments;
use crate::mass_rounded::ConvexSurface;
use crate::quadrature::Cell;
use crate::shape::SpatialShape;
use carom_math::{Column, Vec3, vec2, vec3};
use std::f64::consts::FRAC_PI_2;

/// Solid angles and angles below this are rounding of flat corners and edges \[rad\].
const NO_ANGLE: f64 = 1e-12;

/// Corner, edge and face directions of a box: -1, 0 or +1 along every axis.
const SIDES: [f64; 3] = [-1.0, 0.0, 1.0];

/// Tetrahedron with the cube's face u = 0 drawn together in p; the Jacobian is negative when it is inside out.
fn tetrahedron(p: Vec3, q: Vec3, r: Vec3, s: Vec3) -> Cell<3> {
    let (a, b, c) = (q - p, r - q, s - r);
    let jacobian = a.dot(b.cross(c));
    Box::new(move |[u, v, w]| (p + (a + (b + c * w) * v) * u, u * u * v * jacobian))
}

/// p + u a + v b + w c.
fn parallelepiped(p: Vec3, a: Vec3, b: Vec3, c: Vec3) -> Cell<3> {
    let jacobian = a.dot(b.cross(c)).abs();
    Box::new(move |[u, v, w]| (p + a * u + b * v + c * w, jacobian))
}

/// Triangle p, q, r extruded by d.
fn prism(p: Vec3, q: Vec3, r: Vec3, d: Vec3) -> Cell<3> {
    let (a, b) = (q - p, r - q);
    let jacobian = a.dot(b.cross(d)).abs();
    Box::new(move |[w, u, v]| (p + (a + b * v) * u + d * w, u * jacobian))
}

/// Edge from p along `edge`, swept by the fan from unit n towards unit t through an angle \[rad\].
fn wedge(p: Vec3, edge: Vec3, n: Vec3, t: Vec3, angle: f64, radius: f64) -> Cell<3> {
    let jacobian = edge.norm() * radius * radius * angle;
    Box::new(move |[v, u, w]| {
        let (s, c) = libm::sincos(angle * w);
        (p + edge * u + (n * c + t * s) * (radius * v), v * jacobian)
    })
}

/// Ball sector about p over the spherical triangle between unit `middle` and the great arc from unit n towards
/// unit t through an angle \[rad\]. Rays from the middle to the arc point m(w) run at constant speed over the
/// angle g(w) between them: dW = g sin(g v) (middle . n x t) / sin^2 g dv dw.
fn ball_sector(p: Vec3, radius: f64, middle: Vec3, n: Vec3, t: Vec3, angle: f64) -> Cell<3> {
    let jacobian = radius * radius * radius * angle * middle.dot(n.cross(t));
    Box::new(move |[u, v, w]| {
        let (s, c) = libm::sincos(angle * w);
        let arc = n * c + t * s;
        let sine = middle.cross(arc).norm();
        let gap = libm::atan2(sine, middle.dot(arc));
        let (here, rest) = (libm::sin(gap * v), libm::sin(gap * (1.0 - v)));
        let ray = (middle * rest + arc * here) * (1.0 / sine);
        (p + ray * (radius * u), u * u * jacobian * gap * here / (sine * sine))
    })
}

/// A plane cell in (r, z) turned about z, in four quarters.
fn revolved(make: impl Fn() -> Cell<2>) -> Vec<Cell<3>> {
    (0..4)
        .map(|quarter| {
            let (profile, from) = (make(), f64::from(quarter) * FRAC_PI_2);
            let cell: Cell<3> = Box::new(move |[u, v, w]| {
                let (point, jacobian) = profile([u, v]);
                let ([r, z], (s, c)) = (point.0, libm::sincos(from + FRAC_PI_2 * w));
                (vec3(r * c, r * s, z), jacobian * r * FRAC_PI_2)
            });
            cell
        })
        .collect()
}

/// The cells of a shape in its own axes.
pub(crate) fn spatial_cells(shape: &SpatialShape) -> Result<Vec<Cell<3>>, ShapeError> {
    match shape {
        SpatialShape::Sphere { radius } => Ok(round_cylinder(0.0, 0.0, *radius)),
        SpatialShape::Capsule { length, radius } => Ok(round_cylinder(*length, 0.0, *radius)),
        SpatialShape::Cylinder { height, radius } => Ok(round_cylinder(*height, *radius, 0.0)),
        SpatialShape::RoundCylinder { height, radius, rounding } => {
            Ok(round_cylinder(*height, *radius, *rounding))
        }
        SpatialShape::Cone { height, radius } => Ok(round_cone(*height, *radius, 0.0)),
        SpatialShape::RoundCone { height, radius, rounding } => Ok(round_cone(*height, *radius, *rounding)),
        SpatialShape::Box { size } => Ok(round_box(*size, 0.0)),
        SpatialShape::RoundBox { size, radius } => Ok(round_box(*size, *radius)),
        SpatialShape::ConvexHull { points } => {
            let (vertices, triangles) = convex_hull_spatial(points)?;
            Ok(tetrahedra(&vertices, &triangles, mean(&vertices)))
        }
        SpatialShape::RoundConvexHull { points, radius } => {
            let (vertices, triangles) = convex_hull_spatial(points)?;
            let surface = ConvexSurface::new(vertices, triangles)?;
            Ok(round_hull(&surface, *radius))
        }
        SpatialShape::TriMesh { vertices, triangles } => {
            Ok(tetrahedra(vertices, triangles, polyhedron_moments(vertices, triangles)?.center()))
        }
        SpatialShape::Compound { parts } => {
            let mut cells: Vec<Cell<3>> = Vec::new();
            for (i, part) in parts.iter().enumerate() {
                let pose = part.pose;
                for cell in
                    spatial_cells(&part.shape).map_err(|e| check::within(&format!("parts[{i}].shape"), e))?
                {
                    cells.push(Box::new(move |u| {
                        let (point, jacobian) = cell(u);
                        (pose.to_world(point), jacobian)
                    }));
                }
            }
            Ok(cells)
        }
        SpatialShape::HalfSpace { .. } | SpatialShape::Cavity { .. } | SpatialShape::HeightField { .. } => {
            Err(no_mass("half-space, cavity or height field", "finite volume"))
        }
    }
}

/// Cylinder swept by a ball, above and below the middle; any of the three sizes may be zero.
fn round_cylinder(height: f64, radius: f64, rounding: f64) -> Vec<Cell<3>> {
    let mut cells = Vec::new();
    for side in [-1.0, 1.0] {
        let (top, origin) = (0.5 * side * height, vec2(0.0, 0.0));
        let rim = vec2(radius, top);
        if height > 0.0 {
            // core and the band around it are one rectangle
            cells.extend(revolved(|| parallelogram(origin, vec2(radius + rounding, 0.0), vec2(0.0, top))));
        }
        if rounding > 0.0 {
            cells.extend(revolved(|| sector(rim, rounding, 0.0, side * FRAC_PI_2)));
            if radius > 0.0 {
                let (base, lift) = (vec2(0.0, top), vec2(0.0, side * rounding));
                cells.extend(revolved(|| parallelogram(base, vec2(radius, 0.0), lift)));
            }
        }
    }
    cells
}

/// Cone swept by a ball; the rounding may be zero.
fn round_cone(height: f64, radius: f64, rounding: f64) -> Vec<Cell<3>> {
    let (base, rim, apex) = (vec2(0.0, -0.5 * height), vec2(radius, -0.5 * height), vec2(0.0, 0.5 * height));
    // the point of the triangle lies in the middle of the base, so that layers along z stay resolved
    let mut cells = revolved(|| triangle(base, rim, apex));
    if rounding > 0.0 {
        let slope = libm::atan2(radius, height);
        let (s, c) = libm::sincos(slope);
        cells.extend(revolved(|| parallelogram(base, vec2(radius, 0.0), vec2(0.0, -rounding))));
        cells.extend(revolved(|| sector(rim, rounding, -FRAC_PI_2, slope)));
        cells.extend(revolved(|| parallelogram(rim, apex - rim, vec2(c, s) * rounding)));
        cells.extend(revolved(|| sector(apex, rounding, slope, FRAC_PI_2)));
    }
    cells
}

/// Box swept by a ball: core, 6 slabs, 12 quarter wedges, 8 octants.
fn round_box(size: [f64; 3], radius: f64) -> Vec<Cell<3>> {
    let side = |i: usize| vec3(0.0, 0.0, 0.0) + Vec3::from_fn(|k| if k == i { size[i] } else { 0.0 });
    let unit = |i: usize, sign: f64| Vec3::from_fn(|k| if k == i { sign } else { 0.0 });
    let mut cells = Vec::new();
    for x in SIDES {
        for y in SIDES {
            for z in SIDES {
                let signs = [x, y, z];
                let beyond: Vec<usize> = (0..3).filter(|&i| signs[i] != 0.0).collect();
                if radius == 0.0 && !beyond.is_empty() {
                    continue;
                }
                // lowest corner of the part of the core that this region borders
                let p = Vec3::from_fn(|i| 0.5 * size[i] * if signs[i] == 0.0 { -1.0 } else { signs[i] });
                let out: Vec<Vec3> = beyond.iter().map(|&i| unit(i, signs[i])).collect();
                cells.push(match (beyond.as_slice(), out.as_slice()) {
                    ([i], [n]) => parallelepiped(p, *n * radius, side((i + 1) % 3), side((i + 2) % 3)),
                    ([i, j], [n, t]) => wedge(p, side(3 - i - j), *n, *t, FRAC_PI_2, radius),
                    (_, [a, b, c]) => {
                        cells.extend(octant(p, [*a, *b, *c], x * y * z, radius));
                        continue;
                    }
                    _ => parallelepiped(p, side(0), side(1), side(2)),
                });
            }
        }
    }
    cells
}

/// Three cells of a ball's octant spanned by unit vectors; `hand` is their orientation.
fn octant(p: Vec3, axes: [Vec3; 3], hand: f64, radius: f64) -> Vec<Cell<3>> {
    let middle = (axes[0] + axes[1] + axes[2]) * (1.0 / 3f64.sqrt());
    (0..3)
        .map(|i| {
            let (a, b) = (axes[i], axes[(i + 1) % 3]);
            let (n, t) = if hand > 0.0 { (a, b) } else { (b, a) };
            ball_sector(p, radius, middle, n, t, FRAC_PI_2)
        })
        .collect()
}

/// Signed tetrahedra between an apex and the triangles of a surface.
fn tetrahedra(vertices: &[Vec3], triangles: &[[u32; 3]], apex: Vec3) -> Vec<Cell<3>> {
    triangles
        .iter()
        .map(|t| {
            let [a, b, c] = t.map(|i| vertices[i as usize]);
            tetrahedron(apex, a, b, c)
        })
        .collect()
}

/// Hull swept by a ball: tetrahedra, prisms on faces, wedges on edges, ball sectors at vertices.
fn round_hull(surface: &ConvexSurface, radius: f64) -> Vec<Cell<3>> {
    let vertices = &surface.vertices;
    let mut cells = tetrahedra(vertices, &surface.triangles, mean(vertices));
    for (triangle, &normal) in surface.triangles.iter().zip(&surface.normals) {
        let [a, b, c] = triangle.map(|i| vertices[i as usize]);
        cells.push(prism(a, b, c, normal * radius));
    }
    for edge in &surface.edges {
        let hinge = surface.hinge(edge);
        let angle = libm::atan2(hinge.sine, hinge.cosine);
        if angle.abs() < NO_ANGLE {
            continue;
        }
        let normal = surface.normals[edge.left];
        let turning = hinge.along.cross(normal);
        let start = vertices[edge.a as usize];
        cells.push(wedge(start, hinge.along * hinge.length, normal, turning, angle, radius));
        // seen from outside, the arc of normals runs left to right face about a, and right to left about b
        let other = surface.normals[edge.right];
        let back = other.cross(hinge.along);
        for (vertex, n, t) in [(edge.b, normal, turning), (edge.a, other, back)] {
            let corner = &surface.corners[vertex as usize];
            if corner.measure < NO_ANGLE {
                continue;
            }
            if let Some(middle) = corner.first.normalized() {
                cells.push(ball_sector(vertices[vertex as usize], radius, middle, n, t, angle));
            }
        }
    }
    cells
}
