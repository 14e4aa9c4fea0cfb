//! One body at a time: what it is, where it is, what it carries, and pushes on it.

use crate::arguments::{self, BodyArguments};
use crate::arrays;
use crate::errors;
use crate::shared::{Core, Loan};
use carom::{BuildError, Column, Geometry, Pose, World, Wrench};
use numpy::PyArray1;
use pyo3::prelude::*;
use pyo3::types::PyDict;

/// Adds a body.
///
/// # Errors
/// `BuildError`, `ViewError`, `BusyError`.
pub fn add<S: Geometry>(
    core: &Core<S>,
    py: Python<'_>,
    name: &str,
    arguments: &BodyArguments,
) -> PyResult<()> {
    let spec = arguments.spec::<S>(py)?;
    let mut loan = core.loan_to_restructure(py, &format!("cannot add body '{name}'"))?;
    let added = loan.world.add(name, spec);
    drop(loan);
    added.map(|_| ()).map_err(|e| errors::build(py, &e))
}

/// Removes a body.
///
/// # Errors
/// `BuildError` for an unknown name, `ViewError`, `BusyError`.
pub fn remove<S: Geometry>(core: &Core<S>, py: Python<'_>, name: &str) -> PyResult<()> {
    let mut loan = core.loan_to_restructure(py, &format!("cannot remove body '{name}'"))?;
    let removed = loan.world.remove(name);
    drop(loan);
    removed.map_err(|e| errors::build(py, &e))
}

/// The world, for one call, and the index of a named body in it.
fn find<'a, S: Geometry>(core: &'a Core<S>, py: Python<'_>, name: &str) -> PyResult<(Loan<'a, S>, usize)> {
    let loan = core.loan(py)?;
    match loan.world.index(name) {
        Ok(i) => Ok((loan, i)),
        Err(error) => {
            drop(loan);
            Err(errors::build(py, &error))
        }
    }
}

/// The same for a body that forces move; `what` is the push that others have no use for.
fn find_movable<'a, S: Geometry>(
    core: &'a Core<S>,
    py: Python<'_>,
    name: &str,
    what: &str,
) -> PyResult<(Loan<'a, S>, usize)> {
    let (loan, i) = find(core, py, name)?;
    if loan.world.bodies().is_dynamic(i) {
        return Ok((loan, i));
    }
    let kind = arguments::kind_name(loan.world.bodies().data[i].kind);
    drop(loan);
    let problem = format!("has no effect on a {kind} body");
    Err(errors::build(py, &BuildError::body(name, what, problem, "make the body dynamic, or leave it alone")))
}

/// Index of a named body.
///
/// # Errors
/// `BuildError` for an unknown name, `BusyError`.
pub fn index<S: Geometry>(core: &Core<S>, py: Python<'_>, name: &str) -> PyResult<usize> {
    find(core, py, name).map(|(_, i)| i)
}

/// What does not change: kind, mass properties, coefficients, shape as JSON.
///
/// # Errors
/// `BuildError` for an unknown name, `BusyError`.
pub fn constants<'py, S: Geometry>(
    core: &Core<S>,
    py: Python<'py>,
    name: &str,
) -> PyResult<Bound<'py, PyDict>> {
    let (loan, i) = find(core, py, name)?;
    let data = loan.world.bodies().data[i].clone();
    let material = loan.world.bodies().material(i).map(String::from);
    drop(loan);
    let dict = PyDict::new(py);
    dict.set_item("kind", arguments::kind_name(data.kind))?;
    dict.set_item("mass_properties", arguments::plain_mass(&data.mass_properties))?;
    dict.set_item("friction", data.friction)?;
    dict.set_item("rolling_friction", data.rolling_friction)?;
    dict.set_item("spinning_friction", data.spinning_friction)?;
    dict.set_item("restitution", data.restitution)?;
    dict.set_item("tangential_restitution", data.tangential_restitution)?;
    dict.set_item("extent", data.extent)?;
    dict.set_item("material", material)?;
    dict.set_item("linear_damping", data.linear_damping)?;
    dict.set_item("angular_damping", data.angular_damping)?;
    dict.set_item("collision_groups", data.groups)?;
    dict.set_item("collision_mask", data.collides_with)?;
    let shape = data.shape.as_ref().map(|s| serde_json::to_string(s).expect("a shape is plain data"));
    dict.set_item("shape", shape)?;
    Ok(dict)
}

