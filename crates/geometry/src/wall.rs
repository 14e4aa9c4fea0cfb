//! Walls: obstacles without convex pieces, whose gap to a point is known in closed form. A half-space, and a cavity:
//! everything farther from a centre than a radius. Knows no pairs.

use crate::collider::Form;
use crate::kernel::{Kernel, Ring};
use carom_math::{Column, Pose, Rotation};

/// Distance from the centre of a cavity below which a point has no direction, as a fraction of the radius \[1\].
const NO_DIRECTION: f64 = 1e-14;

/// A posed wall, world axes.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Wall<S: Kernel> {
    /// Outward unit normal and a point of the plane.
    Flat { normal: S::Vector, point: S::Vector },
    /// Centre and radius \[m\] of what is hollow.
    Hollow { center: S::Vector, radius: f64 },
}

/// What a wall says of a point.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Facing<S: Kernel> {
    /// Distance from the wall \[m\].
    pub gap: f64,
    /// Unit normal there, out of the wall.
    pub outward: S::Vector,
    /// Curvature with which the wall bends toward the point \[1/m\]: a straight way of speed v loses as much as half of
    /// it times (v t)^2 of its gap beyond what the normal velocity says, and never more.
    pub curvature: f64,
}

impl<S: Kernel> Wall<S> {
    /// The wall that a form is at a pose, if it is one.
    pub fn of(form: &Form<S>, pose: &Pose<S>) -> Option<Self> {
        match form {
            Form::HalfSpace(normal) => {
                Some(Wall::Flat { normal: pose.rotation.rotate(*normal), point: pose.position })
            }
            Form::Cavity(radius) => Some(Wall::Hollow { center: pose.position, radius: *radius }),
            _ => None,
        }
    }

    /// The point from which offsets are counted.
    pub fn origin(&self) -> S::Vector {
        match self {
            Wall::Flat { point, .. } => *point,
            Wall::Hollow { center, .. } => *center,
        }
    }

    /// What the wall says of a point at an offset \[m\] from its origin.
    pub fn facing(&self, offset: S::Vector) -> Facing<S> {
        match self {
            Wall::Flat { normal, .. } => Facing { gap: normal.dot(offset), outward: *normal, curvature: 0.0 },
            Wall::Hollow { radius, .. } => {
                let distance = offset.norm();
                let somewhere = S::Vector::from_fn(|k| if k == 0 { -1.0 } else { 0.0 });
                let has_direction = distance > NO_DIRECTION * radius;
                let outward = if has_direction { offset * (-1.0 / distance) } else { somewhere };
                let curvature = 1.0 / distance.max(NO_DIRECTION * radius);
                Facing { gap: radius - distance, outward, curvature }
            }
        }
    }

    /// The points of a core that the wall may meet, with their names; the pose is the core's.
    pub fn met_by(&self, core: &S::Core, pose: &Pose<S>, out: &mut Ring<S>) {
        match self {
            Wall::Flat { normal, .. } => S::feature(core, pose.rotation.unrotate(-*normal), out),
            Wall::Hollow { center, .. } => S::corners(core, pose.to_body(*center), out),
        }
    }

    /// The point of a core that is nearest to the wall, in the core's frame.
    pub fn nearest_of(&self, core: &S::Core, pose: &Pose<S>) -> S::Vector {
        match self {
            Wall::Flat { normal, .. } => S::support(core, pose.rotation.unrotate(-*normal)).0,
            Wall::Hollow { center, .. } => {
                let from = pose.to_body(*center);
                let mut corners = Ring::<S>::default();
                S::corners(core, from, &mut corners);
                let farther = |best: S::Vector, p: S::Vector| {
                    if (p - from).norm() > (best - from).norm() { p } else { best }
                };
                corners.iter().map(|c| c.0).reduce(farther).unwrap_or(S::Vector::ZERO)
            }
        }
    }
}
