//! Two convex cores of the plane with few corners (points, segments, polygons), in one go: b's corners and normals are
//! brought into a's frame once, s(n) of all edge normals is found four at a time, and the ends of the overlap of the two
//! edges that face each other are the contact points. Says what `pair_planar` says, which takes cores of any number of
//! corners. Knows no composite shapes.

use crate::core_planar::{PlanarCore, Row, Rows};
use crate::geometry::ContactPoint;
use crate::kernel::{Label, NONE, Separation, Swept, Touch, mix};
use crate::pair_planar::{End, ROUNDING, SAME_END, between_ends};
use carom_math::lanes::{Four, Job, Lanes, dispatch};
use carom_math::{Column, Planar, Rotation, Turn, Vec2, Wide, vec2};

/// Appends the contact points of two cores with gaps up to `margin` \[m\], their names distinct; false where one has too
/// many corners, or both are points. Where something shows them farther apart, `apart` becomes by how much \[m\].
pub fn contacts(
    a: &Swept<Planar>,
    b: &Swept<Planar>,
    margin: f64,
    apart: &mut f64,
    out: &mut Vec<ContactPoint<Planar>>,
) -> bool {
    let (mut own_a, mut own_b) = (None, None);
    let (Some(rows_a), Some(rows_b)) = (rows_of(a.core, &mut own_a), rows_of(b.core, &mut own_b)) else {
        return false;
    };
    if rows_a.edges + rows_b.edges == 0 {
        return false;
    }
    dispatch(Two { a: rows_a, b: rows_b, swept: [a, b], margin, apart, out });
    true
}

/// The rows that a core has, or that are made for it.
#[inline]
fn rows_of<'a>(core: &'a PlanarCore, made: &'a mut Option<Rows>) -> Option<&'a Rows> {
    // of arrays, whose lengths are known here, rows are made without a loop
    *made = match core {
        PlanarCore::Polygon(_) => return core.rows(),
        PlanarCore::Point(corner) => Rows::of(corner, &[]),
        PlanarCore::Segment(corners, normals) => Rows::of(corners, normals),
    };
    made.as_ref()
}

/// Two rings, what they are of, and where to tell of their contacts.
struct Two<'a, 'b> {
    a: &'a Rows,
    b: &'a Rows,
    swept: [&'a Swept<'b, Planar>; 2],
    margin: f64,
    apart: &'a mut f64,
    out: &'a mut Vec<ContactPoint<Planar>>,
}

impl Job for Two<'_, '_> {
    type Output = ();
    #[inline(always)]
    fn work<L: Lanes>(self, lanes: L) {
        match (self.a.corners > 4, self.b.corners > 4) {
            (false, false) => self.tell::<L, 1, 1>(lanes),
            (false, true) => self.tell::<L, 1, 2>(lanes),
            (true, false) => self.tell::<L, 2, 1>(lanes),
            (true, true) => self.tell::<L, 2, 2>(lanes),
        }
    }
}

/// At most two touches.
#[derive(Default)]
struct Ends {
    touches: [Touch<Planar>; 2],
    count: usize,
}

impl Ends {
    #[inline(always)]
    fn push(&mut self, touch: Touch<Planar>) {
        self.touches[self.count & 1] = touch;
        self.count += 1;
    }
    /// The smallest gap \[m\].
    #[inline(always)]
    fn lowest(&self) -> f64 {
        let [one, other] = &self.touches;
        match self.count {
            0 => f64::INFINITY,
            1 => one.gap,
            _ => one.gap.min(other.gap),
        }
    }
    /// Puts the witnesses of a direction beside the deeper of two ends.
    #[inline(always)]
    fn beside_witness(&mut self, found: &Separation<Planar>) {
        let Separation { normal, gap, on_a, on_b, label } = *found;
        if self.count == 2 {
            self.touches[0] = self.touches[usize::from(self.touches[0].gap > self.touches[1].gap)];
            self.count = 1;
        }
        self.push(Touch { normal, gap, on_a, on_b, label });
    }
}

/// A ring of N rows in a's frame.
struct Placed<const N: usize> {
    rows: [Row; N],
    corners: usize,
    edges: usize,
}

