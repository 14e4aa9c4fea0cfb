//! The faces of four pairs of boxes that look at each other along a direction, one cut by the other as seen along it: the face
//! that cuts is a rectangle with sides along two axes of its box, the other is seen as a parallelogram, and a point is two
//! places and a gap. The points of an overlap are the corners of either that are inside the other and the crossings of
//! their sides (Liang and Barsky 1984), each asked by itself, so that four pairs go side by side. Knows no radii.

use crate::box_axes::{Boxes, Triple, choose, dot, pick};
use crate::box_names::{CORNERS, CROSSINGS, EDGES, is_above};
use carom_math::lanes::Four;
use carom_math::{Vec2, Vec3, vec2, vec3};

/// A side of the other face is cut by unless that of a is better aligned by this \[1\]: rounding must not swap labels.
const CLEARLY: f64 = 1e-4;
/// Points that are asked after: corners of the face that is cut and of the one that cuts, and where the edges of the first enter
/// and leave the other.
const POINTS: usize = 4 * CORNERS;

/// Points by their numbers (corners of the face that is cut, of the other, where edges enter, where they leave) in the order of a
/// walk around the face that is cut, above and below its box: as `clip` has them.
const AROUND: [[usize; POINTS]; 2] = [
    [0, 8, 12, 1, 11, 15, 2, 13, 9, 3, 14, 10, 4, 5, 6, 7],
    [0, 10, 14, 3, 9, 13, 2, 15, 11, 1, 12, 8, 4, 5, 6, 7],
];

/// The overlaps of four pairs of faces.
#[derive(Default)]
pub struct Overlaps {
    /// Places on the face that cuts, along the axes that follow its own, and gaps \[m\].
    at: [[[f64; 4]; 3]; POINTS],
    /// In which pairs the points are: four bits to a point.
    are: u64,
    /// Where the edges along each axis of the cut face run down along each axis of the other, bit by bit.
    down: [[u32; 2]; 2],
    /// Where each of the edges enters and leaves across a side along the first axis.
    by_first: [[u32; 2]; CORNERS],
    /// Where the face that cuts is a's.
    by_a: u32,
    /// Six times the number of the face that cuts and that of the one that is cut: twice their axis, and one more below.
    faces: [f64; 4],
    /// In the world: both axes along the face that cuts, the normal, and the way from the centre of its box to it \[m\].
    frame: [[[f64; 4]; 3]; 4],
    /// Places closer than this are one \[m\].
    slack: [f64; 4],
}

/// The overlap of one pair in the world.
pub struct Overlap<'a> {
    /// Both axes along the face that cuts, the normal, and the way from the centre of its box to it \[m\].
    pub frame: [Vec3; 4],
    /// Whether the face of a cuts.
    pub by_a: bool,
    /// Six times the number of the face that cuts and that of the one that is cut.
    pub faces: usize,
    /// Places closer than this are one \[m\].
    pub slack: f64,
    of: &'a Overlaps,
    lane: usize,
    /// Its points, four bits to each, and how many were told of.
    are: u64,
    at: usize,
}

/// A point of an overlap.
pub struct Spot {
    /// Places along the axes of the face that cuts \[m\].
    pub at: [f64; 2],
    /// From the one face to the other along the direction \[m\].
    pub gap: f64,
    /// Its number among the names of the two faces.
    pub name: usize,
}

impl Overlaps {
    /// Whether any pair has points.
    #[inline(always)]
    pub fn any(&self) -> bool {
        self.are != 0
    }

    /// That of one pair.
    #[inline(always)]
    pub fn of(&self, lane: usize) -> Overlap<'_> {
        let lane = lane % 4;
        let at = |v: &[[f64; 4]; 3]| vec3(v[0][lane], v[1][lane], v[2][lane]);
        let [u, v, normal, way] = &self.frame;
        Overlap {
            frame: [at(u), at(v), at(normal), at(way)],
            by_a: self.by_a >> lane & 1 == 1,
            faces: self.faces[lane] as usize,
            slack: self.slack[lane],
            of: self,
            lane,
            are: self.are >> lane,
            at: 0,
        }
    }
}

