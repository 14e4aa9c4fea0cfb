//! The loop over substeps: loads and warm start, springs, poses, relaxing; then restitution. Long because a third of it are tests
//! that hold the bits of the whole loop, in all registers, on any number of workers, in groups of any size.

use super::bodies::{Records, SoftBody, Table};
use super::books::book;
use super::colours::Colours;
use super::groups::Groups;
use super::lead::{Beta, Led, begin, lead, lead_bodies};
use super::pack::{Beside, Pack};
use super::patch::{EightPatches, Last, Patch, PatchResult, Patches};
use super::plan::{self, Plan, Share, Task};
use super::prepare::{approach, prepare};
use super::restitution::{bounce, compress};
use super::shared::Joined;
use super::sweep::{Spring, Sweep, sweep};
use carom_math::lanes::{Eight, Job, Lanes, WIDTH, dispatch};
use carom_math::workers::Turns;
use carom_math::{Planar, Spatial, Wide, Workers};
use std::any::Any;
use std::ops::Range;
use std::sync::{Mutex, PoisonError};

/// Choices of the soft solver.
#[derive(Clone, Copy, Debug)]
pub struct SoftChoice {
    /// Substeps.
    pub substeps: usize,
    /// Length of a substep \[s\].
    pub h: f32,
    /// Frequency of contacts between bodies that move \[Hz\]; of those with obstacles twice as high.
    pub hertz: f32,
    /// Damping ratio of contacts \[1\].
    pub damping_ratio: f32,
    /// Overlaps are not pushed apart faster than this \[m/s\].
    pub push_speed: f32,
    /// Approaches slower than this do not bounce \[m/s\].
    pub rest_speed: f32,
    /// Rigid contacts in place of springs.
    pub rigid: Option<Rigid>,
}

/// How rigid contacts are swept.
#[derive(Clone, Copy, Debug)]
pub struct Rigid {
    /// Sweeps of a substep before the bodies move, and as many after; at least 1.
    pub sweeps: usize,
    /// Conjugate directions lead from one to the next.
    pub accelerated: bool,
    /// Share of an overlap that a substep pushes apart \[1\].
    pub push: f32,
    /// Overlap that is left alone \[m\].
    pub slop: f32,
}

/// Packs, records and colours; memory that lasts from step to step, and nothing that an answer depends on.
pub struct SoftSolver<S: Wide> {
    records: Records<S>,
    groups: Groups,
    colours: Colours,
    /// Packs of groups that workers share; each worker has room for those of the group that it takes through a step.
    packs: Vec<Pack<S>>,
    rooms: Vec<Mutex<Vec<Pack<S>>>>,
    /// Whom each pack joins.
    joined: Joined,
    beside: Vec<Beside<S>>,
    /// What each pack's patches gave in the last substep.
    last: Vec<[Eight; WIDTH]>,
    /// What leads each pack on; none where nothing leads.
    led: Vec<Led<S>>,
    /// Each pack's patches, as places in the colours' order.
    members: Vec<Range<usize>>,
    /// Packs and records of each group.
    shares: Vec<Share>,
    plan: Plan,
    /// The patches while a step lasts.
    patches: Patches<S>,
    /// Those of each pack side by side, where they are laid so; nothing else.
    columns: Vec<EightPatches<S>>,
    /// Records before this one are obstacles.
    obstacles: u32,
    /// Pack and lane of each patch.
    places: Vec<(u32, u8)>,
}

impl<S: Wide> Default for SoftSolver<S> {
    fn default() -> Self {
        SoftSolver {
            records: Records::default(),
            groups: Groups::default(),
            colours: Colours::default(),
            packs: Vec::new(),
            rooms: Vec::new(),
            joined: Joined::default(),
            beside: Vec::new(),
            last: Vec::new(),
            led: Vec::new(),
            members: Vec::new(),
            shares: Vec::new(),
            plan: Plan::default(),
            patches: Patches::default(),
            columns: Vec::new(),
            obstacles: 1,
            places: Vec::new(),
        }
    }
}

