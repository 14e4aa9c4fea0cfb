//! What two bodies are asked of before their shapes are looked at, four numbers in a row, body after body: the rows of four bodies turn
//! into lanes. All of it stands in the columns too; here a pair finds it in a few reads.

use crate::ahead::{Mover, Moving};
use carom_geometry::{Aabb, Geometry};
use carom_math::lanes::{Four, Lanes};
use carom_math::several::Plain;
use carom_math::{Number, Precise, Several};

/// Rows of a body in space; the plane leaves one empty.
const ROWS: usize = 5;
/// Numbers in a row.
const WIDTH: usize = 4;

/// One body's numbers: its box, place, velocity and spin, and then those of [`Rest`].
#[derive(Clone, Copy, Default)]
#[repr(C, align(32))]
pub(crate) struct Flight([[f64; WIDTH]; ROWS]);

/// Numbers that every space has one of.
struct Rest;

impl Rest {
    const MARGIN: usize = 0;
    const ARM: usize = 1;
    const EXTENT: usize = 2;
    const FALLS: usize = 3;
    const LEAST: usize = 4;
    const ALL: usize = 5;
}

/// Where the numbers of a space begin: of the smallest and the largest corner, place, velocity, spin, and the rest.
#[inline(always)]
fn begins<S: Geometry>() -> [usize; 6] {
    let d = S::DIM;
    [0, d, 2 * d, 3 * d, 4 * d, 4 * d + S::SPIN]
}

/// How many rows a space has.
#[inline(always)]
fn rows<S: Geometry>() -> usize {
    (begins::<S>()[5] + Rest::ALL).div_ceil(WIDTH)
}

impl Flight {
    /// A body with its box, which is grown by a margin \[m\].
    #[inline(always)]
    pub fn of<S: Geometry>(bounds: &Aabb<S>, margin: f64, mover: &Mover<S>) -> Self {
        let mut own = Flight::default();
        let [low, high, place, velocity, spin, rest] = begins::<S>();
        let mut put = |k: usize, x: f64| own.0[k / WIDTH][k % WIDTH] = x;
        for k in 0..S::DIM {
            put(low + k, bounds.min[k]);
            put(high + k, bounds.max[k]);
            put(place + k, mover.position[k]);
            put(velocity + k, mover.twist.linear[k]);
        }
        for k in 0..S::SPIN {
            put(spin + k, mover.twist.angular[k]);
        }
        put(rest + Rest::MARGIN, margin);
        put(rest + Rest::ARM, mover.arm);
        put(rest + Rest::EXTENT, mover.extent);
        put(rest + Rest::FALLS, mover.falls);
        put(rest + Rest::LEAST, mover.least);
        own
    }
}

/// Four bodies side by side.
#[derive(Clone, Copy)]
pub(crate) struct Flights<S: Geometry, F: Number> {
    low: S::Vectors<F>,
    high: S::Vectors<F>,
    moving: Moving<S, F>,
    /// Shares of pairs' margins \[m\].
    pub margin: F,
    arm: F,
    extent: F,
    /// What gravity and loads do to their surfaces \[m/s^2\].
    pub falls: F,
    /// The least margins \[m\].
    pub least: F,
}

impl<S: Geometry, F: Four + Number> Flights<S, F> {
    /// Of four bodies.
    #[inline(always)]
    pub fn of<L: Lanes<Four = F>>(lanes: L, [a, b, c, d]: [&Flight; WIDTH]) -> Self {
        let mut numbers = [lanes.four_of(0.0); ROWS * WIDTH];
        for r in 0..rows::<S>() {
            let records = [&a.0[r], &b.0[r], &c.0[r], &d.0[r]].map(|row| lanes.four(row));
            numbers[WIDTH * r..WIDTH * (r + 1)].copy_from_slice(&Four::turned(records));
        }
        let [low, high, place, velocity, spin, rest] = begins::<S>();
        let vectors = |first: usize| several(|k| numbers[first + k]);
        Flights {
            low: vectors(low),
            high: vectors(high),
            moving: Moving {
                place: vectors(place),
                velocity: vectors(velocity),
                spin: several(|k| numbers[spin + k]),
            },
            margin: numbers[rest + Rest::MARGIN],
            arm: numbers[rest + Rest::ARM],
            extent: numbers[rest + Rest::EXTENT],
            falls: numbers[rest + Rest::FALLS],
            least: numbers[rest + Rest::LEAST],
        }
    }

    /// How far their boxes are apart from others \[m\], as [`Aabb::apart`] has it.
    #[inline(always)]
    pub fn apart(&self, other: &Self) -> F {
        let along = |k: usize| (self.low[k] - other.high[k]).max(other.low[k] - self.high[k]);
        (1..S::DIM).fold(along(0), |most, k| most.max(along(k)))
    }
}

impl<S: Geometry, F: Four + Precise> Flights<S, F> {
    /// How fast their surfaces and those of others can come towards each other \[m/s\].
    #[inline(always)]
    pub fn closing(&self, other: &Self) -> F {
        // of two as large as each other the first is taken for the smaller
        let if_larger = |yes: F, no: F| other.extent.if_less(self.extent, yes, no);
        let (own, others) = (&self.moving, &other.moving);
        let small = Moving::mixed(others, own, if_larger);
        let large = Moving::mixed(own, others, if_larger);
        Moving::closing(&small, &large, if_larger(other.arm, self.arm))
    }
}

impl<S: Geometry, F: Number> Moving<S, F> {
    /// The numbers of two, one by one.
    #[inline(always)]
    fn mixed(one: &Self, other: &Self, mix: impl Fn(F, F) -> F) -> Self {
        Moving {
            place: several(|k| mix(one.place[k], other.place[k])),
            velocity: several(|k| mix(one.velocity[k], other.velocity[k])),
            spin: several(|k| mix(one.spin[k], other.spin[k])),
        }
    }
}

/// Several numbers by their places.
#[inline(always)]
fn several<T: Plain, A: Several<T>>(of: impl Fn(usize) -> T) -> A {
    let mut out = A::all(of(0));
    for k in 1..A::LEN {
        out[k] = of(k);
    }
    out
}
