//! One contact between two bodies, solved as it stands: most islands of a world at rest are no more than that, and the
//! general way's preparations would cost more than the solution.

use super::local::Local;
use crate::prepared::PreparedContact;
use crate::problem::{Impulse, Twist};
use carom_math::{Column, Space};

/// Solutions, each from the one before: where a slip's direction is found to first order only, the next has it.
const TIMES: usize = 4;

/// The impulse of a contact whose bodies have these velocities without it; `old` is where its friction is looked for.
pub fn single<S: Space>(
    c: &PreparedContact<S>,
    velocities: &[Twist<S>],
    old: &Impulse<S>,
) -> Option<Impulse<S>> {
    let (normal, slip) = c.relative_velocity(velocities);
    let approach = normal - c.target;
    if c.friction == 0.0 {
        let found = on_normal(approach, c.normal_mass)?;
        return Some(Impulse { normal: found, tangent: S::Slip::ZERO });
    }
    let found = if S::SLIP == 1 {
        solved::<S, 2>(c, [approach, slip[0]], old)
    } else {
        solved::<S, 3>(c, [approach, slip[0], slip[1]], old)
    };
    let finite = found.normal.is_finite() && found.tangent.as_slice().iter().all(|t| t.is_finite());
    finite.then_some(found)
}

/// The impulse of a contact without friction from its approach \[m/s\] and the mass behind its normal \[kg\].
pub fn on_normal(approach: f64, normal_mass: f64) -> Option<f64> {
    let found = (-approach * normal_mass).max(0.0);
    found.is_finite().then_some(found)
}

fn solved<S: Space, const D: usize>(
    c: &PreparedContact<S>,
    velocity: [f64; D],
    old: &Impulse<S>,
) -> Impulse<S> {
    let entry = |i: usize, j: usize| match (i, j) {
        (0, 0) => c.normal.inverse_effective_mass,
        (0, k) | (k, 0) => c.normal_coupling[k - 1],
        (k, l) if k == l => c.tangents[k - 1].inverse_effective_mass,
        _ => c.tangent_coupling,
    };
    let block: [[f64; D]; D] = std::array::from_fn(|i| std::array::from_fn(|j| entry(i, j)));
    let mut local = Local::new(&block, c.friction);
    let mut r: [f64; D] = std::array::from_fn(|k| if k == 0 { old.normal } else { old.tangent[k - 1] });
    if !r.iter().all(|r| r.is_finite()) {
        r = [0.0; D];
    }
    for _ in 0..TIMES {
        let before = r;
        r = local.solve(&velocity, &before);
        if before == r {
            break;
        }
    }
    Impulse { normal: r[0], tangent: S::Slip::from_fn(|k| r[k + 1]) }
}
