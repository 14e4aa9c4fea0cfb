//! The world: bodies, the choices of the run, and the step. Long because the one face that all else is reached by has its docs here.

mod checks;
mod last;
mod pushes;
mod sleeping;
mod standing;
mod threads;
mod trajectory;

use crate::ahead::Ahead;
use crate::assembly;
use crate::bodies::{Bodies, Motion};
use crate::body::{BodyKind, BodySpec};
use crate::error::{BuildError, StepError};
use crate::force::{ForceField, Wrench};
use crate::integrate::{Step, is_unit};
use crate::joint::{self, Reaction};
use crate::material::MaterialPair;
use crate::narrow_phase::{NarrowPhase, Touch};
use crate::observe::energy::{Energy, Momenta};
use crate::observe::explain::{Explanation, Scene, phase_of};
use crate::observe::groups::{GroupReport, Groups, LedgerGroup};
use crate::observe::ledger::Ledger;
use crate::observe::report::StepReport;
use crate::observe::step_times::{Laps, StepTimes};
use crate::settings::{Scheme, Settings};
use crate::stepping::events::tape::Tape;
use crate::stepping::schemes::{JointsLast, Schemes};
use crate::stepping::soft_step::{PatchList, Standing as StandingFaces};
use crate::stepping::{CameTo, Outside, SchemeReport};
use crate::warm_start::WarmStart;
use carom_geometry::Geometry;
use carom_math::{Column, Planar, Rotation, Spatial};
use carom_solver::{Certificate, ContactProblem, Impulses, Watch, unwatched};
use standing::Written;
pub(crate) use trajectory::Trajectory;

/// A world of the plane.
pub type World2 = World<Planar>;
/// A world of space.
pub type World3 = World<Spatial>;

/// Which of a step's two problems is meant.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Phase {
    /// The impacts at the step's start.
    Impact,
    /// The persistent contacts during the step.
    Contact,
}

impl Phase {
    /// The name as users write it.
    pub fn name(self) -> &'static str {
        match self {
            Phase::Impact => "impact",
            Phase::Contact => "contact",
        }
    }
}

/// Bodies, settings and time; advanced by [`World::step`].
///
/// ```
/// use carom::{BodySpec, PlanarShape, Settings, World2, vec2};
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// let mut world = World2::new(Settings::default())?;
/// world.add("floor", BodySpec::fixed(PlanarShape::HalfPlane { normal: vec2(0.0, 1.0) }))?;
/// world.add("ball", BodySpec::dense(PlanarShape::Circle { radius: 0.1 }, 1000.0).at(vec2(0.0, 0.1)))?;
/// let report = world.step(1.0 / 240.0)?;
/// assert!(report.residual() < 1e-6);
/// # Ok(())
/// # }
/// ```
pub struct World<S: Geometry> {
    settings: Settings<S>,
    pub(crate) bodies: Bodies<S>,
    pub(crate) time: f64,
    pub(crate) steps: u64,
    pub(crate) warm: WarmStart<S>,
    pub(crate) ledger: Ledger,
    groups: Groups<S>,
    fields: Vec<(String, Box<dyn ForceField<S>>)>,
    applied: Vec<Wrench<S>>,
    /// Some of them may not be zero.
    is_applied: bool,
    /// What may have been written since the last step began.
    written: Written,
    /// Energy after the last step, while nothing was written.
    known_energy: Option<Energy>,
    narrow_phase: NarrowPhase<S>,
    /// Faces of soft steps that stand; memory.
    standing_faces: StandingFaces<S>,
    /// What is known of loads in the step ahead; memory.
    pushes: pushes::Pushes,
    touches: Vec<Touch<S>>,
    schemes: Schemes<S>,
    checkpoint: (Motion<S>, WarmStart<S>),
    /// What the step before found; the scheme's memory is used in turns, so that a failed step loses nothing.
    spare: (Vec<Touch<S>>, Schemes<S>),
    /// Patches of the step before with those of islands that woke in this one; empty where none did.
    woken: PatchList<S>,
    islands: sleeping::Islands,
    /// Why the last step that failed because of a solve did.
    failure: Option<Explanation>,
    /// What a step tells of itself while `step_taped` asks.
    tape: Option<Tape<S>>,
    /// Where the time of the last step went, and that of the step under way.
    times: (StepTimes, StepTimes),
}

