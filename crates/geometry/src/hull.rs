//! Convex hulls: the plane by Andrew's monotone chain (1979), space by quickhull on points scaled to equal extents
//! along their principal axes (a hull is the same after any affine map, so thin plates and needles become as well
//! conditioned as cubes). The geometry library's hull was tried and left points half a metre outside where many
//! lie in one face but for rounding. Knows no shapes.

use crate::geometry::ShapeError;
use crate::quickhull::quickhull;
use carom_math::{Column, Inertia, Sym3, Vec2, Vec3, vec3};

/// Extent across a set of points, relative to its largest extent \[1\], at or below which it counts as flat.
pub const FLAT: f64 = 1e-9;

/// Points of space closer than this fraction of the set's extent are one \[1\].
const SAME: f64 = 1e-9;

/// Corners of the convex hull \[m\], counter-clockwise from the leftmost; points within rounding of an edge are
/// no corners.
///
/// # Errors
/// [`ShapeError`] on `points`: fewer than three distinct points, points that are not finite, or all on a line.
pub fn convex_hull_planar(points: &[Vec2]) -> Result<Vec<Vec2>, ShapeError> {
    check_points(points, 3)?;
    let mut sorted = points.to_vec();
    sorted.sort_by(|p, q| p[0].total_cmp(&q[0]).then(p[1].total_cmp(&q[1])));
    sorted.dedup();
    check_distinct(sorted.len(), 3)?;
    let extent = extents(&sorted).max_abs();
    let mut corners = half_hull(sorted.iter().copied(), extent);
    let upper = half_hull(sorted.iter().rev().copied(), extent);
    corners.pop();
    corners.extend_from_slice(&upper[..upper.len() - 1]);
    if corners.len() < 3 || planar_width(&corners) <= FLAT * extent {
        return Err(ShapeError::new(
            "points",
            format!("all {} points lie on one line", points.len()),
            "give points that span an area, or use a segment or a capsule",
        ));
    }
    Ok(corners)
}

/// Corners \[m\] and outward-oriented triangles of the convex hull. Corners keep the order of `points`.
///
/// # Errors
/// [`ShapeError`] on `points`: fewer than four distinct points, points that are not finite, all in a plane, or
/// a set that the hull algorithm cannot resolve.
pub fn convex_hull_spatial(points: &[Vec3]) -> Result<(Vec<Vec3>, Vec<[u32; 3]>), ShapeError> {
    check_points(points, 4)?;
    let kept = merged(points);
    check_distinct(kept.len(), 4)?;
    let (scaled, rounding) = equal_extents(&kept)?;
    // a tolerance just above rounding keeps every corner; clutter in the faces may ask for more
    for tolerance in [1.0, 1e1, 1e2, 1e4].map(|k| (k * 64.0 * rounding).max(k * 1e-14)) {
        if let Some(triangles) = quickhull(&scaled, tolerance) {
            let (corners, triangles) = in_given_order(&kept, triangles);
            if is_hull(&kept, &corners, &triangles) {
                return Ok((corners, triangles));
            }
        }
    }
    Err(ShapeError::new(
        "points",
        format!("no convex hull of the {} points could be resolved", points.len()),
        "merge points that nearly coincide or lie nearly in one face",
    ))
}

/// The points without those that coincide with an earlier one to within [`SAME`], in the given order.
fn merged(points: &[Vec3]) -> Vec<Vec3> {
    let reach = SAME * extents(points).max_abs();
    let mut order: Vec<usize> = (0..points.len()).collect();
    order.sort_by(|&i, &j| points[i][0].total_cmp(&points[j][0]).then(i.cmp(&j)));
    let mut dropped = vec![false; points.len()];
    for (k, &i) in order.iter().enumerate() {
        let near = order[k + 1..].iter().take_while(|&&j| points[j][0] - points[i][0] <= reach);
        for &j in near {
            if !dropped[i] && !dropped[j] && (points[j] - points[i]).norm() <= reach {
                dropped[i.max(j)] = true;
            }
        }
    }
    points.iter().zip(&dropped).filter(|(_, d)| !**d).map(|(p, _)| *p).collect()
}

/// Refuses too few points and points that are not finite.
fn check_points<V: Column>(points: &[V], least: usize) -> Result<(), ShapeError> {
    check_distinct(points.len(), least)?;
    for (i, p) in points.iter().enumerate() {
        if !p.is_finite() {
            return Err(ShapeError::new(
                format!("points[{i}]"),
                format!("coordinates must be finite, got {:?}", p.as_slice()),
                "remove the point or give its coordinates in metres",
            ));
        }
    }
    Ok(())
}

fn check_distinct(count: usize, least: usize) -> Result<(), ShapeError> {
    if count >= least {
        return Ok(());
    }
    Err(ShapeError::new(
        "points",
        format!("a convex hull needs at least {least} distinct points, got {count}"),
        "give more points",
    ))
}

/// Size of the axis-aligned box around the points \[m\].
fn extents<V: Column>(points: &[V]) -> V {
    V::from_fn(|i| {
        let low = points.iter().fold(f64::INFINITY, |m, p| m.min(p[i]));
        points.iter().fold(f64::NEG_INFINITY, |m, p| m.max(p[i])) - low
    })
}

