//! Patches of faces, about the mean of their points, with the forces that they had; and back: what is remembered of a step.

use super::SoftStep;
use super::face::{Face, Laid, Outline};
use super::memory::{PatchForce, Seen};
use crate::material::Coefficients;
use crate::warm_start::WarmStart;
use carom_geometry::Geometry;
use carom_math::wide::{inner, minus};
use carom_math::{Column, Precise, Several};
use carom_solver::soft::{APART, Last, Numbers, Rare, SoftChoice};
use std::ops::Range;
use std::sync::Arc;

/// What patches start from.
pub(super) struct Begun<S: Geometry, R: Precise> {
    /// Normal forces of their points \[N\].
    pub normal: S::Points<R>,
    /// Friction on bodies a in world axes \[N\], and its torque about the normal \[N m\]; none where no patch has any.
    pub rubbing: Option<(S::Vectors<R>, R)>,
}

/// Writes patches with what they start from, but for their coefficients; tells their levers of friction about the normal \[m\].
#[inline(always)]
pub(super) fn write_patches<S: Geometry, R: Precise>(
    to: &mut impl Numbers<S, Number = R::Narrow>,
    (outline, laid): (&Outline<S, R>, &Laid<S, R>),
    places: [S::Vectors<R>; 2],
    begun: &Begun<S, R>,
    h: f32,
) -> R {
    let (zero, h) = (outline.count.constant(0.0), outline.count.constant(h));
    let apart = outline.count.constant(APART);
    let (arm_a, arm_b) = (minus(&laid.centre, &places[0]), minus(&laid.centre, &places[1]));
    to.set_place(narrowed(&laid.normal), narrowed(&arm_a), narrowed(&arm_b));
    let mut lever = zero;
    for i in 0..S::Points::<f64>::LEN {
        let mut place = laid.places[i];
        for k in 0..S::SLIP {
            place[k] = outline.where_has(i, place[k].rounded(), zero);
        }
        // points lie across the normal
        if S::SPIN > S::SLIP {
            let mut square = (place[0] * place[0]).rounded();
            for k in 1..S::SLIP {
                square = (square + (place[k] * place[k]).rounded()).rounded();
            }
            lever = (lever + square.root().rounded()).rounded();
        }
        let gap = outline.where_has(i, laid.gaps[i].choose(apart, laid.gaps[i], apart), apart);
        to.set_point(i, narrowed(&place), gap.narrow());
        to.press(i, outline.where_has(i, begun.normal[i].rounded() * h, zero).narrow());
    }
    if let Some((friction, twist)) = &begun.rubbing {
        for k in 0..S::SLIP {
            to.rub(k, (inner(&laid.tangents[k], friction).rounded() * h).narrow());
        }
        if S::SPIN > S::SLIP {
            to.rub(S::SLIP, (twist.rounded() * h).narrow());
        }
    }
    (lever / outline.count).rounded()
}

/// Numbers in f32.
#[inline(always)]
fn narrowed<R: Precise, A: Several<R>, B: Several<R::Narrow>>(numbers: &A) -> B {
    let mut out = B::all(numbers[0].narrow());
    for k in 1..A::LEN {
        out[k] = numbers[k].narrow();
    }
    out
}

/// What a patch needs and few do.
#[inline]
pub(super) fn rare_of<S: Geometry>(
    normal: S::Vector,
    c: &Coefficients,
    rubbing: Option<&PatchForce<S>>,
    h: f32,
) -> Rare<S> {
    let mut rare: Rare<S> =
        Rare { restitution: c.restitution as f32, rolling: c.rolling as f32, ..Rare::none() };
    if let Some(force) = rubbing.filter(|_| rare.rolling > 0.0) {
        for m in 0..S::SLIP {
            let axis = rolling_axis::<S>(normal, m);
            let about = (0..S::SPIN).map(|c| axis[c] * force.rolling[c]).sum::<f64>();
            rare.rolling_moment[m] = about as f32 * h;
        }
    }
    rare
}

/// The patches that a pair had in the step before, with their forces.
#[derive(Clone, Copy)]
pub(super) struct Known<'a, S: Geometry> {
    pub seen: &'a [Seen<S>],
    pub forces: &'a [PatchForce<S>],
}

impl<'a, S: Geometry> Known<'a, S> {
    /// Normal force of a point by its name \[N\]; 0 where it is new.
    pub fn normal(&self, name: u64) -> f64 {
        let at = |seen: &Seen<S>| seen.names().iter().position(|x| *x == name);
        let all = self.seen.iter().zip(self.forces);
        all.filter_map(|(seen, force)| at(seen).map(|at| force.normal[at])).last().unwrap_or(0.0)
    }

