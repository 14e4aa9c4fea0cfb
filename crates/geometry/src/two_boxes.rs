//! Contact points of two boxes of space, rounded or not, in one go: s(n) of the 15 directions by closed forms, four at a
//! time (see `boxes`); where a face of one is the best, the face of the other that looks at it is cut in its plane (see
//! `box_faces`). What crossed edges or the distance search must settle is left to `separate`. Says what `pair_spatial`
//! says. Knows no composite shapes.

use crate::box_faces::{BoxFace, BoxFaces, Corners};
use crate::boxes::{PARALLEL, ROUNDING, SKEW};
use crate::core_spatial::SpatialCore;
use crate::geometry::{ContactPoint, Guess};
use crate::kernel::{Label, NONE, Separation, Swept, Touch, Touches, mix};
use crate::overlap::BIAS;
use crate::pair_spatial::{SAME_SIDE, settle};
use crate::separate::{self, NEAR, Pair};
use carom_math::lanes::{Four, Job, Lanes, dispatch};
use carom_math::{Column, Pose, Quaternion, Rotation, Spatial, Vec3, vec3};

/// Appends the contact points of two boxes with gaps up to `margin` \[m\], their names distinct; false where one is no box.
/// Where something shows them farther apart, `apart` becomes by how much \[m\].
pub fn contacts(
    a: &Swept<Spatial>,
    b: &Swept<Spatial>,
    margin: f64,
    apart: &mut f64,
    out: &mut Vec<ContactPoint<Spatial>>,
) -> bool {
    let Some(boxes) = Boxes::of([a, b], margin) else { return false };
    dispatch(Tell { boxes, apart, out });
    true
}

#[inline]
fn half_of(core: &SpatialCore) -> Option<Vec3> {
    if let SpatialCore::Polytope(polytope) = core { polytope.half } else { None }
}

/// Two boxes and where b stands in a's frame.
struct Boxes<'a, 'b> {
    swept: [&'a Swept<'b, Spatial>; 2],
    halves: [Vec3; 2],
    position: Vec3,
    rotation: Quaternion,
    /// Length against which rounding is measured \[m\].
    scale: f64,
    /// Largest gap of the cores \[m\].
    reach: f64,
}

/// The axes of two boxes, laid out for work on several at a time.
struct Axes {
    /// a_i.b_j by i.
    rows: [[f64; 4]; 3],
    /// The same by j, again and again.
    columns: [[f64; 8]; 3],
    /// Centre of b \[m\], again and again.
    place: [f64; 8],
    /// Half sides of a \[m\], again and again.
    half: [f64; 8],
    halves: [Vec3; 2],
}

/// Three numbers so often that four that begin at any of the first three are in a row.
#[inline(always)]
fn again([x, y, z]: [f64; 3]) -> [f64; 8] {
    [x, y, z, x, y, z, x, y]
}

/// Four numbers of a column from one on.
#[inline(always)]
fn from<L: Lanes>(lanes: L, column: &[f64; 8], first: usize) -> L::Four {
    let first = first % 5;
    lanes.four(&[column[first], column[first + 1], column[first + 2], column[first + 3]])
}

/// Tells of the contacts of two boxes.
struct Tell<'a, 'b, 'c> {
    boxes: Boxes<'a, 'b>,
    apart: &'c mut f64,
    out: &'c mut Vec<ContactPoint<Spatial>>,
}

impl Job for Tell<'_, '_, '_> {
    type Output = ();
    #[inline(always)]
    fn work<L: Lanes>(self, lanes: L) {
        let Tell { boxes, apart, out } = self;
        let mut touches = Touches::<Spatial>::default();
        let ([a, b], first) = (boxes.swept, out.len());
        if let Some(gap) = boxes.touches(lanes, &mut touches) {
            *apart = gap - (a.radius + b.radius);
        }
        if touches.is_empty() {
            return;
        }
        let m = a.pose.rotation.matrix();
        let turned = |v: Vec3| vec3(dot(m[0], v), dot(m[1], v), dot(m[2], v));
        let (normal, radii) = (turned(touches[0].normal), a.radius + b.radius);
        for t in touches.iter() {
            let middle = (t.on_a + t.on_b - t.normal * (a.radius - b.radius)) * 0.5;
            let mut feature = mix(mix(0, 0), t.label.code());
            while out[first..].iter().any(|p| p.feature == feature) {
                feature = mix(feature, 1);
            }
            let point = a.pose.position + turned(middle);
            out.push(ContactPoint { feature, point, normal, gap: t.gap - radii, curvature: 0.0 });
        }
    }
}

