//! Contact points of two posed colliders: every pair of pieces within the margin is asked for its separation,
//! facets are asked what their seams allow, patches with one normal keep a few points. One text for both spaces;
//! stateless. Knows no bodies.

use crate::abreast::four_of;
use crate::balls::{Ball, ball_on_wall, two_balls};
use crate::clearance::clearance;
use crate::collider::{Collider, Form, Leaf, Piece, Query, leaves, reach_box};
use crate::few::Few;
use crate::geometry::{ABREAST, ContactPoint, Geometry, Guess, Look, Told};
use crate::kernel::{Beside, Kernel, Label, NONE, Ring, Separation, Swept, Touches, mix, scale};
use crate::spread::{Places, spread};
use crate::surface::Verdict;
use crate::wall::{Facing, Wall};
use carom_math::{Column, Pose, Rotation};
use std::cell::Cell;
use std::collections::BTreeSet;

/// Normals of one patch agree to this cosine \[1\].
const ONE_PATCH: f64 = 1.0 - 1e-10;
/// Points of a patch closer than this fraction of the smaller piece are one \[1\].
const ONE_POINT: f64 = 1e-6;

/// Up to so many points a pass over all is quicker than a set \[1\].
const FEW_POINTS: usize = 32;

/// The label of a face.
const FACE: [u32; 2] = [NONE, NONE];
/// A point this close to a seam stands on the facet, as a fraction of the scale \[1\].
const ONE_SIDE: f64 = 1e-9;
/// A facet whose normal was turned by its seams reports overlaps up to this many times the smallest one \[1\].
const DEEPER: f64 = 10.0;

/// Points found so far in one query.
struct Found<'a, S: Kernel> {
    margin: f64,
    touches: Touches<S>,
    out: &'a mut Vec<ContactPoint<S>>,
    /// Size of the smallest piece met \[m\].
    smallest: f64,
}

/// Appends the contact points of two posed colliders with gaps up to `margin` \[m\]; two convex ones use a guess.
pub(crate) fn contacts<S: Kernel>(
    a: &Collider<S>,
    pose_a: &Pose<S>,
    b: &Collider<S>,
    pose_b: &Pose<S>,
    margin: f64,
    guess: &mut Guess<S>,
    out: &mut Vec<ContactPoint<S>>,
) {
    guess.apart = f64::NEG_INFINITY;
    if let Some(known) = of_balls((a, pose_a), (b, pose_b), margin) {
        if let Some(point) = known {
            out.push(point);
        }
        return;
    }
    if let (Form::Convex(core_a, radius_a), Form::Convex(core_b, radius_b)) = (&*a.form, &*b.form) {
        let swept = |core, radius, pose| Swept { core, radius, pose };
        let (one, other) = (swept(core_a, *radius_a, pose_a), swept(core_b, *radius_b, pose_b));
        if S::together(one, other, margin, &mut guess.apart, out) {
            return;
        }
    }
    by_pieces(a, pose_a, b, pose_b, margin, guess, out);
}

/// True for two convex colliders that are looked at beside others.
#[inline]
pub(crate) fn go_abreast<S: Kernel>(a: &Collider<S>, b: &Collider<S>) -> bool {
    match (&*a.form, &*b.form) {
        (Form::Convex(core_a, _), Form::Convex(core_b, _)) => S::go_abreast(core_a, core_b),
        _ => false,
    }
}

