//! Faces that stand stay side by side. Where whom faces join is what it was, nobody is sorted: the solver's packs are what they were, what was
//! seen of their patches is kept as lanes read it, and a step asks there who stands and lays all of them at once. Pairs of which one does not stand are looked
//! at anew, alone. It decides nothing but the work: faces, patches and what is remembered of them are those of a step that looks at all pairs,
//! bit for bit, and a step begins so where somebody comes, goes, or was written.

use super::SoftStep;
use super::again::{Load, Sight, Store, Then};
use super::batch::{ALL, HALF, Half, Lying};
use super::face::{Met, NONE};
use super::find::{Finding, Found};
use super::memory::{PatchForce, PatchList, Seen};
use super::patches::Known;
use super::tally::{Again, Tally};
use crate::abreast::Quartet;
use crate::ahead::{Ahead, Couple, Mover};
use crate::material::Coefficients;
use crate::meeting::Meeting;
use crate::narrow_phase::{Finder, NarrowPhase};
use crate::nears::Nears;
use crate::settings::Settings;
use carom_geometry::Geometry;
use carom_math::lanes::{Job, Lanes, Portable, WIDTH, dispatch};
use carom_math::{Space, Workers};
use carom_solver::soft::{EightPatches, Numbers, Patch};
use std::sync::Arc;

/// Packs that a worker takes at a time.
const PACKS: usize = 32;

/// Faces that stood for fewer steps than this did not last.
const SOME: u32 = 4;
/// Steps that look at all pairs after faces that did not last.
const PAUSE: u32 = 8;

/// Eight patches of a pack.
#[derive(Clone)]
struct Eight<S: Geometry> {
    /// So many they are; the last one stands for those that are not there.
    count: usize,
    /// Their faces.
    faces: [u32; WIDTH],
    /// Places of bodies a and b in the columns.
    bodies: [(u32, u32); WIDTH],
    /// What was seen of both halves.
    then: [Then<S, [f64; HALF]>; 2],
    friction: [f32; WIDTH],
    spinning: [f32; WIDTH],
    /// As they lie in this step, and who stands.
    told: Lying<S>,
    stand: u32,
}

/// What the columns of bodies, coefficients and the order of faces hang on.
#[derive(PartialEq)]
struct Made<S: Space> {
    pairs: u64,
    bodies: u64,
    settings: Settings<S>,
}

/// Faces of the step before.
pub(crate) struct Standing<S: Geometry> {
    made: Option<Made<S>>,
    /// Counts what faces there were; one number, one list of them.
    number: u64,
    /// Their bodies, in the order of their pairs.
    faces: Vec<(u32, u32)>,
    /// The first face of each pair, and the end; the pair of each face; and pairs without a face.
    starts: Vec<u32>,
    pairs: Vec<u32>,
    vacant: Vec<u32>,
    /// Room for the pairs that a step looks at.
    asked: Vec<u32>,
    /// For which faces the packs were arranged, and what of them they hold; nothing where a step began that did not end.
    arranged: u64,
    seen: Option<Arc<Vec<Seen<S>>>>,
    eights: Vec<Eight<S>>,
    /// Their patches as the solver takes them.
    room: Vec<EightPatches<S>>,
    points: usize,
    /// Steps that went by them.
    lasted: u32,
    /// Steps to come that look at all pairs.
    pause: u32,
}

impl<S: Geometry> Default for Standing<S> {
    fn default() -> Self {
        let (made, number, faces, starts, pairs, vacant, asked) = Default::default();
        let (arranged, seen, eights, room, points, lasted, pause) = Default::default();
        Standing {
            made,
            number,
            faces,
            starts,
            pairs,
            vacant,
            asked,
            arranged,
            seen,
            eights,
            room,
            points,
            lasted,
            pause,
        }
    }
}

/// What is found of pairs without a face, and of those of which some face does not stand.
#[derive(Default)]
pub(super) struct Renewed<S: Geometry> {
    /// Faces that those had which may touch.
    had: usize,
    /// Somebody came or went.
    others: bool,
    /// Faces that were looked at anew, and what was found of each.
    faces: Vec<u32>,
    found: Found<S>,
}

