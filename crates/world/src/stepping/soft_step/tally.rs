//! What is counted of the faces of a step while they are found, so that nobody walks over them for it.

use super::face::{Met, NONE};
use crate::material::Coefficients;
use carom_geometry::Geometry;

/// Sums over faces.
#[derive(Clone, Copy, Default)]
pub(super) struct Tally {
    /// Points that they have.
    pub points: usize,
    /// The smallest gap \[m\], with its bodies: the first of equal ones.
    pub deepest: Option<(f64, usize, usize)>,
    /// Coefficient \[1\] and bodies of the first face that turns slip round.
    pub turns_slip: Option<(f64, usize, usize)>,
    /// Faces of which nothing need be remembered where they bear nothing.
    pub loose: usize,
    /// The patches that were used again, as places in the list of those seen, while faces are all of them in their order.
    pub again: Again,
}

/// Whether faces are patches that are used again, one after another.
#[derive(Clone, Copy)]
pub(super) struct Again {
    /// The first place, and the one behind the last; none before the first face.
    first: u32,
    end: u32,
    /// Faces that were seen anew are among them, or places were left out.
    broken: bool,
}

impl Default for Again {
    fn default() -> Self {
        Again { first: NONE, end: NONE, broken: false }
    }
}

impl Again {
    /// All of a list of so many, in their order; `broken` where some of them were seen anew.
    pub fn all_of(count: usize, broken: bool) -> Self {
        Again { first: 0, end: count as u32, broken }
    }

    /// Whether they are all of a list of so many.
    pub fn are_all_of(&self, count: usize) -> bool {
        !self.broken && (self.first, self.end as usize) == (0, count)
    }

    /// Adds faces of which this is so.
    #[inline(always)]
    fn add(&mut self, next: Again) {
        self.broken |= next.broken || (self.first != NONE && next.first != self.end);
        self.first = if self.first == NONE { next.first } else { self.first };
        self.end = next.end;
    }
}

impl Tally {
    /// Adds a face.
    #[inline]
    pub fn add<S: Geometry>(&mut self, met: &Met<S>, coefficients: &Coefficients) {
        self.points += usize::from(met.count);
        if self.deepest.is_none_or(|known| met.deepest < known.0) {
            let (a, b) = met.pair();
            self.deepest = Some((met.deepest, a, b));
        }
        self.loose += usize::from(usize::from(met.count) < S::DIM && !met.is_angular);
        self.again.add(Again { first: met.seen, end: met.seen.wrapping_add(1), broken: !met.again });
        let turned = coefficients.tangential_restitution;
        if turned > 0.0 && self.turns_slip.is_none() {
            let (a, b) = met.pair();
            self.turns_slip = Some((turned, a, b));
        }
    }

    /// Adds those of the faces that come next.
    #[inline]
    pub fn join(&mut self, next: &Tally) {
        self.points += next.points;
        if let Some(gap) = next.deepest
            && self.deepest.is_none_or(|known| gap.0 < known.0)
        {
            self.deepest = next.deepest;
        }
        self.turns_slip = self.turns_slip.or(next.turns_slip);
        self.loose += next.loose;
        if next.points > 0 {
            self.again.add(next.again);
        }
    }
}
