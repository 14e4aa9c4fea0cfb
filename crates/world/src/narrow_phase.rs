//! From bodies that are near to contacts with names, gaps and coefficients. Knows no velocities' future:
//! what a contact means for the motion is the scheme's matter.

use crate::ahead::{Ahead, Mover};
use crate::bodies::Bodies;
use crate::columns::{CHUNK, Columns};
use crate::contact_id::PairId;
use crate::halting::Halting;
use crate::lasting::Lasting;
use crate::material::Coefficients;
use crate::meeting::Meeting;
use crate::nears::{Asked, Nears, Points};
use crate::observe::step_times::Laps;
use crate::settings::{Scheme, Settings};
use carom_geometry::broad_phase::{BroadPhase, Changed};
use carom_geometry::{ContactPoint, Geometry};
use carom_math::workers::Memory;
use carom_math::{Column, Space, Workers};
use std::collections::BTreeMap;

/// One contact between two bodies.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Touch<S: Space> {
    /// Names the contact from step to step.
    pub id: u64,
    /// Index of body a.
    pub a: usize,
    /// Index of body b.
    pub b: usize,
    /// The one point both bodies use \[m\].
    pub point: S::Vector,
    /// Unit normal from b to a.
    pub normal: S::Vector,
    /// Distance of the surfaces \[m\]; negative when they overlap.
    pub gap: f64,
    /// Coefficient of friction of the pair \[1\].
    pub friction: f64,
    /// Coefficient of rolling friction \[m\].
    pub rolling: f64,
    /// Coefficient of spinning friction \[m\].
    pub spinning: f64,
    /// Coefficient of restitution of the pair \[1\].
    pub restitution: f64,
    /// Coefficient of tangential restitution of the pair \[1\].
    pub tangential_restitution: f64,
}

/// What looks at pairs that may touch. Workers ask at once, each with findings of its own.
pub trait Finder<S: Geometry>: Sync {
    /// What is found of a chunk of pairs.
    type Findings: Default + Send;
    /// Told before the first pairs of a chunk.
    fn begin(&self, findings: &mut Self::Findings);
    /// Looks at some pairs; those of the same findings come in their order.
    fn look(&self, nears: &Nears<'_, S>, findings: &mut Self::Findings);
}

/// What a worker finds of a chunk of pairs, and room for those that may touch.
#[derive(Default)]
pub struct Chunk<F> {
    asked: Vec<Asked>,
    found: F,
}

impl<F> Chunk<F> {
    /// What was found.
    pub fn found(&mut self) -> &mut F {
        &mut self.found
    }
}

/// Finds touches.
struct Touching<'a, S: Geometry>(&'a Bodies<S>, &'a Settings<S>);

/// Touches of a chunk of pairs, and room for their points.
type Findings<S> = (Vec<Touch<S>>, Points<S>);

impl<S: Geometry> Finder<S> for Touching<'_, S> {
    type Findings = Findings<S>;
    fn begin(&self, _: &mut Findings<S>) {}
    fn look(&self, nears: &Nears<'_, S>, (touches, points): &mut Findings<S>) {
        points.look(nears, 0..nears.count());
        for k in 0..nears.count() {
            touches_of(self.0, self.1, nears.couple(k).indices(), points.of(k), touches);
        }
    }
}

/// Looks at no pair.
struct Nobody;

impl<S: Geometry> Finder<S> for Nobody {
    type Findings = ();
    fn begin(&self, (): &mut ()) {}
    fn look(&self, _: &Nears<'_, S>, (): &mut ()) {}
}

/// Finds contacts; holds memory, the broad phase's order and the boxes of bodies that stand, nothing that changes an
/// answer.
#[derive(Default)]
pub struct NarrowPhase<S: Geometry> {
    broad: BroadPhase<S>,
    lasting: Lasting<S>,
    /// For which standing bodies and which margin the boxes of those that stand were made.
    made_for: Option<(u64, Option<f64>)>,
    /// For which sleeping bodies their boxes were made.
    slept_for: Option<u64>,
    /// Places in the columns of bodies that may move, and of those that sleep.
    moving: Vec<u32>,
    asleep: Vec<u32>,
    /// Place of each body in the columns; `u32::MAX` of those without a shape.
    place_of: Vec<u32>,
    columns: Columns<S>,
    colliders: Colliders<S>,
    surfaces: Surfaces,
    halting: Halting<S>,
    indices: Vec<usize>,
    movable: Vec<bool>,
    /// Who shares the work.
    pub(crate) workers: Workers,
    findings: Memory<Chunk<Findings<S>>>,
    /// Time that went into pairs since somebody took it \[s\].
    pub(crate) pairing: f64,
}

impl<S: Geometry> NarrowPhase<S> {
    /// All contacts whose gap is at most the pair's margin, in order of (a, b, feature).
    pub fn update(&mut self, ahead: &Ahead<S>, out: &mut Vec<Touch<S>>) {
        out.clear();
        let mut findings = std::mem::take(&mut self.findings);
        let finder = Touching(ahead.bodies, ahead.settings);
        self.search(ahead, &finder, &mut findings);
        findings.parts().for_each(|chunk| take(&mut chunk.found.0, out));
        self.findings = findings;
    }

