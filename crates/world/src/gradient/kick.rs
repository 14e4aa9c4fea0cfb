//! The kick on a known active set, and its adjoint by the implicit function theorem (theory eqs. 10.1 to 10.3).
//! Unknowns are the velocities y after the kick and the impulses of held contacts: the whole vector P where a contact
//! sticks, its normal part p where it slips, P = p (n - mu s), s = U_t/|U_t|. Equations, U = u(y) + kappa u-:
//!   M (y - v-) - tau f - J^T P = 0,   stick: U = t n,   else: n.U = t,   t = -epsilon n.u- .
//! A flow on mean velocities has kappa 1, epsilon 0; friction against the end kappa 0, epsilon 1; an impact tau 0,
//! kappa 0, epsilon e. Directions are those at the kick's poses, which a flow's own y moves: x = x0 + tau (v- + y)/4.

use super::dual::{Column3, Dual};
use super::holding::Hold;
use super::least::Transposed;
use super::lift;
use super::touching::{SpotSlopes, cross, dot};
use carom_geometry::Geometry;

/// A body at the kick; columns of three, velocity first.
#[derive(Clone, Debug)]
pub struct Member {
    /// Velocity and spin before.
    pub before: [f64; 6],
    /// Velocity and spin after.
    pub after: [f64; 6],
    /// Centre of mass.
    pub place: [f64; 3],
    /// Mass; `None` for an obstacle.
    pub mass: Option<f64>,
    /// Inertia in world axes; `None` where nothing turns it.
    pub inertia: Option<[[f64; 3]; 3]>,
    /// Force and torque.
    pub load: [f64; 6],
}

/// A contact that holds.
pub struct Held {
    /// Its number in the problem.
    pub contact: usize,
    /// Members.
    pub a: usize,
    /// Members.
    pub b: usize,
    /// How it holds; not open.
    pub hold: Hold,
    /// Unit normal.
    pub normal: [f64; 3],
    /// The common point.
    pub point: [f64; 3],
    /// How both change.
    pub slopes: SpotSlopes,
    /// Impulse on a, world axes; of slipping contacts the normal part alone is read.
    pub impulse: [f64; 3],
    /// Normal impulse.
    pub press: f64,
    /// Coefficient of friction.
    pub friction: f64,
    /// epsilon.
    pub bounce: f64,
}

/// What a kick is.
pub struct Kick {
    members: Vec<Member>,
    held: Vec<Held>,
    /// Derivatives of each contact's equations and of its impulse.
    local: Vec<Vec<Local>>,
    /// First unknown of each member and of each contact; obstacles have none.
    slots: Vec<Option<usize>>,
    firsts: Vec<usize>,
    time: f64,
    gravity: [f64; 3],
    factor: Transposed,
    ways: &'static [usize],
    turns: &'static [usize],
    size: usize,
}

/// Cotangents of what a kick was given.
#[derive(Clone, Debug, Default)]
pub struct Pulled {
    /// Velocities before, and those of obstacles.
    pub before: Vec<[f64; 6]>,
    /// Poses at the kick: place, turn.
    pub pose: Vec<[f64; 6]>,
    /// Its time.
    pub time: f64,
    /// Masses, inertias apart.
    pub mass: Vec<f64>,
    /// A factor on each inertia.
    pub inertia: Vec<f64>,
    /// Force and torque.
    pub load: Vec<[f64; 6]>,
    /// Gravity.
    pub gravity: [f64; 3],
    /// Of each held contact: its number, friction, epsilon.
    pub contacts: Vec<(usize, f64, f64)>,
}

/// Derivative along one input of a contact.
#[derive(Clone, Copy, Debug, Default)]
struct Local {
    equations: [f64; 3],
    force: [f64; 3],
    torque_a: [f64; 3],
    torque_b: [f64; 3],
}

