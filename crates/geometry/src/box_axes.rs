//! Four pairs of boxes of space side by side, half sides g and h, axes a_i and b_j, the centre of b at t from that of a: along
//! a unit vector n
//!   s(n) = |n.t| - sum_i g_i |n.a_i| - sum_j h_j |n.b_j|
//! (Gottschalk 1996), in closed form on the 6 face normals and the 9 directions a_i x b_j. Where boxes are apart and neither a
//! face nor two edges that pass each other say how far, the nearest corner of one does. Knows no points of contact.

use crate::abreast::columns;
use crate::overlap::BIAS;
use carom_math::lanes::{Four, Lanes};

/// Squared sine of the angle between two edges below which they have no direction across \[1\]: what it would gain over a face is less
/// than the sine times a side.
const PARALLEL: f64 = 1e-14;
/// Rounding of an s(n) times the length of its n, as a fraction of the scale \[1\].
const ROUNDING: f64 = 1e-14;

/// Three numbers of four things: a vector.
pub type Triple<F> = [F; 3];

/// The axes that follow each axis.
pub const NEXT: [[usize; 2]; 3] = [[1, 2], [2, 0], [0, 1]];

/// Two posed boxes by their numbers, as they are read.
#[derive(Clone, Copy, Default)]
pub struct Record {
    /// From the centre of a to that of b in the world, and how far they may be apart \[m\].
    pub between: [f64; 4],
    /// Turns of both.
    pub turns: [[f64; 4]; 2],
    /// Half sides of both \[m\].
    pub halves: [[f64; 4]; 2],
}

/// Four pairs of boxes, in the frames of their a.
pub struct Boxes<F> {
    /// Rotation matrices of both, row by row.
    pub turns: [[Triple<F>; 3]; 2],
    /// a_i.b_j by i.
    pub rows: [Triple<F>; 3],
    /// Centre of b along a's axes, and from a along b's \[m\].
    pub place: Triple<F>,
    /// The same along b's axes.
    pub along: Triple<F>,
    /// Half sides of both \[m\].
    pub halves: [Triple<F>; 2],
    /// Length against which rounding is measured \[m\].
    pub scale: F,
    /// Largest gap \[m\].
    pub reach: F,
}

/// A direction with its s(n).
#[derive(Clone, Copy)]
pub struct Best<F> {
    /// Unit normal from b to a.
    pub normal: Triple<F>,
    /// s(n) \[m\].
    pub gap: F,
}

/// The best direction across two edges.
#[derive(Clone, Copy)]
pub struct BestEdges<F> {
    /// The direction.
    pub best: Best<F>,
    /// Axes of a and of b that the edges have, as numbers.
    axes: [F; 2],
    /// Squared sine of the angle between them \[1\].
    squared: F,
}

