//! The solvers, one per file.

pub mod direct;
pub mod lemke;
pub mod pgs;
pub mod pgs_matrix;
pub mod sequential;
