//! Projected Gauss-Seidel without a matrix (theory eqs. 4.12, 4.13, 5.15 and 5.22; items 25, 35-39): for each
//! row in turn gamma <- P(gamma - m (J u - target)), with u kept up to date on the bodies; P clamps the normal
//! impulse at zero and projects friction on its disc or box. The scalar friction step
//! m_t = 1/lambda_max(W_tt) followed by the radial projection has Coulomb's law as its fixed point (5.23).
//! Cost per sweep: O(contacts). The exact disc step (5.25) was tried instead: on brick walls it needs as many
//! sweeps, each dearer. Knows no matrix.

use crate::cone::{project, project_tangent};
use crate::impulse_solver::{ImpulseSolver, SolveSettings};
use crate::methods::judged;
use crate::outcome::{Outcome, Stop};
use crate::prepared::{Prepared, PreparedContact, Row};
use crate::problem::{BoundedRow, ContactProblem, FrictionLaw, Impulse, Impulses, Twist};
use crate::residual::{largest, residual_of};
use crate::watch::{Progress, Watch, unwatched};
use carom_math::{Column, Space};

/// Sweeps between two looks at the watch.
const LOOK_UP: usize = 16;

/// The matrix-free sweep; holds memory between solves, nothing else.
#[derive(Clone, Debug, Default)]
pub struct Pgs<S: Space> {
    prepared: Prepared<S>,
    velocities: Vec<Twist<S>>,
    given: Impulses<S>,
}

impl<S: Space> ImpulseSolver<S> for Pgs<S> {
    fn name(&self) -> &'static str {
        "pgs"
    }
    fn solve(
        &mut self,
        problem: &ContactProblem<S>,
        settings: &SolveSettings,
        impulses: &mut Impulses<S>,
    ) -> Outcome {
        self.solve_watched(problem, settings, impulses, &mut unwatched)
    }
    fn solve_watched(
        &mut self,
        problem: &ContactProblem<S>,
        settings: &SolveSettings,
        impulses: &mut Impulses<S>,
        watch: &mut Watch,
    ) -> Outcome {
        impulses.fit(problem);
        if problem.scalar_rows() == 0 {
            return Outcome::nothing_to_do();
        }
        self.given.copy_from(impulses);
        self.prepared.update(problem);
        project(problem, impulses);
        self.velocities.clear();
        self.velocities.extend_from_slice(&problem.velocities);
        self.prepared.apply(impulses, &mut self.velocities);
        let mut sweeps = 0;
        while sweeps < settings.iterations {
            let change = self.sweep(problem, impulses);
            sweeps += 1;
            // the change is known for nothing, the residual costs half a sweep: measure it only once sweeps do little
            if change <= settings.tolerance
                && largest(problem, &self.prepared, impulses, &self.velocities).0 <= settings.tolerance
            {
                break;
            }
            if !change.is_finite() {
                break;
            }
            if sweeps % LOOK_UP == 0 {
                let progress = Progress { stage: "sweeps", iterations: sweeps, residual: change };
                if !watch(&progress) {
                    let left = residual_of(problem, &self.prepared, impulses);
                    return Outcome::new(sweeps, left, Stop::Interrupted);
                }
            }
        }
        judged(problem, &self.prepared, (sweeps, settings.tolerance), &self.given, impulses)
    }
}

impl<S: Space> Pgs<S> {
    /// One sweep over all rows; returns the largest change of a row's impulse, as a velocity \[m/s\].
    fn sweep(&mut self, problem: &ContactProblem<S>, impulses: &mut Impulses<S>) -> f64 {
        let v = &mut self.velocities;
        let mut change: f64 = 0.0;
        for ((given, row), l) in problem.rows.iter().zip(&self.prepared.rows).zip(&mut impulses.rows) {
            change = change.max(relax_row(given, row, l, v));
        }
        for (c, g) in self.prepared.contacts.iter().zip(&mut impulses.contacts) {
            change = change.max(relax_contact(c, g, problem.friction_law, v));
        }
        change.sqrt()
    }
}

/// One Gauss-Seidel update of a bounded row; returns the square of its change as a velocity.
fn relax_row<S: Space>(given: &BoundedRow<S>, row: &Row<S>, impulse: &mut f64, v: &mut [Twist<S>]) -> f64 {
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
    let (mut a, mut b) = c.pair(v);
    let (speed, slip) = (c.normal.velocity_between(&a, &b), c.slip_between(&a, &b));
    let normal = (impulse.normal - c.normal_mass * (speed - c.target)).max(0.0);
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
        c.push(&delta, &mut a, &mut b);
    } else {
        c.push_normal(delta.normal, &mut a, &mut b);
    }
    c.store((a, b), v);
    change
}
