//! The face of one box cut by the face of another, as seen along a direction (Sutherland and Hodgman 1974, see `clip`): in
//! the frame of the box that cuts, its face is a rectangle with sides along two axes, and a corner is two places and a
//! gap. Corners come in the order of `clip`, with its labels. Knows no pairs and no radii.

use crate::clip::shared;
use crate::kernel::{Label, NONE};
use carom_math::Vec3;
use carom_math::lanes::{Four, Lanes};

/// Corners of the faces of a box in the order of `Polytope::cuboid`, counter-clockwise seen from outside.
pub const RINGS: [[u8; 4]; 6] =
    [[1, 3, 7, 5], [0, 4, 6, 2], [2, 6, 7, 3], [0, 1, 5, 4], [4, 5, 7, 6], [0, 2, 3, 1]];

/// Sides of the faces in that order, from each corner to the next: whether the side bounds the second of the two axes
/// that follow the face's, and whether from below.
const SIDES: [[(bool, bool); 4]; 6] = sides();

/// Signs of a face's corners along the two axes that follow its own.
const SIGNS: [[[f64; 4]; 2]; 6] = signs();

/// Room for corners: four and one more for each cut.
const ROOM: usize = 8;

const fn signs() -> [[[f64; 4]; 2]; 6] {
    let mut all = [[[0.0; 4]; 2]; 6];
    let mut face = 0;
    while face < 6 {
        let mut k = 0;
        while k < 4 {
            let corner = RINGS[face][k];
            all[face][0][k] = if corner >> ((face / 2 + 1) % 3) & 1 == 1 { 1.0 } else { -1.0 };
            all[face][1][k] = if corner >> ((face / 2 + 2) % 3) & 1 == 1 { 1.0 } else { -1.0 };
            k += 1;
        }
        face += 1;
    }
    all
}

const fn sides() -> [[(bool, bool); 4]; 6] {
    let mut all = [[(false, false); 4]; 6];
    let mut face = 0;
    while face < 6 {
        let mut k = 0;
        while k < 4 {
            let (p, q) = (RINGS[face][k], RINGS[face][(k + 1) % 4]);
            let (first, second) = ((face / 2 + 1) % 3, (face / 2 + 2) % 3);
            // the side lies along the axis in whose bit its corners differ
            let bounds_second = p ^ q == 1 << first;
            let axis = if bounds_second { second } else { first };
            all[face][k] = (bounds_second, p >> axis & 1 == 0);
            k += 1;
        }
        face += 1;
    }
    all
}

/// A face of a box about its frame's origin.
#[derive(Clone, Copy)]
pub struct BoxFace {
    /// Half sides of the box \[m\].
    pub half: Vec3,
    /// Number of the face: twice its axis, and one more on the negative side.
    pub number: usize,
}

impl BoxFace {
    /// The axis of the face and the two that follow it.
    #[inline(always)]
    pub fn axes(self) -> [usize; 3] {
        [[0, 1, 2], [1, 2, 0], [2, 0, 1]][(self.number / 2) % 3]
    }
    /// The sign of the face's side.
    #[inline(always)]
    pub fn sign(self) -> f64 {
        if self.number & 1 == 0 { 1.0 } else { -1.0 }
    }
}

/// Two faces in the frame of the box that cuts.
pub struct BoxFaces {
    /// The face that cuts.
    pub knife: BoxFace,
    /// The face that is cut.
    pub cut: BoxFace,
    /// Centre of the box that is cut \[m\].
    pub place: Vec3,
    /// Its axes.
    pub axes: [Vec3; 3],
    /// Unit vector along which the faces are seen, from the box that is cut to the other.
    pub direction: Vec3,
    /// Corners this close to a side count as inside \[m\].
    pub slack: f64,
}

/// A corner of the overlap.
#[derive(Clone, Copy, Default)]
pub struct Corner {
    /// Places on the face that cuts, along the two axes that follow its own \[m\].
    pub at: [f64; 2],
    /// From the one face to the other along the direction \[m\].
    pub gap: f64,
    /// Edge before and edge after the corner: below 4 of the face that is cut.
    before: u32,
    after: u32,
}

/// Corners of the overlap of two faces.
#[derive(Default)]
pub struct Corners {
    corners: [Corner; ROOM],
    count: usize,
}

impl Corners {
    #[inline(always)]
    fn push(&mut self, corner: Corner) {
        if self.count < ROOM {
            self.corners[self.count] = corner;
            self.count += 1;
        }
    }
    /// The corners.
    #[inline(always)]
    pub fn all(&self) -> &[Corner] {
        &self.corners[..self.count.min(ROOM)]
    }
}

