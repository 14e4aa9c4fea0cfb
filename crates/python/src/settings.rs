//! Settings by name: each crosses as JSON, and a refusal says which names or values there are.

use crate::errors;
use carom::{BuildError, Geometry, MaterialPair, Settings, World};
use pyo3::exceptions::PyKeyError;
use pyo3::prelude::*;
use serde_json::Value;

/// All settings as a JSON object.
pub fn as_json<S: Geometry>(settings: &Settings<S>) -> String {
    serde_json::to_string(settings).expect("settings are plain data")
}

/// Changes one setting to a value given as JSON.
///
/// # Errors
/// `KeyError` for an unknown name, `BuildError` for a value that is not one of the setting's.
pub fn set<S: Geometry>(py: Python<'_>, world: &mut World<S>, name: &str, json: &str) -> PyResult<()> {
    let refused = |problem: String| {
        errors::build(py, &BuildError::setting(name, explained(&problem), format!("see World.{name}")))
    };
    let mut all = serde_json::to_value(world.settings()).expect("settings are plain data");
    let slot = all.get_mut(name).ok_or_else(|| PyKeyError::new_err(name.to_string()))?;
    *slot = serde_json::from_str(json).map_err(|e| refused(e.to_string()))?;
    let given = slot.clone();
    let settings: Settings<S> =
        serde_json::from_value(all).map_err(|e| refused(with_value(e.to_string(), &given)))?;
    world.set_settings(settings).map_err(|e| errors::build(py, &e))
}

/// Says the coefficients of a pair of materials, given as JSON; forgets them when there is none.
///
/// # Errors
/// `BuildError` for a name that no body's material has, and for coefficients that are unknown or out of range.
pub fn set_pair<S: Geometry>(
    py: Python<'_>,
    world: &mut World<S>,
    (one, other): (&str, &str),
    json: Option<&str>,
) -> PyResult<()> {
    let said = match json.map(serde_json::from_str::<MaterialPair>).transpose() {
        Ok(Some(pair)) => world.set_pair(one, other, pair),
        Ok(None) => world.remove_pair(one, other).map(|_| ()),
        Err(e) => Err(BuildError::setting("pair", e.to_string(), "see World.set_pair")),
    };
    said.map_err(|e| errors::build(py, &e))
}

/// All pairs of materials as (one, other, coefficients as JSON).
pub fn pairs<S: Geometry>(world: &World<S>) -> Vec<(String, String, String)> {
    let plain = |pair| serde_json::to_string(&pair).expect("a pair is plain data");
    world.pairs().map(|(a, b, pair)| (a.into(), b.into(), plain(pair))).collect()
}

fn with_value(problem: String, given: &Value) -> String {
    let given = given.as_str().map_or_else(|| given.to_string(), |word| format!("'{word}'"));
    format!("{problem}\u{0}{given}")
}

/// The deserialiser's words as a problem.
fn explained(words: &str) -> String {
    let (words, given) = words.split_once('\u{0}').unwrap_or((words, ""));
    if let Some((_, known)) = words.strip_prefix("unknown variant ").and_then(|w| w.split_once(", expected "))
    {
        return format!(
            "must be one of {}, got {given}",
            known.trim_start_matches("one of ").replace('`', "'")
        );
    }
    for prefix in ["invalid type: ", "invalid value: "] {
        if let Some((_, wanted)) = words.strip_prefix(prefix).and_then(|w| w.split_once(", expected ")) {
            return format!("must be {}, got {given}", kind(wanted));
        }
    }
    format!("{words}, got {given}")
}

/// A Rust type in words.
fn kind(wanted: &str) -> &str {
    match wanted {
        "usize" | "u64" => "a whole number >= 0",
        "a boolean" => "True or False",
        "f64" => "a number",
        "a sequence" => "a list of numbers",
        other => other,
    }
}
