//! carom as a contender.

use crate::contender::{Contender, Told};
use carom::{Column, Geometry, Pose, World};

/// A world of carom with the step length of its scene.
pub struct Ours<S: Geometry> {
    /// The world.
    pub world: World<S>,
}

impl<S: Geometry> Contender<S> for Ours<S> {
    fn step(&mut self) -> Result<Told, String> {
        let dt = self.world.settings().dt;
        let report = self.world.step(dt).map_err(|e| e.to_string())?;
        Ok(Told { residual: Some(report.residual()) })
    }
    fn poses(&self) -> Vec<Pose<S>> {
        let bodies = self.world.bodies();
        (0..bodies.len()).map(|i| bodies.shape_pose(i)).collect()
    }
    fn top_speed(&self) -> f64 {
        self.world.bodies().motion.velocity.iter().map(|v| v.norm()).fold(0.0, f64::max)
    }
    fn contacts(&self) -> usize {
        self.world.touches().len()
    }
}
