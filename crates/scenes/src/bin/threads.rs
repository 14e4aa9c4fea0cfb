//! What threads save: worlds of the same scene on one thread and on several, stepped in turn, medians of their steps, and whether
//! they came to the same bits. `threads [N]` takes N threads, 2 unless said. What it does not do: run another engine.

use carom::{Geometry, Planar, Scheme, Settings, SolverKind, Spatial, World};
use carom_scenes::{pouring, stacking};
use std::error::Error;
use std::time::Instant;

/// Steps that are not told: what is found once, and faces that have just come to touch.
const BEGINNING: usize = 3;

fn main() -> Result<(), Box<dyn Error>> {
    let threads = std::env::args().nth(1).map_or(Ok(2), |n| n.parse::<usize>())?;
    println!("{:42}{:>9}{:>9}{:>9}{:>8}{:>6}", "ms of a step", "contacts", "one", threads, "ratio", "bits");
    let (soft, fixed) = (Scheme::SoftStep, Scheme::FixedStep);
    let same = [
        race("soft_step, plane, pyramid of 100", threads, 60, || {
            with(stacking::pyramid::<Planar>(100)?, soft, None)
        })?,
        race("soft_step, space, pyramid of 60", threads, 40, || {
            with(stacking::pyramid::<Spatial>(60)?, soft, None)
        })?,
        race("soft_step, space, 1,000 bodies poured", threads, 60, || {
            with(pouring::pile(1000)?, soft, None)
        })?,
        race("exact, plane, 100 stacks of 4", threads, 30, || {
            with(stacking::stacks::<Planar>(100, 4)?, fixed, Some(SolverKind::Exact))
        })?,
        race("exact, space, 100 stacks of 4", threads, 30, || {
            with(stacking::stacks::<Spatial>(100, 4)?, fixed, Some(SolverKind::Exact))
        })?,
        race("auto, space, 100 stacks of 4", threads, 30, || {
            with(stacking::stacks::<Spatial>(100, 4)?, fixed, Some(SolverKind::Auto))
        })?,
    ];
    if same.contains(&false) { Err("the number of threads shows".into()) } else { Ok(()) }
}

/// A world with another scheme and solver, to 1e-8 m/s where the solver goes by that.
fn with<S: Geometry>(
    mut world: World<S>,
    scheme: Scheme,
    solver: Option<SolverKind>,
) -> Result<World<S>, Box<dyn Error>> {
    let tolerance = if solver.is_some() { 1e-8 } else { world.settings().tolerance };
    world.set_settings(Settings { scheme, solver, tolerance, ..world.settings().clone() })?;
    Ok(world)
}

/// Prints what a scene costs; true where the worlds came to the same.
fn race<S: Geometry>(
    name: &str,
    threads: usize,
    steps: usize,
    scene: impl Fn() -> Result<World<S>, Box<dyn Error>>,
) -> Result<bool, Box<dyn Error>> {
    let mut worlds = [scene()?, scene()?];
    worlds[1].set_threads(threads)?;
    let (mut spent, mut contacts) = ([Vec::new(), Vec::new()], 0);
    for _ in 0..steps {
        for (world, spent) in worlds.iter_mut().zip(&mut spent) {
            let (begun, dt) = (Instant::now(), world.settings().dt);
            let report = world.step(dt)?;
            spent.push(begun.elapsed().as_secs_f64() * 1e3);
            contacts = report.contact_solve.map_or(0, |solve| solve.contacts);
        }
    }
    let [one, several] = spent.map(|all| median(all[BEGINNING..].to_vec()));
    let same = worlds[0].snapshot() == worlds[1].snapshot();
    let bits = if same { "same" } else { "OTHER" };
    println!("{name:42}{contacts:9}{one:9.2}{several:9.2}{:8.2}{bits:>6}", several / one);
    Ok(same)
}

fn median(mut all: Vec<f64>) -> f64 {
    all.sort_by(f64::total_cmp);
    all[all.len() / 2]
}
