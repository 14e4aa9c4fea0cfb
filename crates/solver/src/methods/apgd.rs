//! Accelerated projected gradient descent (Nesterov 1983; Mazhar, Heyn, Negrut and Tasora 2015; theory eq. 5.36):
//! x+ = P(y - t D u(y)), y = x+ + beta (x+ - x), with the step t found by trial against the curvature and the
//! momentum forgotten when it leads uphill (O'Donoghue and Candes 2015). u contains De Saxce's shift
//! mu |u_T| of the present point, so the fixed point is Coulomb's law and not its convex relaxation. Every
//! contact is worked on alone, whatever the order: only products with A.

use crate::methods::first_order::{Budget, End, FirstOrder, Judge, Memory, Method, Point};
use crate::watch::Watch;

/// Gradient steps between two looks at the residual and at the watch, once steps are many.
const LOOK: usize = 4;
/// How much longer than the last step the next one is tried.
const LONGER: f64 = 1.05;
/// The shortest step, as a share of 1 / diag(A): below it rounding decides.
const SHORTEST: f64 = 1e-9;

/// The accelerated projected gradient.
#[derive(Clone, Copy, Debug, Default)]
pub struct Apgd;

impl Method for Apgd {
    const NAME: &'static str = "apgd";
    const STAGE: &'static str = "projected gradients";

    fn run<F: FirstOrder>(
        form: &F,
        budget: &Budget,
        at: &mut F::Point,
        memory: &mut Memory<F::Point>,
        watch: &mut Watch,
    ) -> End {
        let Memory { best, before, ahead } = memory;
        let mut judge = Judge::new(form, Self::STAGE, at, best, watch);
        let mut end = End { iterations: 0, interrupted: false };
        let (mut theta, mut step) = (1.0_f64, 1.0);
        ahead.copy_from(at);
        before.copy_from(at);
        while end.iterations < budget.iterations && judge.residual > budget.tolerance {
            std::mem::swap(at, before);
            form.descend(ahead, step, at);
            end.iterations += 1;
            let length = form.product([at, ahead], [at, ahead]);
            if !length.is_finite() {
                return end;
            }
            let curvature = form.curvature(at, ahead);
            if step * curvature > length && step > SHORTEST {
                // too long: the same step again from the same point, shorter
                step = (0.9 * length / curvature).max(0.5 * step);
                std::mem::swap(at, before);
                continue;
            }
            let k = end.iterations;
            if k.is_multiple_of(LOOK) || k < LOOK || k == budget.iterations {
                judge.measure(at);
                if !judge.tell(k) {
                    end.interrupted = true;
                    break;
                }
            }
            let uphill = form.product([ahead, at], [at, before]) > 0.0;
            let next = 0.5 * ((theta.powi(4) + 4.0 * theta * theta).sqrt() - theta * theta);
            let beta = if uphill { 0.0 } else { theta * (1.0 - theta) / (theta * theta + next) };
            theta = if uphill { 1.0 } else { next };
            ahead.blend(0.0, (1.0 + beta, at), (-beta, before));
            step *= LONGER;
        }
        judge.finish(at);
        end
    }
}
