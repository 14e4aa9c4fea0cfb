//! What is done in a step: groups go through all of it one after another, or side by side where there are workers. A group that
//! is a large part of the whole is shared stage by stage: packs of a colour are cut into chunks that workers take in any order;
//! colours of few packs and hubs' packs go one after another in one chunk, which is what anybody's order gives.

use super::colours::{Colours, Lists};
use super::solver::SoftChoice;
use super::sweep::Sweep;
use carom_math::Workers;
use carom_math::lanes::WIDTH;
use std::ops::Range;

/// Packs that a worker takes at a time, at least and at most: one to four microseconds of a sweep.
const PACKS: (usize, usize) = (8, 32);

/// Colours of so many packs go in a row: half of them is worth no meeting.
const IN_A_ROW: usize = 16;

/// Records that a worker takes at a time, at least and at most.
const RECORDS: (usize, usize) = (256, 1024);

/// Packs below which a group's stages are not worth waking anybody.
const WORTH_IT: usize = 96;

/// A group is shared where it is more of all packs than one in so many for each worker.
const PARTS: usize = 4;

/// How many of some items a worker takes at a time, so that each has as many as the others where nobody is kept away. No answer hangs
/// on it: what is worked on at once does not ask each other.
fn evenly(items: usize, (least, most): (usize, usize), workers: usize) -> usize {
    let turns = workers * items.div_ceil(workers * most).max(1);
    items.div_ceil(turns).max(least)
}

/// What is done in a stage.
#[derive(Clone, Copy, Debug)]
pub enum Task {
    /// Patches into packs.
    Pack,
    /// Approach of packs that bounce.
    Approach,
    /// Masses and warm starts.
    Prepare,
    /// Loads and warm start of a substep.
    Accelerate(usize),
    /// A sweep, and whether directions lead on from it.
    Sweep(Sweep, bool),
    /// Where a row of sweeps begins that directions lead on: impulses, then velocities.
    BeginToLead,
    BeginToLeadBodies,
    /// How far the direction leads: one turn.
    Weigh,
    /// Impulses, and velocities, along the direction.
    Lead,
    LeadBodies,
    /// Poses after a substep.
    MoveOn,
    /// Energy that restitution may give back.
    Compress,
    /// Restitution.
    Bounce,
    /// Works.
    Book,
}

/// Whom a task is for.
enum Over {
    /// Packs, which do not ask each other.
    Packs,
    /// Packs colour by colour, which see what those of the colours before did.
    Colours,
    Records,
    /// Everything, in one turn.
    All,
}

impl Task {
    fn over(self) -> Over {
        match self {
            Task::Pack | Task::Approach | Task::BeginToLead | Task::Lead | Task::Compress | Task::Book => {
                Over::Packs
            }
            Task::Prepare | Task::Sweep(..) | Task::Bounce => Over::Colours,
            Task::Accelerate(_) | Task::MoveOn | Task::BeginToLeadBodies | Task::LeadBodies => Over::Records,
            Task::Weigh => Over::All,
        }
    }
}

/// Packs that a worker takes at a time.
#[derive(Clone, Debug)]
pub struct Chunk {
    pub packs: Range<usize>,
    /// So many of them come first, and have obstacles in them.
    pub with_obstacles: usize,
    /// They are all of a group that one worker takes through the step before its next.
    pub whole: bool,
}

/// A group's packs, the end of those that have obstacles, and its records.
#[derive(Clone, Debug)]
pub struct Share {
    pub packs: Range<usize>,
    pub with_obstacles: usize,
    pub records: Range<usize>,
}

impl Share {
    fn chunk(&self, packs: Range<usize>, whole: bool) -> Chunk {
        let with_obstacles = self.with_obstacles.clamp(packs.start, packs.end) - packs.start;
        Chunk { packs, with_obstacles, whole }
    }
}

/// A task of a group that is shared, its first chunk, and the group's records, so many at a time; without a task all of a step, of all
/// groups that are not shared, a chunk each.
struct Stage {
    task: Option<Task>,
    first: usize,
    records: Range<usize>,
    at_a_time: usize,
}

/// The stages of a step.
#[derive(Default)]
pub struct Plan {
    /// What is done with a group, in its order.
    tasks: Vec<Task>,
    /// Packs by chunk, in their order.
    pub chunks: Vec<Chunk>,
    /// Chunk and records of each group that is not shared.
    wholes: Vec<(usize, Range<usize>)>,
    stages: Vec<Stage>,
    /// How many chunks each stage has.
    pub counts: Vec<u32>,
}

impl Plan {
    /// Plans a step over groups.
    pub fn make(
        &mut self,
        (colours, groups): (&Colours, &[Share]),
        (bounces, choice): (bool, &SoftChoice),
        workers: &Workers,
    ) {
        self.order(bounces, choice);
        self.chunks.clear();
        self.wholes.clear();
        self.stages.clear();
        self.counts.clear();
        let all: usize = groups.iter().map(|group| group.packs.len()).sum();
        for (group, lists) in groups.iter().zip(&colours.groups) {
            let packs = group.packs.len();
            if workers.is_alone() || packs < WORTH_IT || PARTS * workers.count() * packs <= all {
                self.wholes.push((self.chunks.len(), group.records.clone()));
                self.chunks.push(group.chunk(group.packs.clone(), true));
            } else {
                self.share(group, &colours.starts, lists, workers.count());
            }
        }
        if !self.wholes.is_empty() {
            self.stages.insert(0, Stage { task: None, first: 0, records: 0..0, at_a_time: 0 });
            self.counts.insert(0, self.wholes.len() as u32);
        }
    }