impl BoxFaces {
    /// The corners of the overlap, in either of two places.
    #[inline(always)]
    pub fn overlap<'c, L: Lanes>(
        &self,
        lanes: L,
        one: &'c mut Corners,
        other: &'c mut Corners,
    ) -> &'c mut Corners {
        let [_, u, v] = self.knife.axes();
        let (mut corners, mut next) = (one, other);
        let half = [self.knife.half[u], self.knife.half[v]];
        let (slack, outside) = self.seen(lanes, half, corners);
        if outside == [[0; 2]; 2] {
            return corners;
        }
        for (k, &(second, below)) in SIDES[self.knife.number % 6].iter().enumerate() {
            let axis = usize::from(second);
            // what is cut lies between its first corners: a side that has them all inside cuts nothing
            match outside[axis][usize::from(below)] {
                0 => continue,
                15 => {
                    corners.count = 0;
                    return corners;
                }
                _ => {}
            }
            next.count = 0;
            let side = (4 + k as u32, axis, if below { -1.0 } else { 1.0 });
            cut_by(corners, side, half[axis], slack[axis], next);
            std::mem::swap(&mut corners, &mut next);
            if corners.count == 0 {
                return corners;
            }
        }
        corners
    }

    /// The corners of the face that is cut, the slack along both axes \[m\], and which corners are outside of the sides
    /// along each axis, above and below.
    #[inline(always)]
    fn seen<L: Lanes>(&self, lanes: L, half: [f64; 2], corners: &mut Corners) -> ([f64; 2], [[u32; 2]; 2]) {
        let ([w, u, v], sign) = (self.knife.axes(), self.knife.sign());
        let [f, p, q] = self.cut.axes();
        let n = self.direction;
        let center = self.place + self.axes[f] * (self.cut.sign() * self.cut.half[f]);
        let (one, other) = (self.axes[p] * self.cut.half[p], self.axes[q] * self.cut.half[q]);
        let [signs_p, signs_q] = &SIGNS[self.cut.number % 6];
        let (signs_p, signs_q) = (lanes.four(signs_p), lanes.four(signs_q));
        let four = |x: f64| lanes.four_of(x);
        // along the direction to the plane of the face
        let level = four(center[w]) + signs_p * four(one[w]) + signs_q * four(other[w]);
        let gap = (four(self.knife.half[w]) - four(sign) * level) * four(sign / n[w]);
        let x = four(center[u]) + signs_p * four(one[u]) + signs_q * four(other[u]) + four(n[u]) * gap;
        let y = four(center[v]) + signs_p * four(one[v]) + signs_q * four(other[v]) + four(n[v]) * gap;
        let mut slack = [self.slack; 2];
        if n[u] != 0.0 || n[v] != 0.0 {
            let per_lean = self.slack / n[w].abs();
            slack[0] = per_lean * (n[u] * n[u] + n[w] * n[w]).sqrt();
            slack[1] = per_lean * (n[v] * n[v] + n[w] * n[w]).sqrt();
        }
        let (limit_x, limit_y) = (four(half[0] + slack[0]), four(half[1] + slack[1]));
        let outside = [[limit_x.less(x), limit_x.less(-x)], [limit_y.less(y), limit_y.less(-y)]];
        let (x, y, gap) = (x.store(), y.store(), gap.store());
        for k in 0..4 {
            let before = [3, 0, 1, 2][k];
            corners.corners[k] = Corner { at: [x[k], y[k]], gap: gap[k], before, after: k as u32 };
        }
        corners.count = 4;
        (slack, outside)
    }

    /// The features that meet in a corner, the face that is cut standing for `a` of the label.
    #[inline(always)]
    pub fn label(&self, corner: &Corner) -> Label {
        let (p, q) = (corner.before, corner.after);
        let ends = |side: u32| {
            let ring = &RINGS[if side < 4 { self.cut.number } else { self.knife.number } % 6];
            let k = (side % 4) as usize;
            [u32::from(ring[k]), u32::from(ring[(k + 1) % 4])]
        };
        match (p < 4, q < 4) {
            (true, false) => Label { a: ends(p), b: ends(q) },
            (false, true) => Label { a: ends(q), b: ends(p) },
            (true, true) => Label { a: [shared(ends(p), ends(q)), NONE], b: [NONE, NONE] },
            (false, false) => Label { a: [NONE, NONE], b: [shared(ends(p), ends(q)), NONE] },
        }
    }
}

/// One cut: keeps what is at most `slack` beyond a side.
#[inline(always)]
fn cut_by(
    corners: &Corners,
    (side, axis, sign): (u32, usize, f64),
    half: f64,
    slack: f64,
    out: &mut Corners,
) {
    let all = corners.all();
    let Some(mut p) = all.first() else { return };
    let mut hp = sign * p.at[axis] - half;
    let first = hp;
    for k in 1..=all.len() {
        let (q, hq) = match all.get(k) {
            Some(q) => (q, sign * q.at[axis] - half),
            None => (&all[0], first),
        };
        if hp <= slack {
            out.push(*p);
        }
        if (hp <= slack) != (hq <= slack) {
            // two corners within the slack on either side of it would meet the side's line far beyond both
            let t = (hp / (hp - hq)).clamp(0.0, 1.0);
            let at = [p.at[0] + (q.at[0] - p.at[0]) * t, p.at[1] + (q.at[1] - p.at[1]) * t];
            let (before, after) = if hp <= slack { (p.after, side) } else { (side, p.after) };
            out.push(Corner { at, gap: p.gap + (q.gap - p.gap) * t, before, after });
        }
        (p, hp) = (q, hq);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::polytope::Polytope;

    #[test]
    fn the_rings_are_those_of_a_box() {
        let cuboid = Polytope::cuboid([1.0, 2.0, 3.0]);
        for (face, ring) in RINGS.iter().enumerate() {
            let own: Vec<u8> = cuboid.view().ring(face).iter().map(|&i| i as u8).collect();
            assert_eq!(own, ring);
            let [w, u, v] = BoxFace { half: Vec3::default(), number: face }.axes();
            for (k, &(second, below)) in SIDES[face].iter().enumerate() {
                let axis = if second { v } else { u };
                for corner in [ring[k], ring[(k + 1) % 4]] {
                    assert_eq!(corner >> axis & 1 == 0, below);
                    assert_eq!(corner >> w & 1 == 0, face % 2 == 1);
                }
            }
        }
    }
}
