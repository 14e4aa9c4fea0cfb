//! Closest points and rays. A ray meets a rounded convex piece at the root of g(t), the signed distance of the
//! point origin + t direction: g is convex, so Newton's steps t += g / (-n.direction) come from outside, never
//! pass the surface and stop on it after one step per flat face. Knows no bodies.

use crate::collider::{Collider, Leaf, Piece, Query, leaves, reach_box};
use crate::geometry::{Aabb, Closest, Guess, RayHit};
use crate::kernel::{Kernel, Touches};
use crate::wall::{Facing, Wall};
use carom_math::{Column, Pose, Rotation};
use std::cell::Cell;

/// Newton steps of a ray; grazing rays halve their gap per step.
const STEPS: usize = 64;
/// A ray is on the surface when the gap is below this fraction of the distances involved \[1\].
const ON_SURFACE: f64 = 4e-15;

/// Closest points of two posed colliders when their gap is at most `reach` \[m\].
pub(crate) fn closest<S: Kernel>(
    a: &Collider<S>,
    pose_a: &Pose<S>,
    b: &Collider<S>,
    pose_b: &Pose<S>,
    reach: f64,
) -> Option<Closest<S>> {
    let limit = Cell::new(reach);
    let mut best: Option<Closest<S>> = None;
    let mut offer = |found: Option<Closest<S>>| {
        if let Some(c) = found.filter(|c| c.gap <= reach && best.as_ref().is_none_or(|b| c.gap < b.gap)) {
            limit.set(c.gap.max(0.0));
            best = Some(c);
        }
    };
    let box_of_b = |frame: &Pose<S>| b.bounds(&frame.inverse().compose(pose_b), 0.0);
    leaves(a, pose_a, 0, &Query { box_in: &box_of_b, limit: &limit }, &mut |leaf_a| {
        let box_of_a = |frame: &Pose<S>| match &leaf_a {
            Leaf::Wall(..) => a.bounds(&frame.inverse().compose(pose_a), 0.0),
            Leaf::Piece(p) => piece_box(p, frame),
        };
        leaves(b, pose_b, 0, &Query { box_in: &box_of_a, limit: &limit }, &mut |leaf_b| {
            offer(match (&leaf_a, &leaf_b) {
                (Leaf::Wall(..), Leaf::Wall(..)) => None,
                (Leaf::Wall(wall, _), Leaf::Piece(p)) => Some(swapped(on_wall(p, wall))),
                (Leaf::Piece(p), Leaf::Wall(wall, _)) => Some(on_wall(p, wall)),
                (Leaf::Piece(p), Leaf::Piece(q)) => nearest(p, q, limit.get()),
            });
        });
    });
    best
}

fn piece_box<S: Kernel>(piece: &Piece<S>, frame: &Pose<S>) -> Aabb<S> {
    let place = frame.inverse().compose(&piece.pose);
    reach_box(&place, |d| S::support(piece.core, d).0).grown(piece.radius)
}

fn swapped<S: Kernel>(c: Closest<S>) -> Closest<S> {
    Closest { point_a: c.point_b, point_b: c.point_a, normal: -c.normal, gap: c.gap }
}

/// Closest points of a piece (a) and a wall (b).
fn on_wall<S: Kernel>(piece: &Piece<S>, wall: &Wall<S>) -> Closest<S> {
    let turned = piece.pose.rotation.rotate(wall.nearest_of(piece.core, &piece.pose));
    let Facing { gap, outward: normal, .. } = wall.facing(turned + (piece.pose.position - wall.origin()));
    let gap = gap - piece.radius;
    let point_a = piece.pose.position + turned - normal * piece.radius;
    Closest { point_a, point_b: point_a - normal * gap, normal, gap }
}

/// Closest points of two pieces: the deepest of the points where their faces meet.
fn nearest<S: Kernel>(a: &Piece<S>, b: &Piece<S>, reach: f64) -> Option<Closest<S>> {
    let place = a.pose.inverse().compose(&b.pose);
    let radii = a.radius + b.radius;
    let found = S::separation(a.core, b.core, &place, reach + radii, &mut Guess::default())?;
    let mut touches = Touches::<S>::default();
    S::manifold(a.core, b.core, &place, &found, true, f64::INFINITY, &mut touches);
    let deepest = touches.iter().copied().reduce(|best, t| if t.gap < best.gap { t } else { best })?;
    Some(Closest {
        point_a: a.pose.to_world(deepest.on_a - deepest.normal * a.radius),
        point_b: a.pose.to_world(deepest.on_b + deepest.normal * b.radius),
        normal: a.pose.rotation.rotate(deepest.normal),
        gap: deepest.gap - radii,
    })
}

