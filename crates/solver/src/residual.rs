//! The one residual that judges every solver: the natural map of the contact law, in m/s (theory eqs. 5.31 to
//! 5.34). It is zero exactly at the solutions. Knows no solver.
//! normal: |g_n - max(0, g_n - m_n (u_n - target))| / m_n with m_n = 1/W_nn;
//! tangential: |g_t - P(g_t - m_t (u_t - slip_target))| / m_t with P the friction projection at mu g_n, m_t = 1/lambda_max(W_tt);
//! bounded row: |l - clamp(l - m (J u - target), lo, hi)| / m;
//! rolling and spinning friction: the same for moments, made a velocity by a length (theory eq. 3.28).
//! The forms used below are the same maps with the subtraction of nearly equal impulses carried out by hand.

use crate::cone::project_tangent;
use crate::prepared::{ContactRow, Prepared, PreparedContact, along};
use crate::problem::{ContactProblem, FrictionLaw, Impulse, Impulses, Twist};
use carom_math::{Column, Space};
use serde::{Deserialize, Serialize};

/// Which entry of a problem is meant.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Entry {
    /// Index of a contact.
    Contact(usize),
    /// Index of a bounded row.
    Row(usize),
}

/// How far impulses are from solving a problem.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Residual {
    /// Largest natural-map residual over contacts and rows \[m/s\].
    pub absolute: f64,
    /// The same divided by the residual of no impulses at all \[1\]: 1 is as wrong as doing nothing.
    pub relative: f64,
    /// Where it is largest; `None` when it is zero everywhere.
    pub worst: Option<Entry>,
}

impl Residual {
    /// The same, as a share of the residual of no impulses at all \[m/s\].
    pub(crate) fn relative_to(self, scale: f64) -> Self {
        Residual { relative: (self.absolute / scale.max(f64::MIN_POSITIVE)).min(f64::MAX), ..self }
    }
}

/// Residual of one contact \[m/s\]: the length of its normal and tangential parts.
#[inline]
pub fn contact_residual<S: Space>(
    impulse: &Impulse<S>,
    (normal_velocity, slip): (f64, S::Slip),
    target: f64,
    friction: f64,
    (normal_mass, tangent_mass): (f64, f64),
    law: FrictionLaw,
) -> f64 {
    let normal = least(impulse.normal / normal_mass, normal_velocity - target);
    if friction == 0.0 && impulse.tangent == S::Slip::ZERO {
        return normal.abs();
    }
    // an impulse that pulls is outside the law whatever the velocities are
    let limit = friction * impulse.normal.max(0.0);
    let trial = impulse.tangent - slip * tangent_mass;
    let nearest = project_tangent::<S>(trial, limit, law);
    let tangential = if nearest == trial { slip } else { (impulse.tangent - nearest) * (1.0 / tangent_mass) };
    (normal * normal + tangential.norm_squared()).sqrt()
}

/// Residual of a bounded row \[units of J u\] with J M^-1 J^T = `inverse_mass`.
#[inline]
pub fn row_residual(impulse: f64, velocity_error: f64, (lo, hi): (f64, f64), inverse_mass: f64) -> f64 {
    let lower = least(velocity_error, (impulse - lo) * inverse_mass);
    least(-lower, (hi - impulse) * inverse_mass).abs()
}

/// The smaller number, or the NaN among them: f64::min would hide it.
#[inline]
fn least(a: f64, b: f64) -> f64 {
    if a < b || a.is_nan() { a } else { b }
}

/// The residual of impulses, from the velocities that they give.
pub fn residual<S: Space>(problem: &ContactProblem<S>, impulses: &Impulses<S>) -> Residual {
    residual_of(problem, &Prepared::of(problem), impulses)
}

/// The same with the rows already prepared.
pub fn residual_of<S: Space>(
    problem: &ContactProblem<S>,
    prepared: &Prepared<S>,
    impulses: &Impulses<S>,
) -> Residual {
    residual_in(problem, prepared, impulses, &mut Vec::new())
}

/// The same with memory for the velocities after the impulses.
pub(crate) fn residual_in<S: Space>(
    problem: &ContactProblem<S>,
    prepared: &Prepared<S>,
    impulses: &Impulses<S>,
    after: &mut Vec<Twist<S>>,
) -> Residual {
    after.clone_from(&problem.velocities);
    prepared.apply(impulses, after);
    let (absolute, worst) = largest(problem, prepared, impulses, after);
    Residual { absolute, relative: 0.0, worst }.relative_to(velocity_scale(problem, prepared))
}

/// The same of contacts without friction and nothing else, with memory: what each impulse makes of its own velocity, and the
/// velocities after all.
pub(crate) fn residual_of_normals<S: Space>(
    problem: &ContactProblem<S>,
    impulses: &Impulses<S>,
    (pressed, after): (&mut Vec<f64>, &mut Vec<Twist<S>>),
) -> Residual {
    let mut all = LargestOfNormals::default();
    each_of_normals(problem, impulses, (pressed, after), |i, left| all.add(i, left));
    all.residual()
}

