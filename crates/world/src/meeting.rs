//! Who meets whom in a step, before any shape is looked at: boxes that overlap, groups, joints, and in soft steps how far two
//! surfaces can come towards each other. Pairs are asked four at a time.

use crate::abreast::{Abreast, Quartet};
use crate::ahead::{Couple, Mover, approach};
use crate::columns::{CHUNK, Columns};
use crate::joint::Joints;
use carom_geometry::{Aabb, Geometry};
use carom_math::lanes::{Four, Job, Lanes, dispatch};

const _: () = assert!(CHUNK <= 1 << u8::BITS);

/// Pairs that are asked together.
const AT_ONCE: usize = 4;

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
    /// Two bodies by their places in the columns.
    #[inline(always)]
    pub fn couple(&self, i: usize, j: usize) -> Couple<'a, S> {
        Couple { a: &self.columns.movers[i], b: &self.columns.movers[j] }
    }

    /// What a chunk of pairs is looked at up to.
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
    fn may(&self, (i, j): (u32, u32)) -> Option<f64> {
        let (i, j) = (i as usize, j as usize);
        let Columns { bounds, margins, .. } = self.columns;
        let couple = self.couple(i, j);
        let (a, b) = couple.indices();
        let may = bounds[i].overlaps(&bounds[j]) && couple.may_meet() && !self.joints.keeps_apart(a, b);
        may.then(|| margins[i] + margins[j])
    }

    #[inline(always)]
    fn asked(&self, (i, j): (u32, u32), margin: f64) -> Asked<'a, S> {
        let (i, j) = (i as usize, j as usize);
        let couple = self.couple(i, j);
        Asked { by_size: couple.by_size(), boxes: [&self.columns.bounds[i], &self.columns.bounds[j]], margin }
    }
}

/// A pair with its boxes and the margins of both \[m\].
struct Asked<'a, S: Geometry> {
    by_size: [&'a Mover<S>; 2],
    boxes: [&'a Aabb<S>; 2],
    margin: f64,
}

/// Asks a chunk of pairs: first one by one who may meet at all and has more than the least margin, then those side by side.
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
        let (mut fast, mut count) = ([0_u8; CHUNK], 0);
        for (k, pair) in pairs.iter().enumerate() {
            let Some(margin) = meeting.may(*pair) else { continue };
            margins[k] = margin;
            if meeting.soft && margin > meeting.couple(pair.0 as usize, pair.1 as usize).least_margin() {
                fast[count] = k as u8;
                count += 1;
            }
        }
        for some in fast[..count].chunks(AT_ONCE) {
            // where fewer than four are left the last is asked several times
            let at = |k: usize| usize::from(some[k.min(some.len() - 1)]);
            let places = [at(0), at(1), at(2), at(3)];
            let [p, q, r, t] = places;
            let asked = [
                meeting.asked(pairs[p], margins[p]),
                meeting.asked(pairs[q], margins[q]),
                meeting.asked(pairs[r], margins[r]),
                meeting.asked(pairs[t], margins[t]),
            ];
            let within = within(Quartet(lanes, &asked), lanes, &asked, meeting.dt);
            for (place, within) in places.iter().zip(within) {
                margins[*place] = within;
            }
        }
    }
}

