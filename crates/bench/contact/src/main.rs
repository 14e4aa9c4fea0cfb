//! carom-contact: the contact solvers of carom on problems in files and of its own making.

mod clock;
mod cone_programs;
mod families;
mod file_run;
mod generate;
mod options;
mod piles;
mod scaling;
mod solvers;
mod stress_run;
mod structures_table;
mod timing;

use options::Options;
use std::process::ExitCode;

const USAGE: &str = "\
carom-contact: the contact solvers of carom

  time        one solver on one problem file, as the other timed programs do
  generate    our own problems as files         --out FOLDER [--seed 1] [--seeds 1] [--piles 200,2000]
  structures  mass ratios, arches, cards, tables by every solver; solvers.csv
  scaling     cost against size, 1e2 to 1e5 contacts; scaling.csv      [--largest 100000]
  hard        exact on pushed lattices and sheared walls up to 5,000 contacts; hard.csv      [--seed 1] [--seeds 1]
  stress      solved share under random impulses and friction; stress.csv
              [--folder FOLDER of .bin] [--seed 1] [--seeds 1] [--largest 100000]

Options of the last four: [--solvers A,B] [--tolerance 1e-8] [--limit 10] [--out FOLDER of results]";

fn run(words: &[String]) -> Result<(), String> {
    let Some((command, rest)) = words.split_first() else { return Err(USAGE.into()) };
    let options = || Options::parse(rest).map_err(|e| format!("{e}\n\n{USAGE}"));
    match command.as_str() {
        "time" => file_run::run(rest),
        "generate" => generate::run(&options()?),
        "structures" => structures_table::run(&options()?),
        "scaling" => scaling::run(&options()?),
        "hard" => scaling::hard(&options()?),
        "stress" => stress_run::run(&options()?),
        _ => Err(USAGE.into()),
    }
}

fn main() -> ExitCode {
    let words: Vec<String> = std::env::args().skip(1).collect();
    match run(&words) {
        Ok(()) => ExitCode::SUCCESS,
        Err(problem) => {
            eprintln!("{problem}");
            ExitCode::FAILURE
        }
    }
}
