//! Eight patches of one colour side by side, as they lie in memory: 172 bytes a patch in space, 88 in the plane.
//! Numbers that only precondition the sweep (masses, couplings) have eight bits of mantissa: at its fixed point all
//! increments vanish, so they move the way there and not the answer. Coefficients, arms, gaps and impulses are f32.

use super::patch::{EightPatches, Last, PatchResult, Rare};
use carom_math::lanes::{Eight, Lanes, Real, WIDTH};
use carom_math::{Several, Wide};
use std::marker::PhantomData;

/// A gap that no motion closes \[m\].
pub const APART: f32 = 1e30;

/// A point of eight patches.
#[derive(Clone, Copy)]
pub struct PackPoint<S: Wide> {
    /// Places along the tangents \[m\].
    pub place: S::Slips<Eight>,
    /// Gaps at the step's start \[m\].
    pub gap: Eight,
    /// Normal impulses of the present substep \[N s\].
    pub impulse: Eight,
}

/// Eight patches.
#[derive(Clone, Copy)]
pub struct Pack<S: Wide> {
    /// Normals.
    pub normal: S::Vectors<Eight>,
    /// Centres from bodies a.
    pub arm_a: S::Vectors<Eight>,
    /// Centres from bodies b.
    pub arm_b: S::Vectors<Eight>,
    /// What is kept of the inverse inertias of bodies a and b.
    pub inertia: [S::Kept<Eight>; 2],
    /// Coefficients of friction.
    pub friction: Eight,
    /// Torque that friction bears over the normal impulse \[m\].
    pub twisting: Eight,
    /// Masses and couplings, in pairs.
    pub masses: S::Pairs<Eight>,
    /// Friction's impulses of the present substep.
    pub rubbing: S::Spins<Eight>,
    /// The points.
    pub points: S::Points<PackPoint<S>>,
}

/// What few patches need, and what is told of a step, beside the packs. What every sweep needs of it comes first.
#[derive(Clone, Copy)]
#[repr(C)]
pub struct Beside<S: Wide> {
    /// Gaps of the points as the bodies stand now \[m\].
    pub gaps: S::Points<Eight>,
    /// Normal impulses over the step so far.
    pub total: S::Points<Eight>,
    /// Friction's impulses over the step so far.
    pub rubbed: S::Spins<Eight>,
    /// True when a patch bounces.
    pub bounces: bool,
    /// True when a patch resists rolling.
    pub resists: bool,
    /// Largest velocity that the last sweep changed \[m/s\].
    pub changed: Eight,
    /// Squared change of the last sweep, as the energy that it makes alone \[J\]; written where directions lead.
    pub length: Eight,
    /// Work of normal impulses over the step \[J\].
    pub pressing_work: Eight,
    /// Work of friction over the step, rolling friction included \[J\].
    pub rubbing_work: Eight,
    /// Coefficients of restitution.
    pub restitution: Eight,
    /// Normal velocities at the step's start \[m/s\].
    pub approach: S::Points<Eight>,
    /// Energy that restitution may give back \[J\].
    pub returnable: Eight,
    /// Coefficients of rolling friction \[m\].
    pub rolling: Eight,
    /// Effective inertias against rolling.
    pub rolling_mass: Eight,
    /// Rolling friction's moments of the present substep.
    pub rolling_moment: S::Slips<Eight>,
    /// The same over the step so far.
    pub rolled: S::Slips<Eight>,
}

impl<S: Wide> Pack<S> {
    /// Lanes without patches: obstacles at rest that never touch.
    pub fn empty() -> (Self, Beside<S>) {
        let zero = Eight::default();
        let point = PackPoint { place: S::Slips::all(zero), gap: Eight([APART; WIDTH]), impulse: zero };
        let mut normal = S::Vectors::all(zero);
        normal[0] = Eight([1.0; WIDTH]);
        let pack = Pack {
            normal,
            arm_a: S::Vectors::all(zero),
            arm_b: S::Vectors::all(zero),
            inertia: [S::Kept::all(zero); 2],
            friction: zero,
            twisting: zero,
            masses: S::Pairs::all(zero),
            rubbing: S::Spins::all(zero),
            points: S::Points::all(point),
        };
        let beside = Beside {
            gaps: S::Points::all(Eight([APART; WIDTH])),
            total: S::Points::all(zero),
            rubbed: S::Spins::all(zero),
            changed: zero,
            length: zero,
            pressing_work: zero,
            rubbing_work: zero,
            bounces: false,
            restitution: zero,
            approach: S::Points::all(zero),
            returnable: zero,
            resists: false,
            rolling: zero,
            rolling_mass: zero,
            rolling_moment: S::Slips::all(zero),
            rolled: S::Slips::all(zero),
        };
        (pack, beside)
    }

