//! What can go wrong, each with the body, the field, the value and the remedy.

use carom_geometry::ShapeError;
use thiserror::Error;

/// Wrong input, refused where it enters; the world is unchanged.
#[derive(Clone, Debug, PartialEq, Error)]
#[error("{}{}; {remedy}", named(body.as_deref(), joint.as_deref()), sentence(field, problem))]
pub struct BuildError {
    /// Name of the body meant, if one is.
    pub body: Option<String>,
    /// Name of the joint meant, if one is.
    pub joint: Option<String>,
    /// Field of the body or setting of the world.
    pub field: String,
    /// What is wrong, with the value.
    pub problem: String,
    /// What to do about it.
    pub remedy: String,
}

/// What is meant, before a colon.
fn named(body: Option<&str>, joint: Option<&str>) -> String {
    match (body, joint) {
        (_, Some(joint)) => format!("joint '{joint}': "),
        (Some(body), None) => format!("body '{body}': "),
        (None, None) => String::new(),
    }
}

/// Verbs with which a problem goes on from its field: `mass must be > 0`; others follow a colon.
const VERBS: [&str; 8] = ["must", "is", "has", "needs", "coincides", "names", "encloses", "lies"];

/// Field and problem as a sentence.
fn sentence(field: &str, problem: &str) -> String {
    let goes_on = problem.split_once(' ').is_some_and(|(first, _)| VERBS.contains(&first));
    if goes_on { format!("{field} {problem}") } else { format!("{field}: {problem}") }
}

/// The field of a body that a field of its shape is; what belongs to no field of the shape stands for itself.
pub fn shape_field(field: &str) -> String {
    if ["shape", "density", "relative_tolerance"].contains(&field) {
        field.into()
    } else {
        format!("shape.{field}")
    }
}

impl BuildError {
    /// An error about a field of a body.
    pub fn body(body: &str, field: &str, problem: impl Into<String>, remedy: impl Into<String>) -> Self {
        BuildError {
            body: Some(body.into()),
            joint: None,
            field: field.into(),
            problem: problem.into(),
            remedy: remedy.into(),
        }
    }
    /// An error about a field of a joint.
    pub fn joint(joint: &str, field: &str, problem: impl Into<String>, remedy: impl Into<String>) -> Self {
        BuildError { joint: Some(joint.into()), ..BuildError::setting(field, problem, remedy) }
    }
    /// An error about a setting of the world.
    pub fn setting(field: &str, problem: impl Into<String>, remedy: impl Into<String>) -> Self {
        BuildError {
            body: None,
            joint: None,
            field: field.into(),
            problem: problem.into(),
            remedy: remedy.into(),
        }
    }
    /// The error of a shape as one of the body that has it.
    pub fn shape(body: &str, e: ShapeError) -> Self {
        BuildError {
            body: Some(body.into()),
            joint: None,
            field: shape_field(&e.field),
            problem: e.problem,
            remedy: e.remedy,
        }
    }
}

/// A step that could not be taken; the world is exactly as it was before it.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum StepError {
    /// A number of a body is not finite.
    #[error("step at t = {time} s: body '{body}': {field} is not finite ({value}) {stage}; {remedy}")]
    NotFinite {
        /// Name of the body.
        body: String,
        /// Which of its numbers.
        field: &'static str,
        /// The offending value.
        value: String,
        /// When it was found: before the step, or what made it.
        stage: &'static str,
        /// What to do about it.
        remedy: String,
        /// Time of the world \[s\].
        time: f64,
    },
    /// A fixed body has been given a velocity.
    #[error("step at t = {time} s: body '{body}': {field} must be 0 for a fixed body, got {value}; {remedy}")]
    FixedMoves {
        /// Name of the body.
        body: String,
        /// Which of its velocities.
        field: &'static str,
        /// The offending value.
        value: String,
        /// What to do about it.
        remedy: String,
        /// Time of the world \[s\].
        time: f64,
    },
    /// An argument of the step is impossible.
    #[error("step: {}; {remedy}", sentence(field, problem))]
    Argument {
        /// The argument.
        field: &'static str,
        /// What is wrong, with the value.
        problem: String,
        /// What to do about it.
        remedy: String,
    },
    /// The chosen solver cannot solve this step's contact problem.
    #[error(
        "step at t = {time} s: solver '{solver}' refused the {phase} problem of {contacts} contacts: {reason}; choose solver pgs, or lemke for small planar problems"
    )]
    SolverRefused {
        /// Name of the solver.
        solver: &'static str,
        /// "impact" or "contact".
        phase: &'static str,
        /// Number of contacts.
        contacts: usize,
        /// Why.
        reason: String,
        /// Time of the world \[s\].
        time: f64,
    },
    /// A solve ended above the tolerance and the settings ask to refuse such steps.
    #[error(
        "step at t = {time} s: solver '{solver}' left a residual of {residual:.2e} m/s in the {phase} problem of {contacts} contacts, tolerance {tolerance:.2e} m/s: {explanation}"
    )]
    Inaccurate {
        /// Name of the solver.
        solver: &'static str,
        /// "impact" or "contact".
        phase: &'static str,
        /// Number of contacts.
        contacts: usize,
        /// Natural-map residual \[m/s\].
        residual: f64,
        /// What was asked for \[m/s\].
        tolerance: f64,
        /// Why, and what to do.
        explanation: String,
        /// Time of the world \[s\].
        time: f64,
    },
    /// Impacts would gain energy and the settings ask to refuse such steps.
    #[error(
        "step at t = {time} s: bodies '{}' and '{}': impact law '{law}' would gain {energy:.2e} J; set energy_guard = \"clamp\" (Moreau's law there) or \"warn\", or choose impact = \"moreau\"",
        bodies.0, bodies.1
    )]
    EnergyGain {
        /// Names of the bodies of the contact that gains most.
        bodies: (String, String),
        /// Name of the impact law.
        law: &'static str,
        /// What the impacts would gain \[J\].
        energy: f64,
        /// Time of the world \[s\].
        time: f64,
    },
    /// A joint cannot be held.
    #[error("step at t = {time} s: joint '{joint}': {problem}; {remedy}")]
    Joint {
        /// Name of the joint.
        joint: String,
        /// What is wrong, with the value.
        problem: String,
        /// What to do about it.
        remedy: String,
        /// Time of the world \[s\].
        time: f64,
    },
    /// Whoever watched the step asked to stop in the middle of a solve.
    #[error("step at t = {time} s: interrupted in the {phase} problem of {contacts} contacts")]
    Interrupted {
        /// "impact" or "contact".
        phase: &'static str,
        /// Number of contacts.
        contacts: usize,
        /// Time of the world \[s\].
        time: f64,
    },
    /// A user's force field failed.
    #[error("step at t = {time} s: force field '{field}': {problem}")]
    ForceField {
        /// Name of the field.
        field: String,
        /// What went wrong.
        problem: String,
        /// Time of the world \[s\].
        time: f64,
    },
}
