//! Contact points of boxes of space, rounded or not, four pairs at a time: the direction by closed forms (see `box_axes`), the
//! points where the faces overlap that look at each other along it (see `box_faces`). Says what `pair_spatial` says, but for
//! rounding; a pair has the same bits whoever is looked at beside it. Knows no composite shapes.

use crate::abreast::four_of;
use crate::box_axes::{Best, BestEdges, Boxes, Record, choose};
use crate::box_faces::{Overlap, Overlaps, Spot};
use crate::box_names::{CORNERS, CROSSINGS, names};
use crate::core_spatial::SpatialCore;
use crate::geometry::{ABREAST, ContactPoint, Told};
use crate::kernel::{Beside, Kernel};
use crate::overlap::BIAS;
use crate::pair_spatial::SAME_SIDE;
use crate::separate::NEAR;
use crate::spread::{Kept, Places, spread};
use carom_math::lanes::{Four, Job, Lanes, dispatch};
use carom_math::{Column, Planar, Spatial, Vec2, Vec3, vec2};

/// Depths this close are one, as a fraction of the scale \[1\].
const SAME_DEPTH: f64 = 1e-14;
/// A normal that leans less than this along a face is the face's \[1\].
const STRAIGHT: f64 = 1e-9;

/// Half sides of a box \[m\]; `None` of other cores.
#[inline]
pub fn half_of(core: &SpatialCore) -> Option<Vec3> {
    if let SpatialCore::Polytope(polytope) = core { polytope.half } else { None }
}

/// The numbers of a pair.
#[inline(always)]
fn record(pair: &Beside<'_, Spatial>) -> Record {
    let [a, b] = &pair.swept;
    // the difference of positions first: far from the world's origin it is small and exact
    let d = b.pose.position - a.pose.position;
    let half = |core| half_of(core).map_or([0.0; 4], |h| [h[0], h[1], h[2], 0.0]);
    Record {
        between: [d[0], d[1], d[2], pair.margin + a.radius + b.radius],
        turns: [a.pose.rotation.0, b.pose.rotation.0],
        halves: [half(a.core), half(b.core)],
    }
}

/// Appends the contact points of up to four pairs of boxes, one after another, with names that are distinct within each.
pub fn contacts(pairs: &[Beside<'_, Spatial>], out: &mut Vec<ContactPoint<Spatial>>) -> [Told; ABREAST] {
    let mut told = [Told::nothing(out.len()); ABREAST];
    if let Some(records) = four_of(pairs, record) {
        dispatch(Tell { pairs, records: &records, overlaps: &mut Overlaps::default(), told: &mut told, out });
    }
    told
}

/// Tells of the contacts of four pairs.
struct Tell<'a, 'b> {
    pairs: &'a [Beside<'a, Spatial>],
    records: &'a [Record; ABREAST],
    overlaps: &'b mut Overlaps,
    told: &'b mut [Told; ABREAST],
    out: &'b mut Vec<ContactPoint<Spatial>>,
}

impl Job for Tell<'_, '_> {
    type Output = ();
    #[inline(always)]
    fn work<L: Lanes>(self, lanes: L) {
        let Tell { pairs, records, overlaps, told, out } = self;
        let found = find(&Boxes::of(lanes, records), overlaps);
        for (lane, pair) in pairs.iter().enumerate().take(ABREAST) {
            let mut apart = f64::NEG_INFINITY;
            if found.beyond >> lane & 1 == 1 {
                apart = found.apart[lane] - (pair.swept[0].radius + pair.swept[1].radius);
            } else if overlaps.any() {
                tell(pair, overlaps.of(lane), out);
            }
            told[lane] = Told { end: out.len(), apart };
        }
    }
}

/// Which of four pairs are apart, bit by bit, and how far at least \[m\].
struct Found {
    beyond: u32,
    apart: [f64; 4],
}

