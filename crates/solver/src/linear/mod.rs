//! Sparse LU of matrices made of small dense blocks on a symmetric pattern: ordering, symbolic analysis, fronts.
//! Contact matrices are diagonal heavy blocks on a sparse graph; at this price per factorisation a Newton method
//! beats every first-order one (docs/adr/0009). Knows no contacts.

// rows and columns are read by their index as in the equations
#![allow(clippy::needless_range_loop)]

mod analysis;
mod chunk;
mod dissection;
mod envelope;
mod factor;
mod front;
mod graph;
mod kernel;
mod layout;
mod ordering;

pub use analysis::Analysis;
pub use envelope::Envelope;
pub use factor::Factor;
pub use graph::Graph;