/// Looks at them.
struct Renewing<'a, S: Geometry> {
    finding: &'a Finding<'a, S>,
    standing: &'a Standing<S>,
}

impl<S: Geometry> Finder<S> for Renewing<'_, S> {
    type Findings = Renewed<S>;

    fn begin(&self, renewed: &mut Renewed<S>) {
        (renewed.had, renewed.others) = (0, false);
        renewed.faces.clear();
        self.finding.begin(&mut renewed.found);
    }

    fn look(&self, nears: &Nears<'_, S>, renewed: &mut Renewed<S>) {
        let (starts, before) = (&self.standing.starts, self.finding.before);
        let mut points = std::mem::take(&mut renewed.found.points);
        points.look(nears, 0..nears.count());
        for k in 0..nears.count() {
            let place = nears.place(k);
            let faces = starts[place]..starts[place + 1];
            renewed.had += faces.len();
            let known = faces.start as usize..faces.end as usize;
            let known = Known { seen: &before.seen[known.clone()], forces: &before.forces[known] };
            let told = renewed.found.met.len();
            self.finding.look_at(&nears.couple(k), points.of(k), known, &mut renewed.found);
            renewed.others |= renewed.found.met.len() - told != faces.len();
            if renewed.others {
                break;
            }
            renewed.faces.extend(faces);
        }
        renewed.found.points = points;
        if renewed.others {
            return;
        }
        self.finding.lay(&mut renewed.found);
        renewed.others |= renewed.found.tally.loose > 0;
    }
}

impl<S: Geometry> Standing<S> {
    /// Takes in the faces of a step that looked at all pairs; tells their number, 0 where the next step cannot go by them.
    pub fn learn(&mut self, step: &SoftStep<S>, narrow_phase: &NarrowPhase<S>, ahead: &Ahead<S>) -> u64 {
        self.pause = self.pause.saturating_sub(1);
        let Ahead { bodies, settings, .. } = *ahead;
        let ((pairs, lasted), Some(number)) = (narrow_phase.pairs_that_last(), bodies.standing()) else {
            return 0;
        };
        // what may change from step to step in other ways
        let rolls = step.kinds.iter().any(|kind| kind.rolling > 0.0);
        let is_plain = step.tally.loose == 0 && step.tally.turns_slip.is_none() && !rolls;
        if !lasted || !is_plain || step.met.is_empty() || !bodies.asleep().is_empty() {
            return 0;
        }
        let faces = || step.met.iter().map(|met| (met.a, met.b));
        if self.is_made(pairs, number, settings) && faces().eq(self.faces.iter().copied()) {
            return self.number;
        }
        if bodies.awake().count() != bodies.movers().len() {
            return 0;
        }
        self.number += 1;
        self.made = Some(Made { pairs, bodies: number, settings: settings.clone() });
        self.faces.clear();
        self.faces.extend(faces());
        self.number
    }

    fn is_made(&self, pairs: u64, bodies: u64, settings: &Settings<S>) -> bool {
        let made = self.made.as_ref();
        made.is_some_and(|made| (made.pairs, made.bodies) == (pairs, bodies) && made.settings == *settings)
    }

    /// Whether a step whose last faces had this number may go by them.
    fn fits(&self, number: u64, narrow_phase: &NarrowPhase<S>, ahead: &Ahead<S>) -> bool {
        let Ahead { bodies, settings, .. } = *ahead;
        let stands = |bodies| self.is_made(narrow_phase.pairs_that_last().0, bodies, settings);
        number != 0
            && number == self.number
            && self.pause == 0
            && bodies.asleep().is_empty()
            && bodies.standing().is_some_and(stands)
    }

