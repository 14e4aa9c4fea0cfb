//! Projections on what the law allows: the normal half-line, the friction box or disc (theory eqs. 5.20 and
//! 5.22), a bounded row. Knows no bodies.

use crate::prepared::PreparedContact;
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

/// Normal part of the point of the cone size_k <= friction * normal that is nearest to (normal, sizes); the sizes
/// are those of the tangential parts that the law limits one by one, largest first.
#[inline]
pub fn nearest_normal(normal: f64, sizes: &[f64], friction: f64) -> f64 {
    let (mut nearest, mut sum, mut weight) = (normal, normal, 1.0);
    for &size in sizes {
        if size <= friction * nearest {
            break;
        }
        sum += friction * size;
        weight += friction * friction;
        nearest = sum / weight;
    }
    nearest.max(0.0)
}

/// One projected gradient step of a contact with De Saxce's shift: the point of the friction cone nearest to
/// (g_n - t m_n (u_n - target + mu |u_t|), g_t - t m_t u_t), nearest in the metric 1/m (theory eqs. 5.36 and 5.37).
#[inline]
pub fn project_step<S: Space>(
    c: &PreparedContact<S>,
    old: &Impulse<S>,
    (speed, slip): (f64, S::Slip),
    step: f64,
    law: FrictionLaw,
) -> Impulse<S> {
    let normal = old.normal - step * c.normal_mass * (speed - c.target);
    if c.friction == 0.0 {
        return Impulse { normal: normal.max(0.0), tangent: S::Slip::ZERO };
    }
    let tangent = old.tangent - slip * (step * c.tangent_mass);
    // lengths in the metric 1/m: tangential ones count `stretch` times
    let stretch = (c.normal_mass * c.inverse_tangent_mass).sqrt();
    let boxed = S::SLIP > 1 && law == FrictionLaw::Box;
    let (shift, sizes) = if boxed {
        let [x, y] = [tangent[0].abs(), tangent[1].abs()];
        (slip[0].abs() + slip[1].abs(), [x.max(y), x.min(y)])
    } else {
        (slip.norm(), [tangent.norm(), 0.0])
    };
    let lowered = normal - step * c.normal_mass * c.friction * shift;
    let sizes = sizes.map(|size| stretch * size);
    let limited = if boxed { &sizes[..] } else { &sizes[..1] };
    let normal = nearest_normal(lowered, limited, stretch * c.friction);
    Impulse { normal, tangent: project_tangent::<S>(tangent, c.friction * normal, law) }
}
