//! Convex hull of points of space by quickhull (Barber, Dobkin and Huhdanpaa 1996) with one tolerance: a point
//! within it of a face counts as on the face and is no corner. Expects points of extent near 1 in every
//! direction. Knows no units; the caller checks the result.

use carom_math::{Column, Vec3};
use std::collections::BTreeMap;

/// A triangle of the growing hull.
struct Face {
    corners: [u32; 3],
    normal: Vec3,
    offset: f64,
    alive: bool,
    /// Points beyond this face, each kept by one face only.
    beyond: Vec<u32>,
}

struct Hull<'a> {
    points: &'a [Vec3],
    tolerance: f64,
    faces: Vec<Face>,
    /// Face to the left of every directed edge.
    left: BTreeMap<(u32, u32), usize>,
}

/// Outward-oriented triangles of the hull, or `None` when the points are flat to within the tolerance or the
/// faces seen from a point do not form one patch.
pub fn quickhull(points: &[Vec3], tolerance: f64) -> Option<Vec<[u32; 3]>> {
    let start = simplex(points, tolerance)?;
    let mut hull = Hull { points, tolerance, faces: Vec::new(), left: BTreeMap::new() };
    let [a, b, c, d] = start;
    for corners in [[a, b, c], [a, c, d], [a, d, b], [b, d, c]] {
        hull.add(corners);
    }
    hull.share((0..points.len() as u32).filter(|i| !start.contains(i)), 0);
    let mut next = 0;
    while next < hull.faces.len() {
        if hull.faces[next].alive && !hull.faces[next].beyond.is_empty() {
            hull.grow(next)?;
        }
        next += 1;
    }
    Some(hull.faces.iter().filter(|f| f.alive).map(|f| f.corners).collect())
}

/// Four points that span a volume, the last one behind the plane of the others.
fn simplex(points: &[Vec3], tolerance: f64) -> Option<[u32; 4]> {
    let farthest = |height: &dyn Fn(Vec3) -> f64| {
        let best =
            (0..points.len()).reduce(|b, i| if height(points[i]) > height(points[b]) { i } else { b })?;
        (height(points[best]) > tolerance).then_some(best)
    };
    let low = (0..points.len()).reduce(|b, i| if points[i][0] < points[b][0] { i } else { b })?;
    let origin = points[low];
    let second = farthest(&|p| (p - origin).norm())?;
    let along = (points[second] - origin).normalized()?;
    let third = farthest(&|p| (p - origin - along * along.dot(p - origin)).norm())?;
    let normal = (points[second] - origin).cross(points[third] - origin).normalized()?;
    let fourth = farthest(&|p| normal.dot(p - origin).abs())?;
    let behind = normal.dot(points[fourth] - origin) < 0.0;
    let [a, b, c, d] = [low, second, third, fourth].map(|i| i as u32);
    Some(if behind { [a, b, c, d] } else { [a, c, b, d] })
}

impl Hull<'_> {
    fn height(&self, face: usize, point: u32) -> f64 {
        self.faces[face].normal.dot(self.points[point as usize]) - self.faces[face].offset
    }

    fn add(&mut self, corners: [u32; 3]) {
        let [p, q, r] = corners.map(|i| self.points[i as usize]);
        let normal = (q - p).cross(r - p).normalized().unwrap_or(Vec3::ZERO);
        let index = self.faces.len();
        for k in 0..3 {
            self.left.insert((corners[k], corners[(k + 1) % 3]), index);
        }
        // the offset of the middle halves the rounding of slivers
        let offset = normal.dot((p + q + r) * (1.0 / 3.0));
        self.faces.push(Face { corners, normal, offset, alive: true, beyond: Vec::new() });
    }

    /// Gives every point to the face (from `first` on) that it lies farthest beyond; drops the others.
    fn share(&mut self, points: impl Iterator<Item = u32>, first: usize) {
        for point in points {
            let best = (first..self.faces.len())
                .map(|f| (f, self.height(f, point)))
                .reduce(|best, f| if f.1 > best.1 { f } else { best });
            if let Some((face, _)) = best.filter(|b| b.1 > self.tolerance) {
                self.faces[face].beyond.push(point);
            }
        }
    }

    /// Replaces all faces that the farthest point beyond a face sees by faces from their outline to that point.
    fn grow(&mut self, face: usize) -> Option<()> {
        let apex = self.faces[face]
            .beyond
            .iter()
            .copied()
            .reduce(|best, p| if self.height(face, p) > self.height(face, best) { p } else { best })?;
        let mut seen = vec![face];
        self.faces[face].alive = false;
        let (mut outline, mut next) = (Vec::new(), 0);
        while next < seen.len() {
            let corners = self.faces[seen[next]].corners;
            next += 1;
            for k in 0..3 {
                let (u, v) = (corners[k], corners[(k + 1) % 3]);
                let other = *self.left.get(&(v, u))?;
                if self.faces[other].alive && self.height(other, apex) > self.tolerance {
                    self.faces[other].alive = false;
                    seen.push(other);
                }
            }
        }
        for &s in &seen {
            let corners = self.faces[s].corners;
            for k in 0..3 {
                let (u, v) = (corners[k], corners[(k + 1) % 3]);
                if self.faces[*self.left.get(&(v, u))?].alive {
                    outline.push((u, v));
                }
            }
        }
        // one closed loop: every corner is left once and entered once
        let mut starts: Vec<u32> = outline.iter().map(|e| e.0).collect();
        starts.sort_unstable();
        if starts.windows(2).any(|w| w[0] == w[1]) {
            return None;
        }
        let mut orphans: Vec<u32> = Vec::new();
        for &s in &seen {
            orphans.append(&mut self.faces[s].beyond);
        }
        let first = self.faces.len();
        outline.iter().for_each(|&(u, v)| self.add([u, v, apex]));
        self.share(orphans.into_iter().filter(|&p| p != apex), first);
        Some(())
    }
}