impl<S: Geometry> World<S> {
    /// An empty world.
    ///
    /// # Errors
    /// [`BuildError`] naming a setting that is out of range.
    pub fn new(settings: Settings<S>) -> Result<Self, BuildError> {
        settings.check()?;
        Ok(World {
            settings,
            bodies: Bodies::default(),
            time: 0.0,
            steps: 0,
            warm: WarmStart::default(),
            ledger: Ledger::default(),
            groups: Groups::default(),
            fields: Vec::new(),
            applied: Vec::new(),
            is_applied: false,
            written: Written::All,
            known_energy: None,
            narrow_phase: NarrowPhase::default(),
            standing_faces: StandingFaces::default(),
            pushes: pushes::Pushes::default(),
            touches: Vec::new(),
            schemes: Schemes::default(),
            checkpoint: Default::default(),
            spare: (Vec::new(), Schemes::default()),
            woken: PatchList::default(),
            islands: sleeping::Islands::default(),
            failure: None,
            tape: None,
            times: Default::default(),
        })
    }
    /// Adds a body and returns its index.
    ///
    /// # Errors
    /// [`BuildError`] naming body, field, value and remedy; the world is unchanged then.
    pub fn add(&mut self, name: &str, spec: BodySpec<S>) -> Result<usize, BuildError> {
        let stands = spec.kind != BodyKind::Dynamic;
        let index = self.written_bodies(Written::All).add(name, spec)?;
        self.applied.push(Wrench::default());
        if stands {
            // contacts of obstacles at rest with what sleeps are not looked for
            self.wake_all();
        }
        Ok(index)
    }
    /// Removes a body; the indices of those after it fall by one.
    ///
    /// # Errors
    /// [`BuildError`] when no body has this name, or a joint holds it.
    pub fn remove(&mut self, name: &str) -> Result<(), BuildError> {
        let index = self.bodies.find(name).ok_or_else(|| self.bodies.unknown(name))?;
        self.wake_all();
        self.written_bodies(Written::All).remove(name)?;
        self.groups.forget(name);
        self.applied.remove(index);
        self.forget_step();
        Ok(())
    }
    /// Forgets what the last step found: what it names is another now.
    pub(crate) fn forget_step(&mut self) {
        self.touches.clear();
        self.schemes = Schemes::default();
    }
    /// What the joints' bodies a got from their bodies b in the last step, joint by joint; empty before the first.
    pub fn reactions(&self) -> Vec<Reaction<S>> {
        let JointsLast { dt, impulses } = &self.schemes.joints;
        impulses.iter().map(|i| i.told(*dt)).collect()
    }
    /// Says the coefficients of a pair of materials, in either order, in place of what mixing makes of the bodies';
    /// what is `None` is mixed. Takes effect with the next step.
    ///
    /// # Errors
    /// [`BuildError`] for a material that no body was given, with the nearest name, or a coefficient out of range.
    pub fn set_pair(&mut self, one: &str, other: &str, pair: MaterialPair) -> Result<(), BuildError> {
        self.bodies.materials.set(one, other, pair)?;
        self.wake_all();
        Ok(())
    }
    /// Forgets what was said of a pair of materials; true when there was something.
    ///
    /// # Errors
    /// [`BuildError`] for a material that no body was given.
    pub fn remove_pair(&mut self, one: &str, other: &str) -> Result<bool, BuildError> {
        let was_there = self.bodies.materials.remove(one, other)?;
        self.wake_all();
        Ok(was_there)
    }
    /// What was said of pairs of materials, by their names.
    pub fn pairs(&self) -> impl Iterator<Item = (&str, &str, MaterialPair)> {
        self.bodies.materials.pairs()
    }
    /// The bodies.
    pub fn bodies(&self) -> &Bodies<S> {
        &self.bodies
    }
    /// The moving state of all bodies, to be changed freely between steps; non-finite numbers are refused by
    /// the next step.
    pub fn motion_mut(&mut self) -> &mut Motion<S> {
        &mut self.written_bodies(Written::Motion).motion
    }
    /// The bodies, for whatever else may be changed; wakes all that sleep.
    pub fn bodies_mut(&mut self) -> &mut Bodies<S> {
        self.wake_all();
        self.bodies.forget_shapes();
        self.written_bodies(Written::All)
    }
    /// Index of a named body.
    ///
    /// # Errors
    /// [`BuildError`] with the nearest name that exists.
    pub fn index(&self, name: &str) -> Result<usize, BuildError> {
        self.bodies.find(name).ok_or_else(|| self.bodies.unknown(name))
    }
    /// The settings.
    pub fn settings(&self) -> &Settings<S> {
        &self.settings
    }
    /// Replaces the settings; takes effect with the next step.
    ///
    /// # Errors
    /// [`BuildError`] naming a setting that is out of range; the old settings stay then.
    pub fn set_settings(&mut self, settings: Settings<S>) -> Result<(), BuildError> {
        settings.check()?;
        self.known_energy = None;
        if settings != self.settings {
            self.wake_all();
        }
        self.settings = settings;
        Ok(())
    }
    /// Time \[s\].
    pub fn time(&self) -> f64 {
        self.time
    }
    /// Steps taken.
    pub fn steps(&self) -> u64 {
        self.steps
    }
    /// Adds a force field, or replaces the one of this name.
    pub fn set_force_field(&mut self, name: &str, field: Box<dyn ForceField<S>>) {
        self.remove_force_field(name);
        self.fields.push((name.into(), field));
    }
    /// Removes a force field; true when there was one of this name.
    pub fn remove_force_field(&mut self, name: &str) -> bool {
        let before = self.fields.len();
        self.fields.retain(|(n, _)| n != name);
        self.fields.len() < before
    }
    /// Names of the force fields, in the order they act.
    pub fn force_fields(&self) -> impl Iterator<Item = &str> {
        self.fields.iter().map(|(n, _)| n.as_str())
    }
    /// Applies a wrench to a body for the next step only.
    pub fn apply_wrench(&mut self, body: usize, wrench: Wrench<S>) {
        self.applied[body].add(&wrench);
        self.is_applied = true;
    }
    /// Changes a body's velocities by an impulse \[N s\] at a world point: v + j/m, w + I^-1 (r x j) (item 16).
    pub fn apply_impulse(&mut self, body: usize, impulse: S::Vector, point: S::Vector) {
        let inverse = self.bodies.inverse_mass(body);
        let arm = point - self.bodies.motion.position[body];
        let twist =
            carom_solver::collision::apply_impulse(&self.bodies.motion.twist(body), &inverse, arm, impulse);
        if inverse.linear > 0.0 {
            self.motion_mut().set_twist(body, &twist);
        }
    }
    /// Sets a body's velocities from its momenta (p, L), see [`Bodies::set_momenta`].
    pub fn set_momenta(&mut self, body: usize, momentum: S::Vector, spin_momentum: S::Spin) {
        self.written_bodies(Written::Motion).set_momenta(body, momentum, spin_momentum);
    }
    /// Energy of the present state.
    pub fn energy(&self) -> Energy {
        Energy::of(&self.bodies, self.settings.gravity)
    }
    /// Momenta of the present state.
    pub fn momenta(&self) -> Momenta<S> {
        Momenta::of(&self.bodies)
    }
    /// The ledger since the world began.
    pub fn ledger(&self) -> &Ledger {
        &self.ledger
    }
    /// Asks for the books of groups of bodies, from here on and in each step's report: energy, momentum and angular
    /// momentum by cause. Replaces the groups there were; none end it. Snapshots do not have them.
    ///
    /// # Errors
    /// [`BuildError`] for a group's name that is empty or taken, or a body that is not there, named twice or an
    /// obstacle; the old groups stay then.
    pub fn set_ledger_groups(&mut self, groups: Vec<LedgerGroup>) -> Result<(), BuildError> {
        self.groups = Groups::new(groups, &self.bodies)?;
        Ok(())
    }
    /// The groups that books are kept of.
    pub fn ledger_groups(&self) -> &[LedgerGroup] {
        self.groups.list()
    }
    /// The books of the groups since they were asked for; energies and momenta are those after the last step.
    pub fn group_ledgers(&self) -> &[GroupReport<S>] {
        &self.groups.totals
    }
    /// The problem that a step of length `dt` \[s\] would solve from here. The world does not change, but its
    /// force fields are asked as in a step.
    ///
    /// # Errors
    /// As [`World::step`], save that a solver's refusal of the very problem asked for is none.
    pub fn problem(&mut self, dt: f64, phase: Phase) -> Result<ContactProblem<S>, StepError> {
        let motion = self.bodies.motion.clone();
        let (warm, applied, touches) = (self.warm.clone(), self.applied.clone(), self.touches.clone());
        let (time, steps, ledger) = (self.time, self.steps, self.ledger);
        let groups = std::mem::take(&mut self.groups);
        let taken = self.step(dt);
        // a step that succeeded left its problem in the scheme and the one before in the spare, a refused one
        // has them swapped back already: either way the tried scheme is taken out and the old one stays
        if taken.is_ok() {
            self.swap_scheme();
        }
        let tried = std::mem::take(&mut self.spare.1);
        self.motion_mut().copy_from(&motion);
        (self.warm, self.applied, self.touches, self.is_applied) = (warm, applied, touches, true);
        (self.time, self.steps, self.ledger, self.groups) = (time, steps, ledger, groups);
        self.find_sleepers();
        match taken {
            Err(
                StepError::SolverRefused { phase: refused, .. }
                | StepError::Inaccurate { phase: refused, .. },
            ) if refused == phase.name() => {}
            Err(error) => return Err(error),
            Ok(_) => {}
        }
        if phase == Phase::Contact {
            return Ok(tried.contact(&self.bodies).0.clone());
        }
        let mut problem = tried.impacts().problem.clone();
        if tried.impacts().struck.is_empty() {
            // nothing approaches: a problem without contacts, and not that of an earlier step
            assembly::begin(&mut problem, &self.bodies, self.settings.friction_law);
        }
        Ok(problem)
    }

