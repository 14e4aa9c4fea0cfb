//! `carom-contact time`: one solver on one problem file, in the words and the lines that all timed programs share.

use crate::solvers;
use crate::timing::{Rules, iterations, time};
use carom::solver::{FrictionProblem, FrictionSettings};
use carom_scenes::contact_problems::read_flat;
use std::fs::{File, OpenOptions};
use std::io::{BufReader, Write};

/// Words of the command, after `time`.
pub const USAGE: &str = "\
carom-contact time PROBLEM.bin SOLVER TOLERANCES FIRST REPEATS BUDGET LIMIT OUT
carom-contact time --list

  PROBLEM.bin  flat file; SOLVER by name; TOLERANCES with commas
  FIRST        tolerance that the solver is given over the one asked for [1]
  REPEATS      most timed calls, within BUDGET seconds; LIMIT: seconds after which a call is asked to stop
  OUT          impulses go to OUT.TOLERANCE.bin, a line of JSON per tolerance to OUT.jsonl";

fn problem(path: &str) -> Result<FrictionProblem, String> {
    let file = File::open(path).map_err(|e| format!("{path}: {e}"))?;
    read_flat(&mut BufReader::new(file)).map_err(|e| format!("{path}: {e}"))
}

fn number(word: &str) -> Result<f64, String> {
    word.parse().map_err(|_| format!("{word:?} is no number\n\n{USAGE}"))
}

/// Runs the command.
///
/// # Errors
/// What is wrong with the words or the files.
pub fn run(words: &[String]) -> Result<(), String> {
    if words == ["--list"] {
        for rows in 1..=3 {
            solvers::names(rows).iter().for_each(|name| println!("{rows} {name}"));
        }
        return Ok(());
    }
    let [path, name, tolerances, first, repeats, budget, limit, out] = words else {
        return Err(USAGE.into());
    };
    let problem = problem(path)?;
    problem.prepare();
    let mut solver = solvers::make(name).ok_or_else(|| format!("no solver {name:?}"))?;
    let rules = Rules { repeats: number(repeats)? as usize, budget: number(budget)?, limit: number(limit)? };
    for asked in tolerances.split(',') {
        let tolerance = number(asked)? * number(first)?;
        let settings = FrictionSettings { tolerance, ..FrictionSettings::default() };
        let timed = time(solver.as_mut(), &problem, &settings, &rules);
        let saved = format!("{out}.{asked}.bin");
        let bytes: Vec<u8> = timed.impulses.iter().flat_map(|r| r.to_le_bytes()).collect();
        std::fs::write(&saved, bytes).map_err(|e| format!("{saved}: {e}"))?;
        let line = format!(
            "{{\"solver\": \"{name}\", \"tolerance\": {asked}, \"own_tolerance\": {tolerance:e}, \"seconds\": {:.9}, \
             \"inside\": {:.9}, \"iterations\": {}, \"factorisations\": {}, \"impulses\": \"{saved}\"}}",
            timed.seconds,
            timed.inside,
            iterations(&timed.outcome),
            timed.outcome.factorisations,
        );
        let lines = format!("{out}.jsonl");
        let file = OpenOptions::new().create(true).append(true).open(&lines);
        file.and_then(|mut f| writeln!(f, "{line}")).map_err(|e| format!("{lines}: {e}"))?;
    }
    Ok(())
}
