//! The certificate of a solve: what impulses are worth as an answer to a contact problem, from the problem and the
//! impulses alone. Residual of the natural map (theory eqs. 5.31 to 5.34); distance from the friction cones;
//! complementarity max |gamma_n (u_n - target)|; over sliding contacts the angle between friction and the opposite
//! of the slip; and the energy identity Delta T = 1/2 x^T (u+ + u-), which holds for any impulses whatever law made
//! them, so that its closure tells wrong masses or rows from rounding. Knows no solver.

use crate::islands::{Islands, Part};
use crate::prepared::{Prepared, PreparedContact};
use crate::problem::{ContactProblem, FrictionLaw, Impulse, Impulses, Twist};
use crate::residual::{Entry, residual_of, velocity_scale};
use crate::resistance::Part as MomentPart;
use carom_math::{Column, Inertia, Space};
use serde::{Deserialize, Serialize};

/// Contacts slide when their slip is above this many residuals \[1\]: the direction of a slower one is an error's.
const SLIDING: f64 = 100.0;
/// The same against the velocities of the problem, for solves whose residual is rounding \[1\].
const ROUNDING: f64 = 1e-12;

/// What impulses are worth as an answer.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Certificate {
    /// Contacts of the problem.
    pub contacts: usize,
    /// Bounded rows of the problem.
    pub rows: usize,
    /// Largest natural-map residual \[m/s\].
    pub residual: f64,
    /// The same divided by the residual of no impulses at all \[1\].
    pub relative_residual: f64,
    /// Contact where it is largest; `None` when it is zero or largest at a bounded row.
    pub worst_contact: Option<usize>,
    /// Bodies of that contact, by index.
    pub worst_bodies: Option<(usize, usize)>,
    /// Their names, where whoever asked knows them.
    pub worst_names: Option<(String, String)>,
    /// Largest distance of an impulse from its cone: pull, or friction beyond its limit \[N s\]; of a bounded row
    /// from its bounds.
    pub cone_violation: f64,
    /// Largest |gamma_n (u_n - target)| \[J\].
    pub complementarity: f64,
    /// Largest angle between friction and the opposite of the slip over sliding contacts \[rad\].
    pub slip_angle_error: f64,
    /// Contacts that slide: pressed, with friction, slip above a hundred residuals.
    pub sliding: usize,
    /// Energy change - work of impulses - work of moving obstacles \[J\]: rounding when masses, rows and velocities
    /// belong together.
    pub energy_identity: f64,
    /// Change of the kinetic energy of the bodies that impulses move \[J\].
    pub energy_change: f64,
    /// Sum of the absolute terms of both sides \[J\], against which the identity is measured.
    pub energy_turned_over: f64,
    /// Largest normal impulse \[N s\], against which the cone is measured.
    pub largest_impulse: f64,
    /// The residual of no impulses at all \[m/s\].
    pub velocity_scale: f64,
}

impl Certificate {
    /// Certifies impulses.
    pub fn of<S: Space>(problem: &ContactProblem<S>, impulses: &Impulses<S>) -> Self {
        let prepared = Prepared::of(problem);
        let mut after = problem.velocities.clone();
        prepared.apply(impulses, &mut after);
        let residual = residual_of(problem, &prepared, impulses);
        let scale = velocity_scale(problem, &prepared);
        let worst_contact = residual.worst.and_then(|entry| match entry {
            Entry::Contact(k) => Some(k),
            Entry::Row(_) => None,
        });
        let mut certificate = Certificate {
            contacts: problem.contacts.len(),
            rows: problem.rows.len(),
            residual: residual.absolute,
            relative_residual: residual.relative,
            worst_contact,
            worst_bodies: worst_contact.map(|k| (problem.contacts[k].a, problem.contacts[k].b)),
            velocity_scale: scale,
            ..Certificate::default()
        };
        let sliding_speed = (SLIDING * residual.absolute).max(ROUNDING * scale);
        for (c, g) in prepared.contacts.iter().zip(&impulses.contacts) {
            certificate.add_contact(c, g, c.relative_velocity(&after), problem.friction_law, sliding_speed);
        }
        for (row, l) in problem.rows.iter().zip(&impulses.rows) {
            certificate.cone_violation = certificate.cone_violation.max(row.lo - l).max(l - row.hi);
        }
        for (r, m) in prepared.resistances.iter().zip(&impulses.moments) {
            let normal = impulses.contacts[r.contact].normal;
            let excess = |p: &MomentPart| (p.size::<S>(*m) - p.limit * normal.max(0.0)) / p.length;
            certificate.cone_violation = r.parts().map(excess).fold(certificate.cone_violation, f64::max);
        }
        certificate.add_energy(problem, &prepared, impulses, &after);
        certificate
    }

    /// Certifies the island of a body alone, or everything when no body is given; entries and bodies are counted as in
    /// the whole problem. `None` when nothing touches that body.
    pub fn narrowed<S: Space>(
        problem: &ContactProblem<S>,
        impulses: &Impulses<S>,
        body: Option<usize>,
    ) -> Option<Self> {
        let Some(body) = body else { return Some(Certificate::of(problem, impulses)) };
        if body >= problem.velocities.len() {
            return None;
        }
        let mut islands = Islands::of(problem);
        let island = islands.of_body(body)?;
        let mut part = Part::default();
        part.take(problem, impulses, &islands, island);
        let mut certificate = Certificate::of(&part.problem, &part.impulses);
        certificate.worst_contact = certificate.worst_contact.map(|k| islands.contacts(island)[k]);
        certificate.worst_bodies = certificate.worst_bodies.map(|(a, b)| (part.bodies[a], part.bodies[b]));
        Some(certificate)
    }

