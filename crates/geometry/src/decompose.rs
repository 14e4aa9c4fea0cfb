//! Approximate convex decomposition of meshes: the geometry library's V-HACD (Mamou 2016), which cuts a voxelised
//! solid by planes until every part is nearly convex. Deterministic; knows no shapes.

use crate::check;
use crate::geometry::ShapeError;
use crate::hull::convex_hull_spatial;
use crate::mesh::check_mesh;
use carom_math::{Column, Vec3, vec3};
use parry3d_f64::math::Vector;
use parry3d_f64::transformation::vhacd::{VHACD, VHACDParameters};

/// How finely a mesh is taken apart.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Decomposition {
    /// Most parts \[1\].
    pub max_parts: u32,
    /// Voxels along the mesh's longest side \[1\]: cuts and thin walls are resolved to about one voxel.
    pub resolution: u32,
    /// Volume that a part's hull may add, as a fraction of the whole hull \[1\]; smaller gives more parts.
    pub concavity: f64,
}

impl Default for Decomposition {
    fn default() -> Self {
        Decomposition { max_parts: 32, resolution: 64, concavity: 0.01 }
    }
}

/// Corners of convex parts \[m\] that together approximate the solid inside a closed mesh.
///
/// # Errors
/// [`ShapeError`] for malformed meshes, for options out of range, and for meshes without any volume.
pub fn decompose(
    vertices: &[Vec3],
    triangles: &[[u32; 3]],
    options: &Decomposition,
) -> Result<Vec<Vec<Vec3>>, ShapeError> {
    check_mesh(vertices, triangles)?;
    check_options(options)?;
    let (low, size) = frame(vertices);
    check::length("vertices", size)?;
    // voxels are counted in f64, but thresholds inside the library suit meshes of size 1
    let points: Vec<Vector> = vertices
        .iter()
        .map(|p| {
            let q = (*p - low) * (1.0 / size);
            Vector::new(q[0], q[1], q[2])
        })
        .collect();
    let parameters = VHACDParameters {
        concavity: options.concavity,
        resolution: options.resolution,
        max_convex_hulls: options.max_parts,
        ..VHACDParameters::default()
    };
    let parts = VHACD::decompose(&parameters, &points, triangles, true)
        .compute_exact_convex_hulls(&points, triangles);
    // the library's parts carry points inside their faces: their hulls' corners say the same with fewer
    let parts: Vec<Vec<Vec3>> = parts
        .into_iter()
        .map(|(points, _)| points.iter().map(|p| vec3(p.x, p.y, p.z) * size + low).collect::<Vec<Vec3>>())
        .filter_map(|points| convex_hull_spatial(&points).ok().map(|hull| hull.0))
        .collect();
    if parts.is_empty() {
        return Err(ShapeError::new(
            "triangles",
            "the mesh encloses no volume at this resolution",
            "close the mesh or raise the resolution",
        ));
    }
    Ok(parts)
}

fn check_options(options: &Decomposition) -> Result<(), ShapeError> {
    let range = |field: &str, value: f64, low: f64, high: f64| {
        if (low..=high).contains(&value) {
            return Ok(());
        }
        Err(ShapeError::new(
            field,
            format!("must lie between {low} and {high}, got {value}"),
            "use the default",
        ))
    };
    range("max_parts", f64::from(options.max_parts), 1.0, 1024.0)?;
    range("resolution", f64::from(options.resolution), 8.0, 400.0)?;
    range("concavity", options.concavity, 0.0, 1.0)
}

/// Lowest corner of the box around points and its longest side \[m\].
fn frame(vertices: &[Vec3]) -> (Vec3, f64) {
    let low = vertices.iter().fold(vertices[0], |m, p| Vec3::from_fn(|i| m[i].min(p[i])));
    let high = vertices.iter().fold(vertices[0], |m, p| Vec3::from_fn(|i| m[i].max(p[i])));
    (low, (high - low).max_abs())
}
