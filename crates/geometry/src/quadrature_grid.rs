//! Sums over tensor grids of a rule's nodes, with the error that every axis contributes.
//! Knows no density.

use crate::mass_moments::Moments;
use crate::quadrature_error::Errors;
use crate::quadrature_rule::{Rule, SAFETY};

/// An integral over some axes of a box.
pub(crate) struct TensorSum<const N: usize> {
    /// Sum of the full rule.
    pub integral: Moments<N>,
    /// The rules' differences with their signs, over all axes.
    pub difference: Moments<N>,
    /// What every axis contributes to the errors; zero for axes that were not summed over.
    pub by_axis: [Errors; N],
}

/// Digits of an index to a base: which node on every axis.
pub(crate) fn digits<const N: usize>(index: usize, base: usize) -> [usize; N] {
    let mut rest = index;
    std::array::from_fn(|_| {
        let digit = rest % base;
        rest /= base;
        digit
    })
}

impl<const N: usize> TensorSum<N> {
    /// What all axes contribute.
    pub fn errors(&self) -> Errors {
        let mut errors = Errors::default();
        self.by_axis.iter().for_each(|own| errors.add(1.0, own));
        errors
    }
}

/// Integral over some axes of a box from values on the grid. An axis's error is the integral over the other axes
/// of the size of its rules' difference, so that errors of neighbouring lines do not cancel.
pub(crate) fn tensor_sum<const N: usize>(
    grid: &Rule,
    values: &[Moments<N>],
    (low, high): ([f64; N], [f64; N]),
    axes: &[usize],
) -> TensorSum<N> {
    let base = grid.len();
    let volume: f64 = axes.iter().map(|&i| high[i] - low[i]).product();
    let weight = |index: usize, skip: usize| -> f64 {
        let at = digits::<N>(index, base);
        volume * (0..axes.len()).filter(|&d| d != skip).map(|d| grid.fine[at[d]]).product::<f64>()
    };
    let mut integral = Moments::zero(values[0].origin);
    for (index, value) in values.iter().enumerate() {
        integral.add_scaled(weight(index, usize::MAX), value);
    }
    let (mut difference, mut by_axis) = (Moments::zero(integral.origin), [Errors::default(); N]);
    for (d, &axis) in axes.iter().enumerate() {
        let stride = base.pow(d as u32);
        for start in (0..values.len()).filter(|index| (index / stride).is_multiple_of(base)) {
            let mut own = Moments::zero(integral.origin);
            for j in 0..base {
                own.add_scaled(grid.difference[j], &values[start + j * stride]);
            }
            difference.add_scaled(weight(start, d), &own);
            by_axis[axis].add(weight(start, d), &Errors::of(&own, SAFETY));
        }
    }
    TensorSum { integral, difference, by_axis }
}
