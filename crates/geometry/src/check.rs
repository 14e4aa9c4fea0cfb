//! Checks of what users state: every refusal names the field, the value and a remedy.

use crate::geometry::ShapeError;
use carom_math::Column;

/// Smallest length a shape may have \[m\]: below it, rounding at everyday distances swallows the shape.
pub const SMALLEST_LENGTH: f64 = 1e-9;
/// Largest length or coordinate a shape may have \[m\]: beyond it, f64 resolves no micrometres.
pub const LARGEST_LENGTH: f64 = 1e9;

/// Accepts a finite length between the smallest and the largest.
pub fn length(field: &str, value: f64) -> Result<(), ShapeError> {
    if !value.is_finite() || value <= 0.0 {
        return Err(ShapeError::new(
            field,
            format!("must be finite and > 0, got {value}"),
            "give a positive length in metres",
        ));
    }
    if !(SMALLEST_LENGTH..=LARGEST_LENGTH).contains(&value) {
        return Err(ShapeError::new(
            field,
            format!("must lie between {SMALLEST_LENGTH:e} and {LARGEST_LENGTH:e} m, got {value:e}"),
            "choose units in which the scene's lengths are near 1",
        ));
    }
    Ok(())
}

/// Accepts every length of a full size; the field of entry i is `field[i]`.
pub fn lengths(field: &str, values: &[f64]) -> Result<(), ShapeError> {
    values.iter().enumerate().try_for_each(|(i, v)| length(&format!("{field}[{i}]"), *v))
}

/// Accepts finite coordinates of reasonable size.
pub fn point<V: Column>(field: &str, value: V) -> Result<(), ShapeError> {
    if !value.is_finite() {
        return Err(ShapeError::new(
            field,
            format!("coordinates must be finite, got {:?}", value.as_slice()),
            "remove the point or give its coordinates in metres",
        ));
    }
    if value.max_abs() > LARGEST_LENGTH {
        return Err(ShapeError::new(
            field,
            format!("coordinates must not exceed {LARGEST_LENGTH:e} m, got {:?}", value.as_slice()),
            "move the shape to its origin or choose other units",
        ));
    }
    Ok(())
}

/// Accepts at least `least` points, all of them finite.
pub fn points<V: Column>(field: &str, values: &[V], least: usize) -> Result<(), ShapeError> {
    if values.len() < least {
        return Err(ShapeError::new(
            field,
            format!("needs at least {least} points, got {}", values.len()),
            "give more points",
        ));
    }
    values.iter().enumerate().try_for_each(|(i, p)| point(&format!("{field}[{i}]"), *p))
}

/// Two ends of a wall must differ by more than the smallest length.
pub fn distinct<V: Column>(field: &str, a: V, b: V) -> Result<(), ShapeError> {
    if (b - a).norm() >= SMALLEST_LENGTH {
        return Ok(());
    }
    Err(ShapeError::new(
        field,
        format!("coincides with the point before it, {:?}", a.as_slice()),
        "remove one of the two points",
    ))
}

/// The unit vector along a normal, or a refusal.
pub fn normal<V: Column>(field: &str, value: V) -> Result<V, ShapeError> {
    let largest = value.max_abs();
    // scaled first, so that the square of a huge or tiny length neither overflows nor vanishes
    let unit = if value.is_finite() && largest > 0.0 { (value * (1.0 / largest)).normalized() } else { None };
    unit.ok_or_else(|| {
        ShapeError::new(
            field,
            format!("must be finite and not zero, got {:?}", value.as_slice()),
            "give a direction; its length does not matter",
        )
    })
}

/// Puts the path of the enclosing shape before the field of an error.
pub fn within(prefix: &str, error: ShapeError) -> ShapeError {
    ShapeError { field: format!("{prefix}.{}", error.field), ..error }
}
