//! The contact problem as a value: find impulses so that
//! 0 <= gamma_n _|_ u_n - target >= 0, friction opposite to u_t - slip_target inside its limit, and bounded rows,
//! with u = J (v + M^-1 J^T gamma) (theory chapter 5). Knows no shapes, no world and no clock.

use crate::resistance::Resistance;
use carom_math::{Column, Inertia, Space};
use serde::{Deserialize, Serialize};

/// Linear and angular velocity of a body, or a row's coefficients on them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(bound = "")]
pub struct Twist<S: Space> {
    /// Velocity of the centre of mass \[m/s\].
    pub linear: S::Vector,
    /// Angular velocity \[rad/s\], world axes.
    pub angular: S::Spin,
}

impl<S: Space> Twist<S> {
    /// A twist from its parts.
    pub fn new(linear: S::Vector, angular: S::Spin) -> Self {
        Twist { linear, angular }
    }
    /// Scalar product of all components.
    #[inline]
    pub fn dot(&self, other: &Self) -> f64 {
        self.linear.dot(other.linear) + self.angular.dot(other.angular)
    }
    /// self += factor * other.
    #[inline]
    pub fn add_scaled(&mut self, other: &Self, factor: f64) {
        self.linear += other.linear * factor;
        self.angular += other.angular * factor;
    }
    /// Velocity of the point at `arm` from the centre of mass: v + w x r.
    #[inline]
    pub fn at(&self, arm: S::Vector) -> S::Vector {
        self.linear + S::swing(self.angular, arm)
    }
    /// True when every component is finite.
    pub fn is_finite(&self) -> bool {
        self.linear.is_finite() && self.angular.is_finite()
    }
}

/// Inverse mass and inverse inertia of a body; zeros for an obstacle and for a particle's rotation.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(bound = "")]
pub struct InverseMass<S: Space> {
    /// Inverse mass \[1/kg\].
    pub linear: f64,
    /// Inverse inertia about the centre of mass in world axes \[1/(kg m^2)\].
    pub angular: S::Inertia,
}

impl<S: Space> InverseMass<S> {
    /// M^-1 applied to a momentum (or to a row's coefficients).
    #[inline]
    pub fn apply(&self, momentum: &Twist<S>) -> Twist<S> {
        Twist { linear: momentum.linear * self.linear, angular: self.angular.apply(momentum.angular) }
    }
    /// True for a body that no impulse moves.
    pub fn is_fixed(&self) -> bool {
        self.linear == 0.0 && self.angular == S::Inertia::ZERO
    }
}

/// One contact: its frame, arms, gap and law.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(bound = "")]
pub struct Contact<S: Space> {
    /// Names the contact from step to step; carries warm starts.
    pub id: u64,
    /// Index of body a.
    pub a: usize,
    /// Index of body b.
    pub b: usize,
    /// Unit normal from b to a.
    pub normal: S::Vector,
    /// Contact point relative to a's centre of mass \[m\].
    pub arm_a: S::Vector,
    /// Contact point relative to b's centre of mass \[m\].
    pub arm_b: S::Vector,
    /// Distance between the surfaces \[m\]; negative when they overlap.
    pub gap: f64,
    /// Normal velocity that a pressed contact ends with \[m/s\].
    pub target: f64,
    /// Slip that a contact ends with inside its friction limit, in the contact's frame \[m/s\]; friction at the limit
    /// is opposite to what the slip still differs from it (theory eq. 3.19). Zero unless an impact law asks for more.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub slip_target: S::Slip,
    /// Coefficient of restitution \[1\], in \[0, 1\]: already contained in `target` where the impact law
    /// is simultaneous; read by laws that resolve one collision after another.
    pub restitution: f64,
    /// Coefficient of friction \[1\].
    pub friction: f64,
}

/// True for what a file leaves out.
fn is_zero<C: Column>(column: &C) -> bool {
    *column == C::ZERO
}

/// A general row lo <= lambda <= hi: lambda = lo implies J u >= target, lambda = hi implies J u <= target,
/// in between J u = target (theory chapter 5). Equality rows have infinite bounds.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(bound = "")]
pub struct BoundedRow<S: Space> {
    /// Names the row from step to step.
    pub id: u64,
    /// Index of the first body.
    pub a: usize,
    /// Index of the second body.
    pub b: usize,
    /// Coefficients on a's velocity.
    pub on_a: Twist<S>,
    /// Coefficients on b's velocity.
    pub on_b: Twist<S>,
    /// Velocity the row asks for \[units of J u\].
    pub target: f64,
    /// Smallest impulse; -infinity for none.
    #[serde(with = "crate::number")]
    pub lo: f64,
    /// Largest impulse; infinity for none.
    #[serde(with = "crate::number")]
    pub hi: f64,
}

