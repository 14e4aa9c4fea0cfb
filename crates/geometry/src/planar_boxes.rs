//! Contact points of boxes of the plane, rounded or not, four pairs at a time: half sides g and h, axes a_i and b_j, the centre of
//! b at t from that of a; along a unit vector n
//!   s(n) = |n.t| - sum_i g_i |n.a_i| - sum_j h_j |n.b_j|
//! in closed form on the four normals, and where boxes are apart and their faces do not stand over each other the nearest
//! corner of one to the other. Points are the ends of the overlap of the two sides that face each other. Says what
//! `polygons` says, but for rounding; a pair has the same bits whoever is looked at beside it. Knows no composite shapes.

use crate::abreast::{columns, four_of};
use crate::core_planar::PlanarCore;
use crate::geometry::{ABREAST, ContactPoint, Told};
use crate::kernel::{Beside, NONE, code_of, mix};
use crate::pair_planar::{ROUNDING, SAME_END};
use crate::polygons;
use carom_math::lanes::{Four, Job, Lanes, dispatch};
use carom_math::{Planar, Vec2, vec2};

/// A gap that is missing by more than this fraction of the scale is no rounding \[1\].
const MISSING: f64 = 1e-12;

/// The names of points by a corner of each box; the last number stands for none.
static NAMES: [[u64; 5]; 5] = all_names();

const fn all_names() -> [[u64; 5]; 5] {
    let (mut names, mut k) = ([[0; 5]; 5], 0);
    while k < 25 {
        let (i, j) = (k / 5, k % 5);
        let of_a = [if i < 4 { i as u32 } else { NONE }, NONE];
        let of_b = [if j < 4 { j as u32 } else { NONE }, NONE];
        names[i][j] = mix(mix(0, 0), code_of(of_a, of_b));
        k += 1;
    }
    names
}

/// Half sides of a box \[m\]; `None` of other cores.
#[inline]
pub fn half_of(core: &PlanarCore) -> Option<[f64; 2]> {
    if let PlanarCore::Polygon(polygon) = core { polygon.half } else { None }
}

/// Two numbers of four pairs: a vector.
type Duo<F> = [F; 2];

/// Two posed boxes by their numbers, as they are read.
struct Record {
    /// From the centre of a to that of b in the world, and how far they may be apart \[m\].
    between: [f64; 4],
    /// Turns of both.
    turns: [f64; 4],
    /// Half sides of both \[m\].
    halves: [f64; 4],
}

/// The numbers of a pair.
#[inline(always)]
fn record(pair: &Beside<'_, Planar>) -> Record {
    let [a, b] = &pair.swept;
    // the difference of positions first: far from the world's origin it is small and exact
    let d = b.pose.position - a.pose.position;
    let ([c, s], [p, q]) = (a.pose.rotation.0, b.pose.rotation.0);
    let half = |core| half_of(core).unwrap_or([0.0; 2]);
    let ([g, k], [h, l]) = (half(a.core), half(b.core));
    Record {
        between: [d[0], d[1], pair.margin + a.radius + b.radius, 0.0],
        turns: [c, s, p, q],
        halves: [g, k, h, l],
    }
}

/// Four pairs of boxes, in the frames of their a.
struct Boxes<F> {
    /// Cosine and sine of a's turn, and of b's against it.
    turn: Duo<F>,
    against: Duo<F>,
    /// Centre of b along a's axes, and along its own \[m\].
    place: Duo<F>,
    along: Duo<F>,
    /// Half sides of both \[m\].
    halves: [Duo<F>; 2],
    /// Length against which rounding is measured \[m\].
    scale: F,
    /// Largest gap \[m\].
    reach: F,
}

/// A direction with its s(n).
struct Best<F> {
    normal: Duo<F>,
    gap: F,
}

/// One end of an overlap.
struct End<F> {
    /// Place along the tangent, and how far it is along the normal, midway between both sides \[m\].
    at: F,
    level: F,
    gap: F,
    /// In which pairs it is at the lower and the upper corner of either side.
    corners: [[u32; 2]; 2],
}

