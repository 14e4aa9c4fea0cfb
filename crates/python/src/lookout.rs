//! Looking out for Ctrl-C during long solves, and telling their progress, without holding up short ones: the
//! interpreter is asked only when enough time has passed. Knows no solver.

use carom::Progress;
use pyo3::prelude::*;
use std::time::{Duration, Instant};

/// Time between two looks: nobody notices a Ctrl-C that waits so long, and taking the lock costs less than 1e-3 of it.
const PERIOD: Duration = Duration::from_millis(50);

/// What watches a step, or a solve.
pub struct Lookout {
    last: Instant,
    progress: Option<Py<PyAny>>,
    may_stop: bool,
    stopped: bool,
    raised: Option<PyErr>,
}

impl Lookout {
    /// A lookout that tells a Python function (stage, iterations, residual), if there is one.
    pub fn new(progress: Option<Py<PyAny>>) -> Self {
        Lookout { last: Instant::now(), progress, may_stop: false, stopped: false, raised: None }
    }
    /// The same, where the function may stop the solve by returning False.
    pub fn stoppable(progress: Option<Py<PyAny>>) -> Self {
        Lookout { may_stop: true, ..Lookout::new(progress) }
    }
    /// False when a signal's handler or the function raised or asked for it: the solve is to stop.
    pub fn look(&mut self, progress: &Progress) -> bool {
        if self.stopped || self.last.elapsed() < PERIOD {
            return !self.stopped;
        }
        let told = Python::attach(|py| {
            py.check_signals()?;
            if let Some(function) = &self.progress {
                let answer = function.call1(py, (progress.stage, progress.iterations, progress.residual))?;
                return Ok(self.may_stop && answer.extract::<bool>(py).is_ok_and(|goes_on| !goes_on));
            }
            Ok(false)
        });
        self.last = Instant::now();
        match told {
            Ok(stopped) => self.stopped = stopped,
            Err(raised) => (self.stopped, self.raised) = (true, Some(raised)),
        }
        !self.stopped
    }
    /// Whether the solve was asked to stop.
    pub fn stopped(&self) -> bool {
        self.stopped
    }
    /// What was raised.
    pub fn take(&mut self) -> Option<PyErr> {
        self.raised.take()
    }
}
