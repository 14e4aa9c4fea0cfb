//! Shapes of a scene: as the engine has them, but for the rotations of a compound's parts, which scenes may write in
//! several forms, and poses, of which they may leave out all or half.

use super::rotation::Turned;
use carom::Geometry;
use serde_json::{Value, json};

/// Reads a shape.
///
/// # Errors
/// When it is none of this space; `of` begins the message.
pub fn read<S: Geometry>(mut value: Value, of: &str) -> Result<S::Shape, String> {
    if let Some(parts) = value.get_mut("parts").and_then(Value::as_array_mut) {
        for (number, part) in parts.iter_mut().enumerate() {
            let of = format!("{of}: shape: part {}", number + 1);
            let Some(table) = part.as_object_mut() else { return Err(format!("{of}: must be a table")) };
            let pose = table.entry("pose").or_insert_with(|| json!({}));
            let Some(pose) = pose.as_object_mut() else { return Err(format!("{of}: pose: must be a table")) };
            pose.entry("position").or_insert_with(|| json!(vec![0.0; S::DIM]));
            let turned = match pose.remove("rotation") {
                Some(value) => Turned::read(value, S::DIM, &of)?.stored(),
                None if S::DIM == 2 => vec![1.0, 0.0],
                None => vec![1.0, 0.0, 0.0, 0.0],
            };
            pose.insert("rotation".into(), json!(turned));
        }
    }
    serde_json::from_value(value).map_err(|e| format!("{of}: shape: {e}"))
}
