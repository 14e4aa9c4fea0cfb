//! What every solver of frictional contact owes: an answer that is certified or refused, on problems that nobody
//! would write down and on structures with known forces. Solvers enter in `solvers.rs`; every test runs over all.

mod bodies;
mod budget;
mod census;
mod certified;
mod directions;
mod feasibility;
mod judge;
mod minimum_norm;
mod minimum_norm_mixed;
mod mixed;
mod mixed_oracle;
mod oracle;
mod parts;
mod random;
mod scenes;
mod solvers;
mod statics;
mod stressed;
mod symmetry;
mod warm;
