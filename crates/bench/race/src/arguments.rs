//! What the command line asks for.

use crate::catalogue::{USUAL, knows};
use crate::engines::NAMES;
use carom::{Planar, Spatial};
use std::path::PathBuf;

const HELP: &str = "\
carom-race: carom and its peers on the same scenes in one run

  --scenes A,B      scenes: NAME or NAME:SIZE, behind planar/ or spatial/ where both spaces have it [those of the README]
  --engines A,B     carom, box2d, box3d, rapier, jolt, mujoco, pymunk; carom/SCHEME:SOLVER for one way of carom's [all]
  --threads A,B     threads of each engine [1,2]
  --sleeping A,B    off, on: whether bodies may fall asleep [off,on]
  --repeats R       runs of each engine, in turns; the median counts [3]
  --patience S      longest time of an engine's steps per scene and choice in s; a run over it is cut [60]
  --python PATH     the Python that has MuJoCo and pymunk [python3]
  --out FOLDER      folder of the results; rows go to FOLDER/MACHINE/peers.csv after each scene [none are written]";

/// What to run.
pub struct Arguments {
    /// Scenes, as the catalogue reads them.
    pub scenes: Vec<String>,
    /// Engines; none for all.
    pub engines: Vec<String>,
    /// Numbers of threads.
    pub threads: Vec<usize>,
    /// With sleeping, without, or both.
    pub sleeping: Vec<bool>,
    /// Runs of each engine.
    pub repeats: usize,
    /// Longest time of an engine's steps \[s\].
    pub patience: f64,
    /// Python with the engines that live there.
    pub python: PathBuf,
    /// Folder of the results.
    pub out: Option<PathBuf>,
}

impl Arguments {
    /// Reads the command line.
    ///
    /// # Errors
    /// What is wrong with it, or the help that was asked for.
    pub fn parse(mut words: impl Iterator<Item = String>) -> Result<Self, String> {
        let mut given = Arguments {
            scenes: USUAL.iter().map(ToString::to_string).collect(),
            engines: Vec::new(),
            threads: vec![1, 2],
            sleeping: vec![false, true],
            repeats: 3,
            patience: 60.0,
            python: "python3".into(),
            out: None,
        };
        while let Some(word) = words.next() {
            if word == "--help" || word == "-h" {
                return Err(HELP.into());
            }
            let value = words.next().ok_or_else(|| format!("{word} needs a value\n\n{HELP}"))?;
            let wrong = || format!("{word}: {value:?} is not understood\n\n{HELP}");
            let list = || value.split(',').map(str::to_string).collect::<Vec<_>>();
            match word.as_str() {
                "--scenes" => given.scenes = list(),
                "--engines" => given.engines = list(),
                "--threads" => {
                    let threads = value.split(',').map(|t| t.parse().ok().filter(|t| *t > 0));
                    given.threads = threads.collect::<Option<_>>().ok_or_else(wrong)?;
                }
                "--sleeping" => {
                    let read = |s: &str| ["off", "on"].iter().position(|w| *w == s).map(|k| k == 1);
                    given.sleeping = value.split(',').map(read).collect::<Option<_>>().ok_or_else(wrong)?;
                }
                "--repeats" => given.repeats = value.parse().ok().filter(|r| *r > 0).ok_or_else(wrong)?,
                "--patience" => given.patience = value.parse().ok().filter(|p| *p > 0.0).ok_or_else(wrong)?,
                "--python" => given.python = value.into(),
                "--out" => given.out = Some(value.into()),
                _ => return Err(format!("unknown option {word}\n\n{HELP}")),
            }
        }
        given.check()?;
        Ok(given)
    }
    fn check(&self) -> Result<(), String> {
        for engine in &self.engines {
            if !NAMES.contains(&engine.as_str()) && !engine.starts_with("carom/") {
                return Err(format!("no engine {engine:?}; there are {}", NAMES.join(", ")));
            }
        }
        for scene in &self.scenes {
            if !knows::<Planar>(scene)? && !knows::<Spatial>(scene)? {
                return Err(format!("no scene {scene:?}; by default run: {}", USUAL.join(", ")));
            }
        }
        Ok(())
    }
}
