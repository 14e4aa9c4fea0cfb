//! Named scenes, shared by the tests, the benchmarks, the examples and the command line of carom. Each scene is a
//! function of its parameters; the catalogue gives the usual ones names. Beside them what all benchmarks share: a judge of
//! overlap, and where results go. Knows bodies and settings, takes no step.

pub mod catalogue;
pub mod chance;
pub mod constrained;
pub mod contact_problems;
pub mod dominoes;
pub mod falling;
pub mod jointed;
pub mod judge;
pub mod pouring;
pub mod results;
pub mod seven;
pub mod simbenchmark;
pub mod sliding;
pub mod spinning;
pub mod stacking;
pub mod stage;
pub mod striking;

pub use catalogue::{SceneInfo, catalogue, planar, spatial};