    /// Takes in eight patches, and begins their sums. What is beside them is as [`Pack::empty`] has it, but for what the last step
    /// left.
    #[inline(always)]
    pub fn fill(&mut self, beside: &mut Beside<S>, patches: &EightPatches<S>) {
        let zero = Eight::default();
        let mut next = 0;
        macro_rules! take {
            ($place:expr) => {
                $place = patches.column(next);
                next += 1;
            };
        }
        for column in [&mut self.normal, &mut self.arm_a, &mut self.arm_b] {
            for k in 0..<S::Vectors<f32> as Several<f32>>::LEN {
                take!(column[k]);
            }
        }
        take!(self.friction);
        take!(self.twisting);
        for k in 0..<S::Spins<f32> as Several<f32>>::LEN {
            take!(self.rubbing[k]);
            beside.rubbed[k] = zero;
        }
        for i in 0..<S::Points<f32> as Several<f32>>::LEN {
            for k in 0..<S::Slips<f32> as Several<f32>>::LEN {
                take!(self.points[i].place[k]);
            }
            take!(self.points[i].gap);
            beside.gaps[i] = self.points[i].gap;
            take!(self.points[i].impulse);
            beside.total[i] = zero;
        }
    }

    /// What the patches gave in the last substep, patch by patch.
    #[inline(always)]
    pub fn last<L: Lanes>(&self, lanes: L) -> [Eight; WIDTH] {
        let mut columns = [Real::all(lanes, 0.0); WIDTH];
        let points = <S::Points<f32> as Several<f32>>::LEN;
        for (column, i) in columns.iter_mut().zip(0..points) {
            *column = Real::load(lanes, &self.points[i].impulse);
        }
        for k in 0..<S::Spins<f32> as Several<f32>>::LEN {
            columns[points + k] = Real::load(lanes, &self.rubbing[k]);
        }
        let mut rows = [Eight::default(); WIDTH];
        for (row, told) in rows.iter_mut().zip(Real::turn(columns)) {
            *row = told.store();
        }
        rows
    }
}

impl<S: Wide> Beside<S> {
    /// Takes in what the patch in a lane needs and few do.
    pub fn put(&mut self, lane: usize, rare: &Rare<S>) {
        if rare.restitution > 0.0 {
            self.bounces = true;
            self.restitution.0[lane] = rare.restitution;
        }
        if rare.rolling > 0.0 {
            self.resists = true;
            self.rolling.0[lane] = rare.rolling;
            for k in 0..<S::Slips<f32> as Several<f32>>::LEN {
                self.rolling_moment[k].0[lane] = rare.rolling_moment[k];
            }
        }
    }

    /// What the patch in a lane gave in the last substep, from its row.
    #[inline]
    pub fn last(&self, row: &Eight, lane: usize) -> Last<S> {
        let points = <S::Points<f32> as Several<f32>>::LEN;
        let (mut normal, mut rubbing) = (S::Points::all(0.0), S::Spins::all(0.0));
        for i in 0..points {
            normal[i] = row.0[i];
        }
        for k in 0..<S::Spins<f32> as Several<f32>>::LEN {
            rubbing[k] = row.0[points + k];
        }
        let mut rolling = S::Slips::all(0.0);
        if self.resists {
            for k in 0..<S::Slips<f32> as Several<f32>>::LEN {
                rolling[k] = self.rolling_moment[k].0[lane];
            }
        }
        Last { normal, rubbing, rolling }
    }

