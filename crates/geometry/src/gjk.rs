//! Distance of two convex sets of space by their supports: Gilbert, Johnson and Keerthi 1988, with the nearest
//! point of the simplex found region by region (Ericson, Real-Time Collision Detection, 2005, section 5.1).
//! Works on the difference set C = A - B: the nearest point of C to the origin is normal times distance.
//! Knows no shapes; says `Touching` where rounding leaves no direction.

use crate::kernel::NONE;
use carom_math::{Column, Vec3};

/// Steps after which the distance found so far is taken; flat shapes need about ten, curved ones about thirty.
const STEPS: usize = 128;
/// Distance below this fraction of the scale has no trustworthy direction \[1\].
const NO_DIRECTION: f64 = 1e-14;

/// A tetrahedron thinner than this fraction of its size holds no origin for certain \[1\]: on curved sets its
/// corners crowd, and a wrong sign would report an overlap that is none.
const FLAT: f64 = 1e-10;

/// One point of the difference set and where it comes from.
#[derive(Clone, Copy, Debug)]
pub struct Corner {
    /// a - b \[m\].
    pub c: Vec3,
    /// Point of A.
    pub a: Vec3,
    /// Point of B.
    pub b: Vec3,
    /// Names of the two points.
    pub names: [u32; 2],
}

/// Up to four corners with the weights of the point nearest to the origin.
#[derive(Clone, Copy, Debug)]
pub struct Simplex {
    corners: [Corner; 4],
    weights: [f64; 4],
    count: usize,
}

/// What the distance search found.
#[allow(
    clippy::large_enum_variant,
    reason = "lives on the stack for one query; a box would cost an allocation"
)]
pub enum Outcome {
    /// The sets are apart; the difference set's nearest point and the simplex that holds it.
    Apart(Vec3, Simplex),
    /// The sets touch or overlap.
    Touching,
    /// The distance exceeds the reach.
    Beyond,
}

impl Simplex {
    fn new(corner: Corner) -> Self {
        Simplex { corners: [corner; 4], weights: [1.0, 0.0, 0.0, 0.0], count: 1 }
    }
    fn of(corners: &[Corner], weights: &[f64]) -> Self {
        let mut simplex = Simplex::new(corners[0]);
        simplex.count = 0;
        for (corner, weight) in corners.iter().zip(weights) {
            simplex.corners[simplex.count] = *corner;
            simplex.weights[simplex.count] = *weight;
            simplex.count += 1;
        }
        simplex
    }
    /// The corners in use.
    pub fn corners(&self) -> &[Corner] {
        &self.corners[..self.count]
    }
    fn combine(&self, part: impl Fn(&Corner) -> Vec3) -> Vec3 {
        self.corners().iter().zip(&self.weights).fold(Vec3::ZERO, |s, (c, w)| s + part(c) * *w)
    }
    /// The nearest point as one corner, which convex sets hold as well.
    fn condensed(&self) -> Corner {
        let (a, b) = self.witnesses();
        Corner { c: self.combine(|c| c.c), a, b, names: [NONE, NONE] }
    }
    /// The nearest points of A and of B.
    pub fn witnesses(&self) -> (Vec3, Vec3) {
        (self.combine(|c| c.a), self.combine(|c| c.b))
    }
}

/// Nearest point of C to the origin. `support(d)` is the corner of C with the smallest d.c; `start` any
/// direction; distances beyond `reach` \[m\] are not resolved; `scale` \[m\] is the size of the coordinates.
pub fn nearest(support: &impl Fn(Vec3) -> Corner, start: Vec3, reach: f64, scale: f64) -> Outcome {
    let mut simplex = Simplex::new(support(start));
    let mut point = simplex.corners[0].c;
    for _ in 0..STEPS {
        let squared = point.norm_squared();
        let distance = squared.sqrt();
        if distance <= NO_DIRECTION * scale {
            return Outcome::Touching;
        }
        let corner = support(point);
        let along = point.dot(corner.c);
        if along > reach * distance {
            return Outcome::Beyond;
        }
        if squared - along <= 4.0 * f64::EPSILON * (squared + scale * distance) {
            break;
        }
        let known = simplex.corners().iter().any(|s| s.c == corner.c);
        let grown = if known {
            simplex
        } else {
            match with(&simplex, corner) {
                Some(grown) => grown,
                None => return Outcome::Touching,
            }
        };
        let nearer = |s: &Simplex| s.combine(|c| c.c).norm_squared() < squared;
        // on curved sets the corners crowd until rounding rules the simplex: its nearest point takes its place
        let next = if known || !nearer(&grown) { on_segment(simplex.condensed(), corner) } else { grown };
        if !nearer(&next) {
            break;
        }
        (point, simplex) = (next.combine(|c| c.c), next);
    }
    Outcome::Apart(point, simplex)
}