/// What a contact without friction leaves: its residual, and the scale of that \[m/s\].
pub(crate) type Left = (f64, f64);

/// The largest of what contacts without friction leave.
pub(crate) struct LargestOfNormals {
    absolute: f64,
    scale: f64,
    worst: Option<Entry>,
}

impl Default for LargestOfNormals {
    fn default() -> Self {
        LargestOfNormals { absolute: 0.0, scale: f64::MIN_POSITIVE, worst: None }
    }
}

impl LargestOfNormals {
    #[inline]
    pub fn add(&mut self, i: usize, (value, scale): Left) {
        self.scale = self.scale.max(scale);
        if value > self.absolute {
            (self.absolute, self.worst) = (value, Some(Entry::Contact(i)));
        }
    }
    pub fn residual(&self) -> Residual {
        let relative = (self.absolute / self.scale).min(f64::MAX);
        Residual { absolute: self.absolute, relative, worst: self.worst }
    }
}

/// Tells what each contact leaves of a problem of contacts without friction and nothing else; memory as above.
#[inline]
pub(crate) fn each_of_normals<S: Space>(
    problem: &ContactProblem<S>,
    impulses: &Impulses<S>,
    (pressed, after): (&mut Vec<f64>, &mut Vec<Twist<S>>),
    mut tell: impl FnMut(usize, Left),
) {
    let masses = &problem.inverse_masses;
    pressed.clear();
    pressed.reserve(problem.contacts.len());
    after.clone_from(&problem.velocities);
    for (c, g) in problem.contacts.iter().zip(&impulses.contacts) {
        if g.normal == 0.0 {
            pressed.push(0.0);
            continue;
        }
        let row = ContactRow::new(c, c.normal, masses);
        let (mut a, mut b) = (after[c.a], after[c.b]);
        row.push(g.normal, (masses[c.a].linear, masses[c.b].linear), (&mut a, &mut b));
        (after[c.a], after[c.b]) = (a, b);
        pressed.push(g.normal / (1.0 / row.inverse_effective_mass));
    }
    for (i, (c, &pressed)) in problem.contacts.iter().zip(&*pressed).enumerate() {
        let moments = (S::moment(c.arm_a, c.normal), S::moment(c.arm_b, c.normal));
        let velocity = |v: &[Twist<S>]| along(&c.normal, &moments, &v[c.a], &v[c.b]);
        let before = velocity(&problem.velocities);
        let scale = (c.target - before).max(f64::EPSILON * before.abs());
        let value = least(pressed, velocity(after) - c.target).abs();
        tell(i, (if value.is_nan() { f64::INFINITY } else { value }, scale));
    }
}

/// The same of a contact that is alone between its bodies, which have these velocities without it; where it is
/// largest is left out.
pub(crate) fn residual_alone<S: Space>(
    c: &PreparedContact<S>,
    law: FrictionLaw,
    velocities: &[Twist<S>],
    impulse: &Impulse<S>,
) -> Residual {
    let (mut a, mut b) = c.pair(velocities);
    let scale = approach_scale(c, law_velocity(c, &a, &b)).max(0.0).max(f64::MIN_POSITIVE);
    if *impulse != Impulse::default() {
        c.push(impulse, &mut a, &mut b);
    }
    let masses = (c.normal_mass, c.tangent_mass);
    let after = law_velocity(c, &a, &b);
    let value = contact_residual::<S>(impulse, after, c.target, c.friction, masses, law);
    let absolute = if value.is_nan() { f64::INFINITY } else { value };
    Residual { absolute, relative: (absolute / scale).min(f64::MAX), worst: None }
}

/// The same of a contact without friction, from its normal row and effective mass \[kg\], the inverse masses of its bodies
/// \[1/kg\], and the velocities without it, what they make of the row's with them \[m/s\].
#[inline]
pub(crate) fn residual_on_normal<S: Space>(
    (row, normal_mass): (&ContactRow<S>, f64),
    (mass_a, mass_b): (f64, f64),
    (velocities, before): (&[Twist<S>], f64),
    (impulse, target): (f64, f64),
) -> Residual {
    let (mut a, mut b) = (velocities[row.a as usize], velocities[row.b as usize]);
    row.push(impulse, (mass_a, mass_b), (&mut a, &mut b));
    left_on_normal(impulse / normal_mass, (before, row.velocity_between(&a, &b)), target)
}

/// The same from what the impulse makes of the row's velocity, and that without and with it \[m/s\].
#[inline]
pub(crate) fn left_on_normal(pressed: f64, (before, after): (f64, f64), target: f64) -> Residual {
    let scale = (target - before).max(f64::EPSILON * before.abs()).max(f64::MIN_POSITIVE);
    let value = least(pressed, after - target).abs();
    let absolute = if value.is_nan() { f64::INFINITY } else { value };
    Residual { absolute, relative: (absolute / scale).min(f64::MAX), worst: None }
}

