//! Many bodies poured in space: a pile of mixed convex bodies in a box, boxes and hulls in a bin, rocks on a terrain.

use crate::chance::Chance;
use crate::stage::settings;
use carom::{BodySpec, BuildError, Settings, Spatial, SpatialShape, Turn, Vec3, World3, vec3};

/// Distance of neighbours in the grid from which bodies fall into a container \[m\]; no body is longer.
const PITCH: f64 = 0.46;

/// `count` convex bodies of six kinds (boxes, balls, capsules, cylinders, hulls, rounded boxes) between .15 and .4 m
/// long, poured into a box with walls. Friction .5, no bounce.
///
/// # Errors
/// None is known; those of building a world.
pub fn pile(count: usize) -> Result<World3, BuildError> {
    let side = libm::cbrt(count as f64).ceil() as usize;
    pour(count, [side, side], 1, mixed_shape)
}

/// Tilted boxes and convex hulls of 14 random corners, mixed, of .15 to .25 m in length, dropped in layers
/// of `side` by `side` into a bin .46 m wide for each. Friction .5, no bounce. Bodies: "floor", four walls, "body0" and so on.
///
/// # Errors
/// None is known; those of building a world.
pub fn bin(side: usize, boxes: usize, hulls: usize) -> Result<World3, BuildError> {
    let count = boxes + hulls;
    pour(count, [side, count.div_ceil(side * side)], 5, |k, chance| {
        let size = [(); 3].map(|()| chance.between(0.15, 0.25));
        // the boxes evenly among the hulls
        if (k + 1) * boxes / count > k * boxes / count {
            SpatialShape::Box { size }
        } else {
            rock(14, size, chance)
        }
    })
}

/// So many bodies above a container, turned at random, in `layers` square layers of `side` by `side`.
fn pour(
    count: usize,
    [side, layers]: [usize; 2],
    seed: u64,
    shape: impl Fn(usize, &mut Chance) -> SpatialShape,
) -> Result<World3, BuildError> {
    // spinning bodies overlap by the square of the angle they turn in a step: 1/120 s would cost 5 cm
    let mut world = World3::new(Settings { iterations: 40, ..settings::<Spatial>(1.0 / 240.0) })?;
    let half = 0.5 * PITCH * side as f64;
    add_container(&mut world, half, PITCH * layers as f64)?;
    let mut chance = Chance::new(seed);
    for k in 0..count {
        let (layer, place) = (k / (side * side), k % (side * side));
        let at = |i: usize| PITCH * (i as f64 + 0.5) - half;
        let position = vec3(at(place % side), at(place / side), PITCH * (layer as f64 + 0.5));
        let spec = BodySpec::dense(shape(k, &mut chance), 1000.0).at(position);
        world.add(&format!("body{k}"), spec.turned(chance.orientation()))?;
    }
    Ok(world)
}

/// Floor and four walls, a metre thick, so that a fast body stays inside.
fn add_container(world: &mut World3, half: f64, height: f64) -> Result<(), BuildError> {
    let thick = 1.0;
    let across = 2.0 * (half + thick);
    let slab = SpatialShape::Box { size: [across, across, thick] };
    world.add("floor", BodySpec::fixed(slab).at(vec3(0.0, 0.0, -0.5 * thick)))?;
    for (name, x, y) in [("left", -1.0, 0.0), ("right", 1.0, 0.0), ("near", 0.0, -1.0), ("far", 0.0, 1.0)] {
        let size = if y == 0.0 { [thick, across, height] } else { [2.0 * half, thick, height] };
        let place = vec3((half + 0.5 * thick) * x, (half + 0.5 * thick) * y, 0.5 * height);
        world.add(&format!("{name} wall"), BodySpec::fixed(SpatialShape::Box { size }).at(place))?;
    }
    Ok(())
}

