//! What the command line asks for.

use carom::SolverKind;
use std::path::PathBuf;

/// Scenes of a run that names none, with their steps: two large ones, and small ones of each kind.
const DEFAULTS: [(&str, usize); 10] = [
    ("card_house", 240),
    ("pyramid_planar", 120),
    ("pyramid_small_planar", 240),
    ("stack_planar", 240),
    ("dominoes", 480),
    ("pile", 480),
    ("pile_small", 480),
    ("pyramid_small_spatial", 120),
    ("rocks_on_terrain", 480),
    ("stack_spatial", 240),
];

const HELP: &str = "\
carom-bench: carom beside Rapier on the same scenes

  --scenes A,B      scenes of the catalogue [ten of them]
  --steps N         steps of each run [chosen per scene]
  --repeats R       runs of each engine, in turns; the median counts [3]
  --solvers A,B     solvers of carom [pgs, and once each: pgs_matrix, sequential, direct, lemke]
  --patience S      longest time that a solver other than pgs may take per scene, in s [6]
  --machine NAME    label of this machine [made from the processor's name]
  --out FOLDER      folder of the result files, one FOLDER/MACHINE/SCENE.csv per scene [none are written]

penetration_max is the deepest overlap over the run in m, speed_max the fastest body at its end in m/s, both found
in f64 from the poses of either engine; residual_max is carom's natural-map residual over the run in m/s.";

/// What to run.
pub struct Arguments {
    /// Scenes by name.
    pub scenes: Vec<String>,
    /// Steps of every scene, when given.
    steps: Option<usize>,
    /// Runs of each engine.
    pub repeats: usize,
    /// Solvers of carom.
    pub solvers: Vec<SolverKind>,
    /// Longest time of a solver other than pgs on a scene \[s\].
    pub patience: f64,
    /// Folder of the results with the machine's label.
    pub out: Option<PathBuf>,
}

impl Arguments {
    /// Reads the command line.
    pub fn parse(mut words: impl Iterator<Item = String>) -> Result<Self, String> {
        let mut given = Arguments {
            scenes: DEFAULTS.iter().map(|d| d.0.to_string()).collect(),
            steps: None,
            repeats: 3,
            solvers: SolverKind::ALL.to_vec(),
            patience: 6.0,
            out: None,
        };
        // pgs is the one that is compared: it comes first
        given.solvers.sort_by_key(|k| *k != SolverKind::Pgs);
        let (mut machine, mut folder) = (None, None);
        while let Some(word) = words.next() {
            if word == "--help" || word == "-h" {
                return Err(HELP.into());
            }
            let value = words.next().ok_or_else(|| format!("{word} needs a value\n\n{HELP}"))?;
            match word.as_str() {
                "--scenes" => given.scenes = value.split(',').map(str::to_string).collect(),
                "--steps" => given.steps = Some(number(&word, &value)?),
                "--repeats" => given.repeats = number(&word, &value)?,
                "--solvers" => given.solvers = value.split(',').map(str::parse).collect::<Result<_, _>>()?,
                "--patience" => {
                    given.patience =
                        value.parse().map_err(|_| format!("{word} needs seconds, got {value:?}"))?
                }
                "--machine" => machine = Some(value),
                "--out" => folder = Some(PathBuf::from(value)),
                _ => return Err(format!("unknown option {word}\n\n{HELP}")),
            }
        }
        given.out = folder.map(|f| carom_scenes::results::folder(&f, machine.as_deref()));
        Ok(given)
    }
    /// Steps of a scene.
    pub fn steps_of(&self, scene: &str) -> usize {
        let usual = DEFAULTS.iter().find(|d| d.0 == scene).map_or(240, |d| d.1);
        self.steps.unwrap_or(usual)
    }
}

fn number(word: &str, value: &str) -> Result<usize, String> {
    let parsed = value.parse().ok().filter(|n| *n > 0);
    parsed.ok_or_else(|| format!("{word} needs a whole number > 0, got {value:?}"))
}
