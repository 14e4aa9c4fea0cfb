//! Soft contacts in lanes: projected Gauss-Seidel over patches of contact in substeps, each point a stiff damped spring
//! (theory chapter 11), or rigid, with as many sweeps as are asked for. A patch is all points that two bodies share with one normal. In a sweep its points see only the
//! local twist, so a patch gathers its bodies once, and its normal impulses and friction are found together. What is
//! frozen in a step (arms, inertias, effective masses) is found once; places enter through what bodies moved since the
//! step began, in f32, and the caller carries the poses in f64. Knows no shapes, no world and no clock.

mod bodies;
mod books;
mod colours;
mod groups;
mod lead;
mod pack;
mod patch;
mod plan;
mod prepare;
mod restitution;
mod shared;
mod solver;
mod sweep;

pub use bodies::SoftBody;
pub use pack::APART;
pub use patch::{EightPatches, FourPatches, Last, Numbers, Patch, PatchResult, Patches, Rare};
pub use solver::{Rigid, SoftChoice, SoftSolver, Told};