/// The overlaps of the sides that face each other.
struct Overlap<F> {
    tangent: Duo<F>,
    /// Its lower and its upper end.
    ends: [End<F>; 2],
    /// In which pairs there is one, in which its ends are two, and in which the sides are over each other but for no slack.
    is: u32,
    two: u32,
    over: u32,
    /// The smallest gap \[m\].
    lowest: F,
    /// Whether the sides are across the first axes of their boxes, whether they are below, and whether they run down along the tangent.
    across: [u32; 2],
    below: [u32; 2],
    down: [u32; 2],
}

#[inline(always)]
fn dot<F: Four>(a: &Duo<F>, b: &Duo<F>) -> F {
    a[0] * b[0] + a[1] * b[1]
}

#[inline(always)]
fn length<F: Four>(v: &Duo<F>) -> F {
    dot(v, v).sqrt()
}

#[inline(always)]
fn choose<F: Four>(one: F, other: F, yes: &Duo<F>, no: &Duo<F>) -> Duo<F> {
    [one.if_less(other, yes[0], no[0]), one.if_less(other, yes[1], no[1])]
}

/// A quarter turn, counter-clockwise.
#[inline(always)]
fn perp<F: Four>(v: &Duo<F>) -> Duo<F> {
    [-v[1], v[0]]
}

/// A vector turned by the angle of which these are cosine and sine, and back.
#[inline(always)]
fn turned<F: Four>([c, s]: &Duo<F>, v: &Duo<F>) -> Duo<F> {
    [*c * v[0] - *s * v[1], *s * v[0] + *c * v[1]]
}
#[inline(always)]
fn back<F: Four>([c, s]: &Duo<F>, v: &Duo<F>) -> Duo<F> {
    [*c * v[0] + *s * v[1], *c * v[1] - *s * v[0]]
}

impl<F: Four> Boxes<F> {
    #[inline(always)]
    fn of<L: Lanes<Four = F>>(lanes: L, [p, q, r, s]: &[Record; 4]) -> Self {
        let [x, y, reach, _] = columns(lanes, [&p.between, &q.between, &r.between, &s.between]);
        let [cos_a, sin_a, cos_b, sin_b] = columns(lanes, [&p.turns, &q.turns, &r.turns, &s.turns]);
        let [g0, g1, h0, h1] = columns(lanes, [&p.halves, &q.halves, &r.halves, &s.halves]);
        let (turn, other, between) = ([cos_a, sin_a], [cos_b, sin_b], [x, y]);
        let halves = [[g0, g1], [h0, h1]];
        Boxes {
            against: back(&turn, &other),
            place: back(&turn, &between),
            along: back(&other, &between),
            scale: length(&halves[0]) + length(&halves[1]) + length(&between),
            turn,
            halves,
            reach,
        }
    }

    /// The best normal of a side of either box; those before win ties, a's first.
    #[inline(always)]
    fn best_face(&self) -> Best<F> {
        let ([g, h], [c, s]) = (&self.halves, self.against);
        let (zero, bias) = (c.like(0.0), c.like(ROUNDING) * self.scale);
        let (one, other, cos, sin) = (zero.like(1.0), zero.like(-1.0), c.abs(), s.abs());
        let toward = [self.place[0].if_less(zero, one, other), self.place[1].if_less(zero, one, other)];
        let (t, u) = (&self.place, &self.along);
        let mut best = Best { normal: [zero, toward[1]], gap: t[1].abs() - (sin * h[0] + cos * h[1]) - g[1] };
        best.take([toward[0], zero], t[0].abs() - (cos * h[0] + sin * h[1]) - g[0], bias);
        let toward = [u[0].if_less(zero, one, other), u[1].if_less(zero, one, other)];
        let own = [[toward[0] * c, toward[0] * s], [-(toward[1] * s), toward[1] * c]];
        best.take(own[1], u[1].abs() - (sin * g[0] + cos * g[1]) - h[1], bias);
        best.take(own[0], u[0].abs() - (cos * g[0] + sin * g[1]) - h[0], bias);
        best
    }

