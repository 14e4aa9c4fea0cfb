//! Energy guard: an island of impacts that would gain energy, as Newton's restitution with Coulomb friction can
//! (theory section 3.6), gets Moreau's law instead (eqs. 3.20 to 3.22). Moreau's impulses are those of the plastic
//! impact times 1 + e, with one e for the island: the smallest of its pressed contacts.

use carom_geometry::Geometry;
use carom_math::Column;

use carom_solver::{ContactProblem, Impulse, ImpulseSolver, Impulses, Islands, Part, SolveSettings, Twist};

/// Gain that counts as one, relative to the energy that the island's impulses turn over \[1\].
const GAIN: f64 = 1e-9;

/// Works of an island's impulses \[J\].
#[derive(Clone, Copy, Default)]
struct Work {
    /// Energy gained, gamma.(u- + u+)/2.
    gained: f64,
    /// Sum of the absolute terms of it.
    turned_over: f64,
}

impl Work {
    fn is_gain(&self) -> bool {
        self.gained > GAIN * self.turned_over
    }
}

/// Replaces the impulses of the islands that gain energy.
pub fn apply<S: Geometry>(
    problem: &ContactProblem<S>,
    bounces: &[bool],
    settings: &SolveSettings,
    solver: &mut dyn ImpulseSolver<S>,
    impulses: &mut Impulses<S>,
) {
    if !bounces.contains(&true) {
        return; // a plastic impact is a projection: it cannot gain
    }
    let islands = Islands::of(problem);
    let works = works(problem, impulses, &islands);
    let mut part = Part::default();
    for (island, _) in works.iter().enumerate().filter(|(_, w)| w.is_gain()) {
        part.take(problem, impulses, &islands, island);
        let bounces: Vec<bool> = islands.contacts(island).iter().map(|&k| bounces[k]).collect();
        moreau(&mut part.problem, &bounces, settings, solver, &mut part.impulses);
        part.give(impulses, &islands, island);
    }
}

fn works<S: Geometry>(problem: &ContactProblem<S>, impulses: &Impulses<S>, islands: &Islands) -> Vec<Work> {
    let after = problem.velocities_after(impulses);
    let mut works = vec![Work::default(); islands.count()];
    for (k, (c, g)) in problem.contacts.iter().zip(&impulses.contacts).enumerate() {
        let ((n0, t0), (n1, t1)) = (c.relative_velocity(&problem.velocities), c.relative_velocity(&after));
        let (normal, tangential) = (0.5 * g.normal * (n0 + n1), 0.5 * g.tangent.dot(t0 + t1));
        let work = &mut works[islands.of_contact(k)];
        work.gained += normal + tangential;
        work.turned_over += 0.5 * g.normal * (n0.abs() + n1.abs()) + tangential.abs();
    }
    for (r, m) in problem.resistances.iter().zip(&impulses.moments) {
        let c = &problem.contacts[r.contact];
        let turning = 0.5 * m.dot(c.relative_spin(&problem.velocities) + c.relative_spin(&after));
        let work = &mut works[islands.of_contact(r.contact)];
        work.gained += turning;
        work.turned_over += turning.abs();
    }
    works
}

/// Moreau's impulses of an island taken out by itself; its targets become those of the plastic impact. Where the
/// plastic solve is inexact the factor is cut so that energy cannot grow.
fn moreau<S: Geometry>(
    plastic: &mut ContactProblem<S>,
    bounces: &[bool],
    settings: &SolveSettings,
    solver: &mut dyn ImpulseSolver<S>,
    impulses: &mut Impulses<S>,
) {
    for c in &mut plastic.contacts {
        c.target = c.target.min(0.0);
    }
    impulses.reset(plastic);
    solver.solve(plastic, settings, impulses);
    let pressed =
        plastic.contacts.iter().zip(bounces).zip(&impulses.contacts).filter(|(_, g)| g.normal > 0.0);
    let shares = pressed.map(|((c, &bounces), _)| if bounces { c.restitution } else { 0.0 });
    let restitution = shares.fold(1.0, f64::min);
    let factor = (1.0 + restitution).min(neutral_factor(plastic, impulses));
    for g in &mut impulses.contacts {
        *g = Impulse { normal: g.normal * factor, tangent: g.tangent * factor };
    }
    impulses.moments.iter_mut().for_each(|m| *m = *m * factor);
}

/// The factor s at which s times the impulses would neither gain nor lose: s gamma.u- + s^2/2 gamma.A gamma = 0;
/// 0 when they push along the motion.
fn neutral_factor<S: Geometry>(problem: &ContactProblem<S>, impulses: &Impulses<S>) -> f64 {
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
