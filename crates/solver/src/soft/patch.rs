//! What the soft solver is told of patches of contact, and tells of them. A patch is rows of eight numbers, so that eight patches
//! are turned into the columns of a pack as they lie; what few patches need lies beside them.

use super::pack::APART;
use carom_math::lanes::{Eight, Lanes, Real, WIDTH};
use carom_math::several::Plain;
use carom_math::{Several, Wide};
use std::ops::{Index, IndexMut};

/// Numbers of a vector, of friction's impulses, and of a point.
const fn vector<S: Wide>() -> usize {
    <S::Vectors<f32> as Several<f32>>::LEN
}
const fn spins<S: Wide>() -> usize {
    <S::Spins<f32> as Several<f32>>::LEN
}
const fn point<S: Wide>() -> usize {
    <S::Slips<f32> as Several<f32>>::LEN + 2
}
/// Where friction's coefficient lies: behind the normal and both arms.
const fn friction<S: Wide>() -> usize {
    3 * vector::<S>()
}
/// Where friction's impulses lie: behind both coefficients.
const fn rubbing<S: Wide>() -> usize {
    friction::<S>() + 2
}
/// Where the points lie.
const fn points<S: Wide>() -> usize {
    rubbing::<S>() + spins::<S>()
}

/// Points that two bodies share with one normal: normal, arms, coefficients of friction, friction's impulses to start from, and of
/// each point its place, gap and impulse to start from.
#[derive(Clone, Copy)]
pub struct Patch<S: Wide>(pub(super) S::Rows<Eight>);

impl<S: Wide> Index<usize> for Patch<S> {
    type Output = f32;
    #[inline(always)]
    fn index(&self, k: usize) -> &f32 {
        &self.0[k / WIDTH].0[k % WIDTH]
    }
}

impl<S: Wide> IndexMut<usize> for Patch<S> {
    #[inline(always)]
    fn index_mut(&mut self, k: usize) -> &mut f32 {
        &mut self.0[k / WIDTH].0[k % WIDTH]
    }
}

impl<S: Wide> Patch<S> {
    /// No patch at all.
    pub fn none() -> Self {
        let mut patch = Patch(S::Rows::all(Eight::default()));
        patch[0] = 1.0;
        for i in 0..<S::Points<f32> as Several<f32>>::LEN {
            patch[points::<S>() + (i + 1) * point::<S>() - 2] = APART;
        }
        patch
    }
}

/// Where numbers of patches go: of one, or of several side by side.
pub trait Numbers<S: Wide> {
    /// What is written at a time.
    type Number: Plain;
    /// Writes the k-th number.
    fn put(&mut self, k: usize, number: Self::Number);

    /// Sets the unit normal from body b to body a, and the arms that lead to the patch's centre from both centres of mass \[m\].
    #[inline(always)]
    fn set_place(
        &mut self,
        normal: S::Vectors<Self::Number>,
        arm_a: S::Vectors<Self::Number>,
        arm_b: S::Vectors<Self::Number>,
    ) {
        for k in 0..vector::<S>() {
            self.put(k, normal[k]);
            self.put(vector::<S>() + k, arm_a[k]);
            self.put(2 * vector::<S>() + k, arm_b[k]);
        }
    }

    /// Sets a point: its place from the patch's centre along its tangents \[m\], and the distance of the surfaces at the step's
    /// start \[m\], at most [`APART`].
    #[inline(always)]
    fn set_point(&mut self, i: usize, place: S::Slips<Self::Number>, gap: Self::Number) {
        let first = points::<S>() + i * point::<S>();
        for k in 0..<S::Slips<f32> as Several<f32>>::LEN {
            self.put(first + k, place[k]);
        }
        self.put(first + point::<S>() - 2, gap);
    }

    /// Sets the coefficient of friction \[1\], and what friction over the patch and spinning friction bear of a torque about the
    /// normal, over the normal impulse \[m\].
    #[inline(always)]
    fn set_friction(&mut self, friction: Self::Number, twisting: Self::Number) {
        self.put(self::friction::<S>(), friction);
        self.put(self::friction::<S>() + 1, twisting);
    }

    /// Sets the normal impulse of a substep that a point starts from \[N s\].
    #[inline(always)]
    fn press(&mut self, i: usize, impulse: Self::Number) {
        self.put(points::<S>() + (i + 1) * point::<S>() - 1, impulse);
    }

    /// Sets friction's impulses of a substep to start from: along a tangent \[N s\], and about the normal in space \[N m s\].
    #[inline(always)]
    fn rub(&mut self, k: usize, impulse: Self::Number) {
        self.put(rubbing::<S>() + k, impulse);
    }
}

impl<S: Wide> Numbers<S> for Patch<S> {
    type Number = f32;
    #[inline(always)]
    fn put(&mut self, k: usize, number: f32) {
        self[k] = number;
    }
}