/// Inputs of a contact: after, before, pose of a; the same of b; impulse; friction; epsilon.
const SIDE: usize = 18;
const IMPULSE: usize = 36;
const FRICTION: usize = 39;
const BOUNCE: usize = 40;
const INPUTS: usize = 41;

impl Kick {
    /// A kick of a time \[s\] with kappa; `carried` is how far a velocity after moves the place of the kick \[s\].
    pub fn of<S: Geometry>(
        members: Vec<Member>,
        held: Vec<Held>,
        (time, kappa, carried): (f64, f64, f64),
        gravity: [f64; 3],
    ) -> Self {
        let (ways, turns) = (lift::ways::<S>(), lift::turns::<S>());
        let mut size = 0;
        let mut take = |n: usize| {
            size += n;
            size - n
        };
        let slots: Vec<Option<usize>> = members.iter().map(|m| m.mass.map(|_| take(S::DOF))).collect();
        let width = |h: &Held| if h.hold == Hold::Stick { S::DIM } else { 1 };
        let firsts: Vec<usize> = held.iter().map(|h| take(width(h))).collect();
        let local = held.iter().map(|h| locals(h, &members, kappa)).collect();
        let factor = Transposed::of(Vec::new());
        let mut kick = Kick { members, held, local, slots, firsts, time, gravity, factor, ways, turns, size };
        kick.factor = Transposed::of(kick.matrix(carried));
        kick
    }

    /// Derivatives of the equations by the unknowns, row by row.
    fn matrix(&self, carried: f64) -> Vec<Vec<f64>> {
        let mut f = vec![vec![0.0; self.size]; self.size];
        let dim = self.ways.len();
        for (m, slot) in self.members.iter().zip(&self.slots) {
            let (Some(first), Some(mass)) = (slot, m.mass) else { continue };
            (0..dim).for_each(|k| f[first + k][first + k] = mass);
            for (i, &row) in self.turns.iter().enumerate() {
                for (j, &column) in self.turns.iter().enumerate() {
                    let unit = if i == j { 1.0 } else { 0.0 };
                    f[first + dim + i][first + dim + j] = m.inertia.map_or(unit, |t| t[row][column]);
                }
            }
        }
        for (c, held) in self.held.iter().enumerate() {
            for (side, member) in [(0, held.a), (SIDE, held.b)] {
                let Some(first) = self.slots[member] else { continue };
                for (k, &axis) in self.ways.iter().enumerate() {
                    self.scatter(c, side + axis, 1.0, first + k, &mut f);
                    self.scatter(c, side + 12 + axis, carried, first + k, &mut f);
                }
                for (k, &axis) in self.turns.iter().enumerate() {
                    self.scatter(c, side + 3 + axis, 1.0, first + dim + k, &mut f);
                }
            }
            for k in 0..self.width(c) {
                let input = IMPULSE + if held.hold == Hold::Stick { self.ways[k] } else { 0 };
                self.scatter(c, input, 1.0, self.firsts[c] + k, &mut f);
            }
        }
        f
    }

    fn width(&self, c: usize) -> usize {
        if self.held[c].hold == Hold::Stick { self.ways.len() } else { 1 }
    }

    /// Adds a contact's derivative along one of its inputs to a column.
    fn scatter(&self, c: usize, input: usize, factor: f64, column: usize, f: &mut [Vec<f64>]) {
        let (held, d) = (&self.held[c], &self.local[c][input]);
        for k in 0..self.width(c) {
            let axis = if held.hold == Hold::Stick { self.ways[k] } else { 0 };
            f[self.firsts[c] + k][column] += factor * d.equations[axis];
        }
        for (member, sign, torque) in [(held.a, -1.0, d.torque_a), (held.b, 1.0, d.torque_b)] {
            let Some(first) = self.slots[member] else { continue };
            for (k, &axis) in self.ways.iter().enumerate() {
                f[first + k][column] += factor * sign * d.force[axis];
            }
            if self.members[member].inertia.is_some() {
                for (k, &axis) in self.turns.iter().enumerate() {
                    f[first + self.ways.len() + k][column] -= factor * torque[axis];
                }
            }
        }
    }