impl<const N: usize> Placed<N> {
    #[inline(always)]
    fn corner(&self, i: usize) -> Vec2 {
        let [x, y] = &self.rows[(i / 4) % N].corner;
        vec2(x[i % 4], y[i % 4])
    }
    #[inline(always)]
    fn normal(&self, i: usize) -> Vec2 {
        let [x, y] = &self.rows[(i / 4) % N].normal;
        vec2(x[i % 4], y[i % 4])
    }
    #[inline(always)]
    fn next(&self, i: usize) -> usize {
        if i + 1 < self.corners { i + 1 } else { 0 }
    }
    /// The first corner that is farthest along a direction.
    #[inline(always)]
    fn farthest<L: Lanes>(&self, lanes: L, direction: Vec2) -> usize {
        let mut along = [lanes.four_of(0.0); N];
        for (along, row) in along.iter_mut().zip(&self.rows) {
            *along = dot(lanes, &row.corner, direction);
        }
        first_of_largest(lanes, &along)
    }
    /// The first edge whose normal leans most along a direction; 0 of a point.
    #[inline(always)]
    fn edge_toward<L: Lanes>(&self, lanes: L, direction: Vec2) -> usize {
        let mut along = [lanes.four_of(0.0); N];
        for (along, row) in along.iter_mut().zip(&self.rows) {
            *along = dot(lanes, &row.normal, direction);
        }
        first_of_largest(lanes, &along)
    }
    /// s(n) of each edge's normal against the corners of another ring \[m\]; of a point's none is ever the largest.
    #[inline(always)]
    fn gaps<L: Lanes, const M: usize>(&self, lanes: L, other: &Placed<M>) -> [L::Four; N] {
        if self.edges == 0 {
            return [lanes.four_of(f64::NEG_INFINITY); N];
        }
        let mut gaps = [lanes.four_of(f64::INFINITY); N];
        for j in 0..4 * M {
            let p = other.corner(j);
            let (x, y) = (lanes.four_of(p[0]), lanes.four_of(p[1]));
            for (gap, Row { normal: [nx, ny], .. }) in gaps.iter_mut().zip(&self.rows) {
                *gap = (lanes.four(nx) * x + lanes.four(ny) * y).min(*gap);
            }
        }
        for (gap, Row { normal: [nx, ny], corner: [x, y] }) in gaps.iter_mut().zip(&self.rows) {
            *gap = *gap - (lanes.four(nx) * lanes.four(x) + lanes.four(ny) * lanes.four(y));
        }
        gaps
    }
}

/// Four vectors, by component, times one.
#[inline(always)]
fn dot<L: Lanes>(lanes: L, [x, y]: &[[f64; 4]; 2], by: Vec2) -> L::Four {
    lanes.four(x) * lanes.four_of(by[0]) + lanes.four(y) * lanes.four_of(by[1])
}

#[inline(always)]
fn largest<F: Four, const N: usize>(values: &[F; N]) -> f64 {
    let mut most = values[0];
    for value in &values[1..] {
        most = most.max(*value);
    }
    let [a, b, c, d] = most.store();
    let (one, other) = (if a > b { a } else { b }, if c > d { c } else { d });
    if one > other { one } else { other }
}

/// Least and most of each coordinate of a ring's corners, turned about its frame's origin \[m\].
pub fn spans(ring: &Rows, turn: &Turn) -> [[f64; 2]; 2] {
    dispatch(Spans(ring, turn))
}

struct Spans<'a>(&'a Rows, &'a Turn);

/// A row's corners, turned.
#[inline(always)]
fn turned<L: Lanes>(lanes: L, turn: &[L::Four; 2], row: &Row) -> [L::Four; 2] {
    let [x, y] = &row.corner;
    Planar::rotated(turn, &[lanes.four(x), lanes.four(y)])
}

impl Job for Spans<'_> {
    type Output = [[f64; 2]; 2];
    #[inline(always)]
    fn work<L: Lanes>(self, lanes: L) -> [[f64; 2]; 2] {
        let Spans(ring, Turn([c, s])) = self;
        let turn = [lanes.four_of(*c), lanes.four_of(*s)];
        let [first, second] = &ring.rows;
        let ([x, y], [u, v]) = (turned(lanes, &turn, first), turned(lanes, &turn, second));
        let (left, low) = (largest(&[-x, -u]), largest(&[-y, -v]));
        [[-left, -low], [largest(&[x, u]), largest(&[y, v])]]
    }
}

