//! The time-stepping schemes, one per file. A scheme owns its loop.

pub mod fixed_step;
