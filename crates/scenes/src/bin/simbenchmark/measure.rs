//! One run of a task: the benchmark's error, taken before each step, and what else tells whether to trust it.
//! Energies and overlaps are computed here from places and velocities, not asked of the world.

use crate::task::{Choice, Task};
use carom::{Column, Events, ImpactReport, Scheme, Spatial, StepReport, Vec3, World3};
use carom_scenes::simbenchmark as scenes;
use std::time::{Duration, Instant};

/// What a run is held to (errors in the units of [`Task::error`]).
const ROLLING_ERROR: f64 = 1e-20;
const ENERGY_ERROR: f64 = 1e-15;
const OVERLAP_ERROR: f64 = 1e-20;
/// Height of a bouncing ball \[m\].
const HEIGHT_ERROR: f64 = 1e-9;
/// Closure, gain in a step and projection, over the energy at the start \[1\].
const CLOSURE: f64 = 1e-12;
const GAIN: f64 = 1e-8;
const PROJECTION: f64 = 1e-6;
/// Time between two signs of life \[s\].
const PATIENCE: Duration = Duration::from_secs(5);

/// Figures of one run.
#[derive(Clone, Debug)]
pub struct Measurement {
    /// What ran.
    pub task: Task,
    /// How.
    pub choice: Choice,
    /// Steps taken.
    pub steps: usize,
    /// The benchmark's error, see [`Task::error`].
    pub error: f64,
    /// Largest error of a place with a closed form \[m\]; `None` where there is none.
    pub place: Option<f64>,
    /// Mean sum of squared overlaps of balls \[m^2\]; `None` for rolling.
    pub overlap: Option<f64>,
    /// Largest gain of energy in a step that no load gave, over the energy at the start \[1\].
    pub gain: f64,
    /// The ledger's projection, less removing the overlap that the scene is given with, over the energy at the start.
    pub projection: f64,
    /// Energy at the end that the ledger does not explain, over the energy at the start \[1\].
    pub closure: f64,
    /// What happened.
    pub events: Events,
    /// What their impacts came to.
    pub impacts: ImpactReport,
    /// Steps in which something reached its cap of events.
    pub capped_steps: usize,
    /// Largest residual of a solve \[m/s\].
    pub residual: f64,
    /// Time of all steps \[s\].
    pub seconds: f64,
    /// Why the run ended early.
    pub failure: Option<String>,
}

impl Measurement {
    /// Runs a task.
    pub fn of(task: Task, choice: &Choice) -> Measurement {
        let Choice { scheme, dt, .. } = *choice;
        let mut run = match task.world(choice) {
            Ok(world) => Run::new(task, world, dt),
            Err(error) => panic!("the scene {} is refused: {error}", task.name()),
        };
        let steps = (task.duration() / dt).round() as usize;
        let mut told = Instant::now();
        let mut failure = None;
        for k in 0..steps {
            run.sample(k);
            if let Err(error) = run.step() {
                failure = Some(error);
                break;
            }
            if told.elapsed() > PATIENCE {
                told = Instant::now();
                eprintln!(
                    "{} {scheme:?} dt {dt:e}: step {k} of {steps}, {:.0} s",
                    task.name(),
                    run.spent.as_secs_f64()
                );
            }
        }
        run.end(choice, failure)
    }
    /// True when the scheme is the one that must meet the demands.
    pub fn is_held_to_demands(&self) -> bool {
        self.choice.scheme == Scheme::Events
    }
    /// Times that a guard stepped in: energy guard, endless rounds, steps taken at once.
    pub fn guards(&self) -> usize {
        self.impacts.guarded + self.impacts.ended_plastic + self.events.fallbacks
    }
    /// The demands that the run misses, by name; whatever cannot be compared is missed.
    pub fn missed(&self) -> Vec<&'static str> {
        let textbook = self.task.is_rolling() || self.task == Task::Bouncing;
        let most = match self.task {
            Task::Cube => OVERLAP_ERROR,
            Task::Bouncing | Task::ElasticCube => ENERGY_ERROR,
            _ => ROLLING_ERROR,
        };
        let place = if self.task == Task::Bouncing { HEIGHT_ERROR } else { f64::INFINITY };
        let demands = [
            ("to the end", self.failure.is_none()),
            ("error", self.error <= most),
            ("place", self.place.is_none_or(|x| x <= place)),
            ("overlap", self.overlap.is_none_or(|x| x <= OVERLAP_ERROR)),
            ("gain", self.gain <= GAIN),
            ("projection", self.projection.abs() <= PROJECTION),
            ("closure", self.closure.abs() <= CLOSURE),
            ("no cap, no guard", !textbook || (self.capped_steps == 0 && self.guards() == 0)),
        ];
        demands.into_iter().filter(|(_, met)| !met).map(|(name, _)| name).collect()
    }
}