/// The places, bit by bit, of values that are no less than one.
#[inline(always)]
fn no_less<L: Lanes, const N: usize>(lanes: L, values: &[L::Four; N], than: f64) -> u32 {
    let (than, mut less) = (lanes.four_of(than), 0);
    for (k, value) in values.iter().enumerate() {
        less |= value.less(than) << (4 * k);
    }
    less ^ ((1 << (4 * N)) - 1)
}

#[inline(always)]
fn first_of_largest<L: Lanes, const N: usize>(lanes: L, values: &[L::Four; N]) -> usize {
    no_less(lanes, values, largest(values)).trailing_zeros() as usize % (4 * N)
}

/// Two rings in a's frame.
struct Posed<const A: usize, const B: usize> {
    a: Placed<A>,
    b: Placed<B>,
    /// Length against which rounding is measured \[m\].
    scale: f64,
    /// Largest gap of the cores \[m\].
    reach: f64,
}

impl Two<'_, '_> {
    #[inline(always)]
    fn tell<L: Lanes, const A: usize, const B: usize>(self, lanes: L) {
        let [a, b] = self.swept;
        let (turn, radii) = (a.pose.rotation, a.radius + b.radius);
        let posed = self.posed::<L, A, B>(lanes, self.margin + radii);
        let ends = match posed.touches(lanes) {
            Ok(ends) => ends,
            Err(beyond) => {
                *self.apart = beyond - radii;
                return;
            }
        };
        let mut before = None;
        for t in ends.touches.iter().take(ends.count).filter(|t| t.gap <= posed.reach) {
            let middle = (t.on_a + t.on_b - t.normal * (a.radius - b.radius)) * 0.5;
            let mut feature = mix(mix(0, 0), t.label.code());
            if before.replace(feature) == Some(feature) {
                feature = mix(feature, 1);
            }
            self.out.push(ContactPoint {
                feature,
                point: a.pose.to_world(middle),
                normal: turn.rotate(t.normal),
                gap: t.gap - radii,
                curvature: 0.0,
            });
        }
    }

    /// Both rings in a's frame.
    #[inline(always)]
    fn posed<L: Lanes, const A: usize, const B: usize>(&self, lanes: L, reach: f64) -> Posed<A, B> {
        let [a, b] = self.swept;
        // the difference of positions first: far from the world's origin it is small and exact
        let position = a.pose.rotation.unrotate(b.pose.position - a.pose.position);
        let turn = a.pose.rotation.unrotate(vec2(b.pose.rotation.0[0], b.pose.rotation.0[1]));
        let (c, s) = (lanes.four_of(turn[0]), lanes.four_of(turn[1]));
        let (x, y) = (lanes.four_of(position[0]), lanes.four_of(position[1]));
        let (mut rows_a, mut rows_b) = ([Row::default(); A], [Row::default(); B]);
        rows_a.copy_from_slice(&self.a.rows[..A]);
        for (row, Row { corner, normal }) in rows_b.iter_mut().zip(&self.b.rows) {
            let (px, py) = (lanes.four(&corner[0]), lanes.four(&corner[1]));
            let (nx, ny) = (lanes.four(&normal[0]), lanes.four(&normal[1]));
            *row = Row {
                corner: [(x + (c * px - s * py)).store(), (y + (s * px + c * py)).store()],
                normal: [(c * nx - s * ny).store(), (s * nx + c * ny).store()],
            };
        }
        Posed {
            a: Placed { rows: rows_a, corners: self.a.corners, edges: self.a.edges },
            b: Placed { rows: rows_b, corners: self.b.corners, edges: self.b.edges },
            scale: self.a.size + self.b.size + position.norm(),
            reach,
        }
    }
}