/// Appends the contact points of some pairs that go abreast.
pub(crate) fn contacts_abreast<S: Kernel + Geometry<Collider = Collider<S>>>(
    looks: &[Look<'_, S>],
    out: &mut Vec<ContactPoint<S>>,
) -> [Told; ABREAST] {
    if let Some([Some(a), Some(b), Some(c), Some(d)]) = four_of(looks, beside) {
        return S::abreast(&[a, b, c, d][..looks.len().min(ABREAST)], out);
    }
    let mut all = [Told::nothing(out.len()); ABREAST];
    for (told, look) in all.iter_mut().zip(looks) {
        let (Look { colliders: [a, b], poses: [pose_a, pose_b], margin }, mut guess) =
            (look, Guess::default());
        contacts(a, pose_a, b, pose_b, *margin, &mut guess, out);
        *told = Told { end: out.len(), apart: guess.apart };
    }
    all
}

/// The cores of two colliders that go abreast.
#[inline]
fn beside<'a, S: Kernel + Geometry<Collider = Collider<S>>>(look: &Look<'a, S>) -> Option<Beside<'a, S>> {
    let swept = |k: usize| match &*look.colliders[k].form {
        Form::Convex(core, radius) => Some(Swept { core, radius: *radius, pose: look.poses[k] }),
        _ => None,
    };
    let (a, b) = (swept(0)?, swept(1)?);
    <S as Kernel>::go_abreast(a.core, b.core).then_some(Beside { swept: [a, b], margin: look.margin })
}

/// The same, piece by piece.
fn by_pieces<S: Kernel>(
    a: &Collider<S>,
    pose_a: &Pose<S>,
    b: &Collider<S>,
    pose_b: &Pose<S>,
    margin: f64,
    guess: &mut Guess<S>,
    out: &mut Vec<ContactPoint<S>>,
) {
    let first = out.len();
    let mut found = Found { margin, touches: Touches::<S>::default(), out, smallest: f64::INFINITY };
    let simple = |c: &Collider<S>| matches!(*c.form, Form::Convex(..) | Form::HalfSpace(_) | Form::Cavity(_));
    match (&*a.form, &*b.form) {
        (Form::Convex(core_a, radius_a), Form::Convex(core_b, radius_b)) => {
            let piece =
                |core, radius, pose: &Pose<S>| Piece { core, radius, pose: *pose, facet: None, name: 0 };
            let (a, b) = (piece(core_a, *radius_a, pose_a), piece(core_b, *radius_b, pose_b));
            found.pieces(&a, &b, guess);
        }
        (of_a, of_b) => match (Wall::of(of_a, pose_a), Wall::of(of_b, pose_b)) {
            (_, Some(wall)) => found.wall(a, pose_a, 0, &wall, false),
            (Some(wall), None) => found.wall(b, pose_b, 0, &wall, true),
            (None, None) => {
                if !found.walk(a, pose_a, b, pose_b) {
                    guess.apart = clearance((a, pose_a), (b, pose_b), margin);
                }
            }
        },
    }
    let smallest = found.smallest;
    if !(simple(a) && simple(b)) {
        thin_out(found.out, first, ONE_POINT * smallest);
    }
    make_unique(&mut out[first..]);
}

/// True where a ball takes part, and another or a wall.
pub(crate) fn touch_once<S: Kernel>(a: &Collider<S>, b: &Collider<S>) -> bool {
    let ball = |c: &Collider<S>| matches!(&*c.form, Form::Convex(core, _) if S::only_point(core).is_some());
    let wall = |c: &Collider<S>| matches!(&*c.form, Form::HalfSpace(_) | Form::Cavity(_));
    (ball(a) && (ball(b) || wall(b))) || (wall(a) && ball(b))
}

/// The radius of a ball about its frame's origin.
pub(crate) fn ball_radius<S: Kernel>(c: &Collider<S>) -> Option<f64> {
    match &*c.form {
        Form::Convex(core, radius) => (S::only_point(core)? == S::Vector::ZERO).then_some(*radius),
        _ => None,
    }
}

/// What balls have with balls and walls; nothing where other shapes take part.
fn of_balls<S: Kernel>(
    (a, pose_a): (&Collider<S>, &Pose<S>),
    (b, pose_b): (&Collider<S>, &Pose<S>),
    margin: f64,
) -> Option<Option<ContactPoint<S>>> {
    match (&*a.form, &*b.form) {
        (Form::Convex(core_a, radius_a), Form::Convex(core_b, radius_b)) => {
            let one = Ball::of(core_a, *radius_a, pose_a)?;
            two_balls(&one, &Ball::of(core_b, *radius_b, pose_b)?, margin)
        }
        (Form::Convex(core, radius), other) => {
            let wall = Wall::of(other, pose_b)?;
            Some(ball_on_wall(&Ball::of(core, *radius, pose_a)?, &wall, false, margin))
        }
        (other, Form::Convex(core, radius)) => {
            let wall = Wall::of(other, pose_a)?;
            Some(ball_on_wall(&Ball::of(core, *radius, pose_b)?, &wall, true, margin))
        }
        _ => None,
    }
}

