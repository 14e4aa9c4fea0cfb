//! SimBenchmark's four tasks (ETH Zurich, 2018) with carom's schemes, beside the figures published there. Scheme
//! `events` is held to demands; a run that misses one says so, and the program ends with 1 then. What it does not do:
//! run the other engines.

mod arguments;
mod measure;
mod published;
mod results;
mod task;

use arguments::Arguments;
use measure::Measurement;
use std::process::ExitCode;
use task::Choice;

fn main() -> ExitCode {
    let given = match Arguments::parse(std::env::args().skip(1)) {
        Ok(given) => given,
        Err(text) => {
            eprintln!("{text}");
            return ExitCode::from(2);
        }
    };
    let mut all = Vec::new();
    for &task in &given.tasks {
        println!("{}", results::heading(task));
        for dt in given.steps_of(task) {
            for &(scheme, plastic_arrivals) in &given.schemes {
                let choice = Choice { scheme, plastic_arrivals, dt, tolerance: given.tolerance };
                let measured = Measurement::of(task, &choice);
                println!("{}", results::line(&measured));
                all.push(measured);
            }
            println!("{}", results::published_lines(task, dt));
            // whoever stops the program keeps what was measured
            if let Err(error) = results::save(given.out.as_deref(), &all) {
                eprintln!("{error}");
                return ExitCode::from(2);
            }
        }
        println!("{}", results::left_out(task, &given.steps_of(task)));
    }
    let missed = all.iter().filter(|m| m.is_held_to_demands() && !m.missed().is_empty()).count();
    println!("{}", results::summary(&all));
    if missed > 0 { ExitCode::FAILURE } else { ExitCode::SUCCESS }
}
