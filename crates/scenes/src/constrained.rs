//! Two bodies that guide each other (cases C22, C23, C25): a block on a sliding wedge, a ball in a bowl, a load on
//! a table with four legs.

use crate::stage::{Stage, settings};
use carom::{
    BodySpec, BuildError, Planar, PlanarShape, Pose, Quaternion, Rotation, Spatial, SpatialPart,
    SpatialShape, Turn, World, World2, World3, vec2, vec3,
};

/// A 1 kg block on the slope of a 3 kg wedge that is free to slide, all without friction. For 30 degrees the wedge
/// accelerates at 1.307032 m/s^2 and the block at 6.036923 m/s^2 relative to it.
///
/// # Errors
/// [`BuildError`] for an angle that leaves the wedge without volume.
pub fn wedge<S: Stage>(angle: f64) -> Result<World<S>, BuildError> {
    let mut world = World::new(settings::<S>(1.0 / 240.0))?;
    world.add("floor", BodySpec::fixed(S::ground(0.0)).friction(0.0))?;
    let [c, s] = Turn::from_angle(angle).0;
    let length = 3.0;
    let triangle = S::prism(&[(0.0, 0.0), (length * c, 0.0), (length * c, length * s)], 0.5);
    world.add("wedge", BodySpec::heavy(triangle, 3.0).with_origin_at(S::place(0.0, 0.0)).friction(0.0))?;
    let rotation = S::lean(angle);
    let block = BodySpec::heavy(S::block(0.2, 0.2, 0.2), 1.0).at(rotation.rotate(S::place(2.5, 0.1)));
    world.add("block", block.turned(rotation).friction(0.0))?;
    Ok(world)
}

/// Radius of the bowl \[m\].
pub const BOWL: f64 = 1.0;
/// Radius of the ball in it \[m\].
pub const BALL: f64 = 0.1;

/// A disc released at rest `angle` \[rad\] off the bottom of a round valley, in which it rolls to and fro; small
/// swings take 2 pi sqrt(3/2 (R - r)/g) = 2.330839 s. The valley is a chain of pieces .0025 rad long; at each seam
/// the disc loses the share .0025^2 of its energy, which is the law of impact and not an error of the step.
///
/// # Errors
/// None is known; those of building a world.
pub fn bowl_planar(angle: f64) -> Result<World2, BuildError> {
    let (pieces, half) = (960, 1.2);
    let piece = 2.0 * half / f64::from(pieces);
    let points = (0..=pieces).map(|k| {
        let [c, s] = Turn::from_angle(f64::from(k) * piece - half).0;
        vec2(BOWL * s, -BOWL * c)
    });
    swing::<Planar>(PlanarShape::Polyline { points: points.collect(), closed: false }, angle)
}

/// A ball released at rest `angle` \[rad\] off the bottom of a spherical bowl made of triangles about 1 cm wide; small
/// swings take 2 pi sqrt(7/5 (R - r)/g) = 2.251804 s.
///
/// # Errors
/// None is known; those of building a world.
pub fn bowl_spatial(angle: f64) -> Result<World3, BuildError> {
    let (cells, half) = (80u32, 0.4);
    let at = |k: u32| half * (2.0 * f64::from(k) / f64::from(cells) - 1.0);
    let name = |i: u32, j: u32| j * (cells + 1) + i;
    let mut vertices = Vec::new();
    let mut triangles = Vec::new();
    for j in 0..=cells {
        for i in 0..=cells {
            let (x, y) = (at(i), at(j));
            vertices.push(vec3(x, y, -(BOWL * BOWL - x * x - y * y).sqrt()));
            if i < cells && j < cells {
                triangles.push([name(i, j), name(i + 1, j), name(i + 1, j + 1)]);
                triangles.push([name(i, j), name(i + 1, j + 1), name(i, j + 1)]);
            }
        }
    }
    swing::<Spatial>(SpatialShape::TriMesh { vertices, triangles }, angle)
}

fn swing<S: Stage>(bowl: S::Shape, angle: f64) -> Result<World<S>, BuildError> {
    let mut world = World::new(settings::<S>(1.0 / 480.0))?;
    world.add("bowl", BodySpec::fixed(bowl).friction(0.8))?;
    // the flat pieces reach inside the round bowl by less than this
    let clearance = 2e-5 * BOWL;
    let place = S::lean(angle).rotate(S::place(0.0, -(BOWL - BALL - clearance)));
    world.add("ball", BodySpec::dense(S::ball(BALL), 1000.0).at(place).friction(0.8))?;
    Ok(world)
}

/// A table of 4 kg on four round legs at (+-1, +-1) m, and a load of `load` \[kg\] set down at (x, y) \[m\]. The legs
/// carry any of many sets of forces with the same sum and moments; the one of least norm adds to each leg's share
/// of the table load g (1 + x x_i + y y_i)/4.
///
/// # Errors
/// [`BuildError`] for a load that is not positive.
pub fn four_leg_table(load: f64, x: f64, y: f64) -> Result<World3, BuildError> {
    let mut world = World3::new(settings::<Spatial>(1.0 / 240.0))?;
    world.add("floor", BodySpec::fixed(Spatial::ground(0.0)))?;
    let (radius, length, top) = (0.05, 0.6, 0.1);
    let part = |x: f64, y: f64, z: f64, shape: SpatialShape| SpatialPart {
        pose: Pose::new(vec3(x, y, z), Quaternion::default()),
        shape,
    };
    let mut parts = vec![part(0.0, 0.0, 2.0 * radius + length + 0.5 * top, Spatial::block(2.4, top, 2.4))];
    for (leg_x, leg_y) in [(1.0, 1.0), (-1.0, 1.0), (-1.0, -1.0), (1.0, -1.0)] {
        let leg = SpatialShape::Capsule { length, radius };
        parts.push(part(leg_x, leg_y, radius + 0.5 * length, leg));
    }
    let table = BodySpec::heavy(SpatialShape::Compound { parts }, 4.0).with_origin_at(vec3(0.0, 0.0, 0.0));
    world.add("table", table)?;
    let size = 0.2;
    let height = 2.0 * radius + length + top + 0.5 * size;
    world.add("load", BodySpec::heavy(Spatial::block(size, size, size), load).at(vec3(x, y, height)))?;
    Ok(world)
}
