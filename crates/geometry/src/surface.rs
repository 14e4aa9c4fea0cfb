//! Surfaces: polylines of the plane, triangle meshes and height fields of space, as facets over shared corners
//! with the fold angle at every seam. A facet alone does not know that its neighbour goes on; the fold angles
//! say which contact normals can belong to the facet (from its own normal to its neighbour's over a convex fold,
//! only its own over a flat or hollow one), so that nothing stumbles over the seams of a smooth floor.

use crate::geometry::Aabb;
use crate::kernel::Kernel;
use crate::tree::Tree;
use carom_math::{Column, Turn};
use std::collections::BTreeMap;

/// A normal may lean this much beyond what its seams allow \[rad\]: rounding, not geometry.
const LEAN: f64 = 1e-9;
/// A direction that leans less than this out of an open facet's plane shows no side \[1\].
const LEVEL: f64 = 1e-6;

/// Facets over shared corners.
#[derive(Clone, Debug)]
pub struct Surface<S: Kernel> {
    /// Corners \[m\].
    pub points: Vec<S::Vector>,
    /// Corner indices, `DIM` per facet.
    pub facets: Vec<u32>,
    /// Fold angle at every seam \[rad\], `DIM` per facet: from the facet's normal towards its neighbour's,
    /// positive where the surface is convex seen from the normal's side, infinite at a free rim.
    pub folds: Vec<f64>,
    /// True when the surface encloses a volume and its normals point outwards: nothing touches it from behind.
    pub closed: bool,
    /// Boxes of the facets.
    pub tree: Tree<S>,
    /// Corners that can be farthest in some direction.
    pub extreme: Vec<S::Vector>,
}

/// The facet in hand during a contact query.
pub struct Facet<'a, S: Kernel> {
    surface: &'a Surface<S>,
    index: usize,
    corners: [S::Vector; 3],
}

/// What a facet says to a proposed contact normal.
pub enum Verdict<S: Kernel> {
    /// The normal is the facet's own, or within its seams.
    Keep,
    /// The facet pushes along this direction instead.
    Turn(S::Vector),
    /// The other core touches a closed surface from behind.
    Drop,
}

impl<S: Kernel> Surface<S> {
    /// A surface from corners and facets; `closed` when it encloses a volume with outward normals.
    pub fn new(points: Vec<S::Vector>, facets: Vec<u32>, closed: bool, extreme: Vec<S::Vector>) -> Self {
        let boxes = facets.chunks(S::DIM).map(|f| around(f.iter().map(|&i| points[i as usize]))).collect();
        let folds = folds::<S>(&points, &facets);
        Surface { points, facets, folds, closed, tree: Tree::new(boxes), extreme }
    }
    /// A facet by its index.
    pub fn facet(&self, index: usize) -> Facet<'_, S> {
        let mut corners = [S::Vector::ZERO; 3];
        for (corner, &i) in corners.iter_mut().zip(&self.facets[S::DIM * index..S::DIM * (index + 1)]) {
            *corner = self.points[i as usize];
        }
        Facet { surface: self, index, corners }
    }
}

