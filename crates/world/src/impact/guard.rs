//! Energy guard: an island of impacts that would gain energy, as Newton's restitution with Coulomb friction can
//! (theory section 3.6), gets Moreau's law instead (eqs. 3.20 to 3.22), on the same contacts; or it is only told, as
//! the policy says.

use carom_geometry::Geometry;
use carom_math::{Column, Space};

use crate::impact::moreau;
use crate::settings::EnergyGuard;
use carom_solver::{ContactProblem, Impulse, ImpulseSolver, Impulses, Islands, Part, SolveSettings};

/// Gain that counts as one, relative to the energy that the island's impulses turn over \[1\].
const GAIN: f64 = 1e-9;

/// Works of an island's impulses \[J\].
#[derive(Clone, Copy, Default)]
struct Work {
    /// Energy gained, gamma.(u- + u+)/2.
    gained: f64,
    /// Sum of the absolute terms of it.
    turned_over: f64,
    /// The contact that gains most, and what it does.
    most: (usize, f64),
}

impl Work {
    /// Adds a contact's impulse between relative velocities before and after it.
    fn add<S: Space>(
        &mut self,
        contact: usize,
        g: &Impulse<S>,
        before: (f64, S::Slip),
        after: (f64, S::Slip),
    ) {
        let ((n0, t0), (n1, t1)) = (before, after);
        let (normal, tangential) = (0.5 * g.normal * (n0 + n1), 0.5 * g.tangent.dot(t0 + t1));
        self.gained += normal + tangential;
        if normal + tangential > self.most.1 {
            self.most = (contact, normal + tangential);
        }
        self.turned_over += 0.5 * g.normal * (n0.abs() + n1.abs()) + tangential.abs();
    }
    fn is_gain(&self) -> bool {
        self.gained > GAIN * self.turned_over
    }
}

/// Energy that an impact's own law gains.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Gain {
    /// Islands that gain.
    pub islands: usize,
    /// What they gain together \[J\].
    pub energy: f64,
    /// Bodies of the contact that gains most, and what it does \[J\].
    pub most: Option<((usize, usize), f64)>,
}

/// True when one contact's impulse gains energy between relative velocities (normal, slip) before and after it.
pub fn gains<S: Space>(g: &Impulse<S>, before: (f64, S::Slip), after: (f64, S::Slip)) -> bool {
    let mut work = Work::default();
    work.add(0, g, before, after);
    work.is_gain()
}

/// Finds the islands that gain energy, and gives them Moreau's impulses where the policy is to clamp.
pub fn apply<S: Geometry>(
    problem: &ContactProblem<S>,
    bounces: &[bool],
    policy: EnergyGuard,
    settings: &SolveSettings,
    solver: &mut dyn ImpulseSolver<S>,
    impulses: &mut Impulses<S>,
) -> Gain {
    let mut gain = Gain::default();
    if !bounces.contains(&true) {
        return gain; // a plastic impact is a projection: it cannot gain
    }
    let islands = Islands::of(problem);
    let works = works(problem, impulses, &islands);
    let mut part = Part::default();
    for (island, work) in works.iter().enumerate().filter(|(_, w)| w.is_gain()) {
        gain.islands += 1;
        gain.energy += work.gained;
        if gain.most.is_none_or(|(_, most)| work.most.1 > most) {
            let worst = &problem.contacts[work.most.0];
            gain.most = Some(((worst.a, worst.b), work.most.1));
        }
        if policy != EnergyGuard::Clamp {
            continue;
        }
        part.take(problem, impulses, &islands, island);
        let bounces: Vec<bool> = islands.contacts(island).iter().map(|&k| bounces[k]).collect();
        moreau::end_plastic(&mut part.problem);
        part.impulses.reset(&part.problem);
        solver.solve(&part.problem, settings, &mut part.impulses);
        moreau::rebound(&part.problem, &bounces, &mut part.impulses);
        part.give(impulses, &islands, island);
    }
    gain
}

fn works<S: Geometry>(problem: &ContactProblem<S>, impulses: &Impulses<S>, islands: &Islands) -> Vec<Work> {
    let after = problem.velocities_after(impulses);
    let mut works = vec![Work::default(); islands.count()];
    for (k, (c, g)) in problem.contacts.iter().zip(&impulses.contacts).enumerate() {
        let (before, after) = (c.relative_velocity(&problem.velocities), c.relative_velocity(&after));
        works[islands.of_contact(k)].add(k, g, before, after);
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
