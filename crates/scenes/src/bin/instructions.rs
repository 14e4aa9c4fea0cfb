//! Programs of which instructions are counted (`tools/count_instructions.py`, `make bench-instructions`): `instructions
//! KERNEL COUNT` does a kernel's work so often, after work that does not depend on the count; without arguments it names
//! the kernels. Counts of two lengths tell what one costs. What it does not do: count, or measure time.

use carom::geometry::{ABREAST, Aabb, BroadPhase, Geometry, Look};
use carom::solver::{Impulses, SolveSettings};
use carom::{Column, Planar, Pose, Rotation, Scheme, Settings, SolverKind, Spatial, World};
use carom_scenes::chance::Chance;
use carom_scenes::contact_problems::{Variation, brick_wall, sphere_lattice};
use carom_scenes::stage::Stage;
use carom_scenes::{pouring, stacking};
use std::error::Error;

/// What one of a kernel is, and the work.
struct Kernel {
    name: &'static str,
    /// What is counted.
    unit: &'static str,
    /// How many of it the shorter of two runs does, and the longer twice as many.
    count: usize,
    run: fn(usize) -> Result<(), Box<dyn Error>>,
}

const fn kernel(
    name: &'static str,
    unit: &'static str,
    count: usize,
    run: fn(usize) -> Result<(), Box<dyn Error>>,
) -> Kernel {
    Kernel { name, unit, count, run }
}

const KERNELS: [Kernel; 16] = [
    kernel("soft_step, plane, pyramid of 20", "step", 20, |n| wall::<Planar>(20, n, Scheme::SoftStep, None)),
    kernel("soft_step, space, pyramid of 20", "step", 20, |n| wall::<Spatial>(20, n, Scheme::SoftStep, None)),
    kernel("soft_step, space, 100 bodies poured", "step", 40, poured),
    kernel("soft_step, plane, pyramid of 20 that bursts", "step", 40, burst::<Planar>),
    kernel("soft_step, space, pyramid of 20 that bursts", "step", 40, burst::<Spatial>),
    kernel("pgs, plane, pyramid of 20", "step", 6, |n| {
        wall::<Planar>(20, n, Scheme::FixedStep, Some(SolverKind::Pgs))
    }),
    kernel("pgs, space, pyramid of 10", "step", 6, |n| {
        wall::<Spatial>(10, n, Scheme::FixedStep, Some(SolverKind::Pgs))
    }),
    kernel("exact, plane, pyramid of 20", "step", 3, |n| {
        wall::<Planar>(20, n, Scheme::FixedStep, Some(SolverKind::Exact))
    }),
    kernel("exact, space, pyramid of 10", "step", 3, |n| {
        wall::<Spatial>(10, n, Scheme::FixedStep, Some(SolverKind::Exact))
    }),
    kernel("events, plane, pyramid of 10", "step", 5, |n| wall::<Planar>(10, n, Scheme::Events, None)),
    kernel("pgs, sweep of a lattice of 216 balls", "sweep", 20, |n| {
        solve(SolverKind::Pgs, &sphere_lattice::<Spatial>(6, &Variation::perturbed(3))?, [n, 1])
    }),
    kernel("exact, brick wall of 12 rows to 1e-8", "solve", 2, |n| {
        solve(SolverKind::Exact, &brick_wall::<Spatial>(8, 12, &Variation::at_rest(3))?, [10_000, n])
    }),
    kernel("box on box in space, moving", "pair", 2000, |n| {
        pairs::<Spatial>(Spatial::block(1.0, 1.0, 1.0), n)
    }),
    kernel("hull of 24 corners on another, moving", "pair", 500, |n| {
        let mut chance = Chance::new(9);
        let points = (0..24).map(|_| chance.direction() * 0.6).collect();
        pairs::<Spatial>(carom::SpatialShape::ConvexHull { points }, n)
    }),
    kernel("box on box in the plane, moving", "pair", 2000, |n| {
        pairs::<Planar>(Planar::block(1.0, 1.0, 1.0), n)
    }),
    kernel("pairs of 1000 boxes that move, in space", "update", 5, broad),
];

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [name, count] = arguments.as_slice() else {
        KERNELS.iter().for_each(|k| println!("{}\t{}\t{}", k.name, k.unit, k.count));
        return Ok(());
    };
    let kernel = KERNELS.iter().find(|k| k.name == name).ok_or("no kernel of this name")?;
    (kernel.run)(count.parse()?)
}

