//! Bodies as the lanes see them: records of eight numbers, gathered eight at a time and turned. Record 0 is the
//! obstacle at rest that empty lanes and walls point to: nothing moves it, so lanes may share it.

use super::shared::Shared;
use carom_math::lanes::{Eight, Lanes, Real, WIDTH};
use carom_math::{Several, Wide, Workers};
use std::cell::Cell;
use std::ops::Range;

/// A body at the step's start.
#[derive(Clone, Copy)]
pub struct SoftBody<S: Wide> {
    /// Velocity of the centre of mass \[m/s\].
    pub velocity: S::Vectors<f32>,
    /// Angular velocity \[rad/s\].
    pub spin: S::Spins<f32>,
    /// Change of velocity by loads in a substep \[m/s\].
    pub load: S::Vectors<f32>,
    /// Change of angular velocity by loads in a substep \[rad/s\].
    pub spin_load: S::Spins<f32>,
    /// Inverse mass \[1/kg\]; 0 for obstacles.
    pub inverse_mass: f32,
    /// Inverse inertia in world axes \[1/(kg m^2)\].
    pub inverse_inertia: S::Inertias<f32>,
}

impl<S: Wide> SoftBody<S> {
    /// The obstacle at rest.
    pub fn none() -> Self {
        let (v, w) = (S::Vectors::all(0.0), S::Spins::all(0.0));
        let inverse_inertia = S::Inertias::all(0.0);
        SoftBody { velocity: v, spin: w, load: v, spin_load: w, inverse_mass: 0.0, inverse_inertia }
    }
}

/// Records of all bodies, one list per use.
pub struct Records<S: Wide> {
    /// Velocity, spin, what the body moved where that fits, inverse mass.
    pub motion: Vec<Eight>,
    /// Displacement and change of attitude since the step began, where they do not fit beside the motion.
    pub moved: Vec<Eight>,
    /// Inverse inertia.
    inertia: Vec<Eight>,
    /// Loads of a substep.
    load: Vec<Eight>,
    /// Motion at the start of the substep before.
    before: Vec<Eight>,
    /// Motion at the start of the step.
    start: Vec<Eight>,
    /// Motion where the last sweep began, and the direction that leads it on; empty where nothing leads.
    led: [Vec<Eight>; 2],
    space: std::marker::PhantomData<S>,
}

impl<S: Wide> Default for Records<S> {
    fn default() -> Self {
        let (motion, moved, inertia, load, before, start, led) = Default::default();
        Records { motion, moved, inertia, load, before, start, led, space: std::marker::PhantomData }
    }
}

/// Records that a worker writes at a time.
const BODIES: usize = 128;
/// So many are written before others have come.
const FEW: usize = 3 * BODIES;

/// A stretch of the lists.
struct Stretch<'a> {
    /// Its first record.
    first: usize,
    /// Motion, inverse inertia, loads, motion at the start of the substep before and of the step.
    lists: [&'a mut [Eight]; 5],
    moved: &'a mut [Eight],
}

impl<'a> Stretch<'a> {
    /// Its first records, and the others.
    fn split(self) -> (Self, Self) {
        let count = BODIES.min(self.lists[0].len());
        let (mut lists, mut others): ([&mut [Eight]; 5], [&mut [Eight]; 5]) = Default::default();
        for (list, (one, other)) in self.lists.into_iter().zip(lists.iter_mut().zip(&mut others)) {
            (*one, *other) = list.split_at_mut(count);
        }
        let moved = self.moved.split_at_mut(count.min(self.moved.len()));
        let first = self.first;
        (
            Stretch { first, lists, moved: moved.0 },
            Stretch { first: first + count, lists: others, moved: moved.1 },
        )
    }