    /// The direction from the nearest corner of one box to the other; its gap is no number where they touch.
    #[inline(always)]
    fn nearest_corner(&self) -> Best<F> {
        let ([g, h], [c, s]) = (&self.halves, self.against);
        let (of_b, square_b) = nearest(&self.place, &[[c, s], [-s, c]], h, g);
        let away = [-self.along[0], -self.along[1]];
        let (of_a, square_a) = nearest(&away, &[[c, -s], [s, c]], g, h);
        let of_a = turned(&self.against, &of_a);
        let distance = square_a.if_less(square_b, square_a, square_b).sqrt();
        let one = choose(square_a, square_b, &of_a, &[-of_b[0], -of_b[1]]);
        Best { normal: [one[0] / distance, one[1] / distance], gap: distance }
    }

    /// The overlap of the sides that face each other along a normal, as seen along it.
    #[inline(always)]
    fn overlap(&self, n: &Duo<F>) -> Overlap<F> {
        let ([g, h], m, t) = (&self.halves, back(&self.against, n), &self.place);
        let (tangent, same) = (perp(n), self.scale.like(SAME_END) * self.scale);
        let a = Side::of(&[-n[0], -n[1]], g, &tangent, n);
        let b = Side::of(&m, h, &perp(&m), &m);
        let b = Side { at: b.at + dot(&tangent, t), level: b.level + dot(n, t), ..b };
        let (low, high) = (a.low().max(b.low()), a.high().min(b.high()));
        let two = (low + same).less(high);
        let ends = [End::of(low, &a, &b, same), End::of(high, &a, &b, same)];
        let none = same.like(f64::INFINITY);
        let second = (low + same).if_less(high, ends[1].gap, none);
        let lowest = (high + same).if_less(low, none, ends[0].gap.min(second));
        Overlap {
            tangent,
            ends,
            is: !(high + same).less(low),
            two,
            over: !high.less(low),
            lowest,
            across: [a.across, b.across],
            below: [a.below, b.below],
            down: [a.down, b.down],
        }
    }
}

/// From a box about its frame's origin with half sides `own` to the nearest corner of another one \[m\], and the square of that.
#[inline(always)]
fn nearest<F: Four>(place: &Duo<F>, axes: &[Duo<F>; 2], half: &Duo<F>, own: &Duo<F>) -> (Duo<F>, F) {
    let mut best = (*place, place[0].like(f64::INFINITY));
    for corner in 0..4_usize {
        let x = if corner & 1 == 1 { half[0] } else { -half[0] };
        let y = if corner & 2 == 2 { half[1] } else { -half[1] };
        let mut away = *place;
        for c in 0..2 {
            let at = place[c] + axes[0][c] * x + axes[1][c] * y;
            away[c] = at - at.min(own[c]).max(-own[c]);
        }
        let square = dot(&away, &away);
        best.0 = choose(square, best.1, &away, &best.0);
        best.1 = square.if_less(best.1, square, best.1);
    }
    best
}

impl<F: Four> Best<F> {
    /// Takes another direction where that is better by more than `bias` \[m\].
    #[inline(always)]
    fn take(&mut self, normal: Duo<F>, gap: F, bias: F) {
        let level = self.gap + bias;
        self.normal = choose(level, gap, &normal, &self.normal);
        self.gap = level.if_less(gap, gap, self.gap);
    }
}

/// The side of a box that leans most along a direction, as seen along a normal.
struct Side<F> {
    /// Its middle along the tangent and along the normal \[m\].
    at: F,
    level: F,
    /// How far its end goes from there along both \[m\].
    run: F,
    rise: F,
    across: u32,
    below: u32,
    down: u32,
}