/// Residual of every contact \[m/s\], rolling and spinning friction with it: the larger of the two.
pub fn contact_residuals<S: Space>(problem: &ContactProblem<S>, impulses: &Impulses<S>) -> Vec<f64> {
    let prepared = Prepared::of(problem);
    let mut after = problem.velocities.clone();
    prepared.apply(impulses, &mut after);
    let mut found = vec![0.0; problem.contacts.len()];
    each(problem, &prepared, impulses, &after, |value, entry| {
        if let Entry::Contact(i) = entry {
            // the larger number, or the NaN among them
            found[i] = -least(-found[i], -value);
        }
    });
    found
}

/// Largest residual at given velocities after the impulses, and where.
pub fn largest<S: Space>(
    problem: &ContactProblem<S>,
    prepared: &Prepared<S>,
    impulses: &Impulses<S>,
    after: &[Twist<S>],
) -> (f64, Option<Entry>) {
    let mut worst = (0.0, None);
    each(problem, prepared, impulses, after, |value, entry| {
        // NaN counts as infinitely wrong instead of vanishing in a comparison
        let value = if value.is_nan() { f64::INFINITY } else { value };
        if value > worst.0 {
            worst = (value, Some(entry));
        }
    });
    worst
}

/// Tells the residual of every contact, row and resistance at given velocities after the impulses.
#[inline]
fn each<S: Space>(
    problem: &ContactProblem<S>,
    prepared: &Prepared<S>,
    impulses: &Impulses<S>,
    after: &[Twist<S>],
    mut tell: impl FnMut(f64, Entry),
) {
    for (i, (c, g)) in prepared.contacts.iter().zip(&impulses.contacts).enumerate() {
        let masses = (c.normal_mass, c.tangent_mass);
        let value = contact_residual::<S>(
            g,
            law_velocity_of(c, after),
            c.target,
            c.friction,
            masses,
            problem.friction_law,
        );
        tell(value, Entry::Contact(i));
    }
    for (i, ((row, prepared), &l)) in problem.rows.iter().zip(&prepared.rows).zip(&impulses.rows).enumerate()
    {
        let error = prepared.velocity(after) - row.target;
        tell(row_residual(l, error, (row.lo, row.hi), prepared.inverse_effective_mass), Entry::Row(i));
    }
    for (r, &moment) in prepared.resistances.iter().zip(&impulses.moments) {
        let normal = impulses.contacts[r.contact].normal;
        tell(r.residual(normal, moment, r.spin(after)), Entry::Contact(r.contact));
    }
}

/// The residual of no impulses at all \[m/s\]: the largest approach to a target, over rows the largest distance
/// from it that the bounds let impulses cover. Slip does not count by itself: friction removes what the
/// approach presses for. A floor keeps approaches that are rounding of the bodies' velocities from counting.
pub fn velocity_scale<S: Space>(problem: &ContactProblem<S>, prepared: &Prepared<S>) -> f64 {
    let v = &problem.velocities;
    let contacts = prepared.contacts.iter().map(|c| approach_scale(c, law_velocity_of(c, v)));
    let rows = problem.rows.iter().zip(&prepared.rows).map(|(r, p)| {
        let velocity = p.velocity(v);
        let error = row_residual(0.0, velocity - r.target, (r.lo, r.hi), p.inverse_effective_mass);
        error.max(f64::EPSILON * velocity.abs())
    });
    contacts.chain(rows).fold(0.0, f64::max)
}

/// The same of a problem of contacts alone, before their rows are made.
pub(crate) fn velocity_scale_of<S: Space>(problem: &ContactProblem<S>) -> f64 {
    let v = &problem.velocities;
    problem.contacts.iter().fold(0.0, |most: f64, c| {
        let (a, b) = (&v[c.a], &v[c.b]);
        let moments = (S::moment(c.arm_a, c.normal), S::moment(c.arm_b, c.normal));
        let most = most.max(c.target - along::<S>(&c.normal, &moments, a, b));
        // rounding counts only where nearly nothing is asked for: normal and slip are no larger than this together
        let moved = a.at(c.arm_a) - b.at(c.arm_b);
        if 4.0 * f64::EPSILON * (moved.norm() + c.slip_target.norm()) <= most {
            return most;
        }
        let prepared = PreparedContact::new(c, &problem.inverse_masses);
        most.max(approach_scale(&prepared, law_velocity(&prepared, a, b)))
    })
}

/// What a contact's law asks for of the velocities of its bodies: without friction the slip is of no matter, and zero.
#[inline]
fn law_velocity<S: Space>(c: &PreparedContact<S>, a: &Twist<S>, b: &Twist<S>) -> (f64, S::Slip) {
    let slip = if c.friction > 0.0 { c.slip_between(a, b) } else { S::Slip::ZERO };
    (c.normal.velocity_between(a, b), slip)
}

/// The same from those of all bodies.
#[inline]
fn law_velocity_of<S: Space>(c: &PreparedContact<S>, v: &[Twist<S>]) -> (f64, S::Slip) {
    law_velocity(c, &v[c.normal.a as usize], &v[c.normal.b as usize])
}

/// What one contact adds to it.
#[inline]
fn approach_scale<S: Space>(c: &PreparedContact<S>, (normal, slip): (f64, S::Slip)) -> f64 {
    (c.target - normal).max(f64::EPSILON * (normal.abs() + slip.norm()))
}