    /// Writes a body's record. Rows are made of numbers in registers: what is written in parts and read as a whole at once
    /// waits.
    #[inline(always)]
    fn write<S: Wide>(&mut self, record: usize, body: &SoftBody<S>) {
        let (d, a) = (<S::Vectors<f32> as Several<f32>>::LEN, <S::Spins<f32> as Several<f32>>::LEN);
        let motion = |k: usize| if k < d { body.velocity[k] } else { body.spin[k - d] };
        let load = |k: usize| if k < d { body.load[k] } else { body.spin_load[k - d] };
        let still = S::no_turn();
        let turns = <S::Turns<f32> as Several<f32>>::LEN;
        let at = const { moved_at::<S>() } + d;
        let moved = |k: usize| if k >= at && k < at + turns { still[k - at] } else { 0.0 };
        let row = |number: &dyn Fn(usize) -> f32| {
            let mut row = Eight::default();
            for k in 0..WIDTH {
                row.0[k] = number(k);
            }
            row
        };
        let numbers = <S::Inertias<f32> as Several<f32>>::LEN;
        let beside = |k: usize| if const { moves_beside::<S>() } { moved(k) } else { 0.0 };
        let start = row(&|k| if k < d + a { motion(k) } else { 0.0 });
        let k = record - self.first;
        self.lists[0][k] = row(&|k| match k {
            _ if k < d + a => motion(k),
            _ if k == const { mass_at::<S>() } => body.inverse_mass,
            _ => beside(k),
        });
        self.lists[1][k] = row(&|k| if k < numbers { body.inverse_inertia[k] } else { 0.0 });
        self.lists[2][k] = row(&|k| if k < d + a { load(k) } else { 0.0 });
        (self.lists[3][k], self.lists[4][k]) = (start, start);
        if !const { moves_beside::<S>() } {
            self.moved[k] = row(&moved);
        }
    }
}

/// Numbers of a motion: velocity and spin.
const fn freedoms<S: Wide>() -> usize {
    <S::Vectors<f32> as Several<f32>>::LEN + <S::Spins<f32> as Several<f32>>::LEN
}

/// Whether a record of the motion has room for what the body moved, beside its inverse mass.
const fn moves_beside<S: Wide>() -> bool {
    let moved = <S::Vectors<f32> as Several<f32>>::LEN + <S::Turns<f32> as Several<f32>>::LEN;
    freedoms::<S>() + moved < WIDTH
}

/// Where what a body moved begins in its record.
const fn moved_at<S: Wide>() -> usize {
    if moves_beside::<S>() { freedoms::<S>() } else { 0 }
}

/// Where the inverse mass lies in a record of the motion.
const fn mass_at<S: Wide>() -> usize {
    let moved = <S::Vectors<f32> as Several<f32>>::LEN + <S::Turns<f32> as Several<f32>>::LEN;
    if moves_beside::<S>() { freedoms::<S>() + moved } else { freedoms::<S>() }
}

/// Ones where a record holds velocities.
const fn of_velocities<S: Wide>() -> Eight {
    let mut ones = Eight([0.0; WIDTH]);
    let mut k = 0;
    while k < freedoms::<S>() {
        ones.0[k] = 1.0;
        k += 1;
    }
    ones
}

/// Eight bodies in registers.
pub struct Eightfold<S: Wide, L: Lanes> {
    rows: [Real<L>; WIDTH],
    /// Velocities.
    pub velocity: S::Vectors<Real<L>>,
    /// Angular velocities.
    pub spin: S::Spins<Real<L>>,
    /// Inverse masses.
    pub inverse_mass: Real<L>,
    /// Inverse inertias.
    pub inverse_inertia: S::Inertias<Real<L>>,
}

/// Eight bodies' changes of pose.
pub struct Moved<S: Wide, L: Lanes> {
    /// Displacements.
    pub by: S::Vectors<Real<L>>,
    /// Changes of attitude.
    pub turn: S::Turns<Real<L>>,
}

#[inline(always)]
fn gather<L: Lanes>(lanes: L, record: impl Fn(usize) -> Eight, ids: &[u32; WIDTH]) -> [Real<L>; WIDTH] {
    let mut rows = [Real::all(lanes, 0.0); WIDTH];
    for k in 0..WIDTH {
        rows[k] = Real::load(lanes, &record(ids[k] as usize));
    }
    Real::turn(rows)
}

/// At most eight records that lie in a row, turned; where fewer are left the last one fills the other lanes.
#[inline(always)]
fn in_a_row<L: Lanes>(lanes: L, records: &[Cell<Eight>]) -> [Real<L>; WIDTH] {
    let mut rows = [Real::all(lanes, 0.0); WIDTH];
    for (k, row) in rows.iter_mut().enumerate() {
        *row = Real::load(lanes, &records[k.min(records.len() - 1)].get());
    }
    Real::turn(rows)
}

/// The records while workers share them.
pub struct Table<'a, S: Wide> {
    motion: Shared<'a, Eight>,
    moved: Shared<'a, Eight>,
    before: Shared<'a, Eight>,
    inertia: &'a [Eight],
    load: &'a [Eight],
    start: &'a [Eight],
    led: [Shared<'a, Eight>; 2],
    /// Records before this one are obstacles.
    obstacles: u32,
    space: std::marker::PhantomData<S>,
}

