//! The choices of a run, each a named field with unit, reason and default. Impact law, friction law,
//! solver, integrator and position correction are separate choices.

use crate::error::BuildError;
use crate::integrate::Integrator;
use crate::material::Mixing;
use carom_math::{Column, Space};
use carom_solver::{FrictionLaw, ImpulseChoice, SolveSettings, SolverKind};
use serde::{Deserialize, Serialize};

/// The time-stepping schemes; a scheme owns its loop.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Scheme {
    /// Steps of a fixed length; impacts at the step's start, contact forces during it.
    #[default]
    FixedStep,
    /// Steps with impacts and stops of slipping found inside them; contact conditions on mean velocities.
    Events,
    /// Substeps of soft contacts in lanes of f32: fast, for scenes that must look right rather than be exact.
    SoftStep,
}

/// Most sweeps of a substep of `soft_step`, all of which are planned and taken.
const MOST_SWEEPS: usize = 1000;

/// Choices of the scheme `soft_step`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct SoftSettings {
    /// Substeps of a step \[1\]. Default 6. Twice as many divide the error of stacks by four; each costs two sweeps.
    pub substeps: usize,
    /// Frequency of the springs between bodies that move \[Hz\]; twice that with obstacles, and never above a quarter of
    /// the substeps' own. Default 38, fit for six substeps: softer ones sink, stiffer ones ring.
    pub hertz: f64,
    /// Damping ratio of the springs \[1\]. Default 10: overlap goes without a bounce.
    pub damping_ratio: f64,
    /// Overlaps are not pushed apart faster than this \[m/s\]. Default 3.
    pub push_speed: f64,
    /// Islands of bodies that rest on obstacles fall asleep and cost nothing until something stirs them. Default false:
    /// what sleeps is held where it is, and a motion too slow to see ends.
    pub sleeping: bool,
    /// Bodies rest while the mean speed of their surfaces is below this \[m/s\], and while they have not moved by a
    /// hundredth of their size. Default 0.01.
    pub sleep_speed: f64,
    /// For how long all bodies of an island must have rested \[s\]. Default 0.5.
    pub sleep_time: f64,
}

impl Default for SoftSettings {
    fn default() -> Self {
        SoftSettings {
            substeps: 6,
            hertz: 38.0,
            damping_ratio: 10.0,
            push_speed: 3.0,
            sleeping: false,
            sleep_speed: 0.01,
            sleep_time: 0.5,
        }
    }
}

/// Choices of the scheme `events`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct EventSettings {
    /// Gap up to which bodies touch, over the smallest body's size \[1\]. Default 1e-5: contacts this near act
    /// together, which sets the number of events in piles; larger saves events, smaller changes no answer much.
    pub touching: f64,
    /// Impacts slower than this times |g| dt do not bounce \[1\]; elastic ones always do. Default .05: a bouncing
    /// ball comes to rest within two steps of its moment.
    pub rest_speed_factor: f64,
    /// Residual that solves aim at, over |g| dt \[1\]. Default 1e-12; 1e-8 is enough for piles. Whether a step is
    /// inaccurate is judged by the world's tolerance.
    pub tolerance: f64,
    /// Stops of slipping contacts found per step and island. Default 16; further ones end within their flow.
    pub slip_stops: usize,
    /// Events in a row of one set of bodies within a step after which the rest of the step is taken at once, for it
    /// and all it may meet. Default the larger of 2048 and twice the set's bodies: events are cheap, and what the
    /// rest of a step takes from the energy is not.
    pub cap: Option<usize>,
    /// Overlap that is projected away, over the smallest body's size \[1\]. Default 1e-9.
    pub overlap: f64,
    /// How contacts that stay where they arrive do so. Default at their moment.
    pub plastic_arrivals: PlasticArrivals,
    /// Start each flow's solve from the forces before. Default false: where more contacts hold a sliding body than it
    /// has freedoms, the start decides which forces act, and the motion inherits the steps before.
    pub warm_start: bool,
}

/// How contacts without bounce arrive in the scheme with events: restitution 0, or slower than the rest speed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum PlasticArrivals {
    /// Each at its moment, as all arrivals: exact.
    #[default]
    AtTheirMoment,
    /// Slowed where the flow begins, so that they arrive at its end: for heaps, where each moment would cost solves.
    /// First order in the time step, and as strict with overlap and energy.
    WithinTheStep,
}

impl Default for EventSettings {
    fn default() -> Self {
        EventSettings {
            touching: 1e-5,
            rest_speed_factor: 0.05,
            tolerance: 1e-12,
            slip_stops: 16,
            cap: None,
            overlap: 1e-9,
            plastic_arrivals: PlasticArrivals::default(),
            warm_start: false,
        }
    }
}

