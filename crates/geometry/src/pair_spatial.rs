//! Contact of two convex cores of space: the direction comes from `separate`, the points are the corners of the
//! overlap of the two faces that look at each other along it. Knows no radii and no composite shapes.

use crate::boxes::bounds_of_box;
use crate::clip::{Patch, overlap};
use crate::collider::reach_box;
use crate::core_spatial::SpatialCore;
use crate::geometry::{ABREAST, Aabb, ContactPoint, Guess, Told};
use crate::kernel::{Beside, Kernel, Label, NONE, Ring, Separation, Swept, Touch, Touches};
use crate::polytope::triangle_normal;
use crate::separate::Pair;
use crate::spread::{Places, spread};
use crate::two_boxes::{self, half_of};
use carom_math::{Column, Pose, Spatial, Vec3};

/// Corners this close to a side count as inside, as a fraction of the scale \[1\].
pub const SAME_SIDE: f64 = 1e-7;
/// Depths this close are one, as a fraction of the scale \[1\].
const SAME_DEPTH: f64 = 1e-9;
/// Straight edges closer to parallel than this touch in two points \[rad\].
const PARALLEL: f64 = 1e-2;
/// Capsules closer to parallel than this get a contact at each end of their overlap \[rad\].
const ALONGSIDE: f64 = 0.2;