    /// Arranges what was seen of the faces by packs, unless it is; false where it is not of these faces.
    fn arrange(&mut self, step: &SoftStep<S>, narrow_phase: &NarrowPhase<S>, before: &PatchList<S>) -> bool {
        if before.forces.len() != self.faces.len() || before.seen.len() != self.faces.len() {
            return false;
        }
        let is_known = self.seen.as_ref().is_some_and(|seen| Arc::ptr_eq(seen, &before.seen));
        if self.arranged == self.number && is_known {
            return true;
        }
        self.seen = None;
        let movers = &narrow_phase.columns().movers;
        if self.arranged != self.number {
            let Some(bodies) = self.begin_pairs(narrow_phase) else { return false };
            self.put_side_by_side(step, &bodies);
            (self.arranged, self.lasted) = (self.number, 0);
        }
        let pair = |&(a, b): &(u32, u32)| (movers[a as usize].serial, movers[b as usize].serial);
        let fits = |eight: &Eight<S>| {
            let faces = eight.faces.iter().zip(&eight.bodies);
            faces.into_iter().all(|(face, bodies)| before.seen[*face as usize].pair == pair(bodies))
        };
        if !self.eights.iter().all(fits) {
            return false;
        }
        for eight in &mut self.eights {
            eight.see(movers, |face| &before.seen[face as usize]);
        }
        self.points = before.seen.iter().map(|seen| seen.names().len()).sum();
        self.seen = Some(before.seen.clone());
        true
    }

    /// Where each pair's faces begin; tells the places of each face's bodies in the columns.
    fn begin_pairs(&mut self, narrow_phase: &NarrowPhase<S>) -> Option<Vec<(u32, u32)>> {
        let (movers, pairs) = (&narrow_phase.columns().movers, narrow_phase.lasting_pairs());
        let mut bodies = Vec::with_capacity(self.faces.len());
        [&mut self.starts, &mut self.pairs, &mut self.vacant].into_iter().for_each(Vec::clear);
        for (&(i, j), place) in pairs.iter().zip(0..) {
            self.starts.push(bodies.len() as u32);
            let pair = (movers[i as usize].index as u32, movers[j as usize].index as u32);
            while self.faces.get(bodies.len()) == Some(&pair) {
                bodies.push((i, j));
                self.pairs.push(place);
            }
            if self.pairs.last() != Some(&place) {
                self.vacant.push(place);
            }
        }
        self.starts.push(bodies.len() as u32);
        (bodies.len() == self.faces.len()).then_some(bodies)
    }

    /// Eight patches to a pack, as the solver has them.
    fn put_side_by_side(&mut self, step: &SoftStep<S>, bodies: &[(u32, u32)]) {
        self.eights.clear();
        for members in step.solver.packs() {
            let face = |lane: usize| members[lane.min(members.len() - 1)];
            let faces: [u32; WIDTH] = std::array::from_fn(face);
            let kind = |lane: usize| -> &Coefficients {
                let met: &Met<S> = &step.met[faces[lane] as usize];
                &step.kinds[met.kind as usize]
            };
            self.eights.push(Eight {
                count: members.len(),
                faces,
                bodies: faces.map(|face| bodies[face as usize]),
                then: [Then::all([0.0; HALF]); 2],
                friction: std::array::from_fn(|lane| kind(lane).friction as f32),
                spinning: std::array::from_fn(|lane| kind(lane).spinning as f32),
                told: Lying::default(),
                stand: 0,
            });
        }
    }

    /// Asks of all patches whether they stand, and lays them as they lie now.
    fn lay(&mut self, finding: &Finding<'_, S>, meeting: &Meeting<'_, S>, workers: &Workers) {
        self.room.resize_with(self.eights.len(), EightPatches::default);
        let (eights, room) = (self.eights.as_mut_slice(), self.room.as_mut_slice());
        let lay = |(eights, room): &mut (&mut [Eight<S>], &mut [EightPatches<S>])| {
            dispatch(Laying { eights, room, meeting, finding });
        };
        if workers.is_alone() || eights.len() <= 3 * PACKS {
            return lay(&mut (eights, room));
        }
        workers.share(eights.chunks_mut(PACKS).zip(room.chunks_mut(PACKS)).collect(), lay);
    }

