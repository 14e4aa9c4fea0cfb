//! Contacts and steps as packed records that numpy reads as structured arrays without a copy. Each layout is
//! stated once, beside the function that writes it.

use carom::{Column, Geometry, Ledger, Space, StepReport, Stop, World};

/// A column of a record: name, numpy's code of its type, numbers in it (0: a plain number).
pub type Field = (&'static str, &'static str, usize);

/// Bytes of records, filled in order.
#[derive(Default)]
pub struct Records(pub Vec<u8>);

impl Records {
    fn f8(&mut self, value: f64) {
        self.0.extend_from_slice(&value.to_ne_bytes());
    }
    fn all(&mut self, values: &[f64]) {
        values.iter().for_each(|x| self.f8(*x));
    }
    fn i4(&mut self, value: usize) {
        self.0.extend_from_slice(&i32::try_from(value).unwrap_or(i32::MAX).to_ne_bytes());
    }
    fn u8(&mut self, value: u64) {
        self.0.extend_from_slice(&value.to_ne_bytes());
    }
    fn u1(&mut self, value: u8) {
        self.0.push(value);
    }
    /// Two bodies, -1 and -1 for none.
    fn pair(&mut self, pair: Option<(usize, usize)>) {
        match pair {
            Some((a, b)) => {
                self.i4(a);
                self.i4(b);
            }
            None => self.0.extend_from_slice(&[0xff; 8]),
        }
    }
}

/// Columns of a contact.
pub fn contact_fields<S: Space>() -> Vec<Field> {
    vec![
        ("a", "i4", 0),
        ("b", "i4", 0),
        ("id", "u8", 0),
        ("point", "f8", S::DIM),
        ("normal", "f8", S::DIM),
        ("gap", "f8", 0),
        ("normal_impulse", "f8", 0),
        ("friction_impulse", "f8", S::DIM),
        ("slip", "f8", S::DIM),
        ("status", "u1", 0),
    ]
}

/// What a contact did in the last step: codes of its `status`.
pub const CONTACT_STATUS: [&str; 4] = ["apart", "sticks", "slips", "strikes"];

/// Share of its limit from which friction counts as at the limit [1]: projections land there to rounding.
const AT_THE_LIMIT: f64 = 1.0 - 1e-9;

/// What a contact got in the last step: impulses [N s], friction's limit mu gamma_n [N s].
#[derive(Clone, Copy)]
struct Push<V> {
    normal: f64,
    friction: V,
    friction_size: f64,
    limit: f64,
    slip: Option<V>,
    strikes: bool,
}

/// Appends the contacts of the world's last step; returns how many. Impulses of impact and of persistent contact
/// are added up; they act on a, and against b. Slip is the velocity of a's point against b's across the normal,
/// after the step's impulses.
pub fn append_contacts<S: Geometry>(world: &World<S>, out: &mut Records) -> usize {
    let touches = world.touches();
    let nothing = Push {
        normal: 0.0,
        friction: S::Vector::ZERO,
        friction_size: 0.0,
        limit: 0.0,
        slip: None,
        strikes: false,
    };
    let mut pushes = vec![nothing; touches.len()];
    let now = world.bodies();
    let velocities: Vec<_> = (0..now.len()).map(|i| now.motion.twist(i)).collect();
    for (is_impact, (problem, impulses, indices)) in
        [(true, world.last_impacts()), (false, world.last_problem())]
    {
        for ((&k, contact), impulse) in indices.iter().zip(&problem.contacts).zip(&impulses.contacts) {
            let push = &mut pushes[k];
            let tangential = contact.to_world(impulse) - contact.normal * impulse.normal;
            push.normal += impulse.normal;
            push.friction += tangential;
            push.friction_size += tangential.norm();
            push.limit += contact.friction * impulse.normal;
            push.strikes |= is_impact && impulse.normal > 0.0;
            if !is_impact {
                let u = velocities[contact.a].at(contact.arm_a) - velocities[contact.b].at(contact.arm_b);
                push.slip = Some(u - contact.normal * u.dot(contact.normal));
            }
        }
    }
    for (t, push) in touches.iter().zip(&pushes) {
        let arm = |i: usize| t.point - now.motion.position[i];
        let slip = push.slip.unwrap_or_else(|| {
            let u = velocities[t.a].at(arm(t.a)) - velocities[t.b].at(arm(t.b));
            u - t.normal * u.dot(t.normal)
        });
        out.i4(t.a);
        out.i4(t.b);
        out.u8(t.id);
        out.all(t.point.as_slice());
        out.all(t.normal.as_slice());
        out.f8(t.gap);
        out.f8(push.normal);
        out.all(push.friction.as_slice());
        out.all(slip.as_slice());
        out.u1(match push.normal > 0.0 {
            false => 0,
            true if push.strikes => 3,
            true if push.friction_size >= AT_THE_LIMIT * push.limit => 2,
            true => 1,
        });
    }
    touches.len()
}

/// Columns of a step.
pub fn step_fields<S: Space>() -> Vec<Field> {
    let spin = if S::SPIN == 1 { 0 } else { S::SPIN };
    let mut fields = vec![
        ("time", "f8", 0),
        ("dt", "f8", 0),
        ("residual", "f8", 0),
        ("relative_residual", "f8", 0),
        ("impact_residual", "f8", 0),
        ("worst_a", "i4", 0),
        ("worst_b", "i4", 0),
        ("deepest_a", "i4", 0),
        ("deepest_b", "i4", 0),
        ("iterations", "i4", 0),
        ("contacts", "i4", 0),
        ("stop", "u1", 0),
        ("deepest_gap", "f8", 0),
        ("kinetic", "f8", 0),
        ("potential", "f8", 0),
        ("momentum", "f8", S::DIM),
        ("angular_momentum", "f8", spin),
    ];
    fields.extend(Ledger::NAMES.map(|name| (name, "f8", 0)));
    fields
}

/// Why the solvers of a step stopped: codes of its `stop`.
pub const STOPS: [&str; 2] = ["converged", "out_of_iterations"];

/// The code of a step: 0 when every solve reached its tolerance. A refused solve makes no report.
pub fn stop_code<S: Space>(report: &StepReport<S>) -> u8 {
    let out =
        report.contact_solve.iter().chain(&report.impact_solve).any(|s| s.stop == Stop::OutOfIterations);
    u8::from(out)
}

/// Residual of the step's impacts \[m/s\], 0 without any.
pub fn impact_residual<S: Space>(report: &StepReport<S>) -> f64 {
    report.impact_solve.as_ref().map_or(0.0, |s| s.residual)
}

/// Appends a step.
pub fn append_step<S: Space>(report: &StepReport<S>, out: &mut Records) {
    out.all(&[
        report.time,
        report.dt,
        report.residual(),
        report.relative_residual(),
        impact_residual(report),
    ]);
    out.pair(report.worst());
    out.pair(report.deepest.map(|(_, a, b)| (a, b)));
    out.i4(report.iterations());
    out.i4(report.contacts);
    out.u1(stop_code(report));
    out.f8(report.deepest.map_or(f64::NAN, |(gap, _, _)| gap));
    out.f8(report.energy.kinetic());
    out.f8(report.energy.potential);
    out.all(report.momenta.linear.as_slice());
    out.all(report.momenta.angular.as_slice());
    out.all(&report.ledger.lines());
}