/// How the friction impulse is limited, given the normal impulse gamma_n and the coefficient mu.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum FrictionLaw {
    /// |gamma_t| <= mu gamma_n, opposite to the slip: Coulomb's law.
    #[default]
    Disc,
    /// Each tangential component in \[-mu gamma_n, mu gamma_n\] on its own: the notes' box projection.
    /// The same as the disc in the plane; up to 41 % too strong along a diagonal in space.
    Box,
}

/// Impulse of one contact: normal and tangential components in the contact's frame \[N s\].
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(bound = "")]
pub struct Impulse<S: Space> {
    /// Normal impulse, >= 0.
    pub normal: f64,
    /// Tangential impulse.
    pub tangent: S::Slip,
}

/// The unknowns of a problem, and the warm start of a solve.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(bound = "")]
pub struct Impulses<S: Space> {
    /// One per contact.
    pub contacts: Vec<Impulse<S>>,
    /// One per bounded row.
    pub rows: Vec<f64>,
    /// One per resistance, in the contact's frame: about the normal, then the tangents; in the plane one number
    /// \[N m s\].
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub moments: Vec<S::Spin>,
}

impl<S: Space> Impulses<S> {
    /// Zero impulses for a problem.
    pub fn zero(problem: &ContactProblem<S>) -> Self {
        let mut zero = Impulses { contacts: Vec::new(), rows: Vec::new(), moments: Vec::new() };
        zero.reset(problem);
        zero
    }
    /// Makes this the zero impulses of a problem without giving memory back.
    pub fn reset(&mut self, problem: &ContactProblem<S>) {
        self.contacts.clear();
        self.contacts.resize(problem.contacts.len(), Impulse::default());
        self.rows.clear();
        self.rows.resize(problem.rows.len(), 0.0);
        self.moments.clear();
        self.moments.resize(problem.resistances.len(), S::Spin::ZERO);
    }
    /// Makes these fit a problem: impulses counted for another problem are no warm start and become zero.
    pub fn fit(&mut self, problem: &ContactProblem<S>) {
        let fits = self.contacts.len() == problem.contacts.len()
            && self.rows.len() == problem.rows.len()
            && self.moments.len() == problem.resistances.len();
        if !fits {
            self.reset(problem);
        }
    }
    /// Makes these equal to others without giving memory back.
    pub fn copy_from(&mut self, other: &Self) {
        self.contacts.clone_from(&other.contacts);
        self.rows.clone_from(&other.rows);
        self.moments.clone_from(&other.moments);
    }
    /// True when no impulse is infinite or NaN.
    pub fn is_finite(&self) -> bool {
        self.contacts.iter().all(|c| c.normal.is_finite() && c.tangent.is_finite())
            && self.rows.iter().all(|l| l.is_finite())
            && self.moments.iter().all(|m| m.is_finite())
    }
    /// All numbers in the order of the problem's scalar rows: contacts (normal, tangents), then rows,
    /// then moments.
    pub fn flat(&self) -> Vec<f64> {
        let mut out = Vec::with_capacity(
            self.contacts.len() * (1 + S::SLIP) + self.rows.len() + self.moments.len() * S::SPIN,
        );
        for c in &self.contacts {
            out.push(c.normal);
            out.extend_from_slice(c.tangent.as_slice());
        }
        out.extend_from_slice(&self.rows);
        self.moments.iter().for_each(|m| out.extend_from_slice(m.as_slice()));
        out
    }
    /// The inverse of `flat`; `None` when the length differs from the problem's.
    pub fn from_flat(problem: &ContactProblem<S>, values: &[f64]) -> Option<Self> {
        if values.len() != problem.scalar_rows() {
            return None;
        }
        let width = 1 + S::SLIP;
        let split = problem.contacts.len() * width;
        let contacts = values[..split]
            .chunks_exact(width)
            .map(|c| Impulse { normal: c[0], tangent: S::Slip::from_fn(|k| c[1 + k]) })
            .collect();
        let (rows, moments) = values[split..].split_at(problem.rows.len());
        let moments = moments.chunks_exact(S::SPIN).map(|m| S::Spin::from_fn(|k| m[k])).collect();
        Some(Impulses { contacts, rows: rows.to_vec(), moments })
    }
}

/// A system of simultaneous contacts and bounded rows between bodies.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(bound = "")]
pub struct ContactProblem<S: Space> {
    /// "planar" or "spatial": checked when a problem is read from a file.
    pub space: String,
    /// Inverse masses of all bodies.
    pub inverse_masses: Vec<InverseMass<S>>,
    /// Velocities of all bodies before the impulses.
    pub velocities: Vec<Twist<S>>,
    /// The contacts.
    pub contacts: Vec<Contact<S>>,
    /// The general rows.
    pub rows: Vec<BoundedRow<S>>,
    /// Rolling and spinning friction of those contacts that have it.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub resistances: Vec<Resistance>,
    /// How friction is limited.
    pub friction_law: FrictionLaw,
}

