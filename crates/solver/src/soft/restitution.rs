//! Restitution, once after the substeps. Points that came in faster than the rest speed and were pressed are to leave with
//! e times it, one after another: lambda_i += m_i (-e v_i- - v_i), with v_i the velocity that the points before it left.
//! One pass does not solve the faces of a body together, and where it gives a face more than its share nothing takes
//! that back. So no face gives more than it took, times e^2: with W = sum lambda_i (v_i- + v_i)/2 the work of its
//! normal impulses up to now (kick identity; negative where it was compressed), the increments d are scaled by the largest
//! s <= 1 with s d.v + s^2/2 d.L d <= -e^2 W. A single point never meets that bound. Velocities at the beginning, v-,
//! are those before the step's loads.

use super::bodies::Table;
use super::pack::{Beside, KeptMasses, Pack};
use super::prepare::{Frame, lever};
use super::shared::Places;
use carom_math::lanes::{Lanes, Real};
use carom_math::wide::inner;
use carom_math::{Several, Wide};

/// Energy that restitution may give back, patch by patch, before anything bounces.
#[inline(always)]
pub fn compress<S: Wide, L: Lanes>(
    lanes: L,
    (pack, beside): (&Pack<S>, &mut Beside<S>),
    at: [Places<'_>; 2],
    records: &Table<S>,
) {
    let frame = Frame::of(lanes, pack);
    let (normal_twist, _) = frame.twist_now(lanes, records, at);
    let (zero, half) = (Real::all(lanes, 0.0), Real::all(lanes, 0.5));
    let restitution = Real::load(lanes, &beside.restitution);
    let mut work = zero;
    for i in 0..<S::Points<f32> as Several<f32>>::LEN {
        let velocity = inner(&lever::<S, L>(lanes, pack, i), &normal_twist);
        let mean = (Real::load(lanes, &beside.approach[i]) + velocity) * half;
        work += Real::load(lanes, &beside.total[i]) * mean;
    }
    beside.returnable = (zero - restitution * restitution * work).max(zero).store();
}

/// Restitution of a pack.
#[inline(always)]
pub fn bounce<S: Wide, L: Lanes>(
    lanes: L,
    (pack, beside): (&Pack<S>, &mut Beside<S>),
    at: [Places<'_>; 2],
    records: &Table<S>,
    rest_speed: f32,
) {
    let points = <S::Points<f32> as Several<f32>>::LEN;
    let frame = Frame::of(lanes, pack);
    let (mut a, mut b) = (records.motion(lanes, &at[0]), records.motion(lanes, &at[1]));
    let (normal_twist, _) = frame.twist(&a, &b);
    let inertias = records.inertias(lanes, &at, &pack.inertia);
    let masses = KeptMasses::<S, L>::of(lanes, &pack.masses);
    let (zero, rest) = (Real::all(lanes, 0.0), Real::all(lanes, -rest_speed));
    let restitution = Real::load(lanes, &beside.restitution);
    let mut pressing = S::Vectors::all(zero);
    let mut lost = S::Points::all(zero);
    let mut change = lost;
    for i in 0..points {
        let lever = lever::<S, L>(lanes, pack, i);
        let approach = Real::load(lanes, &beside.approach[i]);
        let total = Real::load(lanes, &beside.total[i]);
        let impulse = Real::load(lanes, &pack.points[i].impulse);
        let wanted = inner(&lever, &normal_twist) + lost[i] + restitution * approach;
        let new = (impulse - masses.point(i) * wanted).max(zero);
        // only what came in fast and was pressed
        let fast = approach.if_less(rest, new - impulse, zero);
        change[i] = zero.if_less(total, zero.if_less(restitution, fast, zero), zero);
        for j in i + 1..points {
            lost[j] += masses.between(i, j) * change[i];
        }
        for m in 0..<S::Vectors<f32> as Several<f32>>::LEN {
            pressing[m] += lever[m] * change[i];
        }
    }
    // what they would do to the twist
    let masses = [a.inverse_mass, b.inverse_mass];
    let (gained, _) = frame.column(&pressing, &S::Spins::all(zero), masses, &inertias);
    let returnable = Real::load(lanes, &beside.returnable);
    let scale = within_reach(returnable, inner(&pressing, &normal_twist), inner(&pressing, &gained));
    for m in 0..<S::Vectors<f32> as Several<f32>>::LEN {
        pressing[m] = pressing[m] * scale;
    }
    for i in 0..points {
        beside.total[i] = (Real::load(lanes, &beside.total[i]) + change[i] * scale).store();
    }
    frame.give(&pressing, &S::Spins::all(zero), (&mut a, &mut b), &inertias);
    records.scatter(&at[0], &a);
    records.scatter(&at[1], &b);
}

/// Largest share of these impulses, at most 1, that gives back no more energy than may be.
#[inline(always)]
fn within_reach<L: Lanes>(returnable: Real<L>, linear: Real<L>, twice_quadratic: Real<L>) -> Real<L> {
    let (zero, one) = (linear.like(0.0), linear.like(1.0));
    let quadratic = twice_quadratic * one.like(0.5);
    // the root of s l + s^2 q = r without a difference of like numbers
    let root = (linear * linear + one.like(4.0) * quadratic * returnable).max(zero).sqrt();
    let least = one.like(1e-30);
    let leaving = (returnable + returnable) / (root + linear).max(least);
    let coming = (root - linear) / (quadratic + quadratic).max(least);
    let share = linear.if_less(zero, coming, leaving);
    // what a single point is to give is at the bound; its rounding is no reason
    let bound = returnable * one.like(1.0 + 1e-5);
    bound.if_less(linear + quadratic, share.min(one).max(zero), one)
}