#[inline(always)]
fn dot(row: [f64; 3], v: Vec3) -> f64 {
    row[0] * v[0] + row[1] * v[1] + row[2] * v[2]
}

impl<'a, 'b> Boxes<'a, 'b> {
    /// Two boxes; `None` where one is none.
    #[inline]
    fn of([a, b]: [&'a Swept<'b, Spatial>; 2], margin: f64) -> Option<Self> {
        let halves = [half_of(a.core)?, half_of(b.core)?];
        // the difference of positions first: far from the world's origin it is small and exact
        let position = a.pose.rotation.unrotate(b.pose.position - a.pose.position);
        Some(Boxes {
            swept: [a, b],
            halves,
            position,
            rotation: a.pose.rotation.inverse().product(&b.pose.rotation),
            scale: a.core.size() + b.core.size() + position.norm(),
            reach: margin + a.radius + b.radius,
        })
    }
}

impl Boxes<'_, '_> {
    /// Where they touch; the largest s(n) that is known where that is beyond reach \[m\].
    #[inline(always)]
    fn touches<L: Lanes>(&self, lanes: L, out: &mut Touches<Spatial>) -> Option<f64> {
        let axes = self.axes();
        let face = match axes.best_face(lanes, self.scale, self.reach) {
            Ok(face) => face,
            Err(beyond) => return Some(beyond),
        };
        let mut found = face;
        // where a point of the one box stands over the face of the other as near as that, the face has the last word
        let mut asks = face.gap <= NEAR * self.scale;
        loop {
            if asks {
                found = match self.best(lanes, &axes, face) {
                    Ok(best) => best,
                    Err(beyond) => return Some(beyond),
                };
            }
            let nearest = self.facing(lanes, &axes, found.normal, out);
            if asks || nearest <= face.gap + separate::ROUNDING * self.scale {
                break;
            }
            asks = true;
            out.clear();
        }
        settle(&found, self.scale, self.reach, out);
        None
    }

    /// The direction of the largest s(n), given that of the best face; beyond reach what is known of it \[m\].
    #[inline(always)]
    fn best<L: Lanes>(
        &self,
        lanes: L,
        axes: &Axes,
        face: Separation<Spatial>,
    ) -> Result<Separation<Spatial>, f64> {
        let near = NEAR * self.scale;
        match axes.best_edges(lanes, face.gap + BIAS * self.scale, self.scale) {
            Edges::Worse if face.gap <= near => Ok(face),
            Edges::Best { found, .. } if found.gap > self.reach => Err(found.gap),
            Edges::Best { found, inside, sine } if found.gap <= near || (inside && sine >= SKEW) => Ok(found),
            _ => self.by_pieces(),
        }
    }

    /// The direction of the largest s(n), by the search for solids of any kind.
    #[cold]
    #[inline(never)]
    fn by_pieces(&self) -> Result<Separation<Spatial>, f64> {
        let ([a, b], mut guess) = (self.swept, Guess::default());
        let place = Pose::new(self.position, self.rotation);
        let pair = Pair::new(a.core, b.core, &place);
        pair.separation_near(self.reach, &mut guess).ok_or(guess.apart)
    }

