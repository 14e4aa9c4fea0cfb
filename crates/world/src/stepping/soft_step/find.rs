//! From pairs that may touch to faces of contact and the patches that the lanes solve: points that stand are used again, others
//! are found and divided by their normals, four to a face in space and two in the plane.

use super::again::Together;
use super::face::{Laid, Met, NONE, Spots};
use super::memory::{PatchForce, PatchList, Seen, Walk};
use super::patches::{Known, rare_of, write_patch};
use super::tally::Tally;
use crate::ahead::{Ahead, Couple};
use crate::material::Coefficients;
use crate::narrow_phase::{Finder, Near, contact_id};
use carom_geometry::{ContactPoint, Geometry};
use carom_math::{Column, Rotation, Several};
use carom_solver::soft::Patches;

/// Normals whose cosine is above this are one: a milliradian apart.
const ONE_NORMAL: f64 = 1.0 - 5e-7;

/// Finds the faces of a step.
pub(super) struct Finding<'a, S: Geometry> {
    /// The step ahead.
    pub ahead: Ahead<'a, S>,
    /// The patches of the step before.
    pub before: &'a PatchList<S>,
    /// Length of a substep \[s\].
    pub h: f32,
}

/// What is found of a chunk of pairs.
pub(super) struct Found<S: Geometry> {
    /// Faces, in the order of their pairs.
    pub met: Vec<Met<S>>,
    /// Their patches; records are not known yet.
    pub patches: Patches<S>,
    /// What was seen of those that are new.
    pub fresh: Vec<Seen<S>>,
    /// Their coefficients, one after another where they differ.
    pub kinds: Vec<Coefficients>,
    /// What is counted of the faces.
    pub tally: Tally,
    /// Where the search for what is known stands; none before the first pair.
    place: Option<usize>,
    /// Surfaces of the last pair, whose coefficients are the last ones.
    surfaces: Option<(u32, u32)>,
    /// Room for a pair's points, and for the names of a face's.
    points: Vec<ContactPoint<S>>,
    members: Vec<S::Points<u32>>,
}

impl<S: Geometry> Default for Found<S> {
    fn default() -> Self {
        let (met, fresh, kinds, tally, place, surfaces, points, members) = Default::default();
        Found { met, patches: Patches::default(), fresh, kinds, tally, place, surfaces, points, members }
    }
}

impl<S: Geometry> Found<S> {
    /// Adds a face whose points are here, with the normal forces of its points and the friction that its patch starts from.
    #[inline(always)]
    fn add(
        &mut self,
        (finding, couple): (&Finding<'_, S>, &Couple<'_, S>),
        met: Met<S>,
        laid: &Laid<S>,
        force: impl Fn(usize) -> f64,
        rubbing: Option<&PatchForce<S>>,
    ) {
        let coefficients = &self.kinds[met.kind as usize];
        write_patch(self.patches.add(), (couple, laid), coefficients, (force, rubbing), finding.h);
        if coefficients.restitution > 0.0 || coefficients.rolling > 0.0 {
            self.patches.set_rare(rare_of(laid.normal, coefficients, rubbing, finding.h));
        }
        let (count, normal, deepest) = (laid.count as u8, laid.normal, laid.deepest());
        let met = Met { count, normal, deepest, ..met };
        self.tally.add(&met, coefficients);
        self.met.push(met);
    }

    /// The place of a pair's coefficients.
    #[inline]
    fn kind(&mut self, ahead: &Ahead<S>, couple: &Couple<'_, S>) -> u32 {
        let surfaces = Some((couple.a.surface, couple.b.surface));
        if self.surfaces != surfaces {
            self.kinds.push(Coefficients::of(ahead.bodies, ahead.settings, couple.indices()));
            self.surfaces = surfaces;
        }
        self.kinds.len() as u32 - 1
    }
}