impl<S: Kernel> Facet<'_, S> {
    /// The facet as a convex core.
    pub fn core(&self) -> S::Core {
        S::facet(&self.corners[..S::DIM])
    }
    /// Whether this facet may push along the unit direction `normal` (facet's frame, from the facet to the other
    /// core), given s(n) of the pair as a function of such directions.
    pub fn judge(&self, normal: S::Vector, separation: &dyn Fn(S::Vector) -> f64) -> Verdict<S> {
        let corners = &self.corners[..S::DIM];
        let up = S::facet_normal(corners);
        let lean = up.dot(normal);
        let above =
            self.surface.closed || lean > LEVEL || (lean >= -LEVEL && separation(up) >= separation(-up));
        let side = if above { 1.0 } else { -1.0 };
        let mut turned: Option<(S::Vector, f64)> = None;
        let mut on_seam = false;
        for k in (0..S::DIM).filter(|&k| self.meets_seam(k, normal)) {
            on_seam = true;
            let fold = self.surface.folds[S::DIM * self.index + k];
            let out = S::facet_outward(corners, k);
            let limit = (side * fold).max(0.0);
            if fold.is_finite() && angle(out.dot(normal), side * lean) > limit + LEAN {
                let [c, s] = Turn::from_angle(limit).0;
                let candidate = up * (side * c) + out * s;
                let gap = separation(candidate);
                if turned.is_none_or(|t| gap > t.1) {
                    turned = Some((candidate, gap));
                }
            }
        }
        if self.surface.closed && lean < -LEAN && (turned.is_some() || !on_seam) {
            return Verdict::Drop;
        }
        turned.map_or(Verdict::Keep, |t| Verdict::Turn(t.0))
    }
    /// The only direction along which this facet can push a core that overlaps it little, where its seams allow no
    /// other: sparing the search for one. The overlap counts as little below a tenth of the facet's width.
    pub fn only_normal(&self, separation: &dyn Fn(S::Vector) -> f64) -> Option<S::Vector> {
        let corners = &self.corners[..S::DIM];
        let folds = &self.surface.folds[S::DIM * self.index..S::DIM * (self.index + 1)];
        // which of the two sides stand out from their neighbours, as far as that is known before anything is measured
        let stands_out = |side: f64| folds.iter().all(|f| f.is_finite() && side * f <= LEAN);
        let (closed, [above, below]) = (self.surface.closed, [1.0, -1.0].map(stands_out));
        if !above && (closed || !below) {
            return None;
        }
        let up = S::facet_normal(corners);
        let gap = separation(up);
        let opposite = if closed { f64::NEG_INFINITY } else { separation(-up) };
        let (side, gap, stands_out) =
            if gap >= opposite { (1.0, gap, above) } else { (-1.0, opposite, below) };
        let width = (1..S::DIM).fold(f64::INFINITY, |m, k| m.min((corners[k] - corners[0]).norm()));
        (stands_out && gap > -0.1 * width).then_some(up * side)
    }
    /// Foot on the facet's plane of a point seen along a direction, if it lies on the facet (within `slack` \[m\]).
    pub fn foot(&self, point: S::Vector, direction: S::Vector, slack: f64) -> Option<S::Vector> {
        let corners = &self.corners[..S::DIM];
        let up = S::facet_normal(corners);
        let lean = up.dot(direction);
        let foot = point - direction * (up.dot(point - corners[0]) / lean);
        let inside = |k: usize| S::facet_outward(corners, k).dot(foot - corners[k]) <= slack;
        (lean.abs() > 0.1 && (0..S::DIM).all(inside)).then_some(foot)
    }
    /// True when the facet's farthest corners along a direction all lie on its k-th seam.
    fn meets_seam(&self, k: usize, direction: S::Vector) -> bool {
        let corners = &self.corners[..S::DIM];
        let heights = corners.iter().map(|c| direction.dot(*c - corners[0]));
        let top = heights.clone().fold(f64::NEG_INFINITY, f64::max);
        let size = corners.iter().fold(0.0, |m: f64, c| m.max((*c - corners[0]).max_abs()));
        let on_seam = |i: usize| (0..S::DIM - 1).any(|j| (k + j) % S::DIM == i);
        heights.enumerate().all(|(i, h)| on_seam(i) || h < top - 1e-6 * size)
    }
}

/// Angle of the direction (x, y) \[rad\].
fn angle(y: f64, x: f64) -> f64 {
    Turn([x, y]).angle()
}

/// Box around points.
pub fn around<S: Kernel>(points: impl Iterator<Item = S::Vector>) -> Aabb<S> {
    let empty =
        Aabb { min: S::Vector::from_fn(|_| f64::INFINITY), max: S::Vector::from_fn(|_| f64::NEG_INFINITY) };
    points.fold(empty, |b, p| b.union(&Aabb { min: p, max: p }))
}

/// Fold angles at all seams; where more than two facets share a seam, the flattest neighbour counts.
fn folds<S: Kernel>(points: &[S::Vector], facets: &[u32]) -> Vec<f64> {
    let seam = |facet: usize, k: usize| {
        let mut ends: Vec<u32> = (0..S::DIM - 1).map(|j| facets[S::DIM * facet + (k + j) % S::DIM]).collect();
        ends.sort_unstable();
        ends
    };
    let mut sharing: BTreeMap<Vec<u32>, Vec<(usize, usize)>> = BTreeMap::new();
    let count = facets.len() / S::DIM;
    for facet in 0..count {
        (0..S::DIM).for_each(|k| sharing.entry(seam(facet, k)).or_default().push((facet, k)));
    }
    let corners = |facet: usize| -> Vec<S::Vector> {
        facets[S::DIM * facet..S::DIM * (facet + 1)].iter().map(|&i| points[i as usize]).collect()
    };
    let mut folds = vec![f64::INFINITY; facets.len()];
    for group in sharing.values() {
        for &(facet, k) in group {
            let own = corners(facet);
            let (up, out) = (S::facet_normal(&own), S::facet_outward(&own, k));
            for &(other, m) in group.iter().filter(|o| **o != (facet, k)) {
                // the neighbour goes on from the seam against its own outward direction
                let onward = -S::facet_outward(&corners(other), m);
                let angle = angle(-onward.dot(up), onward.dot(out));
                let slot = &mut folds[S::DIM * facet + k];
                if angle.abs() < slot.abs() {
                    *slot = angle;
                }
            }
        }
    }
    folds
}