    /// What it gave in the step.
    pub fn told(&self, lane: usize) -> PatchResult<S> {
        let mut out: PatchResult<S> = PatchResult {
            normal: S::Points::all(0.0),
            rubbing: S::Spins::all(0.0),
            rolling: S::Slips::all(0.0),
        };
        for i in 0..<S::Points<f32> as Several<f32>>::LEN {
            out.normal[i] = self.total[i].0[lane];
        }
        for k in 0..<S::Spins<f32> as Several<f32>>::LEN {
            out.rubbing[k] = self.rubbed[k].0[lane];
        }
        for k in 0..<S::Slips<f32> as Several<f32>>::LEN {
            out.rolling[k] = self.rolled[k].0[lane];
        }
        out
    }
}

/// What only preconditions a patch, in registers.
#[derive(Clone, Copy)]
pub struct Masses<S: Wide, L: Lanes> {
    /// Effective masses of the points \[kg\].
    pub points: S::Points<Real<L>>,
    /// Inverse mass between points i and j \[1/kg\].
    pub between: S::Points<S::Points<Real<L>>>,
    /// What friction's velocities get from the normal group's impulses.
    pub coupling: S::Spins<S::Vectors<Real<L>>>,
    /// Effective mass against slip \[kg\].
    pub slip: Real<L>,
    /// Effective inertia against spinning about the normal \[kg m^2\]; not read in the plane.
    pub twist: Real<L>,
}

/// Where the numbers lie that only precondition a patch: points, what is between them, couplings, slip, twist.
struct Places<S>(PhantomData<S>);

impl<S: Wide> Places<S> {
    const POINTS: usize = <S::Points<f32> as Several<f32>>::LEN;
    const SPINS: usize = <S::Spins<f32> as Several<f32>>::LEN;
    const VECTORS: usize = <S::Vectors<f32> as Several<f32>>::LEN;
    const COUPLING: usize = Self::POINTS * (Self::POINTS + 1) / 2;
    const SLIP: usize = Self::COUPLING + Self::SPINS * Self::VECTORS;
    const TWIST: usize = Self::SLIP + 1;

    /// Of points i < j.
    #[inline(always)]
    const fn between(i: usize, j: usize) -> usize {
        Self::POINTS + i * (2 * Self::POINTS - i - 1) / 2 + (j - i - 1)
    }
    /// Of friction's k-th velocity and the m-th impulse.
    #[inline(always)]
    const fn coupling(k: usize, m: usize) -> usize {
        Self::COUPLING + k * Self::VECTORS + m
    }
}

/// Numbers of a patch in space; the plane has fewer.
const MOST: usize = 22;

impl<S: Wide, L: Lanes> Masses<S, L> {
    /// Nothing known yet.
    #[inline(always)]
    pub fn zero(lanes: L) -> Self {
        let zero = Real::all(lanes, 0.0);
        Masses {
            points: S::Points::all(zero),
            between: S::Points::all(S::Points::all(zero)),
            coupling: S::Spins::all(S::Vectors::all(zero)),
            slip: zero,
            twist: zero,
        }
    }

    /// Keeps them in pairs.
    #[inline(always)]
    pub fn store(self) -> S::Pairs<Eight> {
        let mut flat = [self.slip.like(0.0); MOST];
        for i in 0..Places::<S>::POINTS {
            flat[i] = self.points[i];
            for j in i + 1..Places::<S>::POINTS {
                flat[Places::<S>::between(i, j)] = self.between[i][j];
            }
        }
        for k in 0..Places::<S>::SPINS {
            for m in 0..Places::<S>::VECTORS {
                flat[Places::<S>::coupling(k, m)] = self.coupling[k][m];
            }
        }
        flat[Places::<S>::SLIP] = self.slip;
        if Places::<S>::SPINS > 1 {
            flat[Places::<S>::TWIST] = self.twist;
        }
        let mut pairs: S::Pairs<Eight> = S::Pairs::all(Eight::default());
        for k in 0..<S::Pairs<f32> as Several<f32>>::LEN {
            pairs[k] = flat[2 * k].pair(flat[2 * k + 1]).store();
        }
        pairs
    }
}

