//! Patches from touches, and back: all touches of a pair with one normal, four at a time in space and two in the plane,
//! about the mean of their points.

use super::SoftStep;
use super::memory::{PatchForce, Seen, Walk};
use super::motion::{NONE, narrow};
use crate::bodies::Bodies;
use crate::narrow_phase::Touch;
use crate::warm_start::WarmStart;
use carom_geometry::Geometry;
use carom_math::{Column, Rotation, Several};
use carom_solver::soft::{Patch, PatchPoint, SoftChoice};

/// Normals whose cosine is above this are one: a milliradian apart.
const ONE_NORMAL: f64 = 1.0 - 5e-7;

/// Points that a patch has.
pub(super) fn count<S: Geometry>(members: &S::Points<u32>) -> usize {
    members.slice().iter().take_while(|m| **m != NONE).count()
}

impl<S: Geometry> SoftStep<S> {
    /// Patches of all touches, with the forces that they had.
    pub(super) fn patch(
        &mut self,
        bodies: &Bodies<S>,
        touches: &[Touch<S>],
        before: &[PatchForce],
        choice: &SoftChoice,
    ) {
        self.patches.clear();
        self.members.clear();
        let mut walk = Walk::new(before);
        let mut first = 0;
        while first < touches.len() {
            let pair = (touches[first].a, touches[first].b);
            let end = first + touches[first..].iter().take_while(|t| (t.a, t.b) == pair).count();
            let before = walk.of((bodies.data[pair.0].serial, bodies.data[pair.1].serial));
            self.patch_pair(bodies, touches, first..end, before, choice);
            first = end;
        }
    }

    /// Divides a pair's touches by normals.
    fn patch_pair(
        &mut self,
        bodies: &Bodies<S>,
        touches: &[Touch<S>],
        range: std::ops::Range<usize>,
        before: &[PatchForce],
        choice: &SoftChoice,
    ) {
        let begun = self.members.len();
        for k in range {
            let fits = |m: &S::Points<u32>| {
                let first = &touches[m[0] as usize];
                count::<S>(m) < m.slice().len() && first.normal.dot(touches[k].normal) > ONE_NORMAL
            };
            match self.members[begun..].iter_mut().find(|m| fits(m)) {
                Some(members) => {
                    let place = count::<S>(members);
                    members[place] = k as u32;
                }
                None => {
                    let mut members = S::Points::all(NONE);
                    members[0] = k as u32;
                    self.members.push(members);
                }
            }
        }
        let mut taken = 0u64;
        for m in begun..self.members.len() {
            // A sweep takes points one after another, and what it has not yet evened out leans towards the first. Ids
            // order them as if by chance, so that a tall wall does not lean the same way in every row.
            let points = count::<S>(&self.members[m]);
            self.members[m].slice_mut()[..points].sort_unstable_by_key(|m| touches[*m as usize].id);
            let mut patch = self.fresh(bodies, touches, &self.members[m]);
            warm_patch(&mut patch, touches, &self.members[m], before, &mut taken, choice.h);
            self.patches.push(patch);
        }
    }

    /// A patch without impulses.
    fn fresh(&self, bodies: &Bodies<S>, touches: &[Touch<S>], members: &S::Points<u32>) -> Patch<S> {
        let n = count::<S>(members);
        let touch = |i: usize| &touches[members[i] as usize];
        let t = touch(0);
        let mut centre = t.point;
        for i in 1..n {
            centre += touch(i).point;
        }
        let centre = centre * (1.0 / n as f64);
        let mut tangents = [t.normal; 2];
        for (k, tangent) in tangents.iter_mut().enumerate().take(S::SLIP) {
            *tangent = S::tangent(t.normal, k);
        }
        let apart = PatchPoint { place: S::Slips::all(0.0), gap: f32::INFINITY, impulse: 0.0 };
        let mut points: S::Points<PatchPoint<S>> = S::Points::all(apart);
        let mut lever = 0.0;
        for i in 0..n {
            let from_centre = touch(i).point - centre;
            lever += from_centre.norm() / n as f64;
            for (k, tangent) in tangents.iter().enumerate().take(S::SLIP) {
                points[i].place[k] = from_centre.dot(*tangent) as f32;
            }
            points[i].gap = touch(i).gap as f32;
        }
        Patch {
            a: self.record_of[t.a],
            b: self.record_of[t.b],
            normal: narrow(t.normal),
            arm_a: narrow(centre - bodies.motion.position[t.a]),
            arm_b: narrow(centre - bodies.motion.position[t.b]),
            friction: t.friction as f32,
            rolling: t.rolling as f32,
            twisting: (t.friction * lever + t.spinning) as f32,
            restitution: t.restitution as f32,
            points,
            rubbing: S::Spins::all(0.0),
            rolling_moment: S::Slips::all(0.0),
        }
    }