impl<S: Wide> Records<S> {
    /// Makes room for what leads all bodies on, or gives it back to nobody.
    pub fn make_room_to_lead(&mut self, leads: bool) {
        let count = if leads { self.motion.len() } else { 0 };
        self.led.iter_mut().for_each(|list| list.resize(count, Eight::default()));
    }

    /// The obstacle at rest, and behind it so many bodies. Workers write stretches of the lists, each its own.
    pub fn fill(&mut self, count: usize, body: impl Fn(usize) -> SoftBody<S> + Sync, workers: &Workers) {
        let Records { motion, moved, inertia, load, before, start, .. } = self;
        let beside = if const { moves_beside::<S>() } { 0 } else { count + 1 };
        moved.resize(beside, Eight::default());
        let all = [motion, inertia, load, before, start].map(|list| {
            list.resize(count + 1, Eight::default());
            list.as_mut_slice()
        });
        let mut rest = Stretch { first: 0, lists: all, moved };
        rest.write(0, &SoftBody::<S>::none());
        if workers.is_alone() || count <= FEW {
            return (1..=count).for_each(|k| rest.write(k, &body(k)));
        }
        let mut parts = Vec::with_capacity(count / BODIES + 1);
        while rest.first <= count {
            let own;
            (own, rest) = rest.split();
            parts.push(own);
        }
        workers.share(parts, |own: &mut Stretch<'_>| {
            let records = own.first.max(1)..own.first + own.lists[0].len();
            records.for_each(|k| own.write(k, &body(k)));
        });
    }

    /// For workers to share; records before `obstacles` are those of obstacles.
    pub fn table(&mut self, obstacles: u32) -> Table<'_, S> {
        let [before, direction] = &mut self.led;
        Table {
            led: [Shared::new(before), Shared::new(direction)],
            motion: Shared::new(&mut self.motion),
            moved: Shared::new(&mut self.moved),
            before: Shared::new(&mut self.before),
            inertia: &self.inertia,
            load: &self.load,
            start: &self.start,
            obstacles,
            space: std::marker::PhantomData,
        }
    }
}

#[cfg(test)]
impl<S: Wide> Records<S> {
    /// The same records in another order.
    pub fn in_order(&self, order: &[u32]) -> Self {
        let pick = |list: &Vec<Eight>| match list.is_empty() {
            true => Vec::new(),
            false => order.iter().map(|k| list[*k as usize]).collect(),
        };
        Records {
            motion: pick(&self.motion),
            moved: pick(&self.moved),
            before: pick(&self.before),
            inertia: pick(&self.inertia),
            load: pick(&self.load),
            start: pick(&self.start),
            ..Records::default()
        }
    }
}