/// The same as a pack keeps them, read one by one where they are used: all of them at once would not fit into registers.
pub struct KeptMasses<'a, S: Wide, L: Lanes> {
    lanes: L,
    pairs: &'a S::Pairs<Eight>,
}

impl<'a, S: Wide, L: Lanes> KeptMasses<'a, S, L> {
    /// Those of a pack.
    #[inline(always)]
    pub fn of(lanes: L, pairs: &'a S::Pairs<Eight>) -> Self {
        KeptMasses { lanes, pairs }
    }
    #[inline(always)]
    fn number(&self, k: usize) -> Real<L> {
        let (one, other) = Real::load(self.lanes, &self.pairs[k / 2]).parts();
        if k.is_multiple_of(2) { one } else { other }
    }
    /// Effective mass of a point \[kg\].
    #[inline(always)]
    pub fn point(&self, i: usize) -> Real<L> {
        self.number(i)
    }
    /// Inverse mass between points i < j \[1/kg\].
    #[inline(always)]
    pub fn between(&self, i: usize, j: usize) -> Real<L> {
        self.number(Places::<S>::between(i, j))
    }
    /// What friction's k-th velocity gets from the normal group's impulses.
    #[inline(always)]
    pub fn coupling(&self, k: usize) -> S::Vectors<Real<L>> {
        let mut row = S::Vectors::all(Real::all(self.lanes, 0.0));
        for m in 0..Places::<S>::VECTORS {
            row[m] = self.number(Places::<S>::coupling(k, m));
        }
        row
    }
    /// Effective mass against slip \[kg\].
    #[inline(always)]
    pub fn slip(&self) -> Real<L> {
        self.number(Places::<S>::SLIP)
    }
    /// Effective inertia against spinning about the normal \[kg m^2\]; of space alone.
    #[inline(always)]
    pub fn twist(&self) -> Real<L> {
        self.number(Places::<S>::TWIST)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use carom_math::lanes::Portable;
    use carom_math::{Planar, Spatial};

    #[test]
    fn a_patch_stays_within_its_bytes() {
        assert!(size_of::<Pack<Spatial>>() / WIDTH <= 180, "{}", size_of::<Pack<Spatial>>());
        assert!(size_of::<Pack<Planar>>() / WIDTH <= 90, "{}", size_of::<Pack<Planar>>());
    }

    fn kept_masses_are_read_where_they_were_put<S: Wide>() {
        let mut masses = Masses::<S, Portable>::zero(Portable);
        let mut next = 0.0;
        let mut number = || {
            next += 1.0;
            Real::all(Portable, next)
        };
        let (points, spins) = (<S::Points<f32> as Several<f32>>::LEN, <S::Spins<f32> as Several<f32>>::LEN);
        masses.points.slice_mut().iter_mut().for_each(|x| *x = number());
        for i in 0..points {
            masses.between[i].slice_mut()[i + 1..].iter_mut().for_each(|x| *x = number());
        }
        for k in 0..spins {
            masses.coupling[k].slice_mut().iter_mut().for_each(|x| *x = number());
        }
        (masses.slip, masses.twist) = (number(), number());
        let pairs = masses.store();
        let kept = KeptMasses::<S, Portable>::of(Portable, &pairs);
        let same = |a: Real<Portable>, b: Real<Portable>| assert_eq!(a.store(), b.store());
        for i in 0..points {
            same(kept.point(i), masses.points[i]);
            (i + 1..points).for_each(|j| same(kept.between(i, j), masses.between[i][j]));
        }
        for k in 0..spins {
            let row = kept.coupling(k);
            row.slice().iter().zip(masses.coupling[k].slice()).for_each(|(a, b)| same(*a, *b));
        }
        same(kept.slip(), masses.slip);
        if spins > 1 {
            same(kept.twist(), masses.twist);
        }
    }

    #[test]
    fn kept_masses_are_read_where_they_were_put_in_plane_and_space() {
        kept_masses_are_read_where_they_were_put::<Planar>();
        kept_masses_are_read_where_they_were_put::<Spatial>();
    }
}