impl<S: Kernel> Found<'_, S> {
    /// Every pair of leaves within the margin; whether there are any.
    fn walk(&mut self, a: &Collider<S>, pose_a: &Pose<S>, b: &Collider<S>, pose_b: &Pose<S>) -> bool {
        let (limit, met) = (Cell::new(self.margin), Cell::new(false));
        let box_of_b = |frame: &Pose<S>| b.bounds(&frame.inverse().compose(pose_b), 0.0);
        leaves(a, pose_a, 0, &Query { box_in: &box_of_b, limit: &limit }, &mut |leaf| match leaf {
            Leaf::Wall(wall, name) => {
                met.set(true);
                self.wall(b, pose_b, name, &wall, true);
            }
            Leaf::Piece(a) => {
                let box_of_a = |frame: &Pose<S>| {
                    let place = frame.inverse().compose(&a.pose);
                    reach_box(&place, |d| S::support(a.core, d).0).grown(a.radius)
                };
                leaves(b, pose_b, 0, &Query { box_in: &box_of_a, limit: &limit }, &mut |leaf| {
                    met.set(true);
                    match leaf {
                        Leaf::Wall(wall, _) => self.piece_on_wall(a, &wall, false),
                        Leaf::Piece(b) => self.pieces(a, b, &mut Guess::default()),
                    }
                });
            }
        });
        met.get()
    }

    /// Contacts of two convex pieces.
    fn pieces(&mut self, a: &Piece<S>, b: &Piece<S>, guess: &mut Guess<S>) {
        let place = a.pose.inverse().compose(&b.pose);
        let radii = a.radius + b.radius;
        let reach = self.margin + radii;
        let found = direction(a, b, &place, reach, guess);
        guess.apart -= radii;
        let Some((found, witnessed, smallest)) = found else { return };
        if found.gap > reach {
            return;
        }
        let size = |p: &Piece<S>| S::size(p.core) + p.radius;
        self.smallest = self.smallest.min(size(a)).min(size(b));
        S::manifold(a.core, b.core, &place, &found, witnessed, reach, &mut self.touches);
        if !witnessed {
            // along a turned normal a facet sees depths behind it that are not its own: the neighbour's matter
            let floor = DEEPER * smallest.min(0.0) - 1e-9 * scale::<S>(a.core, b.core, &place);
            self.touches.retain(|t| t.gap >= floor);
        }
        let name = mix(a.name, b.name);
        self.out.extend(self.touches.iter().map(|t| {
            let middle = (t.on_a + t.on_b - t.normal * (a.radius - b.radius)) * 0.5;
            ContactPoint {
                feature: mix(name, t.label.code()),
                point: a.pose.to_world(middle),
                normal: a.pose.rotation.rotate(t.normal),
                gap: t.gap - radii,
                curvature: 0.0,
            }
        }));
    }

    /// Contacts of a collider with a wall; `wall_is_a` turns the normals round.
    fn wall(&mut self, c: &Collider<S>, pose: &Pose<S>, name: u64, wall: &Wall<S>, wall_is_a: bool) {
        match &*c.form {
            Form::HalfSpace(_) | Form::Cavity(_) => {}
            Form::Convex(core, radius) => {
                let piece = Piece { core, radius: *radius, pose: *pose, facet: None, name };
                self.piece_on_wall(&piece, wall, wall_is_a);
            }
            Form::Surface(surface) => {
                let extreme = surface.extreme.iter().enumerate().map(|(i, p)| (*p, i as u32));
                self.smallest = self.smallest.min(extreme.clone().fold(0.0, |m: f64, p| m.max(p.0.norm())));
                self.points_on_wall(extreme, pose, 0.0, name, wall, wall_is_a);
            }
            Form::Compound(all) => {
                for (i, (inner, part)) in all.parts.iter().enumerate() {
                    self.wall(part, &pose.compose(inner), mix(name, 1 + i as u64), wall, wall_is_a);
                }
            }
        }
    }

    fn piece_on_wall(&mut self, piece: &Piece<S>, wall: &Wall<S>, wall_is_a: bool) {
        let mut lowest = Ring::<S>::default();
        wall.met_by(piece.core, &piece.pose, &mut lowest);
        self.smallest = self.smallest.min(S::size(piece.core) + piece.radius);
        self.points_on_wall(lowest.iter().copied(), &piece.pose, piece.radius, piece.name, wall, wall_is_a);
    }

    /// The points of a piece that reach the wall; on a flat one spread over at most a patch.
    fn points_on_wall(
        &mut self,
        points: impl Iterator<Item = (S::Vector, u32)>,
        pose: &Pose<S>,
        radius: f64,
        name: u64,
        wall: &Wall<S>,
        wall_is_a: bool,
    ) {
        let origin = wall.origin();
        let mut places = Places::<S::Vector>::default();
        let mut others = Few::<(u32, S::Vector, f64), 8>::default();
        for (p, vertex) in points {
            // the difference first: far from the origin it is small and the rotated point is exact
            let at = pose.rotation.rotate(p) + (pose.position - origin);
            let Facing { gap, outward, curvature } = wall.facing(at);
            let gap = gap - radius;
            if gap <= self.margin {
                places.push((pose.to_world(p) - outward * (radius + 0.5 * gap), gap));
                others.push((vertex, outward, curvature));
            }
        }
        let mut tell = |i: usize| {
            let ((point, gap), (vertex, outward, curvature)) = (places[i], others[i]);
            let label = Label { a: [vertex, NONE], b: [NONE, NONE] };
            let normal = if wall_is_a { -outward } else { outward };
            let feature = mix(name, label.code());
            self.out.push(ContactPoint { feature, point, normal, gap, curvature });
        };
        match wall {
            Wall::Flat { normal, .. } if places.len() > S::PATCH => {
                spread::<S>(&places, *normal, S::PATCH).iter().for_each(|&i| tell(i));
            }
            _ => (0..places.len()).for_each(tell),
        }
    }
}

