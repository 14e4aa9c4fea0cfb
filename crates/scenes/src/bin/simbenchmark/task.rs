//! The tasks: their scenes, how long they run, and which answers are known.

use carom::{BuildError, PlasticArrivals, Scheme, Settings, Spatial, Vec3, World3, vec3};
use carom_scenes::simbenchmark as scenes;

/// A task of the benchmark.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Task {
    /// Rolling, the box pulled at sixty degrees to an edge of it.
    RollingOblique,
    /// Rolling, the box pulled along an edge of it.
    RollingAlong,
    /// Elastic balls on the ground.
    Bouncing,
    /// A cube of balls that collapses without bouncing.
    Cube,
    /// A cube of elastic balls.
    ElasticCube,
}

impl Task {
    /// All of them.
    pub const ALL: [Task; 5] =
        [Task::RollingOblique, Task::RollingAlong, Task::Bouncing, Task::Cube, Task::ElasticCube];
    /// The name as users and files have it.
    pub fn name(self) -> &'static str {
        match self {
            Task::RollingOblique => "rolling_oblique",
            Task::RollingAlong => "rolling_along",
            Task::Bouncing => "bouncing",
            Task::Cube => "666",
            Task::ElasticCube => "elastic_666",
        }
    }
    /// The task of a name.
    pub fn named(name: &str) -> Option<Task> {
        Task::ALL.into_iter().find(|t| t.name() == name)
    }
    /// What the benchmark's error of the task is.
    pub fn error(self) -> &'static str {
        match self {
            Task::RollingOblique | Task::RollingAlong => {
                "mean of |v_box - exact|^2 + |v_ball - exact|^2 [m^2/s^2]"
            }
            Task::Bouncing | Task::ElasticCube => "mean of (E - E0)^2 [J^2]",
            Task::Cube => "mean of the sum of squared overlaps [m^2]",
        }
    }
    /// Simulated time \[s\].
    pub fn duration(self) -> f64 {
        match self {
            Task::RollingOblique | Task::RollingAlong => 4.0,
            Task::Bouncing => 20.0,
            Task::Cube | Task::ElasticCube => 10.0,
        }
    }
    /// Lengths of steps when none are asked for \[s\]: the shortest only for bouncing, the other tasks take minutes each.
    pub fn usual_steps(self) -> &'static [f64] {
        match self {
            Task::Bouncing => &[1e-4, 1e-3, 1e-2, 1e-1],
            _ => &[1e-3, 1e-2, 1e-1],
        }
    }
    /// True for the two directions of rolling.
    pub fn is_rolling(self) -> bool {
        matches!(self, Task::RollingOblique | Task::RollingAlong)
    }
    /// Unit vector that the box of rolling is pulled along.
    pub fn direction(self) -> Vec3 {
        match self {
            Task::RollingOblique => vec3(0.5, 0.75_f64.sqrt(), 0.0),
            _ => vec3(0.0, 1.0, 0.0),
        }
    }
    /// A new world of the task, with the defaults of a scheme but for the residual that solves of `events` aim at
    /// (over |g| dt \[1\]).
    ///
    /// # Errors
    /// None is known; those of building a world.
    pub fn world(self, choice: &Choice) -> Result<World3, BuildError> {
        let mut settings =
            Settings::<Spatial> { dt: choice.dt, scheme: choice.scheme, ..Settings::default() };
        settings.events.tolerance = choice.tolerance;
        settings.events.plastic_arrivals = choice.plastic_arrivals;
        match self {
            Task::RollingOblique | Task::RollingAlong => scenes::rolling(self.direction(), settings),
            Task::Bouncing => scenes::bouncing(settings),
            Task::Cube => scenes::cube(6, 0.101, 0.0, settings),
            Task::ElasticCube => scenes::cube(6, 1.101, 1.0, settings),
        }
    }
}

/// How a task is run.
#[derive(Clone, Copy, Debug)]
pub struct Choice {
    /// The scheme.
    pub scheme: Scheme,
    /// How contacts that do not bounce arrive in `events`.
    pub plastic_arrivals: PlasticArrivals,
    /// Length of a step \[s\].
    pub dt: f64,
    /// Residual that solves of `events` aim at, over |g| dt \[1\].
    pub tolerance: f64,
}
