//! Geometry and the single collision as functions of plain numbers (theory chapter 3, items 16-19): no world.

use crate::arguments::{self, PlainMass};
use crate::arrays;
use crate::errors;
use carom::solver::{InverseMass, collision};
use carom::{Column, Geometry, Pose, Rotation, Twist};
use numpy::{PyArray1, PyReadonlyArray1};
use pyo3::prelude::*;

/// Position and rotation of a shape.
pub type PlainPose = (Vec<f64>, Vec<f64>);

fn pose<S: Geometry>(plain: &PlainPose) -> PyResult<Pose<S>> {
    Ok(Pose::new(arrays::column(&plain.0)?, arrays::rotation::<S>(&plain.1)?))
}

fn collider<S: Geometry>(py: Python<'_>, text: &str) -> PyResult<S::Collider> {
    S::collider(&arguments::shape::<S>(py, text)?).map_err(|e| errors::shape(py, e))
}

/// Mass properties of a shape at a constant density \[kg/m^DIM\].
///
/// # Errors
/// `BuildError` naming the shape's field.
pub fn mass_properties<S: Geometry>(py: Python<'_>, shape: &str, density: f64) -> PyResult<PlainMass> {
    let shape = arguments::shape::<S>(py, shape)?;
    S::mass_properties(&shape, density).map(|p| arguments::plain_mass(&p)).map_err(|e| errors::shape(py, e))
}

/// Mass properties of a density function, which takes an (n, d) array and returns (n,) float64 \[kg/m^DIM\].
///
/// # Errors
/// What the function raised; `BuildError` for the shape, the densities or the tolerance.
pub fn mass_properties_of<S: Geometry>(
    py: Python<'_>,
    shape: &str,
    density: &Bound<'_, PyAny>,
    tolerance: f64,
) -> PyResult<PlainMass> {
    let shape = arguments::shape::<S>(py, shape)?;
    let mut raised = None;
    let mut function = |points: &[S::Vector]| -> Vec<f64> {
        let call = || -> PyResult<Vec<f64>> {
            let answer = density.call1((arrays::matrix(py, arrays::flat(points), S::DIM)?,))?;
            Ok(answer.extract::<PyReadonlyArray1<'_, f64>>()?.as_array().to_vec())
        };
        // a density that is no number ends the quadrature at once
        call().unwrap_or_else(|error| {
            raised = Some(error);
            vec![f64::NAN; points.len()]
        })
    };
    let found = S::mass_properties_of(&shape, &mut function, tolerance);
    match (raised, found) {
        (Some(error), _) => Err(error),
        (None, Ok(p)) => Ok(arguments::plain_mass(&p)),
        (None, Err(e)) => Err(errors::shape(py, e)),
    }
}

/// Contact points of two posed shapes: features, points, normals from b to a, gaps.
pub type PlainContacts<'py> =
    (Vec<u64>, Bound<'py, PyArray1<f64>>, Bound<'py, PyArray1<f64>>, Bound<'py, PyArray1<f64>>);

/// Contact points whose gap is at most `margin` \[m\].
///
/// # Errors
/// `BuildError` naming a shape's field.
pub fn contacts<'py, S: Geometry>(
    py: Python<'py>,
    a: (&str, &PlainPose),
    b: (&str, &PlainPose),
    margin: f64,
) -> PyResult<PlainContacts<'py>> {
    let (shape_a, shape_b) = (collider::<S>(py, a.0)?, collider::<S>(py, b.0)?);
    let mut found = Vec::new();
    S::contacts(&shape_a, &pose(a.1)?, &shape_b, &pose(b.1)?, margin, &mut found);
    let points: Vec<_> = found.iter().map(|c| c.point).collect();
    let normals: Vec<_> = found.iter().map(|c| c.normal).collect();
    Ok((
        found.iter().map(|c| c.feature).collect(),
        PyArray1::from_vec(py, arrays::flat(&points)),
        PyArray1::from_vec(py, arrays::flat(&normals)),
        PyArray1::from_iter(py, found.iter().map(|c| c.gap)),
    ))
}

/// Point on a, point on b, normal, gap.
pub type PlainNearest = (Vec<f64>, Vec<f64>, Vec<f64>, f64);

/// Closest points on a and b, normal from b to a, gap \[m\]; `None` beyond `reach` \[m\].
///
/// # Errors
/// `BuildError` naming a shape's field.
pub fn closest<S: Geometry>(
    py: Python<'_>,
    a: (&str, &PlainPose),
    b: (&str, &PlainPose),
    reach: f64,
) -> PyResult<Option<PlainNearest>> {
    let (shape_a, shape_b) = (collider::<S>(py, a.0)?, collider::<S>(py, b.0)?);
    let list = |v: S::Vector| v.as_slice().to_vec();
    let found = S::closest(&shape_a, &pose(a.1)?, &shape_b, &pose(b.1)?, reach);
    Ok(found.map(|c| (list(c.point_a), list(c.point_b), list(c.normal), c.gap)))
}

/// Distances and normals of hits.
pub type PlainHits<'py> = (Bound<'py, PyArray1<f64>>, Bound<'py, PyArray1<f64>>);

