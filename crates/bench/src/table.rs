//! Rows of results, as a table for people and as CSV.

use std::fmt::Write;
use std::path::Path;

/// Figures of one run.
#[derive(Clone, Debug, Default)]
pub struct Figures {
    /// Steps taken.
    pub steps: usize,
    /// Mean time of a step \[ms\].
    pub milliseconds: f64,
    /// Contact points at the end.
    pub contacts: usize,
    /// Deepest overlap over the run \[m\].
    pub penetration: f64,
    /// Largest residual over the run \[m/s\].
    pub residual: Option<f64>,
    /// Fastest body at the end \[m/s\].
    pub speed: f64,
}

/// One engine with one solver on one scene.
pub struct Row {
    /// The scene.
    pub scene: String,
    /// "planar" or "spatial".
    pub space: &'static str,
    /// "carom" or "rapier".
    pub engine: String,
    /// The solver.
    pub solver: String,
    /// Bodies that can move.
    pub bodies: usize,
    /// What was measured, or why the solver did not go on.
    pub figures: Result<Figures, String>,
    /// Time of a step over Rapier's \[1\].
    pub ratio: Option<f64>,
}

/// Columns of the result files.
const COLUMNS: &str = "scene,space,engine,solver,bodies,contacts,steps,ms_per_step,ratio_to_rapier,penetration_max,residual_max,speed_max";

/// Names over the table.
pub fn heading() -> String {
    format!(
        "{:<22} {:<7} {:<10} {:>6} {:>8} {:>5} {:>10} {:>8} {:>10} {:>10} {:>10}",
        "scene",
        "engine",
        "solver",
        "bodies",
        "contacts",
        "steps",
        "ms/step",
        "ratio",
        "depth m",
        "residual",
        "speed"
    )
}

fn or_dash(value: Option<f64>, form: impl Fn(f64) -> String) -> String {
    value.map_or("-".into(), form)
}

impl Row {
    /// The row for people.
    pub fn line(&self) -> String {
        let head = format!("{:<22} {:<7} {:<10} {:>6}", self.scene, self.engine, self.solver, self.bodies);
        match &self.figures {
            Err(reason) => {
                // what the solver says of itself, without the sentence around it
                let (step, own) = reason.split_once(": ").unwrap_or(("", reason));
                let own = own.split("contacts: ").last().unwrap_or(own);
                format!("{head} stopped at {step}: {}", own.chars().take(90).collect::<String>())
            }
            Ok(f) => format!(
                "{head} {:>8} {:>5} {:>10.4} {:>8} {:>10.2e} {:>10} {:>10.2e}",
                f.contacts,
                f.steps,
                f.milliseconds,
                or_dash(self.ratio, |x| format!("{x:.2}")),
                f.penetration,
                or_dash(f.residual, |x| format!("{x:.2e}")),
                f.speed
            ),
        }
    }
    /// The row for a file; what was not measured is empty.
    fn csv(&self) -> String {
        let head = format!("{},{},{},{},{}", self.scene, self.space, self.engine, self.solver, self.bodies);
        let empty = |value: Option<f64>| value.map_or(String::new(), |x| format!("{x:.4e}"));
        match &self.figures {
            Err(_) => format!("{head},,0,,,,,"),
            Ok(f) => format!(
                "{head},{},{},{:.5},{},{:.4e},{},{:.4e}",
                f.contacts,
                f.steps,
                f.milliseconds,
                self.ratio.map_or(String::new(), |x| format!("{x:.3}")),
                f.penetration,
                empty(f.residual),
                f.speed
            ),
        }
    }
}

/// Writes the rows of a scene to FOLDER/SCENE.csv.
///
/// # Errors
/// What the file system says.
pub fn save(folder: &Path, scene: &str, rows: &[Row]) -> std::io::Result<()> {
    std::fs::create_dir_all(folder)?;
    let mut text = String::from(COLUMNS);
    for row in rows {
        write!(text, "\n{}", row.csv()).expect("a text takes everything");
    }
    text.push('\n');
    std::fs::write(folder.join(format!("{scene}.csv")), text)
}