impl Kernel for Spatial {
    type Core = SpatialCore;
    const PATCH: usize = 4;
    fn facet(corners: &[Vec3]) -> SpatialCore {
        SpatialCore::triangle([corners[0], corners[1], corners[2]])
    }
    fn dot(point: Vec3) -> SpatialCore {
        SpatialCore::Point([point])
    }
    fn only_point(core: &SpatialCore) -> Option<Vec3> {
        if let SpatialCore::Point([p]) = core { Some(*p) } else { None }
    }
    fn facet_normal(corners: &[Vec3]) -> Vec3 {
        triangle_normal(corners)
    }
    fn facet_outward(corners: &[Vec3], k: usize) -> Vec3 {
        let edge = corners[(k + 1) % 3] - corners[k];
        edge.cross(triangle_normal(corners)).normalized().unwrap_or(Vec3::ZERO)
    }
    fn support(core: &SpatialCore, direction: Vec3) -> (Vec3, u32) {
        core.support(direction)
    }
    fn bounds_of(core: &SpatialCore, pose: &Pose<Spatial>) -> Aabb<Spatial> {
        match core {
            SpatialCore::Polytope(p) => match p.half {
                Some(half) => bounds_of_box(half, pose),
                None => {
                    let spans = p.spans(&pose.rotation.matrix());
                    let at = |k: usize| Vec3::from_fn(|i| pose.position[i] + spans[i][k]);
                    Aabb { min: at(0), max: at(1) }
                }
            },
            _ => reach_box(pose, |d| core.support(d).0),
        }
    }
    fn is_curved(core: &SpatialCore) -> bool {
        matches!(core, SpatialCore::Round(_))
    }
    fn size(core: &SpatialCore) -> f64 {
        core.size()
    }
    fn corners(core: &SpatialCore, from: Vec3, out: &mut Ring<Spatial>) {
        core.corners(from, out);
    }
    fn feature(core: &SpatialCore, direction: Vec3, out: &mut Ring<Spatial>) {
        let first = out.len();
        core.feature(direction, out);
        let deepest = core.support(direction);
        let reached = out[first..].iter().fold(f64::NEG_INFINITY, |m, p| m.max(direction.dot(p.0)));
        if direction.dot(deepest.0) > reached + 1e-14 * core.size() {
            out.push(deepest);
        }
    }
    fn separation(
        a: &SpatialCore,
        b: &SpatialCore,
        b_in_a: &Pose<Spatial>,
        reach: f64,
        guess: &mut Guess<Spatial>,
    ) -> Option<Separation<Spatial>> {
        Pair::new(a, b, b_in_a).separation_near(reach, guess)
    }
    fn together(
        a: Swept<Self>,
        b: Swept<Self>,
        margin: f64,
        apart: &mut f64,
        out: &mut Vec<ContactPoint<Self>>,
    ) -> bool {
        if !Self::go_abreast(a.core, b.core) {
            return false;
        }
        let [told, ..] = Self::abreast(&[Beside { swept: [a, b], margin }], out);
        *apart = apart.max(told.apart);
        true
    }
    #[inline]
    fn go_abreast(a: &SpatialCore, b: &SpatialCore) -> bool {
        half_of(a).is_some() && half_of(b).is_some()
    }
    fn abreast(pairs: &[Beside<'_, Self>], out: &mut Vec<ContactPoint<Self>>) -> [Told; ABREAST] {
        two_boxes::contacts(pairs, out)
    }
    fn manifold(
        a: &SpatialCore,
        b: &SpatialCore,
        b_in_a: &Pose<Spatial>,
        found: &Separation<Spatial>,
        witnessed: bool,
        reach: f64,
        out: &mut Touches<Spatial>,
    ) {
        let pair = Pair::new(a, b, b_in_a);
        out.clear();
        match (a, b) {
            (SpatialCore::Point(_), SpatialCore::Point(_)) => {}
            (SpatialCore::Segment(p), SpatialCore::Segment(q)) => {
                alongside(*p, q.map(|x| pair.point_in_a(x)), found.normal, out);
                drop_twins(out, SAME_SIDE * pair.scale);
            }
            _ => facing_patches(&pair, found.normal, out),
        }
        lift(out, found.gap);
        if witnessed {
            deepest_is_found(out, found, pair.scale);
        }
        keep_few(out, found.normal, reach);
    }
}

/// Nothing is deeper than the farthest points, at a gap \[m\]: less comes from corners let in by the slack.
fn lift(out: &mut Touches<Spatial>, gap: f64) {
    for t in out.iter_mut() {
        let lift = (gap - t.gap).max(0.0);
        (t.gap, t.on_a) = (t.gap + lift, t.on_a + t.normal * lift);
    }
}

/// Leaves out touches beyond `reach` \[m\] and keeps a few of many.
fn keep_few(out: &mut Touches<Spatial>, normal: Vec3, reach: f64) {
    out.retain(|t| t.gap <= reach);
    if out.len() > Spatial::PATCH {
        let mut places = Places::<Vec3>::default();
        places.extend(out.iter().map(|t| ((t.on_a + t.on_b) * 0.5, t.gap)));
        let kept = spread::<Spatial>(&places, normal, Spatial::PATCH);
        for (k, &i) in kept.iter().enumerate() {
            out[k] = out[i];
        }
        out.truncate(kept.len());
    }
}

/// Makes the deepest touch as deep as the separation found: the lowest one where only rounding is missing, else
/// the witnesses, in place of a touch that stands where they do.
fn deepest_is_found(touches: &mut Touches<Spatial>, found: &Separation<Spatial>, scale: f64) {
    let Separation { normal, gap, on_a, on_b, label } = *found;
    let witness = Touch { normal, gap, on_a, on_b, label };
    match touches.iter_mut().reduce(|best, t| if t.gap < best.gap { t } else { best }) {
        Some(lowest) if lowest.gap <= gap + SAME_DEPTH * scale => {
            lowest.on_a += lowest.normal * (gap - lowest.gap);
            lowest.gap = gap;
        }
        _ => match touches.iter_mut().find(|t| (t.on_b - on_b).norm() <= 10.0 * SAME_SIDE * scale) {
            Some(twin) => *twin = Touch { label: twin.label, ..witness },
            None => touches.push(witness),
        },
    }
}

/// The faces, edges or corners of the two cores that look at each other along a normal, and their overlap.
fn facing_patches(pair: &Pair, normal: Vec3, out: &mut Touches<Spatial>) {
    let (mut of_a, mut of_b) = (Patch::default(), Patch::default());
    of_a.plane = pair.a.feature(-normal, &mut of_a.ring);
    of_b.plane = pair.b.feature(pair.to_frame_b(normal), &mut of_b.ring).map(|m| pair.to_frame_a(m));
    of_b.ring.iter_mut().for_each(|p| p.0 = pair.point_in_a(p.0));
    let slack = SAME_SIDE * pair.scale;
    let lean = |patch: &Patch, toward: Vec3| patch.plane.map_or(-1.0, |m| m.dot(toward));
    let (lean_a, lean_b) = (lean(&of_a, -normal), lean(&of_b, normal));
    // b is cut by a unless only b has a face, or clearly the better aligned one: rounding must not swap labels
    if of_b.ring.len() == 1 && of_a.plane.is_none() || of_a.ring.len() == 1 && of_b.plane.is_none() {
        return; // a corner on an edge or on a corner: the witnesses say it all
    }
    match (of_a.plane, of_b.plane) {
        (None, None) => crossing_edges(&of_a, &of_b, normal, slack, out),
        (Some(plane), _) if lean_a >= lean_b - 1e-4 || of_b.plane.is_none() => {
            overlap(&of_b, &of_a, -normal, slack, |m| {
                let on_a = m.point + normal * (plane.dot(of_a.ring[0].0 - m.point) / plane.dot(normal));
                let label = Label { a: m.label.b, b: m.label.a };
                out.push(Touch { normal, gap: normal.dot(on_a - m.point), on_a, on_b: m.point, label });
            });
        }
        (_, Some(plane)) => {
            overlap(&of_a, &of_b, normal, slack, |m| {
                let on_b = m.point + normal * (plane.dot(of_b.ring[0].0 - m.point) / plane.dot(normal));
                let gap = normal.dot(m.point - on_b);
                out.push(Touch { normal, gap, on_a: m.point, on_b, label: m.label });
            });
        }
        (Some(_), None) => {}
    }
    drop_twins(out, slack);
}

/// Removes meetings that stand on an earlier one.
fn drop_twins(out: &mut Touches<Spatial>, slack: f64) {
    let (all, squared, mut kept): (&mut [Touch<Spatial>], _, _) = (out, slack * slack, 0);
    for k in 0..all.len() {
        let at = all[k].on_b;
        if all[..kept].iter().all(|t| (t.on_b - at).norm_squared() > squared) {
            if kept < k {
                all[kept] = all[k];
            }
            kept += 1;
        }
    }
    out.truncate(kept);
}

/// Two straight edges as seen along a normal: one point where they cross, two where they run side by side.
fn crossing_edges(of_a: &Patch, of_b: &Patch, normal: Vec3, slack: f64, out: &mut Touches<Spatial>) {
    let [(p, i), (q, j)] = [of_a.ring[0], of_a.ring[1]];
    let [(r, k), (s, l)] = [of_b.ring[0], of_b.ring[1]];
    let (u, v) = (q - p, s - r);
    let label = Label { a: [i, j], b: [k, l] };
    let sine = normal.dot(u.cross(v)) / (u.norm() * v.norm());
    if sine.abs() > PARALLEL {
        // in the plane across the normal: p + x u = r + y v
        let area = normal.dot(u.cross(v));
        let (x, y) = (normal.dot((r - p).cross(v)) / area, normal.dot((r - p).cross(u)) / area);
        let (ex, ey) = (slack / u.norm(), slack / v.norm());
        if (-ex..=1.0 + ex).contains(&x) && (-ey..=1.0 + ey).contains(&y) {
            let (on_a, on_b) = (p + u * x.clamp(0.0, 1.0), r + v * y.clamp(0.0, 1.0));
            out.push(Touch { normal, gap: normal.dot(on_a - on_b), on_a, on_b, label });
        }
        return;
    }
    let along = (u - normal * normal.dot(u)) * (1.0 / u.norm());
    let place = |x: Vec3| along.dot(x - p);
    let (b_low, b_high) = (place(r).min(place(s)), place(r).max(place(s)));
    let (low, high) = (b_low.max(0.0), b_high.min(place(q)));
    let at = |start: Vec3, edge: Vec3, t: f64| {
        let (x, y) = (place(start), place(start + edge));
        start + edge * ((t - x) / (y - x)).clamp(0.0, 1.0)
    };
    let mut push = |t: f64, end: u32| {
        let (on_a, on_b) = (at(p, u, t), at(r, v, t));
        let label = Label { a: label.a, b: [label.b[0], label.b[1] ^ (end << 31)] };
        out.push(Touch { normal, gap: normal.dot(on_a - on_b), on_a, on_b, label });
    };
    if low <= high + slack {
        push(low, 0);
        if high > low + slack {
            push(high, 1);
        }
    }
}

/// Two segments nearly side by side: at each end of their overlap the nearest points, with a normal of their
/// own, because the surfaces that sweep them are round.
fn alongside(a: [Vec3; 2], b: [Vec3; 2], normal: Vec3, out: &mut Touches<Spatial>) {
    let (u, v) = (a[1] - a[0], b[1] - b[0]);
    if u.cross(v).norm() > ALONGSIDE * u.norm() * v.norm() {
        return;
    }
    let mut push = |on_a: Vec3, on_b: Vec3, label: Label| {
        let apart = on_a - on_b;
        if let Some(unit) = apart.normalized() {
            let sign = if unit.dot(normal) < 0.0 { -1.0 } else { 1.0 };
            out.push(Touch { normal: unit * sign, gap: sign * apart.norm(), on_a, on_b, label });
        }
    };
    let inside = |x: Vec3, start: Vec3, edge: Vec3| {
        let t = (x - start).dot(edge) / edge.norm_squared();
        (-SAME_SIDE..=1.0 + SAME_SIDE).contains(&t).then(|| start + edge * t.clamp(0.0, 1.0))
    };
    for (i, &end) in a.iter().enumerate() {
        if let Some(foot) = inside(end, b[0], v) {
            push(end, foot, Label { a: [i as u32, NONE], b: [0, 1] });
        }
    }
    for (i, &end) in b.iter().enumerate() {
        if let Some(foot) = inside(end, a[0], u) {
            push(foot, end, Label { a: [0, 1], b: [i as u32, NONE] });
        }
    }
}
