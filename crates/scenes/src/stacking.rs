//! What stands by weight and friction (cases C24, C27): stacks, pyramids of boxes, a house of cards, a tower of
//! planks.

use crate::chance::Chance;
use crate::stage::{Stage, settings};
use carom::{BodySpec, BuildError, Planar, PlanarShape, Settings, Spatial, World, World2, World3, vec3};

/// Density of the boxes \[kg/m^DIM\].
const DENSITY: f64 = 1000.0;

/// `count` boxes of side 1 m on each other, box 0 lowest, the topmost `top` times as heavy as the others. The k-th
/// interface from below carries the weight of all boxes above it.
///
/// # Errors
/// [`BuildError`] for a mass factor that is not positive.
pub fn stack<S: Stage>(count: usize, top: f64) -> Result<World<S>, BuildError> {
    let mut world = World::new(settings::<S>(1.0 / 240.0))?;
    world.add("floor", BodySpec::fixed(S::ground(0.0)))?;
    for k in 0..count {
        let density = if k + 1 == count { top * DENSITY } else { DENSITY };
        let place = S::place(0.0, 0.5 + k as f64);
        world.add(&format!("box{k}"), BodySpec::dense(S::block(1.0, 1.0, 1.0), density).at(place))?;
    }
    Ok(world)
}

/// Stacks of `height` boxes of side 1 m beside each other, .5 m apart, on one floor, and each box pushed to and fro at up to
/// .3 m/s: as many islands. Friction .5.
///
/// # Errors
/// None is known; those of building a world.
pub fn stacks<S: Stage>(count: usize, height: usize) -> Result<World<S>, BuildError> {
    let mut world = World::new(settings::<S>(1.0 / 200.0))?;
    world.add("floor", BodySpec::fixed(S::ground(0.0)).friction(0.5))?;
    let mut chance = Chance::new(11);
    for k in 0..count {
        for row in 0..height {
            let place = S::place(1.5 * k as f64 + chance.between(-0.03, 0.03), 0.5 + row as f64);
            let spec = BodySpec::dense(S::block(1.0, 1.0, 1.0), DENSITY).at(place).friction(0.5);
            let push = S::place(chance.between(-0.3, 0.3), 0.0);
            world.add(&format!("box{k}_{row}"), spec.moving(push))?;
        }
    }
    Ok(world)
}

/// A pyramid of boxes of side 1 m, as wide as `base` boxes below and one above: base (base + 1)/2 boxes, each on
/// two others and beside its neighbours without a gap. Friction .6.
///
/// # Errors
/// None is known; those of building a world.
pub fn pyramid<S: Stage>(base: usize) -> Result<World<S>, BuildError> {
    // a base of 50 stands with 60 sweeps, warm-started; more make the fall after the start shorter
    let mut world = World::new(Settings { iterations: 60, ..settings::<S>(1.0 / 120.0) })?;
    world.add("floor", BodySpec::fixed(S::ground(0.0)).friction(0.6))?;
    add_pyramid(&mut world, "", base, 0.0)?;
    Ok(world)
}

/// Pyramids like [`pyramid`], side by side on one floor, 2 m apart: as many islands.
///
/// # Errors
/// None is known; those of building a world.
pub fn pyramids<S: Stage>(count: usize, base: usize) -> Result<World<S>, BuildError> {
    let mut world = World::new(Settings { iterations: 60, ..settings::<S>(1.0 / 120.0) })?;
    world.add("floor", BodySpec::fixed(S::ground(0.0)).friction(0.6))?;
    for k in 0..count {
        add_pyramid(&mut world, &format!("{k}_"), base, k as f64 * (base as f64 + 2.0))?;
    }
    Ok(world)
}

/// Adds a pyramid about a place along x, its boxes named by a prefix, row and number.
fn add_pyramid<S: Stage>(
    world: &mut World<S>,
    prefix: &str,
    base: usize,
    about: f64,
) -> Result<(), BuildError> {
    for row in 0..base {
        let width = base - row;
        for k in 0..width {
            let along = about + k as f64 - 0.5 * (width - 1) as f64;
            let spec =
                BodySpec::dense(S::block(1.0, 1.0, 1.0), DENSITY).at(S::place(along, 0.5 + row as f64));
            world.add(&format!("box{prefix}{row}_{k}"), spec.friction(0.6))?;
        }
    }
    Ok(())
}

