//! The race on one scene: every engine that takes it, in turns (A B A B ...), medians over the turns. The judge sits in the
//! first turn. Knows no engine by name.

use crate::arguments::Arguments;
use crate::catalogue::{Catalogue, scene};
use crate::engine::Choice;
use crate::engines::{Entrant, Field};
use crate::judge::Judge;
use crate::rows::Row;
use crate::run::{Quality, Run, judged, run};
use crate::scene::Scene;

/// What one engine has done on a scene so far.
struct Lane<'a, S: Field> {
    entrant: &'a Entrant<S>,
    runs: Vec<Run>,
    quality: Option<Quality>,
    /// Time of its steps so far \[s\].
    used: f64,
    out: bool,
}

/// What is done with the rows of a scene and choice, which the text names.
pub type Done<'a> = &'a mut dyn FnMut(&str, Vec<Row>) -> Result<(), String>;

/// All rows of a scene, choice by choice; `done` gets those of each choice as soon as they are there.
///
/// # Errors
/// A scene that the judge cannot weigh, or what `done` says.
pub fn race<S: Field + Catalogue>(
    word: &str,
    entrants: &[Entrant<S>],
    arguments: &Arguments,
    done: Done,
) -> Result<(), String> {
    let Some(scene) = scene::<S>(word)? else { return Ok(()) };
    let mut judge = Judge::of(&scene)?;
    for &sleeping in &arguments.sleeping {
        for &threads in &arguments.threads {
            let choice = Choice { threads, sleeping };
            let rows = lanes(&scene, choice, entrants, arguments, &mut judge)?;
            if !rows.is_empty() {
                let asleep = if sleeping { "sleeping" } else { "awake" };
                let title = format!(
                    "{}/{}: {} bodies, {} steps, {threads} thread(s), {asleep}",
                    S::NAME,
                    scene.name,
                    scene.moving(),
                    scene.steps
                );
                done(&title, rows)?;
            }
        }
    }
    Ok(())
}

fn lanes<S: Field>(
    scene: &Scene<S>,
    choice: Choice,
    entrants: &[Entrant<S>],
    arguments: &Arguments,
    judge: &mut Judge<S>,
) -> Result<Vec<Row>, String> {
    let takes = |e: &&Entrant<S>| e.takes(choice, scene.bodies.len());
    let mut lanes: Vec<Lane<S>> = entrants
        .iter()
        .filter(takes)
        .map(|entrant| Lane { entrant, runs: Vec::new(), quality: None, used: 0.0, out: false })
        .collect();
    for turn in 0..arguments.repeats {
        for lane in lanes.iter_mut().filter(|lane| !lane.out) {
            eprint!("\r\x1b[K{}/{} turn {} {} ", S::NAME, scene.name, turn + 1, lane.entrant.engine);
            if let Err(problem) = lane.go(scene, choice, arguments.patience, judge) {
                eprintln!("\r\x1b[KSKIPPED {} on {}: {problem}", lane.entrant.engine, scene.name);
                lane.out = true;
            }
        }
    }
    eprint!("\r\x1b[K");
    Ok(lanes.iter().filter_map(|lane| lane.row(scene, choice)).collect())
}

impl<S: Field> Lane<'_, S> {
    /// One turn.
    fn go(
        &mut self,
        scene: &Scene<S>,
        choice: Choice,
        patience: f64,
        judge: &mut Judge<S>,
    ) -> Result<(), String> {
        let mut engine = (self.entrant.build)(scene, choice)?;
        let left = patience - self.used;
        let taken = if self.quality.is_none() {
            let (taken, quality) = judged(engine.as_mut(), scene, judge, left)?;
            self.quality = Some(quality);
            taken
        } else {
            run(engine.as_mut(), scene.steps, left)
        };
        self.used += taken.spent.least();
        // a run that was cut says nothing that a whole one does not; the first counts all the same
        let cut = taken.steps < scene.steps;
        self.out = cut || self.used > patience;
        if let Some(problem) = &taken.trouble {
            return Err(format!("step {}: {problem}", taken.steps + 1));
        }
        if !cut || self.runs.is_empty() {
            self.runs.push(taken);
        }
        Ok(())
    }
    /// The row of the run with the median of the time that decides.
    fn row(&self, scene: &Scene<S>, choice: Choice) -> Option<Row> {
        let quality = self.quality?;
        let mut rows: Vec<Row> = self.runs.iter().map(|r| self.row_of(r, &quality, scene, choice)).collect();
        rows.sort_by(|a, b| a.deciding().total_cmp(&b.deciding()));
        let middle = rows.len().checked_sub(1)? / 2;
        rows.into_iter().nth(middle)
    }
    fn row_of(&self, run: &Run, quality: &Quality, scene: &Scene<S>, choice: Choice) -> Row {
        let (wall, cpu) = run.milliseconds();
        let m = &quality.moved;
        let each = 1.0 / run.steps as f64;
        Row {
            scene: scene.name.clone(),
            space: S::NAME,
            engine: self.entrant.engine.into(),
            solver: self.entrant.solver.clone(),
            threads: choice.threads,
            sleeping: choice.sleeping,
            bodies: scene.moving(),
            steps: run.steps,
            steps_asked: scene.steps,
            repeats: self.runs.len(),
            wall,
            cpu,
            ratio: None,
            contacts: run.contacts,
            quality: [
                quality.deepest,
                quality.last.mean,
                m.drift_max,
                m.drift_mean,
                m.speed_max,
                m.slip_direction_error,
                m.energy_gain,
            ],
            phases: run.phases.map(|p| p.scaled(each)),
        }
    }
}

/// Rows as a table for people.
pub fn table(title: &str, rows: &[Row]) -> String {
    let lines: Vec<String> = rows.iter().map(Row::line).collect();
    format!("{title}\n{}\n{}\n", crate::rows::heading(), lines.join("\n"))
}
