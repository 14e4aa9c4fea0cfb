//! Contact problems with a known number of bodies and contacts, made without a world: each body is placed, each
//! contact is stated. For benchmarks and tests of solvers; any size, any seed, in the plane and in space.
//! Takes no step and finds no contact by itself.

pub mod assembly;
pub mod flat;
pub mod frames;
pub mod masonry;
pub mod matrix_form;
pub mod stress;
pub mod variation;

pub use flat::{read_flat, write_flat};
pub use frames::{card_house, table};
pub use masonry::{arch, brick_wall, kapla_tower, sphere_lattice, stack};
pub use matrix_form::matrix_form;
pub use stress::stressed;
pub use variation::Variation;
