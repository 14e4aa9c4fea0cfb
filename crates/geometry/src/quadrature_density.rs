//! Asks a density function for many points at once, counts, and refuses answers that are no density.
//! Knows no rule and no cells.

use crate::geometry::ShapeError;
use carom_math::{Column, Tuple};

/// Evaluations of the density after which the integration stops \[1\].
pub const EVALUATION_BUDGET: usize = 10_000_000;

/// The budget grows to this for every cell of a shape of very many cells, such as a fine mesh \[1\].
pub const EVALUATIONS_PER_CELL: usize = 2000;

/// Points handed to the density at once.
pub(crate) const CHUNK: usize = 1 << 16;

/// What is integrated.
pub struct Integrand<'a, const N: usize> {
    /// Density at many points in shape axes: one number for each.
    pub density: &'a mut dyn FnMut(&[Tuple<N>]) -> Vec<f64>,
    /// Point about which moments are taken, near the centre \[m\].
    pub origin: Tuple<N>,
    /// Where given: false at points that cells reach outside the shape, where negative values may stand.
    pub is_inside: Option<&'a dyn Fn(Tuple<N>) -> bool>,
}

/// Evaluates and checks the density.
pub(crate) struct Sampler<'a, const N: usize> {
    pub integrand: Integrand<'a, N>,
    /// How often the density was asked.
    pub evaluations: usize,
    /// How often it may be asked.
    pub budget: usize,
}

impl<const N: usize> Sampler<'_, N> {
    /// Point about which moments are taken.
    pub fn origin(&self) -> Tuple<N> {
        self.integrand.origin
    }
    /// True when the budget of evaluations has been used.
    pub fn is_spent(&self) -> bool {
        self.evaluations >= self.budget
    }
    /// Densities at points.
    pub fn sample(&mut self, points: &[Tuple<N>]) -> Result<Vec<f64>, ShapeError> {
        let mut densities = Vec::with_capacity(points.len());
        for chunk in points.chunks(CHUNK) {
            let answer = (self.integrand.density)(chunk);
            if answer.len() != chunk.len() {
                return Err(ShapeError::new(
                    "density",
                    format!("the function returned {} numbers for {} points", answer.len(), chunk.len()),
                    "return one density for every point",
                ));
            }
            for (point, &density) in chunk.iter().zip(&answer) {
                if !(density >= 0.0 && density.is_finite()) {
                    self.refuse_unless_outside(*point, density)?;
                }
            }
            densities.extend(answer);
        }
        self.evaluations += points.len();
        Ok(densities)
    }
    fn refuse_unless_outside(&self, point: Tuple<N>, density: f64) -> Result<(), ShapeError> {
        let place = point.as_slice();
        if self.integrand.is_inside.is_none_or(|inside| inside(point)) {
            return Err(ShapeError::new(
                "density",
                format!("the function is {density} at {place:?} (shape axes, m)"),
                "return finite values >= 0 everywhere in the shape",
            ));
        }
        if density.is_finite() {
            return Ok(());
        }
        Err(ShapeError::new(
            "density",
            format!("the function is {density} at {place:?} (shape axes, m), outside the mesh"),
            "return finite values there too, or split the mesh into star-shaped parts of a compound",
        ))
    }
}
