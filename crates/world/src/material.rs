//! How the coefficients of two bodies become those of their contact (case C20): by mixing, or as a table of named
//! materials says for the pair.

use crate::bodies::Bodies;
use crate::error::BuildError;
use crate::settings::Settings;
use carom_geometry::Geometry;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// A symmetric mean of two coefficients.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Mixing {
    /// The smaller of both.
    Min,
    /// The larger of both.
    Max,
    /// (a + b) / 2.
    Mean,
    /// a b.
    Product,
    /// sqrt(a b).
    Geometric,
    /// 2 a b / (a + b), and 0 when both are 0.
    Harmonic,
}

impl Mixing {
    /// All of them.
    pub const ALL: [Mixing; 6] =
        [Mixing::Min, Mixing::Max, Mixing::Mean, Mixing::Product, Mixing::Geometric, Mixing::Harmonic];
    /// The name as users write it.
    pub fn name(self) -> &'static str {
        match self {
            Mixing::Min => "min",
            Mixing::Max => "max",
            Mixing::Mean => "mean",
            Mixing::Product => "product",
            Mixing::Geometric => "geometric",
            Mixing::Harmonic => "harmonic",
        }
    }
    /// The contact's coefficient from those of its bodies, both >= 0.
    #[inline]
    pub fn mix(self, a: f64, b: f64) -> f64 {
        match self {
            Mixing::Min => a.min(b),
            Mixing::Max => a.max(b),
            Mixing::Mean => 0.5 * (a + b),
            Mixing::Product => a * b,
            // equal coefficients give themselves, not a rounding away from it
            Mixing::Geometric => {
                if a == b {
                    a
                } else {
                    (a * b).sqrt()
                }
            }
            Mixing::Harmonic => {
                if a + b > 0.0 {
                    2.0 * a * b / (a + b)
                } else {
                    0.0
                }
            }
        }
    }
}

/// Coefficients of a pair of materials; what is `None` is mixed from the bodies'.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct MaterialPair {
    /// Coefficient of friction \[1\].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub friction: Option<f64>,
    /// Coefficient of restitution \[1\], in \[0, 1\].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub restitution: Option<f64>,
    /// Coefficient of tangential restitution \[1\], in \[0, 1\].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub tangential_restitution: Option<f64>,
    /// Coefficient of rolling friction \[m\].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rolling_friction: Option<f64>,
    /// Coefficient of spinning friction \[m\].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub spinning_friction: Option<f64>,
}

impl MaterialPair {
    fn check(&self) -> Result<(), BuildError> {
        let fields = [
            ("friction", self.friction, f64::MAX),
            ("restitution", self.restitution, 1.0),
            ("tangential_restitution", self.tangential_restitution, 1.0),
            ("rolling_friction", self.rolling_friction, f64::MAX),
            ("spinning_friction", self.spinning_friction, f64::MAX),
        ];
        for (field, value, most) in fields {
            if let Some(value) = value.filter(|v| !(*v >= 0.0 && *v <= most)) {
                let range = if most == 1.0 { "in [0, 1]" } else { "finite and >= 0" };
                let problem = format!("must be {range}, got {value}");
                return Err(BuildError::setting(field, problem, format!("give a {field} {range}")));
            }
        }
        if fields.iter().all(|(_, value, _)| value.is_none()) {
            let remedy =
                "give friction, restitution, tangential_restitution, rolling_friction or spinning_friction";
            return Err(BuildError::setting("pair", "has no coefficient", remedy));
        }
        Ok(())
    }
}

/// The named materials of a world's bodies, and what was said of pairs of them.
#[derive(Clone, Debug, Default)]
pub struct Materials {
    names: Vec<String>,
    /// By numbers of the names, the smaller first: a pair has no order.
    pairs: BTreeMap<(usize, usize), MaterialPair>,
}

