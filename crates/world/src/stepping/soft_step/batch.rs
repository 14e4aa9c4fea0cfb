//! Patches that were seen, eight at a time: which of them stand, and how they lie now. Eight that
//! all stand are laid as they are asked; where bodies move few do, and those fill batches of their own.

use super::again::{Sight, Together};
use super::face::Outline;
use super::memory::{PatchForce, Seen};
use super::patches::{Begun, write_patches};
use crate::abreast::{Abreast, Quartet};
use crate::ahead::{Ahead, Couple};
use carom_geometry::Geometry;
use carom_math::lanes::{Four, Job, Lanes, WIDTH, dispatch};
use carom_math::{Column, Several};
use carom_solver::soft::{EightPatches, FourPatches, Patch};

/// Half of a batch.
const HALF: usize = WIDTH / 2;

/// A patch that was seen in the step before, with its forces at its end, and its bodies.
#[derive(Clone, Copy)]
pub(super) struct Old<'a, S: Geometry> {
    pub seen: &'a Seen<S>,
    pub force: &'a PatchForce<S>,
    pub couple: Couple<'a, S>,
}

/// Eight patches that were seen, as they lie now.
pub(super) struct Batch<S: Geometry> {
    /// As the lanes take them, but for their coefficients.
    pub patches: [Patch<S>; WIDTH],
    /// Smallest gaps \[m\], and levers of friction about the normal \[m\].
    pub deepest: [f64; WIDTH],
    pub levers: [f64; WIDTH],
    normals: S::Vectors<[f64; WIDTH]>,
}

impl<S: Geometry> Default for Batch<S> {
    fn default() -> Self {
        let none = [0.0; WIDTH];
        Batch { patches: [Patch::none(); WIDTH], deepest: none, levers: none, normals: S::Vectors::all(none) }
    }
}

/// Which of eight patches stand, bit by bit; where all do, they are laid in `batch` for a step whose substeps have length `h` \[s\].
pub(super) fn ask<S: Geometry>(
    old: &[Old<'_, S>; WIDTH],
    (ahead, h): (&Ahead<'_, S>, f32),
    batch: &mut Batch<S>,
    room: &mut EightPatches<S>,
) -> u32 {
    dispatch(Asking { old, ahead, laying: Laying { old, h, batch, room } })
}

impl<S: Geometry> Batch<S> {
    /// Lays eight patches for a step whose substeps have length `h` \[s\].
    pub fn lay(&mut self, old: &[Old<'_, S>; WIDTH], h: f32, room: &mut EightPatches<S>) {
        dispatch(Laying { old, h, batch: self, room });
    }

    /// The normal of one of them.
    #[inline(always)]
    pub fn normal(&self, lane: usize) -> S::Vector {
        Column::from_fn(|k| self.normals[k][lane])
    }
}

/// All of a batch.
pub(super) const ALL: u32 = (1 << WIDTH) - 1;

/// Asks who stands.
struct Asking<'a, S: Geometry> {
    old: &'a [Old<'a, S>; WIDTH],
    ahead: &'a Ahead<'a, S>,
    laying: Laying<'a, S>,
}

impl<S: Geometry> Job for Asking<'_, S> {
    type Output = u32;
    #[inline(always)]
    fn work<L: Lanes>(self, lanes: L) -> u32 {
        let sights = [sights(self.old, 0), sights(self.old, HALF)];
        let together = moved(lanes, &sights);
        let mut stand = 0;
        for (together, first) in together.iter().zip([0, HALF]) {
            let by_size = |k: usize| self.old[first + k].couple.by_size();
            let pairs = [by_size(0), by_size(1), by_size(2), by_size(3)];
            stand |= together.stand(self.ahead, Quartet(lanes, &pairs)) << first;
        }
        if stand == ALL {
            self.laying.lay(lanes, &sights, &together);
        }
        stand
    }
}

/// Four of eight patches, from the first on.
#[inline(always)]
fn sights<'a, S: Geometry>(old: &[Old<'a, S>; WIDTH], first: usize) -> [Sight<'a, S>; HALF] {
    let sight = |k: usize| {
        let Old { seen, couple: Couple { a, b }, .. } = old[first + k];
        let now = [(&a.position, &a.rotation), (&b.position, &b.rotation)];
        Sight { seen, now, a_is_small: old[first + k].couple.a_is_small() }
    };
    [sight(0), sight(1), sight(2), sight(3)]
}

/// How the bodies of both halves moved since they were looked at.
#[inline(always)]
fn moved<S: Geometry, L: Lanes>(
    lanes: L,
    [one, other]: &[[Sight<'_, S>; HALF]; 2],
) -> [Together<S, L::Four>; 2] {
    [Together::between(Quartet(lanes, one)), Together::between(Quartet(lanes, other))]
}

/// Lays a batch.
struct Laying<'a, S: Geometry> {
    old: &'a [Old<'a, S>; WIDTH],
    h: f32,
    batch: &'a mut Batch<S>,
    room: &'a mut EightPatches<S>,
}