/// What a step came to.
#[derive(Clone, Copy, Debug, Default)]
pub struct Told {
    /// Work of normal impulses \[J\].
    pub pressing_work: f64,
    /// Work of friction \[J\].
    pub rubbing_work: f64,
    /// Largest velocity that the last sweep still changed at a point or by friction \[m/s\].
    pub changed: f64,
    /// Records of the patch that it changed most.
    pub worst: Option<(u32, u32)>,
}

/// Packs of a chunk, unless it is a whole group, whose packs are in its worker's room; what is beside them, what they gave last, what
/// leads them on, the place of the first, how many have obstacles in them, and whether some resist rolling.
struct Chunk<'a, S: Wide> {
    first: usize,
    with_obstacles: usize,
    resists: bool,
    packs: &'a mut [Pack<S>],
    besides: &'a mut [Beside<S>],
    lasts: &'a mut [[Eight; WIDTH]],
    led: &'a mut [Led<S>],
}

/// A step while workers share it.
struct Steps<'a, S: Wide> {
    table: Table<'a, S>,
    chunks: Vec<Mutex<Chunk<'a, S>>>,
    rooms: &'a [Mutex<Vec<Pack<S>>>],
    joined: &'a Joined,
    plan: &'a Plan,
    members: &'a [Range<usize>],
    order: &'a [u32],
    patches: &'a Patches<S>,
    /// None where patches are laid one by one.
    columns: Option<&'a [EightPatches<S>]>,
    choice: SoftChoice,
    beta: Beta,
}

