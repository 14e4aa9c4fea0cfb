//! Houses of cards and tables on many legs: light frames, leaning or redundant.

use crate::contact_problems::assembly::{Assembly, FLOOR, at, cosine_sine};
use crate::contact_problems::variation::Variation;
use crate::stage::Stage;
use carom::{ContactProblem, ShapeError};

/// Length, thickness and depth of a card \[m\].
const CARD: [f64; 3] = [0.1, 0.001, 0.06];
/// Lean of a card from the vertical \[rad\]: 20 degrees, which asks for friction tan(20 deg)/2 = .182.
const LEAN: f64 = 0.349_065_850_398_865_9;

/// A house of cards with `levels` levels: pairs of cards that lean on each other under long cards, each level with a
/// pair less than the one below. Per pair and level: the apex, two feet, and two rests of the card above.
///
/// # Errors
/// None is known; those of a card's mass.
pub fn card_house<S: Stage>(levels: usize, variation: &Variation) -> Result<ContactProblem<S>, ShapeError> {
    let [long, thick, deep] = CARD;
    let [c, s] = cosine_sine(LEAN);
    let (reach, rise) = (long * s, long * c);
    let spacing = 2.0 * reach + 0.1 * long;
    let card = S::block(long, thick, deep);
    let mut house = Assembly::<S>::new(variation);
    let mut floor = FLOOR;
    for level in 0..levels {
        let pairs = levels - level;
        let foot = level as f64 * (rise + thick);
        let middles: Vec<f64> = (0..pairs).map(|k| spacing * (k as f64 - 0.5 * (pairs - 1) as f64)).collect();
        let span = spacing * pairs as f64;
        let mut tops = Vec::new();
        for &middle in &middles {
            let mut pair = [0; 2];
            for (side, it) in [-1.0, 1.0].into_iter().zip(&mut pair) {
                let place = [middle + side * 0.5 * reach, 0.0, foot + 0.5 * rise];
                *it = house.body(&card, 1.0, place, std::f64::consts::FRAC_PI_2 + side * LEAN)?;
                ridge(&mut house, (*it, floor), [middle + side * reach, foot], [0.0, 1.0], deep);
                tops.push((*it, middle));
            }
            ridge(&mut house, (pair[1], pair[0]), [middle, foot + rise], [1.0, 0.0], deep);
        }
        let deck = S::block(span, thick, deep);
        let deck = house.body(&deck, 1.0, [0.0, 0.0, foot + rise + 0.5 * thick], 0.0)?;
        for (it, middle) in tops {
            ridge(&mut house, (deck, it), [middle, foot + rise], [0.0, 1.0], deep);
        }
        floor = deck;
    }
    Ok(house.finish())
}

/// The contacts of an edge that runs in depth: one in the plane, two in space.
fn ridge<S: Stage>(
    house: &mut Assembly<S>,
    (a, b): (usize, usize),
    [along, up]: [f64; 2],
    [across, upward]: [f64; 2],
    deep: f64,
) {
    let sides: &[f64] = if S::DIM == 3 { &[-0.5, 0.5] } else { &[0.0] };
    for side in sides {
        let point = at::<S>([along, side * deep, up]);
        let normal = at::<S>([across, 0.0, upward]);
        house.touch(a, b, point, normal, 0.0);
    }
}

/// A slab on `legs` legs, in a ring in space, in a row in the plane; each leg touches slab and floor at its corners
/// (2 each in the plane, 4 in space). With more than a few legs the loads of the legs are not determined.
///
/// # Errors
/// None is known; those of the parts' masses.
pub fn table<S: Stage>(legs: usize, variation: &Variation) -> Result<ContactProblem<S>, ShapeError> {
    let (side, tall, thick) = (0.05, 0.7, 0.04);
    let ring = 0.6;
    let leg = S::block(side, tall, side);
    let mut table = Assembly::<S>::new(variation);
    let row = |k: usize| 2.0 * ring * (k as f64 / legs.saturating_sub(1).max(1) as f64 - 0.5);
    let feet: Vec<[f64; 2]> = (0..legs)
        .map(|k| {
            let [c, s] = cosine_sine(2.0 * std::f64::consts::PI * k as f64 / legs as f64);
            if S::DIM == 3 { [ring * c, ring * s] } else { [row(k), 0.0] }
        })
        .collect();
    let mut standing = Vec::new();
    for &[x, y] in &feet {
        let it = table.body(&leg, 1.0, [x, y, 0.5 * tall], 0.0)?;
        table.rest(it, FLOOR, [x - 0.5 * side, x + 0.5 * side], 0.0, (y, side));
        standing.push(it);
    }
    let width = 2.0 * ring + side;
    let slab = table.body(&S::block(width, thick, width), 1.0, [0.0, 0.0, tall + 0.5 * thick], 0.0)?;
    for (&it, &[x, y]) in standing.iter().zip(&feet) {
        table.rest(slab, it, [x - 0.5 * side, x + 0.5 * side], tall, (y, side));
    }
    Ok(table.finish())
}
