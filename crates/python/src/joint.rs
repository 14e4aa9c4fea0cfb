//! Joints as Python says them and reads them.

use crate::arrays;
use crate::errors;
use crate::shared::Core;
use carom::{Anchor, Column, Geometry, JointKind, JointSpec, Reaction};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyDict;

/// The dictionary that the Python side fills; anchors are ("center" | "body" | "world", numbers).
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub struct JointArguments {
    kind: String,
    a: String,
    b: Option<String>,
    anchor_a: Option<(String, Vec<f64>)>,
    anchor_b: Option<(String, Vec<f64>)>,
    length: Option<f64>,
    collide: bool,
}

/// Name, force \[N\], torque \[N m\], impulse \[N s\] and angular impulse \[N m s\] of impacts.
pub type PlainReaction = (String, Vec<f64>, Vec<f64>, Vec<f64>, Vec<f64>);

fn anchor<S: Geometry>(given: Option<&(String, Vec<f64>)>) -> PyResult<Option<Anchor<S>>> {
    let Some((form, numbers)) = given else { return Ok(None) };
    let numbers = || arrays::column(numbers);
    Ok(Some(match form.as_str() {
        "center" => Anchor::Center,
        "body" => Anchor::Body(numbers()?),
        "world" => Anchor::World(numbers()?),
        other => return Err(PyValueError::new_err(format!("unknown anchor {other:?}"))),
    }))
}

fn spec<S: Geometry>(given: &JointArguments) -> PyResult<JointSpec<S>> {
    let kind = match given.kind.as_str() {
        "point" => JointKind::Point,
        "distance" => JointKind::Distance,
        "fixed" => JointKind::Fixed,
        other => return Err(PyValueError::new_err(format!("unknown joint {other:?}"))),
    };
    Ok(JointSpec {
        kind,
        a: given.a.clone(),
        b: given.b.clone(),
        anchor_a: anchor(given.anchor_a.as_ref())?,
        anchor_b: anchor(given.anchor_b.as_ref())?,
        length: given.length,
        collide: given.collide,
    })
}

/// Adds a joint.
///
/// # Errors
/// `BuildError`, `BusyError`.
pub fn add<S: Geometry>(
    core: &Core<S>,
    py: Python<'_>,
    name: &str,
    arguments: &JointArguments,
) -> PyResult<()> {
    let spec = spec::<S>(arguments)?;
    let added = core.loan(py)?.world.add_joint(name, spec);
    added.map(|_| ()).map_err(|e| errors::build(py, &e))
}

/// Removes a joint.
///
/// # Errors
/// `BuildError` for an unknown name, `BusyError`.
pub fn remove<S: Geometry>(core: &Core<S>, py: Python<'_>, name: &str) -> PyResult<()> {
    let removed = core.loan(py)?.world.remove_joint(name);
    removed.map_err(|e| errors::build(py, &e))
}

/// What does not change of a joint, its present error \[m\], and what it gave in the last step.
///
/// # Errors
/// `BuildError` for an unknown name, `BusyError`.
pub fn read<'py, S: Geometry>(core: &Core<S>, py: Python<'py>, name: &str) -> PyResult<Bound<'py, PyDict>> {
    let loan = core.loan(py)?;
    let bodies = loan.world.bodies();
    let Some(number) = bodies.joints.find(name) else {
        let error = bodies.joints.unknown(name);
        drop(loan);
        return Err(errors::build(py, &error));
    };
    let joint = &bodies.joints.all[number];
    let (on_a, on_b) = joint.anchors(&bodies.motion);
    let mut errors = Vec::new();
    joint.errors(&bodies.motion, &mut errors);
    let told = PyDict::new(py);
    told.set_item("kind", joint.kind.name())?;
    told.set_item("a", &bodies.names[joint.a])?;
    told.set_item("b", joint.b.map(|b| bodies.names[b].clone()))?;
    told.set_item("length", joint.length)?;
    told.set_item("collide", joint.collide)?;
    told.set_item("place_a", on_a.as_slice())?;
    told.set_item("place_b", on_b.as_slice())?;
    told.set_item("error", errors.iter().fold(0.0, |m: f64, e| m.max(e.abs())))?;
    let given = loan.world.reactions().get(number).copied().unwrap_or_default();
    told.set_item("reaction", plain(name, &given))?;
    Ok(told)
}

/// A reaction in plain numbers.
pub fn plain<S: Geometry>(name: &str, r: &Reaction<S>) -> PlainReaction {
    let (force, torque) = (r.force.as_slice().to_vec(), r.torque.as_slice().to_vec());
    (name.into(), force, torque, r.impact.as_slice().to_vec(), r.impact_moment.as_slice().to_vec())
}