    fn add_contact<S: Space>(
        &mut self,
        c: &PreparedContact<S>,
        g: &Impulse<S>,
        (normal, slip): (f64, S::Slip),
        law: FrictionLaw,
        sliding_speed: f64,
    ) {
        let limit = c.friction * g.normal.max(0.0);
        let size = match law {
            FrictionLaw::Disc => g.tangent.norm(),
            FrictionLaw::Box => g.tangent.as_slice().iter().fold(0.0, |m: f64, t| m.max(t.abs())),
        };
        self.cone_violation = self.cone_violation.max(-g.normal).max(size - limit);
        self.complementarity = self.complementarity.max((g.normal * (normal - c.target)).abs());
        self.largest_impulse = self.largest_impulse.max(g.normal);
        if limit > 0.0 && slip.norm() > sliding_speed {
            self.sliding += 1;
            self.slip_angle_error = self.slip_angle_error.max(angle::<S>(g.tangent, -slip));
        }
    }

    /// Delta T = sum 1/2 (v+ - v-).M (v+ + v-) over the bodies against the impulses' own work, formed on the
    /// contacts; the part of moving obstacles is told apart, for they have no energy of their own.
    fn add_energy<S: Space>(
        &mut self,
        problem: &ContactProblem<S>,
        prepared: &Prepared<S>,
        impulses: &Impulses<S>,
        after: &[Twist<S>],
    ) {
        let before = &problem.velocities;
        for ((m, v0), v1) in problem.inverse_masses.iter().zip(before).zip(after) {
            if m.linear > 0.0 {
                let gained = 0.5 / m.linear * (v1.linear - v0.linear).dot(v1.linear + v0.linear);
                self.energy_change += gained;
                self.energy_turned_over += gained.abs();
            }
            if let Some(inertia) = m.angular.inverse() {
                let turned = inertia.apply(v1.angular - v0.angular);
                let gained = 0.5 * turned.dot(v1.angular + v0.angular);
                self.energy_change += gained;
                self.energy_turned_over += gained.abs();
            }
        }
        let is_fixed = |body: usize| problem.inverse_masses[body].is_fixed();
        let mut work = 0.0;
        for ((contact, c), g) in problem.contacts.iter().zip(&prepared.contacts).zip(&impulses.contacts) {
            let ((n0, t0), (n1, t1)) = (c.relative_velocity(before), c.relative_velocity(after));
            // friction works on the whole slip, not on what is left to its target
            let (t0, t1) = (t0 + c.slip_target, t1 + c.slip_target);
            work += 0.5 * g.normal * (n0 + n1) + 0.5 * g.tangent.dot(t0 + t1);
            self.energy_turned_over += 0.5 * (g.normal * n0).abs() + 0.5 * (g.normal * n1).abs();
            self.energy_turned_over += 0.5 * (g.tangent.dot(t0).abs() + g.tangent.dot(t1).abs());
            let force = contact.to_world(g);
            if is_fixed(contact.b) {
                work += force.dot(before[contact.b].at(contact.arm_b));
            }
            if is_fixed(contact.a) {
                work -= force.dot(before[contact.a].at(contact.arm_a));
            }
        }
        for ((row, r), l) in problem.rows.iter().zip(&prepared.rows).zip(&impulses.rows) {
            work += 0.5 * l * (r.velocity(before) + r.velocity(after));
            for (body, on) in [(row.a, &row.on_a), (row.b, &row.on_b)] {
                if is_fixed(body) {
                    work -= l * on.dot(&before[body]);
                }
            }
        }
        for (r, m) in prepared.resistances.iter().zip(&impulses.moments) {
            let (w0, w1) = (r.spin(before), r.spin(after));
            work += 0.5 * m.dot(w0 + w1);
            self.energy_turned_over += 0.5 * (m.dot(w0).abs() + m.dot(w1).abs());
            let contact = &problem.contacts[r.contact];
            let world = contact.moment_to_world(*m);
            if is_fixed(contact.b) {
                work += world.dot(before[contact.b].angular);
            }
            if is_fixed(contact.a) {
                work -= world.dot(before[contact.a].angular);
            }
        }
        self.energy_identity = self.energy_change - work;
    }

    /// The certificate as a JSON text.
    pub fn to_json(&self) -> String {
        serde_json::to_string(self).expect("a certificate is plain data")
    }
}

/// Angle between two tangential vectors \[rad\]; pi where one of them is nothing, for then it opposes nothing.
fn angle<S: Space>(one: S::Slip, other: S::Slip) -> f64 {
    let (a, b) = (one.norm(), other.norm());
    if a == 0.0 || b == 0.0 {
        return std::f64::consts::PI;
    }
    // 2 atan(|a/|a| - b/|b|| / |a/|a| + b/|b||): exact for small angles, where the cosine loses half the digits
    let (a, b) = (one * (1.0 / a), other * (1.0 / b));
    2.0 * carom_math::atan2((a - b).norm(), (a + b).norm())
}
