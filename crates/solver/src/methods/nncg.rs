//! Nonsmooth nonlinear conjugate gradients over Gauss-Seidel sweeps (Silcowitz, Niebe and Erleben 2010; theory
//! eq. 5.35): what a sweep changes is minus a gradient g; p <- beta p - g and gamma <- gamma + p with Fletcher and
//! Reeves' beta = |g|^2 / |g_before|^2, forgotten when the gradient grows. Lengths count energy (gamma_i^2 A_ii), so that
//! light and heavy bodies weigh alike. A fixed point is a fixed point of the sweep: Coulomb's law itself. Residuals
//! go up and down on the way, so the best point measured is the answer.

use crate::methods::first_order::{Budget, End, FirstOrder, Judge, Memory, Method, Point};
use crate::watch::Watch;

/// The direction is forgotten when the squared gradient grows by more than this. At 1, as published, small growth that
/// is no failure restarts too often: ten cubes took 2,528 sweeps to 1e-8 g h instead of 1,888, when the first point within it was the end.
const RESTART: f64 = 2.0;
/// Plain sweeps at the end of a budget, as a share of it and at most: along its directions errors alternate from contact to contact, and
/// sweeps even them out (ADR 19).
const LAST: (usize, usize) = (4, 32);
/// Smaller budgets have none: each of their iterations leads on, so that more of them are never worse than fewer.
const FEW: usize = 50;
/// Sweeps between two looks at the residual and at the watch, once sweeps are many.
const LOOK: usize = 16;

/// The accelerated sweep. One that settles ends with plain sweeps, and as in `pgs` one that does little has the last word: of few
/// contacts it solves all but exactly what the step before left within the tolerance.
#[derive(Clone, Copy, Debug, Default)]
pub struct Accelerated<const SETTLES: bool>;

/// The method that is chosen.
pub type Nncg = Accelerated<true>;
/// The same as a stage of other methods, which take over where the tolerance is met.
pub type NncgStage = Accelerated<false>;

impl<const SETTLES: bool> Method for Accelerated<SETTLES> {
    const NAME: &'static str = "nncg";
    const STAGE: &'static str = "conjugate gradients";

    fn run<F: FirstOrder>(
        form: &F,
        budget: &Budget,
        at: &mut F::Point,
        memory: &mut Memory<F::Point>,
        watch: &mut Watch,
    ) -> End {
        let Memory { best, before, ahead: direction } = memory;
        let mut judge = Judge::new(form, Self::STAGE, at, best, watch);
        let mut end = End { iterations: 0, interrupted: false };
        let (mut length_before, mut settled) = (0.0, !SETTLES);
        let plain = SETTLES && budget.iterations >= FEW;
        let last = if plain { (budget.iterations / LAST.0).min(LAST.1) } else { 0 };
        direction.copy_from(at);
        while end.iterations < budget.iterations && !(settled && judge.residual <= budget.tolerance) {
            before.copy_from(at);
            let change = form.sweep(at);
            end.iterations += 1;
            if !change.is_finite() {
                return end;
            }
            let k = end.iterations;
            let look = k.is_multiple_of(LOOK) || k.is_power_of_two() || k == budget.iterations;
            let small = change <= budget.small_change;
            settled = small || !SETTLES;
            if look || small {
                if !F::SWEEPS_KEEP_VELOCITIES || look {
                    form.refresh(at);
                }
                judge.measure(at);
                if look && !judge.tell(k) {
                    end.interrupted = true;
                    break;
                }
            }
            if plain && k + last >= budget.iterations {
                continue;
            }
            let length = form.product([at, before], [at, before]);
            let beta = length / length_before;
            length_before = length;
            if beta <= RESTART {
                direction.blend(beta, (1.0, at), (-1.0, before));
                at.blend(0.0, (1.0, before), (1.0, direction));
            } else {
                direction.blend(0.0, (0.0, at), (0.0, before));
            }
        }
        judge.finish(at);
        end
    }
}