impl<F: Four> Side<F> {
    #[inline(always)]
    fn of(toward: &Duo<F>, half: &Duo<F>, tangent: &Duo<F>, normal: &Duo<F>) -> Self {
        let (x, y, zero) = (toward[0].abs(), toward[1].abs(), toward[0].like(0.0));
        let of_x = toward[0].if_less(zero, -half[0], half[0]);
        let of_y = toward[1].if_less(zero, -half[1], half[1]);
        let middle = choose(y, x, &[of_x, zero], &[zero, of_y]);
        let end = choose(y, x, &[zero, half[1]], &[half[0], zero]);
        let lean = y.if_less(x, toward[0], toward[1]);
        let run = dot(tangent, &end);
        Side {
            at: dot(tangent, &middle),
            level: dot(normal, &middle),
            run,
            rise: dot(normal, &end),
            across: y.less(x),
            below: lean.less(zero),
            down: run.less(zero),
        }
    }
    #[inline(always)]
    fn low(&self) -> F {
        self.at - self.run.abs()
    }
    #[inline(always)]
    fn high(&self) -> F {
        self.at + self.run.abs()
    }
    /// How far it is along the normal at a place along the tangent \[m\].
    #[inline(always)]
    fn level_at(&self, at: F) -> F {
        let one = at.like(1.0);
        let part = ((at - self.at) / self.run).min(one).max(-one);
        self.level + self.rise * part
    }
    /// Where a place is its lower and its upper corner.
    #[inline(always)]
    fn corners(&self, at: F, same: F) -> [u32; 2] {
        [!same.less((self.low() - at).abs()), !same.less((self.high() - at).abs())]
    }
}

impl<F: Four> End<F> {
    #[inline(always)]
    fn of(at: F, a: &Side<F>, b: &Side<F>, same: F) -> Self {
        let (of_a, of_b) = (a.level_at(at), b.level_at(at));
        End {
            at,
            level: (of_a + of_b) * at.like(0.5),
            gap: of_a - of_b,
            corners: [a.corners(at, same), b.corners(at, same)],
        }
    }
}

/// The ends of four overlaps in memory.
struct Ends {
    /// Of the lower and the upper ends their places along the tangent and the normal, and gaps \[m\].
    at: [[[f64; 4]; 3]; 2],
    corners: [[[u32; 2]; 2]; 2],
    are: [u32; 2],
    across: [u32; 2],
    below: [u32; 2],
    down: [u32; 2],
    /// Tangents and normals in the world.
    axes: [[[f64; 4]; 2]; 2],
}

impl Ends {
    #[inline(always)]
    fn of<F: Four>(boxes: &Boxes<F>, normal: &Duo<F>, overlap: &Overlap<F>) -> Self {
        let (tangent, normal) = (turned(&boxes.turn, &overlap.tangent), turned(&boxes.turn, normal));
        let [low, high] = &overlap.ends;
        let within = [!boxes.reach.less(low.gap), !boxes.reach.less(high.gap)];
        Ends {
            at: [
                [low.at.store(), low.level.store(), low.gap.store()],
                [high.at.store(), high.level.store(), high.gap.store()],
            ],
            corners: [low.corners, high.corners],
            are: [overlap.is & within[0], overlap.is & overlap.two & within[1]],
            across: overlap.across,
            below: overlap.below,
            down: overlap.down,
            axes: [[tangent[0].store(), tangent[1].store()], [normal[0].store(), normal[1].store()]],
        }
    }

    /// The corner of a box at an end of its side, 4 for none: as in a ring, counter-clockwise from below left.
    #[inline(always)]
    fn corner(&self, end: usize, side: usize, lane: usize) -> usize {
        let is = |set: u32| set >> lane & 1 == 1;
        let [low, high] = self.corners[end][side];
        if !is(low | high) {
            return 4;
        }
        // the upper end of a side that does not run down is above the middle
        let above = usize::from(is(low) == is(self.down[side]));
        let own = usize::from(!is(self.below[side]));
        let (x, y) = if is(self.across[side]) { (own, above) } else { (above, own) };
        [0, 1, 3, 2][x | y << 1]
    }

