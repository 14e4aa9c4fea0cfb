//! From contacts' coefficients to what users gave: by the derivative of the mixing rule to both bodies, or to the
//! entry of the materials' table that says the pair's.

use crate::bodies::Bodies;
use crate::material::Mixing;
use crate::settings::Settings;
use carom_geometry::Geometry;
use std::collections::BTreeMap;

/// Derivatives by an entry of the materials' table.
#[derive(Clone, Debug, PartialEq)]
pub struct PairGradient {
    /// The materials.
    pub materials: (String, String),
    /// By the pair's coefficient of friction \[1\]; 0 where the entry has none.
    pub friction: f64,
    /// By its coefficient of restitution \[1\].
    pub restitution: f64,
}

/// Shares the sums of pairs of bodies (friction, restitution) out to bodies and to the table.
pub fn share<S: Geometry>(
    bodies: &Bodies<S>,
    settings: &Settings<S>,
    pairs: &BTreeMap<(usize, usize), [f64; 2]>,
) -> (Vec<[f64; 2]>, Vec<PairGradient>) {
    let mut own = vec![[0.0; 2]; bodies.len()];
    let entries = bodies.materials.pairs().map(|(a, b, _)| (a.to_string(), b.to_string()));
    let mut table: Vec<PairGradient> =
        entries.map(|materials| PairGradient { materials, friction: 0.0, restitution: 0.0 }).collect();
    for (&(a, b), sums) in pairs {
        let (da, db) = (&bodies.data[a], &bodies.data[b]);
        let said = bodies.materials.said_of(da.material, db.material).copied().unwrap_or_default();
        let names = (bodies.material(a), bodies.material(b));
        let mut entry = table.iter_mut().find(|p| {
            let (one, other) = (Some(p.materials.0.as_str()), Some(p.materials.1.as_str()));
            (one, other) == names || (other, one) == names
        });
        let friction = slopes(settings.friction_mixing, da.friction, db.friction);
        let restitution = slopes(settings.restitution_mixing, da.restitution, db.restitution);
        let kinds = [(said.friction, friction), (said.restitution, restitution)];
        for (kind, (said, (by_a, by_b))) in kinds.into_iter().enumerate() {
            match (said, &mut entry) {
                (Some(_), Some(entry)) if kind == 0 => entry.friction += sums[0],
                (Some(_), Some(entry)) => entry.restitution += sums[1],
                _ => {
                    own[a][kind] += by_a * sums[kind];
                    own[b][kind] += by_b * sums[kind];
                }
            }
        }
    }
    (own, table)
}

/// Derivatives of a mean by both of its coefficients; of the smaller and the larger of two equal ones, half each.
fn slopes(mixing: Mixing, a: f64, b: f64) -> (f64, f64) {
    let first = match a.total_cmp(&b) {
        std::cmp::Ordering::Less => 1.0,
        std::cmp::Ordering::Equal => 0.5,
        std::cmp::Ordering::Greater => 0.0,
    };
    let mean = mixing.mix(a, b);
    match mixing {
        Mixing::Min => (first, 1.0 - first),
        Mixing::Max => (1.0 - first, first),
        Mixing::Mean => (0.5, 0.5),
        Mixing::Product => (b, a),
        // of a coefficient 0 there is no derivative: the mean rises like a root
        Mixing::Geometric if mean > 0.0 => (0.5 * b / mean, 0.5 * a / mean),
        Mixing::Harmonic if mean > 0.0 => {
            let sum = a + b;
            (2.0 * b * b / (sum * sum), 2.0 * a * a / (sum * sum))
        }
        _ => (0.0, 0.0),
    }
}

#[cfg(test)]
mod tests {
    use super::slopes;
    use crate::material::Mixing;

    #[test]
    fn mixing_rules_have_the_derivatives_that_differences_show() {
        let (a, b, h) = (0.3, 0.7, 1e-6);
        for mixing in Mixing::ALL {
            let (by_a, by_b) = slopes(mixing, a, b);
            let one = (mixing.mix(a + h, b) - mixing.mix(a - h, b)) / (2.0 * h);
            let other = (mixing.mix(a, b + h) - mixing.mix(a, b - h)) / (2.0 * h);
            assert!((by_a - one).abs() < 1e-9 && (by_b - other).abs() < 1e-9, "{}", mixing.name());
        }
    }
}