impl Iterator for Overlap<'_> {
    type Item = Spot;
    /// Around the face that is cut, counter-clockwise as seen from outside of its box; then corners of the other.
    #[inline(always)]
    fn next(&mut self) -> Option<Spot> {
        while self.at < POINTS {
            let (k, lane) = (AROUND[self.faces & 1][self.at] % POINTS, self.lane);
            self.at += 1;
            if self.are >> (4 * k) & 1 == 1 {
                let [x, y, gap] = &self.of.at[k];
                let name = if k < CROSSINGS { k } else { self.crossing(k % CORNERS, k / CORNERS - 2) };
                return Some(Spot { at: [x[lane], y[lane]], gap: gap[lane], name });
            }
        }
        None
    }
}

impl Overlap<'_> {
    /// The corner of the face that is cut with which a walk around it begins, wherever it is \[m\].
    #[inline(always)]
    pub fn begins(&self) -> Vec2 {
        vec2(self.of.at[0][0][self.lane], self.of.at[0][1][self.lane])
    }
    /// The number of the crossing in which an edge enters (0) or leaves (1).
    #[inline(always)]
    fn crossing(&self, edge: usize, way: usize) -> usize {
        let is = |set: u32| usize::from(set >> self.lane & 1 == 1);
        let axis = 1 - is(self.of.by_first[edge][way]);
        // what runs down enters from above
        let below = (1 - way) ^ is(self.of.down[edge / 2][axis]);
        CROSSINGS + 4 * edge + 2 * axis + below
    }
}

/// Two faces in the frame of the box that cuts.
struct Seen<F> {
    /// The middle of the face that is cut: places on the other along the axes that follow its own, and the gap \[m\].
    middle: Triple<F>,
    /// Half of its edges along both axes that follow its own.
    edges: [Triple<F>; 2],
    /// Half sides of the face that cuts \[m\].
    half: [F; 2],
    /// Points this close are one \[m\].
    slack: F,
    /// Corners this close to a side count as inside, along both axes of the face that cuts \[m\].
    slack_of: [F; 2],
    /// No gap is less \[m\].
    floor: F,
    /// No gap is more \[m\].
    reach: F,
}

/// Three numbers, the first of them that of a number's axis and the others those of the axes that follow.
#[inline(always)]
fn from<F: Four>(axis: F, [x, y, z]: Triple<F>) -> Triple<F> {
    [pick(axis, [x, y, z]), pick(axis, [y, z, x]), pick(axis, [z, x, y])]
}

/// The axis along which a direction leans most, and how much; the first of several.
#[inline(always)]
fn leaning<F: Four>(direction: &Triple<F>) -> (F, F) {
    let [x, y, z] = [direction[0].abs(), direction[1].abs(), direction[2].abs()];
    let axis = x.if_less(y, x.like(1.0), x.like(0.0));
    let most = x.if_less(y, y, x);
    (most.if_less(z, x.like(2.0), axis), most.if_less(z, z, most))
}

/// A vector, its part across the face that cuts first, moved along the direction to a level: places there, and the way \[m\].
#[inline(always)]
fn laid<F: Four>([along, u, v]: Triple<F>, (level, by): (F, F), [x, y]: [F; 2]) -> Triple<F> {
    let gap = (level - along) * by;
    [u + x * gap, v + y * gap, gap]
}

#[inline(always)]
fn negated<F: Four>(v: &Triple<F>) -> Triple<F> {
    [-v[0], -v[1], -v[2]]
}

impl<F: Four> Boxes<F> {
    /// The points of the faces that look at each other along a normal with gaps up to reach, none of them less than `floor` \[m\]; the
    /// smallest gap of what is over the other's face but for no slack \[m\].
    #[inline(always)]
    pub fn overlap(&self, normal: &Triple<F>, floor: F, same_side: f64, out: &mut Overlaps) -> F {
        let slack = self.scale * self.scale.like(same_side);
        (out.slack, out.are) = (slack.store(), 0);
        let seen = self.seen(normal, (slack, floor), out);
        let inside = seen.corners(out);
        let nearest = seen.crossings(inside, out);
        seen.corners_of_knife(nearest, out)
    }