    /// Takes cotangents of the velocities after to those of everything the kick was given.
    pub fn pull(&self, after: &[[f64; 6]]) -> Pulled {
        let dim = self.ways.len();
        let mut right = vec![0.0; self.size];
        for (bar, first) in after.iter().zip(&self.slots).filter_map(|(bar, s)| s.map(|s| (bar, s))) {
            (0..dim).for_each(|k| right[first + k] = bar[self.ways[k]]);
            self.turns.iter().enumerate().for_each(|(k, &axis)| right[first + dim + k] = bar[3 + axis]);
        }
        let adjoint = self.factor.solve(&right);
        let count = self.members.len();
        let mut pulled = Pulled {
            before: vec![[0.0; 6]; count],
            pose: vec![[0.0; 6]; count],
            mass: vec![0.0; count],
            inertia: vec![0.0; count],
            load: vec![[0.0; 6]; count],
            ..Pulled::default()
        };
        let multipliers: Vec<[f64; 6]> = self.slots.iter().map(|s| self.multiplier(&adjoint, *s)).collect();
        for (i, l) in multipliers.iter().enumerate() {
            self.pull_member(i, l, &mut pulled);
        }
        for c in 0..self.held.len() {
            self.pull_contact(c, &adjoint, &multipliers, &mut pulled);
        }
        pulled
    }

    fn multiplier(&self, adjoint: &[f64], slot: Option<usize>) -> [f64; 6] {
        let mut out = [0.0; 6];
        let Some(first) = slot else { return out };
        self.ways.iter().enumerate().for_each(|(k, &axis)| out[axis] = adjoint[first + k]);
        let dim = self.ways.len();
        self.turns.iter().enumerate().for_each(|(k, &axis)| out[3 + axis] = adjoint[first + dim + k]);
        out
    }

    /// The momentum equations of a member.
    fn pull_member(&self, i: usize, l: &[f64; 6], pulled: &mut Pulled) {
        let m = &self.members[i];
        let Some(mass) = m.mass else { return };
        let (linear, angular) = ([l[0], l[1], l[2]], [l[3], l[4], l[5]]);
        let gained = |k: usize| m.after[k] - m.before[k] - self.time * self.gravity[k];
        for (k, l) in linear.into_iter().enumerate() {
            pulled.before[i][k] += mass * l;
            pulled.mass[i] -= gained(k) * l;
            pulled.time += (mass * self.gravity[k] + m.load[k]) * l;
            pulled.gravity[k] += mass * self.time * l;
            pulled.load[i][k] += self.time * l;
        }
        let Some(inertia) = &m.inertia else {
            (0..3).for_each(|k| pulled.before[i][3 + k] += angular[k]);
            return;
        };
        let times = |v: [f64; 3]| inertia.map(|row| dot(row, v));
        let change: [f64; 3] = std::array::from_fn(|k| m.after[3 + k] - m.before[3 + k]);
        let (momentum, turned) = (times(change), times(angular));
        for k in 0..3 {
            pulled.before[i][3 + k] += turned[k];
            pulled.time += m.load[3 + k] * angular[k];
            pulled.load[i][3 + k] += self.time * angular[k];
        }
        pulled.inertia[i] -= dot(momentum, angular);
        // d(I c) = phi x (I c) - I (phi x c)
        let one = cross(momentum, angular);
        let other = cross(change, turned);
        (0..3).for_each(|k| pulled.pose[i][3 + k] -= one[k] - other[k]);
    }