    /// Appends the contact points of a pair.
    #[inline(always)]
    fn tell(&self, pair: &Beside<'_, Planar>, lane: usize, out: &mut Vec<ContactPoint<Planar>>) {
        let [a, b] = &pair.swept;
        let axis = |k: usize| vec2(self.axes[k][0][lane], self.axes[k][1][lane]);
        let (tangent, normal): (Vec2, Vec2) = (axis(0), axis(1));
        for end in 0..2 {
            if self.are[end] >> lane & 1 == 0 {
                continue;
            }
            let [at, level, gap] = [self.at[end][0][lane], self.at[end][1][lane], self.at[end][2][lane]];
            let level = level - 0.5 * (a.radius - b.radius);
            out.push(ContactPoint {
                feature: NAMES[self.corner(end, 0, lane)][self.corner(end, 1, lane)],
                point: a.pose.position + (tangent * at + normal * level),
                normal,
                gap: gap - (a.radius + b.radius),
                curvature: 0.0,
            });
        }
    }
}

/// Appends the contact points of up to four pairs of boxes, one after another, with names that are distinct within each.
pub fn contacts(pairs: &[Beside<'_, Planar>], out: &mut Vec<ContactPoint<Planar>>) -> [Told; ABREAST] {
    let mut told = [Told::nothing(out.len()); ABREAST];
    if let Some(records) = four_of(pairs, record) {
        dispatch(Tell { pairs, records: &records, told: &mut told, out });
    }
    told
}

/// Tells of the contacts of four pairs.
struct Tell<'a, 'b> {
    pairs: &'a [Beside<'a, Planar>],
    records: &'a [Record; ABREAST],
    told: &'b mut [Told; ABREAST],
    out: &'b mut Vec<ContactPoint<Planar>>,
}

