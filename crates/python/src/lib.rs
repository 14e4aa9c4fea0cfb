//! The binding layer between the engine and `python/carom`, as the module `carom._carom`. It converts and guards;
//! it knows no physics. Users import the Python package, which states shapes, units and errors.

mod arguments;
mod arrays;
mod body;
mod chunk;
mod classes;
mod errors;
mod fields;
mod friction_problem;
mod gradient;
mod joint;
mod lookout;
mod pieces;
mod problem;
mod records;
mod settings;
mod shared;
mod step;
mod views;

use carom::geometry::{Decomposition, decompose as decompose_mesh};
use carom::solver::collision;
use carom::{EventKind, Ledger, MomentumLedger, OnInaccurate, PieceKind, SolverKind, Vec3, vec3};
use classes::{
    PlanarPieces, PlanarProblem, PlanarRollout, PlanarWorld, SpatialPieces, SpatialProblem, SpatialRollout,
    SpatialWorld,
};
use numpy::{PyArray2, PyReadonlyArray2};
use pyo3::IntoPyObjectExt;
use pyo3::prelude::*;

/// The scenes that come with the engine: name, space, description, usual duration \[s\].
#[pyfunction]
fn scene_names() -> Vec<(&'static str, &'static str, &'static str, f64)> {
    carom_scenes::catalogue().iter().map(|s| (s.name, s.space, s.description, s.duration)).collect()
}

/// A scene by name, as the world of its space.
///
/// # Errors
/// `BuildError` for an unknown name.
#[pyfunction]
fn build_scene<'py>(py: Python<'py>, name: &str) -> PyResult<Bound<'py, PyAny>> {
    if let Some(built) = carom_scenes::planar(name) {
        return PlanarWorld::of(built.map_err(|e| errors::build(py, &e))?).into_bound_py_any(py);
    }
    match carom_scenes::spatial(name) {
        Some(built) => SpatialWorld::of(built.map_err(|e| errors::build(py, &e))?).into_bound_py_any(py),
        None => {
            Err(errors::argument(py, "scene", &format!("is unknown: '{name}'"), "`carom scenes` lists them"))
        }
    }
}

/// Corners of at most `max_parts` convex parts, as (k, 3) arrays \[m\], that follow the solid inside a closed mesh.
///
/// # Errors
/// `BuildError` for malformed meshes.
#[pyfunction]
fn decompose<'py>(
    py: Python<'py>,
    vertices: PyReadonlyArray2<'py, f64>,
    triangles: PyReadonlyArray2<'py, u32>,
    max_parts: u32,
) -> PyResult<Vec<Bound<'py, PyArray2<f64>>>> {
    let points: Vec<Vec3> = vertices.as_array().rows().into_iter().map(|r| vec3(r[0], r[1], r[2])).collect();
    let faces: Vec<[u32; 3]> = triangles.as_array().rows().into_iter().map(|r| [r[0], r[1], r[2]]).collect();
    let options = Decomposition { max_parts, ..Decomposition::default() };
    let parts = py.detach(|| decompose_mesh(&points, &faces, &options)).map_err(|e| errors::shape(py, e))?;
    parts.iter().map(|part| arrays::matrix(py, arrays::flat(part), 3)).collect()
}

/// Impulse of an isolated collision \[N s\].
#[pyfunction]
fn normal_impulse(normal_velocity: f64, restitution: f64, effective_mass: f64) -> f64 {
    collision::normal_impulse(normal_velocity, restitution, effective_mass)
}

/// Kinetic energy lost by a frictionless collision \[J\].
#[pyfunction]
fn energy_lost(normal_velocity: f64, restitution: f64, effective_mass: f64) -> f64 {
    collision::energy_lost(normal_velocity, restitution, effective_mass)
}

#[pymodule]
fn _carom(m: &Bound<'_, PyModule>) -> PyResult<()> {
    m.add_class::<PlanarWorld>()?;
    m.add_class::<SpatialWorld>()?;
    m.add_class::<PlanarProblem>()?;
    m.add_class::<SpatialProblem>()?;
    m.add_class::<PlanarPieces>()?;
    m.add_class::<SpatialPieces>()?;
    m.add_class::<PlanarRollout>()?;
    m.add_class::<SpatialRollout>()?;
    m.add_class::<friction_problem::PyFrictionProblem>()?;
    m.add_function(wrap_pyfunction!(scene_names, m)?)?;
    m.add_function(wrap_pyfunction!(build_scene, m)?)?;
    m.add_function(wrap_pyfunction!(decompose, m)?)?;
    m.add_function(wrap_pyfunction!(normal_impulse, m)?)?;
    m.add_function(wrap_pyfunction!(energy_lost, m)?)?;
    m.add("LEDGER_LINES", Ledger::NAMES.to_vec())?;
    m.add("MOMENTUM_LINES", MomentumLedger::<Vec3>::NAMES.to_vec())?;
    m.add("SOLVERS", SolverKind::ALL.map(SolverKind::name).to_vec())?;
    m.add("FRICTION_SOLVERS", friction_problem::solver_names())?;
    m.add("STOPS", records::STOPS.to_vec())?;
    m.add("CONTACT_STATUS", carom::observe::push::CONTACT_STATUS.to_vec())?;
    m.add("EVENT_KINDS", EventKind::NAMES.to_vec())?;
    m.add("PIECE_KINDS", PieceKind::NAMES.to_vec())?;
    m.add("ON_INACCURATE", OnInaccurate::ALL.map(OnInaccurate::name).to_vec())?;
    m.add("__version__", env!("CARGO_PKG_VERSION"))
}
