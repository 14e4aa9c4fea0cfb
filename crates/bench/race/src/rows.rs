//! Rows of results: ratios, the file, and lines for people. Knows no engine.

use crate::engine::Phases;
use carom_scenes::results;
use std::path::Path;

/// Name of the file of results.
pub const FILE: &str = "peers.csv";
/// Its columns; the first six name a row.
pub const COLUMNS: &str = "scene,space,engine,solver,threads,sleeping,bodies,steps,steps_asked,repeats,ms_per_step,cpu_ms_per_step,ratio,contacts,penetration_max,penetration_mean,drift_max,drift_mean,speed_max,slip_direction_error,energy_gain,pairs_ms,collide_ms,solve_ms,rest_ms";
/// How many columns name a row.
const KEY: usize = 6;
/// Where the judge's figures begin.
pub const QUALITY: usize = 14;

/// What one engine did on one scene.
#[derive(Clone, Debug)]
pub struct Row {
    /// The scene with its size.
    pub scene: String,
    /// "planar" or "spatial".
    pub space: &'static str,
    /// The engine.
    pub engine: String,
    /// Its scheme and solver.
    pub solver: String,
    /// Threads it had.
    pub threads: usize,
    /// Whether bodies could fall asleep.
    pub sleeping: bool,
    /// Bodies that forces move.
    pub bodies: usize,
    /// Steps taken.
    pub steps: usize,
    /// Steps of the scene; more than were taken where patience ended.
    pub steps_asked: usize,
    /// Runs that the median is of.
    pub repeats: usize,
    /// Wall-clock time of a step \[ms\].
    pub wall: f64,
    /// Processor time of a step, of all threads \[ms\].
    pub cpu: f64,
    /// Deciding time over that of the fastest peer \[1\].
    pub ratio: Option<f64>,
    /// Contact points of the last step.
    pub contacts: Option<usize>,
    /// Figures of the judge from `penetration_max` to `energy_gain`, as the columns have them.
    pub quality: [f64; 7],
    /// Phases of a step \[ms\].
    pub phases: Option<Phases>,
}

/// What decides: processor time on one thread, the wall's on several.
fn deciding(threads: usize, wall: f64, cpu: f64) -> f64 {
    if threads == 1 { cpu } else { wall }
}

impl Row {
    fn key(&self) -> String {
        let sleeping = if self.sleeping { "on" } else { "off" };
        let Row { scene, space, engine, solver, threads, .. } = self;
        format!("{scene},{space},{engine},{solver},{threads},{sleeping}")
    }
    /// The time that decides \[ms\].
    pub fn deciding(&self) -> f64 {
        deciding(self.threads, self.wall, self.cpu)
    }
    /// Scene and choice.
    pub fn course(&self) -> String {
        let asleep = if self.sleeping { "sleeping" } else { "awake" };
        format!("{}/{} x{} {asleep}", self.space, self.scene, self.threads)
    }
    /// Whether it is carom's.
    pub fn is_ours(&self) -> bool {
        self.engine == "carom"
    }
    fn whole(&self) -> bool {
        self.steps == self.steps_asked
    }
    /// The row for a file; what was not measured is empty, what makes no sense NaN.
    fn csv(&self) -> String {
        let or_empty = |value: Option<String>| value.unwrap_or_default();
        let quality: Vec<String> = self.quality.iter().map(|q| number(*q)).collect();
        let phases = self.phases.map_or(",,,".to_string(), |p| {
            [p.pairs, p.collide, p.solve, p.rest].map(|ms| format!("{ms:.4}")).join(",")
        });
        format!(
            "{},{},{},{},{},{:.5},{:.5},{},{},{},{}",
            self.key(),
            self.bodies,
            self.steps,
            self.steps_asked,
            self.repeats,
            self.wall,
            self.cpu,
            or_empty(self.ratio.map(|r| format!("{r:.3}"))),
            or_empty(self.contacts.map(|c| c.to_string())),
            quality.join(","),
            phases
        )
    }
    /// The row for people.
    pub fn line(&self) -> String {
        let [deep, mean, drift, _, speed, slip, gain] = self.quality;
        let figure = |x: f64| if x.is_nan() { format!("{:>8}", "-") } else { format!("{x:>8.1e}") };
        let cut = if self.whole() { String::new() } else { format!("  CUT after {} steps", self.steps) };
        format!(
            "  {:<8} {:<16} {:>9.3} {:>9.3} {:>8} {} {} {} {} {} {}{cut}",
            self.engine,
            self.solver,
            self.wall,
            self.cpu,
            self.ratio.map_or("-".into(), |r| format!("{r:.2}")),
            figure(deep),
            figure(mean),
            figure(drift),
            figure(speed),
            figure(slip),
            figure(gain),
        )
    }
}

/// Names over the lines for people.
pub fn heading() -> String {
    format!(
        "  {:<8} {:<16} {:>9} {:>9} {:>8} {:>8} {:>8} {:>8} {:>8} {:>8} {:>8}",
        "engine", "solver", "ms/step", "cpu ms", "ratio", "deepest", "mean", "drift", "speed", "slip", "gain"
    )
}

fn number(value: f64) -> String {
    if value.is_nan() { "NaN".into() } else { format!("{value:.4e}") }
}

/// Which column is which, for reading lines of the file.
mod place {
    pub const ENGINE: usize = 2;
    pub const THREADS: usize = 4;
    pub const STEPS: usize = 7;
    pub const ASKED: usize = 8;
    pub const WALL: usize = 10;
    pub const CPU: usize = 11;
    pub const RATIO: usize = 12;
    /// What makes a scene and choice: scene, space, threads, sleeping.
    pub const COURSE: [usize; 4] = [0, 1, 4, 5];
}

