//! From pairs that may touch to faces of contact and the patches that the lanes solve: points that stand are used again, others
//! are found and divided by their normals, four to a face in space and two in the plane.

use super::again::AGAIN;
use super::anew::Waiting;
use super::batch::{ALL, Batch, Old, ask};
use super::face::{Met, NONE};
use super::memory::{PatchForce, PatchList, Seen, Walk};
use super::patches::{Known, rare_of};
use super::tally::Tally;
use crate::ahead::{Ahead, Couple};
use crate::contact_id::PairId;
use crate::material::Coefficients;
use crate::narrow_phase::Finder;
use crate::nears::{Nears, Points};
use carom_geometry::{ContactPoint, Geometry};
use carom_math::lanes::WIDTH;
use carom_math::{Column, Rotation, Several};
use carom_solver::soft::{EightPatches, Numbers, Patches};
use std::ops::Range;

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
    /// Pairs that are looked at.
    anew: Vec<u32>,
    /// Room for their points, and for the names of a pair's and the places of a face's.
    pub points: Points<S>,
    names: Vec<u64>,
    members: Vec<S::Points<u32>>,
    /// Faces that are seen anew, whose patches are not laid yet.
    waiting: Waiting<S>,
    /// Patches that some pairs had in the step before; of those that may stand their pair and their place, and where they are laid.
    known: Vec<Recalled>,
    old: Vec<(u32, u32)>,
    slots: Vec<u32>,
    batches: Vec<Batch<S>>,
    /// Room for those that stand beside others that do not, and for a batch.
    few: Vec<u32>,
    room: EightPatches<S>,
}

/// Patches that a pair had in the step before.
#[derive(Clone, Copy)]
struct Recalled {
    /// Their places.
    first: u32,
    count: u32,
    /// They stand if the bodies have hardly moved.
    may_stand: bool,
}

impl Recalled {
    /// Their places.
    fn places(self) -> Range<usize> {
        self.first as usize..(self.first + self.count) as usize
    }
    /// How many of them may stand.
    fn old(self) -> usize {
        if self.may_stand { self.count as usize } else { 0 }
    }
}

impl<S: Geometry> Default for Found<S> {
    fn default() -> Self {
        let (met, fresh, kinds, tally, place, surfaces, names, members) = Default::default();
        let (anew, points) = Default::default();
        let (patches, waiting, known, old, slots, batches, few, room) = Default::default();
        Found {
            met,
            patches,
            fresh,
            kinds,
            tally,
            place,
            surfaces,
            anew,
            points,
            names,
            members,
            waiting,
            known,
            old,
            slots,
            batches,
            few,
            room,
        }
    }
}

impl<S: Geometry> Found<S> {
    /// Coefficients of friction of a patch with this lever \[m\], along it and about its normal.
    #[inline(always)]
    fn friction(&self, kind: u32, lever: f64) -> (f32, f32) {
        let coefficients = &self.kinds[kind as usize];
        let friction = coefficients.friction as f32;
        (friction, friction * lever as f32 + coefficients.spinning as f32)
    }

    /// Adds a face whose patch was added, with the friction that it starts from.
    #[inline(always)]
    fn add(&mut self, met: Met<S>, rubbing: Option<&PatchForce<S>>, h: f32) {
        let coefficients = &self.kinds[met.kind as usize];
        if coefficients.restitution > 0.0 || coefficients.rolling > 0.0 {
            self.patches.set_rare(rare_of(met.normal, coefficients, rubbing, h));
        }
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
        found.met.clear();
        found.fresh.clear();
        found.patches.clear();
        found.waiting.clear();
    }