    /// Hands all pairs that may touch to a finder; what it finds of each chunk of them is in the parts of `findings` then, in the
    /// pairs' order.
    pub fn search<F: Finder<S>>(
        &mut self,
        ahead: &Ahead<S>,
        finder: &F,
        findings: &mut Memory<Chunk<F::Findings>>,
    ) {
        self.pair(ahead);
        self.look(ahead, finder, findings);
    }

    /// Finds the pairs that may touch in the step ahead.
    pub(crate) fn pair(&mut self, ahead: &Ahead<S>) {
        let mut clock = Laps::start();
        self.find_pairs(ahead);
        self.pairing += clock.lap();
    }

    fn find_pairs(&mut self, ahead: &Ahead<S>) {
        let (stands_as_before, sleeps_as_before) = self.prepare(ahead);
        let Ahead { bodies, settings, .. } = *ahead;
        let (others, asleep) = (self.moving.as_slice(), self.asleep.as_slice());
        let changed = Changed { others, asleep, stands_as_before, sleeps_as_before };
        if lasts(settings) {
            // of what rests nothing is swift, and it may be a million bodies
            self.columns.somebody_halts = others.iter().any(|k| self.columns.halts[*k as usize] == 0.0);
            if !self.lasting.stand(&self.columns.bounds, &changed, &self.workers) {
                self.columns.make_flights(others, &self.workers);
                let columns = &self.columns;
                let boxes = (columns.bounds.as_slice(), self.movable.as_slice());
                let meeting = Meeting::new(columns, ahead);
                let sift = |pairs: &mut Vec<(u32, u32)>| meeting.sift(pairs);
                self.lasting.search(&mut self.broad, boxes, changed, &sift, &self.workers);
            }
            return self.halt(ahead);
        }
        let (data, indices) = (&bodies.data, &self.indices);
        let may_pair = |i: usize, j: usize| {
            let (a, b) = (&data[indices[i]], &data[indices[j]]);
            let moves = a.inverse_mass > 0.0 || b.inverse_mass > 0.0;
            let groups = a.groups & b.collides_with != 0 && b.groups & a.collides_with != 0;
            moves && groups && !bodies.joints.keeps_apart(indices[i], indices[j])
        };
        let sift = |pairs: &mut Vec<(u32, u32)>| pairs.retain(|(i, j)| may_pair(*i as usize, *j as usize));
        let (columns, colliders) = (&mut self.columns, self.colliders.0.as_slice());
        self.lasting.forget();
        let boxes = (columns.bounds.as_slice(), self.movable.as_slice());
        let pairs = self.broad.update_some(boxes, changed, &sift, &self.workers);
        if share_speeds(pairs, &self.movable, &mut columns.speeds, &columns.own) {
            let faster = |k: &&u32| columns.speeds[**k as usize] != columns.own[**k as usize];
            for k in self.moving.iter().filter(faster).map(|k| *k as usize) {
                columns.margins[k] = columns.movers[k].margin(ahead, columns.speeds[k]);
                columns.bounds[k] = S::bounds(&colliders[k], &columns.poses[k], columns.margins[k]);
            }
            let changed = Changed { stands_as_before: true, sleeps_as_before: true, ..changed };
            let boxes = (columns.bounds.as_slice(), self.movable.as_slice());
            self.broad.update_some(boxes, changed, &sift, &self.workers);
        }
    }

