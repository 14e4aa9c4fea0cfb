//! Gradients of steps and rollouts of the scheme `events` (theory chapter 10): the derivatives of any function of the
//! states by initial states, masses, friction, restitution, loads and gravity. Each flow and each impact of a step is
//! differentiated by the implicit function theorem on the contacts that were found to act, each moment by the equation
//! that makes it; the way back goes through all of them (reverse mode) from snapshots. Where the set of contacts is on
//! an edge the steps are flagged. Differentiates what the steps did; knows no step of its own.

mod backward;
mod coefficients;
mod dual;
mod flag;
mod flowing;
mod holding;
mod kick;
mod least;
mod lift;
mod meeting;
mod rollout;
mod sums;
mod touching;
mod turning;

pub use coefficients::PairGradient;
pub use flag::{Flag, Reason};
pub use rollout::{Gradient, GradientError, Plan, Rollout, StateCotangent};
