//! carom-contact: the contact solvers of carom on problems in files and of its own making.

mod clock;
mod file_run;
mod solvers;
mod timing;

use std::process::ExitCode;

const USAGE: &str = "\
carom-contact: the contact solvers of carom

  time      one solver on one problem file, as the other timed programs do";

fn run(words: &[String]) -> Result<(), String> {
    match words.split_first() {
        Some((command, rest)) if command == "time" => file_run::run(rest),
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
