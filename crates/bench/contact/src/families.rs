//! Problems of our own making, by family: what the tables, the stress runs and the files are made of.

use carom::solver::FrictionProblem;
use carom::{ContactProblem, Planar, ShapeError, Spatial};
use carom_scenes::contact_problems::{
    Variation, arch, brick_wall, card_house, kapla_tower, matrix_form, sphere_lattice, stack, table,
};
use carom_scenes::stage::Stage;

/// A made problem.
pub struct Made {
    /// Family, for counts.
    pub family: &'static str,
    /// Unique name.
    pub name: String,
    /// Matrix form.
    pub matrix: FrictionProblem,
    /// The bodies and contacts as a JSON text.
    pub json: String,
}

impl Made {
    /// A problem under a name, in both forms.
    pub fn of<S: Stage>(family: &'static str, name: String, problem: &ContactProblem<S>) -> Self {
        Made { family, name, matrix: matrix_form(problem), json: carom::solver::file::to_json(problem) }
    }
}

/// Friction at which arches, houses of cards and tables stand \[1\].
const ROUGH: f64 = 0.7;
/// Friction at which they slide \[1\].
const SMOOTH: f64 = 0.2;

/// Stacks with mass ratios 1:1e3 and 1:1e6, arches, card houses, hyperstatic tables: in the plane and in space, at
/// rest and sheared sideways with less friction, so that contacts slide.
///
/// # Errors
/// None is known; those of the parts' masses.
pub fn structures() -> Result<Vec<Made>, ShapeError> {
    let mut all = Vec::new();
    let sliding = Variation::sheared(1).with_friction(SMOOTH);
    for (kind, v) in [("rest", Variation::at_rest(1).with_friction(ROUGH)), ("sheared", sliding)] {
        in_space::<Planar>(kind, &v, &mut all)?;
        in_space::<Spatial>(kind, &v, &mut all)?;
    }
    Ok(all)
}

fn in_space<S: Stage>(kind: &str, v: &Variation, all: &mut Vec<Made>) -> Result<(), ShapeError> {
    let space = S::NAME;
    for (label, ratio) in [("1e3", 1e3), ("1e6", 1e6)] {
        for (end, top) in [("top", true), ("bottom", false)] {
            let name = format!("stack_{label}_{end}_{space}_{kind}");
            all.push(Made::of("stack", name, &stack::<S>(10, ratio, top, v)?));
        }
    }
    for stones in [9, 25] {
        all.push(Made::of("arch", format!("arch_{stones}_{space}_{kind}"), &arch::<S>(stones, v)?));
    }
    for levels in [3, 6] {
        let name = format!("card_house_{levels}_{space}_{kind}");
        all.push(Made::of("card_house", name, &card_house::<S>(levels, v)?));
    }
    for legs in [4, 8, 16] {
        all.push(Made::of("table", format!("table_{legs}_{space}_{kind}"), &table::<S>(legs, v)?));
    }
    Ok(())
}

/// All small families in all variations of a seed: up to a few hundred contacts each.
///
/// # Errors
/// None is known; those of the parts' masses.
pub fn small(seed: u64) -> Result<Vec<Made>, ShapeError> {
    let mut all = Vec::new();
    for (kind, v) in Variation::all(seed) {
        let name = |what: &str| format!("{what}_{kind}_{seed}");
        all.push(Made::of("wall", name("wall_6"), &brick_wall::<Spatial>(6, 6, &v)?));
        all.push(Made::of("wall", name("wall_9_planar"), &brick_wall::<Planar>(9, 9, &v)?));
        all.push(Made::of("lattice", name("lattice_4"), &sphere_lattice::<Spatial>(4, &v)?));
        all.push(Made::of("lattice", name("lattice_9_planar"), &sphere_lattice::<Planar>(9, &v)?));
        all.push(Made::of("kapla", name("kapla_12x2"), &kapla_tower(12, 2, &v)?));
        all.push(Made::of("kapla", name("kapla_6x3"), &kapla_tower(6, 3, &v)?));
        all.push(Made::of("stack", name("stack_1e3"), &stack::<Spatial>(8, 1e3, true, &v)?));
        all.push(Made::of("stack", name("stack_1e6"), &stack::<Spatial>(8, 1e6, true, &v)?));
        all.push(Made::of("arch", name("arch_15"), &arch::<Spatial>(15, &v)?));
        all.push(Made::of("card_house", name("card_house_4"), &card_house::<Spatial>(4, &v)?));
        all.push(Made::of("table", name("table_8"), &table::<Spatial>(8, &v)?));
    }
    Ok(all)
}

/// The two problems of 5,000 contacts: the brick wall 25 x 25 and the jammed lattice of 12^3 balls, with small random
/// velocities and random friction.
///
/// # Errors
/// None is known; those of the parts' masses.
pub fn large(seed: u64) -> Result<Vec<Made>, ShapeError> {
    let v = Variation::perturbed(seed);
    Ok(vec![
        Made::of("wall", format!("wall_25_{seed}"), &brick_wall::<Spatial>(25, 25, &v)?),
        Made::of("lattice", format!("lattice_12_{seed}"), &sphere_lattice::<Spatial>(12, &v)?),
    ])
}