    /// Tells every body when it may be halted in the step ahead, where its scheme looks that far.
    fn halt(&mut self, ahead: &Ahead<S>) {
        let mut halting = std::mem::take(&mut self.halting);
        let meeting = self.meeting(ahead);
        if meeting.soft {
            let (pairs, remembered) = self.lasting.pairs();
            let look = |place: usize, margin: f64, points: &mut Vec<ContactPoint<S>>| {
                let (i, j) = pairs[place];
                let asked = [Asked { i, j, place, margin }];
                let (meeting, colliders) = (&meeting, self.colliders.0.as_slice());
                Nears { asked: &asked, meeting, colliders, remembered }.near(0).contacts(points);
            };
            if let Some((somebody_halts, times)) = halting.find(&meeting, pairs, look) {
                self.columns.halts.copy_from_slice(times);
                self.columns.somebody_halts = somebody_halts;
            }
        }
        self.halting = halting;
    }

    /// Hands the pairs that were found for this step to a finder, as [`NarrowPhase::search`] does.
    pub(crate) fn look<F: Finder<S>>(
        &mut self,
        ahead: &Ahead<S>,
        finder: &F,
        findings: &mut Memory<Chunk<F::Findings>>,
    ) {
        let lasts = lasts(ahead.settings);
        if lasts {
            self.columns.make_flights(&self.moving, &self.workers);
        }
        let (pairs, meeting) =
            (if lasts { self.lasting.pairs().0 } else { self.broad.pairs() }, self.meeting(ahead));
        let find = |first: usize, pairs: &[(u32, u32)], chunk: &mut Chunk<F::Findings>| {
            finder.begin(&mut chunk.found);
            for (some, first) in pairs.chunks(CHUNK).zip((first..).step_by(CHUNK)) {
                self.hand((&meeting, lasts), some, |k| first + k, (finder, chunk));
            }
        };
        self.workers.over(pairs, CHUNK, findings, find);
    }

    /// The same with some of the pairs that last, by their places, ascending.
    pub(crate) fn look_at<F: Finder<S>>(
        &mut self,
        ahead: &Ahead<S>,
        places: &[u32],
        finder: &F,
        findings: &mut Memory<Chunk<F::Findings>>,
    ) {
        let pairs = self.lasting.pairs().0;
        self.columns.make_flights_of(places.iter().map(|place| pairs[*place as usize]));
        let meeting = self.meeting(ahead);
        let find = |_: usize, places: &[u32], chunk: &mut Chunk<F::Findings>| {
            finder.begin(&mut chunk.found);
            for places in places.chunks(CHUNK) {
                let mut some = [(0, 0); CHUNK];
                for (pair, place) in some.iter_mut().zip(places) {
                    *pair = pairs[*place as usize];
                }
                self.hand((&meeting, true), &some[..places.len()], |k| places[k] as usize, (finder, chunk));
            }
        };
        self.workers.over(places, CHUNK, findings, find);
    }