impl<S: Wide> Table<'_, S> {
    /// Means of the velocities at the step's start and now, of eight bodies.
    #[inline(always)]
    pub fn mean<L: Lanes>(&self, lanes: L, ids: &[u32; WIDTH]) -> Eightfold<S, L> {
        let start = gather(lanes, |i| self.start[i], ids);
        let mut bodies = self.gather_motion(lanes, ids, &S::Kept::all(Eight::default()));
        let half = Real::all(lanes, 0.5);
        let d = <S::Vectors<f32> as Several<f32>>::LEN;
        for (v, start) in bodies.velocity.slice_mut().iter_mut().zip(&start) {
            *v = half * (*start + *v);
        }
        for (w, start) in bodies.spin.slice_mut().iter_mut().zip(&start[d..]) {
            *w = half * (*start + *w);
        }
        bodies
    }

    /// Velocities and inverse masses of eight bodies; of their inertias only what is kept in packs.
    #[inline(always)]
    fn gather_motion<L: Lanes>(
        &self,
        lanes: L,
        ids: &[u32; WIDTH],
        kept: &S::Kept<Eight>,
    ) -> Eightfold<S, L> {
        let rows = gather(lanes, |i| self.motion.get(i), ids);
        let (d, a) = (<S::Vectors<f32> as Several<f32>>::LEN, <S::Spins<f32> as Several<f32>>::LEN);
        let mut velocity = S::Vectors::all(rows[0]);
        let mut spin = S::Spins::all(rows[0]);
        for k in 0..d {
            velocity[k] = rows[k];
        }
        for k in 0..a {
            spin[k] = rows[d + k];
        }
        let mut inverse_inertia = S::Inertias::all(rows[0]);
        for k in 0..<S::Kept<f32> as Several<f32>>::LEN {
            inverse_inertia[k] = Real::load(lanes, &kept[k]);
        }
        Eightfold { rows, velocity, spin, inverse_mass: rows[const { mass_at::<S>() }], inverse_inertia }
    }

    /// Velocities and inverse masses of eight bodies, whose pack keeps this of them.
    #[inline(always)]
    pub fn gather<L: Lanes>(&self, lanes: L, ids: &[u32; WIDTH], kept: &S::Kept<Eight>) -> Eightfold<S, L> {
        let mut bodies = self.gather_motion(lanes, ids, kept);
        if <S::Kept<f32> as Several<f32>>::LEN < <S::Inertias<f32> as Several<f32>>::LEN {
            let rows = gather(lanes, |i| self.inertia[i], ids);
            let numbers = bodies.inverse_inertia.slice_mut();
            numbers.iter_mut().zip(&rows).for_each(|(number, row)| *number = *row);
        }
        bodies
    }

    /// What packs keep of eight bodies' inverse inertias, so that a sweep gathers only what changes.
    #[inline(always)]
    pub fn kept<L: Lanes>(&self, lanes: L, ids: &[u32; WIDTH]) -> S::Kept<Eight> {
        let mut kept = S::Kept::all(Eight::default());
        if <S::Kept<f32> as Several<f32>>::LEN > 0 {
            let rows = gather(lanes, |i| self.inertia[i], ids);
            for k in 0..<S::Kept<f32> as Several<f32>>::LEN {
                kept[k] = rows[k].store();
            }
        }
        kept
    }

    /// Writes velocities back. Not those of obstacles, which impulses do not change and packs of a colour share.
    #[inline(always)]
    pub fn scatter<L: Lanes>(&self, ids: &[u32; WIDTH], bodies: &Eightfold<S, L>) {
        let d = <S::Vectors<f32> as Several<f32>>::LEN;
        let (mut rows, velocity) = (bodies.rows, bodies.velocity);
        for k in 0..d {
            rows[k] = velocity[k];
        }
        for k in 0..<S::Spins<f32> as Several<f32>>::LEN {
            rows[d + k] = bodies.spin[k];
        }
        let rows = Real::turn(rows);
        let free = self.motion.behind(self.obstacles as usize);
        for k in 0..WIDTH {
            free.set(ids[k] as usize, rows[k].store());
        }
    }

    /// How eight bodies moved since the step began; `bodies` are the same ones.
    #[inline(always)]
    pub fn moved<L: Lanes>(&self, lanes: L, ids: &[u32; WIDTH], bodies: &Eightfold<S, L>) -> Moved<S, L> {
        let rows = if const { moves_beside::<S>() } {
            bodies.rows
        } else {
            gather(lanes, |i| self.moved.get(i), ids)
        };
        let (d, at) = (<S::Vectors<f32> as Several<f32>>::LEN, const { moved_at::<S>() });
        let mut by = S::Vectors::all(rows[0]);
        let mut turn = S::Turns::all(rows[0]);
        for k in 0..d {
            by[k] = rows[at + k];
        }
        for k in 0..<S::Turns<f32> as Several<f32>>::LEN {
            turn[k] = rows[at + d + k];
        }
        Moved { by, turn }
    }

    /// Velocities of some records after a substep's loads. From the second substep on also after its warm start: arms and inertias
    /// stand still in a step, so what all contacts gave a body in the substep before is v - v_before - load.
    #[inline(always)]
    pub fn accelerate<L: Lanes>(&self, lanes: L, records: Range<usize>, substep: usize) {
        let (none, is_velocity) = (Real::all(lanes, 0.0), Real::load(lanes, const { &of_velocities::<S>() }));
        let motions = self.motion.row(records.clone());
        // what lies beside the velocities stays
        if substep == 0 {
            // before the first substep `before` is the velocity without the warm start
            for (motion, load) in motions.iter().zip(&self.load[records]) {
                let v = Real::load(lanes, &motion.get());
                motion.set(none.if_less(is_velocity, v + Real::load(lanes, load), v).store());
            }
            return;
        }
        for (motion, before) in motions.iter().zip(self.before.row(records)) {
            let now = motion.get();
            let v = Real::load(lanes, &now);
            let faster = v + (v - Real::load(lanes, &before.get()));
            motion.set(none.if_less(is_velocity, faster, v).store());
            before.set(now);
        }
    }

    /// A body's motion, and what leads it on: its motion before the last sweep, and the direction.
    #[inline(always)]
    pub fn led(&self, i: usize) -> (Eight, [Eight; 2]) {
        (self.motion.get(i), [self.led[0].get(i), self.led[1].get(i)])
    }

    /// Replaces a body's velocities, not what lies beside them, and what leads it on.
    #[inline(always)]
    pub fn lead<L: Lanes>(&self, lanes: L, i: usize, now: Eight, [before, direction]: [Eight; 2]) {
        let (none, is_velocity) = (Real::all(lanes, 0.0), Real::load(lanes, const { &of_velocities::<S>() }));
        let (old, new) = (Real::load(lanes, &self.motion.get(i)), Real::load(lanes, &now));
        self.motion.set(i, none.if_less(is_velocity, new, old).store());
        self.led[0].set(i, before);
        self.led[1].set(i, direction);
    }

    /// Poses of some records after a substep of length `h` \[s\], eight at a time.
    #[inline(always)]
    pub fn move_on<L: Lanes>(&self, lanes: L, records: Range<usize>, h: f32) {
        let (d, at) = (<S::Vectors<f32> as Several<f32>>::LEN, const { moved_at::<S>() });
        let (h, beside) = (Real::all(lanes, h), const { moves_beside::<S>() });
        let motions = self.motion.row(records.clone());
        let moved = if beside { motions } else { self.moved.row(records) };
        for (motions, moved) in motions.chunks(WIDTH).zip(moved.chunks(WIDTH)) {
            let motion = in_a_row(lanes, motions);
            let mut rows = if beside { motion } else { in_a_row(lanes, moved) };
            let (mut turn, mut angle) = (S::Turns::all(h), S::Spins::all(h));
            for k in 0..<S::Turns<f32> as Several<f32>>::LEN {
                turn[k] = rows[at + d + k];
            }
            for k in 0..<S::Spins<f32> as Several<f32>>::LEN {
                angle[k] = h * motion[d + k];
            }
            let turn = S::turned_by(&turn, &angle);
            for k in 0..d {
                rows[at + k] += h * motion[k];
            }
            for k in 0..<S::Turns<f32> as Several<f32>>::LEN {
                rows[at + d + k] = turn[k];
            }
            for (to, row) in moved.iter().zip(Real::turn(rows)) {
                to.set(row.store());
            }
        }
    }
}

