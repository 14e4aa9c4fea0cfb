//! How a contact problem departs from bodies at rest: weight, random velocities, shear, displaced bodies, friction.

/// One variant of a contact problem; equal variants of equal scenes have the same bits.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Variation {
    /// Seed of all random numbers.
    pub seed: u64,
    /// Time that gravity has acted on the velocities \[s\].
    pub time_step: f64,
    /// Gravity along the last axis, downward when positive \[m/s^2\].
    pub gravity: f64,
    /// Largest random velocity of a body per component \[m/s\]; of its spin in rad/s.
    pub speed: f64,
    /// Velocity along x per metre of height \[1/s\].
    pub shear: f64,
    /// Largest random displacement of a body's centre per component, as a fraction of its size \[1\]; contacts of
    /// flat faces stay where they are, balls touch on the line between their centres.
    pub jitter: f64,
    /// Smallest and largest coefficient of friction \[1\], drawn evenly for each contact.
    pub friction: [f64; 2],
}

impl Default for Variation {
    /// At rest but for a hundredth of a second of weight: friction .1 to .8.
    fn default() -> Self {
        Variation {
            seed: 1,
            time_step: 0.01,
            gravity: 9.81,
            speed: 0.0,
            shear: 0.0,
            jitter: 0.0,
            friction: [0.1, 0.8],
        }
    }
}

impl Variation {
    /// Weight alone.
    pub fn at_rest(seed: u64) -> Self {
        Variation { seed, ..Variation::default() }
    }
    /// Weight and small random velocities \[m/s\], a tenth of what gravity adds.
    pub fn perturbed(seed: u64) -> Self {
        Variation { seed, speed: 0.01, ..Variation::default() }
    }
    /// Perturbed, and the upper bodies run sideways.
    pub fn sheared(seed: u64) -> Self {
        Variation { shear: 0.2, ..Variation::perturbed(seed) }
    }
    /// Perturbed, with bodies out of their places by up to a twentieth of their size.
    pub fn jittered(seed: u64) -> Self {
        Variation { jitter: 0.05, ..Variation::perturbed(seed) }
    }
    /// The four kinds by name.
    pub fn all(seed: u64) -> [(&'static str, Variation); 4] {
        [
            ("rest", Variation::at_rest(seed)),
            ("perturbed", Variation::perturbed(seed)),
            ("sheared", Variation::sheared(seed)),
            ("jittered", Variation::jittered(seed)),
        ]
    }
    /// The same with one friction at all contacts \[1\].
    #[must_use]
    pub fn with_friction(self, friction: f64) -> Self {
        Variation { friction: [friction, friction], ..self }
    }
}