    /// The faces that look at each other along a normal, as they are seen along it.
    #[inline(always)]
    fn seen(&self, normal: &Triple<F>, (slack, floor): (F, F), out: &mut Overlaps) -> Seen<F> {
        let ([g, h], rows, m) = (&self.halves, &self.rows, self.in_b(normal));
        let ((axis_a, lean_a), (axis_b, lean_b)) = (leaning(normal), leaning(&m));
        let limit = lean_b - lean_b.like(CLEARLY);
        out.by_a = !lean_a.less(limit);
        // from the box that cuts to the other: along b's frame where b cuts
        let direction = choose(lean_a, limit, &negated(&m), normal);
        let lean = choose(lean_a, limit, &negated(normal), &m);
        let place = choose(lean_a, limit, &negated(&self.along), &self.place);
        let (half, of_cut) = (choose(lean_a, limit, h, g), choose(lean_a, limit, g, h));
        let (w, f) = (lean_a.if_less(limit, axis_b, axis_a), lean_a.if_less(limit, axis_a, axis_b));
        // the axes of the face that is cut, its own first, by component
        let mut axes = [place; 3];
        for c in 0..3 {
            let of_b = [rows[c][0], rows[c][1], rows[c][2]];
            let of_a = [rows[0][c], rows[1][c], rows[2][c]];
            axes[c] = from(f, choose(lean_a, limit, &of_a, &of_b));
        }
        let ([own, one, other], lean) = (from(f, of_cut), pick(f, lean));
        let zero = own.like(0.0);
        let outward = lean.if_less(zero, -own, own);
        let mut middle = place;
        let mut edges = [place; 2];
        for c in 0..3 {
            middle[c] = place[c] + axes[c][0] * outward;
            edges[0][c] = axes[c][1] * one;
            edges[1][c] = axes[c][2] * other;
        }
        let ([n, x, y], [depth, half_x, half_y]) = (from(w, direction), from(w, half));
        let level = zero.if_less(n, -depth, depth);
        let by = n.like(1.0) / n;
        let middle = laid(from(w, middle), (level, by), [x, y]);
        let edges =
            [laid(from(w, edges[0]), (zero, by), [x, y]), laid(from(w, edges[1]), (zero, by), [x, y])];
        let one = n.like(1.0);
        // in the world
        let (turn_a, turn_b) = (&self.turns[0], &self.turns[1]);
        for i in 0..3 {
            let [across, u, v] = from(w, choose(lean_a, limit, &turn_b[i], &turn_a[i]));
            out.frame[0][i] = u.store();
            out.frame[1][i] = v.store();
            out.frame[2][i] = dot(&turn_a[i], normal).store();
            out.frame[3][i] = (across * level).store();
        }
        let (knife, cut) = (w + w + zero.if_less(n, one, zero), f + f + lean.if_less(zero, one, zero));
        out.faces = (knife * one.like(6.0) + cut).store();
        // what is seen aslant moves farther along the face than across
        let aslant = slack * by.abs();
        let slack_of = [aslant * (x * x + n * n).sqrt(), aslant * (y * y + n * n).sqrt()];
        Seen { middle, edges, half: [half_x, half_y], slack, slack_of, floor, reach: self.reach }
    }
}

impl<F: Four> Seen<F> {
    /// Writes a point that is in some of the pairs.
    #[inline(always)]
    fn put(&self, k: usize, [x, y, gap]: Triple<F>, are: u32, out: &mut Overlaps) {
        out.at[k] = [x.store(), y.store(), gap.max(self.floor).store()];
        out.are |= u64::from(are & !self.reach.less(gap) & 15) << (4 * k);
    }

    /// Corners of the face that is cut; in which pairs they are inside of the other.
    #[inline(always)]
    fn corners(&self, out: &mut Overlaps) -> [u32; CORNERS] {
        let ([a, b], [half_x, half_y]) = (&self.edges, self.half);
        let (limit_x, limit_y) = (half_x + self.slack_of[0], half_y + self.slack_of[1]);
        let mut inside = [0; CORNERS];
        for (k, inside) in inside.iter_mut().enumerate() {
            let mut at = self.middle;
            let above = is_above(k);
            for c in 0..3 {
                let along = if above[0] { at[c] + a[c] } else { at[c] - a[c] };
                at[c] = if above[1] { along + b[c] } else { along - b[c] };
            }
            *inside = !(limit_x.less(at[0].abs()) | limit_y.less(at[1].abs()));
            self.put(k, at, *inside, out);
        }
        inside
    }