/// The k-th shape of the pile.
fn mixed_shape(k: usize, chance: &mut Chance) -> SpatialShape {
    let mut length = || chance.between(0.15, 0.25);
    match k % 6 {
        0 => SpatialShape::Box { size: [length(), length(), length()] },
        1 => SpatialShape::Sphere { radius: 0.5 * length() },
        2 => SpatialShape::Capsule { length: length(), radius: 0.3 * length() },
        3 => SpatialShape::Cylinder { height: length(), radius: 0.5 * length() },
        4 => rock(14, [length(), length(), length()], chance),
        _ => SpatialShape::RoundBox { size: [0.7 * length(), 0.7 * length(), 0.7 * length()], radius: 0.03 },
    }
}

/// Convex hull of random points between .8 and 1 times the half axes of an ellipsoid of this full `size` \[m\].
fn rock(corners: usize, size: [f64; 3], chance: &mut Chance) -> SpatialShape {
    let corner = |chance: &mut Chance| {
        let direction = chance.direction();
        let reach = 0.5 * chance.between(0.8, 1.0);
        vec3(reach * size[0] * direction[0], reach * size[1] * direction[1], reach * size[2] * direction[2])
    };
    SpatialShape::ConvexHull { points: (0..corners).map(|_| corner(chance)).collect() }
}

/// Side of the terrain \[m\].
const GROUND: f64 = 12.0;
/// Cells of the terrain along a side.
const CELLS: usize = 40;

/// How a terrain is stated.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Terrain {
    /// Triangles over shared vertices.
    Mesh,
    /// Heights over a grid.
    HeightField,
}

/// Height of the terrain \[m\]: a valley with ripples.
fn height(x: f64, y: f64) -> f64 {
    let [c, s] = Turn::from_angle(1.3 * x).0;
    let [d, t] = Turn::from_angle(1.1 * y).0;
    0.06 * (x * x + y * y) + 0.15 * s * d + 0.1 * c * t
}

fn terrain_shape(kind: Terrain) -> SpatialShape {
    let at = |i: usize| GROUND * (i as f64 / CELLS as f64 - 0.5);
    if kind == Terrain::HeightField {
        let heights = (0..=CELLS).map(|j| (0..=CELLS).map(|i| height(at(i), at(j))).collect()).collect();
        return SpatialShape::HeightField { heights, size: [GROUND, GROUND] };
    }
    let mut vertices: Vec<Vec3> = Vec::new();
    let mut triangles = Vec::new();
    let name = |i: usize, j: usize| (j * (CELLS + 1) + i) as u32;
    for j in 0..=CELLS {
        for i in 0..=CELLS {
            vertices.push(vec3(at(i), at(j), height(at(i), at(j))));
            if i < CELLS && j < CELLS {
                triangles.push([name(i, j), name(i + 1, j), name(i + 1, j + 1)]);
                triangles.push([name(i, j), name(i + 1, j + 1), name(i, j + 1)]);
            }
        }
    }
    SpatialShape::TriMesh { vertices, triangles }
}

/// `count` rocks (hulls of 18 random points, .3 to .8 m) fall on a hilly valley and come to rest in it.
///
/// # Errors
/// None is known; those of building a world.
pub fn rocks_on_terrain(count: usize, terrain: Terrain) -> Result<World3, BuildError> {
    let mut world = World3::new(Settings { iterations: 50, ..settings::<Spatial>(1.0 / 240.0) })?;
    world.add("terrain", BodySpec::fixed(terrain_shape(terrain)).friction(0.7))?;
    let mut chance = Chance::new(2);
    let side = 5;
    for k in 0..count {
        let (layer, place) = (k / (side * side), k % (side * side));
        let at = |i: usize| 0.9 * (i as f64 - 0.5 * (side - 1) as f64);
        let position = vec3(at(place % side), at(place / side), 1.5 + 0.9 * layer as f64);
        let size = [(); 3].map(|()| chance.between(0.3, 0.8));
        let spec = BodySpec::dense(rock(18, size, &mut chance), 2600.0).at(position);
        world.add(&format!("rock{k}"), spec.turned(chance.orientation()).friction(0.7))?;
    }
    Ok(world)
}