/// A worker's part of it.
struct Part<'a, 'b, S: Wide>(&'a Steps<'b, S>, Turns<'a>);

impl<S: Wide> Job for Part<'_, '_, S> {
    type Output = ();
    #[inline(always)]
    fn work<L: Lanes>(self, lanes: L) {
        self.0.run(lanes, self.1);
    }
}

#[inline(never)]
fn steps_in_the_plane(solver: &mut SoftSolver<Planar>, choice: &SoftChoice, workers: &Workers) {
    solver.share(choice, workers, |part| dispatch(part));
}

#[inline(never)]
fn steps_in_space(solver: &mut SoftSolver<Spatial>, choice: &SoftChoice, workers: &Workers) {
    solver.share(choice, workers, |part| dispatch(part));
}

impl<S: Wide> SoftSolver<S> {
    /// Forgets bodies, for as many as patches between these join: records, the obstacle at rest among them, in the order that bodies
    /// come in, of which the first are obstacles. Tells the record that each of them takes instead, and writes it into the pairs;
    /// nothing where all keep theirs.
    pub fn begin(
        &mut self,
        pairs: &mut [(u32, u32)],
        (records, obstacles): (usize, u32),
        choice: &SoftChoice,
    ) -> &[u32] {
        let led = choice.rigid.is_some_and(|rigid| rigid.accelerated);
        self.groups.find(pairs, records, obstacles == 1 && !led)
    }

    /// Takes in so many bodies; the first has record 1, for 0 is the obstacle at rest. `body` tells of each by its record.
    pub fn fill(&mut self, count: usize, body: impl Fn(usize) -> SoftBody<S> + Sync, workers: &Workers) {
        self.records.fill(count, body, workers);
    }

    /// Takes all substeps with these patches; records before `obstacles` are those of obstacles. Where patches are laid in columns,
    /// pack by pack as [`SoftSolver::packs`] has them, whom they join, by their records, is what it was in the last step, and the
    /// list says what few of them need.
    pub fn advance(
        &mut self,
        (patches, mut columns): (&mut Patches<S>, Option<&mut Vec<EightPatches<S>>>),
        obstacles: u32,
        choice: &SoftChoice,
        workers: &Workers,
    ) {
        std::mem::swap(&mut self.patches, patches);
        self.columns = columns.as_mut().map(|columns| std::mem::take(*columns)).unwrap_or_default();
        self.sort(obstacles, choice, workers);
        // found by type, so that the lanes of both spaces are compiled here, once, and not in every program above
        let either: &mut dyn Any = self;
        if let Some(planar) = either.downcast_mut() {
            steps_in_the_plane(planar, choice, workers);
        } else if let Some(spatial) = either.downcast_mut() {
            steps_in_space(spatial, choice, workers);
        }
        std::mem::swap(&mut self.patches, patches);
        columns.into_iter().for_each(|columns| *columns = std::mem::take(&mut self.columns));
    }

    /// Patches of each pack of the last step, as places in their list, lane by lane.
    pub fn packs(&self) -> impl ExactSizeIterator<Item = &[u32]> {
        self.members.iter().map(|members| &self.colours.order[members.clone()])
    }

    /// Pack and lane of a patch of the last step.
    #[inline]
    pub fn place(&self, patch: usize) -> (usize, usize) {
        (self.places[patch].0 as usize, usize::from(self.places[patch].1))
    }

    /// Sorts patches into packs by group and colour, and plans the step.
    fn sort(&mut self, obstacles: u32, choice: &SoftChoice, workers: &Workers) {
        self.obstacles = obstacles;
        if self.colours.paint(&self.groups, &self.patches.pairs, obstacles) {
            debug_assert!(self.colours.are_apart(), "workers would share a body");
            self.put_side_by_side();
        }
        let (pack, beside) = Pack::empty();
        self.beside.resize(self.members.len(), beside);
        self.last.resize(self.members.len(), Default::default());
        let bounces = self.patches.rare.iter().any(|rare| rare.restitution > 0.0);
        self.plan.make((&self.colours, &self.shares), (bounces, choice), workers);
        let shared = self.plan.chunks.iter().filter(|chunk| !chunk.whole).map(|chunk| chunk.packs.len());
        self.packs.resize(shared.sum(), pack);
        self.rooms.resize_with(workers.count(), Mutex::default);
        let leads = choice.rigid.is_some_and(|rigid| rigid.accelerated);
        self.led.resize(if leads { self.members.len() } else { 0 }, Led::none());
        self.records.make_room_to_lead(leads);
    }

    /// Eight patches of a colour to a pack.
    fn put_side_by_side(&mut self) {
        self.members.clear();
        self.joined.clear();
        self.shares.clear();
        self.places.clear();
        self.places.resize(self.patches.len(), (0, 0));
        for (lists, records) in self.colours.groups.iter().zip(self.groups.records()) {
            let first = self.members.len();
            let mut with_obstacles = first;
            for list in lists.all.clone() {
                let ends = &self.colours.starts[list..list + 2];
                for first in (ends[0]..ends[1]).step_by(WIDTH) {
                    let eight = first..ends[1].min(first + WIDTH);
                    let mut ids = [[0; WIDTH]; 2];
                    for (lane, &k) in self.colours.order[eight.clone()].iter().enumerate() {
                        self.places[k as usize] = (self.members.len() as u32, lane as u8);
                        (ids[0][lane], ids[1][lane]) = self.patches.pairs[k as usize];
                    }
                    self.joined.push(ids);
                    self.members.push(eight);
                }
                if list < lists.with_obstacles {
                    with_obstacles = self.members.len();
                }
            }
            self.shares.push(Share { packs: first..self.members.len(), with_obstacles, records });
        }
    }

    /// Shares the stages of a step among workers.
    fn share(&mut self, choice: &SoftChoice, workers: &Workers, take: impl Fn(Part<'_, '_, S>) + Sync) {
        let (mut packs, mut besides) = (self.packs.as_mut_slice(), self.beside.as_mut_slice());
        let (mut lasts, mut leds) = (self.last.as_mut_slice(), self.led.as_mut_slice());
        let mut chunks = Vec::with_capacity(self.plan.chunks.len());
        for plan::Chunk { packs: range, with_obstacles, whole } in &self.plan.chunks {
            let (these, beside, last, led);
            (these, packs) = packs.split_at_mut(if *whole { 0 } else { range.len() });
            (beside, besides) = besides.split_at_mut(range.len());
            (last, lasts) = lasts.split_at_mut(range.len());
            (led, leds) = leds.split_at_mut(range.len().min(leds.len()));
            let (first, with_obstacles) = (range.start, *with_obstacles);
            let resists = false;
            let chunk =
                Chunk { first, with_obstacles, resists, packs: these, besides: beside, lasts: last, led };
            chunks.push(Mutex::new(chunk));
        }
        let steps = Steps {
            table: self.records.table(self.obstacles),
            chunks,
            rooms: &self.rooms,
            joined: &self.joined,
            plan: &self.plan,
            members: &self.members,
            order: &self.colours.order,
            patches: &self.patches,
            columns: (!self.columns.is_empty()).then_some(&self.columns),
            choice: *choice,
            beta: Beta::default(),
        };
        workers.stages(&self.plan.counts, |turns| take(Part(&steps, turns)));
    }

    /// What the last step came to.
    pub fn told(&self) -> Told {
        let mut told = Told::default();
        let sum = |eight: &Eight| eight.0.iter().map(|x| f64::from(*x)).sum::<f64>();
        let mut worst = None;
        for (place, beside) in self.beside.iter().enumerate() {
            told.pressing_work += sum(&beside.pressing_work);
            told.rubbing_work += sum(&beside.rubbing_work);
            for (lane, changed) in beside.changed.0.iter().enumerate() {
                if f64::from(*changed) > told.changed {
                    told.changed = f64::from(*changed);
                    worst = Some(self.joined.lane(place, lane));
                }
            }
        }
        told.worst = worst;
        told
    }

    /// What a patch gave in the step, by its place in the list.
    pub fn result(&self, patch: usize) -> PatchResult<S> {
        let (pack, lane) = self.place(patch);
        self.beside[pack].told(lane)
    }

    /// What it gave in the last substep.
    #[inline]
    pub fn last(&self, patch: usize) -> Last<S> {
        let (pack, lane) = self.place(patch);
        self.beside[pack].last(&self.last[pack][lane], lane)
    }

    /// Velocity and spin of a record at the step's end.
    pub fn motion(&self, record: u32) -> (S::Vectors<f32>, S::Spins<f32>) {
        self.records.motion_of(record)
    }

    /// Whether nothing touched a record in a step of so many substeps: loads alone give its velocities.
    pub fn flew(&self, record: u32, substeps: usize) -> bool {
        self.records.flew(record, substeps)
    }

    /// Displacement and change of attitude of a record over the step.
    pub fn moved(&self, record: u32) -> (S::Vectors<f32>, S::Turns<f32>) {
        self.records.moved_of(record)
    }
}

impl<S: Wide> Steps<'_, S> {
    /// Takes a worker's turns.
    #[inline(always)]
    fn run<L: Lanes>(&self, lanes: L, turns: Turns<'_>) {
        let SoftChoice { hertz, damping_ratio, h, push_speed, rest_speed, .. } = self.choice;
        let [spring, stiffer] = match self.choice.rigid {
            Some(rigid) => [Spring::rigid(h, push_speed, (rigid.push, rigid.slop)); 2],
            None => [hertz, 2.0 * hertz].map(|hertz| Spring::new(hertz, damping_ratio, h, push_speed)),
        };
        let rigid = spring.relaxing();
        let table = &self.table;
        let mut room = self.rooms[turns.seat()].lock().unwrap_or_else(PoisonError::into_inner);
        for (stage, turn) in turns {
            let (tasks, chunk, records) = self.plan.turn(stage, turn);
            for task in tasks {
                match task {
                    Task::Accelerate(substep) => {
                        table.accelerate(lanes, records.clone(), *substep);
                        continue;
                    }
                    Task::MoveOn => {
                        table.move_on(lanes, records.clone(), h);
                        continue;
                    }
                    Task::LeadBodies | Task::BeginToLeadBodies => {
                        let begins = matches!(task, Task::BeginToLeadBodies);
                        lead_bodies(lanes, table, records.clone(), (self.beta.get(), begins));
                        continue;
                    }
                    Task::Weigh => {
                        self.weigh();
                        continue;
                    }
                    _ => {}
                }
                let mut chunk = self.chunks[chunk].lock().unwrap_or_else(PoisonError::into_inner);
                let Chunk { first, with_obstacles, resists, packs, besides, lasts, led } = &mut *chunk;
                let packs = if packs.is_empty() { in_room(&mut room, besides.len()) } else { packs };
                if matches!(task, Task::Pack) {
                    self.pack(lanes, *first, packs.iter_mut().zip(besides.iter_mut()));
                    *resists = besides.iter().any(|beside| beside.resists);
                    continue;
                }
                let packs = packs.iter_mut().zip(besides.iter_mut()).zip(self.joined.behind(*first));
                // loops and no closures: a closure that is not inlined has no registers
                match *task {
                    Task::Accelerate(_)
                    | Task::MoveOn
                    | Task::Weigh
                    | Task::LeadBodies
                    | Task::BeginToLeadBodies
                    | Task::Pack => {}
                    Task::Approach => {
                        for ((pack, beside), at) in packs.filter(|((_, b), _)| b.bounces) {
                            approach(lanes, (pack, beside), at, table);
                        }
                    }
                    Task::Prepare => {
                        for (own, at) in packs {
                            prepare(lanes, own, at, table);
                        }
                    }
                    Task::Sweep(Sweep::Springs, led) => {
                        for (k, (own, at)) in packs.enumerate() {
                            let spring = if k < *with_obstacles { &stiffer } else { &spring };
                            sweep::<S, L, true>(
                                lanes,
                                own,
                                at,
                                table,
                                spring,
                                (Sweep::Springs, led, *resists),
                            );
                        }
                    }
                    Task::Sweep(kind, led) => {
                        for (own, at) in packs {
                            sweep::<S, L, false>(lanes, own, at, table, &rigid, (kind, led, *resists));
                        }
                    }
                    Task::BeginToLead => {
                        self.beta.forget();
                        for (((pack, beside), _), led) in packs.zip(led.iter_mut()) {
                            begin(pack, beside, led);
                        }
                    }
                    Task::Lead => {
                        let beta = self.beta.get();
                        for (((pack, beside), _), led) in packs.zip(led.iter_mut()) {
                            lead(lanes, pack, beside, led, beta);
                        }
                    }
                    Task::Compress => {
                        for ((pack, beside), at) in packs.filter(|((_, b), _)| b.bounces) {
                            compress(lanes, (pack, beside), at, table);
                        }
                    }
                    Task::Bounce => {
                        for ((pack, beside), at) in packs.filter(|((_, b), _)| b.bounces) {
                            bounce(lanes, (pack, beside), at, table, rest_speed);
                        }
                    }
                    Task::Book => {
                        for (((pack, beside), at), last) in packs.zip(lasts.iter_mut()) {
                            book(lanes, (pack, beside), at, table);
                            *last = pack.last(lanes);
                        }
                    }
                }
            }
        }
    }

    /// Takes in what the last sweep changed: pack after pack, whoever swept it.
    fn weigh(&self) {
        let mut length = 0.0;
        for chunk in &self.chunks {
            let chunk = chunk.lock().unwrap_or_else(PoisonError::into_inner);
            let lengths = chunk.besides.iter().flat_map(|beside| beside.length.0);
            lengths.for_each(|own| length += f64::from(own));
        }
        self.beta.weigh(length);
    }

    /// Fills packs, the first of which is this one, with their patches.
    #[inline(always)]
    fn pack<'p, L: Lanes>(
        &self,
        lanes: L,
        first: usize,
        packs: impl Iterator<Item = (&'p mut Pack<S>, &'p mut Beside<S>)>,
    ) {
        let (_, nothing) = Pack::empty();
        let (none, mut room) = (Patch::none(), EightPatches::default());
        let Patches { all, rare, .. } = self.patches;
        for ((place, (pack, beside)), members) in (first..).zip(packs).zip(&self.members[first..]) {
            if beside.bounces || beside.resists {
                *beside = nothing;
            }
            let members = &self.order[members.clone()];
            if let Some(columns) = self.columns {
                pack.fill(beside, &columns[place]);
            } else {
                let mut eight = [&none; WIDTH];
                for (lane, &k) in members.iter().enumerate().take(WIDTH) {
                    eight[lane] = &all[k as usize];
                }
                room.join(lanes, eight);
                pack.fill(beside, &room);
            }
            if !rare.is_empty() {
                members.iter().enumerate().for_each(|(lane, &k)| beside.put(lane, &rare[k as usize]));
            }
        }
    }
}

