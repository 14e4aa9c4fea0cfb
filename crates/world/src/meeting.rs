//! Who meets whom in a step, before any shape is looked at: boxes that overlap, groups, joints, and in soft steps how far two
//! surfaces can come towards each other. Pairs are asked four at a time.

use crate::abreast::{Abreast, Quartet};
use crate::ahead::{Ahead, Couple, Mover, approach, within};
use crate::columns::{CHUNK, Columns};
use crate::flight::Flights;
use crate::joint::Joints;
use crate::settings::Scheme;
use carom_geometry::{Aabb, Geometry};
use carom_math::Column;
use carom_math::lanes::{Four, Job, Lanes, dispatch};

const _: () = assert!(CHUNK <= 1 << u8::BITS);

/// Pairs that are asked together.
const AT_ONCE: usize = 4;

/// One, and more than rounding \[1\].
const SURELY: f64 = 1.0 + 1e-6;

/// Who meets whom in a step: what is asked of pairs whose boxes may overlap.
pub(crate) struct Meeting<'a, S: Geometry> {
    pub columns: &'a Columns<S>,
    pub joints: &'a Joints<S>,
    /// They meet by their approach where that is less than the margins of their boxes.
    pub soft: bool,
    pub dt: f64,
}

/// Up to which gaps contacts of some pairs are looked for \[m\]; less than 0 where a pair has none.
type Margins = [f64; CHUNK];

impl<'a, S: Geometry> Meeting<'a, S> {
    /// In the step ahead.
    pub fn new(columns: &'a Columns<S>, ahead: &Ahead<'a, S>) -> Self {
        let soft = ahead.settings.scheme == Scheme::SoftStep && ahead.settings.contact_margin.is_none();
        Meeting { columns, joints: &ahead.bodies.joints, soft, dt: ahead.dt }
    }

    /// Two bodies by their places in the columns.
    #[inline(always)]
    pub fn couple(&self, i: usize, j: usize) -> Couple<'a, S> {
        Couple { a: &self.columns.movers[i], b: &self.columns.movers[j] }
    }

    /// What a chunk of pairs is looked at up to; the flights of their bodies are made.
    pub fn margins(&self, pairs: &[(u32, u32)]) -> Margins {
        let mut margins = [-1.0; CHUNK];
        dispatch(Asking { meeting: self, pairs, margins: &mut margins });
        margins
    }

    /// Keeps the pairs that are looked at.
    pub fn sift(&self, pairs: &mut Vec<(u32, u32)>) {
        let mut kept = 0;
        for first in (0..pairs.len()).step_by(CHUNK) {
            let end = pairs.len().min(first + CHUNK);
            let margins = self.margins(&pairs[first..end]);
            for k in first..end {
                pairs[kept] = pairs[k];
                kept += usize::from(margins[k - first] >= 0.0);
            }
        }
        pairs.truncate(kept);
    }

    /// A pair with the margins of both boxes \[m\], which overlap by them, where it may meet.
    #[inline(always)]
    pub fn may(&self, (i, j): (u32, u32)) -> Option<f64> {
        let (i, j) = (i as usize, j as usize);
        let Columns { bounds, margins, .. } = self.columns;
        let may = bounds[i].overlaps(&bounds[j]) && self.may_collide((i as u32, j as u32));
        may.then(|| margins[i] + margins[j])
    }

    /// Whether a pair, one of which can move, wants to collide, and no joint keeps it from that.
    #[inline(always)]
    fn may_collide(&self, (i, j): (u32, u32)) -> bool {
        let couple = self.couple(i as usize, j as usize);
        let (a, b) = couple.indices();
        couple.may_meet() && !self.joints.keeps_apart(a, b)
    }

    /// A speed that two surfaces at least come towards each other with, as far as the margin that [`Meeting::margins`] tells of them says it
    /// \[m/s\]: the margin is no more than [`within`] has it. Minus infinity where it says nothing.
    #[inline(always)]
    pub fn surely_closing(&self, couple: &Couple<'_, S>, margin: f64) -> f64 {
        let Couple { a, b } = *couple;
        let tells = self.soft && !self.columns.somebody_halts && margin > SURELY * (a.least + b.least);
        let closing = margin / (2.0 * SURELY * self.dt) - (a.falls + b.falls) * self.dt;
        if tells { closing } else { f64::NEG_INFINITY }
    }

    #[inline(always)]
    fn boxed(&self, (i, j): (u32, u32), margin: f64) -> Boxed<'a, S> {
        let (i, j) = (i as usize, j as usize);
        let Columns { bounds, movers, halts, .. } = self.columns;
        let (boxes, movers) = ([&bounds[i], &bounds[j]], [&movers[i], &movers[j]]);
        Boxed { boxes, movers, halts: [halts[i], halts[j]], margin }
    }

    /// Whether four pairs are near enough whatever their speed, some points of whose surfaces are that far apart \[m\]: margins of boxes
    /// and of pairs are no less than the least. A hundredth is more than all rounding.
    #[inline(always)]
    pub fn are_surely_near<F: Four>(
        &self,
        by_size: impl Abreast<[&'a Mover<S>; 2], Number = F>,
        apart: F,
    ) -> bool {
        let least = by_size.read(|[a, b]| 0.99 * (a.least + b.least));
        self.soft && apart.less(least) == (1 << AT_ONCE) - 1
    }

    /// Which of four pairs that may meet are near enough to be looked at, bit by bit: those whose margins [`Meeting::margins`] tells.
    /// Of each its smaller body and its larger one, and how fast they can come towards each other.
    #[inline(always)]
    pub fn near<L: Lanes>(
        &self,
        by_size: Quartet<'_, [&'a Mover<S>; 2], L>,
        closing: L::Four,
        [p, q, r, t]: [(u32, u32); AT_ONCE],
    ) -> u32 {
        let margin = |(i, j): (u32, u32)| self.columns.margins[i as usize] + self.columns.margins[j as usize];
        let boxed = [
            self.boxed(p, margin(p)),
            self.boxed(q, margin(q)),
            self.boxed(r, margin(r)),
            self.boxed(t, margin(t)),
        ];
        let boxed = Quartet(by_size.0, &boxed);
        let (apart, own) = (boxed.read(Boxed::apart), boxed.read(|pair| pair.margin));
        let overlap = !own.like(0.0).less(apart);
        if !self.soft {
            return overlap;
        }
        let halted = || boxed.read(|pair| pair.halted(self.dt));
        let within = self.no_more(own, approach(by_size, closing, self.dt), halted);
        overlap & !within.less(apart + own)
    }
}

