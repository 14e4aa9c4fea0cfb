//! Bodies that turn freely, without weight and contact (cases C1, C2): the symmetric top and the Dzhanibekov
//! effect.

use crate::stage::weightless;
use carom::{BodySpec, BuildError, Pose, Quaternion, SpatialPart, SpatialShape, World3, vec3};

/// A cylinder with principal moments (.5, .5, .8) kg m^2 that spins at (.3, 0, 5) rad/s: its axis precesses at
/// 8.005623023850 rad/s on a cone of 2.147585 degrees.
///
/// # Errors
/// None is known; those of building a world.
pub fn free_top() -> Result<World3, BuildError> {
    let mut world = World3::new(weightless(1.0 / 240.0))?;
    // I_z = m r^2/2 = .8 and I_x = m (3 r^2 + h^2)/12 = .5
    let cylinder = SpatialShape::Cylinder { height: 0.75_f64.sqrt(), radius: 1.0 };
    world.add("top", BodySpec::heavy(cylinder, 1.6).spinning(vec3(0.3, 0.0, 5.0)))?;
    Ok(world)
}

/// A T-shaped handle spun about its stem, the axis of the intermediate moment: it flips end over end again and
/// again although nothing acts on it.
///
/// # Errors
/// None is known; those of building a world.
pub fn dzhanibekov() -> Result<World3, BuildError> {
    let mut world = World3::new(weightless(1.0 / 240.0))?;
    let part = |x: f64, size: [f64; 3]| SpatialPart {
        pose: Pose::new(vec3(x, 0.0, 0.0), Quaternion::default()),
        shape: SpatialShape::Box { size },
    };
    let parts = vec![part(0.0, [0.02, 0.12, 0.02]), part(0.04, [0.06, 0.02, 0.02])];
    let handle = SpatialShape::Compound { parts };
    world.add("handle", BodySpec::dense(handle, 2700.0).spinning(vec3(10.0, 0.01, 0.0)))?;
    Ok(world)
}
