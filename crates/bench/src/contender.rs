//! What the bench asks of an engine: to take steps, and where its bodies are.

use carom::{Pose, Space};

/// What a step tells of itself.
#[derive(Clone, Copy, Debug, Default)]
pub struct Told {
    /// Residual of the step \[m/s\]; `None` from engines that report none.
    pub residual: Option<f64>,
}

/// A world of some engine.
pub trait Contender<S: Space> {
    /// Takes one step; nothing else is timed.
    ///
    /// # Errors
    /// Why the engine did not take it.
    fn step(&mut self) -> Result<Told, String>;
    /// Poses of the shapes' frames of all bodies, in the scene's order.
    fn poses(&self) -> Vec<Pose<S>>;
    /// Speed of the fastest body that can move \[m/s\].
    fn top_speed(&self) -> f64;
    /// Contact points of the last step.
    fn contacts(&self) -> usize;
}
