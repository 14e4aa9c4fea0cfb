//! Sums over tensor grids of rules' nodes, with the error that every axis contributes.
//! Knows no density.

use crate::mass_moments::Moments;
use crate::quadrature_error::Errors;
use crate::quadrature_rule::{Rule, SAFETY};

/// A rule for every axis of the cube.
pub(crate) struct Grid<const N: usize> {
    rules: [Rule; N],
}

impl<const N: usize> Grid<N> {
    /// Rules with `through` intervals on axis 0 and `aside` on the others.
    pub fn new(through: usize, aside: usize) -> Self {
        Grid { rules: std::array::from_fn(|i| Rule::clenshaw_curtis(if i == 0 { through } else { aside })) }
    }
    /// The rule of an axis.
    pub fn rule(&self, axis: usize) -> &Rule {
        &self.rules[axis]
    }
    /// Number of nodes of the grid over some axes.
    pub fn count(&self, axes: &[usize]) -> usize {
        axes.iter().map(|&i| self.rules[i].len()).product()
    }
    /// Which node of every axis a place in the list of nodes has; the first axis runs fastest, axes that are
    /// not listed stay at 0.
    pub fn digits(&self, axes: &[usize], index: usize) -> [usize; N] {
        let (mut rest, mut at) = (index, [0; N]);
        for &axis in axes {
            at[axis] = rest % self.rules[axis].len();
            rest /= self.rules[axis].len();
        }
        at
    }
    /// Product of the weights of a node over some axes, leaving one out.
    fn weight(&self, axes: &[usize], at: &[usize; N], skip: Option<usize>) -> f64 {
        axes.iter().filter(|&&i| Some(i) != skip).map(|&i| self.rules[i].fine[at[i]]).product()
    }
    /// Weight of a node of the grid over some axes.
    pub fn weight_of(&self, axes: &[usize], index: usize) -> f64 {
        self.weight(axes, &self.digits(axes, index), None)
    }
}

/// An integral over some axes of a box.
pub(crate) struct TensorSum<const N: usize> {
    /// Sum of the full rule.
    pub integral: Moments<N>,
    /// The rules' differences with their signs, over all axes.
    pub difference: Moments<N>,
    /// What every axis contributes to the errors; zero for axes that were not summed over.
    pub by_axis: [Errors; N],
}

impl<const N: usize> TensorSum<N> {
    /// The integral over some axes, which together have the measure `volume`, from values on the grid. An axis's
    /// error is the integral over the other axes of the size of its rules' difference, so that errors of
    /// neighbouring lines do not cancel.
    pub fn new(grid: &Grid<N>, values: &[Moments<N>], volume: f64, axes: &[usize]) -> Self {
        let mut integral = Moments::zero(values[0].origin);
        for (index, value) in values.iter().enumerate() {
            integral.add_scaled(volume * grid.weight_of(axes, index), value);
        }
        let (mut difference, mut by_axis) = (Moments::zero(integral.origin), [Errors::default(); N]);
        let mut stride = 1;
        for &axis in axes {
            let rule = grid.rule(axis);
            for start in (0..values.len()).filter(|index| (index / stride).is_multiple_of(rule.len())) {
                let mut own = Moments::zero(integral.origin);
                for (j, k) in rule.difference.iter().enumerate() {
                    own.add_scaled(*k, &values[start + j * stride]);
                }
                let weight = volume * grid.weight(axes, &grid.digits(axes, start), Some(axis));
                difference.add_scaled(weight, &own);
                by_axis[axis].add(weight, &Errors::of(&own, SAFETY));
            }
            stride *= rule.len();
        }
        TensorSum { integral, difference, by_axis }
    }
    /// What all axes contribute.
    pub fn errors(&self) -> Errors {
        let mut errors = Errors::default();
        self.by_axis.iter().for_each(|own| errors.add(1.0, own));
        errors
    }
}
