//! Patches from touches, and back: all touches of a pair with one normal, four at a time in space and two in the plane,
//! about the mean of their points.

use super::SoftStep;
use super::memory::{PatchForce, Seen, Walk};
use super::motion::{NONE, narrow};
use crate::bodies::Bodies;
use crate::narrow_phase::Touch;
use crate::warm_start::WarmStart;
use carom_geometry::Geometry;
use carom_math::{Column, Rotation, Several, Workers};
use carom_solver::soft::{Patch, PatchPoint, SoftChoice};

/// Normals whose cosine is above this are one: a milliradian apart.
const ONE_NORMAL: f64 = 1.0 - 5e-7;

/// Touches and patches that a worker takes at a time.
const TOUCHES: usize = 512;
const PATCHES: usize = 128;

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
        workers: &Workers,
    ) {
        self.members.clear();
        self.ranks.clear();
        let divide = |first, some: &[Touch<S>], out: &mut Division<S>| {
            divide(touches, first..first + some.len(), out);
        };
        workers.chunks(touches, TOUCHES, &mut self.divisions, divide, |out| {
            self.members.append(&mut out.members);
            self.ranks.append(&mut out.ranks);
        });
        let mut patches = std::mem::take(&mut self.patches);
        match self.members.first() {
            Some(members) => patches.resize(self.members.len(), self.fresh(bodies, touches, members)),
            None => patches.clear(),
        }
        workers.each(&mut patches, PATCHES, |first, patches| {
            let (mut of, mut known, mut place) = (None, &before[..0], None);
            for (k, patch) in (first..).zip(patches) {
                let t = &touches[self.members[k][0] as usize];
                let pair = (bodies.data[t.a].serial, bodies.data[t.b].serial);
                if of != Some(pair) {
                    let mut walk = Walk::from(before, place, pair);
                    (of, known) = (Some(pair), walk.of(pair));
                    place = Some(walk.place());
                }
                *patch = self.fresh(bodies, touches, &self.members[k]);
                let of_pair = &self.members[k - self.ranks[k] as usize..=k];
                warm_patch(patch, touches, of_pair, known, choice.h);
            }
        });
        self.patches = patches;
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

/// Touches divided into patches.
pub(super) struct Division<S: Geometry> {
    /// Touches of each patch's points.
    members: Vec<S::Points<u32>>,
    /// Patches of its pair before each.
    ranks: Vec<u32>,
}

impl<S: Geometry> Default for Division<S> {
    fn default() -> Self {
        Division { members: Vec::new(), ranks: Vec::new() }
    }
}

/// Divides the touches of the pairs that begin in a range.
fn divide<S: Geometry>(touches: &[Touch<S>], range: std::ops::Range<usize>, out: &mut Division<S>) {
    let pair = |k: usize| (touches[k].a, touches[k].b);
    let begins = |k: usize| k == 0 || k == touches.len() || pair(k) != pair(k - 1);
    let mut first = range.start;
    while !begins(first) {
        first += 1;
    }
    while first < range.end {
        let mut end = first + 1;
        while !begins(end) {
            end += 1;
        }
        divide_pair(touches, first..end, out);
        first = end;
    }
}

/// Divides a pair's touches by normals.
fn divide_pair<S: Geometry>(touches: &[Touch<S>], range: std::ops::Range<usize>, out: &mut Division<S>) {
    let begun = out.members.len();
    for k in range {
        let fits = |m: &S::Points<u32>| {
            let first = &touches[m[0] as usize];
            count::<S>(m) < m.slice().len() && first.normal.dot(touches[k].normal) > ONE_NORMAL
        };
        match out.members[begun..].iter_mut().find(|m| fits(m)) {
            Some(members) => {
                let place = count::<S>(members);
                members[place] = k as u32;
            }
            None => {
                let mut members = S::Points::all(NONE);
                members[0] = k as u32;
                out.ranks.push((out.members.len() - begun) as u32);
                out.members.push(members);
            }
        }
    }
    for members in &mut out.members[begun..] {
        // A sweep takes points one after another, and what it has not yet evened out leans towards the first. Ids
        // order them as if by chance, so that a tall wall does not lean the same way in every row.
        let points = count::<S>(members);
        members.slice_mut()[..points].sort_unstable_by_key(|m| touches[*m as usize].id);
    }
}

/// The remembered patch of the first point that is known.
fn source<S: Geometry>(
    touches: &[Touch<S>],
    members: &S::Points<u32>,
    before: &[PatchForce],
) -> Option<usize> {
    (0..count::<S>(members)).find_map(|i| {
        let id = touches[members[i] as usize].id;
        before.iter().position(|force| force.ids[..force.count].contains(&id))
    })
}

/// Starts the last of a pair's patches from the forces that its points had; friction comes from the remembered patch of the
/// first point that is known, unless a patch before took it.
fn warm_patch<S: Geometry>(
    patch: &mut Patch<S>,
    touches: &[Touch<S>],
    of_pair: &[S::Points<u32>],
    before: &[PatchForce],
    h: f32,
) {
    let Some((members, others)) = of_pair.split_last() else { return };
    for i in 0..count::<S>(members) {
        let id = touches[members[i] as usize].id;
        for force in before {
            if let Some(at) = force.ids[..force.count].iter().position(|x| *x == id) {
                patch.points[i].impulse = force.normal[at] as f32 * h;
            }
        }
    }
    let Some(k) = source::<S>(touches, members, before).filter(|k| *k < 64) else { return };
    if others.iter().any(|m| source::<S>(touches, m, before) == Some(k)) {
        return;
    }
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
