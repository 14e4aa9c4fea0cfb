//! The friction impulse of one contact at a given normal impulse: the s inside the limit that minimises
//! s.W_tt s / 2 + w.s, w the slip without it. That is Coulomb's law, sticking (theory eq. 3.16) or sliding (3.17);
//! for the box law each component has its own limit (5.20). Knows no bodies.

use crate::prepared::PreparedContact;
use crate::problem::FrictionLaw;
use carom_math::{Column, Space};

/// Most Newton steps on the secular equation; four or five reach rounding.
const NEWTON_STEPS: usize = 30;

/// The friction impulse that a contact with slip `slip` gets at the limit mu gamma_n = `limit`.
pub fn friction_impulse<S: Space>(
    c: &PreparedContact<S>,
    slip: S::Slip,
    limit: f64,
    law: FrictionLaw,
) -> S::Slip {
    let first = c.tangents[0].inverse_effective_mass;
    if S::SLIP == 1 {
        let stick = if first > 0.0 { -slip[0] / first } else { 0.0 };
        return S::Slip::from_fn(|_| stick.max(-limit).min(limit));
    }
    let matrix = [first, c.tangent_coupling, c.tangents[1].inverse_effective_mass];
    let s = match law {
        FrictionLaw::Disc => in_disc(matrix, [slip[0], slip[1]], limit),
        FrictionLaw::Box => in_box(matrix, [slip[0], slip[1]], limit),
    };
    S::Slip::from_fn(|k| s[k])
}

/// argmin s.K s / 2 + w.s over |s| <= limit, K = [[a, b], [b, d]]: inside, or (K + alpha 1) s = -w on the rim
/// with the root alpha > 0 of 1/|s(alpha)| = 1/limit (Moré and Sorensen 1983).
fn in_disc([a, b, d]: [f64; 3], w: [f64; 2], limit: f64) -> [f64; 2] {
    let size = (w[0] * w[0] + w[1] * w[1]).sqrt();
    if size == 0.0 || limit <= 0.0 {
        return [0.0; 2];
    }
    let shifted = |alpha: f64| {
        let (a, d) = (a + alpha, d + alpha);
        let determinant = a * d - b * b;
        [(b * w[1] - d * w[0]) / determinant, (b * w[0] - a * w[1]) / determinant]
    };
    let length = |s: [f64; 2]| (s[0] * s[0] + s[1] * s[1]).sqrt();
    let stick = shifted(0.0);
    if length(stick) <= limit {
        return stick;
    }
    // the root lies between the bounds from the largest and the smallest eigenvalue of K
    let spread = (0.25 * (a - d) * (a - d) + b * b).sqrt();
    let mut alpha = (size / limit - 0.5 * (a + d) - spread).max(0.0);
    for _ in 0..NEWTON_STEPS {
        let s = shifted(alpha);
        let at = length(s);
        // d|s|/d alpha = -s.(K + alpha)^-1 s / |s|
        let (a, d) = (a + alpha, d + alpha);
        let slope = (d * s[0] * s[0] - 2.0 * b * s[0] * s[1] + a * s[1] * s[1]) / ((a * d - b * b) * at * at);
        let step = (at / limit - 1.0) / slope;
        let next = (alpha + step).max(0.0);
        let moved = (next - alpha).abs();
        alpha = next;
        if moved.is_nan() || moved <= 4.0 * f64::EPSILON * alpha {
            break;
        }
    }
    let s = shifted(alpha);
    let onto_rim = limit / length(s);
    if onto_rim.is_finite() {
        [s[0] * onto_rim, s[1] * onto_rim]
    } else {
        [-w[0] * limit / size, -w[1] * limit / size]
    }
}

/// argmin s.K s / 2 + w.s over |s_k| <= limit: the least of the free minimum and the minima of the four edges.
fn in_box([a, b, d]: [f64; 3], w: [f64; 2], limit: f64) -> [f64; 2] {
    let clamp = |x: f64| if x.is_nan() { 0.0 } else { x.max(-limit).min(limit) };
    let cost = |s: [f64; 2]| {
        0.5 * (a * s[0] * s[0] + 2.0 * b * s[0] * s[1] + d * s[1] * s[1]) + w[0] * s[0] + w[1] * s[1]
    };
    let determinant = a * d - b * b;
    let free = [(b * w[1] - d * w[0]) / determinant, (b * w[0] - a * w[1]) / determinant];
    if free.iter().all(|x| x.abs() <= limit) {
        return free;
    }
    let across = |x: f64| [x, clamp(-(w[1] + b * x) / d)];
    let along = |y: f64| [clamp(-(w[0] + b * y) / a), y];
    let edges = [across(-limit), across(limit), along(-limit), along(limit)];
    edges.into_iter().min_by(|s, t| cost(*s).total_cmp(&cost(*t))).expect("four edges")
}
