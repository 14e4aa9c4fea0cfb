//! What the command line asks for.

use crate::task::Task;
use carom::{EventSettings, PlasticArrivals, Scheme};
use std::path::PathBuf;

const HELP: &str = "\
simbenchmark: carom on the tasks of SimBenchmark, beside the published figures

  --dt A,B          lengths of steps in s [1e-3,1e-2,1e-1, and 1e-4 for bouncing]
  --tasks A,B       rolling_oblique, rolling_along, bouncing, 666, elastic_666 [all]
  --schemes A,B     events, events_within_the_step (plastic arrivals without their moments), fixed_step,
                    soft_step
                    [events, fixed_step]
  --tolerance X     residual that solves of events aim at, over |g| dt [1e-12, the scheme's default]; at 1e-8 balls at
                    rest creep 1e-11 m into the ground, more than 666 may
  --out FOLDER      folder of the results, FOLDER/MACHINE/simbenchmark.csv [none are written]; rows of other runs stay, and those
                    of this are written step length by step length, so that a run may be stopped at any time";

/// What to run.
pub struct Arguments {
    /// The tasks.
    pub tasks: Vec<Task>,
    /// The schemes, in the order they run.
    pub schemes: Vec<(Scheme, PlasticArrivals)>,
    /// Folder of the result files.
    pub out: Option<PathBuf>,
    /// Residual that solves of `events` aim at, over |g| dt \[1\].
    pub tolerance: f64,
    steps: Option<Vec<f64>>,
}

impl Arguments {
    /// Reads the command line.
    ///
    /// # Errors
    /// What is wrong with it, or the help that was asked for.
    pub fn parse(mut words: impl Iterator<Item = String>) -> Result<Self, String> {
        let mut given = Arguments {
            tasks: Task::ALL.to_vec(),
            schemes: vec![
                (Scheme::Events, PlasticArrivals::AtTheirMoment),
                (Scheme::FixedStep, PlasticArrivals::AtTheirMoment),
            ],
            out: None,
            tolerance: EventSettings::default().tolerance,
            steps: None,
        };
        while let Some(word) = words.next() {
            let value = words.next().ok_or_else(|| HELP.to_string())?;
            match word.as_str() {
                "--dt" => given.steps = Some(list(&value, step)?),
                "--tasks" => given.tasks = list(&value, Task::named)?,
                "--schemes" => given.schemes = list(&value, scheme)?,
                "--tolerance" => {
                    given.tolerance = value.parse().map_err(|_| format!("cannot read {value:?}\n\n{HELP}"))?
                }
                "--out" => given.out = Some(value.into()),
                _ => return Err(format!("unknown option {word}\n\n{HELP}")),
            }
        }
        Ok(given)
    }
    /// Lengths of a task's steps \[s\].
    pub fn steps_of(&self, task: Task) -> Vec<f64> {
        self.steps.clone().unwrap_or_else(|| task.usual_steps().to_vec())
    }
}

fn list<T>(value: &str, read: impl Fn(&str) -> Option<T>) -> Result<Vec<T>, String> {
    let one = |word: &str| read(word).ok_or_else(|| format!("cannot read {word:?}\n\n{HELP}"));
    value.split(',').map(one).collect()
}

fn step(word: &str) -> Option<f64> {
    word.parse().ok().filter(|dt| *dt > 0.0 && *dt <= 1.0)
}

fn scheme(word: &str) -> Option<(Scheme, PlasticArrivals)> {
    match word {
        "events" => Some((Scheme::Events, PlasticArrivals::AtTheirMoment)),
        "events_within_the_step" => Some((Scheme::Events, PlasticArrivals::WithinTheStep)),
        "fixed_step" => Some((Scheme::FixedStep, PlasticArrivals::AtTheirMoment)),
        "soft_step" => Some((Scheme::SoftStep, PlasticArrivals::AtTheirMoment)),
        _ => None,
    }
}
