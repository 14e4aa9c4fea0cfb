//! Infinite bounds in files: JSON has no infinity, so bounds are written as "inf" and "-inf".

use serde::{Deserialize, Deserializer, Serialize, Serializer};

#[derive(Serialize, Deserialize)]
#[serde(untagged)]
enum Bound {
    Number(f64),
    Word(String),
}

pub fn serialize<T: Serializer>(value: &f64, s: T) -> Result<T::Ok, T::Error> {
    if value.is_finite() {
        s.serialize_f64(*value)
    } else {
        s.serialize_str(if value.is_nan() {
            "nan"
        } else if *value > 0.0 {
            "inf"
        } else {
            "-inf"
        })
    }
}

pub fn deserialize<'de, D: Deserializer<'de>>(d: D) -> Result<f64, D::Error> {
    match Bound::deserialize(d)? {
        Bound::Number(x) => Ok(x),
        Bound::Word(w) if w == "inf" => Ok(f64::INFINITY),
        Bound::Word(w) if w == "-inf" => Ok(f64::NEG_INFINITY),
        Bound::Word(w) => {
            Err(serde::de::Error::custom(format!("a bound is a number, \"inf\" or \"-inf\", not {w:?}")))
        }
    }
}