    #[inline(always)]
    fn axes(&self) -> Axes {
        let (m, t, [g, h]) = (self.rotation.matrix(), self.position, self.halves);
        Axes {
            rows: [
                [m[0][0], m[0][1], m[0][2], 0.0],
                [m[1][0], m[1][1], m[1][2], 0.0],
                [m[2][0], m[2][1], m[2][2], 0.0],
            ],
            columns: [
                again([m[0][0], m[1][0], m[2][0]]),
                again([m[0][1], m[1][1], m[2][1]]),
                again([m[0][2], m[1][2], m[2][2]]),
            ],
            place: again(t.0),
            half: again(g.0),
            halves: [g, h],
        }
    }

    /// The touches of the faces that look at each other along a normal from b to a; the smallest gap of a point that is
    /// over the other's face but for no slack \[m\].
    #[inline(always)]
    fn facing<L: Lanes>(&self, lanes: L, axes: &Axes, normal: Vec3, out: &mut Touches<Spatial>) -> f64 {
        let ([g, h], turned) = (self.halves, axes.transposed(normal));
        let (face_a, face_b) = (leaning(-normal), leaning(turned));
        let slack = SAME_SIDE * self.scale;
        let (of_a, of_b) = (BoxFace { half: g, number: face_a.0 }, BoxFace { half: h, number: face_b.0 });
        // b is cut by a unless b's is clearly the better aligned face: rounding must not swap labels
        let knife_is_a = face_a.1 >= face_b.1 - 1e-4;
        let [x, y, z] = &axes.columns;
        let columns = [vec3(x[0], x[1], x[2]), vec3(y[0], y[1], y[2]), vec3(z[0], z[1], z[2])];
        let faces = if knife_is_a {
            BoxFaces { knife: of_a, cut: of_b, place: self.position, axes: columns, direction: normal, slack }
        } else {
            let [x, y, z] = &axes.rows;
            let rows = [vec3(x[0], x[1], x[2]), vec3(y[0], y[1], y[2]), vec3(z[0], z[1], z[2])];
            let place = -axes.transposed(self.position);
            BoxFaces { knife: of_b, cut: of_a, place, axes: rows, direction: -turned, slack }
        };
        let (mut one, mut other) = (Corners::default(), Corners::default());
        let corners = faces.overlap(lanes, &mut one, &mut other);
        let ([w, u, v], knife) = (faces.knife.axes(), faces.knife);
        let mut nearest = f64::INFINITY;
        for corner in corners.all() {
            let ([x, y], gap) = (corner.at, corner.gap);
            if gap < nearest && x.abs() <= knife.half[u] && y.abs() <= knife.half[v] {
                nearest = gap;
            }
            let mut on_knife = Vec3::ZERO;
            (on_knife[w], on_knife[u], on_knife[v]) = (knife.sign() * knife.half[w], x, y);
            let label = faces.label(corner);
            let touch = if knife_is_a {
                let label = Label { a: label.b, b: label.a };
                Touch { normal, gap, on_a: on_knife, on_b: on_knife - normal * gap, label }
            } else {
                let on_b = self.position
                    + columns[0] * on_knife[0]
                    + columns[1] * on_knife[1]
                    + columns[2] * on_knife[2];
                Touch { normal, gap, on_a: on_b + normal * gap, on_b, label }
            };
            out.push(touch);
        }
        nearest
    }
}

/// The face that leans most along a direction, and how much.
#[inline(always)]
fn leaning(direction: Vec3) -> (usize, f64) {
    let [x, y, z] = direction.0.map(f64::abs);
    let (axis, lean) = if y > x {
        if z > y { (2, z) } else { (1, y) }
    } else if z > x {
        (2, z)
    } else {
        (0, x)
    };
    (2 * axis + usize::from(direction[axis] < 0.0), lean)
}

impl Axes {
    /// A direction of a's frame in b's.
    #[inline(always)]
    fn transposed(&self, v: Vec3) -> Vec3 {
        let [x, y, z] = &self.columns;
        vec3(
            x[0] * v[0] + x[1] * v[1] + x[2] * v[2],
            y[0] * v[0] + y[1] * v[1] + y[2] * v[2],
            z[0] * v[0] + z[1] * v[1] + z[2] * v[2],
        )
    }

