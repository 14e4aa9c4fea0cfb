//! Projections on what the law allows: the normal half-line, the friction disc or box, a bounded row.
//! Knows no bodies (theory chapter 5).

use crate::problem::{ContactProblem, FrictionLaw, Impulses};
use carom_math::{Column, Space};

/// The nearest tangential impulse inside the friction limit mu gamma_n.
#[inline]
pub fn project_tangent<S: Space>(tangent: S::Slip, limit: f64, law: FrictionLaw) -> S::Slip {
    match law {
        FrictionLaw::Box => S::Slip::from_fn(|k| tangent[k].clamp(-limit, limit)),
        FrictionLaw::Disc => {
            let length = tangent.norm();
            if length > limit { tangent * (limit / length) } else { tangent }
        }
    }
}

/// Moves impulses (a warm start, say) into the problem's cones and bounds, component by component.
pub fn project<S: Space>(problem: &ContactProblem<S>, impulses: &mut Impulses<S>) {
    for (contact, impulse) in problem.contacts.iter().zip(&mut impulses.contacts) {
        impulse.normal = impulse.normal.max(0.0);
        let limit = contact.friction * impulse.normal;
        impulse.tangent = project_tangent::<S>(impulse.tangent, limit, problem.friction_law);
    }
    for (row, impulse) in problem.rows.iter().zip(&mut impulses.rows) {
        *impulse = impulse.clamp(row.lo, row.hi);
    }
}