/// Steps of a wall, built as in the race.
fn wall<S: Stage>(
    base: usize,
    count: usize,
    scheme: Scheme,
    solver: Option<SolverKind>,
) -> Result<(), Box<dyn Error>> {
    let mut world = stacking::pyramid::<S>(base)?;
    let tolerance = if solver == Some(SolverKind::Exact) { 1e-8 } else { world.settings().tolerance };
    world.set_settings(Settings { scheme, solver, tolerance, ..world.settings().clone() })?;
    steps(&mut world, count)
}

/// Steps of a wall whose blocks fly: hardly a point is used again, and many boxes overlap that do not meet.
fn burst<S: Stage>(count: usize) -> Result<(), Box<dyn Error>> {
    let mut world = stacking::pyramid::<S>(20)?;
    world.set_settings(Settings { scheme: Scheme::SoftStep, ..world.settings().clone() })?;
    let mut chance = Chance::new(5);
    let moving: Vec<usize> = (0..world.bodies().len()).filter(|i| world.bodies().is_dynamic(*i)).collect();
    for i in moving {
        world.motion_mut().velocity[i] = S::Vector::from_fn(|_| chance.between(-6.0, 6.0));
    }
    steps(&mut world, count)
}

/// Bodies of six kinds that fall into a box.
fn poured(count: usize) -> Result<(), Box<dyn Error>> {
    let mut world = pouring::pile(100)?;
    world.set_settings(Settings { scheme: Scheme::SoftStep, ..world.settings().clone() })?;
    (0..60).try_for_each(|_| world.step(1.0 / 60.0).map(drop))?;
    steps(&mut world, count)
}

fn steps<S: Geometry>(world: &mut World<S>, count: usize) -> Result<(), Box<dyn Error>> {
    (0..count).try_for_each(|_| world.step(1.0 / 120.0).map(drop))?;
    Ok(())
}

/// Solves of a problem from nothing, of so many iterations each.
fn solve<S: Geometry>(
    kind: SolverKind,
    problem: &carom::ContactProblem<S>,
    [iterations, solves]: [usize; 2],
) -> Result<(), Box<dyn Error>> {
    let tolerance = if kind == SolverKind::Exact { 1e-8 } else { 0.0 };
    let settings = SolveSettings { iterations, tolerance, ..SolveSettings::default() };
    for _ in 0..solves {
        let mut impulses = Impulses::zero(problem);
        std::hint::black_box(kind.make::<S>().solve(problem, &settings, &mut impulses));
    }
    Ok(())
}

/// Contact points of two equal shapes that lie on each other, a little turned and moved from pair to pair.
fn pairs<S: Stage>(shape: S::Shape, count: usize) -> Result<(), Box<dyn Error>> {
    let collider = S::collider(&shape).map_err(|e| format!("{e:?}"))?;
    let (mut chance, mut points, still) = (Chance::new(4), Vec::new(), Pose::default());
    let mut pose = || {
        let mut at = S::Vector::default();
        for k in 0..S::DIM {
            at[k] = chance.between(-0.02, 0.02) + if k + 1 == S::DIM { 0.99 } else { 0.2 };
        }
        Pose::new(at, S::Rotation::about(Column::from_fn(|_| chance.between(-0.02, 0.02))))
    };
    for _ in 0..count.div_ceil(ABREAST) {
        let some: [Pose<S>; ABREAST] = std::array::from_fn(|_| pose());
        points.clear();
        // as steps look at them
        if S::go_abreast(&collider, &collider) {
            let look = |k: usize| Look { colliders: [&collider; 2], poses: [&some[k], &still], margin: 0.02 };
            let looks: [Look<'_, S>; ABREAST] = std::array::from_fn(look);
            S::contacts_abreast(&looks, &mut points);
        } else {
            for pose in &some {
                S::contacts(&collider, pose, &collider, &still, 0.02, &mut points);
            }
        }
        std::hint::black_box(&points);
    }
    Ok(())
}

/// Pairs of boxes of three sizes in a heap, all of which move.
fn broad(count: usize) -> Result<(), Box<dyn Error>> {
    let (mut chance, mut phase) = (Chance::new(8), BroadPhase::<Spatial>::new());
    let movable = vec![true; 1000];
    let mut bounds: Vec<Aabb<Spatial>> = (0..1000)
        .map(|k| {
            let half = carom::vec3(0.1, 0.1, 0.1) * [1.0, 1.5, 3.0][k % 3];
            let at =
                carom::vec3(chance.between(-1.0, 1.0), chance.between(-1.0, 1.0), chance.between(-1.0, 1.0));
            Aabb { min: at - half, max: at + half }
        })
        .collect();
    for _ in 0..count {
        std::hint::black_box(phase.update(&bounds, &movable, &|_, _| true));
        for b in &mut bounds {
            let by = chance.direction() * 0.01;
            b.min += by;
            b.max += by;
        }
    }
    Ok(())
}