/// The impact laws: what a set of simultaneous collisions does to the velocities.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ImpactLaw {
    /// Rounds of Newton's restitution at the contacts that approach: symmetric, and passes a blow on.
    GeneralizedReflections,
    /// Newton's restitution at all contacts simultaneously: symmetric; shares a blow among all touching bodies.
    Newton,
    /// One collision after another, the fastest first: passes a blow on; not symmetric.
    Sequential,
    /// Coulomb's law for a weighted mean of the velocities before and after: never gains energy, friction included;
    /// restitution reverses a part of the slip too.
    Moreau,
    /// Compression, then restitution that gives back a share of compression's normal impulses.
    Poisson,
}

impl ImpactLaw {
    /// All of them.
    pub const ALL: [ImpactLaw; 5] = [
        ImpactLaw::GeneralizedReflections,
        ImpactLaw::Newton,
        ImpactLaw::Sequential,
        ImpactLaw::Moreau,
        ImpactLaw::Poisson,
    ];
    /// The name as users write it.
    pub fn name(self) -> &'static str {
        match self {
            ImpactLaw::GeneralizedReflections => "generalized_reflections",
            ImpactLaw::Newton => "newton",
            ImpactLaw::Sequential => "sequential",
            ImpactLaw::Moreau => "moreau",
            ImpactLaw::Poisson => "poisson",
        }
    }
}

/// What is done about overlap.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum PositionCorrection {
    /// Nothing.
    None,
    /// The notes' nudge: each overlapping pair is moved apart by a fraction of its overlap, lighter body more.
    Nudge,
    /// A pseudo-velocity that closes a fraction of the overlap, solved like a contact problem, moves the poses
    /// and is forgotten: kinetic energy stays.
    #[default]
    SplitImpulse,
}

/// What happens when a solve ends above the tolerance that was asked for. It is judged after every solve of a step
/// by the natural residual; with tolerance 0 nothing is asked and nothing judged.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum OnInaccurate {
    /// The report says so, and nothing else does.
    Ignore,
    /// The report says so; the Python package warns once per run with the explanation.
    #[default]
    Warn,
    /// The step is refused with an error that explains, and the world stays as it was.
    Raise,
    /// The islands above the tolerance go on to the next stronger solvers; what they leave is treated as `Warn`.
    Escalate,
}

impl OnInaccurate {
    /// All of them.
    pub const ALL: [OnInaccurate; 4] =
        [OnInaccurate::Ignore, OnInaccurate::Warn, OnInaccurate::Raise, OnInaccurate::Escalate];
    /// The name as users write it.
    pub fn name(self) -> &'static str {
        match self {
            OnInaccurate::Ignore => "ignore",
            OnInaccurate::Warn => "warn",
            OnInaccurate::Raise => "raise",
            OnInaccurate::Escalate => "escalate",
        }
    }
}

/// What happens to impacts that would gain energy, as Newton's restitution with friction can (theory section 3.6).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum EnergyGuard {
    /// They happen as their law has it, and the report says what they gained; the Python package warns once per run.
    Warn,
    /// Their island gets Moreau's law instead, which cannot gain, and the report counts it.
    #[default]
    Clamp,
    /// The step is refused with an error that names the bodies, and the world stays as it was.
    Raise,
}

impl EnergyGuard {
    /// All of them.
    pub const ALL: [EnergyGuard; 3] = [EnergyGuard::Warn, EnergyGuard::Clamp, EnergyGuard::Raise];
    /// The name as users write it.
    pub fn name(self) -> &'static str {
        match self {
            EnergyGuard::Warn => "warn",
            EnergyGuard::Clamp => "clamp",
            EnergyGuard::Raise => "raise",
        }
    }
}