/// A copy of part `which` of a body's motion (numbers as in `views::ARRAYS`).
///
/// # Errors
/// `BuildError` for an unknown name, `BusyError`.
pub fn read<'py, S: Geometry>(
    core: &Core<S>,
    py: Python<'py>,
    name: &str,
    which: usize,
) -> PyResult<Bound<'py, PyArray1<f64>>> {
    let (loan, i) = find(core, py, name)?;
    let motion = &loan.world.bodies().motion;
    let numbers = match which {
        0 => motion.position[i].as_slice().to_vec(),
        1 => arguments::plain_rotation::<S>(&motion.rotation[i]),
        2 => motion.velocity[i].as_slice().to_vec(),
        _ => motion.angular_velocity[i].as_slice().to_vec(),
    };
    drop(loan);
    Ok(PyArray1::from_vec(py, numbers))
}

/// Sets part `which` of a body's motion.
///
/// # Errors
/// `BuildError` for an unknown name, `BusyError`, `ValueError` for a wrong count.
pub fn write<S: Geometry>(
    core: &Core<S>,
    py: Python<'_>,
    name: &str,
    which: usize,
    values: &[f64],
) -> PyResult<()> {
    let (mut loan, i) = find(core, py, name)?;
    let motion = loan.world.motion_mut();
    match which {
        0 => motion.position[i] = arrays::column(values)?,
        1 => motion.rotation[i] = arrays::rotation::<S>(values)?,
        2 => motion.velocity[i] = arrays::column(values)?,
        _ => motion.angular_velocity[i] = arrays::column(values)?,
    }
    Ok(())
}

/// What a body carries: kinetic energy of translation and of rotation \[J\], momentum \[kg m/s\], angular momentum about
/// its centre of mass and about the world's origin \[kg m^2/s\].
pub type Carried = (f64, f64, Vec<f64>, Vec<f64>, Vec<f64>);

/// See [`Carried`].
///
/// # Errors
/// `BuildError` for an unknown name, `BusyError`.
pub fn carried<S: Geometry>(core: &Core<S>, py: Python<'_>, name: &str) -> PyResult<Carried> {
    let (loan, i) = find(core, py, name)?;
    let bodies = loan.world.bodies();
    let energies = (bodies.translational_energy(i), bodies.rotational_energy(i));
    let vectors = (bodies.momentum(i), bodies.spin_momentum(i), bodies.angular_momentum(i));
    let list = |v: &[f64]| v.to_vec();
    let (p, spin, angular) = (vectors.0.as_slice(), vectors.1.as_slice(), vectors.2.as_slice());
    Ok((energies.0, energies.1, list(p), list(spin), list(angular)))
}

/// Sets velocities from momentum \[kg m/s\] and angular momentum about the centre of mass \[kg m^2/s\].
///
/// # Errors
/// `BuildError` for an unknown name, `BusyError`, `ValueError` for a wrong count.
pub fn set_momenta<S: Geometry>(
    core: &Core<S>,
    py: Python<'_>,
    name: &str,
    momentum: &[f64],
    spin_momentum: &[f64],
) -> PyResult<()> {
    let (p, spin) = (arrays::column(momentum)?, arrays::column(spin_momentum)?);
    let (mut loan, i) = find_movable(core, py, name, "momentum")?;
    loan.world.set_momenta(i, p, spin);
    Ok(())
}

/// Wakes the island of a body; whether it slept.
///
/// # Errors
/// `BuildError` for an unknown name, `BusyError`.
pub fn wake<S: Geometry>(core: &Core<S>, py: Python<'_>, name: &str) -> PyResult<bool> {
    let mut loan = core.loan(py)?;
    let i = loan.world.index(name).map_err(|e| errors::build(py, &e))?;
    Ok(loan.world.wake(i))
}