impl Materials {
    /// Number of a name, which becomes known with it.
    pub fn learn(&mut self, name: &str) -> usize {
        self.names.iter().position(|n| n == name).unwrap_or_else(|| {
            self.names.push(name.into());
            self.names.len() - 1
        })
    }
    /// The name of a number.
    pub fn name(&self, number: usize) -> &str {
        &self.names[number]
    }
    /// Sets the coefficients of a pair, in either order, in place of what was said of it before.
    ///
    /// # Errors
    /// [`BuildError`] for a name that no body has, with the nearest that one has, and for a coefficient out of range.
    pub fn set(&mut self, one: &str, other: &str, pair: MaterialPair) -> Result<(), BuildError> {
        let key = self.key(one, other)?;
        pair.check()?;
        self.pairs.insert(key, pair);
        Ok(())
    }
    /// Forgets a pair; true when there was one.
    ///
    /// # Errors
    /// As [`Materials::set`], for the names.
    pub fn remove(&mut self, one: &str, other: &str) -> Result<bool, BuildError> {
        let key = self.key(one, other)?;
        Ok(self.pairs.remove(&key).is_some())
    }
    /// All pairs by their names.
    pub fn pairs(&self) -> impl Iterator<Item = (&str, &str, MaterialPair)> {
        self.pairs.iter().map(|(&(a, b), &pair)| (self.name(a), self.name(b), pair))
    }
    /// What was said of two bodies' materials; `None` where nothing was.
    pub fn said_of(&self, one: Option<usize>, other: Option<usize>) -> Option<&MaterialPair> {
        let (a, b) = one.zip(other).filter(|_| !self.pairs.is_empty())?;
        self.pairs.get(&(a.min(b), a.max(b)))
    }

    fn key(&self, one: &str, other: &str) -> Result<(usize, usize), BuildError> {
        let (a, b) = (self.number(one)?, self.number(other)?);
        Ok((a.min(b), a.max(b)))
    }

    fn number(&self, name: &str) -> Result<usize, BuildError> {
        self.names.iter().position(|n| n == name).ok_or_else(|| {
            let near = crate::bodies::nearest(self.names.iter(), name);
            let remedy =
                near.map_or("give bodies a material first".into(), |n| format!("did you mean '{n}'?"));
            BuildError::setting("material", format!("is unknown: '{name}'"), remedy)
        })
    }
}

/// What two surfaces do to each other.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Coefficients {
    /// Coefficient of friction \[1\].
    pub friction: f64,
    /// Coefficient of rolling friction \[m\].
    pub rolling: f64,
    /// Coefficient of spinning friction \[m\].
    pub spinning: f64,
    /// Coefficient of restitution \[1\].
    pub restitution: f64,
    /// Coefficient of tangential restitution \[1\].
    pub tangential_restitution: f64,
}

impl Coefficients {
    /// Those of a pair of bodies.
    #[inline]
    pub fn of<S: Geometry>(bodies: &Bodies<S>, settings: &Settings<S>, (a, b): (usize, usize)) -> Self {
        let (one, other) = (&bodies.data[a], &bodies.data[b]);
        // what was said of the pair's materials, where something was said of any
        let said = match (one.material, other.material) {
            (Some(_), Some(_)) => bodies.materials.said_of(one.material, other.material),
            _ => None,
        };
        let of = |coefficient: fn(&MaterialPair) -> Option<f64>, mixed: f64| {
            said.and_then(coefficient).unwrap_or(mixed)
        };
        // either body's softness makes the moment: the larger coefficient is the contact's
        let rolling = Mixing::Max.mix(one.rolling_friction, other.rolling_friction);
        let spinning = Mixing::Max.mix(one.spinning_friction, other.spinning_friction);
        let mixing = settings.restitution_mixing;
        let tangential = mixing.mix(one.tangential_restitution, other.tangential_restitution);
        Coefficients {
            friction: of(|p| p.friction, settings.friction_mixing.mix(one.friction, other.friction)),
            rolling: of(|p| p.rolling_friction, rolling),
            spinning: of(|p| p.spinning_friction, spinning),
            restitution: of(|p| p.restitution, mixing.mix(one.restitution, other.restitution)),
            tangential_restitution: of(|p| p.tangential_restitution, tangential),
        }
    }
}
