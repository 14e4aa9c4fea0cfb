//! Between lists of columns and numpy arrays, by copy.

use carom::{Column, Inertia, Rotation, Space};
use numpy::{PyArray1, PyArray2, PyArrayMethods};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

/// The numbers of a list of columns, one after another.
pub fn flat<V: Column>(list: &[V]) -> Vec<f64> {
    let mut numbers = Vec::with_capacity(list.len() * V::LEN);
    list.iter().for_each(|v| numbers.extend_from_slice(v.as_slice()));
    numbers
}

/// The numbers of a list of rotations, one after another.
pub fn flat_rotations<S: Space>(list: &[S::Rotation]) -> Vec<f64> {
    let mut numbers = Vec::with_capacity(list.len() * <S::Rotation as Rotation<S::Vector, S::Spin>>::LEN);
    list.iter().for_each(|q| numbers.extend_from_slice(q.as_slice()));
    numbers
}

/// A (rows, width) array of these numbers.
///
/// # Errors
/// When numpy has no memory.
pub fn matrix(py: Python<'_>, numbers: Vec<f64>, width: usize) -> PyResult<Bound<'_, PyArray2<f64>>> {
    let rows = numbers.len() / width;
    PyArray1::from_vec(py, numbers).reshape([rows, width])
}

/// A column from as many numbers.
///
/// # Errors
/// `ValueError` for another count; the Python side has checked it before.
pub fn column<V: Column>(values: &[f64]) -> PyResult<V> {
    let wrong = || PyValueError::new_err(format!("expected {} numbers, got {}", V::LEN, values.len()));
    V::from_slice(values).ok_or_else(wrong)
}

/// A rotation from an angle (in the plane) or from its stored numbers.
///
/// # Errors
/// `ValueError` for a count that means no rotation, and for a length of zero.
pub fn rotation<S: Space>(values: &[f64]) -> PyResult<S::Rotation> {
    if S::DIM == 2 && values.len() == 1 {
        return Ok(S::Rotation::about(S::Spin::from_fn(|k| values[k])));
    }
    let wrong = || PyValueError::new_err(format!("no rotation of the {} world: {values:?}", S::NAME));
    S::Rotation::from_slice(values).ok_or_else(wrong)
}

/// An inertia from `[I]` | `[xx, yy, zz, xy, xz, yz]`.
///
/// # Errors
/// `ValueError` for another count; the Python side has checked it before.
pub fn inertia<S: Space>(values: &[f64]) -> PyResult<S::Inertia> {
    let wrong = || PyValueError::new_err(format!("no inertia of the {} world: {values:?}", S::NAME));
    S::Inertia::from_entries(values).ok_or_else(wrong)
}
