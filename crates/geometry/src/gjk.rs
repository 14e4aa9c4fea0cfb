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
    /// The distance exceeds the reach: along this direction of any length, it is at least so much \[m\].
    Beyond(Vec3, f64),
}

/// Which corners hold the nearest point, and with what weights.
#[derive(Clone, Copy)]
struct Part {
    which: [u8; 3],
    weights: [f64; 3],
    count: usize,
}

impl Part {
    #[inline(always)]
    fn of<const N: usize>(which: [u8; N], weights: [f64; N]) -> Self {
        let mut part = Part { which: [0; 3], weights: [0.0; 3], count: N };
        part.which[..N].copy_from_slice(&which);
        part.weights[..N].copy_from_slice(&weights);
        part
    }
    /// The point of the part of these corners.
    #[inline(always)]
    fn point(&self, corners: &[Corner; 4]) -> Vec3 {
        let weighted = |k: usize| corners[usize::from(self.which[k]) & 3].c * self.weights[k];
        (0..self.count).fold(Vec3::ZERO, |s, k| s + weighted(k))
    }
}

impl Simplex {
    fn new(corner: Corner) -> Self {
        Simplex { corners: [corner; 4], weights: [1.0, 0.0, 0.0, 0.0], count: 1 }
    }
    /// Keeps a part of the corners.
    #[inline(always)]
    fn keep(&mut self, part: &Part) {
        // the numbers of a part may come in any order: read before written
        let at = |k: usize| self.corners[usize::from(part.which[k]) & 3];
        let [first, second, third] = [at(0), at(1), at(2)];
        (self.corners[0], self.corners[1], self.corners[2]) = (first, second, third);
        self.weights[..3].copy_from_slice(&part.weights);
        self.count = part.count;
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
            return Outcome::Beyond(point, along / distance);
        }
        if squared - along <= 4.0 * f64::EPSILON * (squared + scale * distance) {
            break;
        }
        let known = simplex.corners().iter().any(|s| s.c == corner.c);
        if !known {
            simplex.corners[simplex.count] = corner;
            let Some(part) = holding(&simplex.corners, simplex.count) else {
                return Outcome::Touching;
            };
            let nearer = part.point(&simplex.corners);
            if nearer.norm_squared() < squared {
                simplex.keep(&part);
                point = nearer;
                continue;
            }
        }
        // on curved sets the corners crowd until rounding rules the simplex: its nearest point takes its place
        let mut between = Simplex { corners: [simplex.condensed(), corner, corner, corner], ..simplex };
        between.keep(&on_segment(between.corners[0].c, corner.c));
        let nearer = between.combine(|c| c.c);
        let gains = nearer.norm_squared() < squared;
        if !gains {
            break;
        }
        (point, simplex) = (nearer, between);
    }
    Outcome::Apart(point, simplex)
}

/// The part of `old` corners and a new one behind them that holds the point nearest to the origin; `None` when the
/// origin lies inside.
#[inline(always)]
fn holding(corners: &[Corner; 4], old: usize) -> Option<Part> {
    let [p, q, r, _] = corners;
    match old {
        1 => Some(on_segment(p.c, q.c)),
        2 => Some(on_triangle(p.c, q.c, r.c)),
        3 => on_tetrahedron(corners),
        _ => None,
    }
}

fn on_segment(p: Vec3, q: Vec3) -> Part {
    let edge = q - p;
    let t = -p.dot(edge) / edge.norm_squared();
    if t >= 1.0 {
        Part::of([1], [1.0])
    } else if t > 0.0 {
        Part::of([0, 1], [1.0 - t, t])
    } else {
        Part::of([0], [1.0])
    }
}

fn on_triangle(p: Vec3, q: Vec3, r: Vec3) -> Part {
    let (pq, pr) = (q - p, r - p);
    let (d1, d2) = (-pq.dot(p), -pr.dot(p));
    if d1 <= 0.0 && d2 <= 0.0 {
        return Part::of([0], [1.0]);
    }
    let (d3, d4) = (-pq.dot(q), -pr.dot(q));
    if d3 >= 0.0 && d4 <= d3 {
        return Part::of([1], [1.0]);
    }
    let vr = d1 * d4 - d3 * d2;
    if vr <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
        let t = d1 / (d1 - d3);
        return Part::of([0, 1], [1.0 - t, t]);
    }
    let (d5, d6) = (-pq.dot(r), -pr.dot(r));
    if d6 >= 0.0 && d5 <= d6 {
        return Part::of([2], [1.0]);
    }
    let vq = d5 * d2 - d1 * d6;
    if vq <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
        let t = d2 / (d2 - d6);
        return Part::of([0, 2], [1.0 - t, t]);
    }
    let vp = d3 * d6 - d5 * d4;
    if vp <= 0.0 && d4 - d3 >= 0.0 && d5 - d6 >= 0.0 {
        let t = (d4 - d3) / ((d4 - d3) + (d5 - d6));
        return Part::of([1, 2], [1.0 - t, t]);
    }
    let sum = vp + vq + vr;
    Part::of([0, 1, 2], [vp / sum, vq / sum, vr / sum])
}

/// The corners of the faces of a tetrahedron, each opposite to the corner of its number.
const FACES: [[u8; 3]; 4] = [[1, 2, 3], [2, 3, 0], [3, 0, 1], [0, 1, 2]];

/// Nearest of the faces that the origin lies beyond; a flat tetrahedron shows all its faces.
fn on_tetrahedron(corners: &[Corner; 4]) -> Option<Part> {
    let mut best: Option<(f64, Part)> = None;
    let at = |k: u8| corners[usize::from(k) & 3].c;
    for (opposite, face) in (0..).zip(FACES) {
        let (p, q, r, apex) = (at(face[0]), at(face[1]), at(face[2]), at(opposite));
        let normal = (q - p).cross(r - p);
        let inner = normal.dot(apex - p);
        let origin = -normal.dot(p);
        let beyond = origin * inner <= 0.0;
        if beyond || inner.abs() <= FLAT * normal.norm() * (p.norm() + apex.norm()) {
            let Part { which: [i, j, k], weights, count } = on_triangle(p, q, r);
            let number = |i: u8| face[usize::from(i) % 3];
            let part = Part { which: [number(i), number(j), number(k)], weights, count };
            let squared = part.point(corners).norm_squared();
            if best.as_ref().is_none_or(|b| squared < b.0) {
                best = Some((squared, part));
            }
        }
    }
    best.map(|b| b.1)
}
