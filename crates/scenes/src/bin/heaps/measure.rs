//! One run of a task: what every step did to energy and overlap, what stands in the books, what it cost. Overlap is
//! measured at step ends from places and shapes alone.

use crate::task::{Aim, Choice, Task};
use carom::{Column, Events, Motion, Spatial, StepError, StepReport, Vec3, World3};
use carom_scenes::judge::{Judge, Overlap};
use std::time::{Duration, Instant};

/// What a run is held to: gain in any step and closure over the energy at the start, overlap over the size of the
/// smaller body \[1\].
const GAIN: f64 = 1e-8;
const CLOSURE: f64 = 1e-12;
const OVERLAP: f64 = 1e-6;
/// How far a body that nothing touches may be from where its fall leads in a step \[m\].
const FALL: f64 = 1e-12;
/// Farthest that a body of what stands may get from where it began \[m\].
const WAY: f64 = 1e-9;
/// Speed of a surface below which a body may rest \[m/s\], and for how long it must stay there to do so \[s\].
const SLOW: f64 = 1e-4;
const LONG: f64 = 0.5;
/// Time between two looks of whoever watches.
const PATIENCE: Duration = Duration::from_secs(5);

/// A figure of one step, and where it was found.
#[derive(Clone, Copy, Debug, Default)]
pub struct Worst<T> {
    /// The figure.
    pub value: T,
    /// The step, from 1; 0 for none.
    pub step: u64,
}

/// Figures of one run, or of a run so far.
#[derive(Clone, Debug)]
pub struct Measurement {
    /// What ran.
    pub task: Task,
    /// How.
    pub choice: Choice,
    /// Bodies that can move.
    pub bodies: usize,
    /// Steps taken.
    pub steps: u64,
    /// Simulated time \[s\].
    pub time: f64,
    /// Wall-clock time of the steps \[s\], with that of a last one that was interrupted.
    pub seconds: f64,
    /// Processor time of the steps \[s\]; `None` where the system does not tell.
    pub cpu: Option<f64>,
    /// Time of the longest step, on the processor where the system tells it \[s\].
    pub longest: Worst<f64>,
    /// Largest gain of energy in a step, over the energy at the start \[1\].
    pub gain: Worst<f64>,
    /// Overlap at a step's end that is deepest over its bodies' size.
    pub overlap: Worst<Overlap>,
    /// Energy that the ledger does not explain, over the energy at the start \[1\].
    pub closure: f64,
    /// How far a body that nothing touched was from where its fall led in a step \[m\].
    pub fall: Worst<f64>,
    /// The ledger's lines of projection and of rests of steps taken at once, over the energy at the start \[1\].
    pub lines: [f64; 2],
    /// What happened.
    pub events: Events,
    /// Steps in which something reached its cap of events.
    pub capped_steps: usize,
    /// Largest residual of a solve \[m/s\].
    pub residual: f64,
    /// Kinetic energy \[J\].
    pub kinetic: f64,
    /// Fastest point of a surface \[m/s\].
    pub fastest: f64,
    /// Moment since which all bodies have been slow, when that is long enough ago to be rest \[s\].
    pub rest: Option<f64>,
    /// Farthest that a body has been from where it began \[m\].
    pub way: f64,
    /// Contacts of the last step, and the most of any step.
    pub contacts: [usize; 2],
    /// How it ended.
    pub end: End,
}

/// How a run ended.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum End {
    /// It goes on, or was stopped from outside.
    UnderWay,
    /// It came to what it was to come to, or its time was up.
    Done,
    /// It used up the seconds it was given.
    Limit,
    /// A step failed, and why.
    Failed(String),
}