impl<S: Geometry> Finder<S> for Finding<'_, S> {
    type Findings = Found<S>;

    fn begin(&self, found: &mut Found<S>) {
        (found.place, found.tally, found.surfaces) = (None, Tally::default(), None);
        found.kinds.clear();
    }

    fn look(&self, near: &Near<'_, S>, found: &mut Found<S>) {
        let couple = &near.couple;
        let serials = couple.serials();
        let mut walk = Walk::from(&self.before.seen, found.place, serials);
        let known = walk.of(serials);
        found.place = Some(walk.place());
        let seen = &self.before.seen[known.clone()];
        if let Some(together) = Together::of(&self.ahead, near, seen) {
            let met = self.met(found, couple, true);
            for (place, seen) in known.zip(seen) {
                let force = &self.before.forces[place];
                let met = Met { seen: place as u32, ..met };
                let (force_of, count) = (|i| force.normal[i], seen.names().len());
                // a number of points that is known is worth a copy of the text
                if count == S::Points::<f64>::LEN {
                    let laid = together.laid(seen, S::Points::<f64>::LEN);
                    found.add((self, couple), met, &laid, force_of, Some(force));
                } else {
                    found.add((self, couple), met, &together.laid(seen, count), force_of, Some(force));
                }
            }
            return;
        }
        found.points.clear();
        near.contacts(&mut found.points);
        if !found.points.is_empty() {
            self.look_anew(couple, Known { seen, forces: &self.before.forces[known] }, found);
        }
    }
}

impl<S: Geometry> Finding<'_, S> {
    /// A face of a pair, but for its points.
    #[inline]
    fn met(&self, found: &mut Found<S>, couple: &Couple<'_, S>, again: bool) -> Met<S> {
        let (kind, (a, b)) = (found.kind(&self.ahead, couple), couple.indices());
        Met {
            a: a as u32,
            b: b as u32,
            seen: NONE,
            kind,
            count: 0,
            again,
            is_angular: couple.are_angular(),
            a_is_small: couple.a_is_small(),
            normal: S::Vector::ZERO,
            deepest: f64::INFINITY,
        }
    }

    /// Faces of a pair's points.
    fn look_anew(&self, couple: &Couple<'_, S>, known: Known<'_, S>, found: &mut Found<S>) {
        let serials = couple.serials();
        let name = |p: &ContactPoint<S>| contact_id(serials.0, serials.1, p.feature);
        let (mut members, points) = (std::mem::take(&mut found.members), std::mem::take(&mut found.points));
        divide(&points, &name, &mut members);
        let (met, first) = (self.met(found, couple, false), found.fresh.len());
        for members in &members {
            let mut seen = seen_now(couple);
            let mut spots = Spots::<S>::new(points[members[0] as usize].normal);
            for m in &members.slice()[..count::<S>(members)] {
                let point = &points[*m as usize];
                (seen.ids[spots.count], seen.gaps[spots.count]) = (name(point), point.gap);
                spots.add(point.point, point.gap);
            }
            (seen.count, seen.normal, seen.points) = (spots.count, spots.normal, spots.points);
            let rubbing = known.friction(&seen, &found.fresh[first..]);
            let met = Met { seen: found.fresh.len() as u32, ..met };
            found.add((self, couple), met, &Laid::of(&spots), |i| known.normal(seen.ids[i]), rubbing);
            found.fresh.push(seen);
        }
        (found.members, found.points) = (members, points);
    }
}

/// A face without points that is seen now.
fn seen_now<S: Geometry>(couple: &Couple<'_, S>) -> Seen<S> {
    let mut attitudes = [S::Turns::all(0.0); 2];
    for (to, mover) in attitudes.iter_mut().zip([couple.a, couple.b]) {
        to.slice_mut().copy_from_slice(mover.rotation.as_slice());
    }
    Seen {
        pair: couple.serials(),
        count: 0,
        ids: S::Points::all(0),
        normal: S::Vector::ZERO,
        points: S::Points::all(S::Vector::ZERO),
        gaps: S::Points::all(0.0),
        places: [couple.a.position, couple.b.position],
        attitudes,
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