impl<S: Wide> Records<S> {
    /// Velocity and spin of a record.
    pub fn motion_of(&self, record: u32) -> (S::Vectors<f32>, S::Spins<f32>) {
        let numbers = &self.motion[record as usize].0;
        let (mut v, mut w) = (S::Vectors::all(0.0), S::Spins::all(0.0));
        let d = v.slice().len();
        v.slice_mut().copy_from_slice(&numbers[..d]);
        let a = w.slice().len();
        w.slice_mut().copy_from_slice(&numbers[d..d + a]);
        (v, w)
    }

    /// Whether a record's velocities after so many substeps are, bit for bit, those that loads alone give: what [`Table::accelerate`]
    /// does in each.
    pub fn flew(&self, record: u32, substeps: usize) -> bool {
        let record = record as usize;
        let (motion, load) = (&self.motion[record].0, &self.load[record].0);
        let mut before = self.start[record].0;
        let mut v = before;
        for k in 0..WIDTH {
            v[k] += load[k];
        }
        for _ in 1..substeps {
            for k in 0..WIDTH {
                let faster = v[k] + (v[k] - before[k]);
                (before[k], v[k]) = (v[k], faster);
            }
        }
        (0..freedoms::<S>()).all(|k| v[k] == motion[k])
    }

    /// Displacement and change of attitude of a record.
    pub fn moved_of(&self, record: u32) -> (S::Vectors<f32>, S::Turns<f32>) {
        let list = if const { moves_beside::<S>() } { &self.motion } else { &self.moved };
        let numbers = &list[record as usize].0[const { moved_at::<S>() }..];
        let (mut by, mut turn) = (S::Vectors::all(0.0), S::no_turn());
        let d = by.slice().len();
        by.slice_mut().copy_from_slice(&numbers[..d]);
        let n = turn.slice().len();
        turn.slice_mut().copy_from_slice(&numbers[d..d + n]);
        (by, turn)
    }
}