    /// Takes one step of length `dt` \[s\].
    ///
    /// # Errors
    /// [`StepError`] naming the body or the argument; the world is then exactly as it was before.
    pub fn step(&mut self, dt: f64) -> Result<StepReport<S>, StepError> {
        self.step_watched(dt, &mut unwatched)
    }

    /// The same under observation: the watch is told of long solves now and then, and may end the step.
    ///
    /// # Errors
    /// As [`World::step`], and [`StepError::Interrupted`] when the watch asked to stop; the world is then exactly as
    /// it was before.
    pub fn step_watched(&mut self, dt: f64, watch: &mut Watch) -> Result<StepReport<S>, StepError> {
        let mut clock = Laps::start();
        let as_before = self.stand_as_before();
        self.check_before(dt, as_before)?;
        self.stir();
        self.keep_motion(as_before);
        self.checkpoint.1.keep(&mut self.warm);
        self.swap_scheme();
        self.times.1 = StepTimes::default();
        let mut taken = self.advance(dt, as_before, watch);
        self.failure = None;
        if let Err(error) = &mut taken {
            self.explain_failure(error);
            self.step_back();
            self.swap_scheme();
            return taken;
        }
        let within = self.times.1;
        self.times.0 = StepTimes { rest: (clock.lap() - within.whole()).max(0.0), ..within };
        taken
    }

