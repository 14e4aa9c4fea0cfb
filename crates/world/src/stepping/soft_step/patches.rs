//! Patches of faces, about the mean of their points, with the forces that they had; and back: what is remembered of a step.

use super::SoftStep;
use super::face::{Face, NONE};
use super::memory::{PatchForce, Seen};
use super::motion::narrow;
use crate::bodies::Bodies;
use crate::warm_start::WarmStart;
use carom_geometry::Geometry;
use carom_math::{Column, Rotation, Several};
use carom_solver::soft::{Patch, PatchPoint, PatchResult, SoftChoice};

/// A face's patch without impulses; its records are not known yet.
#[inline]
pub(super) fn patch_of<S: Geometry>(bodies: &Bodies<S>, face: &Face<S>) -> Patch<S> {
    let (n, normal, centre) = (face.len(), face.normal, face.centre());
    let mut tangents = [normal; 2];
    for (k, tangent) in tangents.iter_mut().enumerate().take(S::SLIP) {
        *tangent = S::tangent(normal, k);
    }
    let apart = PatchPoint { place: S::Slips::all(0.0), gap: f32::INFINITY, impulse: 0.0 };
    let mut points: S::Points<PatchPoint<S>> = S::Points::all(apart);
    let mut lever = 0.0;
    for i in 0..n {
        let from_centre = face.points[i] - centre;
        lever += from_centre.norm() / n as f64;
        for (k, tangent) in tangents.iter().enumerate().take(S::SLIP) {
            points[i].place[k] = from_centre.dot(*tangent) as f32;
        }
        points[i].gap = face.gaps[i] as f32;
    }
    let ((a, b), c) = (face.pair(), &face.coefficients);
    Patch {
        a: NONE,
        b: NONE,
        normal: narrow(normal),
        arm_a: narrow(centre - bodies.motion.position[a]),
        arm_b: narrow(centre - bodies.motion.position[b]),
        friction: c.friction as f32,
        rolling: c.rolling as f32,
        twisting: (c.friction * lever + c.spinning) as f32,
        restitution: c.restitution as f32,
        points,
        rubbing: S::Spins::all(0.0),
        rolling_moment: S::Slips::all(0.0),
    }
}

/// Starts a patch whose points are used again from the forces that they had.
pub(super) fn start_again<S: Geometry>(patch: &mut Patch<S>, face: &Face<S>, force: &PatchForce<S>, h: f32) {
    for i in 0..face.len() {
        patch.points[i].impulse = force.normal[i] as f32 * h;
    }
    start_rubbing(patch, face.normal, force, h);
}

/// Starts a patch from the forces that its points had; friction comes from the remembered patch of the first point that is
/// known, unless a face of the same pair took it.
pub(super) fn start_from<S: Geometry>(
    patch: &mut Patch<S>,
    face: &Face<S>,
    others: &[Face<S>],
    before: &[PatchForce<S>],
    h: f32,
) {
    for i in 0..face.len() {
        for force in before {
            if let Some(at) = force.names().iter().position(|x| *x == face.ids[i]) {
                patch.points[i].impulse = force.normal[at] as f32 * h;
            }
        }
    }
    let Some(k) = source(face, before).filter(|k| *k < 64) else { return };
    if !others.iter().any(|other| source(other, before) == Some(k)) {
        start_rubbing(patch, face.normal, &before[k], h);
    }
}

/// The remembered patch of the first point that is known.
fn source<S: Geometry>(face: &Face<S>, before: &[PatchForce<S>]) -> Option<usize> {
    let known = |id: &u64| before.iter().position(|force| force.names().contains(id));
    face.ids.slice()[..face.len()].iter().find_map(known)
}

