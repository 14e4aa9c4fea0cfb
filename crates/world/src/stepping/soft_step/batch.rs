//! Patches that were seen, eight at a time: which of them stand, and how they lie now.

use super::again::{Sight, Together};
use super::face::Outline;
use super::memory::{PatchForce, Seen};
use super::patches::{Begun, write_patches};
use crate::abreast::{Abreast, Quartet};
use crate::ahead::{Ahead, Couple};
use carom_geometry::Geometry;
use carom_math::lanes::{Four, Job, Lanes, WIDTH, dispatch};
use carom_math::{Column, Several};
use carom_solver::soft::{EightPatches, Patch};

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
    /// Which of them stand, bit by bit.
    pub stand: u32,
    /// As the lanes take them, but for their coefficients.
    pub patches: [Patch<S>; WIDTH],
    /// Smallest gaps \[m\], and levers of friction about the normal \[m\].
    pub deepest: [f64; WIDTH],
    pub levers: [f64; WIDTH],
    normals: S::Vectors<[f64; WIDTH]>,
    columns: EightPatches<S>,
}

impl<S: Geometry> Default for Batch<S> {
    fn default() -> Self {
        let none = [0.0; WIDTH];
        Batch {
            stand: 0,
            patches: [Patch::none(); WIDTH],
            deepest: none,
            levers: none,
            normals: S::Vectors::all(none),
            columns: EightPatches::default(),
        }
    }
}

impl<S: Geometry> Batch<S> {
    /// Lays eight patches for a step whose substeps have length `h` \[s\].
    pub fn lay(&mut self, old: &[Old<'_, S>; WIDTH], ahead: &Ahead<'_, S>, h: f32) {
        dispatch(Laying { old, ahead, h, batch: self });
    }

    /// The normal of one of them.
    #[inline(always)]
    pub fn normal(&self, lane: usize) -> S::Vector {
        Column::from_fn(|k| self.normals[k][lane])
    }
}

/// The work on a batch.
struct Laying<'a, S: Geometry> {
    old: &'a [Old<'a, S>; WIDTH],
    ahead: &'a Ahead<'a, S>,
    h: f32,
    batch: &'a mut Batch<S>,
}

impl<S: Geometry> Job for Laying<'_, S> {
    type Output = ();
    #[inline(always)]
    fn work<L: Lanes>(self, lanes: L) {
        let Laying { old, ahead, h, batch } = self;
        let (one, other) = old.split_at(HALF);
        batch.stand = 0;
        for (half, others) in [(one, false), (other, true)] {
            if let Ok(four) = half.try_into() {
                lay_four(lanes, four, (ahead, h), (batch, others));
            }
        }
        batch.columns.part(lanes, &mut batch.patches);
    }
}

/// Lays the first four of a batch, or the others.
#[inline(always)]
fn lay_four<S: Geometry, L: Lanes>(
    lanes: L,
    old: &[Old<'_, S>; HALF],
    (ahead, h): (&Ahead<'_, S>, f32),
    (batch, others): (&mut Batch<S>, bool),
) {
    let sight = |k: usize| {
        let Old { seen, couple, .. } = &old[k];
        let Couple { a, b } = couple;
        let now = [(&a.position, &a.rotation), (&b.position, &b.rotation)];
        Sight { seen, now, a_is_small: couple.a_is_small() }
    };
    let sights = [sight(0), sight(1), sight(2), sight(3)];
    let by_size = |k: usize| old[k].couple.by_size();
    let pairs = [by_size(0), by_size(1), by_size(2), by_size(3)];
    let (sights, first) = (Quartet(lanes, &sights), if others { HALF } else { 0 });
    let together = Together::between(sights);
    batch.stand |= together.stand(ahead, Quartet(lanes, &pairs)) << first;
    let outline = Outline::of(sights);
    let laid = together.laid(&outline);
    let forces = Quartet(lanes, old);
    let begun = Begun {
        normal: forces.several(|old, i| old.force.normal[i]),
        rubbing: Some((forces.several(|old, k| old.force.friction[k]), forces.read(|old| old.force.twist))),
    };
    let place_a: S::Vectors<L::Four> = sights.several(|sight, k| sight.now[0].0[k]);
    let place_b: S::Vectors<L::Four> = sights.several(|sight, k| sight.now[1].0[k]);
    let patches = &mut batch.columns.half(others);
    let lever = write_patches(patches, (&outline, &laid), [place_a, place_b], &begun, h);
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
