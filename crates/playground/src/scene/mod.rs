//! Scene files (`schema/scene.schema.json`) read in Rust, from TOML or JSON, into a world of the plane or of space: what
//! `python/carom/scene` does, for the page. Read are settings, materials, pairs, bodies with all shapes, copies by
//! `repeat` with their `scatter`, and joints; of mesh files the triangles, which the page hands over beside the text.

mod body;
mod copies;
mod fields;
mod joint;
pub mod mesh;
mod rotation;
mod scatter;
mod shape;

use carom::{Geometry, MaterialPair, Planar, Settings, Spatial, World, World2, World3};
use fields::Fields;
use serde_json::{Map, Value};

/// Longest text that is read \[bytes\].
pub const MOST_BYTES: usize = 4 << 20;

/// A world of either space.
pub enum AnyWorld {
    /// Of the plane.
    Planar(Box<World2>),
    /// Of space.
    Spatial(Box<World3>),
}

/// What a scene says of itself.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct About {
    /// Name; empty when it has none.
    pub name: String,
    /// What it shows.
    pub description: String,
    /// Simulated time of a run when none is asked for \[s\].
    pub duration: f64,
}

/// Reads a scene's text, TOML or JSON, and the triangles of the mesh files that it names; `settings` are replaced in
/// its world table.
///
/// # Errors
/// One sentence that names the body, joint or setting, its field, and what is wrong.
pub fn read(
    text: &str,
    settings: &Map<String, Value>,
    files: &mesh::Files,
) -> Result<(AnyWorld, About), String> {
    if text.len() > MOST_BYTES {
        return Err(format!("scene of {} bytes is larger than {MOST_BYTES}", text.len()));
    }
    let mut scene = Fields::new("scene", parsed(text)?)?;
    let version: u32 = scene.need("schema_version")?;
    if version != 1 {
        return Err(scene.wrong("schema_version", format!("must be 1, got {version}")));
    }
    let space: String = scene.need("space")?;
    let about = About {
        name: scene.take("name")?.unwrap_or_default(),
        description: scene.take("description")?.unwrap_or_default(),
        duration: scene.take("duration")?.unwrap_or(5.0),
    };
    let world = match space.as_str() {
        "planar" => AnyWorld::Planar(Box::new(build::<Planar>(scene, settings, files)?)),
        "spatial" => AnyWorld::Spatial(Box::new(build::<Spatial>(scene, settings, files)?)),
        other => return Err(scene.wrong("space", format!("must be planar or spatial, got '{other}'"))),
    };
    Ok((world, about))
}

/// The text as a value, by its first sign: JSON begins with a brace.
fn parsed(text: &str) -> Result<Value, String> {
    let text = text.trim_start_matches('\u{feff}');
    if text.trim_start().starts_with('{') {
        return serde_json::from_str(text).map_err(|e| format!("not JSON: {e}"));
    }
    toml::from_str(text).map_err(|e: toml::de::Error| {
        let line = e.span().map_or(String::new(), |at| {
            format!(" in line {}", 1 + text[..at.start.min(text.len())].matches('\n').count())
        });
        format!("not TOML{line}: {}", e.message())
    })
}

fn build<S: Geometry>(
    mut scene: Fields,
    given: &Map<String, Value>,
    files: &mesh::Files,
) -> Result<World<S>, String> {
    let mut asked: Map<String, Value> = scene.take("world")?.unwrap_or_default();
    asked.extend(given.clone());
    let materials: Map<String, Value> = scene.take("materials")?.unwrap_or_default();
    let materials = body::Materials::read(materials)?;
    let bodies: Vec<Value> = scene.need("body")?;
    let joints: Vec<Value> = scene.take("joint")?.unwrap_or_default();
    let pairs: Vec<Value> = scene.take("pair")?.unwrap_or_default();
    scene.finish()?;
    if S::DIM == 3 {
        mesh::check(files, &bodies)?;
    }
    let mut world = World::new(settings::<S>(&Settings::default(), asked)?).map_err(|e| e.to_string())?;
    for (number, value) in bodies.into_iter().enumerate() {
        body::add(&mut world, number, value, &materials, files)?;
        if world.bodies().len() > copies::MOST_BODIES {
            return Err(format!(
                "scene of more than {} bodies; lower the counts of repeat",
                copies::MOST_BODIES
            ));
        }
    }
    for (number, value) in joints.into_iter().enumerate() {
        joint::add(&mut world, number, value)?;
    }
    for (number, value) in pairs.into_iter().enumerate() {
        pair(&mut world, number, value, &materials)?;
    }
    Ok(world)
}

/// Settings with some of them replaced.
///
/// # Errors
/// Naming the setting.
pub fn settings<S: Geometry>(from: &Settings<S>, asked: Map<String, Value>) -> Result<Settings<S>, String> {
    let mut all = serde_json::to_value(from).map_err(|e| e.to_string())?;
    for (name, value) in asked {
        let Some(slot) = all.get_mut(&name) else { return Err(format!("world: unknown setting '{name}'")) };
        let before = std::mem::replace(slot, value.clone());
        if let Err(e) = serde_json::from_value::<Settings<S>>(all.clone()) {
            return Err(format!("world: {name}: {e}, got {}", fields::brief(&value)));
        }
        drop(before);
    }
    let settings: Settings<S> = serde_json::from_value(all).map_err(|e| format!("world: {e}"))?;
    settings.check().map_err(|e| format!("world: {e}"))?;
    Ok(settings)
}

fn pair<S: Geometry>(
    world: &mut World<S>,
    number: usize,
    value: Value,
    materials: &body::Materials,
) -> Result<(), String> {
    let mut fields = Fields::new(format!("pair {}", number + 1), value)?;
    let [one, other]: [String; 2] = fields.need("materials")?;
    for name in [&one, &other] {
        if !materials.has(name) {
            return Err(fields.wrong("materials", format!("unknown material '{name}'")));
        }
    }
    let said = MaterialPair {
        friction: fields.take("friction")?,
        restitution: fields.take("restitution")?,
        tangential_restitution: fields.take("tangential_restitution")?,
        rolling_friction: fields.take("rolling_friction")?,
        spinning_friction: fields.take("spinning_friction")?,
    };
    fields.finish()?;
    let used = |name: &str| (0..world.bodies().len()).any(|i| world.bodies().material(i) == Some(name));
    if used(&one) && used(&other) {
        // no contact has the others
        world.set_pair(&one, &other, said).map_err(|e| e.to_string())?;
    }
    Ok(())
}