/// Whether two lines are of the same scene and choice.
fn same_course(one: &str, other: &str) -> bool {
    let (one, other): (Vec<&str>, Vec<&str>) = (one.split(',').collect(), other.split(',').collect());
    place::COURSE.iter().all(|k| one.get(*k).is_some() && one.get(*k) == other.get(*k))
}

/// The time that decides of a line \[ms\].
fn deciding_of(line: &str) -> Option<f64> {
    let cells: Vec<&str> = line.split(',').collect();
    let number = |k: usize| cells.get(k)?.parse::<f64>().ok();
    Some(deciding(cells.get(place::THREADS)?.parse().ok()?, number(place::WALL)?, number(place::CPU)?))
}

/// The time of the fastest peer that took all steps, among lines of one scene and choice \[ms\].
fn fastest<'a>(lines: impl Iterator<Item = &'a String>) -> Option<f64> {
    let counts = |line: &&String| {
        let cells: Vec<&str> = line.split(',').collect();
        cells[place::ENGINE] != "carom" && cells[place::STEPS] == cells[place::ASKED]
    };
    lines.filter(counts).filter_map(|line| deciding_of(line)).min_by(f64::total_cmp)
}

/// The rows of the file so far.
pub fn stored(out: Option<&Path>) -> Vec<String> {
    out.map(|folder| results::rows(folder, FILE, COLUMNS)).unwrap_or_default()
}

/// Puts rows of one scene and choice into the file in place of those of the same name and leaves all others; gives all rows of
/// that scene and choice their ratios to the fastest peer among them that took all steps.
///
/// # Errors
/// What the file system says.
pub fn store(out: Option<&Path>, file: &mut Vec<String>, rows: &mut [Row]) -> Result<(), String> {
    for row in rows.iter() {
        let key = row.key() + ",";
        file.retain(|line| !line.starts_with(&key));
        file.push(row.csv());
    }
    let Some(sample) = rows.first().map(Row::csv) else { return Ok(()) };
    let best = fastest(file.iter().filter(|line| same_course(line, &sample)));
    for row in rows.iter_mut() {
        row.ratio = best.map(|b| row.deciding() / b);
    }
    for line in file.iter_mut().filter(|line| same_course(line, &sample)) {
        let ratio = best.and_then(|b| Some(deciding_of(line)? / b));
        let mut cells: Vec<String> = line.split(',').map(str::to_string).collect();
        cells[place::RATIO] = ratio.map(|r| format!("{r:.3}")).unwrap_or_default();
        *line = cells.join(",");
    }
    file.sort_by_key(|line| order(line));
    results::save(out, FILE, COLUMNS, file)
}

/// Where a line stands in the file: by space, scene, size, threads, sleeping, engine.
fn order(line: &str) -> (String, String, usize, String, String, String, String) {
    let cells: Vec<&str> = line.split(',').take(KEY).collect();
    let cell = |k: usize| cells.get(k).unwrap_or(&"").to_string();
    let scene = cell(0);
    let (kind, size) = scene.split_once(':').unwrap_or((&scene, "0"));
    let size = size.parse().unwrap_or(0);
    (cell(1), kind.to_string(), size, cell(4), cell(5), cell(2), cell(3))
}

#[cfg(test)]
pub mod tests {
    use super::*;

    pub fn row(engine: &str, cpu: f64) -> Row {
        Row {
            scene: "pyramid:4".into(),
            space: "planar",
            engine: engine.into(),
            solver: "default".into(),
            threads: 1,
            sleeping: false,
            bodies: 10,
            steps: 20,
            steps_asked: 20,
            repeats: 3,
            wall: 9.0,
            cpu,
            ratio: None,
            contacts: None,
            quality: [f64::NAN; 7],
            phases: None,
        }
    }

    #[test]
    fn a_row_has_as_many_cells_as_there_are_columns() {
        assert_eq!(row("box2d", 1.0).csv().split(',').count(), COLUMNS.split(',').count());
        assert_eq!(COLUMNS.split(',').nth(QUALITY), Some("penetration_max"));
    }

    #[test]
    fn ratios_are_to_the_fastest_peer_that_took_all_steps() {
        let mut rows = [row("carom", 1.0), row("box2d", 2.0), row("rapier", 4.0), row("pymunk", 0.1)];
        rows[3].steps = 3;
        store(None, &mut Vec::new(), &mut rows).expect("no file is written");
        assert_eq!(rows.map(|r| r.ratio), [Some(0.5), Some(1.0), Some(2.0), Some(0.05)]);
    }

    #[test]
    fn a_rerun_of_one_engine_replaces_its_row_alone_and_is_compared_with_the_file() {
        let mut file = Vec::new();
        store(None, &mut file, &mut [row("carom", 8.0), row("box2d", 2.0)]).expect("no file is written");
        let mut again = [row("carom", 1.0)];
        store(None, &mut file, &mut again).expect("no file is written");
        assert_eq!(again[0].ratio, Some(0.5));
        assert_eq!(file.len(), 2);
        assert!(file[0].starts_with("pyramid:4,planar,box2d") && file[1].contains(",1.00000,0.500,"));
        // a faster peer changes the ratios of all
        store(None, &mut file, &mut [row("box2d", 0.5)]).expect("no file is written");
        assert!(file[0].contains(",0.50000,1.000,") && file[1].contains(",1.00000,2.000,"), "{file:?}");
    }
}
