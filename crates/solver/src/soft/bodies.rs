//! Bodies as the lanes see them: records of a few numbers, gathered eight at a time and turned. Record 0 is the
//! obstacle at rest that empty lanes and walls point to: nothing moves it, so lanes may share it.

use super::shared::{Places, Shared};
use carom_math::lanes::{Eight, Lanes, Real, WIDTH};
use carom_math::{Record, Several, Wide, Workers};
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

/// What changes of a body within a step. A sweep needs all of it at once, by one place in the list.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[repr(C, align(32))]
pub struct Body<R> {
    /// Velocity, spin, inverse mass.
    pub motion: R,
    /// Displacement and change of attitude since the step began.
    pub moved: R,
}

/// Records of all bodies, one list per use.
pub struct Records<S: Wide> {
    /// Motion, and what was moved.
    pub bodies: Vec<Body<S::Record>>,
    /// Inverse inertia.
    inertia: Vec<S::Record>,
    /// Loads of a substep.
    load: Vec<S::Record>,
    /// Motion at the start of the substep before.
    before: Vec<S::Record>,
    /// Motion at the start of the step.
    start: Vec<S::Record>,
    /// Motion where the last sweep began, and the direction that leads it on; empty where nothing leads.
    led: [Vec<Eight>; 2],
}

impl<S: Wide> Default for Records<S> {
    fn default() -> Self {
        let (bodies, inertia, load, before, start, led) = Default::default();
        Records { bodies, inertia, load, before, start, led }
    }
}

/// Records that a worker writes at a time.
const BODIES: usize = 128;
/// So many are written before others have come.
const FEW: usize = 3 * BODIES;

/// A stretch of the lists.
struct Stretch<'a, S: Wide> {
    /// Its first record.
    first: usize,
    bodies: &'a mut [Body<S::Record>],
    /// Inverse inertia, loads, motion at the start of the substep before and of the step.
    lists: [&'a mut [S::Record]; 4],
}

impl<S: Wide> Stretch<'_, S> {
    /// Its first records, and the others.
    fn split(self) -> (Self, Self) {
        let count = BODIES.min(self.bodies.len());
        let bodies = self.bodies.split_at_mut(count);
        let (first, [a, b, c, d]) = (self.first, self.lists.map(|list| list.split_at_mut(count)));
        let (lists, others) = ([a.0, b.0, c.0, d.0], [a.1, b.1, c.1, d.1]);
        (
            Stretch { first, bodies: bodies.0, lists },
            Stretch { first: first + count, bodies: bodies.1, lists: others },
        )
    }

    /// Writes a body's record. Rows are made of numbers in registers: what is written in parts and read as a whole at once
    /// waits.
    #[inline(always)]
    fn write(&mut self, record: usize, body: &SoftBody<S>) {
        let (d, a) = (<S::Vectors<f32> as Several<f32>>::LEN, <S::Spins<f32> as Several<f32>>::LEN);
        let motion = |k: usize| if k < d { body.velocity[k] } else { body.spin[k - d] };
        let load = |k: usize| if k < d { body.load[k] } else { body.spin_load[k - d] };
        let still = S::no_turn();
        let turns = <S::Turns<f32> as Several<f32>>::LEN;
        let row = |number: &dyn Fn(usize) -> f32| {
            let mut row = Eight::default();
            for k in 0..WIDTH {
                row.0[k] = number(k);
            }
            S::Record::of(row)
        };
        let numbers = <S::Inertias<f32> as Several<f32>>::LEN;
        let start = row(&|k| if k < d + a { motion(k) } else { 0.0 });
        let k = record - self.first;
        self.bodies[k] = Body {
            motion: row(&|k| match k {
                _ if k < d + a => motion(k),
                _ if k == d + a => body.inverse_mass,
                _ => 0.0,
            }),
            moved: row(&|k| if k >= d && k < d + turns { still[k - d] } else { 0.0 }),
        };
        self.lists[0][k] = row(&|k| if k < numbers { body.inverse_inertia[k] } else { 0.0 });
        self.lists[1][k] = row(&|k| if k < d + a { load(k) } else { 0.0 });
        (self.lists[2][k], self.lists[3][k]) = (start, start);
    }
}

/// Numbers of a motion: velocity and spin. The inverse mass lies behind them.
const fn freedoms<S: Wide>() -> usize {
    <S::Vectors<f32> as Several<f32>>::LEN + <S::Spins<f32> as Several<f32>>::LEN
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
    /// Velocities.
    pub velocity: S::Vectors<Real<L>>,
    /// Angular velocities.
    pub spin: S::Spins<Real<L>>,
    /// Inverse masses.
    pub inverse_mass: Real<L>,
}