impl Measurement {
    /// Runs a task; `tell` sees the figures every few seconds.
    pub fn of(
        task: Task,
        choice: &Choice,
        limit: Option<Duration>,
        mut tell: impl FnMut(&Measurement),
    ) -> Result<Measurement, String> {
        let world = task.world(choice).map_err(|e| e.to_string())?;
        let mut run = Run::new(task, choice, world);
        let steps = (choice.time / choice.dt).round() as u64;
        let (begun, mut told) = (Instant::now(), Instant::now());
        let is_over = || limit.is_some_and(|limit| begun.elapsed() > limit);
        while run.found.end == End::UnderWay {
            if let Err(error) = run.step(&is_over) {
                run.found.end = match error {
                    StepError::Interrupted { .. } => End::Limit,
                    other => End::Failed(other.to_string()),
                };
            } else if run.found.steps >= steps || (task.aim() == Aim::Rest && run.found.rest.is_some()) {
                run.found.end = End::Done;
            } else if is_over() {
                run.found.end = End::Limit;
            }
            if told.elapsed() > PATIENCE {
                told = Instant::now();
                tell(&run.found);
            }
        }
        Ok(run.found)
    }
    /// Seconds of computing of a simulated second, on the processor where the system tells it \[1\].
    pub fn cost(&self) -> f64 {
        self.cpu.unwrap_or(self.seconds) / self.time
    }
    /// The demands on the run and whether it meets them; whatever cannot be compared is missed.
    pub fn demands(&self) -> Vec<(&'static str, bool)> {
        let mut demands = vec![
            ("gain", self.gain.value <= GAIN),
            ("overlap", self.overlap.value.over_size <= OVERLAP),
            ("closure", self.closure.abs() <= CLOSURE),
            ("fall", self.fall.value <= FALL),
            ("no cap", self.capped_steps == 0),
            ("residual", self.residual <= self.choice.asked),
        ];
        match self.task.aim() {
            Aim::Rest => demands.push(("rest", self.rest.is_some())),
            Aim::Stand => demands.push(("stands", self.way <= WAY)),
            Aim::Cost => {}
        }
        // what is asked for its cost alone may end where its seconds do
        let cut = self.end == End::Limit && self.task.aim() == Aim::Cost;
        demands.push(("to the end", self.end == End::Done || cut));
        demands
    }
    /// True when all demands are met.
    pub fn is_met(&self) -> bool {
        self.demands().iter().all(|(_, met)| *met)
    }
}

/// A run under way.
struct Run {
    world: World3,
    judge: Judge<Spatial>,
    start: Vec<Vec3>,
    /// Energy at the start, and before the step to come \[J\].
    energies: [f64; 2],
    /// Moment since which all bodies have been slow \[s\].
    slow_since: Option<f64>,
    found: Measurement,
}

impl Run {
    fn new(task: Task, choice: &Choice, world: World3) -> Run {
        let bodies = world.bodies();
        let found = Measurement {
            task,
            choice: *choice,
            bodies: (0..bodies.len()).filter(|&i| bodies.is_dynamic(i)).count(),
            steps: 0,
            time: 0.0,
            seconds: 0.0,
            cpu: processor_seconds().map(|_| 0.0),
            longest: Worst::default(),
            gain: Worst { value: f64::NEG_INFINITY, step: 0 },
            overlap: Worst::default(),
            closure: 0.0,
            fall: Worst::default(),
            lines: [0.0; 2],
            events: Events::default(),
            capped_steps: 0,
            residual: 0.0,
            kinetic: 0.0,
            fastest: f64::INFINITY,
            rest: None,
            way: 0.0,
            contacts: [0; 2],
            end: End::UnderWay,
        };
        Run {
            judge: Judge::of(&world),
            start: bodies.motion.position.clone(),
            energies: [world.energy().total(); 2],
            slow_since: None,
            world,
            found,
        }
    }

    /// Takes a step; long solves ask whether the time is over.
    fn step(&mut self, is_over: &dyn Fn() -> bool) -> Result<(), StepError> {
        let before = self.world.bodies().motion.clone();
        let (begun, cpu) = (Instant::now(), processor_seconds());
        let taken = self.world.step_watched(self.found.choice.dt, &mut |_| !is_over());
        let mut took = begun.elapsed().as_secs_f64();
        self.found.seconds += took;
        if let (Some(sum), Some(before), Some(after)) = (&mut self.found.cpu, cpu, processor_seconds()) {
            took = after - before;
            *sum += took;
        }
        if took > self.found.longest.value {
            self.found.longest = Worst { value: took, step: self.found.steps + 1 };
        }
        self.take(&taken?);
        self.look();
        self.look_at_falls(&before);
        Ok(())
    }