/// Finds the overlaps of four pairs, and which are apart.
#[inline(always)]
fn find<F: Four>(boxes: &Boxes<F>, overlaps: &mut Overlaps) -> Found {
    const ALL: u32 = (1 << ABREAST) - 1;
    let (scale, reach, face) = (boxes.scale, boxes.reach, boxes.best_face());
    let mut beyond = reach.less(face.gap);
    if beyond == ALL {
        return Found { beyond, apart: face.gap.store() };
    }
    let [bias, near] = [scale.like(BIAS) * scale, scale.like(NEAR) * scale];
    let edges = boxes.best_edges();
    let both = face.or(edges.best, bias);
    beyond |= reach.less(edges.best.gap);
    // what a pair is told does not depend on those beside it
    let mut apart = reach.if_less(face.gap, face.gap, edges.best.gap);
    if beyond == ALL {
        return Found { beyond, apart: apart.store() };
    }
    // where faces are apart and a corner stands over the face of the other, the face has the last word
    let best = Best {
        normal: choose(near, face.gap, &face.normal, &both.normal),
        gap: near.if_less(face.gap, face.gap, both.gap),
    };
    let nearest = boxes.overlap(&best.normal, best.gap, SAME_SIDE, overlaps);
    let level = best.gap + scale.like(SAME_DEPTH) * scale;
    let open = near.less(best.gap) & level.less(nearest) & !beyond;
    if open != 0 {
        let other = nearest_features(boxes, &edges, near);
        // what is open: apart, and nothing over the face as near as that. What is over the face is no farther than it is seen to be:
        // features that are, leave out edges that are all but parallel
        let normal = choose(other.gap, nearest, &other.normal, &best.normal);
        let gap = other.gap.if_less(nearest, other.gap, best.gap);
        let normal = choose(level, nearest, &normal, &best.normal);
        let gap = level.if_less(nearest, gap, best.gap);
        let gap = near.if_less(best.gap, gap, best.gap);
        let normal = choose(near, best.gap, &normal, &best.normal);
        apart = reach.if_less(apart, apart, gap);
        beyond |= reach.less(gap);
        if open & !beyond != 0 {
            boxes.overlap(&normal, gap, SAME_SIDE, overlaps);
        }
    }
    Found { beyond, apart: apart.store() }
}

/// The direction between the nearest edges or corners of boxes that are apart.
#[inline(always)]
fn nearest_features<F: Four>(boxes: &Boxes<F>, edges: &BestEdges<F>, near: F) -> Best<F> {
    let (corner, inside) = (boxes.nearest_corner(), boxes.pass_inside(edges));
    // edges that pass each other are as near as the boxes
    let by_edges = near.if_less(edges.best.gap, inside, inside.like(0.0));
    let half = inside.like(0.5);
    Best {
        normal: choose(half, by_edges, &edges.best.normal, &corner.normal),
        gap: half.if_less(by_edges, edges.best.gap, corner.gap),
    }
}

/// Appends the contact points of a pair.
#[inline(always)]
fn tell(pair: &Beside<'_, Spatial>, overlap: Overlap<'_>, out: &mut Vec<ContactPoint<Spatial>>) {
    let [a, b] = &pair.swept;
    let ([along_u, along_v, normal, way], slack) = (overlap.frame, overlap.slack);
    // from the face that cuts halfway to the other surface
    let (knife, toward, bulge) =
        if overlap.by_a { (a, -0.5, a.radius - b.radius) } else { (b, 0.5, b.radius - a.radius) };
    let names = names(overlap.by_a, overlap.faces);
    let (middle, radii) = (knife.pose.position + way, a.radius + b.radius);
    let (begins, above) = (overlap.begins(), (overlap.faces / 6).is_multiple_of(2));
    let (mut places, mut of_knife) = (Places::<Vec2>::default(), 0_u32);
    let first = out.len();
    for Spot { at: [x, y], gap, name } in overlap {
        // what is told of first stands for what is there too
        if places.iter().any(|(p, _)| (p[0] - x).abs() <= slack && (p[1] - y).abs() <= slack) {
            continue;
        }
        of_knife |= u32::from((CORNERS..CROSSINGS).contains(&name)) << (places.len() % 16);
        places.push((vec2(x, y), gap));
        out.push(ContactPoint {
            feature: names[name % names.len()],
            point: middle + (along_u * x + along_v * y + normal * (toward * (gap + bulge))),
            normal,
            gap: gap - radii,
            curvature: 0.0,
        });
    }
    if places.len() > Spatial::PATCH {
        let kept = if normal.dot(along_u).abs() + normal.dot(along_v).abs() < STRAIGHT {
            // as they lie on the face, whose plane has no part along the normal
            spread::<Planar>(&places, Vec2::ZERO, Spatial::PATCH)
        } else {
            aslant(normal, &out[first..])
        };
        for (k, &i) in kept.iter().enumerate() {
            out[first + k] = out[first + i];
            places[k] = places[i];
        }
        out.truncate(first + kept.len());
    }
    if let &[a, b, c, d] = &places[..out.len() - first] {
        // one after another around the patch, and from where `clip` begins: who solves points in turn hangs on it
        let mut around = [a.0, b.0, c.0, d.0];
        let swapped = out_of_turn(around);
        if let Some(k) = swapped {
            around.swap(k, k + 1);
            out.swap(first + k, first + k + 1);
        }
        let last = if swapped == Some(2) { 2 } else { 3 };
        if places.len() == 4 && of_knife >> last & 1 == 1 && begins_with_last(begins, around, above, slack) {
            out[first..].rotate_right(1);
        }
    }
}

