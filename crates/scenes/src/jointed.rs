//! Bodies on joints: a double pendulum, and a linkage of four bars that is turned.

use crate::stage::{Stage, settings};
use carom::{BodySpec, BuildError, Geometry, JointSpec, Scheme, Settings, World};

fn with_events<S: Geometry>(settings: Settings<S>) -> Settings<S> {
    Settings { scheme: Scheme::Events, ..settings }
}

/// Two bars of 1 m and 1 kg end to end, hung up at the origin and let go level; what follows is chaotic.
///
/// # Errors
/// None is known; those of building a world.
pub fn double_pendulum<S: Stage>() -> Result<World<S>, BuildError> {
    let mut world = World::new(with_events(settings::<S>(1.0 / 480.0)))?;
    for (name, at) in [("upper", 0.5), ("lower", 1.5)] {
        world.add(name, BodySpec::heavy(S::block(1.0, 0.05, 0.05), 1.0).at(S::place(at, 0.0)))?;
    }
    world.add_joint("pivot", JointSpec::point("upper").at(S::place(0.0, 0.0)))?;
    world.add_joint("elbow", JointSpec::point("lower").to("upper").at(S::place(1.0, 0.0)))?;
    Ok(world)
}

/// A crank of .4 m turning at 4 rad/s, a coupler of 1 m and a rocker of .8 m, between pivots 1 m apart: a closed loop.
/// In space its four ball joints leave the bars free to turn about their own axes.
///
/// # Errors
/// None is known; those of building a world.
pub fn four_bar_linkage<S: Stage>() -> Result<World<S>, BuildError> {
    let mut world = World::new(with_events(settings::<S>(1.0 / 480.0)))?;
    // crank upright; where the coupler meets the rocker, from both lengths
    let (crank, far) = ((0.0, 0.4), (1.0, 0.0));
    let (coupler, rocker) = (1.0_f64, 0.8_f64);
    let (along, up): (f64, f64) = (far.0 - crank.0, far.1 - crank.1);
    let base = libm::hypot(along, up);
    let foot = (base * base + coupler * coupler - rocker * rocker) / (2.0 * base);
    let side = (coupler * coupler - foot * foot).sqrt();
    let meet = (crank.0 + (foot * along - side * up) / base, crank.1 + (foot * up + side * along) / base);
    let bars = [("crank", (0.0, 0.0), crank), ("coupler", crank, meet), ("rocker", meet, far)];
    for (name, from, to) in bars {
        let (dx, dy): (f64, f64) = (to.0 - from.0, to.1 - from.1);
        let middle = S::place(0.5 * (from.0 + to.0), 0.5 * (from.1 + to.1));
        let bar = BodySpec::heavy(S::block(libm::hypot(dx, dy), 0.05, 0.05), libm::hypot(dx, dy)).at(middle);
        world.add(name, bar.turned(S::lean(libm::atan2(dy, dx))))?;
    }
    let at = |(x, y): (f64, f64)| S::place(x, y);
    world.add_joint("left pivot", JointSpec::point("crank").at(at((0.0, 0.0))))?;
    world.add_joint("crank pin", JointSpec::point("coupler").to("crank").at(at(crank)))?;
    world.add_joint("rocker pin", JointSpec::point("rocker").to("coupler").at(at(meet)))?;
    world.add_joint("right pivot", JointSpec::point("rocker").at(at(far)))?;
    // the joints make the other bars follow in the first step
    let spin = S::spin(4.0);
    let crank = world.index("crank")?;
    world.motion_mut().angular_velocity[crank] = spin;
    world.motion_mut().velocity[crank] = S::swing(spin, S::place(0.0, 0.2));
    Ok(world)
}