/// All settings of a world.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields, bound = "")]
pub struct Settings<S: Space> {
    /// Acceleration of uniform gravity \[m/s^2\]. Default 9.81 downwards along the last axis.
    pub gravity: S::Vector,
    /// Length of a step \[s\]. Default 1/240.
    pub dt: f64,
    /// How free motion is integrated.
    pub integrator: Integrator,
    /// The time-stepping scheme.
    pub scheme: Scheme,
    /// Choices of the scheme `events`.
    pub events: EventSettings,
    /// Choices of the scheme `soft_step`.
    #[serde(default)]
    pub soft: SoftSettings,
    /// The solver of contact problems. Default the scheme's: `nncg` for fixed steps, under which taller stacks come to rest than
    /// under `pgs`, `exact` for events, for soft steps springs with a sweep each; there `pgs` and `nncg` sweep rigid contacts.
    pub solver: Option<SolverKind>,
    /// Most iterations per solve \[1\]. Default 100. In `soft_step` with a solver: sweeps of a substep before the bodies move, and as
    /// many after, all of which are taken. `exact` takes no more sweeps, but where a thousand
    /// of them take no longer than 30 factorisations: there these count.
    pub iterations: usize,
    /// Stop when the residual is at or below this \[m/s\]. Default 1e-6; 0 spends all iterations.
    pub tolerance: f64,
    /// Most factorisations per solve \[1\], read by solvers that factorise. Default 2000, more than any well-posed
    /// problem takes; a few dozen bound the time of a step, at the price of its accuracy, which the report tells.
    pub factorisations: usize,
    /// Which of several impulses that solve a step's contacts. Default any; minimum-norm impulses do not depend on the
    /// steps before nor on the order of contacts, and take a solver that looks for them.
    pub impulses: ImpulseChoice,
    /// What happens when a solve ends above the tolerance. Default warn: an engine that is trusted says when it is
    /// not accurate, and goes on.
    pub on_inaccurate: OnInaccurate,
    /// Start each solve from the impulses of the step before. Default true.
    pub warm_start: bool,
    /// How friction is limited.
    pub friction_law: FrictionLaw,
    /// The impact law; `None`: the scheme's own, see [`Settings::impact_law`].
    pub impact: Option<ImpactLaw>,
    /// What happens to impacts that would gain energy. Default clamp: what is trusted gains none.
    pub energy_guard: EnergyGuard,
    /// Impacts slower than this times |g| dt do not bounce \[1\]. Default 2: a resting body gains g dt in a step,
    /// so anything slower cannot be told from rest.
    pub rest_speed_factor: f64,
    /// What is done about overlap.
    pub position_correction: PositionCorrection,
    /// Share of the overlap that a step corrects \[1\]. Default 0.05: where solves are inexact, faster correction
    /// lifts in each step what the next one lets sink, and shakes towers down.
    pub correction_fraction: f64,
    /// Overlap that is left alone \[m\]; `None`: 1e-5 of the smallest body and a quarter of |g| dt^2, which the
    /// slowest contacts leave that have no impact of their own.
    pub correction_slop: Option<f64>,
    /// Gap up to which contacts are looked for \[m\]; `None`: what a step at twice the bodies' speeds can
    /// close, in `soft_step` at twice the speed of their approach; at least 5e-4, there 1e-2, of each body's size.
    pub contact_margin: Option<f64>,
    /// Mixing of the bodies' friction coefficients. Default geometric.
    pub friction_mixing: Mixing,
    /// Mixing of the bodies' coefficients of restitution, normal and tangential. Default max.
    pub restitution_mixing: Mixing,
}

impl<S: Space> Default for Settings<S> {
    fn default() -> Self {
        Settings {
            gravity: S::Vector::from_fn(|k| if k + 1 == S::DIM { -9.81 } else { 0.0 }),
            dt: 1.0 / 240.0,
            integrator: Integrator::default(),
            scheme: Scheme::default(),
            events: EventSettings::default(),
            soft: SoftSettings::default(),
            solver: None,
            iterations: 100,
            tolerance: 1e-6,
            factorisations: carom_solver::impulse_solver::most_factorisations(),
            impulses: ImpulseChoice::default(),
            on_inaccurate: OnInaccurate::default(),
            warm_start: true,
            friction_law: FrictionLaw::default(),
            impact: None,
            energy_guard: EnergyGuard::default(),
            rest_speed_factor: 2.0,
            position_correction: PositionCorrection::default(),
            correction_fraction: 0.05,
            correction_slop: None,
            contact_margin: None,
            friction_mixing: Mixing::Geometric,
            restitution_mixing: Mixing::Max,
        }
    }
}

