//! Numbers, vectors, rotations and the one trait, [`Space`], over which carom's physics is written
//! once for the plane and for space. Knows no bodies, no shapes and no solver.

pub mod inertia;
pub mod lanes;
pub mod pose;
pub mod record;
pub mod rotation;
pub mod several;
pub mod skew;
pub mod space;
pub mod tuple;
pub mod wide;
pub mod workers;

pub use inertia::{Inertia, Moment, Sym3};
pub use pose::Pose;
pub use record::Record;
pub use rotation::{Quaternion, Rotation, Turn};
pub use several::Several;
pub use space::{Planar, Space, Spatial};
pub use tuple::{Column, Tuple, Vec1, Vec2, Vec3, vec1, vec2, vec3};
pub use wide::{Number, Precise, Wide};
pub use workers::Workers;

/// The exponential function with the same bits on every machine.
pub fn exp(x: f64) -> f64 {
    libm::exp(x)
}

/// The angle of the point (x, y) from the x axis \[rad\] with the same bits on every machine.
pub fn atan2(y: f64, x: f64) -> f64 {
    libm::atan2(y, x)
}
