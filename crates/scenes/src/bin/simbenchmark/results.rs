//! The results as tables for people and as a file.

use crate::measure::Measurement;
use crate::published;
use crate::task::{Choice, Task};
use carom::{PlasticArrivals, Scheme};
use std::path::Path;

/// Name of the file.
const FILE: &str = "simbenchmark.csv";
/// Columns of the file; an empty cell was not measured. The first four say what ran.
const COLUMNS: &str = "task,engine,dt,tolerance,steps,error,place_error,overlap,largest_gain,projection,closure,events,impacts,capped_steps,guards,residual_max,seconds,verdict";

/// Columns that a run is known by.
const KEY: usize = 4;

/// Step lengths of the published figures \[s\].
const STEPS: [f64; 4] = [1e-4, 1e-3, 1e-2, 1e-1];

fn engine(choice: &Choice) -> &'static str {
    match (choice.scheme, choice.plastic_arrivals) {
        (Scheme::Events, PlasticArrivals::AtTheirMoment) => "carom events",
        (Scheme::Events, PlasticArrivals::WithinTheStep) => "carom within",
        (Scheme::FixedStep, _) => "carom fixed_step",
        (Scheme::SoftStep, _) => "carom soft_step",
    }
}

/// Name, error and columns of a task's table.
pub fn heading(task: Task) -> String {
    format!(
        "{}, {} s; error: {}\n{:>6}  {:<16} {:>9} {:>9} {:>9} {:>9} {:>9} {:>9} {:>8} {:>6} {:>6} {:>9}  demands",
        task.name(),
        task.duration(),
        task.error(),
        "dt s",
        "engine",
        "error",
        "place m",
        "overlap",
        "gain/E0",
        "proj./E0",
        "clos./E0",
        "events",
        "capped",
        "guards",
        "seconds"
    )
}

fn or_dash(value: Option<f64>) -> String {
    value.map_or("-".into(), |x| format!("{x:.2e}"))
}

fn verdict(m: &Measurement) -> String {
    let missed = m.missed();
    match (&m.failure, m.is_held_to_demands(), missed.as_slice()) {
        (Some(why), ..) => format!("NOT met: ended at step {}: {}", m.steps, why.replace([',', '\n'], ";")),
        (None, false, _) => "-".into(),
        (None, true, []) => "met".into(),
        (None, true, missed) => format!("NOT met: {}", missed.join(" + ")),
    }
}

/// A run as a line of its task's table.
pub fn line(m: &Measurement) -> String {
    format!(
        "{:>6.0e}  {:<16} {:>9.2e} {:>9} {:>9} {:>9.1e} {:>9.1e} {:>9.1e} {:>8} {:>6} {:>6} {:>9.2}  {}",
        m.choice.dt,
        engine(&m.choice),
        m.error,
        or_dash(m.place),
        or_dash(m.overlap),
        m.gain,
        m.projection,
        m.closure,
        m.events.arrivals + m.events.slip_stops,
        m.capped_steps,
        m.guards(),
        m.seconds,
        verdict(m)
    )
}

/// The published figures as lines of a task's table.
pub fn published_lines(task: Task, dt: f64) -> String {
    let row = |(name, error): (&str, f64)| format!("{dt:>6.0e}  {name:<16} {error:>9.2e}  published\n");
    published::at(task, dt).into_iter().map(row).collect::<String>().trim_end_matches('\n').to_string()
}

/// What a task's table lacks of the benchmark's step lengths.
pub fn left_out(task: Task, taken: &[f64]) -> String {
    let is_taken = |dt: &f64| taken.iter().any(|t| (t / dt - 1.0).abs() < 1e-9);
    let absent: Vec<String> = STEPS.iter().filter(|dt| !is_taken(dt)).map(|dt| format!("{dt:.0e}")).collect();
    if absent.is_empty() {
        return String::new();
    }
    format!("not run: dt {} of {} (ask with --dt)\n", absent.join(", "), task.name())
}

/// How many runs met the demands, and which did not.
pub fn summary(all: &[Measurement]) -> String {
    let held: Vec<&Measurement> = all.iter().filter(|m| m.is_held_to_demands()).collect();
    let missed = held.iter().filter(|m| !m.missed().is_empty());
    let lines: String = missed
        .clone()
        .map(|m| format!("\n  {} dt {:.0e}: {}", m.task.name(), m.choice.dt, verdict(m)))
        .collect();
    format!("{} of {} runs with events meet all demands{lines}", held.len() - missed.count(), held.len())
}

fn csv(m: &Measurement) -> String {
    let cell = |value: Option<f64>| value.map_or(String::new(), |x| format!("{x:.4e}"));
    format!(
        "{},{},{:e},{},{},{:.4e},{},{},{:.3e},{:.3e},{:.3e},{},{},{},{},{:.3e},{:.3},{}",
        m.task.name(),
        engine(&m.choice),
        m.choice.dt,
        if m.is_held_to_demands() { format!("{:e}", m.choice.tolerance) } else { String::new() },
        m.steps,
        m.error,
        cell(m.place),
        cell(m.overlap),
        m.gain,
        m.projection,
        m.closure,
        m.events.arrivals + m.events.slip_stops,
        m.events.impacts,
        m.capped_steps,
        m.guards(),
        m.residual,
        m.seconds,
        verdict(m)
    )
}

/// Our runs, and the published figures beside them.
fn rows(all: &[Measurement]) -> Vec<String> {
    let mut rows = Vec::new();
    for (k, m) in all.iter().enumerate() {
        rows.push(csv(m));
        if all.get(k + 1).is_none_or(|next| (next.task, next.choice.dt) != (m.task, m.choice.dt)) {
            let theirs = published::at(m.task, m.choice.dt).into_iter();
            rows.extend(theirs.map(|(name, error)| {
                format!("{},{name},{:e},,,{error:.4e},,,,,,,,,,,,published", m.task.name(), m.choice.dt)
            }));
        }
    }
    rows
}

/// Writes FOLDER/MACHINE/simbenchmark.csv when there is a folder; rows of other runs stay.
///
/// # Errors
/// What the file system says.
pub fn save(folder: Option<&Path>, all: &[Measurement]) -> Result<(), String> {
    let Some(results) = folder else { return Ok(()) };
    let old = carom_scenes::results::rows(results, FILE, COLUMNS);
    carom_scenes::results::save(folder, FILE, COLUMNS, &carom_scenes::results::merged(old, rows(all), KEY))
}
