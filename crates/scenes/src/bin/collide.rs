//! What finding contacts costs, phase by phase, in scenes whose bodies stand still: bounds, pairs, contact points by kinds
//! of shapes, touches, and all of it as a step asks for it. Processor time, medians, each beside its share of the whole.
//! What it does not do: step a world, or run another engine.

use carom::ahead::Ahead;
use carom::geometry::{Aabb, BroadPhase, ContactPoint, Geometry};
use carom::narrow_phase::{NarrowPhase, touches_of};
use carom::{BodySpec, BuildError, Pose, Settings, SpatialShape, World, World3, vec3};
use carom_scenes::chance::Chance;
use carom_scenes::stacking;
use std::time::Instant;

/// Length of a step \[s\].
const DT: f64 = 1.0 / 120.0;
/// Rounds of which the median is told, and the least time of each \[s\]: clocks of processor time tick a few milliseconds.
const ROUNDS: usize = 5;
const ROUND: f64 = 0.1;
/// Half of each pair's margin \[m\].
const MARGIN: f64 = 1e-3;

fn main() -> Result<(), BuildError> {
    println!("{:44}{:>9}{:>11}{:>13}{:>9}", "", "items", "ms", "ns per item", "share");
    measure("wall of 5,050 boxes, in space", &stacking::pyramid::<carom::Spatial>(100)?, |_| "box-box");
    measure("wall of 5,050 boxes, in the plane", &stacking::pyramid::<carom::Planar>(100)?, |_| "box-box");
    for count in [1000, 8000] {
        measure(&format!("heap of {count} boxes and hulls"), &heap(count)?, kind);
    }
    Ok(())
}

/// Boxes and hulls of 14 corners, .15 to .25 m long and turned at random, so close that they overlap a little.
fn heap(count: usize) -> Result<World3, BuildError> {
    let mut world = World3::new(Settings::default())?;
    let (mut chance, side) = (Chance::new(7), libm::cbrt(count as f64).ceil() as usize);
    for k in 0..count {
        let size = [(); 3].map(|()| chance.between(0.15, 0.25));
        let shape = if k % 2 == 0 {
            SpatialShape::Box { size }
        } else {
            let corner = |d: carom::Vec3| vec3(size[0] * d[0], size[1] * d[1], size[2] * d[2]) * 0.5;
            SpatialShape::ConvexHull { points: (0..14).map(|_| corner(chance.direction())).collect() }
        };
        let place = [k % side, k / side % side, k / (side * side)].map(|i| 0.18 * i as f64);
        let spec = BodySpec::dense(shape, 1000.0).at(vec3(place[0], place[1], place[2]));
        world.add(&format!("body{k}"), spec.turned(chance.orientation()))?;
    }
    Ok(world)
}

/// What two shapes of the heap are.
fn kind([a, b]: [&SpatialShape; 2]) -> &'static str {
    let is_box = |s: &SpatialShape| matches!(s, SpatialShape::Box { .. });
    match (is_box(a), is_box(b)) {
        (true, true) => "box-box",
        (false, false) => "hull-hull",
        _ => "box-hull",
    }
}

/// The bodies of a scene, ready for each phase.
struct Scene<'a, S: Geometry> {
    world: &'a World<S>,
    poses: Vec<Pose<S>>,
    bounds: Vec<Aabb<S>>,
    movable: Vec<bool>,
}

impl<'a, S: Geometry> Scene<'a, S> {
    fn new(world: &'a World<S>) -> Self {
        let bodies = world.bodies();
        let poses: Vec<Pose<S>> = (0..bodies.len()).map(|i| bodies.shape_pose(i)).collect();
        let movable = bodies.data.iter().map(|d| d.inverse_mass > 0.0).collect();
        let mut scene = Scene { world, poses, bounds: Vec::new(), movable };
        scene.bounds = scene.find_bounds().collect();
        scene
    }
    fn collider(&self, i: usize) -> &S::Collider {
        self.world.bodies().data[i].collider.as_ref().expect("every body of these scenes has a shape")
    }
    fn find_bounds(&self) -> impl Iterator<Item = Aabb<S>> {
        (0..self.poses.len()).map(|i| S::bounds(self.collider(i), &self.poses[i], MARGIN))
    }
    fn contacts(&self, (i, j): (usize, usize), out: &mut Vec<ContactPoint<S>>) {
        let (a, b) = (self.collider(i), self.collider(j));
        S::contacts(a, &self.poses[i], b, &self.poses[j], 2.0 * MARGIN, out);
    }
}

