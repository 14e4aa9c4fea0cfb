//! Errors of integrated moments and what they mean relative to the body: of the mass, of the centre over the
//! radius of gyration k, of the inertia over m k^2. Knows no rule.

use crate::mass_moments::Moments;
use carom_math::Column;

/// Absolute errors of the measure, the first and the second moment (norms, about the origin).
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Errors(pub [f64; 3]);

impl Errors {
    /// Size of a difference, times a factor.
    pub fn of<const N: usize>(difference: &Moments<N>, factor: f64) -> Self {
        Errors(difference.sizes().map(|x| factor * x))
    }
    /// Adds a multiple.
    pub fn add(&mut self, k: f64, other: &Self) {
        for i in 0..3 {
            self.0[i] += k * other.0[i];
        }
    }
    /// Raises every error to at least another's.
    pub fn raise(&mut self, least: &Self) {
        for i in 0..3 {
            self.0[i] = self.0[i].max(least.0[i]);
        }
    }
}

/// What errors are measured against.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ErrorScale {
    /// Mass \[kg\].
    pub mass: f64,
    /// Distance of the centre from the origin \[m\].
    pub offset: f64,
    /// Radius of gyration \[m\].
    pub gyration: f64,
}

impl ErrorScale {
    /// From the total's moments; `None` unless its mass is positive.
    pub fn of<const N: usize>(total: &Moments<N>) -> Option<Self> {
        if total.measure.is_nan() || total.measure <= 0.0 {
            return None;
        }
        let trace = |m: &[[f64; N]; N]| (0..N).map(|i| m[i][i]).sum::<f64>() / total.measure;
        // a mass drawn together in a point keeps a scale
        let gyration =
            trace(&total.central_second()).max(1e-12 * trace(&total.second)).max(f64::MIN_POSITIVE);
        let offset = (total.center() - total.origin).norm();
        Some(ErrorScale { mass: total.measure, offset, gyration: gyration.sqrt() })
    }
    /// The largest of the relative errors of mass, centre (over the radius of gyration k) and inertia (over
    /// m k^2), as they follow from the moments' errors when the centre is moved to.
    pub fn relative(&self, Errors([zeroth, first, second]): &Errors) -> f64 {
        let (c, k) = (self.offset, self.gyration);
        let center = first + c * zeroth;
        let inertia = second + 2.0 * c * first + c * c * zeroth;
        zeroth.max(center / k).max(inertia / (k * k)) / self.mass
    }
}
