//! One sweep over a patch. Each point i is a spring of bias speed b(s_i), mass share m' and impulse share i':
//! lambda_i <- max(lambda_i - m_i m' (vn_i + b) - i' lambda_i, 0), with vn_i the velocity that the points before it
//! left; a gap that the substep does not close leaves its point alone. Then friction, with the velocity after that:
//! g <- P(g - v_t / lambda_max), P the projection on the disc mu sum lambda, whose fixed point is Coulomb's law in the
//! true direction of slip. Relaxing sweeps have no springs: they take back the velocity that the springs pushed with. Rigid
//! contacts are springs with m' = 1, i' = 0.

use super::bodies::{Eightfold, Moved, Table};
use super::pack::{Beside, Masses, Pack};
use super::prepare::{Frame, lever};
use carom_math::lanes::{Lanes, Real};
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
fn gaps<S: Wide, L: Lanes>(
    lanes: L,
    pack: &Pack<S>,
    frame: &Frame<S, L>,
    (a, b): (Moved<S, L>, Moved<S, L>),
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

/// Impulses that a pack's points would take alone, and what of their effective masses a change of velocity meets.
#[inline(always)]
fn wanted<S: Wide, L: Lanes>(
    lanes: L,
    pack: &Pack<S>,
    masses: &Masses<S, L>,
    gaps: &S::Points<Real<L>>,
    twist: &S::Vectors<Real<L>>,
    spring: &Spring,
) -> (S::Points<Real<L>>, S::Points<Real<L>>) {
    let zero = Real::all(lanes, 0.0);
    let (all, rate) = (Real::all(lanes, 1.0 / spring.h), Real::all(lanes, spring.bias_rate));
    let (mass_share, impulse_share) =
        (Real::all(lanes, spring.mass_share), Real::all(lanes, spring.impulse_share));
    let push = Real::all(lanes, -spring.push_speed);
    let (mut wanted, mut stiff, mut beyond) = (*gaps, *gaps, *gaps);
    // springs have none
    if spring.slop > 0.0 {
        for gap in beyond.slice_mut() {
            *gap += Real::all(lanes, spring.slop);
        }
    }
    for i in 0..<S::Points<f32> as Several<f32>>::LEN {
        let lever = lever::<S, L>(lanes, pack, i);
        let velocity = inner(&lever, twist);
        let impulse = Real::load(lanes, &pack.points[i].impulse);
        let closes = velocity + gaps[i] * all;
        let pushes = velocity + (beyond[i].min(zero) * rate).max(push);
        let soft = impulse - masses.points[i] * mass_share * pushes - impulse_share * impulse;
        wanted[i] = zero.if_less(gaps[i], impulse - masses.points[i] * closes, soft);
        stiff[i] = masses.points[i] * zero.if_less(gaps[i], zero.like(1.0), mass_share);
    }
    (wanted, stiff)
}

/// Friction's new impulses: the disc of `limit` for those along tangents, `twist_limit` for that about the normal.
#[inline(always)]
fn rub<S: Wide, L: Lanes>(
    old: &S::Spins<Real<L>>,
    velocity: &S::Spins<Real<L>>,
    masses: &Masses<S, L>,
    limit: Real<L>,
    twist_limit: Real<L>,
) -> S::Spins<Real<L>> {
    let slips = <S::Slips<f32> as Several<f32>>::LEN;
    let mut new = *old;
    let mut square = limit.like(1e-30);
    for k in 0..slips {
        new[k] = old[k] - masses.slip * velocity[k];
        square += new[k] * new[k];
    }
    let scale = limit.like(1.0).min(limit / square.sqrt());
    for k in 0..slips {
        new[k] = new[k] * scale;
    }
    if <S::Spins<f32> as Several<f32>>::LEN > slips {
        let torque = old[slips] - masses.twist * velocity[slips];
        new[slips] = torque.min(twist_limit).max(-twist_limit);
    }
    new
}

/// One sweep over a pack; a relaxing one adds the substep's impulses to those of the step, and the last also tells the
/// largest velocity that it still changed at a point or by friction \[m/s\]; one that is `led` tells its squared change.
#[inline(always)]
pub fn sweep<S: Wide, L: Lanes>(
    lanes: L,
    pack: &mut Pack<S>,
    beside: &mut Beside<S>,
    records: &Table<S>,
    spring: &Spring,
    (kind, led): (Sweep, bool),
) {
    let relaxes = matches!(kind, Sweep::Relaxing | Sweep::Last);
    let points = <S::Points<f32> as Several<f32>>::LEN;
    let frame = Frame::of(lanes, pack);
    let (mut a, mut b) =
        (records.gather(lanes, &pack.a, &pack.inertia[0]), records.gather(lanes, &pack.b, &pack.inertia[1]));
    let moved = (records.moved(lanes, &pack.a, &a), records.moved(lanes, &pack.b, &b));
    let gaps = gaps(lanes, pack, &frame, moved);
    let (mut normal_twist, mut slip_twist) = frame.twist(&a, &b);
    let masses = Masses::<S, L>::load(lanes, &pack.masses);
    let zero = Real::all(lanes, 0.0);
    let mut pressing = S::Vectors::all(zero);
    let mut sum = zero;
    if beside.resists {
        // the couplings between points know nothing of it: it comes first, and they see what it left
        roll(lanes, pack, beside, &frame, &normal_twist, [&mut a, &mut b]);
        normal_twist = frame.twist(&a, &b).0;
    }
    let (mut wanted, stiff) = wanted(lanes, pack, &masses, &gaps, &normal_twist, spring);
    let mut change = gaps;
    for i in 0..points {
        let impulse = Real::load(lanes, &pack.points[i].impulse);
        let new = wanted[i].max(zero);
        change[i] = new - impulse;
        for j in i + 1..points {
            wanted[j] -= stiff[j] * masses.between[i][j] * change[i];
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
    if beside.resists {
        let given = keep_rolling_within::<S, L>(lanes, beside, sum, relaxes);
        for k in 0..<S::Slips<f32> as Several<f32>>::LEN {
            pressing[k + 1] += given[k];
        }
    }
    for k in 0..<S::Spins<f32> as Several<f32>>::LEN {
        slip_twist[k] += inner(&masses.coupling[k], &pressing);
    }
    let rubbing = friction(lanes, pack, beside, &masses, &slip_twist, sum, relaxes);
    if kind == Sweep::Last {
        let mut worst = zero;
        for i in 0..points {
            worst = (change[i] / masses.points[i]).abs().max(worst);
        }
        for k in 0..<S::Slips<f32> as Several<f32>>::LEN {
            worst = (rubbing[k] / masses.slip).abs().max(worst);
        }
        beside.changed = worst.store();
    }
    if led {
        let mut length = zero;
        for i in 0..points {
            // of points that are not there the mass is zero
            let own = change[i] * change[i] / masses.points[i];
            length += zero.if_less(masses.points[i], own, zero);
        }
        for k in 0..<S::Slips<f32> as Several<f32>>::LEN {
            let own = rubbing[k] * rubbing[k] / masses.slip;
            length += zero.if_less(masses.slip, own, zero);
        }
        beside.length = length.store();
    }
    frame.give(&pressing, &rubbing, &mut a, &mut b);
    records.scatter(&pack.a, &a);
    records.scatter(&pack.b, &b);
}

/// Friction of a pack by the velocities that its normal impulses left; returns what it changed.
#[inline(always)]
fn friction<S: Wide, L: Lanes>(
    lanes: L,
    pack: &mut Pack<S>,
    beside: &mut Beside<S>,
    masses: &Masses<S, L>,
    velocity: &S::Spins<Real<L>>,
    sum: Real<L>,
    relaxes: bool,
) -> S::Spins<Real<L>> {
    let spins = <S::Spins<f32> as Several<f32>>::LEN;
    let mut old = *velocity;
    for k in 0..spins {
        old[k] = Real::load(lanes, &pack.rubbing[k]);
    }
    let limit = Real::load(lanes, &pack.friction) * sum;
    let new = rub(&old, velocity, masses, limit, Real::load(lanes, &pack.twisting) * sum);
    let mut change = new;
    for k in 0..spins {
        change[k] = new[k] - old[k];
        pack.rubbing[k] = new[k].store();
        if relaxes {
            beside.rubbed[k] = (Real::load(lanes, &beside.rubbed[k]) + new[k]).store();
        }
    }
    change
}

/// Rolling friction of a pack, limited by the normal impulses so far, which are those that the springs pushed with.
#[inline(always)]
fn roll<S: Wide, L: Lanes>(
    lanes: L,
    pack: &Pack<S>,
    beside: &mut Beside<S>,
    frame: &Frame<S, L>,
    twist: &S::Vectors<Real<L>>,
    [a, b]: [&mut Eightfold<S, L>; 2],
) {
    let zero = Real::all(lanes, 0.0);
    let mut sum = zero;
    for i in 0..<S::Points<f32> as Several<f32>>::LEN {
        sum += Real::load(lanes, &pack.points[i].impulse);
    }
    let (mass, limit) = (Real::load(lanes, &beside.rolling_mass), Real::load(lanes, &beside.rolling) * sum);
    let mut pressing = S::Vectors::all(zero);
    let mut square = zero.like(1e-30);
    let slips = <S::Slips<f32> as Several<f32>>::LEN;
    let mut new = S::Slips::all(zero);
    for k in 0..slips {
        new[k] = Real::load(lanes, &beside.rolling_moment[k]) - mass * twist[k + 1];
        square += new[k] * new[k];
    }
    let scale = zero.like(1.0).min(limit / square.sqrt());
    for k in 0..slips {
        let moment = new[k] * scale;
        pressing[k + 1] = moment - Real::load(lanes, &beside.rolling_moment[k]);
        beside.rolling_moment[k] = moment.store();
    }
    frame.give(&pressing, &S::Spins::all(zero), a, b);
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
    let mut square = sum.like(1e-30);
    let mut change = S::Slips::all(sum.like(0.0));
    for k in 0..slips {
        let moment = Real::load(lanes, &beside.rolling_moment[k]);
        change[k] = moment;
        square += moment * moment;
    }
    let limit = Real::load(lanes, &beside.rolling) * sum;
    let scale = sum.like(1.0).min(limit / square.sqrt());
    for k in 0..slips {
        let moment = change[k] * scale;
        change[k] = moment - change[k];
        beside.rolling_moment[k] = moment.store();
        if relaxes {
            beside.rolled[k] = (Real::load(lanes, &beside.rolled[k]) + moment).store();
        }
    }
    change
}