    fn look(&self, nears: &Nears<'_, S>, found: &mut Found<S>) {
        self.recall(nears, found);
        self.sift(nears, found);
        // all of a pair stand or fall together
        let stands = |found: &Found<S>, Recalled { may_stand, .. }: Recalled, old: usize| {
            may_stand && found.slots[old] != NONE
        };
        let (mut points, mut next) = (std::mem::take(&mut found.points), 0);
        found.anew.clear();
        for k in 0..nears.count() {
            let known = found.known[k];
            if !stands(found, known, next) {
                found.anew.push(k as u32);
            }
            next += known.old();
        }
        points.look(nears, found.anew.iter().map(|k| *k as usize));
        let (mut next, mut looked) = (0, 0);
        for k in 0..nears.count() {
            let (known, old) = (found.known[k], next);
            next += known.old();
            if stands(found, known, old) {
                self.add_again(found, &nears.couple(k), known.places(), old);
                continue;
            }
            let places = known.places();
            let known =
                Known { seen: &self.before.seen[places.clone()], forces: &self.before.forces[places] };
            self.look_at(&nears.couple(k), points.of(looked), known, found);
            looked += 1;
        }
        found.points = points;
        self.lay(found);
        let told = found.patches.pairs.len();
        found.patches.pairs.extend(found.met[told..].iter().map(|met| (met.a, met.b)));
    }
}

impl<S: Geometry> Finding<'_, S> {
    /// What is known of some pairs from the step before, and what of it may stand: what rolls needs its points anew, and so does
    /// what comes too fast.
    #[inline]
    fn recall(&self, nears: &Nears<'_, S>, found: &mut Found<S>) {
        found.known.clear();
        found.old.clear();
        let mut walk = None;
        for k in 0..nears.count() {
            let couple = nears.couple(k);
            let pair = couple.serials();
            let walk = walk.get_or_insert_with(|| Walk::from(&self.before.seen, found.place, pair));
            let known = walk.of(pair);
            let seen = &self.before.seen[known.clone()];
            let may_stand = !seen.is_empty()
                && (couple.are_angular() || seen.iter().all(|patch| patch.count >= S::DIM))
                && nears.surely_closing(k) * self.ahead.dt <= AGAIN * couple.by_size()[0].extent;
            found.known.push(Recalled { first: known.start as u32, count: seen.len() as u32, may_stand });
            for place in known.start..if may_stand { known.end } else { known.start } {
                found.old.push((k as u32, place as u32));
            }
        }
        found.place = walk.map_or(found.place, |walk| Some(walk.place()));
    }

    /// Asks which of the patches stand, and lays them.
    fn sift(&self, nears: &Nears<'_, S>, found: &mut Found<S>) {
        let Found { old, batches, slots, few, room, .. } = found;
        let (step, mut full) = ((&self.ahead, self.h), 0);
        slots.clear();
        few.clear();
        for first in (0..old.len()).step_by(WIDTH) {
            let count = WIDTH.min(old.len() - first);
            let eight = self.eight(nears, |lane| old[first + lane.min(count - 1)]);
            let stand = ask(&eight, step, another(batches, full), room);
            if stand == ALL {
                slots.extend((0..count).map(|lane| (full * WIDTH + lane) as u32));
                full += 1;
                continue;
            }
            let stand = (0..count).filter(|lane| stand >> lane & 1 == 1);
            few.extend(stand.map(|lane| (first + lane) as u32));
            slots.extend((0..count).map(|_| NONE));
        }
        for (some, batch) in few.chunks(WIDTH).zip(full..) {
            let eight = self.eight(nears, |lane| old[some[lane.min(some.len() - 1)] as usize]);
            another(batches, batch).lay(&eight, self.h, room);
            for (k, slot) in some.iter().zip(batch * WIDTH..) {
                slots[*k as usize] = slot as u32;
            }
        }
    }

    /// Eight patches by their pairs and places.
    #[inline]
    fn eight<'b>(&'b self, nears: &Nears<'b, S>, one: impl Fn(usize) -> (u32, u32)) -> [Old<'b, S>; WIDTH] {
        std::array::from_fn(|lane| {
            let (pair, place) = one(lane);
            let (seen, force) = (&self.before.seen[place as usize], &self.before.forces[place as usize]);
            Old { seen, force, couple: nears.couple(pair as usize) }
        })
    }

    /// Adds the faces of a pair that stand, as they are laid.
    #[inline(always)]
    fn add_again(&self, found: &mut Found<S>, couple: &Couple<'_, S>, known: Range<usize>, first: usize) {
        let met = self.met(found, couple, true);
        for (place, old) in known.zip(first..) {
            let slot = found.slots[old] as usize;
            let (batch, lane) = (&found.batches[slot / WIDTH], slot % WIDTH);
            let (count, deepest) = (self.before.seen[place].names().len() as u8, batch.told.deepest[lane]);
            let met = Met { seen: place as u32, count, normal: batch.told.normal(lane), deepest, ..met };
            let (friction, twisting) = found.friction(met.kind, batch.told.levers[lane]);
            found.patches.push(&batch.patches[lane]).set_friction(friction, twisting);
            found.add(met, Some(&self.before.forces[place]), self.h);
        }
    }

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

    /// Faces of a pair's points, of which this is known.
    pub fn look_at(
        &self,
        couple: &Couple<'_, S>,
        points: &[ContactPoint<S>],
        known: Known<'_, S>,
        found: &mut Found<S>,
    ) {
        if points.is_empty() {
            return;
        }
        let (mut members, mut names) = (std::mem::take(&mut found.members), std::mem::take(&mut found.names));
        let pair = PairId::of(couple.serials());
        names.clear();
        names.extend(points.iter().map(|point| pair.contact(point.feature)));
        divide(points, &names, &mut members);
        let (met, first) = (self.met(found, couple, false), found.fresh.len());
        for members in &members {
            let places = (found.patches.len(), found.fresh.len());
            // it is written where it stays
            found.fresh.push(seen_now(couple, points[members[0] as usize].normal));
            let (others, own) = found.fresh.split_at_mut(places.1);
            let seen = &mut own[0];
            let mut deepest = f64::INFINITY;
            for (k, m) in members.slice()[..count::<S>(members)].iter().enumerate() {
                let point = &points[*m as usize];
                (seen.ids[k], seen.points[k], seen.gaps[k]) = (names[*m as usize], point.point, point.gap);
                seen.count = k + 1;
                deepest = if point.gap < deepest { point.gap } else { deepest };
            }
            let (normal, rubbing) = known.forces_of(seen, &others[first..]);
            let force = PatchForce { normal, ..rubbing.copied().unwrap_or(PatchForce::zero()) };
            let (count, normal) = (seen.count as u8, seen.normal);
            let met = Met { seen: places.1 as u32, count, normal, deepest, ..met };
            found.patches.add();
            found.add(met, rubbing, self.h);
            if found.waiting.add(places, force, &found.kinds[met.kind as usize]) {
                self.lay(found);
            }
        }
        (found.members, found.names) = (members, names);
    }

    /// Lays the patches of faces that wait for it.
    pub fn lay(&self, found: &mut Found<S>) {
        found.waiting.lay(&found.fresh, self.h, &mut found.patches);
    }
}

