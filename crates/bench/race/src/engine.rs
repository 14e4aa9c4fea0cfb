//! What the race asks of an engine: to take steps, what they took, and where its bodies are.

use carom::{Pose, Space};
use rustix::time::{ClockId, clock_gettime};
use std::time::Instant;

/// Time spent, by two clocks.
#[derive(Clone, Copy, Debug, Default)]
pub struct Spent {
    /// On the wall \[s\].
    pub wall: f64,
    /// Of all threads of the process \[s\].
    pub cpu: f64,
}

impl Spent {
    /// The smaller of both \[s\]: the wall's with several threads, the processor's where others keep it busy.
    pub fn least(&self) -> f64 {
        self.wall.min(self.cpu)
    }
    /// Adds what another piece of work took.
    pub fn add(&mut self, other: Spent) {
        self.wall += other.wall;
        self.cpu += other.cpu;
    }
}

/// Processor time of this process so far \[s\].
fn processor() -> f64 {
    let t = clock_gettime(ClockId::ProcessCPUTime);
    t.tv_sec as f64 + 1e-9 * t.tv_nsec as f64
}

/// Does some work and says what it took.
pub fn timed<T>(work: impl FnOnce() -> T) -> (T, Spent) {
    let (wall, cpu) = (Instant::now(), processor());
    let done = work();
    let cpu = processor() - cpu;
    (done, Spent { wall: wall.elapsed().as_secs_f64(), cpu })
}

/// Where the time of a step went, as the engine itself tells \[ms\].
#[derive(Clone, Copy, Debug, Default)]
pub struct Phases {
    /// Finding pairs: the broad phase.
    pub pairs: f64,
    /// Contact points: the narrow phase.
    pub collide: f64,
    /// Islands, constraints and the solver, integration with it.
    pub solve: f64,
    /// What the engine's own clock counts beside these.
    pub rest: f64,
}

impl Phases {
    /// From an engine's clock of the whole step \[ms\] and of three of its parts.
    pub fn of(step: f64, pairs: f64, collide: f64, solve: f64) -> Self {
        Phases { pairs, collide, solve, rest: (step - pairs - collide - solve).max(0.0) }
    }
    /// Each times a factor.
    pub fn scaled(self, factor: f64) -> Self {
        let Phases { pairs, collide, solve, rest } = self;
        Phases {
            pairs: factor * pairs,
            collide: factor * collide,
            solve: factor * solve,
            rest: factor * rest,
        }
    }
    /// Adds those of another step.
    pub fn add(&mut self, other: Phases) {
        self.pairs += other.pairs;
        self.collide += other.collide;
        self.solve += other.solve;
        self.rest += other.rest;
    }
}

/// How an engine runs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Choice {
    /// Threads of the engine.
    pub threads: usize,
    /// Whether bodies may fall asleep, with the engine's own thresholds.
    pub sleeping: bool,
}

/// A world of some engine.
pub trait Engine<S: Space> {
    /// Takes one step and says what it took; nothing else is in that time.
    ///
    /// # Errors
    /// Why the engine did not take it.
    fn step(&mut self) -> Result<Spent, String>;
    /// Poses of the shapes' frames of all bodies, in the scene's order.
    ///
    /// # Errors
    /// Why the engine did not tell, where it runs in a process of its own.
    fn poses(&mut self) -> Result<Vec<Pose<S>>, String>;
    /// Contact points of the last step, where the engine tells.
    fn contacts(&mut self) -> Option<usize>;
    /// Where the last step's time went, where the engine tells.
    fn phases(&self) -> Option<Phases> {
        None
    }
}
