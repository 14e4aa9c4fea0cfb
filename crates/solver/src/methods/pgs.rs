//! Projected Gauss-Seidel without a matrix (theory chapter 5, items 25, 35-39): for each row in turn
//! gamma <- P(gamma - m (J u - target)), with u kept up to date on the bodies; P clamps the normal impulse
//! at zero and projects friction on its disc or box. The scalar friction step m_t = 1/lambda_max(W_tt)
//! followed by the radial projection has Coulomb's law as its fixed point. Cost per sweep: O(contacts).

use crate::cone::{project, project_tangent};
use crate::impulse_solver::{ImpulseSolver, SolveSettings};
use crate::outcome::Outcome;
use crate::prepared::{Prepared, PreparedContact, Row};
use crate::problem::{BoundedRow, ContactProblem, FrictionLaw, Impulse, Impulses, Twist};
use crate::residual::residual_of;
use carom_math::{Column, Space};

/// The matrix-free sweep; holds memory between solves, nothing else.
#[derive(Clone, Debug, Default)]
pub struct Pgs<S: Space> {
    prepared: Prepared<S>,
    velocities: Vec<Twist<S>>,
}

impl<S: Space> ImpulseSolver<S> for Pgs<S> {
    fn name(&self) -> &'static str {
        "pgs"
    }
    fn solve(&mut self, problem: &ContactProblem<S>, settings: &SolveSettings, impulses: &mut Impulses<S>) -> Outcome {
        if problem.scalar_rows() == 0 {
            return Outcome::nothing_to_do();
        }
        self.prepared.update(problem);
        project(problem, impulses);
        self.velocities.clear();
        self.velocities.extend_from_slice(&problem.velocities);
        self.prepared.apply(impulses, &mut self.velocities);
        let mut sweeps = 0;
        while sweeps < settings.iterations {
            let change = self.sweep(problem, impulses);
            sweeps += 1;
            // the change of a sweep bounds the residual at the rows' turns: a cheap hint to measure it
            if change <= settings.tolerance {
                let residual = residual_of(problem, &self.prepared, impulses);
                if residual.absolute <= settings.tolerance {
                    return Outcome::judged(sweeps, residual, settings.tolerance);
                }
            }
        }
        Outcome::judged(sweeps, residual_of(problem, &self.prepared, impulses), settings.tolerance)
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
        change
    }
}

/// One Gauss-Seidel update of a bounded row.
fn relax_row<S: Space>(given: &BoundedRow<S>, row: &Row<S>, impulse: &mut f64, v: &mut [Twist<S>]) -> f64 {
    let step = (row.velocity(v) - given.target) / row.inverse_effective_mass;
    let next = (*impulse - step).clamp(given.lo, given.hi);
    let delta = next - *impulse;
    row.apply(delta, v);
    *impulse = next;
    (delta * row.inverse_effective_mass).abs()
}

/// One Gauss-Seidel update of a contact: normal, then friction at the new limit.
pub fn relax_contact<S: Space>(
    c: &PreparedContact<S>,
    impulse: &mut Impulse<S>,
    law: FrictionLaw,
    v: &mut [Twist<S>],
) -> f64 {
    let normal = (impulse.normal - c.normal_mass * (c.normal.velocity(v) - c.target)).max(0.0);
    let delta = normal - impulse.normal;
    impulse.normal = normal;
    if delta != 0.0 {
        c.normal.apply(delta, v);
    }
    let mut change = delta.abs() / c.normal_mass;
    if c.friction > 0.0 {
        let trial = impulse.tangent - c.slip(v) * c.tangent_mass;
        let tangent = project_tangent::<S>(trial, c.friction * normal, law);
        let delta = tangent - impulse.tangent;
        c.apply_tangent(delta, v);
        impulse.tangent = tangent;
        change = change.max(delta.norm() / c.tangent_mass);
    }
    change
}
