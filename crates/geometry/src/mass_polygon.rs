//! Moments of polygons: shoelace sums of signed triangles about a nearby point, and the convex polygon swept
//! by a disc as polygon + edge rectangles + corner sectors (theory chapter 1). Exact to rounding.
//! Knows no density; does not notice a polygon that crosses itself.

use crate::geometry::ShapeError;
use crate::mass_moments::{Moments, combined, outer};
use carom_math::{Column, Tuple, Vec2};

/// Area moments of a simple polygon, convex or not, about its centroid \[m^2, m^3, m^4\]. Corners run
/// counter-clockwise; the last joins the first.
///
/// # Errors
/// [`ShapeError`] on `points`: fewer than three, not finite, clockwise, or without area.
pub fn polygon_moments(points: &[Vec2]) -> Result<Moments<2>, ShapeError> {
    let refuse = |problem: String, remedy: &str| Err(ShapeError::new("points", problem, remedy));
    if points.len() < 3 {
        return refuse(format!("a polygon needs at least 3 points, got {}", points.len()), "add points");
    }
    if let Some(i) = points.iter().position(|p| !p.is_finite()) {
        return refuse(format!("point {i} is not finite: {:?}", points[i].0), "give finite coordinates");
    }
    let rough = signed_triangles(points, mean(points));
    let extent = points.iter().map(|p| (*p - rough.origin).norm()).fold(0.0, f64::max);
    if rough.measure < -1e-14 * extent * extent {
        return refuse(
            format!("the points run clockwise (signed area {:.6e} m^2)", rough.measure),
            "reverse their order",
        );
    }
    if rough.measure <= 1e-14 * extent * extent {
        return refuse(format!("the polygon has no area ({:.6e} m^2)", rough.measure), "spread the points");
    }
    Ok(signed_triangles(points, rough.center()))
}

/// Moments of a convex polygon (corners counter-clockwise) swept by a disc, about a point near its centroid.
pub(crate) fn rounded_polygon_moments(corners: &[Vec2], radius: f64) -> Moments<2> {
    let rough = rounded_about(corners, radius, mean(corners));
    rounded_about(corners, radius, rough.center())
}

/// Mean of points: a nearby origin, so that no large numbers cancel.
pub(crate) fn mean<const N: usize>(points: &[Tuple<N>]) -> Tuple<N> {
    // relative to the first point, so that far from zero the mean is as exact as the points are
    let sum = points.iter().fold(Tuple::ZERO, |sum, p| sum + (*p - points[0]));
    points[0] + sum * (1.0 / points.len() as f64)
}

/// Edges of a closed chain.
pub(crate) fn edges<const N: usize>(points: &[Tuple<N>]) -> impl Iterator<Item = (Tuple<N>, Tuple<N>)> + '_ {
    points.iter().zip(points.iter().cycle().skip(1)).map(|(a, b)| (*a, *b))
}

/// Sum over edges of the signed triangles that they span with the origin.
fn signed_triangles(points: &[Vec2], origin: Vec2) -> Moments<2> {
    let mut total = Moments::zero(origin);
    for (a, b) in edges(points) {
        let area = 0.5 * (a - origin).cross(b - origin);
        total.add_scaled(1.0, &Moments::simplex(origin, area, &[origin, a, b]));
    }
    total
}

/// Polygon + a rectangle on every edge + a sector at every corner.
fn rounded_about(corners: &[Vec2], radius: f64, origin: Vec2) -> Moments<2> {
    let mut total = signed_triangles(corners, origin);
    let normals: Vec<Vec2> = edges(corners).map(|(a, b)| outward(a, b)).collect();
    for (i, (a, b)) in edges(corners).enumerate() {
        let band = Moments::simplex(Vec2::ZERO, radius, &[Vec2::ZERO, normals[i] * radius]);
        total.add_scaled(1.0, &Moments::simplex(origin, (b - a).norm(), &[a, b]).swept(&band));
        let (n, next) = (normals[i], normals[(i + 1) % normals.len()]);
        let sector = fan(n, n.perp(), n.cross(next), n.dot(next), radius);
        total.add_scaled(1.0, &Moments::simplex(origin, 1.0, &[b]).swept(&sector));
    }
    total
}

/// Outward unit normal of a counter-clockwise edge; zero for an edge without length.
pub(crate) fn outward(a: Vec2, b: Vec2) -> Vec2 {
    (b - a).normalized().map_or(Vec2::ZERO, |e| -e.perp())
}

/// A plane fan from the unit vector n towards the unit vector t at right angles to it, through the angle
/// theta with this sine and cosine, of this radius r; moments about its apex:
///   theta r^2 / 2,   r^3 / 3 int u,   r^4 / 4 int u u^T,   u = n cos + t sin.
pub(crate) fn fan<const N: usize>(
    n: Tuple<N>,
    t: Tuple<N>,
    sine: f64,
    cosine: f64,
    radius: f64,
) -> Moments<N> {
    let angle = libm::atan2(sine, cosine);
    // 1 - cos without cancellation
    let versine = if cosine > 0.0 { sine * sine / (1.0 + cosine) } else { 1.0 - cosine };
    let (squared, cubed) = (radius * radius, radius * radius * radius);
    let k = 0.125 * squared * squared;
    Moments {
        origin: Tuple::ZERO,
        measure: 0.5 * angle * squared,
        first: (n * sine + t * versine) * (cubed / 3.0),
        second: combined(&[
            (k * (angle + sine * cosine), outer(n, n)),
            (k * (angle - sine * cosine), outer(t, t)),
            (k * sine * sine, outer(n, t)),
            (k * sine * sine, outer(t, n)),
        ]),
    }
}
