//! Python functions as force fields. They are called with copies of time, positions and velocities and return
//! (forces or None, torques or None) as flat float64 arrays; the Python side brings what users return into
//! that form. An exception ends the step and comes out of it as it was raised.

use crate::arrays;
use carom::{Column, ForceField, Geometry, Motion, World, Wrench};
use numpy::PyReadonlyArray1;
use pyo3::gc::{PyTraverseError, PyVisit};
use pyo3::prelude::*;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// One function: the only reference to it that Rust holds, where the garbage collector can see it.
struct Slot {
    name: String,
    function: Mutex<Option<Py<PyAny>>>,
    raised: Mutex<Option<PyErr>>,
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// The force field that the world calls.
struct PythonField(Arc<Slot>);

impl PythonField {
    fn call<S: Geometry>(
        &self,
        py: Python<'_>,
        time: f64,
        motion: &Motion<S>,
        out: &mut [Wrench<S>],
    ) -> PyResult<()> {
        let Some(function) = lock(&self.0.function).as_ref().map(|f| f.clone_ref(py)) else { return Ok(()) };
        let position = arrays::matrix(py, arrays::flat(&motion.position), S::DIM)?;
        let velocity = arrays::matrix(py, arrays::flat(&motion.velocity), S::DIM)?;
        let returned = function.call1(py, (time, position, velocity))?;
        type Loads<'py> = (Option<PyReadonlyArray1<'py, f64>>, Option<PyReadonlyArray1<'py, f64>>);
        let (force, torque): Loads<'_> = returned.extract(py)?;
        if let Some(force) = force {
            for (wrench, f) in out.iter_mut().zip(force.as_array().to_vec().chunks_exact(S::DIM)) {
                wrench.force += S::Vector::from_fn(|k| f[k]);
            }
        }
        if let Some(torque) = torque {
            for (wrench, t) in out.iter_mut().zip(torque.as_array().to_vec().chunks_exact(S::SPIN)) {
                wrench.torque += S::Spin::from_fn(|k| t[k]);
            }
        }
        Ok(())
    }
}

impl<S: Geometry> ForceField<S> for PythonField {
    fn add(&mut self, time: f64, motion: &Motion<S>, out: &mut [Wrench<S>]) -> Result<(), String> {
        Python::attach(|py| self.call(py, time, motion, out)).map_err(|error| {
            *lock(&self.0.raised) = Some(error);
            "raised an exception".to_string()
        })
    }
}

/// All functions of a world.
#[derive(Default)]
pub struct Fields(Mutex<Vec<Arc<Slot>>>);

impl Fields {
    /// Makes a function a force field of the world, in place of one of the same name.
    pub fn set<S: Geometry>(&self, world: &mut World<S>, name: &str, function: Py<PyAny>) {
        let slot = Slot { name: name.into(), function: Mutex::new(Some(function)), raised: Mutex::default() };
        let slot = Arc::new(slot);
        world.set_force_field(name, Box::new(PythonField(slot.clone())));
        let mut slots = lock(&self.0);
        slots.retain(|s| s.name != name);
        slots.push(slot);
    }
    /// Removes a force field; true when there was one of this name.
    pub fn remove<S: Geometry>(&self, world: &mut World<S>, name: &str) -> bool {
        lock(&self.0).retain(|s| s.name != name);
        world.remove_force_field(name)
    }
    /// Gives a world made from a snapshot the functions that it names, in its order.
    ///
    /// # Errors
    /// The first name that no function has.
    pub fn attach_to<S: Geometry>(&self, world: &mut World<S>, names: &[String]) -> Result<(), String> {
        let mut slots = lock(&self.0);
        let found =
            names.iter().map(|n| slots.iter().find(|s| s.name == *n).cloned().ok_or_else(|| n.clone()));
        let found: Vec<Arc<Slot>> = found.collect::<Result<_, _>>()?;
        for slot in &found {
            world.set_force_field(&slot.name, Box::new(PythonField(slot.clone())));
        }
        *slots = found;
        Ok(())
    }
    /// Takes the exception that ended a step, if a function raised one.
    pub fn take_raised(&self) -> Option<PyErr> {
        lock(&self.0).iter().find_map(|slot| lock(&slot.raised).take())
    }
    /// Shows the functions to the garbage collector; skips what is in use, which is then kept.
    ///
    /// # Errors
    /// What the collector returns.
    pub fn traverse(&self, visit: &PyVisit<'_>) -> Result<(), PyTraverseError> {
        let Ok(slots) = self.0.try_lock() else { return Ok(()) };
        for slot in slots.iter() {
            if let Ok(function) = slot.function.try_lock() {
                visit.call(&*function)?;
            }
        }
        Ok(())
    }
    /// Drops the functions, to break a cycle of references.
    pub fn clear(&self) {
        let functions: Vec<_> = lock(&self.0).iter().map(|slot| lock(&slot.function).take()).collect();
        drop(functions); // after the locks: dropping may run Python code
    }
}
