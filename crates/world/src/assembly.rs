//! From contacts to a contact problem, and from impulses to velocities and lines of the ledger.

use crate::bodies::Bodies;
use crate::integrate::set_spin_momentum;
use crate::narrow_phase::Touch;
use crate::observe::ledger::Ledger;
use carom_geometry::Geometry;
use carom_math::{Column, Rotation, Space};
use carom_solver::{Contact, ContactProblem, Entry, FrictionLaw, Impulses, Resistance, Twist};

/// Empties a problem and fills in the bodies' inverse masses and present velocities.
pub fn begin<S: Geometry>(problem: &mut ContactProblem<S>, bodies: &Bodies<S>, law: FrictionLaw) {
    problem.space.clear();
    problem.space.push_str(S::NAME);
    problem.friction_law = law;
    problem.contacts.clear();
    problem.rows.clear();
    problem.resistances.clear();
    problem.inverse_masses.clear();
    problem.inverse_masses.extend((0..bodies.len()).map(|i| bodies.inverse_mass(i)));
    problem.velocities.clear();
    problem.velocities.extend((0..bodies.len()).map(|i| bodies.motion.twist(i)));
}

/// A contact of the problem with arms from the bodies' present places: both use the one common point, or angular
/// momentum would leak.
pub fn contact<S: Geometry>(bodies: &Bodies<S>, t: &Touch<S>, target: f64) -> Contact<S> {
    Contact {
        id: t.id,
        a: t.a,
        b: t.b,
        normal: t.normal,
        arm_a: t.point - bodies.motion.position[t.a],
        arm_b: t.point - bodies.motion.position[t.b],
        gap: t.gap,
        target,
        slip_target: S::Slip::ZERO,
        restitution: t.restitution,
        friction: t.friction,
    }
}

/// Adds rolling and spinning friction to the contact added last, where it has any.
pub fn resist<S: Geometry>(problem: &mut ContactProblem<S>, t: &Touch<S>) {
    resist_at(problem, problem.contacts.len() - 1, t);
}

/// The same for a contact by its place; places ascend from call to call.
pub fn resist_at<S: Geometry>(problem: &mut ContactProblem<S>, contact: usize, t: &Touch<S>) {
    if t.rolling > 0.0 || (S::SPIN > 1 && t.spinning > 0.0) {
        problem.resistances.push(Resistance { contact, rolling: t.rolling, spinning: t.spinning });
    }
}

/// Writes velocities back to the bodies that impulses move.
pub fn write_back<S: Geometry>(bodies: &mut Bodies<S>, velocities: &[Twist<S>]) {
    for (i, v) in velocities.iter().enumerate() {
        if bodies.data[i].inverse_mass > 0.0 {
            bodies.motion.set_twist(i, v);
        }
    }
}

/// Bodies of an entry of the problem.
pub fn bodies_of<S: Space>(problem: &ContactProblem<S>, entry: Option<Entry>) -> Option<(usize, usize)> {
    entry.map(|e| match e {
        Entry::Contact(i) => (problem.contacts[i].a, problem.contacts[i].b),
        Entry::Row(i) => (problem.rows[i].a, problem.rows[i].b),
    })
}

/// Moves bodies by small displacements; their spin momenta stay, and so do obstacles.
pub fn displace<S: Geometry>(bodies: &mut Bodies<S>, displacements: &[Twist<S>]) {
    for (i, d) in displacements.iter().enumerate() {
        // an infinite moment times nothing is no number
        if !bodies.is_dynamic(i) {
            continue;
        }
        bodies.motion.position[i] += d.linear;
        if d.angular != S::Spin::ZERO {
            let momentum = bodies.spin_momentum(i);
            let turned = bodies.motion.rotation[i].then(&S::Rotation::about(d.angular));
            bodies.motion.rotation[i] = turned;
            set_spin_momentum(bodies, i, momentum);
        }
    }
}

/// Work of bounded rows between two sets of velocities, by the kick identity \[J\]; the part that moving obstacles paid
/// goes to the ledger.
pub fn row_work<S: Geometry>(
    bodies: &Bodies<S>,
    problem: &ContactProblem<S>,
    impulses: &Impulses<S>,
    before: &[Twist<S>],
    after: &[Twist<S>],
    ledger: &mut Ledger,
) -> f64 {
    let mut work = 0.0;
    for (r, &l) in problem.rows.iter().zip(&impulses.rows) {
        let velocity = |v: &[Twist<S>]| r.on_a.dot(&v[r.a]) + r.on_b.dot(&v[r.b]);
        work += 0.5 * l * (velocity(before) + velocity(after));
        for (body, on) in [(r.a, &r.on_a), (r.b, &r.on_b)] {
            if !bodies.is_dynamic(body) {
                ledger.driven -= l * on.dot(&after[body]);
            }
        }
    }
    work
}

/// Work of contact impulses between two sets of velocities, by the kick identity: (normal, friction) of one
/// contact \[J\], rolling and spinning friction as friction, and the part that moving obstacles paid.
pub fn contact_work<S: Geometry>(
    bodies: &Bodies<S>,
    problem: &ContactProblem<S>,
    impulses: &Impulses<S>,
    before: &[Twist<S>],
    after: &[Twist<S>],
    mut book: impl FnMut(usize, f64, f64),
    ledger: &mut Ledger,
) {
    for (k, (c, g)) in problem.contacts.iter().zip(&impulses.contacts).enumerate() {
        if g.normal == 0.0 && g.tangent == S::Slip::ZERO {
            continue;
        }
        // half the sum of both velocities of the points on each other, and the impulses along the normal and across it
        let at = |body: usize, arm: S::Vector| -> S::Vector {
            let (one, other) = (&before[body], &after[body]);
            Twist::<S>::new(one.linear + other.linear, one.angular + other.angular).at(arm)
        };
        let mean: S::Vector = (at(c.a, c.arm_a) - at(c.b, c.arm_b)) * 0.5;
        let across = c.slip_to_world(g.tangent);
        let force = c.normal * g.normal + across;
        book(k, g.normal * mean.dot(c.normal), across.dot(mean));
        if !bodies.is_dynamic(c.b) {
            ledger.driven += force.dot(after[c.b].at(c.arm_b));
        }
        if !bodies.is_dynamic(c.a) {
            ledger.driven -= force.dot(after[c.a].at(c.arm_a));
        }
    }
    for (r, m) in problem.resistances.iter().zip(&impulses.moments) {
        let c = &problem.contacts[r.contact];
        book(r.contact, 0.0, 0.5 * m.dot(c.relative_spin(before) + c.relative_spin(after)));
        let moment = c.moment_to_world(*m);
        if !bodies.is_dynamic(c.b) {
            ledger.driven += moment.dot(after[c.b].angular);
        }
        if !bodies.is_dynamic(c.a) {
            ledger.driven -= moment.dot(after[c.a].angular);
        }
    }
}
