//! What pairs are looked at by, body after body: where each body with a shape is in the step ahead, what it takes up there, how fast
//! and how far it goes. Workers write stretches of the columns, each its own.

use crate::ahead::{Ahead, Mover};
use crate::flight::Flight;
use carom_geometry::{Aabb, Geometry};
use carom_math::workers::Cut;
use carom_math::{Column, Pose, Rotation, Workers};

/// Bodies that a worker takes at a time; nothing depends on it but the time.
pub(crate) const CHUNK: usize = 128;

/// Columns of bodies with a shape.
pub(crate) struct Columns<S: Geometry> {
    pub movers: Vec<Mover<S>>,
    pub poses: Vec<Pose<S>>,
    /// Boxes, grown by the margins.
    pub bounds: Vec<Aabb<S>>,
    /// Shares of pairs' margins \[m\].
    pub margins: Vec<f64>,
    /// The way that a point of each body's surface has behind it at most, turning included, since somebody began to count \[m\].
    pub ways: Vec<f64>,
    /// Speeds, own ones and those shared with neighbours \[m/s\].
    pub own: Vec<f64>,
    pub speeds: Vec<f64>,
    /// When something may halt each \[s\] from the step's start on: infinite where nothing does, 0 of what is swift while nobody
    /// knows what does.
    pub halts: Vec<f64>,
    /// Whether anything may be halted.
    pub somebody_halts: bool,
    /// What pairs of them are asked of first, and whether that of all is of the step ahead: of those that move it is made where asked
    /// for, for where nearly all stands few are.
    pub flights: Vec<Flight>,
    are_flights_made: bool,
    /// Whether all of them want to collide with each other.
    pub all_collide: bool,
}

impl<S: Geometry> Default for Columns<S> {
    fn default() -> Self {
        let (movers, poses, bounds, margins) = Default::default();
        let (ways, own, speeds, halts, flights) = Default::default();
        let (somebody_halts, are_flights_made, all_collide) = (false, false, true);
        Columns {
            movers,
            poses,
            bounds,
            margins,
            ways,
            own,
            speeds,
            halts,
            somebody_halts,
            flights,
            are_flights_made,
            all_collide,
        }
    }
}

impl<S: Geometry> Columns<S> {
    /// Room for these bodies, which have no way behind them.
    pub fn make_room(&mut self, movers: impl ExactSizeIterator<Item = Mover<S>>) {
        let count = movers.len();
        self.movers.clear();
        self.movers.extend(movers);
        self.poses.resize(count, Pose::default());
        self.bounds.resize(count, Aabb { min: S::Vector::ZERO, max: S::Vector::ZERO });
        self.ways.clear();
        for column in [&mut self.ways, &mut self.margins, &mut self.speeds, &mut self.own] {
            column.resize(count, 0.0);
        }
        self.halts.clear();
        self.halts.resize(count, f64::INFINITY);
        self.flights.resize(count, Flight::default());
        self.all_collide = Mover::all_collide(&self.movers);
    }

    /// Takes in where all of them are.
    pub fn place_all(&mut self, colliders: &[S::Collider], ahead: &Ahead<S>) {
        let count = self.movers.len();
        let mut all = self.stretch();
        for k in 0..count {
            all.place(k, colliders, ahead);
            all.make_flight(k);
        }
        self.are_flights_made = true;
    }

    /// The same of some that rest, ascending.
    pub fn place_resting(
        &mut self,
        some: &[u32],
        colliders: &[S::Collider],
        ahead: &Ahead<S>,
        workers: &Workers,
    ) {
        self.each(some, workers, |stretch, k| {
            stretch.place(k, colliders, ahead);
            stretch.make_flight(k);
        });
    }

    /// The same of some that move, ascending; their flights are made on request.
    pub fn place(
        &mut self,
        (some, with_flights): (&[u32], bool),
        colliders: &[S::Collider],
        ahead: &Ahead<S>,
        workers: &Workers,
    ) {
        if with_flights {
            self.place_resting(some, colliders, ahead, workers);
        } else {
            self.each(some, workers, |stretch, k| stretch.place(k, colliders, ahead));
        }
        self.are_flights_made = with_flights;
    }

    /// Makes the flights of those that move, ascending, unless they are made.
    pub fn make_flights(&mut self, moving: &[u32], workers: &Workers) {
        if !std::mem::replace(&mut self.are_flights_made, true) {
            self.each(moving, workers, |stretch, k| stretch.make_flight(k));
        }
    }