/// The direction along which two pieces may push each other, whether its witnesses are their own, and the
/// smallest gap \[m\] of the pieces alone; `None` when there is no contact within `reach`.
fn direction<S: Kernel>(
    a: &Piece<S>,
    b: &Piece<S>,
    place: &Pose<S>,
    reach: f64,
    guess: &mut Guess<S>,
) -> Option<(Separation<S>, bool, f64)> {
    let along = |normal| S::along(a.core, b.core, place, normal);
    let (of_a, of_b) = (|d: S::Vector| -d, |d: S::Vector| place.rotation.rotate(d));
    // facets see directions from themselves to the other piece, b's facet in its own frame
    let only = match (a.facet, b.facet) {
        (None, Some(facet)) => facet.only_normal(&|d| along(of_b(d)).gap).map(of_b),
        (Some(facet), None) => facet.only_normal(&|d| along(of_a(d)).gap).map(of_a),
        _ => None,
    };
    let slack = || ONE_SIDE * scale::<S>(a.core, b.core, place);
    if let Some(normal) = only {
        let (found, witnessed) = turned(a, b, place, along(normal), slack());
        return Some((found, witnessed, found.gap));
    }
    let found = S::separation(a.core, b.core, place, reach, guess)?;
    let mut best = (found, true);
    if let Some(facet) = b.facet {
        match facet.judge(place.rotation.unrotate(found.normal), &|d| along(of_b(d)).gap) {
            Verdict::Keep => {}
            Verdict::Turn(d) => best = turned(a, b, place, along(of_b(d)), slack()),
            Verdict::Drop => return None,
        }
    }
    if let Some(facet) = a.facet {
        match facet.judge(-best.0.normal, &|d| along(of_a(d)).gap) {
            Verdict::Keep => {}
            Verdict::Turn(d) => best = turned(a, b, place, along(of_a(d)), slack()),
            Verdict::Drop => return None,
        }
    }
    Some((best.0, best.1, found.gap))
}

