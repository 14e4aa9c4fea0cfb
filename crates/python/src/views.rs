//! Numpy arrays that look at a world's motion without a copy, and the guard that keeps them from dangling.
//! This file holds the crate's only unsafe code.

use crate::errors;
use crate::shared::Core;
use carom::{Column, Geometry, Rotation};
use numpy::PyArray2;
use numpy::ndarray::ArrayView2;
use pyo3::prelude::*;
use std::sync::Arc;

/// Names of the arrays, in the order of their numbers.
pub const ARRAYS: [&str; 4] = ["position", "rotation", "velocity", "angular_velocity"];

/// Counts the arrays that look at each part of the motion: one token each, cloned by every array's keeper.
#[derive(Default)]
pub struct LiveViews([Arc<()>; 4]);

impl LiveViews {
    /// True while an array is alive.
    pub fn any(&self) -> bool {
        self.0.iter().any(|token| Arc::strong_count(token) > 1)
    }
    /// Refuses a change of the bodies while an array is alive.
    ///
    /// # Errors
    /// `ViewError` naming the arrays.
    pub fn refuse_if_alive(&self, py: Python<'_>, what: &str) -> PyResult<()> {
        let alive = self.0.iter().zip(ARRAYS).filter(|(token, _)| Arc::strong_count(token) > 1);
        let names: Vec<&str> = alive.map(|(_, name)| name).collect();
        if names.is_empty() { Ok(()) } else { Err(errors::views_alive(py, what, &names)) }
    }
}

/// The base object of a view: keeps the world's memory alive and is counted.
#[pyclass(frozen, module = "carom._carom")]
pub struct ViewKeeper {
    _world: Py<PyAny>,
    _token: Arc<()>,
}

/// Start of the numbers of a list of columns, its length, and the numbers in each column.
fn numbers<T>(list: &mut [T], width: usize) -> (*mut f64, usize, usize) {
    assert_eq!(size_of::<T>(), width * size_of::<f64>(), "columns are plain arrays of f64");
    (list.as_mut_ptr().cast(), list.len(), width)
}

/// An (n, width) float64 array over part `which` of the motion; `owner` is the Python world that holds `core`.
///
/// # Errors
/// `BusyError` while a step is running.
#[allow(unsafe_code)]
pub fn view<'py, S: Geometry>(
    core: &Core<S>,
    owner: &Bound<'py, PyAny>,
    which: usize,
) -> PyResult<Bound<'py, PyArray2<f64>>> {
    let py = owner.py();
    let keeper = ViewKeeper { _world: owner.clone().unbind(), _token: core.views.0[which].clone() };
    let keeper = Bound::new(py, keeper)?.into_any();
    let mut loan = core.loan(py)?;
    let motion = loan.world.motion_mut();
    let (start, rows, width) = match which {
        0 => numbers(&mut motion.position, S::DIM),
        1 => numbers(&mut motion.rotation, <S::Rotation as Rotation<S::Vector, S::Spin>>::LEN),
        2 => numbers(&mut motion.velocity, S::DIM),
        _ => numbers(&mut motion.angular_velocity, <S::Spin as Column>::LEN),
    };
    // SAFETY. Layout: vectors, spins and rotations are repr(transparent) over [f64; width] (checked above), so
    // the list is rows * width numbers in a row. Lifetime: the array's base object is the keeper, which holds
    // the Python world, which holds the list. Moves: only adding, removing and replacing bodies can reallocate
    // the list, and `Core` refuses these while the keeper's token is alive. Races: a running step works on other
    // memory (`Core::advance`) and writes here only after it has the interpreter's lock again.
    Ok(unsafe {
        let numbers = ArrayView2::from_shape_ptr((rows, width), start.cast_const());
        PyArray2::borrow_from_array(&numbers, keeper)
    })
}
