//! The engine's errors as the exceptions of `carom.errors`, with body, field and remedy as attributes. The
//! Python side adds the offending value where it has it.

use crate::step::PlainFinding;
use carom::solver::ProblemError;
use carom::{BuildError, ShapeError, StepError};
use pyo3::prelude::*;
use pyo3::types::PyDict;

/// Parts of an exception.
struct Parts<'a> {
    message: String,
    body: Option<&'a str>,
    field: Option<&'a str>,
    value: Option<&'a str>,
    remedy: Option<&'a str>,
}

/// The joint that an error names.
fn with_joint(py: Python<'_>, error: PyErr, joint: Option<&str>) -> PyErr {
    match joint.map(|name| error.value(py).setattr("joint", name)) {
        Some(Err(other)) => other,
        _ => error,
    }
}

/// Python's words: what is no number, what never moves.
fn spelled(text: &str) -> String {
    text.replace("NaN", "nan").replace("a fixed body", "a static body")
}

/// A deserialiser's words without the place in a text that users never see.
pub fn placeless(problem: &str) -> String {
    problem.split(" at line ").next().unwrap_or(problem).to_string()
}

fn raise(py: Python<'_>, class: &str, parts: Parts<'_>) -> PyErr {
    let make = || -> PyResult<PyErr> {
        let keywords = PyDict::new(py);
        keywords.set_item("body", parts.body)?;
        keywords.set_item("field", parts.field)?;
        keywords.set_item("value", parts.value.map(spelled))?;
        keywords.set_item("remedy", parts.remedy)?;
        let class = py.import("carom.errors")?.getattr(class)?;
        Ok(PyErr::from_value(class.call((spelled(&parts.message),), Some(&keywords))?))
    };
    make().unwrap_or_else(|error| error)
}

/// A refused input.
pub fn build(py: Python<'_>, e: &BuildError) -> PyErr {
    let (field, remedy) = (Some(e.field.as_str()), Some(e.remedy.as_str()));
    let parts = Parts { message: e.to_string(), body: e.body.as_deref(), field, value: None, remedy };
    with_joint(py, raise(py, "BuildError", parts), e.joint.as_deref())
}

/// A refused shape that belongs to no body yet.
pub fn shape(py: Python<'_>, e: ShapeError) -> PyErr {
    let field = carom::error::shape_field(&e.field);
    build(py, &BuildError { body: None, joint: None, field, problem: e.problem, remedy: e.remedy })
}

/// A refused contact problem.
pub fn problem(py: Python<'_>, e: &ProblemError) -> PyErr {
    let (field, remedy) = (Some(e.place.as_str()), Some(e.remedy.as_str()));
    let message = ProblemError { problem: placeless(&e.problem), ..e.clone() }.to_string();
    raise(py, "BuildError", Parts { message, body: None, field, value: None, remedy })
}

/// A refused argument.
pub fn argument(py: Python<'_>, field: &str, problem: &str, remedy: &str) -> PyErr {
    build(py, &BuildError::setting(field, problem, remedy))
}

/// A step that could not be taken, with what was found out about its solve.
pub fn step(py: Python<'_>, e: &StepError, findings: Vec<PlainFinding>) -> PyErr {
    let error = step_alone(py, e);
    if findings.is_empty() {
        return error;
    }
    match error.value(py).call_method1("_tell", (findings,)) {
        Ok(_) => error,
        Err(other) => other,
    }
}

fn step_alone(py: Python<'_>, e: &StepError) -> PyErr {
    let mut parts = Parts { message: e.to_string(), body: None, field: None, value: None, remedy: None };
    let mut class = "StepError";
    match e {
        StepError::NotFinite { body, field, value, remedy, .. } => {
            parts = Parts {
                body: Some(body),
                field: Some(field),
                value: Some(value),
                remedy: Some(remedy),
                ..parts
            };
        }
        StepError::FixedMoves { body, field, value, remedy, .. } => {
            parts = Parts {
                body: Some(body),
                field: Some(field),
                value: Some(value),
                remedy: Some(remedy),
                ..parts
            };
        }
        StepError::Argument { field, remedy, .. } => {
            parts = Parts { field: Some(field), remedy: Some(remedy), ..parts };
        }
        StepError::SolverRefused { solver, .. } => {
            class = "SolverError";
            parts = Parts {
                field: Some("solver"),
                value: Some(solver),
                remedy: Some("choose solver pgs, or lemke for small planar problems"),
                ..parts
            };
        }
        StepError::Inaccurate { .. } => {
            class = "InaccurateError";
            let remedy =
                "see the findings; on_inaccurate = 'escalate' hands such islands to stronger solvers";
            parts = Parts { field: Some("tolerance"), remedy: Some(remedy), ..parts };
        }
        StepError::EnergyGain { bodies, .. } => {
            class = "EnergyGainError";
            let remedy = "set energy_guard = 'clamp' or 'warn', or choose impact = 'moreau'";
            let (body, field) = (Some(bodies.0.as_str()), Some("energy_guard"));
            parts = Parts { body, field, remedy: Some(remedy), ..parts };
        }
        StepError::Joint { remedy, .. } => {
            parts = Parts { field: Some("joint"), remedy: Some(remedy), ..parts };
        }
        StepError::Interrupted { .. } => {}
        StepError::ForceField { field, .. } => {
            parts = Parts { field: Some(field), remedy: Some("return finite numbers"), ..parts };
        }
    }
    let joint = if let StepError::Joint { joint, .. } = e { Some(joint.as_str()) } else { None };
    with_joint(py, raise(py, class, parts), joint)
}

/// Another call is using the world.
pub fn busy(py: Python<'_>) -> PyErr {
    let remedy =
        "wait until the other thread's step or run has returned; inside a force field use its arguments";
    let message = format!("world is busy with a step; {remedy}");
    raise(py, "BusyError", Parts { message, body: None, field: None, value: None, remedy: Some(remedy) })
}

/// An internal error ended a step in the middle.
pub fn broken(py: Python<'_>) -> PyErr {
    let remedy = "restore a snapshot or build the world again, and report the panic";
    let message = format!("world was left half changed by an internal error; {remedy}");
    raise(py, "CaromError", Parts { message, body: None, field: None, value: None, remedy: Some(remedy) })
}

/// Arrays look at memory that a change of the bodies would move.
pub fn views_alive(py: Python<'_>, what: &str, names: &[&str]) -> PyErr {
    let list = names.join(", ");
    let remedy = "drop them with del, or keep copies made with .copy()";
    let message = format!("{what}: arrays of the world are still in use ({list}); {remedy}");
    raise(
        py,
        "ViewError",
        Parts { message, body: None, field: Some(&list), value: None, remedy: Some(remedy) },
    )
}