/// A pair with its boxes, and the margins of both \[m\].
struct Boxed<'a, S: Geometry> {
    boxes: [&'a Aabb<S>; 2],
    movers: [&'a Mover<S>; 2],
    /// When each of them is halted \[s\].
    halts: [f64; 2],
    margin: f64,
}

impl<S: Geometry> Boxed<'_, S> {
    /// How far the boxes are apart \[m\].
    #[inline(always)]
    fn apart(&self) -> f64 {
        self.boxes[0].apart(self.boxes[1])
    }
    /// How far one of them still goes in a step of length `dt` when the other is halted, if that takes it to where the other was
    /// \[m\]; else 0.
    #[inline(always)]
    fn halted(&self, dt: f64) -> f64 {
        let left = [dt - self.halts[0], dt - self.halts[1]];
        // hardly anything is halted
        if left[0].max(left[1]) <= 0.0 {
            return 0.0;
        }
        self.way_to(0, left[0]).max(self.way_to(1, left[1]))
    }
    /// The way of the other one of them to where one was, and as far as it goes in the time that is left \[m\]; 0 where it does not come
    /// there.
    #[inline(always)]
    fn way_to(&self, one: usize, left: f64) -> f64 {
        if left <= 0.0 {
            return 0.0;
        }
        let (own, there, way) =
            (self.boxes[1 - one], self.boxes[one], self.movers[1 - one].twist.linear * left);
        for k in 0..S::DIM {
            let (gap, way) = ahead(own, there, way, k);
            let gap = gap + self.margin;
            if gap > 0.0 && way <= gap {
                return 0.0;
            }
        }
        way.norm()
    }
}

/// How far a box is from another one along an axis \[m\], and how much of a way or a velocity leads there.
#[inline(always)]
fn ahead<S: Geometry>(from: &Aabb<S>, to: &Aabb<S>, way: S::Vector, k: usize) -> (f64, f64) {
    let (above, below) = (to.min[k] - from.max[k], from.min[k] - to.max[k]);
    if above > below { (above, way[k]) } else { (below, -way[k]) }
}

/// When a box that moves with a velocity meets another one along all axes, both without their margins \[m\]; infinite where it does
/// not \[s\]. Each axis is asked by itself: what leaves along one before it comes along the other is thought to meet.
#[inline(always)]
pub(crate) fn time_to<S: Geometry>(from: &Aabb<S>, to: &Aabb<S>, velocity: S::Vector, margin: f64) -> f64 {
    let mut latest = 0.0_f64;
    for k in 0..S::DIM {
        let (gap, speed) = ahead(from, to, velocity, k);
        let gap = gap + margin;
        if gap > 0.0 {
            latest = latest.max(if speed > 0.0 { gap / speed } else { f64::INFINITY });
        }
    }
    latest
}

/// Asks a chunk of pairs, four at a time.
struct Asking<'a, 'b, S: Geometry> {
    meeting: &'a Meeting<'b, S>,
    pairs: &'a [(u32, u32)],
    margins: &'a mut Margins,
}

