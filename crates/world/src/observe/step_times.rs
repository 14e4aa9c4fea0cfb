//! Where the time of a step went, by the machine's clock. No result depends on it, and nothing keeps it but the world that took
//! the step: neither a snapshot nor a trajectory knows it.

use carom_solver::Stopwatch;

/// Where the time of a step went \[s\]: wall-clock time, with all threads that took part; zeros before the first step and where
/// there is no clock (in a page).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct StepTimes {
    /// Which bodies are near each other: boxes and the broad phase.
    pub pairs: f64,
    /// Their contacts: the narrow phase.
    pub contacts: f64,
    /// The scheme's other work: loads, solves, motion. The scheme `events` looks for pairs and contacts in between, and all of
    /// it is here.
    pub solve: f64,
    /// What comes before and after: checks, the ledger, sleep, the report.
    pub rest: f64,
}

impl StepTimes {
    /// The whole step \[s\].
    pub fn whole(&self) -> f64 {
        self.pairs + self.contacts + self.solve + self.rest
    }

    /// Adds the time of a search for contacts \[s\] and what of it went into pairs, which is taken.
    pub(crate) fn add_search(&mut self, pairing: &mut f64, all: f64) {
        let pairs = std::mem::take(pairing);
        self.pairs += pairs;
        self.contacts += all - pairs;
    }
}

/// A clock that tells how long it is since it was asked last.
pub(crate) struct Laps {
    clock: Stopwatch,
    told: f64,
}

impl Laps {
    /// Starts.
    pub fn start() -> Self {
        Laps { clock: Stopwatch::start(), told: 0.0 }
    }
    /// Time since the start, or since this was asked last \[s\].
    pub fn lap(&mut self) -> f64 {
        let now = self.clock.seconds();
        now - std::mem::replace(&mut self.told, now)
    }
}