    /// A patch as the narrow phase found it.
    fn seen(&self, touches: &[Touch<S>], members: &S::Points<u32>) -> Seen {
        let mut seen = Seen::default();
        let first = &touches[members[0] as usize];
        seen.normal[..S::DIM].copy_from_slice(first.normal.as_slice());
        for i in 0..count::<S>(members) {
            let t = &touches[members[i] as usize];
            seen.points[i][..S::DIM].copy_from_slice(t.point.as_slice());
            seen.gaps[i] = t.gap;
        }
        for (k, body) in [first.a, first.b].into_iter().enumerate() {
            seen.places[k][..S::DIM].copy_from_slice(self.rigid.position[body].as_slice());
            let attitude = self.rigid.rotation[body].as_slice();
            seen.attitudes[k][..attitude.len()].copy_from_slice(attitude);
        }
        seen
    }

    /// Keeps the last substep's impulses as forces.
    pub(super) fn remember(
        &mut self,
        bodies: &Bodies<S>,
        (touches, before): (&[Touch<S>], &[PatchForce]),
        warm: &mut WarmStart<S>,
        choice: &SoftChoice,
    ) {
        warm.clear();
        let (mut walk, mut again) = (Walk::new(before), self.again.iter().peekable());
        let rate = 1.0 / f64::from(choice.h);
        for (k, members) in self.members.iter().enumerate() {
            let told = self.solver.result(k);
            let n = count::<S>(members);
            // a face that bears nothing is kept too: its points are used again
            if n < S::DIM && told.last.slice().iter().all(|x| *x == 0.0) {
                continue;
            }
            let t = &touches[members[0] as usize];
            let pair = (bodies.data[t.a].serial, bodies.data[t.b].serial);
            let mut force = PatchForce {
                pair,
                count: n,
                ids: [0; 4],
                normal: [0.0; 4],
                friction: [0.0; 3],
                twist: 0.0,
                rolling: [0.0; 3],
                seen: Seen::default(),
            };
            while again.next_if(|p| **p < pair).is_some() {}
            force.seen = match again.peek() {
                Some(known) if **known == pair => walk.of(pair)[0].seen,
                _ => self.seen(touches, members),
            };
            for i in 0..n {
                force.ids[i] = touches[members[i] as usize].id;
                force.normal[i] = f64::from(told.last[i]) * rate;
            }
            for m in 0..S::SLIP {
                let tangent = S::tangent(t.normal, m);
                for c in 0..S::DIM {
                    force.friction[c] += tangent[c] * f64::from(told.last_rubbing[m]) * rate;
                }
                let axis = rolling_axis::<S>(t.normal, m);
                for c in 0..S::SPIN {
                    force.rolling[c] += axis[c] * f64::from(told.last_rolling[m]) * rate;
                }
            }
            if S::SPIN > S::SLIP {
                force.twist = f64::from(told.last_rubbing[S::SLIP]) * rate;
            }
            warm.patches.push(force);
        }
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

/// Starts a patch from the forces that its points had; friction comes from the remembered patch of the first point that
/// is known, once.
fn warm_patch<S: Geometry>(
    patch: &mut Patch<S>,
    touches: &[Touch<S>],
    members: &S::Points<u32>,
    before: &[PatchForce],
    taken: &mut u64,
    h: f32,
) {
    let mut source = None;
    for i in 0..count::<S>(members) {
        let id = touches[members[i] as usize].id;
        for (k, force) in before.iter().enumerate() {
            if let Some(at) = force.ids[..force.count].iter().position(|x| *x == id) {
                patch.points[i].impulse = force.normal[at] as f32 * h;
                source = source.or(Some(k));
            }
        }
    }
    let Some(k) = source.filter(|k| *k < 64 && *taken & (1 << k) == 0) else { return };
    *taken |= 1 << k;
    let (force, normal) = (&before[k], touches[members[0] as usize].normal);
    for m in 0..S::SLIP {
        let (tangent, axis) = (S::tangent(normal, m), rolling_axis::<S>(normal, m));
        let along = (0..S::DIM).map(|c| tangent[c] * force.friction[c]).sum::<f64>();
        let about = (0..S::SPIN).map(|c| axis[c] * force.rolling[c]).sum::<f64>();
        patch.rubbing[m] = along as f32 * h;
        patch.rolling_moment[m] = about as f32 * h;
    }
    if S::SPIN > S::SLIP {
        patch.rubbing[S::SLIP] = force.twist as f32 * h;
    }
}
