//! How the coefficients of two bodies become those of their contact (case C20).

use serde::{Deserialize, Serialize};

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
    /// The contact's coefficient from those of its bodies, both >= 0.
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