/// Friction and rolling friction to start from.
#[inline]
fn start_rubbing<S: Geometry>(patch: &mut Patch<S>, normal: S::Vector, force: &PatchForce<S>, h: f32) {
    for m in 0..S::SLIP {
        let tangent = S::tangent(normal, m);
        let along = (0..S::DIM).map(|c| tangent[c] * force.friction[c]).sum::<f64>();
        patch.rubbing[m] = along as f32 * h;
    }
    if patch.rolling > 0.0 {
        for m in 0..S::SLIP {
            let axis = rolling_axis::<S>(normal, m);
            let about = (0..S::SPIN).map(|c| axis[c] * force.rolling[c]).sum::<f64>();
            patch.rolling_moment[m] = about as f32 * h;
        }
    }
    if S::SPIN > S::SLIP {
        patch.rubbing[S::SLIP] = force.twist as f32 * h;
    }
}

/// Axis of the k-th rolling moment of a patch.
pub(super) fn rolling_axis<S: Geometry>(normal: S::Vector, k: usize) -> S::Spin {
    if S::SPIN == 1 {
        S::Spin::from_fn(|_| 1.0)
    } else {
        let tangent = S::tangent(normal, k);
        S::Spin::from_fn(|c| tangent[c])
    }
}

impl<S: Geometry> SoftStep<S> {
    /// Keeps the last substep's impulses as forces.
    pub(super) fn remember(
        &mut self,
        bodies: &Bodies<S>,
        before: &[PatchForce<S>],
        warm: &mut WarmStart<S>,
        choice: &SoftChoice,
    ) {
        warm.clear();
        warm.patches.reserve(self.faces.len());
        let rate = 1.0 / f64::from(choice.h);
        for (k, face) in self.faces.iter().enumerate() {
            let told = self.solver.result(k);
            // a face that bears nothing is kept too: its points are used again
            if face.len() < S::DIM && told.last.slice().iter().all(|x| *x == 0.0) {
                continue;
            }
            match before.get(face.again as usize) {
                Some(known) => warm.patches.push(*known),
                None => warm.patches.push(self.seen_first(bodies, face)),
            }
            if let Some(force) = warm.patches.last_mut() {
                press(force, face, &told, rate);
            }
        }
    }

    /// What is remembered of a face that was found anew.
    fn seen_first(&self, bodies: &Bodies<S>, face: &Face<S>) -> PatchForce<S> {
        let (a, b) = face.pair();
        let (mut points, mut gaps) = (S::Points::all(S::Vector::ZERO), S::Points::all(0.0));
        for i in 0..face.len() {
            (points[i], gaps[i]) = (face.points[i], face.gaps[i]);
        }
        let mut attitudes = [S::Turns::all(0.0); 2];
        for (to, body) in attitudes.iter_mut().zip([a, b]) {
            to.slice_mut().copy_from_slice(self.rigid.rotation[body].as_slice());
        }
        let places = [self.rigid.position[a], self.rigid.position[b]];
        let seen = Seen { normal: face.normal, points, gaps, places, attitudes };
        PatchForce {
            pair: (bodies.data[a].serial, bodies.data[b].serial),
            count: face.len(),
            ids: face.ids,
            normal: S::Points::all(0.0),
            friction: S::Vector::ZERO,
            twist: 0.0,
            rolling: S::Spin::ZERO,
            seen,
        }
    }
}

/// Writes a patch's last impulses as forces.
#[inline]
fn press<S: Geometry>(force: &mut PatchForce<S>, face: &Face<S>, told: &PatchResult<S>, rate: f64) {
    for i in 0..face.len() {
        force.normal[i] = f64::from(told.last[i]) * rate;
    }
    (force.friction, force.rolling) = (S::Vector::ZERO, S::Spin::ZERO);
    for m in 0..S::SLIP {
        let tangent = S::tangent(face.normal, m);
        for c in 0..S::DIM {
            force.friction[c] += tangent[c] * f64::from(told.last_rubbing[m]) * rate;
        }
    }
    let rolls = face.coefficients.rolling > 0.0;
    for m in (0..S::SLIP).filter(|_| rolls) {
        let axis = rolling_axis::<S>(face.normal, m);
        for c in 0..S::SPIN {
            force.rolling[c] += axis[c] * f64::from(told.last_rolling[m]) * rate;
        }
    }
    if S::SPIN > S::SLIP {
        force.twist = f64::from(told.last_rubbing[S::SLIP]) * rate;
    }
}