/// A worker's room for so many packs.
fn in_room<S: Wide>(room: &mut Vec<Pack<S>>, count: usize) -> &mut [Pack<S>] {
    if room.len() < count {
        room.resize(count, Pack::empty().0);
    }
    &mut room[..count]
}

#[cfg(test)]
mod tests {
    use super::super::patch::{Numbers, Rare};
    use super::super::prepare::Frame;
    use super::super::sweep::gaps;
    use super::*;
    use carom_math::lanes::{Portable, in_fours};
    use carom_math::{Record, Several};

    /// What a step is taken in.
    #[derive(Clone, Copy)]
    enum Registers {
        None,
        OfFour,
        Widest,
    }

    /// Numbers in -1 to 1 that look random.
    struct Dice(u32);

    impl Dice {
        fn roll(&mut self) -> f32 {
            self.0 = self.0.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (self.0 >> 8) as f32 / (1u32 << 23) as f32 - 1.0
        }
        fn fill<A: Several<f32>>(&mut self, scale: f32) -> A {
            let mut out = A::all(0.0);
            for x in out.slice_mut() {
                *x = scale * self.roll();
            }
            out
        }
    }

    fn chain<S: Wide>(dice: &mut Dice, bodies: u32) -> SoftSolver<S> {
        let mut solver = SoftSolver::default();
        let mut all = Vec::new();
        for k in 0..bodies {
            let mut inverse_inertia = S::Inertias::all(0.0);
            for (k, x) in inverse_inertia.slice_mut().iter_mut().enumerate() {
                *x = if k < 3 { 6.0 + dice.roll() } else { 0.3 * dice.roll() };
            }
            // the first is an obstacle that moves
            all.push(SoftBody {
                velocity: dice.fill(1.0),
                spin: dice.fill(1.0),
                load: dice.fill(0.04),
                spin_load: dice.fill(0.01),
                inverse_mass: if k > 0 { 1.0 + 0.5 * dice.roll() } else { 0.0 },
                inverse_inertia: if k > 0 { inverse_inertia } else { S::Inertias::all(0.0) },
            });
            let record = k + 1;
            if k == 0 {
                continue;
            }
            let mut normal: S::Vectors<f32> = dice.fill(1.0);
            let length = normal.slice().iter().map(|x| x * x).sum::<f32>().sqrt();
            for x in normal.slice_mut() {
                *x /= length;
            }
            let (arm_a, arm_b) = (dice.fill(0.5), dice.fill(0.5));
            let patch = solver.patches.add();
            patch.set_place(normal, arm_a, arm_b);
            let count = 1 + k as usize % S::Points::<f32>::LEN;
            for i in 0..count {
                patch.set_point(i, dice.fill(0.5), 0.01 * dice.roll());
                patch.press(i, 0.05 * dice.roll().abs());
            }
            patch.set_friction(dice.roll().abs(), 0.2 * dice.roll().abs());
            let rubbing: S::Spins<f32> = dice.fill(0.01);
            for (k, impulse) in rubbing.slice().iter().enumerate() {
                patch.rub(k, *impulse);
            }
            let rare = Rare {
                restitution: if k % 5 == 0 { 0.5 } else { 0.0 },
                rolling: if k % 4 == 0 { 0.01 } else { 0.0 },
                ..Rare::none()
            };
            solver.patches.set_rare(rare);
            let b = if k % 10 == 0 { 1 } else { record.saturating_sub(1 + k % 3) };
            solver.patches.pairs.push((record, b));
        }
        solver.fill(all.len(), |record| all[record - 1], &Workers::new(2).unwrap());
        solver.groups.make_one(solver.records.bodies.len());
        solver
    }