    /// The best face normal of either box, its s(n) alone beyond reach; a's faces win ties, and of each those before.
    #[inline(always)]
    fn best_face<L: Lanes>(&self, lanes: L, scale: f64, reach: f64) -> Result<Separation<Spatial>, f64> {
        let (m, [g, h], bias) = (&self.columns, self.halves, BIAS * scale);
        let four = |x: f64| lanes.four_of(x);
        let [c0, c1, c2] = [from(lanes, &m[0], 0), from(lanes, &m[1], 0), from(lanes, &m[2], 0)];
        let t = from(lanes, &self.place, 0);
        let reach_b = c0.abs() * four(h[0]) + c1.abs() * four(h[1]) + c2.abs() * four(h[2]);
        let of_a = (t.abs() - reach_b - from(lanes, &self.half, 0)).store();
        let [r0, r1, r2] = [lanes.four(&self.rows[0]), lanes.four(&self.rows[1]), lanes.four(&self.rows[2])];
        let reach_a = r0.abs() * four(g[0]) + r1.abs() * four(g[1]) + r2.abs() * four(g[2]);
        let along = r0 * four(self.place[0]) + r1 * four(self.place[1]) + r2 * four(self.place[2]);
        let of_b = (along.abs() - reach_a - lanes.four(&[h[0], h[1], h[2], f64::INFINITY])).store();
        let most_a = of_a[0].max(of_a[1]).max(of_a[2]);
        let most = most_a.max(of_b[0]).max(of_b[1]).max(of_b[2]);
        if most > reach {
            return Err(most);
        }
        let least = most - bias;
        let first = |gaps: &[f64; 4]| {
            if gaps[0] >= least {
                0
            } else if gaps[1] >= least {
                1
            } else {
                2
            }
        };
        if most_a >= least {
            let k = first(&of_a);
            let sign = if 2.0 * self.place[k] < -bias { -1.0 } else { 1.0 };
            Ok(self.along_face_of_a(k, sign))
        } else {
            let k = first(&of_b);
            let sign = if 2.0 * along.store()[k] > bias { -1.0 } else { 1.0 };
            Ok(self.along_face_of_b(k, sign))
        }
    }

    #[inline(always)]
    fn along_face_of_a(&self, k: usize, sign: f64) -> Separation<Spatial> {
        let ([g, h], m) = (self.halves, &self.columns);
        let (mut name, mut corner) = (0, vec3(self.place[0], self.place[1], self.place[2]));
        for j in 0..3 {
            let up = -sign * m[j][k] >= 0.0;
            name |= u32::from(up) << j;
            let half = if up { h[j] } else { -h[j] };
            corner += vec3(m[j][0] * half, m[j][1] * half, m[j][2] * half);
        }
        let mut outward = Vec3::ZERO;
        outward[k] = sign;
        let gap = sign * corner[k] - g[k];
        let label = Label { a: [NONE, NONE], b: [name, NONE] };
        Separation { normal: -outward, gap, on_a: corner - outward * gap, on_b: corner, label }
    }

    #[inline(always)]
    fn along_face_of_b(&self, k: usize, sign: f64) -> Separation<Spatial> {
        let ([g, h], column) = (self.halves, &self.columns[k]);
        let normal = vec3(sign * column[0], sign * column[1], sign * column[2]);
        let (mut name, mut corner) = (0, Vec3::ZERO);
        for i in 0..3 {
            let up = -normal[i] >= 0.0;
            name |= u32::from(up) << i;
            corner[i] = if up { g[i] } else { -g[i] };
        }
        let place = vec3(self.place[0], self.place[1], self.place[2]);
        let gap = normal.dot(corner - place) - h[k];
        let label = Label { a: [name, NONE], b: [NONE, NONE] };
        Separation { normal, gap, on_a: corner, on_b: corner - normal * gap, label }
    }