impl<S: Geometry> Job for Laying<'_, S> {
    type Output = ();
    #[inline(always)]
    fn work<L: Lanes>(self, lanes: L) {
        let sights = [sights(self.old, 0), sights(self.old, HALF)];
        let together = moved(lanes, &sights);
        self.lay(lanes, &sights, &together);
    }
}

impl<S: Geometry> Laying<'_, S> {
    /// Lays both halves, whose motions are known.
    #[inline(always)]
    fn lay<L: Lanes>(
        self,
        lanes: L,
        sights: &[[Sight<'_, S>; HALF]; 2],
        together: &[Together<S, L::Four>; 2],
    ) {
        let Laying { old, h, batch, room } = self;
        let (one, other) = old.split_at(HALF);
        for (k, half) in [one, other].into_iter().enumerate() {
            if let Ok(forces) = half.try_into() {
                let numbers = (Quartet(lanes, &sights[k]), Quartet(lanes, forces));
                lay_four(numbers, &together[k], h, (batch, &mut room.half(k > 0), k * HALF));
            }
        }
        room.part(lanes, &mut batch.patches);
    }
}

/// Lays four of a batch, from the first on.
#[inline(always)]
fn lay_four<'a, S: Geometry, L: Lanes>(
    (sights, old): (Quartet<'_, Sight<'a, S>, L>, Quartet<'_, Old<'a, S>, L>),
    together: &Together<S, L::Four>,
    h: f32,
    (batch, room, first): (&mut Batch<S>, &mut FourPatches<'_, S>, usize),
) {
    let outline = Outline::of(sights);
    let laid = together.laid(&outline);
    let begun = Begun {
        normal: old.several(|old, i| old.force.normal[i]),
        rubbing: Some((old.several(|old, k| old.force.friction[k]), old.read(|old| old.force.twist))),
    };
    let place_a: S::Vectors<L::Four> = sights.several(|sight, k| sight.now[0].0[k]);
    let place_b: S::Vectors<L::Four> = sights.several(|sight, k| sight.now[1].0[k]);
    let lever = write_patches(room, (&outline, &laid), [place_a, place_b], &begun, h);
    put(&mut batch.levers, first, lever);
    put(&mut batch.deepest, first, laid.deepest(&outline));
    for k in 0..S::DIM {
        put(&mut batch.normals[k], first, laid.normal[k]);
    }
}

/// Writes four of eight numbers.
#[inline(always)]
fn put(to: &mut [f64; WIDTH], first: usize, numbers: impl Four) {
    to[first..first + HALF].copy_from_slice(&numbers.store());
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::abreast::One;
    use crate::ahead::{Mover, closing};
    use crate::stepping::soft_step::AGAIN;
    use crate::{BodySpec, PlanarShape, Scheme, Settings, SpatialShape, World};
    use carom_math::lanes::Portable;
    use carom_math::{Planar, Rotation, Spatial};

    /// Numbers in -1..1.
    struct Dice(u32);

    impl Dice {
        fn roll(&mut self) -> f64 {
            self.0 = self.0.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            f64::from(self.0) / f64::from(u32::MAX) * 2.0 - 1.0
        }
        fn column<C: Column>(&mut self, most: f64) -> C {
            C::from_fn(|_| most * self.roll())
        }
    }

    /// Blocks somewhere, some of them turned, some moving.
    fn blocks<S: Geometry>(dice: &mut Dice, block: fn(f64) -> S::Shape) -> World<S> {
        let mut world = World::new(Settings { scheme: Scheme::SoftStep, ..Settings::default() }).unwrap();
        for k in 0..=WIDTH {
            let size = 1.0 + 0.5 * dice.roll();
            let spec = BodySpec::dense(block(size), 1.0).at(dice.column(3.0));
            let spec = if k % 3 == 0 { spec } else { spec.turned(S::Rotation::about(dice.column(1.0))) };
            world.add(&format!("block {k}"), spec.moving(dice.column(0.1))).unwrap();
        }
        world
    }

    /// A patch of two bodies as they were a little before, or as they are.
    fn seen<S: Geometry>(dice: &mut Dice, couple: &Couple<'_, S>, moved: bool) -> Seen<S> {
        let most = if moved { 4e-3 } else { 0.0 };
        let mut attitudes = [S::Turns::all(0.0); 2];
        let mut places = [S::Vector::ZERO; 2];
        for (i, mover) in [couple.a, couple.b].into_iter().enumerate() {
            let then = mover.rotation.then(&S::Rotation::about(dice.column(most)));
            attitudes[i].slice_mut().copy_from_slice(if moved { then } else { mover.rotation }.as_slice());
            places[i] = mover.position + dice.column(most);
        }
        let (mut points, mut gaps) = (S::Points::all(S::Vector::ZERO), S::Points::all(0.0));
        for i in 0..S::Points::<f64>::LEN {
            (points[i], gaps[i]) = (couple.a.position + dice.column(0.5), 1e-2 * dice.roll());
        }
        let normal = S::Vector::from_fn(|k| if k == 0 { 0.6 } else { 0.8 * dice.roll() });
        let count = 1 + (dice.0 >> 8) as usize % S::Points::<f64>::LEN;
        let (ids, pair) = (S::Points::all(0), couple.serials());
        Seen { pair, count, ids, normal: normal.normalized().unwrap(), points, gaps, places, attitudes }
    }

    fn bits<S: Geometry>(patch: &Patch<S>) -> Vec<u32> {
        (0..8 * S::Rows::<f32>::LEN).map(|k| patch[k].to_bits()).collect()
    }

    fn are_laid_alike<S: Geometry>(block: fn(f64) -> S::Shape) {
        let mut dice = Dice(7);
        for turn in 0..20 {
            let world = blocks::<S>(&mut dice, block);
            let ahead = Ahead::new(world.bodies(), world.settings(), 0.01, &[]);
            let movers: Vec<Mover<S>> = (0..=WIDTH).map(|i| ahead.mover(i)).collect();
            let couples: Vec<Couple<'_, S>> =
                movers.windows(2).map(|m| Couple { a: &m[0], b: &m[1] }).collect();
            let seen: Vec<Seen<S>> = couples.iter().map(|c| self::seen(&mut dice, c, turn > 0)).collect();
            let forces: Vec<PatchForce<S>> = (0..WIDTH)
                .map(|_| {
                    let mut normal = S::Points::all(0.0);
                    normal.slice_mut().iter_mut().for_each(|x| *x = dice.roll().abs());
                    let (friction, twist, rolling) = (dice.column(1.0), dice.roll(), dice.column(1.0));
                    PatchForce { normal, friction, twist, rolling }
                })
                .collect();
            let old = std::array::from_fn(|k| Old { seen: &seen[k], force: &forces[k], couple: couples[k] });
            let (mut batch, mut plain) = (Batch::default(), Batch::default());
            let (h, room) = (0.0025, &mut EightPatches::default());
            let stand = ask(&old, (&ahead, h), &mut plain, room);
            batch.lay(&old, h, room);
            if stand == ALL {
                (0..WIDTH).for_each(|k| assert_eq!(bits(&batch.patches[k]), bits(&plain.patches[k])));
            }
            let laying = Laying { old: &old, h, batch: &mut plain, room };
            assert_eq!(stand, Asking { old: &old, ahead: &ahead, laying }.work(Portable));
            Laying { old: &old, h, batch: &mut plain, room }.work(Portable);
            // blocks that were not seen elsewhere stand unless they come at each other
            let rests = |old: &Old<'_, S>| {
                0.01 * closing(One(&old.couple.by_size())) < AGAIN * old.couple.by_size()[0].extent
            };
            let resting = (0..WIDTH).fold(0, |all, lane| all | u32::from(rests(&old[lane])) << lane);
            assert!(if turn == 0 { stand == resting } else { stand & !resting == 0 });
            for (lane, Old { seen, force, couple }) in old.iter().enumerate() {
                assert_eq!(bits(&batch.patches[lane]), bits(&plain.patches[lane]));
                let now = [couple.a, couple.b].map(|mover| (&mover.position, &mover.rotation));
                let sight = Sight { seen, now, a_is_small: couple.a_is_small() };
                let (together, outline) = (Together::between(One(&sight)), Outline::of(One(&sight)));
                let (laid, mut patch) = (together.laid(&outline), Patch::none());
                let friction = One(&force.friction).several(|f, k| f[k]);
                let begun = Begun { normal: force.normal, rubbing: Some((friction, force.twist)) };
                let places = [couple.a, couple.b].map(|mover| One(mover).several(|m, k| m.position[k]));
                let lever = write_patches(&mut patch, (&outline, &laid), places, &begun, 0.0025);
                assert_eq!(bits(&batch.patches[lane]), bits(&patch), "turn {turn}, lane {lane}");
                let told = (batch.levers[lane], batch.deepest[lane]);
                assert_eq!(told, (lever, laid.deepest(&outline)));
                // the smallest gap is that of the points that are told of
                let spots = together.spots(&outline, seen.count);
                let gaps = &spots.gaps.slice()[..spots.count];
                assert_eq!(gaps.iter().copied().fold(f64::INFINITY, f64::min), told.1);
                for (now, then) in spots.points.slice().iter().zip(seen.points.slice()).take(spots.count) {
                    let way = (*now - *then).max_abs();
                    assert!(if turn == 0 { way < 1e-14 } else { way > 1e-6 }, "{way}");
                }
            }
        }
    }

    #[test]
    fn patches_are_laid_alike_alone_and_side_by_side() {
        are_laid_alike::<Planar>(|size| PlanarShape::Box { size: [size; 2] });
        are_laid_alike::<Spatial>(|size| SpatialShape::Box { size: [size; 3] });
    }
}