    /// Where the edges of the face that is cut enter and leave the other; the smallest gap on them there.
    #[inline(always)]
    fn crossings(&self, inside: [u32; CORNERS], out: &mut Overlaps) -> F {
        let (one, zero, none) = (self.slack.like(1.0), self.slack.like(0.0), self.slack.like(f64::INFINITY));
        let mut nearest = none;
        for d in 0..2 {
            let (edge, side) = (&self.edges[d], &self.edges[1 - d]);
            out.down[d] = [edge[0].less(zero), edge[1].less(zero)];
            let (by_x, by_y) = (one / edge[0], one / edge[1]);
            let length = edge[0].abs() + edge[1].abs();
            for k in 0..2 {
                let (e, mut from) = (2 * d + k, self.middle);
                for c in 0..3 {
                    from[c] = if k == 1 { from[c] + side[c] } else { from[c] - side[c] };
                }
                let (low_x, high_x) = self.between(from[0], edge[0], by_x, 0);
                let (low_y, high_y) = self.between(from[1], edge[1], by_y, 1);
                let (low, high) = (low_x.max(low_y).max(-one), high_x.min(high_y).min(one));
                out.by_first[e] = [low_y.less(low_x), high_x.less(high_y)];
                // an edge that passes a corner of the other touches it, whatever rounding says
                let (empty, [p, q]) = (self.slack.less((low - high) * length), EDGES[e]);
                // what enters where it leaves is one point, and none where a corner is
                let short = !self.slack.less((high - low) * length);
                let enters = !empty & !inside[p] & !(short & inside[q]);
                let leaves = !empty & !inside[q] & !short;
                let (mut first, mut last) = (from, from);
                for c in 0..3 {
                    first[c] = from[c] + edge[c] * low;
                    last[c] = from[c] + edge[c] * high;
                }
                self.put(CROSSINGS + e, first, enters, out);
                self.put(CROSSINGS + CORNERS + e, last, leaves, out);
                nearest = high.if_less(low, none, first[2].min(last[2])).min(nearest);
            }
        }
        nearest
    }

    /// Between which multiples of an edge it is between two sides, along the axis across them.
    #[inline(always)]
    fn between(&self, from: F, edge: F, by: F, axis: usize) -> (F, F) {
        let (half, slack) = (self.half[axis], self.slack_of[axis]);
        let (middle, width) = (-(from * by), half * by.abs());
        // what runs along the sides is between both or outside
        let far = half.like(4.0);
        let outside = (half + slack).if_less(from.abs(), far, -far);
        let low = slack.if_less(edge.abs(), middle - width, outside);
        let high = slack.if_less(edge.abs(), middle + width, -outside);
        (low, high)
    }

    /// Corners of the face that cuts; the smaller of their gaps inside the other one and another gap.
    #[inline(always)]
    fn corners_of_knife(&self, other: F, out: &mut Overlaps) -> F {
        let ([a, b], [half_x, half_y], middle) = (&self.edges, self.half, &self.middle);
        let area = a[0] * b[1] - a[1] * b[0];
        let by = area.like(1.0) / area;
        let (along_a, along_b) =
            (self.slack * (a[0].abs() + a[1].abs()), self.slack * (b[0].abs() + b[1].abs()));
        let (area, mut nearest) = (area.abs(), other);
        for k in 0..CORNERS {
            let above = is_above(k);
            let x = if above[0] { half_x } else { -half_x };
            let y = if above[1] { half_y } else { -half_y };
            let (dx, dy) = (x - middle[0], y - middle[1]);
            let (of_a, of_b) = (dx * b[1] - dy * b[0], a[0] * dy - a[1] * dx);
            let gap = middle[2] + (of_a * a[2] + of_b * b[2]) * by;
            let (far_a, far_b) = (of_a.abs(), of_b.abs());
            let outside = (area + along_b).less(far_a) | (area + along_a).less(far_b);
            let inner = area.if_less(far_a, nearest, area.if_less(far_b, nearest, gap));
            nearest = inner.min(nearest);
            self.put(CORNERS + k, [x, y, gap], !outside, out);
        }
        nearest
    }
}
