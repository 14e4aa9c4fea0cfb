//! Joints of a scene.

use super::fields::Fields;
use carom::{Anchor, Geometry, JointKind, JointSpec, World};
use serde_json::Value;

/// Adds a joint of a scene.
///
/// # Errors
/// One sentence that names the joint and the field.
pub fn add<S: Geometry>(world: &mut World<S>, number: usize, value: Value) -> Result<(), String> {
    let mut fields = Fields::new(format!("joint {}", number + 1), value)?;
    let name: String = fields.need("name")?;
    fields.called(format!("joint '{name}'"));
    let kind = match fields.need::<String>("kind")?.as_str() {
        "point" => JointKind::Point,
        "distance" => JointKind::Distance,
        "fixed" => JointKind::Fixed,
        other => return Err(fields.wrong("kind", format!("must be point, distance or fixed, got '{other}'"))),
    };
    let (a, b): (String, Option<String>) = (fields.need("a")?, fields.take("b")?);
    let point: Option<S::Vector> = fields.take("point")?;
    let (on_a, on_b) = (fields.take::<S::Vector>("anchor_a")?, fields.take::<S::Vector>("anchor_b")?);
    if point.is_some() && (on_a.is_some() || on_b.is_some()) {
        return Err(fields.wrong("point", "must not be given beside anchors; give point or anchors"));
    }
    let of_b = if b.is_none() { Anchor::World } else { Anchor::Body };
    let spec = JointSpec {
        kind,
        a,
        b,
        anchor_a: point.map(Anchor::World).or(on_a.map(Anchor::Body)),
        anchor_b: point.map(Anchor::World).or(on_b.map(of_b)),
        length: fields.take("length")?,
        collide: fields.take("collide")?.unwrap_or(false),
    };
    fields.finish()?;
    world.add_joint(&name, spec).map(|_| ()).map_err(|e| e.to_string())
}
