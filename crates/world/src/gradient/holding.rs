//! Which contacts of a solved problem act, and how: the active set on which a step is differentiated. With U the
//! velocity that friction acts against (u- + u+ of a flow on mean velocities, u+ else), a contact is open (no
//! impulse), sticks (no slip), slips (impulse on the cone against U) or is smooth (no friction). Says also where a
//! contact is on the edge between two of these.

use carom_math::{Column, Inertia, Space};
use carom_solver::{Contact, ContactProblem, Impulses, Twist};

/// Normal impulse over the problem's largest below which a contact is open \[1\].
const OPEN: f64 = 1e-10;
/// Share of the friction limit from which a contact is on the cone \[1\].
const ON_CONE: f64 = 1e-7;
/// Speeds over the fastest below which they are none \[1\].
const STILL: f64 = 1e-8;
/// Part of a contact's row outside of the held ones' below which it says nothing new \[1\].
const NEW: f64 = 1e-6;

/// How a contact acts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Hold {
    /// No impulse.
    Open,
    /// No slip; impulse inside the cone.
    Stick,
    /// Impulse on the cone, against the slip.
    Slip,
    /// No friction.
    Smooth,
}

/// An edge of the active set on which a contact is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Edge {
    /// Touches without impulse and without normal velocity, held by no other contact.
    Weightless,
    /// Neither slips nor sticks: impulse on the cone, no slip.
    OnCone,
    /// Slips with others, more than there are conditions: which of them presses how hard makes the motion.
    Indeterminate,
}

/// A solved problem with the velocities that its contacts act against.
pub struct Solved<'a, S: Space> {
    /// The problem.
    pub problem: &'a ContactProblem<S>,
    /// Its impulses.
    pub impulses: &'a Impulses<S>,
    /// U of each body.
    pub against: &'a [Twist<S>],
    /// Speed below which nothing counts as moving \[m/s\].
    pub still: f64,
}

/// Speed that counts as none among bodies with these velocities, the step's own fall among them \[m/s\].
pub fn still_speed<S: Space>(problem: &ContactProblem<S>, against: &[Twist<S>], fall: f64) -> f64 {
    let points = problem
        .contacts
        .iter()
        .flat_map(|c| [against[c.a].at(c.arm_a).norm(), against[c.b].at(c.arm_b).norm()]);
    STILL * points.fold(fall, f64::max)
}

impl<S: Space> Solved<'_, S> {
    /// How each contact acts.
    pub fn holds(&self) -> Vec<Hold> {
        let most = self.impulses.contacts.iter().fold(0.0, |m: f64, g| m.max(g.normal));
        let all = self.problem.contacts.iter().zip(&self.impulses.contacts);
        all.map(|(c, g)| {
            let slips =
                || g.tangent.norm() >= c.friction * g.normal * (1.0 - ON_CONE) && self.slip(c) > self.still;
            match () {
                _ if g.normal <= OPEN * most => Hold::Open,
                _ if c.friction == 0.0 => Hold::Smooth,
                _ if slips() => Hold::Slip,
                _ => Hold::Stick,
            }
        })
        .collect()
    }

    /// The contacts on an edge; `resting` says of a contact that it was held before, so that an open one counts. A
    /// contact whose directions others hold as well is on none: which of them carries is a choice that moves nothing.
    pub fn edges(&self, holds: &[Hold], resting: impl Fn(usize) -> bool) -> Vec<(usize, Edge)> {
        let mut edges = self.indeterminate(holds);
        let on_cone = |k: usize| {
            let (c, g) = (&self.problem.contacts[k], &self.impulses.contacts[k]);
            holds[k] == Hold::Stick && g.tangent.norm() >= c.friction * g.normal * (1.0 - ON_CONE)
        };
        let weightless = |k: usize| {
            let c = &self.problem.contacts[k];
            let normal = c.relative_velocity(self.against).0 - c.target;
            holds[k] == Hold::Open && normal <= self.still && resting(k)
        };
        let count = self.problem.contacts.len();
        let may_carry = |k: usize| holds[k] != Hold::Open || weightless(k);
        if !(0..count).any(|k| on_cone(k) || weightless(k)) || self.spreads_inside(holds, may_carry) {
            return edges;
        }
        let span = Span::of(self, holds, |k| !on_cone(k));
        for (k, c) in self.problem.contacts.iter().enumerate() {
            let is_new = |direction| span.is_new(self.problem, c, direction);
            if weightless(k) && is_new(c.normal) {
                edges.push((k, Edge::Weightless));
            }
            if on_cone(k) && (0..S::SLIP).any(|i| is_new(S::tangent(c.normal, i))) {
                edges.push((k, Edge::OnCone));
            }
        }
        edges
    }

    /// True when the least impulses with the same effect are inside all cones.
    fn spreads_inside(&self, holds: &[Hold], may_carry: impl Fn(usize) -> bool) -> bool {
        let taken: Vec<usize> = (0..holds.len()).filter(|&k| may_carry(k)).collect();
        let mut columns: Vec<Vec<f64>> = Vec::new();
        let mut given: Vec<f64> = Vec::new();
        for &k in &taken {
            let (c, g) = (&self.problem.contacts[k], &self.impulses.contacts[k]);
            columns.push(row(self.problem, c, self.line(c, holds[k])));
            given.push(g.normal);
            for i in (0..S::SLIP).filter(|_| !matches!(holds[k], Hold::Slip | Hold::Smooth)) {
                columns.push(row(self.problem, c, S::tangent(c.normal, i)));
                given.push(g.tangent[i]);
            }
        }
        // the part of the impulses in the row space of their effect
        let freedoms = columns.first().map_or(0, Vec::len);
        let mut span = Span(Vec::new());
        (0..freedoms).for_each(|d| span.take(columns.iter().map(|c| c[d]).collect()));
        let mut left = given.clone();
        span.outside(&mut left);
        let mut least = given.iter().zip(&left).map(|(g, l)| g - l);
        taken.iter().all(|&k| {
            let normal = least.next().unwrap_or(0.0);
            if matches!(holds[k], Hold::Slip | Hold::Smooth) {
                return normal > 0.0;
            }
            let tangent = (0..S::SLIP).map(|_| least.next().unwrap_or(0.0).powi(2)).sum::<f64>().sqrt();
            let limit = self.problem.contacts[k].friction * normal;
            normal > 0.0 && (limit == 0.0 || tangent < limit * (1.0 - ON_CONE))
        })
    }

    /// Contacts of which several distributions of pressure make different motions: more impulses than conditions.
    fn indeterminate(&self, holds: &[Hold]) -> Vec<(usize, Edge)> {
        let (mut rows, mut columns) = (Span(Vec::new()), Span(Vec::new()));
        let mut first = None;
        for (k, (c, hold)) in self.problem.contacts.iter().zip(holds).enumerate() {
            if *hold == Hold::Open {
                continue;
            }
            rows.take(row(self.problem, c, c.normal));
            columns.take(row(self.problem, c, self.line(c, *hold)));
            for i in (0..S::SLIP).filter(|_| *hold == Hold::Stick) {
                rows.take(row(self.problem, c, S::tangent(c.normal, i)));
                columns.take(row(self.problem, c, S::tangent(c.normal, i)));
            }
            if *hold == Hold::Slip && first.is_none() {
                first = Some(k);
            }
        }
        let more = columns.0.len() > rows.0.len();
        first.filter(|_| more).map(|k| (k, Edge::Indeterminate)).into_iter().collect()
    }

    /// The line of a contact's impulse per normal impulse.
    fn line(&self, c: &Contact<S>, hold: Hold) -> S::Vector {
        let (_, slip) = c.relative_velocity(self.against);
        let size = slip.norm();
        if hold != Hold::Slip || size == 0.0 {
            return c.normal;
        }
        (0..S::SLIP).fold(c.normal, |sum, i| sum - S::tangent(c.normal, i) * (c.friction * slip[i] / size))
    }

    fn slip(&self, c: &Contact<S>) -> f64 {
        c.relative_velocity(self.against).1.norm()
    }
}

