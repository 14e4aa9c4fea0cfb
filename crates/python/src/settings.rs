//! Settings by name: each crosses as JSON, and a refusal says which names or values there are.

use crate::errors;
use carom::{BuildError, Geometry, Settings, World};
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
        let (problem, remedy) = explained(&problem);
        errors::build(py, &BuildError::setting(name, problem, remedy))
    };
    let mut all = serde_json::to_value(world.settings()).expect("settings are plain data");
    let slot = all.get_mut(name).ok_or_else(|| PyKeyError::new_err(name.to_string()))?;
    *slot = serde_json::from_str(json).map_err(|e| refused(e.to_string()))?;
    let given = slot.clone();
    let settings: Settings<S> = serde_json::from_value(all).map_err(|e| refused(with_value(e.to_string(), &given)))?;
    world.set_settings(settings).map_err(|e| errors::build(py, &e))
}

fn with_value(problem: String, given: &Value) -> String {
    if problem.contains("got") { problem } else { format!("{problem}\u{0}{given}") }
}

/// The deserialiser's words as a problem and a remedy.
fn explained(words: &str) -> (String, String) {
    let (words, given) = words.split_once('\u{0}').map_or((words, ""), |(w, g)| (w, g));
    if let Some((_, known)) = words.strip_prefix("unknown variant ").and_then(|w| w.split_once(", expected ")) {
        let known = known.trim_start_matches("one of ").replace('`', "'");
        return (format!("must be one of {known}, got {given}"), format!("choose one of {known}"));
    }
    if let Some((_, wanted)) = words.strip_prefix("invalid type: ").and_then(|w| w.split_once(", expected ")) {
        return (format!("must be {}, got {given}", kind(wanted)), "see the setting's unit and type".into());
    }
    if let Some((_, wanted)) = words.strip_prefix("invalid value: ").and_then(|w| w.split_once(", expected ")) {
        return (format!("must be {}, got {given}", kind(wanted)), "see the setting's unit and type".into());
    }
    (format!("{words}, got {given}"), "see the setting's unit and type".into())
}

/// A Rust type in words.
fn kind(wanted: &str) -> &str {
    match wanted {
        "usize" | "u64" => "a whole number >= 0",
        "f64" => "a number",
        "a sequence" => "a list of numbers",
        other => other,
    }
}
