//! Who meets whom in a step, before any shape is looked at: boxes that overlap, groups, joints, and in soft steps how far two
//! surfaces can come towards each other.

use crate::abreast::One;
use crate::ahead::{Couple, Mover, closing};
use crate::joint::Joints;
use carom_geometry::{Aabb, Geometry};

/// Who meets whom in a step: what is asked of pairs whose boxes may overlap.
pub(crate) struct Meeting<'a, S: Geometry> {
    pub bounds: &'a [Aabb<S>],
    pub margins: &'a [f64],
    pub movers: &'a [Mover<S>],
    pub joints: &'a Joints<S>,
    /// They meet by their approach where that is less than the margins of their boxes.
    pub soft: bool,
    pub dt: f64,
}

impl<'a, S: Geometry> Meeting<'a, S> {
    /// Two bodies by their places in the columns.
    #[inline(always)]
    pub fn couple(&self, i: usize, j: usize) -> Couple<'a, S> {
        Couple { a: &self.movers[i], b: &self.movers[j] }
    }

    /// A pair whose boxes overlap and that may meet, with the margins of both boxes \[m\].
    #[inline(always)]
    fn may(&self, i: usize, j: usize) -> Option<(Couple<'a, S>, f64)> {
        let couple = self.couple(i, j);
        let (a, b) = couple.indices();
        let boxes = self.bounds[i].overlaps(&self.bounds[j]);
        let may = boxes && couple.may_meet() && !self.joints.keeps_apart(a, b);
        may.then(|| (couple, self.margins[i] + self.margins[j]))
    }

    /// The distance of their boxes without margins \[m\].
    #[inline(always)]
    fn gap(&self, i: usize, j: usize, margin: f64) -> f64 {
        self.bounds[i].apart(&self.bounds[j]) + margin
    }

    /// Up to which gap \[m\] contacts of a pair are looked for; nothing where it has none.
    #[inline(always)]
    pub fn of(&self, i: usize, j: usize) -> Option<f64> {
        let (couple, margin) = self.may(i, j)?;
        if !self.soft || margin <= couple.least_margin() {
            return Some(margin);
        }
        let within = margin.min(couple.approach(self.dt, closing(One(&couple.by_size()))));
        (self.gap(i, j, margin) <= within).then_some(within)
    }

    /// Whether a pair has such a gap: how fast it closes matters only where it is not near anyway.
    #[inline(always)]
    pub fn meets(&self, i: usize, j: usize) -> bool {
        let Some((couple, margin)) = self.may(i, j) else { return false };
        let least = couple.least_margin();
        if !self.soft || margin <= least {
            return true;
        }
        let gap = self.gap(i, j, margin);
        let near = |within: f64| gap <= margin.min(within);
        near(least) || near(couple.approach(self.dt, closing(One(&couple.by_size()))))
    }
}
