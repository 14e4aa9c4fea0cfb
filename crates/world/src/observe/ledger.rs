//! The energy ledger: where every joule went, each line computed from its own impulses and velocities and
//! never as a remainder (theory chapter 6). Kick identity: with the configuration fixed,
//! dT = sum p.(u- + u+)/2 + sum h f.(v- + v+)/2 exactly, for any law and any solver error. The closure, energy
//! after minus energy before minus the sum of the lines, is rounding when the books are right.

use serde::{Deserialize, Serialize};

/// Lines of the ledger \[J\]; positive lines give energy to the bodies.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Ledger {
    /// Work of gravity: what potential energy paid; it is not part of the sum of the total energy's changes.
    pub gravity: f64,
    /// Work of applied forces, torques and force fields.
    pub applied: f64,
    /// Work of obstacles that move with a given velocity.
    pub driven: f64,
    /// Damping.
    pub damping: f64,
    /// Normal impulses of persistent contacts.
    pub contact_normal: f64,
    /// Friction of persistent contacts.
    pub friction: f64,
    /// Normal impulses of impacts.
    pub impact_normal: f64,
    /// Friction during impacts.
    pub impact_friction: f64,
    /// Normal impulses of contacts with restitution that approached below the rest speed and did not bounce.
    pub rest_cut: f64,
    /// Contacts of steps with too many events, taken at once.
    #[serde(default)]
    pub fallback: f64,
    /// Reactions of joints.
    #[serde(default)]
    pub constraint: f64,
    /// Position correction: energy after minus before it.
    pub projection: f64,
    /// The integrator: energy that free motion gained or lost.
    pub integrator: f64,
    /// Kinetic energy of bodies that fell asleep.
    #[serde(default)]
    pub sleep: f64,
    /// Energy after - energy before - sum of the lines.
    pub closure: f64,
}

impl Ledger {
    /// Names of the lines, in order, as users and files have them.
    pub const NAMES: [&'static str; 15] = [
        "gravity",
        "applied",
        "driven",
        "damping",
        "contact_normal",
        "friction",
        "impact_normal",
        "impact_friction",
        "rest_cut",
        "fallback",
        "constraint",
        "projection",
        "integrator",
        "sleep",
        "closure",
    ];
    /// The lines in the order of `NAMES`.
    pub fn lines(&self) -> [f64; 15] {
        [
            self.gravity,
            self.applied,
            self.driven,
            self.damping,
            self.contact_normal,
            self.friction,
            self.impact_normal,
            self.impact_friction,
            self.rest_cut,
            self.fallback,
            self.constraint,
            self.projection,
            self.integrator,
            self.sleep,
            self.closure,
        ]
    }
    /// Sum of the lines that change the total energy (all but gravity and closure).
    pub fn sum(&self) -> f64 {
        self.lines()[1..14].iter().sum()
    }
    /// Adds another step's ledger.
    pub fn add(&mut self, o: &Ledger) {
        self.gravity += o.gravity;
        self.applied += o.applied;
        self.driven += o.driven;
        self.damping += o.damping;
        self.contact_normal += o.contact_normal;
        self.friction += o.friction;
        self.impact_normal += o.impact_normal;
        self.impact_friction += o.impact_friction;
        self.rest_cut += o.rest_cut;
        self.fallback += o.fallback;
        self.constraint += o.constraint;
        self.projection += o.projection;
        self.integrator += o.integrator;
        self.sleep += o.sleep;
        self.closure += o.closure;
    }
}