    /// Makes those of some pairs' bodies, unless they are made.
    pub fn make_flights_of(&mut self, pairs: impl Iterator<Item = (u32, u32)>) {
        if !self.are_flights_made {
            let mut all = self.stretch();
            pairs.flat_map(|(i, j)| [i, j]).for_each(|k| all.make_flight(k as usize));
        }
    }

    /// Does something with some bodies, ascending.
    fn each(&mut self, some: &[u32], workers: &Workers, of: impl Fn(&mut Stretch<'_, S>, usize) + Sync) {
        // beside them is nothing, which takes no memory
        let mut nothing = vec![(); some.len()];
        let columns = (self.stretch(), some, nothing.as_mut_slice());
        workers.along(columns, CHUNK, |stretch, k, ()| of(stretch, k as usize));
    }

    fn stretch(&mut self) -> Stretch<'_, S> {
        let Columns { movers, poses, bounds, margins, ways, own, speeds, halts, flights, .. } = self;
        Stretch { first: 0, movers, poses, bounds, margins, ways, own, speeds, halts, flights }
    }
}

/// A stretch of the columns.
struct Stretch<'a, S: Geometry> {
    /// Place of its first body.
    first: usize,
    movers: &'a mut [Mover<S>],
    poses: &'a mut [Pose<S>],
    bounds: &'a mut [Aabb<S>],
    margins: &'a mut [f64],
    ways: &'a mut [f64],
    own: &'a mut [f64],
    speeds: &'a mut [f64],
    halts: &'a mut [f64],
    flights: &'a mut [Flight],
}

impl<S: Geometry> Cut for Stretch<'_, S> {
    fn cut_behind(self, last: usize) -> (Self, Self) {
        let count = last + 1 - self.first;
        let (movers, poses) = (self.movers.split_at_mut(count), self.poses.split_at_mut(count));
        let (bounds, margins) = (self.bounds.split_at_mut(count), self.margins.split_at_mut(count));
        let (ways, own) = (self.ways.split_at_mut(count), self.own.split_at_mut(count));
        let (speeds, halts) = (self.speeds.split_at_mut(count), self.halts.split_at_mut(count));
        let flights = self.flights.split_at_mut(count);
        (
            Stretch {
                first: self.first,
                movers: movers.0,
                poses: poses.0,
                bounds: bounds.0,
                margins: margins.0,
                ways: ways.0,
                own: own.0,
                speeds: speeds.0,
                halts: halts.0,
                flights: flights.0,
            },
            Stretch {
                first: last + 1,
                movers: movers.1,
                poses: poses.1,
                bounds: bounds.1,
                margins: margins.1,
                ways: ways.1,
                own: own.1,
                speeds: speeds.1,
                halts: halts.1,
                flights: flights.1,
            },
        )
    }
}

impl<S: Geometry> Stretch<'_, S> {
    /// Box, pose, speed and margin of a body in the step ahead.
    #[inline(always)]
    fn place(&mut self, k: usize, colliders: &[S::Collider], ahead: &Ahead<S>) {
        let (collider, k) = (&colliders[k], k - self.first);
        let mover = &mut self.movers[k];
        mover.moved(ahead);
        let (speed, pose) = (mover.speed(ahead.dt), mover.shape_pose());
        let margin = mover.margin(ahead, speed);
        self.bounds[k] = S::bounds(collider, &pose, margin);
        self.ways[k] += way(&self.poses[k], &pose, mover.reach);
        (self.speeds[k], self.own[k], self.margins[k]) = (speed, speed, margin);
        let is_swift = mover.is_swift(mover.twist.linear.norm(), ahead.dt);
        self.halts[k] = if is_swift { 0.0 } else { f64::INFINITY };
        self.poses[k] = pose;
    }

    /// What pairs of a body that is placed are asked of first.
    #[inline(always)]
    fn make_flight(&mut self, k: usize) {
        let k = k - self.first;
        self.flights[k] = Flight::of(&self.bounds[k], self.margins[k], &self.movers[k]);
    }
}

/// How far a point that is within `reach` \[m\] of the frame's origin goes at most from one pose to another \[m\]: turning by an angle
/// moves it by 2 reach sin(angle/2), and the numbers of the two rotations are apart by 2 sin(angle/4) in space, 2 sin(angle/2)
/// in the plane.
fn way<S: Geometry>(from: &Pose<S>, to: &Pose<S>, reach: f64) -> f64 {
    let numbers = from.rotation.as_slice().iter().zip(to.rotation.as_slice());
    let apart = numbers.map(|(p, q)| (p - q) * (p - q)).sum::<f64>();
    let turned = if apart > 0.0 { 2.0 * reach * apart.sqrt() } else { 0.0 };
    (to.position - from.position).norm() + turned
}