    /// Takes in what the step tells of itself.
    fn take(&mut self, report: &StepReport<Spatial>) {
        let (found, [first, last]) = (&mut self.found, self.energies);
        let energy = self.world.energy();
        (found.steps, found.time, found.kinetic) = (report.step, report.time, energy.kinetic());
        let gain = (energy.total() - last - report.ledger.applied) / first;
        if is_worse(gain, found.gain.value) {
            found.gain = Worst { value: gain, step: report.step };
        }
        self.energies[1] = energy.total();
        let ledger = self.world.ledger();
        found.closure = (energy.total() - first - ledger.sum()) / first;
        found.lines = [ledger.projection / first, ledger.fallback / first];
        found.events.add(&report.events);
        found.capped_steps += usize::from(report.events.capped > 0);
        if is_worse(report.residual(), found.residual) {
            found.residual = report.residual();
        }
        found.contacts = [report.contacts, found.contacts[1].max(report.contacts)];
    }

    /// Looks at where the bodies are and how fast.
    fn look(&mut self) {
        let (found, bodies) = (&mut self.found, self.world.bodies());
        let overlap = self.judge.worst_of(&self.world);
        if is_worse(overlap.over_size, found.overlap.value.over_size) {
            found.overlap = Worst { value: overlap, step: found.steps };
        }
        let motion = &bodies.motion;
        let speed = |i: usize| {
            motion.velocity[i].norm() + bodies.data[i].turning_arm * motion.angular_velocity[i].norm()
        };
        let dynamic = || (0..bodies.len()).filter(|&i| bodies.is_dynamic(i));
        found.fastest = dynamic().map(speed).fold(0.0, f64::max);
        found.way = dynamic().map(|i| (motion.position[i] - self.start[i]).norm()).fold(found.way, f64::max);
        self.slow_since = if found.fastest <= SLOW { self.slow_since.or(Some(found.time)) } else { None };
        found.rest = self.slow_since.filter(|since| found.time - since >= LONG);
    }

    /// Looks whether what nothing touched fell as it must: a step that forgets to move bodies keeps every other book.
    fn look_at_falls(&mut self, before: &Motion<Spatial>) {
        let (bodies, dt) = (self.world.bodies(), self.found.choice.dt);
        let found = &mut self.found;
        let mut falls: Vec<bool> = (0..bodies.len()).map(|i| bodies.is_dynamic(i)).collect();
        for t in self.world.touches() {
            (falls[t.a], falls[t.b]) = (false, false);
        }
        let gravity = self.world.settings().gravity;
        for i in (0..bodies.len()).filter(|&i| falls[i]) {
            let way = before.velocity[i] * dt + gravity * (0.5 * dt * dt);
            let off = (bodies.motion.position[i] - before.position[i] - way).norm();
            if is_worse(off, found.fall.value) {
                found.fall = Worst { value: off, step: found.steps };
            }
        }
    }
}

/// True for what is larger, or no number: that is never forgotten.
fn is_worse(value: f64, worst: f64) -> bool {
    value > worst || value.is_nan()
}

