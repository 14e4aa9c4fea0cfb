//! Options of the commands: `--name value` pairs.

use std::path::PathBuf;

/// Named values; every one has a default.
pub struct Options {
    /// Solvers by name; empty for all.
    pub solvers: Vec<String>,
    /// Tolerance of a solve \[1\].
    pub tolerance: f64,
    /// CPU seconds after which a solve is asked to stop.
    pub limit: f64,
    /// First seed.
    pub seed: u64,
    /// Number of seeds.
    pub seeds: u64,
    /// Largest number of contacts.
    pub largest: usize,
    /// Bodies of piles to settle.
    pub piles: Vec<usize>,
    /// Folder of flat problem files.
    pub folder: Option<PathBuf>,
    /// Folder of results, or of the files made.
    pub out: Option<PathBuf>,
}

impl Options {
    /// Reads `--name value` pairs.
    ///
    /// # Errors
    /// The word that is not understood.
    pub fn parse(words: &[String]) -> Result<Self, String> {
        let mut given = Options {
            solvers: Vec::new(),
            tolerance: 1e-8,
            limit: 10.0,
            seed: 1,
            seeds: 1,
            largest: 100_000,
            piles: Vec::new(),
            folder: None,
            out: None,
        };
        let (pairs, rest) = words.as_chunks::<2>();
        if let Some(word) = rest.first() {
            return Err(format!("{word} needs a value"));
        }
        for [word, value] in pairs {
            let not_a_number = || format!("{word} needs a number, got {value:?}");
            let number = || value.parse::<f64>().map_err(|_| not_a_number());
            let whole = || value.parse::<u64>().map_err(|_| not_a_number());
            match word.as_str() {
                "--solvers" => {
                    given.solvers = value.split(',').filter(|s| !s.is_empty()).map(str::to_string).collect();
                }
                "--tolerance" => given.tolerance = number()?,
                "--limit" => given.limit = number()?,
                "--seed" => given.seed = whole()?,
                "--seeds" => given.seeds = whole()?,
                "--largest" => given.largest = whole()? as usize,
                "--piles" => {
                    let counts = value.split(',').map(|n| n.parse().map_err(|_| not_a_number()));
                    given.piles = counts.collect::<Result<_, _>>()?;
                }
                "--folder" => given.folder = Some(value.into()),
                "--out" => given.out = Some(value.into()),
                _ => return Err(format!("unknown option {word}")),
            }
        }
        Ok(given)
    }
    /// True when a solver of this name is wanted.
    pub fn wants(&self, solver: &str) -> bool {
        self.solvers.is_empty() || self.solvers.iter().any(|s| s == solver)
    }
}