    /// Many columns of five bodies each on the obstacle at rest, in groups of some of them or all together; the place of each record.
    fn columns<S: Wide>(bodies: u32, choice: &SoftChoice, size: usize) -> (SoftSolver<S>, Vec<u32>) {
        let mut solver = chain::<S>(&mut Dice(11), bodies);
        for (a, b) in &mut solver.patches.pairs {
            // of every column the bodies are far from each other
            let below = a.saturating_sub(bodies / 5);
            *b = below;
        }
        let mut pairs = std::mem::take(&mut solver.patches.pairs);
        let given = std::mem::take(&mut solver.records);
        solver.groups = Groups::of_size(size, size.saturating_mul(4).min(2400));
        let places = solver.begin(&mut pairs, (given.bodies.len(), 1), choice).to_vec();
        let mut order: Vec<u32> = (0..given.bodies.len() as u32).collect();
        order.sort_by_key(|record| places.get(*record as usize).copied().unwrap_or(*record));
        solver.records = given.in_order(&order);
        solver.patches.pairs = pairs;
        (solver, places)
    }

    fn groups_change_no_bit<S: Wide>() {
        let choice = choice(None);
        let run = |size: usize, threads: usize| {
            let workers = Workers::new(threads).unwrap();
            let (mut solver, places) = columns::<S>(3000, &choice, size);
            solver.sort(1, &choice, &workers);
            solver.share(&choice, &workers, |part| dispatch(part));
            let place = |record: u32| places.get(record as usize).copied().unwrap_or(record);
            let bits = |record: u32| {
                let (v, w) = solver.motion(place(record));
                let (by, turn) = solver.moved(place(record));
                let all = [v.slice(), w.slice(), by.slice(), turn.slice()].concat();
                all.into_iter().map(f32::to_bits).collect::<Vec<_>>()
            };
            let all: Vec<_> = (0..=3000).map(bits).collect();
            (all, solver.shares.len())
        };
        let (one, groups) = run(usize::MAX / 8, 1);
        assert_eq!(groups, 1);
        for (size, threads) in [(8, 1), (40, 3), (600, 1), (1200, 2)] {
            let (all, groups) = run(size, threads);
            assert!(groups > 1, "{groups} groups");
            assert!(all == one, "in groups of {size}, on {threads} threads");
        }
    }

