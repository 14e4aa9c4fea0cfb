//! Walls, towers, stacks and arches of blocks, and lattices of balls: bodies in known places with known contacts.

use crate::contact_problems::assembly::{Assembly, FLOOR, cosine_sine};
use crate::contact_problems::variation::Variation;
use crate::stage::Stage;
use carom::{ContactProblem, ShapeError, Spatial};

/// Length, height and depth of a brick \[m\].
const BRICK: [f64; 3] = [0.2, 0.1, 0.1];
/// Radius of a ball \[m\].
const RADIUS: f64 = 0.05;
/// Length, height and depth of a plank \[m\].
const PLANK: [f64; 3] = [0.12, 0.008, 0.024];

/// A wall in running bond, `columns` bricks in each of `rows` rows, each row half a brick beside the one below. Two
/// bricks that overlap touch at 2 corners in the plane, 4 in space: per joint, (rows - 1)(2 columns - 1) + columns
/// joints. 25 x 25 in space: 625 bricks, 4804 contacts.
///
/// # Errors
/// None is known; those of a brick's mass.
pub fn brick_wall<S: Stage>(
    rows: usize,
    columns: usize,
    variation: &Variation,
) -> Result<ContactProblem<S>, ShapeError> {
    let [long, high, deep] = BRICK;
    let brick = S::block(long, high, deep);
    let mut wall = Assembly::<S>::new(variation);
    let left = |row: usize, column: usize| (column as f64 + 0.5 * (row % 2) as f64) * long;
    let mut below: Vec<usize> = Vec::new();
    for row in 0..rows {
        let foot = row as f64 * high;
        let mut here = Vec::new();
        for column in 0..columns {
            let start = left(row, column);
            let it = wall.body(&brick, 1.0, [start + 0.5 * long, 0.0, foot + 0.5 * high], 0.0)?;
            here.push(it);
            if row == 0 {
                wall.rest(it, FLOOR, [start, start + long], foot, (0.0, deep));
            }
            for (other, &under) in below.iter().enumerate() {
                let low = start.max(left(row - 1, other));
                let end = (start + long).min(left(row - 1, other) + long);
                if end - low > 0.25 * long {
                    wall.rest(it, under, [low, end], foot, (0.0, deep));
                }
            }
        }
        below = here;
    }
    Ok(wall.finish())
}

/// Balls in a simple cubic lattice, `edge` along each axis (a square lattice in the plane), the lowest layer on the
/// floor: edge^3 balls and 3 edge^2 (edge - 1) + edge^2 contacts. 12^3: 1728 balls, 4896 contacts.
///
/// # Errors
/// None is known; those of a ball's mass.
pub fn sphere_lattice<S: Stage>(edge: usize, variation: &Variation) -> Result<ContactProblem<S>, ShapeError> {
    let ball = S::ball(RADIUS);
    let mut lattice = Assembly::<S>::new(variation);
    let rows_deep = if S::DIM == 3 { edge } else { 1 };
    let index = |along: usize, deep: usize, up: usize| 1 + along + edge * (deep + rows_deep * up);
    for up in 0..edge {
        for deep in 0..rows_deep {
            for along in 0..edge {
                let place = [along, deep, up].map(|k| RADIUS * (2 * k + 1) as f64);
                lattice.body(&ball, 1.0, place, 0.0)?;
            }
        }
    }
    for up in 0..edge {
        for deep in 0..rows_deep {
            for along in 0..edge {
                let it = index(along, deep, up);
                if up == 0 {
                    lattice.ball_on_floor(it, RADIUS);
                } else {
                    lattice.balls(it, index(along, deep, up - 1), RADIUS);
                }
                if along > 0 {
                    lattice.balls(it, index(along - 1, deep, up), RADIUS);
                }
                if deep > 0 {
                    lattice.balls(it, index(along, deep - 1, up), RADIUS);
                }
            }
        }
    }
    Ok(lattice.finish())
}

