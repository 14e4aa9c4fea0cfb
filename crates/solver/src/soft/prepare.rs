//! Once a step: a patch's effective masses, and its warm start. With U the map from the patch's two groups of impulses to
//! its bodies' momenta, the local inverse mass is L = U^T M^-1 U; a column of it is what a unit impulse does to the
//! local twist. Points need u_i^T L u_j, friction its own block and the block that couples it to the normal group.

use super::bodies::{Eightfold, Table};
use super::pack::{Beside, Masses, Pack};
use super::shared::Places;
use carom_math::lanes::{Lanes, Real};
use carom_math::wide::inner;
use carom_math::{Several, Wide};

/// A patch's frame and arms in registers.
pub struct Frame<S: Wide, L: Lanes> {
    pub normal: S::Vectors<Real<L>>,
    pub tangents: S::Slips<S::Vectors<Real<L>>>,
    pub arm_a: S::Vectors<Real<L>>,
    pub arm_b: S::Vectors<Real<L>>,
}

impl<S: Wide, L: Lanes> Frame<S, L> {
    #[inline(always)]
    pub fn of(lanes: L, pack: &Pack<S>) -> Self {
        let zero = Real::all(lanes, 0.0);
        let (mut normal, mut arm_a, mut arm_b) =
            (S::Vectors::all(zero), S::Vectors::all(zero), S::Vectors::all(zero));
        for k in 0..<S::Vectors<f32> as Several<f32>>::LEN {
            normal[k] = Real::load(lanes, &pack.normal[k]);
            arm_a[k] = Real::load(lanes, &pack.arm_a[k]);
            arm_b[k] = Real::load(lanes, &pack.arm_b[k]);
        }
        Frame { normal, tangents: S::tangents(&normal), arm_a, arm_b }
    }

    /// Local twist of bodies a relative to bodies b.
    #[inline(always)]
    pub fn twist(
        &self,
        a: &Eightfold<S, L>,
        b: &Eightfold<S, L>,
    ) -> (S::Vectors<Real<L>>, S::Spins<Real<L>>) {
        let (at_a, at_b) = (S::wide_swing(&a.spin, &self.arm_a), S::wide_swing(&b.spin, &self.arm_b));
        let (mut velocity, mut spin) = (a.velocity, a.spin);
        for k in 0..<S::Vectors<f32> as Several<f32>>::LEN {
            velocity[k] = (a.velocity[k] + at_a[k]) - (b.velocity[k] + at_b[k]);
        }
        for k in 0..<S::Spins<f32> as Several<f32>>::LEN {
            spin[k] = a.spin[k] - b.spin[k];
        }
        S::to_patch(&self.normal, &self.tangents, &velocity, &spin)
    }