/// A separation along a normal that a facet chose: its witnesses are good when the other piece's farthest point
/// stands on the facet.
fn turned<S: Kernel>(
    a: &Piece<S>,
    b: &Piece<S>,
    place: &Pose<S>,
    along: Separation<S>,
    slack: f64,
) -> (Separation<S>, bool) {
    let normal = along.normal;
    let foot = match (a.facet, b.facet) {
        (None, Some(facet)) => {
            let foot = facet.foot(place.to_body(along.on_a), place.rotation.unrotate(normal), slack);
            foot.map(|p| Separation {
                on_b: place.to_world(p),
                label: Label { b: FACE, ..along.label },
                ..along
            })
        }
        (Some(facet), None) => {
            let foot = facet.foot(along.on_b, normal, slack);
            foot.map(|p| Separation { on_a: p, label: Label { a: FACE, ..along.label }, ..along })
        }
        _ => None,
    };
    // along a normal that is not the facet's own, its farthest corner is not where the foot is
    let sound = foot.filter(|s| normal.dot(s.on_a - s.on_b) <= s.gap + slack);
    (sound.unwrap_or(along), sound.is_some())
}

/// Merges the points of one pair that share a normal into patches, each with a few points.
fn thin_out<S: Kernel>(out: &mut Vec<ContactPoint<S>>, first: usize, one_point: f64) {
    let all = out.split_off(first);
    let mut taken = vec![false; all.len()];
    for i in 0..all.len() {
        if taken[i] {
            continue;
        }
        let mut patch: Vec<usize> = Vec::new();
        for j in i..all.len() {
            if taken[j] || all[j].normal.dot(all[i].normal) < ONE_PATCH {
                continue;
            }
            taken[j] = true;
            // of twins on two pieces the deeper one speaks
            match patch.iter_mut().find(|k| (all[**k].point - all[j].point).norm() <= one_point) {
                Some(twin) if all[j].gap < all[*twin].gap => *twin = j,
                Some(_) => {}
                None => patch.push(j),
            }
        }
        let places: Vec<(S::Vector, f64)> = patch.iter().map(|&k| (all[k].point, all[k].gap)).collect();
        out.extend(spread::<S>(&places, all[i].normal, S::PATCH).iter().map(|&k| all[patch[k]]));
    }
}

