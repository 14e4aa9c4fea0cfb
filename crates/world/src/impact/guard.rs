//! Energy guard: an island of impacts that would gain energy, as Newton's restitution with Coulomb friction can
//! (theory section 3.6), gets Moreau's law instead (eqs. 3.20 to 3.22). Moreau's impulses are those of the plastic
//! impact times 1 + e, with one e for the island: the smallest of its pressed contacts.

use carom_geometry::Geometry;
use carom_math::Column;
use carom_solver::{ContactProblem, Impulse, ImpulseSolver, Impulses, Islands, SolveSettings, Twist};

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
    for (island, _) in works.iter().enumerate().filter(|(_, w)| w.is_gain()) {
        let members = islands.contacts(island);
        let found = moreau(problem, members, bounces, settings, solver);
        for (&k, g) in members.iter().zip(found) {
            impulses.contacts[k] = g;
        }
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
    works
}

/// Moreau's impulses of an island. Where the plastic solve is inexact the factor is cut so that energy cannot grow.
fn moreau<S: Geometry>(
    problem: &ContactProblem<S>,
    members: &[usize],
    bounces: &[bool],
    settings: &SolveSettings,
    solver: &mut dyn ImpulseSolver<S>,
) -> Vec<Impulse<S>> {
    let mut plastic = problem.clone();
    plastic.contacts = members.iter().map(|&k| problem.contacts[k]).collect();
    for c in &mut plastic.contacts {
        c.target = c.target.min(0.0);
    }
    let mut impulses = Impulses::zero(&plastic);
    solver.solve(&plastic, settings, &mut impulses);
    let pressed =
        members.iter().zip(&plastic.contacts).zip(&impulses.contacts).filter(|(_, g)| g.normal > 0.0);
    let share =
        |((&k, c), _): ((&usize, &carom_solver::Contact<S>), _)| if bounces[k] { c.restitution } else { 0.0 };
    let restitution = pressed.map(share).fold(1.0, f64::min);
    let factor = (1.0 + restitution).min(neutral_factor(&plastic, &impulses));
    impulses
        .contacts
        .iter()
        .map(|g| Impulse { normal: g.normal * factor, tangent: g.tangent * factor })
        .collect()
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
    if quadratic > 0.0 { (-2.0 * linear / quadratic).max(0.0) } else { 0.0 }
}
