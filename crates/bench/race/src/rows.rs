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
    fn whole(&self) -> bool {
        self.steps == self.steps_asked
    }
    /// Whether a row of the file is of the same scene and choice, and of a peer that took all steps; its deciding time \[ms\].
    fn beside(&self, line: &str) -> Option<f64> {
        let cells: Vec<&str> = line.split(',').collect();
        let own: Vec<String> = self.key().split(',').map(str::to_string).collect();
        let same = [0, 1, 4, 5].iter().all(|k| cells.get(*k).is_some_and(|c| *c == own[*k]));
        let peer = cells.get(2).is_some_and(|c| *c != "carom");
        let whole = cells.get(7).is_some() && cells.get(7) == cells.get(8);
        let number = |k: usize| cells.get(k)?.parse::<f64>().ok();
        (same && peer && whole).then(|| Some(deciding(self.threads, number(10)?, number(11)?)))?
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

/// Gives the rows of one scene and choice their ratios: to the fastest peer among them that took all steps, or, where no peer
/// ran along, among the rows of the file.
pub fn set_ratios(rows: &mut [Row], file: &[String]) {
    let along = rows.iter().filter(|r| r.engine != "carom" && r.whole()).map(Row::deciding);
    let fastest = along.min_by(f64::total_cmp).or_else(|| {
        let first = rows.first()?;
        file.iter().filter_map(|line| first.beside(line)).min_by(f64::total_cmp)
    });
    for row in rows {
        row.ratio = fastest.map(|f| row.deciding() / f);
    }
}

/// The rows of the file so far.
pub fn stored(out: Option<&Path>) -> Vec<String> {
    out.map(|folder| results::rows(folder, FILE, COLUMNS)).unwrap_or_default()
}

/// Puts rows into the file in place of those of the same name, and leaves all others.
///
/// # Errors
/// What the file system says.
pub fn store(out: Option<&Path>, file: &mut Vec<String>, rows: &[Row]) -> Result<(), String> {
    for row in rows {
        let key = row.key() + ",";
        file.retain(|line| !line.starts_with(&key));
        file.push(row.csv());
    }
    let name = |line: &String| {
        let cells: Vec<String> = line.split(',').take(KEY).map(str::to_string).collect();
        let place = |k: usize| cells.get(k).cloned().unwrap_or_default();
        let (kind, size) = place(0)
            .split_once(':')
            .map_or((place(0), 0), |(kind, size)| (kind.to_string(), size.parse::<usize>().unwrap_or(0)));
        (place(1), kind, size, place(4), place(5), place(2), place(3))
    };
    file.sort_by_key(name);
    results::save(out, FILE, COLUMNS, file)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(engine: &str, cpu: f64) -> Row {
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
    }

    #[test]
    fn ratios_are_to_the_fastest_peer_that_took_all_steps() {
        let mut rows = [row("carom", 1.0), row("box2d", 2.0), row("rapier", 4.0), row("pymunk", 0.1)];
        rows[3].steps = 3;
        set_ratios(&mut rows, &[]);
        assert_eq!(rows.map(|r| r.ratio), [Some(0.5), Some(1.0), Some(2.0), Some(0.05)]);
    }

    #[test]
    fn a_rerun_of_one_engine_replaces_its_row_alone_and_is_compared_with_the_file() {
        let mut file = Vec::new();
        let first = [row("carom", 8.0), row("box2d", 2.0)];
        store(None, &mut file, &first).expect("no file is written");
        let mut again = [row("carom", 1.0)];
        set_ratios(&mut again, &file);
        assert_eq!(again[0].ratio, Some(0.5));
        store(None, &mut file, &again).expect("no file is written");
        assert_eq!(file.len(), 2);
        assert!(file[0].starts_with("pyramid:4,planar,box2d") && file[1].contains(",1.00000,0.500,"));
    }
}