/// Eight bodies' changes of pose.
pub struct Moved<S: Wide, L: Lanes> {
    /// Displacements.
    pub by: S::Vectors<Real<L>>,
    /// Changes of attitude.
    pub turn: S::Turns<Real<L>>,
}

/// Numbers of eight records.
type Columns<S, L> = <<S as Wide>::Record as Record>::Columns<Real<L>>;

#[inline(always)]
fn gather<S: Wide, L: Lanes>(lanes: L, record: impl Fn(usize) -> S::Record) -> Columns<S, L> {
    let mut rows = [S::Record::default(); WIDTH];
    for (k, row) in rows.iter_mut().enumerate() {
        *row = record(k);
    }
    S::Record::columns(lanes, rows)
}

/// The records while workers share them.
pub struct Table<'a, S: Wide> {
    bodies: Shared<'a, Body<S::Record>>,
    before: Shared<'a, S::Record>,
    inertia: &'a [S::Record],
    load: &'a [S::Record],
    start: &'a [S::Record],
    led: [Shared<'a, Eight>; 2],
    /// Records before this one are obstacles.
    obstacles: u32,
}

impl<S: Wide> Records<S> {
    /// Makes room for what leads all bodies on, or gives it back to nobody.
    pub fn make_room_to_lead(&mut self, leads: bool) {
        let count = if leads { self.bodies.len() } else { 0 };
        self.led.iter_mut().for_each(|list| list.resize(count, Eight::default()));
    }

    /// The obstacle at rest, and behind it so many bodies. Workers write stretches of the lists, each its own.
    pub fn fill(&mut self, count: usize, body: impl Fn(usize) -> SoftBody<S> + Sync, workers: &Workers) {
        let Records { bodies, inertia, load, before, start, .. } = self;
        bodies.resize(count + 1, Body::default());
        let lists = [inertia, load, before, start].map(|list| {
            list.resize(count + 1, S::Record::default());
            list.as_mut_slice()
        });
        let mut rest = Stretch { first: 0, bodies, lists };
        rest.write(0, &SoftBody::none());
        if workers.is_alone() || count <= FEW {
            return (1..=count).for_each(|k| rest.write(k, &body(k)));
        }
        let mut parts = Vec::with_capacity(count / BODIES + 1);
        while rest.first <= count {
            let own;
            (own, rest) = rest.split();
            parts.push(own);
        }
        workers.share(parts, |own: &mut Stretch<'_, S>| {
            let records = own.first.max(1)..own.first + own.bodies.len();
            records.for_each(|k| own.write(k, &body(k)));
        });
    }

    /// For workers to share; records before `obstacles` are those of obstacles.
    pub fn table(&mut self, obstacles: u32) -> Table<'_, S> {
        let [before, direction] = &mut self.led;
        Table {
            led: [Shared::new(before), Shared::new(direction)],
            bodies: Shared::new(&mut self.bodies),
            before: Shared::new(&mut self.before),
            inertia: &self.inertia,
            load: &self.load,
            start: &self.start,
            obstacles,
        }
    }
}