    /// Where the time of the last step went that was taken.
    pub fn step_times(&self) -> StepTimes {
        self.times.0
    }

    /// A step of the scheme `events` that tells what it did; it is the same step.
    pub(crate) fn step_taped(&mut self, dt: f64) -> Result<(StepReport<S>, Tape<S>), StepError> {
        self.tape = Some(Tape::default());
        let taken = self.step(dt);
        let tape = self.tape.take().unwrap_or_default();
        taken.map(|report| (report, tape))
    }

    /// Keeps why a step fails, for which the problem must still be there, and tells the error.
    fn explain_failure(&mut self, error: &mut StepError) {
        let Some(phase) = phase_of(error) else { return };
        let Some(solve) = self.schemes.take_failed() else { return };
        let told = self.scene(true).explain_failure(phase, &solve);
        if let StepError::Inaccurate { explanation, .. } = error {
            *explanation = told.text().replace('\n', "; ");
        }
        self.failure = Some(told);
    }

    fn scene(&self, thorough: bool) -> Scene<'_, S> {
        let (problem, impulses, _) = self.schemes.contact(&self.bodies);
        let contact = (problem, impulses);
        Scene {
            thorough,
            bodies: &self.bodies,
            settings: &self.settings,
            touches: self.touches(),
            impact: (&self.schemes.impacts().problem, &self.schemes.impacts().impulses),
            contact,
        }
    }

    /// Why the last step is as accurate as it is; `report` must be that step's, for the problem of an earlier one is
    /// gone. Costs about as much as fifty sweeps over the worst island when the step is inaccurate.
    pub fn explain(&self, report: &StepReport<S>) -> Explanation {
        self.scene(true).explain(report)
    }
    /// The same without the estimate of the condition: about the cost of a few sweeps.
    pub fn explain_briefly(&self, report: &StepReport<S>) -> Explanation {
        self.scene(false).explain(report)
    }
    /// Why the last step failed, when a solve was what failed it: refused, or less accurate than asked.
    pub fn failure(&self) -> Option<&Explanation> {
        self.failure.as_ref()
    }
    /// The certificate of the last step's solve, with the worst contact's bodies named; of impacts, that of their
    /// first round. `island` narrows it to the island of a body, by index; `None` when nothing touches that body.
    pub fn certificate(&self, phase: Phase, island: Option<usize>) -> Option<Certificate> {
        let scene = self.scene(false);
        let (problem, impulses) = match phase {
            Phase::Contact => scene.contact,
            Phase::Impact => scene.impact,
        };
        let nothing = ContactProblem::new(Vec::new(), Vec::new());
        // of a step without impacts the problem is that of an earlier one
        let (problem, impulses) = match phase {
            Phase::Impact if self.schemes.impacts().struck.is_empty() => {
                (&nothing, &Impulses::zero(&nothing))
            }
            _ => (problem, impulses),
        };
        let mut certificate = Certificate::narrowed(problem, impulses, island)?;
        let name = |body: usize| self.bodies.names[body].clone();
        certificate.worst_names = certificate.worst_bodies.map(|(a, b)| (name(a), name(b)));
        Some(certificate)
    }

    fn swap_scheme(&mut self) {
        std::mem::swap(&mut self.touches, &mut self.spare.0);
        std::mem::swap(&mut self.schemes, &mut self.spare.1);
    }

    fn advance(&mut self, dt: f64, as_before: bool, watch: &mut Watch) -> Result<StepReport<S>, StepError> {
        let before = self.known_energy.take().unwrap_or_else(|| self.energy());
        let of_groups = self.groups.states(&self.bodies, self.settings.gravity);
        let mut stopped = false;
        let mut scheme = self.advance_scheme(dt, &mut |progress| {
            let goes_on = watch(progress);
            stopped |= !goes_on;
            goes_on
        })?;
        if stopped {
            // the solve came to its end at the very look that asked to stop
            let contacts = self.schemes.met(&self.touches).0;
            return Err(StepError::Interrupted { phase: Phase::Contact.name(), contacts, time: self.time });
        }
        if !as_before || scheme.came_to.is_none() {
            if self.normalize_rotations(as_before) {
                scheme.came_to = None;
            }
            self.check_after()?;
        }
        let asleep = self.bodies.asleep().len();
        self.settle(dt, &mut scheme.ledger);
        if self.bodies.asleep().len() > asleep {
            scheme.came_to = None;
        }
        self.warm.joints = joint::left(&self.bodies);
        Ok(self.observe(before, &of_groups, scheme, dt))
    }

    /// Takes the scheme's step; once more where force fields, which are asked within it, push a body to contacts that
    /// were not looked for.
    fn advance_scheme(&mut self, dt: f64, watch: &mut Watch) -> Result<SchemeReport<S>, StepError> {
        self.expect_applied(dt);
        let report = self.advance_once(dt, watch)?;
        if !self.was_pushed_further(dt) || !self.overlooked_some(dt) {
            return Ok(report);
        }
        self.step_back();
        self.advance_once(dt, watch)
    }

    fn advance_once(&mut self, dt: f64, watch: &mut Watch) -> Result<SchemeReport<S>, StepError> {
        let step = Step { time: self.time, dt, gravity: self.settings.gravity };
        self.schemes.ran = self.settings.scheme;
        self.schemes.begin_accounts(self.bodies.len(), !self.groups.is_empty());
        let mut begun = Ledger::default();
        let mut clock = Laps::start();
        self.narrow_phase.pairing = 0.0;
        if self.settings.scheme == Scheme::SoftStep {
            self.begin_soft_step(&step, &mut begun)?;
            self.times.1.solve += clock.lap();
            self.find_soft_faces(dt);
            self.times.1.add_search(&mut self.narrow_phase.pairing, clock.lap());
        }
        let quiet = self.is_quiet();
        let (fields, applied) = (&mut self.fields, &self.applied);
        let mut loads = loads_of(fields, applied);
        let (tape, workers) = (self.tape.as_mut(), &self.narrow_phase.workers.clone());
        let outside = Outside { quiet, loads: &mut loads, watch, tape, workers };
        let (bodies, settings, warm) = (&mut self.bodies, &self.settings, &mut self.warm);
        let mut impulses = joint::begin(bodies, &warm.joints, settings, self.time, &mut begun)?;
        let report = match settings.scheme {
            Scheme::FixedStep => {
                let ahead = Ahead::new(bodies, settings, dt, &self.pushes.pulls);
                self.times.1.solve += clock.lap();
                self.narrow_phase.update(&ahead, &mut self.touches);
                self.times.1.add_search(&mut self.narrow_phase.pairing, clock.lap());
                self.schemes.fixed_step.advance(bodies, &self.touches, settings, &step, outside, warm)
            }
            Scheme::Events => {
                let report = self.schemes.events.advance(bodies, settings, &step, outside, warm);
                self.touches.clone_from(&self.schemes.events.touches);
                report
            }
            Scheme::SoftStep => {
                let scheme = &mut self.schemes.soft_step;
                scheme.advance(bodies, settings, &step, outside, (warm, &mut self.standing_faces))
            }
        };
        let mut report = report?;
        self.times.1.solve += clock.lap();
        report.ledger.add(&begun);
        joint::add_all(&mut impulses, self.schemes.joint_impulses());
        self.schemes.joints = JointsLast { dt, impulses };
        Ok(report)
    }

    /// No loads act but gravity.
    fn is_quiet(&self) -> bool {
        self.fields.is_empty() && !self.is_applied
    }

    /// Bodies and warm start as before the step.
    fn step_back(&mut self) {
        self.bodies.motion.copy_from(&self.checkpoint.0);
        self.warm.clone_from(&self.checkpoint.1);
        self.find_sleepers();
    }

    fn observe(
        &mut self,
        before: Energy,
        of_groups: &[(Energy, Momenta<S>)],
        scheme: SchemeReport<S>,
        dt: f64,
    ) -> StepReport<S> {
        let CameTo { energy, momenta } =
            scheme.came_to.unwrap_or_else(|| CameTo { energy: self.energy(), momenta: self.momenta() });
        self.known_energy = Some(energy);
        let (accounts, gravity) = (self.schemes.accounts(), self.settings.gravity);
        let groups = self.groups.close(of_groups, accounts, &self.bodies, gravity);
        let mut ledger = scheme.ledger;
        ledger.closure = energy.total() - before.total() - ledger.sum();
        self.ledger.add(&ledger);
        self.time += dt;
        self.steps += 1;
        if std::mem::take(&mut self.is_applied) {
            self.applied.fill(Wrench::default());
        }
        let (contacts, deepest) = self.schemes.met(&self.touches);
        StepReport {
            step: self.steps,
            time: self.time,
            dt,
            solver: self.settings.solver_kind(),
            tolerance: self.settings.tolerance,
            budget: self.settings.iterations,
            contacts,
            asleep: self.bodies.asleep().len(),
            contact_solve: scheme.contact_solve,
            impact_solve: scheme.impact_solve,
            impacts: scheme.impacts,
            deepest,
            events: scheme.events,
            energy,
            momenta,
            ledger,
            groups,
            joints: self.reactions(),
        }
    }

    /// Rotations that users wrote, or that rounding moved off, get unit length back; true where there was one.
    fn normalize_rotations(&mut self, as_before: bool) -> bool {
        let mut some = false;
        let mut normalize = |q: &mut S::Rotation| {
            if !is_unit::<S>(q) {
                *q = q.renormalized().unwrap_or(*q);
                some = true;
            }
        };
        if as_before {
            for k in 0..self.bodies.movers().len() {
                let i = self.bodies.movers()[k] as usize;
                normalize(&mut self.bodies.motion.rotation[i]);
            }
        } else {
            self.bodies.motion.rotation.iter_mut().for_each(normalize);
            // what stands may have been among them
            self.may_write(Written::Motion);
        }
        some
    }
}

