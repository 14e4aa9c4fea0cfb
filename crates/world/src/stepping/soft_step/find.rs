//! From pairs that may touch to faces of contact and the patches that the lanes solve: points that stand are used again, others
//! are found and divided by their normals, four to a face in space and two in the plane.

use super::again::again;
use super::face::{Face, NONE};
use super::memory::{PatchForce, Walk};
use super::patches::{patch_of, start_again, start_from};
use super::tally::Tally;
use crate::ahead::Ahead;
use crate::material::Coefficients;
use crate::narrow_phase::{Finder, Near, contact_id};
use carom_geometry::{ContactPoint, Geometry};
use carom_math::{Column, Several};
use carom_solver::soft::Patch;

/// Normals whose cosine is above this are one: a milliradian apart.
const ONE_NORMAL: f64 = 1.0 - 5e-7;

/// Finds the faces of a step.
pub(super) struct Finding<'a, S: Geometry> {
    /// The step ahead.
    pub ahead: Ahead<'a, S>,
    /// The patches of the step before.
    pub before: &'a [PatchForce<S>],
    /// Length of a substep \[s\].
    pub h: f32,
}

/// What is found of a chunk of pairs.
pub(super) struct Found<S: Geometry> {
    /// Faces, in the order of their pairs.
    pub faces: Vec<Face<S>>,
    /// Their patches; records are not known yet.
    pub patches: Vec<Patch<S>>,
    /// What is counted of the faces.
    pub tally: Tally,
    /// Where the search for what is known stands; none before the first pair.
    place: Option<usize>,
    /// Room for a pair's points, and for the names of a face's.
    points: Vec<ContactPoint<S>>,
    members: Vec<S::Points<u32>>,
}

impl<S: Geometry> Default for Found<S> {
    fn default() -> Self {
        let (faces, patches, tally, place, points, members) = Default::default();
        Found { faces, patches, tally, place, points, members }
    }
}

impl<S: Geometry> Finder<S> for Finding<'_, S> {
    type Findings = Found<S>;

    fn begin(&self, found: &mut Found<S>) {
        (found.place, found.tally) = (None, Tally::default());
    }

    fn look(&self, near: &Near<'_, S>, found: &mut Found<S>) {
        let pair = (near.a, near.b);
        let bodies = self.ahead.bodies;
        let serials = (bodies.data[pair.0].serial, bodies.data[pair.1].serial);
        let mut walk = Walk::from(self.before, found.place, serials);
        let range = walk.of(serials);
        found.place = Some(walk.place());
        let known = &self.before[range.clone()];
        let first = found.faces.len();
        if again(&self.ahead, (pair, near.closing), known, &mut found.faces) {
            for ((face, force), place) in found.faces[first..].iter_mut().zip(known).zip(range.start..) {
                face.again = place as u32;
                found.tally.add(face);
                found.patches.push(patch_of(bodies, face));
                if let Some(patch) = found.patches.last_mut() {
                    start_again(patch, face, force, self.h);
                }
            }
            return;
        }
        found.points.clear();
        near.contacts(&mut found.points);
        if found.points.is_empty() {
            return;
        }
        let coefficients = Coefficients::of(bodies, self.ahead.settings, pair);
        let name = |p: &ContactPoint<S>| contact_id(serials.0, serials.1, p.feature);
        let first = found.faces.len();
        divide(&found.points, &name, &mut found.members);
        for members in &found.members {
            let face = face_of(&found.points, members, (pair, coefficients), &name);
            let mut patch = patch_of(bodies, &face);
            start_from(&mut patch, &face, &found.faces[first..], known, self.h);
            found.tally.add(&face);
            found.faces.push(face);
            found.patches.push(patch);
        }
    }
}

/// Points that a face has.
fn count<S: Geometry>(members: &S::Points<u32>) -> usize {
    members.slice().iter().take_while(|m| **m != NONE).count()
}

/// Divides a pair's points by normals.
fn divide<S: Geometry>(
    points: &[ContactPoint<S>],
    name: &impl Fn(&ContactPoint<S>) -> u64,
    out: &mut Vec<S::Points<u32>>,
) {
    out.clear();
    for (k, point) in points.iter().enumerate() {
        let fits = |m: &S::Points<u32>| {
            let first = &points[m[0] as usize];
            count::<S>(m) < m.slice().len() && first.normal.dot(point.normal) > ONE_NORMAL
        };
        match out.iter_mut().find(|m| fits(m)) {
            Some(members) => {
                let place = count::<S>(members);
                members[place] = k as u32;
            }
            None => {
                let mut members = S::Points::all(NONE);
                members[0] = k as u32;
                out.push(members);
            }
        }
    }
    for members in out {
        // A sweep takes points one after another, and what it has not yet evened out leans towards the first. Ids
        // order them as if by chance, so that a tall wall does not lean the same way in every row.
        let points_of = count::<S>(members);
        members.slice_mut()[..points_of].sort_unstable_by_key(|m| name(&points[*m as usize]));
    }
}

/// A face of some of a pair's points.
fn face_of<S: Geometry>(
    points: &[ContactPoint<S>],
    members: &S::Points<u32>,
    (pair, coefficients): ((usize, usize), Coefficients),
    name: &impl Fn(&ContactPoint<S>) -> u64,
) -> Face<S> {
    let mut face = Face::new(pair, points[members[0] as usize].normal, coefficients);
    for m in &members.slice()[..count::<S>(members)] {
        let point = &points[*m as usize];
        face.add(name(point), point.point, point.gap);
    }
    face
}
