//! Mass properties of the plane's shapes (theory chapter 1): m = rho V, centre = F / V, I = rho tr(C). Every
//! shape with an area has a closed form; a density function is integrated by adaptive quadrature.
//! Knows no bodies.

use crate::check;
use crate::geometry::ShapeError;
use crate::hull::convex_hull_planar;
use crate::mass::MassProperties;
use crate::mass_cells_planar::planar_cells;
use crate::mass_moments::{Moments, check_density, no_mass, no_parts};
use crate::mass_polygon::{polygon_moments, rounded_polygon_moments};
use crate::mass_rounded::rounded_box_moments;
use crate::quadrature::{Integrand, integrate};
use crate::shape::PlanarShape;
use carom_math::{Planar, Vec2};

/// Closed-form mass properties at a constant `density` \[kg/m^2\]. Parts of a compound add by Steiner's rule;
/// where they overlap, mass counts twice.
///
/// # Errors
/// [`ShapeError`] for shapes without area (give the mass explicitly, or make the body fixed), sizes that are not
/// finite and positive, degenerate hulls, and a density that is not finite and positive.
pub fn mass_properties(shape: &PlanarShape, density: f64) -> Result<MassProperties<Planar>, ShapeError> {
    check_density(density)?;
    let PlanarShape::Compound { parts } = shape else {
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

/// Mass properties of a density function \[kg/m^2\] of points in shape axes \[m\], which answers many points at
/// once. `error` bounds, by estimate, the relative error of the mass, of the centre over the radius of gyration
/// and of the inertia. In a compound, overlaps count twice. Smooth densities reach any tolerance; jumps are
/// located along lines. What is narrower than the spacing of the samples, at most a tenth of a piece of the
/// shape, may be missed, and is then missing from `error` too.
///
/// # Errors
/// [`ShapeError`] as for [`mass_properties`]; for a density that is negative or not finite at a point (named),
/// zero everywhere, or of the wrong count; for a tolerance out of range; and when the budget of evaluations
/// ([`EVALUATION_BUDGET`](crate::quadrature::EVALUATION_BUDGET)) leaves an error above both the tolerance and
/// [`ACCEPTABLE_ERROR`](crate::quadrature::ACCEPTABLE_ERROR).
pub fn mass_properties_of(
    shape: &PlanarShape,
    density: &mut dyn FnMut(&[Vec2]) -> Vec<f64>,
    relative_tolerance: f64,
) -> Result<MassProperties<Planar>, ShapeError> {
    let uniform = mass_properties(shape, 1.0)?;
    let integrand = Integrand { density, origin: uniform.center, is_inside: None };
    let (moments, error) = integrate(&planar_cells(shape)?, integrand, relative_tolerance)?;
    Ok(MassProperties { error, ..moments.mass_properties(1.0)? })
}

/// Area moments of a shape that is no compound.
fn moments(shape: &PlanarShape) -> Result<Moments<2>, ShapeError> {
    match shape {
        PlanarShape::Circle { radius } => {
            check::length("radius", *radius)?;
            Ok(rounded_box_moments([0.0; 2], *radius))
        }
        PlanarShape::Capsule { length, radius } => {
            check::length("length", *length)?;
            check::length("radius", *radius)?;
            Ok(rounded_box_moments([0.5 * length, 0.0], *radius))
        }
        PlanarShape::Box { size } => {
            check::lengths("size", size)?;
            Ok(rounded_box_moments(size.map(|s| 0.5 * s), 0.0))
        }
        PlanarShape::RoundBox { size, radius } => {
            check::lengths("size", size)?;
            check::length("radius", *radius)?;
            Ok(rounded_box_moments(size.map(|s| 0.5 * s), *radius))
        }
        PlanarShape::ConvexPolygon { points } => polygon_moments(&convex_hull_planar(points)?),
        PlanarShape::RoundPolygon { points, radius } => {
            check::length("radius", *radius)?;
            Ok(rounded_polygon_moments(&convex_hull_planar(points)?, *radius))
        }
        PlanarShape::Segment { .. } => Err(no_mass("segment", "area")),
        PlanarShape::Polyline { .. } => Err(no_mass("polyline", "area")),
        PlanarShape::HalfPlane { .. } => Err(no_mass("half-plane", "finite area")),
        PlanarShape::Cavity { .. } => Err(no_mass("cavity", "finite area")),
        PlanarShape::HeightField { .. } => Err(no_mass("height field", "area")),
        PlanarShape::Compound { .. } => Err(no_mass("compound inside another shape", "area of its own")),
    }
}