/// The directions of motion that held contacts forbid, orthonormal in the metric of masses.
struct Span(Vec<Vec<f64>>);

impl Span {
    /// Normals of all held contacts, and tangents of those that stick and are inside their cone.
    fn of<S: Space>(solved: &Solved<S>, holds: &[Hold], inside: impl Fn(usize) -> bool) -> Self {
        let mut span = Span(Vec::new());
        for (number, (c, hold)) in solved.problem.contacts.iter().zip(holds).enumerate() {
            if *hold == Hold::Open {
                continue;
            }
            span.take(row(solved.problem, c, c.normal));
            for k in (0..S::SLIP).filter(|_| *hold == Hold::Stick && inside(number)) {
                span.take(row(solved.problem, c, S::tangent(c.normal, k)));
            }
        }
        span
    }
    /// What of a row is outside of the span, over the row.
    fn outside(&self, row: &mut [f64]) -> f64 {
        let size = row.iter().map(|x| x * x).sum::<f64>().sqrt();
        for _ in 0..2 {
            for q in &self.0 {
                let along: f64 = q.iter().zip(&*row).map(|(q, x)| q * x).sum();
                row.iter_mut().zip(q).for_each(|(x, q)| *x -= along * q);
            }
        }
        let left = row.iter().map(|x| x * x).sum::<f64>().sqrt();
        if size > 0.0 { left / size } else { 0.0 }
    }
    fn take(&mut self, mut row: Vec<f64>) {
        if self.outside(&mut row) > NEW {
            let k = 1.0 / row.iter().map(|x| x * x).sum::<f64>().sqrt();
            row.iter_mut().for_each(|x| *x *= k);
            self.0.push(row);
        }
    }
    fn is_new<S: Space>(&self, problem: &ContactProblem<S>, c: &Contact<S>, direction: S::Vector) -> bool {
        self.outside(&mut row(problem, c, direction)) > NEW
    }
}

/// J M^-1/2 of a contact along a direction; of the inertia its mean moment, which does for telling rows apart.
fn row<S: Space>(problem: &ContactProblem<S>, c: &Contact<S>, direction: S::Vector) -> Vec<f64> {
    let mut row = vec![0.0; problem.inverse_masses.len() * S::DOF];
    for (body, arm, sign) in [(c.a, c.arm_a, 1.0), (c.b, c.arm_b, -1.0)] {
        let inverse = &problem.inverse_masses[body];
        let unit = |k: usize| S::Spin::from_fn(|i| if i == k { 1.0 } else { 0.0 });
        let turning = (0..S::SPIN).map(|k| inverse.angular.apply(unit(k))[k]).sum::<f64>() / S::SPIN as f64;
        let moment = S::moment(arm, direction);
        for k in 0..S::DIM {
            row[body * S::DOF + k] += sign * direction[k] * inverse.linear.sqrt();
        }
        for k in 0..S::SPIN {
            row[body * S::DOF + S::DIM + k] += sign * moment[k] * turning.sqrt();
        }
    }
    row
}