/// A run under way.
struct Run {
    task: Task,
    world: World3,
    dt: f64,
    start: Vec<Vec3>,
    /// Energy at the start, and before the step to come \[J\].
    energies: [f64; 2],
    samples: usize,
    error: f64,
    place: f64,
    overlap: f64,
    gain: f64,
    events: Events,
    impacts: ImpactReport,
    capped_steps: usize,
    residual: f64,
    spent: Duration,
}

impl Run {
    fn new(task: Task, world: World3, dt: f64) -> Run {
        let start = world.bodies().motion.position.clone();
        let energy = energy(&world);
        Run {
            task,
            world,
            dt,
            start,
            energies: [energy; 2],
            samples: 0,
            error: 0.0,
            place: 0.0,
            overlap: 0.0,
            gain: 0.0,
            events: Events::default(),
            impacts: ImpactReport::default(),
            capped_steps: 0,
            residual: 0.0,
            spent: Duration::ZERO,
        }
    }

    /// Energy that the scheme spends on an overlap that the scene is given with \[J\].
    fn given(&self) -> f64 {
        let removed = self.task.is_rolling() && self.world.settings().scheme == Scheme::Events;
        if removed { scenes::given_overlap_energy() } else { 0.0 }
    }

    /// Takes the state before step `k`, from 0, into the means.
    fn sample(&mut self, k: usize) {
        let time = k as f64 * self.dt;
        let motion = &self.world.bodies().motion;
        // bodies: the ground, then the box of rolling, then balls
        let overlap = || scenes::squared_overlap(&motion.position[1..], scenes::RADIUS);
        self.samples += 1;
        match self.task {
            Task::RollingOblique | Task::RollingAlong => {
                let direction = self.task.direction();
                for (i, acceleration) in [1, 2].into_iter().zip(scenes::accelerations()) {
                    self.error += (motion.velocity[i] - direction * (acceleration * time)).norm_squared();
                    let mut off =
                        motion.position[i] - self.start[i] - direction * (0.5 * acceleration * time * time);
                    // heights change when the given overlap is removed
                    off[2] = 0.0;
                    self.place = self.place.max(off.norm());
                }
            }
            Task::Bouncing => {
                self.error += (self.energies[1] - self.energies[0]).powi(2);
                let height = scenes::bouncing_height(time);
                let off = motion.position[1..].iter().map(|x| (x[2] - height).abs());
                self.place = off.fold(self.place, f64::max);
                self.overlap += overlap();
            }
            Task::Cube => {
                self.error += overlap();
                self.overlap = self.error;
            }
            Task::ElasticCube => {
                self.error += (self.energies[1] - self.energies[0]).powi(2);
                self.overlap += overlap();
            }
        }
    }

    fn step(&mut self) -> Result<(), String> {
        let begun = Instant::now();
        let report = self.world.step(self.dt).map_err(|e| e.to_string())?;
        self.spent += begun.elapsed();
        self.take(&report);
        Ok(())
    }

    fn take(&mut self, report: &StepReport<Spatial>) {
        let energy = energy(&self.world);
        let given = if report.step == 1 { self.given() } else { 0.0 };
        let gain = energy - self.energies[1] - report.ledger.applied - given;
        self.gain = self.gain.max(gain);
        self.energies[1] = energy;
        self.events.add(&report.events);
        self.impacts.add(&report.impacts);
        self.capped_steps += usize::from(report.events.capped > 0);
        self.residual = self.residual.max(report.residual());
    }

    fn end(self, choice: &Choice, failure: Option<String>) -> Measurement {
        let [first, last] = self.energies;
        let mean = |sum: f64| sum / self.samples as f64;
        let ledger = self.world.ledger();
        let (has_place, has_overlap) =
            (self.task.is_rolling() || self.task == Task::Bouncing, !self.task.is_rolling());
        Measurement {
            task: self.task,
            choice: *choice,
            steps: self.world.steps() as usize,
            error: mean(self.error),
            place: has_place.then_some(self.place),
            overlap: has_overlap.then_some(mean(self.overlap)),
            gain: self.gain / first,
            projection: (ledger.projection - self.given()) / first,
            closure: (last - first - ledger.sum()) / first,
            events: self.events,
            impacts: self.impacts,
            capped_steps: self.capped_steps,
            residual: self.residual,
            seconds: self.spent.as_secs_f64(),
            failure,
        }
    }
}

/// Kinetic energy and that of weight, of all bodies that move \[J\].
fn energy(world: &World3) -> f64 {
    let bodies = world.bodies();
    let one = |i: usize| {
        let mass = bodies.data[i].mass_properties.mass;
        let v = bodies.motion.velocity[i];
        let height = bodies.motion.position[i][2];
        mass * (0.5 * v.dot(v) + scenes::GRAVITY * height) + bodies.rotational_energy(i)
    };
    (0..bodies.len()).filter(|&i| bodies.is_dynamic(i)).map(one).sum()
}
