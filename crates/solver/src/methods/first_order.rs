//! What first-order methods (sweeps, conjugate gradients, projected gradients) need of a problem, so that each is
//! written once for bodies and for matrices: a Gauss-Seidel sweep, a projected gradient step, a scalar product in
//! which every impulse counts as the energy it makes alone, and a residual. Knows no bodies and no matrix.

use crate::watch::{Progress, Watch};

/// Impulses and the velocities that follow from them; both are affine, so combinations need no product with A.
pub trait Point: Clone + Default + Send {
    /// Makes this equal to another without giving memory back.
    fn copy_from(&mut self, other: &Self);
    /// self <- own self + f x + g y, entry by entry, velocities included.
    fn blend(&mut self, own: f64, x: (f64, &Self), y: (f64, &Self));
}

/// A contact problem in a form that first-order methods work on.
pub trait FirstOrder {
    /// Impulses and what follows them.
    type Point: Point;
    /// One Gauss-Seidel sweep with the projections of the law; returns the largest change of an impulse as a velocity
    /// \[m/s\].
    fn sweep(&self, at: &mut Self::Point) -> f64;
    /// to <- P(from - step D u(from)): a gradient step of every impulse at once, D = 1/diag(A), projected on
    /// the law. The velocities of `from` must be fresh; those of `to` are.
    fn descend(&self, from: &Self::Point, step: f64, to: &mut Self::Point);
    /// Forms the velocities from the impulses anew.
    fn refresh(&self, at: &mut Self::Point);
    /// (x - y) . D^-1 (z - w) over the impulses \[J\].
    fn product(&self, difference: [&Self::Point; 2], other: [&Self::Point; 2]) -> f64;
    /// (x - y) . A (x - y), from velocities that are fresh \[J\].
    fn curvature(&self, x: &Self::Point, y: &Self::Point) -> f64;
    /// The measure that the budget's tolerance bounds, from velocities that are fresh; NaN counts as infinite.
    fn residual(&self, at: &Self::Point) -> f64;
    /// True when sweeps leave velocities that are fresh.
    const SWEEPS_KEEP_VELOCITIES: bool;
}

/// How much to spend.
#[derive(Clone, Copy, Debug)]
pub struct Budget {
    /// Most sweeps or gradient steps \[1\].
    pub iterations: usize,
    /// Residual to stop at \[units of `FirstOrder::residual`\].
    pub tolerance: f64,
    /// A sweep that changes no velocity by more than this is worth measuring the residual \[m/s\].
    pub small_change: f64,
}

/// How a method ended.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct End {
    /// Sweeps or gradient steps spent.
    pub iterations: usize,
    /// True when whoever watched asked to stop.
    pub interrupted: bool,
}

/// Points that a method works with; kept between solves for their memory alone.
#[derive(Clone, Debug, Default)]
pub struct Memory<P> {
    /// The best point measured so far.
    pub best: P,
    /// The point before the present one.
    pub before: P,
    /// Search direction, or the extrapolated point.
    pub ahead: P,
}

/// A method over any form of a problem.
pub trait Method: Default + Send {
    /// Its name as users write it.
    const NAME: &'static str;
    /// What it calls its iterations when it tells its progress.
    const STAGE: &'static str;
    /// Improves `at`, whose velocities are fresh and whose impulses the law allows, and leaves the answer there; its
    /// impulses are not finite when they outgrew all numbers.
    fn run<F: FirstOrder>(
        form: &F,
        budget: &Budget,
        at: &mut F::Point,
        memory: &mut Memory<F::Point>,
        watch: &mut Watch,
    ) -> End;
}

/// Keeps the best of the points that are measured, and asks the watch.
pub struct Judge<'a, 'w, F: FirstOrder> {
    form: &'a F,
    stage: &'static str,
    best: &'a mut F::Point,
    watch: &'a mut Watch<'w>,
    /// Residual of the best point.
    pub residual: f64,
}

impl<'a, 'w, F: FirstOrder> Judge<'a, 'w, F> {
    /// Measures the start, which is the best so far.
    pub fn new(
        form: &'a F,
        stage: &'static str,
        start: &F::Point,
        best: &'a mut F::Point,
        watch: &'a mut Watch<'w>,
    ) -> Self {
        best.copy_from(start);
        let residual = form.residual(start);
        Judge { form, stage, best, watch, residual }
    }
    /// Measures a point with fresh velocities; true when it is the best so far.
    pub fn measure(&mut self, at: &F::Point) -> bool {
        let residual = self.form.residual(at);
        let better = residual < self.residual;
        if better {
            self.residual = residual;
            self.best.copy_from(at);
        }
        better
    }
    /// False when the watch asks to stop.
    pub fn tell(&mut self, iterations: usize) -> bool {
        (self.watch)(&Progress { stage: self.stage, iterations, residual: self.residual })
    }
    /// Leaves the best point in `at`.
    pub fn finish(self, at: &mut F::Point) {
        at.copy_from(self.best);
    }
}
