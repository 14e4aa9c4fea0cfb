//! What carom keeps, in one binary: each would compile the generic engine anew, a minute or two of two processors.
//! [`laws`] of every run, [`cases`] with known answers, [`stories`] of what once went wrong, and what the named scenes
//! promise.

#[macro_use]
mod harness;

mod cases;
mod laws;
mod scenes;
mod stories;
