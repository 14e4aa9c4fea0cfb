//! One step, its report, and what is known of the world as a whole.

use crate::chunk;
use crate::errors;
use crate::problem::Problem;
use crate::records::{self, Records};
use crate::shared::Core;
use carom::{BuildError, Column, Geometry, Phase, StepReport, World};
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

/// Takes a step of length `dt` \[s\], the setting's when there is none; the report's fields in the order of the
/// Python side's `StepReport`.
///
/// # Errors
/// `StepError`, what a force field raised, `BusyError`.
pub fn step<'py, S: Geometry>(
    core: &Core<S>,
    py: Python<'py>,
    dt: Option<f64>,
) -> PyResult<Bound<'py, PyTuple>> {
    let taken = core.advance(py, |world| {
        let report = world.step(dt.unwrap_or(world.settings().dt))?;
        let worst = names(world, report.worst());
        let deepest = names(world, report.deepest.map(|(_, a, b)| (a, b)));
        Ok((report, worst, deepest))
    })?;
    match taken {
        Ok((report, worst, deepest)) => plain_report(py, &report, worst, deepest),
        Err(error) => Err(chunk::failed(core, py, &error)),
    }
}

fn plain_report<'py, S: Geometry>(
    py: Python<'py>,
    report: &StepReport<S>,
    worst: Pair,
    deepest: Pair,
) -> PyResult<Bound<'py, PyTuple>> {
    let fields = [
        report.step.into_bound_py_any(py)?,
        report.time.into_bound_py_any(py)?,
        report.dt.into_bound_py_any(py)?,
        report.residual().into_bound_py_any(py)?,
        report.relative_residual().into_bound_py_any(py)?,
        worst.into_bound_py_any(py)?,
        report.iterations().into_bound_py_any(py)?,
        records::STOPS[usize::from(records::stop_code(report))].into_bound_py_any(py)?,
        report.contacts.into_bound_py_any(py)?,
        report.deepest.map(|d| d.0).into_bound_py_any(py)?,
        deepest.into_bound_py_any(py)?,
        records::impact_residual(report).into_bound_py_any(py)?,
        report.energy.kinetic().into_bound_py_any(py)?,
        report.energy.potential.into_bound_py_any(py)?,
        PyTuple::new(py, report.momenta.linear.as_slice())?.into_any(),
        PyTuple::new(py, report.momenta.angular.as_slice())?.into_any(),
        PyTuple::new(py, report.ledger.lines())?.into_any(),
    ];
    PyTuple::new(py, fields)
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
    let phase = match phase {
        "contact" => Phase::Contact,
        "impact" => Phase::Impact,
        other => return Err(PyValueError::new_err(format!("unknown phase {other:?}"))),
    };
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
