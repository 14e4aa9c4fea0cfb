//! Poisson's law in two phases, after Glocker and Pfeiffer (1995), without tangential restitution. Compression: the
//! plastic impact of all contacts with Coulomb's friction gives gamma_c. Restitution: every contact gives back at
//! least e times what compression pressed with, more where bodies would else run into each other,
//!     0 <= gamma_n - e gamma_c,n _|_ u_n+ >= 0,    friction inside mu gamma_n against the slip at the end,
//! and the impulses of both phases add up. An impulse decides, not a velocity: a contact at rest that a blow presses
//! bounces as well. Found by the chosen solver in the first phase and by sweeps in the second, whose friction limit
//! has a part that no row of a contact problem states; its residual is the change of the last sweep.

use carom_math::Space;
use carom_solver::methods::pgs::{relax_above, relax_row};
use carom_solver::prepared::Prepared;
use carom_solver::{ContactProblem, Impulse, ImpulseSolver, Impulses, Outcome, SolveSettings, Stop, Watch};

use crate::impact::judged_by_approach;
use crate::impact::moreau::end_plastic;

/// Sweeps of the second phase per iteration of the settings: a sweep over an impact costs little.
const SWEEPS: usize = 100;
/// Most sweeps whatever the settings: where they have not settled by then, rounding keeps them from it.
const MOST_SWEEPS: usize = 100_000;

/// Compression, then restitution; the impulses are the sum.
pub fn solve<S: Space>(
    problem: &ContactProblem<S>,
    bounces: &[bool],
    settings: &SolveSettings,
    solver: &mut dyn ImpulseSolver<S>,
    impulses: &mut Impulses<S>,
    watch: &mut Watch,
) -> Outcome {
    let mut phase = problem.clone();
    end_plastic(&mut phase);
    let outcome = solver.solve_watched(&phase, settings, impulses, watch);
    let ended = matches!(outcome.stop, Stop::Refused(_) | Stop::Interrupted);
    if ended || !bounces.contains(&true) {
        return outcome;
    }
    phase.velocities = phase.velocities_after(impulses);
    let gives = |k: usize| if bounces[k] { problem.contacts[k].restitution } else { 0.0 };
    let least: Vec<f64> = (0..bounces.len()).map(|k| gives(k) * impulses.contacts[k].normal).collect();
    let mut given_back = Impulses::zero(&phase);
    for (g, least) in given_back.contacts.iter_mut().zip(&least) {
        g.normal = *least;
    }
    let second = give_back(&phase, &least, settings, &mut given_back);
    for (g, more) in impulses.contacts.iter_mut().zip(&given_back.contacts) {
        *g = Impulse { normal: g.normal + more.normal, tangent: g.tangent + more.tangent };
    }
    for (l, more) in impulses.rows.iter_mut().zip(&given_back.rows) {
        *l += more;
    }
    for (m, more) in impulses.moments.iter_mut().zip(&given_back.moments) {
        *m += *more;
    }
    let worse = if second.residual.absolute > outcome.residual.absolute { &second } else { &outcome };
    let residual = carom_solver::Residual { relative: outcome.residual.relative, ..worse.residual };
    let stop = if outcome.stop == Stop::Converged { second.stop } else { outcome.stop };
    Outcome { iterations: outcome.iterations + second.iterations, residual, stop, ..outcome }
}

/// The second phase by sweeps, from the least impulses.
fn give_back<S: Space>(
    phase: &ContactProblem<S>,
    least: &[f64],
    settings: &SolveSettings,
    impulses: &mut Impulses<S>,
) -> Outcome {
    let prepared = Prepared::of(phase);
    let mut velocities = phase.velocities_after(impulses);
    let (mut sweeps, mut change) = (0, f64::INFINITY);
    let most = SWEEPS.saturating_mul(settings.iterations).min(MOST_SWEEPS);
    while sweeps < most && change > settings.tolerance && change > 0.0 {
        let mut squared: f64 = 0.0;
        for ((c, g), least) in prepared.contacts.iter().zip(&mut impulses.contacts).zip(least) {
            squared = squared.max(relax_above(c, g, *least, phase.friction_law, &mut velocities));
        }
        for ((given, row), l) in phase.rows.iter().zip(&prepared.rows).zip(&mut impulses.rows) {
            squared = squared.max(relax_row(given, row, l, &mut velocities));
        }
        for (r, m) in prepared.resistances.iter().zip(&mut impulses.moments) {
            squared = squared.max(r.relax(impulses.contacts[r.contact].normal, m, &mut velocities));
        }
        change = squared.sqrt();
        sweeps += 1;
    }
    judged_by_approach(sweeps, change, settings.tolerance)
}
