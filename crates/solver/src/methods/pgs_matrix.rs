//! Projected Gauss-Seidel on the assembled A = J M^-1 J^T (theory eqs. 5.15 and 5.18; items 34-37): the same
//! updates in the same order as the matrix-free sweep, with u_i - target_i = (A gamma - b)_i read from the rows
//! of A. It exists to show that both forms are one method (item 45); the matrix-free form is the faster one.

use crate::cone::{project, project_tangent};
use crate::delassus::{Csr, delassus_of, right_hand_side_of};
use crate::impulse_solver::{ImpulseSolver, SolveSettings};
use crate::methods::{judged, resisted};
use crate::outcome::Outcome;
use crate::prepared::Prepared;
use crate::problem::{ContactProblem, Impulses};
use crate::residual::residual_of;
use crate::watch::Watch;
use carom_math::{Column, Space};

/// The sweep on the matrix.
#[derive(Clone, Debug, Default)]
pub struct PgsMatrix;

impl<S: Space> ImpulseSolver<S> for PgsMatrix {
    fn name(&self) -> &'static str {
        "pgs_matrix"
    }
    fn refusal(&self, problem: &ContactProblem<S>) -> Option<String> {
        resisted(problem, "pgs_matrix")
    }
    fn work(
        &mut self,
        problem: &ContactProblem<S>,
        settings: &SolveSettings,
        impulses: &mut Impulses<S>,
        _watch: &mut Watch,
    ) -> Outcome {
        let given = impulses.clone();
        let prepared = Prepared::of(problem);
        let a = delassus_of(problem, &prepared);
        let b = right_hand_side_of(problem, &prepared);
        project(problem, impulses);
        let mut gamma = impulses.flat();
        let mut sweeps = 0;
        while sweeps < settings.iterations {
            let change = sweep(problem, &prepared, &a, &b, &mut gamma);
            sweeps += 1;
            let last = sweeps == settings.iterations || !change.is_finite();
            if change <= settings.tolerance || last {
                *impulses = Impulses::from_flat(problem, &gamma).expect("as many numbers as rows");
                if last || residual_of(problem, &prepared, impulses).absolute <= settings.tolerance {
                    break;
                }
            }
        }
        judged(problem, &prepared, (sweeps, settings.tolerance), &given, impulses)
    }
}

/// (A gamma - b)_i.
fn velocity_error(a: &Csr, b: &[f64], gamma: &[f64], i: usize) -> f64 {
    a.row(i).map(|(j, x)| x * gamma[j]).sum::<f64>() - b[i]
}

/// One sweep: bounded rows, then contacts; returns the largest change as a velocity.
fn sweep<S: Space>(
    problem: &ContactProblem<S>,
    p: &Prepared<S>,
    a: &Csr,
    b: &[f64],
    gamma: &mut [f64],
) -> f64 {
    let width = 1 + S::SLIP;
    let mut change: f64 = 0.0;
    for (k, row) in problem.rows.iter().enumerate() {
        let i = problem.contacts.len() * width + k;
        let diagonal = p.rows[k].inverse_effective_mass;
        let next = (gamma[i] - velocity_error(a, b, gamma, i) / diagonal).max(row.lo).min(row.hi);
        change = change.max((next - gamma[i]).abs() * diagonal);
        gamma[i] = next;
    }
    for (k, c) in p.contacts.iter().enumerate() {
        let i = k * width;
        let normal = (gamma[i] - c.normal_mass * velocity_error(a, b, gamma, i)).max(0.0);
        change = change.max((normal - gamma[i]).abs() / c.normal_mass);
        gamma[i] = normal;
        if c.friction > 0.0 {
            let slip = S::Slip::from_fn(|t| velocity_error(a, b, gamma, i + 1 + t));
            let old = S::Slip::from_fn(|t| gamma[i + 1 + t]);
            let limit = c.friction * normal;
            let tangent = project_tangent::<S>(old - slip * c.tangent_mass, limit, problem.friction_law);
            gamma[i + 1..i + width].copy_from_slice(tangent.as_slice());
            change = change.max((tangent - old).norm() / c.tangent_mass);
        }
    }
    change
}
