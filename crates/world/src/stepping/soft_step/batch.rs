//! Patches that were seen, eight at a time: which of them stand, and how they lie now. Eight that
//! all stand are laid as they are asked; where bodies move few do, and those fill batches of their own.

use super::again::{Now, Sight, Then, Together};
use super::memory::{PatchForce, Seen};
use super::patches::{Begun, write_patches};
use crate::abreast::{Abreast, Quartet};
use crate::ahead::{Ahead, Couple, Mover, closing};
use crate::meeting::Meeting;
use carom_geometry::Geometry;
use carom_math::lanes::{Four, Job, Lanes, WIDTH, dispatch};
use carom_math::{Column, Several};
use carom_solver::soft::{EightPatches, FourPatches, Patch};

/// Half of a batch.
pub(super) const HALF: usize = WIDTH / 2;

/// A patch that was seen in the step before, with its forces at its end, and its bodies.
#[derive(Clone, Copy)]
pub(super) struct Old<'a, S: Geometry> {
    pub seen: &'a Seen<S>,
    pub force: &'a PatchForce<S>,
    pub couple: Couple<'a, S>,
}

impl<'a, S: Geometry> Old<'a, S> {
    #[inline(always)]
    fn sight(&self) -> Sight<'a, S> {
        Sight { seen: self.seen, a_is_small: self.couple.a_is_small() }
    }
}

/// Eight patches that were seen, as they lie now.
pub(super) struct Batch<S: Geometry> {
    /// As the lanes take them, but for their coefficients.
    pub patches: [Patch<S>; WIDTH],
    pub told: Lying<S>,
}

/// What is told of eight patches as they lie.
#[derive(Clone, Copy)]
pub(super) struct Lying<S: Geometry> {
    /// Smallest gaps \[m\], and levers of friction about the normal \[m\].
    pub deepest: [f64; WIDTH],
    pub levers: [f64; WIDTH],
    normals: S::Vectors<[f64; WIDTH]>,
}

impl<S: Geometry> Default for Lying<S> {
    fn default() -> Self {
        let none = [0.0; WIDTH];
        Lying { deepest: none, levers: none, normals: S::Vectors::all(none) }
    }
}

impl<S: Geometry> Lying<S> {
    /// The normal of one of them.
    #[inline(always)]
    pub fn normal(&self, lane: usize) -> S::Vector {
        Column::from_fn(|k| self.normals[k][lane])
    }
    /// Another takes the place of one of them.
    pub fn replace(&mut self, lane: usize, normal: S::Vector, deepest: f64) {
        self.deepest[lane] = deepest;
        for k in 0..S::DIM {
            self.normals[k][lane] = normal[k];
        }
    }
}

impl<S: Geometry> Default for Batch<S> {
    fn default() -> Self {
        Batch { patches: [Patch::none(); WIDTH], told: Lying::default() }
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
        let halves = [Half::of(lanes, self.old, 0), Half::of(lanes, self.old, HALF)];
        let mut stand = 0;
        for (half, first) in halves.iter().zip([0, HALF]) {
            stand |= half.stand(lanes, self.ahead) << first;
        }
        if stand == ALL {
            self.laying.lay(lanes, &halves);
        }
        stand
    }
}

