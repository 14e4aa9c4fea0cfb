//! A ball dropped on a floor (cases C6, C7).

use crate::stage::{Stage, settings};
use carom::{BodySpec, BuildError, World};

/// Radius of the ball \[m\].
pub const RADIUS: f64 = 0.1;

/// A ball whose lowest point starts `height` \[m\] above the floor, with a coefficient of restitution \[1\]. It
/// first hits after sqrt(2 height/g), and the n-th apex is at height * restitution^(2n).
///
/// # Errors
/// [`BuildError`] for a restitution outside \[0, 1\].
pub fn bouncing_ball<S: Stage>(height: f64, restitution: f64) -> Result<World<S>, BuildError> {
    let mut world = World::new(settings::<S>(1.0 / 240.0))?;
    world.add("floor", BodySpec::fixed(S::ground(0.0)))?;
    let ball = BodySpec::dense(S::ball(RADIUS), 1000.0).at(S::place(0.0, RADIUS + height));
    world.add("ball", ball.restitution(restitution))?;
    Ok(world)
}
