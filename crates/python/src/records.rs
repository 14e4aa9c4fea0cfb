//! Contacts and steps as packed records that numpy reads as structured arrays without a copy. Each layout is
//! stated once, beside the function that writes it.

use carom::solver::{Impulse, Twist};
use carom::{Column, ContactSum, Geometry, Ledger, Space, StepReport, Stop, Touch, World, Wrench};

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

/// What a contact did in the last step: codes of its `status`.
pub const CONTACT_STATUS: [&str; 4] = ["apart", "sticks", "slips", "strikes"];

/// Share of its limit from which friction counts as at the limit [1]: projections land there to rounding.
const AT_THE_LIMIT: f64 = 1.0 - 1e-9;

/// What a contact got in the last step: impulses [N s], friction's limit mu gamma_n [N s], slip [m/s].
struct Push<S: Space> {
    total: Impulse<S>,
    strikes: bool,
    friction_size: f64,
    slip: S::Vector,
    /// What of the impulse is the impacts', world axes.
    impact: S::Vector,
    /// Normal, and arm from a's centre of mass, with which the persistent contact acted.
    kick_normal: S::Vector,
    kick_arm: S::Vector,
    /// Rolling and spinning friction on a, world axes, over the whole step.
    moment: S::Spin,
}

/// Velocity of a's point against b's across the normal, from the arms to both.
fn slip<S: Geometry>(world: &World<S>, t: &Touch<S>, arm_a: S::Vector, arm_b: S::Vector) -> S::Vector {
    let motion = &world.bodies().motion;
    let u = motion.twist(t.a).at(arm_a) - motion.twist(t.b).at(arm_b);
    u - t.normal * u.dot(t.normal)
}

/// Sums over a step with events, touch by touch, as its log has them.
fn summed<S: Geometry>(world: &World<S>, sums: &[ContactSum<S>]) -> Vec<Push<S>> {
    let motion = &world.bodies().motion;
    let push = |(t, sum): (&Touch<S>, &ContactSum<S>)| {
        let arm = |i: usize| t.point - motion.position[i];
        let tangent = S::Slip::from_fn(|i| sum.impulse.dot(S::tangent(t.normal, i)));
        Push {
            total: Impulse { normal: sum.impulse.dot(t.normal), tangent },
            strikes: sum.impact != S::Vector::ZERO,
            friction_size: tangent.norm(),
            slip: slip(world, t, arm(t.a), arm(t.b)),
            impact: sum.impact,
            kick_normal: t.normal,
            kick_arm: arm(t.a),
            moment: sum.moment,
        }
    };
    world.touches().iter().zip(sums).map(push).collect()
}

/// Sums impulses of impact and of persistent contact, touch by touch.
fn pushes<S: Geometry>(world: &World<S>) -> Vec<Push<S>> {
    if let Some(sums) = world.last_sums() {
        return summed(world, sums);
    }
    let motion = &world.bodies().motion;
    let across = |t: &Touch<S>, arm_a: S::Vector, arm_b: S::Vector| slip(world, t, arm_a, arm_b);
    let nothing = Impulse { normal: 0.0, tangent: S::Slip::ZERO };
    let strikes = world.last_strikes().iter().copied().chain(std::iter::repeat(nothing));
    let mut all: Vec<Push<S>> = (world.touches().iter().zip(strikes))
        .map(|(t, total)| {
            let arm = |i: usize| t.point - motion.position[i];
            Push {
                total,
                strikes: total.normal > 0.0,
                friction_size: total.tangent.norm(),
                slip: across(t, arm(t.a), arm(t.b)),
                impact: t.normal * total.normal + spread(t, &total),
                kick_normal: t.normal,
                kick_arm: S::Vector::ZERO,
                moment: S::Spin::ZERO,
            }
        })
        .collect();
    for (push, moment) in all.iter_mut().zip(world.last_strike_moments()) {
        push.moment = *moment;
    }
    let (problem, impulses, indices) = world.last_problem();
    for ((&k, contact), impulse) in indices.iter().zip(&problem.contacts).zip(&impulses.contacts) {
        // the kick's frame may have turned since detection: told in the frame of the contact as it was found
        let (t, force) = (&world.touches()[k], contact.to_world(impulse));
        all[k].total.normal += force.dot(t.normal);
        all[k].total.tangent += S::Slip::from_fn(|i| force.dot(S::tangent(t.normal, i)));
        all[k].friction_size += impulse.tangent.norm();
        (all[k].kick_normal, all[k].kick_arm) = (contact.normal, contact.arm_a);
        // the slip that friction was solved against: at the arms of the kick
        all[k].slip = across(&world.touches()[k], contact.arm_a, contact.arm_b);
    }
    for (r, m) in problem.resistances.iter().zip(&impulses.moments) {
        all[indices[r.contact]].moment += problem.contacts[r.contact].moment_to_world(*m);
    }
    all
}

/// The tangential part of an impulse in world axes.
fn spread<S: Geometry>(t: &Touch<S>, impulse: &Impulse<S>) -> S::Vector {
    let mut friction = S::Vector::ZERO;
    for k in 0..S::SLIP {
        friction += S::tangent(t.normal, k) * impulse.tangent[k];
    }
    friction
}

/// Appends the contacts of the world's last step; returns how many. Impulses of impact and of persistent contact
/// are added up; they act on a, and against b. Slip is the velocity of a's point against b's across the normal,
/// after the step's impulses.
pub fn append_contacts<S: Geometry>(world: &World<S>, out: &mut Records) -> usize {
    for (t, push) in world.touches().iter().zip(pushes(world)) {
        let friction = spread(t, &push.total);
        let at_the_limit = push.friction_size >= AT_THE_LIMIT * t.friction * push.total.normal;
        out.i4(t.a);
        out.i4(t.b);
        out.u8(t.id);
        out.all(t.point.as_slice());
        out.all(t.normal.as_slice());
        out.f8(t.gap);
        out.f8(push.total.normal);
        out.all(friction.as_slice());
        out.all(push.slip.as_slice());
        out.u1(match push.total.normal > 0.0 {
            false => 0,
            true if push.strikes => 3,
            true if at_the_limit => 2,
            true => 1,
        });
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
