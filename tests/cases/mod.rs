//! Cases with known answers, C1 to C33, by the scheme `events`, at the tolerances of the project's checklist. What is long is
//! ignored here and run by `make laws`; each long law has a twin that is not. `docs/cases.md` lists them all.

mod curved;
mod free;
mod friction;
mod impacts;
mod long;
mod statics;
mod superball;
mod systems;

use crate::harness::Dimension;
use carom::{Column, Scheme, Settings};

/// Settings of the scheme with its own solver and law.
fn events<S: Dimension>(dt: f64) -> Settings<S> {
    Settings { dt, scheme: Scheme::Events, tolerance: 1e-8, ..Settings::default() }
}

/// The same without gravity.
fn without_weight<S: Dimension>(dt: f64) -> Settings<S> {
    Settings { gravity: S::Vector::ZERO, ..events(dt) }
}
