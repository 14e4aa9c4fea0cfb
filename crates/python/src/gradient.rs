//! Rollouts that can be differentiated, in plain values: flat arrays in, flat arrays out. Knows no names of fields that
//! users read; `carom.gradient` has them.

use crate::arrays;
use crate::errors;
use crate::shared::Core;
use carom::gradient::{GradientError, Plan, Rollout, StateCotangent};
use carom::{Column, Geometry, Wrench};
use numpy::{PyArray1, PyReadonlyArray1};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::sync::{Mutex, PoisonError};

/// Names of two materials, and the derivatives by their friction and restitution.
type PlainPair = (String, String, f64, f64);

/// A step on an edge: number, names of bodies, reason, what it means.
pub type PlainFlag = (usize, Vec<String>, &'static str, &'static str);

/// A rollout that Python shares; one pullback at a time.
pub struct Recorded<S: Geometry>(Mutex<Rollout<S>>);

/// Cotangents by state: the state, and flat arrays of position, rotation numbers, rotation vectors, velocity, spin.
pub type PlainCotangents<'py> = Vec<(usize, Vec<PyReadonlyArray1<'py, f64>>)>;

fn raised(py: Python<'_>, e: &GradientError) -> PyErr {
    match e {
        GradientError::Refused(e) => errors::build(py, e),
        GradientError::Step(e) => errors::step(py, e, Vec::new()),
    }
}

/// Loads of every step from flat forces and torques.
fn loads<S: Geometry>(numbers: &[f64], steps: usize) -> Vec<Vec<Wrench<S>>> {
    let width = S::DIM + S::SPIN;
    if numbers.is_empty() || steps == 0 {
        return Vec::new();
    }
    let wrench = |w: &[f64]| Wrench {
        force: S::Vector::from_fn(|k| w[k]),
        torque: S::Spin::from_fn(|k| w[S::DIM + k]),
    };
    let of_step = |s: &[f64]| s.chunks_exact(width).map(wrench).collect();
    numbers.chunks_exact(numbers.len() / steps).map(of_step).collect()
}

/// Records steps of a world, which stays as it is. Loads are (steps, bodies, force and torque), flat; empty for none.
///
/// # Errors
/// `BuildError`, `StepError`, `BusyError`.
pub fn record<S: Geometry>(
    core: &Core<S>,
    py: Python<'_>,
    (steps, dt): (usize, Option<f64>),
    numbers: &PyReadonlyArray1<'_, f64>,
    stretch: Option<usize>,
) -> PyResult<Recorded<S>> {
    let loads = loads::<S>(numbers.as_slice()?, steps);
    let plan = Plan { steps, dt, loads, stretch };
    let done = core.advance(py, |world| Rollout::record(world, &plan))?;
    done.map(|rollout| Recorded(Mutex::new(rollout))).map_err(|e| raised(py, &e))
}

impl<S: Geometry> Recorded<S> {
    /// Position, rotation, velocity and angular velocity of all states, flat, in one dictionary.
    ///
    /// # Errors
    /// When the interpreter has no memory.
    pub fn states<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let rollout = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let all = rollout.states();
        let out = PyDict::new(py);
        let set = |name: &str, numbers: Vec<f64>| out.set_item(name, PyArray1::from_vec(py, numbers));
        set("position", all.iter().flat_map(|m| arrays::flat(&m.position)).collect())?;
        set("rotation", all.iter().flat_map(|m| arrays::flat_rotations::<S>(&m.rotation)).collect())?;
        set("velocity", all.iter().flat_map(|m| arrays::flat(&m.velocity)).collect())?;
        set("angular_velocity", all.iter().flat_map(|m| arrays::flat(&m.angular_velocity)).collect())?;
        Ok(out)
    }

    /// The steps on an edge.
    pub fn flags(&self) -> Vec<PlainFlag> {
        let rollout = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let plain = |f: &carom::gradient::Flag| (f.step, f.bodies.clone(), f.reason.name(), f.reason.text());
        rollout.flags().iter().map(plain).collect()
    }

    /// Steps between snapshots.
    pub fn stretch(&self) -> usize {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).stretch()
    }

    /// Pulls cotangents of states back.
    ///
    /// # Errors
    /// `BuildError` for cotangents that do not fit, `StepError` for a step that fails when it is taken again.
    pub fn pullback<'py>(
        &self,
        py: Python<'py>,
        cotangents: PlainCotangents<'py>,
    ) -> PyResult<Bound<'py, PyDict>> {
        let mut given = Vec::with_capacity(cotangents.len());
        {
            let rollout = self.0.lock().unwrap_or_else(PoisonError::into_inner);
            for (state, fields) in &cotangents {
                let slices: Vec<&[f64]> = fields.iter().map(|f| f.as_slice()).collect::<Result<_, _>>()?;
                given.push((*state, cotangent::<S>(&rollout, *state, &slices)));
            }
        }
        let pulled = py.detach(|| self.0.lock().unwrap_or_else(PoisonError::into_inner).pullback(&given));
        let g = pulled.map_err(|e| raised(py, &e))?;
        let out = PyDict::new(py);
        let set = |name: &str, numbers: Vec<f64>| out.set_item(name, PyArray1::from_vec(py, numbers));
        set("position", arrays::flat(&g.initial.position))?;
        set("rotation", arrays::flat(&g.initial.rotation))?;
        set("velocity", arrays::flat(&g.initial.velocity))?;
        set("angular_velocity", arrays::flat(&g.initial.angular_velocity))?;
        set("mass", g.mass)?;
        set("inertia", g.inertia)?;
        set("friction", g.friction)?;
        set("restitution", g.restitution)?;
        set("gravity", g.gravity.as_slice().to_vec())?;
        set("forces", g.loads.iter().flatten().flat_map(|w| w.force.as_slice().to_vec()).collect())?;
        set("torques", g.loads.iter().flatten().flat_map(|w| w.torque.as_slice().to_vec()).collect())?;
        let pairs: Vec<PlainPair> =
            g.pairs.into_iter().map(|p| (p.materials.0, p.materials.1, p.friction, p.restitution)).collect();
        out.set_item("pairs", pairs)?;
        Ok(out)
    }
}

/// A cotangent from flat arrays that the Python side has shaped; those of stored rotations become rotation vectors.
fn cotangent<S: Geometry>(rollout: &Rollout<S>, state: usize, fields: &[&[f64]]) -> StateCotangent<S> {
    let vectors = |k: usize| -> Vec<S::Vector> {
        fields[k].chunks_exact(S::DIM).map(|c| S::Vector::from_fn(|i| c[i])).collect()
    };
    let spins = |k: usize| -> Vec<S::Spin> {
        fields[k].chunks_exact(S::SPIN).map(|c| S::Spin::from_fn(|i| c[i])).collect()
    };
    let mut rotation = spins(2);
    if let Some(motion) = rollout.states().get(state) {
        let count = motion.rotation.len().max(1);
        let numbers = fields[1].chunks_exact((fields[1].len() / count).max(1));
        for ((sum, q), n) in rotation.iter_mut().zip(&motion.rotation).zip(numbers) {
            *sum += StateCotangent::<S>::of_numbers(q, n);
        }
    }
    StateCotangent { position: vectors(0), rotation, velocity: vectors(3), angular_velocity: spins(4) }
}
