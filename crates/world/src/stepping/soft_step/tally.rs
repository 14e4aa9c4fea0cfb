//! What is counted of the faces of a step while they are found, so that nobody walks over them for it.

use super::face::Met;
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
    }
}
