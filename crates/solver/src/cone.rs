//! Projections on what the law allows: the normal half-line, the friction box or disc (theory eqs. 5.20 and
//! 5.22), a bounded row. Knows no bodies.

use crate::problem::{ContactProblem, FrictionLaw, Impulse, Impulses};
use carom_math::{Column, Space};

/// The nearest tangential impulse inside the friction limit mu gamma_n.
#[inline]
pub fn project_tangent<S: Space>(tangent: S::Slip, limit: f64, law: FrictionLaw) -> S::Slip {
    // in the plane both laws are the interval; max and min, unlike clamp, do not panic on a NaN
    if S::SLIP == 1 || law == FrictionLaw::Box {
        return S::Slip::from_fn(|k| tangent[k].max(-limit).min(limit));
    }
    let squared = tangent.norm_squared();
    if squared > limit * limit { tangent * (limit / squared.sqrt()) } else { tangent }
}

/// Moves impulses (a warm start, say) into the problem's cones and bounds, component by component; what is not
/// finite starts from zero.
pub fn project<S: Space>(problem: &ContactProblem<S>, impulses: &mut Impulses<S>) {
    for (contact, impulse) in problem.contacts.iter().zip(&mut impulses.contacts) {
        if !(impulse.normal.is_finite() && impulse.tangent.is_finite()) {
            *impulse = Impulse::default();
        }
        impulse.normal = impulse.normal.max(0.0);
        let limit = contact.friction * impulse.normal;
        impulse.tangent = project_tangent::<S>(impulse.tangent, limit, problem.friction_law);
    }
    for (row, impulse) in problem.rows.iter().zip(&mut impulses.rows) {
        let start = if impulse.is_finite() { *impulse } else { 0.0 };
        *impulse = start.max(row.lo).min(row.hi);
    }
}