    /// Whose friction a new patch starts from: that of the first of its points that is known, unless another patch of the pair took it.
    pub fn friction(&self, patch: &Seen<S>, others: &[Seen<S>]) -> Option<&'a PatchForce<S>> {
        let k = self.source(patch).filter(|k| *k < 64)?;
        (!others.iter().any(|other| self.source(other) == Some(k))).then(|| &self.forces[k])
    }

    /// The patch that had the first point that is known.
    fn source(&self, patch: &Seen<S>) -> Option<usize> {
        let known = |id: &u64| self.seen.iter().position(|seen| seen.names().contains(id));
        patch.names().iter().find_map(known)
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
    /// Keeps the last substep's impulses as forces, and what was seen of their patches for the next step.
    pub(super) fn remember(&mut self, warm: &mut WarmStart<S>, choice: &SoftChoice) {
        warm.clear();
        let (rate, none) = (1.0 / f64::from(choice.h), PatchForce::zero());
        let forces = &mut warm.patches.forces;
        forces.reserve(self.met.len());
        self.forgotten.clear();
        let mut all_stand = self.met.len() == self.before.len();
        for (k, met) in self.met.iter().enumerate() {
            let last = self.solver.last(k);
            all_stand &= met.again && met.seen as usize == k;
            let points = usize::from(met.count);
            // a face that bears nothing is kept too where its points can be used again: to look for them is what costs
            let bears = || last.normal.slice().iter().any(|x| *x != 0.0);
            if points < S::DIM && !met.is_angular && !bears() {
                self.forgotten.push(k as u32);
                continue;
            }
            let rolls = self.kinds[met.kind as usize].rolling > 0.0;
            // written where it stays
            forces.push(none);
            if let Some(force) = forces.last_mut() {
                press(force, (points, met.normal, rolls), &last, rate);
            }
        }
        if all_stand && self.forgotten.is_empty() {
            warm.patches.seen = self.before.clone();
            return;
        }
        warm.patches.seen = Arc::new(self.list_of_seen());
    }

    /// What was seen of all faces but the forgotten ones.
    fn list_of_seen(&mut self) -> Vec<Seen<S>> {
        let mut list = std::mem::take(&mut self.spare);
        let Some(first) = self.before.first().or(self.fresh.first()) else { return list };
        list.resize(self.met.len() - self.forgotten.len(), *first);
        let mut to = 0;
        let mut copy = |again: bool, run: Range<usize>| {
            let end = to + run.len();
            list[to..end].copy_from_slice(&self.seen_in(again)[run]);
            to = end;
        };
        let mut forgotten = self.forgotten.iter().peekable();
        let mut run = (true, 0..0);
        for (k, met) in self.met.iter().enumerate() {
            if forgotten.next_if(|f| **f as usize == k).is_some() {
                continue;
            }
            // what follows in the same list is copied together
            let place = met.seen as usize;
            if (met.again, place) == (run.0, run.1.end) {
                run.1.end += 1;
            } else {
                copy(run.0, run.1);
                run = (met.again, place..place + 1);
            }
        }
        copy(run.0, run.1);
        list
    }

    /// One of the step's faces.
    pub(super) fn face(&self, k: usize) -> Face<S> {
        let met = &self.met[k];
        let place = |i: usize| (self.rigid.position[i], self.rigid.rotation[i]);
        Face::of(met, self.seen(met), self.kinds[met.kind as usize], place)
    }
}

/// Writes a patch's last impulses as forces into one without any.
#[inline(always)]
fn press<S: Geometry>(
    force: &mut PatchForce<S>,
    (points, normal, rolls): (usize, S::Vector, bool),
    last: &Last<S>,
    rate: f64,
) {
    for i in 0..S::Points::<f64>::LEN {
        if i < points {
            force.normal[i] = f64::from(last.normal[i]) * rate;
        }
    }
    let mut friction = S::Vector::ZERO;
    for m in 0..S::SLIP {
        let tangent = S::tangent(normal, m);
        for c in 0..S::DIM {
            friction[c] += tangent[c] * f64::from(last.rubbing[m]) * rate;
        }
    }
    force.friction = friction;
    for m in (0..S::SLIP).filter(|_| rolls) {
        let axis = rolling_axis::<S>(normal, m);
        for c in 0..S::SPIN {
            force.rolling[c] += axis[c] * f64::from(last.rolling[m]) * rate;
        }
    }
    if S::SPIN > S::SLIP {
        force.twist = f64::from(last.rubbing[S::SLIP]) * rate;
    }
}
