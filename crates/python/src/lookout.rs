//! Looking out for Ctrl-C during long solves, and telling their progress, without holding up short ones: the
//! interpreter is asked only when enough time has passed. Knows no solver.

use carom::Progress;
use pyo3::prelude::*;
use std::time::{Duration, Instant};

/// Time between two looks: nobody notices a Ctrl-C that waits so long, and taking the lock costs less than 1e-3 of it.
const PERIOD: Duration = Duration::from_millis(50);

/// What watches a step.
pub struct Lookout {
    last: Instant,
    progress: Option<Py<PyAny>>,
    raised: Option<PyErr>,
}

impl Lookout {
    /// A lookout that tells a Python function (stage, iterations, residual), if there is one.
    pub fn new(progress: Option<Py<PyAny>>) -> Self {
        Lookout { last: Instant::now(), progress, raised: None }
    }
    /// False when a signal's handler or the function raised: the solve is to stop.
    pub fn look(&mut self, progress: &Progress) -> bool {
        if self.last.elapsed() < PERIOD {
            return true;
        }
        let told = Python::attach(|py| {
            py.check_signals()?;
            if let Some(function) = &self.progress {
                function.call1(py, (progress.stage, progress.iterations, progress.residual))?;
            }
            Ok(())
        });
        self.last = Instant::now();
        self.raised = told.err();
        self.raised.is_none()
    }
    /// What was raised.
    pub fn take(&mut self) -> Option<PyErr> {
        self.raised.take()
    }
}