/// Gives every point of the pair a feature of its own.
fn make_unique<S: Kernel>(points: &mut [ContactPoint<S>]) {
    if points.len() > FEW_POINTS {
        let mut seen = BTreeSet::new();
        for point in points {
            while !seen.insert(point.feature) {
                point.feature = mix(point.feature, 1);
            }
        }
        return;
    }
    for k in 1..points.len() {
        while points[..k].iter().any(|p| p.feature == points[k].feature) {
            points[k].feature = mix(points[k].feature, 1);
        }
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use crate::geometry::Geometry;
    use crate::shape::{PlanarShape, SpatialShape};
    use carom_math::{Planar, Quaternion, Spatial, Turn, Vec2, Vec3, vec2, vec3};

    /// Numbers in [-1, 1), of a congruential generator.
    pub(crate) fn numbers() -> impl FnMut() -> f64 {
        let mut state = 7u64;
        move || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 11) as f64 / (1u64 << 52) as f64 - 1.0
        }
    }

    /// What is found in one go and piece by piece; the poses are of the two shapes.
    fn both_ways<S: Kernel>(
        (a, b): (&Collider<S>, &Collider<S>),
        [pose_a, pose_b]: [Pose<S>; 2],
        margin: f64,
    ) -> [Vec<ContactPoint<S>>; 2] {
        let (mut one, mut other) = (Vec::new(), Vec::new());
        contacts(a, &pose_a, b, &pose_b, margin, &mut Guess::default(), &mut one);
        by_pieces(a, &pose_a, b, &pose_b, margin, &mut Guess::default(), &mut other);
        [one, other]
    }

    /// Whether points are the same to rounding, and to what else is allowed of places \[m\].
    fn is_near<S: Kernel>(p: &ContactPoint<S>, q: &ContactPoint<S>, slack: f64) -> bool {
        (p.point - q.point).norm() < 1e-11 + slack
            && (p.normal - q.normal).norm() < 1e-11
            && (p.gap - q.gap).abs() < 1e-12 + 1e-3 * slack
    }

    /// What is found in one go is what is found piece by piece.
    fn agree<S: Kernel>(a: &Collider<S>, b: &Collider<S>, poses: [Pose<S>; 2], margin: f64) -> usize {
        let [one, other] = both_ways((a, b), poses, margin);
        let same = |p: &ContactPoint<S>, q: &ContactPoint<S>| p.feature == q.feature && is_near(p, q, 0.0);
        let agree = one.len() == other.len() && one.iter().zip(&other).all(|(p, q)| same(p, q));
        assert!(agree, "{a:?} {poses:?}\n{b:?}\n{one:#?}\n{other:#?}");
        one.len()
    }

    #[test]
    fn polygons_of_few_corners_touch_as_polygons_do() {
        let mut number = numbers();
        let ring = |n: usize, r: f64| -> Vec<Vec2> {
            let turn = |k: usize| Turn::from_angle(std::f64::consts::TAU * k as f64 / n as f64);
            (0..n).map(|k| turn(k).rotate(vec2(r, 0.1 * r))).collect()
        };
        let mut shapes = vec![
            PlanarShape::Circle { radius: 0.4 },
            PlanarShape::Capsule { length: 0.7, radius: 0.2 },
            PlanarShape::RoundBox { size: [0.6, 0.4], radius: 0.1 },
            PlanarShape::Segment { a: vec2(-0.5, 0.1), b: vec2(0.4, -0.2) },
        ];
        shapes.extend([3, 4, 5, 8].map(|n| PlanarShape::ConvexPolygon { points: ring(n, 0.5) }));
        shapes.extend([1.0, 20.0].map(|x| PlanarShape::Box { size: [x, 1.0] }));
        let all: Vec<Collider<Planar>> =
            shapes.iter().map(|s| Planar::collider(s).expect("a shape")).collect();
        let mut points = 0;
        for a in &all {
            for b in &all {
                for k in 0..400 {
                    let turned = [3.2, 1e-3][k % 2];
                    let mut pose = |far: f64| {
                        let place = vec2(far * number(), far * number());
                        Pose::new(place, Turn::from_angle(turned * number()))
                    };
                    points += agree(a, b, [pose(0.8), pose(0.3)], [0.02, 0.3][k % 2]);
                }
            }
        }
        assert!(points > 20_000);
    }

    #[test]
    fn boxes_touch_as_hulls_do() {
        let mut number = numbers();
        let mut shapes: Vec<SpatialShape> =
            [[1.0, 1.0, 1.0], [0.9, 0.5, 0.7], [20.0, 20.0, 1.0], [0.2, 0.2, 3.0]]
                .map(|size| SpatialShape::Box { size })
                .to_vec();
        shapes.push(SpatialShape::RoundBox { size: [0.6, 0.4, 0.5], radius: 0.1 });
        let half = [0.5, 0.35, 0.5, 1.5, 0.35];
        let all: Vec<Collider<Spatial>> =
            shapes.iter().map(|s| Spatial::collider(s).expect("a shape")).collect();
        let (mut points, mut pairs, mut alike) = (0, 0, 0);
        for (a, half_a) in all.iter().zip(half) {
            for (b, half_b) in all.iter().zip(half) {
                for k in 0..600 {
                    // turned at random, or lying on each other but for a little
                    let (turned, lies) = ([3.2, 1e-2, 1e-4][k % 3], k % 3 > 0);
                    let mut turn = || {
                        let axis = vec3(number(), number(), number());
                        Quaternion::about(axis * turned)
                    };
                    let (turn_a, turn_b) = (turn(), turn());
                    let mut place = |far: f64| vec3(far * number(), far * number(), far * number());
                    let lift = if lies { vec3(0.0, 0.0, half_a + half_b) } else { Vec3::ZERO };
                    let (at, by) = (place(0.3), place(if lies { 0.01 } else { 1.0 }));
                    let beside = if lies { vec3(0.4 * number(), 0.4 * number(), 0.0) } else { Vec3::ZERO };
                    let poses = [Pose::new(at + lift + by + beside, turn_a), Pose::new(at, turn_b)];
                    let [one, other] = both_ways((a, b), poses, [0.02, 0.3][k % 2]);
                    // in another order, and what is over a side by less than the slack is on it here or there
                    let (few, many) = if one.len() < other.len() { (&one, &other) } else { (&other, &one) };
                    let found = |slack: f64| {
                        let found = |p: &ContactPoint<Spatial>| many.iter().any(|q| is_near(p, q, slack));
                        few.is_empty() == many.is_empty() && few.iter().all(found)
                    };
                    let deepest =
                        |points: &[ContactPoint<Spatial>]| points.iter().fold(1.0, |m: f64, p| m.min(p.gap));
                    let near = found(3e-6) && (deepest(few) - deepest(many)).abs() < 1e-9;
                    assert!(near, "{a:?} {b:?} {poses:?}\n{one:#?}\n{other:#?}");
                    let names = |points: &[ContactPoint<Spatial>]| {
                        let mut names: Vec<u64> = points.iter().map(|p| p.feature).collect();
                        names.sort_unstable();
                        names
                    };
                    pairs += usize::from(!one.is_empty());
                    alike += usize::from(!one.is_empty() && found(0.0) && names(&one) == names(&other));
                    points += one.len();
                }
            }
        }
        assert!(points > 20_000);
        assert!(alike > pairs * 9 / 10, "{alike} of {pairs} pairs alike");
    }

    #[test]
    fn a_guess_changes_no_bit() {
        let mut number = numbers();
        let mut hull = |corners: usize, size: f64| {
            let mut corner = || vec3(number(), number(), number()).normalized().unwrap_or(Vec3::ZERO);
            let points = (0..corners).map(|_| corner() * size).collect();
            Spatial::collider(&SpatialShape::ConvexHull { points }).expect("a hull")
        };
        let mut all: Vec<Collider<Spatial>> = vec![hull(24, 0.5), hull(12, 0.6), hull(40, 0.4)];
        let others = [
            SpatialShape::Box { size: [1.0, 0.8, 0.3] },
            SpatialShape::Capsule { length: 0.6, radius: 0.2 },
            SpatialShape::Cylinder { height: 0.7, radius: 0.3 },
        ];
        all.extend(others.iter().map(|s| Spatial::collider(s).expect("a shape")));
        let (mut points, mut none) = (0, 0);
        for a in &all {
            for b in &all {
                let mut guess = Guess::default();
                let (mut place, mut turn) = (vec3(0.0, 0.0, 0.9), Vec3::ZERO);
                for k in 0..300 {
                    // on a way about, and somewhere else now and then
                    let step = if k % 50 == 0 { 0.3 } else { 0.01 };
                    place += vec3(number(), number(), number()) * step;
                    place = place * (0.8 / place.norm()).min(1.0);
                    turn += vec3(number(), number(), number()) * step;
                    let poses = [Pose::default(), Pose::new(place, Quaternion::about(turn))];
                    let (mut one, mut other) = (Vec::new(), Vec::new());
                    Spatial::contacts(a, &poses[0], b, &poses[1], 0.02, &mut one);
                    Spatial::contacts_near((a, &poses[0]), (b, &poses[1]), 0.02, &mut guess, &mut other);
                    assert_eq!(one, other, "{a:?}\n{b:?}\n{poses:?}");
                    points += one.len();
                    none += usize::from(one.is_empty());
                    assert!(one.is_empty() || guess.apart <= 0.02 || guess.apart == f64::NEG_INFINITY);
                }
            }
        }
        assert!(points > 2_000 && none > 1_000, "{points} points, {none} times none");
    }
}
