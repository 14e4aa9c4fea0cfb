//! One sweep over a patch. Each point i is a spring of bias speed b(s_i), mass share m' and impulse share i':
//! lambda_i <- max(lambda_i - m_i m' (vn_i + b) - i' lambda_i, 0), with vn_i the velocity that the points before it
//! left; a gap that the substep does not close leaves its point alone. Then friction, with the velocity after that:
//! g <- P(g - v_t / lambda_max), P the projection on the disc mu sum lambda, whose fixed point is Coulomb's law in the
//! true direction of slip. Relaxing sweeps have no springs: they take back the velocity that the springs pushed with. Rigid
//! contacts are springs with m' = 1, i' = 0.

use super::bodies::{Moved, Table};
use super::pack::{Beside, KeptMasses, Pack};
use super::prepare::{Frame, lever};
use super::shared::Places;
use carom_math::lanes::{Eight, Lanes, Real};
use carom_math::wide::inner;
use carom_math::{Several, Wide};

/// The springs of a substep, and its length.
#[derive(Clone, Copy, Debug)]
pub struct Spring {
    /// Length of the substep \[s\].
    pub h: f32,
    /// Speed of push per overlap \[1/s\].
    pub bias_rate: f32,
    /// Share of the effective mass \[1\].
    pub mass_share: f32,
    /// Share of the impulse that the spring's damping takes back \[1\].
    pub impulse_share: f32,
    /// Overlaps are not pushed apart faster than this \[m/s\].
    pub push_speed: f32,
    /// Overlap that is left alone \[m\].
    pub slop: f32,
}

impl Spring {
    /// A spring of a frequency \[Hz\] and a damping ratio \[1\], by implicit Euler over substeps of h \[s\].
    pub fn new(hertz: f32, damping_ratio: f32, h: f32, push_speed: f32) -> Self {
        let omega = 2.0 * std::f32::consts::PI * hertz;
        let a1 = 2.0 * damping_ratio + h * omega;
        let a2 = h * omega * a1;
        let a3 = 1.0 / (1.0 + a2);
        Spring { h, bias_rate: omega / a1, mass_share: a2 * a3, impulse_share: a3, push_speed, slop: 0.0 }
    }
    /// No spring: approach is stopped whole, and a share of the overlap beyond a slop \[m\] is pushed apart (theory eq. 11.13).
    pub fn rigid(h: f32, push_speed: f32, (share, slop): (f32, f32)) -> Self {
        Spring { h, bias_rate: share / h, mass_share: 1.0, impulse_share: 0.0, push_speed, slop }
    }
    /// The same without springs: only approach is stopped.
    pub fn relaxing(&self) -> Self {
        Spring { bias_rate: 0.0, mass_share: 1.0, impulse_share: 0.0, ..*self }
    }
}

/// Which sweep of a substep.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sweep {
    /// With springs, or pushing rigid contacts apart, before the poses move.
    Springs,
    /// Without, after; others follow.
    Easing,
    /// The last of these.
    Relaxing,
    /// The last of the step.
    Last,
}

/// Gaps of the points now, from what the bodies moved and turned since the step began.
#[inline(always)]
pub(super) fn gaps<S: Wide, L: Lanes>(
    lanes: L,
    pack: &Pack<S>,
    frame: &Frame<S, L>,
    [a, b]: [Moved<S, L>; 2],
) -> S::Points<Real<L>> {
    let (lean_a, lean_b) = (S::wide_lean(&a.turn, &frame.normal), S::wide_lean(&b.turn, &frame.normal));
    let (mut apart, mut lean) = (a.by, lean_a);
    for k in 0..<S::Vectors<f32> as Several<f32>>::LEN {
        apart[k] = a.by[k] - b.by[k];
        lean[k] = lean_a[k] - lean_b[k];
    }
    let centre = inner(&frame.normal, &apart) + inner(&lean_a, &frame.arm_a) - inner(&lean_b, &frame.arm_b);
    let mut along = S::Slips::all(centre);
    for k in 0..<S::Slips<f32> as Several<f32>>::LEN {
        along[k] = inner(&lean, &frame.tangents[k]);
    }
    let mut out = S::Points::all(centre);
    for i in 0..<S::Points<f32> as Several<f32>>::LEN {
        let point = &pack.points[i];
        out[i] = Real::load(lanes, &point.gap) + centre;
        for k in 0..<S::Slips<f32> as Several<f32>>::LEN {
            out[i] += along[k] * Real::load(lanes, &point.place[k]);
        }
    }
    out
}