/// Whether `clip`, which takes the sides of the face that cuts one after another, begins with the last of four points, a corner of that
/// face: where the first corner of the face that is cut is beyond a side, and the side leads to this one.
#[inline(always)]
fn begins_with_last(first: Vec2, around: [Vec2; 4], above: bool, slack: f64) -> bool {
    const SIDES: [[(usize, f64); 4]; 2] =
        [[(0, -1.0), (1, 1.0), (0, 1.0), (1, -1.0)], [(1, -1.0), (0, 1.0), (1, 1.0), (0, -1.0)]];
    let half = vec2(around[3][0].abs(), around[3][1].abs());
    let last = SIDES[usize::from(above)].iter().rev().find(|(k, sign)| sign * first[*k] > half[*k] + slack);
    last.is_some_and(|(k, sign)| (sign * around[2][*k] - half[*k]).abs() <= slack)
}

/// The first of two neighbours of four points that change places for all to go around; `None` where they do.
#[inline(always)]
fn out_of_turn([a, b, c, d]: [Vec2; 4]) -> Option<usize> {
    let side = |p: Vec2, q: Vec2, r: Vec2| (q - p)[0] * (r - p)[1] - (q - p)[1] * (r - p)[0];
    if side(a, b, c) * side(a, c, d) >= 0.0 {
        None
    } else if side(a, b, c) * side(a, b, d) < 0.0 {
        Some(1)
    } else {
        Some(2)
    }
}