    /// The direction across two edges with the largest s(n), if that is beyond `clear` \[m\].
    #[inline(always)]
    fn best_edges<L: Lanes>(&self, lanes: L, clear: f64, scale: f64) -> Edges {
        let (m, [_, h]) = (&self.columns, self.halves);
        let (clear_of, rounding) = (lanes.four_of(clear), lanes.four_of(ROUNDING * scale));
        let (t_u, t_v) = (from(lanes, &self.place, 1), from(lanes, &self.place, 2));
        let (g_u, g_v) = (from(lanes, &self.half, 1), from(lanes, &self.half, 2));
        let (mut any, mut sets) = (0, [0; 3]);
        let (mut scaled, mut sines) = ([lanes.four_of(0.0); 3], [lanes.four_of(0.0); 3]);
        // a_i x b_j for all i at once: (-m_vj, m_uj) on the axes u and v that follow i, and |n.b_k| = |a_i.b_l|
        for j in 0..3 {
            let (k, l) = ([1, 2, 0][j], [2, 0, 1][j]);
            let (x, y) = (from(lanes, &m[j], 2), from(lanes, &m[j], 1));
            let reach_a = x.abs() * g_u + y.abs() * g_v;
            let (b_k, b_l) = (from(lanes, &m[k], 0).abs(), from(lanes, &m[l], 0).abs());
            let reach_b = b_l * lanes.four_of(h[k]) + b_k * lanes.four_of(h[l]);
            let squared = x * x + y * y;
            scaled[j] = (y * t_v - x * t_u).abs() - reach_a - reach_b;
            sines[j] = squared.sqrt();
            let beyond = (clear_of * sines[j]).less(scaled[j] + rounding);
            sets[j] = beyond & lanes.four_of(PARALLEL).less(squared) & 7;
            any |= sets[j];
        }
        if any == 0 {
            return Edges::Worse;
        }
        let (mut best, mut second, mut which) = (f64::NEG_INFINITY, f64::NEG_INFINITY, [0; 2]);
        for j in 0..3 {
            let gaps = (scaled[j] / sines[j]).store();
            for (i, &gap) in gaps[..3].iter().enumerate().filter(|(i, _)| sets[j] >> i & 1 == 1) {
                if gap > best {
                    (best, second, which) = (gap, best, [i, j]);
                } else {
                    second = second.max(gap);
                }
            }
        }
        let [i, j] = which;
        let sine = sines[j].store()[i];
        // what rounding may turn round is settled edge by edge
        let doubt = (BIAS + ROUNDING / sine) * scale;
        if best <= clear + doubt || best - second <= 2.0 * doubt {
            return Edges::Unclear;
        }
        self.across(which, sine, 2.0 * BIAS * scale)
    }