impl Job for Tell<'_, '_> {
    type Output = ();
    #[inline(always)]
    fn work<L: Lanes>(self, lanes: L) {
        const ALL: u32 = (1 << ABREAST) - 1;
        let Tell { pairs, records, told, out } = self;
        let boxes = Boxes::of(lanes, records);
        let (mut best, scale, reach) = (boxes.best_face(), boxes.scale, boxes.reach);
        let mut beyond = reach.less(best.gap);
        let (mut apart, mut ends, mut missing) = (best.gap.store(), None, 0);
        if beyond != ALL {
            let tolerance = scale.like(ROUNDING) * scale;
            let mut overlap = boxes.overlap(&best.normal);
            // where the sides stand over each other no corner is nearer
            let stands = overlap.over & !(best.gap + tolerance).less(overlap.lowest);
            let open = (-tolerance).less(best.gap) & !stands & !beyond & ALL;
            if open != 0 {
                let corner = boxes.nearest_corner();
                let level = best.gap + tolerance;
                // who is not open takes no corner, however near; infinite levels are not passed
                let none = level.like(f64::INFINITY);
                let [low, high] = [overlap.ends[0].at, overlap.ends[1].at];
                let taken = high.if_less(low, level, level.if_less(overlap.lowest, level, none));
                let taken = (-tolerance).if_less(best.gap, taken, none);
                let taken = reach.if_less(best.gap, none, taken);
                best = Best {
                    normal: choose(taken, corner.gap, &corner.normal, &best.normal),
                    gap: taken.if_less(corner.gap, corner.gap, best.gap),
                };
                beyond |= reach.less(best.gap);
                apart = best.gap.store();
                overlap = boxes.overlap(&best.normal);
            }
            missing = (best.gap + scale.like(MISSING) * scale).less(overlap.lowest) & !beyond;
            ends = Some(Ends::of(&boxes, &best.normal, &overlap));
        }
        for (lane, pair) in pairs.iter().enumerate().take(ABREAST) {
            let is = |set: u32| set >> lane & 1 == 1;
            let ([a, b], mut gap) = (&pair.swept, f64::NEG_INFINITY);
            if is(beyond) {
                gap = apart[lane] - (a.radius + b.radius);
            } else if is(missing) {
                polygons::contacts(a, b, pair.margin, &mut gap, out);
            } else if let Some(ends) = &ends {
                ends.tell(pair, lane, out);
            }
            told[lane] = Told { end: out.len(), apart: gap };
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kernel::Swept;
    use crate::narrow::tests::numbers;
    use carom_math::lanes::Portable;
    use carom_math::{Column, Pose, Turn};

    /// Boxes from apart to deep in each other, a good part of them face on face or corner on corner, and what polygons say of them.
    #[test]
    fn four_pairs_are_what_each_is_alone_on_every_processor_and_what_polygons_are() {
        let mut number = numbers();
        let mut some = || 0.5 * number();
        let halves = [[0.5, 0.5], [0.3, 0.1], [6.0, 0.4], [0.02, 0.8]];
        let cores = halves.map(PlanarCore::rectangle);
        let mut all = Vec::new();
        for k in 0..400_000_usize {
            let (a, b) = (k % 4, k / 4 % 4);
            let (g, h) = (halves[a], halves[b]);
            // all but parallel too: who is asked only some thousand times fails there unseen
            let scale = [0.0, 1e-10, 1e-9, 1e-8, 1e-7, 1e-6, 0.01, 7.0][k / 16 % 8];
            let angle = scale * some();
            let reach = 1.2 * (vec2(g[0], g[1]).norm() + vec2(h[0], h[1]).norm());
            let mut at = vec2(reach * some(), reach * some());
            if k % 3 < 2 {
                at[k % 3] = (g[k % 3] + h[k % 3]) * at[k % 3].signum() + [0.0, 0.05 * some()][k % 2];
            }
            let own = Pose::new(vec2(9.0 * some(), 9.0 * some()), Turn::from_angle(7.0 * some()));
            let other = own.compose(&Pose::new(at, Turn::from_angle(angle)));
            all.push(([a, b], [own, other], if k % 7 == 0 { [0.1, 0.03] } else { [0.0; 2] }));
        }
        let (mut points, mut none) = (0, 0);
        for some in all.chunks(ABREAST) {
            let pairs: Vec<Beside<'_, Planar>> = some
                .iter()
                .map(|(of, poses, radii)| {
                    let swept = |k: usize| Swept { core: &cores[of[k]], radius: radii[k], pose: &poses[k] };
                    Beside { swept: [swept(0), swept(1)], margin: 0.1 }
                })
                .collect();
            let records = four_of(&pairs, record).expect("pairs");
            let (mut found, mut plain, mut first) = (Vec::new(), Vec::new(), 0);
            let told = contacts(&pairs, &mut found);
            let mut other = [Told::nothing(0); ABREAST];
            Portable.run(Tell { pairs: &pairs, records: &records, told: &mut other, out: &mut plain });
            assert_eq!((&found, &told[..pairs.len()]), (&plain, &other[..pairs.len()]));
            for (pair, told) in pairs.iter().zip(told) {
                let (mut alone, mut polygon, mut apart) = (Vec::new(), Vec::new(), f64::NEG_INFINITY);
                let [own, ..] = contacts(&[*pair], &mut alone);
                assert_eq!((&found[first..told.end], told.apart), (alone.as_slice(), own.apart));
                first = told.end;
                let [a, b] = &pair.swept;
                polygons::contacts(a, b, pair.margin, &mut apart, &mut polygon);
                let same = |p: &ContactPoint<Planar>, q: &ContactPoint<Planar>| {
                    p.feature == q.feature
                        && (p.point - q.point).norm() < 1e-11
                        && (p.gap - q.gap).abs() < 1e-12
                };
                let agree =
                    alone.len() == polygon.len() && alone.iter().all(|p| polygon.iter().any(|q| same(p, q)));
                // where two sides are as far apart or a corner is over an end, rounding decides what is told
                let deepest =
                    |all: &[ContactPoint<Planar>]| all.iter().fold(pair.margin, |m, p| m.min(p.gap));
                assert!(
                    agree || (deepest(&alone) - deepest(&polygon)).abs() < 1e-9,
                    "{alone:#?}\n{polygon:#?}"
                );
                points += usize::from(agree && !alone.is_empty());
                none += usize::from(alone.is_empty());
                if own.apart > 0.0 {
                    assert!(polygon.is_empty() && own.apart <= apart + 1e-12);
                }
            }
        }
        let enough = points > 133_000 && none > 66_000 && points + none > 380_000;
        assert!(enough, "{points} alike, {none} have none");
    }
}
