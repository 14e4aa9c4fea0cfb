//! A row of dominoes that fall one after another.

use crate::stage::{Stage, settings};
use carom::{BodySpec, BuildError, Quaternion, Rotation, Settings, Spatial, Turn, World3, vec3};

/// Thickness, width and height of a domino \[m\].
const SIZE: [f64; 3] = [0.008, 0.024, 0.048];
/// Distance of neighbours along the row \[m\].
const SPACING: f64 = 0.022;

/// `count` dominoes along a winding row, the first one tipped over at the start.
///
/// # Errors
/// None is known; those of building a world.
pub fn dominoes(count: usize) -> Result<World3, BuildError> {
    let mut world = World3::new(Settings { iterations: 200, ..settings::<Spatial>(1.0 / 480.0) })?;
    world.add("table", BodySpec::fixed(Spatial::ground(0.0)).friction(0.6))?;
    let mut place = vec3(0.0, 0.0, 0.5 * SIZE[2]);
    for k in 0..count {
        // the heading swings to and fro by .7 rad every 24 dominoes
        let heading = 0.7 * Turn::from_angle(std::f64::consts::TAU * k as f64 / 24.0).0[1];
        let rotation = Quaternion::from_axis_angle(vec3(0.0, 0.0, 1.0), heading);
        let ahead = rotation.rotate(vec3(1.0, 0.0, 0.0));
        let spec = BodySpec::dense(Spatial::block(SIZE[0], SIZE[2], SIZE[1]), 1200.0).friction(0.4);
        let mut spec = spec.at(place).turned(rotation);
        if k == 0 {
            // falling forwards about its lower front edge
            let spin = rotation.rotate(vec3(0.0, 8.0, 0.0));
            let arm = vec3(0.0, 0.0, 0.5 * SIZE[2]) - ahead * (0.5 * SIZE[0]);
            spec = spec.moving(spin.cross(arm)).spinning(spin);
        }
        world.add(&format!("domino{k}"), spec)?;
        place += ahead * SPACING;
    }
    Ok(world)
}
