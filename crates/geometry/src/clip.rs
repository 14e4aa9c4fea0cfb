//! Overlap of two convex faces as seen along a direction (Sutherland and Hodgman 1974), every corner labelled
//! by the features that meet in it: a corner of one face inside the other, or the crossing of two edges. The
//! labels do not depend on which face is cut by which. Knows no bodies.

use crate::kernel::{Label, NONE};
use carom_math::{Column, Vec3};

/// A flat feature of a core in a common frame: corners, counter-clockwise seen from outside, with names, and
/// the outward normal when there are at least three.
#[derive(Clone, Debug, Default)]
pub struct Patch {
    /// Corners \[m\] and their names.
    pub ring: Vec<(Vec3, u32)>,
    /// Outward unit normal of the plane.
    pub plane: Option<Vec3>,
}

/// An edge of the patch that is cut (`own`) or of the one that cuts.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Side {
    own: bool,
    ends: [u32; 2],
}

#[derive(Clone, Copy, Debug)]
struct Corner {
    point: Vec3,
    /// Edge before and edge after the corner.
    before: Side,
    after: Side,
}

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
/// direction `outward`. Corners within `slack` \[m\] of a side count as inside.
pub fn overlap(cut: &Patch, knife: &Patch, outward: Vec3, slack: f64) -> Vec<Meeting> {
    let (own, other) = (&cut.ring, &knife.ring);
    let n = own.len();
    let side = |k: usize| Side { own: true, ends: [own[k % n].1, own[(k + 1) % n].1] };
    let mut corners: Vec<Corner> =
        (0..n).map(|k| Corner { point: own[k].0, before: side(k + n - 1), after: side(k) }).collect();
    let mut next = Vec::with_capacity(corners.len() + 4);
    for k in 0..other.len() {
        let (start, end) = (other[k], other[(k + 1) % other.len()]);
        let Some(away) = (end.0 - start.0).cross(outward).normalized() else { continue };
        let knife_side = Side { own: false, ends: [start.1, end.1] };
        let height = |c: &Corner| away.dot(c.point - start.0);
        next.clear();
        cut_by(&corners, knife_side, &height, slack, &mut next);
        std::mem::swap(&mut corners, &mut next);
        if corners.is_empty() {
            break;
        }
    }
    corners.iter().map(|c| Meeting { point: c.point, label: label(c) }).collect()
}

/// One cut: keeps corners whose height over the side is at most `slack`.
fn cut_by(
    corners: &[Corner],
    side: Side,
    height: &dyn Fn(&Corner) -> f64,
    slack: f64,
    out: &mut Vec<Corner>,
) {
    let n = corners.len();
    if n == 1 {
        out.extend(corners.iter().filter(|c| height(c) <= slack));
        return;
    }
    for k in 0..n {
        let (p, q) = (corners[k], corners[(k + 1) % n]);
        let (hp, hq) = (height(&p), height(&q));
        if hp <= slack {
            out.push(p);
        }
        // a segment is a ring that runs there and back: its way back cuts nothing new
        if (hp <= slack) == (hq <= slack) || (n == 2 && k == 1) {
            continue;
        }
        // two corners within the slack on either side of it would meet the side's line far beyond both
        let point = p.point + (q.point - p.point) * (hp / (hp - hq)).clamp(0.0, 1.0);
        let leaving = hp <= slack;
        let (before, after) = if leaving { (p.after, side) } else { (side, p.after) };
        out.push(Corner { point, before, after });
    }
}

fn label(corner: &Corner) -> Label {
    let (p, q) = (corner.before, corner.after);
    let shared = |p: Side, q: Side| p.ends.iter().find(|v| q.ends.contains(v)).copied();
    match (p.own, q.own) {
        (true, false) => Label { a: p.ends, b: q.ends },
        (false, true) => Label { a: q.ends, b: p.ends },
        (true, true) => Label { a: [own_corner(p, q, &shared), NONE], b: [NONE, NONE] },
        (false, false) => Label { a: [NONE, NONE], b: [own_corner(p, q, &shared), NONE] },
    }
}

/// The corner between two edges of one ring. In a segment's ring both edges have both corners: the corner is
/// where the first one ends.
fn own_corner(p: Side, q: Side, shared: &dyn Fn(Side, Side) -> Option<u32>) -> u32 {
    if p.ends[1] == q.ends[0] { p.ends[1] } else { shared(p, q).unwrap_or(p.ends[1]) }
}