/// A batch of a list, with those before it.
fn another<S: Geometry>(batches: &mut Vec<Batch<S>>, k: usize) -> &mut Batch<S> {
    if batches.len() <= k {
        batches.resize_with(k + 1, Batch::default);
    }
    &mut batches[k]
}

/// A face without points that is seen now.
fn seen_now<S: Geometry>(couple: &Couple<'_, S>, normal: S::Vector) -> Seen<S> {
    let mut attitudes = [S::Turns::all(0.0); 2];
    for (to, mover) in attitudes.iter_mut().zip([couple.a, couple.b]) {
        to.slice_mut().copy_from_slice(mover.rotation.as_slice());
    }
    Seen {
        pair: couple.serials(),
        count: 0,
        ids: S::Points::all(0),
        normal,
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

/// Divides a pair's points by normals, those of each normal in the order of their names.
fn divide<S: Geometry>(points: &[ContactPoint<S>], names: &[u64], out: &mut Vec<S::Points<u32>>) {
    out.clear();
    // A sweep takes points one after another, and what it has not yet evened out leans towards the first. Ids
    // order them as if by chance, so that a tall wall does not lean the same way in every row.
    if points.len() <= S::Points::<u32>::LEN && points.iter().all(|point| point.normal == points[0].normal) {
        let mut members = S::Points::all(NONE);
        for (k, name) in names.iter().enumerate() {
            let mut place = k;
            while place > 0 && names[members[place - 1] as usize] > *name {
                members[place] = members[place - 1];
                place -= 1;
            }
            members[place] = k as u32;
        }
        return out.push(members);
    }
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
        let points_of = count::<S>(members);
        members.slice_mut()[..points_of].sort_unstable_by_key(|m| names[*m as usize]);
    }
}
