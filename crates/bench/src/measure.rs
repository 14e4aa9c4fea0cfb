//! Runs contenders in turns (A B A B ...) and takes medians. Only `step` is timed; the judge looks in between.

use crate::arguments::Arguments;
use crate::contender::Contender;
use crate::ours::Ours;
use crate::peer::Peer;
use crate::table::{Figures, Row};
use carom::{BuildError, Geometry, SolverKind, World};
use carom_scenes::judge::Judge;
use std::time::Instant;

/// The judge looks after every so many steps, and after the last one.
const LOOK_EVERY: usize = 10;

/// All rows of a scene.
///
/// # Errors
/// An unknown scene, or one that Rapier has no shapes for.
pub fn scene(name: &str, arguments: &Arguments) -> Result<Vec<Row>, String> {
    if carom_scenes::planar(name).is_some() {
        return rows(name, &|| carom_scenes::planar(name).expect("just found"), arguments);
    }
    if carom_scenes::spatial(name).is_some() {
        return rows(name, &|| carom_scenes::spatial(name).expect("just found"), arguments);
    }
    let known: Vec<&str> = carom_scenes::catalogue().iter().map(|s| s.name).collect();
    Err(format!("no such scene; known: {}", known.join(", ")))
}

/// Makes a fresh world of a scene.
type Build<'a, S> = &'a dyn Fn() -> Result<World<S>, BuildError>;

fn rows<S: Peer>(name: &str, build: Build<S>, arguments: &Arguments) -> Result<Vec<Row>, String> {
    let world = build().map_err(|e| e.to_string())?;
    let steps = arguments.steps_of(name);
    let mut judge = Judge::of(&world);
    let mut theirs = Vec::new();
    let mut mine: Vec<(SolverKind, Vec<Result<Figures, String>>)> =
        arguments.solvers.iter().map(|k| (*k, Vec::new())).collect();
    for turn in 0..arguments.repeats {
        for (kind, runs) in &mut mine {
            let compared = *kind == SolverKind::Pgs;
            if turn > 0 && !compared {
                continue;
            }
            let mut world = build().map_err(|e| e.to_string())?;
            let settings = carom::Settings { solver: Some(*kind), ..world.settings().clone() };
            world.set_settings(settings).map_err(|e| e.to_string())?;
            let patience = if compared { f64::INFINITY } else { arguments.patience };
            runs.push(run(&mut Ours { world }, &mut judge, steps, patience));
        }
        let mut peer = S::rapier(&build().map_err(|e| e.to_string())?)?;
        theirs.push(run(peer.as_mut(), &mut judge, steps, f64::INFINITY));
    }
    let bodies = world.bodies().data.iter().filter(|d| d.inverse_mass > 0.0).count();
    let row = |engine: &str, solver: &str, figures: Result<Figures, String>, beside: Option<f64>| Row {
        scene: name.into(),
        space: S::NAME,
        engine: engine.into(),
        solver: solver.into(),
        bodies,
        ratio: figures.as_ref().ok().zip(beside).map(|(f, b)| f.milliseconds / b),
        figures,
    };
    let theirs = median(theirs);
    let beside = theirs.as_ref().ok().map(|f| f.milliseconds);
    let mut all: Vec<Row> =
        mine.into_iter().map(|(kind, runs)| row("carom", kind.name(), median(runs), beside)).collect();
    all.push(row("rapier", "default", theirs, beside));
    Ok(all)
}

/// One run; stops early when it has used up its patience \[s\].
fn run<S: Geometry>(
    contender: &mut dyn Contender<S>,
    judge: &mut Judge<S>,
    steps: usize,
    patience: f64,
) -> Result<Figures, String> {
    let mut figures = Figures::default();
    let mut seconds = 0.0;
    while figures.steps < steps && seconds < patience {
        let start = Instant::now();
        let told = contender.step();
        seconds += start.elapsed().as_secs_f64();
        let told = told.map_err(|e| format!("step {}: {e}", figures.steps + 1))?;
        figures.steps += 1;
        figures.residual = figures.residual.into_iter().chain(told.residual).reduce(f64::max);
        if figures.steps % LOOK_EVERY == 0 || figures.steps == steps {
            figures.penetration = figures.penetration.max(judge.deepest(&contender.poses()));
        }
    }
    figures.milliseconds = 1e3 * seconds / figures.steps as f64;
    figures.contacts = contender.contacts();
    figures.speed = contender.top_speed();
    Ok(figures)
}

/// The run with the median time; every run of a contender ends with the same bodies in the same places.
fn median(runs: Vec<Result<Figures, String>>) -> Result<Figures, String> {
    let mut runs = runs.into_iter().collect::<Result<Vec<_>, _>>()?;
    runs.sort_by(|a, b| a.milliseconds.total_cmp(&b.milliseconds));
    let middle = runs.len() / 2;
    runs.into_iter().nth(middle).ok_or_else(|| "no runs".into())
}
