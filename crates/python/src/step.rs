//! One step, its report, and what is known of the world as a whole.

use crate::chunk;
use crate::errors;
use crate::joint::{self, PlainReaction};
use crate::lookout::Lookout;
use crate::problem::Problem;
use crate::records::{self, Records};
use crate::shared::Core;
use carom::{
    BuildError, Column, Explanation, Geometry, GroupReport, IslandReport, Ledger, LedgerGroup, Phase,
    StepReport, World, solver::Entry,
};
use numpy::PyArray1;
use pyo3::IntoPyObjectExt;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyTuple;

/// Names of two bodies.
type Pair = Option<(String, String)>;

fn names<S: Geometry>(world: &World<S>, pair: Option<(usize, usize)>) -> Pair {
    let name = |i: usize| world.bodies().names[i].clone();
    pair.map(|(a, b)| (name(a), name(b)))
}

/// One solver's work on an island: name, iterations, residual \[m/s\], how it stopped, why it refused.
pub type PlainStage = (&'static str, usize, f64, &'static str, Option<String>);

/// An island: contacts, rows, bodies, name of its first body, residual \[m/s\], relative residual, names of the bodies
/// of its worst entry, stages, why it went further, strict feasibility \[m/s\].
type PlainIsland = (usize, usize, usize, String, f64, f64, Pair, Vec<PlainStage>, String, Option<f64>);

/// A finding: topic, value, names of bodies, text, remedy.
pub type PlainFinding = (String, f64, Vec<String>, String, String);

fn plain_island<S: Geometry>(world: &World<S>, island: &IslandReport, phase: Phase) -> PlainIsland {
    let (contact, impact) = (world.last_problem().0, world.last_impacts().0);
    let problem = if phase == Phase::Contact { contact } else { impact };
    // of impacts in several rounds the first one's problem is there, the worst one's island need not be
    let pair = island.worst.and_then(|entry| match entry {
        Entry::Contact(k) => problem.contacts.get(k).map(|c| (c.a, c.b)),
        Entry::Row(k) => problem.rows.get(k).map(|r| (r.a, r.b)),
    });
    (
        island.contacts,
        island.rows,
        island.bodies,
        world.bodies().names.get(island.first_body).cloned().unwrap_or_default(),
        island.residual,
        island.relative_residual,
        names(world, pair),
        plain_stages(island),
        island.why_further(world.settings().tolerance),
        island.strict_feasibility,
    )
}

/// The stages of an island in plain values.
pub fn plain_stages(island: &IslandReport) -> Vec<PlainStage> {
    let plain = |s: &carom::StageReport| {
        let reason = s.stop.reason().map(String::from);
        (s.solver.name(), s.iterations, s.residual, s.stop.name(), reason)
    };
    island.stages.iter().map(plain).collect()
}

/// The findings in plain values.
pub fn plain_findings(told: &Explanation) -> Vec<PlainFinding> {
    let plain = |f: &carom::Finding| {
        let topic = serde_json::to_value(f.topic).ok().and_then(|v| v.as_str().map(String::from));
        (topic.unwrap_or_default(), f.value, f.bodies.clone(), f.text.clone(), f.remedy.clone())
    };
    told.findings.iter().map(plain).collect()
}

/// What of a step needs the world to be told.
struct Told {
    worst: Pair,
    deepest: Pair,
    islands: Vec<PlainIsland>,
    findings: Vec<PlainFinding>,
    gaining: Pair,
    joints: Vec<PlainReaction>,
}

