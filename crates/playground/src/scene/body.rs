//! Bodies and materials of a scene: coefficients are the body's own, else its material's, else the engine's.

use super::copies::copies;
use super::fields::Fields;
use super::mesh;
use super::rotation::Turned;
use super::scatter::Scatter;
use super::shape;
use carom::{BodyKind, BodySpec, Column, Geometry, Inertia, MassProperties, MassSource, Rotation, World};
use serde_json::{Map, Value};
use std::collections::BTreeMap;

/// Constants of contact, in the order of [`Coefficients`].
const COEFFICIENTS: [&str; 5] =
    ["friction", "restitution", "tangential_restitution", "rolling_friction", "spinning_friction"];

type Coefficients = [Option<f64>; 5];

/// The materials of a scene by name: coefficients and density \[kg/m^DIM\].
pub struct Materials(BTreeMap<String, (Coefficients, Option<f64>)>);

impl Materials {
    /// Reads the table of materials.
    ///
    /// # Errors
    /// Naming the material and its field.
    pub fn read(table: Map<String, Value>) -> Result<Self, String> {
        let mut found = BTreeMap::new();
        for (name, value) in table {
            let mut fields = Fields::new(format!("material '{name}'"), value)?;
            let entry = (coefficients(&mut fields)?, fields.take("density")?);
            fields.finish()?;
            found.insert(name, entry);
        }
        Ok(Materials(found))
    }
    /// Whether there is one of this name.
    pub fn has(&self, name: &str) -> bool {
        self.0.contains_key(name)
    }
}

fn coefficients(fields: &mut Fields) -> Result<Coefficients, String> {
    let mut found = [None; 5];
    for (slot, key) in found.iter_mut().zip(COEFFICIENTS) {
        *slot = fields.take(key)?;
    }
    Ok(found)
}

/// Adds a body of a scene, all its copies.
///
/// # Errors
/// One sentence that names the body and the field.
pub fn add<S: Geometry>(
    world: &mut World<S>,
    number: usize,
    value: Value,
    materials: &Materials,
    files: &mesh::Files,
) -> Result<(), String> {
    let mut fields = Fields::new(format!("body {}", number + 1), value)?;
    let name: String = fields.need("name")?;
    let of = format!("body '{name}'");
    fields.called(of.clone());
    let scatter = fields.value("scatter");
    let mut scatter = scatter.map(|value| Scatter::read(&name, value, S::DIM, &of)).transpose()?;
    let repeat = fields.value("repeat");
    let rotation = fields.value("rotation");
    let rotation = rotation.map(|value| Turned::read(value, S::DIM, &of)).transpose()?;
    let spec = spec::<S>(&mut fields, materials, files, &of)?;
    fields.finish()?;
    for copy in copies(&name, repeat, S::DIM, &of)? {
        let mut displacement = S::Vector::from_slice(&copy.displacement).unwrap_or(S::Vector::ZERO);
        let mut turned = rotation;
        if let Some(scatter) = &mut scatter {
            let (by, to) = scatter.draw(rotation);
            displacement += S::Vector::from_slice(&by).unwrap_or(S::Vector::ZERO);
            turned = to;
        }
        let mut placed = BodySpec { position: displacement + spec.position, ..spec.clone() };
        if let Some(turned) = turned {
            let stored = stored::<S>(&turned);
            placed.rotation = stored.ok_or_else(|| format!("{of}: rotation: has no length"))?;
        }
        world.add(&copy.name, placed).map_err(|e| e.to_string())?;
    }
    Ok(())
}

