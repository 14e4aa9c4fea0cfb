//! What leads rigid sweeps on: conjugate directions over them (theory eqs. 5.35, 11.14). What a sweep changes is minus a gradient g;
//! p <- beta p - g and x <- x + p with beta = |g|^2 / |g_before|^2, forgotten when the gradient grows. x is all impulses, and the
//! velocities that they give: both are led the same way, so that they keep fitting each other.

use super::bodies::Table;
use super::pack::{Beside, Pack};
use carom_math::lanes::{Eight, Lanes, Real};
use carom_math::{Several, Wide};
use std::ops::Range;
use std::sync::atomic::{AtomicU32, AtomicU64, Ordering};

/// The direction is forgotten when the squared gradient grows by more than this.
const RESTART: f64 = 2.0;

/// Impulses of a pack, one way or another.
#[derive(Clone, Copy)]
struct Way<S: Wide> {
    points: S::Points<Eight>,
    rubbing: S::Spins<Eight>,
    rolling: S::Slips<Eight>,
}

/// A pack's impulses where the last sweep began, and the direction so far.
#[derive(Clone, Copy)]
pub struct Led<S: Wide> {
    before: Way<S>,
    direction: Way<S>,
}

impl<S: Wide> Led<S> {
    /// Nothing yet.
    pub fn none() -> Self {
        let zero = Eight::default();
        let way =
            Way { points: S::Points::all(zero), rubbing: S::Spins::all(zero), rolling: S::Slips::all(zero) };
        Led { before: way, direction: way }
    }
}

/// Goes on with a number by beta times its direction, and keeps both.
#[inline(always)]
fn go_on<L: Lanes>(lanes: L, beta: Real<L>, now: &mut Eight, before: &mut Eight, direction: &mut Eight) {
    let further = beta * Real::load(lanes, direction);
    let at = Real::load(lanes, now);
    *direction = (at - Real::load(lanes, before) + further).store();
    *now = (at + further).store();
    *before = *now;
}

/// Where a row of sweeps begins: no direction.
#[inline(always)]
pub fn begin<S: Wide>(pack: &Pack<S>, beside: &Beside<S>, led: &mut Led<S>) {
    *led = Led::none();
    for i in 0..<S::Points<f32> as Several<f32>>::LEN {
        led.before.points[i] = pack.points[i].impulse;
    }
    led.before.rubbing = pack.rubbing;
    led.before.rolling = beside.rolling_moment;
}

/// Leads a pack on from where a sweep has brought it.
#[inline(always)]
pub fn lead<S: Wide, L: Lanes>(
    lanes: L,
    pack: &mut Pack<S>,
    beside: &mut Beside<S>,
    led: &mut Led<S>,
    beta: f32,
) {
    let beta = Real::all(lanes, beta);
    let Led { before, direction } = led;
    for i in 0..<S::Points<f32> as Several<f32>>::LEN {
        let now = &mut pack.points[i].impulse;
        go_on(lanes, beta, now, &mut before.points[i], &mut direction.points[i]);
    }
    for k in 0..<S::Spins<f32> as Several<f32>>::LEN {
        go_on(lanes, beta, &mut pack.rubbing[k], &mut before.rubbing[k], &mut direction.rubbing[k]);
    }
    if beside.resists {
        for k in 0..<S::Slips<f32> as Several<f32>>::LEN {
            let now = &mut beside.rolling_moment[k];
            go_on(lanes, beta, now, &mut before.rolling[k], &mut direction.rolling[k]);
        }
    }
}

/// The same of bodies' velocities; with `begins` where a row of sweeps begins.
#[inline(always)]
pub fn lead_bodies<S: Wide, L: Lanes>(
    lanes: L,
    table: &Table<S>,
    records: Range<usize>,
    (beta, begins): (f32, bool),
) {
    let beta = Real::all(lanes, beta);
    for i in records {
        let (mut now, [mut before, mut direction]) = table.led(i);
        if begins {
            (before, direction) = (now, Eight::default());
        } else {
            go_on(lanes, beta, &mut now, &mut before, &mut direction);
        }
        table.lead(lanes, i, now, [before, direction]);
    }
}

/// How far directions lead, for all workers: written in a stage of one turn, read in the next.
#[derive(Default)]
pub struct Beta {
    beta: AtomicU32,
    /// Squared change of the sweep before; 0 for none.
    length: AtomicU64,
}

impl Beta {
    /// Forgets the sweep before.
    pub fn forget(&self) {
        self.length.store(0.0_f64.to_bits(), Ordering::Relaxed);
    }
    /// Takes in the squared change of a sweep.
    pub fn weigh(&self, length: f64) {
        let beta = length / f64::from_bits(self.length.load(Ordering::Relaxed));
        self.length.store(length.to_bits(), Ordering::Relaxed);
        // false for the first, infinite or NaN
        let beta = if beta <= RESTART { beta as f32 } else { 0.0 };
        self.beta.store(beta.to_bits(), Ordering::Relaxed);
    }
    /// beta.
    pub fn get(&self) -> f32 {
        f32::from_bits(self.beta.load(Ordering::Relaxed))
    }
}
