//! The playground's half of the engine: scene files read in Rust ([`scene`]), a world that a page drives ([`run`]), what it
//! shows of it ([`frame`]), requests as JSON ([`page`]), and the functions that WebAssembly exports ([`door`]).
//!
//! The page is `player/src/playground`. What it computes is bit for bit what a native build computes, for the schemes and
//! solvers that `docs/guide/playground.md` names; `fingerprint` is how a test tells.

pub mod door;
pub mod fingerprint;
pub mod frame;
pub mod hand;
pub mod page;
pub mod run;
pub mod scene;