#[cfg(test)]
impl<S: Wide> Records<S> {
    /// The same records in another order.
    pub fn in_order(&self, order: &[u32]) -> Self {
        let pick = |list: &Vec<S::Record>| match list.is_empty() {
            true => Vec::new(),
            false => order.iter().map(|k| list[*k as usize]).collect(),
        };
        Records {
            bodies: order.iter().map(|k| self.bodies[*k as usize]).collect(),
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
    pub fn mean<L: Lanes>(&self, lanes: L, at: &Places<'_>) -> Eightfold<S, L> {
        let starts = at.of(self.start);
        let start = gather::<S, L>(lanes, |k| *starts.item(k));
        let mut bodies = self.motion(lanes, at);
        let half = Real::all(lanes, 0.5);
        let d = <S::Vectors<f32> as Several<f32>>::LEN;
        for k in 0..d {
            bodies.velocity[k] = half * (start[k] + bodies.velocity[k]);
        }
        for k in 0..<S::Spins<f32> as Several<f32>>::LEN {
            bodies.spin[k] = half * (start[d + k] + bodies.spin[k]);
        }
        bodies
    }

    /// Velocities and inverse masses of eight bodies.
    #[inline(always)]
    pub fn motion<L: Lanes>(&self, lanes: L, at: &Places<'_>) -> Eightfold<S, L> {
        let bodies = at.of(self.bodies.list());
        let motion = gather::<S, L>(lanes, |k| bodies.item(k).get().motion);
        let (d, a) = (<S::Vectors<f32> as Several<f32>>::LEN, <S::Spins<f32> as Several<f32>>::LEN);
        let mut velocity = S::Vectors::all(motion[0]);
        let mut spin = S::Spins::all(motion[0]);
        for k in 0..d {
            velocity[k] = motion[k];
        }
        for k in 0..a {
            spin[k] = motion[d + k];
        }
        Eightfold { velocity, spin, inverse_mass: motion[d + a] }
    }

    /// How eight bodies moved since the step began.
    #[inline(always)]
    pub fn moved<L: Lanes>(&self, lanes: L, at: &Places<'_>) -> Moved<S, L> {
        let bodies = at.of(self.bodies.list());
        let moved = gather::<S, L>(lanes, |k| bodies.item(k).get().moved);
        let d = <S::Vectors<f32> as Several<f32>>::LEN;
        let mut by = S::Vectors::all(moved[0]);
        let mut turn = S::Turns::all(moved[0]);
        for k in 0..d {
            by[k] = moved[k];
        }
        for k in 0..<S::Turns<f32> as Several<f32>>::LEN {
            turn[k] = moved[d + k];
        }
        Moved { by, turn }
    }

    /// Inverse inertias of eight bodies, whose pack keeps this of them. Asked for where they are used: what waits for its use does so
    /// in memory.
    #[inline(always)]
    fn inertia<L: Lanes>(&self, lanes: L, at: &Places<'_>, kept: &S::Kept<Eight>) -> S::Inertias<Real<L>> {
        let mut inertia = S::Inertias::all(Real::all(lanes, 0.0));
        if <S::Kept<f32> as Several<f32>>::LEN < <S::Inertias<f32> as Several<f32>>::LEN {
            let inertias = at.of(self.inertia);
            let numbers = gather::<S, L>(lanes, |k| *inertias.item(k));
            for k in 0..<S::Inertias<f32> as Several<f32>>::LEN {
                inertia[k] = numbers[k];
            }
        } else {
            for k in 0..<S::Kept<f32> as Several<f32>>::LEN {
                inertia[k] = Real::load(lanes, &kept[k]);
            }
        }
        inertia
    }

    /// Those of bodies a and of bodies b.
    #[inline(always)]
    pub fn inertias<L: Lanes>(
        &self,
        lanes: L,
        at: &[Places<'_>; 2],
        kept: &[S::Kept<Eight>; 2],
    ) -> [S::Inertias<Real<L>>; 2] {
        [self.inertia(lanes, &at[0], &kept[0]), self.inertia(lanes, &at[1], &kept[1])]
    }

    /// What packs keep of eight bodies' inverse inertias, so that a sweep gathers only what changes.
    #[inline(always)]
    pub fn kept<L: Lanes>(&self, lanes: L, at: &Places<'_>) -> S::Kept<Eight> {
        let mut kept = S::Kept::all(Eight::default());
        if <S::Kept<f32> as Several<f32>>::LEN > 0 {
            let inertias = at.of(self.inertia);
            let rows = gather::<S, L>(lanes, |k| *inertias.item(k));
            for k in 0..<S::Kept<f32> as Several<f32>>::LEN {
                kept[k] = rows[k].store();
            }
        }
        kept
    }

    /// Writes velocities back. Not those of obstacles, which impulses do not change and packs of a colour share.
    #[inline(always)]
    pub fn scatter<L: Lanes>(&self, at: &Places<'_>, bodies: &Eightfold<S, L>) {
        let (d, a) = (<S::Vectors<f32> as Several<f32>>::LEN, <S::Spins<f32> as Several<f32>>::LEN);
        let mut numbers = Columns::<S, L>::all(bodies.inverse_mass);
        for k in 0..d {
            numbers[k] = bodies.velocity[k];
        }
        for k in 0..a {
            numbers[d + k] = bodies.spin[k];
        }
        let rows = S::Record::rows(numbers);
        let places = at.of(self.bodies.list());
        for (k, motion) in rows.into_iter().enumerate() {
            if !places.is_before(k, self.obstacles) {
                let own = places.item(k);
                own.set(Body { motion, ..own.get() });
            }
        }
    }

    /// Velocities of some records after a substep's loads. From the second substep on also after its warm start: arms and inertias
    /// stand still in a step, so what all contacts gave a body in the substep before is v - v_before - load.
    #[inline(always)]
    pub fn accelerate<L: Lanes>(&self, lanes: L, records: Range<usize>, substep: usize) {
        let (none, is_velocity) = (Real::all(lanes, 0.0), Real::load(lanes, const { &of_velocities::<S>() }));
        let bodies = self.bodies.row(records.clone());
        // what lies beside the velocities stays
        if substep == 0 {
            // before the first substep `before` is the velocity without the warm start
            for (own, load) in bodies.iter().zip(&self.load[records]) {
                let body = own.get();
                let v = Real::load(lanes, &body.motion.eight());
                let loaded = v + Real::load(lanes, &load.eight());
                let motion = S::Record::of(none.if_less(is_velocity, loaded, v).store());
                own.set(Body { motion, ..body });
            }
            return;
        }
        for (own, before) in bodies.iter().zip(self.before.row(records)) {
            let body = own.get();
            let v = Real::load(lanes, &body.motion.eight());
            let faster = v + (v - Real::load(lanes, &before.get().eight()));
            let motion = S::Record::of(none.if_less(is_velocity, faster, v).store());
            own.set(Body { motion, ..body });
            before.set(body.motion);
        }
    }

    /// A body's motion, and what leads it on: its motion before the last sweep, and the direction.
    #[inline(always)]
    pub fn led(&self, i: usize) -> (Eight, [Eight; 2]) {
        (self.bodies.get(i).motion.eight(), [self.led[0].get(i), self.led[1].get(i)])
    }

    /// Replaces a body's velocities, not what lies beside them, and what leads it on.
    #[inline(always)]
    pub fn lead<L: Lanes>(&self, lanes: L, i: usize, now: Eight, [before, direction]: [Eight; 2]) {
        let (none, is_velocity) = (Real::all(lanes, 0.0), Real::load(lanes, const { &of_velocities::<S>() }));
        let body = self.bodies.get(i);
        let (old, new) = (Real::load(lanes, &body.motion.eight()), Real::load(lanes, &now));
        let motion = S::Record::of(none.if_less(is_velocity, new, old).store());
        self.bodies.set(i, Body { motion, ..body });
        self.led[0].set(i, before);
        self.led[1].set(i, direction);
    }

    /// Poses of some records after a substep of length `h` \[s\], eight at a time.
    #[inline(always)]
    pub fn move_on<L: Lanes>(&self, lanes: L, records: Range<usize>, h: f32) {
        let (d, h) = (<S::Vectors<f32> as Several<f32>>::LEN, Real::all(lanes, h));
        for bodies in self.bodies.row(records).chunks(WIDTH) {
            let (mut motion, mut moved) = ([S::Record::default(); WIDTH], [S::Record::default(); WIDTH]);
            for k in 0..WIDTH {
                // where fewer are left the last one fills the other lanes
                let body = bodies[k.min(bodies.len() - 1)].get();
                (motion[k], moved[k]) = (body.motion, body.moved);
            }
            let motion = S::Record::columns(lanes, motion);
            let mut numbers = S::Record::columns(lanes, moved);
            let (mut turn, mut angle) = (S::Turns::all(h), S::Spins::all(h));
            for k in 0..<S::Turns<f32> as Several<f32>>::LEN {
                turn[k] = numbers[d + k];
            }
            for k in 0..<S::Spins<f32> as Several<f32>>::LEN {
                angle[k] = h * motion[d + k];
            }
            let turn = S::turned_by(&turn, &angle);
            for k in 0..d {
                numbers[k] += h * motion[k];
            }
            for k in 0..<S::Turns<f32> as Several<f32>>::LEN {
                numbers[d + k] = turn[k];
            }
            for (own, moved) in bodies.iter().zip(S::Record::rows(numbers)) {
                own.set(Body { moved, ..own.get() });
            }
        }
    }
}

impl<S: Wide> Records<S> {
    /// Velocity and spin of a record.
    pub fn motion_of(&self, record: u32) -> (S::Vectors<f32>, S::Spins<f32>) {
        let numbers = self.bodies[record as usize].motion.eight().0;
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
        let (motion, load) = (self.bodies[record].motion.eight().0, self.load[record].eight().0);
        let mut before = self.start[record].eight().0;
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
        let numbers = self.bodies[record as usize].moved.eight().0;
        let (mut by, mut turn) = (S::Vectors::all(0.0), S::no_turn());
        let d = by.slice().len();
        by.slice_mut().copy_from_slice(&numbers[..d]);
        let n = turn.slice().len();
        turn.slice_mut().copy_from_slice(&numbers[d..d + n]);
        (by, turn)
    }
}