/// Takes a step of length `dt` \[s\], the setting's when there is none; the report's fields in the order of the
/// Python side's `StepReport`.
///
/// # Errors
/// `StepError`, what a force field, a signal's handler or `progress` raised, `BusyError`.
pub fn step<'py, S: Geometry>(
    core: &Core<S>,
    py: Python<'py>,
    dt: Option<f64>,
    progress: Option<Py<PyAny>>,
) -> PyResult<Bound<'py, PyTuple>> {
    let mut lookout = Lookout::new(progress);
    let watch = &mut lookout;
    let taken = core.advance(py, |world| {
        let dt = dt.unwrap_or(world.settings().dt);
        let report = world.step_watched(dt, &mut |progress| watch.look(progress))?;
        let of = |phase, solve: &Option<carom::SolveReport>| {
            let islands = solve.iter().flat_map(|s| &s.islands);
            islands.map(|island| plain_island(world, island, phase)).collect::<Vec<_>>()
        };
        let mut islands = of(Phase::Impact, &report.impact_solve);
        islands.extend(of(Phase::Contact, &report.contact_solve));
        let told = Told {
            worst: names(world, report.worst()),
            deepest: names(world, report.deepest.map(|(_, a, b)| (a, b))),
            islands,
            findings: plain_findings(&world.explain_briefly(&report)),
            gaining: names(world, report.impacts.gaining),
            joints: report
                .joints
                .iter()
                .zip(&world.bodies().joints.names)
                .map(|(r, n)| joint::plain(n, r))
                .collect(),
        };
        Ok((report, told))
    })?;
    match taken {
        Ok((report, told)) => {
            let plain = plain_report(py, &report, told);
            // another thread may have the world already: then there will be no questions about this step
            if let Ok(mut loan) = core.loan(py) {
                loan.last_report = Some(report);
            }
            plain
        }
        Err(error) => Err(lookout.take().unwrap_or_else(|| chunk::failed(core, py, &error))),
    }
}

/// The findings of the last step in full, and whether it was accurate; nothing when the world has gone on from
/// `step`.
///
/// # Errors
/// `BusyError` while a step is running.
pub fn explain<S: Geometry>(
    core: &Core<S>,
    py: Python<'_>,
    step: u64,
) -> PyResult<Option<Vec<PlainFinding>>> {
    let loan = core.loan(py)?;
    let told = loan.last_report.as_ref().filter(|r| r.step == step && loan.world.steps() == step);
    Ok(told.map(|report| plain_findings(&loan.world.explain(report))))
}

/// The certificate of the last step's solve as JSON; nothing when no contact touches the body whose island is asked
/// for.
///
/// # Errors
/// `BuildError` for an unknown body, `BusyError`.
pub fn certificate<S: Geometry>(
    core: &Core<S>,
    py: Python<'_>,
    phase: &str,
    island: Option<&str>,
) -> PyResult<Option<String>> {
    let loan = core.loan(py)?;
    let body = island.map(|name| loan.world.index(name)).transpose().map_err(|e| errors::build(py, &e))?;
    Ok(loan.world.certificate(phase_of(phase)?, body).map(|c| c.to_json()))
}

/// The problem that the last step solved, and its impulses in the order of the scalar rows.
///
/// # Errors
/// `BusyError` while a step is running.
pub fn last_problem<'py, S: Geometry>(
    core: &Core<S>,
    py: Python<'py>,
    phase: &str,
) -> PyResult<(Problem<S>, Bound<'py, PyArray1<f64>>)> {
    let loan = core.loan(py)?;
    let (problem, impulses) = match phase_of(phase)? {
        Phase::Contact => {
            let (problem, impulses, _) = loan.world.last_problem();
            (problem.clone(), impulses.flat())
        }
        Phase::Impact => {
            let (problem, impulses, struck) = loan.world.last_impacts();
            let mut problem = problem.clone();
            // without impacts the problem that is left is that of an earlier step
            if struck.is_empty() {
                problem.contacts.clear();
                problem.resistances.clear();
            }
            let impulses = if struck.is_empty() { Vec::new() } else { impulses.flat() };
            (problem, impulses)
        }
    };
    Ok((Problem::new(problem), PyArray1::from_vec(py, impulses)))
}

fn phase_of(name: &str) -> PyResult<Phase> {
    match name {
        "contact" => Ok(Phase::Contact),
        "impact" => Ok(Phase::Impact),
        other => Err(PyValueError::new_err(format!("unknown phase {other:?}"))),
    }
}