impl<const A: usize, const B: usize> Posed<A, B> {
    /// Where they touch; the largest s(n) that is known where that is beyond reach \[m\].
    #[inline(always)]
    fn touches<L: Lanes>(&self, lanes: L) -> Result<Ends, f64> {
        let mut out = Ends::default();
        let mut found = self.widest_edge(lanes)?;
        let tolerance = ROUNDING * self.scale;
        let over = self.facing_edges(lanes, &found, &mut out);
        // where the edges stand over each other no corner is nearer
        if found.gap > -tolerance && !(over && out.lowest() <= found.gap + tolerance) {
            let corner = self.nearest_corners(lanes);
            if corner.gap > found.gap + tolerance {
                found = corner;
                out.count = 0;
                if found.gap > self.reach {
                    return Err(found.gap);
                }
                self.facing_edges(lanes, &found, &mut out);
            }
        }
        if out.lowest() > found.gap + 1e-12 * self.scale {
            out.beside_witness(&found);
        }
        Ok(out)
    }

    /// The edge normal of either core with the largest s(n), that alone when it is beyond reach \[m\]; a's edges win ties.
    #[inline(always)]
    fn widest_edge<L: Lanes>(&self, lanes: L) -> Result<Separation<Planar>, f64> {
        let (a, b) = (&self.a, &self.b);
        let (of_a, of_b) = (a.gaps(lanes, b), b.gaps(lanes, a));
        let (most_a, most_b) = (largest(&of_a), largest(&of_b));
        let most = most_a.max(most_b);
        if most > self.reach {
            return Err(most);
        }
        let least = most - ROUNDING * self.scale;
        if most_a >= least {
            let edge = no_less(lanes, &of_a, least).trailing_zeros() as usize % (4 * A);
            let m = a.normal(edge);
            let j = b.farthest(lanes, -m);
            let on_b = b.corner(j);
            let gap = m.dot(on_b - a.corner(edge));
            let label = Label { a: [edge as u32, a.next(edge) as u32], b: [j as u32, NONE] };
            Ok(Separation { normal: -m, gap, on_a: on_b - m * gap, on_b, label })
        } else {
            let edge = no_less(lanes, &of_b, least).trailing_zeros() as usize % (4 * B);
            let m = b.normal(edge);
            let i = a.farthest(lanes, -m);
            let on_a = a.corner(i);
            let gap = m.dot(on_a - b.corner(edge));
            let label = Label { a: [i as u32, NONE], b: [edge as u32, b.next(edge) as u32] };
            Ok(Separation { normal: m, gap, on_a, on_b: on_a - m * gap, label })
        }
    }

    /// Ends of the overlap of the edges that face each other along the normal found; true where they stand over each
    /// other but for no slack.
    #[inline(always)]
    fn facing_edges<L: Lanes>(&self, lanes: L, found: &Separation<Planar>, out: &mut Ends) -> bool {
        let (a, b, normal, label) = (&self.a, &self.b, found.normal, found.label);
        let (i, j) = match (label.a[1] == NONE, label.b[1] == NONE) {
            (false, _) => (label.a[0] as usize, b.edge_toward(lanes, normal)),
            (_, false) => (a.edge_toward(lanes, -normal), label.b[0] as usize),
            _ => (a.edge_toward(lanes, -normal), b.edge_toward(lanes, normal)),
        };
        let tangent = normal.perp();
        let end = |p: Vec2, name: usize| -> End { (tangent.dot(p), p, name as u32) };
        let (next_i, next_j) = (a.next(i), b.next(j));
        let of_a = [end(a.corner(i), i), end(a.corner(next_i), next_i)];
        let of_b = [end(b.corner(j), j), end(b.corner(next_j), next_j)];
        between_ends([of_a, of_b], normal, SAME_END * self.scale, |t| out.push(t))
    }

