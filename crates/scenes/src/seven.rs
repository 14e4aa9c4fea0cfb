//! The notes' seven objects between fixed walls: the example whose matrix A they draw.

use crate::stage::{Stage, settings};
use carom::{BodySpec, BuildError, Planar, PlanarShape, World2, vec2};

/// Seven objects of different shapes fall a hand's breadth and settle on a floor between two walls, so that chains
/// of contacts run from wall to wall.
///
/// # Errors
/// None is known; those of building a world.
pub fn seven_objects() -> Result<World2, BuildError> {
    let mut world = World2::new(settings::<Planar>(1.0 / 240.0))?;
    let half = 1.6;
    world.add("floor", BodySpec::fixed(Planar::ground(0.0)))?;
    world.add("left wall", BodySpec::fixed(Planar::wall(1.0)).at(vec2(-half, 0.0)))?;
    world.add("right wall", BodySpec::fixed(Planar::wall(-1.0)).at(vec2(half, 0.0)))?;
    let regular = |corners: u32, radius: f64| {
        let corner = |k: u32| {
            let [c, s] = carom::Turn::from_angle(std::f64::consts::TAU * f64::from(k) / f64::from(corners)).0;
            vec2(radius * c, radius * s)
        };
        PlanarShape::ConvexPolygon { points: (0..corners).map(corner).collect() }
    };
    let objects = [
        ("crate", Planar::block(0.9, 0.9, 1.0), -1.1, 0.5, 0.0),
        ("disc", Planar::ball(0.4), -0.15, 0.45, 0.0),
        ("beam", Planar::block(1.2, 0.5, 1.0), 0.95, 0.3, 0.0),
        ("hexagon", regular(6, 0.45), -0.8, 1.45, 0.1),
        ("capsule", PlanarShape::Capsule { length: 0.6, radius: 0.2 }, 0.2, 1.15, 0.3),
        ("triangle", regular(3, 0.5), 1.1, 1.1, 0.4),
        ("stone", PlanarShape::RoundBox { size: [0.5, 0.3], radius: 0.1 }, 0.1, 1.8, -0.2),
    ];
    for (name, shape, x, y, angle) in objects {
        world.add(name, BodySpec::dense(shape, 1000.0).at(vec2(x, y)).turned(Planar::lean(angle)))?;
    }
    Ok(world)
}