fn plain_report<'py, S: Geometry>(
    py: Python<'py>,
    report: &StepReport<S>,
    told: Told,
) -> PyResult<Bound<'py, PyTuple>> {
    let impacts = &report.impacts;
    let fields = [
        report.step.into_bound_py_any(py)?,
        report.time.into_bound_py_any(py)?,
        report.dt.into_bound_py_any(py)?,
        report.residual().into_bound_py_any(py)?,
        report.relative_residual().into_bound_py_any(py)?,
        told.worst.into_bound_py_any(py)?,
        report.iterations().into_bound_py_any(py)?,
        records::STOPS[usize::from(records::stop_code(report))].into_bound_py_any(py)?,
        report.contacts.into_bound_py_any(py)?,
        report.asleep.into_bound_py_any(py)?,
        report.deepest.map(|d| d.0).into_bound_py_any(py)?,
        told.deepest.into_bound_py_any(py)?,
        records::impact_residual(report).into_bound_py_any(py)?,
        report.energy.kinetic().into_bound_py_any(py)?,
        report.energy.potential.into_bound_py_any(py)?,
        PyTuple::new(py, report.momenta.linear.as_slice())?.into_any(),
        PyTuple::new(py, report.momenta.angular.as_slice())?.into_any(),
        PyTuple::new(py, report.ledger.lines())?.into_any(),
        report.solver.name().into_bound_py_any(py)?,
        report.tolerance.into_bound_py_any(py)?,
        report.is_accurate().into_bound_py_any(py)?,
        (impacts.rounds, impacts.guarded, impacts.ended_plastic, impacts.gain, told.gaining)
            .into_bound_py_any(py)?,
        events_of(report).into_bound_py_any(py)?,
        told.islands.into_bound_py_any(py)?,
        told.joints.into_bound_py_any(py)?,
        told.findings.into_bound_py_any(py)?,
        report.groups.iter().map(plain_group).collect::<Vec<_>>().into_bound_py_any(py)?,
    ];
    PyTuple::new(py, fields)
}

/// The books of a group: name, kinetic and potential energy \[J\], momentum, angular momentum, lines of the ledger \[J\],
/// lines of momentum and of angular momentum.
pub type PlainGroup =
    (String, f64, f64, Vec<f64>, Vec<f64>, [f64; Ledger::NAMES.len()], Vec<Vec<f64>>, Vec<Vec<f64>>);

fn plain_group<S: Geometry>(group: &GroupReport<S>) -> PlainGroup {
    (
        group.name.clone(),
        group.energy.kinetic(),
        group.energy.potential,
        group.momenta.linear.as_slice().to_vec(),
        group.momenta.angular.as_slice().to_vec(),
        group.ledger.lines(),
        group.momentum.lines().iter().map(|line| line.as_slice().to_vec()).collect(),
        group.angular_momentum.lines().iter().map(|line| line.as_slice().to_vec()).collect(),
    )
}

/// Asks for the books of groups: names, and the names of their bodies or nothing for all that can move.
///
/// # Errors
/// `BuildError` naming the group and what is wrong with it, `BusyError`.
pub fn set_groups<S: Geometry>(
    core: &Core<S>,
    py: Python<'_>,
    groups: Vec<(String, Option<Vec<String>>)>,
) -> PyResult<()> {
    let groups = groups.into_iter().map(|(name, bodies)| LedgerGroup { name, bodies }).collect();
    core.loan(py)?.world.set_ledger_groups(groups).map_err(|e| errors::build(py, &e))
}

/// The groups that books are kept of.
///
/// # Errors
/// `BusyError` while a step is running.
pub fn groups<S: Geometry>(core: &Core<S>, py: Python<'_>) -> PyResult<Vec<(String, Option<Vec<String>>)>> {
    let loan = core.loan(py)?;
    Ok(loan.world.ledger_groups().iter().map(|g| (g.name.clone(), g.bodies.clone())).collect())
}

/// The books of the groups since they were asked for.
///
/// # Errors
/// `BusyError` while a step is running.
pub fn group_ledgers<S: Geometry>(core: &Core<S>, py: Python<'_>) -> PyResult<Vec<PlainGroup>> {
    Ok(core.loan(py)?.world.group_ledgers().iter().map(plain_group).collect())
}

/// What happened within the step, in the order of the Python side's `EventReport`.
fn events_of<S: Geometry>(report: &StepReport<S>) -> (usize, usize, usize, usize, usize, f64, usize) {
    let e = &report.events;
    (e.arrivals, e.impacts, e.slip_stops, e.capped, e.projections, e.deepest, e.islands)
}

