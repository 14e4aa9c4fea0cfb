//! What accuracy costs: the contact problems of some steps, solved from nothing by `auto` and by `pgs` alone to the same tolerances.
//! `accuracy` prints milliseconds and the largest residual of both. It ends with 1 where `auto` takes longer than a `pgs` that is
//! as accurate, at a tolerance below 1e-2. What it does not do: run another engine.

use carom::solver::{Impulses, SolveSettings};
use carom::{ContactProblem, Geometry, Planar, Scheme, Settings, SolverKind, Spatial, World};
use carom_scenes::{pouring, stacking};
use std::error::Error;
use std::time::Instant;

/// Residuals that are asked for \[m/s\].
const TOLERANCES: [f64; 8] = [1e-2, 5e-3, 2e-3, 1e-3, 1e-4, 1e-5, 1e-6, 1e-8];
/// Sweeps that `pgs` may take.
const SWEEPS: usize = 3000;
/// Problems of a scene.
const PROBLEMS: usize = 4;
/// Times that a solve is taken, the quickest of which counts; one that takes long is taken once.
const TIMES: usize = 9;
const LONG: f64 = 20.0;
/// What a clock may tell too much \[1\].
const NOISE: f64 = 1.1;

/// What a solver made of a scene's problems.
#[derive(Default)]
struct Cost {
    milliseconds: f64,
    residual: f64,
}

fn main() -> Result<(), Box<dyn Error>> {
    let heading = ["tolerance", "auto [ms]", "residual", "pgs [ms]", "residual", "ratio"];
    println!("{:28}{}", "", heading.map(|name| format!("{name:>11}")).concat());
    let worse = [
        scene("plane, pyramid of 20", stacking::pyramid::<Planar>(20)?, 10)?,
        scene("space, pyramid of 10", stacking::pyramid::<Spatial>(10)?, 10)?,
        scene("plane, 20 stacks of ten", stacking::stacks::<Planar>(20, 10)?, 10)?,
        scene("space, 100 bodies poured", pouring::pile(100)?, 80)?,
    ];
    match worse.iter().sum::<usize>() {
        0 => Ok(()),
        n => Err(format!("`pgs` alone is cheaper in {n} cases").into()),
    }
}

/// A line for each tolerance, over problems from one step in `every`; how often `pgs` alone is cheaper below 1e-2.
fn scene<S: Geometry>(name: &str, world: World<S>, every: usize) -> Result<usize, Box<dyn Error>> {
    let (problems, mut worse) = (problems(world, every)?, 0);
    for tolerance in TOLERANCES {
        let [auto, pgs] =
            [SolverKind::Auto, SolverKind::Pgs].map(|solver| cost(&problems, solver, tolerance));
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

/// Problems of a scene that is stepped with `exact`.
fn problems<S: Geometry>(
    mut world: World<S>,
    every: usize,
) -> Result<Vec<ContactProblem<S>>, Box<dyn Error>> {
    let (scheme, solver, tolerance) = (Scheme::FixedStep, Some(SolverKind::Exact), 1e-8);
    world.set_settings(Settings { scheme, solver, tolerance, ..world.settings().clone() })?;
    let mut problems = Vec::new();
    for step in 1..=PROBLEMS * every {
        world.step(world.settings().dt)?;
        if step.is_multiple_of(every) {
            problems.push(world.last_problem().0.clone());
        }
    }
    Ok(problems)
}

/// Mean milliseconds of a problem and the largest residual, at a tolerance.
fn cost<S: Geometry>(problems: &[ContactProblem<S>], solver: SolverKind, tolerance: f64) -> Cost {
    let iterations = if solver == SolverKind::Pgs { SWEEPS } else { SolveSettings::default().iterations };
    let settings = SolveSettings { iterations, tolerance, ..SolveSettings::default() };
    // one for all, as in a world: its memory lasts, and no answer depends on it
    let (mut solver, mut all) = (solver.make::<S>(), Cost::default());
    for problem in problems {
        let mut quickest = f64::INFINITY;
        for _ in 0..TIMES {
            let (mut impulses, begun) = (Impulses::zero(problem), Instant::now());
            let outcome = solver.solve(problem, &settings, &mut impulses);
            quickest = quickest.min(begun.elapsed().as_secs_f64() * 1e3);
            all.residual = all.residual.max(outcome.residual.absolute);
            if quickest > LONG {
                break;
            }
        }
        all.milliseconds += quickest / problems.len() as f64;
    }
    all
}
