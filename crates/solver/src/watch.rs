//! Watching a long solve from outside: progress now and then, and a way to stop it without losing what is done.

/// How far a solve has come.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Progress {
    /// What the solver is doing: "sweeps", "interior point", "newton", "proximal newton".
    pub stage: &'static str,
    /// Iterations of this stage so far.
    pub iterations: usize,
    /// Residual of the best iterate so far, in the solver's own measure.
    pub residual: f64,
}

/// Called now and then by solvers that can run long; `false` asks to stop and return the best iterate so far.
pub type Watch<'a> = dyn FnMut(&Progress) -> bool + 'a;

/// Never stops anything.
pub fn unwatched(_: &Progress) -> bool {
    true
}
