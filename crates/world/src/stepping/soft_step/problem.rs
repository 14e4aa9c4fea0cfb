//! A soft step as rigid contact sees it: the contact problem of the whole step, and the impulses that the springs gave over
//! it, contact by contact. It is made when somebody asks: for contact forces, a certificate, an explanation, the books
//! of groups. Friction of a patch is one wrench; its points share it in proportion to their normal impulses, such that
//! its torque about the normal comes out right where the points can bear it.

use super::face::Face;
use super::patches::rolling_axis;
use crate::assembly;
use crate::bodies::Bodies;
use crate::force::Wrench;
use crate::integrate::Step;
use crate::narrow_phase::Touch;
use carom_geometry::Geometry;
use carom_math::{Column, Inertia};
use carom_solver::soft::{PatchResult, SoftSolver};
use carom_solver::{ContactProblem, FrictionLaw, Impulse, Impulses, InverseMass, Twist};
use std::sync::OnceLock;

/// A problem, its impulses, and the touch of each contact.
pub type Told<'a, S> = (&'a ContactProblem<S>, &'a Impulses<S>, &'a [usize]);

/// What a soft step began with and found.
pub(crate) struct Solution<'a, S: Geometry> {
    /// The solver with its impulses.
    pub solver: &'a SoftSolver<S>,
    /// The faces of its patches.
    pub faces: Vec<Face<S>>,
    /// Velocities at the start.
    pub start: &'a [Twist<S>],
    /// Applied loads.
    pub loads: &'a [Wrench<S>],
}

/// The state at the step's start, and the problem when it has been asked for.
pub struct Rigid<S: Geometry> {
    /// Places at the step's start.
    pub position: Vec<S::Vector>,
    /// Attitudes at the step's start.
    pub rotation: Vec<S::Rotation>,
    /// Bodies that sleep, ascending: what holds them is not in the problem.
    asleep: Vec<u32>,
    gravity: S::Vector,
    dt: f64,
    made: OnceLock<(ContactProblem<S>, Impulses<S>, Vec<usize>)>,
}

impl<S: Geometry> Default for Rigid<S> {
    fn default() -> Self {
        let (position, rotation) = Default::default();
        let (asleep, made) = Default::default();
        Rigid { position, rotation, asleep, gravity: S::Vector::ZERO, dt: 0.0, made }
    }
}

impl<S: Geometry> Rigid<S> {
    /// Keeps what the problem will be made of and the step changes; poses of fixed bodies are there.
    pub fn begin(&mut self, bodies: &Bodies<S>, step: &Step<S>) {
        self.made = OnceLock::new();
        (self.dt, self.gravity) = (step.dt, step.gravity);
        for i in bodies.movers().iter().map(|i| *i as usize) {
            self.position[i] = bodies.motion.position[i];
            self.rotation[i] = bodies.motion.rotation[i];
        }
    }

    /// Takes in who sleeps, and where.
    pub fn let_sleep(&mut self, bodies: &Bodies<S>) {
        self.asleep.clear();
        self.asleep.extend_from_slice(bodies.asleep());
        for i in bodies.asleep().iter().map(|i| *i as usize) {
            self.position[i] = bodies.motion.position[i];
            self.rotation[i] = bodies.motion.rotation[i];
        }
    }

    /// Inverse mass of a body at the step's start, and its velocity after the loads alone.
    fn free(&self, bodies: &Bodies<S>, i: usize, found: &Solution<'_, S>) -> (InverseMass<S>, Twist<S>) {
        let d = &bodies.data[i];
        let angular: S::Inertia = S::turned(&d.inverse_inertia, &self.rotation[i]);
        let inverse: InverseMass<S> = InverseMass { linear: d.inverse_mass, angular };
        let load = &found.loads[i];
        let mut v = found.start[i];
        if bodies.is_dynamic(i) && self.asleep.binary_search(&(i as u32)).is_err() {
            v.linear += (self.gravity + load.force * inverse.linear) * self.dt;
            v.angular += inverse.angular.apply(load.torque) * self.dt;
        }
        (inverse, v)
    }

