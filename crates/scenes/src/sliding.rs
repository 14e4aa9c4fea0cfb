//! Friction on level and sloping ground (cases C14-C18): sliding block, rolling ball, incline, conveyor.

use crate::stage::{Stage, settings};
use carom::{BodySpec, BuildError, Mixing, Settings, World};

/// A flat block launched at `speed` \[m/s\] on a floor with this friction \[1\]: it stops after speed/(mu g)
/// seconds and speed^2/(2 mu g) metres.
///
/// # Errors
/// [`BuildError`] for a negative friction.
pub fn sliding_block<S: Stage>(speed: f64, friction: f64) -> Result<World<S>, BuildError> {
    let mut world = World::new(settings::<S>(1.0 / 240.0))?;
    world.add("floor", BodySpec::fixed(S::ground(0.0)).friction(friction))?;
    let block = BodySpec::dense(S::block(1.0, 0.2, 0.5), 1000.0).at(S::place(0.0, 0.1));
    world.add("block", block.moving(S::place(speed, 0.0)).friction(friction))?;
    Ok(world)
}

/// A ball launched without spin at `speed` \[m/s\]: it slides until it rolls, a ball then at 5/7, a disc at 2/3 of
/// that speed.
///
/// # Errors
/// [`BuildError`] for a negative friction.
pub fn rolling_ball<S: Stage>(speed: f64, friction: f64) -> Result<World<S>, BuildError> {
    let mut world = World::new(settings::<S>(1.0 / 240.0))?;
    world.add("floor", BodySpec::fixed(S::ground(0.0)).friction(friction))?;
    let ball = BodySpec::dense(S::ball(0.25), 1000.0).at(S::place(0.0, 0.25));
    world.add("ball", ball.moving(S::place(speed, 0.0)).friction(friction))?;
    Ok(world)
}

/// Two blocks at rest on a slope of `angle` \[rad\], one with a little more friction than tan(angle), which stays
/// for ever, and one with a little less, which slides down at g (sin - mu cos). Friction \[1\] in this order.
///
/// # Errors
/// [`BuildError`] for a negative friction.
pub fn incline<S: Stage>(angle: f64, frictions: [f64; 2]) -> Result<World<S>, BuildError> {
    // the block's own coefficient counts
    let mut world = World::new(Settings { friction_mixing: Mixing::Min, ..settings::<S>(1.0 / 240.0) })?;
    world.add("slope", BodySpec::fixed(S::ground(angle)).friction(2.0))?;
    let rotation = S::lean(angle);
    for (name, along, friction) in [("holds", 0.5, frictions[0]), ("slides", -0.5, frictions[1])] {
        let place = carom::Rotation::rotate(&rotation, S::place(along, 0.1));
        let block = BodySpec::dense(S::block(0.4, 0.2, 0.3), 1000.0).at(place).turned(rotation);
        world.add(name, block.friction(friction))?;
    }
    Ok(world)
}

/// A block set down at rest on a belt that runs at `speed` \[m/s\]: it is dragged along for speed/(mu g) seconds
/// and then rides with the belt.
///
/// # Errors
/// [`BuildError`] for a negative friction.
pub fn conveyor<S: Stage>(speed: f64, friction: f64) -> Result<World<S>, BuildError> {
    let mut world = World::new(settings::<S>(1.0 / 240.0))?;
    let belt = BodySpec::kinematic(S::block(40.0, 0.2, 1.0)).at(S::place(0.0, -0.1));
    world.add("belt", belt.moving(S::place(speed, 0.0)).friction(friction))?;
    let block = BodySpec::dense(S::block(0.4, 0.2, 0.3), 1000.0).at(S::place(0.0, 0.1));
    world.add("block", block.friction(friction))?;
    Ok(world)
}