/// Eight patches side by side: a number of all of them is a column. Four of them are written at a time.
pub struct EightPatches<S: Wide>(S::Rows<[Eight; WIDTH]>);

impl<S: Wide> Default for EightPatches<S> {
    fn default() -> Self {
        EightPatches(S::Rows::all([Eight::default(); WIDTH]))
    }
}

impl<S: Wide> EightPatches<S> {
    /// The first four, or the others.
    #[inline(always)]
    pub fn half(&mut self, others: bool) -> FourPatches<'_, S> {
        FourPatches { all: self, first: if others { 4 } else { 0 } }
    }

    /// Writes one of them.
    pub fn replace(&mut self, lane: usize, patch: &Patch<S>) {
        for k in 0..<S::Rows<f32> as Several<f32>>::LEN * WIDTH {
            self.0[k / WIDTH][k % WIDTH].0[lane] = patch[k];
        }
    }

    /// A number of all of them.
    #[inline(always)]
    pub(super) fn column(&self, k: usize) -> Eight {
        self.0[k / WIDTH][k % WIDTH]
    }

    /// Takes them side by side.
    #[inline(always)]
    pub(super) fn join<L: Lanes>(&mut self, lanes: L, patches: [&Patch<S>; WIDTH]) {
        for row in 0..<S::Rows<f32> as Several<f32>>::LEN {
            let mut eight = [Real::all(lanes, 0.0); WIDTH];
            for lane in 0..WIDTH {
                eight[lane] = Real::load(lanes, &patches[lane].0[row]);
            }
            for (column, numbers) in self.0[row].iter_mut().zip(Real::turn(eight)) {
                *column = numbers.store();
            }
        }
    }

    /// Each for itself.
    #[inline(always)]
    pub fn part<L: Lanes>(&self, lanes: L, patches: &mut [Patch<S>; WIDTH]) {
        for row in 0..<S::Rows<f32> as Several<f32>>::LEN {
            let mut columns = [Real::all(lanes, 0.0); WIDTH];
            for (column, of_all) in columns.iter_mut().zip(&self.0[row]) {
                *column = Real::load(lanes, of_all);
            }
            for (patch, numbers) in patches.iter_mut().zip(Real::turn(columns)) {
                patch.0[row] = numbers.store();
            }
        }
    }
}

/// Four of eight patches.
pub struct FourPatches<'a, S: Wide> {
    all: &'a mut EightPatches<S>,
    first: usize,
}

impl<S: Wide> Numbers<S> for FourPatches<'_, S> {
    type Number = [f32; 4];
    #[inline(always)]
    fn put(&mut self, k: usize, number: [f32; 4]) {
        self.all.0[k / WIDTH][k % WIDTH].0[self.first..self.first + 4].copy_from_slice(&number);
    }
}

/// What few patches need.
#[derive(Clone, Copy)]
pub struct Rare<S: Wide> {
    /// Coefficient of restitution \[1\].
    pub restitution: f32,
    /// Coefficient of rolling friction \[m\].
    pub rolling: f32,
    /// Rolling friction's moments of a substep to start from, along the tangents \[N m s\].
    pub rolling_moment: S::Slips<f32>,
}

impl<S: Wide> Rare<S> {
    /// No restitution and no rolling friction.
    pub fn none() -> Self {
        Rare { restitution: 0.0, rolling: 0.0, rolling_moment: S::Slips::all(0.0) }
    }
    /// Whether there is neither.
    #[inline]
    pub fn is_none(&self) -> bool {
        self.restitution <= 0.0 && self.rolling <= 0.0
    }
}

/// Patches in a list.
pub struct Patches<S: Wide> {
    /// Bodies a and b of each, for whoever adds patches to say; by their records before they are solved, at most one of them an obstacle.
    pub pairs: Vec<(u32, u32)>,
    pub(super) all: Vec<Patch<S>>,
    /// One for each patch, or none where none needs it.
    pub(super) rare: Vec<Rare<S>>,
    none: Patch<S>,
}

impl<S: Wide> Default for Patches<S> {
    fn default() -> Self {
        Patches { pairs: Vec::new(), all: Vec::new(), rare: Vec::new(), none: Patch::none() }
    }
}

