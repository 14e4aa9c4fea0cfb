//! Patches of faces, about the mean of their points, with the forces that they had; and back: what is remembered of a step.

use super::SoftStep;
use super::face::{Face, Laid, Outline};
use super::memory::{PatchForce, Seen};
use super::standing::Standing;
use crate::material::Coefficients;
use crate::warm_start::WarmStart;
use carom_geometry::Geometry;
use carom_math::wide::{inner, minus};
use carom_math::{Column, Precise, Several, Workers};
use carom_solver::soft::{APART, Last, Numbers, Rare, SoftChoice};
use std::ops::Range;
use std::sync::Arc;

/// Faces that a worker takes at a time.
const FACES: usize = 256;

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
            // plus zero: what does not rub has no sign
            to.rub(k, (inner(&laid.tangents[k], friction).rounded() * h + zero).narrow());
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
    /// What a new patch starts from: the normal forces of its points \[N\], and whose friction.
    #[inline]
    pub fn forces_of(
        &self,
        patch: &Seen<S>,
        others: &[Seen<S>],
    ) -> (S::Points<f64>, Option<&'a PatchForce<S>>) {
        let mut normal = S::Points::all(0.0);
        let points = patch.names().len();
        // nearly always nothing is known, or one patch with the same points
        if let ([seen], [force]) = (self.seen, self.forces)
            && others.is_empty()
            && seen.count == patch.count
            && seen.ids.slice() == patch.ids.slice()
        {
            normal.slice_mut()[..points].copy_from_slice(&force.normal.slice()[..points]);
            return (normal, Some(force));
        }
        if self.seen.is_empty() {
            return (normal, None);
        }
        for (to, id) in normal.slice_mut().iter_mut().zip(patch.names()) {
            *to = self.normal(*id);
        }
        (normal, self.friction(patch, others))
    }

    /// Normal force of a point by its name \[N\]; 0 where it is new.
    fn normal(&self, name: u64) -> f64 {
        let at = |seen: &Seen<S>| seen.names().iter().position(|x| *x == name);
        let all = self.seen.iter().zip(self.forces);
        all.filter_map(|(seen, force)| at(seen).map(|at| force.normal[at])).last().unwrap_or(0.0)
    }

    /// Whose friction a new patch starts from: that of the first of its points that is known, unless another patch of the pair took it.
    fn friction(&self, patch: &Seen<S>, others: &[Seen<S>]) -> Option<&'a PatchForce<S>> {
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
    pub(super) fn remember(
        &mut self,
        (warm, standing): (&mut WarmStart<S>, &mut Standing<S>),
        choice: &SoftChoice,
        workers: &Workers,
    ) {
        // what was there is not forgotten first, to be written once
        let mut forces = std::mem::take(&mut warm.patches.forces);
        warm.clear();
        if self.met.is_empty() {
            return;
        }
        self.choose_kept();
        let all_stand = self.kept.is_all() && self.tally.again.are_all_of(self.before.len());
        let (rate, none) = (1.0 / f64::from(choice.h), PatchForce::zero());
        forces.resize(self.kept.len(), none);
        let this = &*self;
        workers.each(&mut forces, FACES, |first, forces| {
            for (force, place) in forces.iter_mut().zip(first..) {
                let k = this.kept.face(place);
                // written where it stays
                *force = none;
                let last = this.solver.last(k);
                if this.goes_again {
                    // nothing rolls, and a point that is not there bears nothing
                    let normal = standing.normal(this.solver.place(k));
                    press(force, (S::Points::<f64>::LEN, normal, false), &last, rate);
                } else {
                    let met = &this.met[k];
                    let rolls = this.kinds[met.kind as usize].rolling > 0.0;
                    press(force, (usize::from(met.count), met.normal, rolls), &last, rate);
                }
            }
        });
        warm.patches.forces = forces;
        warm.patches.seen =
            if all_stand { self.before.clone() } else { Arc::new(self.list_of_seen(workers)) };
        if self.goes_again {
            standing.keep(&warm.patches.seen);
        }
        self.packed = self.packing;
    }

    /// Chooses the faces that something is remembered of.
    fn choose_kept(&mut self) {
        let count = self.met.len();
        if self.tally.loose == 0 {
            return self.kept.keep_all(count);
        }
        let (met, solver) = (&self.met, &self.solver);
        self.kept.keep(count, |k| {
            // a face that bears nothing is kept too where its points can be used again: to look for them is what costs
            let points_last = usize::from(met[k].count) >= S::DIM || met[k].is_angular;
            points_last || solver.last(k).normal.slice().iter().any(|x| *x != 0.0)
        });
    }

    /// What was seen of the faces that are kept.
    fn list_of_seen(&mut self, workers: &Workers) -> Vec<Seen<S>> {
        let mut list = std::mem::take(&mut self.spare);
        let Some(first) = self.before.first().or(self.fresh.first()) else { return Vec::new() };
        list.resize(self.kept.len(), *first);
        let this = &*self;
        workers.each(&mut list, FACES, |first, list| {
            let places = first..first + list.len();
            let mut to = 0;
            let mut copy = |again: bool, run: Range<usize>| {
                let end = to + run.len();
                list[to..end].copy_from_slice(&this.seen_in(again)[run]);
                to = end;
            };
            let mut run = (true, 0..0);
            for place in places {
                // what follows in the same list is copied together
                let met = &this.met[this.kept.face(place)];
                let place = met.seen as usize;
                if (met.again, place) == (run.0, run.1.end) {
                    run.1.end += 1;
                } else {
                    copy(run.0, run.1);
                    run = (met.again, place..place + 1);
                }
            }
            copy(run.0, run.1);
        });
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
