//! Many steps in one call, recorded: what a run is made of.

use crate::arrays;
use crate::errors;
use crate::lookout::Lookout;
use crate::records::{self, Records};
use crate::shared::Core;
use crate::step::{self, PlainFinding};
use carom::{EnergyGuard, Geometry, OnInaccurate, StepError, World};
use numpy::PyArray1;
use pyo3::prelude::*;
use pyo3::types::PyDict;

/// Frames and steps, one after another.
#[derive(Default)]
struct Recording {
    time: Vec<f64>,
    position: Vec<f64>,
    rotation: Vec<f64>,
    velocity: Vec<f64>,
    angular_velocity: Vec<f64>,
    contact_offsets: Vec<i64>,
    contacts: Records,
    action_offsets: Vec<i64>,
    actions: Records,
    event_offsets: Vec<i64>,
    events: Records,
    piece_offsets: Vec<i64>,
    pieces: Records,
    steps: Records,
    error: Option<StepError>,
    /// Number and time of the first step above the tolerance, and why.
    inaccurate: Option<(u64, f64, Vec<PlainFinding>)>,
    /// Number and time of the first step whose impacts gained energy where the guard only warns, and where.
    gaining: Option<(u64, f64, Vec<PlainFinding>)>,
}

impl Recording {
    fn new() -> Self {
        Recording {
            contact_offsets: vec![0],
            action_offsets: vec![0],
            event_offsets: vec![0],
            piece_offsets: vec![0],
            ..Recording::default()
        }
    }
    /// Appends the present state, and the contacts, actions and events of the last step.
    fn frame<S: Geometry>(&mut self, world: &World<S>) {
        let motion = &world.bodies().motion;
        self.time.push(world.time());
        self.position.extend(arrays::flat(&motion.position));
        self.rotation.extend(arrays::flat_rotations::<S>(&motion.rotation));
        self.velocity.extend(arrays::flat(&motion.velocity));
        self.angular_velocity.extend(arrays::flat(&motion.angular_velocity));
        let ends = |offsets: &mut Vec<i64>, count: usize| {
            offsets.push(offsets.last().copied().unwrap_or(0) + count as i64);
        };
        ends(&mut self.contact_offsets, records::append_contacts(world, &mut self.contacts));
        ends(&mut self.action_offsets, records::append_actions(world, &mut self.actions));
        ends(&mut self.event_offsets, records::append_events(world, &mut self.events));
        ends(&mut self.piece_offsets, records::append_pieces(world, &mut self.pieces));
    }
    /// Flat arrays by name; the Python side gives them their shapes.
    fn into_dict(self, py: Python<'_>) -> PyResult<Bound<'_, PyDict>> {
        let dict = PyDict::new(py);
        let frames = [
            ("time", self.time),
            ("position", self.position),
            ("rotation", self.rotation),
            ("velocity", self.velocity),
            ("angular_velocity", self.angular_velocity),
        ];
        for (name, numbers) in frames {
            dict.set_item(name, PyArray1::from_vec(py, numbers))?;
        }
        let ragged = [
            ("contact_offsets", self.contact_offsets, "contacts", self.contacts),
            ("action_offsets", self.action_offsets, "actions", self.actions),
            ("event_offsets", self.event_offsets, "events", self.events),
            ("piece_offsets", self.piece_offsets, "pieces", self.pieces),
        ];
        for (name, offsets, table, records) in ragged {
            dict.set_item(name, PyArray1::from_vec(py, offsets))?;
            dict.set_item(table, PyArray1::from_vec(py, records.0))?;
        }
        dict.set_item("steps", PyArray1::from_vec(py, self.steps.0))?;
        dict.set_item("inaccurate", self.inaccurate)?;
        dict.set_item("gaining", self.gaining)?;
        Ok(dict)
    }
}

/// The present state as a recording of one frame and no steps.
///
/// # Errors
/// `BusyError` while a step is running.
pub fn frame<'py, S: Geometry>(core: &Core<S>, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
    let mut recording = Recording::new();
    recording.frame(&core.loan(py)?.world);
    recording.into_dict(py)
}

/// How to record: a frame after every so-manieth step (none for 0), whether to explain the first inaccurate step,
/// whom to tell of long solves.
pub struct Manner {
    /// Steps between frames.
    pub every: usize,
    /// Whether an explanation is wanted, where the settings ask for warnings.
    pub explains: bool,
    /// A Python function of (stage, iterations, residual).
    pub progress: Option<Py<PyAny>>,
}

/// Takes up to `count` steps of length `dt` \[s\] and returns what was recorded and the exception of a failed or
/// interrupted step, before which the recording ends.
///
/// # Errors
/// `BusyError` while a step is running.
pub fn advance<'py, S: Geometry>(
    core: &Core<S>,
    py: Python<'py>,
    count: usize,
    dt: f64,
    Manner { every, explains, progress }: Manner,
) -> PyResult<(Bound<'py, PyDict>, Option<PyErr>)> {
    let mut lookout = Lookout::new(progress);
    let watch = &mut lookout;
    let mut recording = core.advance(py, |world| {
        let mut recording = Recording::new();
        let policy = world.settings().on_inaccurate;
        let warns = explains && matches!(policy, OnInaccurate::Warn | OnInaccurate::Escalate);
        let guard_warns = world.settings().energy_guard == EnergyGuard::Warn;
        for k in 1..=count {
            match world.step_watched(dt, &mut |progress| watch.look(progress)) {
                Ok(report) => {
                    records::append_step(&report, &mut recording.steps);
                    if guard_warns && recording.gaining.is_none() && report.impacts.guarded > 0 {
                        let findings = step::plain_findings(&world.explain_briefly(&report));
                        recording.gaining = Some((report.step, report.time, findings));
                    }
                    if warns && recording.inaccurate.is_none() && !report.is_accurate() {
                        let findings = step::plain_findings(&world.explain(&report));
                        recording.inaccurate = Some((report.step, report.time, findings));
                    }
                }
                Err(error) => {
                    recording.error = Some(error);
                    break;
                }
            }
            if every > 0 && k % every == 0 {
                recording.frame(world);
            }
        }
        recording
    })?;
    let error = recording.error.take().map(|e| lookout.take().unwrap_or_else(|| failed(core, py, &e)));
    Ok((recording.into_dict(py)?, error))
}

/// The exception of a failed step: what a force field raised, or the engine's own.
pub fn failed<S: Geometry>(core: &Core<S>, py: Python<'_>, error: &StepError) -> PyErr {
    core.fields.take_raised().unwrap_or_else(|| {
        let findings = core.loan(py).map(|l| l.world.failure().map(step::plain_findings).unwrap_or_default());
        errors::step(py, error, findings.unwrap_or_default())
    })
}
