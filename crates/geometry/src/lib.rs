//! Shapes of the plane and of space, their mass properties, broad phase and contact manifolds.
//! Stands on a geometry library that nothing outside this crate names; knows no bodies and no solver.

pub mod broad_phase;
mod check;
mod clip;
pub mod collider;
mod core_planar;
mod core_spatial;
pub mod decompose;
pub mod geometry;
mod gjk;
pub mod hull;
pub mod kernel;
pub mod mass;
mod mass_cells_planar;
mod mass_cells_spatial;
pub mod mass_moments;
pub mod mass_planar;
pub mod mass_polygon;
pub mod mass_polyhedron;
mod mass_revolution;
mod mass_rounded;
pub mod mass_spatial;
mod mesh;
mod narrow;
mod pair_planar;
mod pair_spatial;
mod planar;
mod polytope;
pub mod quadrature;
mod quadrature_lines;
mod quadrature_rule;
mod query;
mod separate;
pub mod shape;
mod spatial;
mod spread;
mod surface;
pub mod tree;

pub use broad_phase::BroadPhase;
pub use collider::Collider;
pub use decompose::{Decomposition, decompose};
pub use geometry::{Aabb, Closest, ContactPoint, Geometry, RayHit, ShapeError};
pub use mass::MassProperties;
pub use shape::{PlanarPart, PlanarShape, SpatialPart, SpatialShape};
