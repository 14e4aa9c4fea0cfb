//! What the command line asks for.

use crate::task::{Choice, Task};
use carom::PlasticArrivals;
use std::path::PathBuf;
use std::time::Duration;

const HELP: &str = "\
heaps: carom's scheme events on heaps, held to energy, overlap and books in every step

  --tasks A,B       bin (50 tilted boxes and 200 hulls dropped into a bin), pour (1000 mixed convex bodies), kapla
                    (a tower of 102 planks) [all]
  --time S          time to simulate of each task in s [bin until it rests, 20 at most; pour 3; kapla 600]
  --limit S         wall-clock seconds of each task, after which it ends with what it has [none]
  --dt S            length of a step in s [bin, pour 1/240; kapla 1/60]
  --tolerance X     residual that solves aim at, over |g| dt [bin, pour 1e-7; kapla 1e-12, the default of events]
  --asked X         residual that does where that takes long, in m/s [pour 1e-4; bin, kapla 1e-6]
  --arrivals A      at_their_moment or within_the_step [bin, pour within_the_step; kapla at_their_moment]
  --out FOLDER      folder of the results, FOLDER/MACHINE/heaps.csv [none are written]; rows of other runs stay, and
                    those of this are written every few seconds, so that a run may be stopped at any time";

/// What to run.
#[derive(Debug)]
pub struct Arguments {
    /// The tasks.
    pub tasks: Vec<Task>,
    /// Wall-clock time that a task may take.
    pub limit: Option<Duration>,
    /// Folder of the result files.
    pub out: Option<PathBuf>,
    time: Option<f64>,
    dt: Option<f64>,
    tolerance: Option<f64>,
    asked: Option<f64>,
    arrivals: Option<PlasticArrivals>,
}

impl Arguments {
    /// Reads the command line.
    ///
    /// # Errors
    /// What is wrong with it, or the help that was asked for.
    pub fn parse(mut words: impl Iterator<Item = String>) -> Result<Self, String> {
        let (mut time, mut dt, mut tolerance, mut asked, mut arrivals) = (None, None, None, None, None);
        let (mut tasks, mut limit, mut out) = (Task::ALL.to_vec(), None, None);
        while let Some(word) = words.next() {
            let value = words.next().ok_or_else(|| HELP.to_string())?;
            match word.as_str() {
                "--tasks" => {
                    tasks = value.split(',').map(|name| known(name, Task::named)).collect::<Result<_, _>>()?
                }
                "--time" => time = Some(known(&value, positive)?),
                "--limit" => limit = Some(Duration::from_secs_f64(known(&value, positive)?)),
                "--dt" => dt = Some(known(&value, positive)?),
                "--tolerance" => tolerance = Some(known(&value, positive)?),
                "--asked" => asked = Some(known(&value, positive)?),
                "--arrivals" => arrivals = Some(known(&value, way)?),
                "--out" => out = Some(value.into()),
                _ => return Err(format!("unknown option {word}\n\n{HELP}")),
            }
        }
        Ok(Arguments { tasks, limit, out, time, dt, tolerance, asked, arrivals })
    }
    /// How a task is to run.
    pub fn choice(&self, task: Task) -> Choice {
        let usual = task.usual();
        Choice {
            dt: self.dt.unwrap_or(usual.dt),
            tolerance: self.tolerance.unwrap_or(usual.tolerance),
            asked: self.asked.unwrap_or(usual.asked),
            arrivals: self.arrivals.unwrap_or(usual.arrivals),
            time: self.time.unwrap_or(usual.time),
        }
    }
}

fn known<T>(word: &str, read: impl Fn(&str) -> Option<T>) -> Result<T, String> {
    read(word).ok_or_else(|| format!("cannot read {word:?}\n\n{HELP}"))
}

fn positive(word: &str) -> Option<f64> {
    word.parse().ok().filter(|x: &f64| *x > 0.0 && *x <= 1e9)
}

fn way(word: &str) -> Option<PlasticArrivals> {
    match word {
        "at_their_moment" => Some(PlasticArrivals::AtTheirMoment),
        "within_the_step" => Some(PlasticArrivals::WithinTheStep),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parsed(line: &str) -> Result<Arguments, String> {
        Arguments::parse(line.split_whitespace().map(str::to_string))
    }

    #[test]
    fn what_is_asked_for_replaces_what_is_usual_and_nothing_else_does() {
        let given = parsed("--tasks kapla,bin --time 2.5 --limit 60").expect("possible");
        assert_eq!(given.tasks, [Task::Kapla, Task::Bin]);
        assert_eq!(given.limit, Some(Duration::from_secs(60)));
        for task in Task::ALL {
            let (usual, choice) = (task.usual(), given.choice(task));
            assert_eq!((choice.time, choice.dt, choice.tolerance), (2.5, usual.dt, usual.tolerance));
            assert_eq!(choice.asked, usual.asked);
            assert_eq!(choice.arrivals, usual.arrivals);
        }
    }

    #[test]
    fn what_cannot_be_read_is_named() {
        for line in ["--tasks heap", "--dt 0", "--time -1", "--tolerance x", "--arrivals late", "--speed 1"] {
            let told = parsed(line).expect_err(line);
            assert!(told.contains(line.split(' ').nth(usize::from(line != "--speed 1")).expect("two words")));
        }
        assert_eq!(parsed("--help").expect_err("no value"), HELP);
    }
}