    /// A contact's equations and its impulse in the momentum equations.
    fn pull_contact(&self, c: usize, adjoint: &[f64], multipliers: &[[f64; 6]], pulled: &mut Pulled) {
        let held = &self.held[c];
        let (la, lb) = (&multipliers[held.a], &multipliers[held.b]);
        let turns = |m: usize| if self.members[m].inertia.is_some() { 1.0 } else { 0.0 };
        let (turn_a, turn_b) = (turns(held.a), turns(held.b));
        let along = |d: &Local| -> f64 {
            let mut sum = 0.0;
            for k in 0..self.width(c) {
                let axis = if held.hold == Hold::Stick { self.ways[k] } else { 0 };
                sum += adjoint[self.firsts[c] + k] * d.equations[axis];
            }
            for k in 0..3 {
                sum += (lb[k] - la[k]) * d.force[k];
                sum -= turn_a * la[3 + k] * d.torque_a[k] + turn_b * lb[3 + k] * d.torque_b[k];
            }
            -sum
        };
        for (side, member) in [(0, held.a), (SIDE, held.b)] {
            for k in 0..6 {
                pulled.before[member][k] += along(&self.local[c][side + 6 + k]);
                pulled.pose[member][k] += along(&self.local[c][side + 12 + k]);
                if self.slots[member].is_none() {
                    // an obstacle has one velocity, before and after
                    pulled.before[member][k] += along(&self.local[c][side + k]);
                }
            }
        }
        let friction = along(&self.local[c][FRICTION]);
        pulled.contacts.push((held.contact, friction, along(&self.local[c][BOUNCE])));
    }
}

/// Derivatives of a contact along all of its inputs.
fn locals(held: &Held, members: &[Member], kappa: f64) -> Vec<Local> {
    (0..INPUTS).map(|input| local(held, members, kappa, input)).collect()
}

fn local(held: &Held, members: &[Member], kappa: f64, input: usize) -> Local {
    let on =
        |first: usize| -> [f64; 3] { std::array::from_fn(|k| if input == first + k { 1.0 } else { 0.0 }) };
    let column = |v: &[f64], first: usize| Column3::new([v[0], v[1], v[2]], on(first));
    let moved = match input {
        12..18 => Some(input - 12),
        30..36 => Some(input - 24),
        _ => None,
    };
    let spot = moved.map(|k| held.slopes[k]).unwrap_or_default();
    let normal = Column3::new(held.normal, spot.normal);
    let point = Column3::new(held.point, spot.point);
    let (a, b) = (&members[held.a], &members[held.b]);
    let arm_a = point - column(&a.place, 12);
    let arm_b = point - column(&b.place, SIDE + 12);
    let swept = |v: &[f64; 6], first: usize, arm: Column3| {
        column(&v[..3], first) + column(&v[3..], first + 3).cross(arm)
    };
    let before = swept(&a.before, 6, arm_a) - swept(&b.before, SIDE + 6, arm_b);
    let after = swept(&a.after, 0, arm_a) - swept(&b.after, SIDE, arm_b);
    let against = after + before.times(Dual::fixed(kappa));
    let one = |value: f64, at: usize| Dual::new(value, if input == at { 1.0 } else { 0.0 });
    let target = -(one(held.bounce, BOUNCE) * normal.dot(before));
    let (force, equations) = match held.hold {
        Hold::Stick => (column(&held.impulse, IMPULSE), (against - normal.times(target)).slope()),
        _ => {
            let press = one(held.press, IMPULSE);
            let mut direction = normal;
            if held.hold == Hold::Slip {
                let slip = against - normal.times(normal.dot(against));
                let rate = one(held.friction, FRICTION) / slip.dot(slip).sqrt();
                direction = normal - slip.times(rate);
            }
            (direction.times(press), [(normal.dot(against) - target).slope, 0.0, 0.0])
        }
    };
    let minus = Column3::default() - arm_b;
    let (torque_a, torque_b) = (arm_a.cross(force).slope(), minus.cross(force).slope());
    Local { equations, force: force.slope(), torque_a, torque_b }
}