    /// That of eight pairs as they move now.
    #[inline(always)]
    pub fn twist_now(
        &self,
        lanes: L,
        records: &Table<S>,
        [a, b]: [Places<'_>; 2],
    ) -> (S::Vectors<Real<L>>, S::Spins<Real<L>>) {
        let (a, b) = (records.motion(lanes, &a), records.motion(lanes, &b));
        self.twist(&a, &b)
    }

    /// Gives bodies a both groups of impulses, and bodies b the opposite.
    #[inline(always)]
    pub fn give(
        &self,
        pressing: &S::Vectors<Real<L>>,
        rubbing: &S::Spins<Real<L>>,
        (a, b): (&mut Eightfold<S, L>, &mut Eightfold<S, L>),
        [inertia_a, inertia_b]: &[S::Inertias<Real<L>>; 2],
    ) {
        let (impulse, moment) = S::from_patch(&self.normal, &self.tangents, pressing, rubbing);
        let (v, w) = response::<S, L>(&impulse, &moment, &self.arm_a, (a.inverse_mass, inertia_a));
        for k in 0..<S::Vectors<f32> as Several<f32>>::LEN {
            a.velocity[k] += v[k];
        }
        for k in 0..<S::Spins<f32> as Several<f32>>::LEN {
            a.spin[k] += w[k];
        }
        let (v, w) = response::<S, L>(&impulse, &moment, &self.arm_b, (b.inverse_mass, inertia_b));
        for k in 0..<S::Vectors<f32> as Several<f32>>::LEN {
            b.velocity[k] -= v[k];
        }
        for k in 0..<S::Spins<f32> as Several<f32>>::LEN {
            b.spin[k] -= w[k];
        }
    }

    /// What impulses do to the local twist: of a unit impulse of one of the groups a column of L.
    #[inline(always)]
    pub fn column(
        &self,
        pressing: &S::Vectors<Real<L>>,
        rubbing: &S::Spins<Real<L>>,
        inverse_masses: [Real<L>; 2],
        [inertia_a, inertia_b]: &[S::Inertias<Real<L>>; 2],
    ) -> (S::Vectors<Real<L>>, S::Spins<Real<L>>) {
        let (impulse, moment) = S::from_patch(&self.normal, &self.tangents, pressing, rubbing);
        let (mut v, mut w) = response::<S, L>(&impulse, &moment, &self.arm_a, (inverse_masses[0], inertia_a));
        let at_a = S::wide_swing(&w, &self.arm_a);
        let (v_b, w_b) = response::<S, L>(&impulse, &moment, &self.arm_b, (inverse_masses[1], inertia_b));
        let at_b = S::wide_swing(&w_b, &self.arm_b);
        for k in 0..<S::Vectors<f32> as Several<f32>>::LEN {
            v[k] = (v[k] + at_a[k]) + (v_b[k] + at_b[k]);
        }
        for k in 0..<S::Spins<f32> as Several<f32>>::LEN {
            w[k] += w_b[k];
        }
        S::to_patch(&self.normal, &self.tangents, &v, &w)
    }
}

/// Changes of velocity and spin by an impulse at an arm and a moment.
#[inline(always)]
fn response<S: Wide, L: Lanes>(
    impulse: &S::Vectors<Real<L>>,
    moment: &S::Spins<Real<L>>,
    arm: &S::Vectors<Real<L>>,
    (inverse_mass, inverse_inertia): (Real<L>, &S::Inertias<Real<L>>),
) -> (S::Vectors<Real<L>>, S::Spins<Real<L>>) {
    let mut torque = S::wide_moment(arm, impulse);
    for k in 0..<S::Spins<f32> as Several<f32>>::LEN {
        torque[k] += moment[k];
    }
    let mut velocity = *impulse;
    for k in 0..<S::Vectors<f32> as Several<f32>>::LEN {
        velocity[k] = impulse[k] * inverse_mass;
    }
    (velocity, S::wide_turn(inverse_inertia, &torque))
}

/// 1 / x, and 0 where nothing moves.
#[inline(always)]
fn inverse<L: Lanes>(x: Real<L>) -> Real<L> {
    let (zero, one) = (x.like(0.0), x.like(1.0));
    zero.if_less(x, one / x, zero)
}

/// Effective masses of a pack, and its warm start.
#[inline(always)]
pub fn prepare<S: Wide, L: Lanes>(
    lanes: L,
    (pack, beside): (&mut Pack<S>, &mut Beside<S>),
    at: [Places<'_>; 2],
    records: &Table<S>,
) {
    pack.inertia = [records.kept(lanes, &at[0]), records.kept(lanes, &at[1])];
    let frame = Frame::of(lanes, pack);
    let (mut a, mut b) = (records.motion(lanes, &at[0]), records.motion(lanes, &at[1]));
    let inertias = records.inertias(lanes, &at, &pack.inertia);
    let inverse_masses = [a.inverse_mass, b.inverse_mass];
    let (zero, one) = (Real::all(lanes, 0.0), Real::all(lanes, 1.0));
    let (none, still) = (S::Vectors::all(zero), S::Spins::all(zero));
    let mut masses = Masses::<S, L>::zero(lanes);
    // columns of the normal group: K, and what it does to friction's velocities
    let mut k_columns = S::Vectors::all(none);
    for m in 0..<S::Vectors<f32> as Several<f32>>::LEN {
        let mut unit = none;
        unit[m] = one;
        let (normal, rubbing) = frame.column(&unit, &still, inverse_masses, &inertias);
        k_columns[m] = normal;
        for k in 0..<S::Spins<f32> as Several<f32>>::LEN {
            masses.coupling[k][m] = rubbing[k];
        }
    }
    let mut block = S::Spins::all(still);
    for m in 0..<S::Spins<f32> as Several<f32>>::LEN {
        let mut unit = still;
        unit[m] = one;
        block[m] = frame.column(&none, &unit, inverse_masses, &inertias).1;
    }
    masses.slip = inverse(S::stiffest_slip(&block));
    let last = <S::Spins<f32> as Several<f32>>::LEN - 1;
    masses.twist = inverse(block[last][last]);
    let mut pressing = none;
    for i in 0..<S::Points<f32> as Several<f32>>::LEN {
        let lever = lever::<S, L>(lanes, pack, i);
        let mut on_lever = none;
        for m in 0..<S::Vectors<f32> as Several<f32>>::LEN {
            on_lever[m] = inner(&k_columns[m], &lever);
            pressing[m] += lever[m] * Real::load(lanes, &pack.points[i].impulse);
        }
        masses.points[i] = inverse(inner(&on_lever, &lever));
        for j in i + 1..<S::Points<f32> as Several<f32>>::LEN {
            masses.between[i][j] = inner(&on_lever, &self::lever::<S, L>(lanes, pack, j));
        }
    }
    pack.masses = masses.store();
    if beside.resists {
        let mut worst = zero;
        for m in 1..<S::Vectors<f32> as Several<f32>>::LEN {
            // the trace bounds the largest eigenvalue
            worst += k_columns[m][m];
            pressing[m] += Real::load(lanes, &beside.rolling_moment[m - 1]);
        }
        beside.rolling_mass = inverse(worst).store();
    }
    let mut rubbing = still;
    for k in 0..<S::Spins<f32> as Several<f32>>::LEN {
        rubbing[k] = Real::load(lanes, &pack.rubbing[k]);
    }
    frame.give(&pressing, &rubbing, (&mut a, &mut b), &inertias);
    records.scatter(&at[0], &a);
    records.scatter(&at[1], &b);
}

/// How point i acts on the normal group.
#[inline(always)]
pub fn lever<S: Wide, L: Lanes>(lanes: L, pack: &Pack<S>, i: usize) -> S::Vectors<Real<L>> {
    let one = Real::all(lanes, 1.0);
    let mut place = S::Slips::all(one);
    for k in 0..<S::Slips<f32> as Several<f32>>::LEN {
        place[k] = Real::load(lanes, &pack.points[i].place[k]);
    }
    S::wide_lever(one, &place)
}

/// Normal velocities at the step's start, before loads and warm starts: what restitution turns round.
#[inline(always)]
pub fn approach<S: Wide, L: Lanes>(
    lanes: L,
    (pack, beside): (&Pack<S>, &mut Beside<S>),
    at: [Places<'_>; 2],
    records: &Table<S>,
) {
    let frame = Frame::of(lanes, pack);
    let (normal, _) = frame.twist_now(lanes, records, at);
    for i in 0..<S::Points<f32> as Several<f32>>::LEN {
        beside.approach[i] = inner(&lever::<S, L>(lanes, pack, i), &normal).store();
    }
}
