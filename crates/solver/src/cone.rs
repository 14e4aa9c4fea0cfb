//! Projections on what the law allows: the normal half-line, the friction box or disc (theory eqs. 5.20 and
//! 5.22), a bounded row. Knows no bodies.

use crate::prepared::PreparedContact;
use crate::problem::{ContactProblem, FrictionLaw, Impulse, Impulses};
use crate::resistance::{PreparedResistance, project_moment};
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
    for (resistance, moment) in problem.resistances.iter().zip(&mut impulses.moments) {
        let normal = impulses.contacts[resistance.contact].normal;
        *moment = project_moment::<S>(*moment, resistance, normal);
    }
}

/// Normal part of the point of the cone size_k <= coefficient_k * normal that is nearest to (normal, sizes), with
/// (size, coefficient) of every part that the law limits, the largest size / coefficient first (theory eq. 5.37).
#[inline]
pub fn nearest_normal(normal: f64, parts: &[(f64, f64)]) -> f64 {
    let (mut nearest, mut sum, mut weight) = (normal, normal, 1.0);
    for &(size, coefficient) in parts {
        if size <= coefficient * nearest {
            break;
        }
        sum += coefficient * size;
        weight += coefficient * coefficient;
        nearest = sum / weight;
    }
    nearest.max(0.0)
}

/// A resistance with its moment and the relative spin, for a step of its contact.
pub type Resisted<'a, S> = (&'a PreparedResistance<S>, <S as Space>::Spin, <S as Space>::Spin);

/// One projected gradient step of a contact with De Saxce's shift: the point of the friction cone nearest to
/// (g_n - t m_n (u_n - target + mu |u_t|), g_t - t m_t u_t), nearest in the metric 1/m (theory eqs. 5.36 and 5.37).
/// Moments of rolling and spinning friction are further parts of the same cone.
#[inline]
pub fn project_step<S: Space>(
    c: &PreparedContact<S>,
    old: &Impulse<S>,
    (speed, slip): (f64, S::Slip),
    step: f64,
    law: FrictionLaw,
    resisted: Option<Resisted<S>>,
) -> (Impulse<S>, S::Spin) {
    let mut lowered = old.normal - step * c.normal_mass * (speed - c.target);
    let mut parts = [(0.0, 0.0); 4];
    let mut count = 0;
    let mut limit = |size: f64, speed: f64, coefficient: f64, inverse_inertia: f64| {
        if coefficient == 0.0 {
            return; // what no impulse allows presses none
        }
        // sizes in the metric 1/m count `stretch` times
        let stretch = (c.normal_mass * inverse_inertia).sqrt();
        lowered -= step * c.normal_mass * coefficient * speed;
        parts[count] = (stretch * size, stretch * coefficient);
        count += 1;
    };
    let mut tangent = S::Slip::ZERO;
    if c.friction > 0.0 {
        tangent = old.tangent - slip * (step * c.tangent_mass);
        if S::SLIP > 1 && law == FrictionLaw::Box {
            for k in 0..S::SLIP {
                limit(tangent[k].abs(), slip[k].abs(), c.friction, c.inverse_tangent_mass);
            }
        } else {
            limit(tangent.norm(), slip.norm(), c.friction, c.inverse_tangent_mass);
        }
    }
    let mut moment = S::Spin::ZERO;
    if let Some((r, old, spin)) = resisted {
        moment = r.trial(old, spin, step);
        for p in r.parts() {
            limit(p.size::<S>(moment), p.size::<S>(spin), p.limit, p.inverse_inertia);
        }
    }
    let parts = &mut parts[..count];
    // size / coefficient in falling order, without dividing by a coefficient of zero
    parts.sort_unstable_by(|p, q| (q.0 * p.1).total_cmp(&(p.0 * q.1)));
    let normal = nearest_normal(lowered, parts);
    let tangent = project_tangent::<S>(tangent, c.friction * normal, law);
    let moment = resisted.map_or(moment, |(r, ..)| project_moment::<S>(moment, &r.given, normal));
    (Impulse { normal, tangent }, moment)
}
