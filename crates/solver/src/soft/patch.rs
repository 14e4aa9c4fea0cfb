//! What the soft solver is told of a patch of contact, and tells of it.

use carom_math::Wide;

/// A point of a patch.
#[derive(Clone, Copy)]
pub struct PatchPoint<S: Wide> {
    /// Place from the patch's centre along its tangents \[m\].
    pub place: S::Slips<f32>,
    /// Distance of the surfaces at the step's start \[m\].
    pub gap: f32,
    /// Normal impulse of a substep to start from \[N s\].
    pub impulse: f32,
}

/// Points that two bodies share with one normal; unused points have an infinite gap.
#[derive(Clone, Copy)]
pub struct Patch<S: Wide> {
    /// Record of body a.
    pub a: u32,
    /// Record of body b; at most one of both is an obstacle.
    pub b: u32,
    /// Unit normal from b to a.
    pub normal: S::Vectors<f32>,
    /// The patch's centre from a's centre of mass \[m\].
    pub arm_a: S::Vectors<f32>,
    /// The patch's centre from b's centre of mass \[m\].
    pub arm_b: S::Vectors<f32>,
    /// Coefficient of friction \[1\].
    pub friction: f32,
    /// Coefficient of rolling friction \[m\].
    pub rolling: f32,
    /// What friction over the patch and spinning friction bear of a torque about the normal, over the normal
    /// impulse \[m\].
    pub twisting: f32,
    /// Coefficient of restitution \[1\].
    pub restitution: f32,
    /// The points.
    pub points: S::Points<PatchPoint<S>>,
    /// Friction's impulses of a substep to start from: along the tangents \[N s\], and about the normal in
    /// space \[N m s\].
    pub rubbing: S::Spins<f32>,
    /// Rolling friction's moments of a substep to start from, along the tangents \[N m s\].
    pub rolling_moment: S::Slips<f32>,
}

/// What a patch gave in a step, on body a.
#[derive(Clone, Copy)]
pub struct PatchResult<S: Wide> {
    /// Normal impulses of the last substep \[N s\].
    pub last: S::Points<f32>,
    /// Friction's impulses of the last substep.
    pub last_rubbing: S::Spins<f32>,
    /// Rolling friction's moments of the last substep.
    pub last_rolling: S::Slips<f32>,
    /// Normal impulses over the step \[N s\].
    pub normal: S::Points<f32>,
    /// Friction's impulses over the step.
    pub rubbing: S::Spins<f32>,
    /// Rolling friction's moments over the step.
    pub rolling: S::Slips<f32>,
}
