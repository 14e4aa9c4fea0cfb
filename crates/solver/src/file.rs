//! A contact problem as a JSON text, and back, with the checks that a file from outside needs.

use crate::problem::{ContactProblem, ProblemError};
use carom_math::Space;

/// Longest text accepted \[bytes\]: about a million contacts.
pub const LARGEST_TEXT: usize = 1 << 30;

fn unreadable(problem: String) -> ProblemError {
    ProblemError {
        place: "file".into(),
        problem,
        remedy: "give a file written by carom's ContactProblem.save".into(),
    }
}

/// The problem as text.
pub fn to_json<S: Space>(problem: &ContactProblem<S>) -> String {
    serde_json::to_string(problem).expect("a problem is plain data")
}

/// A checked problem from text.
///
/// # Errors
/// [`ProblemError`] when the text is too long, is not a problem of this space, or fails its checks.
pub fn from_json<S: Space>(text: &str) -> Result<ContactProblem<S>, ProblemError> {
    if text.len() > LARGEST_TEXT {
        return Err(unreadable(format!("{} bytes; at most {LARGEST_TEXT} are read", text.len())));
    }
    let problem: ContactProblem<S> = serde_json::from_str(text).map_err(|e| unreadable(e.to_string()))?;
    problem.check()?;
    Ok(problem)
}
