//! CPU time of the calling thread: what a solve costs whatever else the machine does.

use rustix::time::{ClockId, clock_gettime};

/// CPU seconds that this thread has used so far.
pub fn thread_seconds() -> f64 {
    let now = clock_gettime(ClockId::ThreadCPUTime);
    now.tv_sec as f64 + 1e-9 * now.tv_nsec as f64
}
