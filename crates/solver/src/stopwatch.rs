//! How long a solve took, where there is a clock: in a page there is none for WebAssembly, and every time is 0. No
//! result depends on it.

use std::time::Instant;

/// A clock that runs from when it was made.
#[derive(Clone, Copy, Debug)]
pub struct Stopwatch(Option<Instant>);

impl Stopwatch {
    /// Starts.
    pub fn start() -> Self {
        // std's clock panics where there is none
        Stopwatch((!cfg!(target_family = "wasm")).then(Instant::now))
    }
    /// Time since the start \[s\]; 0 without a clock.
    pub fn seconds(&self) -> f64 {
        self.0.map_or(0.0, |begun| begun.elapsed().as_secs_f64())
    }
}