/// Four of eight patches: what was seen of them, where their bodies are now, and how those moved.
pub(super) struct Half<'a, S: Geometry, L: Lanes> {
    then: Then<S, L::Four>,
    now: [Now<'a, S>; HALF],
    by_size: [[&'a Mover<S>; 2]; HALF],
    together: Together<S, L::Four>,
    forces: [&'a PatchForce<S>; HALF],
}

impl<'a, S: Geometry, L: Lanes> Half<'a, S, L> {
    /// Of patches of which this was seen, from couple to couple.
    #[inline(always)]
    pub fn new(
        lanes: L,
        then: Then<S, L::Four>,
        couples: &[Couple<'a, S>; HALF],
        forces: [&'a PatchForce<S>; HALF],
    ) -> Self {
        let now = [now(&couples[0]), now(&couples[1]), now(&couples[2]), now(&couples[3])];
        let by_size =
            [couples[0].by_size(), couples[1].by_size(), couples[2].by_size(), couples[3].by_size()];
        let together = Together::between(&then, Quartet(lanes, &now));
        Half { then, now, by_size, together, forces }
    }

    /// Of eight patches, from the first on.
    #[inline(always)]
    fn of(lanes: L, old: &[Old<'a, S>; WIDTH], first: usize) -> Self {
        let [a, b, c, d] = [old[first], old[first + 1], old[first + 2], old[first + 3]];
        let sights = [a.sight(), b.sight(), c.sight(), d.sight()];
        let couples = [a.couple, b.couple, c.couple, d.couple];
        Half::new(lanes, Then::of(Quartet(lanes, &sights)), &couples, [a.force, b.force, c.force, d.force])
    }

    /// How fast they can come towards each other \[m/s\].
    #[inline(always)]
    fn closing(&self, lanes: L) -> L::Four {
        closing(Quartet(lanes, &self.by_size))
    }

    /// Which of them stand, bit by bit.
    #[inline(always)]
    pub fn stand(&self, lanes: L, ahead: &Ahead<'_, S>) -> u32 {
        self.together.stand(ahead, Quartet(lanes, &self.by_size), self.closing(lanes))
    }

    /// Which of them stand and are near, whose smallest gaps are these; `places` are those of their bodies in the columns.
    #[inline(always)]
    pub fn stay(
        &self,
        lanes: L,
        (ahead, meeting): (&Ahead<'_, S>, &Meeting<'a, S>),
        places: [(u32, u32); HALF],
        deepest: &[f64],
    ) -> u32 {
        let (by_size, closing) = (Quartet(lanes, &self.by_size), self.closing(lanes));
        let stand = self.together.stand(ahead, by_size, closing);
        let deepest = lanes.four(&[deepest[0], deepest[1], deepest[2], deepest[3]]);
        // two points of both surfaces are as far apart as their gap then, and as they moved: so are their boxes at most
        let surely = deepest.abs() + self.together.strayed(by_size);
        if meeting.are_surely_near(by_size, surely) {
            stand
        } else {
            stand & meeting.near(by_size, closing, places)
        }
    }

    /// Lays them, and tells of it.
    #[inline(always)]
    pub fn lay(&self, lanes: L, h: f32, room: &mut FourPatches<'_, S>, first: usize, told: &mut Lying<S>) {
        let outline = &self.then.outline;
        let laid = self.together.laid(outline);
        let (forces, now) = (Quartet(lanes, &self.forces), Quartet(lanes, &self.now));
        let begun = Begun {
            normal: forces.several(|force, i| force.normal[i]),
            rubbing: Some((forces.several(|force, k| force.friction[k]), forces.read(|force| force.twist))),
        };
        let place_a: S::Vectors<L::Four> = now.several(|now, k| now.0[0].0[k]);
        let place_b: S::Vectors<L::Four> = now.several(|now, k| now.0[1].0[k]);
        let lever = write_patches(room, (outline, &laid), [place_a, place_b], &begun, h);
        put(&mut told.levers, first, lever);
        put(&mut told.deepest, first, laid.deepest(outline));
        for k in 0..S::DIM {
            put(&mut told.normals[k], first, laid.normal[k]);
        }
    }
}

/// Where two bodies are.
#[inline(always)]
fn now<'a, S: Geometry>(couple: &Couple<'a, S>) -> Now<'a, S> {
    let Couple { a, b } = *couple;
    Now([(&a.position, &a.rotation), (&b.position, &b.rotation)])
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
        let halves = [Half::of(lanes, self.old, 0), Half::of(lanes, self.old, HALF)];
        self.lay(lanes, &halves);
    }
}

impl<S: Geometry> Laying<'_, S> {
    /// Lays both halves.
    #[inline(always)]
    fn lay<L: Lanes>(self, lanes: L, [one, other]: &[Half<'_, S, L>; 2]) {
        let Laying { h, batch, room, .. } = self;
        one.lay(lanes, h, &mut room.half(false), 0, &mut batch.told);
        other.lay(lanes, h, &mut room.half(true), HALF, &mut batch.told);
        room.part(lanes, &mut batch.patches);
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
    use crate::material::Coefficients;
    use crate::stepping::soft_step::AGAIN;
    use crate::stepping::soft_step::anew::Waiting;
    use crate::stepping::soft_step::face::{Laid, Outline};
    use crate::{BodySpec, PlanarShape, Scheme, Settings, SpatialShape, World};
    use carom_math::lanes::Portable;
    use carom_math::{Planar, Rotation, Spatial};
    use carom_solver::soft::{Numbers, Patches};

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

    fn coefficients() -> Coefficients {
        let (friction, spinning) = (0.3, 0.02);
        let (rolling, restitution, tangential_restitution) = Default::default();
        Coefficients { friction, rolling, spinning, restitution, tangential_restitution }
    }

    /// Patches of faces that were just found, laid together.
    fn laid_anew<S: Geometry>(old: &[Old<'_, S>; WIDTH], seen: &[Seen<S>], count: usize) -> Vec<Patch<S>> {
        let (mut waiting, mut patches) = (Waiting::default(), Patches::default());
        for (k, old) in old[..count].iter().enumerate() {
            patches.add();
            assert_eq!(waiting.add((k, k), *old.force, &coefficients()), k + 1 == WIDTH);
        }
        waiting.lay(seen, 0.0025, &mut patches);
        waiting.lay(seen, 0.0025, &mut patches);
        patches.list().to_vec()
    }

    /// The patch of a face that was just found.
    fn alone<S: Geometry>(seen: &Seen<S>, force: &PatchForce<S>) -> Patch<S> {
        let (outline, mut patch) = (Outline::of(One(&Sight { seen, a_is_small: true })), Patch::none());
        let friction = One(&force.friction).several(|f, k| f[k]);
        let begun = Begun { normal: force.normal, rubbing: Some((friction, force.twist)) };
        let places = [0, 1].map(|i| One(&seen.places[i]).several(|place, k| place[k]));
        let lever = write_patches(&mut patch, (&outline, &Laid::of(&outline)), places, &begun, 0.0025);
        let c = coefficients();
        patch.set_friction(c.friction as f32, c.friction as f32 * lever as f32 + c.spinning as f32);
        patch
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
            let fresh = laid_anew(&old, &seen, 1 + turn % WIDTH);
            for (lane, Old { seen, force, couple }) in old.iter().enumerate() {
                if let Some(patch) = fresh.get(lane) {
                    assert_eq!(bits(patch), bits(&alone(seen, force)), "turn {turn}, lane {lane}");
                }
                assert_eq!(bits(&batch.patches[lane]), bits(&plain.patches[lane]));
                let then = Then::of(One(&Sight { seen, a_is_small: couple.a_is_small() }));
                let (together, outline) = (Together::between(&then, One(&now(couple))), then.outline);
                let (laid, mut patch) = (together.laid(&outline), Patch::none());
                let friction = One(&force.friction).several(|f, k| f[k]);
                let begun = Begun { normal: force.normal, rubbing: Some((friction, force.twist)) };
                let places = [couple.a, couple.b].map(|mover| One(mover).several(|m, k| m.position[k]));
                let lever = write_patches(&mut patch, (&outline, &laid), places, &begun, 0.0025);
                assert_eq!(bits(&batch.patches[lane]), bits(&patch), "turn {turn}, lane {lane}");
                let told = (batch.told.levers[lane], batch.told.deepest[lane]);
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