    #[test]
    fn groups_change_no_bit_in_the_plane() {
        groups_change_no_bit::<Planar>();
    }

    #[test]
    fn groups_change_no_bit_in_space() {
        groups_change_no_bit::<Spatial>();
    }

    fn bits<S: Wide>(solver: &SoftSolver<S>) -> Vec<u32> {
        let records = solver.records.bodies.iter().flat_map(|body| [body.motion, body.moved]);
        let works = solver.beside.iter().flat_map(|b| [&b.pressing_work, &b.rubbing_work, &b.changed]);
        records.map(|r| r.eight()).chain(works.copied()).flat_map(|r| r.0.map(f32::to_bits)).collect()
    }

    fn every_processor_and_number_of_workers_agrees<S: Wide>() {
        for accelerated in [false, true] {
            they_agree::<S>(Some(Rigid { sweeps: 5, accelerated, push: 0.2, slop: 1e-3 }));
        }
        they_agree::<S>(None);
    }

    fn choice(rigid: Option<Rigid>) -> SoftChoice {
        SoftChoice {
            substeps: 4,
            h: 1.0 / 240.0,
            hertz: 30.0,
            damping_ratio: 10.0,
            push_speed: 3.0,
            rest_speed: 0.1,
            rigid,
        }
    }

    fn they_agree<S: Wide>(rigid: Option<Rigid>) {
        let choice = choice(rigid);
        let run = |registers: Registers, bodies: u32, threads: usize| {
            let workers = Workers::new(threads).unwrap();
            let mut solver = chain::<S>(&mut Dice(7), bodies);
            solver.sort(2, &choice, &workers);
            match registers {
                Registers::None => solver.share(&choice, &workers, |part| Portable.run(part)),
                Registers::OfFour => solver.share(&choice, &workers, |part| in_fours(part)),
                Registers::Widest => solver.share(&choice, &workers, |part| dispatch(part)),
            }
            solver
        };
        let one = run(Registers::None, 40, 1);
        for registers in [Registers::OfFour, Registers::Widest] {
            assert!(bits(&one) == bits(&run(registers, 40, 1)));
        }
        let alone = run(Registers::Widest, 3000, 1);
        assert!(alone.plan.chunks.len() == 1);
        for (threads, registers) in
            [(2, Registers::Widest), (3, Registers::OfFour), (8, Registers::None), (32, Registers::Widest)]
        {
            let shared = run(registers, 3000, threads);
            assert!(shared.plan.counts.iter().any(|n| *n > 4));
            assert!(bits(&shared) == bits(&alone), "{threads} workers");
        }
        assert!(one.told().changed > 0.0 && one.told().changed.is_finite());
        assert!(one.told().rubbing_work < 0.0);
    }

