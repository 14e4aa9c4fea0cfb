//! The plane as a slice of space: columns of any space as columns of three, and which of them are its own.

use carom_geometry::Geometry;
use carom_math::{Column, Inertia, Quaternion, Rotation, Space, vec3};

/// Axes of the plane's or of space's vectors among three.
pub fn ways<S: Space>() -> &'static [usize] {
    if S::DIM == 2 { &[0, 1] } else { &[0, 1, 2] }
}

/// Axes of its spins among three.
pub fn turns<S: Space>() -> &'static [usize] {
    if S::DIM == 2 { &[2] } else { &[0, 1, 2] }
}

/// A vector.
pub fn vector<S: Space>(v: S::Vector) -> [f64; 3] {
    let mut out = [0.0; 3];
    ways::<S>().iter().zip(v.as_slice()).for_each(|(&k, x)| out[k] = *x);
    out
}

/// A spin.
pub fn spin<S: Space>(w: S::Spin) -> [f64; 3] {
    let mut out = [0.0; 3];
    turns::<S>().iter().zip(w.as_slice()).for_each(|(&k, x)| out[k] = *x);
    out
}

/// The vector of three numbers.
pub fn to_vector<S: Space>(v: &[f64]) -> S::Vector {
    S::Vector::from_fn(|k| v[ways::<S>()[k]])
}

/// The spin of three numbers.
pub fn to_spin<S: Space>(w: &[f64]) -> S::Spin {
    S::Spin::from_fn(|k| w[turns::<S>()[k]])
}

/// A rotation as a unit quaternion.
pub fn rotation<S: Space>(q: &S::Rotation) -> [f64; 4] {
    match *q.as_slice() {
        [w, x, y, z] => [w, x, y, z],
        _ => {
            let angle = q.vector().as_slice()[0];
            Quaternion::from_axis_angle(vec3(0.0, 0.0, 1.0), angle).0
        }
    }
}

/// An inertia in body axes, row by row.
pub fn inertia<S: Geometry>(inertia: &S::Inertia) -> [[f64; 3]; 3] {
    let mut rows = [[0.0; 3]; 3];
    for (k, &axis) in turns::<S>().iter().enumerate() {
        let unit = S::Spin::from_fn(|i| if i == k { 1.0 } else { 0.0 });
        let column = spin::<S>(inertia.apply(unit));
        for (row, x) in rows.iter_mut().zip(column) {
            row[axis] = x;
        }
    }
    rows
}