/// Gives the applied wrenches with those of all force fields.
fn loads_of<'a, S: Geometry>(
    fields: &'a mut [(String, Box<dyn ForceField<S>>)],
    applied: &'a [Wrench<S>],
) -> impl FnMut(f64, &Bodies<S>, &mut Vec<Wrench<S>>) -> Result<(), StepError> + 'a {
    move |time, bodies, out| {
        out.clear();
        out.extend_from_slice(applied);
        add_fields(fields, time, bodies, out)
    }
}

/// Adds all force fields, and refuses what is not finite by the body's name.
fn add_fields<S: Geometry>(
    fields: &mut [(String, Box<dyn ForceField<S>>)],
    time: f64,
    bodies: &Bodies<S>,
    out: &mut [Wrench<S>],
) -> Result<(), StepError> {
    for (name, field) in fields.iter_mut() {
        field.add(time, &bodies.motion, out).map_err(|problem| StepError::ForceField {
            field: name.clone(),
            problem,
            time,
        })?;
        if let Some(i) = out.iter().position(|w| !w.is_finite()) {
            let (force, torque) = (out[i].force, out[i].torque);
            let problem = format!(
                "gives body '{}' force {:?} N and torque {:?} N m; return finite numbers",
                bodies.names[i],
                force.as_slice(),
                torque.as_slice()
            );
            return Err(StepError::ForceField { field: name.clone(), problem, time });
        }
    }
    Ok(())
}
