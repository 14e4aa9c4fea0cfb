//! carom: rigid bodies in the plane and in space, in f64, that certify what they compute.
//!
//! A [`World`] holds bodies and settings and takes steps; every step reports the residual of its contact
//! solves, where its energy went, and whether the books close. `World2` and `World3` are the two doors.

pub mod abreast;
pub mod ahead;
pub mod assembly;
pub mod bodies;
pub mod body;
mod columns;
pub mod contact_id;
pub mod correction;
pub mod error;
mod flight;
pub mod force;
pub mod gradient;
mod halting;
pub mod impact;
pub mod integrate;
pub mod joint;
mod lasting;
pub mod material;
mod meeting;
pub mod mid_step;
pub mod narrow_phase;
mod nears;
pub mod observe;
mod remembered;
pub mod settings;
pub mod sleep;
pub mod snapshot;
pub mod stepping;
pub mod warm_start;
pub mod world;

pub use bodies::{Bodies, BodyData, Motion};
pub use body::{BodyKind, BodySpec, MassSource};
pub use carom_geometry::{
    self as geometry, Geometry, MassProperties, PlanarPart, PlanarShape, ShapeError, SpatialPart,
    SpatialShape,
};
pub use carom_math::{
    self as math, Column, Inertia, Moment, Planar, Pose, Quaternion, Rotation, Space, Spatial, Sym3, Turn,
    Vec1, Vec2, Vec3, vec1, vec2, vec3,
};
pub use carom_solver::{
    self as solver, Certificate, Contact, ContactProblem, FrictionLaw, ImpulseChoice, ImpulseSolver,
    Impulses, IslandReport, Outcome, Progress, SolveSettings, SolverKind, StageReport, Stages, Stop, Twist,
    Watch, unwatched,
};
pub use error::{BuildError, StepError};
pub use force::{ForceField, Wrench};
pub use integrate::Integrator;
pub use joint::{Anchor, Joint, JointKind, JointSpec, Joints, Reaction};
pub use material::{MaterialPair, Mixing};
pub use narrow_phase::Touch;
pub use observe::accounts::{Account, MomentumLedger};
pub use observe::energy::{Energy, Momenta};
pub use observe::event_log::{ContactSum, EventKind, EventLog, EventRecord, Piece, PieceKind};
pub use observe::explain::{Explanation, Finding, Topic};
pub use observe::groups::{GroupReport, LedgerGroup};
pub use observe::ledger::Ledger;
pub use observe::report::{Events, ImpactReport, SolveReport, StepReport};
pub use observe::step_times::StepTimes;
pub use settings::{
    EnergyGuard, EventSettings, ImpactLaw, OnInaccurate, PlasticArrivals, PositionCorrection, Scheme,
    Settings, SoftSettings,
};
pub use world::{Phase, World, World2, World3};