    /// Finds the pairs that must be looked at, ascending; tells how many faces they have.
    fn ask(&mut self) -> usize {
        self.asked.clone_from(&self.vacant);
        for eight in self.eights.iter().filter(|eight| eight.stand != ALL) {
            let falls = |lane: &usize| eight.stand >> lane & 1 == 0;
            let faces = (0..WIDTH).filter(falls).map(|lane| eight.faces[lane] as usize);
            self.asked.extend(faces.map(|face| self.pairs[face]));
        }
        if self.asked.len() == self.vacant.len() {
            return 0;
        }
        self.asked.sort_unstable();
        self.asked.dedup();
        let faces = |place: &u32| self.starts[*place as usize + 1] - self.starts[*place as usize];
        self.asked.iter().map(|place| faces(place) as usize).sum()
    }

    /// The smallest gap with its bodies: the first of equal ones.
    fn deepest(&self) -> Option<(f64, usize, usize)> {
        let (mut deepest, mut first) = (f64::INFINITY, NONE);
        for eight in &self.eights {
            for (gap, face) in eight.told.deepest.iter().zip(&eight.faces) {
                if *gap < deepest || (*gap == deepest && *face < first) {
                    (deepest, first) = (*gap, *face);
                }
            }
        }
        let (a, b) = *self.faces.get(first as usize)?;
        Some((deepest, a as usize, b as usize))
    }

    /// Normal of a face as it lies in this step, which is laid in packs.
    #[inline]
    pub fn normal(&self, (pack, lane): (usize, usize)) -> S::Vector {
        self.eights[pack].told.normal(lane)
    }

    /// The patches as they lie, pack by pack.
    pub fn room(&mut self) -> &mut Vec<EightPatches<S>> {
        &mut self.room
    }

    /// A step went by the faces, and left this of them.
    pub fn keep(&mut self, seen: &Arc<Vec<Seen<S>>>) {
        self.seen = Some(seen.clone());
    }
}

impl<S: Geometry> Eight<S> {
    fn couple<'a>(&self, lane: usize, movers: &'a [Mover<S>]) -> Couple<'a, S> {
        let (a, b) = self.bodies[lane];
        Couple { a: &movers[a as usize], b: &movers[b as usize] }
    }

    /// Takes in what was seen of them.
    fn see<'a>(&mut self, movers: &[Mover<S>], seen: impl Fn(u32) -> &'a Seen<S>) {
        for half in 0..2 {
            let sights: [Sight<'_, S>; HALF] = std::array::from_fn(|k| {
                let lane = half * HALF + k;
                let a_is_small = self.couple(lane, movers).a_is_small();
                Sight { seen: seen(self.faces[lane]), a_is_small }
            });
            self.then[half] = Then::of(Quartet(Portable, &sights)).each(Store);
        }
    }
}

/// Asks and lays packs.
struct Laying<'a, S: Geometry> {
    eights: &'a mut [Eight<S>],
    room: &'a mut [EightPatches<S>],
    meeting: &'a Meeting<'a, S>,
    finding: &'a Finding<'a, S>,
}

impl<S: Geometry> Job for Laying<'_, S> {
    type Output = ();
    #[inline(always)]
    fn work<L: Lanes>(self, lanes: L) {
        let Finding { ahead, before, h } = self.finding;
        let (none, forces) = (Patch::none(), before.forces.as_slice());
        let movers = self.meeting.columns.movers.as_slice();
        for (eight, room) in self.eights.iter_mut().zip(self.room) {
            eight.stand = 0;
            for (half, first) in [(0, 0), (1, HALF)] {
                let [i, j, k, l] = [first, first + 1, first + 2, first + 3];
                let couples = [
                    eight.couple(i, movers),
                    eight.couple(j, movers),
                    eight.couple(k, movers),
                    eight.couple(l, movers),
                ];
                let places = [eight.bodies[i], eight.bodies[j], eight.bodies[k], eight.bodies[l]];
                let [a, b, c, d] = [eight.faces[i], eight.faces[j], eight.faces[k], eight.faces[l]];
                let forces: [&PatchForce<S>; HALF] =
                    [&forces[a as usize], &forces[b as usize], &forces[c as usize], &forces[d as usize]];
                let four = Half::new(lanes, eight.then[half].each(Load(lanes)), &couples, forces);
                let mut room = room.half(half > 0);
                four.lay(lanes, *h, &mut room, first, &mut eight.told);
                let deepest = &eight.told.deepest[first..first + HALF];
                eight.stand |= four.stay(lanes, (ahead, self.meeting), places, deepest) << first;
                let (mut friction, mut twisting) = ([0.0; HALF], [0.0; HALF]);
                for k in 0..HALF {
                    friction[k] = eight.friction[first + k];
                    let lever = eight.told.levers[first + k] as f32;
                    twisting[k] = friction[k] * lever + eight.spinning[first + k];
                }
                room.set_friction(friction, twisting);
            }
            (eight.count..WIDTH).for_each(|lane| room.replace(lane, &none));
        }
    }
}