/// The smallest simplex of the old corners and a new one that holds the point nearest to the origin;
/// `None` when the origin lies inside.
fn with(simplex: &Simplex, corner: Corner) -> Option<Simplex> {
    let old = simplex.corners();
    match *old {
        [p] => Some(on_segment(p, corner)),
        [p, q] => Some(on_triangle(p, q, corner)),
        [p, q, r] => on_tetrahedron([p, q, r, corner]),
        _ => None,
    }
}

fn on_segment(p: Corner, q: Corner) -> Simplex {
    let edge = q.c - p.c;
    let t = -p.c.dot(edge) / edge.norm_squared();
    if t >= 1.0 {
        Simplex::of(&[q], &[1.0])
    } else if t > 0.0 {
        Simplex::of(&[p, q], &[1.0 - t, t])
    } else {
        Simplex::of(&[p], &[1.0])
    }
}

fn on_triangle(p: Corner, q: Corner, r: Corner) -> Simplex {
    let (pq, pr) = (q.c - p.c, r.c - p.c);
    let (d1, d2) = (-pq.dot(p.c), -pr.dot(p.c));
    if d1 <= 0.0 && d2 <= 0.0 {
        return Simplex::of(&[p], &[1.0]);
    }
    let (d3, d4) = (-pq.dot(q.c), -pr.dot(q.c));
    if d3 >= 0.0 && d4 <= d3 {
        return Simplex::of(&[q], &[1.0]);
    }
    let vr = d1 * d4 - d3 * d2;
    if vr <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
        let t = d1 / (d1 - d3);
        return Simplex::of(&[p, q], &[1.0 - t, t]);
    }
    let (d5, d6) = (-pq.dot(r.c), -pr.dot(r.c));
    if d6 >= 0.0 && d5 <= d6 {
        return Simplex::of(&[r], &[1.0]);
    }
    let vq = d5 * d2 - d1 * d6;
    if vq <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
        let t = d2 / (d2 - d6);
        return Simplex::of(&[p, r], &[1.0 - t, t]);
    }
    let vp = d3 * d6 - d5 * d4;
    if vp <= 0.0 && d4 - d3 >= 0.0 && d5 - d6 >= 0.0 {
        let t = (d4 - d3) / ((d4 - d3) + (d5 - d6));
        return Simplex::of(&[q, r], &[1.0 - t, t]);
    }
    let sum = vp + vq + vr;
    Simplex::of(&[p, q, r], &[vp / sum, vq / sum, vr / sum])
}

/// Nearest of the faces that the origin lies beyond; a flat tetrahedron shows all its faces.
fn on_tetrahedron(corners: [Corner; 4]) -> Option<Simplex> {
    let mut best: Option<(f64, Simplex)> = None;
    for opposite in 0..4 {
        let [p, q, r] = [1, 2, 3].map(|k| corners[(opposite + k) % 4]);
        let normal = (q.c - p.c).cross(r.c - p.c);
        let inner = normal.dot(corners[opposite].c - p.c);
        let origin = -normal.dot(p.c);
        let rounding = FLAT * normal.norm() * (p.c.norm() + corners[opposite].c.norm());
        if origin * inner <= 0.0 || inner.abs() <= rounding {
            let face = on_triangle(p, q, r);
            let squared = face.combine(|c| c.c).norm_squared();
            if best.as_ref().is_none_or(|b| squared < b.0) {
                best = Some((squared, face));
            }
        }
    }
    best.map(|b| b.1)
}
