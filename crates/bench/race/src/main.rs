//! carom-race: carom and its peers on the same scenes in one run, engines in turns, with one judge in f64 for all. Trust the
//! ratios, not the milliseconds: those belong to the machine and its load.

mod arguments;
mod catalogue;
mod engine;
mod engines;
mod judge;
mod motion;
mod race;
mod rows;
mod run;
mod scene;
mod scenes;
#[cfg(test)]
mod smoke;
mod verdict;

use arguments::Arguments;
use carom::{Planar, Spatial};
use engines::entrants;
use rows::Row;
use std::process::ExitCode;

fn main() -> ExitCode {
    let arguments = match Arguments::parse(std::env::args().skip(1)) {
        Ok(arguments) => arguments,
        Err(text) => {
            eprintln!("{text}");
            return ExitCode::from(2);
        }
    };
    match run_all(&arguments) {
        Ok(()) => ExitCode::SUCCESS,
        Err(problem) => {
            eprintln!("{problem}");
            ExitCode::FAILURE
        }
    }
}

fn run_all(arguments: &Arguments) -> Result<(), String> {
    let loudly = |text: &str| eprintln!("*** {text} ***");
    let plane = entrants::<Planar>(&arguments.engines, &arguments.python, &loudly)?;
    let space = entrants::<Spatial>(&arguments.engines, &arguments.python, &loudly)?;
    let out = arguments.out.as_deref();
    let mut file = rows::stored(out);
    let mut all = Vec::new();
    let mut done = |title: &str, mut found: Vec<Row>| -> Result<(), String> {
        rows::store(out, &mut file, &mut found)?;
        println!("{}", race::table(title, &found));
        all.extend(found);
        Ok(())
    };
    for word in &arguments.scenes {
        race::race(word, &plane, arguments, &mut done)?;
        race::race(word, &space, arguments, &mut done)?;
    }
    println!("{}\n{}", summary(&all), verdict::verdict(&all));
    Ok(())
}

/// Ratios to the fastest peer, a line for each scene and choice.
fn summary(rows: &[Row]) -> String {
    let mut lines: Vec<(String, String)> = Vec::new();
    for row in rows {
        let name = row.course();
        let cut = if row.steps < row.steps_asked { " (cut)" } else { "" };
        let ratio = row.ratio.map_or("-".to_string(), |r| format!("{r:.2}"));
        let entry = format!("{} {ratio}{cut}", row.engine);
        match lines.last_mut() {
            Some((last, entries)) if *last == name => *entries += &format!("   {entry}"),
            _ => lines.push((name, entry)),
        }
    }
    let lines: Vec<String> = lines.iter().map(|(name, entries)| format!("{name:<40} {entries}")).collect();
    format!("time of a step over that of the fastest peer:\n{}", lines.join("\n"))
}
