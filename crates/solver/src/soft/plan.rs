//! What is done in a step, stage by stage: packs of a colour are cut into chunks that workers take in any order; colours of
//! few packs and hubs' packs go one after another in one chunk, which is what anybody's order gives.

use super::colours::Colours;
use super::solver::SoftChoice;
use super::sweep::Sweep;
use carom_math::Workers;
use carom_math::lanes::WIDTH;
use std::ops::Range;

/// Packs that a worker takes at a time: about a microsecond of a sweep.
const PACKS: usize = 16;

/// Records that a worker takes at a time.
const RECORDS: usize = 512;

/// Packs below which a step is not worth waking anybody.
const WORTH_IT: usize = 96;

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

/// The stages of a step.
#[derive(Default)]
pub struct Plan {
    /// Packs by chunk.
    pub chunks: Vec<Range<usize>>,
    /// Chunks of packs that may be worked on at once, in the order that they are swept in.
    colours: Vec<Range<usize>>,
    /// Each stage's task, and its first chunk of packs.
    pub stages: Vec<(Task, usize)>,
    /// How many chunks each stage has.
    pub counts: Vec<u32>,
    /// Records of a chunk.
    pub records: usize,
}

impl Plan {
    /// Plans a step over packs of these colours.
    pub fn make(
        &mut self,
        colours: &Colours,
        (packs, records): (usize, usize),
        (bounces, choice): (bool, &SoftChoice),
        workers: &Workers,
    ) {
        self.cut(colours, packs, workers);
        self.records = if self.chunks.len() > 1 { RECORDS } else { records.max(1) };
        let of_records = (records as u32).div_ceil(self.records as u32);
        self.stages.clear();
        self.counts.clear();
        self.at_once(Task::Pack);
        if bounces {
            self.at_once(Task::Approach);
        }
        self.by_colour(Task::Prepare);
        for substep in 0..choice.substeps {
            self.stage(Task::Accelerate(substep), 0, of_records);
            self.sweeps(choice, [Sweep::Springs; 2], of_records);
            self.stage(Task::MoveOn, 0, of_records);
            let last = if substep + 1 == choice.substeps { Sweep::Last } else { Sweep::Relaxing };
            self.sweeps(choice, [Sweep::Easing, last], of_records);
        }
        if bounces {
            self.at_once(Task::Compress);
            self.by_colour(Task::Bounce);
        }
        self.at_once(Task::Book);
    }

    /// A row of sweeps, the last of the second kind; a single one where contacts are springs.
    fn sweeps(&mut self, choice: &SoftChoice, [kind, last]: [Sweep; 2], of_records: u32) {
        let (count, led) = choice.rigid.map_or((1, false), |rigid| (rigid.sweeps, rigid.accelerated));
        if led && count > 1 {
            self.at_once(Task::BeginToLead);
            self.stage(Task::BeginToLeadBodies, 0, of_records);
        }
        for _ in 1..count {
            self.by_colour(Task::Sweep(kind, led));
            if led {
                self.stage(Task::Weigh, 0, 1);
                self.at_once(Task::Lead);
                self.stage(Task::LeadBodies, 0, of_records);
            }
        }
        self.by_colour(Task::Sweep(last, false));
    }

    /// Cuts packs into chunks, and chunks into those that may be worked on at once.
    fn cut(&mut self, colours: &Colours, packs: usize, workers: &Workers) {
        self.chunks.clear();
        self.colours.clear();
        if workers.is_alone() || packs < WORTH_IT {
            self.chunks.push(0..packs);
            self.colours.push(0..1);
            return;
        }
        let (mut first, mut row) = (0, 0..0);
        for (list, ends) in colours.starts.windows(2).enumerate() {
            let packs = first..first + (ends[1] - ends[0]).div_ceil(WIDTH);
            first = packs.end;
            if packs.len() <= PACKS || list >= colours.alone {
                row.end = packs.end;
                continue;
            }
            self.in_a_row(row);
            row = packs.end..packs.end;
            let begun = self.chunks.len();
            self.chunks.extend(packs.clone().step_by(PACKS).map(|k| k..packs.end.min(k + PACKS)));
            self.colours.push(begun..self.chunks.len());
        }
        self.in_a_row(row);
    }

    /// Packs that go one after another.
    fn in_a_row(&mut self, packs: Range<usize>) {
        if !packs.is_empty() {
            self.colours.push(self.chunks.len()..self.chunks.len() + 1);
            self.chunks.push(packs);
        }
    }

    fn stage(&mut self, task: Task, first: usize, count: u32) {
        self.stages.push((task, first));
        self.counts.push(count);
    }

    /// Packs do not ask each other.
    fn at_once(&mut self, task: Task) {
        self.stage(task, 0, self.chunks.len() as u32);
    }

    /// Packs of a colour see what those of the colours before did.
    fn by_colour(&mut self, task: Task) {
        for colour in 0..self.colours.len() {
            let chunks = self.colours[colour].clone();
            self.stage(task, chunks.start, chunks.len() as u32);
        }
    }
}
