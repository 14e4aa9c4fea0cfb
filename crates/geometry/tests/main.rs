//! Shapes, mass properties, distances and contact points against closed forms and laws.

#[macro_use]
mod common;
mod mass_common;

mod balls;
mod broad_phase;
mod cavities;
mod closed_forms;
mod features;
mod hulls;
mod laws;
mod mass_density;
mod mass_planar;
mod mass_spatial;
mod rays;
mod refusals;
mod surfaces;
