//! Overlap of two convex faces as seen along a direction (Sutherland and Hodgman 1974), every corner labelled
//! by the features that meet in it: a corner of one face inside the other, or the crossing of two edges. The
//! labels do not depend on which face is cut by which. Knows no bodies.

use crate::few::Few;
use crate::kernel::{Label, NONE, Ring};
use carom_math::{Column, Spatial, Vec3};

/// A flat feature of a core in a common frame: corners, counter-clockwise seen from outside, with names, and
/// the outward normal when there are at least three.
#[derive(Clone, Debug, Default)]
pub struct Patch {
    /// Corners \[m\] and their names.
    pub ring: Ring<Spatial>,
    /// Outward unit normal of the plane.
    pub plane: Option<Vec3>,
}

/// An edge of the patch that is cut (`own`) or of the one that cuts: it runs from corner `start` of its ring.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Side {
    own: bool,
    start: u16,
}

#[derive(Clone, Copy, Debug, Default)]
struct Corner {
    point: Vec3,
    /// Height over the side that cuts at the moment \[m\].
    height: f64,
    /// Edge before and edge after the corner.
    before: Side,
    after: Side,
}

/// Corners of what is left of a face.
type Corners = Few<Corner, 8>;

/// A corner of the overlap: the point on the patch that was cut, and the features that meet, the cut patch
/// standing for `a` of the label.
#[derive(Clone, Copy, Debug)]
pub struct Meeting {
    /// Point of the cut patch \[m\].
    pub point: Vec3,
    /// Its label.
    pub label: Label,
}

/// Cuts `cut` (one to many corners) by the sides of `knife` (three or more), as seen along the knife's outward
/// direction `outward`, and tells the corners of what is left. Corners within `slack` \[m\] of a side count as inside.
pub fn overlap(cut: &Patch, knife: &Patch, outward: Vec3, slack: f64, mut tell: impl FnMut(Meeting)) {
    let (own, other): (&[_], &[_]) = (&cut.ring, &knife.ring);
    let (mut one, mut another) = (Corners::default(), Corners::default());
    let (mut corners, mut next) = (&mut one, &mut another);
    let side = |k: usize| Side { own: true, start: k as u16 };
    let mut before = side(own.len() - 1);
    for (k, &(point, _)) in own.iter().enumerate() {
        corners.push(Corner { point, height: 0.0, before, after: side(k) });
        before = side(k);
    }
    for k in 0..other.len() {
        let (start, end) = (other[k].0, other[following(k, other)].0);
        let Some(away) = (end - start).cross(outward).normalized() else { continue };
        let (mut inside, mut outside) = (false, false);
        for c in corners.iter_mut() {
            c.height = away.dot(c.point - start);
            inside |= c.height <= slack;
            outside |= c.height > slack;
        }
        if !inside {
            return;
        }
        if outside {
            next.clear();
            cut_by(corners, Side { own: false, start: k as u16 }, slack, next);
            std::mem::swap(&mut corners, &mut next);
        }
    }
    for c in corners.iter() {
        tell(Meeting { point: c.point, label: label(c, own, other) });
    }
}

/// Index of the next corner of a ring.
#[inline]
fn following<T>(k: usize, ring: &[T]) -> usize {
    if k + 1 < ring.len() { k + 1 } else { 0 }
}

/// One cut: keeps corners whose height over the side is at most `slack`.
fn cut_by(corners: &[Corner], side: Side, slack: f64, out: &mut Corners) {
    for (k, p) in corners.iter().enumerate() {
        let q = &corners[following(k, corners)];
        let (hp, hq) = (p.height, q.height);
        if hp <= slack {
            out.push(*p);
        }
        // a segment is a ring that runs there and back: its way back cuts nothing new
        if (hp <= slack) == (hq <= slack) || (corners.len() == 2 && k == 1) {
            continue;
        }
        // two corners within the slack on either side of it would meet the side's line far beyond both
        let point = p.point + (q.point - p.point) * (hp / (hp - hq)).clamp(0.0, 1.0);
        let leaving = hp <= slack;
        let (before, after) = if leaving { (p.after, side) } else { (side, p.after) };
        out.push(Corner { point, height: 0.0, before, after });
    }
}

fn label(corner: &Corner, own: &[(Vec3, u32)], other: &[(Vec3, u32)]) -> Label {
    let (p, q) = (corner.before, corner.after);
    let ends = |side: Side| {
        let (ring, k) = (if side.own { own } else { other }, usize::from(side.start));
        [ring[k].1, ring[following(k, ring)].1]
    };
    match (p.own, q.own) {
        (true, false) => Label { a: ends(p), b: ends(q) },
        (false, true) => Label { a: ends(q), b: ends(p) },
        (true, true) => Label { a: [shared(ends(p), ends(q)), NONE], b: [NONE, NONE] },
        (false, false) => Label { a: [NONE, NONE], b: [shared(ends(p), ends(q)), NONE] },
    }
}

/// The corner between two edges of one ring. In a segment's ring both edges have both corners: the corner is
/// where the first one ends.
#[inline]
pub fn shared(p: [u32; 2], q: [u32; 2]) -> u32 {
    if p[1] == q[0] { p[1] } else { p.into_iter().find(|v| q.contains(v)).unwrap_or(p[1]) }
}
