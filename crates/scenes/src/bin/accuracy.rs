//! What accuracy costs: steps of scenes whose contacts are solved by `auto`, and by `pgs` alone, to the same tolerance. `accuracy`
//! prints milliseconds of a step and the largest residual of both. It ends with 1 where `auto` takes longer than a `pgs` that is
//! as accurate, at a tolerance below 1e-2. What it does not do: run another engine.

use carom::{Geometry, Planar, Scheme, Settings, SolverKind, Spatial, World};
use carom_scenes::{pouring, stacking};
use std::error::Error;
use std::time::Instant;

/// Residuals that are asked for \[m/s\].
const TOLERANCES: [f64; 8] = [1e-2, 5e-3, 2e-3, 1e-3, 1e-4, 1e-5, 1e-6, 1e-8];
/// Sweeps that `pgs` may take in a step.
const SWEEPS: usize = 3000;
/// Steps that are told, and those before them.
const STEPS: usize = 30;
const BEGINNING: usize = 20;
/// What a clock may tell too much \[1\].
const NOISE: f64 = 1.1;

/// What a solver made of a scene.
struct Cost {
    milliseconds: f64,
    residual: f64,
}

fn main() -> Result<(), Box<dyn Error>> {
    let heading = ["tolerance", "auto [ms]", "residual", "pgs [ms]", "residual", "ratio"];
    println!("{:28}{}", "", heading.map(|name| format!("{name:>11}")).concat());
    let worse = [
        scene("plane, pyramid of 20", || Ok(stacking::pyramid::<Planar>(20)?))?,
        scene("space, pyramid of 10", || Ok(stacking::pyramid::<Spatial>(10)?))?,
        scene("plane, 20 stacks of ten", || Ok(stacking::stacks::<Planar>(20, 10)?))?,
        scene("space, 100 bodies poured", || Ok(pouring::pile(100)?))?,
    ];
    match worse.iter().sum::<usize>() {
        0 => Ok(()),
        n => Err(format!("`pgs` alone is cheaper in {n} cases").into()),
    }
}

/// A line for each tolerance; how often `pgs` alone is cheaper below 1e-2.
fn scene<S: Geometry>(
    name: &str,
    make: impl Fn() -> Result<World<S>, Box<dyn Error>>,
) -> Result<usize, Box<dyn Error>> {
    let mut worse = 0;
    for tolerance in TOLERANCES {
        let [auto, pgs] = [SolverKind::Auto, SolverKind::Pgs].map(|solver| run(make(), solver, tolerance));
        let (auto, pgs) = (auto?, pgs?);
        let as_accurate = pgs.residual <= tolerance.max(auto.residual);
        let ratio = auto.milliseconds / pgs.milliseconds;
        worse += usize::from(tolerance < 1e-2 && as_accurate && ratio > NOISE);
        let told = if as_accurate { format!("{ratio:11.2}") } else { "not so far".into() };
        println!(
            "{name:28}{tolerance:11.0e}{:11.3}{:11.1e}{:11.3}{:11.1e}{told:>11}",
            auto.milliseconds, auto.residual, pgs.milliseconds, pgs.residual
        );
    }
    Ok(worse)
}

/// Median milliseconds of a step and the largest residual, at a tolerance.
fn run<S: Geometry>(
    world: Result<World<S>, Box<dyn Error>>,
    solver: SolverKind,
    tolerance: f64,
) -> Result<Cost, Box<dyn Error>> {
    let mut world = world?;
    let iterations = if solver == SolverKind::Pgs { SWEEPS } else { Settings::<S>::default().iterations };
    let (scheme, solver) = (Scheme::FixedStep, Some(solver));
    world.set_settings(Settings { scheme, solver, tolerance, iterations, ..world.settings().clone() })?;
    let (mut spent, mut residual) = (Vec::new(), 0.0_f64);
    for step in 0..BEGINNING + STEPS {
        let (begun, dt) = (Instant::now(), world.settings().dt);
        let report = world.step(dt)?;
        if step >= BEGINNING {
            spent.push(begun.elapsed().as_secs_f64() * 1e3);
            residual = residual.max(report.contact_solve.map_or(0.0, |solve| solve.residual));
        }
    }
    spent.sort_by(f64::total_cmp);
    Ok(Cost { milliseconds: spent[spent.len() / 2], residual })
}