    /// The tasks of a step.
    fn order(&mut self, bounces: bool, choice: &SoftChoice) {
        self.tasks.clear();
        self.tasks.push(Task::Pack);
        if bounces {
            self.tasks.push(Task::Approach);
        }
        self.tasks.push(Task::Prepare);
        for substep in 0..choice.substeps {
            self.tasks.push(Task::Accelerate(substep));
            self.sweeps(choice, [Sweep::Springs; 2]);
            self.tasks.push(Task::MoveOn);
            let last = if substep + 1 == choice.substeps { Sweep::Last } else { Sweep::Relaxing };
            self.sweeps(choice, [Sweep::Easing, last]);
        }
        if bounces {
            self.tasks.extend([Task::Compress, Task::Bounce]);
        }
        self.tasks.push(Task::Book);
    }

    /// A row of sweeps, the last of the second kind; a single one where contacts are springs.
    fn sweeps(&mut self, choice: &SoftChoice, [kind, last]: [Sweep; 2]) {
        let (count, led) = choice.rigid.map_or((1, false), |rigid| (rigid.sweeps, rigid.accelerated));
        if led && count > 1 {
            self.tasks.extend([Task::BeginToLead, Task::BeginToLeadBodies]);
        }
        for _ in 1..count {
            self.tasks.push(Task::Sweep(kind, led));
            if led {
                self.tasks.extend([Task::Weigh, Task::Lead, Task::LeadBodies]);
            }
        }
        self.tasks.push(Task::Sweep(last, false));
    }

    /// Stages of a group whose lists begin there.
    fn share(&mut self, group: &Share, starts: &[usize], lists: &Lists, workers: usize) {
        let begun = self.chunks.len();
        let colours = self.cut(group, starts, lists, workers);
        let records = group.records.len();
        let at_a_time = evenly(records, RECORDS, workers);
        for k in 0..self.tasks.len() {
            let task = self.tasks[k];
            match task.over() {
                Over::Packs => self.stage(task, (group, at_a_time), begun..self.chunks.len()),
                Over::Colours => {
                    colours.iter().for_each(|chunks| self.stage(task, (group, at_a_time), chunks.clone()))
                }
                Over::Records => self.stage(task, (group, at_a_time), 0..records.div_ceil(at_a_time)),
                Over::All => self.stage(task, (group, at_a_time), 0..1),
            }
        }
    }

    fn stage(&mut self, task: Task, (group, at_a_time): (&Share, usize), chunks: Range<usize>) {
        let records = group.records.clone();
        self.stages.push(Stage { task: Some(task), first: chunks.start, records, at_a_time });
        self.counts.push(chunks.len() as u32);
    }

    /// Cuts a group's packs into chunks, and tells those that may be worked on at once, in the order that they are swept in.
    fn cut(&mut self, group: &Share, starts: &[usize], lists: &Lists, workers: usize) -> Vec<Range<usize>> {
        let mut colours = Vec::new();
        let (mut first, mut row) = (group.packs.start, group.packs.start..group.packs.start);
        for list in lists.all.clone() {
            let packs = first..first + (starts[list + 1] - starts[list]).div_ceil(WIDTH);
            first = packs.end;
            if packs.len() <= IN_A_ROW || list >= lists.alone {
                row.end = packs.end;
                continue;
            }
            self.in_a_row(group, row, &mut colours);
            row = packs.end..packs.end;
            let begun = self.chunks.len();
            let size = evenly(packs.len(), PACKS, workers);
            let cut = packs.clone().step_by(size).map(|k| group.chunk(k..packs.end.min(k + size), false));
            self.chunks.extend(cut);
            colours.push(begun..self.chunks.len());
        }
        self.in_a_row(group, row, &mut colours);
        colours
    }

    /// Packs that go one after another.
    fn in_a_row(&mut self, group: &Share, packs: Range<usize>, colours: &mut Vec<Range<usize>>) {
        if !packs.is_empty() {
            colours.push(self.chunks.len()..self.chunks.len() + 1);
            self.chunks.push(group.chunk(packs, false));
        }
    }

    /// What is done in a turn of a stage: tasks, the chunk of packs of those that are about packs, and records.
    #[inline]
    pub fn turn(&self, stage: usize, turn: usize) -> (&[Task], usize, Range<usize>) {
        let Stage { task, first, records, at_a_time } = &self.stages[stage];
        let Some(task) = task else {
            let (chunk, records) = &self.wholes[turn];
            return (&self.tasks, *chunk, records.clone());
        };
        let begun = records.start + turn * at_a_time;
        let own = begun.min(records.end)..records.end.min(begun + at_a_time);
        (std::slice::from_ref(task), first + turn, own)
    }
}
