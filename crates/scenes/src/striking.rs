//! Blows that pass through touching balls (case C11): a cradle without strings, a billiard break.

use crate::stage::{Stage, settings, weightless};
use carom::{
    BodySpec, BuildError, ImpactLaw, Planar, PlanarShape, Settings, Spatial, SpatialShape, Vec2, World,
    World2, World3, vec2, vec3,
};

/// Newton's cradle with walls instead of strings: `count` elastic balls in a line, all but the first touching;
/// the first one comes in at 1 m/s, the last one leaves, returns from its wall and drives the first one out. The
/// sequential law passes each blow on to the last ball.
///
/// # Errors
/// None is known; those of building a world.
pub fn cradle<S: Stage>(count: usize) -> Result<World<S>, BuildError> {
    let settings = Settings { impact: Some(ImpactLaw::Sequential), ..weightless::<S>(1.0 / 240.0) };
    let mut world = World::new(settings)?;
    let radius = 0.05;
    let pitch = 2.0 * radius;
    // both walls stand .25 m from the ball next to them
    let way = 0.25;
    world.add("left wall", BodySpec::fixed(S::wall(1.0)).at(S::place(-radius - way, 0.0)))?;
    let end = pitch * count as f64 - radius;
    world.add("right wall", BodySpec::fixed(S::wall(-1.0)).at(S::place(end + way, 0.0)))?;
    for k in 0..count {
        let ball = BodySpec::dense(S::ball(radius), 7800.0).restitution(1.0).friction(0.0);
        let ball = if k == 0 {
            ball.moving(S::place(1.0, 0.0)).at(S::place(-way, 0.0))
        } else {
            ball.at(S::place(pitch * k as f64, 0.0))
        };
        world.add(&format!("ball{k}"), ball)?;
    }
    Ok(world)
}

/// Radius of a billiard ball \[m\].
const BALL: f64 = 0.028_575;
/// Playing field \[m\].
const FIELD: [f64; 2] = [2.54, 1.27];
/// Speed of the cue ball \[m/s\].
const SPEED: f64 = 6.0;

/// The cue ball and the fifteen balls of the rack, on the field's plane.
fn rack() -> Vec<(String, Vec2)> {
    let mut balls = vec![("cue".to_string(), vec2(-0.25 * FIELD[0], 0.0))];
    // rows are 2 r sin(60 deg) apart; a hair of air keeps neighbours from overlapping by rounding
    let pitch = 2.0 * BALL * (1.0 + 1e-9);
    for row in 0..5u32 {
        for k in 0..=row {
            let x = 0.25 * FIELD[0] + pitch * 0.75_f64.sqrt() * f64::from(row);
            let y = pitch * (f64::from(k) - 0.5 * f64::from(row));
            balls.push((format!("ball{}", balls.len()), vec2(x, y)));
        }
    }
    balls
}

/// A billiard break seen from above: discs without weight, slowed by damping as by a cloth, between four walls.
///
/// # Errors
/// None is known; those of building a world.
pub fn billiard_break_planar() -> Result<World2, BuildError> {
    let mut world = World2::new(weightless::<Planar>(1.0 / 1000.0))?;
    for (name, x, y) in [("left", 1.0, 0.0), ("right", -1.0, 0.0), ("near", 0.0, 1.0), ("far", 0.0, -1.0)] {
        let wall =
            BodySpec::fixed(PlanarShape::HalfPlane { normal: vec2(x, y) }).friction(0.15).restitution(0.8);
        world.add(&format!("{name} cushion"), wall.at(vec2(-0.5 * FIELD[0] * x, -0.5 * FIELD[1] * y)))?;
    }
    for (name, place) in rack() {
        let ball = BodySpec::heavy(Planar::ball(BALL), 0.17).at(place).friction(0.05).restitution(0.95);
        let speed = if name == "cue" { vec2(SPEED, 0.0) } else { vec2(0.0, 0.0) };
        world.add(&name, ball.moving(speed).damped(0.3, 0.3))?;
    }
    Ok(world)
}

/// A billiard break on a table: balls that slide, roll and strike one another and four cushions.
///
/// # Errors
/// None is known; those of building a world.
pub fn billiard_break_spatial() -> Result<World3, BuildError> {
    let mut world = World3::new(settings::<Spatial>(1.0 / 1000.0))?;
    let bed = SpatialShape::Box { size: [FIELD[0] + 0.4, FIELD[1] + 0.4, 0.1] };
    world.add("bed", BodySpec::fixed(bed).at(vec3(0.0, 0.0, -0.05)).friction(0.2))?;
    for (name, x, y) in [("left", -1.0, 0.0), ("right", 1.0, 0.0), ("near", 0.0, -1.0), ("far", 0.0, 1.0)] {
        let (depth, height): (f64, f64) = (0.1, 0.08);
        let size = if y == 0.0 { [depth, FIELD[1] + 2.0 * depth, height] } else { [FIELD[0], depth, height] };
        let place = vec3(0.5 * (FIELD[0] + depth) * x, 0.5 * (FIELD[1] + depth) * y, 0.5 * height);
        let cushion = BodySpec::fixed(SpatialShape::Box { size }).at(place);
        world.add(&format!("{name} cushion"), cushion.friction(0.15).restitution(0.8))?;
    }
    for (name, place) in rack() {
        let ball = BodySpec::heavy(Spatial::ball(BALL), 0.17).at(vec3(place[0], place[1], BALL));
        let speed = if name == "cue" { vec3(SPEED, 0.0, 0.0) } else { vec3(0.0, 0.0, 0.0) };
        world.add(&name, ball.moving(speed).friction(0.05).restitution(0.95))?;
    }
    Ok(world)
}