/// Length of a card \[m\].
const CARD: f64 = 0.1;
/// Rounding of a card's edges, half of its thickness \[m\].
const ROUNDING: f64 = 0.001;
/// Lean of a card from the vertical \[rad\]: 25 degrees, which asks for friction tan(25 deg)/2 = .233.
const LEAN: f64 = 0.436_332_312_998_582_4;

/// A house of cards with `levels` levels: each a row of pairs of cards that lean on each other under one long
/// card; every level has one pair less than the one below it. It stands when the friction \[1\] suffices.
///
/// # Errors
/// [`BuildError`] for a negative friction.
pub fn card_house(levels: usize, friction: f64) -> Result<World2, BuildError> {
    let mut world = World2::new(Settings { iterations: 400, ..settings::<Planar>(1.0 / 480.0) })?;
    world.add("floor", BodySpec::fixed(Planar::ground(0.0)).friction(friction))?;
    let [c, s] = carom::Turn::from_angle(LEAN).0;
    // ends of a card are half discs: a pair meets at height `apex` of their centres, feet at height ROUNDING
    let core = CARD - 2.0 * ROUNDING;
    let height = core * c + 2.0 * ROUNDING;
    let spacing = 2.0 * core * s + 8.0 * ROUNDING;
    let card = |length: f64| {
        let shape = PlanarShape::Capsule { length: length - 2.0 * ROUNDING, radius: ROUNDING };
        BodySpec::dense(shape, 800.0).friction(friction)
    };
    for level in 0..levels {
        let pairs = levels - level;
        let floor = level as f64 * (height + 2.0 * ROUNDING);
        for pair in 0..pairs {
            let middle = spacing * (pair as f64 - 0.5 * (pairs - 1) as f64);
            for (side, name) in [(-1.0, "left"), (1.0, "right")] {
                let place = Planar::place(middle + side * (0.5 * core * s + ROUNDING), floor + 0.5 * height);
                let turn = Planar::lean(std::f64::consts::FRAC_PI_2 + side * LEAN);
                world.add(&format!("{name}{level}_{pair}"), card(CARD).at(place).turned(turn))?;
            }
        }
        let deck = card(spacing * (pairs - 1) as f64 + CARD);
        world.add(&format!("deck{level}"), deck.at(Planar::place(0.0, floor + height + ROUNDING)))?;
    }
    Ok(world)
}

/// Side lengths of a plank \[m\]: along, up, deep.
const PLANK: [f64; 3] = [0.12, 0.008, 0.024];

/// A tower of planks lying flat, `planks` side by side in each storey, the storeys crossing each other at right
/// angles, the lowest on the floor. It stands with any friction; here all have .5 and a density of 600 kg/m^3.
///
/// # Errors
/// None is known; those of a plank's mass.
pub fn kapla_tower(storeys: usize, planks: usize) -> Result<World3, BuildError> {
    let mut world = World3::new(settings::<Spatial>(1.0 / 240.0))?;
    world.add("floor", BodySpec::fixed(Spatial::ground(0.0)).friction(0.5))?;
    let [long, high, deep] = PLANK;
    // planks are spread over the width that a plank is long
    let spacing = if planks > 1 { (long - deep) / (planks - 1) as f64 } else { 0.0 };
    for storey in 0..storeys {
        let up = (storey as f64 + 0.5) * high;
        for plank in 0..planks {
            let across = spacing * (plank as f64 - 0.5 * (planks.max(1) - 1) as f64);
            let (shape, place) = if storey % 2 == 1 {
                (Spatial::block(deep, high, long), vec3(across, 0.0, up))
            } else {
                (Spatial::block(long, high, deep), vec3(0.0, across, up))
            };
            let spec = BodySpec::dense(shape, 600.0).at(place).friction(0.5);
            world.add(&format!("plank{storey}_{plank}"), spec)?;
        }
    }
    Ok(world)
}