impl<S: Wide> Patches<S> {
    /// How many there are.
    pub fn len(&self) -> usize {
        self.all.len()
    }
    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.all.is_empty()
    }
    /// Forgets them.
    pub fn clear(&mut self) {
        self.pairs.clear();
        self.all.clear();
        self.rare.clear();
    }
    /// Adds one without points, and hands it over: it is written where it stays, for what is copied at once waits for its parts.
    #[inline(always)]
    pub fn add(&mut self) -> &mut Patch<S> {
        let none = self.none;
        self.push(&none)
    }
    /// Adds a patch, and hands it over.
    #[inline(always)]
    pub fn push(&mut self, patch: &Patch<S>) -> &mut Patch<S> {
        if !self.rare.is_empty() {
            self.rare.push(Rare::none());
        }
        self.all.push(*patch);
        let last = self.all.len() - 1;
        &mut self.all[last]
    }
    /// Another takes the place of one of them; what it needs and few do stays.
    #[inline(always)]
    pub fn replace(&mut self, place: usize, patch: &Patch<S>) {
        self.all[place] = *patch;
    }
    /// What the last one needs and few do.
    pub fn set_rare(&mut self, rare: Rare<S>) {
        if !rare.is_none() {
            self.rare.resize(self.all.len(), Rare::none());
            self.rare.iter_mut().last().into_iter().for_each(|last| *last = rare);
        }
    }
    /// The patches.
    pub fn list(&self) -> &[Patch<S>] {
        &self.all
    }
    /// So many patches and their pairs, of which nothing rare is known, for who writes all of them. What was there is not forgotten
    /// first, to be written once.
    pub fn room_for(&mut self, count: usize) -> (&mut [Patch<S>], &mut [(u32, u32)]) {
        self.rare.clear();
        self.all.resize(count, self.none);
        self.pairs.resize(count, (0, 0));
        (&mut self.all, &mut self.pairs)
    }
    /// Takes over what patches of another list need and few do; here they come from this place on.
    pub fn take_rare(&mut self, first: usize, other: &Self) {
        if !other.rare.is_empty() {
            self.rare.resize(self.all.len(), Rare::none());
            self.rare[first..first + other.rare.len()].copy_from_slice(&other.rare);
        }
    }
    /// Keeps those whose place in the list fits.
    pub fn retain(&mut self, fits: impl Fn(usize) -> bool) {
        keep(&mut self.pairs, &fits);
        keep(&mut self.all, &fits);
        keep(&mut self.rare, &fits);
    }
}

/// Keeps items whose place fits.
fn keep<T>(items: &mut Vec<T>, fits: impl Fn(usize) -> bool) {
    let mut places = 0..items.len();
    items.retain(|_| places.next().is_some_and(&fits));
}

/// What a patch gave in the last substep, on body a.
#[derive(Clone, Copy)]
pub struct Last<S: Wide> {
    /// Normal impulses \[N s\].
    pub normal: S::Points<f32>,
    /// Friction's impulses.
    pub rubbing: S::Spins<f32>,
    /// Rolling friction's moments.
    pub rolling: S::Slips<f32>,
}

/// What a patch gave in a step, on body a.
#[derive(Clone, Copy)]
pub struct PatchResult<S: Wide> {
    /// Normal impulses over the step \[N s\].
    pub normal: S::Points<f32>,
    /// Friction's impulses over the step.
    pub rubbing: S::Spins<f32>,
    /// Rolling friction's moments over the step.
    pub rolling: S::Slips<f32>,
}

#[cfg(test)]
mod tests {
    use super::*;
    use carom_math::{Planar, Spatial};

    fn fits_into_its_rows<S: Wide>() {
        let numbers = points::<S>() + <S::Points<f32> as Several<f32>>::LEN * point::<S>();
        assert!(numbers <= S::Rows::<f32>::LEN * WIDTH);
    }

    #[test]
    fn a_patch_fits_into_its_rows() {
        fits_into_its_rows::<Planar>();
        fits_into_its_rows::<Spatial>();
    }

    fn add(to: &mut Patches<Planar>, number: f32, restitution: Option<f32>) {
        to.add().set_place([number, 0.0], [0.0; 2], [0.0; 2]);
        if let Some(restitution) = restitution {
            to.set_rare(Rare { restitution, ..Rare::none() });
        }
    }

    #[test]
    fn what_is_rare_stays_with_its_patch() {
        let (mut one, mut other, mut all) =
            (Patches::<Planar>::default(), Patches::default(), Patches::default());
        add(&mut one, 0.0, None);
        assert!(one.rare.is_empty());
        add(&mut one, 1.0, Some(0.0));
        assert!(one.rare.is_empty());
        add(&mut other, 2.0, None);
        add(&mut other, 3.0, Some(0.3));
        add(&mut other, 4.0, None);
        let (first, then) = all.room_for(5).0.split_at_mut(2);
        first.copy_from_slice(one.list());
        then.copy_from_slice(other.list());
        all.take_rare(0, &one);
        all.take_rare(2, &other);
        all.retain(|k| k != 1);
        let told: Vec<(f32, f32)> =
            all.all.iter().zip(&all.rare).map(|(p, rare)| (p[0], rare.restitution)).collect();
        assert_eq!(told, [(0.0, 0.0), (2.0, 0.0), (3.0, 0.3), (4.0, 0.0)]);
    }
}
