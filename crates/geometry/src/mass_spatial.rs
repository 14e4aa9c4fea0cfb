//! Mass properties of space's shapes (theory chapter 1): m = rho V, centre = F / V, I = rho (tr(C) 1 - C).
//! Every shape with a volume has a closed form; a density function is integrated by adaptive quadrature.
//! Knows no bodies.

use crate::check;
use crate::geometry::ShapeError;
use crate::hull::convex_hull_spatial;
use crate::mass::MassProperties;
use crate::mass_cells_spatial::spatial_cells;
use crate::mass_moments::{Moments, check_density, no_mass, no_parts};
use crate::mass_polyhedron::{is_inside, polyhedron_moments};
use crate::mass_revolution::{round_cone_moments, round_cylinder_moments};
use crate::mass_rounded::{ConvexSurface, rounded_box_moments};
use crate::quadrature::{Integrand, integrate};
use crate::shape::SpatialShape;
use carom_math::{Spatial, Vec3};

/// Closed-form mass properties at a constant `density` \[kg/m^3\]. Parts of a compound add by Steiner's rule;
/// where they overlap, mass counts twice.
///
/// # Errors
/// [`ShapeError`] for shapes without volume (give the mass explicitly, or make the body fixed), sizes that are
/// not finite and positive, degenerate hulls, meshes that are open or inside out (edge named), and a density
/// that is not finite and positive.
pub fn mass_properties(shape: &SpatialShape, density: f64) -> Result<MassProperties<Spatial>, ShapeError> {
    check_density(density)?;
    let SpatialShape::Compound { parts } = shape else {
        return moments(shape)?.mass_properties(density);
    };
    let parts = parts
        .iter()
        .enumerate()
        .map(|(i, part)| {
            let own = mass_properties(&part.shape, density)
                .map_err(|e| check::within(&format!("parts[{i}].shape"), e))?;
            Ok(own.placed(&part.pose))
        })
        .collect::<Result<Vec<_>, _>>()?;
    MassProperties::joined_all(&parts).ok_or_else(no_parts)
}

/// Mass properties of a density function \[kg/m^3\] of points in shape axes \[m\], which answers many points at
/// once. `error` bounds, by estimate, the relative error of the mass, of the centre over the radius of gyration
/// and of the inertia over m k^2. In a compound, overlaps count twice. Smooth densities reach any tolerance;
/// jumps are located along lines, and in space reach about 1e-5. What is narrower than the spacing of the
/// samples, at most a tenth of a piece of the shape, may be missed, and is then missing from `error` too.
/// A mesh that is not star-shaped about its centroid asks for the density outside itself too, where it must
/// be finite and cancels.
///
/// # Errors
/// [`ShapeError`] as for [`mass_properties`]; for a density that is negative or not finite at a point (named),
/// zero everywhere, or of the wrong count; for a tolerance out of range; and when the budget of evaluations
/// ([`EVALUATION_BUDGET`](crate::quadrature::EVALUATION_BUDGET)) leaves an error above both the tolerance and
/// [`ACCEPTABLE_ERROR`](crate::quadrature::ACCEPTABLE_ERROR).
pub fn mass_properties_of(
    shape: &SpatialShape,
    density: &mut dyn FnMut(&[Vec3]) -> Vec<f64>,
    relative_tolerance: f64,
) -> Result<MassProperties<Spatial>, ShapeError> {
    let uniform = mass_properties(shape, 1.0)?;
    let inside = |point: Vec3| covers(shape, point);
    let integrand = Integrand { density, origin: uniform.center, is_inside: Some(&inside) };
    let (moments, error) = integrate(&spatial_cells(shape)?, integrand, relative_tolerance)?;
    Ok(MassProperties { error, ..moments.mass_properties(1.0)? })
}

/// False only where a mesh's signed cells reach beyond its surface; a compound with other parts than meshes
/// does not tell.
fn covers(shape: &SpatialShape, point: Vec3) -> bool {
    match shape {
        SpatialShape::TriMesh { vertices, triangles } => is_inside(vertices, triangles, point),
        SpatialShape::Compound { parts } => {
            parts.iter().any(|part| covers(&part.shape, part.pose.to_body(point)))
        }
        _ => true,
    }
}

/// Volume moments of a shape that is no compound.
fn moments(shape: &SpatialShape) -> Result<Moments<3>, ShapeError> {
    match shape {
        SpatialShape::Sphere { radius } => {
            check_sizes(&[("radius", *radius)])?;
            Ok(rounded_box_moments([0.0; 3], *radius))
        }
        SpatialShape::Capsule { length, radius } => {
            check_sizes(&[("length", *length), ("radius", *radius)])?;
            Ok(rounded_box_moments([0.0, 0.0, 0.5 * length], *radius))
        }
        SpatialShape::Box { size } => {
            check::lengths("size", size)?;
            Ok(rounded_box_moments(size.map(|s| 0.5 * s), 0.0))
        }
        SpatialShape::RoundBox { size, radius } => {
            check::lengths("size", size)?;
            check_sizes(&[("radius", *radius)])?;
            Ok(rounded_box_moments(size.map(|s| 0.5 * s), *radius))
        }
        SpatialShape::Cylinder { height, radius } => {
            check_sizes(&[("height", *height), ("radius", *radius)])?;
            Ok(round_cylinder_moments(*height, *radius, 0.0))
        }
        SpatialShape::RoundCylinder { height, radius, rounding } => {
            check_sizes(&[("height", *height), ("radius", *radius), ("rounding", *rounding)])?;
            Ok(round_cylinder_moments(*height, *radius, *rounding))
        }
        SpatialShape::Cone { height, radius } => {
            check_sizes(&[("height", *height), ("radius", *radius)])?;
            Ok(round_cone_moments(*height, *radius, 0.0))
        }
        SpatialShape::RoundCone { height, radius, rounding } => {
            check_sizes(&[("height", *height), ("radius", *radius), ("rounding", *rounding)])?;
            Ok(round_cone_moments(*height, *radius, *rounding))
        }
        SpatialShape::ConvexHull { points } => {
            let (vertices, triangles) = convex_hull_spatial(points)?;
            polyhedron_moments(&vertices, &triangles)
        }
        SpatialShape::RoundConvexHull { points, radius } => {
            check_sizes(&[("radius", *radius)])?;
            let (vertices, triangles) = convex_hull_spatial(points)?;
            Ok(ConvexSurface::new(vertices, triangles)?.swept_moments(*radius))
        }
        SpatialShape::TriMesh { vertices, triangles } => polyhedron_moments(vertices, triangles),
        SpatialShape::HalfSpace { .. } => Err(no_mass("half-space", "finite volume")),
        SpatialShape::Cavity { .. } => Err(no_mass("cavity", "finite volume")),
        SpatialShape::HeightField { .. } => Err(no_mass("height field", "volume")),
        SpatialShape::Compound { .. } => Err(no_mass("compound inside another shape", "volume of its own")),
    }
}

fn check_sizes(sizes: &[(&str, f64)]) -> Result<(), ShapeError> {
    sizes.iter().try_for_each(|(field, size)| check::length(field, *size))
}
