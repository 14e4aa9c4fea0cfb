//! Projected Gauss-Seidel without a matrix (theory eqs. 4.12, 4.13, 5.15 and 5.22; items 25, 35-39): for each
//! row in turn gamma <- P(gamma - m (J u - target)), with u kept up to date on the bodies; P clamps the normal
//! impulse at zero and projects friction on its disc or box. The scalar friction step
//! m_t = 1/lambda_max(W_tt) followed by the radial projection has Coulomb's law as its fixed point (5.23).
//! Cost per sweep: O(contacts). The exact disc step (5.25) was tried instead: on brick walls it needs as many
//! sweeps, each dearer. Knows no matrix.

use crate::cone::project_tangent;
use crate::methods::first_order::{Budget, End, FirstOrder, Memory, Method};
use crate::methods::on_bodies::OnBodies;
use crate::prepared::{PreparedContact, Row};
use crate::problem::{BoundedRow, FrictionLaw, Impulse, Twist};
use crate::watch::{Progress, Watch};
use carom_math::{Column, Space};

/// The sweep on bodies.
pub type Pgs<S> = OnBodies<S, Sweeps>;

/// Sweeps between two calls of the watch.
const LOOK: usize = 64;

/// Sweeps until nothing changes.
#[derive(Clone, Copy, Debug, Default)]
pub struct Sweeps;

impl Method for Sweeps {
    const NAME: &'static str = "pgs";
    const STAGE: &'static str = "sweeps";

    fn run<F: FirstOrder>(
        form: &F,
        budget: &Budget,
        at: &mut F::Point,
        _memory: &mut Memory<F::Point>,
        watch: &mut Watch,
    ) -> End {
        let mut end = End { iterations: 0, interrupted: false };
        while end.iterations < budget.iterations && !end.interrupted {
            let change = form.sweep(at);
            end.iterations += 1;
            // the change is known for nothing, the residual costs half a sweep: measure it only once sweeps do little
            if change <= budget.small_change {
                if !F::SWEEPS_KEEP_VELOCITIES {
                    form.refresh(at);
                }
                if form.residual(at) <= budget.tolerance {
                    break;
                }
            }
            if !change.is_finite() {
                break;
            }
            if end.iterations.is_multiple_of(LOOK) {
                let told = Progress { stage: Self::STAGE, iterations: end.iterations, residual: change };
                end.interrupted = !watch(&told);
            }
        }
        end
    }
}

/// One Gauss-Seidel update of a bounded row; returns the square of its change as a velocity.
pub fn relax_row<S: Space>(
    given: &BoundedRow<S>,
    row: &Row<S>,
    impulse: &mut f64,
    v: &mut [Twist<S>],
) -> f64 {
    let step = (row.velocity(v) - given.target) / row.inverse_effective_mass;
    let next = (*impulse - step).max(given.lo).min(given.hi);
    let delta = next - *impulse;
    row.apply(delta, v);
    *impulse = next;
    let moved = delta * row.inverse_effective_mass;
    moved * moved
}

/// One Gauss-Seidel update of a contact: normal, then friction at the new limit; returns the square of the larger
/// change as a velocity.
pub fn relax_contact<S: Space>(
    c: &PreparedContact<S>,
    impulse: &mut Impulse<S>,
    law: FrictionLaw,
    v: &mut [Twist<S>],
) -> f64 {
    relax_above(c, impulse, 0.0, law, v)
}

/// The same for a normal impulse that is at least `least` \[N s\].
#[inline(always)]
pub fn relax_above<S: Space>(
    c: &PreparedContact<S>,
    impulse: &mut Impulse<S>,
    least: f64,
    law: FrictionLaw,
    v: &mut [Twist<S>],
) -> f64 {
    let (mut a, mut b) = c.pair(v);
    let (speed, slip) = (c.normal.velocity_between(&a, &b), c.slip_between(&a, &b));
    let normal = (impulse.normal - c.normal_mass * (speed - c.target)).max(least);
    let mut delta = Impulse::<S> { normal: normal - impulse.normal, tangent: S::Slip::ZERO };
    impulse.normal = normal;
    let moved = delta.normal * c.normal.inverse_effective_mass;
    let mut change = moved * moved;
    if c.friction > 0.0 {
        // W_tn delta is what the normal step does to the slip: known at once, where the slip would have to be
        // formed again from velocities that wait for the normal step
        let slip = slip + c.normal_coupling * delta.normal;
        let trial = impulse.tangent - slip * c.tangent_mass;
        let tangent = project_tangent::<S>(trial, c.friction * normal, law);
        delta.tangent = tangent - impulse.tangent;
        impulse.tangent = tangent;
        change = change.max(delta.tangent.norm_squared() * c.inverse_tangent_mass * c.inverse_tangent_mass);
        c.push_all(&delta, &mut a, &mut b);
    } else {
        c.push_normal(delta.normal, &mut a, &mut b);
    }
    c.store((a, b), v);
    change
}