impl<S: Geometry> SoftStep<S> {
    /// Finds the faces of a step as those of the step before, where they stand; false where all pairs must be looked at.
    pub(super) fn find_again(
        &mut self,
        narrow_phase: &mut NarrowPhase<S>,
        standing: &mut Standing<S>,
        finding: &Finding<'_, S>,
        number: u64,
    ) -> bool {
        let Finding { ahead, before, .. } = finding;
        if !standing.fits(number, narrow_phase, ahead) || !standing.arrange(self, narrow_phase, before) {
            return false;
        }
        standing.lay(finding, &narrow_phase.meeting(ahead), &narrow_phase.workers);
        let (wanted, asked) = (standing.ask(), std::mem::take(&mut standing.asked));
        let mut renewed = std::mem::take(&mut self.renewed);
        narrow_phase.look_at(ahead, &asked, &Renewing { finding, standing }, &mut renewed);
        standing.asked = asked;
        let (mut had, mut others) = (0, false);
        for renewed in renewed.parts().map(|chunk| chunk.found()) {
            had += renewed.had;
            others |= renewed.others;
        }
        let stay = !others && had == wanted;
        if stay {
            self.all_again();
            let movers = &narrow_phase.columns().movers;
            renewed.parts().for_each(|chunk| self.renew(chunk.found(), standing, (before, movers)));
            let again = Again::all_of(standing.faces.len(), !self.fresh.is_empty());
            self.tally =
                Tally { points: standing.points, deepest: standing.deepest(), again, ..Tally::default() };
            standing.lasted += 1;
        } else {
            standing.pause = if standing.lasted < SOME { PAUSE } else { 0 };
        }
        self.renewed = renewed;
        stay
    }

    /// Puts faces that were looked at anew in the places of those that they were.
    fn renew(
        &mut self,
        renewed: &Renewed<S>,
        standing: &mut Standing<S>,
        (before, movers): (&PatchList<S>, &[Mover<S>]),
    ) {
        let found = &renewed.found;
        let all = renewed.faces.iter().zip(&found.met).zip(found.patches.list()).zip(&found.fresh);
        for (((face, new), patch), seen) in all {
            let (k, (pack, lane)) = (*face as usize, self.solver.place(*face as usize));
            // what the packs hold is of no step that ended
            standing.seen = None;
            standing.points += usize::from(new.count);
            standing.points -= before.seen[k].names().len();
            self.met[k] = Met { kind: self.met[k].kind, seen: self.fresh.len() as u32, again: false, ..*new };
            self.fresh.push(*seen);
            self.anew.push(*face);
            standing.room[pack].replace(lane, patch);
            let (eight, met, fresh) = (&mut standing.eights[pack], &self.met, &self.fresh);
            eight.told.replace(lane, new.normal, new.deepest);
            // the last one stands for those that are not there, in the other half too
            eight.see(movers, |face| {
                let Met { again, seen, .. } = met[face as usize];
                if again { &before.seen[face as usize] } else { &fresh[seen as usize] }
            });
        }
    }

    /// All faces are those of the step before, in their order.
    fn all_again(&mut self) {
        let again = |met: &mut Met<S>, k: u32| (met.again, met.seen) = (true, k);
        if std::mem::replace(&mut self.goes_again, true) {
            self.anew.iter().for_each(|k| again(&mut self.met[*k as usize], *k));
        } else {
            self.met.iter_mut().zip(0..).for_each(|(met, k)| again(met, k));
        }
        self.anew.clear();
        self.fresh.clear();
    }
}