impl<S: Space> Settings<S> {
    /// How long and how exactly a step's contacts are solved.
    pub fn solve(&self) -> SolveSettings {
        let Settings { iterations, tolerance, factorisations, impulses, .. } = *self;
        SolveSettings { iterations, tolerance, factorisations, impulses, content: None, polish: false }
    }
    /// The solver that is used: the one chosen, or the scheme's own.
    pub fn solver_kind(&self) -> SolverKind {
        let own = match self.scheme {
            Scheme::FixedStep => SolverKind::Nncg,
            Scheme::SoftStep => SolverKind::default(),
            Scheme::Events => SolverKind::Exact,
        };
        self.solver.unwrap_or(own)
    }
    /// The impact law of the run: the one asked for, or else the scheme's own.
    pub fn impact_law(&self) -> ImpactLaw {
        self.impact.unwrap_or(match self.scheme {
            // a blow is shared in the step in which it falls, whatever the row is long
            Scheme::FixedStep | Scheme::SoftStep => ImpactLaw::Newton,
            // rounds pass blows on, and do not jump where gaps close
            Scheme::Events => ImpactLaw::GeneralizedReflections,
        })
    }
    /// Checks every number.
    ///
    /// # Errors
    /// [`BuildError`] naming the first setting that is out of range.
    pub fn check(&self) -> Result<(), BuildError> {
        if !self.gravity.is_finite() {
            let problem = format!("got {:?}", self.gravity.as_slice());
            return Err(BuildError::setting("gravity", problem, "give finite numbers in m/s^2"));
        }
        if !(self.dt > 0.0 && self.dt.is_finite()) {
            return Err(BuildError::setting(
                "dt",
                format!("must be > 0, got {}", self.dt),
                "give a step length in s",
            ));
        }
        if self.iterations == 0 || self.iterations > 100_000_000 {
            let problem = format!("must be in 1 to 100,000,000, got {}", self.iterations);
            return Err(BuildError::setting(
                "iterations",
                problem,
                "give the most iterations that a solve may spend",
            ));
        }
        let at_least_zero = [
            ("tolerance", Some(self.tolerance), f64::MAX),
            ("rest_speed_factor", Some(self.rest_speed_factor), f64::MAX),
            ("correction_fraction", Some(self.correction_fraction), 1.0),
            ("correction_slop", self.correction_slop, f64::MAX),
            ("contact_margin", self.contact_margin, f64::MAX),
            ("events.touching", Some(self.events.touching), 1.0),
            ("events.rest_speed_factor", Some(self.events.rest_speed_factor), f64::MAX),
            ("events.tolerance", Some(self.events.tolerance), f64::MAX),
            ("events.overlap", Some(self.events.overlap), 1.0),
            ("soft.hertz", Some(self.soft.hertz), f64::MAX),
            ("soft.damping_ratio", Some(self.soft.damping_ratio), f64::MAX),
            ("soft.push_speed", Some(self.soft.push_speed), f64::MAX),
            ("soft.sleep_speed", Some(self.soft.sleep_speed), f64::MAX),
            ("soft.sleep_time", Some(self.soft.sleep_time), f64::MAX),
        ];
        for (field, value, most) in at_least_zero {
            if let Some(x) = value.filter(|x| !(*x >= 0.0 && *x <= most)) {
                let range = if most == 1.0 { "between 0 and 1" } else { "finite and >= 0" };
                return Err(BuildError::setting(
                    field,
                    format!("must be {range}, got {x}"),
                    "see the setting's unit",
                ));
            }
        }
        if self.events.cap == Some(0) {
            let remedy = "give the most events in a row of one set of bodies, or leave it out";
            return Err(BuildError::setting("events.cap", "must be at least 1, got 0", remedy));
        }
        if self.scheme == Scheme::Events && !self.integrator.kicks_half_way() {
            let problem = format!("{:?} does not kick half-way through a step", self.integrator);
            let remedy = "take trapezoid or implicit_midpoint with scheme events";
            return Err(BuildError::setting("integrator", problem, remedy));
        }
        self.check_soft()
    }

    /// What the scheme `soft_step` cannot be asked for.
    fn check_soft(&self) -> Result<(), BuildError> {
        let SoftSettings { substeps, .. } = self.soft;
        if substeps == 0 || substeps > 1000 {
            let problem = format!("must be in 1 to 1000, got {substeps}");
            return Err(BuildError::setting("soft.substeps", problem, "6 serve most scenes"));
        }
        if self.scheme != Scheme::SoftStep {
            return Ok(());
        }
        let own = |field, what: String, remedy| {
            let problem = format!("is {what}, but scheme soft_step has its own");
            Err(BuildError::setting(field, problem, remedy))
        };
        let remedy = "leave it out, or take scheme fixed_step or events";
        match self.solver {
            None => {}
            Some(SolverKind::Pgs | SolverKind::Nncg) if self.iterations > MOST_SWEEPS => {
                let problem = format!(
                    "must be at most {MOST_SWEEPS} with scheme soft_step, which spends them all, got {}",
                    self.iterations
                );
                return Err(BuildError::setting("iterations", problem, "10 to 50 serve most scenes"));
            }
            Some(SolverKind::Pgs | SolverKind::Nncg) => {}
            Some(solver) => {
                let problem = format!("is {}, but scheme soft_step solves by sweeps", solver.name());
                let remedy = "take pgs or nncg for rigid contacts, leave it out for springs, or take scheme \
                              fixed_step or events";
                return Err(BuildError::setting("solver", problem, remedy));
            }
        }
        if let Some(law) = self.impact {
            return own("impact", law.name().into(), remedy);
        }
        if self.friction_law == FrictionLaw::Box {
            return own("friction_law", "box".into(), "take friction_law disc, or scheme fixed_step");
        }
        if self.on_inaccurate == OnInaccurate::Escalate {
            let remedy = "take ignore, warn or raise, or scheme fixed_step";
            return own("on_inaccurate", "escalate".into(), remedy);
        }
        Ok(())
    }
}
