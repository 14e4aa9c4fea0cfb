//! Moreau's law (1988; theory eqs. 3.20 and 3.21): Coulomb's law, its normal part included, holds for the weighted
//! mean w = (u+ + e u-)/(1 + e). Its impulses are those of the plastic impact times 1 + e, with one e for each island:
//! the smallest of its pressed contacts, and 0 when one of them does not bounce. Energy never grows, friction included:
//! Delta T <= -(1/2) (1-e)/(1+e) gamma.A gamma. Its price: e also reverses a part of the slip.

use carom_math::{Column, Space};
use carom_solver::{
    ContactProblem, Impulse, ImpulseSolver, Impulses, Islands, Outcome, Part, SolveSettings, Twist, Watch,
};

/// Solves the plastic impact of all islands at once and scales each by its own 1 + e.
pub fn solve<S: Space>(
    problem: &ContactProblem<S>,
    bounces: &[bool],
    settings: &SolveSettings,
    solver: &mut dyn ImpulseSolver<S>,
    impulses: &mut Impulses<S>,
    watch: &mut Watch,
) -> Outcome {
    let mut plastic = problem.clone();
    end_plastic(&mut plastic);
    let outcome = solver.solve_watched(&plastic, settings, impulses, watch);
    let islands = Islands::of(problem);
    let mut part = Part::default();
    for island in (0..islands.count()).filter(|&i| islands.contacts(i).iter().any(|&k| bounces[k])) {
        part.take(&plastic, impulses, &islands, island);
        let bounces: Vec<bool> = islands.contacts(island).iter().map(|&k| bounces[k]).collect();
        rebound(&part.problem, &bounces, &mut part.impulses);
        part.give(impulses, &islands, island);
    }
    outcome
}

/// Makes the targets those of the plastic impact, which stops slips.
pub fn end_plastic<S: Space>(problem: &mut ContactProblem<S>) {
    for c in &mut problem.contacts {
        c.target = c.target.min(0.0);
        c.slip_target = S::Slip::ZERO;
    }
}

/// From an island's plastic impulses to Moreau's. Where the plastic solve is inexact the factor is cut so that energy
/// cannot grow.
pub fn rebound<S: Space>(plastic: &ContactProblem<S>, bounces: &[bool], impulses: &mut Impulses<S>) {
    let pressed =
        plastic.contacts.iter().zip(bounces).zip(&impulses.contacts).filter(|(_, g)| g.normal > 0.0);
    let shares = pressed.map(|((c, &bounces), _)| if bounces { c.restitution } else { 0.0 });
    let restitution = shares.fold(1.0, f64::min);
    let factor = (1.0 + restitution).min(neutral_factor(plastic, impulses));
    for g in &mut impulses.contacts {
        *g = Impulse { normal: g.normal * factor, tangent: g.tangent * factor };
    }
    impulses.rows.iter_mut().for_each(|l| *l *= factor);
    impulses.moments.iter_mut().for_each(|m| *m = *m * factor);
}

/// The factor s at which s times the impulses would neither gain nor lose: s gamma.u- + s^2/2 gamma.A gamma = 0;
/// 0 when they push along the motion.
fn neutral_factor<S: Space>(problem: &ContactProblem<S>, impulses: &Impulses<S>) -> f64 {
    let after: Vec<Twist<S>> = problem.velocities_after(impulses);
    let (mut linear, mut quadratic) = (0.0, 0.0);
    for (c, g) in problem.contacts.iter().zip(&impulses.contacts) {
        let ((n0, t0), (n1, t1)) = (c.relative_velocity(&problem.velocities), c.relative_velocity(&after));
        linear += g.normal * n0 + g.tangent.dot(t0);
        quadratic += g.normal * (n1 - n0) + g.tangent.dot(t1 - t0);
    }
    for (r, m) in problem.resistances.iter().zip(&impulses.moments) {
        let c = &problem.contacts[r.contact];
        let (w0, w1) = (c.relative_spin(&problem.velocities), c.relative_spin(&after));
        linear += m.dot(w0);
        quadratic += m.dot(w1 - w0);
    }
    if quadratic > 0.0 { (-2.0 * linear / quadratic).max(0.0) } else { 0.0 }
}
