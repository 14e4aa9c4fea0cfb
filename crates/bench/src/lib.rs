//! What benchmarks beside Rapier share: numbers and shapes of the plane and of space in its words. Knows no scene and no
//! step.

pub mod shapes_planar;
pub mod shapes_spatial;