/// Inertia about a world axis through a world point, the centre of mass when there is none \[kg m^2\] (item 13).
///
/// # Errors
/// `BuildError` for an unknown name, `BusyError`, `ValueError` for a wrong count.
pub fn inertia_about<S: Geometry>(
    core: &Core<S>,
    py: Python<'_>,
    name: &str,
    axis: &[f64],
    point: Option<Vec<f64>>,
) -> PyResult<f64> {
    let axis: S::Spin = arrays::column(axis)?;
    let point = point.map(|p| arrays::column::<S::Vector>(&p)).transpose()?;
    let (loan, i) = find(core, py, name)?;
    let bodies = loan.world.bodies();
    let pose = bodies.motion.pose(i);
    let own = bodies.data[i].mass_properties.placed(&bodies.shape_pose(i));
    Ok(own.about_axis(axis, point.unwrap_or(pose.position)))
}

/// The vector functions of a body at a point.
#[derive(Clone, Copy)]
pub enum AtPoint {
    /// Velocity of the body's point at a world point \[m/s\]: v + w x r.
    Velocity,
    /// World coordinates of a point in body axes from the centre of mass: x + R r \[m\].
    ToWorld,
    /// The inverse: R^T (r - x) \[m\].
    ToBody,
}

/// One of [`AtPoint`].
///
/// # Errors
/// `BuildError` for an unknown name, `BusyError`, `ValueError` for a wrong count.
pub fn at_point<'py, S: Geometry>(
    core: &Core<S>,
    py: Python<'py>,
    name: &str,
    what: AtPoint,
    point: &[f64],
) -> PyResult<Bound<'py, PyArray1<f64>>> {
    let point: S::Vector = arrays::column(point)?;
    let (loan, i) = find(core, py, name)?;
    let motion = &loan.world.bodies().motion;
    let pose: Pose<S> = motion.pose(i);
    let result = match what {
        AtPoint::Velocity => motion.twist(i).at(point - pose.position),
        AtPoint::ToWorld => pose.to_world(point),
        AtPoint::ToBody => pose.to_body(point),
    };
    drop(loan);
    Ok(PyArray1::from_slice(py, result.as_slice()))
}

/// Applies force \[N\] at a world point (the centre of mass when there is none) and torque \[N m\] in the next step.
///
/// # Errors
/// `BuildError` for an unknown name, `BusyError`, `ValueError` for a wrong count.
pub fn apply_wrench<S: Geometry>(
    core: &Core<S>,
    py: Python<'_>,
    name: &str,
    force: &[f64],
    torque: &[f64],
    at: Option<Vec<f64>>,
) -> PyResult<()> {
    let (force, torque): (S::Vector, S::Spin) = (arrays::column(force)?, arrays::column(torque)?);
    let at = at.map(|p| arrays::column::<S::Vector>(&p)).transpose()?;
    let (mut loan, i) = find_movable(core, py, name, "force")?;
    let arm = at.map_or(S::Vector::ZERO, |p| p - loan.world.bodies().motion.position[i]);
    let mut wrench = Wrench::at(force, arm);
    wrench.torque += torque;
    loan.world.apply_wrench(i, wrench);
    Ok(())
}

/// Applies an impulse \[N s\] at a world point (the centre of mass when there is none) now.
///
/// # Errors
/// `BuildError` for an unknown name, `BusyError`, `ValueError` for a wrong count.
pub fn apply_impulse<S: Geometry>(
    core: &Core<S>,
    py: Python<'_>,
    name: &str,
    impulse: &[f64],
    at: Option<Vec<f64>>,
) -> PyResult<()> {
    let impulse: S::Vector = arrays::column(impulse)?;
    let at = at.map(|p| arrays::column::<S::Vector>(&p)).transpose()?;
    let (mut loan, i) = find_movable(core, py, name, "impulse")?;
    let world: &mut World<S> = &mut loan.world;
    let point = at.unwrap_or(world.bodies().motion.position[i]);
    world.apply_impulse(i, impulse, point);
    Ok(())
}
