//! The results as lines for people and as rows of a file.

use crate::measure::{End, Measurement};
use carom::PlasticArrivals;
use std::path::Path;

/// Name of the file.
const FILE: &str = "heaps.csv";
/// Columns of the file; the first five say what ran.
const COLUMNS: &str = "task,bodies,dt,tolerance,plastic_arrivals,time,seconds,cpu_seconds,cpu_per_simulated_second,\
longest_step,steps,largest_gain,overlap_over_size,closure,fall,projection,fallback,capped_steps,fallbacks,events,impacts,residual_asked,residual_max,\
kinetic_end,fastest_end,rest_since,farthest,contacts_end,contacts_max,verdict";
/// Columns that a run is known by.
const KEY: usize = 5;

fn arrivals(m: &Measurement) -> &'static str {
    match m.choice.arrivals {
        PlasticArrivals::AtTheirMoment => "at_their_moment",
        PlasticArrivals::WithinTheStep => "within_the_step",
    }
}

fn ended(m: &Measurement) -> Option<String> {
    match &m.end {
        End::Done => None,
        End::UnderWay => Some("under way".into()),
        End::Limit => Some("ended by its limit".into()),
        End::Failed(why) => Some(format!("step {} failed: {}", m.steps + 1, why.replace([',', '\n'], ";"))),
    }
}

fn verdict(m: &Measurement) -> String {
    let told = |(name, met): (&str, bool)| format!("{name} {}", if met { "met" } else { "MISSED" });
    let mut parts: Vec<String> = ended(m).into_iter().collect();
    parts.extend(m.demands().into_iter().map(told));
    parts.join("; ")
}

/// How far a run is, in a line.
pub fn progress(m: &Measurement) -> String {
    format!(
        "{}: {:.3} of {} s, {} contacts, {:.1e} J, {:.1e} m/s, gain {:.1e}, overlap {:.1e}, capped {}, {:.0} s",
        m.task.name(),
        m.time,
        m.choice.time,
        m.contacts[0],
        m.kinetic,
        m.fastest,
        m.gain.value,
        m.overlap.value.over_size,
        m.capped_steps,
        m.seconds
    )
}

/// A run in full, for people.
pub fn lines(m: &Measurement) -> String {
    let overlap = &m.overlap.value;
    let or_dash = |x: Option<f64>, digits: usize| x.map_or("-".into(), |x| format!("{x:.digits$}"));
    format!(
        "{}: {} bodies, dt {:.5} s, tolerance {:e}, {:e} m/s asked, plastic arrivals {}\n  \
         {:.3} s simulated in {} steps; {:.1} s, {} s on the processor: {:.2} a simulated second, {:.2} the longest step ({})\n  \
         largest gain {:.1e} E0 (step {}), closure {:.1e} E0, projection {:.1e} E0, fallback {:.1e} E0; falls to {:.1e} m\n  \
         deepest overlap {:.1e} of the size, {:.1e} m (step {}, bodies {:?})\n  \
         {} capped steps, {} fallbacks, {} events, {} impacts, residual {:.1e} m/s\n  \
         at the end {:.1e} J, {:.1e} m/s, {} contacts (most {}); at rest since {} s; farthest {:.1e} m\n  {}",
        m.task.name(),
        m.bodies,
        m.choice.dt,
        m.choice.tolerance,
        m.choice.asked,
        arrivals(m),
        m.time,
        m.steps,
        m.seconds,
        or_dash(m.cpu, 1),
        m.cost(),
        m.longest.value,
        m.longest.step,
        m.gain.value,
        m.gain.step,
        m.closure,
        m.lines[0],
        m.lines[1],
        m.fall.value,
        overlap.over_size,
        overlap.depth,
        m.overlap.step,
        overlap.bodies,
        m.capped_steps,
        m.events.fallbacks,
        m.events.arrivals + m.events.slip_stops,
        m.events.impacts,
        m.residual,
        m.kinetic,
        m.fastest,
        m.contacts[0],
        m.contacts[1],
        or_dash(m.rest, 3),
        m.way,
        verdict(m)
    )
}

fn row(m: &Measurement) -> String {
    let cell = |x: Option<f64>| x.map_or(String::new(), |x| format!("{x:.3}"));
    let exact = |x: f64| format!("{x:.3e}");
    [
        m.task.name().to_string(),
        m.bodies.to_string(),
        format!("{:.6}", m.choice.dt),
        format!("{:e}", m.choice.tolerance),
        arrivals(m).to_string(),
        format!("{:.4}", m.time),
        format!("{:.2}", m.seconds),
        cell(m.cpu),
        format!("{:.3}", m.cost()),
        format!("{:.3}", m.longest.value),
        m.steps.to_string(),
        exact(m.gain.value),
        exact(m.overlap.value.over_size),
        exact(m.closure),
        exact(m.fall.value),
        exact(m.lines[0]),
        exact(m.lines[1]),
        m.capped_steps.to_string(),
        m.events.fallbacks.to_string(),
        (m.events.arrivals + m.events.slip_stops).to_string(),
        m.events.impacts.to_string(),
        format!("{:e}", m.choice.asked),
        exact(m.residual),
        exact(m.kinetic),
        exact(m.fastest),
        cell(m.rest),
        exact(m.way),
        m.contacts[0].to_string(),
        m.contacts[1].to_string(),
        verdict(m),
    ]
    .join(",")
}

/// Rows of a file with those of these runs in place of older ones of the same tasks and choices.
fn merged(old: Vec<String>, runs: &[&Measurement]) -> Vec<String> {
    carom_scenes::results::merged(old, runs.iter().map(|m| row(m)).collect(), KEY)
}

/// Writes FOLDER/MACHINE/heaps.csv when there is a folder; rows of other runs stay.
///
/// # Errors
/// What the file system says.
pub fn save(folder: Option<&Path>, runs: &[&Measurement]) -> Result<(), String> {
    let Some(results) = folder else { return Ok(()) };
    let rows = merged(carom_scenes::results::rows(results, FILE, COLUMNS), runs);
    carom_scenes::results::save(folder, FILE, COLUMNS, &rows)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::task::{Choice, Task};

    fn short(task: Task) -> Measurement {
        let choice = Choice { time: task.usual().dt, ..task.usual() };
        Measurement::of(task, &choice, None, |_| ()).expect("builds")
    }

    #[test]
    fn rows_have_the_columns_and_a_verdict_on_each_demand() {
        let mut m = short(Task::Kapla);
        assert_eq!(row(&m).split(',').count(), COLUMNS.split(',').count());
        assert_eq!(
            verdict(&m),
            "gain met; overlap met; closure met; fall met; no cap met; residual met; stands met; to the end met"
        );
        m.end = End::Failed("a, b".into());
        assert_eq!(row(&m).split(',').count(), COLUMNS.split(',').count());
        assert!(verdict(&m).starts_with("step 2 failed: a; b; gain met"));
        assert!(verdict(&m).ends_with("to the end MISSED"));
    }

    #[test]
    fn a_run_replaces_its_own_row_and_leaves_the_others() {
        let (bin, mut kapla) = (short(Task::Bin), short(Task::Kapla));
        let first = merged(Vec::new(), &[&bin, &kapla]);
        assert_eq!(first, [row(&bin), row(&kapla)]);
        kapla.steps = 17;
        assert_eq!(merged(first, &[&kapla]), [row(&bin), row(&kapla)]);
        let mut finer = kapla.clone();
        finer.choice.dt *= 0.5;
        assert_eq!(merged(vec![row(&kapla)], &[&finer]).len(), 2);
    }
}
