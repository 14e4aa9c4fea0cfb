//! The loop over substeps: loads and warm start, springs, poses, relaxing; then restitution.

use super::bodies::{Records, SoftBody};
use super::books::book;
use super::colours::Colours;
use super::pack::{Beside, Pack};
use super::patch::{Patch, PatchResult};
use super::prepare::{approach, prepare};
use super::sweep::{Spring, Sweep, bounce, sweep};
use carom_math::lanes::{Eight, Job, Lanes, WIDTH, dispatch};
use carom_math::{Planar, Several, Spatial, Wide};
use std::any::Any;

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
}

/// Packs, records and colours; memory that lasts from step to step, and nothing that an answer depends on.
pub struct SoftSolver<S: Wide> {
    records: Records<S>,
    colours: Colours,
    pairs: Vec<(u32, u32)>,
    packs: Vec<Pack<S>>,
    beside: Vec<Beside<S>>,
    /// Packs up to here have obstacles in them.
    with_obstacles: usize,
    /// Pack and lane of each patch.
    places: Vec<(u32, u8)>,
}

impl<S: Wide> Default for SoftSolver<S> {
    fn default() -> Self {
        SoftSolver {
            records: Records::default(),
            colours: Colours::default(),
            pairs: Vec::new(),
            packs: Vec::new(),
            beside: Vec::new(),
            with_obstacles: 0,
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

struct Steps<'a, S: Wide>(&'a mut SoftSolver<S>, SoftChoice);

impl<S: Wide> Job for Steps<'_, S> {
    type Output = ();
    #[inline(always)]
    fn work<L: Lanes>(self, lanes: L) {
        self.0.run(lanes, &self.1);
    }
}

#[inline(never)]
fn steps_in_the_plane(solver: &mut SoftSolver<Planar>, choice: &SoftChoice) {
    dispatch(Steps(solver, *choice));
}

#[inline(never)]
fn steps_in_space(solver: &mut SoftSolver<Spatial>, choice: &SoftChoice) {
    dispatch(Steps(solver, *choice));
}

impl<S: Wide> SoftSolver<S> {
    /// Forgets bodies and patches.
    pub fn begin(&mut self) {
        self.records.begin();
    }

    /// Adds a body and returns its record; 0 is the obstacle at rest.
    pub fn add(&mut self, body: &SoftBody<S>) -> u32 {
        self.records.push(body)
    }

    /// Takes all substeps with these patches; `fixed` tells which records are obstacles.
    pub fn advance(&mut self, patches: &[Patch<S>], fixed: impl Fn(u32) -> bool, choice: &SoftChoice) {
        self.pack(patches, fixed);
        // found by type, so that the lanes of both spaces are compiled here, once, and not in every program above
        let either: &mut dyn Any = self;
        if let Some(planar) = either.downcast_mut() {
            steps_in_the_plane(planar, choice);
        } else if let Some(spatial) = either.downcast_mut() {
            steps_in_space(spatial, choice);
        }
    }

    /// Sorts patches into packs by colour.
    fn pack(&mut self, patches: &[Patch<S>], fixed: impl Fn(u32) -> bool) {
        self.pairs.clear();
        self.pairs.extend(patches.iter().map(|p| (p.a, p.b)));
        self.colours.paint(self.records.motion.len(), &self.pairs, fixed);
        self.packs.clear();
        self.beside.clear();
        self.places.clear();
        self.places.resize(patches.len(), (0, 0));
        let (pack, beside) = Pack::empty();
        for (list, ends) in self.colours.starts.windows(2).enumerate() {
            if list == self.colours.with_obstacles {
                self.with_obstacles = self.packs.len();
            }
            for eight in self.colours.order[ends[0]..ends[1]].chunks(WIDTH) {
                let place = self.packs.len();
                self.packs.push(pack);
                self.beside.push(beside);
                for (lane, &k) in eight.iter().enumerate() {
                    self.packs[place].put(&mut self.beside[place], lane, &patches[k as usize]);
                    self.places[k as usize] = (place as u32, lane as u8);
                }
            }
        }
        if self.colours.with_obstacles + 1 == self.colours.starts.len() {
            self.with_obstacles = self.packs.len();
        }
    }

