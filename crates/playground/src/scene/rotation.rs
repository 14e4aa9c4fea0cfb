//! Rotations as scene files state them, and as the engine stores them: an angle or `{ degrees }` in the plane; in
//! space `[w, x, y, z]`, axis and angle, or Euler angles about the fixed x, then y, then z axis. Sine and cosine are
//! those of libm, the same on every machine; Python's loader takes its C library's, which agree but for a last bit.

use super::fields::{Fields, brief};
use serde_json::Value;

/// What a scene says of a rotation, before scatter: an angle \[rad\] or a unit quaternion `[w, x, y, z]`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Turned {
    /// In the plane \[rad\].
    Angle(f64),
    /// In space.
    Quaternion([f64; 4]),
}

impl Turned {
    /// The numbers that the engine reads: an angle, or a quaternion.
    pub fn numbers(&self) -> &[f64] {
        match self {
            Turned::Angle(angle) => std::slice::from_ref(angle),
            Turned::Quaternion(q) => q,
        }
    }
    /// The numbers as shapes have them in files: `[cos, sin]` or a quaternion.
    pub fn stored(&self) -> Vec<f64> {
        match self {
            Turned::Angle(angle) => vec![libm::cos(*angle), libm::sin(*angle)],
            Turned::Quaternion(q) => q.to_vec(),
        }
    }
    /// Reads a rotation of the plane (`dimension` 2) or of space.
    ///
    /// # Errors
    /// When it has none of the forms; `of` begins the message.
    pub fn read(value: Value, dimension: usize, of: &str) -> Result<Self, String> {
        if dimension == 2 { planar(value, of) } else { spatial(value, of) }
    }
}

/// An angle in degrees, as Python's `math.radians` has it \[rad\].
fn radians(degrees: f64) -> f64 {
    degrees * (std::f64::consts::PI / 180.0)
}

fn planar(value: Value, of: &str) -> Result<Turned, String> {
    if let Some(angle) = value.as_f64() {
        return Ok(Turned::Angle(angle));
    }
    let help = "write rotation = 0.5 [rad] or rotation = { degrees = 30 }";
    if !value.is_object() {
        return Err(format!("{of}: rotation must be an angle, got {}; {help}", brief(&value)));
    }
    let mut fields = Fields::new(of, value)?;
    let given = (fields.take::<f64>("angle")?, fields.take::<f64>("degrees")?);
    fields.finish()?;
    match given {
        (Some(angle), None) => Ok(Turned::Angle(angle)),
        (None, Some(degrees)) => Ok(Turned::Angle(radians(degrees))),
        _ => Err(format!("{of}: rotation needs exactly one of angle, degrees; {help}")),
    }
}

fn spatial(value: Value, of: &str) -> Result<Turned, String> {
    let help = "write [w, x, y, z], { axis = [..], degrees = .. } or { euler_xyz_degrees = [..] }";
    let value = match value {
        Value::Array(_) => serde_json::json!({ "quaternion": value }),
        Value::Object(_) => value,
        other => return Err(format!("{of}: rotation must be a quaternion, got {}; {help}", brief(&other))),
    };
    let mut fields = Fields::new(of, value)?;
    let quaternion = fields.take::<[f64; 4]>("quaternion")?;
    let axis = fields.take::<[f64; 3]>("axis")?;
    let angle = fields.take::<f64>("angle")?.or(fields.take::<f64>("degrees")?.map(radians));
    let euler = fields.take::<[f64; 3]>("euler_xyz_degrees")?;
    fields.finish()?;
    match (quaternion, axis, angle, euler) {
        (Some(q), None, None, None) if length(&q) > 1e-12 => {
            let size = length(&q);
            Ok(Turned::Quaternion(q.map(|part| part / size)))
        }
        (None, Some(axis), Some(angle), None) if length(&axis) > 1e-12 => {
            Ok(Turned::Quaternion(axis_angle(axis, angle)))
        }
        (None, None, None, Some(angles)) => {
            let mut result = [1.0, 0.0, 0.0, 0.0];
            for (k, degrees) in angles.into_iter().enumerate() {
                let axis = std::array::from_fn(|i| if i == k { 1.0 } else { 0.0 });
                result = product(axis_angle(axis, radians(degrees)), result);
            }
            Ok(Turned::Quaternion(result))
        }
        _ => Err(format!("{of}: rotation needs one form, of a length that is not 0; {help}")),
    }
}

fn length(values: &[f64]) -> f64 {
    let largest = values.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
    if largest == 0.0 || !largest.is_finite() {
        return 0.0;
    }
    values.iter().map(|v| v * v).sum::<f64>().sqrt()
}

/// Unit quaternion `[w, x, y, z]` of a turn by `angle` \[rad\] about `axis`, of any length.
pub fn axis_angle(axis: [f64; 3], angle: f64) -> [f64; 4] {
    let sine = libm::sin(angle / 2.0) / length(&axis);
    [libm::cos(angle / 2.0), axis[0] * sine, axis[1] * sine, axis[2] * sine]
}

/// Hamilton product: the turn `right`, then the turn `left`.
pub fn product(a: [f64; 4], b: [f64; 4]) -> [f64; 4] {
    let scalar = a[0] * b[0] - (a[1] * b[1] + a[2] * b[2] + a[3] * b[3]);
    let cross = [a[2] * b[3] - a[3] * b[2], a[3] * b[1] - a[1] * b[3], a[1] * b[2] - a[2] * b[1]];
    let vector = |k: usize| a[0] * b[k + 1] + b[0] * a[k + 1] + cross[k];
    [scalar, vector(0), vector(1), vector(2)]
}
