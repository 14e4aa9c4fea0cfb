//! Contact of two convex cores of the plane. The largest s(n) (see `kernel`) lies on an edge normal, or, for
//! separate cores, on the line between two corners; contact points are the ends of the overlap of the two edges
//! that face each other. Knows no radii and no composite shapes.

use crate::core_planar::{PlanarCore, edge_normal};
use crate::geometry::{ABREAST, Aabb, ContactPoint, Guess, Told};
use crate::kernel::{Beside, Kernel, Label, NONE, Ring, Separation, Swept, Touch, Touches, scale};
use crate::planar_boxes::{self, half_of};
use crate::polygons;
use carom_math::{Column, Planar, Pose, Rotation, Tuple, Vec2, vec2};

/// Two gaps closer than this fraction of the scale are the same to rounding \[1\].
pub const ROUNDING: f64 = 4e-15;
/// Ends of two edges closer than this fraction of the scale are one end \[1\].
pub const SAME_END: f64 = 1e-7;

impl Kernel for Planar {
    type Core = PlanarCore;
    const PATCH: usize = 2;
    fn facet(corners: &[Vec2]) -> PlanarCore {
        PlanarCore::segment(corners[0], corners[1])
    }
    fn dot(point: Vec2) -> PlanarCore {
        PlanarCore::Point([point])
    }
    fn only_point(core: &PlanarCore) -> Option<Vec2> {
        if let PlanarCore::Point([p]) = core { Some(*p) } else { None }
    }
    fn facet_normal(corners: &[Vec2]) -> Vec2 {
        edge_normal(corners[0], corners[1])
    }
    fn facet_outward(corners: &[Vec2], k: usize) -> Vec2 {
        (corners[k] - corners[1 - k]).normalized().unwrap_or(Vec2::ZERO)
    }
    fn support(core: &PlanarCore, direction: Vec2) -> (Vec2, u32) {
        let corners = core.corners();
        let best = farthest(corners, direction);
        (corners[best], best as u32)
    }
    fn bounds_of(core: &PlanarCore, pose: &Pose<Planar>) -> Aabb<Planar> {
        if let Some(ring) = core.rows() {
            let [min, max] = polygons::spans(ring, &pose.rotation);
            return Aabb { min: pose.position + Tuple(min), max: pose.position + Tuple(max) };
        }
        let (mut min, mut max) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
        for corner in core.corners() {
            let turned = pose.rotation.rotate(*corner);
            for k in 0..2 {
                min[k] = if turned[k] < min[k] { turned[k] } else { min[k] };
                max[k] = if turned[k] > max[k] { turned[k] } else { max[k] };
            }
        }
        // sums are rounded in order: the box of the corners where they are
        Aabb { min: pose.position + vec2(min[0], min[1]), max: pose.position + vec2(max[0], max[1]) }
    }
    fn size(core: &PlanarCore) -> f64 {
        core.corners().iter().fold(0.0, |m: f64, p| m.max(p.norm_squared())).sqrt()
    }
    fn corners(core: &PlanarCore, _from: Vec2, out: &mut Ring<Planar>) {
        out.extend(core.corners().iter().zip(0..).map(|(p, k)| (*p, k)));
    }
    fn feature(core: &PlanarCore, direction: Vec2, out: &mut Ring<Planar>) {
        let corners = core.corners();
        match core.edge_toward(direction) {
            Some((i, j)) => out.extend([(corners[i], i as u32), (corners[j], j as u32)]),
            None => out.push((corners[0], 0)),
        }
    }
    fn separation(
        a: &PlanarCore,
        b: &PlanarCore,
        b_in_a: &Pose<Planar>,
        reach: f64,
        _: &mut Guess<Planar>,
    ) -> Option<Separation<Planar>> {
        let scale = scale::<Planar>(a, b, b_in_a);
        let tolerance = ROUNDING * scale;
        let mut best = widest_edge(a, b, b_in_a, [tolerance, reach]);
        if best.is_some_and(|s| s.gap > reach) {
            return None;
        }
        if best.is_none_or(|s| s.gap > -tolerance) {
            let corner = nearest_corners(a, b, b_in_a);
            if best.is_none_or(|s| corner.gap > s.gap + tolerance) {
                best = Some(corner);
            }
        }
        best.filter(|s| s.gap <= reach)
    }
    fn together(
        a: Swept<Self>,
        b: Swept<Self>,
        margin: f64,
        apart: &mut f64,
        out: &mut Vec<ContactPoint<Self>>,
    ) -> bool {
        if !Self::go_abreast(a.core, b.core) {
            return polygons::contacts(&a, &b, margin, apart, out);
        }
        let [told, ..] = Self::abreast(&[Beside { swept: [a, b], margin }], out);
        *apart = apart.max(told.apart);
        true
    }
    #[inline]
    fn go_abreast(a: &PlanarCore, b: &PlanarCore) -> bool {
        half_of(a).is_some() && half_of(b).is_some()
    }
    fn abreast(pairs: &[Beside<'_, Self>], out: &mut Vec<ContactPoint<Self>>) -> [Told; ABREAST] {
        planar_boxes::contacts(pairs, out)
    }
    fn manifold(
        a: &PlanarCore,
        b: &PlanarCore,
        b_in_a: &Pose<Planar>,
        found: &Separation<Planar>,
        witnessed: bool,
        reach: f64,
        out: &mut Touches<Planar>,
    ) {
        out.clear();
        let scale = scale::<Planar>(a, b, b_in_a);
        facing_edges(a, b, b_in_a, found.normal, scale, out);
        let lowest = out.iter().fold(f64::INFINITY, |m, t| m.min(t.gap));
        if witnessed && lowest > found.gap + 1e-12 * scale {
            beside_witness(found, out);
        }
        out.retain(|t| t.gap <= reach);
    }
}

/// Puts the witnesses of a direction beside the deeper of two ends.
fn beside_witness(found: &Separation<Planar>, out: &mut Touches<Planar>) {
    let Separation { normal, gap, on_a, on_b, label } = *found;
    if out.len() == 2 {
        if out[0].gap > out[1].gap {
            out[0] = out[1];
        }
        out.truncate(1);
    }
    out.push(Touch { normal, gap, on_a, on_b, label });
}

fn farthest(corners: &[Vec2], direction: Vec2) -> usize {
    let mut best = (0, direction.dot(corners[0]));
    for (i, p) in corners.iter().enumerate().skip(1) {
        let along = direction.dot(*p);
        if along > best.1 {
            best = (i, along);
        }
    }
    best.0
}

/// The edge normal of either core with the largest s(n), or the first beyond `reach` \[m\]; a's edges win ties. An edge
/// is tried only where no corner that another edge met rules it out.
fn widest_edge(
    a: &PlanarCore,
    b: &PlanarCore,
    b_in_a: &Pose<Planar>,
    [tolerance, reach]: [f64; 2],
) -> Option<Separation<Planar>> {
    let mut best: Option<Separation<Planar>> = None;
    // below the one an edge is ruled out, rounding and all; beyond the other it is better
    let (mut least, mut beyond) = (f64::NEG_INFINITY, f64::NEG_INFINITY);
    let (corners_a, corners_b) = (a.corners(), b.corners());
    let mut met: Option<Vec2> = None;
    for (i, &m) in a.normals().iter().enumerate() {
        if met.is_some_and(|corner| m.dot(corner - corners_a[i]) <= least) {
            continue;
        }
        let local = b_in_a.rotation.unrotate(m);
        let j = farthest(corners_b, -local);
        let on_b = b_in_a.to_world(corners_b[j]);
        met = Some(on_b);
        let gap = m.dot(on_b - corners_a[i]);
        if gap > beyond {
            (least, beyond) = (gap - tolerance, gap + tolerance);
            let next = (i + 1) % corners_a.len();
            let label = Label { a: [i as u32, next as u32], b: [j as u32, NONE] };
            best = Some(Separation { normal: -m, gap, on_a: on_b - m * gap, on_b, label });
            if gap > reach {
                return best;
            }
        }
    }
    let mut met = best.map(|s| b_in_a.to_body(corners_a[s.label.a[0] as usize]));
    for (j, &local) in b.normals().iter().enumerate() {
        if met.is_some_and(|corner| local.dot(corner - corners_b[j]) <= least) {
            continue;
        }
        let m = b_in_a.rotation.rotate(local);
        let i = farthest(corners_a, -m);
        met = Some(b_in_a.to_body(corners_a[i]));
        let gap = m.dot(corners_a[i] - b_in_a.to_world(corners_b[j]));
        if gap > beyond {
            (least, beyond) = (gap - tolerance, gap + tolerance);
            let next = (j + 1) % corners_b.len();
            let label = Label { a: [i as u32, NONE], b: [j as u32, next as u32] };
            best =
                Some(Separation { normal: m, gap, on_a: corners_a[i], on_b: corners_a[i] - m * gap, label });
            if gap > reach {
                return best;
            }
        }
    }
    best
}

/// The two corners nearest to each other. Coincident corners get the fixed normal y of a's frame.
fn nearest_corners(a: &PlanarCore, b: &PlanarCore, b_in_a: &Pose<Planar>) -> Separation<Planar> {
    let mut best = (f64::INFINITY, 0, 0, Vec2::ZERO, Vec2::ZERO);
    for (j, &local) in b.corners().iter().enumerate() {
        let on_b = b_in_a.to_world(local);
        for (i, &on_a) in a.corners().iter().enumerate() {
            let squared = (on_a - on_b).norm_squared();
            if squared < best.0 {
                best = (squared, i, j, on_a, on_b);
            }
        }
    }
    let (_, i, j, on_a, on_b) = best;
    let apart = on_a - on_b;
    let normal = apart.normalized().unwrap_or(carom_math::vec2(0.0, 1.0));
    let label = Label::vertices(i as u32, j as u32);
    // corners that are nearest without being the nearest points overstate the gap: judge by s(n)
    let gap = Planar::along(a, b, b_in_a, normal).gap;
    Separation { normal, gap, on_a, on_b, label }
}

/// One end of an edge: place along the tangent, corner, name.
pub type End = (f64, Vec2, u32);

/// Ends of the overlap, as seen along the normal, of the edges that face each other.
fn facing_edges(
    a: &PlanarCore,
    b: &PlanarCore,
    b_in_a: &Pose<Planar>,
    normal: Vec2,
    scale: f64,
    out: &mut Touches<Planar>,
) {
    let tangent = normal.perp();
    let (corners_a, corners_b) = (a.corners(), b.corners());
    let edge_a = a.edge_toward(-normal).unwrap_or((0, 0));
    let edge_b = b.edge_toward(b_in_a.rotation.unrotate(normal)).unwrap_or((0, 0));
    let end = |p: Vec2, name: usize| -> End { (tangent.dot(p), p, name as u32) };
    let of_a = |i: usize| end(corners_a[i], i);
    let of_b = |j: usize| end(b_in_a.to_world(corners_b[j]), j);
    let ends = [[of_a(edge_a.0), of_a(edge_a.1)], [of_b(edge_b.0), of_b(edge_b.1)]];
    between_ends(ends, normal, SAME_END * scale, |t| out.push(t));
}

/// Tells the ends of the overlap of two edges as seen along the normal from b to a, none where they are more than `same`
/// \[m\] beside each other; true where they are not beside each other at all.
#[inline(always)]
pub fn between_ends(
    [of_a, of_b]: [[End; 2]; 2],
    normal: Vec2,
    same: f64,
    mut tell: impl FnMut(Touch<Planar>),
) -> bool {
    // an edge along the normal shows only the end that comes first
    let sorted = |[p, q]: [End; 2], toward: Vec2| -> [End; 2] {
        if (p.0 - q.0).abs() <= same {
            if toward.dot(p.1) >= toward.dot(q.1) { [p, p] } else { [q, q] }
        } else if p.0 < q.0 {
            [p, q]
        } else {
            [q, p]
        }
    };
    let (on_a, on_b) = (sorted(of_a, -normal), sorted(of_b, normal));
    let low = on_a[0].0.max(on_b[0].0);
    let high = on_a[1].0.min(on_b[1].0);
    if low > high + same {
        return false;
    }
    let touch = |at: f64| {
        let name = |e: &[End; 2]| match ((e[0].0 - at).abs() <= same, (e[1].0 - at).abs() <= same) {
            (true, _) => [e[0].2, NONE],
            (_, true) => [e[1].2, NONE],
            _ => [NONE, NONE],
        };
        let (p, q) = (at_place(&on_a, at), at_place(&on_b, at));
        let label = Label { a: name(&on_a), b: name(&on_b) };
        Touch { normal, gap: normal.dot(p - q), on_a: p, on_b: q, label }
    };
    tell(touch(low));
    if high > low + same {
        tell(touch(high));
    }
    low <= high
}

/// Point of an edge at a place along the tangent; exact at its ends.
#[inline(always)]
fn at_place(ends: &[End; 2], at: f64) -> Vec2 {
    let [(low, p, _), (high, q, _)] = *ends;
    if at <= low || high <= low {
        p
    } else if at >= high {
        q
    } else {
        p + (q - p) * ((at - low) / (high - low))
    }
}