/// Which few of many points are kept that are seen aslant on the face that cuts.
#[inline(never)]
fn aslant(normal: Vec3, points: &[ContactPoint<Spatial>]) -> Kept {
    let mut places = Places::<Vec3>::default();
    places.extend(points.iter().map(|p| (p.point, p.gap)));
    spread::<Spatial>(&places, normal, Spatial::PATCH)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Guess;
    use crate::kernel::{Swept, Touches, mix};
    use crate::narrow::tests::numbers;
    use crate::polytope::Polytope;
    use carom_math::lanes::Portable;
    use carom_math::{Pose, Quaternion, Rotation, vec3};
    use std::sync::Arc;

    /// Two boxes at a pose each.
    struct Case {
        cores: [SpatialCore; 2],
        radii: [f64; 2],
        poses: [Pose<Spatial>; 2],
        margin: f64,
    }

    impl Case {
        fn pair(&self) -> Beside<'_, Spatial> {
            let swept =
                |k: usize| Swept { core: &self.cores[k], radius: self.radii[k], pose: &self.poses[k] };
            Beside { swept: [swept(0), swept(1)], margin: self.margin }
        }
        /// Length against which what counts as inside is measured \[m\].
        fn scale(&self) -> f64 {
            let apart = (self.poses[1].position - self.poses[0].position).norm();
            self.cores[0].size() + self.cores[1].size() + apart
        }
    }

    /// Boxes from apart to deep in each other; some of them aligned, all but aligned, face on face, edge on edge and corner on corner.
    fn cases(count: usize) -> impl Iterator<Item = Case> {
        const HALVES: [[f64; 3]; 4] = [[0.5, 0.5, 0.5], [0.3, 0.2, 0.6], [4.0, 4.0, 0.5], [0.02, 0.5, 0.5]];
        let solids = HALVES.map(|half| Arc::new(Polytope::cuboid(half)));
        let mut number = numbers();
        (0..count).map(move |k| {
            let mut some = || 0.5 * number();
            let (g, h) = (HALVES[k % 4], HALVES[k / 4 % 4]);
            let hardly = [1e-6, 1e-7, 1e-8, 1e-9, 1e-10][k / 240 % 5];
            let turn = match k / 16 % 5 {
                // all axes alike, about one axis, hardly turned, and any
                0 => Quaternion::IDENTITY,
                1 => Quaternion::from_axis_angle(vec3(0.0, 0.0, 1.0), 6.0 * some()),
                2 => Quaternion::about(vec3(hardly * some(), hardly * some(), hardly * some())),
                3 => Quaternion::about(vec3(6.0 * some(), 1e-6 * some(), 0.0)),
                _ => Quaternion::about(vec3(6.0 * some(), 6.0 * some(), 6.0 * some())),
            };
            let reach = 1.3 * (vec3(g[0], g[1], g[2]).norm() + vec3(h[0], h[1], h[2]).norm());
            let mut at = vec3(reach * some(), reach * some(), reach * some());
            if k % 3 == 0 {
                // a face at a face's level
                let axis = k % 9 / 3;
                at[axis] =
                    (g[axis] + h[axis]) * at[axis].signum() + if k % 2 == 0 { 0.0 } else { 0.05 * some() };
            }
            let origin = vec3(9.0 * some(), 9.0 * some(), 9.0 * some());
            let base = Quaternion::about(vec3(6.0 * some(), 6.0 * some(), 6.0 * some()));
            let own = Pose::new(origin, base);
            let place = own.compose(&Pose::new(at, turn));
            let core = |k: usize| SpatialCore::Polytope(Arc::clone(&solids[k % 4]));
            let radii = if k % 7 == 0 { [0.1, 0.03] } else { [0.0; 2] };
            let margin = [0.2, 0.02, 0.05][k / 80 % 3];
            Case { cores: [core(k), core(k / 4)], radii, poses: [own, place], margin }
        })
    }

    /// What general cores of space have.
    fn of_any_cores(case: &Case) -> Option<(f64, Vec3, Touches<Spatial>)> {
        let [a, b] = &case.cores;
        let place = case.poses[0].inverse().compose(&case.poses[1]);
        let reach = case.margin + case.radii[0] + case.radii[1];
        let found = Spatial::separation(a, b, &place, f64::INFINITY, &mut Guess::default())?;
        let mut touches = Touches::<Spatial>::default();
        Spatial::manifold(a, b, &place, &found, true, reach, &mut touches);
        Some((found.gap, case.poses[0].rotation.rotate(found.normal), touches))
    }

    #[test]
    fn four_pairs_are_what_each_is_alone_on_every_processor() {
        let cases: Vec<Case> = cases(4000).collect();
        let (mut points, mut alone) = (Vec::new(), Vec::new());
        for some in cases.chunks(ABREAST) {
            let pairs: Vec<Beside<'_, Spatial>> = some.iter().map(Case::pair).collect();
            points.clear();
            let told = contacts(&pairs, &mut points);
            let mut first = 0;
            for (k, pair) in pairs.iter().enumerate() {
                alone.clear();
                let [own, ..] = contacts(&[*pair], &mut alone);
                assert_eq!(points[first..told[k].end], alone);
                assert_eq!(told[k].apart, own.apart);
                first = told[k].end;
            }
            let records = four_of(&pairs, record).expect("pairs");
            let (mut other, mut plain) = ([Told::nothing(0); ABREAST], Vec::new());
            let overlaps = &mut Overlaps::default();
            Portable.run(Tell {
                pairs: &pairs,
                records: &records,
                overlaps,
                told: &mut other,
                out: &mut plain,
            });
            assert_eq!(points, plain);
            assert_eq!(told[..pairs.len()], other[..pairs.len()]);
        }
    }

    /// Who solves points in turn moves as their order says: a heavy block sank deeper when it was another.
    #[test]
    fn points_of_boxes_face_to_face_come_in_the_order_of_other_cores() {
        let shifts = [[0.5, 0.0], [-0.5, 0.0], [0.02, 0.03], [-0.02, 0.03], [0.02, -0.03], [-0.02, -0.03]];
        for (axis, k) in (0..3).flat_map(|axis| (0..24).map(move |k| (axis, k))) {
            let mut at = Vec3::ZERO;
            let [x, y] = shifts[k % 6];
            (at[(axis + 1) % 3], at[(axis + 2) % 3]) = (x, y);
            at[axis] = if k < 12 { 0.9999 } else { -1.0001 };
            let (pose, origin) = (Pose::new(at, Quaternion::IDENTITY), Pose::default());
            let cube = || SpatialCore::Polytope(Arc::new(Polytope::cuboid([0.5; 3])));
            let poses = if k / 6 % 2 == 0 { [pose, origin] } else { [origin, pose] };
            let case = Case { cores: [cube(), cube()], radii: [0.0; 2], poses, margin: 0.01 };
            let mut points = Vec::new();
            contacts(&[case.pair()], &mut points);
            let (_, _, touches) = of_any_cores(&case).expect("a direction");
            let names: Vec<u64> = touches.iter().map(|t| mix(mix(0, 0), t.label.code())).collect();
            assert_eq!(names.len(), 4);
            assert_eq!(points.iter().map(|p| p.feature).collect::<Vec<_>>(), names, "{poses:?}");
        }
    }

    #[test]
    fn four_points_go_around_their_patch() {
        let corners = [vec2(0.0, 0.0), vec2(1.0, 0.1), vec2(1.1, 1.0), vec2(0.0, 0.9)];
        for order in [[0, 1, 2, 3], [0, 2, 1, 3], [0, 1, 3, 2], [2, 0, 1, 3], [3, 1, 2, 0]] {
            let mut points = order.map(|k| corners[k]);
            if let Some(k) = out_of_turn(points) {
                points.swap(k, k + 1);
            }
            assert_eq!(out_of_turn(points), None, "{order:?}");
        }
    }

    /// Boxes all but aligned lost their points, one pair in 7,000: edges without a direction across them left the corners to tell.
    #[test]
    fn boxes_touch_where_any_cores_of_their_form_do() {
        let (mut apart, mut near, mut deep, mut other) = (0, 0, 0, 0);
        for (k, case) in cases(400_000).enumerate() {
            let mut points = Vec::new();
            let [told, ..] = contacts(&[case.pair()], &mut points);
            let (gap, normal, touches) = of_any_cores(&case).expect("a direction");
            let gap = gap - case.radii[0] - case.radii[1];
            let context =
                || format!("case {k}: {gap:e} {normal:?}, {} touches, {points:#?} {told:?}", touches.len());
            assert!(told.apart <= gap + 1e-9, "{}", context());
            if points.is_empty() {
                let beyond = case.margin - 1e-9;
                assert!(gap > beyond && told.apart > beyond, "{}", context());
                apart += 1;
                continue;
            }
            let deepest = points.iter().fold(f64::INFINITY, |m, p| m.min(p.gap));
            assert!((deepest - gap).abs() < 1e-7 && points.len() <= 4, "{}", context());
            *if gap > 0.0 { &mut near } else { &mut deep } += 1;
            other += usize::from(points.len() != touches.len());
            for p in &points {
                // both surfaces are half the gap away from the point, but for a few times what counts as inside
                for (side, sign) in [(0, 0.5), (1, -0.5)] {
                    let pose = &case.poses[side];
                    let half = half_of(&case.cores[side]).expect("a box");
                    let at = pose.rotation.unrotate(p.point + p.normal * (sign * p.gap) - pose.position);
                    let outside = Vec3::from_fn(|c| (at[c].abs() - half[c]).max(0.0)).norm();
                    assert!(
                        outside - case.radii[side] < 3.0 * SAME_SIDE * case.scale(),
                        "{outside} {}",
                        context()
                    );
                }
            }
        }
        assert!(apart > 30_000 && near > 30_000 && deep > 30_000, "{apart} {near} {deep}");
        // as many points, but where a hair decides
        assert!(other < 40, "{other} of {}", near + deep);
    }
}
