//! A table of a scene document, read field by field: an error names the thing, the field and what is wrong with it,
//! and a field that nobody asked for is an error too. Knows no physics.

use serde::de::DeserializeOwned;
use serde_json::{Map, Value};

/// The fields of a table that have not been read yet.
pub struct Fields {
    /// What the table is of, as messages begin: `body 'ball'`.
    of: String,
    left: Map<String, Value>,
    known: Vec<&'static str>,
}

impl Fields {
    /// The fields of a table.
    ///
    /// # Errors
    /// When the value is no table.
    pub fn new(of: impl Into<String>, value: Value) -> Result<Self, String> {
        let of = of.into();
        match value {
            Value::Object(left) => Ok(Fields { of, left, known: Vec::new() }),
            other => Err(format!("{of}: must be a table, got {}", brief(&other))),
        }
    }
    /// Renames what messages begin with, once the name is known.
    pub fn called(&mut self, of: impl Into<String>) {
        self.of = of.into();
    }
    /// A message about a field.
    pub fn wrong(&self, key: &str, problem: impl std::fmt::Display) -> String {
        format!("{}: {key}: {problem}", self.of)
    }
    /// Takes a field as it stands.
    pub fn value(&mut self, key: &'static str) -> Option<Value> {
        self.known.push(key);
        self.left.remove(key)
    }
    /// Takes a field, when it is there.
    ///
    /// # Errors
    /// When it is not of that kind.
    pub fn take<T: DeserializeOwned>(&mut self, key: &'static str) -> Result<Option<T>, String> {
        let Some(value) = self.value(key) else { return Ok(None) };
        let told = brief(&value);
        serde_json::from_value(value).map(Some).map_err(|e| self.wrong(key, format!("{e}, got {told}")))
    }
    /// Takes a field that must be there.
    ///
    /// # Errors
    /// When it is missing or not of that kind.
    pub fn need<T: DeserializeOwned>(&mut self, key: &'static str) -> Result<T, String> {
        self.take(key)?.ok_or_else(|| self.wrong(key, "is missing"))
    }
    /// Ends the reading.
    ///
    /// # Errors
    /// When a field is left that nobody knows.
    pub fn finish(self) -> Result<(), String> {
        let Some(key) = self.left.keys().next() else { return Ok(()) };
        Err(format!("{}: unknown field '{key}'; known are {}", self.of, self.known.join(", ")))
    }
}

/// A value in at most 60 characters.
pub fn brief(value: &Value) -> String {
    let text = value.to_string();
    if text.chars().count() <= 60 { text } else { text.chars().take(57).chain("...".chars()).collect() }
}
