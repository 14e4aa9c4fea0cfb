//! Four pairs side by side: how their numbers come into registers. Knows no shapes.

use crate::geometry::ABREAST;
use carom_math::lanes::{Four, Lanes};

/// Something of each of up to [`ABREAST`] things; what is missing repeats the last. `None` of none.
#[inline(always)]
pub fn four_of<T, R>(things: &[T], of: impl Fn(&T) -> R) -> Option<[R; ABREAST]> {
    let last = things.last()?;
    let one = |k: usize| of(things.get(k).unwrap_or(last));
    Some([one(0), one(1), one(2), one(3)])
}

/// Four records of four numbers as four numbers of four records. What works in lanes is a function: what a closure does would not
/// use the registers.
#[inline(always)]
pub fn columns<L: Lanes>(lanes: L, [p, q, r, s]: [&[f64; 4]; ABREAST]) -> [L::Four; 4] {
    L::Four::turned([lanes.four(p), lanes.four(q), lanes.four(r), lanes.four(s)])
}