/// A tower of planks, `planks` side by side in each storey, the storeys crossing each other at right angles: every
/// plank lies on every plank below with 4 corners, planks^2 crossings per storey. The lowest lie on the floor.
///
/// # Errors
/// None is known; those of a plank's mass.
pub fn kapla_tower(
    storeys: usize,
    planks: usize,
    variation: &Variation,
) -> Result<ContactProblem<Spatial>, ShapeError> {
    let [long, high, deep] = PLANK;
    let mut tower = Assembly::<Spatial>::new(variation);
    // planks are spread over the width that a plank is long
    let spacing = if planks > 1 { (long - deep) / (planks - 1) as f64 } else { 0.0 };
    let offset = |k: usize| spacing * (k as f64 - 0.5 * (planks.max(1) - 1) as f64);
    let mut below: Vec<usize> = Vec::new();
    for storey in 0..storeys {
        let foot = storey as f64 * high;
        let crosswise = storey % 2 == 1;
        let plank =
            if crosswise { Spatial::block(deep, high, long) } else { Spatial::block(long, high, deep) };
        let mut here = Vec::new();
        for k in 0..planks {
            let across = offset(k);
            let [x, y] = if crosswise { [across, 0.0] } else { [0.0, across] };
            let it = tower.body(&plank, 1.0, [x, y, foot + 0.5 * high], 0.0)?;
            here.push(it);
            if below.is_empty() {
                tower.rest(it, FLOOR, [-0.5 * long, 0.5 * long], foot, (across, deep));
            }
            for (other, &under) in below.iter().enumerate() {
                let [x, y] = if crosswise { [across, offset(other)] } else { [offset(other), across] };
                tower.rest(it, under, [x - 0.5 * deep, x + 0.5 * deep], foot, (y, deep));
            }
        }
        below = here;
    }
    Ok(tower.finish())
}

/// A stack of `count` cubes; the lowest or the topmost is `ratio` times as heavy as each of the others.
///
/// # Errors
/// Those of a mass for a ratio that is not positive.
pub fn stack<S: Stage>(
    count: usize,
    ratio: f64,
    heavy_top: bool,
    variation: &Variation,
) -> Result<ContactProblem<S>, ShapeError> {
    let side = 0.1;
    let cube = S::block(side, side, side);
    let mut stack = Assembly::<S>::new(variation);
    let heavy = if heavy_top { count.saturating_sub(1) } else { 0 };
    for k in 0..count {
        let foot = k as f64 * side;
        let factor = if k == heavy { ratio } else { 1.0 };
        let it = stack.body(&cube, factor, [0.0, 0.0, foot + 0.5 * side], 0.0)?;
        stack.rest(it, if k == 0 { FLOOR } else { it - 1 }, [-0.5 * side, 0.5 * side], foot, (0.0, side));
    }
    Ok(stack.finish())
}

/// A half ring of `stones` wedges of equal angle, mean radius 1 m, .3 m thick, .3 m deep, standing on the floor with
/// both ends: stones + 1 joints of 2 corners in the plane, 4 in space. The thickest funicular fits inside, so that it
/// stands when friction allows.
///
/// # Errors
/// None is known; those of a stone's mass.
pub fn arch<S: Stage>(stones: usize, variation: &Variation) -> Result<ContactProblem<S>, ShapeError> {
    let (inner, outer, deep) = (0.85, 1.15, 0.3);
    let step = std::f64::consts::PI / stones.max(1) as f64;
    let mut arch = Assembly::<S>::new(variation);
    // a wedge in its own axes, its middle straight up, moved so that its centroid is the origin
    let [c, s] = cosine_sine(0.5 * step);
    let height = centroid(inner * c, outer * c, inner * s, outer * s);
    let corners =
        [(-inner * s, inner * c), (inner * s, inner * c), (outer * s, outer * c), (-outer * s, outer * c)];
    let wedge = S::prism(&corners.map(|(x, z)| (x, z - height)), deep);
    let joint = |angle: f64| {
        let [c, s] = cosine_sine(angle);
        [[inner * c, inner * s], [outer * c, outer * s]]
    };
    for k in 0..stones {
        let angle = (k as f64 + 0.5) * step;
        let [c, s] = cosine_sine(angle);
        let place = [height * c, 0.0, height * s];
        let it = arch.body(&wedge, 1.0, place, angle - std::f64::consts::FRAC_PI_2)?;
        let start = k as f64 * step;
        if k == 0 {
            arch.joint((it, FLOOR), joint(0.0), [0.0, 1.0], (0.0, deep));
        } else {
            let [c, s] = cosine_sine(start);
            arch.joint((it, it - 1), joint(start), [-s, c], (0.0, deep));
        }
        if k + 1 == stones {
            arch.joint((it, FLOOR), joint(std::f64::consts::PI), [0.0, 1.0], (0.0, deep));
        }
    }
    Ok(arch.finish())
}

/// Height of the centroid of a trapezium with its level sides, half-widths `low_half` at `low` and `high_half` at
/// `high` \[m\].
fn centroid(low: f64, high: f64, low_half: f64, high_half: f64) -> f64 {
    low + (high - low) * (low_half + 2.0 * high_half) / (3.0 * (low_half + high_half))
}