    /// What the edges say that support the direction a_i x b_j; sides within `same` \[m\] of each other leave it open.
    #[inline(always)]
    fn across(&self, [i, j]: [usize; 2], sine: f64, same: f64) -> Edges {
        let ([g, h], m) = (self.halves, &self.columns);
        let (u, v) = ([1, 2, 0][i], [2, 0, 1][i]);
        let (k, l) = ([1, 2, 0][j], [2, 0, 1][j]);
        let (x, y) = (-m[j][v] / sine, m[j][u] / sine);
        let apart = x * self.place[u] + y * self.place[v];
        let sign = if apart > 0.0 { -1.0 } else { 1.0 };
        let (x, y) = (sign * x, sign * y);
        let mut normal = Vec3::ZERO;
        (normal[u], normal[v]) = (x, y);
        let (p, q) = (x * m[k][u] + y * m[k][v], x * m[l][u] + y * m[l][v]);
        let nearest = (g[u] * x.abs()).min(g[v] * y.abs()).min(h[k] * p.abs()).min(h[l] * q.abs());
        if 2.0 * nearest <= same || 2.0 * apart.abs() <= same {
            return Edges::Unclear;
        }
        let side = |half: f64, up: bool| if up { half } else { -half };
        let name = |along: usize, [(c, up_c), (d, up_d)]: [(usize, bool); 2]| {
            let low = u32::from(up_c) << c | u32::from(up_d) << d;
            [low, low | 1 << along]
        };
        // the edge of a that is farthest against the normal, and that of b along it: where each begins, and its half
        let mut from_a = Vec3::ZERO;
        (from_a[i], from_a[u], from_a[v]) = (-g[i], side(g[u], x <= 0.0), side(g[v], y <= 0.0));
        let column = |k: usize| vec3(m[k][0], m[k][1], m[k][2]);
        let place = vec3(self.place[0], self.place[1], self.place[2]);
        let from_b =
            place + column(k) * side(h[k], p >= 0.0) + column(l) * side(h[l], q >= 0.0) - column(j) * h[j];
        let label =
            Label { a: name(i, [(u, x <= 0.0), (v, y <= 0.0)]), b: name(j, [(k, p >= 0.0), (l, q >= 0.0)]) };
        // places along both edges where they pass each other
        let (w, cosine) = (from_b - from_a, m[j][i]);
        let (along_a, along_b, squared) = (w[i], w.dot(column(j)), sine * sine);
        let s = (along_a - along_b * cosine) / (squared * 2.0 * g[i]);
        let t = (along_a * cosine - along_b) / (squared * 2.0 * h[j]);
        let inside = (0.0..=1.0).contains(&s) && (0.0..=1.0).contains(&t);
        let mut on_a = from_a;
        on_a[i] += 2.0 * g[i] * s.clamp(0.0, 1.0);
        let on_b = from_b + column(j) * (2.0 * h[j] * t.clamp(0.0, 1.0));
        let gap = normal.dot(from_a - from_b);
        Edges::Best { found: Separation { normal, gap, on_a, on_b, label }, inside, sine }
    }
}

/// What directions across two edges say beside a face's.
#[allow(clippy::large_enum_variant, reason = "lives on the stack for one query")]
enum Edges {
    /// None is better.
    Worse,
    /// Rounding may decide.
    Unclear,
    /// The best; whether the edges pass each other inside both; the sine of the angle between them \[1\].
    Best { found: Separation<Spatial>, inside: bool, sine: f64 },
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::polytope::Polytope;
    use carom_math::lanes::Portable;
    use std::sync::Arc;

    #[test]
    fn every_processor_finds_the_same_bits() {
        let cores = [[0.5, 0.5, 0.5], [0.3, 0.2, 0.6], [4.0, 4.0, 0.5]]
            .map(|half| SpatialCore::Polytope(Arc::new(Polytope::cuboid(half))));
        let mut points = 0;
        for a in &cores {
            for b in &cores {
                for k in 0..200 {
                    let x = f64::from(k);
                    let turn = Quaternion::about(vec3(
                        0.01 * x,
                        (0.37 * x) % 1.0,
                        if k % 3 == 0 { 0.0 } else { 0.7 },
                    ));
                    let place = vec3((0.13 * x) % 0.6, (0.29 * x) % 0.5, 0.6 + (0.07 * x) % 0.5);
                    let (pose, origin) = (Pose::new(place, turn), Pose::default());
                    let (own, other) = (
                        Swept { core: a, radius: 0.0, pose: &pose },
                        Swept { core: b, radius: 0.1, pose: &origin },
                    );
                    let (mut one, mut all) = (Vec::new(), Vec::new());
                    let mut apart = [f64::NEG_INFINITY; 2];
                    let boxes = || Boxes::of([&own, &other], 0.1).expect("boxes");
                    let [of_one, of_all] = &mut apart;
                    dispatch(Tell { boxes: boxes(), apart: of_one, out: &mut one });
                    Portable.run(Tell { boxes: boxes(), apart: of_all, out: &mut all });
                    assert_eq!(one, all);
                    assert_eq!(apart[0], apart[1]);
                    let found = Pair::new(own.core, other.core, &own.pose.inverse().compose(other.pose))
                        .separation(9.0);
                    let distance = found.map_or(f64::INFINITY, |found| found.gap);
                    assert!(apart[0] <= distance + 1e-9, "{apart:?} of {distance}");
                    points += one.len();
                }
            }
        }
        assert!(points > 1000);
    }
}
