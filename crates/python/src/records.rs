//! Contacts and steps as packed records that numpy reads as structured arrays without a copy. Each layout is
//! stated once, beside the function that writes it.

use carom::observe::push::pushes;
use carom::{Column, Geometry, Ledger, Space, StepReport, Stop, Twist, World, Wrench};

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
        ("friction", "f8", 0),
        ("impact_impulse", "f8", S::DIM),
        ("kick_normal", "f8", S::DIM),
        ("kick_arm", "f8", S::DIM),
        ("moment", "f8", S::SPIN),
    ]
}

/// Appends the contacts of the world's last step; returns how many. Impulses of impact and of persistent contact
/// are added up; they act on a, and against b. Slip is the velocity of a's point against b's across the normal,
/// after the step's impulses.
pub fn append_contacts<S: Geometry>(world: &World<S>, out: &mut Records) -> usize {
    for (t, push) in world.touches().iter().zip(pushes(world)) {
        out.i4(t.a);
        out.i4(t.b);
        out.u8(t.id);
        out.all(t.point.as_slice());
        out.all(t.normal.as_slice());
        out.f8(t.gap);
        out.f8(push.total.normal);
        out.all(push.friction(t).as_slice());
        out.all(push.slip.as_slice());
        out.u1(push.status(t) as u8);
        out.f8(t.friction);
        out.all(push.impact.as_slice());
        out.all(push.kick_normal.as_slice());
        out.all(push.kick_arm.as_slice());
        out.all(push.moment.as_slice());
    }
    world.touches().len()
}

/// Columns of an action: what moved a body in a step besides gravity, damping and contacts.
pub fn action_fields<S: Space>() -> Vec<Field> {
    vec![
        ("body", "i4", 0),
        ("force", "f8", S::DIM),
        ("torque", "f8", S::SPIN),
        ("correction", "f8", S::DIM),
        ("correction_turn", "f8", S::SPIN),
    ]
}

/// Appends the loads and corrections of the world's last step, of bodies that had any; returns how many.
pub fn append_actions<S: Geometry>(world: &World<S>, out: &mut Records) -> usize {
    let mut count = 0;
    for i in (0..world.bodies().len()).filter(|&i| world.bodies().is_dynamic(i)) {
        let load = world.last_loads().get(i).copied().unwrap_or_default();
        let moved = world.last_correction().get(i).copied().unwrap_or_default();
        if load == Wrench::default() && moved == Twist::default() {
            continue;
        }
        out.i4(i);
        out.all(load.force.as_slice());
        out.all(load.torque.as_slice());
        out.all(moved.linear.as_slice());
        out.all(moved.angular.as_slice());
        count += 1;
    }
    count
}

/// Columns of what a contact did in a flow or a round of impacts.
pub fn event_fields<S: Space>() -> Vec<Field> {
    vec![
        ("act", "i4", 0),
        ("kind", "u1", 0),
        ("time", "f8", 0),
        ("length", "f8", 0),
        ("a", "i4", 0),
        ("b", "i4", 0),
        ("id", "u8", 0),
        ("point", "f8", S::DIM),
        ("normal", "f8", S::DIM),
        ("arm_a", "f8", S::DIM),
        ("arm_b", "f8", S::DIM),
        ("gap", "f8", 0),
        ("impulse", "f8", S::DIM),
        ("moment", "f8", S::SPIN),
        ("friction", "f8", 0),
        ("restitution", "f8", 0),
        ("tangential_restitution", "f8", 0),
    ]
}

/// Appends what the contacts did in the world's last step, act by act; returns how many records.
pub fn append_events<S: Geometry>(world: &World<S>, out: &mut Records) -> usize {
    let Some(log) = world.last_events() else { return 0 };
    for r in &log.contacts {
        out.i4(r.act);
        out.u1(r.kind.code());
        out.all(&[r.time, r.length]);
        out.i4(r.a);
        out.i4(r.b);
        out.u8(r.id);
        out.all(r.point.as_slice());
        out.all(r.normal.as_slice());
        out.all(r.arm_a.as_slice());
        out.all(r.arm_b.as_slice());
        out.f8(r.gap);
        out.all(r.impulse.as_slice());
        out.all(r.moment.as_slice());
        out.all(&[r.friction, r.restitution, r.tangential_restitution]);
    }
    log.contacts.len()
}

/// Columns of a piece of a body's way through a step.
pub fn piece_fields<S: Space>() -> Vec<Field> {
    vec![
        ("act", "i4", 0),
        ("kind", "u1", 0),
        ("body", "i4", 0),
        ("time", "f8", 0),
        ("length", "f8", 0),
        ("shift", "f8", S::DIM),
        ("turn", "f8", S::SPIN),
        ("impulse", "f8", S::DIM),
        ("moment", "f8", S::SPIN),
    ]
}

/// Appends the pieces of the bodies' ways through the world's last step; returns how many.
pub fn append_pieces<S: Geometry>(world: &World<S>, out: &mut Records) -> usize {
    let Some(log) = world.last_events() else { return 0 };
    for p in &log.pieces {
        out.i4(p.act);
        out.u1(p.kind.code());
        out.i4(p.body);
        out.all(&[p.time, p.length]);
        out.all(p.shift.as_slice());
        out.all(p.turn.as_slice());
        out.all(p.impulse.as_slice());
        out.all(p.moment.as_slice());
    }
    log.pieces.len()
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
        ("guarded", "i4", 0),
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
pub const STOPS: [&str; 3] = ["converged", "out_of_iterations", "out_of_factorisations"];

/// The code of a step: the largest of its solves. A refused solve makes no report.
pub fn stop_code<S: Space>(report: &StepReport<S>) -> u8 {
    let solves = report.contact_solve.iter().chain(&report.impact_solve);
    let code = |stop: &Stop| STOPS.iter().position(|name| *name == stop.name()).unwrap_or(0) as u8;
    solves.map(|s| code(&s.stop)).max().unwrap_or(0)
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
    out.i4(report.impacts.guarded);
    out.f8(report.deepest.map_or(f64::NAN, |(gap, _, _)| gap));
    out.f8(report.energy.kinetic());
    out.f8(report.energy.potential);
    out.all(report.momenta.linear.as_slice());
    out.all(report.momenta.angular.as_slice());
    out.all(&report.ledger.lines());
}
