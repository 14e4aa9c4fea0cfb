//! What a contact is to the impacts of a step: the speeds and lengths that tell kinds of contact apart
//! (theory eqs. 4.14, 4.15 and 6.3). Knows no bodies.

/// Speeds and lengths that tell kinds of contact apart, for one step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Thresholds {
    /// Impacts slower than this do not bounce \[m/s\].
    pub rest_speed: f64,
    /// The same for elastic ones, restitution 1 \[m/s\].
    pub elastic_rest_speed: f64,
    /// Approaches slower than this are the solver's noise \[m/s\].
    pub still_speed: f64,
    /// Plastic approaches slower than this do not make an impact phase necessary \[m/s\].
    pub call_speed: f64,
    /// Gaps up to this count as touching \[m\].
    pub touching: f64,
    /// Length of the step \[s\]; not read where nothing is apart.
    pub dt: f64,
    /// True where no approach above `still_speed` may be left: rounds go on until there is none, and the last is
    /// plastic. A fixed step leaves slow approaches to its kick and fast ones to the next step.
    pub thorough: bool,
}

/// What a contact is to this step.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Role {
    /// Arrives within the step, or touches already, and fast enough to bounce.
    Bounces,
    /// Ends its approach within the step without a bounce, or rests.
    Holds,
    /// Approaches fast enough to bounce, but arrives in a later step: left alone until then.
    Pending,
}

impl Thresholds {
    /// The role of a contact from its gap and normal velocity.
    pub fn role(&self, gap: f64, normal_velocity: f64, restitution: f64) -> Role {
        let rest_speed = if restitution >= 1.0 { self.elastic_rest_speed } else { self.rest_speed };
        let fast = restitution > 0.0 && -normal_velocity > rest_speed.max(self.still_speed);
        match (fast, gap <= self.touching || gap + self.dt * normal_velocity < 0.0) {
            (true, true) => Role::Bounces,
            (true, false) => Role::Pending,
            _ => Role::Holds,
        }
    }
    /// Normal velocity that closes a gap within the step and no more \[m/s\].
    pub fn closing(&self, gap: f64) -> f64 {
        if gap > 0.0 { -gap / self.dt } else { -0.0 }
    }
}