    /// Hands a chunk of pairs to a finder, those of them that may touch.
    #[inline(always)]
    fn hand<F: Finder<S>>(
        &self,
        (meeting, lasts): (&Meeting<'_, S>, bool),
        pairs: &[(u32, u32)],
        place: impl Fn(usize) -> usize,
        (finder, Chunk { asked, found }): (&F, &mut Chunk<F::Findings>),
    ) {
        let columns = &self.columns;
        let of_boxes = |&(i, j): &(u32, u32)| columns.margins[i as usize] + columns.margins[j as usize];
        let margins = if lasts {
            meeting.margins(pairs)
        } else {
            std::array::from_fn(|k| pairs.get(k).map_or(-1.0, of_boxes))
        };
        asked.clear();
        let near = pairs.iter().zip(&margins).enumerate().filter(|(_, (_, margin))| **margin >= 0.0);
        asked.extend(near.map(|(k, (&(i, j), &margin))| Asked { i, j, place: place(k), margin }));
        let remembered = if lasts { self.lasting.pairs().1 } else { &[] };
        finder.look(&Nears { asked, meeting, colliders: &self.colliders.0, remembered }, found);
    }

    /// The number of the list of pairs that last, and whether it is that of the step before.
    pub(crate) fn pairs_that_last(&self) -> (u64, bool) {
        (self.lasting.number(), self.lasting.stood())
    }

    /// The list, by places in the columns.
    pub(crate) fn lasting_pairs(&self) -> &[(u32, u32)] {
        self.lasting.pairs().0
    }

    /// What pairs are looked at by.
    pub(crate) fn columns(&self) -> &Columns<S> {
        &self.columns
    }

    /// Who meets whom in the step ahead.
    pub(crate) fn meeting<'a>(&'a self, ahead: &Ahead<'a, S>) -> Meeting<'a, S> {
        Meeting::new(&self.columns, ahead)
    }

    /// Arranges what stands, as the first search would.
    pub(crate) fn arrange(&mut self, ahead: &Ahead<S>) {
        self.search(ahead, &Nobody, &mut Memory::default());
    }

    /// Bounds of all bodies with a shape, grown by half of each pair's margin; of those that stand or sleep only where they
    /// are others than before. True where they are not, of those that stand and of those that sleep.
    fn prepare(&mut self, ahead: &Ahead<S>) -> (bool, bool) {
        let Ahead { bodies, settings, .. } = *ahead;
        let wanted = bodies.standing().map(|number| (number, settings.contact_margin));
        let stands = wanted.is_some() && wanted == self.made_for;
        if !stands {
            self.make_room(bodies);
            self.made_for = wanted;
        }
        let sleeps = stands && self.slept_for == Some(bodies.sleep_number());
        if !sleeps {
            self.part(bodies);
            self.slept_for = Some(bodies.sleep_number());
        }
        let (moving, asleep) = (std::mem::take(&mut self.moving), std::mem::take(&mut self.asleep));
        if stands {
            let slept = if sleeps { &[] } else { asleep.as_slice() };
            // where pairs were searched for in the step before they will be in this one, as a rule
            let moving = (moving.as_slice(), !self.lasting.stood());
            self.columns.place(moving, &self.colliders.0, ahead, &self.workers);
            self.columns.place_resting(slept, &self.colliders.0, ahead, &self.workers);
        } else {
            self.columns.place_all(&self.colliders.0, ahead);
        }
        (self.moving, self.asleep) = (moving, asleep);
        (stands, sleeps)
    }

    /// Sorts the bodies that are not fixed by whether they sleep.
    fn part(&mut self, bodies: &Bodies<S>) {
        let places = |list: &[u32], to: &mut Vec<u32>| {
            to.clear();
            to.extend(list.iter().map(|i| self.place_of[*i as usize]).filter(|k| *k != u32::MAX));
        };
        places(bodies.movers(), &mut self.moving);
        places(bodies.asleep(), &mut self.asleep);
    }

    /// Columns of all bodies with a shape.
    fn make_room(&mut self, bodies: &Bodies<S>) {
        self.indices.clear();
        self.movable.clear();
        self.place_of.clear();
        self.place_of.resize(bodies.len(), u32::MAX);
        self.colliders.0.clear();
        for (i, d) in bodies.data.iter().enumerate() {
            let Some(collider) = &d.collider else { continue };
            self.colliders.0.push(collider.clone());
            self.place_of[i] = self.indices.len() as u32;
            self.indices.push(i);
            self.movable.push(d.inverse_mass > 0.0);
        }
        self.surfaces.number(bodies, &self.indices);
        let mover = |(i, surface): (&usize, &u32)| Mover::of(&bodies.data[*i], *i, *surface);
        self.columns.make_room(self.indices.iter().zip(&self.surfaces.of).map(mover));
        // places may be those of others now
        self.lasting.forget_looks();
    }
}

/// Whether pairs are looked for in boxes that last from step to step.
fn lasts<S: Space>(settings: &Settings<S>) -> bool {
    settings.scheme == Scheme::SoftStep || settings.contact_margin.is_some()
}

/// Shapes made ready, in the columns' order.
struct Colliders<S: Geometry>(Vec<S::Collider>);

impl<S: Geometry> Default for Colliders<S> {
    fn default() -> Self {
        Colliders(Vec::new())
    }
}

/// Numbers of surfaces.
#[derive(Default)]
struct Surfaces {
    /// Surface of each body in the columns.
    of: Vec<u32>,
    known: BTreeMap<([u64; 5], Option<usize>), u32>,
}

impl Surfaces {
    /// Numbers the surfaces of some bodies, equal ones equally.
    fn number<S: Geometry>(&mut self, bodies: &Bodies<S>, some: &[usize]) {
        self.known.clear();
        self.of.clear();
        for d in some.iter().map(|i| &bodies.data[*i]) {
            let numbers = [
                d.friction,
                d.rolling_friction,
                d.spinning_friction,
                d.restitution,
                d.tangential_restitution,
            ];
            let next = self.known.len() as u32;
            self.of.push(*self.known.entry((numbers.map(f64::to_bits), d.material)).or_insert(next));
        }
    }
}

/// Moves all items to the end of a list; of an empty list without a copy.
pub(crate) fn take<T>(items: &mut Vec<T>, all: &mut Vec<T>) {
    if all.is_empty() { std::mem::swap(items, all) } else { all.append(items) }
}

/// Appends the touches of a pair from its contact points.
pub fn touches_of<S: Geometry>(
    bodies: &Bodies<S>,
    settings: &Settings<S>,
    (a, b): (usize, usize),
    points: &[ContactPoint<S>],
    out: &mut Vec<Touch<S>>,
) {
    if points.is_empty() {
        return;
    }
    let of_all = InCommon::of(bodies, settings, (a, b));
    out.extend(points.iter().map(|p| of_all.touch(p)));
}

/// What all contacts of a pair have in common.
pub(crate) struct InCommon {
    pair: (usize, usize),
    name: PairId,
    coefficients: Coefficients,
}

impl InCommon {
    /// Of the contacts of two bodies.
    pub fn of<S: Geometry>(bodies: &Bodies<S>, settings: &Settings<S>, (a, b): (usize, usize)) -> Self {
        InCommon {
            pair: (a, b),
            name: PairId::of((bodies.data[a].serial, bodies.data[b].serial)),
            coefficients: Coefficients::of(bodies, settings, (a, b)),
        }
    }
    /// The contact at a point.
    #[inline]
    pub fn touch<S: Geometry>(&self, p: &ContactPoint<S>) -> Touch<S> {
        let c = &self.coefficients;
        Touch {
            id: self.name.contact(p.feature),
            a: self.pair.0,
            b: self.pair.1,
            point: p.point,
            normal: p.normal,
            gap: p.gap,
            friction: c.friction,
            rolling: c.rolling,
            spinning: c.spinning,
            restitution: c.restitution,
            tangential_restitution: c.tangential_restitution,
        }
    }
}

/// Restitution of a pair's contacts \[1\].
pub fn restitution_of<S: Geometry>(
    bodies: &Bodies<S>,
    settings: &Settings<S>,
    (a, b): (usize, usize),
) -> f64 {
    let (one, other) = (&bodies.data[a], &bodies.data[b]);
    let said = bodies.materials.said_of(one.material, other.material);
    let mixed = settings.restitution_mixing.mix(one.restitution, other.restitution);
    said.and_then(|p| p.restitution).unwrap_or(mixed)
}

/// A body that a fast one is about to hit may be fast itself before the step is over: pairs share their speeds.
/// True when that changed one by more than what the margins allow for anyway.
fn share_speeds(pairs: &[(u32, u32)], movable: &[bool], speeds: &mut [f64], own: &[f64]) -> bool {
    let mut changed = false;
    for &(i, j) in pairs {
        let (i, j) = (i as usize, j as usize);
        let faster = own[i].max(own[j]);
        for k in [i, j] {
            if movable[k] && faster > 2.0 * own[k] && faster > speeds[k] {
                speeds[k] = faster;
                changed = true;
            }
        }
    }
    changed
}

/// Smallest extent among bodies that can move \[m\]; the scene's length scale. `None` without such bodies.
pub fn smallest_extent<S: Geometry>(bodies: &Bodies<S>) -> Option<f64> {
    let sizes = bodies.data.iter().filter(|d| d.inverse_mass > 0.0 && d.extent > 0.0 && d.extent.is_finite());
    sizes.map(|d| d.extent).min_by(f64::total_cmp)
}

/// Velocity of a's point relative to b's along the normal \[m/s\].
pub fn normal_velocity<S: Geometry>(bodies: &Bodies<S>, t: &Touch<S>) -> f64 {
    let m = &bodies.motion;
    let at = |i: usize| m.twist(i).at(t.point - m.position[i]);
    t.normal.dot(at(t.a) - at(t.b))
}