/// First hit of a ray with a posed collider.
pub(crate) fn raycast<S: Kernel>(
    collider: &Collider<S>,
    pose: &Pose<S>,
    origin: S::Vector,
    direction: S::Vector,
    reach: f64,
) -> Option<RayHit<S>> {
    let mut best: Option<RayHit<S>> = None;
    let mut limit = reach;
    cast(collider, pose, origin, direction, &mut limit, &mut best);
    best
}

fn cast<S: Kernel>(
    collider: &Collider<S>,
    pose: &Pose<S>,
    origin: S::Vector,
    direction: S::Vector,
    limit: &mut f64,
    best: &mut Option<RayHit<S>>,
) {
    use crate::collider::Form;
    let local = (pose.to_body(origin), pose.rotation.unrotate(direction));
    let mut offer = |hit: Option<RayHit<S>>, limit: &mut f64| {
        if let Some(hit) =
            hit.filter(|h| h.distance <= *limit && best.is_none_or(|b| h.distance < b.distance))
        {
            *limit = hit.distance;
            *best = Some(RayHit { normal: pose.rotation.rotate(hit.normal), ..hit });
        }
    };
    match &*collider.form {
        Form::HalfSpace(normal) => offer(wall_hit(*normal, local.0, local.1), limit),
        Form::Cavity(radius) => offer(hollow_hit(*radius, local.0, local.1), limit),
        Form::Convex(core, radius) => offer(piece_hit(core, *radius, local.0, local.1, *limit), limit),
        Form::Surface(surface) => surface.tree.along(local.0, local.1, *limit, |i| {
            offer(piece_hit(&surface.facet(i).core(), 0.0, local.0, local.1, *limit), limit);
            *limit
        }),
        Form::Compound(all) => {
            let mut part = |i: usize| {
                let (inner, part) = &all.parts[i];
                cast(part, &pose.compose(inner), origin, direction, limit, best);
                *limit
            };
            for &i in &all.unbounded {
                part(i);
            }
            all.tree.along(local.0, local.1, f64::INFINITY, |k| part(all.bounded[k]));
        }
    }
}

fn wall_hit<S: Kernel>(normal: S::Vector, origin: S::Vector, direction: S::Vector) -> Option<RayHit<S>> {
    let (height, approach) = (normal.dot(origin), -normal.dot(direction));
    if height <= 0.0 {
        return Some(RayHit { distance: 0.0, normal });
    }
    (approach > 0.0).then(|| RayHit { distance: height / approach, normal })
}

/// Where a ray leaves a cavity about the origin: the larger root of |origin + t direction|^2 = radius^2.
fn hollow_hit<S: Kernel>(radius: f64, origin: S::Vector, direction: S::Vector) -> Option<RayHit<S>> {
    let distance = origin.norm();
    if distance >= radius {
        return Some(RayHit { distance: 0.0, normal: origin * (-1.0 / distance) });
    }
    let (a, b, c) = (direction.dot(direction), origin.dot(direction), distance * distance - radius * radius);
    let root = (b * b - a * c).sqrt();
    // of the two forms of the root the one without a difference of like numbers
    let t = if b > 0.0 { -c / (b + root) } else { (root - b) / a };
    let hit = origin + direction * t;
    t.is_finite().then(|| RayHit { distance: t, normal: hit * (-1.0 / hit.norm()) })
}

/// First hit with a rounded convex core, in the core's frame.
fn piece_hit<S: Kernel>(
    core: &S::Core,
    radius: f64,
    origin: S::Vector,
    direction: S::Vector,
    reach: f64,
) -> Option<RayHit<S>> {
    let mut t = 0.0;
    let mut previous: Option<S::Vector> = None;
    for step in 0..STEPS {
        let point = origin + direction * t;
        let found =
            S::separation(&S::dot(point), core, &Pose::default(), f64::INFINITY, &mut Guess::default())?;
        let gap = found.gap - radius;
        let scale = point.norm() + S::size(core) + radius;
        let next = t + gap / -found.normal.dot(direction);
        // a grazing ray may stall above the tolerance when a step is below the resolution of t
        let stalled = gap <= 1e-9 * scale && (next == t || step + 1 == STEPS);
        if gap <= ON_SURFACE * scale || stalled {
            // on a sharp core the last step left no direction: the face that led here has it
            let sharp = found.gap <= 1e-9 * scale;
            return Some(RayHit { distance: t, normal: previous.filter(|_| sharp).unwrap_or(found.normal) });
        }
        if next < t || next > reach || next.is_nan() {
            return None;
        }
        t = next;
        previous = Some(found.normal);
    }
    None
}