/// One chain of Andrew's algorithm over sorted points: every corner turns left by more than rounding.
fn half_hull(points: impl Iterator<Item = Vec2>, extent: f64) -> Vec<Vec2> {
    let mut chain: Vec<Vec2> = Vec::new();
    for p in points {
        while let [.., a, b] = chain[..] {
            let (ab, ap) = (b - a, p - a);
            // height of the corner b over the chord a-p
            if ab.cross(ap) > 1e-14 * extent * ap.norm() {
                break;
            }
            chain.pop();
        }
        chain.push(p);
    }
    chain
}

/// Smallest distance between two parallel lines that hold a convex polygon between them \[m\].
fn planar_width(corners: &[Vec2]) -> f64 {
    let n = corners.len();
    let across = |i: usize| {
        let edge = corners[(i + 1) % n] - corners[i];
        corners.iter().fold(0.0, |m: f64, p| m.max(edge.cross(*p - corners[i]))) / edge.norm()
    };
    (0..n).map(across).fold(f64::INFINITY, f64::min)
}

/// The points in principal axes, scaled so that each axis has extent 1, and the rounding of their coordinates.
fn equal_extents(points: &[Vec3]) -> Result<(Vec<Vec3>, f64), ShapeError> {
    let size = extents(points).max_abs();
    let mean = points.iter().fold(Vec3::ZERO, |s, p| s + *p * (1.0 / points.len() as f64));
    let mut spread = Sym3::ZERO;
    for p in points {
        let [x, y, z] = ((*p - mean) * (1.0 / size)).0;
        spread = spread.plus(&Sym3 { diagonal: [x * x, y * y, z * z], off: [x * y, x * z, y * z] });
    }
    let (_, axes) = spread.eigen();
    let along = |p: &Vec3, j: usize| (0..3).map(|i| axes[i][j] * (p[i] - mean[i])).sum::<f64>();
    let turned: Vec<Vec3> = points.iter().map(|p| vec3(along(p, 0), along(p, 1), along(p, 2))).collect();
    let extent = extents(&turned);
    if (0..3).any(|i| extent[i] <= FLAT * size) {
        return Err(ShapeError::new(
            "points",
            format!(
                "all {} points lie in one plane or line (extents {:.3e}, {:.3e}, {:.3e} m)",
                points.len(),
                extent[0],
                extent[1],
                extent[2]
            ),
            "give points that span a volume, or use a mesh for a flat obstacle",
        ));
    }
    let farthest = points.iter().fold(0.0, |m: f64, p| m.max(p.max_abs()));
    let thinnest = extent[0].min(extent[1]).min(extent[2]);
    let scaled = turned.iter().map(|p| Vec3::from_fn(|i| p[i] / extent[i])).collect();
    Ok((scaled, f64::EPSILON * farthest / thinnest))
}

/// Drops unused points, keeps the given order, and writes the triangles in an order of their own.
fn in_given_order(points: &[Vec3], triangles: Vec<[u32; 3]>) -> (Vec<Vec3>, Vec<[u32; 3]>) {
    let mut used: Vec<u32> = triangles.iter().flatten().copied().collect();
    used.sort_unstable();
    used.dedup();
    let corners = used.iter().map(|&i| points[i as usize]).collect();
    let rank = |i: u32| used.partition_point(|&u| u < i) as u32;
    let mut renamed: Vec<[u32; 3]> = triangles
        .iter()
        .map(|t| {
            let [a, b, c] = t.map(rank);
            // the smallest corner first, the sense of rotation kept
            if a < b && a < c {
                [a, b, c]
            } else if b < c {
                [b, c, a]
            } else {
                [c, a, b]
            }
        })
        .collect();
    renamed.sort_unstable();
    (corners, renamed)
}

/// True for a closed surface that no point lies outside of by more than rounding.
fn is_hull(points: &[Vec3], corners: &[Vec3], triangles: &[[u32; 3]]) -> bool {
    let mut edges: Vec<(u32, u32)> =
        triangles.iter().flat_map(|t| [(t[0], t[1]), (t[1], t[2]), (t[2], t[0])]).collect();
    edges.sort_unstable();
    let twin = |e: &(u32, u32)| edges.binary_search(&(e.1, e.0)).is_ok();
    if edges.windows(2).any(|w| w[0] == w[1]) || !edges.iter().all(twin) || corners.len() < 4 {
        return false;
    }
    let size = extents(points).max_abs();
    let farthest = points.iter().fold(0.0, |m: f64, p| m.max(p.max_abs()));
    triangles.iter().all(|t| {
        let [a, b, c] = t.map(|i| corners[i as usize]);
        let normal = (b - a).cross(c - a);
        let longest = (b - a).norm().max((c - a).norm()).max((c - b).norm());
        // a sliver's own direction is uncertain by rounding / height; its area is the measure
        let slack = 1e-9 * size * normal.norm() + 16.0 * f64::EPSILON * farthest * size * longest;
        points.iter().all(|p| normal.dot(*p - a) <= slack)
    })
}
