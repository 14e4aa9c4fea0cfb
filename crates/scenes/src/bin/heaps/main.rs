//! Heaps with carom's scheme `events`: boxes and hulls dropped into a bin, a thousand bodies poured, a Kapla tower. Each
//! run is held to demands in every step; one that misses one says so, and the program ends with 1 then. What it does
//! not do: run another scheme or engine.

mod arguments;
mod measure;
mod results;
mod task;

use arguments::Arguments;
use measure::Measurement;
use std::process::ExitCode;

fn main() -> ExitCode {
    let met = Arguments::parse(std::env::args().skip(1)).and_then(|given| run(&given));
    match met {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => ExitCode::FAILURE,
        Err(text) => {
            eprintln!("{text}");
            ExitCode::from(2)
        }
    }
}

/// Runs what is given; true when all demands are met. The file is written as often as progress is told, so that
/// whoever stops the program keeps what was measured.
fn run(given: &Arguments) -> Result<bool, String> {
    let out = given.out.as_deref();
    let mut all_met = true;
    for &task in &given.tasks {
        let mut trouble = None;
        let measured = Measurement::of(task, &given.choice(task), given.limit, |so_far| {
            eprintln!("{}", results::progress(so_far));
            trouble = results::save(out, &[so_far]).err().or(trouble.take());
        })?;
        println!("{}\n", results::lines(&measured));
        results::save(out, &[&measured])?;
        trouble.map_or(Ok(()), Err)?;
        all_met &= measured.is_met();
    }
    println!("{}", if all_met { "all demands are met" } else { "demands are MISSED" });
    Ok(all_met)
}