/// Why a problem was refused.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("contact problem: {place}: {problem}; {remedy}")]
pub struct ProblemError {
    /// Where: e.g. `contacts[3].normal`.
    pub place: String,
    /// What is wrong, with the value.
    pub problem: String,
    /// What to do.
    pub remedy: String,
}

impl<S: Space> ContactProblem<S> {
    /// An empty problem over the given bodies.
    pub fn new(inverse_masses: Vec<InverseMass<S>>, velocities: Vec<Twist<S>>) -> Self {
        ContactProblem {
            space: S::NAME.into(),
            inverse_masses,
            velocities,
            contacts: Vec::new(),
            rows: Vec::new(),
            resistances: Vec::new(),
            friction_law: FrictionLaw::Disc,
        }
    }
    /// Number of scalar unknowns: (1 + SLIP) per contact, one per bounded row, SPIN per resistance.
    pub fn scalar_rows(&self) -> usize {
        self.contacts.len() * (1 + S::SLIP) + self.rows.len() + self.resistances.len() * S::SPIN
    }
    /// True where contacts without friction are all there is: then nothing but normals takes part.
    pub fn is_of_normals(&self) -> bool {
        let plain = self.rows.is_empty() && self.resistances.is_empty();
        plain && self.contacts.iter().all(|c| c.friction == 0.0)
    }
    /// Velocities after the impulses: v + M^-1 J^T gamma (theory eq. 5.4).
    pub fn velocities_after(&self, impulses: &Impulses<S>) -> Vec<Twist<S>> {
        let mut v = self.velocities.clone();
        self.apply(impulses, &mut v);
        v
    }
    /// Adds M^-1 J^T gamma to `velocities`.
    pub fn apply(&self, impulses: &Impulses<S>, velocities: &mut [Twist<S>]) {
        for (contact, impulse) in self.contacts.iter().zip(&impulses.contacts) {
            if *impulse == Impulse::default() {
                continue;
            }
            let force = contact.to_world(impulse);
            let on_a = Twist::new(force, S::moment(contact.arm_a, force));
            let on_b = Twist::new(force, S::moment(contact.arm_b, force));
            velocities[contact.a].add_scaled(&self.inverse_masses[contact.a].apply(&on_a), 1.0);
            velocities[contact.b].add_scaled(&self.inverse_masses[contact.b].apply(&on_b), -1.0);
        }
        for (row, &impulse) in self.rows.iter().zip(&impulses.rows) {
            velocities[row.a].add_scaled(&self.inverse_masses[row.a].apply(&row.on_a), impulse);
            velocities[row.b].add_scaled(&self.inverse_masses[row.b].apply(&row.on_b), impulse);
        }
        for (resistance, &moment) in self.resistances.iter().zip(&impulses.moments) {
            let contact = &self.contacts[resistance.contact];
            let world = contact.moment_to_world(moment);
            velocities[contact.a].angular += self.inverse_masses[contact.a].angular.apply(world);
            velocities[contact.b].angular -= self.inverse_masses[contact.b].angular.apply(world);
        }
    }
    /// Checks every index and number of a problem that came from outside.
    ///
    /// # Errors
    /// [`ProblemError`] naming the first entry that is out of range, not finite, not normalised or not
    /// physical.
    pub fn check(&self) -> Result<(), ProblemError> {
        crate::check::check(self)
    }
}

impl<S: Space> Contact<S> {
    /// Velocity of a's point relative to b's, in the contact's frame: normal, tangents.
    pub fn relative_velocity(&self, velocities: &[Twist<S>]) -> (f64, S::Slip) {
        let u = velocities[self.a].at(self.arm_a) - velocities[self.b].at(self.arm_b);
        (u.dot(self.normal), S::Slip::from_fn(|k| u.dot(S::tangent(self.normal, k))))
    }
    /// The normal part of it.
    #[inline]
    pub fn normal_velocity(&self, velocities: &[Twist<S>]) -> f64 {
        (velocities[self.a].at(self.arm_a) - velocities[self.b].at(self.arm_b)).dot(self.normal)
    }
    /// An impulse in the contact's frame as a world vector.
    #[inline]
    pub fn to_world(&self, impulse: &Impulse<S>) -> S::Vector {
        self.normal * impulse.normal + self.slip_to_world(impulse.tangent)
    }
    /// Tangential components in the contact's frame as a world vector.
    #[inline]
    pub fn slip_to_world(&self, tangent: S::Slip) -> S::Vector {
        let mut world = S::Vector::ZERO;
        if tangent == S::Slip::ZERO {
            return world;
        }
        for k in 0..S::SLIP {
            world += S::tangent(self.normal, k) * tangent[k];
        }
        world
    }
    /// A world vector's tangential components in the contact's frame.
    pub fn to_slip(&self, world: S::Vector) -> S::Slip {
        S::Slip::from_fn(|k| world.dot(S::tangent(self.normal, k)))
    }
}