/// a.b.
#[inline(always)]
pub fn dot<F: Four>(a: &Triple<F>, b: &Triple<F>) -> F {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

#[inline(always)]
fn length<F: Four>(v: &Triple<F>) -> F {
    dot(v, v).sqrt()
}

/// one < other ? yes : no.
#[inline(always)]
pub fn choose<F: Four>(one: F, other: F, yes: &Triple<F>, no: &Triple<F>) -> Triple<F> {
    [one.if_less(other, yes[0], no[0]), one.if_less(other, yes[1], no[1]), one.if_less(other, yes[2], no[2])]
}

/// One of three by its number.
#[inline(always)]
pub fn pick<F: Four>(number: F, [x, y, z]: [F; 3]) -> F {
    number.if_less(number.like(0.5), x, number.if_less(number.like(1.5), y, z))
}

/// 1 with the sign of a number, and 1 for 0.
#[inline(always)]
fn sign<F: Four>(x: F) -> F {
    x.if_less(x.like(0.0), x.like(-1.0), x.like(1.0))
}

#[inline(always)]
fn matrix<F: Four>([w, x, y, z]: [F; 4]) -> [Triple<F>; 3] {
    let (one, two) = (w.like(1.0), w.like(2.0));
    [
        [one - two * (y * y + z * z), two * (x * y - w * z), two * (x * z + w * y)],
        [two * (x * y + w * z), one - two * (x * x + z * z), two * (y * z - w * x)],
        [two * (x * z - w * y), two * (y * z + w * x), one - two * (x * x + y * y)],
    ]
}

/// A vector along the columns of a matrix.
#[inline(always)]
fn across<F: Four>(m: &[Triple<F>; 3], v: &Triple<F>) -> Triple<F> {
    [dot(&column(m, 0), v), dot(&column(m, 1), v), dot(&column(m, 2), v)]
}

#[inline(always)]
fn column<F: Four>(m: &[Triple<F>; 3], k: usize) -> Triple<F> {
    [m[0][k], m[1][k], m[2][k]]
}

impl<F: Four> Boxes<F> {
    /// Four pairs by their records.
    #[inline(always)]
    pub fn of<L: Lanes<Four = F>>(lanes: L, [p, q, r, s]: &[Record; 4]) -> Self {
        let [x, y, z, reach] = columns(lanes, [&p.between, &q.between, &r.between, &s.between]);
        let turn_a = matrix(columns(lanes, [&p.turns[0], &q.turns[0], &r.turns[0], &s.turns[0]]));
        let turn_b = matrix(columns(lanes, [&p.turns[1], &q.turns[1], &r.turns[1], &s.turns[1]]));
        let [g0, g1, g2, _] = columns(lanes, [&p.halves[0], &q.halves[0], &r.halves[0], &s.halves[0]]);
        let [h0, h1, h2, _] = columns(lanes, [&p.halves[1], &q.halves[1], &r.halves[1], &s.halves[1]]);
        let between = [x, y, z];
        let mut rows = turn_a;
        for (i, row) in rows.iter_mut().enumerate() {
            *row = across(&turn_b, &column(&turn_a, i));
        }
        let (along_a, along_b) = (across(&turn_a, &between), across(&turn_b, &between));
        Boxes {
            turns: [turn_a, turn_b],
            rows,
            place: along_a,
            along: along_b,
            halves: [[g0, g1, g2], [h0, h1, h2]],
            scale: length(&[g0, g1, g2]) + length(&[h0, h1, h2]) + length(&between),
            reach,
        }
    }

    /// A direction of a's frame in b's.
    #[inline(always)]
    pub fn in_b(&self, v: &Triple<F>) -> Triple<F> {
        across(&self.rows, v)
    }

    /// A direction of b's frame in a's.
    #[inline(always)]
    fn in_a(&self, v: &Triple<F>) -> Triple<F> {
        [dot(&self.rows[0], v), dot(&self.rows[1], v), dot(&self.rows[2], v)]
    }

    /// The best face normal of either box; those before win ties, a's first.
    #[inline(always)]
    pub fn best_face(&self) -> Best<F> {
        let ([g, h], r, t) = (&self.halves, &self.rows, &self.place);
        let (zero, bias) = (self.scale.like(0.0), self.scale.like(BIAS) * self.scale);
        // a centre that is hardly off the middle of a face is thought to be above it
        let off = -(bias * bias.like(0.5));
        let mut best = Best { normal: [zero; 3], gap: zero.like(f64::NEG_INFINITY) };
        for i in 0..3 {
            let of_b = r[i][0].abs() * h[0] + r[i][1].abs() * h[1] + r[i][2].abs() * h[2];
            let gap = t[i].abs() - of_b - g[i];
            let mut normal = [zero; 3];
            normal[i] = t[i].if_less(off, zero.like(1.0), zero.like(-1.0));
            best = best.or(Best { normal, gap }, bias);
        }
        for j in 0..3 {
            let of_a = r[0][j].abs() * g[0] + r[1][j].abs() * g[1] + r[2][j].abs() * g[2];
            let along = self.along[j];
            let gap = along.abs() - of_a - h[j];
            let toward = (-off).if_less(along, zero.like(-1.0), zero.like(1.0));
            let normal = [toward * r[0][j], toward * r[1][j], toward * r[2][j]];
            best = best.or(Best { normal, gap }, bias);
        }
        best
    }

    /// The best direction across two edges that are not parallel; minus infinite where there is none.
    #[inline(always)]
    pub fn best_edges(&self) -> BestEdges<F> {
        let ([g, h], r, t) = (&self.halves, &self.rows, &self.place);
        let (zero, none) = (self.scale.like(0.0), self.scale.like(f64::NEG_INFINITY));
        let (bias, rounding) = (zero.like(BIAS) * self.scale, zero.like(ROUNDING) * self.scale);
        let parallel = zero.like(PARALLEL);
        let (mut most, mut normal, mut axes, mut squared) = (none, [zero; 3], [zero; 2], zero.like(1.0));
        for i in 0..3 {
            let [u, v] = NEXT[i];
            for j in 0..3 {
                let [k, l] = NEXT[j];
                // a_i x b_j: (-r_vj, r_uj) on the axes u and v that follow i, and |n.b_k| = |a_i.b_l|
                let (x, y) = (-r[v][j], r[u][j]);
                let reach_a = g[u] * x.abs() + g[v] * y.abs();
                let reach_b = h[k] * r[i][l].abs() + h[l] * r[i][k].abs();
                let (square, apart) = (x * x + y * y, x * t[u] + y * t[v]);
                let sine = square.sqrt();
                let surely = (apart.abs() - reach_a - reach_b - rounding) / sine;
                let gap = parallel.if_less(square, surely, none);
                let level = most + bias;
                let toward = -sign(apart) / sine;
                let mut direction = [zero; 3];
                (direction[u], direction[v]) = (toward * x, toward * y);
                normal = choose(level, gap, &direction, &normal);
                squared = level.if_less(gap, square, squared);
                axes[0] = level.if_less(gap, zero.like(i as f64), axes[0]);
                axes[1] = level.if_less(gap, zero.like(j as f64), axes[1]);
                most = level.if_less(gap, gap, most);
            }
        }
        let gap = none.if_less(most, most + rounding / squared.sqrt(), none);
        BestEdges { best: Best { normal, gap }, axes, squared }
    }

    /// 1 where the edges of a direction across pass each other inside both, else 0.
    #[inline(always)]
    pub fn pass_inside(&self, edges: &BestEdges<F>) -> F {
        let ([g, h], r, n) = (&self.halves, &self.rows, &edges.best.normal);
        let (zero, one, [i, j]) = (self.scale.like(0.0), self.scale.like(1.0), edges.axes);
        let m = self.in_b(n);
        // from the middle of a's edge to that of b's: both are at the sides that face each other
        let (mut of_a, mut of_b) = ([zero; 3], [zero; 3]);
        for k in 0..3 {
            let own = zero.like(k as f64);
            let (own_i, own_j) = ((i - own).abs(), (j - own).abs());
            of_a[k] = own_i.if_less(zero.like(0.5), zero, -(sign(n[k]) * g[k]));
            of_b[k] = own_j.if_less(zero.like(0.5), zero, sign(m[k]) * h[k]);
        }
        let turned = self.in_a(&of_b);
        let w = [
            self.place[0] + turned[0] - of_a[0],
            self.place[1] + turned[1] - of_a[1],
            self.place[2] + turned[2] - of_a[2],
        ];
        let cosine = pick(i, [pick(j, r[0]), pick(j, r[1]), pick(j, r[2])]);
        let (along_a, along_b) = (pick(i, w), pick(j, self.in_b(&w)));
        let on_a = (along_a - along_b * cosine) / edges.squared;
        let on_b = (along_a * cosine - along_b) / edges.squared;
        pick(i, *g).if_less(on_a.abs(), zero, pick(j, *h).if_less(on_b.abs(), zero, one))
    }

    /// The direction between boxes that are apart from the nearest corner of one to the other.
    #[inline(always)]
    pub fn nearest_corner(&self) -> Best<F> {
        let ([g, h], r) = (&self.halves, &self.rows);
        let columns = [column(r, 0), column(r, 1), column(r, 2)];
        let away = [-self.along[0], -self.along[1], -self.along[2]];
        let (of_b, square_b) = nearest(&self.place, &columns, h, g);
        let (of_a, square_a) = nearest(&away, r, g, h);
        let of_a = self.in_a(&of_a);
        let square = square_a.if_less(square_b, square_a, square_b);
        let distance = square.sqrt();
        let one = choose(square_a, square_b, &of_a, &[-of_b[0], -of_b[1], -of_b[2]]);
        Best { normal: [one[0] / distance, one[1] / distance, one[2] / distance], gap: distance }
    }
}

/// From a box about its frame's origin with half sides `own` to the nearest corner of another one \[m\], and the square of that.
#[inline(always)]
fn nearest<F: Four>(
    place: &Triple<F>,
    axes: &[Triple<F>; 3],
    half: &Triple<F>,
    own: &Triple<F>,
) -> (Triple<F>, F) {
    let mut best = ([half[0]; 3], half[0].like(f64::INFINITY));
    for corner in 0..8_usize {
        let mut at = *place;
        for k in 0..3 {
            let side = if corner >> k & 1 == 1 { half[k] } else { -half[k] };
            for c in 0..3 {
                at[c] = at[c] + axes[k][c] * side;
            }
        }
        let mut away = at;
        for c in 0..3 {
            away[c] = at[c] - at[c].min(own[c]).max(-own[c]);
        }
        let square = dot(&away, &away);
        best.0 = choose(square, best.1, &away, &best.0);
        best.1 = square.if_less(best.1, square, best.1);
    }
    best
}

impl<F: Four> Best<F> {
    /// This one, or another where that is better by more than `bias` \[m\].
    #[inline(always)]
    pub fn or(self, other: Self, bias: F) -> Self {
        let level = self.gap + bias;
        Best {
            normal: choose(level, other.gap, &other.normal, &self.normal),
            gap: level.if_less(other.gap, other.gap, self.gap),
        }
    }
}