/// First hits of rays with a posed shape: distances \[m\] (infinite without a hit) and normals (zero then). Origins and
/// directions are flat; directions have length 1.
///
/// # Errors
/// `BuildError` naming the shape's field.
pub fn raycast<'py, S: Geometry>(
    py: Python<'py>,
    shape: (&str, &PlainPose),
    origins: &PyReadonlyArray1<'py, f64>,
    directions: &PyReadonlyArray1<'py, f64>,
    reach: f64,
) -> PyResult<PlainHits<'py>> {
    let (ready, at) = (collider::<S>(py, shape.0)?, pose::<S>(shape.1)?);
    let (origins, directions) = (origins.as_array().to_vec(), directions.as_array().to_vec());
    let (distances, normals) = py.detach(|| {
        let (mut distances, mut normals) = (Vec::new(), Vec::new());
        for (o, d) in origins.chunks_exact(S::DIM).zip(directions.chunks_exact(S::DIM)) {
            let vector = |v: &[f64]| S::Vector::from_fn(|k| v[k]);
            let hit = S::raycast(&ready, &at, vector(o), vector(d), reach);
            distances.push(hit.map_or(f64::INFINITY, |h| h.distance));
            normals.push(hit.map_or(S::Vector::ZERO, |h| h.normal));
        }
        (distances, arrays::flat(&normals))
    });
    Ok((PyArray1::from_vec(py, distances), PyArray1::from_vec(py, normals)))
}

/// One body of a collision: arm, velocity, angular velocity, inverse mass, inverse inertia's independent entries.
pub type PlainSide = (Vec<f64>, Vec<f64>, Vec<f64>, f64, Vec<f64>);

struct Side<S: Geometry> {
    arm: S::Vector,
    twist: Twist<S>,
    mass: InverseMass<S>,
}

fn side<S: Geometry>((arm, velocity, spin, inverse_mass, inverse_inertia): &PlainSide) -> PyResult<Side<S>> {
    Ok(Side {
        arm: arrays::column(arm)?,
        twist: Twist::new(arrays::column(velocity)?, arrays::column(spin)?),
        mass: InverseMass { linear: *inverse_mass, angular: arrays::inertia::<S>(inverse_inertia)? },
    })
}

/// Offset of a contact point from a centre of mass \[m\].
///
/// # Errors
/// `ValueError` for a wrong count.
pub fn offset<S: Geometry>(point: &[f64], center: &[f64]) -> PyResult<Vec<f64>> {
    let r = collision::offset::<S>(arrays::column(point)?, arrays::column(center)?);
    Ok(r.as_slice().to_vec())
}

/// Velocity of a's point relative to b's along the normal \[m/s\].
///
/// # Errors
/// `ValueError` for a wrong count.
pub fn normal_velocity<S: Geometry>(normal: &[f64], a: &PlainSide, b: &PlainSide) -> PyResult<f64> {
    let (a, b) = (side::<S>(a)?, side::<S>(b)?);
    Ok(collision::normal_velocity(arrays::column(normal)?, (&a.twist, a.arm), (&b.twist, b.arm)))
}

/// Effective mass along a unit direction \[kg\].
///
/// # Errors
/// `ValueError` for a wrong count.
pub fn effective_mass<S: Geometry>(direction: &[f64], a: &PlainSide, b: &PlainSide) -> PyResult<f64> {
    let (a, b) = (side::<S>(a)?, side::<S>(b)?);
    Ok(collision::effective_mass(arrays::column(direction)?, (&a.mass, a.arm), (&b.mass, b.arm)))
}

/// Velocity and angular velocity after an impulse at the side's arm.
///
/// # Errors
/// `ValueError` for a wrong count.
pub fn respond<S: Geometry>(plain: &PlainSide, impulse: &[f64]) -> PyResult<(Vec<f64>, Vec<f64>)> {
    let s = side::<S>(plain)?;
    let impulse = arrays::column(impulse)?;
    let v = collision::linear_response(s.twist.linear, &s.mass, impulse);
    let w = collision::angular_response::<S>(s.twist.angular, &s.mass, s.arm, impulse);
    Ok((v.as_slice().to_vec(), w.as_slice().to_vec()))
}

/// Velocities of both sides after a collision, and the impulse \[N s\].
pub type Collided = ((Vec<f64>, Vec<f64>), (Vec<f64>, Vec<f64>), f64);

/// A whole collision.
///
/// # Errors
/// `ValueError` for a wrong count.
pub fn collide<S: Geometry>(
    a: &PlainSide,
    b: &PlainSide,
    normal: &[f64],
    restitution: f64,
) -> PyResult<Collided> {
    let (a, b) = (side::<S>(a)?, side::<S>(b)?);
    let sides = ((&a.twist, &a.mass, a.arm), (&b.twist, &b.mass, b.arm));
    let (after_a, after_b, gamma) =
        collision::collide(sides.0, sides.1, arrays::column(normal)?, restitution);
    let plain = |t: Twist<S>| (t.linear.as_slice().to_vec(), t.angular.as_slice().to_vec());
    Ok((plain(after_a), plain(after_b), gamma))
}

/// Numbers of a rotation as stored, from an angle (in the plane) or a rotation of any length.
///
/// # Errors
/// `ValueError` for numbers that are no rotation.
pub fn rotation<S: Geometry>(values: &[f64]) -> PyResult<Vec<f64>> {
    Ok(arrays::rotation::<S>(values)?.as_slice().to_vec())
}
