//! The scalar rows of a mixed problem, part by part, each with the law that limits its impulses.

use crate::prepared::Prepared;
use crate::problem::{ContactProblem, FrictionLaw};
use carom_math::Space;

/// How impulses of a part are limited.
#[derive(Clone, Copy, Debug)]
pub enum Law {
    /// Not negative.
    Pushing,
    /// Between two numbers.
    Bounded(f64, f64),
    /// Together no longer than a coefficient times the impulse of a row.
    Limited(f64, usize),
}

/// Consecutive scalar rows under one law.
#[derive(Clone, Copy, Debug)]
pub struct Part {
    pub first: usize,
    pub count: usize,
    pub law: Law,
    /// The largest eigenvalue of A on these rows \[1/kg\].
    pub inverse_mass: f64,
    /// Makes their velocity one in m/s.
    pub length: f64,
}

/// Every scalar row under its law, in the order of `Impulses::flat`.
pub fn parts<S: Space>(problem: &ContactProblem<S>, prepared: &Prepared<S>) -> Vec<Part> {
    let mut parts = Vec::new();
    let mut push = |first: usize, count: usize, law: Law, inverse_mass: f64, length: f64| {
        // where no impulse moves anything, any step has the same fixed point
        let inverse_mass = if inverse_mass > 0.0 { inverse_mass } else { 1.0 };
        parts.push(Part { first, count, law, inverse_mass, length });
    };
    let boxed = S::SLIP > 1 && problem.friction_law == FrictionLaw::Box;
    let width = 1 + S::SLIP;
    for (i, c) in prepared.contacts.iter().enumerate() {
        let normal = i * width;
        push(normal, 1, Law::Pushing, c.normal.inverse_effective_mass, 1.0);
        let law = Law::Limited(c.friction, normal);
        if boxed {
            (0..S::SLIP).for_each(|k| push(normal + 1 + k, 1, law, c.inverse_tangent_mass, 1.0));
        } else {
            push(normal + 1, S::SLIP, law, c.inverse_tangent_mass, 1.0);
        }
    }
    let rows = prepared.contacts.len() * width;
    for (k, (given, row)) in problem.rows.iter().zip(&prepared.rows).enumerate() {
        push(rows + k, 1, Law::Bounded(given.lo, given.hi), row.inverse_effective_mass, 1.0);
    }
    let moments = rows + problem.rows.len();
    for (k, r) in prepared.resistances.iter().enumerate() {
        let first = moments + k * S::SPIN;
        let turned = r.all_parts().iter().filter(|p| p.end > p.first);
        turned.for_each(|p| {
            let law = Law::Limited(p.limit, r.contact * width);
            push(first + p.first, p.end - p.first, law, p.inverse_inertia, p.length);
        });
    }
    parts
}