fn spec<S: Geometry>(
    fields: &mut Fields,
    materials: &Materials,
    files: &mesh::Files,
    of: &str,
) -> Result<BodySpec<S>, String> {
    let kind = match fields.take::<String>("kind")?.as_deref() {
        None | Some("dynamic") => BodyKind::Dynamic,
        Some("static") => BodyKind::Fixed,
        Some("kinematic") => BodyKind::Kinematic,
        Some(other) => {
            return Err(fields.wrong("kind", format!("must be dynamic, static or kinematic, got '{other}'")));
        }
    };
    let Form { shape, inside } = form::<S>(fields, kind == BodyKind::Dynamic, files, of)?;
    if shape.is_none() && kind != BodyKind::Dynamic {
        return Err(fields.wrong("shape", "is missing; only a dynamic body may be a particle"));
    }
    let material: Option<String> = fields.take("material")?;
    let (theirs, density) = match &material {
        None => ([None; 5], None),
        Some(name) => *(materials.0.get(name)).ok_or_else(|| {
            fields.wrong("material", format!("unknown material '{name}'; add it to [materials]"))
        })?,
    };
    let own = coefficients(fields)?;
    let coefficient = |k: usize, default: f64| own[k].or(theirs[k]).unwrap_or(default);
    let mut spec = BodySpec {
        kind,
        material,
        friction: coefficient(0, 0.5),
        restitution: coefficient(1, 0.0),
        tangential_restitution: coefficient(2, 0.0),
        rolling_friction: coefficient(3, 0.0),
        spinning_friction: coefficient(4, 0.0),
        groups: fields.take("collision_groups")?.unwrap_or(1),
        collides_with: fields.take("collision_mask")?.unwrap_or(u32::MAX),
        ..BodySpec::particle(None, 1.0)
    };
    place(fields, &mut spec, shape.is_none())?;
    mass(fields, &mut spec, (shape.as_ref(), inside.as_ref()), density)?;
    spec.shape = shape;
    Ok(spec)
}

/// A body's shape, its own or that of a mesh, and the solid inside a mesh where its mass is that solid's.
struct Form<S: Geometry> {
    shape: Option<S::Shape>,
    inside: Option<S::Shape>,
}

/// Reads what a body is made of.
fn form<S: Geometry>(
    fields: &mut Fields,
    is_dynamic: bool,
    files: &mesh::Files,
    of: &str,
) -> Result<Form<S>, String> {
    let own = fields.value("shape").map(|value| shape::read::<S>(value, of)).transpose()?;
    let Some(value) = fields.value("mesh") else { return Ok(Form { shape: own, inside: None }) };
    if own.is_some() {
        return Err(fields.wrong("mesh", "shape and mesh are both given; keep one of them"));
    }
    if S::DIM == 2 {
        return Err(fields.wrong("mesh", "belongs to space; write a polygon in the plane"));
    }
    if is_dynamic && value["as"] == "static" {
        return Err(fields.wrong("mesh", "as = \"static\" cannot belong to a dynamic body"));
    }
    let solid = mesh::read(value, files, of)?;
    let inside = solid.inside.map(|value| shape::read::<S>(value, of)).transpose()?;
    Ok(Form { shape: Some(shape::read::<S>(solid.shape, of)?), inside })
}

/// A rotation as the engine has it; `None` when it has no length.
fn stored<S: Geometry>(turned: &Turned) -> Option<S::Rotation> {
    match turned {
        Turned::Angle(angle) => Some(S::Rotation::about(S::Spin::from_fn(|_| *angle))),
        Turned::Quaternion(_) => S::Rotation::from_slice(turned.numbers()),
    }
}

/// Position and velocities.
fn place<S: Geometry>(fields: &mut Fields, spec: &mut BodySpec<S>, is_particle: bool) -> Result<(), String> {
    let (position, origin) = (fields.take::<S::Vector>("position")?, fields.take::<S::Vector>("origin")?);
    if position.is_some() && origin.is_some() {
        return Err(fields.wrong("origin", "position and origin are both given; keep one of them"));
    }
    spec.position_is_origin = position.is_none() && !is_particle;
    spec.position = position.or(origin).unwrap_or(S::Vector::ZERO);
    if let Some(velocity) = fields.take("velocity")? {
        spec.velocity = velocity;
    }
    let spin = fields.value("angular_velocity");
    if let Some(value) = spin {
        // in the plane a plain number
        let listed = if value.is_number() { Value::Array(vec![value]) } else { value };
        spec.angular_velocity =
            serde_json::from_value(listed).map_err(|e| fields.wrong("angular_velocity", e))?;
    }
    Ok(())
}

