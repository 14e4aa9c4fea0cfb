//! Work of a step's impulses, patch by patch. Arms and inertias stand still in a step, so the kick identity holds for the
//! sum of all that a patch gave in it: dT = P.(u_0 + u_1)/2 with the local twists at the step's start and end.

use super::bodies::Table;
use super::pack::{Beside, Pack};
use super::prepare::{Frame, lever};
use super::shared::Places;
use carom_math::lanes::{Lanes, Real};
use carom_math::wide::inner;
use carom_math::{Several, Wide};

/// Books what a pack's impulses did.
#[inline(always)]
pub fn book<S: Wide, L: Lanes>(
    lanes: L,
    (pack, beside): (&Pack<S>, &mut Beside<S>),
    at: [Places<'_>; 2],
    records: &Table<S>,
) {
    let frame = Frame::of(lanes, pack);
    let (a, b) = (records.mean(lanes, &at[0]), records.mean(lanes, &at[1]));
    let (normal, slip) = frame.twist(&a, &b);
    let (mut pressing, mut rubbing) = (Real::all(lanes, 0.0), Real::all(lanes, 0.0));
    for i in 0..<S::Points<f32> as Several<f32>>::LEN {
        let total = Real::load(lanes, &beside.total[i]);
        pressing += total * inner(&lever::<S, L>(lanes, pack, i), &normal);
    }
    for k in 0..<S::Spins<f32> as Several<f32>>::LEN {
        rubbing += Real::load(lanes, &beside.rubbed[k]) * slip[k];
    }
    if beside.resists {
        for k in 0..<S::Slips<f32> as Several<f32>>::LEN {
            rubbing += Real::load(lanes, &beside.rolled[k]) * normal[k + 1];
        }
    }
    beside.pressing_work = pressing.store();
    beside.rubbing_work = rubbing.store();
}