/// Gaps of the points. Poses stand still between the relaxing sweeps of a substep and the springs of the next, which find the gaps
/// that those left; the first of a step those of its start.
#[inline(always)]
fn gaps_now<S: Wide, L: Lanes, const SPRINGS: bool>(
    lanes: L,
    (pack, beside): (&Pack<S>, &mut Beside<S>),
    at: &[Places<'_>; 2],
    frame: &Frame<S, L>,
    records: &Table<S>,
) -> S::Points<Real<L>> {
    if SPRINGS {
        let mut out = S::Points::all(Real::all(lanes, 0.0));
        for i in 0..<S::Points<f32> as Several<f32>>::LEN {
            out[i] = Real::load(lanes, &beside.gaps[i]);
        }
        return out;
    }
    let moved = [records.moved(lanes, &at[0]), records.moved(lanes, &at[1])];
    let out = gaps(lanes, pack, frame, moved);
    for i in 0..<S::Points<f32> as Several<f32>>::LEN {
        beside.gaps[i] = out[i].store();
    }
    out
}

/// Impulses that a pack's points would take alone, and what of their effective masses a change of velocity meets; with springs or
/// without.
#[inline(always)]
fn wanted<S: Wide, L: Lanes, const SPRINGS: bool>(
    lanes: L,
    pack: &Pack<S>,
    masses: &KeptMasses<S, L>,
    gaps: &S::Points<Real<L>>,
    twist: &S::Vectors<Real<L>>,
    spring: &Spring,
) -> (S::Points<Real<L>>, S::Points<Real<L>>) {
    let (zero, all) = (Real::all(lanes, 0.0), Real::all(lanes, 1.0 / spring.h));
    let (mut wanted, mut stiff, mut beyond) = (*gaps, *gaps, *gaps);
    // springs have none
    if SPRINGS && spring.slop > 0.0 {
        for gap in beyond.slice_mut() {
            *gap += Real::all(lanes, spring.slop);
        }
    }
    for i in 0..<S::Points<f32> as Several<f32>>::LEN {
        let velocity = inner(&lever::<S, L>(lanes, pack, i), twist);
        let impulse = Real::load(lanes, &pack.points[i].impulse);
        let (mass, closes) = (masses.point(i), gaps[i] * all);
        if SPRINGS {
            let pushes = beyond[i].min(zero) * Real::all(lanes, spring.bias_rate);
            let pushes = pushes.max(Real::all(lanes, -spring.push_speed));
            let speed = velocity + zero.if_less(gaps[i], closes, pushes);
            let share = zero.if_less(gaps[i], zero, Real::all(lanes, spring.impulse_share));
            stiff[i] = zero.if_less(gaps[i], mass, mass * Real::all(lanes, spring.mass_share));
            wanted[i] = impulse - stiff[i] * speed - share * impulse;
        } else {
            stiff[i] = mass;
            wanted[i] = impulse - mass * (velocity + closes.max(zero));
        }
    }
    (wanted, stiff)
}

/// What a disc of this radius holds of impulses along tangents: in the plane a stretch. What is not a number stays so.
#[inline(always)]
fn within<S: Wide, L: Lanes>(impulses: &S::Slips<Real<L>>, radius: Real<L>) -> S::Slips<Real<L>> {
    let mut out = *impulses;
    if <S::Slips<f32> as Several<f32>>::LEN == 1 {
        out[0] = (-radius).max(radius.min(out[0]));
        return out;
    }
    let (square, square_radius) = (inner(impulses, impulses), radius * radius);
    // where everything sticks nobody waits for a root and a quotient
    if !square_radius.somewhere_less(square) {
        return out;
    }
    let scale = square_radius.if_less(square, radius / square.sqrt(), radius.like(1.0));
    for x in out.slice_mut() {
        *x = *x * scale;
    }
    out
}

/// Friction's new impulses: the disc of `limit` for those along tangents, `twist_limit` for that about the normal.
#[inline(always)]
fn rub<S: Wide, L: Lanes>(
    old: &S::Spins<Real<L>>,
    velocity: &S::Spins<Real<L>>,
    masses: &KeptMasses<S, L>,
    limit: Real<L>,
    twist_limit: Real<L>,
) -> S::Spins<Real<L>> {
    let slips = <S::Slips<f32> as Several<f32>>::LEN;
    let (mut new, mut along) = (*old, S::Slips::all(limit));
    for k in 0..slips {
        along[k] = old[k] - masses.slip() * velocity[k];
    }
    let along = within::<S, L>(&along, limit);
    for k in 0..slips {
        new[k] = along[k];
    }
    if <S::Spins<f32> as Several<f32>>::LEN > slips {
        let torque = old[slips] - masses.twist() * velocity[slips];
        new[slips] = torque.min(twist_limit).max(-twist_limit);
    }
    new
}

/// One sweep over a pack; a relaxing one adds the substep's impulses to those of the step, and the last also tells the
/// largest velocity that it still changed at a point or by friction \[m/s\]; one that is `led` tells its squared change. One with
/// `SPRINGS` is [`Sweep::Springs`], others are not. Where nobody `resists` rolling nobody is asked.
#[inline(always)]
pub fn sweep<S: Wide, L: Lanes, const SPRINGS: bool>(
    lanes: L,
    (pack, beside): (&mut Pack<S>, &mut Beside<S>),
    at: [Places<'_>; 2],
    records: &Table<S>,
    spring: &Spring,
    (kind, led, resists): (Sweep, bool, bool),
) {
    let relaxes = matches!(kind, Sweep::Relaxing | Sweep::Last);
    let points = <S::Points<f32> as Several<f32>>::LEN;
    let frame = Frame::of(lanes, pack);
    let resists = resists && beside.resists;
    if resists {
        // the couplings between points know nothing of it: it comes first, and they see what it left
        roll(lanes, (pack, beside), at, &frame, records);
    }
    let gaps = gaps_now::<S, L, SPRINGS>(lanes, (pack, beside), &at, &frame, records);
    let (mut a, mut b) = (records.motion(lanes, &at[0]), records.motion(lanes, &at[1]));
    let (normal_twist, mut slip_twist) = frame.twist(&a, &b);
    let zero = Real::all(lanes, 0.0);
    let mut pressing = S::Vectors::all(zero);
    let mut sum = zero;
    let masses = KeptMasses::<S, L>::of(lanes, &pack.masses);
    let (mut wanted, stiff) = wanted::<S, L, SPRINGS>(lanes, pack, &masses, &gaps, &normal_twist, spring);
    let mut change = gaps;
    for i in 0..points {
        let impulse = Real::load(lanes, &pack.points[i].impulse);
        let new = wanted[i].max(zero);
        change[i] = new - impulse;
        for j in i + 1..points {
            wanted[j] -= stiff[j] * masses.between(i, j) * change[i];
        }
        let lever = lever::<S, L>(lanes, pack, i);
        for m in 0..<S::Vectors<f32> as Several<f32>>::LEN {
            pressing[m] += lever[m] * change[i];
        }
        sum += new;
        pack.points[i].impulse = new.store();
        if relaxes {
            beside.total[i] = (Real::load(lanes, &beside.total[i]) + new).store();
        }
    }
    if resists {
        let given = keep_rolling_within::<S, L>(lanes, beside, sum, relaxes);
        for k in 0..<S::Slips<f32> as Several<f32>>::LEN {
            pressing[k + 1] += given[k];
        }
    }
    for k in 0..<S::Spins<f32> as Several<f32>>::LEN {
        slip_twist[k] += inner(&masses.coupling(k), &pressing);
    }
    let limit = Real::load(lanes, &pack.friction) * sum;
    let limits = [limit, Real::load(lanes, &pack.twisting) * sum];
    let kept = (&mut pack.rubbing, relaxes.then_some(&mut beside.rubbed));
    let rubbing = friction::<S, L>(lanes, kept, &masses, &slip_twist, limits);
    if kind == Sweep::Last {
        let mut worst = zero;
        for i in 0..points {
            worst = (change[i] / masses.point(i)).abs().max(worst);
        }
        for k in 0..<S::Slips<f32> as Several<f32>>::LEN {
            worst = (rubbing[k] / masses.slip()).abs().max(worst);
        }
        beside.changed = worst.store();
    }
    if led {
        let mut length = zero;
        for i in 0..points {
            // of points that are not there the mass is zero
            let own = change[i] * change[i] / masses.point(i);
            length += zero.if_less(masses.point(i), own, zero);
        }
        for k in 0..<S::Slips<f32> as Several<f32>>::LEN {
            let own = rubbing[k] * rubbing[k] / masses.slip();
            length += zero.if_less(masses.slip(), own, zero);
        }
        beside.length = length.store();
    }
    let inertias = records.inertias(lanes, &at, &pack.inertia);
    frame.give(&pressing, &rubbing, (&mut a, &mut b), &inertias);
    records.scatter(&at[0], &a);
    records.scatter(&at[1], &b);
}

/// Friction of a pack by the velocities that its normal impulses left, within limits along the tangents and about the normal;
/// returns what it changed. Impulses are kept, and added to those of the step where it is to be told.
#[inline(always)]
fn friction<S: Wide, L: Lanes>(
    lanes: L,
    (impulses, mut told): (&mut S::Spins<Eight>, Option<&mut S::Spins<Eight>>),
    masses: &KeptMasses<S, L>,
    velocity: &S::Spins<Real<L>>,
    [limit, twist_limit]: [Real<L>; 2],
) -> S::Spins<Real<L>> {
    let spins = <S::Spins<f32> as Several<f32>>::LEN;
    let mut old = *velocity;
    for k in 0..spins {
        old[k] = Real::load(lanes, &impulses[k]);
    }
    let new = rub(&old, velocity, masses, limit, twist_limit);
    let mut change = new;
    for k in 0..spins {
        change[k] = new[k] - old[k];
        impulses[k] = new[k].store();
        if let Some(told) = &mut told {
            told[k] = (Real::load(lanes, &told[k]) + new[k]).store();
        }
    }
    change
}

/// Rolling friction of a pack, limited by the normal impulses so far, which are those that the springs pushed with.
#[inline(always)]
fn roll<S: Wide, L: Lanes>(
    lanes: L,
    (pack, beside): (&Pack<S>, &mut Beside<S>),
    at: [Places<'_>; 2],
    frame: &Frame<S, L>,
    records: &Table<S>,
) {
    let (mut a, mut b) = (records.motion(lanes, &at[0]), records.motion(lanes, &at[1]));
    let (twist, _) = frame.twist(&a, &b);
    let zero = Real::all(lanes, 0.0);
    let mut sum = zero;
    for i in 0..<S::Points<f32> as Several<f32>>::LEN {
        sum += Real::load(lanes, &pack.points[i].impulse);
    }
    let (mass, limit) = (Real::load(lanes, &beside.rolling_mass), Real::load(lanes, &beside.rolling) * sum);
    let mut pressing = S::Vectors::all(zero);
    let slips = <S::Slips<f32> as Several<f32>>::LEN;
    let mut new = S::Slips::all(zero);
    for k in 0..slips {
        new[k] = Real::load(lanes, &beside.rolling_moment[k]) - mass * twist[k + 1];
    }
    let new = within::<S, L>(&new, limit);
    for k in 0..slips {
        pressing[k + 1] = new[k] - Real::load(lanes, &beside.rolling_moment[k]);
        beside.rolling_moment[k] = new[k].store();
    }
    let inertias = records.inertias(lanes, &at, &pack.inertia);
    frame.give(&pressing, &S::Spins::all(zero), (&mut a, &mut b), &inertias);
    records.scatter(&at[0], &a);
    records.scatter(&at[1], &b);
}

/// Takes back what rolling friction has beyond its disc, now that the normal impulses are known, and books the rest;
/// returns what it changed.
#[inline(always)]
fn keep_rolling_within<S: Wide, L: Lanes>(
    lanes: L,
    beside: &mut Beside<S>,
    sum: Real<L>,
    relaxes: bool,
) -> S::Slips<Real<L>> {
    let slips = <S::Slips<f32> as Several<f32>>::LEN;
    let mut old = S::Slips::all(sum);
    for k in 0..slips {
        old[k] = Real::load(lanes, &beside.rolling_moment[k]);
    }
    let new = within::<S, L>(&old, Real::load(lanes, &beside.rolling) * sum);
    let mut change = new;
    for k in 0..slips {
        change[k] = new[k] - old[k];
        beside.rolling_moment[k] = new[k].store();
        if relaxes {
            beside.rolled[k] = (Real::load(lanes, &beside.rolled[k]) + new[k]).store();
        }
    }
    change
}

#[cfg(test)]
mod tests {
    use super::*;
    use carom_math::lanes::Portable;
    use carom_math::{Planar, Spatial};

    fn held<S: Wide>(impulses: &[f32], radius: f32) -> Vec<f32> {
        let mut all = S::Slips::all(Real::all(Portable, 0.0));
        for (to, x) in all.slice_mut().iter_mut().zip(impulses) {
            *to = Real::all(Portable, *x);
        }
        let held = within::<S, Portable>(&all, Real::all(Portable, radius));
        held.slice().iter().map(|x| x.store().0[0]).collect()
    }

    #[test]
    fn friction_is_held_to_a_stretch_in_the_plane_and_to_a_disc_in_space() {
        for (impulse, expected) in [(5.0, 2.0), (-5.0, -2.0), (1.5, 1.5), (2.0, 2.0), (0.0, 0.0)] {
            assert_eq!(held::<Planar>(&[impulse], 2.0), [expected]);
        }
        assert_eq!(held::<Planar>(&[-3.0], 0.0), [0.0]);
        assert!(held::<Planar>(&[f32::NAN], 2.0)[0].is_nan(), "what is no number is not hidden");
        assert!(held::<Spatial>(&[f32::NAN, 1.0], 2.0)[0].is_nan());
        for (impulses, expected) in [([3.0, 4.0], [1.5, 2.0]), ([-0.3, 0.4], [-0.3, 0.4])] {
            for (held, expected) in held::<Spatial>(&impulses, 2.5).into_iter().zip(expected) {
                assert!((held - expected).abs() < 1e-6, "{held} {expected}");
            }
        }
    }
}