/// Where the mass comes from, damping, and whether forces turn the body; the solid inside a mesh comes before its shape.
fn mass<S: Geometry>(
    fields: &mut Fields,
    spec: &mut BodySpec<S>,
    (shape, inside): (Option<&S::Shape>, Option<&S::Shape>),
    of_material: Option<f64>,
) -> Result<(), String> {
    let (mass, own) = (fields.take::<f64>("mass")?, fields.take::<f64>("density")?);
    let inertia = fields.value("inertia");
    let center: Option<S::Vector> = fields.take("center_of_mass")?;
    let damping = (fields.take::<f64>("linear_damping")?, fields.take::<f64>("angular_damping")?);
    spec.linear_damping = damping.0.unwrap_or(0.0);
    spec.angular_damping = damping.1.unwrap_or(0.0);
    spec.can_rotate = shape.is_some() || inertia.is_some();
    if spec.kind != BodyKind::Dynamic {
        if mass.is_some() || own.is_some() || inertia.is_some() || center.is_some() {
            return Err(fields.wrong("mass", "has no meaning for a body that forces do not move"));
        }
        return Ok(());
    }
    if mass.is_some() && own.is_some() {
        return Err(fields.wrong("density", "mass and density are both given; keep one of them"));
    }
    let of_solid = |solid: &S::Shape, mass: Option<f64>, density: f64| {
        let unit = S::mass_properties(solid, 1.0).map_err(|e| fields.wrong("mesh", e))?;
        let weight = mass.map_or(density, |mass| mass / unit.mass);
        S::mass_properties(solid, weight).map(MassSource::Given).map_err(|e| fields.wrong("mesh", e))
    };
    let alone = inertia.is_none() && center.is_none();
    spec.mass = match (mass, own.or(of_material)) {
        (Some(mass), _) if let Some(solid) = inside.filter(|_| alone) => of_solid(solid, Some(mass), 0.0)?,
        (None, Some(density)) if let Some(solid) = inside.filter(|_| alone) => {
            of_solid(solid, None, density)?
        }
        (Some(mass), _) => match inertia {
            None if center.is_some() => return Err(fields.wrong("center_of_mass", "needs inertia beside it")),
            None => MassSource::Mass(mass),
            Some(value) => {
                let inertia = S::Inertia::from_entries(&entries(&value))
                    .ok_or_else(|| fields.wrong("inertia", "must be a number, or 3 x 3 in space"))?;
                let own = || shape.and_then(|s| S::mass_properties(s, 1.0).ok()).map(|p| p.center);
                let center = center.or_else(own).unwrap_or(S::Vector::ZERO);
                MassSource::Given(MassProperties { mass, center, inertia, error: 0.0 })
            }
        },
        (None, Some(density)) if shape.is_some() => MassSource::Density(density),
        _ => return Err(fields.wrong("mass", "is missing; give density, mass or a material with density")),
    };
    Ok(())
}

/// Independent entries of an inertia: `[I]`, or `[xx, yy, zz, xy, xz, yz]` of a symmetric matrix.
fn entries(value: &Value) -> Vec<f64> {
    if let Some(number) = value.as_f64() {
        return vec![number];
    }
    let Ok(m) = serde_json::from_value::<[[f64; 3]; 3]>(value.clone()) else { return Vec::new() };
    let middle = |i: usize, j: usize| m[i][j] / 2.0 + m[j][i] / 2.0;
    [(0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)].map(|(i, j)| middle(i, j)).to_vec()
}
