//! One run of one engine: steps until the scene is over or patience is used up, with the judge looking in between, outside
//! of the time. Knows no engine by name.

use crate::engine::{Engine, Phases, Spent};
use crate::judge::{Judge, Overlap};
use crate::motion::{Motion, Moved};
use crate::scene::Scene;
use carom::Geometry;

/// The judge looks about so many times over a run, the last step included.
const LOOKS: usize = 10;

/// What a run took.
#[derive(Clone, Debug, Default)]
pub struct Run {
    /// Steps taken.
    pub steps: usize,
    /// Time of all steps.
    pub spent: Spent,
    /// Phases of all steps, where the engine tells.
    pub phases: Option<Phases>,
    /// Contact points of the last step, where the engine tells.
    pub contacts: Option<usize>,
    /// Why it ended before its time, when the engine refused.
    pub trouble: Option<String>,
}

impl Run {
    /// Mean time of a step \[ms\], on the wall and of the processor.
    pub fn milliseconds(&self) -> (f64, f64) {
        let each = 1e3 / self.steps as f64;
        (self.spent.wall * each, self.spent.cpu * each)
    }
}

/// What the judge says of a run.
#[derive(Clone, Copy, Debug)]
pub struct Quality {
    /// Overlap of the pair that overlapped deepest in any look \[m\].
    pub deepest: f64,
    /// Overlap at the end.
    pub last: Overlap,
    /// The motion.
    pub moved: Moved,
}

/// Takes the scene's steps, fewer when their time exceeds `patience` \[s\].
pub fn run<S: Geometry>(engine: &mut dyn Engine<S>, steps: usize, patience: f64) -> Run {
    let mut run = Run::default();
    run_watched(engine, steps, patience, &mut run, &mut |_, _, _| Ok(()));
    run.contacts = engine.contacts();
    run
}

/// The same under the eyes of the judge.
///
/// # Errors
/// A scene that the judge cannot weigh.
pub fn judged<S: Geometry>(
    engine: &mut dyn Engine<S>,
    scene: &Scene<S>,
    judge: &mut Judge<S>,
    patience: f64,
) -> Result<(Run, Quality), String> {
    let (mut run, mut motion) = (Run::default(), Motion::of(scene)?);
    let (mut deepest, mut last) = (0.0_f64, Overlap::default());
    let between = scene.steps.div_ceil(LOOKS);
    let mut watch = |engine: &mut dyn Engine<S>, step: usize, end: bool| -> Result<(), String> {
        let look = step.is_multiple_of(between) || end;
        if motion.wants_every_step() || look {
            let poses = engine.poses()?;
            if look {
                last = judge.look(&poses);
                deepest = deepest.max(last.deepest);
            }
            motion.see(poses);
        }
        Ok(())
    };
    run_watched(engine, scene.steps, patience, &mut run, &mut watch);
    run.contacts = engine.contacts();
    Ok((run, Quality { deepest, last, moved: motion.told() }))
}

/// What is done after a step: with the engine, the number of steps so far, and whether it was the last.
type Watch<'a, S> = &'a mut dyn FnMut(&mut dyn Engine<S>, usize, bool) -> Result<(), String>;

fn run_watched<S: Geometry>(
    engine: &mut dyn Engine<S>,
    steps: usize,
    patience: f64,
    run: &mut Run,
    watch: Watch<S>,
) {
    let mut end = steps == 0;
    while !end {
        match engine.step() {
            Ok(spent) => run.spent.add(spent),
            Err(problem) => {
                run.trouble = Some(problem);
                return;
            }
        }
        run.steps += 1;
        if let Some(phases) = engine.phases() {
            run.phases.get_or_insert_default().add(phases);
        }
        end = run.steps == steps || run.spent.least() > patience;
        if let Err(problem) = watch(engine, run.steps, end) {
            run.trouble = Some(problem);
            return;
        }
    }
}