    #[inline(always)]
    fn run<L: Lanes>(&mut self, lanes: L, choice: &SoftChoice) {
        let spring = Spring::new(choice.hertz, choice.damping_ratio, choice.h, choice.push_speed);
        let stiffer = Spring::new(2.0 * choice.hertz, choice.damping_ratio, choice.h, choice.push_speed);
        let rigid = spring.relaxing();
        let SoftSolver { records, packs, beside, with_obstacles, .. } = self;
        for (pack, beside) in packs.iter().zip(&mut *beside).filter(|(_, b)| b.bounces) {
            approach(lanes, pack, beside, records);
        }
        for (pack, beside) in packs.iter_mut().zip(&mut *beside) {
            prepare(lanes, pack, beside, records);
        }
        for substep in 0..choice.substeps {
            records.accelerate(substep);
            for (k, (pack, beside)) in packs.iter_mut().zip(&mut *beside).enumerate() {
                let spring = if k < *with_obstacles { &stiffer } else { &spring };
                sweep(lanes, pack, beside, records, spring, Sweep::Springs);
            }
            records.move_on(choice.h);
            let last = substep + 1 == choice.substeps;
            let kind = if last { Sweep::Last } else { Sweep::Relaxing };
            for (pack, beside) in packs.iter_mut().zip(&mut *beside) {
                sweep(lanes, pack, beside, records, &rigid, kind);
            }
        }
        for (pack, beside) in packs.iter_mut().zip(&mut *beside).filter(|(_, b)| b.bounces) {
            bounce(lanes, pack, beside, records, choice.rest_speed);
        }
        for (pack, beside) in packs.iter().zip(&mut *beside) {
            book(lanes, pack, beside, records);
        }
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
                    worst = Some((self.packs[place].a[lane], self.packs[place].b[lane]));
                }
            }
        }
        told.worst = worst;
        told
    }

    /// What a patch gave in the step, by its place in the list.
    pub fn result(&self, patch: usize) -> PatchResult<S> {
        let (pack, lane) = self.places[patch];
        self.packs[pack as usize].told(&self.beside[pack as usize], lane as usize)
    }

    /// Velocity and spin of a record at the step's end.
    pub fn motion(&self, record: u32) -> (S::Vectors<f32>, S::Spins<f32>) {
        let numbers = &self.records.motion[record as usize].0;
        let (mut v, mut w) = (S::Vectors::all(0.0), S::Spins::all(0.0));
        let d = v.slice().len();
        v.slice_mut().copy_from_slice(&numbers[..d]);
        let a = w.slice().len();
        w.slice_mut().copy_from_slice(&numbers[d..d + a]);
        (v, w)
    }

    /// Displacement and change of attitude of a record over the step.
    pub fn moved(&self, record: u32) -> (S::Vectors<f32>, S::Turns<f32>) {
        let numbers = &self.records.moved[record as usize].0;
        let (mut by, mut turn) = (S::Vectors::all(0.0), S::no_turn());
        let d = by.slice().len();
        by.slice_mut().copy_from_slice(&numbers[..d]);
        let n = turn.slice().len();
        turn.slice_mut().copy_from_slice(&numbers[d..d + n]);
        (by, turn)
    }
}

#[cfg(test)]
mod tests {
    use super::super::patch::PatchPoint;
    use super::*;
    use carom_math::lanes::Portable;

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

    fn chain<S: Wide>(dice: &mut Dice) -> (SoftSolver<S>, Vec<Patch<S>>) {
        let mut solver = SoftSolver::default();
        solver.begin();
        let mut patches = Vec::new();
        for k in 0..40u32 {
            let mut inverse_inertia = S::Inertias::all(0.0);
            for (k, x) in inverse_inertia.slice_mut().iter_mut().enumerate() {
                *x = if k < 3 { 6.0 + dice.roll() } else { 0.3 * dice.roll() };
            }
            let body = SoftBody {
                velocity: dice.fill(1.0),
                spin: dice.fill(1.0),
                load: dice.fill(0.04),
                spin_load: dice.fill(0.01),
                inverse_mass: 1.0 + 0.5 * dice.roll(),
                inverse_inertia,
            };
            let record = solver.add(&body);
            let mut normal: S::Vectors<f32> = dice.fill(1.0);
            let length = normal.slice().iter().map(|x| x * x).sum::<f32>().sqrt();
            for x in normal.slice_mut() {
                *x /= length;
            }
            let mut points =
                S::Points::all(PatchPoint { place: S::Slips::all(0.0), gap: f32::INFINITY, impulse: 0.0 });
            let count = 1 + k as usize % points.slice().len();
            for point in &mut points.slice_mut()[..count] {
                *point = PatchPoint {
                    place: dice.fill(0.5),
                    gap: 0.01 * dice.roll(),
                    impulse: 0.05 * dice.roll().abs(),
                };
            }
            patches.push(Patch {
                a: record,
                b: record.saturating_sub(1 + k % 3),
                normal,
                arm_a: dice.fill(0.5),
                arm_b: dice.fill(0.5),
                friction: dice.roll().abs(),
                rolling: if k % 4 == 0 { 0.01 } else { 0.0 },
                twisting: 0.2 * dice.roll().abs(),
                restitution: if k % 5 == 0 { 0.5 } else { 0.0 },
                points,
                rubbing: dice.fill(0.01),
                rolling_moment: S::Slips::all(0.0),
            });
        }
        (solver, patches)
    }

    fn bits<S: Wide>(solver: &SoftSolver<S>) -> Vec<u32> {
        let records = solver.records.motion.iter().chain(&solver.records.moved);
        let works = solver.beside.iter().flat_map(|b| [&b.pressing_work, &b.rubbing_work, &b.changed]);
        records.chain(works).flat_map(|r| r.0.map(f32::to_bits)).collect()
    }

    fn every_processor_agrees<S: Wide>() {
        let choice = SoftChoice {
            substeps: 4,
            h: 1.0 / 240.0,
            hertz: 30.0,
            damping_ratio: 10.0,
            push_speed: 3.0,
            rest_speed: 0.1,
        };
        let run = |portable: bool| {
            let (mut solver, patches) = chain::<S>(&mut Dice(7));
            solver.pack(&patches, |record| record == 0);
            if portable {
                Portable.run(Steps(&mut solver, choice))
            } else {
                dispatch(Steps(&mut solver, choice))
            }
            solver
        };
        let (one, other) = (run(true), run(false));
        assert!(bits(&one) == bits(&other));
        assert!(one.told().changed > 0.0 && one.told().changed.is_finite());
        assert!(one.told().rubbing_work < 0.0);
    }

    #[test]
    fn every_processor_gives_the_same_bits_in_the_plane() {
        every_processor_agrees::<Planar>();
    }

    #[test]
    fn every_processor_gives_the_same_bits_in_space() {
        every_processor_agrees::<Spatial>();
    }
}