/// The margins of four pairs where their boxes are that near without them \[m\], and -1 elsewhere.
#[inline(always)]
fn within<'a, S: Geometry, L: Lanes>(
    pairs: Quartet<'_, Asked<'a, S>, L>,
    lanes: L,
    asked: &[Asked<'a, S>; AT_ONCE],
    dt: f64,
) -> [f64; AT_ONCE] {
    let by_size = [asked[0].by_size, asked[1].by_size, asked[2].by_size, asked[3].by_size];
    let (own, approach) = (pairs.read(|pair| pair.margin), approach(Quartet(lanes, &by_size), dt));
    let within = approach.if_less(own, approach, own);
    let gap = pairs.read(|pair| pair.boxes[0].apart(pair.boxes[1])) + own;
    within.if_less(gap, own.like(-1.0), within).store()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::abreast::One;
    use crate::ahead::Ahead;
    use crate::{BodySpec, PlanarShape, Scheme, Settings, SpatialShape, World};
    use carom_math::lanes::Portable;
    use carom_math::{Column, Planar, Spatial};

    /// Blocks of some sizes beside and on each other, some of them fast, one fixed and one that meets nobody.
    fn blocks<S: Geometry>(block: fn(f64) -> S::Shape) -> World<S> {
        let mut world = World::new(Settings { scheme: Scheme::SoftStep, ..Settings::default() }).unwrap();
        for k in 0..60_u32 {
            let chance = |n: u32| f64::from((k * 40_503 + n * 30_011) % 997) / 997.0 - 0.5;
            let size = 0.5 + f64::from(k % 4);
            let spec = match k {
                0 => BodySpec::fixed(block(6.0)),
                1 => BodySpec { collides_with: 0, ..BodySpec::dense(block(2.0), 1.0) },
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

    fn are_asked_alike<S: Geometry>(block: fn(f64) -> S::Shape) {
        let world = blocks::<S>(block);
        let (bodies, dt) = (world.bodies(), 0.01);
        let ahead = Ahead::new(bodies, world.settings(), dt, &[]);
        let mut columns = Columns::default();
        columns.make_room(bodies.data.iter().enumerate().map(|(i, d)| Mover::of(d, i, 0)));
        let colliders: Vec<S::Collider> = bodies.data.iter().filter_map(|d| d.collider.clone()).collect();
        columns.place_all(&colliders, &ahead);
        let pairs: Vec<(u32, u32)> = (0..60).flat_map(|i| (i + 1..60).map(move |j| (i, j))).collect();
        for soft in [true, false] {
            let meeting = Meeting { columns: &columns, joints: &bodies.joints, soft, dt };
            let alone = |&(i, j): &(u32, u32)| {
                let (i, j) = (i as usize, j as usize);
                let (couple, boxes) = (meeting.couple(i, j), [&columns.bounds[i], &columns.bounds[j]]);
                let own = columns.margins[i] + columns.margins[j];
                let approach = approach(One(&couple.by_size()), dt);
                let within = if soft { own.min(approach) } else { own };
                let near = boxes[0].overlaps(boxes[1]) && boxes[0].apart(boxes[1]) + own <= within;
                if near && couple.may_meet() { within } else { -1.0 }
            };
            let (mut met, mut narrower) = (Vec::new(), 0);
            for some in pairs.chunks(CHUNK - 3) {
                let (margins, mut plain) = (meeting.margins(some), [-1.0; CHUNK]);
                Asking { meeting: &meeting, pairs: some, margins: &mut plain }.work(Portable);
                assert_eq!(margins, plain);
                for (pair, margin) in some.iter().zip(margins) {
                    assert_eq!(margin, alone(pair), "{pair:?}");
                    let own = columns.margins[pair.0 as usize] + columns.margins[pair.1 as usize];
                    narrower += usize::from(margin >= 0.0 && margin < own);
                    met.extend((margin >= 0.0).then_some(*pair));
                }
            }
            assert!(met.len() > 50 && met.len() < pairs.len() / 2, "{} of {}", met.len(), pairs.len());
            assert!((narrower > 20) == soft, "{narrower}");
            let mut kept = pairs.clone();
            meeting.sift(&mut kept);
            assert_eq!(kept, met);
        }
    }

    #[test]
    fn pairs_are_asked_alike_alone_and_side_by_side() {
        are_asked_alike::<Planar>(|size| PlanarShape::Box { size: [size; 2] });
        are_asked_alike::<Spatial>(|size| SpatialShape::Box { size: [size; 3] });
    }
}