/// The contacts of the last step as bytes of records.
///
/// # Errors
/// `BusyError` while a step is running.
pub fn contacts<'py, S: Geometry>(core: &Core<S>, py: Python<'py>) -> PyResult<Bound<'py, PyArray1<u8>>> {
    let mut records = Records::default();
    records::append_contacts(&core.loan(py)?.world, &mut records);
    Ok(PyArray1::from_vec(py, records.0))
}

/// What the contacts did in the last step, act by act, as bytes of records.
///
/// # Errors
/// `BusyError` while a step is running.
pub fn events<'py, S: Geometry>(core: &Core<S>, py: Python<'py>) -> PyResult<Bound<'py, PyArray1<u8>>> {
    let mut records = Records::default();
    records::append_events(&core.loan(py)?.world, &mut records);
    Ok(PyArray1::from_vec(py, records.0))
}

/// Kinetic energy of translation and rotation, potential energy \[J\].
///
/// # Errors
/// `BusyError` while a step is running.
pub fn energy<S: Geometry>(core: &Core<S>, py: Python<'_>) -> PyResult<(f64, f64, f64)> {
    let e = core.loan(py)?.world.energy();
    Ok((e.translational, e.rotational, e.potential))
}

/// Momentum \[kg m/s\] and angular momentum about the world's origin \[kg m^2/s\].
///
/// # Errors
/// `BusyError` while a step is running.
pub fn momenta<S: Geometry>(core: &Core<S>, py: Python<'_>) -> PyResult<(Vec<f64>, Vec<f64>)> {
    let m = core.loan(py)?.world.momenta();
    Ok((m.linear.as_slice().to_vec(), m.angular.as_slice().to_vec()))
}

/// The problem of the next step from here; phase "contact" or "impact".
///
/// # Errors
/// As `step`.
pub fn problem<S: Geometry>(
    core: &Core<S>,
    py: Python<'_>,
    dt: Option<f64>,
    phase: &str,
) -> PyResult<Problem<S>> {
    let phase = phase_of(phase)?;
    let found = core.advance(py, |world| world.problem(dt.unwrap_or(world.settings().dt), phase))?;
    match found {
        Ok(problem) => Ok(Problem::new(problem)),
        Err(error) => Err(chunk::failed(core, py, &error)),
    }
}

/// The whole state as a text.
///
/// # Errors
/// `BuildError` naming a body whose numbers are not finite, `BusyError`.
pub fn snapshot<S: Geometry>(core: &Core<S>, py: Python<'_>) -> PyResult<String> {
    let mut loan = core.loan(py)?;
    let bodies = loan.world.bodies();
    let m = &bodies.motion;
    for i in 0..bodies.len() {
        let finite = m.position[i].is_finite()
            && carom::Rotation::is_finite(&m.rotation[i])
            && m.velocity[i].is_finite()
            && m.angular_velocity[i].is_finite();
        if !finite {
            let (field, problem) = ("motion", "is not finite, so no snapshot could be restored");
            let error = BuildError::body(&bodies.names[i], field, problem, "set it to finite numbers");
            return Err(errors::build(py, &error));
        }
    }
    Ok(loan.world.snapshot())
}

/// Brings back the state of a snapshot.
///
/// # Errors
/// `BuildError` for a text that is no snapshot or names a force field that is not there; `ViewError`, `BusyError`.
/// Nothing changes then.
pub fn restore<S: Geometry>(core: &Core<S>, py: Python<'_>, text: &str) -> PyResult<()> {
    let what = "cannot restore a snapshot";
    core.views.refuse_if_alive(py, what)?;
    let refused =
        |e: BuildError| errors::build(py, &BuildError { problem: errors::placeless(&e.problem), ..e });
    let (mut world, names) = World::from_snapshot(text).map_err(refused)?;
    core.fields.attach_to(&mut world, &names).map_err(|name| {
        let problem = format!("needs the force field '{name}', which this world has not");
        errors::argument(py, "snapshot", &problem, &format!("call add_force('{name}', ...) before restore"))
    })?;
    core.replace(py, world, what)
}