    /// The problem and its impulses.
    pub(crate) fn get<'a>(&self, bodies: &Bodies<S>, found: impl FnOnce() -> Solution<'a, S>) -> Told<'_, S> {
        let (problem, impulses, pressed) = self.made.get_or_init(|| self.make(bodies, &found()));
        (problem, impulses, pressed)
    }

    fn make(
        &self,
        bodies: &Bodies<S>,
        found: &Solution<'_, S>,
    ) -> (ContactProblem<S>, Impulses<S>, Vec<usize>) {
        let mut problem = ContactProblem::new(Vec::new(), Vec::new());
        assembly::begin(&mut problem, bodies, FrictionLaw::Disc);
        let free = (0..bodies.len()).map(|i| self.free(bodies, i, found));
        (problem.inverse_masses, problem.velocities) = free.unzip();
        let mut pressed = Vec::new();
        let mut told = Vec::new();
        for (k, face) in found.faces.iter().enumerate() {
            let result = found.solver.result(k);
            let shared = shares(face, &result);
            for (i, impulse) in shared.iter().enumerate() {
                let t = &face.touch(i);
                let mut contact = assembly::contact(bodies, t, (-t.gap / self.dt).min(0.0));
                contact.arm_a = t.point - self.position[t.a];
                contact.arm_b = t.point - self.position[t.b];
                let moment = if i == 0 { moment(t, &result, shared.len()) } else { S::Spin::ZERO };
                told.push((*impulse, contact.moment_to_frame(moment)));
                problem.contacts.push(contact);
                pressed.push(pressed.len());
                assembly::resist(&mut problem, t);
            }
        }
        let mut impulses = Impulses::zero(&problem);
        for (to, (impulse, _)) in impulses.contacts.iter_mut().zip(&told) {
            *to = *impulse;
        }
        for (r, to) in problem.resistances.iter().zip(&mut impulses.moments) {
            *to = told[r.contact].1;
        }
        (problem, impulses, pressed)
    }
}

/// Each point's impulse over the step.
fn shares<S: Geometry>(face: &Face<S>, result: &PatchResult<S>) -> Vec<Impulse<S>> {
    let n = face.len();
    let sum: f64 = (0..n).map(|i| f64::from(result.normal[i])).sum();
    let share = |i: usize| if sum > 0.0 { f64::from(result.normal[i]) / sum } else { 1.0 / n as f64 };
    let frame = |k: usize| S::tangent(face.spots.normal, k);
    let mut centre = S::Vector::ZERO;
    let mut middle = S::Vector::ZERO;
    for i in 0..n {
        centre += face.spots.points[i] * share(i);
        middle += face.spots.points[i] * (1.0 / n as f64);
    }
    let mut rub = S::Slip::ZERO;
    for k in 0..S::SLIP {
        rub[k] = f64::from(result.rubbing[k]);
    }
    // places along the tangents, from the centre of pressure
    let place = |point: S::Vector| S::Slip::from_fn(|k| (point - centre).dot(frame(k)));
    let spread: f64 = (0..n).map(|i| share(i) * place(face.spots.points[i]).norm_squared()).sum();
    let mut twist = 0.0;
    if S::SPIN > S::SLIP && spread > 0.0 {
        // friction acts at the middle of the points: its torque about the centre of pressure
        let off = place(middle);
        twist = f64::from(result.rubbing[S::SLIP]) + off[0] * rub[1] - off[1] * rub[0];
    }
    let impulse = |i: usize| {
        let at = place(face.spots.points[i]);
        let tangent = S::Slip::from_fn(|k| {
            let turned = if twist == 0.0 { 0.0 } else { [-at[1], at[0]][k] * twist / spread };
            share(i) * (rub[k] + turned)
        });
        Impulse { normal: f64::from(result.normal[i]), tangent }
    };
    (0..n).map(impulse).collect()
}

/// Moment that the first contact of a patch bears: rolling friction, and of a single point its spinning friction.
fn moment<S: Geometry>(t: &Touch<S>, result: &PatchResult<S>, points: usize) -> S::Spin {
    let mut world = S::Spin::ZERO;
    for k in 0..S::SLIP {
        world += rolling_axis::<S>(t.normal, k) * f64::from(result.rolling[k]);
    }
    if S::SPIN > S::SLIP && points == 1 {
        let spin = f64::from(result.rubbing[S::SLIP]);
        world += S::Spin::from_fn(|c| t.normal[c] * spin);
    }
    world
}