/// Tells what each phase costs in a scene.
fn measure<S: Geometry>(name: &str, world: &World<S>, kind: impl Fn([&S::Shape; 2]) -> &'static str) {
    let (scene, bodies, settings) = (Scene::new(world), world.bodies(), world.settings());
    let (mut narrow, mut touches) = (NarrowPhase::default(), Vec::new());
    let ahead = Ahead::new(bodies, settings, DT, &[]);
    let whole = milliseconds(|| narrow.update(&ahead, &mut touches));
    let tell = |what: &str, items: usize, ms: f64| {
        let (each, share) = (1e6 * ms / items as f64, 100.0 * ms / whole);
        println!("{what:44}{items:9}{ms:11.3}{each:13.1}{share:8.0}%");
    };
    println!("{name}");
    let bounds = || {
        scene.find_bounds().for_each(|b| {
            std::hint::black_box(b);
        });
    };
    tell("  bounds, by body", bodies.len(), milliseconds(bounds));
    let mut broad = BroadPhase::new();
    let mut update = || broad.update(&scene.bounds, &scene.movable, &|_, _| true).to_vec();
    let pairs: Vec<(usize, usize)> = update().iter().map(|&(i, j)| (i as usize, j as usize)).collect();
    tell("  pairs, by body", bodies.len(), milliseconds(|| drop(std::hint::black_box(update()))));
    let shape = |i: usize| bodies.data[i].shape.as_ref().expect("every body of these scenes has a shape");
    let mut points = Vec::new();
    for group in ["box-box", "box-hull", "hull-hull"] {
        let of_kind = |(i, j): &(usize, usize)| {
            scene.movable[*i] && scene.movable[*j] && kind([shape(*i), shape(*j)]) == group
        };
        let chosen: Vec<(usize, usize)> = pairs.iter().copied().filter(of_kind).collect();
        if !chosen.is_empty() {
            let ms = milliseconds(|| {
                for &pair in &chosen {
                    points.clear();
                    scene.contacts(pair, &mut points);
                }
            });
            tell(&format!("  contact points, {group}, by pair"), chosen.len(), ms);
        }
    }
    let found: Vec<Vec<ContactPoint<S>>> = pairs
        .iter()
        .map(|&pair| {
            let mut points = Vec::new();
            scene.contacts(pair, &mut points);
            points
        })
        .collect();
    let mut all = Vec::new();
    let ms = milliseconds(|| {
        all.clear();
        pairs
            .iter()
            .zip(&found)
            .for_each(|(&pair, points)| touches_of(bodies, settings, pair, points, &mut all));
    });
    tell("  touches, by touch", all.len(), ms);
    tell("  all as a step does it, by touch", touches.len(), whole);
}

/// Median of the processor time of a call \[ms\].
fn milliseconds(mut call: impl FnMut()) -> f64 {
    call();
    let clock = Instant::now();
    let now = || processor_seconds().unwrap_or_else(|| clock.elapsed().as_secs_f64());
    let mut rounds: Vec<f64> = (0..ROUNDS)
        .map(|_| {
            let (begun, mut calls) = (now(), 0.0);
            while now() - begun < ROUND {
                call();
                calls += 1.0;
            }
            1e3 * (now() - begun) / calls
        })
        .collect();
    rounds.sort_by(f64::total_cmp);
    rounds[ROUNDS / 2]
}

/// Processor time of this thread so far \[s\], of systems that tell it.
fn processor_seconds() -> Option<f64> {
    let text = std::fs::read_to_string("/proc/thread-self/schedstat").ok()?;
    Some(1e-9 * text.split_whitespace().next()?.parse::<f64>().ok()?)
}
