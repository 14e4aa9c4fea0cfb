//! Triangle meshes and height fields of space, checked and made into surfaces. Knows no contacts.

use crate::check;
use crate::geometry::ShapeError;
use crate::hull::convex_hull_spatial;
use crate::surface::Surface;
use carom_math::{Column, Spatial, Vec3, vec1, vec3};

/// A triangle thinner than this fraction of its longest side has no normal \[1\].
const SLIVER: f64 = 1e-10;

/// A mesh from shared vertices; closed when every edge has its opposite and the enclosed volume is positive.
pub(crate) fn triangles(vertices: &[Vec3], triangles: &[[u32; 3]]) -> Result<Surface<Spatial>, ShapeError> {
    check_mesh(vertices, triangles)?;
    let facets: Vec<u32> = triangles.iter().flatten().copied().collect();
    let closed = is_closed(triangles) && volume(vertices, triangles) > 0.0;
    let extreme = extreme(vertices, &facets);
    Ok(Surface::new(vertices.to_vec(), facets, closed, extreme))
}

/// Refuses meshes without triangles, indices out of range, triangles without area and bad coordinates.
pub(crate) fn check_mesh(vertices: &[Vec3], triangles: &[[u32; 3]]) -> Result<(), ShapeError> {
    check::points("vertices", vertices, 3)?;
    if triangles.is_empty() {
        return Err(ShapeError::new(
            "triangles",
            "a mesh needs at least one triangle, got 0",
            "add triangles",
        ));
    }
    for (i, t) in triangles.iter().enumerate() {
        if let Some(k) = t.iter().position(|&v| v as usize >= vertices.len()) {
            return Err(ShapeError::new(
                format!("triangles[{i}][{k}]"),
                format!("index {} is out of range, there are {} vertices", t[k], vertices.len()),
                "count vertices from 0",
            ));
        }
        let [a, b, c] = t.map(|v| vertices[v as usize]);
        let longest = (b - a).norm().max((c - b).norm()).max((a - c).norm());
        if (b - a).cross(c - a).norm() <= SLIVER * longest * longest {
            return Err(ShapeError::new(
                format!("triangles[{i}]"),
                format!("the vertices {t:?} lie on one line"),
                "remove the triangle or merge its vertices",
            ));
        }
    }
    Ok(())
}

/// Every directed edge occurs once and so does its opposite.
fn is_closed(triangles: &[[u32; 3]]) -> bool {
    let mut edges: Vec<[u32; 2]> =
        triangles.iter().flat_map(|t| (0..3).map(|k| [t[k], t[(k + 1) % 3]])).collect();
    edges.sort_unstable();
    edges.windows(2).all(|w| w[0] != w[1]) && edges.iter().all(|e| edges.binary_search(&[e[1], e[0]]).is_ok())
}

/// Six times the enclosed volume, about the first vertex.
fn volume(vertices: &[Vec3], triangles: &[[u32; 3]]) -> f64 {
    let at = |v: u32| vertices[v as usize] - vertices[0];
    triangles.iter().map(|t| at(t[0]).dot(at(t[1]).cross(at(t[2])))).sum()
}

/// Corners of the convex hull of the used vertices; all used vertices where the mesh is flat.
fn extreme(vertices: &[Vec3], facets: &[u32]) -> Vec<Vec3> {
    let mut used = facets.to_vec();
    used.sort_unstable();
    used.dedup();
    let used: Vec<Vec3> = used.iter().map(|&i| vertices[i as usize]).collect();
    convex_hull_spatial(&used).map_or(used, |hull| hull.0)
}

/// The surface over a grid of heights: row = y, column = x, two triangles per cell, normals up.
pub(crate) fn height_field(heights: &[Vec<f64>], size: [f64; 2]) -> Result<Surface<Spatial>, ShapeError> {
    check::lengths("size", &size)?;
    let rows = heights.len();
    if rows < 2 || heights[0].len() < 2 {
        let columns = heights.first().map_or(0, Vec::len);
        return Err(ShapeError::new(
            "heights",
            format!("needs at least 2 rows and 2 columns, got {rows} x {columns}"),
            "give a height at each corner of the rectangle",
        ));
    }
    let columns = heights[0].len();
    let mut vertices = Vec::with_capacity(rows * columns);
    for (r, row) in heights.iter().enumerate() {
        if row.len() != columns {
            return Err(ShapeError::new(
                format!("heights[{r}]"),
                format!("has {} columns, the first row has {columns}", row.len()),
                "give every row the same number of heights",
            ));
        }
        for (c, h) in row.iter().enumerate() {
            check::point(&format!("heights[{r}][{c}]"), vec1(*h))?;
            let across = |k: usize, n: usize| k as f64 / (n - 1) as f64 - 0.5;
            vertices.push(vec3(size[0] * across(c, columns), size[1] * across(r, rows), *h));
        }
    }
    let at = |r: usize, c: usize| (r * columns + c) as u32;
    let cells = (0..rows - 1).flat_map(|r| (0..columns - 1).map(move |c| (r, c)));
    let facets: Vec<u32> = cells
        .flat_map(|(r, c)| {
            [at(r, c), at(r, c + 1), at(r + 1, c + 1), at(r, c), at(r + 1, c + 1), at(r + 1, c)]
        })
        .collect();
    let extreme = extreme(&vertices, &facets);
    Ok(Surface::new(vertices, facets, false, extreme))
}
