//! What Python says of a body, as the specification that the engine checks.

use crate::{arrays, errors};
use carom::{
    BodyKind, BodySpec, Column, Geometry, ImpulseChoice, Inertia, MassProperties, MassSource, Rotation,
};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

/// The dictionary that the Python side fills: plain numbers and lists of the right length. Units as in `BodySpec`.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub struct BodyArguments {
    kind: String,
    shape: Option<String>,
    density: Option<f64>,
    mass: Option<f64>,
    inertia: Option<Vec<f64>>,
    center_of_mass: Option<Vec<f64>>,
    quadrature_error: f64,
    can_rotate: bool,
    position: Vec<f64>,
    position_is_origin: bool,
    rotation: Vec<f64>,
    velocity: Vec<f64>,
    angular_velocity: Vec<f64>,
    friction: f64,
    rolling_friction: f64,
    spinning_friction: f64,
    restitution: f64,
    tangential_restitution: f64,
    material: Option<String>,
    linear_damping: f64,
    angular_damping: f64,
    groups: u32,
    collides_with: u32,
}

/// A shape from its JSON text.
///
/// # Errors
/// `BuildError` when it is none of this space.
pub fn shape<S: Geometry>(py: Python<'_>, text: &str) -> PyResult<S::Shape> {
    let refused =
        |e: serde_json::Error| errors::argument(py, "shape", &e.to_string(), "see the shape's own fields");
    serde_json::from_str(text).map_err(refused)
}

impl BodyArguments {
    /// The specification.
    ///
    /// # Errors
    /// `BuildError` for a shape of the other space, `ValueError` for counts that the Python side lets through.
    pub fn spec<S: Geometry>(&self, py: Python<'_>) -> PyResult<BodySpec<S>> {
        let shape = self.shape.as_deref().map(|text| shape::<S>(py, text)).transpose()?;
        let kind = match self.kind.as_str() {
            "dynamic" => BodyKind::Dynamic,
            "static" => BodyKind::Fixed,
            "kinematic" => BodyKind::Kinematic,
            other => return Err(PyValueError::new_err(format!("unknown kind {other:?}"))),
        };
        let mass = self.mass_source::<S>(shape.as_ref())?;
        Ok(BodySpec {
            kind,
            shape,
            mass,
            can_rotate: self.can_rotate,
            position: arrays::column(&self.position)?,
            position_is_origin: self.position_is_origin,
            rotation: arrays::rotation::<S>(&self.rotation)?,
            velocity: arrays::column(&self.velocity)?,
            angular_velocity: arrays::column(&self.angular_velocity)?,
            friction: self.friction,
            rolling_friction: self.rolling_friction,
            spinning_friction: self.spinning_friction,
            restitution: self.restitution,
            tangential_restitution: self.tangential_restitution,
            material: self.material.clone(),
            linear_damping: self.linear_damping,
            angular_damping: self.angular_damping,
            groups: self.groups,
            collides_with: self.collides_with,
        })
    }

    fn mass_source<S: Geometry>(&self, shape: Option<&S::Shape>) -> PyResult<MassSource<S>> {
        if let Some(density) = self.density {
            return Ok(MassSource::Density(density));
        }
        let mass = self.mass.unwrap_or(1.0); // not read for obstacles
        let Some(entries) = &self.inertia else { return Ok(MassSource::Mass(mass)) };
        let center = match &self.center_of_mass {
            Some(values) => arrays::column(values)?,
            // given inertia without a centre is about the shape's own centroid, where it has one
            None => shape.and_then(|s| S::mass_properties(s, 1.0).ok()).map_or(S::Vector::ZERO, |p| p.center),
        };
        let inertia = arrays::inertia::<S>(entries)?;
        Ok(MassSource::Given(MassProperties { mass, center, inertia, error: self.quadrature_error }))
    }
}

/// Mass properties as Python reads them: mass, centre, inertia's independent entries, error.
pub type PlainMass = (f64, Vec<f64>, Vec<f64>, f64);

/// Mass properties in plain numbers.
pub fn plain_mass<S: Geometry>(p: &MassProperties<S>) -> PlainMass {
    (p.mass, p.center.as_slice().to_vec(), p.inertia.entries(), p.error)
}

/// Kind of a body as Python users write it.
pub fn kind_name(kind: BodyKind) -> &'static str {
    match kind {
        BodyKind::Dynamic => "dynamic",
        BodyKind::Fixed => "static",
        BodyKind::Kinematic => "kinematic",
    }
}

/// Numbers of a rotation as stored.
pub fn plain_rotation<S: Geometry>(rotation: &S::Rotation) -> Vec<f64> {
    rotation.as_slice().to_vec()
}

/// Which impulses to return, by name.
///
/// # Errors
/// `BuildError` for an unknown name.
pub fn impulse_choice(py: Python<'_>, name: &str) -> PyResult<ImpulseChoice> {
    name.parse().map_err(|_| {
        let problem = format!("must be 'any' or 'minimum_norm', got {name:?}");
        errors::argument(py, "impulses", &problem, "choose 'any' or 'minimum_norm'")
    })
}