    /// Whether the gaps that springs of a next substep would find are those of the poses, in how many packs.
    struct Kept<'a, S: Wide>(&'a mut SoftSolver<S>);

    impl<S: Wide> Job for Kept<'_, S> {
        type Output = usize;
        #[inline(always)]
        fn work<L: Lanes>(self, lanes: L) -> usize {
            let SoftSolver { records, rooms, beside, joined, .. } = self.0;
            // one group is one chunk, in the room of the only worker
            let (table, packs) = (records.table(2), rooms[0].get_mut().unwrap());
            let mut fresh = 0;
            for ((pack, beside), at) in packs.iter().zip(beside.iter()).zip(joined.behind(0)) {
                let frame = Frame::of(lanes, pack);
                let moved = [table.moved(lanes, &at[0]), table.moved(lanes, &at[1])];
                let now = gaps(lanes, pack, &frame, moved);
                let same = |i: usize| now[i].store() == beside.gaps[i];
                assert!((0..S::Points::<f32>::LEN).all(same));
                let begun = |i: usize| pack.points[i].gap == beside.gaps[i];
                fresh += usize::from(!(0..S::Points::<f32>::LEN).all(begun));
            }
            fresh
        }
    }

    fn springs_find_the_gaps_of_the_poses<S: Wide>() {
        let (choice, workers) = (choice(None), Workers::new(1).unwrap());
        let mut solver = chain::<S>(&mut Dice(3), 40);
        solver.sort(2, &choice, &workers);
        solver.share(&choice, &workers, |part| dispatch(part));
        assert!(dispatch(Kept(&mut solver)) > 4, "bodies moved");
    }

    #[test]
    fn springs_find_the_gaps_of_the_poses_in_plane_and_space() {
        springs_find_the_gaps_of_the_poses::<Planar>();
        springs_find_the_gaps_of_the_poses::<Spatial>();
    }

    #[test]
    fn every_processor_and_number_of_workers_gives_the_same_bits_in_the_plane() {
        every_processor_and_number_of_workers_agrees::<Planar>();
    }

    #[test]
    fn every_processor_and_number_of_workers_gives_the_same_bits_in_space() {
        every_processor_and_number_of_workers_agrees::<Spatial>();
    }
}
