//! What a solver and a stepper must know of the plane and of space, and nothing else.
//! Physics is written once over `Space`; `Planar` and `Spatial` are its two instances (docs/adr/0001).

use crate::inertia::{Inertia, Moment, Sym3};
use crate::rotation::{Quaternion, Rotation, Turn};
use crate::tuple::{Column, Tuple, Vec1, Vec2, Vec3, vec1, vec2, vec3};
use crate::wide::Wide;
use serde::{Deserialize, Serialize};
use std::fmt::Debug;

/// The plane or space.
pub trait Space: Wide + Copy + Debug + Default + PartialEq + Send + Sync + 'static {
    /// Positions, velocities, forces: 2 | 3 numbers.
    type Vector: Column;
    /// Angular velocities, torques, angular momenta: 1 | 3 numbers.
    type Spin: Column;
    /// Tangential velocities and impulses in a contact frame: 1 | 2 numbers.
    type Slip: Column;
    /// Orientation of a body.
    type Rotation: Rotation<Self::Vector, Self::Spin>;
    /// Inertia or inverse inertia about the centre of mass.
    type Inertia: Inertia<Self::Spin>;
    /// Name used in files and messages: "planar" | "spatial".
    const NAME: &'static str;
    /// Dimension: 2 | 3.
    const DIM: usize;
    /// Numbers in a spin: 1 | 3.
    const SPIN: usize;
    /// Numbers in a slip: 1 | 2.
    const SLIP: usize;
    /// Degrees of freedom of a body: 3 | 6.
    const DOF: usize;
    /// r x f: torque of a force at an arm (theory eq. 1.34).
    fn moment(arm: Self::Vector, force: Self::Vector) -> Self::Spin;
    /// w x r: velocity of an arm's tip (theory eq. 1.9).
    fn swing(spin: Self::Spin, arm: Self::Vector) -> Self::Vector;
    /// w x L: the gyroscopic torque's vector product; zero in the plane.
    fn spin_cross(a: Self::Spin, b: Self::Spin) -> Self::Spin;
    /// The `k`-th unit tangent of a contact with this unit normal, k < SLIP; normal and tangents
    /// form a right-handed orthonormal frame that depends on the normal alone.
    fn tangent(normal: Self::Vector, k: usize) -> Self::Vector;
    /// R I R^T: inertia in world axes from inertia in body axes.
    fn turned(inertia: &Self::Inertia, rotation: &Self::Rotation) -> Self::Inertia;
    /// m (|r|^2 1 - r r^T): what a point mass at `arm` adds to an inertia (Steiner).
    fn steiner(mass: f64, arm: Self::Vector) -> Self::Inertia;
    /// Principal moments, ascending, and the rotation whose columns are the principal axes.
    fn principal(inertia: &Self::Inertia) -> (Self::Spin, Self::Rotation);
}

/// The plane.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Planar;

/// Space.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Spatial;

impl Space for Planar {
    type Vector = Vec2;
    type Spin = Vec1;
    type Slip = Vec1;
    type Rotation = Turn;
    type Inertia = Moment;
    const NAME: &'static str = "planar";
    const DIM: usize = 2;
    const SPIN: usize = 1;
    const SLIP: usize = 1;
    const DOF: usize = 3;
    #[inline]
    fn moment(arm: Vec2, force: Vec2) -> Vec1 {
        vec1(arm.cross(force))
    }
    #[inline]
    fn swing(spin: Vec1, arm: Vec2) -> Vec2 {
        vec2(-spin.0[0] * arm.0[1], spin.0[0] * arm.0[0])
    }
    fn spin_cross(_: Vec1, _: Vec1) -> Vec1 {
        vec1(0.0)
    }
    #[inline]
    fn tangent(normal: Vec2, _: usize) -> Vec2 {
        Tuple(Self::tangents(&normal.0)[0])
    }
    fn turned(inertia: &Moment, _: &Turn) -> Moment {
        *inertia
    }
    fn steiner(mass: f64, arm: Vec2) -> Moment {
        Moment(mass * arm.norm_squared())
    }
    fn principal(inertia: &Moment) -> (Vec1, Turn) {
        (vec1(inertia.0), Turn::IDENTITY)
    }
}

impl Space for Spatial {
    type Vector = Vec3;
    type Spin = Vec3;
    type Slip = Vec2;
    type Rotation = Quaternion;
    type Inertia = Sym3;
    const NAME: &'static str = "spatial";
    const DIM: usize = 3;
    const SPIN: usize = 3;
    const SLIP: usize = 2;
    const DOF: usize = 6;
    #[inline]
    fn moment(arm: Vec3, force: Vec3) -> Vec3 {
        arm.cross(force)
    }
    #[inline]
    fn swing(spin: Vec3, arm: Vec3) -> Vec3 {
        spin.cross(arm)
    }
    #[inline]
    fn spin_cross(a: Vec3, b: Vec3) -> Vec3 {
        a.cross(b)
    }
    #[inline]
    fn tangent(normal: Vec3, k: usize) -> Vec3 {
        let [first, second] = Self::tangents(&normal.0);
        Tuple(if k == 0 { first } else { second })
    }
    #[inline]
    fn turned(inertia: &Sym3, rotation: &Quaternion) -> Sym3 {
        if inertia.is_isotropic() { *inertia } else { inertia.conjugated(&rotation.matrix()) }
    }
    fn steiner(mass: f64, arm: Vec3) -> Sym3 {
        let [x, y, z] = arm.0;
        Sym3 {
            diagonal: [mass * (y * y + z * z), mass * (x * x + z * z), mass * (x * x + y * y)],
            off: [-mass * x * y, -mass * x * z, -mass * y * z],
        }
    }
    fn principal(inertia: &Sym3) -> (Vec3, Quaternion) {
        if inertia.off == [0.0; 3] {
            return (
                vec3(inertia.diagonal[0], inertia.diagonal[1], inertia.diagonal[2]),
                Quaternion::IDENTITY,
            );
        }
        let (values, axes) = inertia.eigen();
        (vec3(values[0], values[1], values[2]), Quaternion::from_matrix(&axes))
    }
}
