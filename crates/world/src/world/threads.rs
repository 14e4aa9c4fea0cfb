//! Threads that share a step's work. They change its time and no bit of it: work is cut and joined in an order that does
//! not depend on their number, so it is no setting, and neither a snapshot nor a trajectory knows it.

use super::World;
use crate::error::BuildError;
use carom_geometry::Geometry;
use carom_math::Workers;

impl<S: Geometry> World<S> {
    /// How many threads share a step's work \[1\].
    pub fn threads(&self) -> usize {
        self.narrow_phase.workers.count()
    }

    /// Shares the work of the coming steps among so many threads, the caller's among them; 1 unless said. The answer is
    /// the same, bit for bit, whatever their number. They sleep between steps, and small worlds do not wake them.
    ///
    /// # Errors
    /// [`BuildError`] for no threads, for more than [`Workers::MOST`], and for more than the system has; those that there
    /// were stay then.
    pub fn set_threads(&mut self, threads: usize) -> Result<(), BuildError> {
        if threads == self.threads() {
            return Ok(());
        }
        let refused = |problem: String, remedy: &str| BuildError::setting("threads", problem, remedy);
        if !(1..=Workers::MOST).contains(&threads) {
            let problem = format!("must be 1 to {}, got {threads}", Workers::MOST);
            return Err(refused(problem, "take as many as the machine has cores, or fewer"));
        }
        let made = Workers::new(threads);
        let told = |e| refused(format!("of {threads} cannot be had: {e}"), "take fewer");
        self.narrow_phase.workers = made.map_err(told)?;
        Ok(())
    }

    /// Takes over another world's threads.
    pub fn share_threads(&mut self, other: &World<S>) {
        self.narrow_phase.workers = other.narrow_phase.workers.clone();
    }
}