impl<S: Geometry> Job for Asking<'_, '_, S> {
    type Output = ();
    #[inline(always)]
    fn work<L: Lanes>(self, lanes: L) {
        let Asking { meeting, pairs, margins } = self;
        let all_may = meeting.columns.all_collide && meeting.joints.keep_nobody_apart();
        for (some, margins) in pairs.chunks(AT_ONCE).zip(margins.chunks_mut(AT_ONCE)) {
            // where fewer than four are left the last is asked several times
            let one = |k: usize| some[k.min(some.len() - 1)];
            let told = meeting.told(lanes, [one(0), one(1), one(2), one(3)]);
            for (k, pair) in some.iter().enumerate() {
                let may = all_may || told[k] < 0.0 || meeting.may_collide(*pair);
                margins[k] = if may { told[k] } else { -1.0 };
            }
        }
    }
}

impl<S: Geometry> Meeting<'_, S> {
    /// Up to which gaps contacts of four pairs are looked for \[m\], if they may collide; less than 0 where their boxes do not overlap by
    /// that much.
    #[inline(always)]
    fn told<L: Lanes>(&self, lanes: L, pairs: [(u32, u32); AT_ONCE]) -> [f64; AT_ONCE] {
        let flights = self.columns.flights.as_slice();
        let (a, b) = (
            Flights::<S, L::Four>::of(lanes, pairs.map(|pair| &flights[pair.0 as usize])),
            Flights::<S, L::Four>::of(lanes, pairs.map(|pair| &flights[pair.1 as usize])),
        );
        let (own, apart) = (a.margin + b.margin, a.apart(&b));
        let (zero, none) = (own.like(0.0), own.like(-1.0));
        let mut told = own;
        if self.soft {
            let falls = (a.falls + b.falls) * own.like(self.dt);
            let approach = within((a.closing(&b), falls), a.least + b.least, own.like(2.0 * self.dt));
            let halted = || {
                let own = own.store();
                lanes.four(&[0, 1, 2, 3].map(|k: usize| self.boxed(pairs[k], own[k]).halted(self.dt)))
            };
            let within = self.no_more(own, approach, halted);
            told = within.if_less(apart + own, none, within);
        }
        zero.if_less(apart, none, told).store()
    }

    /// How far pairs are looked at \[m\] whose boxes' margins are `own` \[m\]: how far they can come towards each other as they move, or
    /// where one of each is halted.
    #[inline(always)]
    fn no_more<F: Four>(&self, own: F, approach: F, halted: impl FnOnce() -> F) -> F {
        let mut farthest = approach;
        if self.columns.somebody_halts {
            let halted = halted();
            farthest = farthest.if_less(halted, halted, farthest);
        }
        farthest.if_less(own, farthest, own)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::abreast::One;
    use crate::ahead::closing;
    use crate::{BodySpec, PlanarShape, Settings, SpatialShape, World};
    use carom_math::lanes::Portable;
    use carom_math::{Planar, Spatial};

    /// Blocks of some sizes beside and on each other, some of them fast, one fixed and perhaps one that meets nobody.
    fn blocks<S: Geometry>(block: fn(f64) -> S::Shape, all_collide: bool) -> World<S> {
        let mut world = World::new(Settings { scheme: Scheme::SoftStep, ..Settings::default() }).unwrap();
        for k in 0..60_u32 {
            let chance = |n: u32| f64::from((k * 40_503 + n * 30_011) % 997) / 997.0 - 0.5;
            let size = 0.5 + f64::from(k % 4);
            let spec = match k {
                0 => BodySpec::fixed(block(6.0)),
                1 if !all_collide => BodySpec { collides_with: 0, ..BodySpec::dense(block(2.0), 1.0) },
                _ => BodySpec::dense(block(size), 1.0),
            };
            let fast = if k == 0 { 0.0 } else { f64::from(k % 7) };
            let (place, velocity) = (
                S::Vector::from_fn(|c| 8.0 * chance(c as u32)),
                S::Vector::from_fn(|c| 9.0 * fast * chance(5 + c as u32)),
            );
            world.add(&format!("block {k}"), spec.at(place).moving(velocity)).unwrap();
        }
        world
    }

    /// The length of a way if the boxes without their margins, one of them moved along each axis by itself, overlap along all.
    fn comes_to<S: Geometry>((a, grown): (Aabb<S>, f64), (b, other): (Aabb<S>, f64), way: S::Vector) -> f64 {
        let along = |k: usize| {
            let (low, high) = (a.min[k] + grown + way[k].min(0.0), a.max[k] - grown + way[k].max(0.0));
            low <= b.max[k] - other && high >= b.min[k] + other
        };
        if (0..S::DIM).all(along) { way.norm() } else { 0.0 }
    }

    fn are_asked_alike<S: Geometry>(block: fn(f64) -> S::Shape, all_collide: bool) {
        let world = blocks::<S>(block, all_collide);
        let (bodies, dt) = (world.bodies(), 0.01);
        let ahead = Ahead::new(bodies, world.settings(), dt, &[]);
        let mut columns = Columns::default();
        columns.make_room(bodies.data.iter().enumerate().map(|(i, d)| Mover::of(d, i, 0)));
        let colliders: Vec<S::Collider> = bodies.data.iter().filter_map(|d| d.collider.clone()).collect();
        columns.place_all(&colliders, &ahead);
        assert_eq!(columns.all_collide, all_collide);
        columns.somebody_halts = columns.halts.contains(&0.0);
        let pairs: Vec<(u32, u32)> = (0..60).flat_map(|i| (i + 1..60).map(move |j| (i, j))).collect();
        for soft in [true, false] {
            let farther = std::cell::Cell::new(0);
            let meeting = Meeting { columns: &columns, joints: &bodies.joints, soft, dt };
            let alone = |&(i, j): &(u32, u32)| {
                let (i, j) = (i as usize, j as usize);
                let (couple, boxes) = (meeting.couple(i, j), [&columns.bounds[i], &columns.bounds[j]]);
                let own = columns.margins[i] + columns.margins[j];
                let by_size = couple.by_size();
                let approach = approach(One(&by_size), closing(One(&by_size)), dt);
                let of = |k: usize| (columns.bounds[k], columns.margins[k]);
                let way = |behind: usize, ahead: usize| {
                    let way = columns.movers[behind].twist.linear * dt;
                    if columns.halts[ahead] == 0.0 { comes_to(of(behind), of(ahead), way) } else { 0.0 }
                };
                let halted = way(i, j).max(way(j, i));
                farther.set(farther.get() + usize::from(approach < halted.min(own)));
                let within = if soft { own.min(approach.max(halted)) } else { own };
                let near = boxes[0].overlaps(boxes[1]) && boxes[0].apart(boxes[1]) + own <= within;
                if near && couple.may_meet() { within } else { -1.0 }
            };
            let (mut met, mut narrower, mut told) = (Vec::new(), 0, 0);
            for some in pairs.chunks(CHUNK - 3) {
                let (margins, mut plain) = (meeting.margins(some), [-1.0; CHUNK]);
                Asking { meeting: &meeting, pairs: some, margins: &mut plain }.work(Portable);
                assert_eq!(margins, plain);
                for (pair, margin) in some.iter().zip(margins) {
                    assert_eq!(margin, alone(pair), "{pair:?}");
                    let own = columns.margins[pair.0 as usize] + columns.margins[pair.1 as usize];
                    narrower += usize::from(margin >= 0.0 && margin < own);
                    let couple = meeting.couple(pair.0 as usize, pair.1 as usize);
                    let speed = closing(One(&couple.by_size()));
                    let surely = meeting.surely_closing(&couple, margin);
                    assert!(margin < 0.0 || surely <= speed, "{pair:?}: {surely} of {speed}");
                    told += usize::from(margin >= 0.0 && surely > 0.99 * speed);
                    met.extend((margin >= 0.0).then_some(*pair));
                }
            }
            for some in pairs.chunks_exact(AT_ONCE) {
                let (some, couple) = ([some[0], some[1], some[2], some[3]], |k: usize| {
                    meeting.couple(some[k].0 as usize, some[k].1 as usize)
                });
                let by_size = [0, 1, 2, 3].map(|k| couple(k).by_size());
                let by_size = Quartet(Portable, &by_size);
                let near = meeting.near(by_size, closing(by_size), some);
                for (k, pair) in some.iter().enumerate().filter(|(k, _)| couple(*k).may_meet()) {
                    assert_eq!(near >> k & 1 == 1, alone(pair) >= 0.0, "{pair:?}");
                }
            }
            assert!(met.len() > 50 && met.len() < pairs.len() / 2, "{} of {}", met.len(), pairs.len());
            assert!((narrower > 20) == soft, "{narrower}");
            assert!((told > 20) == (soft && !columns.somebody_halts), "{told}");
            assert!(columns.somebody_halts == (S::DIM == 3), "in the plane nobody is asked");
            assert!((farther.get() > 0) == columns.somebody_halts, "nobody flies behind another one");
            let mut kept = pairs.clone();
            meeting.sift(&mut kept);
            assert_eq!(kept, met);
        }
    }

    #[test]
    fn pairs_are_asked_alike_alone_and_side_by_side() {
        for all_collide in [true, false] {
            are_asked_alike::<Planar>(|size| PlanarShape::Box { size: [size; 2] }, all_collide);
            are_asked_alike::<Spatial>(|size| SpatialShape::Box { size: [size; 3] }, all_collide);
        }
    }
}