    /// The two corners nearest to each other; of equal pairs the first of b's, then of a's. Coincident corners get the
    /// fixed normal y of a's frame.
    #[inline(always)]
    fn nearest_corners<L: Lanes>(&self, lanes: L) -> Separation<Planar> {
        let (a, b) = (&self.a, &self.b);
        let (mut least, mut i, mut j) = (f64::INFINITY, 0, 0);
        for k in 0..b.corners {
            let p = b.corner(k);
            let (x, y) = (lanes.four_of(p[0]), lanes.four_of(p[1]));
            let mut closeness = [x; A];
            for (closeness, Row { corner: [ax, ay], .. }) in closeness.iter_mut().zip(&a.rows) {
                let (dx, dy) = (lanes.four(ax) - x, lanes.four(ay) - y);
                *closeness = -(dx * dx + dy * dy);
            }
            let closest = largest(&closeness);
            if -closest < least {
                (least, j) = (-closest, k);
                i = no_less(lanes, &closeness, closest).trailing_zeros() as usize % (4 * A);
            }
        }
        let (on_a, on_b) = (a.corner(i), b.corner(j));
        let normal = (on_a - on_b).normalized().unwrap_or(vec2(0.0, 1.0));
        // corners that are nearest without being the nearest points overstate the gap: judge by s(n)
        let (low, high) = (a.farthest(lanes, -normal), b.farthest(lanes, normal));
        let gap = normal.dot(a.corner(low) - b.corner(high));
        Separation { normal, gap, on_a, on_b, label: Label::vertices(i as u32, j as u32) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::{Aabb, Guess};
    use crate::kernel::Kernel;
    use carom_math::Pose;
    use carom_math::lanes::Portable;

    /// A polygon of equal sides.
    fn polygon(corners: usize) -> PlanarCore {
        let turn = |k: usize| Turn::from_angle(std::f64::consts::TAU * k as f64 / corners as f64);
        PlanarCore::polygon((0..corners).map(|k| turn(k).rotate(vec2(0.5, 0.1))).collect())
    }

    #[test]
    fn boxes_of_rings_are_those_of_their_corners() {
        for core in [3, 4, 5, 8, 9].map(polygon) {
            for k in 0..60 {
                let pose = Pose::new(vec2(0.9, 1e3), Turn::from_angle(0.11 * f64::from(k)));
                let of_ring = Planar::bounds_of(&core, &pose);
                let mut corners = core.corners().iter().map(|corner| Aabb::of_point(pose.to_world(*corner)));
                let first = corners.next().expect("a corner");
                assert_eq!(of_ring, corners.fold(first, |all, one| all.union(&one)));
                if let Some(ring) = core.rows() {
                    let (all, own) = (Spans(ring, &pose.rotation), Spans(ring, &pose.rotation));
                    assert_eq!(dispatch(all), Portable.run(own));
                }
            }
        }
    }

    #[test]
    fn every_processor_finds_the_same_bits() {
        let cores = [3, 4, 5, 8].map(polygon);
        for (k, a) in cores.iter().enumerate() {
            for (l, b) in cores.iter().enumerate() {
                for turn in 0..60 {
                    let angle = 0.11 * f64::from(turn);
                    let place = Pose::new(vec2(0.9, 0.02 * f64::from(turn) - 0.5), Turn::from_angle(angle));
                    let swept = |core, pose| Swept { core, radius: 0.01 * k as f64, pose };
                    let origin = Pose::default();
                    let (own, other) = (swept(a, &place), swept(b, &origin));
                    let (mut one, mut all) = (Vec::new(), Vec::new());
                    let rows = [a, b].map(|core| core.rows().expect("few corners"));
                    let mut apart = [f64::NEG_INFINITY; 2];
                    let [of_one, of_all] = &mut apart;
                    let pair = |apart, out| Two {
                        a: rows[0],
                        b: rows[1],
                        swept: [&own, &other],
                        margin: 0.2,
                        apart,
                        out,
                    };
                    dispatch(pair(of_one, &mut one));
                    Portable.run(pair(of_all, &mut all));
                    assert_eq!(one, all, "polygons {k} and {l}, turned by {angle}");
                    assert_eq!(apart[0], apart[1]);
                    let b_in_a = place.inverse().compose(&origin);
                    let found = Planar::separation(a, b, &b_in_a, 9.0, &mut Guess::default());
                    let distance = found.map_or(f64::INFINITY, |found| found.gap) - own.radius - other.radius;
                    assert!(apart[0] <= distance + 1e-12, "{apart:?} of {distance}");
                    assert!(one.is_empty() == (apart[0] > 0.2), "{apart:?}");
                }
            }
        }
    }
}
