//! carom-bench: carom beside Rapier on the same scenes, in turns in one process, one thread each, no sleeping, the
//! same bodies, step length, gravity, friction and number of steps. Both are judged by one program in f64 from
//! their poses. Trust the ratios, not the milliseconds: those belong to the machine and its mood.

mod arguments;
mod contender;
mod measure;
mod ours;
mod peer;
mod table;

use arguments::Arguments;
use std::process::ExitCode;

fn main() -> ExitCode {
    let arguments = match Arguments::parse(std::env::args().skip(1)) {
        Ok(arguments) => arguments,
        Err(text) => {
            eprintln!("{text}");
            return ExitCode::from(2);
        }
    };
    println!("{}", table::heading());
    for scene in &arguments.scenes {
        let rows = match measure::scene(scene, &arguments) {
            Ok(rows) => rows,
            Err(problem) => {
                eprintln!("{scene}: {problem}");
                return ExitCode::FAILURE;
            }
        };
        rows.iter().for_each(|row| println!("{}", row.line()));
        let saved = arguments.out.as_ref().map_or(Ok(()), |folder| table::save(folder, scene, &rows));
        if let Err(problem) = saved {
            eprintln!("{scene}: its results could not be written: {problem}");
            return ExitCode::FAILURE;
        }
    }
    ExitCode::SUCCESS
}