/// Processor time of this thread so far \[s\], of systems that tell it; the engine computes on the thread that asks.
fn processor_seconds() -> Option<f64> {
    let text = std::fs::read_to_string("/proc/thread-self/schedstat").ok()?;
    Some(1e-9 * text.split_whitespace().next()?.parse::<f64>().ok()?)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn short(task: Task) -> Measurement {
        let choice = Choice { time: 2.0 * task.usual().dt, ..task.usual() };
        Measurement::of(task, &choice, None, |_| ()).expect("builds")
    }

    fn missed(m: &Measurement) -> Vec<&'static str> {
        m.demands().into_iter().filter(|(_, met)| !met).map(|(name, _)| name).collect()
    }

    #[test]
    fn a_tower_that_stands_meets_its_demands_and_each_of_them_can_be_missed() {
        let good = short(Task::Kapla);
        assert_eq!((good.bodies, good.steps, &good.end), (102, 2, &End::Done));
        assert_eq!(missed(&good), [""; 0]);
        let deep = Overlap { over_size: 1.1 * OVERLAP, ..Overlap::default() };
        let off = |change: &dyn Fn(&mut Measurement)| {
            let mut m = good.clone();
            change(&mut m);
            missed(&m)
        };
        assert_eq!(off(&|m| m.gain.value = 1.1 * GAIN), ["gain"]);
        assert_eq!(off(&|m| m.gain.value = f64::NAN), ["gain"]);
        assert_eq!(off(&|m| m.overlap.value = deep), ["overlap"]);
        assert_eq!(off(&|m| m.closure = -1.1 * CLOSURE), ["closure"]);
        assert_eq!(off(&|m| m.fall.value = 1.1 * FALL), ["fall"]);
        assert_eq!(off(&|m| m.capped_steps = 1), ["no cap"]);
        assert_eq!(off(&|m| m.residual = 1.1 * m.choice.asked), ["residual"]);
        assert_eq!(off(&|m| m.residual = f64::NAN), ["residual"]);
        assert_eq!(off(&|m| m.way = 1.1 * WAY), ["stands"]);
        for end in [End::Limit, End::UnderWay, End::Failed("why".into())] {
            assert_eq!(off(&|m| m.end = end.clone()), ["to the end"]);
        }
    }

    #[test]
    fn what_still_falls_does_not_rest_and_a_cost_needs_no_end() {
        let mut bin = short(Task::Bin);
        assert_eq!((bin.bodies, missed(&bin)), (250, vec!["rest"]));
        bin.rest = Some(0.0);
        assert_eq!(missed(&bin), [""; 0]);
        let usual = Task::Pour.usual();
        let mut pour = Measurement::of(Task::Pour, &usual, Some(Duration::ZERO), |_| ()).expect("builds");
        assert_eq!((pour.steps, &pour.end, missed(&pour)), (1, &End::Limit, vec![]));
        pour.end = End::UnderWay;
        assert_eq!(missed(&pour), ["to the end"]);
    }

    #[test]
    fn a_body_in_the_air_that_a_step_did_not_move_is_seen() {
        let choice = Task::Bin.usual();
        let mut run = Run::new(Task::Bin, &choice, Task::Bin.world(&choice).expect("builds"));
        for _ in 0..3 {
            run.step(&|| false).expect("possible");
        }
        let fell = run.found.fall;
        assert!(fell.value <= FALL, "{fell:?}");
        let forgotten = run.world.bodies().motion.clone();
        run.look_at_falls(&forgotten);
        assert!(run.found.fall.value > 100.0 * FALL, "{:?}", run.found.fall);
    }

    #[test]
    fn rest_begins_where_all_became_slow_and_lasts_half_a_second() {
        let choice = Task::Kapla.usual();
        let mut run = Run::new(Task::Kapla, &choice, Task::Kapla.world(&choice).expect("builds"));
        let mut at = |time: f64, speed: f64| {
            run.world.motion_mut().velocity[7] = Vec3::ZERO;
            run.world.motion_mut().velocity[7][2] = speed;
            run.found.time = time;
            run.look();
            run.found.rest
        };
        assert_eq!(at(1.0, 0.9 * SLOW), None);
        assert_eq!(at(1.4, 1.1 * SLOW), None);
        assert_eq!(at(1.5, 0.0), None);
        assert_eq!(at(1.9, 0.5 * SLOW), None);
        assert_eq!(at(2.0, 0.5 * SLOW), Some(1.5));
    }
}
