//! A rollout that can be differentiated: steps of the scheme `events` recorded with snapshots at distances, and the
//! way back through them (theory section 10.3). On the way back each stretch between two snapshots is taken again, bit
//! for bit the same, with its tapes kept; memory is that of the states, the snapshots and one stretch's tapes.

use super::backward::backward;
use super::coefficients::{PairGradient, share};
use super::flag::{Flag, flags};
use super::flowing::Scene;
use super::lift;
use super::sums::{StateBar, Sums, add};
use crate::bodies::Motion;
use crate::error::{BuildError, StepError};
use crate::force::Wrench;
use crate::settings::{PlasticArrivals, Scheme, Settings};
use crate::stepping::events::tape::{Deed, Tape};
use crate::world::{Trajectory, World};
use carom_geometry::Geometry;
use carom_math::{Column, Rotation};
use carom_solver::FrictionLaw;
use thiserror::Error;

/// Why a rollout cannot be recorded or differentiated.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum GradientError {
    /// A choice or an argument that has no gradient; nothing was done.
    #[error("{0}")]
    Refused(#[from] BuildError),
    /// A step failed.
    #[error("{0}")]
    Step(#[from] StepError),
}

/// How a rollout is recorded.
#[derive(Clone, Debug, Default)]
pub struct Plan<S: Geometry> {
    /// Steps \[1\].
    pub steps: usize,
    /// Length of a step \[s\]; `None`: the world's.
    pub dt: Option<f64>,
    /// Loads on each body in each step, constant through the step; empty for none.
    pub loads: Vec<Vec<Wrench<S>>>,
    /// Steps between snapshots; `None`: the square root of the steps, which needs least memory.
    pub stretch: Option<usize>,
}

/// Cotangents of a state: a number for each number of it; rotations by small rotation vectors in world axes.
#[derive(Clone, Debug, PartialEq)]
pub struct StateCotangent<S: Geometry> {
    /// Of the centres of mass \[1/m\].
    pub position: Vec<S::Vector>,
    /// Of the orientations \[1/rad\].
    pub rotation: Vec<S::Spin>,
    /// Of the velocities \[s/m\].
    pub velocity: Vec<S::Vector>,
    /// Of the angular velocities \[s/rad\].
    pub angular_velocity: Vec<S::Spin>,
}

impl<S: Geometry> StateCotangent<S> {
    /// Zeros for a number of bodies.
    pub fn zero(bodies: usize) -> Self {
        StateCotangent {
            position: vec![S::Vector::ZERO; bodies],
            rotation: vec![S::Spin::ZERO; bodies],
            velocity: vec![S::Vector::ZERO; bodies],
            angular_velocity: vec![S::Spin::ZERO; bodies],
        }
    }

    /// Cotangents of rotations given for their stored numbers (`[c, s]` or `[w, x, y, z]`) as those of small rotation
    /// vectors: phi -> phi q / 2.
    pub fn of_numbers(rotation: &S::Rotation, numbers: &[f64]) -> S::Spin {
        S::Spin::from_fn(|k| {
            let unit = S::Spin::from_fn(|i| if i == k { 1.0 } else { 0.0 });
            rotation.rate(unit).as_slice().iter().zip(numbers).map(|(r, n)| r * n).sum()
        })
    }

    fn column(&self, i: usize) -> StateBar {
        let mut bar = [0.0; 12];
        bar[..3].copy_from_slice(&lift::vector::<S>(self.position[i]));
        bar[3..6].copy_from_slice(&lift::spin::<S>(self.rotation[i]));
        bar[6..9].copy_from_slice(&lift::vector::<S>(self.velocity[i]));
        bar[9..].copy_from_slice(&lift::spin::<S>(self.angular_velocity[i]));
        bar
    }

    fn of(states: &[StateBar]) -> Self {
        StateCotangent {
            position: states.iter().map(|b| lift::to_vector::<S>(&b[..3])).collect(),
            rotation: states.iter().map(|b| lift::to_spin::<S>(&b[3..6])).collect(),
            velocity: states.iter().map(|b| lift::to_vector::<S>(&b[6..9])).collect(),
            angular_velocity: states.iter().map(|b| lift::to_spin::<S>(&b[9..])).collect(),
        }
    }
}

/// Derivatives of a number that a rollout's states make, by all that the rollout was given.
#[derive(Clone, Debug, PartialEq)]
pub struct Gradient<S: Geometry> {
    /// By the initial states.
    pub initial: StateCotangent<S>,
    /// By each body's mass, its inertia in proportion, which is by its density \[1/kg\]; 0 for obstacles.
    pub mass: Vec<f64>,
    /// By a factor on each body's inertia alone \[1\].
    pub inertia: Vec<f64>,
    /// By each body's coefficient of friction, through the mixing rule \[1\]; of a pair that the materials' table
    /// says, 0.
    pub friction: Vec<f64>,
    /// By each body's coefficient of restitution, in the same way \[1\].
    pub restitution: Vec<f64>,
    /// By the entries of the materials' table.
    pub pairs: Vec<PairGradient>,
    /// By the loads of each step.
    pub loads: Vec<Vec<Wrench<S>>>,
    /// By gravity \[s^2/m\].
    pub gravity: S::Vector,
}

/// Steps that were recorded.
pub struct Rollout<S: Geometry> {
    world: World<S>,
    dt: f64,
    loads: Vec<Vec<Wrench<S>>>,
    stretch: usize,
    snapshots: Vec<Trajectory<S>>,
    states: Vec<Motion<S>>,
    flags: Vec<Flag>,
}

impl<S: Geometry> Rollout<S> {
    /// Takes steps from a world's present state and records them; the world itself does not move.
    ///
    /// # Errors
    /// [`GradientError`] for a scheme, a friction law, force fields, rolling friction or loads that have no gradient,
    /// and for a step that fails.
    pub fn record(world: &mut World<S>, plan: &Plan<S>) -> Result<Self, GradientError> {
        check(world, plan)?;
        if let Some(i) = world.waiting().iter().position(|w| *w != Wrench::default()) {
            let (name, remedy) = (&world.bodies().names[i], "give forces as loads of each step");
            return Err(BuildError::body(name, "force", "is waiting for the next step", remedy).into());
        }
        let (mut world, _) = World::from_snapshot(&world.snapshot())?;
        let dt = plan.dt.unwrap_or(world.settings().dt);
        let root = (plan.steps as f64).sqrt().ceil() as usize;
        let mut rollout = Rollout {
            dt,
            loads: plan.loads.clone(),
            stretch: plan.stretch.unwrap_or(root).max(1),
            snapshots: Vec::new(),
            states: vec![world.bodies().motion.clone()],
            flags: Vec::new(),
            world: World::new(Settings::default())?,
        };
        for step in 0..plan.steps {
            if step % rollout.stretch == 0 {
                rollout.snapshots.push(world.trajectory());
            }
            apply(&mut world, &rollout.loads, step);
            let (_, tape) = world.step_taped(dt)?;
            if has_rows(&tape) {
                return Err(BuildError::setting("joint", "has no gradient", "remove it").into());
            }
            rollout.states.push(world.bodies().motion.clone());
            rollout.flags.extend(flags(world.bodies(), world.settings(), &tape, (step, dt)));
        }
        rollout.world = world;
        Ok(rollout)
    }

    /// The states: that before the first step, then that after each.
    pub fn states(&self) -> &[Motion<S>] {
        &self.states
    }
    /// Number of steps.
    pub fn steps(&self) -> usize {
        self.states.len() - 1
    }
    /// Steps between snapshots.
    pub fn stretch(&self) -> usize {
        self.stretch
    }
    /// The steps whose contact set is on an edge, where a derivative is that of one side; empty where there is none.
    pub fn flags(&self) -> &[Flag] {
        &self.flags
    }
    /// The world at the rollout's end.
    pub fn world(&self) -> &World<S> {
        &self.world
    }

    /// Takes cotangents of states (the number of steps before each beside it) to the derivatives of what they belong
    /// to: the reverse mode, at about twice the cost of the steps and, for each flow, of a dense factorisation.
    ///
    /// # Errors
    /// [`GradientError`] for a state that there is not, or cotangents of another number of bodies or not finite.
    pub fn pullback(
        &mut self,
        cotangents: &[(usize, StateCotangent<S>)],
    ) -> Result<Gradient<S>, GradientError> {
        let count = self.world.bodies().len();
        let mut given = self.columns(cotangents)?;
        let mut sums = Sums::new(count, self.steps());
        let mut bars = std::mem::take(&mut given[self.steps()]);
        bars.resize(count, [0.0; 12]);
        let end = self.world.trajectory();
        for (number, snapshot) in self.snapshots.iter().enumerate().rev() {
            let first = number * self.stretch;
            let last = (first + self.stretch).min(self.states.len() - 1);
            self.world.set_to(snapshot);
            let mut tapes = Vec::with_capacity(last - first);
            for step in first..last {
                apply(&mut self.world, &self.loads, step);
                tapes.push(self.world.step_taped(self.dt)?.1);
            }
            let scene = Scene { bodies: self.world.bodies(), settings: self.world.settings() };
            for (step, tape) in (first..last).zip(&tapes).rev() {
                backward(&scene, tape, (step, self.dt), &mut bars, &mut sums);
                for (bar, own) in bars.iter_mut().zip(&given[step]) {
                    add(bar, own, 1.0);
                }
            }
        }
        self.world.set_to(&end);
        Ok(self.gradient(&bars, &sums))
    }

    fn gradient(&self, bars: &[StateBar], sums: &Sums) -> Gradient<S> {
        let bodies = self.world.bodies();
        let (coefficients, pairs) = share(bodies, self.world.settings(), &sums.pairs);
        let mass = |(i, m): (usize, &f64)| {
            let d = &bodies.data[i];
            if d.inverse_mass > 0.0 { m + sums.inertia[i] / d.mass_properties.mass } else { 0.0 }
        };
        let wrench = |l: &[f64; 6]| Wrench {
            force: lift::to_vector::<S>(&l[..3]),
            torque: lift::to_spin::<S>(&l[3..]),
        };
        Gradient {
            initial: StateCotangent::of(bars),
            mass: sums.mass.iter().enumerate().map(mass).collect(),
            inertia: sums.inertia.clone(),
            friction: coefficients.iter().map(|c| c[0]).collect(),
            restitution: coefficients.iter().map(|c| c[1]).collect(),
            pairs,
            loads: sums.loads.iter().map(|step| step.iter().map(wrench).collect()).collect(),
            gravity: lift::to_vector::<S>(&sums.gravity),
        }
    }

    /// Cotangents by state, per body.
    fn columns(
        &self,
        cotangents: &[(usize, StateCotangent<S>)],
    ) -> Result<Vec<Vec<StateBar>>, GradientError> {
        let count = self.world.bodies().len();
        let mut given = vec![Vec::new(); self.states.len()];
        for (state, c) in cotangents {
            let lengths = [c.position.len(), c.rotation.len(), c.velocity.len(), c.angular_velocity.len()];
            let refuse = |problem: String, remedy: &str| BuildError::setting("cotangents", problem, remedy);
            if *state >= given.len() {
                let problem = format!("names state {state} of {}", given.len());
                return Err(refuse(problem, "state 0 is that before the first step").into());
            }
            if lengths != [count; 4] {
                let problem = format!("has entries for {lengths:?} bodies, the world has {count}");
                return Err(refuse(problem, "give one entry per body and field").into());
            }
            let columns: Vec<StateBar> = (0..count).map(|i| c.column(i)).collect();
            if let Some(i) = columns.iter().position(|b| b.iter().any(|x| !x.is_finite())) {
                let name = &self.world.bodies().names[i];
                let problem = format!("is not finite: {:?}", columns[i]);
                return Err(BuildError::body(name, "cotangent", problem, "give finite numbers").into());
            }
            let sum: &mut Vec<StateBar> = &mut given[*state];
            sum.resize(count, [0.0; 12]);
            sum.iter_mut().zip(&columns).for_each(|(s, c)| add(s, c, 1.0));
        }
        Ok(given)
    }
}

fn apply<S: Geometry>(world: &mut World<S>, loads: &[Vec<Wrench<S>>], step: usize) {
    for (i, wrench) in loads.get(step).into_iter().flatten().enumerate() {
        world.apply_wrench(i, *wrench);
    }
}

/// True where a step solved more than contacts.
fn has_rows<S: Geometry>(tape: &Tape<S>) -> bool {
    tape.deeds.iter().any(|deed| match deed {
        Deed::Meet { flows, .. } => flows.iter().any(|f| !f.last.problem.rows.is_empty()),
        Deed::Impact { rounds, .. } => rounds.iter().any(|r| !r.problem.rows.is_empty()),
    })
}

/// Refuses what has no gradient.
fn check<S: Geometry>(world: &World<S>, plan: &Plan<S>) -> Result<(), BuildError> {
    let (settings, bodies) = (world.settings(), world.bodies());
    let refuse = |field: &str, problem: &str, remedy: &str| Err(BuildError::setting(field, problem, remedy));
    if settings.scheme != Scheme::Events {
        return refuse("scheme", "has no gradient: fixed_step", "set scheme = \"events\"");
    }
    if settings.events.plastic_arrivals != PlasticArrivals::AtTheirMoment {
        let remedy = "set events.plastic_arrivals = \"at_their_moment\"";
        return refuse("events.plastic_arrivals", "has no gradient: within_the_step", remedy);
    }
    if S::SLIP > 1 && settings.friction_law != FrictionLaw::Disc {
        return refuse("friction_law", "has no gradient: box", "set friction_law = \"disc\"");
    }
    if let Some(name) = world.force_fields().next() {
        let problem = format!("has no gradient: '{name}'");
        let remedy = "remove it and give its forces as loads of each step";
        return Err(BuildError::setting("force field", problem, remedy));
    }
    let resists =
        |i: &usize| bodies.data[*i].rolling_friction > 0.0 || bodies.data[*i].spinning_friction > 0.0;
    if let Some(i) = (0..bodies.len()).find(resists) {
        let remedy = "set rolling_friction and spinning_friction to 0";
        return Err(BuildError::body(&bodies.names[i], "rolling_friction", "has no gradient", remedy));
    }
    if world.pairs().any(|(_, _, p)| p.rolling_friction.is_some() || p.spinning_friction.is_some()) {
        return refuse("pair", "has rolling or spinning friction, which has no gradient", "leave both out");
    }
    let turns_slips = |i: &usize| bodies.data[*i].tangential_restitution > 0.0;
    if let Some(i) = (0..bodies.len()).find(turns_slips) {
        let (name, remedy) = (&bodies.names[i], "set tangential_restitution to 0");
        return Err(BuildError::body(name, "tangential_restitution", "has no gradient", remedy));
    }
    if world.pairs().any(|(_, _, p)| p.tangential_restitution.is_some()) {
        return refuse("pair", "has tangential restitution, which has no gradient", "leave it out");
    }
    if !plan.loads.is_empty() && plan.loads.len() != plan.steps {
        let problem = format!("has entries for {} steps, the rollout has {}", plan.loads.len(), plan.steps);
        return Err(BuildError::setting("loads", problem, "give one entry per step"));
    }
    if let Some(step) = plan.loads.iter().position(|l| l.len() != bodies.len()) {
        let problem =
            format!("has {} bodies in step {step}, the world has {}", plan.loads[step].len(), bodies.len());
        return Err(BuildError::setting("loads", problem, "give one entry per body"));
    }
    Ok(())
}
