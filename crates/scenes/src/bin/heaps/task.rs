//! The tasks: their scenes, how they run, how long, and what each is held to beside energy, overlap and books.

use carom::{BuildError, EventSettings, PlasticArrivals, Scheme, Settings, Spatial, World3};
use carom_scenes::{pouring, stacking};

/// A heap.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Task {
    /// Fifty tilted boxes and two hundred hulls dropped into a bin, until they rest.
    Bin,
    /// A thousand mixed convex bodies poured into a box.
    Pour,
    /// A Kapla tower of 102 planks that stands.
    Kapla,
}

/// What a task asks for beyond what all are held to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Aim {
    /// All bodies rest before the time is up; the run ends there.
    Rest,
    /// Nothing moves for the whole time.
    Stand,
    /// No more than a cost.
    Cost,
}

impl Task {
    /// All of them.
    pub const ALL: [Task; 3] = [Task::Bin, Task::Pour, Task::Kapla];
    /// The name as users and files have it.
    pub fn name(self) -> &'static str {
        match self {
            Task::Bin => "bin",
            Task::Pour => "pour",
            Task::Kapla => "kapla",
        }
    }
    /// The task of a name.
    pub fn named(name: &str) -> Option<Task> {
        Task::ALL.into_iter().find(|t| t.name() == name)
    }
    /// What it asks for.
    pub fn aim(self) -> Aim {
        match self {
            Task::Bin => Aim::Rest,
            Task::Pour => Aim::Cost,
            Task::Kapla => Aim::Stand,
        }
    }
    /// How it runs when nothing else is asked for: what falls as heaps may, what stands with the defaults of `events`.
    pub fn usual(self) -> Choice {
        let heap = Choice {
            dt: 1.0 / 240.0,
            // at 1e-8 some solves crawl over their last digit, and their steps take three to twenty times as long
            tolerance: 1e-7,
            asked: Settings::<Spatial>::default().tolerance,
            arrivals: PlasticArrivals::WithinTheStep,
            time: 20.0,
        };
        let EventSettings { tolerance, plastic_arrivals: arrivals, .. } = EventSettings::default();
        match self {
            Task::Bin => heap,
            // its solves, of thousands of contacts at metres per second, take 40 to 300 factorisations to this, which is
            // a four-hundredth of |g| dt, and up to 1,100 to a hundredth of it
            Task::Pour => Choice { asked: 1e-4, time: 3.0, ..heap },
            Task::Kapla => Choice { dt: 1.0 / 60.0, tolerance, arrivals, time: 600.0, ..heap },
        }
    }
    /// A new world of the task, with the defaults of `events` but for what is chosen.
    ///
    /// # Errors
    /// [`BuildError`] for a choice out of range.
    pub fn world(self, choice: &Choice) -> Result<World3, BuildError> {
        let mut world = match self {
            Task::Bin => pouring::bin(5, 50, 200),
            Task::Pour => pouring::pile(1000),
            Task::Kapla => stacking::kapla_tower(34, 3),
        }?;
        world.set_settings(choice.settings())?;
        Ok(world)
    }
}

/// How a task is run.
#[derive(Clone, Copy, Debug)]
pub struct Choice {
    /// Length of a step \[s\].
    pub dt: f64,
    /// Residual that solves aim at, over |g| dt \[1\].
    pub tolerance: f64,
    /// Residual that does where the one aimed at takes long \[m/s\].
    pub asked: f64,
    /// How contacts that do not bounce arrive.
    pub arrivals: PlasticArrivals,
    /// Time to simulate \[s\].
    pub time: f64,
}

impl Choice {
    /// The settings of the scheme `events` that it stands for.
    pub fn settings(&self) -> Settings<Spatial> {
        let mut settings = Settings::<Spatial> { dt: self.dt, scheme: Scheme::Events, ..Settings::default() };
        settings.tolerance = self.asked;
        settings.events.tolerance = self.tolerance;
        settings.events.plastic_arrivals = self.arrivals;
        settings
    }
}
